"""The relational store: one schema on DuckDB and on PostgreSQL, written by columns, with a row for every run."""

from relmodel.store.runs import Run, digest_inputs
from relmodel.store.store import Store

__all__ = ["Run", "Store", "digest_inputs"]
