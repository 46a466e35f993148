"""Displacement of bodies that carry edges along, and evidence by surface: in place or displaced, and how far."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from relmodel.arrays import Bools, Floats, Ints, count_from, sum_by_group
from vision.account.runs import EdgeRuns, compute_log_odds
from vision.account.samples import Nearby, Samples, are_crowded
from vision.localisation.hypotheses import BLOOM_PX
from vision.presence.items import Items
from vision.presence.presence_parameters import DisplacementParameters, PresenceParameters
from vision.scene import Scene, StoredScene

# A body is what moves as one and carries edge samples along, each by so many px along its image normal for a unit of
# the body's four unknowns. Three are a shift, mm: of a part along its axes, of a surface that bends around along those
# of the world. The fourth is how far a surface lies outward, mm, or by how much a part is turned, rad. `fit` finds
# where the elements beside a body's edges put it, `BodyElements.weigh` how much the pictures speak for a place: edge by
# edge, so that one long shadow near one edge counts no more than that edge can.


@dataclass(frozen=True)
class BodyElements:
    """The edge elements beside samples (n,): `first`, `offset` as `Nearby` has them; usable (e, 2): which may be edges
    of the body on either side of their sample, and do not belong to those of others; weight (n,): px of the samples."""

    first: Ints
    offset: Floats
    usable: Bools
    weight: Floats

    def find_nearest(self, sample: Ints, side: Ints, ahead: Floats, reach_px: float) -> Floats:
        """Px (m,) from samples moved `ahead` px to the nearest usable element, nan where none lies within the reach."""
        from vision.presence import kernels

        residual = np.empty(len(sample))
        kernels.find_nearest(sample, side, ahead, self.first, self.offset, self.usable, reach_px, residual)
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
        bodies move them; chance, shows: of the edges, as `EdgeRuns` has them."""
        from vision.presence import kernels

        q, cells = p.displacement, len(grid)
        sample, side, edge = carried
        seen, found = np.zeros((len(chance), cells)), np.zeros((len(q.tolerance_px), len(chance), cells))
        kernels.count_found(
            sample, side, edge, rate, other, self.weight, self.first, self.offset, self.usable, grid,
            np.array(q.tolerance_px), np.array([reach_px, q.hidden_px, p.account.support.crowded_px]), seen, found,
        )  # fmt: skip
        # An edge lies where it is drawn well, mostly, or roughly, which places it the less.
        stretches, widest, odds = seen / p.account.runs.stretch_px, max(q.tolerance_px), []
        for px, tolerance, likely in zip(found, q.tolerance_px, q.drawn, strict=True):
            by_chance = np.maximum(chance * tolerance / widest, p.account.runs.least_chance)[:, None]
            placed = np.minimum(stretches, 1.0) * np.log(likely * widest / tolerance)
            share = px / np.maximum(seen, 1e-9)
            odds.append(placed + compute_log_odds(share, stretches, by_chance, shows[:, None], p.account.runs))
        in_sight = seen >= q.least_seen * np.bincount(edge, self.weight[sample], len(chance))[:, None]
        return np.where(in_sight, np.logaddexp.reduce(odds), 0.0), in_sight


@dataclass(frozen=True)
class Displacement:
    """Where bodies (m,) lie: x (m, 4) from where the model has them; covariance (m, 4, 4); agree (m,): measurements."""

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

    body (n,), counts (n,): of samples, and as how many measurements each counts; sigma (m, 4): where none shows."""
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


# Which surfaces carry predicted edges along when they move, and by how much.
#
# An edge moves with either of its surfaces. Where a wall runs out into a rounded corner, the corner moves with the
# wall, and its edges with it: by as much as the corner's normal looks the wall's way.


@dataclass(frozen=True)
class MovingSurfaces:
    """What carries samples along, as columns, sorted by surface, run and sample: sample; side: of its two surfaces the
    one through which it is carried; surface: the scene's that carries; rate: px along the image normal a mm outward."""

    sample: Ints
    side: Ints
    surface: Ints
    rate: Floats

    def displace(self, mm: Floats, count: int) -> Floats:
        """Px (n,) by which `count` samples move where surfaces (s,) lie mm outward."""
        return np.bincount(self.sample, self.rate * mm[self.surface], count).astype(float)


def find_tangent(stored: StoredScene, least_cosine: float) -> tuple[Ints, Ints, Floats]:
    """Planes with the cylinders that they run smoothly into, as pairs (m,), (m,), and the planes' normals (m, 3)."""
    scene, count = stored.scene, len(stored.surface_no)
    arc, arcs = scene.sample_arc, len(stored.arc_surfaces)
    mean = np.bincount(arc, scene.sample_cosine, arcs) / np.maximum(np.bincount(arc, minlength=arcs), 1)
    smooth = np.flatnonzero((mean > least_cosine) & (stored.arc_surfaces >= 0).all(axis=1))

    total, number = np.zeros((count, 3)), np.zeros(count)
    for side, normal in ((0, scene.sample_normal_a), (1, scene.sample_normal_b)):
        surface = stored.arc_surfaces[arc, side]
        there = surface >= 0
        total += sum_by_group(surface[there], normal[there], count)
        number += np.bincount(surface[there], minlength=count)
    normal = total / np.maximum(number, 1)[:, None]
    flat = np.linalg.norm(normal, axis=1) > least_cosine
    pairs = stored.arc_surfaces[smooth]
    pairs = np.unique(np.concatenate([pairs, pairs[:, ::-1]]), axis=0)
    pairs = pairs[flat[pairs[:, 0]] & np.isfinite(stored.radius[pairs[:, 1]])]
    return pairs[:, 0], pairs[:, 1], normal[pairs[:, 0]]


def find_moving_surfaces(samples: Samples, tangent: tuple[Ints, Ints, Floats]) -> MovingSurfaces:
    """The surfaces that carry each sample: its own, and the planes tangent to them, from `find_tangent`."""
    sample, side = np.nonzero(samples.surface >= 0)
    surface, rate = samples.surface[sample, side], samples.px_per_mm[sample, side]
    plane, cylinder, normal = tangent
    order = np.argsort(cylinder, kind="stable")
    plane, cylinder, normal = plane[order], cylinder[order], normal[order]
    low, high = (np.searchsorted(cylinder, surface, side=end) for end in ("left", "right"))
    of, at = count_from(low, high - low)
    turned = np.einsum("ni,ni->n", samples.normal[sample[of], side[of]], normal[at])
    columns = [
        np.concatenate(pair)
        for pair in ((sample, sample[of]), (side, side[of]), (surface, plane[at]), (rate, rate[of] * turned))
    ]
    order = np.lexsort((columns[0], samples.run[columns[0]], columns[2]))
    return MovingSurfaces(*(np.ascontiguousarray(column[order]) for column in columns))


# Flat faces of one feature that are opposite each other, and how far they can move: a rib keeps some thickness, a
# pocket some width, and neither is larger than its part.


@dataclass(frozen=True)
class FacePairs:
    """Pairs of faces, as columns: item: the rib, web or pocket; one, other: the scene's surfaces; mm: what is between
    them by the model; sign: whether that grows (1, material) or shrinks (-1, room) as they move outward; most: what the
    part can hold between them, mm."""

    item: Ints
    one: Ints
    other: Ints
    mm: Floats
    sign: Ints
    most: Floats

    def sizes(self, moved: Floats) -> Floats:
        """What is between the faces where surfaces (s,) lie so far outward, mm."""
        return np.asarray(self.mm + self.sign * (moved[self.one] + moved[self.other]))

    def meet(self, moved: Floats, least: float) -> Ints:
        """Pairs of surfaces (2, m), both ways, with less than `least` mm between, or more than the part holds."""
        size = self.sizes(moved)
        rows = np.flatnonzero((size < least) | (size > self.most))
        pairs = np.stack([self.one[rows], self.other[rows]])
        return np.concatenate([pairs, pairs[::-1]], axis=1)

    def limit(self, moved: Floats, least: float) -> tuple[Floats, Floats]:
        """How far in and out (s,) each surface can lie, mm, with those opposite where they are: `least` is left."""
        low, high = np.full(len(moved), -np.inf), np.full(len(moved), np.inf)
        bounds = np.sort(self.sign * (np.stack([np.full(len(self.mm), least), self.most]) - self.mm), axis=0)
        for surface, opposite in ((self.one, self.other), (self.other, self.one)):
            np.maximum.at(low, surface, bounds[0] - moved[opposite])
            np.minimum.at(high, surface, bounds[1] - moved[opposite])
        return low, high


def find_opposed(items: Items, scene: Scene, middle: Floats, normal: Floats) -> FacePairs:
    """Opposite faces of ribs, webs and pockets; middle, normal (s, 3): of surfaces, the mean of the unit normals."""
    flat = np.linalg.norm(normal, axis=1) > 0.99
    material = np.isfinite(items.thickness)[items.member]
    rows = np.flatnonzero(flat[items.surface] & (material | (np.array(items.kind)[items.member] == "pocket")))
    pairs = [np.zeros((2, 0), np.int64)]
    for k in range(1, int(np.bincount(items.member[rows]).max(initial=1))):
        same = items.member[rows[:-k]] == items.member[rows[k:]]
        pairs.append(np.stack([rows[:-k][same], rows[k:][same]]))
    first, second = np.concatenate(pairs, axis=1)
    item, one, other = items.member[first], items.surface[first], items.surface[second]
    across = np.einsum("ni,ni->n", normal[one], middle[other] - middle[one])
    sign = np.where(material[first], 1, -1)
    facing = np.einsum("ni,ni->n", normal[one], normal[other])
    opposite = (facing < np.where(sign > 0, -0.98, -0.9999)) & (sign * across < 0)  # sides of ribs have draft
    order = np.flatnonzero(opposite)[np.lexsort((other[opposite], one[opposite], item[opposite]))]
    item, one, other = item[order], one[order], other[order]
    mm = np.where(sign[order] > 0, items.thickness[item], across[order])
    return FacePairs(item, one, other, mm, sign[order], _extents(scene, one, normal[one]))


def _extents(scene: Scene, surface: Ints, normal: Floats) -> Floats:
    """How long (n,) the parts of surfaces are along directions (n, 3), by the middles of their surfaces."""
    count = len(scene.surface_occurrence)
    number = np.maximum(np.bincount(scene.triangle_surface, minlength=count), 1)
    corners = scene.vertices[scene.triangles].mean(axis=1)
    middle = np.stack([np.bincount(scene.triangle_surface, c, count) for c in corners.T], axis=1) / number[:, None]
    along = normal @ middle.T
    apart = scene.surface_occurrence[surface][:, None] != scene.surface_occurrence
    return np.asarray(np.where(apart, -np.inf, along).max(axis=1) - np.where(apart, np.inf, along).min(axis=1))


# Displaced surfaces: by how much each has moved along its own normals.
#
# A surface that moves outward by d carries its edges along on the surfaces that it meets: a wall is thicker, a bore is
# wider, a floor lies deeper. So an edge lies where the displacements of both of its surfaces put it, and all
# displacements are sought together. The surface with the most evidence for a displacement is moved first: it explains
# edges of its neighbours too, which then need not move. The evidence for a displacement is the share of edges found
# there against the share found in place. Elements that belong to predicted edges of other surfaces are ignored. No face
# moves through the one opposite it.

FREE_MM, FIXED_MM = 1e3, 1e-3  # standard deviations of what is sought, and of what is not
SHADED_PX = 2.0  # within which an element lies where a displaced edge does


@dataclass(frozen=True)
class EdgePredictions:
    """The predicted edges, the surfaces that carry them, and the elements beside them: usable by `find_usable`; runs,
    pieces, piece (n,): as `EdgeAccount` has them; shaded (e,): whether what lies between element and prediction is
    darker than what lies beyond; drawn (n,): variance (px^2) of those beside each sample, great where they border on
    white."""

    samples: Samples
    moving: MovingSurfaces
    beside: BodyElements
    runs: EdgeRuns
    pieces: EdgeRuns
    piece: Ints
    shaded: Bools
    drawn: Floats


def find_usable(samples: Samples, nearby: Nearby, owner: Ints) -> Bools:
    """Which elements near samples (m, 2) may be edges of a displaced surface, either one of the sample's: they do not
    belong to an edge of other surfaces, as `SampleSupport.owner` has it."""
    surface = samples.surface[nearby.sample]
    own = (samples.surface[owner][:, None, :] == surface[:, :, None]).any(axis=2)
    return np.ascontiguousarray((surface >= 0) & ((owner < 0)[:, None] | own))


def measure_moved(
    edges: EdgePredictions, surface: Ints, mm: Floats, inward: Bools, p: PresenceParameters
) -> tuple[Displacement, Bools]:
    """Where surfaces (m,), ascending, lie, from and with all surfaces displaced outward by mm (s,), and which bend
    around, a hollow where `inward` (s,): only of these a shift in the plane of their normals, which the pose's error
    makes as well, is separated."""
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
    found = fit(look, body, length / p.account.runs.stretch_px, start, sigma, p.displacement)
    # Edges nearer than the operator is wide draw each other aside, as the rim and the foot of a washer.
    crowded = are_crowded(samples, p.account.support, by_own=True)[sample]
    worse = 1 + (p.moved.crowded**2 - 1) * np.bincount(body, near * crowded, count) / total[:, 0]
    found = replace(found, covariance=found.covariance * worse[:, None, None])
    px_per_mm = np.bincount(body, near * np.abs(rate), count) / total[:, 0]
    drawn = np.bincount(body, near * edges.drawn[sample], count) / total[:, 0]
    bores = closed & inward[surface]  # which are drawn alike
    found.covariance[:, 3, 3] += np.where(bores, 0.0, drawn / np.maximum(px_per_mm, 1e-9) ** 2)
    return take_off_common(found, px_per_mm, bores, drawn, p.displacement), closed


COMMON_PX = np.linspace(-1.5, 1.5, 61)  # by which light and response may draw the rims of all bores aside
MOST_RIM_SIGMA = 3.0  # as which a rim counts at most against it: one that is resized lies far from the others


def take_off_common(
    found: Displacement, px_per_mm: Floats, bores: Bools, drawn: Floats, p: DisplacementParameters
) -> Displacement:
    """Where bodies (m,) lie, bores less what the rims of the others in like light are drawn aside alike, in the mean;
    drawn (m,): as `EdgePredictions` has it, of the edges of each."""
    from scipy.special import softmax

    rows = np.flatnonzero(bores & (px_per_mm > 0))
    rate, x, covariance = px_per_mm[rows], found.x.copy(), found.covariance.copy()
    own = np.maximum(covariance[rows, 3, 3] * rate**2 - p.systematic_px**2, 0.0) + p.rim_px**2
    square = ((x[rows, 3] * rate)[:, None] - COMMON_PX) ** 2 / own[:, None]
    cost = 0.5 * square / (1 + square / MOST_RIM_SIGMA**2)
    white = drawn[rows] > BLOOM_PX**2 / 2
    prior = 0.5 * COMMON_PX**2 / (p.systematic_px**2 + drawn[rows, None])
    likely = softmax(cost - (white[:, None] == white) @ cost - prior, axis=1)
    common = likely @ COMMON_PX
    x[rows, 3] -= common / rate
    covariance[rows, 3, 3] = (own + likely @ COMMON_PX**2 - common**2) / rate**2
    return replace(found, x=x, covariance=covariance)


def seek_moved(
    edges: EdgePredictions, parted: Bools, cameras: int, opposed: FacePairs, p: PresenceParameters
) -> tuple[Floats, Floats]:
    """How far outward the scene's surfaces (s,) lie together, mm, zero in place, and the log odds of that against in
    place with the others where they are, for all the displacements tried: at most zero in place.  parted (s,): whose
    edges count piece by piece: of a rim light hides one side."""
    search = _DisplacementSearch(edges, parted, cameras, p)
    least = np.where(parted, p.moved.sure_log_odds, p.moved.least_log_odds)
    mm, log_odds = np.zeros((2, len(parted)))
    stale = search.sought
    for _ in range(p.moved.rounds):
        best, log_odds[stale], by_camera = search.weigh(stale, mm, *opposed.limit(mm, p.moved.least_left_mm))
        known = (log_odds[stale] >= least[stale]) & (by_camera.min(axis=1, initial=np.inf) >= 0)
        wanted = mm.copy()
        wanted[stale] = np.where(known, best, 0.0)
        # Of neighbours that would move, or move back, the surest does; and of those that would meet.
        one, other = np.concatenate([search.neighbours, opposed.meet(wanted, p.moved.least_left_mm)], axis=1)
        gain = np.where(wanted != mm, np.maximum(log_odds, 1e-9), 0.0)
        strongest = np.zeros(len(parted))
        np.maximum.at(strongest, one, gain[other])
        changes = (gain > 0) & (gain >= strongest)
        if not changes.any():
            break
        mm = np.where(changes, wanted, mm)
        touched = changes.copy()
        touched[one[changes[other]]] = True
        stale = search.sought[touched[search.sought]]
    return mm, np.where(mm != 0, log_odds, np.minimum(log_odds, 0.0))


class _DisplacementSearch:
    """What the weighing of displacements needs, prepared once; neighbours: pairs of surfaces that meet, both ways."""

    def __init__(self, edges: EdgePredictions, parted: Bools, cameras: int, parameters: PresenceParameters) -> None:
        from scipy.sparse import csr_array

        p, samples, px, count = parameters.moved, edges.samples, edges.beside.weight, len(parted)
        self.runs = EdgeRuns.stack([edges.runs, edges.pieces])
        self.edges, self.count, self.cameras, self.p, self.parameters = edges, count, cameras, p, parameters
        half = round(p.reach_mm / p.step_mm)
        self.grid = p.step_mm * np.arange(-half, half + 1, dtype=np.float64)
        moving = edges.moving
        known = (px[moving.sample] > 0) & (np.abs(moving.rate) >= p.min_px_per_mm)
        self.sample, self.side, self.rate_px = moving.sample[known], moving.side[known], moving.rate[known]
        surface = moving.surface[known]
        piece, weight = len(edges.runs) + edges.piece[self.sample], px[self.sample]
        run = np.where(parted[surface], piece, samples.run[self.sample])
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
        p, cells, runs = self.p, len(self.grid), self.runs
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
        edges, runs, middle = self.edges, self.runs, len(self.grid) // 2
        number = np.full(len(self.surface), -1)
        number[groups] = np.arange(len(groups))
        rows = np.flatnonzero(number[self.group] >= 0)
        sample, group, rate = self.sample[rows], self.group[rows], self.rate_px[rows]
        other = edges.moving.displace(mm, len(edges.samples.run))[sample] - rate * mm[self.surface[group]]
        run, p = self.run[groups], self.parameters
        reach = p.account.samples.reach_px - max(p.displacement.tolerance_px)
        odds, in_sight = edges.beside.weigh(
            (sample, self.side[rows], number[group]), rate, other, runs.chance[run], runs.shows[run], self.grid, reach,
            p,
        )  # fmt: skip
        # An edge that is out of sight at a displacement is no evidence for it where it is not found in place.
        return np.where(in_sight, odds, np.minimum(odds[:, middle, None], 0.0))


@dataclass(frozen=True)
class SceneSurfaces:
    """The scene's surfaces (s,) as their edges show them.

    moved: whether the edges are found displaced and not in place; log_odds: of that against being in place, at
    most zero where it has not; mm: how far outward the surface lies from where the model has it, nan where it was not
    measured; sigma (mm); shift (s, 3): how far it lies from there in the plane of its normals, mm in the world, of one
    that bends around; shift_sigma (mm), nan for others; inward: whether it bends around a hollow; middle (s, 3), normal
    (s, 3): mean of its edges in the world, mm, and of its unit normals; distinct_px: of its edges that can be
    distinguished from others.  opposed: which lie opposite each other."""

    moved: Bools
    log_odds: Floats
    mm: Floats
    sigma: Floats
    shift: Floats
    shift_sigma: Floats
    inward: Bools
    middle: Floats
    normal: Floats
    distinct_px: Floats
    opposed: FacePairs


def assess_surfaces(
    edges: EdgePredictions, stored: StoredScene, items: Items, cameras: int, p: PresenceParameters
) -> SceneSurfaces:
    """The scene's surfaces by their edges."""
    samples, runs, count, q = edges.samples, edges.runs, len(stored.surface_no), p.displacement
    inward, middle, normal = _bend(samples, count)
    opposed = find_opposed(items, stored.scene, middle, normal)
    run, side = np.nonzero(runs.surface >= 0)
    weight, supported, showing = (
        np.bincount(runs.surface[run, side], px[run], count).astype(float)
        for px in (runs.weight_px, runs.weight_px * runs.found, runs.weight_px * runs.shows)
    )
    bent = np.isfinite(stored.radius) & (np.linalg.norm(normal, axis=1) < p.moved.most_mean_normal)
    elsewhere = supported <= p.moved.most_in_place * weight
    sought, log_odds = seek_moved(edges, bent & elsewhere, cameras, opposed, p)
    there = np.flatnonzero(weight >= p.moved.least_distinct_px)
    offsets, closed = measure_moved(edges, there, sought, inward, p)
    # A shadow runs along straight edges, and not all around a bore.
    open_mm = np.where(np.isin(np.arange(count), there[closed]), 0.0, sought)
    certain = log_odds >= p.moved.sure_log_odds
    certain &= find_shaded(edges, open_mm) < p.moved.most_shaded
    # Surfaces found in place, or found displaced, or bent around and found all around, wherever their rims lie.
    agree_px = offsets.agree * p.account.runs.stretch_px
    found, in_place = (px >= p.moved.least_there * showing[there] for px in (agree_px, supported[there]))
    half = items.inset[there] & np.isfinite(stored.radius[there]) & in_place  # a rim, by its tolerance
    sure = np.where(sought[there] != 0, certain[there] | closed | half, in_place | (closed & found))
    sure &= agree_px >= p.moved.least_distinct_px
    kept = there[sure]
    mm, sigma, shift_sigma = np.full((3, count), np.nan)
    shift = np.full((count, 3), np.nan)
    mm[kept], sigma[kept] = offsets.x[sure, 3], np.sqrt(offsets.covariance[sure, 3, 3])
    shift[kept] = np.where(closed[:, None], offsets.x[:, :3], 0.0)[sure]
    # Along the axis of a bore its edges say nothing.
    across = np.where(closed, np.linalg.eigvalsh(offsets.covariance[:, :3, :3])[:, 1], np.nan)
    shift_sigma[kept] = np.sqrt(across[sure])
    least_mm = np.where(bent & inward, 0.5 * p.states.changed_mm, q.least_mm)  # of a bore's diameter
    elsewhere |= log_odds >= p.moved.clear_log_odds
    moved = certain & elsewhere & (sought != 0) & (np.abs(mm) > np.maximum(q.sure_sigma * sigma, least_mm))
    moved[there] &= found
    return SceneSurfaces(moved, log_odds, mm, sigma, shift, shift_sigma, inward, middle, normal, weight, opposed)


def find_shaded(edges: EdgePredictions, mm: Floats) -> Floats:
    """Share (s,) of the px on which edges of surfaces displaced outward by mm (s,) are found, where what lies between
    there and their place is darker than what lies beyond, as it is where a shadow falls beside an edge."""
    samples, beside, count = edges.samples, edges.beside, len(mm)
    sample, side = np.nonzero(np.append(mm != 0, False)[samples.surface])
    ahead = edges.moving.displace(mm, len(samples.run))[sample]
    of, at = count_from(beside.first[sample], beside.first[sample + 1] - beside.first[sample])
    near = beside.usable[at, side[of]] & (np.abs(beside.offset[at] - ahead[of]) <= SHADED_PX)
    surface, px = samples.surface[sample, side][of[near]], beside.weight[sample[of[near]]]
    shaded = np.bincount(surface, px * edges.shaded[at[near]], count)
    return np.asarray(shaded / np.maximum(np.bincount(surface, px, count), 1e-9))


def _bend(samples: Samples, count: int) -> tuple[Bools, Floats, Floats]:
    """Whether each surface's normals point to the middle of its edges, that middle (s, 3), and their mean (s, 3)."""
    sample, side = np.nonzero(samples.surface >= 0)
    surface, normal = samples.surface[sample, side], samples.normal[sample, side]
    number = np.maximum(np.bincount(surface, minlength=count), 1)[:, None]
    middle = np.stack([np.bincount(surface, c, count) for c in samples.point[sample].T], axis=1) / number
    mean = np.stack([np.bincount(surface, c, count) for c in normal.T], axis=1) / number
    out = np.einsum("ni,ni->n", normal, samples.point[sample] - middle[surface])
    return np.bincount(surface, out, count) < 0, middle, mean


LEAST_FACES = 6  # whose fit says something of the object
MOST_SIGMAS = 6.0  # as which a face counts at most, however far it lies off; one that lies farther off holds no pose
TOGETHER_SIGMAS = 3.0  # by which the shifts of bores and bosses differ at most that are one change


def measure_misfit(surfaces: SceneSurfaces, holding: Bools) -> tuple[float, int] | None:
    """By how many standard deviations (rms) faces that hold the pose and have not moved lie off, or aside, but the one
    farthest off and what is shifted with it, a change perhaps; and that one.  None where they are few; holding (s,)."""
    flat = np.flatnonzero(holding & np.isfinite(surfaces.mm) & ~surfaces.moved)
    bent = flat[np.isfinite(surfaces.shift_sigma[flat])]
    shift, sigma = surfaces.shift[bent], surfaces.shift_sigma[bent]
    off = np.append(np.abs(surfaces.mm / surfaces.sigma)[flat], np.linalg.norm(shift, axis=1) / sigma)
    if len(off) < LEAST_FACES:
        return None
    most = int(np.argmax(off))
    rest, aside = np.arange(len(off)) != most, most - len(flat)
    if aside >= 0:
        apart = np.linalg.norm(shift - shift[aside], axis=1)
        rest[len(flat) :] &= apart > TOGETHER_SIGMAS * np.hypot(sigma, sigma[aside])
    return float(np.sqrt((np.minimum(off[rest], MOST_SIGMAS) ** 2).mean())), int(np.append(flat, bent)[most])


ALONG = 0.7  # cosine of the angle up to which faces look alike: they say where the object lies along one direction


def find_rival_face(surfaces: SceneSurfaces, holding: Bools, least_mm: float) -> int | None:
    """The face that lies farthest from its place, by more than `least_mm`, where no more faces hold the pose along its
    normal than have moved so far: which of them are where the model has them is then not known.  None where there is
    none; holding (s,): faces of the parts that hold the pose, but those that surely lie off."""
    away = holding & surfaces.moved & (np.abs(surfaces.mm) > least_mm)
    there = holding & (np.abs(surfaces.mm) <= MOST_SIGMAS * surfaces.sigma) & ~away
    alike = np.abs(surfaces.normal @ surfaces.normal[away].T) > ALONG
    off = (alike & away[:, None]).sum(axis=0)  # none of one that bends around: it has no normal
    rival = np.flatnonzero(away)[((alike & there[:, None]).sum(axis=0) <= off) & (off > 0)]
    return int(rival[np.argmax(np.abs(surfaces.mm[rival]))]) if len(rival) else None
