"""Machined features of a shape: through and blind holes, and pockets, found in its attributed adjacency graph."""

from __future__ import annotations

from dataclasses import dataclass

import networkx as nx
import numpy as np
import numpy.typing as npt

from relmodel.loading.adjacency import Surfaces, adjacency_graph, describe
from relmodel.loading.clusters import clusters, unsigned
from relmodel.loading.identity import content_key
from relmodel.loading.neutral import Shape

Floats = npt.NDArray[np.float64]

_LENGTH_TOLERANCE = 1e-3  # mm, for "on one axis", "of one radius"
_ANGLE_TOLERANCE = 1e-5  # rad, for "along one axis"
_HOLDS_A_PIN = np.pi * 1.05  # a cylinder of more than half a turn; exactly half is the end of a slot
_STEEP = np.sin(np.radians(10))  # walls may have this much draft
_MOST_OF_A_MESH = 20_000
_CLASS_DIGITS = 4  # of mm and rad: dimensions that agree to them are of one class


@dataclass
class Feature:
    """A feature in the frame of its shape.

    dimensions: name -> (value, unit), as `feature_dimension` holds them; shape_from_feature (4, 4): origin at the
    mouth of a hole or in the middle of a pocket's floor, Z out of the material, X along a pocket's length; box (6,);
    surfaces: (surface_no, role).
    """

    kind: str
    name: str
    dimensions: dict[str, tuple[float, str]]
    shape_from_feature: Floats
    box: Floats
    surfaces: list[tuple[int, str]]


def recognise(shape: Shape) -> list[Feature]:
    """Features of a shape, in the order of their first surface: holes, then pockets.

    A mesh of more than 20,000 surfaces is a scan and not a tessellated part: nothing is looked for in it.
    """
    if len(shape.mesh.triangles) == 0 or (shape.kind == "mesh" and len(shape.surfaces["kind"]) > _MOST_OF_A_MESH):
        return []
    surfaces = describe(shape)
    graph = adjacency_graph(shape)
    holes = _holes(surfaces, graph)
    taken = {surface for hole in holes for surface, _ in hole.surfaces}
    features = holes + _pockets(shape, surfaces, graph, taken)
    counts: dict[str, int] = {}
    for feature in features:
        counts[feature.kind] = counts.get(feature.kind, 0) + 1
        feature.name = f"{feature.kind} {counts[feature.kind]}"
    return features


def feature_class_key(feature: Feature) -> str:
    """Key of a feature's class: kind and rounded dimensions."""
    dimensions = sorted(feature.dimensions.items())
    return content_key(
        [feature.kind, *(f"{name}={value:.{_CLASS_DIGITS}f} {unit}" for name, (value, unit) in dimensions)]
    )


def _holes(s: Surfaces, graph: nx.MultiGraph[int]) -> list[Feature]:
    """Stacks of coaxial concave surfaces of revolution around a cylinder of more than half a turn."""
    bores = _bores(s)
    if not bores:
        return []
    # Surfaces of revolution on the axis of some bore, and the planes across it that have no other neighbours.
    leader = {i: bore[0] for bore in bores for i in bore}
    stack: nx.Graph[int] = nx.Graph()
    for bore in bores:
        nx.add_path(stack, bore)
    todo = [i for bore in bores for i in bore]
    while todo:
        i = todo.pop()
        for j in graph.neighbors(i):
            if j in leader:
                if _on_axis(s, leader[i], leader[j]):
                    stack.add_edge(i, j)
            elif _turned_about(s, leader[i], j) or _closes(s, graph, leader, i, j):
                leader[j] = leader[i]
                stack.add_edge(i, j)
                todo.append(j)
    bore_of = {i: bore for bore in bores for i in bore}
    holes = []
    for members in sorted(sorted(component) for component in nx.connected_components(stack)):
        own = {bore_of[i][0]: bore_of[i] for i in members if i in bore_of}
        holes.append(_hole(s, members, list(own.values())))
    return holes


def _bores(s: Surfaces) -> list[list[int]]:
    """Concave cylinders merged where they are one: same axis and radius, touching extents, more than half a turn."""
    rows = np.flatnonzero(s.concave & (s.kind == "cylinder") & (np.diff(s.start) > 0))
    if len(rows) == 0:
        return []
    axis, origin = unsigned(s.axis[rows]), s.origin[rows]
    foot = origin - np.sum(origin * axis, axis=1, keepdims=True) * axis
    direction = clusters(axis, _ANGLE_TOLERANCE)
    label = clusters(np.column_stack([direction * 1e3, foot, s.radius[rows]]), _LENGTH_TOLERANCE)
    bores = []
    for k in range(int(label.max()) + 1):
        members = rows[label == k].tolist()
        extents = sorted((*s.along(i, s.axis[members[0]]), i) for i in members)
        bore, reach = [extents[0][2]], extents[0][1]
        for low, high, i in extents[1:]:
            if low > reach + _LENGTH_TOLERANCE:
                bores.append(sorted(bore))
                bore = []
            bore.append(i)
            reach = max(reach, high)
        bores.append(sorted(bore))
    return sorted(bore for bore in bores if s.turn(bore) > _HOLDS_A_PIN)


def _on_axis(s: Surfaces, bore: int, other: int) -> bool:
    """Whether the axis of one surface of revolution is that of a bore."""
    axis, arm = s.axis[bore], s.origin[other] - s.origin[bore]
    if not np.linalg.norm(np.cross(axis, arm)) < _LENGTH_TOLERANCE:
        return False
    return bool(s.kind[other] == "sphere" or np.linalg.norm(np.cross(axis, s.axis[other])) < _ANGLE_TOLERANCE)


def _turned_about(s: Surfaces, bore: int, other: int) -> bool:
    """Whether a concave cone, torus or sphere belongs to the stack of a bore: countersink, tip, bottom fillet."""
    return bool(s.concave[other] and s.kind[other] in ("cone", "torus", "sphere") and _on_axis(s, bore, other))


def _closes(s: Surfaces, graph: nx.MultiGraph[int], leader: dict[int, int], member: int, plane: int) -> bool:
    """Whether a plane across the axis has no neighbours but surfaces of the stack: a bottom or a counterbore's step."""
    axis = s.axis[leader[member]]
    if s.kind[plane] != "plane" or not np.linalg.norm(np.cross(axis, s.axis[plane])) < _ANGLE_TOLERANCE:
        return False
    # The next bore of a step is in `leader` from the start; a tip or fillet beyond is tried by its own rule.
    return all(
        (k in leader and _on_axis(s, leader[member], leader[k])) or _turned_about(s, leader[member], k)
        for k in graph.neighbors(plane)
    )


def _hole(s: Surfaces, members: list[int], bores: list[list[int]]) -> Feature:
    narrow = min(bores, key=lambda bore: (s.radius[bore[0]], bore))
    axis, origin = s.axis[narrow[0]], s.origin[narrow[0]]
    zero = float(origin @ axis)
    roles: dict[int, str] = {}
    bottoms: list[float] = []
    wide: list[tuple[float, float]] = []  # radius, place along the axis, of what is wider than the bore
    cones: list[tuple[float, int]] = []
    tips: list[int] = []  # pointed or round bottoms, beyond the depth of full diameter
    for i in members:
        low, high = s.along(i, axis)
        middle = (low + high) / 2 - zero
        arm = s.points(i) - origin
        arm -= np.outer(arm @ axis, axis)
        reach = np.linalg.norm(arm, axis=1)
        on_axis = s.kind[i] in ("cone", "sphere", "torus") and reach.min(initial=np.inf) < 1e-2 * s.radius[narrow[0]]
        if i in narrow:
            roles[i] = "wall"
        elif on_axis or (s.kind[i] == "plane" and s.loop_count[i] == 1):
            roles[i] = "bottom"
            bottoms.append(middle)
            if on_axis:
                tips.append(i)
        elif s.kind[i] == "plane":
            roles[i] = "step"
        elif s.kind[i] == "cone":
            roles[i] = "countersink"
            cones.append((float(reach.max(initial=0.0)), i))
            wide.append((float(reach.max(initial=0.0)), middle))
        elif s.kind[i] == "cylinder":
            roles[i] = "counterbore"
            wide.append((float(s.radius[i]), middle))
        else:
            roles[i] = "blend"
    extents = [s.along(i, axis) for i in members if i not in tips]
    low, high = min(e[0] for e in extents) - zero, max(e[1] for e in extents) - zero
    core = [s.along(i, axis) for i in narrow]
    centre = (min(e[0] for e in core) + max(e[1] for e in core)) / 2 - zero
    # Z out of the material: away from the bottom, else towards the widest end, else towards positive coordinates.
    if bottoms:
        towards = centre - bottoms[0]
    elif wide:
        towards = max(wide)[1] - centre
    else:
        towards = float(axis[np.argmax(np.abs(axis) > 1e-6)])
    z = axis if towards > 0 else -axis
    mouth = origin + axis * (high if towards > 0 else low)

    dimensions = {"diameter": (2 * float(s.radius[narrow[0]]), "mm"), "depth": (high - low, "mm")}
    counterbores = [i for i in members if roles[i] == "counterbore"]
    if counterbores:
        widest = max(float(s.radius[i]) for i in counterbores)
        ends = [s.along(i, axis) for i in counterbores if widest - s.radius[i] < _LENGTH_TOLERANCE]
        dimensions["counterbore_diameter"] = (2 * widest, "mm")
        dimensions["counterbore_depth"] = (max(e[1] for e in ends) - min(e[0] for e in ends), "mm")
    if cones:
        radius, cone = max(cones)
        dimensions["countersink_diameter"] = (2 * radius, "mm")
        dimensions["countersink_angle"] = (2 * abs(float(s.semi_angle[cone])), "rad")
    pointed = [abs(float(s.semi_angle[i])) for i in tips if s.kind[i] == "cone"]
    if pointed:
        dimensions["tip_angle"] = (2 * max(pointed), "rad")
    x = np.cross(np.eye(3)[np.argmin(np.abs(z))], z)
    return Feature(
        kind="blind_hole" if bottoms else "through_hole",
        name="",
        dimensions=dimensions,
        shape_from_feature=_frame(x, z, mouth),
        box=_union(s.boxes[members]),
        surfaces=sorted(roles.items()),
    )


def _pockets(shape: Shape, s: Surfaces, graph: nx.MultiGraph[int], taken: set[int]) -> list[Feature]:
    """Planes whose whole outer boundary rises into walls, at once or through a fillet."""
    if not shape.coedges or not shape.loops:
        return []
    outer = {
        (a, b)
        for a, b, is_outer in zip(
            np.asarray(shape.loops["surface_no"]).tolist(),
            np.asarray(shape.loops["loop_no"]).tolist(),
            np.asarray(shape.loops["outer_loop"], bool).tolist(),
            strict=True,
        )
        if is_outer
    }
    bounds: dict[int, list[int]] = {}
    for surface, loop, arc in zip(
        *(np.asarray(shape.coedges[c]).tolist() for c in ("surface_no", "loop_no", "arc_no")), strict=True
    ):
        meshed = s.start[surface] < s.start[surface + 1]
        if (surface, loop) in outer and s.kind[surface] == "plane" and meshed and surface not in taken:
            bounds.setdefault(surface, []).append(arc)
    # A floor may be cut into several faces of one plane.
    flat: nx.Graph[int] = nx.Graph()
    flat.add_nodes_from(bounds)
    flat.add_edges_from(
        (a, b) for a, b, edge in graph.edges(data=True) if edge["convexity"] == "smooth" and {a, b} <= bounds.keys()
    )
    found = []
    for floor in sorted(sorted(component) for component in nx.connected_components(flat)):
        if all(_rises(shape, s, set(floor), i, arc) for i in floor for arc in bounds[i]):
            pocket = _pocket(s, graph, floor)
            if pocket is not None:
                found.append(pocket)
    return found


def _rises(shape: Shape, s: Surfaces, floor: set[int], face: int, arc: int) -> bool:
    """Whether what lies beyond an arc of a face of a floor is a wall, a fillet that leads up to one, or more floor."""
    convexity = shape.arcs["convexity"][arc]
    a, b = int(shape.arcs["surface_a"][arc]), int(shape.arcs["surface_b"][arc])
    other = b if a == face else a
    if convexity == "degenerate" or (convexity == "smooth" and other != face and other in floor):
        return True
    if other < 0 or other in floor or convexity not in ("concave", "smooth"):
        return False
    return bool(convexity == "concave" or (s.kind[other] != "plane" and _above(s, face, other)))


def _above(s: Surfaces, floor: int, other: int) -> bool:
    low, high = s.along(other, s.axis[floor])
    level = float(s.origin[floor] @ s.axis[floor])
    return low - level > -_LENGTH_TOLERANCE and high - level > _LENGTH_TOLERANCE


def _pocket(s: Surfaces, graph: nx.MultiGraph[int], floor: list[int]) -> Feature | None:
    up, level = s.axis[floor[0]], float(s.origin[floor[0]] @ s.axis[floor[0]])
    roles = dict.fromkeys(floor, "floor")
    todo = list(floor)
    while todo:
        i = todo.pop()
        for j in sorted(graph.neighbors(i)):
            crossed = {edge["convexity"] for edge in graph.get_edge_data(i, j).values()}
            if j in roles or not crossed & {"concave", "smooth"}:
                continue
            steep = float(np.abs(s.normals(j) @ up).max(initial=0.0)) < _STEEP
            if ("concave" in crossed and roles[i] == "floor") or (
                "smooth" in crossed and steep and roles[i] == "blend"
            ):
                roles[j] = "wall"
            elif "smooth" in crossed and not steep and s.kind[j] != "plane" and _above(s, floor[0], j):
                roles[j] = "blend"
                todo.append(j)
    walls = [i for i, role in roles.items() if role == "wall"]
    # A hollow closed on all sides has no mouth.
    if not any(
        edge["convexity"] == "convex" or (edge["convexity"] == "smooth" and j not in roles)
        for i in walls
        for j in graph.neighbors(i)
        for edge in graph.get_edge_data(i, j).values()
    ):
        return None
    depth = max(s.along(i, up)[1] for i in walls) - level
    if depth <= _LENGTH_TOLERANCE:
        return None
    outline = np.concatenate([s.points(i) for i, role in roles.items() if role != "wall"])
    x, centre, length, width = _rectangle(outline, up)
    dimensions = {"length": (length, "mm"), "width": (width, "mm"), "depth": (depth, "mm")}
    upright = np.linalg.norm(np.cross(s.axis, up), axis=1) < np.sin(_STEEP)
    corners = [float(s.radius[i]) for i in walls if s.concave[i] and s.kind[i] == "cylinder" and upright[i]]
    if corners:
        dimensions["corner_radius"] = (_commonest(corners), "mm")
    blends = [i for i, role in roles.items() if role == "blend"]
    fillets = [float(s.radius[i]) for i in blends if s.kind[i] in ("cylinder", "sphere")]
    fillets += [float(s.radius2[i]) for i in blends if s.kind[i] == "torus"]
    if fillets:
        dimensions["fillet_radius"] = (_commonest(fillets), "mm")
    shape_from_feature = _frame(x, up, centre + (level - float(centre @ up)) * up)
    half = np.array([length, width, depth]) / 2
    spread = np.abs(shape_from_feature[:3, :3]) @ half
    middle = shape_from_feature[:3, 3] + up * depth / 2
    # Walls may run on beyond the pocket, the prism over the floor may be turned: the box is what both allow.
    box = _union(s.boxes[sorted(roles)])
    box = np.concatenate([np.maximum(box[:3], middle - spread), np.minimum(box[3:], middle + spread)])
    return Feature("pocket", "", dimensions, shape_from_feature, box, sorted(roles.items()))


def _rectangle(points: Floats, normal: Floats) -> tuple[Floats, Floats, float, float]:
    """Least rectangle across `normal` that holds points: direction of its length, its centre, length and width.

    One side of it lies on a side of the convex hull (Freeman and Shapira, CACM 18, 1975).
    """
    from shapely import MultiPoint, get_coordinates

    u = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    u /= np.linalg.norm(u)
    v = np.cross(normal, u)
    flat = np.column_stack([points @ u, points @ v])
    hull = get_coordinates(MultiPoint(flat).convex_hull)
    sides = np.diff(hull, axis=0)
    sides = sides[np.linalg.norm(sides, axis=1) > 1e-9]
    direction = sides / np.linalg.norm(sides, axis=1, keepdims=True)
    across = np.column_stack([-direction[:, 1], direction[:, 0]])
    along = hull @ direction.T
    beside = hull @ across.T
    extent, breadth = np.ptp(along, axis=0), np.ptp(beside, axis=0)
    # Of rectangles as small as the least one, the first: equal input gives equal frames.
    best = int(np.argmax(extent * breadth <= (extent * breadth).min() * (1 + 1e-9)))
    d, a = direction[best], across[best]
    middle = d * (along[:, best].min() + extent[best] / 2) + a * (beside[:, best].min() + breadth[best] / 2)
    length, width = float(extent[best]), float(breadth[best])
    if width > length:
        d, length, width = a, width, length
    x = d[0] * u + d[1] * v
    x = -x if x[np.argmax(np.abs(x) > 1e-6)] < 0 else x
    return x, middle[0] * u + middle[1] * v, length, width


def _commonest(values: list[float]) -> float:
    """The value that occurs most often, to the class's digits; the least of those that do."""
    rounded = [round(v, _CLASS_DIGITS) for v in values]
    return min(values, key=lambda v: (-rounded.count(round(v, _CLASS_DIGITS)), v))


def _frame(x: Floats, z: Floats, origin: Floats) -> Floats:
    x = x - (x @ z) * z
    x = x / np.linalg.norm(x)
    out = np.eye(4)
    out[:3, 0], out[:3, 1], out[:3, 2], out[:3, 3] = x, np.cross(z, x), z, origin
    return out


def _union(boxes: Floats) -> Floats:
    return np.concatenate([boxes[:, :3].min(axis=0), boxes[:, 3:].max(axis=0)])
