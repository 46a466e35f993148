"""What an object is, or an inspection found, as files; the ending of the name says in which form."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pyarrow as pa
from sqlalchemy import Connection

from relmodel.app.export.glb import export_glb
from relmodel.app.export.qif import write_qif
from relmodel.app.export.results import write_json, write_scene
from relmodel.app.export.tables import read_tables, write_tables
from relmodel.app.show.tree import read_tree
from relmodel.errors import UsageError
from relmodel.progress import Progress, silent
from relmodel.store import Store

# Endings of other model formats, which are not written.
_OTHER_FORMS = (".gltf", ".json", ".qif", ".xlsx", ".csv", ".parquet", ".obj", ".stl", ".ply", ".3mf", ".step", ".stp")


def export_object(
    store: Store,
    connection: Connection,
    name: str,
    variant: str,
    out: Path,
    tables: str = "parquet",
    progress: Progress = silent,
) -> list[Path]:
    """Write an object as .glb, or its tables into a folder; the files written."""
    form = _form(out, (".glb",))
    tree = read_tree(store, connection, name, variant)
    if form == ".glb":
        export_glb(store, connection, tree, out, progress)
        return [out]
    return write_tables(read_tables(store, connection, tree), out, tables, progress)


def export_run(
    store: Store,
    connection: Connection,
    results: dict[str, pa.Table],
    out: Path,
    tables: str = "parquet",
    progress: Progress = silent,
) -> list[Path]:
    """Write what an inspection found, the tables of `read_results`, as .json, .qif or .glb, or into a folder; the files
    written."""
    form = _form(out, (".glb", ".json", ".qif"))
    if form == ".json":
        write_json(results, out)
    elif form == ".qif":
        write_qif(results, out)
    elif form == ".glb":
        write_scene(store, connection, results, out, progress)
    else:
        return write_tables(results, out, tables, progress)
    return [out]


def _form(out: Path, forms: Sequence[str]) -> str:
    """The ending of a file's name.  Raises UsageError where it is of a form that is not written."""
    ending = out.suffix.lower()
    if ending in set(_OTHER_FORMS) - set(forms):
        raise UsageError(f"{out} has the suffix of another model format: use {', '.join(forms)}, or name a folder")
    return ending
