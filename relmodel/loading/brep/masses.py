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
from relmodel.loading.brep.free_masses import Antiderivative
from relmodel.loading.brep.trims import Trims
from relmodel.loading.neutral import Table

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.int64]

_GAUSS = 16
_GAUSS_POLYNOMIAL = 4  # exact to the seventh degree
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
    few = trims.polynomial()[coedge]
    out = np.zeros((len(surfaces), 5))
    for at, nodes in ((np.flatnonzero(few), _GAUSS_POLYNOMIAL), (np.flatnonzero(~few), _GAUSS)):
        out += _sums(trims, coedge[at], start[at], end[at], nodes, np.asarray(about, float))
    out[:, 4] *= np.where(surfaces.reversed, -1.0, 1.0)
    out[~_closed(trims, np.asarray(coedges["loop_no"], np.int64))] = np.nan
    return out


def _sums(trims: Trims, coedge: Index, start: Array, end: Array, nodes: int, about: Array) -> Array:
    """What pieces of coedges add to the integrals over their faces (n, 5), by as many nodes for each piece."""
    surfaces = trims.surfaces
    places, weights = np.polynomial.legendre.leggauss(nodes)
    half, middle = (end - start) / 2, (end + start) / 2
    coedge = np.repeat(coedge, nodes)
    uv, by = trims.evaluate(coedge, (middle[:, None] + half[:, None] * places).ravel())
    weight = trims.sign[coedge] * (half[:, None] * weights).ravel() * by[:, 1]
    surface = trims.surface[coedge]
    u, v = uv.T
    values = np.zeros((len(surface), 5))
    for kind, at in surfaces.by_kind.of(surface):
        if kind == "plane":
            values[at] = _plane(surfaces, surface[at], u[at], v[at], about)
        elif kind in ANALYTIC_KINDS:
            values[at] = _round(surfaces, kind, surface[at], u[at], v[at], about)
        else:
            for one, where in groups(surface[at]):
                here = at[where]
                values[here] = Antiderivative(surfaces, one, about)(u[here], v[here])
    values *= weight[:, None]
    return np.stack([np.bincount(surface, column, len(surfaces)) for column in values.T], axis=1)


def _closed(trims: Trims, loop: Index) -> npt.NDArray[np.bool_]:
    """Whether each face has loops and all of them close in (u, v)."""
    count = len(trims.surfaces)
    key = trims.surface + count * loop
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
    o, x, y = surfaces.origin[row], surfaces.x[row], surfaces.y[row]
    # From the middle of the domain on: what is left open by round-off counts by its distance from there.
    middle = (surfaces.domain[row, 0] + surfaces.domain[row, 1]) / 2
    halfway, u = (u + middle) / 2, u - middle
    moment = u[:, None] * (o + halfway[:, None] * x + v[:, None] * y)
    flux = u * np.einsum("nd,nd->n", o - about, np.cross(x, y))
    return np.column_stack([u, moment, flux])


def _round(surfaces: Surfaces, kind: str, row: Index, u: Array, v: Array, about: Array) -> Array:
    """Integrals from 0 to u of surfaces of one kind, O + across(v) e(u) + height(v) Z."""
    o, x, y, z = (a[row] for a in (surfaces.origin, surfaces.x, surfaces.y, surfaces.z))
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
    swept = np.sin(u)[:, None] * x - np.cos(u)[:, None] * y  # the integral of e(u)
    moment = element[:, None] * (u[:, None] * (o + height[:, None] * z) + across[:, None] * swept)
    hand = surfaces.hand[row]
    normal_e, normal_z = hand * across * height_by, -hand * across * across_by
    arm = o - about
    along_z = np.einsum("nd,nd->n", arm, z) + height
    flux = normal_e * (np.einsum("nd,nd->n", arm, swept) + across * u) + normal_z * along_z * u
    return np.column_stack([element * u, moment, flux])
