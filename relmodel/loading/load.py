"""Loading a model file into a store."""

from __future__ import annotations

import hashlib
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from itertools import islice
from pathlib import Path

from relmodel.errors import InputError
from relmodel.loading.write.model import LoadReport, SourceFile, store_model
from relmodel.model.model import LoadedModel
from relmodel.progress import Progress, silent
from relmodel.readers import urdf
from relmodel.readers.mesh import read as mesh
from relmodel.readers.step.read import TIME_LIMIT_S, read_step
from relmodel.store import Run, Store

STEP_SUFFIXES = (".step", ".stp", ".p21")


# Files read side by side; what is read is held in memory until its turn to be stored comes.
READERS = 2

# Heavy libraries that features, relations and contacts need.
_NEEDED_TO_STORE = ("networkx", "numba", "scipy.sparse.csgraph", "scipy.spatial", "shapely")


@dataclass(frozen=True)
class Request:
    """A file to load, under which name and variant, and how: as the parameters of `load`."""

    path: Path
    name: str
    variant: str = ""
    unit: str | None = None
    allow_partial: bool = False
    time_limit_s: float = TIME_LIMIT_S


def load(
    store: Store,
    path: str | Path,
    *,
    name: str,
    variant: str = "",
    unit: str | None = None,
    allow_partial: bool = False,
    time_limit_s: float = TIME_LIMIT_S,
) -> LoadReport:
    """Load a STEP, mesh or URDF file under a name and a variant.

    `unit` is asked for where the format states none (STL, OBJ, PLY).  A file that lost faces on reading or contradicts
    itself is refused unless `allow_partial`.  Geometry that the store holds already is shared; the same content under
    the same name and variant adds nothing.  Raises InputError where the file is missing or bad, takes longer than
    `time_limit_s` to read, or is given no name; the store is then as it was, but for the row of the run and its load
    report.
    """
    request = Request(Path(path), name, variant, unit, allow_partial, time_limit_s)
    ((_, outcome),) = load_all(store, [request])
    if isinstance(outcome, InputError):
        raise outcome
    return outcome


def load_all(
    store: Store, requests: Sequence[Request], progress: Progress = silent
) -> Iterator[tuple[Request, LoadReport | InputError]]:
    """Load files in turn, each with its report, or the reason why it was refused; the others are loaded all the same.

    The next files are read meanwhile, so the rows are those of one `load` after another, only sooner.
    """
    waiting = iter(requests)
    steps = 2 * len(requests)
    with ThreadPoolExecutor(READERS) as pool:
        jobs = deque(_begin(pool, request) for request in islice(waiting, READERS))
        done = 0
        while jobs:
            request, job = jobs.popleft()
            jobs.extend(_begin(pool, following) for following in islice(waiting, 1))
            outcome: LoadReport | InputError
            if isinstance(job, InputError):
                outcome = job
            else:
                progress(f"{request.path.name}: reading", done, steps)
                storing = partial(progress, f"{request.path.name}: storing", done + 1, steps)
                try:
                    outcome = _store(store, request, job, storing)
                except InputError as error:
                    outcome = error
            done += 2
            yield request, outcome


@dataclass(frozen=True)
class _Job:
    """A file that is being read.

    by_child: whether a process of its own reads it.  reading: gives the model and how long it took, s.
    """

    digest: str
    inputs: dict[str, tuple[str, str]]
    packages: tuple[str, ...]
    by_child: bool
    reading: Future[tuple[LoadedModel, float]]


def _begin(pool: ThreadPoolExecutor, request: Request) -> tuple[Request, _Job | InputError]:
    """Begin to read a file, unless the call is bad."""
    path, unit = request.path, request.unit
    try:
        if not isinstance(request.name, str) or not request.name.strip():
            raise InputError(f"{path.name} is to be loaded under the name {request.name!r}: name the object")
        if not isinstance(request.variant, str):
            raise InputError(
                f"{path.name} is to be loaded as the variant {request.variant!r}: give text, '' for the plain one"
            )
        suffix = _suffix(path)
        if not path.is_file():
            raise InputError(f"there is no file {path}: check its name")
        if path.stat().st_size == 0:
            raise InputError(f"{path} is empty: export it again")
        if suffix[1:] in mesh.FORMATS:
            mesh.check_unit(path, unit)
        elif unit is not None:
            raise InputError(f"{path.name} states its own unit of length: leave --unit out")
        digest = _digest(path)
        inputs = {"model": (path.name, digest)}
        if suffix == urdf.SUFFIX:
            inputs |= {f"mesh {i}": (file.name, _digest(file)) for i, file in enumerate(urdf.mesh_files(path))}
    except InputError as error:
        return request, error
    by_child = suffix in STEP_SUFFIXES
    packages = ("cadquery-ocp-novtk" if by_child else "trimesh", "numpy", "duckdb")
    return request, _Job(digest, inputs, packages, by_child, pool.submit(_read, request, suffix))


def _store(store: Store, request: Request, job: _Job, storing: Callable[[], None]) -> LoadReport:
    """Store what is read, in a run of its own that begins before; `storing` is told when it is read."""
    named = {"name": request.name, "variant": request.variant}
    parameters = {**named, "unit": request.unit, "allow_partial": request.allow_partial}
    with Run.begin(store, "load", parameters, inputs=job.inputs, packages=job.packages) as run:
        try:
            if job.by_child:
                for module in _NEEDED_TO_STORE:  # while the child reads, this process has nothing else to do
                    import_module(module)
            model, read = job.reading.result()
            storing()
            began = time.perf_counter()
            with run.write() as connection:
                source = SourceFile(request.path.name, job.digest)
                report = store_model(run, connection, model, request.name, request.variant, source)
                run.steps(connection, {"read": read, "store": time.perf_counter() - began})
                run.end("ok", connection=connection)
        except Exception as error:
            message = str(error) or type(error).__name__
            with run.write() as connection:
                run.append(connection, "load_report", {"run_id": [run.id], "status": "refused", "message": message})
                run.end("refused" if isinstance(error, InputError) else "failed", message, connection)
            raise
    return report


def _digest(path: Path) -> str:
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise InputError(f"{path} cannot be read ({error.strerror}): check its permissions") from error


def _suffix(path: Path) -> str:
    """Suffix that says the format, that of the file within a `.gz` of STEP.  Raises InputError for an unknown one."""
    suffix = path.suffix.lower()
    if suffix == ".gz" and Path(path.stem).suffix.lower() in STEP_SUFFIXES:
        return Path(path.stem).suffix.lower()
    if suffix in STEP_SUFFIXES or suffix == urdf.SUFFIX or suffix[1:] in mesh.FORMATS:
        return suffix
    known = ", ".join([*STEP_SUFFIXES, *(f".{f}" for f in mesh.FORMATS), urdf.SUFFIX])
    raise InputError(f"{path.name} is of no known format: give a file named {known}, or .step.gz")


def _read(request: Request, suffix: str) -> tuple[LoadedModel, float]:
    """The model of a file, and how long it took to read, s."""
    began = time.perf_counter()
    if suffix == urdf.SUFFIX:
        model = urdf.read_urdf(request.path)
    elif suffix in STEP_SUFFIXES:
        model = read_step(request.path, allow_partial=request.allow_partial, time_limit_s=request.time_limit_s)
    else:
        model = mesh.read_mesh(request.path, request.unit, name=request.name)
    return model, time.perf_counter() - began
