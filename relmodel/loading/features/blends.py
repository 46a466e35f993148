"""Blends (rounded edges) and chamfers (edges cut off)."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from relmodel.loading.features.feature import ANGLE_TOLERANCE, LENGTH_TOLERANCE, Feature, frame, lengths, union
from relmodel.loading.features.graph import Boundary, Side, Surfaces

Floats = npt.NDArray[np.float64]

_LESS_THAN_HALF_A_TURN = 0.95 * np.pi  # a half cylinder between parallel walls is the end of a slot
_SLANT = np.radians([15, 75])  # of a chamfer to the faces beside it
_NARROW = 0.8  # width of a chamfer to that of the faces beside it
_OPEN = 0.3  # rad without a point: more than one facet of a mesh spans
_SAME_RADIUS = 1e-3  # mm


def rounded(b: Boundary) -> dict[int, float]:
    """Radius of the cylinders, tori and spheres that run smoothly into two or more other surfaces."""
    s, found = b.surfaces, {}
    for i, sides in sorted(b.sides.items()):
        if s.kind[i] not in ("cylinder", "torus", "sphere") or s.start[i] == s.start[i + 1]:
            continue
        beside = {x.other for x in sides if x.convexity == "smooth" and not _continues(s, i, x.other)}
        if len(beside) < 2 or (s.kind[i] == "cylinder" and s.turn([i]) > _LESS_THAN_HALF_A_TURN):
            continue
        found[i] = float(s.radius2[i] if s.kind[i] == "torus" else s.radius[i])
    return found


def fillets(b: Boundary, taken: set[int]) -> list[Feature]:
    """Chains of blends of one radius that no other feature has: role `fillet` in a corner, `round` on an edge.

    The origin of the longest one is the middle of its axis, X along that.
    """
    import networkx as nx

    s = b.surfaces
    chains: nx.Graph[int] = nx.Graph()
    chains.add_nodes_from(b.blends.keys() - taken)
    for i in list(chains):
        for x in b.sides[i]:
            if x.convexity == "smooth" and x.other in chains and abs(b.blends[i] - b.blends[x.other]) < _SAME_RADIUS:
                chains.add_edge(i, x.other)
    found = []
    for members in sorted(sorted(component) for component in nx.connected_components(chains)):
        longest = max(members, key=lambda i: (round(float(s.area[i]), 6), -i))
        total = sum(_length(s, i) for i in members if s.kind[i] != "sphere")
        run, centre = s.axis[longest], s.origin[longest]
        if s.kind[longest] == "sphere":
            run = np.eye(3)[0]
        elif s.kind[longest] == "cylinder":
            centre = centre + (sum(s.along(longest, run)) / 2 - float(centre @ run)) * run
        normal = s.normals(longest).mean(axis=0)
        normal -= (normal @ run) * run
        if np.linalg.norm(normal) < ANGLE_TOLERANCE:  # all around
            normal = np.cross(run, np.eye(3)[np.argmin(np.abs(run))])
        pose = frame(run, normal / np.linalg.norm(normal), centre)
        roles = [(i, "fillet" if s.concave[i] else "round") for i in members]
        measures = lengths(radius=b.blends[longest], length=total)
        found.append(Feature("fillet", "", measures, pose, union(s.boxes[members]), roles))
    return found


def bevelled(b: Boundary) -> dict[int, Feature]:
    """The chamfers: narrow planes and convex cones between two convex edges of 15 to 75 degrees."""
    found = {}
    for i, sides in sorted(b.sides.items()):
        if b.surfaces.start[i] == b.surfaces.start[i + 1]:
            continue
        slanted = [x for x in sides if x.convexity == "convex" and _SLANT[0] <= x.angle <= _SLANT[1]]
        feature = None
        if b.surfaces.kind[i] == "plane":
            feature = _plane_chamfer(b, i, slanted)
        elif b.surfaces.kind[i] == "cone" and not b.surfaces.concave[i]:
            feature = _cone_chamfer(b, i, slanted)
        if feature is not None:
            found[i] = feature
    return found


def _plane_chamfer(b: Boundary, i: int, slanted: list[Side]) -> Feature | None:
    s = b.surfaces
    best: tuple[float, Side, Side, Floats] | None = None
    for n, one in enumerate(slanted):
        for two in slanted[n + 1 :]:
            if one.other == two.other or {s.kind[one.other], s.kind[two.other]} != {"plane"}:
                continue
            run = np.cross(s.axis[i], s.axis[one.other])
            run /= np.linalg.norm(run)
            square = abs(run @ s.axis[two.other])
            turn = np.arccos(np.clip(s.axis[one.other] @ s.axis[two.other], -1, 1))
            if square > ANGLE_TOLERANCE or abs(turn - one.angle - two.angle) > 1e-3:
                continue
            length = min(one.length, two.length)
            if best is None or length > best[0] + LENGTH_TOLERANCE:
                best = length, one, two, run
    if best is None:
        return None
    _, one, two, run = best
    across = np.cross(s.axis[i], run)
    width = float(np.ptp(s.points(i) @ across))
    length = float(np.ptp(s.points(i) @ run))
    if length < width:
        return None
    for x in (one, two):
        if width > _NARROW * np.ptp(s.points(x.other) @ np.cross(s.axis[x.other], run)):
            return None
    measures = lengths(width=width, length=length) | {"angle": (min(one.angle, two.angle), "rad")}
    pose = frame(run, s.axis[i], s.boxes[i].reshape(2, 3).mean(axis=0))
    return Feature("chamfer", "", measures, pose, s.boxes[i], [(i, "chamfer")])


def _cone_chamfer(b: Boundary, i: int, slanted: list[Side]) -> Feature | None:
    s, axis = b.surfaces, b.surfaces.axis[i]
    kinds = {s.kind[x.other]: x for x in slanted}
    if kinds.keys() != {"plane", "cylinder"} or s.concave[kinds["cylinder"].other]:
        return None
    plane, cylinder = kinds["plane"].other, kinds["cylinder"].other
    along = [np.linalg.norm(np.cross(axis, s.axis[k])) for k in (plane, cylinder)]
    low, high = s.along(i, axis)
    width = (high - low) / max(abs(np.cos(s.semi_angle[i])), 1e-9)
    if max(along) > ANGLE_TOLERANCE or width > _NARROW * s.radius[cylinder]:
        return None
    measures = lengths(width=width, diameter=2 * s.radius[cylinder]) | {"angle": (min(x.angle for x in slanted), "rad")}
    middle = s.origin[i] + ((low + high) / 2 - s.origin[i] @ axis) * axis
    pose = frame(np.eye(3)[np.argmin(np.abs(axis))], s.axis[plane], middle)
    return Feature("chamfer", "", measures, pose, s.boxes[i], [(i, "chamfer")])


def _continues(s: Surfaces, i: int, other: int) -> bool:
    """Whether a surface is the other half of one that was cut in two."""
    if other < 0 or other == i:
        return True
    if s.kind[i] != s.kind[other] or abs(s.radius[i] - s.radius[other]) > _SAME_RADIUS:
        return False
    arm = s.origin[other] - s.origin[i]
    if s.kind[i] == "cylinder":
        parallel = np.linalg.norm(np.cross(s.axis[i], s.axis[other])) < ANGLE_TOLERANCE
        return bool(parallel and np.linalg.norm(np.cross(s.axis[i], arm)) < LENGTH_TOLERANCE)
    return bool(np.linalg.norm(arm) < LENGTH_TOLERANCE)


def _length(s: Surfaces, i: int) -> float:
    """Length along a cylinder, or along the centre line of a torus."""
    if s.kind[i] == "cylinder":
        low, high = s.along(i, s.axis[i])
        return high - low
    axis = s.axis[i]
    u = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    arm = s.points(i) - s.origin[i]
    angle = np.sort(np.arctan2(arm @ np.cross(axis, u), arm @ u))
    gap = float(np.diff(angle, append=angle[0] + 2 * np.pi).max())
    return float(s.radius[i] * (2 * np.pi - (gap if gap > _OPEN else 0.0)))
