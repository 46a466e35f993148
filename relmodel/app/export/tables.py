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
from relmodel.printing import json_text
from relmodel.progress import Progress, silent
from relmodel.store import Store

if TYPE_CHECKING:
    import pyarrow as pa

FORMS = ("parquet", "csv")


def read_tables(store: Store, connection: Connection, tree: Tree) -> dict[str, pa.Table]:
    """Placed parts, parts, features, surfaces and arcs of an object, by name of the table; rows say of which store."""
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
    tables = {
        name: pa.table({c: pa.array(v, from_pandas=True) for c, v in table.items()}) for name, table in columns.items()
    }
    return of_store(store, connection, tables)


def of_store(
    store: Store, connection: Connection, tables: Mapping[str, pa.Table], **others: object
) -> dict[str, pa.Table]:
    """Tables whose every row carries store_id and cell, and the values of the `others`, where it does not already."""
    import pyarrow as pa

    carried = {**store.rows(connection, "store/identity")[0]._mapping, **others}
    out = {}
    for name, table in tables.items():
        for column, value in carried.items():
            if column not in table.column_names:
                table = table.append_column(column, pa.repeat(value, len(table)))
        out[name] = table
    return out


def write_tables(tables: Mapping[str, pa.Table], folder: Path, form: str, progress: Progress = silent) -> list[Path]:
    """Write a file of `form` (parquet or csv) a table into a folder, which is made; returns the files.

    In CSV no text is left that a spreadsheet would take for a formula, and lists are JSON.  Files that are there are
    replaced.  Raises UsageError for another form, or where they are of another store, InputError where the folder
    cannot be made.
    """
    from pyarrow import csv, parquet

    if form not in FORMS:
        raise UsageError(f"there is no table format {form}: name parquet or csv")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"the folder {folder} cannot be made ({error.strerror}): name another place") from error
    first = next(iter(tables))
    if not _stores_in(folder / f"{first}.{form}", form) <= set(tables[first]["store_id"].to_pylist()):
        raise UsageError(f"{folder} holds tables of another store: name another folder")
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


def _stores_in(file: Path, form: str) -> set[str | None]:
    """The stores whose rows a file holds; None is one where it holds others."""
    import pyarrow as pa
    from pyarrow import dataset

    try:
        return set(dataset.dataset(file, format=form).to_table(columns=["store_id"])["store_id"].to_pylist())
    except FileNotFoundError:
        return set()
    except pa.ArrowInvalid:
        return {None}


def _as_text(table: pa.Table) -> pa.Table:
    """A table that CSV can hold: lists as JSON, and an apostrophe before text that a spreadsheet would take for a
    formula."""
    import pyarrow as pa
    from pyarrow import compute

    for number, field in enumerate(table.schema):
        column = table.column(number)
        if pa.types.is_list(field.type):
            lists = [None if value is None else json_text(value) for value in column.to_pylist()]
            table = table.set_column(number, field.name, pa.array(lists, pa.string()))
        elif pa.types.is_string(field.type):
            texts = compute.replace_substring_regex(column, r"\A([=+\-@\t\r\n])", r"'\1")
            table = table.set_column(number, field.name, texts)
    return table
