"""A second hand's parts: turned blanks with seats around their middle, and shafts.

An operation works on a seat, a flat place on a body with a frame of its own.  Every part is turned and moved at random.
"""

from __future__ import annotations

import numpy as np

from tests.parts.seat_operations import FAR, seat, work
from tests.parts.solids import Part, Rng, box, chamfer, cylinder, obround, turned, uniform


def workshop(seed: int) -> Part:
    """The part of a seed."""
    rng = np.random.default_rng([77, seed])
    return turned((disc, shaft)[seed % 2](rng), rng)


def lever(seed: int) -> Part:
    """A block with a lug at each end, the bore through it, and a row of holes."""
    rng = np.random.default_rng(seed)
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
        s = seat((0, -r, (a + c) / 2), (0, -1, 0), (0, 0, 1), (r, r), 2 * r, r)
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
