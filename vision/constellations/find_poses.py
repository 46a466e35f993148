"""Poses of the rig, with a prior or without: the join of circles or of straight edges, votes, scores, a fit to the
model's arcs, and what repeats."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from sqlalchemy import Connection

from relmodel.arrays import Bools, Floats, Ints
from relmodel.geometry.transforms import matrices
from relmodel.store.database import Database
from vision.cameras.cameras import Prior, perturbations
from vision.constellations.circles import Relations, find_scene_circles, read_circles
from vision.constellations.constellation_parameters import DEFAULTS, ConstellationParameters, PoseParameters
from vision.constellations.join import JoinedPairs, count_alike, join_pairs, solve_poses
from vision.constellations.lines import (
    JoinedLines,
    find_scene_lines,
    join_lines,
    read_lines,
    relate_lines,
    solve_line_poses,
)
from vision.constellations.score import ModelArcs, ScenePoints, sample_scene
from vision.localisation.hypotheses import Candidates, Stage
from vision.scene.scene import Scene
from vision.stereo.triangulate import Triangulated


class Found(NamedTuple):
    """Poses as perturbations of a prior, and the relations in space, by kind, that they were found by."""

    prior: Prior
    candidates: Candidates
    relations: dict[str, Relations]


def find_poses(
    store: Database,
    connection: Connection,
    scene: Scene,
    world_id: int,
    space: Triangulated,
    prior: Prior | None = None,
    p: ConstellationParameters = DEFAULTS,
) -> Found:
    """Distinct poses at which circles in space fall on circles of the inspected objects, pair by pair; where these
    explain too little, straight edges on straight edges.

    Joined pairs that put the scene of the world in the same place vote together; the poses of most votes, counted and
    weighed by how rare their pairs are, are scored on some of the scene's points, the best of these fitted to the
    model's arcs and scored on more.  Where the model repeats itself about the best, the shifted poses are looked at
    too.  Poses far from a prior are dropped.  The scores of the poses are the shares of what stereo puts in space that
    lies on the model's arcs; the poses are perturbations of the prior, where none is given of an open one at the
    best."""
    points = sample_scene(space, p.poses)
    arcs = scene.once(("model arcs", p.poses), lambda: ModelArcs(scene, p.poses))
    poses, share, name = np.zeros((0, 4, 4)), np.zeros(0), "join"
    relations: dict[str, Relations] = {}
    for stage, start in (("join", _start_at_circles), ("lines", _start_at_lines)):
        if share.max(initial=0.0) < p.poses.enough:
            name = stage
            started = start(store, connection, read_inspected(store, connection, world_id), space, p)
            relations[started.kind] = started.relations
            fitted, explained = _fit_best(started.poses, started.rarity, points, arcs, prior, p.poses)
            poses, share = np.concatenate([poses, fitted]), np.concatenate([share, explained])
    kept = best_distinct(poses, share, points.middle, p.poses, p.poses.kept)
    return Found(*candidates(name, poses[kept], share[kept], prior, p.poses.enough), relations)


class _Started(NamedTuple):
    """Poses (k, 4, 4) that joined pairs give, how rare (k,) each pair is, and the scene's relations of that kind."""

    poses: Floats
    rarity: Floats
    kind: str
    relations: Relations


_Inspected = list[tuple[int, Floats]]


def _start_at_circles(
    store: Database, connection: Connection, inspected: _Inspected, space: Triangulated, p: ConstellationParameters
) -> _Started:
    arcs, circles = find_scene_circles(space)
    relations = circles.relations(p.join)

    def solve(object_id: int) -> tuple[JoinedPairs, Floats]:
        joined = join_pairs(store, connection, object_id, relations, p.join)
        return joined, solve_poses(circles, read_circles(store, connection, object_id), joined)

    return _start("circles", space.first[arcs], relations, inspected, solve)


def _start_at_lines(
    store: Database, connection: Connection, inspected: _Inspected, space: Triangulated, p: ConstellationParameters
) -> _Started:
    arcs, seen = find_scene_lines(space, p.lines)
    relations = relate_lines(seen, p.lines)

    def solve(object_id: int) -> tuple[JoinedLines, Floats]:
        edges = read_lines(store, connection, object_id, p.lines)
        joined = join_lines(store, connection, relations, edges, p.lines)
        return joined, solve_line_poses(seen, edges, joined)[:, None]

    return _start("lines", space.first[arcs], relations, inspected, solve)


def _start(
    kind: str,
    unit: Ints,
    relations: Relations,
    inspected: _Inspected,
    solve: Callable[[int], tuple[JoinedPairs | JoinedLines, Floats]],
) -> _Started:
    """Poses that joined pairs give, of all inspected objects; unit (n,): numbers of the scene's units."""
    poses, alike, counted = [np.zeros((0, 4, 4))], [np.zeros(0, np.int64)], np.zeros(len(relations["unit_a"]), np.int64)
    for object_id, world_from_object in inspected:
        joined, solved = solve(object_id)
        poses.append((world_from_object @ solved).reshape(-1, 4, 4))
        alike.append(np.repeat(joined.alike, solved.shape[1]))
        counted += count_alike(relations, joined)
    named = {name: unit[relations[name]] for name in ("unit_a", "unit_b")}
    described = relations | named | {"alike": counted}
    every, rarity = np.concatenate(poses), 1.0 / np.concatenate(alike)
    decided = np.isfinite(every).all(axis=(1, 2))
    return _Started(every[decided], rarity[decided], kind, described)


def read_inspected(store: Database, connection: Connection, world_id: int) -> list[tuple[int, Floats]]:
    """The inspected objects of a world, each with world_from_object."""
    objects = store.columns(connection, "constellations/objects", world_id=world_id)
    return list(zip(objects["object_id"].tolist(), matrices(objects), strict=True))


def _fit_best(
    poses: Floats, rarity: Floats, points: ScenePoints, arcs: ModelArcs, prior: Prior | None, p: PoseParameters
) -> tuple[Floats, Floats]:
    """Of poses (k, 4, 4), the likely ones, fitted to the model's arcs, and the shares of the scene they explain."""
    if prior is not None:
        near = are_near(poses, prior, p)
        poses, rarity = poses[near], rarity[near]
    if not len(poses):
        return poses, rarity
    few, many = points.thin(p.few_points), points.thin(p.points)
    voted = poses[_vote(poses, rarity, points, p)]
    scored = voted[best_distinct(voted, arcs.score(voted, few), points.middle, p, p.fitted)]
    fitted = arcs.fit(scored, many)
    share = arcs.score(fitted, many)
    for pose in fitted[_best_ways(fitted, share, p)]:
        again = arcs.fit(arcs.shifted(pose, many), few)
        if prior is not None:
            again = again[are_near(again, prior, p)]
        fitted, share = np.concatenate([fitted, again]), np.concatenate([share, arcs.score(again, many)])
    return fitted, share


def are_near(poses: Floats, prior: Prior, p: PoseParameters) -> Bools:
    """Which poses (k, 4, 4) the prior does not rule out, were they off by as much as joined pairs leave them."""
    off = np.repeat(np.square([p.solved_mm, p.solved_rad]), 3)
    apart = perturbations(prior.world_from_rig, poses)
    square = np.einsum("ki,ij,kj->k", apart, np.linalg.inv(prior.covariance + np.diag(off)), apart)
    return np.asarray(square <= p.gate_sigma**2)


def candidates(name: str, poses: Floats, share: Floats, given: Prior | None, enough: float) -> tuple[Prior, Candidates]:
    """What a join, the stage of that name, gives a localisation: poses (k, 4, 4) of the rig, the best first, as
    perturbations of the prior given or of an open one at the best, their scores (k,), and the score from which no scan
    is needed."""
    prior = given or Prior.open(poses[0] if len(poses) else np.eye(4))
    delta = perturbations(prior.world_from_rig, poses)
    stage = Stage(name, delta, share, ["goes_on"] * len(share), len(share))
    return prior, Candidates(delta, share, [stage], enough)


def _vote(poses: Floats, rarity: Floats, points: ScenePoints, p: PoseParameters) -> Ints:
    """One pose of each cell of poses, those with most votes by count and those with most by rarity."""
    at = poses[:, :3, :3] @ points.middle + poses[:, :3, 3]
    cell = np.column_stack([np.rint(at / p.cell_mm), np.rint(poses[:, :3, :2].reshape(-1, 6) / p.cell_rad)])
    key = np.ascontiguousarray(cell.astype(np.int16)).view([("", np.int16)] * cell.shape[1]).ravel()
    _, first, cell_of = np.unique(key, return_index=True, return_inverse=True)
    votes = (np.bincount(cell_of), np.bincount(cell_of, rarity))
    most = [np.argsort(-v, kind="stable")[: p.scored] for v in votes]
    return np.asarray(first[np.unique(np.concatenate(most))], np.int64)


def _best_ways(poses: Floats, share: Floats, p: PoseParameters) -> Ints:
    """The best pose of each way the rig is turned that explains nearly as much as the best of all."""
    left = np.argsort(-share, kind="stable")
    left = left[share[left] >= p.alike_share * share[left[0]]]
    kept: list[int] = []
    while len(left):
        kept.append(int(left[0]))
        left = left[_angles(poses[left], poses[left[0]]) > p.distinct_rad]
    return np.array(kept, np.int64)


def _angles(poses: Floats, pose: Floats) -> Floats:
    """By how much (k,) rad poses are turned against one."""
    cosine = (np.einsum("kij,ij->k", poses[:, :3, :3], pose[:3, :3]) - 1) / 2
    return np.asarray(np.arccos(np.clip(cosine, -1, 1)))


def best_distinct(poses: Floats, score: Floats, middle: Floats, p: PoseParameters, count: int) -> Ints:
    """Rows of the best poses, at most `count`, no two of which put what is seen about `middle` (3,) in one place."""
    at = poses[:, :3, :3] @ middle + poses[:, :3, 3]
    left = np.argsort(-score, kind="stable")
    kept: list[int] = []
    while len(left) and len(kept) < count:
        row = int(left[0])
        kept.append(row)
        turned = _angles(poses[left], poses[row])
        left = left[(np.linalg.norm(at[left] - at[row], axis=1) > p.distinct_mm) | (turned > p.distinct_rad)]
    return np.array(kept, np.int64)
