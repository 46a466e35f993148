"""What is measured on the triangles of a shape: how far they are from the exact geometry, and whether they close."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from relmodel.geometry.curves import Curves
from relmodel.geometry.distances import distances
from relmodel.geometry.surfaces import Surfaces

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.int64]

_ENOUGH = 0.25  # of the chord: what is nearer is not worth a foot point
_MIDDLES = np.array([[0.5, 0.5, 0.0], [0.0, 0.5, 0.5], [0.5, 0.0, 0.5], [1 / 3, 1 / 3, 1 / 3]])


def surface_deviation(
    surfaces: Surfaces, vertices: Array, uv: Array, triangles: npt.NDArray[np.integer], owner: Index, chord_mm: float
) -> float:
    """Greatest distance of the centroids and edge midpoints of triangles (m, 3) from their surfaces (m,), mm.

    vertices (n, 3), their parameters uv (n, 2); of free-form surfaces an upper bound, exact to a quarter of the chord.
    """
    curved = np.flatnonzero(surfaces.kind[owner] != "plane")
    corners, owner = triangles[curved], owner[curved]
    worst = 0.0
    for weights in _MIDDLES:
        middle, at = (np.tensordot(weights, values[corners], (0, 1)) for values in (vertices, uv))
        worst = max(worst, float(distances(surfaces, owner, middle, at, _ENOUGH * chord_mm).max(initial=0.0)))
    return worst


def arc_deviation(curves: Curves, arc: Index, start: Array, end: Array) -> float:
    """Greatest distance of arcs (n,) midway between parameters start and end (n,) from their chords there, mm."""
    if not len(arc):
        return 0.0
    first, middle, last = (curves.evaluate(arc, t)[0] for t in (start, (start + end) / 2, end))
    along, arm = last - first, middle - first
    square = np.einsum("nd,nd->n", along, along)
    share = np.clip(np.einsum("nd,nd->n", arm, along) / np.where(square > 0, square, 1.0), 0.0, 1.0)
    return float(np.linalg.norm(arm - share[:, None] * along, axis=1).max())


def open_edges(vertices: Array, triangles: npt.NDArray[np.integer]) -> int:
    """How many edges of triangles (m, 3) lack a neighbour once vertices (n, 3) at one place are one."""
    count = len(vertices)
    tail, head = triangles.T.astype(np.int64), np.roll(triangles, -1, axis=1).T.astype(np.int64)
    tail, head = tail.ravel(), head.ravel()
    # Within a face neighbours share vertices: only what is left is joined by place.
    bare = ~np.isin(tail * count + head, head * count + tail)
    ends = np.stack([tail[bare], head[bare]])
    used, ends = np.unique(ends, return_inverse=True)
    place = np.unique(vertices[used] + 0.0, axis=0, return_inverse=True)[1].ravel()  # no -0.0
    tail, head = place[ends.reshape(2, -1)]
    way = np.sign(head - tail)
    edge = np.minimum(tail, head) * len(used) + np.maximum(tail, head)
    _, edge = np.unique(edge, return_inverse=True)
    return int(np.abs(np.bincount(edge.ravel(), way)).sum())
