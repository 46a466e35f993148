"""Poses that could be right beside the best because structure repeats.

On identical pockets a pose shifted by one pitch looks the same.  The shifts are read off the model: displacements that
carry visible arcs onto congruent arcs, gathered by how much visible length they carry along.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from relmodel.arrays import Floats, Ints, sum_by_group
from vision.cameras.cameras import Prior, perturbations
from vision.localisation.localisation_parameters import DEFAULTS, RivalParameters
from vision.scene.scene import Scene


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


def find_displacements(
    shapes: ArcShapes, visible_arc: Ints, visible_length: Floats, reach_mm: float, p: RivalParameters = DEFAULTS.rivals
) -> Floats:
    """Displacements (k, 3) of the world, mm, that carry much of what is visible onto congruent arcs, best first.

    visible_arc (n,), visible_length (n,): samples' arcs and what each stands for.
    """
    from scipy.spatial import cKDTree

    seen = np.bincount(visible_arc, visible_length, minlength=int(shapes.arc.max(initial=0)) + 1)[shapes.arc]
    rows = np.flatnonzero(seen > 0)
    if not len(rows):
        return np.zeros((0, 3))
    # Shape space scaled so that congruent arcs lie within 1 of each other.
    space = np.concatenate([np.log(np.maximum(shapes.length, 1e-9))[:, None], shapes.moment], axis=1) / p.congruent
    near: Any = cKDTree(space).query_ball_point(space[rows], 1.0, p=np.inf)
    count = np.array([len(n) for n in near])
    source = np.repeat(rows, count)
    target = np.concatenate([np.array(sorted(n), np.int64) for n in near])
    shift = shapes.middle[target] - shapes.middle[source]
    use = (source != target) & (np.linalg.norm(shift, axis=1) < reach_mm) & (np.linalg.norm(shift, axis=1) > p.box_mm)
    source, shift = source[use], shift[use]
    # Boxes are laid twice, half a box apart; an arc counts once in each.
    best: list[tuple[float, Floats]] = []
    for phase in (0.0, 0.5):
        box = np.floor(shift / p.box_mm + phase).astype(np.int64)
        pairs, first = np.unique(np.column_stack([box, source]), axis=0, return_index=True)
        boxes, row = np.unique(pairs[:, :3], axis=0, return_inverse=True)
        votes = np.bincount(row.ravel(), seen[pairs[:, 3]], minlength=len(boxes))
        for k in np.flatnonzero(votes >= p.min_visible_share * seen.sum()):
            mine = shift[first[row.ravel() == k]]
            best.append((float(votes[k]), np.median(mine, axis=0)))
    best.sort(key=lambda v: (-v[0], *v[1]))
    left = np.array([d for _, d in best]).reshape(-1, 3)
    kept: list[Floats] = []
    while len(left):
        kept.append(left[0])
        left = left[np.linalg.norm(left - left[0], axis=1) > 2 * p.box_mm]
    return np.array(kept).reshape(-1, 3)


def shift_poses(prior: Prior, world_from_rig: Floats, shifts: Floats, most_sigma: float, p: RivalParameters) -> Floats:
    """Poses (k, 4, 4) displaced by `shifts` (n, 3) of the world, those the prior finds likeliest first; those beyond
    `most_sigma` are left out."""
    poses = np.repeat(world_from_rig[None], len(shifts), axis=0)
    poses[:, :3, 3] += shifts
    delta = perturbations(prior.world_from_rig, poses)
    distance = np.einsum("ki,ij,kj->k", delta, prior.information, delta)
    order = np.argsort(distance, kind="stable")
    return np.asarray(poses[order[distance[order] <= most_sigma**2][: p.displacements]])
