"""Refinement and evidence on edge elements made from exact projections, with noise and clutter that is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from relmodel.arrays import Floats
from tests.vision.localisation.scenes import above, blocks, box_scene, off, stereo_rig
from tests.vision.localisation.simulation import among_clutter
from vision.cameras.cameras import Needs, Prior, Rig, perturb, perturbation
from vision.localisation.hypotheses import (
    EdgePoints,
    build_fine_evidence,
    predict,
    project_with_jacobians,
)
from vision.localisation.localisation_parameters import DEFAULTS
from vision.localisation.localise import NO_PARTNER_ODDS, PARTNER_ODDS
from vision.localisation.measurements import EdgeIndex
from vision.localisation.refine import Fit, RefinedPose
from vision.localisation.verdict import Chance, Elsewhere, compute_precision, decide
from vision.localisation.visibility import find_visible_arcs
from vision.scene import Scene

SIGMA = 0.1


def exact_edges(
    truth: Floats,
    rng: np.random.Generator,
    shift: Floats | None = None,
    scene: Scene | None = None,
    shifted: tuple[int, ...] = (1, 2, 3),
) -> dict[str, EdgePoints]:
    """Elements where the truth projects the arcs of a scene (the blocks'), off by normal noise; `shift` (px) moves
    those of some bodies."""
    scene, rig = scene or blocks(), stereo_rig()
    out = {}
    for name, camera in rig.cameras.items():
        seen = find_visible_arcs(scene, camera, truth @ rig.rig_from_camera[name])
        normal = np.stack([-seen.direction[:, 1], seen.direction[:, 0]], axis=1)
        position = seen.pixel + normal * rng.normal(0, SIGMA, len(normal))[:, None]
        if shift is not None:
            position[np.isin(scene.occurrence_of_arc[seen.arc], shifted)] += shift
        out[name] = among_clutter(camera, position, normal, SIGMA, rng)
    return out


def fit(scene: Scene, rig: Rig, edges: dict[str, EdgePoints], prior: Prior, start: Floats) -> RefinedPose:
    indexes = {n: EdgeIndex(edges[n]) for n in rig.cameras}
    return Fit(scene, rig, indexes, build_fine_evidence(rig, edges), prior).refine(start)


@pytest.mark.parametrize(
    ("cameras", "shift"),
    [
        (("left",), (0.0, 0.0)),
        (("left",), (4.0, 3.0)),
        (("left", "right"), (2.0, 1.5)),
    ],
)
def test_of_two_bodies_that_disagree_the_lesser_does_not_pull_the_pose(
    cameras: tuple[str, ...], shift: tuple[float, float]
) -> None:
    """A cube and a smaller block beside it, too few arcs for a consensus to part them when they are 2 px apart."""
    scene = box_scene(
        [(np.array([0.0, -40, 0]), np.full(3, 90.0)), (np.array([-140.0, -30, 0]), np.array([50.0, 40, 50]))]
    )
    rig, truth = stereo_rig().only(*cameras), above(-20, 0, 500)
    edges = exact_edges(truth, np.random.default_rng(3), shift=np.array(shift), scene=scene, shifted=(1,))
    found = fit(scene, rig, edges, off(truth, 6.0, np.radians(1), 4), truth)
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


def test_of_two_like_bodies_that_disagree_either_may_be_off() -> None:
    """Two cubes that tell as much as each other, near enough for their edges to be found: the covariance holds the
    truth wherever the pose comes out, and what other cube may be off, or none, is a pose of its own."""
    scene = box_scene([(np.array([20.0, -40, 0]), np.full(3, 80.0)), (np.array([-120.0, -40, 0]), np.full(3, 80.0))])
    rig, truth = stereo_rig().only("left"), above(-10, 0, 500)
    for shifted in (0, 1):
        edges = exact_edges(truth, np.random.default_rng(3), np.array([2.0, -3.0]), scene, (shifted,))
        found = fit(scene, rig, edges, off(truth, 6.0, np.radians(1), 4), truth)
        d = perturbation(found.world_from_rig, truth)
        assert d @ np.linalg.solve(found.covariance, d) < 3.5**2
        left_out = {tuple(h.excluded.tolist()): h for h in (found, *found.others)}
        assert set(left_out) == {(False, False), (True, False), (False, True)}
        right = left_out[shifted == 0, shifted == 1]
        assert np.abs(perturbation(right.world_from_rig, truth)[:3]).max() < 0.5


def test_a_fit_that_an_arc_leads_astray_finds_back_without_it() -> None:
    """One camera before a box, of which some edges show nothing and lines are printed 4 px beside them."""
    scene = box_scene([(np.array([-60.0, -40, 0]), np.array([120.0, 80, 60]))])
    rig, truth = stereo_rig().only("left"), above(15, -25, 420)
    seen = find_visible_arcs(scene, rig.cameras["left"], truth @ rig.rig_from_camera["left"])
    whole = exact_edges(truth, np.random.default_rng(2), scene=scene)["left"]
    position = whole.position.copy()
    for arc in (0, 9):
        own = np.flatnonzero(seen.arc == arc)
        across = whole.normal[own[0]]
        inward = np.sign((seen.pixel.mean(axis=0) - seen.pixel[own].mean(axis=0)) @ across)
        position[own] += 4.0 * inward * across
    edges = {"left": replace(whole, position=position)}
    indexes, fields = {"left": EdgeIndex(edges["left"])}, build_fine_evidence(rig, edges)
    prior = off(truth, 6.0, np.radians(1.5), 1)
    problem = Fit(scene, rig, indexes, fields, prior)
    astray = problem.refine(prior.world_from_rig)
    assert np.linalg.norm(perturbation(astray.world_from_rig, truth)[:3]) > 2.0
    best = min(problem.refine_without_arcs(astray), key=lambda h: h.cost)
    assert best.cost < astray.cost
    assert np.linalg.norm(perturbation(best.world_from_rig, truth)[:3]) < 0.3


def test_nothing_is_left_out_of_one_rigid_part() -> None:
    """Two cubes that no edge joins and that are one part: what the pictures show is then not the part as modelled."""
    cubes = [(np.array([20.0, -40, 0]), np.full(3, 80.0)), (np.array([-120.0, -40, 0]), np.full(3, 80.0))]
    apart = box_scene(cubes)
    one = replace(
        apart,
        surface_occurrence=np.zeros(12, np.int64),
        arc_occurrence=np.zeros(24, np.int64),
        inspected=np.ones(1, bool),
        tolerance_mm=np.zeros(1),
    )
    rig, truth = stereo_rig().only("left"), above(-10, 0, 500)
    edges = exact_edges(truth, np.random.default_rng(3), shift=np.array([2.0, -3.0]), scene=apart, shifted=(0,))
    found = fit(one, rig, edges, off(truth, 6.0, np.radians(1), 4), truth)
    assert not found.excluded.any()
    assert not found.others


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
    edges = exact_edges(truth, np.random.default_rng(6), scene=scene)
    prior = Prior.isotropic(truth, 9.0, np.radians(0.5))
    found = fit(scene, rig, edges, prior, truth)
    sigma_mm, _, weakest = compute_precision(found.covariance, found.middle)
    assert sigma_mm == pytest.approx(9.0, rel=0.1)
    along = truth[:3, :3].T @ [1.0, 0, 0]
    axis = "xyz"[int(np.argmax(np.abs(along)))]
    assert weakest.startswith(f"shift along {axis}")
    elsewhere = Elsewhere(Chance(0.0, 1.0), [])
    verdict = decide([found], np.array([0]), {}, elsewhere, rig, Needs(5.0, 0.02), DEFAULTS.verdict)
    assert verdict.verdict == "refused"
    assert any(weakest in sentence for sentence in verdict.missing)


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
