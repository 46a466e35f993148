"""The number of false alarms of a chain or arc: how many as strong its surroundings would show by chance.

Desolneux, Moisan, Morel, "Meaningful alignments" (IJCV 40, 2000) and "Edge detection by Helmholtz principle" (JMIV 14,
2001), for machined metal, whose streaks are long and not chance alignments of pixels.  So the step is measured 4 px to
either side, where the step of a streak has faded and that of a face has not; the tail of its distribution is taken from
all steps of like orientation around the place, for streaks run along the lay; and what lies within a streak's length
counts as one observation, not what lies within the operator's reach.  Fisher's method joins the tails along the chain:
minus twice the sum of their logarithms is chi-square with two degrees a tail.

Where edges fill the surroundings these say nothing of texture; a tail is therefore never taken higher than that of an
exponential distribution of steps of metal.
"""

import numpy as np
import numpy.typing as npt

from relmodel.arrays import Bools, Floats
from vision.extraction.edges import EdgeElements
from vision.extraction.extraction_parameters import SignificanceParameters
from vision.extraction.linking import Chains

_LEAST = 1e-300
_DEFAULTS = SignificanceParameters()


def compute_false_alarm_terms(
    grey: Floats, edges: EdgeElements, which: npt.NDArray[np.integer], p: SignificanceParameters = _DEFAULTS
) -> Floats:
    """Of the edge elements `which` of `grey` (rows, columns; 0..255), minus the logarithm of the share of places around
    that show as high a step of its sign and orientation; one value per edge element, zero for the others."""
    from vision.extraction import quality_kernels, significance_kernels

    heights = np.arange(256)
    grade = np.where(heights < 1, 0, 1 + p.grades_per_octave * np.log2(np.maximum(heights, 1))).astype(np.uint8)
    grades = int(grade[-1]) + 1
    turn = np.arange(p.orientations) * np.pi / p.orientations
    offsets = np.rint(p.step_px * np.column_stack([np.sin(turn), np.cos(turn)])).astype(np.int64)
    counts = np.zeros((-(-grey.shape[0] // p.cell), -(-grey.shape[1] // p.cell), p.orientations, grades), np.int32)
    significance_kernels.histograms(grey, offsets, p.cell, p.stride, grade, counts)
    around = _sum_around(_sum_around(counts.astype(np.float64), 0, p.cells_around), 1, p.cells_around)
    exceed = np.cumsum(around[..., ::-1], axis=3)[..., ::-1]
    least = np.searchsorted(grade, np.arange(grades))  # the least height of each grade
    share = np.minimum(np.maximum(exceed, 1.0) / np.maximum(exceed[..., :1], 1.0), np.exp(-least / p.mean_step))
    table = -np.log(0.5 * share)  # half of all steps have the sign
    which = which.astype(np.intp)
    x, y, nx, ny = (column.take(which) for column in (edges.x, edges.y, edges.nx, edges.ny))
    sampled = np.empty((len(which), 2))
    quality_kernels.grey_across(grey, x, y, nx, ny, np.array([p.step_px, -p.step_px]), sampled)
    level = grade[(sampled[:, 0] - sampled[:, 1]).clip(0.0, 255.0).astype(np.intp)]
    towards = (np.arctan2(ny, nx) * (p.orientations / np.pi) + p.orientations + 0.5).astype(np.intp) % p.orientations
    row, column = np.divmod(edges.pixel[which], grey.shape[1])
    out = np.zeros(len(edges))
    out[which] = table[row // p.cell, column // p.cell, towards, level]
    return out


def compute_significance(terms: Floats, chains: Chains, p: SignificanceParameters = _DEFAULTS) -> Floats:
    """Minus the decimal logarithm of each chain's number of false alarms a megapixel; `terms` is of all elements."""
    from scipy.special import gammaincc

    observed = 1.0 + chains.counts / p.elements_per_observation
    tail = gammaincc(observed, observed * chains.mean(terms))
    return np.asarray(-np.log10(np.maximum(tail, _LEAST)) - np.log10(p.tests))


def select_significant(terms: Floats, arcs: Chains, chains: Chains, p: SignificanceParameters) -> tuple[Bools, Bools]:
    """Which of the arcs, given by their members, are significant or of a chain that is; and which chains contain
    them."""
    of_significant = np.zeros(len(terms), np.bool_)
    of_significant[chains.elements] = np.repeat(
        compute_significance(terms, chains, p) >= p.min_significance, chains.counts
    )
    kept = (compute_significance(terms, arcs, p) >= p.min_significance) | _contains_any(of_significant, arcs)
    of_arc = np.zeros(len(terms), np.bool_)
    of_arc[arcs.take(kept).elements] = True
    return kept, _contains_any(of_arc, chains)


def _contains_any(marked: Bools, chains: Chains) -> Bools:
    """(n,): whether any element of each chain is `marked`."""
    return (
        np.logical_or.reduceat(marked[chains.elements], chains.offsets[:-1]) if len(chains) else np.zeros(0, np.bool_)
    )


def _sum_around(cells: Floats, axis: int, across: int) -> Floats:
    """Sums over `across` cells along an axis, centred; beyond the border lies nothing."""
    half = across // 2
    width = [(0, 0)] * cells.ndim
    width[axis] = (half + 1, half)
    running = np.cumsum(np.pad(cells, width), axis=axis)
    n = cells.shape[axis]
    upper, lower = np.arange(n) + across, np.arange(n)
    return np.asarray(np.take(running, upper, axis=axis) - np.take(running, lower, axis=axis))
