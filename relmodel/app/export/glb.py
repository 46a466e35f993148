"""Loaded objects as GLB for other programs: each shape once, however often it is placed, in metres."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from sqlalchemy import Connection

from relmodel.app.show.tree import Tree
from relmodel.arrays import Floats
from relmodel.errors import UsageError
from relmodel.geometry.transforms import inverse
from relmodel.paths import check_writable
from relmodel.progress import Progress, silent
from relmodel.store import Store

_METRES = 1e-3  # GLB is in metres
_PLAIN = "#b0b4b8"  # of parts without a colour

# A shape's identity and a colour, None where the part has none.
Painted = tuple[int, str | None]


def export_glb(store: Store, connection: Connection, tree: Tree, path: Path, progress: Progress = silent) -> None:
    """Write the tree as GLB: a node an object or part, each shape once, however often it is placed; metres.

    Parts that share a shape in unlike colours have a geometry each, since GLB colours geometry.  Raises UsageError for
    a tree without parts, InputError where the file cannot be written.
    """
    import trimesh

    check_writable(path, "file")
    if not (tree.shape_id >= 0).any():
        raise UsageError(f"{tree.name} has no geometry to write as GLB")
    parts = store.rows(
        connection, "object/parts", part_ids=[int(i) for i in np.unique(tree.part_id[tree.part_id >= 0])]
    )
    painted: dict[int, Painted] = {int(p.id): (int(p.shape_id), p.colour) for p in parts}
    names: dict[Painted, str] = {}
    for p in parts:
        names.setdefault(painted[int(p.id)], f"{p.number} {p.shape_id} {p.colour or ''}".rstrip())
    scene = trimesh.Scene(base_frame="world")
    for key, mesh in painted_meshes(store, connection, names, path.name, progress).items():
        scene.geometry[names[key]] = mesh
    row_of = {p: i for i, p in enumerate(tree.path)}
    for i, name in enumerate(tree.path):
        parent = name.rpartition("/")[0]
        above = row_of.get(parent)
        local = tree.pose[i] if above is None else inverse(tree.pose[above]) @ tree.pose[i]
        geometry = names.get(painted.get(int(tree.part_id[i]), (-1, None)))
        scene.graph.update(
            frame_to=name,
            frame_from=parent if above is not None else "world",
            matrix=in_metres(local),
            geometry=geometry if geometry in scene.geometry else None,
        )
    path.write_bytes(scene.export(file_type="glb"))


def painted_meshes(
    store: Store, connection: Connection, wanted: Iterable[Painted], what: str, progress: Progress = silent
) -> dict[Painted, Any]:
    """A mesh (trimesh, m) of each shape in each colour that it is wanted in; none of a shape without triangles."""
    import trimesh

    colours: dict[int, list[str | None]] = {}
    for shape, colour in wanted:
        colours.setdefault(shape, []).append(colour)
    found = {}
    for done, row in enumerate(store.rows(connection, "scene/meshes", shape_ids=sorted(colours))):
        progress(f"{what}: shapes", done, len(colours))
        mesh = trimesh.Trimesh(
            np.reshape(row.vertices, (-1, 3)) * _METRES, np.reshape(row.triangles, (-1, 3)), process=False
        )
        for colour in colours[int(row.shape_id)]:
            one = mesh.copy()
            rgb = colour or _PLAIN
            one.visual = trimesh.visual.TextureVisuals(
                material=trimesh.visual.material.PBRMaterial(
                    baseColorFactor=[*(int(rgb[i : i + 2], 16) for i in (1, 3, 5)), 255],
                    metallicFactor=0.3,
                    roughnessFactor=0.6,
                )
            )
            found[int(row.shape_id), colour] = one
    progress(f"{what}: writing", len(colours), len(colours))
    return found


def in_metres(pose: Floats) -> Floats:
    """A rigid transform (4, 4) of mm as one of metres."""
    scaled = pose.copy()
    scaled[:3, 3] *= _METRES
    return scaled
