"""Areas, centroids and volumes of faces, exact to quadrature, from rows alone.

By Green's theorem in the (u, v) domain an integral over a face is one along its coedges: the inner integral over u
has a closed form for planes and surfaces of revolution of lines and circles, and goes by polynomials for others
(`free_masses.py`); the outer one goes by Gauss-Legendre over the smooth pieces of the coedges.  (The kernel's own
integrals are off by up to a hundredth on long curved boundaries and on splines.)
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from relmodel.geometry.curves import Curves, groups
from relmodel.geometry.surfaces import ANALYTIC_KINDS, Surfaces
from relmodel.loading.free_masses import Antiderivative
from relmodel.loading.neutral import Table
from relmodel.loading.trims import Trims

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.int64]

_GAUSS = 16
_GAP = 0.01  # between the ends of a loop that closes, of the domain's extent


def face_integrals(
    surfaces: Surfaces, curves: Curves, coedges: Table, pcurves: Table, about: npt.ArrayLike = (0.0, 0.0, 0.0)
) -> Array:
    """Area, first moments x y z, and outward flux of the vector from the point `about`, (n, 5).

    The flux of all faces of a solid is three times its volume, wherever the point is; one amid the solid lets the gaps
    between faces count least.  NaN where a loop of a face does not close in (u, v), or nothing bounds it.
    """
    trims = Trims(surfaces, curves, coedges, pcurves)
    coedge, start, end = trims.pieces(np.flatnonzero(~trims.level()))
    nodes, node_weights = np.polynomial.legendre.leggauss(_GAUSS)
    half, middle = (end - start) / 2, (end + start) / 2
    t = (middle[:, None] + half[:, None] * nodes).ravel()
    coedge = np.repeat(coedge, _GAUSS)
    uv, by = trims.evaluate(coedge, t)
    weight = trims.sign[coedge] * (half[:, None] * node_weights).ravel() * by[:, 1]
    surface = trims.surface[coedge]
    kind = surfaces.kind[surface]

    point = np.asarray(about, float)
    values = np.zeros((len(surface), 5))
    flat = np.flatnonzero(kind == "plane")
    values[flat] = _plane(surfaces, surface[flat], uv[flat, 0], uv[flat, 1], point)
    turned = np.flatnonzero(np.isin(kind.astype(str), ANALYTIC_KINDS) & (kind != "plane"))
    values[turned] = _round(surfaces, surface[turned], uv[turned, 0], uv[turned, 1], point)
    free = np.flatnonzero(~np.isin(kind.astype(str), ANALYTIC_KINDS))
    for one, where in groups(surface[free]):
        here = free[where]
        values[here] = Antiderivative(surfaces, one, point)(uv[here, 0], uv[here, 1])

    out = np.zeros((len(surfaces), 5))
    np.add.at(out, surface, weight[:, None] * values)
    out[:, 4] *= np.where(surfaces.reversed, -1.0, 1.0)
    out[~_closed(trims, np.asarray(coedges["loop_no"], np.int64))] = np.nan
    return out


def _closed(trims: Trims, loop: Index) -> npt.NDArray[np.bool_]:
    """Whether each face has loops and all of them close in (u, v)."""
    count = len(trims.surfaces)
    key, inverse = np.unique(trims.surface + count * loop, return_inverse=True)
    across = np.zeros((len(key), 2))
    np.add.at(across, inverse.ravel(), trims.across(np.arange(len(trims.arc))))
    domain = trims.surfaces.domain[key % count]
    extent = domain[:, 1::2] - domain[:, ::2]
    closed = np.zeros(count, bool)
    closed[trims.surface] = True
    closed[key[~np.all(np.abs(across) <= _GAP * extent, axis=1)] % count] = False
    return closed


def _plane(surfaces: Surfaces, row: Index, u: Array, v: Array, about: Array) -> Array:
    o, x, y = surfaces.origin[row], surfaces.x[row], surfaces.y[row]
    moment = u[:, None] * (o + u[:, None] / 2 * x + v[:, None] * y)
    flux = u * np.einsum("nd,nd->n", o - about, np.cross(x, y))
    return np.column_stack([u, moment, flux])


def _round(surfaces: Surfaces, row: Index, u: Array, v: Array, about: Array) -> Array:
    """Integrals from 0 to u of a surface O + across(v) e(u) + height(v) Z."""
    kind = surfaces.kind[row]
    o, x, y, z = (a[row] for a in (surfaces.origin, surfaces.x, surfaces.y, surfaces.z))
    big, a = surfaces.radius[row], np.nan_to_num(surfaces.semi_angle[row])
    tube = np.where(kind == "torus", surfaces.radius2[row], big)
    ruled = (kind == "cylinder") | (kind == "cone")
    a = np.where(kind == "cone", a, 0.0)
    across = np.where(ruled, big + v * np.sin(a), np.where(kind == "torus", big, 0.0) + tube * np.cos(v))
    height = np.where(ruled, v * np.cos(a), tube * np.sin(v))
    across_by = np.where(ruled, np.sin(a), -tube * np.sin(v))
    height_by = np.where(ruled, np.cos(a), tube * np.cos(v))
    element = np.abs(across) * np.hypot(across_by, height_by)
    swept = np.sin(u)[:, None] * x - np.cos(u)[:, None] * y  # the integral of e(u)
    moment = element[:, None] * (u[:, None] * (o + height[:, None] * z) + across[:, None] * swept)
    hand = np.einsum("nd,nd->n", np.cross(x, y), z)
    normal_e, normal_z = hand * across * height_by, -hand * across * across_by
    arm = o - about
    along_z = np.einsum("nd,nd->n", arm, z) + height
    flux = normal_e * (np.einsum("nd,nd->n", arm, swept) + across * u) + normal_z * along_z * u
    return np.column_stack([element * u, moment, flux])
