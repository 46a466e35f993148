"""Whether a report is what the store gives: the rows that it carries the hash of, and the page itself."""

from __future__ import annotations

import re
from html import unescape
from pathlib import Path

from relmodel.app.report.run import run_page
from relmodel.app.report.serial import serial_page
from relmodel.errors import InputError
from relmodel.paths import read_text
from relmodel.store import Store
from relmodel.store.digests import seal


def confirm(store: Store, file: Path) -> str:
    """What is wrong with a report, one sentence; empty where nothing is.  Raises InputError where it is no report with
    a hash."""
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
