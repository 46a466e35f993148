"""Contacts of placed parts against closed forms, and those of a file's nuts, bolts, brackets and plate."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from relmodel.features import contacts
from relmodel.features.parameters import DEFAULTS
from relmodel.model.model import Assembly, Instance, Model, Part, Table
from relmodel.model.placed_parts import PlacedParts
from relmodel.readers.step import shape as step_shape
from relmodel.store import Store
from tests.features.test_features import box, cone, cut, cylinder
from tests.model.test_sharing import motion, random_motions
from tests.reading import store_model

Floats = npt.NDArray[np.float64]
pytest.importorskip("OCP")
PI = np.pi


def assembly(name: str, instances: Sequence[Instance]) -> Assembly:
    return Assembly(name, tuple(instances))


def model_of(solids: dict[str, Any], assemblies: list[Assembly]) -> Model:
    shapes = tuple(step_shape.extract(solid, {}, {}, {}) for solid in solids.values())
    parts = tuple(Part(name, name, i) for i, name in enumerate(solids))
    root = len(assemblies) - 1
    return Model("STEP", None, "millimetre", 1.0, shapes, parts, tuple(assemblies), root, None, 0, "test")


def at(x: float, y: float, z: float) -> Floats:
    return motion((0, 0, 1), 0.0, (x, y, z))


def rows(table: Table) -> list[tuple[str, str, str]]:
    return list(zip(table["object_path_a"], table["object_path_b"], table["kind"], strict=True)) if table else []


def turned(instances: list[Instance], pose: Floats) -> list[Instance]:
    return [Instance(i.name, i.kind, i.child, pose @ i.parent_from_child) for i in instances]


@pytest.mark.parametrize("pose", [np.eye(4), *random_motions(2, 11)])
def test_stacked_boxes_touch_where_they_overlap(pose: Floats) -> None:
    """A tower of three, each shifted; one beside it at a hundredth of a millimetre, one a tenth away."""
    placed = [at(0, 0, 0), at(10, 5, 8), at(15, 5, 16), at(20.009, 0, 0), at(-20.1, 0, 0)]
    instances = [Instance(f"box {i}", "part", 0, p) for i, p in enumerate(placed)]
    model = model_of({"box": box(0, 0, 0, (20.0, 12.0, 8.0))}, [assembly("tower", turned(instances, pose))])
    found = contacts.contacts(PlacedParts(model), 0)
    assert rows(found) == [
        ("box 0", "box 1", "planar"),
        ("box 0", "box 3", "planar"),
        ("box 1", "box 2", "planar"),
        ("box 1", "box 3", "planar"),
    ]
    assert found["area"] == pytest.approx([10 * 7, 12 * 8, 15 * 12, (30 - 20.009) * 7], rel=1e-9)
    assert found["gap"] == pytest.approx([0, 0.009, 0, 0], abs=1e-9)
    assert set(found["tolerance"]) == {DEFAULTS.contacts.touch_mm}


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
    model = model_of(solids, [assembly("joint", turned(instances, pose))])
    found = contacts.contacts(PlacedParts(model), 0)
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
    assert rows(contacts.contacts(PlacedParts(model_of(solids, [assembly("apart", instances)])), 0)) == []


def test_a_sub_assembly_keeps_its_own_contacts_and_paths_are_those_of_the_store(
    fresh_store: str,
) -> None:
    """Two of one pair of cubes, on a long bar: what touches within the pair is said once."""
    pair = assembly("pair", [Instance("cube", "part", 0, at(0, 0, 0)), Instance("cube", "part", 0, at(10, 0, 0))])
    bar = Instance("b/ar", "part", 1, at(0, 0, -5))
    pairs = [Instance("pair", "assembly", 0, at(x, 0, 0)) for x in (0, 50)]
    solids = {"cube": box(0, 0, 0, (10.0, 10.0, 10.0)), "bar": box(0, 0, 0, (100.0, 10.0, 5.0))}
    model = model_of(solids, [pair, assembly("all", [bar, *pairs])])
    with Store.open(fresh_store) as store:
        root = store_model(store, model, "all").object_id
        with store.read() as connection:
            stored = connection.execute(store.table("part_contact").select()).all()
            paths = {row.path for row in store.rows(connection, "object/expansion", object_id=root)}
    inner, outer = [r for r in stored if r.object_id != root], [r for r in stored if r.object_id == root]
    assert [(r.object_path_a, r.object_path_b, r.area) for r in inner] == [("cube#0", "cube#1", pytest.approx(100))]
    assert sorted((r.object_path_a, r.object_path_b) for r in outer) == [
        ("b_ar", f"pair#{i}/cube#{k}") for i in (1, 2) for k in (0, 1)
    ]
    assert {r.object_path_a for r in outer} | {r.object_path_b for r in outer} <= paths


@pytest.mark.data
def test_the_screwed_joints_of_a_file(data_dir: Path) -> None:
    """Brackets on a plate, each with three bolts and nuts, and a rod with nuts; cylinders are two halves there."""
    from tests.reading import shared

    model = shared(data_dir / "step" / "as1-tu-203.stp")
    total: dict[tuple[str, str, str], float] = {}
    for i in range(len(model.assemblies)):
        found = contacts.contacts(PlacedParts(model), i)
        for a, b, kind, area, gap in zip(
            *(found[c] for c in ("object_path_a", "object_path_b", "kind", "area", "gap")), strict=True
        ):
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


def ball(r: float, z_from: float = -90.0, z_to: float = 90.0, turn_deg: float = 360.0) -> Any:
    """About the origin, between two latitudes and over a turn about Z."""
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeSphere

    return BRepPrimAPI_MakeSphere(r, *np.deg2rad([z_from, z_to, turn_deg])).Shape()


def ring(wide: float, r: float, turn_deg: float = 360.0) -> Any:
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeTorus

    return BRepPrimAPI_MakeTorus(wide, r, float(np.deg2rad(turn_deg))).Shape()


def as_splines(solid: Any) -> Any:
    from OCP.BRepBuilderAPI import BRepBuilderAPI_NurbsConvert

    return BRepBuilderAPI_NurbsConvert(solid).Shape()


def pair(first: Any, second: Any, pose: Floats, between: Floats) -> Table:
    """Contacts of two parts, both turned by the pose, the second placed in the first."""
    instances = [Instance("a", "part", 0, pose), Instance("b", "part", 1, pose @ between)]
    return contacts.contacts(PlacedParts(model_of({"a": first, "b": second}, [assembly("pair", instances)])), 0)


SOCKET = (-15.0, -15.0, -30.0, (30.0, 30.0, 30.0))  # its upper face holds the origin
POSES = [np.eye(4), *random_motions(1, 3)]


@pytest.mark.parametrize("pose", POSES)
@pytest.mark.parametrize("lift", [0.0, 0.006])
def test_a_countersunk_head_in_its_seat(pose: Floats, lift: float) -> None:
    """The seat is deeper than the head is: the head's cone of 90 degrees is what they share."""
    plate = cut(box(-20, -20, -10, (40.0, 40.0, 10.0)), cone(0, 0, -7, 1, 8, 7))
    head = cone(0, 0, -6 + lift, 2, 6, 4)
    found = pair(plate, head, pose, motion((0, 0, 1), 1.1, (0, 0, 0)))
    assert rows(found) == [("a", "b", "conical")]
    assert found["gap"] == pytest.approx([lift / np.sqrt(2)], abs=1e-9)
    assert found["area"] == pytest.approx([PI * (2 + 6) * 4 * np.sqrt(2)], rel=1e-3)
    assert rows(pair(plate, cone(0, 0, -6, 2, 6.05, 4), pose, np.eye(4))) == []  # another angle
    assert rows(pair(plate, cone(0, 0, -6.1, 2, 6, 4), pose, np.eye(4))) == []  # driven in too far


@pytest.mark.parametrize("pose", POSES)
@pytest.mark.parametrize("free_form", [False, True])
def test_a_ball_in_its_socket(pose: Floats, free_form: bool) -> None:
    """Half a sphere, whichever way the ball's own axis points, and all of it in a hollow."""
    made = as_splines(ball(10)) if free_form else ball(10)
    tilted = motion((1, 2, 0.3), 0.9, (0, 0, 0))
    found = pair(cut(box(*SOCKET), ball(10)), made, pose, tilted)
    assert rows(found) == [("a", "b", "spherical")]
    assert found["gap"] == pytest.approx([0], abs=1e-6)
    assert found["area"] == pytest.approx([2 * PI * 100], rel=1e-4)
    hollow = cut(box(-15, -15, -15, (30.0, 30.0, 30.0)), ball(10.2))
    found = pair(made, hollow, pose, tilted)
    assert found["gap"] == pytest.approx([0.2], abs=1e-6)
    assert found["area"] == pytest.approx([4 * PI * 100], rel=1e-4)


@pytest.mark.parametrize("tilt", [0.2, 1.4, 3.0])
def test_hemispheres_share_a_lune(tilt: float) -> None:
    found = pair(cut(box(*SOCKET), ball(10)), ball(10, -90, 0), POSES[1], motion((1, 0.4, 0), tilt, (0, 0, 0)))
    assert found["area"] == pytest.approx([2 * (PI - tilt) * 100], rel=1e-4)


def test_zones_of_a_sphere_share_what_lies_between_their_latitudes() -> None:
    """A collar between two parallels in a socket that is open below, a quarter turn of it, and one clear of it."""
    socket = cut(cut(box(*SOCKET), ball(10)), cylinder(0, 0, -31, 10 * np.sin(0.5), 32))
    lowest = float(np.cos(0.5))
    spun = motion((0, 0, 1), 2.0, (0, 0, 0))
    for low, high, turn in ((-80, 30, 360), (-50, -20, 360), (-80, -10, 90), (-40, 60, 200)):
        found = pair(socket, ball(10, low, high, turn), POSES[1], spun)
        top, bottom = min(np.sin(np.deg2rad(high)), 0.0), max(np.sin(np.deg2rad(low)), -lowest)
        assert found["area"] == pytest.approx([np.deg2rad(turn) * (top - bottom) * 100], rel=1e-3)
    assert rows(pair(socket, ball(10, 5, 60), POSES[1], spun)) == []


@pytest.mark.parametrize("pose", POSES)
def test_a_ring_in_its_groove(pose: Floats) -> None:
    """By Pappus the inner half of a torus; of a ring that is cut open the part that is left."""
    shaft = cut(cylinder(0, 0, -10, 20, 20), ring(20, 3))
    inner = 2 * PI * 3 * (PI * 20 - 2 * 3)
    for made, share in ((ring(20, 3), 1.0), (ring(20, 3, 270), 0.75)):
        for placed in (motion((0, 0, 1), 2.5, (0, 0, 0)), motion((1, 0, 0), PI, (0, 0, 0))):
            found = pair(shaft, made, pose, placed)
            assert set(rows(found)) == {("a", "b", "toroidal")}
            assert found["area"].sum() == pytest.approx(inner * share, rel=1e-4)
    found = pair(shaft, ring(20, 2.8), pose, np.eye(4))
    assert found["gap"] == pytest.approx([0.2], abs=1e-9)
    assert found["area"] == pytest.approx([2 * PI * 2.8 * (PI * 20 - 2 * 2.8)], rel=1e-2)
    assert rows(pair(shaft, ring(20.05, 3), pose, np.eye(4))) == []


def test_round_faces_that_do_not_touch() -> None:
    """Two balls in one place, a ball beside its socket, a ball much too small, tapers that open to opposite sides."""
    socket = cut(box(*SOCKET), ball(10))
    spot = np.eye(4)
    assert rows(pair(ball(10), ball(10), spot, spot)) == []
    assert rows(pair(socket, ball(10), spot, at(0.05, 0, 0))) == []
    assert rows(pair(socket, ball(7), spot, spot)) == []
    seat = cut(box(-20, -20, -20, (40.0, 40.0, 40.0)), cone(0, 0, 0, 0, 20, 20))
    assert rows(pair(seat, cone(0, 0, 0, 0, 10, 10), spot, motion((1, 0, 0), PI, (0, 0, 0)))) == []


def test_parts_deep_in_an_assembly_touch_those_beside_it() -> None:
    """Two boxes that meet 1,500 assemblies down, and 2**15 placed parts of 15 levels that meet nowhere."""
    deep = 1500
    solids = {"box": box(0, 0, 0, (10.0, 10.0, 10.0))}
    chain = [assembly("level 0", [Instance("box", "part", 0, at(0, 0, 0))])]
    chain += [
        assembly(f"level {i}", [Instance("in", "assembly", i - 1, motion((0, 0, 1), 0.01, (1, 0, 0)))])
        for i in range(1, deep)
    ]
    down = np.linalg.matrix_power(motion((0, 0, 1), 0.01, (1, 0, 0)), deep - 1)
    beside = Instance("beside", "part", 0, down @ at(10, 2, 0))
    model = model_of(solids, [*chain, assembly("top", [Instance("in", "assembly", deep - 1, np.eye(4)), beside])])
    found = contacts.contacts(PlacedParts(model), deep)
    assert rows(found) == [("/".join(["in"] * deep + ["box"]), "beside", "planar")]
    assert found["area"] == pytest.approx([80], rel=1e-6)
    far = [assembly("pair", [Instance(n, "part", 0, at(x, 0, 0)) for n, x in (("a", 0), ("b", 11))])]
    for i in range(1, 15):
        step = at(*(11.0 * 2 ** (i // 3 + (i % 3 == 0)) * np.eye(3)[i % 3]))
        far.append(
            assembly(f"{i}", [Instance("a", "assembly", i - 1, np.eye(4)), Instance("b", "assembly", i - 1, step)])
        )
    placed = PlacedParts(model_of(solids, far))
    assert len(placed.of(14).child) == 2**15
    assert not any(contacts.contacts(placed, i) for i in range(15))
