"""Poses of one camera on ellipses: scores against loops, the fit against derivatives by differences."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from relmodel.arrays import Floats
from tests.vision.constellations.test_one_picture import CAMERA, MATRIX, before_the_camera, ellipses_of
from vision.cameras.cameras import perturb
from vision.constellations.constellation_parameters import OnePictureParameters
from vision.constellations.elements import EllipseFit, PictureEllipses, to_matrices, to_rows

POSES = perturb(
    np.eye(4),
    np.array(
        [[0, 0, 0, 0, 0, 0], [2, -1, 9, 0.002, 0.001, 0], [-9, 3, 30, 0.01, 0.02, -0.02], [250, 90, 0, 0, 0, 1.5]]
    ),
)


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
    """Nine circles, the ellipse of one of which may be too far off to count fully; distances by Sampson, whose change
    with what they are divided by is left out."""
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
