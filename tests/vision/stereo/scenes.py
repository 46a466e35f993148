"""Wireframes seen by two distorted, toed-in cameras: arcs of both pictures with known partners and known places."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np
import numpy.typing as npt

from relmodel.arrays import Floats, Ints
from relmodel.geometry.transforms import apply, inverse
from tests.poses import pose_of
from vision.cameras.cameras import Camera, Rig
from vision.extraction.arcs import ELLIPTIC, LINE
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


def segment(a: npt.ArrayLike, b: npt.ArrayLike, count: int = 150) -> Floats:
    t = np.linspace(0, 1, count)[:, None]
    return np.asarray(np.asarray(a, float) * (1 - t) + np.asarray(b, float) * t)


def circle(centre: npt.ArrayLike, radius: float, count: int = 240) -> Floats:
    t = np.linspace(0, 2 * np.pi, count)
    return np.asarray(centre, float) + radius * np.stack([np.cos(t), np.sin(t), 0.2 * np.cos(t)], axis=1)


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


@dataclass(frozen=True)
class Scene:
    """`partner` (left arcs,): right arc of each, -1 for clutter; `polyline` (left arcs,): points in the rig's frame."""

    left: StereoArcs
    right: StereoArcs
    partner: Ints
    polyline: list[Floats | None]


def wireframe_scene(rig: Rig, seed: int, arcs: int = 60, clutter: int = 40, noise: float = 0.15) -> Scene:
    """`arcs` lines and circles between 560 and 760 mm, none along the rows, and lines of clutter in each picture."""
    rng = np.random.default_rng(seed)
    polylines: list[Floats] = []
    while len(polylines) < arcs:
        centre = np.array([rng.uniform(-170, 170), rng.uniform(-140, 140), rng.uniform(560, 760)])
        if rng.random() < 0.25:
            polylines.append(circle(centre, float(rng.uniform(8, 25))))
            continue
        angle, half = rng.uniform(0.5, np.pi - 0.5), rng.uniform(10, 45)
        way = half * np.array([np.cos(angle), np.sin(angle), rng.uniform(-0.3, 0.3)])
        polylines.append(segment(centre - way, centre + way))
    contrast = rng.uniform(15, 90, arcs) * rng.choice([-1, 1], arcs)

    def picture(name: str) -> tuple[StereoArcs, Ints]:
        drawn = [pixels(rig, name, c) + rng.normal(0, noise, (len(c), 2)) for c in polylines]
        size = contrast * rng.uniform(0.8, 1.25, arcs)
        closed = np.array([bool(np.allclose(c[0], c[-1])) for c in polylines])
        for _ in range(clutter):
            start = np.array([rng.uniform(50, 1230), rng.uniform(50, 910)])
            way, length = rng.uniform(0, 2 * np.pi), rng.uniform(20, 60)
            drawn.append(segment(start, start + length * np.array([np.cos(way), np.sin(way)]), int(length)))
        size = np.concatenate([size, rng.uniform(-90, 90, clutter)])
        turned = rng.random(len(drawn)) < 0.5
        drawn = [d[::-1] if t else d for d, t in zip(drawn, turned, strict=True)]
        size = np.where(turned, -size, size)
        order = rng.permutation(len(drawn))
        arcs_seen = StereoArcs(
            offsets=np.concatenate([[0], np.cumsum([len(drawn[k]) for k in order])]).astype(np.int64),
            points=np.concatenate([drawn[k] for k in order]),
            contrast=np.concatenate([np.full(len(drawn[k]), size[k]) for k in order]),
            sigma=np.full(len(order), noise),
            kind=np.concatenate([np.where(closed, ELLIPTIC, LINE), np.full(clutter, LINE)])[order],
            width=np.full(len(order), 0.8),
        )
        return arcs_seen, order

    left, left_order = picture("left")
    right, right_order = picture("right")
    place = np.empty(len(right_order), np.int64)
    place[right_order] = np.arange(len(right_order))
    return Scene(
        left=left,
        right=right,
        partner=np.array([place[k] if k < arcs else -1 for k in left_order]),
        polyline=[polylines[k] if k < arcs else None for k in left_order],
    )
