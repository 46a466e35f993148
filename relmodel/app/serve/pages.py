"""What each address of the local web page shows: named queries, example questions as forms, small pictures."""

from __future__ import annotations

import io
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import groupby
from operator import itemgetter
from typing import Any
from urllib.parse import quote, urlencode

import numpy as np
from markupsafe import Markup
from PIL import Image
from sqlalchemy import Connection, TextClause, text

from relmodel.app.audit import beginnings, compare_runs
from relmodel.app.report.object import object_page, object_tables, serial_page, serial_tables
from relmodel.app.report.page import ROWS_SHOWN, PageTable, cell, page_script, policy, render
from relmodel.app.report.run import run_page, run_tables
from relmodel.app.tree import expand
from relmodel.drawing.draw import Point, as_webp, bars, draw_model, history, read_edges, read_image
from relmodel.drawing.solid import MOST_PARTS, broadside, draw_solid, place_parts, scene
from relmodel.errors import UsageError
from relmodel.find.find import LEVELS, find_rows
from relmodel.find.volumes import Box
from relmodel.geometry.transforms import matrices
from relmodel.printing import print_rows, print_tables, rounded
from relmodel.store import Store, sql

BOUNDS = ("x0", "y0", "z0", "x1", "y1", "z1")
_NAV = (
    ("/", "runs"),
    ("/parts", "parts"),
    ("/objects", "objects"),
    ("/over-time", "over time"),
    ("/compare", "two runs"),
    ("/find", "in a box"),
    ("/questions", "questions"),
)
_MOST_BARS = 40
_FORMS = {".json": ("json", "application/json"), ".csv": ("csv", "text/csv")}
AROUND = {"nav": _NAV, "policy": policy(served=True), "script": page_script(served=True)}


@dataclass(frozen=True)
class Page:
    """An answer: its text, or the bytes of a picture, and its media type."""

    content: str | bytes
    media: str = "text/html"


@dataclass(frozen=True)
class Field:
    """A field of a form: its name, its value, the choices (empty: any), and of a slider from where to where it goes."""

    name: str
    value: str
    choices: Sequence[str] = ()
    reach: tuple[float, float] | None = None


@dataclass(frozen=True)
class Listing:
    """A page of one table: what is asked in words, the form that asks again, the rows, where rows link to and their
    pictures are; plots above them, and where the page that follows is; groups in place of the table, each a heading and
    links with their words; data: what the page's script is given; newest: what changes when there are new rows."""

    title: str
    table: PageTable
    fields: Sequence[Field] = ()
    links: Sequence[str] | None = None
    words: str = ""
    plots: Sequence[Markup] = ()
    older: str = ""
    pictures: Sequence[str] | None = None
    groups: Mapping[str, Sequence[tuple[str, str]]] | None = None
    data: dict[str, Any] | None = None
    newest: str = ""


def answer(store: Store, connection: Connection, path: str, asked: Mapping[str, str]) -> Page | None:
    """What an address shows, None where there is nothing at it.  Raises UsageError for what cannot be asked."""
    if path.startswith(("/picture/run/", "/picture/object/")):
        kind, _, number = path.removeprefix("/picture/").partition("/")
        made = run_thumbnail if kind == "run" else object_thumbnail
        drawn = made(store, connection, int(number)) if number.isdecimal() and len(number) < 19 else None
        return None if drawn is None else Page(drawn, "image/webp")
    if path == "/newest":
        return Page(_newest(store, connection), "text/plain")
    name, suffix = path, ""
    for ending in _FORMS:
        if path.endswith(ending):
            name, suffix = path.removesuffix(ending), ending
    listing = _listing(store, connection, "/runs" if name == "/" else name, asked, whole=bool(suffix))
    if listing is not None:
        return _as_file(listing.table, suffix) if suffix else _as_page(listing, "/runs" if name == "/" else name, asked)
    around = AROUND | {"files": _files(name, asked)}
    takes: tuple[str, ...] = ()
    if name.startswith("/run/") and name[5:].isdecimal():
        tables = partial(run_tables, store, connection, int(name[5:]))
        page = partial(run_page, store, connection, int(name[5:]), around)
    elif name == "/part":
        takes, serial = ("serial",), asked.get("serial", "")
        tables = partial(serial_tables, connection, serial)
        page = partial(serial_page, store, connection, serial, around)
    elif name.startswith("/object/"):
        takes, named = ("variant",), (name[8:], asked.get("variant", ""))
        tables = partial(object_tables, store, connection, *named)
        page = partial(object_page, store, connection, *named, around)
    else:
        return None
    _takes(asked, *takes, *(("table",) if suffix else ()))
    return _as_files(tables(), suffix, asked) if suffix else Page(page())


def _listing(store: Store, connection: Connection, name: str, asked: Mapping[str, str], whole: bool) -> Listing | None:
    """The page of one table at an address, None where there is none; whole: with all rows."""
    if name == "/runs":
        return _runs(store, connection, asked, whole)
    if name == "/compare":
        return _compare(store, asked, whole)
    if name == "/over-time":
        _takes(asked)
        table = _table(connection, "Over time", "serve/over_time")
        return Listing("Over time", table, links=[_history_of(row) for row in table.records])
    if name == "/size":
        return _size(connection, asked)
    if name == "/camera":
        return _camera(connection, asked)
    if name == "/parts":
        _takes(asked)
        table = _table(connection, "Physical parts", "serve/parts")
        links = [f"/part?{urlencode({'serial': r[0]})}" for r in table.rows]
        pictures = _pictures_of(store, connection, [int(r[-1]) for r in table.rows])
        return Listing("Physical parts", table, links=links, pictures=pictures)
    if name == "/objects":
        _takes(asked)
        table = _table(connection, "Objects", "serve/objects")
        pictures = [f"/picture/object/{r[0]}" for r in table.rows]
        table = replace(table, columns=table.columns[1:], rows=[r[1:] for r in table.rows])
        links = [f"/object/{quote(r[0], safe='')}?{urlencode({'variant': r[1]})}" for r in table.rows]
        return Listing("Objects", table, links=links, pictures=pictures)
    if name == "/rig":
        return _rig(connection, asked)
    if name == "/find":
        return _find(store, connection, asked)
    if name == "/questions":
        _takes(asked)
        groups = question_groups()
        rows = [(q, words, who) for who, its in groups.items() for q, words in its]
        table = PageTable("Questions", ("name", "question", "asked_by"), rows)
        shown = {who: [(f"/question/{q}", words) for q, words in its] for who, its in groups.items()}
        return Listing("Questions", table, groups=shown)
    if name.startswith("/question/"):
        return _question(connection, name.removeprefix("/question/"), asked)
    return None


# Of runs on a page, what is decisive first.
_RUN_COLUMNS = (
    *("run", "kind", "part_verdict", "pose_verdict", "findings", "serial", "began_at", "state", "checked"),
    *("changed", "contradicted", "not_confirmed", "undecidable", "message", "variant", "seconds"),
)


def _runs(store: Store, connection: Connection, asked: Mapping[str, str], whole: bool) -> Listing:
    """Runs, the newest first; of a page as many as it shows."""
    names = ("kind", "state", "verdict", "part", "text")
    _takes(asked, *names, "before")
    given = {n: asked.get(n) or None for n in names}
    high = int(store.rows(connection, "run/newest")[0].run)
    if asked.get("before"):
        high = min(high, int(finite("before", asked["before"])) - 1)
    # Without a filter the newest are enough; what a filter finds may lie anywhere.
    low = 0 if whole or any(given.values()) else max(high - ROWS_SHOWN, 0)
    table = _table(connection, "Runs", "run/runs", most=None if whole else ROWS_SHOWN + 1, **given, low=low, high=high)
    found, older = len(table.rows), ""
    table = table if whole else replace(table, rows=table.rows[:ROWS_SHOWN])
    runs = [int(r[0]) for r in table.rows]
    if len(runs) < found or low > 0:
        last = runs[-1] if len(runs) < found else low
        older = f"/?{urlencode({**{n: v for n, v in given.items() if v}, 'before': last})}"
    if not whole:
        short = map(_in_short, table.records)
        table = replace(table, columns=_RUN_COLUMNS, rows=[[row[c] for c in _RUN_COLUMNS] for row in short])
    choices = {
        "kind": ("load", "world", "index", "diff", "extract", "inspect", "set", "decide"),
        "state": ("running", "finished", "failed", "killed"),
        "verdict": ("accepted", "ambiguous", "refused"),
        "part": ("as modelled", "deviates", "another variant", "not enough seen"),
    }
    fields = [Field(n, asked.get(n, ""), ("", *choices[n]) if n in choices else ()) for n in given]
    return Listing(
        "Runs",
        table,
        fields,
        [f"/run/{run}" for run in runs],
        older=older,
        pictures=_pictures_of(store, connection, runs),
        newest="" if asked.get("before") else _newest(store, connection),
    )


def _in_short(run: dict[str, Any]) -> dict[str, Any]:
    """What a list of runs shows of a run, by column: its own page has all of it."""
    began, seconds = run["began_at"], run["seconds"]
    return run | {
        "began_at": began and Markup("<time>{}</time>").format(began.isoformat(" ", "minutes")[:16]),
        "checked": f"{run['checked']} of {run['in_view']}" if run["in_view"] else None,
        "message": run["message"] and run["message"].partition(";")[0],
        "seconds": None if seconds is None else rounded(seconds, 1),
    }


def _pictures_of(store: Store, connection: Connection, runs: Sequence[int]) -> list[str]:
    """Where the pictures of runs are; empty of a run that kept none."""
    bounds = {"low": min(runs, default=0), "high": max(runs, default=0)}
    pictured = {int(r.run) for r in store.rows(connection, "serve/pictured_runs", **bounds)}
    return [f"/picture/run/{run}" if run in pictured else "" for run in runs]


def _newest(store: Store, connection: Connection) -> str:
    """What is another text when a run began or ended."""
    return " ".join(str(n) for n in store.rows(connection, "serve/newest")[0])


def _compare(store: Store, asked: Mapping[str, str], whole: bool) -> Listing:
    """Two runs: what came out of each, then what differs, from what they were given to the step at which they part.
    whole: long values are not shortened."""
    _takes(asked, "a", "b")
    fields = [Field(name, asked.get(name, "")) for name in ("a", "b")]
    if not (asked.get("a") and asked.get("b")):
        empty = PageTable("Two runs", (), [], empty="Give the numbers of two runs.")
        return Listing("Two runs", empty, fields, words="What differs between two runs, and where they part.")
    runs = [int(finite(name, asked[name])) for name in ("a", "b")]
    names: Sequence[str] = ("what", "name", f"run {runs[0]}", f"run {runs[1]}", "difference", "sigma")
    rows: list[tuple[Any, ...]] = list(compare_runs(store, *runs))
    if not whole:
        names = names[1:]
        rows = [(f"{r[0]}: {r[1]}", *beginnings(r[2], r[3]), *r[4:]) for r in rows]
    table = PageTable("Two runs", names, rows, empty="Nothing differs.")
    return Listing(f"Run {runs[0]} and run {runs[1]}", table, fields)


def _history_of(row: Mapping[str, Any]) -> str:
    """Where what a row of `serve/over_time` names is plotted."""
    if row["rig"] is None:
        return f"/size?{urlencode({'path': row['name'], 'what': row['what']})}"
    if row["camera"] is None:
        return f"/rig?{urlencode({'rig': row['rig']})}"
    return f"/camera?{urlencode({'rig': row['rig'], 'name': row['camera']})}"


def _size(connection: Connection, asked: Mapping[str, str]) -> Listing:
    _takes(asked, "path", "what")
    path, what = asked.get("path", ""), asked.get("what", "diameter")
    table = _table(connection, f"{what} of {path}", "serve/size_over_time", path=path, what=what)
    fields = [Field("path", path), Field("what", what, ("diameter", "thickness", "width", "shift"))]
    return _over_time(table, fields, [_plot(rows, rows[0]["unit"]) for rows in [table.records] if rows])


def _camera(connection: Connection, asked: Mapping[str, str]) -> Listing:
    _takes(asked, "rig", "name")
    rig, name = int(finite("rig", asked.get("rig", ""))), asked.get("name", "")
    title = f"Residual of camera {name} of rig {rig}"
    table = _table(connection, title, "serve/camera_over_time", rig=rig, camera=name)
    plots = [_plot(table.records, "px")] if table.rows else []
    return _over_time(table, [Field("rig", str(rig)), Field("name", name)], plots)


def _rig(connection: Connection, asked: Mapping[str, str]) -> Listing:
    """A rig as a whole: what each of its accepted runs came to, a plot a quantity."""
    _takes(asked, "rig")
    rig = int(finite("rig", asked.get("rig", "")))
    table = _table(connection, f"Rig {rig} over time", "serve/rig_over_time", rig=rig)
    plots = []
    for quantity, group in groupby(table.records, key=itemgetter("quantity")):
        own = [
            r | {"least_difference": r["gate"], "changed": bool(r["gate"]) and r["value"] > r["gate"]} for r in group
        ]
        words = Markup('<figure class="drawn"><figcaption>{}</figcaption>{}</figure>')
        plots.append(words.format(f"{quantity}, {own[0]['unit']}".rstrip(", "), _plot(own, own[0]["unit"])))
    return _over_time(table, [Field("rig", str(rig))], plots)


def _over_time(table: PageTable, fields: Sequence[Field], plots: Sequence[Markup]) -> Listing:
    """Rows of which each is of a run."""
    return Listing(table.title, table, fields, [f"/run/{r['run']}" for r in table.records], plots=plots)


def _plot(rows: Sequence[Mapping[str, Any]], unit: str) -> Markup:
    """Values over time."""
    points = []
    for r in rows:
        words = f"run {r['run']}, {cell(r['began_at'])}" + (f", {r['serial']}" if r["serial"] else "")
        about = r.get("sigma"), r.get("nominal"), r.get("least_difference")
        points.append(Point(f"/run/{r['run']}", words, r["value"], *about, bad=bool(r.get("changed"))))
    return history(points, unit)


def _find(store: Store, connection: Connection, asked: Mapping[str, str]) -> Listing:
    _takes(asked, *BOUNDS, "level", "world")
    worlds = [str(row.name) for row in store.rows(connection, "world/current")]
    level, world = asked.get("level", "part"), asked.get("world") or next(iter(worlds), "")
    if level not in LEVELS:
        raise UsageError(f"there is no level {level!r}: use one of {', '.join(LEVELS)}")
    choices = [Field("level", level, LEVELS), Field("world", world, worlds)]
    rows: list[tuple[Any, ...]] = []
    words = "Give the least and the greatest corner of a box of the world, mm; a click on a part puts it about that."
    if any(asked.get(n) for n in BOUNDS):
        box = Box(*(finite(n, asked.get(n, "")) for n in BOUNDS))
        rows = find_rows(store, box, level=level, world=world or None)
        words = f"{len(rows)} {level}s of the world {world} lie in it by their boxes."
    drawn = _world_scene(store, connection, world, {r[0] for r in rows})
    reach = [(m - drawn["radius"], m + drawn["radius"]) for m in drawn["focus"]] if drawn else [(0.0, 0.0)] * 3
    first = [f"{low + (high - low) * (1 + 2 * n) / 4:.0f}" for n in (0, 1) for low, high in reach]
    fields = [Field(n, asked.get(n, first[i]), reach=reach[i % 3]) for i, n in enumerate(BOUNDS)]
    table = PageTable("Found", ("path", "level", "name", *BOUNDS), rows)
    return Listing("What lies in a box", table, fields + choices, words=words, data={"items": [], "scene": drawn})


def _world_scene(store: Store, connection: Connection, world: str, found: set[str]) -> dict[str, Any] | None:
    """A world with what was found in it in another colour; None where it has no part."""
    rows = store.columns(connection, "serve/world_parts", world=world, most=MOST_PARTS)
    paths = [str(p) for p in rows["path"]]
    colours = ["pose" if path in found else "plain" for path in paths]
    shapes, parts, _ = place_parts(
        store, connection, np.asarray(rows["shape_id"], np.int64), paths, matrices(rows), colours
    )
    # Looked at as a whole, whatever was found.
    whole = scene(shapes, [p | {"colour": "plain"} for p in parts], back=broadside(shapes, parts))
    for drawn, part in zip(whole["parts"] if whole else (), parts, strict=False):
        drawn["colour"] = part["colour"]
    return whole


def _question(connection: Connection, name: str, asked: Mapping[str, str]) -> Listing:
    question = read_question(name)
    values = question.values(asked)
    found = connection.execute(question.query, values)
    table = PageTable(question.words, list(found.keys()), found.all(), question.query.text, values, empty="No rows.")
    fields = [Field(n, str(v)) for n, v in values.items()]
    return Listing(question.words, table, fields, plots=_plots_of(name, table))


def _plots_of(question: str, table: PageTable) -> list[Markup]:
    """The plot of a question's answer, where it has one."""
    shown = table.records[:_MOST_BARS]
    if question not in PLOTS or not shown:
        return []
    label, value = PLOTS[question]
    if label == "run_id":
        points = [
            Point(f"/run/{r[label]}", f"run {r[label]}", r[value], r.get("sigma"), r.get("nominal")) for r in shown
        ]
        return [history(points, value)]
    return [bars([cell(r[label]) for r in shown], [float(r[value]) for r in shown], value)]


def _table(connection: Connection, title: str, name: str, *, most: int | None = None, **parameters: Any) -> PageTable:
    found = connection.execute(sql.query(name), parameters)
    rows = found.all() if most is None else found.fetchmany(most)
    return PageTable(title, list(found.keys()), rows, sql.query(name).text, parameters, empty="There are none.")


def _as_files(tables: Mapping[str, PageTable], suffix: str, asked: Mapping[str, str]) -> Page:
    """One table of a page as a file, where `?table=` names it; all of them as JSON where it does not."""
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


def _as_file(table: PageTable, suffix: str) -> Page:
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
        "data": listing.data,
        "scene": listing.data and listing.data["scene"],
    }
    return Page(render("listing.html", **AROUND, **more))


def _takes(asked: Mapping[str, str], *names: str) -> None:
    unknown = sorted(set(asked) - set(names))
    if unknown:
        raise UsageError(f"there is no parameter {unknown[0]!r} here: there are {', '.join(names) or 'none'}")


# The example questions as forms: a literal of theirs that a comment names is a parameter, the literal its default.
#
#     WHERE value > 40 /* depth */
#
# stays SQL that any client runs; here it asks for `depth`.

_FOLDER = "examples"
# Who asks what; a file that no group names is one of your own.
_GROUPS = {
    "Who designs the part": (
        "deep_pockets dimensions_that_changed faces_that_are_swept faces_with_openings "
        "features_that_b_lacks hole_sizes long_sharp_edges mass_of_a_part mass_of_a_variant "
        "neighbours_of_a_face parts_of_a_material parts_that_moved sharp_pocket_corners thin_ribs tolerances_of_faces"
    ),
    "Who inspects": (
        "contradicted_features diameter_over_time long_edges_not_found parts_in_view rules_of_a_verdict "
        "states_by_variant thresholds_of_findings variants_seen visible_in_the_left_camera where_was_the_rig"
    ),
    "Who keeps the cell": (
        "cameras_over_time cameras_solved_apart how_far_off_was_the_base "
        "inputs_that_differ loads parts_by_use runs_that_failed where_the_time_goes"
    ),
    "Who looks into a decision": (
        "arcs_that_fit_worst code_of_a_pose gates_of_arcs matched_arcs poses_that_were_dropped rejected_arcs"
    ),
}
_OWN = "Questions of your own"
# What a plot says more of than a table: the columns of its names and of its values.
PLOTS = {
    "diameter_over_time": ("run_id", "diameter"),
    "hole_sizes": ("diameter", "holes"),
    "mass_of_a_variant": ("variant", "mass_kg"),
    "parts_by_use": ("number", "placed"),
    "thin_ribs": ("rib", "thickness"),
    "where_the_time_goes": ("step", "seconds"),
}
_NAMED = re.compile(r"('(?:[^']|'')*'|(?<![\w.])-?\d+(?:\.\d+)?) /\* (\w+) \*/")
Value = str | int | float


@dataclass(frozen=True)
class Question:
    """A question: its name, what it asks, its SQL with parameters bound, and their defaults."""

    name: str
    words: str
    query: TextClause
    defaults: Mapping[str, Value]

    def values(self, given: Mapping[str, str]) -> dict[str, Value]:
        """The parameters, as given where they are.  Raises UsageError for an unknown name, or a number that is none."""
        unknown = sorted(set(given) - set(self.defaults))
        if unknown:
            raise UsageError(
                f"the question {self.name} takes no {unknown[0]}: it takes {', '.join(self.defaults) or 'nothing'}"
            )
        values = dict(self.defaults)
        for name, said in given.items():
            values[name] = said if isinstance(self.defaults[name], str) else finite(name, said)
            if isinstance(self.defaults[name], int) and values[name] == int(values[name]):
                values[name] = int(values[name])  # other whole numbers, or what is none
        return values


def question_names() -> list[str]:
    return [name.partition("/")[2] for name in sql.query_names(_FOLDER)]


def question_groups() -> dict[str, list[tuple[str, str]]]:
    """The questions by who asks, each its name and what it asks in words."""
    names = question_names()
    groups = {who: [n for n in named.split() if n in names] for who, named in _GROUPS.items()}
    groups[_OWN] = [n for n in names if not any(n in its for its in groups.values())]
    return {who: [(n, first_line(sql.query(f"{_FOLDER}/{n}").text)) for n in its] for who, its in groups.items() if its}


def read_question(name: str) -> Question:
    """The question of a name.  Raises UsageError where there is none."""
    if name not in question_names():
        raise UsageError(f"there is no question {name!r}")
    written = sql.query(f"{_FOLDER}/{name}").text
    defaults: dict[str, Value] = {}
    for literal, parameter in _NAMED.findall(written):
        value = _value(literal)
        if defaults.setdefault(parameter, value) != value:
            raise ValueError(f"queries/{_FOLDER}/{name}.sql gives {parameter} two values")
    bound = _NAMED.sub(lambda hit: f":{hit[2]}", written)
    return Question(name, first_line(written), text(bound), defaults)


def first_line(written: str) -> str:
    """The question that a file begins with, in words."""
    return written.partition("\n")[0].removeprefix("--").strip()


def _value(literal: str) -> Value:
    if literal.startswith("'"):
        return literal[1:-1].replace("''", "'")
    return float(literal) if "." in literal else int(literal)


def finite(name: str, said: str) -> float:
    """The number that a text spells.  Raises UsageError where it is not finite."""
    try:
        number = float(said)
    except ValueError:
        number = float("nan")
    if not abs(number) < 1e300:
        raise UsageError(f"{name} is {said!r}: give a number")
    return number


# Small pictures for lists: what a run saw with the model over it, and what an object looks like.

_WIDTH = 240  # px: twice what a list shows


def run_thumbnail(store: Store, connection: Connection, run: int) -> bytes | None:
    """The first picture of a run with the model over it, as WebP; None where none was kept."""
    for row in store.rows(connection, "report/pictures", run_id=run):
        image = None if row.bytes is None else read_image(row.bytes)
        if image is not None:
            image.thumbnail((_WIDTH, _WIDTH))
            scale = image.width / row.width
            edges = read_edges(store, connection, run).get(row.camera, [])
            small = [replace(e, points=(e.points + 0.5) * scale - 0.5) for e in edges]
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
