"""Fixtures that all tests share, and the deselection of tests whose data is not at hand."""

from __future__ import annotations

import os
from pathlib import Path

import pytest


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Deselect, not skip, tests marked `data` where RELMODEL_TEST_DATA is unset."""
    if os.environ.get("RELMODEL_TEST_DATA"):
        return
    gone = [item for item in items if item.get_closest_marker("data")]
    if gone:
        config.hook.pytest_deselected(items=gone)
        items[:] = [item for item in items if item not in gone]


@pytest.fixture(scope="session")
def data_dir() -> Path:
    """Folder of the test data; tests that use it carry the mark `data`."""
    return Path(os.environ["RELMODEL_TEST_DATA"])
