"""What is in view, which elements lie on predicted arcs, and what regions cover, against loops and by hand."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np

from tests.vision.account.test_elements_beside import edge_points, unit
from vision.localisation.measurements import EdgeIndex
from vision.localisation.visibility import PartsInView, SurfaceMap, VisibleArcs
from vision.presence.items import find_normals, lie_on, list_items
from vision.scene import Scene, StoredScene


def test_items_are_parts_features_and_faces_in_view() -> None:
    """Two placed parts of one shape, the second with a hole in view and a rib, and a third that is not inspected."""
    scene = SimpleNamespace(
        inspected=np.array([True, True, False]), surface_occurrence=np.array([0, 0, 0, 1, 1, 1, 2]),
    )  # fmt: skip
    features = {
        "shape_id": np.array([7, 7, 7]), "feature_no": np.array([1, 2, 2]), "surface_no": np.array([2, 0, 1]),
        "kind": np.array(["through_hole", "rib", "rib"]), "thickness": np.array([None, 4.0, 4.0]),
    }  # fmt: skip
    stored = cast(
        StoredScene,
        SimpleNamespace(
            scene=scene, occurrence_id=np.array([50, 60, 70]), paths=["a", "b", "c"], shape_id=np.array([7, 7, 8]),
            surface_no=np.array([0, 1, 2, 0, 1, 2, 0]), features=features,
        ),
    )  # fmt: skip
    view = PartsInView(
        np.array([50, 60, 70, 60, 60]), np.array([-1, -1, -1, 1, 2]), ["a", "b", "c", "b/hole", "b/rib"],
        np.array([90.0, 80, 70, 6, 5]), np.full(5, 99.0),
    )  # fmt: skip
    counted = [np.array([0.0, 3, 0, 0, 1, 2, 9]), np.array([0.0, 1, 0, 0, 0, 2, 9])]
    seen = [cast(SurfaceMap, SimpleNamespace(count_pixels=lambda _, own=own: own)) for own in counted]
    items = list_items(stored, view, seen)
    assert items.path == ["a", "b", "b/hole", "b/rib", "a/face 1", "b/face 1", "b/face 2"]
    assert items.level == ["part"] * 2 + ["feature"] * 2 + ["surface"] * 3
    assert items.occurrence.tolist() == [0, 1, 1, 1, 0, 1, 1]
    assert items.feature_no.tolist() == [-1, -1, 1, 2, -1, -1, -1]
    assert items.surface_no.tolist() == [-1, -1, -1, -1, 1, 1, 2]
    assert items.kind == ["", "", "through_hole", "rib", "", "", ""]
    assert items.visible_px.tolist() == [90, 80, 6, 5, 4, 1, 4]
    np.testing.assert_array_equal(items.thickness, [np.nan, np.nan, np.nan, 4, np.nan, np.nan, np.nan])
    members = [items.surface[items.member == row].tolist() for row in range(7)]
    assert members == [[0, 1, 2], [3, 4, 5], [5], [3, 4], [1], [4], [5]]
    assert (np.diff(items.member) >= 0).all()
    assert items.inset.tolist() == [False, False, True, False, False, True, False]


def test_elements_lie_on_arcs_that_are_near_and_run_alike() -> None:
    rng = np.random.default_rng(1)
    edges = edge_points(rng.uniform(0, 60, (300, 2)), unit(rng.uniform(0, 2 * np.pi, 300)))
    pixel, direction = rng.uniform(0, 60, (40, 2)), unit(rng.uniform(0, 2 * np.pi, 40))
    seen = cast(VisibleArcs, SimpleNamespace(arc=np.zeros(40), pixel=pixel, direction=direction))
    found = lie_on(EdgeIndex(edges), seen, 4.0, 0.9)
    for i in range(300):
        away = np.linalg.norm(pixel - edges.position[i], axis=1)
        nearest = int(np.argmin(away))
        tangent = np.array([-edges.normal[i, 1], edges.normal[i, 0]])
        assert found[i] == (away[nearest] < 4.0 and abs(tangent @ direction[nearest]) > 0.9)
    assert 3 < found.sum() < 200
    none = cast(VisibleArcs, SimpleNamespace(arc=np.zeros(0)))
    assert not lie_on(EdgeIndex(edges), none, 4.0, 0.9).any()


def test_surfaces_look_the_way_of_their_areas() -> None:
    """A slab's upper face of two unlike triangles, a roof of two faces, and a sheet that folds back."""
    vertices = np.array([[0.0, 0, 0], [9, 0, 0], [9, 4, 0], [0, 4, 0], [0, 0, 9], [9, 0, 9]])
    triangles = np.array([[0, 1, 2], [0, 2, 3], [0, 1, 2], [0, 5, 1], [0, 1, 2], [0, 2, 1]])
    known = SimpleNamespace(
        vertices=vertices, triangles=triangles, triangle_surface=np.array([0, 0, 1, 1, 2, 2]),
        surface_occurrence=np.zeros(3),
    )  # fmt: skip
    found = find_normals(cast(Scene, known))
    roof = np.array([0.0, 81, 36]) / np.hypot(81, 36)
    np.testing.assert_allclose(found, [[0, 0, 1], roof, [0, 0, 0]], atol=1e-12)
