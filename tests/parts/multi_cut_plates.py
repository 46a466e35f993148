"""Parts of a fifth hand: what is finished by hand and cut twice.  Plates with six stations of things that cut into one
another, are rounded all over or stand on an edge; wheels, tees, stairs, shells, wedges.
"""

from __future__ import annotations

from math import cos, hypot, pi, sin
from typing import Any

import numpy as np
from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut

from tests.parts.brackets_and_castings import (
    DOWN,
    UP,
    bolt_circle,
    bore,
    chance,
    fused,
    moved,
    placed,
    rod,
    twist_drill,
    u,
)
from tests.parts.curved_parts import revolved, sphere
from tests.parts.flanges_and_housings import Work
from tests.parts.solids import (
    Floats,
    Point,
    Rng,
    at_height,
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

CELL = 80.0
HEIGHT = 40.0


def jobshop(seed: int) -> Work:
    """The part of a seed."""
    rng = np.random.default_rng(50_000 + seed)
    work = (plate, plate, FAMILIES[seed // 3 % len(FAMILIES)])[seed % 3](rng)
    return placed(work, rng) if chance(rng) else work


def plate(rng: Rng) -> Work:
    work = Work(box((0, 0, 0), (3 * CELL, 2 * CELL, HEIGHT)), silent=Work.silent | {"body"})
    for k, which in enumerate(rng.permutation(len(STATIONS))[:6].tolist()):
        STATIONS[which](work, rng, (k % 3 + 0.5) * CELL, (k // 3 + 0.5) * CELL)
    return work


def near(x: float, y: float, z: float) -> Any:
    """Edges of one station at one height."""
    level = at_height(z)
    return lambda p, q: level(p, q) and abs((p + q)[0] / 2 - x) < 39 and abs((p + q)[1] / 2 - y) < 39


def around(x: float, y: float, z: float, r: float) -> Any:
    """The circle of a radius about a point."""

    def wanted(p: Floats, q: Floats) -> bool:
        ends = [abs(hypot(e[0] - x, e[1] - y) - r) + abs(e[2] - z) for e in (p, q)]
        return bool(max(ends) < 1e-6)

    return wanted


def _finished(work: Work, rng: Rng, x: float, y: float) -> None:
    """A pocket and a boss in it, rounded at every edge."""
    a, b, d, c, f = u(rng, 28, 34), u(rng, 22, 28), u(rng, 14, 18), u(rng, 6, 9), u(rng, 2, 3)
    r, h, s = u(rng, 7, 9), u(rng, 8, 12), u(rng, 1, 1.5)
    tool = fillet(box((x - a, y - b, HEIGHT - d), (x + a, y + b, HEIGHT + 1)), c, upright)
    tool = fillet(tool, f, at_height(HEIGHT - d))
    work.cut(tool)
    if chance(rng):
        work.body = fillet(work.body, s, near(x, y, HEIGHT))
    work.note("pocket", (x, y, HEIGHT - d), out=UP, length=2 * a, width=2 * b, depth=d, corner_radius=c)
    work.add(cylinder((x, y, HEIGHT - d), r, h))
    work.body = fillet(work.body, f, around(x, y, HEIGHT - d, r))
    if chance(rng):
        work.body = chamfer(work.body, 1, around(x, y, HEIGHT - d + h, r))
    work.note("boss", (x, y, HEIGHT - d), out=UP, diameter=2 * r, height=h)
    twist_drill(work, (x, y, HEIGHT - d + h), DOWN, u(rng, 2, 4), h)


def _two_pockets(work: Work, rng: Rng, x: float, y: float) -> None:
    """The deeper one cuts a wall of the other away."""
    a, b, d = u(rng, 16, 18), u(rng, 12, 16), u(rng, 6, 10)
    deep, c = d + u(rng, 5, 9), u(rng, 3, 5)
    work.cut(box((x - 2 * a, y - b, HEIGHT - d), (x, y + b, HEIGHT + 1)))
    work.cut(fillet(box((x - 5, y - 1.5 * b, HEIGHT - deep), (x + 2 * a, y + 1.5 * b, HEIGHT + 1)), c, upright))
    sides = sorted((2 * a + 5, 3 * b))
    middle = (x + a - 2.5, y, HEIGHT - deep)
    work.note("pocket", middle, out=UP, length=sides[1], width=sides[0], depth=deep, corner_radius=c)
    work.note("pocket", out=UP, depth=d)


def _ell(work: Work, rng: Rng, x: float, y: float) -> None:
    """A pocket of the form of an L, of two cuts of one depth; sharp or with corners rounded."""
    d, c = u(rng, 8, 14), u(rng, 3, 5)
    tool = fused(
        box((x - 30, y - 30, HEIGHT - d), (x + 30, y - 8, HEIGHT + 1)),
        box((x - 30, y - 30, HEIGHT - d), (x - 6, y + 30, HEIGHT + 1)),
    )
    work.cut(fillet(tool, c, upright) if chance(rng) else tool)
    work.note("pocket", (x, y, HEIGHT - d), out=UP, length=60, width=60, depth=d)


def _hole_in_wall(work: Work, rng: Rng, x: float, y: float) -> None:
    a, b, d, c, r = u(rng, 22, 26), u(rng, 18, 22), u(rng, 8, 14), u(rng, 4, 6), u(rng, 4, 6)
    work.cut(fillet(box((x - a, y - b, HEIGHT - d), (x + a, y + b, HEIGHT + 1)), c, upright))
    work.note("pocket", (x, y, HEIGHT - d), out=UP, length=2 * a, width=2 * b, depth=d, corner_radius=c)
    work.cut(rod((x + a + 1, y, -1), UP, r, HEIGHT + 2))
    work.note("through_hole", (x + a + 1, y, 0), axis=UP, diameter=2 * r)


def _channel(work: Work, rng: Rng, x: float, y: float) -> None:
    """A shallow channel joins two pockets."""
    d, w, shallow, c = u(rng, 12, 16), u(rng, 6, 10), u(rng, 4, 8), u(rng, 3, 5)
    for side in (-1, 1):
        low, high = sorted((x + side * 12, x + side * 34))
        work.cut(fillet(box((low, y - 16, HEIGHT - d), (high, y + 16, HEIGHT + 1)), c, upright))
        work.note("pocket", (x + side * 23, y, HEIGHT - d), out=UP, length=32, width=22, depth=d, corner_radius=c)
    work.cut(box((x - 15, y - w / 2, HEIGHT - shallow), (x + 15, y + w / 2, HEIGHT + 1)))
    work.note("open_slot", (x, y, HEIGHT - shallow), out=UP, along=(1, 0, 0), length=24, width=w, depth=shallow)


def _crossed_slots(work: Work, rng: Rng, x: float, y: float) -> None:
    """A round-ended slot across a deeper one."""
    s, w, d, g = u(rng, 50, 60), u(rng, 10, 14), u(rng, 5, 8), u(rng, 3, 6)
    work.cut(obround((x, y, HEIGHT - d - g), s, w, d + g + 1))
    work.note("slot", (x, y, HEIGHT - d - g), out=UP, along=(1, 0, 0), length=s, width=w, depth=d + g)
    s, w = u(rng, 40, 60), u(rng, 8, 12)
    work.cut(moved(obround((0, 0, HEIGHT - d), s, w, d + 1), pi / 2, by=(x, y, 0)))
    work.note("slot", (x, y, HEIGHT - d), out=UP, along=(0, 1, 0), length=s, width=w, depth=d)


def _drilled_rib(work: Work, rng: Rng, x: float, y: float) -> None:
    g, length, h, r = u(rng, 4, 6), u(rng, 50, 65), u(rng, 18, 25), u(rng, 3, 5)
    work.add(box((x - length / 2, y - g / 2, HEIGHT), (x + length / 2, y + g / 2, HEIGHT + h)))
    if chance(rng):
        work.body = fillet(work.body, 2, near(x, y, HEIGHT))
    work.note("rib", (x, y, HEIGHT), out=UP, along=(1, 0, 0), thickness=g, length=length, height=h)
    for side in (-1, 1):
        bore(work, (x + side * length / 4, y - g / 2, HEIGHT + 0.6 * h), (0, 1, 0), r, g)


def _stepped_bore(work: Work, rng: Rng, x: float, y: float) -> None:
    r = u(rng, 5, 8)
    r2, r3, d2, d3 = r + u(rng, 3, 5), r + u(rng, 7, 12), u(rng, 15, 22), u(rng, 6, 10)
    work.cut(rod((x, y, -1), UP, r, 50), rod((x, y, HEIGHT - d2), UP, r2, 50), rod((x, y, HEIGHT - d3), UP, r3, 50))
    work.note("through_hole", (x, y, HEIGHT), out=UP, diameter=2 * r, depth=HEIGHT, counterbore_diameter=2 * r3)
    r, lip, x = u(rng, 3, 4), u(rng, 1.5, 3), x + 28
    work.cut(rod((x, y, -1), UP, r, 50), cone((x, y, HEIGHT - lip), r, r + lip, lip), cone((x, y, 0), r + lip, r, lip))
    at = ((x, y, HEIGHT), (x, y, 0))
    work.note("through_hole", *at, axis=UP, diameter=2 * r, depth=HEIGHT, countersink_diameter=2 * (r + lip))


def _bottoms(work: Work, rng: Rng, x: float, y: float) -> None:
    """Blind holes: with a round bottom, a flat one, a chamfered mouth; one with a cross hole above its bottom."""
    r, d = u(rng, 5, 8), u(rng, 14, 20)
    work.cut(rod((x - 20, y, HEIGHT - d), UP, r, 50), sphere((x - 20, y, HEIGHT - d), r))
    work.note("blind_hole", (x - 20, y, HEIGHT), out=UP, diameter=2 * r)
    r, d = u(rng, 5, 8), u(rng, 20, 25)
    work.cut(rod((x, y, HEIGHT - d), UP, r, 50))
    work.note("blind_hole", (x, y, HEIGHT), out=UP, diameter=2 * r, depth=d)
    r, d = u(rng, 5, 8), u(rng, 20, 26)
    twist_drill(work, (x + 22, y, HEIGHT), DOWN, r, d)
    work.cut(cone((x + 22, y, HEIGHT - 1), r, r + 1, 1))
    small = u(rng, 2, 3)
    work.cut(rod((x, y, HEIGHT - 14), (1, 0, 0), small, 22))
    work.note("through_hole", (x, y, HEIGHT - 14), axis=(1, 0, 0), diameter=2 * small)


def _six_sided(work: Work, rng: Rng, x: float, y: float) -> None:
    """A hexagonal socket with a bore under it, a hexagonal opening."""
    r, d, hole = u(rng, 12, 16), u(rng, 8, 14), u(rng, 3, 6)
    ring = [(cos(k * pi / 3), sin(k * pi / 3)) for k in range(6)]
    work.cut(prism([(x - 18 + r * p, y + r * q, HEIGHT - d) for p, q in ring], (0, 0, d + 1)))
    work.note("pocket", (x - 18, y, HEIGHT - d), out=UP, depth=d)
    bore(work, (x - 18, y, 0), UP, hole, HEIGHT - d)
    work.cut(prism([(x + 18 + r * p, y + r * q, -1) for p, q in ring], (0, 0, HEIGHT + 2)))
    work.note("duct", (x + 18, y, HEIGHT), (x + 18, y, 0), axis=UP, depth=HEIGHT)


def _square_boss(work: Work, rng: Rng, x: float, y: float) -> None:
    """With rounded edges, a slot sawn through its top, or a pocket in it; thinner walls around that would be ribs."""
    a, b, h, c = u(rng, 22, 26), u(rng, 16, 20), u(rng, 10, 15), u(rng, 3, 5)
    work.add(fillet(box((x - a, y - b, HEIGHT - 1), (x + a, y + b, HEIGHT + h)), c, upright))
    work.note("boss", (x, y, HEIGHT), out=UP, along=(1, 0, 0), length=2 * a, width=2 * b, height=h)
    d, w = u(rng, 4, 8), u(rng, 6, 10)
    if chance(rng):
        work.cut(box((x - w / 2, y - b - 1, HEIGHT + h - d), (x + w / 2, y + b + 1, HEIGHT + h + 1)))
        work.note("open_slot", (x, y, HEIGHT + h - d), out=UP, along=(0, 1, 0), length=2 * b, width=w, depth=d)
    else:
        work.cut(fillet(box((x - a + 9, y - b + 9, HEIGHT), (x + a - 9, y + b - 9, HEIGHT + h + 1)), 2, upright))
        sizes: dict[str, Any] = {"length": 2 * a - 18, "width": 2 * b - 18, "depth": h, "corner_radius": 2}
        work.note("pocket", (x, y, HEIGHT), out=UP, **sizes)


def _ear(work: Work, rng: Rng, x: float, y: float) -> None:
    """A bored plate that stands upright, round at its top, with or without a rounded foot."""
    w, t, h, r = u(rng, 24, 36), u(rng, 8, 12), u(rng, 20, 26), u(rng, 4, 7)
    work.add(
        fused(
            box((x - w / 2, y - t / 2, HEIGHT), (x + w / 2, y + t / 2, HEIGHT + h)),
            cylinder((x, y - t / 2, HEIGHT + h), w / 2, t, (0, 1, 0)),
        )
    )
    if chance(rng):
        work.body = fillet(work.body, 2, near(x, y, HEIGHT))
    work.note("lug", (x, y, HEIGHT + h), axis=(0, 1, 0), bore_diameter=2 * r, width=w, thickness=t)
    bore(work, (x, y - t / 2, HEIGHT + h), (0, 1, 0), r, t)


def _kidneys(work: Work, rng: Rng, x: float, y: float) -> None:
    """A bored centre and bent slots around it."""
    ring, w, sweep = u(rng, 22, 26), u(rng, 6, 9), u(rng, 0.8, 1.3)
    bore(work, (x, y, 0), UP, u(rng, 6, 9), HEIGHT)
    for a in (0.4, 0.4 + pi):
        outer = revolved([(ring - w / 2, -1), (ring + w / 2, -1), (ring + w / 2, 50), (ring - w / 2, 50)], sweep)
        ends = [cylinder((ring * cos(e), ring * sin(e), -1), w / 2, 51) for e in (0.0, sweep)]
        work.cut(moved(fused(outer, *ends), a, by=(x, y, 0)))
        work.note("slot", axis=UP, width=w, bend_radius=ring, length=ring * sweep + w, depth=HEIGHT)


def _patterns(work: Work, rng: Rng, x: float, y: float) -> None:
    """A row of five holes and a circle of six blind ones."""
    r, pitch, d = u(rng, 2, 3), u(rng, 9, 12), u(rng, 8, 12)
    for k in range(5):
        bore(work, (x + (k - 2) * pitch, y - 34, 0), UP, r, HEIGHT)
    work.note("linear_pattern", count=5, pitch=pitch, hole_diameter=2 * r)
    circle = u(rng, 15, 20)
    for k in range(6):
        a = k * pi / 3 + 0.2
        twist_drill(work, (x + circle * cos(a), y + 8 + circle * sin(a), HEIGHT), DOWN, r, d)
    work.note("circular_pattern", (x, y + 8, HEIGHT), out=UP, count=6, pattern_diameter=2 * circle)


def _two_levels(work: Work, rng: Rng, x: float, y: float) -> None:
    """A boss that stands half in a pocket's floor and against its wall."""
    a, b, d, r, h = u(rng, 26, 30), u(rng, 20, 24), u(rng, 8, 12), u(rng, 7, 9), u(rng, 4, 8)
    work.cut(box((x - a, y - b, HEIGHT - d), (x + a, y + b, HEIGHT + 1)))
    work.note("pocket", (x, y, HEIGHT - d), out=UP, length=2 * a, width=2 * b, depth=d)
    work.add(cylinder((x + a, y, HEIGHT - d), r, d + h))
    work.note("boss", axis=UP, diameter=2 * r)


def _open_round(work: Work, rng: Rng, x: float, y: float) -> None:
    """A slot from the nearest side with a round end, a floor with or without a hole in it."""
    w, reach, d = u(rng, 14, 22), u(rng, 30, 50), u(rng, 10, 16)
    side, edge = (-1, 0.0) if y < CELL else (1, 2 * CELL)
    end = edge - side * (reach - w / 2)
    low, high = sorted((end, edge + side))
    top = HEIGHT + 1
    work.cut(
        fused(box((x - w / 2, low, HEIGHT - d), (x + w / 2, high, top)), cylinder((x, end, HEIGHT - d), w / 2, d + 1))
    )
    work.note("open_slot", axis=UP, along=(0, 1, 0), width=w, length=reach, depth=d)
    if chance(rng):
        bore(work, (x, end, 0), UP, u(rng, 3, 5), HEIGHT - d)


STATIONS = (
    _finished,
    _two_pockets,
    _ell,
    _hole_in_wall,
    _channel,
    _crossed_slots,
    _drilled_rib,
    _stepped_bore,
    _bottoms,
    _six_sided,
    _square_boss,
    _ear,
    _kidneys,
    _patterns,
    _two_levels,
    _open_round,
)


def wheel(rng: Rng) -> Work:
    """Rim, hub and spokes: windows between spokes, bored hub higher than the rim, slots in the rim."""
    outer, rim, hub, t, n = u(rng, 70, 90), u(rng, 8, 12), u(rng, 18, 22), u(rng, 12, 16), int(rng.integers(3, 6))
    work = Work(cylinder((0, 0, 0), outer, t), silent=Work.silent | {"rib", "boss", "flange"})
    spoke, c = u(rng, 10, 14), u(rng, 2, 4)
    window = revolved([(hub + 6, -1), (outer - rim, -1), (outer - rim, t + 1), (hub + 6, t + 1)])
    bars = [moved(box((0, -spoke / 2, -2), (outer, spoke / 2, t + 2)), 2 * pi * k / n) for k in range(n)]
    for bar in bars:
        window = BRepAlgoAPI_Cut(window, bar).Shape()
    work.cut(fillet(window, c, upright) if chance(rng) else window)
    for _ in range(n):
        work.note("duct", axis=UP, depth=t)
    h = u(rng, 5, 12)
    work.add(cylinder((0, 0, 0), hub, t + h))
    bore(work, (0, 0, 0), UP, u(rng, 8, 12), t + h)
    w, d, m = u(rng, 4, 6), u(rng, 3, 5), int(rng.integers(4, 9))
    for k in range(m):
        a = 2 * pi * (k + 0.5) / m + 0.1
        work.cut(moved(box((outer - d, -w / 2, -1), (outer + 5, w / 2, t + 1)), a))
        at = ((outer - d) * cos(a), (outer - d) * sin(a), t / 2)
        work.note("open_slot", at, out=(cos(a), sin(a), 0), along=UP, width=w, length=t)
    return work


def tee(rng: Rng) -> Work:
    """Two tubes that meet square, with discs at the ends and a bolt circle in one of them."""
    outer, inner, branch, small = u(rng, 22, 28), u(rng, 14, 18), u(rng, 15, 19), u(rng, 8, 11)
    length, reach, disc, t = u(rng, 140, 180), u(rng, 60, 80), u(rng, 42, 50), u(rng, 8, 12)
    work = Work(cylinder((0, 0, 0), outer, length), silent=Work.silent | {"boss"})
    work.add(rod((0, 0, length / 2), (1, 0, 0), branch, reach))
    for z in (0.0, length - t):
        work.add(cylinder((0, 0, z), disc, t))
        work.note("flange", (0, 0, z), axis=UP, diameter=2 * disc, thickness=t)
    work.add(rod((reach - t, 0, length / 2), (1, 0, 0), branch + 12, t))
    work.note("flange", (reach, 0, length / 2), axis=(1, 0, 0), diameter=2 * branch + 24, thickness=t)
    bore(work, (0, 0, 0), UP, inner, length)
    work.cut(rod((0, 0, length / 2), (1, 0, 0), small, reach + 1))
    work.note("through_hole", (reach, 0, length / 2), axis=(1, 0, 0), diameter=2 * small)
    bolt_circle(work, int(rng.integers(5, 9)), u(rng, 2.5, 4), (disc + outer) / 2 + 1, 0, t)
    return work


def stairs(rng: Rng) -> Work:
    """Steps one above the other, the inner corners rounded or not; a hole in each tread; all upper edges bevelled."""
    a, b, n, h, w = u(rng, 80, 110), u(rng, 60, 80), 2, u(rng, 10, 16), u(rng, 20, 25)
    work = Work(box((0, 0, 0), (a, b, 60)), silent=Work.silent - {"chamfer"})
    f = u(rng, 1.5, 3)
    for k in range(n):
        tool = box((-1, -1, 60 - (n - k) * h), (a + 1, (k + 1) * w, 61))
        z, y = 60 - (n - k) * h, (k + 1) * w
        work.cut(fillet(tool, f, between((-1, y, z), (a + 1, y, z))) if chance(rng) else tool)
        ends = ((a / 2, y - w / 2, z), (a / 2, y, z + h / 2))
        work.note("step", *ends, along=(1, 0, 0), length=a)
        twist_drill(work, (a / 3, y - w / 2 - 2, z), DOWN, u(rng, 2, 4), 9)
    bevel = u(rng, 1, 2)
    top = 60.0
    low = n * w
    loop = [((0.0, low), (a, low)), ((a, low), (a, b)), ((a, b), (0.0, b)), ((0.0, b), (0.0, low))]

    def wanted(p: Floats, q: Floats) -> bool:
        return any(between((*s, top), (*e, top))(p, q) for s, e in loop)

    work.body = chamfer(work.body, bevel, wanted)
    for _ in loop:
        work.note("chamfer", width=bevel * 2**0.5)
    return work


def shell(rng: Rng) -> Work:
    """A thin-walled box, rounded outside and in, with cylinders for screws in its corners."""
    a, b, h, t, c = u(rng, 80, 120), u(rng, 60, 75), u(rng, 25, 40), u(rng, 2, 3), u(rng, 9, 12)
    work = Work(fillet(box((0, 0, 0), (a, b, h)), c, upright), silent=Work.silent | {"flange"})
    if chance(rng):
        work.body = fillet(work.body, c / 2, at_height(0))
    work.cut(fillet(box((t, t, t), (a - t, b - t, h + 1)), c - t, upright))
    work.note("pocket", (a / 2, b / 2, t), out=UP, length=a - 2 * t, width=b - 2 * t, depth=h - t, corner_radius=c - t)
    for x in (22.0, a - 22):
        work.add(cylinder((x, b / 2, t), 5, h - t - 4))
        work.note("boss", (x, b / 2, t), out=UP, diameter=10, height=h - t - 4)
        twist_drill(work, (x, b / 2, h - 4), DOWN, 2, h - 12)
    r = u(rng, 4, 6)
    bore(work, (a / 2, 0, h / 2), (0, 1, 0), r, t)
    w, s = u(rng, 6, 9), u(rng, 16, 24)
    work.cut(moved(obround((0, 0, -1), s, w, t + 2), pi / 2, (1, 0, 0), (a / 2, b, h / 2)))
    work.note("slot", (a / 2, b, h / 2), (a / 2, b - t, h / 2), axis=(0, 1, 0), length=s, width=w, depth=t)
    return work


def wedge(rng: Rng) -> Work:
    """A slope with a spotface cut level, a hole straight down, one square to it, a pocket and a slot square to it."""
    a, b, low, high = u(rng, 150, 170), u(rng, 90, 110), 25.0, u(rng, 60, 75)
    body = prism([(0, 0, 0), (a, 0, 0), (a, 0, high), (0, 0, low)], (0, b, 0))
    work = Work(body, silent=Work.silent | {"body"})
    slope = (high - low) / a
    n = (-slope / hypot(slope, 1), 0.0, 1 / hypot(slope, 1))
    into = (-n[0], 0.0, -n[2])

    def on(x: float, y: float) -> Point:
        return (x, y, low + slope * x)

    r, wide = u(rng, 3, 5), u(rng, 8, 11)
    x, y = 0.2 * a, 0.25 * b
    z = low + slope * (x - wide) - 2
    work.cut(rod((x, y, -1), UP, r, 200), rod((x, y, z), UP, wide, 200))
    work.note("through_hole", (x, y, 0), axis=UP, diameter=2 * r, counterbore_diameter=2 * wide)
    work.cut(rod((0.2 * a, 0.7 * b, -1), UP, r, 200))
    work.note("through_hole", (0.2 * a, 0.7 * b, 0), axis=UP, diameter=2 * r)
    twist_drill(work, on(0.45 * a, 0.2 * b), into, u(rng, 3, 5), 15)
    p, q, d, c = u(rng, 30, 36), u(rng, 22, 28), u(rng, 6, 10), u(rng, 3, 5)
    tool = fillet(box((-p / 2, -q / 2, -d), (p / 2, q / 2, 5)), c, upright)
    x, y, z = on(0.6 * a, 0.6 * b)
    work.cut(moved(tool, -np.arctan(slope), (0, 1, 0), (x, y, z)))
    floor = (x + d * into[0], y, z + d * into[2])
    work.note("pocket", floor, out=n, length=p, width=q, depth=d, corner_radius=c)
    w, d = u(rng, 8, 12), u(rng, 5, 8)
    x, y, z = on(0.85 * a, b / 2)
    work.cut(moved(box((-w / 2, -b, -d), (w / 2, b, 9)), -np.arctan(slope), (0, 1, 0), (x, y, z)))
    floor = (x + d * into[0], y, z + d * into[2])
    work.note("open_slot", floor, out=n, along=(0, 1, 0), length=b, width=w, depth=d)
    return work


def spider(rng: Rng) -> Work:
    """A hub on a disc with an odd number of ribs to the rim; foot of the ribs rounded or not."""
    outer, t, hub, h, g, n = u(rng, 70, 85), u(rng, 8, 12), u(rng, 14, 18), u(rng, 20, 28), u(rng, 4, 6), 3
    n += 2 * int(rng.integers(0, 2))
    work = Work(cylinder((0, 0, 0), outer, t), silent=Work.silent | {"flange"})
    bars = [moved(box((0, -g / 2, t), (outer - 6, g / 2, t + h)), 2 * pi * k / n) for k in range(n)]
    work.add(*bars, cylinder((0, 0, t), hub, h + 5))
    work.note("boss", (0, 0, t), out=UP, diameter=2 * hub, height=h + 5)
    for k in range(n):
        a = 2 * pi * k / n
        work.note("rib", out=UP, along=(cos(a), sin(a), 0), thickness=g, height=h)
    bore(work, (0, 0, 0), UP, u(rng, 6, 9), t + h + 5)
    ring = outer - 20
    r = u(rng, 3, 4)
    for k in range(n):
        a = 2 * pi * (k + 0.5) / n
        bore(work, (ring * cos(a), ring * sin(a), 0), UP, r, t)
    work.note("circular_pattern", count=n, pattern_diameter=2 * ring)
    return work


def bar(rng: Rng) -> Work:
    """Round stock: a hexagonal head, a cross hole, two flats, a slot across the end, a ball groove along it."""
    r, length, head, across = u(rng, 12, 16), u(rng, 90, 120), u(rng, 10, 14), u(rng, 22, 26)
    ring = [(across * cos(k * pi / 3), across * sin(k * pi / 3), 0.0) for k in range(6)]
    work = Work(fused(prism(ring, (0, 0, head)), cylinder((0, 0, 0), r, head + length)))
    work.silent |= {"boss", "flange", "step"}
    k = u(rng, 2, 3.5)
    work.cut(rod((-50, 0, head + 0.3 * length), (1, 0, 0), k, 100))
    work.note("through_hole", (0, 0, head + 0.3 * length), axis=(1, 0, 0), diameter=2 * k)
    end, w, d = head + length, u(rng, 3, 5), u(rng, 4, 7)
    work.cut(box((-50, -w / 2, end - d), (50, w / 2, end + 1)))
    work.note("open_slot", (0, 0, end - d), out=UP, along=(1, 0, 0), width=w, depth=d)
    g, z = u(rng, 2, 3), head + 0.6 * length
    work.cut(fused(rod((r, 0, z), UP, g, 15), sphere((r, 0, z), g), sphere((r, 0, z + 15), g)))
    work.note("slot", axis=(1, 0, 0), along=UP, width=2 * g)
    twist_drill(work, (0, 0, 0), UP, u(rng, 3, 5), u(rng, 8, 20))
    return work


FAMILIES = (wheel, tee, stairs, shell, wedge, spider, bar)
