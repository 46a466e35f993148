"""What poses where the object is not gather in these very pictures: the chance that the best pose is held against.

Cluttered pictures and models that repeat give any pose much evidence, a plain one little.  So poses are drawn anew
about the best one, each so far off that the image of what is seen lies elsewhere, and gather what they gather: evidence
of edges, arc by arc, and of outlines.  How much a quarter of them exceeds, and by how much in the mean, tells how
rarely any would gather as much as the best (the excess over a high threshold is about exponential; Pickands 1975).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from relmodel.arrays import Floats
from vision.cameras.cameras import Rig
from vision.localisation.evidence import Fields
from vision.localisation.hypotheses import Prediction, gather_evidence, project_with_jacobians
from vision.localisation.localisation_parameters import ElsewhereParameters, LocalisationParameters
from vision.localisation.outlines import GreyGrid, measure_shifted_outlines
from vision.localisation.support import mix_over_arcs
from vision.scene.scene import Scene


@dataclass(frozen=True)
class Chance:
    """What poses elsewhere gather: a pose in exp((evidence - level) / scale) of them as much, log odds."""

    level: float
    scale: float

    @classmethod
    def of(cls, gathered: Floats, p: ElsewhereParameters, mean: float = 0.0, deviation: float = 0.0) -> Chance:
        """By what poses (n,) gathered, and the mean and deviation of what they gather besides."""
        threshold = float(np.quantile(gathered, 1 - p.share))
        above = gathered[gathered > threshold]
        excess = float(above.mean()) - threshold if len(above) else 0.0
        scale = float(np.hypot(max(excess, p.least_scale), deviation))
        return cls(threshold + mean + scale * float(np.log(p.share)), scale)

    def rarity(self, evidence: float) -> float:
        """How rarely a pose elsewhere gathers as much: minus the logarithm of the share of poses that do."""
        return (evidence - self.level) / self.scale

    def reached(self, rarity: float) -> float:
        """What a pose of that rarity gathers."""
        return self.level + self.scale * rarity


@dataclass(frozen=True)
class Elsewhere:
    """What poses elsewhere gather by edges and outlines of all pictures, and by the edges of each camera's, in the
    rig's order."""

    together: Chance
    by_camera: list[Chance]


def gather_elsewhere(
    scene: Scene,
    rig: Rig,
    prediction: Prediction,
    fields: Fields,
    greys: Sequence[GreyGrid],
    world_from_rig: Floats,
    p: LocalisationParameters,
) -> Elsewhere:
    """What the model gathers elsewhere than at a pose; `prediction`: what is seen from there, nothing perhaps."""
    if not len(prediction.point):
        nothing = Chance(0.0, p.elsewhere.least_scale)
        return Elsewhere(nothing, [nothing] * len(fields))
    delta = draw_elsewhere(prediction, p.elsewhere)
    arcs = gather_evidence(prediction, fields, delta)
    edges = mix_over_arcs(arcs, prediction.view_of_image, len(fields), p.support)
    shifts = draw_shifts(len(fields), p.elsewhere)
    outlines = measure_shifted_outlines(scene, rig, greys, world_from_rig, shifts, p.outlines)
    # Edges and outlines have little to do with each other.
    together = Chance.of(edges.sum(axis=1), p.elsewhere, float(outlines.mean()), float(outlines.std()))
    return Elsewhere(together, [Chance.of(own, p.elsewhere) for own in edges.T])


def draw_shifts(cameras: int, p: ElsewhereParameters) -> Floats:
    """Shifts (n, c, 2) of the pictures' outlines by `near_px` to `far_px`."""
    rng = np.random.default_rng(p.seed)
    angle = rng.uniform(0, 2 * np.pi, (p.outlined, cameras))
    far = rng.uniform(p.near_px, p.far_px, (p.outlined, cameras))
    return np.stack([far * np.cos(angle), far * np.sin(angle)], axis=2)


def draw_elsewhere(prediction: Prediction, p: ElsewhereParameters) -> Floats:
    """Perturbations (n, 6) by which the image of what is seen moves by `near_px` to `far_px` (rms) in any way that
    poses move it."""
    _, jacobian = project_with_jacobians(prediction)
    depth = float(np.median(np.linalg.norm(prediction.point, axis=1)))
    unit = np.repeat([depth, 1.0], 3)
    square = np.einsum("nij,nik->jk", jacobian * unit, jacobian * unit) / len(jacobian)
    value, vector = np.linalg.eigh(square)
    # What moves the image next to nothing does not have to move it so far.
    step = vector / np.sqrt(np.maximum(value, p.least_px_per_unit**2))
    rng = np.random.default_rng(p.seed)
    way = rng.normal(size=(p.poses, 6))
    far = rng.uniform(p.near_px, p.far_px, p.poses) / np.linalg.norm(way, axis=1)
    return np.asarray((way * far[:, None]) @ step.T * unit)
