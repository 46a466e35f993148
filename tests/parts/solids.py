"""Solids that the CAD kernel makes, and a part under construction."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from OCP.BRep import BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Curve
from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut, BRepAlgoAPI_Fuse
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace, BRepBuilderAPI_MakePolygon, BRepBuilderAPI_Transform
from OCP.BRepFilletAPI import BRepFilletAPI_MakeChamfer, BRepFilletAPI_MakeFillet
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeCone, BRepPrimAPI_MakeCylinder, BRepPrimAPI_MakePrism
from OCP.collections import IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher as ShapeMap
from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt, gp_Trsf, gp_Vec
from OCP.ShapeUpgrade import ShapeUpgrade_UnifySameDomain
from OCP.TopAbs import TopAbs_EDGE
from OCP.TopExp import TopExp
from OCP.TopoDS import TopoDS

Floats = npt.NDArray[np.float64]
Point = tuple[float, float, float]


@dataclass
class Part:
    body: Any

    def cut(self, *tools: Any) -> None:
        for tool in tools:
            self.body = BRepAlgoAPI_Cut(self.body, tool).Shape()

    def fuse(self, *more: Any) -> None:
        for one in more:
            self.body = BRepAlgoAPI_Fuse(self.body, one).Shape()
        unify = ShapeUpgrade_UnifySameDomain(self.body, True, True, False)
        unify.Build()
        self.body = unify.Shape()


def box(low: Point, high: Point) -> Any:
    return BRepPrimAPI_MakeBox(gp_Pnt(*low), gp_Pnt(*high)).Shape()


def cylinder(foot: Point, radius: float, height: float, axis: Point = (0, 0, 1)) -> Any:
    return BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(*foot), gp_Dir(*axis)), radius, height).Shape()


def cone(foot: Point, low: float, high: float, height: float) -> Any:
    return BRepPrimAPI_MakeCone(gp_Ax2(gp_Pnt(*foot), gp_Dir(0, 0, 1)), low, high, height).Shape()


def prism(points: list[Point], sweep: Point) -> Any:
    polygon = BRepBuilderAPI_MakePolygon()
    for point in points:
        polygon.Add(gp_Pnt(*point))
    polygon.Close()
    return BRepPrimAPI_MakePrism(BRepBuilderAPI_MakeFace(polygon.Wire()).Face(), gp_Vec(*sweep)).Shape()


def edges(shape: Any, wanted: Callable[[Floats, Floats], bool]) -> list[Any]:
    """Edges by their ends (of a closed edge: a point of it and the one opposite)."""
    found, out = ShapeMap(), []
    TopExp.MapShapes_s(shape, TopAbs_EDGE, found)
    for i in range(1, found.Extent() + 1):
        edge = TopoDS.Edge(found.FindKey(i))
        if BRep_Tool.Degenerated_s(edge):
            continue
        curve = BRepAdaptor_Curve(edge)
        t = [curve.FirstParameter(), curve.LastParameter()]
        ends = [np.array([p.X(), p.Y(), p.Z()]) for p in map(curve.Value, t)]
        if np.linalg.norm(ends[1] - ends[0]) < 1e-9:
            p = curve.Value((t[0] + t[1]) / 2)
            ends[1] = np.array([p.X(), p.Y(), p.Z()])
        if wanted(*ends):
            out.append(edge)
    return out


def fillet(shape: Any, radius: float, wanted: Callable[[Floats, Floats], bool]) -> Any:
    maker = BRepFilletAPI_MakeFillet(shape)
    for edge in edges(shape, wanted):
        maker.Add(radius, edge)
    return maker.Shape()


def chamfer(shape: Any, setback: float, wanted: Callable[[Floats, Floats], bool]) -> Any:
    maker = BRepFilletAPI_MakeChamfer(shape)
    for edge in edges(shape, wanted):
        maker.Add(setback, edge)
    return maker.Shape()


def upright(a: Floats, b: Floats) -> bool:
    return bool(abs(a[2] - b[2]) > 1e-6)


def at_height(z: float) -> Callable[[Floats, Floats], bool]:
    return lambda a, b: bool(abs(a[2] - z) < 1e-6 and abs(b[2] - z) < 1e-6)


def between(p: Point, q: Point) -> Callable[[Floats, Floats], bool]:
    """The edge from one point to the other."""
    ends = np.array([p, q])
    return lambda a, b: bool(min(np.abs(ends - [a, b]).max(), np.abs(ends - [b, a]).max()) < 1e-6)


def round_box(low: Point, high: Point, corner: float = 0.0, floor: float = 0.0) -> Any:
    solid = box(low, high)
    if corner:
        solid = fillet(solid, corner, upright)
    return fillet(solid, floor, at_height(low[2])) if floor else solid


def obround(low: Point, length: float, width: float, height: float) -> Any:
    """A prism along x, z from low[2]; low is the middle of its foot."""
    x, y, z = low
    reach = (length - width) / 2
    part = Part(box((x - reach, y - width / 2, z), (x + reach, y + width / 2, z + height)))
    part.fuse(*(cylinder((x + side * reach, y, z), width / 2, height) for side in (-1, 1)))
    return part.body


def carried(body: Any, move: Floats) -> Any:
    """The body in other coordinates, as a file without assemblies has it."""
    transform = gp_Trsf()
    transform.SetValues(*move[:3].ravel().tolist())
    return BRepBuilderAPI_Transform(body, transform, True).Shape()
