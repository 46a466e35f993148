"""Accepted, ambiguous or refused: how likely the best pose is the right one, and whether it is known well enough.

Nothing here rests on residuals alone: a wrong pose of a box can fit as well as the right one.  The posterior weighs the
evidence of the best pose against chance in a search of that many poses, the share of the model's edges that show, how
closely the edges found lie on them, and the greys on both sides of the model's outline; its weights come from trials
with known truth (benchmarks/verdict.py).  Rivals, those of repeated structure among them, take their share of it.
Poses that single cameras give may not lie apart.  An accepted pose is also as sure as the user needs it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from relmodel.arrays import Floats
from relmodel.geometry.transforms import skew
from vision.cameras.cameras import Needs, perturbation
from vision.localisation.parameters import VerdictParameters
from vision.localisation.refine import Refined

AXES = ("x", "y", "z")


@dataclass(frozen=True)
class Verdict:
    """What is to be thought of the best pose.

    verdict: accepted | ambiguous | refused; reason: why; posterior: probability that the best pose is the right one;
    missing: what was missing for acceptance, a sentence each.  sigma_mm, sigma_rad: standard deviations along the worst
    directions, of the point in the middle of what is seen and of rotation; weakest: the worst direction in words.
    """

    verdict: str
    reason: str
    posterior: float
    missing: list[str]
    sigma_mm: float
    sigma_rad: float
    weakest: str


def find_rivals(best: Refined, others: list[Refined], p: VerdictParameters) -> list[Refined]:
    """Those of the others that pictures and prior leave about as likely as the best.

    What edges are found is compared without regard to arcs: a whole arc that one of two poses leaves without an edge
    tells them apart, however many arcs light may hide.  Printed edges may be found as well as the object's own: the
    greys beside the outlines count with them."""

    def found(h: Refined) -> float:
        return float(h.support.found.sum()) + (h.outlines.evidence if h.outlines else 0.0)

    most = found(best)
    margin = max(p.rival_share * most, p.min_margin)

    def rivals_best(h: Refined) -> bool:
        odds = 0.5 * (h.prior_sigma**2 - best.prior_sigma**2)
        return found(h) > most - margin and odds < p.prior_odds

    return [h for h in others if rivals_best(h)]


def compute_precision(refined: Refined) -> tuple[float, float, str]:
    """Standard deviations along the worst directions, of the point in the middle of what is seen (mm) and of rotation
    (rad), and the worst direction in words, in the rig's axes."""
    seen = refined.prediction.point
    middle = np.median(seen, axis=0) if len(seen) else np.zeros(3)
    to_middle = np.eye(6)
    to_middle[:3, 3:] = -skew(middle)
    covariance = to_middle @ refined.covariance @ to_middle.T
    shift, turn = np.linalg.eigh(covariance[:3, :3]), np.linalg.eigh(covariance[3:, 3:])
    sigma_mm, sigma_rad = float(np.sqrt(shift[0][-1])), float(np.sqrt(turn[0][-1]))
    weakest = f"shift along {_name_axis(shift[1][:, -1])}, turn about {_name_axis(turn[1][:, -1])} of the rig"
    return sigma_mm, sigma_rad, weakest


def _name_axis(direction: Floats) -> str:
    """The axes that make up most of a direction (3,): `z`, or `x and z`."""
    share = direction**2
    order = np.argsort(-share, kind="stable")
    count = int(np.searchsorted(np.cumsum(share[order]), 0.75)) + 1
    return " and ".join(AXES[i] for i in sorted(order[:count].tolist()))


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


@dataclass(frozen=True)
class Signs:
    """What speaks for and against a pose, as the posterior weighs it.

    evidence: log odds of the edges against chance; prior_sigma: distance from the prior; share: evidence found over
    what the right pose is expected to find; agreement: share of the edges found that lie on the arcs; outline_px,
    outline_contrast: length of the outlines against the background and the contrast of greys beside them; apart: sigmas
    between the poses that single cameras give."""

    evidence: float
    prior_sigma: float
    share: float
    agreement: float
    outline_px: float
    outline_contrast: float
    apart: float

    def columns(self, p: VerdictParameters) -> Floats:
        """The signs (4,) that the posterior weighs: the evidence less what the prior takes off beyond what it takes off
        the right pose in the mean; share; agreement; and what the outlines say, where there are any."""
        left = self.evidence - 0.5 * (self.prior_sigma**2 - 6)
        against_chance = np.log(max(left, 1.0) / p.chance_evidence)
        outlined = self.outline_px / (self.outline_px + p.usual_outline_px)
        contrast = min(self.outline_contrast, p.most_contrast) - p.neutral_contrast
        return np.array([against_chance, min(self.share, p.most_share), self.agreement, outlined * contrast])

    def log_odds(self, p: VerdictParameters) -> float:
        """Log odds of the pose by these signs."""
        return float(p.offset + np.array(p.weights) @ self.columns(p))


def read_signs(best: Refined, alone: list[Refined], p: VerdictParameters) -> Signs:
    """The signs of a pose, of which single cameras give the poses `alone`."""
    s, outlines = best.support, best.outlines
    return Signs(
        best.evidence,
        best.prior_sigma,
        float(s.found.sum() / max(float(s.expected.sum()), 1e-9)),
        compute_agreement(best, p),
        outlines.total_px if outlines else 0.0,
        outlines.mean if outlines else 0.0,
        compute_disagreement(alone),
    )


def decide(best: Refined, rivals: list[Refined], alone: list[Refined], needs: Needs, p: VerdictParameters) -> Verdict:
    """What to think of the best pose: rivals are the other hypotheses that are about as likely, `alone` the poses that
    single cameras give, where there are several."""
    signs = read_signs(best, alone, p)
    odds = signs.log_odds(p)
    # Rivals share what the best has in proportion to prior and evidence, which is tempered: neighbouring edges err
    # together.
    believed = np.array([0.5 * h.prior_sigma**2 for h in (best, *rivals)])
    costs = p.temper * (np.array([h.cost for h in (best, *rivals)]) - believed) + believed
    share = 1.0 / float(np.exp(-(costs - costs[0])).sum())
    likely = 1.0 / (1.0 + float(np.exp(-odds)))
    posterior = share * likely
    sigma_mm, sigma_rad, weakest = compute_precision(best)
    missing = []
    if likely < p.min_posterior:
        missing.append(
            f"the pictures do not show the model there surely enough: evidence of {signs.evidence:.0f} against chance, "
            f"{signs.share:.0%} of the edges expected, {signs.agreement:.0%} of those found lie on the model's, "
            f"contrast of {signs.outline_contrast:.1f} along {signs.outline_px:.0f} px of outline"
            + (f", cameras solved apart {signs.apart:.1f} sigma from each other" if alone else "")
        )
    if best.prior_sigma > p.max_sigma:
        missing.append(f"the pose lies {best.prior_sigma:.1f} sigma from the prior, which contradicts it")
    if signs.apart > p.max_apart_sigma:
        missing.append(f"the cameras solved apart disagree by {signs.apart:.0f} sigma: check the rig's calibration")
    if 2 * sigma_mm > needs.translation_mm or 2 * sigma_rad > needs.rotation:
        missing.append(
            f"the pose is known to {2 * sigma_mm:.2g} mm and {np.degrees(2 * sigma_rad):.2g} degrees (two sigma; "
            f"{needs.translation_mm:g} mm and {np.degrees(needs.rotation):.2g} degrees needed), worst: {weakest}"
        )
    if rivals:
        missing.append(f"{len(rivals) + 1} distinct poses explain the pictures about equally well")
    excluded = int(best.excluded.sum())
    if not missing:
        verdict, reason = (
            "accepted",
            (
                f"probability {_percent(posterior)}: {signs.share:.0%} of the expected edge evidence found, "
                f"no rival pose, {best.prior_sigma:.1f} sigma from the prior"
            ),
        )
        if excluded:
            reason += f"; {excluded} components of the model are not where the model says and were left out"
    else:
        verdict = "ambiguous" if rivals and len(missing) == 1 else "refused"
        reason = "; ".join(missing)
    return Verdict(verdict, reason, posterior, missing, sigma_mm, sigma_rad, weakest)


def _percent(probability: float) -> str:
    """A probability in percent, never rounded up to certainty."""
    return "> 99.9 %" if probability > 0.999 else f"{100 * probability:.1f} %"
