"""The reference, made from the code: commands from the parser, the dictionary from a store, questions from SQL."""

from __future__ import annotations

import argparse
import os
from collections.abc import Callable
from itertools import groupby
from pathlib import Path

from relmodel.app.cli.main import VERBS, parser
from relmodel.resources import resource_dir
from relmodel.store.store import FUNCTION, Column, columns_of, dictionary, schema_in_memory

_WIDTH = "88"  # columns of the help

# The levels as the drawings of docs/views.md have them, and between tables without keys what leads to the other.
LEVELS = {
    "model": {
        *("world", "placed_object", "placed_body", "object_variant", "object", "object_node", "part", "shape"),
        *("feature", "shape_surface", "surface", "shape_arc", "arc"),
    },
    "run": {
        *("run", "world", "inspection", "inspection_image", "image", "extraction", "image_arc", "hypothesis"),
        *("view_arc", "correspondence", "presence", "object_node"),
    },
}
_WITHOUT_KEYS = (
    ("placed_object", ["world"], "world"),
    ("object_node", ["object_id"], "object"),
    ("object_node", ["part_id"], "part"),
    ("image_arc", ["extraction_id"], "extraction"),
    ("view_arc", ["occurrence_id"], "object_node"),
    ("correspondence", ["image_arc_no"], "image_arc"),
    ("presence", ["occurrence_id"], "object_node"),
)


def write_reference(folder: Path) -> None:
    """Write the pages into a folder, which is made."""
    folder.mkdir(exist_ok=True)
    pages: dict[str, Callable[[], str]] = {"commands": commands, "dictionary": tables, "questions": questions}
    for name, make in pages.items():
        file, text = folder / f"{name}.md", make()
        if not file.exists() or file.read_text() != text:  # what has not changed is not built again
            file.write_text(text)


def commands() -> str:
    """Every verb with its help."""
    before = os.environ.get("COLUMNS")
    os.environ["COLUMNS"] = _WIDTH
    try:
        top = parser(rare=True)
        verbs = next(a for a in top._actions if isinstance(a, argparse._SubParsersAction)).choices
        helps = {name: verbs[name].format_help() for name in VERBS}
        head = top.format_help()
    finally:
        if before is None:
            del os.environ["COLUMNS"]
        else:
            os.environ["COLUMNS"] = before
    sections = [f"## relmodel {name}\n\n```text\n{text.rstrip()}\n```\n" for name, text in helps.items()]
    return f"# Commands\n\n```text\n{head.rstrip()}\n```\n\n" + "\n".join(sections)


def tables() -> str:
    """Every table and view with its columns, and every function with its arguments, by level."""
    with schema_in_memory() as store:
        entries = dictionary(store)
        columns: dict[str, list[Column]] = {}
        for column in columns_of(store):
            columns.setdefault(column.relation, []).append(column)
    lines = [
        "# Dictionary",
        "",
        "Every table, view and function of a store, from a store itself: `relmodel schema` prints the same.",
        "",
    ]
    for level, of_level in groupby(entries, key=lambda e: (e.level, e.standing == FUNCTION)):
        title = level[0] + (": functions" if level[1] else "")
        lines += [f"## {title[:1].upper()}{title[1:]}", ""]
        for entry in of_level:
            lines += [f"### {entry.relation}", "", f"{_cell(entry.comment)} *({entry.standing})*", ""]
            lines += _columns(columns[entry.relation], "argument" if level[1] else "column")
    return "\n".join(lines)


def _columns(columns: list[Column], head: str) -> list[str]:
    rows = [
        f"| `{c.column}`{' (key)' if c.key else ''} | {_cell(c.type)} | {_cell(c.comment)}"
        + (f"; see `{c.refers_to}`" if c.refers_to else "")
        + " |"
        for c in columns
    ]
    return [f"| {head} | type | meaning |", "| --- | --- | --- |", *rows, ""]


def level_diagrams() -> dict[str, str]:
    """Of each of `LEVELS` what refers to what, as an entity-relationship diagram in Mermaid's words."""
    with schema_in_memory() as store:
        keys = {(c.relation, c.column) for c in columns_of(store) if c.key}
        with store.read() as connection:
            rows = store.rows(connection, "store/reference_columns")
    drawn: dict[tuple[str, str], dict[str, None]] = {}
    for child, columns, parent in [*((r.relation, r.column_names, r.parent) for r in rows), *_WITHOUT_KEYS]:
        drawn.setdefault((parent, child), {}).update(dict.fromkeys(columns))
    diagrams = {}
    for name, relations in LEVELS.items():
        lines = ["erDiagram"]
        for (parent, child), names in sorted(drawn.items()):
            if {parent, child} <= relations:
                one = {(child, column) for column in names} == {key for key in keys if key[0] == child}
                lines.append(f'    {parent} ||--o{"|" if one else "{"} {child} : "{", ".join(names)}"')
        diagrams[name] = "\n".join(lines)
    return diagrams


def questions() -> str:
    """The example questions with their SQL."""
    lines = ["# Questions that engineers ask", "", "Each is a file of `queries/examples/`, for `relmodel sql`.", ""]
    for file in sorted((resource_dir("queries") / "examples").glob("*.sql")):
        text = file.read_text().strip()
        question = text.partition("\n")[0].removeprefix("--").strip()
        lines += [f"## {file.stem.replace('_', ' ').capitalize()}", "", _cell(question), "", f"```sql\n{text}\n```", ""]
    return "\n".join(lines)


def _cell(text: str | None) -> str:
    """Text as it stands in a table of Markdown."""
    for mark in ("\\", "|", "*", "_", "<", "[", "`"):
        text = (text or "").replace(mark, f"\\{mark}")
    return text or ""


if __name__ == "__main__":
    write_reference(Path(__file__).parent / "reference")
