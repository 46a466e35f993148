"""Parts of cones, spheres, tori and rolling-ball blends, whole and partial, that the CAD kernel composes at random.

A part is a plate with a grid of cells, each with something round on its top, or a turned shaft, or a bent pipe, or a
block rounded all over.  Every other part is turned and moved.
"""

from __future__ import annotations

from contextlib import suppress
from typing import Any

import numpy as np
from OCP.BRepAlgoAPI import BRepAlgoAPI_Common
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace, BRepBuilderAPI_MakePolygon
from OCP.BRepPrimAPI import BRepPrimAPI_MakeRevol, BRepPrimAPI_MakeSphere, BRepPrimAPI_MakeTorus
from OCP.gp import gp_Ax1, gp_Ax2, gp_Dir, gp_Pnt

from tests.parts.solids import (
    CELL,
    Part,
    Point,
    Rng,
    at_height,
    box,
    chamfer,
    cone,
    cylinder,
    fillet,
    obround,
    round_box,
    turned,
)


def generate(seed: int) -> Any:
    """The body of a seed."""
    rng = np.random.default_rng(seed)
    maker = (plate, plate, shaft, pipe, rounded)[seed % 5]
    part = Part(maker(rng))
    return (turned(part, rng) if seed % 2 else part).body


def sphere(centre: Point, radius: float) -> Any:
    return BRepPrimAPI_MakeSphere(gp_Pnt(*centre), radius).Shape()


def torus(centre: Point, major: float, minor: float, axis: Point = (0, 0, 1)) -> Any:
    return BRepPrimAPI_MakeTorus(gp_Ax2(gp_Pnt(*centre), gp_Dir(*axis)), major, minor).Shape()


def revolved(outline: list[tuple[float, float]], angle: float = 2 * np.pi) -> Any:
    """The body that an outline of points (r, z) sweeps about z."""
    polygon = BRepBuilderAPI_MakePolygon()
    for r, z in outline:
        polygon.Add(gp_Pnt(r, 0, z))
    polygon.Close()
    face = BRepBuilderAPI_MakeFace(polygon.Wire()).Face()
    return BRepPrimAPI_MakeRevol(face, gp_Ax1(gp_Pnt(0, 0, 0), gp_Dir(0, 0, 1)), angle).Shape()


def plate(rng: Rng) -> Any:
    """Three by two cells, each with a thing of its own."""
    t = float(rng.uniform(18, 30))
    part = Part(box((0, 0, 0), (3 * CELL, 2 * CELL, t)))
    makers = rng.permutation(len(CELLS))[:6]
    for k, which in enumerate(makers.tolist()):
        CELLS[which](part, rng, (k % 3 + 0.5) * CELL, (k // 3 + 0.5) * CELL, t)
    return part.body


def _dimple(part: Part, rng: Rng, x: float, y: float, t: float) -> None:
    r = float(rng.uniform(8, 20))
    part.cut(sphere((x, y, t + r * float(rng.uniform(0.2, 0.6))), r))


def _dome(part: Part, rng: Rng, x: float, y: float, t: float) -> None:
    r = float(rng.uniform(6, 20))
    part.fuse(sphere((x, y, t - r * float(rng.uniform(0.0, 0.5))), r))


def _ball_ended(part: Part, rng: Rng, x: float, y: float, t: float) -> None:
    r = float(rng.uniform(4, 10))
    z = t - float(rng.uniform(2, 6))
    part.cut(cylinder((x, y, z), r, 50), sphere((x, y, z), r))


def _frustum(part: Part, rng: Rng, x: float, y: float, t: float) -> None:
    r = float(rng.uniform(10, 22))
    part.fuse(cone((x, y, t), r, r * float(rng.uniform(0.3, 0.8)), float(rng.uniform(6, 20))))


def _spike(part: Part, rng: Rng, x: float, y: float, t: float) -> None:
    r = float(rng.uniform(6, 18))
    part.fuse(cone((x, y, t), r, 0.0, float(rng.uniform(8, 25))))


def _drilled(part: Part, rng: Rng, x: float, y: float, t: float) -> None:
    """A blind hole with the drill's tip, countersunk."""
    r, depth = float(rng.uniform(3, 9)), t * 0.6
    tip = r / np.tan(np.radians(59))
    part.cut(cylinder((x, y, t - depth), r, depth + 1), cone((x, y, t - depth - tip), 0.0, r, tip))
    sink = r * float(rng.uniform(0.3, 0.8))
    part.cut(cone((x, y, t - sink), r, r + sink, sink))


def _bead(part: Part, rng: Rng, x: float, y: float, t: float) -> None:
    minor = float(rng.uniform(2, 5))
    part.fuse(torus((x, y, t), float(rng.uniform(10, 20)), minor))


def _groove(part: Part, rng: Rng, x: float, y: float, t: float) -> None:
    minor = float(rng.uniform(2, 5))
    part.cut(torus((x, y, t + 0.3 * minor), float(rng.uniform(10, 20)), minor))


def _filleted_boss(part: Part, rng: Rng, x: float, y: float, t: float) -> None:
    """A pin whose top edge is rounded and whose foot is blended into the plate."""
    r, h = float(rng.uniform(8, 16)), float(rng.uniform(10, 18))
    blend = float(rng.uniform(2, 4))
    part.fuse(fillet(cylinder((x, y, t), r, h), blend, at_height(t + h)))

    def foot(a: Any, b: Any) -> bool:
        on = at_height(t)(a, b)
        return bool(on and max(np.hypot(*(p[:2] - [x, y])) for p in (a, b)) < r + 1e-3)

    part.body = fillet(part.body, blend, foot)


def _pocket(part: Part, rng: Rng, x: float, y: float, t: float) -> None:
    """A pocket with rounded corners and floor."""
    a, b = (float(rng.uniform(14, 24)) for _ in range(2))
    corner = float(rng.uniform(5, 9))
    part.cut(round_box((x - a, y - b, t - 12), (x + a, y + b, t + 5), corner, corner * float(rng.uniform(0.3, 0.8))))


def _slot(part: Part, rng: Rng, x: float, y: float, t: float) -> None:
    """A slot of round ends whose floor is rounded: halves of a torus."""
    width = float(rng.uniform(10, 20))
    floor = width * float(rng.uniform(0.15, 0.4))
    part.cut(fillet(obround((x, y, t - 10), 46, width, 15), floor, at_height(t - 10)))


def _ball_pocket(part: Part, rng: Rng, x: float, y: float, t: float) -> None:
    """A pocket rounded by one ball at corners and floor: its corners are spheres."""
    a, b = (float(rng.uniform(14, 24)) for _ in range(2))
    r = float(rng.uniform(3, 7))
    solid = box((x - a, y - b, t - 12), (x + a, y + b, t + 5))
    part.cut(fillet(solid, r, lambda p, q: bool(min(p[2], q[2]) < t + 4)))


CELLS = (
    _dimple,
    _dome,
    _ball_ended,
    _frustum,
    _spike,
    _drilled,
    _bead,
    _groove,
    _filleted_boss,
    _pocket,
    _slot,
    _ball_pocket,
)


def shaft(rng: Rng) -> Any:
    """Steps, tapers, a round end, blends in the steps and a ring groove; half of them cut open along the axis."""
    z, outline = 0.0, [(0.0, 0.0)]
    radius = float(rng.uniform(12, 20))
    heights = []
    for _ in range(4):
        length = float(rng.uniform(12, 25))
        taper = float(rng.choice([0.0, 0.0, 3.0, -3.0]))
        outline += [(radius, z), (radius + taper, z + length)]
        heights.append((z, radius))
        z += length
        radius = max(radius + taper + float(rng.choice([-4.0, 5.0])), 6.0)
    outline.append((0.0, z))
    part = Part(revolved(outline))
    top = outline[-2][0]
    part.fuse(sphere((0, 0, z - 0.2 * top), top * 0.9))
    part.cut(torus((0, 0, 6), heights[0][1] + 0.5, 2.5))
    foot = float(rng.uniform(1.0, 2.0))
    part.body = chamfer(part.body, foot, at_height(0.0))
    with suppress(Exception):  # not every pair of steps leaves the ball room
        part.body = fillet(part.body, float(rng.uniform(1.0, 2.0)), at_height(heights[2][0]))
    if rng.random() < 0.5:
        part.cut(box((0.3, -100, -100), (100, 100, 200)))
    return part.body


def pipe(rng: Rng) -> Any:
    """A bend between two straight ends: part of a torus, outside and inside."""
    outer = float(rng.uniform(6, 12))
    wall = outer * float(rng.uniform(0.1, 0.4))
    bend = outer * float(rng.uniform(1.5, 4))
    quarter = box((0, 0, -50), (200, 200, 50))
    ring = Part(torus((0, 0, 0), bend, outer))
    ring.cut(torus((0, 0, 0), bend, outer - wall))
    part = Part(BRepAlgoAPI_Common(ring.body, quarter).Shape())
    for foot, axis in (((bend, 0.0, 0.0), (0, -1, 0)), ((0.0, bend, 0.0), (-1, 0, 0))):
        straight = Part(cylinder(foot, outer, 30, axis))
        straight.cut(cylinder(foot, outer - wall, 30, axis))
        part.fuse(straight.body)
    return part.body


def rounded(rng: Rng) -> Any:
    """A block all of whose edges are rounded, with a ball and a cone out of it and a slanted pin blended into it."""
    a, b, c = (float(rng.uniform(30, 60)) for _ in range(3))
    r = float(rng.uniform(3, 8))
    part = Part(fillet(box((0, 0, 0), (a, b, c)), r, lambda p, q: True))
    part.cut(sphere((a / 2, b / 2, c + r), min(a, b) / 3))
    part.fuse(cone((a / 2, b / 2, -8), 3.0, 9.0, 10))
    lean = float(rng.uniform(0.15, 0.5))
    part.fuse(cylinder((a - 10, b / 2, c / 2), c / 5, 40, (1, 0, lean)))
    return part.body
