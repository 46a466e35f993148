"""The pose of a rig from pictures, model and prior: search, refine, rivals by symmetry and repetition, verdict."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import radians
from typing import Any

import numpy as np

from relmodel.arrays import Bools, Floats, Ints, sum_by_group
from relmodel.geometry.transforms import rotation_matrix
from relmodel.progress import Clock
from vision.cameras.cameras import DEFAULT_NEEDS, Needs, Prior, Rig, perturb, perturbation, perturbations
from vision.extraction.rows import Primitives
from vision.localisation.hypotheses import (
    Fields,
    Perturbations,
    Stage,
    build_fine_evidence,
    climb_each,
    climb_from,
    collect_edge_points,
    project_with_jacobians,
    search_poses,
    select_samples,
    select_under_prior,
)
from vision.localisation.localisation_parameters import DEFAULTS, LocalisationParameters
from vision.localisation.measurements import EdgeIndex, correct_rig
from vision.localisation.refine import MAX_PRIOR_SHARE, Fit, LastStep, RefinedPose, join_explanations
from vision.localisation.support import GreyGrid, lay_grey_grids, measure_outlines
from vision.localisation.verdict import HypothesisTable, Verdict, decide, find_standing, gather_elsewhere
from vision.localisation.views import EdgeMeasurements, Observation, ViewArcs, collect_edge_measurements, find_view_arcs
from vision.scene import Scene


def align_with_lines(point: Floats, tangent: Floats, across: Floats, weight: Floats, middle: Floats) -> Floats:
    """Motions (k, 4, 4) that lead points (k, n, 3) of weights (k, n) onto lines along unit tangents (k, n, 3), from
    which they are `across` (k, n, 3) off: one step of least squares, turned about middles (k, 3); they slide along."""
    # A step (t, r) about the middle moves a point x by t + r x (x - middle).
    arm = point - middle[:, None]
    jacobian = np.zeros((*arm.shape, 6))
    jacobian[..., range(3), range(3)] = 1
    jacobian[..., 0, 4], jacobian[..., 0, 5] = arm[..., 2], -arm[..., 1]
    jacobian[..., 1, 5], jacobian[..., 1, 3] = arm[..., 0], -arm[..., 2]
    jacobian[..., 2, 3], jacobian[..., 2, 4] = arm[..., 1], -arm[..., 0]
    along = np.einsum("kni,knij->knj", tangent, jacobian)
    jacobian -= tangent[..., :, None] * along[..., None, :]
    count, points = across.shape[:2]
    flat = jacobian.reshape(count, 3 * points, 6)
    scaled = flat * np.repeat(weight, 3, axis=1)[..., None]
    hessian = scaled.transpose(0, 2, 1) @ flat + np.diag([1e-6] * 3 + [1e-3] * 3)
    gradient = np.einsum("kni,kn->ki", scaled, across.reshape(count, 3 * points))
    step = np.linalg.solve(hessian, -gradient[..., None])[..., 0]
    motion = np.zeros((count, 4, 4))
    motion[:, 3, 3] = 1
    motion[:, :3, :3] = rotation_matrix(step[:, 3:])
    motion[:, :3, 3] = middle + step[:, :3] - np.einsum("kij,kj->ki", motion[:, :3, :3], middle)
    return motion


# Symmetries of the model: motions of the whole that carry its arcs onto its arcs: no picture tells their poses apart.

SHARP_RAD = radians(5.0)  # between the faces of an edge, at least, that counts
FEW_SAMPLES = 600  # of edges on which a motion is fitted
# Between a moved sample and an edge in each step of the fit, beyond the stretch that a sample stands for.
REACHES_MM = (8.0, 3.0, 1.0, 0.5)
LEAST_ON_EDGES = 0.7  # share of these samples that lie on edges in each step; else there is no symmetry
TOLERANCE_MM = 0.25  # by which any sample may be off its edge at last: less than pictures tell
ALIKE_MM = 20.0  # that edges at right angles are apart beside their distance, where the nearest is looked for
PARALLEL = 0.97  # cosine of the directions of a moved edge and the one it lies on, at least
MOST_MOTIONS = 60  # of a group
SAME_MOTION = 0.05  # by which numbers of two matrices (mm for shifts) differ if they are one motion


def find_symmetries(scene: Scene, best: Floats, others: list[Floats]) -> list[Floats | None]:
    """For each pose of the rig beside the best, all (4, 4), the motion (4, 4) of the world that carries the model onto
    itself and the best pose there; None where there is none but the identity."""
    if not others:
        return []
    arcs = _Arcs(scene)
    return [arcs.fit(other @ np.linalg.inv(best)) for other in others]


def complete_group(motions: list[Floats]) -> list[Floats]:
    """All motions (4, 4) that follow from some, one after the other, the identity first; at most `MOST_MOTIONS`."""
    group = [np.eye(4)]
    for member in group:  # grows as it is walked
        for motion in motions:
            new = motion @ member
            if len(group) < MOST_MOTIONS and all(np.abs(new - known).max() > SAME_MOTION for known in group):
                group.append(new)
    return group


class _Arcs:
    """Samples of the model's sharp arcs, to see whether a motion carries them onto themselves."""

    def __init__(self, scene: Scene) -> None:
        from scipy.spatial import cKDTree

        rows = scene.reference_samples
        rows = rows[scene.sample_cosine[rows] < np.cos(SHARP_RAD)]
        self.point, self.tangent = scene.sample_point[rows], scene.sample_tangent[rows]
        self.length = scene.sample_length[rows]
        self.some = np.unique(np.linspace(0, max(len(rows) - 1, 0), FEW_SAMPLES).astype(np.int64))
        self._tree: Any = cKDTree(self._key(self.point, self.tangent))

    def fit(self, motion: Floats) -> Floats | None:
        """The symmetry (4, 4) near a motion; None where there is none."""
        if not len(self.point):
            return None
        for reach in REACHES_MM:
            found, point, tangent, across = self._meet(motion, self.some, reach)
            if found.mean() < LEAST_ON_EDGES:
                return None
            middle, weight = point.mean(axis=0)[None], found[None].astype(float)
            motion = align_with_lines(point[None], tangent[None], across[None], weight, middle)[0] @ motion
        every = np.arange(len(self.point))
        found, _, _, across = self._meet(motion, every, REACHES_MM[-1])
        is_same = found.all() and float(np.linalg.norm(across, axis=1).max()) <= TOLERANCE_MM
        # A pose beside the best leads back to it: the identity says nothing of the model.
        moved = self.point @ motion[:3, :3].T + motion[:3, 3] - self.point
        is_identity = float(np.linalg.norm(moved, axis=1).max()) <= 2 * TOLERANCE_MM
        return motion if is_same and not is_identity else None

    def _meet(self, motion: Floats, rows: Ints, reach: float) -> tuple[Bools, Floats, Floats, Floats]:
        """Of samples (n,) moved: which lie on an arc that runs the same way, within a sample's stretch of it and
        `reach` mm; where they are, that arc's tangents, and what lies across it between them, (n, 3) each."""
        point = self.point[rows] @ motion[:3, :3].T + motion[:3, 3]
        turned = self.tangent[rows] @ motion[:3, :3].T
        _, nearest = self._tree.query(self._key(point, turned))
        tangent = self.tangent[nearest]
        off = point - self.point[nearest]
        distance = np.linalg.norm(off, axis=1)
        across = off - np.einsum("ni,ni->n", off, tangent)[:, None] * tangent
        parallel = np.abs(np.einsum("ni,ni->n", turned, tangent)) > PARALLEL
        return (distance <= self.length[nearest] + reach) & parallel, point, tangent, across

    def _key(self, point: Floats, tangent: Floats) -> Floats:
        """Where (n, 9) samples lie and how they run, whichever way: where edges meet, the nearest has to run alike."""
        i, j = np.triu_indices(3)
        return np.hstack([point, ALIKE_MM * tangent[:, i] * tangent[:, j]])


# Poses that could be right beside the best because structure repeats.
# On identical pockets a pose shifted by one pitch looks the same. The shifts are read off the model: displacements that
# carry visible arcs onto congruent arcs, gathered by how much visible length they carry along.

CONGRUENT = 0.02  # share to which length and second moments of the tangents of congruent arcs agree
BOX_MM = 2.0  # boxes in which displacements of congruent arcs are gathered
MIN_VISIBLE_SHARE = 0.25  # of the visible length that a displacement must carry onto congruent arcs
DISPLACEMENTS = 12  # at most


@dataclass(frozen=True)
class ArcShapes:
    """One row an arc that has samples: its number, length, middle (3,) and mean outer product of tangents (6,)."""

    arc: Ints
    length: Floats
    middle: Floats
    moment: Floats


def describe_arc_shapes(scene: Scene) -> ArcShapes:
    """The shapes of a scene's arcs, for congruence up to displacement."""
    return scene.once("arc shapes", lambda: _describe(scene))


def _describe(scene: Scene) -> ArcShapes:
    has_samples = np.bincount(scene.sample_arc) > 0
    arc, row = np.flatnonzero(has_samples), (np.cumsum(has_samples) - 1)[scene.sample_arc]
    t, w = scene.sample_tangent, scene.sample_length
    i, j = np.triu_indices(3)
    columns = np.concatenate([np.ones((len(t), 1)), scene.sample_point, t[:, i] * t[:, j]], axis=1) * w[:, None]
    sums = sum_by_group(row, columns, len(arc))
    length = sums[:, 0]
    mean = sums[:, 1:] / np.maximum(length, 1e-12)[:, None]
    return ArcShapes(arc.astype(np.int64), length, mean[:, :3], mean[:, 3:])


def find_displacements(shapes: ArcShapes, visible_arc: Ints, visible_length: Floats, reach_mm: float) -> Floats:
    """Displacements (k, 3) of the world, mm, that carry much of what is visible onto congruent arcs, best first.
    visible_arc (n,), visible_length (n,): samples' arcs and what each stands for."""
    from scipy.spatial import cKDTree

    seen = np.bincount(visible_arc, visible_length, minlength=int(shapes.arc.max(initial=0)) + 1)[shapes.arc]
    rows = np.flatnonzero(seen > 0)
    if not len(rows):
        return np.zeros((0, 3))
    # Shape space scaled so that congruent arcs lie within 1 of each other.
    space = np.concatenate([np.log(np.maximum(shapes.length, 1e-9))[:, None], shapes.moment], axis=1) / CONGRUENT
    near: Any = cKDTree(space).query_ball_point(space[rows], 1.0, p=np.inf)
    count = np.array([len(n) for n in near])
    source = np.repeat(rows, count)
    target = np.concatenate([np.array(sorted(n), np.int64) for n in near])
    shift = shapes.middle[target] - shapes.middle[source]
    use = (source != target) & (np.linalg.norm(shift, axis=1) < reach_mm) & (np.linalg.norm(shift, axis=1) > BOX_MM)
    source, shift = source[use], shift[use]
    # Boxes are laid twice, half a box apart; an arc counts once in each.
    best: list[tuple[float, Floats]] = []
    for phase in (0.0, 0.5):
        box = np.floor(shift / BOX_MM + phase).astype(np.int64)
        pairs, first = np.unique(np.column_stack([box, source]), axis=0, return_index=True)
        boxes, row = np.unique(pairs[:, :3], axis=0, return_inverse=True)
        votes = np.bincount(row.ravel(), seen[pairs[:, 3]], minlength=len(boxes))
        for k in np.flatnonzero(votes >= MIN_VISIBLE_SHARE * seen.sum()):
            mine = shift[first[row.ravel() == k]]
            best.append((float(votes[k]), np.median(mine, axis=0)))
    best.sort(key=lambda v: (-v[0], *v[1]))
    left = np.array([d for _, d in best]).reshape(-1, 3)
    kept: list[Floats] = []
    while len(left):
        kept.append(left[0])
        left = left[np.linalg.norm(left - left[0], axis=1) > 2 * BOX_MM]
    return np.array(kept).reshape(-1, 3)


SELECT_PX = 60.0  # beyond the pictures within which arcs are kept about poses that need no search
LEAST_SHARE = 0.5  # of the best start's score from which others climb too, where the join gives starts
SAME_PX = 1.5  # rms over what is seen, within which two poses are one
# Other candidates are followed up from this share of the best one's score; beyond so many only from the second share.
MIN_CANDIDATE_SHARE, CANDIDATES, MIN_EQUAL_SHARE = 0.3, 6, 0.94
MIN_EVIDENCE_SHARE = 0.7  # of the best evidence to which a pose must climb to be refined
RIVAL_FIRST_PX, RIVAL_LAST_PX = 2.0, 0.5  # first and last step of that climb
RIVAL_PRIOR_WEIGHT = 0.01  # of the prior in it
SHIFT_ROUNDS = 3  # of shifting the best pose, which may change
HALVES_ALIKE = 4  # halves of the arcs that lead back, from which no more are tried
MAX_REFINED = 60  # hypotheses; the likeliest by the prior are followed first
# Log likelihood ratio of an edge of the object that a partner in stereo gives an arc, and that of none: of 14 rendered
# pairs .57 of the arcs along visible edges have a partner and .19 of others.
PARTNER_ODDS, NO_PARTNER_ODDS = 1.1, -0.63

Weigh = Callable[[RefinedPose, Mapping[str, EdgeIndex]], float]
"""Log odds of all edges seen from a pose, by the edge elements of each camera's picture."""


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
    timings_s by step.  stages: what the search kept, and what became of it."""

    verdict: Verdict
    best: RefinedPose | None
    hypotheses: list[RefinedPose]
    rivals: list[RefinedPose]
    equivalent: list[Floats]
    single_cameras: list[RefinedPose]
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
    starts: Perturbations | None = None,
    weigh: Weigh | None = None,
) -> Localisation:
    """The pose of the rig from what its cameras saw.

    starts: poses that a join gives, perturbations of the prior, with what each explains; where one explains enough, or
    the prior is open, they take the place of a scan of the prior's volume.  weigh: tells a few rivals apart."""
    clock, rig, pictures = Clock(), seen.rig, seen.pictures
    # Only without a prior, where a join has explained much: else a white ground excuses what a look-alike lacks.
    greys = seen.greys if prior.is_open else {}
    points = {name: collect_edge_points(pictures[name], it, greys.get(name)) for name, it in rig.cameras.items()}
    odds = {name: partner_odds(pictures[name], has) for name, has in seen.partnered.items()}
    indexes = {name: EdgeIndex(own, odds.get(name, 0.0)) for name, own in points.items()}
    starts = keep_worthy(starts or Perturbations(np.zeros((0, 6)), np.zeros(0)), prior)
    is_scanned = not len(starts.score) and not prior.is_open
    if prior.is_open:
        near = select_samples(scene, rig, perturb(prior.world_from_rig, starts.delta), SELECT_PX)
    else:
        near = select_under_prior(scene, rig, prior)
    clock.lap("select")
    fine = build_fine_evidence(rig, points)
    if is_scanned:
        found = search_poses(near, rig, points, fine, prior, p.search_seed)
        found = replace(found, stages=[*starts.stages, *found.stages])
    else:
        found = climb_each(near, rig, fine, prior, starts)
    clock.lap("search")
    if prior.is_open:
        # No prior holds a pose that the edges speak against: it would drift off to where nothing is seen.
        found = found.take(found.score > 0)
    solver = Solver(scene, near, rig, indexes, fine, lay_grey_grids(rig, seen.greys), prior, p)
    hypotheses, stages = solver.hypotheses(found) if len(found.score) else ([], [])
    if prior.is_open:
        hypotheses = [h for h in hypotheses if _is_determined(h, prior)]
    clock.lap("refine")
    if not hypotheses:
        nothing = say_why_nothing(rig, prior, len(starts.score) > 0)
        unknown = Verdict("refused", nothing, 0.0, [nothing], prior.sigma_translation_mm, prior.sigma_rotation, "all")
        return Localisation(unknown, None, [], [], [], [], rig, indexes, {}, clock.laps)
    hypotheses, standing, motions = _order(hypotheses, scene, p)
    if weigh is not None and 1 < len(standing) <= p.verdict.most_told:
        for n in standing.tolist():
            hypotheses[n] = replace(hypotheses[n], told=weigh(hypotheses[n], indexes))
        hypotheses, standing, motions = _order(hypotheses, scene, p)
        clock.lap("weigh")
    best, standing = join_near(hypotheses, standing, needs)
    several = rig.cameras if len(rig.cameras) > 1 else ()
    single = {name: solver.solve_single_camera(name, best.world_from_rig) for name in several}
    if rig.moved is not None and single and (again := solver.fit.resolve(best, single)) is not best:
        best = min(best, solver._outline(again), key=lambda h: h.cost)
    hypotheses[0] = best = solver.fit.show(best)
    equivalent = [m @ best.world_from_rig for m in complete_group([m for m in motions if m is not None])[1:]]
    solved = correct_rig(rig, best.camera_unknowns)
    elsewhere = gather_elsewhere(near, solved, best.prediction, fine, solver.greys, best.world_from_rig, p)
    verdict = decide(hypotheses, standing, single, elsewhere, rig, needs, p.verdict)
    clock.lap("verdict")
    views = {name: _view(scene, solved, name, best, indexes[name]) for name in rig.cameras}
    clock.lap("view")
    rivals = [hypotheses[h] for h in standing[1:]]
    return Localisation(
        verdict, best, hypotheses, rivals, equivalent, list(single.values()), solved, indexes, views, clock.laps, stages
    )


def _order(
    hypotheses: list[RefinedPose], scene: Scene, p: LocalisationParameters
) -> tuple[list[RefinedPose], Ints, list[Floats | None]]:
    """Put the hypotheses that stand before the others, the one nearest the prior first.

    Also gives the rows of those that stand, without those that a symmetry of the model makes of the first, and the
    motions (4, 4) of the symmetries, None where there is none."""
    standing = find_standing(HypothesisTable.of(hypotheses), p.verdict)
    rest = np.setdiff1d(np.arange(len(hypotheses)), standing)
    best, *others = [hypotheses[h] for h in (*standing, *rest)]
    motions = find_symmetries(scene, best.world_from_rig, [h.world_from_rig for h in others])
    others = [replace(h, is_symmetric=m is not None) for h, m in zip(others, motions, strict=True)]
    ordered = [replace(best, is_symmetric=False), *others]
    return ordered, find_standing(HypothesisTable.of(ordered), p.verdict), motions


def join_near(hypotheses: Sequence[RefinedPose], standing: Ints, needs: Needs) -> tuple[RefinedPose, Ints]:
    """The first of the hypotheses that stand, and which do still: those that lie no farther from it than is needed are
    no rivals, and join its covariance."""
    best = hypotheses[standing[0]]
    apart = perturbations(best.world_from_rig, np.stack([hypotheses[n].world_from_rig for n in standing]))
    aside = np.linalg.norm(apart[:, :3] + np.cross(apart[:, 3:], best.middle), axis=1)
    near = (aside <= needs.translation_mm) & (np.linalg.norm(apart[:, 3:], axis=1) <= needs.rotation)
    last = best.last_step or LastStep(best.world_from_rig, best.camera_unknowns, best.covariance, [])
    last = replace(last, explanations=last.explanations + best.against([hypotheses[n] for n in standing[near][1:]]))
    covariance = join_explanations(last.world_from_rig, last.covariance, last.explanations)
    return replace(best, covariance=covariance, last_step=last), np.append(standing[:1], standing[~near])


def say_why_nothing(rig: Rig, prior: Prior, is_joined: bool) -> str:
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


def _is_determined(h: RefinedPose, prior: Prior) -> bool:
    """Whether the pictures say more of a pose than a prior does."""
    left = np.linalg.eigvals(h.covariance @ prior.information).real
    return bool((left > 0).all() and left.max() < MAX_PRIOR_SHARE)


def keep_worthy(starts: Perturbations, prior: Prior) -> Perturbations:
    """Starts that explain enough beside the best, and under a prior enough for its volume not to be scanned; their
    stage says what became of each."""
    worthy = starts.score >= LEAST_SHARE * starts.score.max(initial=0.0)
    if not prior.is_open:
        worthy &= starts.score >= starts.enough
    rule = np.where(worthy, "goes_on", "little_evidence").tolist()
    return replace(starts, stages=[replace(stage, rule=rule) for stage in starts.stages]).take(worthy)


def partner_odds(picture: Primitives, partnered: Bools) -> Floats:
    """Of each edge element (n,), the log odds that its arc's partner in stereo, or the lack of one, gives."""
    odds = np.zeros(len(picture.elements.arc))
    of_arcs = picture.elements.arc >= 0
    has = partnered[picture.elements.arc[of_arcs]]
    odds[of_arcs] = np.where(has, PARTNER_ODDS, NO_PARTNER_ODDS)
    return odds


def _view(scene: Scene, rig: Rig, name: str, refined: RefinedPose, index: EdgeIndex) -> View:
    seen = find_view_arcs(scene, rig.cameras[name], refined.world_from_rig @ rig.rig_from_camera[name])
    return View(seen, collect_edge_measurements(refined, list(rig.cameras).index(name), seen, index))


@dataclass(frozen=True)
class Solver:
    """Refines poses and follows up those that could rival the best."""

    scene: Scene
    near: Scene
    rig: Rig
    indexes: dict[str, EdgeIndex]
    fine: Fields
    greys: list[GreyGrid]
    prior: Prior
    p: LocalisationParameters

    @cached_property
    def fit(self) -> Fit:
        """Least squares of all cameras."""
        return Fit(self.near, self.rig, self.indexes, self.fine, self.prior, self.p.refinement_seed)

    def hypotheses(self, found: Perturbations) -> tuple[list[RefinedPose], list[Stage]]:
        """Distinct refined poses, the one of least cost first: from the search's candidates, and from what repeats in
        the model about the best of them; and the stages that led to them."""
        start = perturb(self.prior.world_from_rig, found.delta)
        done: list[RefinedPose] = []
        self._add(self._refine(start[0]), done)
        least = np.where(np.arange(1, len(start)) <= CANDIDATES, MIN_CANDIDATE_SHARE, MIN_EQUAL_SHARE)
        worthy = found.score[1:] > least * found.score[0]
        others = zip(start[1:], worthy, strict=True)
        rule = ["refined", *(self.follow(pose, done)[0] if w else "little_evidence" for pose, w in others)]
        *before, climbed = found.stages
        rule += ["beyond"] * (len(climbed.score) - len(rule))
        stages = [*before, replace(climbed, rule=rule)]
        self._settle(done)
        shapes = describe_arc_shapes(self.scene)
        asked: list[RefinedPose] = []
        # The best may change as rivals come in: what repeats about the new best is asked too.  Where no prior bounds
        # that, the starts hold it already.
        for _ in range(0 if self.prior.is_open else SHIFT_ROUNDS):
            if done[0] in asked:
                break
            asked.append(done[0])
            shifted = self.shift(done[0], shapes)
            followed = [self.follow(pose, done) for pose in shifted]
            rules, score = [rule for rule, _ in followed], np.array([score for _, score in followed])
            delta = perturbations(self.prior.world_from_rig, shifted)
            stages.append(Stage(f"shift {len(asked)}", delta, score, rules, len(score)))
            self._settle(done)
            self._halve(done)
        return done, stages

    def _halve(self, done: list[RefinedPose]) -> None:
        """Appends poses to which halves of the best's arcs lead, unless the first lead back or edges speak against."""
        best, tried = done[0], [done[0]]
        for number, pose in enumerate(self.fit.follow_halves(best) if best.support.found.sum() > 0 else ()):
            if not any(self._same(h, pose) for h in tried):
                tried.append(replace(best, world_from_rig=pose))
                self._add(self._refine(pose, roughly=True), done)
            if number + 1 == HALVES_ALIKE and len(tried) == 1:
                break
        self._settle(done)

    def _settle(self, done: list[RefinedPose]) -> None:
        """Sorts hypotheses by cost, and refines in full the best and, where several stand, the one given first."""
        while True:
            done.sort(key=lambda h: h.cost)
            first = done[find_standing(HypothesisTable.of(done), self.p.verdict)[0]]
            rough = [h for h in (done[0], first) if h.is_rough]
            if not rough:
                return
            done.remove(rough[0])
            self._add(self._refine(rough[0].world_from_rig), done)

    def _add(self, refined: RefinedPose, done: list[RefinedPose]) -> None:
        """Appends a pose, and those that explain the pictures otherwise, where they are distinct from those done."""
        for h in (refined, *refined.others):
            if not any(self._same(other, h.world_from_rig) for other in done):
                done.append(h)

    def solve_single_camera(self, name: str, pose: Floats) -> RefinedPose:
        own = [self.fine[list(self.rig.cameras).index(name)]]
        fit = Fit(self.near, self.rig.only(name), self.indexes, own, self.prior, self.p.refinement_seed)
        return fit.refine_roughly(pose)

    def _refine(self, pose: Floats, *, roughly: bool = False) -> RefinedPose:
        refined = self.fit.refine_roughly(pose) if roughly else self.fit.refine(pose)
        return self._outline(replace(refined, others=tuple(self._outline(h) for h in refined.others)))

    def _outline(self, h: RefinedPose) -> RefinedPose:
        """A pose with the greys beside the outlines seen from it."""
        rig = correct_rig(self.rig, h.camera_unknowns)
        return replace(h, outlines=measure_outlines(self.near, rig, self.greys, h.world_from_rig))

    def shift(self, h: RefinedPose, shapes: ArcShapes) -> Floats:
        """Poses (k, 4, 4) that displacements of the model onto itself make of one, the likeliest by the prior first."""
        seen = h.prediction
        sharp = seen.arc < len(self.scene.arc_occurrence)
        reach = self.p.verdict.max_sigma * (self.prior.sigma_translation_mm + self.prior.sigma_rotation * h.distance)
        shifts = find_displacements(shapes, seen.arc[sharp], seen.weight[sharp], reach)
        poses = np.repeat(h.world_from_rig[None], len(shifts), axis=0)
        poses[:, :3, 3] += shifts
        delta = perturbations(self.prior.world_from_rig, poses)
        distance = np.einsum("ki,ij,kj->k", delta, self.prior.information, delta)
        order = np.argsort(distance, kind="stable")
        most = (self.p.verdict.max_sigma + 1) ** 2
        return np.asarray(poses[order[distance[order] <= most][:DISPLACEMENTS]])

    def follow(self, pose: Floats, done: list[RefinedPose]) -> tuple[str, float]:
        """Refines a pose that is not among those done and climbs to evidence near the best's, and appends it to `done`;
        what became of it, and the score it climbed to, NaN where it did not climb."""
        if len(done) >= MAX_REFINED:
            return "beyond", np.nan
        if any(self._same(h, pose) for h in done):
            return "like_a_refined_one", np.nan
        information = RIVAL_PRIOR_WEIGHT * self.prior.information
        climbed = climb_from(self.near, self.rig, self.fine, pose, information, (RIVAL_FIRST_PX, RIVAL_LAST_PX))
        if climbed is None:
            return "nothing_in_view", np.nan
        polished, score = climbed
        if score < MIN_EVIDENCE_SHARE * max(float(h.support.found.sum()) for h in done):
            return "little_evidence", score
        if any(self._same(h, polished) for h in done):
            return "like_a_refined_one", score
        new = self._refine(polished, roughly=True)
        if any(self._same(h, new.world_from_rig) for h in done):
            return "like_a_refined_one", score
        done.append(new)
        return "refined", score

    def _same(self, h: RefinedPose, pose: Floats) -> bool:
        """Whether a pose shows what the hypothesis shows at the same place."""
        there = perturbation(h.world_from_rig, pose)
        _, jacobian = project_with_jacobians(h.prediction)
        moved = jacobian[:: max(len(jacobian) // 100, 1)] @ there
        return len(moved) > 0 and float(np.sqrt(2 * np.mean(moved**2))) < SAME_PX
