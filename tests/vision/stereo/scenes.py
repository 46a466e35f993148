"""Two distorted, toed-in cameras, what they show of points, and pictures of arcs alone."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import numpy as np

from relmodel.arrays import Floats
from relmodel.geometry.transforms import apply, inverse
from tests.poses import pose_of
from vision.cameras.cameras import Camera, Rig
from vision.extraction.rows import RegionColumns
from vision.stereo.epipolar import StereoArcs
from vision.stereo.match import StereoPicture

DISTORTION = np.array([-0.12, 0.05, 0.001, -0.0005, -0.01])


def toed_in_rig() -> Rig:
    """Two cameras 180 mm apart, turned 5 and 4 degrees towards each other and a little askew, unlike inside."""
    cameras = {
        "left": Camera(1280, 960, np.array([[1290.0, 0, 630], [0, 1285, 470], [0, 0, 1]]), DISTORTION),
        "right": Camera(1280, 960, np.array([[1302.0, 0, 652], [0, 1300, 488], [0, 0, 1]]), -0.5 * DISTORTION),
    }
    poses = {}
    for name, x, turn in (("left", -90.0, [0.01, 0.087, 0.02]), ("right", 90.0, [-0.015, -0.07, -0.01])):
        poses[name] = pose_of([x, 0.03 * x, 5.0], turn)
    return Rig(cameras, poses)


def pixels(rig: Rig, name: str, points: Floats) -> Floats:
    """Pixels (n, 2) of points (n, 3) in the rig's frame."""
    found, front = rig.cameras[name].project(apply(inverse(rig.rig_from_camera[name]), points))
    assert front.all()
    return found


def picture_of(arcs: StereoArcs) -> StereoPicture:
    """A picture with these arcs, no regions and no relations."""
    none: dict[str, Any] = {field.name: np.zeros(0, np.int64) for field in fields(RegionColumns)}
    regions = RegionColumns(**none | {"outline": np.zeros((0, 2), np.int64), "ring_offsets": np.zeros(1, np.int64)})
    relations = {
        "kind": np.zeros(0, object),
        **dict.fromkeys(("unit_a", "unit_b"), np.zeros(0, np.int32)),
        **dict.fromkeys(("distance", "distance_sigma", "angle", "angle_sigma"), np.zeros(0)),
    }
    return StereoPicture(arcs, regions, relations)
