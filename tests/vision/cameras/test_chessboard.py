"""The calibration that docs/rig.md shows, on rendered chessboards of two known cameras."""

from __future__ import annotations

import re
from pathlib import Path

import cv2
import numpy as np
import pytest

from relmodel.geometry.transforms import inverse
from vision.cameras.cameras import Camera, Rig, perturb, perturbation
from vision.cameras.files import read_rig

PAGE = Path(__file__).parents[3] / "docs/rig.md"
SQUARE_PX, SIDE_MM = 40, 25.0


def draw_boards(rig: Rig, folder: Path, views: int) -> None:
    """Pictures of a board of 10 x 7 squares, each the mean of nine rays a pixel, with noise of one grey."""
    rng = np.random.default_rng(1)
    squares = (np.indices((9, 12)).sum(axis=0) % 2 == 0) * 190.0 + 30
    squares[[0, -1]] = squares[:, [0, -1]] = 220  # a white rim
    board = np.kron(squares, np.ones((SQUARE_PX, SQUARE_PX)))
    # The first inner corner is at (0, 0); it is the corner of the second square and the second row of them.
    mm_from_px = np.array([[SIDE_MM / SQUARE_PX, 0, -2 * SIDE_MM], [0, SIDE_MM / SQUARE_PX, -2 * SIDE_MM], [0, 0, 1]])
    mm_from_px[:2, 2] += 0.5 * SIDE_MM / SQUARE_PX
    for number in range(views):
        far = rng.uniform(450, 650)
        at = np.array([40 + rng.uniform(-0.06, 0.06) * far, rng.uniform(-0.06, 0.06) * far, far])
        middle = perturb(np.eye(4), np.concatenate([at, rng.uniform(-0.5, 0.5, 3)]))
        rig_from_board = perturb(middle, np.array([-4 * SIDE_MM, -2.5 * SIDE_MM, 0, 0, 0, 0]))
        for name, camera in rig.cameras.items():
            pose = inverse(rig.rig_from_camera[name]) @ rig_from_board
            finer = np.array([[3.0, 0, 1], [0, 3, 1], [0, 0, 1]]) @ camera.matrix
            seen = cv2.warpPerspective(
                board, finer @ pose[:3, [0, 1, 3]] @ mm_from_px, (3 * camera.width, 3 * camera.height), borderValue=90
            )
            grey = cv2.resize(seen, (camera.width, camera.height), interpolation=cv2.INTER_AREA)
            grey = np.clip(grey + rng.normal(0, 1, grey.shape), 0, 255).astype(np.uint8)
            cv2.imwrite(str(folder / f"{name}_{number:02}.png"), grey)


def test_the_page_calibrates_a_rig_within_its_sigmas(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    cameras = {
        "left": Camera(640, 480, np.array([[800.0, 0, 325], [0, 800, 236], [0, 0, 1]])),
        "right": Camera(640, 480, np.array([[806.0, 0, 316], [0, 806, 244], [0, 0, 1]])),
    }
    place = perturb(np.eye(4), np.array([110.0, 2, 5, 0.01, -0.18, 0.004]))
    rig = Rig(cameras, {"left": np.eye(4), "right": place})
    draw_boards(rig, tmp_path, 7)
    monkeypatch.chdir(tmp_path)
    (code,) = re.findall(r"^```python\n(.*?)^```", PAGE.read_text(), re.MULTILINE | re.DOTALL)
    assert sum(1 for line in code.splitlines() if line) < 24
    exec(compile(code, str(PAGE), "exec"), {})
    found = read_rig(tmp_path / "rig.yml")
    for name, camera in cameras.items():
        off, sigma = found.cameras[name].matrix - camera.matrix, found.sigma[name]
        focal = camera.matrix[0, 0]
        assert sigma.focal < 0.003
        assert np.abs(off[[0, 1], [0, 1]]).max() < 4 * sigma.focal * focal
        assert np.abs(off[:2, 2]).max() < 4 * sigma.centre_px
    moved = perturbation(place, found.rig_from_camera["right"])
    assert np.abs(moved[:3]).max() < 1.0
    assert np.abs(moved[3:]).max() < 4 * max(found.sigma["right"].rotation, 2e-4)
