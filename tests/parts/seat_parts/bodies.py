"""Bodies with seats: discs, angles, sheets of curved outline, rings, wedges, shafts, clevises and castings."""

from __future__ import annotations

from typing import Any

import numpy as np
from OCP.BRepBuilderAPI import (
    BRepBuilderAPI_MakeEdge,
    BRepBuilderAPI_MakeFace,
    BRepBuilderAPI_MakePolygon,
    BRepBuilderAPI_MakeWire,
)
from OCP.BRepFilletAPI import BRepFilletAPI_MakeChamfer, BRepFilletAPI_MakeFillet
from OCP.BRepPrimAPI import BRepPrimAPI_MakePrism, BRepPrimAPI_MakeRevol
from OCP.GC import GC_MakeArcOfCircle
from OCP.gp import gp_Ax1, gp_Dir, gp_Pnt, gp_Vec
from OCP.TopoDS import TopoDS

from tests.parts.seat_parts.operations import work
from tests.parts.seat_parts.seats import FAR, Rng, seat, uniform
from tests.parts.solids import Part, Point, between, box, chamfer, cone, cylinder, edges, fillet, obround, prism


def disc(rng: Rng) -> Part:
    """A turned blank with seats around its middle."""
    r, t = uniform(rng, 70, 90), uniform(rng, 18, 40)
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
    work(part, rng, seats)
    return part


def angle(rng: Rng) -> Part:
    """Two legs; the upright one is a flange of the larger."""
    long, wide, t = uniform(rng, 150, 190), uniform(rng, 70, 90), uniform(rng, 10, 18)
    tall, thick = uniform(rng, 60, 75), uniform(rng, 8, 14)
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
    work(part, rng, seats)
    return part


def sheet(rng: Rng) -> Part:
    """A plate whose outline is arcs and lines."""
    t, long, wide = uniform(rng, 9, 20), uniform(rng, 170, 220), uniform(rng, 75, 95)
    bow, dip = uniform(rng, 10, 25), uniform(rng, 5, 12)
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
    work(part, rng, seats)
    return part


def ring(rng: Rng) -> Part:
    """Revolved: a hub with a flange around it and a bore through both; holes in the flange."""
    bore, hub = uniform(rng, 10, 20), uniform(rng, 28, 34)
    rim, t, tall = uniform(rng, 65, 80), uniform(rng, 8, 14), uniform(rng, 30, 50)
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
    middle, count, r = (hub + rim) / 2, int(rng.integers(3, 10)), uniform(rng, 2, 4)
    wide, deep = r + uniform(rng, 1, 4), 0.4 * t
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
    long, wide, lean = uniform(rng, 160, 200), uniform(rng, 70, 90), float(np.radians(uniform(rng, 8, 30)))
    low = uniform(rng, 30, 40)
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
    work(part, rng, [s for s in seats if s not in holes])
    for s in holes:  # through, square to the slope: the far end leans, with a counterbore, a countersink or neither
        r = uniform(rng, 2, 0.25 * s.half[0])
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


def shaft(rng: Rng) -> Part:
    """Three diameters, a keyway, a hole across, chamfered ends, a groove for a ring."""
    radius = [uniform(rng, 10, 14), uniform(rng, 19, 24), uniform(rng, 12, 16)]
    long = [uniform(rng, 30, 45), uniform(rng, 40, 60), uniform(rng, 35, 50)]
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
        width, length = r * uniform(rng, 0.3, 0.5), long[1] * uniform(rng, 0.5, 0.7)
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
        bore = r * uniform(rng, 0.2, 0.35)
        z = (a + c) / 2
        part.cut(cylinder((-FAR, 0, z), bore, 2 * FAR, (1, 0, 0)))
        part.know("through_hole", ((r, 0, z), (-r, 0, z)), diameter=2 * bore, depth=2 * r)
    if rng.random() < 0.6:
        k = uniform(rng, 0.5, 2)
        rim = lambda p, q: bool(abs(p[2]) < 1e-6 and abs(np.hypot(p[0], p[1]) - radius[0]) < 1e-6)  # noqa: E731
        part.body = chamfer(part.body, k, rim)
        part.know("chamfer", (0, 0, k / 2), width=k * 2**0.5, diameter=2 * radius[0], angle=np.pi / 4)
    if rng.random() < 0.5:
        w, d, z = uniform(rng, 1, 3), uniform(rng, 0.8, 2), 6.0
        tool = Part(cylinder((0, 0, z), radius[0] + 5, w))
        tool.cut(cylinder((0, 0, z - 1), radius[0] - d, w + 2))
        part.cut(tool.body)
        part.know("groove", (0, 0, z + w / 2), diameter=2 * (radius[0] - d), width=w, depth=d)
    return part


def clevis(rng: Rng) -> Part:
    """Two ears on a base, a pin's hole through both in one go, and holes in the base."""
    t, gap, thick, r = uniform(rng, 12, 18), uniform(rng, 18, 30), uniform(rng, 8, 14), uniform(rng, 15, 24)
    rise = r + uniform(rng, 12, 25)
    wide, long = 2 * thick + gap, 2 * r + 100
    part = Part(box((0, 0, 0), (long, wide, t)))
    x, z = long / 2, t + rise
    bore = r * uniform(rng, 0.3, 0.6)
    for y in (0.0, thick + gap):
        ear = Part(box((x - r, y, t - 2), (x + r, y + thick, z)))
        ear.fuse(cylinder((x, y, z), r, thick, (0, 1, 0)))
        part.fuse(ear.body)
        part.know("lug", ((x, y, z), (x, y + thick, z)), bore_diameter=2 * bore, width=2 * r, thickness=thick)
    part.cut(cylinder((x, -1, z), bore, wide + 2, (0, 1, 0)))
    part.know("through_hole", ((x, 0.0, z), (x, wide, z)), diameter=2 * bore, depth=wide)
    for at in (20.0, long - 20):
        q = uniform(rng, 2, 5)
        part.cut(cylinder((at, wide / 2, -1), q, t + 2))
        part.know("through_hole", ((at, wide / 2, t), (at, wide / 2, 0.0)), diameter=2 * q, depth=t)
    # The gap between the ears is a slot as deep as they are high.
    middle = (x, wide / 2, t)
    part.know("open_slot", middle, length=2 * r, width=gap, depth=rise + r)
    if rng.random() < 0.5:
        c = uniform(rng, 3, 8)
        part.body = fillet(part.body, c, between((0, 0, 0), (0, 0, t)))
        part.know("fillet", (c, c, t / 2), radius=c, length=t)
    return part


def casting(rng: Rng) -> Part:
    """A base with a rib with draft, one with a round crest, a gusset to an upright wall, a fillet of running radius."""
    long, wide, t = 240.0, 110.0, uniform(rng, 12, 20)
    part = Part(box((0, 0, 0), (long, wide, t)))
    thick, tall = uniform(rng, 8, 12), uniform(rng, 40, 55)
    part.fuse(box((0, 0, t), (thick, wide, t + tall)))
    part.know("flange", (thick / 2, wide / 2, t), thickness=thick, length=wide, height=tall)
    # A gusset between base and wall.
    rib, a = uniform(rng, 3, 6), uniform(rng, 20, 35)
    y = uniform(rng, 40, 70)
    corners: list[Point] = [(thick - 1, y - rib / 2, t - 1), (thick + a, y - rib / 2, t - 1)]
    corners += [(thick + a, y - rib / 2, t), (thick, y - rib / 2, t + a), (thick - 1, y - rib / 2, t + a)]
    part.fuse(prism(corners, (0, rib, 0)))
    part.know("rib", ((thick + a / 2, y, t), (thick, y, t + a / 2)), thickness=rib, length=a, height=a)
    # Ribs along y.
    foot, high, lean = uniform(rng, 5, 8), uniform(rng, 15, 25), float(np.radians(uniform(rng, 1, 4)))
    crest = foot - 2 * high * float(np.tan(lean))
    x, y0, y1 = 100.0, 15.0, 95.0
    if crest > 0.5:
        section: list[Point] = [(x - foot / 2, y0, t), (x + foot / 2, y0, t)]
        section += [(x + crest / 2, y0, t + high), (x - crest / 2, y0, t + high)]
        part.fuse(prism(section, (0, y1 - y0, 0)))
        part.know("rib", (x, (y0 + y1) / 2, t), thickness=foot, length=y1 - y0, height=high, draft_angle=lean)
    rib, high, x = uniform(rng, 4, 8), uniform(rng, 16, 28), 150.0
    part.fuse(box((x - rib / 2, y0, t), (x + rib / 2, y1, t + high - rib / 2)))
    part.fuse(cylinder((x, y0, t + high - rib / 2), rib / 2, y1 - y0, (0, 1, 0)))
    part.know("rib", (x, (y0 + y1) / 2, t), thickness=rib, length=y1 - y0, height=high)
    part.know("fillet", (x, (y0 + y1) / 2, t + high - rib / 2), radius=rib / 2, length=y1 - y0)
    # Ribs that cross.
    rib, high, x = uniform(rng, 3, 5), uniform(rng, 14, 20), 200.0
    part.fuse(box((x - rib / 2, y0, t), (x + rib / 2, y1, t + high)))
    part.fuse(box((x - 25, 55 - rib / 2, t), (x + 25, 55 + rib / 2, t + high * 0.8)))
    part.know("rib", (x, 55, t), thickness=rib, length=y1 - y0, height=high)
    part.know("rib", (x, 55, t), thickness=rib, length=50.0, height=high * 0.8)
    edge = edges(part.body, between((long, 0, t), (long, wide, t)))[0]
    finish = int(rng.integers(3))
    if finish == 0:
        one, two = uniform(rng, 2, 4), uniform(rng, 5, 9)
        maker = BRepFilletAPI_MakeFillet(part.body)
        maker.Add(one, two, edge)
        part.body = maker.Shape()
        part.know("fillet", (long, wide / 2, t), radius=two, least_radius=one, length=wide)
    elif finish == 1:
        one, two = uniform(rng, 2, 4), uniform(rng, 5, 9)
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
