"""Blends (rounded edges) and chamfers (edges cut off)."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from relmodel.arrays import Floats
from relmodel.features.feature_parameters import DEFAULTS
from relmodel.features.graph import Boundary, BoundaryArc, Feature, angle_gaps, at_level, cross, frame, lengths, union
from relmodel.geometry.congruence import joined
from relmodel.geometry.surfaces import ANALYTIC_KINDS

_ALL = DEFAULTS.common
_P = DEFAULTS.blends
_OPPOSED = -1 + _ALL.angle_rad**2


def rounded(b: Boundary) -> dict[int, float]:
    """Radius of the surfaces that round off an edge between two or more others: the greatest, where it changes."""
    s, found = b.surfaces, {i: radii[1] for i, (radii, _) in running(b).items()}
    for i in b.of_kind("cylinder", "torus", "sphere"):
        tangent = {x.other for x in b.sides[i] if x.convexity == "smooth" and x.other not in (i, -1)}
        # What ends in balls on both sides is the groove of a ball-nosed cutter.
        if len(tangent) < 2 or (s.kind[i] == "cylinder" and set(s.kind[list(tangent)]) == {"sphere"}):
            continue
        if s.kind[i] == "cylinder" and s.turn([i]) > _P.half_turn_rad:
            continue
        found[i] = float(s.radius2[i] if s.kind[i] == "torus" else s.radius[i])
    return found


def running(b: Boundary) -> dict[int, tuple[tuple[float, float], Floats]]:
    """Least and greatest radius of free-form surfaces that round off the edge of two planes, and its ends (2, 3).

    A point of the blend on one plane is r (1 - cos a) away from the other, where their normals enclose the angle a."""
    s, found = b.surfaces, {}
    for i, sides in sorted(b.sides.items()):
        if s.kind[i] in ANALYTIC_KINDS or s.start[i] == s.start[i + 1]:
            continue
        tangent = sorted({x.other for x in sides if x.convexity == "smooth"})
        if len(tangent) != 2 or set(s.kind[tangent]) != {"plane"}:
            continue
        (p, q), (d, e) = s.axis[tangent], np.sum(s.origin[tangent] * s.axis[tangent], axis=1)
        away = 1 - float(p @ q)
        if not _P.bent < away < 2 - _P.bent:
            continue
        points = s.points(i)
        on = [np.abs(points @ p - d) < _ALL.length_mm, np.abs(points @ q - e) < _ALL.length_mm]
        if not (on[0].any() and on[1].any()):
            continue
        radii = np.concatenate([np.abs(points[on[0]] @ q - e), np.abs(points[on[1]] @ p - d)]) / away
        run = cross(p, q) / np.linalg.norm(cross(p, q))
        foot = np.linalg.solve(np.array([p, q, run]), np.array([d, e, 0.0]))
        ends = [foot + end * run for end in s.along(i, run)]
        found[i] = ((float(radii.min()), float(radii.max())), np.array(ends))
    return found


def full_rounds(b: Boundary) -> dict[int, float]:
    """Radius of the half cylinders that take the place of a face between two that are parallel."""
    s, found = b.surfaces, {}
    for i in b.of_kind("cylinder", concave=False):
        flanks = sorted({x.other for x in b.sides[i] if x.convexity == "smooth"})
        if len(flanks) == 2 and set(s.kind[flanks]) == {"plane"} and s.axis[flanks[0]] @ s.axis[flanks[1]] < _OPPOSED:
            found[i] = float(s.radius[i])
    return found


def fillets(b: Boundary, taken: set[int]) -> list[Feature]:
    """Chains of blends of one radius that no other feature has: role `fillet` in a corner, `round` on an edge.

    The origin of the longest one is the middle of its axis, X along that; of a changing radius, of the edge it rounds.
    """
    s, changing = b.surfaces, running(b)
    of = {i: r for i, r in (full_rounds(b) | b.blends).items() if i not in taken}
    edges: list[tuple[int, int]] = []
    lines: dict[tuple[float, ...], int] = {}
    for i in sorted(of):
        smooth = [x.other for x in b.sides[i] if x.convexity == "smooth"]
        edges += [(i, j) for j in smooth if j in of and abs(of[i] - of[j]) < _P.same_radius_mm]
        if s.kind[i] == "cylinder":
            # A blend that a hole or a notch cuts in two still lies between the same two faces: it is one.
            planes = [j for j in smooth if s.kind[j] == "plane"]
            if len(planes) == 2:
                keys = [(*b.plane_key(pair), round(of[i], 3)) for pair in (planes, planes[::-1])]
                edges.append((i, lines.setdefault(min(keys), i)))
    found = []
    for members in joined(of, edges):
        longest = max(members, key=lambda i: (round(float(s.area[i]), 6), -i))
        run, centre = s.axis[longest], s.origin[longest]
        measures = lengths(radius=of[longest], length=_total(b, members))
        if longest in changing:
            radii, ends = changing[longest]
            run, centre = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0]), ends.mean(axis=0)
            measures = lengths(radius=radii[1], length=float(np.linalg.norm(ends[1] - ends[0])))
            if radii[1] - radii[0] > _P.same_radius_mm:
                measures |= lengths(least_radius=radii[0])
        elif s.kind[longest] == "sphere":
            run = np.eye(3)[0]
        elif s.kind[longest] == "cylinder":
            low, high = s.extent(_in_line(b, longest, members), run)
            centre = at_level(centre, run, (low + high) / 2)
        normal = s.normals(longest).mean(axis=0)
        normal -= (normal @ run) * run
        if np.linalg.norm(normal) < _ALL.angle_rad:  # all around
            normal = cross(run, np.eye(3)[np.argmin(np.abs(run))])
        pose = frame(run, normal / np.linalg.norm(normal), centre)
        roles = [(i, "fillet" if s.concave[i] else "round") for i in members]
        found.append(Feature("fillet", "", measures, pose, union(s.boxes[members]), roles))
    return found


def _total(b: Boundary, members: list[int]) -> float:
    """Length of a chain; of what lies in one line from end to end."""
    s = b.surfaces
    left, total = [i for i in members if s.kind[i] in ("cylinder", "torus")], 0.0
    while left:
        line = _in_line(b, left[0], left) if s.kind[left[0]] == "cylinder" else left[:1]
        if s.kind[left[0]] == "cylinder":
            total += float(np.ptp(s.extent(line, s.axis[left[0]])))
        else:  # along the centre line of a torus
            gap = float(angle_gaps(s.points(left[0]) - s.origin[left[0]], s.axis[left[0]]).max())
            total += float(s.radius[left[0]] * (2 * np.pi - (gap if gap > _P.open_rad else 0.0)))
        left = [i for i in left if i not in line]
    return total


def _in_line(b: Boundary, one: int, members: list[int]) -> list[int]:
    """Cylinders about one axis."""
    s = b.surfaces
    arm, axis = s.origin[members] - s.origin[one], s.axis[one]
    apart = np.linalg.norm(np.cross(arm, axis), axis=1) + np.linalg.norm(np.cross(s.axis[members], axis), axis=1)
    return [
        i for i, d in zip(members, apart, strict=True) if i == one or (s.kind[i] == "cylinder" and d < _P.same_line)
    ]


def bevelled(b: Boundary) -> dict[int, Feature]:
    """The chamfers: narrow planes and convex cones between two convex edges of 15 to 75 degrees."""
    found = {}
    for i in (*b.of_kind("plane"), *b.of_kind("cone", concave=False)):
        sides = [x for x in b.sides[i] if x.convexity == "convex"]
        slanted = [x for x in sides if _P.slant_rad[0] <= x.angle <= _P.slant_rad[1]]
        make = _plane_chamfer if b.surfaces.kind[i] == "plane" else _cone_chamfer
        if (feature := make(b, i, slanted)) is not None:
            found[i] = feature
    return found


def chamfers(b: Boundary, bevels: dict[int, Feature]) -> list[Feature]:
    """Chamfers.  Those in one plane along one edge count as one, which a slot may have cut."""
    s = b.surfaces
    lines: dict[tuple[float, ...], list[Feature]] = {}
    for i, feature in sorted(bevels.items()):
        run, middle = feature.shape_from_feature[:3, 0], s.boxes[i].reshape(2, 3).mean(axis=0)
        place = np.round(middle - (middle @ run) * run, 2) + 0.0
        key = (*b.plane_key([i]), *place.tolist()) if s.kind[i] == "plane" else (float(i),)
        lines.setdefault(key, []).append(feature)
    for first, *others in lines.values():
        if others:
            pose, members = first.shape_from_feature, [i for one in (first, *others) for i, _ in one.surfaces]
            low, high = s.extent(members, pose[:3, 0])
            pose[:3, 3] = at_level(pose[:3, 3], pose[:3, 0], (low + high) / 2)
            first.dimensions |= lengths(length=high - low)
            first.box, first.surfaces = union(s.boxes[members]), [(i, "chamfer") for i in members]
    return [segments[0] for segments in lines.values()]


def _plane_chamfer(b: Boundary, i: int, slanted: list[BoundaryArc]) -> Feature | None:
    s = b.surfaces
    best: tuple[float, BoundaryArc, BoundaryArc, Floats] | None = None
    for one, two in combinations([x for x in slanted if s.kind[x.other] == "plane"], 2):
        run = cross(s.axis[i], s.axis[one.other])
        run /= np.linalg.norm(run)
        square = abs(run @ s.axis[two.other])
        turn = np.arccos(np.clip(s.axis[one.other] @ s.axis[two.other], -1, 1))
        if one.other == two.other or square > _ALL.angle_rad or abs(turn - one.angle - two.angle) > 1e-3:
            continue
        length = min(one.length, two.length)
        if best is None or length > best[0] + _ALL.length_mm:
            best = length, one, two, run
    if best is None:
        return None
    _, one, two, run = best
    across = cross(s.axis[i], run)
    width = float(np.ptp(s.points(i) @ across))
    length = float(np.ptp(s.points(i) @ run))
    if length < width:
        return None
    # Narrower than the wider face next to it, and than the other one was.
    breadth = {x: float(np.ptp(s.points(x.other) @ cross(s.axis[x.other], run))) for x in (one, two)}
    narrower, wider = sorted((one, two), key=lambda x: breadth[x])
    if width > _P.narrow * breadth[wider] or width > _P.narrow * (breadth[narrower] + width * np.cos(narrower.angle)):
        return None
    measures = lengths(width=width, length=length) | {"angle": (min(one.angle, two.angle), "rad")}
    pose = frame(run, s.axis[i], s.boxes[i].reshape(2, 3).mean(axis=0))
    return Feature("chamfer", "", measures, pose, s.boxes[i], [(i, "chamfer")])


def _cone_chamfer(b: Boundary, i: int, slanted: list[BoundaryArc]) -> Feature | None:
    s, axis = b.surfaces, b.surfaces.axis[i]
    kinds = {s.kind[x.other]: x for x in slanted}
    if kinds.keys() != {"plane", "cylinder"} or s.concave[kinds["cylinder"].other]:
        return None
    plane, cylinder = kinds["plane"].other, kinds["cylinder"].other
    along = [np.linalg.norm(cross(axis, s.axis[k])) for k in (plane, cylinder)]
    low, high = s.along(i, axis)
    width = (high - low) / max(abs(np.cos(s.semi_angle[i])), 1e-9)
    if max(along) > _ALL.angle_rad or width > _P.narrow * s.radius[cylinder]:
        return None
    measures = lengths(width=width, diameter=2 * s.radius[cylinder]) | {"angle": (min(x.angle for x in slanted), "rad")}
    middle = at_level(s.origin[i], axis, (low + high) / 2)
    pose = frame(np.eye(3)[np.argmin(np.abs(axis))], s.axis[plane], middle)
    return Feature("chamfer", "", measures, pose, s.boxes[i], [(i, "chamfer")])
