"""What is amiss in a store without a model: the check without the queries of models, which take most of its time."""

from __future__ import annotations

from unittest.mock import patch

from relmodel.store import Store, sql
from relmodel.store.check import check


def amiss(store: Store) -> dict[str, list[dict[str, object]]]:
    """Rows that the check finds of runs, references, ledger, digests, journal, blocks and tables, by query."""
    with patch.object(sql, "query_names", lambda _: ["check/run_events"]):
        return {finding.query: finding.rows for finding in check(store) if finding.rows}


MODEL = ("arc_off", "element_outside", "loop_open", "object_", "orphans", "shape_counts", "surface_without")


def flaws(store: Store, *queries: str) -> list[dict[str, object]]:
    """Rows that those queries of the check find whose names begin so: the whole takes ten times as long."""
    names = [name for name in sql.query_names("check") if name.removeprefix("check/").startswith(queries)]
    assert len(names) >= len(queries)
    with store.read() as connection:
        return [{"query": name, **row._mapping} for name in names for row in store.rows(connection, name)]
