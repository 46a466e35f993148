"""Placing worlds: expansion against a walk with NumPy, revisions, and refusals."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import sqlalchemy as sa

from relmodel.errors import InputError, UsageError
from relmodel.geometry.transforms import matrices
from relmodel.store import Run, Store
from relmodel.world import place_world
from tests.poses import pose_of
from tests.synthetic_model import BOX, SyntheticModel, write_world


def corners_bounds(transform: np.ndarray, box: np.ndarray) -> np.ndarray:
    """Bounds of the eight corners of a box, carried."""
    corners = np.array([[box[i], box[1 + j], box[2 + k]] for i in (0, 3) for j in (0, 3) for k in (0, 3)])
    carried = corners @ transform[:3, :3].T + transform[:3, 3]
    return np.concatenate([carried.min(axis=0), carried.max(axis=0)])


def count(store: Store, table: str) -> int:
    with store.read() as connection:
        return int(connection.execute(sa.select(sa.func.count()).select_from(sa.table(table))).scalar_one())


def moved(angle: float, x: float) -> np.ndarray:
    return pose_of([x, 20, -30], [0.1, angle, -0.3])


def test_expansion_equals_walk(fresh_store: str, tmp_path: Path) -> None:
    model = SyntheticModel(1)
    first, second = moved(0.4, 100), moved(-1.2, -900)
    objects: list[dict[str, object]] = [
        {"object": "thing", "name": "a", "world_from_object": first.tolist()},
        {"object": "thing", "name": "b", "role": "fixture", "world_from_object": second.tolist()},
    ]
    with Store.open(fresh_store) as store:
        model.fill(store)
        report = place_world(store, write_world(tmp_path / "w.yaml", "cell", objects))
        truth = {p.path: p for p in model.placed("a", first) + model.placed("b", second)}
        assert (report.status, report.revision, report.parts) == ("added", 1, len(truth))
        with store.read() as connection:
            in_world = connection.execute(sa.text("SELECT * FROM occurrence ORDER BY id")).mappings()
            everything = {r["id"]: r for r in in_world}
            rows = [r for r in everything.values() if r["kind"] == "part"]
            pages = connection.execute(sa.select(store.table("object_page"))).mappings().all()
            nodes = connection.execute(sa.select(store.table("object_node")).order_by("node_no")).mappings().all()
    assert {r["path"] for r in rows} == set(truth)
    for row in rows:
        placed = truth[row["path"]]
        transform = matrices({k: row[k] for k in row if str(k).startswith("m")})
        assert np.abs(transform - placed.world_from_part).max() < 1e-9
        carried = np.array([row[name] for name in BOX])
        assert np.abs(carried - corners_bounds(placed.world_from_part, model.shape_boxes[placed.shape])).max() < 1e-9
        parent = everything[row["parent_id"]]
        assert row["path"].rsplit("/", 1)[0] == parent["path"]
    parts = [n for n in nodes if n["part_id"] is not None]
    assert [n["page"] for n in parts] == sorted(n["page"] for n in parts)
    assert 2 * sum(p["box_count"] for p in pages) == 2 * len(parts) == len(truth)
    assert {r["path"] for r in everything.values() if r["parent_id"] is None} == {"a", "b"}


def test_same_content_adds_nothing_and_a_change_is_a_revision(duckdb_file: Path, tmp_path: Path) -> None:
    model = SyntheticModel(2)
    file = write_world(tmp_path / "w.yaml", "cell", [{"object": "thing"}])
    with Store.open(duckdb_file) as store:
        model.fill(store)
        assert place_world(store, file).status == "added"
        before = count(store, "occurrence")
        again = place_world(store, file)
        assert (again.status, again.revision, count(store, "occurrence")) == ("unchanged", 1, before)
        write_world(file, "cell", [{"object": "thing", "role": "fixture"}])
        assert (place_world(store, file).revision, count(store, "occurrence")) == (2, 2 * before)
        SyntheticModel(3).fill(store, revision=2)  # a newer revision of the object: the same file pins it
        third = place_world(store, file)
        assert (third.status, third.revision) == ("added", 3)
        with store.read() as connection:
            pinned = (
                connection.execute(
                    sa.text(
                        "SELECT v.revision FROM world_object AS w "
                        "JOIN object_variant AS v ON v.id = w.object_variant_id ORDER BY w.world_id"
                    )
                )
                .scalars()
                .all()
            )
        assert list(pinned) == [1, 1, 2]


def test_mounts_point_at_rigs(duckdb_file: Path, tmp_path: Path) -> None:
    (tmp_path / "head.yaml").write_text("one")
    file = tmp_path / "w.yaml"
    file.write_text(
        "world: cell\nobjects: [{object: thing, name: a}, {object: thing, name: b}]\n"
        "rigs: [{name: head, file: head.yaml}]\nmounts: [{rig: head, on: b, link: group 1}]\n"
    )

    def write_rig(run: Run, connection: sa.Connection, name: str, path: Path) -> int:
        rig_id = run.store.new_ids(connection, "rig", 1)
        run.append(connection, "rig", {"id": rig_id, "content_key": [path.read_text()]})
        return int(rig_id[0])

    with Store.open(duckdb_file) as store:
        SyntheticModel(6).fill(store)
        with pytest.raises(UsageError, match="mounts rigs"):
            place_world(store, file)
        assert place_world(store, file, write_rig=write_rig).status == "added"
        mount = store.table("world_mount")
        with store.read() as connection:
            row = connection.execute(sa.select(mount)).mappings().one()
        assert (row["name"], row["object_no"], row["link"], row["m00"]) == ("head", 2, "group 1", 1.0)
        (tmp_path / "head.yaml").write_text("two")  # the rig changed, so the world did
        assert place_world(store, file, write_rig=write_rig).revision == 2


def test_unknown_objects_and_objects_without_parts(duckdb_file: Path, tmp_path: Path) -> None:
    model = SyntheticModel(5)
    model.root.children = []
    with Store.open(duckdb_file) as store:
        model.fill(store, variant="b")
        with pytest.raises(InputError, match=r"thing is not loaded.*thing \(variant b\)"):
            place_world(store, write_world(tmp_path / "w.yaml", "cell", [{"object": "thing"}]))
        assert count(store, "world") == 0
        objects: list[dict[str, object]] = [{"object": "thing", "variant": "b"}]
        report = place_world(store, write_world(tmp_path / "w.yaml", "cell", objects))
        assert (report.objects, report.parts, count(store, "object_page")) == (1, 0, 0)
