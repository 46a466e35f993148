"""Cubic facets: the polynomial that fits best, by (weighted) least squares, the grey values around each pixel.

Haralick, "Digital step edges from zero crossings of second directional derivatives", PAMI 6 (1984), and Haralick,
Watson, Laffey, "The topographic primal sketch", IJRR 2 (1983).  In a window r, c in -k..k (r down, c right)

    f = k1 + k2 r + k3 c + k4 r^2 + k5 rc + k6 c^2 + k7 r^3 + k8 r^2 c + k9 r c^2 + k10 c^3

With weights w(r) w(c) the discrete orthogonal polynomials P0..P3 make every coefficient a sum of separable
correlations a_ij of the image with p_i = w P_i / N_i down the rows and p_j along the columns, i + j <= 3.
With Gaussian weights p_i is (up to truncation) the i-th derivative of the Gaussian over i!.
"""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from math import ceil
from typing import TypeVar

import numpy as np

from relmodel.arrays import Floats, Floats32
from relmodel.errors import UsageError

Found = TypeVar("Found")

_BAND = 1 << 15  # pixels whose moments are computed at once: they stay in the processor's cache
_THREADS = 2

# The pairs (i, j) of the a_ij, in the order of the rows of `FacetKernels.moments`.
MOMENTS = ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2), (3, 0), (2, 1), (1, 2), (0, 3))


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
    grey: Floats, kernels: FacetKernels, noise: Floats, work: Callable[[int, Floats32, Floats32], Found]
) -> list[Found]:
    """What `work(first pixel, moments, noise)` makes of successive bands of rows of `grey`, in their order.

    `moments` (10, pixels), in the order 00 01 02 03 10 11 12 20 21 30, belong to the pixels from the first on, the
    noise (pixels,) to their grey on the curve `noise` (256,); the picture is mirrored at its border.  Single precision
    rounds 1e-7 of the grey range, far below any noise.  The bands are shared out between two threads; what
    `work` keeps of `moments` it must copy.
    """
    from vision.extraction import facet_kernels

    rows, columns = grey.shape
    taps = facet_kernels.half_kernels(kernels.one_d)
    picture = facet_kernels.mirrored(grey, taps)
    curve = noise.astype(np.float32)
    height = max(_BAND // columns, 1)

    def share(firsts: range) -> list[Found]:
        found = []
        down = np.empty((4, picture.shape[1]), np.float32)
        moments = np.empty((len(MOMENTS), height, columns), np.float32)
        for first in firsts:
            if rows - first < height:
                moments = np.empty((len(MOMENTS), rows - first, columns), np.float32)
            facet_kernels.moments(picture.reshape(-1), picture.shape[1], first, taps, down, moments)
            flat = moments.reshape(len(MOMENTS), -1)
            found.append(work(first * columns, flat, curve.take(flat[0].astype(np.intp), mode="clip")))
        return found

    firsts = range(0, rows, height)
    part = -(-len(firsts) // _THREADS)
    with ThreadPoolExecutor(_THREADS) as pool:
        shares = list(pool.map(share, [firsts[at : at + part] for at in range(0, len(firsts), part)]))
    return [found for each in shares for found in each]
