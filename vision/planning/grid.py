"""Poses of a rig on a grid about a placed object: along each side of its box, straight on and tilted."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from relmodel.arrays import Bools, Floats, Ints
from relmodel.columns import Rows
from vision.cameras.cameras import Rig
from vision.presence.pieces import find_axes
from vision.scene.scene import Scene

_PIXEL_MM = 0.6  # of the part in a pixel, where no distance is given: finer than a change that counts
_STEP = 0.6  # share of a view's width and height from one view to the next: neighbours overlap
_TILT = np.radians(35)  # beside the view straight on, one tilted to each side shows the walls of what is deep
# rad between the axes of cameras that are set to look at one place; less may be how they were mounted
_LEAST_TOE_IN = np.radians(2)
_CLEAR_MM = 150.0  # about a camera in which nothing may lie; of a shorter distance half


@dataclass(frozen=True)
class Grid(Rows):
    """Poses (n, 4, 4) of a rig and the points (n, 3) of the object that they look at, in the world, mm."""

    world_from_rig: Floats
    target: Floats


@dataclass(frozen=True)
class Floor:
    """A plane across an axis (0, 1, 2) of the world at a place along it, mm, that cameras stay above."""

    axis: int
    mm: float

    def __str__(self) -> str:
        return f"{'xyz'[self.axis]} = {self.mm:g}"


def find_table(scene: Scene) -> Floor:
    """The plane z = 0 of the world, or that on which its lowest part stands where this is lower."""
    return Floor(2, float(scene.vertices[:, 2].min(initial=0.0)))


def usual_distance(rig: Rig, size: Floats) -> float:
    """Where the axes of toed-in cameras meet.  Else where a box of this size (3,) mm fills the picture of all cameras,
    but no farther than where a pixel of the coarsest shows `_PIXEL_MM`."""
    poses = np.stack(list(rig.rig_from_camera.values()))
    place, way, look = poses[:, :3, 3], poses[:, :3, 2], _look_frame(rig)
    if np.linalg.norm(np.cross(way[0], way[-1])) > np.sin(_LEAST_TOE_IN):
        across = np.eye(3) - way[:, :, None] * way[:, None, :]
        met = np.linalg.solve(across.sum(axis=0), np.einsum("nij,nj->i", across, place))
        if (far := float((met - look[:3, 3]) @ look[:3, 2])) > 0:
            return far
    long, short = np.sort(size)[:0:-1]
    long += np.linalg.norm(place[-1] - place[0])
    sides = [
        (c.matrix[0, 0], c.matrix[0, 0] * long / c.width, c.matrix[1, 1] * short / c.height)
        for c in rig.cameras.values()
    ]
    focal, *fills = np.array(sides, float).T
    return float(min(_PIXEL_MM * focal.min(), np.max(fills)))


def lay_grid(
    scene: Scene,
    occurrences: Ints,
    rig: Rig,
    distance_mm: float | None = None,
    floor: Floor | None = None,
) -> Grid:
    """The poses at a distance from the surface of placed parts, `usual_distance` where none is given, no camera too
    near to anything.

    Each side of the box about them is a lattice of views that overlap; rays inward from the middle of each cell, else
    about it, as that may look through a hole, say what is looked at; where nothing is there is no view."""
    mine = np.flatnonzero(np.isin(scene.surface_occurrence[scene.triangle_surface], occurrences))
    corners = scene.vertices[np.unique(scene.triangles[mine])]
    axes = _box_axes(corners, find_axes(scene, occurrences, np.array([0.0, 0.0, 1.0])))
    low, high = (corners @ axes.T).min(axis=0), (corners @ axes.T).max(axis=0)
    distance_mm = usual_distance(rig, high - low) if distance_mm is None else distance_mm
    sizes = [(c.width / c.matrix[0, 0], c.height / c.matrix[1, 1]) for c in rig.cameras.values()]
    step = _STEP * distance_mm * np.min(np.array(sizes, float), axis=0)
    rig_from_look = _look_frame(rig)
    poses, targets = [], []
    for axis in range(3):
        # The picture lies along the longer of the two.
        u, v = sorted((a for a in range(3) if a != axis), key=lambda a: low[a] - high[a])
        for side in (-1.0, 1.0):
            across, down = _spread(low[u], high[u], step[0]), _spread(low[v], high[v], step[1])
            start = np.stack(np.meshgrid(across, down), -1).reshape(-1, 1, 2)
            third = np.array([(high[u] - low[u]) / len(across), (high[v] - low[v]) / len(down)]) / 3
            at = np.zeros((len(start) * len(_ABOUT), 3))
            at[:, [u, v]] = (start + _ABOUT * third).reshape(-1, 2)
            at[:, axis] = (high if side > 0 else low)[axis] + side
            met, target = _meet(scene, at @ axes, np.tile(-side * axes[axis], (len(at), 1)), occurrences)
            target = target[np.unique(np.flatnonzero(met) // len(_ABOUT), return_index=True)[1]]
            ahead = side * axes[axis]
            tilted = [np.cos(_TILT) * ahead + np.sin(_TILT) * aside for aside in (axes[u], -axes[u], axes[v], -axes[v])]
            for way in (ahead, *tilted):
                poses.append(_looking(target, way, axes[u], distance_mm) @ np.linalg.inv(rig_from_look))
                targets.append(target)
    grid = Grid(np.concatenate(poses), np.concatenate(targets))
    clear = min(_CLEAR_MM, 0.5 * distance_mm)
    return grid.take(np.array([_is_clear(scene, floor, rig, pose, clear) for pose in grid.world_from_rig], bool))


def look_from(
    scene: Scene,
    occurrences: Ints,
    rig: Rig,
    poses: Floats,
    floor: Floor | None = None,
) -> tuple[Grid, Ints]:
    """Those of some poses (n, 4, 4) of a rig from which the middle of its view lies on placed parts, and which those
    are; no camera too near to anything."""
    look = poses @ _look_frame(rig)
    met, target = _meet(scene, look[:, :3, 3], look[:, :3, 2], occurrences)
    kept = np.array([_is_clear(scene, floor, rig, pose, _CLEAR_MM) for pose in poses[met]], bool)
    return Grid(poses[met], target).take(kept), np.flatnonzero(met)[kept]


def _box_axes(points: Floats, axes: Floats) -> Floats:
    """Axes (3, 3) of the smallest box about points (n, 3) along the third of the given ones, right-handed."""
    turn = np.radians(cv2.minAreaRect((points @ axes[:2].T).astype(np.float32))[2])
    cosine, sine = np.cos(turn), np.sin(turn)
    return np.asarray(np.array([[cosine, sine, 0], [-sine, cosine, 0], [0, 0, 1]]) @ axes)


_ABOUT = np.array([(0, 0), (-1, 0), (1, 0), (0, -1), (0, 1), (-1, -1), (1, -1), (-1, 1), (1, 1)])  # the middle first


def _spread(low: float, high: float, step: float) -> Floats:
    count = max(int(np.ceil((high - low) / step)), 1)
    return np.asarray(low + (np.arange(count) + 0.5) * (high - low) / count)


def _meet(scene: Scene, start: Floats, way: Floats, occurrences: Ints) -> tuple[Bools, Floats]:
    """Which rays (n,) from points (n, 3) meet some placed parts before anything else, and where those do (m, 3)."""
    hit = scene.rays.nearest(start, way)
    met = hit >= 0
    met[met] = np.isin(scene.surface_occurrence[scene.triangle_surface[hit[met]]], occurrences)
    corner = scene.vertices[scene.triangles[hit[met]]]
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    along = np.einsum("ni,ni->n", normal, corner[:, 0] - start[met]) / np.einsum("ni,ni->n", normal, way[met])
    return met, np.asarray(start[met] + along[:, None] * way[met])


def _look_frame(rig: Rig) -> Floats:
    """`rig_from_look` (4, 4): amid the cameras, z along the mean of their axes, x from the first to the last."""
    poses = np.stack([rig.rig_from_camera[name] for name in rig.cameras])
    z = poses[:, :3, 2].mean(axis=0)
    z /= np.linalg.norm(z)
    across = poses[-1, :3, 3] - poses[0, :3, 3] if len(poses) > 1 else poses[0, :3, 0]
    return _frame(poses[:, :3, 3].mean(axis=0), z, across)


def _frame(place: Floats, z: Floats, across: Floats) -> Floats:
    """A pose (4, 4) at a place with this z (3,) and x in the direction of `across` as far as it can be."""
    x = across - (across @ z) * z
    x /= np.linalg.norm(x)
    out = np.eye(4)
    out[:3] = np.column_stack([x, np.cross(z, x), z, place])
    return out


def _looking(target: Floats, way: Floats, across: Floats, distance_mm: float) -> Floats:
    """Poses (n, 4, 4) that look at points (n, 3) from the direction `way` (3,)."""
    out = np.tile(_frame(np.zeros(3), -way, across), (len(target), 1, 1))
    out[:, :3, 3] = target + distance_mm * way
    return out


def _is_clear(scene: Scene, floor: Floor | None, rig: Rig, world_from_rig: Floats, clear_mm: float) -> bool:
    """Whether every camera is that far above the floor and from all surfaces, as far as rays to all sides tell."""
    ways = np.stack(np.meshgrid(*[np.arange(-2.0, 3.0)] * 3), -1).reshape(-1, 3)
    ways = ways[np.abs(ways).max(axis=1) == 2]
    ways *= clear_mm / np.linalg.norm(ways, axis=1)[:, None]
    eyes = [(world_from_rig @ pose)[:3, 3] for pose in rig.rig_from_camera.values()]
    if floor is not None and min(eye[floor.axis] for eye in eyes) < floor.mm + clear_mm:
        return False
    return not any(scene.rays.blocked(eye + ways, eye).any() for eye in eyes)
