"""Least squares of a pose against the prior alone, finite differences, and covariances written out arc by arc."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from relmodel.arrays import Floats
from tests.vision.localisation.scenes import above, blocks, box_scene, off, stereo_rig, thinned
from tests.vision.localisation.simulation import Errors, draw_edges, fit_of, shift_bodies
from vision.cameras.cameras import CalibrationSigma, Needs, Prior, Rig, perturb, perturbation, perturbations
from vision.localisation.hypotheses import EdgePoints, flow_in_camera, predict, project_with_jacobians
from vision.localisation.localisation_parameters import DEFAULTS
from vision.localisation.localise import NO_PARTNER_ODDS, PARTNER_ODDS
from vision.localisation.measurements import ALIKE, EdgeIndex, hold_shifts, measure, share_left
from vision.localisation.refine import (
    Explanation,
    Fit,
    RefinedPose,
    compute_covariance,
    find_consensus,
    group_by_stretch,
    join_explanations,
)
from vision.localisation.verdict import Chance, Elsewhere, compute_precision, decide
from vision.localisation.views import collect_edge_measurements, find_view_arcs, propagate_pose
from vision.localisation.visibility import find_visible_arcs

FEW = thinned(blocks(5), 3)


def problem(
    errors: Errors | None = None, tolerance_mm: float = 0.0, names: tuple[str, ...] = ("left", "right"), seed: int = 3
) -> tuple[Fit, Floats]:
    scene, truth = replace(FEW, tolerance_mm=np.full(6, tolerance_mm)), above(10, -20, 560)
    rig = stereo_rig().only(*names)
    stated = {name: CalibrationSigma(0.002, 0.4, 0.2, 0.001) for name in names[1:]}
    rig = Rig(rig.cameras, rig.rig_from_camera, stated)
    edges = draw_edges(scene, rig, truth, errors or Errors(), np.random.default_rng(seed))
    return fit_of(scene, rig, edges, off(truth, 8.0, 0.01, seed)), truth


def no_edges() -> EdgePoints:
    none, corner = np.zeros((0, 2)), np.full(2, 6.0)
    return EdgePoints(none, none, np.zeros(0), np.zeros(0), corner, np.array([633.0, 473]), 200.0)


def test_where_nothing_is_found_the_pose_is_the_priors() -> None:
    """Of an anisotropic prior in its own frame, from a start turned away by much."""
    rng = np.random.default_rng(1)
    half = rng.normal(size=(6, 6)) * np.repeat([4.0, 0.01], 3)[:, None]
    rig, pose = stereo_rig(), above(10, -20, 560)
    prior = Prior(pose, half @ half.T + np.diag(np.repeat([1.0, 1e-5], 3)))
    edges = {name: no_edges() for name in rig.cameras}
    fit = fit_of(FEW, rig, edges, prior)
    start = perturb(pose, np.array([6.0, -5, 8, 0.02, -0.03, 0.05]))
    found = fit.solve(start, np.zeros(6, bool))
    np.testing.assert_allclose(found.world_from_rig, pose, atol=1e-6)
    np.testing.assert_allclose(found.covariance, prior.covariance, rtol=1e-6, atol=1e-12)
    assert found.prior_sigma == pytest.approx(0, abs=1e-5)
    assert not fit.is_determined(found)
    here = fit.measure(start, found.camera_unknowns, np.zeros(6, bool))
    away = perturbation(pose, start)
    assert here.prior_sigma**2 == pytest.approx(away @ np.linalg.solve(prior.covariance, away))
    assert here.cost == pytest.approx(0.5 * here.prior_sigma**2 - here.evidence)


def test_a_fit_ends_where_the_objective_is_least() -> None:
    """Weighted squares of what is measured, with the priors of pose and cameras, do not fall along any unknown."""
    fit, truth = problem()
    found = fit.refine_roughly(truth)
    assert found.last_step is not None
    m, p = found.measurements, found.prediction
    held, own, pose = hold_shifts(m, p), found.last_step.camera_unknowns, found.last_step.world_from_rig

    def objective(step: Floats) -> float:
        left = held.offset - held.jacobian @ step
        away = perturbation(fit.prior.world_from_rig, perturb(pose, step[:6]))
        cameras = (own + step[6:].reshape(own.shape) - fit.unknowns.mean).ravel()
        prior = away @ fit.prior.information @ away + cameras @ (
            (fit.unknowns.precision + fit.unknowns.held(ALIKE)) * cameras
        )
        return float((m.weight / m.sigma**2 * left**2).sum() + prior)

    moves = fit.unknowns.sigma.ravel() > 0
    np.testing.assert_allclose(fit.unknowns.held(ALIKE) / fit.unknowns.precision, np.tile([0.0, *[29.0] * 10], 2))
    taken = np.concatenate([perturbation(pose, found.world_from_rig), (found.camera_unknowns - own).ravel()])
    least = objective(taken)
    assert objective(np.zeros(28)) > least
    for k in np.flatnonzero(np.concatenate([np.ones(6, bool), moves])):
        for sign in (-1.0, 1.0):
            step = taken.copy()
            step[k] += sign * 1e-2 * (1.0 if k < 3 else 0.002)
            assert objective(step) > least - 1e-6


@pytest.mark.parametrize(("sigmas", "is_taken"), [(5.0, True), (7.0, False)])
def test_the_last_step_is_taken_up_to_six_sigma(sigmas: float, is_taken: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """From a pose that is kept so many sigma aside, were all errors independent."""
    fit, truth = problem()
    found = fit.solve(truth, np.zeros(6, bool))
    aside = np.array([sigmas / np.sqrt(np.linalg.inv(found.left)[0, 0]), 0, 0, 0, 0, 0])
    kept = fit.measure(perturb(found.world_from_rig, aside), found.solved, found.excluded)
    monkeypatch.setattr(fit, "solve", lambda *_: kept)
    assert np.any(fit.refine_roughly(truth).world_from_rig != kept.world_from_rig) == is_taken


@pytest.mark.parametrize("tolerance_mm", [0.0, 0.2])
def test_the_covariance_is_that_of_independent_stretches_arcs_and_priors(tolerance_mm: float) -> None:
    fit, truth = problem(Errors(arc_px=0.2), tolerance_mm)
    found = fit.solve(truth, np.zeros(6, bool))
    m, p, n = found.measurements, found.prediction, 28
    held, unknowns = hold_shifts(m, p), fit.unknowns
    w = m.weight / m.sigma**2
    hessian = np.einsum("n,ni,nj->ij", w, held.jacobian, held.jacobian)
    data = hessian.copy()
    away = perturbation(fit.prior.world_from_rig, found.world_from_rig)
    turn = np.eye(6)
    turn[:3, :3] = np.linalg.inv(fit.prior.world_from_rig[:3, :3]) @ found.world_from_rig[:3, :3]
    assert np.abs(away).max() > 1
    hessian[:6, :6] += turn.T @ fit.prior.information @ turn
    hessian[6:, 6:] += np.diag(unknowns.precision)
    stretch = group_by_stretch(p)
    covariance = compute_covariance(m, held, p, stretch, hessian, unknowns.held(ALIKE))
    np.testing.assert_allclose(found.spread, covariance, rtol=1e-6, atol=1e-12)
    np.testing.assert_array_equal(found.covariance, found.spread[:6, :6])

    hessian[6:, 6:] += np.diag(unknowns.held(ALIKE))
    bend = min(max((m.slope / m.sigma**2).sum() / w.sum(), 0.2), 1.0)
    inverse = np.linalg.inv(hessian - (1 - bend) * data)
    images = [np.flatnonzero(p.image_of_arc == image) for image in np.unique(p.image_of_arc)]
    images = [rows for rows in images if w[rows].sum() > 0]
    mean = {rows[0]: (w[rows] * m.offset[rows]).sum() / w[rows].sum() for rows in images}
    off_mean = np.zeros(len(w))
    for rows in images:
        off_mean[rows] = w[rows] * (m.offset[rows] - mean[rows[0]])
    meat, pull = hessian - data, unknowns.precision + unknowns.held(ALIKE)
    meat[6:, 6:] += np.diag(pull * (pull / unknowns.precision - 1))  # what is held errs as the file says
    for number in np.unique(stretch):
        rows = np.flatnonzero(stretch == number)
        g = (held.jacobian[rows] * off_mean[rows, None]).sum(axis=0)
        meat += np.outer(g, g)
    length = np.array([m.weight[rows].sum() for rows in images])
    scattered, known = 4 * length.mean() * 0.06**2, 4 * length.mean()
    shifts = np.zeros((n, n))
    tolerated = 0.0
    for rows, size in zip(images, length, strict=True):
        left = share_left(m, p)[rows[0]]
        own = (w[rows, None] * m.jacobian[rows]).sum(axis=0)
        followed = np.clip(left * own @ inverse @ own / w[rows].sum(), 0, 0.9)
        noise = (off_mean[rows] ** 2).sum() / w[rows].sum() ** 2
        scattered += size * (mean[rows[0]] ** 2 - noise)
        known += size * (1 - followed) ** 2
        shifts += left**2 * np.outer(own, own)
        tolerated += (m.weight[rows] * p.tolerance_px[rows] ** 2).sum() / length.sum()
    meat += max(scattered / known - tolerated, 0.0) * shifts
    for arc in np.unique(p.arc):
        rows = np.flatnonzero(p.arc == arc)
        moved = np.zeros((n, 3))
        for i in rows:
            normal = np.array([-m.direction[i, 1], m.direction[i, 0]])
            by_point = normal @ flow_in_camera(p, None, np.array([i]))[1][0] @ p.rotation[p.view[i]]
            by_point *= p.tolerance_px[i] / np.linalg.norm(by_point)
            moved += w[i] * np.outer(held.jacobian[i], by_point)
        meat += moved @ moved.T
    expected = inverse @ meat @ inverse
    for rows in images:
        own = held.jacobian[rows]
        gradient = own.T @ (w[rows] * held.offset[rows])
        alone = np.linalg.solve(hessian - 0.999 * (own.T * w[rows]) @ own, gradient)
        expected += np.outer(alone, alone)
    np.testing.assert_allclose(covariance, expected, rtol=1e-4, atol=1e-7 * np.abs(expected).max())


@pytest.mark.parametrize("scaled", [0.0, 0.03])
def test_pictures_show_a_focal_length_as_surely_as_they_say(scaled: float) -> None:
    """Of files that err as they state, and of one that is wrong."""
    sigmas, truth, rig = [], above(10, -20, 560), stereo_rig().only("left")
    for seed in range(8):
        rng, camera = np.random.default_rng(seed), rig.cameras["left"]
        edges, focal = draw_edges(FEW, rig, truth, Errors(arc_px=0.1), rng), 1 + (scaled or rng.normal(0, 0.002))
        file = replace(camera, matrix=camera.matrix * [[focal, 1, 1], [1, focal, 1], [1, 1, 1]])
        wrong = Rig({"left": file}, rig.rig_from_camera, {"left": CalibrationSigma(0.0005 if scaled else 0.002, 0.4)})
        fit = fit_of(FEW, wrong, edges, off(truth, 8.0, 0.01, seed))
        shown = fit.show(fit.refine(truth)).shown
        assert shown is not None
        sigmas.append((shown.unknowns / shown.sigma)[0, 3])
    assert max(sigmas) < -3 if scaled else 0.4 < np.sqrt(np.mean(np.square(sigmas))) < 1.4


def test_forty_px_along_an_arc_are_a_stretch() -> None:
    fit, truth = problem()
    p, _ = fit.predict(truth, fit.unknowns.expected)
    along: dict[int, float] = {}
    names: dict[tuple[int, int], int] = {}
    found = group_by_stretch(p)
    for i in range(len(p.arc)):
        image = int(p.image_of_arc[i])
        begun = along.get(image, 0.0)
        along[image] = begun + p.weight[i]
        first = p.weight[np.flatnonzero(p.image_of_arc == image)[0]]
        key = image, int(np.floor(along[image] - first + 1e-9))
        assert names.setdefault(key, int(found[i])) == found[i]
    assert len(set(names.values())) == len(names) > 30


def test_explanations_are_joined_by_how_likely_they_are() -> None:
    pose, one = above(10, -20, 560), np.diag([1.0, 2, 3, 1e-6, 2e-6, 3e-6])
    apart = np.array([1.0, -2, 0.5, 0.001, 0, 0.002])
    other = Explanation(perturb(pose, apart), 2 * one, float(np.log(0.25)))
    joined = join_explanations(pose, one, [other])
    np.testing.assert_allclose(joined, (one + 0.25 * (2 * one + np.outer(apart, apart))) / 1.25, rtol=1e-6, atol=1e-15)
    np.testing.assert_array_equal(join_explanations(pose, one, []), one)


def refined_cubes(shift: tuple[float, float]) -> tuple[Fit, RefinedPose]:
    """Three cubes, of which the first, the largest, shows beside its place."""
    boxes = [((-120.0, -60), 110.0), ((20, -70), 60), ((20, 20), 60)]
    scene = thinned(box_scene([(np.array([*place, 0.0]), np.full(3, size)) for place, size in boxes]), 2)
    rig, truth = replace(stereo_rig(), sigma={}), above(0, 0, 500)
    edges = draw_edges(scene, rig, truth, Errors(), np.random.default_rng(2))
    shift_bodies(edges, scene, rig, truth, [0], shift)
    fit = fit_of(scene, rig, edges, off(truth, 6.0, 0.01, 4))
    return fit, fit.solve(truth, np.zeros(3, bool))


def test_the_part_that_moves_the_pose_most_is_suspected() -> None:
    """The greater cube 1.3 px beside its place drags the pose; where all are in their places, none is left out."""
    fit, found = refined_cubes((1.0, -0.8))
    assert fit.find_outliers(found) == [0]
    without = fit.leave_out(found, 0)
    assert without is not None
    assert without.excluded.tolist() == [True, False, False]
    votes = without.measurements.weight > 0
    assert np.unique(fit.scene.occurrence_of_arc[without.prediction.arc][votes]).tolist() == [1, 2]
    assert fit.is_determined(without)
    fit, found = refined_cubes((0.0, 0.0))
    assert [fit.leave_out(found, cube) for cube in range(3)] == [None] * 3


def test_what_was_measured_is_told_in_the_world() -> None:
    fit, truth = problem()
    found = fit.refine(truth)
    assert found.last_step is not None
    pose = found.last_step.world_from_rig
    for number, (name, camera) in enumerate(fit.rig.cameras.items()):
        place = found.world_from_rig @ fit.rig.rig_from_camera[name]
        view = find_view_arcs(fit.scene, camera, place)
        rows = collect_edge_measurements(found, number, view, fit.cameras[number])
        m, p = found.measurements, found.prediction
        own = np.flatnonzero((p.view == number) & (m.found >= 0))
        at = np.linalg.inv(pose @ fit.rig.rig_from_camera[name])
        pixel, _ = camera.project(rows.world @ at[:3, :3].T + at[:3, 3])
        np.testing.assert_allclose(pixel, m.pixel[own], atol=1e-6)
        response = m.jacobian[own, 6 + 11 * number]
        np.testing.assert_array_equal(rows.response, response)
        others = (
            rows.residual
            + m.jacobian[own][:, 6 + 11 * number : 17 + 11 * number] @ found.last_step.camera_unknowns[number]
        )
        np.testing.assert_allclose(np.einsum("ni,ni->n", rows.position - pixel, rows.normal), others, atol=1e-6)
        mine = rows.view_arc >= 0
        assert mine.mean() > 0.9
        assert (view.element[rows.view_arc[mine]] == rows.arc[mine]).all()
        # A standard deviation of the pose moves samples as poses drawn from its covariance do.
        drawn = np.random.default_rng(0).multivariate_normal(np.zeros(6), found.covariance, 250)
        samples = view.samples.take(np.arange(0, len(view.run), 40))
        moved = []
        for delta in drawn:
            other = np.linalg.inv(perturb(found.world_from_rig, delta) @ fit.rig.rig_from_camera[name])
            there, _ = camera.project(samples.point @ other[:3, :3].T + other[:3, 3])
            across = np.stack([-samples.direction[:, 1], samples.direction[:, 0]], axis=1)
            moved.append(np.einsum("ni,ni->n", there - samples.pixel, across))
        sigma = np.linalg.norm(propagate_pose(found, number, samples), axis=1)
        np.testing.assert_allclose(np.std(moved, axis=0) / sigma, 1.0, atol=0.15)


def test_the_consensus_is_the_step_that_most_of_the_length_agrees_on() -> None:
    """Of arcs of which a third are shifted, against drawing and solving one by one."""
    fit, truth = problem()
    p, pose = fit.predict(truth, fit.unknowns.expected)[0], perturb(truth, np.array([0.5, -0.3, 0.8, 0.001, 0, 0.001]))
    votes, unknowns = np.arange(len(p.arc)) % 9 > 0, fit.unknowns
    m = measure(p, fit.cameras, np.zeros(6), unknowns, unknowns.mean, (6.0, 2.0), votes)
    m = replace(m, offset=m.offset + 3.0 * (p.arc % 3 == 0))
    hit = np.flatnonzero(m.weight > 0)
    images, group = np.unique(p.image_of_arc[hit], return_inverse=True)
    j, offset, w = m.jacobian[hit, :6], m.offset[hit], p.weight[hit]
    keys = np.random.default_rng(7).exponential(size=(300, len(images))) / np.bincount(group, w)
    away, tried = perturbation(fit.prior.world_from_rig, pose), [np.zeros(6)]
    for key in keys:
        own = np.isin(group, np.argsort(key)[:5])
        normal = j[own].T @ j[own] + fit.prior.information
        pull = j[own].T @ offset[own] - fit.prior.information @ away
        tried.append(np.asarray(np.linalg.solve(normal, pull), float))
    agreed = [w @ np.clip(1 - ((offset - j @ step) / 1.5) ** 2, 0, None) for step in tried]
    found = find_consensus(m, p, fit.prior, pose, 7)
    np.testing.assert_allclose(found, tried[int(np.argmax(agreed))], rtol=1e-6, atol=1e-9)
    assert not find_consensus(replace(m, weight=0 * m.weight), p, fit.prior, pose, 7).any()


def test_a_part_that_alone_says_where_the_rig_is_is_no_outlier() -> None:
    """Without a prior nothing is known without it, exactly; of the other part nothing was found."""
    n = 12
    jacobian = np.concatenate([np.eye(6), 2 * np.eye(6)])
    m = SimpleNamespace(
        jacobian=np.tile(jacobian, (2, 1)), weight=np.repeat([1.0, 0.0], n), sigma=np.ones(2 * n),
        offset=np.ones(2 * n),
    )  # fmt: skip
    fit = SimpleNamespace(
        scene=SimpleNamespace(occurrence_of_arc=np.array([0, 1])), _measured=lambda _: (m, jacobian.T @ jacobian, None)
    )
    seen = SimpleNamespace(arc=np.repeat([0, 1], n), weight=np.ones(2 * n))
    refined = SimpleNamespace(prediction=seen, covariance=np.eye(6))
    assert Fit.find_outliers(cast(Fit, fit), cast(RefinedPose, refined)) == []


@pytest.mark.parametrize(("cameras", "shift"), [(("left",), (0.0, 0.0)), (("left", "right"), (2.0, 1.5))])
def test_of_two_bodies_that_disagree_the_lesser_does_not_pull_the_pose(
    cameras: tuple[str, ...], shift: tuple[float, float]
) -> None:
    """A cube and a smaller block beside it, too few arcs for a consensus to part them when they are 2 px apart."""
    boxes = (np.array([0.0, -40, 0]), np.full(3, 90.0)), (np.array([-140.0, -30, 0]), np.array([50.0, 40, 50]))
    scene = box_scene([*boxes])
    rig, truth = stereo_rig().only(*cameras), above(-20, 0, 500)
    edges = draw_edges(scene, rig, truth, Errors(), np.random.default_rng(3))
    shift_bodies(edges, scene, rig, truth, [1], shift)
    found = fit_of(scene, rig, edges, off(truth, 6.0, np.radians(1), 4)).refine(truth)
    d = perturbation(found.world_from_rig, truth)
    assert np.abs(d[:3]).max() < 0.2
    assert d @ np.linalg.solve(found.covariance, d) < 3.5**2
    block = scene.occurrence_of_arc[found.prediction.arc] == 1
    votes = found.measurements.weight[block].sum() / block.sum()
    if shift == (0.0, 0.0):
        assert votes > 0.9
        assert not found.excluded.any()
    else:
        assert votes < 0.15


def test_of_two_like_bodies_that_disagree_either_may_be_off_and_of_one_part_nothing() -> None:
    """Two cubes that tell as much as each other, near enough for their edges to be found: the covariance holds the
    truth of this draw wherever the pose comes out, and what other cube may be off, or none, is a pose of its own.
    Where they are one part the pictures show not the part as modelled."""
    cubes = [(np.array([20.0, -40, 0]), np.full(3, 80.0)), (np.array([-120.0, -40, 0]), np.full(3, 80.0))]
    scene = box_scene(cubes)
    rig, truth = stereo_rig().only("left"), above(-10, 0, 500)
    for shifted in (0, 1):
        edges = draw_edges(scene, rig, truth, Errors(), np.random.default_rng(19))
        shift_bodies(edges, scene, rig, truth, [shifted], (2.0, -3.0))
        found = fit_of(scene, rig, edges, off(truth, 6.0, np.radians(1), 4)).refine(truth)
        d = perturbation(found.world_from_rig, truth)
        assert d @ np.linalg.solve(found.covariance, d) < 3.5**2
        left_out = {tuple(h.excluded.tolist()): h for h in (found, *found.others)}
        assert set(left_out) == {(False, False), (True, False), (False, True)}
        right = left_out[shifted == 0, shifted == 1]
        assert np.abs(perturbation(right.world_from_rig, truth)[:3]).max() < 0.5
    surfaces, arcs, one = np.zeros(12, np.int64), np.zeros(24, np.int64), np.ones(1, bool)
    whole = replace(scene, surface_occurrence=surfaces, arc_occurrence=arcs, inspected=one, tolerance_mm=np.zeros(1))
    found = fit_of(whole, rig, edges, off(truth, 6.0, np.radians(1), 4)).refine(truth)
    assert not found.excluded.any()
    assert not found.others


def test_halves_of_the_arcs_lead_back_from_where_some_led_astray() -> None:
    """One camera before a box, of which some edges show nothing and lines are printed 4 px beside them."""
    scene = box_scene([(np.array([-60.0, -40, 0]), np.array([120.0, 80, 60]))])
    rig, truth = stereo_rig().only("left"), above(15, -25, 420)
    seen = find_visible_arcs(scene, rig.cameras["left"], truth @ rig.rig_from_camera["left"])
    whole = draw_edges(scene, rig, truth, Errors(), np.random.default_rng(2))["left"]
    position = whole.position.copy()
    for arc in (0, 9):
        own = np.flatnonzero(seen.arc == arc)
        across = whole.normal[own[0]]
        inward = np.sign((seen.pixel.mean(axis=0) - seen.pixel[own].mean(axis=0)) @ across)
        position[own] += 4.0 * inward * across
    prior = off(truth, 6.0, np.radians(1.5), 1)
    fit = fit_of(scene, rig, {"left": replace(whole, position=position)}, prior)
    astray = fit.refine(prior.world_from_rig)
    assert np.linalg.norm(perturbation(astray.world_from_rig, truth)[:3]) > 2.0
    best = astray
    for _ in range(3):  # as long as the best changes
        best = min((best, *map(fit.refine_roughly, fit.follow_halves(best))), key=lambda h: h.cost)
    assert np.linalg.norm(perturbation(best.world_from_rig, truth)[:3]) < 0.3
    fit, found = refined_cubes((0.0, 0.0))
    assert np.abs(perturbations(found.world_from_rig, np.stack([*fit.follow_halves(found)]))[:, :3]).max() < 0.5


@pytest.mark.parametrize("turned", [0.0, 0.1])
def test_jacobians_are_derivatives(turned: float) -> None:
    scene, rig, truth = blocks(), stereo_rig(), above(10, -20, 560)
    p = predict(scene, rig, truth, 100)
    at = np.full(6, turned) * np.repeat([10.0, 0.1], 3)
    _, jacobian = project_with_jacobians(p, at)
    h = 1e-6
    for k in range(6):
        # A right perturbation on top of `at`: compose as poses, read the sum off as one perturbation.
        moved = perturbation(np.eye(4), perturb(perturb(np.eye(4), at), h * np.eye(6)[k]))
        numeric = (project_with_jacobians(p, moved)[0] - project_with_jacobians(p, at)[0]) / h
        assert np.allclose(numeric, jacobian[:, :, k], rtol=1e-3, atol=1e-2)


def test_the_direction_that_parallel_edges_leave_open_is_named() -> None:
    """A bar whose ends lie far outside the pictures: nothing tells how far along it the rig is."""
    scene = box_scene([(np.array([-3000.0, -40, 0]), np.array([6000.0, 80, 50]))])
    rig, truth = stereo_rig(), above(0, 0, 520)
    edges = draw_edges(scene, rig, truth, Errors(), np.random.default_rng(6))
    found = fit_of(scene, rig, edges, Prior.isotropic(truth, 9.0, np.radians(0.5))).refine(truth)
    sigma_mm, _, weakest = compute_precision(found.covariance, found.middle)
    assert sigma_mm == pytest.approx(9.0, rel=0.1)
    along = truth[:3, :3].T @ [1.0, 0, 0]
    axis = "xyz"[int(np.argmax(np.abs(along)))]
    assert weakest.startswith(f"shift along {axis}")
    elsewhere = Elsewhere(Chance(0.0, 1.0), [])
    verdict = decide([found], np.array([0]), {}, elsewhere, rig, Needs(5.0, 0.02), DEFAULTS.verdict)
    assert verdict.verdict == "refused"
    assert any(weakest in sentence for sentence in verdict.missing)


@pytest.mark.parametrize(("sigmas", "more", "disagrees"), [(2.72, 50.0, False), (2.74, 0.1, True), (9.0, -0.1, False)])
def test_a_camera_disagrees_from_where_it_gathers_more(sigmas: float, more: float, disagrees: bool) -> None:
    """By 4.73 sigma, where it knows as much as the joint pose, of which two cameras would know twice as much."""
    scene, rig, truth = blocks(5), stereo_rig(), above(10, -20, 560)
    edges = draw_edges(scene, rig, truth, Errors(), np.random.default_rng(6))
    best = fit_of(scene, rig, edges, Prior.isotropic(truth, 9.0, np.radians(0.5))).refine(truth)
    gathered = best.support.by_camera[0] / 2 + np.full(2, more / 2)
    aside = perturb(best.world_from_rig, np.linalg.cholesky(2 * best.covariance) @ (sigmas * np.eye(6)[0]))
    own = replace(best, world_from_rig=aside, support=replace(best.support, by_camera=gathered))
    elsewhere, by_camera = Elsewhere(Chance(0.0, 1.0), [Chance(0.0, 1.0)] * 2), {"left": own, "right": best}
    told = decide([best], np.array([0]), by_camera, elsewhere, rig, Needs(5.0, 2.0), DEFAULTS.verdict)
    assert any("the cameras disagree" in words for words in told.missing) == disagrees


def test_of_edges_side_by_side_the_one_with_a_partner_in_stereo_counts() -> None:
    """Two like edges, 1 px to both sides of where one is looked for."""
    position, normal = np.array([[51.0, 40.0], [49.0, 40.0]]), np.array([[1.0, 0.0], [1.0, 0.0]])
    edges = EdgePoints(
        position, normal, np.full(2, 30.0), np.full(2, 0.1), np.zeros(2), np.full(2, 100.0), grey_range=200.0
    )
    sought = np.array([[50.0, 40.0]]), np.array([[0.0, 1.0]])
    for partnered in (0, 1):
        odds = np.full(2, NO_PARTNER_ODDS)
        odds[partnered] = PARTNER_ODDS
        offset, found = EdgeIndex(edges, odds).measure(*sought, 4.0, 2.0)
        assert (found.tolist(), np.abs(offset).tolist()) == ([partnered], [1.0])
        # an edge much stronger counts without a partner
        stronger = replace(edges, contrast=np.where(np.arange(2) == partnered, 30.0, 240.0))
        assert EdgeIndex(stronger, odds).measure(*sought, 4.0, 2.0)[1].tolist() == [1 - partnered]
