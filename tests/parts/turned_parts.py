"""A second hand's parts: shafts and levers, each turned and moved at random, and a block with what they lack."""

from __future__ import annotations

import numpy as np

from tests.parts.solids import (
    Floats,
    Part,
    Rng,
    box,
    carried,
    chamfer,
    cone,
    cylinder,
    fillet,
    obround,
    prism,
    round_box,
    turned,
    uniform,
)
from tests.poses import pose_of

FAR = 300.0


def workshop(seed: int) -> Part:
    """The part of a seed."""
    rng = np.random.default_rng([77, seed])
    return turned((lever, shaft)[seed % 2](rng), rng)


def block(_: int) -> Part:
    """A block with a countersunk hole, pockets of three and of six sides and with islands, bosses with a rounded foot
    and with rounded corners, and a grid of holes."""
    t = 30.0
    part = Part(box((0, 0, 0), (240, 160, t)))
    part.cut(cone((15, 15, t - 12**0.5 * 2), 4, 8, 12**0.5 * 2), cylinder((15, 15, -1), 4, FAR))
    sunk = {"countersink_diameter": 16.0, "countersink_angle": np.pi / 3}
    part.know("through_hole", (15, 15, t), diameter=8, depth=t, **sunk)
    for count, x, low in ((3, 45.0, 22.0), (6, 90.0, 0.0)):  # the latter is open below
        angles = 2 * np.pi * np.arange(count) / count
        part.cut(prism([(x + 12 * float(np.cos(a)), 30 + 12 * float(np.sin(a)), low - (low == 0)) for a in angles],
                       (0, 0, FAR)))  # fmt: skip
    # The least rectangle about a triangle lies on one of its sides.
    middles = [(45 + 3 * float(np.cos(a)), 30 + 3 * float(np.sin(a)), 22.0) for a in 2 * np.pi * np.arange(3) / 3]
    part.know("pocket", tuple(middles), length=12 * 3**0.5, width=18, depth=8)
    part.know("duct", ((90, 30, t), (90, 30, 0)), length=24, width=12 * 3**0.5, depth=t)
    tool = Part(round_box((130, 15, 18), (210, 65, FAR), 6))
    tool.cut(cylinder((150, 40, 0), 7, 2 * FAR), box((175, 35, 0), (190, 45, 26)))
    part.cut(tool.body, cylinder((200, 25, -1), 3, FAR))
    part.know("pocket", (170, 40, 18), length=80, width=50, depth=12, corner_radius=6)
    part.know("boss", (150, 40, 18), diameter=14, height=12)
    part.know("boss", (182.5, 40, 18), length=15, width=10, height=8)
    part.know("through_hole", ((200, 25, 18), (200, 25, 0)), diameter=6, depth=18)
    part.fuse(cylinder((40, 110, t), 12, 15), round_box((80, 95, t - 1), (120, 119, t + 10), 5))

    def foot(a: Floats, b: Floats) -> bool:
        return all(bool(abs(np.hypot(p[0] - 40, p[1] - 110) - 12) + abs(p[2] - t) < 1e-6) for p in (a, b))

    part.body = fillet(part.body, 2.0, foot)
    part.know("boss", (40, 110, t), diameter=24, height=15, fillet_radius=2)
    part.know("boss", (100, 107, t), length=40, width=24, height=10)
    for x in (160.0, 174.0, 188.0):
        for y in (100.0, 111.0):
            part.cut(cylinder((x, y, -1), 2, FAR))
            part.know("through_hole", ((x, y, t), (x, y, 0)), diameter=4, depth=t)
    grid = {"count": 6, "rows": 2, "columns": 3, "pitch": 14, "row_pitch": 11, "hole_diameter": 4}
    part.know("grid_pattern", ((174, 105.5, t), (174, 105.5, 0)), **grid)
    return part


def lever(rng: Rng) -> Part:
    """A block with a lug at each end, the bore through it, and a row of holes."""
    t = uniform(rng, 20, 30)
    part = Part(box((0, 0, 0), (100, 80, t)))
    for root, side in ((0.0, -1), (100.0, 1)):
        thick, r = uniform(rng, 8, 15), uniform(rng, 12, 25)
        low, x, bore = (t - thick) / 2, root + side * (r + uniform(rng, 5, 20)), r * uniform(rng, 0.3, 0.6)
        ends = sorted((root - 5 * side, x))
        arm = Part(box((ends[0], 40 - r, low), (ends[1], 40 + r, low + thick)))
        arm.fuse(cylinder((x, 40, low), r, thick))
        part.fuse(arm.body)
        part.cut(cylinder((x, 40, low - 1), bore, thick + 2))
        mouths = ((x, 40.0, low + thick), (x, 40.0, low))
        part.know("through_hole", mouths, diameter=2 * bore, depth=thick)
        part.know("lug", mouths, bore_diameter=2 * bore, width=2 * r, thickness=thick)
    for x in (20.0, 35.0, 50.0, 65.0):
        part.cut(cylinder((x, 20, -1), 3, t + 2))
        part.know("through_hole", ((x, 20.0, t), (x, 20.0, 0.0)), diameter=6, depth=t)
    part.know("linear_pattern", ((42.5, 20.0, t), (42.5, 20.0, 0.0)), count=4, pitch=15, hole_diameter=6)
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
        middle = (0.0, deep - r, (a + c) / 2)  # the cutter comes from -y, its way is along z
        way = np.array([[0.0, -1, 0], [0, 0, -1], [1, 0, 0]])
        part.cut(carried(obround((0, 0, 0), length, width, FAR), pose_of(middle, way)))
        part.know("slot", middle, length=length, width=width, depth=deep)
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
