"""Placed parts of stores as Parquet, and volumes as tables, for engines that take a volume query to many machines.

`queries/parquet/find_in_volumes.sql` asks the files as it stands on DuckDB and Spark SQL.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from shutil import rmtree
from tempfile import TemporaryDirectory
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

TABLES = ("world", "page", "element", "occurrence")
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

    `folder` gets a folder for each of `TABLES`, and in it store_id=S: world; page, the pages' boxes; element, the boxes
    of shapes, features, surfaces and arcs in the shapes' frames; and occurrence, in folders world_id=W/page_range=R of
    `pages_per_range` pages each.  What it holds of other stores stays, what it holds of this one is replaced when all
    is written.  One page range is in memory at a time.  Raises UsageError where the world is unknown, nothing is
    placed, or the folder holds something else.
    """
    folder = Path(folder)
    if not _takes_exports(folder):
        raise UsageError(
            f"{folder} holds something else than placed parts of stores: name another folder, or a new one"
        )
    if world is not None:
        world_named(store, connection, world)
    worlds = [row for row in store.rows(connection, "world/current") if world in (None, row.name)]
    ids = [int(row.world_id) for row in worlds]
    pages = {i: store.columns(connection, "parquet/pages", world_id=i) for i in ids}
    if not any(len(columns["page"]) for columns in pages.values()):
        raise UsageError("no part is placed: place the objects with relmodel world FILE")
    identity = store.rows(connection, "store/identity")[0]
    folder.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory(prefix=".", dir=folder) as name:
        new = Path(name)

        def write(file: str, types: Mapping[str, str], columns: Mapping[str, Any]) -> int:
            """Write rows of a table; returns how many."""
            count = len(next(iter(columns.values())))
            _write(new / file, {"cell": "string", **types}, {"cell": [identity.cell] * count, **columns})
            return count

        write("world/world.parquet", _WORLD, {
            "world_id": ids, "name": [row.name for row in worlds], "revision": [row.revision for row in worlds]
        })  # fmt: skip
        write("element/element.parquet", _ELEMENT, store.columns(connection, "parquet/elements", world_ids=ids))
        parts = 0
        for world_id, columns in pages.items():
            page_range = columns["page"].astype(np.int64) // pages_per_range
            numbers = np.full(len(page_range), world_id)
            write(f"page/world_{world_id}.parquet", _PAGE, {"world_id": numbers, "page_range": page_range, **columns})
            for number in np.unique(page_range).tolist():
                bounds = {"first_page": number * pages_per_range, "last_page": (number + 1) * pages_per_range - 1}
                rows = store.columns(connection, "parquet/occurrences", world_id=world_id, **bounds)
                file = f"occurrence/world_id={world_id}/page_range={number}/occurrence.parquet"
                parts += write(file, _OCCURRENCE, rows)
        for table in TABLES:
            own = folder / table / f"store_id={identity.store_id}"
            own.parent.mkdir(exist_ok=True)
            if own.exists():
                rmtree(own)
            (new / table).rename(own)
    return parts


def _takes_exports(folder: Path) -> bool:
    """Whether a folder is not there, or holds nothing but placed parts of stores; hidden files are of no matter."""
    if not folder.exists():
        return True
    held = [file for file in folder.iterdir() if not file.name.startswith(".")] if folder.is_dir() else [folder]
    inner = [file.name for table in held if table.is_dir() for file in table.iterdir()]
    return {file.name for file in held} <= set(TABLES) and all(name.startswith("store_id=") for name in inner)


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
