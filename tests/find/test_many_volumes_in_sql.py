"""Tables of boxes and volumes asked in SQL, on both engines, against what Python answers (which brute force checks)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import sqlalchemy as sa

from relmodel.find.find import LEVELS, in_volumes
from relmodel.find.volumes import Volume
from relmodel.store import Store
from tests.find.test_find import fill, random_boxes, random_solids, random_views

_NUMBERS = ("x0", "y0", "z0", "x1", "y1", "z1", "ball_x", "ball_y", "ball_z", "ball_radius")
_COLUMNS = ", ".join(
    ["volume_no INTEGER", *(f"{name} DOUBLE PRECISION" for name in _NUMBERS), "half_spaces DOUBLE PRECISION[]"]
)


def row_of(number: int, volume: Volume) -> dict[str, Any]:
    ball = [None] * 4 if volume.ball is None else volume.ball.tolist()
    planes = volume.planes.ravel().tolist() or None
    return {
        "volume_no": number,
        "half_spaces": planes,
        **dict(zip(_NUMBERS, [*volume.bounds.tolist(), *ball], strict=True)),
    }


def test_tables_of_volumes(fresh_store: str, tmp_path: Path) -> None:
    with Store.open(fresh_store) as store:
        oracle = fill(store, tmp_path)
        boxes: list[Volume] = [*random_boxes(oracle, 30, 3)]
        volumes: list[Volume] = [*boxes[:4], *random_solids(oracle, 16, 4), *random_views(10, 5)]
        with store.engine.connect() as connection:
            connection.execute(sa.text(f"CREATE TEMP TABLE asked ({_COLUMNS})"))
            insert = sa.text(
                "INSERT INTO asked VALUES (:volume_no, :x0, :y0, :z0, :x1, :y1, :z1, :ball_x, :ball_y, :ball_z, "
                ":ball_radius, CAST(:half_spaces AS DOUBLE PRECISION[]))"
            )
            for kind, asked in (("boxes", boxes), ("volumes", volumes)):
                connection.execute(sa.text("DELETE FROM asked"))
                for number, volume in enumerate(asked):
                    connection.execute(insert, row_of(number, volume))
                for level in LEVELS:
                    element = "-1" if level == "part" else f"{level}_no"
                    columns = f"volume_no, occurrence_id, {element}, path, name, x0, y0, z0, x1, y1, z1"
                    question = f"SELECT {columns} FROM {level}s_in_{kind}('asked') ORDER BY 1, 2, 3"  # noqa: S608
                    rows = connection.execute(sa.text(question)).fetchall()
                    truth = in_volumes(store, asked, level=level)
                    names = ("volume_no", "occurrence_id", "element_no", "path", "name")
                    wanted = list(zip(*(truth[name].tolist() for name in names), strict=True))
                    assert [tuple(row[:5]) for row in rows] == wanted
                    assert len(rows) > 20
                    found = np.array([row[5:] for row in rows], float)
                    given = np.stack([truth[n] for n in ("x0", "y0", "z0", "x1", "y1", "z1")], axis=1).astype(float)
                    assert np.abs(found - given).max() < 1e-9
            none = "SELECT count(*) FROM parts_in_boxes('asked', 'no such world')"
            assert connection.execute(sa.text(none)).scalar_one() == 0
