"""What a person decides of a finding, kept as a row with who, when and why."""

from __future__ import annotations

from typing import Any

from relmodel.app.audit import run_named
from relmodel.app.report.run import size_words
from relmodel.errors import UsageError
from relmodel.store import Run, Store

_LONGEST_REASON = 2000  # characters


def decide(store: Store, number: int | str | None, finding: int, decision: str, by: str, note: str) -> str:
    """Record that a finding of a run (None: the newest inspection) is accepted or rejected; what was decided, in words.

    Raises UsageError where there is no such finding, and where name or note are empty."""
    for what, words in (("by", by), ("note", note)):
        if not words.strip() or "\0" in words or len(words) > _LONGEST_REASON:
            raise UsageError(
                f"{what} is empty or too long: give who decides, and why, in 1 to {_LONGEST_REASON} characters"
            )
    with store.read() as connection:
        inspection = run_named(store, connection, number)
        rows = store.rows(connection, "result/finding", run_id=inspection)
    row = next((row for row in rows if row.finding_no == finding), None)
    if row is None:
        there = f"it has 1 to {len(rows)}" if rows else "it has none"
        raise UsageError(f"run {inspection} has no finding {finding}: {there}")
    asked: dict[str, Any] = {"inspection": inspection, "finding": finding, "decision": decision}
    with Run.begin(store, "decide", asked) as run:
        words = f"finding {finding} of run {inspection} is {decision} by {by.strip()}: {row.path} {size_words(row)}"

        def write(connection: Any) -> None:
            said = {"decision": decision, "decided_by": by.strip(), "note": note.strip()}
            key: dict[str, Any] = {"run_id": [run.id], "inspection_run_id": inspection, "item_no": int(row.item_no)}
            run.append(connection, "finding_decision", key | said)
            run.finish(words.rstrip(), connection)

        run.transact(write)
    return f"{words.rstrip()} (run {run.id})"
