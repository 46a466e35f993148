"""Covariances of the parameters of fitted arcs, by the scatter of their elements.

Least squares on the distances across the curve: covariance = correlation x mean square error x (J' W J)^-1, J the
derivative of a distance by the parameters; elements a pixel apart see much the same pixels, `correlation` of them count
as one.
"""

import numpy as np

from relmodel.arrays import Floats, Indices
from vision.extraction.ellipses import Ellipses
from vision.extraction.extraction_parameters import FittingParameters
from vision.extraction.refined_polylines import Deviations

STATIONS = 8  # places, at most, at which the covariance of a free curve is kept
PARAMETERS = {
    "line": ("offset to the right", "angle"),
    "circular": ("centre_x", "centre_y", "radius"),
    "elliptic": ("centre_x", "centre_y", "radius", "radius2", "axis_angle"),
    "free": ("offset to the right at a station",) * STATIONS,
}


def of_lines(along: Floats) -> Floats:
    """Jacobian (m, 2) of distances by the offset and angle of a line; `along` (m,) the place from its centroid."""
    return np.column_stack([-np.ones_like(along), -along])


def of_circles(deviations: Deviations) -> Floats:
    """Jacobian (m, 3) of distances by the centre and radius of a circle."""
    return -np.column_stack([deviations.nx, deviations.ny, np.ones_like(deviations.nx)])


def of_ellipses(x: Floats, y: Floats, deviations: Deviations, ellipses: Ellipses, which: Indices) -> Floats:
    """Jacobian (m, 5) of distances of points (m,) by centre, semi-axes and angle of the ellipses `which` (m,) names."""
    angle = ellipses.angle[which]
    cosine, sine = np.cos(angle), np.sin(angle)
    dx = x - deviations.distance * deviations.nx - ellipses.centre_x[which]
    dy = y - deviations.distance * deviations.ny - ellipses.centre_y[which]
    u, v = cosine * dx + sine * dy, cosine * dy - sine * dx
    nu = cosine * deviations.nx + sine * deviations.ny
    nv = cosine * deviations.ny - sine * deviations.nx
    columns = [
        deviations.nx,
        deviations.ny,
        nu * u / ellipses.major[which],
        nv * v / ellipses.minor[which],
        u * nv - v * nu,
    ]
    return -np.column_stack(columns)


def of_parameters(
    jacobian: Floats,
    distance: Floats,
    weight: Floats,
    sigma: Floats,
    first: Indices,
    correlation: float,
    p: FittingParameters,
) -> Floats:
    """(n, k, k) from rows (m, k) grouped by `first` (n,), where each arc begins; NaN where they determine nothing.

    The mean square error is that of the distances, but no less than what they and the standard deviations `sigma` (m,)
    of the elements say together: a short arc may lie on few independent elements better than it is known.
    """
    if len(first) == 0:
        return np.zeros((0, jacobian.shape[1], jacobian.shape[1]))
    total = np.add.reduceat(weight, first)
    counts = np.diff(np.append(first, len(weight)))
    size = jacobian.shape[1]
    seen = np.add.reduceat(weight * distance**2, first) / total
    expected_scatter = np.add.reduceat(weight * sigma**2, first) / total
    independent = counts / correlation
    together = (p.prior_freedom * expected_scatter + independent * seen) / (p.prior_freedom + independent - size)
    error = np.maximum(seen * counts / np.maximum(counts - size, 1), together)
    normal = np.add.reduceat(weight[:, None, None] * jacobian[:, :, None] * jacobian[:, None, :], first)
    scale = np.sqrt(np.einsum("nii->ni", normal))
    scaled = normal / (scale[:, :, None] * scale[:, None, :])
    solvable = np.linalg.cond(np.where(np.isfinite(scaled), scaled, 0.0)) < 1e12
    inverse = np.linalg.inv(np.where(solvable[:, None, None], scaled, np.eye(jacobian.shape[1])))
    out = inverse / (scale[:, :, None] * scale[:, None, :]) * (correlation * error * total / counts)[:, None, None]
    return np.where(solvable[:, None, None], out, np.nan)
