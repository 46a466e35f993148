"""Edge elements from exact projections, with errors of known size."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from relmodel.arrays import Floats
from vision.cameras.cameras import Camera, Prior, Rig
from vision.localisation.hypotheses import EdgePoints, build_fine_evidence
from vision.localisation.measurements import EdgeIndex
from vision.localisation.refine import Fit
from vision.localisation.visibility import find_visible_arcs
from vision.scene import Scene

NOISE_PX = 0.1


@dataclass(frozen=True)
class Errors:
    """Standard deviations of errors: of each sample, of each arc's image (px), of where the model has each arc (mm)."""

    noise_px: float = NOISE_PX
    arc_px: float = 0.0
    tolerance_mm: float = 0.0


def draw_edges(scene: Scene, rig: Rig, truth: Floats, off: Errors, rng: np.random.Generator) -> dict[str, EdgePoints]:
    """Elements where a pose projects the arcs of a scene, with errors drawn, and 3,000 of clutter a picture."""
    shift = rng.normal(0, off.tolerance_mm, (len(scene.occurrence_of_arc), 3))
    out = {}
    for name, camera in rig.cameras.items():
        pose = truth @ rig.rig_from_camera[name]
        seen = find_visible_arcs(scene, camera, pose)
        normal = np.stack([-seen.direction[:, 1], seen.direction[:, 0]], axis=1)
        moved, _ = camera.project((seen.point + shift[seen.arc] - pose[:3, 3]) @ pose[:3, :3])
        across = rng.normal(0, off.noise_px, len(normal)) + rng.normal(0, off.arc_px, len(shift))[seen.arc]
        out[name] = among_clutter(camera, moved + normal * across[:, None], normal, off.noise_px, rng)
    return out


def fit_of(scene: Scene, rig: Rig, edges: dict[str, EdgePoints], prior: Prior) -> Fit:
    """The least squares of what the cameras of a rig see."""
    own = {name: edges[name] for name in rig.cameras}
    return Fit(scene, rig, {name: EdgeIndex(it) for name, it in own.items()}, build_fine_evidence(rig, own), prior)


def shift_bodies(
    edges: dict[str, EdgePoints], scene: Scene, rig: Rig, truth: Floats, bodies: list[int], shift: tuple[float, float]
) -> None:
    """Move the elements of some bodies by so many px."""
    for name, camera in rig.cameras.items():
        seen = find_visible_arcs(scene, camera, truth @ rig.rig_from_camera[name])
        edges[name].position[np.flatnonzero(np.isin(scene.occurrence_of_arc[seen.arc], bodies))] += shift


Corners = tuple[Floats | tuple[float, float], Floats | tuple[float, float]]


def scattered_edges(
    rng: np.random.Generator, count: int, places: Corners, bounds: Corners, contrast: tuple[float, float] = (-90, 90)
) -> EdgePoints:
    """Elements anywhere between two corners, turned any way."""
    angle, (low, high) = rng.uniform(0, 2 * np.pi, count), map(np.asarray, bounds)
    normal = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    position = rng.uniform(*places, (count, 2))
    return EdgePoints(position, normal, rng.uniform(*contrast, count), np.full(count, 0.1), low, high, 200.0)


def among_clutter(camera: Camera, place: Floats, normal: Floats, sigma: float, rng: np.random.Generator) -> EdgePoints:
    """Elements (n, 2) of a picture, and 3,000 others, of less contrast, anywhere in it."""
    clutter = rng.uniform([6, 6], [camera.width - 7, camera.height - 7], (3000, 2))
    angle = rng.uniform(0, 2 * np.pi, 3000)
    contrast = np.concatenate([rng.uniform(40, 120, len(normal)), rng.uniform(5, 20, 3000)])
    return EdgePoints(
        np.concatenate([place, clutter]),
        np.concatenate([normal, np.stack([np.cos(angle), np.sin(angle)], axis=1)]),
        contrast,
        np.full(len(contrast), sigma),
        np.array([6.0, 6]),
        np.array([camera.width - 7.0, camera.height - 7]),
        200.0,
    )
