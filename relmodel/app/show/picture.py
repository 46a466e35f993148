"""A picture of a loaded object: seen from afar, hidden surfaces removed, features coloured by kind, with a legend."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.sax.saxutils import escape

import numpy as np
from sqlalchemy import Connection

from relmodel.app.show.tree import Tree
from relmodel.arrays import Floats, Ints
from relmodel.errors import UsageError
from relmodel.geometry.transforms import apply
from relmodel.paths import check_writable
from relmodel.store import Store

Colour = tuple[int, int, int]

SUFFIXES = (".svg", ".png", ".jpg", ".jpeg")

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
COLOURS: dict[str, Colour] = {
    "body": (214, 206, 190),
    "pocket": (124, 164, 206),
    "through_hole": (230, 85, 60),
    "blind_hole": (240, 150, 60),
    "boss": (60, 150, 110),
    "lug": (150, 105, 190),
    "duct": (200, 60, 130),
    "flange": (222, 190, 80),
    "rib": (130, 190, 120),
    "web": (170, 205, 225),
    "open_slot": (90, 175, 180),
    "slot": (60, 130, 150),
    "step": (165, 140, 100),
    "fillet": (245, 200, 190),
    "chamfer": (190, 120, 90),
}
_PLAIN: Colour = (196, 200, 204)  # what belongs to no feature
_OTHERS: tuple[Colour, ...] = ((160, 160, 60), (110, 110, 200), (200, 130, 200), (100, 140, 60))
_INK = 40
_FINE = 2  # pixels a pixel and direction of an SVG, whose outlines are traced
_LEGEND = 26  # px: height of a line of it
_ENTRY = 190  # px: width of an entry


@dataclass(frozen=True)
class _Scene:
    """Triangles in the viewer's frame: x to the right, y up, z away."""

    corners: Floats  # (n, 3, 3)
    surface: Ints  # number of each triangle's surface, from 1, unlike in each placed part
    colour: Ints  # row of each triangle's colour
    shade: Floats
    kinds: list[str]  # of the colours from row 1


def write_picture(
    store: Store,
    connection: Connection,
    tree: Tree,
    path: Path,
    view: str | Sequence[float] = "iso",
    width: int = 1600,
) -> dict[str, Colour]:
    """Write a picture of the tree in parallel projection and return the colour (RGB) of each kind of feature in it.

    `view` is a name of VIEWS or a direction in which to look.  A path that ends in .svg is written as outlines of the
    visible surfaces, any other as pixels.  Raises UsageError for a view that is none or a name that no picture has,
    InputError where the picture cannot be written.
    """
    if path.suffix.lower() not in SUFFIXES:
        raise UsageError(f"the picture {path} has no picture suffix: end its name with one of {', '.join(SUFFIXES)}")
    check_writable(path, "picture")
    scene = _scene(store, connection, tree, _axes(view))
    colours = colours_of(scene.kinds)
    vector = path.suffix.lower() == ".svg"
    hit = _draw(scene, width * (_FINE if vector else 1))
    shown = np.unique(scene.colour[np.unique(hit[hit >= 0])])
    legend = {scene.kinds[row - 1]: colours[row - 1] for row in shown.tolist() if row}
    rgb = np.array([_PLAIN, *colours], float)[scene.colour] * scene.shade[:, None]
    if vector:
        path.write_text(_svg(scene, hit, rgb, legend))
    else:
        _write_pixels(scene, hit, rgb, legend, path)
    return legend


def colours_of(kinds: Sequence[str]) -> list[Colour]:
    """The colour of each kind of feature; of kinds that have none of their own, in turn."""
    return [COLOURS.get(kind, _OTHERS[i % len(_OTHERS)]) for i, kind in enumerate(kinds)]


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


def _scene(store: Store, connection: Connection, tree: Tree, axes: Floats) -> _Scene:
    parts = [int(i) for i in np.unique(tree.part_id[tree.part_id >= 0])]
    # sheets and lines that are no material would lie on the faces that they were drawn for
    drawn = [int(p.id) for p in store.rows(connection, "object/parts", part_ids=parts) if not p.supplemental]
    placed = np.flatnonzero((tree.shape_id >= 0) & np.isin(tree.part_id, drawn))
    shapes = [int(s) for s in np.unique(tree.shape_id[placed])]
    meshes = {int(r.shape_id): r for r in store.rows(connection, "scene/meshes", shape_ids=shapes)}
    kind_of = {
        (int(r.shape_id), int(r.surface_no)): str(r.kind)
        for r in store.rows(connection, "object/surface_features", shape_ids=shapes)
    }
    kinds = sorted(set(kind_of.values()))
    row_of = {kind: 1 + i for i, kind in enumerate(kinds)}
    corners, surface, colour = [], [], []
    faces = 0  # of the parts before
    for i in placed.tolist():
        mesh = meshes.get(int(tree.shape_id[i]))
        if mesh is None:
            continue
        points = apply(tree.pose[i], np.reshape(mesh.vertices, (-1, 3))) @ axes
        owner = np.asarray(mesh.triangle_surfaces)
        count = int(owner.max()) + 1
        code = np.array([row_of.get(kind_of.get((int(mesh.shape_id), s), ""), 0) for s in range(count)])
        corners.append(points[np.reshape(mesh.triangles, (-1, 3))])
        colour.append(code[owner])
        surface.append(owner.astype(np.int64) + 1 + faces)
        faces += count
    if not corners:
        raise UsageError(f"{tree.name} has no geometry to draw")
    corner = np.concatenate(corners)
    across = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    normal = across / np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-30)
    # Light from the viewer's right shoulder.
    shade = np.minimum(0.55 + 0.45 * np.abs(normal @ np.array([0.25, 0.35, -0.9])), 1.0)
    return _Scene(corner, np.concatenate(surface), np.concatenate(colour), shade, kinds)


def _draw(scene: _Scene, width: int) -> Ints:
    """The triangle that each pixel shows, -1 where none."""
    from relmodel.app.show.picture_kernels import draw

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


def _entries(legend: dict[str, Colour], width: int, height: int) -> list[tuple[str, Colour, int, int]]:
    """Kinds and colours of a legend below the picture, each with the place of its upper left corner."""
    a_line = max(1, width // _ENTRY)
    return [
        (kind.replace("_", " "), colour, 12 + _ENTRY * (i % a_line), height + _LEGEND * (i // a_line))
        for i, (kind, colour) in enumerate(legend.items())
    ]


def _legend_height(legend: dict[str, Colour], width: int) -> int:
    return _LEGEND * -(-len(legend) // max(1, width // _ENTRY))


def _write_pixels(scene: _Scene, hit: Ints, rgb: Floats, legend: dict[str, Colour], path: Path) -> None:
    """Lines are drawn where neighbouring pixels show different areas."""
    from PIL import Image, ImageDraw, ImageFont

    picture = np.where((hit >= 0)[..., None], rgb[hit], 255.0)
    seen = _areas(scene, hit)
    line = np.zeros(seen.shape, bool)
    line[:, 1:] |= seen[:, 1:] != seen[:, :-1]
    line[1:] |= seen[1:] != seen[:-1]
    picture[line] = _INK
    height, width = seen.shape
    image = Image.new("RGB", (width, height + _legend_height(legend, width)), "white")
    image.paste(Image.fromarray(picture.astype(np.uint8)))
    draw, font = ImageDraw.Draw(image), ImageFont.load_default(16)
    for words, colour, x, y in _entries(legend, width, height):
        draw.rectangle((x, y + 3, x + 18, y + 19), fill=colour, outline=(_INK,) * 3)
        draw.text((x + 26, y + 1), words, fill=(_INK,) * 3, font=font)
    image.save(path)


def _svg(scene: _Scene, hit: Ints, rgb: Floats, legend: dict[str, Colour]) -> str:
    """Outlines of the visible areas, traced around the pixels that show them."""
    import cv2
    from scipy.ndimage import find_objects

    seen = _areas(scene, hit)
    height, width = (n / _FINE for n in seen.shape)
    out = []
    for number, at in enumerate(find_objects(seen), start=1):
        if at is None:  # hidden
            continue
        inside = (seen[at] == number).astype(np.uint8)
        lines, _ = cv2.findContours(inside, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
        corner = np.array([at[1].start, at[0].start])
        outline = "".join(
            "M" + "L".join(f"{x:.5g} {y:.5g}" for x, y in ((p[:, 0] + corner + 0.5) / _FINE).tolist()) + "Z"
            for p in (cv2.approxPolyDP(line, 0.8, True) for line in lines)
            if len(p) > 2
        )
        if not outline:
            continue
        fill = _hexadecimal(np.median(rgb[np.unique(hit[at][inside > 0])], axis=0))
        out.append(f'<path fill="{fill}" d="{outline}"/>')
    total = height + _legend_height(legend, int(width))
    key = [
        f'<rect x="{x}" y="{y + 3:g}" width="18" height="16" fill="{_hexadecimal(colour)}"/>'
        f'<text x="{x + 26}" y="{y + 17:g}" stroke="none">{escape(words)}</text>'
        for words, colour, x, y in _entries(legend, int(width), int(height))
    ]
    return "\n".join(
        [
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:g} {total:g}" fill-rule="evenodd" '
            f'stroke="{_hexadecimal((_INK,) * 3)}" stroke-width="0.8" stroke-linejoin="round" '
            'font-family="sans-serif" font-size="16">',
            *out,
            *key,
            "</svg>\n",
        ]
    )


def _hexadecimal(rgb: Floats | Sequence[float]) -> str:
    return "#" + "".join(f"{int(c):02x}" for c in rgb)
