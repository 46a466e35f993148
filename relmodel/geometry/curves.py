"""Arcs from table rows alone: points, derivatives, lengths and boxes.

Parameterisation as at the head of `schema/030_surface.sql`; agrees with the CAD kernel to 1e-9 mm.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from relmodel.geometry import bspline

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.int64]

XYZ = ("x", "y", "z")
_EMPTY: dict[str, Any] = {}
BOX = ("x0", "y0", "z0", "x1", "y1", "z1")
# Gauss-Legendre points of a span; kinds without knots are cut into spans of at most a quarter turn.
_GAUSS = 20


def vectors(columns: Mapping[str, Any], name: str) -> Array:
    """Columns name_x, name_y, name_z as (n, 3)."""
    return np.stack([np.asarray(columns[f"{name}_{axis}"], float) for axis in XYZ], axis=1)


def vector_columns(name: str, values: Array) -> dict[str, Array]:
    """Vectors (n, 3) as columns name_x, name_y, name_z; the inverse of `vectors`."""
    return {f"{name}_{axis}": np.ascontiguousarray(values[:, i]) for i, axis in enumerate(XYZ)}


def box_columns(boxes: Array) -> dict[str, Array]:
    """Boxes (n, 6: x0 y0 z0 x1 y1 z1) as columns x0 .. z1."""
    return {name: np.ascontiguousarray(boxes[:, i]) for i, name in enumerate(BOX)}


def groups(labels: Index) -> list[tuple[int, Index]]:
    """Each label that occurs in (n,), in order, and where."""
    if not len(labels):
        return []
    order = np.argsort(labels, kind="stable")
    start = np.flatnonzero(np.append(True, np.diff(labels[order]) != 0))
    return list(zip(labels[order[start]].tolist(), np.split(order, start[1:]), strict=True))


@dataclass(frozen=True)
class SplineCurve:
    """One row of `arc_spline`."""

    basis: bspline.Basis
    poles: Array  # (m, 3)
    weights: Array | None

    @classmethod
    def of(cls, splines: Mapping[str, Any], i: int) -> SplineCurve:
        """From row i of columns of `arc_spline`."""
        weights = splines["weights"][i]
        return cls(
            bspline.Basis.of(
                int(splines["degree"][i]),
                bool(splines["periodic"][i]),
                splines["knots"][i],
                splines["multiplicities"][i],
            ),
            np.asarray(splines["poles"][i], float).reshape(-1, 3),
            None if weights is None or len(weights) == 0 else np.asarray(weights, float),
        )

    def evaluate(self, t: Array) -> tuple[Array, Array]:
        return bspline.curve(self.basis, self.poles, self.weights, t)


class Curves:
    """Arcs to be evaluated, many at once.

    columns: columns of the table `arc`.
    splines, offsets: columns of `arc_spline` and `arc_offset`, with `key` saying whose row each is.
    rows: value of `key` -> row of `columns`; None where `key` counts the rows.
    basis: what offset rows refer to by row in their column `basis_arc`; None: earlier rows of these curves.
    """

    def __init__(
        self,
        columns: Mapping[str, Any],
        splines: Mapping[str, Any],
        key: str = "arc_no",
        rows: Mapping[int, int] | None = None,
        offsets: Mapping[str, Any] = _EMPTY,
        basis: Curves | None = None,
    ) -> None:
        self.kind = np.asarray(columns["kind"], dtype=object)
        self.origin = vectors(columns, "origin")
        self.x = vectors(columns, "axis_x")
        self.z = vectors(columns, "axis_z")
        self.radius = np.asarray(columns["radius"], float)
        self.radius2 = np.asarray(columns["radius2"], float)
        self.t0 = np.asarray(columns["t0"], float)
        self.t1 = np.asarray(columns["t1"], float)
        self.splines: dict[int, SplineCurve] = {}
        for i, number in enumerate(splines.get(key, ())):
            row = int(number) if rows is None else rows[int(number)]
            self.splines[row] = SplineCurve.of(splines, i)

        self.basis = basis or self
        self.offsets: dict[int, tuple[int, Array, float]] = {}
        axes = vectors(offsets, "axis") if offsets else np.empty((0, 3))
        for i, number in enumerate(offsets.get(key, ())):
            row = int(number) if rows is None else rows[int(number)]
            self.offsets[row] = int(offsets["basis_arc"][i]), axes[i], float(offsets["distance"][i])

    def __len__(self) -> int:
        return len(self.kind)

    def evaluate(self, row: npt.ArrayLike, t: npt.ArrayLike) -> tuple[Array, Array]:
        """Points (n, 3), mm, and derivatives by t (n, 3) of the arcs `row` (n,) at the parameters t (n,)."""
        row, t = np.broadcast_arrays(np.asarray(row, np.int64), np.asarray(t, float))
        points = np.full((len(row), 3), np.nan)
        derivatives = np.zeros((len(row), 3))
        kind = self.kind[row]
        for name in sorted(set(kind.tolist())):
            at = np.flatnonzero(kind == name)
            if name in CONICS:
                a, b, a_by, b_by = CONICS[name](t[at], self.radius[row[at]], self.radius2[row[at]])
                x = self.x[row[at]]
                y = np.cross(self.z[row[at]], x)
                points[at] = self.origin[row[at]] + a[:, None] * x + b[:, None] * y
                derivatives[at] = a_by[:, None] * x + b_by[:, None] * y
            elif name == "line":
                points[at] = self.origin[row[at]] + t[at, None] * self.x[row[at]]
                derivatives[at] = self.x[row[at]]
            elif name == "degenerate":
                points[at] = self.origin[row[at]]
            else:
                for one, where in groups(row[at]):
                    here = at[where]
                    if one in self.offsets:
                        points[here], derivatives[here] = self._offset(one, t[here])
                    else:
                        points[here], derivatives[here] = self.splines[one].evaluate(t[here])
        return points, derivatives

    def _offset(self, row: int, t: Array) -> tuple[Array, Array]:
        """Points exact; derivatives by central differences (relative error about 1e-8)."""
        basis, axis, distance = self.offsets[row]

        def points(t: Array) -> Array:
            at, by = self.basis.evaluate(np.full(len(t), basis), t)
            across = np.cross(by, axis)
            return np.asarray(at + distance * across / np.linalg.norm(across, axis=1, keepdims=True))

        h = 1e-5 * (self.t1[row] - self.t0[row])
        return points(t), (points(t + h) - points(t - h)) / (2 * h)

    def spans(self) -> tuple[Index, Array, Array]:
        """Smooth pieces of all arcs in order of rows and parameter: row, start and end of each."""
        cuts = [self.cuts(row, self.t0[row], self.t1[row]) for row in range(len(self))]
        if not cuts:
            return np.empty(0, np.int64), np.empty(0), np.empty(0)
        rows = np.repeat(np.arange(len(cuts)), [len(c) - 1 for c in cuts])
        return rows, np.concatenate([c[:-1] for c in cuts]), np.concatenate([c[1:] for c in cuts])

    def cuts(self, row: int, t0: float, t1: float) -> Array:
        """Ends of an interval of an arc's parameter with those of the smooth pieces within."""
        if row in self.splines:
            return self.splines[row].basis.cuts(t0, t1)
        if row in self.offsets:
            return self.basis.cuts(self.offsets[row][0], t0, t1)
        if self.kind[row] in CONICS:
            pieces = max(1 if self.kind[row] == "circle" else 4, int(np.ceil((t1 - t0) / (np.pi / 4))))
            return np.linspace(t0, t1, min(pieces, 64) + 1)
        return np.array([t0, t1])

    def lengths(self) -> Array:
        """Length of each arc (n,), mm; closed forms for lines and circles, else Gauss-Legendre on each span."""
        nodes, weights = np.polynomial.legendre.leggauss(_GAUSS)
        row, start, end = self.spans()
        half, middle = (end - start) / 2, (end + start) / 2
        t = middle[:, None] + half[:, None] * nodes
        _, by = self.evaluate(np.repeat(row, _GAUSS), t.ravel())
        speed = np.linalg.norm(by, axis=1).reshape(-1, _GAUSS)
        lengths = np.zeros(len(self))
        np.add.at(lengths, row, (speed @ weights) * half)
        extent = self.t1 - self.t0
        lengths = np.where(self.kind == "line", extent, lengths)
        return np.where(self.kind == "circle", self.radius * extent, lengths)

    def boxes(self) -> Array:
        """Axis-aligned boxes (n, 6: x0 y0 z0 x1 y1 z1), mm.

        Extremes of lines and conics in closed form, of others by bisection between samples.
        """
        ends = np.stack([self.evaluate(np.arange(len(self)), t)[0] for t in (self.t0, self.t1)])
        low, high = ends.min(0), ends.max(0)
        self._widen_conics(low, high)
        self._widen_free(low, high)
        return np.concatenate([low, high], axis=1)

    def _widen_conics(self, low: Array, high: Array) -> None:
        """Extremes of O + A cos t X + B sin t Y along each coordinate, where they fall in the interval."""
        at = np.flatnonzero((self.kind == "circle") | (self.kind == "ellipse"))
        if not len(at):
            return
        x = self.x[at]
        y = np.cross(self.z[at], x)
        minor = np.where(self.kind[at] == "circle", self.radius[at], self.radius2[at])
        for axis in range(3):
            first = np.arctan2(minor * y[:, axis], self.radius[at] * x[:, axis])
            for half_turn in (0.0, np.pi):
                t = first + half_turn
                t = t + 2 * np.pi * np.ceil((self.t0[at] - t) / (2 * np.pi))
                inside = t <= self.t1[at]
                value = self.evaluate(at[inside], t[inside])[0][:, axis]
                np.minimum.at(low[:, axis], at[inside], value)
                np.maximum.at(high[:, axis], at[inside], value)

    def _widen_free(self, low: Array, high: Array, samples: int = 17, rounds: int = 4) -> None:
        """Extremes of other kinds: where a derivative changes its sign between samples, by ever finer samples."""
        row, start, end = self.spans()
        free = ~np.isin(self.kind[row].astype(str), ("line", "circle", "ellipse", "degenerate"))
        row, start, end = row[free], start[free], end[free]
        if not len(row):
            return
        steps = np.linspace(0, 1, samples)
        t = start[:, None] + (end - start)[:, None] * steps
        points, by = self.evaluate(np.repeat(row, samples), t.ravel())
        by = by.reshape(-1, samples, 3)
        np.minimum.at(low, np.repeat(row, samples), points)
        np.maximum.at(high, np.repeat(row, samples), points)
        span, step, axis = np.nonzero(by[:, :-1] * by[:, 1:] < 0)
        row, left, right = row[span], t[span, step], t[span, step + 1]
        every = np.arange(len(axis))
        for _ in range(rounds):  # an error e of the parameter is one of e^2 in the extreme
            t = left[:, None] + (right - left)[:, None] * steps
            by = self.evaluate(np.repeat(row, samples), t.ravel())[1].reshape(-1, samples, 3)[every, :, axis]
            step = np.argmax(by[:, :-1] * by[:, 1:] <= 0, axis=1)
            left, right = t[every, step], t[every, step + 1]
        value = self.evaluate(row, left)[0][every, axis]
        np.minimum.at(low, (row, axis), value)
        np.maximum.at(high, (row, axis), value)


def _circle(t: Array, radius: Array, _: Array) -> tuple[Array, Array, Array, Array]:
    c, s = radius * np.cos(t), radius * np.sin(t)
    return c, s, -s, c


def _ellipse(t: Array, radius: Array, radius2: Array) -> tuple[Array, Array, Array, Array]:
    c, s = np.cos(t), np.sin(t)
    return radius * c, radius2 * s, -radius * s, radius2 * c


def _parabola(t: Array, focal: Array, _: Array) -> tuple[Array, Array, Array, Array]:
    return t * t / (4 * focal), t, t / (2 * focal), np.ones_like(t)


def _hyperbola(t: Array, radius: Array, radius2: Array) -> tuple[Array, Array, Array, Array]:
    c, s = np.cosh(t), np.sinh(t)
    return radius * c, radius2 * s, radius * s, radius2 * c


# Coordinates along X and Y of the curve's frame, and their derivatives.
CONICS = {"circle": _circle, "ellipse": _ellipse, "parabola": _parabola, "hyperbola": _hyperbola}
