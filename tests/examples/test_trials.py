"""The list of trials, what is drawn from it, and its truth, against closed forms; no renderer."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest
import yaml

pytest.importorskip("OCP")

from examples.render import trials
from examples.render.files import truth_data
from examples.render.model import Component, Part
from examples.render.truth import Caster
from examples.render.views import Camera, Shot


def cuboid(name: str, low: tuple[float, float, float], high: tuple[float, float, float]) -> Component:
    """A box of twelve triangles, without help of the kernel."""
    corners = np.array([[(low, high)[i >> k & 1][k] for k in range(3)] for i in range(8)], float)
    quads = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    triangles = np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))])
    part = Part(name, corners, np.zeros((8, 3)), triangles, np.zeros(8, int))
    return Component(name, part, np.eye(4))


def from_above(distance: float) -> Shot:
    """One camera that looks straight down on the origin."""
    pose = np.diag([1.0, -1.0, -1.0, 1.0])
    pose[2, 3] = distance
    camera = Camera(400.0, (159.5, 119.5), size=(320, 240))
    return Shot({"left": camera}, {"left": pose}, np.zeros(3), np.array([0, 0, 1.0]), distance)


def centres_within(half_x: float, half_y: float) -> int:
    """Pixel centres of a 320 x 240 picture within a rectangle about its middle, by counting."""
    x, y = (np.abs(np.arange(n) - (n - 1) / 2) <= half for n, half in ((320, half_x), (240, half_y)))
    return int(x.sum() * y.sum())


def test_visible_pixels_of_a_cuboid_are_those_within_its_outline() -> None:
    block = cuboid("BLOCK", (-30, -20, 0), (30, 20, 40))
    behind = cuboid("FLOOR", (-60, -50, -10), (60, 50, 0))
    view = from_above(400.0)
    truth = truth_data("x", {}, view, [block, behind], Caster([block, behind]), np.eye(4))
    upper, lower = (row["left"] for row in truth["parts_in_view"])
    # The top at 360 mm from the camera hides its own sides; 400 / 360 pixels a millimetre.
    scale, floor = 400.0 / 360.0, 400.0 / 400.0
    assert upper["visible_px"] == upper["unoccluded_px"] == centres_within(30 * scale, 20 * scale)
    whole = centres_within(60 * floor, 50 * floor)
    assert lower["unoccluded_px"] == whole
    assert lower["visible_px"] == whole - upper["visible_px"]
    assert truth["cameras"]["left"]["background_share"] == pytest.approx(1 - whole / (320 * 240), abs=1e-5)


def test_the_files_of_a_trial_agree(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "argv", ["trials", str(tmp_path), "--only", "small_01", "--data-only"])
    trials.main()
    folder = tmp_path / "small"
    truth = json.loads((folder / "small_01_truth.json").read_text())
    rig, prior, world = (yaml.safe_load((folder / f"small_01_{n}.yaml").read_text()) for n in ("rig", "prior", "world"))
    assert (folder / truth["model"]).exists()
    (item,) = world["objects"]
    np.testing.assert_allclose(item["world_from_object"], truth["world_from_object"], atol=1e-12)
    for side, row in truth["cameras"].items():
        pose = np.array(truth["world_from_rig"]) @ np.array(rig["cameras"][side]["rig_from_camera"])
        np.testing.assert_allclose(pose, row["world_from_camera"], atol=1e-9)
        camera_from_object = np.linalg.inv(pose) @ np.array(truth["world_from_object"])
        turn, _ = cv2.Rodrigues(camera_from_object[:3, :3])
        target = np.array([truth["target_in_object"]])
        matrix, bent = np.array(row["matrix"]), np.array(row["distortion"])
        found, _ = cv2.projectPoints(target, turn, camera_from_object[:3, 3], matrix, bent)
        np.testing.assert_allclose(np.array(found).ravel(), row["target_pixel"], atol=1e-3)
    error = np.linalg.inv(truth["world_from_rig"]) @ np.array(prior["world_from_rig"])
    assert 0.5 < np.linalg.norm(error[:3, 3]) < 40
    before = (folder / "small_01_truth.json").stat().st_mtime_ns
    trials.main()  # what is there is left alone
    assert (folder / "small_01_truth.json").stat().st_mtime_ns == before
