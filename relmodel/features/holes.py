"""Holes: stacks of coaxial concave surfaces of revolution, with counterbores, countersinks, tips and bottoms."""

from __future__ import annotations

import numpy as np

from relmodel.arrays import Floats
from relmodel.features.feature import ANGLE_TOLERANCE, LENGTH_TOLERANCE, Feature
from relmodel.features.feature_parameters import DEFAULTS
from relmodel.features.frames import cross, frame, off_axis, sideways, union
from relmodel.features.graph import Surfaces
from relmodel.geometry.clusters import clusters, joined, unsigned

Links = list[dict[int, set[str]]]  # as `Boundary` has them

_P = DEFAULTS.holes
_SKEW = ANGLE_TOLERANCE**2  # of a cosine


def holes(s: Surfaces, links: Links) -> list[Feature]:
    """Stacks of coaxial concave surfaces of revolution around a cylinder that holds a pin."""
    bores = _bores(s, links)
    if not bores:
        return []
    # Surfaces of revolution on the axis of some bore, and the planes across it that have no other neighbours.
    leader = {i: bore[0] for bore in bores for i in bore}
    together = [(bore[0], i) for bore in bores for i in bore]
    todo = list(leader)
    while todo:
        i = todo.pop()
        for j in links[i]:
            if j in leader:
                if _on_axis(s, leader[i], leader[j]):
                    together.append((i, j))
            elif _turned_about(s, leader[i], j) or _closes(s, links, leader, i, j):
                leader[j] = leader[i]
                together.append((i, j))
                todo.append(j)
    bore_of = {i: bore for bore in bores for i in bore}
    found = []
    for members in joined(leader, together):
        own = {bore_of[i][0]: bore_of[i] for i in members if i in bore_of}
        found.append(_hole(s, links, members, list(own.values())))
    return found


def _bores(s: Surfaces, links: Links) -> list[list[int]]:
    """Concave cylinders merged where they are one: same axis and radius, touching extents, all around a pin.

    A bore that a pocket, a gap between two ears or another bore interrupts counts as one: it is drilled in one go.
    """
    rows = np.flatnonzero(s.concave & (s.kind == "cylinder") & (np.diff(s.start) > 0))
    if len(rows) == 0:
        return []
    axis, origin = unsigned(s.axis[rows]), s.origin[rows]
    foot = origin - np.sum(origin * axis, axis=1, keepdims=True) * axis
    direction = clusters(axis, ANGLE_TOLERANCE)
    label = clusters(np.column_stack([direction * 1e3, foot, s.radius[rows]]), LENGTH_TOLERANCE)
    bores = []
    for k in range(int(label.max()) + 1):
        members = rows[label == k].tolist()
        extents = sorted((*s.along(i, s.axis[members[0]]), i) for i in members)
        bore, reach, cut = [extents[0][2]], extents[0][1], extents[0][1] - extents[0][0]
        for low, high, i in extents[1:]:
            if low > reach + LENGTH_TOLERANCE:
                most = min(_P.reach * 2 * float(s.radius[i]), _P.air * (cut + high - low))
                if low - reach > most or not _interrupted(s, i, reach, low):
                    bores.append(sorted(bore))
                    bore, cut = [], 0.0
            bore.append(i)
            cut += max(high - max(low, reach), 0.0)
            reach = max(reach, high)
        bores.append(sorted(bore))
    return sorted(bore for bore in bores if s.turn(bore) > _P.least_turn_rad and not _are_corners(s, links, bore))


def _are_corners(s: Surfaces, links: Links, bore: list[int]) -> bool:
    """Whether the segments of a bore are far walls of openings around its axis: material comes in between them."""
    axis = s.axis[bore[0]]

    def leads_in(i: int, j: int) -> bool:
        along = abs(float(s.axis[j] @ axis))
        if s.kind[j] == "plane":  # a facet of a bore passes its axis by at the radius
            off = abs(float((s.origin[j] - s.origin[i]) @ s.axis[j]))
            lies_so = along < ANGLE_TOLERANCE and off < _P.within * s.radius[i]
        else:
            lies_so = s.kind[j] == "cylinder" and along > 1 - _SKEW
        return bool(lies_so and not links[i][j] <= {"convex"} and not _on_axis(s, i, j))

    return all(s.turn([i]) < _P.least_turn_rad and any(leads_in(i, j) for j in links[i]) for i in bore)


def _interrupted(s: Surfaces, bore: int, low: float, high: float) -> bool:
    """Whether nothing but air lies between two lengths of a bore."""
    axis, radius = s.axis[bore], s.radius[bore]
    u, v = (_P.within * radius * d for d in sideways(axis))
    return s.is_free(s.origin[bore] + np.array([0 * u, u, -u, v, -v]), axis, low, high)


def _on_axis(s: Surfaces, bore: int, other: int) -> bool:
    """Whether the axis of one surface of revolution is that of a bore."""
    axis, arm = s.axis[bore], s.origin[other] - s.origin[bore]
    if not np.linalg.norm(cross(axis, arm)) < LENGTH_TOLERANCE:
        return False
    return bool(s.kind[other] == "sphere" or np.linalg.norm(cross(axis, s.axis[other])) < ANGLE_TOLERANCE)


def _turned_about(s: Surfaces, bore: int, other: int) -> bool:
    """Whether a concave cone, torus or sphere belongs to the stack of a bore: countersink, tip, bottom fillet."""
    return bool(s.concave[other] and s.kind[other] in ("cone", "torus", "sphere") and _on_axis(s, bore, other))


def _closes(s: Surfaces, links: Links, leader: dict[int, int], member: int, plane: int) -> bool:
    """Whether a plane across the axis has no neighbours but surfaces of the stack: a bottom or a counterbore's step."""
    axis = s.axis[leader[member]]
    if s.kind[plane] != "plane" or not np.linalg.norm(cross(axis, s.axis[plane])) < ANGLE_TOLERANCE:
        return False
    # The next bore of a step is in `leader` from the start; a tip or fillet beyond is tried by its own rule.
    if all(
        (k in leader and _on_axis(s, leader[member], leader[k])) or _turned_about(s, leader[member], k)
        for k in links[plane]
    ):
        return True
    # What cuts into the bore cuts its bottom too: that is what lies within the bore.
    if (
        s.kind[member] != "cylinder"
        or np.linalg.norm(np.diff(s.boxes[plane].reshape(2, 3), axis=0)) > 3 * s.radius[member]
    ):
        return False
    reach = off_axis(s.points(plane), s.origin[member], axis)
    within = len(reach) > 0 and reach.max() < s.radius[member] + LENGTH_TOLERANCE
    return bool(within and "concave" in links[member][plane])


def _hole(s: Surfaces, links: Links, members: list[int], bores: list[list[int]]) -> Feature:
    narrow = min(bores, key=lambda bore: (s.radius[bore[0]], bore))
    axis, origin = s.axis[narrow[0]], s.origin[narrow[0]]
    zero = float(origin @ axis)
    roles: dict[int, str] = {}
    bottoms: list[float] = []
    wide: list[tuple[float, float]] = []  # radius, place along the axis, of what is wider than the bore
    cones: list[tuple[float, int]] = []
    tips: list[int] = []  # pointed or round bottoms, beyond the depth of full diameter
    for i in members:
        low, high = s.along(i, axis)
        middle = (low + high) / 2 - zero
        reach = off_axis(s.points(i), origin, axis)
        on_axis = s.kind[i] in ("cone", "sphere", "torus") and reach.min(initial=np.inf) < 1e-2 * s.radius[narrow[0]]
        if i in narrow:
            roles[i] = "wall"
        elif on_axis or (s.kind[i] == "plane" and _ends_at(s, links, members, i)):
            roles[i] = "bottom"
            bottoms.append(middle)
            if on_axis:
                tips.append(i)
        elif s.kind[i] == "plane":
            roles[i] = "step"
        elif s.kind[i] == "cone":
            roles[i] = "countersink"
            cones.append((float(reach.max(initial=0.0)), i))
            wide.append((float(reach.max(initial=0.0)), middle))
        elif s.kind[i] == "cylinder":
            roles[i] = "counterbore"
            wide.append((float(s.radius[i]), middle))
        else:
            roles[i] = "blend"
    low, high = s.extent([*(i for i in members if i not in tips), *_rounded_rims(s, links, members)], axis)
    low, high = low - zero, high - zero
    centre = sum(s.extent(narrow, axis)) / 2 - zero
    # Z out of the material: away from the bottom, else towards the widest end, else towards positive coordinates.
    if bottoms:
        towards = centre - bottoms[0]
    elif wide:
        towards = max(wide)[1] - centre
    else:
        towards = float(axis[np.argmax(np.abs(axis) > 1e-6)])
    z = axis if towards > 0 else -axis
    mouth = origin + axis * (high if towards > 0 else low)

    dimensions = {"diameter": (2 * float(s.radius[narrow[0]]), "mm"), "depth": (high - low, "mm")}
    counterbores = [i for i in members if roles[i] == "counterbore"]
    enclosed = [i for i in counterbores if _enclosed(s, i, [*narrow, *counterbores], axis)]
    if enclosed:
        counterbores = [i for i in counterbores if i not in enclosed]
        roles |= dict.fromkeys(enclosed, "groove")
        dimensions["groove_diameter"] = (2 * max(float(s.radius[i]) for i in enclosed), "mm")
        dimensions["groove_width"] = (float(np.ptp([s.along(i, axis) for i in enclosed[:1]])), "mm")
    if counterbores:
        widest = max(float(s.radius[i]) for i in counterbores)
        ends = [s.along(i, z) for i in counterbores if widest - s.radius[i] < LENGTH_TOLERANCE]
        ends += [s.along(i, z) for i in [*enclosed, *_rounded_rims(s, links, counterbores)]]
        ends += [s.along(i, z) for reach, i in cones if reach > widest + LENGTH_TOLERANCE]
        dimensions["counterbore_diameter"] = (2 * widest, "mm")
        dimensions["counterbore_depth"] = (_topmost(ends), "mm")
    if cones:
        radius, cone = max(cones)
        dimensions["countersink_diameter"] = (2 * radius, "mm")
        dimensions["countersink_angle"] = (2 * abs(float(s.semi_angle[cone])), "rad")
    pointed = [abs(float(s.semi_angle[i])) for i in tips if s.kind[i] == "cone"]
    if pointed:
        dimensions["tip_angle"] = (2 * max(pointed), "rad")
    x = cross(np.eye(3)[np.argmin(np.abs(z))], z)
    return Feature(
        kind="blind_hole" if bottoms else "through_hole",
        name="",
        dimensions=dimensions,
        shape_from_feature=frame(x, z, mouth),
        box=union(s.boxes[members]),
        surfaces=sorted(roles.items()),
    )


def _enclosed(s: Surfaces, wide: int, others: list[int], axis: Floats) -> bool:
    """Whether a narrower cylinder goes on on either side of what is wider: a groove for a ring."""
    low, high = s.along(wide, axis)
    narrower = [i for i in others if s.radius[wide] - s.radius[i] > LENGTH_TOLERANCE]
    below = [s.radius[i] for i in narrower if abs(s.along(i, axis)[1] - low) < LENGTH_TOLERANCE]
    above = [s.radius[i] for i in narrower if abs(s.along(i, axis)[0] - high) < LENGTH_TOLERANCE]
    return any(abs(one - two) < LENGTH_TOLERANCE for one in below for two in above)


def _topmost(extents: list[tuple[float, float]]) -> float:
    """Length of the highest run of extents that touch: the other side may be widened too."""
    low, high = max(extents, key=lambda e: e[1])
    for e in sorted(extents, key=lambda e: -e[1]):
        if e[1] > low - LENGTH_TOLERANCE:
            low = min(low, e[0])
    return high - low


def _ends_at(s: Surfaces, links: Links, members: list[int], plane: int) -> bool:
    """Whether a plane of the stack is a bottom: a step lies between two radii."""
    return len({round(float(s.radius[j]), 3) for j in links[plane].keys() & set(members)}) == 1


def _rounded_rims(s: Surfaces, links: Links, members: list[int]) -> list[int]:
    """Tori about the axis that lead smoothly out of the hole."""
    return sorted(
        {
            j
            for i in members
            if s.kind[i] == "cylinder"
            for j, crossed in links[i].items()
            if s.kind[j] == "torus"
            and not s.concave[j]
            and len(s.points(j))
            and _on_axis(s, i, j)
            and "smooth" in crossed
        }
    )
