"""What speaks against an arc being an edge of the object: brush texture, shading, highlights.

The closed form of an edge element predicts two plateaus, one on each side of the step.  At the edge of a face they are
there; a streak of brushed metal has fallen back a few pixels on, and shading has not reached its plateau yet.  Streaks
also come in bundles, parallel to each other, while an edge stands by itself.  Contrast and length, which thresholds
use, discriminate much less: streaks are long and bright.

The ridges of fillets and chamfers differ from those of streaks by their height and, again, by having none parallel.
"""

from dataclasses import dataclass

import numpy as np

from relmodel.arrays import Floats, Ints32
from relmodel.columns import Rows
from vision.extraction.arcs import Arcs
from vision.extraction.edges import EdgeElements
from vision.extraction.extraction_parameters import QualityParameters

_DEFAULTS = QualityParameters()


@dataclass(frozen=True)
class ArcQuality(Rows):
    """What speaks against each arc, 0..1.

    `texture`: the probability that it is brush texture or shading and no edge.  `highlight`: the share of its elements
    whose bright side, or whose ridge, is saturated.
    """

    texture: Floats
    highlight: Floats


def assess_arcs(grey: Floats, edges: EdgeElements, arcs: Arcs, p: QualityParameters = _DEFAULTS) -> ArcQuality:
    """Quality of the arcs found in `grey` (rows, columns; 0..255) among all its edge elements, linked or not."""
    from vision.extraction import quality_kernels

    if len(arcs) == 0:
        return ArcQuality(np.zeros(0), np.zeros(0))
    chains, distances = arcs.chains, np.array([p.near, -p.near, p.far, -p.far, p.highlight_distance])
    x, y, nx, ny = chains.gather(edges.x, edges.y, edges.nx, edges.ny)
    sampled = np.empty((len(x), len(distances)))
    quality_kernels.grey_across(grey, x, y, nx, ny, distances, sampled)
    per_arc = np.add.reduceat(
        np.column_stack([sampled[:, 0] - sampled[:, 1], sampled[:, 2] - sampled[:, 3], sampled[:, 4] >= p.saturation]),
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


def assess_ridge_arcs(grey: Floats, ridges: EdgeElements, arcs: Arcs, p: QualityParameters = _DEFAULTS) -> ArcQuality:
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
    from vision.extraction import quality_kernels

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
    quality_kernels.parallels(cell, turn * p.grades + grade, near, alike, p.grades, which, p.fainter, grid, out)
    return out
