"""Step 1: edge elements, the zero-crossings of the second derivative along the gradient, each with its own sigma.

Haralick 1984 takes the crossing from the cubic facet, -C/3D, which falls short of or beyond the edge by a factor that
depends on blur and offset.  Here the first three derivatives along the gradient (f', f'', f''' of the Gaussian-weighted
facet) fix the Gaussian-blurred step that has them:

    offset d = f' f'' / (f''^2 - f' f''')     spread S^2 = f'^2 / (f''^2 - f' f''')

exact for such a step at any offset and any blur; to first order in d it is Haralick's crossing.
"""

from dataclasses import dataclass
from functools import cache
from math import ceil, log, pi, sqrt

import numpy as np
import numpy.typing as npt

from relmodel.arrays import Bools, Floats, Floats32, Ints32
from relmodel.columns import Rows
from relmodel.errors import InputError
from vision.extraction.extraction_parameters import EdgeParameters
from vision.extraction.facets import gaussian_kernels, in_bands
from vision.extraction.noise import estimate_noise

_DEFAULTS = EdgeParameters()


@dataclass(frozen=True)
class EdgeElements(Rows):
    """Columns of one length n; image points in pixels (centre of the top-left pixel is 0, 0), grey on 0..255.

    The unit normal (nx, ny) points to the bright side.  `contrast` is the height of the step; `width` the standard
    deviation (px) of the blur that the image itself gave it; `sigma` the standard deviation (px) of the position along
    the normal.  `pixel` is row * columns + column of the pixel that saw it, ascending.
    """

    x: Floats
    y: Floats
    nx: Floats
    ny: Floats
    contrast: Floats
    width: Floats
    sigma: Floats
    pixel: Ints32


def to_grey(image: npt.ArrayLike) -> Floats:
    """The image as contiguous float64 on 0..255, from 8-bit, 16-bit or 1-bit (bool) grey, or other numbers taken as on
    0..255.

    Raises InputError for colour, an empty image, what are no real numbers, and values that are not finite or far beyond
    that range.
    """
    array = np.asarray(image)
    if array.ndim != 2 or array.size == 0:
        raise InputError(f"an image of shape {array.shape} is not a grey image: give rows x columns")
    if array.dtype.kind not in "buif":
        raise InputError(f"an image of {array.dtype.name} is not a grey image: give numbers")
    scale = {"b1": 255.0, "u2": 1.0 / 257.0}.get(array.dtype.str[1:], 1.0)
    grey = np.require(array * scale if scale != 1.0 else array, np.float64, ("C", "W"))
    least, greatest = float(grey.min()), float(grey.max())
    if not (np.isfinite(least) and np.isfinite(greatest)):
        raise InputError("the image contains values that are not finite: replace them before extraction")
    if max(-least, greatest) > _BEYOND:
        raise InputError(f"the image has values from {least:g} to {greatest:g}: give grey on 0..255, or 8 or 16 bits")
    return grey


def detect_edges(
    image: npt.ArrayLike,
    sigma: float = 1.4,
    p: EdgeParameters = _DEFAULTS,
    *,
    noise: Floats | None = None,
) -> EdgeElements:
    """Edge elements of a grey image (rows, columns) at facet scale `sigma` px, thinned to one per edge and pixel.

    `p` says what is kept (its scale is not used).  `noise` (256,) is the curve of `estimate_noise`, estimated
    when not given.  No element lies within two and a half sigma of the border, where the mirrored picture would
    displace it."""
    from vision.extraction import edge_kernels

    grey = to_grey(image)
    rows, columns = grey.shape
    kernels = gaussian_kernels(sigma)
    kappa, operator_variance = _calibration(sigma, p.calibration_blur)
    curve = estimate_noise(grey) if noise is None else np.asarray(noise, dtype=np.float64)
    covariance = kernels.moment_covariance
    variances = np.array(
        [
            covariance[3, 3],
            covariance[4, 4] + 2 * covariance[3, 5],
            covariance[6, 6],
            covariance[7, 7] + 2 * covariance[6, 8],
        ],
        dtype=np.float32,
    )
    no_shade = (p.min_contrast / (sqrt(2.0 * pi) * p.max_spread * sigma)) ** 2
    # F on (2, infinity), as the noise comes from the whole picture
    no_chance = 2.0 * covariance[1, 1] * -log(p.significance)

    def of_band(first: int, moments: Floats32, noise: Floats32) -> tuple[Floats32, Ints32]:
        found, seen = np.empty((6, moments.shape[1]), np.float32), np.empty(moments.shape[1], np.bool_)
        edge_kernels.steps(
            moments, noise, variances, kappa, operator_variance, no_shade, no_chance,
            p.max_offset, p.min_contrast, p.max_sigma, found, seen,
        )  # fmt: skip
        within = seen.reshape(-1, columns)
        within[:, :border], within[:, columns - border :] = False, False
        within[: max(border - first // columns, 0)] = False
        within[max(rows - border - first // columns, 0) :] = False
        pixel = np.flatnonzero(seen)
        return found.take(pixel, axis=1), (first + pixel).astype(np.int32)

    border = ceil(p.border * sigma)
    values, pixels = (
        np.concatenate(column, axis=-1) for column in zip(*in_bands(grey, kernels, curve, of_band), strict=True)
    )
    kept = _thin(values, pixels, columns, p.min_thin_cosine)
    pixels = pixels[kept]
    offset, nx, ny, contrast, width, position_sigma = values.compress(kept, axis=1).astype(np.float64)
    return EdgeElements(
        x=pixels % columns + offset * nx,
        y=pixels // columns + offset * ny,
        nx=nx,
        ny=ny,
        contrast=contrast,
        width=width,
        sigma=position_sigma,
        pixel=pixels,
    )


def _thin(values: Floats32, pixels: Ints32, columns: int, min_cosine: float) -> Bools:
    """Of neighbours that see the same crossing, keep the one it lies nearest to.

    `values`: offset along the gradient, nx, ny, and more, of `pixels`, ascending.  Neighbours are taken along the axis
    nearer to the gradient: an edge then has one element per row or per column.
    """
    offset, nx, ny = np.abs(values[0]), values[1], values[2]
    upright = np.abs(nx) < np.abs(ny)
    keep = np.ones(len(pixels), np.bool_)
    for step, down in ((1, False), (columns, True)):
        other = np.searchsorted(pixels, pixels + step)
        one = np.flatnonzero(np.append(pixels, -1)[other] == pixels + step)
        other = other[one]
        alike = nx[one] * nx[other] + ny[one] * ny[other] >= np.float64(min_cosine)
        one, other = one[alike], other[alike]
        further = offset[one] > offset[other]
        loser = np.where(further, one, other)
        keep[loser[upright[loser] == down]] = False  # each is measured against the other along its own axis only
    return keep


_BEYOND = 1000.0  # grey: noise reaches beyond 0..255, another scale farther than this


@cache
def _calibration(sigma: float, calibration_blur: float) -> tuple[float, float]:
    """What truncating the Gaussian does: the factor kappa of the offset and the variance that the operator adds to the
    spread, from the closed form of a step of that blur (px) seen at up to half a pixel."""
    from scipy.special import ndtr

    kernels = gaussian_kernels(sigma)
    blur, offsets = calibration_blur, np.linspace(0.05, 0.5, 10)
    t = np.arange(-kernels.radius, kernels.radius + 1)
    first, second, third = (kernels.one_d[1:] @ ndtr((t - offsets[:, None]) / blur).T) * [[1.0], [2.0], [6.0]]
    q = second**2 - first * third
    raw = first * second / q
    return float(np.sum(offsets * raw) / np.sum(raw**2)), float(np.mean(first**2 / q)) - blur**2
