"""Displaced parts: by how much in their plane, out of it, and turned about its normal.

A part, or an assembly of parts, is moved as one piece until its predicted edges lie on those of the pictures: least
squares with a robust loss over all cameras, from its place and from places around it.  The pose stays fixed.  A part
that makes up much of the view has determined the pose and is left out.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from relmodel.arrays import Bools, Floats, Ints
from vision.cameras.cameras import Rig
from vision.localisation.measurements import EdgeIndex
from vision.presence.items import Items
from vision.presence.measures import DISPLACED, Measures
from vision.presence.pieces import (
    PieceView,
    find_axes,
    find_pieces,
    fit,
    list_cameras,
    list_views,
    look,
    measure_distance,
)
from vision.presence.presence_parameters import DisplacedParameters, StateParameters
from vision.presence.samples import Nearby, Samples
from vision.presence.support import Support
from vision.presence.turned import Turn, seek_turn
from vision.scene.stored_scene import StoredScene


@dataclass(frozen=True)
class Displacements:
    """Where the edges of parts were found best, of those parts that may lie elsewhere, as columns: occurrence: the
    scene's; shift (n, 3), shift_sigma (n, 3): mm in the world, from where the model has it, and standard deviations;
    distance, sigma: mm, how far that is, and its standard deviation; turn, turn_sigma: rad about the normal of the
    part's plane; log_odds: of lying there against lying in place; far, turned: whether it surely lies elsewhere, or
    turned."""

    occurrence: Ints
    shift: Floats
    shift_sigma: Floats
    distance: Floats
    sigma: Floats
    turn: Floats
    turn_sigma: Floats
    log_odds: Floats
    far: Bools
    turned: Bools


def measure_displacements(
    stored: StoredScene,
    rig: Rig,
    world_from_rig: Floats,
    indexes: list[EdgeIndex],
    samples: Samples,
    nearby: Nearby,
    support: Support,
    p: DisplacedParameters,
) -> Displacements:
    """Places of the parts that show enough edges, and not so many that they determine the pose."""
    scene = stored.scene
    piece_of = find_pieces(stored.paths)
    count = int(piece_of.max(initial=-1)) + 1
    of_sample = piece_of[scene.surface_occurrence[samples.surface[:, 0]]]
    shown = np.bincount(of_sample, support.weight, count)
    inspected = np.isin(np.arange(count), piece_of[scene.inspected])
    tried = np.flatnonzero(inspected & (shown >= p.least_px) & (shown <= p.most_share * shown.sum()))
    owner = _own_elements(nearby, support, of_sample, sum(len(index.edges.position) for index in indexes))
    cameras = list_cameras(rig, world_from_rig, indexes)
    found: list[tuple[int, _Place]] = []
    for piece in tried.tolist():
        rows = np.flatnonzero((of_sample == piece) & (support.weight > 0))
        free = (owner < 0) | (owner == piece)
        views = list_views(samples.take(rows), support.weight[rows], cameras, free)
        chance = float(np.average(support.chance[rows], weights=support.weight[rows]))
        members = np.flatnonzero(piece_of == piece)
        centre = np.average(samples.point[rows], axis=0, weights=support.weight[rows])
        axes = find_axes(scene, members, np.mean([camera.pose[:3, 3] for camera in cameras], axis=0) - centre)
        in_place = _weigh(views, centre, axes, np.zeros((1, 4)), chance, p)[0]
        if in_place.found + p.least_gain > 1:
            continue  # nowhere else is so much more found that it surely lies there
        place = _locate(views, centre, axes, chance, in_place, p)
        lost = not place.far and in_place.found < p.turned.most_in_place
        if lost and shown[piece] >= p.turned.least_px:
            turn = seek_turn(scene, members, axes, cameras, free, p.turned)
            place = place if turn is None else _locate_turned(turn, place, chance, in_place, p)
        found += [(occurrence, place) for occurrence in members.tolist()]
    return _gather(found)


def _own_elements(nearby: Nearby, support: Support, of_sample: Ints, count: int) -> Ints:
    """The piece (e,) whose predicted edge takes each element, -1 for none."""
    taken = np.full(count, -1)
    rows = np.flatnonzero(support.owner >= 0)
    taken[nearby.element[rows]] = of_sample[support.owner[rows]]
    return taken


@dataclass(frozen=True)
class _Place:
    """Where a piece lies: axes (3, 3) as rows; x (4,): mm along them, then rad about the last; covariance (4, 4);
    log_odds: of there against in place; far, turned: whether it surely lies elsewhere, or turned."""

    axes: Floats
    x: Floats
    covariance: Floats
    log_odds: float
    far: bool
    turned: bool = False


class _Weighed(NamedTuple):
    """Of a piece at a place: log odds of its edges against chance, and the share of them found there."""

    odds: float
    found: float


def _locate(
    views: list[PieceView], centre: Floats, axes: Floats, chance: float, in_place: _Weighed, p: DisplacedParameters
) -> _Place:
    """The place near the model's where most edges of a piece are found."""

    around = p.start_mm * np.stack(np.meshgrid([0.0, 1, -1], [0.0, 1, -1]), axis=-1).reshape(-1, 2)
    tried, covariances = fit(views, centre, axes, np.pad(around, [(0, 0), (0, 2)]), p.seated_mm, p)
    weighed = _weigh(views, centre, axes, tried, chance, p)
    best = int(np.argmax([there.odds for there in weighed]))
    x, covariance, there = tried[best], covariances[best], weighed[best]
    risen, loose = fit(views, centre, axes, x[None], p.rise_mm, p)
    (above,) = _weigh(views, centre, axes, risen, chance, p)
    if above.odds > there.odds + p.least_log_odds:
        x, covariance, there = risen[0], loose[0], above
    odds, found = there
    log_odds = odds - in_place.odds - float(np.log(len(around)))
    distance, sigma = measure_distance(x, covariance)
    far = (
        log_odds >= p.least_log_odds
        and found >= max(p.least_found, in_place.found + p.least_gain)
        and distance > max(p.least_mm, p.least_sigma * sigma)
    )
    return _Place(axes, x, covariance, log_odds, far)


def _locate_turned(turn: Turn, place: _Place, chance: float, in_place: _Weighed, p: DisplacedParameters) -> _Place:
    """The place of a piece at a turn; unchanged where its edges are not found there."""
    start = np.array([*turn.aside, 0.0, 0.0])
    (x,), (covariance,) = fit(turn.views, turn.centre, place.axes, start[None], p.seated_mm, p)
    ((odds, found),) = _weigh(turn.views, turn.centre, place.axes, x[None], chance, p)
    log_odds = odds - in_place.odds - float(np.log(turn.tried))
    if log_odds < p.least_log_odds or found < p.turned.least_found:
        return place
    covariance = covariance + np.diag([p.turned.sigma_mm, p.turned.sigma_mm, 0.0, p.turned.sigma]) ** 2
    distance, sigma = measure_distance(x, covariance)
    far = distance > max(p.least_mm, p.least_sigma * sigma)
    x = x + np.array([0.0, 0.0, 0.0, turn.angle])
    return _Place(place.axes, x, covariance, log_odds, far, turned=True)


def _weigh(
    views: list[PieceView], centre: Floats, axes: Floats, x: Floats, chance: float, p: DisplacedParameters
) -> list[_Weighed]:
    """A piece displaced by each x (m, 4)."""
    # How much denser elements lie on an edge that shows than by chance, which is counted in windows of four px.
    dense = p.shows / (np.sqrt(2 * np.pi) * p.sigma_px) / (max(chance, p.least_chance) / 4)
    odds, found, total = np.zeros(len(x)), np.zeros(len(x)), 0.0
    for view in views:
        residual = np.abs(look(view, centre, axes, x, p.reach_px[0])[1])
        near = np.exp(-0.5 * (np.where(np.isfinite(residual), residual, np.inf) / p.sigma_px) ** 2)
        odds += np.log1p(dense * near) @ view.length / p.stretch_px
        found += (residual <= p.found_px) @ view.length
        total += float(view.length.sum())
    return [_Weighed(*both) for both in zip(odds.tolist(), (found / max(total, 1e-9)).tolist(), strict=True)]


def _gather(found: list[tuple[int, _Place]]) -> Displacements:
    places = [place for _, place in found]
    distance = np.array([measure_distance(p.x, p.covariance) for p in places]).reshape(-1, 2)
    return Displacements(
        occurrence=np.array([occurrence for occurrence, _ in found], np.int64),
        shift=np.array([p.x[:3] @ p.axes for p in places]).reshape(-1, 3),
        shift_sigma=np.array([np.sqrt(np.diag(p.axes.T @ p.covariance[:3, :3] @ p.axes)) for p in places]).reshape(
            -1, 3
        ),
        distance=distance[:, 0],
        sigma=distance[:, 1],
        turn=np.array([p.x[3] for p in places]),
        turn_sigma=np.array([p.covariance[3, 3] ** 0.5 for p in places]),
        log_odds=np.array([p.log_odds for p in places]),
        far=np.array([p.far for p in places], bool),
        turned=np.array([p.turned for p in places], bool),
    )


def report_displacements(items: Items, displacements: Displacements, p: StateParameters) -> Measures:
    """Sizes of the parts that lie elsewhere: how far, that along the world's axes, and how they are turned."""
    part = np.array([level == "part" for level in items.level])
    rows = np.flatnonzero(
        part & np.isin(items.occurrence, displacements.occurrence[displacements.far | displacements.turned])
    )
    order = np.argsort(displacements.occurrence)
    at = order[np.searchsorted(displacements.occurrence, items.occurrence[rows], sorter=order)]
    it = displacements
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
