"""Two distorted, toed-in cameras and two parallel ones, what they show of points, and pictures of arcs alone."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import numpy as np

from relmodel.arrays import Floats, Ints
from relmodel.geometry.transforms import apply, inverse
from tests.poses import pose_of
from vision.cameras.cameras import Camera, Rig
from vision.extraction.arcs import ELLIPTIC, FREE, LINE
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


# Two parallel cameras without distortion: rectified coordinates are pixels less the centre.
CENTRE, FOCAL, BASELINE = np.array([640.0, 480.0]), 1300.0, 100.0


def parallel_rig() -> Rig:
    camera = Camera(1280, 960, np.array([[FOCAL, 0, CENTRE[0]], [0, FOCAL, CENTRE[1]], [0, 0, 1]]))
    return Rig({"left": camera, "right": camera}, {"left": np.eye(4), "right": pose_of([BASELINE, 0, 0])})


def place(x: Floats, y: Floats, disparity: Floats) -> Floats:
    """Where rectified points of the first picture are in space, mm."""
    return np.asarray(BASELINE / disparity * np.array([x, y, np.full_like(x, FOCAL)]))


def packed(lines: list[Floats], contrast: Floats, width: Floats, kind: Ints, sigma: Floats) -> StereoArcs:
    """Arcs through rectified points, of one contrast each."""
    size = [len(line) for line in lines]
    offsets = np.concatenate([[0], np.cumsum(size)]).astype(np.int64)
    return StereoArcs(offsets, np.concatenate(lines) + CENTRE, np.repeat(contrast, size), kind, sigma, width)


def random_pair(seed: int, crossing: int = 30, level: int = 12) -> tuple[StereoArcs, StereoArcs, Ints]:
    """Arcs across rows and level ones, most about one disparity, cut otherwise in each; the first's partners."""
    rng = np.random.default_rng(seed)
    count = crossing + level
    left, right = [], []
    for k in range(count):
        angle = rng.uniform(0.3, np.pi - 0.3) if k < crossing else rng.uniform(-0.03, 0.03)
        t = np.arange(rng.integers(30, 90))[:, None]
        bent = 0.002 * rng.uniform(-1, 1) * (t - t.mean()) ** 2 if k % 3 == 0 and k < crossing else 0 * t
        start = rng.uniform([-250, -350], [450, 300])
        line = start + t * [np.cos(angle), np.sin(angle)] + bent * [-np.sin(angle), np.cos(angle)]
        disparity = (250.0 if k % 5 else 110.0) + rng.uniform(-20, 20) + 0.03 * (line - start) @ rng.normal(size=2)
        seen = line - np.column_stack([disparity, np.zeros(len(line))])
        left.append(line[rng.integers(0, 6) :] + rng.normal(0, 0.1, (1, 2)))
        right.append(seen[: len(seen) - rng.integers(0, 9)] + rng.normal(0, 0.1, (1, 2)))
        right[-1] += rng.normal(0, 0.15, right[-1].shape)
    contrast = rng.uniform(10, 90, count) * rng.choice([-1, 1], count)
    turned = rng.random(count) < 0.3
    right = [line[::-1] if back else line for line, back in zip(right, turned, strict=True)]
    kind = np.where(np.arange(count) % 3 == 0, FREE, np.where(np.arange(count) % 7 == 1, ELLIPTIC, LINE))
    order = rng.permutation(count)
    other = np.where(turned, -1, 1) * contrast * rng.uniform(0.6, 1.6, count)
    width, sigma = rng.uniform(0.6, 1.6, (2, count)), rng.uniform(0.02, 0.2, (2, count))
    return (
        packed(left, contrast, width[0], kind, sigma[0]),
        packed([right[k] for k in order], other[order], width[1][order], kind[order], sigma[1][order]),
        np.argsort(order),
    )
