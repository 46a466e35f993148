"""What stands out: bosses on a face, lugs with a bore, flanges around a shaft."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from relmodel.loading.features.feature import (
    ANGLE_TOLERANCE,
    LENGTH_TOLERANCE,
    Feature,
    frame,
    lengths,
    rectangle,
    union,
)
from relmodel.loading.features.graph import Boundary

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

_END_OF_A_LUG = np.pi * np.array([0.6, 1.9])  # turn of the rounded end; a full turn is a boss
_WHOLE_TURN = np.pi * 1.9
_LONG = 5.0  # length to width of an island that is a rib, however low
_FLAT = 0.5  # thickness of a flange to its radius
_WIDER = 1.2  # radius of a flange to that of its shaft


def lugs(b: Boundary, holes: list[Feature]) -> list[Feature]:
    """Ends rounded about the axis of a through hole; one in line through several ears has a lug in each."""
    s, found = b.surfaces, []
    rounds = np.flatnonzero((s.kind == "cylinder") & ~s.concave & (np.diff(s.start) > 0))
    for hole in holes:
        if hole.kind != "through_hole":
            continue
        z, mouth = hole.shape_from_feature[:3, 2], hole.shape_from_feature[:3, 3]
        coaxial = _coaxial(b, rounds, z, mouth)
        deep = float(mouth @ z), float(mouth @ z) - hole.dimensions["depth"][0]
        radii = sorted({round(float(s.radius[i]), 3) for i in coaxial})
        for radius in radii:
            ears = [
                ear
                for ear in _ears(b, [i for i in coaxial if abs(s.radius[i] - radius) < LENGTH_TOLERANCE], z)
                if _END_OF_A_LUG[0] < s.turn(ear[0]) < _END_OF_A_LUG[1] and ear[1] < deep[0] and ear[2] > deep[1]
            ]
            if ears:
                found += [_lug(b, hole, *ear) for ear in ears]
                break
    return found


def _ears(b: Boundary, ends: list[int], z: Floats) -> list[tuple[list[int], float, float]]:
    """Coaxial surfaces in runs that touch along z, each with its extent."""
    ears: list[tuple[list[int], float, float]] = []
    for low, high, i in sorted((*b.surfaces.along(i, z), i) for i in ends):
        if ears and low < ears[-1][2] + LENGTH_TOLERANCE:
            ears[-1] = ([*ears[-1][0], i], ears[-1][1], max(high, ears[-1][2]))
        else:
            ears.append(([i], low, high))
    return ears


def _lug(b: Boundary, hole: Feature, ends: list[int], low: float, high: float) -> Feature:
    s = b.surfaces
    z = hole.shape_from_feature[:3, 2]
    reach = {i: s.along(i, z) for i, _ in hole.surfaces}
    bore = [i for i, r in reach.items() if r[0] < high - LENGTH_TOLERANCE and r[1] > low + LENGTH_TOLERANCE]
    roles = dict.fromkeys(bore, "bore") | dict.fromkeys(ends, "end")
    for i in ends:
        for x in b.sides.get(i, []):
            if x.other < 0 or x.other in roles or x.convexity not in ("smooth", "convex"):
                continue
            if s.kind[x.other] == "plane" and abs(s.axis[x.other] @ z) < ANGLE_TOLERANCE:
                roles[x.other] = "side"
            elif s.kind[x.other] == "plane" and x.convexity == "convex":
                roles[x.other] = "face"
    inner = hole.dimensions["diameter"][0]
    dimensions = lengths(bore_diameter=inner, width=2 * float(s.radius[ends[0]]), thickness=high - low)
    # Of its bore the end that a counterbore may have raised, where that is its own.
    mouth = hole.shape_from_feature[:3, 3]
    mouth = mouth + (min(float(mouth @ z), high) - float(mouth @ z)) * z
    arm = np.concatenate([s.points(i) for i in ends]).mean(axis=0) - mouth
    pose = frame(arm - (arm @ z) * z, z, mouth)
    solid = [i for i, role in roles.items() if role in ("end", "side", "bore")]
    return Feature("lug", "", dimensions, pose, union(s.boxes[solid]), sorted(roles.items()))


def bosses(b: Boundary, taken: set[int], standing: set[int]) -> list[Feature]:
    """Islands: inner loops of a plane from which all sides rise; a long one is a rib.

    standing: sides of ribs and lugs; an island with one of them is that.
    """
    s, found = b.surfaces, []
    for plane in sorted(b.sides):
        if s.kind[plane] != "plane" or plane in taken:
            continue
        loops: dict[int, list[tuple[str, list[int], int]]] = {}
        for x in b.sides[plane]:
            if not x.outer:
                loops.setdefault(x.loop, []).append((*b.across(plane, x), x.other))
        for _, crossed in sorted(loops.items()):
            walls = sorted({i for _, others, _ in crossed for i in others})
            if all(kind == "concave" for kind, _, _ in crossed) and walls and not standing & set(walls):
                feet = {foot for _, _, foot in crossed}
                boss = _boss(b, plane, walls, sorted(feet - set(walls)))
                if boss is not None:
                    found.append(boss)
    return found


def _boss(b: Boundary, plane: int, walls: list[int], feet: list[int]) -> Feature | None:
    s = b.surfaces
    up, level = s.axis[plane], float(s.origin[plane] @ s.axis[plane])
    # Rounded corners are walls too; the round or chamfer of the rim adds to the height alone.
    corners = {x.other for i in walls for x in b.sides.get(i, []) if x.convexity == "smooth"} & b.blends.keys()
    corners = {i for i in corners if not s.concave[i] and np.abs(s.normals(i) @ up).max(initial=0.0) < 0.2}
    walls = sorted({*walls, *corners})
    rims = {x.other for i in walls for x in b.sides.get(i, []) if x.other in b.blends or x.other in b.chamfers}
    heights = [s.along(i, up)[1] for i in {*walls, *rims} if s.start[i] < s.start[i + 1]]
    height = max(heights, default=level) - level
    if height < LENGTH_TOLERANCE:
        return None
    points = np.concatenate([s.points(i) for i in walls])
    round_ = [i for i in walls if s.kind[i] in ("cylinder", "cone") and not s.concave[i]]
    single = (
        round_ == walls and s.turn(walls) > _WHOLE_TURN and len(_coaxial(b, np.array(walls), up, s.origin[walls[0]]))
    )
    kind = "boss"
    if single == len(walls):
        arm = points - s.origin[walls[0]]
        arm -= np.outer(arm @ up, up)
        foot = points @ up < (points @ up).min() + LENGTH_TOLERANCE
        radius = float(np.linalg.norm(arm[foot], axis=1).max())
        dimensions = lengths(diameter=2 * radius, height=height)
        x, centre = np.eye(3)[np.argmin(np.abs(up))], s.origin[walls[0]]
    else:
        x, centre, length, width = rectangle(points, up)
        dimensions = lengths(length=length, width=width, height=height)
        if length > _LONG * width:
            kind, dimensions = "rib", lengths(thickness=width, length=length, height=height)
    blends = [b.blends[i] for i in feet if i in b.blends]
    if blends:
        dimensions |= lengths(fillet_radius=min(blends))
    pose = frame(x, up, centre + (level - float(centre @ up)) * up)
    roles = [(i, "wall") for i in walls] + [(i, "blend") for i in feet if i in b.blends]
    top = [
        x.other for i in walls for x in b.sides.get(i, []) if x.other >= 0 and _is_top(b, x.other, up, level + height)
    ]
    roles += [(i, "top") for i in sorted(set(top) - {i for i, _ in roles})]
    return Feature(kind, "", dimensions, pose, union(s.boxes[[i for i, _ in roles]]), sorted(roles))


def _is_top(b: Boundary, i: int, up: Floats, level: float) -> bool:
    s = b.surfaces
    return bool(s.kind[i] == "plane" and s.axis[i] @ up > 1 - ANGLE_TOLERANCE and abs(s.origin[i] @ up - level) < 1e-2)


def shaft_flanges(b: Boundary) -> list[Feature]:
    """Discs: short cylinders, convex at both rims, with a narrower one on the axis on at least one side."""
    s, found = b.surfaces, []
    rounds = np.flatnonzero((s.kind == "cylinder") & ~s.concave & (np.diff(s.start) > 0))
    for i in rounds.tolist():
        axis = s.axis[i]
        low, high = s.along(i, axis)
        if high - low > _FLAT * s.radius[i] or s.turn([i]) < _WHOLE_TURN:
            continue
        kinds = [b.across(i, x) for x in b.sides.get(i, []) if x.convexity != "seam"]
        beside = sorted({k for _, others in kinds for k in others})
        if any(kind != "convex" for kind, _ in kinds):
            continue
        planes = [k for k in beside if s.kind[k] == "plane" and k not in b.chamfers]
        planes += [x.other for k in beside if k in b.chamfers for x in b.sides[k] if s.kind[x.other] == "plane"]
        narrower = _coaxial(b, rounds, axis, s.origin[i])
        shafts = {
            k
            for p in planes
            for k in b.neighbours(p, "concave")
            if k in narrower and s.radius[k] * _WIDER < s.radius[i]
        }
        if not shafts:
            continue
        reach = [s.along(k, axis) for k in [i, *planes]]
        low, high = min(r[0] for r in reach), max(r[1] for r in reach)
        dimensions = lengths(diameter=2 * float(s.radius[i]), thickness=high - low)
        foot = s.origin[i] + (low - float(s.origin[i] @ axis)) * axis
        pose = frame(np.eye(3)[np.argmin(np.abs(axis))], axis, foot)
        members = sorted({i, *planes})
        roles = [(k, "rim" if k == i else "face") for k in members]
        found.append(Feature("flange", "", dimensions, pose, union(s.boxes[members]), roles))
    return found


def _coaxial(b: Boundary, rows: Ints, axis: Floats, point: Floats) -> list[int]:
    s = b.surfaces
    parallel = np.linalg.norm(np.cross(s.axis[rows], axis), axis=1) < ANGLE_TOLERANCE
    near = np.linalg.norm(np.cross(s.origin[rows] - point, axis), axis=1) < LENGTH_TOLERANCE
    out: list[int] = rows[parallel & near].tolist()
    return out
