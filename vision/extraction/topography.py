"""Step 6: the topographic primal sketch, one of eleven labels for each pixel.

Haralick, Watson, Laffey, "The topographic primal sketch", IJRR 2 (1983).  Along both eigenvectors of the facet's
Hessian the extremum nearest to the pixel's centre is looked for; one inside the pixel, with second derivative beyond
the threshold, makes it a ridge or ravine, two a peak, pit or saddle.
"""

from dataclasses import dataclass, replace

import numpy as np

from relmodel.arrays import Bools, Bytes, Floats, Floats32, Ints32
from relmodel.columns import Rows
from vision.extraction.arcs import Arcs, concatenate
from vision.extraction.edges import EdgeElements
from vision.extraction.extraction_parameters import ExtractionParameters, TopographyParameters
from vision.extraction.facets import gaussian_kernels, in_bands
from vision.extraction.linking import Chains, link
from vision.extraction.segmentation import fit_arcs

_DEFAULTS, _ALL = TopographyParameters(), ExtractionParameters()

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
class Ridges(Rows):
    """Ridge and ravine elements, thinned by construction: an extremum across lies within its pixel.

    `elements` is of the form of edge elements, so that it links and fits like them: the unit normal runs across, in the
    same half plane, `contrast` (grey) is the height of a Gaussian ridge of the facet's scale with that bend, `width`
    the scale (px), `sigma` (px) the standard deviation of the place across.  `ravine` marks the hollow ones.
    """

    elements: EdgeElements
    ravine: Bools


def label_topography(
    grey: Floats,
    noise: Floats,
    p: TopographyParameters = _DEFAULTS,
) -> tuple[Bytes, Ridges]:
    """Index into `LABELS` of every pixel of `grey` (rows, columns; 0..255), by facets of scale `p.scale` px, and the
    ridges and ravines as elements.

    A slope counts from `p.min_slope` grey/px and a second derivative from `p.min_bend` grey/px^2, or from
    `p.noise_sigmas` standard deviations under `noise` (256,), the curve over grey.
    """
    from vision.extraction import topography_kernels

    kernels = gaussian_kernels(p.scale)
    variance = np.diag(kernels.moment_covariance)
    slope_sigma, bend_sigma = float(np.sqrt(variance[1])), float(2.0 * np.sqrt(variance[3]))
    labels = np.empty(grey.shape, np.uint8)
    flat = labels.reshape(-1)

    def of_band(first: int, moments: Floats32, noise: Floats32) -> tuple[Ints32, Floats32]:
        here, ridges = flat[first : first + moments.shape[1]], np.empty((5, moments.shape[1]), np.float32)
        topography_kernels.classify(
            moments,
            noise,
            p.min_slope,
            p.noise_sigmas * slope_sigma,
            p.min_bend,
            p.noise_sigmas * bend_sigma,
            here,
            ridges,
        )
        pixel = np.flatnonzero((here == _RIDGE) | (here == _RAVINE))
        return (first + pixel).astype(np.int32), ridges.take(pixel, axis=1)

    pixel, rows = (
        np.concatenate(column, axis=-1) for column in zip(*in_bands(grey, kernels, noise, of_band), strict=True)
    )
    return labels, _collect_ridges(pixel, rows.astype(np.float64), grey, noise, slope_sigma, p)


def mark_inflections(labels: Bytes, pixels: Ints32) -> None:
    """Make inflections of the `pixels` (row * columns + column) of edges where no stronger label (peak, pit, saddle,
    ridge, ravine) holds."""
    flat = labels.reshape(-1)
    flat[pixels[flat[pixels] > _RAVINE]] = LABELS.index("inflection")


def _collect_ridges(
    pixel: Ints32,
    rows: Floats,
    grey: Floats,
    noise: Floats,
    slope_sigma: float,
    p: TopographyParameters,
) -> Ridges:
    step_x, step_y, across_x, across_y, second = rows
    bend = np.abs(second)
    half = np.where(across_x * np.cos(p.half_plane) + across_y * np.sin(p.half_plane) < 0.0, -1.0, 1.0)
    level = np.clip(grey.reshape(-1)[pixel], 0, 255).astype(np.intp)
    elements = EdgeElements(
        x=pixel % grey.shape[1] + step_x,
        y=pixel // grey.shape[1] + step_y,
        nx=half * across_x,
        ny=half * across_y,
        contrast=bend * p.scale**2,
        width=np.full(len(pixel), p.scale),
        sigma=noise[level] * slope_sigma / bend,
        pixel=pixel,
    )
    return Ridges(elements, second > 0)


def fit_ridge_arcs(
    ridges: Ridges,
    shape: tuple[int, int],
    p: ExtractionParameters = _ALL,
) -> Arcs:
    """Arcs along ridges, then along ravines, of an image of `shape` (rows, columns).

    Fillets show so: no step, but a ridge of grey along them.  `offsets` and `elements` of the arcs refer to
    `ridges.elements`.  Kept are chains of `p.topography.min_elements` elements and `p.topography.min_height` grey.
    """
    shorter, found = replace(p.segmentation, min_elements=p.topography.min_elements // 2), []
    for hollow in (False, True):
        which = np.flatnonzero(
            (ridges.ravine == hollow) & (ridges.elements.contrast >= p.topography.min_height)
        ).astype(np.int32)
        part = ridges.elements.take(which)
        chains = link(part, shape, p.linking)
        chains = chains.take(chains.counts >= p.topography.min_elements)
        chains = Chains(which[chains.elements], chains.offsets, chains.closed)
        found.append(fit_arcs(ridges.elements, chains, scale=p.topography.scale, p=shorter, fitting=p.fitting))
    return concatenate(found)
