"""Holes, patterns of equal holes, and relations of circles in space."""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from relmodel.arrays import Floats, Ints, Ragged
from relmodel.features.feature_parameters import DEFAULTS, CircleParameters
from relmodel.features.graph import (
    Feature,
    SolidSurfaces,
    angle_gaps,
    cross,
    feature_class_key,
    frame,
    lengths,
    off_axis,
    outline_form,
    sideways,
    union,
)
from relmodel.geometry.congruence import clusters, joined, unsigned

if TYPE_CHECKING:
    from scipy.spatial import cKDTree


Links = list[dict[int, set[str]]]  # as `Boundary` has them
_ALL = DEFAULTS.common
_HOLES = DEFAULTS.holes


def holes(s: SolidSurfaces, links: Links) -> list[Feature]:
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


def _bores(s: SolidSurfaces, links: Links) -> list[list[int]]:
    """Concave cylinders merged where they are one: same axis and radius, touching extents, all around a pin.

    A bore that a pocket, a gap between two ears or another bore interrupts counts as one: it is drilled in one go."""
    rows = np.flatnonzero(s.concave & (s.kind == "cylinder") & (np.diff(s.start) > 0))
    if len(rows) == 0:
        return []
    axis, origin = unsigned(s.axis[rows]), s.origin[rows]
    foot = origin - np.sum(origin * axis, axis=1, keepdims=True) * axis
    direction = clusters(axis, _ALL.angle_rad)
    label = clusters(np.column_stack([direction * 1e3, foot, s.radius[rows]]), _ALL.length_mm)
    bores = []
    for k in range(int(label.max()) + 1):
        members = rows[label == k].tolist()
        extents = sorted((*s.along(i, s.axis[members[0]]), i) for i in members)
        bore, reach, cut = [extents[0][2]], extents[0][1], extents[0][1] - extents[0][0]
        for low, high, i in extents[1:]:
            if low > reach + _ALL.length_mm:
                most = min(_HOLES.reach * 2 * float(s.radius[i]), _HOLES.air * (cut + high - low))
                u, v = (_HOLES.within * s.radius[i] * d for d in sideways(s.axis[i]))
                inside = s.origin[i] + np.array([0 * u, u, -u, v, -v])
                if low - reach > most or not s.is_free(inside, s.axis[i], reach, low):
                    bores.append(sorted(bore))
                    bore, cut = [], 0.0
            bore.append(i)
            cut += max(high - max(low, reach), 0.0)
            reach = max(reach, high)
        bores.append(sorted(bore))
    return sorted(bore for bore in bores if s.turn(bore) > _HOLES.least_turn_rad and not _are_corners(s, links, bore))


def _are_corners(s: SolidSurfaces, links: Links, bore: list[int]) -> bool:
    """Whether the segments of a bore are far walls of openings around its axis: material comes in between them."""
    axis = s.axis[bore[0]]

    def leads_in(i: int, j: int) -> bool:
        along = abs(float(s.axis[j] @ axis))
        if s.kind[j] == "plane":  # a facet of a bore passes its axis by at the radius
            off = abs(float((s.origin[j] - s.origin[i]) @ s.axis[j]))
            lies_so = along < _ALL.angle_rad and off < _HOLES.within * s.radius[i]
        else:
            lies_so = s.kind[j] == "cylinder" and along > 1 - _ALL.angle_rad**2
        return bool(lies_so and not links[i][j] <= {"convex"} and not _on_axis(s, i, j))

    return all(s.turn([i]) < _HOLES.least_turn_rad and any(leads_in(i, j) for j in links[i]) for i in bore)


def _on_axis(s: SolidSurfaces, bore: int, other: int) -> bool:
    """Whether the axis of one surface of revolution is that of a bore."""
    axis, arm = s.axis[bore], s.origin[other] - s.origin[bore]
    if not np.linalg.norm(cross(axis, arm)) < _ALL.length_mm:
        return False
    return bool(s.kind[other] == "sphere" or np.linalg.norm(cross(axis, s.axis[other])) < _ALL.angle_rad)


def _turned_about(s: SolidSurfaces, bore: int, other: int) -> bool:
    """Whether a concave cone, torus or sphere belongs to the stack of a bore: countersink, tip, bottom fillet."""
    return bool(s.concave[other] and s.kind[other] in ("cone", "torus", "sphere") and _on_axis(s, bore, other))


def _closes(s: SolidSurfaces, links: Links, leader: dict[int, int], member: int, plane: int) -> bool:
    """Whether a plane across the axis has no neighbours but surfaces of the stack: a bottom or a counterbore's step."""
    axis = s.axis[leader[member]]
    if s.kind[plane] != "plane" or not np.linalg.norm(cross(axis, s.axis[plane])) < _ALL.angle_rad:
        return False
    # The next bore of a step is in `leader` from the start; a tip or fillet beyond is tried by its own rule.
    if all(
        (k in leader and _on_axis(s, leader[member], leader[k])) or _turned_about(s, leader[member], k)
        for k in links[plane]
    ):
        return True
    # What cuts into the bore cuts its bottom too: that is what lies within the bore.
    if s.kind[member] != "cylinder" or "concave" not in links[member][plane] or s.start[plane] == s.start[plane + 1]:
        return False
    return bool(off_axis(s.points(plane), s.origin[member], axis).max() < s.radius[member] + _ALL.length_mm)


def _hole(s: SolidSurfaces, links: Links, members: list[int], bores: list[list[int]]) -> Feature:
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
        radii = {round(float(s.radius[j]), 3) for j in links[i].keys() & set(members)}
        if i in narrow:
            roles[i] = "wall"
        elif on_axis or (s.kind[i] == "plane" and len(radii) == 1):  # a step lies between two
            roles[i] = "bottom"
            bottoms.append(middle)
            if on_axis:
                tips.append(i)
        elif s.kind[i] == "plane":
            roles[i] = "step"
        elif s.kind[i] == "cone":
            roles[i] = "countersink"
            cones.append((float(reach.max(initial=0.0)), i))
            wide.append((cones[-1][0], middle))
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

    dimensions = lengths(diameter=2 * float(s.radius[narrow[0]]), depth=high - low)
    counterbores = [i for i in members if roles[i] == "counterbore"]
    enclosed = [i for i in counterbores if _enclosed(s, i, [*narrow, *counterbores], axis)]
    if enclosed:
        counterbores = [i for i in counterbores if i not in enclosed]
        roles |= dict.fromkeys(enclosed, "groove")
        width = float(np.ptp(s.along(enclosed[0], axis)))
        dimensions |= lengths(groove_diameter=2 * max(s.radius[enclosed]), groove_width=width)
    if counterbores:
        widest = max(float(s.radius[i]) for i in counterbores)
        ends = [s.along(i, z) for i in counterbores if widest - s.radius[i] < _ALL.length_mm]
        ends += [s.along(i, z) for i in [*enclosed, *_rounded_rims(s, links, counterbores)]]
        ends += [s.along(i, z) for reach, i in cones if reach > widest + _ALL.length_mm]
        # The highest run of extents that touch: the other side may be widened too.
        ends.sort(key=lambda e: -e[1])
        bottom = ends[0][0]
        for end in ends:
            bottom = min(bottom, end[0]) if end[1] > bottom - _ALL.length_mm else bottom
        dimensions |= lengths(counterbore_diameter=2 * widest, counterbore_depth=ends[0][1] - bottom)
    if cones:
        radius, cone = max(cones)
        dimensions |= lengths(countersink_diameter=2 * radius)
        dimensions["countersink_angle"] = (2 * abs(float(s.semi_angle[cone])), "rad")
    pointed = [abs(float(s.semi_angle[i])) for i in tips if s.kind[i] == "cone"]
    if pointed:
        dimensions["tip_angle"] = (2 * max(pointed), "rad")
    pose = frame(cross(np.eye(3)[np.argmin(np.abs(z))], z), z, mouth)
    kind = "blind_hole" if bottoms else "through_hole"
    return Feature(kind, "", dimensions, pose, union(s.boxes[members]), sorted(roles.items()))


def _enclosed(s: SolidSurfaces, wide: int, others: list[int], axis: Floats) -> bool:
    """Whether a narrower cylinder goes on on either side of what is wider: a groove for a ring."""
    low, high = s.along(wide, axis)
    narrower = [i for i in others if s.radius[wide] - s.radius[i] > _ALL.length_mm]
    below = [s.radius[i] for i in narrower if abs(s.along(i, axis)[1] - low) < _ALL.length_mm]
    above = [s.radius[i] for i in narrower if abs(s.along(i, axis)[0] - high) < _ALL.length_mm]
    return any(abs(one - two) < _ALL.length_mm for one in below for two in above)


def _rounded_rims(s: SolidSurfaces, links: Links, members: list[int]) -> list[int]:
    """Tori about the axis that lead smoothly out of the hole."""
    beside = [(i, j) for i in members if s.kind[i] == "cylinder" for j, met in links[i].items() if "smooth" in met]
    tori = [(i, j) for i, j in beside if s.kind[j] == "torus" and not s.concave[j] and len(s.points(j))]
    return sorted({j for i, j in tori if _on_axis(s, i, j)})


# Patterns of equal holes: bolt circles, rows and grids.

_PATTERNS = DEFAULTS.patterns


def patterns(holes: list[Feature]) -> list[Feature]:
    """Holes of one class with mouths in one plane, evenly spaced on a circle, a line or a rectangular grid.

    Each hole counts once: circles of five and more first, then grids of six and more, rows, smaller circles, and last
    the corners of rectangles; of each the one of most holes first.  A circle of five and more may have gaps."""
    groups: dict[str, list[int]] = {}
    for i, hole in enumerate(holes):
        groups.setdefault(feature_class_key(hole), []).append(i)
    found = []
    for members in groups.values():
        if len(members) < _PATTERNS.least:
            continue
        z = np.array([holes[i].shape_from_feature[:3, 2] for i in members])
        at = np.array([holes[i].shape_from_feature[:3, 3] for i in members])
        label = clusters(np.column_stack([z * 1e3, np.sum(z * at, axis=1)]), _PATTERNS.same)
        for k in range(int(label.max()) + 1):
            own = np.flatnonzero(label == k)
            if len(own) >= _PATTERNS.least:
                found += _in_plane([holes[members[i]] for i in own.tolist()])
    return found


def _in_plane(holes: list[Feature]) -> list[Feature]:
    from scipy.spatial import cKDTree

    pose = holes[0].shape_from_feature
    at = np.array([h.shape_from_feature[:3, 3] for h in holes])
    flat = (at - pose[:3, 3]) @ pose[:3, :2]
    tree = cKDTree(flat)
    found, free = [], np.ones(len(holes), bool)
    rounds = sorted(_circles(flat, tree), key=lambda c: (-len(c), c))
    rows = sorted(_rows(flat, tree), key=lambda r: (-len(r), float(np.linalg.norm(flat[r[1]] - flat[r[0]])), r))
    grids = sorted(_grids(flat, tree), key=lambda g: (-g.size, g.ravel().tolist()))
    for kind, candidates in (
        ("circular_pattern", [np.array([c]) for c in rounds if len(c) >= _PATTERNS.surely_a_circle]),
        ("grid_pattern", [g for g in grids if g.size > 4]),
        ("linear_pattern", [np.array([r]) for r in rows]),
        ("circular_pattern", [np.array([c]) for c in rounds if len(c) < _PATTERNS.surely_a_circle]),
        ("grid_pattern", [g for g in grids if g.size == 4]),
    ):
        for members in candidates:
            if free[members].all():
                free[members] = False
                found.append(_pattern(kind, [holes[i] for i in members.ravel().tolist()], members.shape))
    return found


def _nearest(flat: Floats, tree: cKDTree) -> list[list[int]]:
    count = min(_PATTERNS.nearest + 1, len(flat))
    _, nearest = tree.query(flat, k=count)
    return [[j for j in row if j != i] for i, row in enumerate(np.asarray(nearest).tolist())]


def _at(tree: cKDTree, places: Floats) -> list[int] | None:
    """Rows of the points at places (n, 2); None where one is empty."""
    members = _among(tree, places)
    return members if len(members) == len(places) else None


def _among(tree: cKDTree, places: Floats) -> list[int]:
    """Rows of the points that are at some of the places (n, 2)."""
    away, row = tree.query(places)
    return list(np.asarray(row)[away < _PATTERNS.same].tolist())


def _circles(flat: Floats, tree: cKDTree) -> list[tuple[int, ...]]:
    """Circles on which some point has two neighbours at equal chords, and every place is taken, or most of many."""
    found: set[tuple[int, ...]] = set()
    for i, nearest in enumerate(_nearest(flat, tree)):
        for p, q in combinations(flat[nearest] - flat[i], 2):
            a, c = float(np.linalg.norm(p)), float(np.linalg.norm(q))
            if abs(a - c) > _PATTERNS.same or abs(p[0] * q[1] - p[1] * q[0]) < 1e-3 * a * c:
                continue
            # The angle at the point is that of a regular polygon of `count` corners.
            turn = np.pi - np.arccos(np.clip(p @ q / (a * c), -1, 1))
            count = round(2 * np.pi / turn)
            fits = _PATTERNS.least <= count and _PATTERNS.filled * count <= len(flat)
            if not fits or abs(turn * count - 2 * np.pi) > 1e-3 * count:
                continue
            middle = flat[i] + (p + q) / np.linalg.norm(p + q) * a / (2 * np.sin(np.pi / count))
            arm = flat[i] - middle
            t = 2 * np.pi * np.arange(count) / count
            turned = np.outer(np.cos(t), arm) + np.outer(np.sin(t), [-arm[1], arm[0]])
            members = tuple(sorted(set(_among(tree, middle + turned))))
            if len(members) == count or len(members) >= max(_PATTERNS.surely_a_circle, _PATTERNS.filled * count):
                found.add(members)
    return sorted(found)


def _rows(flat: Floats, tree: cKDTree) -> list[tuple[int, ...]]:
    """Longest runs of points at equal steps."""
    found: set[tuple[int, ...]] = set()
    for i, nearest in enumerate(_nearest(flat, tree)):
        for j in nearest:
            step = flat[j] - flat[i]
            if tuple(np.round(step, 3)) < (0.0, 0.0) or _at(tree, (flat[i] - step)[None]) is not None:
                continue
            run = _run(flat, tree, i, step)
            if len(run) >= _PATTERNS.least:
                found.add(tuple(run))
    return sorted(found)


def _grids(flat: Floats, tree: cKDTree) -> list[Ints]:
    """Points at the crossings of two sets of even lines at right angles: rows, no more than columns, of points."""
    found: dict[tuple[int, ...], Ints] = {}
    for i, nearest in enumerate(_nearest(flat, tree)):
        for j in nearest:
            a = flat[j] - flat[i]
            length = float(np.linalg.norm(a))
            if length < _PATTERNS.same or _at(tree, (flat[i] - a)[None]) is not None:
                continue
            # The next line is that of the nearest point square to the first.
            arm = flat - flat[i]
            square = (np.abs(arm @ a) < _PATTERNS.same * length) & (arm @ [-a[1], a[0]] > _PATTERNS.same * length)
            if not square.any():
                continue
            b = arm[min(np.flatnonzero(square).tolist(), key=lambda k: float(np.linalg.norm(arm[k])))]
            counts = [len(_run(flat, tree, i, step)) for step in (a, b)]
            places = flat[i] + np.arange(counts[1])[:, None, None] * b + np.arange(counts[0])[None, :, None] * a
            members = _at(tree, places.reshape(-1, 2))
            if members is None or min(counts) < 2 or len(set(members)) < len(members):
                continue
            grid = np.array(members).reshape(counts[1], counts[0])
            turned = counts[1] > counts[0] or (counts[1] == counts[0] and np.linalg.norm(b) > length + _PATTERNS.same)
            found.setdefault(tuple(sorted(members)), grid.T if turned else grid)
    return list(found.values())


def _run(flat: Floats, tree: cKDTree, start: int, step: Floats) -> list[int]:
    """Points in even steps from one."""
    run = [start]
    while len(run) <= len(flat) and (more := _at(tree, (flat[start] + len(run) * step)[None])) is not None:
        run += more
    return run


def _pattern(kind: str, holes: list[Feature], shape: tuple[int, ...]) -> Feature:
    z = holes[0].shape_from_feature[:3, 2]
    at = np.array([h.shape_from_feature[:3, 3] for h in holes])
    centre = at.mean(axis=0)
    if kind == "circular_pattern":
        arm = at - centre  # in one plane with the origin, which the centre of their circle lies in too
        squares = np.sum(arm * arm, axis=1)
        centre = centre + np.linalg.lstsq(2 * (arm - arm[0]), squares - squares[0], rcond=1e-9)[0]
        x = at[0] - centre
        measures = lengths(pattern_diameter=2 * float(np.linalg.norm(x)))
    else:
        x = at[1] - at[0]
        measures = lengths(pitch=float(np.linalg.norm(x)))
    if kind == "grid_pattern":
        rows, columns = shape
        measures |= lengths(row_pitch=float(np.linalg.norm(at[columns] - at[0])))
        measures |= {"rows": (float(rows), "1"), "columns": (float(columns), "1")}
    measures |= lengths(hole_diameter=holes[0].dimensions["diameter"][0])
    box = union(np.array([h.box for h in holes]))
    surfaces = sorted({i for h in holes for i, _ in h.surfaces})
    dimensions = {"count": (float(len(holes)), "1"), **measures}
    pose = frame(x, z, centre)
    form: tuple[float, ...] = ()
    if kind == "circular_pattern" and np.ptp(angle_gaps(at - centre, z)) >= _PATTERNS.same:  # with empty places
        form = outline_form(at, ["hole"] * len(at), pose, either_way=False)
    return Feature(kind, "", dimensions, pose, box, [(i, "hole") for i in surfaces], form)


# Relations of circles in space, two by two: the constellations by which a body is found again.
#
# A relation is what rigid motions and mirroring leave unchanged of two circles: both radii, the distance of the
# centres, the cosines of the angles between the normals and between each normal and the line of the centres. Normals
# have no sense. Relations that agree are one class; of a class that repeats through a body only some pairs are kept.

CIRCLE_DEFAULTS = DEFAULTS.circles


def relate(centre: Floats, normal: Floats, radius: Floats, a: Ints, b: Ints) -> dict[str, Floats]:
    """The relations of circles `a` (k,) with `b` (k,) of centre (n, 3) mm, unit normal (n, 3) and radius (n,) mm."""
    line = centre[b] - centre[a]
    distance = np.linalg.norm(line, axis=1)
    line = line / np.maximum(distance, 1e-12)[:, None]
    return {
        "radius_a": radius[a],
        "radius_b": radius[b],
        "distance": distance,
        "normals": np.abs(np.einsum("ij,ij->i", normal[a], normal[b])),
        "rise_a": np.abs(np.einsum("ij,ij->i", normal[a], line)),
        "rise_b": np.abs(np.einsum("ij,ij->i", normal[b], line)),
    }


def classify(
    centre: Floats, normal: Floats, radius: Floats, p: CircleParameters = CIRCLE_DEFAULTS
) -> tuple[dict[str, Floats | Ints], Ragged]:
    """Columns of `circle_relation`, without the object's identity, of circles that stay together; and its `circles`."""
    from scipy.spatial import cKDTree

    near = cKDTree(centre).query_pairs(p.greatest_distance, output_type="ndarray").reshape(-1, 2).astype(np.int64)
    near = near[np.lexsort((near[:, 1], near[:, 0]))]
    values = relate(centre, normal, radius, *near.T)
    # The smaller circle comes first; of equals the one whose normal leans less on the line.
    first, second = (
        np.stack([np.round(values[f"{n}_a"], 2), np.round(values[f"{n}_b"], 2)]) for n in ("radius", "rise")
    )
    turned = (first[0] > first[1]) | ((first[0] == first[1]) & (second[0] > second[1]))
    near[turned] = near[turned][:, ::-1]
    near = near[values["distance"] >= p.least_distance]
    values = relate(centre, normal, radius, *near.T)
    steps = dict.fromkeys(values, p.cosine_step) | {"distance": p.distance_step}
    steps |= {"radius_a": p.radius_step, "radius_b": p.radius_step}
    cell = np.stack([np.rint(values[n] / steps[n]).astype(np.int64) for n in values])
    order = np.lexsort(cell[::-1])
    is_first = (np.diff(cell[:, order], prepend=-1) != 0).any(axis=0)
    class_of = np.cumsum(is_first) - 1
    pairs = np.bincount(class_of)
    means = {name: np.bincount(class_of, v[order], len(pairs)) / pairs for name, v in values.items()}
    # Finer than any tolerance; a column of round numbers takes half the room.
    means = {name: np.round(v, 2 if name == "distance" else 4) for name, v in means.items()}
    kept = _thin(class_of, pairs, p.most_of_class)
    of = np.tile(class_of[kept], 2)  # of the smaller circles, then of the greater
    by_class = np.argsort(of, kind="stable")
    circles = Ragged(near[order[kept]].T.ravel()[by_class], np.searchsorted(of[by_class], np.arange(len(pairs) + 1)))
    return {"class_no": np.arange(len(pairs)), "pairs": pairs, **means}, circles


def select_rare(radius: Floats, p: CircleParameters = CIRCLE_DEFAULTS) -> Ints:
    """Rows (n,), increasing, of the circles to relate: where there are too many, those whose radius (mm) is rarest."""
    _, of, count = np.unique(np.rint(radius / p.radius_step), return_inverse=True, return_counts=True)
    return np.sort(np.argsort(count[of.ravel()], kind="stable")[: p.most_circles])


def _thin(class_of: Ints, pairs: Ints, most: int) -> Ints:
    """Of rows in the order of their classes (n,) at most so many of each, taken evenly."""
    place = np.arange(len(class_of)) - np.repeat(np.cumsum(pairs) - pairs, pairs)
    count = pairs[class_of]
    return np.flatnonzero((count <= most) | ((place + 1) * most // count > place * most // count))
