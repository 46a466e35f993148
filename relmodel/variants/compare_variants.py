"""Two loaded variants compared: rows of `variant_comparison` and `variant_difference`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from sqlalchemy import Connection

from relmodel.arrays import Floats
from relmodel.columns import stack
from relmodel.errors import UsageError
from relmodel.geometry.curves import Curves
from relmodel.progress import Progress, silent
from relmodel.store import Run, Store
from relmodel.variants.features import FeatureSet, feature_set, other_dimensions, pair_features
from relmodel.variants.named import find_variant
from relmodel.variants.parts import alike, differing_labels, motion, pair_parts, placed_parts, stays
from relmodel.variants.surfaces import Pairs, SurfaceSet, boundary_integrals, carried, pair_surfaces, surface_set

_Block = dict[str, Any]

REACH = 100.0  # mm
_UNMATCHED = {"a": "removed", "b": "added"}


@dataclass(frozen=True)
class Comparison:
    """A comparison in the store: its identity, the run that made it, and how many differences of each level and
    status it has."""

    id: int
    run_id: int
    counts: dict[tuple[str, str], int]


def compare(
    store: Store,
    before: tuple[str, str],
    after: tuple[str, str],
    *,
    reach: float = REACH,
    progress: Progress = silent,
) -> Comparison:
    """Compare the newest revisions of two variants, given as (name, variant): a run of kind `diff`, made once.

    Placed parts are paired by place, path and geometry; features and surfaces within parts whose geometry changed.
    What stands farther than `reach` mm from where it was counts as removed and added.  Raises UsageError
    where a variant is not loaded, or for a reach that is none.
    """
    if not 0 <= reach < np.inf:
        raise UsageError(f"the reach is {reach:g}: give mm, 0 or more")
    with store.read() as connection:
        ids = [find_variant(store, connection, *named) for named in (before, after)]
        known = store.rows(connection, "compare/known", variant_a_id=ids[0].id, variant_b_id=ids[1].id, reach=reach)
        if known:
            return _comparison(store, connection, int(known[0].id), int(known[0].run_id))
    parameters = {"before": list(before), "after": list(after), "reach": reach}

    def write(connection: Connection) -> Comparison:
        comparison = int(store.new_ids(connection, "variant_comparison", 1)[0])
        run.append(
            connection,
            "variant_comparison",
            {
                "id": [comparison],
                "run_id": run.id,
                "variant_a_id": ids[0].id,
                "variant_b_id": ids[1].id,
                "reach": reach,
            },
        )
        rows = _differences(store, connection, ids[0].object_id, ids[1].object_id, reach, progress)
        count = len(rows["level"])
        run.append(
            connection, "variant_difference", {"comparison_id": comparison, "difference_no": np.arange(count), **rows}
        )
        run.finish(connection=connection)
        return _comparison(store, connection, comparison, run.id)

    with Run.begin(store, "diff", parameters, packages=("numpy", "scipy")) as run:
        return run.transact(write)


def _comparison(store: Store, connection: Connection, comparison: int, run_id: int) -> Comparison:
    counts = store.rows(connection, "compare/counts", comparison_id=comparison)
    return Comparison(comparison, run_id, {(r.level, r.status): int(r.how_many) for r in counts})


def _differences(
    store: Store, connection: Connection, object_a: int, object_b: int, reach: float, progress: Progress
) -> _Block:
    a, b = (placed_parts(store, connection, o) for o in (object_a, object_b))
    i, j = pair_parts(a, b, reach)
    same = a.shape[i] == b.shape[j]
    congruent = alike(a, b, i, j)
    to = b.pose[j]  # where the geometry of a stands in b
    labels = differing_labels(a, b, i, j)
    inner: list[tuple[str, _Block]] = []
    pairs, first, which = np.unique(
        np.stack([a.shape[i], b.shape[j]], axis=1), axis=0, return_index=True, return_inverse=True
    )
    for done, n in enumerate(np.argsort(first).tolist()):
        progress("comparing parts", done, len(first))
        (shape_a, shape_b), row, rows = pairs[n].tolist(), int(first[n]), np.flatnonzero(which.ravel() == n)
        if shape_a == shape_b:
            continue
        sets = [_surfaces(store, connection, s) for s in (shape_a, shape_b)]
        surfaces = pair_surfaces(sets[0], sets[1], reach)
        kept = bool(congruent[row]) and len(surfaces.a) == len(sets[0]) and bool((surfaces.status == "identical").all())
        b_from_a = np.eye(4) if kept else carried(*sets) if congruent[row] else None
        if b_from_a is not None:
            same[rows] = True
            to[rows] = to[rows] @ b_from_a
            if kept and (sets[0].label[surfaces.a] != sets[1].label[surfaces.b]).any():
                for r in rows.tolist():
                    labels[r].append("face labels")
            continue
        where = {
            "object_path_a": a.path[i[row]],
            "object_path_b": b.path[j[row]],
            "shape_a": shape_a,
            "shape_b": shape_b,
        }
        for level, block in _inside(store, connection, sets[0], sets[1], surfaces, (shape_a, shape_b), reach):
            count = len(block["status"])
            inner.append((level, {**block, **{name: [value] * count for name, value in where.items()}}))

    shift, angle = motion(a.pose[i], to)
    still = stays(a.pose[i], to)
    shift[still], angle[still] = 0.0, 0.0
    status = np.where(same, np.where(still, "identical", "moved"), "changed").astype(object)
    given = {"object_path_a": a.path[i], "object_path_b": b.path[j], "shape_a": a.shape[i], "shape_b": b.shape[j]}
    blocks = [_rows("part", status, {**given, "differs": [", ".join(names) or None for names in labels]}, shift, angle)]
    for side, x, taken in (("a", a, i), ("b", b, j)):
        left = np.setdiff1d(np.arange(len(x)), taken)
        given = {f"object_path_{side}": x.path[left], f"shape_{side}": x.shape[left]}
        blocks.append(_rows("part", [_UNMATCHED[side]] * len(left), given))
    return stack([*blocks, *(block for wanted in ("feature", "surface") for level, block in inner if level == wanted)])


def _inside(
    store: Store,
    connection: Connection,
    a: SurfaceSet,
    b: SurfaceSet,
    surfaces: Pairs,
    shapes: tuple[int, int],
    reach: float,
) -> list[tuple[str, _Block]]:
    """Differences of the features and of the surfaces of two shapes whose surfaces are paired."""
    features = [_features(store, connection, s) for s in shapes]
    pairs, angle = pair_features(features[0], features[1], surfaces, reach)
    unlike = [
        ", ".join(other_dimensions(features[0], features[1], i, j)) if status == "changed" else None
        for i, j, status in zip(pairs.a.tolist(), pairs.b.tolist(), pairs.status.tolist(), strict=True)
    ]
    out = []
    for level, found, given, turned, sizes in (
        ("feature", pairs, {"differs": [words or None for words in unlike]}, angle, [len(f) for f in features]),
        ("surface", surfaces, {}, np.zeros(len(surfaces.a)), [len(a), len(b)]),
    ):
        elements = {"element_a": found.a, "element_b": found.b}
        out.append((level, _rows(level, found.status, {**elements, **given}, found.shift, turned)))
        for side, taken, size in (("a", found.a, sizes[0]), ("b", found.b, sizes[1])):
            left = np.setdiff1d(np.arange(size), taken)
            out.append((level, _rows(level, [_UNMATCHED[side]] * len(left), {f"element_{side}": left})))
    return out


def _surfaces(store: Store, connection: Connection, shape: int) -> SurfaceSet:
    rows = store.columns(connection, "compare/surfaces", shape_id=shape)
    coedges = store.columns(connection, "compare/boundary", shape_id=shape)
    used, arc = np.unique(np.asarray(coedges["arc_id"], np.int64), return_inverse=True)
    boundary = boundary_integrals(
        _curves(store, connection, used.tolist()),
        np.asarray(coedges["surface_no"], np.int64),
        arc.astype(np.int64),
        len(rows["surface_no"]),
    )
    return surface_set(rows, boundary)


def _curves(store: Store, connection: Connection, arcs: list[int]) -> Curves:
    """Arcs in order of their identities, with what offset ones are made from."""
    columns = store.select(connection, "arc", order="id", id=arcs)
    splines = store.select(connection, "arc_spline", order="arc_id", arc_id=arcs)
    row_of = {arc: row for row, arc in enumerate(arcs)}
    if "offset" not in columns["kind"]:
        return Curves(columns, splines, "arc_id", row_of)
    offsets: dict[str, Any] = store.select(connection, "arc_offset", order="arc_id", arc_id=arcs)
    basis, offsets["basis_arc"] = np.unique(np.asarray(offsets["basis_arc_id"], np.int64), return_inverse=True)
    return Curves(columns, splines, "arc_id", row_of, offsets, _curves(store, connection, basis.tolist()))


def _features(store: Store, connection: Connection, shape: int) -> FeatureSet:
    rows = store.columns(connection, "compare/features", shape_id=shape)
    members = store.select(connection, "feature_surface", order="feature_no surface_no", shape_id=shape)
    return feature_set(rows, members, store.columns(connection, "compare/feature_dimensions", shape_id=shape))


_GIVEN = ("object_path_a", "object_path_b", "shape_a", "shape_b", "element_a", "element_b", "differs")
_NUMBERS = ("dx", "dy", "dz", "distance", "angle")


def _rows(level: str, status: Any, given: Mapping[str, Any], shift: Floats | None = None, angle: Any = None) -> _Block:
    """Rows of `variant_difference`; columns that are not given are null, and so is the displacement of what stays."""
    n = len(status)
    numbers = np.full((n, 5), np.nan)
    if shift is not None:
        numbers = np.column_stack([shift, np.linalg.norm(shift, axis=1), angle])
        numbers[numbers[:, 3] + numbers[:, 4] == 0] = np.nan
    rows: _Block = {"level": [level] * n, "status": list(status), **{name: [None] * n for name in _GIVEN}}
    rows |= {name: np.asarray(values).tolist() for name, values in given.items()}
    return rows | {name: numbers[:, k] for k, name in enumerate(_NUMBERS)}
