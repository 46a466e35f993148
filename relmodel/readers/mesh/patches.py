"""Patches of a mesh: triangles that lie in one plane as exactly as their vertices are given."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from relmodel.readers.mesh.triangles import Edges, area_normals, components, mean_planes, rounding, slim

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]

FLAT_RAD = np.radians(0.5)  # facets that turn less belong to one plane, if it then is one
FREE_RAD = np.radians(20)  # strips of a free-form surface turn less
WIDE = 3.0  # how much wider than its smooth neighbours a flat region must be, to be a plane that they run into


@dataclass
class Patches:
    """Patches of coplanar triangles: of each triangle its patch; of each patch area, width, and whether it is flat;
    creases between neighbours as a graph (CSR, both ways)."""

    of_triangle: Ints
    area: Floats
    width: Floats
    flat: Bools
    start: Ints
    other: Ints
    length: Floats
    angle: Floats  # mean over the crease, without sign

    def owners(self) -> Ints:
        """The patch that each crease is of."""
        return np.repeat(np.arange(len(self.area)), np.diff(self.start))


def cut_patches(vertices: Floats, triangles: Ints, edges: Edges, tolerance: float) -> Patches:
    """The patches of a mesh."""
    inner = edges.triangle_b >= 0
    a, b, angle = edges.triangle_a[inner], edges.triangle_b[inner], np.abs(edges.angle[inner])
    length = np.linalg.norm(np.diff(vertices[edges.ends[inner]], axis=1)[:, 0], axis=1)
    normal = area_normals(vertices, triangles)
    double = 2 * np.linalg.norm(normal, axis=1)
    # Only the larger triangle tells how far the other's corner is from a common plane; a thin one tells no direction.
    fine = rounding(vertices)
    thin = slim(vertices, triangles)
    height = np.minimum(double[a], double[b]) / length
    flat = (height * np.sin(angle) < 4 * fine) & (angle < FREE_RAD) & ~thin[a] & ~thin[b]
    patch = components(len(triangles), a[flat], b[flat])
    bad = mean_planes(vertices, triangles, patch)[0] > tolerance
    flat &= ~bad[patch[a]] | (angle < FLAT_RAD / 10)
    # A thin triangle goes with what lies beyond its longest side.
    side = np.concatenate([np.stack([a, b, length], axis=1), np.stack([b, a, length], axis=1)])
    side = side[thin[side[:, 0].astype(np.int64)]]
    side = side[np.lexsort((side[:, 1], -side[:, 2], side[:, 0]))]
    _, first = np.unique(side[:, 0], return_index=True)
    along = side[first].astype(np.int64)
    patch = components(len(triangles), np.concatenate([a[flat], along[:, 0]]), np.concatenate([b[flat], along[:, 1]]))
    return describe_patches(vertices, triangles, edges, patch, tolerance)


def regrouped(vertices: Floats, triangles: Ints, edges: Edges, label: Ints, tolerance: float) -> tuple[Patches, Ints]:
    """Patches of triangles of equal label, and the first triangle of each."""
    _, first, patch = np.unique(label, return_index=True, return_inverse=True)
    return describe_patches(vertices, triangles, edges, patch.ravel(), tolerance), first


def describe_patches(vertices: Floats, triangles: Ints, edges: Edges, patch: Ints, tolerance: float) -> Patches:
    """What is told of the patches that labels of triangles make."""
    inner = edges.triangle_b >= 0
    a, b, angle = edges.triangle_a[inner], edges.triangle_b[inner], np.abs(edges.angle[inner])
    length = np.linalg.norm(np.diff(vertices[edges.ends[inner]], axis=1)[:, 0], axis=1)
    planar = mean_planes(vertices, triangles, patch)[0] <= tolerance
    count = len(planar)
    size = np.linalg.norm(area_normals(vertices, triangles), axis=1)
    area: Floats = np.bincount(patch, size, minlength=count).astype(float)
    ends_a, ends_b = patch[edges.triangle_a], np.where(edges.triangle_b >= 0, patch[edges.triangle_b], -1)
    rim = np.linalg.norm(np.diff(vertices[edges.ends], axis=1)[:, 0], axis=1)
    rim = np.where(ends_a != ends_b, rim, 0.0)
    perimeter = np.bincount(ends_a, rim, minlength=count)
    perimeter += np.bincount(ends_b[inner], rim[inner], minlength=count)
    crease = patch[a] != patch[b]
    one, two = (
        np.concatenate([patch[a[crease]], patch[b[crease]]]),
        np.concatenate([patch[b[crease]], patch[a[crease]]]),
    )
    key, inverse = np.unique(one * np.int64(count) + two, return_inverse=True)
    total: Floats = np.bincount(inverse, np.tile(length[crease], 2), minlength=len(key)).astype(float)
    bent = np.bincount(inverse, np.tile(length[crease] * angle[crease], 2), minlength=len(key))
    return Patches(
        patch,
        area,
        2 * area / np.maximum(perimeter, 1e-300),
        planar,
        np.searchsorted(key, np.arange(count + 1) * np.int64(count)),
        key % count,
        total,
        bent / np.maximum(total, 1e-300),
    )
