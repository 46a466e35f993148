"""A loaded object shown, exported and drawn, against the scene that it was made from."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pyarrow.csv
import pyarrow.parquet
import pytest
import trimesh

from relmodel.app.cli.main import main
from relmodel.model.model import Assembly, Instance, Model, Part
from relmodel.readers.mesh.shape import shape_from_triangles
from relmodel.store import Store
from tests.given import Capsys, NewStore
from tests.reading import load, store_model
from tests.variants.composed import pose


@pytest.fixture(scope="module")
def scene() -> trimesh.Scene:
    """Two boxes of one geometry and a cylinder, metres, as GLB has them."""
    scene = trimesh.Scene(base_frame="world")
    box, post = trimesh.creation.box((0.1, 0.2, 0.05)), trimesh.creation.cylinder(0.02, 0.3, sections=48)
    turned = trimesh.transformations.rotation_matrix(0.6, [0, 0, 1])
    turned[:3, 3] = [0.5, 0, 0]
    scene.add_geometry(box, node_name="left", geom_name="box")
    scene.graph.update(frame_to="right", frame_from="world", matrix=turned, geometry="box")
    aside = trimesh.transformations.translation_matrix([0.2, 0, 0.1])
    scene.add_geometry(post, node_name="post", geom_name="post", transform=aside)
    return scene


@pytest.fixture(scope="module", params=["duckdb", "postgresql"])
def target(
    request: pytest.FixtureRequest, new_store: NewStore, tmp_path_factory: pytest.TempPathFactory, scene: trimesh.Scene
) -> str:
    """A store with the scene, which no test writes to."""
    target, file = new_store(request.param), tmp_path_factory.mktemp("scene") / "scene.glb"
    file.write_bytes(scene.export(file_type="glb"))
    with Store.open(target) as store:
        load(store, file, name="thing", variant="X")
    return target


def of_blocks(parts: tuple[Part, ...], *assemblies: Assembly) -> Model:
    """A model of two assemblies; all parts have the shape of a block."""
    block = trimesh.creation.box((10, 20, 30))
    shape = shape_from_triangles(np.asarray(block.vertices), np.asarray(block.faces, np.int64))
    assert shape is not None
    return Model("GLB", "mm", 1.0, (shape,), parts, assemblies, 1, 0, "test")


def test_show_prints_the_tree(target: str, capsys: Capsys) -> None:
    assert main(["show", "thing", "--variant", "X", "--store", target, "--format", "json"]) == 0
    rows = json.loads(capsys.readouterr().out)
    assert rows[0]["parts"] == 3
    sizes = sorted(r["size"] for r in rows if r["level"] == "part")
    assert sizes[:2] == ["100 x 200 x 50"] * 2
    assert main(["show", "thing", "--store", target, "--format", "json"]) == 0  # it has no other variant
    assert json.loads(capsys.readouterr().out) == rows
    assert main(["show", "thing", "--variant", "Y", "--store", target]) == 2
    assert "name one of its variants: X" in capsys.readouterr().err


def test_glb_keeps_sharing_and_place(target: str, tmp_path: Path, scene: trimesh.Scene) -> None:
    out = tmp_path / "out.glb"
    assert main(["export", "thing", "--variant", "X", "-o", str(out), "--store", target]) == 0
    again = trimesh.load(out)
    assert len(again.geometry) == 2
    assert len(again.graph.nodes_geometry) == 3
    np.testing.assert_allclose(again.bounds, scene.bounds, atol=1e-7)
    assert again.volume == pytest.approx(scene.volume, rel=1e-6)


def test_what_has_no_geometry_is_not_exported(duckdb_file: Path, tmp_path: Path, capsys: Capsys) -> None:
    (tmp_path / "bare.urdf").write_text('<robot name="bare"><link name="a"/></robot>')
    with Store.open(duckdb_file) as store:
        load(store, tmp_path / "bare.urdf", name="bare")
    assert main(["export", "bare", "-o", str(tmp_path / "out.glb"), "--store", str(duckdb_file)]) == 2
    assert "bare has no geometry to write" in capsys.readouterr().err


@pytest.mark.parametrize("target", ["duckdb"], indirect=True)
def test_a_place_that_takes_no_file_is_told(target: str, tmp_path: Path, capsys: Capsys) -> None:
    (tmp_path / "taken").write_text("")
    for verb, option, name, said, status in (
        ("export", "-o", "none/out.glb", "there is no folder", 3),
        ("export", "-o", "taken", "cannot be made", 3),
        ("export", "-o", "taken/out.glb", "there is no folder", 3),
        ("export", "-o", "out.obj", "has the suffix of another model format", 2),
        ("show", "--picture", "none/out.png", "there is no folder", 3),
        ("show", "--picture", "out.txt", "end its name with one of", 2),
        ("show", "--picture", ".", "has no picture suffix", 2),
    ):
        assert main([verb, "thing", "--variant", "X", option, str(tmp_path / name), "--store", target]) == status
        assert said in capsys.readouterr().err
    assert [p.name for p in tmp_path.iterdir()] == ["taken"]


def test_glb_of_nested_assemblies_places_every_instance(duckdb_file: Path, tmp_path: Path) -> None:
    """A post in a frame in a row of frames, each turned: one geometry a colour, placed where NumPy composes it."""
    inner = [pose((100 * i, 5, 0), (0, 0.1 * i, 0.3)) for i in range(3)]
    parts = (Part("P", "P", 0), Part("R", "R", 0, colour="#ff0000"))
    outer = [pose((0, 400 * i, 7), (0.2, 0.1, 0.5 * i)) for i in range(4)]
    # The last post of a frame is a part of its own, red.
    frame = Assembly("FRAME", tuple(Instance(f"POST_{i}", "part", i // 2, p) for i, p in enumerate(inner)))
    row = Assembly("ROW", tuple(Instance(f"FRAME_{i}", "assembly", 0, p) for i, p in enumerate(outer)))
    with Store.open(duckdb_file) as store:
        store_model(store, of_blocks(parts, frame, row), "row")
    out = tmp_path / "out.glb"
    assert main(["export", "row", "-o", str(out), "--store", str(duckdb_file)]) == 0
    again = trimesh.load(out)
    paint = {name: mesh.visual.material.baseColorFactor[:3].tolist() for name, mesh in again.geometry.items()}
    assert sorted(paint.values()) == [[176, 180, 184], [255, 0, 0]]
    assert paint[again.graph["FRAME_2/POST_2"][1]] == [255, 0, 0]
    assert paint[again.graph["FRAME_2/POST_1"][1]] == [176, 180, 184]
    placed = {name: again.graph[name][0] for name in again.graph.nodes_geometry}
    assert len(placed) == 12
    for i, a in enumerate(outer):
        for k, b in enumerate(inner):
            expected = a @ b
            expected[:3, 3] /= 1000  # metres
            np.testing.assert_allclose(placed[f"FRAME_{i}/POST_{k}"], expected, atol=1e-12)
    assert again.volume == pytest.approx(12 * 6e-6)


def test_tables_hold_what_the_object_has(target: str, tmp_path: Path) -> None:
    for form in ("parquet", "csv"):
        command = ["export", "thing", "--variant", "X", "-o", str(tmp_path / form), "--tables", form, "--store", target]
        assert main(command) == 0
    read = {"parquet": pyarrow.parquet.read_table, "csv": pyarrow.csv.read_csv}
    for form, reader in read.items():
        tables = {p.stem: reader(p) for p in (tmp_path / form).iterdir()}
        assert tables.keys() == {"placed_part", "part", "feature", "surface", "arc"}
        assert tables["placed_part"].num_rows == 3
        assert tables["part"].num_rows == 2
        boxes = [r for r in tables["surface"].to_pylist() if r["recognised_kind"] == "plane"]
        assert sum(r["area"] for r in boxes) == pytest.approx(2 * (20000 + 5000 + 10000) + 2 * np.pi * 400, rel=3e-3)


def test_equal_siblings_are_one_line(capsys: Capsys, duckdb_file: Path) -> None:
    """An assembly of 20 equal frames of 51 posts and a bolt, and 130 bolts of other names beside them."""
    arguments = ["show", "rack", "--store", str(duckdb_file)]
    with Store.open(duckdb_file) as store:
        store_model(store, rack(), "rack")
    assert main(arguments) == 0
    said = capsys.readouterr()
    lines = said.out.splitlines()
    rows = ("rack", "  FRAME_0 x 20", "    POST_0 x 51", "    BOLT")
    assert all(line.startswith(f"{row}  ") for line, row in zip(lines[2:6], rows, strict=True))
    assert lines[2].split()[1] == str(20 * 52 + 130)
    assert len(lines) == 2 + 100
    assert max(map(len, lines)) <= 100
    assert "... and 34 more: --all prints them" in said.err  # 1 + 3 + 130 in all
    assert main([*arguments, "--all"]) == 0
    assert len(capsys.readouterr().out.splitlines()) == 2 + 134
    assert main([*arguments, "--format", "csv"]) == 0
    assert len(capsys.readouterr().out.splitlines()) == 1 + 1 + 20 * 53 + 130


def rack() -> Model:
    post, bolt = (Part(f"N-{i}", f"N-{i}", 0) for i in range(2))
    others = [Part(f"M-{i}", f"M-{i}", 0) for i in range(130)]
    posts = [Instance(f"POST_{i}", "part", 0, np.eye(4)) for i in range(51)]
    frame = Assembly("FRAME", (*posts, Instance("BOLT", "part", 1, np.eye(4))))
    frames = [Instance(f"FRAME_{i}", "assembly", 0, np.eye(4)) for i in range(20)]
    top = Assembly("RACK", (*frames, *(Instance(f"B_{i}", "part", 2 + i, np.eye(4)) for i in range(130))))
    return of_blocks((post, bolt, *others), frame, top)
