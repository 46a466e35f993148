"""Scenes of rows made by hand: what is placed, numbered, measured, kept."""

from __future__ import annotations

from typing import Any, cast

import numpy as np
import pytest

from relmodel.errors import InputError
from relmodel.geometry.transforms import MATRIX_COLUMNS, rotation_matrix
from relmodel.store import Store
from vision.scene import Scenes, StoredScene, read_scene, read_variant_scene

rng = np.random.default_rng(0)
POSES = np.tile(np.eye(4), (3, 1, 1))
POSES[:, :3, :3], POSES[:, :3, 3] = rotation_matrix(rng.normal(size=(3, 3))), rng.normal(0, 100, (3, 3))
VERTICES, NORMALS = rng.normal(0, 10, (2, 2, 4, 3))
NORMALS /= np.linalg.norm(NORMALS, axis=2, keepdims=True)
SAMPLES = {name: rng.normal(0, 9, (2, 9, 3)) for name in ("points", "tangents", "normals_a", "normals_b")}
TRIANGLES = [[0, 1, 2, 0, 2, 3], [1, 2, 3]]
PARTS: dict[str, Any] = {
    "id": np.array([31, 30, 32]), "object_no": np.array([0, 1, 2]), "path": np.array(["a/x", "b/y", "c/z"], object),
    "shape_id": np.array([5, 4, 5]), "role": np.array(["fixture", "inspected", "inspected"], object),
    "tolerance_mm": np.array([0.0, 1.5, 2.5]), **dict(zip(MATRIX_COLUMNS, POSES[:, :3].reshape(3, 12).T, strict=True)),
}  # fmt: skip
# Of shape 4 arcs of 2, 3 and 4 samples, of shape 5 of 5 and 4.
COUNTS, OWNER = [2, 3, 4, 5, 4], np.array([4, 4, 4, 5, 5])
ROWS: dict[str, dict[str, Any]] = {
    "scene/parts": PARTS,
    "scene/meshes": {
        "shape_id": np.array([4, 5]), "vertices": [VERTICES[0].ravel(), VERTICES[1].ravel()],
        "normals": [NORMALS[0].ravel(), NORMALS[1].ravel()], "triangles": TRIANGLES, "triangle_surfaces": [[2, 7], [3]],
    },
    "scene/arcs": {
        "shape_id": OWNER, "arc_no": np.array([1, 3, 4, 0, 6]), "sample_count": np.array(COUNTS),
        "surface_a": np.array([2.0, 7, np.nan, 3, 9]), "surface_b": np.array([7, 2, 2, None, 3], object),
        **{name: np.array([*np.split(v[0], [2, 5]), *np.split(v[1], [5])], object) for name, v in SAMPLES.items()},
    },
    "scene/cylinders": {"shape_id": np.array([4, 5]), "surface_no": np.array([7, 9]), "radius": np.array([12.5, 3.0])},
    "scene/features": {"shape_id": np.array([4])},
    "object/expansion": {
        "part_id": np.array([-1, 8]), "path": np.array(["whole", "part"], object), "shape_id": np.array([0, 4]),
        **dict(zip(MATRIX_COLUMNS, POSES[1:, :3].reshape(2, 12).T, strict=True)),
    },
}  # fmt: skip


class Told:
    """A store that answers with these rows, of the shapes asked for."""

    changes = 0

    def columns(self, _: object, name: str, shape_ids: list[int] | None = None, **__: object) -> dict[str, Any]:
        rows = ROWS[name]
        if shape_ids is None:
            return rows
        kept = [k for k, shape in enumerate(rows["shape_id"].tolist()) if shape in shape_ids]
        return {key: np.asarray([values[k] for k in kept], np.asarray(values, object).dtype if isinstance(values, list)
                                else values.dtype) for key, values in rows.items()}  # fmt: skip

    def rows(self, *_: object) -> list[int]:
        return [self.changes]


STORE, NO = cast(Store, Told()), cast(Any, None)


def check_occurrence(found: StoredScene, number: int, pose: Any, shape: int) -> None:
    """What stands in the scene of one occurrence is what its shape has, moved."""
    scene, at = found.scene, shape - 4
    surfaces, arcs = (np.flatnonzero(own == number) for own in (scene.surface_occurrence, scene.arc_occurrence))
    assert found.surface_no[surfaces].tolist() == [[2, 7], [3]][at]
    assert found.arc_no[arcs].tolist() == [[1, 3, 4], [0, 6]][at]
    mine = np.isin(scene.triangle_surface, surfaces)
    corners = np.array(TRIANGLES[at]).reshape(-1, 3)
    for values, own, shift in ((scene.vertices, VERTICES, pose[:3, 3]), (scene.vertex_normals, NORMALS, 0)):
        np.testing.assert_allclose(values[scene.triangles[mine]], own[at][corners] @ pose[:3, :3].T + shift)
    assert (scene.triangle_surface[mine] - surfaces[0]).tolist() == [[0, 1], [0]][at]
    samples = np.isin(scene.sample_arc, arcs)
    for name, own in SAMPLES.items():
        moved = own[at] @ pose[:3, :3].T + (pose[:3, 3] if name == "points" else 0)
        placed = getattr(scene, f"sample_{name.removesuffix('s').replace('s_', '_')}")
        np.testing.assert_allclose(placed[samples], moved)
    lengths = []
    for line in np.split(SAMPLES["points"][at], [[2, 5], [5]][at]):
        step = np.linalg.norm(np.diff(line, axis=0), axis=1)
        lengths += ((np.append(step, 0) + np.append(0, step)) / 2).tolist()
    np.testing.assert_allclose(scene.sample_length[samples], lengths)
    first = surfaces[0]
    beside = [[[first, first + 1], [first + 1, first], [-1, first]], [[first, -1], [-1, first]]][at]
    assert found.arc_surfaces[arcs].tolist() == beside
    np.testing.assert_equal(found.radius[surfaces], [[np.nan, 12.5], [np.nan]][at])


def test_a_scene_is_its_parts_where_they_stand() -> None:
    found = read_scene(STORE, NO, 1)
    for number, shape in enumerate((5, 4, 5)):
        check_occurrence(found, number, POSES[number], shape)
    scene = found.scene
    assert (found.occurrence_id.tolist(), found.paths) == ([31, 30, 32], ["a/x", "b/y", "c/z"])
    assert scene.inspected.tolist() == [False, True, True]
    assert scene.tolerance_of_arc.tolist() == [0, 0, 1.5, 1.5, 1.5, 2.5, 2.5, 0, 1.5, 1.5, 2.5]
    assert scene.reference_samples.tolist() == list(range(9, 27))
    np.testing.assert_allclose(scene.sample_cosine, (scene.sample_normal_a * scene.sample_normal_b).sum(axis=1))
    np.testing.assert_allclose(scene.curved_triangles, [1, 2, 3])
    normal, along = scene.curved_corners
    np.testing.assert_allclose(normal, scene.vertex_normals[scene.triangles[1:].ravel()])
    np.testing.assert_allclose(along, (normal * scene.vertices[scene.triangles[1:].ravel()]).sum(axis=1))
    part = scene.select(np.array([3, 1]), np.array([7.0, 8.0]), np.array([2]))
    for name in ("point", "tangent", "normal_a", "normal_b", "arc"):
        np.testing.assert_array_equal(getattr(part, f"sample_{name}"), getattr(scene, f"sample_{name}")[[3, 1]])
    assert (part.sample_length.tolist(), part.curved_triangles.tolist()) == ([7, 8], [2])
    assert part.rays is scene.rays
    few = read_scene(STORE, NO, 1, [32])
    check_occurrence(few, 0, POSES[2], 5)
    assert (few.paths, len(few.scene.triangles)) == (["c/z"], 1)
    with pytest.raises(InputError, match="no part of an inspected object"):
        read_scene(STORE, NO, 1, [31])


def test_a_variant_stands_in_the_place_of_another() -> None:
    world = POSES[0]
    placed = dict(zip(MATRIX_COLUMNS, world[:3].ravel(), strict=True))
    variant = {"object_no": 1, "object_id": 9, "instance": "b", "role": "inspected", "tolerance_mm": 4.0, **placed}
    found = read_variant_scene(STORE, NO, 1, [30, 32], variant)
    assert (found.occurrence_id.tolist(), found.paths) == ([-1, 32], ["b/part", "c/z"])
    check_occurrence(found, 0, world @ POSES[2], 4)
    check_occurrence(found, 1, POSES[2], 5)
    assert found.scene.tolerance_mm.tolist() == [4.0, 2.5]


def test_four_selections_of_each_world_are_kept_until_something_changes() -> None:
    told = Told()
    scenes = Scenes(cast(Store, told))

    def read(world: int, *among: int) -> StoredScene:
        return scenes.read(NO, world, among or None)

    first, other = read(1), read(2)
    assert read(1) is first
    few = [read(1, 30), read(1, 32), read(1, 30, 32)]
    assert read(1) is first  # asked for again: now the youngest
    read(1, 31, 32)
    assert [read(1, 32), read(1, 30, 32), read(1)] == [few[1], few[2], first]
    assert read(1, 30) is not few[0]
    assert read(2) is other
    scenes.keep_only([1])
    assert read(1) is first
    assert read(2) is not other
    told.changes = 1
    assert read(1) is not first


def test_rays_meet_the_triangle_that_is_nearest_and_are_blocked_up_to_their_ends() -> None:
    scene = read_scene(STORE, NO, 1, [30]).scene
    corners = scene.vertices[scene.triangles]
    middle = corners.mean(axis=1)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    for k, (at, way) in enumerate(zip(middle, normal, strict=True)):
        eye = at + 0.5 * way
        assert scene.rays.nearest(eye, np.array([-way])).tolist() == [k]
        assert scene.rays.meet(eye, np.array([-way])).tolist() == [True]
        assert scene.rays.blocked(np.array([eye, eye, at - 0.4 * way]), at - 0.5 * way).tolist() == [True, True, False]
