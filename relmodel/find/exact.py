"""Precision `exact`: the triangles and sampled arcs of the store against convex volumes.

A surface is in a volume if one of its triangles has a point of it, a feature if one of its surfaces is, an arc if a
chord between two of its samples has, and a part if a triangle has or, where it is solid, if the volume lies wholly
inside it.  Volumes are taken as wider by how far the triangles are from the exact geometry (`shape_mesh.deviation_mm`,
where it is measured) and chords from their arcs, so that nothing that meets a volume is missed.  Elements without
triangles or samples in the store stay in the answer.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from sqlalchemy import Connection

from relmodel.arrays import Bools, Floats, Ints
from relmodel.find.volumes import Volume, VolumeTable
from relmodel.geometry.transforms import matrices
from relmodel.store import Store


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
    element = geometry.number(found["shape_id"].astype(np.int64), found["element_no"].astype(np.int64))
    known = np.flatnonzero(element >= 0)
    if not len(known):
        return met

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


def exact_distances(
    store: Store,
    connection: Connection,
    level: str,
    body: Floats,
    body_solid: bool,
    found: Mapping[str, npt.NDArray[Any]],
) -> Floats:
    """Distances (n,), mm, of what a level has, rows of `in_volumes`, from a body, triangles (m, 3, 3): of their
    triangles, or of those of their boxes where they have none."""
    from relmodel.find.exact_kernels import distances

    geometry = _Geometry.of_all(store, connection, level, found)
    element = geometry.number(found["shape_id"].astype(np.int64), found["element_no"].astype(np.int64))
    given = geometry.triangles, geometry.first_triangle, geometry.solid
    return distances(np.ascontiguousarray(body), body_solid, matrices(found), element, *given)


def placed_triangles(store: Store, connection: Connection, part: Mapping[str, npt.NDArray[Any]]) -> tuple[Floats, bool]:
    """Triangles (m, 3, 3) of a part, the only row, in the world, or those of its box; and whether it is solid."""
    one = {**part, "element_no": np.array([-1])}
    geometry, pose = _Geometry.of_all(store, connection, "part", one), matrices(part)[0]
    return geometry.triangles @ pose[:3, :3].T + pose[:3, 3], bool(geometry.solid[0])


class _Geometry:
    """Triangles of the elements of a level of some shapes; an arc's chords are triangles without area.

    deviation: (n,) how far the exact geometry of an element may be from its triangles, mm.
    """

    def __init__(
        self, keys: list[tuple[int, int]], triangles: list[Floats], solid: list[bool], deviation: list[float]
    ) -> None:
        counts = [len(t) for t in triangles]
        keep = [i for i, count in enumerate(counts) if count]
        order = sorted(keep, key=lambda i: keys[i])
        self._keys = np.array([keys[i] for i in order], np.int64).reshape(-1, 2)
        self.triangles = np.concatenate([np.empty((0, 3, 3)), *(triangles[i] for i in order)])
        self.first_triangle = np.cumsum([0, *(counts[i] for i in order)])
        self.solid = np.array([solid[i] for i in order], bool)
        self.deviation = np.array([deviation[i] for i in order], float)

    @classmethod
    def load(cls, store: Store, connection: Connection, level: str, shapes: list[int]) -> _Geometry:
        if level == "arc":
            rows = store.select(connection, "shape_arc_sample", order="shape_id arc_no", shape_id=shapes)
            keys = list(zip(rows["shape_id"].tolist(), rows["arc_no"].tolist(), strict=True))
            deviation = [_sagitta(p, t) for p, t in zip(rows["points"], rows["tangents"], strict=True)]
            return cls(keys, [_chords(points) for points in rows["points"]], [False] * len(keys), deviation)
        meshes = store.columns(connection, "scene/meshes", shape_ids=shapes)
        of_shape = {
            int(shape): np.asarray(vertices, float).reshape(-1, 3)[np.asarray(triangles, np.int64).reshape(-1, 3)]
            for shape, vertices, triangles in zip(
                meshes["shape_id"].tolist(), meshes["vertices"], meshes["triangles"], strict=True
            )
        }
        measured: Floats = np.ma.filled(np.ma.masked_invalid(np.ma.asarray(meshes["deviation_mm"], float)), 0.0)
        deviation_of = dict(zip(meshes["shape_id"].tolist(), measured.tolist(), strict=True))
        if level == "part":
            solids = set(store.select(connection, "shape", "id", id=shapes, kind="solid")["id"].tolist())
            return cls(
                [(s, -1) for s in of_shape],
                list(of_shape.values()),
                [s in solids for s in of_shape],
                [deviation_of[s] for s in of_shape],
            )
        surfaces: dict[tuple[int, int], Floats] = {}
        for shape, numbers in zip(meshes["shape_id"].tolist(), meshes["triangle_surfaces"], strict=True):
            order = np.argsort(np.asarray(numbers), kind="stable")
            ordered = np.asarray(numbers)[order]
            first = np.flatnonzero(np.diff(ordered, prepend=-1))
            pieces = np.split(of_shape[int(shape)][order], first[1:])
            surfaces |= {(int(shape), int(n)): t for n, t in zip(ordered[first], pieces, strict=True)}
        if level == "surface":
            deviation = [deviation_of[shape] for shape, _ in surfaces]
            return cls(list(surfaces), list(surfaces.values()), [False] * len(surfaces), deviation)
        rows = store.columns(connection, "scene/features", shape_ids=shapes)
        features: dict[tuple[int, int], list[Floats]] = {}
        for shape, feature, surface in zip(
            *(rows[c].tolist() for c in ("shape_id", "feature_no", "surface_no")), strict=True
        ):
            features.setdefault((shape, feature), []).append(surfaces.get((shape, surface), np.empty((0, 3, 3))))
        deviation = [deviation_of.get(shape, 0.0) for shape, _ in features]
        triangles = [np.concatenate(pieces) for pieces in features.values()]
        return cls(list(features), triangles, [False] * len(features), deviation)

    @classmethod
    def of_all(
        cls, store: Store, connection: Connection, level: str, found: Mapping[str, npt.NDArray[Any]]
    ) -> _Geometry:
        """Of some rows of `in_volumes`; what has no triangles is its box, and solid."""
        key = np.stack([found["shape_id"], found["element_no"]]).astype(np.int64)
        (shape_id, element_no), first = np.unique(key, axis=1, return_index=True)
        meshes = cls.load(store, connection, level, np.unique(shape_id).tolist())
        places = meshes.number(shape_id, element_no).tolist()
        boxes = np.stack([found[f"shape_{axis}{end}"][first] for end in (0, 1) for axis in "xyz"], axis=1).astype(float)
        meshed = np.split(meshes.triangles, meshes.first_triangle[1:-1])
        triangles = [_box_triangles(box) if at < 0 else meshed[at] for at, box in zip(places, boxes, strict=True)]
        solid = [at < 0 or bool(meshes.solid[at]) for at in places]
        keys = list(zip(shape_id.tolist(), element_no.tolist(), strict=True))
        return cls(keys, triangles, solid, [0.0] * len(places))

    def number(self, shape_id: Ints, element_no: Ints) -> Ints:
        """Places of elements in this table (n,), -1 where it has none."""
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
