"""What is measured on the triangles of a shape: how far they are from the exact geometry, and whether they close."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from relmodel.arrays import Bools, Floats, Ints
from relmodel.geometry.curves import Curves
from relmodel.geometry.distances import distances
from relmodel.geometry.surfaces import Surfaces

_ENOUGH = 0.25  # of the chord: what is nearer is not worth a foot point
WELD_MM = 1e-5  # vertices of faces that are nearer to each other are one
_RULED = ("cylinder", "cone", "extrusion")


class HalfEdges(NamedTuple):
    """The sides of triangles, three each, after each other.

    tail, head: vertices; bare: whether no other side runs back along it, as vertices of faces are apart.
    """

    tail: Ints
    head: Ints
    bare: Bools

    @classmethod
    def of(cls, triangles: npt.NDArray[np.integer]) -> HalfEdges:
        """Sides of triangles (m, 3)."""
        tail, head = triangles.astype(np.int64).ravel(), np.roll(triangles, -1, axis=1).astype(np.int64).ravel()
        count = int(tail.max(initial=0)) + 1
        there, back = tail * count + head, np.sort(head * count + tail)
        return cls(tail, head, np.take(back, np.searchsorted(back, there), mode="clip") != there)


def surface_deviation(
    surfaces: Surfaces,
    vertices: Floats,
    uv: Floats,
    triangles: npt.NDArray[np.integer],
    sides: HalfEdges,
    owner: Ints,
    chord_mm: float,
) -> float:
    """Greatest distance of midpoints of sides and of centroids of triangles (m, 3) from curved surfaces (m,), mm.

    vertices (n, 3), their parameters uv (n, 2); of free-form surfaces an upper bound, exact to a quarter of the chord.
    """
    kind = surfaces.kind[owner].astype(str)
    round_ = np.flatnonzero(~np.isin(kind, ("plane", *_RULED)))  # of the others a side is the farthest
    once = np.flatnonzero(((sides.tail < sides.head) | sides.bare) & np.repeat(kind != "plane", 3))
    worst = 0.0
    for *nodes, row in (
        (sides.tail[once], sides.head[once], np.repeat(owner, 3)[once]),
        (*triangles[round_].T, owner[round_]),
    ):
        middle, at = (sum(values[node] for node in nodes) / len(nodes) for values in (vertices, uv))
        worst = max(worst, float(distances(surfaces, row, middle, at, _ENOUGH * chord_mm).max(initial=0.0)))
    return worst


def flat_deviation(surfaces: Surfaces, vertices: Floats, owner: Ints) -> float:
    """Greatest distance of vertices (n, 3) of flat faces from their planes `owner` (n,), mm."""
    flat = np.flatnonzero(surfaces.kind[owner] == "plane")
    uv = np.zeros((len(flat), 2))
    return float(distances(surfaces, owner[flat], vertices[flat], uv, 0.0).max(initial=0.0))


def arc_deviation(curves: Curves, arc: Ints, start: Floats, end: Floats) -> float:
    """Greatest distance of arcs (n,) midway between parameters start and end (n,) from their chords there, mm."""
    if not len(arc):
        return 0.0
    first, middle, last = (curves.evaluate(arc, t)[0] for t in (start, (start + end) / 2, end))
    along, arm = last - first, middle - first
    square = np.einsum("nd,nd->n", along, along)
    share = np.clip(np.einsum("nd,nd->n", arm, along) / np.where(square > 0, square, 1.0), 0.0, 1.0)
    return float(np.linalg.norm(arm - share[:, None] * along, axis=1).max())


def open_edges(vertices: Floats, sides: HalfEdges) -> int:
    """How many sides of triangles lack a neighbour once vertices (n, 3) at one place are one."""
    used, ends = np.unique(np.stack([sides.tail[sides.bare], sides.head[sides.bare]]), return_inverse=True)
    places, ends = vertices[used], ends.reshape(2, -1)
    found = _unpaired(places, ends)
    return found and min(found, _unpaired(np.round(places / WELD_MM), ends))


def _unpaired(places: Floats, ends: Ints) -> int:
    """How many directed edges (2, m) between places (n, 3) no other one runs back along."""
    place = np.unique(places + 0.0, axis=0, return_inverse=True)[1].ravel()  # no -0.0
    tail, head = place[ends]
    edge = np.unique(np.minimum(tail, head) * len(places) + np.maximum(tail, head), return_inverse=True)[1]
    return int(np.abs(np.bincount(edge.ravel(), np.sign(head - tail))).sum())
