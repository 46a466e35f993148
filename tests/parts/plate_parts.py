"""Plates with a grid of cells, each with a feature or two on its top, and operations along the sides; hole patterns."""

from __future__ import annotations

import numpy as np

from tests.parts.solids import (
    BORDER,
    BORE,
    CELL,
    THIN_WEB,
    Part,
    Point,
    Rng,
    between,
    box,
    chamfer,
    cone,
    cylinder,
    drill,
    ellipse,
    fillet,
    obround,
    round_box,
)


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
        drill(part, centre[0] + ring * np.cos(a), centre[1] + ring * np.sin(a), r, t)
    ends = ((*centre, t), (*centre, 0.0))
    part.know("circular_pattern", ends, count=count, pattern_diameter=2 * ring, hole_diameter=2 * r)
    if rng.random() < 0.7:
        bore = float(rng.uniform(8, 20))
        drill(part, *centre, bore, t)
    count, r = int(rng.integers(3, 8)), float(rng.choice([r, rng.uniform(2, 4)]))
    pitch, lean = float(rng.uniform(12, 18)), float(rng.uniform(-0.6, 0.6))
    x, y = 180.0, 80 - pitch * (count - 1) / 2 * np.sin(lean)
    for k in range(count):
        drill(part, x + k * pitch * np.cos(lean), y + k * pitch * np.sin(lean), r, t)
    middle = (x + pitch * (count - 1) / 2 * float(np.cos(lean)), 80.0)
    ends = ((*middle, t), (*middle, 0.0))
    part.know("linear_pattern", ends, count=count, pitch=pitch, hole_diameter=2 * r)
    for x, y in ((305.0, 10.0), (300.0, 150.0)):
        drill(part, x, y, 5.0, t)
    return part
