"""Parts that the CAD kernel composes from known operations with random dimensions, and the features they must show.

A part is a plate with a grid of cells, each with a feature or two on its top, and operations along its sides; or a
bracket, a channel, a lattice of ribs, a lever with lugs, a flanged hub; or a block whose operations cut one another.
Every other part is turned and moved.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import numpy.typing as npt
from OCP.BRep import BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Curve
from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut, BRepAlgoAPI_Fuse
from OCP.BRepBuilderAPI import (
    BRepBuilderAPI_MakeEdge,
    BRepBuilderAPI_MakeFace,
    BRepBuilderAPI_MakePolygon,
    BRepBuilderAPI_MakeWire,
    BRepBuilderAPI_Transform,
)
from OCP.BRepFilletAPI import BRepFilletAPI_MakeChamfer, BRepFilletAPI_MakeFillet
from OCP.BRepPrimAPI import (
    BRepPrimAPI_MakeBox,
    BRepPrimAPI_MakeCone,
    BRepPrimAPI_MakeCylinder,
    BRepPrimAPI_MakePrism,
)
from OCP.collections import IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher as ShapeMap
from OCP.gp import gp_Ax1, gp_Ax2, gp_Dir, gp_Elips, gp_Pnt, gp_Trsf, gp_Vec
from OCP.ShapeUpgrade import ShapeUpgrade_UnifySameDomain
from OCP.TopAbs import TopAbs_EDGE
from OCP.TopExp import TopExp
from OCP.TopoDS import TopoDS

Floats = npt.NDArray[np.float64]
Point = tuple[float, float, float]
Rng = np.random.Generator

CELL = 60.0
BORDER = 40.0
BORE = 200.0  # longer than any part is thick
THIN_WEB = 0.2  # a web is what is left under a floor, where it is no thicker than this share of the floor's width


@dataclass(frozen=True)
class Known:
    """A feature that an operation makes: `at` are the points that may be its origin (a through hole has two mouths)."""

    kind: str
    at: tuple[Point, ...]
    dimensions: dict[str, float]


@dataclass
class Part:
    body: Any
    features: list[Known] = field(default_factory=list)

    def cut(self, *tools: Any) -> None:
        for tool in tools:
            self.body = BRepAlgoAPI_Cut(self.body, tool).Shape()

    def fuse(self, *more: Any) -> None:
        for one in more:
            self.body = BRepAlgoAPI_Fuse(self.body, one).Shape()
        unify = ShapeUpgrade_UnifySameDomain(self.body, True, True, False)
        unify.Build()
        self.body = unify.Shape()

    def know(self, kind: str, at: Point | tuple[Point, ...], **dimensions: float) -> None:
        points = at if isinstance(at[0], tuple) else (at,)
        self.features.append(Known(kind, points, dimensions))


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


def ellipse(foot: Point, major: float, minor: float, height: float) -> Any:
    curve = gp_Elips(gp_Ax2(gp_Pnt(*foot), gp_Dir(0, 0, 1)), major, minor)
    wire = BRepBuilderAPI_MakeWire(BRepBuilderAPI_MakeEdge(curve).Edge()).Wire()
    return BRepPrimAPI_MakePrism(BRepBuilderAPI_MakeFace(wire).Face(), gp_Vec(0, 0, height)).Shape()


def generate(seed: int) -> Part:
    """The part of a seed."""
    rng = np.random.default_rng(seed)
    families = (plate, plate, patterned, plate, bracket, lattice, lever, hub, crossed, finished, six_sided, plate)
    part = families[seed % len(families)](rng)
    return turned(part, rng) if seed % 2 else part


def turned(part: Part, rng: Rng) -> Part:
    spin, shift = gp_Trsf(), gp_Trsf()
    axis = rng.normal(size=3)
    spin.SetRotation(gp_Ax1(gp_Pnt(0, 0, 0), gp_Dir(*axis)), float(rng.uniform(0, 3)))
    shift.SetTranslation(gp_Vec(*rng.uniform(-200, 200, 3)))
    move = shift * spin

    def moved(p: Point) -> Point:
        q = gp_Pnt(*p).Transformed(move)
        return (q.X(), q.Y(), q.Z())

    body = BRepBuilderAPI_Transform(part.body, move, True).Shape()
    return Part(body, [replace(f, at=tuple(moved(p) for p in f.at)) for f in part.features])


def _sheet(part: Part, centre: Point, left: float, length: float, width: float) -> None:
    """The web under a floor, if what is left is thin; the centre is that of the floor."""
    if left <= THIN_WEB * min(length, width):
        x, y, z = centre
        part.know("web", (x, y, z - left / 2), thickness=left, length=length, width=width)


# What may stand in a cell of a plate whose top is at z = t. ----------------------------------------------------------


def through_hole(part: Part, rng: Rng, x: float, y: float, t: float) -> None:
    r = float(rng.uniform(2, 15))
    part.cut(cylinder((x, y, -1), r, BORE))
    part.know("through_hole", ((x, y, t), (x, y, 0.0)), diameter=2 * r, depth=t)


def blind_hole(part: Part, rng: Rng, x: float, y: float, t: float) -> None:
    r, depth = float(rng.uniform(2, 12)), float(rng.uniform(0.3, 0.6)) * t
    part.cut(cylinder((x, y, t - depth), r, BORE))
    tip = {}
    if rng.random() < 0.5 and r < 0.35 * t:
        part.cut(cone((x, y, t - depth - r / 2), 0, r, r / 2))
        tip = {"tip_angle": 2 * float(np.arctan(2))}
    part.know("blind_hole", (x, y, t), diameter=2 * r, depth=depth, **tip)


def counterbored(part: Part, rng: Rng, x: float, y: float, t: float) -> None:
    r = float(rng.uniform(2, 8))
    wide, deep = r + float(rng.uniform(2, 6)), float(rng.uniform(0.2, 0.5)) * t
    part.cut(cylinder((x, y, -1), r, BORE), cylinder((x, y, t - deep), wide, BORE))
    part.know("through_hole", (x, y, t), diameter=2 * r, depth=t, counterbore_diameter=2 * wide, counterbore_depth=deep)


def countersunk(part: Part, rng: Rng, x: float, y: float, t: float) -> None:
    r = float(rng.uniform(2, 8))
    deep = float(rng.uniform(0.2, 0.4)) * t
    half = float(np.radians(rng.choice([41, 45, 60])))
    wide = r + deep * float(np.tan(half))
    if wide > 20:
        wide, half = 20.0, float(np.arctan2(20 - r, deep))
    part.cut(cylinder((x, y, -1), r, BORE), cone((x, y, t - deep), r, wide, deep))
    part.know(
        "through_hole", (x, y, t), diameter=2 * r, depth=t, countersink_diameter=2 * wide, countersink_angle=2 * half
    )


def pocket(part: Part, rng: Rng, x: float, y: float, t: float) -> None:
    length, width = float(rng.uniform(24, 38)), float(rng.uniform(14, 22))
    depth = float(rng.uniform(0.2, 0.85)) * t
    more = {}
    corner = float(rng.choice([0.0, rng.uniform(2, 6)]))
    floor = (
        float(rng.uniform(1, 0.9 * min(corner, depth))) if corner > 1.2 and depth > 2 and rng.random() < 0.5 else 0.0
    )
    low, high = (x - length / 2, y - width / 2, t - depth), (x + length / 2, y + width / 2, t + BORE)
    part.cut(round_box(low, high, corner, floor))
    more = {"corner_radius": corner} if corner else {}
    more |= {"fillet_radius": floor} if floor else {}
    part.know("pocket", (x, y, t - depth), length=length, width=width, depth=depth, **more)
    _sheet(part, (x, y, t - depth), t - depth, length, width)
    if rng.random() < 0.4:  # a hole through the floor
        r = float(rng.uniform(1.5, 4))
        part.cut(cylinder((x, y, -1), r, BORE))
        part.know("through_hole", ((x, y, t - depth), (x, y, 0.0)), diameter=2 * r, depth=t - depth)
    elif rng.random() < 0.5:  # a boss on it
        r, height = float(rng.uniform(2, 4)), float(rng.uniform(0.4, 0.9)) * depth
        part.fuse(cylinder((x, y, t - depth), r, height))
        part.know("boss", (x, y, t - depth), diameter=2 * r, height=height)


def closed_slot(part: Part, rng: Rng, x: float, y: float, t: float) -> None:
    length, width = float(rng.uniform(24, 38)), float(rng.uniform(6, 14))
    if rng.random() < 0.5:
        part.cut(obround((x, y, -1), length, width, BORE))
        part.know("slot", ((x, y, t), (x, y, 0.0)), length=length, width=width, depth=t)
        return
    depth = float(rng.uniform(0.3, 0.8)) * t
    part.cut(obround((x, y, t - depth), length, width, BORE))
    part.know("slot", (x, y, t - depth), length=length, width=width, depth=depth)
    _sheet(part, (x, y, t - depth), t - depth, length, width)


def duct(part: Part, rng: Rng, x: float, y: float, t: float) -> None:
    a, c = float(rng.uniform(12, 18)), float(rng.uniform(6, 10))
    ends = ((x, y, t), (x, y, 0.0))
    kind = int(rng.integers(3))
    if kind == 0:
        part.cut(ellipse((x, y, -1), a, c, BORE))
        part.know("duct", ends, major_diameter=2 * a, minor_diameter=2 * c, depth=t)
        return
    corner = float(rng.uniform(1, 5)) if kind == 1 else 0.0
    part.cut(round_box((x - a, y - c, -1), (x + a, y + c, BORE), corner))
    more = {"corner_radius": corner} if corner else {}
    part.know("duct", ends, length=2 * a, width=2 * c, depth=t, **more)


def boss(part: Part, rng: Rng, x: float, y: float, t: float) -> None:
    height = float(rng.uniform(6, 16))
    if rng.random() < 0.35:
        a, c = float(rng.uniform(8, 15)), float(rng.uniform(7, 8))
        corner = float(rng.choice([0.0, 2.0]))
        part.fuse(round_box((x - a, y - c, t), (x + a, y + c, t + height), corner))
        part.know("boss", (x, y, t), length=2 * a, width=2 * c, height=height)
        return
    r = float(rng.uniform(8, 14))
    part.fuse(cylinder((x, y, t), r, height))
    more = {}
    rim = lambda a, b: bool(abs(a[2] - t - height) < 1e-6 and np.hypot(a[0] - x, a[1] - y) < r + 1e-6)  # noqa: E731
    foot = lambda a, b: bool(abs(a[2] - t) < 1e-6 and abs(np.hypot(a[0] - x, a[1] - y) - r) < 1e-6)  # noqa: E731
    finish = int(rng.integers(4))
    if finish == 1:
        c = float(rng.uniform(0.5, 2))
        part.body = chamfer(part.body, c, rim)
        part.know("chamfer", (x, y, t + height - c / 2), width=c * 2**0.5, diameter=2 * r, angle=np.pi / 4)
    elif finish == 2:
        c = float(rng.uniform(0.5, 2))
        part.body = fillet(part.body, c, rim)
        part.know("fillet", (x, y, t + height - c), radius=c, length=2 * np.pi * (r - c))
    elif finish == 3:
        c = float(rng.uniform(0.5, 3))
        part.body = fillet(part.body, c, foot)
        more = {"fillet_radius": c}
    part.know("boss", (x, y, t), diameter=2 * r, height=height, **more)
    if rng.random() < 0.5:
        bore = r * float(rng.uniform(0.2, 0.5))
        part.cut(cylinder((x, y, -1), bore, BORE))
        part.know("through_hole", ((x, y, t + height), (x, y, 0.0)), diameter=2 * bore, depth=t + height)


CELLS = (through_hole, blind_hole, counterbored, countersunk, pocket, closed_slot, duct, boss)


def plate(rng: Rng) -> Part:
    """Three by two cells, and operations along the sides."""
    t = float(rng.uniform(12, 25))
    long, wide = 3 * CELL + 2 * BORDER, 2 * CELL + 2 * BORDER
    part = Part(box((0, 0, 0), (long, wide, t)))
    for i in range(3):
        for j in range(2):
            CELLS[rng.integers(len(CELLS))](part, rng, BORDER + (i + 0.5) * CELL, BORDER + (j + 0.5) * CELL, t)
    # The sides at low and high x: along their whole top edge.
    for side in (0, 1):
        x = long if side else 0.0
        inward = -1.0 if side else 1.0
        edge = between((x, 0, t), (x, wide, t))
        operation = int(rng.integers(6))
        if operation == 0:
            width = float(rng.uniform(8, 20))
            depth = float(rng.uniform(0.3, 0.9)) * min(width, 0.8 * t)
            part.cut(box(*_sorted((x - inward, -1, t - depth), (x + inward * width, wide + 1, t + 1))))
            part.know("step", (x + inward * width / 2, wide / 2, t - depth), length=wide, width=width, depth=depth)
        elif operation == 1:
            c = float(rng.uniform(0.5, 4))
            part.body = chamfer(part.body, c, edge)
            middle = (x + inward * c / 2, wide / 2, t - c / 2)
            part.know("chamfer", middle, width=c * 2**0.5, length=wide, angle=np.pi / 4)
        elif operation == 2:
            c = float(rng.uniform(0.5, 6))
            part.body = fillet(part.body, c, edge)
            part.know("fillet", (x + inward * c, wide / 2, t - c), radius=c, length=wide)
        elif operation == 3:
            width, depth = float(rng.uniform(5, 12)), float(rng.uniform(0.3, 0.6)) * t
            place = x + inward * 25
            part.cut(box((place - width / 2, -1, t - depth), (place + width / 2, wide + 1, t + 1)))
            part.know("open_slot", (place, wide / 2, t - depth), length=wide, width=width, depth=depth)
            _sheet(part, (place, wide / 2, t - depth), t - depth, wide, width)
        elif operation == 4:  # a step in the corner
            length, width = float(rng.uniform(22, 35)), float(rng.uniform(14, 20))
            depth = float(rng.uniform(0.2, 0.7)) * min(width, t)
            part.cut(box(*_sorted((x - inward, -1, t - depth), (x + inward * length, width, t + 1))))
            part.know("step", (x + inward * length / 2, width / 2, t - depth), length=length, width=width, depth=depth)
    # The sides at low and high y: notches.
    for side in (0, 1):
        y = wide if side else 0.0
        inward = -1.0 if side else 1.0
        place = BORDER + float(rng.uniform(20, 160))
        width, reach = float(rng.uniform(6, 14)), float(rng.uniform(16, 28))
        operation = int(rng.integers(4))
        if operation == 0:
            part.cut(box(*_sorted((place - width / 2, y - inward, -1), (place + width / 2, y + inward * reach, BORE))))
            part.know("open_slot", (place, y + inward * reach, t / 2), length=t, width=width, depth=reach)
        elif operation == 1:
            depth = float(rng.uniform(0.3, 0.6)) * t
            low = (place - width / 2, y - inward, t - depth)
            part.cut(box(*_sorted(low, (place + width / 2, y + inward * reach, t + 1))))
            middle = (place, y + inward * reach / 2, t - depth)
            part.know("open_slot", middle, length=reach, width=width, depth=depth)
            _sheet(part, middle, t - depth, reach, width)
    return part


def _sorted(p: Point, q: Point) -> tuple[Point, Point]:
    low, high = np.minimum(p, q).tolist(), np.maximum(p, q).tolist()
    return tuple(low), tuple(high)


def patterned(rng: Rng) -> Part:
    """A plate with a bolt circle, a row of holes and holes that make no pattern."""
    t = float(rng.uniform(8, 20))
    part = Part(box((0, 0, 0), (320, 160, t)))
    count, ring, r = int(rng.integers(3, 13)), float(rng.uniform(35, 60)), float(rng.uniform(2, 4))
    start = float(rng.uniform(0, 1))
    centre = (80.0, 80.0)
    for k in range(count):
        a = start + 2 * np.pi * k / count
        _drill(part, centre[0] + ring * np.cos(a), centre[1] + ring * np.sin(a), r, t)
    ends = ((*centre, t), (*centre, 0.0))
    part.know("circular_pattern", ends, count=count, pattern_diameter=2 * ring, hole_diameter=2 * r)
    if rng.random() < 0.7:
        bore = float(rng.uniform(8, 20))
        _drill(part, *centre, bore, t)
    count, r = int(rng.integers(3, 8)), float(rng.choice([r, rng.uniform(2, 4)]))
    pitch, lean = float(rng.uniform(12, 18)), float(rng.uniform(-0.6, 0.6))
    x, y = 180.0, 80 - pitch * (count - 1) / 2 * np.sin(lean)
    for k in range(count):
        _drill(part, x + k * pitch * np.cos(lean), y + k * pitch * np.sin(lean), r, t)
    middle = (x + pitch * (count - 1) / 2 * float(np.cos(lean)), 80.0)
    ends = ((*middle, t), (*middle, 0.0))
    part.know("linear_pattern", ends, count=count, pitch=pitch, hole_diameter=2 * r)
    for x, y in ((305.0, 10.0), (300.0, 150.0)):
        _drill(part, x, y, 5.0, t)
    return part


def _drill(part: Part, x: float, y: float, r: float, t: float, z: float = 0.0) -> None:
    x, y = float(x), float(y)
    part.cut(cylinder((x, y, z - 1), r, t + 2))
    part.know("through_hole", ((x, y, z + t), (x, y, z)), diameter=2 * r, depth=t)


def bracket(rng: Rng) -> Part:
    """A base with an upright flange at one end and ribs across it, holes in the base."""
    t, wide = float(rng.uniform(8, 14)), float(rng.uniform(60, 90))
    thick, tall = float(rng.uniform(3, 7)), float(rng.uniform(25, 45))
    long = 200.0
    part = Part(box((0, 0, 0), (long, wide, t)))
    part.fuse(box((0, 0, t), (thick, wide, t + tall)))
    part.know("flange", (thick / 2, wide / 2, t), thickness=thick, length=wide, height=tall)
    places = [70.0, 130.0] if rng.random() < 0.5 else [110.0]
    for place in places:
        rib, high = float(rng.uniform(2, 5)), float(rng.uniform(12, 24))
        across = rng.random() < 0.5
        y0, y1 = (0.0, wide) if across else (12.0, wide - 12)
        part.fuse(box((place - rib / 2, y0, t), (place + rib / 2, y1, t + high)))
        part.know("rib", (place, wide / 2, t), thickness=rib, length=y1 - y0, height=high)
        if across:
            part.features += _channel(part, place, rib, wide, t)
    _drill(part, 40.0, wide / 2, float(rng.uniform(3, 7)), t)
    _drill(part, 180.0, wide / 2, float(rng.uniform(3, 7)), t)
    if rng.random() < 0.5:
        c = float(rng.uniform(2, 8))
        part.body = fillet(part.body, c, between((long, 0, 0), (long, 0, t)))
        part.know("fillet", (long - c, c, t / 2), radius=c, length=t)
    return part


def _channel(part: Part, place: float, rib: float, wide: float, t: float) -> list[Known]:
    """Walls across the whole base leave an open slot between each other."""
    walls = sorted(
        (f.at[0][0] - f.dimensions["thickness"] / 2, f.at[0][0] + f.dimensions["thickness"] / 2, f.dimensions["height"])
        for f in part.features
        if f.kind == "flange" or (f.kind == "rib" and abs(f.dimensions["length"] - wide) < 1e-9)
    )
    left = [w for w in walls if w[1] < place - rib]
    if not left:
        return []
    one, two = left[-1], next(w for w in walls if w[0] <= place <= w[1])
    gap = two[0] - one[1]
    middle = ((one[1] + two[0]) / 2, wide / 2, t)
    known = [Known("open_slot", (middle,), _slot_size(wide, gap, max(one[2], two[2])))]
    if t <= THIN_WEB * min(wide, gap):
        sheet = {"thickness": t, "length": wide, "width": gap}
        known.append(Known("web", ((middle[0], middle[1], t / 2),), sheet))
    return known


def _slot_size(length: float, width: float, depth: float) -> dict[str, float]:
    return {"length": length, "width": width, "depth": depth}


def lattice(rng: Rng) -> Part:
    """Pockets in rows on one or both sides of a web, thin ribs between them and thicker walls around."""
    t, web = 40.0, float(rng.uniform(3, 5))
    columns, rows = int(rng.integers(2, 4)), 2
    rib, rim, corner = float(rng.uniform(3, 7)), 26.0, float(rng.uniform(4, 9))
    a, c = float(rng.uniform(50, 70)), float(rng.uniform(40, 49))
    both = rng.random() < 0.5
    floor = 20.0 if both else t - 30
    web = web if both else floor
    long, wide = 2 * rim + columns * a + (columns - 1) * rib, 2 * rim + rows * c + (rows - 1) * rib
    part = Part(box((0, 0, 0), (long, wide, t)))
    for i in range(columns):
        for j in range(rows):
            x, y = rim + i * (a + rib), rim + j * (c + rib)
            part.cut(round_box((x, y, floor), (x + a, y + c, t + 1), corner))
            middle = (x + a / 2, y + c / 2)
            part.know("pocket", (*middle, floor), length=a, width=c, depth=t - floor, corner_radius=corner)
            if both:
                part.cut(round_box((x, y, -1), (x + a, y + c, floor - web), corner))
                deep = floor - web
                part.know("pocket", (*middle, deep), length=a, width=c, depth=deep, corner_radius=corner)
            if web <= THIN_WEB * c:
                part.know("web", (*middle, floor - web / 2), thickness=web, length=a, width=c)
    foot = 0.0 if both else floor
    for i in range(1, columns):
        x = rim + i * (a + rib) - rib / 2
        length = rows * c + (rows - 1) * rib - 2 * corner
        part.know("rib", ((x, wide / 2, foot), (x, wide / 2, t)), thickness=rib, length=length, height=t - foot)
    length = columns * a + (columns - 1) * rib - 2 * corner
    y = wide / 2
    part.know("rib", ((long / 2, y, foot), (long / 2, y, t)), thickness=rib, length=length, height=t - foot)
    return part


def lever(rng: Rng) -> Part:
    """A block with a lug at one or two ends, the bore through it."""
    t = float(rng.uniform(20, 30))
    part = Part(box((0, 0, 0), (100, 80, t)))
    for side in (0, 1) if rng.random() < 0.6 else (1,):
        thick, r = float(rng.uniform(8, 15)), float(rng.uniform(12, 25))
        low, reach = (t - thick) / 2, r + float(rng.uniform(5, 20))
        x, y = (100 + reach if side else -reach), 40.0
        bore = r * float(rng.uniform(0.3, 0.6))
        root = 100.0 if side else 0.0
        arm = Part(box(*_sorted((root - (5 if side else -5), y - r, low), (x, y + r, low + thick))))
        arm.fuse(cylinder((x, y, low), r, thick))
        part.fuse(arm.body)
        _drill(part, x, y, bore, thick, low)
        ends = ((x, y, low + thick), (x, y, low))
        part.know("lug", ends, bore_diameter=2 * bore, width=2 * r, thickness=thick)
    CELLS[rng.integers(4)](part, rng, 50.0, 40.0, t)
    return part


def hub(rng: Rng) -> Part:
    """A disc around a shaft, bored, with a bolt circle."""
    r, thick = float(rng.uniform(40, 60)), float(rng.uniform(6, 14))
    shaft, tall = r * float(rng.uniform(0.3, 0.45)), float(rng.uniform(20, 50))
    part = Part(cylinder((0, 0, 0), r, thick))
    part.fuse(cylinder((0, 0, thick), shaft, tall))
    part.know("flange", ((0, 0, 0.0), (0, 0, thick)), diameter=2 * r, thickness=thick)
    part.know("boss", (0, 0, thick), diameter=2 * shaft, height=tall)
    if rng.random() < 0.7:
        _drill(part, 0, 0, shaft * float(rng.uniform(0.3, 0.7)), thick + tall)
    count, bolt = int(rng.integers(3, 9)), float(rng.uniform(2, 4))
    ring = (r + shaft) / 2
    for k in range(count):
        a = 2 * np.pi * k / count
        _drill(part, ring * np.cos(a), ring * np.sin(a), bolt, thick)
    ends = ((0.0, 0.0, thick), (0.0, 0.0, 0.0))
    part.know("circular_pattern", ends, count=count, pattern_diameter=2 * ring, hole_diameter=2 * bolt)
    if rng.random() < 0.5:
        c = float(rng.uniform(0.5, 2))
        part.body = chamfer(part.body, c, _rim(shaft, thick + tall))
        part.know("chamfer", (0, 0, thick + tall - c / 2), width=c * 2**0.5, diameter=2 * shaft, angle=np.pi / 4)
    return part


def _rim(radius: float, z: float) -> Callable[[Floats, Floats], bool]:
    return lambda a, b: bool(abs(a[2] - z) < 1e-6 and abs(np.hypot(a[0], a[1]) - radius) < 1e-6)


def crossed(rng: Rng) -> Part:
    """A block whose features cut one another."""
    t = float(rng.uniform(30, 40))
    part = Part(box((0, 0, 0), (300, 160, t)))
    # Two slots across each other, of one depth or of two.
    w1, w2 = float(rng.uniform(8, 14)), float(rng.uniform(8, 14))
    d1 = float(rng.uniform(8, 18))
    d2 = d1 if rng.random() < 0.5 else float(rng.uniform(8, 18))
    part.cut(box((60 - w1 / 2, -1, t - d1), (60 + w1 / 2, 161, t + 1)))
    part.cut(box((-1, 80 - w2 / 2, t - d2), (130, 80 + w2 / 2, t + 1)))
    part.know("open_slot", (60, 80, t - d1), length=160, width=w1, depth=d1)
    part.know("open_slot", (65, 80, t - d2), length=130, width=w2, depth=d2)
    # A pocket that cuts the corner of another, deeper one.
    shallow, deep = float(rng.uniform(4, 9)), float(rng.uniform(12, 25))
    part.cut(box((160, 30, t - shallow), (210, 70, t + 1)))
    part.cut(box((190, 50, t - deep), (240, 100, t + 1)))
    part.know("pocket", (185, 50, t - shallow), length=50, width=40, depth=shallow)
    part.know("pocket", (215, 75, t - deep), length=50, width=50, depth=deep)
    # A step cut by a hole, and a hole drilled across another.
    width = float(rng.uniform(22, 30))
    depth = float(rng.uniform(8, 14))
    part.cut(box((300 - width, -1, t - depth), (301, 161, t + 1)))
    part.know("step", (300 - width / 2, 80, t - depth), length=160, width=width, depth=depth)
    _drill(part, 300 - width / 2, 120, float(rng.uniform(3, 7)), t - depth)
    part.cut(cylinder((-1, 135, 8), 4.0, 302, (1, 0, 0)))
    part.know("through_hole", ((0, 135, 8), (300, 135, 8)), diameter=8.0, depth=300.0)
    _drill(part, 180.0, 135.0, float(rng.uniform(6, 9)), t)
    return part


def finished(rng: Rng) -> Part:
    """Rims rounded or chamfered, corners filleted: of pockets, slots, steps, ribs and holes."""
    t = float(rng.uniform(24, 34))
    part = Part(box((0, 0, 0), (300, 160, t)))
    # A pocket with a finished rim.
    length, width, corner = float(rng.uniform(40, 55)), float(rng.uniform(30, 36)), float(rng.uniform(5, 9))
    depth, c = float(rng.uniform(8, 16)), float(rng.uniform(0.5, 2))
    part.cut(round_box((60 - length / 2, 40 - width / 2, t - depth), (60 + length / 2, 40 + width / 2, t + 1), corner))
    part.know("pocket", (60, 40, t - depth), length=length, width=width, depth=depth, corner_radius=corner)
    inside = lambda a, b: bool(  # noqa: E731
        max(abs(a[2] - t), abs(b[2] - t)) < 1e-6
        and max(abs(a[0] - 60), abs(b[0] - 60)) < 30
        and max(abs(a[1] - 40), abs(b[1] - 40)) < 20
    )
    if rng.random() < 0.6:
        part.body = fillet(part.body, c, inside)
        around = 2 * (length + width - 4 * corner) + 2 * np.pi * (corner + c)
        at = ((60, 40 + s * (width / 2 + c), t - c) for s in (-1, 1))
        part.know("fillet", tuple(at), radius=c, length=around)
    # Holes with finished rims.
    r, c = float(rng.uniform(4, 7)), float(rng.uniform(0.5, 2))
    part.cut(cylinder((130, 40, -1), r, BORE))
    part.body = chamfer(part.body, c, _rim_at(130, 40, r, t))
    part.know(
        "through_hole",
        (130, 40, t),
        diameter=2 * r,
        depth=t,
        countersink_diameter=2 * (r + c),
        countersink_angle=np.pi / 2,
    )
    r, c = float(rng.uniform(4, 7)), float(rng.uniform(0.5, 2))
    part.cut(cylinder((170, 40, t - 15), r, BORE))
    part.body = fillet(part.body, c, _rim_at(170, 40, r, t))
    part.know("blind_hole", (170, 40, t), diameter=2 * r, depth=15.0)
    part.know("fillet", (170, 40, t - c), radius=c, length=2 * np.pi * (r + c))
    # A step with a fillet in its corner.
    width, depth, c = float(rng.uniform(20, 30)), float(rng.uniform(8, 14)), float(rng.uniform(1, 5))
    part.cut(box((300 - width, -1, t - depth), (301, 161, t + 1)))
    corner_edge = between((300 - width, 0, t - depth), (300 - width, 160, t - depth))
    part.body = fillet(part.body, c, corner_edge)
    middle = (300 - width / 2, 80, t - depth)
    part.know("step", middle, length=160, width=width, depth=depth, fillet_radius=c)
    # A slot across, with fillets along its floor.
    width, depth = float(rng.uniform(10, 16)), float(rng.uniform(8, 14))
    c = float(rng.uniform(1, 3))
    low, high = 230 - width / 2, 230 + width / 2
    part.cut(box((low, -1, t - depth), (high, 161, t + 1)))
    for x in (low, high):
        part.body = fillet(part.body, c, between((x, 0, t - depth), (x, 160, t - depth)))
    part.know("open_slot", (230, 80, t - depth), length=160, width=width, depth=depth, fillet_radius=c)
    # A rib with fillets at its foot.
    rib, high, c = float(rng.uniform(3, 6)), float(rng.uniform(16, 26)), float(rng.uniform(1, 3))
    y0, y1 = 120 - rib / 2, 120 + rib / 2
    part.fuse(box((30, y0, t), (150, y1, t + high)))
    for y in (y0, y1):
        part.body = fillet(part.body, c, between((30, y, t), (150, y, t)))
    part.know("rib", (90, 120, t), thickness=rib, length=120, height=high)
    for _ in (y0, y1):
        part.know("fillet", tuple((90, y + s * c, t + c) for y, s in ((y0, -1), (y1, 1))), radius=c, length=120)
    return part


def _rim_at(x: float, y: float, r: float, z: float) -> Callable[[Floats, Floats], bool]:
    return lambda a, b: bool(abs(a[2] - z) < 1e-6 and abs(np.hypot(a[0] - x, a[1] - y) - r) < 1e-6)


def six_sided(rng: Rng) -> Part:
    """A block with operations on its sides and below, a slanted hole, a pocket in a boss and a hole through a wall."""
    t = 60.0
    part = Part(box((0, 0, 0), (240, 120, t)))
    # From below, from the front, from the left.
    length, width, depth = float(rng.uniform(40, 60)), float(rng.uniform(25, 38)), float(rng.uniform(8, 20))
    corner = float(rng.uniform(3, 8))
    part.cut(round_box((60 - length / 2, 60 - width / 2, -1), (60 + length / 2, 60 + width / 2, depth), corner))
    part.know("pocket", (60, 60, depth), length=length, width=width, depth=depth, corner_radius=corner)
    r, deep = float(rng.uniform(3, 8)), float(rng.uniform(10, 25))
    part.cut(cylinder((40, -1, 38), r, deep + 1, (0, 1, 0)))
    part.know("blind_hole", (40, 0, 38), diameter=2 * r, depth=deep)
    long, wide, deep = float(rng.uniform(40, 60)), float(rng.uniform(8, 14)), float(rng.uniform(5, 12))
    part.cut(box((-1, 60 - long / 2, 40 - wide / 2), (deep, 60 + long / 2, 40 + wide / 2)))
    part.know("pocket", (deep, 60, 40), length=long, width=wide, depth=deep)
    # A hole that leans: its depth is that of its longest side.
    r, lean = float(rng.uniform(3, 6)), float(np.radians(rng.uniform(10, 30)))
    axis = (float(np.sin(lean)), 0.0, float(np.cos(lean)))
    part.cut(cylinder((110 - 100 * axis[0], 100.0, -100 * axis[2]), r, 400, axis))
    reach = t / axis[2] / 2 + r * float(np.tan(lean))
    mid = np.array([110 + t / 2 * np.tan(lean), 100.0, t / 2])
    ends = tuple(tuple((mid + s * reach * np.array(axis)).tolist()) for s in (-1, 1))
    part.know("through_hole", ends, diameter=2 * r, depth=2 * reach)
    # A boss with a pocket in its top.
    r, tall, deep = float(rng.uniform(18, 25)), float(rng.uniform(8, 15)), float(rng.uniform(4, 7))
    part.fuse(cylinder((190, 40, t), r, tall))
    part.cut(box((180, 34, t + tall - deep), (200, 46, t + tall + 1)))
    part.know("boss", (190, 40, t), diameter=2 * r, height=tall)
    part.know("pocket", (190, 40, t + tall - deep), length=20, width=12, depth=deep)
    # A pocket, and a hole drilled into its wall so that more than half of it is left in the block.
    part.cut(box((60, 20, t - 15), (110, 50, t + 1)))
    r = float(rng.uniform(5, 8))
    bite = r * float(rng.uniform(0.1, 0.5))
    part.cut(cylinder((60 - r + bite, 35, t - 12), r, BORE))
    part.know("pocket", (85, 35, t - 15), length=50, width=30, depth=15.0)
    part.know("blind_hole", (60 - r + bite, 35, t), diameter=2 * r, depth=12.0)
    # A chamfer of unequal legs below, one of 30 degrees.
    c = float(rng.uniform(3, 7))
    part.cut(prism([(240, -1, 0), (240 - c, -1, 0), (240, -1, c * 3**0.5)], (0, 122, 0)))
    part.know("chamfer", (240 - c / 2, 60, c * 3**0.5 / 2), width=2 * c, length=120, angle=np.pi / 6)
    return part
