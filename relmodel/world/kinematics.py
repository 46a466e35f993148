"""From base travel, joints and mount to where a rig is, and their correction from the rig's pose as found."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import radians
from typing import Any

import numpy as np
from sqlalchemy import Connection

from relmodel.arrays import Floats
from relmodel.errors import InputError, UsageError
from relmodel.find.find import world_named
from relmodel.geometry.curves import vectors
from relmodel.geometry.transforms import (
    MATRIX_COLUMNS,
    Joint,
    JointTree,
    Mimic,
    carry,
    inverse,
    matrices,
    rigid,
    rotation_matrix,
    rotation_vector,
    skew,
)
from relmodel.store import Store
from relmodel.store.database import Database

# world_from_rig = world_from_object @ object_from_link(joints) @ link_from_rig.


@dataclass(frozen=True)
class LinkFrame:
    """A link of an object: path of the robot that it is of (empty: the object), name in that, None for the root."""

    robot: str
    name: str | None
    object_from_robot: Floats  # (4, 4)
    robot_from_link: Floats  # (4, 4)


class Robots:
    """The robots in a loaded object, by their path in it: the object itself (empty path), and those nested in it."""

    def __init__(self, store: Database, connection: Connection, object_id: int) -> None:
        self._ways = store.rows(connection, "object/robots", object_id=object_id)
        robots = {row.path: int(row.object_id) for row in self._ways if row.moves}
        links = {i: store.rows(connection, "object/links", object_id=i) for i in {object_id, *robots.values()}}
        self._links = {path: links[i] for path, i in {"": object_id, **robots}.items()}
        joints = {i: _joints(store, connection, i) for i in {*robots.values()}}
        trees = {i: JointTree([link.name for link in links[i]], own) for i, own in joints.items()}
        self.trees = {path: trees[i] for path, i in robots.items()}

    @property
    def link_names(self) -> list[str]:
        """Names of the links of the object itself."""
        return [link.name for link in self._links[""]]

    def values(self, given: Mapping[str, float], what: str) -> dict[str, dict[str, float]]:
        """Values of all joints, rad or mm, by robot; a joint of a nested robot is given as ROBOT/JOINT, with its path.

        Otherwise as `JointTree.values`."""
        by_robot: dict[str, dict[str, float]] = {path: {} for path in self.trees}
        for name, value in given.items():
            path, plain = self._split(name)
            if path not in by_robot:
                raise InputError(
                    f"{what}: {name!r} names no robot in it: write ROBOT/{name} with one of: {', '.join(self.trees)}"
                )
            by_robot[path][plain] = value
        return {
            path: tree.values(by_robot[path], f"{what} of {path}" if path else what)
            for path, tree in self.trees.items()
        }

    def _split(self, name: str) -> tuple[str, str]:
        """Path of the robot that a joint or a link is named of, the longest that it begins with, and its name there."""
        path = max((path for path in self.trees if path and name.startswith(f"{path}/")), key=len, default="")
        return path, name[len(path) + 1 :] if path else name

    def links_named(self, name: str) -> tuple[str, list[Any]]:
        """Path of the robot and its links, rows of `object/links`, that are named directly, or as ROBOT/LINK."""
        path, plain = self._split(name)
        return path, [link for link in self._links[path] if link.name == plain]

    def frame(self, name: str | None, values: Mapping[str, Mapping[str, float]]) -> LinkFrame:
        """Where a link, named as for `links_named`, is at values of joints; of no link the object itself."""
        if name is None:
            return LinkFrame("", None, np.eye(4), np.eye(4))
        path, (link, *_) = self.links_named(name)
        if path in self.trees:
            poses = self.trees[path].poses(values[path])
            return LinkFrame(path, link.name, self.frames(values)[path], poses[link.name])
        return LinkFrame(path, link.name, np.eye(4), _matrix(link))

    def frames(self, values: Mapping[str, Mapping[str, float]]) -> dict[str, Floats]:
        """`object_from_robot` (4, 4) of every robot, at the values of the joints of those that carry it."""
        frames: dict[str, Floats] = {}
        poses = {path: tree.poses(values[path]) for path, tree in self.trees.items()}
        for row in self._ways:
            if row.above is None:
                frames[row.path] = np.eye(4)
            else:
                step = poses[row.above][row.name] if row.above in poses else _matrix(row)
                frames[row.path] = frames[row.above] @ step
        return {path: frames[path] for path in self.trees}

    def links(self, values: Mapping[str, Mapping[str, float]]) -> dict[str, Floats]:
        """`object_from_link` (4, 4) of every link of the robots, by its path in the object, a / before each name."""
        links: dict[str, Floats] = {}
        for path, frame in self.frames(values).items():
            poses = self.trees[path].poses(values[path])
            for link in self._links[path]:
                links[f"/{path}/{link.segment}" if path else f"/{link.segment}"] = frame @ poses[link.name]
        return links


def _joints(store: Database, connection: Connection, object_id: int) -> list[Joint]:
    """The joints of an object, those that carry others before them."""
    found = store.select(connection, "joint", order="joint_no", object_id=object_id)
    limits = [[None if np.isnan(v) else v for v in found[f"{end}_limit"].tolist()] for end in ("lower", "upper")]
    followed = zip(*(found[f"mimic_{c}"].tolist() for c in ("joint", "factor", "offset")), strict=True)
    mimics = [Mimic(*one) if one[0] else None for one in followed]
    named = (found[c].tolist() for c in ("name", "kind", "parent_link", "child_link"))
    columns = (*named, vectors(found, "axis"), *limits, matrices(found), mimics)
    return [Joint(*one) for one in zip(*columns, strict=True)]


@dataclass(frozen=True)
class MountedRig:
    """A rig on an object of a world, with the joints of that object where it is a robot, or of a robot nested in it.

    What has no joints and is itself mounted counts as a piece of what carries it: of a rig on a tool at an arm's
    flange the carrier is the arm.

    carrier, object_no: the object in the world.  robot: path of the robot in it that carries (empty: the object).
    world_from_object: of the carrier, or of the nested robot that carries.  link: its name in that.
    object_from_link: of that with its joints at `joints` (rad, mm); the identity where no link is named."""

    rig: str
    world_id: int
    carrier: str
    object_no: int
    robot: str
    link: str | None
    world_from_object: Floats  # (4, 4)
    object_from_link: Floats  # (4, 4)
    link_from_rig: Floats  # (4, 4)
    tree: JointTree | None
    joints: Mapping[str, float]

    @property
    def world_from_rig(self) -> Floats:
        """(4, 4), mm."""
        return np.asarray(self.world_from_object @ self.object_from_link @ self.link_from_rig)

    @property
    def base(self) -> str:
        """Path of the carrier, or of the nested robot that carries, as in occurrence."""
        return f"{self.carrier}/{self.robot}" if self.robot else self.carrier

    def moved(self, joints: Mapping[str, float]) -> MountedRig:
        """The rig with joints at other values (rad, mm, or degrees where a name ends in `_deg`); others stay.

        Raises InputError for an unknown joint or a value outside its limits."""
        if self.tree is None:
            if joints:
                raise InputError(f"{self.carrier} has no joints: leave {next(iter(joints))} out")
            return self
        what, own = f"joints of {self.carrier}", {j.name: self.joints[j.name] for j in self.tree.movable}
        values = self.tree.values(own | self.tree.named(joints, what), what)
        return replace(self, joints=values, object_from_link=self.tree.poses(values)[self.link or self.tree.root])

    def unit(self, joint: str) -> str:
        """Unit of a joint's values: mm or rad."""
        kinds = {} if self.tree is None else {it.name: it.kind for it in self.tree.joints}
        return "mm" if kinds[joint] == "prismatic" else "rad"

    def sigmas(self, given: Mapping[str, float]) -> dict[str, float]:
        """Standard deviations of joints, rad or mm, from those given; a name with `_deg` gives one in degrees.

        Raises InputError for a joint that does not move by itself, and a sigma that is not above zero."""
        if self.tree is None:
            if given:
                raise InputError(f"{self.carrier} has no joints: leave {next(iter(given))} out")
            return {}
        return self.tree.sigmas(given, f"sigmas of joints of {self.carrier}")


def mounted_rig(store: Store, rig: str, *, world: str | None = None, on: str | None = None) -> MountedRig:
    """A rig of the newest revision of a world, at the joint state that the world has.

    `on`: name of the object that carries it, where several carry a rig of that name.  Raises UsageError where there
    is no such rig, or several."""
    with store.read() as connection:
        world_id, name = world_named(store, connection, world)
        mounts = store.rows(connection, "world/mounts", world_id=world_id)
        found = [m for m in mounts if m.rig == rig and on in (None, m.carrier)]
        if len(found) != 1:
            known = ", ".join(f"{m.rig} on {m.carrier}" for m in mounts if m.rig is not None)
            what = "several rigs" if found else "no rig"
            cure = f"name one of: {known}" if known else "mount one in the world file"
            raise UsageError(f"world {name} mounts {what} {rig}{f' on {on}' if on else ''}: {cure}")
        return _followed_up(store, connection, world_id, mounts, found[0])


def mount_of_rig(store: Store, connection: Connection, world_id: int, rig_id: int, on: str | None) -> MountedRig | None:
    """A rig, known by its content, as a revision of a world mounts it, at the joint state that the world has.

    `on`: name of the object that carries it, where several do.  None where the world does not mount it.  Raises
    UsageError where that object does not carry it, or several mounts are left."""
    mounts = store.rows(connection, "world/mounts", world_id=world_id)
    carried = [m for m in mounts if m.rig_id == rig_id]
    found = [m for m in carried if on in (None, m.carrier)]
    if len(found) == 1:
        return _followed_up(store, connection, world_id, mounts, found[0])
    if not carried:
        return None
    known = ", ".join(dict.fromkeys(m.carrier for m in carried))
    if not found:
        raise UsageError(f"no object {on} carries this rig: name the one that does with --on: {known}")
    if len({m.carrier for m in found}) == 1:
        raise UsageError(f"the world mounts this rig on {known} {len(found)} times: mount it there once")
    raise UsageError(f"several objects carry this rig: say with --on which of them took the pictures: {known}")


def _followed_up(store: Store, connection: Connection, world_id: int, mounts: Sequence[Any], row: Any) -> MountedRig:
    """The rig of a mount, with what carries it followed up to a robot, or to what is mounted on nothing."""
    rig, link_from_rig = row.rig, _matrix(row)
    carried = {m.mounted_no: m for m in mounts if m.mounted_no is not None}
    while True:
        robots = Robots(store, connection, row.object_id)
        values: dict[str, dict[str, float]] = {path: {} for path in robots.trees}
        for state in store.rows(connection, "world/joint_states", world_id=world_id, object_no=row.object_no):
            values[state.robot][state.joint] = float(state.value)
        link = robots.frame(row.link, values)
        if link.robot in robots.trees or row.object_no not in carried:
            break
        row = carried[row.object_no]
        link_from_rig = _matrix(row) @ link.robot_from_link @ link_from_rig
    return MountedRig(
        rig=rig,
        world_id=world_id,
        carrier=row.carrier,
        object_no=int(row.object_no),
        robot=link.robot,
        link=link.name,
        world_from_object=_matrix(row, "w") @ link.object_from_robot,
        object_from_link=link.robot_from_link,
        link_from_rig=link_from_rig,
        tree=robots.trees.get(link.robot),
        joints=values.get(link.robot, {}),
    )


def _matrix(row: Any, letter: str = "m") -> Floats:
    return matrices({name: getattr(row, letter + name[1:]) for name in MATRIX_COLUMNS})


# Correction of the base and the joints of the object that carries a rig, from the rig's pose as found.
#
# Perturbations are ordered (t mm, r rad), on the right: T' = T @ [Exp(r), t], in the frame that T takes from; so are
# their covariances.

_MOST_STEPS = 50
_CONVERGED = 1e-11


@dataclass(frozen=True)
class Carrier:
    """What is known of the object that carries a rig, at the time of the pictures.

    on: its name, where several carry the rig.  joints: values other than the world's.  joint_sigmas: one standard
    deviation of each joint that is to be corrected; the others stay fixed.  Both rad or mm, or degrees where a name
    ends in `_deg`.  base_covariance: (6, 6) of the base where the world has it; None: it may be anywhere.  base_sigmas:
    what a prior by the joints takes for that, one standard deviation along (mm) and about (rad) each axis."""

    on: str | None = None
    joints: Mapping[str, float] = field(default_factory=dict)
    joint_sigmas: Mapping[str, float] = field(default_factory=dict)
    base_covariance: Floats | None = None
    base_sigmas: tuple[float, float] = (5.0, radians(0.5))

    @property
    def is_given(self) -> bool:
        """Whether any of this is given."""
        return self.on is not None or bool(self.joints) or bool(self.joint_sigmas)

    def named(self, on: str) -> Carrier:
        """What is known of that one of several; joints are of all, unless they are of one."""
        if not on or on == self.on:
            return self
        return replace(self, on=on) if self.on is None else replace(self, on=on, joints={}, joint_sigmas={})


@dataclass(frozen=True)
class Correction:
    """What a found pose of a rig says of the arm that carries it.

    mounted: the rig as the world has it, at the joints that were given.  prior_sigmas: those of
    the joints that went in.  world_from_object: the corrected pose of the arm's base (4, 4); shift and turn: that
    of its origin in the world's axes, mm, and the rotation vector in the base's frame, rad.  covariance: (6, 6) of the
    base's pose, t mm then r rad, a right perturbation in the base's frame: R C R^T along the world's axes.  joints:
    value of each joint, corrected where its sigma was given; joint_sigmas: what is left of those."""

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
            "stated_joints": {name: self.mounted.joints[name] for name in self.joints},
            "joint_units": {name: self.mounted.unit(name) for name in self.joints},
        }


def predict_covariance(mounted: MountedRig, carrier: Carrier) -> Floats:
    """The covariance (6, 6) of where the carrier's joints put its rig, a right perturbation in the rig's frame.

    Raises InputError for joints that do not move."""
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
    InputError for a sigma or a covariance that is not positive, and joints that do not move."""
    sigmas = mounted.sigmas(joint_sigmas or {})
    names = list(sigmas)
    weight = _information(covariance, "the found pose")
    base_weight = np.zeros((6, 6)) if base_covariance is None else _information(base_covariance, "the base")
    joint_weight = np.array([1 / sigmas[n] ** 2 for n in names])

    base, change = mounted.world_from_object.copy(), np.zeros(len(names))

    def moved() -> dict[str, float]:
        return dict(mounted.joints) | {n: mounted.joints[n] + d for n, d in zip(names, change.tolist(), strict=True)}

    for _ in range(_MOST_STEPS):
        object_from_rig, chain = _chain(mounted, moved(), names)
        error, slope = _perturbation(world_from_rig_found, base @ object_from_rig)
        away, base_slope = _perturbation(mounted.world_from_object, base)
        slope = slope @ chain
        information = slope.T @ weight @ slope
        information[:6, :6] += base_slope.T @ base_weight @ base_slope
        information[6:, 6:] += np.diag(joint_weight)
        downhill = np.concatenate([base_slope.T @ base_weight @ away, joint_weight * change])
        step = -np.linalg.solve(information, slope.T @ weight @ error + downhill)
        base, change = base @ rigid(rotation_matrix(step[3:6]), step[:3]), change + step[6:]
        if np.abs(step).max() < _CONVERGED:
            break
    posterior: Floats = np.asarray(np.linalg.inv(information), float)
    return Correction(
        mounted=mounted,
        prior_sigmas=sigmas,
        world_from_object=base,
        shift=base[:3, 3] - mounted.world_from_object[:3, 3],
        turn=_perturbation(mounted.world_from_object, base)[0][3:],
        covariance=posterior[:6, :6],
        joints=moved() if mounted.tree is None else mounted.tree.followed(moved()),
        joint_sigmas=dict(zip(names, np.sqrt(np.diag(posterior)[6:]).tolist(), strict=True)),
    )


def _chain(mounted: MountedRig, values: dict[str, float], names: list[str]) -> tuple[Floats, Floats]:
    """object_from_rig (4, 4) at joint values, and the Jacobian (6, 6 + n) of the rig's perturbation by base, joints."""
    if mounted.tree is None or mounted.link is None:
        object_from_link, screws = mounted.object_from_link, np.zeros((6, len(names)))
    else:
        values = mounted.tree.followed(values)
        object_from_link = mounted.tree.poses(values)[mounted.link]
        screws = mounted.tree.screws(mounted.link, values, names)
    object_from_rig = np.asarray(object_from_link @ mounted.link_from_rig)
    return object_from_rig, carry(inverse(object_from_rig)) @ np.hstack([np.eye(6), screws])


def _information(covariance: Floats, what: str) -> Floats:
    covariance = np.asarray(covariance, float)
    if covariance.shape != (6, 6) or not np.isfinite(covariance).all():
        raise InputError(f"the covariance of {what} is not made of 6x6 numbers: give it in mm and rad")
    scale = np.sqrt(np.abs(np.diag(covariance)))
    if not (scale > 0).all() or np.linalg.eigvalsh(covariance / np.outer(scale, scale)).min() <= 1e-14:
        raise InputError(f"the covariance of {what} is not positive: give one that has an inverse")
    inner = np.linalg.inv(covariance / np.outer(scale, scale))
    return np.asarray(inner / np.outer(scale, scale))


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
