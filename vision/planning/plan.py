"""A plan of the next views: greedily those that check most of what is left, by the model's own visibility."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, TypedDict

import numpy as np
from sqlalchemy import Connection

from relmodel.arrays import Bools, Floats
from relmodel.errors import UsageError
from relmodel.find.find import world_named
from relmodel.progress import Progress, silent
from relmodel.store import Store
from relmodel.world.kinematics import MountedRig, mount_of_rig
from vision.cameras.cameras import Rig
from vision.cameras.record_cameras import find_rig
from vision.localisation.parts_in_view import PART, PartsInView
from vision.planning.grid import Floor, Grid, find_table, lay_grid, look_from
from vision.planning.predict import predict_distinct_px
from vision.planning.reach import reach, reaches_any_pose, spread_joints
from vision.presence.items import Items, list_items
from vision.scene.stored_scene import StoredScene, read_scene

# px of edges that can be distinguished from others, over all cameras, from which a part or feature counts as checked:
# of those of the demonstration's pairs with as many 11 in 12 were decided, of those with less 1 in 8.
LEAST_PX = 120.0
_ENOUGH = 0.95  # share of what any view could check at which a plan ends


@dataclass(frozen=True)
class PlannedView:
    """A view of a plan: pose (4, 4), the point (3,) looked at, mm; joints of the arm that carries the rig (rad, mm),
    none where no arm does; paths: what it would check that no view before it does; share: of all that some view could
    check, what it and those before it check."""

    world_from_rig: Floats
    target: Floats
    joints: dict[str, float]
    paths: list[str]
    share: float

    def to_json(self) -> dict[str, Any]:
        return {
            "world_from_rig": self.world_from_rig.tolist(),
            "target": self.target.tolist(),
            "joints": self.joints,
            "checks": self.paths,
            "share": self.share,
        }


@dataclass(frozen=True)
class Plan:
    """The views proposed; left: how many parts and features are not checked yet; tried: poses looked at, out_of_reach:
    those of the grid to which the arm does not bring the rig; hidden: paths of what no pose tried would check; above:
    the plane that the cameras were kept above, as `z = 0`."""

    views: list[PlannedView]
    left: int
    tried: int
    out_of_reach: int
    hidden: list[str]
    above: str | None = None

    def to_json(self) -> dict[str, Any]:
        views = [view.to_json() for view in self.views]
        counts = {"left": self.left, "tried": self.tried, "out_of_reach": self.out_of_reach}
        return {"views": views, **counts, "hidden": self.hidden, "above": self.above}


class Wanted(TypedDict, total=False):
    """What a plan is of, and what its views must keep to.

    serial: number of a physical part: what its inspections have not decided.  object: of a world, all of it.
    world: its name, where the store has several.  on: the object that carries the rig, where several do.
    distance: from the cameras to the part's surface, mm, else `usual_distance`.
    above: the plane of the world that cameras stay above, as z=0, or none, else `find_table`.
    views: at most so many, else as many as check `_ENOUGH` of what any would.
    """

    serial: str | None
    object: str | None
    world: str | None
    on: str | None
    distance: float | None
    above: str | None
    views: int | None


def plan_views(store: Store, rig: Rig, wanted: Wanted, progress: Progress = silent) -> Plan:
    """The next views of a physical part or of an object of a world.

    Where the world mounts the rig on an arm, only poses that it reaches are tried; of a carrier with fewer than six
    joints those that it brings the rig to, at whatever distance.
    Raises UsageError where the part or object is not there, and for a plane that is none."""
    above = wanted.get("above")
    stated = None if above is None else _read_floor(above)
    with store.read() as connection:
        rows, world_id = _left(store, connection, wanted)
        if not rows:
            return Plan([], 0, 0, 0, [])
        stored = read_scene(store, connection, world_id)
        rig_id = find_rig(store, connection, rig)
        mounted = None if rig_id is None else mount_of_rig(store, connection, world_id, rig_id, wanted.get("on"))
    store.release()
    items = _items(stored, rows)
    floor = find_table(stored.scene) if above is None else stated
    grid, joints, beyond = _poses(stored, items, rig, mounted, wanted.get("distance"), floor)
    px = np.zeros((len(joints), len(items)))
    for number, pose in enumerate(grid.world_from_rig):
        progress("looking from poses about the part", number, len(joints))
        px[number] = predict_distinct_px(stored, rig, items, pose)
    checks = px >= LEAST_PX
    some = checks.any(axis=0)
    views, seen = [], np.zeros(len(items), bool)
    for number in choose_views(checks, px, _ENOUGH, wanted.get("views")):
        new = np.flatnonzero(checks[number] & ~seen)
        seen |= checks[number]
        paths, share = [items.path[i] for i in new], float(seen.sum() / some.sum())
        views.append(PlannedView(grid.world_from_rig[number], grid.target[number], joints[number], paths, share))
    hidden = [items.path[i] for i in np.flatnonzero(~some)]
    return Plan(views, len(items), len(joints), beyond, hidden, None if floor is None else str(floor))


def _read_floor(above: str) -> Floor | None:
    axis, equals, mm = above.replace(" ", "").partition("=")
    if above == "none":
        return None
    try:
        if equals and axis in ("x", "y", "z") and np.isfinite(float(mm)):
            return Floor("xyz".index(axis), float(mm))
    except ValueError:
        pass
    raise UsageError(f"{above!r} is no plane that cameras stay above: give an axis and mm, as z=0, or none")


def _poses(
    stored: StoredScene,
    items: Items,
    rig: Rig,
    mounted: MountedRig | None,
    distance_mm: float | None,
    floor: Floor | None,
) -> tuple[Grid, list[dict[str, float]], int]:
    """The poses to try, the joints of each, and how many of the grid the arm does not reach."""
    scene = stored.scene
    pieces = np.array([path.partition("/")[0] for path in stored.paths], object)
    wholes = [np.flatnonzero(pieces == name) for name in sorted(set(pieces[np.unique(items.occurrence)]))]
    if mounted is not None and not reaches_any_pose(mounted):
        poses, given = spread_joints(mounted)
        grid, kept = look_from(scene, np.concatenate(wholes), rig, poses, floor)
        return grid, [given[i] for i in kept], 0
    grids = [lay_grid(scene, whole, rig, distance_mm, floor) for whole in wholes]
    grid = Grid(*(np.concatenate([getattr(g, name) for g in grids]) for name in ("world_from_rig", "target")))
    if mounted is None:
        return grid, [{}] * len(grid.target), 0
    joints = reach(mounted, grid.world_from_rig)
    reached = [number for number, it in enumerate(joints) if it is not None]
    return grid.take(np.array(reached, np.int64)), [it for it in joints if it is not None], len(joints) - len(reached)


def choose_views(checks: Bools, px: Floats, enough: float, most: int | None = None) -> list[int]:
    """Rows of views (v, i) chosen one by one, each that checks most items that none before it does, of equals the one
    that shows most of them; until the share `enough` of what any view checks is, or `most` are chosen."""
    some, seen = int(checks.any(axis=0).sum()), np.zeros(checks.shape[1], bool)
    chosen: list[int] = []
    while seen.sum() < enough * some and (most is None or len(chosen) < most):
        new = checks & ~seen
        gain = new.sum(axis=1)
        best = int(np.lexsort(((new * px).sum(axis=1), gain))[-1])
        chosen.append(best)
        seen |= checks[best]
    return chosen


def _left(store: Store, connection: Connection, wanted: Wanted) -> tuple[Sequence[Any], int]:
    """Rows of what is left to be checked, and the world."""
    if (serial := wanted.get("serial")) is not None:
        outcome = store.rows(connection, "report/serial_outcome", serial=serial)
        if not outcome or not outcome[0].features:
            raise UsageError(
                f"no inspection names the serial number {serial} and came to an answer: plan its first views with "
                "--object, or see relmodel runs"
            )
        rows = store.rows(connection, "plan/left_of_serial", serial=serial)
        return rows, int(rows[0].world_id) if rows else -1
    world_id, name = world_named(store, connection, wanted.get("world"))
    object_name = wanted.get("object")
    rows = store.rows(connection, "plan/items_of_object", world_id=world_id, object=object_name)
    if not rows:
        raise UsageError(f"world {name} has no inspected object {object_name}: name one of its objects")
    return rows, world_id


def _items(stored: StoredScene, rows: Sequence[Any]) -> Items:
    """Parts and features as an inspection lists them, those that have a surface."""
    known = set(zip(stored.features["shape_id"].tolist(), stored.features["feature_no"].tolist(), strict=True))
    shape = dict(zip(stored.occurrence_id.tolist(), stored.shape_id.tolist(), strict=True))
    rows = [r for r in rows if r.feature_no is None or (shape[r.occurrence_id], r.feature_no) in known]
    number = np.array([PART if r.feature_no is None else r.feature_no for r in rows], np.int64)
    occurrence = np.array([r.occurrence_id for r in rows], np.int64)
    none = np.zeros(len(rows))
    return list_items(stored, PartsInView(occurrence, number, [r.path for r in rows], none, none), [])
