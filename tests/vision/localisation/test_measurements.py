"""Measurements whose arcs are shifted as a whole, against the closed form of their mean."""

from __future__ import annotations

import numpy as np

from vision.localisation.hypotheses import Prediction
from vision.localisation.measurements import Measurements, hold_shifts


def test_the_mean_of_an_arc_counts_no_more_than_its_shift_allows() -> None:
    """One unknown that moves all edges alike, seen by a long arc and by nine short ones: its best estimate weighs their
    means by 1 / (shift^2 + sigma^2 / number)."""
    rng = np.random.default_rng(4)
    number, shift, sigma = np.array([400] + [10] * 9), 0.2, 0.3
    arc = np.repeat(np.arange(10), number)
    n = len(arc)
    offset = (1.0 + rng.normal(0, shift, 10))[arc] + rng.normal(0, sigma, n)
    none, zero = np.zeros(n), np.zeros((n, 3))
    prediction = Prediction(
        zero, zero, np.ones(n), none, np.zeros(n, np.int64), arc, np.eye(3)[None], np.zeros((1, 3)), np.eye(3)[None, :2]
    )
    m = Measurements(
        zero[:, :2], zero[:, :2], none, offset, np.arange(n), none + sigma, none + sigma, np.ones(n), np.ones(n),
        none + shift, np.ones((n, 1)),
    )  # fmt: skip
    held = hold_shifts(m, prediction)
    estimate = float(held.jacobian[:, 0] @ held.offset / (held.jacobian[:, 0] @ held.jacobian[:, 0]))
    mean = np.bincount(arc, offset) / number
    weight = 1 / (shift**2 + sigma**2 / number)
    np.testing.assert_allclose(estimate, weight @ mean / weight.sum(), rtol=1e-12)
    # As sure as that, and not as sure as all edges alike would be.
    np.testing.assert_allclose((held.jacobian**2).sum() / sigma**2, weight.sum(), rtol=1e-12)
