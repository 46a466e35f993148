"""Accepted, ambiguous or refused: how likely the best pose is the right one, and whether it is known well enough."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace

import numpy as np

from relmodel.arrays import Bools, Floats, Ints
from relmodel.geometry.transforms import carry, inverse, skew
from vision.cameras.cameras import Needs, Prior, Rig, perturb, perturbation
from vision.localisation.hypotheses import Fields, Prediction, gather_evidence, project_with_jacobians
from vision.localisation.localisation_parameters import ElsewhereParameters, LocalisationParameters, VerdictParameters
from vision.localisation.measurements import CALIBRATION_PX, PLACE, RESPONSE, UNKNOWNS, describe_unknowns
from vision.localisation.refine import RefinedPose, Shown
from vision.localisation.support import GreyGrid, measure_shifted_outlines, mix_over_arcs
from vision.scene import Scene

# Cluttered pictures and models that repeat give any pose much evidence, a plain one little. So poses are drawn anew
# about the best one, each so far off that the image of what is seen lies elsewhere, and gather what they gather:
# evidence of edges, arc by arc, and of outlines. How much a quarter of them exceeds, and by how much in the mean, tells
# how rarely any would gather as much as the best (the excess over a high threshold is about exponential; Pickands
# 1975).


@dataclass(frozen=True)
class Chance:
    """What poses elsewhere gather: a pose in exp((evidence - level) / scale) of them as much, log odds."""

    level: float
    scale: float

    @classmethod
    def of(cls, gathered: Floats, p: ElsewhereParameters, mean: float = 0.0, deviation: float = 0.0) -> Chance:
        """By what poses (n,) gathered, and the mean and deviation of what they gather besides."""
        threshold = float(np.quantile(gathered, 1 - p.share))
        above = gathered[gathered > threshold]
        excess = float(above.mean()) - threshold if len(above) else 0.0
        scale = float(np.hypot(max(excess, p.least_scale), deviation))
        return cls(threshold + mean + scale * float(np.log(p.share)), scale)

    def rarity(self, evidence: float) -> float:
        """How rarely a pose elsewhere gathers as much: minus the logarithm of the share of poses that do."""
        return (evidence - self.level) / self.scale

    def reached(self, rarity: float) -> float:
        """What a pose of that rarity gathers."""
        return self.level + self.scale * rarity


@dataclass(frozen=True)
class Elsewhere:
    """What poses elsewhere gather: by edges and outlines of all pictures, and by each camera's edges, in rig order."""

    together: Chance
    by_camera: list[Chance]


def gather_elsewhere(
    scene: Scene,
    rig: Rig,
    prediction: Prediction,
    fields: Fields,
    greys: Sequence[GreyGrid],
    world_from_rig: Floats,
    p: LocalisationParameters,
) -> Elsewhere:
    """What the model gathers elsewhere than at a pose; `prediction`: what is seen from there, nothing perhaps."""
    if not len(prediction.point):
        nothing = Chance(0.0, p.elsewhere.least_scale)
        return Elsewhere(nothing, [nothing] * len(fields))
    delta = draw_elsewhere(prediction, p.elsewhere)
    arcs = gather_evidence(prediction, fields, delta)
    edges = mix_over_arcs(arcs, prediction.view_of_image, len(fields))
    shifts = draw_shifts(len(fields), p.elsewhere)
    outlines = measure_shifted_outlines(scene, rig, greys, world_from_rig, shifts)
    # Edges and outlines have little to do with each other.
    together = Chance.of(edges.sum(axis=1), p.elsewhere, float(outlines.mean()), float(outlines.std()))
    return Elsewhere(together, [Chance.of(own, p.elsewhere) for own in edges.T])


def draw_shifts(cameras: int, p: ElsewhereParameters) -> Floats:
    """Shifts (n, c, 2) of the pictures' outlines by `near_px` to `far_px`."""
    rng = np.random.default_rng(p.seed)
    angle = rng.uniform(0, 2 * np.pi, (p.outlined, cameras))
    far = rng.uniform(p.near_px, p.far_px, (p.outlined, cameras))
    return np.stack([far * np.cos(angle), far * np.sin(angle)], axis=2)


def draw_elsewhere(prediction: Prediction, p: ElsewhereParameters) -> Floats:
    """Perturbations (n, 6) by which the image of what is seen moves, in any way, by `near_px` to `far_px` (rms)."""
    _, jacobian = project_with_jacobians(prediction)
    depth = float(np.median(np.linalg.norm(prediction.point, axis=1)))
    unit = np.repeat([depth, 1.0], 3)
    square = np.einsum("nij,nik->jk", jacobian * unit, jacobian * unit) / len(jacobian)
    value, vector = np.linalg.eigh(square)
    # What moves the image next to nothing does not have to move it so far.
    step = vector / np.sqrt(np.maximum(value, p.least_px_per_unit**2))
    rng = np.random.default_rng(p.seed)
    way = rng.normal(size=(p.poses, 6))
    far = rng.uniform(p.near_px, p.far_px, p.poses) / np.linalg.norm(way, axis=1)
    return np.asarray((way * far[:, None]) @ step.T * unit)


# Nothing here rests on residuals alone: a wrong pose of a box can fit as well as the right one. Two questions have two
# answers. Whether the object is there, about here, says a posterior. It weighs how rarely poses elsewhere gather as
# much in these very pictures (verdict.py), the share of the model's edges that show, how closely the edges found lie
# on them, and how near the prior the pose lies; its weights come from trials with known truth (benchmarks/verdict.py).
# How exactly says the covariance. Rivals take their share of the posterior. Each camera must see the model by itself,
# and the poses that single cameras give must agree. An accepted pose is also as precise as the user needs it.

AXES = ("x", "y", "z")


@dataclass(frozen=True)
class Verdict:
    """The verdict on the best pose.

    verdict: accepted | ambiguous | refused; reason: why; posterior: probability that the best pose is the right one;
    missing: what was missing for acceptance, a sentence each.  sigma_mm, sigma_rad: standard deviations along the worst
    directions, of the point in the middle of what is seen and of rotation; weakest: the worst direction in words.
    weighed: what was weighed, by name; empty where nothing is in view.  blind: by camera that does not see the model, a
    sentence on it.  rig: how the pictures say that the rig is, where surely not as its file says."""

    verdict: str
    reason: str
    posterior: float
    missing: list[str]
    sigma_mm: float
    sigma_rad: float
    weakest: str
    weighed: dict[str, float] = field(default_factory=dict)
    blind: Mapping[str, str] = field(default_factory=dict)
    rig: str | None = None

    def refused(self, *words: str) -> Verdict:
        """The same, refused for that first."""
        missing = [*words, *self.missing]
        return replace(self, verdict="refused", reason="; ".join(missing), missing=missing)

    def limited(self, name: str, value: float, words: str, most: float) -> Verdict:
        """The same with a statistic of that name weighed; refused in these words where it exceeds `most`."""
        it = replace(self, weighed=self.weighed | {name: value})
        return it if value <= most else it.refused(words)

    def ambiguous(self, words: str) -> Verdict:
        """The same, ambiguous for that too."""
        missing = [*self.missing, words]
        return replace(self, verdict="ambiguous", reason="; ".join(missing), missing=missing)


@dataclass(frozen=True)
class HypothesisTable:
    """What hypotheses gather, as columns (h,).

    prior_sigma: distance from the prior, NaN where there is none; evidence: log odds of the edges;
    found, expected: sum of the places' log odds without regard to arcs, and its expectation at the right pose;
    outline_px, outline_contrast, outline_evidence: length of the outlines against the background, contrast of the greys
    beside them, and the log odds that they are outlines; is_symmetric: whether a symmetry of the model leads there from
    the best; told: log odds of the account of all edges, NaN where it was not asked; strain: as of a refined pose."""

    prior_sigma: Floats
    evidence: Floats
    found: Floats
    expected: Floats
    outline_px: Floats
    outline_contrast: Floats
    outline_evidence: Floats
    is_symmetric: Bools
    told: Floats
    strain: Floats | float = 0.0

    @classmethod
    def of(cls, hypotheses: Sequence[RefinedPose]) -> HypothesisTable:
        rows = [
            (
                h.prior_sigma, h.evidence, h.support.found.sum(), h.support.expected.sum(),
                *((h.outlines.total_px, h.outlines.mean, h.outlines.evidence) if h.outlines else (0.0, 0.0, 0.0)),
                h.is_symmetric, h.told, h.strain,
            )
            for h in hypotheses
        ]  # fmt: skip
        return cls(*(np.array(column) for column in zip(*rows, strict=True)))

    @property
    def believed(self) -> Floats:
        """Half of the distance from the prior squared, 0 where there is none, and the strain."""
        return np.nan_to_num(0.5 * self.prior_sigma**2) + self.strain

    @property
    def cost(self) -> Floats:
        """What the prior takes off, less the evidence of edges and outlines."""
        return np.asarray(self.believed - self.evidence - self.outline_evidence)

    @property
    def share(self) -> Floats:
        """Evidence found over what the right pose is expected to find."""
        return np.asarray(self.found / np.maximum(self.expected, 1e-9))


def find_standing(g: HypothesisTable, p: VerdictParameters) -> Ints:
    """The hypothesis of least cost and those that pictures and prior leave about as likely; nearest the prior first,
    and without those that a symmetry of the model makes of it.

    What edges are found is compared without regard to arcs: a whole arc that one of two poses leaves without an edge
    tells them apart, however many arcs light may hide.  Printed edges may be found as well as the object's own: the
    greys beside the outlines count with them.  Where the account of edges speaks for the best as well, and much more
    than for another, that is no rival; where it speaks against the best, which a print may cause, both stand."""
    first, *others = np.argsort(g.cost, kind="stable").tolist()
    found = g.found + g.outline_evidence
    near = found > found[first] - max(p.rival_share * found[first], p.min_margin)
    near &= ~(g.told <= g.told[first] - p.rival_odds)  # NaN: not asked
    near &= g.believed - g.believed[first] < p.prior_odds
    standing = np.array([first, *(h for h in others if near[h])])
    standing = standing[~g.is_symmetric[standing]]
    return np.asarray(standing[np.argsort(g.believed[standing], kind="stable")])


def compute_precision(covariance: Floats, middle: Floats) -> tuple[float, float, str]:
    """Standard deviations along the worst directions, of the point in the middle of what is seen (mm) and of rotation
    (rad), and the worst direction in words, in the rig's axes; covariance (6, 6) and middle (3,) in its frame."""
    to_middle = np.eye(6)
    to_middle[:3, 3:] = -skew(middle)
    covariance = to_middle @ covariance @ to_middle.T
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


def measure_agreement(best: RefinedPose, p: VerdictParameters, camera: int | None = None) -> float:
    """Share of the length on which edges were found, that of parts left out with it, in one camera's picture or in all,
    that lies within `agreement_px` of its prediction."""
    m, of_camera = best.measurements, True if camera is None else best.prediction.view == camera
    rows = (m.found >= 0) & of_camera
    length = best.prediction.weight[rows]
    return float(length[np.abs(m.offset[rows]) < p.agreement_px].sum() / max(length.sum(), 1e-9))


def measure_disagreement(own: Mapping[str, RefinedPose], best: RefinedPose, rig: Rig, p: VerdictParameters) -> float:
    """How far the cameras disagree on the pose, in sigmas: the farthest pose of those that cameras give by themselves
    and gather more at than at the joint one; where standpoints are corrected too, by what they gain.

    Of n cameras that know about as much the joint pose has an n-th of the variance of one, and their difference that of
    one less that (Hausman, 1978)."""
    joint, squares = best.support.by_camera.tolist(), [0.0]
    if rig.moved is not None and own:
        return compute_disagreement([h.evidence for h in own.values()], joint, p)
    for h in (h for h, there in zip(own.values(), joint, strict=False) if h.evidence > there):
        apart = perturbation(best.world_from_rig, h.world_from_rig)
        squares.append(float(apart @ np.linalg.solve(h.covariance + best.covariance, apart)))
    return math.sqrt(np.max(squares) * (len(own) + 1) / max(len(own) - 1, 1))


def compute_disagreement(own: Sequence[float], joint: Sequence[float], p: VerdictParameters) -> float:
    """The same by the signed root of the likelihood ratio (Wilks) of the evidence that each camera gathers at the pose
    it gives by itself against what it gathers at the joint one; of more than two, as improbable a root of two.

    Poses see different samples of the model: `own_share` of the evidence is no sign of anything."""
    from scipy.special import chdtrc, chdtri

    gained = sum(max(a - b, 0.0) for a, b in zip(own, joint, strict=True))
    square = 2 * max(gained - p.own_share * max(sum(joint), 0.0), 0.0)
    chance = float(chdtrc(6 * (len(own) - 1), square)) if len(own) > 2 else 0.0
    return math.sqrt(chdtri(6, chance) if chance > 0 else square)


@dataclass(frozen=True)
class VerdictStatistics:
    """What speaks for and against a pose, as the posterior weighs it.

    evidence: log odds of edges and outlines; rarity: how rarely poses elsewhere gather as much; prior_sigma: distance
    from the prior, NaN where there is none; share: evidence found over what the right pose is expected to find;
    agreement: share of the edges found that lie on the arcs; outline_px, outline_contrast: length of the outlines
    against the background and the contrast of greys beside them; apart: sigmas by which the cameras disagree."""

    evidence: float
    rarity: float
    prior_sigma: float
    share: float
    agreement: float
    outline_px: float
    outline_contrast: float
    apart: float

    def columns(self, p: VerdictParameters) -> Floats:
        """The statistics (4,) that the posterior weighs: rarity; share; agreement; and what the prior takes off beyond
        what it takes off the right pose in the mean."""
        beyond = max(float(np.nan_to_num(0.5 * (self.prior_sigma**2 - 6))), 0.0)
        return np.array([min(self.rarity, p.most_rarity), min(self.share, p.most_share), self.agreement, -beyond])

    def log_odds(self, p: VerdictParameters) -> float:
        """Log odds of the pose by these statistics; evidence that a search reaches by chance says nothing for it, nor
        does little of what is expected."""
        odds = float(p.offset + np.array(p.weights) @ self.columns(p))
        return odds if self.rarity > p.searched_rarity and self.share >= p.least_share else min(odds, 0.0)


@dataclass(frozen=True)
class CameraSupport:
    """What one camera of several gathers at the best pose, as `Support` and `measure_agreement` have it, and what poses
    elsewhere gather in its picture."""

    evidence: float
    found: float
    expected: float
    agreement: float
    chance: Chance

    def log_odds(self, p: VerdictParameters) -> float:
        """Log odds that the camera sees the model, weighed as a pose is; the prior has no part in it."""
        share = self.found / max(self.expected, 1e-9)
        rarity = self.chance.rarity(self.evidence)
        return VerdictStatistics(self.evidence, rarity, np.nan, share, self.agreement, 0.0, 0.0, 0.0).log_odds(p)

    def tells(self, p: VerdictParameters) -> bool:
        """Whether enough of the model is expected in it for a camera that finds it all to be told from a blind one."""
        return replace(self, evidence=self.expected, found=self.expected, agreement=1.0).log_odds(p) > 0

    def is_blind(self, p: VerdictParameters) -> bool:
        """Whether it sees nothing of the model where it would tell."""
        return self.tells(p) and self.log_odds(p) < p.least_camera_odds


def support_by_camera(
    best: RefinedPose, cameras: Sequence[str], elsewhere: Elsewhere, p: VerdictParameters
) -> dict[str, CameraSupport]:
    """What each of several cameras gathers at a pose; nothing for one alone, whose support is that of the pose."""
    if len(cameras) < 2:
        return {}
    it, chances = best.support, elsewhere.by_camera
    each = zip(cameras, it.by_camera.tolist(), it.found.tolist(), it.expected.tolist(), chances, strict=True)
    return {
        name: CameraSupport(evidence, found, expected, measure_agreement(best, p, number), chance)
        for number, (name, evidence, found, expected, chance) in enumerate(each)
    }


def decide(
    hypotheses: Sequence[RefinedPose],
    standing: Ints,
    by_camera: Mapping[str, RefinedPose],
    elsewhere: Elsewhere,
    rig: Rig,
    needs: Needs,
    p: VerdictParameters,
) -> Verdict:
    """The verdict on the first of the hypotheses that stand; `by_camera`: the poses that single cameras give, in the
    rig's order, where there are several; `elsewhere`: what poses elsewhere gather."""
    best = hypotheses[standing[0]]
    misfits = [find_misfit(rig, best.shown)] if best.shown else []
    misfits += [it.misfit for it in compare_standpoints(rig, best).values()]
    evidence = PoseEvidence(
        measure_agreement(best, p),
        measure_disagreement(by_camera, best, rig, p),
        support_by_camera(best, list(by_camera), elsewhere, p),
        elsewhere.together,
        compute_precision(best.covariance, best.middle),
        int(best.excluded.sum()),
        max(filter(None, misfits), key=lambda it: it.sigmas / it.limit(len(by_camera), p), default=None),
    )
    return judge(HypothesisTable.of(hypotheses), standing, evidence, needs, p)


@dataclass(frozen=True)
class Misfit:
    """By how many standard deviations the pictures show something of a camera, or where it stood, otherwise than the
    files have it, and that in words."""

    sigmas: float
    words: str
    of_standpoint: bool = False

    def limit(self, cameras: int, p: VerdictParameters) -> float:
        """The standard deviations that are allowed."""
        if self.of_standpoint:
            return p.max_standpoint_sigma
        return p.max_calibration_sigma if cameras > 1 else p.max_calibration_sigma_alone


LEAST_TOLD = 0.2  # of the variance of a standpoint along an axis: pictures that show less say nothing of it
_PICTURE, _MOUNT = "is its picture scaled or cropped, or the part not as modelled?", "was the camera moved?"
# Of each of UNKNOWNS: what is otherwise, in words of camera and amount; the amount's unit; words for more and for less.
_OTHERWISE = {
    "centre_u": ("the principal point that {0} shows lies {1:.1f} px {2} the file's", 1.0, "right of", "left of"),
    "centre_v": ("the principal point that {0} shows lies {1:.1f} px {2} the file's", 1.0, "below", "above"),
    "focal": ("the focal length that {0} shows is {1:.2g} % {2} than the file's", 100.0, "greater", "less"),
    "radial": ("the radial distortion that {0} shows is {1:.2g} {2} than the file's", 1.0, "greater", "less"),
} | {
    name: words
    for axis in AXES
    for name, words in (
        (axis, (f"{{0}} sits {{1:.2g}} mm from its place in the rig along its {axis} axis", 1.0, "", "")),
        (f"r{axis}", (f"{{0}} is turned by {{1:.2g}} degrees about its {axis} axis in the rig", 180 / math.pi, "", "")),
    )
}


def find_misfit(rig: Rig, shown: Shown) -> Misfit | None:
    """What of the cameras' unknowns, as pictures show them, lies most sigmas from the rig's file; None if exact."""
    unknowns = describe_unknowns(rig)
    known = unknowns.sigma > CALIBRATION_PX * np.isin(UNKNOWNS, ["centre_u", "centre_v"])
    known[:, RESPONSE] = False
    if rig.moved is not None:  # where a standpoint is, is told of it by itself
        known[[rig.standpoint_of(name) != rig.first for name in rig.cameras], PLACE] = False
    if not known.any():
        return None
    off = shown.unknowns - unknowns.mean
    sigmas = np.where(known, np.abs(off) / np.where(known, shown.sigma, 1.0), -1.0)
    number, of = np.unravel_index(int(np.argmax(sigmas)), sigmas.shape)
    camera, name, by = list(rig.cameras)[number], UNKNOWNS[of], float(off[number, of] / shown.share[number, of])
    words, unit, *ways = _OTHERWISE[name]
    said = words.format(camera, unit * abs(by), ways[by < 0])
    ask = _MOUNT if PLACE.start <= of < PLACE.stop else _PICTURE
    return Misfit(float(sigmas[number, of]), f"{said}, {sigmas[number, of]:.0f} sigma: {ask}")


@dataclass(frozen=True)
class SolvedStandpoint:
    """How far (6,) a standpoint is from where it is stated, a right perturbation in its rig's frame (t mm, r rad); the
    covariance (6, 6) of what pictures and the other standpoints leave open of it; and by how many standard deviations,
    of one number that is as improbable, they contradict it."""

    moved: Floats
    covariance: Floats
    misfit: Misfit


def compare_standpoints(rig: Rig, best: RefinedPose) -> dict[str, SolvedStandpoint]:
    """Each standpoint by name, at a rig's best pose: it errs as stated, and as edges do beyond independent ones."""
    from scipy.special import chdtrc, ndtri

    out = {}
    for name, columns in describe_unknowns(rig).standpoints.items():
        off, root = best.solved[columns], rig.standpoints[name].root
        left, spread = (it[6:, 6:][columns, columns] for it in (best.left, best.spread))
        value, axes = np.linalg.eigh(left)
        share = np.clip(1 - value, 0.0, 1.0)  # of what is stated, as far as pictures show it
        shown = share + np.maximum(np.einsum("ij,ik,kj->j", axes, spread - left, axes), 0.0)
        told = share > LEAST_TOLD
        square = float(((axes.T @ off)[told] ** 2 / shown[told]).sum())
        sigmas = -float(ndtri(max(float(chdtrc(max(told.sum(), 1), square)), 1e-300) / 2))
        moved = root @ off
        mm, degrees = float(np.linalg.norm(moved[:3])), float(np.degrees(np.linalg.norm(moved[3:])))
        words = f"standpoint {name} is {mm:.2g} mm and {degrees:.2g} degrees from where it is stated to be, as the "
        words += f"others have it, {sigmas:.0f} sigma: state it anew, or leave it out"
        out[name] = SolvedStandpoint(moved, root @ spread @ root.T, Misfit(sigmas, words, True))
    return out


def place_by_bases(rig: Rig, best: RefinedPose) -> dict[str, tuple[Floats, Floats]]:
    """Of each carrier of a rig's standpoints, where its base has the rig at its first one: world_from_rig (4, 4) with
    its covariance (6, 6), at the best pose.  What the standpoints are off by themselves is taken off."""
    unknowns, out = describe_unknowns(rig), {}
    first, spread = rig.standpoints[rig.first], best.spread.copy()
    spread[:6, :6] = best.covariance  # which joins what else explains the pictures
    for it in rig.standpoints.values():
        if it.ignored or it.carrier in out or it.carrier not in (first.carrier, *unknowns.bases):
            continue
        rig_from_place = inverse(first.world_from_rig) @ it.world_from_rig
        slope = np.zeros((6, len(spread)))
        slope[:, :6] = carry(inverse(rig_from_place))
        slope[:, 6:][:, unknowns.standpoints[rig.first]] = -slope[:, :6] @ first.root
        if it.carrier in unknowns.bases:
            slope[:, 6:][:, unknowns.bases[it.carrier]] = it.sway
        placed = best.world_from_rig @ rig_from_place
        out[it.carrier] = perturb(placed, slope[:, 6:] @ best.solved), slope @ spread @ slope.T
    return out


@dataclass(frozen=True)
class PoseEvidence:
    """What is known of the best of some hypotheses.

    agreement: share of the edges found that lie on the model's; apart: how far the cameras disagree, and support: what
    each of several gathers; chance: what poses elsewhere gather; precision: as `compute_precision` gives it; excluded:
    how many placed parts it leaves out; misfit: what of the cameras differs most from the rig's file, None where that
    does not say how well anything is known."""

    agreement: float
    apart: float
    support: Mapping[str, CameraSupport]
    chance: Chance
    precision: tuple[float, float, str]
    excluded: int
    misfit: Misfit | None = None


def judge(g: HypothesisTable, standing: Ints, it: PoseEvidence, needs: Needs, p: VerdictParameters) -> Verdict:
    """The rule of `decide` on numbers: of the hypotheses, of those that stand, and of the best of these."""
    support, chance = it.support, it.chance
    first = int(standing[0])
    evidence = float(g.evidence[first] + g.outline_evidence[first])
    outline = float(g.outline_px[first]), float(g.outline_contrast[first])
    signs = float(g.prior_sigma[first]), float(g.share[first]), it.agreement, *outline, it.apart
    stats = VerdictStatistics(evidence, chance.rarity(evidence), *signs)
    costs, believed, from_prior = g.cost[standing], g.believed[standing], stats.prior_sigma
    odds = stats.log_odds(p)
    # Rivals share what the best has in proportion to prior and evidence, which is tempered: neighbouring edges err
    # together.
    costs = p.temper * (costs - believed) + believed
    share = 1.0 / float(np.exp(-(costs - costs[0])).sum())
    likely = 1.0 / (1.0 + float(np.exp(-odds)))
    posterior = share * likely
    sigma_mm, sigma_rad, weakest = it.precision
    missing = []  # each is asked so that what is no number is missing too
    if not likely >= p.min_posterior:
        missing.append(
            f"the pictures do not show the model there surely enough: evidence of {stats.evidence:.0f} where poses "
            f"elsewhere reach {chance.reached(p.searched_rarity):.0f}, {_share(stats.share)} of the edges expected, "
            f"{stats.agreement:.0%} of those found lie on the model's, "
            f"contrast of {round(stats.outline_contrast, 1) + 0.0:.1f} along {stats.outline_px:.0f} px of outline"
            + ("" if np.isnan(from_prior) else f", {from_prior:.1f} sigma from the prior")
            + (f", the cameras disagree by {stats.apart:.1f} sigma" if support else "")
        )
    if from_prior > p.max_sigma:
        missing.append(f"the pose lies {from_prior:.1f} sigma from the prior, which contradicts it")
    blind = {
        name: (
            f"camera {name} does not see this: evidence of {camera.evidence:.0f} where {camera.expected:.0f} is "
            f"expected, and {camera.agreement:.0%} of the edges found lie on the model's "
            f"(log odds {camera.log_odds(p):.1f}, {p.least_camera_odds:g} needed): look at its picture, "
            "or let it be ignored"
        )
        for name, camera in support.items()
        if camera.is_blind(p)
    }
    missing += blind.values()
    if not stats.apart <= p.max_apart_sigma:
        missing.append(f"the cameras disagree by {stats.apart:.0f} sigma: check the rig's calibration")
    rig = None
    if it.misfit is not None and it.misfit.sigmas > it.misfit.limit(len(support), p):
        missing.append(it.misfit.words)
        rig = it.misfit.words if likely >= p.min_posterior else None  # where nothing fits, the cameras do not either
    if not (2 * sigma_mm <= needs.translation_mm and 2 * sigma_rad <= needs.rotation):
        missing.append(
            f"the pose is known to {2 * sigma_mm:.2g} mm and {np.degrees(2 * sigma_rad):.2g} degrees (two sigma; "
            f"{needs.translation_mm:g} mm and {np.degrees(needs.rotation):.2g} degrees needed), worst: {weakest}"
        )
    if len(costs) > 1:
        missing.append(f"{len(costs)} distinct poses explain the pictures about equally well")
    if not missing:
        verdict = "accepted"
        # Never rounded up to certainty.
        probability = "> 99.9 %" if posterior > 0.999 else f"{100 * posterior:.1f} %"
        reason = f"probability {probability}: {_share(stats.share)} of the expected edge evidence found, "
        reason += "no rival pose" + ("" if np.isnan(from_prior) else f", {from_prior:.1f} sigma from the prior")
        if g.is_symmetric.any():
            reason += "; the model is symmetric: from its other poses the rig sees the same"
        if it.excluded:
            reason += f"; without {it.excluded} placed parts that are not where the model says"
    else:
        verdict = "ambiguous" if len(costs) > 1 and len(missing) == 1 else "refused"
        reason = "; ".join(missing)
    if (m := it.misfit) and m.of_standpoint and m.sigmas > p.named_standpoint_sigma and m.words not in missing:
        reason += f"; {m.words}"
    weighed = {name: value for name, value in asdict(stats).items() if not np.isnan(value)} | {
        "chance_level": chance.level,
        "chance_scale": chance.scale,
        "log_odds": odds,
        "likely": likely,
        "sigma_mm": sigma_mm,
        "sigma_rad": sigma_rad,
        "rivals": float(len(standing) - 1),
        "excluded": float(it.excluded),
    }
    if it.misfit is not None:
        weighed |= {"calibration": it.misfit.sigmas, "calibration_limit": it.misfit.limit(len(support), p)}
    for name, camera in support.items():
        weighed[f"agreement {name}"] = camera.agreement
        weighed[f"chance_level {name}"] = camera.chance.level
        weighed[f"chance_scale {name}"] = camera.chance.scale
        if camera.tells(p):
            weighed[f"sees {name}"] = camera.log_odds(p)
    return Verdict(verdict, reason, posterior, missing, sigma_mm, sigma_rad, weakest, weighed, blind, rig)


def doubt_face(verdict: Verdict, mm: float, face: str) -> Verdict:
    """The verdict on a pose that a face which lies mm from its place may hold as well as those that do."""
    words = f"{face} lies {mm:.1f} mm from its place, and as many faces say that it is the others that do"
    return replace(verdict.ambiguous(words), weighed=verdict.weighed | {"rival_face_mm": mm})


def weigh_against_prior(verdict: Verdict, prior: Prior, world_from_rig: Floats, *, believe_pictures: bool) -> Verdict:
    """The verdict on a pose found without the prior, which contradicts it: refused, unless pictures are believed."""
    mm = float(np.linalg.norm(world_from_rig[:3, 3] - prior.world_from_rig[:3, 3]))
    sigma = prior.distance(world_from_rig)
    apart = f"the pictures put the rig {mm:.0f} mm, {sigma:.1f} sigma, from the prior"
    weighed = verdict.weighed | {"prior_mm": mm, "prior_sigma": sigma, "prior_left_out": float(believe_pictures)}
    if believe_pictures:
        return replace(verdict, reason=f"{verdict.reason}; {apart}", weighed=weighed)
    return replace(verdict.refused(apart), weighed=weighed)


def _share(value: float) -> str:
    """A share in percent: evidence beyond what was expected is all of it."""
    return f"{min(value, 1.0):.0%}"
