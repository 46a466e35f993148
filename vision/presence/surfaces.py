"""The evidence gathered by surface: whether its edges are in place or displaced, and by how much."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from relmodel.arrays import Bools, Floats
from vision.presence.displaced_surfaces import Edges, measure_moved, seek_moved
from vision.presence.items import Items
from vision.presence.opposed import Opposed, find_opposed
from vision.presence.presence_parameters import PresenceParameters
from vision.presence.samples import Samples
from vision.presence.stretches import Runs, sum_in_one_light
from vision.scene.stored_scene import StoredScene


@dataclass(frozen=True)
class Surfaces:
    """The scene's surfaces (s,) as their edges show them.

    moved: whether the edges are found displaced and not in place; log_odds: of that against being in place, at
    most zero where it has not; mm: how far outward the surface lies from where the model has it, nan where it was not
    measured; sigma (mm); shift (s, 3): how far it lies from there in the plane of its normals, mm in the world, of one
    that bends around; shift_sigma (mm), nan for others; inward: whether it bends around a hollow; middle (s, 3), normal
    (s, 3): mean of its edges in the world, mm, and of its unit normals; distinct_px: of its edges that can be
    distinguished from others.  opposed: which lie opposite each other.
    """

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
    opposed: Opposed


def assess_surfaces(edges: Edges, stored: StoredScene, items: Items, cameras: int, p: PresenceParameters) -> Surfaces:
    """The scene's surfaces by their edges."""
    samples, runs = edges.samples, edges.runs
    count = len(stored.surface_no)
    inward, middle, normal = _bend(samples, count)
    opposed = find_opposed(items, stored.scene, middle, normal)
    weight, supported = (_by_surface(runs, values, count) for values in (runs.weight_px, runs.weight_px * runs.found))
    sought, log_odds = seek_moved(edges, count, cameras, opposed, p)
    # What is seen where it should be lies elsewhere only if that is seen better.
    in_place = np.maximum(_weigh_in_place(runs, count, cameras), 0.0)
    certain = log_odds - in_place >= p.moved.sure_log_odds
    there = np.flatnonzero(weight >= p.moved.least_distinct_px)
    offsets, closed = measure_moved(edges, there, sought, p)
    # Surfaces found in place, or found displaced, or bent around and found all around.
    agree_px = offsets.agree * p.runs.stretch_px
    found = agree_px >= p.moved.least_found * weight[there]
    in_place = supported[there] >= p.moved.least_found * weight[there]
    displaced = sought[there] != 0
    doubtful = displaced & ~certain[there]
    sure = (agree_px >= p.moved.least_distinct_px) & (displaced | in_place | (closed & found)) & ~doubtful
    kept = there[sure]
    mm, sigma, shift_sigma = np.full((3, count), np.nan)
    shift = np.full((count, 3), np.nan)
    mm[kept], sigma[kept] = offsets.x[sure, 3], np.sqrt(offsets.covariance[sure, 3, 3])
    shift[kept] = np.where(closed[:, None], offsets.x[:, :3], 0.0)[sure]
    # Along the axis of a bore its edges say nothing.
    across = np.sqrt(np.linalg.eigvalsh(offsets.covariance[:, :3, :3])[:, 1])
    shift_sigma[kept] = np.where(closed, across, np.nan)[sure]
    least = np.maximum(p.displacement.sure_sigma * sigma, p.displacement.least_mm)
    moved = (sought != 0) & certain & (np.abs(mm) > least)
    moved &= _count_own_px(runs, moved, log_odds) >= p.moved.least_distinct_px
    return Surfaces(moved, log_odds, mm, sigma, shift, shift_sigma, inward, middle, normal, weight, opposed)


def _weigh_in_place(runs: Runs, count: int, cameras: int) -> Floats:
    """Log odds (count,) of surfaces where the model has them against not there, by all of their edges."""
    run, side = np.nonzero(runs.surface >= 0)
    at = runs.surface[run, side] * cameras + runs.camera[run]
    by_camera = sum_in_one_light(at, runs.in_light[run], count * cameras)
    return np.asarray(by_camera.reshape(count, cameras).sum(axis=1))


def _count_own_px(runs: Runs, moved: Bools, log_odds: Floats) -> Floats:
    """Px (s,) of surfaces' edges that no neighbour explains which has moved more surely: the rim of a wider bore says
    nothing of the web around it."""
    out = np.zeros(len(moved))
    for side in (0, 1):
        own, other = runs.surface[:, side], runs.surface[:, 1 - side]
        surer = (other >= 0) & moved[other] & (log_odds[other] > log_odds[own])
        rows = (own >= 0) & ~surer
        out += np.bincount(own[rows], runs.weight_px[rows], len(moved))
    return out


def _by_surface(runs: Runs, values: Floats, count: int) -> Floats:
    """Sums of runs' values over the surfaces (s,) that each is an edge of."""
    out = np.zeros(count)
    for side in (0, 1):
        rows = runs.surface[:, side] >= 0
        out += np.bincount(runs.surface[rows, side], values[rows], count)
    return out


def _bend(samples: Samples, count: int) -> tuple[Bools, Floats, Floats]:
    """Whether each surface's normals point to the middle of its edges, that middle (s, 3), and their mean (s, 3)."""
    sample, side = np.nonzero(samples.surface >= 0)
    surface, normal = samples.surface[sample, side], samples.normal[sample, side]
    number = np.maximum(np.bincount(surface, minlength=count), 1)[:, None]
    middle = np.stack([np.bincount(surface, c, count) for c in samples.point[sample].T], axis=1) / number
    mean = np.stack([np.bincount(surface, c, count) for c in normal.T], axis=1) / number
    out = np.einsum("ni,ni->n", normal, samples.point[sample] - middle[surface])
    return np.bincount(surface, out, count) < 0, middle, mean
