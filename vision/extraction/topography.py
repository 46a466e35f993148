"""The topographic sketch of a picture, and what speaks against an arc being an edge of the object."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from relmodel.arrays import Bools, Bytes, Floats, Floats32, Ints32, Rows
from vision.extraction.arcs import Arcs, concatenate
from vision.extraction.chains import Chains, interpolate_grey, link
from vision.extraction.edges import MOMENTS, EdgeElements, gaussian_kernels, in_bands
from vision.extraction.extraction_parameters import ExtractionParameters, QualityParameters, TopographyParameters
from vision.extraction.segmentation import fit_arcs

# Haralick, Watson, Laffey, "The topographic primal sketch", IJRR 2 (1983). Along both eigenvectors of the facet's
# Hessian the extremum nearest to the pixel's centre is looked for; one inside the pixel, with second derivative beyond
# the threshold, makes it a ridge or ravine, two a peak, pit or saddle.

_DEFAULTS = TopographyParameters()
LABELS = ("peak", "pit", "saddle", "ridge", "ravine", "inflection", "flat", "slope", "convex", "concave", "saddle_hill")
_RIDGE, _RAVINE = LABELS.index("ridge"), LABELS.index("ravine")


@dataclass(frozen=True)
class Ridges(Rows):
    """Ridge and ravine elements, thinned by construction: an extremum across lies within its pixel.

    `elements` is of the form of edge elements, so that it links and fits like them: the unit normal runs across, in the
    same half plane, `contrast` (grey) is the height of a Gaussian ridge of the facet's scale with that bend, `width`
    the scale (px), `sigma` (px) the standard deviation of the place across.  `ravine` marks the hollow ones."""

    elements: EdgeElements
    ravine: Bools


def label_topography(grey: Floats, noise: Floats, p: TopographyParameters = _DEFAULTS) -> tuple[Bytes, Ridges]:
    """Index into `LABELS` of every pixel of `grey` (rows, columns; 0..255), by facets of scale `p.scale` px, and the
    ridges and ravines as elements.

    A slope counts from `p.min_slope` grey/px and a second derivative from `p.min_bend` grey/px^2, or from
    `p.noise_sigmas` standard deviations under `noise` (256,), the curve over grey."""
    from vision.extraction import region_kernels

    kernels = gaussian_kernels(p.scale)
    sigma = np.sqrt(np.diag(kernels.moment_covariance))
    slope_sigma, bend_sigma = float(sigma[MOMENTS.index((1, 0))]), float(2.0 * sigma[MOMENTS.index((2, 0))])
    labels = np.empty(grey.shape, np.uint8)
    flat = labels.reshape(-1)

    def of_band(first: int, moments: Floats32, noise: Floats32) -> tuple[Ints32, Floats32]:
        here, ridges = flat[first : first + moments.shape[1]], np.empty((5, moments.shape[1]), np.float32)
        region_kernels.classify(
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

    pixel, rows = (np.concatenate(c, axis=-1) for c in zip(*in_bands(grey, kernels, noise, of_band), strict=True))
    return labels, _collect_ridges(pixel, rows.astype(np.float64), grey, noise, slope_sigma, p)


def mark_inflections(labels: Bytes, pixels: Ints32) -> None:
    """Make inflections of the `pixels` (row * columns + column) of edges where no stronger label (to ravine) holds."""
    flat = labels.reshape(-1)
    flat[pixels[flat[pixels] > _RAVINE]] = LABELS.index("inflection")


def _collect_ridges(
    pixel: Ints32, rows: Floats, grey: Floats, noise: Floats, slope_sigma: float, p: TopographyParameters
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


def fit_ridge_arcs(ridges: Ridges, shape: tuple[int, int], p: ExtractionParameters) -> Arcs:
    """Arcs along ridges, then along ravines, of an image of `shape` (rows, columns).

    Fillets show so: no step, but a ridge of grey along them.  `offsets` and `elements` of the arcs refer to
    `ridges.elements`.  Kept are chains of `p.topography.min_elements` elements and `p.topography.min_height` grey."""
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


# What speaks against an arc being an edge of the object: brush texture, shading, highlights.
#
# The closed form of an edge element predicts two plateaus, one on each side of the step. At the edge of a face they are
# there; a streak of brushed metal has fallen back a few pixels on, and shading has not reached its plateau yet. Streaks
# also come in bundles, parallel to each other, while an edge stands by itself. Contrast and length, which thresholds
# use, discriminate much less: streaks are long and bright.
#
# The ridges of fillets and chamfers differ from those of streaks by their height and, again, by having none parallel.


@dataclass(frozen=True)
class ArcQuality(Rows):
    """What speaks against each arc, 0..1.

    `texture`: the probability that it is brush texture or shading and no edge.  `highlight`: the share of its elements
    whose bright side, or whose ridge, is saturated."""

    texture: Floats
    highlight: Floats


def assess_arcs(grey: Floats, edges: EdgeElements, arcs: Arcs, p: QualityParameters) -> ArcQuality:
    """Quality of the arcs found in `grey` (rows, columns; 0..255) among all its edge elements, linked or not."""
    if len(arcs) == 0:
        return ArcQuality(np.zeros(0), np.zeros(0))
    chains = arcs.chains
    x, y, nx, ny = chains.gather(edges.x, edges.y, edges.nx, edges.ny)
    distances = np.array([p.near, -p.near, p.far, -p.far, p.highlight_distance])[:, None]
    sampled = interpolate_grey(grey, np.stack([x + distances * nx, y + distances * ny], axis=-1))
    per_arc = np.add.reduceat(
        np.column_stack([sampled[0] - sampled[1], sampled[2] - sampled[3], sampled[4] >= p.saturation]),
        arcs.offsets[:-1],
    )
    near, far, saturated = (per_arc / chains.counts[:, None]).T
    parallel = np.add.reduceat(_count_parallels(edges, grey.shape, arcs.elements, p), arcs.offsets[:-1]) / chains.counts
    odds = (
        p.step_near * near / arcs.contrast
        + p.step_far * far / arcs.contrast
        + p.parallels * np.log(parallel / (3 * p.cell))
        + p.width * arcs.width
        + p.offset
    )
    return ArcQuality(_against(odds), saturated)


def assess_ridge_arcs(grey: Floats, ridges: EdgeElements, arcs: Arcs, p: QualityParameters) -> ArcQuality:
    """Quality of the arcs along ridges and ravines found in `grey` (rows, columns; 0..255) among all their elements."""
    if len(arcs) == 0:
        return ArcQuality(np.zeros(0), np.zeros(0))
    first, counts = arcs.offsets[:-1], arcs.chains.counts
    parallel = np.add.reduceat(_count_parallels(ridges, grey.shape, arcs.elements, p), first) / counts
    saturated = grey.reshape(-1)[ridges.pixel[arcs.elements]] >= p.saturation
    odds = p.ridge_height * np.log(arcs.contrast) + p.ridge_parallels * np.log(parallel / (3 * p.cell)) + p.ridge_offset
    return ArcQuality(_against(odds), np.add.reduceat(saturated.astype(np.float64), first) / counts)


def _against(odds: Floats) -> Floats:
    """The probability of the contrary, from log odds."""
    return np.asarray(1.0 / (1.0 + np.exp(np.clip(odds, -30.0, 30.0))))


def _count_parallels(edges: EdgeElements, shape: tuple[int, ...], which: Ints32, p: QualityParameters) -> Floats:
    """How many elements of like orientation and no less than a third of its contrast, itself among them, lie in the
    3 x 3 cells around each element of `which`."""
    from vision.extraction import region_kernels

    angle = np.arctan2(edges.ny, edges.nx)
    turn = np.rint(angle * (p.orientations / np.pi)).astype(np.int32) % p.orientations
    grade = np.clip(2.0 * np.log2(edges.contrast / 4.0), 0, p.grades - 1).astype(np.int32)
    kinds = p.orientations * p.grades
    columns = -(-shape[1] // p.cell) + 2  # with a frame of empty cells around
    cell = ((edges.pixel // shape[1] // p.cell + 1) * columns + edges.pixel % shape[1] // p.cell + 1) * kinds
    around = np.array([-1, 0, 1])
    near = np.add.outer(around * columns, around).ravel() * kinds
    alike = np.add.outer(np.arange(p.orientations), around).ravel() % p.orientations * p.grades
    # a cell of 8 x 8 px holds at most 64 elements
    grid = np.zeros((-(-shape[0] // p.cell) + 2) * columns * kinds, np.uint8)
    out = np.empty(len(which))
    region_kernels.parallels(cell, turn * p.grades + grade, near, alike, p.grades, which, p.fainter, grid, out)
    return out
