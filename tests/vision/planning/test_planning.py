"""The grid of poses about a box against closed forms, and the choice of views against loops."""

from __future__ import annotations

from math import ceil, cos, radians, sin

import numpy as np
import pytest

from tests.vision.localisation.scenes import box_scene
from vision.cameras.cameras import Camera, Rig, perturb
from vision.planning import GroundPlane, choose_views, find_table, lay_grid

CAMERA = Camera(800, 600, np.array([[1000.0, 0, 399.5], [0, 1200.0, 299.5], [0, 0, 1]]))
WIDE = Camera(800, 600, np.array([[800.0, 0, 399.5], [0, 800.0, 299.5], [0, 0, 1]]))
ONE = Rig({"left": CAMERA}, {"left": np.eye(4)})
TWO = Rig(
    {"left": WIDE, "right": CAMERA},
    {"left": np.eye(4), "right": perturb(np.eye(4), np.array([120.0, 0, 0, 0, -0.2, 0]))},
)
LOW, SIZE = np.array([1000.0, -200, 300]), np.array([700.0, 400, 150])
SMALL = (np.array([1250.0, -75, 350]), np.array([200.0, 150, 100]))


@pytest.mark.parametrize("order", [(0, 1, 2), (2, 0, 1)])
@pytest.mark.parametrize("rig", [ONE, TWO])
def test_every_side_of_a_box_is_looked_at_straight_and_tilted_from_the_distance(rig: Rig, order: list[int]) -> None:
    """Also where the box stands along other axes of the world."""
    low, size, far = LOW[list(order)], SIZE[list(order)], 600.0
    scene = box_scene([(low, size)])
    found = lay_grid(scene, np.array([0]), rig, far)
    step = 0.6 * far * np.array([800 / 1000, 600 / 1200])
    expected = set()
    for axis in range(3):
        u, v = sorted((a for a in range(3) if a != axis), key=lambda a: -size[a])
        count = [ceil(size[u] / step[0]), ceil(size[v] / step[1])]
        for side, i, j in np.ndindex(2, *count):
            target = low + size * 0.0
            target[[u, v]] += [(i + 0.5) * size[u] / count[0], (j + 0.5) * size[v] / count[1]]
            target[axis] += side * size[axis]
            ahead = (2 * side - 1) * np.eye(3)[axis]
            tilts = [cos(radians(35)) * ahead + s * sin(radians(35)) * np.eye(3)[a] for a in (u, v) for s in (1, -1)]
            for way in (ahead, *tilts):
                expected.add((u, *np.round([*target, *way], 3).tolist()))
    assert len(expected) == len(found)
    pose, sides = np.stack(list(rig.rig_from_camera.values())), np.array(list(expected), float)
    for world_from_rig, target in zip(found.world_from_rig, found.target, strict=True):
        cameras = world_from_rig @ pose
        way = -cameras[:, :3, 2].mean(axis=0)
        way /= np.linalg.norm(way)
        np.testing.assert_allclose(cameras[:, :3, 3].mean(axis=0), target + far * way, atol=1e-3)
        along = cameras[-1, :3, 3] - cameras[0, :3, 3] if len(pose) > 1 else cameras[0, :3, 0]
        key = [*np.round([*target, *way], 3).tolist()]
        (u,) = sides[np.isclose(sides[:, 1:], key, atol=2e-3).all(axis=1), 0].astype(int)
        ahead = np.eye(3)[u] - (np.eye(3)[u] @ way) * way
        aside = along - (along @ way) * way
        assert abs(ahead @ aside) == pytest.approx(np.linalg.norm(ahead) * np.linalg.norm(aside), rel=1e-4)
        np.testing.assert_allclose(world_from_rig[:3, :3] @ world_from_rig[:3, :3].T, np.eye(3), atol=1e-9)
        assert np.linalg.det(world_from_rig[:3, :3]) > 0


@pytest.mark.parametrize(("axis", "mm", "kept"), [(2, 1049, True), (2, 1051, False), (0, 1199, True), (0, 1201, False)])
def test_cameras_stay_clear_of_the_floor(axis: int, mm: float, kept: bool) -> None:
    """By 150 mm: looking straight down from 750 mm, the lens stands at 1200, over the middle of the box at 1350."""
    found = lay_grid(box_scene([SMALL]), np.array([0]), ONE, 750.0, GroundPlane(axis, mm))
    above = np.abs(found.world_from_rig[:, :3, 3] - [1350, 0, 1200]).max(axis=1) < 1e-3
    assert above.any() == kept


@pytest.mark.parametrize(("gap", "far", "kept"), [(145, 600, 0), (155, 600, 1), (98, 200, 0), (102, 200, 1)])
def test_nothing_lies_about_a_camera_and_what_hides_the_part_is_not_looked_through(
    gap: float, far: float, kept: int
) -> None:
    """A second block above the lens; of a short distance half has to be clear."""
    block = (np.array([1300.0, -50, 450 + far + gap]), np.array([100.0, 100, 30]))
    rig = Rig({"left": Camera(800, 600, np.diag([200.0, 200, 1]))}, {"left": np.eye(4)})
    found = lay_grid(box_scene([SMALL, block]), np.array([0]), rig, far)
    straight = np.linalg.norm(found.world_from_rig[:, :3, 3] - [1350, 0, 450 + far], axis=1) < 1e-3
    assert straight.sum() == kept
    roof = (np.array([900.0, -300, 450.4]), np.array([900.0, 600, 2.5]))
    under = lay_grid(box_scene([SMALL, roof]), np.array([0]), rig, far)
    assert under.target[:, 2].max() < 449


def test_the_table_is_at_zero_or_where_the_lowest_part_stands() -> None:
    assert find_table(box_scene([(LOW, SIZE)])) == GroundPlane(2, 0.0)
    assert find_table(box_scene([(LOW - [0, 0, 500], SIZE)])) == GroundPlane(2, -200.0)


@pytest.mark.parametrize("seed", range(4))
def test_views_are_chosen_one_by_one(seed: int) -> None:
    px = np.random.default_rng(seed).gamma(1.0, 60.0, (15, 12))
    checks = px > 120
    some, chosen = np.flatnonzero(checks.any(axis=0)), []
    seen: set[int] = set()
    while len(seen) < 0.9 * len(some):
        new = [set(np.flatnonzero(row).tolist()) - seen for row in checks]
        chosen.append(max(range(15), key=lambda v: (len(new[v]), sum(px[v, i] for i in new[v]))))
        seen |= new[chosen[-1]]
    assert choose_views(checks, px, 0.9) == chosen
    assert choose_views(checks, px, 0.9, 2) == chosen[:2]
    assert choose_views(np.zeros((3, 4), bool), np.ones((3, 4)), 0.9) == []
