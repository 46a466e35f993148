"""Sort-Tile-Recursive packing, and the steps of the range tree."""

from __future__ import annotations

import numpy as np
import pytest

from relmodel.find.boxes import bounds_of_runs, pack, page_order


def random_boxes(n: int, seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    low = rng.uniform(-100, 100, (n, 3))
    return np.concatenate([low, low + rng.exponential(3, (n, 3))], axis=1)


def page_bounds(boxes: np.ndarray, size: int) -> np.ndarray:
    return bounds_of_runs(boxes[page_order(boxes, size)], np.arange(0, len(boxes), size))


@pytest.mark.parametrize("n", [0, 1, 8, 9, 12345])
def test_every_box_has_a_page_and_pages_are_full(n: int) -> None:
    boxes = random_boxes(n, n)
    page = pack(boxes, page_size=8)
    bounds = page_bounds(boxes, 8)
    assert np.bincount(page).tolist() == [8] * (n // 8) + [n % 8] * (n % 8 > 0)
    for number in range(min(len(bounds), 50)):
        members = boxes[page == number]
        assert np.array_equal(bounds[number, :3], members[:, :3].min(axis=0))
        assert np.array_equal(bounds[number, 3:], members[:, 3:].max(axis=0))


def test_pages_are_compact() -> None:
    """Pages of points in a cube are near cubes: their summed volume is near the cube's, their widths near equal."""
    points = np.random.default_rng(1).uniform(0, 1, (64 * 512, 3))
    bounds = page_bounds(np.hstack([points, points]), 64)
    width = (bounds[:, 3:] - bounds[:, :3]).mean(axis=0)
    assert np.allclose(width, 1 / 8, rtol=0.15)
    assert np.prod(bounds[:, 3:] - bounds[:, :3], axis=1).sum() < 1.0


@pytest.mark.parametrize("axes", [(0, 1, 2), (2, 0, 1), (1, 2, 0)])
@pytest.mark.parametrize("far", [0, 20])
def test_pages_of_a_flat_world_are_near_cubes(axes: tuple[int, ...], far: int) -> None:
    """Of a slab of the proportions of the bulkhead, whichever way it lies and whatever lies far off."""
    size = np.array([3048.0, 1016, 60])[list(axes)]
    points = np.random.default_rng(2).uniform(0, size, (20_000, 3))
    points[:far] += 1e6
    bounds = page_bounds(np.hstack([points, points]), 16)
    width = np.median(bounds[:, 3:] - bounds[:, :3], axis=0)
    side = (np.prod(size) * 16 / 20_000) ** (1 / 3)
    assert np.allclose(width, side, rtol=0.25)


def test_equal_boxes_and_equal_input() -> None:
    boxes = np.tile([1.0, 2, 3, 4, 5, 6], (100, 1))
    assert np.array_equal(pack(boxes, page_size=10), np.arange(100) // 10)
    boxes = random_boxes(500, 3)
    assert np.array_equal(pack(boxes), pack(boxes.copy()))
