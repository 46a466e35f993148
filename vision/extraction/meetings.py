"""Meetings: which arcs take part in a junction with which end or with their interior, and where they meet.

The place is that of least squares from all of them, each across itself by its own uncertainty, with the covariance that
follows.
"""

from dataclasses import dataclass, replace

import numpy as np

from relmodel.arrays import Bools, Floats, Indices
from relmodel.columns import Rows
from vision.extraction.arcs import Arcs
from vision.extraction.extraction_parameters import JunctionParameters
from vision.extraction.osculating_circles import OsculatingCircles

AT = ("start", "end", "interior")
START, END, INTERIOR = range(3)


@dataclass(frozen=True)
class Meetings(Rows):
    """Which arc takes part in which group, with what of it, as which curve."""

    group: Indices
    arc: Indices
    at: Indices
    curve: OsculatingCircles

    @property
    def count(self) -> int:
        return int(self.group.max(initial=-1)) + 1

    def select(self, rows: Indices | Bools) -> "Meetings":
        """Those that `rows` selects, in order of their groups, renumbered."""
        rows = np.arange(len(self.group))[rows]
        rows = rows[np.lexsort((self.at[rows], self.arc[rows], self.group[rows]))]
        group = np.unique(self.group[rows], return_inverse=True)[1]
        return replace(self.take(rows), group=group.astype(np.intp))

    def places(self, p: JunctionParameters) -> tuple[Floats, Floats]:
        return locate_meetings(self.curve, self.at != INTERIOR, self.group, self.count, p)

    def misses(self, arcs: Arcs, place: Floats, p: JunctionParameters) -> Floats:
        """By how far (px) each passes its group's place, zero where it takes part there."""
        along, across = self.curve.locate(*place[self.group].T)
        return np.where(take_part(arcs, self.arc, self.curve, along, across, p), 0.0, np.abs(across) + 1e-9)


def locate_meetings(
    curve: OsculatingCircles,
    is_end: Bools,
    group: Indices,
    count: int,
    p: JunctionParameters,
    begin: Floats | None = None,
) -> tuple[Floats, Floats]:
    """Places (count, 2) where the curves of each group meet, and their covariances (count, 2, 2): Gauss and Newton from
    `begin`, or from the middle of the curves' own places."""
    if begin is None:
        number = np.bincount(group, minlength=count)
        begin = np.column_stack([np.bincount(group, c, count) / number for c in (curve.x, curve.y)])
    place, covariance = begin, np.zeros((count, 2, 2))
    for _ in range(4):
        along, across = curve.locate(*place[group].T)
        normal = curve.normals(along[:, None])[:, 0]
        tangent = np.column_stack([normal[:, 1], -normal[:, 0]])
        sigma = curve.sigma(np.clip(along, -p.overrun, p.reach), p.min_sigma)
        information, gradient = np.zeros((count, 2, 2)), np.zeros((count, 2))
        for axis, distance, weight in ((normal, across, sigma**-2), (tangent, along, is_end * p.end_sigma**-2)):
            for i in range(2):
                gradient[:, i] += np.bincount(group, weight * distance * axis[:, i], count)
                for j in range(i, 2):
                    information[:, i, j] += np.bincount(group, weight * axis[:, i] * axis[:, j], count)
        (xx, xy), (_, yy) = np.moveaxis(information, 0, -1)
        covariance = np.moveaxis(np.array([[yy, -xy], [-xy, xx]]) / (xx * yy - xy * xy), -1, 0)
        move = np.einsum("nij,nj->ni", covariance, gradient)
        place = place - move / np.maximum(np.linalg.norm(move, axis=1, keepdims=True) / p.reach, 1.0)
    return place, covariance


def take_part(
    arcs: Arcs, arc: Indices, curve: OsculatingCircles, along: Floats, across: Floats, p: JunctionParameters
) -> Bools:
    """Whether curves pass by a place `along` and `across` from them, and that lies where ends may be prolonged to."""
    near = np.abs(across) <= np.maximum(p.max_off, p.max_off_sigmas * curve.sigma(along, p.min_sigma))
    return np.asarray(
        near & (along <= p.reach) & (along >= -np.minimum(p.overrun, p.max_overrun_share * arcs.length[arc]))
    )
