"""The whole localisation on pictures whose pose is known: ray-cast boxes here, rendered bulkheads with the data."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from relmodel.arrays import Bytes, Floats
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
from vision.cameras.cameras import Prior, Rig, perturb, perturbation
from vision.extraction.extract import extract
from vision.extraction.rows import Primitives, make_primitives
from vision.localisation.hypotheses import Perturbations, Stage
from vision.localisation.localise import Localisation, keep_worthy, localise, partner_odds, say_why_nothing
from vision.localisation.views import Observation
from vision.scene import Scene


@cache
def shown(name: str) -> tuple[Scene, Floats]:
    """A scene, and the pose of the stereo rig that pictures it."""
    if name == "endless":
        return endless_blocks(110.0), above(20, 15, 500)
    return {"blocks": blocks(), "others": endless_blocks(77.0)}[name], above(10, -20, 560)


@cache
def pictures(name: str) -> dict[str, Bytes]:
    """Pictures of a scene by camera."""
    (scene, truth), rig = shown(name), stereo_rig()
    return {n: picture(scene, c, truth @ rig.rig_from_camera[n], 0) for n, c in rig.cameras.items()}


@cache
def seen(name: str) -> dict[str, Primitives]:
    """What pictures of a scene hold, by camera."""
    return extracted(pictures(name))


def extracted(images: dict[str, Bytes]) -> dict[str, Primitives]:
    return {name: make_primitives(extract(image)) for name, image in images.items()}


@cache
def blocks_found() -> Localisation:
    scene, truth = shown("blocks")
    return localise(
        scene, Observation(stereo_rig(), seen("blocks"), pictures("blocks")), off(truth, 20.0, np.radians(2), 2)
    )


def error(found: Localisation, truth: Floats) -> Floats:
    assert found.best is not None
    return np.abs(perturbation(truth, found.best.world_from_rig))


def test_pose_of_unlike_blocks() -> None:
    found = blocks_found()
    assert found.verdict.verdict == "accepted", found.verdict.reason
    e = error(found, shown("blocks")[1])
    assert e[:3].max() < 0.5
    assert e[3:].max() < np.radians(0.05)


def test_a_wide_prior_is_searched_for_the_object_and_not_for_a_view_of_nothing() -> None:
    """A draw from which a climb on evidence that a look past the object leaves at zero ends 300 mm off."""
    scene, truth = shown("blocks")
    found = localise(
        scene, Observation(stereo_rig(), seen("blocks"), pictures("blocks")), off(truth, 100.0, np.radians(10), 3)
    )
    assert found.verdict.verdict == "accepted", found.verdict.reason
    assert error(found, truth)[:3].max() < 0.5


def test_one_camera_alone() -> None:
    (scene, truth), rig = shown("blocks"), stereo_rig()
    extractions = seen("blocks")
    prior = off(truth, 12.0, np.radians(1.2), 5)
    found = localise(scene, Observation(rig.only("left"), {"left": extractions["left"]}, pictures("blocks")), prior)
    assert found.verdict.verdict == "accepted", found.verdict.reason
    assert error(found, truth)[:3].max() < 0.5


def test_equal_blocks_are_ambiguous_and_the_true_cell_is_listed() -> None:
    pitch = 110.0
    scene, truth = shown("endless")
    prior = Prior.isotropic(truth.copy(), 40.0, np.radians(1.0))
    prior.world_from_rig[:3, 3] += [0.4 * pitch, 0, 0]
    found = localise(scene, Observation(stereo_rig(), seen("endless"), pictures("endless")), prior)
    assert found.verdict.verdict == "ambiguous", found.verdict.reason
    shifts = [h.world_from_rig[:3, 3] - truth[:3, 3] for h in found.hypotheses]
    assert min(np.linalg.norm(s) for s in shifts) < 1.0
    assert min(np.linalg.norm(s - [pitch, 0, 0]) for s in shifts) < 1.0


def test_tight_prior_picks_the_cell() -> None:
    scene, truth = shown("endless")
    found = localise(
        scene, Observation(stereo_rig(), seen("endless"), pictures("endless")), off(truth, 5.0, np.radians(0.3), 2)
    )
    assert found.verdict.verdict == "accepted", found.verdict.reason
    assert error(found, truth)[:3].max() < 1.0


def test_pictures_of_something_else_are_refused() -> None:
    scene, truth = shown("blocks")
    found = localise(
        scene, Observation(stereo_rig(), seen("others"), pictures("others")), off(truth, 20.0, np.radians(2), 1)
    )
    assert found.verdict.verdict == "refused"


def test_nothing_in_view_is_refused() -> None:
    scene, truth = shown("blocks")
    away = Prior.isotropic(truth @ np.diag([1.0, -1, -1, 1]), 5.0, 0.01)
    found = localise(scene, Observation(stereo_rig(), seen("blocks"), pictures("blocks")), away)
    assert found.verdict.verdict == "refused"
    assert found.best is None


def test_measured_elements_lie_where_the_truth_projects_them() -> None:
    for view in blocks_found().views.values():
        assert np.sqrt(np.average(view.measurements.residual**2, weights=view.measurements.weight)) < 0.3


@pytest.mark.data
def test_rendered_pair(data_dir: Path) -> None:
    import cv2

    folder = data_dir / "bulkhead/A"
    truth = json.loads((folder / "pairs" / "pair_00_truth.json").read_text())
    rig, pose = bulkhead_rig(truth)
    images = {
        s: np.asarray(cv2.imread(str(folder / "pairs" / truth["cameras"][s]["image"]), cv2.IMREAD_GRAYSCALE), np.uint8)
        for s in rig.cameras
    }
    given = truth["priors"]["small"]
    sigma = max(given["mm"] / np.sqrt(3), 1.0), np.radians(max(given["deg"] / np.sqrt(3), 0.5))
    start = Prior.isotropic(np.array(given["T_world_cam_left"]), *map(float, sigma))
    found = localise(bulkhead(folder), Observation(rig, extracted(images), images), start)
    assert found.verdict.verdict == "accepted", found.verdict.reason
    off = error(found, pose)
    assert off[:3].max() < 0.5
    assert off[3:].max() < np.radians(0.03)


def test_starts_go_on_that_explain_half_of_what_the_best_does() -> None:
    """Under a prior those too that explain enough for its volume not to be scanned."""
    stage = Stage("join", np.zeros((3, 6)), np.array([0.8, 0.4, 0.39]), ["goes_on"] * 3, 9)
    starts = Perturbations(np.arange(18.0).reshape(3, 6), np.array([0.8, 0.4, 0.39]), [stage], enough=0.5)
    some = keep_worthy(starts, Prior.open(np.eye(4)))
    assert some.score.tolist() == [0.8, 0.4]
    assert some.delta.tolist() == starts.delta[:2].tolist()
    assert some.stages[0].rule == ["goes_on", "goes_on", "little_evidence"]
    few = keep_worthy(starts, Prior.isotropic(np.eye(4), 5.0, 0.01))
    assert few.score.tolist() == [0.8]
    assert few.stages[0].rule == ["goes_on", "little_evidence", "little_evidence"]
    enough = replace(starts, enough=0.8)
    assert keep_worthy(enough, Prior.isotropic(np.eye(4), 5.0, 0.01)).score.tolist() == [0.8]


def test_elements_of_arcs_with_a_partner_are_likelier_of_the_object() -> None:
    picture = SimpleNamespace(elements=SimpleNamespace(arc=np.array([1, -1, 0, 2, 1])))
    found = partner_odds(cast(Primitives, picture), np.array([False, True, True]))
    assert found.tolist() == [1.1, 0.0, -0.63, 1.1, 1.1]


@pytest.mark.parametrize(
    ("cameras", "open_", "joined", "words"),
    [
        (("left", "right"), False, False, "no arc of the model is in view near the prior"),
        (
            ("left", "right"),
            True,
            True,
            "the edges of the pictures speak against each pose that the circles and straight",
        ),
        (("left", "right"), True, False, "too few circles and straight edges of the pictures lie to each other"),
        (
            ("left",),
            True,
            True,
            "the edges of the picture speak against each pose that the circles give: give a prior or",
        ),
        (("left",), True, False, "too few circles of the picture lie to each other"),
    ],
)
def test_why_there_is_no_pose_is_said(cameras: tuple[str, ...], open_: bool, joined: bool, words: str) -> None:
    prior = Prior.open(np.eye(4)) if open_ else Prior.isotropic(np.eye(4), 5.0, 0.01)
    assert say_why_nothing(stereo_rig().only(*cameras), prior, joined).startswith(words)


def test_the_world_and_the_order_and_names_of_cameras_do_not_matter() -> None:
    """The blocks elsewhere, turned, by cameras in the other order: the same pose of the same left camera, as sure."""
    found, (scene, truth), rig = blocks_found(), shown("blocks"), stereo_rig()
    moved = perturb(np.eye(4), np.array([900.0, -300, 70, 0.8, -0.5, 1.9]))

    def carried(points: Floats) -> Floats:
        return points @ moved[:3, :3].T + moved[:3, 3]

    ways = ("vertex_normals", "sample_tangent", "sample_normal_a", "sample_normal_b")
    elsewhere = replace(
        scene,
        vertices=carried(scene.vertices),
        sample_point=carried(scene.sample_point),
        **{name: getattr(scene, name) @ moved[:3, :3].T for name in ways},
    )
    names = {"b": "right", "a": "left"}
    cameras = {new: rig.cameras[old] for new, old in names.items()}
    renamed = Rig(
        cameras,
        {new: rig.rig_from_camera[old] for new, old in names.items()},
        {new: rig.sigma[old] for new, old in names.items()},
    )
    primitives = {new: seen("blocks")[old] for new, old in names.items()}
    greys = {new: pictures("blocks")[old] for new, old in names.items()}
    prior = off(truth, 20.0, np.radians(2), 2)
    again = localise(
        elsewhere, Observation(renamed, primitives, greys), replace(prior, world_from_rig=moved @ prior.world_from_rig)
    )
    assert found.best is not None
    assert again.best is not None
    assert again.verdict.verdict == found.verdict.verdict == "accepted"
    apart = perturbation(moved @ found.best.world_from_rig, again.best.world_from_rig)
    assert apart @ np.linalg.solve(found.best.covariance, apart) < 0.3
    np.testing.assert_allclose(again.verdict.sigma_mm, found.verdict.sigma_mm, rtol=0.1)
    np.testing.assert_allclose(again.best.support.by_camera[::-1], found.best.support.by_camera, rtol=0.05)
    assert again.verdict.posterior == pytest.approx(found.verdict.posterior, abs=0.01)
