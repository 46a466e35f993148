"""Ellipses through points: the direct fit of Halir and Flusser ("Numerically stable direct least squares fitting of
ellipses", WSCG 1998, after Fitzgibbon), repeated with gradient weights so that it minimises Sampson's distance."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from relmodel.arrays import Bools, Floats
from vision.extraction.extraction_parameters import FittingParameters

_DEFAULTS = FittingParameters()

# Which of the fifteen products of two terms of a conic is that of terms i and j.
_PRODUCT = np.array(
    [
        [0, 1, 2, 5, 6, 9],
        [1, 2, 3, 6, 7, 10],
        [2, 3, 4, 7, 8, 11],
        [5, 6, 7, 9, 10, 12],
        [6, 7, 8, 10, 11, 13],
        [9, 10, 11, 12, 13, 14],
    ]
)

_QUADRATIC, _LINEAR = slice(0, 3), slice(3, 6)


@dataclass(frozen=True)
class Ellipses:
    """Columns of one length n: centre and semi-axes (px), angle of the major axis from x towards y (rad, in (-pi/2,
    pi/2]), and the weighted mean square Sampson distance of the points (px^2); all NaN where the points determine none.
    """

    centre_x: Floats
    centre_y: Floats
    major: Floats
    minor: Floats
    angle: Floats
    square: Floats


def fit_ellipses(
    x: Floats, y: Floats, weight: Floats, counts: npt.NDArray[np.integer], p: FittingParameters = _DEFAULTS
) -> Ellipses:
    """Ellipses through sets of at least six weighted points each, set i the next `counts[i]` points."""
    if len(counts) == 0:
        return Ellipses(*np.zeros((6, 0)))
    first = np.concatenate([[0], np.cumsum(counts)[:-1]]).astype(np.intp)

    def total(values: Floats) -> Floats:
        return np.asarray(np.add.reduceat(values, first, axis=-1))

    def spread(values: Floats) -> Floats:
        return np.asarray(np.repeat(values, counts, axis=-1))

    middle_x, middle_y = total(x) / counts, total(y) / counts
    u, v = x - spread(middle_x), y - spread(middle_y)
    scale = np.sqrt(total(u * u + v * v) / counts)
    good = (counts >= 6) & (scale > 0.0)
    scale = np.where(good, scale, 1.0)
    u, v = u / spread(scale), v / spread(scale)
    uu, uv, vv, one = u * u, u * v, v * v, np.ones_like(u)
    # the products of any two of uu, uv, vv, u, v, 1
    products = np.stack(
        [uu * uu, uu * uv, uu * vv, uv * vv, vv * vv, uu * u, uu * v, vv * u, vv * v, uu, uv, vv, u, v, one]
    )
    weight_sum = total(weight)
    gain, gradient = weight / spread(weight_sum), one
    conic = np.zeros((len(counts), 6))
    for _ in range(p.ellipse_rounds):
        conic, found = _direct(total(gain * products)[_PRODUCT].transpose(2, 0, 1))
        a, b, c, d, e, f = spread(conic.T)
        gradient = (2.0 * a * u + b * v + d) ** 2 + (b * u + 2.0 * c * v + e) ** 2
        least, greatest = np.minimum.reduceat(gradient, first), np.maximum.reduceat(gradient, first)
        good &= found & (least > 1e-12 * greatest)
        gradient = np.where(np.repeat(good, counts), gradient, 1.0)
        gain = weight / gradient
        gain /= spread(total(gain))
    value = a * uu + b * uv + c * vv + d * u + e * v + f
    square = total(weight * value**2 / gradient) / weight_sum * scale**2
    conic[~good] = (1.0, 0.0, 1.0, 0.0, 0.0, -1.0)
    a, b, c, d, e, f = conic.T
    determinant = 4.0 * a * c - b * b
    cu, cv = (b * e - 2.0 * c * d) / determinant, (b * d - 2.0 * a * e) / determinant
    at_centre = f + 0.5 * (d * cu + e * cv)
    quadratic = np.stack([np.stack([a, b / 2], axis=1), np.stack([b / 2, c], axis=1)], axis=1)
    eigenvalues, axes = np.linalg.eigh(quadratic / -at_centre[:, None, None])
    good &= eigenvalues[:, 0] > 0.0
    axes_length = scale[:, None] / np.sqrt(np.where(good[:, None], eigenvalues, 1.0))
    along = axes[:, :, 0] * np.where(axes[:, 0, 0] < 0.0, -1.0, 1.0)[:, None]
    angle = np.where(along[:, 0] > 0.0, np.arctan2(along[:, 1], along[:, 0]), np.pi / 2)
    columns = np.stack(
        [middle_x + scale * cu, middle_y + scale * cv, axes_length[:, 0], axes_length[:, 1], angle, square]
    )
    return Ellipses(*np.where(good, columns, np.nan))


def _direct(scatter: Floats) -> tuple[Floats, Bools]:
    """(n, 6) conics a u^2 + b uv + c v^2 + d u + e v + f with 4 ac - b^2 > 0 of least weighted algebraic distance, from
    the scatter (n, 6, 6) of their terms, and which could be found."""
    s1, s2, s3 = scatter[:, _QUADRATIC, _QUADRATIC], scatter[:, _QUADRATIC, _LINEAR], scatter[:, _LINEAR, _LINEAR]
    found = np.abs(np.linalg.det(s3)) > 1e-14
    reduction = -np.linalg.solve(np.where(found[:, None, None], s3, np.eye(3)), np.swapaxes(s2, 1, 2))
    m = s1 + s2 @ reduction
    _, vectors = np.linalg.eig(np.stack([m[:, 2] / 2.0, -m[:, 1], m[:, 0] / 2.0], axis=1))
    vectors = np.real(vectors)
    condition = 4.0 * vectors[:, 0] * vectors[:, 2] - vectors[:, 1] ** 2
    best = condition.argmax(axis=1)
    each = np.arange(len(best))
    top = vectors[each, :, best]
    found &= condition[each, best] > 0.0
    return np.concatenate([top, np.einsum("nij,nj->ni", reduction, top)], axis=1), found
