"""What a pose gathers of the pictures' edge evidence, against chance and against what the right pose would gather.

The evidence of a pose is the log of how much likelier the pictures' edges are with the model there than without it.
An arc of the model whose edges are looked for at n places gathers at each the log odds of what is found there
(`evidence`), and, where an edge is found, of how far off it lies.  But light and finish hide whole arcs, so an arc
either shows, with probability pi, or leaves only what chance puts there:

    E = log of the mean over pi of  product over arcs of  (pi exp(sum over its places) + 1 - pi)

A right pose has arcs that show from end to end and others that do not show at all; a wrong one finds a little of
everything.  How many arcs show in this light is not known, so pi is averaged over, camera by camera.

A placed part that is not where the model says is looked for near its place: its image may be shifted, camera by camera,
which costs the log of how many places that tries.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from relmodel.arrays import Floats, Ints
from vision.localisation.calibration import shift_pixels
from vision.localisation.evidence import Evidence
from vision.localisation.hypotheses import (
    Prediction,
    look_up_evidence,
    project_directions,
    project_with_jacobians,
)
from vision.localisation.localisation_parameters import LocalisationParameters, SupportParameters
from vision.localisation.measurements import EdgeIndex, Measurements


@dataclass(frozen=True)
class Support:
    """What a pose gathers, by camera (c,).

    evidence: log odds that the model is there; found, expected: sum of the places' log odds without regard to
    arcs, and its expectation at the right pose; length_px: length of the predicted arcs in view.
    """

    by_camera: Floats
    found: Floats
    expected: Floats
    length_px: Floats

    @property
    def evidence(self) -> float:
        """Log odds by all cameras together."""
        return float(self.by_camera.sum())


def measure_support(
    prediction: Prediction,
    m: Measurements,
    own: Floats,
    fields: list[Evidence],
    indexes: list[EdgeIndex],
    moved: Ints,
    p: LocalisationParameters,
) -> Support:
    """What a prediction gathers at its own pose, where `m` was measured with the cameras' `own` unknowns (c, 10).

    moved (n,): the occurrence of each sample that may lie elsewhere, -1 for those that are where the model says."""
    pixel, _ = project_with_jacobians(prediction)
    direction = project_directions(prediction)
    w = prediction.weight
    # Each arc is looked for where the cameras' unknowns put it, and where it lies within its tolerance.
    pixel = pixel + shift_pixels(prediction, np.zeros(6), pixel, own)
    pixel += np.stack([-direction[:, 1], direction[:, 0]], axis=1) * m.shift[:, None]
    found = look_up_evidence(prediction, fields, pixel, direction)
    mean = np.zeros(len(w))
    for number, e in enumerate(fields):
        rows = prediction.view == number
        mean[rows] = e.expectation(pixel[rows], direction[rows])

    def total(values: Floats) -> Floats:
        return np.bincount(prediction.view, values, minlength=len(fields)).astype(float)

    odds = score_offsets(m.offset - m.shift, m.edge_sigma, m.found, p)
    odds -= _share_cost_of_shifts(prediction, m.shift)
    by_camera = sum_over_arcs(prediction, w * (found + odds), len(fields), p.support)
    for occurrence in np.unique(moved[moved >= 0]):
        for number, index in enumerate(indexes):
            rows = np.flatnonzero((moved == occurrence) & (prediction.view == number))
            if len(rows):
                there = prediction.take(rows)
                here = sum_over_arcs(there, w[rows] * (found + odds)[rows], len(fields), p.support)
                displaced = _score_displaced(there, pixel[rows], direction[rows], fields, index, p)
                by_camera[number] += max(float((displaced - here).sum()) - p.support.displaced_cost, 0.0)
    return Support(by_camera, total(w * found), total(w * mean), total(w) * p.search.correlation_px)


def _share_cost_of_shifts(prediction: Prediction, shift: Floats) -> Floats:
    """Of each sample (n,) its share of what its arc's shift (px) costs under the arc's tolerance."""
    if not shift.any():
        return shift
    cost = 0.5 * (shift / np.maximum(prediction.tolerance_px, 1e-9)) ** 2
    group = prediction.image_of_arc
    return np.asarray(cost / np.maximum(np.bincount(group, prediction.weight)[group], 1e-9))


def _score_displaced(
    prediction: Prediction,
    pixel: Floats,
    direction: Floats,
    fields: list[Evidence],
    index: EdgeIndex,
    p: LocalisationParameters,
) -> Floats:
    """The log odds (c,) of samples of one camera whose image may be shifted by up to `p.support.displaced_px`, and
    then turned and scaled a little."""
    steps = np.arange(-p.support.displaced_px, p.support.displaced_px + 1e-9, 2.0)
    shifts = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    gathered = [prediction.weight @ look_up_evidence(prediction, fields, pixel + s, direction) for s in shifts]
    pixel = pixel + shifts[int(np.argmax(gathered))]
    # A displaced part is also turned, nearer or farther: a similarity of its image, about its middle.
    usual = np.array([p.support.displaced_px, p.support.displaced_px, p.support.turned, p.support.turned])
    for reach, scale in np.repeat(p.refinement.rounds, 2, axis=0).tolist():
        offset, found = index.measure(np.ascontiguousarray(pixel), direction, reach, scale, p.refinement)
        near = np.where(found >= 0, prediction.weight / (1 + (offset / scale) ** 2) ** 2, 0.0)
        arm = pixel - np.average(pixel, axis=0, weights=prediction.weight)
        moves = np.stack([*np.broadcast_to(np.eye(2)[:, None], (2, *arm.shape)), arm, arm @ [[0, 1], [-1, 0]]])
        across = np.einsum("kni,in->nk", moves, np.stack([-direction[:, 1], direction[:, 0]]))
        normal = (across * near[:, None]).T @ across + np.diag(usual**-2.0)
        step = np.linalg.solve(normal, across.T @ (near * offset))
        pixel = pixel + np.einsum("k,kni->ni", step, moves)
    offset, found = index.measure(np.ascontiguousarray(pixel), direction, reach, scale, p.refinement)
    places = look_up_evidence(prediction, fields, pixel, direction)
    places += score_offsets(offset, np.zeros(len(offset)), found, p)
    return sum_over_arcs(prediction, prediction.weight * places, len(fields), p.support)


def score_offsets(offset: Floats, sigma: Floats, found: Ints, p: LocalisationParameters) -> Floats:
    """Log odds (n,) of how far off (px) edges of that standard deviation were found, against anywhere within reach;
    zero where none was (-1)."""
    own, stray = np.hypot(p.support.offset_px, sigma), p.support.stray_share
    near = np.exp(-0.5 * (offset / own) ** 2) / (own * np.sqrt(2 * np.pi))
    odds = np.log(stray + (1 - stray) * near * 2 * p.refinement.rounds[-1][0])
    return np.asarray(np.where(found >= 0, odds, 0.0))


def sum_over_arcs(prediction: Prediction, places: Floats, cameras: int, p: SupportParameters) -> Floats:
    """The log odds (c,) by camera of the sums of the places (n,) over arcs that may not show."""
    group = prediction.image_of_arc
    count = int(group.max(initial=-1)) + 1
    arc = np.bincount(group, places, minlength=count).astype(float)
    return mix_over_arcs(arc, prediction.view_of_image, cameras, p)


def mix_over_arcs(arc: Floats, view: Ints, cameras: int, p: SupportParameters) -> Floats:
    """The log odds (..., c) by camera that arcs with sums (..., a), each in the picture of the camera view (a,), give
    where any may not show."""
    shown = np.array(p.shown_shares).reshape(-1, *np.ones(arc.ndim, int))
    one = np.logaddexp(np.log(shown) + arc, np.log1p(-shown))
    by_camera = one @ (view[:, None] == np.arange(cameras)).astype(float)
    return np.asarray(np.logaddexp.reduce(by_camera, axis=0) - np.log(len(shown)))
