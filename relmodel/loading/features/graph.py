"""The attributed adjacency graph of a shape: surfaces as nodes with what its triangles tell of them, arcs as edges.

S. Joshi and T. C. Chang, "Graph-based heuristics for recognition of machined features from a 3D solid model",
Computer-Aided Design 20 (2), 1988.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from relmodel.loading.neutral import Shape, Table

if TYPE_CHECKING:
    import networkx as nx

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]

_UPRIGHT = np.radians(0.5)
_BINS = 720  # of the full turn, for the union of angles


@dataclass
class Surfaces:
    """What features are recognised by, row = surface_no.

    kind is the recognised one; axis is a plane's outward normal, and the axis of a surface of revolution; concave
    tells of those (and of spheres) whether the outward normal points to the axis; corner holds the corners of the
    triangles (m, 3 corners, 3), in the order of the surfaces: those of surface i are rows start[i] to start[i + 1].
    """

    kind: npt.NDArray[Any]
    origin: Floats
    axis: Floats
    radius: Floats
    radius2: Floats
    semi_angle: Floats
    concave: Bools
    area: Floats
    boxes: Floats
    corner: Floats
    normal: Floats
    start: Ints

    def points(self, surface: int) -> Floats:
        """Corners of the triangles of a surface (n, 3)."""
        return self.corner[self.start[surface] : self.start[surface + 1]].reshape(-1, 3)

    def normals(self, surface: int) -> Floats:
        """Outward normals at `points`."""
        return self.normal[self.start[surface] : self.start[surface + 1]].reshape(-1, 3)

    def along(self, surface: int, direction: Floats) -> tuple[float, float]:
        """Extent of a surface along a direction, from the frame's origin; (inf, -inf) where it has no triangle."""
        heights = self.points(surface) @ direction
        return float(heights.min(initial=np.inf)), float(heights.max(initial=-np.inf))

    def draft(self, walls: list[int], up: Floats) -> dict[str, tuple[float, str]]:
        """The dimension `draft_angle` of walls that all lean back by one angle from what is upright."""
        leans = np.concatenate([self.normals(i) @ up for i in walls] or [np.empty(0)])
        angle = float(np.arcsin(np.clip(leans.mean(), -1, 1))) if len(leans) else 0.0
        return {"draft_angle": (angle, "rad")} if angle > _UPRIGHT and np.ptp(leans) < _UPRIGHT / 5 else {}

    def turn(self, members: list[int]) -> float:
        """Angle (rad) about the axis of the first of the members that all of them cover together."""
        axis = self.axis[members[0]]
        u = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
        u /= np.linalg.norm(u)
        across = np.stack([u, np.cross(axis, u)], axis=1)
        corners = np.concatenate([self.points(i).reshape(-1, 3, 3) for i in members]) - self.origin[members[0]]
        angle = np.arctan2(corners @ across[:, 1], corners @ across[:, 0])
        # A triangle spans less than half a turn: unwrap its corners about the first.
        angle = angle[:, :1] + (angle - angle[:, :1] + np.pi) % (2 * np.pi) - np.pi
        low = np.floor(angle.min(axis=1) / (2 * np.pi) * _BINS).astype(np.int64)
        high = np.ceil(angle.max(axis=1) / (2 * np.pi) * _BINS).astype(np.int64)
        ends = np.bincount(low + _BINS, minlength=3 * _BINS + 2)
        ends = ends - np.bincount(high + _BINS, minlength=3 * _BINS + 2)
        covered = (np.cumsum(ends) > 0)[: 3 * _BINS].reshape(3, _BINS).any(axis=0)
        return float(covered.mean() * 2 * np.pi)


class Side(NamedTuple):
    """An arc of a face's boundary, and what lies beyond it (-1: nothing)."""

    arc: int
    loop: int
    outer: bool
    other: int
    convexity: str
    angle: float  # rad, from the face's normal to the other's; convex is positive
    length: float


@dataclass
class Boundary:
    """A shape as features are looked for in it.

    sides: of each surface, in the order of its loops; blends: radius of each surface that rounds off an edge between
    others (`blends.rounded`); chamfers: surfaces that cut one off.
    """

    surfaces: Surfaces
    graph: nx.MultiGraph[int]
    sides: dict[int, list[Side]]
    blends: dict[int, float] = field(default_factory=dict)
    chamfers: set[int] = field(default_factory=set)
    _extents: dict[tuple[float, ...], float] = field(default_factory=dict)

    def extent(self, direction: Floats) -> float:
        """Extent of the whole shape along a direction."""
        key = tuple(np.round(direction, 6).tolist())
        if key not in self._extents:
            self._extents[key] = float(np.ptp(self.surfaces.corner.reshape(-1, 3) @ direction))
        return self._extents[key]

    def across(self, surface: int, side: Side) -> tuple[str, list[int]]:
        """Convexity of the edge at a side and the surfaces beyond it, as they would be without its blend."""
        blend = side.other
        if side.convexity != "smooth" or blend not in self.blends or surface in self.blends:
            return side.convexity, [side.other] if side.other >= 0 else []
        far = [x.other for x in self.sides.get(blend, []) if x.convexity == "smooth" and x.other != surface]
        return "concave" if self.surfaces.concave[blend] else "convex", [i for i in far if i not in self.blends]

    def neighbours(self, surface: int, convexity: str) -> list[int]:
        """Surfaces beyond the sides of one convexity, blends left out."""
        found: set[int] = set()
        for side in self.sides.get(surface, []):
            kind, others = self.across(surface, side)
            if kind == convexity:
                found.update(others)
        return sorted(found - {surface})

    def plane_key(self, planes: list[int]) -> tuple[float, ...]:
        """Equal for pieces of the same planes: one, then others in any order."""
        s = self.surfaces
        rows = [(*np.round(s.axis[i], 4), round(float(s.origin[i] @ s.axis[i]), 2)) for i in planes]
        return tuple(float(v) + 0.0 for row in [rows[0], *sorted(set(rows[1:]))] for v in row)


def boundary(shape: Shape) -> Boundary:
    """The boundary of a shape, without blends and chamfers."""
    sides: dict[int, list[Side]] = {}
    if shape.coedges and shape.loops:
        outer = dict(
            zip(
                zip(*(np.asarray(shape.loops[c]).tolist() for c in ("surface_no", "loop_no")), strict=True),
                np.asarray(shape.loops["outer_loop"]).tolist(),
                strict=True,
            )
        )
        a, b = (np.asarray(shape.arcs[c], np.int64).tolist() for c in ("surface_a", "surface_b"))
        angle = np.asarray(shape.arcs["angle"], float).tolist()
        length = np.asarray(shape.arcs["length"], float).tolist()
        convexity = shape.arcs["convexity"]
        for surface, loop, arc in zip(
            *(np.asarray(shape.coedges[c]).tolist() for c in ("surface_no", "loop_no", "arc_no")), strict=True
        ):
            other = b[arc] if a[arc] == surface else a[arc]
            side = Side(arc, loop, outer[surface, loop], other, str(convexity[arc]), angle[arc], length[arc])
            sides.setdefault(surface, []).append(side)
    return Boundary(describe(shape), adjacency_graph(shape), sides)


def describe(shape: Shape) -> Surfaces:
    """Describe the surfaces of a shape by its rows and its triangles."""
    s = shape.surfaces
    n = len(s["recognised_kind"])
    kind = np.asarray(s["recognised_kind"], dtype=str)
    origin, axis = _points(s, "origin"), _points(s, "axis_z")
    order = np.argsort(shape.mesh.triangle_surfaces, kind="stable")
    triangles = shape.mesh.triangles[order]
    corner = np.asarray(shape.mesh.vertices, float)[triangles]
    normal = np.asarray(shape.mesh.normals, float)[triangles]
    owner = np.asarray(shape.mesh.triangle_surfaces, np.int64)[order]
    start = np.searchsorted(owner, np.arange(n + 1))

    area = np.linalg.norm(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1)
    facing = np.bincount(owner, area * np.sum(normal.mean(axis=1) * axis[owner], axis=1), minlength=n)
    outward = np.where((kind == "plane") & (facing < 0), -1.0, 1.0)
    arm = corner.mean(axis=1) - origin[owner]
    straight = np.isin(kind, ["cylinder", "cone"])[owner]
    arm -= np.where(straight, np.sum(arm * axis[owner], axis=1), 0.0)[:, None] * axis[owner]
    # The centre line of a torus is what its normals point away from.
    torus = (kind == "torus")[owner]
    height = np.sum(arm * axis[owner], axis=1, keepdims=True) * axis[owner]
    flat = arm - height
    length = np.maximum(np.linalg.norm(flat, axis=1, keepdims=True), 1e-300)
    ring = flat / length * np.asarray(s["radius"], float)[owner][:, None]
    arm = np.where(torus[:, None], arm - ring, arm)
    away = np.bincount(owner, area * np.nan_to_num(np.sum(normal.mean(axis=1) * arm, axis=1)), minlength=n)

    return Surfaces(
        kind=kind,
        origin=origin,
        axis=axis * outward[:, None],
        radius=np.asarray(s["radius"], float),
        radius2=np.asarray(s["radius2"], float),
        semi_angle=np.asarray(s["semi_angle"], float),
        concave=np.isin(kind, ["cylinder", "cone", "sphere", "torus"]) & (away < 0),
        area=np.asarray(s["area"], float),
        boxes=np.stack([np.asarray(s[c], float) for c in ("x0", "y0", "z0", "x1", "y1", "z1")], axis=1),
        corner=corner,
        normal=normal,
        start=start,
    )


def adjacency_graph(shape: Shape) -> nx.MultiGraph[int]:
    """Graph of surface_no with an edge for each arc between two surfaces: `arc_no`, `convexity`, `length`."""
    import networkx as nx

    graph: nx.MultiGraph[int] = nx.MultiGraph()
    graph.add_nodes_from(range(len(shape.surfaces["recognised_kind"])))
    if not shape.arcs:
        return graph
    a, b = (np.asarray(shape.arcs[c], np.int64) for c in ("surface_a", "surface_b"))
    length = np.asarray(shape.arcs["length"], float)
    convexity = shape.arcs["convexity"]
    for arc_no in np.flatnonzero((a >= 0) & (b >= 0) & (a != b)).tolist():
        graph.add_edge(
            int(a[arc_no]),
            int(b[arc_no]),
            arc_no=arc_no,
            convexity=str(convexity[arc_no]),
            length=float(length[arc_no]),
        )
    return graph


def _points(table: Table, name: str) -> Floats:
    return np.stack([np.asarray(table[f"{name}_{c}"], float) for c in "xyz"], axis=1)
