"""Holes of a drawn plate before a dark ground, one of them stopped by a grey plug."""

from __future__ import annotations

import numpy as np
import pytest

from relmodel.arrays import Floats
from tests.vision.presence.test_elements_beside import samples_at
from vision.cameras.cameras import Camera
from vision.extraction.extract import extract
from vision.extraction.primitives import Primitives
from vision.extraction.rows import make_primitives
from vision.localisation.coverage import RayGrid, SurfaceMap
from vision.presence.items import Items
from vision.presence.openings import Openings, look_through
from vision.presence.presence_parameters import OpeningParameters
from vision.presence.samples import Samples

STEP, SIZE = 3, (400, 300)
CAMERA = Camera(*SIZE, np.array([[500.0, 0, 199.5], [0, 500.0, 149.5], [0, 0, 1.0]]))
HOLES = np.array([[90.0, 90], [170, 90], [250, 90], [330, 90], [90, 200], [170, 200], [250, 200], [330, 200]])
RADIUS = 16.0


def draw(greys: Floats, seed: int) -> Primitives:
    """The plate, lighter than its ground, and what is seen through its holes: blurred by half a pixel, with noise."""
    import cv2

    y, x = np.mgrid[0:1200, 0:1600] / 4 - 0.375
    grey = np.where((x > 30) & (y > 30), 150.0, 40.0)
    for (centre_x, centre_y), value in zip(HOLES, greys, strict=True):
        grey[np.hypot(x - centre_x, y - centre_y) < RADIUS] = value
    small = cv2.GaussianBlur(cv2.resize(grey, SIZE, interpolation=cv2.INTER_AREA), (0, 0), 0.6)
    return make_primitives(extract(np.asarray(small + np.random.default_rng(seed).normal(size=small.shape) * 2.0)))


def surface_map() -> SurfaceMap:
    """The plate is surface 0."""
    x, y = np.meshgrid(np.arange(1.0, SIZE[0], STEP), np.arange(1.0, SIZE[1], STEP))
    pixel = np.stack([x, y], axis=-1)
    through = (np.linalg.norm(pixel[:, :, None] - HOLES, axis=-1) < RADIUS).any(axis=2)
    shown = np.where((x > 30) & (y > 30) & ~through, 0, -1)
    matrix = np.array([[500.0 / STEP, 0, 198.5 / STEP], [0, 500.0 / STEP, 148.5 / STEP], [0, 0, 1]])
    weight = np.full(x.shape, float(STEP**2))
    return SurfaceMap(CAMERA, RayGrid(np.zeros((*x.shape, 3)), pixel, weight, matrix, STEP), shown)


def rims(cameras: int) -> Samples:
    """The rim of hole k is an edge of the plate and of its bore, surface k + 1; of each camera in turn."""
    angle = 2 * np.pi * np.arange(120) / 120
    outward = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    pixel = (HOLES[:, None] + RADIUS * outward).reshape(-1, 2)
    hole = np.repeat(np.arange(len(HOLES)), len(angle))
    direction = np.tile(np.stack([-outward[:, 1], outward[:, 0]], axis=1), (len(HOLES), 1))
    one = samples_at(pixel, direction, np.stack([0 * hole, hole + 1], axis=1), hole)
    both = one.take(np.tile(np.arange(len(pixel)), cameras))
    both.camera[:] = np.repeat(np.arange(cameras), len(pixel))
    return both


def look(*pictures: Primitives) -> Openings:
    count = len(HOLES)
    none, number = np.full(count, -1), np.arange(count)
    items = Items(
        ["feature"] * count, np.zeros(count, np.int64), number, none, [f"hole {k}" for k in range(count)],
        ["through_hole"] * count, np.ones(count), np.full(count, np.nan), number, number + 1,
        np.ones(count + 1, bool),
    )  # fmt: skip
    return look_through(items, rims(len(pictures)), pictures, [surface_map()] * len(pictures), OpeningParameters())


@pytest.mark.parametrize("plug", [None, 2, 5])
def test_the_hole_that_a_plug_stops_is_told(plug: int | None) -> None:
    """What lies behind is lit unevenly, from 30 on the left to 54 on the right."""
    greys = 30 + 0.1 * (HOLES[:, 0] - 90)
    if plug is not None:
        greys[plug] = 95.0
    found = look(draw(greys, 1), draw(greys, 2))
    assert found.item.tolist() == np.repeat(np.arange(len(HOLES)), 2).tolist()
    assert found.camera.tolist() == [0, 1] * len(HOLES)
    np.testing.assert_allclose(found.grey, np.repeat(greys, 2), atol=4.0)  # the rim is blurred
    np.testing.assert_allclose(found.pixels, np.pi * RADIUS**2, rtol=0.2)
    assert set(found.item[found.stopped].tolist()) == ({plug} if plug is not None else set())


def test_a_plug_that_one_camera_sees_as_dark_as_the_ground_is_left_undecided() -> None:
    greys = np.full(len(HOLES), 40.0)
    bright = greys.copy()
    bright[3] = 95.0
    assert not look(draw(bright, 1), draw(greys, 2)).stopped.any()


def test_where_hardly_anything_else_shows_what_lies_behind_nothing_is_said() -> None:
    """All other holes are of the plate's brightness: there is but the ground beside it."""
    greys = np.full(len(HOLES), 150.0)
    greys[1] = 95.0
    assert not look(draw(greys, 1)).stopped.any()
