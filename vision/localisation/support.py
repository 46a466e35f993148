"""What a pose gathers of the pictures' edge evidence, against chance and against what the right pose would gather.

The evidence of a pose is the log of how much likelier the pictures' edges are with the model there than without it.
An arc of the model whose edges are looked for at n places gathers at each the log odds of what is found there
(`evidence`), and, where an edge is found, of how far off it lies.  But light and finish hide whole arcs, so an arc
either shows, with probability pi, or leaves only what chance puts there:

    E = log of the mean over pi of  product over arcs of  (pi exp(sum over its places) + 1 - pi)

A right pose has arcs that show from end to end and others that do not show at all; a wrong one finds a little of
everything.  How many arcs show in this light is not known, so pi is averaged over, camera by camera.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from relmodel.arrays import Floats
from vision.localisation.evidence import Evidence
from vision.localisation.hypotheses import (
    Prediction,
    look_up_evidence,
    project_directions,
    project_with_jacobians,
)
from vision.localisation.measurements import Measurements, group_by_arc
from vision.localisation.parameters import LocalisationParameters, SupportParameters


@dataclass(frozen=True)
class Support:
    """What a pose gathers, by camera (c,).

    evidence: log odds that the model is there; found, expected, deviation: sum of the places' log odds without regard
    to arcs, its expectation and standard deviation at the right pose; length_px: length of the predicted arcs in view.
    """

    by_camera: Floats
    found: Floats
    expected: Floats
    deviation: Floats
    length_px: Floats

    @property
    def evidence(self) -> float:
        """Log odds by all cameras together."""
        return float(self.by_camera.sum())


def measure_support(
    prediction: Prediction, m: Measurements, fields: list[Evidence], p: LocalisationParameters
) -> Support:
    """What a prediction gathers at its own pose, where `m` was measured."""
    pixel, _ = project_with_jacobians(prediction)
    direction = project_directions(prediction)
    w = prediction.weight
    found = look_up_evidence(prediction, fields, pixel, direction)
    mean, variance = np.zeros(len(w)), np.zeros(len(w))
    for number, e in enumerate(fields):
        rows = prediction.view == number
        mean[rows], variance[rows] = e.expectation(pixel[rows], direction[rows])

    def total(values: Floats) -> Floats:
        return np.bincount(prediction.view, values, minlength=len(fields)).astype(float)

    places = w * (found + score_offsets(m, p.refinement.rounds[-1][0], p.support))
    return Support(
        sum_over_arcs(prediction, places, len(fields), p.support),
        total(w * found),
        total(w * mean),
        np.sqrt(total(w * variance)),
        total(w) * p.search.correlation_px,
    )


def score_offsets(m: Measurements, reach_px: float, p: SupportParameters) -> Floats:
    """Log odds (n,) of how far off the edges found lie, against anywhere within reach; zero where none was found."""
    spread = np.hypot(p.offset_px, m.sigma)
    near = np.exp(-0.5 * (m.offset / spread) ** 2) / (spread * np.sqrt(2 * np.pi))
    odds = np.log(p.stray_share + (1 - p.stray_share) * near * 2 * reach_px)
    return np.asarray(np.where(m.found >= 0, odds, 0.0))


def sum_over_arcs(prediction: Prediction, places: Floats, cameras: int, p: SupportParameters) -> Floats:
    """The log odds (c,) by camera of the sums of the places (n,) over arcs that may not show."""
    group = group_by_arc(prediction)
    count = int(group.max(initial=-1)) + 1
    arc = np.bincount(group, places, minlength=count).astype(float)
    view = np.zeros(count, np.int64)
    view[group] = prediction.view
    shown = np.array(p.shown_shares)
    one = np.logaddexp(np.log(shown)[:, None] + arc, np.log1p(-shown)[:, None])
    by_camera = np.stack([np.bincount(view, row, minlength=cameras) for row in one]).reshape(len(shown), cameras)
    return np.asarray(np.logaddexp.reduce(by_camera, axis=0) - np.log(len(shown)))
