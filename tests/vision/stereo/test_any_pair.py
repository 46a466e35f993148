"""What valid pictures of a pair may show: whatever is matched has its place in space, and nothing ends in an error."""

from __future__ import annotations

import numpy as np
import pytest

from relmodel.arrays import Floats
from tests.poses import pose_of
from vision.cameras.cameras import Camera, Rig
from vision.constellations.constellation_parameters import DEFAULTS
from vision.constellations.elements import find_scene_circles, find_scene_lines, relate_lines
from vision.constellations.find_poses import sample_scene
from vision.extraction.extract import extract
from vision.extraction.rows import make_primitives
from vision.stereo.match import match_stereo

pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")

SHAPE = (90, 120)
Y, X = np.indices(SHAPE).astype(float)
PICTURES: dict[str, Floats] = {
    "nothing": np.full(SHAPE, 255.0),
    "noise": np.where(X < 60, np.random.default_rng(0).uniform(0, 255, SHAPE), 90.0),
    "stripes": 255 * (X // 9 % 2),  # without noise: arcs of which every element lies exactly on the line
    "board": 255.0 * ((X // 16 + Y // 16) % 2),
    "one edge along the rows": np.where(Y > 45, 255.0, 0.0),
    "rings": 127.5 + 127.5 * np.cos(np.hypot(X - 60, Y - 45) / 3),
    "discs": 255.0 * ((X % 40 - 20) ** 2 + (Y % 40 - 20) ** 2 < 150),
}


def rig(toe_in: float, lens: list[float]) -> Rig:
    camera = Camera(120, 90, np.array([[130.0, 0, 59.5], [0, 130.0, 44.5], [0, 0, 1]]), np.array(lens))
    right = pose_of([100.0, 0, 0], [0, -toe_in, 0])
    return Rig({"left": camera, "right": camera}, {"left": np.eye(4), "right": right})


@pytest.mark.parametrize(("shown", "shift"), [*((shown, 3) for shown in PICTURES if shown != "board"), ("board", 0)])
def test_what_is_matched_has_a_place(shown: str, shift: int) -> None:
    left, right = (make_primitives(extract(np.roll(PICTURES[shown], -by, axis=1))) for by in (0, shift))
    for cameras in (rig(0.15, [-0.4, 0.2, 0.0, 0.0, -0.05]), *[rig(0.0, [])] * (shift == 0)):
        space = match_stereo(cameras, left, right).triangulated
        for values in (space.start, space.end, space.covariance, space.edge_probability):
            assert np.isfinite(values).all()
        points = sample_scene(space)
        assert np.isfinite(np.column_stack([points.point, points.direction, points.weight])).all()
        circles, lines = find_scene_circles(space)[1], find_scene_lines(space, DEFAULTS.lines)[1]
        for relations in (circles.relations(DEFAULTS.join), relate_lines(lines, DEFAULTS.lines)):
            assert all(np.isfinite(values).all() for values in relations.values())
