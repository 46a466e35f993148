"""Parts of a fourth hand, written from what the tables' comments say and nothing else: flanged shafts, gusseted
brackets, drums, rockers, yokes, seams, edges, crossing ribs.

Half of them are mirrored, scaled, turned and moved as a whole.  What a plain convention does not settle is not stated.
"""

from __future__ import annotations

from dataclasses import replace
from math import cos, pi, radians, sin, tan
from typing import Any

import numpy as np
from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut, BRepAlgoAPI_Fuse
from OCP.BRepBuilderAPI import BRepBuilderAPI_Transform
from OCP.BRepPrimAPI import BRepPrimAPI_MakeCone
from OCP.gp import gp_Ax1, gp_Ax2, gp_Dir, gp_Pnt, gp_Trsf, gp_Vec

from tests.parts.curved_parts import revolved
from tests.parts.flanges_and_housings import Work
from tests.parts.solids import (
    THIN_WEB,
    Point,
    Rng,
    between,
    box,
    chamfer,
    cone,
    cylinder,
    fillet,
    obround,
    prism,
    upright,
)

UP: Point = (0.0, 0.0, 1.0)
DOWN: Point = (0.0, 0.0, -1.0)
DRILL = radians(118)
COUNTS_AND_ANGLES = ("count", "tip_angle", "draft_angle", "countersink_angle", "angle", "rows", "columns")


def foundry(seed: int) -> Work:
    """The part of a seed."""
    rng = np.random.default_rng(40_000 + seed)
    work = FAMILIES[seed % len(FAMILIES)](rng)
    return placed(work, rng) if seed // len(FAMILIES) % 2 else work


def u(rng: Rng, low: float, high: float) -> float:
    return round(float(rng.uniform(low, high)), 2)


def chance(rng: Rng) -> bool:
    return bool(rng.random() < 0.5)


def placed(work: Work, rng: Rng) -> Work:
    """Mirrored or not, scaled, turned and moved."""
    scale, spin, shift, mirror = gp_Trsf(), gp_Trsf(), gp_Trsf(), gp_Trsf()
    factor = float(rng.choice([0.5, 1.0, 2.0]))
    scale.SetScale(gp_Pnt(0, 0, 0), factor)
    spin.SetRotation(gp_Ax1(gp_Pnt(0, 0, 0), gp_Dir(*rng.normal(size=3))), u(rng, 0.2, 3))
    shift.SetTranslation(gp_Vec(*rng.uniform(-300, 300, 3)))
    if chance(rng):
        mirror.SetMirror(gp_Ax2(gp_Pnt(0, 0, 0), gp_Dir(*rng.normal(size=3))))
    move = shift * spin * scale * mirror

    def point(p: Point) -> Point:
        q = gp_Pnt(*p).Transformed(move)
        return (q.X(), q.Y(), q.Z())

    def direction(d: Point | None) -> Point | None:
        if d is None:
            return None
        v = gp_Vec(*d).Transformed(move).Normalized()
        return (v.X(), v.Y(), v.Z())

    features = [
        replace(
            f,
            at=tuple(map(point, f.at)),
            dimensions={k: v if k in COUNTS_AND_ANGLES else v * factor for k, v in f.dimensions.items()},
            out=direction(f.out),
            along=direction(f.along),
            axis=direction(f.axis),
            box=None,
        )
        for f in work.features
    ]
    return Work(BRepBuilderAPI_Transform(work.body, move, True).Shape(), features, work.silent)


def fused(*shapes: Any) -> Any:
    work = Work(shapes[0])
    work.add(*shapes[1:])
    return work.body


def moved(shape: Any, turn: float = 0.0, axis: Point = UP, by: Point = (0.0, 0.0, 0.0)) -> Any:
    """Turned about an axis through the origin, then moved."""
    spin, shift = gp_Trsf(), gp_Trsf()
    if turn:
        spin.SetRotation(gp_Ax1(gp_Pnt(0, 0, 0), gp_Dir(*axis)), turn)
    shift.SetTranslation(gp_Vec(*by))
    return BRepBuilderAPI_Transform(shape, shift * spin, True).Shape()


def along(p: Point, d: Point, t: float) -> Point:
    return (p[0] + t * d[0], p[1] + t * d[1], p[2] + t * d[2])


def rod(start: Point, d: Point, radius: float, length: float) -> Any:
    return cylinder(start, radius, length, d)


def twist_drill(work: Work, mouth: Point, into: Point, r: float, depth: float) -> None:
    """A blind hole with the point of a drill; depth to the shoulder."""
    tip = BRepPrimAPI_MakeCone(
        gp_Ax2(gp_Pnt(*along(mouth, into, depth)), gp_Dir(*into)), r, 0, r / tan(DRILL / 2)
    ).Shape()
    work.cut(rod(along(mouth, into, -r), into, r, depth + r), tip)
    out = (-into[0], -into[1], -into[2])
    work.note("blind_hole", mouth, out=out, diameter=2 * r, depth=depth, tip_angle=DRILL)


def bore(work: Work, start: Point, d: Point, r: float, length: float, **more: Any) -> None:
    """A hole from a plane to a parallel one."""
    work.cut(rod(along(start, d, -1), d, r, length + 2))
    work.note("through_hole", start, along(start, d, length), axis=d, diameter=2 * r, depth=length, **more)


def bolt_circle(work: Work, n: int, r: float, circle: float, low: float, high: float) -> None:
    for k in range(n):
        a = 2 * pi * k / n + 0.3
        bore(work, (circle * cos(a), circle * sin(a), low), UP, r, high - low)
    work.note("circular_pattern", (0, 0, low), axis=UP, count=n, pattern_diameter=2 * circle, hole_diameter=2 * r)


def flanged_shaft(rng: Rng) -> Work:
    """Journals on both sides of a collar with a bolt circle; ring groove, key seat, bore from the end."""
    r1, r2, rc, r3 = u(rng, 10, 14), u(rng, 17, 22), u(rng, 40, 55), u(rng, 18, 26)
    l1, l2, t, l3 = u(rng, 25, 35), u(rng, 30, 50), u(rng, 8, 14), u(rng, 40, 60)
    a, b, c, e = l1, l1 + l2, l1 + l2 + t, l1 + l2 + t + l3
    work = Work(
        revolved([(0, 0), (r1, 0), (r1, a), (r2, a), (r2, b), (rc, b), (rc, c), (r3, c), (r3, e), (0, e)]),
        silent=Work.silent | {"boss", "step"},
    )
    work.note("flange", (0, 0, b), axis=UP, diameter=2 * rc, thickness=t)
    g, w = u(rng, 0.8, 1.5), u(rng, 1.3, 2.5)
    ring = BRepAlgoAPI_Cut(cylinder((0, 0, 5), r1 + 1, w), cylinder((0, 0, 4), r1 - g, w + 2)).Shape()
    work.cut(ring)
    work.note("groove", (0, 0, 5 + w / 2), axis=UP, width=w, depth=g)
    w, deep = u(rng, 5, 7), u(rng, 3, 4)
    if chance(rng):
        length = u(rng, 20, l2 - 8)
        low, foot = (a + b - length) / 2, r2 - deep
        ends = [rod((foot, 0, z), (1, 0, 0), w / 2, 20) for z in (low + w / 2, low + length - w / 2)]
        work.cut(fused(box((foot, -w / 2, low + w / 2), (foot + 20, w / 2, low + length - w / 2)), *ends))
        work.note("slot", (foot, 0, (a + b) / 2), out=(1, 0, 0), along=UP, length=length, width=w)
    else:
        length, foot = u(rng, 15, l3 - 12), r3 - deep
        work.cut(box((foot, -w / 2, e - length), (foot + 20, w / 2, e + 1)))
        work.note("open_slot", (foot, 0, e - length / 2), out=(1, 0, 0), along=UP, length=length, width=w)
    if chance(rng):
        twist_drill(work, (0, 0, e), DOWN, u(rng, 4, 7), u(rng, 20, 60))
    else:
        bore(work, (0, 0, 0), UP, u(rng, 4, 7), e)
    bolt_circle(work, int(rng.integers(4, 9)), u(rng, 3, 4.5), (rc + max(r2, r3)) / 2, b, c)
    return work


def gusset_bracket(rng: Rng) -> Work:
    """A foot and an upright with triangular gussets in the corner; a pad around the upright's bore."""
    length, width, t, t2, height = u(rng, 80, 110), u(rng, 100, 140), u(rng, 8, 12), u(rng, 8, 12), u(rng, 70, 100)
    work = Work(fused(box((0, 0, 0), (length, width, t)), box((0, 0, 0), (t2, width, height))))
    work.silent |= {"flange"}
    g, a, b = u(rng, 4, 6), u(rng, 25, 35), u(rng, 20, 30)
    for y in (0.15 * width, 0.85 * width - g) if chance(rng) else (0.5 * width - g / 2,):
        work.add(prism([(t2, y, t), (t2 + a, y, t), (t2, y, t + b)], (0, g, 0)))
        work.note("rib", box=((t2, y, t), (t2 + a, y + g, t + b)), thickness=g)
    r = u(rng, 4, 6)
    for y in (0.2 * width, 0.5 * width, 0.8 * width):
        x = length - 18
        bore(work, (x, y, 0), UP, r, t, **({"countersink_diameter": 2 * r + 5} if y == 0.5 * width else {}))
        if y == 0.5 * width:
            work.cut(cone((x, y, t - 2.5), r, r + 2.5, 2.5))
    r, pad, h = u(rng, 6, 8), u(rng, 13, 16), u(rng, 3, 6)
    y, z = width / 2, height - 22
    work.add(rod((t2 / 2, y, z), (-1, 0, 0), pad, h + t2 / 2))
    work.note("boss", (0, y, z), out=(-1, 0, 0), diameter=2 * pad, height=h)
    bore(work, (-h, y, z), (1, 0, 0), r, t2 + h)
    if chance(rng):
        s = u(rng, 2, 4)
        work.body = fillet(work.body, s, between((length, 0, 0), (length, 0, t)))
        work.note("fillet", radius=s, length=t)
    return work


def drum(rng: Rng) -> Work:
    """A thick tube: radial holes, plain, counterbored from outside, and a slot through its wall."""
    outer, inner, height = u(rng, 40, 50), u(rng, 22, 28), u(rng, 70, 90)
    work = Work(cylinder((0, 0, 0), outer, height), silent=Work.silent | {"step"})
    if chance(rng):
        bore(work, (0, 0, 0), UP, inner, height)
    else:
        work.cut(rod((0, 0, 12), UP, inner, height))
        work.note("blind_hole", (0, 0, height), out=UP, diameter=2 * inner, depth=height - 12)
        w = u(rng, 8, 12)
        work.cut(box((-60, -w / 2, -1), (60, w / 2, 5)))
        work.note("open_slot", (0, 0, 5), out=DOWN, along=(1, 0, 0), width=w)
    r = u(rng, 3, 5)
    for a in (0.0, 0.9):
        d = (cos(a), sin(a), 0.0)
        work.cut(rod((0, 0, height - 15), d, r, 60))
        work.note("through_hole", (0, 0, height - 15), axis=d, diameter=2 * r)
    d, c = (cos(2.2), sin(2.2), 0.0), u(rng, 6, 8)
    work.cut(rod((0, 0, 30), d, r, 60), rod(along((0, 0, 30), d, outer - 7), d, c, 20))
    work.note("through_hole", (0, 0, 30), axis=d, diameter=2 * r, counterbore_diameter=2 * c)
    d, w, s = (cos(-1.5), sin(-1.5), 0.0), u(rng, 7, 10), u(rng, 20, 30)
    tool = moved(obround((0, 0, 0), s, w, 60), pi / 2, (0, 1, 0))
    work.cut(moved(tool, -1.5, by=(0, 0, 40)))
    work.note("slot", (0, 0, 40), axis=d, along=UP, length=s, width=w)
    return work


def rocker(rng: Rng) -> Work:
    """Two eyes on a bar that is milled thin from both sides; an oil hole into one eye's bore."""
    apart, t, w = u(rng, 120, 150), u(rng, 16, 22), u(rng, 30, 36)
    big, small = u(rng, 24, 28), u(rng, 20, 23)
    work = Work(box((0, -w / 2, -t / 2), (apart, w / 2, t / 2)), silent=Work.silent | {"boss", "lug", "flange"})
    e = t / 2 + u(rng, 3, 6)
    work.add(cylinder((0, 0, -e), big, 2 * e), cylinder((apart, 0, -e), small, 2 * e))
    bore(work, (0, 0, -e), UP, u(rng, 10, 13), 2 * e)
    bore(work, (apart, 0, -e), UP, u(rng, 8, 10), 2 * e)
    web, f = u(rng, 3, 5), u(rng, 3, 5)
    low, high = big + 8, apart - small - 8
    for side, out in ((1, UP), (-1, DOWN)):
        z, mouth = sorted((side * web / 2, side * (e + 1)))
        work.cut(fillet(box((low, -w / 2 + 5, z), (high, w / 2 - 5, mouth)), f, upright))
        length, width, d = high - low, w - 10, (t - web) / 2
        sizes: dict[str, Any] = {
            "length": max(length, width),
            "width": min(length, width),
            "depth": d,
            "corner_radius": f,
        }
        work.note("pocket", ((low + high) / 2, 0, side * web / 2), out=out, **sizes)
    if web <= THIN_WEB * min(high - low, w - 10):
        work.note("web", thickness=web)
    work.cut(rod((-big - 1, 0, 0), (1, 0, 0), 2, big))
    work.note("through_hole", (0, 0, 0), axis=(1, 0, 0), diameter=4)
    return work


def yoke(rng: Rng) -> Work:
    """A fork of two lugs on a block, one bore through both; a shank behind."""
    w, gap, t, reach, back = u(rng, 30, 40), u(rng, 14, 20), u(rng, 9, 13), u(rng, 28, 36), u(rng, 20, 25)
    work = Work(box((-back, -w / 2, -gap / 2 - t), (0, w / 2, gap / 2 + t)), silent=Work.silent | {"open_slot"})
    r = u(rng, 5, 8)
    for z in (-gap / 2 - t, gap / 2):
        work.add(fused(box((-1, -w / 2, z), (reach, w / 2, z + t)), cylinder((reach, 0, z), w / 2, t)))
        work.note("lug", (reach, 0, z), (reach, 0, z + t), axis=UP, bore_diameter=2 * r, width=w, thickness=t)
    work.cut(cylinder((reach, 0, -100), r, 200))
    ends = ((reach, 0, gap / 2 + t), (reach, 0, -gap / 2 - t))
    work.note("through_hole", *ends, axis=UP, diameter=2 * r, depth=gap + 2 * t)
    shank, h = u(rng, 9, 12), u(rng, 25, 40)
    work.add(rod((-back, 0, 0), (-1, 0, 0), shank, h))
    work.note("boss", (-back, 0, 0), out=(-1, 0, 0), diameter=2 * shank, height=h)
    if chance(rng):
        twist_drill(work, (-back - h, 0, 0), (1, 0, 0), 4, h)
    return work


def seamed(rng: Rng) -> Work:
    """Three blocks joined with their seams left in: what is cut runs across seams."""
    height, w = u(rng, 30, 40), u(rng, 70, 90)
    body = box((0, 0, 0), (60, w, height))
    for x0, x1 in ((60, 120), (120, 200)):
        body = BRepAlgoAPI_Fuse(body, box((x0, 0, 0), (x1, w, height))).Shape()
    work = Work(body)
    bore(work, (60, 15, 0), UP, u(rng, 4, 7), height)
    a, b, d, c = u(rng, 60, 80), u(rng, 20, 26), u(rng, 8, 14), u(rng, 4, 6)
    work.cut(
        fillet(box((110 - a / 2, w / 2 - b / 2, height - d), (110 + a / 2, w / 2 + b / 2, height + 1)), c, upright)
    )
    work.note("pocket", (110, w / 2, height - d), out=UP, length=a, width=b, depth=d, corner_radius=c)
    s, d = u(rng, 6, 10), u(rng, 5, 8)
    work.cut(box((-1, w - 18, height - d), (201, w - 18 + s, height + 1)))
    work.note("open_slot", (100, w - 18 + s / 2, height - d), out=UP, length=200, width=s, depth=d)
    a, d = u(rng, 8, 12), u(rng, 8, 12)
    work.cut(box((-1, -1, -1), (201, a, d)))
    work.note("step", (100, a / 2, d), (100, a, d / 2), length=200)
    twist_drill(work, (120, 0, height * 0.7), (0, 1, 0), u(rng, 2, 3), 9)
    return work


def edges(rng: Rng) -> Work:
    """A block whose edges and corners are cut off, rounded, stepped; under it slots that cross or a dovetail."""
    a, b, c = u(rng, 140, 170), u(rng, 100, 120), u(rng, 45, 55)
    work = Work(box((0, 0, 0), (a, b, c)), silent=Work.silent - {"fillet", "chamfer"})
    s, d = u(rng, 10, 16), u(rng, 8, 14)
    work.cut(box((-1, -1, c - d), (a + 1, s, c + 1)))
    work.note("step", (a / 2, s / 2, c - d), (a / 2, s, c - d / 2), along=(1, 0, 0), length=a)
    e, f, g = u(rng, 20, 30), u(rng, 20, 30), u(rng, 10, 18)
    work.cut(box((a - e, b - f, c - g), (a + 1, b + 1, c + 1)))
    work.note("step", (a - e / 2, b - f / 2, c - g), (a - e, b - f / 2, c - g / 2), (a - e / 2, b - f, c - g / 2))
    k, r = u(rng, 3, 6), u(rng, 4, 8)
    work.body = chamfer(work.body, k, between((0, 0, 0), (0, b, 0)))
    work.note("chamfer", along=(0, 1, 0), width=k * 2**0.5)
    work.body = fillet(work.body, r, between((0, b, k), (0, b, c)))
    work.note("fillet", radius=r)
    w, d = u(rng, 12, 20), u(rng, 10, 14)
    x = 0.45 * a
    if chance(rng):
        lean = tan(radians(30)) * d
        work.cut(
            prism(
                [(x - w / 2, -1, -1e-9), (x + w / 2, -1, 0), (x + w / 2 + lean, -1, d), (x - w / 2 - lean, -1, d)],
                (0, b + 2, 0),
            )
        )
        work.note("open_slot", (x, b / 2, d), out=DOWN, along=(0, 1, 0), length=b, depth=d)
    else:
        work.cut(box((x - w / 2, -1, -1), (x + w / 2, b + 1, d)))
        work.note("open_slot", (x, b / 2, d), out=DOWN, along=(0, 1, 0), length=b, width=w, depth=d)
        if chance(rng):
            v, y, shallow = u(rng, 8, 12), b / 2, u(rng, 4, 7)
            work.cut(box((-1, y - v / 2, -1), (a + 1, y + v / 2, shallow)))
            start = max(k - shallow, 0)  # in the chamfer
            sizes: dict[str, Any] = {"length": a - start, "width": v, "depth": shallow}
            work.note("open_slot", ((start + a) / 2, y, shallow), out=DOWN, along=(1, 0, 0), **sizes)
    v = u(rng, 5, 8)
    y = 0.5 * b
    work.cut(prism([(-1, y - v, c), (-1, y + v, c), (-1, y, c - v)], (0.7 * a, 0, 0)))
    work.note("open_slot", along=(1, 0, 0), depth=v)
    return work


def crossing_ribs(rng: Rng) -> Work:
    """Ribs that cross on a plate, with a bored hub on the crossing or without; a thin pocket under it leaves a web."""
    a, b, t, h, g = u(rng, 120, 150), u(rng, 90, 110), u(rng, 12, 15), u(rng, 18, 30), u(rng, 3, 5)
    work = Work(box((0, 0, 0), (a, b, t)))
    x, y = a / 2, b / 2
    work.add(box((0, y - g / 2, t), (a, y + g / 2, t + h)), box((x - g / 2, 0, t), (x + g / 2, b, t + h)))
    if chance(rng):
        r, more = u(rng, 12, 16), u(rng, 2, 6)
        work.add(cylinder((x, y, t), r, h + more))
        work.note("boss", (x, y, t), out=UP, diameter=2 * r, height=h + more)
        bore(work, (x, y, 0), UP, u(rng, 5, 8), t + h + more)
    work.note("rib", out=UP, along=(1, 0, 0), thickness=g, height=h, length=a)
    work.note("rib", out=UP, along=(0, 1, 0), thickness=g, height=h, length=b)
    web = u(rng, 2, 3)
    work.cut(fillet(box((10, 10, -1), (x - 22, b - 10, t - web)), 5, upright))
    length, width = b - 20, x - 32
    sizes: dict[str, Any] = {
        "length": max(length, width),
        "width": min(length, width),
        "depth": t - web,
        "corner_radius": 5.0,
    }
    work.note("pocket", ((x - 12) / 2, y, t - web), out=DOWN, **sizes)
    return work


FAMILIES = (
    flanged_shaft,
    gusset_bracket,
    drum,
    rocker,
    yoke,
    seamed,
    edges,
    crossing_ribs,
)
