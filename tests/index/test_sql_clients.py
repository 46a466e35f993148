"""The volume questions as any client asks them: through the DuckDB and psycopg clients, without relmodel's Python."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from relmodel.index.find import LEVELS, in_volume
from relmodel.index.volumes import Box, Frustum, Sphere, Volume
from relmodel.store import Ragged, Store
from tests.index.test_find import fill, random_boxes, random_solids, random_views


def rows_of(target: str, statements: list[str]) -> list[list[tuple[Any, ...]]]:
    if target.startswith("postgresql"):
        import psycopg

        with psycopg.connect(target.replace("+psycopg", "")) as connection:
            return [connection.execute(statement.encode()).fetchall() for statement in statements]
    import duckdb

    with duckdb.connect(target, read_only=True) as file:
        return [file.execute(statement).fetchall() for statement in statements]


@pytest.mark.parametrize("level", LEVELS)
def test_clients_get_the_rows_of_find(fresh_store: str, tmp_path: Path, level: str) -> None:
    with Store.open(fresh_store) as store:
        oracle = fill(store, tmp_path)
        spheres = [v for v in random_solids(oracle, 20, 20) if isinstance(v, Sphere) and v.radius]
        views = random_views(20, 21)
        volumes: list[Volume] = [*random_boxes(oracle, 5, 22), *spheres, *views]
        camera = {"width": 640, "height": 480, "fx": 900.0, "fy": 900.0, "cx": 319.5, "cy": 239.5, "skew": 0.0}
        with store.write() as connection:
            camera_id = int(store.new_ids(connection, "camera", 1)[0])
            lens: dict[str, Any] = {
                "content_key": "c",
                "distortion_model": "opencv",
                "distortion": Ragged.pack([[0.0]]),
            }
            store.append(connection, "camera", {"id": [camera_id], **camera, **lens})
        found = [in_volume(store, volume, level=level) for volume in volumes]

    def call(volume: Volume) -> str:
        if isinstance(volume, Frustum):
            numbers = [camera_id, *volume.world_from_camera[:3].ravel().tolist(), volume.near, volume.far]
            kind = "view"
        elif isinstance(volume, Sphere):
            kind, numbers = "sphere", np.asarray(volume.ball).tolist()
        else:
            kind, numbers = "box", volume.bounds.tolist()
        values = ", ".join(
            f"CAST({number!r} AS {'BIGINT' if number is camera_id else 'DOUBLE PRECISION'})" for number in numbers
        )
        element = "-1" if level == "part" else f"{level}_no"
        return f"SELECT occurrence_id, {element}, path, name, x0, y1 FROM {level}s_in_{kind}({values}) ORDER BY 1, 2"  # noqa: S608

    answers = rows_of(fresh_store, [call(volume) for volume in volumes])
    assert sum(bool(answer) for answer in answers) > 5
    for volume, expected, answer in zip(volumes, found, answers, strict=True):
        wanted = ("occurrence_id", "element_no", "path", "name", "x0", "y1")
        assert answer == list(zip(*(expected[name].tolist() for name in wanted), strict=True)), volume
    assert any(isinstance(v, Box) for v in volumes)
