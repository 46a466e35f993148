"""The matcher on wireframes with known partners."""

from __future__ import annotations

import numpy as np
import pytest

from tests.vision.stereo.scenes import Scene, toed_in_rig, wireframe_scene
from vision.stereo.epipolar import DepthRange, StereoArcs
from vision.stereo.match import StereoMatches, match_arcs

RANGE = DepthRange(520.0, 800.0)


@pytest.fixture(scope="module", params=[1, 2, 3])
def case(request: pytest.FixtureRequest) -> tuple[Scene, StereoMatches]:
    rig = toed_in_rig()
    scene = wireframe_scene(rig, request.param)
    return scene, match_arcs(rig, scene.left, scene.right, RANGE)


def test_partners_are_found(case: tuple[Scene, StereoMatches]) -> None:
    scene, found = case
    label = found.assignment.label
    real, made = scene.partner >= 0, label >= 0
    right = made & (label == scene.partner)
    assert right.sum() >= 0.95 * real.sum()
    assert right.sum() >= 0.95 * made.sum()
    np.testing.assert_array_equal(made, found.reason == "matched")


def test_the_assignment_is_proved(case: tuple[Scene, StereoMatches]) -> None:
    _, found = case
    a, c = found.assignment, found.candidates
    assert np.all(c.cost - a.unit_dual[c.left] - a.label_dual[c.right] >= -1e-9)
    assert np.all(a.unit_dual <= found.parameters.segments.null_cost)
    assert a.cost == pytest.approx(a.bound, abs=1e-9)


def test_clutter_is_marked(case: tuple[Scene, StereoMatches]) -> None:
    scene, found = case
    clutter = (scene.partner < 0) & found.left_votable
    assert found.left_unmatched[clutter].mean() > 0.85
    assert found.left_unmatched[scene.partner >= 0].mean() < 0.05
    on_right = np.ones(len(scene.right), bool)
    on_right[scene.partner[scene.partner >= 0]] = False
    assert found.right_unmatched[on_right & found.right_votable].mean() > 0.85


def test_arcs_lie_where_they_are_in_space(case: tuple[Scene, StereoMatches]) -> None:
    """Lateral error well below a millimetre, and no error beyond what its sigma says."""
    scene, found = case
    space = found.triangulated
    lines = 0
    for k, left in enumerate(space.left.tolist()):
        polyline = scene.polyline[left]
        if polyline is None or scene.partner[left] != space.right[k] or not scene.left.straight[left]:
            continue
        lines += 1
        way = (polyline[-1] - polyline[0]) / np.linalg.norm(polyline[-1] - polyline[0])
        for end in (space.start[k], space.end[k]):
            off = end - polyline[0]
            off -= (off @ way) * way
            assert np.linalg.norm(off) < 4 * space.sigma[k]
            assert -2 < (end - polyline[0]) @ way < np.linalg.norm(polyline[-1] - polyline[0]) + 2
        # The ends stand in the walk of the left arc.
        walk = scene.left.points[scene.left.offsets[left + 1] - 1] - scene.left.points[scene.left.offsets[left]]
        assert (space.end[k] - space.start[k])[:2] @ walk > 0
    assert lines > 30


def test_level_arcs_are_left_out_and_not_marked() -> None:
    rig = toed_in_rig()
    x = np.linspace(300, 900, 601)
    level = StereoArcs(
        offsets=np.array([0, 601]),
        points=np.stack([x, np.full(601, 480.0)], axis=1),
        contrast=np.full(601, 40.0),
        sigma=np.array([0.1]),
        straight=np.array([True]),
    )
    found = match_arcs(rig, level, level, RANGE)
    assert not found.left_votable[0]
    assert not found.left_unmatched[0]
    assert found.reason.tolist() == ["no_candidate"]


def test_pictures_without_arcs_are_matched_to_nothing() -> None:
    empty = StereoArcs(np.zeros(1, np.int64), np.zeros((0, 2)), np.zeros(0), np.zeros(0), np.zeros(0, bool))
    rig = toed_in_rig()
    scene = wireframe_scene(rig, 1, arcs=5, clutter=0)
    for left, right in ((empty, empty), (scene.left, empty), (empty, scene.right)):
        found = match_arcs(rig, left, right, RANGE)
        assert np.all(found.assignment.label == -1)
        assert len(found.triangulated.left) == 0


def test_equal_input_gives_equal_rows() -> None:
    rig = toed_in_rig()
    scene = wireframe_scene(rig, 5)
    a, b = (match_arcs(rig, scene.left, scene.right, RANGE) for _ in range(2))
    np.testing.assert_array_equal(a.assignment.label, b.assignment.label)
    np.testing.assert_array_equal(a.triangulated.points, b.triangulated.points)
