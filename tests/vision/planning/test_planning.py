"""The grid of poses about a box against closed forms, and the choice of views against loops."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from math import ceil, cos, radians, sin
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from relmodel.arrays import Floats
from relmodel.errors import UsageError
from relmodel.find.find import world_named
from relmodel.geometry.transforms import Joint, JointTree
from relmodel.store import Store
from relmodel.world.kinematics import MountedRig
from relmodel.world.placement import place_world
from tests.given import NewStore
from tests.parts.solids import Part, box, cylinder
from tests.parts.step_parts import write_product
from tests.poses import pose_of
from tests.reading import load
from tests.vision.localisation.scenes import box_scene
from vision.cameras.cameras import Camera, Rig, perturb
from vision.planning import (
    GroundPlane,
    PlanOptions,
    PoseGrid,
    choose_views,
    find_table,
    lay_grid,
    list_wanted,
    plan_views,
    predict_distinct_px,
    reach,
    reaches_any_pose,
    read_left,
    spread_joints,
    usual_distance,
)
from vision.scene import Scene, read_scene

CAMERA = Camera(800, 600, np.array([[1000.0, 0, 399.5], [0, 1200.0, 299.5], [0, 0, 1]]))
WIDE = Camera(800, 600, np.array([[800.0, 0, 399.5], [0, 800.0, 299.5], [0, 0, 1]]))
ONE = Rig({"left": CAMERA}, {"left": np.eye(4)})
TWO = Rig(
    {"left": WIDE, "right": CAMERA},
    {"left": np.eye(4), "right": perturb(np.eye(4), np.array([120.0, 0, 0, 0, -0.2, 0]))},
)
LOW, SIZE = np.array([1000.0, -200, 300]), np.array([700.0, 400, 150])
SMALL = (np.array([1250.0, -75, 350]), np.array([200.0, 150, 100]))


@pytest.mark.parametrize("order", [(0, 1, 2), (2, 0, 1)])
@pytest.mark.parametrize("rig", [ONE, TWO])
def test_every_side_of_a_box_is_looked_at_straight_and_tilted_from_the_distance(rig: Rig, order: list[int]) -> None:
    """Also where the box stands along other axes of the world."""
    low, size, far = LOW[list(order)], SIZE[list(order)], 600.0
    scene = box_scene([(low, size)])
    found = lay_grid(scene, np.array([0]), rig, far)
    step = 0.6 * far * np.array([800 / 1000, 600 / 1200])
    expected = set()
    for axis in range(3):
        u, v = sorted((a for a in range(3) if a != axis), key=lambda a: -size[a])
        count = [ceil(size[u] / step[0]), ceil(size[v] / step[1])]
        for side, i, j in np.ndindex(2, *count):
            target = low + size * 0.0
            target[[u, v]] += [(i + 0.5) * size[u] / count[0], (j + 0.5) * size[v] / count[1]]
            target[axis] += side * size[axis]
            ahead = (2 * side - 1) * np.eye(3)[axis]
            tilts = [cos(radians(35)) * ahead + s * sin(radians(35)) * np.eye(3)[a] for a in (u, v) for s in (1, -1)]
            for way in (ahead, *tilts):
                expected.add((u, *np.round([*target, *way], 3).tolist()))
    assert len(expected) == len(found)
    pose, sides = np.stack(list(rig.rig_from_camera.values())), np.array(list(expected), float)
    for world_from_rig, target in zip(found.world_from_rig, found.target, strict=True):
        cameras = world_from_rig @ pose
        way = -cameras[:, :3, 2].mean(axis=0)
        way /= np.linalg.norm(way)
        np.testing.assert_allclose(cameras[:, :3, 3].mean(axis=0), target + far * way, atol=1e-3)
        along = cameras[-1, :3, 3] - cameras[0, :3, 3] if len(pose) > 1 else cameras[0, :3, 0]
        key = [*np.round([*target, *way], 3).tolist()]
        (u,) = sides[np.isclose(sides[:, 1:], key, atol=2e-3).all(axis=1), 0].astype(int)
        ahead = np.eye(3)[u] - (np.eye(3)[u] @ way) * way
        aside = along - (along @ way) * way
        assert abs(ahead @ aside) == pytest.approx(np.linalg.norm(ahead) * np.linalg.norm(aside), rel=1e-4)
        np.testing.assert_allclose(world_from_rig[:3, :3] @ world_from_rig[:3, :3].T, np.eye(3), atol=1e-9)
        assert np.linalg.det(world_from_rig[:3, :3]) > 0


@pytest.mark.parametrize(("axis", "mm", "kept"), [(2, 1049, True), (2, 1051, False), (0, 1199, True), (0, 1201, False)])
def test_cameras_stay_clear_of_the_floor(axis: int, mm: float, kept: bool) -> None:
    """By 150 mm: looking straight down from 750 mm, the lens stands at 1200, over the middle of the box at 1350."""
    found = lay_grid(box_scene([SMALL]), np.array([0]), ONE, 750.0, GroundPlane(axis, mm))
    above = np.abs(found.world_from_rig[:, :3, 3] - [1350, 0, 1200]).max(axis=1) < 1e-3
    assert above.any() == kept


@pytest.mark.parametrize(("gap", "far", "kept"), [(145, 600, 0), (155, 600, 1), (98, 200, 0), (102, 200, 1)])
def test_nothing_lies_about_a_camera_and_what_hides_the_part_is_not_looked_through(
    gap: float, far: float, kept: int
) -> None:
    """A second block above the lens; of a short distance half has to be clear."""
    block = (np.array([1300.0, -50, 450 + far + gap]), np.array([100.0, 100, 30]))
    rig = Rig({"left": Camera(800, 600, np.diag([200.0, 200, 1]))}, {"left": np.eye(4)})
    found = lay_grid(box_scene([SMALL, block]), np.array([0]), rig, far)
    straight = np.linalg.norm(found.world_from_rig[:, :3, 3] - [1350, 0, 450 + far], axis=1) < 1e-3
    assert straight.sum() == kept
    roof = (np.array([900.0, -300, 450.4]), np.array([900.0, 600, 2.5]))
    under = lay_grid(box_scene([SMALL, roof]), np.array([0]), rig, far)
    assert under.target[:, 2].max() < 449


def test_the_table_is_at_zero_or_where_the_lowest_part_stands() -> None:
    assert find_table(box_scene([(LOW, SIZE)])) == GroundPlane(2, 0.0)
    assert find_table(box_scene([(LOW - [0, 0, 500], SIZE)])) == GroundPlane(2, -200.0)


@pytest.mark.parametrize("seed", range(2))
def test_views_are_chosen_one_by_one(seed: int) -> None:
    px = np.random.default_rng(seed).gamma(1.0, 60.0, (15, 12))
    checks = px > 120
    some, chosen = np.flatnonzero(checks.any(axis=0)), []
    seen: set[int] = set()
    while len(seen) < 0.9 * len(some):
        new = [set(np.flatnonzero(row).tolist()) - seen for row in checks]
        chosen.append(max(range(15), key=lambda v: (len(new[v]), sum(px[v, i] for i in new[v]))))
        seen |= new[chosen[-1]]
    assert choose_views(checks, px, 0.9) == chosen
    assert choose_views(checks, px, 0.9, 2) == chosen[:2]
    assert choose_views(np.zeros((3, 4), bool), np.ones((3, 4)), 0.9) == []


F = 1000.0
BLOCK = (120.0, 80.0, 60.0)
SQUARE = Rig({"left": Camera(800, 600, np.array([[F, 0, 399.5], [0, F, 299.5], [0, 0, 1]]))}, {"left": np.eye(4)})


@pytest.fixture(scope="module")
def block(new_store: NewStore, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Store]:
    """A block with a blind hole in its top and one in its bottom, turned in its world."""
    solid = Part(box((0, 0, 0), BLOCK))
    solid.cut(cylinder((60, 40, 61), 12, 16, (0, 0, -1)), cylinder((90, 40, -1), 12, 16))
    with Store.open(new_store("duckdb")) as store:
        place(store, tmp_path_factory.mktemp("block"), solid.body)
        yield store


def place(store: Store, folder: Path, solid: Any) -> None:
    write_product(folder / "block.step", solid, "block")
    rows = [[0.6, -0.8, 0, 500], [0.8, 0.6, 0, 300], [0, 0, 1, 100], [0, 0, 0, 1]]
    (folder / "world.yaml").write_text(
        f"world: w\nobjects:\n  - {{object: block, name: block, role: inspected, world_from_object: {rows}}}\n"
    )
    load(store, folder / "block.step", name="block")
    place_world(store, folder / "world.yaml")


def test_a_part_is_looked_at_beside_the_hole_in_its_middle(duckdb_template: Path, tmp_path: Path) -> None:
    solid = Part(box((0, 0, 0), BLOCK))
    solid.cut(cylinder((60, 40, -1), 12, 62))
    with Store.open(str(shutil.copy(duckdb_template, tmp_path / "cell.duckdb"))) as store:
        place(store, tmp_path, solid.body)
        views = grid(store, SQUARE, 400.0)  # from where one view shows a whole side
    top = views.target[np.isclose(views.target[:, 2], 160)]
    assert len(top) >= 5  # straight on and tilted
    assert (np.linalg.norm(top[:, :2] - [504, 372], axis=1) > 12).all()  # the middle of the bore, in the world


def test_holes_on_opposite_sides_need_two_views(block: Store) -> None:
    plan = plan_views(block, SQUARE, PlanOptions(object="block", distance=400.0, above="none"))
    holes = [{path for path in view.paths if "hole" in path} for view in plan.views]
    assert plan.hidden == []
    assert plan.tried >= 30
    assert sorted(map(len, holes)) == [1, 1]
    assert plan.views[-1].share == 1.0
    above = [view.world_from_rig[2, 3] > 160 for view in plan.views]
    below = [view.world_from_rig[2, 3] < 100 for view in plan.views]
    assert sorted(above) == sorted(below) == [False, True]
    for view in plan.views:
        # It looks at the surface from the distance asked for, near as the edges of a hole are to it.
        assert np.linalg.norm(view.target - view.world_from_rig[:3, 3]) == pytest.approx(400.0)
        assert np.allclose(view.world_from_rig[:3, :3].T @ view.world_from_rig[:3, :3], np.eye(3))
    with pytest.raises(UsageError, match="no inspected object wing"):
        plan_views(block, SQUARE, PlanOptions(object="wing"))


def grid(block: Store, rig: Rig, distance_mm: float | None = None) -> PoseGrid:
    with block.read() as connection:
        scene = read_scene(block, connection, world_named(block, connection, None)[0]).scene
    assert find_table(scene) == GroundPlane(2, 0.0)
    return lay_grid(scene, np.unique(scene.surface_occurrence), rig, distance_mm)


def test_cameras_stay_above_the_table_or_a_plane_that_is_stated(block: Store) -> None:
    everywhere = grid(block, SQUARE, 400.0).world_from_rig[:, :3, 3]
    assert (everywhere[:, 2] < 0).any()
    on_table = plan_views(block, SQUARE, PlanOptions(object="block", distance=400.0))
    assert on_table.above == "z = 0"
    assert min(view.world_from_rig[2, 3] for view in on_table.views) > 0
    assert len(on_table.hidden) == 1  # the hole from below
    assert "hole" in on_table.hidden[0]
    below = SimpleNamespace(vertices=np.array([[0.0, 0, 30], [0, 0, -12.5]]))
    assert str(find_table(cast(Scene, below))) == "z = -12.5"
    for wrong in ("z", "z=", "w=3", "z=up", "z=nan", "3", ""):
        with pytest.raises(UsageError, match="give an axis and mm, as z=0, or none"):
            plan_views(block, SQUARE, PlanOptions(object="block", above=wrong))


def pair_of(angle: float, apart: float) -> Rig:
    """Two cameras like `SQUARE`, so far apart, each turned inwards by half the angle (rad)."""
    poses = {}
    for name, side in (("left", -1.0), ("right", 1.0)):
        turn, pose = side * angle / 2, np.eye(4)
        pose[:3, :3] = [[np.cos(turn), 0, -np.sin(turn)], [0, 1, 0], [np.sin(turn), 0, np.cos(turn)]]
        pose[:3, 3] = side * apart / 2, 0, 0
        poses[name] = pose
    return Rig(dict.fromkeys(poses, SQUARE.cameras["left"]), poses)


def test_views_are_taken_from_where_the_cameras_look_or_the_part_fills_them(block: Store) -> None:
    toed_in = pair_of(2 * np.arctan(50 / 700), 100.0)
    for rig, distance in ((toed_in, 700.0), (SQUARE, F * BLOCK[0] / 800)):
        views = grid(block, rig)
        far = np.linalg.norm(views.target - views.world_from_rig[:, :3, 3], axis=1)
        assert far == pytest.approx([distance] * len(far))
    # Parallel, diverging or hardly toed in: the part in both pictures; a large part no farther than pixels are fine.
    for angle in (0.0, -0.2, 0.01):
        assert usual_distance(pair_of(angle, 100.0), np.array(BLOCK)) == pytest.approx(F * (BLOCK[0] + 100) / 800)
    assert usual_distance(SQUARE, np.array([10.0, 300, 280])) == pytest.approx(F * 280 / 600)
    assert usual_distance(SQUARE, np.array([3000.0, 40, 1000])) == 600.0


def test_px_of_a_face_seen_straight_on(block: Store) -> None:
    """From above the block shows its outline, the rim of the hole and the rim of its floor, and nothing else."""
    with block.read() as connection:
        rows, world = read_left(block, connection, PlanOptions(object="block"))
        assert world == world_named(block, connection, None)[0]
        stored = read_scene(block, connection, world)
    items, distance = list_wanted(stored, rows), 500.0
    turn = np.array([[0.6, -0.8, 0], [0.8, 0.6, 0], [0, 0, 1]])
    pose = pose_of(turn @ [60, 40, 0] + [500, 300, 160 + distance], turn @ np.diag([1.0, -1, -1]))
    px = dict(zip(items.path, predict_distinct_px(stored, SQUARE, items, pose), strict=True))
    rim = 2 * np.pi * 12 * F / distance
    floor = 2 * np.pi * 12 * F / (distance + 15)
    outline = 2 * (BLOCK[0] + BLOCK[1]) * F / distance
    holes = sorted(value for path, value in px.items() if "hole" in path)
    assert holes[0] == 0.0
    assert holes[1] == pytest.approx(rim + floor, rel=0.01)
    assert px["block/block"] == pytest.approx(outline + rim + floor, rel=0.01)


def arm(joints: int = 6) -> MountedRig:
    """A rig on an arm of six turning joints, or on its first ones."""
    ways = np.array([[0, 0, 1], [0, 1, 0], [0, 1, 0], [1, 0, 0], [0, 1, 0], [1, 0, 0]], float)
    steps = np.array([[0, 0, 300], [0, 0, 200], [0, 0, 700], [350, 0, 0], [300, 0, 0], [100, 0, 0]], float)
    links = [f"l{n}" for n in range(joints + 1)]
    chain = [
        Joint(f"j{n}", "revolute", links[n], links[n + 1], ways[n], -2.0, 2.0, pose_of(steps[n])) for n in range(joints)
    ]
    tree = JointTree(links, chain)
    base = perturb(np.eye(4), np.array([400.0, -300, 50, 0.2, -0.1, 0.7]))
    flange_from_rig = perturb(np.eye(4), np.array([10.0, 40, 90, 0.1, 1.2, -0.2]))
    values = {f"j{n}": 0.1 for n in range(joints)}
    return MountedRig(
        "head", 1, "arm", 0, "", links[-1], base, tree.poses(values)[links[-1]], flange_from_rig, tree, values
    )


def test_an_arm_is_brought_to_where_it_can_be() -> None:
    mounted, rng = arm(), np.random.default_rng(5)
    assert reaches_any_pose(mounted)
    truth = [dict(zip(mounted.joints, rng.uniform(-1.5, 1.5, 6).tolist(), strict=True)) for _ in range(6)]
    poses = np.stack([mounted.moved(joints).world_from_rig for joints in truth])
    far = poses[:1] + np.array([[0, 0, 0, 9000.0], [0] * 4, [0] * 4, [0] * 4])
    found = reach(mounted, np.concatenate([poses, far]))
    assert found[-1] is None
    reached = [(joints, pose) for joints, pose in zip(found, poses, strict=False) if joints is not None]
    assert len(reached) >= 5
    for joints, pose in reached:
        there: Floats = mounted.moved(joints).world_from_rig  # refuses what is outside the limits
        assert np.linalg.norm(there[:3, 3] - pose[:3, 3]) < 1.01
        assert np.arccos(min((np.trace(there[:3, :3].T @ pose[:3, :3]) - 1) / 2, 1)) < np.radians(0.11)


def test_a_carrier_of_two_joints_goes_where_these_take_it() -> None:
    mounted = arm(2)
    assert not reaches_any_pose(mounted)
    poses, joints = spread_joints(mounted)
    assert len(joints) == 16**2  # four radians in steps of fifteen degrees
    assert {round(it["j0"], 6) for it in joints} >= {-2.0, 2.0}
    for pose, given in zip(poses[::50], joints[::50], strict=True):
        assert np.allclose(pose, mounted.moved(given).world_from_rig)
