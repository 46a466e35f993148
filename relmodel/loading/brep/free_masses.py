"""Integrals over u of the densities of area, moments and flux of free-form surfaces, by polynomials in cells.

On each cell of a surface's domain, within which it is smooth, the densities become Legendre series in u and v, whose
integrals over u are series again.  Cells are halved where the series' last terms do not vanish.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from numpy.polynomial import legendre

from relmodel.geometry.components import cross, dot, taken
from relmodel.geometry.curves import groups
from relmodel.geometry.surfaces import Surfaces

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]

_TERMS = 12  # of a series in each direction
_TAIL = 3  # terms that are to vanish
_TOLERANCE = 1e-9  # of a term that vanishes in a cell, to the first of all cells together
_MOST_CELLS = 512  # of a surface
_DENSITIES = 5
# At a time, so that what is worked on stays in the cache.
_BLOCK = 64  # cells
_POINTS = 2048

_FEW_TERMS = 6  # along straight lines
_NODES = {n: legendre.leggauss(n)[0] for n in (_FEW_TERMS, _TERMS)}
# Coefficients of a series from its values at the nodes.
_ANALYSIS = {
    n: legendre.legvander(nodes, n - 1).T * legendre.leggauss(n)[1] * (np.arange(n)[:, None] + 0.5)
    for n, nodes in _NODES.items()
}
# Coefficients of the integral from -1 of a series, from those of the series.
_INTEGRAL = legendre.legint(np.eye(_TERMS), lbnd=-1, axis=0)


@dataclass(frozen=True)
class _Grid:
    """Cells of the domain of one surface, between cuts along u and along v; those of one interval of u follow."""

    row: int
    u: Array
    v: Array

    def __len__(self) -> int:
        return (len(self.u) - 1) * (len(self.v) - 1)

    def halved(self, unresolved: Bools) -> _Grid:
        """Halved in the intervals of u and of v that have a cell not resolved in this direction (2, cells)."""
        flags = unresolved.reshape(2, len(self.u) - 1, -1)
        return _Grid(self.row, _halved(self.u, flags[0].any(axis=1)), _halved(self.v, flags[1].any(axis=0)))


class Antiderivatives:
    """Integrals from the least u of a surface's domain to u, at v, of the densities of `masses.face_integrals`.

    rows: the surfaces that are asked for.  about: (n, 3), for each surface.
    """

    def __init__(self, surfaces: Surfaces, rows: Index, about: Array) -> None:
        self._grids: list[_Grid] = []
        resolved, befores = [], []
        pending = [_smooth(surfaces, row) for row in rows.tolist()]
        while pending:
            grids, pending = pending, []
            series, tails = _series(surfaces, grids, about)
            unresolved = _unresolved(grids, series, tails)
            ends = np.cumsum([len(grid) for grid in grids]).tolist()
            for grid, first, last in zip(grids, [0, *ends[:-1]], ends, strict=True):
                flags = unresolved[:, first:last]
                if flags.any() and len(grid) < _MOST_CELLS:
                    pending.append(grid.halved(flags))
                    continue
                self._grids.append(grid)
                resolved.append(series[:, first:last])
                # Over the width of a cell only the constant term of a series counts.
                whole = 2 * series[:, first:last, 0].reshape(_DENSITIES, len(grid.u) - 1, -1, _TERMS)
                befores.append((np.cumsum(whole, axis=1) - whole).reshape(_DENSITIES, -1, _TERMS))
        self._series, self._before = np.concatenate(resolved, axis=1), np.concatenate(befores, axis=1)
        count = np.array([len(grid) for grid in self._grids])
        self._first = dict(zip((grid.row for grid in self._grids), (np.cumsum(count) - count).tolist(), strict=True))

    def __call__(self, surface: Index, u: Array, v: Array) -> Array:
        """Integrals (n, 5): of the element of area, of it times x y z, and of normal times the vector from `about`."""
        cell, local = np.empty(len(u), np.int64), np.empty((2, len(u)))
        grids = {grid.row: grid for grid in self._grids}
        for row, at in groups(surface):
            grid = grids[row]
            (i, local[0, at]), (j, local[1, at]) = _local(grid.u, u[at]), _local(grid.v, v[at])
            cell[at] = self._first[row] + i * (len(grid.v) - 1) + j
        order = np.argsort(cell, kind="stable")
        out = np.empty((len(u), _DENSITIES))
        for begin in range(0, len(u), _POINTS):
            at = order[begin : begin + _POINTS]
            out[at] = self._integrals(cell[at], local[:, at])
        return out

    def _integrals(self, cell: Index, local: Array) -> Array:
        """Integrals (n, 5) at places (2, n) in cells (n,) of rising number."""
        first = np.flatnonzero(np.diff(cell, prepend=-1))
        cells = cell[first]
        integral = (
            (_INTEGRAL @ self._series[:, cells]).transpose(1, 2, 0, 3).reshape(-1, _TERMS + 1, _DENSITIES * _TERMS)
        )
        integral[:, 0] += self._before[:, cells].transpose(1, 0, 2).reshape(-1, _DENSITIES * _TERMS)
        p, q = legendre.legvander(local[0], _TERMS), legendre.legvander(local[1], _TERMS - 1)
        along_u = np.empty((len(cell), _DENSITIES * _TERMS))
        for one, begin, end in zip(integral, first.tolist(), [*first[1:].tolist(), len(cell)], strict=True):
            np.matmul(p[begin:end], one, out=along_u[begin:end])
        return np.asarray(np.einsum("ncj,nj->nc", along_u.reshape(-1, _DENSITIES, _TERMS), q))


def _smooth(surfaces: Surfaces, row: int) -> _Grid:
    """Cells within which a surface is smooth; those of rational splines in fours, as they are halved twice at least."""
    cuts = surfaces.domain_cuts(row)
    weights = surfaces.splines[row][3] if row in surfaces.splines else None
    if weights is not None:
        u, v = (_in_fours(cut) if np.ptp(weights, axis=way).any() else cut for way, cut in enumerate(cuts))
        cuts = u, v
    return _Grid(row, *cuts)


def _in_fours(cuts: Array) -> Array:
    return np.interp(np.arange(4 * len(cuts) - 3) / 4, np.arange(len(cuts)), cuts)


def _series(surfaces: Surfaces, grids: list[_Grid], about: Array) -> tuple[Array, Array]:
    """Coefficients (5, cells, terms in u, terms in v) of the densities times half the width of the cell in u.

    And the greatest of the last ones in u and in v (2, 5, cells).
    """
    row = np.repeat([grid.row for grid in grids], [len(grid) for grid in grids])
    u0, u1, v0, v1 = (
        np.concatenate(parts)
        for parts in (
            [np.repeat(grid.u[:-1], len(grid.v) - 1) for grid in grids],
            [np.repeat(grid.u[1:], len(grid.v) - 1) for grid in grids],
            [np.tile(grid.v[:-1], len(grid.u) - 1) for grid in grids],
            [np.tile(grid.v[1:], len(grid.u) - 1) for grid in grids],
        )
    )
    out, tails = np.zeros((_DENSITIES, len(row), _TERMS, _TERMS)), np.empty((2, _DENSITIES, len(row)))
    straight = surfaces.straight[:, row]
    for number, same in groups(straight[0] + 2 * straight[1]):
        n, m = (_FEW_TERMS if number & way else _TERMS for way in (1, 2))
        for i in range(0, len(same), _BLOCK):
            at = same[i : i + _BLOCK]
            u, v = (
                ((b + a) / 2)[at, None] + ((b - a) / 2)[at, None] * _NODES[terms]
                for a, b, terms in ((u0, u1, n), (v0, v1, m))
            )
            points, by_u, by_v = surfaces.evaluate_cells(row[at], u, v)
            normal = cross(by_u, by_v)
            normal *= ((u1 - u0)[at] / 2)[:, None, None]
            values = np.empty((_DENSITIES, *normal.shape[1:]))
            np.sqrt(dot(normal, normal), out=values[0])
            np.multiply(values[0], points, out=values[1:4])
            points -= taken(about, row[at])[:, :, None, None]
            values[4] = dot(normal, points)
            series = _ANALYSIS[n] @ values @ _ANALYSIS[m].T
            out[:, at, :n, :m] = series
            for tail, last in zip(tails, (series[:, :, -_TAIL:], series[:, :, :, -_TAIL:]), strict=True):
                tail[:, at] = np.abs(last).max(axis=(2, 3))
    return out, tails


def _unresolved(grids: list[_Grid], series: Array, tails: Array) -> Bools:
    """Whether the last terms in u and in v do not vanish (2, cells), held against all cells of the surface."""
    count = [len(grid) for grid in grids]
    height = np.concatenate([np.tile(np.diff(grid.v), len(grid.u) - 1) for grid in grids])
    first = np.cumsum([0, *count[:-1]])
    least = _TOLERANCE * np.repeat(np.add.reduceat(np.abs(series[:, :, 0, 0]) * height, first, axis=1), count, axis=1)
    return np.asarray((tails * height > least).any(axis=1))


def _halved(cuts: Array, which: Bools) -> Array:
    return np.sort(np.concatenate([cuts, ((cuts[1:] + cuts[:-1]) / 2)[which]]))


def _local(cuts: Array, t: Array) -> tuple[Index, Array]:
    """Cell of each parameter and its place within, -1 to 1; beyond the ends the outmost cells go on."""
    cell = np.clip(np.searchsorted(cuts, t, side="right") - 1, 0, len(cuts) - 2)
    return cell, (2 * t - cuts[cell] - cuts[cell + 1]) / (cuts[cell + 1] - cuts[cell])
