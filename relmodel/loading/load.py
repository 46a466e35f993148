"""Loading a model file into a store."""

from __future__ import annotations

import hashlib
import time
from pathlib import Path

from relmodel.errors import InputError
from relmodel.loading import mesh, urdf
from relmodel.loading.neutral import LoadedModel
from relmodel.loading.step import TIME_LIMIT_S, read_step
from relmodel.loading.write import LoadReport, SourceFile, store_model
from relmodel.store import Run, Store

STEP_SUFFIXES = (".step", ".stp", ".p21")


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

    `unit` is asked for where the format states none (STL, OBJ, PLY).  A file that lost faces on reading is refused
    unless `allow_partial`.  Geometry that the store holds already is shared; the same content under the same name and
    variant adds nothing.  Raises InputError where the file is missing or bad; the store is then as it was, but for
    the row of the run and its load report.
    """
    path = Path(path)
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
    parameters = {"name": name, "variant": variant, "unit": unit, "allow_partial": allow_partial}
    packages = ("cadquery-ocp-novtk",) if suffix in STEP_SUFFIXES else ("trimesh",)
    inputs = {"model": (path.name, digest)}
    if suffix == urdf.SUFFIX:
        inputs |= {f"mesh {i}": (file.name, _digest(file)) for i, file in enumerate(urdf.mesh_files(path))}
    with Run.begin(store, "load", parameters, inputs=inputs, packages=(*packages, "numpy", "duckdb")) as run:
        try:
            began = time.perf_counter()
            model = _read(path, suffix, unit, allow_partial, time_limit_s)
            read = time.perf_counter()
            with run.write() as connection:
                report = store_model(run, connection, model, name, variant, SourceFile(path.name, digest))
                run.steps(connection, {"read": read - began, "store": time.perf_counter() - read})
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


def _read(path: Path, suffix: str, unit: str | None, allow_partial: bool, time_limit_s: float) -> LoadedModel:
    if suffix == urdf.SUFFIX:
        return urdf.read_urdf(path)
    if suffix not in STEP_SUFFIXES:
        return mesh.read_mesh(path, unit)
    return read_step(path, allow_partial=allow_partial, time_limit_s=time_limit_s)
