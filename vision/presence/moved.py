"""Surfaces whose edges are found beside their place: by how much each has moved along its own normals.

A surface that moves outward by d carries its edges along on the surfaces that it meets: a wall is thicker, a bore is
wider, a floor lies deeper.  So every edge element beside an edge says by how much one of its two surfaces would have to
move; the displacement on which the edges of a surface agree in all cameras is weighed against what chance agrees on.
Elements that belong to predicted edges of other surfaces say nothing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from relmodel.arrays import Bools, Floats, Ints
from vision.presence.parameters import MovedParameters, RunParameters
from vision.presence.runs import compute_log_odds
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
    """Surfaces sought beside their place, as columns: surface; mm: the displacement outward on which their edges agree
    best; log_odds: of there against chance, by camera (m, c); found: share of the edges found there, by camera (m, c);
    weight_px: of the edges that tell, by camera (m, c); rival: log odds of the best other displacement."""

    surface: Ints
    mm: Floats
    log_odds: Floats
    found: Floats
    weight_px: Floats
    rival: Floats


def collect_pulls(samples: Samples, beside: Beside, support: Support, blends: Bools, p: MovedParameters) -> Pulls:
    """All displacements within reach that elements speak for which no edges of other surfaces take.

    blends: which elements lie on a predicted blend: its shine is no edge that has moved.
    """
    pieces = []
    free = (np.abs(beside.offset) <= p.own_px) | ~blends[beside.element]
    for side in (0, 1):
        surface = samples.surface[beside.sample, side]
        rate = samples.px_per_mm[beside.sample, side]
        told = (surface >= 0) & (np.abs(rate) >= p.min_px_per_mm) & (support.weight[beside.sample] > 0)
        owner = support.owner
        own = (owner < 0) | (samples.surface[owner] == surface[:, None]).any(axis=1)
        row = np.flatnonzero(told & own & free)
        mm = beside.offset[row] / rate[row]
        near = np.abs(mm) <= p.reach_mm
        row, mm = row[near], mm[near]
        pieces.append((row, beside.sample[row], np.full(len(row), side), surface[row], mm))
    return Pulls(*(np.concatenate(column) for column in zip(*pieces, strict=True)))


def seek_moved(
    samples: Samples,
    support: Support,
    pulls: Pulls,
    sought: Ints,
    cameras: int,
    p: MovedParameters,
    runs: RunParameters,
    reach_px: float,
) -> Moved:
    """Where the edges of the surfaces `sought` (m,), ascending, agree best, clear of their own place."""
    grid = np.arange(-p.reach_mm, p.reach_mm + 0.5 * p.step_mm, p.step_mm)
    cells, count = len(grid), len(sought)
    shape = (count, cameras, cells)
    # What could be seen at each displacement: edges that stay within reach of the search.
    which = np.searchsorted(sought, samples.surface)
    wanted = (np.append(sought, -2)[np.minimum(which, count)] == samples.surface) & (support.weight[:, None] > 0)
    wanted &= np.abs(samples.px_per_mm) >= p.min_px_per_mm
    sample, side = np.nonzero(wanted)
    reached = np.abs(grid)[None] * np.abs(samples.px_per_mm[sample, side])[:, None] <= reach_px - p.tolerance_px
    at = (which[sample, side] * cameras + samples.camera[sample])[:, None] * cells + np.arange(cells)
    weight = np.broadcast_to(support.weight[sample][:, None], reached.shape)
    seen = np.bincount(at[reached], weight[reached], count * cameras * cells).reshape(shape).astype(float)

    index = np.minimum(np.searchsorted(sought, pulls.surface), max(count - 1, 0))
    rows = np.flatnonzero(sought[index] == pulls.surface) if count else np.zeros(0, np.int64)
    half = p.tolerance_px / np.abs(samples.px_per_mm[pulls.sample[rows], pulls.side[rows]])
    low = np.ceil((pulls.mm[rows] - half - grid[0]) / p.step_mm).clip(0, cells).astype(np.int64)
    high = np.floor((pulls.mm[rows] + half - grid[0]) / p.step_mm).clip(-1, cells - 1).astype(np.int64)
    length = np.maximum(high - low + 1, 0)
    row = np.repeat(rows, length)
    cell = np.arange(len(row)) - np.repeat(np.cumsum(length) - length, length) + np.repeat(low, length)
    # Each sample counts once at a displacement, however many elements speak for it.
    key = np.unique((pulls.sample[row] * 2 + pulls.side[row]) * cells + cell)
    sample, side, cell = key // (2 * cells), key // cells % 2, key % cells
    at = (which[sample, side] * cameras + samples.camera[sample]) * cells + cell
    found = np.bincount(at, support.weight[sample], count * cameras * cells).reshape(shape)
    share = np.minimum(found / np.maximum(seen, 1e-9), 1.0)

    chance = np.clip(np.median(share, axis=2, keepdims=True), runs.least_chance, runs.most_chance)
    n = seen / runs.stretch_px
    odds = compute_log_odds(share, n, np.broadcast_to(chance, shape), np.full(shape, p.shows), runs)
    odds = np.where(seen > 0, odds, 0.0)
    total = odds.sum(axis=1) - np.abs(grid) / p.usual_mm
    told = np.broadcast_to(support.weight[:, None], wanted.shape)[wanted]
    moves = np.bincount(which[wanted], told * np.abs(samples.px_per_mm)[wanted], count)
    rate = moves / np.maximum(np.bincount(which[wanted], told, count), 1e-9)
    clear = np.abs(grid)[None] >= np.maximum(p.least_mm, p.least_px / np.maximum(rate[:, None], 1e-9))
    away = np.where(clear, total, -np.inf)
    best = np.argmax(away, axis=1) if count else np.zeros(0, np.int64)
    every = np.arange(count)
    # Neighbours within the tolerance may be as good: the middle of all that are nearly so.
    level = (away >= away[every, best][:, None] - p.plateau) & (
        np.abs(grid[None] - grid[best][:, None]) <= p.distinct_mm
    )
    best = np.rint((level * np.arange(cells)).sum(axis=1) / np.maximum(level.sum(axis=1), 1)).astype(np.int64)
    apart = np.abs(grid[None] - grid[best][:, None]) > p.distinct_mm
    rival = np.where(clear & apart, total, -np.inf).max(axis=1) if count else np.zeros(0)
    return Moved(sought, grid[best], odds[every, :, best], share[every, :, best], seen[every, :, best], rival)
