"""How finely surfaces are to be cut along u and along v so that triangles of a lattice keep to them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from relmodel.geometry.curves import groups
from relmodel.geometry.spline_curves import Runs
from relmodel.geometry.surfaces import ANALYTIC_KINDS, Surfaces
from relmodel.loading.facets.chords import numbered

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.int64]

# Of the chord's error: for each of the two directions, and for the twist where there is one.
_SHARE_ROUND, _SHARE = 0.35, 0.25
_BEND_RAD = 0.4  # turn of a line of u or v within the surface, step by step
_MOST = 96  # samples of a direction, less one
_FLAT = 1e-6  # steps: what asks for fewer is straight
_NO_TURN = 1e-10  # rad


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
    steps = _angles(surfaces, row, box, _SHARE_ROUND * chord_mm, chord_rad)
    totals = [(box[:, 2 * k + 1] - box[:, 2 * k]) / steps[k] for k in (0, 1)]
    densities: list[list[tuple[Array, Array] | None]] = [[None] * len(row), [None] * len(row)]
    free = np.flatnonzero(~np.logical_or.reduce([surfaces.kind[row] == kind for kind in ANALYTIC_KINDS]))
    if len(free):
        measured = _measured(surfaces, row[free], box[free], _SHARE * chord_mm, chord_rad)
        for k in (0, 1):
            for i, one in zip(free.tolist(), measured[k], strict=True):
                densities[k][i] = one
                totals[k][i] = one[1][-1]
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


def _measured(
    surfaces: Surfaces, row: Index, box: Array, allowed: float, chord_rad: float
) -> tuple[list[tuple[Array, Array]], list[tuple[Array, Array]]]:
    """Of each free-form surface (f,), places along u and along v with the number of steps that lead to each.

    By samples of the surface, of as many at once as have as many samples: what counts are turns of the normal and of
    the lines of u and v, and the twist of cells.
    """
    pieces = np.array(
        [[len(one) - 1 for one in surfaces.cuts(i, *b)] for i, b in zip(row.tolist(), box.tolist(), strict=True)]
    )
    size = np.where(pieces <= 4, 12, 8 * -(np.minimum(pieces, _MOST // 2) // -4)) + 1  # at least two to a piece
    nothing = np.empty(0), np.empty(0)
    u_steps, v_steps = [nothing] * len(row), [nothing] * len(row)
    key = size[:, 0] * (2 * _MOST + 2) + size[:, 1]
    for one, at in groups(key):
        n, m = divmod(one, 2 * _MOST + 2)
        u, v = (np.linspace(box[at, 2 * k], box[at, 2 * k + 1], c, axis=1) for k, c in ((0, n), (1, m)))
        found = surfaces.evaluate(np.repeat(row[at], n * m), np.repeat(u, m, axis=1).ravel(), np.tile(v, n).ravel())
        points, by_u, by_v = (x.reshape(len(at), n, m, 3) for x in (found.points, found.by_u, found.by_v))
        u_along, v_along = _along(points, by_u, by_v, allowed, chord_rad)
        for j, i in enumerate(at.tolist()):
            u_steps[i], v_steps[i] = (u[j], u_along[j]), (v[j], v_along[j])
    return u_steps, v_steps


def _along(points: Array, by_u: Array, by_v: Array, allowed: float, chord_rad: float) -> tuple[Array, Array]:
    """Steps along u (f, n) and along v (f, m) by samples of surfaces (f, n, m, 3) and their derivatives."""
    across = np.cross(by_u, by_v)
    speeds = [np.sqrt(np.square(x).sum(axis=3, keepdims=True)) for x in (across, by_u, by_v)]
    most = [np.max(x, axis=(1, 2), keepdims=True) for x in speeds]
    good = speeds[0] > 1e-6 * most[1] * most[2]
    normal, u_way, v_way = (
        np.where(good & (n > 0), x / np.where(n > 0, n, 1.0), np.nan)
        for x, n in zip((across, by_u, by_v), speeds, strict=True)
    )
    densities = []
    for axis, way in ((1, u_way), (2, v_way)):
        length = np.sqrt(np.square(np.diff(points, axis=axis)).sum(axis=3))
        turn, bend = (_turn(np.diff(x, axis=axis)) for x in (normal, way))
        density = np.maximum.reduce([turn / chord_rad, np.sqrt(turn * length / (8 * allowed)), bend / _BEND_RAD])
        densities.append(np.nan_to_num(density).max(axis=3 - axis))
    cell = points[:, 1:, 1:] - points[:, 1:, :-1] - points[:, :-1, 1:] + points[:, :-1, :-1]
    twist = np.nan_to_num(np.abs((cell * normal[:, :-1, :-1]).sum(axis=3)))
    least = [np.maximum(one, 1.0 / one.shape[1]) for one in densities]
    worst = (twist / (4 * least[0][:, :, None] * least[1][:, None, :])).max(axis=(1, 2), initial=0.0) / allowed
    stretch, twisted = np.sqrt(worst)[:, None], (worst > 1)[:, None]
    u_along, v_along = (
        np.pad(np.cumsum(np.where(twisted, low * stretch, one), axis=1), ((0, 0), (1, 0)))
        for one, low in zip(densities, least, strict=True)
    )
    return u_along, v_along


def _turn(chord: Array) -> Array:
    """Angles between unit vectors that differ by so much; none where that is round-off."""
    size = np.sqrt(np.square(chord).sum(axis=-1))
    return np.asarray(np.where(size > _NO_TURN, 2 * np.arcsin(np.clip(size / 2, 0, 1)), 0.0))
