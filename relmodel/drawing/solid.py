"""Pictures of placed parts: seen from afar, hidden surfaces removed, features coloured by kind, with a key."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from sqlalchemy import Connection

from relmodel.arrays import Bytes, Floats, Ints
from relmodel.drawing.colours import INK, PLAIN, Rgb, colours_of
from relmodel.drawing.strokes import with_key
from relmodel.errors import UsageError
from relmodel.geometry.transforms import apply
from relmodel.paths import check_writable
from relmodel.store import Store

SUFFIXES = (".png", ".jpg", ".jpeg")

# Directions in which one looks, and what is up in the picture.
VIEWS = {
    "front": ((0.0, 0.0, -1.0), (0.0, 1.0, 0.0)),
    "back": ((0.0, 0.0, 1.0), (0.0, 1.0, 0.0)),
    "top": ((0.0, -1.0, 0.0), (0.0, 0.0, -1.0)),
    "bottom": ((0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
    "right": ((-1.0, 0.0, 0.0), (0.0, 1.0, 0.0)),
    "left": ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)),
    "iso": ((-1.0, -1.0, -1.5), (0.0, 1.0, 0.0)),
}


@dataclass(frozen=True)
class _Scene:
    """Triangles in the viewer's frame: x to the right, y up, z away."""

    corners: Floats  # (n, 3, 3)
    surface: Ints  # number of each triangle's surface, from 1, unlike in each placed part
    colour: Ints  # row of each triangle's colour
    shade: Floats
    kinds: list[str]  # of the colours from row 1

    @property
    def rgb(self) -> Floats:
        """Of each triangle."""
        return np.array([PLAIN, *colours_of(self.kinds)], float)[self.colour] * self.shade[:, None]


def write_picture(
    store: Store,
    connection: Connection,
    shape_id: Ints,
    pose: Floats,
    path: Path,
    view: str | Sequence[float] = "iso",
    width: int = 1600,
) -> dict[str, Rgb]:
    """Write a picture of shapes (n,) placed by poses (n, 4, 4), mm, in parallel projection and return the colour (RGB)
    of each kind of feature in it.

    `view` is a name of VIEWS or a direction in which to look.  Raises UsageError for a view that is none or a name
    that no picture has, or where there is nothing to draw; InputError where the picture cannot be written.
    """
    from PIL import Image

    if path.suffix.lower() not in SUFFIXES:
        raise UsageError(f"the picture {path} has no picture suffix: end its name with one of {', '.join(SUFFIXES)}")
    check_writable(path, "picture")
    scene = _scene(store, connection, shape_id, pose, _axes(view))
    hit = _draw(scene, width)
    shown = np.unique(scene.colour[np.unique(hit[hit >= 0])])
    colours = colours_of(scene.kinds)
    legend = {scene.kinds[row - 1]: colours[row - 1] for row in shown.tolist() if row}
    Image.fromarray(with_key(_pixels(scene, hit), legend)).save(path)
    return legend


def draw_solid(store: Store, connection: Connection, shape_id: Ints, pose: Floats, width: int, view: str) -> Bytes:
    """The picture alone (rows, `width`, 3: RGB); raises UsageError where there is nothing to draw."""
    scene = _scene(store, connection, shape_id, pose, _axes(view))
    return _pixels(scene, _draw(scene, width))


def _axes(view: str | Sequence[float]) -> Floats:
    """Columns: right, up and forward of the picture."""
    if isinstance(view, str):
        if view not in VIEWS:
            raise UsageError(f"there is no view {view}: name one of {', '.join(VIEWS)}, or a direction as 1,-1,0.5")
        forward, up = (np.array(v) for v in VIEWS[view])
    else:
        forward = np.array(view, float)
        if forward.shape != (3,) or not np.isfinite(forward).all() or not forward.any():
            raise UsageError("a direction of view has three numbers that are not all 0: give it as 1,-1,0.5")
        up = np.array([0.0, 1.0, 0.0])
    forward = forward / np.linalg.norm(forward)
    if abs(forward @ up) > 0.999:
        up = np.array([0.0, 0.0, -np.sign(forward @ up)])
    right = np.cross(forward, up) / np.linalg.norm(np.cross(forward, up))
    return np.stack([right, np.cross(right, forward), forward], axis=1)


def _scene(store: Store, connection: Connection, shape_id: Ints, pose: Floats, axes: Floats) -> _Scene:
    shapes = [int(s) for s in np.unique(shape_id)]
    meshes = {int(r.shape_id): r for r in store.rows(connection, "scene/meshes", shape_ids=shapes)}
    kind_of = {
        (int(r.shape_id), int(r.surface_no)): str(r.kind)
        for r in store.rows(connection, "object/surface_features", shape_ids=shapes)
    }
    kinds = sorted(set(kind_of.values()))
    row_of = {kind: 1 + i for i, kind in enumerate(kinds)}
    corners, surface, colour = [], [], []
    faces = 0  # of the parts before
    for shape, place in zip(shape_id.tolist(), pose, strict=True):
        mesh = meshes.get(shape)
        if mesh is None:
            continue
        points = apply(place, np.reshape(mesh.vertices, (-1, 3))) @ axes
        owner = np.asarray(mesh.triangle_surfaces)
        count = int(owner.max()) + 1
        code = np.array([row_of.get(kind_of.get((int(mesh.shape_id), s), ""), 0) for s in range(count)])
        corners.append(points[np.reshape(mesh.triangles, (-1, 3))])
        colour.append(code[owner])
        surface.append(owner.astype(np.int64) + 1 + faces)
        faces += count
    if not corners:
        raise UsageError("it has no geometry to draw")
    corner = np.concatenate(corners)
    across = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    normal = across / np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-30)
    # Light from the viewer's right shoulder.
    shade = np.minimum(0.55 + 0.45 * np.abs(normal @ np.array([0.25, 0.35, -0.9])), 1.0)
    return _Scene(corner, np.concatenate(surface), np.concatenate(colour), shade, kinds)


def _draw(scene: _Scene, width: int) -> Ints:
    """The triangle that each pixel shows, -1 where none."""
    from relmodel.drawing.solid_kernels import draw

    low, high = scene.corners.min((0, 1)), scene.corners.max((0, 1))
    margin = 0.02 * (high - low)[:2].max()
    step = ((high - low)[0] + 2 * margin) / width
    height = max(1, int(np.ceil(((high - low)[1] + 2 * margin) / step)))
    corner = np.array([low[0] - margin, high[1] + margin, 0.0])
    pixels = (scene.corners - corner) / [step, -step, 1.0] - [0.5, 0.5, 0.0]
    depth, hit = np.full((height, width), np.inf), np.full((height, width), -1, np.int64)
    draw(np.ascontiguousarray(pixels), depth, hit)
    return hit


def _areas(scene: _Scene, hit: Ints) -> Ints:
    """The area that each pixel shows, 0 where none: a surface, or all of one colour that are no wider than the lines
    that would be drawn between them."""
    from scipy.ndimage import find_objects

    seen = np.where(hit >= 0, scene.surface[hit], 0)
    most = int(scene.surface.max())
    size = np.bincount(seen.ravel(), minlength=most + 1)[1:]
    extent = np.array([max((s.stop - s.start for s in at or ()), default=0) for at in find_objects(seen, most)])
    area = np.arange(most + 1)
    colour = np.zeros_like(area)
    colour[scene.surface] = scene.colour
    area[1:][size < 2 * extent] = most + 1 + colour[1:][size < 2 * extent]
    return np.asarray(area[seen])


def _pixels(scene: _Scene, hit: Ints) -> Bytes:
    """Lines are drawn where neighbouring pixels show different areas."""
    picture = np.where((hit >= 0)[..., None], scene.rgb[hit], 255.0)
    seen = _areas(scene, hit)
    line = np.zeros(seen.shape, bool)
    line[:, 1:] |= seen[:, 1:] != seen[:, :-1]
    line[1:] |= seen[1:] != seen[:-1]
    picture[line] = INK
    return picture.astype(np.uint8)
