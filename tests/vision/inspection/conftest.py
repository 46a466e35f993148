"""The store in which the demonstration's pair was inspected at half size, a copy of it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

import relmodel
from relmodel.app.api import OpenStore
from tests.app.cli import conftest as cli
from tests.app.cli.conftest import Inspection, bulkhead_template, inspection, loaded, pair
from tests.app.conftest import compiled
from tests.given import CopyStore
from vision.inspection import Inspection as Answer

__all__ = ["bulkhead_template", "compiled", "inspection", "loaded", "pair"]  # fixtures
blocks_pair, blocks_seen, blocks_template = cli.blocks_pair, cli.blocks_seen, cli.blocks_template
blocks_on_postgresql, minimal = cli.blocks_on_postgresql, cli.minimal

DEMO = Path(__file__).parents[3] / "examples/demo"
Done = tuple[OpenStore, Answer]


@pytest.fixture(scope="session")
def done(inspection: Inspection, copy_store: CopyStore) -> Iterator[Done]:
    with relmodel.open(copy_store(inspection.store), read_only=False) as store:
        yield store, inspection.kept
