"""Displaced surfaces: by how much each has moved along its own normals.

A surface that moves outward by d carries its edges along on the surfaces that it meets: a wall is thicker, a bore is
wider, a floor lies deeper.  So an edge lies where the displacements of both of its surfaces put it, and all
displacements are sought together.  The surface with the most evidence for a displacement is moved first: it explains
edges of its neighbours too, which then need not move.  The evidence for a displacement is the share of edges found
there against the share found in place, edge by edge (`stretches.compute_log_odds`), so that one long shadow near one
edge counts no more than that edge can.  Elements that belong to predicted edges of other surfaces are ignored.  No face
moves through the one opposite it: of a rib or a web some thickness is left, of a pocket some width.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from relmodel.arrays import Bools, Floats, Ints, sum_by_group
from vision.presence.displacement import Beside, Displacement, fit
from vision.presence.moving_surfaces import MovingSurfaces
from vision.presence.opposed import Opposed
from vision.presence.presence_parameters import MovedParameters, PresenceParameters
from vision.presence.samples import Nearby, Samples
from vision.presence.stretches import Runs
from vision.presence.support import Support

FREE_MM, FIXED_MM = 1e3, 1e-3  # standard deviations of what is sought, and of what is not


@dataclass(frozen=True)
class Edges:
    """The predicted edges, the surfaces that carry them, and the elements beside them: usable by `find_usable`."""

    samples: Samples
    moving: MovingSurfaces
    beside: Beside
    runs: Runs


def find_usable(samples: Samples, nearby: Nearby, support: Support, blends: Bools, p: MovedParameters) -> Bools:
    """Which elements near samples (m, 2) may be edges of a displaced surface, either one of the sample's: they do not
    belong to an edge of other surfaces.

    blends: which elements lie on a predicted blend: its shine is no edge that has moved.
    """
    free = (np.abs(nearby.offset) <= p.own_px) | ~blends[nearby.element]
    owner = support.owner
    surface = samples.surface[nearby.sample]
    own = (samples.surface[owner][:, None, :] == surface[:, :, None]).any(axis=2)
    return np.ascontiguousarray((surface >= 0) & free[:, None] & ((owner < 0)[:, None] | own))


def measure_moved(edges: Edges, surface: Ints, mm: Floats, p: PresenceParameters) -> tuple[Displacement, Bools]:
    """Where surfaces (m,), ascending, lie, from and with all surfaces displaced outward by mm (s,), and which bend
    around: only of these a shift in the plane of their normals, which the pose's error makes as well, is separated."""
    samples, beside, count = edges.samples, edges.beside, len(surface)
    number = np.full(len(mm) + 1, -1)
    number[surface] = np.arange(count)
    known = (beside.weight > 0)[:, None] & (np.abs(samples.px_per_mm) >= p.moved.min_px_per_mm)
    sample, side = (np.ascontiguousarray(i) for i in np.nonzero(known & (number[samples.surface] >= 0)))
    own, rate = samples.surface[sample, side], samples.px_per_mm[sample, side]
    body, length, normal = number[own], beside.weight[sample], samples.normal[sample, side]
    ahead = edges.moving.displace(mm, len(samples.run))[sample]
    slope = rate[:, None] * np.concatenate([normal, np.ones((len(body), 1))], axis=1)
    # As far as its edges are found.
    near = np.isfinite(beside.find_nearest(sample, side, ahead, p.displacement.reach_px[0])) * length
    total = np.maximum(np.bincount(body, near, count), 1e-9)[:, None]
    spread = sum_by_group(body, normal[:, :, None] * normal[:, None, :], count, near) / total[..., None]
    closed = np.linalg.norm(sum_by_group(body, normal, count, near) / total, axis=1) < p.moved.most_mean_normal
    closed &= np.linalg.eigvalsh(spread)[:, 1] > p.moved.least_spread
    start = np.pad(mm[surface, None], [(0, 0), (3, 0)])

    def look(x: Floats, reach: float) -> tuple[Floats, Floats]:
        there = ahead + np.einsum("ni,ni->n", slope, (x - start)[body])
        return slope, beside.find_nearest(sample, side, there, reach)

    free = np.where(closed[:, None], FREE_MM, FIXED_MM)
    sigma = np.concatenate([free, free, free, np.full((count, 1), FREE_MM)], axis=1)
    return fit(look, body, length / p.runs.stretch_px, start, sigma, p.displacement), closed


def seek_moved(
    edges: Edges, count: int, cameras: int, opposed: Opposed, p: PresenceParameters
) -> tuple[Floats, Floats]:
    """How far outward the surfaces (s,) of a scene of `count` lie together, mm, zero in place, and the log odds of that
    against in place with the others where they are, for all the displacements tried: at most zero in place."""
    search = _Search(edges, count, cameras, p)
    mm, log_odds = np.zeros((2, count))
    stale = search.sought
    for _ in range(p.moved.rounds):
        best, log_odds[stale], by_camera = search.weigh(stale, mm, *opposed.limit(mm, p.moved.least_left_mm))
        known = (log_odds[stale] >= p.moved.least_log_odds) & (by_camera.min(axis=1, initial=np.inf) >= 0)
        wanted = mm.copy()
        wanted[stale] = np.where(known, best, 0.0)
        # Of neighbours that would move, or move back, the surest does; and of those that would meet.
        one, other = np.concatenate([search.neighbours, opposed.meet(wanted, p.moved.least_left_mm)], axis=1)
        gain = np.where(wanted != mm, np.maximum(log_odds, 1e-9), 0.0)
        strongest = np.zeros(count)
        np.maximum.at(strongest, one, gain[other])
        changes = (gain > 0) & (gain >= strongest)
        if not changes.any():
            break
        mm = np.where(changes, wanted, mm)
        touched = changes.copy()
        touched[one[changes[other]]] = True
        stale = search.sought[touched[search.sought]]
    return mm, np.where(mm != 0, log_odds, np.minimum(log_odds, 0.0))


class _Search:
    """What the weighing of displacements needs, prepared once; neighbours: pairs of surfaces that meet, both ways."""

    def __init__(self, edges: Edges, count: int, cameras: int, parameters: PresenceParameters) -> None:
        from scipy.sparse import csr_array

        p, samples, px = parameters.moved, edges.samples, edges.beside.weight
        self.edges, self.count, self.cameras, self.p, self.parameters = edges, count, cameras, p, parameters
        half = round(p.reach_mm / p.step_mm)
        self.grid = p.step_mm * np.arange(-half, half + 1, dtype=np.float64)
        moving = edges.moving
        known = (px[moving.sample] > 0) & (np.abs(moving.rate) >= p.min_px_per_mm)
        self.sample, self.side, self.rate_px = moving.sample[known], moving.side[known], moving.rate[known]
        surface = moving.surface[known]
        run, weight = samples.run[self.sample], px[self.sample]
        first = np.flatnonzero((np.diff(surface, prepend=-1) != 0) | (np.diff(run, prepend=-1) != 0))
        self.group = np.repeat(np.arange(len(first)), np.diff(np.append(first, len(surface))))
        self.surface, self.run = surface[first], run[first]
        distinct_px = np.bincount(surface, weight, count)
        self.rate = np.bincount(surface, weight * np.abs(self.rate_px), count) / np.maximum(distinct_px, 1e-9)
        self.sought = np.flatnonzero(distinct_px >= p.least_distinct_px)
        # Surfaces that carry the same edge.
        carries = csr_array((np.ones(len(moving.sample)), (moving.sample, moving.surface)), (len(px), count))
        one, other = (carries.T @ carries).nonzero()
        self.neighbours = np.stack([one, other])[:, one != other].astype(np.int64)

    def weigh(self, surface: Ints, mm: Floats, low: Floats, high: Floats) -> tuple[Floats, Floats, Floats]:
        """The best displacement (m,) of surfaces, away from their place and between bounds (s,), with its log odds (m,)
        against in place, and by camera (m, c)."""
        p, cells, runs = self.p, len(self.grid), self.edges.runs
        number = np.full(self.count, -1)
        number[surface] = np.arange(len(surface))
        groups = np.flatnonzero(number[self.surface] >= 0)
        odds = self._weigh_edges(groups, mm)
        by_camera = np.zeros((len(surface), self.cameras, cells))
        np.add.at(by_camera, (number[self.surface[groups]], runs.camera[self.run[groups]]), odds)
        by_camera -= by_camera[:, :, cells // 2, None]
        clear = np.maximum(self.parameters.displacement.least_mm, p.least_px / np.maximum(self.rate[surface], 1e-9))
        penalty = np.log(2 * p.reach_mm / p.distinct_mm)
        there = (self.grid >= low[surface, None]) & (self.grid <= high[surface, None])
        there &= np.abs(self.grid) >= clear[:, None]
        total = np.where(there, by_camera.sum(axis=1) - penalty, -np.inf)
        best = total.argmax(axis=1) if len(surface) else np.zeros(0, np.int64)
        every = np.arange(len(surface))
        return self.grid[best], total[every, best], by_camera[every, :, best]

    def _weigh_edges(self, groups: Ints, mm: Floats) -> Floats:
        """Log odds (groups, cells) of an edge being there against not, where its surface is displaced."""
        edges, runs, middle = self.edges, self.edges.runs, len(self.grid) // 2
        number = np.full(len(self.surface), -1)
        number[groups] = np.arange(len(groups))
        rows = np.flatnonzero(number[self.group] >= 0)
        sample, group, rate = self.sample[rows], self.group[rows], self.rate_px[rows]
        other = edges.moving.displace(mm, len(edges.samples.run))[sample] - rate * mm[self.surface[group]]
        run, reach = self.run[groups], self.parameters.samples.reach_px - max(self.parameters.displacement.tolerance_px)
        odds, in_sight = edges.beside.weigh(
            (sample, self.side[rows], number[group]), rate, other, runs.chance[run], runs.shows[run], self.grid, reach,
            self.parameters,
        )  # fmt: skip
        # An edge that is out of sight at a displacement is no evidence for it where it is not found in place.
        return np.where(in_sight, odds, np.minimum(odds[:, middle, None], 0.0))
