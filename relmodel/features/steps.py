"""Steps: floors at a wall, or in a corner of two, that are open to the other sides."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from relmodel.arrays import Floats
from relmodel.features.feature import ANGLE_TOLERANCE, LENGTH_TOLERANCE, Feature, lengths
from relmodel.features.feature_parameters import DEFAULTS
from relmodel.features.frames import ahead, at_level, cross, frame, rectangle
from relmodel.features.graph import Boundary
from relmodel.features.openings import walls_form
from relmodel.features.pockets import Floor, fillet_radius, prism_box, top, walls_of

_P = DEFAULTS.steps


@dataclass
class Ledge:
    """A floor that is open to some side, its plane walls, all planes next to it, and hollow cylinders upright on it."""

    floor: Floor
    walls: list[int]
    around: set[int]
    hollow: list[int]


def steps(b: Boundary, ledges: list[Ledge], used: set[int], thin: set[int]) -> list[Feature]:
    """Steps of a wall or two, and those that a cutter has sunk into a corner; used, thin: surfaces that belong to no
    step.

    Of two candidates the floor is the one parallel to the face that the walls end in.
    """
    s = b.surfaces
    used = used | thin
    groups: dict[tuple[float, ...], tuple[list[int], list[int]]] = {}
    for ledge in sorted(ledges, key=lambda c: not _is_level(b, c)):
        floor, walls = ledge.floor, ledge.walls or ledge.hollow
        around = {*floor.faces, *walls}
        planes = {b.plane_key([j]) for j in ledge.walls}
        if used & around or len(planes) > 2 or any(s.axis[j] @ floor.up < -_P.over for j in ledge.walls):
            continue
        key = b.plane_key([floor.faces[0], *ledge.walls]) + (b.support_key(walls[0]) if not planes else ())
        floors, members = groups.setdefault(key, ([], []))
        floors += floor.faces
        members += walls
        used = used | around
    found = []
    for faces, walls in groups.values():
        make = _step if b.surfaces.kind[walls[0]] == "plane" else _round_step
        step = make(b, floor_of(b, faces), sorted(set(walls)))
        if step is not None:
            found.append(step)
    return found


def _is_level(b: Boundary, ledge: Ledge) -> bool:
    """Whether each wall that ends in planes ends in one parallel to the floor."""
    s, up = b.surfaces, ledge.floor.up
    for wall in ledge.walls or ledge.hollow:
        ends = [k for k in b.neighbours(wall, "convex") if s.kind[k] == "plane" and k not in b.chamfers]
        facing = [s.axis[k] @ up for k in ends]
        if max(facing, default=0.0) > _P.over and max(facing) < 1 - ANGLE_TOLERANCE:
            return False
    return True


def floor_of(b: Boundary, faces: list[int]) -> Floor:
    s, first = b.surfaces, faces[0]
    return Floor(sorted(set(faces)), s.axis[first], float(s.origin[first] @ s.axis[first]))


def run_along(up: Floats, normal: Floats) -> Floats:
    """Direction in which a wall runs along a floor."""
    run = cross(up, normal)
    out: Floats = run / np.linalg.norm(run)
    return out


def _step(b: Boundary, floor: Floor, walls: list[int]) -> Feature | None:
    """A step that its plane walls run all along."""
    s, up, level = b.surfaces, floor.up, floor.level
    roles = walls_of(b, floor) | dict.fromkeys(walls, "wall")
    points = np.concatenate([s.points(i) for i, role in roles.items() if role != "wall"])
    depth = top(b, walls, up) - level
    square = all(_spans(b, _parallel(b, walls, i), points, run_along(up, s.axis[i])) for i in walls)
    run = run_along(up, s.axis[walls[0]]) if square else _edge_along(b, walls, points, up)
    if run is None or depth < LENGTH_TOLERANCE:
        return None
    across = cross(up, run)
    length, width = float(np.ptp(points @ run)), float(np.ptp(points @ across))
    if len(walls) > 1 and width > length:
        run, length, width = across, width, length
    across = cross(up, run)
    centre = sum(((points @ d).min() + (points @ d).max()) / 2 * d for d in (run, across)) + level * up
    x = ahead(run)
    pose = frame(x, up, centre)
    box = prism_box(b, sorted(roles), pose, length, width, depth)
    dimensions = lengths(length=length, width=width, depth=depth) | fillet_radius(b, roles)
    form = () if square else walls_form(b, walls, pose, either_way=False)
    return Feature("step", "", dimensions, pose, box, sorted(roles.items()), form)


def _parallel(b: Boundary, walls: list[int], wall: int) -> list[int]:
    """Those of the walls that are parallel to one of them."""
    s = b.surfaces
    return [i for i in walls if abs(s.axis[i] @ s.axis[wall]) > 0.99]


def _spans(b: Boundary, walls: list[int], points: Floats, run: Floats) -> bool:
    """Whether walls reach as far along a direction as the points of a floor."""
    reach = np.ptp(np.concatenate([b.surfaces.points(i) for i in walls]) @ run)
    share = float(reach / max(np.ptp(points @ run), LENGTH_TOLERANCE))
    return _P.spans < share < 1 / _P.spans


def _edge_along(b: Boundary, walls: list[int], points: Floats, up: Floats) -> Floats | None:
    """Direction of the open edge of a floor which a slanted wall, or two that meet, face from end to end."""
    s = b.surfaces
    if any(j not in [*b.neighbours(i, "concave"), *_parallel(b, walls, i)] for i in walls for j in walls):
        return None
    x = rectangle(points, up)[0]
    for run in (x, cross(up, x)):
        facing = s.axis[walls] @ cross(up, run)
        if (facing.min() > _P.over or facing.max() < -_P.over) and _spans(b, walls, points, run):
            return run
    return None


def _round_step(b: Boundary, floor: Floor, walls: list[int]) -> Feature | None:
    """A step that a hollow cylinder bounds."""
    s, up, level = b.surfaces, floor.up, floor.level
    roles = walls_of(b, floor) | dict.fromkeys(walls, "wall")
    points = np.concatenate([s.points(i) for i, role in roles.items() if role != "wall"])
    depth = top(b, walls, up) - level
    if depth < LENGTH_TOLERANCE:
        return None
    x, centre, length, width = rectangle(points, up)
    pose = frame(x, up, at_level(centre, up, level))
    box = prism_box(b, sorted(roles), pose, length, width, depth)
    dimensions = lengths(length=length, width=width, depth=depth, corner_radius=float(s.radius[walls[0]]))
    return Feature("step", "", dimensions, pose, box, sorted(roles.items()))
