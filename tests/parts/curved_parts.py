"""A block rounded all over, and bodies of revolution."""

from __future__ import annotations

from typing import Any

import numpy as np
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace, BRepBuilderAPI_MakePolygon
from OCP.BRepPrimAPI import BRepPrimAPI_MakeRevol, BRepPrimAPI_MakeSphere, BRepPrimAPI_MakeTorus
from OCP.gp import gp_Ax1, gp_Ax2, gp_Dir, gp_Pnt

from tests.parts.solids import Part, Point, box, cone, cylinder, fillet


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


def rounded() -> Any:
    """A block all of whose edges are rounded, with a ball and a cone out of it and a slanted pin blended into it."""
    rng = np.random.default_rng(4)
    a, b, c = (float(rng.uniform(30, 60)) for _ in range(3))
    r = float(rng.uniform(3, 8))
    part = Part(fillet(box((0, 0, 0), (a, b, c)), r, lambda p, q: True))
    part.cut(sphere((a / 2, b / 2, c + r), min(a, b) / 3))
    part.fuse(cone((a / 2, b / 2, -8), 3.0, 9.0, 10))
    lean = float(rng.uniform(0.15, 0.5))
    part.fuse(cylinder((a - 10, b / 2, c / 2), c / 5, 40, (1, 0, lean)))
    return part.body
