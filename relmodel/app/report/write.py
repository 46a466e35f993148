"""Pages written to files, and later held against the rows that the store gives."""

from __future__ import annotations

import re
from collections.abc import Sequence
from html import unescape
from pathlib import Path
from typing import TypedDict

from relmodel.app.audit import run_named
from relmodel.app.report.object import diff_page, object_page, serial_page
from relmodel.app.report.page import write_page
from relmodel.app.report.run import run_page
from relmodel.errors import InputError, UsageError
from relmodel.names import check_writable, read_text
from relmodel.progress import Progress, silent
from relmodel.store import Store
from relmodel.store.runs import seal
from relmodel.variants.compare import compare


class Subject(TypedDict, total=False):
    """What a page is of, one of these; of the newest inspection where none is named.

    run: its number, or a word that names it.  serial: of a physical part.  object: its name, and its variant.
    diff: two variants, of the object where that is named, else as OBJECT:VARIANT."""

    run: int | str | None
    serial: str | None
    object: str | None
    variant: str
    diff: Sequence[str] | None


def write_report(store: Store, out: Path, of: Subject, progress: Progress = silent) -> str:
    """Write the page of a subject, and return in words of what it is; a comparison that was not made before is written
    to the store.  Raises UsageError where several things are named or one is not there."""
    run, serial, object_name, diff = of.get("run"), of.get("serial"), of.get("object"), of.get("diff")
    variant = of.get("variant", "")
    if (run is not None) + (serial is not None) + bool(diff or object_name) > 1:
        raise UsageError("a page is of one thing: give RUN, or --serial SN, or --object NAME, or --diff A B")
    if variant and (diff or not object_name):
        raise UsageError("--variant says which variant of --object: give it with --object and without --diff")
    if diff:
        check_writable(out, "page")
        before, after = (variant_named(text, object_name) for text in diff)
        made = compare(store, before, after, progress=progress).id
        with store.read() as connection:
            write_page(out, lambda: diff_page(store, connection, made, before, after))
        return f"{diff[0]} against {diff[1]}"
    with store.read() as connection:
        if object_name:
            write_page(out, lambda: object_page(store, connection, object_name, variant))
            return " variant ".join(filter(None, [object_name, variant]))
        if serial is not None:
            write_page(out, lambda: serial_page(store, connection, serial))
            return f"part {serial}"
        number = run_named(store, connection, run)
        write_page(out, lambda: run_page(store, connection, number))
        return f"run {number}"


def variant_named(text: str, object_name: str | None) -> tuple[str, str]:
    """Name and variant of an object: the variant where the object is named, else both as OBJECT:VARIANT."""
    name, _, variant = text.partition(":")
    return (object_name, text) if object_name else (name, variant)


def confirm(store: Store, file: Path) -> str:
    """What is wrong with a report, one sentence, or nothing.  Raises InputError where it is no report with a hash."""
    text = read_text(file, "report")
    found = re.search(r'<meta name="relmodel-seal" content="(run|serial) (.+?) ([0-9a-f]{64})">', text)
    if found is None:
        raise InputError(f"{file} carries no hash: give a page that relmodel report wrote of an inspection or a part")
    name = unescape(found[2])
    with store.read() as connection:
        runs = [int(name)] if found[1] == "run" else []
        runs = runs or [int(row.run) for row in store.rows(connection, "report/serial_stops", serial=name)]
        if seal(store, connection, runs) != found[3]:
            return f"{file}: the rows of {found[1]} {name} in {store.name} are not those that the report was made from"
        given = run_page(store, connection, runs[0]) if found[1] == "run" else serial_page(store, connection, name)
        if given != text:
            return (
                f"{file} is not the page that {found[1]} {name} gives now: it was altered, another version made it, or "
                "a finding was decided since"
            )
    return ""
