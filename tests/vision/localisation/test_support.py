"""What a pose gathers, in closed form and sample by sample, with the numbers written out."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import norm

from relmodel.arrays import Bools
from tests.vision.localisation.scenes import above, blocks, box_scene, stereo_rig
from tests.vision.localisation.simulation import Errors, draw_edges
from vision.cameras.cameras import Camera, Rig, perturb
from vision.localisation.hypotheses import (
    EdgePoints,
    build_fine_evidence,
    look_up_evidence,
    predict,
    project_directions,
    project_with_jacobians,
)
from vision.localisation.measurements import EdgeIndex, correct_rig, describe_unknowns, measure
from vision.localisation.support import (
    Outlines,
    lay_grey_grids,
    measure_outlines,
    measure_shifted_outlines,
    measure_support,
    mix_over_arcs,
    score_offsets,
)


def test_an_edge_found_speaks_by_how_far_off_it_lies() -> None:
    offset, sigma = np.array([0.0, 0.5, -1.2, 3.0, 0.2]), np.array([0.0, 0.3, 0.1, 0.0, 0.0])
    own = [0.4, 0.5, math.hypot(0.4, 0.1), 0.4]
    near = [math.log(0.3 + 0.7 * norm.pdf(o, scale=s) * 6.0) for o, s in zip(offset[:4], own, strict=True)]
    np.testing.assert_allclose(score_offsets(offset, sigma, np.array([7, 0, 3, 1, -1])), [*near, 0.0])


def mixed(sums: list[float]) -> float:
    """Log of the mean over six shares of arcs that show, of the product over arcs of what each leaves."""
    shares = (0.2, 0.35, 0.5, 0.65, 0.8, 0.95)
    return math.log(sum(math.prod(p * math.exp(s) + 1 - p for s in sums) for p in shares) / 6)


def test_arcs_that_may_not_show_are_mixed_camera_by_camera() -> None:
    arc = np.array([[2.0, -1, 0.5, 3], [0.0, 0, -4, 1]])
    found = mix_over_arcs(arc, np.array([0, 1, 0, 2]), 4)
    np.testing.assert_allclose(found[0], [mixed([2, 0.5]), mixed([-1]), mixed([3]), 0], atol=1e-12)
    np.testing.assert_allclose(found[1], [mixed([0, -4]), 0, mixed([1]), 0], atol=1e-12)


@pytest.mark.parametrize("tolerance_mm", [0.0, 0.4])
def test_support_is_gathered_over_arcs_and_cameras(tolerance_mm: float) -> None:
    scene, rig, truth = blocks(), stereo_rig(), above(10, -20, 560)
    scene = replace(scene, tolerance_mm=np.full(10, tolerance_mm))
    edges = draw_edges(scene, rig, truth, Errors(), np.random.default_rng(2))
    indexes, fields = [EdgeIndex(edges[name]) for name in rig.cameras], build_fine_evidence(rig, edges)
    p = predict(scene, rig, perturb(truth, np.array([0.4, -0.3, 0.5, 0, 0.001, 0])), 300)
    own = describe_unknowns(rig).mean + np.array([0, 0.4, -0.3, 0.001, 0, 0, 0, 0, 0, 0, 0])
    m = measure(p, indexes, np.zeros(6), describe_unknowns(rig), own, (3.0, 0.7), np.ones(len(p.arc), bool))
    nowhere = np.full(len(p.arc), -1)
    found = measure_support(p, m, own, list(fields), indexes, nowhere)
    # The same from the corrected rig, whose cameras see the samples where the unknowns put them.
    matrices = np.array([camera.matrix[:2] for camera in correct_rig(rig, own).cameras.values()])
    solved, _ = project_with_jacobians(replace(p, matrix=matrices))
    direction = project_directions(p)
    pixel = solved + m.shift[:, None] * np.stack([-direction[:, 1], direction[:, 0]], axis=1)
    assert m.shift.any() == (tolerance_mm > 0)
    each = look_up_evidence(p, list(fields), pixel, direction)
    np.testing.assert_allclose(found.found, np.bincount(p.view, p.weight * each), rtol=1e-9)
    likely = [fields[v].expectation(pixel[i : i + 1], direction[i : i + 1])[0] for i, v in enumerate(p.view)]
    np.testing.assert_allclose(found.expected, np.bincount(p.view, p.weight * likely), rtol=1e-9)
    np.testing.assert_allclose(found.length_px, np.bincount(p.view, 40.0 * p.weight), rtol=1e-12)
    sums: list[dict[int, float]] = [{}, {}]
    for i in range(len(p.arc)):
        odds = score_offsets(m.offset[i : i + 1] - m.shift[i], m.edge_sigma[i : i + 1], m.found[i : i + 1])[0]
        sums[p.view[i]][p.arc[i]] = sums[p.view[i]].get(p.arc[i], 0.0) + p.weight[i] * (each[i] + odds)
    for view, arc in {*zip(p.view.tolist(), p.arc.tolist(), strict=True)}:
        if tolerance_mm:  # what its shift costs is that of a Gaussian of the tolerance, once an arc
            rows = (p.view == view) & (p.arc == arc)
            cost = (p.weight * 0.5 * (m.shift / p.tolerance_px) ** 2)[rows].sum() / p.weight[rows].sum()
            sums[view][arc] -= cost
    np.testing.assert_allclose(found.by_camera, [mixed(list(one.values())) for one in sums], rtol=1e-9)
    assert found.evidence == pytest.approx(found.by_camera.sum())


@pytest.mark.parametrize("shift", [(6.0, -4.0), (-8.0, 2.0)])
def test_a_part_that_lies_beside_its_place_is_looked_for_there(shift: tuple[float, float]) -> None:
    scene, rig, truth = blocks(), stereo_rig().only("left"), above(10, -20, 560)
    edges = draw_edges(scene, rig, truth, Errors(), np.random.default_rng(4))["left"]
    p, unknowns = predict(scene, rig, truth, 600), describe_unknowns(rig)
    mine = predict(scene, rig, truth, 3000)
    of_block = project_with_jacobians(mine)[0][scene.occurrence_of_arc[mine.arc] == 5]
    gap = np.linalg.norm(edges.position[:, None] - of_block[None], axis=2).min(axis=1)
    beside = replace(edges, position=edges.position + np.where(gap < 1.0, 1.0, 0.0)[:, None] * shift)

    def gather(own: EdgePoints, sought: int) -> float:
        index, fields = [EdgeIndex(own)], build_fine_evidence(rig, {"left": own})
        m = measure(p, index, np.zeros(6), unknowns, unknowns.mean, (3.0, 0.7), np.ones(len(p.arc), bool))
        of = np.where(scene.occurrence_of_arc[p.arc] == sought, sought, -1)
        return measure_support(p, m, unknowns.mean, list(fields), index, of).evidence

    found = gather(beside, 5)
    assert found > gather(beside, -1) + 5.0
    # To have sought it costs the log of how many images of it can be told apart; its edges run every way.
    own = scene.occurrence_of_arc[p.arc] == 5
    places, at = p.weight[own], project_with_jacobians(p)[0][own]
    arm = np.linalg.norm(at - np.average(at, axis=0, weights=places), axis=1)
    told_apart = np.array([12.0**2 * places.sum(), 0.02**2 * (places @ arm**2)]) / 2 / 0.4**2
    assert gather(edges, -1) - found == pytest.approx(np.log1p(told_apart).sum(), abs=4.0)
    # Where nothing lies beside its place, looking there gains nothing.
    assert gather(beside, 2) == gather(beside, -1)


def test_outlines_of_all_cameras_are_weighed_by_length() -> None:
    found = Outlines(np.array([300.0, 100]), np.array([2.0, -1]), 0.0)
    assert (found.total_px, found.mean) == (400.0, 1.25)
    assert Outlines(np.zeros(2), np.zeros(2), 0.0).mean == 0.0


def test_outlines_are_compared_square_by_square() -> None:
    """By brute force and loops; shifted by whole squares, outlines are those of the model there, but at the border."""
    plate = box_scene([(np.array([-70.0, -50, -10]), np.array([140.0, 100, 10]))])
    rig = Rig({"one": Camera(180, 150, np.array([[400.0, 0, 90], [0, 400, 75], [0, 0, 1]]))}, {"one": np.eye(4)})
    pose = np.diag([1.0, -1, -1, 1])
    pose[:3, 3] = [12, 9, 700]
    grey = np.random.default_rng(1).normal(100, 20, (150, 180))
    grey[40:110, 50:130] += 40
    (grid,) = lay_grey_grids(rig, {"one": grey})
    assert grid.grey.shape == (50, 60)
    means = grey.reshape(50, 3, 60, 3).mean(axis=(1, 3))  # rays stand in the middle of squares of 3 px
    np.testing.assert_allclose(grid.grey[1:-1, 1:-1], means[1:-1, 1:-1], rtol=1e-5)
    model = np.zeros((50, 60), bool)
    x, y = (90 + 400 / 700 * np.array([-82.0, 58]) - 1) / 3, (75 + 400 / 700 * np.array([-41.0, 59]) - 1) / 3
    model[int(np.ceil(y[0])) : int(y[1]) + 1, int(np.ceil(x[0])) : int(x[1]) + 1] = True
    places = np.argwhere(np.ones_like(model))
    gap = np.linalg.norm(places[:, None] - places[None], axis=2)

    def expected(model: Bools, known: Bools) -> tuple[float, float]:
        sides = model.ravel()
        away = 3 * np.where(
            sides, np.where(sides, np.inf, gap).min(axis=1) - 0.5, 0.5 - np.where(sides, gap, np.inf).min(axis=1)
        )
        odds = []
        for (r, c), d in zip(places, away, strict=True):
            if not (3 < abs(d) <= 6 and known[r, c]):
                continue
            window = (np.abs(places - [r, c]) <= 8).all(axis=1) & known.ravel()
            sides_of = [grid.grey.ravel()[window & side] for side in (away > 6, away < -6)]
            if min(map(len, sides_of)) < 8:
                continue
            logs = [norm.logpdf(grid.grey[r, c], some.mean(), np.sqrt(some.var() + 16)) for some in sides_of]
            odds.append(np.sign(d) * np.clip(logs[0] - logs[1], -3, 3))
        return len(odds) * 9 / 6, float(np.mean(odds))

    found = measure_outlines(plate, rig, [grid], pose)
    length, contrast = expected(model, grid.seen)
    assert (found.length_px[0], found.contrast[0]) == pytest.approx((length, contrast), rel=0.03)
    assert found.evidence == pytest.approx(found.length_px[0] * found.contrast[0] / 120)
    shifts = np.array([[[12.4, -7.6]], [[-31.0, 4]]])
    laid = [expected(np.roll(model, (round(dy / 3), round(dx / 3)), axis=(0, 1)), grid.seen) for dx, dy in shifts[:, 0]]
    odds = measure_shifted_outlines(plate, rig, [grid], pose, shifts)
    np.testing.assert_allclose(odds, [length * contrast / 120 for length, contrast in laid], rtol=0.05)
