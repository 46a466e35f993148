"""The rig's pose by least squares of predicted arcs on sub-pixel edge elements, over all cameras and with the prior."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from relmodel.arrays import Bools, Floats, Ints
from relmodel.geometry.transforms import rotation_matrix
from vision.cameras.cameras import Prior, Rig, perturb, perturbation
from vision.localisation.evidence import EdgePoints
from vision.localisation.hypotheses import Prediction, predict, project_directions, project_with_jacobians
from vision.localisation.parameters import DEFAULTS, LocalisationParameters, RefinementParameters
from vision.localisation.scene import Scene


class EdgeIndex:
    """Edge elements of one picture bucketed by whole pixels."""

    def __init__(self, edges: EdgePoints) -> None:
        self.edges = edges
        self.columns, self.rows = (np.ceil(edges.high - edges.low).astype(int) + 1).tolist()
        cell = np.rint(edges.position - edges.low).astype(np.int64)
        cell = np.clip(cell, 0, [self.columns - 1, self.rows - 1])
        bucket = cell[:, 1] * self.columns + cell[:, 0]
        self.order = np.argsort(bucket, kind="stable")
        self.start = np.searchsorted(bucket[self.order], np.arange(self.rows * self.columns + 1))
        self.strength = np.maximum(np.abs(edges.contrast), 1e-3)
        self.texture = float(np.median(self.strength)) if len(self.strength) else 1.0

    def measure(
        self, pixel: Floats, direction: Floats, reach: float, scale: float, p: RefinementParameters
    ) -> tuple[Floats, Ints]:
        """Offsets (n,) px along the normals (-dy, dx) to the elements found (n,), -1 where there is none."""
        from vision.localisation import measure_kernels

        limits = np.array([reach, scale, p.min_cosine, p.max_beside_px])
        offset, found = np.empty(len(pixel)), np.empty(len(pixel), np.int64)
        measure_kernels.nearest_edges(
            pixel, direction, limits, self.edges.position, self.edges.normal, self.strength,
            self.start, self.order, np.array([self.columns, self.rows]), self.edges.low, offset, found,
        )  # fmt: skip
        return offset, found


@dataclass(frozen=True)
class Measurements:
    """Edge measurements of the samples of a prediction, as columns of equal length n.

    pixel (n, 2), direction (n, 2): predicted at the pose; offset (n,) px along (-dy, dx) to the edge element `found`
    (-1: none); sigma (n,) px; weight (n,) of the robust loss, 0..1, zero where the sample's component is excluded;
    jacobian (n, 6 + 3c) of the offset's prediction by the pose and the c cameras' own unknowns.
    """

    pixel: Floats
    direction: Floats
    offset: Floats
    found: Ints
    sigma: Floats
    weight: Floats
    jacobian: Floats


@dataclass(frozen=True)
class Refined:
    """A refined pose, its covariance (6, 6), each camera's own unknowns (c, 3), and what it rests on.

    excluded (b,): which of the scene's components are left out because they are not where the model says.
    """

    world_from_rig: Floats
    covariance: Floats
    cameras: Floats
    prediction: Prediction
    measurements: Measurements
    excluded: Bools


def refine(
    scene: Scene,
    rig: Rig,
    indexes: dict[str, EdgeIndex],
    prior: Prior,
    world_from_rig: Floats,
    p: LocalisationParameters = DEFAULTS,
) -> Refined:
    """The pose near `world_from_rig` that fits the pictures' edges and the prior best, and its covariance.

    Components of the model that stand elsewhere in the world pull the pose however robust the loss.  So a component
    that contradicts the others is excluded, where the others determine the pose better than it does."""
    cameras = [indexes[n] for n in rig.cameras]
    refined = _fit(scene, rig, cameras, prior, world_from_rig, np.zeros(scene.component_count, bool), p)
    while (suspect := _find_outlier(scene, refined, prior, p)) is not None:
        excluded = refined.excluded.copy()
        excluded[suspect] = True
        without = _fit(scene, rig, cameras, prior, refined.world_from_rig, excluded, p)
        pull = perturbation(without.world_from_rig, refined.world_from_rig)
        if pull @ np.linalg.solve(without.covariance, pull) < p.refinement.max_pull_sigma**2:
            break
        refined = without
    return refined


def _fit(
    scene: Scene,
    rig: Rig,
    cameras: list[EdgeIndex],
    prior: Prior,
    world_from_rig: Floats,
    excluded: Bools,
    p: LocalisationParameters,
) -> Refined:
    """The best pose from all components that are not excluded."""
    pose = world_from_rig
    own = np.tile(_camera_mean(p), (len(cameras), 1))
    for reach, scale in p.refinement.rounds:
        prediction = predict(scene, rig, pose, p.refinement.samples, p=p)
        votes = ~excluded[scene.component_of_arc[prediction.arc]]
        delta = np.zeros(6)
        if (reach, scale) != p.refinement.rounds[0]:
            m = measure(prediction, cameras, delta, own, reach, scale, votes, p)
            delta = _find_consensus(m, prediction, prior, pose, p)
        for _ in range(p.refinement.steps):
            m = measure(prediction, cameras, delta, own, reach, scale, votes, p)
            here = perturb(pose, delta)
            hessian, gradient = _normal_equations(m, prior, here, own, p)
            step = np.asarray(np.linalg.solve(hessian, gradient), float)
            delta = perturbation(pose, perturb(here, step[:6]))
            own = own + step[6:].reshape(own.shape)
            if step @ hessian @ step < p.refinement.min_step_sigma**2:
                break
        pose = perturb(pose, delta)
    prediction = predict(scene, rig, pose, p.refinement.samples, p=p)
    votes = ~excluded[scene.component_of_arc[prediction.arc]]
    m = measure(prediction, cameras, np.zeros(6), own, *p.refinement.rounds[-1], votes, p)
    hessian, _ = _normal_equations(m, prior, pose, own, p)
    return Refined(pose, _covariance(m, prediction, hessian, p), own, prediction, m, excluded)


def _find_outlier(scene: Scene, refined: Refined, prior: Prior, p: LocalisationParameters) -> int | None:
    """The component that, to first order, pulls the pose furthest of those that know less of it than the others
    together."""
    m = refined.measurements
    component, group = np.unique(scene.component_of_arc[refined.prediction.arc], return_inverse=True)
    if len(component) < 2:
        return None
    hessian, _ = _normal_equations(m, prior, refined.world_from_rig, refined.cameras, p)
    gradients, hessians = _by_group(m, group.ravel())
    priors = hessian - hessians.sum(axis=0)
    lesser = np.linalg.slogdet(hessians + priors)[1] < np.linalg.slogdet(hessian - hessians)[1]
    pulls = np.linalg.solve(hessian - hessians, gradients[..., None])[:, :6, 0]
    sigmas = np.einsum("bi,ij,bj->b", pulls, np.linalg.inv(refined.covariance), pulls) * lesser
    worst = int(np.argmax(sigmas))
    return int(component[worst]) if sigmas[worst] > p.refinement.suspect_sigma**2 else None


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
    group = _units(prediction)[hit]
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
    information = np.linalg.inv(prior.covariance)
    away = perturbation(prior.world_from_rig, world_from_rig)
    steps = np.linalg.solve(
        hessians[drawn].sum(axis=1) + information, (gradients[drawn].sum(axis=1) - information @ away)[..., None]
    )[..., 0]
    steps = np.concatenate([np.zeros((1, 6)), steps])
    left = (offset[:, None] - jacobian @ steps.T) / p.refinement.consensus_px
    return np.asarray(steps[int(np.argmax(w @ np.maximum(1 - left**2, 0)))])


def _camera_mean(p: LocalisationParameters) -> tuple[float, float, float]:
    """Expected values of a camera's own unknowns: response shift, principal point x and y."""
    return p.refinement.response_px, 0.0, 0.0


def _camera_sigma(p: LocalisationParameters) -> tuple[float, float, float]:
    """Their standard deviations."""
    r = p.refinement
    return r.response_sigma_px, r.calibration_px, r.calibration_px


def _units(prediction: Prediction) -> Ints:
    """A number for the image of each arc in each camera (n,)."""
    unit = prediction.view * (int(prediction.arc.max(initial=0)) + 1) + prediction.arc
    return np.asarray(np.unique(unit, return_inverse=True)[1].ravel())


def measure(
    prediction: Prediction,
    indexes: list[EdgeIndex],
    delta: Floats,
    own: Floats,
    reach: float,
    scale: float,
    votes: Bools,
    p: LocalisationParameters = DEFAULTS,
) -> Measurements:
    """What the edges say of a prediction whose pose is perturbed by `delta` (6,), given the cameras' `own`, and which
    samples vote (n,)."""
    pixel, jacobian = project_with_jacobians(prediction, delta)
    direction = project_directions(prediction, delta)
    normal = np.stack([-direction[:, 1], direction[:, 0]], axis=1)
    offset, found = np.zeros(len(pixel)), np.full(len(pixel), -1)
    sigma = np.ones(len(pixel))
    by_camera = np.zeros((len(pixel), len(indexes), 3))
    for number, index in enumerate(indexes):
        rows = np.flatnonzero(prediction.view == number)
        offset[rows], found[rows] = index.measure(
            np.ascontiguousarray(pixel[rows]),
            np.ascontiguousarray(direction[rows]),
            reach,
            scale,
            p.refinement,
        )
        hit = rows[found[rows] >= 0]
        edge, edges = found[hit], index.edges
        contrast = np.abs(edges.contrast[edge])
        sigma[hit] = np.sqrt(
            edges.sigma[edge] ** 2
            + p.refinement.systematic_px**2
            + (p.refinement.texture_px * index.texture / contrast) ** 2
        )
        polarity = np.sign(np.einsum("ni,ni->n", edges.normal[edge], normal[hit]))
        by_camera[hit, number, 0] = -polarity * contrast / edges.grey_range
        by_camera[hit, number, 1:] = normal[hit]
        offset[hit] -= by_camera[hit, number] @ own[number]
    # Geman and McClure's loss: an element at `scale` counts a quarter, one at three times that a hundredth.
    weight = np.where((found >= 0) & votes, 1 / (1 + (offset / scale) ** 2) ** 2, 0.0)
    own_derivative = by_camera.reshape(len(pixel), 3 * len(indexes))
    derivative = np.concatenate([np.einsum("ni,nij->nj", normal, jacobian), own_derivative], axis=1)
    return Measurements(pixel, direction, offset, found, sigma, weight, derivative)


def _normal_equations(
    m: Measurements, prior: Prior, world_from_rig: Floats, own: Floats, p: LocalisationParameters
) -> tuple[Floats, Floats]:
    """Hessian and gradient by (t, r, each camera's own unknowns), the priors of all included."""
    scaled = m.jacobian * (m.weight / m.sigma**2)[:, None]
    hessian, gradient = scaled.T @ m.jacobian, scaled.T @ m.offset
    away = perturbation(prior.world_from_rig, world_from_rig)
    turn = np.eye(6)
    turn[:3, :3] = rotation_matrix(away[3:])
    information = turn.T @ np.linalg.inv(prior.covariance)
    hessian[:6, :6] += information @ turn
    gradient[:6] -= information @ away
    precision = np.tile(np.power(_camera_sigma(p), -2), len(own))
    hessian[6:, 6:] += np.diag(precision)
    gradient[6:] -= precision * (own - _camera_mean(p)).ravel()
    return hessian, gradient


def _covariance(m: Measurements, prediction: Prediction, hessian: Floats, p: LocalisationParameters) -> Floats:
    """Covariance (6, 6) of a pose from its measurements: the jackknife with an arc's image as the unit.

    Neighbours along an arc err together (texture, shading, a clipped edge, an arc that is not where the model says), so
    whole arcs are left out in turn and the pose solved, to first order, without each: MacKinnon and White's HC3 for
    clusters, which does not trust arcs that pull the fit onto themselves.
    """
    gradients, hessians = _by_group(m, _units(prediction))
    moves = np.linalg.solve(hessian - hessians, gradients[..., None])[..., 0]
    bread = np.linalg.inv(hessian)
    # The priors err as they say.
    meat = hessian - hessians.sum(axis=0)
    return np.asarray((p.refinement.inflation * moves.T @ moves + bread @ meat @ bread)[:6, :6])


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
