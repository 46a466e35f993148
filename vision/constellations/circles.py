"""Circles in space: those that stereo puts there, and those along which sharp edges of an object run."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from sqlalchemy import Connection

from relmodel.arrays import Bools, Floats
from relmodel.columns import Columns
from relmodel.features.circle_relations import DEFAULTS as KEPT
from relmodel.features.circle_relations import relate
from relmodel.store.database import Database
from vision.constellations.constellation_parameters import JoinParameters
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

    def relations(self, p: JoinParameters) -> Columns:
        """How they lie to each other, each pair in both orders: columns of the relation that
        `queries/constellations/join.sql` takes."""
        a, b = np.nonzero(~np.eye(len(self), dtype=bool))
        found = relate(self.centre, self.normal, self.radius, a, b)
        rows = (found["distance"] >= KEPT.least_distance) & (found["distance"] <= KEPT.greatest_distance)
        rows &= found["rise_a"] <= p.along
        return {"unit_a": a[rows], "unit_b": b[rows], **{name: values[rows] for name, values in found.items()}}


def read_circles(store: Database, connection: Connection, object_id: int) -> Circles:
    """The circles of an object in its frame, in the order of their numbers."""
    found = store.columns(connection, "constellations/circles", object_id=object_id)
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
