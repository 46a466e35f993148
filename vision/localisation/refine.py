"""The rig's pose by least squares of predicted arcs on sub-pixel edge elements, over all cameras and with the prior,
and its covariance.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from relmodel.arrays import Bools, Floats, Ints, sum_by_group
from relmodel.geometry.transforms import rotation_matrix
from vision.cameras.cameras import Prior, Rig, perturb, perturbation
from vision.localisation.hypotheses import Evidence, Prediction, flow_in_camera, predict
from vision.localisation.localisation_parameters import DEFAULTS, LocalisationParameters, RefinementParameters
from vision.localisation.measurements import (
    CameraUnknowns,
    EdgeIndex,
    Measurements,
    describe_unknowns,
    hold_shifts,
    measure,
    share_left,
)
from vision.localisation.support import Outlines, Support, measure_support
from vision.scene import Scene


def compute_covariance(
    m: Measurements,
    held: Measurements,
    prediction: Prediction,
    stretch: Ints,
    hessian: Floats,
    unknowns: CameraUnknowns,
    p: LocalisationParameters,
) -> Floats:
    """Covariance (6, 6) of a pose from its measurements, as they are and as `hold_shifts` gives them: that of an
    M-estimator (Huber, 1981) whose measurements err in several ways.

    Samples near each other err together (texture, shading), so stretches of arcs (of `group_by_stretch`) are what is
    independent.  The image of an arc may be shifted as a whole (light, a clipped edge, an arc not where the model
    says), by a random effect whose variance is common to all arcs and is estimated from how far their mean offsets
    scatter, what the pose has followed taken off (Henderson's analysis of variance).  One arc may lie on another edge
    altogether: how far the pose moves without it counts besides, arc by arc (jackknife).  Where the model has a
    tolerance, an arc lies elsewhere for all cameras alike.  The priors err by their covariance, and the cameras also by
    errors that are considered and not solved for.
    """
    group = prediction.image_of_arc
    weight = m.weight / m.sigma**2
    data = (held.jacobian * weight[:, None]).T @ held.jacobian
    # How far the loss bends away from the least squares that its weights make of it.
    bend = np.clip((m.slope / m.sigma**2).sum() / max(float(weight.sum()), 1e-12), 0.2, 1.0)
    inverse = np.linalg.inv(hessian - (1 - bend) * data)
    known = np.bincount(group, weight)
    rows = np.flatnonzero(known > 0)
    if not len(rows):
        return np.asarray(inverse[:6, :6])
    mean = np.bincount(group, weight * m.offset) / np.where(known > 0, known, 1.0)
    apart = (held.jacobian * (weight * (m.offset - mean[group]))[:, None]).T
    scatter = np.stack([np.bincount(stretch, row) for row in apart], axis=1)
    left = share_left(m, prediction)
    shift = sum_by_group(group, m.jacobian, len(known), weight * left)[rows]
    total = sum_by_group(group, m.jacobian, len(known), weight)[rows]
    followed = np.clip(np.einsum("au,uv,av->a", shift, inverse, total) / known[rows], 0, 0.9)
    noise = np.bincount(group, (weight * (m.offset - mean[group])) ** 2)[rows] / known[rows] ** 2
    length = np.bincount(group, m.weight)[rows]
    # A few arcs say little of the scatter: a usual value counts as some arcs more.
    usual = p.refinement.usual_arcs * float(length.mean())
    scattered = float((length * (mean[rows] ** 2 - noise)).sum()) + usual * p.refinement.arc_shift_px**2
    variance = scattered / (usual + float((length * (1 - followed) ** 2).sum()))
    expected = np.bincount(group, m.weight * prediction.tolerance_px**2)[rows]
    variance = max(variance - float(expected.sum() / length.sum()), 0.0)
    meat = scatter.T @ scatter + variance * shift.T @ shift + hessian - data
    meat += _scatter_by_tolerance(held, prediction, weight)
    considered = unknowns.precision[:, None] * unknowns.considered
    meat[6:, 6:] += considered @ considered.T
    covariance = (inverse @ meat @ inverse)[:6, :6] + _scatter_without_arcs(held, group, weight, hessian)
    return np.asarray((covariance + covariance.T) / 2)


def _scatter_without_arcs(m: Measurements, group: Ints, weight: Floats, hessian: Floats) -> Floats:
    """Sum (6, 6) of the outer products of how far the pose moves, to first order, without the image of each arc."""
    # What no measurement moves has no part in it.
    free = np.flatnonzero(np.abs(m.jacobian).sum(axis=0) > 0)
    jacobian, order = m.jacobian[:, free], np.argsort(group, kind="stable")
    first = np.searchsorted(group[order], np.arange(int(group.max()) + 1))
    i, j = np.triu_indices(len(free))
    scaled = jacobian * weight[:, None]
    of_arcs = np.zeros((len(first), len(free), len(free)))
    of_arcs[:, i, j] = of_arcs[:, j, i] = np.add.reduceat((scaled[:, i] * jacobian[:, j])[order], first)
    gradient = np.add.reduceat((scaled * m.offset[:, None])[order], first)
    # An arc that alone determines the pose in some direction leaves next to nothing without it.
    left = hessian[np.ix_(free, free)] - 0.999 * of_arcs
    moved = np.linalg.solve(left, gradient[..., None])[:, : int((free < 6).sum()), 0]
    out = np.zeros((6, 6))
    pose = free[free < 6]
    out[np.ix_(pose, pose)] = moved.T @ moved
    return out


def _scatter_by_tolerance(m: Measurements, prediction: Prediction, weight: Floats) -> Floats:
    """Covariance (u, u) of the gradient by arcs that lie elsewhere than the model says, in all pictures at once."""
    _, flow = flow_in_camera(prediction)
    normal = np.stack([-m.direction[:, 1], m.direction[:, 0]], axis=1)
    # Where the image moves along its normal with the point: a vector in the rig's frame, px at one tolerance.
    by_point = np.einsum("ni,nij,njk->nk", normal, flow, prediction.rotation[prediction.view])
    by_point *= (prediction.tolerance_px / np.maximum(np.linalg.norm(by_point, axis=1), 1e-12))[:, None]
    arc = np.unique(prediction.arc, return_inverse=True)[1].ravel()
    moved = m.jacobian[:, :, None] * (weight[:, None] * by_point)[:, None, :]
    by_arc = np.stack([np.bincount(arc, column) for column in moved.reshape(len(arc), -1).T], axis=1)
    by_unknown = by_arc.reshape(len(by_arc), -1, 3)
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


# The rig's pose by least squares of predicted arcs on sub-pixel edge elements, over all cameras and with the prior.


@dataclass(frozen=True)
class Explanation:
    """A pose that explains the pictures by other components being off, its covariance (6, 6), and the log odds of it
    against the pose that was kept."""

    world_from_rig: Floats
    covariance: Floats
    log_odds: float


@dataclass(frozen=True)
class LastStep:
    """What the last step of a refinement set out from: the pose and the cameras' unknowns (c, 10) at which the pictures
    were looked at; the covariance (6, 6) of what was measured there; and the explanations that are joined to it."""

    world_from_rig: Floats
    own: Floats
    covariance: Floats
    explanations: list[Explanation]


@dataclass(frozen=True, eq=False)
class Refined:
    """A refined pose, its covariance (6, 6), each camera's own unknowns (c, 10), and what it rests on.

    excluded (o,): which of the scene's occurrences are left out because they are not where the model says.
    prior_sigma: its distance from the prior, NaN where nothing is known beforehand.  outlines: the greys beside the
    outlines, where they were asked for.  last_step: where prediction, measurements and support are of.
    is_symmetric: whether the model, carried onto itself, leads here from the best pose.  is_rough: whether it was only
    looked at roughly, as rivals are.  relational_distance: what the best labelling of the pictures by the
    views from here costs, NaN where it was not asked.  others: poses that explain the pictures by other occurrences
    being off their place, or by none.
    cost: half of the prior's distance squared, less the evidence of edges and outlines.
    """

    world_from_rig: Floats
    covariance: Floats
    own: Floats
    prediction: Prediction
    measurements: Measurements
    excluded: Bools
    support: Support
    prior_sigma: float
    outlines: Outlines | None = None
    last_step: LastStep | None = None
    is_symmetric: bool = False
    is_rough: bool = False
    relational_distance: float = float("nan")
    others: tuple[Refined, ...] = ()

    @property
    def middle(self) -> Floats:
        """The middle (3,) of what is seen, in the rig's frame."""
        seen = self.prediction.point
        return np.asarray(np.median(seen, axis=0) if len(seen) else np.zeros(3))

    @property
    def sees_nothing(self) -> bool:
        return not len(self.prediction.point)

    @property
    def evidence(self) -> float:
        return self.support.evidence

    @property
    def cost(self) -> float:
        far = 0.0 if np.isnan(self.prior_sigma) else 0.5 * self.prior_sigma**2
        return far - self.evidence - (self.outlines.evidence if self.outlines else 0.0)


def _take_step(refined: Refined, fit: Fit, explanations: list[Explanation]) -> Refined:
    """A pose after its last step, with the covariance that the explanations of the pictures leave."""
    m = hold_shifts(refined.measurements, refined.prediction)
    pose, own = take_last_step(m, refined.world_from_rig, refined.own, fit.prior, fit.unknowns, fit.p.refinement)
    return replace(
        refined,
        world_from_rig=pose,
        own=own,
        covariance=join_explanations(refined.world_from_rig, refined.covariance, explanations),
        prior_sigma=fit.prior.distance(pose),
        last_step=LastStep(refined.world_from_rig, refined.own, refined.covariance, explanations),
    )


def take_last_step(
    m: Measurements,
    world_from_rig: Floats,
    own: Floats,
    prior: Prior,
    unknowns: CameraUnknowns,
    p: RefinementParameters,
) -> tuple[Floats, Floats]:
    """The pose (4, 4) and own unknowns (c, 10) after one step of least squares on measurements taken at a pose and
    unknowns, as `hold_shifts` gives them; the pictures are not measured again.  A step beyond `max_last_step_sigma` is
    not taken: the pose then stands for what it gathers, not for where its edges lie."""
    hessian, gradient = normal_equations(m, world_from_rig, own, prior, unknowns)
    step = np.asarray(np.linalg.solve(hessian, gradient), float)
    if step @ hessian @ step > p.max_last_step_sigma**2:
        return world_from_rig, own
    return perturb(world_from_rig, step[:6]), own + step[6:].reshape(own.shape)


def _distance(a: Refined, b: Refined) -> float:
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


def normal_equations(
    m: Measurements, world_from_rig: Floats, own: Floats, prior: Prior, unknowns: CameraUnknowns
) -> tuple[Floats, Floats]:
    """Hessian and gradient of least squares by (t, r, each camera's own unknowns), the priors of all included; the
    measurements as `hold_shifts` gives them."""
    scaled = m.jacobian * (m.weight / m.sigma**2)[:, None]
    hessian, gradient = scaled.T @ m.jacobian, scaled.T @ m.offset
    away = np.zeros(6) if prior.is_open else perturbation(prior.world_from_rig, world_from_rig)
    turn = np.eye(6)
    turn[:3, :3] = rotation_matrix(away[3:])
    information = turn.T @ prior.information
    hessian[:6, :6] += information @ turn
    gradient[:6] -= information @ away
    precision = unknowns.precision
    hessian[6:, 6:] += np.diag(precision)
    gradient[6:] -= precision * (own - unknowns.mean).ravel()
    return hessian, gradient


@dataclass(frozen=True)
class Fit:
    """Least squares of one rig's pose on its pictures' edges."""

    scene: Scene
    rig: Rig
    cameras: list[EdgeIndex]
    fields: list[Evidence]
    prior: Prior
    unknowns: CameraUnknowns
    p: LocalisationParameters
    predicted: dict[tuple[bytes, int], Prediction] = field(default_factory=dict)

    @classmethod
    def of(
        cls,
        scene: Scene,
        rig: Rig,
        indexes: dict[str, EdgeIndex],
        fields: list[Evidence],
        prior: Prior,
        p: LocalisationParameters = DEFAULTS,
    ) -> Fit:
        """The problem of the pictures' edges, by camera; fields: their evidence, in the order of the rig's cameras."""
        cameras = [indexes[name] for name in rig.cameras]
        return cls(scene, rig, cameras, fields, prior, describe_unknowns(rig, p.refinement), p)

    def refine(self, world_from_rig: Floats) -> Refined:
        """The pose near `world_from_rig` that fits the pictures' edges and the prior best, and its covariance.

        Placed parts that stand elsewhere in the world pull the pose however robust the loss.  So a part that
        contradicts the others is left out of the least squares, where the whole then gathers no less evidence with that
        part looked for near its place.  Where two that determine the pose about equally contradict each other, either
        may be off.  All such explanations are `others` of the pose, and its covariance joins them in proportion to
        their evidence.  The start stays where it has clearly more evidence.
        """
        none = np.zeros(len(self.scene.inspected), bool)
        refined = self.solve(world_from_rig, none)
        rejected: list[Refined] = []
        while others := [h for c in self.find_outliers(refined) if (h := self.leave_out(refined, c)) is not None]:
            usable = [h for h in others if self.is_determined(h) or not self.is_determined(refined)]
            far = [_distance(refined, h) > self.p.refinement.max_shift_sigma for h in usable]
            best = next((h for h, f in zip(usable, far, strict=True) if f and h.cost <= refined.cost), refined)
            rejected += [h for h in usable if h is not best]
            if best is refined:
                break
            rejected.append(refined)
            refined = best
        start = self.measure(world_from_rig, self.unknowns.mean, none)
        near = self.solve(world_from_rig, none, self.p.refinement.rounds[-self.p.refinement.near_rounds :])
        # A view of nothing costs nothing, and no prior holds the pose where there is none.
        other = min([near, start], key=lambda h: (h.sees_nothing, h.cost))
        if refined.sees_nothing or (
            not other.sees_nothing and other.cost < refined.cost - self.p.refinement.least_gain
        ):
            refined = other
        explanations = [
            Explanation(h.world_from_rig, h.covariance, -self.p.refinement.temper * max(h.cost - refined.cost, 0.0))
            for h in rejected
        ]
        rest = tuple(_take_step(h, self, []) for h in rejected)
        return replace(_take_step(refined, self, explanations), others=rest)

    def refine_roughly(self, world_from_rig: Floats) -> Refined:
        """As `refine`, from a pose that is nearly right, by the last rounds alone and with no part left out: enough to
        compare it with others."""
        none = np.zeros(len(self.scene.inspected), bool)
        refined = self.solve(world_from_rig, none, self.p.refinement.rounds[-self.p.refinement.near_rounds :])
        return replace(_take_step(refined, self, []), is_rough=True)

    def refine_without_arcs(self, refined: Refined) -> list[Refined]:
        """Poses to which least squares leads where one arc of a refined pose lies on another edge altogether, as of a
        print: fitted by all rounds without the arc, then roughly with it.

        An arc that alone determines the pose in some direction fits wherever it lies, so that nothing at the pose
        itself tells; of these, the ones that determine most.
        """
        without = (
            self.solve(refined.world_from_rig, refined.excluded, arc=arc).world_from_rig
            for arc in self.find_leading_arcs(refined)
        )
        return [self.refine_roughly(pose) for pose in without]

    def predict(self, world_from_rig: Floats, samples: int) -> Prediction:
        """What the cameras see from a pose; solutions begin where others began or ended."""
        key = (world_from_rig.tobytes(), samples)
        if key not in self.predicted:
            self.predicted[key] = predict(self.scene, self.rig, world_from_rig, samples, p=self.p)
        return self.predicted[key]

    def solve(
        self,
        world_from_rig: Floats,
        excluded: Bools,
        rounds: tuple[tuple[float, float], ...] | None = None,
        arc: int | None = None,
    ) -> Refined:
        """The best pose from all occurrences that are not excluded, by all rounds or by those given; without an arc of
        the scene, where one is named."""
        p, pose, own = self.p, world_from_rig, self.unknowns.mean
        for reach, scale in rounds or p.refinement.rounds:
            prediction = self.predict(pose, p.refinement.samples)
            votes = ~excluded[self.scene.occurrence_of_arc[prediction.arc]] & (prediction.arc != arc)
            delta = np.zeros(6)
            if (reach, scale) != p.refinement.rounds[0]:
                m = measure(prediction, self.cameras, delta, self.unknowns, own, reach, scale, votes, p)
                delta = _find_consensus(m, prediction, self.prior, pose, p)
            for _ in range(p.refinement.steps):
                m = measure(prediction, self.cameras, delta, self.unknowns, own, reach, scale, votes, p)
                here = perturb(pose, delta)
                hessian, gradient = self._normal_equations(hold_shifts(m, prediction), here, own)
                step = np.asarray(np.linalg.solve(hessian, gradient), float)
                delta = perturbation(pose, perturb(here, step[:6]))
                own = own + step[6:].reshape(own.shape)
                if step @ hessian @ step < p.refinement.min_step_sigma**2:
                    break
            pose = perturb(pose, delta)
        return self.measure(pose, own, excluded)

    def measure(self, pose: Floats, own: Floats, excluded: Bools) -> Refined:
        """What the pictures say of a pose as it stands."""
        p = self.p
        prediction = self.predict(pose, p.refinement.samples)
        occurrence = self.scene.occurrence_of_arc[prediction.arc]
        votes = ~excluded[occurrence]
        last = p.refinement.rounds[-1]
        m = measure(prediction, self.cameras, np.zeros(6), self.unknowns, own, *last, votes, p)
        held = hold_shifts(m, prediction)
        hessian, _ = self._normal_equations(held, pose, own)
        return Refined(
            pose,
            compute_covariance(m, held, prediction, group_by_stretch(prediction), hessian, self.unknowns, p),
            own,
            prediction,
            m,
            excluded,
            measure_support(prediction, m, own, self.fields, self.cameras, np.where(votes, -1, occurrence), p),
            self.prior.distance(pose),
        )

    def is_determined(self, refined: Refined) -> bool:
        """Whether the pictures, taken as right, determine the pose better than the prior in every direction.  The
        scatter of their edges about the model says how exactly the pose is known, not whether it is determined."""
        held = hold_shifts(refined.measurements, refined.prediction)
        hessian, _ = self._normal_equations(held, refined.world_from_rig, refined.own)
        left = np.linalg.eigvals(np.linalg.inv(hessian)[:6, :6] @ self.prior.information).real
        return float(left.max()) < self.p.refinement.max_prior_share

    def leave_out(self, refined: Refined, occurrence: int) -> Refined | None:
        """The pose without an occurrence; None where that moves it no further than its errors explain."""
        excluded = refined.excluded.copy()
        excluded[occurrence] = True
        without = self.solve(refined.world_from_rig, excluded)
        p = self.p.refinement
        far = _distance(refined, without) > p.max_shift_sigma or _distance(without, refined) > p.max_joint_shift_sigma
        return without if far else None

    def find_outliers(self, refined: Refined) -> list[int]:
        """The occurrence whose removal, to first order, moves the pose furthest: one of those that determine it less
        than the others together, and one of those that determine it more, unless most of what was found belongs to
        it."""
        p, m = self.p, hold_shifts(refined.measurements, refined.prediction)
        occurrence, group = np.unique(self.scene.occurrence_of_arc[refined.prediction.arc], return_inverse=True)
        if len(occurrence) < 2:
            return []
        group = group.ravel()
        hessian, _ = self._normal_equations(m, refined.world_from_rig, refined.own)
        gradients, hessians = _by_group(m, group)
        priors = hessian - hessians.sum(axis=0)
        lesser = np.linalg.slogdet(hessians + priors)[1] < np.linalg.slogdet(hessian - hessians)[1]
        found = np.bincount(group, refined.prediction.weight * (m.weight > 0))
        greater = ~lesser & (found < p.refinement.max_left_out * found.sum())
        shifts = np.linalg.solve(hessian - hessians, gradients[..., None])[:, :6, 0]
        sigmas = np.einsum("bi,ij,bj->b", shifts, np.linalg.inv(refined.covariance), shifts)
        worst = [int(np.argmax(sigmas * some)) for some in (lesser, greater) if some.any()]
        return [int(occurrence[w]) for w in worst if sigmas[w] > p.refinement.suspect_sigma**2]

    def find_leading_arcs(self, refined: Refined) -> list[int]:
        """The arcs that hold most of what is known of the pose in some direction, those that hold most first."""
        m = hold_shifts(refined.measurements, refined.prediction)
        arc, group = np.unique(refined.prediction.arc, return_inverse=True)
        hessian, _ = self._normal_equations(m, refined.world_from_rig, refined.own)
        _, hessians = _by_group(m, group.ravel())
        # A weight just short of all of it: what an arc alone determines would be known in no way without it.
        without = np.linalg.inv(hessian - 0.999 * hessians)[:, :6, :6]
        known = np.linalg.inv(np.linalg.inv(hessian)[:6, :6])
        share = 1 - 1 / np.linalg.eigvals(known @ without).real.max(axis=1, initial=1.0)
        order = np.argsort(-share, kind="stable")[: self.p.rivals.leading_arcs]
        return [int(arc[a]) for a in order if share[a] > self.p.rivals.leading_share]

    def _normal_equations(self, m: Measurements, world_from_rig: Floats, own: Floats) -> tuple[Floats, Floats]:
        return normal_equations(m, world_from_rig, own, self.prior, self.unknowns)


def _find_consensus(
    m: Measurements, prediction: Prediction, prior: Prior, world_from_rig: Floats, p: LocalisationParameters
) -> Floats:
    """The step (6,) on which most of the measured length agrees, of steps that few arcs make and of none.

    Where a structure of the model stands elsewhere in the world, least squares lies between it and the rest however
    robust the loss; a step from a few arcs of the rest does not (Fischler and Bolles, with arcs as the unit).
    """
    hit = np.flatnonzero(m.weight > 0)
    if not len(hit):
        return np.zeros(6)
    group = prediction.image_of_arc[hit]
    jacobian, offset, w = m.jacobian[hit, :6], m.offset[hit], prediction.weight[hit]
    count = int(group.max()) + 1
    hessians = sum_by_group(group, jacobian[:, :, None] * jacobian[:, None, :], count)
    gradients, length = sum_by_group(group, jacobian * offset[:, None], count), np.bincount(group, w)
    usable = np.flatnonzero(length > 0)
    rng = np.random.default_rng(p.refinement.seed)
    size = min(p.refinement.drawn_arcs, len(usable))
    keys = rng.exponential(size=(p.refinement.draws, len(usable))) / length[usable]
    # The smallest of exponentials with these rates: a draw without replacement in proportion to length.
    drawn = usable[np.argsort(keys, axis=1)[:, :size]]
    information = prior.information
    away = np.zeros(6) if prior.is_open else perturbation(prior.world_from_rig, world_from_rig)
    steps = np.linalg.solve(
        hessians[drawn].sum(axis=1) + information, (gradients[drawn].sum(axis=1) - information @ away)[..., None]
    )[..., 0]
    steps = np.concatenate([np.zeros((1, 6)), steps])
    left = (offset[:, None] - jacobian @ steps.T) / p.refinement.consensus_px
    return np.asarray(steps[int(np.argmax(w @ np.maximum(1 - left**2, 0)))])


def _by_group(m: Measurements, group: Ints) -> tuple[Floats, Floats]:
    """Gradients (g, u) and Hessians (g, u, u) that groups of samples add to the normal equations."""
    size = m.jacobian.shape[1]
    if not len(group):
        return np.zeros((0, size)), np.zeros((0, size, size))
    weight = m.weight / m.sigma**2
    order = np.argsort(group, kind="stable")
    first = np.searchsorted(group[order], np.arange(int(group.max()) + 1))
    products = m.jacobian[:, :, None] * m.jacobian[:, None, :] * weight[:, None, None]
    gradients = np.add.reduceat((m.jacobian * (weight * m.offset)[:, None])[order], first)
    return gradients, np.add.reduceat(products[order], first)
