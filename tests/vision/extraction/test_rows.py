"""What later stages take of an extraction, against the curves that its rows state."""

from __future__ import annotations

import numpy as np

from relmodel.arrays import Floats
from tests.vision.extraction.synthetic import render
from vision.extraction.arcs import KINDS
from vision.extraction.extract import extract
from vision.extraction.rows import make_primitives
from vision.stereo.epipolar import pack_arcs

TURN = 0.5


def turned(x: Floats, y: Floats) -> Floats:
    """Coordinates along the axes of the ellipse in the middle of the picture, px."""
    return np.stack(
        [(x - 70) * np.cos(TURN) + (y - 60) * np.sin(TURN), (y - 60) * np.cos(TURN) - (x - 70) * np.sin(TURN)]
    )


def distance(x: Floats, y: Floats) -> Floats:
    """Of a place from an ellipse of 40 by 22 px, to first order, positive inside."""
    u, v = turned(x, y)
    r = np.maximum(np.hypot(u / 40, v / 22), 1e-9)
    return np.asarray((1 - r) * r / np.maximum(np.hypot(u / 1600, v / 484), 1e-9))


def test_courses_run_along_the_ellipse_with_its_bright_side_at_the_left() -> None:
    found = make_primitives(extract(render(distance, (120, 140), 0.7, 60, 160)))
    assert [KINDS[kind] for kind in found.arcs.kind] == ["elliptic"]
    points = found.courses.points
    assert len(points) > 150
    off = np.hypot(*(turned(*points.T) / [[40], [22]])) - 1
    np.testing.assert_allclose(off, 0, atol=0.01)
    walk, inward = np.roll(points, -1, axis=0) - points, [70, 60] - points
    at_left = inward[:, 0] * walk[:, 1] - inward[:, 1] * walk[:, 0] > 0  # y runs down
    assert (at_left == found.courses.bright_left).mean() > 0.95
    np.testing.assert_allclose(pack_arcs(found).contrast, np.where(found.courses.bright_left, 100, -100), rtol=0.1)
