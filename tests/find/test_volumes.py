"""Volumes: what is refused, and half-spaces against the projection that they stand for."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, cast

import numpy as np
import pytest

from relmodel.errors import InputError
from relmodel.find.volumes import Box, Frustum, OrientedBox, Polyhedron, Sphere
from tests.poses import pose_of


def camera(**changes: Any) -> Frustum:
    matrix = np.array([[800.0, 2, 310], [0, 820, 250], [0, 0, 1]])
    values: dict[str, Any] = {
        "width": 640,
        "height": 480,
        "matrix": matrix,
        "world_from_camera": pose_of([10, -20, 30], [0.3, -0.8, 0.2]),
        "near": 50.0,
        "far": 400.0,
    }
    return Frustum(**(values | changes))


@pytest.mark.parametrize(
    ("bounds", "said"),
    [
        ((0, 0, 0, np.inf, 1, 1), "not finite"),
        ((np.nan, 0, 0, 1, 1, 1), "not finite"),
        ((0, 2, 0, 1, 1, 1), "inverted in y"),
    ],
)
def test_bad_boxes(bounds: tuple[float, ...], said: str) -> None:
    with pytest.raises(InputError, match=said):
        Box(*bounds)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"near": 500.0}, "near < far"),
        ({"near": -1.0}, "near < far"),
        ({"far": np.inf}, "finite depths"),
        ({"width": 0}, "size"),
        ({"matrix": np.zeros((3, 3))}, "camera matrix"),
        ({"matrix": np.full((3, 3), np.nan)}, "camera matrix"),
        ({"matrix": np.array([[8.0, 0, 3], [0, 8, 3], [0, 0, 2]])}, "lower part"),
        ({"world_from_camera": np.diag([1.0, 1, -1, 1])}, "not rigid"),
        ({"world_from_camera": np.full((4, 4), np.nan)}, "not rigid"),
    ],
)
def test_bad_frustums(changes: dict[str, Any], said: str) -> None:
    with pytest.raises(InputError, match=said):
        camera(**changes)


CUBE: list[Any] = [[1, 0, 0, 1], [-1, 0, 0, 1], [0, 2, 0, 2], [0, -1, 0, 1], [0, 0, 1, 1], [0, 0, -1, 1]]


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: Sphere(0, 0, 0, -1), "radius -1"),
        (lambda: Sphere(0, 0, np.inf, 1), "not finite"),
        (lambda: OrientedBox(np.eye(4), np.array([1, -1, 1])), "none below 0"),
        (lambda: OrientedBox(np.eye(4), np.array([1, np.nan, 1])), "none below 0"),
        (lambda: OrientedBox(np.diag([1.0, 2, 1, 1]), np.ones(3)), "not rigid"),
        (lambda: Polyhedron(CUBE[:5]), "not bounded"),
        (lambda: Polyhedron([]), "not finite"),
        (lambda: Polyhedron(cast("Any", [[1, 0, 0], [1, 2, 3, 4]])), "not finite"),
        (lambda: Polyhedron([*CUBE, [0.0, 0, 0, 1]]), "no normal"),
        (lambda: Polyhedron([*CUBE, [1.0, 0, 0, -2]]), "empty"),
        (lambda: Polyhedron([*CUBE, [1, 0, 0, np.inf]]), "not finite"),
    ],
)
def test_bad_volumes(make: Callable[[], Any], said: str) -> None:
    with pytest.raises(InputError, match=said):
        make()


def test_polyhedron_without_thickness() -> None:
    flat = Polyhedron([*CUBE, [1.0, 1, 0, 0], [-1.0, -1, 0, 0]])
    assert np.allclose(flat.bounds, [-1, -1, -1, 1, 1, 1], atol=1e-5)
    assert np.all(flat.planes[:, :3] @ flat.inner_point <= flat.planes[:, 3] + 1e-6)


def test_half_spaces_hold_exactly_the_points_that_project_into_the_picture() -> None:
    view = camera()
    points = np.random.default_rng(0).uniform(-400, 400, (20000, 3))
    in_camera = (points - view.world_from_camera[:3, 3]) @ view.world_from_camera[:3, :3]
    u, v, z = (in_camera @ view.matrix.T).T
    with np.errstate(invalid="ignore", divide="ignore"):
        seen = (z >= 50) & (z <= 400) & (np.abs(u / z - 319.5) <= 320) & (np.abs(v / z - 239.5) <= 240)
    inside = (points @ view.half_spaces[:, :3].T <= view.half_spaces[:, 3]).all(axis=1)
    assert seen.sum() > 200
    assert np.array_equal(inside, seen)
