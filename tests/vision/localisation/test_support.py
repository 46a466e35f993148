"""What a pose gathers, in closed form and sample by sample, with the numbers written out."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import norm

from tests.vision.localisation.scenes import above, blocks, stereo_rig
from tests.vision.localisation.simulation import Errors, draw_edges
from vision.cameras.cameras import perturb
from vision.localisation.hypotheses import (
    build_fine_evidence,
    look_up_evidence,
    predict,
    project_directions,
    project_with_jacobians,
)
from vision.localisation.measurements import EdgeIndex, correct_rig, describe_unknowns, measure
from vision.localisation.support import Outlines, measure_support, mix_over_arcs, score_offsets


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
    edges = draw_edges(scene, rig, truth, Errors(), np.random.default_rng(4))
    p = predict(scene, rig, truth, 600)
    block = 5
    assert (scene.occurrence_of_arc[p.arc] == block).sum() > 10
    own = edges["left"]
    mine = predict(scene, rig, truth, 3000)
    of_block = project_with_jacobians(mine)[0][scene.occurrence_of_arc[mine.arc] == block]
    gap = np.linalg.norm(own.position[:, None] - of_block[None], axis=2).min(axis=1)
    own.position[gap < 1.0] += shift
    indexes, fields = [EdgeIndex(own)], build_fine_evidence(rig, edges)
    unknowns = describe_unknowns(rig)
    m = measure(p, indexes, np.zeros(6), unknowns, unknowns.mean, (3.0, 0.7), np.ones(len(p.arc), bool))
    there = np.where(scene.occurrence_of_arc[p.arc] == block, block, -1)
    fixed, moved = (
        measure_support(p, m, unknowns.mean, list(fields), indexes, of) for of in (np.full_like(there, -1), there)
    )
    assert moved.evidence > fixed.evidence + 5.0
    # Where nothing lies beside its place, looking there gains nothing.
    others = np.where(scene.occurrence_of_arc[p.arc] == 2, 2, -1)
    assert measure_support(p, m, unknowns.mean, list(fields), indexes, others).evidence == fixed.evidence


def test_outlines_of_all_cameras_are_weighed_by_length() -> None:
    found = Outlines(np.array([300.0, 100]), np.array([2.0, -1]), 0.0)
    assert (found.total_px, found.mean) == (400.0, 1.25)
    assert Outlines(np.zeros(2), np.zeros(2), 0.0).mean == 0.0
