"""Placing a world: from a world file to a revision of the world.

A revision writes what changed: the rows of an object that moved, or of a robot whose joints did, end with the revision
before, and new ones begin.  What stands in an object is expanded when the object is loaded, and is no part of it.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from graphlib import CycleError, TopologicalSorter
from itertools import starmap
from pathlib import Path
from typing import Any

import numpy as np
from sqlalchemy import Connection

from relmodel.arrays import Columns, Floats, by_column
from relmodel.errors import InputError, UsageError
from relmodel.find.find import BOX_COLUMNS
from relmodel.geometry.transforms import MATRIX_COLUMNS, boxes_carried, matrices
from relmodel.names import read_bytes
from relmodel.progress import Progress, silent
from relmodel.store import Run, Store, digest_inputs, sql
from relmodel.store.database import Database
from relmodel.world.kinematics import Robots
from relmodel.world.world_file import PlacedObject, WorldFile, read_world_file

_BODY = f"object_no body_no object_variant_id role tolerance_mm {' '.join(MATRIX_COLUMNS)}"
_MOUNT = f"mount_no name object_no link object_path rig_id mounted_no {' '.join(MATRIX_COLUMNS)}"
_ROUND_OFF_MM = 1e-6  # by which the box of a body exceeds its parts' boxes, which are rounded otherwise

# Writes the rig (name in the world file, rig file) within a run's transaction and returns its identity.
RigWriter = Callable[[Run, Connection, str, Path], int]


@dataclass(frozen=True)
class WorldReport:
    """What placing a world did.  `status` is added, or unchanged where the newest revision says the same."""

    run_id: int
    world: str
    world_id: int
    revision: int
    status: str
    objects: int
    parts: int


def place_world(
    store: Store, path: str | Path, *, write_rig: RigWriter | None = None, progress: Progress = silent
) -> WorldReport:
    """Place the world of a world file: a run of kind `world` that adds a revision, unless nothing changed.

    Objects are pinned to the newest revision of their name and variant.  `write_rig` is how a rig file becomes rows:
    a file that mounts rigs needs it.  Raises InputError where the file is bad, names an object that is not loaded, or
    an object contains itself; the store's worlds are then as they were.
    """
    with Run.begin(
        store, "world", {"file": Path(path).name}, inputs=digest_inputs({"world": path}), packages=("numpy",)
    ) as run:
        return _place(store, run, read_world_file(path), write_rig, progress)


def _place(store: Store, run: Run, file: WorldFile, write_rig: RigWriter | None, progress: Progress) -> WorldReport:
    progress(f"{file.path.name}: finding its objects", 0, 1)
    if write_rig is None and any(mount.kind == "rig" for mount in file.mounts):
        raise UsageError(f"{file.path} mounts rigs: place it with a writer of rigs")
    with store.read() as connection:
        pinned = _pin(file, [dict(row._mapping) for row in store.rows(connection, "object/newest", run=None)])
        _refuse_cycles(store, connection, file, pinned)
        of_object = {number: Robots(store, connection, number) for number in {row["object_id"] for row in pinned}}
        robots = [of_object[row["object_id"]] for row in pinned]
        values = [_joint_values(file, number, found) for number, found in enumerate(robots)]
        link_paths = _link_paths(store, connection, file, pinned, robots)
        poses = _poses(store, connection, file, pinned, robots, values)
        rig_digests = {name: hashlib.sha256(read_bytes(rig, "rig file")).hexdigest() for name, rig in file.rigs.items()}
    content_key = _content_key(file, pinned, poses, rig_digests)
    inputs = {f"rig {name}": (file.rigs[name].name, digest) for name, digest in rig_digests.items()}

    def write(connection: Connection) -> WorldReport:
        run.inputs(connection, inputs)
        newest = [row for row in store.rows(connection, "world/current") if row.name == file.world]
        if newest and newest[0].content_key == content_key:
            world_id, revision, status = int(newest[0].world_id), int(newest[0].revision), "unchanged"
        else:
            revision, status = (int(newest[0].revision) + 1 if newest else 1), "added"
            progress(f"{file.path.name}: placing its objects", 0, 1)
            previous = int(newest[0].world_id) if newest else None
            world_id = _write_world(run, connection, file.world, revision, content_key, previous)
            numbers = _numbers(run, connection, file, pinned)
            placed = zip(numbers, file.objects, pinned, poses, robots, values, strict=True)
            _write_objects(run, connection, file.world, starmap(_Standing, placed), revision)
            _write_mounts(run, connection, file, link_paths, numbers, write_rig, revision)
        size = store.rows(connection, "world/size", world_id=world_id)[0]
        run.finish(f"world {file.world} revision {revision} {status}", connection)
        return WorldReport(run.id, file.world, world_id, revision, status, int(size.objects), int(size.parts))

    return run.transact(write)


def place_in_own_worlds(store: Store, run: Run, objects: Sequence[Mapping[str, Any]]) -> list[tuple[int, str]]:
    """Identity and name of worlds in which loaded objects, rows of `object/newest`, stand alone, each at its origin,
    its joints at rest.  Such a world has revision 0, is never a current one, and is placed once."""
    return run.transact(lambda connection: [_place_in_own_world(store, run, connection, dict(row)) for row in objects])


def _place_in_own_world(store: Store, run: Run, connection: Connection, row: dict[str, Any]) -> tuple[int, str]:
    name = f"{row['name']} (variant {row['variant']}, revision {row['revision']}) alone"
    known = store.rows(connection, "world/own_world", name=name)
    if known:
        return int(known[0].world_id), name
    placed = PlacedObject(row["name"], row["variant"], row["name"], "inspected", np.eye(4), {}, 0.0)
    file, poses = WorldFile(Path(name), "", name, (placed,), {}, ()), [np.eye(4)]
    _refuse_cycles(store, connection, file, [row])
    robots = [Robots(store, connection, int(row["object_id"]))]
    world_id = int(store.new_ids(connection, "world", 1)[0])
    key = _content_key(file, [row], poses, {})
    run.append(connection, "world", {"id": [world_id], "name": name, "revision": 0, "content_key": key})
    numbers = _numbers(run, connection, file, [row])
    standing = _Standing(numbers[0], placed, row, poses[0], robots[0], _joint_values(file, 0, robots[0]))
    _write_objects(run, connection, name, [standing], 0)
    return world_id, name


def _pin(file: WorldFile, loaded: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The loaded variant, newest revision, of each object of the file."""
    by_name = {(row["name"], row["variant"]): row for row in loaded}
    pinned = []
    for placed in file.objects:
        row = by_name.get((placed.object, placed.variant))
        if row is None:
            known = [name + (f" (variant {variant})" if variant else "") for name, variant in by_name]
            asked = placed.object + (f" (variant {placed.variant})" if placed.variant else "")
            raise InputError(
                f"{file.path}: the object {asked} is not loaded: load it first, or name one of those that are: "
                + (", ".join(known) or "there are none")
            )
        pinned.append(row)
    return pinned


def _refuse_cycles(store: Store, connection: Connection, file: WorldFile, pinned: list[dict[str, Any]]) -> None:
    object_ids = sorted({int(row["object_id"]) for row in pinned})
    nesting = store.rows(connection, "object/nesting", object_ids=object_ids)
    inside: dict[int, list[int]] = {}
    for row in nesting:
        inside.setdefault(row.parent_id, []).append(row.child_id)
    try:
        TopologicalSorter(inside).prepare()
    except CycleError as error:
        name = min(row.name for row in nesting if row.parent_id in error.args[1])
        raise InputError(f"{file.path}: the object {name} contains itself: load it without the cycle") from error


def _joint_values(file: WorldFile, number: int, robots: Robots) -> dict[str, dict[str, float]]:
    """Where the joints of the robots in an object of the file stand, by robot."""
    placed = file.objects[number]
    if placed.joints and not robots.trees:
        raise InputError(
            f"{file.path}: objects[{number}] gives joints of {placed.object}, which has none: leave them out"
        )
    return robots.values(placed.joints, f"{file.path}: joints of objects[{number}]")


def _link_paths(
    store: Store, connection: Connection, file: WorldFile, pinned: list[dict[str, Any]], robots: list[Robots]
) -> list[str | None]:
    """Path of the link of each mount in the object that carries it, as in occurrence; None where it names no link.

    Raises InputError where the object has no such link, or several.
    """
    paths: list[str | None] = []
    numbers = {placed.name: number for number, placed in enumerate(file.objects)}
    for i, mount in enumerate(file.mounts):
        if mount.link is None:
            paths.append(None)
            continue
        object_id = pinned[numbers[mount.on]]["object_id"]
        found = robots[numbers[mount.on]]
        robot, name, times = found.link(store, connection, object_id, mount.link)
        if times != 1:
            links = [row.name for row in store.rows(connection, "object/links", object_id=object_id)]
            raise InputError(
                f"{file.path}: mounts[{i}] names the link {mount.link!r}, which {mount.on!r} has "
                f"{times} times: name one of {', '.join(dict.fromkeys(links)) or 'none'}"
            )
        links_of = store.rows(connection, "object/links", object_id=found.object_id.get(robot, object_id))
        segment = next(row.segment for row in links_of if row.name == name)
        paths.append(f"{robot}/{segment}" if robot else segment)
    return paths


def _poses(
    store: Store,
    connection: Connection,
    file: WorldFile,
    pinned: list[dict[str, Any]],
    robots: list[Robots],
    values: list[dict[str, dict[str, float]]],
) -> list[Floats]:
    """`world_from_object` (4, 4) of each object of the file: as it says, or by its carrier at the joint values."""
    numbers = {placed.name: number for number, placed in enumerate(file.objects)}
    poses = {number: o.world_from_object for number, o in enumerate(file.objects) if o.world_from_object is not None}
    waiting = dict(file.carried)
    while waiting:  # mounts go in no circle, so each turn places one at least
        for name, mount in [(name, mount) for name, mount in waiting.items() if numbers[mount.on] in poses]:
            carrier = numbers[mount.on]
            object_id = pinned[carrier]["object_id"]
            link = robots[carrier].frame(store, connection, object_id, mount.link, values[carrier])
            carrier_from_link = link.object_from_robot @ link.robot_from_link
            poses[numbers[name]] = poses[carrier] @ carrier_from_link @ mount.carrier_from_mounted
            del waiting[name]
    return [poses[number] for number in range(len(file.objects))]


def _content_key(
    file: WorldFile, pinned: list[dict[str, Any]], poses: list[Floats], rig_digests: Mapping[str, str]
) -> str:
    """Hash of what the file says, of the content of the objects it names and of the rig files."""
    content = {
        "objects": [
            [
                o.name,
                o.role,
                dict(o.joints),
                o.tolerance_mm,
                row["name"],
                row["variant"],
                row["revision"],
                row["content_key"],
            ]
            for o, row in zip(file.objects, pinned, strict=True)
        ],
        "poses": np.array(poses).tobytes().hex(),
        "rigs": dict(sorted(rig_digests.items())),
        "mounts": [[m.kind, m.name, m.on, m.link, m.carrier_from_mounted.tolist()] for m in file.mounts],
    }
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def _write_world(
    run: Run, connection: Connection, name: str, revision: int, content_key: str, previous: int | None
) -> int:
    world_id = int(run.store.new_ids(connection, "world", 1)[0])
    row: dict[str, Any] = {"id": [world_id], "name": name, "revision": revision, "content_key": content_key}
    run.append(connection, "world", row)
    if previous is not None:
        run.insert(connection, "world_attribute", "world/keep_attributes", world_id=world_id, previous=previous)
    return world_id


def _numbers(run: Run, connection: Connection, file: WorldFile, pinned: list[dict[str, Any]]) -> list[int]:
    """`object_no` of each object of the file: the one that it ever had in this world, or a new one."""
    rows = run.store.rows(connection, "world/known_objects", world=file.world)
    known = {(row.name, int(row.object_id)): int(row.object_no) for row in rows}
    placed = [(o.name, int(row["object_id"])) for o, row in zip(file.objects, pinned, strict=True)]
    new = [one for one in placed if one not in known]
    ids = run.store.new_ids(connection, "placed_object", len(new)).tolist()
    names, object_ids = [name for name, _ in new], [object_id for _, object_id in new]
    columns: Columns = {"object_no": ids, "world": file.world, "name": names, "object_id": object_ids}
    run.append(connection, "placed_object", columns)
    known |= dict(zip(new, ids, strict=True))
    return [known[one] for one in placed]


@dataclass(frozen=True)
class _Standing:
    """An object of a world: its `object_no`, what the file says, the row of its variant, and how it stands."""

    number: int
    placed: PlacedObject
    row: Mapping[str, Any]
    pose: Floats
    robots: Robots
    joints: dict[str, dict[str, float]]


def _write_objects(run: Run, connection: Connection, world: str, objects: Iterable[_Standing], revision: int) -> None:
    """Write where objects, links and joints stand, of those objects of which something stands otherwise than before."""
    store, objects = run.store, list(objects)
    within = _bodies(store, connection, sorted({int(o.row["object_id"]) for o in objects}))
    bodies: list[tuple[Any, ...]] = []
    boxes: list[tuple[float, ...]] = []  # in the bodies' frames
    joints: list[tuple[Any, ...]] = []
    for o in objects:
        links = o.robots.links(store, connection, o.joints)
        for body_no, path, box in within[int(o.row["object_id"])]:
            world_from_body = o.pose @ links[path] if path else o.pose
            said = (o.number, body_no, int(o.row["object_variant_id"]), o.placed.role, o.placed.tolerance_mm)
            bodies.append((*said, *world_from_body[:3].ravel().tolist()))
            boxes.append(box)
        joints += [(o.number, robot, name, state[name]) for robot, state in o.joints.items() for name in sorted(state)]

    before = {tuple(row) for row in store.rows(connection, "world/current_bodies", world=world)}
    joints_before = {tuple(row) for row in store.rows(connection, "world/current_joints", world=world)}
    changed = {row[0] for row in before.symmetric_difference(bodies) | joints_before.symmetric_difference(joints)}
    ended = {"object_nos": store.array(sorted(changed)), "revision": revision}
    connection.execute(sql.query("world/end_bodies"), ended)
    connection.execute(sql.query("world/end_joints"), ended)

    kept: dict[str, Any] = {"first_revision": revision}
    rows = [i for i, row in enumerate(bodies) if row[0] in changed]
    if rows:
        columns = by_column(_BODY, [bodies[i] for i in rows])
        carried = boxes_carried(matrices(columns), np.array([boxes[i] for i in rows], float))
        carried += np.repeat([-_ROUND_OFF_MM, _ROUND_OFF_MM], 3)
        run.append(connection, "placed_body", kept | columns | dict(zip(BOX_COLUMNS, carried.T, strict=True)))
    moved = [row for row in joints if row[0] in changed]
    run.append(connection, "joint_state", kept | by_column("object_no robot joint value", moved))


def _bodies(
    store: Database, connection: Connection, object_ids: list[int]
) -> dict[int, list[tuple[int, str, tuple[float, ...]]]]:
    """Of each object its bodies: number, path of the link in it (empty: itself) and the box around its parts."""
    bodies: dict[int, list[tuple[int, str, tuple[float, ...]]]] = {number: [] for number in object_ids}
    for row in store.rows(connection, "world/bodies", object_ids=store.array(object_ids)):
        bodies[int(row.object_id)].append((int(row.body_no), row.path, tuple(row[3:])))
    return bodies


def _write_mounts(
    run: Run,
    connection: Connection,
    file: WorldFile,
    link_paths: list[str | None],
    numbers: list[int],
    write_rig: RigWriter | None,
    revision: int,
) -> None:
    rig_ids = {name: write_rig(run, connection, name, path) for name, path in file.rigs.items() if write_rig}
    number = {o.name: no for o, no in zip(file.objects, numbers, strict=True)}
    mounts = [
        (
            no,
            m.name,
            number[m.on],
            m.link,
            path,
            rig_ids[m.name] if m.kind == "rig" else None,
            number[m.name] if m.kind == "object" else None,
            *m.carrier_from_mounted[:3].ravel().tolist(),
        )
        for no, (m, path) in enumerate(zip(file.mounts, link_paths, strict=True))
    ]
    kept = {tuple(row) for row in run.store.rows(connection, "world/current_mounts", world=file.world)}
    ended = {row[0] for row in kept.difference(mounts)}
    if ended:
        mount_nos = run.store.array(sorted(ended))
        gone = {"world": file.world, "mount_nos": mount_nos, "revision": revision}
        connection.execute(sql.query("world/end_mounts"), gone)
    new = [row for row in mounts if row not in kept]
    if new:
        columns = by_column(_MOUNT, new)
        run.append(connection, "world_mount", {"world": file.world, "first_revision": revision, **columns})
