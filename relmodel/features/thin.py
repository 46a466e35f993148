"""Thin walls between two opposed parallel planes: ribs, flanges at the boundary of a part, and webs under pockets."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from functools import cache
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from relmodel.arrays import Floats, Ints
from relmodel.features.feature_parameters import DEFAULTS
from relmodel.features.graph import Boundary, Feature, ahead, cross, frame, lengths, union
from relmodel.geometry.congruence import clusters, joined, unsigned

if TYPE_CHECKING:
    from shapely import MultiPolygon, Polygon


_ALL = DEFAULTS.common
_P = DEFAULTS.thin


@dataclass
class Pair:
    """Two planes, one behind the other, with material between.  normal: from the second to the first; u, v (3,):
    directions in the planes; overlap: u0, v0, u1, v1 of what one covers of the other, and its area."""

    first: int
    second: int
    thickness: float
    normal: Floats
    u: Floats
    v: Floats
    overlap: Floats
    area: float


def opposed(b: Boundary, arc_direction: Floats) -> list[Pair]:
    """Opposed planes, each with the nearest behind it; arc_direction (n, 3) is NaN for arcs that are not straight."""
    s = b.surfaces
    rows = np.flatnonzero((s.kind == "plane") & (np.diff(s.start) > 0))
    if len(rows) < 2:
        return []
    label = clusters(unsigned(s.axis[rows]), _ALL.angle_rad)
    pairs: dict[tuple[int, int], Pair] = {}
    for k in range(int(label.max()) + 1):
        members = rows[label == k]
        normal = unsigned(s.axis[members[:1]])[0]
        facing = s.axis[members] @ normal > 0
        front, back = members[facing], members[~facing]
        if len(front) and len(back):
            _pair(b, front, back, normal, _edge_direction(b, members, normal, arc_direction), pairs)
    return [pairs[key] for key in sorted(pairs)]


def _edge_direction(b: Boundary, members: Ints, normal: Floats, arc_direction: Floats) -> Floats:
    """Direction of the longest straight edge of planes: extents along it are those of the edge's own plane.  A concave
    edge, which is a foot, is preferred to the slope of a gusset."""
    sides = [(i, x) for i in members.tolist() for x in b.sides.get(i, []) if not np.isnan(arc_direction[x.arc, 0])]
    u = np.zeros(3)
    if sides:
        hollow = [x for i, x in sides if b.across(i, x)[0] == "concave"]
        longest = max(hollow or [x for _, x in sides], key=lambda x: (round(x.length, 6), -x.arc))
        u = arc_direction[longest.arc]
        u = u - (u @ normal) * normal
    if not np.linalg.norm(u) > 1e-9:  # no straight edge, or in a damaged face one that does not lie in it
        u = cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    return np.asarray(u / np.linalg.norm(u))


def _pair(b: Boundary, front: Ints, back: Ints, normal: Floats, u: Floats, pairs: dict[tuple[int, int], Pair]) -> None:
    from shapely import intersection

    s = b.surfaces
    v = cross(normal, u)

    def flat_points(plane: int) -> Floats:
        return np.column_stack([s.points(plane) @ u, s.points(plane) @ v])

    @cache
    def outline(plane: int) -> Polygon | MultiPolygon:
        return outline_of(flat_points(plane))

    @cache
    def common(one: int, two: int) -> Polygon | MultiPolygon:
        return intersection(outline(one), outline(two))  # type: ignore[return-value]

    def extents(members: Ints) -> tuple[Floats, Floats]:
        flat = [flat_points(i) for i in members.tolist()]
        box = np.array([[*p.min(axis=0), *p.max(axis=0)] for p in flat])
        return box, s.origin[members] @ normal

    (front_box, front_at), (back_box, back_at) = extents(front), extents(back)
    for members, boxes, at, others, other_boxes, other_at, sense in (
        (front, front_box, front_at, back, back_box, back_at, 1.0),
        (back, back_box, back_at, front, front_box, front_at, -1.0),
    ):
        order = np.argsort(sense * other_at, kind="stable")
        key = sense * other_at[order]
        reach = np.min(boxes[:, 2:] - boxes[:, :2], axis=1)
        low = np.searchsorted(key, sense * at - reach)
        high = np.searchsorted(key, sense * at - _ALL.length_mm)
        for i in np.flatnonzero(high > low).tolist():
            near = order[low[i] : high[i]]
            least = np.maximum(boxes[i, :2], other_boxes[near, :2])
            most = np.minimum(boxes[i, 2:], other_boxes[near, 2:])
            hit = np.flatnonzero(np.all(most - least > _ALL.length_mm, axis=1))
            gap = sense * (at[i] - other_at[near])
            nearest = np.inf
            for j in hit[np.argsort(gap[hit], kind="stable")].tolist():
                if gap[j] > nearest + _ALL.length_mm:
                    break
                one, two = int(members[i]), int(others[near[j]])
                shared = common(min(one, two), max(one, two))
                if shared.area < _P.touching * min(outline(one).area, outline(two).area):
                    continue
                nearest = gap[j]
                first, second = (one, two) if sense > 0 else (two, one)
                pairs[first, second] = Pair(
                    first, second, float(gap[j]), normal, u, v, np.array(shared.bounds), shared.area
                )


def outline_of(points: Floats) -> Polygon | MultiPolygon:
    """The area that triangles (3 n, 2) cover."""
    from shapely import GEOSException, coverage_union_all, polygons, union_all

    corner = points.reshape(-1, 3, 2)
    (x, y), (p, q) = (corner[:, 1] - corner[:, 0]).T, (corner[:, 2] - corner[:, 0]).T
    across = x * q - y * p
    triangles = polygons(corner[np.abs(across) > 1e-12])
    try:
        covered: Polygon | MultiPolygon = coverage_union_all(triangles)  # type: ignore[assignment]
    except GEOSException:  # those of a damaged face overlap
        covered = union_all(triangles)  # type: ignore[assignment]
    return covered if covered.is_valid else union_all(triangles)  # type: ignore[return-value]


def ribs(b: Boundary, pairs: list[Pair], floors: set[int], taken: set[int]) -> list[Feature]:
    """Ribs (a foot on either side) and flanges (a foot on one side) among the opposed planes.  floors: of pockets and
    slots; what is opposed to one is a web."""
    s, standing = b.surfaces, dict[tuple[int, ...], list[_StandingPair]]()
    thin = [p for p in pairs if p.thickness < _P.thin * min(p.overlap[2:] - p.overlap[:2])]
    slender = {i for p in thin for i in (p.first, p.second)}
    for pair in pairs:
        if {pair.first, pair.second} & (floors | taken):
            continue
        stands = _stands(b, pair, slender)
        if stands is None:
            continue
        along = np.abs([pair.u @ stands.up, pair.v @ stands.up])
        height, length = (pair.overlap[2:] - pair.overlap[:2])[np.argsort(-along)]
        if along.max() > 1 - _ALL.angle_rad and pair.thickness < min(_P.thin * height, length):
            # Equal for pairs of one thickness about one middle plane.
            middle = float((s.origin[pair.first] + s.origin[pair.second]) @ pair.normal) / 2
            normal = np.round(pair.normal * 1e4).astype(int).tolist()
            key = (*normal, round(middle / _P.same_mm), round(pair.thickness / _P.same_mm), len(stands.firm))
            standing.setdefault(key, []).append(stands)
    found = []
    for segments in standing.values():
        found += [rib for line in _in_one_line(b, segments) if (rib := _rib(b, line)) is not None]
    found += _drafted(b, floors | taken | {i for f in found for i, _ in f.surfaces})
    return sorted(found, key=lambda feature: feature.surfaces)


@dataclass
class _StandingPair:
    """A pair that stands in a direction; firm: those of its planes that have a foot."""

    pair: Pair
    up: Floats
    firm: list[int]


def _stands(b: Boundary, pair: Pair, slender: set[int]) -> _StandingPair | None:
    """How a pair stands: a rib on both its feet, a flange on the one it has.  slender: sides of what is thin; it stands
    on one of them, a rib that crosses it, only where on nothing else."""
    s = b.surfaces
    planes = (pair.first, pair.second)
    if not any(b.neighbours(i, "concave") for i in planes):
        return None
    feet = [_feet(b, i) for i in planes]
    ridges = [[*b.neighbours(i, "convex"), *_round_ridge(b, i)] for i in planes]
    own = feet[0] or feet[1]
    # A sheet is slender too, but greater than the ribs on it.
    for foot in sorted(own, key=lambda j: (j in slender, -float(s.area[j]) if j in slender else -own[j], j)):
        up = s.axis[foot]
        if abs(up @ pair.normal) > _ALL.angle_rad:
            continue
        if not all(any((s.normals(j) @ up).max(initial=0.0) > 0.5 for j in ridge) for ridge in ridges):
            continue
        firm = [i for i, on in zip(planes, feet, strict=True) if _contact(b, i, on, up)]
        on = feet[planes.index(firm[0])] if firm else {}
        if len(firm) == 2 or (foot in on and _is_flange(b, firm[0], on, foot, up)):
            return _StandingPair(pair, up, firm)
    return None


def _round_ridge(b: Boundary, side: int) -> list[int]:
    """The half cylinder that a side of a rib ends in."""
    s = b.surfaces
    smooth = sorted({x.other for x in b.sides.get(side, []) if x.convexity == "smooth"} - b.blends.keys())
    return [j for j in smooth if s.kind[j] == "cylinder" and not s.concave[j]]


def _feet(b: Boundary, side: int) -> dict[int, float]:
    """Planes that a plane stands on, and the lengths of the edges between."""
    feet: defaultdict[int, float] = defaultdict(float)
    for x in b.sides.get(side, []):
        convexity, others = b.across(side, x)
        for j in others:
            if convexity == "concave" and b.surfaces.kind[j] == "plane":
                feet[j] += x.length
    return feet


def _contact(b: Boundary, side: int, feet: dict[int, float], up: Floats) -> bool:
    """Whether a side stands on its feet for a fair part of its length."""
    s = b.surfaces
    on = sum(length for j, length in feet.items() if up @ s.axis[j] > 1 - _ALL.angle_rad)
    return bool(on > _P.contact * np.ptp(s.points(side) @ cross(s.axis[side], up)))


def _is_flange(b: Boundary, side: int, feet: dict[int, float], foot: int, up: Floats) -> bool:
    """Of the two legs of an angle the flange is the one on the wider, and no small ledge left by a step."""
    s = b.surfaces
    low, high = s.along(side, up)
    reach = [s.along(j, s.axis[side]) for j in feet if b.plane_key([j]) == b.plane_key([foot])]
    return bool(max(r[1] - r[0] for r in reach) > high - low and high - low > _P.tall * b.extent(up))


def _in_one_line(b: Boundary, segments: list[_StandingPair]) -> list[list[_StandingPair]]:
    """Segments of one middle plane that stand in one line, or on either side of a web."""
    run = cross(segments[0].pair.normal, segments[0].up)
    spans = []
    for segment in segments:
        points = np.concatenate([b.surfaces.points(i) for i in segment.firm]) @ run
        spans.append((float(points.min()), float(points.max())))
    order = sorted(range(len(segments)), key=lambda i: spans[i])
    last, edges = order[0], []
    for i in order[1:]:
        if spans[i][0] - spans[last][1] < _P.crossing * segments[i].pair.thickness:
            edges.append((last, i))
        last = max(last, i, key=lambda k: spans[k][1])
    return [[segments[i] for i in group] for group in joined(range(len(segments)), edges)]


def _rib(b: Boundary, segments: list[_StandingPair]) -> Feature | None:
    s = b.surfaces
    pair, up = segments[0].pair, segments[0].up
    run = cross(pair.normal, up)
    members = sorted({i for p in segments for i in (p.pair.first, p.pair.second)})
    firm = sorted({i for p in segments for i in p.firm})
    # The blends at foot and ridge add to the height.
    finish = {x.other for i in firm for x in b.sides.get(i, []) if x.other in b.blends or x.other in b.chamfers}
    finish |= {j for i in firm for j in _round_ridge(b, i)}
    ends = np.concatenate([s.points(i) for i in firm]) @ run
    tops = np.concatenate([s.points(i) for i in [*firm, *sorted(finish)]]) @ up
    length, height = float(np.ptp(ends)), float(np.ptp(tops))
    middle = float((s.origin[pair.first] + s.origin[pair.second]) @ pair.normal) / 2
    kind = "rib" if len(segments[0].firm) == 2 else "flange"
    outer = max(float(np.ptp(s.points(i) @ run)) for i in members)
    if kind == "flange" and length < _P.share * outer:  # the wall of one pocket near the boundary
        return None
    if length < _P.long * pair.thickness:
        return None
    pose = frame(ahead(run), up, (ends.max() + ends.min()) / 2 * run + tops.min() * up + middle * pair.normal)
    dimensions = lengths(thickness=pair.thickness, length=length, height=height)
    return Feature(kind, "", dimensions, pose, union(s.boxes[members]), [(i, "side") for i in members])


def gussets(b: Boundary, standing: list[Feature]) -> set[int]:
    """Sides of ribs whose ridge falls to the foot: they cover little of the rectangle around them."""
    sides = [(f.shape_from_feature, i) for f in standing if f.kind == "rib" for i, _ in f.surfaces]
    return {
        i
        for pose, i in sides
        if b.surfaces.area[i] < _P.gusset * np.prod(np.ptp(b.surfaces.points(i) @ pose[:3, [0, 2]], axis=0))
    }


def _drafted(b: Boundary, taken: set[int]) -> list[Feature]:
    """Ribs whose sides lean to each other by one angle, from a foot up to one ridge; thickness is that at the foot."""
    s, found = b.surfaces, []
    used = set(taken)
    for ridge in b.of_kind("plane"):
        up = s.axis[ridge]
        sides = []
        for i in b.neighbours(ridge, "convex"):
            if s.kind[i] != "plane" or i in used or not _P.lean[0] < s.axis[i] @ up < _P.lean[1]:
                continue
            feet = [j for j in _feet(b, i) if s.axis[j] @ up > 1 - _ALL.angle_rad]
            if feet:
                sides.append((i, float(s.origin[feet[0]] @ up)))
        for (one, level), (two, other) in combinations(sides, 2):
            rib = _drafted_rib(b, ridge, one, two, level) if abs(level - other) < _ALL.length_mm else None
            if rib is not None and not used & {one, two}:
                found.append(rib)
                used |= {one, two}
    return found


def _drafted_rib(b: Boundary, ridge: int, one: int, two: int, level: float) -> Feature | None:
    s, up = b.surfaces, b.surfaces.axis[ridge]
    lean = float(s.axis[one] @ up)
    across = s.axis[one] - lean * up
    across /= np.linalg.norm(across)
    if np.abs(s.axis[two] - lean * up + np.cos(np.arcsin(lean)) * across).max() > _P.lean[0] / 10:
        return None
    places = [float((s.origin[i] @ s.axis[i] - level * lean) / (s.axis[i] @ across)) for i in (one, two)]
    run = cross(across, up)
    ends = np.concatenate([s.points(one), s.points(two)]) @ run
    thickness, length = places[0] - places[1], float(np.ptp(ends))
    height = float(s.origin[ridge] @ up) - level
    if not _ALL.length_mm < thickness < _P.thin * height or length < _P.long * thickness:
        return None
    pose = frame(ahead(run), up, (ends.min() + ends.max()) / 2 * run + sum(places) / 2 * across + level * up)
    dimensions = lengths(thickness=thickness, length=length, height=height)
    dimensions["draft_angle"] = (float(np.arcsin(lean)), "rad")
    roles = [(i, "side") for i in sorted((one, two))]
    return Feature("rib", "", dimensions, pose, union(s.boxes[[one, two]]), roles)


def webs(b: Boundary, pairs: list[Pair], hollows: list[Feature]) -> list[Feature]:
    """What is left under the floors of pockets and slots, where it is thin: one feature a floor, or a pair of them."""
    s = b.surfaces
    floor_of = {i: f for f in hollows for i, role in f.surfaces if role == "floor"}
    found: dict[tuple[int, ...], Feature] = {}
    for pair in pairs:
        at = [floor_of.get(i) for i in (pair.first, pair.second)]
        known = [f for f in at if f is not None]
        if not known:
            continue
        least = min(known, key=lambda f: f.dimensions["length"][0] * f.dimensions["width"][0])
        length, width = least.dimensions["length"][0], least.dimensions["width"][0]
        floors = tuple(sorted(i for f in known for i, role in f.surfaces if role == "floor"))
        own = [i for i, role in least.surfaces if role == "floor"]
        under = _P.under * sum(float(s.area[i]) for i in own)
        if pair.thickness > _P.thin_web * min(length, width) or pair.area < under or floors in found:
            continue
        up = least.shape_from_feature[:3, 2]
        middle = least.shape_from_feature[:3, 3] - up * pair.thickness / 2
        members = sorted({*floors, *(i for f, i in zip(at, (pair.first, pair.second), strict=True) if f is not None)})
        low, high = union(s.boxes[own]).reshape(2, 3)
        box = np.r_[np.minimum(low, low - up * pair.thickness), np.maximum(high, high - up * pair.thickness)]
        pose = frame(least.shape_from_feature[:3, 0], up, middle)
        dimensions = lengths(thickness=pair.thickness, length=length, width=width)
        found[floors] = Feature("web", "", dimensions, pose, box, [(i, "side") for i in members])
    return list(found.values())
