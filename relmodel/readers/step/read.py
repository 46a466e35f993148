"""STEP files (AP203, AP214, AP242), read by the CAD kernel in a child process under limits of time and memory.

The kernel crashes on many damaged files, so it never runs in the caller's process; the child hands its result back
through a file, for the kernel prints on stdout.
"""

from __future__ import annotations

import gzip
import os
import pickle
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

from relmodel.errors import InputError
from relmodel.model import sharing
from relmodel.model.model import LoadedModel
from relmodel.readers.step import part21, soundness

TIME_LIMIT_S = 300.0
MEMORY_LIMIT = 6 << 30
UNPACKED_LIMIT = 2 << 30
SUFFIXES = (".step", ".stp", ".step.gz", ".stp.gz")


def read_step(
    path: str | Path,
    *,
    allow_partial: bool = False,
    time_limit_s: float = TIME_LIMIT_S,
    memory_limit: int = MEMORY_LIMIT,
) -> LoadedModel:
    """Read a STEP file, gzipped or not, into parts, shapes and assemblies; lengths become mm.

    Raises InputError where the file is missing, not STEP, takes more than `time_limit_s` or `memory_limit` (bytes),
    holds no face, loses faces on reading or contradicts itself (`allow_partial` takes what is left).
    """
    path = Path(path)
    if not path.is_file():
        raise InputError(f"there is no file {path}: give the path of a STEP file")
    with tempfile.TemporaryDirectory(prefix="relmodel-") as folder:
        plain = path
        if path.suffix.lower() == ".gz":
            plain = Path(folder) / "in.step"
            _unpack(path, plain)
        summary = part21.summarise(plain, str(path))
        if summary.faces == 0:
            raise InputError(f"{path} holds no face, neither exact nor of triangles: export its solids as a B-rep")
        if summary.damage and not allow_partial:
            raise InputError(_damaged(path, summary.damage))
        model = _run(plain, path, Path(folder) / "out.pickle", time_limit_s, memory_limit)
        faces = summary.faces
        if model.faces_loaded < faces:  # lost, or of no product from the first
            faces = max(part21.faces_in_use(plain), model.faces_loaded)
    if not soundness.is_finite(model):
        raise InputError(f"{path} is damaged, for it gives sizes that are not finite: export it again")
    model.damage = summary.damage or soundness.contradiction(model)
    sharing.share(model)
    model.schema_name = summary.schema_name
    model.faces_in_file = faces
    for part in model.parts:
        part.number = summary.numbers.get(part.name, part.number)
    if model.faces_loaded < faces and not allow_partial:
        raise InputError(
            f"{faces - model.faces_loaded} of {faces} faces of {path} were lost on reading: "
            "repair the file, or take what is left with --allow-partial"
        )
    if model.damage and not allow_partial:
        raise InputError(_damaged(path, model.damage))
    return model


def _damaged(path: Path, why: str) -> str:
    return f"{path} is damaged, for {why}: export it again, or take it as it is with --allow-partial"


def _unpack(path: Path, to: Path) -> None:
    size = 0
    try:
        with gzip.open(path, "rb") as packed, to.open("wb") as out:
            while chunk := packed.read(1 << 20):
                size += len(chunk)
                if size > UNPACKED_LIMIT:
                    raise InputError(f"{path} unpacks to more than {UNPACKED_LIMIT >> 30} GB: split the assembly")
                out.write(chunk)
    except (OSError, EOFError) as error:
        raise InputError(f"{path} cannot be unpacked ({error}): copy it again") from error


def _run(plain: Path, path: Path, out: Path, time_limit_s: float, memory_limit: int) -> LoadedModel:
    command = [sys.executable, "-m", "relmodel.readers.step.kernel", str(plain.resolve()), str(out), str(memory_limit)]
    root = str(Path(__file__).resolve().parents[2])
    try:
        done = subprocess.run(
            command,
            cwd=root,
            env=os.environ | {"OPENBLAS_NUM_THREADS": "1"},  # its products are small, and each thread takes memory
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            timeout=time_limit_s,
            check=False,
        )
    except subprocess.TimeoutExpired as error:
        raise InputError(
            f"reading {path} took more than {time_limit_s:g} s and was stopped: split the assembly, or repair the file"
        ) from error
    if done.returncode == 0 and out.is_file():
        with out.open("rb") as result:
            model = pickle.load(result)
        if isinstance(model, LoadedModel):
            return model
        raise InputError(str(model).replace("{path}", str(path)))
    if done.returncode < 0:
        name = signal.Signals(-done.returncode).name
        raise InputError(
            f"the CAD kernel crashed on {path} ({name}): export it again, for it is damaged, "
            f"or split it where it takes more than {memory_limit / (1 << 30):.3g} GB of memory"
        )
    last = done.stderr.decode(errors="replace").strip().splitlines()
    raise InputError(f"{path} could not be read ({last[-1] if last else 'no reason given'}): export it again")
