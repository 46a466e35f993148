"""The scale of drawn edges of known magnification against what a prior predicts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.vision.localisation.scenes import above, blocks, off, stereo_rig
from tests.vision.localisation.simulation import Errors, draw_edges
from vision.cameras.cameras import Prior, Rig
from vision.extraction.rows import Primitives
from vision.localisation import magnification
from vision.localisation.hypotheses import predict
from vision.localisation.magnification import doubt_scale, measure_magnification
from vision.localisation.views import Observation


def cut(rig: Rig, scale: float, middle: tuple[float, float]) -> Rig:
    """The left camera as its pictures show it that were enlarged about a pixel."""
    camera = rig.cameras["left"]
    matrix = np.diag([scale, scale, 1.0]) @ camera.matrix
    matrix[:2, 2] += (1 - scale) * np.array(middle)
    return Rig({"left": replace(camera, matrix=matrix)}, {"left": np.eye(4)})


@pytest.mark.parametrize(("scale", "middle"), [(1.1, (150.0, 300.0)), (1.4, (500.0, 120.0))])
def test_a_cut_is_told_by_its_scale_wherever_it_was_cut(scale: float, middle: tuple[float, float]) -> None:
    scene, rig, truth = blocks(), stereo_rig().only("left"), above(10, -20, 560)
    edges = draw_edges(scene, cut(rig, scale, middle), truth, Errors(), np.random.default_rng(3))["left"]
    near = off(truth, 6.0, 0.01, 4).world_from_rig
    found, gain = measure_magnification(predict(scene, rig, near, 2000, 200.0), edges)
    assert found == pytest.approx(scale, rel=0.03)
    assert gain > 1.3


def test_a_good_picture_and_one_of_nothing_are_not_told_to_be_cut() -> None:
    scene, rig, truth = blocks(), stereo_rig().only("left"), above(10, -20, 560)
    edges = draw_edges(scene, rig, truth, Errors(), np.random.default_rng(3))["left"]
    near = off(truth, 8.0, 0.01, 4).world_from_rig
    assert measure_magnification(predict(scene, rig, near, 2000, 200.0), edges)[1] < 1.1
    clutter = replace(edges, position=edges.position[-3000:], normal=edges.normal[-3000:])
    assert measure_magnification(predict(scene, rig, truth, 2000, 200.0), clutter)[1] < 1.3


@pytest.mark.parametrize(("sigma_mm", "told"), [(10.0, True), (40.0, False)])
def test_a_cut_is_only_told_where_the_prior_holds_the_distance(
    sigma_mm: float, told: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene, rig, truth = blocks(), stereo_rig().only("left"), above(10, -20, 560)
    edges = draw_edges(scene, cut(rig, 1.25, (320, 240)), truth, Errors(), np.random.default_rng(3))["left"]
    monkeypatch.setattr(magnification, "collect_edge_points", lambda *_: edges)
    seen = Observation(rig, dict.fromkeys(["left"], Primitives.__new__(Primitives)), {"left": np.zeros((2, 2))})
    said = doubt_scale(scene, seen, Prior.isotropic(truth, sigma_mm, 0.01))
    assert (said is not None) == told
    if said is not None:
        assert "the picture of camera left shows the model 1.2" in said
