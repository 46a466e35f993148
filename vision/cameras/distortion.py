"""How a lens moves what a pinhole would show: OpenCV's model of up to 14 coefficients, with its derivative, and back.

    k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4 tx ty

Radial as a ratio of polynomials in r^2 (Brown; k4 to k6 the divisor), tangential p, thin prism s, then the sensor
tilted by tx and ty (rad): the model of cv2.projectPoints, in directions x/z, y/z.
"""

from __future__ import annotations

import numpy as np

from relmodel.arrays import Floats

COUNT = 14
_MOST_STEPS, _CONVERGED = 20, 1e-12


def place(xy: Floats, coefficients: Floats) -> Floats:
    """Where directions (n, 2) are seen (n, 2)."""
    k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4, *tilt = _name(coefficients)
    x, y = xy.T
    r2 = x * x + y * y
    scale = (1 + r2 * (k1 + r2 * (k2 + r2 * k3))) / (1 + r2 * (k4 + r2 * (k5 + r2 * k6)))
    seen = np.empty_like(xy)
    seen[:, 0] = x * scale + 2 * p1 * x * y + p2 * (r2 + 2 * x * x) + r2 * (s1 + s2 * r2)
    seen[:, 1] = y * scale + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y + r2 * (s3 + s4 * r2)
    return _tilt(seen, _tilting(*tilt))[0] if any(tilt) else seen


def distort(xy: Floats, coefficients: Floats) -> tuple[Floats, Floats]:
    """The same, and the derivative (n, 2, 2) of that by the directions."""
    k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4, *tilt = _name(coefficients)
    x, y = xy.T
    r2 = x * x + y * y
    divisor = 1 + r2 * (k4 + r2 * (k5 + r2 * k6))
    scale = (1 + r2 * (k1 + r2 * (k2 + r2 * k3))) / divisor
    # By r^2.
    scaling = (k1 + r2 * (2 * k2 + r2 * 3 * k3) - scale * (k4 + r2 * (2 * k5 + r2 * 3 * k6))) / divisor
    prism_x, prism_y = 2 * (s1 + 2 * s2 * r2), 2 * (s3 + 2 * s4 * r2)
    across = 2 * (x * y * scaling + p1 * x + p2 * y)
    slope = np.empty((len(xy), 2, 2))
    slope[:, 0, 0] = scale + 2 * x * x * scaling + 2 * p1 * y + 6 * p2 * x + x * prism_x
    slope[:, 0, 1] = across + y * prism_x
    slope[:, 1, 0] = across + x * prism_y
    slope[:, 1, 1] = scale + 2 * y * y * scaling + 6 * p1 * y + 2 * p2 * x + y * prism_y
    if not any(tilt):
        return place(xy, coefficients), slope
    seen, bend = _tilt(place(xy, coefficients[: COUNT - 2]), _tilting(*tilt))
    return seen, bend @ slope


def _name(coefficients: Floats) -> list[float]:
    """All coefficients, those that are not given as zeros."""
    every: list[float] = np.append(coefficients, np.zeros(COUNT))[:COUNT].tolist()
    return every


def undistort(seen: Floats, coefficients: Floats) -> tuple[Floats, Floats]:
    """The directions (n, 2) that are seen at `seen` (n, 2), to 1e-12, and the derivative of `distort` there.

    Newton's method from `seen`; not finite, or wrong, where the distortion folds the picture over.
    """
    xy = seen.copy()
    for _ in range(_MOST_STEPS):
        value, slope = distort(xy, coefficients)
        (a, b), (c, d) = slope.transpose(1, 2, 0)
        u, v = (seen - value).T
        step = np.stack([d * u - b * v, a * v - c * u], axis=1) / (a * d - b * c)[:, None]
        xy += step
        if np.abs(step).max(initial=0.0) < _CONVERGED:
            break
    return xy, slope


def _tilting(tx: float, ty: float) -> Floats:
    """The homography (3, 3) of a sensor turned about x, then y."""
    about_x = np.array([[1, 0, 0], [0, np.cos(tx), np.sin(tx)], [0, -np.sin(tx), np.cos(tx)]])
    about_y = np.array([[np.cos(ty), 0, -np.sin(ty)], [0, 1, 0], [np.sin(ty), 0, np.cos(ty)]])
    turn = about_y @ about_x
    return np.asarray(np.array([[turn[2, 2], 0, -turn[0, 2]], [0, turn[2, 2], -turn[1, 2]], [0, 0, 1]]) @ turn)


def _tilt(seen: Floats, h: Floats) -> tuple[Floats, Floats]:
    """Where a homography carries places (n, 2), and the derivative (n, 2, 2) of that."""
    depth = seen @ h[2, :2] + h[2, 2]
    out = (seen @ h[:2, :2].T + h[:2, 2]) / depth[:, None]
    return out, (h[:2, :2] - out[:, :, None] * h[2, :2]) / depth[:, None, None]
