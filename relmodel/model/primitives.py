"""Boxes, cylinders and spheres as exact boundary representations, by closed forms and without the CAD kernel.

The rows are those that the kernel's own primitives give: seams, degenerate arcs at poles and pcurves included.
"""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from relmodel.arrays import Floats, Ints
from relmodel.columns import Ragged
from relmodel.geometry.curves import Curves, box_columns, vector_columns
from relmodel.geometry.surfaces import Surfaces
from relmodel.model import measures
from relmodel.model.model import Mesh, Shape, Table
from relmodel.model.tessellation import HalfEdges, surface_deviation
from relmodel.model.trimmed_faces import TrimmedFaces

CHORD_MM = 0.05
CHORD_RAD = 0.15
_MOST_SEGMENTS = 360
_TURN = 2 * np.pi
_NONE = np.full(3, np.nan)
_X, _Z = np.eye(3)[0], np.eye(3)[2]

Corners = list[tuple[int, int]]  # coedges of a loop: arc, 1 where it runs against the arc


def box(size: npt.ArrayLike) -> Shape:
    """A box with sides size (3,), mm, about the origin."""
    half = np.asarray(size, float) / 2
    corner = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * half
    rows = _Rows()
    edges: dict[tuple[int, int], int] = {}
    meshes = []
    for k in range(3):
        for side in (-1.0, 1.0):
            z, x = side * np.eye(3)[k], np.eye(3)[(k + 1) % 3]
            y = np.cross(z, x)
            a, b = float(abs(x @ half)), float(abs(y @ half))
            around = np.array([-a * x - b * y, a * x - b * y, a * x + b * y, -a * x + b * y]) + (half @ np.abs(z)) * z
            ring = [int(np.argmin(np.abs(corner - p).sum(axis=1))) for p in around]
            coedges: Corners = []
            for start, end in zip(ring, ring[1:] + ring[:1], strict=True):
                ends = min(start, end), max(start, end)
                if ends not in edges:
                    edges[ends] = rows.line(corner[ends[0]], corner[ends[1]])
                coedges.append((edges[ends], int(start > end)))
            centre = (half @ np.abs(z)) * z
            rows.surface(
                "plane", centre, x, z, None, (-a, a, -b, b), 4 * a * b, centre, np.r_[around.min(0), around.max(0)]
            )
            rows.loop(coedges)
            meshes.append((around, np.tile(z, (4, 1)), np.array([[0, 1, 2], [0, 2, 3]])))
    return rows.shape(8 * float(np.prod(half)), meshes)


def cylinder(radius: float, length: float) -> Shape:
    """A cylinder about z through the origin, mm."""
    rows = _Rows()
    half = length / 2
    top, bottom = half * _Z, -half * _Z
    upper = rows.circle(top, _X, _Z, radius, 0.0, _TURN)
    seam = rows.line(bottom + radius * _X, top + radius * _X)
    lower = rows.circle(bottom, _X, _Z, radius, 0.0, _TURN)
    bounds = np.array([-radius, -radius, -half, radius, radius, half])
    rows.surface(
        "cylinder", bottom, _X, _Z, radius, (0, _TURN, 0, length), _TURN * radius * length, np.zeros(3), bounds
    )
    rows.loop(
        [(upper, 1), (seam, 1), (lower, 0), (seam, 0)],
        [((0, length), (1, 0), _TURN), ((0, 0), (0, 1), length), ((0, 0), (1, 0), _TURN), ((_TURN, 0), (0, 1), length)],
    )
    disc = np.pi * radius**2
    for centre, arc, against in ((top, upper, 0), (bottom, lower, 1)):
        flat = np.r_[-radius, -radius, centre[2], radius, radius, centre[2]]
        domain = (-radius, radius, -radius, radius)
        rows.surface("plane", centre, _X, _Z, None, domain, disc, centre, flat, reversed_=bool(against))
        rows.loop([(arc, against)])

    n = _segments(radius)
    u = np.linspace(0, _TURN, n + 1)
    e = np.stack([np.cos(u), np.sin(u), np.zeros(n + 1)], axis=1)
    meshes = [_grid(np.stack([radius * e + bottom, radius * e + top], axis=1), np.stack([e, e], axis=1))]
    fan = np.stack([np.zeros(n - 2, np.int64), np.arange(1, n - 1), np.arange(2, n)], axis=1)
    meshes.append((radius * e[:-1] + top, np.tile(_Z, (n, 1)), fan))
    meshes.append((radius * e[:-1] + bottom, np.tile(-_Z, (n, 1)), fan[:, ::-1]))
    return rows.shape(disc * length, meshes)


def sphere(radius: float) -> Shape:
    """A sphere about the origin, mm."""
    rows = _Rows()
    north = rows.degenerate(radius * _Z)
    seam = rows.circle(np.zeros(3), _X, -np.eye(3)[1], radius, 1.5 * np.pi, 2.5 * np.pi)
    south = rows.degenerate(-radius * _Z)
    quarter = np.pi / 2
    bounds = radius * np.array([-1.0, -1, -1, 1, 1, 1])
    area = 4 * np.pi * radius**2
    rows.surface("sphere", np.zeros(3), _X, _Z, radius, (0, _TURN, -quarter, quarter), area, np.zeros(3), bounds)
    rows.loop(
        [(north, 1), (seam, 1), (south, 0), (seam, 0)],
        [
            ((0, quarter), (1, 0), None),
            ((0, -_TURN), (0, 1), None),
            ((0, -quarter), (1, 0), None),
            ((_TURN, -_TURN), (0, 1), None),
        ],
    )
    n = _segments(radius)
    u, v = np.meshgrid(np.linspace(0, _TURN, n + 1), np.linspace(-quarter, quarter, n // 2 + 1), indexing="ij")
    normals = np.stack([np.cos(v) * np.cos(u), np.cos(v) * np.sin(u), np.sin(v)], axis=2)
    return rows.shape(area * radius / 3, [_grid(radius * normals, normals)])


def _segments(radius: float) -> int:
    """Even number of segments of a full turn within the chord's tolerances."""
    chord = float(np.arccos(max(1 - CHORD_MM / radius, 0.0)))
    return 2 * int(np.ceil(min(max(_TURN / CHORD_RAD, np.pi / chord), _MOST_SEGMENTS) / 2))


_MeshPiece = tuple[Floats, Floats, Ints]


def _grid(points: Floats, normals: Floats) -> _MeshPiece:
    """Triangles of a grid of points (n, m, 3), counter-clockwise from outside; those without an area left out."""
    n, m = points.shape[:2]
    at = np.arange(n * m).reshape(n, m)
    a, b, c, d = at[:-1, :-1].ravel(), at[1:, :-1].ravel(), at[1:, 1:].ravel(), at[:-1, 1:].ravel()
    triangles = np.stack([np.stack([a, b, c], 1), np.stack([a, c, d], 1)], axis=1).reshape(-1, 3)
    flat = points.reshape(-1, 3)
    corner = flat[triangles]
    area = np.linalg.norm(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1)
    return flat, normals.reshape(-1, 3), triangles[area > 1e-9 * area.max()]


class _Rows:
    """Rows of surfaces, arcs, loops, coedges and pcurves as they are added; a loop belongs to the latest surface."""

    def __init__(self) -> None:
        self.surfaces: list[dict[str, Any]] = []
        self.arcs: list[dict[str, Any]] = []
        self.coedges: list[tuple[int, int, int, int, bool]] = []
        self.pcurves: list[dict[str, Any]] = []

    def surface(
        self,
        kind: Literal["plane", "cylinder", "sphere"],
        origin: Floats,
        x: Floats,
        z: Floats,
        radius: float | None,
        domain: tuple[float, float, float, float],
        area: float,
        centroid: Floats,
        bounds: Floats,
        *,
        reversed_: bool = False,
    ) -> None:
        self.surfaces.append(
            {
                "kind": kind, "origin": origin, "axis_x": x, "axis_z": z,
                "radius": np.nan if radius is None else radius, "domain": domain, "reversed": reversed_,
                "area": area, "centroid": centroid, "box": bounds,
            }
        )  # fmt: skip

    def line(self, start: Floats, end: Floats) -> int:
        length = float(np.linalg.norm(end - start))
        return self._arc("line", start, (end - start) / length, _NONE, np.nan, 0.0, length)

    def circle(self, centre: Floats, x: Floats, z: Floats, radius: float, t0: float, t1: float) -> int:
        return self._arc("circle", centre, x, z, radius, t0, t1)

    def degenerate(self, point: Floats) -> int:
        return self._arc("degenerate", point, _NONE, _NONE, np.nan, 0.0, _TURN)

    def _arc(self, kind: str, origin: Floats, x: Floats, z: Floats, radius: float, t0: float, t1: float) -> int:
        self.arcs.append(
            {"kind": kind, "origin": origin, "axis_x": x, "axis_z": z, "radius": radius, "t0": t0, "t1": t1}
        )
        return len(self.arcs) - 1

    def loop(self, coedges: Corners, pcurves: list[tuple[Any, Any, float | None]] | None = None) -> None:
        """The loop of the latest surface; pcurves: origin and axis (u, v) of each, which are lines."""
        surface = len(self.surfaces) - 1
        for no, (arc, against) in enumerate(coedges):
            self.coedges.append((surface, 0, no, arc, bool(against)))
            if pcurves is not None:
                self.pcurves.append({"key": (surface, 0, no), "uv": (*pcurves[no][0], *pcurves[no][1]), "arc": arc})

    def shape(self, volume: float, meshes: list[_MeshPiece]) -> Shape:
        surface_columns, arc_columns = self._surface_columns(), self._arc_columns()
        count = len(self.surfaces)
        loops: Table = {
            "surface_no": np.arange(count),
            "loop_no": np.zeros(count, np.int64),
            "outer_loop": np.ones(count, bool),
        }
        names = ("surface_no", "loop_no", "coedge_no", "arc_no", "reversed")
        coedges: Table = {n: np.array([c[i] for c in self.coedges]) for i, n in enumerate(names)}
        pcurves = self._pcurve_columns()
        curves = Curves(arc_columns, {})
        surfaces = Surfaces(surface_columns)
        arc_columns |= measures.arc_measures(curves)
        normals = measures.ArcNormals(TrimmedFaces(surfaces, curves, coedges, pcurves))
        arc_columns |= measures.adjacency(normals)
        return Shape(
            kind="solid",
            volume=volume,
            surfaces=surface_columns,
            arcs=arc_columns,
            loops=loops,
            coedges=coedges,
            pcurves=pcurves,
            mesh=_joined(meshes, surfaces),
            samples=measures.samples(normals, arc_columns["length"]),
        )

    def _surface_columns(self) -> Table:
        given, count = self.surfaces, len(self.surfaces)
        kinds = [s["kind"] for s in given]
        domain = np.array([s["domain"] for s in given], float)
        return {
            "kind": kinds,
            "recognised_kind": list(kinds),
            **{k: v for n in ("origin", "axis_x", "axis_z") for k, v in _vectors(n, given).items()},
            "radius": np.array([s["radius"] for s in given], float),
            "radius2": np.full(count, np.nan),
            "semi_angle": np.full(count, np.nan),
            **{n: domain[:, i].copy() for i, n in enumerate(("u0", "u1", "v0", "v1"))},
            "direct": np.ones(count, bool),
            "reversed": np.array([s["reversed"] for s in given], bool),
            "provenance": ["exact"] * count,
            "residual": np.full(count, np.nan),
            "area": np.array([s["area"] for s in given], float),
            **_vectors("centroid", given),
            **box_columns(np.array([s["box"] for s in given], float)),
            **{n: [None] * count for n in ("name", "colour", "layer")},
        }

    def _arc_columns(self) -> Table:
        given, count = self.arcs, len(self.arcs)
        kinds = [a["kind"] for a in given]
        return {
            "kind": kinds,
            "recognised_kind": list(kinds),
            **{k: v for n in ("origin", "axis_x", "axis_z") for k, v in _vectors(n, given).items()},
            **{n: np.array([a[n] for a in given], float) for n in ("radius", "t0", "t1")},
            "radius2": np.full(count, np.nan),
            "provenance": ["exact"] * count,
            "residual": np.full(count, np.nan),
        }

    def _pcurve_columns(self) -> Table:
        given, count = self.pcurves, len(self.pcurves)
        keys = np.array([p["key"] for p in given], np.int64).reshape(-1, 3)
        uv = np.array([p["uv"] for p in given], float).reshape(-1, 4)
        return {
            **{n: keys[:, i].copy() for i, n in enumerate(("surface_no", "loop_no", "coedge_no"))},
            "kind": ["line"] * count,
            **{n: uv[:, i].copy() for i, n in enumerate(("origin_u", "origin_v", "axis_u", "axis_v"))},
            "direct": np.ones(count, bool),
            "radius": np.full(count, np.nan),
            "radius2": np.full(count, np.nan),
            **{n: np.array([self.arcs[p["arc"]][n] for p in given], float) for n in ("t0", "t1")},
            "degree": [None] * count,
            "periodic": [None] * count,
            **{n: Ragged.pack([None] * count) for n in ("knots", "poles", "weights")},
            "multiplicities": Ragged.pack([None] * count, np.int32),
        }


def _vectors(name: str, rows: list[dict[str, Any]]) -> dict[str, Floats]:
    return vector_columns(name, np.array([r[name] for r in rows], float))


def _joined(pieces: list[_MeshPiece], surfaces: Surfaces) -> Mesh:
    starts = np.cumsum([0] + [len(points) for points, _, _ in pieces])
    triangles = [t + start for (_, _, t), start in zip(pieces, starts[:-1].tolist(), strict=True)]
    vertices = np.concatenate([p for p, _, _ in pieces])
    corners = np.concatenate(triangles).astype(np.int32)
    owner = np.repeat(np.arange(len(pieces)), [len(t) for t in triangles])
    uv = np.zeros((len(vertices), 2))  # not asked for: the surfaces are analytic
    return Mesh(
        chord_mm=CHORD_MM,
        chord_rad=CHORD_RAD,
        vertices=vertices,
        normals=np.concatenate([n for _, n, _ in pieces]).astype(np.float32),
        triangles=corners,
        triangle_surfaces=owner.astype(np.int32),
        deviation_mm=surface_deviation(surfaces, vertices, uv, corners, HalfEdges.of(corners), owner, CHORD_MM),
    )
