"""Parts of free-form faces among cylinders, that the CAD kernel composes at random: lofts, sweeps, walls along splines,
revolved splines and blends of a radius that changes.  Every other part is turned and moved."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

import numpy as np
import numpy.typing as npt
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge, BRepBuilderAPI_MakeFace, BRepBuilderAPI_MakeWire
from OCP.BRepFilletAPI import BRepFilletAPI_MakeFillet
from OCP.BRepOffsetAPI import BRepOffsetAPI_MakePipe, BRepOffsetAPI_ThruSections
from OCP.BRepPrimAPI import BRepPrimAPI_MakePrism, BRepPrimAPI_MakeRevol
from OCP.collections import HArray1_gp_Pnt
from OCP.GeomAPI import GeomAPI_Interpolate
from OCP.gp import gp_Ax1, gp_Ax2, gp_Circ, gp_Dir, gp_Elips, gp_Pnt, gp_Vec

from tests.parts.solids import Part, Rng, at_height, box, cylinder, edges, fillet, turned

Floats = npt.NDArray[np.float64]


def generate(seed: int) -> Any:
    """The body of a seed."""
    rng = np.random.default_rng(seed)
    maker = (crown, cam, loft, tube, vase, blended)[seed % 6]
    part = Part(maker(rng))
    return (turned(part, rng) if seed // 6 % 2 else part).body


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


def cam(rng: Rng) -> Any:
    """A disc with a wavy rim, a bore and a boss; half of them rounded along the rim."""
    r, t = float(rng.uniform(25, 60)), float(rng.uniform(8, 20))
    rim = wire(spline(ring(rng, r, 0.0, float(rng.uniform(0.01, 0.12))), closed=True))
    part = Part(BRepPrimAPI_MakePrism(BRepBuilderAPI_MakeFace(rim).Face(), gp_Vec(0, 0, t)).Shape())
    part.fuse(cylinder((0, 0, 0), r / 3, t + 10))
    _holes(part, rng, [(0.0, 0.0), (r * 0.6, 0.0)], -1, t + 12)
    if rng.random() < 0.5:
        with suppress(Exception):
            part.body = fillet(
                part.body, float(rng.uniform(1, 2)), lambda a, b: bool(a[2] == b[2] == 0 and np.hypot(*a[:2]) > r / 2)
            )
    return part.body


def loft(rng: Rng) -> Any:
    """A body through wavy rings, bored."""
    maker = BRepOffsetAPI_ThruSections(True, False)
    r, z = float(rng.uniform(15, 30)), 0.0
    for _ in range(int(rng.integers(3, 5))):
        maker.AddWire(wire(spline(ring(rng, r, z, 0.06, 8), closed=True)))
        z += float(rng.uniform(15, 30))
        r *= float(rng.uniform(0.8, 1.25))
    maker.Build()
    part = Part(maker.Shape())
    part.cut(cylinder((0, 0, -1), float(rng.uniform(3, 8)), z + 2))
    part.cut(cylinder((-100, 0, z / 4), float(rng.uniform(2, 4)), 200, (1, 0, 0)))
    return part.body


def tube(rng: Rng) -> Any:
    """A round or oval bar along a spline, between two round flanges."""
    n = int(rng.integers(4, 6))
    path = np.stack([np.linspace(0, 120, n), rng.uniform(-25, 25, n), rng.uniform(-15, 15, n)], axis=1)
    path[1, 1:] = path[0, 1:]
    r = float(rng.uniform(4, 10))
    place = gp_Ax2(gp_Pnt(*path[0].tolist()), gp_Dir(*(path[1] - path[0]).tolist()))
    round_ = rng.random() < 0.6
    section = gp_Circ(place, r) if round_ else gp_Elips(place, r, r * float(rng.uniform(0.5, 0.8)))
    face = BRepBuilderAPI_MakeFace(wire(BRepBuilderAPI_MakeEdge(section).Edge())).Face()
    part = Part(BRepOffsetAPI_MakePipe(wire(spline(path)), face).Shape())
    x, y, z = path[0].tolist()
    flange = Part(cylinder((x - 8, y, z), 2 * r, 10, (1, 0, 0)))
    _across = [(y + 1.5 * r, z), (y - 1.5 * r, z)]
    for b, c in _across:
        flange.cut(cylinder((x - 9, b, c), r / 4, 12, (1, 0, 0)))
    part.fuse(flange.body)
    return part.body


def vase(rng: Rng) -> Any:
    """A spline revolved about z, whole or half, with a straight neck and a bore."""
    z = np.linspace(0, 60, 6)
    r = float(rng.uniform(15, 25)) * (1 + rng.uniform(-0.25, 0.25, 6))
    profile = np.stack([r, 0 * z, z], axis=1)
    axis = np.array([[0, 0, 0.0], [0, 0, 60.0]])
    outline = wire(spline(profile), line(profile[-1], axis[1]), line(axis[1], axis[0]), line(axis[0], profile[0]))
    angle = 2 * np.pi if rng.random() < 0.5 else float(rng.uniform(1, 4))
    face = BRepBuilderAPI_MakeFace(outline).Face()
    part = Part(BRepPrimAPI_MakeRevol(face, gp_Ax1(gp_Pnt(0, 0, 0), gp_Dir(0, 0, 1)), angle).Shape())
    part.fuse(cylinder((0, 0, 55), float(r[-1]) * 0.7, 20))
    part.cut(cylinder((0, 0, -1), 5.0, 90))
    return part.body


def blended(rng: Rng) -> Any:
    """A block with blends of a radius that changes along them, and a pin on a wavy top."""
    a, b, c = (float(rng.uniform(40, 70)) for _ in range(3))
    part = Part(box((0, 0, 0), (a, b, c)))
    r0, r1 = float(rng.uniform(2, 5)), float(rng.uniform(6, 12))
    maker = BRepFilletAPI_MakeFillet(part.body)
    for edge in edges(part.body, lambda p, q: bool(abs(p[2] - q[2]) > 1 and p[0] < 1)):
        maker.Add(r0, r1, edge)
    for edge in edges(part.body, lambda p, q: bool(p[2] == q[2] == 0 and abs(p[1] - q[1]) > 1 and p[0] > 1)):
        maker.Add(r1 / 2, r1, edge)
    part.body = maker.Shape()
    part.fuse(cylinder((a / 2, b / 2, c - 5), float(rng.uniform(8, 14)), 25))
    maker = BRepFilletAPI_MakeFillet(part.body)
    with suppress(Exception):
        for edge in edges(part.body, at_height(c + 20)):
            maker.Add(float(rng.uniform(1, 3)), edge)
        part.body = maker.Shape()
    return part.body
