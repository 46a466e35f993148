"""Two loaded variants compared: rows of `variant_comparison` and `variant_difference`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from sqlalchemy import Connection

from relmodel.errors import UsageError
from relmodel.geometry.curves import Curves
from relmodel.geometry.transforms import matrices
from relmodel.store import Run, Store
from relmodel.store.columns import stack
from relmodel.variants.features import FeatureSet, feature_set, pair_features
from relmodel.variants.pairing import near_pairs, one_to_one
from relmodel.variants.surfaces import TOLERANCE, SurfaceSet, boundary_integrals, pair_surfaces, surface_set

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

_Block = dict[str, Any]

REACH = 100.0  # mm
_ALONE = {"a": "removed", "b": "added"}
_TURN = 1e-7  # rad


@dataclass(frozen=True)
class Comparison:
    """A comparison in the store: its identity, the run that made it, and how many differences of each level and
    status it has."""

    id: int
    run_id: int
    counts: dict[tuple[str, str], int]


def compare(store: Store, before: tuple[str, str], after: tuple[str, str], *, reach: float = REACH) -> Comparison:
    """Compare the newest revisions of two variants, given as (name, variant): a run of kind `diff`, made once.

    Placed parts are told apart by path, then by content and place; features and surfaces within parts whose geometry
    changed.  What stands farther than `reach` mm from where it was counts as removed and added.  Raises UsageError
    where a variant is not loaded.
    """
    with store.read() as connection:
        ids = [_variant(store, connection, *named) for named in (before, after)]
        known = store.rows(connection, "compare/known", variant_a_id=ids[0][0], variant_b_id=ids[1][0], reach=reach)
        if known:
            return _comparison(store, connection, int(known[0].id), int(known[0].run_id))
    parameters = {"before": list(before), "after": list(after), "reach": reach}
    with Run.begin(store, "diff", parameters, packages=("numpy", "scipy")) as run, run.write() as connection:
        comparison = int(store.new_ids(connection, "variant_comparison", 1)[0])
        run.append(
            connection,
            "variant_comparison",
            {
                "id": [comparison],
                "run_id": run.id,
                "variant_a_id": ids[0][0],
                "variant_b_id": ids[1][0],
                "reach": reach,
            },
        )
        rows = _differences(store, connection, ids[0][1], ids[1][1], reach)
        count = len(rows["level"])
        run.append(
            connection, "variant_difference", {"comparison_id": comparison, "difference_no": np.arange(count), **rows}
        )
        run.end("ok", connection=connection)
        return _comparison(store, connection, comparison, run.id)


def _variant(store: Store, connection: Connection, name: str, variant: str) -> tuple[int, int]:
    rows = store.rows(connection, "load/latest_variant", name=name, variant=variant)
    if not rows:
        known = [f"{r.name}:{r.variant}".rstrip(":") for r in store.rows(connection, "newest_objects")]
        asked = f"{name}:{variant}".rstrip(":")
        raise UsageError(
            f"there is no object {asked}: name one of those loaded: {', '.join(known) or 'there are none'}"
        )
    return int(rows[0].id), int(rows[0].object_id)


def _comparison(store: Store, connection: Connection, comparison: int, run_id: int) -> Comparison:
    counts = store.rows(connection, "compare/counts", comparison_id=comparison)
    return Comparison(comparison, run_id, {(r.level, r.status): int(r.how_many) for r in counts})


@dataclass(frozen=True)
class _Placed:
    """The placed parts of an object."""

    path: npt.NDArray[np.object_]
    part: Ints
    shape: Ints
    pose: Floats  # (n, 4, 4) object_from_part


def _placed(store: Store, connection: Connection, object_id: int) -> _Placed:
    rows = store.columns(connection, "object_expansion", object_id=object_id)
    parts = np.flatnonzero(rows["part_id"] >= 0)
    pose = matrices(rows)[parts]
    path = np.asarray(rows["path"], object)[parts]
    return _Placed(path, rows["part_id"][parts].astype(np.int64), rows["shape_id"][parts].astype(np.int64), pose)


def _differences(store: Store, connection: Connection, object_a: int, object_b: int, reach: float) -> _Block:
    a, b = (_placed(store, connection, o) for o in (object_a, object_b))
    i, j = _paired_parts(a, b, reach)
    shift = b.pose[j, :3, 3] - a.pose[i, :3, 3]
    relative = np.einsum("nij,nkj->nik", b.pose[j, :3, :3], a.pose[i, :3, :3])
    # From the skew part, which keeps small angles; the trace tells those above a right angle.
    skew = np.stack([relative[:, p, q] - relative[:, q, p] for p, q in ((2, 1), (0, 2), (1, 0))], axis=1) / 2
    angle = np.arctan2(np.linalg.norm(skew, axis=1), (np.trace(relative, axis1=1, axis2=2) - 1) / 2)
    stays = (np.linalg.norm(shift, axis=1) < TOLERANCE) & (angle < _TURN)
    same = a.part[i] == b.part[j]
    status = np.where(same, np.where(stays, "identical", "moved"), "changed").astype(object)
    shift[stays], angle[stays] = 0.0, 0.0
    given = {"path_a": a.path[i], "path_b": b.path[j], "shape_a": a.shape[i], "shape_b": b.shape[j]}
    blocks = [_rows("part", status, given, shift, angle)]
    for side, x, taken in (("a", a, i), ("b", b, j)):
        left = np.setdiff1d(np.arange(len(x.path)), taken)
        given = {f"path_{side}": x.path[left], f"shape_{side}": x.shape[left]}
        blocks.append(_rows("part", [_ALONE[side]] * len(left), given))
    levels: dict[str, list[_Block]] = {"feature": [], "surface": []}
    other = a.shape[i] != b.shape[j]
    _, first = np.unique(np.stack([a.shape[i], b.shape[j]])[:, other], axis=1, return_index=True)
    for row in np.flatnonzero(other)[np.sort(first)].tolist():
        found = _inside(store, connection, int(a.shape[i[row]]), int(b.shape[j[row]]), reach)
        for level, block in found:
            count = len(block["status"])
            where = {"path_a": a.path[i[row]], "path_b": b.path[j[row]], "shape_a": a.shape[i[row]]}
            where |= {"shape_b": b.shape[j[row]]}
            levels[level].append({**block, **{name: [value] * count for name, value in where.items()}})
    return stack([*blocks, *levels["feature"], *levels["surface"]])


def _paired_parts(a: _Placed, b: _Placed, reach: float) -> tuple[Ints, Ints]:
    """Placed parts that correspond: by path; else of one content, the nearest; else of one name, at the same place."""
    _, i, j = np.intersect1d(a.path.astype(str), b.path.astype(str), return_indices=True)
    free_a, free_b = (np.setdiff1d(np.arange(len(x.path)), taken) for x, taken in ((a, i), (b, j)))
    left, right, distance = near_pairs(a.pose[free_a, :3, 3], b.pose[free_b, :3, 3], reach)
    left, right = free_a[left], free_b[right]
    same = a.part[left] == b.part[right]
    last_a, last_b = (np.array([str(p).rpartition("/")[2] for p in x.path], object) for x in (a, b))
    stays = np.abs(a.pose[left] - b.pose[right]).max(axis=(1, 2), initial=0) < TOLERANCE
    good = same | (stays & (last_a[left] == last_b[right]))
    left, right, distance, same = left[good], right[good], distance[good], same[good]
    rows = one_to_one(left, right, ~same, distance)
    i, j = np.concatenate([i, left[rows]]), np.concatenate([j, right[rows]])
    order = np.argsort(i, kind="stable")
    return i[order].astype(np.int64), j[order].astype(np.int64)


def _inside(store: Store, connection: Connection, shape_a: int, shape_b: int, reach: float) -> list[tuple[str, _Block]]:
    """Differences of the features and of the surfaces of two shapes."""
    a, b = (_surfaces(store, connection, s) for s in (shape_a, shape_b))
    surfaces = pair_surfaces(a, b, reach)
    features = [_features(store, connection, s) for s in (shape_a, shape_b)]
    pairs, angle = pair_features(features[0], features[1], surfaces, reach)
    out = []
    for level, found, turned, sizes in (
        ("feature", pairs, angle, [len(f) for f in features]),
        ("surface", surfaces, np.zeros(len(surfaces.a)), [len(a), len(b)]),
    ):
        out.append(
            (level, _rows(level, found.status, {"element_a": found.a, "element_b": found.b}, found.shift, turned))
        )
        for side, taken, size in (("a", found.a, sizes[0]), ("b", found.b, sizes[1])):
            left = np.setdiff1d(np.arange(size), taken)
            out.append((level, _rows(level, [_ALONE[side]] * len(left), {f"element_{side}": left})))
    return out


def _surfaces(store: Store, connection: Connection, shape: int) -> SurfaceSet:
    rows = store.columns(connection, "compare/surfaces", shape_id=shape)
    coedges = store.columns(connection, "compare/boundary", shape_id=shape)
    used, arc = np.unique(np.asarray(coedges["arc_id"], np.int64), return_inverse=True)
    columns = store.columns(connection, "compare/arcs", arc_ids=used.tolist())
    splines = store.columns(connection, "compare/arc_splines", arc_ids=used.tolist())
    row_of = {int(i): row for row, i in enumerate(used.tolist())}
    curves = Curves(columns, splines, "arc_id", row_of)
    boundary = boundary_integrals(
        curves, np.asarray(coedges["surface_no"], np.int64), arc.astype(np.int64), len(rows["surface_no"])
    )
    return surface_set(rows, boundary)


def _features(store: Store, connection: Connection, shape: int) -> FeatureSet:
    rows = store.columns(connection, "compare/features", shape_id=shape)
    return feature_set(rows, store.columns(connection, "compare/feature_surfaces", shape_id=shape))


_COLUMNS = ("path_a", "path_b", "shape_a", "shape_b", "element_a", "element_b", "dx", "dy", "dz", "distance", "angle")


def _rows(level: str, status: Any, given: Mapping[str, Any], shift: Floats | None = None, angle: Any = None) -> _Block:
    """Rows of `variant_difference`; columns that are not given are null, and so is the displacement of what stays."""
    n = len(status)
    numbers = np.full((n, 5), np.nan)
    if shift is not None:
        numbers = np.column_stack([shift, np.linalg.norm(shift, axis=1), angle])
        numbers[numbers[:, 3] + numbers[:, 4] == 0] = np.nan
    rows: _Block = {"level": [level] * n, "status": list(status), **{name: [None] * n for name in _COLUMNS[:6]}}
    rows |= {name: np.asarray(values).tolist() for name, values in given.items()}
    return rows | {name: numbers[:, k] for k, name in enumerate(_COLUMNS[6:])}
