"""Scenes as the store gives them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from relmodel.arrays import Floats, Ints
from relmodel.find.find import world_named
from relmodel.store import Store
from relmodel.world.placement import place_world
from tests.parts.step_parts import write_product
from tests.reading import load
from tests.vision.localisation.test_visibility import CAMERA, looking
from vision.localisation.visibility import find_visible_arcs
from vision.scene.stored_scene import read_scene

_FACES = ((1, 3, 4, 2), (5, 6, 8, 7), (1, 2, 6, 5), (3, 7, 8, 4), (1, 5, 7, 3), (2, 4, 8, 6))


def test_bodies_of_one_file_are_told_apart(fresh_store: str, tmp_path: Path) -> None:
    """Two cubes in one mesh, placed twice: four bodies of six surfaces and twelve arcs, each within its own cube."""
    lines = []
    for number, x in enumerate((0, 300)):
        lines += [f"v {x + a} {b} {c}" for a in (0, 100) for b in (0, 100) for c in (0, 100)]
        lines += ["f " + " ".join(str(8 * number + i) for i in face) for face in _FACES]
    (tmp_path / "cubes.obj").write_text("\n".join(lines))
    (tmp_path / "world.yaml").write_text(
        "world: w\nobjects:\n  - {object: cubes, name: one}\n  - {object: cubes, name: two, world_from_object: "
        "[[1, 0, 0, 0], [0, 1, 0, 1000], [0, 0, 1, 0], [0, 0, 0, 1]]}\n"
    )
    with Store.open(fresh_store) as store:
        load(store, tmp_path / "cubes.obj", name="cubes", unit="mm")
        place_world(store, tmp_path / "world.yaml")
        with store.read() as connection:
            world, _ = world_named(store, connection, None)
            scene = read_scene(store, connection, world).scene
    assert scene.component_count == 4
    assert np.bincount(scene.surface_component).tolist() == [6] * 4
    assert np.bincount(scene.arc_component).tolist() == [12] * 4

    def cube(points: Floats) -> Ints:
        return np.asarray((points[:, 0] > 200) + 2 * (points[:, 1] > 500), np.int64)

    pairs = [(scene.arc_component[scene.sample_arc], cube(scene.sample_point))]
    corners = scene.vertices[scene.triangles].mean(axis=1)
    pairs.append((scene.surface_component[scene.triangle_surface], cube(corners)))
    both = {(int(b), int(c)) for body, where in pairs for b, c in zip(body, where, strict=True)}
    assert len(both) == len({b for b, _ in both}) == len({c for _, c in both}) == 4


def test_the_free_edges_of_a_step_sheet_are_seen_from_both_sides(fresh_store: str, tmp_path: Path) -> None:
    """A rectangle with a round hole: five edges, each of one face alone, sharp from above and from below."""
    pytest.importorskip("OCP")
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeCylinder
    from OCP.gp import gp_Ax2, gp_Dir, gp_Pln, gp_Pnt

    rectangle = BRepBuilderAPI_MakeFace(gp_Pln(gp_Pnt(0, 0, 0), gp_Dir(0, 0, 1)), 0.0, 80.0, 0.0, 50.0).Face()
    tool = BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(30, 25, -5), gp_Dir(0, 0, 1)), 12.0, 10.0).Shape()
    path = write_product(tmp_path / "sheet.step", BRepAlgoAPI_Cut(rectangle, tool).Shape(), "sheet")
    (tmp_path / "world.yaml").write_text("world: w\nobjects:\n  - {object: sheet, name: one}\n")
    with Store.open(fresh_store) as store:
        load(store, path, name="sheet", strict=True)
        place_world(store, tmp_path / "world.yaml")
        with store.read() as connection:
            world, _ = world_named(store, connection, None)
            scene = read_scene(store, connection, world).scene
    assert np.allclose(scene.sample_cosine, -1)
    for height in (200.0, -200.0):
        seen = find_visible_arcs(scene, CAMERA, looking(np.array([60.0, -90, height]), np.array([40.0, 25, 0])))
        assert np.unique(seen.arc).tolist() == [0, 1, 2, 3, 4]
        assert len(seen.point) == len(scene.sample_point)
        assert not seen.smooth.any()
