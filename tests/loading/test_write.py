"""Rows of a robot in an assembly, made by hand: poses, bodies, pages, boxes, joints, attributes, PMI and findings."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from relmodel.arrays import Floats
from relmodel.geometry.curves import BOX, boxes_of
from relmodel.geometry.transforms import Joint, Mimic, matrices
from relmodel.model.model import Assembly, Finding, Instance, Model, Part, Pmi
from relmodel.readers import ReadOptions
from relmodel.store import Store
from tests.given import NewStore
from tests.poses import pose_of
from tests.reading import read_here, store_model

SIZES = {"plate": (60.0, 20.0, 4.0), "rod": (4.0, 6.0, 90.0)}


def pose(x: float, y: float, z: float, turn: tuple[float, float, float] = (0, 0, 0)) -> Floats:
    return pose_of((x, y, z), turn)


BASE, ARM, HAND, LOOSE = pose(1, 2, 3), pose(40, 0, 9, (0.3, -0.2, 0.5)), pose(0, 70, 20, (0, 0, 1.2)), pose(5, 6, 7)
ROBOT, IN_HAND = pose(100, -50, 10, (0, np.pi / 2, 0)), pose(3, 0, 8, (1.0, 0, 0))


def robot_in_a_cell(folder: Path) -> Model:
    """A cell with a loose plate and a robot: a base, an arm, and a hand that is an assembly of two rods."""
    models = []
    for name, size in SIZES.items():
        trimesh.creation.box(bounds=[[0, 0, 0], size]).export(folder / f"{name}.stl")
        models.append(read_here(folder / f"{name}.stl", ReadOptions("mm", name)))
    shapes = tuple(model.shapes[0] for model in models)
    shapes = (shapes[0], replace(shapes[1], findings=(Finding("odd_edge", "off", 3.0, 2.0, "mm", None, 4),)))
    note = Pmi(
        "dimension", "linear", "reach", 90.0, -0.1, 0.2, "mm", "mm", None, None, ((1, "A", None), (2, "B", "M")),
        ((3, "origin"), (5, "target")),
    )  # fmt: skip
    parts = (
        Part("P-1", "plate", 0, "steel", "red", (("mass", 1.5, "kg"), ("checked", True, None), ("mass", 1.25, "kg"))),
        Part("P-2", "rod", 1, pmi=(note,), findings=(Finding("odd_part", "heavy", 9.0, 8.0, "kg"),)),
    )
    joints = (
        Joint("turn", "revolute", "base", "arm", np.array([0.0, 0, 1]), -1.0, 2.0, ARM),
        Joint("follow", "revolute", "arm", "hand", np.array([0.0, 1, 0]), None, 0.5, HAND, Mimic("turn", 2.0, 0.25)),
    )
    hand = Assembly("hand", (Instance("left", "part", 1, np.eye(4)), Instance("right", "part", 1, IN_HAND, "blue")))
    links = (
        Instance("base", "part", 0, BASE), Instance("arm", "part", 1, BASE @ ARM),
        Instance("hand", "assembly", 0, BASE @ ARM @ HAND),
    )  # fmt: skip
    robot = Assembly("robot", links, (("maker", "us", None),), joints)
    cell = Assembly("cell", (Instance("robot", "assembly", 1, ROBOT), Instance("loose", "part", 0, LOOSE)))
    seen = Finding("odd_file", "late")
    return replace(
        models[0], shapes=shapes, parts=parts, assemblies=(hand, robot, cell), root=2, findings=(seen,),
        faces_in_file=None, faces_loaded=12,
    )  # fmt: skip


@pytest.fixture(scope="module")
def rows(new_store: NewStore, tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[dict[str, Any]]]:
    """All rows of the tables of the model, by table."""
    cell = robot_in_a_cell(tmp_path_factory.mktemp("cell"))
    with Store.open(new_store("duckdb")) as store:
        report = store_model(store, cell, "cell")
        assert (report.parts, report.occurrences, report.shapes_added, report.surfaces_added) == (2, 5, 2, 12)
        assert report.findings == (("odd_edge", 1), ("odd_file", 1), ("odd_part", 1))
        again = store_model(store, cell, "cell")
        assert (again.status, again.revision, again.shapes_added, again.arcs_added) == ("unchanged", 1, 0, 0)
        changed = store_model(store, replace(cell, root=1), "cell")
        assert (changed.status, changed.revision, changed.occurrences) == ("added", 2, 4)
        names = (
            "object_node", "object_page", "joint", "part", "shape", "object", "part_attribute", "object_attribute",
            "part_pmi", "part_pmi_datum", "part_pmi_surface", "load_finding", "object_part", "object_variant",
            "shape_arc",
        )  # fmt: skip
        with store.read() as connection:
            found = {name: connection.execute(store.table(name).select()) for name in names}
            return {name: [dict(row._mapping) for row in rows] for name, rows in found.items()}


def test_nodes_stand_where_their_frames_put_them(rows: dict[str, list[dict[str, Any]]]) -> None:
    """In the frames of their bodies: a link that is an assembly is one, with what hangs on it; pages are of one."""
    (first,) = (row["object_id"] for row in rows["object_variant"] if row["revision"] == 1)
    nodes = {row["path"]: row for row in rows["object_node"] if row["object_id"] == first}
    truth: dict[str, tuple[Floats, str | None, str]] = {
        "": (np.eye(4), None, ""), "/loose": (LOOSE, "plate", ""), "/robot": (ROBOT, None, ""),
        "/robot/base": (ROBOT @ BASE, "plate", ""), "/robot/arm": (ROBOT @ BASE @ ARM, "rod", ""),
        "/robot/hand": (np.eye(4), None, "hand"), "/robot/hand/left": (np.eye(4), "rod", "hand"),
        "/robot/hand/right": (IN_HAND, "rod", "hand"),
    }  # fmt: skip
    assert {path for path in nodes if nodes[path]["part_id"]} == {path for path, row in truth.items() if row[1]}
    names = {row["id"]: row["name"] for row in rows["part"]}
    bodies: dict[str, int] = {}
    for path, node in nodes.items():
        frame, part, body = truth[path]
        assert np.abs(matrices({k: np.array([v]) for k, v in node.items()})[0] - frame).max() < 1e-12
        assert bodies.setdefault(body, node["body_no"]) == node["body_no"]
        if part:
            corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]) * SIZES[part]
            placed = corners @ frame[:3, :3].T + frame[:3, 3]
            box = np.concatenate([placed.min(axis=0), placed.max(axis=0)])
            assert names[node["part_id"]] == part
            assert np.abs(np.array([node[c] for c in BOX], float) - box).max() < 1e-3
    assert set(nodes) == set(truth)
    numbers = {node["node_no"]: path for path, node in nodes.items()}
    assert all(
        numbers.get(node["parent_no"]) == (path.rpartition("/")[0] if path else None) for path, node in nodes.items()
    )
    assert len(set(bodies.values())) == len(bodies) == 2
    placed_parts = [node for node in nodes.values() if node["part_id"]]
    pages = {row["page"]: row for row in rows["object_page"] if row["object_id"] == first}
    assert sum(page["box_count"] for page in pages.values()) == len(placed_parts)
    for number, page in pages.items():
        own = [node for node in placed_parts if node["page"] == number]
        assert {node["body_no"] for node in own} == {page["body_no"]}
        boxes = boxes_of({c: np.array([node[c] for node in own]) for c in BOX})
        around = np.concatenate([boxes[:, :3].min(axis=0), boxes[:, 3:].max(axis=0)])
        assert np.abs(np.array([page[c] for c in BOX], float) - around).max() < 1e-3


def test_what_is_stated_becomes_rows(rows: dict[str, list[dict[str, Any]]]) -> None:
    part = {row["name"]: row for row in rows["part"]}
    shape = {row["id"]: row for row in rows["shape"]}
    for name, (x, y, z) in SIZES.items():
        own = shape[part[name]["shape_id"]]
        assert [own[c] for c in BOX] == pytest.approx([0, 0, 0, x, y, z])
        assert (own["area"], own["volume"]) == pytest.approx((2 * (x * y + y * z + x * z), x * y * z))
        assert (own["surface_count"], own["arc_count"], own["hull_x"]) == (6, 12, None)
    assert {row["shape_id"] for row in rows["shape_arc"] if row["convexity"] == "convex"} == set(shape)
    stated = {(row["part_id"], row["name"]): row for row in rows["part_attribute"]}
    plate, rod = part["plate"]["id"], part["rod"]["id"]
    assert (part["plate"]["number"], part["rod"]["number"]) == ("P-1", "P-2")
    assert {key for key in stated if key[0] == plate} == {(plate, n) for n in ("material", "colour", "mass", "checked")}
    assert (stated[plate, "mass"]["value_number"], stated[plate, "mass"]["unit"]) == (1.25, "kg")
    assert [row["name"] for row in rows["object_attribute"]] == ["maker"]
    assert sorted((row["name"], row["kind"]) for row in rows["object"]) == [
        ("cell", "assembly"), ("hand", "assembly"), ("robot", "robot"),
    ]  # fmt: skip
    assert {row["name"]: row["colour"] for row in rows["object_part"] if row["colour"]} == {"right": "blue"}
    turn, follow = sorted(rows["joint"], key=lambda row: row["joint_no"])
    assert [turn[c] for c in ("name", "parent_link", "child_link", "lower_limit", "upper_limit", "axis_z")] == [
        "turn", "base", "arm", -1.0, 2.0, 1.0,
    ]  # fmt: skip
    assert [follow[c] for c in ("name", "lower_limit", "upper_limit", "axis_y", "axis_z", "mimic_joint")] == [
        "follow", None, 0.5, 1.0, 0.0, "turn",
    ]  # fmt: skip
    assert (follow["mimic_factor"], follow["mimic_offset"], turn["mimic_joint"]) == (2.0, 0.25, None)
    assert np.abs(matrices({k: np.array([v]) for k, v in follow.items()})[0] - HAND).max() < 1e-12
    (note,) = rows["part_pmi"]
    assert [note[c] for c in ("part_id", "pmi_no", "value", "lower_limit", "upper_limit")] == [rod, 0, 90.0, -0.1, 0.2]
    assert sorted((row["precedence"], row["letter"], row["modifier"]) for row in rows["part_pmi_datum"]) == [
        (1, "A", None), (2, "B", "M"),
    ]  # fmt: skip
    noted = [(row["shape_id"], row["surface_no"], row["role"]) for row in rows["part_pmi_surface"]]
    assert sorted(noted) == [(part["rod"]["shape_id"], 3, "origin"), (part["rod"]["shape_id"], 5, "target")]
    told = {
        row["kind"]: row
        for row in rows["load_finding"]
        if row["run_id"] == min(r["run_id"] for r in rows["load_finding"])
    }
    owners = {
        kind: (row["part_id"], row["shape_id"], row["surface_id"], row["arc_id"] is None) for kind, row in told.items()
    }
    of_rod = part["rod"]["shape_id"]
    assert owners == {
        "odd_file": (None, None, None, True), "odd_part": (rod, of_rod, None, True),
        "odd_edge": (rod, of_rod, None, False),
    }  # fmt: skip
    (edge,) = (row["arc_id"] for row in rows["shape_arc"] if (row["shape_id"], row["arc_no"]) == (of_rod, 4))
    assert told["odd_edge"]["arc_id"] == edge
    assert [told["odd_part"][c] for c in ("message", "value", "bound", "unit")] == ["heavy", 9.0, 8.0, "kg"]
