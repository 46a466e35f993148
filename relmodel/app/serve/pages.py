"""What each address of the local web page shows: named queries, example questions as forms, small pictures."""

from __future__ import annotations

import io
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from functools import cache, partial
from itertools import groupby, islice
from operator import itemgetter
from typing import Any
from urllib.parse import quote, urlencode

import numpy as np
from markupsafe import Markup
from PIL import Image
from sqlalchemy import Connection

from relmodel.app.audit import RUN_IN_SHORT, beginnings, compare_runs, run_in_short
from relmodel.app.report.object import object_page, object_tables, serial_page, serial_tables
from relmodel.app.report.page import ROWS_SHOWN, PageTable, cell, page_script, policy, read_table, render
from relmodel.app.report.run import run_page, run_tables
from relmodel.app.serve.questions import (
    Question,
    Row,
    Value,
    about,
    at_hand,
    finite,
    group_of,
    question_names,
    read_question,
)
from relmodel.app.tree import expand
from relmodel.drawing.draw import Point, as_webp, draw_model, history, read_seen
from relmodel.drawing.solid import MOST_PARTS, broadside, draw_solid, place_parts, scene
from relmodel.errors import InputError, UsageError
from relmodel.find.find import LEVELS, find_rows
from relmodel.find.volumes import Box
from relmodel.geometry.transforms import matrices
from relmodel.printing import print_rows, print_tables
from relmodel.store import Store, sql
from relmodel.store.ask import Answer

BOUNDS = ("x0", "y0", "z0", "x1", "y1", "z1")
_NAV = (
    ("/", "runs"),
    ("/parts", "parts"),
    ("/objects", "objects"),
    ("/over-time", "over time"),
    ("/rig", "rigs"),
    ("/compare", "two runs"),
    ("/find", "in a box"),
    ("/questions", "questions"),
)
_MOST_PLOTS = 60
_FORMS = {".json": ("json", "application/json"), ".csv": ("csv", "text/csv")}
AROUND: dict[str, Any] = {"nav": _NAV, "policy": policy(served=True), "script": page_script(served=True)}
Ask = Callable[[str], AbstractContextManager[Answer]]
MOST_ROWS = 100_000  # of a file that answers a statement


@dataclass(frozen=True)
class Page:
    """An answer: its text, or the bytes of a picture, and its media type."""

    content: str | bytes
    media: str = "text/html"


@dataclass(frozen=True)
class Field:
    """A field of a form: its name, value, choices (empty: any), a slider's ends, and whether it has lines."""

    name: str
    value: str
    choices: Sequence[str] = ()
    reach: tuple[float, float] | None = None
    long: bool = False


@dataclass(frozen=True)
class Shown:
    """What is at an address: its tables by name, with all their rows, the page that shows them, given what stands about
    it, and the names of the parameters that it takes."""

    tables: Callable[[], Mapping[str, PageTable]]
    page: Callable[[Mapping[str, Any]], str]
    takes: Sequence[str] = ()


def answer(store: Store, connection: Connection, path: str, asked: Mapping[str, str], ask: Ask) -> Page | None:
    """What an address shows, None where there is nothing at it; ask: puts a person's statement to the store.  Raises
    UsageError or InputError for what cannot be asked."""
    if path.startswith(("/picture/run/", "/picture/object/")):
        kind, _, number = path.removeprefix("/picture/").partition("/")
        made = run_thumbnail if kind == "run" else object_thumbnail
        drawn = made(store, connection, int(number)) if number.isdecimal() and len(number) < 19 else None
        return None if drawn is None else Page(drawn, "image/webp")
    if path == "/newest":
        return Page(_newest(store, connection), "text/plain")
    suffix = next((ending for ending in _FORMS if path.endswith(ending)), "")
    name = path.removesuffix(suffix)
    if name == "/questions":
        shown: Shown | None = _questions(connection, asked, ask, whole=bool(suffix))
    else:
        shown = _shown(store, connection, "/runs" if name == "/" else name, asked, whole=bool(suffix))
    if shown is None:
        return None
    takes = [*shown.takes, *(["table"] if suffix else [])]
    unknown = sorted(set(asked) - set(takes))
    if unknown:
        raise UsageError(f"there is no parameter {unknown[0]!r} here: there are {', '.join(takes) or 'none'}")
    if suffix:
        return _as_file(shown.tables(), suffix, asked.get("table"))
    given = f"?{urlencode(asked)}" if asked else ""
    files = {"all": f"{quote(name)}.json{given}", "csv": f"{quote(name)}.csv{given}"}
    files["one"] = f"{quote(name)}.csv?{urlencode({**asked, 'table': ''})}"  # but for the name of a table
    return Page(shown.page(AROUND | {"files": files}))


def _shown(store: Store, connection: Connection, name: str, asked: Mapping[str, str], whole: bool) -> Shown | None:
    """What is at an address; whole: with all rows and whole values, as files have them."""
    if name in lists():
        return _answered(connection, lists()[name], asked)
    if name.startswith("/question/"):
        return _answered(
            connection, about(read_question(name.removeprefix("/question/")), at_hand(connection, asked)), asked
        )
    if name == "/runs":
        return _runs(store, connection, asked, whole)
    if name == "/compare":
        return _compare(store, connection, asked)
    if name == "/find":
        return _find(store, connection, asked, whole)
    if name.startswith("/run/") and name[5:].isdecimal():
        run = int(name[5:])
        return Shown(partial(run_tables, store, connection, run), partial(run_page, store, connection, run))
    if name == "/part":
        serial = asked.get("serial", "")
        page = partial(serial_page, store, connection, serial)
        return Shown(partial(serial_tables, connection, serial), page, ("serial",))
    if name.startswith("/object/"):
        named = name.removeprefix("/object/"), asked.get("variant", "")
        tables = partial(object_tables, store, connection, *named)
        questions = Markup('<a href="/questions?{}">Questions about it</a>').format(
            urlencode({"object": named[0], "variant": named[1]})
        )
        return Shown(
            tables, lambda around: object_page(store, connection, *named, {**around, "words": questions}), ("variant",)
        )
    return None


def _list(title: str, table: PageTable, takes: Sequence[str] = (), **values: Any) -> Shown:
    """A page of one table, or of sections that show its rows; values: what else the template shows."""
    values = {"sections": [("", [replace(table, empty=table.empty or "There are none.")])]} | values

    def page(around: Mapping[str, Any]) -> str:
        return render(**{**around, "files": around["files"] | {"one": ""}}, title=title, **values)

    return Shown(lambda: {table.name: table}, page, takes)


def _runs(store: Store, connection: Connection, asked: Mapping[str, str], whole: bool) -> Shown:
    """Runs, the newest first, of a page as many as it shows: inspections, what failed, and all others."""
    names = ("kind", "state", "verdict", "part", "text")
    given = {n: asked.get(n) or None for n in names}
    newest = _newest(store, connection)
    high = int(newest.split()[0])
    if asked.get("before"):
        high = min(high, int(finite("before", asked["before"])) - 1)
    # Without a filter the newest are enough; what a filter finds may lie anywhere.
    low = 0 if whole or any(given.values()) else max(high - ROWS_SHOWN, 0)
    most = None if whole else ROWS_SHOWN + 1
    table = read_table(connection, "", "run/runs", most=most, **given, low=low, high=high)
    rows, older = table.rows[:ROWS_SHOWN], ""
    if len(rows) < len(table.rows) or low > 0:
        last = rows[-1].run if len(rows) < len(table.rows) else low
        older = f"/?{urlencode({**{n: v for n, v in given.items() if v}, 'before': last})}"
    failed = [r for r in rows if r.state in ("failed", "killed")]
    parts = {
        "Inspections": [r for r in rows if r.kind == "inspect" and r not in failed],
        "Failed": failed,
        "Other runs": [r for r in rows if r.kind != "inspect" and r not in failed],
    }
    choices = {
        "kind": ("load", "world", "index", "diff", "extract", "inspect", "set", "decide"),
        "state": ("running", "finished", "failed", "killed"),
        "verdict": ("accepted", "ambiguous", "refused"),
        "part": ("as modelled", "deviates", "another variant", "not enough seen"),
    }
    return _list(
        "Runs",
        table,
        (*names, "before"),
        fields=[Field(n, asked.get(n, ""), ("", *choices[n]) if n in choices else ()) for n in given],
        sections=[(heading, [_in_short(table, some)]) for heading, some in parts.items() if some],
        words="" if rows else "There are none.",
        older=older,
        newest="" if asked.get("before") else newest,
    )


def _in_short(table: PageTable, runs: Sequence[Any]) -> PageTable:
    """What a list shows of some runs of a table: their own pages have all."""
    pictures = [f"/picture/run/{r.run}" if r.verdict else "" for r in runs]
    return replace(
        table,
        columns=RUN_IN_SHORT,
        rows=[run_in_short(r) for r in runs],
        caption="",
        links=[f"/run/{r.run}" for r in runs],
        pictures=pictures if any(pictures) else (),
    )


def _newest(store: Store, connection: Connection) -> str:
    """The number of the newest run, and what is another number when a run ended."""
    return " ".join(str(n) for n in store.rows(connection, "serve/newest")[0])


# What differs between two runs that stands first; the rest is folded.
_CAME_OUT = ("run", "pose in the world", "presence")
_PARTED = "first step that differs"


def _compare(store: Store, connection: Connection, asked: Mapping[str, str]) -> Shown:
    """Two runs: what came out of each first, and at which step they part, then from what they were given on."""
    fields = [Field(name, asked.get(name, "")) for name in ("a", "b")]
    if not (asked.get("a") and asked.get("b")):
        words = "What differs between two runs, and where they part: give the numbers of two."
        return _list("Two runs", PageTable("", (), []), ("a", "b"), fields=fields, words=words, sections=())
    runs = [int(finite(name, asked[name])) for name in ("a", "b")]
    names = ("name", f"run {runs[0]}", f"run {runs[1]}", "difference", "sigma")
    found = compare_runs(store, *runs)
    parted = next((f"The {_PARTED}: {d.name}." for d in found if d.section == _PARTED), "What they did is the same.")
    table = PageTable("", ("what", *names), found, empty="Nothing differs.")
    sections: dict[str, PageTable] = {}
    for what, group in groupby(found, key=itemgetter(0)):
        rows = [(d.name, *beginnings(d.first, d.second), *d[4:]) for d in group if (what, d.name) != ("run", "outcome")]
        wide = 3 if all(row[3] is None for row in rows) else 5
        sections[what] = PageTable(what, names[:wide], [row[:wide] for row in rows])
    ended = [(run, row.words) for run in runs for row in store.rows(connection, "run/outcome", run=run)]
    outcome = PageTable("", ("run", "outcome"), ended, links=[f"/run/{run}" for run, _ in ended])
    came = [outcome, *(sections[name] for name in _CAME_OUT if name in sections)]
    rest = [replace(t, folded=True) for name, t in sections.items() if name not in (*_CAME_OUT, _PARTED)]
    shown = [("What came out", came), ("From what they were given on", rest)]
    return _list(
        f"Run {runs[0]} and run {runs[1]}",
        table,
        ("a", "b"),
        fields=fields,
        words=parted if found else table.empty,
        sections=shown,
    )


def _find(store: Store, connection: Connection, asked: Mapping[str, str], whole: bool) -> Shown:
    """What lies in a box of a world."""
    worlds = {str(row.name): int(row.world_id) for row in store.rows(connection, "world/current")}
    level, world = asked.get("level", "part"), asked.get("world") or next(iter(worlds), "")
    if level not in LEVELS:
        raise UsageError(f"there is no level {level!r}: use one of {', '.join(LEVELS)}")
    choices = [Field("level", level, LEVELS), Field("world", world, list(worlds))]
    rows: list[tuple[Any, ...]] = []
    words = "Give the least and the greatest corner of a box of the world, mm; a click on a part puts it about that."
    if any(asked.get(n) for n in BOUNDS):
        box = Box(*(finite(n, asked.get(n, "")) for n in BOUNDS))
        rows = find_rows(store, box, level=level, world=world or None)
        words = f"{len(rows)} {level}s of the world {world} lie in it by their boxes."
    drawn = None if whole else _world_scene(store, connection, worlds.get(world), {r[0] for r in rows})
    reach = [(m - drawn["radius"], m + drawn["radius"]) for m in drawn["focus"]] if drawn else [(0.0, 0.0)] * 3
    first = [f"{low + (high - low) * (1 + 2 * n) / 4:.0f}" for n in (0, 1) for low, high in reach]
    fields = [Field(n, asked.get(n, first[i]), reach=reach[i % 3]) for i, n in enumerate(BOUNDS)]
    table = PageTable("", ("path", "level", "name", *BOUNDS), rows)
    takes, legend = (*BOUNDS, "level", "world"), [("found", "pose")]
    return _list("What lies in a box", table, takes, fields=fields + choices, words=words, scene=drawn, legend=legend)


def _world_scene(store: Store, connection: Connection, world: int | None, found: set[str]) -> dict[str, Any] | None:
    """A world with what was found in it in another colour; None where it has no part."""
    rows = store.columns(connection, "report/scene_parts", world_id=world, run_id=None, most=MOST_PARTS)
    paths = [str(p) for p in rows["path"]]
    shapes, parts, _ = place_parts(store, connection, np.asarray(rows["shape_id"], np.int64), paths, matrices(rows))
    whole = scene(shapes, parts, back=broadside(shapes, parts))  # looked at as a whole, whatever was found
    for drawn in whole["parts"] if whole else ():
        drawn["colour"] = "pose" if drawn["path"] in found else "plain"
    return whole


def _as_file(tables: Mapping[str, PageTable], suffix: str, named: str | None) -> Page:
    """One table of a page as a file: the only one, or that which is named; all of them as JSON where none is."""
    form, media = _FORMS[suffix]
    names, out = ", ".join(tables), io.StringIO()
    if named is None and len(tables) == 1:
        named = next(iter(tables))
    if named is not None and named not in tables:
        raise UsageError(f"there is no table {named!r} here: there are {names}")
    if named is not None:
        print_rows(tables[named].columns, tables[named].rows, form, out)
    elif suffix == ".csv":
        raise UsageError(f"a file of CSV holds one table: name it with ?table=, one of {names}")
    else:
        print_tables({name: (t.columns, t.rows) for name, t in tables.items()}, out)
    return Page(out.getvalue(), media)


# Pages of named queries: lists, and the questions with a box for SQL.

_SIZES = ("", "diameter", "thickness", "length", "width", "count", "shift", "offset")


def _answered(connection: Connection, q: Question, asked: Mapping[str, str]) -> Shown:
    """The page of a question."""
    values = q.values(asked)
    found = connection.execute(q.query, values)
    table = PageTable("", list(found.keys()), found.all(), q.query.text, values)
    if table.rows:
        records = table.records
        links = list(map(q.link, records)) if q.link else ()
        table = replace(table, links=links, pictures=list(map(q.picture, records)) if q.picture else ())
    fields = [Field(n, str(v), q.choices.get(n, ())) for n, v in values.items()]
    statement = urlencode({"query": q.stated(values)})
    words = Markup('<a href="/questions?{}">Ask otherwise, in SQL</a>').format(statement) if q.written else ""
    return _list(q.said(values), table, tuple(values), fields=fields, words=words, plots=_plots_of(table))


def _plots_of(table: PageTable) -> list[Markup]:
    """The plots of an answer that has quantities over time, one each."""
    if "quantity" not in table.columns:
        return []
    groups = groupby(table.records, key=lambda r: (r["quantity"], r["unit"]))
    words = Markup('<figure class="drawn"><figcaption>{}</figcaption>{}</figure>')
    return [
        words.format(", ".join(filter(None, named)), history(list(map(_point, rows)), named[1]))
        for named, rows in islice(groups, _MOST_PLOTS)
    ]


def _point(row: Row) -> Point:
    """A value of a plot over time."""
    words = ", ".join(filter(None, [f"run {row['run']}", cell(row["began_at"]), row["serial"]]))
    about = str(row["began_at"])[:10], row.get("spread"), row.get("nominal"), row.get("lower"), row["upper"]
    mark = "bad" if row["changed"] else "open" if row.get("decision") == "not decidable" else "good"
    return Point(f"/run/{row['run']}", words, row["value"], *about, mark)


@cache
def lists() -> dict[str, Question]:
    """Pages of a table, by their addresses."""
    run = "/run/{run}".format_map
    of_sizes: dict[str, Value] = {"path": "", "what": "", "newest": 100}
    pages = (
        Question("over-time", "Sizes over time", sql.query("serve/over_time"), of_sizes, {"what": _SIZES}, run),
        Question("rig", "Rigs over time", sql.query("serve/rig_over_time"), {"rig": 0}, link=run),
        Question(
            *("parts", "Physical parts", sql.query("serve/parts")),
            link=lambda row: f"/part?{urlencode({'serial': row['serial']})}",
            picture=lambda row: "" if row["answered"] is None else f"/picture/run/{row['answered']}",
        ),
        Question(
            *("objects", "Objects", sql.query("serve/objects")),
            link=lambda row: f"/object/{quote(row['name'], safe='')}?{urlencode({'variant': row['variant']})}",
            picture="/picture/object/{object_id}".format_map,
        ),
    )
    return {f"/{page.name}": page for page in pages}


def _questions(connection: Connection, asked: Mapping[str, str], ask: Ask, whole: bool) -> Shown:
    """A box for SQL with its answer, and the questions about the object at hand."""
    objects, hand = connection.execute(sql.query("serve/objects")).all(), at_hand(connection, asked)
    questions = sorted((about(read_question(name), hand) for name in question_names()), key=group_of, reverse=True)
    rows, sections = [], list[tuple[str, list[PageTable]]]()
    for group, its in groupby(questions, key=group_of):
        own = [(q, q.said(q.defaults)) for q in its]
        rows += [(q.name, words, group) for q, words in own]
        links = [f"/question/{q.name}?{urlencode({n: v for n, v in q.defaults.items() if n in hand})}" for q, _ in own]
        sections.append((group, [PageTable("", ("question",), [(words,) for _, words in own], links=links)]))
    table = PageTable("", ("name", "question", "about"), rows)
    statement, told = asked.get("query", "").strip(), "One statement that only reads; relmodel schema says of what."
    if statement:
        try:
            with ask(statement) as (names, found):
                first = list(islice(found, MOST_ROWS + 1 if whole else ROWS_SHOWN))
            table = PageTable("", names, first, empty="No rows.")
            if len(first) > MOST_ROWS:
                raise InputError(f"the answer has more than {MOST_ROWS:,} rows: ask for less, or by relmodel sql")
            told = f"The first {ROWS_SHOWN} rows." if len(first) == ROWS_SHOWN else ""
            sections.insert(0, ("Answer", [table]))
        except InputError as error:
            if whole:
                raise
            told = str(error)
    names_of = {"object": {o.name for o in objects}, "variant": {o.variant for o in objects}}
    fields = [Field(n, str(hand.get(n, "")), sorted(choices)) for n, choices in names_of.items()]
    fields.append(Field("query", statement, long=True))
    return _list("Questions", table, ("object", "variant", "query"), fields=fields, words=told, sections=sections)


# Small pictures for lists: what a run saw with the model over it, and what an object looks like.

_WIDTH = 240  # px: twice what a list shows


def run_thumbnail(store: Store, connection: Connection, run: int) -> bytes | None:
    """The first picture of a run with the model over it, as WebP; None where it has none."""
    for it in read_seen(store, connection, run)[:1]:
        image = it.image or Image.new("L", (it.row.width, it.row.height), 40)  # the bytes were not kept
        image.thumbnail((_WIDTH, _WIDTH))
        scale = image.width / it.row.width
        small = [replace(e, points=(e.points + 0.5) * scale - 0.5) for e in it.edges]
        return as_webp(Image.fromarray(draw_model(np.asarray(image.convert("RGB")), small)))
    return None


def object_thumbnail(store: Store, connection: Connection, object_id: int) -> bytes | None:
    """An object as WebP; None where it has nothing to draw."""
    tree = expand(store, connection, object_id)
    at = np.flatnonzero(tree.shape_id >= 0)
    try:
        drawn = draw_solid(store, connection, tree.shape_id[at], tree.pose[at], 4 * _WIDTH, "iso")
    except UsageError:
        return None
    return as_webp(Image.fromarray(drawn), _WIDTH)
