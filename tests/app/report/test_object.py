"""Pages of objects and of what differs between two variants, compared with the parts that they were made from."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from relmodel.app.cli.main import main
from relmodel.store import Store
from tests.app.cli.conftest import asked
from tests.browser import Browser
from tests.given import Capsys, NewStore
from tests.pages import Page, data_of
from tests.parts.solids import box, cylinder
from tests.variants.composed import Item, pose, store_items


def plate(*holes: tuple[float, float, float]) -> Any:
    """A plate of 100 x 60 x 10 mm with through holes (x, y, radius)."""
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut

    body = box((0, 0, 0), (100, 60, 10))
    for x, y, radius in holes:
        body = BRepAlgoAPI_Cut(body, cylinder((x, y, -1), radius, 12)).Shape()
    return body


on_duckdb = pytest.mark.parametrize("target", ["duckdb"], indirect=True)
EVIL = "</script><img src=x onerror=alert(1)>"


@pytest.fixture(scope="module", params=["duckdb", "postgresql"])
def target(request: pytest.FixtureRequest, new_store: NewStore) -> str:
    """Two variants of a plate with pegs: a hole gone, another new; a peg moved, one gone, one new."""
    target = new_store(request.param)
    peg = cylinder((0, 0, 0), 4, 30)
    with Store.open(target) as store:
        before = Item("plate", plate((20, 30, 5), (70, 30, 4)), pose())
        after = Item("plate", plate((20, 30, 5), (50, 15, 3)), pose())
        pegs = [Item(n, peg, pose((10 * i, 100, 0)), "PEG") for i, n in enumerate(("peg", "old", "still"))]
        moved = [
            Item("peg", peg, pose((8, 100, 0)), "PEG"),
            Item("new", box((0, 0, 0), (5, 6, 7)), pose((0, 200, 0)), EVIL),
        ]
        store_items(store, "A", [before, *pegs])
        store_items(store, "B", [after, *moved, pegs[2]])
    return target


def made(target: str, folder: Path, *options: str) -> str:
    file = folder / "page.html"
    assert main(["report", *options, "-o", str(file), "--store", target]) == 0
    return file.read_text()


def radii(target: str, shape_surfaces: list[int], variant: str) -> set[float]:
    """Radii of those surfaces of the plate of a variant."""
    question = """SELECT s.surface_no, u.radius FROM shape_surface AS s JOIN surface AS u ON u.id = s.surface_id
        JOIN part AS p ON p.shape_id = s.shape_id JOIN object_child AS c ON c.part_id = p.id
        JOIN object_variant AS v ON v.object_id = c.parent_id WHERE v.variant = :variant AND c.segment = 'plate'"""
    rows = asked(target, question, variant=variant)
    return {float(r.radius) for r in rows if r.surface_no in shape_surfaces and r.radius is not None}


def test_an_object_has_its_parts_and_features(target: str, tmp_path: Path) -> None:
    text = made(target, tmp_path, "--object", "thing", "--variant", "A")
    page, data = Page(text), data_of(text)
    assert [p["path"] for p in data["scene"]["parts"]] == ["plate", "peg", "old", "still"]
    assert len(data["scene"]["shapes"]) == 2
    features = [item["surfaces"] for item in data["items"] if item["surfaces"] and item["part"] == 0]
    assert {frozenset(radii(target, f, "A")) for f in features if len(f) == 1} == {frozenset({5.0}), frozenset({4.0})}
    assert len([a for _, a in page.elements if "data-item" in a]) == len(data["items"])
    assert "through hole" in page.text
    assert "of 2 shapes" in page.text


def test_a_diff_shows_what_is_new_moved_and_gone(target: str, tmp_path: Path) -> None:
    text = made(target, tmp_path, "--diff", "A", "B", "--object", "thing")
    data = data_of(text)
    parts = {(p["path"], p.get("only", 0)): p for p in data["scene"]["parts"]}
    first = {"plate": "plain", "peg": "changed", "new": "added", "still": "plain", "old": "removed"}
    expected = {(name, 0): colour for name, colour in first.items()} | {("plate", 1): "removed"}
    assert {key: p["colour"] for key, p in parts.items()} == expected
    assert parts["peg", 0]["m"][3] == 8
    assert parts["old", 0]["m"][3] == 10
    shapes = data["scene"]["shapes"]
    now, then = (dict(shapes[parts["plate", k]["shape"]]["paint"]) for k in (0, 1))
    assert radii(target, now["added"], "B") == {3.0}
    assert radii(target, then["removed"], "A") == {4.0}
    assert "8 mm" in Page(text).text


@on_duckdb
def test_a_wrong_call_is_told(target: str, tmp_path: Path, capsys: Capsys) -> None:
    out = ["-o", str(tmp_path / "x.html"), "--store", target]
    assert main(["report", "--object", "thing", *out]) == 2
    assert "name one of its variants: A, B" in capsys.readouterr().err
    assert main(["report", "1", "--object", "thing", *out]) == 2
    assert main(["report", "--variant", "A", *out]) == 2
    assert main(["report", "--diff", "thing:A", "thing:C", *out]) == 2
    assert list(tmp_path.iterdir()) == []


@on_duckdb
@pytest.mark.browser
def test_a_browser_shows_both_without_complaint(target: str, tmp_path: Path, chromium: Browser) -> None:
    for options in (["--object", "thing", "--variant", "B"], ["--diff", "A", "B", "--object", "thing"]):
        made(target, tmp_path, *options)
        chromium.open((tmp_path / "page.html").as_uri())
        assert not chromium.complaints
        assert len(chromium.requests) == 1
        chromium.run("document.querySelector('[data-item]').click()")
        assert chromium.run("document.querySelectorAll('[aria-pressed=true]').length") == 1
        chromium.until(lambda: chromium.covered() > 0.02)
        chromium.wide(420)
        assert chromium.run("document.documentElement.scrollWidth") <= 420
        chromium.wide(718, "print")  # A4 between the margins that browsers leave
        right = "Math.max(...[...document.querySelectorAll('table')].map(t => t.getBoundingClientRect().right))"
        assert chromium.run(right) <= 718
        assert chromium.run("[...document.querySelectorAll('details.sql, .hint, #filter')].every(e => !e.offsetHeight)")
        chromium.wide(1400)
