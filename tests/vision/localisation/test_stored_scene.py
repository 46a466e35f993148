"""Scenes as the store gives them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace
from OCP.gp import gp_Dir, gp_Pln, gp_Pnt

from relmodel.find.find import world_named
from relmodel.store import Store
from relmodel.world.placement import place_world
from tests.parts.solids import Part, cylinder
from tests.parts.step_parts import write_product
from tests.reading import load
from tests.vision.localisation.test_visibility import CAMERA, looking
from vision.localisation.visibility import find_visible_arcs
from vision.scene import read_scene


def test_the_free_edges_of_a_step_sheet_are_seen_from_both_sides(fresh_store: str, tmp_path: Path) -> None:
    """A rectangle with a round hole: five edges, each of one face alone, sharp from above and from below."""
    sheet = Part(BRepBuilderAPI_MakeFace(gp_Pln(gp_Pnt(0, 0, 0), gp_Dir(0, 0, 1)), 0.0, 80.0, 0.0, 50.0).Face())
    sheet.cut(cylinder((30, 25, -5), 12, 10))
    path = write_product(tmp_path / "sheet.step", sheet.body, "sheet")
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
