"""Curves in space against the curves that were drawn."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares

from relmodel.arrays import Floats
from tests.vision.stereo.scenes import CENTRE, packed, parallel_rig, place, random_pair
from vision.extraction.arcs import ELLIPTIC, FREE, LINE
from vision.stereo.epipolar import StereoArcs, cross_rows, pair_crossings, rectify
from vision.stereo.stereo_parameters import DEFAULTS
from vision.stereo.triangulate import CURVES, Conics, DisparityPlanes, fit_conics, triangulate_pairs

FLAT = rectify(parallel_rig())


def by_loops(left: StereoArcs, right: StereoArcs, i: int, j: int) -> tuple[Floats, Floats]:
    """Ends (6,) of a pair in space and covariance (6, 6): by rows of equations, prior and all, and by differences."""
    a, b = (s.points[s.offsets[k] : s.offsets[k + 1]] - CENTRE for s, k in ((left, i), (right, j)))
    shared = np.flatnonzero((a[:, 1] >= b[:, 1].min() - 1) & (a[:, 1] <= b[:, 1].max() + 1))
    at = [shared[0], shared[-1]] if len(shared) else [0, len(a) - 1]
    middle = a[at].mean(axis=0)
    shift = np.hypot(0.07, 1.45 * (left.width[i] - right.width[j]))
    views = ((FLAT.first, left), (FLAT.second, right))
    one, other = (cross_rows(FLAT, view, arcs, 8, 0.05) for view, arcs in views)
    _, x, y = pair_crossings(one, other, (np.array([i]), np.array([j])), DEFAULTS.epipolar)
    rows = [
        (one.x[p], one.row[p], one.x[p] - other.x[q], np.sign(one.contrast[p]) / np.cos(one.angle[p]),
         np.hypot(one.sigma[p] * np.sqrt(len(a)), other.sigma[q] * np.sqrt(len(b)))) for p, q in zip(x, y, strict=True)
    ]  # fmt: skip
    ends = b[[0, -1]] if (a[-1] - a[0]) @ (b[-1] - b[0]) >= 0 else b[[-1, 0]]
    longer = np.linalg.norm(a[-1] - a[0]) - np.linalg.norm(b[-1] - b[0])
    for mine, theirs in zip(a[[0, -1]], ends, strict=True):
        sigma = np.sqrt(2 * 2.0**2 + longer**2 + (mine[1] - theirs[1]) ** 2)
        rows.append((mine[0], mine[1], mine[0] - theirs[0], 0.0, sigma))
    px, py, disparity, turn, sigma = np.array(rows).T
    design = np.column_stack([px - middle[0], py - middle[1], np.ones(len(px)), turn])
    prior = np.diag([1 / 0.5, 1 / 0.5, 0, 1 / shift])
    weight = 1 / sigma
    for _ in range(3):
        equations = np.vstack([weight[:, None] * design, prior])
        fit = np.linalg.lstsq(equations, np.append(weight * disparity, np.zeros(4)), rcond=None)[0]
        spread = np.linalg.pinv(equations) @ np.linalg.pinv(equations).T
        square = ((disparity - design @ fit) / sigma) ** 2
        scale = max(square.sum() / max(len(square) - 3, 1), 1.0)
        weight = 1 / (sigma * np.sqrt(scale * (1 + square / scale / 4)))
    tangent = np.array([a[min(k + 6, len(a) - 1)] - a[max(k - 6, 0)] for k in at])
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    known = {left.kind[i], right.kind[j]} in ({LINE}, {ELLIPTIC})
    seen = np.array([[*(a[k] - middle), 1.0, 0.0] for k in at])
    deep = seen @ spread @ seen.T
    deep += np.diag(((0.3 if known else 0.8) / np.maximum(np.abs(tangent[:, 1]), 0.05)) ** 2)
    lateral = np.sqrt(left.sigma[i] ** 2 + shift**2 / 2 + 0.5**2)

    def placed(start: Floats, end: Floats) -> Floats:
        return np.concatenate([place(*np.asarray(p)[:, None])[:, 0] for p in (start, end)])

    def moved(k: int, way: Floats) -> Floats:
        off = np.zeros((2, 3))
        off[k] = 1e-3 * np.asarray(way)
        return (placed(*(found + off)) - placed(*(found - off))) / 2e-3

    found = np.column_stack([a[at], np.maximum(seen @ fit, 0.1)])
    jacobian = np.column_stack([moved(k, np.array([0, 0, 1.0])) for k in (0, 1)])
    covariance = jacobian @ deep @ jacobian.T
    for k, (tx, ty) in enumerate(tangent):
        across, along = moved(k, np.array([-ty, tx, 0])), moved(k, np.array([tx, ty, tx * fit[0] + ty * fit[1]]))
        covariance += lateral**2 * np.outer(across, across) + 2.0**2 * np.outer(along, along)
    return placed(*found), covariance


@pytest.mark.parametrize("seed", [0])
def test_ends_and_their_covariance_are_those_of_loops(seed: int) -> None:
    left, right, partner = random_pair(seed)
    right = replace(right, points=right.points.copy())
    k = partner[0]
    left.kind[[1, 2]], right.kind[partner[[1, 2]]] = [ELLIPTIC, LINE], [LINE, FREE]  # one picture shows another kind
    right.points[right.offsets[k] + 12] += [9.0, 0.0]  # one point far off the others
    found = triangulate_pairs(FLAT, left, right, (np.arange(len(left)), partner))
    for i, j in enumerate(partner):
        ends, covariance = by_loops(left, right, i, int(j))
        np.testing.assert_allclose(np.append(found.start[i], found.end[i]), ends, rtol=1e-8)
        np.testing.assert_allclose(found.covariance[i], covariance, rtol=1e-5, atol=1e-6 * covariance.max())
        sigma, width = (max(getattr(left, name)[i], getattr(right, name)[j]) for name in ("sigma", "width"))
        odds = -2.69 - 0.95 * np.log(sigma + 1e-3) - 1.85 * max(width - 0.9, 0)
        assert found.edge_probability[i] == pytest.approx(1 / (1 + np.exp(-odds)))
        if {left.kind[i], right.kind[j]} != {ELLIPTIC}:
            assert CURVES[found.curve[i]] == ("line" if {left.kind[i], right.kind[j]} == {LINE} else "free")


def test_what_is_infinitely_far_counts_as_far_as_a_tenth_of_a_pixel() -> None:
    line = np.column_stack([np.linspace(0, 20, 60), np.arange(60.0)])
    one = np.ones(1)
    arcs = packed([line], 30 * one, one, np.full(1, LINE), 0.1 * one)
    found = triangulate_pairs(FLAT, arcs, arcs, (np.zeros(1, np.int64), np.zeros(1, np.int64)))
    assert found.start[0, 2] == pytest.approx(1300 * 100 / 0.1)


def plane(value: list[float], spread: float, uneven: float = 0.0) -> DisparityPlanes:
    """A plane of disparity about (30, -20), as sure as `spread`, px, in each of its three values."""
    own = np.diag([1.0, 2.0, 900.0]) + np.array([[0, 0.5, 10], [0.5, 0, 9], [10, 9, 0]])
    middle = np.array([[30.0, -20.0]])
    return DisparityPlanes(np.array([value]), spread**2 * own[None], middle, np.array([0.6]), np.array([uneven]))


def fit_one(points: Floats, planes: DisparityPlanes) -> Conics:
    ends = np.array([1]), np.array([len(points)])  # a point before and one behind do not belong to it
    points = np.vstack([[[9, 9]], points, [[1, 1]]])
    return fit_conics(FLAT, points, *ends, planes, np.array([0]), DEFAULTS.triangulation)


def circle_on(value: Floats, points: Floats) -> Floats:
    """Centre, normal, radius (7,) of the circle that another library puts through points on a plane of disparity, and
    their mean square distance, then the covariance (3, 3) of the centre on the plane and radius for unit noise."""
    d = np.column_stack([points - [30, -20], np.ones(len(points))]) @ value
    space = place(points[:, 0], points[:, 1], d).T
    middle = space.mean(axis=0)
    axes = np.linalg.svd(space - middle)[2]
    flat = (space - middle) @ axes[:2].T
    start = np.append(flat.mean(axis=0), np.ptp(flat) / 2)

    def off(q: Floats) -> Floats:
        return np.asarray(np.linalg.norm(flat - q[:2], axis=1) - q[2])

    fit = least_squares(off, start, xtol=1e-15, ftol=1e-15, gtol=1e-15)
    jacobian = np.asarray(fit.jac, float)
    basis = np.zeros((7, 3))
    basis[:3, :2], basis[6, 2] = axes[:2].T, 1.0
    normal = axes[2] * np.sign(axes[2, 2])
    unit = basis @ np.linalg.inv(jacobian.T @ jacobian) @ basis.T
    of_pixel = (
        np.linalg.norm(np.diff(space, axis=0), axis=1).sum() / np.linalg.norm(np.diff(points, axis=0), axis=1).sum()
    )
    ground = basis[:3, :2] @ basis[:3, :2].T
    own = np.concatenate([middle + fit.x[:2] @ axes[:2], normal, fit.x[2:]])
    return np.concatenate([own, [np.mean(fit.fun**2), of_pixel], unit.ravel(), ground.ravel()])


@pytest.mark.parametrize("uneven", [0.0, 0.04])
def test_a_circle_and_its_covariance_are_those_of_another_fit(uneven: float) -> None:
    """Half a circle, somewhat uneven, on a plane that leans."""
    rng, value, spread = np.random.default_rng(2), np.array([0.02, -0.05, 240.0]), 2e-6
    t = np.linspace(0.2, 3.6, 70)
    points = np.column_stack([30 + 70 * np.cos(t), -20 + 66 * np.sin(t)]) + rng.normal(0, 0.2, (70, 2))
    planes = plane(list(value), spread, uneven=1e-2 * uneven)
    found, expected = fit_one(points, planes), circle_on(value, points)
    np.testing.assert_allclose(found.centre[0], expected[:3], rtol=1e-6)
    assert np.linalg.norm([found.major[0], found.minor[0]], axis=1) == pytest.approx(np.full(2, expected[6]), rel=1e-6)
    assert found.major[0] @ found.minor[0] == pytest.approx(0, abs=1e-9)
    np.testing.assert_allclose([found.major[0] @ expected[3:6], found.minor[0] @ expected[3:6]], 0, atol=1e-6)
    step = np.array([1e-5, 1e-5, 1e-3])
    by_value = np.column_stack(
        [(circle_on(value + s, points) - circle_on(value - s, points))[:7] / (2 * s.max()) for s in np.diag(step)]
    )
    extent = np.mean(np.square(points - [30, -20]).sum(axis=1))
    of_plane = planes.covariance[0] + np.diag([1, 1, 0]) * (1e-2 * uneven) ** 2 / extent
    square, of_pixel = expected[7:9]
    own = 5.0 * (square + (0.1 * of_pixel) ** 2) * expected[9:58].reshape(7, 7)
    own[:3, :3] += (0.3 * of_pixel) ** 2 * expected[58:].reshape(3, 3)
    own[6, 6] += (0.6 * of_pixel) ** 2
    whole = by_value @ of_plane @ by_value.T + own
    scale = np.sqrt(np.outer(np.diag(whole), np.diag(whole)))
    np.testing.assert_allclose(found.covariance[0] / scale, whole / scale, atol=0.02)


@pytest.mark.parametrize(
    ("ratio", "turn", "noise", "spread", "curve"),
    [
        (0.9, 6.28, 0.0, 0.0, "ellipse"),
        (0.94, 6.28, 0.0, 0.0, "ellipse"),
        (0.96, 6.28, 0.0, 0.0, "circle"),  # too round
        (0.6, 3.9, 0.0, 0.0, "ellipse"),
        (0.6, 3.5, 0.0, 0.0, "circle"),  # too little of it is seen
        (0.9, 6.28, 1.1, 0.0, "ellipse"),
        (0.9, 6.28, 1.35, 0.0, "circle"),  # explains too little more
        (0.9, 6.28, 0.0, 2.4e-3, "ellipse"),
        (0.9, 6.28, 0.0, 2.7e-3, "circle"),  # the plane may lean by 0.0175, three of which are above 0.05
    ],
)
def test_what_an_ellipse_must_show(ratio: float, turn: float, noise: float, spread: float, curve: str) -> None:
    """On a plane square to the axes of the cameras, 200 px of disparity: half a mm a px."""
    t = np.linspace(0, turn, 90)
    radial = 1 + noise / 60 * np.where(np.arange(90) % 2 == 0, 1, -1)
    flat = 60 * radial * np.array([np.cos(t), ratio * np.sin(t)])
    points = np.column_stack([30 + 0.8 * flat[0] - 0.6 * flat[1], -20 + 0.6 * flat[0] + 0.8 * flat[1]])
    planes = plane([0.0, 0.0, 200.0], 1e-9)
    planes = replace(planes, covariance=planes.covariance + np.diag([spread**2 / 4, spread**2, 0])[None])
    found = fit_one(points, planes)
    assert CURVES[1 if found.is_circle[0] else 2] == curve
    if curve == "ellipse":
        np.testing.assert_allclose(found.centre[0], [15, -10, 650], atol=0.01)
        np.testing.assert_allclose(found.major[0] * np.sign(found.major[0, 0]), [24, 18, 0], atol=0.02)
        minor = found.minor[0] * -np.sign(found.minor[0, 0])
        np.testing.assert_allclose(minor, ratio * np.array([-18, 24, 0]), atol=0.1)


@pytest.mark.parametrize(("count", "some"), [(7, True), (6, False)])
def test_a_circle_needs_seven_points(count: int, some: bool) -> None:
    t = np.linspace(0, 3, count)
    points = np.column_stack([30 + 50 * np.cos(t), -20 + 50 * np.sin(t)])
    assert np.isfinite(fit_one(points, plane([0.0, 0.0, 200.0], 1e-3)).centre).all() == some
