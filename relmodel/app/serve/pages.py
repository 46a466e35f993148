"""What each address shows.  All that reaches the store are named queries with bound parameters."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any
from urllib.parse import quote, urlencode

from sqlalchemy import Connection

from relmodel.app.report.object import object_page, object_tables
from relmodel.app.report.page import ROWS_SHOWN, Table, policy, render
from relmodel.app.report.run import run_page, run_tables
from relmodel.app.serve.questions import finite, first_line, question_names, read_question
from relmodel.errors import UsageError
from relmodel.find.find import LEVELS, find_rows
from relmodel.find.volumes import Box
from relmodel.printing import print_rows, print_tables
from relmodel.store import Store, sql

BOUNDS = ("x0", "y0", "z0", "x1", "y1", "z1")
_NAV = (("/", "runs"), ("/objects", "objects"), ("/find", "in a box"), ("/questions", "questions"))
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
    """A page of one table: what is asked in words, the form that asks again, the rows, and where rows link to."""

    title: str
    table: Table
    fields: Sequence[Field] = ()
    links: Sequence[str] | None = None
    words: str = ""


def answer(store: Store, connection: Connection, path: str, asked: Mapping[str, str]) -> Page | None:
    """What an address shows, None where there is nothing at it.  Raises UsageError for what cannot be asked."""
    name, suffix = path, ""
    for ending in _FORMS:
        if path.endswith(ending):
            name, suffix = path.removesuffix(ending), ending
    listing = _listing(store, connection, "/runs" if name == "/" else name, asked)
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


def _listing(store: Store, connection: Connection, name: str, asked: Mapping[str, str]) -> Listing | None:
    if name == "/runs":
        return _runs(connection, asked)
    if name == "/objects":
        _takes(asked)
        table = _table(connection, "Objects", "object/newest")
        named, variant = (list(table.columns).index(c) for c in ("name", "variant"))
        links = [f"/object/{quote(r[named], safe='')}?{urlencode({'variant': r[variant]})}" for r in table.rows]
        return Listing("Objects", table, links=links)
    if name == "/find":
        return _find(store, asked)
    if name == "/questions":
        _takes(asked)
        rows = [(q, first_line(sql.query(f"examples/{q}").text)) for q in question_names()]
        links = [f"/question/{q}" for q, _ in rows]
        return Listing("Questions", Table("Questions", ("name", "question"), rows), links=links)
    if name.startswith("/question/"):
        return _question(connection, name.removeprefix("/question/"), asked)
    return None


def _runs(connection: Connection, asked: Mapping[str, str]) -> Listing:
    names = ("kind", "state", "verdict", "part", "text")
    _takes(asked, *names)
    given = {n: asked.get(n) or None for n in names}
    table = _table(connection, "Runs", "run/runs", **given)
    choices = {
        "kind": ("load", "world", "index", "diff", "extract", "inspect", "set", "decide"),
        "state": ("running", "finished", "failed", "killed"),
        "verdict": ("accepted", "ambiguous", "refused"),
        "part": ("as modelled", "deviates", "another variant", "not enough seen"),
    }
    fields = [Field(n, asked.get(n, ""), ("", *choices[n]) if n in choices else ()) for n in given]
    return Listing("Runs", table, fields, [f"/run/{r[0]}" for r in table.rows])


def _find(store: Store, asked: Mapping[str, str]) -> Listing:
    _takes(asked, *BOUNDS, "level", "world")
    level, world = asked.get("level", "part"), asked.get("world", "")
    if level not in LEVELS:
        raise UsageError(f"there is no level {level!r}: use one of {', '.join(LEVELS)}")
    fields = [Field(n, asked.get(n, "")) for n in BOUNDS] + [Field("level", level, LEVELS), Field("world", world)]
    rows: list[tuple[Any, ...]] = []
    words = "Give the least and the greatest corner of a box of the world, mm."
    if any(asked.get(n) for n in BOUNDS):
        box = Box(*(finite(n, asked.get(n, "")) for n in BOUNDS))
        rows = [(r.path, r.level, r.name, *r.box) for r in find_rows(store, box, level=level, world=world or None)]
        words = f"{len(rows)} {level}s lie in it by their boxes."
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
        "files": [(f"{quote(name)}{suffix}{question}", form) for suffix, (form, _) in _FORMS.items()],
        "data": None,
    }
    return Page(render("listing.html", **AROUND, **more))


def _takes(asked: Mapping[str, str], *names: str) -> None:
    unknown = sorted(set(asked) - set(names))
    if unknown:
        raise UsageError(f"there is no parameter {unknown[0]!r} here: there are {', '.join(names) or 'none'}")
