"""How triangles are drawn: which each pixel shows, against the point in each, and slivers narrower than a pixel."""

from __future__ import annotations

import base64
import shutil
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import cv2
import numpy as np
import pytest
from PIL import Image

from relmodel.app.cli.main import main
from relmodel.arrays import Floats
from relmodel.drawing.solid import Faces, first_hits
from relmodel.model.model import Assembly, Instance, Model, Part
from relmodel.readers.mesh.shape import shape_from_triangles
from relmodel.store import Store
from tests.reading import store_model


def eyes(height: int, width: int) -> Floats:
    """At the centres of pixels, before all triangles."""
    x, y = np.meshgrid(np.arange(float(width)), np.arange(float(height)))
    return np.stack([x, y, np.full((height, width), -99.0)], -1)


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


def test_the_outline_of_a_face_is_what_a_lens_shows_of_it() -> None:
    """A square of 200 mm at 1 m, its right half behind another; against the corners as OpenCV projects them."""

    def packed(array: Any, form: str) -> str:
        return base64.b64encode(np.asarray(array).astype(form).tobytes()).decode()

    corners = 65535 * np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    square: dict[str, Any] = {"lo": [-100, -100, 0], "size": [200, 200, 1], "v": packed(corners, "<u2"), "wide": False}
    square |= {"t": packed([0, 1, 1, -2, 2, 1], "<i2"), "s": [[7, 0, 3], [8, 3, 3]]}  # 0 1 2, 0 2 3
    parts = [{"shape": 0, "m": [1, 0, 0, x, 0, 1, 0, 0, 0, 0, 1, z]} for x, z in ((0, 1000), (110, 900))]
    lens = [-0.2, 0.05, 0.002, -0.001, 0.01]
    camera = SimpleNamespace(fx=1200.0, fy=1190.0, skew=0.0, cx=330.0, cy=235.0, distortion=lens)
    faces = Faces({"shapes": [square], "parts": parts}, {40: 0, 41: 1})
    rings = faces.outline(camera, np.eye(4), 40, [7, 8], (0, 0, 640, 480))
    edge, across = 10 / 0.9, np.linspace(-1, 1, 41)  # edge: of the square in front, on the plane of the one behind
    side = np.stack([100 * across, np.full(41, 100.0), np.full(41, 1000.0)], axis=1)
    left = np.stack([np.full(41, -100.0), 100 * across[::-1], np.full(41, 1000.0)], axis=1)
    side = side[side[:, 0] < edge]
    outline = np.concatenate([side * [1, -1, 1], left[::-1] * [-edge / 100, 1, 1], side[::-1], left])
    matrix, none = np.array([[1200, 0, 330], [0, 1190, 235], [0, 0, 1.0]]), np.zeros(3)
    truth = cv2.projectPoints(outline, none, none, matrix, np.array(lens))[0][:, 0]
    found, given = (
        cv2.fillPoly(np.zeros((480, 640)), [np.rint(c).astype(np.int32) for c in courses], 1) > 0
        for courses in (rings, [np.asarray(truth)])
    )
    assert (found & given).sum() > 0.98 * (found | given).sum() > 10_000


def test_slivers_narrower_than_a_line_are_not_all_lines(duckdb_template: Path, tmp_path: Path) -> None:
    """A rod of 600 flat sides, 40 mm thick and 600 mm long: seen from aside a rectangle with some shades."""
    angle = np.linspace(0, 2 * np.pi, 600, endpoint=False)
    ring = 20 * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    first = np.arange(600)
    after = (first + 1) % 600
    two = (first, after, first + 600), (after, after + 600, first + 600)
    sides = np.concatenate([np.stack(t, axis=1) for t in two])
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
