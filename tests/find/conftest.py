"""Worlds that several files of tests ask, each filled once in a process on each engine."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import pytest

from relmodel.store import Store
from tests.find import test_find, volume_cases
from tests.find.test_find import Oracle
from tests.find.test_sql_clients import add_camera

ENGINES = ("duckdb", "postgresql")


@dataclass(frozen=True)
class Filled:
    """A store with a world and a camera: its name, its truth, and the camera's identity."""

    target: str
    oracle: Oracle
    camera: int


@pytest.fixture(scope="session", params=ENGINES)
def filled(
    request: pytest.FixtureRequest, new_store: Callable[[str], str], tmp_path_factory: pytest.TempPathFactory
) -> Filled:
    target = new_store(request.param)
    with Store.open(target) as store:
        return Filled(target, test_find.fill(store, tmp_path_factory.mktemp("find")), add_camera(store))


@pytest.fixture(scope="session", params=ENGINES)
def cubes(
    request: pytest.FixtureRequest, new_store: Callable[[str], str], tmp_path_factory: pytest.TempPathFactory
) -> str:
    """A store with the world of `volume_cases`."""
    target = new_store(request.param)
    with Store.open(target) as store:
        volume_cases.fill(store, tmp_path_factory.mktemp("cubes"))
    return target
