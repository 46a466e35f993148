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
from urllib.parse import parse_qsl, urlencode

import duckdb
import pytest
import sqlalchemy as sa

from relmodel.app.cli.main import main
from relmodel.app.serve.questions import question_names, read_question
from relmodel.app.serve.server import Server, StoppedError, only_reading
from relmodel.errors import StoreError, UsageError
from relmodel.printing import plain
from relmodel.resources import resource_dir
from relmodel.store import Store
from tests.app.cli.conftest import Inspection
from tests.app.cli.conftest import asked as asked_of
from tests.app.cli.test_report import EVIL, changed
from tests.browser import Browser
from tests.given import CopyStore
from tests.pages import Page

WEBP = "image/webp"
BOX = {"x0": "-99", "y0": "-99", "z0": "-99", "x1": "99", "y1": "99", "z1": "99"}  # blocks lie in it


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
def of_bulkhead(inspection: Inspection) -> Iterator[Server]:
    """Of the demonstration's world, where a test is of features, of sizes, or of long names."""
    with serving(inspection.store) as started:
        yield started


@pytest.fixture(scope="module")
def server(request: pytest.FixtureRequest) -> Iterator[Server]:
    """Of blocks on a plate; on PostgreSQL besides where a test is of what the engine does (`on_both`)."""
    with serving(request.getfixturevalue(getattr(request, "param", "blocks_seen")).store) as started:
        yield started


on_both = pytest.mark.parametrize("server", ["blocks_seen", "blocks_on_postgresql"], indirect=True)


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
    """What the JSON of a table says."""
    status, headers, text = asked(server, f"{address}.json", **parameters)
    assert status == 200, text
    assert headers["Content-Type"] == "application/json; charset=utf-8"
    found: list[dict[str, Any]] = json.loads(text)
    return found


def alike(server: Server, address: str, **parameters: str) -> list[dict[str, Any]]:
    """What the JSON of a table says; the CSV says as much."""
    found = rows(server, address, **parameters)
    status, headers, text = asked(server, f"{address}.csv", **parameters)
    assert (status, headers["Content-Type"]) == (200, "text/csv; charset=utf-8")
    assert list(map(list, csv.DictReader(io.StringIO(text)))) == list(map(list, found))
    return found


@on_both
def test_runs_are_listed_and_filtered(server: Server) -> None:
    everything = alike(server, "/runs")
    assert {r["kind"] for r in everything} >= {"load", "world", "inspect"}
    assert rows(server, "/runs", state="failed") == []
    (inspected,) = rows(server, "/runs", kind="inspect")
    assert (inspected["kind"], rows(server, "/runs", verdict="accepted")) == ("inspect", [inspected])
    assert rows(server, "/runs", text="POSE USABLE", part=inspected["part_verdict"]) == [inspected]
    for other in ({"text": "100%_nothing"}, {"part": "another variant"}, {"kind": "load' OR 'a' = 'a"}):
        assert rows(server, "/runs", **other) == []
    shown = page(server, "/")
    for r in everything:
        assert f'href="/run/{r["run"]}"' in shown


def test_many_runs_are_paged_the_newest_first(blocks_seen: Inspection, copy_store: CopyStore) -> None:
    store = copy_store(blocks_seen.store)
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
        assert sorted(seen) == sorted(every)
        assert len(every) > 400
        # One that was asked for is found however many came after.
        (run,) = (r["run"] for r in rows(started, "/runs", kind="inspect"))
        assert f'href="/run/{run}"' in page(started, "/", kind="inspect")


def test_sizes_and_rigs_are_plotted_over_time(inspection: Inspection, copy_store: CopyStore, tmp_path: Path) -> None:
    """Those with limits first, with the limits as they were stated."""
    target, file = copy_store(inspection.store), tmp_path / "limits.csv"
    measured = "SELECT path, what, measured, run_id, nominal FROM characteristic_result WHERE measured IS NOT NULL"
    measured += " ORDER BY path LIKE '%/BODY/%', path, what"
    *others, (path, what, value, run, nominal) = asked_of(target, measured)
    file.write_text(f"path,what,nominal,plus,minus\n{path},{what},,0.5,0.25\n")
    assert main(["tolerances", str(file), "--store", target]) == 0
    with serving(target) as server:
        first, *rest = rows(server, "/over-time")
        assert (first["quantity"], first["run"], first["value"]) == (f"{path}, {what}", run, value)
        assert (first["lower"], first["upper"]) == (nominal - 0.25, nominal + 0.5)
        assert {r["quantity"] for r in rest} == {f"{row[0]}, {row[1]}" for row in others}
        drawn = Page(page(server, "/over-time", path=path.upper(), what=what))
        assert [len(drawn.with_class(name)) for name in ("history", "nominal", "limit", "sigma")] == [1, 1, 2, 1]
        assert first["began_at"][:10] in drawn.text.split()
        (residual,) = (r for r in rows(server, "/rig", rig="1") if r["quantity"] == "rig 1: residual of camera left")
        assert 0 < residual["value"] < 2


def test_a_physical_part_is_shown_by_all_its_stops(server: Server, copy_store: CopyStore) -> None:
    """Names bring no elements, and no formulas."""
    store = changed(
        copy_store(str(server.target)),
        "UPDATE inspection SET serial = $given",
        "UPDATE object_variant SET name = $given",
        "UPDATE run_event SET message = '=1+1'",
        given=EVIL,
    )
    with serving(store) as started:
        (found,) = alike(started, "/parts")
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
    assert rows(server, "/parts") == []


def test_two_runs_stand_side_by_side(server: Server) -> None:
    (run,) = (r["run"] for r in rows(server, "/runs", kind="inspect"))
    differences = rows(server, "/compare", a="1", b=str(run))
    assert "kind" in {d["name"] for d in differences}
    assert list(differences[0]) == ["what", "name", "run 1", f"run {run}", "difference", "sigma"]
    digests = re.compile(r"\b[0-9a-f]{40,}\b")  # whole in the files, by their beginning on the page
    assert any(digests.search(str(d[f"run {run}"])) for d in differences)
    _, _, table = page(server, "/compare", a="1", b=str(run)).partition("<table>")
    assert not digests.search(table.partition("</table>")[0])
    assert "Nothing differs" in page(server, "/compare", a="1", b="1")
    assert 'name="b"' in page(server, "/compare")


def test_of_several_worlds_one_is_chosen(blocks_seen: Inspection, copy_store: CopyStore, tmp_path: Path) -> None:
    store, second = copy_store(blocks_seen.store), tmp_path / "second.yaml"
    second.write_text("world: annex\nobjects:\n- {object: blocks, name: spare}\n")
    assert main(["world", str(second), "--store", store]) == 0
    with serving(store) as started:
        offered = {a["value"] for tag, a in Page(page(started, "/find", **BOX)).elements if tag == "option"}
        assert {"annex", "table"} <= offered
        for world, name in (("table", "blocks"), ("annex", "spare")):
            assert {r["path"].partition("/")[0] for r in rows(started, "/find", **BOX, world=world)} == {name}


def tables(server: Server, address: str, *named: str, **parameters: str) -> dict[str, list[dict[str, Any]]]:
    """What the JSON of a page of several tables says; the JSON and CSV of those named say as much."""
    status, _, text = asked(server, f"{address}.json", **parameters)
    assert status == 200, text
    found: dict[str, list[dict[str, Any]]] = json.loads(text)
    for name in named:
        assert alike(server, address, table=name, **parameters) == found[name]
    return found


def linked(shown: str, ending: str) -> set[str]:
    return {a["href"] for tag, a in Page(shown).elements if tag == "a" and ending in a["href"]}


def test_the_tables_of_a_run_are_files(server: Server) -> None:
    (run,) = (r["run"] for r in rows(server, "/runs", kind="inspect"))
    found = tables(server, f"/run/{run}", "matched_arc")
    with Store.open(server.target, read_only=True) as store, store.read() as connection:
        for query_name in ("report/rules", "result/rejected_arc", "report/steps", "report/written"):
            expected, name = store.rows(connection, query_name, run_id=run), query_name.partition("/")[2]
            assert found[name]
            assert [tuple(r.values()) for r in found[name]] == [tuple(json_of(v) for v in r) for r in expected]
    assert found["findings"] == []
    shown = page(server, f"/run/{run}")
    assert linked(shown, ".json") == {f"/run/{run}.json"}
    of_tables = linked(shown, ".csv")
    assert of_tables == {f"/run/{run}.csv?table={name}" for name, its_rows in found.items() if its_rows}


def test_the_tables_of_an_object_are_files_with_all_rows(of_bulkhead: Server, monkeypatch: pytest.MonkeyPatch) -> None:
    server = of_bulkhead
    monkeypatch.setattr("relmodel.app.report.page.ROWS_SHOWN", 10)
    found = tables(server, "/object/bulkhead", "tree", variant="A")
    assert list(found) == ["tree", "object_features"]
    asked = asked_of(server.target, "SELECT object_path FROM placed_part WHERE object = 'bulkhead'")
    paths = {path for (path,) in asked}
    assert {r["path"] for r in found["tree"] if r["level"] == "part"} == paths
    shown = page(server, "/object/bulkhead", variant="A")
    for kind in ("rib", "pocket"):
        assert f"{kind} {sum(r['kind'] == kind for r in found['object_features'])}" in Page(shown).text
    assert f"{len(found['object_features']) - 10} more rows are left out here" in Page(shown).text
    assert linked(shown, ".json") == {"/object/bulkhead.json?variant=A"}
    assert linked(shown, ".csv") == {f"/object/bulkhead.csv?variant=A&table={name}" for name in found}


def json_of(value: Any) -> Any:
    return json.loads(json.dumps(value, default=plain))


def test_every_question_is_answered_and_takes_its_parameters(of_bulkhead: Server) -> None:
    server = of_bulkhead
    assert len(rows(server, "/questions")) == len(question_names()) >= 30
    with_parameters = [(name, it) for name in question_names() if (it := read_question(name)).defaults]
    assert len(with_parameters) >= 15
    with Store.open(server.target, read_only=True) as store, store.read() as connection:
        for name, question in with_parameters:
            written = (resource_dir("queries") / f"examples/{name}.sql").read_text()
            bound = connection.execute(question.query, question.defaults).all()
            assert bound == connection.execute(sa.text(written)).all(), name
    thin, all_ribs = rows(server, "/question/thin_ribs"), rows(server, "/question/thin_ribs", thickness="1e3")
    assert 0 < len(thin) < len(all_ribs)
    assert all(r["thickness"] < 6.2 for r in thin)
    assert 'name="depth" value="4.5"' in page(server, "/question/deep_pockets", depth="4.5")
    for given in ({"depth": "1e6"}, {"variant": "A' OR '1' = '1"}):
        assert rows(server, "/question/deep_pockets", **given) == []


def test_what_cannot_be_asked_is_told(server: Server) -> None:
    cases: tuple[tuple[str, dict[str, str], int, str], ...] = (
        ("/nothing", {}, 404, "no such page"),
        ("/run/99999", {}, 400, "there is no run 99999"),
        ("/run/1.csv", {}, 400, "name it with ?table=, one of finding, measured_size"),
        ("/run/1.json", {"table": "nothing"}, 400, "there is no table 'nothing' here"),
        ("/run/1", {"table": "steps"}, 400, "no parameter 'table' here"),
        ("/run/x", {}, 404, "no such page"),
        ("/part", {"serial": "none"}, 400, "none"),
        ("/object/none", {}, 400, "there is no object none"),
        ("/question/%2e%2e%2fcheck%2forphans", {}, 400, "there is no question"),
        ("/question/deep_pockets", {"depth": "wide"}, 400, "give a number"),
        ("/question/deep_pockets", {"depth": "nan"}, 400, "give a number"),
        ("/find", {"x0": "1"}, 400, "give a number"),
        ("/find", BOX | {"level": "bolt"}, 400, "there is no level"),
        ("/find", BOX | {"world": "mars"}, 400, "there is no world"),
        ("/runs", {"colour": "red"}, 400, "there is no parameter"),
    )
    for address, parameters, status, said in cases:
        found, headers, text = asked(server, address, **parameters)
        assert (found, said in Page(text).text) == (status, True), (address, text)
        assert "Content-Security-Policy" in headers


# What keeps it safe.


def test_there_is_no_other_picture(server: Server) -> None:
    for nothing in ("run/1", "run/99999", "run/x", f"run/{'1' * 30}", "run/../run/1", "run/", "object/99999"):
        assert asked(server, f"/picture/{nothing}")[0] == 404


def test_it_listens_on_the_loopback_address_only(server: Server) -> None:
    assert server.socket.getsockname()[0] == "127.0.0.1"
    with pytest.raises(OSError, match="refused"):
        socket.create_connection(("127.0.0.2", server.server_port), timeout=5)


def test_it_answers_get_only(server: Server) -> None:
    for method in ("POST", "PUT", "DELETE", "PATCH", "HEAD", "OPTIONS", "TRACE"):
        status, headers, _ = asked(server, "/runs", method)
        assert (status, headers["Allow"]) == (405, "GET"), method


def test_another_name_for_this_address_is_refused(server: Server) -> None:
    """As a page elsewhere would have it that had its name bound anew to 127.0.0.1."""
    own = f"127.0.0.1:{server.server_port}"
    for host in ("evil.example", f"evil.example:{server.server_port}", "127.0.0.1", "localhost:1", f"{own}.evil"):
        status, headers, text = asked(server, "/runs.json", host=host)
        assert (status, "began_at" in text) == (421, False), host
        assert not any(name.startswith("Access-Control") for name in headers)
    assert asked(server, "/runs.json", host=f"localhost:{server.server_port}")[0] == 200


LONG = {
    "duckdb": "SELECT count(*) FROM range(1000000) AS a, range(1000000) AS b WHERE (a.range * b.range) % 7 = 3",
    "postgresql": "SELECT pg_sleep(60)",
}
BEYOND = (  # what DuckDB may reach, or set to reach it
    "SELECT * FROM read_text('/etc/hostname')",
    "COPY run TO '/tmp/run.csv'",
    "ATTACH ':memory:' AS other",
    "SET enable_external_access = true",
    "SET lock_configuration = false",
)


def test_a_statement_is_answered_within_the_limits_of_sql(server: Server, monkeypatch: pytest.MonkeyPatch) -> None:
    statement = "SELECT id, kind FROM run ORDER BY id"
    said = rows(server, "/questions", query=statement)
    assert [tuple(r.values()) for r in said] == asked_of(server.target, statement)
    assert "the statement was refused: give one SELECT" in page(server, "/questions", query="DELETE FROM run")
    for bad in ("DELETE FROM run", "SELECT 1; SELECT 2", "SELECT nothing FROM run", BEYOND[0]):
        status, _, text = asked(server, "/questions.json", query=bad)
        assert (status, "the statement was refused" in Page(text).text) == (400, True), bad
    monkeypatch.setattr("relmodel.app.serve.pages.MOST_ROWS", 2)
    assert "more than 2 rows" in asked(server, "/questions.csv", query="VALUES (1), (2), (3)")[2]
    monkeypatch.setattr(server, "time_limit_s", 0.2)
    status, _, text = asked(server, "/questions.json", query=LONG["duckdb"])
    assert (status, "stopped after 0.2 s" in Page(text).text) == (504, True)


def test_questions_are_about_the_object_at_hand(of_bulkhead: Server) -> None:
    """In their words, in what they ask, and in the SQL that they offer."""
    server = of_bulkhead
    assert "How many holes of each diameter has bulkhead?" in page(server, "/questions")
    of_slider = {r["name"]: r["question"] for r in rows(server, "/questions", object="slider")}
    assert of_slider["mass_of_a_part"] == "What does carriage weigh in each variant of slider?"
    assert not [words for words in of_slider.values() if "bulkhead" in words.lower()]
    (address,) = linked(page(server, "/object/slider"), "/questions?")
    (address,) = linked(page(server, address), "/question/mass_of_a_variant?")
    path, _, given = address.partition("?")
    (weighed,) = rows(server, path, **dict(parse_qsl(given)))
    assert weighed["parts"] == 2
    (offered,) = linked(page(server, address), "/questions?query=")
    statement = dict(parse_qsl(offered.partition("?")[2]))["query"]
    assert rows(server, "/questions", query=statement) == [weighed]


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
            *(BEYOND if store.dialect == "duckdb" else ()),
        ):
            with pytest.raises((sa.exc.DBAPIError, StoreError)), store.read() as connection:
                connection.execute(sa.text(statement))


def test_a_file_is_as_it_was_and_others_write_between(blocks_seen: Inspection, copy_store: CopyStore) -> None:
    target = copy_store(blocks_seen.store)
    before = hashlib.sha256(Path(target).read_bytes()).hexdigest()
    with serving(target) as started:
        for address in ("/", "/objects", "/questions", "/question/loads", "/object/blocks"):
            assert asked(started, address)[0] == 200
        assert hashlib.sha256(Path(target).read_bytes()).hexdigest() == before
        with Store.open(target) as store, store.write() as connection:
            ids = store.new_ids(connection, "source", 1)
        assert len(ids) == 1
        assert asked(started, "/runs")[0] == 200


@on_both
def test_a_page_that_takes_too_long_is_stopped(server: Server) -> None:
    with Store.open(server.target, read_only=True) as store:
        with pytest.raises(StoppedError, match=r"after 0\.3 s"), only_reading(store, 0.3), store.read() as connection:
            connection.execute(sa.text(LONG[store.dialect]))
        with store.read() as connection:  # others go on
            assert connection.execute(sa.text("SELECT 1")).scalar() == 1
    with serving(str(server.target), time_limit_s=1e-4) as hasty:
        status, _, text = asked(hasty, "/runs")
        assert status == 504
        assert "stopped after 0.0001 s" in Page(text).text


def test_a_port_that_is_taken_is_told(server: Server) -> None:
    with pytest.raises(UsageError, match="give another with --port"):
        Server(server.target, server.server_port)


@pytest.mark.browser
def test_a_browser_shows_its_pages_without_complaint(
    of_bulkhead: Server, server: Server, blocks_seen: Inspection, chromium: Browser
) -> None:
    lists = ("", "objects", "questions", "question/hole_sizes", "over-time", "compare?a=1&b=2")
    pages = [(of_bulkhead, address) for address in lists]
    pages += [
        (server, address) for address in ("find?" + urlencode(BOX), "object/blocks", f"run/{blocks_seen.answer['run']}")
    ]
    for of, address in pages:
        chromium.wide(420)
        chromium.open(of.url + address)
        for wide in (420, 1920):
            chromium.wide(wide)
            assert chromium.run("document.documentElement.scrollWidth") <= wide, address
        if not address:  # no column of the runs is cut
            assert chromium.run("(e => e.scrollWidth <= e.clientWidth)(document.querySelector('.long'))")
        assert not chromium.complaints, address
        assert not [url for url in chromium.requests if not url.startswith((of.url, "data:"))], address
