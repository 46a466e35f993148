"""Integrals over u of the densities of area, moments and flux of one free-form surface, by polynomials in cells.

On each cell of the domain, within which the surface is smooth, the densities become Legendre series in u and v, whose
integrals over u are series again.  Cells are halved where the series' last terms do not vanish.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numpy.polynomial import legendre

from relmodel.geometry.curves import groups
from relmodel.geometry.surfaces import Surfaces

Array = npt.NDArray[np.float64]

_TERMS = 12  # of a series in each direction
_TAIL = 3  # terms that are to vanish
_TOLERANCE = 1e-9  # of a term that vanishes in a cell, to the first of all cells together
_MOST_CELLS = 512

_NODES, _WEIGHTS = legendre.leggauss(_TERMS)
# Coefficients of a series from its values at the nodes.
_ANALYSIS = legendre.legvander(_NODES, _TERMS - 1).T * _WEIGHTS * (np.arange(_TERMS)[:, None] + 0.5)
# Coefficients of the integral from -1 of a series, from those of the series.
_INTEGRAL = legendre.legint(np.eye(_TERMS), lbnd=-1, axis=0)


class Antiderivative:
    """Integrals from the least u of a surface's domain to u, at v, of the densities of `masses.face_integrals`."""

    def __init__(self, surfaces: Surfaces, row: int, about: Array) -> None:
        self._surfaces, self._row, self._about = surfaces, row, about
        self._u, self._v = surfaces.cuts(row, *surfaces.domain[row])
        series = self._series()
        while (len(self._u) - 1) * (len(self._v) - 1) < _MOST_CELLS:
            size = np.abs(series) * (np.diff(self._u)[:, None] * np.diff(self._v))[:, :, None, None, None]
            least = _TOLERANCE * size[:, :, 0, 0].sum(axis=(0, 1))
            along_u = np.any(size[:, :, -_TAIL:] > least, axis=(1, 2, 3, 4))
            along_v = np.any(size[:, :, :, -_TAIL:] > least, axis=(0, 2, 3, 4))
            if not (along_u.any() or along_v.any()):
                break
            self._u, self._v = _halved(self._u, along_u), _halved(self._v, along_v)
            series = self._series()
        self._integral = np.einsum(
            "ki,abijc->abkjc", _INTEGRAL, series * (np.diff(self._u) / 2)[:, None, None, None, None]
        )
        whole = self._integral.sum(axis=2)  # at the right side, where every Legendre polynomial is 1
        self._before = np.cumsum(whole, axis=0) - whole

    def __call__(self, u: Array, v: Array) -> Array:
        """Integrals (n, 5): of the element of area, of it times x y z, and of normal times the vector from `about`."""
        i, a = _local(self._u, u)
        j, b = _local(self._v, v)
        p, q = legendre.legvander(a, _TERMS), legendre.legvander(b, _TERMS - 1)
        out = np.empty((len(u), 5))
        for cell, at in groups(i * (len(self._v) - 1) + j):
            integral, before = (x[divmod(cell, len(self._v) - 1)] for x in (self._integral, self._before))
            along_u = (p[at] @ integral.reshape(_TERMS + 1, -1)).reshape(-1, _TERMS, 5) + before
            out[at] = np.einsum("nj,njc->nc", q[at], along_u)
        return out

    def _series(self) -> Array:
        """Coefficients (cells in u, cells in v, terms in u, terms in v, 5)."""
        u, v = (((c[1:] + c[:-1]) / 2)[:, None] + (np.diff(c) / 2)[:, None] * _NODES for c in (self._u, self._v))
        at = self._surfaces.evaluate_grid(self._row, u.ravel(), v.ravel())
        normal = np.cross(at.by_u, at.by_v)
        element = np.linalg.norm(normal, axis=1)[:, None]
        flux = np.einsum("nd,nd->n", normal, at.points - self._about)[:, None]
        values = np.concatenate([element, element * at.points, flux], axis=1)
        values = values.reshape(len(u), _TERMS, len(v), _TERMS, 5)
        in_u = np.einsum("ik,akblc->abilc", _ANALYSIS, values)
        return np.asarray(np.einsum("jl,abilc->abijc", _ANALYSIS, in_u))


def _halved(cuts: Array, which: npt.NDArray[np.bool_]) -> Array:
    return np.sort(np.concatenate([cuts, ((cuts[1:] + cuts[:-1]) / 2)[which]]))


def _local(cuts: Array, t: Array) -> tuple[npt.NDArray[np.int64], Array]:
    """Cell of each parameter and its place within, -1 to 1; beyond the ends the outmost cells go on."""
    cell = np.clip(np.searchsorted(cuts, t, side="right") - 1, 0, len(cuts) - 2)
    return cell, (2 * t - cuts[cell] - cuts[cell + 1]) / (cuts[cell + 1] - cuts[cell])
