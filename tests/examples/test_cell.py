"""The cell of figure 1: it loads with one command, and its arms look at the bulkhead."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from examples.cell.__main__ import HERE, load_cell
from relmodel.find.find import in_volume
from relmodel.find.volumes import Frustum
from relmodel.store import Store
from relmodel.store.check import check
from relmodel.world.kinematics import mounted_rig
from tests.app.cli.conftest import loaded
from vision.cameras.files import read_rig

__all__ = ["loaded"]  # a fixture


@pytest.mark.usefixtures("reads_here")
def test_the_cell_loads_and_its_arms_see_the_bulkhead(loaded: Path, tmp_path: Path) -> None:
    """Into a store that has the bulkhead already, which is not loaded again."""
    pytest.importorskip("OCP")
    target = str(shutil.copy(loaded, tmp_path / "cell.duckdb"))
    assert load_cell(target) == 0
    cameras = read_rig(HERE / "stereo_head.yaml")
    with Store.open(target, read_only=True) as store:
        assert not [row for result in check(store) for row in result.rows]
        for arm, side in (("left_arm", 1.0), ("right_arm", -1.0)):
            rig = mounted_rig(store, "head", on=arm)
            # Upright cameras on either side of the bulkhead, looking across the table.
            assert side * rig.world_from_rig[1, 2] > 0.9
            assert rig.world_from_rig[2, 1] < -0.9
            assert side * rig.world_from_rig[1, 3] < -500
            for name, camera in cameras.cameras.items():
                pose = rig.world_from_rig @ cameras.rig_from_camera[name]
                view = Frustum(camera.width, camera.height, camera.matrix, pose, 10.0, 1500.0)
                seen = in_volume(store, view, level="part")
                assert "bulkhead/BODY" in seen["path"]
                assert not [path for path in seen["path"] if path.startswith(arm)]
                assert len(in_volume(store, view, level="feature")["path"]) > 20
        # The flange by hand: rail, carriage and turret are upright; the rest turns about y in the arm's plane.
        rig = mounted_rig(store, "head", on="left_arm")
    base, pitch = np.radians(80), np.radians([5, 10, -5])
    along, up = 0.0, 240 + 120 + 420.0
    for turn, reach in zip(np.cumsum(pitch), ((0, 700), (390 + 250, 0), (140, 0)), strict=True):
        along += reach[0] * np.cos(turn) + reach[1] * np.sin(turn)
        up += -reach[0] * np.sin(turn) + reach[1] * np.cos(turn)
    flange = np.array([350 + along * np.cos(base), -1800 + along * np.sin(base), up])
    assert (rig.world_from_object @ rig.object_from_link)[:3, 3] == pytest.approx(flange, abs=1e-6)
