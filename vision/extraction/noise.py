"""The noise of an image as a curve over grey: shot noise and a gamma curve make it depend on the level.

The high pass of Immerkaer (Computer Vision and Image Understanding 64, 1996) kills constants and planes; the median of
its magnitude within each band of grey is insensitive to edges and to most texture.
"""

import numpy as np

from relmodel.arrays import Floats, Ints
from vision.extraction.extraction_parameters import NoiseParameters

_BINS = 1024  # of the magnitude, one a unit
_MEDIAN_TO_SIGMA = 1.4826 / 6.0  # the mask's norm is 6
_DEFAULTS = NoiseParameters()


def estimate_noise(grey: Floats, p: NoiseParameters = _DEFAULTS) -> Floats:
    """Standard deviation of the noise at each grey level 0..255, (256,), of an image scaled to 0..255.

    Nowhere less than `p.floor`.
    """
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
