"""The whole localisation on pictures whose pose is known: ray-cast boxes here, rendered bulkheads with the data."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from tests.vision.localisation.scenes import (
    above,
    blocks,
    bulkhead,
    bulkhead_rig,
    endless_blocks,
    off,
    picture,
    stereo_rig,
)
from vision.cameras import Prior, Rig, perturbation
from vision.extraction.extract import extract
from vision.localisation.localise import Localisation, localise
from vision.localisation.scene import Floats, Scene


def run(scene: Scene, rig: Rig, truth: Floats, prior: Prior, seed: int = 0) -> Localisation:
    images = {n: picture(scene, c, truth @ rig.rig_from_camera[n], seed) for n, c in rig.cameras.items()}
    return localise(scene, rig, images, {n: extract(i) for n, i in images.items()}, prior)


def error(found: Localisation, truth: Floats) -> Floats:
    assert found.best is not None
    return np.abs(perturbation(truth, found.best.refined.world_from_rig))


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_pose_of_unlike_blocks(seed: int) -> None:
    scene, truth = blocks(), above(10, -20, 560)
    found = run(scene, stereo_rig(), truth, off(truth, 20.0, np.radians(2), seed))
    assert found.verdict == "accepted", found.reason
    e = error(found, truth)
    assert e[:3].max() < 0.5
    assert e[3:].max() < np.radians(0.05)


def test_one_camera_alone() -> None:
    scene, truth, rig = blocks(), above(10, -20, 560), stereo_rig()
    found = run(scene, rig.only("left"), truth, off(truth, 12.0, np.radians(1.2), 5))
    assert found.verdict == "accepted", found.reason
    assert error(found, truth)[:3].max() < 0.5


def test_equal_blocks_are_ambiguous_and_the_true_cell_is_listed() -> None:
    pitch = 110.0
    scene, truth = endless_blocks(pitch), above(20, 15, 500)
    prior = Prior(truth @ np.diag([1.0, 1, 1, 1]), 40.0, np.radians(1.0))
    prior.world_from_rig[:3, 3] += [0.4 * pitch, 0, 0]
    found = run(scene, stereo_rig(), truth, prior)
    assert found.verdict == "ambiguous", found.reason
    shifts = [h.refined.world_from_rig[:3, 3] - truth[:3, 3] for h in found.hypotheses]
    assert min(np.linalg.norm(s) for s in shifts) < 1.0
    assert min(np.linalg.norm(s - [pitch, 0, 0]) for s in shifts) < 1.0


def test_tight_prior_picks_the_cell() -> None:
    scene, truth = endless_blocks(110.0), above(20, 15, 500)
    found = run(scene, stereo_rig(), truth, off(truth, 5.0, np.radians(0.3), 2))
    assert found.verdict == "accepted", found.reason
    assert error(found, truth)[:3].max() < 1.0


def test_pictures_of_something_else_are_refused() -> None:
    rig, truth = stereo_rig(), above(10, -20, 560)
    images = {n: picture(endless_blocks(77.0), c, truth @ rig.rig_from_camera[n], 0) for n, c in rig.cameras.items()}
    extractions = {n: extract(i) for n, i in images.items()}
    found = localise(blocks(), rig, images, extractions, off(truth, 20.0, np.radians(2), 1))
    assert found.verdict == "refused"


def test_nothing_in_view_is_refused() -> None:
    scene, truth = blocks(), above(10, -20, 560)
    away = Prior(truth @ np.diag([1.0, -1, -1, 1]), 5.0, 0.01)
    found = run(scene, stereo_rig(), truth, away)
    assert found.verdict == "refused"
    assert found.best is None


def test_equal_input_gives_equal_poses() -> None:
    scene, truth = blocks(), above(10, -20, 560)
    prior = off(truth, 12.0, np.radians(1.2), 6)
    first, second = (run(scene, stereo_rig(), truth, prior) for _ in range(2))
    assert first.best is not None
    assert second.best is not None
    assert np.array_equal(first.best.refined.world_from_rig, second.best.refined.world_from_rig)


def test_arcs_taken_lie_where_the_truth_projects_them() -> None:
    scene, truth, rig = blocks(), above(10, -20, 560), stereo_rig()
    found = run(scene, rig, truth, off(truth, 12.0, np.radians(1.2), 7))
    for view in found.views.values():
        c = view.correspondences
        taken = c.accepted
        assert len(np.unique(c.image_arc[taken])) == taken.sum()
        assert c.overlap[taken].sum() > 0.6 * view.arcs.length.sum()
        assert np.median(c.residual[taken]) < 0.4
        assert set(c.view_arc.tolist()) <= set(range(len(view.arcs.kind)))
        assert np.sqrt(np.average(view.measurements.residual**2, weights=view.measurements.weight)) < 0.3


@pytest.mark.data
@pytest.mark.parametrize(
    ("part", "pair", "prior", "verdict"), [("A", 0, "small", "accepted"), ("C", 0, "half_pitch", "ambiguous")]
)
def test_rendered_pair(data_dir: Path, part: str, pair: int, prior: str, verdict: str) -> None:
    import cv2

    folder = data_dir / "bulkhead" / part
    truth = json.loads((folder / "pairs" / f"pair_{pair:02d}_truth.json").read_text())
    rig, pose = bulkhead_rig(truth)
    images = {
        s: np.asarray(cv2.imread(str(folder / "pairs" / truth["cameras"][s]["image"]), cv2.IMREAD_GRAYSCALE), np.uint8)
        for s in rig.cameras
    }
    given = truth["priors"][prior]
    sigma = max(given["mm"] / np.sqrt(3), 1.0), np.radians(max(given["deg"] / np.sqrt(3), 0.5))
    start = Prior(np.array(given["T_world_cam_left"]), *map(float, sigma))
    found = localise(bulkhead(folder), rig, images, {n: extract(i) for n, i in images.items()}, start)
    assert found.verdict == verdict, found.reason
    errors = [np.abs(perturbation(pose, h.refined.world_from_rig)) for h in found.hypotheses]
    best = min(errors, key=lambda e: float(e[:3].max())) if verdict == "ambiguous" else errors[0]
    assert best[:3].max() < 0.5
    assert best[3:].max() < np.radians(0.03)
