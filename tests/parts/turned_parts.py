"""A lever, turned and moved at random."""

from __future__ import annotations

import numpy as np

from tests.features.known_parts import lever
from tests.parts.solids import Part, carried
from tests.poses import pose_of


def workshop(seed: int) -> Part:
    rng = np.random.default_rng([77, seed])
    return Part(carried(lever().body, pose_of(rng.uniform(-200, 200, 3), rng.normal(size=3))))
