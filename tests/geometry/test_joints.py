"""Trees of joints against chains composed by hand from scipy's rotations, and their screws against differences."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest
from scipy.spatial.transform import Rotation

from relmodel.errors import InputError
from relmodel.geometry.transforms import Joint, JointTree, Mimic
from tests.poses import pose_of

Array = npt.NDArray[np.float64]


def frame(rng: np.random.Generator) -> Array:
    turn = Rotation.random(random_state=int(rng.integers(1 << 30))).as_matrix()
    return pose_of(rng.uniform(-300, 300, 3), turn)


def arm(rng: np.random.Generator, kinds: str = "prrcfr") -> list[Joint]:
    """A chain l0 .. ln of joints j0 .. of the kinds p(rismatic), r(evolute), c(ontinuous), f(ixed)."""
    named = {"p": "prismatic", "r": "revolute", "c": "continuous", "f": "fixed"}
    out = []
    for i, kind in enumerate(kinds):
        axis = rng.normal(size=3)
        axis /= np.linalg.norm(axis)
        out.append(Joint(f"j{i}", named[kind], f"l{i}", f"l{i + 1}", axis, None, None, frame(rng)))
    return out


def by_hand(joints: list[Joint], values: dict[str, float]) -> Array:
    out = np.eye(4)
    for joint in joints:
        way = joint.axis * values.get(joint.name, 0.0)
        turn = Rotation.from_rotvec(way * (joint.kind != "prismatic")).as_matrix()
        out = out @ joint.parent_from_joint @ pose_of(way * (joint.kind == "prismatic"), turn)
    return out


def test_poses_are_the_product_of_the_chain() -> None:
    rng = np.random.default_rng(1)
    for _ in range(20):
        joints = arm(rng)
        shuffled = [joints[i] for i in rng.permutation(len(joints))]
        tree = JointTree([f"l{i}" for i in range(len(joints) + 1)], shuffled)
        given = {j.name: float(rng.uniform(-3, 3)) for j in joints if j.kind != "fixed"}
        poses = tree.poses(tree.values(given, "test"))
        for n in range(len(joints) + 1):
            assert np.abs(poses[f"l{n}"] - by_hand(joints[:n], given | {"j4": 0.0})).max() < 1e-10


def test_screws_are_derivatives() -> None:
    rng = np.random.default_rng(2)
    joints = arm(rng)
    joints[3] = Joint("j3", "revolute", "l3", "l4", joints[3].axis, None, None, frame(rng), Mimic("j1", -0.5, 0.2))
    tree = JointTree([f"l{i}" for i in range(len(joints) + 1)], joints)
    names = [j.name for j in tree.movable]
    assert names == ["j0", "j1", "j2", "j5"]
    at = {name: float(rng.uniform(-1, 1)) for name in names}
    values = tree.values(at, "test")
    assert values["j3"] == pytest.approx(-0.5 * at["j1"] + 0.2)
    screws, h = tree.screws("l6", values, names), 1e-6
    pose = tree.poses(values)["l6"]
    for column, name in zip(screws.T, names, strict=True):
        ahead, behind = (tree.poses(tree.values(at | {name: at[name] + s}, "test"))["l6"] for s in (h, -h))
        rate = (ahead - behind) / (2 * h) @ np.linalg.inv(pose)  # [[w]x v]
        twist = np.concatenate([rate[:3, 3], [rate[2, 1], rate[0, 2], rate[1, 0]]])
        assert np.abs(twist - column).max() < 1e-5


def test_values_degrees_rest_and_limits() -> None:
    x, unit = np.array([1.0, 0, 0]), np.eye(4)
    tree = JointTree(
        ["a", "b", "c", "d"],
        [
            Joint("slide", "prismatic", "a", "b", x, 50.0, 400.0, unit),
            Joint("turn", "revolute", "b", "c", x, -1.0, 1.0, unit),
            Joint("tilt_deg", "continuous", "c", "d", x, None, None, unit),
        ],
    )
    assert tree.values({}, "t") == {"slide": 50.0, "turn": 0.0, "tilt_deg": 0.0}
    given = tree.values({"turn_deg": 30, "tilt_deg": 2.0}, "t")
    assert given["turn"] == pytest.approx(np.pi / 6)
    assert given["tilt_deg"] == 2.0  # a joint of that very name: radians
    for bad, said in (
        ({"turn": 1.1}, r"t: joint 'turn' at 1.1 rad \(63.0.* deg\) is outside its limits -1 .. 1 rad"),
        ({"slide": 401}, "401 mm is outside its limits 50 .. 400 mm"),
        ({"slide_deg": 60}, "prismatic: give its travel in mm"),
        ({"turn": 0, "turn_deg": 0}, "given twice"),
        ({"spin": 0}, "unknown: name one of .*slide, turn, tilt_deg"),
        ({"turn": float("nan")}, "not finite"),
    ):
        with pytest.raises(InputError, match=said):
            tree.values(bad, "t")


def test_what_is_no_tree_is_refused() -> None:
    x, unit = np.array([1.0, 0, 0]), np.eye(4)

    def joint(name: str, parent: str, child: str, mimic: Mimic | None = None) -> Joint:
        return Joint(name, "continuous", parent, child, x, None, None, unit, mimic)

    for links, joints, said in (
        ("ab", [joint("j", "a", "c")], "link 'c'"),
        ("abc", [joint("j", "a", "c"), joint("k", "b", "c")], "has two parent joints"),
        ("ab", [], "have no parent joint"),
        ("ab", [joint("j", "a", "b"), joint("k", "b", "a")], "cycle"),
        ("abc", [joint("j", "b", "c"), joint("k", "c", "b")], "cycle"),
        ("aab", [joint("j", "a", "b")], "link 'a' is defined twice"),
        ("abc", [joint("j", "a", "b"), joint("j", "b", "c")], "joint 'j' is defined twice"),
        ("ab", [joint("j", "a", "b", Mimic("k", 1, 0))], "follows 'k'"),
    ):
        with pytest.raises(InputError, match=said):
            JointTree(list(links), joints)
