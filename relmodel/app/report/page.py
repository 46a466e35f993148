"""Pages: templates filled in, with everything that a browser needs inside and nothing that it may fetch.

Names come from files that others made: templates escape all text, JSON lies in an element that is not run, and the
page's policy admits only the script whose hash it states, so that no name can inject another."""

from __future__ import annotations

import base64
import hashlib
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from decimal import Decimal
from functools import cache
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup, escape
from sqlalchemy import Connection

import relmodel
from relmodel.drawing.draw import BLEND, STATES, UNEXPLAINED, hexadecimal
from relmodel.errors import InputError
from relmodel.names import check_writable, visible
from relmodel.printing import json_text
from relmodel.store import sql

ROWS_SHOWN = 300  # of a table; the SQL below it gives the rest
_FOLDER = Path(__file__).parent / "templates"


@dataclass(frozen=True)
class PageTable:
    """A table of a page: the result of a named query, and the query.

    name: what files of the page's tables know it by.  Of a long one the first rows are shown: the query gives all.
    upright: the one row stands as a column.  folded: shown when its title is clicked.  empty: what is said where there
    are no rows; without it the table is left out then.  marks: of each row the ids of what it stands for in the
    pictures, which the page's script lights.  links, pictures: where each row leads, and where its picture is."""

    title: str
    columns: Sequence[str]
    rows: Sequence[Any]
    query: str = ""
    parameters: Mapping[str, Any] = field(default_factory=dict)
    caption: str = ""
    name: str = ""
    upright: bool = False
    folded: bool = False
    empty: str = ""
    marks: Sequence[str] = ()
    links: Sequence[str] = ()
    pictures: Sequence[str] = ()

    @property
    def records(self) -> list[dict[str, Any]]:
        """The rows by column."""
        return [dict(zip(self.columns, row, strict=True)) for row in self.rows]

    @property
    def shown(self) -> Sequence[Any]:
        return self.rows[:ROWS_SHOWN]

    @property
    def left_out(self) -> int:
        return len(self.rows) - len(self.shown)


def read_table(
    connection: Connection, title: str, name: str, /, most: int | None = None, **parameters: Any
) -> PageTable:
    """The table of the named query `queries/NAME.sql`, of the first rows where `most` says how many."""
    found = connection.execute(sql.query(name), parameters)
    columns, own = list(found.keys()), name.rpartition("/")[2]
    rows = found.all() if most is None else found.fetchmany(most)
    return PageTable(title, columns, rows, sql.query(name).text, parameters, sql.description(name), own)


@dataclass(frozen=True)
class ListEntry:
    """An entry of the list next to pictures and model: what it is and is called, its part in the scene, surfaces of
    that (None: all), ids of arcs in the pictures.

    level: finding (not as modelled), part or feature; share: its size where that is another, or how much of it there
    is; state empty where nothing was said of it."""

    level: str
    name: str
    share: str
    part: int | None
    surfaces: list[int] | None = None
    state: str = ""
    note: str = ""
    arcs: Sequence[str] = ()


def render(*, items: Sequence[ListEntry] = (), scene: dict[str, Any] | None = None, **values: Any) -> str:
    """A page, of what the template may show that which is given; sections: each a heading, and tables and drawings."""
    words = "nav over word mood reason words seal newest older files store unseen items_title"
    lists = "sheet facts fields plots summary pictures states layers sections rest passed legend labelled lines"
    own: dict[str, Any] = {
        **dict.fromkeys(words.split(), ""),
        **dict.fromkeys(lists.split(), ()),
        "cards": None,
        "chosen": {e.name: n for n, e in enumerate(items)},
        "items": items,
        "scene": scene,
        "data": (items or scene)
        and {"items": [{"arcs": e.arcs, "part": e.part, "surfaces": e.surfaces} for e in items], "scene": scene},
        "maker": f"Made by relmodel {relmodel.__version__} from rows of the store",
        "script": page_script(),
        "policy": policy(),
        "style": Markup(_style()),
    }
    return _environment().get_template("page.html").render(**(own | values))


def write_page(path: Path, made: Callable[[], str]) -> None:
    """Write the page that `made` returns.  Raises InputError where the file cannot be written, before it is made."""
    check_writable(path, "page")
    text = made()
    try:
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise InputError(f"the page {path} cannot be written ({error.strerror}): name another place") from error


@cache
def _style() -> str:
    states = "".join(f".state-{n} {{ --state: {hexadecimal(c)}; --key: var(--state); }}\n" for n, c in STATES.items())
    root = f":root {{ --blend: {hexadecimal(BLEND)}; --unexplained: {hexadecimal(UNEXPLAINED)}; }}\n"
    met = f".states {{ --key: {hexadecimal(STATES['confirmed'])}; }}\n"
    return root + (_FOLDER / "page.css").read_text() + states + met


@cache
def page_script(served: bool = False) -> Markup:
    names = ("viewer.js", "page.js", *(["served.js"] if served else []))
    return Markup("".join((_FOLDER / name).read_text() for name in names))


def policy(served: bool = False) -> str:
    """The Content-Security-Policy of a page: only its own script runs, served pages fetch from their server alone."""
    own, fetched = ("'self'", " 'self'; connect-src 'self'") if served else ("'none'", "")
    digest = base64.b64encode(hashlib.sha256(page_script(served).encode()).digest()).decode()
    return (
        f"default-src 'none'; img-src data:{fetched}; style-src 'unsafe-inline'; "
        f"script-src 'sha256-{digest}'; base-uri 'none'; form-action {own}"
    )


def script_json(data: Any) -> Markup:
    """JSON for an element of type application/json: no `<` in it can end the element."""
    text = json_text(data, separators=(",", ":"))
    return Markup(text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026"))


def cell(value: Any) -> str:
    """A value as a table shows it: six digits, times to the second, control characters made visible."""
    if value is None:
        return ""
    if isinstance(value, Markup):  # drawn here, not read from anywhere
        return value
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, (float, Decimal)):
        return f"{value:.6g}"
    if isinstance(value, datetime):
        return value.isoformat(" ", "seconds")
    if isinstance(value, (list, tuple)):
        return ", ".join(cell(v) for v in value)
    return visible(str(value))


def table_cell(value: Any, link: str = "", name: str = "") -> Markup:
    """A cell of a table, figures set to the right; link: where it leads; name: of its column, where a narrow page has
    no line for these.  (No macro: there are thousands.)"""
    kind = "figure" if is_figure(value) else "words" if isinstance(value, str) and len(value) > 40 else ""
    words = f'<a href="{escape(link)}">{escape(cell(value))}</a>' if link else escape(cell(value))
    own = f' data-name="{escape(visible(name.replace("_", " ")))}"' if name else ""
    return Markup(f'<td{own} class="{kind}">{words}</td>' if kind else f"<td{own}>{words}</td>")


def is_figure(value: Any) -> bool:
    return isinstance(value, (int, float, Decimal)) and not isinstance(value, bool)


def breakable(path: str) -> Markup:
    """A path whose line may break after a slash or an underscore, and not inside a word."""
    return Markup("<wbr>").join(re.split(r"(?<=[/_])", cell(path)))


def clauses(sentence: str) -> list[str]:
    """The clauses of a text, split at semicolons outside parentheses."""
    return re.split(r"; (?![^(]*\))", sentence)


@cache
def _environment() -> Environment:
    made = Environment(
        loader=FileSystemLoader(_FOLDER),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    made.filters |= {"breakable": breakable, "cell": cell, "clauses": clauses, "json": script_json}
    made.filters["heading"] = lambda name: visible(name.replace("_", " "))
    made.filters["td"] = table_cell
    made.tests["figure"] = is_figure
    return made
