"""A second hand's parts, held out while the recogniser was written: other bodies, other operations, other orders.

Bodies are discs, angles, sheets of curved outline, rings, wedges, rails, shafts, clevises, castings and blocks whose
operations clash.  An operation works on a seat, a flat place on a body with a frame of its own.  Every part is turned
and moved at random.  What a machinist would call one feature is one: a hole drilled in line through two ears or
across a pocket is one hole, slots cut by others keep their length, pockets of one depth that run together are one.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from OCP.BRepAlgoAPI import BRepAlgoAPI_Common
from OCP.BRepBuilderAPI import (
    BRepBuilderAPI_MakeEdge,
    BRepBuilderAPI_MakeFace,
    BRepBuilderAPI_MakePolygon,
    BRepBuilderAPI_MakeWire,
    BRepBuilderAPI_Transform,
)
from OCP.BRepFilletAPI import BRepFilletAPI_MakeChamfer, BRepFilletAPI_MakeFillet
from OCP.BRepOffsetAPI import BRepOffsetAPI_ThruSections
from OCP.BRepPrimAPI import BRepPrimAPI_MakePrism, BRepPrimAPI_MakeRevol, BRepPrimAPI_MakeSphere
from OCP.GC import GC_MakeArcOfCircle
from OCP.gp import gp_Ax1, gp_Dir, gp_Pnt, gp_Trsf, gp_Vec
from OCP.TopoDS import TopoDS

from .parts_generator import (
    THIN_WEB,
    Part,
    Point,
    between,
    box,
    chamfer,
    cone,
    cylinder,
    edges,
    fillet,
    obround,
    prism,
    round_box,
    turned,
)

Floats = npt.NDArray[np.float64]
Rng = np.random.Generator
FAR = 300.0


@dataclass(frozen=True, eq=False)
class Seat:
    """A flat place on a body: part_from_seat with z out of the material, the half widths that are free around it.

    below is the thickness of the material down to a parallel face, None where there is none.
    """

    pose: Floats
    half: tuple[float, float]
    below: float | None
    safe: float  # depth that may be cut

    def put(self, shape: Any) -> Any:
        move = gp_Trsf()
        move.SetValues(*self.pose[:3].ravel().tolist())
        return BRepBuilderAPI_Transform(shape, move, True).Shape()

    def p(self, x: float, y: float, z: float) -> Point:
        q = self.pose[:3] @ [x, y, z, 1.0]
        return (float(q[0]), float(q[1]), float(q[2]))

    def spun(self, angle: float) -> Seat:
        c, s = np.cos(angle), np.sin(angle)
        spin = np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]])
        # What fits into the circle fits however it is turned.
        least = min(self.half)
        return Seat(self.pose @ spin, (least, least), self.below, self.safe)


def seat(origin: Point, z: Point, x: Point, half: tuple[float, float], below: float | None, safe: float) -> Seat:
    pose = np.eye(4)
    up, along = np.array(z, float) / np.linalg.norm(z), np.array(x, float) / np.linalg.norm(x)
    pose[:3, 0], pose[:3, 1], pose[:3, 2], pose[:3, 3] = along, np.cross(up, along), up, origin
    return Seat(pose, half, below, safe)


def _u(rng: Rng, low: float, high: float) -> float:
    return float(rng.uniform(low, high))


def workshop(seed: int) -> Part:
    """The part of a seed."""
    rng = np.random.default_rng([77, seed])
    part = FAMILIES[seed % len(FAMILIES)](rng)
    return turned(part, rng)


# Operations on a seat. --------------------------------------------------------------------------------------------


def _web(part: Part, s: Seat, depth: float, length: float, width: float, at: tuple[float, float] = (0, 0)) -> None:
    if s.below is not None and s.below - depth <= THIN_WEB * min(length, width):
        left = s.below - depth
        part.know("web", s.p(*at, -depth - left / 2), thickness=left, length=length, width=width)


def through(part: Part, rng: Rng, s: Seat) -> None:
    if s.below is None:
        return
    r = _u(rng, 1.5, 0.5 * min(s.half))
    part.cut(s.put(cylinder((0, 0, -s.below - 1), r, s.below + FAR)))
    part.know("through_hole", (s.p(0, 0, 0), s.p(0, 0, -s.below)), diameter=2 * r, depth=s.below)


def blind(part: Part, rng: Rng, s: Seat) -> None:
    depth = _u(rng, 0.3, 0.7) * s.safe
    r = _u(rng, 1.5, min(0.5 * min(s.half), 0.4 * s.safe))
    part.cut(s.put(cylinder((0, 0, -depth), r, FAR)))
    bottom, more = int(rng.integers(3)), {}
    if bottom == 1:
        half = float(np.radians(rng.choice([45, 59, 60])))
        tip = r / np.tan(half)
        part.cut(s.put(cone((0, 0, -depth - tip), 0, r, tip)))
        more = {"tip_angle": 2 * half}
    elif bottom == 2:
        ball = BRepPrimAPI_MakeSphere(gp_Pnt(0, 0, -depth), r).Shape()
        part.cut(s.put(ball))
    part.know("blind_hole", s.p(0, 0, 0), diameter=2 * r, depth=depth, **more)


def counterbored(part: Part, rng: Rng, s: Seat) -> None:
    wide = _u(rng, 0.35, 0.8) * min(s.half)
    r, deep = wide * _u(rng, 0.4, 0.7), _u(rng, 0.15, 0.4) * s.safe
    part.cut(s.put(cylinder((0, 0, -deep), wide, FAR)))
    if s.below is not None and rng.random() < 0.6:
        part.cut(s.put(cylinder((0, 0, -s.below - 1), r, FAR)))
        kind, depth, more = "through_hole", s.below, {}
    else:
        depth, half = _u(rng, 0.5, 0.7) * s.safe, float(np.radians(59))
        tip = min(r, 0.28 * s.safe) / np.tan(half)
        r = tip * float(np.tan(half))
        part.cut(s.put(cylinder((0, 0, -depth), r, FAR)), s.put(cone((0, 0, -depth - tip), 0, r, tip)))
        kind, more = "blind_hole", {"tip_angle": 2 * half}
    part.know(
        kind, s.p(0, 0, 0), diameter=2 * r, depth=depth, counterbore_diameter=2 * wide, counterbore_depth=deep, **more
    )


def countersunk(part: Part, rng: Rng, s: Seat) -> None:
    half = float(np.radians(rng.choice([30, 41, 45, 60])))
    wide = _u(rng, 0.4, 0.8) * min(s.half)
    r = wide * _u(rng, 0.4, 0.7)
    deep = (wide - r) / float(np.tan(half))
    if deep > 0.6 * s.safe:
        return
    part.cut(s.put(cone((0, 0, -deep), r, wide, deep)))
    more = {"countersink_diameter": 2 * wide, "countersink_angle": 2 * half}
    if s.below is not None:
        part.cut(s.put(cylinder((0, 0, -s.below - 1), r, FAR)))
        part.know("through_hole", s.p(0, 0, 0), diameter=2 * r, depth=s.below, **more)
    else:
        depth = _u(rng, 0.7, 0.95) * s.safe
        part.cut(s.put(cylinder((0, 0, -depth), r, FAR)))
        part.know("blind_hole", s.p(0, 0, 0), diameter=2 * r, depth=depth, **more)


def widened_twice(part: Part, rng: Rng, s: Seat) -> None:
    """A counterbore with a countersink under it."""
    wide = _u(rng, 0.5, 0.8) * min(s.half)
    sink, r = wide * 0.7, wide * 0.4
    deep = _u(rng, 0.15, 0.3) * s.safe
    more = sink - r
    if s.below is None or deep + more > 0.8 * s.safe:
        return
    part.cut(s.put(cylinder((0, 0, -deep), wide, FAR)), s.put(cone((0, 0, -deep - more), r, sink, more)))
    part.cut(s.put(cylinder((0, 0, -s.below - 1), r, FAR)))
    part.know(
        "through_hole",
        s.p(0, 0, 0),
        diameter=2 * r,
        depth=s.below,
        counterbore_diameter=2 * wide,
        counterbore_depth=deep,
        countersink_diameter=2 * sink,
        countersink_angle=np.pi / 2,
    )


def _plan(rng: Rng, s: Seat) -> tuple[Seat, float, float]:
    """A rectangle turned about the middle of the seat: its seat, length and width."""
    s = s.spun(_u(rng, 0, np.pi)) if rng.random() < 0.6 else s
    reach = min(s.half)
    length = 2 * reach * _u(rng, 0.65, 0.8)
    width = length * _u(rng, 0.4, 0.7)
    return s, length, width


def pocket(part: Part, rng: Rng, s: Seat) -> None:
    s, length, width = _plan(rng, s)
    depth = _u(rng, 0.25, 0.8) * s.safe
    corner = _u(rng, 0.1, 0.35) * width if rng.random() < 0.7 else 0.0
    floor = _u(rng, 0.2, 0.8) * min(corner, depth) if corner and rng.random() < 0.4 else 0.0
    part.cut(s.put(round_box((-length / 2, -width / 2, -depth), (length / 2, width / 2, FAR), corner, floor)))
    more = {"corner_radius": corner} if corner else {}
    more |= {"fillet_radius": floor} if floor else {}
    part.know("pocket", s.p(0, 0, -depth), length=length, width=width, depth=depth, **more)
    _web(part, s, depth, length, width)


def polygon_pocket(part: Part, rng: Rng, s: Seat) -> None:
    """Of three or six sides, blind or through."""
    count, reach, turn = int(rng.choice([3, 6])), _u(rng, 0.5, 0.8) * min(s.half), _u(rng, 0, 2)
    t = turn + 2 * np.pi * np.arange(count) / count
    corners = [(reach * float(np.cos(a)), reach * float(np.sin(a))) for a in t]
    # The least rectangle lies on a side.
    tall = reach * (1.5 if count == 3 else 3**0.5)
    broad = reach * (3**0.5 if count == 3 else 2.0)
    length, width = max(tall, broad), min(tall, broad)
    # Centre of the rectangle: of a triangle half its height above the side.
    mids = []
    for k in range(count):
        m = (np.array(corners[k]) + corners[(k + 1) % count]) / 2
        mids.append(m - m / np.linalg.norm(m) * tall / 2)
    if s.below is not None and rng.random() < 0.4:
        part.cut(s.put(prism([(*c, -s.below - 1) for c in corners], (0, 0, FAR))))
        ends = tuple(s.p(m[0], m[1], z) for m in mids for z in (0.0, -s.below))
        part.know("duct", ends, length=length, width=width, depth=s.below)
        return
    depth = _u(rng, 0.3, 0.7) * s.safe
    part.cut(s.put(prism([(*c, -depth) for c in corners], (0, 0, FAR))))
    part.know("pocket", tuple(s.p(m[0], m[1], -depth) for m in mids), length=length, width=width, depth=depth)
    if s.below is not None and s.below - depth <= THIN_WEB * width:
        left = s.below - depth
        at = tuple(s.p(m[0], m[1], -depth - left / 2) for m in mids)
        part.know("web", at, thickness=left, length=length, width=width)


def nested(part: Part, rng: Rng, s: Seat) -> None:
    """A pocket in a pocket, and a hole in the floor."""
    s, length, width = _plan(rng, s)
    one, two = _u(rng, 0.15, 0.35) * s.safe, _u(rng, 0.5, 0.8) * s.safe
    corner = 0.15 * width
    part.cut(s.put(round_box((-length / 2, -width / 2, -one), (length / 2, width / 2, FAR), corner)))
    part.know("pocket", s.p(0, 0, -one), length=length, width=width, depth=one, corner_radius=corner)
    x, inner, narrow = 0.1 * length, 0.6 * length, 0.6 * width
    low, high = (x - inner / 2, -narrow / 2, -two), (x + inner / 2, narrow / 2, FAR)
    part.cut(s.put(box(low, high)))
    part.know("pocket", s.p(x, 0, -two), length=inner, width=narrow, depth=two - one)
    _web(part, s, two, inner, narrow, (x, 0))
    if s.below is not None:
        r = 0.25 * narrow
        part.cut(s.put(cylinder((x, 0, -s.below - 1), r, FAR)))
        ends = (s.p(x, 0, -two), s.p(x, 0, -s.below))
        part.know("through_hole", ends, diameter=2 * r, depth=s.below - two)


def islands(part: Part, rng: Rng, s: Seat) -> None:
    """A pocket around a round and a square island, as high as the rim or lower."""
    s, length, width = _plan(rng, s)
    depth = _u(rng, 0.4, 0.7) * s.safe
    corner = 0.2 * width
    tool = Part(round_box((-length / 2, -width / 2, -depth), (length / 2, width / 2, FAR), corner))
    r, a = 0.12 * length, 0.1 * length
    tall = (depth, depth * _u(rng, 0.4, 0.9))
    tall = tall if rng.random() < 0.5 else tall[::-1]
    x = 0.22 * length
    tool.cut(cylinder((-x, 0, -depth), r, tall[0] if tall[0] < depth else FAR * 2))
    high = tall[1] - depth if tall[1] < depth else FAR * 2
    tool.cut(box((x - a, -0.8 * a, -depth), (x + a, 0.8 * a, high)))
    part.cut(s.put(tool.body))
    part.know("pocket", s.p(0, 0, -depth), length=length, width=width, depth=depth, corner_radius=corner)
    _web(part, s, depth, length, width)
    part.know("boss", s.p(-x, 0, -depth), diameter=2 * r, height=tall[0])
    part.know("boss", s.p(x, 0, -depth), length=2 * a, width=1.6 * a, height=tall[1])


def _frustum(low: list[Point], high: list[Point]) -> Any:
    maker = BRepOffsetAPI_ThruSections(True, True)
    for ring in (low, high):
        wire = BRepBuilderAPI_MakePolygon()
        for point in ring:
            wire.Add(gp_Pnt(*point))
        wire.Close()
        maker.AddWire(wire.Wire())
    maker.Build()
    return maker.Shape()


def _rectangle(a: float, c: float, z: float) -> list[Point]:
    return [(-a, -c, z), (a, -c, z), (a, c, z), (-a, c, z)]


def tapered(part: Part, rng: Rng, s: Seat) -> None:
    """A pocket with draft; its length and width are those of its floor."""
    s, length, width = _plan(rng, s)
    depth, lean = _u(rng, 0.3, 0.6) * s.safe, float(np.radians(_u(rng, 2, 15)))
    a, c, up = 0.4 * length, 0.4 * width, 1.0
    more = (depth + up) * float(np.tan(lean))
    part.cut(s.put(_frustum(_rectangle(a, c, -depth), _rectangle(a + more, c + more, up))))
    at = s.p(0, 0, -depth)
    part.know("pocket", at, length=2 * a, width=2 * c, depth=depth, draft_angle=lean)
    _web(part, s, depth, 2 * a, 2 * c)


def curved_floor(part: Part, rng: Rng, s: Seat) -> None:
    """A pocket whose floor is a hollow or crowned cylinder."""
    s, length, width = _plan(rng, s)
    depth, radius = _u(rng, 0.4, 0.7) * s.safe, length * _u(rng, 1.2, 3)
    block = box((-length / 2, -width / 2, -depth), (length / 2, width / 2, 10))
    if rng.random() < 0.5:
        round_ = cylinder((0, -FAR, radius - depth), radius, 2 * FAR, (0, 1, 0))
        sag = radius - (radius**2 - length**2 / 4) ** 0.5
        if sag > 0.6 * depth:
            return
        part.cut(s.put(BRepAlgoAPI_Common(block, round_).Shape()))
    else:
        sag = radius - (radius**2 - length**2 / 4) ** 0.5
        if sag > 0.6 * depth:
            return
        tool = Part(block)
        tool.cut(cylinder((0, -FAR, sag - depth - radius), radius, 2 * FAR, (0, 1, 0)))
        part.cut(s.put(tool.body))
    part.know("pocket", s.p(0, 0, -depth), length=length, width=width, depth=depth)


def closed_slot(part: Part, rng: Rng, s: Seat) -> None:
    s = s.spun(_u(rng, 0, 3))
    length = 2 * min(s.half) * _u(rng, 0.6, 0.85)
    width = length * _u(rng, 0.2, 0.5)
    if s.below is not None and rng.random() < 0.5:
        part.cut(s.put(obround((0, 0, -s.below - 1), length, width, FAR)))
        part.know("slot", (s.p(0, 0, 0), s.p(0, 0, -s.below)), length=length, width=width, depth=s.below)
        return
    depth = _u(rng, 0.3, 0.8) * s.safe
    part.cut(s.put(obround((0, 0, -depth), length, width, FAR)))
    part.know("slot", s.p(0, 0, -depth), length=length, width=width, depth=depth)
    _web(part, s, depth, length, width)


def round_boss(part: Part, rng: Rng, s: Seat) -> None:
    """Straight or with draft, with a rounded foot, or drilled from above."""
    r, height = _u(rng, 0.4, 0.75) * min(s.half), _u(rng, 4, 20)
    finish, more = int(rng.integers(4)), {}
    if finish == 0:
        lean = float(np.radians(_u(rng, 1, 8)))
        top = r - height * float(np.tan(lean))
        if top < 0.2 * r:
            return
        part.fuse(s.put(cone((0, 0, 0), r, top, height)))
        more = {"draft_angle": lean}
    else:
        part.fuse(s.put(cylinder((0, 0, 0), r, height)))
    if finish == 1:
        c, middle = min(0.2 * r, 0.5 * height), np.array(s.p(0, 0, 0))

        def ring(a: Floats, b: Floats) -> bool:
            away = max(abs(np.linalg.norm(a - middle) - r), abs(np.linalg.norm(b - middle) - r))
            return bool(away < 1e-5 and abs((a - middle) @ s.pose[:3, 2]) < 1e-5)

        part.body = fillet(part.body, c, ring)
        more = {"fillet_radius": c}
    part.know("boss", s.p(0, 0, 0), diameter=2 * r, height=height, **more)
    if finish == 2:
        bore, deep = 0.4 * r, 0.7 * height
        part.cut(s.put(cylinder((0, 0, height - deep), bore, FAR)))
        part.know("blind_hole", s.p(0, 0, height), diameter=2 * bore, depth=deep)
    elif finish == 3 and s.below is not None:
        bore = 0.45 * r
        part.cut(s.put(cylinder((0, 0, -s.below - 1), bore, FAR)))
        depth = s.below + height
        ends = (s.p(0, 0, height), s.p(0, 0, -s.below))
        part.know("through_hole", ends, diameter=2 * bore, depth=depth)


def long_boss(part: Part, rng: Rng, s: Seat) -> None:
    """Square or obround, turned."""
    s, length, width = _plan(rng, s)
    height = _u(rng, 4, 20)
    if rng.random() < 0.5:
        part.fuse(s.put(obround((0, 0, -0.5), length, width, height + 0.5)))
    else:
        low, high = (-length / 2, -width / 2, -0.5), (length / 2, width / 2, height)
        part.fuse(s.put(round_box(low, high, float(rng.choice([0.0, 0.2])) * width)))
    part.know("boss", s.p(0, 0, 0), length=length, width=width, height=height)


def grid(part: Part, rng: Rng, s: Seat) -> None:
    """Two or three rows of holes."""
    if s.below is None:
        return
    rows, columns = int(rng.integers(2, 4)), int(rng.integers(3, 5))
    pitch = 2 * min(s.half) * 0.85 / columns
    narrow = pitch * _u(rng, 0.75, 0.97)
    r = pitch * 0.2
    for i in range(columns):
        for j in range(rows):
            x, y = (i - (columns - 1) / 2) * pitch, (j - (rows - 1) / 2) * narrow
            _drilled(part, s, x, y, r)
    ends = (s.p(0, 0, 0), s.p(0, 0, -s.below))
    part.know(
        "grid_pattern",
        ends,
        count=rows * columns,
        rows=rows,
        columns=columns,
        pitch=pitch,
        row_pitch=narrow,
        hole_diameter=2 * r,
    )


def bolt_circle(part: Part, rng: Rng, s: Seat) -> None:
    if s.below is None:
        return
    count, ring = int(rng.integers(3, 9)), 0.75 * min(s.half)
    r, start = ring * _u(rng, 0.08, 0.2), _u(rng, 0, 1)
    for k in range(count):
        a = start + 2 * np.pi * k / count
        _drilled(part, s, ring * np.cos(a), ring * np.sin(a), r)
    ends = (s.p(0, 0, 0), s.p(0, 0, -s.below))
    part.know("circular_pattern", ends, count=count, pattern_diameter=2 * ring, hole_diameter=2 * r)


def _drilled(part: Part, s: Seat, x: float, y: float, r: float) -> None:
    x, y = float(x), float(y)
    assert s.below is not None
    part.cut(s.put(cylinder((x, y, -s.below - 1), r, s.below + 2)))
    part.know("through_hole", (s.p(x, y, 0), s.p(x, y, -s.below)), diameter=2 * r, depth=s.below)


ON_A_SEAT = (
    through,
    blind,
    counterbored,
    countersunk,
    widened_twice,
    pocket,
    polygon_pocket,
    nested,
    islands,
    tapered,
    curved_floor,
    closed_slot,
    round_boss,
    long_boss,
    grid,
    bolt_circle,
)


def _work(part: Part, rng: Rng, seats: list[Seat]) -> None:
    for k in rng.permutation(len(seats)).tolist():
        ON_A_SEAT[rng.integers(len(ON_A_SEAT))](part, rng, seats[k])


# Bodies. ----------------------------------------------------------------------------------------------------------


def disc(rng: Rng) -> Part:
    """A turned blank with seats around its middle."""
    r, t = _u(rng, 70, 90), _u(rng, 18, 40)
    part = Part(cylinder((0, 0, 0), r, t))
    count = int(rng.integers(3, 5))
    reach = 0.5 * r
    half = reach * float(np.sin(np.pi / count)) * 0.9
    seats = []
    for k in range(count):
        a = 2 * np.pi * k / count + 0.3
        down = k == 0 and rng.random() < 0.5
        half_ = (min(half, 0.4 * r),) * 2
        at = (reach * float(np.cos(a)), reach * float(np.sin(a)), 0.0 if down else t)
        x = (float(np.cos(a)), float(np.sin(a)), 0.0)
        seats.append(seat(at, (0, 0, -1 if down else 1), x, half_, t, 0.9 * t))
    _work(part, rng, seats)
    return part


def angle(rng: Rng) -> Part:
    """Two legs; the upright one is a flange of the larger."""
    long, wide, t = _u(rng, 150, 190), _u(rng, 70, 90), _u(rng, 10, 18)
    tall, thick = _u(rng, 60, 75), _u(rng, 8, 14)
    profile: list[Point] = [
        (0, 0, 0),
        (long, 0, 0),
        (long, 0, t),
        (thick, 0, t),
        (thick, 0, t + tall),
        (0, 0, t + tall),
    ]
    part = Part(prism(profile, (0, wide, 0)))
    part.know("flange", (thick / 2, wide / 2, t), thickness=thick, length=wide, height=tall)
    half = (min(wide / 2, (long - thick) / 4) * 0.8,) * 2
    step = (long - thick) / 4
    seats = [seat((thick + step * k, wide / 2, t), (0, 0, 1), (1, 0, 0), half, t, 0.85 * t) for k in (1, 3)]
    half = (min(wide, tall) * 0.36,) * 2
    if rng.random() < 0.5:
        seats.append(seat((0, wide / 2, t + tall / 2), (-1, 0, 0), (0, 1, 0), half, thick, 0.85 * thick))
    else:
        seats.append(seat((thick, wide / 2, t + tall / 2), (1, 0, 0), (0, 1, 0), half, thick, 0.85 * thick))
    _work(part, rng, seats)
    return part


def sheet(rng: Rng) -> Part:
    """A plate whose outline is arcs and lines."""
    t, long, wide = _u(rng, 9, 20), _u(rng, 170, 220), _u(rng, 75, 95)
    bow, dip = _u(rng, 10, 25), _u(rng, 5, 12)
    wire = BRepBuilderAPI_MakeWire()
    corners = [gp_Pnt(0, 0, 0), gp_Pnt(long, 0, 0), gp_Pnt(long, wide, 0), gp_Pnt(0, wide, 0)]
    vias = [gp_Pnt(long / 2, dip, 0), gp_Pnt(long + bow, wide / 2, 0), gp_Pnt(long / 2, wide + bow, 0), None]
    for k, via in enumerate(vias):
        one, two = corners[k], corners[(k + 1) % 4]
        curve = GC_MakeArcOfCircle(one, via, two).Value() if via is not None else None
        edge = BRepBuilderAPI_MakeEdge(curve) if curve is not None else BRepBuilderAPI_MakeEdge(one, two)
        wire.Add(edge.Edge())
    part = Part(BRepPrimAPI_MakePrism(BRepBuilderAPI_MakeFace(wire.Wire()).Face(), gp_Vec(0, 0, t)).Shape())
    half = (min(wide / 2 - dip, long / 6) * 0.9,) * 2
    seats = []
    for k in range(3):
        below = rng.random() < 0.3
        at = (long * (k + 0.5) / 3, wide / 2 + dip / 3, 0.0 if below else t)
        seats.append(seat(at, (0, 0, -1 if below else 1), (1, 0, 0), half, t, 0.85 * t))
    _work(part, rng, seats)
    return part


def ring(rng: Rng) -> Part:
    """Revolved: a hub with a flange around it and a bore through both; holes in the flange."""
    bore, hub = _u(rng, 10, 20), _u(rng, 28, 34)
    rim, t, tall = _u(rng, 65, 80), _u(rng, 8, 14), _u(rng, 30, 50)
    section: list[Point] = [
        (bore, 0, 0),
        (rim, 0, 0),
        (rim, 0, t),
        (hub, 0, t),
        (hub, 0, tall),
        (bore, 0, tall),
    ]
    polygon = BRepBuilderAPI_MakePolygon()
    for p in section:
        polygon.Add(gp_Pnt(*p))
    polygon.Close()
    face = BRepBuilderAPI_MakeFace(polygon.Wire()).Face()
    part = Part(BRepPrimAPI_MakeRevol(face, gp_Ax1(gp_Pnt(0, 0, 0), gp_Dir(0, 0, 1))).Shape())
    part.know("through_hole", ((0, 0, 0.0), (0, 0, tall)), diameter=2 * bore, depth=tall)
    part.know("flange", ((0, 0, 0.0), (0, 0, t)), diameter=2 * rim, thickness=t)
    part.know("boss", (0, 0, t), diameter=2 * hub, height=tall - t)
    middle, count, r = (hub + rim) / 2, int(rng.integers(3, 10)), _u(rng, 2, 4)
    wide, deep = r + _u(rng, 1, 4), 0.4 * t
    sunk = rng.random() < 0.5
    for k in range(count):
        a = 2 * np.pi * k / count
        x, y = middle * float(np.cos(a)), middle * float(np.sin(a))
        part.cut(cylinder((x, y, -1), r, t + 2))
        if sunk:
            part.cut(cylinder((x, y, t - deep), wide, t))
            more = {"counterbore_diameter": 2 * wide, "counterbore_depth": deep}
            part.know("through_hole", (x, y, t), diameter=2 * r, depth=t, **more)
        else:
            part.know("through_hole", ((x, y, t), (x, y, 0.0)), diameter=2 * r, depth=t)
    ends = ((0.0, 0.0, t), (0.0, 0.0, 0.0))
    part.know("circular_pattern", ends, count=count, pattern_diameter=2 * middle, hole_diameter=2 * r)
    # A keyway in the bore, a set screw's hole through the hub.
    key = bore * 0.5
    if rng.random() < 0.6:
        reach = bore * 1.25
        part.cut(box((0, -key / 2, -1), (reach, key / 2, tall + 1)))
        depth = reach - (bore**2 - key**2 / 4) ** 0.5
        part.know("open_slot", (reach, 0, tall / 2), length=tall, width=key, depth=depth)
    else:
        z, r = (t + tall) / 2, min(3.0, 0.3 * (tall - t))
        part.cut(cylinder((0, 0, z), r, FAR, (0, 1, 0)))
        low = (bore**2 - r**2) ** 0.5
        part.know("through_hole", ((0, hub, z), (0, low, z)), diameter=2 * r, depth=hub - low)
    return part


def wedge(rng: Rng) -> Part:
    """A block whose top leans; what is cut into it stands square on the slope."""
    long, wide, lean = _u(rng, 160, 200), _u(rng, 70, 90), float(np.radians(_u(rng, 8, 30)))
    low = _u(rng, 30, 40)
    high = low + long * float(np.tan(lean))
    part = Part(prism([(0, 0, 0), (long, 0, 0), (long, 0, low), (0, 0, high)], (0, wide, 0)))
    slope = long / float(np.cos(lean))
    down = (float(np.cos(lean)), 0.0, -float(np.sin(lean)))
    up = (float(np.sin(lean)), 0.0, float(np.cos(lean)))
    half = (min(slope / 6, wide / 2) * 0.85,) * 2
    seats = []
    for k in range(3):
        along = slope * (2 * k + 1) / 6
        at = (along * down[0], wide / 2, high + along * down[2])
        seats.append(seat(at, up, down, half, None, 0.55 * at[2]))
    holes = [s for s in seats if rng.random() < 0.4]
    _work(part, rng, [s for s in seats if s not in holes])
    for s in holes:  # through, square to the slope: the far end leans, with a counterbore, a countersink or neither
        r = _u(rng, 2, 0.25 * s.half[0])
        depth = s.p(0, 0, 0)[2] / up[2] + r * float(np.tan(lean))
        if s.p(-2 * r, 0, -depth)[0] < 1:  # it would leave through the end
            continue
        part.cut(s.put(cylinder((0, 0, -FAR), r, 2 * FAR)))
        more, kind = {}, int(rng.integers(3))
        wide_ = r * 1.8
        if kind == 1:
            part.cut(s.put(cylinder((0, 0, -r), wide_, FAR)))
            more = {"counterbore_diameter": 2 * wide_, "counterbore_depth": r}
        elif kind == 2:
            part.cut(s.put(cone((0, 0, r - wide_), r, wide_, wide_ - r)))
            more = {"countersink_diameter": 2 * wide_, "countersink_angle": np.pi / 2}
        ends = (s.p(0, 0, 0),) if more else (s.p(0, 0, 0), s.p(0, 0, -depth))
        part.know("through_hole", ends, diameter=2 * r, depth=depth, **more)
    return part


def rail(rng: Rng) -> Part:
    """A bar with slots of many sections across it."""
    wide, t = _u(rng, 50, 80), _u(rng, 35, 50)
    count = 4
    pitch = 60.0
    long = count * pitch + 20
    part = Part(box((0, 0, 0), (long, wide, t)))
    for k in rng.permutation(count).tolist():
        SECTIONS[rng.integers(len(SECTIONS))](part, rng, 40.0 + pitch * k, wide, t)
    return part


def _across(part: Part, section: list[tuple[float, float]], x: float, wide: float) -> None:
    part.cut(prism([(x + a, -1, z) for a, z in section], (0, wide + 2, 0)))


def square_slot(part: Part, rng: Rng, x: float, wide: float, t: float) -> None:
    w, d = _u(rng, 6, 25), _u(rng, 5, 0.6 * t)
    _across(part, [(-w / 2, t + 1), (w / 2, t + 1), (w / 2, t - d), (-w / 2, t - d)], x, wide)
    part.know("open_slot", (x, wide / 2, t - d), length=wide, width=w, depth=d)


def v_slot(part: Part, rng: Rng, x: float, wide: float, t: float) -> None:
    half, d = float(np.radians(_u(rng, 25, 50))), _u(rng, 6, 16)
    w, k = 2 * d * float(np.tan(half)), (d + 1) / d
    _across(part, [(-w * k / 2, t + 1), (w * k / 2, t + 1), (0, t - d)], x, wide)
    part.know("open_slot", (x, wide / 2, t - d), length=wide, width=w, depth=d, angle=2 * half)


def t_slot(part: Part, rng: Rng, x: float, wide: float, t: float) -> None:
    w, neck = _u(rng, 7, 14), _u(rng, 5, 10)
    broad, tall = w * _u(rng, 1.5, 2.2), _u(rng, 5, 10)
    d = neck + tall
    section = [(-w / 2, t + 1), (w / 2, t + 1), (w / 2, t - neck), (broad / 2, t - neck), (broad / 2, t - d)]
    section += [(-broad / 2, t - d), (-broad / 2, t - neck), (-w / 2, t - neck)]
    _across(part, section, x, wide)
    more = {"undercut_width": broad, "undercut_depth": tall}
    part.know("open_slot", (x, wide / 2, t - d), length=wide, width=w, depth=d, **more)


def dovetail(part: Part, rng: Rng, x: float, wide: float, t: float) -> None:
    lean, d = float(np.radians(rng.choice([45, 55, 60]))), _u(rng, 5, 14)
    w = _u(rng, 12, 22)
    more = d / float(np.tan(lean))
    k = 1 / float(np.tan(lean))
    section = [(-w / 2 + k, t + 1), (w / 2 - k, t + 1), (w / 2 + more, t - d), (-w / 2 - more, t - d)]
    _across(part, section, x, wide)
    part.know("open_slot", (x, wide / 2, t - d), length=wide, width=w, depth=d, undercut_width=w + 2 * more, angle=lean)


def ball_slot(part: Part, rng: Rng, x: float, wide: float, t: float) -> None:
    """With a round bottom: walls and a half cylinder, or an arc alone."""
    r = _u(rng, 4, 12)
    if rng.random() < 0.5:
        d = r + _u(rng, 2, 10)
        _across(part, [(-r, t + 1), (r, t + 1), (r, t - d + r), (-r, t - d + r)], x, wide)
        part.cut(cylinder((x, -1, t - d + r), r, wide + 2, (0, 1, 0)))
        w = 2 * r
    else:
        d = r * _u(rng, 0.3, 0.7)
        part.cut(cylinder((x, -1, t - d + r), r, wide + 2, (0, 1, 0)))
        w = 2 * (r**2 - (r - d) ** 2) ** 0.5
    part.know("open_slot", (x, wide / 2, t - d), length=wide, width=w, depth=d, fillet_radius=r)


def round_end(part: Part, rng: Rng, x: float, wide: float, t: float) -> None:
    """From one side, with a half round end; blind or through."""
    w, reach = _u(rng, 8, 20), wide * _u(rng, 0.4, 0.7)
    through_ = rng.random() < 0.5
    d = t if through_ else _u(rng, 5, 0.6 * t)
    low = t - d - (1 if through_ else 0)
    part.cut(box((x - w / 2, -1, low), (x + w / 2, reach - w / 2, t + 1)))
    part.cut(cylinder((x, reach - w / 2, low), w / 2, FAR))
    if through_:
        at = (x, reach, t / 2)
        part.know("open_slot", at, length=t, width=w, depth=reach, fillet_radius=w / 2)
    else:
        part.know("open_slot", (x, reach / 2, t - d), length=reach, width=w, depth=d)


def notch(part: Part, rng: Rng, x: float, wide: float, t: float) -> None:
    """From one side, square, with rounded inner corners or not."""
    w, reach = _u(rng, 8, 30), wide * _u(rng, 0.3, 0.7)
    d = _u(rng, 5, min(0.6 * t, 0.9 * reach))
    corner = float(rng.choice([0.0, 0.2])) * w
    tool = box((x - w / 2, -1, t - d), (x + w / 2, reach, t + 1))
    if corner:
        tool = fillet(tool, corner, lambda a, b: bool(abs(a[2] - b[2]) > 1e-6 and abs(a[1] - reach) < 1e-6))
    part.cut(tool)
    more = {"corner_radius": corner} if corner else {}
    part.know("open_slot", (x, reach / 2, t - d), length=reach, width=w, depth=d, **more)


def blind_step(part: Part, rng: Rng, x: float, wide: float, t: float) -> None:
    """A wide ledge from one side, closed at both ends; its depth is the lesser of its two."""
    w, reach, d = _u(rng, 30, 45), wide * _u(rng, 0.2, 0.3), _u(rng, 5, 0.6 * t)
    part.cut(box((x - w / 2, -1, t - d), (x + w / 2, reach, t + 1)))
    if d < reach:
        part.know("open_slot", (x, reach / 2, t - d), length=reach, width=w, depth=d)
    else:
        part.know("open_slot", (x, reach, t - d / 2), length=d, width=w, depth=reach)


SECTIONS = (square_slot, v_slot, t_slot, dovetail, ball_slot, round_end, notch, blind_step)


def shaft(rng: Rng) -> Part:
    """Three diameters, a keyway, a hole across, chamfered ends, a groove for a ring."""
    radius = [_u(rng, 10, 14), _u(rng, 19, 24), _u(rng, 12, 16)]
    long = [_u(rng, 30, 45), _u(rng, 40, 60), _u(rng, 35, 50)]
    part = Part(cylinder((0, 0, 0), radius[0], long[0]))
    part.fuse(cylinder((0, 0, long[0]), radius[1], long[1]))
    part.fuse(cylinder((0, 0, long[0] + long[1]), radius[2], long[2]))
    a, c = long[0], long[0] + long[1]
    end = c + long[2]
    part.know("boss", (0, 0, a), diameter=2 * radius[0], height=long[0])
    part.know("boss", (0, 0, c), diameter=2 * radius[2], height=long[2])
    r = radius[1]
    operation = int(rng.integers(3))
    if operation == 0:  # by an end mill
        width, length = r * _u(rng, 0.3, 0.5), long[1] * _u(rng, 0.5, 0.7)
        deep = width * 0.6
        s = seat((0, -r, (a + c) / 2), (0, -1, 0), (0, 0, 1), (r, r), None, r)
        part.cut(s.put(obround((0, 0, -deep), length, width, FAR)))
        part.know("slot", s.p(0, 0, -deep), length=length, width=width, depth=deep)
    elif operation == 1:  # by a saw, open at the end
        width, length = radius[2] * 0.4, long[2] * 0.6
        deep = width * 0.6 + radius[2]
        part.cut(box((-width / 2, deep - radius[2] * 1.2, end - length), (width / 2, FAR, end + 1)))
        floor = deep - radius[2] * 1.2
        top = (radius[2] ** 2 - width**2 / 4) ** 0.5
        if floor > 0:
            part.know("open_slot", (0, floor, end - length / 2), length=length, width=width, depth=top - floor)
        else:
            return shaft(rng)
    else:
        bore = r * _u(rng, 0.2, 0.35)
        z = (a + c) / 2
        part.cut(cylinder((-FAR, 0, z), bore, 2 * FAR, (1, 0, 0)))
        part.know("through_hole", ((r, 0, z), (-r, 0, z)), diameter=2 * bore, depth=2 * r)
    if rng.random() < 0.6:
        k = _u(rng, 0.5, 2)
        rim = lambda p, q: bool(abs(p[2]) < 1e-6 and abs(np.hypot(p[0], p[1]) - radius[0]) < 1e-6)  # noqa: E731
        part.body = chamfer(part.body, k, rim)
        part.know("chamfer", (0, 0, k / 2), width=k * 2**0.5, diameter=2 * radius[0], angle=np.pi / 4)
    if rng.random() < 0.5:
        w, d, z = _u(rng, 1, 3), _u(rng, 0.8, 2), 6.0
        tool = Part(cylinder((0, 0, z), radius[0] + 5, w))
        tool.cut(cylinder((0, 0, z - 1), radius[0] - d, w + 2))
        part.cut(tool.body)
        part.know("groove", (0, 0, z + w / 2), diameter=2 * (radius[0] - d), width=w, depth=d)
    return part


def clevis(rng: Rng) -> Part:
    """Two ears on a base, a pin's hole through both in one go, and holes in the base."""
    t, gap, thick, r = _u(rng, 12, 18), _u(rng, 18, 30), _u(rng, 8, 14), _u(rng, 15, 24)
    rise = r + _u(rng, 12, 25)
    wide, long = 2 * thick + gap, 2 * r + 100
    part = Part(box((0, 0, 0), (long, wide, t)))
    x, z = long / 2, t + rise
    bore = r * _u(rng, 0.3, 0.6)
    for y in (0.0, thick + gap):
        ear = Part(box((x - r, y, t - 2), (x + r, y + thick, z)))
        ear.fuse(cylinder((x, y, z), r, thick, (0, 1, 0)))
        part.fuse(ear.body)
        part.know("lug", ((x, y, z), (x, y + thick, z)), bore_diameter=2 * bore, width=2 * r, thickness=thick)
    part.cut(cylinder((x, -1, z), bore, wide + 2, (0, 1, 0)))
    part.know("through_hole", ((x, 0.0, z), (x, wide, z)), diameter=2 * bore, depth=wide)
    for at in (20.0, long - 20):
        q = _u(rng, 2, 5)
        part.cut(cylinder((at, wide / 2, -1), q, t + 2))
        part.know("through_hole", ((at, wide / 2, t), (at, wide / 2, 0.0)), diameter=2 * q, depth=t)
    # The gap between the ears is a slot as deep as they are high.
    middle = (x, wide / 2, t)
    part.know("open_slot", middle, length=2 * r, width=gap, depth=rise + r)
    if rng.random() < 0.5:
        c = _u(rng, 3, 8)
        part.body = fillet(part.body, c, between((0, 0, 0), (0, 0, t)))
        part.know("fillet", (c, c, t / 2), radius=c, length=t)
    return part


def casting(rng: Rng) -> Part:
    """A base with a rib with draft, one with a round crest, a gusset to an upright wall, a fillet of running radius."""
    long, wide, t = 240.0, 110.0, _u(rng, 12, 20)
    part = Part(box((0, 0, 0), (long, wide, t)))
    thick, tall = _u(rng, 8, 12), _u(rng, 40, 55)
    part.fuse(box((0, 0, t), (thick, wide, t + tall)))
    part.know("flange", (thick / 2, wide / 2, t), thickness=thick, length=wide, height=tall)
    # A gusset between base and wall.
    rib, a = _u(rng, 3, 6), _u(rng, 20, 35)
    y = _u(rng, 40, 70)
    corners: list[Point] = [(thick - 1, y - rib / 2, t - 1), (thick + a, y - rib / 2, t - 1)]
    corners += [(thick + a, y - rib / 2, t), (thick, y - rib / 2, t + a), (thick - 1, y - rib / 2, t + a)]
    part.fuse(prism(corners, (0, rib, 0)))
    part.know("rib", ((thick + a / 2, y, t), (thick, y, t + a / 2)), thickness=rib, length=a, height=a)
    # Ribs along y.
    foot, high, lean = _u(rng, 5, 8), _u(rng, 15, 25), float(np.radians(_u(rng, 1, 4)))
    crest = foot - 2 * high * float(np.tan(lean))
    x, y0, y1 = 100.0, 15.0, 95.0
    if crest > 0.5:
        section: list[Point] = [(x - foot / 2, y0, t), (x + foot / 2, y0, t)]
        section += [(x + crest / 2, y0, t + high), (x - crest / 2, y0, t + high)]
        part.fuse(prism(section, (0, y1 - y0, 0)))
        part.know("rib", (x, (y0 + y1) / 2, t), thickness=foot, length=y1 - y0, height=high, draft_angle=lean)
    rib, high, x = _u(rng, 4, 8), _u(rng, 16, 28), 150.0
    part.fuse(box((x - rib / 2, y0, t), (x + rib / 2, y1, t + high - rib / 2)))
    part.fuse(cylinder((x, y0, t + high - rib / 2), rib / 2, y1 - y0, (0, 1, 0)))
    part.know("rib", (x, (y0 + y1) / 2, t), thickness=rib, length=y1 - y0, height=high)
    part.know("fillet", (x, (y0 + y1) / 2, t + high - rib / 2), radius=rib / 2, length=y1 - y0)
    # Ribs that cross.
    rib, high, x = _u(rng, 3, 5), _u(rng, 14, 20), 200.0
    part.fuse(box((x - rib / 2, y0, t), (x + rib / 2, y1, t + high)))
    part.fuse(box((x - 25, 55 - rib / 2, t), (x + 25, 55 + rib / 2, t + high * 0.8)))
    part.know("rib", (x, 55, t), thickness=rib, length=y1 - y0, height=high)
    part.know("rib", (x, 55, t), thickness=rib, length=50.0, height=high * 0.8)
    edge = edges(part.body, between((long, 0, t), (long, wide, t)))[0]
    finish = int(rng.integers(3))
    if finish == 0:
        one, two = _u(rng, 2, 4), _u(rng, 5, 9)
        maker = BRepFilletAPI_MakeFillet(part.body)
        maker.Add(one, two, edge)
        part.body = maker.Shape()
        part.know("fillet", (long, wide / 2, t), radius=two, least_radius=one, length=wide)
    elif finish == 1:
        one, two = _u(rng, 2, 4), _u(rng, 5, 9)
        maker_ = BRepFilletAPI_MakeChamfer(part.body)
        (face,) = (f for f in _faces_at(part.body, edge) if _is_level(f))
        maker_.Add(one, two, edge, face)
        part.body = maker_.Shape()
        part.know(
            "chamfer",
            (long - one / 2, wide / 2, t - two / 2),
            width=float(np.hypot(one, two)),
            length=wide,
            angle=float(np.arctan2(one, two)),
        )
    return part


def _faces_at(shape: Any, edge: Any) -> list[Any]:
    from OCP.TopAbs import TopAbs_EDGE, TopAbs_FACE
    from OCP.TopExp import TopExp_Explorer

    out, faces = [], TopExp_Explorer(shape, TopAbs_FACE)
    while faces.More():
        own = TopExp_Explorer(faces.Current(), TopAbs_EDGE)
        while own.More():
            if own.Current().IsSame(edge):
                out.append(TopoDS.Face(faces.Current()))
            own.Next()
        faces.Next()
    return out


def _is_level(face: Any) -> bool:
    from OCP.BRepAdaptor import BRepAdaptor_Surface

    return bool(abs(BRepAdaptor_Surface(face).Plane().Axis().Direction().Z()) > 0.9)


def clash(rng: Rng) -> Part:
    """A block whose operations cut one another; four of them, each in a quarter of its own."""
    t = _u(rng, 32, 44)
    part = Part(box((0, 0, 0), (280, 180, t)))
    chosen = rng.permutation(len(CLASHES))[:4].tolist()
    for k, (x, y) in zip(chosen, ((70, 45), (210, 45), (70, 135), (210, 135)), strict=True):
        # From above the middle of a quarter, with the nearest side at -y.
        turn = (1, 0, 0) if y < 90 else (-1, 0, 0)
        CLASHES[k](part, rng, seat((x, y, t), (0, 0, 1), turn, (60, 40), t, 0.9 * t))
    return part


def hole_in_a_wall(part: Part, rng: Rng, s: Seat) -> None:
    """A hole of which half lies in a pocket."""
    assert s.below is not None
    a, c, depth, r = _u(rng, 25, 35), _u(rng, 15, 22), _u(rng, 8, 16), _u(rng, 4, 8)
    part.cut(s.put(box((-a, -c, -depth), (a, c, 1))))
    x = a + _u(rng, -0.3, 0.3) * r
    part.cut(s.put(cylinder((x, 0, -s.below - 1), r, FAR)))
    part.know("pocket", s.p(0, 0, -depth), length=2 * a, width=2 * c, depth=depth)
    part.know("through_hole", (s.p(x, 0, 0), s.p(x, 0, -s.below)), diameter=2 * r, depth=s.below)


def crossing_pockets(part: Part, rng: Rng, s: Seat) -> None:
    """A long shallow pocket and a deep one across it."""
    a, c, shallow, deep = _u(rng, 45, 55), _u(rng, 10, 14), _u(rng, 5, 9), _u(rng, 14, 22)
    b, d = _u(rng, 10, 14), _u(rng, 20, 30)
    part.cut(s.put(box((-a, -c, -shallow), (a, c, 1))), s.put(box((-b, -d, -deep), (b, d, 1))))
    part.know("pocket", s.p(0, 0, -shallow), length=2 * a, width=2 * c, depth=shallow)
    part.know("pocket", s.p(0, 0, -deep), length=2 * d, width=2 * b, depth=deep)


def joined_pockets(part: Part, rng: Rng, s: Seat) -> None:
    """Two pockets of one depth that run together."""
    a, depth = _u(rng, 20, 30), _u(rng, 6, 18)
    part.cut(s.put(box((-a, -30, -depth), (0, 0, 1))), s.put(box((-10, -20, -depth), (a, 25, 1))))
    at = [s.p(0, -2.5, -depth)]
    part.know("pocket", tuple(at), length=max(2 * a, 55.0), width=min(2 * a, 55.0), depth=depth)


def slotted_boss(part: Part, rng: Rng, s: Seat) -> None:
    r, height = _u(rng, 14, 25), _u(rng, 10, 20)
    part.fuse(s.put(cylinder((0, 0, 0), r, height)))
    w, d = _u(rng, 4, 8), _u(rng, 3, 8)
    part.cut(s.put(box((-r - 1, -w / 2, height - d), (r + 1, w / 2, height + 1))))
    part.know("boss", s.p(0, 0, 0), diameter=2 * r, height=height)
    part.know("open_slot", s.p(0, 0, height - d), length=2 * r, width=w, depth=d)


def holed_fillet(part: Part, rng: Rng, s: Seat) -> None:
    """The rounded edge of a step with a hole through the round."""
    assert s.below is not None
    a, c = _u(rng, 20, 30), _u(rng, 14, 20)
    height, r = _u(rng, 10, 14), _u(rng, 3, 6)
    block = fillet(s.put(box((-a, -c, -1), (a, c, height))), r, _at_seat(s, lambda p: abs(p[1] + c) < 1e-5, height))
    part.fuse(block)
    q = _u(rng, 2, 4)
    part.cut(s.put(cylinder((5, -c + r, -s.below - 1), q, FAR)))
    depth = s.below + height
    part.know("through_hole", (s.p(5, -c + r, height), s.p(5, -c + r, -s.below)), diameter=2 * q, depth=depth)
    part.know("boss", s.p(0, 0, 0), length=2 * a, width=2 * c, height=height)
    part.know("fillet", s.p(0, -c + r, height - r), radius=r, length=2 * a)


def _at_seat(s: Seat, wanted: Callable[[Floats], bool], height: float) -> Callable[[Floats, Floats], bool]:
    inverse = np.linalg.inv(s.pose)

    def both(a: Floats, b: Floats) -> bool:
        p, q = (inverse[:3, :3] @ x + inverse[:3, 3] for x in (a, b))
        level = abs(p[2] - height) < 1e-5 and abs(q[2] - height) < 1e-5
        return bool(level and wanted(p) and wanted(q))

    return both


def counterbore_at_the_edge(part: Part, rng: Rng, s: Seat) -> None:
    """A counterbore that breaks out of the side."""
    assert s.below is not None
    r = _u(rng, 3, 5)
    wide, deep = r + _u(rng, 3, 5), _u(rng, 6, 12)
    y = -45 + wide * _u(rng, 0.75, 0.95)
    y = max(y, -45 + r + 0.5)
    part.cut(s.put(cylinder((0, y, -s.below - 1), r, FAR)), s.put(cylinder((0, y, -deep), wide, FAR)))
    more = {"counterbore_diameter": 2 * wide, "counterbore_depth": deep}
    part.know("through_hole", s.p(0, y, 0), diameter=2 * r, depth=s.below, **more)


def cross_drilled(part: Part, rng: Rng, s: Seat) -> None:
    """A hole from above, and one from the side that ends in it or crosses it."""
    assert s.below is not None
    r, q = _u(rng, 6, 10), _u(rng, 2, 5)
    part.cut(s.put(cylinder((0, 0, -s.below - 1), r, FAR)))
    part.know("through_hole", (s.p(0, 0, 0), s.p(0, 0, -s.below)), diameter=2 * r, depth=s.below)
    z = -s.below / 2
    if rng.random() < 0.5:
        part.cut(s.put(cylinder((0, -50, z), q, 50, (0, 1, 0))))
        low = (r**2 - q**2) ** 0.5
        part.know("through_hole", (s.p(0, -45, z), s.p(0, -low, z)), diameter=2 * q, depth=45 - low)
    else:
        part.cut(s.put(cylinder((0, -50, z), q, 80, (0, 1, 0))))
        part.know("blind_hole", s.p(0, -45, z), diameter=2 * q, depth=75.0)


def interrupted(part: Part, rng: Rng, s: Seat) -> None:
    """A hole from the side through both walls of a pocket; it ends blind."""
    a, c, depth, q = _u(rng, 15, 25), _u(rng, 8, 14), _u(rng, 18, 22), _u(rng, 2, 4)
    part.cut(s.put(box((-a, -c, -depth), (a, c, 1))))
    part.know("pocket", s.p(0, 0, -depth), length=2 * a, width=2 * c, depth=depth)
    part.cut(s.put(cylinder((0, -50, -8), q, 50 + c + 12, (0, 1, 0))))
    part.know("blind_hole", s.p(0, -45, -8), diameter=2 * q, depth=45 + c + 12)


def chamfer_over_a_hole(part: Part, rng: Rng, s: Seat) -> None:
    """A raised block; a hole at its edge, then the edge is cut off."""
    assert s.below is not None
    a, c, height, k = _u(rng, 25, 35), _u(rng, 16, 22), _u(rng, 10, 14), _u(rng, 2, 4)
    block = s.put(box((-a, -c, -1), (a, c, height)))
    part.fuse(block)
    q = _u(rng, 3, 6)
    y = -c + k + q * 0.5
    y = max(y, -c + q + 0.5)
    part.cut(s.put(cylinder((0, y, -s.below - 1), q, FAR)))
    section = [(-FAR, -c - 1, height - k - 1), (-FAR, -c - 1, height + 1), (-FAR, -c + k + 1, height + 1)]
    tool = prism(section, (2 * FAR, 0, 0))
    part.cut(s.put(BRepAlgoAPI_Common(tool, box((-a - 1, -c - 1, 0), (a + 1, c, height + 1))).Shape()))
    depth = s.below + height
    part.know("through_hole", (s.p(0, y, height), s.p(0, y, -s.below)), diameter=2 * q, depth=depth)
    part.know("boss", s.p(0, 0, 0), length=2 * a, width=2 * c, height=height)
    at = s.p(0, -c + k / 2, height - k / 2)
    part.know("chamfer", at, width=k * 2**0.5, length=2 * a, angle=np.pi / 4)


def bored_rib(part: Part, rng: Rng, s: Seat) -> None:
    """A hole through a rib, and a rib across it."""
    a, rib, high, q = _u(rng, 40, 50), _u(rng, 3, 6), _u(rng, 16, 24), _u(rng, 2, 5)
    part.fuse(s.put(box((-a, -rib / 2, -1), (a, rib / 2, high))))
    part.fuse(s.put(box((-rib / 2, -30, -1), (rib / 2, 30, high))))
    part.know("rib", s.p(0, 0, 0), thickness=rib, length=2 * a, height=high)
    part.know("rib", s.p(0, 0, 0), thickness=rib, length=60.0, height=high)
    part.cut(s.put(cylinder((25, -20, high / 2), q, 40, (0, 1, 0))))
    ends = (s.p(25, -rib / 2, high / 2), s.p(25, rib / 2, high / 2))
    part.know("through_hole", ends, diameter=2 * q, depth=rib)


def slot_into_pocket(part: Part, rng: Rng, s: Seat) -> None:
    """A slot from the side that runs into a deeper pocket."""
    a, c, depth = _u(rng, 20, 30), _u(rng, 12, 20), _u(rng, 14, 22)
    part.cut(s.put(round_box((-a, -c, -depth), (a, c, 1), 5.0)))
    part.know("pocket", s.p(0, 0, -depth), length=2 * a, width=2 * c, depth=depth, corner_radius=5.0)
    w, d = _u(rng, 6, 12), _u(rng, 4, 10)
    part.cut(s.put(box((-w / 2, -50, -d), (w / 2, 0, 1))))
    part.know("open_slot", s.p(0, (-45 - c) / 2, -d), length=45 - c, width=w, depth=d)


CLASHES = (
    hole_in_a_wall,
    crossing_pockets,
    joined_pockets,
    slotted_boss,
    holed_fillet,
    counterbore_at_the_edge,
    cross_drilled,
    interrupted,
    chamfer_over_a_hole,
    bored_rib,
    slot_into_pocket,
)

FAMILIES = (disc, angle, sheet, ring, wedge, rail, shaft, clevis, casting, clash, clash, rail)
