"""Edge elements from exact projections, with errors of known size, and what refinement makes of them."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from relmodel.arrays import Floats
from tests.vision.localisation.scenes import above, blocks, off, stereo_rig
from vision.cameras.cameras import CalibrationSigma, Camera, Rig, perturb, perturbation
from vision.localisation.hypotheses import EdgePoints, build_fine_evidence
from vision.localisation.measurements import EdgeIndex
from vision.localisation.refine import Fit, RefinedPose
from vision.localisation.visibility import find_visible_arcs
from vision.scene import Scene

NOISE_PX = 0.1


@dataclass(frozen=True)
class Errors:
    """Standard deviations of what is wrong: each sample, each arc's image as a whole (px), where the model has each arc
    (mm), and the calibration of both cameras."""

    noise_px: float = NOISE_PX
    arc_px: float = 0.0
    tolerance_mm: float = 0.0
    calibration: CalibrationSigma = field(default_factory=CalibrationSigma)


def draw_edges(
    scene: Scene, rig: Rig, truth: Floats, errors: Errors, rng: np.random.Generator
) -> dict[str, EdgePoints]:
    """Elements where a pose projects the arcs of a scene, with errors drawn, and 3,000 of clutter a picture."""
    shift = rng.normal(0, errors.tolerance_mm, (len(scene.occurrence_of_arc), 3))
    out = {}
    for name, camera in rig.cameras.items():
        pose = truth @ rig.rig_from_camera[name]
        seen = find_visible_arcs(scene, camera, pose)
        normal = np.stack([-seen.direction[:, 1], seen.direction[:, 0]], axis=1)
        moved, _ = camera.project((seen.point + shift[seen.arc] - pose[:3, 3]) @ pose[:3, :3])
        across = rng.normal(0, errors.noise_px, len(normal)) + rng.normal(0, errors.arc_px, len(shift))[seen.arc]
        out[name] = among_clutter(camera, moved + normal * across[:, None], normal, errors.noise_px, rng)
    return out


def among_clutter(
    camera: Camera, position: Floats, normal: Floats, sigma: float, rng: np.random.Generator
) -> EdgePoints:
    """Elements (n, 2) of a picture, and 3,000 others, of less contrast, anywhere in it."""
    clutter = rng.uniform([6, 6], [camera.width - 7, camera.height - 7], (3000, 2))
    angle = rng.uniform(0, 2 * np.pi, 3000)
    contrast = np.concatenate([rng.uniform(40, 120, len(normal)), rng.uniform(5, 20, 3000)])
    return EdgePoints(
        np.concatenate([position, clutter]),
        np.concatenate([normal, np.stack([np.cos(angle), np.sin(angle)], axis=1)]),
        contrast,
        np.full(len(contrast), sigma),
        np.array([6.0, 6]),
        np.array([camera.width - 7.0, camera.height - 7]),
        200.0,
    )


def draw_rig(rig: Rig, sigma: CalibrationSigma, rng: np.random.Generator) -> Rig:
    """The rig as it truly is: calibration off by a draw; the first camera is the rig's frame."""
    cameras, poses = {}, {}
    for number, (name, camera) in enumerate(rig.cameras.items()):
        matrix = camera.matrix.copy()
        matrix[[0, 1], [0, 1]] *= 1 + rng.normal(0, sigma.focal)
        matrix[:2, 2] += rng.normal(0, sigma.centre_px, 2)
        cameras[name] = replace(camera, matrix=matrix)
        place = rng.normal(0, 1, 6) * np.repeat([sigma.translation_mm, sigma.rotation], 3)
        poses[name] = perturb(rig.rig_from_camera[name], place if number else np.zeros(6))
    return Rig(cameras, poses)


@dataclass(frozen=True)
class Outcome:
    """A refined pose, its squared distance from the truth in sigmas, that of the first camera's centre alone, and how
    far (mm) the middle of what is seen is off."""

    refined: RefinedPose
    chi_square: float
    chi_square_centre: float
    off_mm: float


def simulate(
    errors: Errors,
    seed: int,
    cameras: tuple[str, ...] = ("left", "right"),
    *,
    stated: bool = True,
    stated_tolerance_mm: float | None = None,
) -> Outcome:
    """One trial: a view of the blocks drawn from the seed, edges with errors drawn, refinement from a pose near by;
    `stated`: whether the rig says how far off its calibration may be; `stated_tolerance_mm`: of the model, where that
    is not what it is off by."""
    rng = np.random.default_rng(seed)
    tolerance = errors.tolerance_mm if stated_tolerance_mm is None else stated_tolerance_mm
    scene = replace(blocks(), tolerance_mm=np.full(10, tolerance))
    believed = stereo_rig().only(*cameras)
    moving = replace(errors.calibration, translation_mm=0.0, rotation=0.0)
    believed = Rig(
        believed.cameras,
        believed.rig_from_camera,
        {name: errors.calibration if number else moving for number, name in enumerate(cameras)},
    )
    x, y = rng.uniform(-60, 60, 2)
    truth = above(x, y, rng.uniform(450, 650))
    edges = draw_edges(scene, draw_rig(believed, errors.calibration, rng), truth, errors, rng)
    if not stated:
        believed = Rig(believed.cameras, believed.rig_from_camera)
    indexes = {name: EdgeIndex(points) for name, points in edges.items()}
    prior = off(truth, 20.0, np.radians(2), seed)
    start = perturb(truth, rng.normal(0, 1, 6) * np.repeat([0.8, 0.0015], 3))
    found = Fit(scene, believed, indexes, build_fine_evidence(believed, edges), prior).refine(start)
    d = perturbation(found.world_from_rig, truth)
    centre = d[:3] @ np.linalg.solve(found.covariance[:3, :3], d[:3])
    middle = np.append(found.middle, 1.0)
    apart = float(np.linalg.norm((found.world_from_rig - truth) @ middle))
    return Outcome(found, float(d @ np.linalg.solve(found.covariance, d)), float(centre), apart)
