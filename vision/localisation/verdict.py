"""Accepted, ambiguous or refused: what a pose's evidence is worth against chance, rivals and its own parts.

Nothing here rests on residuals alone: a wrong pose of a box can fit as well as the right one.  The evidence that a pose
gathers is compared with what the right pose is expected to gather in these very pictures, camera by camera; with every
rival, those of repeated structure among them; and the poses that each camera gives alone are compared with each other.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from relmodel.arrays import Floats
from relmodel.geometry.transforms import skew
from vision.cameras.cameras import Prior, perturbation
from vision.localisation.evidence import Evidence
from vision.localisation.hypotheses import (
    Prediction,
    look_up_evidence,
    project_directions,
    project_with_jacobians,
)
from vision.localisation.parameters import LocalisationParameters, VerdictParameters
from vision.localisation.refine import Refined


@dataclass(frozen=True)
class Support:
    """What a pose gathers, by camera (c,): evidence found, its expectation and standard deviation at the right pose,
    and the length of predicted arcs in view (px)."""

    found: Floats
    expected: Floats
    deviation: Floats
    length_px: Floats

    @property
    def share(self) -> Floats:
        """Evidence found over expected, by camera; zero where nothing is expected."""
        return np.asarray(np.where(self.expected > 0, self.found / np.maximum(self.expected, 1e-9), 0.0))


def measure_support(prediction: Prediction, fields: list[Evidence], correlation_px: float) -> Support:
    """What a prediction gathers of the pictures' evidence at its own pose, and what the right one would."""
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

    return Support(total(w * found), total(w * mean), np.sqrt(total(w * variance)), total(w) * correlation_px)


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """A refined pose with what it gathers; cost: half its squared distance from the prior less its evidence."""

    refined: Refined
    support: Support
    prior_sigma: float

    @property
    def evidence(self) -> float:
        return float(self.support.found.sum())

    @property
    def cost(self) -> float:
        return 0.5 * self.prior_sigma**2 - self.evidence


def assess_pose(refined: Refined, fields: list[Evidence], prior: Prior, p: LocalisationParameters) -> Hypothesis:
    """The refined pose with its evidence and its distance from the prior."""
    delta = perturbation(prior.world_from_rig, refined.world_from_rig)
    distance = float(np.sqrt(delta @ np.linalg.solve(prior.covariance, delta)))
    return Hypothesis(refined, measure_support(refined.prediction, fields, p.search.correlation_px), distance)


def find_rivals(best: Hypothesis, others: list[Hypothesis], p: VerdictParameters) -> list[Hypothesis]:
    """Those of the others that pictures and prior leave about as likely as the best."""
    margin = max(p.rival_share * best.evidence, p.min_margin)

    def rivals_best(h: Hypothesis) -> bool:
        odds = 0.5 * (h.prior_sigma**2 - best.prior_sigma**2)
        return h.evidence > best.evidence - margin and odds < p.prior_odds

    return [h for h in others if rivals_best(h)]


def compute_precision(refined: Refined) -> tuple[float, float]:
    """Standard deviations along the worst directions: of the point in the middle of what is seen (mm) and of rotation
    (rad)."""
    seen = refined.prediction.point
    middle = np.median(seen, axis=0)
    jacobian = np.concatenate([-np.eye(3), skew(middle)], axis=1)
    at_middle = jacobian @ refined.covariance @ jacobian.T
    worst = np.linalg.eigvalsh(at_middle)[-1], np.linalg.eigvalsh(refined.covariance[3:, 3:])[-1]
    return float(np.sqrt(worst[0])), float(np.sqrt(worst[1]))


def compute_agreement(refined: Refined, p: VerdictParameters) -> float:
    """Share of the voters' length on which edges were found that lies within `agreement_px` of its prediction."""
    m, w = refined.measurements, refined.prediction.weight
    found = m.weight > 0
    return float(w[found & (np.abs(m.offset) < p.agreement_px)].sum() / max(w[found].sum(), 1e-9))


def compute_disagreement(poses: list[Refined]) -> float:
    """How far the poses that single cameras give lie apart: the largest distance of two, in sigmas."""
    worst = 0.0
    for i, a in enumerate(poses):
        for b in poses[:i]:
            d = perturbation(a.world_from_rig, b.world_from_rig)
            worst = max(worst, float(np.sqrt(d @ np.linalg.solve(a.covariance + b.covariance, d))))
    return worst


def decide(
    best: Hypothesis, rivals: list[Hypothesis], cameras: list[str], alone: list[Refined], p: VerdictParameters
) -> tuple[str, str]:
    """`accepted`, `ambiguous` or `refused`, and why in one sentence.

    rivals: the other hypotheses that are about as likely; alone: the poses that single cameras give, where they can.
    """
    s = best.support
    share = float(s.found.sum() / max(s.expected.sum(), 1e-9))
    sd_mm, sd_rad = compute_precision(best.refined)
    if best.evidence < p.min_evidence:
        return (
            "refused",
            f"the pictures give too little evidence for any pose ({best.evidence:.0f}, {p.min_evidence:.0f} needed)",
        )
    if share < p.min_share:
        return (
            "refused",
            f"the best pose finds {share:.0%} of the edge evidence expected of a correct one "
            f"({p.min_share:.0%} needed)",
        )
    for name, found, expected in zip(cameras, s.found, s.expected, strict=True):
        if expected > 0.5 * p.min_evidence and found < p.min_share_camera * expected:
            return (
                "refused",
                f"camera {name} finds only {found / expected:.0%} of the edge evidence expected of a correct pose",
            )
    agreeing = compute_agreement(best.refined, p)
    if agreeing < p.min_agreement:
        return (
            "refused",
            f"only {agreeing:.0%} of the edges found lie on the model's arcs ({p.min_agreement:.0%} needed)",
        )
    if best.prior_sigma > p.max_sigma:
        return "refused", f"the best pose lies {best.prior_sigma:.1f} sigma from the prior, which contradicts it"
    if rivals:
        return "ambiguous", f"{len(rivals) + 1} distinct poses explain the pictures about equally well"
    one = len(cameras) == 1
    most_mm = p.max_translation_mm_alone if one else p.max_translation_mm
    most_rad = p.max_rotation_alone if one else p.max_rotation
    if sd_mm > most_mm or sd_rad > most_rad:
        return "refused", (
            f"the pose is determined only to {sd_mm:.2g} mm and {np.degrees(sd_rad):.2g} degrees (one sigma; "
            f"{most_mm:g} mm and {np.degrees(most_rad):.2g} degrees needed)"
        )
    sigmas = compute_disagreement(alone)
    if sigmas > p.max_apart_sigma:
        return "refused", f"the cameras solved apart disagree by {sigmas:.0f} sigma"
    excluded = int(best.refined.excluded.sum())
    elsewhere = (
        f"; {excluded} components of the model are not where the model says and were left out" if excluded else ""
    )
    return "accepted", (
        f"{share:.0%} of the expected edge evidence found, no rival pose, {best.prior_sigma:.1f} sigma from the prior"
        + elsewhere
    )
