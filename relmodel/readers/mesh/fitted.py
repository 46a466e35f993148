"""Rows of the surfaces that regions of a mesh were found to be: frame, trimmed domain, residual, normals."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from relmodel.arrays import Bools, Floats, Ints
from relmodel.geometry.clusters import group_bounds
from relmodel.geometry.curves import box_columns, vector_columns
from relmodel.geometry.surfaces import Surfaces
from relmodel.model.model import Table
from relmodel.readers.mesh.mesh_parameters import DEFAULTS
from relmodel.readers.mesh.segment import Regions
from relmodel.readers.mesh.triangles import area_normals, mean_planes, rounding

_P = DEFAULTS.segments


def surface_rows(vertices: Floats, triangles: Ints, regions: Regions) -> tuple[Table, Floats]:
    """Rows of the regions, and the outward normal (m, 3, 3) of the surface at each triangle's corners."""
    region, kind = regions.of_triangle, regions.kind
    count = len(kind)
    corner = vertices[triangles]
    plane_residual, plane_normal, centroid, area = mean_planes(vertices, triangles, region)
    plane, curved = kind == "plane", ~np.isin(kind, ("plane", "facets"))
    fine = rounding(vertices)

    axis, origin, radius, radius2, semi = _frames(regions, plane_normal, centroid)
    reach = np.zeros(count)
    np.maximum.at(reach, region, np.linalg.norm(corner - centroid[region][:, None], axis=2).max(axis=1))
    axis = _aligned(kind, axis, reach, plane_residual, fine)
    helper = np.eye(3)[np.argmin(np.abs(axis), axis=1)]
    axis_x = np.cross(helper, axis)
    axis_x /= np.linalg.norm(axis_x, axis=1, keepdims=True)
    table: Table = {
        "kind": np.where(kind == "facets", "plane", kind),  # a mean plane, until all is evaluated
        **vector_columns("origin", origin),
        **vector_columns("axis_x", axis_x),
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
    residual = np.zeros(count)
    np.maximum.at(residual, owner, away)

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


def _frames(regions: Regions, normal: Floats, centroid: Floats) -> tuple[Floats, Floats, Floats, Floats, Floats]:
    """Axis, origin, radius, radius2 and semi-angle of the regions; NaN where a kind has none.

    The origin of a plane, cylinder or cone is abreast of the centroid; a cone opens along its axis; a sphere's axis
    goes through the middle of its region.
    """
    kind, row = regions.kind, regions.surface
    plane, facets = kind == "plane", kind == "facets"
    cone, sphere, torus = kind == "cone", kind == "sphere", kind == "torus"
    ruled = (kind == "cylinder") | cone
    axis = np.where(np.isnan(row[:, 3:6]), normal, row[:, 3:6])
    origin = np.where((plane | facets)[:, None], centroid, row[:, :3])
    semi = np.where(cone, row[:, 7], np.nan)
    flip = cone & (semi < 0)
    axis = np.where(flip[:, None], -axis, axis)
    semi = np.abs(semi)
    shift = np.where(ruled, np.sum((centroid - origin) * axis, axis=1), 0.0)
    origin = origin + np.nan_to_num(shift)[:, None] * axis
    radius = row[:, 6] + np.where(cone, shift * np.tan(np.nan_to_num(semi)), 0.0)
    # A directed axis for what has none: the component that is greatest is positive.
    greatest = np.take_along_axis(axis, np.argmax(np.abs(axis) > 0.5, axis=1)[:, None], axis=1)[:, 0]
    axis = np.where(((kind == "cylinder") | torus)[:, None] & (greatest < 0)[:, None], -axis, axis)
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
    main = np.concatenate([np.eye(3), -np.eye(3)])
    plane = kind == "plane"
    for at, others in (
        (~np.isin(kind, ("facets", "sphere")), main),
        (np.isin(kind, ("cylinder", "cone", "torus")), None),
    ):
        if others is None:
            big = axis[plane & (reach > np.median(reach))] if plane.any() else axis[:0]
            if len(big) == 0:
                break
            others = np.concatenate([big, -big])
        rows = np.flatnonzero(at)
        if len(rows) == 0:
            continue
        found = cKDTree(others).query(axis[rows])
        away, which = np.asarray(found[0], float), np.asarray(found[1], np.int64)
        near = away * reach[rows] < np.maximum(2 * fine, np.where(plane[rows], residual[rows], 0.0))
        near &= away < _P.alike_rad
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
    key = (region[:, None] * np.int64(len(vertices)) + triangles).ravel()
    _, inverse = np.unique(key, return_inverse=True)
    spread = np.repeat(area_normals(vertices, triangles), 3, axis=0)
    total: Floats = np.stack([np.bincount(inverse.ravel(), spread[:, i]) for i in range(3)], axis=1).astype(float)
    mean = total[inverse.ravel()]
    mean /= np.maximum(np.linalg.norm(mean, axis=1, keepdims=True), 1e-300)
    return np.asarray(mean.reshape(-1, 3, 3), float)
