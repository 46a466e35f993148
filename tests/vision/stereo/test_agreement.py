"""Pictures that contradict their rig, on drawn points of known places and on shifted texture."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from relmodel.arrays import Floats
from relmodel.geometry.transforms import inverse
from vision.cameras.cameras import Camera, Rig, perturb
from vision.stereo.agreement import (
    SharedPoints,
    doubt_rig,
    doubt_unit,
    find_shared_points,
    measure_agreement,
    scale_focal,
)

DISTORTION = np.array([-0.1, 0.02, 0.001, -0.001, 0.0])


def stereo_rig() -> Rig:
    cameras = {
        "a": Camera(1280, 960, np.array([[1490.0, 0, 640], [0, 1490, 470], [0, 0, 1]]), DISTORTION),
        "b": Camera(1280, 960, np.array([[1480.0, 0, 630], [0, 1485, 490], [0, 0, 1]])),
    }
    return Rig(cameras, {"a": np.eye(4), "b": perturb(np.eye(4), np.array([220.0, 3, 15, 0.01, -0.2, 0.005]))})


def shown(rig: Rig, count: int = 120, wrong: int = 120, seed: int = 1) -> SharedPoints:
    """Points 700 to 1100 mm off by both cameras of a rig, .3 px off, among others that each picture shows alone."""
    rng = np.random.default_rng(seed)
    middle = np.array([110.0, 0, 900])
    points = middle + rng.uniform(-1, 1, (count, 3)) * [200, 150, 200]
    seen = []
    for name, camera in rig.cameras.items():
        from_rig = inverse(rig.rig_from_camera[name])
        pixels, _ = camera.project(points @ from_rig[:3, :3].T + from_rig[:3, 3])
        pixels = camera.undistort(pixels) + rng.normal(0, 0.3, pixels.shape)
        seen.append(np.concatenate([pixels, rng.uniform([0, 0], [1280, 960], (wrong, 2))]))
    return SharedPoints(*seen)


def inverted(rig: Rig) -> Rig:
    return replace(rig, rig_from_camera={name: inverse(pose) for name, pose in rig.rig_from_camera.items()})


def zoomed(rig: Rig, names: str, share: float) -> Rig:
    return replace(rig, cameras=rig.cameras | {name: scale_focal(rig.cameras[name], share) for name in names})


def turned(rig: Rig, angle: float) -> Rig:
    pose = perturb(rig.rig_from_camera["b"], np.array([0, 0, 0, angle, 0, 0]))
    return replace(rig, rig_from_camera=rig.rig_from_camera | {"b": pose})


def test_points_lie_along_their_lines_in_front_of_both_cameras() -> None:
    found = measure_agreement(stereo_rig(), shown(stereo_rig()))
    assert found.points == 240
    assert found.near == pytest.approx(0.5, abs=0.03)
    assert found.distance_mm == pytest.approx(900, abs=60)
    # A point on its line has a density of .25 of a normal one beside .0075 anywhere.
    assert found.log_odds == pytest.approx(120 * np.log(1 + 0.25 / (0.7 * np.sqrt(2 * np.pi)) / 0.0075), rel=0.06)
    behind = shown(inverted(stereo_rig()), wrong=0)
    assert measure_agreement(stereo_rig(), behind).near < 0.2


@pytest.mark.parametrize(
    ("truth", "words"),
    [
        (inverted(stereo_rig()), "50% would if its poses are camera_from_rig: invert them"),
        (zoomed(stereo_rig(), "b", 1.02), "with a focal length of b 2.0% greater: is its picture scaled"),
        (zoomed(stereo_rig(), "b", 0.95), "with a focal length of b 5.0% less: is its picture scaled"),
        (zoomed(stereo_rig(), "ab", 1.07), "% greater: are the pictures scaled"),
        (turned(stereo_rig(), 0.004), "with b turned by 0.23 degrees about its x axis: was it moved?"),
    ],
)
def test_what_explains_the_points_best_is_said(truth: Rig, words: str) -> None:
    said = doubt_rig(stereo_rig(), shown(truth))
    assert said is not None
    assert said.startswith("of 240 points that both pictures show ")
    assert words in said


def test_exchanged_pictures_are_told() -> None:
    rig = stereo_rig()
    points = shown(rig)
    said = doubt_rig(rig, SharedPoints(points.other, points.one))
    assert said is not None
    assert "if a and b are each other's: exchange their pictures" in said


def test_a_right_rig_is_not_doubted_nor_one_of_which_little_is_known() -> None:
    rig, seed = stereo_rig(), 0
    assert doubt_rig(rig, shown(rig, seed=seed)) is None
    assert doubt_rig(zoomed(rig, "b", 1.002), shown(rig, seed=seed)) is None
    assert doubt_rig(rig, shown(rig, 0, 300, seed)) is None  # pictures of different things
    assert doubt_rig(inverted(rig), shown(rig, 25, 4, seed)) is None
    assert doubt_rig(inverted(rig), shown(rig, 60, 0, seed)) is not None


@pytest.mark.parametrize(("by", "doubted"), [(1.0, False), (0.1, True), (1 / 25.4, True), (12.0, False), (90.0, True)])
def test_another_unit_of_the_rig_is_told_by_how_large_things_are(by: float, doubted: bool) -> None:
    """Points 900 mm off of something 3 m large: pictures that show .8 m of it, 80 mm, 30 mm, 9 m or 70 m."""
    rig = stereo_rig()
    poses = {name: pose.copy() for name, pose in rig.rig_from_camera.items()}
    poses["b"][:3, 3] *= by
    said = doubt_unit(replace(rig, rig_from_camera=poses), shown(rig), 3000.0)
    assert (said is not None) == doubted
    if said is not None:
        assert "where the object is 3000 mm large: is the file in another unit" in said
    assert doubt_unit(replace(rig, rig_from_camera=poses), shown(rig, 25, 4), 3000.0) is None  # too few to tell


def test_shared_points_are_those_of_a_shifted_texture() -> None:
    rng = np.random.default_rng(2)
    texture = gaussian_filter(rng.normal(0, 1, (300, 460)), 2.0)
    texture = 120 + 50 * texture / texture.std()
    rig = Rig({n: Camera(400, 300, np.diag([500.0, 500, 1])) for n in "ab"}, dict.fromkeys("ab", np.eye(4)))

    def pictures(shift: int) -> dict[str, Floats]:
        return {"a": texture[:, :400], "b": texture[:, shift : shift + 400]}

    found = find_shared_points(pictures(23), rig)
    assert len(found.one) > 100
    assert np.median(np.abs(found.one - found.other - [23, 0]).max(axis=1)) < 0.1
    assert np.mean(np.abs(found.one - found.other - [23, 0]).max(axis=1) < 1) > 0.95
    blank = find_shared_points({"a": np.full((300, 400), 90.0), "b": texture[:, :400]}, rig)
    assert blank.one.shape == blank.other.shape == (0, 2)
