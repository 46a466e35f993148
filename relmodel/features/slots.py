"""Open depressions: slots of many sections that run out at a side, and steps."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from relmodel.arrays import Floats
from relmodel.features.feature_parameters import DEFAULTS
from relmodel.features.graph import Boundary, Dimensions, Feature, ahead, at_level, cross, frame, lengths, rectangle
from relmodel.features.hollows import Floor, corner_radius, depression, fillet_radius, flat_floors, rises, top, walls_of

_ALL = DEFAULTS.common
_SLOTS = DEFAULTS.slots


def open_depressions(b: Boundary, taken: set[int], thin: set[int], gussets: set[int]) -> list[Feature]:
    """Slots open at an end, and steps: floors of which some sides rise into walls.

    A wall may look like the floor and the floor like its wall: the greater is the floor, so that the depth is the
    lesser reach.  thin: walls of ribs and flanges, which are no steps; gussets: those that leave no slot between them.
    """
    s = b.surfaces
    ledges = [ledge for floor in flat_floors(b, taken) if (ledge := _ledge(b, floor, taken, thin)) is not None]
    ledges.sort(key=lambda c: (-round(sum(float(s.area[i]) for i in c.floor.faces), 3), c.floor.faces))
    slots: dict[tuple[float, ...], list[tuple[int, int, int]]] = {}
    used: set[int] = set()
    for ledge in ledges:
        faces = ledge.floor.faces
        pairs = [] if used & set(faces) else _facing(b, ledge.floor, ledge.walls)
        for one, two in pairs:
            if {one, two} <= gussets:  # they stand apart in one corner
                continue
            segments = slots.setdefault(b.plane_key([faces[0], one, two]), [])
            segments += [(i, one, two) for i in faces]
            used |= set(faces) | ledge.around
    found = [
        _slot(b, floor_of(b, [p[0] for p in own]), sorted({i for p in own for i in p[1:]}))
        for segments in slots.values()
        for own in _cut_in_one_go(b, segments)
    ]
    slotted: set[int] = set()
    for others in (_round_slots, _keyseats, _v_slots):
        more = others(b, taken | _members(found))
        found += more
        slotted |= _members(more)
    cut_off = steps(b, ledges, used | slotted | taken, thin)
    return sorted([*found, *cut_off], key=lambda feature: feature.surfaces)


def _members(features: list[Feature]) -> set[int]:
    return {i for feature in features for i, _ in feature.surfaces}


def _ledge(b: Boundary, floor: Floor, taken: set[int], thin: set[int]) -> Ledge | None:
    """A floor of which some sides rise into walls, with these; None of a hollow, or of one without walls."""
    s, up = b.surfaces, floor.up
    outer = [(i, x) for i in floor.faces for x in b.sides[i] if x.outer]
    rising = [(i, x) for i, x in outer if rises(b, floor, i, x)]
    if len(rising) == len(outer) or _is_ridge(b, floor, thin):  # a hollow, or the top of a rib between two walls
        return None
    walls: defaultdict[int, float] = defaultdict(float)
    hollow: set[int] = set()
    for i, x in rising:
        for j in b.across(i, x)[1]:
            if j not in floor.faces and s.kind[j] == "plane" and abs(s.axis[j] @ up) < _SLOTS.leaning:
                walls[j] += x.length
            elif (
                s.kind[j] == "cylinder"
                and s.concave[j]
                and abs(s.axis[j] @ up) > 1 - _ALL.angle_rad**2
                and j not in taken
            ):
                hollow.add(j)
    points = np.concatenate([s.points(i) for i in floor.faces])
    length_of_plane: defaultdict[tuple[float, ...], float] = defaultdict(float)
    for j, n in walls.items():
        length_of_plane[b.plane_key([j])] += n
    sides = []
    for j in sorted(walls):
        run = run_along(up, s.axis[j])
        extent = float(np.ptp(points @ run))
        low, high = s.along(j, run)
        # A leaning wall is no longer than the floor: the slope of a gusset is no floor between its two feet.
        keeps = abs(s.axis[j] @ up) < _ALL.steep or _SLOTS.keeps * (high - low) < extent
        if keeps and length_of_plane[b.plane_key([j])] > _SLOTS.wall_share * extent:
            sides.append(j)
    return Ledge(floor, sides, set(walls), sorted(hollow)) if sides or len(hollow) == 1 else None


def _is_ridge(b: Boundary, floor: Floor, thin: set[int]) -> bool:
    """Whether a floor is the top of a rib between two walls: it falls on either side into one of its sides.  Where the
    walls are of the rib too, it is cut into the rib."""
    s = b.surfaces
    sides = sorted({j for i in floor.faces for j in b.neighbours(i, "convex") if j in thin})
    walls = [set(b.neighbours(j, "convex")) for i in floor.faces for j in b.neighbours(i, "concave")]
    return any(
        s.axis[one] @ s.axis[two] < -1 + _ALL.angle_rad and not any({one, two} <= around for around in walls)
        for one, two in combinations(sides, 2)
    )


def _place(b: Boundary, wall: int, across: Floats, up: Floats, height: float) -> float:
    """Where a plane wall stands at a height."""
    s = b.surfaces
    return float((s.origin[wall] @ s.axis[wall] - height * (s.axis[wall] @ up)) / (s.axis[wall] @ across))


def _facing(b: Boundary, floor: Floor, walls: list[int]) -> list[tuple[int, int]]:
    """Pairs of walls that face each other across the floor, each with the nearest."""
    s, pairs = b.surfaces, []
    for one in walls:
        run = run_along(floor.up, s.axis[one])
        across = cross(run, floor.up)
        at = _place(b, one, across, floor.up, floor.level)
        low, high = s.along(one, run)
        best: tuple[float, int] | None = None
        for two in walls:
            if run_along(floor.up, s.axis[two]) @ run > -1 + _ALL.angle_rad:
                continue
            leans = s.axis[[one, two]] @ floor.up
            if leans.max() > _ALL.steep and np.ptp(leans) > _SLOTS.even_rad:
                continue
            gap = _place(b, two, across, floor.up, floor.level) - at
            from_, to = s.along(two, run)
            reach = min(high, to) - max(low, from_)
            if gap > _ALL.length_mm and reach > _ALL.length_mm and (best is None or gap < best[0]):
                best = gap, two
        if best is not None:
            pairs.append((min(one, best[1]), max(one, best[1])))
    return _not_boxed_in(b, sorted(set(pairs)))


def _not_boxed_in(b: Boundary, pairs: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """Of pairs that meet in hollow corners, as around a pocket with a wall cut away, the one whose walls are whole."""
    kept: list[tuple[int, int]] = []
    for pair in sorted(pairs, key=lambda p: (-round(min(float(b.surfaces.area[i]) for i in p), 3), p)):
        met = {i: set(b.neighbours(i, "concave")) for i in pair}
        if all(sum(len(met[i] & set(other)) for i in pair) < _SLOTS.corners for other in kept):
            kept.append(pair)
    return sorted(kept)


def _cut_in_one_go(b: Boundary, segments: list[tuple[int, int, int]]) -> list[list[tuple[int, int, int]]]:
    """Segments (floor, wall, wall) of one section in line, parted where material lies between them."""
    s, (floor, wall, _) = b.surfaces, segments[0]
    run = run_along(s.axis[floor], s.axis[wall])
    segments = sorted(segments, key=lambda p: (s.along(p[0], run), p))
    parts, reach = [segments[:1]], s.along(segments[0][0], run)[1]
    for segment in segments[1:]:
        low, high = s.along(segment[0], run)
        middles = np.array([s.points(i).mean(axis=0) for i in segment[1:]])
        lines, ends = (middles + middles.mean(axis=0)) / 2, (reach - _ALL.length_mm, low + _ALL.length_mm)
        if low > reach and not s.is_free(lines, run, *ends):
            parts.append([])
        parts[-1].append(segment)
        reach = max(reach, high)
    return parts


def _slot(b: Boundary, floor: Floor, walls: list[int]) -> Feature:
    s, up, level = b.surfaces, floor.up, floor.level
    run = run_along(up, s.axis[walls[0]])
    across = cross(run, up)
    roles = walls_of(b, floor) | dict.fromkeys(walls, "wall")
    necks, ceilings = _necks(b, walls, up)
    roles |= dict.fromkeys(necks, "wall") | dict.fromkeys(ceilings, "undercut")
    depth = top(b, necks or walls, up) - level
    at_floor = [_place(b, i, across, up, level) for i in walls]
    at_mouth = [_place(b, i, across, up, level + depth) for i in necks or walls]
    low, high = min(at_floor), max(at_floor)
    points = np.concatenate([s.points(i) for i in floor.faces])
    inside = (points @ across > low - 1e-2) & (points @ across < high + 1e-2)
    ends = points[inside] @ run
    # A floor that runs on beyond two ears is theirs no longer; one with a curved end bulges less than this.
    reach = [s.along(i, run) for i, role in roles.items() if role != "floor"]
    start, stop, width = ends.min(), ends.max(), high - low
    if (first := min(r[0] for r in reach)) - start > width / 2:
        start = first
    if stop - (last := max(r[1] for r in reach)) > width / 2:
        stop = last
    length = float(stop - start)
    centre = (start + stop) / 2 * run + (low + high) / 2 * across + level * up
    mouth = max(at_mouth) - min(at_mouth)
    dimensions = lengths(width=min(mouth, width)) | fillet_radius(b, roles)
    if mouth < width - _ALL.length_mm:
        dimensions |= lengths(undercut_width=width)
        if ceilings:
            dimensions |= lengths(undercut_depth=s.along(ceilings[0], up)[1] - level)
        else:
            lean = float(np.arcsin(np.clip(-(s.axis[walls[0]] @ up), -1, 1)))
            dimensions["angle"] = (np.pi / 2 - lean, "rad")
    else:
        dimensions |= s.draft(walls, up)
    corners = corner_radius(b, [i for i, role in roles.items() if role == "wall"], up)
    if corners and 2 * corners["corner_radius"][0] < width - _ALL.length_mm:
        dimensions |= corners
    return depression(b, "open_slot", roles, frame(ahead(run), up, centre), (length, width, depth), dimensions)


def _necks(b: Boundary, walls: list[int], up: Floats) -> tuple[list[int], list[int]]:
    """Of a slot that is wider below: the walls above the overhang on either side, and the overhangs."""
    s = b.surfaces
    necks, ceilings = [], []
    for wall in walls:
        over = [j for j in b.neighbours(wall, "concave") if s.kind[j] == "plane" and s.axis[j] @ up < -1 + _ALL.steep]
        above = [
            k
            for j in over
            for k in b.neighbours(j, "convex")
            if s.kind[k] == "plane" and s.axis[k] @ s.axis[wall] > 1 - _ALL.steep
        ]
        if not above:
            return [], []
        necks += above
        ceilings += over
    return sorted(set(necks)), sorted(set(ceilings))


def _v_slots(b: Boundary, taken: set[int]) -> list[Feature]:
    """Two planes that meet in a concave edge below the one plane that both run out in."""
    s, found = b.surfaces, []
    used = set(taken)
    for one in b.of_kind("plane"):
        for two in b.neighbours(one, "concave"):
            if two <= one or used & {one, two} or s.kind[two] != "plane":
                continue
            opening = float(np.pi - np.arccos(np.clip(s.axis[one] @ s.axis[two], -1, 1)))
            if not _ALL.angle_rad < opening <= _SLOTS.flat_rad:
                continue
            mouths = [{b.plane_key([m]): m for m in _beyond(b, i, {one, two})} for i in (one, two)]
            run = cross(s.axis[one], s.axis[two])
            run /= np.linalg.norm(run)
            common = [s.axis[mouths[0][key]] for key in sorted(mouths[0].keys() & mouths[1].keys())]
            common = [up for up in common if abs(run @ up) < _ALL.angle_rad]
            common = [up for up in common if min(s.axis[one] @ up, s.axis[two] @ up) > -_ALL.angle_rad]
            if not common:
                continue
            up = common[0]
            beside = [{x.other for x in b.sides[i] if x.convexity == "smooth"} & b.blends.keys() for i in (one, two)]
            blends = sorted(beside[0] & beside[1])
            members = [one, two]
            more = {"angle": (opening, "rad")} | lengths(**({"fillet_radius": b.blends[blends[0]]} if blends else {}))
            found.append(_groove(b, members, blends, run, up, more))
            used |= {one, two, *blends}
    return found


def _beyond(b: Boundary, wall: int, members: set[int]) -> list[int]:
    """Planes beyond the convex edges of a wall, past a chamfer."""
    s, found = b.surfaces, []
    for j in b.neighbours(wall, "convex"):
        found += [k for k in b.neighbours(j, "convex") if k not in members] if j in b.chamfers else [j]
    return [j for j in found if s.kind[j] == "plane"]


def _round_slots(b: Boundary, taken: set[int]) -> list[Feature]:
    """With a round bottom: a single hollow cylinder below one plane, or half of one between two walls."""
    s, found = b.surfaces, []
    used = set(taken)
    for i in b.of_kind("cylinder", concave=True):
        if i in used or i in b.blends:
            continue
        around = [x for x in b.sides[i] if x.other not in (i, -1)]
        up = s.normals(i).mean(axis=0)
        up -= (up @ s.axis[i]) * s.axis[i]
        # A cylinder that is closed at both ends, or all around, is not a slot.
        if np.linalg.norm(up) < _ALL.angle_rad or len({x.other for x in around if x.convexity == "concave"}) > 1:
            continue
        up /= np.linalg.norm(up)
        smooth = {x.other for x in around if x.convexity == "smooth"}
        walls = sorted(k for k in smooth if s.kind[k] == "plane" and abs(s.axis[k] @ s.axis[i]) < _ALL.angle_rad)
        if len(walls) == len(smooth) == 2 and s.axis[walls[0]] @ s.axis[walls[1]] < -1 + _ALL.angle_rad:
            # The walls of a slot that is round at both ends lead to the other end.
            ends = {x.other for k in walls for x in b.sides[k] if x.convexity == "smooth"} - {i}
            if used & set(walls) or any(s.kind[k] == "cylinder" and s.concave[k] for k in ends):
                continue
            along = cross(s.axis[i], s.axis[walls[0]])
            up = along * np.sign(along @ up)
        elif all(s.kind[k] == "sphere" and s.concave[k] for k in smooth):  # a ball-nosed cutter leaves round ends
            mouths: dict[tuple[float, ...], list[int]] = {}
            for k in [x.other for x in around if x.convexity == "convex" and s.kind[x.other] == "plane"]:
                if abs(s.axis[k] @ s.axis[i]) < _ALL.angle_rad and s.axis[k] @ up > 0:
                    mouths.setdefault(b.plane_key([k]), []).append(k)
            mouth = next((m for _, m in sorted(mouths.items()) if len(m) > 1), None)
            if mouth is None and len(smooth) < 2:
                continue
            up = up if mouth is None else s.axis[mouth[0]]
        else:
            continue
        floor, kind = [i, *(smooth - set(walls))], "slot" if len(smooth) == 2 and not walls else "open_slot"
        radius = float(s.radius[i])
        more = lengths(fillet_radius=radius)
        above = s.along(i, up)[1] - float(s.origin[i] @ up)
        if not walls and _ALL.length_mm < above < radius / 2:  # little more than half a turn
            more |= lengths(width=2 * (radius**2 - above**2) ** 0.5, undercut_width=2 * radius)
        found.append(_groove(b, [*floor, *walls], floor, s.axis[i], up, more, kind))
        used |= {*floor, *walls}
    return found


def _keyseats(b: Boundary, taken: set[int]) -> list[Feature]:
    """What a disc cutter sinks, as for Woodruff keys: part of a hollow cylinder between two walls across its axis."""
    s, found = b.surfaces, []
    for i in b.of_kind("cylinder", concave=True):
        walls = b.neighbours(i, "concave")
        around = [x for x in b.sides[i] if x.other not in (i, -1, *walls)]
        known = taken | b.blends.keys()
        if len(walls) != 2 or known & {i, *walls} or any(s.kind[k] != "plane" for k in walls):
            continue
        facing = abs(s.axis[walls[0]] @ s.axis[i]) > 1 - _ALL.angle_rad and s.axis[walls[0]] @ s.axis[walls[1]] < 0
        up = s.normals(i).mean(axis=0)
        up -= (up @ s.axis[i]) * s.axis[i]
        if not facing or np.linalg.norm(up) < _ALL.steep or any(x.convexity != "convex" for x in around):
            continue
        up /= np.linalg.norm(up)
        # Out of the middle between both ends, whatever the triangles between them.
        arm, run = s.origin[i] - s.points(i), cross(s.axis[i], up)
        angle = np.arctan2(arm @ run, arm @ up)
        middle = float(angle.min() + angle.max()) / 2
        up = np.cos(middle) * up + np.sin(middle) * run
        more = lengths(floor_radius=float(s.radius[i]))
        found.append(_groove(b, [i, *walls], [i], cross(s.axis[i], up), up, more, "slot"))
    return found


def _groove(
    b: Boundary,
    members: list[int],
    floor: list[int],
    run: Floats,
    up: Floats,
    more: Dimensions,
    kind: str = "open_slot",
) -> Feature:
    """A slot of a constant section that has no flat floor; its width is that of its mouth."""
    s = b.surfaces
    across = cross(up, run)
    points = np.concatenate([s.points(i) for i in [*members, *floor]])
    low, high = (points @ up).min(), top(b, members, up)
    ends, breadth = points @ run, points @ across
    centre = (ends.min() + ends.max()) / 2 * run + (breadth.min() + breadth.max()) / 2 * across + low * up
    size = float(np.ptp(ends)), float(np.ptp(breadth)), float(high - low)
    roles = dict.fromkeys(members, "wall") | dict.fromkeys(floor, "floor")
    return depression(b, kind, roles, frame(ahead(run), up, centre), size, more)


# Steps: floors at a wall, or in a corner of two, that are open to the other sides.


@dataclass
class Ledge:
    """A floor that is open to some side, its plane walls, all planes next to it, and hollow cylinders upright on it."""

    floor: Floor
    walls: list[int]
    around: set[int]
    hollow: list[int]


def steps(b: Boundary, ledges: list[Ledge], used: set[int], thin: set[int]) -> list[Feature]:
    """Steps of a wall or two, and those that a cutter has sunk into a corner; used, thin: surfaces that belong to no
    step.  Of two candidates the floor is the one parallel to the face that the walls end in."""
    s = b.surfaces
    used = used | thin
    groups: dict[tuple[float, ...], tuple[list[int], list[int]]] = {}
    for ledge in sorted(ledges, key=lambda c: not _is_level(b, c)):
        floor, walls = ledge.floor, ledge.walls or ledge.hollow
        around = {*floor.faces, *walls}
        planes = {b.plane_key([j]) for j in ledge.walls}
        if used & around or len(planes) > 2 or any(s.axis[j] @ floor.up < -_SLOTS.over for j in ledge.walls):
            continue
        key = b.plane_key([floor.faces[0], *ledge.walls]) + (b.support_key(walls[0]) if not planes else ())
        floors, members = groups.setdefault(key, ([], []))
        floors += floor.faces
        members += walls
        used = used | around
    found = []
    for faces, walls in groups.values():
        if (step := _step(b, floor_of(b, faces), sorted(set(walls)))) is not None:
            found.append(step)
    return found


def _is_level(b: Boundary, ledge: Ledge) -> bool:
    """Whether each wall that ends in planes ends in one parallel to the floor."""
    s, up = b.surfaces, ledge.floor.up
    for wall in ledge.walls or ledge.hollow:
        ends = [k for k in b.neighbours(wall, "convex") if s.kind[k] == "plane" and k not in b.chamfers]
        facing = [s.axis[k] @ up for k in ends]
        if max(facing, default=0.0) > _SLOTS.over and max(facing) < 1 - _ALL.angle_rad:
            return False
    return True


def floor_of(b: Boundary, faces: list[int]) -> Floor:
    s, first = b.surfaces, faces[0]
    return Floor(sorted(set(faces)), s.axis[first], float(s.origin[first] @ s.axis[first]))


def run_along(up: Floats, normal: Floats) -> Floats:
    """Direction in which a wall runs along a floor."""
    run = cross(up, normal)
    return np.asarray(run / np.linalg.norm(run))


def _step(b: Boundary, floor: Floor, walls: list[int]) -> Feature | None:
    """A step that its plane walls run all along, or that a hollow cylinder bounds."""
    s, up, level = b.surfaces, floor.up, floor.level
    roles = walls_of(b, floor) | dict.fromkeys(walls, "wall")
    points = np.concatenate([s.points(i) for i, role in roles.items() if role != "wall"])
    depth = top(b, walls, up) - level
    if s.kind[walls[0]] != "plane":
        x, centre, length, width = rectangle(points, up)
        pose, more = frame(x, up, at_level(centre, up, level)), lengths(corner_radius=float(s.radius[walls[0]]))
        return depression(b, "step", roles, pose, (length, width, depth), more) if depth >= _ALL.length_mm else None
    square = all(_spans(b, _parallel(b, walls, i), points, run_along(up, s.axis[i])) for i in walls)
    run = run_along(up, s.axis[walls[0]]) if square else _edge_along(b, walls, points, up)
    if run is None or depth < _ALL.length_mm:
        return None
    across = cross(up, run)
    length, width = float(np.ptp(points @ run)), float(np.ptp(points @ across))
    if len(walls) > 1 and width > length:
        run, length, width = across, width, length
    across = cross(up, run)
    centre = sum(((points @ d).min() + (points @ d).max()) / 2 * d for d in (run, across)) + level * up
    pose = frame(ahead(run), up, centre)
    more, size = fillet_radius(b, roles), (length, width, depth)
    return depression(b, "step", roles, pose, size, more, () if square else walls)


def _parallel(b: Boundary, walls: list[int], wall: int) -> list[int]:
    """Those of the walls that are parallel to one of them."""
    s = b.surfaces
    return [i for i in walls if abs(s.axis[i] @ s.axis[wall]) > 0.99]


def _spans(b: Boundary, walls: list[int], points: Floats, run: Floats) -> bool:
    """Whether walls reach as far along a direction as the points of a floor."""
    reach = np.ptp(np.concatenate([b.surfaces.points(i) for i in walls]) @ run)
    share = float(reach / max(np.ptp(points @ run), _ALL.length_mm))
    return _SLOTS.spans < share < 1 / _SLOTS.spans


def _edge_along(b: Boundary, walls: list[int], points: Floats, up: Floats) -> Floats | None:
    """Direction of the open edge of a floor which a slanted wall, or two that meet, face from end to end."""
    s = b.surfaces
    if any(j not in [*b.neighbours(i, "concave"), *_parallel(b, walls, i)] for i in walls for j in walls):
        return None
    x = rectangle(points, up)[0]
    for run in (x, cross(up, x)):
        facing = s.axis[walls] @ cross(up, run)
        if (facing.min() > _SLOTS.over or facing.max() < -_SLOTS.over) and _spans(b, walls, points, run):
            return run
    return None
