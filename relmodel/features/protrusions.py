"""What stands out: bosses, lugs with a bore, and what a lathe makes around a shaft."""

from __future__ import annotations

from itertools import groupby, pairwise
from operator import attrgetter

import numpy as np

from relmodel.arrays import Bools, Floats, Ints
from relmodel.features.feature_parameters import DEFAULTS
from relmodel.features.graph import Boundary, Feature, angle_gaps, at_level, frame, lengths, off_axis, rectangle, union

_ALL = DEFAULTS.common
_STANDING = DEFAULTS.standing


def lugs(b: Boundary, holes: list[Feature]) -> list[Feature]:
    """Ends rounded about the axis of a through hole; one in line through several ears has a lug in each."""
    s, found = b.surfaces, []
    rounds = np.flatnonzero((s.kind == "cylinder") & ~s.concave & (np.diff(s.start) > 0))
    for hole in holes:
        if hole.kind != "through_hole":
            continue
        z, mouth = hole.shape_from_feature[:3, 2], hole.shape_from_feature[:3, 3]
        ends_of = coaxial(b, rounds, z, mouth)
        deep = float(mouth @ z), float(mouth @ z) - hole.dimensions["depth"][0]
        radii = sorted({round(float(s.radius[i]), 3) for i in ends_of})
        for radius in radii:
            least, most = _STANDING.end_of_a_lug_rad
            ears = _ears(b, [i for i in ends_of if abs(s.radius[i] - radius) < _ALL.length_mm], z)
            ears = [ear for ear in ears if least < s.turn(ear[0]) < most and ear[1] < deep[0] and ear[2] > deep[1]]
            ears = [ear for ear in ears if _is_one_arc(b, ear[0]) and not _stands_upright(b, ear[0], z)]
            if ears:
                found += [_lug(b, hole, *ear) for ear in ears]
                break
    return found


def _is_one_arc(b: Boundary, ends: list[int]) -> bool:
    """Whether a round end is one arc, and no disc with notches: segments one above the other are one."""
    s = b.surfaces
    axis = s.axis[ends[0]]
    reach = sorted(s.along(i, axis) for i in ends)
    overlap = any(two[0] < one[1] - _ALL.length_mm for one, two in pairwise(reach))
    arms = np.concatenate([s.points(i) for i in ends]) - s.origin[ends[0]]
    wide = int((angle_gaps(arms, axis) > _STANDING.gap_rad).sum())
    return wide == 1 or (wide == 0 and not overlap)


def _stands_upright(b: Boundary, ends: list[int], z: Floats) -> bool:
    """Whether a round end rises from a face: it is that of a pad."""
    s = b.surfaces
    feet = [j for i in ends for j in b.neighbours(i, "concave") if s.kind[j] == "plane"]
    return any(abs(s.axis[j] @ z) > 1 - _ALL.angle_rad for j in feet)


def _ears(b: Boundary, ends: list[int], z: Floats) -> list[tuple[list[int], float, float]]:
    """Coaxial surfaces in runs that touch along z, each with its extent."""
    ears: list[tuple[list[int], float, float]] = []
    for low, high, i in sorted((*b.surfaces.along(i, z), i) for i in ends):
        if ears and low < ears[-1][2] + _ALL.length_mm:
            ears[-1] = ([*ears[-1][0], i], ears[-1][1], max(high, ears[-1][2]))
        else:
            ears.append(([i], low, high))
    return ears


def _lug(b: Boundary, hole: Feature, ends: list[int], low: float, high: float) -> Feature:
    s = b.surfaces
    z = hole.shape_from_feature[:3, 2]
    reach = {i: s.along(i, z) for i, _ in hole.surfaces}
    bore = [i for i, r in reach.items() if r[0] < high - _ALL.length_mm and r[1] > low + _ALL.length_mm]
    roles = dict.fromkeys(bore, "bore") | dict.fromkeys(ends, "end")
    for i in ends:
        for x in b.sides.get(i, []):
            if x.other < 0 or x.other in roles or x.convexity not in ("smooth", "convex"):
                continue
            if s.kind[x.other] == "plane" and abs(s.axis[x.other] @ z) < _ALL.angle_rad:
                roles[x.other] = "side"
            elif s.kind[x.other] == "plane" and x.convexity == "convex":
                roles[x.other] = "face"
    inner = hole.dimensions["diameter"][0]
    dimensions = lengths(bore_diameter=inner, width=2 * float(s.radius[ends[0]]), thickness=high - low)
    # Of its bore the end that a counterbore may have raised, where that is its own.
    mouth = hole.shape_from_feature[:3, 3]
    mouth = at_level(mouth, z, min(float(mouth @ z), high))
    arm = np.concatenate([s.points(i) for i in ends]).mean(axis=0) - mouth
    pose = frame(arm - (arm @ z) * z, z, mouth)
    solid = [i for i, role in roles.items() if role in ("end", "side", "bore")]
    return Feature("lug", "", dimensions, pose, union(s.boxes[solid]), sorted(roles.items()))


def bosses(b: Boundary, taken: set[int], standing: set[int], beyond: dict[int, int]) -> list[Feature]:
    """Islands: inner loops of a plane from which all sides rise; a long one is a rib.

    taken: surfaces of holes and grooves; a hole may cut into a side.  standing: sides of ribs and lugs; an island with
    one of them is that.  beyond: of a cylinder on one side of a groove, the one on the other."""
    s, found = b.surfaces, []
    for plane in sorted(b.sides):
        if s.kind[plane] != "plane" or plane in taken:
            continue
        inner = sorted((x for x in b.sides[plane] if not x.outer), key=attrgetter("loop"))
        for sides in (list(loop) for _, loop in groupby(inner, key=attrgetter("loop"))):
            free = [x for x in sides if x.other not in taken]
            crossed = [b.across(plane, x) for x in free]
            walls = sorted({i for _, others in crossed for i in others})
            mostly = 2 * sum(x.length for x in free) > sum(x.length for x in sides)
            rises = mostly and all(kind == "concave" for kind, _ in crossed)
            single = walls[0] if len(walls) == 1 and s.kind[walls[0]] == "cylinder" else -1
            askew = single >= 0 and abs(s.axis[single] @ s.axis[plane]) < 1 - _ALL.angle_rad
            if rises and walls and not standing & set(walls) and not askew:
                boss = _boss(b, plane, walls, sorted({x.other for x in free} - set(walls)), beyond)
                if boss is not None:
                    found.append(boss)
    islands = {i for f in found for i, _ in f.surfaces}
    return found + _round_bosses(b, taken | standing | islands | beyond.keys())


def _round_bosses(b: Boundary, taken: set[int]) -> list[Feature]:
    """Round ones on what is not flat, or not all around: a whole turn, a flat top, and a hollow edge at the foot."""
    s, found = b.surfaces, []
    for i in b.of_kind("cylinder", "cone", concave=False):
        if i in taken:
            continue
        axis = s.axis[i]
        bounds = [(*b.across(i, x), x.other) for x in b.sides[i] if x.convexity != "seam" and x.other not in taken]
        tops = {j for kind, others, _ in bounds if kind == "convex" for j in others}
        bevels = tops & b.chamfers
        tops = (tops - bevels) | {j for bevel in bevels for j in b.neighbours(bevel, "convex") if j != i}
        sharp = all(kind in ("convex", "concave") for kind, _, _ in bounds)
        if s.turn([i]) < _ALL.whole_turn_rad or not tops or not sharp:
            continue
        up = s.axis[min(tops)]
        flat = all(s.kind[j] == "plane" and s.axis[j] @ up > 1 - _ALL.angle_rad for j in tops)
        feet = {foot for kind, _, foot in bounds if kind == "concave"}
        if not flat or not feet or abs(up @ axis) < 1 - _ALL.angle_rad:
            continue
        blends = sorted(feet & b.blends.keys())
        low, high = s.extent([i, *blends, *tops], up)
        radius = float(off_axis(s.points(i), s.origin[i], axis).max())
        dimensions = lengths(diameter=2 * radius, height=high - low) | s.draft([i], up)
        if blends:
            dimensions |= lengths(fillet_radius=min(b.blends[j] for j in blends))
        foot = at_level(s.origin[i], up, low)
        roles = [(i, "wall")] + [(j, "blend") for j in blends] + [(j, "top") for j in sorted(tops)]
        members = [j for j, _ in roles]
        pose = frame(np.eye(3)[np.argmin(np.abs(up))], up, foot)
        found.append(Feature("boss", "", dimensions, pose, union(s.boxes[members]), sorted(roles)))
    return found


def _boss(b: Boundary, plane: int, walls: list[int], feet: list[int], beyond: dict[int, int]) -> Feature | None:
    s = b.surfaces
    up, level = s.axis[plane], float(s.origin[plane] @ s.axis[plane])
    # Rounded corners are walls too; the round or chamfer at the top adds to the height only.
    corners = {x.other for i in walls for x in b.sides.get(i, []) if x.convexity == "smooth"} & b.blends.keys()
    corners = {i for i in corners if not s.concave[i] and np.abs(s.normals(i) @ up).max(initial=0.0) < 0.2}
    walls = sorted({*walls, *corners})
    for i in walls:  # grows on the way: past each groove lies the next
        if i in beyond and beyond[i] not in walls and s.along(beyond[i], up)[1] > s.along(i, up)[1]:
            walls.append(beyond[i])
    bevels = {x.other for i in walls for x in b.sides.get(i, []) if x.other in b.blends or x.other in b.chamfers}
    heights = [s.along(i, up)[1] for i in {*walls, *bevels} if s.start[i] < s.start[i + 1]]
    height = max(heights, default=level) - level
    if height < _ALL.length_mm:
        return None
    points = np.concatenate([s.points(i) for i in walls])
    turned = all(s.kind[i] in ("cylinder", "cone") and not s.concave[i] for i in walls)
    kind = "boss"
    if turned and s.turn(walls) > _ALL.whole_turn_rad and coaxial(b, np.array(walls), up, s.origin[walls[0]]) == walls:
        foot = points @ up < (points @ up).min() + _ALL.length_mm
        radius = float(off_axis(points[foot], s.origin[walls[0]], up).max())
        dimensions = lengths(diameter=2 * radius, height=height)
        x, centre = np.eye(3)[np.argmin(np.abs(up))], s.origin[walls[0]]
    else:
        x, centre, length, width = rectangle(points, up)
        dimensions = lengths(length=length, width=width, height=height)
        if length > _STANDING.long * width:
            kind, dimensions = "rib", lengths(thickness=width, length=length, height=height)
    if kind == "boss":
        dimensions |= s.draft(walls, up)
    blends = [b.blends[i] for i in feet if i in b.blends]
    if blends:
        dimensions |= lengths(fillet_radius=min(blends))
    pose = frame(x, up, at_level(centre, up, level))
    roles = [(i, "wall") for i in walls] + [(i, "blend") for i in feet if i in b.blends]
    beside = {x.other for i in walls for x in b.sides.get(i, [])} - {-1, *(i for i, _ in roles)}
    level_with = [i for i in beside if s.kind[i] == "plane" and s.axis[i] @ up > 1 - _ALL.angle_rad]
    roles += [(i, "top") for i in level_with if abs(s.origin[i] @ up - level - height) < 1e-2]
    return Feature(kind, "", dimensions, pose, union(s.boxes[[i for i, _ in roles]]), sorted(roles))


def coaxial(b: Boundary, rows: Ints, axis: Floats, point: Floats) -> list[int]:
    s = b.surfaces
    parallel = np.linalg.norm(np.cross(s.axis[rows], axis), axis=1) < _ALL.angle_rad
    near = np.linalg.norm(np.cross(s.origin[rows] - point, axis), axis=1) < _ALL.length_mm
    return list(rows[parallel & near].tolist())


# What a lathe makes: flanges around a shaft, grooves in it, and ring grooves in a face.


def shaft_flanges(b: Boundary, grooved: set[int]) -> list[Feature]:
    """Discs: short cylinders, convex at both rims, with a narrower one on the axis on at least one side.  grooved:
    cylinders next to a groove, which are the shaft."""
    s, found = b.surfaces, []
    rounds = np.flatnonzero((s.kind == "cylinder") & ~s.concave & (np.diff(s.start) > 0))
    for i in sorted(set(rounds.tolist()) - grooved):
        axis = s.axis[i]
        low, high = s.along(i, axis)
        if high - low > _STANDING.flat * s.radius[i] or s.turn([i]) < _ALL.whole_turn_rad:
            continue
        kinds = [b.across(i, x) for x in b.sides.get(i, []) if x.convexity != "seam"]
        adjacent = sorted({k for _, others in kinds for k in others})
        if any(kind != "convex" for kind, _ in kinds):
            continue
        planes = [k for k in adjacent if s.kind[k] == "plane" and k not in b.chamfers]
        planes += [x.other for k in adjacent if k in b.chamfers for x in b.sides[k] if s.kind[x.other] == "plane"]
        on_it = {k for p in planes for k in b.neighbours(p, "concave")} & set(coaxial(b, rounds, axis, s.origin[i]))
        if not any(s.radius[k] * _STANDING.wider < s.radius[i] for k in on_it):
            continue
        low, high = s.extent([i, *planes], axis)
        dimensions = lengths(diameter=2 * float(s.radius[i]), thickness=high - low)
        pose = frame(np.eye(3)[np.argmin(np.abs(axis))], axis, at_level(s.origin[i], axis, low))
        members = sorted({i, *planes})
        roles = [(k, "rim" if k == i else "face") for k in members]
        found.append(Feature("flange", "", dimensions, pose, union(s.boxes[members]), roles))
    return found


def grooves(b: Boundary, holes: list[Feature]) -> tuple[list[Feature], dict[int, int]]:
    """Grooves around a shaft and ring grooves in a face; of the cylinders next to the former, the opposite ones.
    holes: a ring groove's outer wall and floor look like a blind hole."""
    s, found = b.surfaces, []
    beyond: dict[int, int] = {}
    rounds = (s.kind == "cylinder") & ~s.concave & (np.diff(s.start) > 0)
    for i in np.flatnonzero(rounds).tolist():
        groove = _around(b, i, rounds)
        if groove is not None:
            found.append(groove[0])
            one, two = groove[1]
            beyond |= {one: two, two: one}
    for hole in holes:
        ring = _in_a_face(b, hole, rounds)
        if ring is not None:
            found.append(ring)
    return found, beyond


def _around(b: Boundary, floor: int, rounds: Bools) -> tuple[Feature, tuple[int, int]] | None:
    """The groove that has a cylinder for its floor, no wider than the shaft is thick, and the cylinders next to it."""
    s, axis = b.surfaces, b.surfaces.axis[floor]
    planes = [j for j in b.neighbours(floor, "concave") if s.kind[j] == "plane"]
    sides = [j for j in planes if abs(s.axis[j] @ axis) > 1 - _ALL.angle_rad]
    low, high = s.along(floor, axis)
    if len(sides) != 2 or s.turn([floor]) < _ALL.whole_turn_rad or high - low > s.radius[floor]:
        return None
    wider = np.flatnonzero(rounds & (s.radius > s.radius[floor]))
    thick = set(coaxial(b, wider, axis, s.origin[floor]))
    shoulders = [[k for k in b.neighbours(j, "convex") if k in thick] for j in sides]
    if not all(shoulders) or abs(s.radius[shoulders[0][0]] - s.radius[shoulders[1][0]]) > _ALL.length_mm:
        return None
    one, two = shoulders[0][0], shoulders[1][0]
    measures = lengths(diameter=2 * s.radius[floor], width=high - low, depth=s.radius[one] - s.radius[floor])
    pose = frame(np.eye(3)[np.argmin(np.abs(axis))], axis, at_level(s.origin[floor], axis, (low + high) / 2))
    roles = sorted([(floor, "floor"), *((j, "wall") for j in sides)])
    return Feature("groove", "", measures, pose, union(s.boxes[[floor, *sides]]), roles), (one, two)


def _in_a_face(b: Boundary, hole: Feature, rounds: Bools) -> Feature | None:
    """A hole around an island that is level with its mouth."""
    s = b.surfaces
    if hole.kind != "blind_hole":
        return None
    z, mouth, depth = hole.shape_from_feature[:3, 2], hole.shape_from_feature[:3, 3], hole.dimensions["depth"][0]
    floors = [i for i, role in hole.surfaces if role == "bottom" and s.kind[i] == "plane"]
    islands = {j for i in floors for j in b.neighbours(i, "concave") if rounds[j]}
    islands &= set(coaxial(b, np.array(sorted(islands), np.int64), z, mouth))
    level = [j for j in sorted(islands) if abs(s.along(j, z)[1] - float(mouth @ z)) < _ALL.length_mm]
    if not level:
        return None
    width = hole.dimensions["diameter"][0] / 2 - float(s.radius[level[0]])
    measures = lengths(diameter=hole.dimensions["diameter"][0], width=width, depth=depth)
    pose = hole.shape_from_feature.copy()
    pose[:3, 3] -= depth * z
    roles = [(i, "floor" if role == "bottom" else "wall") for i, role in hole.surfaces] + [(j, "wall") for j in level]
    return Feature("groove", "", measures, pose, hole.box, sorted(roles))
