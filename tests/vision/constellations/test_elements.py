"""Ellipses of a picture, and pairs of straight edges, against closed forms and derivatives by differences."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from relmodel.arrays import Floats
from tests.vision.constellations.test_join import EVERY, edges
from tests.vision.constellations.test_one_picture import CAMERA, MATRIX, before_the_camera, ellipses_of
from vision.cameras.cameras import perturb
from vision.constellations.constellation_parameters import EllipseParameters, OnePictureParameters
from vision.constellations.elements import (
    EllipseFit,
    JoinedPairs,
    Lines,
    PictureEllipses,
    find_ellipses,
    relate_lines,
    solve_line_poses,
    to_matrices,
    to_rows,
)
from vision.extraction.arcs import CIRCULAR, ELLIPTIC, LINE
from vision.extraction.rows import Primitives

# centre, semi-axes, turn, share of the way round that is seen, points, noise (px), kind; which are taken
DRAWN = [
    (300, 200, 40, 30, 0.3, 1.0, 60, 0.0, ELLIPTIC, True),
    (300.5, 201, 41.5, 31, 0.3, 0.7, 60, 0.0, ELLIPTIC, False),  # the same rim
    (302.5, 200, 40, 30, 0.3, 0.55, 60, 0.0, ELLIPTIC, True),
    (300.5, 200, 45, 30, 0.3, 0.9, 60, 0.0, CIRCULAR, True),
    (600, 400, 50, 50.0, 0.0, 0.5, 60, 0.8, CIRCULAR, True),
    (600, 700, 50, 45, 0.0, 1.0, 60, 1.2, ELLIPTIC, False),  # too rough
    (800, 400, 80, 20, 1.0, 1.0, 12, 0.0, ELLIPTIC, True),
    (800, 600, 80, 20, 1.0, 1.0, 11, 0.0, ELLIPTIC, False),
    (900, 200, 60, 50, 1.0, 0.37, 60, 0.0, ELLIPTIC, True),
    (950, 300, 60, 50, 1.0, 0.33, 60, 0.0, ELLIPTIC, False),  # too little of it
    (1000, 400, 20, 3.1, -1.0, 1.0, 60, 0.0, ELLIPTIC, True),
    (1050, 500, 20, 2.9, -1.0, 1.0, 60, 0.0, ELLIPTIC, False),  # too flat
    (1100, 700, 20, 10, -1.0, 1.0, 60, 0.0, LINE, False),
]


def test_ellipses_are_those_of_the_arcs_that_show_enough_with_what_is_known_of_them() -> None:
    points, length, rough = [], [], []
    for x, y, a, b, turn, share, count, noise, _, _ in DRAWN:
        t = 2 * np.pi * share * np.arange(count) / (count - (share < 1))
        radial = 1 + noise * np.where(np.arange(count) % 2, 1, -1) / a
        u, v = radial * a * np.cos(t), radial * b * np.sin(t)
        cosine, sine = np.cos(turn), np.sin(turn)
        points.append(np.column_stack([x + cosine * u - sine * v, y + sine * u + cosine * v]))
        length.append(2 * np.pi * np.sqrt((a * a + b * b) / 2) * share)
        rough.append(noise)
    offsets = np.concatenate([[0], np.cumsum([len(p) for p in points])])
    arcs = SimpleNamespace(kind=np.array([d[8] for d in DRAWN]), length=np.array(length), offsets=offsets)
    x, y = np.concatenate(points).T
    picture = cast(Primitives, SimpleNamespace(arcs=arcs, elements=SimpleNamespace(x=x, y=y)))
    found = find_ellipses(picture, CAMERA, EllipseParameters())
    used = sorted((d for d in DRAWN if d[9]), key=lambda d: -d[5] * d[2])
    np.testing.assert_allclose(found.centre, [d[:2] for d in used], atol=2)
    for k, (_, _, a, b, turn, share, _, noise, _, _) in enumerate(used):
        assert (found.major[k], found.minor[k]) == pytest.approx((a, b), rel=0.05 if noise else 5e-3)
        assert found.seen[k] == pytest.approx(share, abs=0.02 if noise else 5e-3)
        if a > b:
            assert np.sin(found.angle[k] - turn) == pytest.approx(0, abs=1e-3)
        size = 0.25 + (0.5 if share < 0.6 else 0.0) + noise
        assert found.size_share[k] == pytest.approx(size / a, rel=0.05)
        ratio = found.minor[k] / found.major[k]
        lean = np.arccos(max(ratio - 2 * size / a, 0)) - np.arccos(min(ratio + 2 * size / a, 1.0))
        assert found.tilt[k] == pytest.approx(np.clip(lean / 2, 0.02, 0.35), rel=0.05)
    few = find_ellipses(picture, CAMERA, EllipseParameters(most=3))
    np.testing.assert_array_equal(few.centre, found.centre[:3])
    # On the ellipse the conic is 0, inside less.
    t = np.linspace(0, 6, 20)[:, None]
    axis, across = (f * np.array([np.cos(found.angle + s), np.sin(found.angle + s)]).T for f, s in (
        (found.major[:, None], 0.0), (found.minor[:, None], np.pi / 2)))  # fmt: skip
    for k, conic in enumerate(found.conics):
        on = np.column_stack([found.centre[k] + np.cos(t) * axis[k] + np.sin(t) * across[k], np.ones(20)])
        np.testing.assert_allclose(np.einsum("ni,ij,nj->n", on, conic, on), 0, atol=1e-9)
        assert np.append(found.centre[k], 1) @ conic @ np.append(found.centre[k], 1) == pytest.approx(-1)


def pair_of(ends: Floats, turn: float | None = None) -> Floats:
    """Of two lines by their ends (12,), laid to within 90 degrees: cosine, distance, then the stretches from the feet,
    low and high of each, and both feet."""
    a, p, b, q = ends.reshape(4, 3)
    d, e = (p - a) / np.linalg.norm(p - a), (q - b) / np.linalg.norm(q - b)
    e = e * (turn or (1.0 if d @ e >= 0 else -1.0))
    (s, t), *_ = np.linalg.lstsq(np.column_stack([d, -e]), b - a, rcond=None)
    feet = a + s * d, b + t * e
    across = np.cross(d, e) / np.linalg.norm(np.cross(d, e))
    seen = [sorted([(x - foot) @ w, (y - foot) @ w]) for x, y, foot, w in ((a, p, feet[0], d), (b, q, feet[1], e))]
    return np.array([d @ e, (feet[1] - feet[0]) @ across, *seen[0], *seen[1], *feet[0], *feet[1], *d, *e])


def unsure(count: int, seed: int) -> Lines:
    """Edges whose ends have covariances of any shape across them: what shifts an end along the edge is no turn."""
    lines, rng = edges(count, seed), np.random.default_rng(seed)
    direction = (lines.end - lines.start) / lines.length[:, None]
    across = np.eye(3) - direction[:, :, None] * direction[:, None]
    root = (across[:, None] @ rng.normal(0, 0.7, (count, 2, 3, 6))).reshape(count, 6, 6)
    return replace(lines, covariance=root @ root.transpose(0, 2, 1))


def sigmas_of(lines: Lines, i: int, j: int) -> Floats:
    """Standard deviations of cosine and distance, by differences."""
    ends = np.concatenate([lines.start[i], lines.end[i], lines.start[j], lines.end[j]])
    turn = 1.0 if cosine_of(lines, i, j) >= 0 else -1.0
    by = np.array([(pair_of(ends + s, turn)[:2] - pair_of(ends - s, turn)[:2]) / 2e-4 for s in 1e-4 * np.eye(12)])
    parts = [by[side].T @ lines.covariance[k] @ by[side] for side, k in ((slice(6), i), (slice(6, 12), j))]
    return np.sqrt(np.diag(parts[0] + parts[1]))


def test_pairs_of_edges_have_what_a_cut_does_not_change_and_how_sure_it_is() -> None:
    lines = unsure(16, 5)
    found = relate_lines(lines, EVERY)
    expected = {}
    for i, j in combinations(range(16), 2):
        ends = np.concatenate([lines.start[i], lines.end[i], lines.start[j], lines.end[j]])
        if abs(cosine_of(lines, i, j)) <= 0.9:
            sigma = sigmas_of(lines, i, j)
            if sigma[1] <= 4.0 and sigma[0] <= 0.1:
                turned = 1.0 if cosine_of(lines, i, j) >= 0 else -1.0
                expected[i, j] = [*pair_of(ends)[:6], *sigma, 1.0, turned]
    assert list(zip(found["unit_a"].tolist(), found["unit_b"].tolist(), strict=True)) == list(expected)
    assert len(expected) > 20
    names = ("cosine", "distance", "low_a", "high_a", "low_b", "high_b", "cosine_sigma", "distance_sigma", "sign_a")
    rows = np.stack([found[name] for name in (*names, "sign_b")], axis=1)
    np.testing.assert_allclose(rows, list(expected.values()), rtol=1e-5, atol=1e-7)


def test_joined_edges_meet_in_the_middle_of_their_feet_and_of_their_directions() -> None:
    scene, model = edges(12, 6), edges(12, 7)
    rows = [(i, j) for i, j in combinations(range(12), 2) if abs(cosine_of(scene, i, j)) < 0.9]
    rows = [(i, j) for i, j in rows if abs(cosine_of(model, i, j)) < 0.9]
    sign = np.random.default_rng(0).choice([-1, 1], (len(rows), 2))
    pairs = np.array(rows)
    poses = solve_line_poses(scene, model, JoinedPairs(pairs, pairs, np.ones(len(rows), np.int64), sign))
    for pose, (i, j), (s, t) in zip(poses, rows, sign, strict=True):
        here, there = (
            pair_of(np.concatenate([lines.start[i], lines.end[i], lines.start[j], lines.end[j]]))[6:].reshape(4, 3)
            for lines in (scene, model)
        )
        np.testing.assert_allclose(pose[:3, :3] @ pose[:3, :3].T, np.eye(3), atol=1e-9)
        middle = (here[0] + here[1]) / 2
        np.testing.assert_allclose(pose[:3, :3] @ middle + pose[:3, 3], (there[0] + there[1]) / 2, atol=1e-7)
        turned = 1 if cosine_of(scene, i, j) >= 0 else -1
        d, e = s * here[2], t * turned * here[3]
        midway = [(a + b) / np.linalg.norm(a + b) for a, b in ((d, e), (there[2], there[3]))]
        across = [np.cross(a, b) / np.linalg.norm(np.cross(a, b)) for a, b in ((d, e), (there[2], there[3]))]
        np.testing.assert_allclose(pose[:3, :3] @ midway[0], midway[1], atol=1e-9)
        np.testing.assert_allclose(pose[:3, :3] @ across[0], across[1], atol=1e-9)


def cosine_of(lines: Lines, i: int, j: int) -> float:
    d, e = (lines.end[k] - lines.start[k] for k in (i, j))
    return float(d @ e / np.linalg.norm(d) / np.linalg.norm(e))


MOVES = [[0, 0, 0, 0, 0, 0], [2, -1, 9, 0.002, 0.001, 0], [-9, 3, 30, 0.01, 0.02, -0.02], [250, 90, 0, 0, 0, 1.5]]
POSES = perturb(np.eye(4), np.array(MOVES))


def test_scores_are_the_log_odds_that_loops_find() -> None:
    """Of circles in view and outside, on edge, behind the camera and before it, and of ellipses of all likenesses."""
    model = before_the_camera(40, 3)
    rng = np.random.default_rng(0)
    found, _ = ellipses_of(model.take(np.arange(30)))
    e = PictureEllipses(
        found.centre + rng.normal(0, 3, found.centre.shape), found.major * rng.normal(1, 0.03, len(found)),
        found.minor * rng.normal(1, 0.08, len(found)), found.angle, found.seen, found.size_share, found.tilt,
    )  # fmt: skip
    model.centre[30:34] += [0, 0, -1500]
    model.centre[34:37, 0] += 500
    ray = model.centre[37] / np.linalg.norm(model.centre[37])
    model.normal[37] = np.cross(ray, [1, 0, 0]) / np.linalg.norm(np.cross(ray, [1, 0, 0]))
    score, which = EllipseFit(e, CAMERA, model, OnePictureParameters()).score(to_rows(POSES))
    for k, pose in enumerate(np.linalg.inv(POSES)):
        centre, normal = model.centre @ pose[:3, :3].T + pose[:3, 3], model.normal @ pose[:3, :3].T
        seen = []
        for i, (c, n) in enumerate(zip(centre, normal, strict=True)):
            u, v, _ = MATRIX @ c / c[2]
            cosine = abs(c @ n) / np.linalg.norm(c)
            if c[2] > 10 and 0 < u < 1280 and 0 < v < 960 and cosine >= 0.1:
                seen.append((i, u, v, 1500 * model.radius[i] / c[2], cosine))
        total = 0.0
        for j in range(len(e)):
            sigma = 3 + 0.05 * e.major[j]
            square = [
                ((u - e.centre[j, 0]) ** 2 + (v - e.centre[j, 1]) ** 2) / sigma**2
                + ((wide / e.major[j] - 1) / 0.04) ** 2
                + ((cosine - e.minor[j] / e.major[j]) / 0.12) ** 2
                for _, u, v, wide, cosine in seen
            ]
            like = np.exp(-0.5 * min(square)) if square and min(square) < 16 else 0.0
            chance = 0.15 * len(seen) * np.pi * (2 * sigma) ** 2 / (1280 * 960)
            total -= like * np.log(np.clip(chance, 1e-4, 0.9))
            assert which[k, j] == (seen[int(np.argmin(square))][0] if like > 0.05 else -1)
        assert score[k] == pytest.approx(total)
    assert (which[0] >= 0).sum() > (which[1] >= 0).sum() > 3


@pytest.mark.parametrize("wrong", [False, True])
def test_a_fit_ends_where_no_step_lessens_the_distances(wrong: bool) -> None:
    """Nine circles, the ellipse of one of which may be too far off to count fully; by Sampson's distances."""
    model = before_the_camera(9, 4)
    found, of = ellipses_of(model)
    rng = np.random.default_rng(0)
    e = PictureEllipses(
        found.centre + rng.normal(0, 1, (9, 2)) + wrong * 40.0 * (np.arange(9) == 2)[:, None], found.major,
        found.minor * 0.98, found.angle, found.seen, found.size_share, found.tilt,
    )  # fmt: skip
    fit = EllipseFit(e, CAMERA, model, OnePictureParameters(rounds=30 if wrong else 5))
    t = np.arange(8) * np.pi / 4
    points = []
    for c, n, r in zip(model.centre, model.normal, model.radius, strict=True):
        across = np.cross(n, np.eye(3)[np.argmin(np.abs(n))])
        across /= np.linalg.norm(across)
        points.append(c + r * (np.cos(t)[:, None] * across + np.sin(t)[:, None] * np.cross(n, across)))
    order = np.tile(of, (2, 1))
    led, off = fit.fit(to_rows(POSES[[0, 1]]), order, np.tile(np.arange(9), (2, 1)))
    pose = np.linalg.inv(to_matrices(led))[1]

    def levels(step: Floats) -> tuple[Floats, Floats]:
        """Of each point after a step of a turn and a shift: what the conic says, and by how many px of it."""
        out = []
        for j, i in enumerate(of):
            p = points[i] @ pose[:3, :3].T @ Rotation.from_rotvec(step[:3]).as_matrix().T + pose[:3, 3] + step[3:]
            seen = p @ MATRIX.T / p[:, 2:]
            level = seen @ e.conics[j]
            out.append(((level * seen).sum(axis=1), 2 * np.linalg.norm(level[:, :2], axis=1)))
        value, length = zip(*out, strict=True)
        return np.concatenate(value), np.concatenate(length)

    value, length = levels(np.zeros(6))
    distance = value / length
    by = np.array([(levels(s)[0] - levels(-s)[0]) / 2e-5 / length for s in 1e-5 * np.eye(6)])
    pull = np.minimum(1, 5 / np.abs(distance)) * distance
    assert (np.abs(distance) > 5).any() == wrong
    np.testing.assert_allclose(by @ pull / np.linalg.norm(by, axis=1), 0, atol=1e-3)
    np.testing.assert_allclose(off, np.sqrt(np.mean(distance**2)), rtol=1e-4)
    # What is named -1 is left out, and one step from afar is no farther than 0.3 rad.
    few = np.where(np.arange(9) < 6, order, -1)
    np.testing.assert_array_less(fit.fit(to_rows(POSES[[0, 1]]), few, np.tile(np.arange(9), (2, 1)))[1], off + 2)
    behind = POSES[:1].copy()
    behind[0, 2, 3] = 2000
    assert fit.fit(to_rows(behind), order[:1], np.arange(9)[None])[1] == np.inf
    once = EllipseFit(e, CAMERA, model, OnePictureParameters(rounds=1))
    start = perturb(np.eye(4), np.array([[0, 0, 0, 0, 0, 1.0]]))
    turned = to_matrices(once.fit(to_rows(start), order[:1], np.arange(9)[None])[0])[0]
    assert np.linalg.norm(Rotation.from_matrix(turned[:3, :3].T @ start[0, :3, :3]).as_rotvec()) <= 0.3 + 1e-9


@pytest.mark.parametrize(("seen", "limit"), [(1.0, 1.2 + 0.5), (0.5, 1.2 + 0.5 + 1.5)])
def test_pairs_are_kept_up_to_the_distance_that_their_ellipses_allow(seen: float, limit: float) -> None:
    """A circle of 50 px as an ellipse too large by `size` px: that is the distance, as nothing else may give way."""
    model = before_the_camera(2, 5)
    model.centre[:], model.normal[:], model.radius[:] = [[0, 0, 750], [200, 0, 750]], [0, 0, -1], 25.0

    def kept(size: float) -> int:
        wide = 50 + size * np.array([1, -1])
        e = PictureEllipses(
            np.array([[640, 480], [1040, 480.0]]), wide, wide * 1510 / 1500, np.zeros(2), np.full(2, seen), np.zeros(2),
            np.zeros(2),
        )  # fmt: skip
        fit = EllipseFit(e, CAMERA, model, OnePictureParameters(rounds=0))
        return len(fit.fit_pairs(to_rows(np.eye(4)[None]), np.array([[0, 1]]), np.array([[0, 1]])))

    assert kept(limit - 0.05) == 1
    assert kept(limit + 0.12) == 0
