"""Symmetries of a model against those known in closed form."""

from __future__ import annotations

import numpy as np
import pytest

from relmodel.arrays import Floats
from relmodel.geometry.transforms import rotation_matrix
from tests.vision.localisation.scenes import box_scene
from vision.cameras.cameras import perturb
from vision.localisation.localise import complete_group, find_symmetries
from vision.scene import Scene


def cuboids(*boxes: tuple[list[float], list[float]]) -> Scene:
    """Cuboids, each by its middle and its size."""
    return box_scene([(np.array(middle) - np.array(size) / 2, np.array(size)) for middle, size in boxes])


def turns() -> list[Floats]:
    """The 24 rotations (4, 4) that carry a cube onto itself."""
    quarter = [rotation_matrix(np.pi / 2 * axis) for axis in np.eye(3)]
    found = [np.eye(3)]
    for one in found:
        for turn in quarter:
            new = turn @ one
            if all(np.abs(new - other).max() > 0.1 for other in found):
                found.append(new)
    motions = np.tile(np.eye(4), (len(found), 1, 1))
    motions[:, :3, :3] = found
    return list(motions)


@pytest.mark.parametrize(("size", "expected"), [([60, 60, 60], 24), ([60, 60, 34], 8), ([60, 44, 34], 4)])
def test_the_symmetries_of_a_cuboid_are_found(size: list[float], expected: int) -> None:
    scene, best = cuboids(([0, 0, 0], size)), np.eye(4)
    best[:3, :3], best[:3, 3] = rotation_matrix(np.array([0.3, 0.2, -0.6])), [20, 30, 500]
    rng = np.random.default_rng(1)
    poses = []
    for turn in turns():
        off = np.eye(4)
        off[:3, :3], off[:3, 3] = rotation_matrix(rng.normal(0, 0.005, 3)), rng.normal(0, 0.5, 3)
        poses.append(off @ turn @ best)
    found = [motion for motion in find_symmetries(scene, best, poses) if motion is not None]
    assert len(found) == expected - 1, "the identity is none"
    exact = np.array(turns())
    assert all(np.abs(exact - motion).max(axis=(1, 2)).min() < 1e-2 for motion in found)
    assert len(complete_group(found)) == expected


def test_a_small_part_on_one_side_breaks_a_symmetry() -> None:
    body, half = ([0.0, 0.0, 0.0], [60.0, 45.0, 35.0]), np.diag([1.0, -1.0, -1.0, 1.0])
    assert find_symmetries(cuboids(body), np.eye(4), [half])[0] is not None
    assert find_symmetries(cuboids(body, ([20, 0, 20.0], [8, 5, 5])), np.eye(4), [half]) == [None]


def test_a_shift_by_a_pitch_is_none_of_a_comb_that_ends() -> None:
    teeth = [([12.0 * n, 0.0, 0.0], [4.0, 30.0, 10.0]) for n in range(12)]
    shift = np.eye(4)
    shift[0, 3] = 12.0
    assert find_symmetries(cuboids(*teeth), np.eye(4), [shift]) == [None]


def test_a_pose_beside_the_best_is_no_symmetry() -> None:
    body = ([0.0, 0, 0], [60.0, 30, 20])
    beside = perturb(np.eye(4), np.array([0.8, -0.5, 0.3, 0.01, 0.015, -0.01]))
    assert find_symmetries(cuboids(body), np.eye(4), [beside]) == [None]
