"""Objects mounted on links of others: chains of NumPy products against the rows, the views and the kinematics."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import sqlalchemy as sa
import yaml

from relmodel.errors import InputError
from relmodel.geometry.transforms import MATRIX_COLUMNS
from relmodel.store import Store
from relmodel.world import place_world
from relmodel.world.kinematics import correct_base, mounted_rig
from relmodel.world.placement import WorldReport
from tests.given import CopyStore, NewStore
from tests.reading import load
from tests.store.amiss import flaws
from tests.world.test_kinematics import MOUNT, RIG, URDF, WORLD_FROM, links_by_hand, transform

Array = npt.NDArray[np.float64]

TOOL = """<robot name="tool"><link name="body"><inertial><mass value="1.5"/></inertial>
<visual><origin xyz="0 0 0.1"/><geometry><box size="0.1 0.1 0.2"/></geometry></visual></link></robot>"""
FLANGE_FROM_SECOND = transform((0.3, 0, 0.1), (10, 20, 30))
BOOM_FROM_TOOL = transform((0, 0.2, 0), (100, 0, 50))
BODY_FROM_RIG = np.array(MOUNT, float)
JOINTS = {"travel": 350.0, "tilt_deg": 30.0, "face": 0.4}


def cell(folder: Path, second: dict[str, float] | None = None, **joints: float) -> Path:
    """A crane in the world, a second at its flange, at the boom of that a tool, and at the tool's body the rig."""
    (folder / "crane.urdf").write_text(URDF)
    (folder / "tool.urdf").write_text(TOOL)
    (folder / "head.yaml").write_text(yaml.safe_dump(RIG))
    first = {"object": "crane", "name": "first", "role": "robot", "world_from_object": WORLD_FROM["one"].tolist()}
    objects: list[dict[str, Any]] = [
        {"object": "tool", "role": "tool"},
        {"object": "crane", "name": "second", "role": "robot", "joints": second or {"tilt": -0.3}},
        {**first, "joints": {**JOINTS, **joints}},
    ]
    mounts: list[dict[str, Any]] = [
        {"object": "tool", "on": "second", "link": "boom", "carrier_from_object": BOOM_FROM_TOOL.tolist()},
        {"rig": "head", "on": "tool", "link": "body", "carrier_from_rig": MOUNT},
        {"object": "second", "on": "first", "link": "flange", "carrier_from_object": FLANGE_FROM_SECOND.tolist()},
    ]
    file = {"world": "w", "objects": objects, "rigs": [{"name": "head", "file": "head.yaml"}], "mounts": mounts}
    (folder / "cell.yaml").write_text(yaml.safe_dump(file))
    return folder / "cell.yaml"


def placed(store: Store, file: Path) -> WorldReport:
    from vision.cameras.files import read_rig
    from vision.cameras.record import record_rig

    return place_world(store, file, write_rig=lambda run, c, _, path: record_rig(run, c, read_rig(path)))


def by_hand(travel: float, second_tilt: float) -> dict[str, Array]:
    """World poses of what is mounted."""
    flange = WORLD_FROM["one"] @ links_by_hand(travel, np.radians(30), 0.4)["flange"]
    second = flange @ FLANGE_FROM_SECOND
    tool = second @ links_by_hand(0, second_tilt, 0)["boom"] @ BOOM_FROM_TOOL
    return {"second": second, "tool": tool, "head": tool @ BODY_FROM_RIG}


def poses(store: Store, query: str) -> dict[str, Array]:
    with store.read() as connection:
        rows = connection.execute(sa.text(query)).mappings().all()
    assert rows
    return {r["name"]: np.array([r[c] for c in MATRIX_COLUMNS]).reshape(3, 4) for r in rows}


PLACED = "SELECT o.path AS name, o.* FROM occurrence AS o JOIN current_world AS w ON w.world_id = o.world_id"
MOUNTED = "SELECT m.* FROM placed_mount AS m JOIN current_world AS w ON w.world_id = m.world_id"


@pytest.fixture(scope="module")
def loaded(new_store: NewStore, tmp_path_factory: pytest.TempPathFactory) -> str:
    """A store with both objects, placed nowhere."""
    target, file = new_store("duckdb"), cell(tmp_path_factory.mktemp("loaded"))
    with Store.open(target) as store:
        for name in ("crane", "tool"):
            load(store, file.with_name(f"{name}.urdf"), name=name)
    return target


def test_mounted_objects_go_where_their_links_go(loaded: str, copy_store: CopyStore, tmp_path: Path) -> None:
    with Store.open(copy_store(loaded)) as store:
        file = cell(tmp_path)
        for travel, tilt in ((350.0, -0.3), (-200.0, 0.6)):
            assert placed(store, cell(tmp_path, {"tilt": tilt}, travel=travel)).status == "added"
            truth = by_hand(travel, tilt)
            occurrences, mounts = poses(store, PLACED), poses(store, MOUNTED)
            assert set(mounts) == set(truth)
            for name, pose in truth.items():
                assert np.abs(mounts[name] - pose[:3]).max() < 1e-9, name
            for name in ("second", "tool"):
                assert np.abs(occurrences[name] - truth[name][:3]).max() < 1e-9, name
            box = truth["tool"] @ transform(xyz=(0, 0, 100))
            assert np.abs(occurrences["tool/body/body"] - box[:3]).max() < 1e-9
            assert np.abs(mounted_rig(store, "head").world_from_rig - truth["head"]).max() < 1e-9
        assert not flaws(store, "world_", "object_", "placed_body")  # of all revisions
        assert placed(store, file).status == "unchanged"

        # The tool has no joints: the rig on it moves with those of the crane that carries it, and corrects its base.
        rig = mounted_rig(store, "head", on="tool")
        assert rig.carrier == "second"
        assert np.abs(rig.moved({"tilt": 0.1}).world_from_rig - by_hand(-200, 0.1)["head"]).max() < 1e-9
        shift = transform((0.01, 0, 0.02), (3, -2, 1))
        found = truth["second"] @ shift @ np.linalg.inv(truth["second"]) @ truth["head"]
        correction = correct_base(rig, found, np.eye(6) * 1e-4)
        assert np.abs(correction.world_from_object - truth["second"] @ shift).max() < 1e-6

        with store.write() as connection:  # a mount changes and what it carries does not
            mount = store.table("world_mount")
            here = sa.and_(mount.c.last_revision.is_(None), mount.c.name == "tool")
            connection.execute(mount.update().where(here).values(m03=0.0))
        with store.read() as connection:
            bad = {row.name for row in store.rows(connection, "check/world_mount")}
        assert bad == {"tool"}  # in each revision that has the mount


def test_circles_and_second_places_are_refused(loaded: str, copy_store: CopyStore, tmp_path: Path) -> None:
    file = cell(tmp_path)
    with Store.open(copy_store(loaded)) as store:
        said = yaml.safe_load(file.read_text())
        on_tool = {"object": "first", "on": "tool"}
        del said["objects"][2]["world_from_object"]
        file.write_text(yaml.safe_dump(said | {"mounts": [*said["mounts"], on_tool]}))
        with pytest.raises(InputError, match="form a cycle, tool on second on first on tool: place one"):
            placed(store, file)
        cell(tmp_path)
        file.write_text(file.read_text().replace("link: boom", "link: beam"))
        with pytest.raises(InputError, match="names the link 'beam', which 'second' has 0 times: name one of rail"):
            placed(store, file)
        with store.read() as connection:
            assert connection.scalar(sa.text("SELECT count(*) FROM world")) == 0
