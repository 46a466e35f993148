"""Tables of the store as files for other programs: Parquet or CSV."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from sqlalchemy import Connection

from relmodel.app.show.tree import Tree
from relmodel.errors import InputError, UsageError
from relmodel.geometry.transforms import matrix_columns
from relmodel.progress import Progress, silent
from relmodel.store import Store

if TYPE_CHECKING:
    import pyarrow as pa

FORMS = ("parquet", "csv")


def read_tables(store: Store, connection: Connection, tree: Tree) -> dict[str, pa.Table]:
    """Placed parts, parts, features, surfaces and arcs of an object, by name of the table."""
    import pyarrow as pa

    placed = np.flatnonzero(tree.part_id >= 0)
    part_ids = [int(i) for i in np.unique(tree.part_id[placed])]
    shape_ids = [int(i) for i in np.unique(tree.shape_id[placed])]
    columns: dict[str, Mapping[str, Any]] = {
        "placed_part": {
            "path": [tree.path[i] for i in placed.tolist()],
            "part_id": tree.part_id[placed],
            "shape_id": tree.shape_id[placed],
            **matrix_columns(tree.pose[placed]),
        },
        "part": store.columns(connection, "object/parts", part_ids=part_ids),
        "feature": store.columns(connection, "object/export_features", shape_ids=shape_ids),
        "surface": store.columns(connection, "object/export_surfaces", shape_ids=shape_ids),
        "arc": store.columns(connection, "object/export_arcs", shape_ids=shape_ids),
    }
    return {
        name: pa.table({c: pa.array(v, from_pandas=True) for c, v in table.items()}) for name, table in columns.items()
    }


def write_tables(tables: Mapping[str, pa.Table], folder: Path, form: str, progress: Progress = silent) -> list[Path]:
    """Write a file of `form` (parquet or csv) a table into a folder, which is made; returns the files.

    In CSV no text is left that a spreadsheet would take for a formula, and lists are JSON.  Raises UsageError for
    another form, InputError where the folder cannot be made.
    """
    from pyarrow import csv, parquet

    if form not in FORMS:
        raise UsageError(f"there is no table format {form}: name parquet or csv")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"the folder {folder} cannot be made ({error.strerror}): name another place") from error
    files = []
    for done, (name, table) in enumerate(tables.items()):
        progress(f"{name}.{form}", done, len(tables))
        file = folder / f"{name}.{form}"
        if form == "parquet":
            parquet.write_table(table, file)
        else:
            csv.write_csv(_as_text(table), file)
        files.append(file)
    return files


def _as_text(table: pa.Table) -> pa.Table:
    """A table that CSV can hold: lists as JSON, and an apostrophe before text that a spreadsheet would take for a
    formula."""
    import json

    import pyarrow as pa
    from pyarrow import compute

    for number, field in enumerate(table.schema):
        column = table.column(number)
        if pa.types.is_list(field.type):
            lists = [None if value is None else json.dumps(value) for value in column.to_pylist()]
            table = table.set_column(number, field.name, pa.array(lists, pa.string()))
        elif pa.types.is_string(field.type):
            texts = compute.replace_substring_regex(column, r"\A([=+\-@\t\r\n])", r"'\1")
            table = table.set_column(number, field.name, texts)
    return table
