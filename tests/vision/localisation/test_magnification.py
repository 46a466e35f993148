"""The scale of drawn edges of known magnification against what a prior predicts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from relmodel.arrays import Floats
from tests.vision.localisation.scenes import above, blocks, off, stereo_rig
from tests.vision.localisation.simulation import Errors, draw_edges
from vision.cameras.cameras import Prior, Rig
from vision.extraction.rows import Primitives
from vision.localisation import magnification
from vision.localisation.hypotheses import EdgePoints, Prediction, predict, project_directions, project_with_jacobians
from vision.localisation.magnification import doubt_scale, measure_magnification
from vision.localisation.views import Observation


def cut(rig: Rig, scale: float, middle: tuple[float, float]) -> Rig:
    """The left camera as its pictures show it that were enlarged about a pixel."""
    camera = rig.cameras["left"]
    matrix = np.diag([scale, scale, 1.0]) @ camera.matrix
    matrix[:2, 2] += (1 - scale) * np.array(middle)
    return Rig({"left": replace(camera, matrix=matrix)}, {"left": np.eye(4)})


@pytest.mark.parametrize(("middle", "scale"), [((320.0, 240.0), 1.1), ((150.0, 300.0), 1.25), ((500.0, 120.0), 1.4)])
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
    for mm in (0.0, 8.0):
        near = off(truth, mm, 0.01, 4).world_from_rig
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


def test_edges_are_correlated_at_each_scale_by_direction() -> None:
    """Against grids laid by hand, blurred, and correlated in the picture's plane at every shift."""
    rng, n = np.random.default_rng(2), 60
    low, high = np.array([6.0, 6]), np.array([105.0, 77])
    place, angle = rng.uniform(low, high, (n, 2)), rng.uniform(0, 2 * np.pi, n)
    rays = np.column_stack([(place - [55, 40]) / 300 / 1.2, np.ones(n)]) * 500
    way, weight = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle]), rng.uniform(0.2, 2, n)
    none = np.zeros(n, np.int64)
    p = Prediction(rays, way, weight, np.zeros(n), none, none, np.eye(3)[None], np.zeros((1, 3)),
                   np.array([[[300.0, 0, 55], [0, 300, 40]]]))  # fmt: skip
    along = project_directions(p)
    found = rng.permutation(n)[:45]
    normal = np.column_stack([along[:, 1], -along[:, 0]])[found]
    clutter, turn = rng.uniform(low, high, (40, 2)), rng.uniform(0, 6, 40)
    normal = np.concatenate([normal, np.column_stack([np.cos(turn), np.sin(turn)])])
    edges = EdgePoints(np.concatenate([place[found], clutter]), normal, np.ones(85), np.ones(85), low, high, 200.0)
    rows, columns = int(np.ceil(71 / 4)) + 1, int(np.ceil(99 / 4)) + 1

    def lay(at: Floats, way: Floats, weight: Floats) -> Floats:
        out = np.zeros((4, 2 * rows, 2 * columns))
        for (x, y), (dx, dy), w in zip(np.floor(at / 4).astype(int), way, weight, strict=True):
            if 0 <= x < 2 * columns and 0 <= y < 2 * rows:
                out[round(np.degrees(np.arctan2(dy, dx)) / 45) % 4, y, x] += w
        return out

    seen = lay(edges.position - low, np.column_stack([-edges.normal[:, 1], edges.normal[:, 0]]), np.ones(85)).clip(0, 1)
    seen = np.stack([gaussian_filter(layer, 0.8) for layer in seen])
    for layer in seen:
        layer[:rows, :columns] -= layer[:rows, :columns].mean()
    pixel, half = project_with_jacobians(p)[0], (high - low) / 2
    scales = np.exp(-0.03 + 0.015 * np.arange(29))
    scores = []
    for scale in scales:
        laid = lay((pixel - low - half) * scale + 2 * half, along, weight)
        shifted = sum(np.fft.fft2(a) * np.conj(np.fft.fft2(b)) for a, b in zip(seen, laid, strict=True))
        scores.append(np.fft.ifft2(shifted).real.max() / np.sqrt((laid**2).sum()))
    best = int(np.argmax(scores))
    assert scales[best] == pytest.approx(1.2, rel=0.05)
    assert measure_magnification(p, edges) == pytest.approx((scales[best], scores[best] / max(scores[:4])))
