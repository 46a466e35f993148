"""One rig at several standpoints: scipy's least squares by exact projections, draws of known size, and ablations."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.stats import chi2, norm

from relmodel.arrays import Floats
from relmodel.geometry.transforms import rotation_matrix
from tests.vision.localisation import simulation
from tests.vision.localisation.scenes import above, blocks, off, stereo_rig, thinned
from tests.vision.localisation.simulation import Errors, draw_edges
from vision.cameras.cameras import CalibrationSigma, Rig, Standpoint, perturb, perturbation
from vision.localisation.hypotheses import EdgePoints
from vision.localisation.measurements import ALIKE, correct_rig, share_left
from vision.localisation.refine import Fit
from vision.localisation.verdict import compare_standpoints, compute_precision

SIGMA = np.repeat([1.0, np.radians(0.1)], 3)
SCENE = thinned(blocks(5), 6)
TILTS = np.radians([[0, 0, 0], [25, 0, 0], [-14, 22, 5], [0, -25, 10]])


def stand(seed: int, moved: float = 0.0, sigma: Floats = SIGMA) -> tuple[Fit, Rig, list[Floats]]:
    """Least squares of blocks from four standpoints off by `sigma`, the last by `moved` more; the true rig; errors."""
    rng, rig = np.random.default_rng(seed), stereo_rig().only("left")
    rig = replace(rig, sigma={"left": CalibrationSigma(0.001, 0.3)})
    turns = [np.vstack([np.column_stack([rotation_matrix(tilt), np.zeros(3)]), [0, 0, 0, 1]]) for tilt in TILTS]
    stood = {f"s{k}": turn @ above(0, 0, 520) for k, turn in enumerate(turns)}
    errors = [rng.normal(size=6) * sigma for _ in stood]
    way = rng.normal(size=6)
    errors[-1] = errors[-1] + moved * way / np.linalg.norm(way) * sigma
    covariance = np.diag(sigma**2)
    true = rig.at_standpoints({name: Standpoint(pose, covariance) for name, pose in stood.items()})
    places = zip(stood.items(), errors, strict=True)
    stated = {
        name: Standpoint(pose @ np.linalg.inv(perturb(np.eye(4), error)), covariance) for (name, pose), error in places
    }
    edges = draw_edges(SCENE, true, stood["s0"], Errors(arc_px=0.05), rng)
    return fit_of(rig.at_standpoints(stated), edges, stood["s0"]), true, errors


def fit_of(rig: Rig, edges: dict[str, EdgePoints], truth: Floats) -> Fit:
    return simulation.fit_of(SCENE, rig, edges, off(truth, 10.0, 0.02, 1))


def test_it_ends_where_scipy_does() -> None:
    """By poses of cameras that are composed of standpoints, where the fit knows derivatives alone."""
    fit, _, _ = stand(1)
    found = fit.refine_roughly(above(0, 0, 520))
    m, p, rig, columns = found.measurements, found.prediction, fit.rig, fit.unknowns.standpoints
    assert found.last_step is not None
    start = found.last_step.world_from_rig
    lens, count = min(it.start for it in columns.values()), len(found.solved)
    group, weight = p.image_of_arc, np.sqrt(m.weight) / m.sigma
    known, keep = np.bincount(group, weight**2), 1 - np.sqrt(share_left(m, p))
    hit = m.found >= 0
    position = np.zeros_like(m.pixel)
    for view, index in enumerate(fit.cameras):
        rows = hit & (p.view == view)
        position[rows] = index.edges.position[m.found[rows]]
    normal = np.stack([-m.direction[:, 1], m.direction[:, 0]], axis=1)

    def residuals(x: Floats) -> Floats:
        solved = x[6:]
        own = fit.unknowns.shared[:, :, :lens] @ solved[:lens]
        first = perturb(rig.standpoints["s0"].world_from_rig, SIGMA * solved[columns["s0"]])
        pixel = np.zeros_like(m.pixel)
        for view, (name, camera) in enumerate(correct_rig(rig, own).cameras.items()):
            place = rig.standpoint_of(name)
            there = perturb(rig.standpoints[place].world_from_rig, SIGMA * solved[columns[place]])
            pose = np.linalg.inv(perturb(np.eye(4), x[:6]) @ np.linalg.inv(first) @ there)
            rows = p.view == view
            pixel[rows] = camera.project(p.point[rows] @ pose[:3, :3].T + pose[:3, 3])[0]
        left = np.where(hit, np.einsum("ni,ni->n", normal, position - pixel) - m.response * own[p.view, 0], 0.0)
        mean = np.bincount(group, weight**2 * left) / np.maximum(known, 1e-12)
        away = perturbation(fit.prior.world_from_rig, perturb(start, x[:6]))
        priors = np.concatenate([np.linalg.cholesky(fit.prior.information).T @ away, held * (solved - expected)])
        return np.concatenate([weight * (left - keep * mean[group]), priors])

    expected, held = fit.unknowns.expected, np.sqrt(fit.unknowns.precision + fit.unknowns.held(ALIKE))
    best = least_squares(residuals, np.concatenate([np.zeros(6), expected]), x_scale=np.sqrt(np.diag(found.left)))
    assert len(best.x) == 6 + count
    taken = np.concatenate([perturbation(start, found.world_from_rig), found.solved])
    sigmas = (taken - best.x) / np.sqrt(np.diag(found.left))
    assert np.abs(sigmas).max() < 0.05
    jacobian: Floats = np.asarray(best.jac, float)
    information = jacobian.T @ jacobian - np.diag(np.append(np.zeros(6), fit.unknowns.held(ALIKE)))
    np.testing.assert_allclose(np.linalg.inv(information)[:6, :6], found.left[:6, :6], rtol=0.1, atol=1e-7)
    assert np.ptp(found.camera_unknowns[:, 1:4], axis=0).max() == 0  # one camera, wherever it stands
    # How far standpoints are off, by what tells it, and by what edges err more than independent ones do.
    for name, it in compare_standpoints(fit.rig, found).items():
        left, spread = (it[6:, 6:][columns[name], columns[name]] for it in (found.left, found.spread))
        value, axes = np.linalg.eigh(left)
        shown = 1 - value + np.maximum(np.diag(axes.T @ (spread - left) @ axes), 0.0)
        told = 1 - value > 0.2
        square = ((axes.T @ found.solved[columns[name]])[told] ** 2 / shown[told]).sum()
        assert 2 * norm.sf(it.misfit.sigmas) == pytest.approx(chi2.sf(square, told.sum()))


def test_pictures_together_are_surer_and_as_right_as_they_say_and_exact_standpoints_are_not() -> None:
    """The same pictures one by one are less sure; standpoints held exact are surer than they are right."""
    fit, true, errors = stand(0)
    truth = true.standpoints["s0"].world_from_rig
    edges = {name: index.edges for name, index in zip(fit.rig.cameras, fit.cameras, strict=True)}
    found = fit.refine(truth)
    d = perturbation(found.world_from_rig, truth)
    together = d @ np.linalg.solve(found.covariance, d)
    mm, _, _ = compute_precision(found.covariance, found.middle)
    for name, it in compare_standpoints(fit.rig, found).items():
        left = it.moved - errors[int(name[1:])]
        assert left @ np.linalg.solve(it.covariance, left) < 30
        assert it.misfit.sigmas < 3.5
    certain = {n: replace(it, covariance=1e-6 * it.covariance) for n, it in fit.rig.standpoints.items()}
    assert fit.rig.moved is not None
    held = fit_of(fit.rig.moved.at_standpoints(certain), edges, truth).refine(truth)
    d = perturbation(held.world_from_rig, truth)
    exact = d @ np.linalg.solve(held.covariance, d)
    alone = fit_of(fit.rig.moved, {"left": edges["s0/left"]}, truth).refine(truth)
    one_mm, _, _ = compute_precision(alone.covariance, alone.middle)
    assert together < 9  # of six degrees of freedom
    assert exact > 4 * together
    assert one_mm > mm


def test_a_standpoint_that_is_moved_is_named_with_the_amount() -> None:
    fit, true, errors = stand(0, 8.0)
    found = compare_standpoints(fit.rig, fit.refine(true.standpoints["s0"].world_from_rig))
    worst = max(found, key=lambda name: found[name].misfit.sigmas)
    assert worst == "s3"
    assert found[worst].misfit.sigmas > 3.5
    assert found[worst].misfit.words.startswith("standpoint s3 is ")
    left = found[worst].moved - errors[-1]
    assert left @ np.linalg.solve(found[worst].covariance, left) < 40


def test_standpoints_are_found_that_lie_further_off_than_least_squares_looks() -> None:
    """And what is seen from there gathers what it would, were they stated to be there."""
    fit, true, _ = stand(1, sigma=8 * SIGMA)
    truth = true.standpoints["s0"].world_from_rig
    found = fit.refine(truth)
    edges = {name: index.edges for name, index in zip(fit.rig.cameras, fit.cameras, strict=True)}
    there = fit_of(true, edges, truth).refine(truth)
    assert (found.support.by_camera > there.support.by_camera - 2).all()
    solved = correct_rig(fit.rig, found.camera_unknowns).rig_from_camera
    assert max(np.linalg.norm((solved[n] - it)[:3, 3]) for n, it in true.rig_from_camera.items()) < 2.5
    standpoints = fit.unknowns.standpoints.values()
    assert found.strain == pytest.approx(sum((found.solved[it] ** 2).sum() / 2 for it in standpoints), rel=5e-3)


@pytest.mark.parametrize("lost", ["s0", "s2"])
def test_a_camera_that_is_lost_among_several_is_found_where_it_stands_by_itself(lost: str) -> None:
    fit, true, _ = stand(0)
    truth, each = true.standpoints["s0"].world_from_rig, zip(fit.rig.cameras, fit.cameras, strict=True)
    found = fit.refine(truth)
    alone = {n: fit_of(fit.rig.only(n), {n: it.edges}, truth).refine_roughly(truth) for n, it in each}
    assert fit.resolve(found, alone) is found
    solved, off = found.solved.copy(), np.array([0.0, 15, 0, 0, 0, 0])
    solved[fit.unknowns.standpoints[lost]] += off
    pose = perturb(found.world_from_rig, SIGMA * off * (lost == "s0"))  # by which the others hold that one
    astray = fit.measure(pose, solved, found.excluded)
    again = fit.resolve(astray, alone)
    np.testing.assert_allclose(again.support.by_camera, found.support.by_camera, atol=2)
    assert np.linalg.norm(perturbation(again.world_from_rig, found.world_from_rig)[:3]) < 0.1
