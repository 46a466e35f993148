"""A bent pipe and a block rounded all over, of random sizes; and the body of an outline."""

from __future__ import annotations

from typing import Any

import numpy as np
from OCP.BRepAlgoAPI import BRepAlgoAPI_Common
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace, BRepBuilderAPI_MakePolygon
from OCP.BRepPrimAPI import BRepPrimAPI_MakeRevol, BRepPrimAPI_MakeSphere, BRepPrimAPI_MakeTorus
from OCP.gp import gp_Ax1, gp_Ax2, gp_Dir, gp_Pnt

from tests.parts.solids import Part, Point, Rng, box, cone, cylinder, fillet, turned


def generate(seed: int) -> Any:
    """The body of a seed, 3 or 4 above a multiple of 5."""
    rng = np.random.default_rng(seed)
    maker = (pipe, rounded)[seed % 5 - 3]
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
