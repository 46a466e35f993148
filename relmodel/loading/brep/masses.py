"""Areas, centroids and volumes of faces, exact to quadrature, from rows alone.

By Green's theorem in the (u, v) domain an integral over a face is one along its coedges: the inner integral over u
has a closed form for planes and surfaces of revolution of lines and circles, and goes by polynomials for others
(`free_masses.py`); the outer one goes by Gauss-Legendre over the smooth pieces of the coedges.  (The kernel's own
integrals are off by up to a hundredth on long curved boundaries and on splines.)
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from relmodel.geometry.components import dot, put, taken
from relmodel.geometry.curves import gauss
from relmodel.geometry.surfaces import ANALYTIC_KINDS, Surfaces
from relmodel.loading.brep.free_masses import Antiderivatives
from relmodel.model.trimmed_faces import Trims

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.int64]

_POLYNOMIAL_NODES = 2  # exact to the third degree
_MOST_NODES = 16
# Fewer do, to the last digits, for pieces that go as far as this at most (`Trims.pace`).
_NODES = ((5, 0.06), (6, 0.15), (8, 0.4))
_GAP = 0.01  # between the ends of a loop that closes, of the domain's extent


def face_integrals(trims: Trims, about: npt.ArrayLike = (0.0, 0.0, 0.0)) -> Array:
    """Area, first moments x y z, and outward flux of the vector from the point `about`, (n, 5) of n faces.

    about: (3,), or (n, 3) for each face.

    The flux of all faces of a solid is three times its volume, wherever the point is; one amid the solid lets the gaps
    between faces count least.  NaN where a loop of a face does not close in (u, v), or nothing bounds it.
    """
    surfaces = trims.surfaces
    coedge, start, end = trims.pieces(np.flatnonzero(~trims.level()))
    pace = trims.pace(coedge, start, end)
    polynomial = trims.polynomial()[coedge]
    nodes = np.select([polynomial, *(pace <= most for _, most in _NODES)], [_POLYNOMIAL_NODES, *(n for n, _ in _NODES)])
    nodes[nodes == 0] = _MOST_NODES
    coedge, t, weight = _quadrature(coedge, start, end, nodes)
    uv, by = trims.evaluate(coedge, t)
    weight *= trims.sign[coedge] * by[:, 1]
    surface = trims.surface[coedge]
    origin = np.broadcast_to(np.asarray(about, float), (len(surfaces), 3))
    values = weight * _densities(surfaces, surface, uv[:, 0], uv[:, 1], origin)
    out = np.stack([np.bincount(surface, row, len(surfaces)).astype(float) for row in values], axis=1)
    out[:, 4] *= np.where(surfaces.reversed, -1.0, 1.0)
    out[~_closed(trims)] = np.nan
    return out


def _quadrature(which: Index, start: Array, end: Array, nodes: Index) -> tuple[Index, Array, Array]:
    """Gauss-Legendre nodes of intervals by how many each gets: whose each is, the parameter and the weight."""
    found: list[tuple[Index, Array, Array]] = []
    for count in np.flatnonzero(np.bincount(nodes)).tolist():
        places, weights = gauss(count)
        at = np.flatnonzero(nodes == count)
        half, middle = (end - start)[at, None] / 2, (end + start)[at, None] / 2
        found.append((np.repeat(which[at], count), (middle + half * places).ravel(), (half * weights).ravel()))
    if not found:
        return which, start, end
    which, t, weight = (np.concatenate(parts) for parts in zip(*found, strict=True))
    return which, t, weight


def _densities(surfaces: Surfaces, surface: Index, u: Array, v: Array, about: Array) -> Array:
    """Integrals (5, n) of the densities over u, up to u at v."""
    values = np.zeros((5, len(surface)))
    free = []
    for kind, at in surfaces.by_kind.of(surface):
        if kind == "plane":
            put(values, at, _plane(surfaces, surface[at], u[at], v[at], about))
        elif kind in ANALYTIC_KINDS:
            put(values, at, _round(surfaces, kind, surface[at], u[at], v[at], about))
        else:
            free.append(np.arange(len(surface))[at])
    if free:
        at = np.concatenate(free)
        found = Antiderivatives(surfaces, np.flatnonzero(np.bincount(surface[at])), about)(surface[at], u[at], v[at])
        put(values, at, found.T)
    return values


def _closed(trims: Trims) -> npt.NDArray[np.bool_]:
    """Whether each face has loops and all of them close in (u, v)."""
    count = len(trims.surfaces)
    key = trims.surface + count * trims.loop
    ends = trims.across(np.arange(len(trims.arc)))
    across = np.stack([np.bincount(key, column) for column in ends.T], axis=1)
    key = np.flatnonzero(np.bincount(key))
    across = across[key]
    domain = trims.surfaces.domain[key % count]
    extent = domain[:, 1::2] - domain[:, ::2]
    closed = np.zeros(count, bool)
    closed[trims.surface] = True
    closed[key[~np.all(np.abs(across) <= _GAP * extent, axis=1)] % count] = False
    return closed


def _plane(surfaces: Surfaces, row: Index, u: Array, v: Array, about: Array) -> Array:
    o, x, y = (taken(axis, row) for axis in (surfaces.origin, surfaces.x, surfaces.y))
    # From the middle of the domain on: what is left open by round-off counts by its distance from there.
    middle = surfaces.domain[row, :2].mean(axis=1)
    halfway, u = (u + middle) / 2, u - middle
    moment = u * (o + halfway * x + v * y)
    flux = (surfaces.hand * dot((surfaces.origin - about).T, surfaces.z.T))[row]
    return np.stack([u, *moment, u * flux])


def _round(surfaces: Surfaces, kind: str, row: Index, u: Array, v: Array, about: Array) -> Array:
    """Integrals from 0 to u of surfaces of one kind, O + across(v) e(u) + height(v) Z."""
    o, x, y, z = (taken(a, row) for a in (surfaces.origin, surfaces.x, surfaces.y, surfaces.z))
    big = surfaces.radius[row]
    if kind in ("cylinder", "cone"):
        a = surfaces.semi_angle[row] if kind == "cone" else np.zeros(len(row))
        across_by, height_by = np.sin(a), np.cos(a)
        across, height = big + v * across_by, v * height_by
    else:
        tube = surfaces.radius2[row] if kind == "torus" else big
        height_by, height = tube * np.cos(v), tube * np.sin(v)
        across, across_by = height_by + (big if kind == "torus" else 0.0), -height
    element = np.abs(across) * np.hypot(across_by, height_by)
    swept = np.sin(u) * x - np.cos(u) * y  # the integral of e(u)
    moment = element * (u * (o + height * z) + across * swept)
    hand = surfaces.hand[row]
    normal_e, normal_z = hand * across * height_by, -hand * across * across_by
    arm = o - taken(about, row)
    along_z = dot(arm, z) + height
    flux = normal_e * (dot(arm, swept) + across * u) + normal_z * along_z * u
    return np.stack([element * u, *moment, flux])
