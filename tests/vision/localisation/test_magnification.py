"""The scale of drawn edges of known magnification against what a prior predicts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.vision.localisation.scenes import above, blocks, off, stereo_rig, thinned
from tests.vision.localisation.simulation import Errors, draw_edges
from vision.cameras.cameras import Prior, Rig
from vision.extraction.rows import Primitives
from vision.localisation import magnification
from vision.localisation.hypotheses import EdgePoints, predict
from vision.localisation.magnification import doubt_scale, measure_magnification
from vision.localisation.views import Observation


def cut(rig: Rig, scale: float, middle: tuple[float, float]) -> Rig:
    """The left camera as its pictures show it that were enlarged about a pixel."""
    camera = rig.cameras["left"]
    matrix = np.diag([scale, scale, 1.0]) @ camera.matrix
    matrix[:2, 2] += (1 - scale) * np.array(middle)
    return Rig({"left": replace(camera, matrix=matrix)}, {"left": np.eye(4)})


SCENE, RIG, TRUTH = thinned(blocks(5), 3), stereo_rig().only("left"), above(10, -20, 560)


def drawn(rig: Rig) -> EdgePoints:
    return draw_edges(SCENE, rig, TRUTH, Errors(), np.random.default_rng(3))["left"]


def test_a_cut_is_told_by_its_scale_and_a_good_picture_and_one_of_nothing_are_none() -> None:
    near = predict(SCENE, RIG, off(TRUTH, 6.0, 0.01, 4).world_from_rig, 2000, 200.0)
    found, gain = measure_magnification(near, drawn(cut(RIG, 1.4, (500.0, 120.0))))
    assert found == pytest.approx(1.4, rel=0.03)
    assert gain > 1.3
    edges = drawn(RIG)
    assert measure_magnification(near, edges)[1] < 1.1
    clutter = replace(edges, position=edges.position[-3000:], normal=edges.normal[-3000:])
    assert measure_magnification(predict(SCENE, RIG, TRUTH, 2000, 200.0), clutter)[1] < 1.3


def test_a_cut_is_only_told_where_the_prior_holds_the_distance(monkeypatch: pytest.MonkeyPatch) -> None:
    edges = drawn(cut(RIG, 1.25, (320, 240)))
    monkeypatch.setattr(magnification, "collect_edge_points", lambda *_: edges)
    seen = Observation(RIG, dict.fromkeys(["left"], Primitives.__new__(Primitives)), {"left": np.zeros((2, 2))})
    said = doubt_scale(SCENE, seen, Prior.isotropic(TRUTH, 10.0, 0.01))
    assert said is not None
    assert "the picture of camera left shows the model 1.2" in said
    assert doubt_scale(SCENE, seen, Prior.isotropic(TRUTH, 40.0, 0.01)) is None
