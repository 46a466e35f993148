"""Worlds of stores as Parquet, and volumes as tables, for engines that spread a query over many machines.

The files keep the two levels of the store: what is in an object once, in its own frame, and the objects as placed.
`queries/parquet/placed_parts.sql` joins the levels, `queries/parquet/find_in_volumes.sql` asks volumes; DuckDB and
Spark SQL take both as they stand."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from shutil import rmtree
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np

from relmodel.errors import UsageError
from relmodel.find.find import LEVELS, world_named
from relmodel.find.volumes import Volume
from relmodel.geometry.curves import BOX
from relmodel.geometry.transforms import MATRIX_COLUMNS
from relmodel.store import Store

if TYPE_CHECKING:
    import pyarrow as pa
    from sqlalchemy import Connection

# With 64 parts a page: about 65,000 parts, some 10 MB, a file.
PAGES_PER_RANGE = 1024
# Parts in a row group: what a reader skips by the bounds that Parquet keeps of each column.
_ROW_GROUP = 4096

TABLES = ("world", "placed_body", "object_page", "object_node", "element", "hull")
_BOX = dict.fromkeys(BOX, "double")
_POSE = dict.fromkeys(MATRIX_COLUMNS, "double")
_WORLD = {"world_id": "int64", "name": "string", "revision": "int32", "newest": "bool"}
_BODY = {"world": "string", "object_no": "int32", "body_no": "int32", "name": "string", "object_id": "int64"}
_BODY |= {"object": "string", "variant": "string", "role": "string"}
_BODY |= {"first_revision": "int32", "last_revision": "int32", **_BOX, **_POSE}
_PAGE = {"object_id": "int64", "page_range": "int32", "page": "int32", "body_no": "int32", "box_count": "int32", **_BOX}
_NODE = {"object_id": "int64", "page": "int32", "node_no": "int32", "body_no": "int32", "path": "string"}
_NODE |= {"number": "string", "name": "string", "part_id": "int64", "shape_id": "int64", **_BOX, **_POSE}
_ELEMENT = {"shape_id": "int64", "level": "string", "element_no": "int32", "name": "string", **_BOX}
_HULL = {"shape_id": "int64", **dict.fromkeys(("x", "y", "z", "beyond_mm"), "double")}
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
    """Write a world, or every world, with all its revisions; returns how many parts stand in the newest ones.

    `folder` gets a folder for each of `TABLES`, and in it store_id=S: world, its revisions; placed_body, objects and
    links as placed, with the revisions in which they stand there; object_node, the parts in each of these objects,
    once, in its own frame, in folders page_range=R of `pages_per_range` pages each; object_page, the pages' boxes;
    element, the boxes of shapes, features, surfaces and arcs in the shapes' frames; and hull, the corners of the
    shapes' convex hulls.  Rows of other stores stay; those
    of this one are replaced when everything is written.  One page range is in memory at a time.  Raises UsageError
    where the world is unknown, nothing is placed, or the folder holds something else."""
    from pyarrow import parquet

    folder = Path(folder)
    if not _takes_exports(folder):
        raise UsageError(f"{folder} holds something else than placed parts: name another folder, or a new one")
    if world is not None:
        world_named(store, connection, world)
    worlds = [row.name for row in store.rows(connection, "world/current") if world in (None, row.name)]
    bodies = store.columns(connection, "parquet/bodies", worlds=worlds)
    pages = store.columns(connection, "parquet/pages", worlds=worlds)
    parts = _count_parts(bodies, pages)
    if not parts:
        raise UsageError("no part is placed: place the objects with relmodel world FILE")
    identity = store.rows(connection, "store/identity")[0]
    folder.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory(prefix=".", dir=folder) as name:
        new = Path(name)

        def write(file: str, types: Mapping[str, str], columns: Mapping[str, Any]) -> None:
            cells = [identity.cell] * len(next(iter(columns.values())))
            table = _table({"cell": "string", **types}, {"cell": cells, **columns})
            (new / file).parent.mkdir(parents=True, exist_ok=True)
            parquet.write_table(table, new / file, row_group_size=_ROW_GROUP)

        write("world/world.parquet", _WORLD, store.columns(connection, "parquet/worlds", worlds=worlds))
        write("placed_body/placed_body.parquet", _BODY, bodies)
        write("element/element.parquet", _ELEMENT, store.columns(connection, "parquet/elements", worlds=worlds))
        write("hull/hull.parquet", _HULL, store.columns(connection, "parquet/hulls", worlds=worlds))
        page_range = np.arange(len(pages["page"])) // pages_per_range
        write("object_page/object_page.parquet", _PAGE, {"page_range": page_range, **pages})
        for number in np.unique(page_range).tolist():
            bounds = {"first_page": number * pages_per_range, "last_page": (number + 1) * pages_per_range - 1}
            rows = store.columns(connection, "parquet/nodes", worlds=worlds, **bounds)
            write(f"object_node/page_range={number}/object_node.parquet", _NODE, rows)
        for table in TABLES:
            own = folder / table / f"store_id={identity.store_id}"
            own.parent.mkdir(exist_ok=True)
            if own.exists():
                rmtree(own)
            (new / table).rename(own)
    return parts


def _count_parts(bodies: Mapping[str, Any], pages: Mapping[str, Any]) -> int:
    """How many parts stand in the newest revisions: the boxes in the pages of each body that holds there."""
    boxes: Counter[tuple[int, int]] = Counter()
    for object_id, body_no, count in zip(pages["object_id"], pages["body_no"], pages["box_count"], strict=True):
        boxes[object_id, body_no] += int(count)
    holds = np.isnan(bodies["last_revision"].astype(float))  # PostgreSQL gives objects where all are null
    return sum(boxes[key] for key in zip(bodies["object_id"][holds], bodies["body_no"][holds], strict=True))


def _takes_exports(folder: Path) -> bool:
    """Whether a folder does not exist, or contains only placed parts of stores; hidden files are ignored."""
    if not folder.exists():
        return True
    kept = [file for file in folder.iterdir() if not file.name.startswith(".")] if folder.is_dir() else [folder]
    inner = [file.name for table in kept if table.is_dir() for file in table.iterdir()]
    return {file.name for file in kept} <= set(TABLES) and all(name.startswith("store_id=") for name in inner)


def volume_tables(volumes: Sequence[Volume], level: str = "part") -> tuple[pa.Table, pa.Table]:
    """The tables `asked` and `asked_half_space` of the query, for volumes asked at one level."""
    if level not in LEVELS:
        raise UsageError(f"there is no level {level!r}: use one of {', '.join(LEVELS)}")
    bounds = np.array([volume.bounds for volume in volumes]).reshape(-1, 6)
    ball = np.array([np.full(4, np.nan) if v.ball is None else v.ball for v in volumes]).reshape(-1, 4)
    columns = dict(zip(BOX + _BALL, np.concatenate([bounds, ball], axis=1).T, strict=True))
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
