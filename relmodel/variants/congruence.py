"""Whether one shape is another one carried elsewhere: files that place parts by their coordinates move shapes so."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from relmodel.geometry.transforms import apply, nearest_rotation
from relmodel.variants.pairing import near_pairs, one_to_one
from relmodel.variants.surfaces import TOLERANCE, SurfaceSet

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

_FAR = 1e6  # mm: sets kinds apart
_TIP = 100.0  # mm: how far off a plane its normal's tip stands for it
_ATTEMPTS = 500


def congruence(a: SurfaceSet, b: SurfaceSet) -> Floats | None:
    """`b_from_a` (4, 4), the rigid transform that carries all surfaces of `a` onto those of `b`; None where none does.

    Surfaces are told apart by what no motion changes (kind, sizes, area, boundary).  Up to three of the rarest anchor
    the transform (Kabsch 1976), each way to pair them is tried, and of those that carry everything the one that turns
    least is taken: a symmetric shape has several.  A mirror image is not congruent, since its transform is no rotation.
    """
    if len(a) != len(b) or not len(a):
        return None
    i, j, _ = near_pairs(_invariants(a), _invariants(b), 10 * TOLERANCE)
    partners = np.bincount(i, minlength=len(a))
    if partners.min() == 0:
        return None
    stations = _stations(a), _stations(b)
    best = None
    for chosen, others in _anchorings(stations, partners, i, j):
        b_from_a = _fitted(stations[0][chosen].reshape(-1, 3), stations[1][others].reshape(-1, 3))
        carried = apply(b_from_a, stations[0].reshape(-1, 3)).reshape(len(a), -1)
        there = stations[1].reshape(len(b), -1)
        near = np.abs(carried[i] - there[j]).max(axis=1) < 10 * TOLERANCE
        rows = one_to_one(i[near], j[near], np.abs(carried[i[near]] - there[j[near]]).max(axis=1))
        if len(rows) < len(a):
            continue
        at, to = i[near][rows], j[near][rows]
        b_from_a = _fitted(stations[0][at].reshape(-1, 3), stations[1][to].reshape(-1, 3))
        if best is None or np.trace(b_from_a) > np.trace(best) + 1e-9:
            best = b_from_a
    return best


def _invariants(s: SurfaceSet) -> Floats:
    """What no motion of a surface changes (n, 7)."""
    kinds = np.array([sum(ord(c) * (k + 1) for k, c in enumerate(str(kind))) for kind in s.kind], float)
    side = np.where(s.kind == "plane", 0.0, s.outward.astype(float))
    return np.column_stack([_FAR * (2 * kinds + side), np.sqrt(s.area), s.boundary[:, [0, 4]], s.sizes])


def _stations(s: SurfaceSet) -> Floats:
    """Points that a motion carries along with each surface (n, 3, 3): centroids of it and of its boundary, and the tip
    of its normal where it is plane."""
    tip = s.centroid + np.where((s.kind == "plane")[:, None], _TIP * s.direction, 0.0)
    return np.stack([s.centroid, s.boundary[:, 1:4], tip], axis=1)


def _anchorings(stations: tuple[Floats, Floats], partners: Ints, i: Ints, j: Ints) -> list[tuple[Ints, Ints]]:
    """Up to three surfaces that fix a motion, with each way to pair them that keeps their distances."""
    anchors: list[int] = []
    rank = -1
    for row in np.lexsort((np.arange(len(partners)), partners)).tolist():
        points = stations[0][[*anchors, row]].reshape(-1, 3)
        now = int(np.linalg.matrix_rank(points - points.mean(axis=0), tol=1.0))
        if now > rank:
            anchors.append(row)
            rank = now
        if rank == 3 or len(anchors) == 3:
            break
    ways: list[list[int]] = [[]]
    for n, anchor in enumerate(anchors):
        longer = []
        for way in ways:
            for partner in j[i == anchor].tolist():
                kept = [
                    abs(np.linalg.norm(stations[0][anchor, 0] - stations[0][anchors[k], 0]) - np.linalg.norm(p))
                    for k, p in enumerate(stations[1][partner, 0] - stations[1][way, 0])
                ]
                if all(d < 10 * TOLERANCE for d in kept) and partner not in way:
                    longer.append([*way, partner])
        ways = longer[: _ATTEMPTS if n < 2 else None]
    return [(np.array(anchors), np.array(way)) for way in ways[:_ATTEMPTS]]


def _fitted(a: Floats, b: Floats) -> Floats:
    """The rigid transform that takes points `a` (n, 3) nearest to `b`; where they leave a turn open, there is none."""
    mean_a, mean_b = a.mean(axis=0), b.mean(axis=0)
    covariance = (b - mean_b).T @ (a - mean_a)
    out = np.eye(4)
    out[:3, :3] = nearest_rotation(covariance + 1e-10 * max(np.abs(covariance).max(), 1e-12) * np.eye(3))
    out[:3, 3] = mean_b - out[:3, :3] @ mean_a
    return out
