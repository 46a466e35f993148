"""Pieces of the model that are moved as one: what cameras should see of them, and least squares of where they lie."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, radians

import numpy as np

from relmodel.arrays import Bools, Floats, Ints
from relmodel.geometry.transforms import skew
from vision.cameras.cameras import Rig
from vision.localisation.measurements import EdgeIndex
from vision.presence.presence_parameters import DisplacedParameters
from vision.presence.samples import Samples
from vision.scene.scene import Scene

ALONG_PX = 1.0  # along the edge, between a sample and the element on its normal
ENOUGH = 150  # samples of a piece in a camera: more samples add no information
MIN_COSINE = cos(radians(20))  # of the angle between their normals


def find_pieces(paths: Sequence[str]) -> Ints:
    """The piece (o,) that each occurrence belongs to: the parts of an assembly within an object are one piece."""
    above = [path.rpartition("/")[0] for path in paths]
    pieces = [group if "/" in group else path for path, group in zip(paths, above, strict=True)]
    return np.asarray(np.unique(pieces, return_inverse=True)[1].ravel(), np.int64)


def find_axes(scene: Scene, occurrences: Ints, ahead: Floats) -> Floats:
    """Unit vectors (3, 3): two along the plane that most of the surface of parts is parallel to, and its normal, which
    points to the side that the direction `ahead` (3,) does."""
    mine = np.isin(scene.surface_occurrence[scene.triangle_surface], occurrences)
    corner = scene.vertices[scene.triangles[mine]]
    way = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    area = np.linalg.norm(way, axis=1)
    normal = way / np.maximum(area, 1e-12)[:, None]
    # Both sides of a plate face the same way; rounding makes classes of normals.
    largest = normal[np.arange(len(normal)), np.abs(normal).argmax(axis=1)]
    upright = np.where(largest < 0, -1.0, 1.0)[:, None] * normal
    _, kind = np.unique(np.rint(upright * 50), axis=0, return_inverse=True)
    most = upright[kind.ravel() == np.argmax(np.bincount(kind.ravel(), area))][0]
    most = most if most @ ahead >= 0 else -most
    first = np.cross(most, np.eye(3)[np.abs(most).argmin()])
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(most, first), most])


@dataclass(frozen=True)
class PieceCamera:
    """A camera's pose (4, 4) and matrix (3, 3), its elements, and which of all cameras' elements they are."""

    pose: Floats
    matrix: Floats
    index: EdgeIndex
    elements: slice


def list_cameras(rig: Rig, world_from_rig: Floats, indexes: list[EdgeIndex]) -> list[PieceCamera]:
    out, first = [], 0
    for (name, camera), index in zip(rig.cameras.items(), indexes, strict=True):
        elements = slice(first, first + len(index.edges.position))
        out.append(PieceCamera(world_from_rig @ rig.rig_from_camera[name], camera.matrix, index, elements))
        first = elements.stop
    return out


@dataclass(frozen=True)
class PieceView:
    """What a camera should see of a piece: samples' points (n, 3), image directions (n, 2), lengths px; free (e,):
    which elements no other piece's edge takes."""

    camera: PieceCamera
    point: Floats
    direction: Floats
    length: Floats
    free: Bools


def list_views(samples: Samples, weight: Floats, cameras: list[PieceCamera], free: Bools) -> list[PieceView]:
    """Of the cameras that see something; of many samples every so many, which then stand for the others."""
    out = []
    for number, camera in enumerate(cameras):
        own = np.flatnonzero(samples.camera == number)
        if len(own):
            some = own[:: 1 + len(own) // ENOUGH]
            length = weight[some] * (weight[own].sum() / weight[some].sum())
            out.append(PieceView(camera, samples.point[some], samples.direction[some], length, free[camera.elements]))
    return out


def fit(
    views: list[PieceView], centre: Floats, axes: Floats, start: Floats, rise_mm: float, p: DisplacedParameters
) -> tuple[Floats, Floats]:
    """The displacements (m, 4) that the elements near a piece's edges agree on, each from a start (m, 4), and their
    covariances (m, 4, 4)."""
    x = start.copy()
    loose = np.diag(np.array([p.plane_mm, p.plane_mm, rise_mm, p.turn]) ** -2.0)
    hessian = np.tile(loose, (len(x), 1, 1))
    for reach in p.reach_px:
        hessian, gradient = np.tile(loose, (len(x), 1, 1)), -x @ loose
        for view in views:
            slope, residual = look(view, centre, axes, x, reach)
            found = np.isfinite(residual)
            residual = np.where(found, residual, 0.0)
            weight = found * view.length / (p.stretch_px * p.sigma_px**2 * (1 + (residual / p.scale_px) ** 2) ** 2)
            scaled = np.swapaxes(slope * weight[..., None], 1, 2)
            hessian += scaled @ slope
            gradient += (scaled @ residual[..., None])[..., 0]
        x = x + np.linalg.solve(hessian, gradient[..., None])[..., 0]
    return x, np.asarray(np.linalg.inv(hessian))


def look(view: PieceView, centre: Floats, axes: Floats, x: Floats, reach_px: float) -> tuple[Floats, Floats]:
    """Of samples displaced by each x (m, 4): how their edges move along the image normals by it (m, n, 4), and how far
    the nearest element of about their direction lies along these (m, n), px, nan where none lies within the reach."""
    camera = view.camera
    cosine, sine, none = np.cos(x[:, 3]), np.sin(x[:, 3]), np.zeros(len(x))
    in_plane = np.stack([cosine, -sine, none, sine, cosine, none, none, none, none + 1], axis=1).reshape(-1, 3, 3)
    arm = (view.point - centre) @ np.swapaxes(axes.T @ in_plane @ axes, 1, 2)
    seen = (centre + arm + (x[:, :3] @ axes)[:, None] - camera.pose[:3, 3]) @ camera.pose[:3, :3]
    pixel = (seen / seen[..., 2:] @ camera.matrix.T)[..., :2]
    across = np.stack([-view.direction[:, 1], view.direction[:, 0]], axis=1)
    # How much a motion along each of the camera's axes moves the edge.
    push = across @ camera.matrix[:2, :2] / seen[..., 2:]
    push = np.concatenate([push, -(push * seen[..., :2] / seen[..., 2:]).sum(axis=2, keepdims=True)], axis=2)
    push = push @ camera.pose[:3, :3].T
    turning = (push * (arm @ skew(axes[2]).T)).sum(axis=2, keepdims=True)
    slope = np.concatenate([push @ axes.T, turning], axis=2)

    at, directions = np.ascontiguousarray(pixel.reshape(-1, 2)), np.tile(view.direction, (len(x), 1))
    limits = (reach_px, 1.0, MIN_COSINE, ALONG_PX)
    offset, found = camera.index.seek(at, directions, limits, view.free.astype(float))
    return slope, np.where(found >= 0, offset, np.nan).reshape(pixel.shape[:2])


def measure_distance(x: Floats, covariance: Floats) -> tuple[float, float]:
    """How far a displacement goes, mm, and its standard deviation along it."""
    distance = float(np.linalg.norm(x[:3]))
    way = x[:3] / distance if distance > 0 else np.eye(3)[0]
    return distance, float(np.sqrt(way @ covariance[:3, :3] @ way))
