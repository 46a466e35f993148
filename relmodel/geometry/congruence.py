"""Congruence of two things by their elements, and groups of nearly equal directions, axes and sizes."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from math import prod

import numpy as np

from relmodel.arrays import Floats, Ints
from relmodel.geometry.transforms import apply, nearest_rotation, rigid


def unsigned(directions: Floats, clearly: float = 1e-3) -> Floats:
    """Directions (n, 3) with the first component that is clearly not 0 made positive."""
    clear = np.abs(directions) > clearly
    first = np.argmax(clear, axis=1)
    return directions * np.where(np.take_along_axis(directions, first[:, None], axis=1) < 0, -1.0, 1.0)


def components(count: int, a: Ints, b: Ints) -> Ints:
    """Label of each of `count` nodes: those that the edges a[i] - b[i] connect share one."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    graph = coo_array((np.ones(len(a), np.int8), (a, b)), shape=(count, count))
    return np.asarray(connected_components(graph, directed=False)[1], dtype=np.int64)


def joined(nodes: Iterable[int], edges: Iterable[tuple[int, int]]) -> list[list[int]]:
    """Groups of nodes that edges connect, each sorted, in the order of their first nodes."""
    rows = sorted(set(nodes))
    ends = np.searchsorted(rows, np.array(list(edges), np.int64).reshape(-1, 2))
    groups: dict[int, list[int]] = {}
    for node, label in zip(rows, components(len(rows), *ends.T).tolist(), strict=True):
        groups.setdefault(label, []).append(node)
    return list(groups.values())


def group_bounds(values: Floats, group: Ints, count: int) -> tuple[Floats, Floats]:
    """Least and greatest values (count, ...) of each group; inf and -inf of an empty one.

    values (n, ...), group (n,): from 0 to count - 1."""
    columns, shape = values.reshape(len(values), prod(values.shape[1:])).T, (count, *values.shape[1:])
    low, high = np.full((len(columns), count), np.inf), np.full((len(columns), count), -np.inf)
    for i, column in enumerate(columns):  # NumPy is several times faster on vectors than on rows
        np.minimum.at(low[i], group, column)
        np.maximum.at(high[i], group, column)
    return low.T.reshape(shape), high.T.reshape(shape)


def greatest(values: Floats, group: Ints, count: int, least: float = 0.0) -> Floats:
    """Greatest of the values (n,) of each group (count,), `least` where none is greater; group (n,)."""
    out = np.full(count, least)
    np.maximum.at(out, group, values)
    return out


def clusters(values: Floats, tolerance: float) -> Ints:
    """Label of each row (n, k): rows within the tolerance of each other, through others too, share one."""
    from scipy.spatial import cKDTree

    if not len(values):
        return np.empty(0, np.int64)
    # Equal rows become one point first, so that a large group makes no pairs.
    cells = np.round(values / (tolerance / 10)) + 0.0  # no -0; as integers, what is far off would overflow
    _, first, inverse = np.unique(cells, axis=0, return_index=True, return_inverse=True)
    points = values[first]
    pairs = cKDTree(points).query_pairs(tolerance, output_type="ndarray")
    return components(len(points), *pairs.T)[inverse.ravel()]


# Congruence of two things by their elements (faces, edges): whether a motion takes one to the other.
#
# Elements are classified by what no motion changes: kinds and sizes. Things can be congruent if they have as many
# elements of each class, are as wide, and have the same triple product of means, which a mirror negates. A motion is
# then sought by the centre and two landmarks, and accepted only where every element comes to lie on one of its class;
# being a rotation, it never takes a thing to its mirror image (unless they are equal).

_MOST_TRIALS = 256


@dataclass
class Constituents:
    """What a thing is made of.

    kind: what no motion changes at all; sizes (n, k), mm: what it changes by round-off; points (n, 3, 3): what moves
    along, the second and the third in any order; weight (n, m): shares of the elements in m means of their places."""

    kind: list[str]
    sizes: Floats
    points: Floats
    weight: Floats

    @property
    def extent(self) -> float:
        """Farthest that an element is from the centre of all."""
        return float(np.linalg.norm(self.arms(), axis=1).max())

    def arms(self) -> Floats:
        """Places (n, 3) of the elements from the centre of all."""
        return np.asarray(self.points[:, 0] - self.points[:, 0].mean(axis=0))


def motions(a: Constituents, b: Constituents, within: float, loose: float) -> Iterator[tuple[Floats, Ints]]:
    """Motions `b_from_a` (4, 4) that take all elements of a to their like in b, and to which each comes (n,).

    within: how far, mm, points may stay off; loose: how far sizes may differ, and points before the motion is fitted.
    A symmetric thing has several; at most 256 are tried."""
    slack = 1e-6 + 10 * loose / max(a.extent, loose)
    unlike = abs(a.extent - b.extent) > loose or abs(_chirality(a) - _chirality(b)) > slack + 1e-3 * abs(_chirality(a))
    label = None if unlike else _labels(a, b, loose)
    if label is None:
        return
    for motion in _landmarks(a, b, label, loose):
        to = _matched(a, b, label, motion, 2.5 * loose)
        if to is None:
            continue
        motion = _best_motion(a.points.reshape(-1, 3), _turned_about(a, b, to, motion).reshape(-1, 3))
        off = np.linalg.norm(apply(motion, a.points) - _turned_about(a, b, to, motion), axis=2)
        if off.max() <= within:
            yield motion, to


def _chirality(x: Constituents) -> float:
    """Triple product of three means of the elements' places: of a mirror image its negative."""
    arms, reach = x.arms(), max(x.extent, 1e-300)
    means = [w @ arms / max(w.sum() * reach, 1e-300) for w in x.weight.T]
    return float(np.linalg.det(np.stack(means)))


def _labels(a: Constituents, b: Constituents, tolerance: float) -> tuple[Ints, Ints] | None:
    """Label of each element of both, equal for those of one kind and of one size; None where they do not pair off."""
    kind = np.unique([*a.kind, *b.kind], return_inverse=True)[1]
    apart = 10 * (tolerance + max(float(np.abs(x.sizes).max()) for x in (a, b)))
    label = clusters(np.column_stack([kind * apart, np.concatenate([a.sizes, b.sizes])]), tolerance)
    of_a, of_b = label[: len(a.kind)], label[len(a.kind) :]
    if not np.array_equal(np.sort(of_a), np.sort(of_b)):
        return None
    return of_a, of_b


def _landmarks(a: Constituents, b: Constituents, label: tuple[Ints, Ints], tolerance: float) -> Iterator[Floats]:
    """Motions that take the centre and two landmarks of a to the like of b."""
    of_a, of_b = label
    centre_a, centre_b = (x.points[:, 0].mean(axis=0) for x in (a, b))
    arm_a, arm_b = a.arms(), b.arms()
    count = np.bincount(of_a)[of_a]
    reach_a, reach_b = np.linalg.norm(arm_a, axis=1), np.linalg.norm(arm_b, axis=1)
    far = np.flatnonzero(reach_a >= 0.3 * reach_a.max())
    p = int(far[np.lexsort((-reach_a[far], count[far]))[0]])
    across = np.linalg.norm(np.cross(arm_a[p], arm_a), axis=1)
    off_arm = np.flatnonzero(across >= 0.3 * across.max())
    q = int(off_arm[np.lexsort((-across[off_arm], count[off_arm]))[0]])
    frame_a = _frame(arm_a[p], arm_a[q])
    trials = 0
    for i in np.flatnonzero((of_b == of_a[p]) & (np.abs(reach_b - reach_a[p]) <= tolerance)).tolist():
        apart = np.linalg.norm(arm_b - arm_b[i], axis=1) - np.linalg.norm(arm_a[q] - arm_a[p])
        like = (of_b == of_a[q]) & (np.abs(reach_b - reach_a[q]) <= tolerance) & (np.abs(apart) <= tolerance)
        for j in np.flatnonzero(like).tolist():
            turn = _frame(arm_b[i], arm_b[j]) @ frame_a.T
            yield rigid(turn, centre_b - turn @ centre_a)
            trials += 1
            if trials == _MOST_TRIALS:
                return


def _frame(p: Floats, q: Floats) -> Floats:
    """Rotation (3, 3) with X along p and Y in the plane of p and q; any where they are along one line."""
    x = p / max(float(np.linalg.norm(p)), 1e-300)
    z = np.cross(x, q)
    if np.linalg.norm(z) < 1e-9 * max(float(np.linalg.norm(q)), 1e-300):
        z = np.cross(x, np.eye(3)[np.argmin(np.abs(x))])
    z = z / np.linalg.norm(z)
    return np.column_stack([x, np.cross(z, x), z])


def _matched(
    a: Constituents, b: Constituents, label: tuple[Ints, Ints], motion: Floats, tolerance: float
) -> Ints | None:
    """The element of b where each element of a comes to lie, or None where one has no counterpart."""
    from scipy.spatial import cKDTree

    def key(points: Floats, labels: Ints) -> Floats:
        ends = (points[:, 1] + points[:, 2]) / 2, np.linalg.norm(points[:, 1] - points[:, 2], axis=1)
        return np.column_stack([points[:, 0], *ends, labels * (10 * tolerance)])

    ours, theirs = key(apply(motion, a.points), label[0]), key(b.points, label[1])
    off, to = cKDTree(theirs).query(ours, distance_upper_bound=3 * tolerance)
    if not np.all(np.isfinite(off)):
        return None
    to = np.asarray(to, np.int64)
    # Each of b is reached too; several in one place stand for each other.
    if np.unique(to).size < to.size:
        back = cKDTree(ours).query(theirs, distance_upper_bound=3 * tolerance)[0]
        return to if np.all(np.isfinite(back)) else None
    return to


def _turned_about(a: Constituents, b: Constituents, to: Ints, motion: Floats) -> Floats:
    """Points of b in the order of a's elements, second and third exchanged where an edge runs the other way."""
    points = b.points[to]
    moved = apply(motion, a.points)
    straight = np.linalg.norm(moved[:, 1:] - points[:, 1:], axis=2).max(axis=1)
    crossed = np.linalg.norm(moved[:, 1:] - points[:, :0:-1], axis=2).max(axis=1)
    return np.where((crossed < straight)[:, None, None], points[:, [0, 2, 1]], points)


def _best_motion(points: Floats, to: Floats) -> Floats:
    """Rotation and shift (4, 4) of least squares (Kabsch, Acta Cryst. A32, 1976)."""
    centre, centre_to = points.mean(axis=0), to.mean(axis=0)
    covariance = (to - centre_to).T @ (points - centre)
    # Where the points leave a turn open, there is none.
    turn = nearest_rotation(covariance + 1e-10 * max(np.abs(covariance).max(), 1e-12) * np.eye(3))
    return rigid(turn, centre_to - turn @ centre)
