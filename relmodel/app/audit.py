"""What runs decided and why, what differs between two of them, and room made by removing them, from rows only."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import asdict, dataclass
from datetime import UTC, datetime, timedelta
from typing import Any, NamedTuple

import numpy as np
import sqlalchemy as sa
from sqlalchemy import Connection, Row

from relmodel.arrays import Floats
from relmodel.errors import UsageError
from relmodel.geometry.transforms import matrices, rotation_vector
from relmodel.names import nearest_name
from relmodel.printing import rounded
from relmodel.store import Run, Store, sql


def run_named(store: Store, connection: Connection, name: int | str | None) -> int:
    """The run of that number; of `last`, or where no name is given, the newest inspection.

    Raises UsageError for another name, and where there is no inspection."""
    if isinstance(name, int):
        return name
    if name is not None and name != "last":
        if not name.isdecimal():
            raise UsageError(f"{name} names no run: give its number, or last")
        return int(name)
    found = store.rows(connection, "audit/newest_inspection")
    if not found:
        raise UsageError(f"the store {store.name} holds no inspection: name a run, as relmodel runs numbers them")
    return int(found[0].run_id)


def find_run(store: Store, connection: Connection, run: int) -> Row[Any]:
    """The row of a run, as `audit/run` gives it.  Raises UsageError where there is none."""
    found = store.rows(connection, "audit/run", run_id=run)
    if not found:
        raise UsageError(f"there is no run {run}: relmodel runs lists them")
    return found[0]


RUN_IN_SHORT = ("run", "kind", "object", "serial", "result", "began_at", "seconds", "message")


def run_in_short(row: Any) -> tuple[Any, ...]:
    """What a person looks at of a run, a row of `run/runs`, as RUN_IN_SHORT names it; of an inspection the result is
    its verdict, how many findings, and how much was checked."""
    result = row.state
    if row.pose_verdict is not None:
        result = row.part_verdict if row.pose_verdict == "usable" else f"pose {row.pose_verdict}"
    if row.in_view:
        result += f", {row.findings} finding{'s' * (row.findings != 1)}" if row.findings else ""
        result += f", {row.checked} of {row.in_view} checked"
    began = row.began_at and row.began_at.isoformat(" ", "minutes")[:16]
    seconds = None if row.seconds is None else rounded(row.seconds, 1)
    message = row.message and row.message.partition(";")[0]
    return row.run, row.kind, row.object, row.serial, result, began, seconds, message


# Why an inspection decided as it did: sentences that follow from its rows.
#
# Each subject is a folder of `queries/why`. Its queries run in the order of their names, and each row is a sentence.
# What runs record in future is explained by one more query.


class Sentence(NamedTuple):
    """A sentence from a query of a subject; topic: the query's name, as `rules` or `correspondence`."""

    topic: str
    sentence: str


def explain(
    store: Store, name: int | str | None, *, pose: bool = False, arc: str | None = None, feature: str | None = None
) -> list[Sentence]:
    """What a run, as `run_named` finds it, says of an image arc (CAMERA:NUMBER), of a part or feature by its path, of
    the pose, else of the verdict.

    Raises UsageError where it is not there, and for other runs than inspections that came to a verdict."""
    asked: dict[str, Any] = {"camera": "", "arc": -1, "path": feature or ""}
    subject = "feature" if feature is not None else "pose" if pose else "verdict"
    if arc is not None:
        camera, _, number = arc.rpartition(":")
        if not camera or not number.isdigit():
            raise UsageError(f"the arc {arc} is not CAMERA:NUMBER: give a camera and the number of an arc, as left:17")
        subject, asked = "arc", {"camera": camera, "arc": int(number), "path": ""}
    with store.read() as connection:
        asked["run"] = inspection_named(store, connection, name)
        said = [
            Sentence(query.rpartition("/")[2].partition("_")[2], str(row.sentence))
            for query in sql.query_names(f"why/{subject}")
            for row in connection.execute(sql.query(query), asked)
        ]
        if not said:
            raise UsageError(_nothing(store, connection, **asked))
    return said


def inspection_named(store: Store, connection: Connection, name: int | str | None) -> int:
    """The run that `run_named` finds.  Raises UsageError unless it is an inspection with a verdict and its rows."""
    run = run_named(store, connection, name)
    it = find_run(store, connection, run)
    if it.kind != "inspect":
        raise UsageError(f"run {run} is of kind {it.kind}: name one of kind inspect, as relmodel runs lists them")
    pruned = store.select(connection, "pruned_run", "by_run_id", run_id=run, what="runs")["by_run_id"]
    if len(pruned):
        raise UsageError(f"what run {run} found was pruned by run {pruned[0]}")
    if it.verdict is None:
        raise UsageError(f"run {run} came to no verdict, it is {it.state}{f': {it.message}' if it.message else ''}")
    return run


def _nothing(store: Store, connection: Connection, run: int, camera: str, arc: int, path: str) -> str:
    if camera:
        cameras = {row.camera: int(row.arcs) for row in store.rows(connection, "audit/cameras", run=run)}
        if camera not in cameras:
            return f"run {run} has no camera {camera}: name one of {', '.join(cameras)}"
        return f"the {camera} picture of run {run} has no arc {arc}: it has arcs 0 to {cameras[camera] - 1}"
    paths = store.select(connection, "part_in_view", "path", order="in_view_no", run_id=run)["path"].tolist()
    near = nearest_name(path, paths)
    hint = f"did you mean {near}?" if near else "the view part_in_view lists what is"
    return f"run {run} has no {path} in view: {hint}"


# What differs between two runs: what they were given, with which code, the step at which they part, and what came out.
#
# Each query of `queries/audit/compare` gives names and values of a run; those that differ are reported, in the order of
# the files' names. From `STEPS` on these are what the run did, step by step, and the first difference is where the two
# runs part.

_FOLDER = "audit/compare"
STEPS = "50"  # files with this number and above are steps of a run
_LONGEST = 40  # characters of a value that is shown in short
_DIGEST = re.compile(r"\b([0-9a-f]{8})[0-9a-f]{24,}\b")
_NUMBER = re.compile(r"-?\d+(\.\d*)?([eE][-+]?\d+)?")
_AXES = ("x", "y", "z")
_UNITS = ("mm", "mm", "mm", "rad", "rad", "rad")


class Difference(NamedTuple):
    """One thing that differs: of the first run and of the second; of numbers how far, and one standard deviation."""

    section: str
    name: str
    first: str | float | None
    second: str | float | None
    difference: float | None = None
    sigma: float | None = None


def compare_runs(store: Store, first: int, second: int) -> list[Difference]:
    """What differs between two runs; empty where nothing does.  Raises UsageError where there is no such run."""
    with store.read() as connection:
        recorded = [find_run(store, connection, run) for run in (first, second)]
        given, did = list[Difference](), list[Difference]()
        for name in sql.query_names(_FOLDER):
            number, _, section = name.rpartition("/")[2].partition("_")
            of_both = [
                {str(row.name): _number(row.value) for row in store.rows(connection, name, run=run)}
                for run in (first, second)
            ]
            (did if number >= STEPS else given).extend(_differing(section, *of_both))
        for section in ("parameters", "versions"):
            of_both = [dict(_flat(json.loads(getattr(row, section)))) for row in recorded]
            given += _differing(section, *of_both)
        poses = [store.rows(connection, "report/pose_matrix", run_id=run) for run in (first, second)]
    part = [Difference("first step that differs", did[0].section, None, None)] if did else []
    return [*given, *part, *did, *(_poses(poses[0][0], poses[1][0]) if all(poses) else ())]


def beginnings(first: str | float | None, second: str | float | None) -> tuple[str | float | None, str | float | None]:
    """Two values in short: digests by their first digits, long texts from near where they differ."""
    a, b = (_DIGEST.sub(r"\1...", v) if isinstance(v, str) else v for v in (first, second))
    same = next((i for i, (x, y) in enumerate(zip(str(a), str(b), strict=False)) if x != y), 0)
    start = same - _LONGEST // 2 if same > _LONGEST * 3 // 4 else 0
    return _part(a, start), _part(b, start)


def _part(value: str | float | None, start: int) -> str | float | None:
    if not isinstance(value, str) or len(value) <= _LONGEST:
        return value
    end = start + _LONGEST
    return f"{'...' if start else ''}{value[start:end].strip()}{'...' if end < len(value) else ''}"


def _number(text: str | None) -> str | float | None:
    """A number where a text is one, so that tables round it."""
    return float(text) if text is not None and _NUMBER.fullmatch(text) else text


def _differing(section: str, first: dict[str, Any], second: dict[str, Any]) -> list[Difference]:
    names = sorted(first.keys() | second.keys())
    return [Difference(section, n, first.get(n), second.get(n)) for n in names if first.get(n) != second.get(n)]


def _flat(value: Any, name: str = "") -> Iterator[tuple[str, str]]:
    """The leaves of a JSON value, named by the way to them: `localisation.verdict.weights[0]`."""
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from _flat(inner, f"{name}.{key}" if name else key)
    elif isinstance(value, list):
        for i, inner in enumerate(value):
            yield from _flat(inner, f"{name}[{i}]")
    else:
        yield name, json.dumps(value)


def _poses(first: Any, second: Any) -> list[Difference]:
    """How two poses differ: along and about the world's axes, then along and about those of the first rig."""
    a, b = (matrices(row._mapping) for row in (first, second))
    if np.array_equal(a, b) and list(first.covariance) == list(second.covariance):
        return []
    shift, turn = b[:3, 3] - a[:3, 3], rotation_vector(b[:3, :3] @ a[:3, :3].T)
    frames = {"world": ("covariance_world", np.eye(3)), "rig": ("covariance", a[:3, :3])}
    sigmas = {frame: [_sigmas(getattr(row, name)) for row in (first, second)] for frame, (name, _) in frames.items()}
    out: list[Difference] = []
    old: float | None
    new: float | None
    for frame, (_, axes) in frames.items():
        moved = np.concatenate([axes.T @ shift, axes.T @ turn]).tolist()
        for i, (by, sigma) in enumerate(zip(moved, np.hypot(*sigmas[frame]).tolist(), strict=True)):
            if frame == "world" and i < 3:
                name, old, new = f"{_AXES[i]}, mm", float(a[i, 3]), float(b[i, 3])
            else:
                name, old, new = f"{'turn about' if i > 2 else 'shift along'} {_AXES[i % 3]}, {_UNITS[i]}", None, None
            out.append(Difference(f"pose in the {frame}", name, old, new, by, sigma))
    for frame, (before, after) in sigmas.items():
        labels = [f"{'about ' if i > 2 else ''}{_AXES[i % 3]}, {unit}" for i, unit in enumerate(_UNITS)]
        both = zip(labels, before.tolist(), after.tolist(), strict=True)
        out += [Difference(f"sigma in the {frame}", label, x, y, y - x) for label, x, y in both if x != y]
    return out


def _sigmas(covariance: Any) -> Floats:
    """Standard deviations (6,) of a covariance, 6x6 row-major."""
    variance = np.diag(np.reshape(np.asarray(covariance, float), (6, 6)))
    return np.asarray(np.sqrt(np.maximum(variance, 0.0)))


# Making room: removing rows of inspections, or the bytes of their pictures, from the store.
#
# The runs themselves stay, with inputs, events and ledger, and say by which run they were pruned. Pictures and what was
# extracted from them go only where no other run has read them.

WHAT = ("runs", "pictures")
_LEVELS = ("localisation", "matching")  # levels whose tables hold what an inspection found
_OF_RUNS = ("threshold",)  # further tables of this kind


@dataclass(frozen=True)
class Pruning:
    """Which inspections: of this number, in this state, of this verdict, begun longer ago than so many days; None: any.
    what: all that they found, or the bytes of their pictures."""

    what: str
    run: int | None = None
    state: str | None = None
    verdict: str | None = None
    older_than_days: float | None = None


def plan_pruning(store: Store, p: Pruning) -> tuple[list[int], dict[str, int]]:
    """The runs and how many rows of which tables would go.  Raises UsageError where nothing says which runs."""
    with store.write() as connection:  # writes temporary tables only
        runs = _select(store, connection, p)
        if not runs:
            return [], {}
        with _asked(store, connection, runs):
            doomed = _doomed(store, connection, p.what)
            # In one statement: each takes longer to ask than to run.
            counts = connection.execute(sa.union_all(*(_count(store, *one) for one in doomed))).all()
    rows = {table: count for table, count in counts if count}
    return runs, {table: rows[table] for table, *_ in doomed if table in rows}


def prune(store: Store, p: Pruning) -> tuple[int, list[int], dict[str, int]]:
    """Remove what `plan_pruning` lists, in a run of kind `prune`: its number, the runs, and how many rows went."""
    _check(p)

    def take(connection: Connection) -> tuple[int, list[int], dict[str, int]]:
        runs = _select(store, connection, p)
        with _asked(store, connection, runs):
            doomed = _doomed(store, connection, p.what)
            rows = {table: store.delete(connection, table, column, keys) for table, column, keys in doomed}
        run.append(connection, "pruned_run", {"run_id": runs, "what": p.what, "by_run_id": run.id})
        run.finish(f"{len(runs)} runs pruned: {sum(rows.values())} rows", connection)
        return run.id, runs, {table: count for table, count in rows.items() if count}

    with Run.begin(store, "prune", asdict(p)) as run:
        return run.transact(take)


def _check(p: Pruning) -> None:
    if p.what not in WHAT:
        raise UsageError(f"{p.what!r} cannot be pruned: name one of {', '.join(WHAT)}")
    if (p.run, p.state, p.verdict, p.older_than_days) == (None, None, None, None):
        raise UsageError("no runs are chosen for pruning: give --run, --state, --verdict or --older-than")


def _select(store: Store, connection: Connection, p: Pruning) -> list[int]:
    _check(p)
    before = None if p.older_than_days is None else datetime.now(UTC) - timedelta(days=p.older_than_days)
    asked = {"what": p.what, "run": p.run, "state": p.state, "verdict": p.verdict, "before": before}
    return [int(row.run_id) for row in store.rows(connection, "prune/runs", **asked)]


@contextmanager
def _asked(store: Store, connection: Connection, runs: list[int]) -> Iterator[None]:
    """The keys of what is removed, as relations: asked_run, asked_image, asked_extraction, asked_unit_set."""
    with ExitStack() as held:
        for what in ("run", "image", "extraction", "unit_set"):
            found = runs if what == "run" else [row[0] for row in store.rows(connection, f"prune/{what}s")]
            keys = {f"{what}_id": np.asarray(found, np.int64)}
            held.enter_context(store.relation(connection, f"asked_{what}", keys))
        yield


def _doomed(store: Store, connection: Connection, what: str) -> list[tuple[str, str, str]]:
    """Table, key column and relation of keys of what is removed, referring tables first."""
    if what == "pictures":
        return [("image_blob", "image_id", "asked_image")]
    key_of = {"image_blob": "image", "extraction": "extraction", "unit_set": "unit_set"}
    for row in store.rows(connection, "store/relations"):
        if row.standing != "view" and row.relation not in key_of:
            columns = set(store.table(row.relation).columns.keys())
            if row.level not in _LEVELS and row.relation not in _OF_RUNS:
                columns -= {"run_id"}
            if key := next((key for key in ("run", "extraction", "unit_set") if f"{key}_id" in columns), None):
                key_of[row.relation] = key
    return [(table, f"{key_of[table]}_id", f"asked_{key_of[table]}") for table in reversed(store.parents_first(key_of))]


def _count(store: Store, table: str, column: str, keys: str) -> sa.Select[str, int]:
    """The table, and how many rows of it would go."""
    own = store.table(table)
    asked = sa.select(sa.table(keys, sa.column(column)).c[column])
    key = own.c[column if column in own.c else "id"]
    return sa.select(sa.literal(table), sa.func.count()).select_from(own).where(key.in_(asked))
