"""Poses as tests state them."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from relmodel.arrays import Floats
from relmodel.geometry.transforms import rotation_matrix


def pose_of(shift: npt.ArrayLike = (0, 0, 0), turn: npt.ArrayLike = (0, 0, 0)) -> Floats:
    """The transform (4, 4) that turns, by a vector (rad) or a matrix (3, 3), and then shifts."""
    out = np.eye(4)
    out[:3, :3], out[:3, 3] = turn if np.ndim(turn) == 2 else rotation_matrix(turn), shift
    return out
