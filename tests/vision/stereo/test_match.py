"""The matcher on wireframes with known partners."""

from __future__ import annotations

import numpy as np
import pytest

from tests.vision.stereo.scenes import Scene, toed_in_rig, wireframe_scene
from vision.extraction.arcs import LINE
from vision.stereo.crossings import StereoArcs
from vision.stereo.epipolar import DepthRange
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


def test_level_arcs_are_left_out_and_not_marked() -> None:
    rig = toed_in_rig()
    x = np.linspace(300, 900, 601)
    level = StereoArcs(
        offsets=np.array([0, 601]),
        points=np.stack([x, np.full(601, 480.0)], axis=1),
        contrast=np.full(601, 40.0),
        sigma=np.array([0.1]),
        kind=np.array([LINE]),
        width=np.array([0.8]),
    )
    found = match_arcs(rig, level, level, RANGE)
    assert not found.left_votable[0]
    assert not found.left_unmatched[0]
    assert found.reason.tolist() == ["no_candidate"]


def test_pictures_without_arcs_are_matched_to_nothing() -> None:
    nothing = np.zeros(0)
    empty = StereoArcs(np.zeros(1, np.int64), np.zeros((0, 2)), nothing, nothing.astype(np.int64), nothing, nothing)
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
    np.testing.assert_array_equal(a.triangulated.covariance, b.triangulated.covariance)
