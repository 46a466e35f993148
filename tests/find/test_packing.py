"""Sort-Tile-Recursive packing."""

from __future__ import annotations

import numpy as np
import pytest

from relmodel.find.packing import pack, page_boxes


def random_boxes(n: int, seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    low = rng.uniform(-100, 100, (n, 3))
    return np.concatenate([low, low + rng.exponential(3, (n, 3))], axis=1)


@pytest.mark.parametrize("n", [0, 1, 7, 8, 9, 64, 65, 1000, 12345])
def test_every_box_has_a_page_and_pages_are_full(n: int) -> None:
    boxes = random_boxes(n, n)
    page = pack(boxes, page_size=8)
    assert len(page) == n
    counts, bounds = page_boxes(boxes, page)
    assert counts.sum() == n
    assert len(counts) == -(-n // 8)
    assert (counts[:-1] == 8).all()
    for number in range(min(len(counts), 50)):
        members = boxes[page == number]
        assert np.array_equal(bounds[number, :3], members[:, :3].min(axis=0))
        assert np.array_equal(bounds[number, 3:], members[:, 3:].max(axis=0))


def test_pages_are_compact() -> None:
    """Pages of points in a cube are near cubes: their summed volume is near the cube's, their widths near equal."""
    points = np.random.default_rng(1).uniform(0, 1, (64 * 512, 3))
    _, bounds = page_boxes(np.hstack([points, points]), pack(np.hstack([points, points]), page_size=64))
    width = (bounds[:, 3:] - bounds[:, :3]).mean(axis=0)
    assert np.allclose(width, 1 / 8, rtol=0.15)
    assert np.prod(bounds[:, 3:] - bounds[:, :3], axis=1).sum() < 1.0


def test_equal_boxes_and_equal_input() -> None:
    boxes = np.tile([1.0, 2, 3, 4, 5, 6], (100, 1))
    assert np.array_equal(pack(boxes, page_size=10), np.arange(100) // 10)
    boxes = random_boxes(500, 3)
    assert np.array_equal(pack(boxes), pack(boxes.copy()))
