"""How much of what stereo puts in space lies on arcs of the model at a pose, and the fit of a pose to them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from relmodel.arrays import Bools, Floats, Ints
from vision.constellations.constellation_parameters import PoseParameters
from vision.localisation.align import align_with_lines
from vision.localisation.alternatives import describe_arc_shapes, find_displacements
from vision.scene.scene import Scene
from vision.stereo.triangulate import CURVES, Triangulated

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


def sample_scene(space: Triangulated, p: PoseParameters) -> ScenePoints:
    """Points along the lines, circles and ellipses of matched arcs; free curves have ends only, and are left out."""
    straight = np.flatnonzero(space.curve == CURVES.index("line"))
    chord = space.end[straight] - space.start[straight]
    length = np.linalg.norm(chord, axis=1)
    rows, share, weight = _spread(length, p)
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
    row, share, weight = _spread(size * np.abs(turn), p)
    t = (first[row] + share * turn[row])[:, None]
    points.append(centre[row] + np.cos(t) * major[row] + np.sin(t) * minor[row])
    tangent = -np.sin(t) * major[row] + np.cos(t) * minor[row]
    directions.append(tangent / np.linalg.norm(tangent, axis=1, keepdims=True))
    weights.append(weight)
    arcs = np.concatenate([straight[rows], round_[row]])
    return ScenePoints(
        np.concatenate(points), np.concatenate(directions), np.concatenate(weights) * space.edge_probability[arcs]
    )


def _spread(length: Floats, p: PoseParameters) -> tuple[Ints, Floats, Floats]:
    """Of arcs of these lengths: the arc, the share of the way along it, and the weight of points spread along them."""
    count = np.clip(np.ceil(np.minimum(length, p.most_of_one) / p.step), 2, None).astype(np.int64)
    row = np.repeat(np.arange(len(length)), count)
    place = np.arange(len(row)) - np.repeat(np.cumsum(count) - count, count)
    return row, (place + 0.5) / count[row], np.minimum(length, p.most_of_one)[row] / count[row]


class ModelArcs:
    """Points along the model's sharp arcs, to find the nearest to a point."""

    def __init__(self, scene: Scene, p: PoseParameters) -> None:
        from scipy.spatial import cKDTree

        rows = scene.reference_samples
        rows = rows[scene.sample_cosine[rows] < np.cos(p.sharp_rad)]
        self.p, self._shapes = p, describe_arc_shapes(scene)
        self.point, self.tangent, self.arc = (
            scene.sample_point[rows],
            scene.sample_tangent[rows],
            scene.sample_arc[rows],
        )
        self._tree: Any = cKDTree(self.point, balanced_tree=False, compact_nodes=False)

    def score(self, poses: Floats, scene: ScenePoints) -> Floats:
        """Share (k,) of the scene's length that lies on arcs at poses (k, 4, 4), model from scene."""
        out = np.empty(len(poses))
        size = max(_CHUNK // max(len(scene.weight), 1), 1)
        for at in range(0, len(poses), size):
            met = self._meet(poses[at : at + size], scene, self.p.reach)
            square = np.einsum("kni,kni->kn", met.across, met.across)
            out[at : at + size] = (met.found * np.exp(-0.5 * square / self.p.sigma**2)) @ scene.weight
        return np.asarray(out / scene.weight.sum())

    def fit(self, poses: Floats, scene: ScenePoints) -> Floats:
        """Poses (k, 4, 4) led to where the scene's points lie on arcs: steps of least squares on the distances across
        the nearest arcs, each with a smaller reach."""
        for reach in self.p.reaches:
            met = self._meet(poses, scene, reach)
            weight = met.found * scene.weight
            middle = np.einsum("kij,j->ki", poses[:, :3, :3], scene.middle) + poses[:, :3, 3]
            poses = align_with_lines(met.point, met.tangent, met.across, weight, middle) @ poses
        return poses

    def shifted(self, pose: Floats, scene: ScenePoints) -> Floats:
        """Poses (k, 4, 4) that the model displaced onto itself makes of one, by the arcs that explain the scene."""
        met = self._meet(pose[None], scene, self.p.reach)
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
        parallel = np.abs(np.einsum("kni,kni->kn", direction, tangent)) > self.p.parallel
        return _Met(point, row.reshape(found.shape), tangent, across, found & parallel)
