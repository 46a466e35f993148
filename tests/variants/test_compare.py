"""Variants whose changes are known: composed by the kernel, the generator's own history, and a list made elsewhere."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import pytest

from relmodel.errors import UsageError
from relmodel.store import Store
from relmodel.variants.compare import compare
from tests.parts.solids import Part, cylinder, prism
from tests.parts.step_parts import write_solids
from tests.reading import load
from tests.store.amiss import MODEL, flaws
from tests.variants.composed import differences

Point = tuple[float, float]


SQUARE: list[Point] = [(0, 0), (100, 0), (100, 60), (0, 60)]


def write_plate(path: Path, split: float, holes: Sequence[tuple[float, float, float]]) -> Path:
    """A prism 10 mm thick over a square, one side of which is split, with through holes (x, y, radius)."""
    part = Part(prism([(x, y, 0) for x, y in (SQUARE[0], (split, 0), *SQUARE[1:])], (0, 0, 10)))
    part.cut(*(cylinder((x, y, -1), radius, 12) for x, y, radius in holes))
    write_solids(path, part.body)
    # The kernel numbers the products that a process writes: one part has one name.
    path.write_text(re.sub(r"'Open CASCADE STEP translator [^']*'", "'PLATE'", path.read_text()))
    return path


def test_known_changes_are_told_apart(fresh_store: str, tmp_path: Path) -> None:
    before = write_plate(tmp_path / "a.step", 40, [(20, 20, 5), (50, 20, 6)])
    # The lower edge is split elsewhere, a hole moved, one has gone and one is new.
    after = write_plate(tmp_path / "b.step", 70, [(23, 24, 5), (80, 40, 9)])
    with Store.open(fresh_store) as store:
        for variant, path in (("A", before), ("B", after)):
            load(store, path, name="plate", variant=variant)
        rows = differences(store, "A", "B", "plate")
        surfaces = [r for r in rows if r["level"] == "surface"]
        status = Counter((r["status"], r["kind"]) for r in surfaces)
        assert status == {
            ("identical", "plane"): 3,  # left, right, upper
            ("retrimmed", "plane"): 4,  # top and bottom for the holes, the two pieces of the lower side
            ("moved", "cylinder"): 1,
            ("removed", "cylinder"): 1,
            ("added", "cylinder"): 1,
        }
        (moved,) = (r for r in surfaces if r["status"] == "moved")
        assert [moved["dx"], moved["dy"], moved["dz"]] == pytest.approx([3, 4, 0], abs=1e-9)
        assert moved["distance"] == pytest.approx(5, abs=1e-9)
        holes = {r["status"]: r for r in rows if r["level"] == "feature" and r["kind"] == "through_hole"}
        assert holes.keys() == {"moved", "removed", "added"}
        assert holes["moved"]["distance"] == pytest.approx(5, abs=1e-9)
        assert [holes["removed"][c] for c in "xyz"] == pytest.approx([50, 20, 5])
        assert [holes["added"][c] for c in "xyz"] == pytest.approx([80, 40, 5])
        assert [r["status"] for r in rows if r["level"] == "part"] == ["changed"]
        assert not flaws(store, *MODEL)
        with pytest.raises(UsageError, match="name one of its variants: A, B"):
            compare(store, ("plate", "A"), ("plate", "C"))


def test_a_boundary_split_elsewhere_is_no_change_and_a_variant_is_as_itself(duckdb_file: Path, tmp_path: Path) -> None:
    paths = [write_plate(tmp_path / f"{x}.step", x, [(20, 20, 5)]) for x in (40, 70)]
    with Store.open(duckdb_file) as store:
        for variant, path in zip("AB", paths, strict=True):
            load(store, path, name="plate", variant=variant)
        rows = [r for r in differences(store, "A", "B", "plate") if r["level"] == "surface"]
        same = compare(store, ("plate", "A"), ("plate", "A"))
        assert same.counts == {("part", "identical"): 1}
        assert compare(store, ("plate", "A"), ("plate", "A")) == same  # made once
    # Top and bottom have other arcs, and so other rows, but the same boundary; only the pieces of the side differ.
    assert Counter(r["status"] for r in rows) == {"identical": 6, "retrimmed": 2}
