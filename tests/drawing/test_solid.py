"""How triangles are drawn: which each pixel shows, against the point in each, and slivers narrower than a pixel."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from relmodel.app.cli.main import main
from relmodel.arrays import Floats
from relmodel.drawing.solid import first_hits
from relmodel.model.model import Assembly, Instance, Model, Part
from relmodel.readers.mesh.shape import shape_from_triangles
from relmodel.store import Store
from tests.reading import store_model


def eyes(height: int, width: int) -> Floats:
    """At the centres of pixels, before all triangles."""
    return np.stack(
        [*np.meshgrid(np.arange(float(width)), np.arange(float(height))), np.full((height, width), -99.0)], -1
    )


def test_each_pixel_shows_the_nearest_triangle_at_its_centre() -> None:
    """Triangles in a picture and beyond it, compared with where the centre of each pixel is in each of them."""
    corners = np.random.default_rng(4).uniform(-15, 75, (60, 3, 3))
    shown = first_hits(corners, eyes(40, 60))
    x, y = np.meshgrid(np.arange(60.0), np.arange(40.0))
    a, b, c = (corners[:, i, :, None, None] for i in range(3))
    area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    of_b = ((x - a[:, 0]) * (c[:, 1] - a[:, 1]) - (y - a[:, 1]) * (c[:, 0] - a[:, 0])) / area
    of_c = ((b[:, 0] - a[:, 0]) * (y - a[:, 1]) - (b[:, 1] - a[:, 1]) * (x - a[:, 0])) / area
    inside = (of_b >= 0) & (of_c >= 0) & (of_b + of_c <= 1)
    z = np.where(inside, a[:, 2] + of_b * (b[:, 2] - a[:, 2]) + of_c * (c[:, 2] - a[:, 2]), np.inf)
    np.testing.assert_array_equal(shown, np.where(inside.any(axis=0), z.argmin(axis=0), -1))


def test_triangles_that_share_a_side_leave_no_gap() -> None:
    """A square in two, of corners and a diagonal through centres of pixels; a line and a point show nothing more."""
    flat = [[[3, 3], [9, 9], [3, 9]], [[9, 3], [9, 9], [3, 3]], [[5, 2], [5, 2], [8, 2]], [[1, 7], [1, 7], [1, 7]]]
    shown = first_hits(np.concatenate([flat, np.zeros((4, 3, 1))], axis=2), eyes(12, 12))
    square = np.zeros((12, 12), bool)
    square[3:10, 3:10] = True
    np.testing.assert_array_equal(shown >= 0, square)


def test_slivers_narrower_than_a_line_are_not_all_lines(duckdb_template: Path, tmp_path: Path) -> None:
    """A rod of 600 flat sides, 40 mm thick and 600 mm long: seen from aside a rectangle with some shades."""
    angle = np.linspace(0, 2 * np.pi, 600, endpoint=False)
    ring = 20 * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    first = np.arange(600)
    after = (first + 1) % 600
    sides = np.concatenate(
        [np.stack(t, axis=1) for t in ((first, after, first + 600), (after, after + 600, first + 600))]
    )
    shape = shape_from_triangles(np.concatenate([ring, ring + np.array([0, 0, 600])]), sides, fit=False)
    assert shape is not None
    rod = Assembly("ROD", (Instance("ROD", "part", 0, np.eye(4)),))
    target = str(shutil.copy(duckdb_template, tmp_path / "s.duckdb"))
    with Store.open(target) as store:
        store_model(store, Model("STL", "mm", 1.0, (shape,), (Part("R", "R", 0),), (rod,), 0, 0, "test"), "rod")
    assert main(["show", "rod", "--picture", str(tmp_path / "rod.png"), "--view", "right", "--store", target]) == 0
    grey = np.asarray(Image.open(tmp_path / "rod.png").convert("L"))
    step = 1600 / (600 * 1.04)  # px in a mm
    assert (grey < 250).sum() == pytest.approx(40 * 600 * step**2, rel=0.02)
    assert (grey == 40).sum() < 0.1 * (grey < 250).sum(), "lines"
