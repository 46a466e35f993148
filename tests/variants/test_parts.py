"""Placed parts compared: renamed, numbered anew, moved, turned, moved in the file itself, mirrored, exchanged."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut, BRepAlgoAPI_Fuse
from OCP.BRepBuilderAPI import BRepBuilderAPI_Transform
from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt, gp_Trsf

from relmodel.store import Store
from tests.parts.solids import box, carried, cylinder
from tests.parts.turned_parts import workshop
from tests.variants.composed import Item, differences, pose, store_items


def parts(store: Store, before: list[Item], after: list[Item]) -> list[dict[str, Any]]:
    """Differences of parts; that nothing is said within parts whose geometry is the same."""
    store_items(store, "A", before)
    store_items(store, "B", after)
    rows = differences(store, "A", "B")
    assert {r["status"] for r in rows if r["level"] != "part"} <= {"identical"}
    return [r for r in rows if r["level"] == "part"]


def bent() -> Any:
    """A solid without symmetry: three legs of unlike length, and a hole."""
    legs = [box((0, 0, 0), (60, 10, 8)), box((0, 0, 0), (12, 40, 8)), box((0, 0, 0), (12, 10, 25))]
    body = BRepAlgoAPI_Fuse(BRepAlgoAPI_Fuse(legs[0], legs[1]).Shape(), legs[2]).Shape()
    return BRepAlgoAPI_Cut(body, cylinder((45, 5, -1), 3, 20)).Shape()


def test_other_names_numbers_and_materials_are_said_beside_the_geometry(store: Store) -> None:
    body, at = bent(), [pose((100 * i, 0, 0)) for i in range(4)]
    before = [Item(f"P{i}", body, at[i], f"N-{i}", "steel") for i in range(4)]
    after = [
        Item("OTHER", body, at[0], "N-0", "steel"),
        Item("P1", body, at[1], "N-1-B", "steel"),
        Item("P2", body, at[2], "N-2", "titanium"),
        Item("P3", body, at[3], "N-3", "steel"),
    ]
    rows = {r["object_path_a"]: r for r in parts(store, before, after)}
    assert {r["status"] for r in rows.values()} == {"identical"}
    assert {p: r["differs"] for p, r in rows.items()} == {
        "P0": "path",
        "P1": "number, name",
        "P2": "material",
        "P3": None,
    }
    assert rows["P0"]["object_path_b"] == "OTHER"


def test_instances_that_are_numbered_anew_have_not_moved(store: Store) -> None:
    bolt = cylinder((0, 0, 0), 4, 30)
    before = [Item(f"BOLT:{i + 1}", bolt, pose((160 * i, 0, 0))) for i in range(8)]
    after = [Item(f"BOLT:{i + 1}", bolt, x.pose) for i, x in enumerate(before[:2] + before[3:])]
    rows = parts(store, before, after)
    assert [r["object_path_a"] for r in rows if r["status"] == "removed"] == ["BOLT:3"]
    assert [r["status"] for r in rows].count("identical") == 7
    assert {r["object_path_a"]: r["object_path_b"] for r in rows if r["differs"] == "path"} == {
        f"BOLT:{i}": f"BOLT:{i - 1}" for i in range(4, 9)
    }


def test_a_part_is_moved_by_its_pose(store: Store) -> None:
    body = bent()
    motion = pose((3, -4, 12), (0.1, -0.2, 0.25))
    far = pose((900, 0, 0))
    before = [Item("ONE", body, pose((50, 60, 70))), Item("TWO", body, pose()), Item("GONE", body, pose((0, 400, 0)))]
    after = [Item("ONE", body, motion @ before[0].pose), Item("TWO", body, far), Item("NEW", body, pose((0, 400, 5e3)))]
    rows = {r["object_path_a"] or r["object_path_b"]: r for r in parts(store, before, after)}
    assert {p: r["status"] for p, r in rows.items()} == {
        "ONE": "moved",
        "TWO": "moved",  # of one name: however far
        "GONE": "removed",
        "NEW": "added",
    }
    shift = (motion @ before[0].pose)[:3, 3] - before[0].pose[:3, 3]
    assert [rows["ONE"][c] for c in ("dx", "dy", "dz")] == pytest.approx(shift, abs=1e-12)
    assert rows["ONE"]["distance"] == pytest.approx(np.linalg.norm(shift), abs=1e-12)
    assert rows["ONE"]["angle"] == pytest.approx(np.sqrt(0.01 + 0.04 + 0.0625), abs=1e-12)
    assert (rows["TWO"]["distance"], rows["TWO"]["angle"]) == (900, 0)


def test_a_body_in_other_coordinates_is_moved_and_not_changed(store: Store) -> None:
    body, motion = workshop(2).body, pose((20, -7, 31), (0.3, 0.5, -0.4))
    before = [Item("BODY", body, np.eye(4)), Item("POST", cylinder((0, 0, 900), 5, 40), np.eye(4))]
    shift = pose((1.5, 2, 0))
    after = [Item("BODY", carried(body, motion), np.eye(4)), Item("POST", carried(before[1].body, shift), np.eye(4))]
    rows = {r["object_path_a"]: r for r in parts(store, before, after)}
    assert {r["status"] for r in rows.values()} == {"moved"}
    assert [rows["BODY"][c] for c in ("dx", "dy", "dz")] == pytest.approx([20, -7, 31], abs=1e-6)
    assert rows["BODY"]["angle"] == pytest.approx(np.sqrt(0.5), abs=1e-9)
    # A post may have been turned about its axis by any angle: it counts as shifted alone.
    assert [rows["POST"][c] for c in ("dx", "dy", "dz", "angle")] == pytest.approx([1.5, 2, 0, 0], abs=1e-6)


def test_a_mirror_image_is_another_part(store: Store) -> None:
    left = bent()

    mirror = gp_Trsf()
    mirror.SetMirror(gp_Ax2(gp_Pnt(30, 0, 0), gp_Dir(1, 0, 0)))
    right = BRepBuilderAPI_Transform(left, mirror, True).Shape()
    store_items(store, "A", [Item("BRACKET", left, np.eye(4))])
    store_items(store, "B", [Item("BRACKET", right, np.eye(4))])
    rows = differences(store, "A", "B")
    assert [r["status"] for r in rows if r["level"] == "part"] == ["changed"]


def test_a_part_that_is_renamed_and_changed_is_still_a_pair(store: Store) -> None:
    plain = box((0, 0, 0), (80, 50, 6))
    drilled = BRepAlgoAPI_Cut(plain, cylinder((30, 20, -1), 4, 10)).Shape()
    store_items(store, "A", [Item("PLATE", plain, pose((7, 8, 9)), "N-1")])
    store_items(store, "B", [Item("PANEL", drilled, pose((7, 8, 9)), "N-2")])
    rows = differences(store, "A", "B")
    (part,) = (r for r in rows if r["level"] == "part")
    assert (part["status"], part["differs"], part["object_path_b"]) == ("changed", "path, number, name", "PANEL")
    assert part["distance"] is None
    holes = [r for r in rows if r["level"] == "feature" and r["kind"] == "through_hole"]
    assert [(r["status"], r["x"], r["y"]) for r in holes] == [("added", pytest.approx(30), pytest.approx(20))]


def test_another_shape_far_away_under_a_used_name_is_another_part(store: Store) -> None:
    store_items(store, "A", [Item("ITEM:1", cylinder((0, 0, 0), 4, 30), pose())])
    store_items(store, "B", [Item("ITEM:1", box((0, 0, 0), (9, 9, 9)), pose((2000, 0, 0)))])
    assert sorted(r["status"] for r in differences(store, "A", "B")) == ["added", "removed"]
