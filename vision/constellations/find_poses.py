"""Poses of a rig from circles or straight edges, with a prior or without, of one picture or more: join, votes, fit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from sqlalchemy import Connection

from relmodel.arrays import Bools, Columns, Floats, Ints, count_from
from relmodel.features.holes import CIRCLE_DEFAULTS as KEPT
from relmodel.geometry.transforms import inverse, matrices, rigid
from relmodel.store.database import Database
from relmodel.store.runs import Run
from vision.cameras.cameras import Camera, Prior, Rig, perturb, perturbations
from vision.constellations.constellation_parameters import (
    DEFAULTS,
    ConstellationParameters,
    JoinParameters,
    OnePictureParameters,
)
from vision.constellations.elements import (
    Circles,
    EllipseFit,
    JoinedPairs,
    PictureEllipses,
    Relations,
    find_circles,
    find_ellipses,
    find_scene_circles,
    find_scene_lines,
    join_lines,
    read_circles,
    read_joined,
    read_lines,
    relate_lines,
    solve_line_poses,
    to_matrices,
    to_rows,
)
from vision.extraction.rows import Primitives
from vision.localisation.hypotheses import Perturbations, Stage
from vision.localisation.localise import PARALLEL, SHARP_RAD, align_with_lines, describe_arc_shapes, find_displacements
from vision.scene import Scene
from vision.stereo.triangulate import CURVES, SpaceArcs

ENOUGH = 0.15  # share of what stereo puts in space that a pose explains; for less a prior's volume is scanned
GATE_SIGMA = 5.0  # sigmas from the prior, in six dimensions, beyond which a pose is dropped
SOLVED_MM, SOLVED_RAD = 15.0, 0.02  # standard deviations of the rig's place and turn as a joined pair gives them
CELL_MM, CELL_RAD = 10.0, 0.08  # poses that put what is seen in one such cell, turned about alike, vote together
SCORED = 400  # poses of most votes that are scored, by each of two ways to count
FEW_POINTS = 150  # points of the scene that all these are scored on
FITTED = 60  # poses of these that are fitted to the model's arcs, distinct ones of the best score
POINTS = 800  # points of the scene that these are fitted to and scored on
REACHES_MM = (5.0, 4.0, 3.0, 2.0)  # between a point and an arc in each step of the fit
REACH_MM, SIGMA_MM = 4.0, 2.0  # between a point and an arc that may explain it, and its standard deviation across
DISTINCT_MM, DISTINCT_RAD = 12.0, 0.06  # poses that put what is seen nearer than this, turned less, are one
ALIKE_SHARE = 0.9  # of what the best pose explains, from which a pose is also shifted by what repeats in the model
KEPT_POSES = 100  # distinct poses that go on
STEP_MM, MOST_OF_ONE = 8.0, 200.0  # between points along a scene's arc, and how many mm of one count


def join_pairs(
    store: Database, connection: Connection, object_id: int, relations: Relations, p: JoinParameters
) -> JoinedPairs:
    """Join `Circles.relations` of circles in space with those of an object: `queries/constellations/join.sql`."""
    with store.relation(connection, "scene_relation", relations):
        joined = store.columns(connection, "constellations/join", object_id=object_id, **asdict(p))
    return read_joined(joined, "circle")


def count_alike(relations: Relations, joined: JoinedPairs) -> Ints:
    """How many pairs of a model (k,) each relation of a scene is like; 0 for those that were not joined."""
    a, b = (np.asarray(relations[name], np.int64) for name in ("unit_a", "unit_b"))
    size = int(max(a.max(initial=-1), b.max(initial=-1))) + 1
    alike = np.zeros((size, size), np.int64)
    alike[joined.scene[:, 0], joined.scene[:, 1]] = joined.alike
    return np.asarray(np.maximum(alike[a, b], alike[b, a]))


def solve_poses(scene: Circles, model: Circles, joined: JoinedPairs) -> Floats:
    """Poses (k, 2, 4, 4), model from scene, of joined pairs: centres fall together along their line, and the normals of
    the first circles, whose sign is open, either way.  NaN where a pair leaves the turn about its line open."""
    a, b = joined.scene.T
    c, d = joined.model.T
    here = _frames(scene.centre[b] - scene.centre[a], scene.normal[a] + _aligned(scene.normal, a, b))
    out = []
    normal = model.normal[c] + _aligned(model.normal, c, d)
    for sign in (1.0, -1.0):
        there = _frames(model.centre[d] - model.centre[c], sign * normal)
        rotation = there @ here.transpose(0, 2, 1)
        middle = 0.5 * (scene.centre[a] + scene.centre[b])
        shift = 0.5 * (model.centre[c] + model.centre[d]) - np.einsum("kij,kj->ki", rotation, middle)
        out.append(rigid(rotation, shift))
    return np.stack(out, axis=1)


def _aligned(normal: Floats, a: Ints, b: Ints) -> Floats:
    """The normals (k, 3) of the second circles, turned to the side of the first's, where both are nearly parallel: both
    together are surer than one.  Zero elsewhere."""
    cosine = np.einsum("ij,ij->i", normal[a], normal[b])
    return np.asarray(np.where(np.abs(cosine) > 0.9, np.sign(cosine), 0.0)[:, None] * normal[b])


def _frames(line: Floats, normal: Floats) -> Floats:
    """Axes (k, 3, 3), as columns: along the line, across both, and of the normal's part across the line; NaN where
    there is no line or no such part."""
    x = _unit(line)
    z = _unit(normal - np.einsum("ij,ij->i", normal, x)[:, None] * x)
    return np.stack([x, np.cross(z, x), z], axis=2)


def _unit(vectors: Floats) -> Floats:
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.asarray(vectors / np.where(length > 1e-9, length, np.nan))


# How much of what stereo puts in space lies on arcs of the model at a pose, and the fit of a pose to them.

_CHUNK = 1 << 18  # points that are looked up at once


@dataclass(frozen=True)
class _Met:
    """Points (k, n, 3) of a scene at poses, the rows (k, n) of the samples of arcs that are nearest and their unit
    tangents, what lies across these between arc and point, and which points (k, n) are explained."""

    point: Floats
    row: Ints
    tangent: Floats
    across: Floats
    found: Bools


@dataclass(frozen=True)
class ScenePoints:
    """Points (n, 3) mm along matched arcs in the rig's frame, unit directions (n, 3), and the length (n,) mm each
    stands for, times the probability that it is one of an edge."""

    point: Floats
    direction: Floats
    weight: Floats

    @cached_property
    def middle(self) -> Floats:
        """The middle (3,) of what is seen, the origin where nothing is."""
        return np.asarray(np.median(self.point, axis=0)) if len(self.point) else np.zeros(3)

    def thin(self, count: int) -> ScenePoints:
        """About `count` of them, evenly."""
        rows = np.unique(np.linspace(0, len(self.weight) - 1, min(count, len(self.weight))).astype(np.int64))
        return ScenePoints(self.point[rows], self.direction[rows], self.weight[rows])


def sample_scene(space: SpaceArcs) -> ScenePoints:
    """Points along the lines, circles and ellipses of matched arcs; free curves have ends only, and are left out."""
    straight = np.flatnonzero(space.curve == CURVES.index("line"))
    chord = space.end[straight] - space.start[straight]
    length = np.linalg.norm(chord, axis=1)
    rows, share, weight = _spread(length)
    points = [space.start[straight][rows] + share[:, None] * chord[rows]]
    directions = [chord[rows] / np.maximum(length[rows], 1e-9)[:, None]]
    weights = [weight]

    round_ = np.flatnonzero(np.isin(space.curve, [CURVES.index("circle"), CURVES.index("ellipse")]))
    centre, major, minor = (v[round_] for v in (space.conics.centre, space.conics.major, space.conics.minor))
    size = np.linalg.norm(major, axis=1)

    def angle(place: Floats) -> Floats:
        off = place[round_] - centre
        along = (np.einsum("ij,ij->i", off, axis) / np.einsum("ij,ij->i", axis, axis) for axis in (minor, major))
        return np.asarray(np.arctan2(*along))

    first, turn = angle(space.start), np.mod(angle(space.end) - angle(space.start) + np.pi, 2 * np.pi) - np.pi
    closed = np.linalg.norm(space.end[round_] - space.start[round_], axis=1) < 0.2 * size
    turn = np.where(closed, 2 * np.pi, turn)
    row, share, weight = _spread(size * np.abs(turn))
    t = (first[row] + share * turn[row])[:, None]
    points.append(centre[row] + np.cos(t) * major[row] + np.sin(t) * minor[row])
    tangent = -np.sin(t) * major[row] + np.cos(t) * minor[row]
    directions.append(tangent / np.linalg.norm(tangent, axis=1, keepdims=True))
    weights.append(weight)
    arcs = np.concatenate([straight[rows], round_[row]])
    return ScenePoints(
        np.concatenate(points), np.concatenate(directions), np.concatenate(weights) * space.edge_probability[arcs]
    )


def _spread(length: Floats) -> tuple[Ints, Floats, Floats]:
    """Of arcs of these lengths: the arc, the share of the way along it, and the weight of points spread along them."""
    count = np.clip(np.ceil(np.minimum(length, MOST_OF_ONE) / STEP_MM), 2, None).astype(np.int64)
    row, place = count_from(np.zeros_like(count), count)
    return row, (place + 0.5) / count[row], np.minimum(length, MOST_OF_ONE)[row] / count[row]


class ModelArcs:
    """Points along the model's sharp arcs, to find the nearest to a point."""

    def __init__(self, scene: Scene) -> None:
        from scipy.spatial import cKDTree

        rows = scene.reference_samples
        rows = rows[scene.sample_cosine[rows] < np.cos(SHARP_RAD)]
        self._shapes = describe_arc_shapes(scene)
        self.point, self.tangent = scene.sample_point[rows], scene.sample_tangent[rows]
        self.arc = scene.sample_arc[rows]
        self._tree: Any = cKDTree(self.point, balanced_tree=False, compact_nodes=False)

    def score(self, poses: Floats, scene: ScenePoints) -> Floats:
        """Share (k,) of the scene's length that lies on arcs at poses (k, 4, 4), model from scene."""
        out = np.empty(len(poses))
        size = max(_CHUNK // max(len(scene.weight), 1), 1)
        for at in range(0, len(poses), size):
            met = self._meet(poses[at : at + size], scene, REACH_MM)
            square = np.einsum("kni,kni->kn", met.across, met.across)
            out[at : at + size] = (met.found * np.exp(-0.5 * square / SIGMA_MM**2)) @ scene.weight
        return np.asarray(out / scene.weight.sum())

    def fit(self, poses: Floats, scene: ScenePoints) -> Floats:
        """Poses (k, 4, 4) led to where the scene's points lie on arcs: steps of least squares on the distances across
        the nearest arcs, each with a smaller reach."""
        for reach in REACHES_MM:
            met = self._meet(poses, scene, reach)
            weight = met.found * scene.weight
            middle = np.einsum("kij,j->ki", poses[:, :3, :3], scene.middle) + poses[:, :3, 3]
            poses = align_with_lines(met.point, met.tangent, met.across, weight, middle) @ poses
        return poses

    def shifted(self, pose: Floats, scene: ScenePoints) -> Floats:
        """Poses (k, 4, 4) that the model displaced onto itself makes of one, by the arcs that explain the scene."""
        met = self._meet(pose[None], scene, REACH_MM)
        arc, weight = self.arc[met.row[0][met.found[0]]], scene.weight[met.found[0]]
        shifts = find_displacements(self._shapes, arc, weight, np.inf)
        poses = np.repeat(pose[None], len(shifts), axis=0)
        poses[:, :3, 3] += shifts
        return poses

    def _meet(self, poses: Floats, scene: ScenePoints, reach: float) -> _Met:
        """The scene's points at poses (k, 4, 4) beside the arcs nearest to them."""
        point = scene.point @ poses[:, :3, :3].transpose(0, 2, 1) + poses[:, None, :3, 3]
        direction = scene.direction @ poses[:, :3, :3].transpose(0, 2, 1)
        distance, row = self._tree.query(point.reshape(-1, 3), distance_upper_bound=reach)
        found = np.isfinite(distance).reshape(point.shape[:2])
        row = np.where(found.ravel(), row, 0)
        tangent = self.tangent[row].reshape(point.shape)
        off = point - self.point[row].reshape(point.shape)
        across = off - np.einsum("kni,kni->kn", off, tangent)[..., None] * tangent
        parallel = np.abs(np.einsum("kni,kni->kn", direction, tangent)) > PARALLEL
        return _Met(point, row.reshape(found.shape), tangent, across, found & parallel)


# Poses of the rig, with a prior or without: the join of circles or of straight edges, votes, scores, a fit to the
# model's arcs, and what repeats.


class PoseCandidates(NamedTuple):
    """Poses as perturbations of a prior, and the relations in space, by kind, that they were found by."""

    prior: Prior
    candidates: Perturbations
    relations: dict[str, Relations]


def find_poses(
    store: Database,
    connection: Connection,
    scene: Scene,
    world_id: int,
    space: SpaceArcs,
    prior: Prior | None = None,
    p: ConstellationParameters = DEFAULTS,
) -> PoseCandidates:
    """Distinct poses at which circles in space fall on circles of the inspected objects, pair by pair; where these
    explain too little, straight edges on straight edges.

    Joined pairs that put the scene of the world in the same place vote together; the poses of most votes, counted and
    weighed by how rare their pairs are, are scored on some of the scene's points, the best of these fitted to the
    model's arcs and scored on more.  Where the model repeats itself about the best, the shifted poses are looked at
    too.  Poses far from a prior are dropped.  The scores of the poses are the shares of what stereo puts in space that
    lies on the model's arcs; the poses are perturbations of the prior, or of an open one at the best."""
    points = sample_scene(space)
    arcs = scene.once("model arcs", lambda: ModelArcs(scene))
    poses, share, name = np.zeros((0, 4, 4)), np.zeros(0), "join"
    relations: dict[str, Relations] = {}
    for stage in ("join", "lines"):
        if share.max(initial=0.0) < ENOUGH:
            name = stage
            started, rarity, kind, related = _start(stage, store, connection, world_id, space, p)
            relations[kind] = related
            fitted, explained = _fit_best(started, rarity, points, arcs, prior)
            poses, share = np.concatenate([poses, fitted]), np.concatenate([share, explained])
    kept = best_distinct(poses, share, points.middle, KEPT_POSES)
    return PoseCandidates(*candidates(name, poses[kept], share[kept], prior, ENOUGH), relations)


def _start(
    stage: str, store: Database, connection: Connection, world_id: int, space: SpaceArcs, p: ConstellationParameters
) -> tuple[Floats, Floats, str, Relations]:
    """Poses (k, 4, 4) that joined pairs of circles, or of straight edges, give, of all inspected objects, how rare (k,)
    each pair is, and the scene's relations of that kind."""
    by_circles, poses, alike = stage == "join", [np.zeros((0, 4, 4))], [np.zeros(0, np.int64)]
    arcs, circles = find_scene_circles(space)
    if by_circles:
        relations = circles.relations(p.join)
    else:
        arcs, lines = find_scene_lines(space, p.lines)
        relations = relate_lines(lines, p.lines)
    counted = np.zeros(len(relations["unit_a"]), np.int64)
    objects = store.columns(connection, "constellations/objects", world_id=world_id)
    for object_id, world_from_object in zip(objects["object_id"].tolist(), matrices(objects), strict=True):
        if by_circles:
            joined = join_pairs(store, connection, object_id, relations, p.join)
            solved = solve_poses(circles, read_circles(store, connection, object_id), joined)
        else:
            edges = read_lines(store, connection, object_id, p.lines)
            joined = join_lines(store, connection, relations, edges, p.lines)
            solved = solve_line_poses(lines, edges, joined)[:, None]
        poses.append((world_from_object @ solved).reshape(-1, 4, 4))
        alike.append(np.repeat(joined.alike, solved.shape[1]))
        counted += count_alike(relations, joined)
    named = {name: space.first[arcs][relations[name]] for name in ("unit_a", "unit_b")}
    every, rarity = np.concatenate(poses), 1.0 / np.concatenate(alike)
    decided = np.isfinite(every).all(axis=(1, 2))
    kind = "circles" if by_circles else "lines"
    return every[decided], rarity[decided], kind, relations | named | {"alike": counted}


def _fit_best(
    poses: Floats, rarity: Floats, points: ScenePoints, arcs: ModelArcs, prior: Prior | None
) -> tuple[Floats, Floats]:
    """Of poses (k, 4, 4), the likely ones, fitted to the model's arcs, and the shares of the scene they explain."""
    if prior is not None:
        near = are_near(poses, prior)
        poses, rarity = poses[near], rarity[near]
    if not len(poses):
        return poses, rarity
    few, many = points.thin(FEW_POINTS), points.thin(POINTS)
    voted = poses[most_voted(poses, rarity, points)]
    scored = voted[best_distinct(voted, arcs.score(voted, few), points.middle, FITTED)]
    fitted = arcs.fit(scored, many)
    share = arcs.score(fitted, many)
    for pose in fitted[best_ways(fitted, share)]:
        again = arcs.fit(arcs.shifted(pose, many), few)
        if prior is not None:
            again = again[are_near(again, prior)]
        fitted, share = np.concatenate([fitted, again]), np.concatenate([share, arcs.score(again, many)])
    return fitted, share


def are_near(poses: Floats, prior: Prior) -> Bools:
    """Which poses (k, 4, 4) the prior does not rule out, were they off by as much as joined pairs leave them."""
    off = np.repeat(np.square([SOLVED_MM, SOLVED_RAD]), 3)
    apart = perturbations(prior.world_from_rig, poses)
    square = np.einsum("ki,ij,kj->k", apart, np.linalg.inv(prior.covariance + np.diag(off)), apart)
    return np.asarray(square <= GATE_SIGMA**2)


def candidates(
    name: str, poses: Floats, share: Floats, given: Prior | None, enough: float
) -> tuple[Prior, Perturbations]:
    """What a join, the stage of that name, gives a localisation: poses (k, 4, 4) of the rig, the best first, as
    perturbations of the prior given or of an open one at the best, scores (k,), and that from which no scan is made."""
    prior = given or Prior.open(poses[0] if len(poses) else np.eye(4))
    delta = perturbations(prior.world_from_rig, poses)
    stage = Stage(name, delta, share, ["goes_on"] * len(share), len(share))
    return prior, Perturbations(delta, share, [stage], enough)


def most_voted(poses: Floats, rarity: Floats, points: ScenePoints) -> Ints:
    """One pose of each cell of poses, those with most votes by count and those with most by rarity."""
    at = poses[:, :3, :3] @ points.middle + poses[:, :3, 3]
    cell = np.column_stack([np.rint(at / CELL_MM), np.rint(poses[:, :3, :2].reshape(-1, 6) / CELL_RAD)])
    key = np.ascontiguousarray(cell.astype(np.int16)).view([("", np.int16)] * cell.shape[1]).ravel()
    _, first, cell_of = np.unique(key, return_index=True, return_inverse=True)
    votes = (np.bincount(cell_of), np.bincount(cell_of, rarity))
    most = [np.argsort(-v, kind="stable")[:SCORED] for v in votes]
    return np.asarray(first[np.unique(np.concatenate(most))], np.int64)


def best_ways(poses: Floats, share: Floats) -> Ints:
    """The best pose of each way the rig is turned that explains nearly as much as the best of all."""
    turned = poses.copy()
    turned[:, :3, 3] = 0
    kept = best_distinct(turned, share, np.zeros(3), len(poses))
    return np.asarray(kept[share[kept] >= ALIKE_SHARE * share.max()])


def best_distinct(poses: Floats, score: Floats, middle: Floats, count: int) -> Ints:
    """Rows of the best poses, at most `count`, no two of which put what is seen about `middle` (3,) in one place."""
    at = poses[:, :3, :3] @ middle + poses[:, :3, 3]
    left = np.argsort(-score, kind="stable")
    kept: list[int] = []
    while len(left) and len(kept) < count:
        row = int(left[0])
        kept.append(row)
        cosine = (np.einsum("kij,ij->k", poses[left][:, :3, :3], poses[row, :3, :3]) - 1) / 2
        turned = np.arccos(np.clip(cosine, -1, 1))
        left = left[(np.linalg.norm(at[left] - at[row], axis=1) > DISTINCT_MM) | (turned > DISTINCT_RAD)]
    return np.array(kept, np.int64)


def gather_poses(found: Sequence[PoseCandidates], scene: Scene, prior: Prior | None) -> PoseCandidates:
    """What several pictures, or pairs of them, give of one scene, as one: a pose has the votes of all that give one
    which puts the scene in the same place before the rig, each the score of the best such pose."""
    if len(found) == 1:
        return found[0]
    poses = np.concatenate([perturb(it.prior.world_from_rig, it.candidates.delta) for it in found])
    score = np.concatenate([it.candidates.score for it in found])
    of = np.repeat(np.arange(len(found)), [len(it.candidates.score) for it in found])
    there, middle = inverse(poses), scene.sample_point.mean(axis=0)
    at, turn = there[:, :3, :3] @ middle + there[:, :3, 3], there[:, :3, :3].reshape(-1, 9)
    near = np.linalg.norm(at[:, None] - at, axis=2) <= DISTINCT_MM
    near &= turn @ turn.T >= 1 + 2 * np.cos(DISTINCT_RAD)  # the trace of the motion between two
    votes = np.stack([np.where(near & (of == n), score, 0.0).max(axis=1, initial=0.0) for n in range(len(found))])
    voted = votes.sum(axis=0)
    kept = best_distinct(there, voted, middle, KEPT_POSES)
    enough = found[0].candidates.enough
    return PoseCandidates(*candidates("join", poses[kept], voted[kept], prior, enough), found[0].relations)


# Poses of a rig from one picture, with a prior or without: the join of its ellipses with the model's circles, a fit of
# each joined pair, and how many ellipses a pose explains.


def find_poses_of_one_picture(
    store: Database,
    connection: Connection,
    rig: Rig,
    world_id: int,
    picture: Primitives,
    prior: Prior | None = None,
    p: ConstellationParameters = DEFAULTS,
) -> PoseCandidates:
    """Distinct poses of a rig of one camera at which ellipses of its picture are circles of the inspected objects.

    An ellipse and a radius of an object are a circle in space, and two such circles that lie to each other as two of
    the object give a pose, which is fitted to both ellipses.  Every pose is scored on all ellipses: the log odds of
    finding those that it explains against finding them by chance.  The best are fitted to all that they explain, and
    scored again.  The poses are perturbations of the prior, where none is given of an open one at the best; those far
    from a prior are dropped.  A picture with too few ellipses, or an object with too few circles, gives no pose."""
    ((name, camera),) = rig.cameras.items()
    camera_from_rig = np.linalg.inv(rig.rig_from_camera[name])
    ellipses = find_ellipses(picture, camera, p.ellipses)
    seen, unit = _see(ellipses, camera)
    objects = store.columns(connection, "constellations/objects", world_id=world_id)
    joins = [
        (read_circles(store, connection, number), join_ellipses(store, connection, number, seen, p.one_picture))
        for number in objects["object_id"].tolist()
    ]
    placed = [_place(unit, model, joined) for model, joined in joins]
    if not sum(len(scene) for scene, _ in placed):
        return PoseCandidates(*candidates("join", np.zeros((0, 4, 4)), np.zeros(0), prior, p.one_picture.enough), {})
    middle = np.median(np.concatenate([scene.centre for scene, _ in placed]), axis=0)
    poses, scores = [], []
    for world_from_object, (model, joined), where in zip(matrices(objects), joins, placed, strict=True):
        solved = solve_poses(where[0], model, where[1]).reshape(-1, 4, 4)
        fit = EllipseFit(ellipses, camera, model, p.one_picture)
        circle, ellipse = (np.repeat(pair, 2, axis=0) for pair in (joined.model, joined.scene // 2))
        rows = fit.fit_pairs(to_rows(solved), circle, ellipse)
        if prior is not None:
            rows = rows[are_near(world_from_object @ to_matrices(rows) @ camera_from_rig, prior)]
        score, which = fit.score(rows)
        best = best_distinct(to_matrices(rows), score, middle, p.one_picture.fitted)
        rows = fit.fit(rows[best], which[best], np.tile(np.arange(len(ellipses)), (len(best), 1)))[0]
        poses.append(world_from_object @ to_matrices(rows) @ camera_from_rig)
        scores.append(fit.score(rows)[0])
    pose, score = np.concatenate(poses), np.concatenate(scores)
    in_rig = rig.rig_from_camera[name] @ np.append(middle, 1.0)
    kept = best_distinct(pose, score, in_rig[:3], p.one_picture.kept)
    return PoseCandidates(*candidates("join", pose[kept], score[kept], prior, p.one_picture.enough), {})


def join_ellipses(
    store: Database, connection: Connection, object_id: int, seen: Columns, p: OnePictureParameters
) -> JoinedPairs:
    """Join the circles that ellipses may be with those of an object: `queries/constellations/one_picture.sql`, whose
    relation `seen_circle` is given; the scene's circles are its units."""
    with store.relation(connection, "seen_circle", seen):
        joined = store.columns(
            connection,
            "constellations/one_picture",
            object_id=object_id,
            least_distance=KEPT.least_distance,
            greatest_distance=KEPT.greatest_distance,
            **asdict(p),
        )
    return read_joined(joined, "circle")


def _see(ellipses: PictureEllipses, camera: Camera) -> tuple[Columns, Circles]:
    """The two circles of radius 1 of each ellipse: columns of the relation `seen_circle`, and as circles."""
    centre, normal = (vectors.reshape(-1, 3) for vectors in find_circles(ellipses, camera))
    number = np.arange(len(centre))
    columns: Columns = {
        "unit": number,
        "ellipse_no": number // 2,
        **dict(zip("xyz", centre.T, strict=True)),
        **dict(zip(("nx", "ny", "nz"), normal.T, strict=True)),
        "size_share": np.repeat(ellipses.size_share, 2),
        "tilt": np.repeat(ellipses.tilt, 2),
    }
    return columns, Circles.exact(centre, normal, np.ones(len(centre)))


def _place(unit: Circles, model: Circles, joined: JoinedPairs) -> tuple[Circles, JoinedPairs]:
    """The circles of the scene that joined pairs name, of the model's radii, and the pairs by rows of them."""
    row, circle = joined.scene.ravel(), joined.model.ravel()
    radius = model.radius[circle]
    placed = Circles.exact(unit.centre[row] * radius[:, None], unit.normal[row], radius)
    return placed, replace(joined, scene=np.arange(len(row)).reshape(-1, 2))


# Relations of what stereo puts in space as rows of the store.

_VALUES = {
    "circles": ("distance", "radius_a", "radius_b", "normals", "rise_a", "rise_b"),
    "lines": ("distance", "cosine"),
}


def record_relations(run: Run, connection: Connection, problem_no: int, relations: dict[str, Relations]) -> None:
    """Append the relations that the join was given, by kind."""
    for kind, found in relations.items():
        kept = ("unit_a", "unit_b", "alike", *(name + end for name in _VALUES[kind] for end in ("", "_sigma")))
        columns: Columns = {"problem_no": problem_no, "kind": [kind] * len(found["alike"])}
        run.append(connection, "space_relation", {"run_id": run.id, **columns, **{name: found[name] for name in kept}})
