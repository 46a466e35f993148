"""A database in memory with the tables that matching joins, fed with the rows of the store: a run matches in it while
it holds no file, by the same SQL that would run on the store."""

from __future__ import annotations

from sqlalchemy import URL

from relmodel.store import sql
from relmodel.store.database import Database
from relmodel.store.engine import connect

TABLES = (
    "edge_element",
    "view_point",
    "unit_relation",
    "problem",
    "problem_tolerance",
    "candidate",
    "problem_relation",
    "compatibility",
)
VIEWS = ("due_relation", "due_compatibility")


def open_workspace() -> Database:
    """An empty database in memory with `TABLES` and `VIEWS`, as schema/ makes them."""
    workspace = Database(connect(URL.create("duckdb", database=":memory:"), read_only=False), "memory")
    with workspace.write() as connection:
        for table in TABLES + VIEWS:
            connection.exec_driver_sql(sql.table_script(table))
    for table in TABLES:  # asked for now: in memory there is one connection, and it will be busy
        workspace.table(table)
    return workspace
