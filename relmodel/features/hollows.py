"""Closed depressions: pockets with a flat or curved floor, and openings without one."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import combinations, groupby, pairwise
from operator import attrgetter

import numpy as np

from relmodel.arrays import Floats
from relmodel.features.feature_parameters import DEFAULTS
from relmodel.features.graph import (
    Boundary,
    BoundaryArc,
    Dimensions,
    Feature,
    Rectangle,
    ahead,
    angle_gaps,
    at_level,
    commonest,
    cross,
    frame,
    lengths,
    outline_form,
    rectangle,
    sideways,
    union,
)
from relmodel.geometry.congruence import joined

_ALL = DEFAULTS.common
_P = DEFAULTS.hollows


@dataclass
class Floor:
    """Surfaces that are one floor, a plane or curved; up: out of the material; level: of its lowest point."""

    faces: list[int]
    up: Floats
    level: float


def pockets(b: Boundary, taken: set[int]) -> list[Feature]:
    """Floors whose whole outer boundary rises into walls, at once or through a fillet, or falls into such a pocket.

    taken: surfaces of holes; one that cuts into a wall of a pocket opens its floor no more than another pocket does."""
    open_floors, found = [], []
    for floor in flat_floors(b, taken):
        closed = all(rises(b, floor, i, x) for i in floor.faces for x in b.sides[i] if x.outer)
        if closed and (pocket := _pocket(b, [floor])) is not None:
            found.append(pocket)
        elif not closed:
            open_floors.append(floor)
    pocket_of = {i: n for n, pocket in enumerate(found) for i, role in pocket.surfaces if role == "wall"}
    curved = (_pocket(b, [floor]) for floor in _curved_floors(b, taken | pocket_of.keys()))
    found += [pocket for pocket in curved if pocket is not None]
    return sorted([*found, *_cut_open(b, open_floors, pocket_of, taken)], key=lambda feature: feature.surfaces)


@dataclass
class _FloorSegment:
    """A floor with an open side: the pockets that it falls into, and the planes of its walls.  free: it falls into
    nothing else than holes and pockets, and rises for the most part."""

    floor: Floor
    own: set[int]
    walls: set[tuple[float, ...]]
    free: bool


def _cut_open(b: Boundary, floors: list[Floor], pocket_of: dict[int, int], taken: set[int]) -> list[Feature]:
    """Pockets of floors that only holes or other pockets cut open, or with walls on all sides, whatever cuts in."""
    levels: dict[tuple[float, ...], list[_FloorSegment]] = {}
    for floor in floors:
        outer = [(rises(b, floor, i, x), x) for i in floor.faces for x in b.sides[i] if x.outer]
        standing, falls = ({x.other for up, x in outer if up == so} for so in (True, False))
        share = sum(x.length for up, x in outer if up) / sum(x.length for _, x in outer)
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
        groups = [*inside, *(floors for floors in rest if _is_walled_in(b, floors))]
        found += [pocket for group in groups if (pocket := _pocket(b, group)) is not None]
    return found


def _is_walled_in(b: Boundary, floors: list[Floor]) -> bool:
    """Whether there is a wall along the most of each side of the least rectangle around a floor, or of a slot."""
    s, up = b.surfaces, floors[0].up
    roles: dict[int, str] = {}
    for floor in floors:
        roles |= walls_of(b, floor)
    walls = [i for i, role in roles.items() if role == "wall"]
    if len(walls) < _P.pocket_walls:
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
    return all(s.kind[i] == "plane" and abs(s.axis[i] @ one) > 1 - _ALL.angle_rad for i in walls)


def flat_floors(b: Boundary, taken: set[int]) -> list[Floor]:
    """Planes that may be floors."""
    s = b.surfaces
    return [Floor([i], s.axis[i], float(s.origin[i] @ s.axis[i])) for i in b.of_kind("plane") if i not in taken]


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


def rises(b: Boundary, floor: Floor, face: int, side: BoundaryArc) -> bool:
    """Whether what lies beyond a side of a face of a floor is a wall, a fillet that leads up to one, or more floor."""
    other = side.other
    if side.convexity == "degenerate" or (side.convexity == "smooth" and other != face and other in floor.faces):
        return True
    if other < 0 or other in floor.faces or side.convexity not in ("concave", "smooth"):
        return False
    return bool(side.convexity == "concave" or (b.surfaces.kind[other] != "plane" and _above(b, floor, other)))


def _above(b: Boundary, floor: Floor, other: int) -> bool:
    low, high = b.surfaces.along(other, floor.up)
    return low - floor.level > -_ALL.length_mm and high - floor.level > _ALL.length_mm


def _is_upright(b: Boundary, i: int, up: Floats) -> bool:
    return bool(np.abs(b.surfaces.normals(i) @ up).max(initial=0.0) < _ALL.steep)


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
            steep = _is_upright(b, j, floor.up)
            if "concave" in crossed if roles[i] == "floor" else "smooth" in crossed and steep:
                roles[j] = "wall"
            elif "smooth" in crossed and not steep and s.kind[j] != "plane" and _above(b, floor, j):
                roles[j] = "blend"
                todo.append(j)
    return roles


def top(b: Boundary, walls: Iterable[int], up: Floats) -> float:
    """Greatest height of walls, with the round or chamfer at their top."""
    s, walls = b.surfaces, list(walls)
    sides = [x for i in walls for x in b.sides.get(i, [])]
    rounds = [x.other for x in sides if x.convexity == "smooth" and x.other in b.blends and not s.concave[x.other]]
    bevels = [x.other for x in sides if x.convexity == "convex" and x.other in b.chamfers]
    return max(s.along(i, up)[1] for i in (*walls, *rounds, *bevels))


def _pocket(b: Boundary, floors: list[Floor]) -> Feature | None:
    s = b.surfaces
    up, level = floors[0].up, floors[0].level
    roles: dict[int, str] = {}
    for floor in floors:
        roles |= {i: role for i, role in walls_of(b, floor).items() if roles.get(i) != "floor"}
    walls = [i for i, role in roles.items() if role == "wall"]
    # A hollow closed on all sides has no mouth.
    sides = [x for i in walls for x in b.sides.get(i, [])]
    if not any(x.convexity == "convex" or (x.convexity == "smooth" and x.other not in roles) for x in sides):
        return None
    # What stands in a pocket against its wall may be higher than the pocket is deep.
    hollow = [i for i in walls if s.kind[i] == "plane" or s.concave[i]]
    depth = top(b, hollow or walls, up) - level
    if depth <= _ALL.length_mm:
        return None
    outline = np.concatenate([s.points(i) for i, role in roles.items() if role != "wall"])
    is_slot, (x, centre, length, width), more = _outline(b, walls, outline, up)
    more |= fillet_radius(b, roles) | s.draft(walls, up)
    pose = frame(x, up, at_level(centre, up, level))
    pocket = depression(b, "slot" if is_slot else "pocket", roles, pose, (length, width, depth), more, walls)
    if "bend_radius" in more:
        pocket.box = union(s.boxes[sorted(roles)])
    return pocket


def _outline(b: Boundary, walls: list[int], points: Floats, up: Floats) -> tuple[bool, Rectangle, Dimensions]:
    """Whether walls are those of a closed slot, its middle line, else their least rectangle, and what bends them."""
    slot = closed_slot(b, walls, up)
    if slot is not None:
        return True, slot[:4], lengths(bend_radius=slot[4]) if slot[4] else {}
    return False, rectangle(points, up), corner_radius(b, walls, up)


def corner_radius(b: Boundary, walls: list[int], up: Floats) -> Dimensions:
    """The radius that most hollow cylinders among walls have, which stand upright."""
    s = b.surfaces
    rounds = [i for i in walls if s.kind[i] == "cylinder" and s.concave[i]]
    corners = [float(s.radius[i]) for i in rounds if np.linalg.norm(cross(s.axis[i], up)) < _ALL.steep]
    return lengths(corner_radius=commonest(corners)) if corners else {}


def depression(
    b: Boundary,
    kind: str,
    roles: dict[int, str],
    pose: Floats,
    size: tuple[float, float, float],
    more: Dimensions,
    outline: Sequence[int] = (),
) -> Feature:
    """A feature over a floor, of length, width and depth; `more` are its other dimensions, or take the place of these.

    outline: walls by whose form it differs from others of equal dimensions.
    Walls may run on beyond it, the prism over its floor may be turned: its box is what both allow."""
    spread = np.abs(pose[:3, :3]) @ (np.array(size) / 2)
    middle = pose[:3, 3] + pose[:3, 2] * size[2] / 2
    box = union(b.surfaces.boxes[sorted(roles)])
    box = np.concatenate([np.maximum(box[:3], middle - spread), np.minimum(box[3:], middle + spread)])
    dimensions = lengths(length=size[0], width=size[1], depth=size[2]) | more
    form = walls_form(b, outline, pose, either_way=False) if outline else ()
    return Feature(kind, "", dimensions, pose, box, sorted(roles.items()), form)


def fillet_radius(b: Boundary, roles: dict[int, str]) -> Dimensions:
    s = b.surfaces
    blends = [i for i, role in roles.items() if role == "blend"]
    radii = [float(s.radius[i]) for i in blends if s.kind[i] in ("cylinder", "sphere")]
    radii += [float(s.radius2[i]) for i in blends if s.kind[i] == "torus"]
    return lengths(fillet_radius=commonest(radii)) if radii else {}


# Openings without a floor that are no round holes: slots and ducts through the material.


def openings(b: Boundary, taken: set[int]) -> list[Feature]:
    """Rings of walls around an inner loop of a surface, all of its edges convex, that meet no floor."""
    rings: list[tuple[Floats, list[int]]] = []
    used = set(taken)
    for face in sorted(b.sides, key=lambda i: (b.surfaces.kind[i] != "plane", i)):
        inner = sorted((x for x in b.sides[face] if not x.outer), key=attrgetter("loop"))
        for _, loop in groupby(inner, key=attrgetter("loop")):
            crossed = [_walls_at(b, face, x) for x in loop]
            walls = sorted({i for _, others in crossed for i in others})
            if any(kind != "convex" for kind, _ in crossed) or used & set(walls):
                continue
            up = _out_of(b, face, walls)
            ring = None if up is None else _ring(b, walls, up, used)
            if up is None or ring is None:
                continue
            # A bore that no seam cuts open has an inner loop around its axis, which is the boundary of no opening.
            if b.surfaces.kind[face] == "plane" or _face_all_around(b, ring, up):
                used |= set(ring)
                rings.append((up, ring))
    rings += _cut_at_both_ends(b, used)
    return [_opening(b, sorted(i for _, ring in joined for i in ring), joined[0][0]) for joined in _in_line(b, rings)]


def _cut_at_both_ends(b: Boundary, used: set[int]) -> list[tuple[Floats, list[int]]]:
    """Rings of walls that something has cut at each end: each wall meets the next in a hollow edge or blend, around."""
    s, rings = b.surfaces, []
    tried: set[tuple[int, tuple[float, ...]]] = set()
    for i in sorted(b.sides.keys() - used):
        if s.kind[i] != "plane" or i in used:
            continue
        for j in b.neighbours(i, "concave"):
            run = cross(s.axis[i], s.axis[j])
            if s.kind[j] != "plane" or np.linalg.norm(run) < _ALL.steep:
                continue
            up = ahead(run / np.linalg.norm(run))
            key = tuple(np.round(up, 3).tolist())
            if (i, key) in tried:
                continue
            ring = _ring(b, [i], up, used)
            tried |= {(k, key) for k in ring or [i]}
            if ring is None:
                continue
            core = _core(b, ring)
            if len(core) >= _P.opening_walls and _face_all_around(b, core, up):
                used |= set(ring)
                rings.append((up, ring))
    return rings


def _core(b: Boundary, ring: list[int]) -> list[int]:
    """The walls of a ring that meet two others at least of these: nothing where the ring is open."""
    core = set(ring)
    while loose := {k for k in core if len(b.links[k].keys() & core) < 2}:
        core -= loose
    return sorted(core)


def _face_all_around(b: Boundary, walls: list[int], up: Floats) -> bool:
    """Whether the normals of walls leave no half turn about `up` free."""
    normal = np.concatenate([b.surfaces.normals(i) for i in walls])
    return bool(angle_gaps(normal, up).max() < np.pi - _ALL.steep)


def _out_of(b: Boundary, face: int, walls: list[int]) -> Floats | None:
    """Out of an opening in a face: its normal, of a curved one what all walls run along."""
    s = b.surfaces
    if s.kind[face] == "plane":
        return np.asarray(s.axis[face], float)
    normal = np.concatenate([s.normals(i) for i in walls] or [np.empty((0, 3))])
    if len(normal) == 0:
        return None
    up = np.asarray(np.linalg.eigh(normal.T @ normal)[1][:, 0], float)
    inward = np.concatenate([s.points(i) for i in walls]).mean(axis=0) - s.points(face).mean(axis=0)
    return up if up @ inward > 0 else -up


def _in_line(b: Boundary, rings: list[tuple[Floats, list[int]]]) -> list[list[tuple[Floats, list[int]]]]:
    """Rings that are one opening, cut through in one go: all walls in line, with another opening between."""
    lines: dict[tuple[tuple[float, ...], ...], list[tuple[Floats, list[int]]]] = {}
    for out_of, ring in rings:
        keys = tuple(sorted({b.support_key(i) for i in ring}))
        lines.setdefault(keys, []).append((out_of, ring))
    out = []
    for members in lines.values():
        up = members[0][0]
        members.sort(key=lambda m: b.surfaces.along(m[1][0], up)[0])
        joined = [members[0]]
        for one, two in pairwise(members):
            reach = [max(b.surfaces.along(i, up)[1] for i in one[1]), min(b.surfaces.along(i, up)[0] for i in two[1])]
            if not b.surfaces.is_free(_inside(b, two[1], up), up, reach[0], reach[1]):
                out.append(joined)
                joined = []
            joined.append(two)
        out.append(joined)
    return out


def _inside(b: Boundary, ring: list[int], up: Floats) -> Floats:
    """Lines (n, 3) along an opening, in its middle and near its walls."""
    points = [b.surfaces.points(i) for i in ring]
    middle = np.concatenate(points).mean(axis=0)
    return np.array([middle, *(middle + _P.within * (p.mean(axis=0) - middle) for p in points)])


def _walls_at(b: Boundary, plane: int, side: BoundaryArc) -> tuple[str, list[int]]:
    """Convexity and the walls at a side of a boundary, past its round or chamfer."""
    kind, others = b.across(plane, side)
    past = [x.other for i in others if i in b.chamfers for x in b.sides[i] if x.convexity == "convex"]
    return kind, [i for i in (*others, *past) if i not in b.chamfers and i != plane]


def _ring(b: Boundary, walls: list[int], up: Floats, used: set[int]) -> list[int] | None:
    """The walls, and what continues them along the opening; None where one leans or leads to a floor."""
    s = b.surfaces
    members = set(walls)
    todo = list(walls)
    while todo:
        i = todo.pop()
        if i in used or s.start[i] == s.start[i + 1] or not _is_upright(b, i, up):
            return None
        for x in b.sides[i]:
            if x.other in members or x.other < 0 or x.convexity not in ("concave", "smooth"):
                continue
            if _is_upright(b, x.other, up):
                members.add(x.other)
                todo.append(x.other)
            elif x.convexity == "concave" or s.concave[x.other]:
                return None
    return sorted(members)


def _opening(b: Boundary, ring: list[int], up: Floats) -> Feature:
    s = b.surfaces
    points = np.concatenate([s.points(i) for i in ring])
    top, depth = float((points @ up).max()), float(np.ptp(points @ up))
    oval = None if "plane" in s.kind[ring] else _ellipse(points, up)
    if oval is not None:
        is_slot, (x, centre, length, width) = False, oval
        dimensions = lengths(major_diameter=length, minor_diameter=width, depth=depth)
    else:
        is_slot, (x, centre, length, width), more = _outline(b, ring, points, up)
        dimensions = lengths(length=length, width=width, depth=depth) | more
    pose = frame(x, up, at_level(centre, up, top))
    form = walls_form(b, ring, pose, either_way=True)
    kind = "slot" if is_slot else "duct"
    return Feature(kind, "", dimensions, pose, union(s.boxes[ring]), [(i, "wall") for i in ring], form)


def walls_form(b: Boundary, walls: Sequence[int], pose: Floats, *, either_way: bool) -> tuple[float, ...]:
    """The form of an outline of walls along the Z of a frame; segments of one wall are one."""
    s, origin = b.surfaces, pose[:3, 3]
    seen: dict[tuple[str, ...], Floats] = {}
    for i in walls:
        arm, axis = s.origin[i] - origin, s.axis[i]
        place, label = origin, str(s.kind[i])
        if label == "plane":
            place = origin + (arm @ axis) * axis
        elif label == "cylinder":
            place = origin + arm - (arm @ axis) * axis
            label = f"{label} {'in' if s.concave[i] else 'out'} {s.radius[i]:.2f}"
        seen[(label, *(f"{x:.2f}" for x in place + 0.0))] = place
    places = np.array(list(seen.values())).reshape(-1, 3)
    return outline_form(places, [key[0] for key in seen], pose, either_way=either_way)


def _ellipse(points: Floats, up: Floats) -> Rectangle | None:
    """Direction of the major axis, centre and diameters of an ellipse through points, seen along `up`."""
    u, v = sideways(up)
    flat = np.column_stack([points @ u, points @ v])
    shift, scale = flat.mean(axis=0), float(np.abs(flat - flat.mean(axis=0)).max())
    p, q = ((flat - shift) / scale).T
    a, h, c, d, e = np.linalg.lstsq(np.column_stack([p * p, p * q, q * q, p, q]), np.ones(len(p)), rcond=None)[0]
    form = np.array([[a, h / 2], [h / 2, c]])
    slope = np.hypot(2 * a * p + h * q + d, h * p + 2 * c * q + e)
    away = np.abs(a * p * p + h * p * q + c * q * q + d * p + e * q - 1) / np.maximum(slope, 1e-9)
    if np.linalg.det(form) <= 0 or away.max() * scale > _P.ellipse_mm:
        return None
    middle = -np.linalg.solve(form, [d, e]) / 2
    values, axes = np.linalg.eigh(form)
    semi = np.sqrt((1 + middle @ form @ middle) / values) * scale  # the least value is the major axis
    x = ahead(axes[0, 0] * u + axes[1, 0] * v)
    centre = middle * scale + shift
    return x, centre[0] * u + centre[1] * v, 2 * float(semi[0]), 2 * float(semi[1])


def closed_slot(b: Boundary, walls: list[int], up: Floats) -> tuple[Floats, Floats, float, float, float] | None:
    """Direction in the middle, centre, length with both ends, width and bend radius (0: straight) of a rounded slot."""
    straight = _obround(b, walls, up)
    return (*straight, 0.0) if straight is not None else _kidney(b, walls, up)


def _kidney(b: Boundary, walls: list[int], up: Floats) -> tuple[Floats, Floats, float, float, float] | None:
    """A slot bent about an axis along `up`: an inner and an outer wall about it, and a half cylinder at either end."""
    s = b.surfaces
    if any(s.kind[i] != "cylinder" or abs(s.axis[i] @ up) < 1 - _ALL.angle_rad for i in walls):
        return None
    inner = [i for i in walls if not s.concave[i]]
    if not inner:
        return None
    foot = s.origin - (s.origin @ up)[:, None] * up
    arm = foot - foot[inner[0]]
    centred = [i for i in walls if np.linalg.norm(arm[i]) < _ALL.length_mm]
    outer = [i for i in centred if s.concave[i]]
    ends = [i for i in walls if i not in centred]
    low, high = float(s.radius[inner[0]]), max((float(s.radius[i]) for i in outer), default=0.0)
    ring, width = (low + high) / 2, high - low
    fits = width > _ALL.length_mm and all(
        abs(2 * s.radius[i] - width) < 10 * _ALL.length_mm and abs(np.linalg.norm(arm[i]) - ring) < 10 * _ALL.length_mm
        for i in ends
    )
    if not fits or not ends or len({*inner, *outer}) < len(centred):
        return None
    to = arm[ends[0]] / np.linalg.norm(arm[ends[0]])
    angles = np.arctan2(arm[ends] @ cross(up, to), arm[ends] @ to)
    sweep = float(np.ptp(angles))
    middle = float(angles.min() + angles.max()) / 2
    if abs(2 * np.pi - sweep - s.turn(inner)) < abs(sweep - s.turn(inner)):
        sweep, middle = 2 * np.pi - sweep, middle + np.pi
    if sweep < _ALL.angle_rad:
        return None
    out = np.cos(middle) * to + np.sin(middle) * cross(up, to)
    return ahead(cross(up, out)), foot[inner[0]] + ring * out, ring * sweep + width, width, ring


def _obround(b: Boundary, walls: list[int], up: Floats) -> Rectangle | None:
    """Direction, centre, length and width of a closed slot: two facing planes and a half cylinder at either end."""
    s = b.surfaces
    planes = [i for i in walls if s.kind[i] == "plane"]
    rounds = [i for i in walls if s.kind[i] == "cylinder" and s.concave[i] and abs(s.axis[i] @ up) > 1 - _ALL.steep**2]
    if not planes or len(planes) + len(rounds) < len(walls) or len(rounds) < 2:
        return None
    across = s.axis[planes[0]]
    if any(np.linalg.norm(cross(across, s.axis[i])) > _ALL.angle_rad for i in planes):
        return None
    offsets = [float(s.origin[i] @ across) for i in planes]
    width = max(offsets) - min(offsets)
    if any(abs(2 * s.radius[i] - width) > 10 * _ALL.length_mm for i in rounds):
        return None
    x = cross(across, up)
    places = [float(s.origin[i] @ x) for i in rounds]
    if max(places) - min(places) < _ALL.length_mm:
        return None
    centre = (max(places) + min(places)) / 2 * x + (max(offsets) + min(offsets)) / 2 * across
    return ahead(x), centre, max(places) - min(places) + width, width
