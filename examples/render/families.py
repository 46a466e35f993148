"""Machined and cast parts of six families, drawn from seeds, each as modelled or with one change that fits it.

A part is a list of pieces, boxes and what is inscribed in boxes, that are added or cut out one after the other.  So a
change is a piece less or a box with another side, and says by itself where it lies and how much it is."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cache, partial
from itertools import groupby
from typing import Any

import numpy as np
from numpy.typing import NDArray
from OCP.BRep import BRep_Tool
from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut, BRepAlgoAPI_Fuse
from OCP.BRepFilletAPI import BRepFilletAPI_MakeChamfer, BRepFilletAPI_MakeFillet
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeCylinder
from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt, gp_Trsf
from OCP.ShapeUpgrade import ShapeUpgrade_UnifySameDomain
from OCP.TopAbs import TopAbs_EDGE, TopAbs_VERTEX
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS
from scipy.spatial.transform import Rotation

from examples.bulkhead.solids import boolean, cylinder, explore, one_solid, polygon_prism
from examples.render.views import rigid

Array = NDArray[np.float64]
Shape = Any  # the kernel has no type hints
Placed = tuple[str, str, Array]  # component, product, object_from_part
Made = tuple[dict[str, Shape], list[Placed]]  # shapes by product, and where they stand
Triple = tuple[float, float, float]
Number = Callable[[float, float], float]  # draws a dimension between two


@dataclass(frozen=True)
class Piece:
    """A solid that is added or cut out: the box between two corners, or what is inscribed in it.

    shape: "block", "x", "y" or "z" (a cylinder along that axis), "wedge" (a gusset on the high or low x side of
    what it leans on).  round: the axis of the edges that are rounded, and the radius; of a cylinder the chamfer at
    its upper end.  on: the piece with which it goes.  may: the changes that fit it, "missing", "resized", or a
    face whose offset makes a wall or flange thicker ("x0" is the one at low x)."""

    name: str
    low: Triple
    high: Triple
    shape: str = "block"
    cut: bool = False
    round: tuple[str, float] = ("z", 0.0)
    on: str = ""
    may: tuple[str, ...] = ()


@dataclass(frozen=True)
class Design:
    """A part: its pieces in order, the radius of the fillets on what the first of them make together, and bolts (where
    they sit) of one diameter and length, each a component of its own."""

    name: str
    pieces: tuple[Piece, ...]
    fillet: float = 0.0
    bolts: tuple[tuple[str, Triple], ...] = ()
    bolt: tuple[float, float] = (8.0, 10.0)
    socket: bool = False


@dataclass(frozen=True)
class Change:
    """What a part has otherwise than its model: amount in mm (of a diameter, or by which a face lies further out),
    boxes (2, 3) before and after, the axis of what was resized or that a face was moved along."""

    name: str
    kind: str
    amount: float
    before: list[list[float]]
    after: list[list[float]] | None = None
    axis: int = 0

    @property
    def reach(self) -> list[list[float]]:
        """The box about the edges that it takes away or moves: of a face its own."""
        box = np.array(self.before)
        if self.kind == "offset":
            moved = np.abs(np.array(self.after) - box).max(axis=1)
            box[:, self.axis] = box[int(moved.argmax()), self.axis]
        out: list[list[float]] = box.tolist()
        return out


def location(matrix: Array) -> Shape:
    """A transform (4, 4) as the kernel has it."""
    move = gp_Trsf()
    move.SetValues(*(float(v) for v in matrix[:3].ravel()))
    return TopLoc_Location(move)


# Solids


def solid(piece: Piece) -> Shape:
    """The solid of a piece."""
    low, high = np.array(piece.low), np.array(piece.high)
    if piece.shape.startswith("wedge"):
        right = low[0] if piece.shape == "wedge+" else high[0]
        corners = [(low[0], low[2]), (high[0], low[2]), (right, high[2])]
        upright = rigid(Rotation.from_euler("x", 90, degrees=True), (0.0, high[1], 0.0))
        return polygon_prism(corners, (0.0, high[1] - low[1])).Moved(location(upright))
    if piece.shape == "block":
        shape = BRepPrimAPI_MakeBox(gp_Pnt(*piece.low), gp_Pnt(*piece.high)).Shape()
        axis = "xyz".index(piece.round[0])
        return _eased(BRepFilletAPI_MakeFillet, shape, piece.round[1], lambda ends: np.ptp(ends[:, axis]) > 1e-6)
    axis = "xyz".index(piece.shape)
    start = np.where(np.arange(3) == axis, low, (low + high) / 2)
    axes = gp_Ax2(gp_Pnt(*start.tolist()), gp_Dir(*np.eye(3)[axis].tolist()))
    shape = BRepPrimAPI_MakeCylinder(axes, (high - low)[axis - 1] / 2, (high - low)[axis]).Shape()
    return _chamfered(shape, high[2], piece.round[1])


def _eased(how: Any, shape: Shape, size: float, of: Callable[[Any], bool]) -> Shape:
    """A solid with those edges rounded or chamfered of whose ends (n, 3) something holds."""
    if not size:
        return shape
    tool = how(shape)
    for edge in explore(shape, TopAbs_EDGE):
        points = [BRep_Tool.Pnt_s(TopoDS.Vertex(v)) for v in explore(edge, TopAbs_VERTEX)]
        if of(np.array([[p.X(), p.Y(), p.Z()] for p in points])):
            tool.Add(size, TopoDS.Edge(edge))
    tool.Build()
    if not tool.IsDone():
        raise RuntimeError("the kernel cannot round these edges")
    return one_solid(tool.Shape())


def _chamfered(shape: Shape, level: float, size: float) -> Shape:
    return _eased(BRepFilletAPI_MakeChamfer, shape, size, lambda ends: np.abs(ends[:, 2] - level).max() < 1e-6)


def _merged(shape: Shape) -> Shape:
    """The solid with faces that continue each other made one."""
    unify = ShapeUpgrade_UnifySameDomain(shape, True, True, False)
    unify.Build()
    return one_solid(unify.Shape())


@cache
def body(design: Design) -> Shape:
    """The one valid solid of a design without its bolts.  Raises RuntimeError where the kernel makes none."""
    shape: Shape = None
    for cut, run in groupby(design.pieces, lambda piece: piece.cut):
        tools = [solid(piece) for piece in run]
        if shape is not None:
            shape = boolean(BRepAlgoAPI_Cut() if cut else BRepAlgoAPI_Fuse(), shape, tools)
            continue
        shape = _merged(boolean(BRepAlgoAPI_Fuse(), tools[0], tools[1:]) if tools[1:] else tools[0])
        shape = _eased(BRepFilletAPI_MakeFillet, shape, design.fillet, lambda ends: ends[:, 2].max() > 0.1)
    return _merged(shape)


def can_make(design: Design) -> bool:
    """Whether the kernel can make a design: it cannot round all edges."""
    try:
        body(design)
    except RuntimeError:
        return False
    return True


def fastener(d: float, length: float, socket: bool) -> Shape:
    """A bolt of a diameter that sits on z = 0: a hexagon on a washer, or a cap with a hexagon socket."""
    shank = cylinder((0.0, 0.0), d / 2, (-length, 0.5))

    def hexagon(flats: float, z: tuple[float, float]) -> Shape:
        r = flats / 2 / math.cos(math.pi / 6)
        return polygon_prism([(r * math.cos(t), r * math.sin(t)) for t in np.arange(6) * math.pi / 3], z)

    if socket:
        cap = _chamfered(cylinder((0.0, 0.0), 0.75 * d, (0.0, d)), d, 0.06 * d)
        whole = boolean(BRepAlgoAPI_Fuse(), cap, [shank])
        return boolean(BRepAlgoAPI_Cut(), whole, [hexagon(0.75 * d, (0.5 * d, d + 1))])
    washer = cylinder((0.0, 0.0), 1.05 * d, (0.0, 0.2 * d))
    return boolean(BRepAlgoAPI_Fuse(), shank, [washer, hexagon(1.6 * d, (0.1 * d, 0.85 * d))])


def make(design: Design) -> Made:
    """Shapes by product and where they stand."""
    shapes, placed = {design.name: body(design)}, [(design.name, design.name, np.eye(4))]
    if design.bolts:
        shapes["BOLT"] = fastener(*design.bolt, design.socket)
        placed += [(name, "BOLT", rigid(Rotation.identity(), at)) for name, at in design.bolts]
    return shapes, placed


def changes(design: Design, kind: str, rng: np.random.Generator) -> Iterator[tuple[Change, Design]]:
    """All changes of a kind ("missing", "resized", "offset") that fit a part, their amounts drawn."""
    for name, at in design.bolts if kind == "missing" else ():
        box = np.array(at) + np.array([[-1, -1, 0], [1, 1, 1]]) * design.bolt[0]
        bolts = tuple(bolt for bolt in design.bolts if bolt[0] != name)
        yield Change(name, kind, 0.0, box.tolist()), replace(design, bolts=bolts)
    for piece in design.pieces:
        box = np.array([piece.low, piece.high])
        if kind == "missing" and kind in piece.may:
            left = tuple(p for p in design.pieces if piece.name not in (p.name, p.on))
            yield Change(piece.name, kind, 0.0, box.tolist()), replace(design, pieces=left)
            continue
        for what in piece.may:
            after = box.copy()
            if what == kind == "resized":
                axis = "xyz".index(piece.shape)
                most = max(min(4.0, 0.25 * np.ptp(box, axis=0)[axis - 1]), 0.7)
                amount = float(np.round(rng.uniform(0.6, most), 1)) * float(rng.choice([-1, 1]))
                after += np.outer([-1, 1], np.arange(3) != axis) * amount / 2
            elif kind == "offset" and what[0] in "xyz":
                axis, amount = "xyz".index(what[0]), float(np.round(rng.uniform(1.5, 4.0), 1))
                after[int(what[1]), axis] += amount * (1 if (what[1] == "1") != piece.cut else -1)
            else:
                continue
            other = replace(piece, low=tuple(after[0].tolist()), high=tuple(after[1].tolist()))
            pieces = tuple(other if p is piece else p for p in design.pieces)
            change = Change(piece.name, kind, amount, box.tolist(), after.tolist(), axis)
            yield change, replace(design, pieces=pieces)


# Families: the first draws the outline, the second the details, so that a look-alike is the same outline with others.


def _round(
    name: str,
    at: tuple[float, float],
    r: float,
    span: tuple[float, float],
    axis: str = "z",
    cut: bool = True,
    may: tuple[str, ...] = ("missing", "resized"),
    **more: Any,
) -> Piece:
    """A hole along an axis, at the two other coordinates, or a rod."""
    low, high = [c - r for c in at], [c + r for c in at]
    for corner, end in ((low, span[0]), (high, span[1])):
        corner.insert("xyz".index(axis), end)
    return Piece(name, tuple(low), tuple(high), axis, cut, may=may, **more)  # type: ignore[arg-type]


_rod = partial(_round, cut=False, may=("missing",))

CORNERS = ((-1, -1), (-1, 1), (1, -1), (1, 1))


def housing(out: Number, inner: Number) -> Design:
    """An open box with a flange at either end, a rib and a boss in it, and a window in its front."""
    x, y, z = out(60, 90), out(42, 60), out(42, 65)  # half, half, whole
    t, ear, floor = out(6, 10), out(22, 30), out(7, 11)
    rib, w, boss = inner(-0.2, 0.3) * x, inner(5, 8), inner(9, 13)
    by, top = inner(-0.3, 0.3) * y, inner(0.5, 0.9) * z
    bx = rib - inner(0.35, 0.5) * x if rib > 0 else rib + inner(0.4, 0.55) * x
    pieces = [
        Piece("body", (-x, -y, 0), (x, y, z), round=("z", 8)),
        Piece("flange_left", (-x - ear, -y, 0), (10 - x, y, floor), may=("z1",), round=("z", 6)),
        Piece("flange_right", (x - 10, -y, 0), (x + ear, y, floor), may=("z1",), round=("z", 6)),
        Piece("cavity", (t - x, t - y, floor), (x - t, y - t, z + 1), cut=True, round=("z", 5), may=("x0", "x1", "y1")),
        Piece("rib", (rib - w / 2, t - y - 1, floor - 1), (rib + w / 2, y - t + 1, top), may=("missing",)),
        _rod("boss", (bx, by), boss, (floor - 1, inner(0.4, 0.8) * z)),
        _round("boss_hole", (bx, by), boss * inner(0.4, 0.6), (floor + 2, z), on="boss"),
        _round("window", (inner(-0.5, 0.5) * x, 0.55 * z), inner(0.14, 0.24) * z, (-y - 1, t - y + 1), "y"),
    ]
    r, at = inner(4, 6), inner(0.5, 0.75) * y
    for i, (u, v) in enumerate(CORNERS):
        pieces.append(_round(f"flange_hole_{i + 1}", (u * (x + ear / 2 + 1), v * at), r, (-1, floor + 6)))
    return Design("HOUSING", tuple(pieces))


def bracket(out: Number, inner: Number) -> Design:
    """An angle with gussets, holes in both legs."""
    x, y, z, t, s = out(45, 65), out(35, 55), out(70, 110), out(8, 13), out(8, 13)
    g, far, top, aside = inner(6, 9) / 2, inner(0.55, 0.9) * x, inner(0.6, 0.8) * z, inner(0, 1) < 0.5
    middles = [0.0] if aside else [-0.8 * y, 0.8 * y]
    r, c, bore = inner(4, 6.5), inner(0.3, 0.6) * y, inner(9, 12)
    pieces = [
        Piece("base", (-x, -y, 0), (x, y, t), round=("z", 6), may=("z1",)),
        Piece("upright", (-x, -y, 0), (s - x, y, z), may=("x1",)),
        *(
            Piece(f"gusset_{i + 1}", (s - x - 1, m - g, t - 1), (far, m + g, top), "wedge+", may=("missing",))
            for i, m in enumerate(middles)
        ),
        _round("bore", (aside * inner(0.5, 0.6) * y, inner(0.55, 0.65) * z), bore, (-x - 1, s - x + 6), "x"),
    ]
    for i, v in enumerate((-1, 1)):
        pieces.append(_round(f"upper_{i + 1}", (v * 0.75 * y, 0.88 * z), r, (-x - 1, s - x + 6), "x"))
        pieces.append(_round(f"lower_{i + 1}", (0.8 * x - 4, v * c), r, (-1, t + 6)))
    return Design("BRACKET", tuple(pieces))


def turned(out: Number, inner: Number) -> Design:
    """A stepped shaft end on a flange with a ring of holes, bored, with a flat that tells its turn."""
    big, f, high = out(45, 65), out(9, 14), out(60, 100)
    r1, r2 = 0.62 * big, out(0.4, 0.48) * big
    z1 = inner(0.4, 0.65) * high
    hole, count, bore = inner(3.5, 5.5), int(inner(4, 7)), inner(0.5, 0.7) * r2
    pieces = [
        _rod("flange", (0, 0), big, (0, f), may=("z1", "resized"), round=("z", 1)),
        _rod("shoulder", (0, 0), r1, (f - 1, z1), may=("z1", "resized"), round=("z", 1.5)),
        _rod("neck", (0, 0), r2, (z1 - 1, high), may=("resized",), round=("z", 1)),
        _round("bore", (0, 0), bore, (-1, high + 1), may=("resized",)),
        Piece("flat", (-big, r1 - inner(3, 6), z1 - inner(10, 14)), (big, big, z1 + 1), cut=True, may=("missing",)),
    ]
    for i, a in enumerate(np.arange(count) * 2 * math.pi / count + 0.4):
        at = (big + r1) / 2 * math.cos(a), (big + r1) / 2 * math.sin(a)
        pieces.append(_round(f"ring_{i + 1}", at, hole, (-1, f + 6)))
    return Design("TURNED", tuple(pieces))


def plate(out: Number, inner: Number) -> Design:
    """A plate with a pad, a pocket and an opening, and bolts over their holes."""
    x, y, t, d = out(75, 100), out(50, 70), out(10, 15), out(6, 10)
    pad, u = inner(4, 8), inner(-0.35, 0.35)
    wide, deep = inner(0.2, 0.3) * x, inner(0.3, 0.45) * y
    places = [(a * (x - 1.8 * d), b * (y - 1.8 * d)) for a, b in CORNERS]
    places += [(u * 0.5 * x, (y - 1.8 * d) * (1 if inner(0, 1) < 0.5 else -1))]
    cx = 0.45 * x * (1 if u > 0 else -1)
    pieces = [
        Piece("plate", (-x, -y, 0), (x, y, t), round=("z", 7)),
        Piece("pad", (cx - wide, -deep, t - 1), (cx + wide, deep, t + pad), may=("missing", "z1"), round=("z", 4)),
        _round("pad_hole", (cx, inner(-0.3, 0.3) * deep), inner(5, 8), (-1, t + pad + 5)),
        Piece("pocket", (-cx - wide, -deep, t - 5), (-cx + wide, 0, t + 1), cut=True, may=("missing",), round=("z", 5)),
        _round("opening", (-cx, 0.35 * y), inner(0.12, 0.2) * y, (-1, t + 1)),
        *(_round(f"seat_{i + 1}", at, 0.55 * d, (-1, t + 1), may=()) for i, at in enumerate(places)),
    ]
    bolts = tuple((f"BOLT_{i + 1}", (at[0], at[1], t)) for i, at in enumerate(places))
    return Design("PLATE", tuple(pieces), bolts=bolts, bolt=(d, t), socket=inner(0, 1) < 0.5)


def sheet(out: Number, inner: Number) -> Design:
    """A bent channel of thin sheet, one side lower, with openings in its floor and sides."""
    x, y, t, high, low = out(70, 110), out(35, 55), out(1.5, 3), out(35, 55), out(20, 34)
    r = out(2, 4)
    big, slot = inner(9, 15), inner(10, 20)
    pieces = [
        Piece("outside", (-x, -y, 0), (x, y, high + 20), round=("x", r + t)),
        Piece("inside", (-x - 1, t - y, t), (x + 1, y - t, high + 30), cut=True, round=("x", r)),
        Piece("left_top", (-x - 1, -y - 1, high), (x + 1, 0, high + 40), cut=True, may=("z0",)),
        Piece("right_top", (-x - 1, -1, low), (x + 1, y + 1, high + 40), cut=True, may=("z0",)),
        _round("large", (inner(-0.4, 0) * x, inner(-0.15, 0.15) * y), big, (-1, t + 1)),
        Piece("slot", (0.4 * x, -slot, -1), (0.7 * x, slot, t + 1), cut=True, round=("z", 3), may=("missing",)),
    ]
    for i, u in enumerate((inner(-0.8, -0.4), inner(0.2, 0.8))):
        pieces.append(_round(f"left_{i + 1}", (u * x, 0.6 * high), inner(4, 7), (-y - 1, t - y + 1), "y"))
        pieces.append(_round(f"right_{i + 1}", (-u * x, 0.6 * low), inner(3, 4.5), (y - t - 1, y + 1), "y"))
    return Design("SHEET", tuple(pieces))


def casting(out: Number, inner: Number) -> Design:
    """A cast foot: a hub with ribs on a base, rounded all over, then bored and drilled."""
    x, y, t, hub, high = out(60, 85), out(42, 58), out(12, 17), out(22, 30), out(55, 85)
    u = inner(-0.15, 0.15) * x
    w, top = inner(8, 11), inner(0.55, 0.75) * high
    r, spot, cx, cy = inner(4.5, 6.5), inner(9, 12), inner(0.72, 0.8) * x, inner(0.6, 0.7) * y
    pieces = [
        Piece("base", (-x, -y, 0), (x, y, t), round=("z", 14), may=("z1",)),
        _rod("hub", (u, 0), hub, (t - 5, high), may=()),
        Piece("rib_left", (0.85 * -x, -w / 2, t - 1), (u, w / 2, top), "wedge-", may=("missing",)),
        Piece("rib_right", (u, -w / 2, t - 1), (0.85 * x, w / 2, top), "wedge+", may=("missing",)),
        _round("bore", (u, 0), inner(0.5, 0.7) * hub, (-1, high + 1), may=("resized",)),
        Piece("faced", (u - hub - 5, -hub - 5, high - 4.5), (u + hub + 5, hub + 5, high + 5), cut=True),
    ]
    for i, (a, b) in enumerate(CORNERS):
        pieces.append(_round(f"spot_{i + 1}", (a * cx, b * cy), spot, (t - 2, t + 20), may=("resized",)))
        pieces.append(_round(f"hole_{i + 1}", (a * cx, b * cy), r, (-1, t + 1)))
    return Design("CASTING", tuple(pieces), fillet=inner(2.0, 3.0))


FAMILIES = {f.__name__: f for f in (housing, bracket, turned, plate, sheet, casting)}


def draw(family: str, seed: int, details: int = 0) -> Design:
    """A part of a family, rounded by less where it must; other details give another of like outline.  Above 3,
    dimensions are in halves of a mm."""

    def numbers(stream: list[int]) -> Number:
        rng = np.random.default_rng(stream)

        def number(low: float, high: float) -> float:
            value = float(rng.uniform(low, high))
            return round(2 * value) / 2 if low >= 3 else round(value, 3)

        return number

    design = FAMILIES[family](numbers([seed, 31]), numbers([seed, 32, details]))
    return next(it for k in (1.0, 0.7, 0.4) if can_make(it := replace(design, fillet=k * design.fillet)))
