"""Boxes as arrays, and pairs of volumes and boxes: what every kind of index works on."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from relmodel.arrays import Floats, Ints
from relmodel.find.volumes import VolumeTable


def as_boxes(boxes: npt.ArrayLike) -> Floats:
    """Boxes as a contiguous array (n, 6)."""
    return np.ascontiguousarray(np.asarray(boxes, np.float64).reshape(-1, 6))


def among(boxes: Floats, volumes: VolumeTable, pairs: tuple[Ints, Ints]) -> tuple[Ints, Ints]:
    """Those pairs (number of a volume, number of a box that meets its bounds) whose box meets the volume itself."""
    from relmodel.find.volume_kernels import pairs_met

    met = pairs_met(boxes, volumes.half_spaces, volumes.start, volumes.balls, *pairs)
    return pairs[0][met], pairs[1][met]
