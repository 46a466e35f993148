"""Surfaces that lie beside their place: by how much each has moved along its own normals.

A surface that moves outward by d carries its edges along on the surfaces that it meets: a wall is thicker, a bore is
wider, a floor lies deeper.  So an edge lies where the displacements of its two surfaces put it together, and the
displacements are sought together: that surface whose displacement the pictures speak for most is moved first, for it
explains edges of its neighbours too, which then need not move.  What speaks for a displacement are the shares of edges
found there against those found in place, edge by edge (`runs.compute_log_odds`), so that one long shadow beside one
edge says no more than that edge can.  Elements that belong to predicted edges of other surfaces say nothing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from relmodel.arrays import Bools, Floats, Ints
from vision.presence.parameters import MovedParameters, RunParameters
from vision.presence.runs import Runs, compute_log_odds
from vision.presence.samples import Beside, Samples
from vision.presence.support import Support


@dataclass(frozen=True)
class Pulls:
    """What elements say of surfaces' displacements, as columns: row of Beside, sample, side of the sample (0, 1), the
    surface, and the displacement (mm) that would carry the sample's edge onto the element."""

    row: Ints
    sample: Ints
    side: Ints
    surface: Ints
    mm: Floats


@dataclass(frozen=True)
class Moved:
    """The scene's surfaces (s,) where the pictures put them together.

    mm: displacement outward, zero in place; log_odds: of that against in place with the others where they are, for all
    the displacements tried; by_camera (s, c): likewise, what each camera alone says.
    """

    mm: Floats
    log_odds: Floats
    by_camera: Floats


def find_usable(samples: Samples, beside: Beside, support: Support, blends: Bools, p: MovedParameters) -> Bools:
    """Which elements beside samples (m, 2) may be edges of the sample's either surface that has moved: they do not
    belong to an edge of other surfaces.

    blends: which elements lie on a predicted blend: its shine is no edge that has moved.
    """
    free = (np.abs(beside.offset) <= p.own_px) | ~blends[beside.element]
    owner = support.owner
    surface = samples.surface[beside.sample]
    own = (samples.surface[owner][:, None, :] == surface[:, :, None]).any(axis=2)
    return np.ascontiguousarray((surface >= 0) & free[:, None] & ((owner < 0)[:, None] | own))


def collect_pulls(
    samples: Samples, beside: Beside, support: Support, usable: Bools, mm: Floats, p: MovedParameters
) -> Pulls:
    """All displacements within reach that usable elements speak for; mm (s,): where the other surfaces lie."""
    other = displace(samples, mm)
    pieces = []
    for side in (0, 1):
        rate = samples.px_per_mm[beside.sample, side]
        row = np.flatnonzero(usable[:, side] & (np.abs(rate) >= p.min_px_per_mm) & (support.weight[beside.sample] > 0))
        away = (beside.offset[row] - other[beside.sample[row], side]) / rate[row]
        near = np.abs(away) <= p.reach_mm
        row, away = row[near], away[near]
        sample = beside.sample[row]
        pieces.append((row, sample, np.full(len(row), side), samples.surface[sample, side], away))
    return Pulls(*(np.concatenate(column) for column in zip(*pieces, strict=True)))


def seek_moved(
    samples: Samples,
    beside: Beside,
    support: Support,
    runs: Runs,
    usable: Bools,
    count: int,
    cameras: int,
    p: MovedParameters,
    run_parameters: RunParameters,
    reach_px: float,
) -> Moved:
    """Where the surfaces of a scene of `count` lie together."""
    search = _Search(samples, beside, support, runs, usable, count, cameras, p, run_parameters, reach_px)
    mm, log_odds, by_camera = np.zeros(count), np.zeros(count), np.zeros((count, cameras))
    stale = search.sought
    for _ in range(p.rounds):
        best, odds, cameras_odds = search.weigh(stale, mm)
        log_odds[stale], by_camera[stale] = odds, cameras_odds
        agree = cameras_odds.min(axis=1, initial=np.inf) >= 0
        wanted = mm.copy()
        wanted[stale] = np.where((odds >= p.least_log_odds) & agree, best, 0.0)
        # Of neighbours that would move, the surest does.
        gain = np.where(wanted != mm, np.maximum(log_odds, 1e-9), 0.0)
        strongest = np.zeros(count)
        for a, b in (search.pairs, search.pairs[::-1]):
            np.maximum.at(strongest, a, gain[b])
        changed = (gain > strongest) | ((gain > 0) & (gain == strongest))
        if not changed.any():
            break
        mm = np.where(changed, wanted, mm)
        touched = np.zeros(count, bool)
        touched[changed] = True
        for a, b in (search.pairs, search.pairs[::-1]):
            touched[a[changed[b]]] = True
        stale = search.sought[touched[search.sought]]
    log_odds[mm == 0] = np.minimum(log_odds[mm == 0], 0.0)
    return Moved(mm, log_odds, by_camera)


def displace(samples: Samples, mm: Floats) -> Floats:
    """Px (n, 2) by which the other surface's displacement moves each sample, for either of its surfaces."""
    away = np.append(mm, 0.0)[samples.surface] * samples.px_per_mm
    return np.ascontiguousarray(away[:, ::-1])


class _Search:
    """What the weighing of displacements needs, prepared once."""

    def __init__(
        self,
        samples: Samples,
        beside: Beside,
        support: Support,
        runs: Runs,
        usable: Bools,
        count: int,
        cameras: int,
        p: MovedParameters,
        run_parameters: RunParameters,
        reach_px: float,
    ) -> None:
        self.samples, self.beside, self.support, self.runs = samples, beside, support, runs
        self.usable, self.count, self.cameras, self.p, self.run_parameters = usable, count, cameras, p, run_parameters
        half = round(p.reach_mm / p.step_mm)
        self.penalty = np.log(2 * p.reach_mm / p.distinct_mm)
        self.grid = p.step_mm * np.arange(-half, half + 1)
        self.limits = np.array([reach_px - max(p.tolerance_px), p.hidden_px])
        told = (samples.surface >= 0) & (support.weight[:, None] > 0)
        told &= np.abs(samples.px_per_mm) >= p.min_px_per_mm
        sample, side = np.nonzero(told)
        surface, run = samples.surface[sample, side], samples.run[sample]
        order = np.lexsort((sample, run, surface))
        self.sample, self.side = sample[order].astype(np.int64), side[order].astype(np.int64)
        surface, run = surface[order], run[order]
        first = np.flatnonzero((np.diff(surface, prepend=-1) != 0) | (np.diff(run, prepend=-1) != 0))
        self.group = np.repeat(np.arange(len(first)), np.diff(np.append(first, len(surface))))
        self.surface, self.run = surface[first], run[first]
        rate = np.abs(samples.px_per_mm[self.sample, self.side])
        weight = support.weight[self.sample]
        told_px = np.bincount(surface, weight, count)
        self.rate = np.bincount(surface, weight * rate, count) / np.maximum(told_px, 1e-9)
        self.sought = np.flatnonzero(told_px >= p.least_told_px)
        both = np.unique(samples.surface[(samples.surface >= 0).all(axis=1)], axis=0)
        both = both[both[:, 0] != both[:, 1]]
        self.pairs = both[:, 0], both[:, 1]

    def weigh(self, surface: Ints, mm: Floats) -> tuple[Floats, Floats, Floats]:
        """The best displacement (m,) of surfaces, away from their place, with its log odds (m,) against in place, and
        by camera (m, c)."""
        from vision.presence import moved_kernels

        cells = len(self.grid)
        number = np.full(self.count, -1)
        number[surface] = np.arange(len(surface))
        groups = np.flatnonzero(number[self.surface] >= 0)
        renumbered = np.full(len(self.surface), -1)
        renumbered[groups] = np.arange(len(groups))
        rows = np.flatnonzero(renumbered[self.group] >= 0)
        seen, found = np.zeros((len(groups), cells)), np.zeros((len(self.p.tolerance_px), len(groups), cells))
        moved_kernels.count_found(
            self.sample[rows], self.side[rows], renumbered[self.group[rows]],
            np.ascontiguousarray(self.samples.px_per_mm), displace(self.samples, mm), self.support.weight,
            self.beside.first, self.beside.offset, self.usable, self.grid, np.array(self.p.tolerance_px), self.limits,
            seen, found,
        )  # fmt: skip
        # An edge lies where it is drawn well, mostly, or roughly, which places it the less.
        run, one = self.run[groups], np.ones((1, cells))
        chance, shows = self.runs.chance[run][:, None] * one, self.runs.shows[run][:, None] * one
        stretches, widest = seen / self.run_parameters.stretch_px, max(self.p.tolerance_px)
        odds = np.logaddexp.reduce(
            [
                np.minimum(stretches, 1.0) * np.log(likely * widest / tolerance)
                + compute_log_odds(
                    px / np.maximum(seen, 1e-9), stretches,
                    np.maximum(chance * tolerance / widest, self.run_parameters.least_chance), shows,
                    self.run_parameters,
                )
                for px, tolerance, likely in zip(found, self.p.tolerance_px, self.p.drawn, strict=True)
            ]
        )  # fmt: skip
        at = number[self.surface[groups]] * self.cameras + self.runs.camera[run]
        if getattr(self,"debug",False):
            self.kept=(run,odds,seen,found)
        by_camera = np.zeros((len(surface) * self.cameras, cells))
        whole = np.bincount(renumbered[self.group[rows]], self.support.weight[self.sample[rows]], len(groups))
        np.add.at(by_camera, at, np.where(seen >= self.p.least_seen * whole[:, None], odds, 0.0))
        by_camera = by_camera.reshape(len(surface), self.cameras, cells)
        still = cells // 2
        by_camera -= by_camera[:, :, still : still + 1]
        total = by_camera.sum(axis=1) - np.abs(self.grid) / self.p.usual_mm - self.penalty
        clear = np.abs(self.grid)[None] >= np.maximum(
            self.p.least_mm, self.p.least_px / np.maximum(self.rate[surface], 1e-9)[:, None]
        )
        total = np.where(clear, total, -np.inf)
        best = np.argmax(total, axis=1) if len(surface) else np.zeros(0, np.int64)
        every = np.arange(len(surface))
        return self.grid[best], total[every, best], by_camera[every, :, best]
