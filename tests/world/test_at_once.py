"""Several writers and readers at once on a PostgreSQL server, each with a session of its own."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from threading import Barrier, Event
from typing import Any

import numpy as np
import pytest
import sqlalchemy as sa
import trimesh

from relmodel.arrays import Floats
from relmodel.find.find import in_volume
from relmodel.find.volumes import Box
from relmodel.geometry.transforms import matrices
from relmodel.store import Store
from relmodel.store.bulk import fetch_columns
from tests.poses import pose_of
from tests.reading import load
from tests.store.amiss import flaws
from tests.synthetic_model import SyntheticModel, place_things

WRITERS, READERS, REVISIONS, READS = 2, 3, 3, 6


@pytest.fixture
def target(new_store: Callable[[str], str]) -> str:
    return new_store("postgresql")


def placed_at(writer: int, step: int) -> dict[str, Floats]:
    """Where a writer places the two objects of the world at a step: nowhere twice."""
    return {
        name: pose_of([40 * step + 5, 25 * writer, -60 * number], [0.1 * step, 0.3 * writer, 0.7 * number])
        for number, name in enumerate("ab")
    }


def test_readers_see_whole_revisions_while_writers_write(target: str, tmp_path: Path) -> None:
    """What a reader finds stands where one writer placed it at one step, and no revision is lost."""
    model = SyntheticModel(11)
    with Store.open(target) as store:
        model.fill(store)
    start, written = Barrier(WRITERS + READERS), Event()

    def write(writer: int) -> None:
        with Store.open(target) as store:
            start.wait()
            for step in range(REVISIONS):
                file = tmp_path / f"{writer}_{step}"
                file.mkdir()
                assert place_things(store, file, placed_at(writer, step)).status == "added"

    def read() -> list[tuple[dict[str, Any], bool]]:
        """What is found, and whether the newest worlds stayed the same within one reading."""
        answers: list[tuple[dict[str, Any], bool]] = []
        with Store.open(target, read_only=True) as store:
            start.wait()
            while len(answers) < READS or not written.is_set():
                found = in_volume(store, Box(-3000, -3000, -3000, 3000, 3000, 3000))
                with store.read() as connection:
                    before = store.rows(connection, "world/current")
                    connection.exec_driver_sql("SELECT pg_sleep(0.02)")
                    answers.append((found, before == store.rows(connection, "world/current")))
        return answers

    with ThreadPoolExecutor(WRITERS + READERS) as pool:
        writing = [pool.submit(write, writer) for writer in range(WRITERS)]
        reading = [pool.submit(read) for _ in range(READERS)]
        try:
            for done in writing:
                done.result(600)
        finally:
            written.set()
        answers = [answer for done in reading for answer in done.result(600)]

    steps = [placed_at(writer, step) for writer in range(WRITERS) for step in range(REVISIONS)]
    placed = [{p.path: p.world_from_part for name in "ab" for p in model.placed(name, at[name])} for at in steps]
    with Store.open(target) as store, store.read() as connection:
        worlds = connection.execute(store.table("world").select())
        assert sorted(row.revision for row in worlds) == list(range(1, len(steps) + 1))
        parts = sa.text("SELECT * FROM occurrence WHERE kind = 'part' AND world_id = :world_id")
        for world_id in range(1, len(steps) + 1):
            rows = fetch_columns(connection, parts, {"world_id": world_id})
            assert sum(stands(at, rows["path"].tolist(), matrices(rows)) for at in placed) == 1
        assert not flaws(store, "object_", "placed_")
    seen = set()
    for found, one_snapshot in answers:
        assert one_snapshot
        if len(found["path"]):  # else before the first revision
            (step,) = (i for i, at in enumerate(placed) if stands(at, found["path"].tolist(), matrices(found)))
            seen.add(step)
    assert len(seen) > 2


def stands(at: dict[str, Floats], paths: list[str], poses: Floats) -> bool:
    """Whether the parts are those of a step, and each stands where they stand there."""
    alike = (np.allclose(p, at[n], atol=1e-9) for n, p in zip(paths, poses, strict=True))
    return sorted(paths) == sorted(at) and all(alike)


def test_one_file_loaded_by_two_is_there_once(target: str, tmp_path: Path) -> None:
    """What two processes find missing at the same time is written by one of them."""
    trimesh.creation.box((10.0, 20.0, 30.0)).export(tmp_path / "box.stl")
    start = Barrier(4)

    def read(name: str) -> str:
        with Store.open(target) as store:
            start.wait()
            return load(store, tmp_path / "box.stl", name=name, unit="mm").status

    with ThreadPoolExecutor(4) as pool:
        loaded = list(pool.map(read, ("box", "box", "box", "crate")))
    assert sorted(loaded) == ["added", "added", "unchanged", "unchanged"]
    with Store.open(target) as store, store.read() as connection:
        count = {t: len(connection.execute(store.table(t).select()).all()) for t in ("shape", "surface", "arc", "part")}
        # the file names no part: each has its object's name
        assert count == {"shape": 1, "surface": 6, "arc": 12, "part": 2}
        assert not flaws(store, "shape_", "orphans", "loop_", "surface_")
