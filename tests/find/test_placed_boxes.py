"""Boxes of turned parts in turned objects are those of what was placed, in SQL, in process and as Parquet."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from relmodel.app.cli.main import main
from relmodel.arrays import Floats
from relmodel.find.find import in_volume, in_volumes
from relmodel.find.indexes import WorldIndex, placed_parts, world_boxes
from relmodel.find.volumes import Box
from relmodel.geometry.curves import boxes_of
from relmodel.geometry.transforms import rotation_matrix
from relmodel.store import Store
from relmodel.world import place_world
from tests.find.test_parquet import duckdb_rows, expected, write_questions
from tests.find.test_sql_clients import rows_of
from tests.poses import pose_of
from tests.reading import load
from tests.store.amiss import flaws
from tests.synthetic_model import write_world

KEY = ("volume_no", "occurrence_id", "element_no")
RADIUS, LENGTH = 0.02, 0.1  # m, as the file has them
TETRAHEDRON = np.array([[0, 0, 0], [90, 0, 0], [0, 40, 0], [5, 5, 60]], float)
FACES = [(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)]
TURNED = rotation_matrix(np.array([0.3, -0.5, 0.8]))
RPY = (0.4, 0.7, -0.2)
URDF = f"""<robot name="stand">
<link name="base"><visual><geometry><mesh filename="wedge.stl" scale="0.001 0.001 0.001"/></geometry></visual></link>
<link name="rod"><visual><origin rpy="{RPY[0]} {RPY[1]} {RPY[2]}" xyz="0.3 0 0"/>
<geometry><cylinder radius="{RADIUS}" length="{LENGTH}"/></geometry></visual></link>
<joint name="foot" type="fixed"><parent link="base"/><child link="rod"/></joint></robot>"""


def stl(corners: Floats) -> str:
    facets = []
    for face in FACES:
        a, b, c = corners[list(face)]
        n = np.cross(b - a, c - a) / np.linalg.norm(np.cross(b - a, c - a))
        loop = "\n".join(f"vertex {x} {y} {z}" for x, y, z in (a, b, c))
        facets.append(f"facet normal {n[0]} {n[1]} {n[2]}\nouter loop\n{loop}\nendloop\nendfacet")
    return "solid wedge\n" + "\n".join(facets) + "\nendsolid wedge\n"


def around_cylinder(centre: Floats, axis: Floats) -> Floats:
    """The box of a cylinder, mm: along d it reaches |d . axis| length / 2 + radius sqrt(1 - (d . axis)^2)."""
    reach = 1e3 * (np.abs(axis) * LENGTH / 2 + RADIUS * np.sqrt(1 - axis**2))
    return np.concatenate([centre - reach, centre + reach])


def test_boxes_are_of_placed_geometry(duckdb_file: Path, tmp_path: Path) -> None:
    (tmp_path / "wedge.stl").write_text(stl(TETRAHEDRON))
    (tmp_path / "stand.urdf").write_text(URDF)
    pose = pose_of((500, -200, 80), TURNED)
    roll, pitch, yaw = (rotation_matrix(np.eye(3)[i] * RPY[i]) for i in range(3))
    wedge = TETRAHEDRON @ TURNED.T + pose[:3, 3]
    middle = TURNED @ np.array([300.0, 0, 0]) + pose[:3, 3]
    truth = {"base": np.concatenate([wedge.min(axis=0), wedge.max(axis=0)])}
    truth["rod"] = around_cylinder(middle, TURNED @ (yaw @ pitch @ roll)[:, 2])
    everything = Box(-5e3, -5e3, -5e3, 5e3, 5e3, 5e3)
    with Store.open(duckdb_file) as store:
        load(store, tmp_path / "stand.urdf", name="stand")
        place: dict[str, object] = {"object": "stand", "name": "stand", "world_from_object": pose.tolist()}
        place_world(store, write_world(tmp_path / "world.yaml", "cell", [place]))
        found = in_volume(store, everything)
        boxes = boxes_of(found)
        assert len(boxes) == 2
        for path, box in zip(found["path"], boxes, strict=True):
            wide = np.concatenate([truth[path.split("/")[1]][:3] - box[:3], box[3:] - truth[path.split("/")[1]][3:]])
            assert wide.min() > -1e-6
            assert wide.max() < (1e-6 if "base" in path else 0.5)
        with store.read() as connection:
            kept, hulls = placed_parts(store, connection, int(store.rows(connection, "world/current")[0].world_id))
        assert np.array_equal(world_boxes(kept, hulls), boxes)
        # Boxes that only just touch, or only just do not touch, a side of a part's box: all ways agree.
        asked = []
        for box in boxes:
            for i in range(3):
                for by in (0.0, 0.001):
                    beyond = box.copy()
                    beyond[i], beyond[3 + i] = box[3 + i] + by, box[3 + i] + by + 1
                    asked.append(Box(*beyond))
        index = WorldIndex.load(store)
        for level in ("part", "arc"):
            rows = in_volumes(store, asked, level=level)
            for column, own in zip(KEY, index.in_volumes(asked, level), strict=True):
                assert np.array_equal(rows[column], own)
        write_questions([*asked], tmp_path)
        expected_rows = expected(store, [*asked])
        assert not flaws(store, "object_", "placed_body", "shape_counts", "element_outside_shape")
        wanted = {(path, *box) for path, box in zip(found["path"], boxes.tolist(), strict=True)}
    assert main(["export", "--parquet", str(tmp_path / "parts"), "--store", str(duckdb_file)]) == 0
    assert duckdb_rows(tmp_path) == expected_rows
    question = "SELECT path, x0, y0, z0, x1, y1, z1 FROM parts_in_box(-5e3, -5e3, -5e3, 5e3, 5e3, 5e3)"
    for row in rows_of(str(duckdb_file), [question])[0]:
        (same,) = [w for w in wanted if w[0] == row[0]]
        assert np.allclose(row[1:], same[1:], atol=1e-9, rtol=0)
