"""Symmetries of a model against those known in closed form."""

from __future__ import annotations

import numpy as np
import pytest

from relmodel.arrays import Floats
from relmodel.geometry.transforms import rotation_matrix
from tests.poses import pose_of
from tests.vision.localisation.scenes import box_scene
from vision.cameras.cameras import perturb
from vision.localisation.localise import (
    align_with_lines,
    complete_group,
    describe_arc_shapes,
    find_displacements,
    find_symmetries,
)
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
    scene, best = cuboids(([0, 0, 0], size)), pose_of([20, 30, 500], [0.3, 0.2, -0.6])
    rng = np.random.default_rng(1)
    poses = []
    for turn in turns():
        off = pose_of(turn=rng.normal(0, 0.005, 3), shift=rng.normal(0, 0.5, 3))
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
    assert find_symmetries(cuboids(*teeth), np.eye(4), [pose_of([12.0, 0, 0])]) == [None]


def test_a_pose_beside_the_best_is_no_symmetry() -> None:
    body = ([0.0, 0, 0], [60.0, 30, 20])
    beside = perturb(np.eye(4), np.array([0.8, -0.5, 0.3, 0.01, 0.015, -0.01]))
    assert find_symmetries(cuboids(body), np.eye(4), [beside]) == [None]


def test_points_are_led_onto_lines_by_the_step_of_least_squares() -> None:
    """Against the dense normal equations of x -> x + t + r x (x - middle), of which what runs along a line is free."""
    rng = np.random.default_rng(2)
    point, tangent, weight = rng.normal(0, 30, (2, 15, 3)), rng.normal(size=(2, 15, 3)), rng.uniform(0, 2, (2, 15))
    tangent /= np.linalg.norm(tangent, axis=2, keepdims=True)
    across = rng.normal(0, 0.5, (2, 15, 3))
    across -= np.einsum("kni,kni->kn", across, tangent)[..., None] * tangent
    middle = rng.normal(0, 5, (2, 3))
    for k, motion in enumerate(align_with_lines(point, tangent, across, weight, middle)):
        rows, sides = [], []
        for x, t, a, w in zip(point[k] - middle[k], tangent[k], across[k], weight[k], strict=True):
            flat = np.eye(3) - np.outer(t, t)
            rows.append(np.sqrt(w) * flat @ np.hstack([np.eye(3), np.cross(np.eye(3), x).T]))
            sides.append(-np.sqrt(w) * a)
        rows.append(np.diag(np.sqrt([1e-6] * 3 + [1e-3] * 3)))
        step = np.linalg.lstsq(np.concatenate(rows), np.concatenate([*sides, np.zeros(6)]), rcond=None)[0]
        rotation = rotation_matrix(step[3:])
        np.testing.assert_allclose(motion[:3, :3], rotation, atol=1e-9)
        np.testing.assert_allclose(motion[:3, :3] @ middle[k] + motion[:3, 3], middle[k] + step[:3], atol=1e-8)
        assert motion[3].tolist() == [0, 0, 0, 1]


def test_shapes_of_arcs_are_sums_over_their_samples() -> None:
    scene = box_scene([(np.array([10.0, -20, 5]), np.array([40.0, 30, 20])), (np.zeros(3), np.full(3, 8.0))])
    found = describe_arc_shapes(scene)
    assert found.arc.tolist() == list(range(24))
    for arc, length, middle, moment in zip(found.arc, found.length, found.middle, found.moment, strict=True):
        own = scene.sample_arc == arc
        size = [40.0, 30, 20, 8, 8, 8][arc // 12 * 3 + arc % 12 // 4]
        assert length == pytest.approx(size)
        np.testing.assert_allclose(middle, scene.sample_point[own].mean(axis=0))
        np.testing.assert_allclose(moment, np.outer(*[scene.sample_tangent[own][0]] * 2)[np.triu_indices(3)])


def test_displacements_carry_a_quarter_of_what_is_seen_best_first() -> None:
    """Three equal blocks in a row and one of another size: by one pitch two see their like, by two pitches one."""
    sizes = [np.array([40.0, 30, 20])] * 3 + [np.array([41.5, 31, 21])]
    scene = box_scene([(np.array([90.0 * i, 0, 0]), size) for i, size in enumerate(sizes)])
    shapes = describe_arc_shapes(scene)
    seen = scene.sample_arc < 24
    found = find_displacements(shapes, scene.sample_arc[seen], scene.sample_length[seen], 500.0)
    flat = [tuple(np.rint(d).astype(int).tolist()) for d in found]
    assert flat[0] == (90, 0, 0)  # both blocks that are seen go to the next
    along = [d[0] for d in flat if d[1:] == (0, 0)]
    assert {90, -90, 180} <= set(along) <= {90, -90, 180, 40, -40, 50, 130}
    assert all(np.linalg.norm(a - b) > 4 for i, a in enumerate(found) for b in found[:i])
    near = find_displacements(shapes, scene.sample_arc[seen], scene.sample_length[seen], 100.0)
    assert (np.linalg.norm(near, axis=1) < 100).all()
    assert not len(find_displacements(shapes, np.zeros(0, np.int64), np.zeros(0), 500.0))
