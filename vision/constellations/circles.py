"""Circles in space: those that stereo puts there, and those along which sharp edges of the model run."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from sqlalchemy import Connection

from relmodel.arrays import Bools, Floats
from relmodel.columns import Columns
from relmodel.store import Store
from vision.stereo.triangulate import CURVES, Triangulated


@dataclass(frozen=True)
class Circles:
    """Circles (n,): centre (n, 3) and radius (n,) in mm, unit normal (n, 3) of either sign."""

    centre: Floats
    normal: Floats
    radius: Floats

    def __len__(self) -> int:
        return len(self.radius)

    def take(self, rows: Bools) -> Circles:
        """Some of them."""
        return Circles(self.centre[rows], self.normal[rows], self.radius[rows])

    def columns(self) -> Columns:
        """Rows of a relation for `queries/constellations`."""
        values = (*self.centre.T, *self.normal.T, self.radius)
        names = ("x", "y", "z", "nx", "ny", "nz", "radius")
        return {"no": np.arange(len(self)), **{n: np.ascontiguousarray(v) for n, v in zip(names, values, strict=True)}}


def read_model_circles(store: Store, connection: Connection, world_id: int) -> Circles:
    """Circles of the sharp edges of a world's inspected parts, in the world's frame."""
    found = store.columns(connection, "constellations/model_circles", world_id=world_id)
    centre, normal = (np.stack([found[n] for n in names], axis=1) for names in (("x", "y", "z"), ("nx", "ny", "nz")))
    return Circles(centre, normal, found["radius"])


def find_scene_circles(space: Triangulated) -> Circles:
    """Circles among matched arcs, in the rig's frame; an ellipse counts as the circle on its major axis."""
    normal = np.cross(space.conics.major, space.conics.minor)
    length = np.linalg.norm(normal, axis=1)
    rows = np.isin(space.curve, [CURVES.index("circle"), CURVES.index("ellipse")]) & (length > 0)
    return Circles(
        space.conics.centre[rows],
        normal[rows] / length[rows, None],
        np.linalg.norm(space.conics.major[rows], axis=1),
    )
