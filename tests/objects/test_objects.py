"""A loaded object shown, exported and drawn, against the scene that it was made from."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pyarrow.csv
import pyarrow.parquet
import pytest
import trimesh
from PIL import Image

from relmodel.cli.main import main
from relmodel.loading.load import load
from relmodel.store import Store


@pytest.fixture
def scene() -> trimesh.Scene:
    """Two boxes of one geometry and a cylinder, metres, as GLB has them."""
    scene = trimesh.Scene(base_frame="world")
    box, post = trimesh.creation.box((0.1, 0.2, 0.05)), trimesh.creation.cylinder(0.02, 0.3, sections=48)
    turned = trimesh.transformations.rotation_matrix(0.6, [0, 0, 1])
    turned[:3, 3] = [0.5, 0, 0]
    scene.add_geometry(box, node_name="left", geom_name="box")
    scene.graph.update(frame_to="right", frame_from="world", matrix=turned, geometry="box")
    scene.add_geometry(
        post, node_name="post", geom_name="post", transform=trimesh.transformations.translation_matrix([0.2, 0, 0.1])
    )
    return scene


@pytest.fixture
def target(fresh_store: str, tmp_path: Path, scene: trimesh.Scene) -> str:
    (tmp_path / "scene.glb").write_bytes(scene.export(file_type="glb"))
    with Store.open(fresh_store) as store:
        load(store, tmp_path / "scene.glb", name="thing", variant="X")
    return fresh_store


def test_show_prints_the_tree(target: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["show", "thing", "--variant", "X", "--store", target, "--format", "json"]) == 0
    rows = json.loads(capsys.readouterr().out)
    assert rows[0]["parts"] == 3
    sizes = sorted(r["size"] for r in rows if r["level"] == "part")
    assert sizes[:2] == ["100 x 200 x 50"] * 2
    assert main(["show", "thing", "--store", target]) == 2
    assert "thing variant X" in capsys.readouterr().err


def test_glb_keeps_sharing_and_place(target: str, tmp_path: Path, scene: trimesh.Scene) -> None:
    out = tmp_path / "out.glb"
    assert main(["export", "thing", "--variant", "X", "-o", str(out), "--store", target]) == 0
    again = trimesh.load(out)
    assert len(again.geometry) == 2
    assert len(again.graph.nodes_geometry) == 3
    np.testing.assert_allclose(again.bounds, scene.bounds, atol=1e-7)
    assert again.volume == pytest.approx(scene.volume, rel=1e-6)


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


def test_a_picture_shows_the_outline(target: str, tmp_path: Path) -> None:
    out = tmp_path / "p.png"
    assert main(["show", "thing", "--variant", "X", "--store", target, "--picture", str(out), "--view", "front"]) == 0
    shown = np.asarray(Image.open(out).convert("L")) < 250
    wide = np.flatnonzero(shown.any(axis=0))
    # Seen along z: the turned box is at most 0.2 sin 0.6 + 0.1 cos 0.6 wide, and the two overlap nowhere.
    half = (0.1 * np.cos(0.6) + 0.2 * np.sin(0.6)) / 2
    width = 0.05 + 0.5 + half
    step = (wide[-1] - wide[0] + 1) / width
    area = 2 * 0.1 * 0.2 + np.pi * 0.02**2
    assert shown.sum() == pytest.approx(area * step**2, rel=0.02)
