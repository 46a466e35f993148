"""What a lathe makes: flanges around a shaft, grooves in it, and ring grooves in a face."""

from __future__ import annotations

import numpy as np

from relmodel.arrays import Bools
from relmodel.features.feature import ANGLE_TOLERANCE, LENGTH_TOLERANCE, Feature, lengths
from relmodel.features.feature_parameters import DEFAULTS
from relmodel.features.frames import at_level, frame, union
from relmodel.features.graph import Boundary
from relmodel.features.protrusions import coaxial

_ALL = DEFAULTS.common
_P = DEFAULTS.turned


def shaft_flanges(b: Boundary, grooved: set[int]) -> list[Feature]:
    """Discs: short cylinders, convex at both rims, with a narrower one on the axis on at least one side.

    grooved: cylinders next to a groove, which are the shaft.
    """
    s, found = b.surfaces, []
    rounds = np.flatnonzero((s.kind == "cylinder") & ~s.concave & (np.diff(s.start) > 0))
    for i in sorted(set(rounds.tolist()) - grooved):
        axis = s.axis[i]
        low, high = s.along(i, axis)
        if high - low > _P.flat * s.radius[i] or s.turn([i]) < _ALL.whole_turn_rad:
            continue
        kinds = [b.across(i, x) for x in b.sides.get(i, []) if x.convexity != "seam"]
        adjacent = sorted({k for _, others in kinds for k in others})
        if any(kind != "convex" for kind, _ in kinds):
            continue
        planes = [k for k in adjacent if s.kind[k] == "plane" and k not in b.chamfers]
        planes += [x.other for k in adjacent if k in b.chamfers for x in b.sides[k] if s.kind[x.other] == "plane"]
        narrower = coaxial(b, rounds, axis, s.origin[i])
        shafts = {
            k
            for p in planes
            for k in b.neighbours(p, "concave")
            if k in narrower and s.radius[k] * _P.wider < s.radius[i]
        }
        if not shafts:
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

    holes: a ring groove's outer wall and floor look like a blind hole.
    """
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
    sides = [
        j
        for j in b.neighbours(floor, "concave")
        if s.kind[j] == "plane" and abs(s.axis[j] @ axis) > 1 - ANGLE_TOLERANCE
    ]
    low, high = s.along(floor, axis)
    if len(sides) != 2 or s.turn([floor]) < _ALL.whole_turn_rad or high - low > s.radius[floor]:
        return None
    shoulders = [
        [
            k
            for k in b.neighbours(j, "convex")
            if rounds[k] and s.radius[k] > s.radius[floor] and k in coaxial(b, np.array([k]), axis, s.origin[floor])
        ]
        for j in sides
    ]
    if not all(shoulders) or abs(s.radius[shoulders[0][0]] - s.radius[shoulders[1][0]]) > LENGTH_TOLERANCE:
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
    level = [j for j in sorted(islands) if abs(s.along(j, z)[1] - float(mouth @ z)) < LENGTH_TOLERANCE]
    if not level:
        return None
    width = hole.dimensions["diameter"][0] / 2 - float(s.radius[level[0]])
    measures = lengths(diameter=hole.dimensions["diameter"][0], width=width, depth=depth)
    pose = hole.shape_from_feature.copy()
    pose[:3, 3] -= depth * z
    roles = [(i, "floor" if role == "bottom" else "wall") for i, role in hole.surfaces] + [(j, "wall") for j in level]
    return Feature("groove", "", measures, pose, hole.box, sorted(roles))
