"""The reference, made from the code: commands from the parser, the dictionary from a store, questions from SQL."""

from __future__ import annotations

import argparse
import os
import tempfile
from collections.abc import Callable
from itertools import groupby
from pathlib import Path

from relmodel.cli.main import VERBS, parser
from relmodel.resources import resource_dir
from relmodel.store import Store
from relmodel.store.dictionary import dictionary

_WIDTH = "88"  # columns of the help


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
        top = parser()
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
    """Every table and view with its columns, by level."""
    with tempfile.TemporaryDirectory() as folder, Store.create(Path(folder) / "empty.duckdb") as store:
        entries = dictionary(store)
    lines = [
        "# Dictionary",
        "",
        "Every table and view of the store, from the store itself: `relmodel schema` prints the same.",
        "",
    ]
    for level, of_level in groupby(entries, key=lambda e: e.level):
        lines += [f"## {level[:1].upper()}{level[1:]}", ""]
        for relation, found in groupby(of_level, key=lambda e: e.relation):
            first, *columns = found
            lines += [f"### {relation}", "", f"{_cell(first.comment)} *({first.standing})*", ""]
            lines += ["| column | type | meaning |", "| --- | --- | --- |"]
            lines += [f"| `{c.column}` | {_cell(c.type)} | {_cell(c.comment)} |" for c in columns]
            lines.append("")
    return "\n".join(lines)


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
