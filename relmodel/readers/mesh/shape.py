"""Triangles to surfaces and arcs: regions become fitted surfaces, the edges between them arcs."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from relmodel.arrays import Bools, Floats, Ints, Ragged
from relmodel.geometry.congruence import components, greatest, group_bounds, unsigned
from relmodel.geometry.curves import Curves, box_columns, vector_columns, vectors
from relmodel.geometry.surfaces import Surfaces
from relmodel.model.model import ArcSamples, Finding, Mesh, Shape, Table
from relmodel.readers.mesh.fit import FittedArcs, fit_arcs, frames_about
from relmodel.readers.mesh.segment import MeshRegions, fit_faces, segment_mesh, smooth_regions
from relmodel.readers.mesh.triangles import (
    DEFAULTS,
    EdgeChains,
    MeshEdges,
    area_normals,
    chain_edges,
    find_edges,
    group_sums,
    mean_planes,
    mend_winding,
    rounding,
    weld,
    without_lines,
)
from relmodel.readers.splines import polyline, spline_columns

_SEGMENTS = DEFAULTS.segments


def surface_rows(vertices: Floats, triangles: Ints, regions: MeshRegions) -> tuple[Table, Floats]:
    """Rows of the regions, and the outward normal (m, 3, 3) of the surface at each triangle's corners."""
    region, kind = regions.of_triangle, regions.kind
    count = len(kind)
    corner = vertices[triangles]
    plane_residual, plane_normal, centroid, area = mean_planes(vertices, triangles, region)
    plane, curved = kind == "plane", ~np.isin(kind, ("plane", "facets"))
    fine = rounding(vertices)

    axis, origin, radius, radius2, semi = _frames(regions, plane_normal, centroid)
    reach = greatest(np.linalg.norm(corner - centroid[region][:, None], axis=2).max(axis=1), region, count)
    axis = _aligned(kind, axis, reach, plane_residual, fine)
    table: Table = {
        "kind": np.where(kind == "facets", "plane", kind),  # a mean plane, until all is evaluated
        **vector_columns("origin", origin),
        **vector_columns("axis_x", frames_about(axis)[:, 0]),
        **vector_columns("axis_z", axis),
        "direct": np.ones(count, bool),
        "radius": radius,
        "radius2": radius2,
        "semi_angle": semi,
        **{name: np.zeros(count) for name in ("u0", "u1", "v0", "v1")},
        "reversed": np.zeros(count, bool),
    }
    frames = Surfaces(table)
    flat_corner, owner = corner.reshape(-1, 3), np.repeat(region, 3)
    u, v = frames.parameters(owner, flat_corner)
    foot = frames.evaluate(owner, u, v).points
    away = np.where(kind[owner] == "facets", 0.0, np.linalg.norm(flat_corner - foot, axis=1))
    residual = greatest(away, owner, count)

    # At an apex or a pole the angle u is that of the triangle's next corner.
    across = flat_corner - origin[owner]
    across -= np.sum(across * axis[owner], axis=1, keepdims=True) * axis[owner]
    pointed = (np.linalg.norm(across, axis=1) < 10 * fine).reshape(-1, 3)
    angle = np.where(pointed, np.roll(u.reshape(-1, 3), -1, axis=1), u.reshape(-1, 3))
    u0, u1, turned = _interval(angle, region, count)
    v0, v1 = group_bounds(v, owner, count)
    torus = kind == "torus"
    w0, w1, _ = _interval(v.reshape(-1, 3), region, count)
    v0, v1 = np.where(torus, w0, v0), np.where(torus, w1, v1)
    v1 = np.where((kind == "sphere") & turned, np.pi / 2, v1)  # the axis goes through the region's middle
    low, high = group_bounds(u, owner, count)
    u0, u1 = np.where(plane, low, u0), np.where(plane, high, u1)
    known = plane | curved
    for name, value in (("u0", u0), ("u1", u1), ("v0", v0), ("v1", v1)):
        table[name] = np.where(known, value, 0.0)

    # Whether the surface faces inside: by the triangles' own normals.
    normal = area_normals(vertices, triangles)
    middle_u, middle_v = angle.mean(axis=1), v.reshape(-1, 3).mean(axis=1)
    whole = np.ptp(angle, axis=1) < np.pi
    middle_u = np.where(whole, middle_u, angle[:, 0])
    middle_v = np.where(np.ptp(v.reshape(-1, 3), axis=1) < np.pi, middle_v, v.reshape(-1, 3)[:, 0])
    facing = np.nan_to_num(np.sum(Surfaces(table).normals(region, middle_u, middle_v) * normal, axis=1))
    table["reversed"] = curved & (np.bincount(region, facing, minlength=count) < 0)

    corners = Surfaces(table).normals(owner, angle.ravel(), v).reshape(-1, 3, 3)
    loose = ~known[region]
    corners[loose] = _mean_normals(vertices, triangles[loose], region[loose])
    for name in table:
        if name.startswith(("origin", "axis")):
            table[name] = np.where(known, table[name], np.nan)
    table |= {
        "kind": kind,
        "recognised_kind": kind,
        "area": area,
        **vector_columns("centroid", centroid),
        **box_columns(np.concatenate(group_bounds(flat_corner, owner, count), axis=1)),
        "provenance": ["fitted"] * count,
        "residual": residual,
        **{name: [None] * count for name in ("name", "colour", "layer")},
    }
    return table, corners


def _frames(regions: MeshRegions, normal: Floats, centroid: Floats) -> tuple[Floats, Floats, Floats, Floats, Floats]:
    """Axis, origin, radius, radius2 and semi-angle of the regions; NaN where a kind has none.

    The origin of a plane, cylinder or cone is abreast of the centroid; a cone opens along its axis; a sphere's axis
    goes through the middle of its region."""
    kind, row = regions.kind, regions.surface
    plane, facets = kind == "plane", kind == "facets"
    cone, sphere, torus = kind == "cone", kind == "sphere", kind == "torus"
    ruled = (kind == "cylinder") | cone
    axis = np.where(np.isnan(row[:, 3:6]), normal, row[:, 3:6])
    origin = np.where((plane | facets)[:, None], centroid, row[:, :3])
    semi = np.where(cone, row[:, 7], np.nan)
    shift = np.where(ruled, np.sum((centroid - origin) * axis, axis=1), 0.0)
    origin = origin + np.nan_to_num(shift)[:, None] * axis
    radius = row[:, 6] + np.where(cone, shift * np.tan(np.nan_to_num(semi)), 0.0)
    # A directed axis for what has none: the component that is greatest is positive.
    axis = np.where(((kind == "cylinder") | torus)[:, None], unsigned(axis, 0.5), axis)
    out = centroid - origin
    length = np.linalg.norm(out, axis=1, keepdims=True)
    out = np.where(length > 0.05 * radius[:, None], out / np.maximum(length, 1e-300), [0.0, 0.0, 1.0])
    axis = np.where(sphere[:, None], out, axis)
    axis = np.where(facets[:, None], [0.0, 0.0, 1.0], axis)
    return axis, origin, radius, np.where(torus, row[:, 7], np.nan), semi


def _aligned(kind: npt.NDArray[np.str_], axis: Floats, reach: Floats, residual: Floats, fine: float) -> Floats:
    """Axes turned into those of the frame, or of large planes, that they nearly are, where that moves no vertex of
    their regions, which are within `reach` (n,), by more than rounding may have."""
    from scipy.spatial import cKDTree

    axis = axis.copy()
    plane = kind == "plane"
    for by_planes in (False, True):
        others = axis[plane & (reach > np.median(reach))] if by_planes else np.eye(3)
        rows = np.flatnonzero(~np.isin(kind, ("facets", "sphere", *(("plane",) if by_planes else ()))))
        if not len(others) or not len(rows):
            continue
        others = np.concatenate([others, -others])
        found = cKDTree(others).query(axis[rows])
        away, which = np.asarray(found[0], float), np.asarray(found[1], np.int64)
        near = away * reach[rows] < np.maximum(2 * fine, np.where(plane[rows], residual[rows], 0.0))
        near &= away < _SEGMENTS.alike_rad
        axis[rows[near]] = others[which[near]]
    return axis


def _interval(angle: Floats, region: Ints, count: int) -> tuple[Floats, Floats, Bools]:
    """Least interval of angles that holds those of each region's triangles (m, 3), and whether it is the full turn."""
    flat, owner = angle.ravel(), np.repeat(region, 3)
    order = np.lexsort((flat, owner))
    a, o = flat[order], owner[order]
    first = np.searchsorted(o, np.arange(count))
    last = np.searchsorted(o, np.arange(count), side="right") - 1
    gap = np.empty(len(a))
    gap[:-1] = a[1:] - a[:-1]
    gap[last] = a[first] + 2 * np.pi - a[last]
    gap = np.where(np.isnan(gap), 0.0, gap)
    widest = np.lexsort((-gap, o))[first]  # the first row of each region in this order
    begin = a[np.where(widest == last, first, np.minimum(widest + 1, len(a) - 1))]
    extent = 2 * np.pi - gap[widest]
    # A triangle that bridges the widest gap makes it the full turn.
    cut = begin - gap[widest] / 2
    local = np.mod(angle - cut[region][:, None], 2 * np.pi)
    bridged = np.bincount(region, np.ptp(local, axis=1) > np.pi, minlength=count) > 0
    begin = np.where(bridged, -np.pi, begin)
    return begin, begin + np.where(bridged, 2 * np.pi, extent), bridged


def _mean_normals(vertices: Floats, triangles: Ints, region: Ints) -> Floats:
    """Mean normal (m, 3, 3) of the region's triangles at each corner."""
    if len(triangles) == 0:
        return np.empty((0, 3, 3))
    first, corner = _corners(vertices, triangles, region)
    mean = group_sums(np.repeat(area_normals(vertices, triangles), 3, axis=0), corner, len(first))[corner]
    mean /= np.maximum(np.linalg.norm(mean, axis=1, keepdims=True), 1e-300)
    return mean.reshape(-1, 3, 3)


def _corners(vertices: Floats, triangles: Ints, region: Ints) -> tuple[Ints, Ints]:
    """Vertices apart for each region: the first of the corners (3m,) that is each, and which one each corner is."""
    key = (region[:, None] * np.int64(len(vertices)) + triangles).ravel()
    _, first, inverse = np.unique(key, return_index=True, return_inverse=True)
    return first, inverse.ravel()


# Triangles to surfaces and arcs: regions become surfaces (`regions.py`, `shape.py`), the edges between them arcs.
#
# Every surface is marked as fitted: a mesh gives only points of the surfaces that it came from.

_ARCS = DEFAULTS.arcs


def shape_from_triangles(
    vertices: Floats, triangles: Ints, faces: Ints | None = None, normals: Floats | None = None, *, fit: bool = True
) -> Shape | None:
    """The shape that triangles (m, 3), counter-clockwise from outside, of vertices (n, 3) in mm bound.

    Vertices are welded where they coincide; None where no triangle has an area.  `faces` (m,), in rising order, says
    which face each triangle belongs to where that is known: the surfaces then are the faces that have an area, fitted
    with the help of the normals (m, 3, 3) at the triangles' corners where these are known too.  Where it is not known,
    triangles that contradict their neighbours are turned over.  Without `fit` the surfaces are the regions between
    creases, all of them facets."""
    vertices, triangles, kept = weld(vertices, triangles)
    if len(triangles) == 0:
        return None
    diagonal = float(np.linalg.norm(np.ptp(vertices, axis=0)))
    tolerance = max(1e-3, 2.5e-6 * diagonal)
    edges, free = find_edges(vertices, triangles)
    turned = 0
    if free and faces is None:
        triangles, turned = mend_winding(vertices, triangles)
        if turned:
            edges, free = find_edges(vertices, triangles)
    volume = None
    if not free:
        a, b, c = (vertices[triangles[:, i]] - vertices[0] for i in range(3))
        volume = float(np.sum(a * np.cross(b, c)) / 6)
        if volume < 0:  # inside out
            triangles = triangles[:, ::-1].copy()
            normals = None if normals is None else -normals[:, ::-1]
            edges, _ = find_edges(vertices, triangles)
            volume = -volume
    if not fit:
        regions = smooth_regions(triangles, edges)
    elif faces is None:
        regions = segment_mesh(vertices, triangles, edges, tolerance)
    else:
        given = None if normals is None else normals[kept]
        regions = fit_faces(vertices, triangles, faces[kept], tolerance, given)
    region = regions.of_triangle
    surfaces, normals = surface_rows(vertices, triangles, regions)

    region_a = region[edges.triangle_a]
    region_b = np.where(edges.triangle_b >= 0, region[edges.triangle_b], -1)
    # A crease that ends within a region is an arc, too.
    border = np.flatnonzero(
        (region_a != region_b)
        | (np.abs(edges.angle) >= DEFAULTS.segments.free_rad) & (regions.kind == "facets")[region_a]
    )
    chains = chain_edges(vertices, edges.ends[border], region_a[border], region_b[border])
    fitted = _fitted(vertices, chains, tolerance)
    if np.any(fitted.kind == "polyline"):
        chains = without_lines(vertices, chains, fitted.kind == "polyline", rounding(vertices))
        fitted = _fitted(vertices, chains, tolerance)
    normal_a, normal_b = _side_normals(vertices, triangles, chains, edges, border, normals)
    arcs, splines = _arcs(vertices, chains, fitted, edges, border, (normal_a, normal_b), regions)
    loops, coedges = _loops(vertices, chains, arcs, surfaces)
    found = (
        ("mended_winding", turned, f"{turned} triangles were turned over, since their neighbours run the other way"),
        ("open_mesh", free, f"the mesh is open: {free} edges have no second triangle that continues the surface"),
    )
    return Shape(
        kind="mesh",
        volume=volume,
        surfaces=surfaces,
        arcs=arcs,
        arc_splines=splines,
        loops=loops,
        coedges=coedges,
        mesh=_mesh(vertices, triangles, region, normals),
        samples=_samples(vertices, chains, fitted, normal_a, normal_b),
        findings=tuple(Finding(kind, message, float(count), 0.0) for kind, count, message in found if count),
    )


def _fitted(vertices: Floats, chains: EdgeChains, tolerance: float) -> FittedArcs:
    start = np.concatenate([chains.offsets[:-1] + np.arange(chains.count), [len(chains.vertices)]]).astype(np.int64)
    return fit_arcs(vertices[chains.vertices], start, tolerance)


def _mesh(vertices: Floats, triangles: Ints, region: Ints, normals: Floats) -> Mesh:
    first, inverse = _corners(vertices, triangles, region)
    return Mesh(
        chord_mm=0.0,
        chord_rad=0.0,
        vertices=vertices[triangles.ravel()[first]],
        normals=normals.reshape(-1, 3)[first].astype(np.float32),
        triangles=inverse.reshape(-1, 3).astype(np.int32),
        triangle_surfaces=region.astype(np.int32),
    )


def _arcs(
    vertices: Floats,
    chains: EdgeChains,
    fitted: FittedArcs,
    edges: MeshEdges,
    border: Ints,
    normals: tuple[Floats, Floats],
    regions: MeshRegions,
) -> tuple[Table, Table]:
    """Rows of the chains: lines, circles, ellipses, and polylines where none of them.  normals: of both sides."""
    n = chains.count
    if n == 0:
        return {}, {}
    points = vertices[chains.vertices]
    start, last = chains.offsets[:-1] + np.arange(n), chains.offsets[1:] + np.arange(n)
    begin, end = points[start], points[last]
    kind = fitted.kind

    halfway = (chains.offsets[:-1] + chains.offsets[1:] - 1) // 2
    middle, turned = border[chains.edges[halfway]], chains.turned[halfway]
    region = np.append(regions.of_triangle, -1)
    surface_a, surface_b = region[edges.triangle_a[middle]], region[edges.triangle_b[middle]]
    # The angle between the fitted surfaces, halfway; between facets it is that of the facets.
    place = halfway + np.arange(n)
    along = points[place + 1] - points[place]
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    na, nb = (side[halfway].mean(axis=1) for side in normals)
    angle = np.arctan2(np.sum(np.cross(na, nb) * along, axis=1), np.sum(na * nb, axis=1))
    loose = (regions.kind[surface_a] == "facets") | (regions.kind[surface_b] == "facets")
    angle = np.where((surface_b < 0) | loose, edges.angle[middle], angle)
    convexity = np.select(
        [surface_b < 0, np.abs(angle) < np.where(loose, DEFAULTS.segments.free_rad, _ARCS.convexity_rad), angle > 0],
        ["free", "smooth", "convex"],
        "concave",
    )
    arcs: Table = {
        **_curve_columns(fitted),
        "recognised_kind": kind,
        "t0": fitted.parameter[start],
        "t1": fitted.parameter[last],
        **vector_columns("start", begin),
        **vector_columns("end", end),
        "provenance": ["fitted"] * n,
        "residual": fitted.residual,
        "surface_a": np.where(turned, surface_b, surface_a),
        "surface_b": np.where(turned, surface_a, surface_b),
        "convexity": convexity,
        "angle": angle,
    }
    free = np.flatnonzero(kind == "polyline")
    drawn = [slice(a, b + 1) for a, b in zip(start[free].tolist(), last[free].tolist(), strict=True)]
    splines = spline_columns([polyline(fitted.parameter[one], points[one]) for one in drawn])
    length = fitted.parameter[last]
    low, high = np.minimum.reduceat(points, start), np.maximum.reduceat(points, start)
    known = np.flatnonzero(kind != "polyline")
    curves = Curves({name: np.asarray(column)[known] for name, column in arcs.items()}, {})
    length[known] = curves.lengths()
    box = np.concatenate([low, high], axis=1)
    box[known] = curves.boxes()
    arcs |= {"length": length, **box_columns(box)}
    return arcs, {"arc_no": free, **splines} if len(free) else {}


def _curve_columns(fitted: FittedArcs) -> Table:
    frame = {
        n: c for name in ("origin", "axis_x", "axis_z") for n, c in vector_columns(name, getattr(fitted, name)).items()
    }
    return {"kind": fitted.kind, **frame, "radius": fitted.radius, "radius2": fitted.radius2}


def _loops(vertices: Floats, chains: EdgeChains, arcs: Table, surfaces: Table) -> tuple[Table, Table]:
    """Loops and coedges of the regions; the outer loop of a region is the one that encloses most."""
    n = chains.count
    if n == 0:
        return {}, {}
    begin, end = (chains.vertices[at + np.arange(n)] for at in (chains.offsets[:-1], chains.offsets[1:]))
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
    rank = np.argsort(loop[first[order]])
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
    vertices: Floats, chains: EdgeChains, arc: Ints, surface: Ints, backward: Bools, loop: Ints, surfaces: Table
) -> Floats:
    """Twice the area that each loop encloses, seen along its surface's normal; of facets, its length."""
    n = chains.count
    points = vertices[chains.vertices]
    which = np.repeat(np.arange(n), np.diff(chains.offsets) + 1)
    inside = which[1:] == which[:-1]
    swept = np.add.reduceat(np.cross(points[:-1], points[1:])[inside], chains.offsets[:-1])[arc]
    normal = vectors(surfaces, "axis_z")[surface]
    flat = np.sum(swept * normal, axis=1) * np.where(backward, -1, 1)
    length = np.add.reduceat(np.linalg.norm(np.diff(points, axis=0), axis=1)[inside], chains.offsets[:-1])[arc]
    return np.asarray(np.abs(np.bincount(loop, np.where(np.isnan(flat), length, flat))))


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


def _side_normals(
    vertices: Floats, triangles: Ints, chains: EdgeChains, edges: MeshEdges, border: Ints, normals: Floats
) -> tuple[Floats, Floats]:
    """Normals of the surfaces to the left and to the right of each edge of the chains at its two ends (n, 2, 3)."""
    which = np.repeat(np.arange(chains.count), np.diff(chains.offsets))
    first = np.arange(len(which)) + which
    ends = np.stack([chains.vertices[first], chains.vertices[first + 1]], axis=1)
    source = border[chains.edges]
    out = []
    for turned in (chains.turned, ~chains.turned):
        triangle = np.where(turned, edges.triangle_b[source], edges.triangle_a[source])
        corner = np.argmax(triangles[triangle][:, None, :] == ends[:, :, None], axis=2)
        out.append(np.where((triangle >= 0)[:, None, None], normals[triangle[:, None], corner], np.nan))
    left, right = out
    return left, np.where(np.isnan(right), -left, right)  # of a free edge one side always looks at the camera


def _samples(
    vertices: Floats, chains: EdgeChains, fitted: FittedArcs, normal_a: Floats, normal_b: Floats
) -> ArcSamples:
    """Points along the chains, a millimetre or, on a small part, less apart, with the normals on both sides."""
    n = chains.count
    points = vertices[chains.vertices]
    which = np.repeat(np.arange(n), np.diff(chains.offsets))
    first = np.arange(len(which)) + which
    vector = points[first + 1] - points[first]
    step = np.linalg.norm(vector, axis=1)
    length = np.add.reduceat(step, chains.offsets[:-1]) if n else np.empty(0)
    diagonal = float(np.linalg.norm(np.ptp(vertices, axis=0)))
    spacing = max(min(_ARCS.sample_mm, diagonal / 100), float(length.sum()) / _ARCS.most_samples)
    count = np.maximum(np.ceil(length / spacing).astype(np.int64), 1) + 1
    offsets = np.concatenate([[0], np.cumsum(count)]).astype(np.int64)
    chain = np.repeat(np.arange(n), count)
    t = (np.arange(len(chain)) - offsets[chain]) / (count[chain] - 1) * length[chain]
    place = np.concatenate([[0.0], np.cumsum(step)])
    base = place[chains.offsets[:-1]][chain]
    edge = np.searchsorted(place, base + t, side="right") - 1
    edge = np.clip(edge, chains.offsets[:-1][chain], chains.offsets[1:][chain] - 1)
    share = ((base + t - place[edge]) / step[edge])[:, None]
    at = points[first[edge]] + share * vector[edge]
    tangent = vector[edge] / step[edge, None]
    parameter = fitted.parameter[first[edge]]
    parameter = parameter + share[:, 0] * (fitted.parameter[first[edge] + 1] - parameter)
    known = np.flatnonzero(np.isin(fitted.kind, ("circle", "ellipse"))[chain])
    if len(known):
        columns = _curve_columns(fitted) | {"t0": fitted.radius, "t1": fitted.radius}
        at[known], by = Curves(columns, {}).evaluate(chain[known], parameter[known])
        tangent[known] = by / np.linalg.norm(by, axis=1, keepdims=True)
    sides = [(1 - share) * side[edge, 0] + share * side[edge, 1] for side in (normal_a, normal_b)]
    sides = [side / np.maximum(np.linalg.norm(side, axis=1, keepdims=True), 1e-300) for side in sides]
    directions = (Ragged(way.astype(np.float32).ravel(), 3 * offsets) for way in (tangent, *sides))
    return ArcSamples(np.arange(n), Ragged(at.ravel(), 3 * offsets), *directions)
