"""Whether a report is what the store gives: the rows that it carries the hash of, and the page itself."""

from __future__ import annotations

import re
from pathlib import Path

from relmodel.app.report.run import run_page
from relmodel.errors import InputError
from relmodel.paths import read_text
from relmodel.store import Store
from relmodel.store.digests import seal


def confirm(store: Store, file: Path) -> str:
    """What is wrong with a report, one sentence; empty where nothing is.  Raises InputError where it is no report with
    a hash."""
    text = read_text(file, "report")
    found = re.search(r'<meta name="relmodel-seal" content="(\d+) ([0-9a-f]{64})">', text)
    if found is None:
        raise InputError(f"{file} carries no hash of a run: give a page that relmodel report wrote of an inspection")
    run = int(found[1])
    with store.read() as connection:
        if seal(store, connection, [run]) != found[2]:
            return f"{file}: the rows of run {run} in {store.name} are not those that the report was made from"
        if run_page(store, connection, run) != text:
            return (
                f"{file} is not the page that run {run} gives now: it was altered, another version made it, or "
                "a finding was decided since"
            )
    return ""
