"""Machined and cast parts of six families, drawn from seeds, each as modelled or with one change that fits it.

A part is a list of pieces, boxes and what is inscribed in boxes, that are added or cut out one after the other.  So a
change is a piece less or a box with another side, and says by itself where it lies and how much it is.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import groupby
from typing import Any

import numpy as np
from OCP.BRep import BRep_Tool
from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut, BRepAlgoAPI_Fuse
from OCP.BRepFilletAPI import BRepFilletAPI_MakeChamfer, BRepFilletAPI_MakeFillet
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeCylinder
from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt
from OCP.ShapeUpgrade import ShapeUpgrade_UnifySameDomain
from OCP.TopAbs import TopAbs_EDGE, TopAbs_VERTEX
from OCP.TopoDS import TopoDS
from scipy.spatial.transform import Rotation

from examples.bulkhead.solids import boolean, cylinder, explore, one_solid, polygon_prism
from examples.render.objects import Made, Shape, _location
from examples.render.views import rigid

Triple = tuple[float, float, float]
Number = Callable[[float, float], float]  # draws a dimension between two


@dataclass(frozen=True)
class Piece:
    """A solid that is added or cut out: the box between two corners, or what is inscribed in it.

    shape: "block", "x", "y" or "z" (a cylinder along that axis), "wedge" (a gusset on the high or low x side of
    what it leans on).  round: the axis of the edges that are rounded, and the radius; of a cylinder the chamfer at
    its upper end.  on: the piece with which it goes.  may: the changes that fit it, "missing", "resized", or a
    face whose offset makes a wall or flange thicker ("x0" is the one at low x).
    """

    name: str
    low: Triple
    high: Triple
    shape: str = "block"
    cut: bool = False
    round: tuple[str, float] | None = None
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
    before: tuple[Triple, Triple]
    after: tuple[Triple, Triple] | None
    axis: int | None = None


# Solids


def solid(piece: Piece) -> Shape:
    """The solid of a piece."""
    low, high = np.array(piece.low), np.array(piece.high)
    if piece.shape in ("x", "y", "z"):
        axis = "xyz".index(piece.shape)
        start, along = (low + high) / 2, np.eye(3)[axis]
        start[axis] = low[axis]
        radius = float(high[(axis + 1) % 3] - low[(axis + 1) % 3]) / 2
        axes = gp_Ax2(gp_Pnt(*start.tolist()), gp_Dir(*along.tolist()))
        shape = BRepPrimAPI_MakeCylinder(axes, radius, float(high[axis] - low[axis])).Shape()
        return _broken(shape, float(high[axis]), piece.round[1]) if piece.round else shape
    if piece.shape.startswith("wedge"):
        (x0, x1), (z0, z1) = (low[0], high[0]), (low[2], high[2])
        corners = [(x0, z0), (x1, z0), (x0, z1)] if piece.shape == "wedge+" else [(x0, z0), (x1, z0), (x1, z1)]
        upright = rigid(Rotation.from_euler("x", 90, degrees=True), (0.0, float(high[1]), 0.0))
        prism = polygon_prism([(float(a), float(b)) for a, b in corners], (0.0, float(high[1] - low[1])))
        return prism.Moved(_location(upright))
    shape = BRepPrimAPI_MakeBox(gp_Pnt(*piece.low), gp_Pnt(*piece.high)).Shape()
    if not piece.round:
        return shape
    axis, radius = "xyz".index(piece.round[0]), piece.round[1]
    fillet = BRepFilletAPI_MakeFillet(shape)
    for edge in explore(shape, TopAbs_EDGE):
        ends = _ends(edge)
        if abs(ends[0][axis] - ends[-1][axis]) > 1e-6:
            fillet.Add(radius, TopoDS.Edge(edge))
    return fillet.Shape()


def _ends(edge: Shape) -> Any:
    points = [BRep_Tool.Pnt_s(TopoDS.Vertex(v)) for v in explore(edge, TopAbs_VERTEX)]
    return np.array([[p.X(), p.Y(), p.Z()] for p in points])


def _broken(shape: Shape, level: float, size: float) -> Shape:
    """A cylinder along z whose upper edge is chamfered."""
    chamfer = BRepFilletAPI_MakeChamfer(shape)
    for edge in explore(shape, TopAbs_EDGE):
        if np.abs(_ends(edge)[:, 2] - level).max() < 1e-6:
            chamfer.Add(size, TopoDS.Edge(edge))
    return chamfer.Shape()


def _filleted(shape: Shape, radius: float) -> Shape:
    """A casting: every edge above the ground is rounded."""
    fillet = BRepFilletAPI_MakeFillet(shape)
    for edge in explore(shape, TopAbs_EDGE):
        if _ends(edge)[:, 2].max() > 0.1:
            fillet.Add(radius, TopoDS.Edge(edge))
    fillet.Build()
    if not fillet.IsDone():
        raise RuntimeError("the kernel cannot round this casting")
    return one_solid(fillet.Shape())


def _merged(shape: Shape) -> Shape:
    """The solid with faces that continue each other made one."""
    unify = ShapeUpgrade_UnifySameDomain(shape, True, True, False)
    unify.Build()
    return one_solid(unify.Shape())


def body(design: Design) -> Shape:
    """The one valid solid of a design without its bolts.  Raises RuntimeError where the kernel makes none."""
    shape: Shape = None
    for cut, run in groupby(design.pieces, lambda piece: piece.cut):
        tools = [solid(piece) for piece in run]
        if shape is None:
            shape = tools[0] if len(tools) == 1 else boolean(BRepAlgoAPI_Fuse(), tools[0], tools[1:])
            shape = _merged(shape)
            shape = _filleted(shape, design.fillet) if design.fillet else shape
        else:
            shape = boolean(BRepAlgoAPI_Cut() if cut else BRepAlgoAPI_Fuse(), shape, tools)
    return _merged(shape)


def fastener(diameter: float, length: float, socket: bool) -> Shape:
    """A bolt that sits on z = 0: a hexagon on a washer, or a cap with a hexagon socket."""
    shank = cylinder((0.0, 0.0), diameter / 2, (-length, 0.5))

    def hexagon(flats: float, z: tuple[float, float]) -> Shape:
        r = flats / 2 / math.cos(math.pi / 6)
        return polygon_prism([(r * math.cos(t), r * math.sin(t)) for t in np.arange(6) * math.pi / 3], z)

    if socket:
        cap = _broken(cylinder((0.0, 0.0), 0.75 * diameter, (0.0, diameter)), diameter, 0.06 * diameter)
        capped = boolean(BRepAlgoAPI_Fuse(), cap, [shank])
        return boolean(BRepAlgoAPI_Cut(), capped, [hexagon(0.75 * diameter, (0.5 * diameter, diameter + 1))])
    washer = cylinder((0.0, 0.0), 1.05 * diameter, (0.0, 0.2 * diameter))
    return boolean(BRepAlgoAPI_Fuse(), shank, [washer, hexagon(1.6 * diameter, (0.1 * diameter, 0.85 * diameter))])


def make(design: Design) -> Made:
    """Shapes by product and where they stand."""
    shapes, placed = {design.name: body(design)}, [(design.name, design.name, np.eye(4))]
    if design.bolts:
        shapes["BOLT"] = fastener(*design.bolt, design.socket)
        placed += [(name, "BOLT", rigid(Rotation.identity(), at)) for name, at in design.bolts]
    return shapes, placed


# Changes


def changes(design: Design, kind: str, rng: np.random.Generator) -> Iterator[tuple[Change, Design]]:
    """All changes of a kind ("missing", "resized", "offset") that fit a part, their amounts drawn."""
    if kind == "missing":
        d = design.bolt[0]
        for name, at in design.bolts:
            box = (at[0] - d, at[1] - d, at[2]), (at[0] + d, at[1] + d, at[2] + d)
            yield (
                Change(name, kind, 0.0, box, None),
                replace(design, bolts=tuple(b for b in design.bolts if b[0] != name)),
            )
    for piece in design.pieces:
        box = piece.low, piece.high
        if kind in piece.may and kind == "missing":
            left = tuple(p for p in design.pieces if piece.name not in (p.name, p.on))
            yield Change(piece.name, kind, 0.0, box, None), replace(design, pieces=left)
        elif kind in piece.may:  # resized
            axis = "xyz".index(piece.shape)
            across = piece.high[(axis + 1) % 3] - piece.low[(axis + 1) % 3]
            most = min(4.0, 0.25 * across)
            amount = float(np.round(rng.uniform(0.6, max(most, 0.7)), 1)) * float(rng.choice([-1, 1]))
            half = np.where(np.arange(3) == axis, 0.0, amount / 2)
            yield _altered(design, piece, kind, amount, np.array(piece.low) - half, np.array(piece.high) + half, axis)
        elif kind == "offset":
            for face in (f for f in piece.may if f[-1] in "01"):
                axis, amount = "xyz".index(face[0]), float(np.round(rng.uniform(1.5, 4.0), 1))
                corners = np.array([piece.low, piece.high])
                corners[int(face[1]), axis] += amount * (1 if (face[1] == "1") != piece.cut else -1)
                yield _altered(design, piece, kind, amount, corners[0], corners[1], axis)


def _altered(
    design: Design, piece: Piece, kind: str, amount: float, low: Any, high: Any, axis: int
) -> tuple[Change, Design]:
    after = tuple(low.tolist()), tuple(high.tolist())
    pieces = tuple(replace(p, low=after[0], high=after[1]) if p is piece else p for p in design.pieces)
    change = Change(piece.name, kind, amount, (piece.low, piece.high), after, axis)  # type: ignore[arg-type]
    return change, replace(design, pieces=pieces)


# Families: the first draws the outline, the second the details, so that a look-alike is the same outline with others.


def _drill(name: str, at: tuple[float, float], r: float, z: tuple[float, float], **more: Any) -> Piece:
    may = more.pop("may", ("missing", "resized"))
    return Piece(name, (at[0] - r, at[1] - r, z[0]), (at[0] + r, at[1] + r, z[1]), "z", cut=True, may=may, **more)


def _drill_along(
    axis: str, name: str, at: tuple[float, float], r: float, span: tuple[float, float], **more: Any
) -> Piece:
    """Along x at (y, z), along y at (x, z)."""
    low, high = [at[0] - r, at[1] - r], [at[0] + r, at[1] + r]
    low.insert("xy".index(axis), span[0])
    high.insert("xy".index(axis), span[1])
    return Piece(name, tuple(low), tuple(high), axis, cut=True, may=("missing", "resized"), **more)  # type: ignore[arg-type]


def _rod(name: str, at: tuple[float, float], r: float, z: tuple[float, float], **more: Any) -> Piece:
    return replace(_drill(name, at, r, z, may=more.pop("may", ("missing",)), **more), cut=False)


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
        _drill("boss_hole", (bx, by), boss * inner(0.4, 0.6), (floor + 2, z), on="boss"),
        _drill_along("y", "window", (inner(-0.5, 0.5) * x, 0.55 * z), inner(0.14, 0.24) * z, (-y - 1, t - y + 1)),
    ]  # fmt: skip
    r, at = inner(4, 6), inner(0.5, 0.75) * y
    pieces += [
        _drill(f"flange_hole_{i + 1}", (u * (x + ear / 2 + 1), v * at), r, (-1, floor + 6))
        for i, (u, v) in enumerate(((-1, -1), (-1, 1), (1, -1), (1, 1)))
    ]
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
        _drill_along("x", "bore", (aside * inner(0.5, 0.6) * y, inner(0.55, 0.65) * z), bore, (-x - 1, s - x + 6)),
    ]
    for i, v in enumerate((-1, 1)):
        pieces.append(_drill_along("x", f"upper_{i + 1}", (v * 0.75 * y, 0.88 * z), r, (-x - 1, s - x + 6)))
        pieces.append(_drill(f"lower_{i + 1}", (0.8 * x - 4, v * c), r, (-1, t + 6)))
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
        _drill("bore", (0, 0), bore, (-1, high + 1), may=("resized",)),
        Piece("flat", (-big, r1 - inner(3, 6), z1 - inner(10, 14)), (big, big, z1 + 1), cut=True, may=("missing",)),
    ]
    ring = (big + r1) / 2
    pieces += [
        _drill(f"ring_{i + 1}", (ring * math.cos(a), ring * math.sin(a)), hole, (-1, f + 6))
        for i, a in enumerate(np.arange(count) * 2 * math.pi / count + 0.4)
    ]
    return Design("TURNED", tuple(pieces))


def plate(out: Number, inner: Number) -> Design:
    """A plate with a pad, a pocket and an opening, and bolts over their holes."""
    x, y, t, d = out(75, 100), out(50, 70), out(10, 15), out(6, 10)
    pad, u = inner(4, 8), inner(-0.35, 0.35)
    wide, deep = inner(0.2, 0.3) * x, inner(0.3, 0.45) * y
    places = [(a * (x - 1.8 * d), b * (y - 1.8 * d)) for a in (-1, 1) for b in (-1, 1)]
    places += [(u * 0.5 * x, (y - 1.8 * d) * (1 if inner(0, 1) < 0.5 else -1))]
    cx = 0.45 * x * (1 if u > 0 else -1)
    pieces = [
        Piece("plate", (-x, -y, 0), (x, y, t), round=("z", 7)),
        Piece("pad", (cx - wide, -deep, t - 1), (cx + wide, deep, t + pad), may=("missing", "z1"), round=("z", 4)),
        _drill("pad_hole", (cx, inner(-0.3, 0.3) * deep), inner(5, 8), (-1, t + pad + 5), on=""),
        Piece("pocket", (-cx - wide, -deep, t - 5), (-cx + wide, 0, t + 1), cut=True, may=("missing",), round=("z", 5)),
        _drill("opening", (-cx, 0.35 * y), inner(0.12, 0.2) * y, (-1, t + 1)),
        *(_drill(f"seat_{i + 1}", at, 0.55 * d, (-1, t + 1), may=()) for i, at in enumerate(places)),
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
        _drill("large", (inner(-0.4, 0) * x, inner(-0.15, 0.15) * y), big, (-1, t + 1)),
        Piece("slot", (0.4 * x, -slot, -1), (0.7 * x, slot, t + 1), cut=True, round=("z", 3), may=("missing",)),
    ]
    for i, u in enumerate((inner(-0.8, -0.4), inner(0.2, 0.8))):
        pieces.append(_drill_along("y", f"left_{i + 1}", (u * x, 0.6 * high), inner(4, 7), (-y - 1, t - y + 1)))
        pieces.append(_drill_along("y", f"right_{i + 1}", (-u * x, 0.6 * low), inner(3, 4.5), (y - t - 1, y + 1)))
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
        _drill("bore", (u, 0), inner(0.5, 0.7) * hub, (-1, high + 1), may=("resized",)),
        Piece("faced", (u - hub - 5, -hub - 5, high - 4.5), (u + hub + 5, hub + 5, high + 5), cut=True),
    ]
    for i, (a, b) in enumerate(_CORNERS):
        pieces.append(_drill(f"spot_{i + 1}", (a * cx, b * cy), spot, (t - 2, t + 20), may=("resized",)))
        pieces.append(_drill(f"hole_{i + 1}", (a * cx, b * cy), r, (-1, t + 1)))
    return Design("CASTING", tuple(pieces), fillet=inner(2.0, 3.0))


_CORNERS = ((-1, -1), (-1, 1), (1, -1), (1, 1))
FAMILIES = {f.__name__: f for f in (housing, bracket, turned, plate, sheet, casting)}


def draw(family: str, seed: int, details: int = 0) -> Design:
    """A part of a family; other details give another part of the same outline.  Dimensions are in halves of a mm where
    they are larger than 3."""

    def numbers(stream: list[int]) -> Number:
        rng = np.random.default_rng(stream)

        def number(low: float, high: float) -> float:
            value = float(rng.uniform(low, high))
            return round(2 * value) / 2 if low >= 3 else round(value, 3)

        return number

    return FAMILIES[family](numbers([seed, 31]), numbers([seed, 32, details]))
