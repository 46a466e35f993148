"""Regions of a mesh whose faces are known: each face is one region, of the kind of surface that its triangles tell."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from relmodel.readers.mesh.fitted import surface_rows
from relmodel.readers.mesh.regions import Regions, cut_regions
from relmodel.readers.mesh.triangles import Edges

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

_SKEW = 2e-3  # how far unit normals of a cylinder or cone, given to six digits, may be from a plane
_TURN = 0.02  # normals that spread less are those of a plane


def face_regions(
    vertices: Floats, triangles: Ints, edges: Edges, faces: Ints, tolerance: float, normals: Floats | None = None
) -> Regions:
    """Regions, one for each of the faces (m,), in their order: `faces` rises.

    The mesh is cut as if each face stood alone.  Where that gives several regions, the face is the surface of the
    largest if all its vertices lie on that; else, where the source gives `normals` (m, 3, 3) at the triangles'
    corners, the cylinder, sphere or cone that these and the vertices determine; else free-form.
    """
    _, of_triangle = np.unique(faces, return_inverse=True)
    of_triangle = of_triangle.ravel()
    cut = cut_regions(vertices, triangles, _apart(edges, of_triangle), tolerance)
    corner = vertices[triangles]
    area = np.linalg.norm(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1)
    size = np.bincount(cut.of_triangle, area)
    count = int(of_triangle.max()) + 1
    face_of = np.zeros(len(size), np.int64)
    face_of[cut.of_triangle] = of_triangle
    largest = np.lexsort((-size, face_of))[np.searchsorted(np.sort(face_of), np.arange(count))]
    out = Regions(of_triangle, cut.kind[largest].astype("U8"), cut.surface[largest].copy())
    several = np.bincount(face_of, minlength=count) > 1
    away = np.asarray(surface_rows(vertices, triangles, out)[0]["residual"])
    for face in np.flatnonzero((out.kind == "facets") | several & (away > tolerance)).tolist():
        mine = of_triangle == face
        found = None if normals is None else _by_normals(corner[mine], normals[mine], tolerance)
        out.kind[face], out.surface[face] = found or ("facets", np.full(10, np.nan))
    return out


def _by_normals(corners: Floats, normals: Floats, tolerance: float) -> tuple[str, Floats] | None:
    """Kind and numbers (as `distance_kernels` has them) of the surface of points and their normals, by linear algebra:
    p = c + R n on a sphere, the same across the axis on a cylinder; n . (p - apex) = 0 on a cone."""
    p, n = corners.reshape(-1, 3), normals.reshape(-1, 3)
    limit = _SKEW * np.sqrt(len(n))
    mean = n.mean(axis=0)
    _, spread, across = np.linalg.svd(n, full_matrices=False)
    _, spread_about, axes = np.linalg.svd(n - mean, full_matrices=False)
    row = np.zeros(10)
    if spread[2] < limit and spread_about[0] > _TURN * np.sqrt(len(n)):
        axis, flat = across[2], across[:2]
        (cu, cv), radius = _centre(p @ flat.T, n @ flat.T)
        row[:3], row[3:6], row[6] = cu * flat[0] + cv * flat[1], axis, abs(radius)
        kind, away = "cylinder", np.linalg.norm((p - row[:3]) @ flat.T, axis=1) - abs(radius)
    elif spread_about[2] < limit and spread_about[1] > _TURN * np.sqrt(len(n)):
        apex = np.linalg.lstsq(n, np.sum(n * p, axis=1), rcond=None)[0]
        axis = axes[2] if np.mean((p - apex) @ axes[2]) > 0 else -axes[2]
        half = np.arcsin(min(abs(float(mean @ axis)), 1.0))
        row[:3], row[3:6], row[7:] = apex, axis, (half, np.cos(half), np.sin(half))
        along = (p - apex) @ axis
        kind = "cone"
        away = np.linalg.norm(p - apex - along[:, None] * axis, axis=1) * np.cos(half) - along * np.sin(half)
    elif spread_about[2] >= limit:
        centre, radius = _centre(p, n)
        row[:3], row[3:6], row[6] = centre, (0.0, 0.0, 1.0), abs(radius)
        kind, away = "sphere", np.linalg.norm(p - row[:3], axis=1) - abs(radius)
    else:
        return None
    return (kind, row) if np.abs(away).max() <= tolerance else None


def _centre(p: Floats, n: Floats) -> tuple[Floats, float]:
    """Centre c and radius R of p = c + R n (k, d) by least squares."""
    d = p.shape[1]
    system = np.column_stack([np.repeat(np.eye(d), len(p), axis=0), n.T.ravel()])
    found = np.linalg.lstsq(system, p.T.ravel(), rcond=None)[0]
    return np.asarray(found[:d], float), float(found[d])


def _apart(edges: Edges, face: Ints) -> Edges:
    """The edges, those between two faces once for each of them."""
    between = (edges.triangle_b >= 0) & (face[edges.triangle_a] != face[edges.triangle_b])
    alone = np.full(int(between.sum()), -1)
    return Edges(
        np.concatenate([edges.ends, edges.ends[between][:, ::-1]]),
        np.concatenate([edges.triangle_a, edges.triangle_b[between]]),
        np.concatenate([np.where(between, -1, edges.triangle_b), alone]),
        np.concatenate([np.where(between, np.nan, edges.angle), np.full(len(alone), np.nan)]),
    )
