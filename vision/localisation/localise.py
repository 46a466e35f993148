"""The pose of a rig from its pictures, the model and a prior: search, refine, rivals, verdict."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vision.cameras.cameras import Prior, Rig, perturb, perturbation
from vision.clock import Clock
from vision.extraction.arcs import Arcs
from vision.extraction.extract import Extraction
from vision.localisation.alternatives import ArcShapes, describe_arc_shapes, find_displacements, shift_poses
from vision.localisation.correspondence import Correspondences, correspond
from vision.localisation.evidence import Evidence, collect_edge_points
from vision.localisation.hypotheses import (
    Candidates,
    build_fine_evidence,
    climb,
    predict,
    project_with_jacobians,
    search_poses,
    select_samples,
)
from vision.localisation.refine import EdgeIndex, Refined, refine
from vision.localisation.scene import Floats, Scene
from vision.localisation.verdict import MAX_SIGMA, Hypothesis, assess_pose, decide, find_rivals
from vision.localisation.views import (
    EdgeMeasurements,
    ViewArcs,
    collect_edge_measurements,
    find_view_arcs,
    propagate_pose_sigma,
)

# Poses nearer than this (px, rms over what is seen) are one.
SAME_PX = 1.5
# Of the search's other candidates, those with at least FOLLOW_SHARE of the best one's score are followed up; of those
# and of shifted poses, the ones that climb to REFINE_SHARE of its evidence are refined.
FOLLOW_SHARE, FOLLOWED, REFINE_SHARE = 0.3, 6, 0.7
POLISH_SAMPLES = 1200
# So many hypotheses say enough of an ambiguity; the likeliest by the prior are followed first.
MOST_REFINED = 8


@dataclass(frozen=True)
class View:
    """One camera at the best pose: the arcs it sees, which image arcs they are, and the edge elements measured."""

    arcs: ViewArcs
    correspondences: Correspondences
    measurements: EdgeMeasurements


@dataclass(frozen=True)
class Localisation:
    """What localisation found.

    verdict: accepted | ambiguous | refused, reason: why.  best: the best hypothesis (None when nothing is in view);
    hypotheses: all that were refined, best first.  alone: the pose each camera gives by itself, in the rig's order
    (where there are several).  views: by camera, what is seen at the best pose.  timings_s by step.
    """

    verdict: str
    reason: str
    best: Hypothesis | None
    hypotheses: list[Hypothesis]
    alone: list[Refined]
    views: dict[str, View]
    timings_s: dict[str, float]


def localise(
    scene: Scene,
    rig: Rig,
    images: Mapping[str, NDArray[np.uint8] | Floats],
    extractions: dict[str, Extraction],
    prior: Prior,
) -> Localisation:
    """The pose of the rig, from its pictures (rows, columns) and what was extracted from them, by camera."""
    clock = Clock()
    points = {
        name: collect_edge_points(extractions[name].edges, images[name], camera) for name, camera in rig.cameras.items()
    }
    indexes = {name: EdgeIndex(p) for name, p in points.items()}
    near = select_samples(scene, rig, prior)
    clock.lap("select")
    fine = build_fine_evidence(rig, points)
    found = search_poses(near, rig, points, fine, prior)
    clock.lap("search")
    if not len(found.score):
        return Localisation("refused", "no arc of the model is in view near the prior", None, [], [], {}, clock.laps)
    solver = _Solver(scene, near, rig, indexes, fine, prior)
    hypotheses = solver.hypotheses(found)
    clock.lap("refine")
    # Where the pictures leave several, the one nearest the prior is given first.
    near_best = [hypotheses[0], *find_rivals(hypotheses[0], hypotheses[1:])]
    near_best.sort(key=lambda h: h.prior_sigma)
    hypotheses = near_best + [h for h in hypotheses if h not in near_best]
    best = near_best[0]
    alone = [solver.alone(name, best.refined.world_from_rig) for name in rig.cameras] if len(rig.cameras) > 1 else []
    answer, reason = decide(best, near_best[1:], list(rig.cameras), alone)
    clock.lap("verdict")
    views = {name: _view(scene, rig, name, best.refined, extractions[name].arcs, indexes[name]) for name in rig.cameras}
    clock.lap("correspond")
    return Localisation(answer, reason, best, hypotheses, alone, views, clock.laps)


def _view(scene: Scene, rig: Rig, name: str, refined: Refined, arcs: Arcs, index: EdgeIndex) -> View:
    seen = find_view_arcs(scene, rig.cameras[name], refined.world_from_rig @ rig.rig_from_camera[name])
    number = list(rig.cameras).index(name)
    sigma = propagate_pose_sigma(refined, number, seen.samples)
    return View(
        seen, correspond(seen, arcs, index.edges, sigma), collect_edge_measurements(refined, number, seen, index)
    )


@dataclass(frozen=True)
class _Solver:
    """Refines poses and follows up those that could rival the best."""

    scene: Scene
    near: Scene
    rig: Rig
    indexes: dict[str, EdgeIndex]
    fine: list[Evidence]
    prior: Prior

    def hypotheses(self, found: Candidates) -> list[Hypothesis]:
        """Distinct refined poses, the one of least cost first: from the search's candidates, and from what repeats in
        the model about the best of them."""
        start = [perturb(self.prior.world_from_rig, d) for d in found.delta[: 1 + FOLLOWED]]
        best = self._refine(start[0])
        done = [best]
        worthy = found.score[1 : 1 + FOLLOWED] > FOLLOW_SHARE * found.score[0]
        self._follow([pose for pose, w in zip(start[1:], worthy, strict=True) if w], done)
        shapes = describe_arc_shapes(self.scene)
        asked: list[Hypothesis] = []
        # The best may change as rivals come in: what repeats about the new best is asked too.
        for _ in range(3):
            done.sort(key=lambda h: h.cost)
            if done[0] in asked:
                break
            asked.append(done[0])
            self._follow(self._shifted(done[0], shapes), done)
        return done

    def alone(self, name: str, pose: Floats) -> Refined:
        return refine(self.near, self.rig.only(name), self.indexes, self.prior, pose)

    def _refine(self, pose: Floats) -> Hypothesis:
        return assess_pose(refine(self.near, self.rig, self.indexes, self.prior, pose), self.fine, self.prior)

    def _shifted(self, h: Hypothesis, shapes: ArcShapes) -> list[Floats]:
        p = h.refined.prediction
        sharp = p.arc < len(self.scene.arc_occurrence)
        depth = float(np.median(np.linalg.norm(p.point, axis=1))) if len(p.point) else 0.0
        reach = MAX_SIGMA * (self.prior.sigma_translation_mm + self.prior.sigma_rotation * depth)
        shifts = find_displacements(shapes, p.arc[sharp], p.weight[sharp], reach)
        return list(shift_poses(self.prior, h.refined.world_from_rig, shifts, MAX_SIGMA + 1))

    def _follow(self, poses: list[Floats], done: list[Hypothesis]) -> None:
        """Refines poses that are not among those done and climb to evidence near the best's; appends to `done`."""
        information = np.asarray(np.linalg.inv(self.prior.covariance), float)
        for pose in poses:
            if len(done) >= MOST_REFINED:
                return
            if any(self._same(h, pose) for h in done):
                continue
            prediction = predict(self.near, self.rig, pose, POLISH_SAMPLES)
            if not len(prediction.point):
                continue
            delta, score = climb(prediction, self.fine, np.zeros((1, 6)), 0.01 * information, 2.0, 0.5)
            top = max(h.evidence for h in done)
            polished = perturb(pose, delta[0])
            if score[0] < REFINE_SHARE * top or any(self._same(h, polished) for h in done):
                continue
            new = self._refine(polished)
            if not any(self._same(h, new.refined.world_from_rig) for h in done):
                done.append(new)

    @staticmethod
    def _same(h: Hypothesis, pose: Floats) -> bool:
        """Whether a pose shows what the hypothesis shows at the same place."""
        there = perturbation(h.refined.world_from_rig, pose)
        p = h.refined.prediction
        _, jacobian = project_with_jacobians(p)
        return bool(np.sqrt(np.mean((jacobian[:: max(len(jacobian) // 100, 1)] @ there) ** 2) * 2) < SAME_PX)
