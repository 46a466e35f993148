"""Features of two shapes compared."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from relmodel.arrays import Bools, Floats, Ints, Texts
from relmodel.geometry.curves import boxes_of
from relmodel.geometry.transforms import matrices
from relmodel.variants.pairing import near_pairs, one_to_one
from relmodel.variants.surfaces import TOLERANCE, Pairs

_TURN = 1e-6  # rad
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
    """From the columns of the queries `compare/features`, of the table `feature_surface` and of
    `compare/feature_dimensions`."""
    dimensions: dict[int, dict[str, tuple[float, str]]] = {int(i): {} for i in rows["class_id"]}
    for class_id, name, value, unit in zip(*(sizes[c] for c in ("class_id", "name", "value", "unit")), strict=True):
        dimensions[int(class_id)][str(name)] = float(value), str(unit)
    low, high = np.hsplit(boxes_of(rows), 2)
    return FeatureSet(
        np.asarray(rows["class_id"], np.int64),
        np.asarray(rows["kind"], object),
        matrices(rows),
        (low + high) / 2,
        np.linalg.norm(high - low, axis=1) / 2,
        (np.asarray(members["feature_no"], np.int64), np.asarray(members["surface_no"], np.int64)),
        dimensions,
    )


def pair_features(a: FeatureSet, b: FeatureSet, surfaces: Pairs, reach: float) -> tuple[Pairs, Floats]:
    """Features of `b` that are those of `a`, and the angle (rad) by which each pair is turned.

    First those that share surfaces, most first (of pockets and the like only those that open to one side); then those
    of one class by place; then those of one kind of which each has its middle in the other.  Of a pair, the surfaces
    say whether it is identical or retrimmed, the class whether it moved or changed.
    """
    shared_i, shared_j, share = _shared(a, b, surfaces)
    near_i, near_j, distance = near_pairs(a.middle, b.middle, reach)
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
    stayed = (np.linalg.norm(shift, axis=1) < 10 * TOLERANCE) & ((angle < _TURN) | retrimmed)
    moved = same_class & ~stayed & ~identical
    changed = ~identical & ~moved & ~(retrimmed & same_class)
    status = np.select([identical, moved, changed], ["identical", "moved", "changed"], "retrimmed").astype(object)
    shift[(identical | retrimmed & same_class) | stayed], angle[status != "moved"] = 0.0, 0.0
    return Pairs(i, j, status, shift), angle


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


def _shared(a: FeatureSet, b: FeatureSet, surfaces: Pairs) -> tuple[Ints, Ints, Floats]:
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
    member = np.repeat(np.arange(len(surface_a)), count)
    other = order[np.repeat(low, count) + np.arange(len(member)) - np.repeat(np.cumsum(count) - count, count)]
    i, j = feature_a[member], feature_b[other]
    same = a.kind[i] == b.kind[j]
    pairs, inverse = np.unique(np.stack([i[same], j[same]], axis=1), axis=0, return_inverse=True)
    share = np.bincount(inverse.ravel(), weights=weight[surface_a[member[same]]], minlength=len(pairs))
    return pairs[:, 0].astype(np.int64), pairs[:, 1].astype(np.int64), share.astype(float)


def _kept(a: FeatureSet, b: FeatureSet, surfaces: Pairs, i: Ints, j: Ints) -> tuple[Bools, Bools]:
    """Whether all surfaces of paired features are identical; whether all are at least on the same unbounded ones."""
    state = np.zeros(max(a.surfaces[1].max(initial=-1), surfaces.a.max(initial=-1)) + 1, np.int64)
    state[surfaces.a] = np.select([surfaces.status == "identical", surfaces.status == "retrimmed"], [2, 1], 0)
    least = np.full(len(a), 2)
    np.minimum.at(least, a.surfaces[0], state[a.surfaces[1]])
    as_many = np.bincount(a.surfaces[0], minlength=len(a))[i] == np.bincount(b.surfaces[0], minlength=len(b))[j]
    return as_many & (least[i] == 2), as_many & (least[i] >= 1)
