"""The noise of an image as a curve over grey: shot noise and a gamma curve make it depend on the level.

The high pass of Immerkaer (Computer Vision and Image Understanding 64, 1996) kills constants and planes; the median of
its magnitude within each band of grey is deaf to edges and to most texture.
"""

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]

_BANDS = 16
_BINS = 1024  # of the magnitude, one a unit
_ROWS = 64  # worked on at once
_MIN_SAMPLES = 300
_MEDIAN_TO_SIGMA = 1.4826 / 6.0  # the mask's norm is 6


def noise_curve(grey: FloatArray, floor: float = 1.0 / np.sqrt(12.0)) -> FloatArray:
    """Standard deviation of the noise at each grey level 0..255, (256,), of an image scaled to 0..255.

    `floor` is the least value reported, by default what rounding to eight bits leaves behind.
    """
    histogram = _high_pass_histogram(grey)
    counts = histogram.sum(axis=1)
    pooled = histogram.sum(axis=0)
    if pooled.sum() == 0:
        return np.full(256, floor)
    centres = (np.arange(_BANDS) + 0.5) * 256.0 / _BANDS
    good = counts >= _MIN_SAMPLES
    if not good.any():
        return np.full(256, max(floor, _median(pooled) * _MEDIAN_TO_SIGMA))
    sigma = np.array([_median(row) for row in histogram[good]]) * _MEDIAN_TO_SIGMA
    return np.maximum(np.interp(np.arange(256), centres[good], sigma), floor)


def _high_pass_histogram(grey: FloatArray) -> npt.NDArray[np.int64]:
    """(bands, bins): the rounded magnitudes of the high pass by band of grey; every second row, clipped pixels left
    out."""
    histogram = np.zeros((_BANDS + 1) * _BINS, np.int64)
    for first in range(1, len(grey) - 1, _ROWS):
        rows = grey[first - 1 : first + _ROWS + 1].astype(np.float32)
        middle = rows[1:-1:2]
        beside = rows[0:-2:2] + rows[2::2]
        corners = beside[:, :-2] + beside[:, 2:]
        sides = beside[:, 1:-1] + middle[:, :-2] + middle[:, 2:]
        centre = middle[:, 1:-1]
        high = np.abs(corners - 2.0 * sides + 4.0 * centre)
        band = ((corners + sides + centre) * (_BANDS / 256.0 / 9.0)).astype(np.int32).clip(0, _BANDS - 1)
        band[(centre <= 0.5) | (centre >= 254.5)] = _BANDS
        cell = band * _BINS + (high + 0.5).astype(np.int32).clip(0, _BINS - 1)
        histogram += np.bincount(cell.ravel(), minlength=len(histogram))
    return histogram.reshape(_BANDS + 1, _BINS)[:_BANDS]


def _median(histogram: npt.NDArray[np.int64]) -> float:
    """Median of rounded magnitudes, linear within the unit bin around the whole number that holds it."""
    cumulative = np.cumsum(histogram)
    half = cumulative[-1] / 2.0
    at = int(np.searchsorted(cumulative, half))
    before = cumulative[at] - histogram[at]
    return float(max(at - 0.5 + (half - before) / max(histogram[at], 1), 0.0))
