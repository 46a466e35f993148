"""Every form of the volume predicate against one table of cases: in process, SQL on both engines, and Parquet."""

from __future__ import annotations

from pathlib import Path

import pytest
import sqlalchemy as sa

from relmodel.find.find import in_volumes
from relmodel.find.indexes import KINDS, WorldIndex
from relmodel.find.parquet import export_parts
from relmodel.find.volumes import Box, Frustum, Sphere
from relmodel.store import Store
from tests.find.test_parquet import duckdb_rows, occurrences, placed_parts, write_questions
from tests.find.test_sql_clients import add_camera, call, rows_of
from tests.find.volume_cases import CASES, letters

NAMES = [name for name, _, _ in CASES]
VOLUMES = [volume for _, volume, _ in CASES]
WANTED = [parts for _, _, parts in CASES]


def test_queries_of_the_store(cubes: str) -> None:
    with Store.open(cubes) as store:
        together = in_volumes(store, VOLUMES)
    for number, wanted in enumerate(WANTED):
        assert letters(together["path"][together["volume_no"] == number].tolist()) == wanted, NAMES[number]


@pytest.mark.parametrize("cubes", ["duckdb"], indirect=True)
@pytest.mark.parametrize("kind", KINDS)
def test_indexes_in_process(cubes: str, kind: str) -> None:
    with Store.open(cubes) as store:
        index = WorldIndex.load(store, kind=kind)
        with store.read() as connection:
            path = {row.id: row.path for row in connection.execute(sa.text("SELECT id, path FROM occurrence"))}
    for name, volume, wanted in CASES:
        occurrence, _ = index.in_volume(volume)
        assert letters([path[i] for i in occurrence.tolist()]) == wanted, name


def test_functions_of_the_database(cubes: str) -> None:
    """Boxes, balls and views have functions that any client calls."""
    with Store.open(cubes) as store:
        cameras = {name: add_camera(store, volume) for name, volume, _ in CASES if isinstance(volume, Frustum)}
    asked = [case for case in CASES if isinstance(case[1], Box | Sphere | Frustum)]
    answers = rows_of(cubes, [call(volume, "part", cameras.get(name, 0)) for name, volume, _ in asked])
    for (name, _, wanted), rows in zip(asked, answers, strict=True):
        assert letters([row[2] for row in rows]) == wanted, name


def test_parquet_files(cubes: str, tmp_path: Path) -> None:
    with Store.open(cubes) as store, store.read() as connection:
        export_parts(store, connection, tmp_path / "parts")
        assert placed_parts(tmp_path / "parts") == occurrences(store)  # of robots each link with its pose
    write_questions(VOLUMES, tmp_path)
    rows = [row for row in duckdb_rows(tmp_path) if row[0] < len(CASES)]  # of the level of parts, which is the first
    for number, (name, _, wanted) in enumerate(CASES):
        assert letters([row[3] for row in rows if row[0] == number]) == wanted, name
