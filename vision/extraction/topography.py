"""Step 6: the topographic primal sketch, one of eleven labels for each pixel.

Haralick, Watson, Laffey, "The topographic primal sketch", IJRR 2 (1983).  Along both eigenvectors of the facet's
Hessian the extremum nearest to the pixel's centre is looked for; one inside the pixel, with second derivative beyond
the threshold, makes it a ridge or ravine, two a peak, pit or saddle.
"""

import numpy as np
import numpy.typing as npt

from vision.extraction.edges import EdgeElements
from vision.extraction.facets import gaussian_kernels

FloatArray = npt.NDArray[np.float64]
ByteArray = npt.NDArray[np.uint8]

LABELS = (
    "peak",
    "pit",
    "saddle",
    "ridge",
    "ravine",
    "inflection",
    "flat",
    "slope",
    "convex",
    "concave",
    "saddle_hill",
)


def topographic_labels(
    grey: FloatArray,
    noise: FloatArray,
    edges: EdgeElements | None = None,
    *,
    sigma: float = 2.0,
    min_slope: float = 0.5,
    min_bend: float = 1.0,
) -> ByteArray:
    """Index into `LABELS` of every pixel of `grey` (rows, columns; 0..255), by facets of scale `sigma` px.

    A slope counts from `min_slope` grey/px and a second derivative from `min_bend` grey/px^2, or from three standard
    deviations under `noise` (256,), the curve over grey.  Pixels of `edges` are inflections unless a stronger label
    (peak, pit, saddle, ridge, ravine) holds.
    """
    from vision.extraction import _topography_kernels

    kernels = gaussian_kernels(sigma)
    variance = np.diag(kernels.coefficient_covariance)
    mirrored = np.ascontiguousarray(np.pad(grey, kernels.radius, mode="symmetric"))
    labels: ByteArray = _topography_kernels.classify(
        mirrored,
        kernels.one_d,
        kernels.alpha,
        kernels.beta,
        noise,
        float(np.sqrt(variance[1])),
        float(2.0 * np.sqrt(variance[3])),
        min_slope,
        min_bend,
    )
    if edges is not None:
        flat = labels.reshape(-1)
        weak = edges.pixel[flat[edges.pixel] > LABELS.index("ravine")]
        flat[weak] = LABELS.index("inflection")
    return labels


def label_histogram(labels: ByteArray, regions: npt.NDArray[np.int32], count: int) -> npt.NDArray[np.int64]:
    """(count, 11): pixels of each label in each region 0..count-1 of the label image `regions`."""
    inside = regions >= 0
    key = regions[inside].astype(np.int64) * len(LABELS) + labels[inside]
    return np.bincount(key, minlength=count * len(LABELS)).reshape(count, len(LABELS))
