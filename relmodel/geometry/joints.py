"""Trees of links and joints: where the links are for given joint values, and how they move with them.

A joint's frame lies in its parent link (`parent_from_joint`); the child link's frame is the joint's, turned about or
moved along the axis by the joint's value (the convention of URDF).  Angles rad, travel mm.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from relmodel.arrays import Floats
from relmodel.errors import InputError
from relmodel.geometry.transforms import rotation_matrix

KINDS = ("revolute", "continuous", "prismatic", "fixed")
_LIMIT_SLACK = 1e-9


@dataclass(frozen=True)
class Mimic:
    """A joint whose value follows another's: factor * value + offset."""

    joint: str
    factor: float
    offset: float


@dataclass(frozen=True)
class Joint:
    """One joint; lower and upper are None where it has no limit."""

    name: str
    kind: str
    parent: str
    child: str
    axis: Floats  # (3,) unit, in the joint's frame
    lower: float | None
    upper: float | None
    parent_from_joint: Floats  # (4, 4)
    mimic: Mimic | None = None

    def motion(self, value: float) -> Floats:
        """`joint_from_child` (4, 4) at a value, rad or mm."""
        out = np.eye(4)
        if self.kind == "prismatic":
            out[:3, 3] = value * self.axis
        elif self.kind != "fixed":
            out[:3, :3] = rotation_matrix(value * self.axis)
        return out


class JointTree:
    """Links connected by joints, one root; parent joints come first.

    Raises InputError where a name stands twice or is unknown, a link has two parents, there are several roots, or
    joints close a ring.
    """

    def __init__(self, links: Sequence[str], joints: Sequence[Joint]) -> None:
        for what, names in (("link", list(links)), ("joint", [j.name for j in joints])):
            twice = sorted({name for name in names if names.count(name) > 1})
            if twice:
                raise InputError(f"the {what} {twice[0]!r} is defined twice: give one of them another name")
        self.links = tuple(links)
        by_child: dict[str, Joint] = {}
        for joint in joints:
            for link in (joint.parent, joint.child):
                if link not in links:
                    raise InputError(f"joint {joint.name!r} names the link {link!r}, which is not there: add the link")
            if joint.child in by_child:
                raise InputError(
                    f"link {joint.child!r} has two parent joints, {by_child[joint.child].name!r} and {joint.name!r}: "
                    "links must form a tree"
                )
            by_child[joint.child] = joint
        roots = [link for link in links if link not in by_child]
        if len(roots) > 1:
            raise InputError(
                f"the links {roots[0]!r} and {roots[1]!r} have no parent joint: join them, one link is the root"
            )
        self.joints = tuple(_ordered(joints, roots))
        if len(self.joints) < len(joints) or not roots:
            ring = next(j for j in joints if j not in self.joints)
            raise InputError(f"joint {ring.name!r} belongs to a cycle of joints: links must form a tree")
        self.root = roots[0]
        self._joint = {j.name: j for j in self.joints}
        self._above = by_child
        for joint in joints:
            if joint.mimic is not None:
                leader = self._joint.get(joint.mimic.joint)
                if leader is None or leader.kind == "fixed" or leader.mimic is not None:
                    raise InputError(
                        f"joint {joint.name!r} follows {joint.mimic.joint!r}, which does not move by itself: name one "
                        "that does"
                    )

    @property
    def movable(self) -> tuple[Joint, ...]:
        """Joints that have a value of their own."""
        return tuple(j for j in self.joints if j.kind != "fixed" and j.mimic is None)

    def values(self, given: Mapping[str, float], what: str) -> dict[str, float]:
        """Values of all joints that move, rad or mm, from those given; a name with `_deg` gives an angle in degrees.

        A joint that is not given stands at zero, or at the limit next to it.  Raises InputError, beginning with
        `what`, for an unknown joint, one given twice, or a value outside the limits, of a follower too.
        """
        named: dict[str, float] = {}
        for name, number in given.items():
            joint, value = self._named(name, float(number), what)
            if joint.name in named:
                raise InputError(f"{what}: joint {joint.name!r} is given twice: give it once")
            named[joint.name] = value
        out = {}
        for joint in self.movable:
            low = -np.inf if joint.lower is None else joint.lower
            high = np.inf if joint.upper is None else joint.upper
            out[joint.name] = named.get(joint.name, float(np.clip(0.0, low, high)))
        for joint in self.joints:
            if joint.mimic is not None:
                out[joint.name] = joint.mimic.factor * out[joint.mimic.joint] + joint.mimic.offset
        for joint in self.joints:
            if joint.name in out:
                _check_limits(joint, out[joint.name], what)
        return out

    def sigmas(self, given: Mapping[str, float], what: str) -> dict[str, float]:
        """Standard deviations of the joints given, rad or mm, named as for `values`.

        Raises InputError, beginning with `what`, for an unknown joint, one given twice, or a sigma that is not above
        zero.
        """
        out: dict[str, float] = {}
        for name, number in given.items():
            joint, sigma = self._named(name, float(number), what)
            if joint.name in out:
                raise InputError(f"{what}: joint {joint.name!r} is given twice: give it once")
            if not 0 < sigma < np.inf:
                raise InputError(f"{what}: that of joint {joint.name!r} is {sigma:g}: give one above zero")
            out[joint.name] = sigma
        return out

    def _named(self, name: str, value: float, what: str) -> tuple[Joint, float]:
        """The joint of a name that may end in `_deg`, and its value in rad or mm."""
        joint = self._joint.get(name)
        if joint is None and name.endswith("_deg"):
            joint = self._joint.get(name.removesuffix("_deg"))
            if joint is not None and joint.kind == "prismatic":
                raise InputError(f"{what}: joint {joint.name!r} is prismatic: give its travel in mm, without _deg")
            value = float(np.radians(value))
        if joint is None or joint not in self.movable:
            known = ", ".join(j.name for j in self.movable) or "there are none"
            why = "unknown" if joint is None else "fixed" if joint.kind == "fixed" else "a follower of another"
            raise InputError(f"{what}: joint {name!r} is {why}: name one of those that move by themselves: {known}")
        return joint, value

    def poses(self, values: Mapping[str, float]) -> dict[str, Floats]:
        """`root_from_link` (4, 4) of every link at the values (of `values()`) of the joints."""
        out = {self.root: np.eye(4)}
        for joint in self.joints:
            out[joint.child] = out[joint.parent] @ joint.parent_from_joint @ joint.motion(values.get(joint.name, 0.0))
        return out

    def screws(self, link: str, values: Mapping[str, float], names: Sequence[str]) -> Floats:
        """How the link moves with the joints `names`: twists (6, n), (v mm, w rad) about the root's origin, each per
        rad or mm, in the root's frame: root_from_link' = (1 + [twist]) root_from_link.  Joints that follow count in.
        """
        poses = self.poses(values)
        out = np.zeros((6, len(names)))
        while link != self.root:
            joint = self._above[link]
            leader, factor = (joint.name, 1.0) if joint.mimic is None else (joint.mimic.joint, joint.mimic.factor)
            if leader in names:
                frame = poses[joint.parent] @ joint.parent_from_joint
                axis = frame[:3, :3] @ joint.axis
                if joint.kind == "prismatic":
                    twist = np.concatenate([axis, np.zeros(3)])
                else:
                    twist = np.concatenate([np.cross(frame[:3, 3], axis), axis])
                out[:, list(names).index(leader)] += factor * twist
            link = joint.parent
        return out


def _ordered(joints: Sequence[Joint], roots: list[str]) -> list[Joint]:
    """Joints reached from the roots, breadth first."""
    carried: dict[str, list[Joint]] = {}
    for joint in joints:
        carried.setdefault(joint.parent, []).append(joint)
    out: list[Joint] = []
    reached = list(roots)
    for link in reached:
        out += carried.get(link, [])
        reached += [j.child for j in carried.get(link, [])]
    return out


def _check_limits(joint: Joint, value: float, what: str) -> None:
    if not np.isfinite(value):
        raise InputError(f"{what}: joint {joint.name!r} has a value that is not finite: correct it")
    low = -np.inf if joint.lower is None else joint.lower
    high = np.inf if joint.upper is None else joint.upper
    if not low - _LIMIT_SLACK <= value <= high + _LIMIT_SLACK:
        if joint.kind == "prismatic":
            said = f"{value:g} mm is outside its limits {low:g} .. {high:g} mm"
        else:
            said = (
                f"{value:g} rad ({np.degrees(value):g} deg) is outside its limits {low:g} .. {high:g} rad "
                f"({np.degrees(low):g} .. {np.degrees(high):g} deg)"
            )
        raise InputError(f"{what}: joint {joint.name!r} at {said}: give a value within them")
