"""Frames, rectangles and boxes that features are measured in."""

from __future__ import annotations

import numpy as np

from relmodel.arrays import Floats


def cross(a: Floats, b: Floats) -> Floats:
    """Cross product of two vectors (3,), many times faster than NumPy's."""
    a0, a1, a2 = a.tolist()
    b0, b1, b2 = b.tolist()
    return np.array([a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0])


def sideways(axis: Floats) -> tuple[Floats, Floats]:
    """Two unit vectors across a unit axis, right-handed with it."""
    u = cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    u /= np.linalg.norm(u)
    return u, cross(axis, u)


def ahead(direction: Floats) -> Floats:
    """A direction or its opposite: its first component that is clearly not 0 is positive."""
    return -direction if direction[np.argmax(np.abs(direction) > 1e-6)] < 0 else direction


def frame(x: Floats, z: Floats, origin: Floats) -> Floats:
    """shape_from_feature (4, 4) with Z along z and X as near to x as that allows."""
    x = x - (x @ z) * z
    x = x / np.linalg.norm(x)
    out = np.eye(4)
    out[:3, 0], out[:3, 1], out[:3, 2], out[:3, 3] = x, cross(z, x), z, origin
    return out


def at_level(point: Floats, up: Floats, level: float) -> Floats:
    """A point moved along a unit vector to a height along it."""
    return np.asarray(point + (level - float(point @ up)) * up)


def off_axis(points: Floats, origin: Floats, axis: Floats) -> Floats:
    """Distances (n,) of points (n, 3) from an axis."""
    arm = points - origin
    return np.asarray(np.linalg.norm(arm - np.outer(arm @ axis, axis), axis=1))


def angular_gaps(arms: Floats, axis: Floats) -> Floats:
    """Gaps (n,), rad, between the directions of arms (n, 3) about an axis, all the way around."""
    u, v = sideways(axis)
    angle = np.sort(np.arctan2(arms @ v, arms @ u))
    return np.diff(angle, append=angle[0] + 2 * np.pi)


def rectangle(points: Floats, normal: Floats) -> tuple[Floats, Floats, float, float]:
    """Least rectangle across `normal` that holds points: direction of its length, its centre, length and width.

    One side of it lies on a side of the convex hull (Freeman and Shapira, CACM 18, 1975).
    """
    from shapely import convex_hull, get_coordinates, linestrings

    u, v = sideways(normal)
    flat = np.column_stack([points @ u, points @ v])
    hull = get_coordinates(convex_hull(linestrings(flat)))  # one line is faster to make than many points
    sides = np.diff(hull, axis=0)
    sides = sides[np.linalg.norm(sides, axis=1) > 1e-9]
    direction = sides / np.linalg.norm(sides, axis=1, keepdims=True)
    across = np.column_stack([-direction[:, 1], direction[:, 0]])
    along = hull @ direction.T
    crosswise = hull @ across.T
    extent, breadth = np.ptp(along, axis=0), np.ptp(crosswise, axis=0)
    # Of rectangles as small as the least one, the first: equal input gives equal frames.
    best = int(np.argmax(extent * breadth <= (extent * breadth).min() * (1 + 1e-9)))
    d, a = direction[best], across[best]
    middle = d * (along[:, best].min() + extent[best] / 2) + a * (crosswise[:, best].min() + breadth[best] / 2)
    length, width = float(extent[best]), float(breadth[best])
    if width > length:
        d, length, width = a, width, length
    return ahead(d[0] * u + d[1] * v), middle[0] * u + middle[1] * v, length, width


def union(boxes: Floats) -> Floats:
    """The box (6,) around boxes (n, 6)."""
    return np.concatenate([boxes[:, :3].min(axis=0), boxes[:, 3:].max(axis=0)])
