"""Reject a finding: the part must not be used with it.

It is recorded like relmodel accept, with the opposite decision.
"""

from __future__ import annotations

from functools import partial

from relmodel.app.cli.verbs.accept import add_arguments, record

__all__ = ["add_arguments", "run"]

EXAMPLE = 'relmodel reject 3 --run 12 --by "A. Meier" --note "hole LH12 too small" --store cell.duckdb'
run = partial(record, "rejected")
