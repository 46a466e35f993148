"""Poses of the rig with no prior: the join of circles, votes, scores and a fit to the model's arcs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from sqlalchemy import Connection

from relmodel.arrays import Floats, Ints
from relmodel.store.database import Database
from vision.constellations.circles import Circles, find_scene_circles
from vision.constellations.constellation_parameters import DEFAULTS, ConstellationParameters, PoseParameters
from vision.constellations.join import JoinedPairs, join_pairs, solve_poses
from vision.constellations.score import ModelArcs, ScenePoints, sample_scene
from vision.scene.scene import Scene
from vision.stereo.triangulate import Triangulated


@dataclass(frozen=True)
class FoundPoses:
    """Distinct poses (k, 4, 4) of the rig in the world, the best first, and the share (k,) of what stereo put in space
    that lies on the model's arcs at each; pair (k,): the row of `joined` that started each."""

    world_from_rig: Floats
    share: Floats
    pair: Ints
    joined: JoinedPairs
    circles: Circles


def find_poses(
    workspace: Database,
    connection: Connection,
    scene: Scene,
    model: Circles,
    space: Triangulated,
    p: ConstellationParameters = DEFAULTS,
) -> FoundPoses:
    """Poses at which circles in space fall on the model's circles, pair by pair.

    Joined pairs that put the scene in the same place vote together, each by how rare it is; the poses of most votes are
    scored on some of the scene's points, the best of these fitted to the model's arcs and scored on more."""
    circles = find_scene_circles(space)
    circles = circles.take((circles.radius >= p.join.least_radius) & (circles.radius <= p.join.greatest_radius))
    model = model.take((model.radius >= p.join.least_radius) & (model.radius <= p.join.greatest_radius))
    joined = join_pairs(workspace, connection, circles, model, p.join)
    if not len(joined.alike):
        return FoundPoses(np.zeros((0, 4, 4)), np.zeros(0), np.zeros(0, np.int64), joined, circles)
    poses = solve_poses(circles, model, joined).reshape(-1, 4, 4)
    pair = np.repeat(np.arange(len(joined.alike)), 2)
    points = sample_scene(space, p.poses)
    few, many = points.thin(p.poses.few_points), points.thin(p.poses.points)
    sharp = scene.reference_samples[scene.sample_cosine[scene.reference_samples] < np.cos(np.radians(5))]
    arcs = ModelArcs(scene.sample_point[sharp], scene.sample_tangent[sharp], p.poses)

    voted = _vote(poses, 1.0 / joined.alike[pair], points, p.poses)
    scored = voted[_best_distinct(poses[voted], arcs.score(poses[voted], few), points, p.poses, p.poses.fitted)]
    fitted = arcs.fit(poses[scored], many)
    share = arcs.score(fitted, many)
    kept = _best_distinct(fitted, share, points, p.poses, p.poses.kept)
    return FoundPoses(fitted[kept], share[kept], pair[scored[kept]], joined, circles)


def _vote(poses: Floats, weight: Floats, points: ScenePoints, p: PoseParameters) -> Ints:
    """One pose of each cell of poses, that of the rarest pair, the cells of most votes first."""
    at = poses[:, :3, :3] @ points.middle + poses[:, :3, 3]
    cell = np.column_stack([np.rint(at / p.cell_mm), np.rint(poses[:, :3, :2].reshape(-1, 6) / p.cell_rad)])
    _, first, cell_of = np.unique(cell.astype(np.int64), axis=0, return_index=True, return_inverse=True)
    votes = np.bincount(cell_of.ravel(), weight)
    return np.asarray(first[np.argsort(-votes, kind="stable")[: p.scored]], np.int64)


def _best_distinct(poses: Floats, score: Floats, points: ScenePoints, p: PoseParameters, count: int) -> Ints:
    """Rows of the best poses, at most `count`, no two of which put what is seen in one place."""
    at = poses[:, :3, :3] @ points.middle + poses[:, :3, 3]
    left = np.argsort(-score, kind="stable")
    kept: list[int] = []
    while len(left) and len(kept) < count:
        row = int(left[0])
        kept.append(row)
        cosine = (np.einsum("kij,ij->k", poses[left, :3, :3], poses[row, :3, :3]) - 1) / 2
        turned = np.arccos(np.clip(cosine, -1, 1))
        left = left[(np.linalg.norm(at[left] - at[row], axis=1) > p.distinct_mm) | (turned > p.distinct_rad)]
    return np.array(kept, np.int64)
