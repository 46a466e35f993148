"""What each address shows.  All that reaches the store are named queries with bound parameters."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any
from urllib.parse import quote, urlencode

from markupsafe import Markup
from sqlalchemy import Connection

from relmodel.app.audit.compare_runs import compare_runs
from relmodel.app.report.object import object_page, object_tables
from relmodel.app.report.page import ROWS_SHOWN, Table, cell, policy, render
from relmodel.app.report.run import run_page, run_tables
from relmodel.app.serve.questions import finite, first_line, question_names, read_question
from relmodel.drawing.plots import Point, history
from relmodel.errors import UsageError
from relmodel.find.find import LEVELS, find_rows
from relmodel.find.volumes import Box
from relmodel.printing import print_rows, print_tables
from relmodel.store import Store, sql

BOUNDS = ("x0", "y0", "z0", "x1", "y1", "z1")
_NAV = (
    ("/", "runs"),
    ("/objects", "objects"),
    ("/over-time", "over time"),
    ("/compare", "two runs"),
    ("/find", "in a box"),
    ("/questions", "questions"),
)
_FORMS = {".json": ("json", "application/json"), ".csv": ("csv", "text/csv")}
AROUND = {"nav": _NAV, "policy": policy("'self'")}


@dataclass(frozen=True)
class Page:
    """An answer: its text and its media type."""

    text: str
    media: str = "text/html"


@dataclass(frozen=True)
class Field:
    """A field of a form: its name, what stands in it, and what may be chosen (anything where empty)."""

    name: str
    value: str
    choices: Sequence[str] = ()


@dataclass(frozen=True)
class Listing:
    """A page of one table: what is asked in words, the form that asks again, the rows, and where rows link to; plots
    above them, and where the page that follows is."""

    title: str
    table: Table
    fields: Sequence[Field] = ()
    links: Sequence[str] | None = None
    words: str = ""
    plots: Sequence[Markup] = ()
    older: str = ""


def answer(store: Store, connection: Connection, path: str, asked: Mapping[str, str]) -> Page | None:
    """What an address shows, None where there is nothing at it.  Raises UsageError for what cannot be asked."""
    name, suffix = path, ""
    for ending in _FORMS:
        if path.endswith(ending):
            name, suffix = path.removesuffix(ending), ending
    listing = _listing(store, connection, "/runs" if name == "/" else name, asked, whole=bool(suffix))
    if listing is not None:
        return _as_file(listing.table, suffix) if suffix else _as_page(listing, "/runs" if name == "/" else name, asked)
    table = ("table",) if suffix else ()
    if name.startswith("/run/") and name[5:].isdecimal():
        _takes(asked, *table)
        run = int(name[5:])
        if suffix:
            return _as_files(run_tables(store, connection, run), suffix, asked)
        return Page(run_page(store, connection, run, AROUND | {"files": _files(name, asked)}))
    if name.startswith("/object/"):
        _takes(asked, "variant", *table)
        named = name[8:], asked.get("variant", "")
        if suffix:
            return _as_files(object_tables(store, connection, *named), suffix, asked)
        return Page(object_page(store, connection, *named, AROUND | {"files": _files(name, asked)}))
    return None


def _listing(store: Store, connection: Connection, name: str, asked: Mapping[str, str], whole: bool) -> Listing | None:
    """The page of one table at an address, None where there is none; whole: with all rows."""
    if name == "/runs":
        return _runs(store, connection, asked, whole)
    if name == "/compare":
        return _compare(store, asked)
    if name == "/over-time":
        _takes(asked)
        table = _table(connection, "Over time", "serve/over_time")
        return Listing(
            "Over time", table, links=[_history_of(dict(zip(table.columns, r, strict=True))) for r in table.rows]
        )
    if name == "/size":
        return _size(connection, asked)
    if name == "/camera":
        return _camera(connection, asked)
    if name == "/objects":
        _takes(asked)
        table = _table(connection, "Objects", "object/newest")
        named, variant = (list(table.columns).index(c) for c in ("name", "variant"))
        links = [f"/object/{quote(r[named], safe='')}?{urlencode({'variant': r[variant]})}" for r in table.rows]
        return Listing("Objects", table, links=links)
    if name == "/find":
        return _find(store, connection, asked)
    if name == "/questions":
        _takes(asked)
        rows = [(q, first_line(sql.query(f"examples/{q}").text)) for q in question_names()]
        links = [f"/question/{q}" for q, _ in rows]
        return Listing("Questions", Table("Questions", ("name", "question"), rows), links=links)
    if name.startswith("/question/"):
        return _question(connection, name.removeprefix("/question/"), asked)
    return None


def _runs(store: Store, connection: Connection, asked: Mapping[str, str], whole: bool) -> Listing:
    """Runs, the newest first; of a page as many as it shows, looked for in pieces from the newest on."""
    names = ("kind", "state", "verdict", "part", "text")
    _takes(asked, *names, "before")
    given = {n: asked.get(n) or None for n in names}
    high = int(store.rows(connection, "run/newest")[0].run)
    if asked.get("before"):
        high = min(high, int(finite("before", asked["before"])) - 1)
    size = high if whole else ROWS_SHOWN
    table = _table(connection, "Runs", "run/runs", **given, low=max(high - size + 1, 0), high=high)
    rows, high = list(table.rows), high - size
    while high > 0 and len(rows) < ROWS_SHOWN and not whole:
        size *= 4
        more = _table(connection, "Runs", "run/runs", **given, low=max(high - size + 1, 0), high=high)
        rows, high = [*rows, *more.rows], high - size
    kept = rows if whole else rows[:ROWS_SHOWN]
    older = ""
    if high > 0 or len(kept) < len(rows):
        last = kept[-1][0] if len(kept) < len(rows) else high + 1
        older = f"/?{urlencode({**{n: v for n, v in given.items() if v}, 'before': last})}"
    table = replace(table, rows=kept)
    choices = {
        "kind": ("load", "world", "index", "diff", "extract", "inspect", "set", "decide"),
        "state": ("running", "finished", "failed", "killed"),
        "verdict": ("accepted", "ambiguous", "refused"),
        "part": ("as modelled", "deviates", "another variant", "not enough seen"),
    }
    fields = [Field(n, asked.get(n, ""), ("", *choices[n]) if n in choices else ()) for n in given]
    return Listing("Runs", table, fields, [f"/run/{r[0]}" for r in table.rows], older=older)


def _compare(store: Store, asked: Mapping[str, str]) -> Listing:
    """Two runs: what came out of each, then what differs, from what they were given to the step at which they part."""
    _takes(asked, "a", "b")
    fields = [Field(name, asked.get(name, "")) for name in ("a", "b")]
    if not (asked.get("a") and asked.get("b")):
        empty = Table("Two runs", (), [], empty="Give the numbers of two runs.")
        return Listing("Two runs", empty, fields, words="What differs between two runs, and where they part.")
    runs = [int(finite(name, asked[name])) for name in ("a", "b")]
    names = ("what", "name", f"run {runs[0]}", f"run {runs[1]}", "difference", "sigma")
    table = Table("Two runs", names, compare_runs(store, *runs), empty="Nothing differs.")
    return Listing(f"Run {runs[0]} and run {runs[1]}", table, fields)


def _history_of(row: Mapping[str, Any]) -> str:
    """Where what a row of `serve/over_time` names is plotted."""
    if row["rig"] is None:
        return f"/size?{urlencode({'path': row['name'], 'what': row['what']})}"
    return f"/camera?{urlencode({'rig': row['rig'], 'name': row['camera']})}"


def _size(connection: Connection, asked: Mapping[str, str]) -> Listing:
    _takes(asked, "path", "what")
    path, what = asked.get("path", ""), asked.get("what", "diameter")
    table = _table(connection, f"{what} of {path}", "serve/size_over_time", path=path, what=what)
    rows = [dict(zip(table.columns, r, strict=True)) for r in table.rows]
    fields = [Field("path", path), Field("what", what, ("diameter", "thickness", "width", "shift"))]
    plots = (
        [history([Point(f"/run/{r['run']}", *_point(r), r["changed"]) for r in rows], rows[0]["unit"])] if rows else []
    )
    return Listing(table.title, table, fields, [f"/run/{r[0]}" for r in table.rows], plots=plots)


def _camera(connection: Connection, asked: Mapping[str, str]) -> Listing:
    _takes(asked, "rig", "name")
    rig, name = int(finite("rig", asked.get("rig", ""))), asked.get("name", "")
    table = _table(
        connection, f"Residual of camera {name} of rig {rig}", "serve/camera_over_time", rig=rig, camera=name
    )
    rows = [dict(zip(table.columns, r, strict=True)) for r in table.rows]
    plots = [history([Point(f"/run/{r['run']}", *_point(r)) for r in rows], "px")] if rows else []
    fields = [Field("rig", str(rig)), Field("name", name)]
    return Listing(table.title, table, fields, [f"/run/{r[0]}" for r in table.rows], plots=plots)


def _point(row: Mapping[str, Any]) -> tuple[str, float, float | None, float | None, float | None]:
    """Label, value, sigma, nominal and limit of a point over time."""
    label = f"run {row['run']}, {cell(row['began_at'])}" + (f", {row['serial']}" if row["serial"] else "")
    return label, row["value"], row.get("sigma"), row.get("nominal"), row.get("least_difference")


def _find(store: Store, connection: Connection, asked: Mapping[str, str]) -> Listing:
    _takes(asked, *BOUNDS, "level", "world")
    worlds = [str(row.name) for row in store.rows(connection, "world/current")]
    level, world = asked.get("level", "part"), asked.get("world") or next(iter(worlds), "")
    if level not in LEVELS:
        raise UsageError(f"there is no level {level!r}: use one of {', '.join(LEVELS)}")
    fields = [Field(n, asked.get(n, "")) for n in BOUNDS] + [
        Field("level", level, LEVELS),
        Field("world", world, worlds),
    ]
    rows: list[tuple[Any, ...]] = []
    words = "Give the least and the greatest corner of a box of the world, mm."
    if any(asked.get(n) for n in BOUNDS):
        box = Box(*(finite(n, asked.get(n, "")) for n in BOUNDS))
        rows = [(r.path, r.level, r.name, *r.box) for r in find_rows(store, box, level=level, world=world or None)]
        words = f"{len(rows)} {level}s of the world {world} lie in it by their boxes."
    return Listing("What lies in a box", Table("Found", ("path", "level", "name", *BOUNDS), rows), fields, words=words)


def _question(connection: Connection, name: str, asked: Mapping[str, str]) -> Listing:
    question = read_question(name)
    values = question.values(asked)
    found = connection.execute(question.query, values)
    columns, rows = list(found.keys()), found.all()
    table = Table(question.words, columns, rows, question.query.text, values, empty="No rows.")
    return Listing(question.words, table, [Field(n, str(v)) for n, v in values.items()])


def _table(connection: Connection, title: str, name: str, **parameters: Any) -> Table:
    found = connection.execute(sql.query(name), parameters)
    return Table(title, list(found.keys()), found.all(), sql.query(name).text, parameters, empty="There are none.")


def _as_files(tables: Mapping[str, Table], suffix: str, asked: Mapping[str, str]) -> Page:
    """The tables of a page that has several: the one asked for; else all, of which only JSON has a form."""
    names = ", ".join(tables)
    if "table" in asked:
        if asked["table"] not in tables:
            raise UsageError(f"there is no table {asked['table']!r} here: there are {names}")
        return _as_file(tables[asked["table"]], suffix)
    if suffix == ".csv":
        raise UsageError(f"a file of CSV holds one table: name it with ?table=, one of {names}")
    out = io.StringIO()
    print_tables({name: (t.columns, t.rows) for name, t in tables.items()}, out)
    return Page(out.getvalue(), _FORMS[suffix][1])


def _files(name: str, asked: Mapping[str, str]) -> dict[str, str]:
    """Where the tables of a page are: all as JSON; one as CSV, but for its name."""
    given = f"?{urlencode(asked)}" if asked else ""
    return {"all": f"{quote(name)}.json{given}", "one": f"{quote(name)}.csv?{urlencode({**asked, 'table': ''})}"}


def _as_file(table: Table, suffix: str) -> Page:
    form, media = _FORMS[suffix]
    out = io.StringIO()
    print_rows(table.columns, table.rows, form, out)
    return Page(out.getvalue(), media)


def _as_page(listing: Listing, name: str, asked: Mapping[str, str]) -> Page:
    question = f"?{urlencode(asked)}" if asked else ""
    more = {
        "title": listing.title,
        "listing": listing,
        "rows": listing.table.rows[:ROWS_SHOWN],
        "left_out": max(0, len(listing.table.rows) - ROWS_SHOWN),
        "older": listing.older,
        "files": [(f"{quote(name)}{suffix}{question}", form) for suffix, (form, _) in _FORMS.items()],
        "data": None,
    }
    return Page(render("listing.html", **AROUND, **more))


def _takes(asked: Mapping[str, str], *names: str) -> None:
    unknown = sorted(set(asked) - set(names))
    if unknown:
        raise UsageError(f"there is no parameter {unknown[0]!r} here: there are {', '.join(names) or 'none'}")
