"""What is asked in SQL, on both engines: tables of boxes and volumes, against what Python answers (which brute force
checks), and the parts and features within a box and nearest to a
point, against brute force."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
import sqlalchemy as sa

from relmodel.find.find import LEVELS, in_volumes
from relmodel.find.volumes import Volume
from relmodel.store import Store
from tests.find.test_find import random_boxes, random_solids, random_views
from tests.given import CopyStore

if TYPE_CHECKING:
    from tests.find.conftest import Filled


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


def test_tables_of_volumes(filled: Filled) -> None:
    oracle = filled.oracle
    with Store.open(filled.target) as store:
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


@pytest.mark.parametrize("level", ["part", "feature"])
def test_within_a_box_and_nearest_to_a_point(filled: Filled, level: str) -> None:
    oracle = filled.oracle
    with Store.open(filled.target) as store:
        low, high = oracle.low[level], oracle.high[level]
        rng, counts = np.random.default_rng(9), [1, 7, 40, len(low) + 5]
        names = "path, -1" if level == "part" else "path, feature_no"
        with store.engine.connect() as connection:
            within = sa.text(f"SELECT {names} FROM {level}s_within_box(:x0, :y0, :z0, :x1, :y1, :z1)")  # noqa: S608
            held = 0
            for box in random_boxes(oracle, 4, 8):
                bounds = box.bounds + np.repeat([-200.0, 200.0], 3)
                asked = dict(zip(_NUMBERS[:6], bounds.tolist(), strict=True))
                truth = oracle.within_box(level, bounds)
                assert sorted(map(tuple, connection.execute(within, asked).fetchall())) == sorted(truth)
                held += len(truth)
            assert 20 < held < 4 * len(low)
            near = sa.text(f"SELECT {names}, distance_mm FROM nearest_{level}s(:x, :y, :z, :count)")  # noqa: S608
            for number, at in enumerate(np.concatenate([rng.uniform(low.min(0), high.max(0), (3, 3)), [[9e4, 0, 0]]])):
                away = oracle.away(level, at)
                count = counts[number % len(counts)]
                asked = {**dict(zip("xyz", at.tolist(), strict=True)), "count": count}
                rows = connection.execute(near, asked).fetchall()
                assert np.abs([row[2] for row in rows] - np.sort(away)[:count]).max() < 1e-9
                known = dict(zip(oracle.key[level], away.tolist(), strict=True))
                assert all(abs(known[path, element] - distance) < 1e-9 for path, element, distance in rows)
                assert len({row[:2] for row in rows}) == min(count, len(low))
            none = f"SELECT count(*) FROM nearest_{level}s(0, 0, 0, 3, 'no such world')"  # noqa: S608
            assert connection.execute(sa.text(none)).scalar_one() == 0


_CROWD = """
INSERT INTO object_node
SELECT n.object_id, 100000 + g.i, n.parent_no, n.body_no, concat(n.path, '/', g.i), n.child_id, n.part_id, n.shape_id,
    n.m00, n.m01, n.m02, n.m03, n.m10, n.m11, n.m12, n.m13, n.m20, n.m21, n.m22, n.m23,
    9999, n.x0, n.y0, n.z0, n.x1, n.y1, n.z1
FROM object_node AS n CROSS JOIN generate_series(1, 1200) AS g (i)
WHERE n.object_id = :object_id AND n.node_no = :node_no
"""
_CROWDED_PAGE = """
INSERT INTO object_page (object_id, page, body_no, box_count, x0, y0, z0, x1, y1, z1)
SELECT DISTINCT object_id, page, body_no, 1200, x0, y0, z0, x1, y1, z1 FROM object_node WHERE page = 9999"""


def test_nearest_features_past_a_crowd_of_parts_without_any(filled: Filled, copy_store: CopyStore) -> None:
    oracle = filled.oracle
    with Store.open(copy_store(filled.target)) as store:
        paths = {path for path, _ in oracle.key["feature"] if path.startswith("a/")}
        with store.engine.begin() as connection:

            def run(statement: str, **values: Any) -> Any:
                return connection.execute(sa.text(statement), values)

            own = run("SELECT path, shape_id FROM occurrence").fetchall()
            kept = next(row.shape_id for row in own if row.path == min(paths))
            run("DELETE FROM feature WHERE shape_id <> :kept", kept=kept)
            node = run(
                "SELECT * FROM object_node WHERE part_id IS NOT NULL AND shape_id <> :kept ORDER BY node_no", kept=kept
            ).first()
            run(_CROWD, object_id=node.object_id, node_no=node.node_no)
            run(_CROWDED_PAGE)
            at = np.array([node.x0 + node.x1, node.y0 + node.y1, node.z0 + node.z1]) / 2
            rows = run(
                "SELECT path, distance_mm FROM nearest_features(:x, :y, :z, 3)", **dict(zip("xyz", at, strict=True))
            )
            with_any = {row.path for row in own if row.shape_id == kept}
            away = oracle.away("feature", at)[[path in with_any for path, _ in oracle.key["feature"]]]
            assert np.abs([row.distance_mm for row in rows] - np.sort(away)[:3]).max() < 1e-9
