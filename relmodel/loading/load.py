"""Loading model files into a store: request, run, read, derive, write."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import asdict, dataclass, replace
from functools import partial
from importlib import import_module
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from sqlalchemy import Connection

from relmodel.arrays import Floats
from relmodel.errors import InputError
from relmodel.features import Feature, feature_class_key, recognise
from relmodel.geometry.curves import boxes_of
from relmodel.geometry.transforms import outermost
from relmodel.loading.snap import snap, stored_ids
from relmodel.model.content_keys import ModelKeys, ShapeKeys, model_keys, share
from relmodel.model.model import Finding, Model, Shape
from relmodel.names import MOST_NAME_BYTES, check_readable
from relmodel.progress import Progress, silent
from relmodel.readers import TIME_LIMIT_S, Reader, ReadOptions, read
from relmodel.readers.formats import check_unit, format_of
from relmodel.store import Run, Store, digest_inputs
from relmodel.store.database import Database
from relmodel.store.runs import cause_of

if TYPE_CHECKING:
    from relmodel.loading.write import LoadReport

# What the store will hold of a model: all of it is made before anything is written; the model stays as it is.


@dataclass(frozen=True)
class NewShape:
    """A shape that the store lacks, its keys, and what follows from it.

    class_keys: keys of the features' classes.  box: x0 y0 z0 x1 y1 z1, mm; area: of all surfaces, mm2.
    hull: corners (n, 3) of the convex hull of its triangles; None where it has none, or fills its box."""

    shape: Shape
    keys: ShapeKeys
    features: tuple[Feature, ...]
    class_keys: tuple[str, ...]
    box: Floats
    area: float
    hull: Floats | None


@dataclass(frozen=True)
class ModelFinding:
    """A finding, and which part and shape of the model it is of; None where it is of none."""

    finding: Finding
    part: int | None = None
    shape: int | None = None


@dataclass(frozen=True)
class Derivation:
    """A model ready to be written.  shapes: those that the store lacks, the first of equal ones.  findings: of the
    model and of the derivation."""

    model: Model
    keys: ModelKeys
    shapes: list[NewShape]
    findings: tuple[ModelFinding, ...]


def derive(
    model: Model, store: Database, connection: Connection, tell: Callable[[str], None] = lambda _: None
) -> Derivation:
    """Derive from a model what the store will hold; the store is read and not written.

    tell: is told what is being done.  Raises InputError where an assembly contains itself."""
    model = share(model)
    keys = model_keys(model)
    snapped = snap(store, connection, model, keys)
    if snapped is not model:
        model, keys = snapped, model_keys(snapped)
    part_of = {part.shape: i for i, part in reversed(list(enumerate(model.parts)))}
    # Findings of the readers: of the file, then by part, then by shape with the first part that has it.
    findings = [ModelFinding(finding) for finding in model.findings]
    findings += [ModelFinding(it, i, part.shape) for i, part in enumerate(model.parts) for it in part.findings]
    findings += [ModelFinding(one, part_of.get(i), i) for i, shape in enumerate(model.shapes) for one in shape.findings]
    shapes = []
    first = {k.shape: i for i, k in reversed(list(enumerate(keys.shapes)))}  # of equal ones
    known = stored_ids(store, connection, "shape", first)
    new = sorted(i for key, i in first.items() if key not in known)
    for count, no in enumerate(new, 1):
        tell(f"recognising features, shape {count} of {len(new)}")
        features: tuple[Feature, ...] = ()
        try:
            features = tuple(recognise(model.shapes[no]))
        except Exception as error:  # which never costs a load
            said = f"features could not be recognised ({type(error).__name__}: {error})"
            findings.append(ModelFinding(Finding("features_failed", said), part_of.get(no), no))
        shapes.append(_new_shape(model.shapes[no], keys.shapes[no], features))
    return Derivation(model, keys, shapes, tuple(findings))


def _new_shape(shape: Shape, keys: ShapeKeys, features: tuple[Feature, ...]) -> NewShape:
    every = np.concatenate([boxes_of(shape.surfaces), boxes_of(shape.arcs)])
    box = np.concatenate([every[:, :3].min(axis=0), every[:, 3:].max(axis=0)])
    area = float(np.sum(np.asarray(shape.surfaces["area"], float))) if shape.surfaces else 0.0
    return NewShape(shape, keys, features, tuple(map(feature_class_key, features)), box, area, _hull(shape, box))


def _hull(shape: Shape, box: Floats) -> Floats | None:
    meshed = len(np.unique(np.asarray(shape.mesh.triangle_surfaces)))
    if meshed == 0 or meshed < len(shape.surfaces["area"]):
        return None
    points = np.asarray(shape.samples.points.values, float).reshape(-1, 3)  # a fitted arc may pass beyond a mesh
    vertices = np.asarray(shape.mesh.vertices, float).reshape(-1, 3)
    used = np.zeros(len(vertices), bool)
    used[np.asarray(shape.mesh.triangles)] = True
    hull = np.unique(outermost(np.concatenate([vertices[used], points])), axis=0)
    at_corner = ((hull == box[:3]) | (hull == box[3:])).all(axis=1)
    return None if len(np.unique(hull[at_corner], axis=0)) == 8 else hull


# Files read in parallel; their models stay in memory until they are stored in order.
READERS = 2
# Heavy libraries that what follows from a model needs.
_NEEDED = ("relmodel.loading.write", "scipy.sparse.csgraph", "scipy.spatial", "shapely")


@dataclass(frozen=True)
class LoadRequest:
    """A STEP, mesh or URDF file to load under a name and a variant, and how.

    unit: required where the format states none (STL, OBJ, PLY).  allow_partial: take a file that lost faces on reading,
    which is refused otherwise; strict: refuse one with findings (`load_finding`).  time_limit_s: for reading it.
    occluder: a mesh stays triangles between crease edges."""

    path: Path
    name: str
    variant: str = ""
    unit: str | None = None
    allow_partial: bool = False
    strict: bool = False
    time_limit_s: float = TIME_LIMIT_S
    occluder: bool = False


def load(store: Store, path: str | Path, *, reader: Reader = read, **how: Any) -> LoadReport:
    """Load a file; `how` are the fields of `LoadRequest`, `name` among them.

    Geometry that the store holds already is shared; the same content under the same name and variant adds nothing.
    `reader` reads the file (default: in a child process).  Raises InputError where the file is missing or bad, takes
    too long to read, is refused as `LoadRequest` says, or is given no name; the store is then as it was but for the
    run, its load report and its findings."""
    ((_, outcome),) = load_all(store, [LoadRequest(Path(path), **how)], reader=reader)
    if isinstance(outcome, InputError):
        raise outcome
    return outcome


def load_all(
    store: Store, requests: Sequence[LoadRequest], progress: Progress = silent, *, reader: Reader = read
) -> Iterator[tuple[LoadRequest, LoadReport | InputError]]:
    """Load files in turn, each with its report, or the reason why it was refused; the others are loaded all the same.

    The next files are read meanwhile; the rows are those of one `load` after another."""
    waiting = iter(requests)
    with ThreadPoolExecutor(READERS) as pool:
        jobs = deque(_begin(pool, reader, request) for request in islice(waiting, READERS))
        for number in range(len(requests)):
            request, job = jobs.popleft()
            jobs.extend(_begin(pool, reader, following) for following in islice(waiting, 1))
            outcome: LoadReport | InputError
            tell = partial(_tell, progress, request.path.name, number, len(requests))
            tell("reading")
            try:
                outcome = _load(store, request, job, tell)
            except InputError as error:
                outcome = error
            yield request, outcome


def _tell(progress: Progress, file: str, number: int, files: int, what: str) -> None:
    progress(f"{file}: {what}", number, files)


_Reading: TypeAlias = "Future[Model]"


def _begin(pool: ThreadPoolExecutor, reader: Reader, request: LoadRequest) -> tuple[LoadRequest, _Reading | InputError]:
    """Begin to read a file, unless the call is bad."""
    path = request.path
    try:
        if not isinstance(request.name, str) or not request.name.strip():
            raise InputError(f"{path.name} is to be loaded under the name {request.name!r}: name the object")
        if not isinstance(request.variant, str):
            raise InputError(
                f"{path.name} is to be loaded as the variant {request.variant!r}: give text, '' for the plain one"
            )
        format_of(path)
        check_readable(path)
        for what, given in (("name", request.name), ("variant", request.variant)):
            if len(given.encode(errors="replace")) > MOST_NAME_BYTES:
                raise InputError(f"{path.name} is to have a {what} of over {MOST_NAME_BYTES} bytes: shorten it")
        if path.stat().st_size == 0:
            raise InputError(f"{path} is empty: export it again")
        check_unit(path, request.unit)
    except InputError as error:
        return request, error
    options = ReadOptions(request.unit, request.name, request.time_limit_s, request.occluder)
    return request, pool.submit(reader, path, options)


def _load(
    store: Store, request: LoadRequest, reading: _Reading | InputError, tell: Callable[[str], None]
) -> LoadReport:
    """Load a file that is being read, in a run of its own; `tell` is told what is being done with it."""
    from relmodel.loading.load_parameters import DEFAULTS

    asked = {name: value for name, value in vars(request).items() if name not in ("path", "time_limit_s")}
    parameters = asdict(DEFAULTS) | asked
    packages = ("cadquery-ocp-novtk", "trimesh", "numpy", "duckdb")
    files: Mapping[str, tuple[str, str]] = {}
    findings: Sequence[Finding] = ()
    with Run.begin(store, "load", parameters, packages=packages) as run:
        try:
            for module in _NEEDED:  # while a child reads, this process has nothing else to do
                import_module(module)

            from relmodel.loading.write import write

            if isinstance(reading, InputError):
                raise reading
            model = reading.result()
            source, *others = ((file.name, file.sha256) for file in model.files)
            files = {f"mesh {i}": file for i, file in enumerate(others)} | {"model": source}
            findings = model.findings
            model = _allowed(model, request)
            run.step("read")
            tell("comparing with the store")

            @store.one_thread()
            def store_model(connection: Connection) -> LoadReport:
                nonlocal findings
                derived = derive(model, store, connection, tell)
                findings = [noted.finding for noted in derived.findings]
                if findings and request.strict:
                    raise InputError(
                        f"{request.path} has {len(findings)} finding{'s'[: len(findings) > 1]}, the first: "
                        f"{findings[0].message}: mend the file, or load it without --strict"
                    )
                tell("storing")
                run.inputs(connection, files)
                report = write(run, connection, derived, request.name, request.variant)
                run.finish(connection=connection, last="store")
                return report

            return run.transact(store_model)
        except Exception as error:
            _note_refusal(run, error, files or digest_inputs({"model": request.path}), findings)
            raise


def _allowed(model: Model, request: LoadRequest) -> Model:
    """The model, lost faces among its findings.  Raises InputError where faces were lost and that is not allowed."""
    listed, came = model.faces_in_file, model.faces_loaded
    if listed is None or came >= listed:
        return model
    lost = f"{listed - came} of {listed} faces of {request.path} were lost on reading"
    if not request.allow_partial:
        raise InputError(f"{lost}: repair the file, or take what is left with --allow-partial")
    finding = Finding("lost_faces", f"{listed - came} of {listed} faces were lost on reading", listed - came, 0)
    return replace(model, findings=(*model.findings, finding))


def _note_refusal(
    run: Run, error: Exception, files: Mapping[str, tuple[str, str]], findings: Sequence[Finding]
) -> None:
    """End a run whose file was not loaded, with the reason and with what was found."""
    from relmodel.loading.write import append_finding_rows

    message = str(error) or type(error).__name__

    def write(connection: Connection) -> None:
        run.inputs(connection, files)
        run.append(connection, "load_report", {"run_id": [run.id], "status": "refused", "message": message})
        append_finding_rows(run, connection, findings, {})
        run.fail(message, connection, cause=cause_of(error))

    run.transact(write)
