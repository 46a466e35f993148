"""Visibility against what geometry says of boxes and tubes."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
import trimesh

from relmodel.arrays import Floats
from relmodel.readers.mesh.shape import shape_from_triangles
from tests.vision.localisation.scenes import above, box_scene, stereo_rig
from vision.cameras.cameras import Camera, Rig
from vision.localisation.views import SHARP, find_view_arcs, view_model
from vision.localisation.visibility import (
    Silhouettes,
    are_in_picture,
    find_parts_in_view,
    find_silhouettes,
    find_visible_arcs,
    lay_rays,
    map_surfaces,
    measure_coverage,
    project_tangents,
)
from vision.scene import Scene, StoredScene

CAMERA = Camera(640, 480, np.array([[600.0, 0, 320], [0, 600, 240], [0, 0, 1]]))


def looking(eye: Floats, at: Floats) -> Floats:
    z = (at - eye) / np.linalg.norm(at - eye)
    x = np.cross(z, [0, 0, 1.0])
    x /= np.linalg.norm(x)
    pose = np.eye(4)
    pose[:3] = np.column_stack([x, np.cross(z, x), z, eye])
    return pose


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


def test_points_of_an_outline_follow_each_other() -> None:
    """Of a ball, whose triangles come in any order."""
    ball = trimesh.creation.icosphere(3, 30.0)
    faces = np.random.default_rng(0).permutation(np.array(ball.faces))
    whole = {
        "vertices": np.array(ball.vertices),
        "triangles": faces,
        "triangle_surface": np.zeros(len(faces), np.int64),
    }
    scene = replace(cylinder(30.0, 1.0, 3), vertex_normals=whole["vertices"] / 30, **whole)
    seen = find_view_arcs(scene, CAMERA, looking(np.array([300.0, 0, 50]), np.zeros(3))).samples
    steps = np.linalg.norm(np.diff(seen.pixel, axis=0), axis=1)
    assert len(steps) > 60
    assert steps.max() < 3 * seen.length_px.max()


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


LENS = Camera(640, 480, np.array([[600.0, 2, 321], [0, 590, 238], [0, 0, 1]]), np.array([-0.15, 0.02, 0.001, -0.001]))


def two_boxes() -> Scene:
    return box_scene(
        [(np.array([-60.0, -50, 0]), np.array([100.0, 80, 30])), (np.array([-20.0, -20, 30]), np.full(3, 30.0))]
    )


def test_tangents_are_projected_as_points_along_them() -> None:
    rng = np.random.default_rng(0)
    pose = looking(np.array([300.0, -250, 420]), np.zeros(3))
    point, tangent = rng.uniform(-80, 80, (20, 3)), rng.normal(size=(20, 3))
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    pixel, direction, scale = project_tangents(LENS, pose, point, tangent)
    pinhole = Camera(640, 480, LENS.matrix)
    ahead, back = (pinhole.project((point + s * tangent - pose[:3, 3]) @ pose[:3, :3])[0] for s in (1e-4, -1e-4))
    np.testing.assert_allclose(pixel, (ahead + back) / 2, atol=1e-5)
    np.testing.assert_allclose(direction * scale[:, None], (ahead - back) / 2e-4, rtol=1e-4, atol=1e-4)
    np.testing.assert_allclose(np.linalg.norm(direction, axis=1), 1)


@pytest.mark.parametrize("camera", [CAMERA, LENS], ids=["pinhole", "lens"])
@pytest.mark.parametrize("margin", [0.0, 40.0])
def test_points_are_in_a_picture_that_lie_before_it(camera: Camera, margin: float) -> None:
    rng = np.random.default_rng(1)
    pose = looking(np.array([300.0, -250, 420]), np.zeros(3))
    point = rng.uniform(-700, 700, (3000, 3))
    local = (point - pose[:3, 3]) @ pose[:3, :3]
    uv, front = camera.project(local)
    inside = (np.abs(uv - [319.5, 239.5]) <= np.array([320, 240]) + margin).all(axis=1)
    found = are_in_picture(point, camera, pose, margin)
    assert (found == (inside & front & (local[:, 2] > 0))).all()
    assert 20 < found.sum() < 2900


def test_visible_arcs_stand_for_their_length_in_the_picture() -> None:
    scene, pose = two_boxes(), looking(np.array([300.0, -250, 420]), np.zeros(3))
    seen = find_visible_arcs(scene, CAMERA, pose)
    own = scene.sample_length[seen.sample]
    ends = [
        CAMERA.project((seen.point + s * own[:, None] / 2 * seen.tangent - pose[:3, 3]) @ pose[:3, :3])[0]
        for s in (1, -1)
    ]
    np.testing.assert_allclose(seen.length_px, np.linalg.norm(ends[0] - ends[1], axis=1), rtol=1e-3)
    depth = (seen.point - pose[:3, 3]) @ pose[:3, 2]
    np.testing.assert_allclose(seen.scale, 600 / depth)
    np.testing.assert_array_equal(seen.point, scene.sample_point[seen.sample])
    np.testing.assert_array_equal(seen.normal_a, scene.sample_normal_a[seen.sample])
    np.testing.assert_array_equal(seen.normal_b, scene.sample_normal_b[seen.sample])
    some = find_visible_arcs(scene, CAMERA, pose, count=70)
    assert len(some.arc) <= 70
    assert set(some.sample) <= set(seen.sample)
    turned = np.einsum("ni,ni->n", seen.normal_a, pose[:3, 3] - seen.point) > 0
    assert (turned | (np.einsum("ni,ni->n", seen.normal_b, pose[:3, 3] - seen.point) > 0)).all()


def test_runs_are_parted_where_something_hides_an_arc_for_long() -> None:
    """A post before a long bar parts its edges in two; a thin wire does not."""
    bar = (np.array([-200.0, 200, 0]), np.array([400.0, 20, 20]))
    for width, parts in ((40.0, 2), (2.0, 1)):
        scene = box_scene([bar, (np.array([-width / 2, 100.0, -100]), np.array([width, 4, 300]))])
        view = find_view_arcs(scene, CAMERA, looking(np.array([0.0, -300, 60]), np.array([0.0, 200, 10])))
        # The upper front edge runs along x, at the sides y 0 and z 1 of the bar: edge 4 * 0 + 2 * 0 + 1.
        mine = np.flatnonzero(view.element == 1)
        assert len(mine) == parts
        assert (view.kind[mine] == SHARP).all()
        assert view.occurrence[mine].tolist() == [0] * parts
        for run in mine:
            own = view.run == run
            assert view.length[run] == pytest.approx(view.samples.length_px[own].sum())
            assert (np.diff(view.samples.point[own, 0]) > 0).all()
        assert (np.diff(view.run) >= 0).all()


@pytest.mark.parametrize("camera", [CAMERA, LENS], ids=["pinhole", "lens"])
def test_rays_stand_for_squares_of_the_picture(camera: Camera) -> None:
    rays = lay_rays(camera, 3)
    used = rays.weight > 0
    assert set(np.unique(rays.weight)) <= {0.0, 9.0}
    np.testing.assert_allclose(camera.project(rays.directions[used])[0], rays.pixel[used], atol=1e-6)
    np.testing.assert_allclose(rays.cells(rays.directions[used]), np.argwhere(used)[:, ::-1], atol=1e-6)
    assert (rays.pixel[used] >= -0.5).all()
    assert (rays.pixel[used] <= [639.5, 479.5]).all()
    if camera is CAMERA:
        assert rays.weight.sum() == pytest.approx(640 * 480, rel=0.01)
        np.testing.assert_allclose(rays.pixel[0, 0], [1, 1])


@pytest.mark.parametrize("eye", [(300.0, -250, 420), (70, -45, 40)])
def test_surfaces_are_mapped_and_covered_ray_by_ray(eye: tuple[float, float, float]) -> None:
    """From afar, and so near that triangles reach behind the camera."""
    scene, pose = two_boxes(), looking(np.array(eye), np.array([-10.0, 0, 20]))
    shown = map_surfaces(scene, CAMERA, pose)
    directions = shown.rays.directions.reshape(-1, 3) @ pose[:3, :3].T
    corner = scene.vertices[scene.triangles]
    depth = np.full((len(scene.surface_occurrence), len(directions)), np.inf)
    for (a, b, c), surface in zip(corner, scene.triangle_surface, strict=True):
        normal = np.cross(b - a, c - a)
        along = directions @ normal
        if (a - pose[:3, 3]) @ normal >= 0:  # seen from behind
            continue
        t = (a - pose[:3, 3]) @ normal / np.where(along < 0, along, np.nan)
        place = pose[:3, 3] + t[:, None] * directions
        within = t > 0
        for p, q in ((a, b), (b, c), (c, a)):
            within &= np.cross(q - p, place - p) @ normal >= 0
        depth[surface, within] = np.minimum(depth[surface, within], t[within])
    first = np.where(np.isfinite(depth).any(axis=0), depth.argmin(axis=0), -1)
    assert (shown.surface.ravel() == first).mean() > 0.999
    group, surface = np.array([0, 0, 1, 2, 2]), np.array([1, 5, 11, 5, 11])
    visible, covered = measure_coverage(scene, shown, pose, group, surface, 3)
    weight = shown.rays.weight.ravel()
    np.testing.assert_allclose(visible, [weight[np.isin(first, of)].sum() for of in ((1, 5), (11,), (5, 11))], atol=30)
    whole = [weight[np.isfinite(depth[list(of)]).any(axis=0)].sum() for of in ((1, 5), (11,), (5, 11))]
    np.testing.assert_allclose(covered, whole, atol=30)
    pixel = np.array([[319.0, 239.0], [10, 10], [-5, 100], [638, 478], [400.2, 300.7]])
    for place, found in zip(pixel, shown.surface_at(pixel), strict=True):
        cell = np.rint((place - 1) / 3).astype(int)
        within = (place >= -0.5).all()
        assert found == (shown.surface[cell[1], cell[0]] if within else -1)


def stored(scene: Scene) -> StoredScene:
    features = {
        "shape_id": np.array([9, 9, 8]), "feature_no": np.array([3, 3, 1]), "surface_no": np.array([5, 1, 5]),
        "name": np.array(["slot", "slot", "top"]),
    }  # fmt: skip
    known = SimpleNamespace(
        scene=scene, occurrence_id=np.array([70, 60]), surface_no=np.tile(np.arange(6), 2), features=features,
        shape_id=np.array([9, 8]), paths=["it/plate", "it/block"],
    )  # fmt: skip
    return cast(StoredScene, known)


def test_parts_and_features_are_seen_by_all_cameras_together() -> None:
    scene, rig, pose = two_boxes(), stereo_rig(), above(0, 0, 500)
    view = view_model(scene, rig, pose)
    found = find_parts_in_view(stored(scene), rig, view.maps, pose)
    assert found.path == ["it/plate", "it/block", "it/plate/slot", "it/block/top"]
    assert found.level == ["part", "part", "feature", "feature"]
    assert found.occurrence_id.tolist() == [70, 60, 70, 60]
    assert found.feature_no.tolist() == [-1, -1, 3, 1]
    groups = [range(6), range(6, 12), (1, 5), (11,)]
    for row, surfaces in enumerate(groups):
        pixels = sum(float(m.rays.weight[np.isin(m.surface, list(surfaces))].sum()) for m in view.maps.values())
        assert found.visible[row] == pytest.approx(pixels)
    # The block hides some of the plate, nothing hides the block.
    share = found.visible / found.covered
    assert share[0] < 0.97
    assert share[1] == pytest.approx(1.0, abs=0.02)
    away: Floats = np.diag([1.0, -1, -1, 1])
    away[:3, 3] = [0, 0, -500]
    nothing = view_model(scene, Rig({"one": CAMERA}, {"one": np.eye(4)}), away)
    assert not find_parts_in_view(stored(scene), Rig({"one": CAMERA}, {"one": np.eye(4)}), nothing.maps, away).path
