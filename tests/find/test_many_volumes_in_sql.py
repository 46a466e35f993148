"""What is asked in SQL, on both engines: tables of boxes and volumes, against what Python answers (which brute force
checks), and the parts within a box and nearest to a point, against brute force."""

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


def test_parts_within_a_box_and_nearest_to_a_point(fresh_store: str, tmp_path: Path) -> None:
    with Store.open(fresh_store) as store:
        oracle = fill(store, tmp_path)
        paths = np.array([path for path, _ in oracle.key["part"]])
        low, high = oracle.low["part"], oracle.high["part"]
        rng, counts = np.random.default_rng(9), [1, 7, 40, len(paths) + 5]
        with store.engine.connect() as connection:
            within = sa.text("SELECT path FROM parts_within_box(:x0, :y0, :z0, :x1, :y1, :z1) ORDER BY path")
            held = 0
            for box in random_boxes(oracle, 20, 8):
                bounds = box.bounds + np.repeat([-200.0, 200.0], 3)
                asked = dict(zip(_NUMBERS[:6], bounds.tolist(), strict=True))
                truth = paths[(low >= bounds[:3]).all(axis=1) & (high <= bounds[3:]).all(axis=1)].tolist()
                assert connection.execute(within, asked).scalars().all() == sorted(truth)
                held += len(truth)
            assert 20 < held < 20 * len(paths)
            near = sa.text("SELECT path, distance_mm FROM nearest_parts(:x, :y, :z, :count) ORDER BY distance_mm")
            for number, at in enumerate(np.concatenate([rng.uniform(low.min(0), high.max(0), (11, 3)), [[9e4, 0, 0]]])):
                away = np.linalg.norm(np.maximum(np.maximum(low - at, at - high), 0), axis=1)
                count = counts[number % len(counts)]
                rows = connection.execute(
                    near, {**dict(zip("xyz", at.tolist(), strict=True)), "count": count}
                ).fetchall()
                assert np.abs([row[1] for row in rows] - np.sort(away)[:count]).max() < 1e-9
                own = dict(zip(paths.tolist(), away.tolist(), strict=True))
                assert all(abs(own[path] - distance) < 1e-9 for path, distance in rows)
                assert len({path for path, _ in rows}) == min(count, len(paths))
            none = "SELECT count(*) FROM nearest_parts(0, 0, 0, 3, 'no such world')"
            assert connection.execute(sa.text(none)).scalar_one() == 0
