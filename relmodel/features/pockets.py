"""Closed depressions: pockets and slots with a flat floor, and pockets with a curved one."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from relmodel.arrays import Floats
from relmodel.features.feature import ANGLE_TOLERANCE, LENGTH_TOLERANCE, Feature, commonest, lengths
from relmodel.features.feature_parameters import DEFAULTS
from relmodel.features.frames import at_level, cross, frame, rectangle, union
from relmodel.features.graph import Boundary, Side
from relmodel.features.openings import closed_slot, walls_form
from relmodel.geometry.clusters import joined

_ALL = DEFAULTS.common
_P = DEFAULTS.pockets


@dataclass
class Floor:
    """Surfaces that are one floor, a plane or curved; up: out of the material; level: of its lowest point."""

    faces: list[int]
    up: Floats
    level: float


def pockets(b: Boundary, taken: set[int]) -> list[Feature]:
    """Floors whose whole outer boundary rises into walls, at once or through a fillet, or falls into such a pocket.

    taken: surfaces of holes; one that cuts into a wall of a pocket opens its floor no more than another pocket does.
    """
    open_floors, found = [], []
    for floor in plane_floors(b, taken):
        if all(rises(b, floor, i, x) for i in floor.faces for x in b.sides[i] if x.outer):
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
    return sorted([*found, *_cut_open(b, open_floors, pocket_of, taken)], key=lambda feature: feature.surfaces)


@dataclass
class _FloorSegment:
    """A floor with an open side: the pockets that it falls into, and the planes of its walls.

    free: it falls into nothing else than holes and pockets, and rises for the most part.
    """

    floor: Floor
    own: set[int]
    walls: set[tuple[float, ...]]
    free: bool


def _cut_open(b: Boundary, floors: list[Floor], pocket_of: dict[int, int], taken: set[int]) -> list[Feature]:
    """What is open only where a hole or another pocket cuts into it is a pocket all the same.

    So is what has walls on all sides, whatever cuts into it.
    """
    levels: dict[tuple[float, ...], list[_FloorSegment]] = {}
    for floor in floors:
        outer = [(i, x) for i in floor.faces for x in b.sides[i] if x.outer]
        rising = [rises(b, floor, i, x) for i, x in outer]
        standing = {x.other for up, (_, x) in zip(rising, outer, strict=True) if up}
        falls = {x.other for up, (_, x) in zip(rising, outer, strict=True) if not up}
        share = sum(x.length for up, (_, x) in zip(rising, outer, strict=True) if up) / sum(x.length for _, x in outer)
        free = falls <= pocket_of.keys() | taken and share > _P.mostly
        if not standing or (len(standing) == 1 and not free) or pocket_of.keys() & set(floor.faces):
            continue
        walls = {b.plane_key([i]) for i, role in walls_of(b, floor).items() if role == "wall"}
        own = {pocket_of[i] for i in falls & pocket_of.keys()}
        if walls:
            levels.setdefault(b.plane_key(floor.faces[:1]), []).append(_FloorSegment(floor, own, walls, free))
    found = []
    for segments in levels.values():
        inside = [group for group in _across_another([p for p in segments if p.free]) if not _is_channel(b, group)]
        done = {id(floor) for group in inside for floor in group}
        rest = _across_another([p for p in segments if id(p.floor) not in done], whatever=True)
        made = [_pocket(b, group) for group in [*inside, *(floors for floors in rest if _is_walled_in(b, floors))]]
        found += [pocket for pocket in made if pocket is not None]
    return found


def _is_walled_in(b: Boundary, floors: list[Floor]) -> bool:
    """Whether there is a wall along the most of each side of the least rectangle around a floor, or of a slot."""
    s, up = b.surfaces, floors[0].up
    roles: dict[int, str] = {}
    for floor in floors:
        roles |= walls_of(b, floor)
    walls = [i for i, role in roles.items() if role == "wall"]
    if len(walls) < _P.least_walls:
        return False
    if closed_slot(b, walls, up) is not None:
        return True
    points = np.concatenate([s.points(i) for i, role in roles.items() if role != "wall"])
    x, centre, length, width = rectangle(points, up)
    for out, half, side in ((x, length / 2, width), (cross(up, x), width / 2, length)):
        run = cross(up, out)
        for d in (out, -out):
            at = float(centre @ d) + half
            along = [
                s.along(i, run)
                for i in walls
                if s.axis[i] @ d < -1 + _ALL.steep**2 and abs(s.origin[i] @ d - at) < side * _ALL.steep
            ]
            if sum(high - low for low, high in along) < _P.mostly * side:
                return False
    return True


def _across_another(segments: list[_FloorSegment], *, whatever: bool = False) -> list[list[Floor]]:
    """Segments of one plane that are one floor: between walls of one plane, parted by a deeper pocket, or whatever."""
    edges = [
        (i, j)
        for (i, one), (j, two) in combinations(enumerate(segments), 2)
        if (whatever or one.own & two.own) and one.walls & two.walls
    ]
    return [[segments[i].floor for i in group] for group in joined(range(len(segments)), edges)]


def _is_channel(b: Boundary, floors: list[Floor]) -> bool:
    """Whether a floor has walls along one direction only: it leads from one pocket to another."""
    s = b.surfaces
    walls = {i for floor in floors for i, role in walls_of(b, floor).items() if role == "wall"}
    one = s.axis[min(walls)]
    return all(s.kind[i] == "plane" and abs(s.axis[i] @ one) > 1 - ANGLE_TOLERANCE for i in walls)


def plane_floors(b: Boundary, taken: set[int]) -> list[Floor]:
    """Planes that may be floors."""
    s = b.surfaces
    planes = [i for i in sorted(b.sides) if s.kind[i] == "plane" and s.start[i] < s.start[i + 1] and i not in taken]
    return [Floor([i], s.axis[i], float(s.origin[i] @ s.axis[i])) for i in planes]


def _curved_floors(b: Boundary, taken: set[int]) -> list[Floor]:
    """Curved surfaces with a wall at every side, up along what all the walls run along."""
    s, found = b.surfaces, []
    curved = {i for i in b.sides if s.kind[i] != "plane" and s.start[i] < s.start[i + 1]} - b.blends.keys() - taken
    smooth = [(i, x.other) for i in curved for x in b.sides[i] if x.convexity == "smooth" and x.other in curved]
    for faces in joined(curved, smooth):
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
        if spread[0] < _ALL.steep**2 and spread[1] > _ALL.steep**2 and (own @ up).min() > _ALL.steep:
            found.append(Floor(faces, up, min(s.along(i, up)[0] for i in faces)))
    return found


def rises(b: Boundary, floor: Floor, face: int, side: Side) -> bool:
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


def walls_of(b: Boundary, floor: Floor) -> dict[int, str]:
    """Roles of the surfaces of a depression: its floor, the walls that rise from it, the blends between."""
    s = b.surfaces
    roles = dict.fromkeys(floor.faces, "floor")
    todo = list(floor.faces)
    while todo:
        i = todo.pop()
        sides = [x for x in b.sides.get(i, []) if x.outer or roles[i] != "floor"]
        for j in sorted({x.other for x in sides if x.other >= 0} - roles.keys()):
            crossed = {x.convexity for x in sides if x.other == j}
            steep = float(np.abs(s.normals(j) @ floor.up).max(initial=0.0)) < _ALL.steep
            if ("concave" in crossed and roles[i] == "floor") or (
                "smooth" in crossed and steep and roles[i] == "blend"
            ):
                roles[j] = "wall"
            elif "smooth" in crossed and not steep and s.kind[j] != "plane" and _above(b, floor, j):
                roles[j] = "blend"
                todo.append(j)
    return roles


def top(b: Boundary, walls: Iterable[int], up: Floats) -> float:
    """Greatest height of walls, with the round or chamfer at their top."""
    heights = [b.surfaces.along(i, up)[1] for i in walls]
    for i in walls:
        for x in b.sides.get(i, []):
            is_bevel = (x.convexity == "smooth" and x.other in b.blends and not b.surfaces.concave[x.other]) or (
                x.convexity == "convex" and x.other in b.chamfers
            )
            if is_bevel:
                heights.append(b.surfaces.along(x.other, up)[1])
    return max(heights)


def _pocket(b: Boundary, floors: list[Floor]) -> Feature | None:
    s = b.surfaces
    up, level = floors[0].up, floors[0].level
    roles: dict[int, str] = {}
    for floor in floors:
        roles |= {i: role for i, role in walls_of(b, floor).items() if roles.get(i) != "floor"}
    walls = [i for i, role in roles.items() if role == "wall"]
    # A hollow closed on all sides has no mouth.
    if not any(
        x.convexity == "convex" or (x.convexity == "smooth" and x.other not in roles)
        for i in walls
        for x in b.sides.get(i, [])
    ):
        return None
    # What stands in a pocket against its wall may be higher than the pocket is deep.
    hollow = [i for i in walls if s.kind[i] == "plane" or s.concave[i]]
    depth = top(b, hollow or walls, up) - level
    if depth <= LENGTH_TOLERANCE:
        return None
    outline = np.concatenate([s.points(i) for i, role in roles.items() if role != "wall"])
    x, centre, length, width = rectangle(outline, up)
    slot, bend = closed_slot(b, walls, up), 0.0
    if slot is not None:
        x, centre, length, width, bend = slot
    dimensions = lengths(length=length, width=width, depth=depth)
    dimensions |= lengths(bend_radius=bend) if bend else {}
    corners = [float(s.radius[i]) for i in walls if _upright(b, i, up) and s.concave[i] and s.kind[i] == "cylinder"]
    if corners and slot is None:
        dimensions |= lengths(corner_radius=commonest(corners))
    dimensions |= fillet_radius(b, roles) | b.surfaces.draft(walls, up)
    shape_from_feature = frame(x, up, at_level(centre, up, level))
    box = union(s.boxes[sorted(roles)])
    if not bend:
        box = prism_box(b, sorted(roles), shape_from_feature, length, width, depth)
    kind = "pocket" if slot is None else "slot"
    form = walls_form(b, walls, shape_from_feature, either_way=False)
    return Feature(kind, "", dimensions, shape_from_feature, box, sorted(roles.items()), form)


def prism_box(b: Boundary, members: list[int], pose: Floats, length: float, width: float, depth: float) -> Floats:
    """Walls may run on beyond a depression, the prism over its floor may be turned: the box is what both allow."""
    spread = np.abs(pose[:3, :3]) @ (np.array([length, width, depth]) / 2)
    middle = pose[:3, 3] + pose[:3, 2] * depth / 2
    box = union(b.surfaces.boxes[members])
    return np.concatenate([np.maximum(box[:3], middle - spread), np.minimum(box[3:], middle + spread)])


def fillet_radius(b: Boundary, roles: dict[int, str]) -> dict[str, tuple[float, str]]:
    s = b.surfaces
    blends = [i for i, role in roles.items() if role == "blend"]
    radii = [float(s.radius[i]) for i in blends if s.kind[i] in ("cylinder", "sphere")]
    radii += [float(s.radius2[i]) for i in blends if s.kind[i] == "torus"]
    return lengths(fillet_radius=commonest(radii)) if radii else {}


def _upright(b: Boundary, i: int, up: Floats) -> bool:
    return bool(np.linalg.norm(cross(b.surfaces.axis[i], up)) < np.sin(_ALL.steep))
