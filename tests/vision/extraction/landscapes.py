"""Landscapes of Gaussian hills, whose smoothed derivatives are closed forms, and the labels that follow from these."""

from dataclasses import dataclass

import numpy as np

from relmodel.arrays import Bools, Floats, Ints
from vision.extraction.topography import LABELS


@dataclass(frozen=True)
class Landscape:
    """Sum of elliptic Gaussian hills (n,) on a slope: heights (grey), centres (px), inverse covariances (n, 2, 2)."""

    base: float
    slope: Floats
    height: Floats
    centre: Floats
    covariance: Floats

    def smoothed(self, sigma: float) -> "Landscape":
        """The same after smoothing by a Gaussian of `sigma` px: hills widen and sink, planes stay."""
        wider = self.covariance + sigma**2 * np.eye(2)
        sink = np.sqrt(np.linalg.det(self.covariance) / np.linalg.det(wider))
        return Landscape(self.base, self.slope, self.height * sink, self.centre, wider)

    def jet(self, points: Floats) -> tuple[Floats, Floats, Floats]:
        """Value (m,), gradient (m, 2) and Hessian (m, 2, 2) at points (m, 2) as x, y."""
        inverse = np.linalg.inv(self.covariance)
        away = points[:, None, :] - self.centre
        pull = np.einsum("nij,mnj->mni", inverse, away)
        hill = self.height * np.exp(-0.5 * np.einsum("mni,mni->mn", pull, away))
        value = self.base + points @ self.slope + hill.sum(axis=1)
        gradient = self.slope - np.einsum("mn,mni->mi", hill, pull)
        hessian = np.einsum("mn,mni,mnj->mij", hill, pull, pull) - np.einsum("mn,nij->mij", hill, inverse)
        return value, gradient, hessian


def random_landscape(rng: np.random.Generator, size: int) -> Landscape:
    """Round hills and hollows, long ridges and ravines, on a slope; about `size` px square."""
    n = 14
    angle, major, minor = rng.uniform(0, np.pi, n), rng.uniform(4, 30, n), rng.uniform(3, 8, n)
    turn = np.stack([np.cos(angle), -np.sin(angle), np.sin(angle), np.cos(angle)], axis=1).reshape(n, 2, 2)
    covariance = turn @ (np.stack([major**2, minor**2], axis=1)[:, :, None] * np.swapaxes(turn, 1, 2))
    height = rng.uniform(30, 90, n) * rng.choice([-1.0, 1.0], n)
    return Landscape(120.0, rng.normal(0, 0.2, 2), height, rng.uniform(0, size, (n, 2)), covariance)


def labels_of(land: Landscape, size: int, min_slope: float, min_bend: float, margin: float) -> tuple[Ints, Bools]:
    """Labels of the pixels of a smoothed landscape and which of them are clear: no decision within `margin` (relative
    for thresholds, px for the place of an extremum).

    Along each eigenvector of the Hessian the first directional derivative is sampled densely across the pixel; where it
    changes sign there is an extremum.
    """
    y, x = np.mgrid[:size, :size].astype(np.float64)
    points = np.column_stack([x.ravel(), y.ravel()])
    _, gradient, hessian = land.jet(points)
    value, vector = np.linalg.eigh(hessian)
    m = len(points)
    signs, hills, clear = np.zeros((m, 2), int), np.zeros((m, 2), int), np.ones(m, bool)

    def near(quantity: Floats, threshold: float) -> Bools:
        return np.asarray(np.abs(np.abs(quantity) / threshold - 1.0) < margin)

    for side in range(2):
        along = vector[:, :, side]
        half = 0.5 / np.abs(along).max(axis=1)
        clear &= ~near(value[:, side], min_bend)
        hills[:, side] = np.where(np.abs(value[:, side]) > min_bend, np.sign(value[:, side]), 0)
        steps = np.linspace(-1.0 - 2 * margin, 1.0 + 2 * margin, 81)
        slopes, bends = np.empty((m, 81)), np.empty((m, 81))
        for k, step in enumerate(steps):
            _, g, h = land.jet(points + (step * half)[:, None] * along)
            slopes[:, k] = np.einsum("mi,mi->m", g, along)
            bends[:, k] = np.einsum("mi,mij,mj->m", along, h, along)
        crossing = slopes[:, :-1] * slopes[:, 1:] <= 0.0
        found = crossing.any(axis=1)
        nearest = np.where(crossing, np.abs(steps[:-1]), 9.0).argmin(axis=1)
        place, bend = np.abs(steps[nearest]), bends[np.arange(m), nearest]
        inside = found & (place <= 1.0)
        clear &= ~(found & (np.abs(place - 1.0) < 2 * margin) & (np.abs(bend) > 0.5 * min_bend))
        clear &= ~(inside & near(bend, min_bend))
        signs[:, side] = np.where(inside & (np.abs(bend) > min_bend), np.sign(bend), 0)
    slope = np.hypot(*gradient.T)
    both, total, bent = signs.prod(axis=1), signs.sum(axis=1), hills.sum(axis=1)
    names = np.select(
        [
            (both > 0) & (total < 0),
            both > 0,
            both < 0,
            total < 0,
            total > 0,
            hills.prod(axis=1) < 0,
            bent > 0,
            bent < 0,
            slope <= min_slope,
        ],
        ["peak", "pit", "saddle", "ridge", "ravine", "saddle_hill", "convex", "concave", "flat"],
        "slope",
    )
    clear &= ~((names == "flat") | (names == "slope")) | ~near(slope, min_slope)
    return np.array([LABELS.index(name) for name in names]).reshape(size, size), clear.reshape(size, size)
