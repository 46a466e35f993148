"""Displaced parts: by how much in their plane, out of it, and turned about its normal.

A part, or an assembly of parts, is moved as one piece from places around its own until its predicted edges lie on those
of the pictures.  One whose edges are hardly found in place is looked for at every turn as well.  The pose stays fixed.
A part that makes up much of the view has determined the pose and is left out.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from relmodel.arrays import Bools, Floats, Ints, rank_in_groups
from relmodel.geometry.transforms import rotation_matrix
from vision.cameras.cameras import Rig
from vision.localisation.measurements import EdgeIndex
from vision.presence.displacement import Beside, Displacement, fit
from vision.presence.items import Items
from vision.presence.measures import DISPLACED, Measures
from vision.presence.pieces import Aspects, Eyes, PieceEdges, add_turned, find_pieces, list_pieces
from vision.presence.presence_parameters import PresenceParameters, StateParameters
from vision.presence.samples import Nearby, Samples, find_nearby
from vision.presence.stretches import Runs
from vision.presence.support import Support
from vision.scene.stored_scene import StoredScene

ENOUGH = 150  # samples of a piece in a camera: more samples add no information


@dataclass(frozen=True)
class Displacements:
    """Where the edges of parts were found best, of those parts that may lie elsewhere, as columns: occurrence: the
    scene's, ascending; shift (n, 3), covariance (n, 3, 3): mm in the world, from where the model has it; turn,
    turn_sigma: rad about the normal of the part's plane; log_odds: of lying there against lying in place; far, turned:
    whether it surely lies elsewhere, or turned."""

    occurrence: Ints
    shift: Floats
    covariance: Floats
    turn: Floats
    turn_sigma: Floats
    log_odds: Floats
    far: Bools
    turned: Bools

    @property
    def shift_sigma(self) -> Floats:
        return np.asarray(np.sqrt(np.diagonal(self.covariance, axis1=1, axis2=2)))

    @property
    def distance(self) -> Floats:
        """How far parts lie from their places, mm."""
        return np.asarray(np.linalg.norm(self.shift, axis=1))

    @property
    def sigma(self) -> Floats:
        """The standard deviation of that."""
        way = self.shift / np.maximum(self.distance, 1e-9)[:, None]
        return np.asarray(np.sqrt(np.einsum("ni,nij,nj->n", way, self.covariance, way)))


def measure_displacements(
    stored: StoredScene,
    rig: Rig,
    world_from_rig: Floats,
    indexes: list[EdgeIndex],
    response_px: Floats,
    samples: Samples,
    nearby: Nearby,
    support: Support,
    runs: Runs,
    p: PresenceParameters,
) -> Displacements:
    """Places of the parts that show enough edges, and not so many that they determine the pose."""
    scene, q = stored.scene, p.parts
    poses = [world_from_rig @ rig.rig_from_camera[name] for name in rig.cameras]
    eyes = Eyes(np.stack(poses), np.stack([camera.matrix for camera in rig.cameras.values()]))
    piece_of = find_pieces(stored.paths)
    of_sample = piece_of[scene.surface_occurrence[samples.surface[:, 0]]]
    count = int(piece_of.max(initial=-1)) + 1
    shown, found = (np.bincount(of_sample, support.weight * v, count) for v in (1.0, support.found))
    inspected = np.isin(np.arange(count), piece_of[scene.inspected])
    tried = np.flatnonzero(inspected & (shown >= q.least_px) & (shown <= q.most_share * shown.sum()))
    lost = tried[((shown >= q.turned_px) & (found <= q.turned_share * shown))[tried]]
    edges, aspects = list_pieces(scene, piece_of, tried, samples, support.weight, runs, eyes)
    edges, aspects = add_turned(scene, piece_of, lost, edges, aspects, eyes, q)
    taken = np.full(sum(len(index.edges.position) for index in indexes), -1)
    owned = np.flatnonzero(support.owner >= 0)
    taken[nearby.element[owned]] = of_sample[support.owner[owned]]
    places = _seek_places(_Pictures(eyes, indexes, response_px, taken, p), edges, aspects, tried)
    return _choose(places, aspects, piece_of, tried, p)


@dataclass(frozen=True)
class _Places:
    """Where pieces may lie, as columns: aspect: of the piece; there: place; gain (k, c): log odds, by camera, of there
    against in place; log_odds: their sum, less what all the places tried cost, -inf in place."""

    aspect: Ints
    there: Displacement
    gain: Floats
    log_odds: Floats


def _seek_places(pictures: _Pictures, edges: PieceEdges, aspects: Aspects, tried: Ints) -> _Places:
    """Where least squares puts pieces from in place, and from the best of the starts around it, as the model has them
    and turned; the first aspects are those of the pieces tried, as the model has them."""
    q = pictures.p.parts
    turned = np.arange(len(aspects.piece)) >= len(tried)
    side = np.arange(-q.reach_mm, q.reach_mm + 1e-9, q.step_mm)
    places = np.pad(np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2), [(0, 0), (0, 2)])
    aspect, start = np.repeat(np.arange(len(turned)), len(places)), np.tile(places, (len(turned), 1))
    score = _Bodies(pictures, edges.thin(q.coarse), aspects, aspect).score(start)
    best = np.flatnonzero(rank_in_groups(2 * aspects.piece[aspect] + turned[aspect], score) < q.best)
    aspect = np.append(np.arange(len(tried)), aspect[best])
    bodies = _Bodies(pictures, edges.thin(ENOUGH), aspects, aspect)
    there = bodies.settle(np.append(np.zeros((len(tried), 4)), start[best], axis=0))
    in_place = np.arange(len(aspect)) < len(tried)
    odds = bodies.weigh(np.where(in_place[:, None], 0.0, there.x))
    gain = odds - odds[np.searchsorted(tried, aspects.piece[aspect])]
    cost = np.log(len(places)) + turned * (q.least_log_odds + np.log(360 / q.step_degrees))
    return _Places(aspect, there, gain, np.where(in_place, -np.inf, gain.sum(axis=1) - cost[aspect]))


def _choose(it: _Places, aspects: Aspects, piece_of: Ints, tried: Ints, p: PresenceParameters) -> Displacements:
    """The likeliest place of each piece, for all of its occurrences."""
    number = np.searchsorted(tried, aspects.piece[it.aspect])
    occurrence = np.flatnonzero(np.isin(piece_of, tried))
    first = np.flatnonzero(rank_in_groups(number, it.log_odds) == 0)
    row = first[np.argsort(number[first])][np.searchsorted(tried, piece_of[occurrence])]
    aspect, x, covariance, log_odds = it.aspect[row], it.there.x[row], it.there.covariance[row], it.log_odds[row]
    known = (log_odds >= p.parts.least_log_odds) & (it.gain[row].min(axis=1) >= 0)
    axes, turned = aspects.axes[aspect], aspect >= len(tried)
    turn = np.mod(x[:, 3] + aspects.angle[aspect] + np.pi, 2 * np.pi) - np.pi
    out = Displacements(
        occurrence, np.einsum("ni,nij->nj", x[:, :3], axes), np.swapaxes(axes, 1, 2) @ covariance[:, :3, :3] @ axes,
        turn, np.sqrt(covariance[:, 3, 3]), log_odds, known, known & turned,
    )  # fmt: skip
    least = np.maximum(p.displacement.least_mm, p.displacement.sure_sigma * out.sigma)
    return replace(out, far=known & (out.distance > least))


@dataclass(frozen=True)
class _Pictures:
    """What cameras saw: their elements, and the piece whose predicted edge takes each (e,), -1 for none."""

    eyes: Eyes
    indexes: list[EdgeIndex]
    response_px: Floats
    taken: Ints
    p: PresenceParameters


class _Bodies:
    """Bodies, each an aspect (m,) of a piece, whose edges are looked for in the pictures where the bodies are tried."""

    def __init__(self, pictures: _Pictures, edges: PieceEdges, aspects: Aspects, aspect: Ints) -> None:
        self.pictures, self.aspects, self.count = pictures, aspects.take(aspect), len(aspect)
        order = np.argsort(edges.aspect, kind="stable")
        first, last = (np.searchsorted(edges.aspect[order], aspect, side=end) for end in ("left", "right"))
        body = np.repeat(np.arange(len(aspect)), last - first)
        row = order[np.arange(len(body)) + np.repeat(last - np.cumsum(last - first), last - first)]
        by_camera = np.argsort(edges.camera[row], kind="stable")
        self.body, self.edges = body[by_camera], edges.take(row[by_camera])
        self.each = np.arange(len(body))
        self.zero, self.none = np.zeros(len(body)), np.zeros(len(body), np.int64)

    def settle(self, start: Floats) -> Displacement:
        """Where the elements put the bodies from starts (m, 4)."""

        def look(x: Floats, reach: float) -> tuple[Floats, Floats]:
            beside, slope = self._look(x, reach)
            return slope, beside.find_nearest(self.each, self.none, self.zero, reach)

        p = self.pictures.p
        sigma, counts = np.tile(p.parts.sigma, (self.count, 1)), self.edges.length / p.runs.stretch_px
        return fit(look, self.body, counts, start, sigma, p.displacement)

    def score(self, x: Floats) -> Floats:
        """How near elements lie to the edges of bodies at x (m, 4), 0 to 1 in the mean."""
        reach, length = self.pictures.p.displacement.reach_px[0], self.edges.length
        away = self._look(x, reach)[0].find_nearest(self.each, self.none, self.zero, reach)
        near = np.exp(-0.5 * (np.where(np.isfinite(away), away, np.inf) / (0.4 * reach)) ** 2)
        total = np.maximum(np.bincount(self.body, length, self.count), 1e-9)
        return np.asarray(np.bincount(self.body, length * near, self.count) / total)

    def weigh(self, x: Floats) -> Floats:
        """Log odds (m, c), by camera, of bodies being at x (m, 4) against not there."""
        p, cameras, edges = self.pictures.p, len(self.pictures.indexes), self.edges
        beside, _ = self._look(x, 2 * max(p.displacement.hidden_px, *p.displacement.tolerance_px))
        key = self.body * (edges.edge.max(initial=0) + 1) + edges.edge
        _, first, edge = np.unique(key, return_index=True, return_inverse=True)
        odds, _ = beside.weigh(
            (self.each, self.none, edge.ravel()), self.zero, self.zero, edges.chance[first], edges.shows[first],
            np.zeros(1), np.inf, p,
        )  # fmt: skip
        at = self.body[first] * cameras + edges.camera[first]
        return np.bincount(at, odds[:, 0], self.count * cameras).reshape(self.count, cameras).astype(float)

    def _look(self, x: Floats, reach_px: float) -> tuple[Beside, Floats]:
        """The elements beside the edges of bodies at x (m, 4), and how far the edges move by it (n, 4), px a unit."""
        it, aspects, edges, body = self.pictures, self.aspects, self.edges, self.body
        turn = rotation_matrix(x[:, 3:] * aspects.axes[:, 2])
        arm = np.einsum("nij,nj->ni", turn[body], edges.point - aspects.centre[body])
        point = (aspects.centre + np.einsum("mi,mij->mj", x[:, :3], aspects.axes))[body] + arm
        ways = np.concatenate([aspects.axes[body], np.cross(aspects.axes[body, 2], arm)[:, None]], axis=1)
        pixel, flow = it.eyes.project(edges.camera, point, ways)
        across = np.stack([-edges.direction[:, 1], edges.direction[:, 0]], axis=1)
        samples = replace(it.p.samples, reach_px=reach_px)
        near = find_nearby(edges.camera, pixel, edges.direction, it.indexes, it.response_px, samples)
        taken = it.taken[near.element]
        free = (taken < 0) | (taken == aspects.piece[body[near.sample]])
        beside = Beside(near.first, near.offset, np.repeat(free[:, None], 2, axis=1), edges.length)
        return beside, np.einsum("nki,ni->nk", flow, across)


def report_displacements(items: Items, displacements: Displacements, p: StateParameters) -> Measures:
    """Sizes of the parts that lie elsewhere: how far, that along the world's axes, and how they are turned."""
    it, part = displacements, np.array([level == "part" for level in items.level])
    rows = np.flatnonzero(part & np.isin(items.occurrence, it.occurrence[it.far | it.turned]))
    at = np.searchsorted(it.occurrence, items.occurrence[rows])
    value = np.stack([it.distance, *it.shift.T, np.degrees(it.turn)])[:, at]
    sigma = np.stack([it.sigma, *it.shift_sigma.T, np.degrees(it.turn_sigma)])[:, at]
    changed = np.stack([it.far, it.far, it.far, it.far, it.turned])[:, at]
    changed[1:4] &= np.abs(value[1:4]) > np.maximum(p.changed_mm, p.changed_sigma * sigma[1:4])
    return Measures(
        item=np.tile(rows, len(DISPLACED)),
        what=np.repeat(DISPLACED, len(rows)).tolist(),
        nominal=np.zeros(value.size),
        value=value.ravel(),
        sigma=sigma.ravel(),
        changed=changed.ravel(),
    )
