"""Correction of the base and the joints of the object that carries a rig, from the rig's pose as found.

Perturbations are ordered (t mm, r rad), on the right: T' = T @ [Exp(r), t], in the frame that T takes from; so are
their covariances.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import radians
from typing import Any

import numpy as np

from relmodel.arrays import Floats
from relmodel.errors import InputError
from relmodel.geometry.transforms import inverse, rotation_matrix, rotation_vector, skew
from relmodel.world.kinematics import MountedRig

_MOST_STEPS = 50
_CONVERGED = 1e-11


@dataclass(frozen=True)
class Carrier:
    """What is known of the object that carries a rig, at the time of the pictures.

    on: its name, where several carry the rig.  joints: values other than the world's.  joint_sigmas: one standard
    deviation of each joint that is to be corrected; the others stay fixed.  Both rad or mm, or degrees where a name
    ends in `_deg`.  base_covariance: (6, 6) of the base where the world has it; None: it may be anywhere.  base_sigmas:
    what a prior by the joints takes for that, one standard deviation along (mm) and about (rad) each axis.
    """

    on: str | None = None
    joints: Mapping[str, float] = field(default_factory=dict)
    joint_sigmas: Mapping[str, float] = field(default_factory=dict)
    base_covariance: Floats | None = None
    base_sigmas: tuple[float, float] = (5.0, radians(0.5))

    @property
    def is_given(self) -> bool:
        """Whether any of this is given."""
        return self.on is not None or bool(self.joints) or bool(self.joint_sigmas)


@dataclass(frozen=True)
class Correction:
    """What a found pose of a rig says of the arm that carries it.

    mounted: the rig as the world has it, at the joints that were given.  prior_sigmas: those of
    the joints that went in.  world_from_object: the corrected pose of the arm's base (4, 4); shift and turn: that
    of its origin in the world's axes, mm, and the rotation vector in the base's frame, rad.  covariance: (6, 6) of the
    base's pose, t mm then r rad, a right perturbation in the base's frame: R C R^T along the world's axes.  joints:
    value of each joint, corrected where its sigma was given; joint_sigmas: what is left of those.
    """

    mounted: MountedRig
    prior_sigmas: dict[str, float]
    world_from_object: Floats
    shift: Floats
    turn: Floats
    covariance: Floats
    joints: dict[str, float]
    joint_sigmas: dict[str, float]

    def to_json(self) -> dict[str, Any]:
        """The corrected poses and values as plain numbers."""
        return {
            "carrier": self.mounted.base,
            "world_from_object": self.world_from_object.tolist(),
            "shift_mm": self.shift.tolist(),
            "turn_rad": self.turn.tolist(),
            "covariance": self.covariance.tolist(),
            "joints": self.joints,
            "joint_sigmas": self.joint_sigmas,
        }


def predict_covariance(mounted: MountedRig, carrier: Carrier) -> Floats:
    """The covariance (6, 6) of where the carrier's joints put its rig, a right perturbation in the rig's frame.

    Raises InputError for joints that do not move.
    """
    sigmas = mounted.sigmas(carrier.joint_sigmas)
    _, chain = _chain(mounted, dict(mounted.joints), list(sigmas))
    spread = np.concatenate([np.repeat(carrier.base_sigmas, 3), list(sigmas.values())])
    return np.asarray((chain * spread**2) @ chain.T)


def correct_base(
    mounted: MountedRig,
    world_from_rig_found: Floats,
    covariance: Floats,
    *,
    joint_sigmas: Mapping[str, float] | None = None,
    base_covariance: Floats | None = None,
) -> Correction:
    """The correction of an arm's base, and of joints, from the pose of its rig that was found.

    Least squares with priors: the found pose with its covariance (6, 6), joints at their values with `joint_sigmas`
    (as `Carrier` takes them), the base at its place with `base_covariance` (6, 6).  Joints without a sigma stay fixed.
    Without a base_covariance the base may be anywhere: then only the base is corrected, and sigmas of joints widen its
    covariance.  (Gauss-Newton; Jacobians of the chain after Lynch and Park, Modern Robotics, 2017, 5.1.) Raises
    InputError for a sigma or a covariance that is not positive, and joints that do not move.
    """
    sigmas = mounted.sigmas(joint_sigmas or {})
    names = list(sigmas)
    weight = _information(covariance, "the found pose")
    base_weight = np.zeros((6, 6)) if base_covariance is None else _information(base_covariance, "the base")
    joint_weight = np.array([1 / sigmas[n] ** 2 for n in names])

    base, change = mounted.world_from_object.copy(), np.zeros(len(names))
    for _ in range(_MOST_STEPS):
        values = dict(mounted.joints) | {n: mounted.joints[n] + d for n, d in zip(names, change, strict=True)}
        object_from_rig, chain = _chain(mounted, values, names)
        error, slope = _perturbation(world_from_rig_found, base @ object_from_rig)
        away, base_slope = _perturbation(mounted.world_from_object, base)
        slope = slope @ chain
        information = slope.T @ weight @ slope
        information[:6, :6] += base_slope.T @ base_weight @ base_slope
        information[6:, 6:] += np.diag(joint_weight)
        downhill = np.concatenate([base_slope.T @ base_weight @ away, joint_weight * change])
        step = -np.linalg.solve(information, slope.T @ weight @ error + downhill)
        base, change = _perturbed(base, step[:6]), change + step[6:]
        if np.abs(step).max() < _CONVERGED:
            break
    posterior: Floats = np.asarray(np.linalg.inv(information), float)
    values = _followed(
        mounted, dict(mounted.joints) | {n: mounted.joints[n] + d for n, d in zip(names, change.tolist(), strict=True)}
    )
    return Correction(
        mounted=mounted,
        prior_sigmas=sigmas,
        world_from_object=base,
        shift=base[:3, 3] - mounted.world_from_object[:3, 3],
        turn=_perturbation(mounted.world_from_object, base)[0][3:],
        covariance=posterior[:6, :6],
        joints=values,
        joint_sigmas=dict(zip(names, np.sqrt(np.diag(posterior)[6:]).tolist(), strict=True)),
    )


def _chain(mounted: MountedRig, values: dict[str, float], names: list[str]) -> tuple[Floats, Floats]:
    """object_from_rig (4, 4) at joint values, and the Jacobian (6, 6 + n) of the rig's perturbation by the base's and
    the joints'."""
    if mounted.tree is None or mounted.link is None:
        object_from_link, screws = mounted.object_from_link, np.zeros((6, len(names)))
    else:
        values = _followed(mounted, values)
        object_from_link = mounted.tree.poses(values)[mounted.link]
        screws = mounted.tree.screws(mounted.link, values, names)
    object_from_rig = np.asarray(object_from_link @ mounted.link_from_rig)
    return object_from_rig, _adjoint(inverse(object_from_rig)) @ np.hstack([np.eye(6), screws])


def _followed(mounted: MountedRig, values: dict[str, float]) -> dict[str, float]:
    """Values with those of joints that follow others recomputed."""
    for joint in mounted.tree.joints if mounted.tree is not None else ():
        if joint.mimic is not None:
            values[joint.name] = joint.mimic.factor * values[joint.mimic.joint] + joint.mimic.offset
    return values


def _information(covariance: Floats, what: str) -> Floats:
    covariance = np.asarray(covariance, float)
    if covariance.shape != (6, 6) or not np.isfinite(covariance).all():
        raise InputError(f"the covariance of {what} is not made of 6x6 numbers: give it in mm and rad")
    scale = np.sqrt(np.abs(np.diag(covariance)))
    if not (scale > 0).all() or np.linalg.eigvalsh(covariance / np.outer(scale, scale)).min() <= 1e-14:
        raise InputError(f"the covariance of {what} is not positive: give one that has an inverse")
    inner = np.linalg.inv(covariance / np.outer(scale, scale))
    return np.asarray(inner / np.outer(scale, scale))


def _adjoint(a_from_b: Floats) -> Floats:
    """(6, 6) that takes twists (v, w) in frame b to frame a."""
    rotation, (x, y, z) = a_from_b[:3, :3], a_from_b[:3, 3]
    out = np.zeros((6, 6))
    out[:3, :3] = out[3:, 3:] = rotation
    out[:3, 3:] = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]]) @ rotation
    return out


def _perturbed(transform: Floats, delta: Floats) -> Floats:
    step = np.eye(4)
    step[:3, :3], step[:3, 3] = rotation_matrix(delta[3:]), delta[:3]
    return np.asarray(transform @ step)


def _perturbation(a: Floats, b: Floats) -> tuple[Floats, Floats]:
    """The perturbation (6,) that takes pose a to pose b, and its Jacobian (6, 6) by perturbations of b."""
    d = inverse(a) @ b
    turn = rotation_vector(d[:3, :3])
    angle, cross = float(np.linalg.norm(turn)), skew(turn)
    bend = 1 / 12 if angle < 1e-3 else 1 / angle**2 - 1 / (2 * angle * np.tan(angle / 2))
    jacobian = np.zeros((6, 6))
    jacobian[:3, :3] = d[:3, :3]
    jacobian[3:, 3:] = np.eye(3) + cross / 2 + bend * cross @ cross  # inverse right Jacobian of SO(3)
    return np.concatenate([d[:3, 3], turn]), jacobian
