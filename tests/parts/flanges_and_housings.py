"""Parts of a third hand, written before it was looked at how features are recognised: turned flanges, housings, bent
sheets, ribbed frames, manifolds, cam discs, keyed shafts, moulds.

What is known of a feature is what its operation states; the recogniser may say more.  Frames are stated too: the
direction out of the material, and that of the length where there is one.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt
from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut, BRepAlgoAPI_Fuse
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge, BRepBuilderAPI_MakeFace, BRepBuilderAPI_MakeWire
from OCP.BRepPrimAPI import BRepPrimAPI_MakePrism
from OCP.collections import Array1_gp_Pnt
from OCP.GeomAPI import GeomAPI_PointsToBSpline
from OCP.gp import gp_Pnt, gp_Vec

from tests.parts.curved_parts import revolved
from tests.parts.solids import Point, Rng, at_height, between, box, cone, cylinder, fillet, obround, prism

Floats = npt.NDArray[np.float64]
UP: Point = (0.0, 0.0, 1.0)


@dataclass(frozen=True)
class Made:
    """A feature as its operation states it: either point is its origin; low and high are the corners of its box.

    axis: Z of the frame lies along it either way, and the origin on a line along it through a point.
    """

    kind: str
    at: tuple[Point, ...]
    dimensions: dict[str, float]
    out: Point | None = None
    along: Point | None = None
    box: tuple[Point, Point] | None = None
    axis: Point | None = None


@dataclass
class Work:
    """silent: kinds that the truth is silent about where it states none of them; perhaps: what may be found or not."""

    body: Any
    features: list[Made] = field(default_factory=list)
    silent: frozenset[str] = frozenset(
        ("fillet", "chamfer", "web", "linear_pattern", "circular_pattern", "grid_pattern")
    )

    perhaps: list[Made] = field(default_factory=list)

    def cut(self, *tools: Any) -> None:
        for tool in tools:
            self.body = BRepAlgoAPI_Cut(self.body, tool).Shape()

    def add(self, *more: Any) -> None:
        from OCP.ShapeUpgrade import ShapeUpgrade_UnifySameDomain

        for one in more:
            self.body = BRepAlgoAPI_Fuse(self.body, one).Shape()
        unify = ShapeUpgrade_UnifySameDomain(self.body, True, True, False)
        unify.Build()
        self.body = unify.Shape()

    def note(
        self,
        kind: str,
        *at: Point,
        out: Point | None = None,
        along: Point | None = None,
        box: tuple[Point, Point] | None = None,
        axis: Point | None = None,
        **dimensions: float,
    ) -> None:
        self.features.append(Made(kind, at, dimensions, out, along, box, axis))

    def drill(self, x: float, y: float, r: float, top: float, bottom: float) -> None:
        """A plain hole along z through all of the material between two heights."""
        self.cut(cylinder((x, y, bottom - 1), r, top - bottom + 2))
        ends = ((x, y, top), (x, y, bottom))
        limits = ((x - r, y - r, bottom), (x + r, y + r, top))
        self.note("through_hole", *ends, box=limits, diameter=2 * r, depth=top - bottom)


def toolroom(seed: int) -> Work:
    """The part of a seed."""
    rng = np.random.default_rng(7000 + seed)
    return FAMILIES[seed % len(FAMILIES)](rng)


def u(rng: Rng, low: float, high: float) -> float:
    return float(rng.uniform(low, high))


def pipe_flange(rng: Rng) -> Work:
    """Turned in one piece: disc, hub with a rounded neck, bore; a bolt circle, counterbored or not."""
    rim, t, hub, tall = u(rng, 70, 100), u(rng, 10, 18), u(rng, 25, 38), u(rng, 20, 40)
    neck = u(rng, 2, 5)
    work = Work(revolved([(0, 0), (rim, 0), (rim, t), (hub, t), (hub, t + tall), (0, t + tall)]))
    work.body = fillet(work.body, neck, lambda a, b: at_height(t)(a, b) and bool(np.hypot(*a[:2]) < hub + 1e-6))
    bore = hub * u(rng, 0.4, 0.75)
    work.drill(0.0, 0.0, bore, t + tall, 0.0)
    work.note("boss", (0, 0, t), out=UP, diameter=2 * hub, height=tall)
    work.note("flange", (0, 0, t), (0, 0, 0), diameter=2 * rim, thickness=t)
    n, r, ring = int(rng.integers(4, 9)), u(rng, 3, 5), (rim + hub + neck) / 2
    sunk = rng.random() < 0.5
    for k in range(n):
        x, y = (float(ring * f(2 * np.pi * k / n + 0.3)) for f in (np.cos, np.sin))
        if sunk:
            wide, deep = r + 2.5, 0.35 * t
            work.cut(cylinder((x, y, t - deep), wide, 50))
            work.cut(cylinder((x, y, -1), r, 50))
            more: dict[str, Any] = {"counterbore_diameter": 2 * wide, "counterbore_depth": deep}
            work.note("through_hole", (x, y, t), out=UP, diameter=2 * r, depth=t, **more)
        else:
            work.drill(x, y, r, t, 0.0)
    work.note("circular_pattern", (0, 0, t), (0, 0, 0), count=n, pattern_diameter=2 * ring, hole_diameter=2 * r)
    return work


def housing(rng: Rng) -> Work:
    """A block on feet: a stepped bearing seat with a snap-ring groove, tapped feet, a window in one wall."""
    a, b, h = u(rng, 60, 75), u(rng, 60, 75), u(rng, 40, 55)
    foot, t = u(rng, 22, 30), u(rng, 9, 14)
    work = Work(box((-a, -b, 0), (a, b, h)))
    work.add(box((-a - foot, -b, 0), (a + foot, b, t)))
    for side in (-1.0, 1.0):
        work.note("step", (side * a, 0, (h + t) / 2), (side * (a + foot / 2), 0, t), length=2 * b)
        for y in (-b / 2, b / 2):
            work.drill(side * (a + foot / 2), y, 4.5, t, 0.0)
    seat, through = u(rng, 25, 35), u(rng, 15, 22)
    deep = u(rng, 0.5, 0.7) * h
    work.cut(cylinder((0, 0, h - deep), seat, 100), cylinder((0, 0, -1), through, 200))
    ring, width, down = u(rng, 1.2, 2.5), u(rng, 1.5, 3), u(rng, 4, 8)
    work.cut(revolved([(0, h - down - width), (seat + ring, h - down - width), (seat + ring, h - down), (0, h - down)]))
    more: dict[str, Any] = {"counterbore_diameter": 2 * seat, "counterbore_depth": deep}
    more |= {"groove_diameter": 2 * (seat + ring), "groove_width": width}
    work.note("through_hole", (0, 0, h), out=UP, diameter=2 * through, depth=h, **more)
    # A lubrication hole from the side into the seat.
    q, z = u(rng, 2, 3.5), h - deep / 2 - 6
    work.cut(cylinder((0, -b - 1, z), q, b - seat / 2, (0, 1, 0)))
    end = float(np.sqrt(seat**2 - q**2))
    work.note("through_hole", (0, -b, z), (0, -end, z), diameter=2 * q, depth=b - end)
    return work


def bent_sheet(rng: Rng) -> Work:
    """A sheet bent twice about y with an inner radius; holes in both leaves and a slot in the base."""
    t, inner = u(rng, 1.5, 4), u(rng, 2, 5)
    long, wide = u(rng, 100, 140), u(rng, 50, 80)
    left, right = u(rng, 30, 50), u(rng, 25, 45)
    work = Work(box((0, 0, 0), (long, wide, t)))
    work.add(box((0, 0, 0), (t, wide, left)), box((long - t, 0, 0), (long, wide, right)))
    for x, at in ((0.0, t), (long, long - t)):
        work.body = fillet(work.body, inner, between((at, 0, t), (at, wide, t)))
        work.body = fillet(work.body, inner + t, between((x, 0, 0), (x, wide, 0)))
    for x, high in ((t / 2, left), (long - t / 2, right)):
        work.note("flange", (x, wide / 2, t), out=UP, thickness=t, length=wide)
        r, z = u(rng, 3, 6), t + inner + (high - t - inner) / 2
        work.cut(cylinder((x - 5, wide / 2, z), r, 10, (1, 0, 0)))
        work.note("through_hole", (x - t / 2, wide / 2, z), (x + t / 2, wide / 2, z), diameter=2 * r, depth=t)
    work.note("open_slot", (long / 2, wide / 2, t), out=UP, along=(0, 1, 0), length=wide, width=long - 2 * t)
    length, width = u(rng, 20, 30), u(rng, 6, 10)
    work.cut(obround((long / 2, wide / 2, -1), length, width, 50))
    work.note(
        "slot", (long / 2, wide / 2, t), (long / 2, wide / 2, 0), along=(1, 0, 0), length=length, width=width, depth=t
    )
    return work


def ribbed_frame(rng: Rng) -> Work:
    """A closed frame of walls on a base; ribs of unlike height run between the walls."""
    a, b, t = u(rng, 160, 200), u(rng, 90, 120), u(rng, 5, 9)
    wall, tall = u(rng, 8, 12), u(rng, 30, 40)
    work = Work(box((0, 0, 0), (a, b, t + tall)))
    work.cut(box((wall, wall, t), (a - wall, b - wall, 200)))
    last = wall
    for x in (u(rng, 45, 60), u(rng, 100, 115)):
        rib, high = u(rng, 2.5, 4), u(rng, 0.3, 0.75) * tall
        work.add(box((x - rib / 2, wall, t), (x + rib / 2, b - wall, t + high)))
        limits = ((x - rib / 2, wall, t), (x + rib / 2, b - wall, t + high))
        size: dict[str, Any] = {"thickness": rib, "length": b - 2 * wall, "height": high}
        work.note("rib", (x, b / 2, t), out=UP, along=(0, 1, 0), box=limits, **size)
        work.note("pocket", ((last + x - rib / 2) / 2, b / 2, t), out=UP, depth=tall)
        last = x + rib / 2
    work.note("pocket", ((last + a - wall) / 2, b / 2, t), out=UP, depth=tall)
    for x in (wall / 2, a - wall / 2):
        work.note("flange", (x, b / 2, t), out=UP, along=(0, 1, 0), thickness=wall, length=b - 2 * wall, height=tall)
    for y in (wall / 2, b - wall / 2):
        work.note("flange", (a / 2, y, t), out=UP, along=(1, 0, 0), thickness=wall, length=a - 2 * wall, height=tall)
    r = u(rng, 3, 6)
    work.drill(25.0, b / 2, r, t, 0.0)
    return work


def manifold(rng: Rng) -> Work:
    """A gallery drilled from one end and ports drilled into it from three sides; a plug seat at the end."""
    a, b, c = u(rng, 140, 170), u(rng, 50, 60), u(rng, 50, 60)
    work = Work(box((0, 0, 0), (a, b, c)))
    r, deep = u(rng, 7, 10), a - 25
    y, z = b / 2, c / 2
    work.cut(cylinder((-1, y, z), r, deep + 1, (1, 0, 0)))
    work.note("blind_hole", (0, y, z), out=(-1, 0, 0), diameter=2 * r, depth=deep)
    for x in (30.0, 65.0, 100.0):
        q = u(rng, 2.5, 5)
        reach = float(np.sqrt(r**2 - q**2))
        side = int(rng.integers(3))
        if side == 0:
            work.cut(cylinder((x, y, z), q, 100))
            work.note("through_hole", (x, y, c), (x, y, z + reach), diameter=2 * q, depth=c - z - reach)
        elif side == 1:
            work.cut(cylinder((x, y, z), q, 100, (0, -1, 0)))
            work.note("through_hole", (x, 0, z), (x, y - reach, z), diameter=2 * q, depth=y - reach)
        else:
            work.cut(cylinder((x, y, -1), q, c + 2))
            work.note("through_hole", (x, y, c), (x, y, 0), diameter=2 * q, depth=c)  # in one go
    return work


def cam_disc(rng: Rng) -> Work:
    """A disc with kidney slots on a circle, some through, and a hub bore with a keyway."""
    rim, t = u(rng, 60, 80), u(rng, 10, 16)
    work = Work(cylinder((0, 0, 0), rim, t))
    ring, half = u(rng, 38, 45), u(rng, 4, 7)
    for start in (0.2, 2.4, 4.4):
        sweep, through = u(rng, 0.5, 1.1), rng.random() < 0.5
        depth = t if through else u(rng, 0.4, 0.7) * t
        z = t - depth - (1 if through else 0)
        outline = [(ring - half, z), (ring + half, z), (ring + half, t + 1), (ring - half, t + 1)]
        tool = Work(_spun(revolved(outline, sweep), start))
        ends = [(ring * float(np.cos(s)), ring * float(np.sin(s)), z) for s in (start, start + sweep)]
        tool.add(*(cylinder(e, half, t + 1 - z) for e in ends))
        work.cut(tool.body)
        x, y = (ring * float(f(start + sweep / 2)) for f in (np.cos, np.sin))
        work.note(
            "slot",
            (x, y, t - depth),
            (x, y, t),
            bend_radius=ring,
            length=ring * sweep + 2 * half,
            width=2 * half,
            depth=depth,
        )
    bore, key, deep = u(rng, 10, 16), u(rng, 4, 6), u(rng, 2, 3)
    work.cut(cylinder((0, 0, -1), bore, t + 2))
    work.note("through_hole", (0, 0, t), (0, 0, 0), diameter=2 * bore, depth=t)
    work.cut(box((0, -key / 2, -1), (bore + deep, key / 2, t + 1)))
    work.note("open_slot", (bore + deep, 0, t / 2), out=(-1, 0, 0), width=key, length=t)
    return work


def _spun(body: Any, angle: float) -> Any:
    from OCP.BRepBuilderAPI import BRepBuilderAPI_Transform
    from OCP.gp import gp_Ax1, gp_Dir, gp_Trsf

    turn = gp_Trsf()
    turn.SetRotation(gp_Ax1(gp_Pnt(0, 0, 0), gp_Dir(0, 0, 1)), angle)
    return BRepBuilderAPI_Transform(body, turn, True).Shape()


def keyed_shaft(rng: Rng) -> Work:
    """A turned shaft with a shoulder, a Woodruff keyway, a flat milled at one end and a centre hole."""
    r, big, length = u(rng, 12, 18), u(rng, 22, 28), u(rng, 60, 80)
    work = Work(revolved([(0, 0), (r, 0), (r, length), (big, length), (big, length + 20), (0, length + 20)]))
    work.note("boss", (0, 0, length), out=(0, 0, -1), diameter=2 * r, height=length)
    width, disc = u(rng, 4, 6), u(rng, 9, 12)
    z, depth = length / 2, u(rng, 4, 6)
    work.cut(cylinder((r - depth + disc, -width / 2, z), disc, width, (0, 1, 0)))
    work.note("slot", (r - depth, 0, z), out=(1, 0, 0), along=UP, width=width, depth=depth)
    q, deep = u(rng, 2, 3.5), u(rng, 10, 18)
    work.cut(cylinder((0, 0, -1), q, deep + 1), cone((0, 0, deep), q, 0, q))
    work.note("blind_hole", (0, 0, 0), out=(0, 0, -1), diameter=2 * q, depth=deep)
    x = u(rng, 3, 6)
    work.cut(box((-100, -100, length + 10), (x - big, 100, length + 30)))
    work.note("step", (x - big, 0, length + 15), out=(-1, 0, 0))
    return work


def mould(rng: Rng) -> Work:
    """Cavities: with drafted walls, with a free-form wall, open to the side, left- and right-hand."""
    a, b, t = 260.0, 140.0, u(rng, 30, 40)
    work = Work(box((0, 0, 0), (a, b, t)))
    # Drafted: the floor is smaller than the mouth.
    length, w, d, lean = u(rng, 40, 55), u(rng, 25, 35), u(rng, 10, 18), float(np.radians(u(rng, 3, 8)))
    work.cut(_drafted((50, 35, t - d), length, w, d, lean))
    work.note("pocket", (50, 35, t - d), out=UP, along=(1, 0, 0), depth=d, draft_angle=lean)
    # A free-form wall on one side of a closed pocket.
    d, high, wave = u(rng, 8, 16), u(rng, 24, 34), u(rng, 2, 5)
    work.cut(_wavy(110, 160, 20, high - wave, high, t - d, 100))
    work.note("pocket", out=UP, depth=d)
    # Open to the side, round corners at the back.
    w, back, d, corner = u(rng, 30, 45), u(rng, 25, 35), u(rng, 8, 14), u(rng, 3, 6)
    work.cut(
        fillet(
            box((205 - w / 2, -1, t - d), (205 + w / 2, back, t + 1)),
            corner,
            lambda p, q: bool(abs(p[2] - q[2]) > 1e-6 and p[1] > 0),
        )
    )
    work.note("open_slot", (205, back / 2, t - d), out=UP, length=back, width=w, depth=d)
    # Two skew cavities, mirror images of each other.
    d, length, w, skew = u(rng, 6, 12), u(rng, 30, 40), u(rng, 18, 26), u(rng, 6, 12)
    for x, side in ((80.0, 1.0), (180.0, -1.0)):
        corners = [(0, 0), (length, 0), (length - skew, w), (skew / 3, w)]
        points = [(x + side * p, 85 + q, t - d) for p, q in corners]
        work.cut(prism(points, (0, 0, 100)))
        work.note("pocket", out=UP, depth=d)
    return work


def _drafted(floor: Point, length: float, width: float, depth: float, lean: float) -> Any:
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakePolygon
    from OCP.BRepOffsetAPI import BRepOffsetAPI_ThruSections

    x, y, z = floor
    maker = BRepOffsetAPI_ThruSections(True, True)
    for up in (0.0, depth + 5):
        grow = up * float(np.tan(lean))
        p, q = length / 2 + grow, width / 2 + grow
        polygon = BRepBuilderAPI_MakePolygon()
        for corner in ((-p, -q), (p, -q), (p, q), (-p, q)):
            polygon.Add(gp_Pnt(x + corner[0], y + corner[1], z + up))
        polygon.Close()
        maker.AddWire(polygon.Wire())
    return maker.Shape()


def _wavy(x0: float, x1: float, y0: float, low: float, high: float, z: float, height: float) -> Any:
    """A prism with three straight sides and a spline."""
    xs = np.linspace(x1, x0, 7)
    points = Array1_gp_Pnt(1, 7)
    for i, x in enumerate(xs.tolist()):
        points.SetValue(i + 1, gp_Pnt(x, y0 + (low if i % 2 else high), z))
    curve = GeomAPI_PointsToBSpline(points).Curve()
    wire = BRepBuilderAPI_MakeWire()
    corners = [gp_Pnt(x0, y0 + high, z), gp_Pnt(x0, y0, z), gp_Pnt(x1, y0, z), gp_Pnt(x1, y0 + high, z)]
    for p, q in pairwise(corners):
        wire.Add(BRepBuilderAPI_MakeEdge(p, q).Edge())
    wire.Add(BRepBuilderAPI_MakeEdge(curve).Edge())
    return BRepPrimAPI_MakePrism(BRepBuilderAPI_MakeFace(wire.Wire()).Face(), gp_Vec(0, 0, height)).Shape()


FAMILIES = (pipe_flange, housing, bent_sheet, ribbed_frame, manifold, cam_disc, keyed_shaft, mould)
