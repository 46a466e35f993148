"""Pieces of the model that are moved as one: what cameras should see of them, and least squares of where they lie."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from relmodel.arrays import Bools, Floats, Ints
from vision.cameras.cameras import Rig
from vision.localisation.measurements import EdgeIndex
from vision.presence.presence_parameters import DisplacedParameters
from vision.presence.samples import Samples
from vision.scene.scene import Scene

NEAREST = 6  # elements considered near a sample: more lie within a few px only in dense texture
ALONG_PX = 1.0  # along the edge, between a sample and the element on its normal
ENOUGH = 150  # samples of a piece in a camera: more samples add no information
MIN_COSINE = np.cos(np.radians(20))  # of the angle between their normals


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
    """A camera's pose (4, 4) and matrix (3, 3), its elements' places and normals (e, 2), a tree over them, and which of
    all cameras' elements they are."""

    pose: Floats
    matrix: Floats
    position: Floats
    normal: Floats
    tree: cKDTree
    elements: slice


def list_cameras(rig: Rig, world_from_rig: Floats, indexes: list[EdgeIndex]) -> list[PieceCamera]:
    out, first = [], 0
    for (name, camera), index in zip(rig.cameras.items(), indexes, strict=True):
        place = index.edges.position
        pose = world_from_rig @ rig.rig_from_camera[name]
        elements = slice(first, first + len(place))
        out.append(PieceCamera(pose, camera.matrix, place, index.edges.normal, cKDTree(place), elements))
        first += len(place)
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
    """The displacement (4,) that the elements near a piece's edges agree on, and its covariance (4, 4)."""
    x = start.copy()
    loose = np.diag(np.array([p.plane_mm, p.plane_mm, rise_mm, p.turn]) ** -2.0)
    hessian = loose
    for reach in p.reach_px:
        hessian, gradient = loose.copy(), -loose @ x
        for view in views:
            slope, residual = look(view, centre, axes, x, reach)
            found = np.isfinite(residual)
            slope, residual = slope[found], residual[found]
            weight = view.length[found] / (p.stretch_px * p.sigma_px**2 * (1 + (residual / p.scale_px) ** 2) ** 2)
            hessian += (slope * weight[:, None]).T @ slope
            gradient += slope.T @ (weight * residual)
        x = x + np.linalg.solve(hessian, gradient)
    return x, np.asarray(np.linalg.inv(hessian))


def look(view: PieceView, centre: Floats, axes: Floats, x: Floats, reach_px: float) -> tuple[Floats, Floats]:
    """Of samples displaced by x: how their edges move along the image normals by each of x (n, 4), how far the nearest
    element of about their direction lies along it (n,), px, nan where none lies within the reach."""
    camera = view.camera
    cosine, sine = np.cos(x[3]), np.sin(x[3])
    turn = axes.T @ np.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1.0]]) @ axes
    arm = (view.point - centre) @ turn.T
    seen = (centre + arm + x[:3] @ axes - camera.pose[:3, 3]) @ camera.pose[:3, :3]
    pixel = (seen / seen[:, 2:] @ camera.matrix.T)[:, :2]
    across = np.stack([-view.direction[:, 1], view.direction[:, 0]], axis=1)
    # How much a motion along each of the camera's axes moves the edge.
    push = across @ camera.matrix[:2, :2] / seen[:, 2:]
    push = np.concatenate([push, -np.einsum("ni,ni->n", push, seen[:, :2] / seen[:, 2:])[:, None]], axis=1)
    push = push @ camera.pose[:3, :3].T
    slope = np.concatenate([push @ axes.T, np.einsum("ni,ni->n", push, np.cross(axes[2], arm))[:, None]], axis=1)

    distance, near = camera.tree.query(pixel, k=NEAREST, distance_upper_bound=reach_px + ALONG_PX)
    near = np.where(np.isfinite(distance), near, 0)
    apart = camera.position[near] - pixel[:, None]
    along = np.einsum("nki,ni->nk", apart, across)
    fits = np.isfinite(distance) & view.free[near] & (np.abs(along) <= reach_px)
    fits &= np.abs(np.einsum("nki,ni->nk", apart, view.direction)) <= ALONG_PX
    fits &= np.abs(np.einsum("nki,ni->nk", camera.normal[near], across)) >= MIN_COSINE
    along = np.where(fits, along, np.inf)
    nearest = along[np.arange(len(along)), np.argmin(np.abs(along), axis=1)]
    return slope, np.where(np.isfinite(nearest), nearest, np.nan)


def measure_distance(x: Floats, covariance: Floats) -> tuple[float, float]:
    """How far a displacement goes, mm, and its standard deviation along it."""
    distance = float(np.linalg.norm(x[:3]))
    way = x[:3] / distance if distance > 0 else np.eye(3)[0]
    return distance, float(np.sqrt(way @ covariance[:3, :3] @ way))
