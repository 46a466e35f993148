"""How finely surfaces are to be cut along u and along v so that triangles of a lattice keep to them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from relmodel.geometry.spline_curves import Runs
from relmodel.geometry.surfaces import ANALYTIC_KINDS, SurfacePoints, Surfaces
from relmodel.loading.facets.chords import numbered

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.int64]

_SHARE = 0.25  # of the chord's error for each of the two directions and for the twist
_BEND_RAD = 0.4  # turn of a line of u or v within the surface, step by step
_SAMPLES = 3  # intervals of a smooth piece in which turns are measured
_MOST = 200  # intervals of a direction
_FLAT = 1e-6  # steps: what asks for fewer is straight


@dataclass(frozen=True)
class Cuts:
    """Cuts of intervals (f,) of one parameter: `count` (f,) steps each, ends included in `ends`."""

    count: Index
    ends: Runs
    _density: list[tuple[Array, Array] | None]

    def at(self, interval: Index, k: Index) -> Array:
        """The k-th end (n,) of the steps of intervals (n,)."""
        return np.asarray(self.ends.values[self.ends.offsets[interval] + k])

    def at_least(self, count: int) -> Cuts:
        """With so many steps where there are fewer."""
        return _cut(self.ends, np.maximum(self.count, count), self._density)


def cuts(surfaces: Surfaces, row: Index, box: Array, chord_mm: float, chord_rad: float) -> tuple[Cuts, Cuts]:
    """Cuts along u and along v over rectangles u0 u1 v0 v1 (f, 4) of surfaces (f,)."""
    allowed = _SHARE * chord_mm
    steps = _angles(surfaces, row, box, allowed, chord_rad)
    totals = [(box[:, 2 * k + 1] - box[:, 2 * k]) / steps[k] for k in (0, 1)]
    densities: list[list[tuple[Array, Array] | None]] = [[None] * len(row), [None] * len(row)]
    free = np.flatnonzero(~np.isin(surfaces.kind[row].astype(str), ANALYTIC_KINDS))
    for i, sampled in zip(free.tolist(), _samples(surfaces, row[free], box[free]), strict=True):
        measured = _measured(*sampled, allowed, chord_rad)
        for k in (0, 1):
            densities[k][i] = measured[k]
            totals[k][i] = measured[k][1][-1]
    out = []
    for k in (0, 1):
        count = np.maximum(np.ceil(totals[k] - _FLAT), 1).astype(np.int64)
        whole = Runs(np.ascontiguousarray(box[:, 2 * k : 2 * k + 2]).ravel(), 2 * np.arange(len(row) + 1))
        out.append(_cut(whole, count, densities[k]))
    return out[0], out[1]


def _cut(whole: Runs, count: Index, density: list[tuple[Array, Array] | None]) -> Cuts:
    low, high = whole.values[whole.offsets[:-1]], whole.values[whole.offsets[1:] - 1]
    which, k = numbered(count + 1)
    share = k / count[which]
    ends = Runs(low[which] * (1 - share) + high[which] * share, np.concatenate([[0], np.cumsum(count + 1)]))
    for i, one in enumerate(density):
        if one is not None:
            t, along = one[0], one[1] + np.linspace(0, _FLAT, len(one[1]))  # straight parts are cut evenly
            ends[i][1:-1] = np.interp(np.linspace(0, along[-1], count[i] + 1)[1:-1], along, t)
    return Cuts(count, ends, density)


def _angles(surfaces: Surfaces, row: Index, box: Array, allowed: float, chord_rad: float) -> tuple[Array, Array]:
    """Steps along u and v of the analytic surfaces `row` (f,), rad or mm."""
    kind, radius, tube = surfaces.kind[row], surfaces.radius[row], surfaces.radius2[row]
    sine = np.where(kind == "cone", np.sin(surfaces.semi_angle[row]), 0.0)
    v0, v1 = box[:, 2], box[:, 3]
    cone = np.maximum(np.abs(radius + v0 * sine), np.abs(radius + v1 * sine))
    wide = np.select([kind == "cone", kind == "torus"], [cone, radius + tube], radius)
    high = np.where(kind == "torus", tube, radius)
    round_ = (kind == "sphere") | (kind == "torus")
    return _angle(wide, allowed, chord_rad), np.where(round_, _angle(high, allowed, chord_rad), np.inf)


def _angle(radius: Array, allowed: float, chord_rad: float) -> Array:
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray(np.fmin(chord_rad, 2 * np.arccos(np.clip(1 - allowed / radius, -1, 1))))


def _samples(surfaces: Surfaces, row: Index, box: Array) -> list[tuple[Array, Array, SurfacePoints]]:
    """Samples u (n,) and v (m,) over rectangles of surfaces (f,), and points at all of u with all of v (n, m, 3)."""
    ways = [tuple(_finer(one) for one in surfaces.cuts(i, *b)) for i, b in zip(row.tolist(), box.tolist(), strict=True)]
    size = np.array([len(u) * len(v) for u, v in ways], np.int64)
    all_u = np.concatenate([np.empty(0), *(np.repeat(u, len(v)) for u, v in ways)])
    all_v = np.concatenate([np.empty(0), *(np.tile(v, len(u)) for u, v in ways)])
    at = surfaces.evaluate(np.repeat(row, size), all_u, all_v)
    out = []
    for (u, v), end in zip(ways, np.cumsum(size).tolist(), strict=True):
        here = slice(end - len(u) * len(v), end)
        out.append((u, v, SurfacePoints(*(x[here].reshape(len(u), len(v), 3) for x in (at.points, at.by_u, at.by_v)))))
    return out


def _measured(
    u: Array, v: Array, at: SurfacePoints, allowed: float, chord_rad: float
) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
    """Places along u and along v with the number of steps that lead to each: by samples of the surface.

    What counts are turns of the normal and of the lines of u and v, and the twist of cells.
    """
    points, by_u, by_v = at.points, at.by_u, at.by_v
    across = np.cross(by_u, by_v)
    speeds = [np.linalg.norm(x, axis=2, keepdims=True) for x in (across, by_u, by_v)]
    good = speeds[0] > 1e-6 * np.max(speeds[1], initial=0.0) * np.max(speeds[2], initial=0.0)
    normal, u_way, v_way = (
        np.where(good & (n > 0), x / np.where(n > 0, n, 1.0), np.nan)
        for x, n in zip((across, by_u, by_v), speeds, strict=True)
    )
    densities = []
    for axis, way in ((0, u_way), (1, v_way)):
        length = np.linalg.norm(np.diff(points, axis=axis), axis=2)
        turn, bend = (_turn(np.diff(x, axis=axis)) for x in (normal, way))
        density = np.maximum.reduce([turn / chord_rad, np.sqrt(turn * length / (8 * allowed)), bend / _BEND_RAD])
        densities.append(np.nan_to_num(density).max(axis=1 - axis))
    cell = points[1:, 1:] - points[1:, :-1] - points[:-1, 1:] + points[:-1, :-1]
    twist = np.nan_to_num(np.abs(np.einsum("nmd,nmd->nm", cell, normal[:-1, :-1])))
    least = [np.maximum(one, 1.0 / len(one)) for one in densities]
    worst = float((twist / (4 * least[0][:, None] * least[1])).max(initial=0.0)) / allowed
    if worst > 1:
        densities = [one * np.sqrt(worst) for one in least]
    u_along, v_along = (np.append(0.0, np.cumsum(one)) for one in densities)
    return (u, u_along), (v, v_along)


def _finer(ends: Array) -> Array:
    """Samples of an interval (n,) from the ends of its smooth pieces."""
    if len(ends) > _MOST // _SAMPLES:
        t = np.sort(np.append(ends[1:], np.linspace(ends[0], ends[-1], _MOST)[:-1]))
        return np.asarray(t[np.append(True, np.diff(t) > 0)])
    shares = np.arange(_SAMPLES) / _SAMPLES
    return np.append((ends[:-1, None] + np.diff(ends)[:, None] * shares).ravel(), ends[-1])


def _turn(chord: Array) -> Array:
    """Angles between unit vectors that differ by so much."""
    return np.asarray(2 * np.arcsin(np.clip(np.linalg.norm(chord, axis=2) / 2, 0, 1)))
