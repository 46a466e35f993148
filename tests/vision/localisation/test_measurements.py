"""Measurements sample by sample, the cameras' unknowns against projections, and arcs that are shifted as a whole."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from relmodel.arrays import Floats
from tests.vision.localisation.scenes import above, blocks, stereo_rig
from tests.vision.localisation.simulation import Errors, draw_edges, scattered_edges
from vision.cameras.cameras import CalibrationSigma, Rig, perturb
from vision.localisation.hypotheses import Prediction, predict, project_directions, project_with_jacobians
from vision.localisation.measurements import (
    EdgeIndex,
    Measurements,
    correct_rig,
    describe_unknowns,
    differentiate,
    hold_shifts,
    measure,
    share_left,
    shift_pixels,
    split_response,
    weigh,
)


def test_the_mean_of_an_arc_counts_no_more_than_its_shift_allows() -> None:
    """One unknown that moves all edges alike: the best estimate weighs arcs' means by 1 / (shift^2 + sigma^2 / n)."""
    rng = np.random.default_rng(4)
    number, shift, sigma = np.array([400] + [10] * 9), 0.2, 0.3
    arc = np.repeat(np.arange(10), number)
    n = len(arc)
    offset = (1.0 + rng.normal(0, shift, 10))[arc] + rng.normal(0, sigma, n)
    none, zero = np.zeros(n), np.zeros((n, 3))
    prediction = Prediction(
        zero, zero, np.ones(n), none, np.zeros(n, np.int64), arc, np.eye(3)[None], np.zeros((1, 3)), np.eye(3)[None, :2]
    )
    m = Measurements(
        zero[:, :2], zero[:, :2], none, offset, np.arange(n), none + sigma, none + sigma, np.ones(n), np.ones(n),
        none + shift, none, np.ones((n, 1)),
    )  # fmt: skip
    held = hold_shifts(m, prediction)
    estimate = float(held.jacobian[:, 0] @ held.offset / (held.jacobian[:, 0] @ held.jacobian[:, 0]))
    mean = np.bincount(arc, offset) / number
    weight = 1 / (shift**2 + sigma**2 / number)
    np.testing.assert_allclose(estimate, weight @ mean / weight.sum(), rtol=1e-12)
    # As sure as that, and not as sure as all edges alike would be.
    np.testing.assert_allclose((held.jacobian**2).sum() / sigma**2, weight.sum(), rtol=1e-12)


UNKNOWNS = np.array([0.3, 1.2, -0.8, 0.004, 0.5, -0.4, 0.7, 0.003, -0.002, 0.004, 0.02])


@pytest.mark.parametrize("view", [0, 1])
def test_unknowns_move_pixels_as_a_corrected_rig_does(view: int) -> None:
    """`shift_pixels` and `differentiate` against projections by the rig that `correct_rig` makes."""
    rig, p, delta = scene_of_two()
    own = np.zeros((2, 11))
    pixel = project_with_jacobians(p, delta)[0]
    rows = np.flatnonzero(p.view == view)
    direction = project_directions(p, delta)[rows]
    normal = np.stack([-direction[:, 1], direction[:, 0]], axis=1)
    response = np.linspace(-1, 1, len(rows))
    found = differentiate(p, delta, rows, pixel[rows], normal, response, np.ones(11))
    np.testing.assert_array_equal(found[:, 0], response)
    for k in range(1, 11):
        own[view] = 0
        own[view, k] = step = 1e-4 * UNKNOWNS[k]
        solved = correct_rig(rig, own)
        name = list(rig.cameras)[view]
        pose = perturb(np.eye(4), delta) @ solved.rig_from_camera[name]
        camera, points = solved.cameras[name], (p.point[rows] - pose[:3, 3]) @ pose[:3, :3]
        moved = camera.project(points)[0] - pixel[rows]
        np.testing.assert_allclose(shift_pixels(p, delta, pixel, own)[rows], moved, rtol=3e-3, atol=2e-7)
        np.testing.assert_allclose(found[:, k], np.einsum("ni,ni->n", normal, moved) / step, rtol=3e-3, atol=0.02)
    exact = differentiate(p, delta, rows, pixel[rows], normal, response, np.eye(11)[2])
    assert not exact[:, np.arange(11) != 2].any()


def scene_of_two() -> tuple[Rig, Prediction, Floats]:
    rig = stereo_rig()
    p = predict(blocks(), rig, above(10, -20, 560), 120)
    return rig, p, np.array([2.0, -1, 3, 0.004, -0.01, 0.006])


def test_what_a_rig_states_is_how_well_its_cameras_are_known() -> None:
    rig = stereo_rig()
    stated = Rig(rig.cameras, rig.rig_from_camera, {"right": CalibrationSigma(0.003, 0.5, 0.2, 0.001, 0.01)})
    found = describe_unknowns(stated)
    assert found.mean.tolist() == [[0.25] + [0.0] * 10] * 2
    # Nothing is said of the left one, whose frame is the rig's.
    assert found.sigma[0].tolist() == [0.25, 0.7, 0.7, 0.002, *[0.0] * 6, 0.002]
    assert found.sigma[1].tolist() == [0.25, 0.5, 0.5, 0.003, 0.2, 0.2, 0.2, 0.001, 0.001, 0.001, 0.01]
    np.testing.assert_allclose(found.precision[:5], [16, 0.7**-2, 0.7**-2, 0.002**-2, 1])
    assert found.precision[14] == pytest.approx(1 / 0.003**2)


@pytest.mark.parametrize("tolerance_mm", [0.0, 0.3])
def test_measurements_are_those_of_each_sample(tolerance_mm: float) -> None:
    scene, rig, truth = replace(blocks(), tolerance_mm=np.full(10, tolerance_mm)), stereo_rig(), above(10, -20, 560)
    rig = Rig(rig.cameras, rig.rig_from_camera, {"right": CalibrationSigma(0.003, 0.5, 0.2, 0.001)})
    edges = draw_edges(scene, rig, truth, Errors(), np.random.default_rng(5))
    p = predict(scene, rig, perturb(truth, np.array([0.3, -0.2, 0.5, 0.001, 0, 0])), 250)
    indexes, unknowns = [EdgeIndex(points) for points in edges.values()], describe_unknowns(rig)
    own = unknowns.mean + unknowns.sigma * 0.3
    votes, delta = np.arange(len(p.arc)) % 5 != 0, np.array([0.2, 0.1, -0.3, 0, 0.001, 0])
    m = measure(p, indexes, delta, unknowns, own, (4.0, 1.0), votes)
    pixel, jacobian = project_with_jacobians(p, delta)
    direction, wide = project_directions(p, delta), float(p.tolerance_px.max())
    weight = np.zeros(len(pixel))
    for i, (view, (dx, dy)) in enumerate(zip(p.view, direction, strict=True)):
        points, normal = list(edges.values())[view], np.array([-dy, dx])
        there = pixel[i : i + 1] + shift_pixels(p, delta, pixel, own)[i]
        at = indexes[view].measure(there, direction[i : i + 1], 4.0 + 2 * wide, float(np.hypot(1.0, wide)))[1][0]
        assert m.found[i] == at
        if at < 0:
            assert (m.offset[i], m.edge_sigma[i], m.weight[i], m.slope[i]) == (0, 1, 0, 0)
            continue
        contrast = abs(points.contrast[at])
        sigma = np.sqrt(points.sigma[at] ** 2 + 0.08**2 + (0.5 * indexes[view].texture / contrast) ** 2)
        assert m.edge_sigma[i] == pytest.approx(sigma)
        # The response moves an edge toward its dark side, by the more, the stronger it is.
        response = -np.sign(normal @ points.normal[at]) * contrast / points.grey_range
        by_camera = differentiate(
            p, delta, np.array([i]), pixel[i : i + 1], normal[None], np.array([response]), unknowns.sigma[view]
        )[0]
        offset = normal @ (points.position[at] - pixel[i]) - by_camera @ own[view]
        assert m.offset[i] == pytest.approx(offset)
        np.testing.assert_allclose(m.jacobian[i, 6 + 11 * view : 17 + 11 * view], by_camera)
        np.testing.assert_allclose(m.jacobian[i, :6], normal @ jacobian[i])
        weight[i] = votes[i] / (1 + (offset - m.shift[i]) ** 2) ** 2
    np.testing.assert_allclose(m.weight, weight)
    for image in np.unique(p.image_of_arc):
        rows = np.flatnonzero(p.image_of_arc == image)
        total = weight[rows].sum()
        np.testing.assert_allclose(m.sigma[rows] ** 2, m.edge_sigma[rows] ** 2 + p.tolerance_px[rows] ** 2 * total)
        np.testing.assert_allclose(m.arc_shift[rows], 0.06 / max(total / len(rows), 0.05))
        left = 1 / (1 + m.arc_shift[rows[0]] ** 2 * (weight[rows] / m.sigma[rows] ** 2).sum())
        np.testing.assert_allclose(share_left(m, p)[rows], left)
        use = rows[(m.found[rows] >= 0) & votes[rows]]
        assert not m.shift[rows[~np.isin(rows, use)]].any()
        if tolerance_mm and len(use):
            # Of what the tolerance leaves open the shift on which the arc's edges agree, at the cost of the distance.
            most = p.tolerance_px[use].max()
            tried = np.linspace(-2.5, 2.5, 2 * int(np.ceil(5 * p.tolerance_px[(m.found >= 0) & votes].max())) + 1)
            agreed = [(p.weight[use] / (1 + (m.offset[use] - t * most) ** 2)).sum() / 0.32 - 0.5 * t**2 for t in tried]
            np.testing.assert_allclose(m.shift[use], tried[int(np.argmax(agreed))] * most)


def test_the_slope_of_the_loss_is_its_derivative() -> None:
    offset, shift, use = np.linspace(-3, 3, 13), np.full(13, 0.4), np.arange(13) != 2
    weight, slope = weigh(offset, shift, use, 0.7)
    step = 1e-6
    ahead = weigh(offset + step, shift, use, 0.7)[0] * (offset + step - shift)
    np.testing.assert_allclose(slope, (ahead - weight * (offset - shift)) / step, atol=1e-5)
    np.testing.assert_allclose(weigh(np.array([0.0, 0.7, 2.1]), np.zeros(3), np.ones(3, bool), 0.7)[0], [1, 0.25, 0.01])
    assert (weight[2], slope[2]) == (0, 0)


def test_no_response_moves_edges_toward_the_bright_side() -> None:
    response, astray = split_response(np.array([0.3, -0.2, 0.0, -0.9]))
    assert (response.tolist(), astray) == ([0.3, 0.0, 0.0, 0.0], 0.9)
    assert split_response(np.array([0.3, 0.1]))[1] == 0.0


@pytest.mark.parametrize("degrees", [0.0, 90.0, 33.0, 120.0, 179.99])
@pytest.mark.parametrize("size", [(60.0, 22.0), (22.0, 60.0)])
def test_of_the_edges_on_a_normal_the_one_that_counts_most_is_found(degrees: float, size: tuple[float, float]) -> None:
    rng = np.random.default_rng(round(degrees))
    low = np.array([-7.0, 5.0])
    edges = scattered_edges(rng, 900, (low, low + size), (low, low + size))
    index = EdgeIndex(edges, odds := rng.normal(0, 0.5, 900))
    angle = np.radians(degrees)
    way, across = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
    pixel = rng.uniform(low - 3, low + np.array(size) + 3, (150, 2))
    offset, found = index.measure(pixel, np.tile(way, (150, 1)), 6.0, 2.0)
    assert (found >= 0).sum() > 20
    weight = np.log(np.maximum(np.abs(edges.contrast), 1e-3)) + odds
    for i, place in enumerate(pixel):
        away = edges.position - place
        on = (np.abs(away @ way) <= 0.75) & (np.abs(away @ across) <= 6.0) & (np.abs(edges.normal @ across) >= 0.94)
        score = np.where(on, weight - 0.5 * (away @ across / 2.0) ** 2, -np.inf)
        best = int(np.argmax(score)) if on.any() else -1
        assert found[i] == best
        assert offset[i] == pytest.approx(away[best] @ across if on.any() else 0.0)


def test_texture_is_the_usual_contrast_and_no_edge_has_none() -> None:
    rng, corners = np.random.default_rng(0), ((0.0, 0.0), (20.0, 20.0))
    edges = scattered_edges(rng, 5, corners, corners)
    edges.contrast[:] = [-40.0, 10, 0, -20, 90]
    index = EdgeIndex(edges, np.log(np.array([1.0, 2, 3, 4, 5])))
    assert index.texture == 20.0
    np.testing.assert_allclose(index.strength, [40, 20, 0.003, 80, 450])
    assert EdgeIndex(scattered_edges(rng, 0, corners, corners)).texture == 1.0
