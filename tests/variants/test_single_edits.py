"""A random plate and one edit of it: the differences name exactly that edit."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

from relmodel.store import Store
from tests.parts.solids import Part, box, carried, cylinder, round_box
from tests.variants.composed import Item, differences, pose, store_items

PITCH = 50.0
EDITS = ("move", "radius", "add", "remove", "thickness", "pocket_depth")


@dataclass(frozen=True)
class Thing:
    """What stands in a cell of the plate: a hole (through, blind), pocket or boss about (x, y)."""

    kind: str
    x: float
    y: float
    radius: float  # of a hole or boss; corner of a pocket
    depth: float  # below the top; of a boss its height

    def surfaces(self) -> int:
        """Faces that it makes."""
        return {"through_hole": 1, "blind_hole": 2, "boss": 2, "pocket": 9}[self.kind]


@dataclass(frozen=True)
class Plate:
    cells: tuple[int, int]
    thickness: float
    things: tuple[Thing, ...]

    def body(self) -> Any:
        low, high = (
            (-PITCH / 2, -PITCH / 2, 0.0),
            ((self.cells[0] - 0.5) * PITCH, (self.cells[1] - 0.5) * PITCH, self.thickness),
        )
        part = Part(box(low, high))
        t = self.thickness
        for f in self.things:
            if f.kind == "boss":
                part.fuse(cylinder((f.x, f.y, t), f.radius, f.depth))
            elif f.kind == "pocket":
                part.cut(round_box((f.x - 15, f.y - 10, t - f.depth), (f.x + 15, f.y + 10, t + 50), f.radius))
            else:
                part.cut(cylinder((f.x, f.y, t - f.depth if f.kind == "blind_hole" else -1), f.radius, 200))
        return part.body


def random_plate(rng: np.random.Generator) -> Plate:
    """A plate with something in most cells, much of it congruent."""
    cells = (3, 2)
    t = float(rng.uniform(14, 20))
    sizes = {
        "through_hole": (float(rng.uniform(3, 6)), 0.0),
        "blind_hole": (float(rng.uniform(3, 6)), float(rng.uniform(4, 9))),
        "pocket": (float(rng.uniform(2, 5)), float(rng.uniform(3, 8))),
        "boss": (float(rng.uniform(4, 8)), float(rng.uniform(5, 9))),
    }
    things = []
    for i in range(cells[0] * cells[1]):
        # Each kind once for the edits to choose from, then at random; the last cell is free.
        kind = list(sizes)[i] if i < 4 else str(rng.choice(list(sizes)))
        if i < cells[0] * cells[1] - 1:
            things.append(Thing(kind, PITCH * (i % cells[0]), PITCH * (i // cells[0]), *sizes[kind]))
    return Plate(cells, t, tuple(things))


def edited(plate: Plate, edit: str, rng: np.random.Generator) -> tuple[Plate, Counter[tuple[str, str]], Any]:
    """The plate after an edit, what features should be said to differ (status, kind), and the displacement if any."""
    things = list(plate.things)

    def pick(*kinds: str) -> int:
        return int(rng.choice([i for i, f in enumerate(things) if f.kind in kinds]))

    if edit == "move":
        n = pick("through_hole", "blind_hole", "boss", "pocket")
        dx, dy = rng.uniform(-7, 7, 2).tolist()
        things[n] = replace(things[n], x=things[n].x + dx, y=things[n].y + dy)
        return replace(plate, things=tuple(things)), Counter({("moved", things[n].kind): 1}), (dx, dy, 0.0)
    if edit == "radius":
        n = pick("through_hole", "blind_hole", "boss")
        things[n] = replace(
            things[n], radius=things[n].radius + float(rng.choice([-1, 1])) * float(rng.uniform(0.1, 1))
        )
        return replace(plate, things=tuple(things)), Counter({("changed", things[n].kind): 1}), None
    if edit == "pocket_depth":
        n = pick("pocket")
        things[n] = replace(things[n], depth=things[n].depth + float(rng.uniform(0.05, 2)))
        return replace(plate, things=tuple(things)), Counter({("changed", "pocket"): 1}), None
    if edit == "add":
        kind = str(rng.choice(["through_hole", "pocket", "boss"]))
        like = next(f for f in things if f.kind == kind)
        free = PITCH * (plate.cells[0] - 1), PITCH * (plate.cells[1] - 1)
        things.append(replace(like, x=free[0], y=free[1]))
        return replace(plate, things=tuple(things)), Counter({("added", kind): 1}), None
    if edit == "remove":
        n = pick("through_hole", "blind_hole", "boss", "pocket")
        gone = things.pop(n)
        return replace(plate, things=tuple(things)), Counter({("removed", gone.kind): 1}), None
    # The top rises: what stands on it or hangs from it moves along, what goes through is longer.
    up = float(rng.uniform(0.5, 3))
    counts: Counter[tuple[str, str]] = Counter()
    for f in things:
        counts["changed" if f.kind == "through_hole" else "moved", f.kind] += 1
    return replace(plate, thickness=plate.thickness + up), counts, (0.0, 0.0, up)


@pytest.mark.parametrize("edit", EDITS)
def test_one_edit_is_what_differs(store: Store, edit: str) -> None:
    seed = EDITS.index(edit) % 2
    rng = np.random.default_rng([EDITS.index(edit), seed])
    before = random_plate(rng)
    after, expected, shift = edited(before, edit, rng)
    name = f"plate {seed}"
    at = pose(rng.uniform(-500, 500, 3), rng.normal(size=3))
    # Every other time all numbers of the second are off in their last digits too.
    bodies = before.body(), carried(after.body(), pose((3e-7 * seed, -2e-7 * seed, 4e-7 * seed)))
    for variant, body in zip("AB", bodies, strict=True):
        store_items(store, variant, [Item("PLATE", body, at)], name)
    rows = differences(store, "A", "B", name)
    assert [r["status"] for r in rows if r["level"] == "part"] == ["changed"]
    kinds = {"through_hole", "blind_hole", "pocket", "boss"}
    found = [r for r in rows if r["level"] == "feature" and r["kind"] in kinds]
    status = Counter((r["status"], r["kind"]) for r in found)
    assert Counter({k: n for k, n in status.items() if k[0] != "identical"}) == expected
    for r in found:
        if r["status"] == "moved":
            assert [r["dx"], r["dy"], r["dz"]] == pytest.approx(shift, abs=1e-5)
            assert r["angle"] == pytest.approx(0, abs=1e-6)
