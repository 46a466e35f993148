"""What follows from the rows of a boundary representation: lengths, boxes, adjacency, samples, triangles' errors."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from relmodel.arrays import Bools, Floats, Floats32, Ints, Ragged
from relmodel.geometry.curves import Curves, box_columns, vector_columns
from relmodel.geometry.surfaces import ANALYTIC_KINDS, Pcurves, Surfaces, distances, normals_at, plane_normals
from relmodel.geometry.transforms import cross, dot, scatter, take, unit
from relmodel.model.model import ArcSamples, Shape, Table

SMOOTH = float(np.deg2rad(1.0))
_CUSP = 1e-4  # rad: faces that meet at so small an angle are tangent, and leave the edge the same way
_CUSP_MM = 0.05  # how far along such faces one looks which is the outer one
SAMPLE_SPACING_MM = 1.0
MOST_SAMPLES = 2000
_STEP_SLACK = 1e-6  # of a step, so that round-off of a length of whole millimetres makes no sample
_FINE_AT_ONCE = 200_000  # points of polylines
_SAMPLES_AT_ONCE = 16384
_CELLS = 32  # of a grid over a domain, each way


def curves_of(shape: Shape) -> Curves:
    """The arcs of a shape, to be evaluated."""
    return Curves(shape.arcs, shape.arc_splines, offsets=shape.arc_offsets, basis=_basis_curves(shape))


def surfaces_of(shape: Shape) -> Surfaces:
    """The surfaces of a shape, to be evaluated."""
    curves, basis = _basis_curves(shape), None
    if shape.basis_surfaces:  # read from a boundary representation
        basis = Surfaces(shape.basis_surfaces, shape.basis_surface_splines, shape.basis_surface_swept, curves)
    return Surfaces(shape.surfaces, shape.surface_splines, shape.surface_swept, curves, basis)


def _basis_curves(shape: Shape) -> Curves | None:
    if not shape.basis_arcs:
        return None
    return Curves(shape.basis_arcs, shape.basis_arc_splines, offsets=shape.basis_arc_offsets)


def arc_measures(curves: Curves) -> Table:
    """Columns start, end, length and box of the arcs."""
    start, end = curves.ends
    return {
        **vector_columns("start", start),
        **vector_columns("end", end),
        "length": curves.lengths(),
        **box_columns(curves.boxes()),
    }


def surface_measures(surfaces: Surfaces) -> Table:
    """Columns area, centroid and box of whole (untrimmed) domains, by a grid: good to about a thousandth."""
    row = np.arange(len(surfaces))
    points, across = grid(surfaces, row, (np.arange(_CELLS) + 0.5) / _CELLS)
    u0, u1, v0, v1 = surfaces.domain.T[:, :, None]
    area = np.linalg.norm(across, axis=2) * (u1 - u0) * (v1 - v0) / _CELLS**2
    centroid = np.einsum("nk,nkd->nd", area, points) / np.maximum(area.sum(1), 1e-300)[:, None]
    corners, _ = grid(surfaces, row, np.linspace(0, 1, _CELLS + 1))
    box = np.concatenate([corners.min(1), corners.max(1)], axis=1) if len(row) else np.empty((0, 6))
    return {"area": area.sum(1), **vector_columns("centroid", centroid), **box_columns(box)}


def grid(surfaces: Surfaces, row: Ints, steps: Floats) -> tuple[Floats, Floats]:
    """Points and normals dS/du x dS/dv (n, k, 3) of surfaces `row` (n,) on a grid of steps in 0..1 of their domains."""
    u0, u1, v0, v1 = (surfaces.domain[row, i, None, None] for i in range(4))
    u, v = np.broadcast_arrays(u0 + steps[:, None] * (u1 - u0), v0 + steps * (v1 - v0))
    at = surfaces.evaluate(np.repeat(row, len(steps) ** 2), u.ravel(), v.ravel())
    shape = len(row), len(steps) ** 2, 3
    return at.points.reshape(shape), np.cross(at.by_u, at.by_v).reshape(shape)


class ArcNormals:
    """Outward normals of the two surfaces that meet in each arc.

    a, b: row of the coedge that runs along the arc and of the one that runs against it, -1 where there is none.
    Where only one runs it is `a`, whichever way; of more than two (non-manifold) the first of each sense counts."""

    def __init__(self, faces: TrimmedFaces) -> None:
        surfaces, curves, arc = faces.surfaces, faces.curves, faces.arc
        self.surfaces, self.curves, self.pcurves = surfaces, curves, faces.pcurves
        self.surface, self.reversed, self._pcurve = faces.surface, faces.reversed, faces.pcurve
        rows = np.arange(len(arc))
        self.a, self.b = np.full(len(curves), -1), np.full(len(curves), -1)
        along, against = rows[~self.reversed][::-1], rows[self.reversed][::-1]
        self.a[arc[along]] = along  # written backwards: the first row stands
        self.b[arc[against]] = against
        # Both the same way, as in a badly oriented sheet: the second is b.
        others = rows[(self.a[arc] != rows) & (self.b[arc] < 0)][::-1]
        self.b[arc[others]] = others
        only = self.a < 0
        self.a[only], self.b[only] = self.b[only], -1
        others = rows[(self.a[arc] != rows) & (self.b[arc] < 0)][::-1]
        self.b[arc[others]] = others
        self.flat = np.asarray(surfaces.kind == "plane")
        self.level = plane_normals(surfaces)  # of those that are flat
        self._analytic = np.logical_or.reduce([surfaces.kind == kind for kind in ANALYTIC_KINDS])

    def at(self, coedge: Ints, arc: Ints, t: Floats, points: Floats | None = None) -> Floats:
        """Normals (n, 3) at the parameters t (n,) of the arcs (n,), on the surfaces of the coedges (n,), none -1.
        points: of the arcs at `self.inner(arc, t)`, where they are known."""
        surface = self.surface[coedge]
        if points is None:
            points = np.zeros((3, len(t))).T
            curved = np.flatnonzero(~self.flat[surface])  # a plane has one normal everywhere
            points[curved] = self.curves.evaluate(arc[curved], self.inner(arc[curved], t[curved]))[0]
        normals = normals_at(self.surfaces, surface, points)
        rest = np.flatnonzero(np.isnan(normals[:, 0]))
        if len(rest):
            surface, coedge = surface[rest], coedge[rest]
            u, v = self.surfaces.domain[surface][:, :2].mean(1), self.surfaces.domain[surface][:, 2:].mean(1)
            hidden = np.flatnonzero(self._analytic[surface])
            u[hidden], v[hidden] = self.surfaces.parameters(surface[hidden], points[rest[hidden]])
            drawn = np.flatnonzero(~self._analytic[surface] & (self._pcurve[coedge] >= 0))
            at = self.inner(arc[rest[drawn]], t[rest[drawn]])
            u[drawn], v[drawn] = self.pcurves.evaluate(self._pcurve[coedge[drawn]], at)[0].T
            normals[rest] = self.surfaces.normals(surface, u, v)
        return normals

    def inner(self, arc: Ints, t: Floats) -> Floats:
        """Parameters where a normal is one: an end may be the apex of a cone or a pole, so step in a ten-millionth."""
        t0, t1 = self.curves.t0, self.curves.t1
        step = 1e-7 * (t1 - t0)
        return np.clip(t, np.take(t0 + step, arc), np.take(t1 - step, arc))


def adjacency(normals: ArcNormals) -> Table:
    """Columns surface_a, surface_b, convexity and angle of `shape_arc`."""
    curves, a, b = normals.curves, normals.a, normals.b
    both = np.flatnonzero((a >= 0) & (b >= 0) & (curves.kind != "degenerate"))
    t = (curves.t0[both] + curves.t1[both]) / 2
    points, by = curves.evaluate(both, t)
    normal_a, normal_b = normals.at(a[both], both, t, points), normals.at(b[both], both, t, points)
    tangent = unit(by.T).T
    tangent = np.where(normals.reversed[a[both]][:, None], -tangent, tangent)
    angle = np.full(len(curves), np.nan)
    angle[both] = np.arctan2(dot(cross(normal_a.T, normal_b.T), tangent.T), dot(normal_a.T, normal_b.T))
    cusps = np.flatnonzero(np.abs(angle[both]) > np.pi - _CUSP)
    if len(cusps):
        hollow = _hollow(normals, both[cusps], t[cusps], normal_a[cusps], tangent[cusps])
        angle[both[cusps]] = np.where(hollow, -1.0, 1.0) * np.abs(angle[both[cusps]])
    surface = np.append(normals.surface, -1)
    surface_a, surface_b = surface[a], surface[b]
    convexity = np.select(
        [curves.kind == "degenerate", b < 0, surface_a == surface_b, np.abs(angle) < SMOOTH, angle > 0],
        ["degenerate", "free", "seam", "smooth", "convex"],
        "concave",
    )
    return {"surface_a": surface_a, "surface_b": surface_b, "convexity": convexity.tolist(), "angle": angle}


def _hollow(normals: ArcNormals, arc: Ints, t: Floats, normal_a: Floats, tangent: Floats) -> Bools:
    """Whether it is void that lies in the cusp of arcs where both faces leave the same way, their normals opposed.

    The normals at the edge cannot decide; a little way along the faces, the one outside of the other does."""
    surfaces = normals.surfaces
    points = normals.curves.evaluate(arc, t)[0] + _CUSP_MM * np.cross(normal_a, tangent)
    feet = []
    for coedge in (normals.a[arc], normals.b[arc]):
        row = normals.surface[coedge]
        feet.append(surfaces.evaluate(row, *surfaces.parameters(row, points)).points)
    # A free-form surface has no foot here: round-off decides, as void.
    outward = np.einsum("nd,nd->n", feet[1] - feet[0], normal_a)
    return np.asarray(~(outward <= 0))


def samples(normals: ArcNormals, length: Floats) -> ArcSamples:
    """Points along each arc, ends included, evenly spaced: about 1 mm, at least 2 and at most 2000 an arc."""
    curves = normals.curves
    steps = np.ceil(length / SAMPLE_SPACING_MM - _STEP_SLACK).astype(np.int64)
    count = np.clip(steps + 1, 2, MOST_SAMPLES)
    offsets = np.concatenate([[0], np.cumsum(count)])
    points = np.empty((offsets[-1], 3))
    directions = [np.empty((offsets[-1], 3), np.float32) for _ in range(3)]
    uneven = np.logical_and.reduce([curves.kind != kind for kind in ("line", "circle", "degenerate")])
    spaced = _evenly(curves, np.flatnonzero(uneven), count[uneven])
    for arcs in _blocks(offsets):
        here = slice(offsets[arcs[0]], offsets[arcs[-1] + 1])
        arc, share = _shares(count[arcs])
        arc += arcs[0]
        at = np.take(curves.t0, arc) + share * np.take(curves.t1 - curves.t0, arc)
        drawn = uneven[arc]
        at[drawn], spaced = np.split(spaced, [np.count_nonzero(drawn)])
        ends = offsets[arcs[0] : arcs[-1] + 2] - offsets[arcs[0]]
        at[ends[1:] - 1] = curves.t1[arcs]
        for out, values in zip((points, *directions), _sampled(normals, arcs, arc, at, ends), strict=True):
            out[here] = values
    triple = 3 * offsets
    return ArcSamples(
        arc_no=np.arange(len(curves)),
        points=Ragged(points.ravel(), triple),
        tangents=Ragged(directions[0].ravel(), triple),
        normals_a=Ragged(directions[1].ravel(), triple),
        normals_b=Ragged(directions[2].ravel(), triple),
    )


def _blocks(offsets: Ints) -> list[Ints]:
    """Arcs in runs of about as many samples as stay in the cache while they are worked on."""
    block = offsets[:-1] // _SAMPLES_AT_ONCE
    return np.split(np.arange(len(block)), np.flatnonzero(np.diff(block)) + 1) if len(block) else []


def _sampled(
    normals: ArcNormals, arcs: Ints, arc: Ints, t: Floats, ends: Ints
) -> tuple[Floats, Floats32, Floats32, Floats32]:
    """Points, tangents and normals on both sides (n, 3) of arcs (n,) at t (n,).  arcs: (m,) those that occur, in order;
    ends: (m + 1,) where their samples begin and end."""
    curves, count = normals.curves, np.diff(ends)
    points, by = curves.evaluate(arc, t)
    tangents, bent = _repeated(unit(curves.x[arcs].T).T, curves.kind[arcs] == "line", count)
    scatter(tangents.T, bent, unit(take(by, bent)))
    inner = points.copy(order="K")
    last = np.concatenate([ends[:-1], ends[1:] - 1])
    scatter(inner.T, last, curves.evaluate(arc[last], normals.inner(arc[last], t[last]))[0].T)
    sides: list[Floats32] = []
    for coedges in (normals.a, normals.b):
        own = coedges[arcs]
        surface = normals.surface[own] if len(normals.surface) else own
        known = (own < 0) | normals.flat[surface]
        side, curved = _repeated(np.where(own[:, None] < 0, 0.0, normals.level[surface]), known, count)
        of = np.take(arc, curved)
        scatter(side.T, curved, normals.at(np.take(coedges, of), of, np.take(t, curved), take(inner, curved).T).T)
        if sides:  # a free edge is sharp, and one of its sides always looks at the camera
            free = np.flatnonzero(np.repeat(own < 0, count))
            side[free] = -sides[0][free]
            pole = np.flatnonzero(np.repeat((own < 0) & (curves.kind[arcs] == "degenerate"), count))
            side[pole] = sides[0][pole]
        sides.append(side)
    return points, tangents, sides[0], sides[1]


def _repeated(vectors: Floats, known: Bools, count: Ints) -> tuple[Floats32, Ints]:
    """Vectors (m, 3) that stand for `count` (m,) samples each, and those samples (k,) for which they are not known."""
    out: Floats32 = np.repeat(vectors.astype(np.float32), count, axis=0)
    return out, np.flatnonzero(np.repeat(~known, count))


def _evenly(curves: Curves, arc: Ints, count: Ints) -> Floats:
    """Parameters of `count` (n,) points evenly spaced along each arc (n,), by the chords of a finer polyline."""
    out = [np.empty(0)]
    fine = 2 * count + 63
    block = np.cumsum(fine) // _FINE_AT_ONCE
    for one in range(int(block.max(initial=-1)) + 1):
        which = np.flatnonzero(block == one)
        start, end = curves.t0[arc[which]], curves.t1[arc[which]]
        row, share = _shares(fine[which])
        t = start[row] + share * (end - start)[row]
        points = curves.evaluate(arc[which][row], t)[0]
        chord = np.append(0.0, np.linalg.norm(np.diff(points, axis=0), axis=1))
        first = np.cumsum(fine[which]) - fine[which]
        chord[first] = 1.0  # between arcs: all lie after each other along one line
        along = np.cumsum(chord)
        low, high = along[first], along[first + fine[which] - 1]
        row, share = _shares(count[which])
        out.append(np.interp(low[row] + share * (high - low)[row], along, t))
    return np.concatenate(out)


def _shares(count: Ints) -> tuple[Ints, Floats]:
    """Numbers 0 to 1 in `count` (n,) steps less one, after each other, and whose each is."""
    row = np.repeat(np.arange(len(count)), count)
    return row, (np.arange(len(row)) - (np.cumsum(count) - count)[row]) / (count[row] - 1)


# Coedges as curves in the (u, v) domains of their faces: the pcurves where a face has them, else the arcs' feet.


def pcurve_of(coedges: Table, pcurves: Table) -> Ints:
    """Row of the pcurve of each coedge, -1 where it has none; both tables are in order of their keys."""
    names = ("surface_no", "loop_no", "coedge_no")
    keys = np.stack([np.asarray(coedges[n], np.int64) for n in names], axis=1)
    have = np.stack([np.asarray(pcurves[n], np.int64) for n in names], axis=1)
    base = (keys.max(0, initial=0) + 1)[1:]
    flat, flat_have = ((k[:, 0] * base[0] + k[:, 1]) * base[1] + k[:, 2] for k in (keys, have))
    out = np.full(len(keys), -1)
    out[np.searchsorted(flat, flat_have)] = np.arange(len(have))
    return out


class TrimmedFaces:
    """Surfaces with the coedges that trim them.  surface, arc, reversed: columns of the coedges; pcurve: row of each in
    `pcurves`, -1: none, or on a plane."""

    def __init__(self, surfaces: Surfaces, curves: Curves, coedges: Table, pcurves: Table) -> None:
        self.surfaces, self.curves, self.pcurves = surfaces, curves, Pcurves(pcurves)
        self.surface = np.asarray(coedges["surface_no"], np.int64)
        self.arc = np.asarray(coedges["arc_no"], np.int64)
        self.reversed = np.asarray(coedges["reversed"], bool)
        flat = np.asarray(surfaces.kind == "plane")
        self.pcurve = np.where(flat[self.surface], -1, pcurve_of(coedges, pcurves))

    def evaluate(self, coedge: Ints, t: Floats) -> Floats:
        """Points (n, 2: u v) of coedges at parameters of their arcs; without a pcurve angles are in [-pi, pi]."""
        uv = np.empty((2, len(t))).T
        row = self.pcurve[coedge]
        drawn, bare = np.flatnonzero(row >= 0), np.flatnonzero(row < 0)
        if len(drawn):
            scatter(uv.T, drawn, self.pcurves.evaluate(row[drawn], t[drawn])[0].T)
        if len(bare):
            points = self.curves.evaluate(self.arc[coedge[bare]], t[bare])[0]
            scatter(uv.T, bare, np.stack(self.surfaces.parameters(self.surface[coedge[bare]], points)))
        return uv


# What is measured on the triangles of a shape: how far they are from the exact geometry, and whether they close.

_ENOUGH = 0.25  # of the chord: what is nearer is not worth a foot point
WELD_MM = 1e-5  # vertices of faces that are nearer to each other are one
_RULED = ("cylinder", "cone", "extrusion")


class HalfEdges(NamedTuple):
    """The sides of triangles, three each, after each other.  tail, head: vertices; bare: whether no other side runs
    back along it, as vertices of faces are apart."""

    tail: Ints
    head: Ints
    bare: Bools

    @classmethod
    def of(cls, triangles: npt.NDArray[np.integer]) -> HalfEdges:
        """Sides of triangles (m, 3)."""
        tail, head = triangles.astype(np.int64).ravel(), np.roll(triangles, -1, axis=1).astype(np.int64).ravel()
        count = int(tail.max(initial=0)) + 1
        there, back = tail * count + head, np.sort(head * count + tail)
        return cls(tail, head, np.take(back, np.searchsorted(back, there), mode="clip") != there)


def surface_deviation(
    surfaces: Surfaces,
    vertices: Floats,
    uv: Floats,
    triangles: npt.NDArray[np.integer],
    sides: HalfEdges,
    owner: Ints,
    chord_mm: float,
) -> float:
    """Greatest distance of midpoints of sides and of centroids of triangles (m, 3) from curved surfaces (m,), mm.

    vertices (n, 3), their parameters uv (n, 2); of free-form surfaces an upper bound, exact to a quarter of the chord.
    """
    kind = surfaces.kind[owner].astype(str)
    round_ = np.flatnonzero(~np.isin(kind, ("plane", *_RULED)))  # of the others a side is the farthest
    once = np.flatnonzero(((sides.tail < sides.head) | sides.bare) & np.repeat(kind != "plane", 3))
    worst = 0.0
    for *nodes, row in (
        (sides.tail[once], sides.head[once], np.repeat(owner, 3)[once]),
        (*triangles[round_].T, owner[round_]),
    ):
        middle, at = (sum(values[node] for node in nodes) / len(nodes) for values in (vertices, uv))
        worst = max(worst, float(distances(surfaces, row, middle, at, _ENOUGH * chord_mm).max(initial=0.0)))
    return worst


def flat_deviation(surfaces: Surfaces, vertices: Floats, owner: Ints) -> float:
    """Greatest distance of vertices (n, 3) of flat faces from their planes `owner` (n,), mm."""
    flat = np.flatnonzero(surfaces.kind[owner] == "plane")
    uv = np.zeros((len(flat), 2))
    return float(distances(surfaces, owner[flat], vertices[flat], uv, 0.0).max(initial=0.0))


def arc_deviation(curves: Curves, arc: Ints, start: Floats, end: Floats) -> float:
    """Greatest distance of arcs (n,) midway between parameters start and end (n,) from their chords there, mm."""
    if not len(arc):
        return 0.0
    first, middle, last = (curves.evaluate(arc, t)[0] for t in (start, (start + end) / 2, end))
    along, arm = last - first, middle - first
    square = np.einsum("nd,nd->n", along, along)
    share = np.clip(np.einsum("nd,nd->n", arm, along) / np.where(square > 0, square, 1.0), 0.0, 1.0)
    return float(np.linalg.norm(arm - share[:, None] * along, axis=1).max())


def open_edges(vertices: Floats, sides: HalfEdges) -> int:
    """How many sides of triangles lack a neighbour once vertices (n, 3) at one place are one."""
    used, ends = np.unique(np.stack([sides.tail[sides.bare], sides.head[sides.bare]]), return_inverse=True)
    places, ends = vertices[used], ends.reshape(2, -1)
    found = _unpaired(places, ends)
    return found and min(found, _unpaired(np.round(places / WELD_MM), ends))


def _unpaired(places: Floats, ends: Ints) -> int:
    """How many directed edges (2, m) between places (n, 3) no other one runs back along."""
    place = np.unique(places + 0.0, axis=0, return_inverse=True)[1].ravel()  # no -0.0
    tail, head = place[ends]
    edge = np.unique(np.minimum(tail, head) * len(places) + np.maximum(tail, head), return_inverse=True)[1]
    return int(np.abs(np.bincount(edge.ravel(), np.sign(head - tail))).sum())


# Samples along arcs as the store keeps them: of straight ones the two ends, of what is the same everywhere one.

_ROUND_OFF = 8 * np.finfo(float).eps  # of the greatest value: what samples of a straight arc, or one normal, may be off


def pack_samples(samples: ArcSamples) -> Table:
    """Columns of `shape_arc_sample` but for the shape; every arc has two samples at least."""
    count = np.diff(samples.points.offsets) // 3
    directions = {name: getattr(samples, name) for name in ("tangents", "normals_a", "normals_b")}
    return {
        "arc_no": samples.arc_no,
        "sample_count": count,
        "points": _keep(samples.points, count, 2),
        **{name: _keep(values, count, 1) for name, values in directions.items()},
    }


def spread_samples(kept: Sequence[npt.ArrayLike], count: Ints, width: int) -> Floats:
    """All samples (sum of count, width) of arcs (n,), of each of which all, the two ends or one is kept."""
    arrays = [np.asarray(values, float).reshape(-1, width) for values in kept]
    there = np.array([len(values) for values in arrays], np.int64)
    return _interpolate(np.concatenate([np.empty((0, width)), *arrays]), there, count)


def _keep(column: Ragged, count: Ints, ends: int) -> Ragged:
    """A column of arcs (n,), of `count` (n,) samples each, without what follows from the first, or from both ends."""
    first = np.cumsum(count) - count
    values = column.values.reshape(count.sum(), -1)
    kept = np.stack([first, first + count - 1], axis=1)[:, :ends]
    bound = _ROUND_OFF * np.abs(values[kept]).max(axis=(1, 2), initial=0.0)
    off = np.abs(values - _interpolate(values[kept.ravel()], np.full(len(count), ends), count)).max(axis=1)
    own = np.maximum.reduceat(off, first) > bound
    chosen = np.repeat(own, count)
    chosen[kept] = True
    offsets = np.concatenate([[0], np.cumsum(np.where(own, count, ends))])
    return Ragged(values[chosen].ravel(), values.shape[1] * offsets)


def _interpolate(values: Floats, there: Ints, count: Ints) -> Floats:
    """Samples (sum of count, w) of arcs (n,), of which values (sum of there, w) has all, the two ends or one."""
    arc = np.repeat(np.arange(len(count)), count)
    step = np.arange(len(arc)) - (np.cumsum(count) - count)[arc]
    first, every = (np.cumsum(there) - there)[arc], (there == count)[arc]
    low, high = first + np.where(every, step, 0), first + np.where(every, step, there[arc] - 1)
    share = np.where(high > low, step / (count[arc] - 1), 0.0)[:, None]
    return np.asarray(values[low] * (1 - share) + values[high] * share)
