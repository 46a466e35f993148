"""The demonstration pairs' exact truth, and how far a pose is from it."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from relmodel.arrays import Floats
from relmodel.geometry.transforms import apply, inverse


@dataclass(frozen=True)
class Truth:
    """Where the rig (4, 4) and the point it looks at (3,), mm in the world, truly were, and which variant it saw."""

    variant: str
    world_from_rig: Floats
    target: Floats


@dataclass(frozen=True)
class PoseError:
    """How far off a pose of the rig puts the target point, seen from the rig (mm), and turns it (degrees)."""

    target_mm: float
    rotation_deg: float


def read_truth(path: Path) -> Truth:
    """Truth of a rendered pair, as `examples/README.md` describes it."""
    data = json.loads(path.read_text())
    target = apply(np.array(data["world_from_object"]), np.array([data["target_in_object"]]))[0]
    return Truth(data["variant"], np.array(data["world_from_rig"]), target)


def measure_pose_error(world_from_rig: Floats, truth: Truth) -> PoseError:
    """Error of a pose (4, 4) against the truth."""
    off = inverse(truth.world_from_rig) @ world_from_rig
    cosine = np.clip((np.trace(off[:3, :3]) - 1) / 2, -1, 1)
    seen, true = (apply(inverse(pose), truth.target[None])[0] for pose in (world_from_rig, truth.world_from_rig))
    return PoseError(float(np.linalg.norm(seen - true)), float(np.degrees(np.arccos(cosine))))
