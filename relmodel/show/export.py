"""Loaded objects as files for other programs: GLB with shared geometry, and tables as Parquet or CSV."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from sqlalchemy import Connection

from relmodel.errors import InputError, UsageError
from relmodel.geometry.transforms import inverse, matrix_columns
from relmodel.paths import check_writable
from relmodel.progress import Progress, silent
from relmodel.show.tree import Tree
from relmodel.store import Store

_METRES = 1e-3  # GLB is in metres
_PLAIN = "#b0b4b8"  # of parts without a colour


def export_glb(store: Store, connection: Connection, tree: Tree, path: Path, progress: Progress = silent) -> None:
    """Write the tree as GLB: a node an object or part, each shape once, however often it is placed; metres.

    Parts that share a shape in unlike colours have a geometry each, since GLB colours geometry.  Raises UsageError for
    a tree without parts, InputError where the file cannot be written.
    """
    import trimesh

    check_writable(path, "file")
    scene = trimesh.Scene(base_frame="world")
    shapes = [int(s) for s in np.unique(tree.shape_id[tree.shape_id >= 0])]
    if not shapes:
        raise UsageError(f"{tree.name} has no geometry to write as GLB")
    parts = store.rows(
        connection, "object/parts", part_ids=[int(i) for i in np.unique(tree.part_id[tree.part_id >= 0])]
    )
    painted: dict[tuple[int, str], str] = {}
    for p in parts:
        painted.setdefault((int(p.shape_id), p.colour or _PLAIN), f"{p.number} {p.shape_id} {p.colour or ''}".rstrip())
    names = {int(p.id): painted[int(p.shape_id), p.colour or _PLAIN] for p in parts}
    colours: dict[int, list[str]] = {}
    for shape, colour in painted:
        colours.setdefault(shape, []).append(colour)
    for done, row in enumerate(store.rows(connection, "scene_meshes", shape_ids=shapes)):
        progress(f"{path.name}: shapes", done, len(shapes))
        mesh = trimesh.Trimesh(
            np.reshape(row.vertices, (-1, 3)) * _METRES, np.reshape(row.triangles, (-1, 3)), process=False
        )
        for rgb in colours[int(row.shape_id)]:
            base = [*(int(rgb[i : i + 2], 16) for i in (1, 3, 5)), 255]
            one = mesh.copy()
            one.visual = trimesh.visual.TextureVisuals(
                material=trimesh.visual.material.PBRMaterial(
                    baseColorFactor=base, metallicFactor=0.3, roughnessFactor=0.6
                )
            )
            scene.geometry[painted[int(row.shape_id), rgb]] = one
    pose = tree.pose.copy()
    pose[:, :3, 3] *= _METRES
    row_of = {p: i for i, p in enumerate(tree.path)}
    for i, name in enumerate(tree.path):
        parent = name.rpartition("/")[0]
        above = row_of.get(parent)
        local = pose[i] if above is None else inverse(pose[above]) @ pose[i]
        geometry = names.get(int(tree.part_id[i]))
        scene.graph.update(
            frame_to=name,
            frame_from=parent if above is not None else "world",
            matrix=local,
            geometry=geometry if geometry in scene.geometry else None,
        )
    progress(f"{path.name}: writing", len(shapes), len(shapes))
    path.write_bytes(scene.export(file_type="glb"))


def export_tables(
    store: Store, connection: Connection, tree: Tree, folder: Path, form: str, progress: Progress = silent
) -> list[Path]:
    """Write placed parts, parts, features, surfaces and arcs as files of `form` (parquet or csv); returns them.

    In CSV no text is left that a spreadsheet would take for a formula.  Raises UsageError for another form, InputError
    where the folder cannot be made.
    """
    import pyarrow as pa
    from pyarrow import csv, parquet

    if form not in ("parquet", "csv"):
        raise UsageError(f"there is no table format {form}: name parquet or csv")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"the folder {folder} cannot be made ({error.strerror}): name another place") from error
    placed = np.flatnonzero(tree.part_id >= 0)
    part_ids = [int(i) for i in np.unique(tree.part_id[placed])]
    shape_ids = [int(i) for i in np.unique(tree.shape_id[placed])]
    tables: dict[str, Mapping[str, Any]] = {
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
    files = []
    for done, (name, columns) in enumerate(tables.items()):
        progress(f"{name}.{form}", done, len(tables))
        table = pa.table({c: pa.array(v, from_pandas=True) for c, v in columns.items()})
        file = folder / f"{name}.{form}"
        if form == "parquet":
            parquet.write_table(table, file)
        else:
            csv.write_csv(_without_formulas(table), file)
        files.append(file)
    return files


def _without_formulas(table: Any) -> Any:
    """An Arrow table with an apostrophe before text that a spreadsheet would take for a formula."""
    import pyarrow as pa
    from pyarrow import compute

    for number, field in enumerate(table.schema):
        if pa.types.is_string(field.type):
            texts = compute.replace_substring_regex(table.column(number), r"\A([=+\-@\t\r\n])", r"'\1")
            table = table.set_column(number, field.name, texts)
    return table
