"""References: rows of the catalogue on both engines, foreign keys on PostgreSQL only."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import psycopg
import pytest
import sqlalchemy as sa

from relmodel.store import Store


def references(store: Store) -> Sequence[sa.Row[Any]]:
    with store.read() as connection:
        return connection.execute(store.table("sds_reference").select()).all()


def test_every_reference_is_a_foreign_key_of_postgresql_and_none_of_duckdb(fresh_store: str) -> None:
    with Store.open(fresh_store) as store:
        rows = references(store)
        keys = [
            (table, tuple(key["constrained_columns"]), key["referred_table"], tuple(key["referred_columns"]))
            for (_, table), found in sa.inspect(store.engine).get_multi_foreign_keys().items()
            for key in found
        ]
    expected = [(row.relation, tuple(row.column_names), row.parent, tuple(row.parent_columns)) for row in rows]
    assert len(expected) == len(set(expected)) > 100
    assert sorted(keys) == (sorted(expected) if store.dialect == "postgresql" else [])


def test_only_postgresql_refuses_a_row_whose_reference_leads_nowhere(fresh_store: str) -> None:
    row: dict[str, Any] = {"run_id": [7], "input_no": 0, "role": "model", "name": "a.stl", "sha256": "0"}
    with Store.open(fresh_store) as store:
        refused = (
            pytest.raises(psycopg.errors.ForeignKeyViolation, match="run_input_run_id_fkey")
            if store.dialect == "postgresql"
            else nullcontext()
        )
        with refused, store.write() as connection:
            store.append(connection, "run_input", row)


def test_every_identity_refers_to_something(duckdb_file: Path) -> None:
    """But of tables without keys and what refers to an occurrence, a view: queries of check/ look after these."""
    with Store.open(duckdb_file) as store:
        refers = {(row.relation, name) for row in references(store) for name in row.column_names}
        inspector = sa.inspect(store.engine)
        keys = {name: key["constrained_columns"] for (_, name), key in inspector.get_multi_pk_constraint().items()}
        names = {(table, column.name) for table in keys for column in store.table(table).columns}
    identities = {(table, name) for table, name in names if name.endswith("_id") and keys[table]}
    assert len(identities) > 80
    assert {name for _, name in identities - refers} == {"occurrence_id"}
