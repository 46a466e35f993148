"""From pictures to the arm's base: each demonstration pair of variant A is taken as seen by the head of an arm whose
base is not quite where the world says, inspected with the prior that the arm's kinematics give, and the base
corrected with the joints held.  Prints how far the base was off, and what is left after the correction.
"""

from __future__ import annotations

import json
import tempfile
from pathlib import Path

import numpy as np
import numpy.typing as npt
import yaml
from tabulate import tabulate

from relmodel.geometry.transforms import inverse, rotation_vector
from relmodel.loading.load import load
from relmodel.store import Store
from relmodel.world import place_world
from relmodel.world.kinematics import mounted_rig
from vision.cameras.files import read_pose, read_rig
from vision.cameras.record_cameras import record_rig
from vision.inspection import Task, inspect

Array = npt.NDArray[np.float64]

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"
DEMO = EXAMPLES / "demo"
JOINTS = {"travel": 200, "base_deg": 60, "shoulder_deg": 10, "elbow_deg": 5, "wrist_pitch_deg": -30}


def cell(folder: Path, pair: str, mount: Array) -> Path:
    """The demonstration's world with an arm in it that carries the pair's rig."""
    world = yaml.safe_load((DEMO / "world.yaml").read_text())
    base = np.eye(4)
    base[:3, 3] = [-1500, -2500, 0]
    world["objects"].append(
        {"object": "arm", "role": "robot", "world_from_object": base.tolist(), "joints": dict(JOINTS)}
    )
    world["rigs"] = [{"name": "head", "file": "rig.yaml"}]
    world["mounts"] = [{"rig": "head", "on": "arm", "link": "flange", "carrier_from_rig": mount.tolist()}]
    (folder / "rig.yaml").write_text((DEMO / f"{pair}_rig.yaml").read_text())
    (folder / "world.yaml").write_text(yaml.safe_dump(world))
    return folder / "world.yaml"


def main() -> None:
    rows = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        with Store.create(folder / "store.duckdb") as store:
            load(store, DEMO / "bulkhead_A.step.gz", name="bulkhead", variant="A")
            load(store, EXAMPLES / "cell" / "arm.urdf", name="arm")
            for truth_file in sorted(DEMO.glob("*_truth.json")):
                truth = json.loads(truth_file.read_text())
                if truth["variant"] == "A":
                    rows.append(_pair(store, folder, truth_file.name.removesuffix("_truth.json"), truth))
    print(
        tabulate(
            rows, headers=("pair", "verdict", "base off mm", "deg", "left mm", "deg", "1 sigma mm"), floatfmt=".3f"
        )
    )


def _pair(store: Store, folder: Path, pair: str, truth: dict[str, object]) -> list[object]:
    prior, true = read_pose(DEMO / f"{pair}_prior.yaml"), np.array(truth["world_from_rig"])
    mount = np.eye(4)
    for _ in range(2):  # the mount is whatever makes the arm's kinematics give the pair's prior
        place_world(
            store, cell(folder, pair, mount), write_rig=lambda run, at, _, path: record_rig(run, at, read_rig(path))
        )
        rig = mounted_rig(store, "head")
        mount = inverse(rig.world_from_object @ rig.object_from_link) @ prior
    sigma = yaml.safe_load((DEMO / f"{pair}_prior.yaml").read_text())["sigma"]
    (folder / "prior.yaml").write_text(yaml.safe_dump({"world_from_rig": rig.world_from_rig.tolist(), "sigma": sigma}))
    answer = inspect(
        store,
        Task(
            rig=folder / "rig.yaml",
            pictures={name: DEMO / f"{pair}_{name}.png" for name in ("left", "right")},
            prior=folder / "prior.yaml",
        ),
    )
    true_base = true @ inverse(rig.object_from_link @ rig.link_from_rig)
    before = _off(true_base, rig.world_from_object)
    correction = answer.base_correction
    if correction is None:
        return [pair, answer.verdict, *before]
    spread = float(np.sqrt(np.trace(correction.covariance[:3, :3])))
    return [pair, answer.verdict, *before, *_off(true_base, correction.world_from_object), spread]


def _off(a: Array, b: Array) -> tuple[float, float]:
    """Distance of two poses, mm and degrees."""
    d = inverse(a) @ b
    return float(np.linalg.norm(d[:3, 3])), float(np.degrees(np.linalg.norm(rotation_vector(d[:3, :3]))))


if __name__ == "__main__":
    main()
