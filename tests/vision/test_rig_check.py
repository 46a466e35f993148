"""What a rig can tell, against least squares by SciPy and closed forms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares

from relmodel.arrays import Floats
from relmodel.geometry.transforms import inverse
from tests.vision.localisation.scenes import stereo_rig
from vision import rig_check
from vision.cameras.cameras import CalibrationSigma, Camera, Rig, perturb
from vision.localisation.measurements import correct_rig
from vision.rig_check import LITTLE, check_rig

STATED = CalibrationSigma(0.001, 0.5, 0.1, 2e-4, 0.002)


def side_by_side(apart: float, turned: float = 0.0) -> Rig:
    """Two cameras of 1000 px, 1000 x 800, beside each other, the second turned towards the first."""
    camera = Camera(1000, 800, np.array([[1000.0, 0, 499.5], [0, 1000, 399.5], [0, 0, 1]]))
    right = perturb(np.eye(4), np.array([apart, 0, 0, 0, -turned, 0]))
    return Rig({"a": camera, "b": camera}, {"a": np.eye(4), "b": right})


def test_views_are_compared_in_closed_form() -> None:
    found = check_rig(side_by_side(300.0), 1000.0, {})
    # A shift of 300 of 1000 px at that distance.
    assert found.pairs["a and b"]["overlap"] == pytest.approx(0.7, abs=0.02)
    assert found.pairs["a and b"]["baseline_mm"] == 300
    assert found.pairs["a and b"]["vergence_deg"] == 0
    assert found.mm_per_px == {"a": 1.0, "b": 1.0}
    assert check_rig(side_by_side(300.0, 0.2), 1e3, {}).pairs["a and b"]["vergence_deg"] == pytest.approx(11.459, 1e-3)
    assert found.diameter_sigma_mm == pytest.approx(np.hypot(0.43, 10 * 0.002))
    assert found.unstated == ["a", "b"]
    assert not any("too little" in words for words in found.sentences())
    little = check_rig(side_by_side(800.0), 1000.0, {})
    assert little.pairs["a and b"]["overlap"] < LITTLE
    assert any("19% of the one's picture" in words and "too little" in words for words in little.sentences())


def seen_by(rig: Rig, points: Floats, pose: Floats) -> Floats:
    """Pixels (c n 2,) of points (n, 3), the rig moved by a perturbation (6,)."""
    out = []
    for name, camera in rig.cameras.items():
        at = inverse(perturb(np.eye(4), pose) @ rig.rig_from_camera[name])
        out.append(camera.project(points @ at[:3, :3].T + at[:3, 3])[0])
    return np.concatenate(out).ravel()


def test_an_error_that_is_believed_moves_the_pose_so_far() -> None:
    rig = stereo_rig()
    found = check_rig(rig, 600.0, {})
    grid = np.stack(np.meshgrid(np.linspace(-170, 170, 8), np.linspace(-120, 120, 8)), -1).reshape(-1, 2)
    points = np.column_stack([grid, 600 * (1 + 0.05 * np.resize([-1.0, 1.0, 0.5], 64))])
    own = np.zeros((2, 11))
    own[1, 3] = 1e-3
    truth = seen_by(correct_rig(rig, own), points, np.zeros(6))
    unit = np.repeat([1.0, 1e-3], 3)

    def left(x: Floats) -> Floats:
        return seen_by(rig, points, x * unit) - truth

    step = least_squares(left, np.zeros(6)).x * unit
    moved = np.linalg.norm(step[:3] + np.cross(step[3:], points.mean(axis=0)))
    assert found.errors["a focal length of right .1 % off"] == pytest.approx(moved, rel=0.3)
    assert found.errors["right turned by .1 degrees"] > 3 * found.errors["right .1 mm from its place"]


def test_what_is_stated_decides_how_well_a_pose_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    """One camera tells how far something flat is as well as it knows its focal length; a pair depends on it less."""
    rig = stereo_rig()
    exact = check_rig(rig, 600.0, {})
    stated = check_rig(replace(rig, sigma={name: STATED.at(p) for name, p in rig.rig_from_camera.items()}), 600.0, {})
    usual = check_rig(replace(rig, sigma={}), 600.0, {})
    assert exact.sigma_mm < stated.sigma_mm < usual.sigma_mm
    assert exact.sigma_mm < 0.1
    left = replace(rig.only("left"), sigma={"left": CalibrationSigma(focal=0.01)})
    monkeypatch.setattr(rig_check, "RELIEF", 0.0)
    alone = check_rig(left, 600.0, {})
    assert alone.sigma_mm == pytest.approx(6.0, rel=0.1)
    assert "z" in alone.weakest
    assert check_rig(left, 1200.0, {}).sigma_mm == pytest.approx(2 * alone.sigma_mm, rel=0.1)
    assert alone.pairs == {}
    assert alone.agreement is None
