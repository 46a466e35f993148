"""Arcs from table rows: points, derivatives, lengths and boxes.

Parameterisation as at the head of `schema/030_surface.sql`; agrees with the CAD kernel to 1e-9 mm."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from relmodel.arrays import Bools, Floats, Ints, Texts
from relmodel.geometry.splines import Splines
from relmodel.geometry.transforms import cross, dot, scatter, take

XYZ = ("x", "y", "z")
_EMPTY: dict[str, Any] = {}
CONICS = ("circle", "ellipse", "parabola", "hyperbola")
BOX = ("x0", "y0", "z0", "x1", "y1", "z1")
# Gauss-Legendre points of a span; kinds without knots are cut into spans of at most a quarter turn.
_GAUSS = 20
_SAMPLES, _SECANTS = 17, 8  # of a span
_LEVEL_MM = 1e-11  # over a span: extremes nearer than this to the samples are not refined


def vectors(columns: Mapping[str, Any], name: str) -> Floats:
    """Columns name_x, name_y, name_z as (n, 3), the transpose of components."""
    return np.stack([np.asarray(columns[f"{name}_{axis}"], float) for axis in XYZ]).T


def vector_columns(name: str, values: Floats) -> dict[str, Floats]:
    """Vectors (n, 3) as columns name_x, name_y, name_z; the inverse of `vectors`."""
    return {f"{name}_{axis}": np.ascontiguousarray(values[:, i]) for i, axis in enumerate(XYZ)}


def box_columns(boxes: Floats) -> dict[str, Floats]:
    """Boxes (n, 6: x0 y0 z0 x1 y1 z1) as columns x0 .. z1."""
    return {name: np.ascontiguousarray(boxes[:, i]) for i, name in enumerate(BOX)}


def boxes_of(columns: Mapping[str, Any], before: str = "") -> Floats:
    """Columns x0 .. z1, with what stands before each name, as boxes (n, 6); the inverse of `box_columns`."""
    return np.stack([np.asarray(columns[before + c], float) for c in BOX], axis=1) if columns else np.empty((0, 6))


class ByKind:
    """Groups rows by the kind that each is of; kinds (n,) strings."""

    def __init__(self, kind: Texts) -> None:
        self._names = sorted(set(kind.tolist()))
        number = {name: i for i, name in enumerate(self._names)}
        self._code = np.array([number[name] for name in kind.tolist()], np.int8)

    def of(self, row: Ints) -> list[tuple[str, Ints | slice]]:
        """Each kind that occurs among rows (m,), in order of their names, and where (a slice: everywhere)."""
        if len(self._names) == 1 and len(row):
            return [(self._names[0], slice(None))]
        code = self._code[row]
        found = np.flatnonzero(np.bincount(code, minlength=len(self._names)))
        if len(found) == 1:
            return [(self._names[found[0]], slice(None))]
        return [(self._names[i], np.flatnonzero(code == i)) for i in found.tolist()]


def pieces(t0: Floats, t1: Floats, which: Ints, cuts: Floats) -> tuple[Ints, Floats, Floats]:
    """Intervals t0 to t1 (n,) cut at parameters (m,) that lie clearly within: whose piece, its start and its end.

    which: (m,) the interval that each cut is of; cuts nearer to each other than 1e-9 of the interval are one."""
    least = 1e-9 * (t1 - t0)
    inside = (cuts > (t0 + least)[which]) & (cuts < (t1 - least)[which])
    which, cuts = which[inside], cuts[inside]
    order = np.lexsort((cuts, which))
    which, cuts = which[order], cuts[order]
    apart = np.append(True, (np.diff(which) != 0) | (np.diff(cuts) > least[which[1:]]))[: len(which)]
    which = np.concatenate([np.arange(len(t0)), which[apart]])
    start = np.concatenate([t0, cuts[apart]])
    order = np.lexsort((start, which))
    which, start = which[order], start[order]
    last = np.append(np.diff(which) != 0, True)[: len(which)]
    return which, start, np.where(last, t1[which], np.roll(start, -1))


class FramedCurves:
    """Lines, conics and splines to be evaluated, many at once, in two or three dimensions d.  origin, x, y (n, d):
    frames, which classes that are made from this set; columns: kind, radius, radius2."""

    origin: Floats
    x: Floats
    y: Floats

    def __init__(self, columns: Mapping[str, Any]) -> None:
        self.kind = np.asarray(columns["kind"], dtype=object)
        self._by_kind = ByKind(self.kind)
        self.radius, self.radius2 = (np.asarray(columns[name], float) for name in ("radius", "radius2"))

    def _set_splines(self, owner: Ints, splines: Splines | None) -> None:
        self._spline = np.full(len(self.kind), -1)  # number of each row's spline
        self._spline[owner] = np.arange(len(owner))
        self._splines = splines

    def __len__(self) -> int:
        return len(self.kind)

    def evaluate(self, row: npt.ArrayLike, t: npt.ArrayLike) -> tuple[Floats, Floats]:
        """Points (n, d) and derivatives by t (n, d) of the curves `row` (n,) at the parameters t (n,)."""
        row, t = np.broadcast_arrays(np.asarray(row, np.int64), np.asarray(t, float))
        points, derivatives = np.empty((2, self.origin.shape[1], len(row)))
        for name, at in self._by_kind.of(row):
            one, parameter = row[at], t[at]
            if name in CONICS:
                a, b, a_by, b_by = _conic(name, parameter, self.radius[one], self.radius2[one])
                x, y = take(self.x, one), take(self.y, one)
                point, by = take(self.origin, one) + a * x + b * y, a_by * x + b_by * y
            elif name == "line":
                by = take(self.x, one)
                point = take(self.origin, one) + parameter * by
            elif name in ("spline", "polyline") and self._splines is not None:
                point, by = self._splines.evaluate(self._spline[one], parameter)
            else:
                point, by = self._of_other_kind(name, one, parameter)
            scatter(points, at, point)
            scatter(derivatives, at, by)
        return points.T, derivatives.T

    def _of_other_kind(self, kind: str, row: Ints, t: Floats) -> tuple[Floats, Floats]:
        return np.full((len(self.origin.T), len(row)), np.nan), np.zeros((len(self.origin.T), len(row)))


class Curves(FramedCurves):
    """Arcs to be evaluated, many at once.

    columns: columns of the table `arc`.
    splines, offsets: columns of `arc_spline` and `arc_offset`, with `arc_no` saying whose row each is.
    basis: what offset rows refer to by row in their column `basis_arc`; None: earlier rows of these curves."""

    def __init__(
        self,
        columns: Mapping[str, Any],
        splines: Mapping[str, Any],
        offsets: Mapping[str, Any] = _EMPTY,
        basis: Curves | None = None,
    ) -> None:
        super().__init__(columns)
        self.origin, self.x, self.z = (vectors(columns, name) for name in ("origin", "axis_x", "axis_z"))
        self.y = cross(self.z.T, self.x.T).T
        self.t0, self.t1 = (np.asarray(columns[name], float) for name in ("t0", "t1"))
        owner = np.asarray(splines.get("arc_no", ()), np.int64)
        self._set_splines(owner, Splines(splines, np.arange(len(owner))) if len(owner) else None)
        self.basis = basis or self
        self.offsets: dict[int, tuple[int, Floats, float]] = {}
        axes = vectors(offsets, "axis") if offsets else np.empty((0, 3))
        for i, row in enumerate(offsets.get("arc_no", ())):
            self.offsets[int(row)] = int(offsets["basis_arc"][i]), axes[i], float(offsets["distance"][i])

    def _of_other_kind(self, kind: str, row: Ints, t: Floats) -> tuple[Floats, Floats]:
        point, by = super()._of_other_kind(kind, row, t)
        for number in np.unique(row).tolist() if kind == "offset" else ():
            where = row == number
            point[:, where], by[:, where] = (x.T for x in self._offset(number, t[where]))
        return take(self.origin, row) if kind == "degenerate" else point, by

    def _offset(self, row: int, t: Floats) -> tuple[Floats, Floats]:
        """Points exact; derivatives by central differences (relative error about 1e-8)."""
        basis, axis, distance = self.offsets[row]

        def points(t: Floats) -> Floats:
            at, by = self.basis.evaluate(np.full(len(t), basis), t)
            across = np.cross(by, axis)
            return np.asarray(at + distance * across / np.linalg.norm(across, axis=1, keepdims=True))

        h = 1e-5 * (self.t1[row] - self.t0[row])
        return points(t), (points(t + h) - points(t - h)) / (2 * h)

    def spans(self, row: Ints) -> tuple[Ints, Floats, Floats]:
        """Smooth pieces of arcs `row` (n,) in their order and that of the parameter: row, start and end of each."""
        t0, t1 = self.t0[row], self.t1[row]
        which, start, end = pieces(t0, t1, *self.inner_cuts(row, t0, t1))
        return row[which], start, end

    def _of_kinds(self, *kinds: str) -> Bools:
        return np.asarray(np.logical_or.reduce([self.kind == kind for kind in kinds]), bool)

    def inner_cuts(self, row: Ints, t0: Floats, t1: Floats) -> tuple[Ints, Floats]:
        """Where smooth pieces of arcs `row` (n,) meet: which of the intervals t0 to t1 (n,), and the parameter.

        Some may lie beyond the interval or at its ends; conics are cut into even pieces."""
        which, cuts = [np.empty(0, np.int64)], [np.empty(0)]
        kind = self.kind[row]
        conic = np.flatnonzero(np.logical_or.reduce([kind == name for name in CONICS]))
        if len(conic):
            count = np.ceil((t1[conic] - t0[conic]) / (np.pi / 4)).astype(np.int64)
            count = np.clip(count, np.where(kind[conic] == "circle", 1, 4), 64)
            here = np.repeat(conic, count - 1)
            step = np.arange(len(here)) - np.repeat(np.cumsum(count - 1) - count, count - 1)
            which.append(here)
            cuts.append(t0[here] + (t1[here] - t0[here]) * step / np.repeat(count, count - 1))
        drawn = np.flatnonzero(self._spline[row] >= 0)
        if len(drawn) and self._splines is not None:
            of, t = self._splines.bases[0].cuts(self._spline[row[drawn]], t0[drawn], t1[drawn])
            which.append(drawn[of])
            cuts.append(t)
        offset = np.flatnonzero(kind == "offset")
        if len(offset):
            basis = np.array([self.offsets[one][0] for one in row[offset].tolist()])
            of, t = self.basis.inner_cuts(basis, t0[offset], t1[offset])
            which.append(offset[of])
            cuts.append(t)
        return np.concatenate(which), np.concatenate(cuts)

    @cached_property
    def ends(self) -> tuple[Floats, Floats]:
        """First and last points (n, 3) of the arcs, mm."""
        start, end = np.split(self.evaluate(np.tile(np.arange(len(self)), 2), np.append(self.t0, self.t1))[0], 2)
        return start, end

    def lengths(self) -> Floats:
        """Length of each arc (n,), mm; closed forms for lines and circles, else Gauss-Legendre on each span."""
        extent = self.t1 - self.t0
        lengths = np.select([self.kind == "line", self.kind == "circle"], [extent, self.radius * extent], 0.0)
        uneven = np.flatnonzero(~self._of_kinds("line", "circle", "degenerate"))
        if len(uneven):
            row, start, end = self.spans(uneven)
            nodes, weights = np.polynomial.legendre.leggauss(_GAUSS)
            half, middle = (end - start) / 2, (end + start) / 2
            t = middle[:, None] + half[:, None] * nodes
            by = self.evaluate(np.repeat(row, _GAUSS), t.ravel())[1].T
            speed = np.sqrt(dot(by, by)).reshape(-1, _GAUSS)
            lengths += np.bincount(row, (speed @ weights) * half, len(self))
        return np.asarray(lengths)

    def boxes(self) -> Floats:
        """Axis-aligned boxes (n, 6: x0 y0 z0 x1 y1 z1), mm.  Extremes of lines and conics in closed form, of others by
        secants between samples."""
        low, high = (np.ascontiguousarray(extreme(*self.ends)) for extreme in (np.minimum, np.maximum))
        self._widen_conics(low, high)
        self._widen_free(low, high)
        return np.concatenate([low, high], axis=1)

    def _widen_conics(self, low: Floats, high: Floats) -> None:
        """Extremes of O + A cos t X + B sin t Y along each coordinate, where they fall in the interval."""
        at = np.flatnonzero((self.kind == "circle") | (self.kind == "ellipse"))
        if not len(at):
            return
        minor = np.where(self.kind[at] == "circle", self.radius[at], self.radius2[at])
        first = np.arctan2(minor * self.y[at].T, self.radius[at] * self.x[at].T)
        t = np.concatenate([first, first + np.pi])  # three coordinates, twice
        t += 2 * np.pi * np.ceil((self.t0[at] - t) / (2 * np.pi))
        turn, inside = np.nonzero(t <= self.t1[at])
        arc, axis = at[inside], turn % 3
        value = self.evaluate(arc, t[turn, inside])[0][np.arange(len(arc)), axis]
        np.minimum.at(low.reshape(-1), 3 * arc + axis, value)
        np.maximum.at(high.reshape(-1), 3 * arc + axis, value)

    def _widen_free(self, low: Floats, high: Floats) -> None:
        """Extremes of other kinds: where a derivative changes its sign between samples, by secants."""
        free = np.flatnonzero(~self._of_kinds("line", "circle", "ellipse", "degenerate"))
        if not len(free):
            return
        row, start, end = self.spans(free)
        t = start[:, None] + (end - start)[:, None] * np.linspace(0, 1, _SAMPLES)
        points, by = (x.reshape(-1, _SAMPLES, 3) for x in self.evaluate(np.repeat(row, _SAMPLES), t.ravel()))
        first = np.flatnonzero(np.diff(row, prepend=-1))
        low[free] = np.minimum(low[free], np.minimum.reduceat(points.min(axis=1), first))
        high[free] = np.maximum(high[free], np.maximum.reduceat(points.max(axis=1), first))
        turning = by[:, :-1] * by[:, 1:] < 0
        # A coordinate that is all but constant turns by round-off.
        turning &= np.maximum(np.abs(by[:, :-1]), np.abs(by[:, 1:])) * (end - start)[:, None, None] > _LEVEL_MM
        span, step, axis = np.nonzero(turning)
        if not len(span):
            return
        row, every = row[span], np.arange(len(axis))
        left, right = t[span, step], t[span, step + 1]
        left_by, right_by, last = by[span, step, axis], by[span, step + 1, axis], np.zeros(len(axis))
        value = np.empty(0)
        for _ in range(_SECANTS):  # an error e of the parameter is one of e^2 in the extreme
            middle = (left * right_by - right * left_by) / (right_by - left_by)
            at, slope = (x[every, axis] for x in self.evaluate(row, middle))
            ahead = slope * left_by > 0
            # The end that stays twice counts half (the Illinois method).
            left_by = np.where(ahead, slope, np.where(last < 0, left_by / 2, left_by))
            right_by = np.where(ahead, np.where(last > 0, right_by / 2, right_by), slope)
            left, right = np.where(ahead, middle, left), np.where(ahead, right, middle)
            last, value = np.where(ahead, 1, -1), at
        np.minimum.at(low.reshape(-1), 3 * row + axis, value)
        np.maximum.at(high.reshape(-1), 3 * row + axis, value)


def _conic(kind: str, t: Floats, radius: Floats, radius2: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Coordinates along X and Y of a conic's frame, and derivatives; of a parabola `radius` is the focal length."""
    if kind == "parabola":
        return t * t / (4 * radius), t, t / (2 * radius), np.ones_like(t)
    minor = radius if kind == "circle" else radius2
    if kind == "hyperbola":
        c, s = np.cosh(t), np.sinh(t)
        return radius * c, minor * s, radius * s, minor * c
    c, s = np.cos(t), np.sin(t)
    return radius * c, minor * s, -radius * s, minor * c
