"""How far surfaces lie from where the model has them, by least squares of the edge elements near their edges.

Of a surface that bends around, as a bore does, the displacement along its own normals is separated from a shift in the
plane that its normals span, which the pose's error makes as well: what remains is half a diameter.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from relmodel.arrays import Bools, Floats, Ints, sum_by_group
from vision.presence.moved import Readings
from vision.presence.presence_parameters import SizeParameters
from vision.presence.samples import Samples
from vision.presence.support import Support


@dataclass(frozen=True)
class Offsets:
    """Surfaces measured, as columns: surface; mm: displacement outward; sigma (mm); closed: whether its normals span a
    plane, so that a shift was separated; shift (m, 3): that shift in the world, mm; shift_sigma (mm); weight_px: of
    the edges measured."""

    surface: Ints
    mm: Floats
    sigma: Floats
    closed: Bools
    shift: Floats
    shift_sigma: Floats
    weight_px: Floats


def measure_offsets(
    samples: Samples,
    support: Support,
    readings: Readings,
    surface: Ints,
    start_mm: Floats,
    shift: Floats,
    p: SizeParameters,
) -> Offsets:
    """Displacements of surfaces (m,), ascending, from the elements near `start_mm` (m,) and the `shift` (m, 3)
    tried."""
    count = len(surface)
    at = np.minimum(np.searchsorted(surface, readings.surface), max(count - 1, 0))
    rows = np.flatnonzero(surface[at] == readings.surface) if count else np.zeros(0, np.int64)
    group, sample, side = at[rows], readings.sample[rows], readings.side[rows]
    ahead = start_mm[group] + np.einsum("ni,ni->n", samples.normal[sample, side], shift[group])
    left = np.abs(readings.mm[rows] - ahead) * np.abs(samples.px_per_mm[sample, side])
    # Of a sample's elements, which stand together, the nearest.
    begins = np.diff(sample * 2 + side, prepend=-1) != 0
    least = np.minimum.reduceat(left, np.flatnonzero(begins)) if len(left) else left
    nearest = np.flatnonzero(left == least[np.cumsum(begins) - 1])
    nearest = nearest[np.diff((sample * 2 + side)[nearest], prepend=-1) != 0]
    near = nearest[left[nearest] <= p.reach_px]
    group, sample, side, mm = group[near], sample[near], side[near], readings.mm[rows][near]
    normal, rate, length = samples.normal[sample, side], samples.px_per_mm[sample, side], support.weight[sample]
    count_of = length / p.stretch_px

    spread = sum_by_group(group, normal[:, :, None] * normal[:, None, :], count, length)
    total = np.bincount(group, length, count)
    value, vector = np.linalg.eigh(spread / np.maximum(total, 1e-9)[:, None, None])
    mean = sum_by_group(group, normal, count, length) / np.maximum(total, 1e-9)[:, None]
    closed = (np.linalg.norm(mean, axis=1) < p.most_mean_normal) & (value[:, 1] > p.least_spread)
    plane = np.where(closed[:, None, None], vector[:, :, 1:], 0.0)

    design = np.concatenate([np.ones((len(near), 1)), (normal[:, None] @ plane[group])[:, 0]], axis=1)
    equations = np.concatenate([design[:, :, None] * design[:, None, :], (design * mm[:, None])[..., None]], axis=2)
    solution = np.concatenate([start_mm[:, None], np.einsum("mi,mij->mj", shift, plane)], axis=1)
    hessian = np.tile(np.eye(3), (count, 1, 1))
    weight = count_of.copy()
    for _ in range(p.steps):
        residual = (mm - np.einsum("ni,ni->n", design, solution[group])) * rate
        weight = count_of / (1 + (residual / p.scale_px) ** 2) ** 2
        sums = sum_by_group(group, equations, count, weight * rate**2)
        hessian, gradient = sums[:, :, :3] + 1e-9 * np.eye(3), sums[:, :, 3]
        solution = np.linalg.solve(hessian, gradient[..., None])[..., 0]
    variance = (np.bincount(group, weight * residual**2, count) + p.floor_px**2) / np.maximum(
        np.bincount(group, weight, count), 1.0
    ) + p.floor_px**2
    covariance = np.linalg.inv(hessian)
    rates = np.bincount(group, weight * np.abs(rate), count) / np.maximum(np.bincount(group, weight, count), 1e-9)
    systematic = p.systematic_px / np.maximum(rates, 1e-9)
    sigma = np.sqrt(covariance[:, 0, 0] * variance + systematic**2)
    shift_sigma = np.sqrt(covariance[:, 1:, 1:].diagonal(axis1=1, axis2=2).max(axis=1) * variance + systematic**2)
    measured = np.bincount(group, length * (np.abs(residual) < 3 * p.scale_px), count).astype(float)
    return Offsets(
        surface, solution[:, 0], sigma, closed, np.einsum("mij,mj->mi", plane, solution[:, 1:]),
        np.where(closed, shift_sigma, np.nan), measured,
    )  # fmt: skip
