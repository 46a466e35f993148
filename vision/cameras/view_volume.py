"""What a camera can see as a volume of the spatial index, widened by the uncertainty of a prior."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from relmodel.arrays import Bools, Floats, Ints
from relmodel.find.find import BOX_COLUMNS, in_volumes
from relmodel.find.volumes import Frustum, Polyhedron, boxes_met
from relmodel.find.widening import widened
from relmodel.geometry.transforms import matrices
from relmodel.store import Store
from vision.cameras.cameras import Camera, Prior, Rig, perturb


@dataclass(frozen=True)
class SelectionParameters:
    """What of a world is considered."""

    near_mm: float = 1.0  # mm: depth from which things are looked for; nothing sharper than this stands before a lens
    far_mm: float = 20_000.0  # mm: depth at which a cell ends
    confidence: float = 1 - 1e-8
    """the widened view contains what any pose within this ellipsoid of the prior would show: seven sigma"""
    sampled_poses: int = 200  # poses sampled to say how much more than any of them the widened view contains
    drawn_poses: int = 1000
    """poses drawn from the prior to say how probable it is that a camera sees something: to .016 at worst, one sigma"""
    seed: int = 0  # of these


DEFAULTS = SelectionParameters()
_MOST_PAIRS = 100_000  # of views and boxes that are compared at once


def widen_view_volume(
    camera: Camera, rig_from_camera: Floats, prior: Prior, p: SelectionParameters = DEFAULTS
) -> Polyhedron:
    """A polyhedron that contains the camera's view from any pose of the rig within `p.confidence` of the prior."""
    view = build_view_volume(camera, prior.world_from_rig @ rig_from_camera, p)
    return widened(view, prior.covariance, p.confidence, rig_from_camera)


def build_view_volume(camera: Camera, world_from_camera: Floats, p: SelectionParameters = DEFAULTS) -> Frustum:
    """A frustum that contains what the camera sees from a pose between two depths."""
    width, height, matrix = camera.undistorted_view()
    return Frustum(width, height, matrix, world_from_camera, p.near_mm, p.far_mm)


def sample_poses(prior: Prior, p: SelectionParameters = DEFAULTS) -> Floats:
    """The prior's pose of the rig and `p.sampled_poses` on the surface of its ellipsoid (k, 4, 4)."""
    from scipy.special import chdtri

    direction = np.random.default_rng(p.seed).normal(size=(p.sampled_poses, 6))
    direction *= np.sqrt(chdtri(6, 1 - p.confidence)) / np.linalg.norm(direction, axis=1)[:, None]
    moves = np.concatenate([np.zeros((1, 6)), direction @ np.linalg.cholesky(prior.covariance).T])
    return perturb(prior.world_from_rig, moves)


def probabilities_in_view(
    rig: Rig, prior: Prior, found: Mapping[str, npt.NDArray[Any]], p: SelectionParameters = DEFAULTS
) -> Floats:
    """How probable it is (n,) that a camera of the rig has a row of `in_volumes` in its view, by its box: the share of
    `p.drawn_poses` poses, drawn from the prior's normal distribution, from which one does."""
    low, high = (np.stack([found[f"{axis}{end}"] for axis in "xyz"], axis=1).astype(float) for end in (0, 1))
    boxes = np.stack([found[f"shape_{name}"] for name in BOX_COLUMNS], axis=1).astype(float)
    poses, seen = matrices(found), np.zeros(len(low))
    draws = np.random.default_rng(p.seed).multivariate_normal(np.zeros(6), prior.covariance, p.drawn_poses)
    for world_from_rig in perturb(prior.world_from_rig, draws):
        now = np.zeros(len(low), bool)
        for name, camera in rig.cameras.items():
            view = build_view_volume(camera, world_from_rig @ rig.rig_from_camera[name], p)
            bounds = view.bounds
            rows = np.flatnonzero(~now & (low <= bounds[3:]).all(axis=1) & (high >= bounds[:3]).all(axis=1))
            now[rows] = boxes_met(view, poses[rows], boxes[rows])
        seen += now
    return seen / p.drawn_poses


@dataclass(frozen=True)
class Selection:
    """What the widened views of a rig contain: parts, or elements of a level, each once.

    shown: (n,) whether one of the sampled views contains it too; the others are superfluous, as far as sampling tells.
    """

    occurrence_id: Ints
    element_no: Ints
    shown: Bools

    @property
    def superfluous(self) -> int:
        return int((~self.shown).sum())


def select_in_view(
    store: Store,
    rig: Rig,
    prior: Prior,
    p: SelectionParameters = DEFAULTS,
    *,
    level: str = "part",
    world: str | None = None,
) -> Selection:
    """What of a world any pose within the prior could show to a camera of the rig."""
    cameras = [(camera, rig.rig_from_camera[name]) for name, camera in rig.cameras.items()]
    whole = [widen_view_volume(camera, pose, prior, p) for camera, pose in cameras]
    found = in_volumes(store, whole, level=level, world=world)
    key = np.stack([found["occurrence_id"], found["element_no"]]).astype(np.int64)
    rows = np.unique(key, axis=1, return_index=True)[1]
    low, high = (np.stack([found[f"{axis}{end}"][rows] for axis in "xyz"], axis=1).astype(float) for end in (0, 1))
    boxes = np.stack([found[f"shape_{name}"][rows] for name in BOX_COLUMNS], axis=1).astype(float)
    pose = matrices(found)[rows]
    shown, rig_poses = np.zeros(len(rows), bool), sample_poses(prior, p)
    for some in np.array_split(rig_poses, max(len(rig_poses) * len(rows) // _MOST_PAIRS, 1)):
        for camera, rig_from_camera in cameras:
            rest = np.flatnonzero(~shown)
            shown[rest] = _met_by_any(
                build_view_volume(camera, np.eye(4), p), some @ rig_from_camera, pose[rest], boxes[rest],
                low[rest], high[rest],
            )  # fmt: skip
    return Selection(key[0, rows], key[1, rows], shown)


def _met_by_any(
    view: Frustum, world_from_view: Floats, world_from_box: Floats, boxes: Floats, low: Floats, high: Floats
) -> Bools:
    """Which boxes (n, 6), as `boxes_met` has them, a view from any of several places (k, 4, 4) meets; low, high (n, 3):
    the boxes' bounds in the world."""
    turn, centre = world_from_view[:, :3, :3], world_from_view[:, :3, 3]
    corners = view.corners @ turn.transpose(0, 2, 1) + centre[:, None]
    met = (low <= corners.max(axis=1)[:, None]).all(axis=2) & (high >= corners.min(axis=1)[:, None]).all(axis=2)
    normals = view.planes[:, :3] @ turn.transpose(0, 2, 1)
    offsets = view.planes[:, 3] + (normals @ centre[:, :, None])[..., 0]
    for normal, offset in zip(normals.swapaxes(0, 1), offsets.T, strict=True):
        across = (normal @ world_from_box[:, :3, :3]).swapaxes(0, 1)
        least = np.minimum(across * boxes[:, :3], across * boxes[:, 3:]).sum(axis=2)
        met &= least + normal @ world_from_box[:, :3, 3].T <= offset[:, None]
    return np.asarray(met.any(axis=0))
