"""The pose of a rig from its pictures, the model and a prior: search, refine, rivals, verdict."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from relmodel.arrays import Bools, Floats, Ints
from vision.cameras.cameras import DEFAULT_NEEDS, Needs, Prior, Rig, perturb, perturbation, perturbations
from vision.clock import Clock
from vision.extraction.primitives import Primitives
from vision.localisation.alternatives import (
    ArcShapes,
    describe_arc_shapes,
    find_displacements,
    shift_poses,
)
from vision.localisation.calibration import correct_rig
from vision.localisation.elsewhere import gather_elsewhere
from vision.localisation.evidence import Fields, collect_edge_points
from vision.localisation.hypotheses import (
    Candidates,
    Stage,
    build_fine_evidence,
    climb,
    climb_each,
    predict,
    project_with_jacobians,
    search_poses,
    select_samples,
    select_under_prior,
)
from vision.localisation.localisation_parameters import DEFAULTS, LocalisationParameters
from vision.localisation.measurements import EdgeIndex
from vision.localisation.observation import Observation
from vision.localisation.outlines import GreyGrid, lay_grey_grids, measure_outlines
from vision.localisation.refine import Refined, refine, refine_roughly, refine_without_arcs
from vision.localisation.symmetry import complete_group, find_symmetries
from vision.localisation.verdict import HypothesisTable, Verdict, decide, find_standing
from vision.localisation.views import (
    EdgeMeasurements,
    ViewArcs,
    collect_edge_measurements,
    find_view_arcs,
)
from vision.scene.scene import Scene

Relate = Callable[[Sequence[Refined]], list[int]]
"""What the best labelling of the pictures by the views from each of some poses costs."""


@dataclass(frozen=True)
class View:
    """One camera at the best pose: the arcs it sees, and the edge elements measured."""

    arcs: ViewArcs
    measurements: EdgeMeasurements


@dataclass(frozen=True)
class Localisation:
    """What localisation found.

    verdict: what is to be thought of the best hypothesis.  best: the best hypothesis (None when nothing is in view);
    hypotheses: all that were refined, best first.  rivals: those of them that are about as likely as the best.
    equivalent: the poses (4, 4) of the rig, beside the best, that the model's symmetry makes of it.
    single_cameras: the pose each camera gives by itself, in the rig's order (where there are several).
    rig: as it stands at the best pose, with the unknowns of its cameras solved.
    edge_indexes: by camera, the edge elements of its picture.  views: by camera, what is seen at the best pose.
    timings_s by step.  stages: what the search kept, and what became of it.
    """

    verdict: Verdict
    best: Refined | None
    hypotheses: list[Refined]
    rivals: list[Refined]
    equivalent: list[Floats]
    single_cameras: list[Refined]
    rig: Rig
    edge_indexes: dict[str, EdgeIndex]
    views: dict[str, View]
    timings_s: dict[str, float]
    stages: list[Stage] = field(default_factory=list)


def localise(
    scene: Scene,
    seen: Observation,
    prior: Prior,
    needs: Needs = DEFAULT_NEEDS,
    p: LocalisationParameters = DEFAULTS,
    starts: Candidates | None = None,
    relate: Relate | None = None,
) -> Localisation:
    """The pose of the rig from what its cameras saw.

    starts: poses that a join gives, perturbations of the prior, with what each explains; where one explains enough, or
    the prior is open, they take the place of a scan of the prior's volume.  relate: tells a few rivals apart by
    relational matching.
    """
    clock, rig, pictures = Clock(), seen.rig, seen.pictures
    points = {name: collect_edge_points(pictures[name], camera, p.evidence) for name, camera in rig.cameras.items()}
    odds = {name: _partner_odds(pictures[name], has, p) for name, has in seen.partnered.items()}
    indexes = {name: EdgeIndex(own, odds.get(name, 0.0)) for name, own in points.items()}
    starts = _keep_worthy(starts or Candidates(np.zeros((0, 6)), np.zeros(0)), prior, p)
    is_scanned = not len(starts.score) and not prior.is_open
    if prior.is_open:
        near = select_samples(scene, rig, perturb(prior.world_from_rig, starts.delta), p.search.select_px, p)
    else:
        near = select_under_prior(scene, rig, prior, p)
    clock.lap("select")
    fine = build_fine_evidence(rig, points, p)
    if is_scanned:
        found = search_poses(near, rig, points, fine, prior, p)
        found = replace(found, stages=[*starts.stages, *found.stages])
    else:
        found = climb_each(near, rig, fine, prior, starts, p)
    clock.lap("search")
    if prior.is_open:
        # No prior holds a pose that the edges speak against: it would drift off to where nothing is seen.
        found = found.take(found.score > 0)
    solver = _Solver(scene, near, rig, indexes, fine, lay_grey_grids(rig, seen.greys, p.outlines), prior, p)
    hypotheses, stages = solver.hypotheses(found) if len(found.score) else ([], [])
    if prior.is_open:
        hypotheses = [h for h in hypotheses if _is_determined(h, prior, p)]
    clock.lap("refine")
    if not hypotheses:
        nothing = _say_why_nothing(rig, prior, len(starts.score) > 0)
        unknown = Verdict("refused", nothing, 0.0, [nothing], prior.sigma_translation_mm, prior.sigma_rotation, "all")
        return Localisation(unknown, None, [], [], [], [], rig, indexes, {}, clock.laps)
    hypotheses, standing, motions = _order(hypotheses, scene, p)
    if relate is not None and 1 < len(standing) <= p.verdict.most_related:
        distance = dict(zip(standing.tolist(), relate([hypotheses[h] for h in standing]), strict=True))
        hypotheses = [replace(h, relational_distance=distance.get(n, np.nan)) for n, h in enumerate(hypotheses)]
        hypotheses, standing, motions = _order(hypotheses, scene, p)
        clock.lap("relate")
    best = hypotheses[0]
    equivalent = [m @ best.world_from_rig for m in complete_group([m for m in motions if m is not None], p.symmetry)]
    names = rig.cameras if len(rig.cameras) > 1 else ()
    single = {name: solver.solve_single_camera(name, best.world_from_rig) for name in names}
    solved = correct_rig(rig, best.own)
    elsewhere = gather_elsewhere(near, solved, best.prediction, fine, solver.greys, best.world_from_rig, p)
    verdict = decide(hypotheses, standing, single, elsewhere, needs, p.verdict)
    clock.lap("verdict")
    views = {name: _view(scene, solved, name, best, indexes[name], p) for name in rig.cameras}
    clock.lap("view")
    rivals = [hypotheses[h] for h in standing[1:]]
    apart = list(single.values())
    return Localisation(
        verdict, best, hypotheses, rivals, equivalent[1:], apart, solved, indexes, views, clock.laps, stages
    )


def _order(
    hypotheses: list[Refined], scene: Scene, p: LocalisationParameters
) -> tuple[list[Refined], Ints, list[Floats | None]]:
    """Hypotheses with those that stand first, the one nearest the prior before the others; which of them stand, those
    that a symmetry of the model makes of the first left out; and the motions (4, 4) of those symmetries."""
    standing = find_standing(HypothesisTable.of(hypotheses), p.verdict)
    rest = np.setdiff1d(np.arange(len(hypotheses)), standing)
    best, *others = [hypotheses[h] for h in (*standing, *rest)]
    motions = find_symmetries(scene, best.world_from_rig, [h.world_from_rig for h in others], p.symmetry)
    others = [replace(h, is_symmetric=m is not None) for h, m in zip(others, motions, strict=True)]
    ordered = [replace(best, is_symmetric=False), *others]
    return ordered, find_standing(HypothesisTable.of(ordered), p.verdict), motions


def _say_why_nothing(rig: Rig, prior: Prior, is_joined: bool) -> str:
    """Why there is no pose, where a join gave starts or none."""
    if not prior.is_open:
        return "no arc of the model is in view near the prior"
    if len(rig.cameras) > 1:
        pictures, looked_at, cure = "pictures", "circles and straight edges", "a prior"
    else:
        pictures, looked_at, cure = "picture", "circles", "a prior or a second picture"
    if is_joined:
        return f"the edges of the {pictures} speak against each pose that the {looked_at} give: give {cure}"
    return f"too few {looked_at} of the {pictures} lie to each other as those of the model: give {cure}"


def _is_determined(h: Refined, prior: Prior, p: LocalisationParameters) -> bool:
    """Whether the pictures say more of a pose than a prior does."""
    left = np.linalg.eigvals(h.covariance @ prior.information).real
    return bool((left > 0).all() and left.max() < p.refinement.max_prior_share)


def _keep_worthy(starts: Candidates, prior: Prior, p: LocalisationParameters) -> Candidates:
    """Starts that explain enough beside the best, and under a prior enough for its volume not to be scanned; their
    stage says what became of each."""
    worthy = starts.score >= p.search.least_share * starts.score.max(initial=0.0)
    if not prior.is_open:
        worthy &= starts.score >= starts.enough
    rule = np.where(worthy, "goes_on", "little_evidence").tolist()
    return replace(starts, stages=[replace(stage, rule=rule) for stage in starts.stages]).take(worthy)


def _partner_odds(picture: Primitives, partnered: Bools, p: LocalisationParameters) -> Floats:
    """Of each edge element (n,), the log odds that its arc's partner in stereo, or the lack of one, gives."""
    odds = np.zeros(len(picture.elements.arc))
    of_arcs = picture.elements.arc >= 0
    has = partnered[picture.elements.arc[of_arcs]]
    odds[of_arcs] = np.where(has, p.refinement.partner_odds, p.refinement.no_partner_odds)
    return odds


def _view(scene: Scene, rig: Rig, name: str, refined: Refined, index: EdgeIndex, p: LocalisationParameters) -> View:
    seen = find_view_arcs(scene, rig.cameras[name], refined.world_from_rig @ rig.rig_from_camera[name], p)
    return View(seen, collect_edge_measurements(refined, list(rig.cameras).index(name), seen, index))


class _Followed(NamedTuple):
    """What became of a pose that was followed up, and the score it climbed to, NaN where it did not climb."""

    rule: str
    score: float = float("nan")


@dataclass(frozen=True)
class _Solver:
    """Refines poses and follows up those that could rival the best."""

    scene: Scene
    near: Scene
    rig: Rig
    indexes: dict[str, EdgeIndex]
    fine: Fields
    greys: list[GreyGrid]
    prior: Prior
    p: LocalisationParameters

    def hypotheses(self, found: Candidates) -> tuple[list[Refined], list[Stage]]:
        """Distinct refined poses, the one of least cost first: from the search's candidates, and from what repeats in
        the model about the best of them; and the stages that led to them."""
        r = self.p.rivals
        start = perturb(self.prior.world_from_rig, found.delta)
        done: list[Refined] = []
        self._add(self._refine(start[0]), done)
        least = np.where(np.arange(1, len(start)) <= r.candidates, r.min_candidate_share, r.min_equal_share)
        worthy = found.score[1:] > least * found.score[0]
        followed = iter(self._follow(start[1:][worthy], done))
        rule = ["refined", *(next(followed).rule if w else "little_evidence" for w in worthy)]
        *before, climbed = found.stages
        rule += ["beyond"] * (len(climbed.score) - len(rule))
        stages = [*before, replace(climbed, rule=rule)]
        self._settle(done)
        shapes = describe_arc_shapes(self.scene)
        asked: list[Refined] = []
        # The best may change as rivals come in: what repeats about the new best is asked too.  Where no prior bounds
        # that, the starts hold it already.
        for _ in range(0 if self.prior.is_open else r.rounds):
            if done[0] in asked:
                break
            asked.append(done[0])
            shifted = self._shifted(done[0], shapes)
            followed_up = self._follow(shifted, done)
            score = np.array([f.score for f in followed_up])
            delta = perturbations(self.prior.world_from_rig, np.reshape(shifted, (-1, 4, 4)))
            stages.append(Stage(f"shift {len(asked)}", delta, score, [f.rule for f in followed_up], len(score)))
            self._settle(done)
            self._leave_out_arcs(done)
        return done, stages

    def _leave_out_arcs(self, done: list[Refined]) -> None:
        """Appends the poses that are left where an arc of the best is none of the object; nothing to a pose that the
        edges speak against."""
        if done[0].support.found.sum() <= 0:
            return
        for h in refine_without_arcs(self.near, self.rig, self.indexes, self.fine, self.prior, done[0], self.p):
            self._add(self._outline(h), done)
        self._settle(done)

    def _settle(self, done: list[Refined]) -> None:
        """Sorts hypotheses by cost, and refines in full the best and, where several stand, the one that is given
        first."""
        while True:
            done.sort(key=lambda h: h.cost)
            first = done[find_standing(HypothesisTable.of(done), self.p.verdict)[0]]
            rough = [h for h in (done[0], first) if h.is_rough]
            if not rough:
                return
            done.remove(rough[0])
            self._add(self._refine(rough[0].world_from_rig), done)

    def _add(self, refined: Refined, done: list[Refined]) -> None:
        """Appends a pose, and those that explain the pictures otherwise, where they are distinct from those done."""
        for h in (refined, *refined.others):
            if not any(self._same(other, h.world_from_rig) for other in done):
                done.append(h)

    def solve_single_camera(self, name: str, pose: Floats) -> Refined:
        own = [self.fine[list(self.rig.cameras).index(name)]]
        return refine_roughly(self.near, self.rig.only(name), self.indexes, own, self.prior, pose, self.p)

    def _refine(self, pose: Floats, *, roughly: bool = False) -> Refined:
        solve = refine_roughly if roughly else refine
        refined = solve(self.near, self.rig, self.indexes, self.fine, self.prior, pose, self.p)
        return self._outline(replace(refined, others=tuple(self._outline(h) for h in refined.others)))

    def _outline(self, h: Refined) -> Refined:
        """A pose with the greys beside the outlines seen from it."""
        rig = correct_rig(self.rig, h.own)
        return replace(h, outlines=measure_outlines(self.near, rig, self.greys, h.world_from_rig, self.p.outlines))

    def _shifted(self, h: Refined, shapes: ArcShapes) -> list[Floats]:
        seen = h.prediction
        sharp = seen.arc < len(self.scene.arc_occurrence)
        depth = float(np.median(np.linalg.norm(seen.point, axis=1))) if len(seen.point) else 0.0
        reach = self.p.verdict.max_sigma * (self.prior.sigma_translation_mm + self.prior.sigma_rotation * depth)
        shifts = find_displacements(shapes, seen.arc[sharp], seen.weight[sharp], reach, self.p.rivals)
        return list(shift_poses(self.prior, h.world_from_rig, shifts, self.p.verdict.max_sigma + 1, self.p.rivals))

    def _follow(self, poses: Iterable[Floats], done: list[Refined]) -> list[_Followed]:
        """Refines poses that are not among those done and climb to evidence near the best's; appends to `done`, and
        says what became of each."""
        return [self._follow_one(pose, done) for pose in poses]

    def _follow_one(self, pose: Floats, done: list[Refined]) -> _Followed:
        r = self.p.rivals
        if len(done) >= r.max_refined:
            return _Followed("beyond")
        if any(self._same(h, pose) for h in done):
            return _Followed("like_a_refined_one")
        prediction = predict(self.near, self.rig, pose, r.samples, p=self.p)
        if not len(prediction.point):
            return _Followed("nothing_in_view")
        delta, scores = climb(
            prediction, self.fine, np.zeros((1, 6)), r.prior_weight * self.prior.information, r.first_px, r.last_px
        )
        score = float(scores[0])
        top = max(float(h.support.found.sum()) for h in done)
        polished = perturb(pose, delta[0])
        if score < r.min_evidence_share * top:
            return _Followed("little_evidence", score)
        if any(self._same(h, polished) for h in done):
            return _Followed("like_a_refined_one", score)
        new = self._refine(polished, roughly=True)
        if any(self._same(h, new.world_from_rig) for h in done):
            return _Followed("like_a_refined_one", score)
        done.append(new)
        return _Followed("refined", score)

    def _same(self, h: Refined, pose: Floats) -> bool:
        """Whether a pose shows what the hypothesis shows at the same place."""
        there = perturbation(h.world_from_rig, pose)
        _, jacobian = project_with_jacobians(h.prediction)
        moved = jacobian[:: max(len(jacobian) // 100, 1)] @ there
        return len(moved) > 0 and float(np.sqrt(2 * np.mean(moved**2))) < self.p.rivals.same_px
