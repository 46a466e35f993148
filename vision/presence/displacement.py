"""How far a body lies from where the model has it: one estimator for surfaces, parts and assemblies.

A body is what moves as one and carries edge samples along, each by so many px along its image normal for a unit of the
body's four unknowns.  Three are a shift, mm: of a part along its axes, of a surface that bends around along those of
the world.  The fourth is how far a surface lies outward, mm, or by how much a part is turned, rad.  `fit` finds where
the elements beside a body's edges put it, `Beside.weigh` how much the pictures speak for a place: edge by edge, so that
one long shadow near one edge counts no more than that edge can.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from relmodel.arrays import Bools, Floats, Ints, sum_by_group
from vision.presence.presence_parameters import DisplacementParameters, PresenceParameters
from vision.presence.stretches import compute_log_odds


@dataclass(frozen=True)
class Beside:
    """The edge elements beside samples (n,): `first`, `offset` as `Nearby` has them; usable (e, 2): which may be edges
    of the body on either side of their sample, and do not belong to those of others; weight (n,): px of the samples."""

    first: Ints
    offset: Floats
    usable: Bools
    weight: Floats

    def find_nearest(self, sample: Ints, side: Ints, ahead: Floats, reach_px: float) -> Floats:
        """Px (m,) from samples moved `ahead` px to the nearest usable element, nan where none lies within the reach."""
        from vision.presence import displacement_kernels

        residual = np.empty(len(sample))
        displacement_kernels.find_nearest(sample, side, ahead, self.first, self.offset, self.usable, reach_px, residual)
        return residual

    def weigh(
        self,
        carried: tuple[Ints, Ints, Ints],
        rate: Floats,
        other: Floats,
        chance: Floats,
        shows: Floats,
        grid: Floats,
        reach_px: float,
        p: PresenceParameters,
    ) -> tuple[Floats, Bools]:
        """Log odds (edges, cells) of edges being there against not there, and whether they are in sight, where their
        body is displaced by each cell of the grid.

        carried: samples, their sides, and the edge that each belongs to; rate: px a unit; other: px by which other
        bodies move them; chance, shows: of the edges, as `Runs` has them.
        """
        from vision.presence import displacement_kernels

        q, cells = p.displacement, len(grid)
        sample, side, edge = carried
        seen, found = np.zeros((len(chance), cells)), np.zeros((len(q.tolerance_px), len(chance), cells))
        displacement_kernels.count_found(
            sample, side, edge, rate, other, self.weight, self.first, self.offset, self.usable, grid,
            np.array(q.tolerance_px), np.array([reach_px, q.hidden_px]), seen, found,
        )  # fmt: skip
        # An edge lies where it is drawn well, mostly, or roughly, which places it the less.
        stretches, widest, odds = seen / p.runs.stretch_px, max(q.tolerance_px), []
        for px, tolerance, likely in zip(found, q.tolerance_px, q.drawn, strict=True):
            by_chance = np.maximum(chance * tolerance / widest, p.runs.least_chance)[:, None]
            placed = np.minimum(stretches, 1.0) * np.log(likely * widest / tolerance)
            share = px / np.maximum(seen, 1e-9)
            odds.append(placed + compute_log_odds(share, stretches, by_chance, shows[:, None], p.runs))
        in_sight = seen >= q.least_seen * np.bincount(edge, self.weight[sample], len(chance))[:, None]
        return np.where(in_sight, np.logaddexp.reduce(odds), 0.0), in_sight


@dataclass(frozen=True)
class Displacement:
    """Where bodies (m,) lie: x (m, 4) from where the model has them; covariance (m, 4, 4); agree (m,):
    how many measurements do."""

    x: Floats
    covariance: Floats
    agree: Floats


# Of bodies at x (m, 4), within a reach (px): slope (n, 4) of their samples, px a unit, and residual (n,), px from these
# to their elements, nan where they have none.
Look = Callable[[Floats, float], tuple[Floats, Floats]]


def fit(
    look: Look, body: Ints, counts: Floats, start: Floats, sigma: Floats, p: DisplacementParameters
) -> Displacement:
    """Where the elements beside samples put their bodies: robust least squares (Geman and McClure) from starts (m, 4).

    body (n,), counts (n,): of the samples, and as how many measurements each counts; sigma (m, 4): of the unknowns
    where nothing is seen.
    """
    x, count = start.copy(), len(start)
    prior = sigma[:, :, None] ** -2.0 * np.eye(4)
    for reach in p.reach_px:
        slope, residual = look(x, reach)
        found = np.isfinite(residual)
        residual = np.where(found, residual, 0.0)
        weight = found * counts / (1 + (residual / (p.scale * reach)) ** 2) ** 2
        equations = slope[:, :, None] * np.concatenate([slope, residual[:, None]], axis=1)[:, None, :]
        sums = sum_by_group(body, equations, count, weight) / p.edge_px**2
        pull = sums[:, :, 4] - np.einsum("mij,mj->mi", prior, x)
        step = np.linalg.solve(sums[:, :, :4] + prior, pull[..., None])[..., 0]
        x = x + step
    residual = residual - np.einsum("ni,ni->n", slope, step[body])
    total = np.bincount(body, weight, count)
    variance = np.maximum(np.bincount(body, weight * residual**2, count) / np.maximum(total, 1.0), 1e-6)
    covariance = np.asarray(np.linalg.inv(sums[:, :, :4] * (p.edge_px**2 / variance)[:, None, None] + prior))
    # All edges of a body may be drawn alike.
    by_shift, by_other = np.linalg.norm(slope[:, :3], axis=1), np.abs(slope[:, 3])
    rate = np.stack([np.bincount(body, weight * v, count) for v in (by_shift, by_other)], axis=1)
    alike = p.systematic_px * total[:, None] / np.maximum(rate, 1e-9)
    covariance += np.where(rate > 1e-9, alike, 0.0)[:, [0, 0, 0, 1], None] ** 2 * np.eye(4)
    agreeing = found & (np.abs(residual) < 3 * p.scale * reach)
    return Displacement(x, covariance, np.bincount(body, counts * agreeing, count).astype(float))
