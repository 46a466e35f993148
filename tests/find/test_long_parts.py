"""Parts ten times as long as wide along each axis, on many pages, in bodies turned each way: SQL against brute force.

Volumes that only just reach a side of a part's box, or just do not, tell a reach that is too short along an axis."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import duckdb
import numpy as np
import pytest

from relmodel.arrays import Floats, Ints
from relmodel.find.find import LEVELS, in_volumes
from relmodel.find.indexes import KINDS, WorldIndex
from relmodel.find.parquet import export_parts
from relmodel.find.volumes import Box, OrientedBox, Sphere, Volume
from relmodel.geometry.transforms import rotation_matrix
from relmodel.store import Store
from tests.find.test_find import Answer, Oracle, paths
from tests.find.test_many_volumes_in_sql import row_of
from tests.find.test_parquet import duckdb_rows, write_questions
from tests.poses import pose_of
from tests.reading import load
from tests.synthetic_model import SyntheticModel, place_things

STEP = 1e-5  # mm by which volumes reach a box, or do not: more than rounding
TURNS = [np.zeros(3), np.array([np.pi / 2, 0, 0]), np.array([0, np.pi / 2, 0]), np.array([0.4, -1.1, 0.7])]

PLACES = {f"{i}": pose_of([0, 700.0 * i, -300.0 * i], turn) for i, turn in enumerate(TURNS)}


@dataclass(frozen=True)
class Filled:
    """A store, closed, with its truth and an index of each kind."""

    target: str
    oracle: Oracle
    indexes: list[WorldIndex]
    paths: dict[int, str]


@pytest.fixture(scope="module")
def filled(new_store: Callable[[str], str], tmp_path_factory: pytest.TempPathFactory) -> Filled:
    model, target = SyntheticModel(5, shapes=6, elements=4, groups=5, parts=12, longer=12.0), new_store("duckdb")
    with Store.open(target) as store:
        model.fill(store)
        place_things(store, tmp_path_factory.mktemp("long"), PLACES)
        indexes = [WorldIndex.load(store, kind=kind) for kind in KINDS]
        return Filled(target, Oracle(model, PLACES), indexes, paths(store))


def beside_sides(low: Floats, high: Floats, rng: np.random.Generator, sign: float) -> list[Box]:
    """For each of some boxes a plate that begins beside a side of it, at random within that side."""
    out = []
    for a, b in zip(low, high, strict=True):
        axis, up = int(rng.integers(3)), bool(rng.integers(2))
        least = rng.uniform(a, b)
        greatest = least + rng.uniform(0, 3, 3)
        least[axis] = b[axis] + sign * STEP if up else a[axis] - sign * STEP - 1
        greatest[axis] = least[axis] + 1
        out.append(Box(*least, *greatest))
    return out


def thick(corners: Floats) -> Ints:
    """Which placed boxes (n, 8, 3) are neither flat nor lines."""
    return np.flatnonzero(np.linalg.norm(corners[:, [4, 2, 1]] - corners[:, :1], axis=2).all(axis=1))


def beside_corners(corners: Floats, rng: np.random.Generator, sign: float) -> Iterator[Sphere | OrientedBox]:
    """Beside each of some placed boxes (n, 8, 3) a ball that is nearest to a corner, an edge or a side of it, or a
    turned box with a side across its farthest corner."""
    for number, own in enumerate(corners):
        edges = own[[4, 2, 1]] - own[0]
        share = rng.choice([0.0, 1.0], 3)
        share[rng.permutation(3)[: number % 3]] = rng.uniform(0, 1, number % 3)
        out = np.where((share > 0) & (share < 1), 0.0, np.sign(share - 0.5)) * rng.uniform(0.2, 1, 3)
        away = out @ (edges / np.linalg.norm(edges, axis=1)[:, None])
        if number % 2:
            away *= rng.uniform(1, 30)
            x, y, z = (own[0] + share @ edges + away).tolist()
            yield Sphere(x, y, z, float(np.linalg.norm(away)) - sign * STEP)
        else:
            turn = rotation_matrix(rng.uniform(-2, 2, 3))
            half, middle = rng.uniform(1, 20, 3), own[np.argmax(own @ turn[:, 0])]
            yield OrientedBox(pose_of(middle + turn[:, 0] * (half[0] + sign * STEP), turn), half)


def asked(target: str, kind: str, level: str, volumes: Sequence[Volume]) -> list[Answer]:
    """What SQL answers to a table of volumes."""
    element = "-1" if level == "part" else f"{level}_no"
    answers: list[Answer] = [set() for _ in volumes]
    with duckdb.connect(target) as connection:
        rows = [row_of(number, volume) for number, volume in enumerate(volumes)]
        numbers = ", ".join(f"{name} DOUBLE" for name in rows[0] if name not in ("volume_no", "half_spaces"))
        connection.execute(f"CREATE TEMP TABLE asked (volume_no INTEGER, half_spaces DOUBLE[], {numbers})")
        places = ", ".join("?" * len(rows[0]))
        connection.executemany(f"INSERT INTO asked VALUES ({places})", [list(row.values()) for row in rows])  # noqa: S608
        question = f"SELECT volume_no, path, {element} FROM {level}s_in_{kind}('asked')"  # noqa: S608
        for number, path, no in connection.execute(question).fetchall():
            assert (path, no) not in answers[number]
            answers[number].add((path, no))
    return answers


def in_process(filled: Filled, level: str, volumes: Sequence[Volume], kind: int) -> list[Answer]:
    answers: list[Answer] = [set() for _ in volumes]
    columns = (c.tolist() for c in filled.indexes[kind].in_volumes(volumes, level))
    for number, occurrence, no in zip(*columns, strict=True):
        answers[number].add((filled.paths[occurrence], no))
    return answers


@pytest.mark.parametrize("level", LEVELS)
def test_boxes_that_only_just_reach_a_side(filled: Filled, level: str) -> None:
    oracle, rng = filled.oracle, np.random.default_rng(1)
    some = rng.choice(len(oracle.key[level]), 40, replace=False)
    sides = oracle.low[level][some], oracle.high[level][some]
    boxes = [box for sign in (-1.0, 1.0) for box in beside_sides(*sides, rng, sign)]
    expected = [oracle.in_box(box, level) for box in boxes]
    reached = [oracle.key[level][i] in answer for i, answer in zip([*some, *some], expected, strict=True)]
    assert reached == [True] * 40 + [False] * 40
    assert asked(filled.target, "boxes", level, boxes) == expected
    for kind in range(len(KINDS)):
        assert in_process(filled, level, boxes, kind) == expected


BAR = np.array([200.0, 10, 3])  # half of its length, width and height
URDF = """<robot name="bar"><link name="bar"><visual><geometry><box size="0.4 0.02 0.006"/></geometry></visual></link>
</robot>"""
QUARTERS = [[], [0], [1], [2], [0, 2], [0, 1]]  # axes about which a bar is turned by 90 degrees: it lies each way


def test_a_bar_that_lies_each_way(duckdb_file: Path, tmp_path: Path) -> None:
    """Alone on its page: boxes that only just reach an end of it, and that only just do not, by every form."""
    (tmp_path / "bar.urdf").write_text(URDF)
    turns = [np.eye(3) for _ in QUARTERS]
    for number, axes in enumerate(QUARTERS):
        for axis in axes:
            turns[number] = np.round(rotation_matrix(np.eye(3)[axis] * np.pi / 2)) @ turns[number]
    boxes, wanted = [], []
    for number, turn in enumerate(turns):
        half, middle = np.abs(turn) @ BAR, np.array([0, 1000.0 * number, 0])
        for end in (-1, 1):
            for axis in range(3):
                for sign in (-1, 1):
                    at = middle + end * np.eye(3)[axis] * (half[axis] + 1 + sign * STEP)
                    boxes.append(Box(*(at - 1), *(at + 1)))
                    wanted += [{(f"{number}/bar/bar", -1)}] if sign < 0 else [set()]
    with Store.open(duckdb_file) as store:
        load(store, tmp_path / "bar.urdf", name="bar")
        places = {f"{i}": pose_of([0, 1000.0 * i, 0], turn) for i, turn in enumerate(turns)}
        place_things(store, tmp_path, places, "bar")
        found = in_volumes(store, boxes)
        with store.read() as connection:
            export_parts(store, connection, tmp_path / "parts")
    write_questions([*boxes], tmp_path)
    of_files = [row for row in duckdb_rows(tmp_path) if row[0] < len(boxes)]
    for rows in (zip(found["volume_no"], found["path"], strict=True), ((row[0], row[3]) for row in of_files)):
        answers: list[Answer] = [set() for _ in boxes]
        for number, path in rows:
            answers[number].add((path, -1))
        assert answers == wanted
    for kind in ("boxes", "volumes"):
        assert asked(str(duckdb_file), kind, "part", boxes) == wanted


@pytest.mark.parametrize("level", LEVELS)
def test_balls_and_turned_boxes_that_only_just_reach_a_corner(filled: Filled, level: str) -> None:
    oracle, rng = filled.oracle, np.random.default_rng(2)
    some = rng.choice(thick(oracle.corners[level]), 40, replace=False)
    corners = oracle.corners[level][some]
    volumes = [volume for sign in (-1.0, 1.0) for volume in beside_corners(corners, rng, sign)]
    expected = [oracle.in_solid(volume, level) for volume in volumes]
    reached = [oracle.key[level][i] in answer for i, answer in zip([*some, *some], expected, strict=True)]
    assert sum(reached[:40]) > 33
    assert not any(reached[40:])
    assert asked(filled.target, "volumes", level, volumes) == expected
    assert in_process(filled, level, volumes, 0) == expected
