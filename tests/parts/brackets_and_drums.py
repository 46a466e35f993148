"""Parts of a fourth hand, written from what the tables' comments say and nothing else: flanged shafts, gusseted
brackets, drums.

They are mirrored, scaled, turned and moved as a whole.  What a plain convention does not settle is not stated.
"""

from __future__ import annotations

from dataclasses import replace
from math import cos, pi, radians, sin, tan
from typing import Any

import numpy as np
from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut
from OCP.BRepBuilderAPI import BRepBuilderAPI_Transform
from OCP.BRepPrimAPI import BRepPrimAPI_MakeCone
from OCP.gp import gp_Ax1, gp_Ax2, gp_Dir, gp_Pnt, gp_Trsf, gp_Vec

from tests.parts.curved_parts import revolved
from tests.parts.housings_and_shafts import Work
from tests.parts.solids import Point, Rng, between, box, carried, cone, cylinder, fillet, obround, prism
from tests.poses import pose_of

UP: Point = (0.0, 0.0, 1.0)
DOWN: Point = (0.0, 0.0, -1.0)
DRILL = radians(118)
COUNTS_AND_ANGLES = ("count", "tip_angle", "draft_angle", "countersink_angle", "angle", "rows", "columns")


def foundry(seed: int) -> Work:
    """The part of a seed."""
    rng = np.random.default_rng(40_000 + seed)
    return placed(FAMILIES[seed % len(FAMILIES)](rng), rng)


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
    work.fuse(*shapes[1:])
    return work.body


def moved(shape: Any, turn: float = 0.0, axis: Point = UP, by: Point = (0.0, 0.0, 0.0)) -> Any:
    """Turned about an axis through the origin, then moved."""
    return carried(shape, pose_of(by, turn * np.array(axis)))


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
        work.fuse(prism([(t2, y, t), (t2 + a, y, t), (t2, y, t + b)], (0, g, 0)))
        work.note("rib", box=((t2, y, t), (t2 + a, y + g, t + b)), thickness=g)
    r = u(rng, 4, 6)
    for y in (0.2 * width, 0.5 * width, 0.8 * width):
        x = length - 18
        bore(work, (x, y, 0), UP, r, t, **({"countersink_diameter": 2 * r + 5} if y == 0.5 * width else {}))
        if y == 0.5 * width:
            work.cut(cone((x, y, t - 2.5), r, r + 2.5, 2.5))
    r, pad, h = u(rng, 6, 8), u(rng, 13, 16), u(rng, 3, 6)
    y, z = width / 2, height - 22
    work.fuse(rod((t2 / 2, y, z), (-1, 0, 0), pad, h + t2 / 2))
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


FAMILIES = (flanged_shaft, gusset_bracket, drum)
