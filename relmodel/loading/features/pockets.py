"""Depressions with a flat floor: pockets and slots, closed and open, and steps."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from relmodel.loading.features.feature import (
    ANGLE_TOLERANCE,
    LENGTH_TOLERANCE,
    Feature,
    commonest,
    frame,
    lengths,
    rectangle,
    union,
)
from relmodel.loading.features.graph import Boundary, Side
from relmodel.loading.features.openings import obround

Floats = npt.NDArray[np.float64]

_STEEP = np.sin(np.radians(10))  # walls may have this much draft
_MOSTLY = 0.5  # share of the rim of a pocket that another may not have cut away
_BESIDE = 0.2  # share of a floor's extent that a wall has at least
_SPANS = 0.9  # share of a step's floor that its wall runs along, and of the wall that the floor does


@dataclass
class Floor:
    """Surfaces that are one floor: cut up, yet one plane, or a curved one; up: out of the material; level: its lowest."""

    faces: list[int]
    up: Floats
    level: float


def pockets(b: Boundary, taken: set[int]) -> list[Feature]:
    """Floors whose whole outer boundary rises into walls, at once or through a fillet, or falls into such a pocket.

    taken: surfaces of holes; one that cuts into a wall of a pocket opens its floor no more than another pocket does.
    """
    open_floors, found = [], []
    for floor in _floors(b, taken):
        if all(_rises(b, floor, i, x) for i in floor.faces for x in b.sides[i] if x.outer):
            pocket = _pocket(b, [floor])
            if pocket is not None:
                found.append(pocket)
        else:
            open_floors.append(floor)
    pocket_of = {i: n for n, pocket in enumerate(found) for i, role in pocket.surfaces if role == "wall"}
    for floor in _curved_floors(b, taken | pocket_of.keys()):
        pocket = _pocket(b, [floor])
        if pocket is not None:
            found.append(pocket)
    # What is open only where a hole or another pocket cuts into it is a pocket all the same.
    cut: dict[tuple[float, ...], list[tuple[Floor, set[int], set[tuple[float, ...]]]]] = {}
    for floor in open_floors:
        outer = [(i, x) for i in floor.faces for x in b.sides[i] if x.outer]
        rising = [_rises(b, floor, i, x) for i, x in outer]
        falls = {x.other for up, (_, x) in zip(rising, outer, strict=True) if not up}
        share = sum(x.length for up, (_, x) in zip(rising, outer, strict=True) if up) / sum(x.length for _, x in outer)
        if falls <= pocket_of.keys() | taken and share > _MOSTLY and not pocket_of.keys() & set(floor.faces):
            walls = {plane_key(b, [i]) for i, role in _walls(b, floor).items() if role == "wall"}
            own = {pocket_of[i] for i in falls & pocket_of.keys()}
            cut.setdefault(plane_key(b, floor.faces[:1]), []).append((floor, own, walls))
    for pieces in cut.values():
        for joined in _across_another(pieces):
            pocket = _pocket(b, joined)
            if pocket is not None:
                found.append(pocket)
    return sorted(found, key=lambda feature: feature.surfaces)


def _across_another(pieces: list[tuple[Floor, set[int], set[tuple[float, ...]]]]) -> list[list[Floor]]:
    """Pieces of one plane that are one floor: between walls of one plane, parted by a deeper pocket."""
    import networkx as nx

    graph: nx.Graph[int] = nx.Graph()
    graph.add_nodes_from(range(len(pieces)))
    for i, (_, own, walls) in enumerate(pieces):
        for j, (_, others, more) in enumerate(pieces[:i]):
            if own & others and walls & more:
                graph.add_edge(i, j)
    return [[pieces[i][0] for i in sorted(component)] for component in nx.connected_components(graph)]


def _floors(b: Boundary, taken: set[int]) -> list[Floor]:
    """Planes that may be floors; one may be cut into several faces."""
    import networkx as nx

    s = b.surfaces
    planes = {i for i in b.sides if s.kind[i] == "plane" and s.start[i] < s.start[i + 1] and i not in taken}
    flat: nx.Graph[int] = nx.Graph()
    flat.add_nodes_from(planes)
    flat.add_edges_from(
        (i, x.other) for i in planes for x in b.sides[i] if x.convexity == "smooth" and x.other in planes
    )
    found = sorted(sorted(component) for component in nx.connected_components(flat))
    return [Floor(faces, s.axis[faces[0]], float(s.origin[faces[0]] @ s.axis[faces[0]])) for faces in found]


def _curved_floors(b: Boundary, taken: set[int]) -> list[Floor]:
    """Curved surfaces with a wall at every side, up along what all the walls run along."""
    import networkx as nx

    s, found = b.surfaces, []
    curved = {i for i in b.sides if s.kind[i] != "plane" and s.start[i] < s.start[i + 1]} - b.blends.keys() - taken
    pieces: nx.Graph[int] = nx.Graph()
    pieces.add_nodes_from(curved)
    pieces.add_edges_from(
        (i, x.other) for i in curved for x in b.sides[i] if x.convexity == "smooth" and x.other in curved
    )
    for faces in sorted(sorted(component) for component in nx.connected_components(pieces)):
        crossed = [b.across(i, x) for i in faces for x in b.sides[i] if x.convexity not in ("seam", "degenerate")]
        crossed = [(kind, others) for kind, others in crossed if not (kind == "smooth" and set(others) <= set(faces))]
        walls = sorted({j for kind, others in crossed for j in others if kind == "concave"})
        if not walls or any(kind != "concave" for kind, _ in crossed) or taken & set(walls):
            continue
        normal = np.concatenate([s.normals(j) for j in walls])
        if len(normal) == 0:
            continue
        spread, along = np.linalg.eigh(normal.T @ normal / len(normal))
        own = np.concatenate([s.normals(i) for i in faces])
        up = along[:, 0] * np.sign(own.mean(axis=0) @ along[:, 0])
        if spread[0] < _STEEP**2 and spread[1] > _STEEP**2 and (own @ up).min() > _STEEP:
            found.append(Floor(faces, up, min(s.along(i, up)[0] for i in faces)))
    return found


def _rises(b: Boundary, floor: Floor, face: int, side: Side) -> bool:
    """Whether what lies beyond a side of a face of a floor is a wall, a fillet that leads up to one, or more floor."""
    other = side.other
    if side.convexity == "degenerate" or (side.convexity == "smooth" and other != face and other in floor.faces):
        return True
    if other < 0 or other in floor.faces or side.convexity not in ("concave", "smooth"):
        return False
    return bool(side.convexity == "concave" or (b.surfaces.kind[other] != "plane" and _above(b, floor, other)))


def _above(b: Boundary, floor: Floor, other: int) -> bool:
    low, high = b.surfaces.along(other, floor.up)
    return low - floor.level > -LENGTH_TOLERANCE and high - floor.level > LENGTH_TOLERANCE


def _walls(b: Boundary, floor: Floor) -> dict[int, str]:
    """Roles of the surfaces of a depression: its floor, the walls that rise from it, the blends between."""
    s = b.surfaces
    roles = dict.fromkeys(floor.faces, "floor")
    todo = list(floor.faces)
    while todo:
        i = todo.pop()
        sides = [x for x in b.sides.get(i, []) if x.outer or roles[i] != "floor"]
        for j in sorted({x.other for x in sides if x.other >= 0} - roles.keys()):
            crossed = {x.convexity for x in sides if x.other == j}
            steep = float(np.abs(s.normals(j) @ floor.up).max(initial=0.0)) < _STEEP
            if ("concave" in crossed and roles[i] == "floor") or (
                "smooth" in crossed and steep and roles[i] == "blend"
            ):
                roles[j] = "wall"
            elif "smooth" in crossed and not steep and s.kind[j] != "plane" and _above(b, floor, j):
                roles[j] = "blend"
                todo.append(j)
    return roles


def _top(b: Boundary, walls: Iterable[int], up: Floats) -> float:
    """Greatest height of walls, with the round or chamfer of their rim."""
    heights = [b.surfaces.along(i, up)[1] for i in walls]
    for i in walls:
        for x in b.sides.get(i, []):
            rim = (x.convexity == "smooth" and x.other in b.blends and not b.surfaces.concave[x.other]) or (
                x.convexity == "convex" and x.other in b.chamfers
            )
            if rim:
                heights.append(b.surfaces.along(x.other, up)[1])
    return max(heights)


def _pocket(b: Boundary, floors: list[Floor]) -> Feature | None:
    s = b.surfaces
    up, level = floors[0].up, floors[0].level
    roles: dict[int, str] = {}
    for floor in floors:
        roles |= {i: role for i, role in _walls(b, floor).items() if roles.get(i) != "floor"}
    walls = [i for i, role in roles.items() if role == "wall"]
    # A hollow closed on all sides has no mouth.
    if not any(
        x.convexity == "convex" or (x.convexity == "smooth" and x.other not in roles)
        for i in walls
        for x in b.sides.get(i, [])
    ):
        return None
    depth = _top(b, walls, up) - level
    if depth <= LENGTH_TOLERANCE:
        return None
    outline = np.concatenate([s.points(i) for i, role in roles.items() if role != "wall"])
    x, centre, length, width = rectangle(outline, up)
    slot = obround(b, walls, up)
    if slot is not None:
        x, centre, length, width = slot
    dimensions = lengths(length=length, width=width, depth=depth)
    corners = [float(s.radius[i]) for i in walls if _upright(b, i, up) and s.concave[i] and s.kind[i] == "cylinder"]
    if corners and slot is None:
        dimensions |= lengths(corner_radius=commonest(corners))
    dimensions |= _fillet_radius(b, roles) | b.surfaces.draft(walls, up)
    shape_from_feature = frame(x, up, centre + (level - float(centre @ up)) * up)
    box = _box(b, sorted(roles), shape_from_feature, length, width, depth)
    kind = "pocket" if slot is None else "slot"
    return Feature(kind, "", dimensions, shape_from_feature, box, sorted(roles.items()))


def _box(b: Boundary, members: list[int], pose: Floats, length: float, width: float, depth: float) -> Floats:
    """Walls may run on beyond a depression, the prism over its floor may be turned: the box is what both allow."""
    spread = np.abs(pose[:3, :3]) @ (np.array([length, width, depth]) / 2)
    middle = pose[:3, 3] + pose[:3, 2] * depth / 2
    box = union(b.surfaces.boxes[members])
    return np.concatenate([np.maximum(box[:3], middle - spread), np.minimum(box[3:], middle + spread)])


def _fillet_radius(b: Boundary, roles: dict[int, str]) -> dict[str, tuple[float, str]]:
    s = b.surfaces
    blends = [i for i, role in roles.items() if role == "blend"]
    radii = [float(s.radius[i]) for i in blends if s.kind[i] in ("cylinder", "sphere")]
    radii += [float(s.radius2[i]) for i in blends if s.kind[i] == "torus"]
    return lengths(fillet_radius=commonest(radii)) if radii else {}


def _upright(b: Boundary, i: int, up: Floats) -> bool:
    return bool(np.linalg.norm(np.cross(b.surfaces.axis[i], up)) < np.sin(_STEEP))


def open_depressions(b: Boundary, taken: set[int], thin: set[int]) -> list[Feature]:
    """Slots open at an end, and steps: floors of which some sides rise into plane walls.

    A wall may look like the floor and the floor like its wall: the greater is the floor.  thin: walls of ribs and
    flanges, which are no steps.
    """
    s, candidates = b.surfaces, []
    for base in _floors(b, taken):
        floor, up = base.faces, base.up
        outer = [(i, x) for i in floor for x in b.sides[i] if x.outer]
        rising = [(i, x) for i, x in outer if _rises(b, base, i, x)]
        if len(rising) == len(outer):  # a hollow
            continue
        walls: dict[int, float] = {}
        for i, x in rising:
            for j in b.across(i, x)[1]:
                if j not in floor and s.kind[j] == "plane" and abs(s.axis[j] @ up) < _STEEP:
                    walls[j] = walls.get(j, 0.0) + x.length
        points = np.concatenate([s.points(i) for i in floor])
        sides = [j for j, n in sorted(walls.items()) if n > _BESIDE * np.ptp(points @ np.cross(up, s.axis[j]))]
        if sides:
            candidates.append((floor, sides, set(walls)))
    candidates.sort(key=lambda c: (-round(sum(float(s.area[i]) for i in c[0]), 3), c[0]))
    slots: dict[tuple[float, ...], tuple[list[int], list[int]]] = {}
    used: set[int] = set()
    for floor, sides, around in candidates:
        pairs = [] if used & set(floor) else _facing(b, floor, sides)
        for one, two in pairs:
            key = plane_key(b, [floor[0], one, two])
            floors, members = slots.setdefault(key, ([], []))
            floors += floor
            members += [one, two]
            used |= set(floor) | around
    found = [_slot(b, sorted(set(f)), sorted(set(w))) for f, w in slots.values()]
    steps: dict[tuple[float, ...], tuple[list[int], list[int]]] = {}
    for floor, sides, _ in candidates:
        planes = {plane_key(b, [j]) for j in sides}
        if used & {*floor, *sides} or thin & {*floor, *sides} or len(planes) > 2:
            continue
        floors, members = steps.setdefault(plane_key(b, [floor[0], *sides]), ([], []))
        floors += floor
        members += sides
        used |= {*floor, *sides}
    found += [step for f, w in steps.values() if (step := _step(b, sorted(set(f)), sorted(set(w)))) is not None]
    return sorted(found, key=lambda feature: feature.surfaces)


def plane_key(b: Boundary, planes: list[int]) -> tuple[float, ...]:
    """Equal for pieces of the same planes: a floor, then its walls in any order."""
    s = b.surfaces
    rows = [(*np.round(s.axis[i], 4), round(float(s.origin[i] @ s.axis[i]), 2)) for i in planes]
    return tuple(float(v) + 0.0 for row in [rows[0], *sorted(set(rows[1:]))] for v in row)


def _facing(b: Boundary, floor: list[int], walls: list[int]) -> list[tuple[int, int]]:
    """Pairs of walls that face each other across the floor, each with the nearest."""
    s, pairs = b.surfaces, []
    for one in walls:
        normal = s.axis[one]
        run = np.cross(normal, s.axis[floor[0]])
        low, high = s.along(one, run)
        best: tuple[float, int] | None = None
        for two in walls:
            gap = float((s.origin[two] - s.origin[one]) @ normal)
            if normal @ s.axis[two] > -1 + ANGLE_TOLERANCE or gap < LENGTH_TOLERANCE:
                continue
            from_, to = s.along(two, run)
            if min(high, to) - max(low, from_) > LENGTH_TOLERANCE and (best is None or gap < best[0]):
                best = gap, two
        if best is not None:
            pairs.append((min(one, best[1]), max(one, best[1])))
    return sorted(set(pairs))


def _slot(b: Boundary, floor: list[int], walls: list[int]) -> Feature:
    s = b.surfaces
    up, level = s.axis[floor[0]], float(s.origin[floor[0]] @ s.axis[floor[0]])
    across = s.axis[walls[0]]
    places = [float(s.origin[i] @ across) for i in walls]
    run = np.cross(across, up)
    points = np.concatenate([s.points(i) for i in floor])
    inside = (points @ across > min(places) - 1e-2) & (points @ across < max(places) + 1e-2)
    ends = points[inside] @ run
    depth = _top(b, walls, up) - level
    length, width = float(np.ptp(ends)), max(places) - min(places)
    x = -run if run[np.argmax(np.abs(run) > 1e-6)] < 0 else run
    centre = (ends.min() + ends.max()) / 2 * run + (min(places) + max(places)) / 2 * across + level * up
    roles = _walls(b, Floor(floor, up, level)) | dict.fromkeys(walls, "wall")
    pose = frame(x, up, centre)
    box = _box(b, sorted(roles), pose, length, width, depth)
    dimensions = lengths(length=length, width=width, depth=depth) | _fillet_radius(b, roles)
    return Feature("open_slot", "", dimensions, pose, box, sorted(roles.items()))


def _step(b: Boundary, floor: list[int], walls: list[int]) -> Feature | None:
    s = b.surfaces
    up, level = s.axis[floor[0]], float(s.origin[floor[0]] @ s.axis[floor[0]])
    roles = _walls(b, Floor(floor, up, level)) | dict.fromkeys(walls, "wall")
    points = np.concatenate([s.points(i) for i, role in roles.items() if role != "wall"])
    for wall in walls:
        run = np.cross(up, s.axis[wall])
        places = np.concatenate([s.points(i) for i in walls if abs(s.axis[i] @ s.axis[wall]) > 0.99]) @ run
        shares = np.ptp(places) / max(np.ptp(points @ run), LENGTH_TOLERANCE)
        if not _SPANS < shares < 1 / _SPANS:
            return None
    run = np.cross(up, s.axis[walls[0]])
    across = np.cross(up, run)
    length, width = float(np.ptp(points @ run)), float(np.ptp(points @ across))
    if len(walls) > 1 and width > length:
        run, length, width = across, width, length
    depth = _top(b, walls, up) - level
    if depth < LENGTH_TOLERANCE:
        return None
    across = np.cross(up, run)
    centre = sum(((points @ d).min() + (points @ d).max()) / 2 * d for d in (run, across)) + level * up
    x = -run if run[np.argmax(np.abs(run) > 1e-6)] < 0 else run
    pose = frame(x, up, centre)
    box = _box(b, sorted(roles), pose, length, width, depth)
    dimensions = lengths(length=length, width=width, depth=depth) | _fillet_radius(b, roles)
    return Feature("step", "", dimensions, pose, box, sorted(roles.items()))
