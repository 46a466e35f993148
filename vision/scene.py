"""What localisation needs of the world: triangles that occlude, and arcs sampled with their face normals."""

from __future__ import annotations

from collections.abc import Callable, Collection, Hashable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import Connection

from relmodel.arrays import Bools, Floats, Ints
from relmodel.errors import InputError
from relmodel.geometry.rays import Rays
from relmodel.geometry.transforms import MATRIX_COLUMNS, matrices
from relmodel.model.measures import spread_samples
from relmodel.store import Store
from relmodel.store.database import Database

T = TypeVar("T")


@dataclass(frozen=True)
class Scene:
    """The world's surfaces and arcs as columns, everything in the world frame, mm.

    vertices (v, 3), vertex_normals (v, 3): the exact outward normals, for silhouettes; a mesh without exact normals
    gives each facet its own vertices. triangles (f, 3), triangle_surface (f,): indices of vertices and of the
    surface that each triangle belongs to. surface_occurrence (s,): the occurrence of each surface. sample_point,
    sample_tangent, sample_normal_a, sample_normal_b (n, 3), sample_arc (n,), sample_length (n,): points along arcs,
    the unit normals of the two faces there, and how much of the arc (mm) each stands for. The samples of an arc
    stand together. A free edge, of one face only, has that face's normal and its opposite: it is sharp, and seen
    from both sides. arc_occurrence (a,): the occurrence of each arc. inspected (o,): which occurrences are the
    reference for the pose; all of them occlude. tolerance_mm (o,): standard deviation of where an occurrence's arcs
    are, across them, from where the model has them."""

    vertices: Floats
    vertex_normals: Floats
    triangles: Ints
    triangle_surface: Ints
    surface_occurrence: Ints
    sample_point: Floats
    sample_tangent: Floats
    sample_normal_a: Floats
    sample_normal_b: Floats
    sample_arc: Ints
    sample_length: Floats
    arc_occurrence: Ints
    inspected: Bools
    tolerance_mm: Floats

    @cached_property
    def tolerance_of_arc(self) -> Floats:
        """Tolerances (mm) of arcs, and of the silhouettes of surfaces after them: as views count arcs."""
        return np.asarray(self.tolerance_mm[self.occurrence_of_arc])

    @cached_property
    def occurrence_of_arc(self) -> Ints:
        """Occurrences of arcs, and of the silhouettes of surfaces after them: as views count arcs."""
        return np.concatenate([self.arc_occurrence, self.surface_occurrence])

    @cached_property
    def sample_cosine(self) -> Floats:
        """Cosine (n,) of the angle between the two faces at the samples."""
        return np.asarray(np.einsum("ij,ij->i", self.sample_normal_a, self.sample_normal_b))

    @cached_property
    def reference_samples(self) -> Ints:
        """Samples of inspected occurrences' arcs."""
        return np.flatnonzero(self.inspected[self.arc_occurrence[self.sample_arc]])

    @cached_property
    def curved_triangles(self) -> Ints:
        """Triangles of inspected, curved surfaces: only those can have a silhouette."""
        n = self.vertex_normals[self.triangles]
        bend = np.minimum(np.einsum("fi,fi->f", n[:, 0], n[:, 1]), np.einsum("fi,fi->f", n[:, 1], n[:, 2]))
        inspected = self.inspected[self.surface_occurrence[self.triangle_surface]]
        return np.flatnonzero((bend < 1 - 1e-6) & inspected)

    @cached_property
    def curved_corners(self) -> tuple[Floats, Floats]:
        """Normals n (3 f, 3) at the corners v of the curved triangles, and their n . v (3 f,)."""
        corner = self.triangles[self.curved_triangles].ravel()
        normal = self.vertex_normals[corner]
        return normal, np.asarray(np.einsum("ij,ij->i", normal, self.vertices[corner]))

    def select(self, samples: Ints, lengths: Floats, triangles: Ints) -> Scene:
        """The scene with only these samples (and the arc lengths they stand for) and silhouettes of only these
        triangles; everything still occludes."""
        names = ("sample_point", "sample_tangent", "sample_normal_a", "sample_normal_b", "sample_arc")
        part = replace(self, sample_length=lengths, **{name: getattr(self, name)[samples] for name in names})
        # Cached properties of the whole that are those of the part: the same triangles occlude.
        part.__dict__["rays"] = self.rays
        part.__dict__["curved_triangles"] = triangles
        return part

    def without(self, gone: Bools) -> Scene:
        """The scene without some of its occurrences (o,): they neither show nor occlude, and all keep their numbers."""
        names = ("sample_point", "sample_tangent", "sample_normal_a", "sample_normal_b", "sample_arc", "sample_length")
        samples = ~gone[self.arc_occurrence[self.sample_arc]]
        kept = ~gone[self.surface_occurrence[self.triangle_surface]]
        rest = {name: getattr(self, name)[samples] for name in names}
        return replace(self, triangles=self.triangles[kept], triangle_surface=self.triangle_surface[kept], **rest)

    def once(self, key: Hashable, make: Callable[[], T]) -> T:
        """What is made of the scene once, by its name and parameters, and does not hold the scene."""
        made: dict[Hashable, T] = self.__dict__.setdefault("made", {})
        if key not in made:
            made[key] = make()
        return made[key]

    @cached_property
    def rays(self) -> Rays:
        return Rays(self.vertices, self.triangles)


# The scene of a world as the store has it, and what each of its columns is called there.


@dataclass(frozen=True)
class StoredScene:
    """A scene with the names that the store has for its occurrences, arcs and surfaces.

    occurrence_id (o,), paths (o,), shape_id (o,): the placed parts, in the scene's order. arc_no (a,): `arc_no` in the
    part's shape of each of the scene's arcs; surface_no (s,) likewise. arc_surfaces (a, 2): the scene's surfaces on
    either side of each arc, -1 for none. radius (s,): of cylinders, mm, nan for other surfaces. features: shape_id,
    feature_no, name, kind, surface_no and thickness (mm, of ribs and webs), a row for each surface of a feature, in
    this order."""

    scene: Scene
    world_id: int
    occurrence_id: Ints
    paths: list[str]
    shape_id: Ints
    arc_no: Ints
    surface_no: Ints
    arc_surfaces: Ints
    radius: Floats
    features: dict[str, NDArray[Any]]

    def name_surface(self, surface: int) -> str:
        """The path of one of the scene's surfaces."""
        return f"{self.paths[self.scene.surface_occurrence[surface]]}/face {self.surface_no[surface]}"


def read_scene(
    store: Database, connection: Connection, world_id: int, among: Sequence[int] | None = None
) -> StoredScene:
    """Scene of the placed parts of a world; `among` names the occurrences that matter, all where it is None.

    Raises InputError where no part is the reference (role inspected)."""
    return _read(store, connection, world_id, _parts(store, connection, world_id, among))


def read_variant_scene(
    store: Database, connection: Connection, world_id: int, among: Sequence[int], variant: Mapping[str, Any]
) -> StoredScene:
    """Scene of a world in which a loaded variant, a row of `variants_in_world`, stands in the place of the one that is
    there; of the other objects the occurrences `among`.  Its parts are no occurrences of the world: their identities
    count up to -1."""
    others = _parts(store, connection, world_id, among)
    kept = others["object_no"] != variant["object_no"]
    own = store.columns(connection, "object/expansion", object_id=int(variant["object_id"]))
    own = {name: values[own["part_id"] >= 0] for name, values in own.items()}
    count = len(own["path"])
    placed = matrices({name: np.array([variant[name]]) for name in MATRIX_COLUMNS})[0]
    world_from_part = (placed @ matrices(own)).reshape(count, 16)
    inspected = {
        "id": np.arange(-count, 0),
        "path": np.array([f"{variant['instance']}/{path}" for path in own["path"].tolist()], object),
        "shape_id": own["shape_id"],
        "role": np.full(count, variant["role"], object),
        "tolerance_mm": np.full(count, float(variant["tolerance_mm"])),
        **dict(zip(MATRIX_COLUMNS, world_from_part.T, strict=False)),
    }
    return _read(
        store,
        connection,
        world_id,
        {name: np.concatenate([values, others[name][kept]]) for name, values in inspected.items()},
    )


def _parts(
    store: Database, connection: Connection, world_id: int, among: Sequence[int] | None
) -> dict[str, NDArray[Any]]:
    parts = store.columns(connection, "scene/parts", world_id=world_id)
    if among is None:
        return parts
    kept = np.isin(parts["id"], np.asarray(among, np.int64))
    return {name: values[kept] for name, values in parts.items()}


def _read(store: Database, connection: Connection, world_id: int, parts: dict[str, NDArray[Any]]) -> StoredScene:
    """The scene of these placed parts, rows of `scene_parts`."""
    inspected = parts["role"] == "inspected"
    if not inspected.any():
        raise InputError(
            "no part of an inspected object lies where the prior looks: check the prior and the roles in the world file"
        )
    world_from_part = matrices(parts)
    shapes = [int(s) for s in np.unique(parts["shape_id"])]
    mesh_of = _by_shape(store.columns(connection, "scene/meshes", shape_ids=shapes))
    arcs_of = {
        shape: _spread(rows)
        for shape, rows in _by_shape(store.columns(connection, "scene/arcs", shape_ids=shapes)).items()
    }

    meshes, arcs = [], []
    for occurrence, shape in enumerate(parts["shape_id"].tolist()):
        if shape in mesh_of:
            meshes.append(_placed_mesh(mesh_of[shape], world_from_part[occurrence], occurrence))
        if shape in arcs_of:
            arcs.append(_placed_arcs(arcs_of[shape], world_from_part[occurrence], occurrence))
    mesh, arc = _stacked(meshes), _stacked(arcs)
    scene = Scene(
        vertices=mesh["vertices"],
        vertex_normals=mesh["normals"],
        triangles=mesh["triangles"],
        triangle_surface=mesh["triangle_surface"],
        surface_occurrence=mesh["surface_occurrence"],
        sample_point=arc["points"],
        sample_tangent=arc["tangents"],
        sample_normal_a=arc["normals_a"],
        sample_normal_b=arc["normals_b"],
        sample_arc=arc["sample_arc"],
        sample_length=arc["length"],
        arc_occurrence=arc["arc_occurrence"],
        inspected=inspected,
        tolerance_mm=parts["tolerance_mm"].astype(float),
    )
    return StoredScene(
        scene,
        world_id,
        parts["id"].astype(np.int64),
        parts["path"].tolist(),
        parts["shape_id"].astype(np.int64),
        arc["arc_no"],
        mesh["surface_no"],
        _number_surfaces(mesh, arc),
        _radii(mesh, parts["shape_id"], store.columns(connection, "scene/cylinders", shape_ids=shapes)),
        store.columns(connection, "scene/features", shape_ids=shapes),
    )


def _by_shape(columns: dict[str, NDArray[Any]]) -> dict[int, dict[str, NDArray[Any]]]:
    """Rows that belong to each shape; they stand together."""
    shape, first = np.unique(columns["shape_id"], return_index=True)
    last = np.append(first[1:], len(columns["shape_id"]))
    return {
        int(s): {name: values[a:b] for name, values in columns.items()}
        for s, a, b in zip(shape, first, last, strict=True)
    }


# Columns that count another column's rows, and which: what is appended must be moved on by what is there already.
_COUNTED = {"triangles": "vertices", "triangle_surface": "surface_no", "sample_arc": "arc_no"}


def _placed_mesh(rows: dict[str, NDArray[Any]], world_from_part: NDArray[Any], occurrence: int) -> dict[str, Any]:
    rotation, translation = world_from_part[:3, :3], world_from_part[:3, 3]
    surface_no, triangle_surface = np.unique(np.asarray(rows["triangle_surfaces"][0], np.int64), return_inverse=True)
    return {
        "vertices": np.asarray(rows["vertices"][0], float).reshape(-1, 3) @ rotation.T + translation,
        "normals": np.asarray(rows["normals"][0], float).reshape(-1, 3) @ rotation.T,
        "triangles": np.asarray(rows["triangles"][0], np.int64).reshape(-1, 3),
        "triangle_surface": triangle_surface.astype(np.int64),
        "surface_no": surface_no,
        "surface_occurrence": np.full(len(surface_no), occurrence),
    }


def _spread(rows: dict[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """Rows of `scene/arcs` with all samples (n, width) of all arcs after each other."""
    count = rows["sample_count"].astype(np.int64)
    widths = {"points": 3, "tangents": 3, "normals_a": 3, "normals_b": 3}
    spread = {name: spread_samples(rows[name].tolist(), count, width) for name, width in widths.items()}
    return {**rows, "sample_count": count, **spread}


def _placed_arcs(rows: dict[str, NDArray[Any]], world_from_part: NDArray[Any], occurrence: int) -> dict[str, Any]:
    rotation, translation = world_from_part[:3, :3], world_from_part[:3, 3]
    count = rows["sample_count"]
    sample_arc = np.repeat(np.arange(len(count)), count)
    sides = [[-1 if n is None or n != n else n for n in rows[side].tolist()] for side in ("surface_a", "surface_b")]
    return {
        "points": rows["points"] @ rotation.T + translation,
        "tangents": rows["tangents"] @ rotation.T,
        "normals_a": rows["normals_a"] @ rotation.T,
        "normals_b": rows["normals_b"] @ rotation.T,
        "sample_arc": sample_arc,
        "length": _lengths(rows["points"], sample_arc),
        "arc_no": rows["arc_no"].astype(np.int64),
        "arc_surfaces": np.array(sides, np.int64).T,
        "arc_occurrence": np.full(len(count), occurrence),
    }


def _number_surfaces(mesh: dict[str, NDArray[Any]], arc: dict[str, NDArray[Any]]) -> Ints:
    """The scene's surfaces (a, 2) on either side of each arc, which names them by their numbers in the part's shape."""
    # Occurrence and number as one key; -1 lies below all.
    width = int(max(mesh["surface_no"].max(initial=0), arc["arc_surfaces"].max(initial=0))) + 2
    keys = mesh["surface_occurrence"] * width + mesh["surface_no"] + 1
    wanted = arc["arc_occurrence"][:, None] * width + arc["arc_surfaces"] + 1
    order = np.argsort(keys, kind="stable")
    at = np.minimum(np.searchsorted(keys[order], wanted), len(keys) - 1)
    return np.where(keys[order][at] == wanted, order[at], -1).astype(np.int64)


def _radii(mesh: dict[str, NDArray[Any]], shape_id: NDArray[Any], cylinders: dict[str, NDArray[Any]]) -> Floats:
    """The radius (s,) of each of the scene's surfaces, nan where it is no cylinder."""
    keys = zip(cylinders["shape_id"].tolist(), cylinders["surface_no"].tolist(), strict=True)
    of = dict(zip(keys, cylinders["radius"].tolist(), strict=True))
    shape = shape_id[mesh["surface_occurrence"]].tolist()
    names = zip(shape, mesh["surface_no"].tolist(), strict=True)
    return np.array([of.get(name, np.nan) for name in names], float)


def _lengths(points: NDArray[Any], arc: Ints) -> NDArray[Any]:
    """How much of its arc each sample stands for: half the way to either neighbour, mm."""
    step = np.linalg.norm(np.diff(points, axis=0), axis=1) * (arc[1:] == arc[:-1])
    return np.concatenate([[0.0], step]) / 2 + np.concatenate([step, [0.0]]) / 2


def _stacked(pieces: list[dict[str, Any]]) -> dict[str, NDArray[Any]]:
    out: dict[str, NDArray[Any]] = {}
    for name in pieces[0]:
        base, moved, at = _COUNTED.get(name), [], 0
        for piece in pieces:
            moved.append(piece[name] + at if base else piece[name])
            at += len(piece[base]) if base else 0
        out[name] = np.concatenate(moved)
    return out


# Scenes of a store's worlds that are read once and kept, with what was made of them, for the next inspection.

_MOST = 4  # selections of a world that are kept: views from a few places, over and over; some 60 MB each of a bulkhead


class Scenes:
    """Scenes of worlds of a store, as `read_scene` gives them; what is asked for again is the one that was given.

    A revision of a world is a world of its own.  All are read anew where a run that is no inspection has written since.
    """

    def __init__(self, store: Store) -> None:
        self.store = store
        self._changed: object = None
        self._kept: dict[tuple[int, tuple[int, ...] | None], StoredScene] = {}

    def read(self, connection: Connection, world_id: int, among: Sequence[int] | None = None) -> StoredScene:
        """The scene of the placed parts of a world; `among` and errors as those of `read_scene`."""
        (changed,) = self.store.rows(connection, "scene/changes")
        if changed != self._changed:
            self._kept.clear()
            self._changed = changed
        key = (world_id, None if among is None else tuple(among))
        found = self._kept.pop(key, None) or read_scene(self.store, connection, world_id, among)
        mine = [other for other in self._kept if other[0] == world_id]
        if len(mine) >= _MOST:
            del self._kept[mine[0]]  # what was asked for longest ago
        self._kept[key] = found
        return found

    def keep_only(self, worlds: Collection[int]) -> None:
        """Drop the scenes of all other worlds: of earlier revisions, and what is not inspected any more."""
        self._kept = {key: scene for key, scene in self._kept.items() if key[0] in worlds}
