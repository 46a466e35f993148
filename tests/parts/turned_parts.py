"""A lever, turned and moved at random."""

from __future__ import annotations

import numpy as np

from tests.parts.solids import Part, Rng, box, cylinder, turned, uniform


def workshop(seed: int) -> Part:
    """The part of a seed, an even one."""
    rng = np.random.default_rng([77, seed])
    return turned(lever(rng), rng)


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
    for x in (20.0, 35.0, 50.0, 65.0):
        part.cut(cylinder((x, 20, -1), 3, t + 2))
    return part
