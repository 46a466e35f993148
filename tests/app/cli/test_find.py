"""`relmodel find` on a world whose boxes are known by construction."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sqlalchemy as sa
import trimesh
import yaml

import relmodel
from relmodel.app.cli.main import main
from relmodel.find.find import LEVELS
from relmodel.find.volumes import Box, Polyhedron, Sphere, Volume
from relmodel.store import Run, Store
from tests.find.test_find import fill, random_boxes, random_solids
from tests.store.test_check import plate


@pytest.fixture(scope="module", params=["duckdb", "postgresql"])
def world(request: pytest.FixtureRequest, new_store: Callable[[str], str]) -> str:
    """A store with the turned plate: world box [9, 100, 5] to [10, 102, 5].  Tests read it alone."""
    target = new_store(request.param)
    with Store.open(target) as store, Run.begin(store, "load", {}) as run, run.write() as connection:
        for name, columns in plate().items():
            store.append(connection, name.partition("/")[0], columns)
    return target


def found(capsys: pytest.CaptureFixture[str], *arguments: str) -> list[dict[str, Any]]:
    capsys.readouterr()
    assert main(["find", *arguments, "--format", "json"]) == 0
    rows: list[dict[str, Any]] = json.loads(capsys.readouterr().out)
    return rows


def test_box(world: str, capsys: pytest.CaptureFixture[str]) -> None:
    rows = found(capsys, "--store", world, "--box", "9.5", "101", "4", "9.6", "101.5", "6")
    assert [(r["path"], r["level"]) for r in rows] == [("a/b/c", "part")]
    assert [rows[0][k] for k in ("x0", "y0", "z0", "x1", "y1", "z1")] == pytest.approx([9, 100, 5, 10, 102, 5])
    assert found(capsys, "--store", world, "--box", "9.5", "101", "6", "9.6", "101.5", "7") == []
    # The edge from (2, 0) to (2, 1) in the plate is the one at y = 102 in the world.
    arcs = found(capsys, "--store", world, "--box", "9.5", "101.9", "4", "9.6", "103", "6", "--level", "arc")
    assert len(arcs) == 1


def test_the_nearest_of_any_level(bulkhead_template: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Against the distance of the point from all triangles of the bulkhead's parts, by trimesh."""
    at, target = np.array([1675.0, -460, 975]), str(bulkhead_template)
    asked = "SELECT id, path, shape_id, m00, m01, m02, m03, m10, m11, m12, m13, m20, m21, m22, m23 FROM occurrence"
    features, surfaces, parts = dict[tuple[str, str], float](), dict[tuple[str, int], float](), dict[str, float]()
    with Store.open(target, read_only=True) as store, store.read() as connection:
        placed = connection.execute(sa.text(f"{asked} WHERE kind = 'part'")).all()
        shapes = sorted({int(row.shape_id) for row in placed})
        meshes = {int(row.shape_id): row for row in store.rows(connection, "scene/meshes", shape_ids=shapes)}
        named = "SELECT shape_id, name, surface_no FROM feature JOIN feature_surface USING (shape_id, feature_no)"
        of_features = connection.execute(sa.text(named)).all()
    for row in placed:
        mesh, pose = meshes[int(row.shape_id)], np.array(row[3:]).reshape(3, 4)
        corners = np.reshape(mesh.vertices, (-1, 3)) @ pose[:, :3].T + pose[:, 3]
        triangles = corners[np.reshape(mesh.triangles, (-1, 3))]
        nearest = trimesh.triangles.closest_point(triangles, np.broadcast_to(at, (len(triangles), 3)))
        away = np.linalg.norm(nearest - at, axis=1)
        parts[row.path] = float(away.min())
        of_surface = np.asarray(mesh.triangle_surfaces)
        for number in np.unique(of_surface).tolist():
            surfaces[row.path, number] = float(away[of_surface == number].min())
        for shape_id, name, number in of_features:
            if shape_id == row.shape_id and (row.path, number) in surfaces:
                key = row.path, name
                features[key] = min(features.get(key, np.inf), surfaces[row.path, number])
    for level, truth in (("part", parts), ("feature", features), ("surface", surfaces)):
        point = ["--near-to", *map(str, at.tolist()), "--count", "7"]
        got = found(capsys, "--store", target, *point, "--level", level)
        assert [row["distance_mm"] for row in got] == pytest.approx(sorted(truth.values())[:7], abs=1e-6)
        if level == "feature":
            assert [features[row["path"], row["name"]] for row in got] == pytest.approx(
                [row["distance_mm"] for row in got], abs=1e-6
            )
    near = found(capsys, "--store", target, "--near-to-part", "bulkhead/CLIP_1/CLIP", "--level", "feature")
    assert [row["path"] != "bulkhead/CLIP_1/CLIP" for row in near] == [True] * 5
    (arc,) = found(capsys, "--store", target, *point[:4], "--level", "arc", "--count", "1")
    assert arc["distance_mm"] >= min(surfaces.values()) - 1e-6


@pytest.mark.parametrize(
    ("volume", "away"),
    [
        ("--box 12 100 4 13 101 6", 2.0),
        ("--box 12 101 5 12 101 5", 2.0),
        ("--sphere 15 101 5 1", 4.0),
        ("--obb 9.5 101 25 3 1 1 0 90 0", 17.0),  # it stands on its end
        ("--polyhedron corner.yaml", 5 / 2**0.5),
    ],
)
def test_where_nothing_is_the_nearest_part_is_named(
    world: str,
    volume: str,
    away: float,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """By closed forms: the plate reaches over x 9 to 10, y 100 to 102 at z 5."""
    monkeypatch.chdir(tmp_path)
    corner = [[-1, 0, -1, -20], [1, 0, 0, 20], [0, 0, 1, 20], [0, 1, 0, 102], [0, -1, 0, -100]]
    Path("corner.yaml").write_text(yaml.safe_dump({"half_spaces": corner}))  # x + z >= 20
    assert main(["find", *volume.split(), "--store", world]) == 0
    said = capsys.readouterr()
    assert len(said.out.splitlines()) == 2
    assert said.err == f"nothing is there: the nearest part is a/b/c, {away:.1f} mm away\n"


def test_a_part_without_such_an_element_there_is_named(world: str, capsys: pytest.CaptureFixture[str]) -> None:
    inside = ["find", "--box", "9.4", "100.9", "5", "9.6", "101.1", "5", "--store", world]
    assert main([*inside, "--level", "arc"]) == 0
    assert capsys.readouterr().err == "no arc lies there, but the part a/b/c reaches into it\n"
    assert main([*inside, "--wholly"]) == 0
    assert capsys.readouterr().err == "no part lies there wholly, but the part a/b/c reaches into it\n"


def test_camera(world: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A camera 100 mm above the plate that looks down sees it; one that looks up does not."""
    rig, pose = tmp_path / "rig.yaml", tmp_path / "pose.yaml"
    camera = {"width": 100, "height": 80, "matrix": [[1000, 0, 49.5], [0, 1000, 39.5], [0, 0, 1]]}
    camera["distortion"] = {"model": "opencv", "coefficients": [0.1, 0, 0, 0]}
    rig.write_text(yaml.safe_dump({"cameras": {"only": camera | {"rig_from_camera": np.eye(4).tolist()}}}))

    def seen_from(x: float, *, down: bool) -> list[str]:
        world_from_rig = np.diag([1.0, -1, -1, 1] if down else [1.0, 1, 1, 1])
        world_from_rig[:3, 3] = x, 101, 105
        pose.write_text(yaml.safe_dump({"world_from_rig": world_from_rig.tolist()}))
        return [str(r["path"]) for r in found(capsys, "--store", world, "--camera", str(rig), "--at", str(pose))]

    assert seen_from(9.5, down=True) == ["a/b/c"]
    assert seen_from(9.5, down=False) == []
    assert seen_from(14.9, down=True) == ["a/b/c"], "half the view is 5 mm wide at 100 mm"
    assert seen_from(15.2, down=True) == []


def test_a_prior_says_how_much_more_the_widened_view_holds(
    world: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rig, prior = tmp_path / "rig.yaml", tmp_path / "prior.yaml"
    camera = {"width": 100, "height": 80, "matrix": [[1000, 0, 49.5], [0, 1000, 39.5], [0, 0, 1]]}
    rig.write_text(yaml.safe_dump({"cameras": {"only": camera | {"rig_from_camera": np.eye(4).tolist()}}}))
    world_from_rig = np.diag([1.0, -1, -1, 1])
    for x, expected in ((9.5, "1 parts by their boxes; 0 of them are shown by none of 200"), (90, "0 parts")):
        world_from_rig[:3, 3] = x, 101, 105
        said = {"world_from_rig": world_from_rig.tolist(), "sigma": {"translation_mm": 0.1, "rotation_deg": 0.01}}
        prior.write_text(yaml.safe_dump(said))
        assert main(["find", "--store", world, "--camera", str(rig), "--prior", str(prior)]) == 0
        assert f"the widened view contains {expected}" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "status", "said"),
    [
        ("--camera rig.yaml", 2, "--at"),
        ("--camera none.yaml --at pose.yaml", 3, "none.yaml"),
        ("--box 1 0 0 0 1 1", 3, "inverted in x"),
        ("--box 0 0 0 1 1 1 --world other", 2, "other"),
        ("--sphere 0 0 0 -1", 3, "radius"),
        ("--polyhedron none.yaml", 3, "none.yaml"),
        ("--polyhedron bad.yaml", 3, "half-spaces"),
        ("--near-to 0 0 0 --wholly", 2, "--wholly"),  # and others that would change nothing
        ("--box 0 0 0 1 1 1 --count 3", 2, "--count"),
        ("--box 0 0 0 1 1 1 --radius 3", 2, "--radius"),
    ],
)
def test_wrong_use(
    words: str,
    status: int,
    said: str,
    bulkhead_template: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("bad.yaml").write_text("half_spaces: 3\n")
    assert main(["find", *words.split(), "--store", str(bulkhead_template)]) == status
    answer = capsys.readouterr().err
    assert said in answer
    assert answer.count("\n") == 1


def test_rows_are_those_of_in_volume(fresh_store: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Of every level, to the last bit; the volumes are typed as a person types them."""
    questions: list[tuple[list[str], str, dict[str, Any]]] = []
    with Store.open(fresh_store) as store:
        oracle = fill(store, tmp_path)
    with relmodel.open(fresh_store) as asked_store:
        volumes: list[Volume] = [*random_boxes(oracle, 2, 50), *random_solids(oracle, 3, 51)]
        for number, volume in enumerate(volumes):
            if isinstance(volume, Box):
                typed = ["--box", *map(repr, volume.bounds.tolist())]
            elif isinstance(volume, Sphere):
                typed = ["--sphere", *map(repr, np.asarray(volume.ball).tolist())]
            else:
                faces = tmp_path / f"faces_{number}.yaml"
                faces.write_text(yaml.safe_dump({"half_spaces": volume.planes.tolist()}))
                typed, volume = ["--polyhedron", str(faces)], Polyhedron(volume.planes)
            questions += [(typed, level, asked_store.in_volume(volume, level=level)) for level in LEVELS]
    for typed, level, asked in questions:
        rows = found(capsys, "--store", fresh_store, *typed, "--level", level)
        expected = zip(*(asked[name].tolist() for name in ("path", "name", "x0", "z1")), strict=True)
        assert sorted((r["path"], r["name"], r["x0"], r["z1"]) for r in rows) == sorted(expected)
    assert sum(len(asked["path"]) for *_, asked in questions) > 20
