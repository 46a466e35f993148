"""From joints to rigs and back: chains by hand from scipy's rotations, corrections against a general least squares."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import sqlalchemy as sa
import yaml
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from relmodel.app.cli.main import main
from relmodel.errors import InputError, UsageError
from relmodel.geometry.transforms import MATRIX_COLUMNS
from relmodel.store import Store
from relmodel.world import place_world
from relmodel.world.kinematics import MountedRig, correct_base, mounted_rig
from tests.given import Capsys, CopyStore, NewStore
from tests.poses import pose_of
from tests.reading import load
from tests.store.amiss import flaws

Array = npt.NDArray[np.float64]

URDF = """<robot name="crane">
<link name="rail"><visual><geometry><box size="2 0.2 0.1"/></geometry></visual></link>
<link name="mast"><visual><origin xyz="0 0 0.5"/>
  <geometry><cylinder radius="0.1" length="1"/></geometry></visual></link>
<link name="boom"><visual><origin xyz="0.4 0 0"/><geometry><box size="0.8 0.1 0.1"/></geometry></visual></link>
<link name="flange"/>
<joint name="tilt" type="revolute"><parent link="mast"/><child link="boom"/><origin xyz="0 0 1" rpy="0.1 0 0.2"/>
  <axis xyz="0 1 0"/><limit lower="-1" upper="1"/></joint>
<joint name="travel" type="prismatic"><parent link="rail"/><child link="mast"/><axis xyz="1 0 0"/>
  <limit lower="-0.9" upper="0.9"/></joint>
<joint name="face" type="continuous"><parent link="boom"/><child link="flange"/><origin xyz="0.8 0 0" rpy="0 1.2 0"/>
  <axis xyz="0 0 1"/></joint>
</robot>"""
WORLD_FROM: dict[str, Array] = {
    "one": np.array([[0.0, -1, 0, 500], [1, 0, 0, -300], [0, 0, 1, 20], [0, 0, 0, 1]]),
    "two": np.eye(4),
}
MOUNT = [[0, 1, 0, 5], [-1, 0, 0, 110], [0, 0, 1, 60], [0, 0, 0, 1]]
STATES = {"one": {"travel": 350, "tilt_deg": 30, "face": 0.4}, "two": {"tilt": -0.3}}
RIG = {
    "cameras": {
        "left": {
            "width": 640,
            "height": 480,
            "matrix": [[900.0, 0, 319.5], [0, 900.0, 239.5], [0, 0, 1]],
            "rig_from_camera": np.eye(4).tolist(),
        }
    }
}


def transform(rpy: npt.ArrayLike = (0, 0, 0), xyz: npt.ArrayLike = (0, 0, 0)) -> Array:
    return pose_of(xyz, Rotation.from_euler("xyz", np.asarray(rpy, float)).as_matrix())


def links_by_hand(travel: float, tilt: float, face: float) -> dict[str, Array]:
    mast = transform(xyz=(travel, 0, 0))
    boom = mast @ transform((0.1, 0, 0.2), (0, 0, 1000)) @ transform((0, tilt, 0))
    return {
        "rail": np.eye(4),
        "mast": mast,
        "boom": boom,
        "flange": boom @ transform((0, 1.2, 0), (800, 0, 0)) @ transform((0, 0, face)),
    }


TRUE = {"one": links_by_hand(350, np.radians(30), 0.4), "two": links_by_hand(0, -0.3, 0)}


def cell(folder: Path, **change: Any) -> Path:
    (folder / "crane.urdf").write_text(URDF)
    (folder / "head.yaml").write_text(yaml.safe_dump(RIG))
    objects = [
        {
            "object": "crane",
            "name": n,
            "role": "robot",
            "world_from_object": WORLD_FROM[n].tolist(),
            "joints": dict(STATES[n]),
        }
        for n in ("one", "two")
    ]
    objects[0]["joints"] |= change.get("joints", {})
    mounts = [{"rig": "head", "on": n, "link": change.get("link", "flange"), "carrier_from_rig": MOUNT} for n in STATES]
    file = {"world": "w", "objects": objects, "rigs": [{"name": "head", "file": "head.yaml"}], "mounts": mounts}
    (folder / "cell.yaml").write_text(yaml.safe_dump(file))
    return folder / "cell.yaml"


def placed(store_target: str, file: Path) -> None:
    with Store.open(store_target) as store:
        load(store, file.with_name("crane.urdf"), name="crane")
    assert main(["world", str(file), "--store", store_target]) == 0


def test_every_link_is_placed_by_its_joints(fresh_store: str, tmp_path: Path) -> None:
    file = cell(tmp_path)
    placed(fresh_store, file)
    assert main(["world", str(file), "--store", fresh_store]) == 0  # unchanged: adds no row
    with Store.open(fresh_store) as store:
        with store.read() as connection:
            rows = connection.execute(sa.text("SELECT * FROM occurrence")).mappings().all()
            assert connection.execute(sa.text("SELECT count(*) FROM world")).scalar() == 1
        assert not flaws(store, "world_", "object_", "placed_body")
        rigs = {n: mounted_rig(store, "head", on=n) for n in STATES}
    at = {r["path"]: np.array([r[c] for c in MATRIX_COLUMNS]).reshape(3, 4) for r in rows}
    for name, links in TRUE.items():
        for link, pose in links.items():
            assert np.abs(at[f"{name}/{link}"] - (WORLD_FROM[name] @ pose)[:3]).max() < 1e-9
        tube = WORLD_FROM[name] @ links["mast"] @ transform(xyz=(0, 0, 500))
        assert np.abs(at[f"{name}/mast/mast"] - tube[:3]).max() < 1e-9
        assert np.abs(rigs[name].world_from_rig - WORLD_FROM[name] @ links["flange"] @ MOUNT).max() < 1e-9
    moved = rigs["one"].moved({"travel": -200, "tilt": 0.1})
    expected = WORLD_FROM["one"] @ links_by_hand(-200, 0.1, 0.4)["flange"] @ MOUNT
    assert np.abs(moved.world_from_rig - expected).max() < 1e-9


def test_wrong_states_and_links_are_refused(cranes: str, copy_store: CopyStore, tmp_path: Path) -> None:
    with Store.open(copy_store(cranes)) as store:
        for change, said in (
            ({"joints": {"tilt_deg": 70}}, r"cell.yaml: joints of objects\[0\]: joint 'tilt' at .*70 deg.*outside"),
            ({"joints": {"spin": 1}}, "joint 'spin' is unknown: name one of .*travel"),
            ({"joints": {"travel": "far"}}, "joint travel of .* is 'far': give a number"),
            ({"link": "hand"}, r"mounts\[0\] names the link 'hand'.*rail, mast, boom, flange"),
        ):
            with pytest.raises(InputError, match=said):
                place_world(store, cell(tmp_path, **change), write_rig=lambda *_: 0)
        with pytest.raises(UsageError, match="no rig hand"):
            mounted_rig(store, "hand")


@pytest.fixture(scope="module")
def cranes(tmp_path_factory: pytest.TempPathFactory, new_store: NewStore) -> str:
    """A store with the cell, for tests that only read it or copy it."""
    target = new_store("duckdb")
    placed(target, cell(tmp_path_factory.mktemp("cell")))
    return target


@pytest.fixture(scope="module")
def rig(cranes: str) -> MountedRig:
    with Store.open(cranes, read_only=True) as store:
        with pytest.raises(UsageError, match="several rigs head: name one of: head on one, head on two"):
            mounted_rig(store, "head")
        return mounted_rig(store, "head", on="one")


SIGMA = np.diag(np.repeat([0.5**2, 0.001**2], 3))


def test_joints_held_the_base_takes_all(rig: MountedRig) -> None:
    rng = np.random.default_rng(5)
    for _ in range(5):
        true_base = WORLD_FROM["one"] @ transform(rng.normal(0, 0.05, 3), rng.normal(0, 40, 3))
        found = true_base @ TRUE["one"]["flange"] @ MOUNT
        correction = correct_base(rig, found, SIGMA)
        assert np.abs(correction.world_from_object - true_base).max() < 1e-8
        assert correction.joints == dict(rig.joints)
        assert correction.shift == pytest.approx(true_base[:3, 3] - WORLD_FROM["one"][:3, 3])
    # Its covariance, by how far bases go that are computed from poses a little off.
    base_from_rig = TRUE["one"]["flange"] @ MOUNT
    gone = np.empty((6, 6))
    for i, d in enumerate(np.eye(6) * 1e-6):
        away = base_from_rig @ pose_of(d[:3], d[3:]) @ np.linalg.inv(base_from_rig)
        gone[:, i] = [*away[:3, 3], *Rotation.from_matrix(away[:3, :3]).as_rotvec()]
    truth = gone @ SIGMA @ gone.T * 1e12
    scale = np.sqrt(np.diag(truth))
    assert np.abs((truth - correction.covariance) / np.outer(scale, scale)).max() < 1e-3


def test_joints_with_sigmas_share_the_correction(rig: MountedRig) -> None:
    rng = np.random.default_rng(6)
    base_sigma = np.repeat([2.0, 0.003], 3)
    sigmas = {"tilt": 0.01, "travel": 8.0}
    world = WORLD_FROM["one"]
    for _ in range(3):
        true_base = world @ transform(rng.normal(0, 0.003, 3), rng.normal(0, 2, 3))
        found = true_base @ links_by_hand(357, np.radians(30) - 0.012, 0.4)["flange"] @ MOUNT
        answer = correct_base(rig, found, SIGMA, joint_sigmas=sigmas, base_covariance=np.diag(base_sigma**2))

        def residuals(x: Array, found: Array = found) -> Array:
            pose = (
                world @ pose_of(x[:3], x[3:6]) @ links_by_hand(350 + x[7], np.radians(30) + x[6], 0.4)["flange"] @ MOUNT
            )
            d = np.linalg.inv(pose) @ found
            error = np.array([*d[:3, 3], *Rotation.from_matrix(d[:3, :3]).as_rotvec()])
            sigma = np.sqrt(np.diag(SIGMA))
            return np.concatenate([error / sigma, x[:6] / base_sigma, x[6:] / [sigmas["tilt"], sigmas["travel"]]])

        best = least_squares(residuals, np.zeros(8), x_scale=[1, 1, 1, 1e-3, 1e-3, 1e-3, 1e-2, 5], xtol=1e-12)
        assert answer.joints["tilt"] - np.radians(30) == pytest.approx(best.x[6], abs=1e-6)
        assert answer.joints["travel"] - 350 == pytest.approx(best.x[7], abs=1e-3)
        assert (np.linalg.inv(world) @ answer.world_from_object)[:3, 3] == pytest.approx(best.x[:3], abs=1e-3)
        jacobian = np.asarray(best.jac, float)
        spread = np.sqrt(np.diag(np.linalg.inv(jacobian.T @ jacobian)))
        assert list(answer.joint_sigmas.values()) == pytest.approx(spread[6:], rel=0.01)
        assert np.sqrt(np.diag(answer.covariance)) == pytest.approx(spread[:6], rel=0.01)
        assert answer.joints["face"] == 0.4  # no sigma: held
    for wrong, said in (
        ({"elbow": 1.0}, "joint 'elbow' is unknown: name one of .*travel"),
        ({"tilt": 0.0}, "give one above zero"),
    ):
        with pytest.raises(InputError, match=said):
            correct_base(rig, found, SIGMA, joint_sigmas=wrong)
    with pytest.raises(InputError, match="not positive"):
        correct_base(rig, found, np.zeros((6, 6)))


def test_where_and_back_on_the_command_line(cranes: str, tmp_path: Path, capsys: Capsys) -> None:
    asked = ["where", "head", "--on", "two", "--world", "w", "--store", cranes]
    assert main([*asked, "--set", "travel=120", "--set", "tilt_deg=10", "--sigma-mm", "3"]) == 0
    said = yaml.safe_load(capsys.readouterr().out)
    pose = links_by_hand(120, np.radians(10), 0)["flange"] @ MOUNT
    assert np.abs(np.array(said["world_from_rig"]) - pose).max() < 1e-9
    assert said["sigma"] == {"translation_mm": 3.0, "rotation_deg": 0.5}

    base = transform((0, 0, 0.01), (4, -2, 1))
    answer = {"world_from_rig": (base @ TRUE["two"]["flange"] @ MOUNT).tolist(), "covariance": SIGMA.tolist()}
    (tmp_path / "found.json").write_text(json.dumps(answer))
    assert main([*asked, "--found", str(tmp_path / "found.json")]) == 0
    said = yaml.safe_load(capsys.readouterr().out)
    assert np.abs(np.array(said["world_from_object"]) - base).max() < 1e-8
    assert said["shift_mm"] == pytest.approx([4, -2, 1])
    assert main([*asked, "--found", str(tmp_path / "found.json"), "--joint-sigma", "tilt_deg=0.5"]) == 0
    said = yaml.safe_load(capsys.readouterr().out)
    assert said["joints"]["tilt"] != -0.3
    assert 0 < said["joint_sigmas"]["tilt"] <= np.radians(0.5)
    assert main([*asked, "--set", "tilt"]) == 2
    assert main([*asked, "--set", "tilt=9"]) == 3
