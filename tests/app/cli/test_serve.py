"""`relmodel serve`: what its pages show, and a test for each thing that keeps it safe."""

from __future__ import annotations

import csv
import hashlib
import http.client
import io
import json
import re
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from urllib.parse import urlencode

import duckdb
import numpy as np
import pytest
import sqlalchemy as sa
from PIL import Image

from relmodel.app.cli.main import main
from relmodel.app.serve.pages import PLOTS, question_names, read_question
from relmodel.app.serve.server import Server, StoppedError, only_reading
from relmodel.errors import StoreError, UsageError
from relmodel.printing import plain
from relmodel.resources import resource_dir
from relmodel.store import Store
from tests.app.cli.conftest import Inspection, Pair
from tests.app.cli.conftest import asked as asked_of
from tests.app.cli.test_report import EVIL, changed
from tests.browser import Browser
from tests.given import CopyStore
from tests.pages import Page, data_of

WEBP = "image/webp"
# A pixel of the canvas that shows a part which was found, in the middle of them, from its upper left corner.
DRAWN = """(c => {
  const g = c.getContext('webgl2'), p = new Uint8Array(4 * c.width * c.height), found = [];
  g.readPixels(0, 0, c.width, c.height, g.RGBA, g.UNSIGNED_BYTE, p);
  for (let i = 0; i < p.length; i += 4) if (p[i + 1] > p[i] + 30 && p[i + 1] > p[i + 2] + 20) found.push(i / 4);
  const at = found[found.length >> 1], scale = c.clientWidth / c.width;
  return [(at % c.width + .5) * scale, (c.height - Math.floor(at / c.width) - .5) * scale];
})(document.getElementById('canvas'))"""
BOX = {"x0": "1800", "y0": "-500", "z0": "900", "x1": "2000", "y1": "-400", "z1": "1100"}


@contextmanager
def serving(target: str, time_limit_s: float = 60.0) -> Iterator[Server]:
    with Server(target, 0, time_limit_s) as server:
        thread = threading.Thread(target=server.serve_forever, args=(0.02,), daemon=True)
        thread.start()
        try:
            yield server
        finally:
            server.shutdown()
            thread.join()


@pytest.fixture(scope="module")
def on_duckdb(inspection: Inspection) -> Iterator[Server]:
    with serving(inspection.store) as started:
        yield started


@pytest.fixture(scope="module")
def on_postgresql(postgresql_inspection: Inspection) -> Iterator[Server]:
    with serving(postgresql_inspection.store) as started:
        yield started


@pytest.fixture
def server(request: pytest.FixtureRequest) -> Server:
    """On DuckDB, and on PostgreSQL besides where a test is of what the engine does (`on_both`)."""
    started: Server = request.getfixturevalue(getattr(request, "param", "on_duckdb"))
    return started


on_both = pytest.mark.parametrize("server", ["on_duckdb", "on_postgresql"], indirect=True)


def asked(
    server: Server, address: str, method: str = "GET", host: str | None = None, **parameters: str
) -> tuple[int, dict[str, str], str]:
    """Status, headers and text of an answer."""
    connection = http.client.HTTPConnection("127.0.0.1", server.server_port, timeout=120)
    given = {"Host": host or f"127.0.0.1:{server.server_port}"}
    connection.request(method, address + (f"?{urlencode(parameters)}" if parameters else ""), headers=given)
    said = connection.getresponse()
    body = said.read()
    connection.close()
    return (
        said.status,
        dict(said.getheaders()),
        body.decode("latin-1" if said.headers["Content-Type"] == WEBP else "utf-8"),
    )


def page(server: Server, address: str, **parameters: str) -> str:
    status, headers, text = asked(server, address, **parameters)
    assert status == 200, text
    assert headers["Content-Type"] == "text/html; charset=utf-8"
    return text


def rows(server: Server, address: str, **parameters: str) -> list[dict[str, Any]]:
    """What the JSON of a table says; the CSV says as much."""
    status, headers, text = asked(server, f"{address}.json", **parameters)
    assert status == 200, text
    assert headers["Content-Type"] == "application/json; charset=utf-8"
    found: list[dict[str, Any]] = json.loads(text)
    status, headers, text = asked(server, f"{address}.csv", **parameters)
    assert (status, headers["Content-Type"]) == (200, "text/csv; charset=utf-8")
    again = list(csv.DictReader(io.StringIO(text)))
    assert len(again) == len(found)
    assert all(list(a) == list(b) for a, b in zip(again, found, strict=True))
    return found


@on_both
def test_runs_are_listed_and_filtered(server: Server) -> None:
    everything = rows(server, "/runs")
    assert {r["kind"] for r in everything} == {"load", "world", "inspect"}
    assert [r["kind"] for r in rows(server, "/runs", kind="inspect")] == ["inspect"]
    assert rows(server, "/runs", state="failed") == []
    assert rows(server, "/runs", verdict="accepted") == rows(server, "/runs", kind="inspect")
    (inspected,) = rows(server, "/runs", kind="inspect")
    assert rows(server, "/runs", text="POSE USABLE", part=inspected["part_verdict"]) == [inspected]
    assert rows(server, "/runs", text="100%_nothing") == rows(server, "/runs", part="another variant") == []
    shown = page(server, "/")
    for r in everything:
        assert f'href="/run/{r["run"]}"' in shown


def test_many_runs_are_paged_the_newest_first(inspection: Inspection, copy_store: CopyStore) -> None:
    store = copy_store(inspection.store)
    more = "SELECT r.* REPLACE (100 + n.k AS {key}) FROM {table} AS r, range(400) AS n(k) WHERE r.{key} = 1"
    with duckdb.connect(store) as connection:
        for table, key in (("run", "id"), ("run_event", "run_id")):
            connection.execute(f"INSERT INTO {table} {more.format(table=table, key=key)}")
    with serving(store) as started:
        seen: list[str] = []
        address = "/"
        while address:
            links = [a["href"] for tag, a in Page(page(started, address)).elements if tag == "a"]
            found = list(dict.fromkeys(link for link in links if link.startswith("/run/")))  # a picture links there too
            assert len(found) <= 300
            seen += found
            address = next((link for link in links if link.startswith("/?")), "")
        every = [f"/run/{r['run']}" for r in rows(started, "/runs")]
        assert seen == every
        assert len(every) > 400
        # One that was asked for is found however many came after.
        (run,) = (r["run"] for r in rows(started, "/runs", kind="inspect"))
        assert f'href="/run/{run}"' in page(started, "/", kind="inspect")


def test_sizes_and_cameras_are_plotted_over_time(server: Server) -> None:
    measured = rows(server, "/over-time")
    sizes = asked_of(
        server.target,
        "SELECT p.path, m.what, m.value, m.run_id FROM measured_size AS m JOIN presence AS p "
        "ON p.run_id = m.run_id AND p.item_no = m.item_no WHERE m.what = 'diameter' AND p.level = 'feature'",
    )
    assert {(r["name"], r["what"]) for r in measured if r["what"] == "diameter"} == {row[:2] for row in sizes}
    path, what, value, run = sizes[0]
    (found,) = rows(server, "/size", path=path, what=what)
    assert (found["run"], found["value"]) == (run, value)
    drawn = Page(page(server, "/size", path=path, what=what))
    assert len(drawn.with_class("history")) == len(drawn.with_class("nominal")) == 1
    assert len(drawn.with_class("limit")) == 2
    assert [a["href"] for tag, a in drawn.elements if tag == "a" and a["href"] == f"/run/{run}"] == [f"/run/{run}"] * 2
    assert f'href="/size?{urlencode({"path": path, "what": what})}"'.replace("&", "&amp;") in page(server, "/over-time")
    camera = next(r for r in measured if r["camera"] == "left")
    (residual,) = rows(server, "/camera", rig=str(camera["rig"]), name="left")
    assert 0 < residual["value"] < 2
    assert "circle" in page(server, "/camera", rig=str(camera["rig"]), name="left")


def picture(server: Server, address: str) -> Image.Image:
    status, headers, text = asked(server, address)
    assert (status, headers["Content-Type"]) == (200, WEBP)
    return Image.open(io.BytesIO(text.encode("latin-1"))).convert("RGB")


def test_runs_are_shown_by_their_pictures(server: Server, pair: Pair) -> None:
    (run,) = (r["run"] for r in rows(server, "/runs", kind="inspect"))
    shown = [a["src"] for tag, a in Page(page(server, "/")).elements if tag == "img"]
    assert shown == [f"/picture/run/{run}"]
    small = np.asarray(picture(server, shown[0]), float)
    with Image.open(pair.left) as opened:
        given = np.asarray(opened.convert("RGB").resize((240, 180), Image.Resampling.BICUBIC), float)
    drawn = np.ptp(small, axis=2) > 40  # the pair is grey, what is drawn over it is not
    assert 0.02 < drawn.mean() < 0.4
    assert np.abs(small - given)[np.ptp(small, axis=2) < 8].mean() < 6
    assert picture(server, shown[0]).tobytes() == picture(server, shown[0]).tobytes()
    for nothing in ("1", "99999", "x", "1" * 30, "../run/1", ""):
        assert asked(server, f"/picture/run/{nothing}")[0] == asked(server, f"/picture/object/{nothing}0000")[0] == 404


def test_objects_are_shown_by_picture_name_and_revision(server: Server) -> None:
    found = rows(server, "/objects")
    assert list(found[0]) == ["name", "variant", "revision", "parts", "mass_kg", "file", "format"]
    bulkhead = next(r for r in found if r["name"] == "bulkhead")
    ((mass, parts),) = asked_of(server.target, "SELECT sum(mass), count(*) FROM placed_part WHERE object = 'bulkhead'")
    assert (bulkhead["revision"], bulkhead["parts"], bulkhead["mass_kg"]) == (1, parts, pytest.approx(mass))
    shown = [a["src"] for tag, a in Page(page(server, "/objects")).elements if tag == "img"]
    assert len(shown) == len(found)
    ((number,),) = asked_of(server.target, "SELECT object_id FROM object_variant WHERE name = 'bulkhead'")
    solid = np.asarray(picture(server, f"/picture/object/{number}")).min(axis=2) < 240
    wide, high = np.ptp(np.flatnonzero(solid.any(axis=0))), np.ptp(np.flatnonzero(solid.any(axis=1)))
    assert 1.3 < wide / high < 4  # a bulkhead of 1.9 m by .9 m, seen from aside
    assert 0.2 < solid.mean() < 0.8


def test_a_physical_part_is_shown_by_all_its_stops(inspection: Inspection, copy_store: CopyStore) -> None:
    """Names bring no elements, and no formulas."""
    store = changed(
        copy_store(inspection.store),
        "UPDATE inspection SET serial = $given",
        "UPDATE object_variant SET name = $given",
        "UPDATE run_event SET message = '=1+1'",
        given=EVIL,
    )
    with serving(store) as started:
        (found,) = rows(started, "/parts")
        assert found["serial"] == EVIL
        assert (found["stops"], found["usable_stops"]) == (1, 1)
        shown = Page(page(started, "/parts"))
        (address,) = {a["href"] for tag, a in shown.elements if tag == "a" and a["href"].startswith("/part?")}
        own = Page(page(started, address))
        assert not [tag for page_ in (shown, own) for tag, a in page_.elements if tag == "img" and "onerror" in a]
        assert EVIL.replace("\x1b", "\\x1b") in own.text
        objects = Page(page(started, "/objects"))
        assert all(a["src"].startswith("/picture/object/") for tag, a in objects.elements if tag == "img")
        assert rows(started, "/objects")[0]["name"] == EVIL
        assert "'=1+1" in asked(started, "/runs.csv")[2]
        stops = rows(started, "/part", serial=EVIL, table="serial_stops")
        assert len(stops) == 1
        assert f"{found['checked']} of {found['features']} checked" in own.text
    with serving(inspection.store) as started:
        assert rows(started, "/parts") == []
        assert asked(started, "/part", serial="none")[0] == 400


def test_a_rig_is_shown_as_a_whole(server: Server) -> None:
    (inspected,) = rows(server, "/runs", kind="inspect")
    rig = str(next(r for r in rows(server, "/over-time") if r["what"] == "all")["rig"])
    found = rows(server, "/rig", rig=rig)
    rules = {r["rule"]: r for r in rows(server, f"/run/{inspected['run']}", table="rules")}
    at, place = next((k, r) for k, r in enumerate(found) if r["quantity"].startswith("place"))
    assert (place["value"], place["gate"]) == (rules["translation"]["value"], rules["translation"]["gate"])
    assert {r["quantity"] for r in found} > {"residual of camera left", "residual of camera right"}
    shown = Page(page(server, "/rig", rig=rig))
    limits, circles = shown.with_class("limit"), [a for tag, a in shown.elements if tag == "circle"]
    assert (len(shown.with_class("history")), len(circles), len(limits)) == (len(found), len(found), 2)
    # What passed lies below its limit, on paper too: y goes down.
    assert float(circles[at]["cy"]) > float(limits[0]["d"].partition(" ")[2].partition("L")[0])
    assert circles[at]["class"] == "good"
    assert f'href="/rig?rig={rig}"' in page(server, "/over-time")


def test_questions_stand_by_who_asks_with_a_plot(server: Server) -> None:
    listed = rows(server, "/questions")
    assert len({r["asked_by"] for r in listed}) == 4
    assert sorted(r["name"] for r in listed) == sorted(question_names())
    shown = Page(page(server, "/questions"))
    assert not any(name in shown.text for name in question_names() if "_" in name)
    assert all(r["question"] in shown.text for r in listed)
    drawn = Page(page(server, "/question/hole_sizes"))
    wide = np.array([float(a["width"]) for tag, a in drawn.elements if tag == "rect"])
    many = np.array([float(r["holes"]) for r in rows(server, "/question/hole_sizes")])
    np.testing.assert_allclose(wide / wide.max(), many / many.max(), atol=1e-3)
    with Store.open(server.target, read_only=True) as store, store.read() as connection:
        for name, columns in PLOTS.items():
            assert set(columns) <= set(
                connection.execute(read_question(name).query, read_question(name).defaults).keys()
            )


def test_the_world_of_a_box_is_drawn(server: Server) -> None:
    found = {r["path"] for r in rows(server, "/find", level="feature", **BOX)}
    scene = data_of(page(server, "/find", level="feature", **BOX))["scene"]
    assert {p["path"] for p in scene["parts"] if p["colour"] != "plain"} == found
    placed = asked_of(server.target, "SELECT path, m03, m13, m23 FROM occurrence WHERE kind = 'part'")
    places = {path: pytest.approx(at, abs=1e-6) for path, *at in placed}
    assert {p["path"]: p["m"][3::4] for p in scene["parts"]} == places


@on_both
def test_two_runs_stand_side_by_side(server: Server) -> None:
    (run,) = (r["run"] for r in rows(server, "/runs", kind="inspect"))
    differences = rows(server, "/compare", a="1", b=str(run))
    assert {"kind"} <= {d["name"] for d in differences}
    assert list(differences[0]) == ["what", "name", "run 1", f"run {run}", "difference", "sigma"]
    digests = re.compile(r"\b[0-9a-f]{40,}\b")  # whole in the files, by their beginning on the page
    assert any(digests.search(str(d[f"run {run}"])) for d in differences)
    assert not digests.search(
        page(server, "/compare", a="1", b=str(run)).partition("<table>")[2].partition("</table>")[0]
    )
    assert "Nothing differs" in page(server, "/compare", a=str(run), b=str(run))
    assert 'name="b"' in page(server, "/compare")


def test_of_several_worlds_one_is_chosen(inspection: Inspection, copy_store: CopyStore, tmp_path: Path) -> None:
    store, second = copy_store(inspection.store), tmp_path / "second.yaml"
    second.write_text("world: annex\nobjects:\n- {object: bulkhead, variant: A, name: spare}\n")
    assert main(["world", str(second), "--store", store]) == 0
    with serving(store) as started:
        offered = {a["value"] for tag, a in Page(page(started, "/find", **BOX)).elements if tag == "option"}
        assert {"annex", "demo_cell"} <= offered
        assert rows(started, "/find", **BOX, world="demo_cell") != rows(started, "/find", **BOX, world="annex")


def tables(server: Server, address: str, *named: str, **parameters: str) -> dict[str, list[dict[str, Any]]]:
    """What the JSON of a page of several tables says; the JSON and CSV of those named say as much."""
    status, _, text = asked(server, f"{address}.json", **parameters)
    assert status == 200, text
    found: dict[str, list[dict[str, Any]]] = json.loads(text)
    for name in named:
        assert rows(server, address, table=name, **parameters) == found[name]
    return found


def linked(shown: str, ending: str) -> set[str]:
    return {a["href"] for tag, a in Page(shown).elements if tag == "a" and ending in a["href"]}


def test_the_tables_of_a_run_are_files(server: Server) -> None:
    (run,) = (r["run"] for r in rows(server, "/runs", kind="inspect"))
    found = tables(server, f"/run/{run}", "matched")
    for name in ("rules", "rejected", "steps", "written"):
        query = (resource_dir("queries") / f"report/{name}.sql").read_text()
        expected = asked_of(server.target, query, run_id=run)
        assert [tuple(r.values()) for r in found[name]] == [tuple(json_of(v) for v in r) for r in expected]
    assert found["findings"] == []
    shown = page(server, f"/run/{run}")
    assert linked(shown, ".json") == {f"/run/{run}.json"}
    of_tables = linked(shown, ".csv")
    assert of_tables == {f"/run/{run}.csv?table={name}" for name, its_rows in found.items() if its_rows}


def test_the_tables_of_an_object_are_files_with_all_rows(server: Server, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("relmodel.app.report.page.ROWS_SHOWN", 10)
    found = tables(server, "/object/bulkhead", "tree", "object_kinds", variant="A")
    assert list(found) == ["tree", "object_features", "object_kinds"]
    paths = {
        path for (path,) in asked_of(server.target, "SELECT object_path FROM placed_part WHERE object = 'bulkhead'")
    }
    assert {r["path"] for r in found["tree"] if r["level"] == "part"} == paths
    assert sum(r["features"] for r in found["object_kinds"]) == len(found["object_features"])
    shown = page(server, "/object/bulkhead", variant="A")
    assert f"{len(found['object_features']) - 10} more rows are left out here" in Page(shown).text
    assert linked(shown, ".json") == {"/object/bulkhead.json?variant=A"}
    assert linked(shown, ".csv") == {f"/object/bulkhead.csv?variant=A&table={name}" for name in found}


def test_pages_of_one_table_are_files_and_say_so(server: Server) -> None:
    assert rows(server, "/") == rows(server, "/runs")
    for address, parameters in {
        "/runs": {"kind": "load"},
        "/find": {"level": "part", **BOX},
        "/question/deep_pockets": {"depth": "30.0"},
    }.items():
        shown = page(server, address, **parameters)
        for suffix in (".json", ".csv"):
            (link,) = linked(shown, suffix)
            status, _, text = asked(server, link)
            assert (status, text) == (200, asked(server, address + suffix, **parameters)[2])


def json_of(value: Any) -> Any:
    return json.loads(json.dumps(value, default=plain))


def test_every_question_is_answered_and_takes_its_parameters(server: Server) -> None:
    assert len(rows(server, "/questions")) == len(question_names()) >= 30
    for name in question_names():
        question = read_question(name)
        with Store.open(server.target, read_only=True) as store, store.read() as connection:
            written = (resource_dir("queries") / f"examples/{name}.sql").read_text()
            expected = connection.execute(sa.text(written)).all()
            bound = connection.execute(question.query, question.defaults).all()
        assert bound == expected, name
    assert sum(bool(read_question(name).defaults) for name in question_names()) >= 15
    thin, all_ribs = rows(server, "/question/thin_ribs"), rows(server, "/question/thin_ribs", thickness="1e3")
    assert 0 < len(thin) < len(all_ribs)
    assert all(r["thickness"] < 6.2 for r in thin)
    assert 'name="depth" value="4.5"' in page(server, "/question/deep_pockets", depth="4.5")
    assert rows(server, "/question/deep_pockets", depth="1e6") == []


@pytest.mark.parametrize(
    ("address", "parameters", "status", "said"),
    [
        ("/nothing", {}, 404, "no such page"),
        ("/run/99999", {}, 400, "there is no run 99999"),
        ("/run/99999.json", {}, 400, "there is no run 99999"),
        ("/run/1.csv", {}, 400, "name it with ?table=, one of run_findings, checked"),
        ("/run/1.json", {"table": "nothing"}, 400, "there is no table 'nothing' here"),
        ("/run/1", {"table": "steps"}, 400, "no parameter 'table' here"),
        ("/object/bulkhead.csv", {"variant": "A"}, 400, "one of tree, object_features, object_kinds"),
        ("/run/x", {}, 404, "no such page"),
        ("/object/none", {}, 400, "there is no object none"),
        ("/question/none", {}, 400, "there is no question"),
        ("/question/deep_pockets", {"depth": "wide"}, 400, "give a number"),
        ("/question/deep_pockets", {"depth": "nan"}, 400, "give a number"),
        ("/find", {"x0": "1"}, 400, "give a number"),
        ("/find", BOX | {"level": "bolt"}, 400, "there is no level"),
        ("/find", BOX | {"world": "mars"}, 400, "there is no world"),
        ("/runs", {"colour": "red"}, 400, "there is no parameter"),
    ],
)
def test_what_cannot_be_asked_is_told(
    server: Server, address: str, parameters: dict[str, str], status: int, said: str
) -> None:
    found, headers, text = asked(server, address, **parameters)
    assert found == status
    assert said in Page(text).text
    assert "Content-Security-Policy" in headers


# What keeps it safe.


def test_it_listens_on_the_loopback_address_only(server: Server) -> None:
    assert server.socket.getsockname()[0] == "127.0.0.1"
    with pytest.raises(OSError, match="refused"):
        socket.create_connection(("127.0.0.2", server.server_port), timeout=5)


def test_it_answers_get_only(server: Server) -> None:
    for method in ("POST", "PUT", "DELETE", "PATCH", "HEAD", "OPTIONS", "TRACE"):
        status, headers, _ = asked(server, "/runs", method)
        assert (status, headers["Allow"]) == (405, "GET"), method


@pytest.mark.parametrize(
    "host", ["evil.example", "evil.example:{port}", "127.0.0.1", "localhost:1", "127.0.0.1:{port}.evil"]
)
def test_another_name_for_this_address_is_refused(server: Server, host: str) -> None:
    """As a page elsewhere would have it that had its name bound anew to 127.0.0.1."""
    status, headers, text = asked(server, "/runs.json", host=host.format(port=server.server_port))
    assert status == 421
    assert "began_at" not in text
    assert not any(name.startswith("Access-Control") for name in headers)
    assert asked(server, "/runs.json", host=f"localhost:{server.server_port}")[0] == 200


def test_only_named_queries_are_asked(server: Server) -> None:
    for address in ("/question/../check/orphans", "/question/%2e%2e%2fcheck%2forphans", "/question/loads;", "/query"):
        assert asked(server, address)[0] in (400, 404)
    for name in ("sql", "query", "q"):
        assert asked(server, "/question/loads", **{name: "SELECT 1"})[0] == 400
    # What is given stays a value.
    assert rows(server, "/question/deep_pockets", variant="A' OR '1' = '1") == []
    assert rows(server, "/runs", kind="load' OR 'a' = 'a") == []


def test_every_answer_has_its_policy(server: Server) -> None:
    for address in ("/", "/objects", "/objects.json", "/nothing"):
        _, headers, _ = asked(server, address)
        policy = headers["Content-Security-Policy"]
        assert policy.startswith("default-src 'none'; ")
        assert "frame-ancestors 'none'" in policy
        assert "unsafe-inline'; script" not in policy.partition("script-src")[2]
        assert headers["X-Content-Type-Options"] == "nosniff"
        assert headers["Cache-Control"] == "no-store"
        assert headers["Cross-Origin-Resource-Policy"] == "same-origin"


@on_both
def test_pages_write_nothing_and_reach_nothing_else(server: Server) -> None:
    with Store.open(server.target, read_only=True) as store, only_reading(store, 60):
        with pytest.raises(StoreError, match="reading only"), store.write():
            pass
        for statement in (
            "INSERT INTO source VALUES (1, 'a', 'b', 'c', NULL, 'mm', 1, 'd')",
            "CREATE TABLE mine (a INTEGER)",
            *(
                (
                    "SELECT * FROM read_text('/etc/hostname')",
                    "COPY run TO '/tmp/run.csv'",
                    "ATTACH ':memory:' AS other",
                    "SET enable_external_access = true",
                    "SET lock_configuration = false",
                )
                if store.dialect == "duckdb"
                else ()
            ),
        ):
            with pytest.raises((sa.exc.DBAPIError, StoreError)), store.read() as connection:
                connection.execute(sa.text(statement))


def test_a_file_is_as_it_was_and_others_write_between(inspection: Inspection, copy_store: CopyStore) -> None:
    target = copy_store(inspection.store)
    before = hashlib.sha256(Path(target).read_bytes()).hexdigest()
    with serving(target) as started:
        for address in ("/", "/objects", "/questions", "/question/loads", "/object/bulkhead?variant=A"):
            assert asked(started, address)[0] == 200
        assert hashlib.sha256(Path(target).read_bytes()).hexdigest() == before
        with Store.open(target) as store, store.write() as connection:
            ids = store.new_ids(connection, "source", 1)
        assert len(ids) == 1
        assert asked(started, "/runs")[0] == 200


@on_both
def test_a_page_that_takes_too_long_is_stopped(server: Server) -> None:
    long = {
        "duckdb": "SELECT count(*) FROM range(1000000) AS a, range(1000000) AS b WHERE (a.range * b.range) % 7 = 3",
        "postgresql": "SELECT pg_sleep(60)",
    }
    with Store.open(server.target, read_only=True) as store:
        with pytest.raises(StoppedError, match=r"after 0\.3 s"), only_reading(store, 0.3), store.read() as connection:
            connection.execute(sa.text(long[store.dialect]))
        with store.read() as connection:  # others go on
            assert connection.execute(sa.text("SELECT 1")).scalar() == 1
    with serving(str(server.target), time_limit_s=1e-4) as hasty:
        status, _, text = asked(hasty, "/runs")
        assert status == 504
        assert "stopped after 0.0001 s" in Page(text).text


def test_a_statement_that_does_not_heed_the_limit_is_told_of(
    duckdb_file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("relmodel.app.serve.server.GRACE_S", 0.0)
    unheeding = "SELECT sum(levenshtein(repeat('a', 10000 + i::INT), repeat('b', 10000))) FROM range(3) AS t(i)"
    told: list[str] = []
    with (
        Store.open(duckdb_file, read_only=True) as store,
        pytest.raises(StoppedError, match="stopped"),
        only_reading(store, 0.5, lambda: told.append("overdue")),
        store.read() as connection,
    ):
        connection.execute(sa.text(unheeding))
    assert told == ["overdue"]


def test_a_port_that_is_taken_is_told(server: Server) -> None:
    with pytest.raises(UsageError, match="give another with --port"):
        Server(server.target, server.server_port)


@pytest.mark.browser
def test_new_runs_appear_by_themselves(inspection: Inspection, copy_store: CopyStore, chromium: Browser) -> None:
    store = copy_store(inspection.store)
    with serving(store) as started:
        before = asked(started, "/newest")[2]
        chromium.open(started.url)
        with started.turn, duckdb.connect(store) as connection:
            connection.execute("INSERT INTO run SELECT * REPLACE (77 AS id) FROM run WHERE id = 1")
            connection.execute("INSERT INTO run_event SELECT * REPLACE (77 AS run_id) FROM run_event WHERE run_id = 1")
        assert asked(started, "/newest")[2] != before
        chromium.until(lambda: bool(chromium.run("Boolean(document.querySelector('a[href=\"/run/77\"]'))")))
        assert not chromium.complaints


@pytest.mark.browser
def test_a_box_is_drawn_and_asked(inspection: Inspection, chromium: Browser) -> None:
    """A slider moves a face; a click on a part puts the box about it, which then holds the part's own."""
    value = "document.querySelector('.ask [name={}]').value"
    with serving(inspection.store) as started:
        chromium.open(started.url + "find?" + urlencode(BOX))
        chromium.run(
            "(s => { s.value = 1700; s.dispatchEvent(new Event('input')) })(document.querySelector('[data-bound=x0]'))"
        )
        assert chromium.run(value.format("x0")) == "1700"
        left, top = chromium.run("(r => [r.left, r.top])(document.getElementById('canvas').getBoundingClientRect())")
        u, v = chromium.run(DRAWN)
        chromium.mouse("mousePressed", left + u, top + v, 1)
        chromium.mouse("mouseReleased", left + u, top + v)
        path = chromium.run("document.getElementById('model-part').textContent")
        low_high = [float(chromium.run(value.format(name))) for name in BOX]
        box = "SELECT x0, y0, z0, x1, y1, z1 FROM occurrence WHERE path = :path"
        (own,) = asked_of(started.target, box, path=path)
        assert all(at <= its for at, its in zip(low_high[:3], own[:3], strict=True))
        assert all(at >= its for at, its in zip(low_high[3:], own[3:], strict=True))
        chromium.run("document.querySelector('.ask button').click()")
        chromium.until(lambda: f"x0={low_high[0]:.0f}" in str(chromium.run("location.search")))
        chromium.until(lambda: path in str(chromium.run("document.body.textContent")))
        assert not chromium.complaints


@pytest.mark.browser
@pytest.mark.parametrize(
    "address",
    [
        "", "objects", "find?" + urlencode(BOX), "question/hole_sizes", "parts", "over-time", "rig?rig=1",
        "compare?a=1&b=2", "object/bulkhead?variant=A", "run/4",
    ],
)  # fmt: skip
def test_a_browser_shows_its_pages_without_complaint(on_duckdb: Server, chromium: Browser, address: str) -> None:
    chromium.wide(420)
    chromium.open(on_duckdb.url + address)
    for wide in (420, 1920):
        chromium.wide(wide)
        assert chromium.run("document.documentElement.scrollWidth") <= wide
    if not address:  # no column of the runs is cut
        assert chromium.run("(e => e.scrollWidth <= e.clientWidth)(document.querySelector('.long'))")
    assert not chromium.complaints
    assert not [url for url in chromium.requests if not url.startswith((on_duckdb.url, "data:"))]
