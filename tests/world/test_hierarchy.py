"""Objects nested in objects: to any depth, never in themselves, geometry never copied, robots among them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import sqlalchemy as sa
import yaml

from relmodel.errors import InputError
from relmodel.find.find import in_volume
from relmodel.find.volumes import Box
from relmodel.geometry.transforms import MATRIX_COLUMNS, inverse, matrix_columns, rotation_matrix
from relmodel.loading.write import append_expansion
from relmodel.store import Store, sql
from relmodel.world import place_world
from relmodel.world.kinematics import correct_base, mounted_rig
from tests.reading import load
from tests.synthetic_model import SyntheticModel, write_world
from tests.world.test_kinematics import MOUNT, RIG, URDF, links_by_hand, transform


def assemblies(store: Store, count: int, tag: str = "chain") -> npt.NDArray[np.int64]:
    """Empty objects."""
    with store.write() as connection:
        ids = store.new_ids(connection, "object", count)
        names = [f"{tag} {i}" for i in range(count)]
        store.append(connection, "object", {"id": ids, "content_key": names, "name": names, "kind": "assembly"})
    return ids


def nest(store: Store, parents: Any, children: Any, poses: Any, *, child_no: Any = 0, name: str = "o") -> None:
    with store.write() as connection:
        store.append(
            connection,
            "object_object",
            {"parent_id": parents, "child_no": child_no, "child_id": children, "name": name, **matrix_columns(poses)},
        )


def loaded_as(store: Store, object_id: int, name: str, variant: str = "") -> None:
    with store.write() as connection:
        source = int(connection.execute(sa.text("SELECT min(id) FROM source")).scalar_one())
        columns: dict[str, Any] = {"name": name, "variant": variant, "object_id": object_id, "source_id": source}
        columns["revision"] = 1
        store.append(connection, "object_variant", {"id": store.new_ids(connection, "object_variant", 1), **columns})
        append_expansion(store, connection, object_id)


def counts(store: Store) -> dict[str, int]:
    tables = ("object", "object_object", "object_part", "part", "shape", "surface", "arc", "feature")
    with store.read() as connection:
        return {t: len(connection.execute(sa.select(store.table(t).c[0])).all()) for t in tables}


def offending(store: Store, *checks: str) -> list[dict[str, Any]]:
    """What the checks whose names begin so find."""
    names = [name for name in sql.query_names("check") if name.startswith(tuple(f"check/{name}" for name in checks))]
    with store.read() as connection:
        return [dict(row._mapping) for name in names for row in store.rows(connection, name)]


def test_dozens_of_objects_deep(duckdb_file: Path, tmp_path: Path) -> None:
    depth, rng = 50, np.random.default_rng(0)
    poses = np.tile(np.eye(4), (depth, 1, 1))
    poses[:, :3, :3] = rotation_matrix(rng.uniform(-1, 1, (depth, 3)))
    poses[:, :3, 3] = rng.uniform(-5, 5, (depth, 3))
    with Store.open(duckdb_file) as store:
        SyntheticModel(1).fill(store)
        ids = assemblies(store, depth)
        nest(store, ids[:-1], ids[1:], poses[:-1])
        with store.write() as connection:
            part = int(connection.execute(sa.text("SELECT min(id) FROM part")).scalar_one())
            row: dict[str, Any] = {"object_id": [int(ids[-1])], "child_no": 0, "part_id": part, "name": "p"}
            store.append(connection, "object_part", {**row, **matrix_columns(poses[-1])})
        loaded_as(store, int(ids[0]), "deep")
        before = counts(store)
        report = place_world(store, write_world(tmp_path / "w.yaml", "cell", [{"object": "deep"}]))
        assert (report.objects, report.parts) == (depth, 1)
        assert counts(store) == before
        with store.read() as connection:
            placed = sa.text("SELECT * FROM occurrence WHERE kind = 'part'")
            found = connection.execute(placed).mappings().one()
        truth = np.eye(4)
        for pose in poses:
            truth = truth @ pose
        assert found["path"] == "/".join(["deep", *["o"] * (depth - 1), "p"])
        assert np.abs(np.array([found[c] for c in MATRIX_COLUMNS]).reshape(3, 4) - truth[:3]).max() < 1e-9
        x, y, z = truth[:3, 3].tolist()
        assert in_volume(store, Box(x, y, z, x, y, z))["occurrence_id"].tolist() == [found["id"]]
        assert not offending(store, "object_node", "object_page", "placed_body", "nesting_cycle", "world_link")


def test_cycles_are_refused_and_variants_may_nest(duckdb_file: Path, tmp_path: Path) -> None:
    file = tmp_path / "w.yaml"
    with Store.open(duckdb_file) as store:
        SyntheticModel(2).fill(store)
        a, b, c, d = assemblies(store, 4).tolist()
        with pytest.raises(Exception, match=r"(?i)\bcheck\b"):  # an object directly in itself: the table refuses it
            nest(store, [a], [a], np.eye(4))
        nest(store, [a], [b], np.eye(4))
        loaded_as(store, a, "gear")
        nest(store, [d], [a], np.eye(4))  # variant d of gear holds the plain one, which is another object
        loaded_as(store, d, "gear", "d")
        before = counts(store)
        write_world(file, "cell", [{"object": "gear"}, {"object": "gear", "variant": "d", "name": "d"}])
        assert place_world(store, file).objects == 5
        for parents, children in (([b], [a]), ([b, c], [c, a])):  # through one object, through two
            nest(store, parents, children, np.tile(np.eye(4), (len(parents), 1, 1)), child_no=7, name="back")
            for variant in ({}, {"variant": "d"}):  # itself in the ring, or only above it
                write_world(file, "other", [{"object": "gear", **variant}])
                with pytest.raises(InputError, match=r"chain \d contains itself"):
                    place_world(store, file)
            assert {r["object_id"] for r in offending(store, "nesting_cycle")} & {a, b, c}
            with store.write() as connection:
                connection.execute(store.table("object_object").delete().where(sa.column("name") == "back"))
        assert counts(store) == before
        with store.read() as connection:
            assert connection.scalar(sa.text("SELECT count(*) FROM world")) == 1


CART_FROM_CRANE = transform((0, 0, np.pi / 2), (100, -50, 30))
BAY_FROM_CART = transform((0.2, 0, 0), (0, 700, 0))
WORLD_FROM_BAY = transform((0, 0.3, 0), (10, 20, 30))
FLANGE_FROM_TOOL = transform((0.4, 0, 0), (0, 0, 40))


def bay(store: Store, folder: Path, joints: dict[str, float]) -> Path:
    """A world of one object: a cart in it bears a crane, whose flange bears another crane, and that the rig."""
    (folder / "crane.urdf").write_text(URDF)
    (folder / "head.yaml").write_text(yaml.safe_dump(RIG))
    with store.read() as connection:
        known = connection.scalar(sa.text("SELECT count(*) FROM object_variant"))
    if not known:
        load(store, folder / "crane.urdf", name="crane")
        # Equal links are one object, so the flange that bears the tool must be none of the tool's.
        text = URDF.replace('"crane"', '"tool"').replace("0.1 0 0.2", "0.3 0 0.2").replace("flange", "grip")
        (folder / "tool.urdf").write_text(text)
        load(store, folder / "tool.urdf", name="tool")
        with store.read() as connection:
            find = sa.text("SELECT object_id FROM object_variant WHERE name = :name")
            crane, tool = (int(connection.scalar(find, {"name": n})) for n in ("crane", "tool"))
            row = sa.text("SELECT child_id FROM object_object WHERE parent_id = :id AND name = 'flange'")
            flange = int(connection.scalar(row, {"id": crane}))
        outer, cart = assemblies(store, 2, "bay").tolist()
        nest(store, [outer], [cart], BAY_FROM_CART, name="cart")
        nest(store, [cart], [crane], CART_FROM_CRANE, name="left/arm")
        nest(store, [flange], [tool], FLANGE_FROM_TOOL, child_no=50, name="tool")
        loaded_as(store, outer, "bay")
    placed = {"object": "bay", "world_from_object": WORLD_FROM_BAY.tolist(), "joints": joints}
    mount = {"rig": "head", "on": "bay", "link": "cart/left_arm/flange/tool/boom", "carrier_from_rig": MOUNT}
    rigs = [{"name": "head", "file": "head.yaml"}]
    (folder / "w.yaml").write_text(yaml.safe_dump({"world": "w", "objects": [placed], "rigs": rigs, "mounts": [mount]}))
    return folder / "w.yaml"


def test_nested_robots_take_their_joints(duckdb_file: Path, tmp_path: Path) -> None:
    from vision.cameras.files import read_rig
    from vision.cameras.record import record_rig

    arm, tool = "cart/left_arm", "cart/left_arm/flange/tool"
    joints = {f"{arm}/travel": 200.0, f"{arm}/tilt_deg": 20.0, f"{arm}/face": 0.7, f"{tool}/tilt": -0.5}
    with Store.open(duckdb_file) as store:
        file = bay(store, tmp_path, joints)
        place_world(store, file, write_rig=lambda r, c, _, path: record_rig(r, c, read_rig(path)))
        first = links_by_hand(200, np.radians(20), 0.7)
        boom = transform((0.3, 0, 0.2), (0, 0, 1000)) @ transform((0, -0.5, 0))
        world_from_arm = WORLD_FROM_BAY @ BAY_FROM_CART @ CART_FROM_CRANE
        world_from_tool = world_from_arm @ first["flange"] @ FLANGE_FROM_TOOL
        truth = {f"bay/{arm}/{link}": world_from_arm @ pose for link, pose in first.items()}
        truth |= {f"bay/{tool}": world_from_tool, f"bay/{tool}/boom": world_from_tool @ boom}
        with store.read() as connection:
            rows = connection.execute(sa.text("SELECT * FROM occurrence")).mappings().all()
        at = {r["path"]: np.array([r[c] for c in MATRIX_COLUMNS]).reshape(3, 4) for r in rows}
        for path, pose in truth.items():
            assert np.abs(at[path] - pose[:3]).max() < 1e-9, path
        assert not offending(store, "object_node", "object_page", "placed_body", "nesting_cycle", "world_link")

        rig = mounted_rig(store, "head")
        assert np.abs(rig.world_from_rig - world_from_tool @ boom @ np.array(MOUNT)).max() < 1e-9
        swung = rig.moved({"tilt": 0.25})
        boom = transform((0.3, 0, 0.2), (0, 0, 1000)) @ transform((0, 0.25, 0))
        assert np.abs(swung.world_from_rig - world_from_tool @ boom @ np.array(MOUNT)).max() < 1e-9
        shift = transform((0.01, 0, 0.02), (3, -2, 1))  # the base of the nested robot is elsewhere: found so
        found = world_from_tool @ shift @ inverse(world_from_tool) @ rig.world_from_rig
        correction = correct_base(rig, found, np.eye(6) * 1e-4)
        assert np.abs(correction.world_from_object - world_from_tool @ shift).max() < 1e-6

        with pytest.raises(InputError, match="names no robot in it: write ROBOT/travel with one of: cart/left_arm"):
            place_world(store, bay(store, tmp_path, {"travel": 1.0}), write_rig=lambda *_: 0)
        with pytest.raises(InputError, match=r"of cart/left_arm: joint 'tilt' at .* outside its limits"):
            place_world(store, bay(store, tmp_path, {f"{arm}/tilt": 2.0}), write_rig=lambda *_: 0)
        with store.write() as connection:  # a joint moves and its links do not
            state = store.table("joint_state")
            connection.execute(state.delete().where(state.c.robot == tool, state.c.joint == "tilt"))
        assert [row["robot"] for row in offending(store, "world_link")] == [f"bay/{tool}"] * 2
