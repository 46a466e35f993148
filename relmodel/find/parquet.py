"""Placed parts as Parquet files, and volumes as tables, for engines that take a volume query to many machines.

`queries/parquet/find_in_volumes.sql` asks the files as it stands on DuckDB and Spark SQL.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from relmodel.errors import UsageError
from relmodel.find.find import BOX_COLUMNS, LEVELS, world_named
from relmodel.find.volumes import Volume
from relmodel.geometry.transforms import MATRIX_COLUMNS
from relmodel.store import Store

if TYPE_CHECKING:
    import pyarrow as pa
    from sqlalchemy import Connection

# With 64 parts a page: about 65,000 parts, some 10 MB, a file.
PAGES_PER_RANGE = 1024
# Parts in a row group: what a reader skips by the bounds that Parquet keeps of each column.
_ROW_GROUP = 4096

_BOX = dict.fromkeys(BOX_COLUMNS, "double")
_WORLD = {"world_id": "int64", "name": "string", "revision": "int32"}
_PAGE = {"world_id": "int64", "page_range": "int32", "page": "int32", "box_count": "int32", **_BOX}
_OCCURRENCE = {"page": "int32", "occurrence_id": "int64", "path": "string", "name": "string", "shape_id": "int64"}
_OCCURRENCE |= _BOX | dict.fromkeys(MATRIX_COLUMNS, "double")
_ELEMENT = {"shape_id": "int64", "level": "string", "element_no": "int32", "name": "string", **_BOX}
_BALL = ("ball_x", "ball_y", "ball_z", "ball_radius")
_ASKED = {"volume_no": "int32", "level": "string", **_BOX, **dict.fromkeys(_BALL, "double")}
_HALF_SPACE = {"volume_no": "int32", **dict.fromkeys(("nx", "ny", "nz", "d"), "double")}


def export_parts(
    store: Store,
    connection: Connection,
    folder: str | Path,
    world: str | None = None,
    *,
    pages_per_range: int = PAGES_PER_RANGE,
) -> int:
    """Write the placed parts of the newest revision of a world, or of every world; returns how many.

    `folder` gets four folders: occurrence, in folders world_id=W/page_range=R that hold `pages_per_range` pages each;
    page, the pages' boxes; element, the boxes of shapes, features, surfaces and arcs in the shapes' frames; and world.
    One page range is in memory at a time.  Raises UsageError where the world is unknown, nothing is placed, or the
    folder holds something.
    """
    folder = Path(folder)
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise UsageError(f"{folder} is there and not empty: name a new folder")
    if world is not None:
        world_named(store, connection, world)
    worlds = [row for row in store.rows(connection, "current_worlds") if world in (None, row.name)]
    ids = [int(row.world_id) for row in worlds]
    pages = {i: store.columns(connection, "parquet/pages", world_id=i) for i in ids}
    if not any(len(columns["page"]) for columns in pages.values()):
        raise UsageError("no part is placed: place the objects with relmodel world FILE")
    _write(folder / "world/world.parquet", _WORLD, {
        "world_id": ids, "name": [row.name for row in worlds], "revision": [row.revision for row in worlds]
    })  # fmt: skip
    _write(folder / "element/element.parquet", _ELEMENT, store.columns(connection, "parquet/elements", world_ids=ids))
    parts = 0
    for world_id, columns in pages.items():
        page = columns["page"].astype(np.int64)
        page_range = page // pages_per_range
        _write(
            folder / f"page/world_{world_id}.parquet",
            _PAGE,
            {"world_id": np.full(len(page), world_id), "page_range": page_range, **columns},
        )
        for number in np.unique(page_range).tolist():
            bounds = {"first_page": number * pages_per_range, "last_page": (number + 1) * pages_per_range - 1}
            rows = store.columns(connection, "parquet/occurrences", world_id=world_id, **bounds)
            _write(folder / f"occurrence/world_id={world_id}/page_range={number}/occurrence.parquet", _OCCURRENCE, rows)
            parts += len(rows["page"])
    return parts


def volume_tables(volumes: Sequence[Volume], level: str = "part") -> tuple[pa.Table, pa.Table]:
    """The tables `asked` and `asked_half_space` of the query, for volumes asked at one level."""
    if level not in LEVELS:
        raise UsageError(f"there is no level {level!r}: use one of {', '.join(LEVELS)}")
    bounds = np.array([volume.bounds for volume in volumes]).reshape(-1, 6)
    ball = np.array([np.full(4, np.nan) if v.ball is None else v.ball for v in volumes]).reshape(-1, 4)
    columns = dict(zip(BOX_COLUMNS + _BALL, np.concatenate([bounds, ball], axis=1).T, strict=True))
    planes = np.concatenate([np.empty((0, 4)), *(volume.planes for volume in volumes)])
    number = np.repeat(np.arange(len(volumes)), [len(volume.planes) for volume in volumes])
    return (
        _table(_ASKED, {"volume_no": np.arange(len(volumes)), "level": [level] * len(volumes), **columns}),
        _table(_HALF_SPACE, {"volume_no": number, **dict(zip(("nx", "ny", "nz", "d"), planes.T, strict=True))}),
    )


def _table(types: Mapping[str, str], columns: Mapping[str, Any]) -> pa.Table:
    """Columns as a table of just these types, in this order; NaN is null."""
    import pyarrow as pa

    schema = pa.schema([(name, pa.type_for_alias(kind)) for name, kind in types.items()])
    return pa.table([pa.array(columns[name], schema.field(name).type, from_pandas=True) for name in types], schema)


def _write(file: Path, types: Mapping[str, str], columns: Mapping[str, Any]) -> None:
    from pyarrow import parquet

    file.parent.mkdir(parents=True, exist_ok=True)
    parquet.write_table(_table(types, columns), file, row_group_size=_ROW_GROUP)
