"""Circles in space: those that stereo puts there, and those along which sharp edges of an object run."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from sqlalchemy import Connection

from relmodel.arrays import Floats, Ints
from relmodel.features.circle_relations import DEFAULTS as KEPT
from relmodel.features.circle_relations import relate
from relmodel.store.database import Database
from vision.constellations.constellation_parameters import JoinParameters
from vision.stereo.triangulate import CURVES, Triangulated

Relations = dict[str, Floats | Ints]
"""Columns of relations in space, a row each."""


@dataclass(frozen=True)
class Circles:
    """Circles (n,): centre (n, 3) and radius (n,) in mm, unit normal (n, 3) of either sign, and the covariance of all
    three (n, 7, 7)."""

    centre: Floats
    normal: Floats
    radius: Floats
    covariance: Floats

    @classmethod
    def exact(cls, centre: Floats, normal: Floats, radius: Floats) -> Circles:
        """Those of a model, of no covariance."""
        return cls(centre, normal, radius, np.zeros((len(radius), 7, 7)))

    def __len__(self) -> int:
        return len(self.radius)

    def relations(self, p: JoinParameters) -> Relations:
        """How they lie to each other two by two, those that are sure enough to be joined: columns of the relation that
        `queries/constellations/join.sql` takes."""
        a, b = np.triu_indices(len(self), 1)
        found = relate(self.centre, self.normal, self.radius, a, b)
        found |= {f"{name}_sigma": values for name, values in self._sigmas(a, b).items()}
        rows = (found["distance"] >= KEPT.least_distance) & (found["distance"] <= KEPT.greatest_distance)
        rows &= (found["distance_sigma"] <= p.most_sigma_mm) & (found["normals_sigma"] <= p.most_sigma_cosine)
        return {"unit_a": a[rows], "unit_b": b[rows]} | {name: values[rows] for name, values in found.items()}

    def _sigmas(self, a: Ints, b: Ints) -> dict[str, Floats]:
        """Standard deviations (k,) of the relations of circles a (k,) with b (k,), to the second order where an angle
        is near to none and its cosine moves no more with it."""
        line = self.centre[b] - self.centre[a]
        distance = np.linalg.norm(line, axis=1, keepdims=True)
        line = line / np.maximum(distance, 1e-12)
        one, other = self.covariance[a], self.covariance[b]

        def spread(of_a: Floats, of_b: Floats) -> Floats:
            """Variances of what changes with centre and normal of both by these (k, 6)."""
            first, second = (
                np.einsum("ki,kij,kj->k", by, covariance[:, :6, :6], by)
                for by, covariance in ((of_a, one), (of_b, other))
            )
            return np.asarray(first + second)

        still = np.zeros_like(line)
        lean = [np.trace(c[:, 3:6, 3:6], axis1=1, axis2=2) / 2 for c in (one, other)]
        shift = [np.trace(c[:, :3, :3], axis1=1, axis2=2) / 3 for c in (one, other)]
        turn = sum(shift) / distance[:, 0] ** 2
        out = {
            "radius_a": np.sqrt(one[:, 6, 6]),
            "radius_b": np.sqrt(other[:, 6, 6]),
            "distance": np.sqrt(spread(np.hstack([-line, still]), np.hstack([line, still]))),
            "normals": np.sqrt(
                spread(np.hstack([still, self.normal[b]]), np.hstack([still, self.normal[a]])) + 2 * sum(lean) ** 2
            ),
        }
        for name, normal, way in (("rise_a", self.normal[a], 0), ("rise_b", self.normal[b], 1)):
            across = (normal - np.einsum("ki,ki->k", normal, line)[:, None] * line) / distance
            parts = [np.hstack([-across, still]), np.hstack([across, still])]
            parts[way][:, 3:] = line
            out[name] = np.sqrt(spread(*parts) + 2 * (lean[way] + turn) ** 2)
        return out


def read_circles(store: Database, connection: Connection, object_id: int) -> Circles:
    """The circles of an object in its frame, in the order of their numbers."""
    found = store.select(connection, "circle", order="circle_no", object_id=object_id)
    centre, normal = (np.stack([found[n] for n in names], axis=1) for names in (("x", "y", "z"), ("nx", "ny", "nz")))
    return Circles.exact(centre, normal, found["radius"])


def find_scene_circles(space: Triangulated) -> tuple[Ints, Circles]:
    """Circles among matched arcs, in the rig's frame, that are of a size to be related, and which arcs (n,) they are;
    an ellipse counts as the circle on its major axis."""
    size = np.linalg.norm(space.conics.major, axis=1)
    normal = np.cross(space.conics.major, space.conics.minor)
    length = np.linalg.norm(normal, axis=1)
    rows = np.isin(space.curve, [CURVES.index("circle"), CURVES.index("ellipse")]) & (length > 0)
    rows = np.flatnonzero(rows & (size >= KEPT.least_radius) & (size <= KEPT.greatest_radius))
    normal = normal[rows] / length[rows, None]
    return rows, Circles(space.conics.centre[rows], normal, size[rows], space.conics.covariance[rows])
