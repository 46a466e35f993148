"""Contacts of placed parts against closed forms, and those of a file's nuts, bolts, brackets and plate."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from relmodel.loading import contacts, step_shape
from relmodel.loading.load import load
from relmodel.loading.neutral import Assembly, Instance, LoadedModel, Part, Table
from relmodel.store import Store

from .test_congruence import motion, random_motions
from .test_features import box, cut, cylinder

Floats = npt.NDArray[np.float64]
pytest.importorskip("OCP")
PI = np.pi


def model_of(solids: dict[str, Any], assemblies: list[Assembly]) -> LoadedModel:
    shapes = [step_shape.extract(solid, {}, {}, {}) for solid in solids.values()]
    parts = [Part(name, name, i) for i, name in enumerate(solids)]
    return LoadedModel("STEP", None, "millimetre", 1.0, shapes, parts, assemblies, len(assemblies) - 1, None, 0, "test")


def at(x: float, y: float, z: float) -> Floats:
    return motion((0, 0, 1), 0.0, (x, y, z))


def rows(table: Table) -> list[tuple[str, str, str]]:
    return list(zip(table["path_a"], table["path_b"], table["kind"], strict=True)) if table else []


def turned(instances: list[Instance], pose: Floats) -> list[Instance]:
    return [Instance(i.name, i.kind, i.child, pose @ i.parent_from_child) for i in instances]


@pytest.mark.parametrize("pose", [np.eye(4), *random_motions(2, 11)])
def test_stacked_boxes_touch_where_they_overlap(pose: Floats) -> None:
    """A tower of three, each shifted; one beside it at a hundredth of a millimetre, one a tenth away."""
    placed = [at(0, 0, 0), at(10, 5, 8), at(15, 5, 16), at(20.009, 0, 0), at(-20.1, 0, 0)]
    instances = [Instance(f"box {i}", "part", 0, p) for i, p in enumerate(placed)]
    model = model_of({"box": box(0, 0, 0, (20.0, 12.0, 8.0))}, [Assembly("tower", turned(instances, pose))])
    found = contacts.contacts(model, 0)
    assert rows(found) == [
        ("box 0", "box 1", "planar"),
        ("box 0", "box 3", "planar"),
        ("box 1", "box 2", "planar"),
        ("box 1", "box 3", "planar"),
    ]
    assert found["area"] == pytest.approx([10 * 7, 12 * 8, 15 * 12, (30 - 20.009) * 7], rel=1e-9)
    assert found["gap"] == pytest.approx([0, 0.009, 0, 0], abs=1e-9)
    assert set(found["tolerance"]) == {contacts.TOUCH_MM}


@pytest.mark.parametrize("pose", [np.eye(4), *random_motions(1, 5)])
@pytest.mark.parametrize("clearance", [0.0, 0.4, -0.02])
def test_a_bolt_in_a_hole(pose: Floats, clearance: float) -> None:
    """Its shank in the bore of a plate with a nut behind: rings under head and nut, jackets within."""
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Fuse

    r, bore = 4.0, 4.0 + clearance
    solids = {
        "plate": cut(box(-20, -20, 0, (40.0, 40.0, 10.0)), cylinder(0, 0, -1, bore, 12)),
        "bolt": BRepAlgoAPI_Fuse(cylinder(0, 0, 10, 7, 5), cylinder(0, 0, -9, r, 19)).Shape(),
        "nut": cut(box(-6, -6, -6, (12.0, 12.0, 6.0)), cylinder(0, 0, -7, r, 8)),
    }
    instances = [Instance(name, "part", i, motion((0, 0, 1), i * 0.4, (0, 0, 0))) for i, name in enumerate(solids)]
    model = model_of(solids, [Assembly("joint", turned(instances, pose))])
    found = contacts.contacts(model, 0)
    expected = {
        ("plate", "bolt", "planar"): (0.0, PI * (49 - max(r, bore) ** 2)),
        ("plate", "bolt", "cylindrical"): (clearance, 2 * PI * r * 10),
        ("plate", "nut", "planar"): (0.0, 144 - PI * max(r, bore) ** 2),
        ("bolt", "nut", "cylindrical"): (0.0, 2 * PI * r * 6),
    }
    assert sorted(rows(found)) == sorted(expected)
    for row, gap, area in zip(rows(found), found["gap"], found["area"], strict=True):
        assert gap == pytest.approx(expected[row][0], abs=1e-9)
        assert area == pytest.approx(expected[row][1], rel=1e-4)


def test_what_does_not_touch_is_no_contact() -> None:
    """Faces that look the same way, a shaft beside its hole, a shaft that is much too thin, pipes in a row."""
    solids = {
        "block": cut(box(0, 0, 0, (40.0, 40.0, 10.0)), cylinder(20, 20, -1, 8, 20)),
        "pin": cylinder(0, 0, 2, 6, 4),
        "shaft": cylinder(0, 0, 2, 7.9, 4),
        "tube": cut(cylinder(0, 0, 0, 8, 10), cylinder(0, 0, -1, 5, 12)),
    }
    placed = [(0, at(0, 0, 0)), (1, at(20, 20, 0)), (2, at(20.05, 20, 0)), (0, at(60, 0, 0)), (3, at(80, 20, 20))]
    instances = [Instance("", "part", child, pose) for child, pose in placed]
    assert rows(contacts.contacts(model_of(solids, [Assembly("apart", instances)]), 0)) == []


def test_a_sub_assembly_keeps_its_own_contacts_and_paths_are_those_of_the_store(
    fresh_store: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two of one pair of cubes, on a long bar: what touches within the pair is said once."""
    from relmodel.loading import load as module

    pair = Assembly("pair", [Instance("cube", "part", 0, at(0, 0, 0)), Instance("cube", "part", 0, at(10, 0, 0))])
    bar = Instance("b/ar", "part", 1, at(0, 0, -5))
    pairs = [Instance("pair", "assembly", 0, at(x, 0, 0)) for x in (0, 50)]
    solids = {"cube": box(0, 0, 0, (10.0, 10.0, 10.0)), "bar": box(0, 0, 0, (100.0, 10.0, 5.0))}
    model = model_of(solids, [pair, Assembly("all", [bar, *pairs])])
    monkeypatch.setattr(module, "read_step", lambda *_, **__: model)
    (tmp_path / "all.step").write_text("ISO-10303-21;")
    with Store.open(fresh_store) as store:
        root = load(store, tmp_path / "all.step", name="all").object_id
        with store.read() as connection:
            stored = connection.execute(store.table("part_contact").select()).all()
            paths = {row.path for row in store.rows(connection, "object_expansion", object_id=root)}
    inner, outer = [r for r in stored if r.object_id != root], [r for r in stored if r.object_id == root]
    assert [(r.path_a, r.path_b, r.area) for r in inner] == [("cube#0", "cube#1", pytest.approx(100))]
    assert sorted((r.path_a, r.path_b) for r in outer) == [
        ("b_ar", f"pair#{i}/cube#{k}") for i in (1, 2) for k in (0, 1)
    ]
    assert {r.path_a for r in outer} | {r.path_b for r in outer} <= paths


@pytest.mark.data
def test_the_screwed_joints_of_a_file(data_dir: Path) -> None:
    """Brackets on a plate, each with three bolts and nuts, and a rod with nuts; cylinders are two halves there."""
    from relmodel.loading.step import read_step

    model = read_step(data_dir / "step" / "as1-tu-203.stp")
    total: dict[tuple[str, str, str], float] = {}
    for i in range(len(model.assemblies)):
        found = contacts.contacts(model, i)
        for a, b, kind, area, gap in zip(*(found[c] for c in ("path_a", "path_b", "kind", "area", "gap")), strict=True):
            assert gap == pytest.approx(0, abs=1e-6)
            ends = sorted(path.rsplit("/", 1)[-1].split("::")[0] for path in (a, b))
            key = (ends[0], ends[1], kind)
            total[key] = total.get(key, 0.0) + area
    jacket = 2 * PI * 5  # of a bolt and of the rod, 10 mm thick, an mm long
    hexagon = total[("NUT", "PLATE", "planar")] / 6 + PI * 25  # a nut's face with its bore
    assert total == pytest.approx(
        {
            ("NUT", "ROD", "cylindrical"): 2 * jacket * 3,
            ("BOLT", "NUT", "cylindrical"): jacket * 3,
            ("BOLT", "L-BRACKET", "cylindrical"): 3 * jacket * 10,
            ("BOLT", "L-BRACKET", "planar"): 3 * (PI * 7.5**2 - PI * 25),
            ("L-BRACKET", "NUT", "planar"): 2 * (hexagon - PI * 25),
            ("L-BRACKET", "ROD", "cylindrical"): 2 * jacket * 10,
            ("BOLT", "PLATE", "cylindrical"): 6 * jacket * 20,
            ("NUT", "PLATE", "planar"): 6 * (hexagon - PI * 25),
            ("L-BRACKET", "PLATE", "planar"): total[("L-BRACKET", "PLATE", "planar")],
        },
        rel=1e-3,
    )
