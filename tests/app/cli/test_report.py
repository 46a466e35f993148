"""`relmodel report`: pages of runs, compared with the rows that they are made from."""

from __future__ import annotations

import base64
import re
from pathlib import Path

import duckdb
import numpy as np
import pytest

from relmodel.app.audit import run_named
from relmodel.app.cli.main import main
from relmodel.errors import UsageError
from relmodel.store import Run, Store
from tests.app.cli.conftest import Inspection, Pair, asked
from tests.browser import Browser
from tests.given import Capsys, CopyStore
from tests.pages import Page, data_of

EVIL = """</script></title></style><img src=x onerror="window.hacked=1">'"`<!--&amp;\x1b[31m"""


def written(store: str, folder: Path, *options: str) -> str:
    file = folder / "page.html"
    assert main(["report", *options, "-o", str(file), "--store", store]) == 0
    return file.read_text()


@pytest.fixture(scope="module")
def page(inspection: Inspection, tmp_path_factory: pytest.TempPathFactory) -> str:
    return written(inspection.store, tmp_path_factory.mktemp("report"))


@pytest.fixture(scope="module")
def read(page: str) -> Page:
    return Page(page)


@pytest.fixture(scope="module")
def of_blocks(blocks_seen: Inspection, tmp_path_factory: pytest.TempPathFactory) -> str:
    """A page of less, where it does not matter what was seen."""
    return written(blocks_seen.store, tmp_path_factory.mktemp("blocks"))


def test_the_verdict_comes_first(read: Page, inspection: Inspection) -> None:
    text, head = read.text, f"Part {inspection.answer['outcome']['part_verdict']}; pose usable"
    assert text.index(head) < text.index(inspection.answer["reason"]) < text.index("Pictures")


def test_the_head_names_the_rig_s_file_and_the_pictures(read: Page, inspection: Inspection) -> None:
    (rig,) = asked(inspection.store, "SELECT name, left(sha256, 12) FROM run_input WHERE role = 'rig'")
    text = " ".join(read.text.split())
    assert f"{rig[0]}, SHA-256 {rig[1]}, in use since 20" in text.replace("_ ", "_")
    assert "as the file says; corrected most in" in text


def test_balloons_stand_at_the_bores_that_they_number(read: Page, inspection: Inspection, pair: Pair) -> None:
    """Where the cameras show the middles of their boxes, at the pose in the answer."""
    rows = asked(
        inspection.store,
        "SELECT c.number, o.m00, o.m01, o.m02, o.m03, o.m10, o.m11, o.m12, o.m13, o.m20, o.m21, o.m22, o.m23, "
        "(f.x0 + f.x1) / 2, (f.y0 + f.y1) / 2, (f.z0 + f.z1) / 2 FROM characteristic_result AS c "
        "JOIN characteristic AS d USING (object_no, number) JOIN occurrence AS o ON o.id = d.occurrence_id "
        "JOIN feature AS f ON f.shape_id = o.shape_id AND f.name = d.item "
        "WHERE c.measured IS NOT NULL AND c.what = 'diameter' AND f.name LIKE 'through_hole%'",
    )
    camera = next(name for name in ("left", "right") if f"As camera {name} shows it" in " ".join(read.text.split()))
    seen = np.linalg.inv(np.array(inspection.answer["world_from_camera"][camera]))
    off = []
    for number, *m, x, y, z in rows:
        at = seen @ np.append(np.reshape(m, (3, 4)) @ [x, y, z, 1], 1)
        pixel = np.array(pair.rig["cameras"][camera]["matrix"]) @ (at[:3] / at[2])
        tags = [a.get("href") for _, a in read.elements]
        if f"#characteristic-{number}" in tags:
            place = read.elements[tags.index(f"#characteristic-{number}") + 2][1]
            off.append(np.hypot(pixel[0] - float(place["cx"]), pixel[1] - float(place["cy"])))
    assert len(off) >= 3
    assert np.median(off) < 4, off  # some are cut by the picture's border


def test_every_arc_is_drawn_once_with_its_fate(read: Page, inspection: Inspection) -> None:
    ids = [a["id"] for _, a in read.elements if "id" in a]
    assert len(ids) == len(set(ids))
    for classes, more, counted in (
        ("arc", 0, "count(*) FROM image_arc"),
        ("model", 1, "count(*) FROM view_arc"),  # and its section
        ("arc matched", 0, "count(DISTINCT (camera, image_arc_no)) FROM matched_arc"),
        ("arc rejected", 0, "count(*) FROM rejected_arc"),
        ("model met", 0, "count(*) FROM view_arc WHERE log_odds > 0"),
    ):
        ((count,),) = asked(inspection.store, f"SELECT {counted}")
        assert len(read.with_class(*classes.split())) == count + more, classes
    for kind, count in asked(inspection.store, "SELECT kind, count(*) FROM image_arc GROUP BY kind"):
        assert len(read.with_class("arc", kind)) == count
    for (reason,) in asked(inspection.store, "SELECT DISTINCT reason FROM rejected_arc"):
        assert f"rejected: {reason}" in read.text


def test_a_page_fetches_nothing_and_stays_small(page: str, read: Page) -> None:
    for tag, attributes in read.elements:
        assert tag not in ("link", "iframe", "object", "embed", "base")
        for name in ("src", "href", "action", "srcset"):
            assert attributes.get(name, "#").startswith(("data:", "#")), (tag, attributes)
    assert not re.search(r"url\(|@import|import\(|fetch\(|XMLHttpRequest|WebSocket", "".join(read.scripts) + page)
    policy = next(a["content"] for tag, a in read.elements if a.get("http-equiv") == "Content-Security-Policy")
    assert policy.startswith("default-src 'none'; img-src data:; ")
    assert "script-src 'sha256-" in policy
    pictures = sum(len(a["href"]) for tag, a in read.elements if tag == "image")
    geometry = sum(len(s[k]) for s in data_of(page)["scene"]["shapes"] for k in "vte")
    assert len(page) - pictures - geometry <= 1_000_000


def test_the_model_is_the_stored_mesh(page: str, inspection: Inspection) -> None:
    scene = data_of(page)["scene"]
    meshes = asked(
        inspection.store,
        "SELECT shape_id, vertices, triangles, triangle_surfaces FROM shape_mesh WHERE shape_id IN "
        "(SELECT shape_id FROM occurrence WHERE kind = 'part') ORDER BY shape_id",
    )
    assert len(scene["shapes"]) == len(meshes)
    for shape, (_, vertices, triangles, surfaces) in zip(scene["shapes"], meshes, strict=True):
        found = np.frombuffer(base64.b64decode(shape["v"]), "<u2").reshape(-1, 3) / 65535 * shape["size"] + shape["lo"]
        np.testing.assert_allclose(found, np.reshape(vertices, (-1, 3)), atol=max(shape["size"]) / 65535 + 1e-4)
        steps = np.frombuffer(base64.b64decode(shape["t"]), "<i4" if shape["wide"] else "<i2")
        drawn = np.cumsum(steps, dtype=np.int64).reshape(-1, 3)
        of = np.concatenate([np.full(count // 3, surface) for surface, _, count in shape["s"]])
        rows = zip(map(tuple, np.reshape(triangles, (-1, 3)).tolist()), surfaces, strict=True)
        assert sorted(zip(map(tuple, drawn.tolist()), of.tolist(), strict=True)) == sorted(rows)
    paths = {p for (p,) in asked(inspection.store, "SELECT path FROM occurrence WHERE kind = 'part'")}
    assert {p["path"] for p in scene["parts"]} == paths


def changed(store: str, *statements: str, given: str = "") -> str:
    """The store after statements, in which $given stands for a text."""
    with duckdb.connect(store) as connection:
        for statement in statements:
            connection.execute(statement, {"given": given} if "$given" in statement else None)
    return store


@pytest.fixture(scope="module")
def evil_page(blocks_seen: Inspection, copy_store: CopyStore, tmp_path_factory: pytest.TempPathFactory) -> str:
    """That page of a run whose names are all an attempt to run a script."""
    store = changed(
        copy_store(blocks_seen.store),
        "UPDATE part_in_view SET path = path || $given WHERE level = 'part'",
        "UPDATE part_in_view SET path = regexp_replace(path, '/([^/]*)$', $given || '/\\1') WHERE level <> 'part'",
        "UPDATE presence SET path = path || $given WHERE level = 'part'",
        "UPDATE presence SET path = regexp_replace(path, '/([^/]*)$', $given || '/\\1') WHERE level <> 'part'",
        "UPDATE object_node SET path = path || $given WHERE part_id IS NOT NULL",
        "UPDATE image SET file_name = $given",
        "UPDATE run_input SET name = $given",
        "UPDATE inspection SET reason = $given",
        "UPDATE world SET name = $given",
        "UPDATE placed_object SET world = $given",
        "UPDATE run_event SET message = $given",
        "UPDATE run SET parameters = json_object($given, $given, 'operator', $given)",
        given=EVIL,
    )
    return written(store, tmp_path_factory.mktemp("evil"))


def test_names_cannot_bring_elements(evil_page: str, of_blocks: str) -> None:
    found = Page(evil_page)
    tags, others = ([tag for tag, _ in it.elements if tag != "wbr"] for it in (found, Page(of_blocks)))
    assert tags == others
    assert not [a for _, a in found.elements if any(name.startswith("on") for name in a)]
    assert "window.hacked=1" in found.text
    assert "\x1b" not in evil_page
    paths = [p["path"] for p in data_of(evil_page)["scene"]["parts"]]
    assert paths
    assert all(path.endswith(EVIL) for path in paths)


def test_a_refusal_says_why(blocks_seen: Inspection, blocks_pair: Pair, copy_store: CopyStore, tmp_path: Path) -> None:
    store = changed(
        copy_store(blocks_seen.store),
        "UPDATE inspection SET verdict = 'refused', reason = 'too little evidence'",
        "DELETE FROM part_in_view",
        "DELETE FROM image_blob",
    )
    page = written(store, tmp_path)
    found = Page(page)
    text = found.text
    assert text.index("Pose not found") < text.index("too little evidence") < text.index("Pictures")
    assert found.with_class("verdict", "bad")
    assert text.count("the bytes of this picture were not kept") == 2
    # The model is seen from the side of the cameras, though nothing says which parts they show.
    seen_from = np.asarray(data_of(page)["scene"]["from"])
    assert -seen_from @ np.asarray(blocks_pair.prior["world_from_rig"])[:3, 2] > 0.8 * np.linalg.norm(seen_from)
    assert found.with_class("arc", "rejected")


def test_a_failed_run_has_a_page(duckdb_file: Path, tmp_path: Path) -> None:
    with (
        Store.open(duckdb_file) as store,
        pytest.raises(ValueError, match="lens"),
        Run.begin(store, "inspect", {"world": "w"}),
    ):
        raise ValueError("the lens fell off")
    found = Page(written(str(duckdb_file), tmp_path))
    assert found.with_class("verdict", "bad")
    assert found.text.index("Failed") < found.text.index("the lens fell off")


def test_what_is_not_there_is_said(duckdb_file: Path, tmp_path: Path, capsys: Capsys) -> None:
    options = ["-o", str(tmp_path / "x.html"), "--store", str(duckdb_file)]
    assert main(["report", "7", *options]) == 2
    assert "there is no run 7" in capsys.readouterr().err
    assert main(["report", *options]) == 2
    assert "holds no inspection" in capsys.readouterr().err
    assert not (tmp_path / "x.html").exists()
    with Store.open(duckdb_file) as store, store.read() as connection, pytest.raises(UsageError):
        run_named(store, connection, None)
    assert main(["report", "7", "-o", str(tmp_path / "no/x.html"), "--store", str(duckdb_file)]) == 3


def test_pages_of_postgresql_are_those_of_duckdb(page: str, postgresql_inspection: Inspection, tmp_path: Path) -> None:
    other = data_of(written(postgresql_inspection.store, tmp_path))
    ours = data_of(page)
    assert other["items"] == ours["items"]
    assert other["scene"]["parts"] == ours["scene"]["parts"]


def opened(page: str, chromium: Browser, folder: Path) -> Browser:
    file = folder / "page.html"
    file.write_text(page)
    chromium.open(file.as_uri())
    return chromium


@pytest.mark.browser
def test_a_browser_shows_it_without_complaint_or_request_and_toggles_layers(
    of_blocks: str, chromium: Browser, blocks_seen: Inspection, tmp_path: Path
) -> None:
    shown = opened(of_blocks, chromium, tmp_path)
    assert not shown.complaints
    assert [url for url in shown.requests if not url.startswith("data:")] == [shown.run("location.href")]
    assert shown.run("[...document.querySelectorAll('svg.picture image')].length") == 2
    word, verdict = shown.run("document.querySelector('.verdict .word').textContent"), blocks_seen.answer["outcome"]
    assert word.startswith(f"Part {verdict['part_verdict']}; pose usable")
    assert blocks_seen.answer["reason"] in shown.run("document.body.innerText")

    def seen(selector: str) -> int:
        style = f"[...document.querySelectorAll({selector!r})].map(e => getComputedStyle(e).display)"
        return sum(display != "none" for display in shown.run(style))

    assert seen("path.model.met") > 0 == seen("path.arc.rejected")
    shown.run("document.querySelector('[data-layer=rejected-arcs]').click()")
    assert seen("path.arc.rejected") > 0
    shown.run("document.querySelector('[data-layer=states]').click()")
    assert seen("path.model") == 0
    shown.run("document.querySelector('[data-layer=met-arcs]').click()")
    assert seen("path.model.met") > 0 == seen("path.model.unmet")
    shown.run("document.querySelector('svg.picture').focus()")
    width = "document.querySelector('svg.picture').viewBox.baseVal.width"
    whole = shown.run(width)
    for key, nearer in (("+", True), ("0", False)):
        shown.press(key)
        assert (shown.run(width) < whole) == nearer
    shown.run("document.querySelector('li[data-choose]').click()")
    assert shown.run("document.querySelectorAll('.picture path.lit').length") > 0
    printed = base64.b64decode(shown.call("Page.printToPDF", preferCSSPageSize=True)["data"])
    assert 2 <= len(re.findall(rb"/Type /Page\b", printed)) <= 4


@pytest.mark.browser
def test_names_from_files_run_nothing(evil_page: str, chromium: Browser, tmp_path: Path) -> None:
    shown = opened(evil_page, chromium, tmp_path)
    assert not shown.complaints
    assert shown.run("typeof window.hacked") == "undefined"
    assert len(shown.requests) == 1 + sum(url.startswith("data:") for url in shown.requests)
    assert EVIL.replace("\x1b", "\\x1b") in shown.run("document.querySelector('li[data-feature]').textContent")
    # Nor would a name that found its way in: the policy of the page holds it back.
    refused = shown.run(
        "new Promise(done => { const seen = []; addEventListener('securitypolicyviolation', e => {"
        " seen.push(e.effectiveDirective); if (seen.length == 3) done(seen.sort()); });"
        " document.body.append(Object.assign(document.createElement('script'), {textContent: 'window.hacked = 2'}),"
        " Object.assign(new Image(), {src: 'http://127.0.0.1:9/x.png'}));"
        " fetch('http://127.0.0.1:9/').catch(() => 0); })"
    )
    assert refused == ["connect-src", "img-src", "script-src-elem"]
    assert shown.run("typeof window.hacked") == "undefined"
