"""Whether a picture changes where a pose has the outline of the model against what lies behind it.

A printed edge parts an object from itself; its outline parts it from the background.  So pixels just inside the outline
should be likelier of what lies deeper inside than of what lies farther outside, and those just outside the reverse.
What lies about a place on either side is a Gaussian of grey within a window (Lankton and Tannenbaum, "Localizing
region-based active contours", 2008).  An outline laid along a stripe has background beyond the rest of the object,
one beside the object has background on both sides: both find neither.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from relmodel.arrays import Bools, Bytes, Floats, Floats32
from vision.cameras.cameras import Rig
from vision.localisation.coverage import lay_rays
from vision.localisation.localisation_parameters import OutlineParameters
from vision.scene.scene import Scene


@dataclass(frozen=True)
class Outlines:
    """The model's outlines against the background, by camera (c,).

    length_px; contrast: mean log likelihood ratio of the pixels beside them, zero where there is none; evidence: log
    odds that they are outlines, of all cameras together."""

    length_px: Floats
    contrast: Floats
    evidence: float

    @property
    def total_px(self) -> float:
        return float(self.length_px.sum())

    @property
    def mean(self) -> float:
        """The contrast of all outlines together."""
        return float(self.length_px @ self.contrast / max(self.total_px, 1e-9))


@dataclass(frozen=True)
class GreyGrid:
    """The greys of a picture on a grid of rays: directions (rows, columns, 3) in the camera's frame; grey, seen (rows,
    columns): which of them the picture shows."""

    directions: Floats
    grey: Floats32
    seen: Bools


def lay_grey_grids(rig: Rig, greys: Mapping[str, Bytes | Floats], p: OutlineParameters) -> list[GreyGrid]:
    """The grids of the rig's cameras, in its order, from their pictures (rows, columns)."""
    import cv2

    grids = []
    for name, camera in rig.cameras.items():
        rays = lay_rays(camera, p.step_px)
        pixel, _ = camera.project(rays.directions.reshape(-1, 3))
        at = pixel.reshape(*rays.weight.shape, 2).astype(np.float32)
        smooth = cv2.blur(np.asarray(greys[name], np.float32), (p.step_px, p.step_px))
        grey = cv2.remap(smooth, at[..., 0], at[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        grids.append(GreyGrid(rays.directions, np.asarray(grey), rays.weight > 0))
    return grids


def measure_outlines(
    scene: Scene, rig: Rig, grids: list[GreyGrid], world_from_rig: Floats, p: OutlineParameters
) -> Outlines:
    """The outlines at a pose, in the pictures of the rig's cameras."""
    found = [
        _compare(_find_model(scene, grid, world_from_rig @ rig.rig_from_camera[name]), grid.seen, grid, p)
        for name, grid in zip(rig.cameras, grids, strict=True)
    ]
    length, contrast = (np.array(column) for column in zip(*found, strict=True))
    return Outlines(length, contrast, float(length @ contrast / p.observed_px))


def measure_shifted_outlines(
    scene: Scene, rig: Rig, grids: Sequence[GreyGrid], world_from_rig: Floats, shifts: Floats, p: OutlineParameters
) -> Floats:
    """The log odds (n,) that the outlines seen from a pose are outlines where they are laid elsewhere in the pictures,
    shifted by so many px (n, c, 2) in each camera's."""
    import cv2

    total = np.zeros(len(shifts))
    for camera, (name, grid) in enumerate(zip(rig.cameras, grids, strict=True)):
        model = _find_model(scene, grid, world_from_rig @ rig.rig_from_camera[name])
        rows, columns = model.shape
        for number, (x, y) in enumerate(np.rint(shifts[:, camera] / p.step_px)):
            there, known = (
                cv2.warpAffine(
                    mask.astype(np.uint8), np.array([[1, 0, x], [0, 1, y]]), (columns, rows), flags=cv2.INTER_NEAREST
                )
                for mask in (model, grid.seen)
            )
            # What lies beyond the picture is not known: its border is no outline.
            clear = p.step_px * cv2.distanceTransform(known, cv2.DIST_L2, 5) > p.far_px + p.step_px
            length, contrast = _compare(there > 0, grid.seen & clear, grid, p)
            total[number] += length * contrast / p.observed_px
    return total


def _find_model(scene: Scene, grid: GreyGrid, world_from_camera: Floats) -> Bools:
    """Which rays of a grid meet the model."""
    model = np.zeros(grid.seen.shape, bool)
    directions = grid.directions[grid.seen] @ world_from_camera[:3, :3].T
    model[grid.seen] = scene.rays.meet(world_from_camera[:3, 3], directions)
    return model


def _compare(model: Bools, known: Bools, grid: GreyGrid, p: OutlineParameters) -> tuple[float, float]:
    """Length (px) and contrast of the outlines of the model in one picture, where they are known."""
    away = _distance_from_outline(model, p.step_px)
    near = known & (np.abs(away) > p.near_px) & (np.abs(away) <= p.far_px)
    if not near.any():
        return 0.0, 0.0
    inside, counted = _log_likelihood(grid.grey, known & (away > p.far_px), p)
    outside, also = _log_likelihood(grid.grey, known & (away < -p.far_px), p)
    near &= (counted >= p.min_cells) & (also >= p.min_cells)
    if not near.any():
        return 0.0, 0.0
    odds = np.clip(inside - outside, -p.most, p.most) * np.sign(away)
    length = float(near.sum()) * p.step_px**2 / (2 * (p.far_px - p.near_px))
    return length, float(odds[near].mean(dtype=float))


def _distance_from_outline(model: Bools, step: int) -> Floats32:
    """How far (px) cells lie from the model's outline, negative outside it."""
    import cv2

    mask = model.astype(np.uint8)
    if mask.all() or not mask.any():
        return np.full(mask.shape, np.inf if mask.all() else -np.inf, np.float32)
    inside, outside = (cv2.distanceTransform(m, cv2.DIST_L2, 5) for m in (mask, 1 - mask))
    return np.asarray(step * np.where(model, inside - 0.5, 0.5 - outside), np.float32)


def _log_likelihood(grey: Floats32, some: Bools, p: OutlineParameters) -> tuple[Floats32, Floats32]:
    """Log likelihood of each cell by the Gaussian of some cells within the window about it, and how many those are."""
    import cv2

    side = 2 * round(p.window_px / p.step_px) + 1

    def gather(values: Floats32) -> Floats32:
        return np.asarray(
            cv2.boxFilter(values, cv2.CV_32F, (side, side), normalize=False, borderType=cv2.BORDER_CONSTANT)
        )

    weight = some.astype(np.float32)
    level = grey - 128.0  # sums of squares of small numbers lose less
    count = gather(weight)
    mean = gather(weight * level) / np.maximum(count, 1)
    variance = np.maximum(gather(weight * level**2) / np.maximum(count, 1) - mean**2, 0) + p.noise_grey**2
    return np.asarray(-0.5 * ((level - mean) ** 2 / variance + np.log(variance))), count
