"""The matcher on wireframes with known partners, by attributes alone."""

from __future__ import annotations

import numpy as np
import pytest

from tests.vision.stereo.scenes import Scene, picture_of, toed_in_rig, wireframe_scene
from vision.cameras.cameras import Rig
from vision.extraction.arcs import LINE
from vision.stereo.epipolar import StereoArcs, estimate_range, lay_out, rectify
from vision.stereo.match import StereoMatches, match_pictures
from vision.stereo.stereo_parameters import DEFAULTS


def match_arcs(rig: Rig, left: StereoArcs, right: StereoArcs) -> StereoMatches:
    return match_pictures(rig, picture_of(left), picture_of(right))


@pytest.fixture(scope="module", params=[1, 2, 3])
def scene(request: pytest.FixtureRequest) -> Scene:
    return wireframe_scene(toed_in_rig(), request.param)


def test_partners_are_found(scene: Scene) -> None:
    found = match_arcs(toed_in_rig(), scene.left, scene.right)
    label = found.arc_label
    real, made = scene.partner >= 0, label >= 0
    right = made & (label == scene.partner)
    assert right.sum() >= 0.93 * real.sum()
    assert right.sum() >= 0.95 * made.sum()


def test_the_range_holds_what_is_seen() -> None:
    """Without a word about depths: what is between 560 and 760 mm is looked for there, in a range that is no wider than
    a half of all."""
    rectification = rectify(toed_in_rig())
    for seed in (1, 2, 3):
        scene = wireframe_scene(toed_in_rig(), seed)
        sides = lay_out(rectification, scene.left, scene.right, DEFAULTS.epipolar)
        low, high = estimate_range(rectification, *sides, DEFAULTS.range, DEFAULTS.epipolar).of_crossings.T
        truth = rectification.focal * rectification.baseline / np.array([790.0, 520.0])
        assert np.mean((low <= truth[0] * 1.25) & (high >= truth[1] * 0.8)) > 0.95
        assert np.median(high - low) < 0.5 * rectification.focal


def test_the_labelling_is_proved(scene: Scene) -> None:
    result = match_arcs(toed_in_rig(), scene.left, scene.right).solved.result
    assert (result.status, result.cost) == ("optimal", result.bound)


def test_level_arcs_are_told_by_their_ends() -> None:
    """Three level lines above each other: no row votes, contrast, length and ends tell."""
    rig = toed_in_rig()
    x = np.linspace(300, 700, 401)
    rows = np.array([300.0, 480.0, 640.0])

    def lines(shift: float, order: list[int]) -> StereoArcs:
        rectified = [np.column_stack([x[: 401 - 100 * k] + shift, np.full(401 - 100 * k, rows[k])]) for k in order]
        return StereoArcs(
            offsets=np.concatenate([[0], np.cumsum([len(line) for line in rectified])]).astype(np.int64),
            points=np.concatenate(rectified),
            contrast=np.full(sum(len(line) for line in rectified), 40.0),
            kind=np.full(3, LINE),
            sigma=np.full(3, 0.1),
            width=np.full(3, 0.8),
        )

    straight = Rig(
        {
            name: type(rig.cameras[name])(1280, 960, np.array([[1300.0, 0, 640], [0, 1300, 480], [0, 0, 1]]))
            for name in rig.cameras
        },
        {"left": np.eye(4), "right": np.array([[1.0, 0, 0, 100], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])},
    )
    found = match_arcs(straight, lines(0.0, [0, 1, 2]), lines(-200.0, [2, 0, 1]))
    assert found.arc_label.tolist() == [1, 2, 0]
    sides = lay_out(rectify(straight), lines(0.0, [0, 1, 2]), lines(-200.0, [2, 0, 1]), DEFAULTS.epipolar)
    assert not sides[0].extent.any()


def test_pictures_without_arcs_are_matched_to_nothing() -> None:
    nothing = np.zeros(0)
    empty = StereoArcs(np.zeros(1, np.int64), np.zeros((0, 2)), nothing, nothing.astype(np.int64), nothing, nothing)
    rig = toed_in_rig()
    scene = wireframe_scene(rig, 1, arcs=5, clutter=0)
    for left, right in ((empty, empty), (scene.left, empty), (empty, scene.right)):
        found = match_arcs(rig, left, right)
        assert np.all(found.arc_label == -1)
        assert len(found.triangulated.first) == 0


def test_equal_input_gives_equal_rows() -> None:
    rig = toed_in_rig()
    scene = wireframe_scene(rig, 5)
    a, b = (match_arcs(rig, scene.left, scene.right) for _ in range(2))
    np.testing.assert_array_equal(a.solved.result.label, b.solved.result.label)
    np.testing.assert_array_equal(a.triangulated.covariance, b.triangulated.covariance)
