"""Placed parts of two objects compared: which correspond, and what differs besides place and geometry."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from sqlalchemy import Connection

from relmodel.arrays import Bools, Floats, Ints, Texts
from relmodel.geometry.curves import boxes_of
from relmodel.geometry.transforms import boxes_carried, matrices
from relmodel.store import Store
from relmodel.variants.pairing import near_pairs, one_to_one
from relmodel.variants.surfaces import TOLERANCE

LABELS = ("number", "name", "material", "colour", "attributes")
_TURN = 1e-7  # rad: what TOLERANCE is at a distance of a metre
_OVERLAP = 0.5  # of two boxes: the volume of what both hold by that of what either holds


@dataclass(frozen=True)
class Placed:
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


def placed_parts(store: Store, connection: Connection, object_id: int) -> Placed:
    """The parts that the expansion of an object places."""
    rows = store.columns(connection, "object/expansion", object_id=object_id)
    at = np.flatnonzero(rows["part_id"] >= 0)
    part = rows["part_id"][at].astype(np.int64)
    known = store.columns(connection, "compare/parts", part_ids=np.unique(part).tolist())
    row = np.searchsorted(np.asarray(known["id"], np.int64), part)
    pose = matrices(rows)[at]
    measures = np.stack([np.asarray(known[c], float)[row] for c in ("surface_count", "area", "volume")], axis=1)
    return Placed(
        np.asarray(rows["path"], object)[at],
        part,
        rows["shape_id"][at].astype(np.int64),
        pose,
        boxes_carried(pose, boxes_of(known)[row]),
        {name: np.asarray(known[name], object)[row] for name in LABELS},
        np.nan_to_num(measures),
    )


def pair_parts(a: Placed, b: Placed, reach: float) -> tuple[Ints, Ints]:
    """Placed parts that correspond, in order of `a`.

    A shape at its former place is the same whatever its name: instances of one part are alike, and exporters renumber
    them.  Of the rest, first what has the same path (another shape only within reach), then one shape (or one of its
    size) at its nearest place, then what fills about the same box.
    """
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


def alike(a: Placed, b: Placed, i: Ints, j: Ints) -> Bools:
    """Whether the shapes of pairs have as many surfaces and the same area and volume: the first test of congruence."""
    return np.asarray(np.isclose(a.measures[i], b.measures[j], rtol=1e-6, atol=1e-9).all(axis=1))


def differing_labels(a: Placed, b: Placed, i: Ints, j: Ints) -> list[list[str]]:
    """What pairs of parts are called differently: `path`, or one of LABELS."""
    unlike = {"path": a.path[i] != b.path[j]}
    unlike |= {name: _texts(a.labels[name][i]) != _texts(b.labels[name][j]) for name in LABELS}
    return [[name for name, differs in unlike.items() if differs[k]] for k in range(len(i))]


def _texts(values: Texts) -> Texts:
    return np.array(["" if v is None else str(v) for v in values], object)


def _stays(a: Placed, b: Placed) -> tuple[Ints, Ints]:
    i, j, _ = near_pairs(a.pose[:, :3, 3], b.pose[:, :3, 3], TOLERANCE)
    good = (a.shape[i] == b.shape[j]) & stays(a.pose[i], b.pose[j])
    i, j = i[good], j[good]
    rows = one_to_one(i, j, a.part[i] != b.part[j], a.path[i] != b.path[j])
    return i[rows], j[rows]


def _same_path(a: Placed, b: Placed, free_a: Ints, free_b: Ints, reach: float) -> tuple[Ints, Ints]:
    _, i, j = np.intersect1d(a.path[free_a].astype(str), b.path[free_b].astype(str), return_indices=True)
    i, j = free_a[i], free_b[j]
    near = np.linalg.norm(a.pose[i, :3, 3] - b.pose[j, :3, 3], axis=1) <= reach
    good = (a.shape[i] == b.shape[j]) | near | (_overlap(a.box[i], b.box[j]) > 0)
    return i[good], j[good]


def _near(a: Placed, b: Placed, free_a: Ints, free_b: Ints, reach: float) -> tuple[Ints, Ints]:
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
