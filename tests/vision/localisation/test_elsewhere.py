"""What poses elsewhere gather, against closed forms and sums by another way."""

from __future__ import annotations

import numpy as np
import pytest

from tests.vision.localisation.scenes import above, blocks, stereo_rig
from tests.vision.localisation.test_fits import exact_edges
from vision.localisation.hypotheses import build_fine_evidence, predict, project_with_jacobians
from vision.localisation.localisation_parameters import DEFAULTS, ElsewhereParameters
from vision.localisation.verdict import Chance, draw_elsewhere, draw_shifts, gather_elsewhere

P = DEFAULTS.elsewhere


@pytest.mark.parametrize(("shift", "scale"), [(0.0, 5.0), (-30.0, 70.0)])
def test_rarity_is_that_of_the_exponential_that_was_drawn(shift: float, scale: float) -> None:
    gathered = np.random.default_rng(1).exponential(scale, 200_000) + shift
    chance = Chance.of(gathered, P)
    for evidence in (shift + 2 * scale, shift + 6 * scale):
        assert chance.rarity(evidence) == pytest.approx((evidence - shift) / scale, rel=0.02)
        assert chance.reached(chance.rarity(evidence)) == pytest.approx(evidence)


def test_what_is_gathered_besides_shifts_and_widens_chance() -> None:
    gathered = np.random.default_rng(2).exponential(3.0, 1000)
    alone, both = Chance.of(gathered, P), Chance.of(gathered, P, mean=10.0, deviation=4.0)
    assert both.scale == pytest.approx(np.hypot(alone.scale, 4.0))
    threshold = np.quantile(gathered, 1 - P.share)
    assert both.rarity(threshold + 10.0) == pytest.approx(-np.log(P.share)) == alone.rarity(threshold)


def test_where_nothing_is_gathered_chance_is_that_of_independent_places() -> None:
    assert Chance.of(np.full(50, -3.0), P).scale == P.least_scale


def test_where_nothing_is_seen_nothing_is_rare() -> None:
    scene, rig, truth = blocks(), stereo_rig(), above(10, -20, 560)
    nothing = predict(scene, rig, truth, 400).take(np.zeros(0, np.int64))
    fields = build_fine_evidence(rig, exact_edges(truth, np.random.default_rng(5)))
    elsewhere = gather_elsewhere(scene, rig, nothing, fields, [], truth, DEFAULTS)
    assert elsewhere.together.rarity(0.0) == 0.0
    assert len(elsewhere.by_camera) == 2


def test_poses_elsewhere_show_everything_elsewhere() -> None:
    scene, rig, truth = blocks(), stereo_rig(), above(10, -20, 560)
    prediction = predict(scene, rig, truth, 400)
    before, _ = project_with_jacobians(prediction)
    few = ElsewhereParameters(poses=40, near_px=10.0, far_px=20.0, least_px_per_unit=1.0)
    for delta in draw_elsewhere(prediction, few):
        after, _ = project_with_jacobians(prediction, delta)
        moved = np.sqrt(((after - before) ** 2).sum(axis=1).mean())
        assert 8.0 < moved < 23.0  # the steps are laid to first order


def test_what_moves_the_picture_next_to_nothing_does_not_have_to_move_it_so_far() -> None:
    """Where no motion moves it by enough px a unit, a unit of turn and of a shift by the depth count for that many."""
    scene, rig, truth = blocks(), stereo_rig(), above(10, -20, 560)
    prediction = predict(scene, rig, truth, 400)
    few = ElsewhereParameters(poses=40, near_px=10.0, far_px=20.0, least_px_per_unit=1e5)
    depth = np.median(np.linalg.norm(prediction.point, axis=1))
    units = np.linalg.norm(draw_elsewhere(prediction, few) / np.repeat([depth, 1.0], 3), axis=1)
    assert 10.0 <= 1e5 * units.min() < 12.0
    assert 18.0 < 1e5 * units.max() <= 20.0


def test_outlines_are_shifted_by_as_much_every_way() -> None:
    shift = draw_shifts(3, ElsewhereParameters(outlined=400, near_px=10.0, far_px=20.0))
    far = np.linalg.norm(shift, axis=2)
    assert shift.shape == (400, 3, 2)
    assert 10.0 <= far.min() < 10.5
    assert 19.5 < far.max() <= 20.0
    assert np.abs((shift / far[..., None]).mean(axis=(0, 1))).max() < 0.08
    np.testing.assert_allclose((shift / far[..., None]).std(axis=(0, 1)), 0.5**0.5, rtol=0.05)


def test_cameras_add_up_elsewhere_and_outlines_add_their_mean_and_deviation(monkeypatch: pytest.MonkeyPatch) -> None:
    scene, rig, truth = blocks(), stereo_rig(), above(10, -20, 560)
    fields = build_fine_evidence(rig, exact_edges(truth, np.random.default_rng(5)))
    edges = np.random.default_rng(3).exponential(7.0, (200, 2))
    monkeypatch.setattr("vision.localisation.verdict.mix_over_arcs", lambda *_: edges)
    monkeypatch.setattr("vision.localisation.verdict.measure_shifted_outlines", lambda *_: np.array([2.0, 10.0]))
    found = gather_elsewhere(scene, rig, predict(scene, rig, truth, 400), fields, [], truth, DEFAULTS)
    assert found.together == Chance.of(edges[:, 0] + edges[:, 1], P, mean=6.0, deviation=4.0)
    assert found.by_camera == [Chance.of(edges[:, 0], P), Chance.of(edges[:, 1], P)]
