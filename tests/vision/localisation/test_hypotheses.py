"""Evidence of pictures and of poses against loops over cells and samples, with the numbers written out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import norm, qmc

from relmodel.arrays import Bools, Floats, Ints
from tests.vision.localisation.scenes import above, blocks, box_scene, stereo_rig
from tests.vision.localisation.simulation import scattered_edges
from vision.cameras.cameras import Camera, Prior, Rig, perturb, perturbation
from vision.localisation import hypotheses
from vision.localisation.hypotheses import (
    EdgePoints,
    Evidence,
    Fields,
    Perturbations,
    Prediction,
    bin_orientations,
    bound_elements,
    build_evidence,
    build_fine_evidence,
    climb,
    climb_each,
    climb_from,
    gather_evidence,
    keep_distinct,
    look_up_evidence,
    predict,
    predict_shift_sigma,
    project_directions,
    project_with_jacobians,
    scan_prior,
    search_poses,
    select_samples,
    select_under_prior,
)

LIKELY = np.array([0.25, 0.3, 0.2])  # of an edge of the model, to show in each class of strength; 0.25 do not show


def some_edges(seed: int, count: int = 400) -> EdgePoints:
    return scattered_edges(np.random.default_rng(seed), count, ((3, 2), (210, 130)), ((6.0, 4.0), (203.0, 121.0)))


def turn_of(direction: Floats) -> int:
    return int(np.rint(np.degrees(np.arctan2(direction[1], direction[0])) / 11.25)) % 16


@pytest.mark.parametrize(("cell", "reach", "pad", "lit"), [(2.0, 3.0, 1, 0), (4.0, 6.0, 3, 0), (4.0, 6.0, 3, 60)])
def test_evidence_of_cells_is_that_of_what_lies_near_and_around(cell: float, reach: float, pad: int, lit: int) -> None:
    """Light hides `lit` columns of the picture: no cell of these speaks."""
    edges, block = some_edges(1), round(16 / cell)
    edges = replace(edges, glare=np.tile(np.arange(198) < lit, (118, 1)) if lit else None)
    found = build_evidence(edges, cell, reach, pad)
    rows, columns = (np.ceil((np.ceil(np.array([117.0, 197.0]) / cell) + 1) / block) * block).astype(int)
    assert found.field.shape == (16, rows + 2 * pad, columns + 2 * pad)
    np.testing.assert_allclose(found.origin, edges.low - cell * pad)
    # A disc of these half widths of rows: what OpenCV makes of an ellipse of 5 x 5 cells.
    offsets = [(dy, dx) for dy in range(-2, 3) for dx in range(-2, 3) if abs(dy) < 2 or dx == 0]
    assert round(reach / cell) in (1, 2)
    if round(reach / cell) == 1:
        offsets = [(0, 0), (1, 0), (-1, 0), (0, 1), (0, -1)]
    inside = [
        (r, c)
        for r in range(rows)
        for c in range(columns)
        if r * cell <= 117 + cell / 2 and lit <= c * cell <= 197 + cell / 2
    ]
    turn, rng = 5, np.random.default_rng(0)
    classes, strong = np.zeros((2, rows, columns), int)
    for place, normal, contrast in zip(edges.position, edges.normal, np.abs(edges.contrast) / 200, strict=True):
        c, r = np.rint((place - edges.low) / cell).astype(int)
        own = turn_of(np.array([-normal[1], normal[0]]))
        if 0 <= r < rows and 0 <= c < columns and min((own - turn) % 16, (turn - own) % 16) <= 1:
            strong[r, c] = max(strong[r, c], sum(int(contrast >= least) for least in (0.03, 0.12, 0.3)))
    for r in range(rows):
        for c in range(columns):
            near = [(r + dy, c + dx) for dy, dx in offsets if 0 <= r + dy < rows and 0 <= c + dx < columns]
            classes[r, c] = max(strong[place] for place in near)
    share = np.zeros((rows // block, columns // block))
    counts = np.zeros((3, rows // block, columns // block))
    for r in range(rows):
        for c in range(columns):
            if classes[r, c]:
                counts[classes[r, c] - 1, r // block, c // block] += 1
    for r, c in inside:
        share[r // block, c // block] += 1 / block**2
    for r, c in [inside[i] for i in rng.choice(len(inside), 60, replace=False)]:
        around = np.s_[max(r // block - 6, 0) : r // block + 7, max(c // block - 6, 0) : c // block + 7]
        common, weight = counts.sum(axis=(1, 2)) / len(inside), 40 / block**2
        q = (counts[:, *around].sum(axis=(1, 2)) / block**2 + weight * common + 0.5 / block**2) / (
            share[around].sum() + weight + 1 / block**2
        )
        np.testing.assert_allclose(found.chance[:, turn, r // block, c // block], q, rtol=2e-5)
        k = classes[r, c]
        expected = np.log(0.25) if k == 0 else np.log((LIKELY[k - 1] + 0.25 * q[k - 1]) / q[k - 1])
        assert found.field[turn, r + pad, c + pad] == pytest.approx(expected, rel=1e-4)
        # What a right prediction gathers there in the mean: each class as often as it shows, or by chance where not.
        pixel, along = np.array([[c, r]]) * cell + edges.low, np.radians(turn * 11.25)
        show = LIKELY + 0.25 * q
        mean = (show * np.log(show / q)).sum() + 0.25 * (1 - q.sum()) * np.log(0.25)
        direction = np.array([[np.cos(along), np.sin(along)]])
        np.testing.assert_allclose(found.expectation(pixel, direction), mean, rtol=1e-4)
    if lit:
        beside = edges.low + np.array([[lit - 0.6, 5], [lit - 0.4, 5], [196.1, 5], [90, 0.9]])
        assert edges.can_show(beside).tolist() == [False, True, False, False]
    outside = np.ones((rows, columns), bool)
    outside[tuple(np.array(inside).T)] = False
    assert not found.field[:, pad : pad + rows, pad : pad + columns][:, outside].any()
    assert not found.field[:, :pad].any()
    assert not found.field[:, :, -pad:].any()


def test_orientations_are_sixteen_of_half_a_turn() -> None:
    degrees = np.array([0.0, 5.5, 6.0, 11.25, 90, 174, 175, 180, 185, 270, -11.25])
    direction = np.stack([np.cos(np.radians(degrees)), np.sin(np.radians(degrees))], axis=1)
    assert bin_orientations(direction).tolist() == [0, 0, 1, 1, 8, 15, 0, 0, 0, 8, 15]


def test_evidence_beyond_chance_has_no_mean() -> None:
    evidence = build_evidence(some_edges(2), 4.0, 6.0, 2)
    less = evidence.beyond_chance()
    seen = evidence.field != 0
    np.testing.assert_allclose(less.field[seen], evidence.field[seen] - evidence.field[seen].mean(), atol=1e-5)
    assert not less.field[~seen].any()


def world() -> tuple[Rig, Prediction, Fields]:
    """A prediction of the blocks, and pictures full of edges."""
    rig = stereo_rig()
    prediction = predict(blocks(), rig, above(10, -20, 560), 60)
    rng, bounds = np.random.default_rng(3), ((6.0, 6.0), (633.0, 473.0))
    edges = [scattered_edges(rng, 9000, ((0, 0), (640, 480)), bounds, (0, 90)) for _ in rig.cameras]
    return rig, prediction, Fields(build_evidence(points, 2.0, 3.0, 1) for points in edges)


def one_by_one(p: Prediction, fields: Fields, delta: Floats) -> Floats:
    """The evidence of each sample where a perturbation projects it."""
    pixel, _ = project_with_jacobians(p, delta)
    direction, out = project_directions(p, delta), np.zeros(len(pixel))
    for i, (place, along) in enumerate(zip(pixel, direction, strict=True)):
        e = fields[p.view[i]]
        x, y = (int(np.rint(v)) for v in (place - e.origin) / e.cell)
        if 0 <= y < e.field.shape[1] and 0 <= x < e.field.shape[2]:
            out[i] = e.field[turn_of(along), y, x]
    return out


def test_evidence_is_gathered_sample_by_sample() -> None:
    _, p, fields = world()
    delta = np.array([[0.0, 0, 0, 0, 0, 0], [3, -2, 5, 0.01, 0.02, -0.03], [-60, 40, 90, 0.1, -0.3, 0.2]])
    found = gather_evidence(p, fields, delta)
    for row, d in zip(found, delta, strict=True):
        each = one_by_one(p, fields, d)
        expected = np.bincount(p.image_of_arc, p.weight * each, len(row))
        np.testing.assert_allclose(row, expected, rtol=1e-5, atol=1e-6)
        pixel, direction = project_with_jacobians(p, d)[0], project_directions(p, d)
        np.testing.assert_allclose(look_up_evidence(p, list(fields), pixel, direction), each, rtol=1e-6)
    assert (p.view_of_image[p.image_of_arc] == p.view).all()
    assert len(np.unique(p.image_of_arc)) == len({*zip(p.view.tolist(), p.arc.tolist(), strict=True)})


def interpolated(p: Prediction, fields: Fields, delta: Floats, information: Floats) -> float:
    """The score of a climb: evidence between the four cells about each sample, less half the squared distance."""
    pixel, _ = project_with_jacobians(p, delta)
    direction, total = project_directions(p, delta), -0.5 * delta @ information @ delta
    for i, (place, along) in enumerate(zip(pixel, direction, strict=True)):
        e = fields[p.view[i]]
        x, y = (place - e.origin) / e.cell
        if 0 <= x < e.field.shape[2] - 1 and 0 <= y < e.field.shape[1] - 1:
            c, r, layer = int(x), int(y), e.field[turn_of(along)].astype(float)
            upper = layer[r, c] * (1 - x + c) + layer[r, c + 1] * (x - c)
            lower = layer[r + 1, c] * (1 - x + c) + layer[r + 1, c + 1] * (x - c)
            total += p.weight[i] * (upper * (1 - y + r) + lower * (y - r))
    return float(total)


def test_a_climb_ends_where_no_step_leads_higher() -> None:
    _, p, fields = world()
    rng = np.random.default_rng(1)
    half = rng.normal(size=(6, 6)) * np.repeat([0.05, 30], 3)
    information = half.T @ half
    start = rng.normal(size=(8, 6)) * np.repeat([2.0, 0.004], 3)
    found, score = climb(p, fields, start, information, 4.0, 1.0)
    assert not np.array_equal(found, start)
    _, jacobian = project_with_jacobians(p)
    value, vector = np.linalg.eigh(np.mean([j.T @ j for j in jacobian], axis=0) + information)
    for begun, delta, reached in zip(start, found, score, strict=True):
        assert interpolated(p, fields, delta, information) == pytest.approx(reached, rel=1e-5)
        assert reached > interpolated(p, fields, begun, information)
        for axis in (vector / np.sqrt(value)).T:
            for sign in (-1.0, 1.0):
                assert interpolated(p, fields, delta + sign * axis, information) <= reached + 1e-6


def test_candidates_are_climbed_to_and_come_best_first(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(hypotheses, "SCAN_KEPT", 30)
    scene, rig, truth = blocks(5), stereo_rig(), above(10, -20, 560)
    edges = {}
    for number, (name, camera) in enumerate(rig.cameras.items()):
        p = predict(scene, rig, truth, 3000)
        own = p.view == number
        direction = project_directions(p)[own]
        normal, place = np.stack([-direction[:, 1], direction[:, 0]], axis=1), project_with_jacobians(p)[0][own]
        size = np.array([camera.width - 7.0, camera.height - 7])
        n = len(place)
        edges[name] = EdgePoints(place, normal, np.full(n, 50.0), np.full(n, 0.1), np.array([6.0, 6]), size, 200.0)
    fine = build_fine_evidence(rig, edges)
    assert [e.cell for e in fine] == [2.0, 2.0]
    prior = Prior.isotropic(perturb(truth, np.array([4.0, -3, 6, 0.01, -0.02, 0.01])), 10.0, 0.02)
    shown = predict(scene, rig, truth, 500)
    found = search_poses(select_under_prior(scene, rig, prior), rig, edges, fine, prior, 3)
    assert (np.diff(found.score) <= 0).all()
    best = perturbation(truth, perturb(prior.world_from_rig, found.delta[0]))
    off = project_with_jacobians(shown, best)[0] - project_with_jacobians(shown)[0]
    assert np.linalg.norm(off, axis=1).mean() < 1.5
    (scan, climbed) = found.stages
    assert (scan.name, climbed.name) == ("scan", "climb")
    assert scan.rule.count("goes_on") == len(found.score) == len(climbed.score)
    starts = Perturbations(np.stack([np.full(6, 0.01), found.delta[0]]), np.array([7.0, 3.0]))
    each = climb_each(scene, rig, fine, prior, starts)
    alone = [
        climb_from(scene, rig, fine, perturb(prior.world_from_rig, d), prior.information, (4.0, 1.0))
        for d in starts.delta
    ]
    best_first = sorted((it for it in alone if it), key=lambda it: -it[1])
    assert each.score.tolist() == [score for _, score in best_first]
    np.testing.assert_allclose(perturb(prior.world_from_rig, each.delta), [pose for pose, _ in best_first], atol=1e-9)
    nothing = perturb(truth, np.array([0.0, 0, 0, np.pi, 0, 0]))
    assert climb_from(scene, rig, fine, nothing, prior.information, (4.0, 1.0)) is None


def test_distinct_poses_show_the_samples_apart() -> None:
    _, p, _ = world()
    rng = np.random.default_rng(2)
    delta = rng.normal(size=(40, 6)) * np.repeat([2.0, 0.003], 3)
    score = rng.normal(size=40)
    _, jacobian = project_with_jacobians(p)
    some = jacobian[:: max(len(jacobian) // 60, 1)]

    def apart(a: int, b: int) -> float:
        return float(np.sqrt(((some @ (delta[a] - delta[b])) ** 2).sum(axis=1).mean()))

    kept: list[int] = []
    for row in sorted(range(40), key=lambda row: -score[row]):
        if all(apart(row, other) >= 3.0 for other in kept) and len(kept) < 5:
            kept.append(row)
    found: Ints = keep_distinct(p, delta, score, 3.0, 5)
    assert found.tolist() == kept


@pytest.mark.parametrize("distance", [400.0, 1600.0])
def test_a_shift_of_the_picture_is_by_turning_and_moving_together(distance: float) -> None:
    plate = box_scene([(np.array([-40.0, -40, 298 - distance]), np.array([80.0, 80, 2]))])
    camera = Camera(640, 480, np.array([[800.0, 0, 320], [0, 700, 240], [0, 0, 1]]))
    pose = np.diag([1.0, -1, -1, 1])
    pose[2, 3] = 300.0
    prior = Prior.isotropic(pose, 3.0, 0.004)
    found = predict_shift_sigma(plate, Rig({"one": camera}, {"one": np.eye(4)}), prior)
    assert found == pytest.approx(800 * np.hypot(0.004, 3.0 / (distance + 1)), rel=0.01)


def test_samples_are_thinned_to_those_that_come_into_a_picture() -> None:
    """From either of two poses; what is kept stands for what is left out, as dense as the nearer pose asks for."""
    plate = box_scene([(np.array([-300.0, -40, -502]), np.array([600.0, 80, 2]))])
    rig = Rig({"one": Camera(640, 480, np.array([[800.0, 0, 320], [0, 800, 240], [0, 0, 1]]))}, {"one": np.eye(4)})
    poses = np.stack([np.diag([1.0, -1, -1, 1])] * 2)
    poses[:, :3, 3] = (-250, 0, 0), (-230, 0, -100)

    def is_seen(point: Floats) -> Bools:
        off, ahead = point[:, 0, None] - poses[:, 0, 3], poses[:, 2, 3] - point[:, 2, None]
        return np.asarray((np.abs(off) * 800 < 331 * ahead).any(axis=1))

    kept, length = select_samples(plate, rig, poses, 10.0), plate.sample_length[is_seen(plate.sample_point)].sum()
    assert is_seen(kept.sample_point).all()
    assert kept.sample_length.sum() == pytest.approx(length, rel=0.02)
    assert len(kept.sample_length) == pytest.approx(2 * length / 4, rel=0.1)


def test_elements_lie_where_the_lens_cannot_put_others() -> None:
    camera = Camera(640, 480, np.array([[500.0, 0, 322], [0, 510, 236], [0, 0, 1]]))
    assert [v.tolist() for v in bound_elements(camera)] == [[6.0, 6.0], [633.0, 473.0]]
    barrel = replace(camera, distortion=np.array([-0.2, 0.03, 0.001, -0.002]))
    low, high = bound_elements(barrel)
    rng = np.random.default_rng(0)
    inside = barrel.undistort(rng.uniform((6, 6), (633, 473), (40000, 2)))
    assert (inside >= low - 0.01).all()
    assert (inside <= high + 0.01).all()
    assert np.abs([inside.min(axis=0) - low, high - inside.max(axis=0)]).max() < 4


def test_fields_are_joined_one_behind_the_other() -> None:
    each = [build_evidence(some_edges(seed), 4.0, 6.0, 2) for seed in (4, 5)]
    fields = Fields(each)
    assert fields.joined.tolist() == [*each[0].field.ravel().tolist(), *each[1].field.ravel().tolist()]
    for one, other in zip(fields, each, strict=True):
        assert isinstance(one, Evidence)
        assert np.shares_memory(one.field, fields.joined)
        assert (one.field == other.field).all()


def test_a_scan_finds_of_each_pose_the_turn_that_gathers_most() -> None:
    """Of a few poses of the sequence, against sums over the samples at each of 121 shifts of the pictures."""
    _, p, _ = world()
    some = (replace(some_edges(k, 4000), high=np.array([633.0, 473])) for k in (6, 7))
    coarse = Fields(build_evidence(it, 4.0, 6.0, 10) for it in some)
    rng = np.random.default_rng(4)
    half = rng.normal(size=(6, 6)) * np.repeat([9.0, 0.03], 3)[:, None]
    prior = Prior(np.eye(4), half @ half.T)
    found, score = scan_prior(p, coarse, prior, 5)
    _, jacobian = project_with_jacobians(p)
    centred = np.concatenate([jacobian[p.view == c] - jacobian[p.view == c].mean(axis=0) for c in (0, 1)])
    square = np.einsum("nij,jk,nik->n", centred, prior.covariance, centred).mean()
    count = 2 ** int(np.ceil(np.log2(np.clip(1024 * square / 15**2, 1024, 16384))))
    assert (len(score), count > 1024) == (count, True)
    sequence = np.clip(qmc.Sobol(6, scramble=True, seed=5).random(count), 1e-4, 1 - 1e-4)
    begun = norm.ppf(sequence) @ np.linalg.cholesky(prior.covariance).T
    begun[0] = 0
    turn = [np.median(jacobian[p.view == c][:, :, 3:], axis=0) for c in (0, 1)]
    shifts = [(x, y) for y in range(-10, 11, 2) for x in range(-10, 11, 2)]
    turns = [np.linalg.lstsq(turn[0], 4.0 * np.array(shift), rcond=None)[0] for shift in shifts]
    for row in (0, 77, count - 1):
        at, out = ((project_with_jacobians(p, begun[row])[0] - coarse[0].origin) / 4.0), []
        along = project_directions(p, begun[row])
        for added in turns:
            moved = begun[row] + np.append(np.zeros(3), added)
            total = -0.5 * moved @ np.linalg.solve(prior.covariance, moved)
            for i, c in enumerate(p.view):
                field = coarse[c].field[turn_of(along[i])]
                (x, y), (rows, columns) = np.rint(at[i]).astype(int), field.shape
                if 10 <= x < columns - 10 and 10 <= y < rows - 10:
                    dx, dy = np.clip(np.rint(turn[c] @ added / 4.0), -10, 10).astype(int)
                    total += p.weight[i] * field[y + dy, x + dx]
            out.append(total)
        assert score[row] == pytest.approx(max(out), rel=1e-5)
        np.testing.assert_allclose(found[row] - begun[row], [0, 0, 0, *turns[int(np.argmax(out))]], atol=1e-9)
