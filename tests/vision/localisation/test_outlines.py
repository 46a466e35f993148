"""Greys beside outlines, against closed forms and on pictures of a box whose prints rival its edges."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from relmodel.arrays import Floats
from tests.vision.localisation.scenes import above, box_scene, stereo_rig
from vision.cameras.cameras import Camera, Rig, perturb
from vision.localisation.support import OBSERVED_PX, Outlines, lay_grey_grids, measure_outlines
from vision.scene import Scene

SIZE = np.array([120.0, 80, 50])
STRIPE_MM = 6.0


@cache
def printed_box() -> tuple[Scene, Rig, Floats, dict[str, Floats]]:
    """A box with stripes along all its edges on a plain table: the world, one camera, its pose, and the picture by
    intersecting its rays with the box."""
    rig, pose = stereo_rig().only("left"), above(60, 40, 520)
    camera = rig.cameras["left"]
    x, y = np.meshgrid(np.arange(camera.width), np.arange(camera.height))
    rays = np.stack([x, y, np.ones_like(x)], axis=-1) @ np.linalg.inv(camera.matrix).T @ pose[:3, :3].T
    with np.errstate(divide="ignore"):
        ends = np.stack([-pose[:3, 3] / rays, (SIZE - pose[:3, 3]) / rays])
    enter, leave = ends.min(axis=0), ends.max(axis=0).min(axis=-1)
    at, axis = enter.max(axis=-1), enter.argmax(axis=-1)
    point = pose[:3, 3] + at[..., None] * rays
    beside = np.minimum(point, SIZE - point)
    np.put_along_axis(beside, axis[..., None], np.inf, axis=-1)
    stripe = np.abs(beside.min(axis=-1) - 2 * STRIPE_MM) < STRIPE_MM
    grey = np.where(at < leave, np.where(stripe, 60.0, 150.0 + 15 * axis), 100.0)
    noise = np.random.default_rng(1).normal(0, 3, grey.shape)
    return box_scene([(np.zeros(3), SIZE)]), rig, pose, {"left": grey + noise}


def outlines(pose: Floats, pictures: dict[str, Floats] | None = None) -> Outlines:
    scene, rig, _, shown = printed_box()
    return measure_outlines(scene, rig, lay_grey_grids(rig, pictures or shown), pose)


def test_right_pose_has_contrast_all_along() -> None:
    found = outlines(printed_box()[2])
    assert found.mean > 2
    assert found.evidence == pytest.approx(found.mean * found.length_px[0] / OBSERVED_PX)


@pytest.mark.parametrize("stripe", [STRIPE_MM, 3 * STRIPE_MM])
def test_outline_laid_along_the_print_has_less(stripe: float) -> None:
    """As far off as the box seems smaller by the stripes: the outline lies on strong edges, none of them its own."""
    pose = printed_box()[2]
    smaller = pose.copy()
    middle = SIZE / 2
    smaller[:3, 3] = middle + (pose[:3, 3] - middle) * SIZE[1] / (SIZE[1] - 2 * stripe)
    assert outlines(smaller).mean < 0.5 * outlines(pose).mean


@pytest.mark.parametrize("shift", [(25.0, 20.0), (20.0, -25.0), (-30.0, 30.0)])
def test_outline_beside_the_object_has_less(shift: tuple[float, float]) -> None:
    pose = printed_box()[2]
    assert outlines(perturb(pose, np.array([*shift, 0, 0, 0, 0]))).mean < 0.5 * outlines(pose).mean


def test_picture_that_shows_nothing_has_none() -> None:
    blank = {"left": np.random.default_rng(2).normal(110, 3, (480, 640))}
    assert abs(outlines(printed_box()[2], blank).mean) < 0.1


def test_length_is_that_of_the_outline() -> None:
    """A plate seen head-on: its outline is a rectangle whose sides the focal length gives."""
    rig = Rig({"left": Camera(640, 480, np.array([[700.0, 0, 320], [0, 700, 240], [0, 0, 1]]))}, {"left": np.eye(4)})
    plate = box_scene([(np.array([-100.0, -60, -10]), np.array([200.0, 120, 10]))])
    pose = np.diag([1.0, -1, -1, 1])
    pose[2, 3] = 700.0
    grids = lay_grey_grids(rig, {"left": np.zeros((480, 640))})
    found = measure_outlines(plate, rig, grids, pose)
    assert found.length_px[0] == pytest.approx(2 * (200 + 120), rel=0.15)
    wall = box_scene([(np.array([-900.0, -900, -10]), np.array([1800.0, 1800, 10]))])
    inside = measure_outlines(wall, rig, grids, pose)
    assert inside.length_px[0] == 0
    assert inside.evidence == 0
