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


def test_names_numbers_materials_and_places_are_told_apart(store: Store) -> None:
    """Of one shape: parts that are named otherwise, numbered anew, moved, gone and new."""
    body, bolt = bent(), cylinder((0, 0, 0), 4, 30)
    at = [pose((100 * i, -3000, 0)) for i in range(4)]
    bolts = [pose((160 * i, 3000, 0)) for i in range(6)]
    here, motion = pose((50, 60, 70)), pose((3, -4, 12), (0.1, -0.2, 0.25))
    before = [Item(f"P{i}", body, at[i], f"N-{i}", "steel") for i in range(4)]
    before += [Item(f"BOLT:{i + 1}", bolt, pose) for i, pose in enumerate(bolts)]
    before += [Item("ONE", body, here), Item("TWO", body, pose()), Item("GONE", body, pose((0, 400, 0)))]
    after = [
        Item("OTHER", body, at[0], "N-0", "steel"),
        Item("P1", body, at[1], "N-1-B", "steel"),
        Item("P2", body, at[2], "N-2", "titanium"),
        Item("P3", body, at[3], "N-3", "steel"),
    ]
    after += [Item(f"BOLT:{i + 1}", bolt, pose) for i, pose in enumerate(bolts[:2] + bolts[3:])]
    after += [Item("ONE", body, motion @ here), Item("TWO", body, pose((900, 0, 0)))]
    after += [Item("NEW", body, pose((0, 400, 5e3)))]
    rows = {r["object_path_a"] or r["object_path_b"]: r for r in parts(store, before, after)}
    renamed = {"P0": "OTHER", "BOLT:4": "BOLT:3", "BOLT:5": "BOLT:4", "BOLT:6": "BOLT:5"}
    said = {"P1": "number, name", "P2": "material"} | dict.fromkeys(renamed, "path")
    assert {path: r["status"] for path, r in rows.items() if r["status"] != "identical"} == {
        "BOLT:3": "removed",
        "ONE": "moved",
        "TWO": "moved",  # of one name: however far
        "GONE": "removed",
        "NEW": "added",
    }
    assert {path: r["differs"] for path, r in rows.items() if r["differs"]} == said
    assert {path: rows[path]["object_path_b"] for path in renamed} == renamed
    shift = (motion @ here)[:3, 3] - here[:3, 3]
    assert [rows["ONE"][c] for c in ("dx", "dy", "dz")] == pytest.approx(shift, abs=1e-12)
    assert rows["ONE"]["distance"] == pytest.approx(np.linalg.norm(shift), abs=1e-12)
    assert rows["ONE"]["angle"] == pytest.approx(np.sqrt(0.01 + 0.04 + 0.0625), abs=1e-12)
    assert (rows["TWO"]["distance"], rows["TWO"]["angle"]) == (900, 0)


def test_a_body_in_other_coordinates_is_moved_and_not_changed(store: Store) -> None:
    body, motion = bent(), pose((20, -7, 31), (0.3, 0.5, -0.4))
    before = [Item("BODY", body, np.eye(4)), Item("POST", cylinder((0, 0, 900), 5, 40), np.eye(4))]
    shift = pose((1.5, 2, 0))
    after = [Item("BODY", carried(body, motion), np.eye(4)), Item("POST", carried(before[1].body, shift), np.eye(4))]
    rows = {r["object_path_a"]: r for r in parts(store, before, after)}
    assert {r["status"] for r in rows.values()} == {"moved"}
    assert [rows["BODY"][c] for c in ("dx", "dy", "dz")] == pytest.approx([20, -7, 31], abs=1e-6)
    assert rows["BODY"]["angle"] == pytest.approx(np.sqrt(0.5), abs=1e-9)
    # A post may have been turned about its axis by any angle: it counts as shifted alone.
    assert [rows["POST"][c] for c in ("dx", "dy", "dz", "angle")] == pytest.approx([1.5, 2, 0, 0], abs=1e-6)


def test_another_shape_is_a_changed_part_or_another(store: Store) -> None:
    """A mirror image, a part that is renamed and drilled, and another shape far away under a used name."""
    mirror = gp_Trsf()
    mirror.SetMirror(gp_Ax2(gp_Pnt(30, 0, 0), gp_Dir(1, 0, 0)))
    left, plain, at = bent(), box((0, 0, 0), (80, 50, 6)), pose((7, 508, 9))
    right = BRepBuilderAPI_Transform(left, mirror, True).Shape()
    drilled = BRepAlgoAPI_Cut(plain, cylinder((30, 20, -1), 4, 10)).Shape()
    before = [Item("BRACKET", left, pose()), Item("PLATE", plain, at, "N-1")]
    after = [Item("BRACKET", right, pose()), Item("PANEL", drilled, at, "N-2")]
    store_items(store, "A", [*before, Item("ITEM:1", cylinder((0, 0, 0), 4, 30), pose((0, -500, 0)), "N-3")])
    store_items(store, "B", [*after, Item("ITEM:1", box((0, 0, 0), (9, 9, 9)), pose((2000, -500, 0)), "N-3")])
    rows = differences(store, "A", "B")
    of_parts = sorted(
        (r["object_path_a"] or "", r["object_path_b"] or "", r["status"]) for r in rows if r["level"] == "part"
    )
    assert of_parts == [
        ("", "ITEM:1", "added"),
        ("BRACKET", "BRACKET", "changed"),
        ("ITEM:1", "", "removed"),
        ("PLATE", "PANEL", "changed"),
    ]
    (plate,) = (r for r in rows if r["level"] == "part" and r["object_path_b"] == "PANEL")
    assert (plate["differs"], plate["distance"]) == ("path, number, name", None)
    holes = [r for r in rows if r["level"] == "feature" and r["kind"] == "through_hole" and r["status"] == "added"]
    assert (pytest.approx(30), pytest.approx(20)) in [(r["x"], r["y"]) for r in holes]
