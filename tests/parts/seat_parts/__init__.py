"""A second hand's parts, held out while the recogniser was written: other bodies, other operations, other orders.

Bodies are discs, angles, sheets of curved outline, rings, wedges, rails, shafts, clevises, castings and blocks whose
operations clash.  An operation works on a seat, a flat place on a body with a frame of its own.  Every part is turned
and moved at random.  What a machinist would call one feature is one: a hole drilled in line through two ears or
across a pocket is one hole, slots cut by others keep their length, pockets of one depth that run together are one.
"""

from __future__ import annotations

import numpy as np

from tests.parts.seat_parts.bodies import angle, casting, clevis, disc, ring, shaft, sheet, wedge
from tests.parts.seat_parts.clashes import clash
from tests.parts.seat_parts.rails import rail
from tests.parts.solids import Part, turned

FAMILIES = (disc, angle, sheet, ring, wedge, rail, shaft, clevis, casting, clash, clash, rail)


def workshop(seed: int) -> Part:
    """The part of a seed."""
    rng = np.random.default_rng([77, seed])
    part = FAMILIES[seed % len(FAMILIES)](rng)
    return turned(part, rng)
