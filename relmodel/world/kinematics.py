"""From base travel, joints and mount to where a rig is.

world_from_rig = world_from_object @ object_from_link(joints) @ link_from_rig.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from sqlalchemy import Connection

from relmodel.arrays import Floats
from relmodel.errors import InputError, UsageError
from relmodel.find.find import world_named
from relmodel.geometry.joints import Joint, JointTree, Mimic
from relmodel.geometry.transforms import MATRIX_COLUMNS, matrices
from relmodel.store import Store
from relmodel.store.database import Database


@dataclass(frozen=True)
class LinkFrame:
    """A link of an object: path of the robot that it is of (empty: the object), name in that, None for the root."""

    robot: str
    name: str | None
    object_from_robot: Floats  # (4, 4)
    robot_from_link: Floats  # (4, 4)


class Robots:
    """The robots in a loaded object, by their path in it: the object itself (empty path), and those nested in it."""

    def __init__(self, store: Store, connection: Connection, object_id: int) -> None:
        self._ways = store.rows(connection, "object/robots", object_id=object_id)
        self.object_id = {row.path: int(row.object_id) for row in self._ways if row.moves}
        trees = {i: _joint_tree(store, connection, i) for i in set(self.object_id.values())}
        self.trees = {path: trees[i] for path, i in self.object_id.items()}

    def values(self, given: Mapping[str, float], what: str) -> dict[str, dict[str, float]]:
        """Values of all joints, rad or mm, by robot; a joint of a nested robot is given as ROBOT/JOINT, with its path.

        Otherwise as `JointTree.values`.
        """
        by_robot: dict[str, dict[str, float]] = {path: {} for path in self.trees}
        for name, value in given.items():
            path = self._robot_of(name)
            if path not in by_robot:
                raise InputError(
                    f"{what}: {name!r} names no robot in it: write ROBOT/{name} with one of: {', '.join(self.trees)}"
                )
            by_robot[path][name[len(path) + 1 :] if path else name] = value
        return {
            path: tree.values(by_robot[path], f"{what} of {path}" if path else what)
            for path, tree in self.trees.items()
        }

    def _robot_of(self, name: str) -> str:
        """Path of the robot that a joint or a link is named of: the longest that the name begins with."""
        return max((path for path in self.trees if path and name.startswith(f"{path}/")), key=len, default="")

    def link(self, store: Store, connection: Connection, object_id: int, name: str) -> tuple[str, str, int]:
        """Path of the robot, name in it, and how many such there are, of a link of the object named directly, or as
        ROBOT/LINK."""
        path = self._robot_of(name)
        plain = name[len(path) + 1 :] if path else name
        links = store.rows(connection, "object/links", object_id=self.object_id[path] if path else object_id)
        return path, plain, [link.name for link in links].count(plain)

    def frame(
        self,
        store: Store,
        connection: Connection,
        object_id: int,
        link: str | None,
        values: Mapping[str, Mapping[str, float]],
    ) -> LinkFrame:
        """Where a link of the object, named as for `link`, is at values of joints; of no link the object itself."""
        if link is None:
            return LinkFrame("", None, np.eye(4), np.eye(4))
        path, name, _ = self.link(store, connection, object_id, link)
        if path in self.trees:
            return LinkFrame(path, name, self.frames(values)[path], self.trees[path].poses(values[path])[name])
        links = store.rows(connection, "object/links", object_id=object_id)
        return LinkFrame(path, name, np.eye(4), next(_matrix(found) for found in links if found.name == name))

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

    def links(
        self, store: Database, connection: Connection, values: Mapping[str, Mapping[str, float]]
    ) -> dict[str, Floats]:
        """`object_from_link` (4, 4) of every link of the robots, by its path in the object, a / before each name."""
        links: dict[str, Floats] = {}
        for path, frame in self.frames(values).items():
            poses = self.trees[path].poses(values[path])
            for link in store.rows(connection, "object/links", object_id=self.object_id[path]):
                links[f"/{path}/{link.segment}" if path else f"/{link.segment}"] = frame @ poses[link.name]
        return links


def _joint_tree(store: Store, connection: Connection, object_id: int) -> JointTree:
    rows = store.rows(connection, "object/joints", object_id=object_id)
    links = [row.name for row in store.rows(connection, "object/links", object_id=object_id)]
    joints = [
        Joint(
            name=row.name,
            kind=row.kind,
            parent=row.parent_link,
            child=row.child_link,
            axis=np.array([row.axis_x, row.axis_y, row.axis_z]),
            lower=row.lower_limit,
            upper=row.upper_limit,
            parent_from_joint=_matrix(row),
            mimic=None
            if row.mimic_joint is None
            else Mimic(row.mimic_joint, float(row.mimic_factor), float(row.mimic_offset)),
        )
        for row in rows
    ]
    return JointTree(links, joints)


@dataclass(frozen=True)
class MountedRig:
    """A rig on an object of a world, with the joints of that object where it is a robot, or of a robot nested in it.

    What has no joints and is itself mounted counts as a piece of what carries it: of a rig on a tool at an arm's
    flange the carrier is the arm.

    carrier, object_no: the object in the world.  robot: path of the robot in it that carries (empty: the object).
    world_from_object: of the carrier, or of the nested robot that carries.  link: its name in that.
    object_from_link: of that with its joints at `joints` (rad, mm); the identity where no link is named.
    """

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

        Raises InputError for an unknown joint or a value outside its limits.
        """
        if self.tree is None:
            if joints:
                raise InputError(f"{self.carrier} has no joints: leave {next(iter(joints))} out")
            return self
        own = {j.name: self.joints[j.name] for j in self.tree.movable}
        given = dict(joints)
        for name in given:
            plain = name.removesuffix("_deg")
            own.pop(name if name in own else plain, None)
        values = self.tree.values({**own, **given}, f"joints of {self.carrier}")
        return replace(self, joints=values, object_from_link=self.tree.poses(values)[self.link or self.tree.root])

    def sigmas(self, given: Mapping[str, float]) -> dict[str, float]:
        """Standard deviations of joints, rad or mm, from those given; a name with `_deg` gives one in degrees.

        Raises InputError for a joint that does not move by itself, and a sigma that is not above zero.
        """
        if self.tree is None:
            if given:
                raise InputError(f"{self.carrier} has no joints: leave {next(iter(given))} out")
            return {}
        return self.tree.sigmas(given, f"sigmas of joints of {self.carrier}")


def mounted_rig(store: Store, rig: str, *, world: str | None = None, on: str | None = None) -> MountedRig:
    """A rig of the newest revision of a world, at the joint state that the world has.

    `on`: name of the object that carries it, where several carry a rig of that name.  Raises UsageError where there
    is no such rig, or several.
    """
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
    UsageError where that object does not carry it, or several mounts are left.
    """
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
        link = robots.frame(store, connection, row.object_id, row.link, values)
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
