"""Curves in space against the curves that were drawn."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest

from relmodel.arrays import Floats
from tests.vision.stereo.scenes import pixels, segment, toed_in_rig
from vision.cameras.cameras import Rig
from vision.extraction.arcs import ELLIPTIC, LINE
from vision.stereo.epipolar import StereoArcs, rectify
from vision.stereo.stereo_parameters import DEFAULTS
from vision.stereo.triangulate import CURVES, Conics, SpaceArcs, triangulate_pairs

RIG = toed_in_rig()


def ellipse(centre: npt.ArrayLike, major: npt.ArrayLike, minor: npt.ArrayLike, turn: float = 2 * np.pi) -> Floats:
    t = np.linspace(0, turn, 300)[:, None]
    return np.asarray(centre + np.cos(t) * np.asarray(major) + np.sin(t) * np.asarray(minor))


def draw(
    rig: Rig, name: str, curves: list[Floats], kind: int, noise: float, shift: Floats, rng: np.random.Generator
) -> StereoArcs:
    """Arcs of curves in space, with noise of each point across it and a shift (n,) of each arc as a whole, px."""
    drawn = []
    for curve, off in zip(curves, shift, strict=True):
        seen = pixels(rig, name, curve)
        tangent = np.gradient(seen, axis=0)
        normal = np.column_stack([tangent[:, 1], -tangent[:, 0]]) / np.linalg.norm(tangent, axis=1, keepdims=True)
        drawn.append(seen + normal * (off + rng.normal(0, noise, (len(seen), 1))))
    size = np.array([len(points) for points in drawn])
    return StereoArcs(
        offsets=np.concatenate([[0], np.cumsum(size)]).astype(np.int64),
        points=np.concatenate(drawn),
        contrast=np.full(size.sum(), 40.0),
        kind=np.full(len(drawn), kind),
        sigma=noise / np.sqrt(size),
        width=np.full(len(drawn), 0.8),
    )


def triangulate(
    curves: list[Floats], kind: int, noise: float = 0.0, light: float = 0.0, common: float = 0.0
) -> SpaceArcs:
    rng = np.random.default_rng(5)
    shift = rng.normal(0, light, (2, len(curves))) + rng.normal(0, common, len(curves))
    left, right = (
        draw(RIG, name, curves, kind, noise or 1e-4, s, rng) for name, s in zip(RIG.cameras, shift, strict=True)
    )
    both = np.arange(len(curves))
    return triangulate_pairs(rectify(RIG), left, right, (both, both))


def off_line(point: Floats, line: Floats) -> Floats:
    """From the infinite line through the ends of a polyline to the point."""
    way = (line[-1] - line[0]) / np.linalg.norm(line[-1] - line[0])
    off = point - line[0]
    return np.asarray(off - (off @ way) * way)


def test_lines_lie_where_they_were_drawn() -> None:
    lines = [
        segment([-60, -40, 600], [30, 70, 680]),
        segment([100, -80, 700], [60, 60, 620]),
        segment([-20, 100, 650], [-20, -100, 650]),
    ]
    found = triangulate(lines, LINE)
    for k, line in enumerate(lines):
        assert CURVES[found.curve[k]] == "line"
        assert np.linalg.norm(off_line(found.start[k], line)) < 0.02
        assert np.linalg.norm(off_line(found.end[k], line)) < 0.02
        np.testing.assert_allclose(found.start[k], line[0], atol=2.5)  # cut to whole rows
        np.testing.assert_allclose(found.end[k], line[-1], atol=2.5)
    assert np.isnan(found.conics.centre).all()


def test_a_level_line_is_as_unsure_as_its_ends() -> None:
    """Along the rows only the ends tell how far off it is: to about 2 px, 10 mm here."""
    rectification = rectify(RIG)
    along = rectification.rig_from_rectified[:3, 0]
    middle = rectification.rig_from_rectified[:3, 3] + 640 * rectification.rig_from_rectified[:3, 2]
    line = segment(middle - 60 * along, middle + 60 * along)
    found = triangulate([line], LINE)
    assert np.linalg.norm(off_line(found.start[0], line)) < 0.1
    deep = rectification.rig_from_rectified[:3, 2]
    assert 2 < np.sqrt(deep @ found.covariance[0, :3, :3] @ deep) < 20


@pytest.mark.parametrize("turn", [2 * np.pi, 0.6 * np.pi])
def test_circles_have_their_centre_and_radius(turn: float) -> None:
    centre, radius = np.array([20.0, -30.0, 640.0]), 40.0
    across = np.cross([0.3, -0.2, 1.0], [0, 1.0, 0])
    across /= np.linalg.norm(across)
    other = np.cross([0.3, -0.2, 1.0], across)
    other /= np.linalg.norm(other)
    found = triangulate([ellipse(centre, radius * across, radius * other, turn)], ELLIPTIC)
    assert CURVES[found.curve[0]] == "circle"
    np.testing.assert_allclose(found.conics.centre[0], centre, atol=0.3)
    for axis in (found.conics.major[0], found.conics.minor[0]):
        assert np.linalg.norm(axis) == pytest.approx(radius, rel=0.01)
        assert abs(axis @ np.cross(across, other)) < 0.05 * radius


def test_an_ellipse_is_none_of_them() -> None:
    centre = np.array([20.0, -30.0, 640.0])
    found = triangulate([ellipse(centre, [60, 10, 5], [-5, 30, 0])], ELLIPTIC)
    assert CURVES[found.curve[0]] == "ellipse"
    np.testing.assert_allclose(found.conics.centre[0], centre, atol=0.5)
    assert np.linalg.norm(found.conics.major[0]) == pytest.approx(np.linalg.norm([60, 10, 5]), rel=0.02)
    assert np.linalg.norm(found.conics.minor[0]) == pytest.approx(np.linalg.norm([-5, 30, 0]), rel=0.03)


@pytest.mark.parametrize("kind", ["lines", "circles"])
def test_the_covariance_holds_the_truth(kind: str) -> None:
    """Noise of each point, and shifts of each arc of the size that the parameters say, in each picture and in both."""
    p = DEFAULTS.triangulation
    rng = np.random.default_rng(3)
    curves, circles = [], []
    for _ in range(300):
        middle = rng.uniform([-120, -100, 580], [120, 100, 720])
        if kind == "lines":
            angle, half = rng.uniform(0.3, np.pi - 0.3), rng.uniform(10, 40)
            way = half * np.array([np.cos(angle), np.sin(angle), rng.uniform(-0.3, 0.3)])
            curves.append(segment(middle - way, middle + way))
        else:
            radius = rng.uniform(10, 40)
            tilted = np.array([1.0, 0, 0.2]) / np.hypot(1.0, 0.2)
            circles.append((middle, np.cross(tilted, [0, 1.0, 0]), radius))
            curves.append(ellipse(middle, radius * tilted, [0, radius, 0], np.pi))
    light = float(np.hypot(p.light_sigma, p.local_sigma) / np.sqrt(2))
    found = triangulate(curves, LINE if kind == "lines" else ELLIPTIC, 0.15, light, p.common_sigma)
    held = []
    for k, curve in enumerate(curves):
        for end, block in ((found.start[k], slice(0, 3)), (found.end[k], slice(3, 6))):
            nearest = np.clip(np.argmin(np.linalg.norm(curve - end, axis=1)), 1, len(curve) - 2)
            way = curve[nearest + 1] - curve[nearest - 1]
            across = np.linalg.svd(way[None])[2][1:]
            off = across @ (end - curve[nearest])
            held.append(off @ np.linalg.solve(across @ found.covariance[k, block, block] @ across.T, off) < 5.99)
    assert np.mean(held) >= 0.9
    if kind == "circles":
        off = np.stack([_circle_off(found.conics, k, *circle) for k, circle in enumerate(circles)])
        sigma = np.sqrt(np.einsum("kii->ki", found.conics.covariance))
        for values, parts, name in ((off[:, :3], slice(0, 3), "centre"), (off[:, 3:6], slice(3, 6), "normal")):
            square = np.square(values).sum(axis=1) / np.square(sigma[:, parts]).sum(axis=1)
            assert np.mean(square < 4.0) > 0.85, name
            assert np.median(square) > 0.1, name
        assert np.mean(np.abs(off[:, 6]) < 2 * sigma[:, 6]) > 0.9


def _circle_off(found: Conics, k: int, centre: Floats, normal: Floats, radius: float) -> Floats:
    """By how much (7,) centre, unit normal and radius are off."""
    turned = np.cross(found.major[k], found.minor[k])
    turned *= np.sign(turned @ normal) / np.linalg.norm(turned)
    size = np.linalg.norm(found.major[k])
    return np.concatenate([found.centre[k] - centre, turned - normal, [size - radius]])
