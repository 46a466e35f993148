"""Displacements and diameters from simulated edges, against what they were simulated with."""

from __future__ import annotations

import numpy as np
import pytest

from tests.vision.account.test_elements_beside import edge_points, samples_at
from vision.account.runs import EdgeRuns
from vision.account.samples import Samples, find_nearby, measure_support
from vision.localisation.measurements import EdgeIndex
from vision.presence.presence_parameters import PresenceParameters
from vision.presence.surfaces import (
    BodyElements,
    EdgePredictions,
    FacePairs,
    find_moving_surfaces,
    find_shaded,
    find_usable,
    seek_moved,
)

P = PresenceParameters()
NONE = np.zeros(0, np.int64)
ALONE = FacePairs(NONE, NONE, NONE, np.zeros(0), NONE, np.zeros(0))


def look(samples: Samples, index: EdgeIndex) -> EdgePredictions:
    """What elements show along samples, of edges that mostly show where chance finds little."""
    nearby = find_nearby(samples.camera, samples.pixel, samples.direction, [index], np.zeros(1), P.account.samples)
    support = measure_support(samples, nearby, P.account.support)
    count = samples.run_count
    head = np.unique(samples.run, return_index=True)[1]
    weight = np.bincount(samples.run, support.weight, count).astype(float)
    zero, whole = np.zeros(count), np.zeros(count, np.int64)
    runs = EdgeRuns(
        whole, whole, whole, samples.arc[head], samples.surface[head], weight, weight, zero, zero + 0.05, zero + 0.8,
        zero, zero, np.zeros((count, 1)),
    )  # fmt: skip
    none = np.zeros(0, np.int64)
    moving = find_moving_surfaces(samples, (none, none, np.zeros((0, 3))))
    usable = find_usable(samples, nearby, support.owner)
    beside = BodyElements(nearby.first, nearby.offset, usable, support.weight)
    return EdgePredictions(samples, moving, beside, runs, nearby.contrast * nearby.offset > 0)


@pytest.mark.parametrize(
    ("out", "bright", "dark"), [(4, 1, 1.0), (4, -1, 0.0), (-4, 1, 0.0), (-4, -1, 1.0), (4, 0, 0.5)]
)
def test_what_lies_between_is_dark_where_the_edge_is_bright_beyond(out: int, bright: int, dark: float) -> None:
    """An edge 4 px from its place, bright above, below, or either on half of it; elements elsewhere do not count."""
    line = np.arange(30.0, 170.0)
    pixel, along = np.stack([line, 0 * line + 100], axis=1), np.tile([1.0, 0.0], (len(line), 1))
    samples = samples_at(pixel, along, np.tile([0, 1], (len(line), 1)), np.zeros(len(line), np.int64))
    samples.px_per_mm[:] = [2.0, 1.0]
    up = np.where(bright == 0, np.sign(line - 99.5), bright)[:, None] * [0.0, 1.0]
    there, elsewhere = pixel + np.array([0, out]), pixel - np.array([0, 9])
    index = EdgeIndex(edge_points(np.concatenate([there, elsewhere]), np.concatenate([up, -up])))
    assert find_shaded(look(samples, index), np.array([out / 2, 0.0])).tolist() == [dark, 0.0]


@pytest.mark.parametrize("deeper", [0.0, -3.0, 4.5])
def test_a_floor_moves_and_not_the_walls_that_it_meets(deeper: float) -> None:
    """A floor, 0, between four walls, 1 to 4, seen obliquely: each wall has an edge on the floor and one on the top, 5.
    A floor that moves takes its edges along by .5 px a mm; each of them alone would as well be a wall that has moved
    by half as much, but the walls' upper edges stay."""
    line, rows = np.arange(30.0, 171.0), []
    for wall, y in enumerate((30.0, 70.0, 110.0, 150.0), start=1):
        for floor, place in ((0, y), (5, y + 20)):
            rows.append((np.stack([line, np.full_like(line, place)], axis=1), floor, wall))
    pixel = np.concatenate([row[0] for row in rows])
    count, run = len(line), np.repeat(np.arange(8), len(line))
    surface = np.repeat([row[1:] for row in rows], count, axis=0)
    direction = np.tile([1.0, 0.0], (len(pixel), 1))
    samples = samples_at(pixel, direction, surface, run)
    samples.px_per_mm[:] = [0.5, 1.0]
    offset = np.where(surface[:, 0] == 0, 0.5 * deeper, 0.0)[:, None] * [0.0, 1.0]
    rng = np.random.default_rng(2)
    there = pixel + offset + rng.normal(size=(len(pixel), 1)) * [0.0, 0.1]
    index = EdgeIndex(edge_points(there, np.tile([0.0, 1.0], (len(pixel), 1))))
    moved, _ = seek_moved(look(samples, index), 6, 1, ALONE, P)
    assert moved == pytest.approx([deeper, 0, 0, 0, 0, 0], abs=2 * P.moved.step_mm)
