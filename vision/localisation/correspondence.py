"""Which image arc is which visible model arc at a pose: gate, then assignment, with a reason for every candidate.

An image arc is a piece of at most one model arc; a model arc may be covered by several image arcs, but each stretch of
it once.  So arcs are assigned one to one at the greatest total gain (Kuhn's problem, solved exactly), the stretches
taken are struck off, and what is left over is assigned again, until nothing gains.  The gain of a pair is the length of
model arc that it newly covers, less as it lies further off: length x (1 - (rms distance / gate)^2).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from relmodel.arrays import Bools, Floats, Ints
from vision.extraction.primitives import ArcColumns
from vision.localisation.evidence import EdgePoints
from vision.localisation.parameters import DEFAULTS, CorrespondenceParameters
from vision.localisation.views import ViewArcs

REASONS = ("assigned", "orientation", "distance", "overlap", "better_elsewhere")
ASSIGNED, ORIENTATION, DISTANCE, OVERLAP, BETTER_ELSEWHERE = range(5)


@dataclass(frozen=True)
class Correspondences:
    """Candidate pairs as columns: run of the view, image arc, reason (index of REASONS; 0 is taken), rms distance (px),
    mean angle (rad), length of image arc beside the model arc (px)."""

    view_arc: Ints
    image_arc: Ints
    reason: NDArray[np.int8]
    residual: Floats
    angle: Floats
    overlap: Floats

    @property
    def accepted(self) -> Bools:
        return np.asarray(self.reason == ASSIGNED)


def correspond(
    view: ViewArcs,
    arcs: ArcColumns,
    edges: EdgePoints,
    sigma_px: Floats,
    p: CorrespondenceParameters = DEFAULTS.correspondence,
) -> Correspondences:
    """Candidate pairs of a view's runs and a picture's arcs, and which are taken.

    edges: of the same picture, those of the arcs first; sigma_px (samples,): standard
    deviation of the view's samples along their normals that the pose's covariance makes.
    """
    pairs = _pairs(view, arcs, edges, p)
    if not len(pairs.run):
        none = np.zeros(0, np.int64)
        return Correspondences(none, none, np.zeros(0, np.int8), np.zeros(0), np.zeros(0), np.zeros(0))
    key, member = np.unique(np.stack([pairs.run, pairs.arc], axis=1), axis=0, return_inverse=True)
    member = member.ravel()
    count = np.bincount(member).astype(float)
    residual = np.sqrt(np.bincount(member, pairs.offset**2) / count)
    angle = np.bincount(member, pairs.angle) / count
    pose_sigma = np.bincount(member, sigma_px[pairs.sample]) / count
    spacing = arcs.length / np.maximum(np.diff(arcs.offsets), 1)
    overlap = count * spacing[key[:, 1]]

    gate = p.gate_sigma * np.sqrt(pose_sigma**2 + np.nan_to_num(arcs.sigma[key[:, 1]]) ** 2 + p.floor_px**2)
    reason = np.full(len(key), BETTER_ELSEWHERE, np.int8)
    reason[overlap < p.min_overlap * arcs.length[key[:, 1]]] = OVERLAP
    reason[residual > gate] = DISTANCE
    reason[angle > p.max_angle] = ORIENTATION
    stretch = _stretches(view, p)[pairs.sample]
    _assign(key, member, stretch, spacing, residual, gate, reason, p)
    return Correspondences(key[:, 0], key[:, 1], reason, residual, angle, overlap)


@dataclass(frozen=True)
class _Pairs:
    """For each edge element of an image arc and each run that comes near it: the nearest sample and how it lies."""

    run: Ints
    arc: Ints
    sample: Ints
    offset: Floats
    angle: Floats


def _pairs(view: ViewArcs, arcs: ArcColumns, edges: EdgePoints, p: CorrespondenceParameters) -> _Pairs:
    from scipy.spatial import cKDTree

    # Samples every few px suffice: distance is taken along the normal.
    along = np.floor(np.cumsum(view.samples.length_px) / p.sample_spacing_px)
    some = np.flatnonzero((np.diff(along, prepend=-1) > 0) | (np.diff(view.run, prepend=-1) != 0))
    elements = np.arange(arcs.offsets[-1])
    arc = np.repeat(np.arange(len(arcs)), np.diff(arcs.offsets))
    position = edges.position[elements]
    if not len(some) or not len(elements):
        none, nothing = np.zeros(0, np.int64), np.zeros(0)
        return _Pairs(none, none, none, nothing, nothing)
    near = cKDTree(position).sparse_distance_matrix(
        cKDTree(view.samples.pixel[some]), p.reach_px, output_type="ndarray"
    )
    row, sample = near["i"].astype(np.int64), some[near["j"]]
    order = np.lexsort((near["v"], view.run[sample], row))
    row, sample = row[order], sample[order]
    first = (np.diff(row, prepend=-1) != 0) | (np.diff(view.run[sample], prepend=-1) != 0)
    row, sample = row[first], sample[first]
    direction = view.samples.direction[sample]
    way = position[row] - view.samples.pixel[sample]
    offset = way[:, 1] * direction[:, 0] - way[:, 0] * direction[:, 1]
    beside = np.abs(np.einsum("ni,ni->n", way, direction)) < p.max_beside_px
    normal = edges.normal[row]
    sine = np.abs(np.einsum("ni,ni->n", normal, direction))
    angle = np.arcsin(np.minimum(sine, 1.0))
    row, sample, offset, angle = row[beside], sample[beside], offset[beside], angle[beside]
    return _Pairs(view.run[sample], arc[row], sample, offset, angle)


def _stretches(view: ViewArcs, p: CorrespondenceParameters) -> Ints:
    """A number for each sample: samples of one run within `p.stretch_px` share it."""
    along = np.floor(np.cumsum(view.samples.length_px) / p.stretch_px).astype(np.int64)
    _, out = np.unique(np.stack([view.run, along], axis=1), axis=0, return_inverse=True)
    return np.asarray(out.ravel())


def _assign(
    key: Ints,
    member: Ints,
    stretch: Ints,
    spacing: Floats,
    residual: Floats,
    gate: Floats,
    reason: NDArray[np.int8],
    p: CorrespondenceParameters,
) -> None:
    """Marks the pairs taken in `reason`; `key` (n, 2) are the pairs, the other rows as in `correspond`."""
    from scipy.optimize import linear_sum_assignment

    quality = 1 - (residual / gate) ** 2
    length = spacing[key[member, 1]]
    taken = np.zeros(int(stretch.max()) + 1, bool)
    open_pair = reason == BETTER_ELSEWHERE
    while True:
        gain = np.bincount(member, length * ~taken[stretch], minlength=len(key)) * quality
        # A piece that would mostly cover what is covered is a second line beside the first.
        fresh = np.bincount(member, ~taken[stretch], minlength=len(key)) / np.bincount(member, minlength=len(key))
        rows = np.flatnonzero(open_pair & (gain > 0) & (fresh > p.min_fresh_share))
        if not len(rows):
            return
        runs, r = np.unique(key[rows, 0], return_inverse=True)
        images, c = np.unique(key[rows, 1], return_inverse=True)
        gains = np.zeros((len(runs), len(images)))
        gains[r, c] = gain[rows]
        where = np.full(gains.shape, -1)
        where[r, c] = rows
        chosen = where[linear_sum_assignment(gains, maximize=True)]
        chosen = chosen[chosen >= 0]
        reason[chosen] = ASSIGNED
        open_pair[np.isin(key[:, 1], key[chosen, 1])] = False
        taken[stretch[np.isin(member, chosen)]] = True
