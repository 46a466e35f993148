"""Visibility against what geometry says of boxes and tubes."""

from __future__ import annotations

import numpy as np
import pytest

from relmodel.arrays import Floats
from relmodel.readers.mesh.shape import shape_from_triangles
from tests.vision.localisation.scenes import box_scene
from vision.cameras.cameras import Camera
from vision.localisation.visibility import Silhouettes, find_silhouettes, find_visible_arcs
from vision.scene import Scene

CAMERA = Camera(640, 480, np.array([[600.0, 0, 320], [0, 600, 240], [0, 0, 1]]))


def looking(eye: Floats, at: Floats) -> Floats:
    z = (at - eye) / np.linalg.norm(at - eye)
    x = np.cross(z, [0, 0, 1.0])
    x /= np.linalg.norm(x)
    pose = np.eye(4)
    pose[:3] = np.column_stack([x, np.cross(z, x), z, eye])
    return pose


def test_corner_view_of_a_box_shows_nine_edges() -> None:
    scene = box_scene([(np.zeros(3), np.array([100.0, 80, 60]))])
    seen = find_visible_arcs(scene, CAMERA, looking(np.array([400.0, 350, 300]), np.array([50.0, 40, 30])))
    assert len(np.unique(seen.arc)) == 9
    # The hidden three meet in the corner at the origin.
    assert np.linalg.norm(seen.point, axis=1).min() > 30


def test_a_box_in_front_hides_what_lies_in_its_shadow() -> None:
    back = np.array([-50.0, 200, -50]), np.array([100.0, 10, 100])
    front = np.array([-10.0, 100, -200]), np.array([20.0, 10, 400])
    scene = box_scene([back, front])
    eye = np.array([0.0, -300, 0])
    seen = find_visible_arcs(scene, CAMERA, looking(eye, np.array([0.0, 200, 0])))
    near_face = (seen.arc < 12) & (np.abs(seen.point[:, 1] - 200) < 1e-9)
    # The bar's front, 20 wide at y 100, casts a shadow of 25 on y 200: x beyond 12.5 is seen, nothing within.
    assert np.abs(seen.point[near_face, 0]).min() == pytest.approx(12.5, abs=2.0)


def test_free_edges_of_a_sheet_are_seen_from_both_sides() -> None:
    corners = np.array([[0.0, 0, 0], [80, 0, 0], [80, 50, 0], [0, 50, 0]])
    sheet = shape_from_triangles(corners, np.array([[0, 1, 2], [0, 2, 3]]))
    assert sheet is not None
    samples, zeros = sheet.samples, np.zeros(4, np.int64)
    arc = np.repeat(samples.arc_no, np.diff(samples.points.offsets) // 3)
    points, tangents, a, b = (
        np.asarray(getattr(samples, name).values, float).reshape(-1, 3)
        for name in ("points", "tangents", "normals_a", "normals_b")
    )
    scene = Scene(
        corners, np.tile([0, 0, 1.0], (4, 1)), np.array([[0, 1, 2], [0, 2, 3]]), zeros[:2], zeros[:1],
        points, tangents, a, b, arc, np.ones(len(arc)), zeros, np.ones(1, bool), np.zeros(1),
    )  # fmt: skip
    for height in (200.0, -200.0):
        seen = find_visible_arcs(scene, CAMERA, looking(np.array([60.0, -90, height]), np.array([40.0, 25, 0])))
        assert np.unique(seen.arc).tolist() == [0, 1, 2, 3]
        assert len(seen.arc) == len(arc)
        assert not seen.smooth.any()


def cylinder(radius: float, height: float, n: int) -> Scene:
    """A tube about z of n facets, two triangles each."""
    a = np.arange(n) * 2 * np.pi / n
    ring = np.column_stack([np.cos(a), np.sin(a), np.zeros(n)])
    vertices = np.concatenate([radius * ring, radius * ring + [0, 0, height]])
    i, j = np.arange(n), (np.arange(n) + 1) % n
    triangles = np.concatenate([np.column_stack([i, j, n + j]), np.column_stack([i, n + j, n + i])])
    none, empty = np.zeros((0, 3)), np.zeros(0, np.int64)
    return Scene(
        vertices, np.concatenate([ring, ring]), triangles, np.zeros(len(triangles), np.int64), np.zeros(1, np.int64),
        none, none, none, none, empty, np.zeros(0), empty, np.ones(1, bool), np.zeros(1),
    )  # fmt: skip


def test_silhouette_of_a_cylinder() -> None:
    radius, height = 30.0, 100.0
    scene = cylinder(radius, height, 64)
    eye = np.array([200.0, 0, 50])
    s = find_silhouettes(scene, eye)
    # Two lines along the axis, where the radius is at right angles to the view: cos = radius / distance.
    assert np.allclose(np.abs(s.tangent[:, 2]), 1, atol=1e-6)
    assert np.allclose(np.arctan2(np.abs(s.point[:, 1]), s.point[:, 0]), np.arccos(radius / 200), atol=0.02)
    assert s.length.sum() == pytest.approx(2 * height, rel=1e-6)


def test_long_segments_of_a_silhouette_are_seen_all_along() -> None:
    """Of a tube of long facets each side is a segment or two from end to end."""
    scene = cylinder(20.0, 200.0, 24)
    eye = np.array([600.0, 0, 100])
    seen = find_visible_arcs(scene, CAMERA, looking(eye, np.array([0.0, 0, 100])))
    whole = find_silhouettes(scene, eye)
    assert len(whole.length) < 8
    assert seen.length_px.max() <= 4.0
    for side in (1, -1):
        own = np.sort(seen.point[np.sign(seen.point[:, 1]) == side, 2])
        assert own[0] < 3
        assert own[-1] > 197
        assert np.diff(own).max() < 5
    # Two segments, one of them longer than it is far off: pieces subtend a tenth of the farther of both.
    z, none = np.eye(3)[[2, 2]], np.zeros((2, 3))
    segments = Silhouettes(np.array([[600.0, 5, 100], [200, 0, 100]]), z, none, np.array([4, 7]), np.array([200.0, 90]))
    split = segments.split(eye, 0.1)
    assert split.surface.tolist() == [4] * 10 + [7] * 3
    assert split.length.tolist() == [20] * 10 + [30] * 3
    np.testing.assert_allclose(split.point[:, 2], [*range(10, 200, 20), 70, 100, 130])
