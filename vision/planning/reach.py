"""The joints with which an arm brings a rig to a pose, and the poses to which one with few joints brings it."""

from __future__ import annotations

import numpy as np

from relmodel.arrays import Floats
from relmodel.geometry.joints import JointTree
from relmodel.geometry.transforms import rotation_vector, skew
from relmodel.world.kinematics import MountedRig

_NEAR_MM, _NEAR = 1.0, np.radians(0.1)  # how exactly an arm must reach a view
_STEPS = 25  # of the search for the joints of a view
_STARTS = 5  # of that search at random, after those of the view before
_ARM_MM = 1000.0  # that a rad counts in it
_JOINT_MM, _JOINT = 100.0, np.radians(15)  # from one value to the next of a carrier with too few joints for any pose
_MOST_JOINTS = 400  # values of all its joints together that are tried


def reach(mounted: MountedRig, poses: Floats) -> list[dict[str, float] | None]:
    """Joints (rad, mm, within their limits) that bring a mounted rig to each of some poses (n, 4, 4); None where none
    were found.

    Damped least squares from the joints of the pose before, then from some at random.  What stands in the arm's way is
    not looked at."""
    tree = mounted.tree
    assert tree is not None
    link, rng = mounted.link or tree.root, np.random.default_rng(0)
    joints = tree.movable
    low, high = _limits(tree)
    turning = np.array([j.kind == "continuous" for j in joints], bool)
    last = np.clip([mounted.joints[j.name] for j in joints], low, high)
    out: list[dict[str, float] | None] = []
    for pose in poses:
        wanted = np.linalg.inv(mounted.world_from_object) @ pose @ np.linalg.inv(mounted.link_from_rig)
        found = None
        for start in (last, *rng.uniform(low, high, (_STARTS, len(joints)))):
            found = _solve(tree, link, wanted, start, np.where(turning, [[-np.inf], [np.inf]], [low, high]))
            if found is not None:
                last = found
                break
        out.append(None if found is None else dict(zip((j.name for j in joints), found.tolist(), strict=True)))
    return out


def reaches_any_pose(mounted: MountedRig) -> bool:
    """Whether what carries a rig has joints for all six freedoms of a pose."""
    return mounted.tree is not None and len(mounted.tree.movable) >= 6


def spread_joints(mounted: MountedRig) -> tuple[Floats, list[dict[str, float]]]:
    """Poses (n, 4, 4) of a mounted rig over the range of its few joints, and these (rad, mm): where it stands alone
    without any."""
    if mounted.tree is None:
        return mounted.world_from_rig[None], [{}]
    joints = mounted.tree.movable
    low, high = _limits(mounted.tree)
    fine = np.array([_JOINT_MM if j.kind == "prismatic" else _JOINT for j in joints])
    count = np.minimum(np.floor((high - low) / fine) + 1, np.floor(_MOST_JOINTS ** (1 / max(len(joints), 1)) + 1e-9))
    axes = [np.linspace(a, b, int(n)) for a, b, n in zip(low, high, count, strict=True)]
    values = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, len(joints))
    given = [dict(zip((j.name for j in joints), row.tolist(), strict=True)) for row in values]
    return np.stack([mounted.moved(row).world_from_rig for row in given]), given


def _limits(tree: JointTree) -> tuple[Floats, Floats]:
    """Limits of the movable joints; of one without any half a turn either way."""
    low, high = ([getattr(j, end) for j in tree.movable] for end in ("lower", "upper"))
    return (
        np.array([-np.pi if limit is None else limit for limit in low], float),
        np.array([np.pi if limit is None else limit for limit in high], float),
    )


def _solve(tree: JointTree, link: str, wanted: Floats, start: Floats, limits: Floats) -> Floats | None:
    """Values of the movable joints near `start` with which a link stands as wanted (4, 4) in the root's frame."""
    names = [j.name for j in tree.movable]
    values, damping = start.copy(), 1e-3
    for _ in range(_STEPS):
        given = tree.values(dict(zip(names, values.tolist(), strict=True)), "joints")
        stands = tree.poses(given)[link]
        if _is_near(stands, wanted):
            return values
        place = stands[:3, 3]
        off = np.concatenate([wanted[:3, 3] - place, _ARM_MM * rotation_vector(wanted[:3, :3] @ stands[:3, :3].T)])
        twist = tree.screws(link, given, names)
        slope = np.concatenate([twist[:3] - skew(place) @ twist[3:], _ARM_MM * twist[3:]])
        normal = slope.T @ slope
        step = np.linalg.solve(normal + damping * np.diag(np.diag(normal) + 1e-9), slope.T @ off)
        values = np.clip(values + np.clip(step, *_longest(tree)), *limits)
    return None


def _longest(tree: JointTree) -> tuple[Floats, Floats]:
    """The longest step of each movable joint, rad and mm: further than that its motion is no line."""
    most = np.array([500.0 if j.kind == "prismatic" else 0.7 for j in tree.movable])
    return -most, most


def _is_near(a: Floats, b: Floats) -> bool:
    apart = np.linalg.norm(a[:3, 3] - b[:3, 3])
    return bool(apart <= _NEAR_MM and np.linalg.norm(rotation_vector(a[:3, :3].T @ b[:3, :3])) <= _NEAR)
