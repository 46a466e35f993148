"""The rig's pose by least squares of predicted arcs on sub-pixel edge elements, over all cameras and with the prior."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from relmodel.arrays import Bools, Floats, Ints
from relmodel.geometry.transforms import rotation_matrix
from vision.cameras.cameras import Prior, Rig, perturb, perturbation
from vision.localisation.calibration import CameraUnknowns, describe_unknowns
from vision.localisation.evidence import Evidence
from vision.localisation.hypotheses import Prediction, predict
from vision.localisation.measurements import EdgeIndex, Measurements, group_by_arc, measure
from vision.localisation.parameters import DEFAULTS, LocalisationParameters
from vision.localisation.scene import Scene
from vision.localisation.support import Support, measure_support


@dataclass(frozen=True, eq=False)
class Refined:
    """A refined pose, its covariance (6, 6), each camera's own unknowns (c, 10), and what it rests on.

    excluded (b,): which of the scene's components are left out because they are not where the model says.
    prior_sigma: its distance from the prior.  cost: half of that squared, less the evidence.
    """

    world_from_rig: Floats
    covariance: Floats
    own: Floats
    prediction: Prediction
    measurements: Measurements
    excluded: Bools
    support: Support
    prior_sigma: float

    @property
    def evidence(self) -> float:
        return self.support.evidence

    @property
    def cost(self) -> float:
        return 0.5 * self.prior_sigma**2 - self.evidence


def refine(
    scene: Scene,
    rig: Rig,
    indexes: dict[str, EdgeIndex],
    fields: list[Evidence],
    prior: Prior,
    world_from_rig: Floats,
    p: LocalisationParameters = DEFAULTS,
) -> Refined:
    """The pose near `world_from_rig` that fits the pictures' edges and the prior best, and its covariance.

    fields: the evidence of the pictures of the rig's cameras, in its order.  Components of the model that stand
    elsewhere in the world pull the pose however robust the loss.  So a component that contradicts the others is
    excluded, where the others determine the pose better than it does, and all that the model shows (the component
    too) loses no evidence by it.  Of start and end the pose with more evidence is kept."""
    fit = Fit(scene, rig, [indexes[n] for n in rig.cameras], fields, prior, describe_unknowns(rig, p.refinement), p)
    none = np.zeros(scene.component_count, bool)
    refined = fit.solve(world_from_rig, none)
    while (suspect := fit.find_outlier(refined)) is not None:
        excluded = refined.excluded.copy()
        excluded[suspect] = True
        without = fit.solve(refined.world_from_rig, excluded)
        pull = perturbation(without.world_from_rig, refined.world_from_rig)
        if pull @ np.linalg.solve(without.covariance, pull) < p.refinement.max_pull_sigma**2:
            break
        if without.cost > refined.cost:
            break
        refined = without
    start = fit.measure(world_from_rig, fit.unknowns.mean, none)
    return refined if refined.cost <= start.cost else start


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

    def solve(self, world_from_rig: Floats, excluded: Bools) -> Refined:
        """The best pose from all components that are not excluded."""
        p, pose, own = self.p, world_from_rig, self.unknowns.mean
        for reach, scale in p.refinement.rounds:
            prediction = predict(self.scene, self.rig, pose, p.refinement.samples, p=p)
            votes = ~excluded[self.scene.component_of_arc[prediction.arc]]
            delta = np.zeros(6)
            if (reach, scale) != p.refinement.rounds[0]:
                m = measure(prediction, self.cameras, delta, self.unknowns, own, reach, scale, votes, p)
                delta = _find_consensus(m, prediction, self.prior, pose, p)
            for _ in range(p.refinement.steps):
                m = measure(prediction, self.cameras, delta, self.unknowns, own, reach, scale, votes, p)
                here = perturb(pose, delta)
                hessian, gradient = self._normal_equations(m, here, own)
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
        prediction = predict(self.scene, self.rig, pose, p.refinement.samples, p=p)
        votes = ~excluded[self.scene.component_of_arc[prediction.arc]]
        last = p.refinement.rounds[-1]
        m = measure(prediction, self.cameras, np.zeros(6), self.unknowns, own, *last, votes, p)
        hessian, _ = self._normal_equations(m, pose, own)
        return Refined(
            pose,
            _covariance(m, prediction, hessian, p),
            own,
            prediction,
            m,
            excluded,
            measure_support(prediction, m, self.fields, p),
            self.prior.distance(pose),
        )

    def find_outlier(self, refined: Refined) -> int | None:
        """The component that, to first order, pulls the pose furthest of those that know less of it than the others
        together."""
        p, m = self.p, refined.measurements
        component, group = np.unique(self.scene.component_of_arc[refined.prediction.arc], return_inverse=True)
        if len(component) < 2:
            return None
        hessian, _ = self._normal_equations(m, refined.world_from_rig, refined.own)
        gradients, hessians = _by_group(m, group.ravel())
        priors = hessian - hessians.sum(axis=0)
        lesser = np.linalg.slogdet(hessians + priors)[1] < np.linalg.slogdet(hessian - hessians)[1]
        pulls = np.linalg.solve(hessian - hessians, gradients[..., None])[:, :6, 0]
        sigmas = np.einsum("bi,ij,bj->b", pulls, np.linalg.inv(refined.covariance), pulls) * lesser
        worst = int(np.argmax(sigmas))
        return int(component[worst]) if sigmas[worst] > p.refinement.suspect_sigma**2 else None

    def _normal_equations(self, m: Measurements, world_from_rig: Floats, own: Floats) -> tuple[Floats, Floats]:
        """Hessian and gradient by (t, r, each camera's own unknowns), the priors of all included."""
        scaled = m.jacobian * (m.weight / m.sigma**2)[:, None]
        hessian, gradient = scaled.T @ m.jacobian, scaled.T @ m.offset
        away = perturbation(self.prior.world_from_rig, world_from_rig)
        turn = np.eye(6)
        turn[:3, :3] = rotation_matrix(away[3:])
        information = turn.T @ self.prior.information
        hessian[:6, :6] += information @ turn
        gradient[:6] -= information @ away
        precision = self.unknowns.precision
        hessian[6:, 6:] += np.diag(precision)
        gradient[6:] -= precision * (own - self.unknowns.mean).ravel()
        return hessian, gradient


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
    group = group_by_arc(prediction)[hit]
    jacobian, offset, w = m.jacobian[hit, :6], m.offset[hit], prediction.weight[hit]
    count = int(group.max()) + 1
    hessians, gradients, length = np.zeros((count, 6, 6)), np.zeros((count, 6)), np.bincount(group, w)
    np.add.at(hessians, group, jacobian[:, :, None] * jacobian[:, None, :])
    np.add.at(gradients, group, jacobian * offset[:, None])
    usable = np.flatnonzero(length > 0)
    rng = np.random.default_rng(p.refinement.seed)
    size = min(p.refinement.drawn_arcs, len(usable))
    keys = rng.exponential(size=(p.refinement.draws, len(usable))) / length[usable]
    # The smallest of exponentials with these rates: a draw without replacement in proportion to length.
    drawn = usable[np.argsort(keys, axis=1)[:, :size]]
    information = prior.information
    away = perturbation(prior.world_from_rig, world_from_rig)
    steps = np.linalg.solve(
        hessians[drawn].sum(axis=1) + information, (gradients[drawn].sum(axis=1) - information @ away)[..., None]
    )[..., 0]
    steps = np.concatenate([np.zeros((1, 6)), steps])
    left = (offset[:, None] - jacobian @ steps.T) / p.refinement.consensus_px
    return np.asarray(steps[int(np.argmax(w @ np.maximum(1 - left**2, 0)))])


def _covariance(m: Measurements, prediction: Prediction, hessian: Floats, p: LocalisationParameters) -> Floats:
    """Covariance (6, 6) of a pose from its measurements: that of an M-estimator (Huber, 1981) whose measurements err in
    three ways.

    Samples near each other err together (texture, shading), so stretches of arcs are what is independent.  The image of
    an arc may be shifted as a whole (light, a clipped edge, an arc not where the model says), by a random effect whose
    variance is common to all arcs and is estimated from how far their mean offsets scatter, what the pose has
    followed taken off (Henderson's analysis of variance).  The priors err as they say.
    """
    group, stretch = group_by_arc(prediction), _group_by_stretch(prediction, p)
    weight = m.weight / m.sigma**2
    data = (m.jacobian * weight[:, None]).T @ m.jacobian
    # How far the loss bends away from the least squares that its weights make of it.
    bend = np.clip((m.slope / m.sigma**2).sum() / max(float(weight.sum()), 1e-12), 0.2, 1.0)
    inverse = np.linalg.inv(hessian - (1 - bend) * data)
    known = np.bincount(group, weight)
    rows = np.flatnonzero(known > 0)
    if not len(rows):
        return np.asarray(inverse[:6, :6])
    mean = np.bincount(group, weight * m.offset) / np.where(known > 0, known, 1.0)
    apart = (m.jacobian * (weight * (m.offset - mean[group]))[:, None]).T
    scatter = np.stack([np.bincount(stretch, row) for row in apart], axis=1)
    shift = np.stack([np.bincount(group, weight * column) for column in m.jacobian.T], axis=1)[rows]
    followed = np.clip(np.einsum("au,uv,av->a", shift, inverse, shift) / known[rows], 0, 0.9)
    noise = np.bincount(group, (weight * (m.offset - mean[group])) ** 2)[rows] / known[rows] ** 2
    length = np.bincount(group, m.weight)[rows]
    beyond = float((length * (mean[rows] ** 2 - noise)).sum() / (length * (1 - followed) ** 2).sum())
    meat = (
        scatter.T @ scatter
        + p.refinement.inflation * max(beyond, p.refinement.arc_shift_px**2) * shift.T @ shift
        + hessian
        - data
    )
    return np.asarray((inverse @ meat @ inverse)[:6, :6])


def _group_by_stretch(prediction: Prediction, p: LocalisationParameters) -> Ints:
    """A number for each stretch of `p.search.correlation_px` of each arc's image (n,)."""
    group = group_by_arc(prediction)
    order = np.argsort(group, kind="stable")
    along = np.cumsum(prediction.weight[order])
    first = np.searchsorted(group[order], np.arange(int(group.max(initial=-1)) + 1))
    number = np.empty(len(group), np.int64)
    number[order] = np.floor(along - along[first][group[order]]).astype(np.int64)
    pairs = group * (int(number.max(initial=0)) + 1) + number
    return np.asarray(np.unique(pairs, return_inverse=True)[1].ravel())


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
