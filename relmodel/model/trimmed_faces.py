"""Coedges as curves in the (u, v) domains of their faces: the pcurves where a face has them, else the arcs' feet."""

from __future__ import annotations

from functools import cached_property

import numpy as np
import numpy.typing as npt

from relmodel.geometry.components import dot, put, taken
from relmodel.geometry.curves import Curves, pieces
from relmodel.geometry.pcurves import Pcurves
from relmodel.geometry.spline_curves import Runs, rank
from relmodel.geometry.surfaces import ANALYTIC_KINDS, Surfaces
from relmodel.model.model import Table

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.int64]

_NEWTON_STEPS = 5
_OFF = 1e-6
_CHORDS = 16  # of a piece
_GAP = 0.01  # of the extent of a domain: what ends further from its start does not close
_SAMPLES = 8  # steps of a piece of a pcurve between which it crosses a line once


def pcurve_of(coedges: Table, pcurves: Table) -> Index:
    """Row of the pcurve of each coedge, -1 where it has none; both tables are in order of their keys."""
    names = ("surface_no", "loop_no", "coedge_no")
    keys = np.stack([np.asarray(coedges[n], np.int64) for n in names], axis=1)
    have = np.stack([np.asarray(pcurves[n], np.int64) for n in names], axis=1)
    base = (keys.max(0, initial=0) + 1)[1:]
    flat, flat_have = ((k[:, 0] * base[0] + k[:, 1]) * base[1] + k[:, 2] for k in (keys, have))
    out = np.full(len(keys), -1)
    out[np.searchsorted(flat, flat_have)] = np.arange(len(have))
    return out


class Trims:
    """Coedges of faces, told by their rows.

    surface, loop, arc, reversed: columns of the coedges; pcurve: row of each in `pcurves`, -1: none, or on a plane.
    sign: (n,) 1 where the loop runs along the arc's parameter, as (u, v) is seen (the face to its left), else -1.
    """

    def __init__(self, surfaces: Surfaces, curves: Curves, coedges: Table, pcurves: Table) -> None:
        self.surfaces, self.curves, self.pcurves = surfaces, curves, Pcurves(pcurves)
        self.surface = np.asarray(coedges["surface_no"], np.int64)
        self.loop = np.asarray(coedges["loop_no"], np.int64)
        self.arc = np.asarray(coedges["arc_no"], np.int64)
        self.reversed = backward = np.asarray(coedges["reversed"], bool)
        self._analytic = np.logical_or.reduce([surfaces.kind == kind for kind in ANALYTIC_KINDS])
        self.sign = np.where(backward != surfaces.reversed[self.surface], -1.0, 1.0)
        drawn = pcurve_of(coedges, pcurves)
        self._flat = np.asarray(surfaces.kind == "plane")
        self.pcurve = np.where(self._flat[self.surface], -1, drawn)

    def evaluate(self, coedge: Index, t: Array) -> tuple[Array, Array]:
        """Points (n, 2: u v) and derivatives by t (n, 2); without a pcurve angles are in [-pi, pi]."""
        uv, by = np.empty((2, len(t))).T, np.empty((2, len(t))).T
        row = self.pcurve[coedge]
        drawn, bare = np.flatnonzero(row >= 0), np.flatnonzero(row < 0)
        if len(drawn):
            for out, found in zip((uv, by), self.pcurves.evaluate(row[drawn], t[drawn]), strict=True):
                put(out.T, drawn, found.T)
        if len(bare):
            for out, feet in zip((uv, by), self._feet(coedge[bare], t[bare]), strict=True):
                put(out.T, bare, feet)
        return uv, by

    def _feet(self, coedge: Index, t: Array) -> tuple[Array, Array]:
        """Components (2, n) of parameters, and of their derivatives, of the arcs' feet on analytic surfaces."""
        surface = self.surface[coedge]
        points, by_t = (x.T for x in self.curves.evaluate(self.arc[coedge], t))
        if self._flat[surface].all():
            x, y = taken(self.surfaces.x, surface), taken(self.surfaces.y, surface)
            arm = points - taken(self.surfaces.origin, surface)
            return np.stack([dot(arm, x), dot(arm, y)]), np.stack([dot(by_t, x), dot(by_t, y)])
        u, v = self.surfaces.parameters(surface, points.T)
        at = self.surfaces.evaluate(surface, u, v)  # the lines of u and of v are perpendicular
        by = []
        for along in (at.by_u.T, at.by_v.T):
            square = dot(along, along)
            by.append(dot(by_t, along) / np.where(square > 0, square, 1.0))
        return np.stack([u, v]), np.stack(by)

    def across(self, coedges: Index) -> Array:
        """From start to end (n, 2) of some coedges, as their loops run; those of a loop that closes add up to 0."""
        arc = self.arc[coedges]
        t = np.concatenate([self.curves.t0[arc], self.curves.t1[arc]])
        start, end = np.split(self.evaluate(np.tile(coedges, 2), t)[0], 2)
        return np.asarray(self.sign[coedges, None] * (end - start))

    def chords(self, coedges: Index, steps: int) -> tuple[Index, Array, Array]:
        """Chords in (u, v) of some coedges, so many to a smooth piece that is not straight.

        Whose each is, and its start and end (n, 2) as the loop runs.
        """
        coedge, start, end = self.pieces(coedges)
        count = np.where(self.straight()[coedge], 1, steps)
        piece = np.repeat(np.arange(len(coedge)), count + 1)
        place = np.arange(len(piece)) - (np.cumsum(count + 1) - count - 1)[piece]
        t = start[piece] + (end - start)[piece] * (place / count[piece])
        uv = self.evaluate(coedge[piece], t)[0]
        at = np.flatnonzero(place < count[piece])
        coedge = coedge[piece[at]]
        start, end = taken(uv, at).T, taken(uv, at + 1).T
        forward = self.sign[coedge, None] > 0
        return coedge, np.where(forward, start, end), np.where(forward, end, start)

    def hold(self, surface: Index, u: Array, v: Array) -> npt.NDArray[np.bool_]:
        """Whether faces `surface` (n,) hold points (n,) of their domains, their coedges taken as chords in (u, v).

        Where these do not close, as around a surface without a seam, the face is taken to hold all of its domain.
        """
        wanted = np.flatnonzero(np.bincount(surface))
        # Off the ends of the domain, where coedges meet but for a gap.
        u0, u1, v0, v1 = self.surfaces.domain[surface].T
        u, v = u + _OFF * ((u0 + u1) / 2 - u), v + _OFF * ((v0 + v1) / 2 - v)
        coedge, first, last = self.chords(np.flatnonzero(np.isin(self.surface, wanted)), _CHORDS)
        face = self.surface[coedge]
        inside = np.zeros(len(surface), bool)
        for one in wanted.tolist():
            own, at = np.flatnonzero(face == one), np.flatnonzero(surface == one)
            a, b = first[own], last[own]
            extent = self.surfaces.domain[one][1::2] - self.surfaces.domain[one][::2]
            if np.any(np.abs((b - a).sum(axis=0)) > _GAP * extent):
                inside[at] = True
                continue
            over = (a[:, :1] > u[at]) != (b[:, :1] > u[at])
            with np.errstate(divide="ignore", invalid="ignore"):
                height = a[:, 1:] + (b - a)[:, 1:] * (u[at] - a[:, :1]) / (b - a)[:, :1]
            inside[at] = np.count_nonzero(over & (height > v[at]), axis=0) % 2 == 1
        return inside

    def straight(self) -> npt.NDArray[np.bool_]:
        """Whether each coedge (n,) is known to be a line in (u, v)."""
        line = np.append(self.pcurves.kind == "line", False)[self.pcurve]
        return np.asarray(line | (self._flat[self.surface] & (self.curves.kind[self.arc] == "line")), bool)

    def level(self) -> npt.NDArray[np.bool_]:
        """Whether each coedge (n,) is known to run along a line of one v, where nothing adds to an integral over v."""
        straight = np.append((self.pcurves.kind == "line") & (self.pcurves.axis[:, 1] == 0), False)
        return np.asarray(straight[self.pcurve], bool)

    def polynomial(self) -> npt.NDArray[np.bool_]:
        """Whether along each coedge (n,) the integrals over u are polynomials of the parameter, of third degree.

        So they are along lines of planes, and of one u on cylinders and cones.
        """
        kind = self.surfaces.kind[self.surface]
        upright = np.append((self.pcurves.kind == "line") & (self.pcurves.axis[:, 0] == 0), False)[self.pcurve]
        ruled = (kind == "cylinder") | (kind == "cone")
        return np.asarray(((kind == "plane") & (self.curves.kind[self.arc] == "line")) | (ruled & upright))

    def pace(self, coedge: Index, start: Array, end: Array) -> Array:
        """How far each piece of a coedge (n,) goes from its middle: rad, or halves of a smooth part of its surface.

        Infinite where that is not known, or where what lies between may turn as it likes.
        """
        out = np.full(len(coedge), np.inf)
        kind, row = self.surfaces.kind[self.surface[coedge]], self.pcurve[coedge]
        arc = self.curves.kind[self.arc[coedge]]
        round_ = np.flatnonzero((kind == "plane") & ((arc == "circle") | (arc == "ellipse")))
        out[round_] = (end - start)[round_] / 2
        drawn = np.flatnonzero(row >= 0)
        reach = self.pcurves.reach(row[drawn], start[drawn], end[drawn])
        ruled = (kind[drawn] == "cylinder") | (kind[drawn] == "cone")  # of a low degree in v
        reach[1, ruled & np.isfinite(reach[1])] = 0.0
        free = np.flatnonzero(~self._analytic[self.surface[coedge[drawn]]])
        if len(free):
            at = drawn[free]
            middle = self.pcurves.evaluate(row[at], (start + end)[at] / 2)[0].T
            of = np.searchsorted(self._free, self.surface[coedge[at]])
            for way, lines in enumerate(self._lines):
                cell = rank(lines, of, middle[way])
                cell = lines.offsets[of] + np.clip(cell, 1, np.diff(lines.offsets)[of] - 1)
                reach[way, free] *= 2 / (lines.values[cell] - lines.values[cell - 1])
        out[drawn] = reach.max(axis=0)
        return out

    @cached_property
    def _free(self) -> Index:
        """Rows of the surfaces that are not analytic."""
        return np.flatnonzero(~self._analytic)

    @cached_property
    def _lines(self) -> tuple[Runs, Runs]:
        """Where smooth parts of these begin and end, along u and along v."""
        cuts = [self.surfaces.domain_cuts(one) for one in self._free.tolist()]
        return Runs.of([u for u, _ in cuts]), Runs.of([v for _, v in cuts])

    @cached_property
    def _parted(self) -> npt.NDArray[np.bool_]:
        """Which surfaces (n,) that are not analytic have several smooth parts."""
        out = np.zeros(len(self.surfaces), bool)
        for lines in self._lines:
            out[self._free] |= np.diff(lines.offsets) > 2
        return out

    def pieces(self, coedges: Index) -> tuple[Index, Array, Array]:
        """Smooth pieces of some coedges, in order: the coedge, start and end of the parameter.

        Where the surface itself is made of smooth pieces, a piece of a coedge lies within one of them.
        """
        arc, row = self.arc[coedges], self.pcurve[coedges]
        t0, t1 = self.curves.t0[arc], self.curves.t1[arc]
        which, cuts = self.curves.inner_cuts(arc, t0, t1)
        drawn = np.flatnonzero(row >= 0)
        of, own = self.pcurves.inner_cuts(row[drawn], t0[drawn], t1[drawn])
        found = pieces(t0, t1, np.append(which, drawn[of]), np.append(cuts, own))
        free = (row >= 0) & ~self._analytic[self.surface[coedges]]
        if free.any():
            free &= self._parted[self.surface[coedges]]
        if free.any():
            at = np.flatnonzero(free[found[0]])
            of, cuts = self._crossings(coedges[found[0][at]], found[1][at], found[2][at])
            found = pieces(t0, t1, np.append(found[0], found[0][at][of]), np.append(found[1], cuts))
        which, start, end = found
        return coedges[which], start, end

    def _crossings(self, coedge: Index, start: Array, end: Array) -> tuple[Index, Array]:
        """Where pieces of pcurves (n,) cross the lines u = const and v = const between smooth parts of their surfaces.

        Which of the pieces, and the parameter.
        """
        row = self.pcurve[coedge]
        steps = np.linspace(0.0, 1.0, _SAMPLES + 1)
        t = start[:, None] + (end - start)[:, None] * steps
        uv = self.pcurves.evaluate(np.repeat(row, len(steps)), t.ravel())[0].reshape(*t.shape, 2)
        of = np.searchsorted(self._free, self.surface[coedge])
        found, parameters = [np.empty(0, np.int64)], [np.empty(0)]
        for way in range(2):
            lines, value = self._lines[way], uv[..., way]
            cell = rank(lines, np.repeat(of, len(steps)), value.ravel()).reshape(t.shape)
            cell = np.clip(cell, 1, np.diff(lines.offsets)[of][:, None] - 1)  # the ends are no lines to cross
            low, high = np.minimum(cell[:, :-1], cell[:, 1:]), np.maximum(cell[:, :-1], cell[:, 1:])
            piece, step = np.nonzero(low < high)
            crossed = (high - low)[piece, step]
            line = np.repeat(low[piece, step] - np.cumsum(crossed) + crossed, crossed) + np.arange(crossed.sum())
            piece, step = np.repeat(piece, crossed), np.repeat(step, crossed)
            target = lines.values[lines.offsets[of[piece]] + line]
            left, right = t[piece, step], t[piece, step + 1]
            before, after = value[piece, step], value[piece, step + 1]
            near = left + (right - left) * (target - before) / (after - before)
            for _ in range(_NEWTON_STEPS):
                at, by = (x[:, way] for x in self.pcurves.evaluate(row[piece], near))
                near = np.clip(near - (at - target) / np.where(by == 0, np.inf, by), left, right)
            found.append(piece)
            parameters.append(near)
        return np.concatenate(found), np.concatenate(parameters)
