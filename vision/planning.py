"""A plan of the next views: poses of a rig about a placed object that an arm reaches, by what they would check."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, TypedDict

import cv2
import numpy as np
from sqlalchemy import Connection

from relmodel.arrays import Bools, Floats, Ints, Rows
from relmodel.errors import UsageError
from relmodel.find.find import world_named
from relmodel.geometry.transforms import JointTree, rotation_vector, skew
from relmodel.progress import Progress, silent
from relmodel.store import Store
from relmodel.world.kinematics import MountedRig, mount_of_rig
from vision.account.samples import collect_samples, weigh_samples
from vision.cameras.cameras import Rig
from vision.cameras.record import find_rig
from vision.localisation.hypotheses import bound_elements, lie_within
from vision.localisation.views import find_view_arcs
from vision.localisation.visibility import PART, PartsInView
from vision.presence.displaced import find_axes
from vision.presence.items import Items, list_items
from vision.presence.presence_parameters import DEFAULTS, PresenceParameters
from vision.presence.states import pair_with_runs
from vision.scene import Scene, StoredScene, read_scene

_PIXEL_MM = 0.6  # of the part in a pixel, where no distance is given: finer than a change that counts
_STEP = 0.6  # share of a view's width and height from one view to the next: neighbours overlap
_TILT = np.radians(35)  # beside the view straight on, one tilted to each side shows the walls of what is deep
# rad between the axes of cameras that are set to look at one place; less may be how they were mounted
_LEAST_TOE_IN = np.radians(2)
_CLEAR_MM = 150.0  # about a camera in which nothing may lie; of a shorter distance half


@dataclass(frozen=True)
class PoseGrid(Rows):
    """Poses (n, 4, 4) of a rig and the points (n, 3) of the object that they look at, in the world, mm."""

    world_from_rig: Floats
    target: Floats


@dataclass(frozen=True)
class GroundPlane:
    """A plane across an axis (0, 1, 2) of the world at a place along it, mm, that cameras stay above."""

    axis: int
    mm: float

    def __str__(self) -> str:
        return f"{'xyz'[self.axis]} = {self.mm:g}"


def find_table(scene: Scene) -> GroundPlane:
    """The plane z = 0 of the world, or that on which its lowest part stands where this is lower."""
    return GroundPlane(2, float(scene.vertices[:, 2].min(initial=0.0)))


def usual_distance(rig: Rig, size: Floats) -> float:
    """Where the axes of toed-in cameras meet.  Else where a box of this size (3,) mm fills the picture of all cameras,
    but no farther than where a pixel of the coarsest shows `_PIXEL_MM`."""
    poses = np.stack(list(rig.rig_from_camera.values()))
    place, way, look = poses[:, :3, 3], poses[:, :3, 2], look_frame(rig)
    if np.linalg.norm(np.cross(way[0], way[-1])) > np.sin(_LEAST_TOE_IN):
        across = np.eye(3) - way[:, :, None] * way[:, None, :]
        met = np.linalg.solve(across.sum(axis=0), np.einsum("nij,nj->i", across, place))
        if (far := float((met - look[:3, 3]) @ look[:3, 2])) > 0:
            return far
    long, short = np.sort(size)[:0:-1]
    long += np.linalg.norm(place[-1] - place[0])
    sides = [
        (c.matrix[0, 0], c.matrix[0, 0] * long / c.width, c.matrix[1, 1] * short / c.height)
        for c in rig.cameras.values()
    ]
    focal, *fills = np.array(sides, float).T
    return float(min(_PIXEL_MM * focal.min(), np.max(fills)))


def lay_grid(
    scene: Scene, occurrences: Ints, rig: Rig, distance_mm: float | None = None, floor: GroundPlane | None = None
) -> PoseGrid:
    """The poses at a distance from the surface of placed parts, `usual_distance` where none is given, no camera too
    near to anything.

    Each side of the box about them is a lattice of views that overlap; rays inward from the middle of each cell, else
    about it, as that may look through a hole, say what is looked at; where nothing is there is no view."""
    mine = np.flatnonzero(np.isin(scene.surface_occurrence[scene.triangle_surface], occurrences))
    corners = scene.vertices[np.unique(scene.triangles[mine])]
    axes = _box_axes(corners, find_axes(scene, occurrences, np.array([0.0, 0.0, 1.0])))
    low, high = (corners @ axes.T).min(axis=0), (corners @ axes.T).max(axis=0)
    distance_mm = usual_distance(rig, high - low) if distance_mm is None else distance_mm
    sizes = [(c.width / c.matrix[0, 0], c.height / c.matrix[1, 1]) for c in rig.cameras.values()]
    step = _STEP * distance_mm * np.min(np.array(sizes, float), axis=0)
    rig_from_look = look_frame(rig)
    poses, targets = [], []
    for axis in range(3):
        # The picture lies along the longer of the two.
        u, v = sorted((a for a in range(3) if a != axis), key=lambda a: low[a] - high[a])
        for side in (-1.0, 1.0):
            across, down = _spread(low[u], high[u], step[0]), _spread(low[v], high[v], step[1])
            start = np.stack(np.meshgrid(across, down), -1).reshape(-1, 1, 2)
            third = np.array([(high[u] - low[u]) / len(across), (high[v] - low[v]) / len(down)]) / 3
            at = np.zeros((len(start) * len(_ABOUT), 3))
            at[:, [u, v]] = (start + _ABOUT * third).reshape(-1, 2)
            at[:, axis] = (high if side > 0 else low)[axis] + side
            met, target = _meet(scene, at @ axes, np.tile(-side * axes[axis], (len(at), 1)), occurrences)
            target = target[np.unique(np.flatnonzero(met) // len(_ABOUT), return_index=True)[1]]
            ahead = side * axes[axis]
            tilted = [np.cos(_TILT) * ahead + np.sin(_TILT) * aside for aside in (axes[u], -axes[u], axes[v], -axes[v])]
            for way in (ahead, *tilted):
                poses.append(_looking(target, way, axes[u], distance_mm) @ np.linalg.inv(rig_from_look))
                targets.append(target)
    grid = PoseGrid(np.concatenate(poses), np.concatenate(targets))
    clear = min(_CLEAR_MM, 0.5 * distance_mm)
    return grid.take(np.array([_is_clear(scene, floor, rig, pose, clear) for pose in grid.world_from_rig], bool))


def look_from(
    scene: Scene, occurrences: Ints, rig: Rig, poses: Floats, floor: GroundPlane | None = None
) -> tuple[PoseGrid, Ints]:
    """Those of some poses (n, 4, 4) of a rig from which the middle of its view lies on placed parts, and which those
    are; no camera too near to anything."""
    look = poses @ look_frame(rig)
    met, target = _meet(scene, look[:, :3, 3], look[:, :3, 2], occurrences)
    kept = np.array([_is_clear(scene, floor, rig, pose, _CLEAR_MM) for pose in poses[met]], bool)
    return PoseGrid(poses[met], target).take(kept), np.flatnonzero(met)[kept]


def _box_axes(points: Floats, axes: Floats) -> Floats:
    """Axes (3, 3) of the smallest box about points (n, 3) along the third of the given ones, right-handed."""
    turn = np.radians(cv2.minAreaRect((points @ axes[:2].T).astype(np.float32))[2])
    cosine, sine = np.cos(turn), np.sin(turn)
    return np.asarray(np.array([[cosine, sine, 0], [-sine, cosine, 0], [0, 0, 1]]) @ axes)


_ABOUT = np.array([(0, 0), (-1, 0), (1, 0), (0, -1), (0, 1), (-1, -1), (1, -1), (-1, 1), (1, 1)])  # the middle first


def _spread(low: float, high: float, step: float) -> Floats:
    count = max(int(np.ceil((high - low) / step)), 1)
    return np.asarray(low + (np.arange(count) + 0.5) * (high - low) / count)


def _meet(scene: Scene, start: Floats, way: Floats, occurrences: Ints) -> tuple[Bools, Floats]:
    """Which rays (n,) from points (n, 3) meet some placed parts before anything else, and where those do (m, 3)."""
    hit = scene.rays.nearest(start, way)
    met = hit >= 0
    met[met] = np.isin(scene.surface_occurrence[scene.triangle_surface[hit[met]]], occurrences)
    corner = scene.vertices[scene.triangles[hit[met]]]
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    along = np.einsum("ni,ni->n", normal, corner[:, 0] - start[met]) / np.einsum("ni,ni->n", normal, way[met])
    return met, np.asarray(start[met] + along[:, None] * way[met])


def look_frame(rig: Rig) -> Floats:
    """`rig_from_look` (4, 4): amid the cameras, z along the mean of their axes, x from the first to the last."""
    poses = np.stack([rig.rig_from_camera[name] for name in rig.cameras])
    z = poses[:, :3, 2].mean(axis=0)
    z /= np.linalg.norm(z)
    across = poses[-1, :3, 3] - poses[0, :3, 3] if len(poses) > 1 else poses[0, :3, 0]
    return _frame(poses[:, :3, 3].mean(axis=0), z, across)


def _frame(place: Floats, z: Floats, across: Floats) -> Floats:
    """A pose (4, 4) at a place with this z (3,) and x in the direction of `across` as far as it can be."""
    x = across - (across @ z) * z
    x /= np.linalg.norm(x)
    out = np.eye(4)
    out[:3] = np.column_stack([x, np.cross(z, x), z, place])
    return out


def _looking(target: Floats, way: Floats, across: Floats, distance_mm: float) -> Floats:
    """Poses (n, 4, 4) that look at points (n, 3) from the direction `way` (3,)."""
    out = np.tile(_frame(np.zeros(3), -way, across), (len(target), 1, 1))
    out[:, :3, 3] = target + distance_mm * way
    return out


def _is_clear(scene: Scene, floor: GroundPlane | None, rig: Rig, world_from_rig: Floats, clear_mm: float) -> bool:
    """Whether every camera is that far above the floor and from all surfaces, as far as rays to all sides tell."""
    ways = np.stack(np.meshgrid(*[np.arange(-2.0, 3.0)] * 3), -1).reshape(-1, 3)
    ways = ways[np.abs(ways).max(axis=1) == 2]
    ways *= clear_mm / np.linalg.norm(ways, axis=1)[:, None]
    eyes = [(world_from_rig @ pose)[:3, 3] for pose in rig.rig_from_camera.values()]
    if floor is not None and min(eye[floor.axis] for eye in eyes) < floor.mm + clear_mm:
        return False
    return not any(scene.rays.blocked(eye + ways, eye).any() for eye in eyes)


# The joints with which an arm brings a rig to a pose, and the poses to which one with few joints brings it.

_NEAR_MM, _NEAR = 1.0, np.radians(0.1)  # how exactly an arm must reach a view
_STEPS = 25  # of the search for the joints of a view
_STARTS = 5  # of that search at random, after those of the view before
_ARM_MM = 1000.0  # that a rad counts in it
_JOINT_MM, _JOINT = 100.0, np.radians(15)  # from one value to the next of a carrier with too few joints for any pose
_MOST_JOINTS = 400  # values of all its joints together that are tried


def reach(mounted: MountedRig, poses: Floats) -> list[dict[str, float] | None]:
    """Joints (rad, mm, within their limits) that bring a mounted rig to each of some poses (n, 4, 4); None where none
    were found.

    Damped least squares from the joints of the pose before, then from some at random.  Obstacles are not looked at."""
    tree = mounted.tree
    assert tree is not None
    link, rng = mounted.link or tree.root, np.random.default_rng(0)
    joints = tree.movable
    low, high = _limits(tree)
    turning = np.array([j.kind == "continuous" for j in joints], bool)
    last = np.clip([mounted.joints[j.name] for j in joints], low, high)
    out: list[dict[str, float] | None] = []
    for pose in poses:
        wanted = np.linalg.inv(mounted.world_from_object) @ pose @ np.linalg.inv(mounted.link_from_rig)
        found = None
        for start in (last, *rng.uniform(low, high, (_STARTS, len(joints)))):
            found = _solve(tree, link, wanted, start, np.where(turning, [[-np.inf], [np.inf]], [low, high]))
            if found is not None:
                last = found
                break
        out.append(None if found is None else dict(zip((j.name for j in joints), found.tolist(), strict=True)))
    return out


def reaches_any_pose(mounted: MountedRig) -> bool:
    """Whether what carries a rig has joints for all six freedoms of a pose."""
    return mounted.tree is not None and len(mounted.tree.movable) >= 6


def spread_joints(mounted: MountedRig) -> tuple[Floats, list[dict[str, float]]]:
    """Poses (n, 4, 4) of a mounted rig over the range of its few joints, and these (rad, mm), or where it stands."""
    if mounted.tree is None:
        return mounted.world_from_rig[None], [{}]
    joints = mounted.tree.movable
    low, high = _limits(mounted.tree)
    fine = np.array([_JOINT_MM if j.kind == "prismatic" else _JOINT for j in joints])
    count = np.minimum(np.floor((high - low) / fine) + 1, np.floor(_MOST_JOINTS ** (1 / max(len(joints), 1)) + 1e-9))
    axes = [np.linspace(a, b, int(n)) for a, b, n in zip(low, high, count, strict=True)]
    values = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, len(joints))
    given = [dict(zip((j.name for j in joints), row.tolist(), strict=True)) for row in values]
    return np.stack([mounted.moved(row).world_from_rig for row in given]), given


def _limits(tree: JointTree) -> tuple[Floats, Floats]:
    """Limits of the movable joints; of one without any half a turn either way."""
    low, high = ([getattr(j, end) for j in tree.movable] for end in ("lower", "upper"))
    return (
        np.array([-np.pi if limit is None else limit for limit in low], float),
        np.array([np.pi if limit is None else limit for limit in high], float),
    )


def _solve(tree: JointTree, link: str, wanted: Floats, start: Floats, limits: Floats) -> Floats | None:
    """Values of the movable joints near `start` with which a link stands as wanted (4, 4) in the root's frame."""
    names = [j.name for j in tree.movable]
    values, damping = start.copy(), 1e-3
    # Further than so much, rad and mm, the motion of a joint is no line.
    longest = np.array([500.0 if j.kind == "prismatic" else 0.7 for j in tree.movable])
    for _ in range(_STEPS):
        given = tree.values(dict(zip(names, values.tolist(), strict=True)), "joints")
        stands = tree.poses(given)[link]
        place, turned = stands[:3, 3], rotation_vector(wanted[:3, :3] @ stands[:3, :3].T)
        if np.linalg.norm(wanted[:3, 3] - place) <= _NEAR_MM and np.linalg.norm(turned) <= _NEAR:
            return values
        off = np.concatenate([wanted[:3, 3] - place, _ARM_MM * turned])
        twist = tree.screws(link, given, names)
        slope = np.concatenate([twist[:3] - skew(place) @ twist[3:], _ARM_MM * twist[3:]])
        normal = slope.T @ slope
        step = np.linalg.solve(normal + damping * np.diag(np.diag(normal) + 1e-9), slope.T @ off)
        values = np.clip(values + np.clip(step, -longest, longest), *limits)
    return None


# What an inspection from a pose would have to decide by: no picture is needed to say how much of each thing shows.


def predict_distinct_px(
    stored: StoredScene, rig: Rig, items: Items, world_from_rig: Floats, p: PresenceParameters = DEFAULTS
) -> Floats:
    """Px (i,) of sharp edges of each item that all cameras of a rig would see at a pose and that could be distinguished
    from others: by the rays, the samples and the crowding that an inspection decides with.

    A face seen at a grazing angle, a far one and one behind another have few such px or none."""
    views = {
        name: find_view_arcs(stored.scene, camera, world_from_rig @ rig.rig_from_camera[name])
        for name, camera in rig.cameras.items()
    }
    if not any(len(view.run) for view in views.values()):
        return np.zeros(len(items))
    can_show = [partial(lie_within, *bound_elements(camera)) for camera in rig.cameras.values()]
    samples = collect_samples(stored, rig, can_show, world_from_rig, views, p.account.samples)
    if not len(samples.run):
        return np.zeros(len(items))
    weight = np.bincount(samples.run, weigh_samples(samples, p.account.support), samples.run_count)
    head = np.flatnonzero(np.diff(samples.run, prepend=-1) != 0)
    item, run, _ = pair_with_runs(items, samples.surface[head])
    return np.bincount(item, weight[run], len(items)).astype(float)


# A plan of the next views: greedily those that check most of what is left, by the model's own visibility.

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


class PlanOptions(TypedDict, total=False):
    """What a plan is of, and what its views must keep to.

    serial: number of a physical part: what its inspections have not decided.  object: of a world, all of it.
    world: its name, where the store has several.  on: the object that carries the rig, where several do.
    distance: from the cameras to the part's surface, mm, else `usual_distance`.
    above: the plane of the world that cameras stay above, as z=0, or none, else `find_table`.
    views: at most so many, else as many as check `_ENOUGH` of what any would."""

    serial: str | None
    object: str | None
    world: str | None
    on: str | None
    distance: float | None
    above: str | None
    views: int | None


def plan_views(store: Store, rig: Rig, wanted: PlanOptions, progress: Progress = silent) -> Plan:
    """The next views of a physical part or of an object of a world.

    Where the world mounts the rig on an arm, only poses that it reaches are tried; of a carrier with fewer than six
    joints those that it brings the rig to, at whatever distance.
    Raises UsageError where the part or object is not there, and for a plane that is none."""
    above = wanted.get("above")
    stated = None if above is None else _read_floor(above)
    with store.read() as connection:
        rows, world_id = read_left(store, connection, wanted)
        if not rows:
            return Plan([], 0, 0, 0, [])
        stored = read_scene(store, connection, world_id)
        rig_id = find_rig(store, connection, rig)
        mounted = None if rig_id is None else mount_of_rig(store, connection, world_id, rig_id, wanted.get("on"))
    store.release()
    items = list_wanted(stored, rows)
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


def _read_floor(above: str) -> GroundPlane | None:
    axis, equals, mm = above.replace(" ", "").partition("=")
    if above == "none":
        return None
    try:
        if equals and axis in ("x", "y", "z") and np.isfinite(float(mm)):
            return GroundPlane("xyz".index(axis), float(mm))
    except ValueError:
        pass
    raise UsageError(f"{above!r} is no plane that cameras stay above: give an axis and mm, as z=0, or none")


def _poses(
    stored: StoredScene,
    items: Items,
    rig: Rig,
    mounted: MountedRig | None,
    distance_mm: float | None,
    floor: GroundPlane | None,
) -> tuple[PoseGrid, list[dict[str, float]], int]:
    """The poses to try, the joints of each, and how many of the grid the arm does not reach."""
    scene = stored.scene
    pieces = np.array([path.partition("/")[0] for path in stored.paths], object)
    wholes = [np.flatnonzero(pieces == name) for name in sorted(set(pieces[np.unique(items.occurrence)]))]
    if mounted is not None and not reaches_any_pose(mounted):
        poses, given = spread_joints(mounted)
        grid, kept = look_from(scene, np.concatenate(wholes), rig, poses, floor)
        return grid, [given[i] for i in kept], 0
    grids = [lay_grid(scene, whole, rig, distance_mm, floor) for whole in wholes]
    grid = PoseGrid(*(np.concatenate([getattr(g, name) for g in grids]) for name in ("world_from_rig", "target")))
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


def read_left(store: Store, connection: Connection, wanted: PlanOptions) -> tuple[Sequence[Any], int]:
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


def list_wanted(stored: StoredScene, rows: Sequence[Any]) -> Items:
    """Parts and features as an inspection lists them, those that have a surface."""
    known = set(zip(stored.features["shape_id"].tolist(), stored.features["feature_no"].tolist(), strict=True))
    shape = dict(zip(stored.occurrence_id.tolist(), stored.shape_id.tolist(), strict=True))
    rows = [r for r in rows if r.feature_no is None or (shape[r.occurrence_id], r.feature_no) in known]
    number = np.array([PART if r.feature_no is None else r.feature_no for r in rows], np.int64)
    occurrence = np.array([r.occurrence_id for r in rows], np.int64)
    none = np.zeros(len(rows))
    return list_items(stored, PartsInView(occurrence, number, [r.path for r in rows], none, none), [])
