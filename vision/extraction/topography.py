"""Step 6: the topographic primal sketch, one of eleven labels for each pixel.

Haralick, Watson, Laffey, "The topographic primal sketch", IJRR 2 (1983).  Along both eigenvectors of the facet's
Hessian the extremum nearest to the pixel's centre is looked for; one inside the pixel, with second derivative beyond
the threshold, makes it a ridge or ravine, two a peak, pit or saddle.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from vision.extraction.arcs import Arcs, concatenate
from vision.extraction.edges import EdgeElements
from vision.extraction.facets import gaussian_kernels, in_bands
from vision.extraction.linking import Chains, link
from vision.extraction.segmentation import fit_arcs

FloatArray = npt.NDArray[np.float64]
SingleArray = npt.NDArray[np.float32]
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
_RIDGE, _RAVINE = LABELS.index("ridge"), LABELS.index("ravine")


@dataclass(frozen=True)
class Ridges:
    """Ridge and ravine elements, thinned by construction: an extremum across lies within its pixel.

    `elements` is of the form of edge elements, so that it links and fits like them: the unit normal runs across, in the
    same half plane, `contrast` (grey) is the height of a Gaussian ridge of the facet's scale with that bend, `width`
    the scale (px), `sigma` (px) the standard deviation of the place across.  `ravine` marks the hollow ones.
    """

    elements: EdgeElements
    ravine: npt.NDArray[np.bool_]

    def take(self, kept: npt.NDArray[np.bool_]) -> "Ridges":
        """The ridges that the mask selects."""
        return Ridges(self.elements.take(kept), self.ravine[kept])


# rad: across a ridge both normals are alike; the one within a right angle of this direction is given.  Few ridges run
# across it, where a chain is cut.
_HALF_PLANE = 0.35


def label_topography(
    grey: FloatArray,
    noise: FloatArray,
    *,
    sigma: float = 2.0,
    min_slope: float = 0.5,
    min_bend: float = 1.0,
) -> tuple[ByteArray, Ridges]:
    """Index into `LABELS` of every pixel of `grey` (rows, columns; 0..255), by facets of scale `sigma` px, and the
    ridges and ravines as elements.

    A slope counts from `min_slope` grey/px and a second derivative from `min_bend` grey/px^2, or from three standard
    deviations under `noise` (256,), the curve over grey.
    """
    from vision.extraction import _topography_kernels

    kernels = gaussian_kernels(sigma)
    variance = np.diag(kernels.moment_covariance)
    slope_sigma, bend_sigma = float(np.sqrt(variance[1])), float(2.0 * np.sqrt(variance[3]))
    labels = np.empty(grey.shape, np.uint8)
    flat = labels.reshape(-1)

    def of_band(first: int, moments: SingleArray, noise: SingleArray) -> tuple[npt.NDArray[np.int32], SingleArray]:
        here, ridges = flat[first : first + moments.shape[1]], np.empty((5, moments.shape[1]), np.float32)
        _topography_kernels.classify(
            moments, noise, min_slope, 3.0 * slope_sigma, min_bend, 3.0 * bend_sigma, here, ridges
        )
        pixel = np.flatnonzero((here == _RIDGE) | (here == _RAVINE))
        return (first + pixel).astype(np.int32), ridges.take(pixel, axis=1)

    pixel, rows = (
        np.concatenate(column, axis=-1) for column in zip(*in_bands(grey, kernels, noise, of_band), strict=True)
    )
    return labels, _collect_ridges(pixel, rows.astype(np.float64), grey, noise, slope_sigma, sigma)


def mark_inflections(labels: ByteArray, pixels: npt.NDArray[np.int32]) -> None:
    """Make inflections of the `pixels` (row * columns + column) of edges where no stronger label (peak, pit, saddle,
    ridge, ravine) holds."""
    flat = labels.reshape(-1)
    flat[pixels[flat[pixels] > _RAVINE]] = LABELS.index("inflection")


def _collect_ridges(
    pixel: npt.NDArray[np.int32],
    rows: FloatArray,
    grey: FloatArray,
    noise: FloatArray,
    slope_sigma: float,
    scale: float,
) -> Ridges:
    step_x, step_y, across_x, across_y, second = rows
    bend = np.abs(second)
    half = np.where(across_x * np.cos(_HALF_PLANE) + across_y * np.sin(_HALF_PLANE) < 0.0, -1.0, 1.0)
    level = np.clip(grey.reshape(-1)[pixel], 0, 255).astype(np.intp)
    elements = EdgeElements(
        x=pixel % grey.shape[1] + step_x,
        y=pixel // grey.shape[1] + step_y,
        nx=half * across_x,
        ny=half * across_y,
        contrast=bend * scale**2,
        width=np.full(len(pixel), scale),
        sigma=noise[level] * slope_sigma / bend,
        pixel=pixel,
    )
    return Ridges(elements, second > 0)


def fit_ridge_arcs(
    ridges: Ridges, shape: tuple[int, int], *, scale: float, min_height: float, min_elements: int
) -> Arcs:
    """Arcs along ridges, then along ravines, of an image of `shape` (rows, columns).

    Fillets show so: no step, but a ridge of grey along them.  `offsets` and `elements` of the arcs refer to
    `ridges.elements`.  Kept are chains of `min_elements` elements and `min_height` grey.
    """
    found = []
    for hollow in (False, True):
        which = np.flatnonzero((ridges.ravine == hollow) & (ridges.elements.contrast >= min_height)).astype(np.int32)
        part = ridges.elements.take(which)
        chains = link(part, shape)
        chains = chains.take(chains.counts >= min_elements)
        chains = Chains(which[chains.elements], chains.offsets, chains.closed)
        found.append(fit_arcs(ridges.elements, chains, scale=scale, min_elements=min_elements // 2))
    return concatenate(found)


def count_labels(labels: ByteArray, regions: npt.NDArray[np.int32], count: int) -> npt.NDArray[np.int64]:
    """(count, 11): pixels of each label in each region 0..count-1 of the label image `regions`."""
    from vision.extraction import _region_kernels

    return _region_kernels.counts(np.ascontiguousarray(regions), labels, count, len(LABELS))
