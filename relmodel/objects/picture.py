"""A picture of a loaded object: seen from afar, hidden surfaces removed, features coloured by kind."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt
from sqlalchemy import Connection

from relmodel.geometry.transforms import apply
from relmodel.objects.tree import Tree
from relmodel.store import Store

Floats = npt.NDArray[np.float64]

# Directions in which one looks, and what is up in the picture.
VIEWS = {
    "front": ((0.0, 0.0, -1.0), (0.0, 1.0, 0.0)),
    "back": ((0.0, 0.0, 1.0), (0.0, 1.0, 0.0)),
    "top": ((0.0, -1.0, 0.0), (0.0, 0.0, -1.0)),
    "right": ((-1.0, 0.0, 0.0), (0.0, 1.0, 0.0)),
    "iso": ((-1.0, -1.0, -1.5), (0.0, 1.0, 0.0)),
}
_PLAIN = (196, 200, 204)
_PALETTE = (
    (86, 156, 214),
    (230, 159, 0),
    (0, 158, 115),
    (204, 121, 167),
    (213, 94, 0),
    (240, 228, 66),
    (120, 94, 240),
    (0, 114, 178),
    (160, 200, 120),
    (180, 120, 80),
)


def write_picture(
    store: Store, connection: Connection, tree: Tree, path: Path, view: str = "iso", width: int = 1600
) -> dict[str, tuple[int, int, int]]:
    """Write a picture of the tree in parallel projection and return the colour (RGB) of each kind of feature in it.

    The suffix of `path` names the format.  Lines are drawn where neighbouring pixels show different surfaces.
    """
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene
    from PIL import Image

    placed = np.flatnonzero(tree.shape_id >= 0)
    shapes = [int(s) for s in np.unique(tree.shape_id[placed])]
    meshes = {int(r.shape_id): r for r in store.rows(connection, "scene_meshes", shape_ids=shapes)}
    kind_of = {
        (int(r.shape_id), int(r.surface_no)): str(r.kind)
        for r in store.rows(connection, "object/surface_features", shape_ids=shapes)
    }
    kinds = sorted(set(kind_of.values()))
    colours = {kind: _PALETTE[i % len(_PALETTE)] for i, kind in enumerate(kinds)}
    table = np.array([_PLAIN, *(colours[k] for k in kinds)], float)

    forward, up = (np.array(v) for v in VIEWS[view])
    forward = forward / np.linalg.norm(forward)
    right = np.cross(forward, up) / np.linalg.norm(np.cross(forward, up))
    up = np.cross(right, forward)
    corners: list[Floats] = []
    colour, surface, normal = [], [], []
    faces = 0  # of the parts before
    for i in placed.tolist():
        mesh = meshes.get(int(tree.shape_id[i]))
        if mesh is None:
            continue
        points = apply(tree.pose[i], np.reshape(mesh.vertices, (-1, 3))) @ np.stack([right, up, forward], axis=1)
        triangle = points[np.reshape(mesh.triangles, (-1, 3))]
        owner = np.asarray(mesh.triangle_surfaces)
        numbers = [kind_of.get((int(mesh.shape_id), int(s))) for s in range(int(owner.max()) + 1)]
        code = np.array([0 if k is None else 1 + kinds.index(k) for k in numbers])
        across = np.cross(triangle[:, 1] - triangle[:, 0], triangle[:, 2] - triangle[:, 0])
        corners.append(triangle)
        colour.append(code[owner])
        surface.append(owner.astype(np.int64) + 1 + faces)
        faces += int(owner.max()) + 1
        normal.append(across / np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-30))
    corner, low, high = (
        np.concatenate(corners),
        np.concatenate(corners).min((0, 1)),
        np.concatenate(corners).max((0, 1)),
    )
    margin = 0.02 * (high - low)[:2].max()
    step = ((high - low)[0] + 2 * margin) / width
    height = max(1, int(np.ceil(((high - low)[1] + 2 * margin) / step)))

    scene = EmbreeScene()
    # Embree counts in single precision: keep numbers small and far planes near.
    middle = (low + high) / 2
    TriangleMesh(scene, np.ascontiguousarray(corner - middle, np.float32))
    x = low[0] - margin + (np.arange(width) + 0.5) * step - middle[0]
    y = high[1] + margin - (np.arange(height) + 0.5) * step - middle[1]
    origins = np.stack(np.broadcast_arrays(x[None, :], y[:, None], low[2] - middle[2] - 1.0), axis=-1).reshape(-1, 3)
    directions = np.broadcast_to(np.array([0.0, 0.0, 1.0], np.float32), origins.shape)
    hit = scene.run(origins.astype(np.float32), np.ascontiguousarray(directions), output=1)["primID"]
    hit = np.asarray(hit, np.int64).reshape(height, width)

    shade = 0.55 + 0.45 * np.abs(np.concatenate(normal) @ np.array([0.25, 0.35, -0.9]))
    rgb = table[np.concatenate(colour)] * np.minimum(shade, 1.0)[:, None]
    picture = np.where((hit >= 0)[..., None], rgb[hit], 255.0)
    seen = np.where(hit >= 0, np.concatenate(surface)[hit], 0)
    line = np.zeros(seen.shape, bool)
    line[:, 1:] |= seen[:, 1:] != seen[:, :-1]
    line[1:] |= seen[1:] != seen[:-1]
    picture[line] = 40.0
    Image.fromarray(picture.astype(np.uint8)).save(path)
    return colours
