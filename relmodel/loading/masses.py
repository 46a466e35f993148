"""Areas, centroids and volumes of analytic and extruded faces, exact to quadrature, from rows alone.

By Green's theorem in the (u, v) domain an integral over a face is one along its coedges: the inner integral over u
has a closed form for each kind, the outer one goes by Gauss-Legendre over the smooth pieces of the arcs.  (The
kernel's own integrals are off by up to a hundredth on long curved boundaries and on splines.)
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from relmodel.geometry.curves import Curves
from relmodel.geometry.pcurves import Pcurves
from relmodel.geometry.surfaces import ANALYTIC_KINDS, Surfaces
from relmodel.loading.brep import pcurve_of
from relmodel.loading.neutral import Table

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.int64]

_GAUSS = 20


def face_integrals(surfaces: Surfaces, curves: Curves, coedges: Table, pcurves: Table) -> Array:
    """Area, first moments x y z, and outward flux of the position vector (three times the volume), (n, 5).

    NaN for surfaces of other kinds than the analytic ones and extrusions.
    """
    surface, arc, t, weight, u, v = _boundary(surfaces, curves, coedges, pcurves, ANALYTIC_KINDS)
    at = surfaces.evaluate(surface, u, v)
    by_t = curves.evaluate(arc, t)[1]
    weight = weight * np.einsum("nd,nd->n", by_t, at.by_v) / np.einsum("nd,nd->n", at.by_v, at.by_v)
    values = np.where(
        (surfaces.kind[surface] == "plane")[:, None],
        _plane(surfaces, surface, u, v),
        _round(surfaces, surface, u, v),
    )
    out = np.zeros((len(surfaces), 5))
    np.add.at(out, surface, weight[:, None] * values)
    _add_extrusions(out, surfaces, curves, coedges, pcurves)
    out[:, 4] *= np.where(surfaces.reversed, -1.0, 1.0)
    out[~np.isin(surfaces.kind.astype(str), (*ANALYTIC_KINDS, "extrusion"))] = np.nan
    return out


def _boundary(
    surfaces: Surfaces, curves: Curves, coedges: Table, pcurves: Table, kinds: tuple[str, ...]
) -> tuple[Index, Index, Array, Array, Array, Array]:
    """Gauss points along the coedges of faces of some kinds: surface, arc, t, signed weight in t, unwrapped u and v."""
    analytic = np.isin(surfaces.kind.astype(str), kinds)
    used = np.flatnonzero(analytic[coedges["surface_no"]] & (curves.kind[coedges["arc_no"]] != "degenerate"))
    span_arc, start, end = curves.spans()
    first = np.searchsorted(span_arc, np.arange(len(curves)))
    count = np.bincount(span_arc, minlength=len(curves))[coedges["arc_no"][used]]
    piece = np.repeat(np.arange(len(used)), count)
    within = np.arange(len(piece)) - np.repeat(np.cumsum(count) - count, count)
    span = first[coedges["arc_no"][used]][piece] + within
    nodes, node_weights = np.polynomial.legendre.leggauss(_GAUSS)
    half, middle = (end[span] - start[span]) / 2, (end[span] + start[span]) / 2
    t = (middle[:, None] + half[:, None] * nodes).ravel()
    coedge = np.repeat(used[piece], _GAUSS)
    surface, arc = coedges["surface_no"][coedge], coedges["arc_no"][coedge]
    # Along the coedge material is to the left seen from outside: anticlockwise in (u, v) unless reversed.
    sign = np.where(coedges["reversed"][coedge] != surfaces.reversed[surface], -1.0, 1.0)
    weight = sign * (half[:, None] * node_weights).ravel()
    u, v = surfaces.parameters(surface, curves.evaluate(arc, t)[0])
    row = pcurve_of(coedges, pcurves)[coedge]
    drawn = np.flatnonzero((row >= 0) & (surfaces.kind[surface] != "plane"))
    near = Pcurves(pcurves).evaluate(row[drawn], t[drawn])
    if "extrusion" in kinds:
        u[drawn], v[drawn] = near.T
        return surface, arc, t, weight, u, v
    u[drawn] += 2 * np.pi * np.round((near[:, 0] - u[drawn]) / (2 * np.pi))
    turns = np.where(surfaces.kind[surface[drawn]] == "torus", np.round((near[:, 1] - v[drawn]) / (2 * np.pi)), 0.0)
    v[drawn] += 2 * np.pi * turns
    return surface, arc, t, weight, u, v


def _plane(surfaces: Surfaces, row: Index, u: Array, v: Array) -> Array:
    o, x, y = surfaces.origin[row], surfaces.x[row], surfaces.y[row]
    moment = u[:, None] * (o + u[:, None] / 2 * x + v[:, None] * y)
    flux = u * np.einsum("nd,nd->n", o, np.cross(x, y))
    return np.column_stack([u, moment, flux])


def _round(surfaces: Surfaces, row: Index, u: Array, v: Array) -> Array:
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
    along_z = np.einsum("nd,nd->n", o, z) + height
    flux = normal_e * (np.einsum("nd,nd->n", o, swept) + across * u) + normal_z * along_z * u
    return np.column_stack([element * u, moment, flux])


def _add_extrusions(out: Array, surfaces: Surfaces, curves: Curves, coedges: Table, pcurves: Table) -> None:
    """Integrals over extrusions C(u) + v D: there the inner integral over v has the closed form."""
    surface, arc, t, weight, u, _ = _boundary(surfaces, curves, coedges, pcurves, ("extrusion",))
    if not len(surface) or surfaces.basis_curves is None:
        return
    basis = np.array([surfaces.swept[int(one)][0] for one in surface])
    d = np.array([surfaces.swept[int(one)][2] for one in surface])
    points, by_t = curves.evaluate(arc, t)
    c, c_by = surfaces.basis_curves.evaluate(basis, u)
    v = np.einsum("nd,nd->n", points - c, d)
    normal = np.cross(c_by, d)
    across = np.cross(d, normal)  # the part of C' across D
    u_by = np.einsum("nd,nd->n", by_t, across) / np.einsum("nd,nd->n", c_by, across)
    element = np.linalg.norm(normal, axis=1)
    moment = element[:, None] * (v[:, None] * c + (v * v / 2)[:, None] * d)
    flux = v * np.einsum("nd,nd->n", c, normal)
    np.add.at(out, surface, -(weight * u_by)[:, None] * np.column_stack([v * element, moment, flux]))
