"""Sub-pixel edge elements beside the samples of a prediction, and the derivatives of the offsets."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from relmodel.arrays import Bools, Floats, Ints
from vision.localisation.calibration import CameraUnknowns, differentiate
from vision.localisation.evidence import EdgePoints
from vision.localisation.hypotheses import Prediction, project_directions, project_with_jacobians
from vision.localisation.localisation_parameters import DEFAULTS, LocalisationParameters, RefinementParameters


class EdgeIndex:
    """Edge elements of one picture bucketed by whole pixels.

    odds (n,): of each element, the log likelihood ratio of being an edge of the object that stereo gives its arc.
    """

    def __init__(self, edges: EdgePoints, odds: Floats | float = 0.0) -> None:
        self.edges = edges
        self.columns, self.rows = (np.ceil(edges.high - edges.low).astype(int) + 1).tolist()
        cell = np.rint(edges.position - edges.low).astype(np.int64)
        cell = np.clip(cell, 0, [self.columns - 1, self.rows - 1])
        bucket = cell[:, 1] * self.columns + cell[:, 0]
        self.order = np.argsort(bucket, kind="stable")
        self.start = np.searchsorted(bucket[self.order], np.arange(self.rows * self.columns + 1))
        self.strength = np.maximum(np.abs(edges.contrast), 1e-3)
        self.texture = float(np.median(self.strength)) if len(self.strength) else 1.0
        # Of edges side by side the likelier one counts, by contrast and by stereo.
        self.strength = self.strength * np.exp(odds)

    def measure(
        self, pixel: Floats, direction: Floats, reach: float, scale: float, p: RefinementParameters
    ) -> tuple[Floats, Ints]:
        """Offsets (n,) px along the normals (-dy, dx) to the elements found (n,), -1 where there is none."""
        from vision.localisation import measure_kernels

        limits = np.array([reach, scale, p.min_cosine, p.max_beside_px])
        offset, found = np.empty(len(pixel)), np.empty(len(pixel), np.int64)
        measure_kernels.nearest_edges(
            pixel, direction, limits, self.edges.position, self.edges.normal, self.strength,
            self.start, self.order, np.array([self.columns, self.rows]), self.edges.low, offset, found,
        )  # fmt: skip
        return offset, found


@dataclass(frozen=True)
class Measurements:
    """Edge measurements of the samples of a prediction, as columns of equal length n.

    pixel (n, 2), direction (n, 2): predicted at the pose; offset (n,) px along (-dy, dx) to the edge element `found`
    (-1: none); sigma (n,) px; weight (n,) of the robust loss, 0..1, zero where the sample's component is excluded;
    slope (n,): derivative of weight times offset by the offset;
    jacobian (n, 6 + u c) of the offset's prediction by the pose and the u own unknowns of each of the c cameras.
    """

    pixel: Floats
    direction: Floats
    offset: Floats
    found: Ints
    sigma: Floats
    weight: Floats
    slope: Floats
    jacobian: Floats


def measure(
    prediction: Prediction,
    indexes: list[EdgeIndex],
    delta: Floats,
    unknowns: CameraUnknowns,
    own: Floats,
    reach: float,
    scale: float,
    votes: Bools,
    p: LocalisationParameters = DEFAULTS,
) -> Measurements:
    """What the edges say of a prediction whose pose is perturbed by `delta` (6,), given the cameras' `own`
    unknowns (c, 10), and which samples vote (n,)."""
    pixel, jacobian = project_with_jacobians(prediction, delta)
    direction = project_directions(prediction, delta)
    normal = np.stack([-direction[:, 1], direction[:, 0]], axis=1)
    offset, found = np.zeros(len(pixel)), np.full(len(pixel), -1)
    sigma = np.ones(len(pixel))
    by_camera = np.zeros((len(pixel), *own.shape))
    for number, index in enumerate(indexes):
        rows = np.flatnonzero(prediction.view == number)
        offset[rows], found[rows] = index.measure(
            np.ascontiguousarray(pixel[rows]),
            np.ascontiguousarray(direction[rows]),
            reach,
            scale,
            p.refinement,
        )
        hit = rows[found[rows] >= 0]
        edge, edges = found[hit], index.edges
        contrast = np.abs(edges.contrast[edge])
        sigma[hit] = np.sqrt(
            edges.sigma[edge] ** 2
            + p.refinement.systematic_px**2
            + (p.refinement.texture_px * index.texture / contrast) ** 2
        )
        polarity = np.sign(np.einsum("ni,ni->n", edges.normal[edge], normal[hit]))
        by_camera[hit, number] = differentiate(
            prediction,
            delta,
            hit,
            pixel[hit],
            normal[hit],
            -polarity * contrast / edges.grey_range,
            unknowns.sigma[number],
        )
        offset[hit] -= by_camera[hit, number] @ own[number]
    weight, slope = weigh(offset, prediction.tolerance_px, (found >= 0) & votes, scale)
    # What puts an arc elsewhere moves all its samples: an arc of n knows no more than its tolerance allows.
    sigma = np.sqrt(sigma**2 + prediction.tolerance_px**2 * _sum_by_arc(prediction, weight))
    own_derivative = by_camera.reshape(len(pixel), own.size)
    derivative = np.concatenate([np.einsum("ni,nij->nj", normal, jacobian), own_derivative], axis=1)
    return Measurements(pixel, direction, offset, found, sigma, weight, slope, derivative)


def weigh(offset: Floats, tolerance_px: Floats, use: Bools, scale: float) -> tuple[Floats, Floats]:
    """Weights (n,) of the robust loss of offsets (px) from arcs of that tolerance, and the derivatives of weight times
    offset by the offset; zero where they are of no use.

    Geman and McClure's loss: an element at `scale` counts a quarter, one at three times that a hundredth."""
    far = offset**2 / (scale**2 + (2 * tolerance_px) ** 2)
    return np.where(use, 1 / (1 + far) ** 2, 0.0), np.where(use, (1 - 3 * far) / (1 + far) ** 3, 0.0)


def group_by_arc(prediction: Prediction) -> Ints:
    """A number for the image of each arc in each camera (n,)."""
    unit = prediction.view * (int(prediction.arc.max(initial=0)) + 1) + prediction.arc
    return np.asarray(np.unique(unit, return_inverse=True)[1].ravel())


def _sum_by_arc(prediction: Prediction, weight: Floats) -> Floats:
    """For each sample (n,) the weight that its arc's image gathers."""
    group = group_by_arc(prediction)
    return np.asarray(np.bincount(group, weight)[group] if len(group) else weight)
