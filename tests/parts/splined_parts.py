"""Walls along splines among cylinders, of random sizes."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge, BRepBuilderAPI_MakeFace, BRepBuilderAPI_MakeWire
from OCP.BRepPrimAPI import BRepPrimAPI_MakePrism
from OCP.collections import HArray1_gp_Pnt
from OCP.GeomAPI import GeomAPI_Interpolate
from OCP.gp import gp_Pnt, gp_Vec

from tests.parts.solids import Part, Rng, cylinder, fillet, turned

Floats = npt.NDArray[np.float64]


def generate(seed: int) -> Any:
    """The body of a seed."""
    rng = np.random.default_rng(seed)
    return turned(Part(crown(rng)), rng).body


def spline(points: Floats, closed: bool = False) -> Any:
    """The edge of the spline through points (n, 3)."""
    array = HArray1_gp_Pnt(1, len(points))
    for i, p in enumerate(points.tolist()):
        array.SetValue(i + 1, gp_Pnt(*p))
    maker = GeomAPI_Interpolate(array, closed, 1e-9)
    maker.Perform()
    return BRepBuilderAPI_MakeEdge(maker.Curve()).Edge()


def wire(*some: Any) -> Any:
    maker = BRepBuilderAPI_MakeWire()
    for edge in some:
        maker.Add(edge)
    return maker.Wire()


def line(a: Floats, b: Floats) -> Any:
    return BRepBuilderAPI_MakeEdge(gp_Pnt(*a.tolist()), gp_Pnt(*b.tolist())).Edge()


def ring(rng: Rng, radius: float, z: float, waves: float, count: int = 9) -> Floats:
    """Points of a wavy ring about z."""
    t = np.linspace(0, 2 * np.pi, count, endpoint=False)
    r = radius * (1 + waves * rng.uniform(-1, 1, count))
    return np.stack([r * np.cos(t), r * np.sin(t), np.full(count, z)], axis=1)


def _holes(part: Part, rng: Rng, places: list[tuple[float, float]], low: float, high: float) -> None:
    for x, y in places:
        part.cut(cylinder((x, y, low), float(rng.uniform(2, 5)), high - low))


def crown(rng: Rng) -> Any:
    """A plate along a spline, as a bulkhead's crown, with holes, some at its edge, and a rounded rim."""
    x = np.linspace(0, float(rng.uniform(150, 500)), int(rng.integers(4, 8)))
    y = 60 + 0.15 * x[-1] * np.sin(np.pi * x / x[-1]) + rng.uniform(-8, 8, len(x))
    top = np.stack([x, y, 0 * x], axis=1)
    foot = np.array([[x[-1], 0.0, 0.0], [0.0, 0.0, 0.0]])
    outline = wire(spline(top), line(top[-1], foot[0]), line(foot[0], foot[1]), line(foot[1], top[0]))
    t = float(rng.uniform(8, 30))
    part = Part(BRepPrimAPI_MakePrism(BRepBuilderAPI_MakeFace(outline).Face(), gp_Vec(0, 0, t)).Shape())
    part.body = fillet(
        part.body, float(rng.uniform(5, 15)), lambda a, b: bool(max(a[1], b[1]) < 1e-6 < abs(a[2] - b[2]))
    )
    _holes(part, rng, [(f * x[-1], 25.0) for f in (0.2, 0.5, 0.8)], -1, t + 1)
    k = len(x) // 2
    part.cut(cylinder((float(x[k]), float(y[k]), -1), float(rng.uniform(4, 9)), t + 2))
    return part.body
