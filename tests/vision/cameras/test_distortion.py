"""Lens distortion against OpenCV's projection, its derivatives and its own solver, and edges seen through a lens."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import cv2
import numpy as np
import pytest

from relmodel.arrays import Floats
from tests.vision.cameras.test_cameras import COEFFICIENTS, MATRIX
from vision.cameras import cameras
from vision.cameras.cameras import Camera
from vision.extraction.rows import Primitives
from vision.localisation.hypotheses import collect_edge_points

SKEWED = np.array([[800.0, 3, 310], [0, 790, 245], [0, 0, 1]])


DIRECTIONS = np.random.default_rng(5).uniform(-0.45, 0.45, (400, 2))


@pytest.mark.parametrize("count", [4, 5, 8, 12, 14])
def test_places_and_derivatives_are_those_of_opencv(count: int) -> None:
    coefficients, zero = np.array(COEFFICIENTS[:count]), np.zeros(3)
    points = np.column_stack([DIRECTIONS, np.ones(400)])
    seen, slope = cameras.distort(DIRECTIONS, coefficients)
    wanted, derivatives = cv2.projectPoints(points, zero, zero, np.eye(3), coefficients)
    np.testing.assert_allclose(seen, wanted.reshape(-1, 2), atol=1e-14)
    # At depth 1 a step of the camera aside is one of the direction: columns 3 and 4, after three of rotation.
    np.testing.assert_allclose(slope, np.asarray(derivatives)[:, 3:5].reshape(-1, 2, 2), atol=1e-13)


@pytest.mark.parametrize("count", [0, 4, 5, 8, 12, 14])
def test_undistort_inverts_distort_as_opencv_does(count: int) -> None:
    coefficients = np.array(COEFFICIENTS[:count])
    seen, slope = cameras.distort(DIRECTIONS, coefficients)
    found, at = cameras.undistort(seen, coefficients)
    np.testing.assert_allclose(found, DIRECTIONS, atol=1e-12)
    np.testing.assert_allclose(at, slope, atol=1e-9)
    limit = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 200, 1e-14)
    theirs = cv2.undistortPoints(seen[:, None], np.eye(3), np.append(coefficients, [0.0] * 4)[: max(count, 4)],
                                 R=np.eye(3), P=np.eye(3), criteria=limit)  # fmt: skip
    np.testing.assert_allclose(found, theirs.reshape(-1, 2), atol=1e-9)


def test_nothing_and_one_point_are_undistorted_too() -> None:
    camera = Camera(640, 480, MATRIX, np.array(COEFFICIENTS))
    assert camera.undistort(np.zeros((0, 2))).shape == (0, 2)
    assert camera.distort(camera.normalise(camera.undistort(np.array([[3.0, 4.0]])))) == pytest.approx(
        np.array([[3.0, 4.0]]), abs=1e-9
    )


def lines(camera: Camera, plain: Floats, along: Floats) -> Primitives:
    """Edge elements of straight lines through places (n, 2) of the picture without distortion, as the lens shows them:
    half a pixel of theirs across is one sigma."""
    side = np.stack([along[:, 1], -along[:, 0]], axis=1)
    zero, h = np.zeros(3), 1e-4

    def see(pixel: Floats) -> Floats:
        points = np.column_stack([camera.normalise(pixel), np.ones(len(pixel))])
        seen = cv2.projectPoints(points, zero, zero, np.eye(3), camera.distortion)[0].reshape(-1, 2)
        return np.asarray(seen @ camera.matrix[:2, :2].T + camera.matrix[:2, 2])

    way = (see(plain + h * along) - see(plain - h * along)) / (2 * h)
    normal = np.stack([way[:, 1], -way[:, 0]], axis=1) / np.linalg.norm(way, axis=1, keepdims=True)
    across = (see(plain + h * side) - see(plain - h * side)) / (2 * h)
    sigma = 0.5 * np.einsum("ni,ni->n", across, normal)
    at = see(plain)
    own = {"contrast": np.full(len(at), 50.0), "sigma": sigma, "arc": np.arange(len(at)) % 3 - 1}
    elements = SimpleNamespace(x=at[:, 0], y=at[:, 1], nx=normal[:, 0], ny=normal[:, 1], **own)
    arcs = SimpleNamespace(highlight=np.array([0.0, 0.5]))
    return cast(Primitives, SimpleNamespace(elements=elements, arcs=arcs, grey_range=200.0))


@pytest.mark.parametrize("count", [5, 14])
def test_edges_of_straight_lines_are_straight_again(count: int, monkeypatch: pytest.MonkeyPatch) -> None:
    camera = Camera(640, 480, SKEWED, np.array(COEFFICIENTS[:count]))
    rng = np.random.default_rng(count)
    plain, angle = rng.uniform([40, 40], [600, 440], (300, 2)), rng.uniform(0, 2 * np.pi, 300)
    along = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    picture = lines(camera, plain, along)

    def refuse(*_: Any) -> None:
        raise AssertionError("OpenCV works out derivatives by all that it can calibrate")

    monkeypatch.setattr(cv2, "projectPoints", refuse)
    edges = collect_edge_points(picture, camera, np.full((480, 640), 249.0))
    assert edges.can_show(plain).all()
    np.testing.assert_allclose(edges.position, plain, atol=1e-9)
    np.testing.assert_allclose(edges.normal, np.stack([along[:, 1], -along[:, 0]], axis=1), atol=1e-7)
    aside = np.where(np.arange(300) % 3 == 2, 0.15 * 0.5 / picture.elements.sigma, 0.0)  # .3 px by light beyond white
    np.testing.assert_allclose(edges.sigma, np.hypot(0.5, aside), atol=1e-7)


@pytest.mark.parametrize("count", [0, 5])
def test_light_hides_edges_where_all_about_them_is_as_bright_as_can_be(count: int) -> None:
    """A disc of light: within 5 px of its rim edges show, also where the lens moves them."""
    camera = Camera(640, 480, SKEWED, np.array(COEFFICIENTS[:count]))
    y, x = np.mgrid[:480, :640]
    away = np.hypot(x - 150, y - 120)
    plain = np.random.default_rng(1).uniform([20, 20], [620, 460], (2000, 2))
    picture = lines(camera, plain, np.tile([1.0, 0], (2000, 1)))
    edges = collect_edge_points(picture, camera, np.where(away < 80, 250, 99))
    ideal = np.column_stack([camera.normalise(plain), np.ones(2000)])
    rim = 80 - np.hypot(*(camera.project(ideal)[0] - (150, 120)).T)
    hidden = ~edges.can_show(plain)
    assert hidden[rim > 8].all()
    assert not hidden[rim < 3].any()
    assert hidden.sum() > 50
