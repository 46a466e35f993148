"""Seats: flat places on a body that operations work on."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from OCP.BRepBuilderAPI import BRepBuilderAPI_Transform
from OCP.gp import gp_Trsf

from tests.parts.solids import Point

Floats = npt.NDArray[np.float64]
Rng = np.random.Generator


FAR = 300.0


@dataclass(frozen=True, eq=False)
class Seat:
    """A flat place on a body: part_from_seat with z out of the material, the half widths that are free around it.

    below is the thickness of the material down to a parallel face, None where there is none.
    """

    pose: Floats
    half: tuple[float, float]
    below: float | None
    safe: float  # depth that may be cut

    def put(self, shape: Any) -> Any:
        move = gp_Trsf()
        move.SetValues(*self.pose[:3].ravel().tolist())
        return BRepBuilderAPI_Transform(shape, move, True).Shape()

    def p(self, x: float, y: float, z: float) -> Point:
        q = self.pose[:3] @ [x, y, z, 1.0]
        return (float(q[0]), float(q[1]), float(q[2]))

    def spun(self, angle: float) -> Seat:
        c, s = np.cos(angle), np.sin(angle)
        spin = np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]])
        # What fits into the circle fits however it is turned.
        least = min(self.half)
        return Seat(self.pose @ spin, (least, least), self.below, self.safe)


def seat(origin: Point, z: Point, x: Point, half: tuple[float, float], below: float | None, safe: float) -> Seat:
    pose = np.eye(4)
    up, along = np.array(z, float) / np.linalg.norm(z), np.array(x, float) / np.linalg.norm(x)
    pose[:3, 0], pose[:3, 1], pose[:3, 2], pose[:3, 3] = along, np.cross(up, along), up, origin
    return Seat(pose, half, below, safe)


def uniform(rng: Rng, low: float, high: float) -> float:
    return float(rng.uniform(low, high))
