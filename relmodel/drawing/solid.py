"""The model in three dimensions: pictures of placed parts, and the scene that a page's script draws."""

from __future__ import annotations

import base64
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from sqlalchemy import Connection

from relmodel.arrays import Bytes, Floats, Ints
from relmodel.drawing.draw import INK, PLAIN, Rgb, colours_of, with_key
from relmodel.errors import UsageError
from relmodel.geometry.rays import Rays
from relmodel.geometry.transforms import apply
from relmodel.names import check_writable
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
    that no picture has, or where there is nothing to draw; InputError where the picture cannot be written."""
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
    meshes = {shape: mesh for shape, *mesh in read_meshes(store, connection, shapes)}
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
        vertices, triangles, owner = mesh
        points = apply(place, vertices) @ axes
        count = int(owner.max()) + 1
        code = np.array([row_of.get(kind_of.get((shape, s), ""), 0) for s in range(count)])
        corners.append(points[triangles])
        colour.append(code[owner])
        surface.append(owner + 1 + faces)
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
    low, high = scene.corners.min((0, 1)), scene.corners.max((0, 1))
    margin = 0.02 * (high - low)[:2].max()
    step = ((high - low)[0] + 2 * margin) / width
    height = max(1, int(np.ceil(((high - low)[1] + 2 * margin) / step)))
    x, y = np.meshgrid(np.arange(0.5, width), np.arange(0.5, height))
    eyes = np.stack([low[0] - margin + step * x, high[1] + margin - step * y, np.full_like(x, low[2] - 1)], axis=-1)
    return first_hits(scene.corners, eyes)


def first_hits(corners: Floats, eyes: Floats) -> Ints:
    """Which of the triangles (n, 3, 3) each of the eyes (rows, columns, 3) sees first along z, -1 where none."""
    rays = Rays(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3), robust=True)
    away = np.broadcast_to([0.0, 0.0, 1.0], (eyes[..., 0].size, 3))
    return rays.nearest(eyes.reshape(-1, 3), away).reshape(eyes.shape[:2])


def _areas(scene: _Scene, hit: Ints) -> Ints:
    """The area that each pixel shows, 0 where none: a surface, or all of one colour no wider than a line."""
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


# The model in three dimensions, as a page's script draws it: triangles, edges, placed parts, cameras.

MOST_PARTS = 4000  # a page draws them one by one
MOST_TRIANGLES = 600_000  # 12 bytes each in the page; of further shapes only the edges are drawn
_STEPS = 65535  # positions are whole steps of a shape's box: of 3 m, 0.05 mm
_PIECES = 20  # straight pieces an edge is drawn with
_STRAIGHT_MM = 0.05  # an edge that leaves its chord by less is one piece
Part = dict[str, Any]
Lines = dict[str, Any]  # colour, at: ends of pieces, x y z after each other


def read_meshes(store: Store, connection: Connection, shape_ids: Sequence[int]) -> Iterator[Any]:
    """Shape, vertices (n, 3), triangles (m, 3) and their surfaces (m,); as lists of Python they take twice as long."""
    found = store.columns(connection, "scene/meshes", shape_ids=shape_ids)
    names = ("shape_id", "vertices", "triangles", "triangle_surfaces")
    for shape, vertices, triangles, surface in zip(*(found[name] for name in names), strict=True):
        yield int(shape), vertices.reshape(-1, 3), triangles.astype(np.int64).reshape(-1, 3), surface.astype(np.int64)


def shapes_of(store: Store, connection: Connection, shape_ids: Ints) -> list[dict[str, Any]]:
    """Shapes for the script, in the order of `shape_ids`, which are increasing.

    lo, size: their box, mm; v: vertices in steps of it; t: triangles, by surface, each vertex as the step from the one
    before; s: surface, first index and count of each run of them; e: ends of the pieces of sharp edges, as v.  Arrays
    are base64 of little-endian uint16, of triangles int16, int32 where wide.  Shapes without triangles are left out."""
    wanted = [int(s) for s in shape_ids]
    edges = _edges(store, connection, wanted)
    out, drawn = [], 0
    for shape, vertices, triangles, surface in read_meshes(store, connection, wanted):
        if drawn + len(triangles) > MOST_TRIANGLES:
            triangles, surface = triangles[:0], surface[:0]
        drawn += len(triangles)
        order = np.argsort(surface, kind="stable")
        starts = np.flatnonzero(np.r_[True, np.diff(surface[order]) != 0]) if len(order) else np.zeros(0, np.int64)
        runs = np.stack([surface[order][starts], 3 * starts, 3 * np.diff(np.r_[starts, len(order)])], axis=1)
        ends = edges.get(shape, np.zeros((0, 3)))
        low, high = vertices.min(axis=0), vertices.max(axis=0)
        size = np.maximum(high - low, 1e-9)
        corner = triangles[order].ravel().astype(np.int32)
        step = np.diff(corner, prepend=np.int32(0))
        wide = bool(np.abs(step).max(initial=0) > _STEPS // 2)
        out.append(
            {
                "id": shape,
                "lo": low.round(4).tolist(),
                "size": size.round(4).tolist(),
                "v": _packed(_in_steps(vertices, low, size)),
                "t": _packed(step.astype("<i4" if wide else "<i2")),
                "wide": wide,
                "s": runs.tolist(),
                "e": _packed(_in_steps(ends, low, size)),
            }
        )
    return out


def scene(
    shapes: Sequence[Any],
    parts: Sequence[Part],
    lines: Sequence[Lines] = (),
    views: Sequence[dict[str, Any]] = (),
    up: Sequence[float] = (0, 0, 1),
    back: Floats | None = None,
) -> dict[str, Any] | None:
    """What the script draws; None where there is no part to draw.

    `parts` name their shapes by identity; it looks at those first that are not plain, from above the side to which
    `back` (3,) points, a unit vector."""
    ordinal = {s["id"]: i for i, s in enumerate(shapes)}
    drawn = [p | {"shape": ordinal[p["shape"]]} for p in parts if p["shape"] in ordinal]
    if not drawn:
        return None
    shown = [p for p in drawn if p["colour"] != "plain"] or drawn
    boxes = np.array([_box(shapes[p["shape"]], p["m"]) for p in shown])
    low, high = boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)
    middle, radius = (low + high) / 2, float(np.linalg.norm(high - low)) / 2 + 1e-3
    ahead = np.roll(np.asarray(up, float), 1) if back is None else back
    aside = np.cross(up, ahead)
    return {
        "shapes": [{k: v for k, v in s.items() if k != "id"} for s in shapes],
        "parts": drawn,
        "lines": list(lines),
        "views": list(views),
        "focus": middle.round(3).tolist(),
        "radius": round(radius, 3),
        "up": list(up),
        "from": (ahead + 0.35 * aside + 0.3 * np.asarray(up)).round(4).tolist(),
    }


def place_parts(
    store: Store,
    connection: Connection,
    shape_id: Ints,
    paths: Sequence[str] | npt.NDArray[Any],
    poses: Floats,
    colours: Sequence[str] | None = None,
) -> tuple[list[dict[str, Any]], list[Part], Ints]:
    """The shapes of placed parts, poses (n, 4, 4), mm; the parts, and which of those given they are: no more than a
    page draws, and none without triangles.  Colours are names that the script knows, all plain where none are given."""
    shapes = shapes_of(store, connection, np.unique(shape_id[:MOST_PARTS]))
    kept = np.flatnonzero(np.isin(shape_id[:MOST_PARTS], [s["id"] for s in shapes]))
    rows = poses[:, :3].round(6).reshape(-1, 12)
    return (
        shapes,
        [
            {
                "shape": int(shape_id[i]),
                "path": paths[i],
                "m": rows[i].tolist(),
                "colour": "plain" if colours is None else colours[i],
            }
            for i in kept.tolist()
        ],
        kept,
    )


def broadside(shapes: Sequence[Any], parts: Sequence[Part]) -> Floats:
    """The direction (3,), level where z is up, from which the largest part shows most."""
    by_id = {s["id"]: s for s in shapes}
    sizes = np.array([np.ptp(_box(by_id[p["shape"]], p["m"]), axis=0) for p in parts] or [np.ones(3)])
    return np.asarray(-np.eye(3)[np.argmin(sizes[np.argmax(sizes.prod(axis=1))][:2])])


def _box(shape: dict[str, Any], place: Sequence[float]) -> Floats:
    """Least and greatest corner (2, 3) of a placed shape."""
    m = np.reshape(place, (3, 4))
    at = np.array(shape["lo"]) + np.array(list(np.ndindex(2, 2, 2))) * shape["size"]
    corners = at @ m[:, :3].T + m[:, 3]
    return np.array([corners.min(axis=0), corners.max(axis=0)])


class Faces:
    """The faces of a scene that a page draws, as cameras see them."""

    def __init__(self, drawn: Mapping[str, Any], part_of: Mapping[int, int]) -> None:
        """part_of: which part of the scene a placed part is."""
        self._part_of = part_of
        corners, faces = [], []
        for number, part in enumerate(drawn["parts"]):
            s, m = drawn["shapes"][part["shape"]], np.reshape(part["m"], (3, 4))
            points = np.frombuffer(base64.b64decode(s["v"]), "<u2").reshape(-1, 3) / _STEPS * s["size"] + s["lo"]
            corner = np.frombuffer(base64.b64decode(s["t"]), "<i4" if s["wide"] else "<i2").cumsum(dtype=np.int64)
            corners.append((points @ m[:, :3].T + m[:, 3])[corner])
            faces += [(number, surface, count // 3) for surface, _, count in s["s"]]
        part_no, surface_no, count = np.array([*faces, (-1, -1, 1)]).T  # the last of what no ray meets
        self._face = np.repeat(np.column_stack([part_no, surface_no]), count, axis=0)
        self._rays = Rays(np.concatenate(corners), np.arange(sum(map(len, corners))).reshape(-1, 3))

    def outline(
        self, camera: Any, world_from_camera: Floats, occurrence: int, surfaces: Sequence[int], box: Sequence[int]
    ) -> list[Floats]:
        """Rings of points (n, 2), px, about what a camera, a row of `result/camera`, sees of surfaces of a placed part
        within bounds u0 v0 u1 v1 of its picture."""
        import cv2

        step = max(1, max(box[2] - box[0], box[3] - box[1]) // 400)
        at = np.stack(np.meshgrid(np.arange(box[0], box[2], step), np.arange(box[1], box[3], step)), -1).astype(float)
        matrix = np.array([[camera.fx, camera.skew, camera.cx], [0, camera.fy, camera.cy], [0, 0, 1]])
        slopes = cv2.undistortPoints(at.reshape(-1, 1, 2), matrix, np.array(camera.distortion, float))[:, 0]
        ways = np.column_stack([slopes, np.ones(len(slopes))]) @ world_from_camera[:3, :3].T
        face = self._face[self._rays.nearest(world_from_camera[:3, 3], ways)]
        own = (
            ((face[:, 0] == self._part_of.get(occurrence, -2)) & np.isin(face[:, 1], surfaces))
            .reshape(at.shape[:2])
            .astype(np.uint8)
        )
        rings = cv2.findContours(own, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_TC89_L1)[0]
        return [step * r[:, 0].astype(float) + box[:2] for r in rings if len(r) > 2]


def camera_lines(world_from_camera: Floats, matrix: Floats, width: int, height: int, depth: float) -> list[float]:
    """Ends of the pieces of a camera's pyramid down to a depth in mm: x y z after each other."""
    corners = np.array(
        [[-0.5, -0.5, 1], [width - 0.5, -0.5, 1], [width - 0.5, height - 0.5, 1], [-0.5, height - 0.5, 1]]
    )
    rim = apply(world_from_camera, depth * corners @ np.linalg.inv(matrix).T)
    tip = np.broadcast_to(world_from_camera[:3, 3], rim.shape)
    return _pieces(np.concatenate([tip, rim]), np.concatenate([rim, np.roll(rim, 1, axis=0)]))


def ellipsoid_lines(centre: Floats, covariance: Floats, sigmas: float) -> list[float]:
    """Ends of the pieces of the three principal ellipses of a covariance (3, 3), mm2, about a centre (3,)."""
    values, vectors = np.linalg.eigh(covariance)
    axes = sigmas * vectors * np.sqrt(np.maximum(values, 0))
    at = np.linspace(0, 2 * np.pi, 33)[:, None]
    rings = [centre + np.cos(at) * axes[:, i] + np.sin(at) * axes[:, j] for i, j in ((0, 1), (1, 2), (2, 0))]
    return _pieces(np.concatenate([r[:-1] for r in rings]), np.concatenate([r[1:] for r in rings]))


def _edges(store: Store, connection: Connection, shape_ids: Sequence[int]) -> dict[int, Floats]:
    """Ends (2 n, 3) of the pieces of each shape's sharp edges, mm."""
    rows = store.columns(connection, "report/edges", shape_ids=list(shape_ids))
    shape = np.asarray(rows["shape_id"], np.int64)
    if not len(shape):
        return {}
    points = np.concatenate([np.asarray(p, float) for p in rows["points"]]).reshape(-1, 3)
    count = np.array([len(p) // 3 for p in rows["points"]])
    first = np.cumsum(count) - count
    chosen = first[:, None] + np.rint(np.linspace(0, 1, _PIECES + 1) * (count[:, None] - 1)).astype(np.int64)
    knots = points[chosen]  # (edges, pieces + 1, 3)
    chord = knots[:, -1] - knots[:, 0]
    along = chord / np.maximum(np.linalg.norm(chord, axis=1), 1e-12)[:, None]
    away = knots - knots[:, :1]
    aside = np.linalg.norm(away - np.einsum("eki,ei->ek", away, along)[..., None] * along[:, None], axis=2).max(axis=1)
    straight = (aside < _STRAIGHT_MM) & (np.linalg.norm(chord, axis=1) > _STRAIGHT_MM)
    ends = np.stack([knots[:, :-1], knots[:, 1:]], axis=2).reshape(len(knots), -1, 3)
    one = np.stack([knots[straight, 0], knots[straight, -1]], axis=1)
    return {
        int(s): np.concatenate(
            [ends[~straight & (shape == s)].reshape(-1, 3), one[shape[straight] == s].reshape(-1, 3)]
        )
        for s in np.unique(shape)
    }


def _in_steps(points: Floats, low: Floats, size: Floats) -> npt.NDArray[np.uint16]:
    return np.clip(np.rint((points - low) / size * _STEPS), 0, _STEPS).astype("<u2")


def _packed(array: npt.NDArray[Any]) -> str:
    return base64.b64encode(np.ascontiguousarray(array).tobytes()).decode()


def _pieces(a: Floats, b: Floats) -> list[float]:
    """Ends of pieces from a (n, 3) to b (n, 3)."""
    ends: list[float] = np.stack([a, b], axis=1).round(3).ravel().tolist()
    return ends
