"""A stored inspection made again from the bytes of its pictures, its rig and its prior: `relmodel replay`."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields, is_dataclass, replace
from typing import Any, NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt
import sqlalchemy as sa
from sqlalchemy import Connection

from relmodel.arrays import Columns, ColumnValues, Floats, Ints, row_count, take
from relmodel.errors import UsageError
from relmodel.geometry.transforms import matrices
from relmodel.resources import code_sha256
from relmodel.store import Run, Store, bulk
from relmodel.store.database import round_columns
from relmodel.store.runs import package_versions, read_rows
from relmodel.world.kinematics import Carrier
from vision.cameras.cameras import Needs, Prior, Selection, Standpoint
from vision.cameras.images import PictureBytes, read_pictures
from vision.cameras.record import read_recorded_rig
from vision.inspection.inspection import Inputs, InspectionRequest, carry_out
from vision.inspection.inspection_parameters import DEFAULTS
from vision.scene import Scenes

TOLERANCE, OTHER_TOLERANCE = 1e-9, 1e-6
"""greatest difference, as a share of a value above 1, by the code, packages and machine that made the run; by others"""

_NUMBERS = (sa.Boolean, sa.Integer, sa.Numeric, sa.Float)
_OF_ITSELF = {"run_event", "run_input", "row_digest"}  # relations that say of a run when and how it was made

T = TypeVar("T")


class RelationComparison(NamedTuple):
    """How the rows of a relation came out again.

    rows, again: how many the store has, and came out.  differing: how many of them differ; of unlike numbers of rows,
    how many there are more or less.  column: the one that differs most; difference: of numbers, by how much (of values
    above 1 as a share)."""

    relation: str
    rows: int
    again: int
    differing: int
    column: str | None = None
    difference: float | None = None


class Replay(NamedTuple):
    """outcomes: of each relation that the run wrote.  others: what has changed since the run, a sentence each."""

    outcomes: list[RelationComparison]
    others: list[str]

    @property
    def agrees(self) -> bool:
        return not any(outcome.differing for outcome in self.outcomes)


class _Rehearsal(Run):
    """A run made again under its number and identities: what it would write is kept, by relation."""

    is_rehearsal = True

    def __init__(self, store: Store, run: int, identities: dict[str, list[int]]) -> None:
        super().__init__(store, run, "inspect")
        self.written: dict[str, list[Columns]] = {}
        self._identities = identities

    def transact(self, work: Callable[[Connection], T]) -> T:
        with self.store.read() as connection, bulk.counting(connection):
            return work(connection)

    def new_ids(self, connection: Connection, table: str, count: int) -> Ints:
        """Those of the run, in their order; -1 where it has no more."""
        known = self._identities.get(table, [])
        return np.array([known.pop(0) if known else -1 for _ in range(count)])

    def append(self, connection: Connection, table: str, columns: Columns) -> int:
        if row_count(columns):
            self.written.setdefault(table, []).append(columns)
        return row_count(columns)

    def finish(self, message: str | None = None, connection: Connection | None = None, *, last: str = "rest") -> None:
        """Nothing is written."""


def replay(store: Store, run: int) -> Replay:
    """Make an inspection that came to a verdict again from what the store has of its inputs, and compare all its rows.
    Writes nothing.  Raises UsageError where the store does not have its pictures."""
    with store.read() as connection:
        (given,) = store.rows(connection, "audit/inspected", run=run)
        pictures = store.rows(connection, "audit/pictures", run=run)
        sets = store.select(connection, "unit_set", "id", order="view_no", run_id=run)["id"].tolist()
        inputs = _read_inputs(store, connection, run, given, pictures)
    stated, others = json.loads(given.parameters), _changed(json.loads(given.versions), given.code_sha256)
    if inputs.selection is not None:
        others.append(f"the world {given.world} has changed since: the parts are those that the run selected")
    identities = {
        "extraction": list(dict.fromkeys(row.extraction_id for row in pictures)),
        "unit_set": list(dict.fromkeys([*(row.unit_set_id for row in pictures), *sets])),
    }
    rehearsal = _Rehearsal(store, run, identities)
    with store.one_thread():
        carry_out(Scenes(store), rehearsal, _read_request(given, stated), inputs, _restored(DEFAULTS, stated))
    with store.read() as connection:
        kept = {row.relation for row in store.rows(connection, "report/written", run_id=run)} - set(rehearsal.written)
        lost = sorted(name for name in kept if "run_id" in store.table(name).c)
        tolerance = OTHER_TOLERANCE if others else TOLERANCE
        made = rehearsal.written | {name: [] for name in lost}
        compared = [(name, rows) for name, rows in made.items() if name not in _OF_ITSELF]
        return Replay([_compare(store, connection, run, *it, tolerance) for it in compared], others)


def _read_inputs(store: Store, connection: Connection, run: int, given: Any, pictures: Sequence[Any]) -> Inputs:
    """What a run was given: its row of `audit/inspected` and those of its pictures.  The parts that it selected are
    among them where its world has another revision now, which would be asked for them."""
    missing = [row.file_name for row in pictures if row.bytes is None]
    if missing:
        raise UsageError(
            f"the store has not kept {' and '.join(missing)}, so that run {run} cannot be made again: relmodel check "
            "holds its rows against each other"
        )
    rig = read_recorded_rig(store.columns(connection, "cameras/rig", rig_id=given.rig_id))
    of = store.select(connection, "standpoint", order="standpoint_no", run_id=run)
    if len(of["name"]):
        rigs = [read_recorded_rig(store.columns(connection, "cameras/rig", rig_id=int(it))) for it in of["rig_id"]]
        joints = [json.loads(it) if isinstance(it, str) else it for it in of["joints"]]
        covariances, sways = ([np.reshape(it, (6, 6)) for it in of[name]] for name in ("covariance", "sway"))
        carriers = [it or "" for it in of["carrier"]]
        each = map(Standpoint, matrices(of), covariances, joints, of["ignored"].tolist(), carriers, sways, rigs)
        rig = rigs[0].at_standpoints(dict(zip(of["name"], each, strict=True)))
    for row in pictures:
        if row.bits_from == "rig":
            rig.cameras[row.camera] = replace(rig.cameras[row.camera], bits=row.bits)
    read = read_pictures({row.camera: PictureBytes(row.file_name, row.bytes) for row in pictures}, rig)
    prior = selection = None
    if given.prior_covariance is not None:
        if given.is_given:
            prior = Prior(matrices(given._mapping), np.reshape(given.prior_covariance, (6, 6)))
        if not given.is_newest:
            parts = store.select(connection, "selected_part", order="occurrence_id", run_id=run)
            selection = Selection(parts["occurrence_id"], np.full(len(parts["shown"]), -1), parts["shown"])
    return Inputs(rig, read, prior, Needs(given.needs_translation_mm, given.needs_rotation), selection)


def _read_request(given: Any, stated: dict[str, Any]) -> InspectionRequest:
    """What a run was asked, by its parameters."""
    carrier, against = _restored(Carrier(), stated["carrier"]), stated["against"]
    if carrier.base_covariance is not None:
        carrier = replace(carrier, base_covariance=np.array(carrier.base_covariance))
    own: dict[str, Any] = {field.name: stated.get(field.name) for field in fields(InspectionRequest)}
    own["match"] = stated.get("match", True)  # runs of before always did
    where = {"world_id": given.world_id if against is None else -1, "against": against}
    return InspectionRequest(**own | where | {"carrier": carrier})


def _changed(versions: dict[str, str], code: str) -> list[str]:
    now = package_versions(*versions)
    others = [
        f"{name} was {version} and is {now.get(name, 'not there')}"
        for name, version in versions.items()
        if now.get(name) != version
    ]
    if code != code_sha256():
        others.append("the code of relmodel is another than the run's")
    return others


def _restored(default: Any, stated: Any) -> Any:
    """A parameter as a run recorded it; what it did not record is as the default has it."""
    if is_dataclass(default) and not isinstance(default, type):
        names = {field.name for field in fields(default)} & set(stated)
        return replace(default, **{name: _restored(getattr(default, name), stated[name]) for name in names})
    if isinstance(stated, dict):
        return {name: _restored(default.get(name), value) for name, value in stated.items()}
    if isinstance(stated, list):
        return tuple(_restored(None, value) for value in stated)
    return float(stated) if isinstance(default, float) else stated  # infinite ones are recorded as texts


def _compare(
    store: Store, connection: Connection, run: int, relation: str, made: list[Columns], tolerance: float
) -> RelationComparison:
    """How the rows of a relation came out again."""
    table = store.table(relation)
    kinds = {column.name: column.type for column in table.columns if not isinstance(column.type, sa.TIMESTAMP)}
    stored = read_rows(store, connection, run, relation, kinds)
    rows, count = len(next(iter(stored.values()))), sum(map(row_count, made))
    if rows != count or not rows:
        return RelationComparison(relation, rows, count, abs(rows - count))
    ours = {n: np.concatenate([_plain(of.get(n), row_count(of), kind) for of in made]) for n, kind in kinds.items()}
    theirs = {n: _plain(stored[n], rows, kind) for n, kind in kinds.items()}
    a, b = (take(it, _order(it, kinds)) for it in (round_columns(relation, side) for side in (theirs, ours)))
    apart = {n: _apart(np.asarray(a[n]), np.asarray(b[n])) for n in kinds}
    differing = int((np.max(list(apart.values()), axis=0) > tolerance).sum())
    column = max(apart, key=lambda n: float(apart[n].max()))
    worst = float(apart[column].max())
    return RelationComparison(
        relation, rows, count, differing, column if worst else None, worst if np.isfinite(worst) else None
    )


def _plain(values: ColumnValues, count: int, kind: sa.types.TypeEngine[Any]) -> npt.NDArray[Any]:
    """Values of a column, numbers as floats and null as NaN, arrays and texts as objects."""
    plain = list(bulk.objects(values, count))
    if isinstance(kind, _NUMBERS):
        return np.array([np.nan if value is None else value for value in plain], float)
    if isinstance(kind, sa.JSON):
        plain = [json.dumps(json.loads(v) if isinstance(v, str) else v, sort_keys=True) for v in plain]
    out = np.empty(count, object)
    out[:] = plain
    return out


def _order(side: Mapping[str, Any], kinds: Mapping[str, sa.types.TypeEngine[Any]]) -> Ints:
    """The order of rows by whole numbers, then texts, then other numbers: what a row is called comes before what was
    measured of it."""
    rank = {n: 0 if isinstance(k, sa.Integer) else 2 if isinstance(k, _NUMBERS) else 1 for n, k in kinds.items()}
    names = sorted((name for name, kind in kinds.items() if not isinstance(kind, sa.ARRAY)), key=rank.__getitem__)
    return np.lexsort([side[n].astype(str) if rank[n] == 1 else side[n] for n in reversed(names)])


def _apart(stored: npt.NDArray[Any], again: npt.NDArray[Any]) -> Floats:
    """How far each value is from its other, above 1 as a share; infinite where texts differ or one side has none."""
    if stored.dtype == object:
        return np.array([_value_apart(*pair) for pair in zip(stored, again, strict=True)])
    apart = np.abs(stored - again) / np.maximum(np.abs(stored), 1.0)
    same = (stored == again) | (np.isnan(stored) & np.isnan(again))
    return np.where(same, 0.0, np.nan_to_num(apart, nan=np.inf))


def _value_apart(stored: Any, again: Any) -> float:
    if stored is None or again is None or isinstance(stored, str):
        return 0.0 if stored is again or (isinstance(stored, str) and stored == again) else np.inf
    a, b = np.asarray(stored, float), np.asarray(again, float)
    return float(_apart(a, b).max(initial=0.0)) if a.shape == b.shape else np.inf
