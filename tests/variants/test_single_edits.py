"""Edits of a plate: the differences name exactly these, with what they are moved by."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import pytest

from relmodel.store import Store
from tests.given import NewStore
from tests.parts.solids import Part, box, carried, cylinder, round_box
from tests.variants.composed import Item, differences, pose, store_items

PITCH, THICKNESS = 50.0, 16.0
AT = pose((120, -340, 55), (0.3, -0.7, 1.1))


@dataclass(frozen=True)
class Thing:
    """A hole, pocket or boss about (x, y); radius: of a pocket its corners'; depth: below the top, a boss's height."""

    kind: str
    x: float
    y: float
    radius: float
    depth: float = 0.0


THINGS = {
    "hole": Thing("through_hole", 0, 0, 4),
    "like it": Thing("through_hole", PITCH, PITCH, 4),
    "blind": Thing("blind_hole", PITCH, 0, 5, 7),
    "pocket": Thing("pocket", 2 * PITCH, 0, 3, 5),
    "boss": Thing("boss", 0, PITCH, 6, 8),
}


def plate(things: dict[str, Thing], t: float = THICKNESS) -> Any:
    """A plate of 3 x 2 cells with these things in them."""
    part = Part(box((-PITCH / 2, -PITCH / 2, 0.0), (2.5 * PITCH, 1.5 * PITCH, t)))
    for f in things.values():
        if f.kind == "boss":
            part.fuse(cylinder((f.x, f.y, t), f.radius, f.depth))
        elif f.kind == "pocket":
            part.cut(round_box((f.x - 15, f.y - 10, t - f.depth), (f.x + 15, f.y + 10, t + 50), f.radius))
        else:
            part.cut(cylinder((f.x, f.y, t - f.depth if f.kind == "blind_hole" else -1), f.radius, 200))
    return part.body


@pytest.fixture(scope="module")
def plates(new_store: NewStore) -> Iterator[Store]:
    """A store with the plate."""
    with Store.open(new_store("duckdb")) as store:
        store_items(store, "A", [Item("PLATE", plate(THINGS), AT)])
        yield store


def edited(store: Store, variant: str, body: Any) -> tuple[Counter[tuple[str, str]], list[list[float]]]:
    """How many features of each status and kind differ after an edit, and by what those that moved did."""
    store_items(store, variant, [Item("PLATE", body, AT)])
    rows = differences(store, "A", variant)
    assert [r["status"] for r in rows if r["level"] == "part"] == ["changed"]
    kinds = {thing.kind for thing in THINGS.values()}
    found = [r for r in rows if r["level"] == "feature" and r["kind"] in kinds and r["status"] != "identical"]
    moved = [r for r in found if r["status"] == "moved"]
    assert [r["angle"] for r in moved] == pytest.approx([0] * len(moved), abs=1e-6)
    return Counter((r["status"], r["kind"]) for r in found), [[r["dx"], r["dy"], r["dz"]] for r in moved]


def test_edits_are_told_apart(plates: Store) -> None:
    """All numbers are off in their last digits too."""
    hole, blind, pocket = (THINGS[name] for name in ("hole", "blind", "pocket"))
    things = THINGS | {
        "hole": replace(hole, x=hole.x + 4, y=hole.y - 3),
        "blind": replace(blind, radius=blind.radius + 0.2),
        "pocket": replace(pocket, depth=pocket.depth + 0.1),
        "new": Thing("through_hole", 2 * PITCH, PITCH, 9),
    }
    del things["boss"]
    counts, moved = edited(plates, "B", carried(plate(things), pose((3e-7, -2e-7, 4e-7))))
    assert counts == {
        ("moved", "through_hole"): 1,
        ("changed", "blind_hole"): 1,
        ("changed", "pocket"): 1,
        ("removed", "boss"): 1,
        ("added", "through_hole"): 1,
    }
    assert moved == [pytest.approx([4, -3, 0], abs=1e-5)]


def test_a_thicker_plate(plates: Store) -> None:
    """The top rises: what stands on it or hangs from it moves along, what goes through is longer."""
    counts, moved = edited(plates, "C", plate(THINGS, THICKNESS + 1.5))
    assert counts == {
        ("changed", "through_hole"): 2,
        ("moved", "blind_hole"): 1,
        ("moved", "pocket"): 1,
        ("moved", "boss"): 1,
    }
    assert moved == [pytest.approx([0, 0, 1.5], abs=1e-5)] * 3
