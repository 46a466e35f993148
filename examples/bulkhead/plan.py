"""Plan curves of the bulkhead: the crown, and the closed profiles of pockets with their corner arcs.

A profile is a counter-clockwise list of pieces, each tangent to the next: straight lines, arcs (start, a point between,
end) and stretches of a graph y = f(x), f a cubic B-spline."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline, make_interp_spline
from scipy.optimize import brentq

from examples.bulkhead.design import CROWN, Design, Point, Wall

Vector = NDArray[np.float64]


@dataclass(frozen=True)
class Line:
    start: Vector
    end: Vector


@dataclass(frozen=True)
class Arc:
    """A circular arc of at most half a turn, through `middle`."""

    start: Vector
    middle: Vector
    end: Vector
    centre: Vector

    def points(self, count: int) -> Vector:
        """Points (count, 2) from the start to just before the end, evenly spaced."""
        a, b = self.start - self.centre, self.end - self.centre
        turn = np.arctan2(_cross(a, b), a @ b)
        t = np.linspace(0, turn, count, endpoint=False)
        around: Vector = self.centre + np.outer(np.cos(t), a) + np.outer(np.sin(t), _left(a))
        return around


@dataclass(frozen=True)
class Graph:
    """The stretch of the curve (x, f(x)) from x = `start` to x = `end` (either may be the greater)."""

    spline: BSpline
    start: float
    end: float


Piece = Line | Arc | Graph
Profile = list[Piece]


def crown() -> BSpline:
    """The outer crown, y as a cubic B-spline of x (natural ends)."""
    x, y = np.array(CROWN).T
    return make_interp_spline(x, y, k=3, bc_type="natural")


def inner_crown(thickness: float) -> BSpline:
    """The crown moved inwards by `thickness`: a spline through 41 exactly offset points, good to a few microns."""
    outer = crown()
    x = np.linspace(CROWN[0][0] - 40, CROWN[-1][0] + 40, 41)
    slope = outer.derivative()(x)
    norm = np.hypot(1, slope)
    return make_interp_spline(x + thickness * slope / norm, outer(x) - thickness / norm, k=3)


def outline(design: Design) -> Profile:
    """The plan of the plate without its lugs."""
    corners = [np.array(design.walls[n].start, float) for n in ("BOTTOM", "RIGHT")]
    right_top = np.array(design.walls["RIGHT"].end, float)
    left_top, toe = (np.array(design.walls[n].start, float) for n in ("LEFT", "TOE"))
    return [
        Line(corners[0], corners[1]),
        Line(corners[1], right_top),
        Graph(crown(), right_top[0], left_top[0]),
        Line(left_top, toe),
        Line(toe, corners[0]),
    ]


def cell_profile(design: Design, own: tuple[str, ...], radius: float, inset: float, grow: dict[str, float]) -> Profile:
    """The profile of the cell between the named walls (counter-clockwise; "CROWN" among them), corners of `radius`.

    Walls stand off their centre lines by half their thickness (edges by all of it), plus `inset`, less `grow`."""
    rim = inner_crown(design.crown_flange + inset)
    curves = [None if n == "CROWN" else design.walls[n] for n in own]
    count = len(own)
    centre_lines = [_vertex(curves[i], curves[(i + 1) % count], rim) for i in range(count)]
    sides: list[tuple[Vector, Vector] | BSpline] = []
    for i, (name, wall) in enumerate(zip(own, curves, strict=True)):
        if wall is None:
            sides.append(rim)
            continue
        along = centre_lines[i] - centre_lines[i - 1]
        along /= np.linalg.norm(along)
        off = wall.thickness * (1.0 if wall.edge else 0.5) + inset - grow.get(name, 0.0)
        sides.append((np.array(wall.start, float) + off * np.array([-along[1], along[0]]), along))
    arcs = [_corner(sides[i], sides[(i + 1) % count], radius) for i in range(count)]
    profile: Profile = []
    for i in range(count):
        start, end = arcs[i - 1].end, arcs[i].start
        side = sides[i]
        if isinstance(side, tuple):
            if (end - start) @ side[1] <= 0:
                raise ValueError(f"no room for corner radius {radius} along {own[i]} in the cell {own}")
            profile.append(Line(start, end))
        else:
            profile.append(Graph(side, start[0], end[0]))
        profile.append(arcs[i])
    return profile


def split_cell(design: Design, names: tuple[str, ...], by: str) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """The two cells that a stiffener makes of one; it must cross exactly two of the cell's walls."""
    rim = inner_crown(design.crown_flange)
    count = len(names)
    curves = [None if n == "CROWN" else design.walls[n] for n in names]
    corner = [_vertex(curves[i], curves[(i + 1) % count], rim) for i in range(count)]
    start, end = (np.array(p, float) for p in (design.walls[by].start, design.walls[by].end))
    above = [_cross(end - start, c - start) > 0 for c in corner]
    i, j = (k for k in range(count) if above[k] != above[k - 1])
    return (*names[i : j + 1], by), (*names[j:], *names[: i + 1], by)


def sample(profile: Profile, step: float = 2.0) -> Vector:
    """Points (n, 2) along a profile, for checks in the plan."""
    points: list[Vector] = []
    for piece in profile:
        if isinstance(piece, Line):
            points.append(piece.start[None])
        elif isinstance(piece, Arc):
            points.append(piece.points(256))
        else:
            x = np.linspace(piece.start, piece.end, max(2, int(abs(piece.end - piece.start) / step)), endpoint=False)
            points.append(np.column_stack([x, piece.spline(x)]))
    return np.concatenate(points)


def _cross(a: Vector, b: Vector) -> float:
    return float(a[0] * b[1] - a[1] * b[0])


def _vertex(a: Wall | None, b: Wall | None, rim: BSpline) -> Vector:
    """Where two centre lines (or one and the crown) meet."""
    if a is None or b is None:
        wall = b if a is None else a
        assert wall is not None
        p, q = np.array(wall.start, float), np.array(wall.end, float)
        if abs(q[0] - p[0]) < 1e-9:
            return np.array([p[0], rim(p[0])])
        slope = (q[1] - p[1]) / (q[0] - p[0])
        x = brentq(lambda x: rim(x) - p[1] - slope * (x - p[0]), min(p[0], q[0]) - 60, max(p[0], q[0]) + 60, xtol=1e-12)
        return np.array([x, rim(x)])
    p, u = np.array(a.start, float), np.array(a.end, float) - np.array(a.start, float)
    q, v = np.array(b.start, float), np.array(b.end, float) - np.array(b.start, float)
    meeting: Vector = p + u * (_cross(q - p, v) / _cross(u, v))
    return meeting


def _corner(a: tuple[Vector, Vector] | BSpline, b: tuple[Vector, Vector] | BSpline, radius: float) -> Arc:
    """The arc of `radius` inside the corner from side a to side b, tangent to both."""
    if isinstance(a, tuple) and isinstance(b, tuple):
        (p, u), (q, v) = a, b
        p, q = p + radius * _left(u), q + radius * _left(v)
        centre = p + u * (_cross(q - p, v) / _cross(u, v))
        start, end = centre - radius * _left(u), centre - radius * _left(v)
    else:
        spline, line = (b, a) if isinstance(a, tuple) else (a, b)
        assert isinstance(spline, BSpline)
        assert isinstance(line, tuple)
        slope = spline.derivative()
        p, u = line

        def centre_at(x: float) -> Vector:
            s = float(slope(x))
            inward: Vector = np.array([s, -1.0]) / np.hypot(1, s)
            return np.array([x, float(spline(x))]) + radius * inward

        x0 = p[0] + u[0] / u[1] * (float(spline(p[0])) - p[1])
        x = brentq(lambda x: _cross(u, centre_at(x) - p) - radius, x0 - 6 * radius, x0 + 6 * radius, xtol=1e-13)
        centre = centre_at(x)
        on_spline, on_line = np.array([x, float(spline(x))]), centre - radius * _left(u)
        start, end = (on_line, on_spline) if isinstance(a, tuple) else (on_spline, on_line)
    bisector = start + end - 2 * centre
    return Arc(start, centre + radius * bisector / np.linalg.norm(bisector), end, centre)


def _left(u: Vector) -> Vector:
    return np.array([-u[1], u[0]])


def circle_in(centre: Point, radius: float, count: int = 64) -> Vector:
    """Points (count, 2) on a circle."""
    t = np.linspace(0, 2 * np.pi, count, endpoint=False)
    return np.array(centre) + radius * np.column_stack([np.cos(t), np.sin(t)])
