"""Step 1: edge elements, zero-crossings of the second derivative along the gradient, by noise and facets."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache
from math import ceil, log, pi, sqrt
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from relmodel.arrays import Bools, Floats, Floats32, Ints, Ints32, Rows
from relmodel.errors import InputError, UsageError
from vision.extraction.extraction_parameters import EdgeParameters, NoiseParameters

# The high pass of Immerkaer (Computer Vision and Image Understanding 64, 1996) kills constants and planes; the median
# of its magnitude within each band of grey is insensitive to edges and to most texture.

_BINS = 1024  # of the magnitude, one a unit
_MEDIAN_TO_SIGMA = 1.4826 / 6.0  # the mask's norm is 6
_NOISE = NoiseParameters()


def estimate_noise(grey: Floats, p: NoiseParameters = _NOISE) -> Floats:
    """Standard deviation of the noise at each grey level 0..255, (256,), of an image scaled to 0..255.

    Nowhere less than `p.floor`."""
    from vision.extraction import edge_kernels

    histogram = np.zeros((p.bands + 1, _BINS), np.int64)
    edge_kernels.high_pass_histogram(grey, np.empty((2, grey.shape[1]), np.float32), histogram)
    histogram = histogram[:-1]
    counts = histogram.sum(axis=1)
    pooled = histogram.sum(axis=0)
    if pooled.sum() == 0:
        return np.full(256, p.floor)
    centres = (np.arange(p.bands) + 0.5) * 256.0 / p.bands
    good = counts >= p.min_samples
    if not good.any():
        return np.full(256, max(p.floor, _median(pooled) * _MEDIAN_TO_SIGMA))
    sigma = np.array([_median(row) for row in histogram[good]]) * _MEDIAN_TO_SIGMA
    return np.maximum(np.interp(np.arange(256), centres[good], sigma), p.floor)


def _median(histogram: Ints) -> float:
    """Median of rounded magnitudes, linear within the unit bin around the whole number that holds it."""
    cumulative = np.cumsum(histogram)
    half = cumulative[-1] / 2.0
    at = int(np.searchsorted(cumulative, half))
    before = cumulative[at] - histogram[at]
    return float(max(at - 0.5 + (half - before) / max(histogram[at], 1), 0.0))


# Cubic facets: the polynomial that fits best, by (weighted) least squares, the grey values around each pixel.
#
# Haralick, "Digital step edges from zero crossings of second directional derivatives", PAMI 6 (1984), and Haralick,
# Watson, Laffey, "The topographic primal sketch", IJRR 2 (1983). In a window r, c in -k..k (r down, c right)
#
#     f = k1 + k2 r + k3 c + k4 r^2 + k5 rc + k6 c^2 + k7 r^3 + k8 r^2 c + k9 r c^2 + k10 c^3
#
# With weights w(r) w(c) the discrete orthogonal polynomials P0..P3 make every coefficient a sum of separable
# correlations a_ij of the image with p_i = w P_i / N_i down the rows and p_j along the columns, i + j <= 3. With
# Gaussian weights p_i is (up to truncation) the i-th derivative of the Gaussian over i!.

Result = TypeVar("Result")
_BAND = 1 << 15  # pixels whose moments are computed at once: they stay in the processor's cache
_THREADS = 2
MOMENTS = tuple((i, j) for i in range(4) for j in range(4 - i))  # the pairs (i, j) of the a_ij, in order
_, _, _A02, _, _A10, _A11, _A12, _A20, _A21, _A30 = range(len(MOMENTS))


@dataclass(frozen=True)
class FacetKernels:
    """One-dimensional kernels of a facet model: `one_d` (4, n) holds p0..p3 for t = -k..k."""

    one_d: Floats

    @property
    def radius(self) -> int:
        """k: the window is (2k+1) x (2k+1)."""
        return int(self.one_d.shape[1] // 2)

    @property
    def moments(self) -> Floats:
        """(10, n, n): the two-dimensional kernels of the a_ij in the order of `MOMENTS`."""
        return np.stack([np.outer(self.one_d[i], self.one_d[j]) for i, j in MOMENTS])

    @property
    def moment_covariance(self) -> Floats:
        """(10, 10): covariance of the a_ij under white noise of variance 1."""
        rows = self.moments.reshape(len(MOMENTS), -1)
        return np.asarray(rows @ rows.T)


def gaussian_kernels(sigma: float) -> FacetKernels:
    """Kernels of the window weighted by a Gaussian of standard deviation `sigma` px (0.8 to 6)."""
    if not 0.8 <= sigma <= 6.0:
        raise UsageError(f"a facet scale of {sigma} px is outside 0.8 to 6: the sampled Gaussian would not carry it")
    radius = ceil(4 * sigma)
    t = np.arange(-radius, radius + 1, dtype=np.float64)
    weights = np.exp(-0.5 * (t / sigma) ** 2)
    weights /= weights.sum()
    alpha = float(np.sum(weights * t**2))
    beta = float(np.sum(weights * t**4)) / alpha
    polynomials = np.stack([np.ones_like(t), t, t**2 - alpha, t**3 - beta * t])
    return FacetKernels(weights * polynomials / np.sum(weights * polynomials**2, axis=1, keepdims=True))


def in_bands(
    grey: Floats, kernels: FacetKernels, noise: Floats, work: Callable[[int, Floats32, Floats32], Result]
) -> list[Result]:
    """What `work(first pixel, moments, noise)` makes of successive bands of rows of `grey`, in their order.

    `moments` (10, pixels), in the order of `MOMENTS`, belong to the pixels from the first on, the noise (pixels,) to
    their grey on the curve `noise` (256,); the picture is mirrored at its border.  Single precision rounds 1e-7 of the
    grey range, far below any noise.  The bands are shared out between two threads."""
    import cv2

    from vision.extraction import edge_kernels

    rows, columns = grey.shape
    taps, curve = edge_kernels.half_kernels(kernels.one_d), noise.astype(np.float32)
    reach, height = taps.shape[1] - 1, max(_BAND // columns, 1)
    bordered = cv2.copyMakeBorder(grey.astype(np.float32), reach, reach, reach, reach, cv2.BORDER_REFLECT)
    picture = np.asarray(bordered, np.float32)

    def of_band(first: int) -> Result:
        down = np.empty((4, picture.shape[1]), np.float32)
        out = np.empty((len(MOMENTS), min(height, rows - first), columns), np.float32)
        edge_kernels.moments(picture.reshape(-1), picture.shape[1], first, taps, down, out)
        moments = out.reshape(len(MOMENTS), -1)
        return work(first * columns, moments, curve.take(moments[0].astype(np.intp), mode="clip"))

    with ThreadPoolExecutor(_THREADS) as pool:
        return list(pool.map(of_band, range(0, rows, height)))


# Step 1: edge elements, the zero-crossings of the second derivative along the gradient, each with its own sigma.
#
# Haralick 1984 takes the crossing from the cubic facet, -C/3D, which falls short of or beyond the edge by a factor that
# depends on blur and offset. Here the first three derivatives along the gradient (f', f'', f''' of the
# Gaussian-weighted facet) fix the Gaussian-blurred step that has them:
#
#     offset d = f' f'' / (f''^2 - f' f''')     spread S^2 = f'^2 / (f''^2 - f' f''')
#
# exact for such a step at any offset and any blur; to first order in d it is Haralick's crossing.

_EDGES = EdgeParameters()


@dataclass(frozen=True)
class ElementShapes(Rows):
    """What edge elements (n,) are, as `EdgeElements` says."""

    x: Floats
    y: Floats
    nx: Floats
    ny: Floats
    contrast: Floats
    width: Floats
    sigma: Floats


@dataclass(frozen=True)
class EdgeElements(ElementShapes):
    """Columns of one length n; image points in pixels (centre of the top-left pixel is 0, 0), grey on 0..255.

    The unit normal (nx, ny) points to the bright side.  `contrast` is the height of the step; `width` the standard
    deviation (px) of the blur that the image itself gave it; `sigma` the standard deviation (px) of the position along
    the normal.  `pixel` is row * columns + column of the pixel that saw it, ascending."""

    pixel: Ints32


def to_grey(image: npt.ArrayLike) -> Floats:
    """The image as contiguous float64 on 0..255, from 8-bit, 16-bit or 1-bit (bool) grey, or other numbers taken as on
    0..255.

    Raises InputError for colour, an empty image, no real numbers, and values not finite or far beyond that range."""
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
    image: npt.ArrayLike, sigma: float = 1.4, p: EdgeParameters = _EDGES, *, noise: Floats | None = None
) -> EdgeElements:
    """Edge elements of a grey image (rows, columns) at facet scale `sigma` px, thinned to one per edge and pixel.

    `p` says what is kept (its scale is not used).  `noise` (256,) is the curve of `estimate_noise`, estimated
    when not given.  None lies within two and a half sigma of the border, where the mirrored picture displaces it."""
    from vision.extraction import edge_kernels

    grey = to_grey(image)
    rows, columns = grey.shape
    kernels = gaussian_kernels(sigma)
    kappa, operator_variance = _calibration(sigma, p.calibration_blur)
    curve = estimate_noise(grey) if noise is None else np.asarray(noise, dtype=np.float64)
    covariance = kernels.moment_covariance
    alone, with_other = np.array([_A20, _A11, _A30, _A21]), np.array([[_A20, _A02], [_A30, _A12]])
    variances = np.diag(covariance)[alone]
    variances[1::2] += 2 * covariance[tuple(with_other.T)]
    no_shade = (p.min_contrast / (sqrt(2.0 * pi) * p.max_spread * sigma)) ** 2
    # F on (2, infinity), as the noise comes from the whole picture
    no_chance = 2.0 * covariance[_A10, _A10] * -log(p.significance)

    def of_band(first: int, moments: Floats32, noise: Floats32) -> tuple[Floats32, Ints32]:
        found, seen = np.empty((6, moments.shape[1]), np.float32), np.empty(moments.shape[1], np.bool_)
        edge_kernels.steps(
            moments, noise, variances.astype(np.float32), kappa, operator_variance, no_shade, no_chance,
            p.max_offset, p.min_contrast, p.max_sigma, found, seen,
        )  # fmt: skip
        within = seen.reshape(-1, columns)
        within[:, :border], within[:, columns - border :] = False, False
        within[: max(border - first // columns, 0)] = False
        within[max(rows - border - first // columns, 0) :] = False
        pixel = np.flatnonzero(seen)
        return found.take(pixel, axis=1), (first + pixel).astype(np.int32)

    border = ceil(p.border * sigma)
    values, pixels = (np.concatenate(c, axis=-1) for c in zip(*in_bands(grey, kernels, curve, of_band), strict=True))
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
    nearer to the gradient: an edge then has one element per row or per column."""
    offset, nx, ny = np.abs(values[0]), values[1], values[2]
    upright = np.abs(nx) < np.abs(ny)
    holder = np.full(pixels.max(initial=0) + columns + 1, -1, np.int32)
    holder[pixels] = np.arange(len(pixels))
    keep = np.ones(len(pixels), np.bool_)
    for step, down in ((1, False), (columns, True)):
        other = holder[pixels + step]
        one = np.flatnonzero(other >= 0)
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
