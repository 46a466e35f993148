"""Which placed parts, features, surfaces and arcs lie in a volume, by their boxes or exactly, asked of the store."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Literal, TypedDict, Unpack

import numpy as np
import numpy.typing as npt
from sqlalchemy import Connection

from relmodel.arrays import Bools, Floats, Ints
from relmodel.errors import UsageError
from relmodel.find.volumes import Box, Volume, VolumeTable, volumes_met
from relmodel.geometry.curves import BOX, boxes_of
from relmodel.geometry.transforms import apply, hull_triangles, matrices
from relmodel.store import Store

# At precision `box` an element is in a volume if
#
# - its part's world box, and its own, meet the volume's bounds; touching counts.  The world box of a part is that
#   around its hull as placed (`relmodel.geometry.transforms.boxes_placed`), that of an element the box around its box
#   in the shape's frame, carried into the world;
# - and its box in the shape's frame, as it lies in the world, meets the volume's ball, if any, and is not wholly
#   outside any one of its half-spaces.
#
# That holds every element whose geometry reaches into the volume, and some that only come near. At precision `exact`
# the geometry is tested against the volume: see below.

Level = Literal["part", "feature", "surface", "arc"]
LEVELS: tuple[Level, ...] = ("part", "feature", "surface", "arc")
Precision = Literal["box", "exact"]
PRECISIONS: tuple[Precision, ...] = ("box", "exact")


class VolumeOptions(TypedDict, total=False):
    """The world asked, how exactly, and whether only what lies wholly in a volume counts: as `in_volumes` says."""

    world: str | None
    precision: str
    wholly: bool


def in_volume(
    store: Store, volume: Volume, *, level: str = "part", **options: Unpack[VolumeOptions]
) -> dict[str, npt.NDArray[Any]]:
    """What lies in a volume, by columns, sorted by occurrence_id, element_no: `in_volumes` of one."""
    return in_volumes(store, [volume], level=level, **options)


def in_volumes(
    store: Store,
    volumes: Sequence[Volume],
    *,
    level: str = "part",
    world: str | None = None,
    precision: str = "box",
    wholly: bool = False,
) -> dict[str, npt.NDArray[Any]]:
    """What lies in each of some volumes, by columns, sorted by volume_no, occurrence_id, element_no.

    Columns: volume_no (ordinal of the volume), occurrence_id, shape_id, element_no (feature_no, surface_no or arc_no;
    -1 of parts), path of the placed part, name, world box x0 .. z1, box in the shape's frame shape_x0 ..
    shape_z1, world_from_occurrence m00 .. m23.
    The newest revision of the world is asked; the only world of a store needs no name, and a store without worlds holds
    nothing.  wholly: only what lies in a volume with all of it, of its boxes or, at precision `exact`, of its triangles
    with all that may reach beyond them.  Raises UsageError where the level, the precision or the world is unknown, or
    several worlds need a name."""
    if level not in LEVELS:
        raise UsageError(f"there is no level {level!r}: use one of {', '.join(LEVELS)}")
    if precision not in PRECISIONS:
        raise UsageError(f"there is no precision {precision!r}: use one of {', '.join(PRECISIONS)}")
    with store.read() as connection:
        _, name = world_named(store, connection, world)
        bounds = np.array([volume.bounds for volume in volumes], float).reshape(-1, 6)
        asked = {column: store.array(bounds[:, i]) for i, column in enumerate(BOX)}
        asked["volume_no"] = store.array(np.arange(len(bounds)))
        found = store.columns(connection, "find/in_boxes", world=name, level=level, **asked)
        found = _chosen(found, volumes_met(volumes, found["volume_no"], matrices(found), boxes_of(found, "shape_")))
        if precision == "exact":
            found = _chosen(found, exactly_met(store, connection, volumes, level, found, wholly=wholly))
        elif wholly:
            found = _chosen(found, _boxes_within(volumes, found))
    return found


def _chosen(found: dict[str, npt.NDArray[Any]], met: Bools) -> dict[str, npt.NDArray[Any]]:
    return found if met.all() else {name: values[met] for name, values in found.items()}


def _boxes_within(volumes: Sequence[Volume], found: dict[str, npt.NDArray[Any]]) -> Bools:
    """Of which rows (n,) the world box lies in the volume's bounds, and the box in the shape's frame in the volume."""
    within = np.ones(len(found["volume_no"]), bool)
    world, own = boxes_of(found), boxes_of(found, "shape_")
    corners = np.stack([own[:, [i, j, k]] for i in (0, 3) for j in (1, 4) for k in (2, 5)], axis=1)
    poses = matrices(found)
    corners = np.einsum("nij,ncj->nci", poses[:, :3, :3], corners) + poses[:, None, :3, 3]
    for number, volume in enumerate(volumes):
        rows = np.flatnonzero(found["volume_no"] == number)
        inside = (world[rows, :3] >= volume.bounds[:3]) & (world[rows, 3:] <= volume.bounds[3:])
        beyond = corners[rows] @ volume.planes[:, :3].T - volume.planes[:, 3]
        within[rows] = inside.all(axis=1) & (beyond <= 0).all(axis=(1, 2))
        if volume.ball is not None:
            away = np.linalg.norm(corners[rows] - volume.ball[:3], axis=2)
            within[rows] &= (away <= volume.ball[3]).all(axis=1)
    return within


def nearest_parts(
    store: Store,
    path: npt.ArrayLike,
    count: int = 1,
    *,
    level: str = "part",
    radius: float = 0.0,
    tool: npt.ArrayLike = (0.0, 0.0, 0.0),
    world: str | None = None,
) -> dict[str, npt.NDArray[Any]]:
    """The `count` parts, or elements of another level, nearest to a point (3,), to a tool swept along straight pieces
    between points (k, 3), or, where `path` is the path of a placed part, to that part, itself and its elements left
    out.

    Columns of `in_volumes`, and distance_mm, 0 where the part is touched or one is inside the other and that is solid,
    by which they are sorted, then by occurrence_id and element_no.  Distances are of the triangles or, of arcs, the
    chords, true within what these miss (`shape_mesh`), or of the box of what has none.
    tool: points (n, 3), mm, about the point that goes the path, turned as the world is; the tool is their convex hull,
    without them a point.  radius: by which it is larger all round, mm, as a ball is than a point.  Raises UsageError
    where the path or the tool is none, no such part is placed, the count is below 1 or the radius below 0, and as
    `in_volumes`."""
    from relmodel.find.exact_kernels import distances

    if not 0 <= radius < np.inf or count < 1:
        raise UsageError("nearest needs a count from 1 and a radius from 0 mm")
    with store.read() as connection:
        world_id, name = world_named(store, connection, world)
        itself = -1
        if isinstance(path, str):
            part = store.columns(connection, "index/parts", world_id=world_id, path=path)
            if not len(part["occurrence_id"]):
                raise UsageError(f"there is no part {path!r} in the world {name}: relmodel find lists the parts' paths")
            itself = int(part["occurrence_id"][0])
            mesh = _Geometry.of_all(store, connection, "part", part | {"element_no": np.array([-1])})
            body, solid = apply(matrices(part)[0], mesh.triangles), bool(mesh.solid[0])
        else:
            body, solid = _swept(path, tool), True
    bounds = np.concatenate([body.min(axis=(0, 1)), body.max(axis=(0, 1))])
    reach, farthest = 64.0, np.inf
    while True:
        grown = bounds + np.repeat([-1.0, 1.0], 3) * (radius + reach)
        found = in_volume(store, Box(*grown), level=level, world=world)
        found = _chosen(found, found["occurrence_id"] != itself)
        with store.read() as connection:
            geometry = _Geometry.of_all(store, connection, level, found)
        given = geometry.number(found), geometry.triangles, geometry.first_triangle, geometry.solid
        away = distances(np.ascontiguousarray(body), solid, matrices(found), *given) - radius
        found["distance_mm"] = np.maximum(away, 0.0)
        order = np.lexsort((found["element_no"], found["occurrence_id"], found["distance_mm"]))
        order = order[(reach >= farthest) | (found["distance_mm"][order] <= reach)][:count]
        if len(order) == count or reach >= farthest:
            return {name: values[order] for name, values in found.items()}
        if farthest == np.inf:
            with store.read() as connection:
                (box,) = boxes_of(store.columns(connection, "find/world_box", world=name))
            # How far away the world is at least, along an axis, and how far all of it; no box where it has no part.
            reach = max(reach, float(np.nan_to_num([box[:3] - bounds[3:], bounds[:3] - box[3:]]).max()))
            farthest = float(np.nan_to_num([bounds[:3] - box[:3], box[3:] - bounds[3:]]).max())
        reach = min(4 * reach, farthest)


def _swept(path: npt.ArrayLike, tool: npt.ArrayLike) -> Floats:
    """Triangles (m, 3, 3) of what the convex hull of a tool's points fills on its way: a hull for each straight piece,
    for a hull that moves without turning fills the hull of where it begins and where it ends."""
    points, corners = np.asarray(path, float).reshape(-1, 3), np.asarray(tool, float).reshape(-1, 3)
    if not len(points) or not len(corners) or not (np.isfinite(points).all() and np.isfinite(corners).all()):
        raise UsageError("nearest needs a point or a path of points, and a tool's points, x y z each, in mm")
    pieces = zip(points, points[1:] if len(points) > 1 else points, strict=False)
    return np.concatenate([hull_triangles(np.concatenate([corners + a, corners + b])) for a, b in pieces])


def find_rows(
    store: Store, volume: Volume, *, level: str | None = None, **options: Unpack[VolumeOptions]
) -> list[tuple[Any, ...]]:
    """What lies in a volume, sorted by path and name: path of the placed part, level, name of the part or element, and
    its world box x0 .. z1, mm; without a level, parts and their features."""
    rows = []
    for asked in (level,) if level else ("part", "feature"):
        found = in_volume(store, volume, level=asked, **options)
        boxes = boxes_of(found).tolist()
        order = np.lexsort((found["element_no"], found["path"].astype(str)))
        rows += [(str(found["path"][i]), asked, str(found["name"][i]), *boxes[i]) for i in order]
    return rows


def world_named(store: Store, connection: Connection, world: str | None) -> tuple[int, str]:
    """Identity of the newest revision and name of the world asked for; (-1, "") where the store has none."""
    worlds = {row.name: int(row.world_id) for row in store.rows(connection, "world/current")}
    if world is None and len(worlds) > 1:
        raise UsageError(f"the store holds several worlds: name one of {', '.join(worlds)}")
    if world is None:
        return next(((number, name) for name, number in worlds.items()), (-1, ""))
    if world not in worlds:
        raise UsageError(f"there is no world {world!r}: the store holds {', '.join(worlds) or 'none'}")
    return worlds[world], world


# Precision `exact`: the triangles and sampled arcs of the store against convex volumes.
#
# A surface is in a volume if one of its triangles has a point of it, a feature if one of its surfaces is, an arc if a
# chord between two of its samples has, and a part if a triangle has or, where it is solid, if the volume lies wholly
# inside it. Volumes are taken as wider by how far the triangles are from the exact geometry (`shape_mesh.deviation_mm`,
# where it is measured) and chords from their arcs, so that nothing that meets a volume is missed. Elements without
# triangles or samples in the store stay in the answer.


def exactly_met(
    store: Store,
    connection: Connection,
    volumes: Sequence[Volume],
    level: str,
    found: Mapping[str, npt.NDArray[Any]],
    *,
    wholly: bool = False,
) -> Bools:
    """Which rows of an answer at precision `box` (columns of `in_volumes`) are in it at `exact`, or wholly so (n,)."""
    met = np.ones(len(found["volume_no"]), bool)
    if not len(met):
        return met
    shapes = np.unique(found["shape_id"].astype(np.int64)).tolist()
    geometry = _Geometry.load(store, connection, level, shapes)
    element = geometry.number(found)
    known = np.flatnonzero(element >= 0)

    from relmodel.find.exact_kernels import meet_volumes

    table = VolumeTable.of(volumes)
    met[known] = meet_volumes(
        table.half_spaces,
        table.start,
        table.balls,
        np.array([volume.inner_point for volume in volumes]),
        found["volume_no"][known].astype(np.int64),
        matrices({name: values[known] for name, values in found.items() if name.startswith("m")}),
        element[known],
        geometry.triangles,
        geometry.first_triangle,
        geometry.solid,
        geometry.deviation,
        wholly,
    )
    return met


class _Geometry:
    """Triangles of the elements of a level of some shapes; an arc's chords are triangles without area.  deviation: (n,)
    how far the exact geometry of an element may be from its triangles, mm."""

    def __init__(self, elements: Iterable[tuple[tuple[int, int], Floats, bool, float]]) -> None:
        """elements: shape_id and element_no, triangles (m, 3, 3), whether it is solid, and its deviation."""
        kept = sorted((one for one in elements if len(one[1])), key=lambda one: one[0])
        self._keys = np.array([key for key, *_ in kept], np.int64).reshape(-1, 2)
        self.triangles = np.concatenate([np.empty((0, 3, 3)), *(triangles for _, triangles, *_ in kept)])
        self.first_triangle = np.cumsum([0, *(len(triangles) for _, triangles, *_ in kept)])
        self.solid = np.array([solid for *_, solid, _ in kept], bool)
        self.deviation = np.array([deviation for *_, deviation in kept], float)

    @classmethod
    def load(cls, store: Store, connection: Connection, level: str, shapes: list[int]) -> _Geometry:
        if level == "arc":
            rows = store.select(connection, "shape_arc_sample", order="shape_id arc_no", shape_id=shapes)
            each = (rows[name] for name in ("shape_id", "arc_no", "points", "tangents"))
            arcs = zip(*each, strict=True)
            return cls(((int(shape), int(arc)), _chords(p), False, _sagitta(p, t)) for shape, arc, p, t in arcs)
        meshes = store.columns(connection, "scene/meshes", shape_ids=shapes)
        meshed = [int(shape) for shape in meshes["shape_id"]]
        of_shape = {
            shape: np.asarray(vertices, float).reshape(-1, 3)[np.asarray(triangles, np.int64).reshape(-1, 3)]
            for shape, vertices, triangles in zip(meshed, meshes["vertices"], meshes["triangles"], strict=True)
        }
        measured = np.nan_to_num(np.asarray(meshes["deviation_mm"], float))
        deviation = dict(zip(meshed, measured.tolist(), strict=True))
        if level == "part":
            solids = set(store.select(connection, "shape", "id", id=shapes, kind="solid")["id"].tolist())
            return cls(((s, -1), triangles, s in solids, deviation[s]) for s, triangles in of_shape.items())
        surfaces: dict[tuple[int, int], Floats] = {}
        for shape, numbers in zip(meshed, meshes["triangle_surfaces"], strict=True):
            order = np.argsort(np.asarray(numbers), kind="stable")
            ordered = np.asarray(numbers)[order]
            first = np.flatnonzero(np.diff(ordered, prepend=-1))
            pieces = np.split(of_shape[shape][order], first[1:])
            surfaces |= {(shape, int(n)): t for n, t in zip(ordered[first], pieces, strict=True)}
        if level == "surface":
            return cls((key, triangles, False, deviation[key[0]]) for key, triangles in surfaces.items())
        rows = store.columns(connection, "scene/features", shape_ids=shapes)
        features: dict[tuple[int, int], list[Floats]] = {}
        for shape, feature, surface in zip(
            *(rows[c].tolist() for c in ("shape_id", "feature_no", "surface_no")), strict=True
        ):
            features.setdefault((shape, feature), []).append(surfaces.get((shape, surface), np.empty((0, 3, 3))))
        return cls((key, np.concatenate(f), False, deviation.get(key[0], 0.0)) for key, f in features.items())

    @classmethod
    def of_all(
        cls, store: Store, connection: Connection, level: str, found: Mapping[str, npt.NDArray[Any]]
    ) -> _Geometry:
        """Of some rows of `in_volumes`; what has no triangles is its box, and solid."""
        key = np.stack([found["shape_id"], found["element_no"]]).astype(np.int64)
        (shape_id, element_no), first = np.unique(key, axis=1, return_index=True)
        meshes = cls.load(store, connection, level, np.unique(shape_id).tolist())
        places = meshes.number({"shape_id": shape_id, "element_no": element_no}).tolist()
        boxes = boxes_of(found, "shape_")[first]
        meshed = np.split(meshes.triangles, meshes.first_triangle[1:-1])
        keys = zip(shape_id.tolist(), element_no.tolist(), strict=True)
        return cls(
            (key, _box_triangles(box) if at < 0 else meshed[at], at < 0 or bool(meshes.solid[at]), 0.0)
            for key, at, box in zip(keys, places, boxes, strict=True)
        )

    def number(self, elements: Mapping[str, npt.NDArray[Any]]) -> Ints:
        """Places in this table of elements (n,) with shape_id and element_no, -1 where it has none."""
        shape_id, element_no = (elements[name].astype(np.int64) for name in ("shape_id", "element_no"))
        if not len(self._keys):
            return np.full(len(shape_id), -1, np.int64)
        span = int(max(self._keys[:, 1].max(), element_no.max())) + 2
        known = self._keys[:, 0] * span + self._keys[:, 1] + 1
        asked = shape_id * span + element_no + 1
        place = np.minimum(np.searchsorted(known, asked), len(known) - 1)
        return np.where(known[place] == asked, place, -1)


def _box_triangles(box: Floats) -> Floats:
    """The twelve triangles (12, 3, 3) of a box (6,), counter-clockwise from outside."""
    corners = np.array([box[[x, y, z]] for x in (0, 3) for y in (1, 4) for z in (2, 5)])
    faces = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
    return np.array([corners[[f[0], *pair]] for f in faces for pair in (f[1:3], f[2:4])])


def _chords(points: npt.ArrayLike) -> Floats:
    """Chords (n - 1, 3, 3) between points given x y z after each other, the last corner twice; of one point, itself."""
    p = np.asarray(points, float).reshape(-1, 3)
    last = p[1:] if len(p) > 1 else p
    return np.stack([p[: len(last)], last, last], axis=1)


def _sagitta(points: npt.ArrayLike, tangents: npt.ArrayLike) -> float:
    """How far at most an arc is from the chords between points, by how much its tangents turn along each, mm."""
    p, t = (np.asarray(values, float).reshape(-1, 3) for values in (points, tangents))
    if len(t) == 1:  # one for all points: a straight arc
        return 0.0
    length = np.linalg.norm(np.diff(p, axis=0), axis=1)
    turn = np.arctan2(np.linalg.norm(np.cross(t[:-1], t[1:]), axis=1), np.einsum("nd,nd->n", t[:-1], t[1:]))
    return float((length / 2 * np.tan(turn / 4)).max(initial=0.0))
