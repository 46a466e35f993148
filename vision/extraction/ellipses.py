"""Ellipses through points: the direct fit of Halir and Flusser ("Numerically stable direct least squares fitting of
ellipses", WSCG 1998, after Fitzgibbon), repeated with gradient weights so that it minimises Sampson's distance."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]


class Ellipse(NamedTuple):
    """Centre and semi-axes (px), angle of the major axis from x towards y (rad, in (-pi/2, pi/2]), and the weighted
    mean square Sampson distance of the points (px^2)."""

    centre_x: float
    centre_y: float
    major: float
    minor: float
    angle: float
    square: float


def fit_ellipse(x: FloatArray, y: FloatArray, weight: FloatArray) -> Ellipse | None:
    """Ellipse through at least six weighted points (n,); None where they determine none."""
    if len(x) < 6:
        return None
    ox, oy = float(x.mean()), float(y.mean())
    scale = float(np.sqrt(np.mean((x - ox) ** 2 + (y - oy) ** 2)))
    if scale == 0.0:
        return None
    u, v = (x - ox) / scale, (y - oy) / scale
    quadratic, linear = np.column_stack([u * u, u * v, v * v]), np.column_stack([u, v, np.ones_like(u)])
    gain = weight / weight.sum()
    conic = np.zeros(6)
    for _ in range(3):
        found = _direct(quadratic, linear, gain)
        if found is None:
            return None
        conic = found
        gradient = _gradient_square(conic, u, v)
        if gradient.min() <= 1e-12 * gradient.max():
            return None
        gain = weight / gradient
        gain /= gain.sum()
    value = quadratic @ conic[:3] + linear @ conic[3:]
    square = float(np.sum(weight * value**2 / gradient) / weight.sum()) * scale**2
    a, b, c, d, e, f = conic
    determinant = 4.0 * a * c - b * b
    cu, cv = (b * e - 2.0 * c * d) / determinant, (b * d - 2.0 * a * e) / determinant
    at_centre = f + 0.5 * (d * cu + e * cv)
    eigenvalues, axes = np.linalg.eigh(np.array([[a, b / 2], [b / 2, c]]) / -at_centre)
    if not eigenvalues[0] > 0.0:
        return None
    major, minor = scale / np.sqrt(eigenvalues)
    angle = float(np.arctan(axes[1, 0] / axes[0, 0])) if axes[0, 0] != 0.0 else np.pi / 2
    return Ellipse(ox + scale * cu, oy + scale * cv, float(major), float(minor), angle, square)


def _direct(quadratic: FloatArray, linear: FloatArray, gain: FloatArray) -> FloatArray | None:
    """Conic a u^2 + b uv + c v^2 + d u + e v + f with 4 ac - b^2 > 0 of least weighted algebraic distance."""
    s1 = quadratic.T @ (gain[:, None] * quadratic)
    s2 = quadratic.T @ (gain[:, None] * linear)
    s3 = linear.T @ (gain[:, None] * linear)
    try:
        reduction = -np.linalg.solve(s3, s2.T)
    except np.linalg.LinAlgError:
        return None
    m = s1 + s2 @ reduction
    _, vectors = np.linalg.eig(np.stack([m[2] / 2.0, -m[1], m[0] / 2.0]))
    vectors = np.real(vectors)
    condition = 4.0 * vectors[0] * vectors[2] - vectors[1] ** 2
    best = int(np.argmax(condition))
    if not condition[best] > 0.0:
        return None
    return np.concatenate([vectors[:, best], reduction @ vectors[:, best]])


def _gradient_square(conic: FloatArray, u: FloatArray, v: FloatArray) -> FloatArray:
    a, b, c, d, e, _ = conic
    return np.asarray((2.0 * a * u + b * v + d) ** 2 + (b * u + 2.0 * c * v + e) ** 2)
