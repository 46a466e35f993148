"""Parts that the CAD kernel composes from known operations with random dimensions, and the features they must show.

A part is a plate with a grid of cells, each with a feature or two on its top, and operations along its sides; or a
bracket, a channel, a lattice of ribs, a lever with lugs, a flanged hub; or a block whose operations cut one another.
Every other part is turned and moved.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from tests.parts.plate_parts import CELLS, _sorted, patterned, plate
from tests.parts.solids import (
    BORE,
    THIN_WEB,
    Floats,
    Known,
    Part,
    Rng,
    between,
    box,
    chamfer,
    cylinder,
    drill,
    fillet,
    prism,
    round_box,
    turned,
)


def generate(seed: int) -> Part:
    """The part of a seed."""
    rng = np.random.default_rng(seed)
    families = (plate, plate, patterned, plate, bracket, lattice, lever, hub, crossed, finished, six_sided, plate)
    part = families[seed % len(families)](rng)
    return turned(part, rng) if seed % 2 else part


def bracket(rng: Rng) -> Part:
    """A base with an upright flange at one end and ribs across it, holes in the base."""
    t, wide = float(rng.uniform(8, 14)), float(rng.uniform(60, 90))
    thick, tall = float(rng.uniform(3, 7)), float(rng.uniform(25, 45))
    long = 200.0
    part = Part(box((0, 0, 0), (long, wide, t)))
    part.fuse(box((0, 0, t), (thick, wide, t + tall)))
    part.know("flange", (thick / 2, wide / 2, t), thickness=thick, length=wide, height=tall)
    places = [70.0, 130.0] if rng.random() < 0.5 else [110.0]
    for place in places:
        rib, high = float(rng.uniform(2, 5)), float(rng.uniform(12, 24))
        across = rng.random() < 0.5
        y0, y1 = (0.0, wide) if across else (12.0, wide - 12)
        part.fuse(box((place - rib / 2, y0, t), (place + rib / 2, y1, t + high)))
        part.know("rib", (place, wide / 2, t), thickness=rib, length=y1 - y0, height=high)
        if across:
            part.features += _channel(part, place, rib, wide, t)
    drill(part, 40.0, wide / 2, float(rng.uniform(3, 7)), t)
    drill(part, 180.0, wide / 2, float(rng.uniform(3, 7)), t)
    if rng.random() < 0.5:
        c = float(rng.uniform(2, 8))
        part.body = fillet(part.body, c, between((long, 0, 0), (long, 0, t)))
        part.know("fillet", (long - c, c, t / 2), radius=c, length=t)
    return part


def _channel(part: Part, place: float, rib: float, wide: float, t: float) -> list[Known]:
    """Walls across the whole base leave an open slot between each other."""
    walls = sorted(
        (f.at[0][0] - f.dimensions["thickness"] / 2, f.at[0][0] + f.dimensions["thickness"] / 2, f.dimensions["height"])
        for f in part.features
        if f.kind == "flange" or (f.kind == "rib" and abs(f.dimensions["length"] - wide) < 1e-9)
    )
    left = [w for w in walls if w[1] < place - rib]
    if not left:
        return []
    one, two = left[-1], next(w for w in walls if w[0] <= place <= w[1])
    gap = two[0] - one[1]
    middle = ((one[1] + two[0]) / 2, wide / 2, t)
    known = [Known("open_slot", (middle,), _slot_size(wide, gap, max(one[2], two[2])))]
    if t <= THIN_WEB * min(wide, gap):
        sheet = {"thickness": t, "length": wide, "width": gap}
        known.append(Known("web", ((middle[0], middle[1], t / 2),), sheet))
    return known


def _slot_size(length: float, width: float, depth: float) -> dict[str, float]:
    return {"length": length, "width": width, "depth": depth}


def lattice(rng: Rng) -> Part:
    """Pockets in rows on one or both sides of a web, thin ribs between them and thicker walls around."""
    t, web = 40.0, float(rng.uniform(3, 5))
    columns, rows = int(rng.integers(2, 4)), 2
    rib, rim, corner = float(rng.uniform(3, 7)), 26.0, float(rng.uniform(4, 9))
    a, c = float(rng.uniform(50, 70)), float(rng.uniform(40, 49))
    both = rng.random() < 0.5
    floor = 20.0 if both else t - 30
    web = web if both else floor
    long, wide = 2 * rim + columns * a + (columns - 1) * rib, 2 * rim + rows * c + (rows - 1) * rib
    part = Part(box((0, 0, 0), (long, wide, t)))
    for i in range(columns):
        for j in range(rows):
            x, y = rim + i * (a + rib), rim + j * (c + rib)
            part.cut(round_box((x, y, floor), (x + a, y + c, t + 1), corner))
            middle = (x + a / 2, y + c / 2)
            part.know("pocket", (*middle, floor), length=a, width=c, depth=t - floor, corner_radius=corner)
            if both:
                part.cut(round_box((x, y, -1), (x + a, y + c, floor - web), corner))
                deep = floor - web
                part.know("pocket", (*middle, deep), length=a, width=c, depth=deep, corner_radius=corner)
            if web <= THIN_WEB * c:
                part.know("web", (*middle, floor - web / 2), thickness=web, length=a, width=c)
    foot = 0.0 if both else floor
    for i in range(1, columns):
        x = rim + i * (a + rib) - rib / 2
        length = rows * c + (rows - 1) * rib - 2 * corner
        part.know("rib", ((x, wide / 2, foot), (x, wide / 2, t)), thickness=rib, length=length, height=t - foot)
    length = columns * a + (columns - 1) * rib - 2 * corner
    y = wide / 2
    part.know("rib", ((long / 2, y, foot), (long / 2, y, t)), thickness=rib, length=length, height=t - foot)
    return part


def lever(rng: Rng) -> Part:
    """A block with a lug at one or two ends, the bore through it."""
    t = float(rng.uniform(20, 30))
    part = Part(box((0, 0, 0), (100, 80, t)))
    for side in (0, 1) if rng.random() < 0.6 else (1,):
        thick, r = float(rng.uniform(8, 15)), float(rng.uniform(12, 25))
        low, reach = (t - thick) / 2, r + float(rng.uniform(5, 20))
        x, y = (100 + reach if side else -reach), 40.0
        bore = r * float(rng.uniform(0.3, 0.6))
        root = 100.0 if side else 0.0
        arm = Part(box(*_sorted((root - (5 if side else -5), y - r, low), (x, y + r, low + thick))))
        arm.fuse(cylinder((x, y, low), r, thick))
        part.fuse(arm.body)
        drill(part, x, y, bore, thick, low)
        ends = ((x, y, low + thick), (x, y, low))
        part.know("lug", ends, bore_diameter=2 * bore, width=2 * r, thickness=thick)
    CELLS[rng.integers(4)](part, rng, 50.0, 40.0, t)
    return part


def hub(rng: Rng) -> Part:
    """A disc around a shaft, bored, with a bolt circle."""
    r, thick = float(rng.uniform(40, 60)), float(rng.uniform(6, 14))
    shaft, tall = r * float(rng.uniform(0.3, 0.45)), float(rng.uniform(20, 50))
    part = Part(cylinder((0, 0, 0), r, thick))
    part.fuse(cylinder((0, 0, thick), shaft, tall))
    part.know("flange", ((0, 0, 0.0), (0, 0, thick)), diameter=2 * r, thickness=thick)
    part.know("boss", (0, 0, thick), diameter=2 * shaft, height=tall)
    if rng.random() < 0.7:
        drill(part, 0, 0, shaft * float(rng.uniform(0.3, 0.7)), thick + tall)
    count, bolt = int(rng.integers(3, 9)), float(rng.uniform(2, 4))
    ring = (r + shaft) / 2
    for k in range(count):
        a = 2 * np.pi * k / count
        drill(part, ring * np.cos(a), ring * np.sin(a), bolt, thick)
    ends = ((0.0, 0.0, thick), (0.0, 0.0, 0.0))
    part.know("circular_pattern", ends, count=count, pattern_diameter=2 * ring, hole_diameter=2 * bolt)
    if rng.random() < 0.5:
        c = float(rng.uniform(0.5, 2))
        part.body = chamfer(part.body, c, _rim(shaft, thick + tall))
        part.know("chamfer", (0, 0, thick + tall - c / 2), width=c * 2**0.5, diameter=2 * shaft, angle=np.pi / 4)
    return part


def _rim(radius: float, z: float) -> Callable[[Floats, Floats], bool]:
    return lambda a, b: bool(abs(a[2] - z) < 1e-6 and abs(np.hypot(a[0], a[1]) - radius) < 1e-6)


def crossed(rng: Rng) -> Part:
    """A block whose features cut one another."""
    t = float(rng.uniform(30, 40))
    part = Part(box((0, 0, 0), (300, 160, t)))
    # Two slots across each other, of one depth or of two.
    w1, w2 = float(rng.uniform(8, 14)), float(rng.uniform(8, 14))
    d1 = float(rng.uniform(8, 18))
    d2 = d1 if rng.random() < 0.5 else float(rng.uniform(8, 18))
    part.cut(box((60 - w1 / 2, -1, t - d1), (60 + w1 / 2, 161, t + 1)))
    part.cut(box((-1, 80 - w2 / 2, t - d2), (130, 80 + w2 / 2, t + 1)))
    part.know("open_slot", (60, 80, t - d1), length=160, width=w1, depth=d1)
    part.know("open_slot", (65, 80, t - d2), length=130, width=w2, depth=d2)
    # A pocket that cuts the corner of another, deeper one.
    shallow, deep = float(rng.uniform(4, 9)), float(rng.uniform(12, 25))
    part.cut(box((160, 30, t - shallow), (210, 70, t + 1)))
    part.cut(box((190, 50, t - deep), (240, 100, t + 1)))
    part.know("pocket", (185, 50, t - shallow), length=50, width=40, depth=shallow)
    part.know("pocket", (215, 75, t - deep), length=50, width=50, depth=deep)
    # A step cut by a hole, and a hole drilled across another.
    width = float(rng.uniform(22, 30))
    depth = float(rng.uniform(8, 14))
    part.cut(box((300 - width, -1, t - depth), (301, 161, t + 1)))
    part.know("step", (300 - width / 2, 80, t - depth), length=160, width=width, depth=depth)
    drill(part, 300 - width / 2, 120, float(rng.uniform(3, 7)), t - depth)
    part.cut(cylinder((-1, 135, 8), 4.0, 302, (1, 0, 0)))
    part.know("through_hole", ((0, 135, 8), (300, 135, 8)), diameter=8.0, depth=300.0)
    drill(part, 180.0, 135.0, float(rng.uniform(6, 9)), t)
    return part


def finished(rng: Rng) -> Part:
    """Rims rounded or chamfered, corners filleted: of pockets, slots, steps, ribs and holes."""
    t = float(rng.uniform(24, 34))
    part = Part(box((0, 0, 0), (300, 160, t)))
    # A pocket with a finished rim.
    length, width, corner = float(rng.uniform(40, 55)), float(rng.uniform(30, 36)), float(rng.uniform(5, 9))
    depth, c = float(rng.uniform(8, 16)), float(rng.uniform(0.5, 2))
    part.cut(round_box((60 - length / 2, 40 - width / 2, t - depth), (60 + length / 2, 40 + width / 2, t + 1), corner))
    part.know("pocket", (60, 40, t - depth), length=length, width=width, depth=depth, corner_radius=corner)
    inside = lambda a, b: bool(  # noqa: E731
        max(abs(a[2] - t), abs(b[2] - t)) < 1e-6
        and max(abs(a[0] - 60), abs(b[0] - 60)) < 30
        and max(abs(a[1] - 40), abs(b[1] - 40)) < 20
    )
    if rng.random() < 0.6:
        part.body = fillet(part.body, c, inside)
        around = 2 * (length + width - 4 * corner) + 2 * np.pi * (corner + c)
        at = ((60, 40 + s * (width / 2 + c), t - c) for s in (-1, 1))
        part.know("fillet", tuple(at), radius=c, length=around)
    # Holes with finished rims.
    r, c = float(rng.uniform(4, 7)), float(rng.uniform(0.5, 2))
    part.cut(cylinder((130, 40, -1), r, BORE))
    part.body = chamfer(part.body, c, _rim_at(130, 40, r, t))
    part.know(
        "through_hole",
        (130, 40, t),
        diameter=2 * r,
        depth=t,
        countersink_diameter=2 * (r + c),
        countersink_angle=np.pi / 2,
    )
    r, c = float(rng.uniform(4, 7)), float(rng.uniform(0.5, 2))
    part.cut(cylinder((170, 40, t - 15), r, BORE))
    part.body = fillet(part.body, c, _rim_at(170, 40, r, t))
    part.know("blind_hole", (170, 40, t), diameter=2 * r, depth=15.0)
    part.know("fillet", (170, 40, t - c), radius=c, length=2 * np.pi * (r + c))
    # A step with a fillet in its corner.
    width, depth, c = float(rng.uniform(20, 30)), float(rng.uniform(8, 14)), float(rng.uniform(1, 5))
    part.cut(box((300 - width, -1, t - depth), (301, 161, t + 1)))
    corner_edge = between((300 - width, 0, t - depth), (300 - width, 160, t - depth))
    part.body = fillet(part.body, c, corner_edge)
    middle = (300 - width / 2, 80, t - depth)
    part.know("step", middle, length=160, width=width, depth=depth, fillet_radius=c)
    # A slot across, with fillets along its floor.
    width, depth = float(rng.uniform(10, 16)), float(rng.uniform(8, 14))
    c = float(rng.uniform(1, 3))
    low, high = 230 - width / 2, 230 + width / 2
    part.cut(box((low, -1, t - depth), (high, 161, t + 1)))
    for x in (low, high):
        part.body = fillet(part.body, c, between((x, 0, t - depth), (x, 160, t - depth)))
    part.know("open_slot", (230, 80, t - depth), length=160, width=width, depth=depth, fillet_radius=c)
    # A rib with fillets at its foot.
    rib, high, c = float(rng.uniform(3, 6)), float(rng.uniform(16, 26)), float(rng.uniform(1, 3))
    y0, y1 = 120 - rib / 2, 120 + rib / 2
    part.fuse(box((30, y0, t), (150, y1, t + high)))
    for y in (y0, y1):
        part.body = fillet(part.body, c, between((30, y, t), (150, y, t)))
    part.know("rib", (90, 120, t), thickness=rib, length=120, height=high)
    for _ in (y0, y1):
        part.know("fillet", tuple((90, y + s * c, t + c) for y, s in ((y0, -1), (y1, 1))), radius=c, length=120)
    return part


def _rim_at(x: float, y: float, r: float, z: float) -> Callable[[Floats, Floats], bool]:
    return lambda a, b: bool(abs(a[2] - z) < 1e-6 and abs(np.hypot(a[0] - x, a[1] - y) - r) < 1e-6)


def six_sided(rng: Rng) -> Part:
    """A block with operations on its sides and below, a slanted hole, a pocket in a boss and a hole through a wall."""
    t = 60.0
    part = Part(box((0, 0, 0), (240, 120, t)))
    # From below, from the front, from the left.
    length, width, depth = float(rng.uniform(40, 60)), float(rng.uniform(25, 38)), float(rng.uniform(8, 20))
    corner = float(rng.uniform(3, 8))
    part.cut(round_box((60 - length / 2, 60 - width / 2, -1), (60 + length / 2, 60 + width / 2, depth), corner))
    part.know("pocket", (60, 60, depth), length=length, width=width, depth=depth, corner_radius=corner)
    r, deep = float(rng.uniform(3, 8)), float(rng.uniform(10, 25))
    part.cut(cylinder((40, -1, 38), r, deep + 1, (0, 1, 0)))
    part.know("blind_hole", (40, 0, 38), diameter=2 * r, depth=deep)
    long, wide, deep = float(rng.uniform(40, 60)), float(rng.uniform(8, 14)), float(rng.uniform(5, 12))
    part.cut(box((-1, 60 - long / 2, 40 - wide / 2), (deep, 60 + long / 2, 40 + wide / 2)))
    part.know("pocket", (deep, 60, 40), length=long, width=wide, depth=deep)
    # A hole that leans: its depth is that of its longest side.
    r, lean = float(rng.uniform(3, 6)), float(np.radians(rng.uniform(10, 30)))
    axis = (float(np.sin(lean)), 0.0, float(np.cos(lean)))
    part.cut(cylinder((110 - 100 * axis[0], 100.0, -100 * axis[2]), r, 400, axis))
    reach = t / axis[2] / 2 + r * float(np.tan(lean))
    mid = np.array([110 + t / 2 * np.tan(lean), 100.0, t / 2])
    ends = tuple(tuple((mid + s * reach * np.array(axis)).tolist()) for s in (-1, 1))
    part.know("through_hole", ends, diameter=2 * r, depth=2 * reach)
    # A boss with a pocket in its top.
    r, tall, deep = float(rng.uniform(18, 25)), float(rng.uniform(8, 15)), float(rng.uniform(4, 7))
    part.fuse(cylinder((190, 40, t), r, tall))
    part.cut(box((180, 34, t + tall - deep), (200, 46, t + tall + 1)))
    part.know("boss", (190, 40, t), diameter=2 * r, height=tall)
    part.know("pocket", (190, 40, t + tall - deep), length=20, width=12, depth=deep)
    # A pocket, and a hole drilled into its wall so that more than half of it is left in the block.
    part.cut(box((60, 20, t - 15), (110, 50, t + 1)))
    r = float(rng.uniform(5, 8))
    bite = r * float(rng.uniform(0.1, 0.5))
    part.cut(cylinder((60 - r + bite, 35, t - 12), r, BORE))
    part.know("pocket", (85, 35, t - 15), length=50, width=30, depth=15.0)
    part.know("blind_hole", (60 - r + bite, 35, t), diameter=2 * r, depth=12.0)
    # A chamfer of unequal legs below, one of 30 degrees.
    c = float(rng.uniform(3, 7))
    part.cut(prism([(240, -1, 0), (240 - c, -1, 0), (240, -1, c * 3**0.5)], (0, 122, 0)))
    part.know("chamfer", (240 - c / 2, 60, c * 3**0.5 / 2), width=2 * c, length=120, angle=np.pi / 6)
    return part
