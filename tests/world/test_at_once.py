"""Several writers and readers at once on a PostgreSQL server, each with a session of its own."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from threading import Barrier, Event
from typing import Any

import numpy as np
import pytest
import sqlalchemy as sa
import trimesh

from relmodel.find.find import in_volumes
from relmodel.find.volumes import Box
from relmodel.geometry.transforms import MATRIX_COLUMNS, matrices
from relmodel.store import Store
from relmodel.store.check import check
from relmodel.world import place_world
from tests.find.test_find import Oracle, answer
from tests.poses import pose_of
from tests.reading import load
from tests.synthetic_model import SyntheticModel, write_world

WRITERS, READERS, REVISIONS, READS = 2, 3, 3, 6
LEVELS = ("part", "feature")


@pytest.fixture
def target(new_store: Callable[[str], str]) -> str:
    return new_store("postgresql")


@dataclass(frozen=True)
class Answered:
    """What a reader was answered; whether the newest worlds stayed the same within one reading."""

    level: str
    volumes: list[Box]
    found: dict[str, Any]
    one_snapshot: bool


def placed_at(writer: int, step: int) -> dict[str, list[list[float]]]:
    """Where a writer places the two objects of the world at a step: nowhere twice."""
    places = {}
    for number, name in enumerate("ab"):
        turn = [0.1 * step, 0.3 * writer, 0.7 * number]
        places[name] = pose_of([40 * step + 5, 25 * writer, -60 * number], turn).tolist()
    return places


def test_readers_see_whole_revisions_while_writers_write(target: str, tmp_path: Path) -> None:
    """Every answer is that of brute force at one revision of the world, and no revision is lost."""
    model = SyntheticModel(11)
    rng = np.random.default_rng(12)
    with Store.open(target) as store:
        model.fill(store)
    start, written = Barrier(WRITERS + READERS), Event()

    def write(writer: int) -> None:
        with Store.open(target) as store:
            start.wait()
            for step in range(REVISIONS):
                objects: list[dict[str, object]] = [
                    {"object": "thing", "name": name, "world_from_object": pose}
                    for name, pose in placed_at(writer, step).items()
                ]
                file = write_world(tmp_path / f"{writer}_{step}.yaml", "cell", objects)
                assert place_world(store, file).status == "added"

    def read(volumes: list[Box]) -> list[Answered]:
        answers: list[Answered] = []
        with Store.open(target, read_only=True) as store:
            start.wait()
            while len(answers) < READS or not written.is_set():
                level = LEVELS[len(answers) % 2]
                found = in_volumes(store, volumes, level=level)
                with store.read() as connection:
                    before = store.rows(connection, "world/current")
                    connection.exec_driver_sql("SELECT pg_sleep(0.02)")
                    after = store.rows(connection, "world/current")
                answers.append(Answered(level, volumes, found, before == after))
        return answers

    def asked() -> list[Box]:
        centre, half = rng.uniform(-200, 300, (6, 3)), 10 ** rng.uniform(1, 2.3, (6, 3))
        everything = Box(-3000, -3000, -3000, 3000, 3000, 3000)
        return [everything, *(Box(*row) for row in np.concatenate([centre - half, centre + half], axis=1))]

    with ThreadPoolExecutor(WRITERS + READERS) as pool:
        writing = [pool.submit(write, writer) for writer in range(WRITERS)]
        reading = [pool.submit(read, asked()) for _ in range(READERS)]
        try:
            for done in writing:
                done.result(600)
        finally:
            written.set()
        answers = [a for done in reading for a in done.result(600)]

    with Store.open(target) as store, store.read() as connection:
        worlds = connection.execute(store.table("world").select())
        assert sorted(row.revision for row in worlds) == list(range(1, WRITERS * REVISIONS + 1))
        poses: dict[int, dict[str, Any]] = {}
        for row in connection.execute(sa.text("SELECT * FROM world_object")):
            poses.setdefault(row.world_id, {})[row.name] = matrices(
                {c: np.array([getattr(row, c)]) for c in MATRIX_COLUMNS}
            )[0]
        offended = {finding.query for finding in check(store) if finding.rows}
        assert not offended & {f"check/{name}" for name in ("object_node_box", "placed_body", "object_page")}
    wanted = [{n: np.array(p) for n, p in placed_at(w, s).items()} for w in range(WRITERS) for s in range(REVISIONS)]
    for places in poses.values():  # each revision is one that a writer wrote, and whole
        assert sum(all(np.allclose(places[n], p[n], atol=1e-12) for n in "ab") for p in wanted) == 1
    oracles = {world_id: Oracle(model, places) for world_id, places in poses.items()}
    within = {part.path[2:]: part.world_from_part for part in model.placed("a", np.eye(4))}
    seen = set()
    for read_once in answers:
        assert read_once.one_snapshot
        found = read_once.found
        if not len(found["path"]):  # before the first revision
            continue
        path = str(found["path"][0])
        place = matrices({c: found[c][0] for c in MATRIX_COLUMNS}) @ np.linalg.inv(within[path[2:]])
        (world_id,) = (i for i, at in poses.items() if np.allclose(at[path[0]], place, atol=1e-9))
        seen.add(world_id)
        for number, volume in enumerate(read_once.volumes):
            rows = {name: values[found["volume_no"] == number] for name, values in found.items()}
            assert answer(rows) == oracles[world_id].in_box(volume, read_once.level)
    assert len(seen) > 3


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
        assert not [finding for finding in check(store) if finding.rows]
