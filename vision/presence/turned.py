"""Parts that are turned by any angle about the normal of their plane.

A turned part shows other edges than predicted, so its edges are predicted again: those of faces turned toward
the camera, at every turn and at places around, scored by how near edge elements of any direction lie.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from relmodel.arrays import Bools, Floats, Ints
from relmodel.geometry.transforms import rotation_matrix
from vision.presence.pieces import PieceCamera, PieceView
from vision.presence.presence_parameters import TurnedParameters
from vision.scene.scene import Scene


@dataclass(frozen=True)
class Turn:
    """A turn (rad) about the normal of a part's plane through `centre` (3,), then mm along the two axes of the plane
    (2,), and the edges that cameras see of it at that turn, not moved yet; tried: how many turns and places were."""

    angle: float
    centre: Floats
    aside: Floats
    views: list[PieceView]
    tried: int


def seek_turn(
    scene: Scene, occurrences: Ints, axes: Floats, cameras: list[PieceCamera], free: Bools, p: TurnedParameters
) -> Turn | None:
    """The turn about the last of `axes` (3, 3) at which the edges of parts score best, None where no turn scores
    clearly better than none; free (e,): the elements that no other part's edge takes."""
    mine = np.isin(scene.arc_occurrence[scene.sample_arc], occurrences) & (scene.sample_cosine < p.max_cosine)
    if not mine.any():
        return None
    point, length = scene.sample_point[mine], scene.sample_length[mine]
    way = np.stack([scene.sample_tangent[mine], scene.sample_normal_a[mine], scene.sample_normal_b[mine]], axis=1)
    centre = 0.5 * (point.min(axis=0) + point.max(axis=0))
    near = [_map_nearness(camera, free[camera.elements], p.near_px) for camera in cameras]

    def turned(angle: float) -> tuple[Floats, Floats]:
        rotation = rotation_matrix(angle * axes[2])
        return centre + (point - centre) @ rotation.T, way @ rotation.T

    def score(angles: Floats, places: Floats) -> Floats:
        """The mean nearness of the edges in view (turns, places)."""
        out = np.empty((len(angles), len(places)))
        for row, angle in enumerate(angles.tolist()):
            there, ways = turned(angle)
            fronts = [_face(camera, there, ways) for camera in cameras]
            found = [
                _sum_nearness(camera, there[front], length[front], axes, places, map_)
                for camera, front, map_ in zip(cameras, fronts, near, strict=True)
            ]
            out[row] = np.sum(found, axis=0) / max(sum(float(length[front].sum()) for front in fronts), 1e-9)
        return out

    angles, places = np.radians(np.arange(0.0, 360.0, p.step_degrees)), _lay_places(p.reach_mm, p.step_mm)
    scores = score(angles, places)
    best, place = np.unravel_index(np.argmax(scores), scores.shape)
    if scores[best, place] < max(p.least_score, scores[0].max() + p.least_gain):
        return None
    finer = angles[best] + np.radians(np.linspace(-0.8, 0.8, 9) * p.step_degrees)
    around = places[place] + _lay_places(p.step_mm, p.step_mm / 3)
    again = score(finer, around)
    best, place = np.unravel_index(np.argmax(again), again.shape)
    there, ways = turned(float(finer[best]))
    views = [_view(camera, there, ways, length, free) for camera in cameras]
    angle = float((finer[best] + np.pi) % (2 * np.pi) - np.pi)
    return Turn(angle, centre, around[place], [view for view in views if len(view.point)], scores.size + again.size)


def _lay_places(reach_mm: float, step_mm: float) -> Floats:
    """Places (n, 2) on a grid, mm either way."""
    side = np.arange(-reach_mm, reach_mm + 1e-9, step_mm)
    return np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2)


def _map_nearness(camera: PieceCamera, free: Bools, near_px: float) -> Floats:
    """By pixel (rows, columns) how near a free element lies, from 1 on one to 0 far away."""
    import cv2

    place = np.rint(camera.index.edges.position[free]).astype(np.int64)
    place = place[(place >= 0).all(axis=1)]
    columns, rows = place.max(axis=0, initial=0) + 1
    away = np.full((rows, columns), 255, np.uint8)
    away[place[:, 1], place[:, 0]] = 0
    return np.asarray(np.exp(-0.5 * (np.asarray(cv2.distanceTransform(away, cv2.DIST_L2, 3), float) / near_px) ** 2))


def _face(camera: PieceCamera, point: Floats, way: Floats) -> Bools:
    """Which samples have a face that is turned toward the camera."""
    back = camera.pose[:3, 3] - point
    return np.asarray((np.einsum("nki,ni->nk", way[:, 1:], back) > 0).any(axis=1))


def _sum_nearness(
    camera: PieceCamera, point: Floats, length: Floats, axes: Floats, places: Floats, near: Floats
) -> Floats:
    """The lengths (m,) of edges moved to places (m, 2) in the plane, each sample by how near elements lie."""
    seen = (point - camera.pose[:3, 3]) @ camera.pose[:3, :3]
    pixel = (seen / seen[:, 2:] @ camera.matrix.T)[:, :2]
    flow = _project_ways(camera, seen, np.broadcast_to(axes[:2], (len(point), 2, 3)))
    at = np.rint(pixel[None] + np.einsum("mk,nki->mni", places, flow)).astype(np.int64)
    inside = ((at >= 0) & (at < near.shape[::-1])).all(axis=2)
    column, row = np.where(inside[..., None], at, 0).transpose(2, 0, 1)
    return np.asarray((near[row, column] * inside) @ length)


def _project_ways(camera: PieceCamera, seen: Floats, way: Floats) -> Floats:
    """How pixels move (n, k, 2) by motions (n, k, 3) in the world of points seen (n, 3), px a mm."""
    there = way @ camera.pose[:3, :3]
    flow = (there[..., :2] - there[..., 2:] * (seen[:, None, :2] / seen[:, None, 2:])) / seen[:, None, 2:]
    return np.asarray(flow @ camera.matrix[:2, :2].T)


def _view(camera: PieceCamera, point: Floats, way: Floats, length: Floats, free: Bools) -> PieceView:
    front = _face(camera, point, way)
    point, length = point[front], length[front]
    seen = (point - camera.pose[:3, 3]) @ camera.pose[:3, :3]
    direction = _project_ways(camera, seen, way[front, :1])[:, 0]
    stretch = np.linalg.norm(direction, axis=1)
    shown = stretch > 1e-9
    direction = direction[shown] / stretch[shown, None]
    return PieceView(camera, point[shown], direction, (length * stretch)[shown], free[camera.elements])
