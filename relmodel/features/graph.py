"""The attributed adjacency graph of a shape, and what a feature in it is: its class, frame, rectangles and boxes."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from relmodel.arrays import Bools, Floats, Ints
from relmodel.features.feature_parameters import DEFAULTS
from relmodel.geometry.congruence import clusters, components, group_bounds, unsigned
from relmodel.geometry.curves import boxes_of, vectors
from relmodel.geometry.transforms import outermost, rigid
from relmodel.model.content_keys import content_key, quantised
from relmodel.model.model import Shape

_ALL = DEFAULTS.common

Dimensions = dict[str, tuple[float, str]]  # value and unit by name
Rectangle = tuple[Floats, Floats, float, float]  # direction of its length, its centre, length and width


@dataclass
class Feature:
    """A feature in the frame of its shape.

    dimensions: name -> (value, unit: mm, rad, or 1 for counts), as `feature_dimension` holds them; shape_from_feature
    (4, 4): Z out of the material, X along the length; origin at the mouth of a hole, in the middle of a floor, at the
    foot of what stands out, in the middle of the rest; box (6,); surfaces: (surface_no, role); form: numbers that
    distinguish outlines of equal dimensions, mirror images included (`outline_form`)."""

    kind: str
    name: str
    dimensions: Dimensions
    shape_from_feature: Floats
    box: Floats
    surfaces: list[tuple[int, str]]
    form: tuple[float, ...] = ()


def feature_class_key(feature: Feature) -> str:
    """Key of a feature's class: kind, rounded dimensions and form."""
    dimensions = [
        f"{name}={value:.{_ALL.class_digits}f} {unit}" for name, (value, unit) in sorted(feature.dimensions.items())
    ]
    return content_key([feature.kind, *dimensions, *map(str, quantised(feature.form, _ALL.form_quantum).tolist())])


def outline_form(places: Floats, labels: list[str], pose: Floats, *, either_way: bool) -> tuple[float, ...]:
    """Moments of the places of walls along the Z of a frame, mm and mm2: a motion leaves them, a mirror changes them.

    places (n, 3): foot of the frame's origin on a plane, axis of a cylinder; labels: kinds of walls, by which they are
    weighted.  Odd moments distinguish skew outlines, even ones outlines that half a turn maps to themselves (see J.
    Flusser, "On the independence of rotation moment invariants", Pattern Recognition 33, 2000).  either_way: an outline
    that is open at both ends may be looked at from either."""
    local = (places - pose[:3, 3]) @ pose[:3, :2]
    z = local[:, 0] + 1j * local[:, 1]
    out: list[float] = []
    names = sorted(set(labels))
    for label in names:
        own = z[[one == label for one in labels]]
        out += [float(len(own)), float(np.sum(np.abs(own)))]
    weight = np.array([1.0 + names.index(label) for label in labels])
    reach = max(float(np.abs(z).max(initial=0.0)), _ALL.length_mm)
    for power in (1, 2):
        moments = [np.sum(weight * np.abs(z) ** k * z**power) / reach ** (k + power - 1) for k in range(3)]
        out += [float(abs(m)) for m in moments]
        twists = [float((a * np.conj(b)).imag) / reach for a, b in pairwise(moments)]
        out += [abs(t) for t in twists] if either_way else twists
    return tuple(out)


def lengths(**values: float) -> Dimensions:
    """Dimensions in mm."""
    return {name: (float(value), "mm") for name, value in values.items()}


def commonest(values: list[float]) -> float:
    """The value that occurs most often, to the class's digits; the least of those that do."""
    rounded = [round(v, _ALL.class_digits) for v in values]
    return min(values, key=lambda v: (-rounded.count(round(v, _ALL.class_digits)), v))


# Frames, rectangles and boxes that features are measured in.


def cross(a: Floats, b: Floats) -> Floats:
    """Cross product of two vectors (3,), many times faster than NumPy's."""
    a0, a1, a2 = a.tolist()
    b0, b1, b2 = b.tolist()
    return np.array([a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0])


def sideways(axis: Floats) -> tuple[Floats, Floats]:
    """Two unit vectors across a unit axis, right-handed with it."""
    u = cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    u /= np.linalg.norm(u)
    return u, cross(axis, u)


def ahead(direction: Floats) -> Floats:
    """A direction or its opposite: its first component that is clearly not 0 is positive."""
    return -direction if direction[np.argmax(np.abs(direction) > 1e-6)] < 0 else direction


def frame(x: Floats, z: Floats, origin: Floats) -> Floats:
    """shape_from_feature (4, 4) with Z along z and X as near to x as that allows."""
    x = x - (x @ z) * z
    x = x / np.linalg.norm(x)
    return rigid(np.column_stack([x, cross(z, x), z]), origin)


def at_level(point: Floats, up: Floats, level: float) -> Floats:
    """A point moved along a unit vector to a height along it."""
    return np.asarray(point + (level - float(point @ up)) * up)


def off_axis(points: Floats, origin: Floats, axis: Floats) -> Floats:
    """Distances (n,) of points (n, 3) from an axis."""
    arm = points - origin
    return np.asarray(np.linalg.norm(arm - np.outer(arm @ axis, axis), axis=1))


def angle_gaps(arms: Floats, axis: Floats) -> Floats:
    """Gaps (n,), rad, between the directions of arms (n, 3) about an axis, all the way around."""
    u, v = sideways(axis)
    angle = np.sort(np.arctan2(arms @ v, arms @ u))
    return np.diff(angle, append=angle[0] + 2 * np.pi)


def rectangle(points: Floats, normal: Floats) -> Rectangle:
    """Least rectangle across `normal` about points: on a side of their hull (Freeman, Shapira, CACM 18, 1975)."""
    from shapely import convex_hull, get_coordinates, linestrings

    u, v = sideways(normal)
    flat = np.column_stack([points @ u, points @ v])
    hull = get_coordinates(convex_hull(linestrings(flat)))  # one line is faster to make than many points
    sides = np.diff(hull, axis=0)
    sides = sides[np.linalg.norm(sides, axis=1) > 1e-9]
    direction = sides / np.linalg.norm(sides, axis=1, keepdims=True)
    across = np.column_stack([-direction[:, 1], direction[:, 0]])
    along = hull @ direction.T
    crosswise = hull @ across.T
    extent, breadth = np.ptp(along, axis=0), np.ptp(crosswise, axis=0)
    # Of rectangles as small as the least one, the first: equal input gives equal frames.
    best = int(np.argmax(extent * breadth <= (extent * breadth).min() * (1 + 1e-9)))
    d, a = direction[best], across[best]
    middle = d * (along[:, best].min() + extent[best] / 2) + a * (crosswise[:, best].min() + breadth[best] / 2)
    length, width = float(extent[best]), float(breadth[best])
    if width > length:
        d, length, width = a, width, length
    return ahead(d[0] * u + d[1] * v), middle[0] * u + middle[1] * v, length, width


def union(boxes: Floats) -> Floats:
    """The box (6,) around boxes (n, 6)."""
    return np.concatenate([boxes[:, :3].min(axis=0), boxes[:, 3:].max(axis=0)])


# The attributed adjacency graph of a shape: surfaces as nodes with what their triangles show, arcs as edges.
#
# S. Joshi and T. C. Chang, "Graph-based heuristics for recognition of machined features from a 3D solid model",
# Computer-Aided Design 20 (2), 1988.


@dataclass
class SolidSurfaces:
    """The surfaces as recognition sees them, one row for each whole surface.

    kind is the recognised one; axis is a plane's outward normal, and the axis of a surface of revolution; concave
    marks those (and spheres) whose outward normal points to the axis; corner holds the corners of the
    triangles (m, 3 corners, 3), in the order of the surfaces: those of surface i are rows start[i] to start[i + 1]."""

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
    _extents: dict[tuple[int, bytes], tuple[float, float]] = field(default_factory=dict)

    def points(self, surface: int) -> Floats:
        """Corners of the triangles of a surface (n, 3)."""
        return self.corner[self.start[surface] : self.start[surface + 1]].reshape(-1, 3)

    def normals(self, surface: int) -> Floats:
        """Outward normals at `points`."""
        return self.normal[self.start[surface] : self.start[surface + 1]].reshape(-1, 3)

    def along(self, surface: int, direction: Floats) -> tuple[float, float]:
        """Extent of a surface along a direction, from the frame's origin; (inf, -inf) where it has no triangle."""
        key = surface, direction.tobytes()
        if key not in self._extents:
            heights = self.points(surface) @ direction
            self._extents[key] = float(heights.min(initial=np.inf)), float(heights.max(initial=-np.inf))
        return self._extents[key]

    def extent(self, surfaces: Iterable[int], direction: Floats) -> tuple[float, float]:
        """Extent of surfaces together along a direction, from the frame's origin."""
        low, high = zip(*(self.along(i, direction) for i in surfaces), strict=True)
        return min(low), max(high)

    def draft(self, walls: list[int], up: Floats) -> Dimensions:
        """The dimension `draft_angle` of walls that all lean back by one angle from what is upright.

        What rounds the corner of two such planes leans more in its middle: where there are planes, only they count."""
        walls = [i for i in walls if self.kind[i] == "plane"] or walls
        leans = np.concatenate([self.normals(i) @ up for i in walls] or [np.empty(0)])
        angle = float(np.arcsin(np.clip(leans.mean(), -1, 1))) if len(leans) else 0.0
        return {"draft_angle": (angle, "rad")} if angle > _ALL.draft_rad and np.ptp(leans) < _ALL.draft_rad / 5 else {}

    def is_free(self, lines: Floats, axis: Floats, low: float, high: float) -> bool:
        """Whether lines through points (n, 3) along an axis meet no triangle between two heights.

        T. Moeller and B. Trumbore, "Fast, minimum storage ray/triangle intersection", J. Graphics Tools 2 (1), 1997."""
        foot = lines - np.outer(lines @ axis, axis)
        ends = np.concatenate([foot + low * axis, foot + high * axis])
        touched = np.all((self.boxes[:, :3] <= ends.max(axis=0)) & (self.boxes[:, 3:] >= ends.min(axis=0)), axis=1)
        near = [self.corner[self.start[i] : self.start[i + 1]] for i in np.flatnonzero(touched).tolist()]
        corner = np.concatenate([np.empty((0, 3, 3)), *near])
        one, two = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
        p = np.cross(axis, two)
        det = np.sum(one * p, axis=1)
        crossed = np.abs(det) > 1e-12
        det = np.where(crossed, det, 1.0)
        arm = foot[:, None] - corner[None, :, 0]
        u = np.sum(arm * p, axis=2) / det
        q = np.cross(arm, one)
        v = q @ axis / det
        height = np.sum(q * two, axis=2) / det
        return not np.any(crossed & (u >= 0) & (v >= 0) & (u + v <= 1) & (height > low) & (height < high))

    def turn(self, members: list[int]) -> float:
        """Angle (rad) about the axis of the first of the members that all of them cover together."""
        axis = self.axis[members[0]]
        across = np.stack(sideways(axis), axis=1)
        corners = np.concatenate([self.points(i).reshape(-1, 3, 3) for i in members]) - self.origin[members[0]]
        angle = np.arctan2(corners @ across[:, 1], corners @ across[:, 0])
        # A triangle spans less than half a turn: unwrap its corners about the first.
        angle = angle[:, :1] + (angle - angle[:, :1] + np.pi) % (2 * np.pi) - np.pi
        low = np.floor(angle.min(axis=1) / (2 * np.pi) * _ALL.bins).astype(np.int64)
        high = np.ceil(angle.max(axis=1) / (2 * np.pi) * _ALL.bins).astype(np.int64)
        ends = np.bincount(low + _ALL.bins, minlength=3 * _ALL.bins + 2)
        ends = ends - np.bincount(high + _ALL.bins, minlength=3 * _ALL.bins + 2)
        covered = (np.cumsum(ends) > 0)[: 3 * _ALL.bins].reshape(3, _ALL.bins).any(axis=0)
        return float(covered.mean() * 2 * np.pi)


class BoundaryArc(NamedTuple):
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

    Its surfaces are merged from faces that one surface carries; merged_faces: the numbers of those faces of each;
    vertices (n, 3): of all triangles.  links: of each surface those that share an arc with it, and the convexities of
    these arcs.
    sides: of each surface, in the order of its loops; blends: radius of each surface that rounds off an edge between
    others (`blends.rounded`); chamfers: surfaces that cut one off."""

    surfaces: SolidSurfaces
    links: list[dict[int, set[str]]]
    sides: dict[int, list[BoundaryArc]]
    merged_faces: list[list[int]]
    vertices: Floats
    blends: dict[int, float] = field(default_factory=dict)
    chamfers: set[int] = field(default_factory=set)
    _neighbours: dict[tuple[int, str], list[int]] = field(default_factory=dict)

    @cached_property
    def _hull(self) -> Floats:
        return outermost(self.vertices)

    def extent(self, direction: Floats) -> float:
        """Extent of the whole shape along a direction."""
        return float(np.ptp(self._hull @ direction))

    def across(self, surface: int, side: BoundaryArc) -> tuple[str, list[int]]:
        """Convexity of the edge at a side and the surfaces beyond it, as they would be without its blend."""
        blend = side.other
        if side.convexity != "smooth" or blend not in self.blends or surface in self.blends:
            return side.convexity, [side.other] if side.other >= 0 else []
        far = [x.other for x in self.sides.get(blend, []) if x.convexity == "smooth" and x.other != surface]
        return "concave" if self.surfaces.concave[blend] else "convex", [i for i in far if i not in self.blends]

    def neighbours(self, surface: int, convexity: str) -> list[int]:
        """Surfaces beyond the sides of one convexity, blends left out; valid once the blends are known."""
        if (surface, convexity) not in self._neighbours:
            found: set[int] = set()
            for side in self.sides.get(surface, []):
                kind, others = self.across(surface, side)
                if kind == convexity:
                    found.update(others)
            self._neighbours[surface, convexity] = sorted(found - {surface})
        return self._neighbours[surface, convexity]

    def of_kind(self, *kinds: str, concave: bool | None = None) -> list[int]:
        """Surfaces of some kinds that have sides and triangles, in their order; only those that are concave, or not."""
        s = self.surfaces
        found = [i for i in sorted(self.sides) if s.kind[i] in kinds and s.start[i] < s.start[i + 1]]
        return [i for i in found if concave is None or s.concave[i] == concave]

    def plane_key(self, planes: list[int]) -> tuple[float, ...]:
        """Equal for surfaces in the same planes: one, then others in any order."""
        s = self.surfaces
        rows = [(*np.round(s.axis[i], 4), round(float(s.origin[i] @ s.axis[i]), 2)) for i in planes]
        return tuple(float(v) + 0.0 for row in [rows[0], *sorted(set(rows[1:]))] for v in row)

    def support_key(self, i: int) -> tuple[float, ...]:
        """Equal for surfaces in the same plane or cylinder, or of one that runs along it; other kinds have none."""
        s = self.surfaces
        if s.kind[i] == "plane":
            return (0.0, *self.plane_key([i]))
        if s.kind[i] != "cylinder":
            return (2.0, float(i))
        axis = unsigned(s.axis[[i]])[0]
        foot = s.origin[i] - float(s.origin[i] @ axis) * axis
        return (1.0, *(np.round([*axis, *foot, s.radius[i]], 2) + 0.0).tolist())


def boundary(shape: Shape) -> Boundary:
    """The boundary of a shape, without blends and chamfers."""
    face = merge_surfaces(shape)
    merged: list[list[int]] = [[] for _ in range(int(face.max(initial=-1)) + 1)]
    for i, k in enumerate(face.tolist()):
        merged[k].append(i)
    sides: dict[int, list[BoundaryArc]] = {}
    if shape.coedges and shape.loops:
        own, loops, arcs = (np.asarray(shape.coedges[c], np.int64) for c in ("surface_no", "loop_no", "arc_no"))
        loop_of = (np.asarray(shape.loops[c]).tolist() for c in ("surface_no", "loop_no", "outer_loop"))
        flagged = {(i, n) for i, n, outer in zip(*loop_of, strict=True) if outer}
        a, b = (np.asarray(shape.arcs[c], np.int64).tolist() for c in ("surface_a", "surface_b"))
        angle = np.asarray(shape.arcs["angle"], float).tolist()
        length = np.asarray(shape.arcs["length"], float).tolist()
        convexity = shape.arcs["convexity"]
        for surface, loop, arc in zip(own.tolist(), loops.tolist(), arcs.tolist(), strict=True):
            other = b[arc] if a[arc] == surface else a[arc]
            k, beyond = int(face[surface]), int(face[other]) if other >= 0 else -1
            if beyond == k and other != surface:
                continue
            side = BoundaryArc(
                arc, loop, (surface, loop) in flagged, beyond, str(convexity[arc]), angle[arc], length[arc]
            )
            sides.setdefault(k, []).append(side)
        for k, faces in enumerate(merged):
            if len(faces) > 1 and k in sides:
                sides[k] = _relooped(shape, sides[k], plane=shape.surfaces["recognised_kind"][faces[0]] == "plane")
    vertices = np.asarray(shape.mesh.vertices, float)
    return Boundary(describe(shape, face, merged), _links(shape, face, len(merged)), sides, merged, vertices)


def merge_surfaces(shape: Shape) -> Ints:
    """Number of the merged surface that each belongs to: kernels cut a cylinder in two, operations a plane.  Merged
    ones are numbered in the order of their first faces."""
    s = shape.surfaces
    kind = np.asarray(s["recognised_kind"], dtype=str)
    if not shape.arcs:
        return np.arange(len(kind))
    a, b = (np.asarray(shape.arcs[c], np.int64) for c in ("surface_a", "surface_b"))
    smooth = (np.asarray(shape.arcs["convexity"], dtype=str) == "smooth") & (a >= 0) & (b >= 0) & (a != b)
    a, b = a[smooth], b[smooth]
    alike = kind[a] == kind[b]
    a, b = a[alike], b[alike]
    origin, axis = vectors(s, "origin"), vectors(s, "axis_z")
    radius, radius2, lean = (np.asarray(s[c], float) for c in ("radius", "radius2", "semi_angle"))
    arm = origin[b] - origin[a]
    along = np.sum(arm * axis[a], axis=1)
    aside = np.linalg.norm(arm - along[:, None] * axis[a], axis=1) < _ALL.length_mm
    level = np.abs(along) < _ALL.length_mm
    parallel = np.linalg.norm(np.cross(axis[a], axis[b]), axis=1) < _ALL.angle_rad
    equal = np.abs(radius[a] - radius[b]) < _ALL.length_mm
    conical = np.abs(np.abs(lean[a]) - np.abs(lean[b])) < _ALL.angle_rad
    conical &= np.abs(radius[a] + along * np.tan(lean[a]) - radius[b]) < _ALL.length_mm
    one = np.select(
        [kind[a] == k for k in ("plane", "cylinder", "cone", "sphere", "torus")],
        [
            parallel & level,
            parallel & aside & equal,
            parallel & aside & conical,
            aside & level & equal,
            parallel & aside & level & equal & (np.abs(radius2[a] - radius2[b]) < _ALL.length_mm),
        ],
        False,
    )
    _, first, merged = np.unique(components(len(kind), a[one], b[one]), return_index=True, return_inverse=True)
    order = np.argsort(np.argsort(first))
    out: Ints = order[merged]
    return out


def _relooped(shape: Shape, sides: list[BoundaryArc], plane: bool) -> list[BoundaryArc]:
    """Sides of merged faces: loops are what hangs together, of a plane that of the greatest extent is outer."""
    names = [f"{end}_{c}" for end in ("start", "end") for c in "xyz"]
    ends = np.array([[float(shape.arcs[n][x.arc]) for n in names] for x in sides]).reshape(-1, 2, 3)
    corner = clusters(ends.reshape(-1, 3), _ALL.length_mm).reshape(-1, 2)
    label = components(int(corner.max()) + 1, *corner.T)[corner[:, 0]].tolist()
    number = {k: n for n, k in enumerate(dict.fromkeys(label))}
    loop = [number[k] for k in label]
    box = np.array([[float(shape.arcs[n][x.arc]) for n in ("x0", "y0", "z0", "x1", "y1", "z1")] for x in sides])
    size = []
    for n in range(max(loop) + 1):
        own = box[[k == n for k in loop]]
        size.append(round(float(np.linalg.norm(own[:, 3:].max(axis=0) - own[:, :3].min(axis=0))), 6))
    outer = size.index(max(size))
    return [x._replace(loop=n, outer=n == outer if plane else x.outer) for x, n in zip(sides, loop, strict=True)]


def describe(shape: Shape, face: Ints, merged: list[list[int]]) -> SolidSurfaces:
    """Describe merged surfaces by the rows of their first faces and the triangles of all."""
    s = shape.surfaces
    n = len(merged)
    first = np.array([faces[0] for faces in merged], np.int64)
    kind = np.asarray(s["recognised_kind"], dtype=str)[first]
    origin, axis = vectors(s, "origin")[first], vectors(s, "axis_z")[first]
    radius = np.asarray(s["radius"], float)[first]
    owners = face[np.asarray(shape.mesh.triangle_surfaces, np.int64)]
    order = np.argsort(owners, kind="stable")
    triangles = shape.mesh.triangles[order]
    corner = np.asarray(shape.mesh.vertices, float)[triangles]
    normal = np.asarray(shape.mesh.normals, float)[triangles]
    owner = owners[order]
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
    ring = flat / length * radius[owner][:, None]
    arm = np.where(torus[:, None], arm - ring, arm)
    away = np.bincount(owner, area * np.nan_to_num(np.sum(normal.mean(axis=1) * arm, axis=1)), minlength=n)
    box = boxes_of(s)

    return SolidSurfaces(
        kind=kind,
        origin=origin,
        axis=axis * outward[:, None],
        radius=radius,
        radius2=np.asarray(s["radius2"], float)[first],
        semi_angle=np.asarray(s["semi_angle"], float)[first],
        concave=np.isin(kind, ["cylinder", "cone", "sphere", "torus"]) & (away < 0),
        area=np.bincount(face, np.asarray(s["area"], float), minlength=n).astype(np.float64),
        boxes=np.concatenate([group_bounds(box[:, :3], face, n)[0], group_bounds(box[:, 3:], face, n)[1]], axis=1),
        corner=corner,
        normal=normal,
        start=start,
    )


def _links(shape: Shape, face: Ints, count: int) -> list[dict[int, set[str]]]:
    out: list[dict[int, set[str]]] = [{} for _ in range(count)]
    if shape.arcs:
        a, b = (np.asarray(shape.arcs[c], np.int64) for c in ("surface_a", "surface_b"))
        for arc in np.flatnonzero((a >= 0) & (b >= 0)).tolist():
            one, two = int(face[a[arc]]), int(face[b[arc]])
            if one != two:
                for i, j in ((one, two), (two, one)):
                    out[i].setdefault(j, set()).add(str(shape.arcs["convexity"][arc]))
    return out
