"""Triangles to surfaces and arcs: flat regions become planes, smooth ones facets, sharp and open edges chains of arcs.

Everything is said to be fitted: a mesh only tells of points on the surfaces that it came from.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from relmodel.loading.chains import Chains, chain_edges
from relmodel.loading.neutral import ArcSamples, Mesh, Shape, Table
from relmodel.loading.fitted import surface_rows
from relmodel.loading.fitted_arcs import fit_arcs
from relmodel.loading.regions import Edges, components, cut_regions, find_edges, weld
from relmodel.store import Ragged

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]

CONVEXITY_RAD = np.radians(1)
SAMPLE_MM = 1.0
_MOST_SAMPLES = 200_000  # of a shape


def shape_from_triangles(vertices: Floats, triangles: Ints) -> Shape | None:
    """The shape that triangles (m, 3), counter-clockwise from outside, of vertices (n, 3) in mm bound.

    Vertices are welded where they coincide; None where no triangle has an area.
    """
    vertices, triangles = weld(vertices, triangles)
    if len(triangles) == 0:
        return None
    diagonal = float(np.linalg.norm(np.ptp(vertices, axis=0)))
    tolerance = max(1e-3, 2.5e-6 * diagonal)
    edges, closed = find_edges(vertices, triangles)
    volume = None
    if closed:
        a, b, c = (vertices[triangles[:, i]] - vertices[0] for i in range(3))
        volume = float(np.sum(a * np.cross(b, c)) / 6)
        if volume < 0:  # inside out
            triangles = triangles[:, ::-1].copy()
            edges, _ = find_edges(vertices, triangles)
            volume = -volume
    regions = cut_regions(vertices, triangles, edges, tolerance)
    region = regions.of_triangle
    surfaces, normals = surface_rows(vertices, triangles, regions)

    region_a = region[edges.triangle_a]
    region_b = np.where(edges.triangle_b >= 0, region[edges.triangle_b], -1)
    border = np.flatnonzero(region_a != region_b)
    chains = chain_edges(vertices, edges.ends[border], region_a[border], region_b[border])
    arcs, splines = _arcs(vertices, chains, edges, border, region_a, region_b, tolerance)
    loops, coedges = _loops(vertices, chains, arcs, surfaces)
    return Shape(
        kind="mesh",
        volume=volume,
        surfaces=surfaces,
        surface_splines={},
        surface_swept={},
        arcs=arcs,
        arc_splines=splines,
        loops=loops,
        coedges=coedges,
        pcurves={},
        basis_arcs={},
        basis_arc_splines={},
        basis_surfaces={},
        basis_surface_splines={},
        mesh=_mesh(vertices, triangles, region, normals),
        samples=_samples(vertices, chains, edges, border, normals),
    )


def _mesh(vertices: Floats, triangles: Ints, region: Ints, normals: Floats) -> Mesh:
    key = (region[:, None] * np.int64(len(vertices)) + triangles).ravel()
    _, first, inverse = np.unique(key, return_index=True, return_inverse=True)
    return Mesh(
        chord_mm=0.0,
        chord_rad=0.0,
        vertices=vertices[triangles.ravel()[first]],
        normals=normals.reshape(-1, 3)[first].astype(np.float32),
        triangles=inverse.reshape(-1, 3).astype(np.int32),
        triangle_surfaces=region.astype(np.int32),
    )


def _arcs(
    vertices: Floats, chains: Chains, edges: Edges, border: Ints, region_a: Ints, region_b: Ints, tolerance: float
) -> tuple[Table, Table]:
    """Rows of the chains: lines where straight, polylines where not."""
    n = chains.count
    if n == 0:
        return {}, {}
    points = vertices[chains.vertices]
    start, last = chains.offsets[:-1] + np.arange(n), chains.offsets[1:] + np.arange(n)
    which = np.repeat(np.arange(n), np.diff(chains.offsets) + 1)
    begin, end = points[start], points[last]
    step = np.linalg.norm(np.diff(points, axis=0), axis=1)
    step = step[which[1:] == which[:-1]]
    length = np.add.reduceat(step, chains.offsets[:-1])
    chord = end - begin
    direction = chord / np.maximum(np.linalg.norm(chord, axis=1, keepdims=True), 1e-300)
    arm = points - begin[which]
    away = np.linalg.norm(arm - np.sum(arm * direction[which], axis=1, keepdims=True) * direction[which], axis=1)
    residual = np.maximum.reduceat(away, start)
    line = (residual <= tolerance) & (np.linalg.norm(chord, axis=1) > 0.5 * length)
    length = np.where(line, np.linalg.norm(chord, axis=1), length)
    kind = np.where(line, "line", "polyline")

    halfway = (chains.offsets[:-1] + chains.offsets[1:] - 1) // 2
    middle, turned = border[chains.edges[halfway]], chains.turned[halfway]
    angle = edges.angle[middle]
    convexity = np.select(
        [region_b[middle] < 0, np.abs(angle) < CONVEXITY_RAD, angle > 0],
        ["free", "smooth", "convex"],
        "concave",
    )
    arcs: Table = {
        "kind": kind,
        "recognised_kind": kind,
        **{f"origin_{c}": np.where(line, begin[:, i], np.nan) for i, c in enumerate("xyz")},
        **{f"axis_x_{c}": np.where(line, direction[:, i], np.nan) for i, c in enumerate("xyz")},
        **{f"axis_z_{c}": np.full(n, np.nan) for c in "xyz"},
        "radius": np.full(n, np.nan),
        "radius2": np.full(n, np.nan),
        "t0": np.zeros(n),
        "t1": length,
        **{f"start_{c}": begin[:, i] for i, c in enumerate("xyz")},
        **{f"end_{c}": end[:, i] for i, c in enumerate("xyz")},
        "length": length,
        **{f"{c}0": np.minimum.reduceat(points[:, i], start) for i, c in enumerate("xyz")},
        **{f"{c}1": np.maximum.reduceat(points[:, i], start) for i, c in enumerate("xyz")},
        "provenance": ["fitted"] * n,
        "residual": np.where(line, residual, 0.0),
        "surface_a": np.where(turned, region_b[middle], region_a[middle]),
        "surface_b": np.where(turned, region_a[middle], region_b[middle]),
        "convexity": convexity,
        "angle": angle,
    }
    curved = np.flatnonzero(~line)
    place = np.concatenate([[0.0], np.cumsum(step)])
    knots, poles = [], []
    for i in curved.tolist():
        a, b = int(chains.offsets[i]), int(chains.offsets[i + 1])
        knots.append(place[a : b + 1] - place[a])
        poles.append(points[a + i : b + i + 1])
    if not len(curved):
        return arcs, {}
    splines: Table = {
        "arc_no": curved,
        "degree": np.ones(len(curved), np.int64),
        "periodic": np.zeros(len(curved), bool),
        "rational": np.zeros(len(curved), bool),
        "knots": Ragged.pack(knots),
        "multiplicities": Ragged.pack([np.r_[2, np.ones(len(k) - 2), 2] for k in knots], np.int32),
        "poles": Ragged.pack(poles),
        "weights": Ragged.pack([None] * len(curved)),
    }
    return arcs, splines


def _loops(vertices: Floats, chains: Chains, arcs: Table, surfaces: Table) -> tuple[Table, Table]:
    """Loops and coedges of the regions; the outer loop of a region is the one that encloses most."""
    n = chains.count
    if n == 0:
        return {}, {}
    begin = chains.vertices[chains.offsets[:-1] + np.arange(n)]
    end = chains.vertices[chains.offsets[1:] + np.arange(n)]
    a, b = np.asarray(arcs["surface_a"], np.int64), np.asarray(arcs["surface_b"], np.int64)
    two = np.flatnonzero(b >= 0)
    arc = np.concatenate([np.arange(n), two])
    surface = np.concatenate([a, b[two]])
    backward = np.concatenate([np.zeros(n, bool), np.ones(len(two), bool)])
    tail, head = np.where(backward, end[arc], begin[arc]), np.where(backward, begin[arc], end[arc])
    # Coedges of one surface that share a vertex are of one loop.
    node = np.unique(np.concatenate([surface * np.int64(len(vertices)) + v for v in (tail, head)]), return_inverse=True)
    ends = node[1].ravel().reshape(2, -1)
    loop = components(len(node[0]), ends[0], ends[1])[ends[0]]

    size = _enclosed(vertices, chains, arc, surface, backward, loop, surfaces)
    _, first = np.unique(loop, return_index=True)
    order = np.lexsort((first, -size[loop[first]], surface[first]))
    rank = np.empty(len(first), np.int64)
    rank[loop[first[order]]] = np.arange(len(first))
    owner = surface[first[order]]
    loop_no = np.arange(len(owner)) - np.searchsorted(owner, owner)
    sequence = _follow(rank[loop], ends[0], ends[1])
    position = rank[loop][sequence]
    coedge_no = np.arange(len(sequence)) - np.searchsorted(position, position)
    loops: Table = {"surface_no": owner, "loop_no": loop_no, "outer_loop": loop_no == 0}
    coedges: Table = {
        "surface_no": surface[sequence],
        "loop_no": loop_no[position],
        "coedge_no": coedge_no,
        "arc_no": arc[sequence],
        "reversed": backward[sequence],
    }
    return loops, coedges


def _enclosed(
    vertices: Floats, chains: Chains, arc: Ints, surface: Ints, backward: Bools, loop: Ints, surfaces: Table
) -> Floats:
    """Twice the area that each loop encloses, seen along its surface's normal; of facets, its length."""
    n = chains.count
    points = vertices[chains.vertices]
    which = np.repeat(np.arange(n), np.diff(chains.offsets) + 1)
    inside = which[1:] == which[:-1]
    cross = np.cross(points[:-1], points[1:])[inside]
    swept = np.stack([np.add.reduceat(cross[:, i], chains.offsets[:-1]) for i in range(3)], axis=1)[arc]
    normal = np.stack([np.asarray(surfaces[f"axis_z_{c}"], float) for c in "xyz"], axis=1)[surface]
    flat = np.sum(swept * normal, axis=1) * np.where(backward, -1, 1)
    length = np.add.reduceat(np.linalg.norm(np.diff(points, axis=0), axis=1)[inside], chains.offsets[:-1])[arc]
    size = np.bincount(loop, np.where(np.isnan(flat), length, flat))
    return np.asarray(np.abs(size))


def _follow(loop: Ints, tail: Ints, head: Ints) -> Ints:
    """Coedges loop by loop, each followed by one that begins where it ends, if any is left."""
    order = np.argsort(loop, kind="stable")
    leaving: dict[int, list[int]] = {}
    for i in order[::-1].tolist():
        leaving.setdefault(int(tail[i]), []).append(i)
    done = np.zeros(len(loop), bool)
    out: list[int] = []
    current = -1
    for i in order.tolist():
        while not done[i]:
            choices = leaving.get(int(head[current]), []) if current >= 0 and loop[current] == loop[i] else []
            while choices and done[choices[-1]]:
                choices.pop()
            current = choices.pop() if choices else i
            done[current] = True
            out.append(current)
    return np.array(out, dtype=np.int64)


def _samples(vertices: Floats, chains: Chains, edges: Edges, border: Ints, normals: Floats) -> ArcSamples:
    """Points along the chains, a millimetre or, on a small part, less apart, with the normals on both sides."""
    n = chains.count
    which = np.repeat(np.arange(n), np.diff(chains.offsets))
    first = chains.vertices[np.arange(len(which)) + which]
    second = chains.vertices[np.arange(len(which)) + which + 1]
    vector = vertices[second] - vertices[first]
    step = np.linalg.norm(vector, axis=1)
    length = np.add.reduceat(step, chains.offsets[:-1]) if n else np.empty(0)
    diagonal = float(np.linalg.norm(np.ptp(vertices, axis=0)))
    spacing = max(min(SAMPLE_MM, diagonal / 100), float(length.sum()) / _MOST_SAMPLES)
    count = np.maximum(np.ceil(length / spacing).astype(np.int64), 1) + 1
    offsets = np.concatenate([[0], np.cumsum(count)]).astype(np.int64)
    chain = np.repeat(np.arange(n), count)
    t = (np.arange(len(chain)) - offsets[chain]) / (count[chain] - 1) * length[chain]
    place = np.concatenate([[0.0], np.cumsum(step)])
    base = place[chains.offsets[:-1]][chain]
    edge = np.searchsorted(place, base + t, side="right") - 1
    edge = np.clip(edge, chains.offsets[:-1][chain], chains.offsets[1:][chain] - 1)
    tangent = vector[edge] / step[edge, None]
    points = vertices[first[edge]] + (base + t - place[edge])[:, None] * tangent
    face = normals.mean(axis=1)
    face /= np.maximum(np.linalg.norm(face, axis=1, keepdims=True), 1e-300)
    source = border[chains.edges[edge]]
    turned = chains.turned[edge]
    left = np.where(turned, edges.triangle_b[source], edges.triangle_a[source])
    right = np.where(turned, edges.triangle_a[source], edges.triangle_b[source])
    normal_a = face[left]
    normal_b = np.where((right >= 0)[:, None], face[right], normal_a)
    packed = 3 * offsets
    return ArcSamples(
        arc_no=np.arange(n),
        parameters=Ragged(t, offsets),
        points=Ragged(points.ravel(), packed),
        tangents=Ragged(tangent.astype(np.float32).ravel(), packed),
        normals_a=Ragged(normal_a.astype(np.float32).ravel(), packed),
        normals_b=Ragged(normal_b.astype(np.float32).ravel(), packed),
    )
