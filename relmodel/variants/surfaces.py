"""Pairing things of two sets by nearness, each at most once."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from relmodel.arrays import Bools, Floats, Ints, Texts
from relmodel.geometry.congruence import Constituents, motions
from relmodel.geometry.curves import Curves, vectors
from relmodel.geometry.surfaces import ANALYTIC_KINDS


def near_pairs(a: Floats, b: Floats, within: float) -> tuple[Ints, Ints, Floats]:
    """Pairs of rows of `a` (n, d) and `b` (m, d) that are at most `within` apart: rows, rows and distances."""
    from scipy.spatial import KDTree

    if not len(a) or not len(b):
        return np.empty(0, np.int64), np.empty(0, np.int64), np.empty(0)
    found = KDTree(a).sparse_distance_matrix(KDTree(b), within, output_type="ndarray")
    return found["i"].astype(np.int64), found["j"].astype(np.int64), found["v"].astype(float)


def one_to_one(i: Ints, j: Ints, *costs: npt.NDArray[Any]) -> Ints:
    """Rows of the pairs (i, j) that give every i and j at most one partner: greedily, least first costs first."""
    rows = np.lexsort((j, i, *reversed(costs)))
    taken = [np.empty(0, np.int64)]
    while len(rows):
        # A pair that comes first for both of its ends is one that a greedy walk takes.
        first = np.zeros((2, len(rows)), bool)
        first[0, np.unique(i[rows], return_index=True)[1]] = True
        first[1, np.unique(j[rows], return_index=True)[1]] = True
        chosen = rows[first.all(axis=0)]
        taken.append(chosen)
        rows = rows[~np.isin(i[rows], i[chosen]) & ~np.isin(j[rows], j[chosen])]
    return np.concatenate(taken)


# Surfaces of two shapes compared: which are identical, retrimmed or moved.
#
# Rows that both shapes list are identical. What is left is paired by numbers and not by keys, since a rounded key
# splits at the edge of its cell: by a KD-tree over descriptors, first those of the whole bounded surface, then those of
# the unbounded one, then by place. A boundary is described by its integrals (length, first and second moments), which
# do not change where a kernel splits the same boundary into other arcs.

TOLERANCE = 1e-4  # mm: far above what round-off does, far below what a drawing says
_LEVER = 1e3  # mm: a turn counts as what it does at this distance
_RELATIVE = 1e-6  # of areas
_TIP = 100.0  # mm: how far off a plane its normal's tip stands for it
_GAUSS = 12


@dataclass(frozen=True)
class SurfaceSet:
    """The surfaces of a shape.  Row i is surface_no i."""

    ids: Ints
    support: Texts
    kind: Texts
    direction: Floats  # (n, 3) outward normal of a plane, axis of others; 0 where there is none
    place: Floats  # (n, 3) point of the support that stands for it
    sizes: Floats  # (n, 3) radius, radius2, semi-angle; 0 where there is none
    outward: Bools
    area: Floats
    centroid: Floats
    boundary: Floats  # (n, 5) length, mean point, rms distance of it
    label: Texts  # name, colour and layer, as one text

    def __len__(self) -> int:
        return len(self.ids)


@dataclass(frozen=True)
class SurfaceMatches:
    """Surfaces that correspond: surface_no in a and in b, status, displacement (n, 3) of what moved, else 0."""

    a: Ints
    b: Ints
    status: Texts
    shift: Floats


def surface_set(rows: Mapping[str, Any], boundary: Floats) -> SurfaceSet:
    """From the columns of the query `compare/surfaces` and `boundary_integrals`."""
    kind = np.asarray(rows["recognised_kind"], object)
    origin, axis, centroid = (vectors(rows, name) for name in ("origin", "axis_z", "centroid"))
    outward = np.asarray(rows["direct"], bool) != np.asarray(rows["reversed"], bool)
    # A spline that is recognised as a plane, say, may carry no frame: only its key identifies it.
    known = np.isin(kind.astype(str), ANALYTIC_KINDS) & ~np.isnan(origin[:, 0]) & ~np.isnan(axis[:, 0])
    plane = kind == "plane"
    radius, radius2, angle = (np.asarray(rows[c], float) for c in ("radius", "radius2", "semi_angle"))
    with np.errstate(invalid="ignore", divide="ignore"):
        apex = origin - (radius / np.tan(angle))[:, None] * axis
    foot = np.where((kind == "cone")[:, None], apex, origin)
    along = np.einsum("nd,nd->n", foot, axis)[:, None] * axis
    foot = np.where(plane[:, None], along, np.where((kind == "cylinder")[:, None], foot - along, foot))
    direction = np.where((plane & ~outward)[:, None], -axis, axis)
    direction = np.where((kind == "cone")[:, None], axis * np.sign(np.nan_to_num(angle))[:, None], direction)
    direction = np.where((kind == "sphere")[:, None], 0.0, direction)
    sizes = np.stack([np.where(kind == "cone", 0.0, radius), radius2, np.abs(angle) * _LEVER], axis=1)
    sizes = np.where(plane[:, None], 0.0, sizes)
    return SurfaceSet(
        np.asarray(rows["surface_id"], np.int64),
        np.asarray(rows["support_key"], object),
        np.where(known, kind, "free"),
        np.where(known[:, None], direction, 0.0),
        np.where(known[:, None], foot, 0.0),
        np.where(known[:, None], np.nan_to_num(sizes), 0.0),
        outward,
        np.asarray(rows["area"], float),
        centroid,
        boundary,
        np.asarray(rows["label"], object),
    )


def boundary_integrals(curves: Curves, surface: Ints, arc: Ints, count: int) -> Floats:
    """Length, mean point and rms distance from it of the boundary of each surface (count, 5), mm; 0 where it has none.
    `surface` and `arc` (n,) list the coedges; `arc` counts the rows of `curves`."""
    nodes, weights = np.polynomial.legendre.leggauss(_GAUSS)
    row, start, end = curves.spans(np.arange(len(curves)))
    half, middle = (end - start) / 2, (end + start) / 2
    points, by = curves.evaluate(np.repeat(row, _GAUSS), (middle[:, None] + half[:, None] * nodes).ravel())
    element = (np.linalg.norm(by, axis=1).reshape(-1, _GAUSS) * weights * half[:, None]).ravel()
    values = np.column_stack([element, element[:, None] * points, element * np.einsum("nd,nd->n", points, points)])
    of_arc = np.zeros((len(curves), 5))
    np.add.at(of_arc, np.repeat(row, _GAUSS), values)
    out = np.zeros((count, 5))
    np.add.at(out, surface, of_arc[arc])
    length = np.where(out[:, :1] > 0, out[:, :1], 1.0)
    mean = out[:, 1:4] / length
    spread = np.sqrt(np.maximum(out[:, 4] / length[:, 0] - np.einsum("nd,nd->n", mean, mean), 0.0))
    return np.column_stack([out[:, 0], mean, spread])


def pair_surfaces(a: SurfaceSet, b: SurfaceSet, reach: float) -> SurfaceMatches:
    """Surfaces of `b` that are those of `a`: identical, retrimmed, or moved by at most `reach` mm."""
    free_a, free_b = np.ones(len(a), bool), np.ones(len(b), bool)
    found: list[tuple[Ints, Ints, str, Floats]] = []

    def take(i: Ints, j: Ints, status: str, shift: Floats | None = None) -> None:
        free_a[i], free_b[j] = False, False
        found.append((i, j, status, np.zeros((len(i), 3)) if shift is None else shift))

    _, i, j = np.intersect1d(a.ids, b.ids, return_indices=True)
    take(i.astype(np.int64), j.astype(np.int64), "identical")
    take(*_same(a, b, free_a, free_b), "identical")
    take(*_retrimmed(a, b, free_a, free_b), "retrimmed")
    i, j, shift = _moved(a, b, free_a, free_b, reach)
    take(i, j, "moved", shift)
    status = np.concatenate([np.full(len(i), s, object) for i, _, s, _ in found])
    i, j, shift = (np.concatenate([f[k] for f in found]) for k in (0, 1, 3))
    order = np.argsort(i, kind="stable")
    return SurfaceMatches(i[order], j[order], status[order], shift[order])


def _same(a: SurfaceSet, b: SurfaceSet, free_a: Any, free_b: Any) -> tuple[Ints, Ints]:
    """Same unbounded surface, area and boundary, to round-off."""
    at, bt = np.flatnonzero(free_a), np.flatnonzero(free_b)
    i, j, distance = near_pairs(_whole(a)[at], _whole(b)[bt], 10 * TOLERANCE)
    i, j = at[i], bt[j]
    good = (np.abs(_whole(a)[i] - _whole(b)[j]) < TOLERANCE).all(axis=1) & _equal_area(a, b, i, j)
    # A free-form surface is identified by area and boundary: the kernel may refit it.
    good &= _same_support(a, b, i, j) | ((a.kind[i] == "free") & _alike(a, b, i, j))
    i, j = i[good], j[good]
    rows = one_to_one(i, j, distance[good])
    return i[rows], j[rows]


def _whole(s: SurfaceSet) -> Floats:
    return np.hstack([s.centroid, s.boundary])


def _equal_area(a: SurfaceSet, b: SurfaceSet, i: Ints, j: Ints) -> Bools:
    return np.asarray(np.abs(a.area[i] - b.area[j]) <= _RELATIVE * np.maximum(a.area[i], b.area[j]))


def _alike(a: SurfaceSet, b: SurfaceSet, i: Ints, j: Ints) -> Bools:
    """Whether the unbounded surfaces are parallel, of one kind, side and size."""
    plane = a.kind[i] == "plane"  # its direction says the side
    turned = np.linalg.norm(a.direction[i] - b.direction[j], axis=1)
    turned = np.where(plane, turned, np.minimum(turned, np.linalg.norm(a.direction[i] + b.direction[j], axis=1)))
    good = (a.kind[i] == b.kind[j]) & (plane | (a.outward[i] == b.outward[j])) & (turned * _LEVER < TOLERANCE)
    return np.asarray(good & (np.abs(a.sizes[i] - b.sizes[j]) < TOLERANCE).all(axis=1))


def _same_support(a: SurfaceSet, b: SurfaceSet, i: Ints, j: Ints) -> Bools:
    """Whether surfaces lie on one unbounded surface; free-form ones are known by their key."""
    good = _alike(a, b, i, j) & (np.linalg.norm(a.place[i] - b.place[j], axis=1) < 10 * TOLERANCE)
    return np.asarray(good & ((a.kind[i] != "free") | (a.support[i] == b.support[j])))


def _retrimmed(a: SurfaceSet, b: SurfaceSet, free_a: Any, free_b: Any) -> tuple[Ints, Ints]:
    """Same unbounded surface: of several pieces on it those that are nearest."""
    pairs = []
    for free_form in (False, True):
        at = np.flatnonzero(free_a & ((a.kind == "free") == free_form))
        bt = np.flatnonzero(free_b & ((b.kind == "free") == free_form))
        if free_form:
            codes = np.unique(np.concatenate([a.support[at], b.support[bt]]).astype(str), return_inverse=True)[1]
            keys = codes.astype(float)[:, None]
            i, j, _ = near_pairs(keys[: len(at)], keys[len(at) :], 0.5)
        else:
            i, j, _ = near_pairs(np.hstack([a.place, a.sizes])[at], np.hstack([b.place, b.sizes])[bt], 10 * TOLERANCE)
        i, j = at[i], bt[j]
        good = (a.support[i] == b.support[j]) if free_form else _same_support(a, b, i, j)
        pairs.append((i[good], j[good]))
    i, j = (np.concatenate([p[k] for p in pairs]) for k in (0, 1))
    # Pieces of one plane that lie farther apart than both are wide have nothing to do with each other.
    apart = np.linalg.norm(a.centroid[i] - b.centroid[j], axis=1)
    near = apart <= np.maximum(a.boundary[i, 4] + b.boundary[j, 4], TOLERANCE) * 2
    i, j = i[near], j[near]
    rows = one_to_one(i, j, apart[near])
    return i[rows], j[rows]


def _moved(a: SurfaceSet, b: SurfaceSet, free_a: Any, free_b: Any, reach: float) -> tuple[Ints, Ints, Floats]:
    """Parallel surfaces of equal sizes, congruent ones before those with another boundary."""
    at, bt = np.flatnonzero(free_a), np.flatnonzero(free_b)
    i, j, distance = near_pairs(a.centroid[at], b.centroid[bt], reach)
    i, j = at[i], bt[j]
    good = _alike(a, b, i, j)
    congruent = _equal_area(a, b, i, j) & (
        np.abs(a.boundary[i][:, [0, 4]] - b.boundary[j][:, [0, 4]]) < 10 * TOLERANCE
    ).all(axis=1)
    shift = np.where(congruent[:, None], b.centroid[j] - a.centroid[i], b.place[j] - a.place[i])
    similar = np.maximum(a.area[i], b.area[j]) <= 2 * np.minimum(a.area[i], b.area[j])
    size = np.minimum(a.boundary[i, 4], b.boundary[j, 4])
    good &= congruent | (similar & (a.kind[i] != "free") & (distance <= np.maximum(size, TOLERANCE)))
    good &= np.linalg.norm(shift, axis=1) > TOLERANCE
    i, j, congruent, distance, shift = i[good], j[good], congruent[good], distance[good], shift[good]
    rows = one_to_one(i, j, ~congruent, distance)
    return i[rows], j[rows], shift[rows]


def carried(a: SurfaceSet, b: SurfaceSet) -> Floats | None:
    """`b_from_a` (4, 4), the motion that carries all surfaces of `a` onto those of `b`; None where none does.

    Files that place parts by their coordinates move shapes so.  Of several, by symmetry, that which turns least."""
    if len(a) != len(b) or not len(a):
        return None
    found = [motion for motion, _ in motions(_elements(a), _elements(b), 10 * TOLERANCE, 10 * TOLERANCE)]
    turns = [np.trace(motion) for motion in found]
    return next((m for m, turn in zip(found, turns, strict=True) if turn >= max(turns) - 1e-9), None)


def _elements(s: SurfaceSet) -> Constituents:
    """The surfaces, then their boundaries."""
    side = np.where(s.kind == "plane", "", np.where(s.outward, "+", "-"))
    tip = s.centroid + np.where((s.kind == "plane")[:, None], _TIP * s.direction, 0.0)
    mean = s.boundary[:, 1:4]
    sizes = np.column_stack([np.sqrt(s.area), s.boundary[:, [0, 4]], s.sizes])
    weight = np.zeros((2 * len(s), 3))
    weight[: len(s), 0], weight[: len(s), 1], weight[len(s) :, 2] = s.area, s.area**2, s.boundary[:, 0]
    return Constituents(
        [f"{part} {kind}{way}" for part in ("of", "around") for kind, way in zip(s.kind, side, strict=True)],
        np.tile(sizes, (2, 1)),
        np.concatenate([np.stack([s.centroid, s.centroid, tip], axis=1), np.stack([mean, mean, mean], axis=1)]),
        weight,
    )
