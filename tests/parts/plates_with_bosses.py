"""Plates on which things stand: bosses drafted, stepped, askew, hollow, stayed by ribs, pads, posts, ears, crossing
ribs; a rounded lug at the rim.  Feet are rounded or not.
"""

from __future__ import annotations

from math import cos, hypot, pi, radians, sin, tan
from typing import Any

import numpy as np

from tests.parts.brackets_and_drums import DOWN, UP, along, bore, chance, fused, moved, placed, rod, twist_drill, u
from tests.parts.housings_and_shafts import Work
from tests.parts.solids import Floats, Rng, box, cone, cylinder, fillet, obround, prism

LENGTH, WIDTH, TOP = 240.0, 160.0, 22.0


def welded(seed: int) -> Work:
    """The part of a seed."""
    rng = np.random.default_rng(80_000 + seed)
    work = Work(box((0, 0, 0), (LENGTH, WIDTH, TOP)), silent=Work.silent | {"open_slot"})
    for k, which in enumerate(rng.permutation(len(ITEMS))[:6].tolist()):
        ITEMS[which](work, rng, 40.0 + 80 * (k % 3), 40.0 + 80 * (k // 3))
    _rim_lug(work, rng)
    return placed(work, rng) if chance(rng) else work


def around(x: float, y: float, z: float, r: float) -> Any:
    """The circle of a radius about a point."""

    def wanted(p: Floats, q: Floats) -> bool:
        ends = [abs(hypot(e[0] - x, e[1] - y) - r) + abs(e[2] - z) for e in (p, q)]
        return bool(max(ends) < 1e-6)

    return wanted


def _foot(work: Work, rng: Rng, x: float, y: float, r: float) -> None:
    if chance(rng):
        work.body = fillet(work.body, u(rng, 1, 2), around(x, y, TOP, r))


def _drafted_boss(work: Work, rng: Rng, x: float, y: float) -> None:
    r, h, lean = u(rng, 10, 16), u(rng, 15, 25), radians(float(rng.choice([1, 2, 3])))
    work.fuse(cone((x, y, TOP), r, r - h * tan(lean), h))
    work.note("boss", (x, y, TOP), out=UP, diameter=2 * r, height=h, draft_angle=lean)
    bore(work, (x, y, 0), UP, u(rng, 3, 6), TOP + h)


def _stayed_boss(work: Work, rng: Rng, x: float, y: float) -> None:
    r, h, g, reach, n = u(rng, 9, 12), u(rng, 20, 28), u(rng, 3, 4), u(rng, 22, 30), 3
    for k in range(n):
        stay = prism([(r - 2, -g / 2, 0), (reach, -g / 2, 0), (r - 2, -g / 2, h - 4)], (0, g, 0))
        work.fuse(moved(stay, 2 * pi * k / n + 0.2, by=(x, y, TOP)))
        work.note("rib", thickness=g)
    work.fuse(cylinder((x, y, TOP), r, h))
    work.note("boss", axis=UP, diameter=2 * r, height=h)
    twist_drill(work, (x, y, TOP + h), DOWN, u(rng, 2, 4), 12)


def _pad(work: Work, rng: Rng, x: float, y: float) -> None:
    s, w, h, r = u(rng, 50, 60), u(rng, 18, 24), u(rng, 3, 8), u(rng, 3, 5)
    work.fuse(obround((x, y, TOP - 1), s, w, h + 1))
    work.note("boss", (x, y, TOP), out=UP, along=(1, 0, 0), length=s, width=w, height=h)
    for side in (-1, 1):
        bore(work, (x + side * (s - w) / 2, y, 0), UP, r, TOP + h)


def _post(work: Work, rng: Rng, x: float, y: float) -> None:
    a, b, h = u(rng, 14, 18), u(rng, 9, 12), u(rng, 12, 22)
    work.fuse(moved(box((-a, -b, 0), (a, b, h)), 0.4, by=(x, y, TOP)))
    work.note("boss", (x, y, TOP), out=UP, along=(cos(0.4), sin(0.4), 0), length=2 * a, width=2 * b, height=h)


def _crossing(work: Work, rng: Rng, x: float, y: float) -> None:
    g, h, s, t = u(rng, 3, 5), u(rng, 14, 22), u(rng, 50, 64), u(rng, 40, 60)
    work.fuse(box((x - s / 2, y - g / 2, TOP - 1), (x + s / 2, y + g / 2, TOP + h)))
    work.fuse(box((x - g / 2, y - t / 2, TOP - 1), (x + g / 2, y + t / 2, TOP + h)))
    work.note("rib", (x, y, TOP), out=UP, along=(1, 0, 0), thickness=g, height=h, length=s)
    work.note("rib", (x, y, TOP), out=UP, along=(0, 1, 0), thickness=g, height=h, length=t)


def _tube(work: Work, rng: Rng, x: float, y: float) -> None:
    r, wall, h = u(rng, 16, 22), u(rng, 3, 6), u(rng, 12, 24)
    work.fuse(cylinder((x, y, TOP), r, h))
    _foot(work, rng, x, y, r)
    work.note("boss", (x, y, TOP), out=UP, diameter=2 * r, height=h)
    work.cut(cylinder((x, y, TOP), r - wall, h + 1))
    work.note("blind_hole", (x, y, TOP + h), out=UP, diameter=2 * (r - wall), depth=h)


def _stepped_boss(work: Work, rng: Rng, x: float, y: float) -> None:
    r, h, s, k = u(rng, 18, 24), u(rng, 5, 9), u(rng, 9, 14), u(rng, 8, 14)
    work.fuse(cylinder((x, y, TOP), r, h), cylinder((x, y, TOP + h), s, k))
    _foot(work, rng, x, y, r)
    work.note("boss", (x, y, TOP), out=UP, diameter=2 * r, height=h)
    work.note("boss", (x, y, TOP + h), out=UP, diameter=2 * s, height=k)
    twist_drill(work, (x, y, TOP + h + k), DOWN, u(rng, 2, 4), 12)


def _askew(work: Work, rng: Rng, x: float, y: float) -> None:
    """A round boss that leans, drilled along its axis."""
    r, length, lean, hole = u(rng, 9, 12), u(rng, 28, 34), radians(u(rng, 15, 30)), u(rng, 3, 5)
    d = (sin(lean), 0.0, cos(lean))
    work.fuse(rod(along((x - 10, y, TOP), d, -6), d, r, length + 6))
    work.note("boss", (x - 10, y, TOP), axis=d, diameter=2 * r)
    mouth = along((x - 10, y, TOP), d, length)
    twist_drill(work, mouth, (-d[0], 0.0, -d[2]), hole, 18)


def _ears(work: Work, rng: Rng, x: float, y: float) -> None:
    w, t, gap, h, r = u(rng, 22, 30), u(rng, 6, 9), u(rng, 12, 18), u(rng, 18, 24), u(rng, 4, 6)
    for low in (y - gap / 2 - t, y + gap / 2):
        plate = box((x - w / 2, low, TOP - 1), (x + w / 2, low + t, TOP + h))
        work.fuse(fused(plate, cylinder((x, low, TOP + h), w / 2, t, (0, 1, 0))))
        work.note("lug", (x, low, TOP + h), axis=(0, 1, 0), bore_diameter=2 * r, width=w, thickness=t)
    bore(work, (x, y - gap / 2 - t, TOP + h), (0, 1, 0), r, gap + 2 * t)


ITEMS = (_drafted_boss, _stayed_boss, _pad, _post, _crossing, _tube, _stepped_boss, _askew, _ears)


def _rim_lug(work: Work, rng: Rng) -> None:
    """In the plane of the plate, its root rounded or not."""
    w, reach, r, t, c = u(rng, 26, 36), u(rng, 24, 32), u(rng, 5, 8), u(rng, 10, 22), u(rng, 3, 6)
    y = WIDTH / 2
    work.fuse(fused(box((-reach, y - w / 2, 0), (1, y + w / 2, t)), cylinder((-reach, y, 0), w / 2, t)))
    if chance(rng):

        def root(p: Floats, q: Floats) -> bool:
            ends: Any = np.abs([p, q])
            return bool(
                np.all(ends[:, 0] < 1e-6)
                and abs(abs(p[1] - y) - w / 2) < 1e-6
                and abs(q[1] - p[1]) < 1e-6
                and abs(p[2] - q[2]) > 1
            )

        work.body = fillet(work.body, c, root)
    bore(work, (-reach, y, 0), UP, r, t)
    work.note("lug", (-reach, y, 0), axis=UP, bore_diameter=2 * r, width=w, thickness=t)
