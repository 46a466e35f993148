"""A store with two variants of the demonstration bulkhead."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from relmodel.store import Store
from tests.app.cli.conftest import both_loaded, loaded

__all__ = ["both_loaded", "loaded"]  # fixtures

EXAMPLES = Path(__file__).parents[2] / "examples"


def step_file(variant: str) -> Path:
    """The committed file of a variant."""
    folder = "demo" if variant in "AB" else "bulkhead/variants"
    return EXAMPLES / folder / f"bulkhead_{variant}.step.gz"


@dataclass(frozen=True)
class Bulkheads:
    """The store, and a copy of its file for who must open it."""

    store: Store
    copy: Path


@pytest.fixture(scope="session")
def bulkheads(both_loaded: Path) -> Iterator[Bulkheads]:
    copy = Path(shutil.copy(both_loaded, both_loaded.with_name("copy.duckdb")))
    with Store.open(both_loaded) as store:
        yield Bulkheads(store, copy)


@pytest.fixture
def store(duckdb_file: Path) -> Iterator[Store]:
    with Store.open(duckdb_file) as opened:
        yield opened
