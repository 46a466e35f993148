"""Free curves: uniform cubic splines of least squares through edge elements, with their covariance.

A spline with a knot every few pixels follows what an edge detector can see of a bend.  Its covariance is that of the
elements carried through the fit: their own standard deviations, correlated along the curve as their windows overlap,
exp(-d^2 / 4 scale^2) at d px; more where the elements scatter more about the spline than that explains.
"""

import numpy as np
import numpy.typing as npt

from relmodel.arrays import Floats
from vision.extraction.covariances import STATIONS
from vision.extraction.extraction_parameters import FittingParameters
from vision.extraction.refined_polylines import Deviations


def fit_free_curves(
    place: Floats,
    sigma: Floats,
    weight: Floats,
    counts: npt.NDArray[np.integer],
    half_spread: Floats,
    scale: float,
    p: FittingParameters,
) -> tuple[Deviations, Floats]:
    """How members at places (m, 2), px, lie to the n curves through them, and the covariances (n, `STATIONS`,
    `STATIONS`) of these.

    Set i of at least five members is the next `counts[i]`, seen at facet scale `scale` px.  A covariance is that of the
    curve's offset, to the right of who walks along it, at places evenly spaced from its first to its last point: as
    many as its spline has parameters and eight at most, NaN beyond them.
    `sigma` (px) is the standard deviation of each member across the curve, `weight` (1/px^2) what it counts for in the
    fit, `half_spread` (n,) (px^2) half the variance of what blurred the curve.
    """
    columns, (x, y) = np.empty((5, len(place))), np.ascontiguousarray(place.T)
    covariance = np.full((len(counts), STATIONS, STATIONS), np.nan)
    ends = np.cumsum(counts)
    for i, (first, last) in enumerate(zip(ends - counts, ends, strict=True)):  # rare, and of a size each
        own = slice(int(first), int(last))
        columns[:, own], found = _fit(x[own], y[own], sigma[own], weight[own], float(half_spread[i]), scale, p)
        covariance[i, : len(found), : len(found)] = found
    return Deviations(*columns), covariance


def _fit(
    x: Floats,
    y: Floats,
    sigma: Floats,
    weight: Floats,
    half_spread: float,
    scale: float,
    p: FittingParameters,
) -> tuple[Floats, Floats]:
    """Deviations (5, m) of the members of one curve, and its covariance at its stations."""
    place = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(x), np.diff(y)))])
    length, count = float(place[-1]), len(x)
    intervals = int(np.clip(round(length / p.knot_spacing), 1, max(count // 2 - 3, 1)))
    value, slope, bend = _basis(place, length, intervals)
    # where a curve has no elements it is kept from bending
    stiff = 1e-6 * weight.mean() * np.diff(np.eye(intervals + 3), 2, axis=0)
    gain = np.linalg.solve(value.T @ (weight[:, None] * value) + stiff.T @ stiff, value.T * weight)
    control = gain @ np.column_stack([x, y])
    velocity, acceleration = slope @ control, bend @ control
    speed = np.maximum(np.hypot(*velocity.T), 1e-12)
    tx, ty = (velocity / speed[:, None]).T
    nx, ny = -ty, tx
    across = (x - value @ control[:, 0]) * nx + (y - value @ control[:, 1]) * ny
    curvature = (acceleration[:, 0] * nx + acceleration[:, 1] * ny) / speed**2

    # Noise N correlates but neighbours: kept by its diagonals.  What it leaves of the residuals, weighted, is
    # S = A - U M' - M U', with A that of the members themselves; of S the trace and the sum of squares are wanted.
    root = np.sqrt(weight)
    carried = _banded(place, sigma, scale, gain.T)
    of_control = gain @ carried
    u, m = root[:, None] * value, root[:, None] * (carried - 0.5 * value @ of_control)
    own = _diagonals(place, root * sigma, scale)
    expected = float(own[0].sum() - 2.0 * np.sum(u * m))
    square = own[0] @ own[0] + 2.0 * sum(float(lag @ lag) for lag in own[1:])
    square += -4.0 * np.sum(_banded(place, root * sigma, scale, u) * m)
    square += 2.0 * (np.sum((u.T @ u) * (m.T @ m)) + np.sum((m.T @ u) * (m.T @ u).T))
    freedom = expected**2 / square
    excess = (p.prior_freedom + freedom * np.sum(weight * across**2) / expected) / (p.prior_freedom + freedom)
    at = np.linspace(0.0, length, min(STATIONS, intervals + 3))
    station = _basis(at, length, intervals)[0]
    curve_sigma = np.sqrt(excess * np.sum(value @ of_control * value, axis=1))
    return np.stack([across, nx, ny, -half_spread * curvature, curve_sigma]), excess * station @ of_control @ station.T


def _diagonals(place: Floats, sigma: Floats, scale: float) -> list[Floats]:
    """The main diagonal of the covariance of members at `place` and those above it, as far as they are not zero."""
    out = [sigma * sigma]
    for lag in range(1, len(place)):
        near = np.exp(-(((place[lag:] - place[:-lag]) / (2.0 * scale)) ** 2))
        if near.max() < 1e-9:
            break
        out.append(sigma[lag:] * sigma[:-lag] * near)
    return out


def _banded(place: Floats, sigma: Floats, scale: float, columns: Floats) -> Floats:
    """That covariance times `columns` (m, k)."""
    main, *others = _diagonals(place, sigma, scale)
    out = main[:, None] * columns
    for lag, diagonal in enumerate(others, 1):
        out[:-lag] += diagonal[:, None] * columns[lag:]
        out[lag:] += diagonal[:, None] * columns[:-lag]
    return np.asarray(out)


def _basis(place: Floats, length: float, intervals: int) -> tuple[Floats, Floats, Floats]:
    """Values, first and second derivatives (m, intervals + 3) of the uniform cubic B-splines on 0..length."""
    knot = length / intervals
    which = np.minimum(place / knot, intervals - 1).astype(np.intp)
    t = place / knot - which
    pieces = (
        np.stack([(1 - t) ** 3, 3 * t**3 - 6 * t**2 + 4, 1 + 3 * t + 3 * t**2 - 3 * t**3, t**3]) / 6.0,
        np.stack([-((1 - t) ** 2), 3 * t**2 - 4 * t, 1 + 2 * t - 3 * t**2, t**2]) / (2.0 * knot),
        np.stack([1 - t, 3 * t - 2, 1 - 3 * t, t]) / knot**2,
    )
    out = []
    for piece in pieces:
        full = np.zeros((len(place), intervals + 3))
        full[np.arange(len(place))[:, None], which[:, None] + np.arange(4)] = piece.T
        out.append(full)
    return out[0], out[1], out[2]
