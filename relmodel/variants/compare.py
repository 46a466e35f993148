"""Two loaded variants compared: parts and features, as rows of `variant_comparison` and `variant_difference`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from sqlalchemy import Connection, Row

from relmodel.arrays import Bools, Floats, Ints, Texts, count_from, stack
from relmodel.errors import UsageError
from relmodel.geometry.curves import Curves, boxes_of
from relmodel.geometry.transforms import boxes_carried, matrices
from relmodel.names import nearest_name
from relmodel.progress import Progress, silent
from relmodel.store import Run, Store
from relmodel.variants.surfaces import (
    TOLERANCE,
    SurfaceMatches,
    SurfaceSet,
    boundary_integrals,
    carried,
    near_pairs,
    one_to_one,
    pair_surfaces,
    surface_set,
)

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
    store: Store, before: tuple[str, str], after: tuple[str, str], *, reach: float = REACH, progress: Progress = silent
) -> Comparison:
    """Compare the newest revisions of two variants, given as (name, variant): a run of kind `diff`, made once.

    Placed parts are paired by place, path and geometry; features and surfaces within parts whose geometry changed.
    What stands farther than `reach` mm from where it was counts as removed and added.  Raises UsageError
    where a variant is not loaded, or for a reach that is none."""
    if not 0 <= reach < np.inf:
        raise UsageError(f"the reach is {reach:g}: give mm, 0 or more")
    with store.read() as connection:
        ids = [find_variant(store, connection, *named) for named in (before, after)]
        variants: dict[str, Any] = {"variant_a_id": ids[0].object_variant_id, "variant_b_id": ids[1].object_variant_id}
        known = store.select(connection, "variant_comparison", "id", "run_id", **variants, reach=reach)
        if len(known["id"]):
            return _comparison(store, connection, int(known["id"][0]), int(known["run_id"][0]))
    parameters = {"before": list(before), "after": list(after), "reach": reach}

    def write(connection: Connection) -> Comparison:
        comparison = int(store.new_ids(connection, "variant_comparison", 1)[0])
        run.writer(connection)("variant_comparison", id=[comparison], **variants, reach=reach)
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
    counts = store.rows(connection, "report/change_counts", comparison_id=comparison)
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
        paths = {"object_path_a": a.path[i[row]], "object_path_b": b.path[j[row]]}
        where = paths | {"shape_a": shape_a, "shape_b": shape_b}
        features = [_features(store, connection, s) for s in (shape_a, shape_b)]
        for level, block in _inside(sets, features, surfaces, reach):
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
    sets: Sequence[SurfaceSet], features: Sequence[FeatureSet], surfaces: SurfaceMatches, reach: float
) -> list[tuple[str, _Block]]:
    """Differences of the features and of the surfaces of two shapes whose surfaces are paired."""
    pairs, angle = pair_features(features[0], features[1], surfaces, reach)
    unlike = [
        ", ".join(other_dimensions(features[0], features[1], i, j)) if status == "changed" else None
        for i, j, status in zip(pairs.a.tolist(), pairs.b.tolist(), pairs.status.tolist(), strict=True)
    ]
    out = []
    for level, found, given, turned, sizes in (
        ("feature", pairs, {"differs": [words or None for words in unlike]}, angle, features),
        ("surface", surfaces, {}, np.zeros(len(surfaces.a)), sets),
    ):
        elements = {"element_a": found.a, "element_b": found.b}
        out.append((level, _rows(level, found.status, {**elements, **given}, found.shift, turned)))
        for side, taken, size in (("a", found.a, len(sizes[0])), ("b", found.b, len(sizes[1]))):
            left = np.setdiff1d(np.arange(size), taken)
            out.append((level, _rows(level, [_UNMATCHED[side]] * len(left), {f"element_{side}": left})))
    return out


def _surfaces(store: Store, connection: Connection, shape: int) -> SurfaceSet:
    rows = store.columns(connection, "compare/surfaces", shape_id=shape)
    coedges = store.columns(connection, "compare/boundary", shape_id=shape)
    used, arc = np.unique(np.asarray(coedges["arc_id"], np.int64), return_inverse=True)
    owner, curves = np.asarray(coedges["surface_no"], np.int64), _curves(store, connection, used.tolist())
    return surface_set(rows, boundary_integrals(curves, owner, arc.astype(np.int64), len(rows["surface_no"])))


def _curves(store: Store, connection: Connection, arcs: list[int]) -> Curves:
    """Arcs in order of their identities, with what offset ones are made from."""
    columns = store.select(connection, "arc", order="id", id=arcs)
    splines = store.select(connection, "arc_spline", order="arc_id", arc_id=arcs)
    offsets = store.select(connection, "arc_offset", order="arc_id", arc_id=arcs)
    for made in (splines, offsets):
        made["arc_no"] = np.searchsorted(arcs, np.asarray(made["arc_id"], np.int64))
    if "offset" not in columns["kind"]:
        return Curves(columns, splines)
    basis, offsets["basis_arc"] = np.unique(np.asarray(offsets["basis_arc_id"], np.int64), return_inverse=True)
    return Curves(columns, splines, offsets=offsets, basis=_curves(store, connection, basis.tolist()))


def _features(store: Store, connection: Connection, shape: int) -> FeatureSet:
    rows = store.select(connection, "feature", order="feature_no", shape_id=shape)
    members = store.select(connection, "feature_surface", order="feature_no surface_no", shape_id=shape)
    return feature_set(rows, members, store.columns(connection, "object/export_features", shape_ids=[shape]))


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


def find_variant(store: Store, connection: Connection, name: str, variant: str = "") -> Row[Any]:
    """The newest revision of a variant, as `object/newest` has it; where none is said, of the plain variant or of the
    only one.

    Raises UsageError that lists the variants, or the objects, where there is no such one."""
    loaded = store.rows(connection, "object/newest", run=None)
    own = {row.variant: row for row in loaded if row.name == name}
    found = own.get(variant) or (next(iter(own.values())) if not variant and len(own) == 1 else None)
    if found is not None:
        return found
    asked = f"{name} variant {variant}" if variant else name
    if own:
        known = ", ".join(v or "the plain one" for v in own)
        lacks = f"there is no object {asked}" if variant else f"{name} has several variants"
        raise UsageError(f"{lacks}: name one of its variants: {known}")
    names = sorted({str(row.name) for row in loaded})
    near = nearest_name(name, names)
    hint = f"did you mean {near}? " if near else ""
    raise UsageError(f"there is no object {asked}: {hint}name one of those loaded: {', '.join(names) or 'none'}")


# Placed parts of two objects compared: which correspond, and what differs besides place and geometry.

LABELS = ("number", "name", "material", "colour", "attributes")
_TURN = 1e-7  # rad: what TOLERANCE is at a distance of a metre
_OVERLAP = 0.5  # of two boxes: the volume of what both hold by that of what either holds


@dataclass(frozen=True)
class PartPlacements:
    """The placed parts of an object."""

    path: Texts
    part: Ints
    shape: Ints
    pose: Floats  # (n, 4, 4) object_from_part
    box: Floats  # (n, 6) in the object's frame
    labels: dict[str, Texts]
    measures: Floats  # (n, 3) surface count, area, volume of the shape

    def __len__(self) -> int:
        return len(self.part)


def placed_parts(store: Store, connection: Connection, object_id: int) -> PartPlacements:
    """The parts that the expansion of an object places."""
    rows = store.columns(connection, "object/expansion", object_id=object_id)
    at = np.flatnonzero(rows["part_id"] >= 0)
    part = rows["part_id"][at].astype(np.int64)
    known = store.columns(connection, "compare/parts", part_ids=np.unique(part).tolist())
    row = np.searchsorted(np.asarray(known["id"], np.int64), part)
    pose = matrices(rows)[at]
    measures = np.stack([np.asarray(known[c], float)[row] for c in ("surface_count", "area", "volume")], axis=1)
    return PartPlacements(
        np.asarray(rows["path"], object)[at],
        part,
        rows["shape_id"][at].astype(np.int64),
        pose,
        boxes_carried(pose, boxes_of(known)[row]),
        {n: np.array(["" if v is None else str(v) for v in known[n]], object)[row] for n in LABELS},
        np.nan_to_num(measures),
    )


def pair_parts(a: PartPlacements, b: PartPlacements, reach: float) -> tuple[Ints, Ints]:
    """Placed parts that correspond, in order of `a`.

    A shape at its former place is the same whatever its name: instances of one part are alike, and exporters renumber
    them.  Of the rest, first what has the same path (another shape only within reach), then one shape (or one of its
    size) at its nearest place, then what fills about the same box."""
    taken = [_stays(a, b)]
    for find in (_same_path, _near):
        free_a, free_b = (
            np.setdiff1d(np.arange(len(x)), np.concatenate([t[k] for t in taken])) for k, x in enumerate((a, b))
        )
        taken.append(find(a, b, free_a, free_b, reach))
    i, j = (np.concatenate([t[k] for t in taken]).astype(np.int64) for k in (0, 1))
    order = np.argsort(i, kind="stable")
    return i[order], j[order]


def stays(before: Floats, after: Floats) -> Bools:
    """Whether poses (n, 4, 4) are equal but for round-off."""
    shift, angle = motion(before, after)
    return np.asarray((np.linalg.norm(shift, axis=1) < TOLERANCE) & (angle < _TURN))


def motion(before: Floats, after: Floats) -> tuple[Floats, Floats]:
    """Displacement (n, 3) of the origin and angle (n,), rad, of the turn between poses (n, 4, 4)."""
    relative = np.einsum("nij,nkj->nik", after[:, :3, :3], before[:, :3, :3])
    # From the skew part, which keeps small angles; the trace tells those above a right angle.
    skew = np.stack([relative[:, p, q] - relative[:, q, p] for p, q in ((2, 1), (0, 2), (1, 0))], axis=1) / 2
    angle = np.arctan2(np.linalg.norm(skew, axis=1), (np.trace(relative, axis1=1, axis2=2) - 1) / 2)
    return after[:, :3, 3] - before[:, :3, 3], angle


def alike(a: PartPlacements, b: PartPlacements, i: Ints, j: Ints) -> Bools:
    """Whether the shapes of pairs have as many surfaces and the same area and volume: the first test of congruence."""
    return np.asarray(np.isclose(a.measures[i], b.measures[j], rtol=1e-6, atol=1e-9).all(axis=1))


def differing_labels(a: PartPlacements, b: PartPlacements, i: Ints, j: Ints) -> list[list[str]]:
    """What pairs of parts are called differently: `path`, or one of LABELS."""
    unlike = {"path": a.path[i] != b.path[j]}
    unlike |= {name: a.labels[name][i] != b.labels[name][j] for name in LABELS}
    return [[name for name, differs in unlike.items() if differs[k]] for k in range(len(i))]


def _stays(a: PartPlacements, b: PartPlacements) -> tuple[Ints, Ints]:
    i, j, _ = near_pairs(a.pose[:, :3, 3], b.pose[:, :3, 3], TOLERANCE)
    good = (a.shape[i] == b.shape[j]) & stays(a.pose[i], b.pose[j])
    i, j = i[good], j[good]
    rows = one_to_one(i, j, a.part[i] != b.part[j], a.path[i] != b.path[j])
    return i[rows], j[rows]


def _same_path(a: PartPlacements, b: PartPlacements, free_a: Ints, free_b: Ints, reach: float) -> tuple[Ints, Ints]:
    _, i, j = np.intersect1d(a.path[free_a].astype(str), b.path[free_b].astype(str), return_indices=True)
    i, j = free_a[i], free_b[j]
    near = np.linalg.norm(a.pose[i, :3, 3] - b.pose[j, :3, 3], axis=1) <= reach
    good = (a.shape[i] == b.shape[j]) | near | (_overlap(a.box[i], b.box[j]) > 0)
    return i[good], j[good]


def _near(a: PartPlacements, b: PartPlacements, free_a: Ints, free_b: Ints, reach: float) -> tuple[Ints, Ints]:
    middle_a, middle_b = ((x.box[at, :3] + x.box[at, 3:]) / 2 for x, at in ((a, free_a), (b, free_b)))
    i, j, distance = near_pairs(middle_a, middle_b, reach)
    i, j = free_a[i], free_b[j]
    same = a.shape[i] == b.shape[j]
    good = same | alike(a, b, i, j) | (_overlap(a.box[i], b.box[j]) >= _OVERLAP)
    i, j, same, distance = i[good], j[good], same[good], distance[good]
    rows = one_to_one(i, j, ~same, distance)
    return i[rows], j[rows]


def _overlap(a: Floats, b: Floats) -> Floats:
    """Volume that both of each pair of boxes (n, 6) hold, by that which either holds."""
    # Flat parts have boxes without volume.
    width = [np.maximum(x[:, 3:] - x[:, :3], TOLERANCE) for x in (a, b)]
    shared = np.minimum(a[:, :3] + width[0], b[:, :3] + width[1]) - np.maximum(a[:, :3], b[:, :3])
    both, each = np.maximum(shared, 0.0).prod(axis=1), width[0].prod(axis=1) + width[1].prod(axis=1)
    return np.asarray(both / np.maximum(each - both, 1e-30))


_FEATURE_TURN = 1e-6  # rad
_ONE_SIDED = ("pocket", "blind_hole", "boss")


@dataclass(frozen=True)
class FeatureSet:
    """The features of a shape.  Row i is feature_no i."""

    class_id: Ints
    kind: Texts
    frame: Floats  # (n, 4, 4) shape_from_feature
    middle: Floats  # (n, 3) of the box
    half: Floats  # (n,) half the diagonal of the box
    surfaces: tuple[Ints, Ints]  # feature_no, surface_no of the members
    dimensions: dict[int, dict[str, tuple[float, str]]]  # of each class: value and unit by name

    def __len__(self) -> int:
        return len(self.kind)


def feature_set(rows: Mapping[str, Any], members: Mapping[str, Any], sizes: Mapping[str, Any]) -> FeatureSet:
    """From the columns of the tables `feature` and `feature_surface`, and of the query `object/export_features`."""
    class_id, kind = np.asarray(rows["feature_class_id"], np.int64), np.empty(len(rows["feature_no"]), object)
    dimensions: dict[int, dict[str, tuple[float, str]]] = {i: {} for i in class_id.tolist()}
    columns = (sizes[c] for c in ("feature_no", "kind", "dimension", "value", "unit"))
    for number, of_kind, name, value, unit in zip(*columns, strict=True):
        kind[number] = of_kind
        if name is not None:
            dimensions[int(class_id[number])][str(name)] = float(value), str(unit)
    low, high = np.hsplit(boxes_of(rows), 2)
    return FeatureSet(
        class_id,
        kind,
        matrices(rows),
        (low + high) / 2,
        np.linalg.norm(high - low, axis=1) / 2,
        (np.asarray(members["feature_no"], np.int64), np.asarray(members["surface_no"], np.int64)),
        dimensions,
    )


def pair_features(a: FeatureSet, b: FeatureSet, surfaces: SurfaceMatches, far: float) -> tuple[SurfaceMatches, Floats]:
    """Features of `b` that are those of `a`, and the angle (rad) by which each pair is turned.

    First those that share surfaces, most first (of pockets and the like only those that open to one side); then those
    of one class by place; then those of one kind where the middle of each lies within the other.  Of a pair, the
    surfaces say whether it is identical or retrimmed, the class whether it moved or changed."""
    shared_i, shared_j, share = _shared(a, b, surfaces)
    near_i, near_j, distance = near_pairs(a.middle, b.middle, far)
    congruent = a.class_id[near_i] == b.class_id[near_j]
    good = (a.kind[near_i] == b.kind[near_j]) & (congruent | (distance < np.minimum(a.half[near_i], b.half[near_j])))
    i, j = np.concatenate([shared_i, near_i[good]]), np.concatenate([shared_j, near_j[good]])
    share = np.concatenate([share, np.zeros(good.sum())])
    # The walls of a pocket may go on behind its floor as those of another, which opens to the other side.
    opposed = np.einsum("nk,nk->n", a.frame[i, :3, 2], b.frame[j, :3, 2]) < 0
    opposed &= np.isin(a.kind[i].astype(str), _ONE_SIDED)
    apart = np.linalg.norm(a.middle[i] - b.middle[j], axis=1)
    rows = one_to_one(i, j, opposed, -share, a.class_id[i] != b.class_id[j], apart)
    rows = rows[np.argsort(i[rows], kind="stable")]
    i, j = i[rows], j[rows]

    same_class = a.class_id[i] == b.class_id[j]
    for row in np.flatnonzero(~same_class).tolist():  # rounding separates equal dimensions at the edge of a cell
        same_class[row] = not other_dimensions(a, b, int(i[row]), int(j[row]))
    shift = b.frame[j, :3, 3] - a.frame[i, :3, 3]
    relative = np.einsum("nij,nkj->nik", b.frame[j, :3, :3], a.frame[i, :3, :3])
    angle = np.arccos(np.clip((np.trace(relative, axis1=1, axis2=2) - 1) / 2, -1, 1))
    identical, retrimmed = _kept(a, b, surfaces, i, j)
    # A square pocket has four frames: with the same surfaces it has not turned.
    stayed = (np.linalg.norm(shift, axis=1) < 10 * TOLERANCE) & ((angle < _FEATURE_TURN) | retrimmed)
    moved = same_class & ~stayed & ~identical
    changed = ~identical & ~moved & ~(retrimmed & same_class)
    status = np.select([identical, moved, changed], ["identical", "moved", "changed"], "retrimmed").astype(object)
    shift[(identical | retrimmed & same_class) | stayed], angle[status != "moved"] = 0.0, 0.0
    return SurfaceMatches(i, j, status, shift), angle


def other_dimensions(a: FeatureSet, b: FeatureSet, i: int, j: int) -> list[str]:
    """What dimensions features i of `a` and j of `b` have that differ, in words: `diameter 104 -> 88 mm`."""
    before, after = a.dimensions[int(a.class_id[i])], b.dimensions[int(b.class_id[j])]
    out = []
    for name in sorted(before.keys() | after.keys()):
        (old, unit), (new, _) = before.get(name, (np.nan, "")), after.get(name, (np.nan, ""))
        if not abs(old - new) <= 10 * TOLERANCE:
            words = ("none" if np.isnan(v) else f"{v:.7g}" for v in (old, new))
            out.append(" ".join([name, " -> ".join(words), unit or after[name][1]]).removesuffix(" 1"))
    return out


def _shared(a: FeatureSet, b: FeatureSet, surfaces: SurfaceMatches) -> tuple[Ints, Ints, Floats]:
    """Pairs of features of one kind that have corresponding surfaces, and how many of them are not merely moved."""
    feature_a, surface_a = a.surfaces
    feature_b, surface_b = b.surfaces
    partner = np.full(max(surface_a.max(initial=-1), surfaces.a.max(initial=-1)) + 1, -1, np.int64)
    weight = np.zeros(len(partner))
    partner[surfaces.a] = surfaces.b
    weight[surfaces.a] = np.where(surfaces.status == "moved", 0.5, 1.0)
    order = np.argsort(surface_b, kind="stable")
    wanted = partner[surface_a]
    low, high = (np.searchsorted(surface_b[order], wanted, side) for side in ("left", "right"))
    count = np.where(wanted >= 0, high - low, 0)
    member, place = count_from(low, count)
    i, j = feature_a[member], feature_b[order[place]]
    same = a.kind[i] == b.kind[j]
    pairs, inverse = np.unique(np.stack([i[same], j[same]], axis=1), axis=0, return_inverse=True)
    share = np.bincount(inverse.ravel(), weights=weight[surface_a[member[same]]], minlength=len(pairs))
    return pairs[:, 0].astype(np.int64), pairs[:, 1].astype(np.int64), share.astype(float)


def _kept(a: FeatureSet, b: FeatureSet, surfaces: SurfaceMatches, i: Ints, j: Ints) -> tuple[Bools, Bools]:
    """Whether all surfaces of paired features are identical; whether all are at least on the same unbounded ones."""
    state = np.zeros(max(a.surfaces[1].max(initial=-1), surfaces.a.max(initial=-1)) + 1, np.int64)
    state[surfaces.a] = np.select([surfaces.status == "identical", surfaces.status == "retrimmed"], [2, 1], 0)
    least = np.full(len(a), 2)
    np.minimum.at(least, a.surfaces[0], state[a.surfaces[1]])
    as_many = np.bincount(a.surfaces[0], minlength=len(a))[i] == np.bincount(b.surfaces[0], minlength=len(b))[j]
    return as_many & (least[i] == 2), as_many & (least[i] >= 1)
