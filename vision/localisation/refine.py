"""The rig's pose, with covariance, by least squares of predicted arcs on edge elements, all cameras and the prior."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from relmodel.arrays import Bools, Floats, Ints, sum_by_group
from relmodel.geometry.transforms import carry, inverse, rotation_matrix
from vision.cameras.cameras import Prior, Rig, perturb, perturbation
from vision.localisation.hypotheses import Evidence, Fields, Prediction, climb_within, flow_in_camera, predict
from vision.localisation.localisation_parameters import DEFAULTS
from vision.localisation.measurements import (
    ALIKE,
    ARC_SHIFT_PX,
    LOOSE,
    PLACE,
    RESPONSE,
    EdgeIndex,
    Limits,
    Measurements,
    correct_rig,
    describe_unknowns,
    hold_shifts,
    measure,
    share_left,
)
from vision.localisation.support import ROUNDS, Outlines, Support, measure_support
from vision.scene import Scene

NEAR_ROUNDS = ROUNDS[-2:]  # also tried without the others: wide ones may be led off a right start by prints beside
LEAST_GAIN = 3.0  # log odds by which the start, or the pose of the near rounds, must do better to be kept
STEPS = 6  # Gauss-Newton steps at most in a round
MIN_STEP_SIGMA = 0.05  # a shorter step ends a round
# Beyond it the last step, on what was measured at the pose, is not taken: others have .01 to 1, bulkheads up to five.
MAX_LAST_STEP_SIGMA = 6.0
SAMPLES = 3000  # that face a camera
DRAWS, DRAWN_ARCS = 300, 5  # of the consensus (Fischler and Bolles, 1981), and arcs in one
CONSENSUS_PX = 1.5  # within which a measurement agrees with a draw
# Sigmas of the pose without a part by which that part may shift it: one that knows as much as all others shifts it by
# less in 98 of 100 cases.  And sigmas of the pose with it: 17 in 100 of two equal halves lie further apart.
MAX_SHIFT_SIGMA, MAX_JOINT_SHIFT_SIGMA = 2.0, 3.0
# Share of the edges found up to which a part that knows more than the others is suspected: without one that holds more,
# too little evidence is left against it.
MAX_LEFT_OUT = 0.8
LEAST_SHOWN = 0.1  # pictures that show less of how far an unknown is off say nothing of it
MAX_PRIOR_SHARE = 0.8  # of the prior's variance, where most is left, from which a pose counts as undetermined
TEMPER = 0.2  # by which differences of evidence are multiplied, for neighbouring edges err together
SUSPECT_SIGMA = 0.5  # to first order from which a part is left out on trial: robust weights hide most of a shift
USUAL_ARCS = 4.0  # arcs as which the usual ARC_SHIFT_PX counts
HALVES, HALVES_SAMPLES, HALVES_ROUNDS = 16, 500, (ROUNDS[0], ROUNDS[2])  # draws, samples a camera, and rounds


def compute_covariance(
    m: Measurements, held: Measurements, prediction: Prediction, stretch: Ints, hessian: Floats, beyond: Floats
) -> Floats:
    """Covariance (6 + u, 6 + u) of a pose and what is solved of its cameras from its measurements, as they are and as
    `hold_shifts` gives them: that of an M-estimator (Huber, 1981) whose measurements err in several ways; beyond (u,):
    of `CameraUnknowns.held`.

    Samples near each other err together (texture, shading), so stretches of arcs (of `group_by_stretch`) are what is
    independent.  An arc's image may be shifted as a whole (light, a clipped edge), by a random effect whose variance is
    common to all and estimated from how far their mean offsets scatter, what the pose has followed taken off
    (Henderson's analysis of variance).  An arc may lie on another edge altogether: how far the pose moves without it
    counts besides (jackknife).  By its tolerance it lies elsewhere for all cameras alike.  Priors err as they say."""
    group = prediction.image_of_arc
    weight = m.weight / m.sigma**2
    data = (held.jacobian * weight[:, None]).T @ held.jacobian
    # How far the loss bends away from the least squares that its weights make of it.
    bend = np.clip((m.slope / m.sigma**2).sum() / max(float(weight.sum()), 1e-12), 0.2, 1.0)
    kept = np.diag(np.append(np.zeros(6), beyond))
    hessian = hessian + kept
    inverse = np.linalg.inv(hessian - (1 - bend) * data)
    known = np.bincount(group, weight)
    rows = np.flatnonzero(known > 0)
    if not len(rows):
        return np.asarray(inverse)
    mean = np.bincount(group, weight * m.offset) / np.where(known > 0, known, 1.0)
    off = weight * (m.offset - mean[group])
    scatter = sum_by_group(stretch, held.jacobian, int(stretch.max()) + 1, off)
    left = share_left(m, prediction)
    shift = sum_by_group(group, m.jacobian, len(known), weight * left)[rows]
    total = sum_by_group(group, m.jacobian, len(known), weight)[rows]
    followed = np.clip(np.einsum("au,uv,av->a", shift, inverse, total) / known[rows], 0, 0.9)
    noise = np.bincount(group, off**2)[rows] / known[rows] ** 2
    length = np.bincount(group, m.weight)[rows]
    # A few arcs say little of the scatter: a usual value counts as some arcs more.
    usual = USUAL_ARCS * float(length.mean())
    scattered = float((length * (mean[rows] ** 2 - noise)).sum()) + usual * ARC_SHIFT_PX**2
    variance = scattered / (usual + float((length * (1 - followed) ** 2).sum()))
    expected = np.bincount(group, m.weight * prediction.tolerance_px**2)[rows]
    variance = max(variance - float(expected.sum() / length.sum()), 0.0)
    meat = scatter.T @ scatter + variance * shift.T @ shift + hessian - data + ALIKE * kept
    meat += _scatter_by_tolerance(held, prediction, weight)
    covariance = inverse @ meat @ inverse + _scatter_without_arcs(held, group, hessian)
    return np.asarray((covariance + covariance.T) / 2)


def _scatter_without_arcs(m: Measurements, group: Ints, hessian: Floats) -> Floats:
    """Sum (6 + u, 6 + u) of the outer products of how far the solution moves, to first order, without each arc."""
    gradients, hessians = _by_group(m, group)
    # What one alone determines is known in no way without it: all but a thousandth of it is taken away.
    moved = np.linalg.solve(hessian - 0.999 * hessians, gradients[..., None])[..., 0]
    return np.asarray(moved.T @ moved)


def _scatter_by_tolerance(m: Measurements, prediction: Prediction, weight: Floats) -> Floats:
    """Covariance (u, u) of the gradient by arcs that lie elsewhere than the model says, in all pictures at once."""
    _, flow = flow_in_camera(prediction)
    normal = np.stack([-m.direction[:, 1], m.direction[:, 0]], axis=1)
    # Where the image moves along its normal with the point: a vector in the rig's frame, px at one tolerance.
    by_point = np.einsum("ni,nij,njk->nk", normal, flow, prediction.rotation[prediction.view])
    by_point *= (prediction.tolerance_px / np.maximum(np.linalg.norm(by_point, axis=1), 1e-12))[:, None]
    arc = np.unique(prediction.arc, return_inverse=True)[1].ravel()
    moved = m.jacobian[:, :, None] * (weight[:, None] * by_point)[:, None, :]
    by_unknown = sum_by_group(arc, moved, int(arc.max()) + 1)
    return np.asarray(np.einsum("aux,avx->uv", by_unknown, by_unknown))


def group_by_stretch(prediction: Prediction) -> Ints:
    """A number for each stretch of each arc's image (n,) that counts as one observation."""
    group = prediction.image_of_arc
    order = np.argsort(group, kind="stable")
    along = np.cumsum(prediction.weight[order])
    first = np.searchsorted(group[order], np.arange(int(group.max(initial=-1)) + 1))
    number = np.empty(len(group), np.int64)
    number[order] = np.floor(along - along[first][group[order]]).astype(np.int64)
    pairs = group * (int(number.max(initial=0)) + 1) + number
    return np.asarray(np.unique(pairs, return_inverse=True)[1].ravel())


@dataclass(frozen=True)
class Explanation:
    """A pose that explains the pictures by other components being off, its covariance (6, 6), and the log odds of it
    against the pose that was kept."""

    world_from_rig: Floats
    covariance: Floats
    log_odds: float


@dataclass(frozen=True)
class LastStep:
    """What the last step of a refinement set out from: the pose and the cameras' unknowns (c, 11) at which the pictures
    were looked at; the covariance (6, 6) of what was measured there; and the explanations that are joined to it."""

    world_from_rig: Floats
    camera_unknowns: Floats
    covariance: Floats
    explanations: list[Explanation]


@dataclass(frozen=True)
class Shown:
    """What pictures show of cameras, their file all but left out, by camera (c, 11): the unknowns; the share of how far
    these are off that this is; and its standard deviation, where the file errs as stated and edges as they do."""

    unknowns: Floats
    share: Floats
    sigma: Floats


@dataclass(frozen=True, eq=False)
class RefinedPose:
    """A refined pose, its covariance (6, 6), each camera's own unknowns (c, 11), and what it rests on.

    excluded (o,): which of the scene's occurrences are left out because they are not where the model says.
    prior_sigma: its distance from the prior, NaN where nothing is known beforehand.  outlines: the greys beside the
    outlines, where they were asked for.  last_step: where prediction, measurements and support are of.
    is_symmetric: whether the model, carried onto itself, leads here from the best pose.  is_rough: whether it was only
    looked at roughly, as rivals are.  told: log odds of the account of all edges seen from here, NaN where it was not
    asked.  others: poses that explain the pictures by other occurrences being off their place, or by none.
    solved (u,): what was solved of the cameras, of which their unknowns follow; left (6 + u, 6 + u): covariance of pose
    and what was solved, were all errors of the measurements independent, and spread, as they are; shown: what pictures
    show of the cameras, where it was asked for; strain: half of the sum of squares by which standpoints are off, in
    sigmas.  cost: half of the prior's distance squared and the strain, less the evidence."""

    world_from_rig: Floats
    covariance: Floats
    camera_unknowns: Floats
    prediction: Prediction
    measurements: Measurements
    excluded: Bools
    support: Support
    prior_sigma: float
    outlines: Outlines | None = None
    last_step: LastStep | None = None
    is_symmetric: bool = False
    is_rough: bool = False
    told: float = float("nan")
    others: tuple[RefinedPose, ...] = ()
    solved: Floats = field(default_factory=lambda: np.zeros(0))
    left: Floats = field(default_factory=lambda: np.zeros((6, 6)))
    spread: Floats = field(default_factory=lambda: np.zeros((6, 6)))
    strain: float = 0.0
    shown: Shown | None = None

    @property
    def middle(self) -> Floats:
        """The middle (3,) of what is seen, in the rig's frame."""
        seen = self.prediction.point
        return np.asarray(np.median(seen, axis=0) if len(seen) else np.zeros(3))

    @property
    def distance(self) -> float:
        """Of what is seen from the rig, mm, in the median; 0 where nothing is."""
        away = np.linalg.norm(self.prediction.point, axis=1)
        return float(np.median(away)) if len(away) else 0.0

    @property
    def sees_nothing(self) -> bool:
        return not len(self.prediction.point)

    @property
    def evidence(self) -> float:
        return self.support.evidence

    @property
    def cost(self) -> float:
        far = 0.0 if np.isnan(self.prior_sigma) else 0.5 * self.prior_sigma**2
        return far + self.strain - self.evidence - (self.outlines.evidence if self.outlines else 0.0)

    def against(self, others: list[RefinedPose]) -> list[Explanation]:
        """Others, as they explain the pictures instead."""
        return [Explanation(h.world_from_rig, h.covariance, -TEMPER * max(h.cost - self.cost, 0.0)) for h in others]


def _distance(a: RefinedPose, b: RefinedPose) -> float:
    """How far pose a lies from b, in sigmas of b."""
    apart = perturbation(b.world_from_rig, a.world_from_rig)
    square = float(apart @ np.linalg.solve(b.covariance, apart))
    return float(max(square, 0.0) ** 0.5)


def join_explanations(world_from_rig: Floats, covariance: Floats, others: list[Explanation]) -> Floats:
    """The covariance (6, 6) of a pose among others that contradict it, in proportion to how likely each is."""
    total, weights = covariance.copy(), 1.0
    for h in others:
        weight = float(np.exp(h.log_odds))
        apart = perturbation(world_from_rig, h.world_from_rig)
        total += weight * (h.covariance + np.outer(apart, apart))
        weights += weight
    return np.asarray(total / weights)


class Fit:
    """Least squares of one rig's pose on its pictures' edges.

    indexes: these, by camera; fields: their evidence, in the order of the rig's cameras; seed: of the consensus."""

    def __init__(
        self,
        scene: Scene,
        rig: Rig,
        indexes: dict[str, EdgeIndex],
        fields: list[Evidence],
        prior: Prior,
        seed: int = DEFAULTS.refinement_seed,
    ) -> None:
        self.scene, self.rig, self.fields, self.prior, self.seed = scene, rig, fields, prior, seed
        self.cameras = [indexes[name] for name in rig.cameras]
        self.unknowns = describe_unknowns(rig)
        self._none = np.zeros(len(scene.inspected), bool)
        self._predicted: dict[bytes, Prediction] = {}
        self._begun: dict[bytes, tuple[Floats, Floats]] = {}

    def refine(self, world_from_rig: Floats) -> RefinedPose:
        """The pose near `world_from_rig` that fits the pictures' edges and the prior best, and its covariance.

        Placed parts that stand elsewhere pull the pose however robust the loss.  So a part that contradicts the others
        is left out, where the whole then gathers enough evidence with that part looked for near its place.  Where two
        that know about as much contradict each other, either may be off.  All such explanations are `others` of the
        pose, and its covariance joins them by their evidence.  A start with clearly more evidence stays."""
        refined = self.solve(world_from_rig, self._none)
        rejected: list[RefinedPose] = []
        while others := [h for c in self.find_outliers(refined) if (h := self.leave_out(refined, c)) is not None]:
            usable = [h for h in others if self.is_determined(h) or not self.is_determined(refined)]
            far = [_distance(refined, h) > MAX_SHIFT_SIGMA for h in usable]
            best = next((h for h, f in zip(usable, far, strict=True) if f and h.cost <= refined.cost), refined)
            rejected += [h for h in usable if h is not best]
            if best is refined:
                break
            rejected.append(refined)
            refined = best
        start = self.measure(world_from_rig, self.unknowns.expected, self._none)
        near = self.solve(world_from_rig, self._none, NEAR_ROUNDS)
        # A view of nothing costs nothing, and no prior holds the pose where there is none.
        other = min([near, start], key=lambda h: (h.sees_nothing, h.cost))
        if refined.sees_nothing or (not other.sees_nothing and other.cost < refined.cost - LEAST_GAIN):
            refined = other
        explanations = refined.against(rejected)
        rest = tuple(self._take_step(h, []) for h in rejected)
        return replace(self._take_step(refined, explanations), others=rest)

    def refine_roughly(self, world_from_rig: Floats) -> RefinedPose:
        """As `refine`, from a pose that is nearly right, by the last rounds alone with all parts: enough to compare."""
        refined = self.solve(world_from_rig, self._none, NEAR_ROUNDS)
        return replace(self._take_step(refined, []), is_rough=True)

    def follow_halves(self, refined: RefinedPose) -> Iterator[Floats]:
        """Poses (4, 4) to which least squares leads by half of the arcs' images, as drawn: where some lie on other
        edges altogether, as of a print, they hold the pose wherever that is, and nothing at it tells."""
        pose, rng = refined.world_from_rig, np.random.default_rng(self.seed)
        p, laid = self.predict(pose, refined.solved)
        p = p.take(np.arange(0, len(p.point), 1 + len(p.point) // (HALVES_SAMPLES * len(self.cameras))))
        own = ~refined.excluded[self.scene.occurrence_of_arc[p.arc]]
        for _ in range(HALVES):
            votes, end = own & (rng.random(len(p.view_of_image)) < 0.5)[p.image_of_arc], (np.zeros(6), refined.solved)
            for limits in HALVES_ROUNDS:
                end = self._descend((p, laid), pose, end, limits, votes)
            yield perturb(pose, end[0])

    def predict(self, world_from_rig: Floats, solved: Floats) -> tuple[Prediction, Floats]:
        """What the cameras see from a pose, and what of their unknowns (c, 11) that takes into account: where they
        stand at several standpoints, which may be too far from where they are stated to be for what is seen to be the
        same.  Solutions begin where others began or ended."""
        laid, rig = np.zeros_like(self.unknowns.mean), self.rig
        if rig.moved is not None:
            laid[:, PLACE] = self.unknowns.of_cameras(solved)[:, PLACE]
            rig = correct_rig(rig, laid)
        key = world_from_rig.tobytes() + laid.tobytes()
        if key not in self._predicted:
            self._predicted[key] = predict(self.scene, rig, world_from_rig, SAMPLES)
        return self._predicted[key], laid

    def solve(
        self, world_from_rig: Floats, excluded: Bools, rounds: tuple[Limits, ...] = ROUNDS, by: float = ALIKE
    ) -> RefinedPose:
        """The best pose from all occurrences that are not excluded, by all rounds or by those given; what their file
        says of the cameras counts `by` times."""
        pose, solved = self.begin(world_from_rig)
        for limits in rounds:
            prediction, laid = self.predict(pose, solved)
            votes = ~excluded[self.scene.occurrence_of_arc[prediction.arc]]
            delta, own = np.zeros(6), self.unknowns.of_cameras(solved) - laid
            if limits != ROUNDS[0]:
                m = measure(prediction, self.cameras, delta, self.unknowns, own, limits, votes)
                delta = find_consensus(m, prediction, self.prior, pose, self.seed)
            delta, solved = self._descend((prediction, laid), pose, (delta, solved), limits, votes, by)
            pose = perturb(pose, delta)
        return self.measure(pose, solved, excluded)

    def _descend(
        self, seen: tuple[Prediction, Floats], pose: Floats, start: tuple[Floats, Floats], limits: Limits, votes: Bools,
        by: float = ALIKE,
    ) -> tuple[Floats, Floats]:  # fmt: skip
        """A perturbation (6,) of a pose and unknowns (u,), led from `start` by the steps of one round of `solve`; seen:
        as `predict` gives it."""
        (prediction, laid), (delta, solved) = seen, start
        for _ in range(STEPS):
            own = self.unknowns.of_cameras(solved) - laid
            m = measure(prediction, self.cameras, delta, self.unknowns, own, limits, votes)
            here = perturb(pose, delta)
            hessian, gradient = self._normal_equations(hold_shifts(m, prediction), here, solved, by)
            step = np.asarray(np.linalg.solve(hessian, gradient), float)
            delta, solved = perturbation(pose, perturb(here, step[:6])), solved + step[6:]
            if step @ hessian @ step < MIN_STEP_SIGMA**2:
                break
        return delta, solved

    def begin(self, world_from_rig: Floats, alone: Mapping[str, RefinedPose] | None = None) -> tuple[Floats, Floats]:
        """Pose and unknowns (u,) to begin at: the cameras of each of several standpoints where they stand alone, else
        alone lead uphill: they, or the base of their carrier, may be stated further off than least squares reach."""
        key, rig, bases = world_from_rig.tobytes(), self.rig, self.unknowns.bases
        if key in self._begun and alone is None:
            return self._begun[key]
        pose, solved = world_from_rig, self.unknowns.expected.copy()
        for name, columns in self.unknowns.standpoints.items():
            own = [camera for camera in rig.cameras if rig.standpoint_of(camera) == name]
            if not own:
                continue
            it, fields = rig.standpoints[name], dict(zip(rig.cameras, self.fields, strict=True))
            carried = carry(inverse(rig.standpoints[rig.first].world_from_rig) @ it.world_from_rig)
            if alone is None:
                off = np.hstack([it.root, it.sway if it.carrier in bases else np.zeros((6, 0))])
                covariance, seen = carried @ off @ off.T @ carried.T, Fields(fields[camera] for camera in own)
                led = climb_within(self.scene, rig.only(*own), seen, world_from_rig, covariance, self.seed)
            else:
                led = alone[own[0]].world_from_rig
            if led is not None:
                solved[columns] = np.linalg.solve(carried @ it.root, perturbation(world_from_rig, led))
                pose = led if name == rig.first else pose
        self._begun[key] = pose, solved
        return self._begun[key]

    def resolve(self, refined: RefinedPose, alone: Mapping[str, RefinedPose]) -> RefinedPose:
        """A pose solved again from where each standpoint's camera stands alone, if one of them sees more there: least
        squares left it at a neighbouring edge."""
        if max(h.evidence - own for h, own in zip(alone.values(), refined.support.by_camera, strict=True)) < LEAST_GAIN:
            return refined
        self.begin(refined.world_from_rig, alone)
        again = self.solve(refined.world_from_rig, refined.excluded, NEAR_ROUNDS)
        return self._take_step(again, refined.last_step.explanations if refined.last_step else [])

    def measure(self, pose: Floats, solved: Floats, excluded: Bools) -> RefinedPose:
        """What the pictures say of a pose as it stands, with what is solved of the cameras (u,)."""
        solved = np.ravel(solved)
        own = self.unknowns.of_cameras(solved)
        prediction, laid = self.predict(pose, solved)
        occurrence = self.scene.occurrence_of_arc[prediction.arc]
        votes = ~excluded[occurrence]
        m = measure(prediction, self.cameras, np.zeros(6), self.unknowns, own - laid, ROUNDS[-1], votes)
        held = hold_shifts(m, prediction)
        hessian, _ = self._normal_equations(held, pose, solved)
        inverse = np.asarray(np.linalg.inv(hessian), float)
        beyond = self.unknowns.held(ALIKE)
        spread = compute_covariance(m, held, prediction, group_by_stretch(prediction), hessian, beyond)
        return RefinedPose(
            pose,
            spread[:6, :6],
            own,
            prediction,
            m,
            excluded,
            measure_support(prediction, m, own - laid, self.fields, self.cameras, np.where(votes, -1, occurrence)),
            self.prior.distance(pose),
            solved=solved,
            left=inverse,
            spread=spread,
            strain=0.5 * sum(float(solved[it] @ solved[it]) for it in self.unknowns.standpoints.values()),
        )

    def show(self, refined: RefinedPose) -> RefinedPose:
        """A pose with what the pictures show of the cameras near it."""
        self._begun[refined.world_from_rig.tobytes()] = refined.world_from_rig, refined.solved
        loose = self.solve(refined.world_from_rig, refined.excluded, NEAR_ROUNDS, by=LOOSE)
        m, p, (shared, stated) = loose.measurements, loose.prediction, (self.unknowns.shared, self.unknowns.sigma)
        _, hessian, _ = self._measured(loose, LOOSE)
        spread = compute_covariance(m, hold_shifts(m, p), p, group_by_stretch(p), hessian, np.zeros(len(loose.solved)))
        both = np.stack([np.linalg.inv(hessian), spread])[:, 6:, 6:]
        left, errs = np.einsum("ciu,kuv,civ->kci", shared, both, shared)
        by = np.where(np.arange(left.shape[1]) == RESPONSE, 1.0, LOOSE)  # no file says how a camera responds
        share = np.clip(1 - by * left / np.maximum(stated, 1e-12) ** 2, LEAST_SHOWN, 1.0)
        variance = (share * stated) ** 2 + share * left + np.maximum(errs - left, 0.0)
        return replace(refined, shown=Shown(loose.camera_unknowns, share, np.sqrt(variance)))

    def is_determined(self, refined: RefinedPose) -> bool:
        """Whether the pictures, taken as right, determine the pose better than the prior in every direction.  The
        scatter of their edges about the model says how exactly the pose is known, not whether it is determined."""
        _, hessian, _ = self._measured(refined)
        left = np.linalg.eigvals(np.linalg.inv(hessian)[:6, :6] @ self.prior.information).real
        return float(left.max()) < MAX_PRIOR_SHARE

    def leave_out(self, refined: RefinedPose, occurrence: int) -> RefinedPose | None:
        """The pose without an occurrence; None where that moves it no further than its errors explain."""
        excluded = refined.excluded.copy()
        excluded[occurrence] = True
        without = self.solve(refined.world_from_rig, excluded)
        far = _distance(refined, without) > MAX_SHIFT_SIGMA or _distance(without, refined) > MAX_JOINT_SHIFT_SIGMA
        return without if far else None

    def find_outliers(self, refined: RefinedPose) -> list[int]:
        """The occurrence whose removal, to first order, moves the pose furthest: one of those that determine it less
        than the others together, and one of those that determine it more, unless most was found of it."""
        m, hessian, _ = self._measured(refined)
        occurrence, group = np.unique(self.scene.occurrence_of_arc[refined.prediction.arc], return_inverse=True)
        if len(occurrence) < 2:
            return []
        group = group.ravel()
        gradients, hessians = _by_group(m, group)
        priors = hessian - hessians.sum(axis=0)
        lesser = np.linalg.slogdet(hessians + priors)[1] < np.linalg.slogdet(hessian - hessians)[1]
        found = np.bincount(group, refined.prediction.weight * (m.weight > 0))
        greater = ~lesser & (found < MAX_LEFT_OUT * found.sum())
        shifts = np.linalg.solve(hessian - 0.999 * hessians, gradients[..., None])[:, :6, 0]
        sigmas = np.einsum("bi,ij,bj->b", shifts, np.linalg.inv(refined.covariance), shifts)
        worst = [int(np.argmax(np.where(some, sigmas, -1.0))) for some in (lesser, greater) if some.any()]
        return [int(occurrence[w]) for w in worst if sigmas[w] > SUSPECT_SIGMA**2]

    def _take_step(self, refined: RefinedPose, explanations: list[Explanation]) -> RefinedPose:
        """A pose after one more step on what was measured there, with the covariance that the explanations of the
        pictures leave.  Beyond MAX_LAST_STEP_SIGMA it is not taken: the pose stands for what it gathers, not for where
        its edges lie."""
        _, hessian, gradient = self._measured(refined, ALIKE)
        step = np.asarray(np.linalg.solve(hessian, gradient), float)
        pose, solved = refined.world_from_rig, refined.solved
        if step @ hessian @ step <= MAX_LAST_STEP_SIGMA**2:
            pose, solved = perturb(pose, step[:6]), solved + step[6:]
        return replace(
            refined,
            world_from_rig=pose,
            camera_unknowns=self.unknowns.of_cameras(solved),
            solved=solved,
            covariance=join_explanations(refined.world_from_rig, refined.covariance, explanations),
            prior_sigma=self.prior.distance(pose),
            last_step=LastStep(refined.world_from_rig, refined.camera_unknowns, refined.covariance, explanations),
        )

    def _measured(self, refined: RefinedPose, by: float = 1.0) -> tuple[Measurements, Floats, Floats]:
        """What was measured at a pose, as `hold_shifts` gives it, and its normal equations there."""
        m = hold_shifts(refined.measurements, refined.prediction)
        return m, *self._normal_equations(m, refined.world_from_rig, refined.solved, by)

    def _normal_equations(
        self, m: Measurements, world_from_rig: Floats, solved: Floats, by: float = 1.0
    ) -> tuple[Floats, Floats]:
        """Hessian and gradient of least squares by (t, r, what is solved of the cameras), the priors of all included,
        that of the cameras `by` times; the measurements as `hold_shifts` gives them."""
        scaled = m.jacobian * (m.weight / m.sigma**2)[:, None]
        hessian, gradient = scaled.T @ m.jacobian, scaled.T @ m.offset
        away = np.zeros(6) if self.prior.is_open else perturbation(self.prior.world_from_rig, world_from_rig)
        turn = np.eye(6)
        turn[:3, :3] = rotation_matrix(away[3:])
        information = turn.T @ self.prior.information
        hessian[:6, :6] += information @ turn
        gradient[:6] -= information @ away
        precision = self.unknowns.precision + self.unknowns.held(by)
        hessian[6:, 6:] += np.diag(precision)
        gradient[6:] -= precision * (solved - self.unknowns.expected)
        return hessian, gradient


def find_consensus(m: Measurements, prediction: Prediction, prior: Prior, world_from_rig: Floats, seed: int) -> Floats:
    """The step (6,) on which most of the measured length agrees, of steps that few arcs make and of none.

    Where a structure of the model stands elsewhere in the world, least squares lies between it and the rest however
    robust the loss; a step from a few arcs of the rest does not (Fischler and Bolles, with arcs as the unit)."""
    hit = np.flatnonzero(m.weight > 0)
    if not len(hit):
        return np.zeros(6)
    group = prediction.image_of_arc[hit]
    jacobian, offset, w = m.jacobian[hit, :6], m.offset[hit], prediction.weight[hit]
    count = int(group.max()) + 1
    hessians = sum_by_group(group, jacobian[:, :, None] * jacobian[:, None, :], count)
    gradients, length = sum_by_group(group, jacobian * offset[:, None], count), np.bincount(group, w)
    usable = np.flatnonzero(length > 0)
    rng = np.random.default_rng(seed)
    size = min(DRAWN_ARCS, len(usable))
    keys = rng.exponential(size=(DRAWS, len(usable))) / length[usable]
    # The smallest of exponentials with these rates: a draw without replacement in proportion to length.
    drawn = usable[np.argsort(keys, axis=1)[:, :size]]
    information = prior.information
    away = np.zeros(6) if prior.is_open else perturbation(prior.world_from_rig, world_from_rig)
    steps = np.linalg.solve(
        hessians[drawn].sum(axis=1) + information, (gradients[drawn].sum(axis=1) - information @ away)[..., None]
    )[..., 0]
    steps = np.concatenate([np.zeros((1, 6)), steps])
    left = (offset[:, None] - jacobian @ steps.T) / CONSENSUS_PX
    return np.asarray(steps[int(np.argmax(w @ np.maximum(1 - left**2, 0)))])


def _by_group(m: Measurements, group: Ints) -> tuple[Floats, Floats]:
    """Gradients (g, u) and Hessians (g, u, u) that groups of samples, each with some, add to the normal equations."""
    size = m.jacobian.shape[1]
    if not len(group):
        return np.zeros((0, size)), np.zeros((0, size, size))
    order, last = np.argsort(group, kind="stable"), np.cumsum(np.bincount(group))
    jacobian, offset = m.jacobian[order], m.offset[order]
    scaled = (jacobian * (m.weight / m.sigma**2)[order, None]).T
    parts = [slice(*ends) for ends in zip([0, *last[:-1]], last, strict=True)]
    return np.stack([scaled[:, p] @ offset[p] for p in parts]), np.stack([scaled[:, p] @ jacobian[p] for p in parts])
