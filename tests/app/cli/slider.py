"""The demonstration's world with its pair's rig on a carriage that slides."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt
import yaml
from scipy.spatial.transform import Rotation

from relmodel.resources import resource_dir

Array = npt.NDArray[np.float64]

URDF = """<robot name="slider">
<link name="rail"><visual><geometry><box size="0.6 0.1 0.1"/></geometry></visual></link>
<link name="carriage"><visual><geometry><box size="0.1 0.1 0.1"/></geometry></visual></link>
<joint name="travel" type="prismatic"><parent link="rail"/><child link="carriage"/>
  <origin xyz="0 0 0.2" rpy="0.1 -0.2 0.4"/><axis xyz="1 0 0"/><limit lower="-0.5" upper="0.5"/></joint>
</robot>"""
TRAVEL = 120.0
BASE: Array = np.array([[0.0, -1, 0, 800], [1, 0, 0, -2500], [0, 0, 1, 300], [0, 0, 0, 1]])  # behind the cameras


def carriage(travel: float) -> Array:
    """`base_from_carriage` (4, 4) at a travel, mm."""
    joint, along = np.eye(4), np.eye(4)
    joint[:3, :3], joint[2, 3] = Rotation.from_euler("xyz", [0.1, -0.2, 0.4]).as_matrix(), 200
    along[0, 3] = travel
    return np.asarray(joint @ along)


def carriage_from_rig(world_from_rig: npt.ArrayLike) -> Array:
    """The mount, by which the rig is where it should be."""
    return np.asarray(np.linalg.inv(BASE @ carriage(TRAVEL)) @ np.asarray(world_from_rig))


def write_world(folder: Path, rig: Path, world_from_rig: npt.ArrayLike, *carriers: str) -> tuple[Path, Path]:
    """A URDF file and a world file: the demonstration's with a slider of each name, which has the rig at that pose."""
    (folder / "slider.urdf").write_text(URDF)
    (folder / "rig.yaml").write_text(rig.read_text())
    world = yaml.safe_load((resource_dir("demo") / "world.yaml").read_text())
    for name in carriers:
        placed = {"object": "slider", "name": name, "role": "robot", "joints": {"travel": TRAVEL}}
        world["objects"].append(placed | {"world_from_object": BASE.tolist()})
    mount = {"rig": "head", "link": "carriage", "carrier_from_rig": carriage_from_rig(world_from_rig).tolist()}
    world["rigs"] = [{"name": "head", "file": "rig.yaml"}]
    world["mounts"] = [{**mount, "on": name} for name in carriers]
    (folder / "world.yaml").write_text(yaml.safe_dump(world))
    return folder / "slider.urdf", folder / "world.yaml"
