"""A store with variants of the demonstration bulkhead."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from relmodel.loading.write import LoadReport
from relmodel.store import Store
from tests.reading import load

LOADED = "ABE"  # of the six of the demonstration: each takes seconds
EXAMPLES = Path(__file__).parents[2] / "examples"


def step_file(variant: str) -> Path:
    """The committed file of a variant."""
    folder = "demo" if variant in "AB" else "bulkhead/variants"
    return EXAMPLES / folder / f"bulkhead_{variant}.step.gz"


@dataclass(frozen=True)
class Bulkheads:
    """The store, a copy of its file for who must open it, and what loading each variant, A first, added to it."""

    store: Store
    copy: Path
    reports: dict[str, LoadReport]


@pytest.fixture(scope="session")
def bulkheads(duckdb_template: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Bulkheads]:
    file = tmp_path_factory.mktemp("bulkheads") / "s.duckdb"
    shutil.copy(duckdb_template, file)
    with Store.open(file) as store:
        reports = {v: load(store, step_file(v), name="bulkhead", variant=v) for v in LOADED}
    shutil.copy(file, file.with_name("copy.duckdb"))
    with Store.open(file) as store:
        yield Bulkheads(store, file.with_name("copy.duckdb"), reports)


@pytest.fixture
def store(duckdb_file: Path) -> Iterator[Store]:
    with Store.open(duckdb_file) as opened:
        yield opened
