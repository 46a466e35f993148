"""Coverage against areas known in closed form: squares that face the camera."""

import numpy as np
import pytest

from vision.cameras.cameras import Camera
from vision.localisation.visibility import map_surfaces, measure_coverage
from vision.scene import Scene

CAMERA = Camera(640, 480, np.array([[500.0, 0, 319.5], [0, 500.0, 239.5], [0, 0, 1]]))


def squares(*placed: tuple[float, float, float, float]) -> Scene:
    """A scene of squares (x, y, z, side) parallel to the picture, each an occurrence with one surface."""
    corner = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) / 2
    vertices = np.concatenate([corner * side + [x, y, z] for x, y, z, side in placed])
    n = len(placed)
    triangles = np.concatenate([np.array([[0, 2, 1], [0, 3, 2]]) + 4 * i for i in range(n)])
    none3, none = np.zeros((0, 3)), np.zeros(0, np.int64)
    return Scene(
        vertices=vertices,
        vertex_normals=np.tile([0.0, 0.0, -1.0], (4 * n, 1)),
        triangles=triangles,
        triangle_surface=np.repeat(np.arange(n), 2),
        surface_occurrence=np.arange(n),
        sample_point=none3,
        sample_tangent=none3,
        sample_normal_a=none3,
        sample_normal_b=none3,
        sample_arc=none,
        sample_length=np.zeros(0),
        arc_occurrence=none,
        inspected=np.ones(n, bool),
        tolerance_mm=np.zeros(n),
    )


def test_areas_and_occlusion() -> None:
    scene = squares((0, 0, 1000, 400), (50, 0, 500, 100), (0, 0, -300, 400))
    found = measure_coverage(scene, map_surfaces(scene, CAMERA, np.eye(4)), np.eye(4), np.arange(3), np.arange(3), 3)
    behind, before = 200.0**2, 100.0**2  # side in px: 500 * 400 / 1000, 500 * 100 / 500
    assert found[1] == pytest.approx([behind, before, 0], rel=0.03)
    assert found[0] == pytest.approx([behind - before, before, 0], rel=0.03)


def test_a_group_counts_a_pixel_once() -> None:
    scene = squares((0, 0, 1000, 400), (0, 0, 900, 180))
    found = measure_coverage(
        scene, map_surfaces(scene, CAMERA, np.eye(4)), np.eye(4), np.array([0, 0, 1]), np.array([0, 1, 1]), 2
    )
    assert found[1] == pytest.approx([200.0**2, 100.0**2], rel=0.03)


def test_what_reaches_behind_the_camera_is_clipped_at_the_picture() -> None:
    scene = squares((0, 0, 1000, 400))
    tilted = np.array([[5000.0, 100, -2000], [-5000, 100, -2000], [-5000, 100, 9000], [5000, 100, 9000]])
    scene.vertices[:] = tilted
    found = measure_coverage(scene, map_surfaces(scene, CAMERA, np.eye(4)), np.eye(4), np.array([0]), np.array([0]), 1)
    # A floor 100 mm below the eye up to 9 m away fills the picture from row 239.5 + 500 * 100 / 9000 down.
    assert found[1][0] == pytest.approx(640 * (480 - 245), rel=0.03)


def test_a_surface_turned_away_covers_nothing() -> None:
    scene = squares((0, 0, 1000, 400))
    scene.triangles[:] = scene.triangles[:, ::-1]
    found = measure_coverage(scene, map_surfaces(scene, CAMERA, np.eye(4)), np.eye(4), np.array([0]), np.array([0]), 1)
    assert found[1][0] == 0
