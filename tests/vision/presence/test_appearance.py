"""Holes of a drawn plate before a dark ground: some are not there, one is stopped by a grey plug; bosses in glare."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from relmodel.arrays import Floats
from tests.vision.presence.test_elements_beside import samples_at
from vision.cameras.cameras import Camera
from vision.localisation.visibility import RayGrid, SurfaceMap
from vision.presence.items import Appearance, Items, look_at_features
from vision.presence.presence_parameters import AppearanceParameters
from vision.presence.samples import Samples

STEP, SIZE = 3, (400, 300)
CAMERA = Camera(*SIZE, np.array([[500.0, 0, 199.5], [0, 500.0, 149.5], [0, 0, 1.0]]))
HOLES = np.array([[90.0, 90], [170, 90], [250, 90], [330, 90], [90, 200], [170, 200], [250, 200], [330, 200]])
RADIUS = 16.0


def draw(greys: Floats, seed: int, plate: float = 150.0) -> Floats:
    """The plate, lighter than its ground, and what is seen through its holes: blurred by half a pixel, with noise."""
    import cv2

    y, x = np.mgrid[0:1200, 0:1600] / 4 - 0.375
    grey = np.where((x > 30) & (y > 30), plate, 40.0)
    for (centre_x, centre_y), value in zip(HOLES, greys, strict=True):
        grey[np.hypot(x - centre_x, y - centre_y) < RADIUS] = value
    small = cv2.GaussianBlur(cv2.resize(grey, SIZE, interpolation=cv2.INTER_AREA), (0, 0), 0.6)
    noise = np.random.default_rng(seed).normal(size=small.shape) * 2.0
    return np.asarray(np.clip(small + noise, 0, 255))


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


def look(*pictures: Floats) -> Appearance:
    count = len(HOLES)
    none, number = np.full(count, -1), np.arange(count)
    items = Items(
        ["feature"] * count, np.zeros(count, np.int64), number, none, [f"hole {k}" for k in range(count)],
        ["through_hole"] * count, np.ones(count), np.full(count, np.nan), number, number + 1,
        np.ones(count + 1, bool),
    )  # fmt: skip
    normal = np.tile([1.0, 0, 0], (count + 1, 1))
    normal[0] = [0, 0, 1]
    views = [surface_map()] * len(pictures)
    return look_at_features(items, rims(len(pictures)), normal, pictures, views, AppearanceParameters())


# What lies behind is lit unevenly, from 30 on the left to 54 on the right.
BEHIND = 30 + 0.1 * (HOLES[:, 0] - 90)


@pytest.mark.parametrize("plug", [None, 2, 5])
def test_the_hole_that_a_plug_stops_is_told(plug: int | None) -> None:
    greys = BEHIND.copy()
    if plug is not None:
        greys[plug] = 95.0
    found = look(draw(greys, 1), draw(greys, 2))
    assert found.item.tolist() == np.repeat(np.arange(len(HOLES)), 2).tolist()
    assert found.camera.tolist() == [0, 1] * len(HOLES)
    np.testing.assert_allclose(found.grey, np.repeat(greys, 2), atol=4.0)  # the rim is blurred
    np.testing.assert_allclose(found.around, 150.0, atol=4.0)
    np.testing.assert_allclose(found.pixels, np.pi * RADIUS**2, rtol=0.5)  # the rim is left out
    assert set(found.item[found.stopped].tolist()) == ({plug} if plug is not None else set())


@pytest.mark.parametrize("plate", [150.0, 255.0])
def test_holes_that_are_not_there_look_as_the_plate_around(plate: float) -> None:
    """In glare too, where the plate is as bright as can be."""
    greys = BEHIND.copy()
    greys[[1, 6]] = plate
    found = look(draw(greys, 1, plate), draw(greys, 2, plate))
    gone = np.isin(found.item, [1, 6])
    assert (found.log_odds[gone] < -0.5).all()
    assert (found.log_odds[~gone] > 0.5).all()
    assert set(found.item[found.stopped].tolist()) == {1, 6}


def test_a_plug_that_one_camera_sees_as_dark_as_the_ground_is_left_undecided() -> None:
    greys = np.full(len(HOLES), 40.0)
    bright = greys.copy()
    bright[3] = 95.0
    assert not look(draw(bright, 1), draw(greys, 2)).stopped.any()


def test_where_hardly_anything_else_shows_what_lies_behind_nothing_is_said() -> None:
    """All other holes are of the plate's brightness: there is but the ground beside it."""
    greys = np.full(len(HOLES), 150.0)
    greys[1] = 95.0
    found = look(draw(greys, 1))
    assert 1 not in found.item[found.stopped]


@pytest.mark.parametrize("is_there", [True, False])
def test_a_lug_beyond_the_plate_shows_what_lies_behind_where_it_is_not(is_there: bool) -> None:
    """Features of any kind: the lug is the right end of the plate in the model, a face of its own."""
    shown = surface_map()
    with_lug = np.where((shown.rays.pixel[..., 0] > 352) & (shown.surface == 0), 1, shown.surface)
    picture = draw(BEHIND, 1)
    if not is_there:
        picture[:, 352:] = draw(np.full(len(HOLES), 40.0), 2)[:, :1]  # the ground left of the plate
    one = np.zeros(1, np.int64)
    items = Items(
        ["feature"], one, one, one - 1, ["lug"], ["lug"], np.ones(1), np.full(1, np.nan), one, one + 1,
        np.zeros(2, bool),
    )  # fmt: skip
    normal = np.tile([0.0, 0, 1], (2, 1))
    views = [replace(shown, surface=with_lug)]
    found = look_at_features(
        items, rims(1).take(np.zeros(0, np.int64)), normal, [picture], views, AppearanceParameters()
    )
    assert found.item.tolist() == [0]
    assert found.log_odds[0] > 1 if is_there else found.log_odds[0] < -0.5
