"""Placing a world: from a world file to a revision of the world.

A revision writes what changed: the rows of an object that moved, or of a robot whose joints did, end with the revision
before, and new ones begin.  What stands in an object is expanded when the object is loaded, and is no part of it."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from graphlib import CycleError, TopologicalSorter
from pathlib import Path
from typing import Any

import numpy as np
from sqlalchemy import Connection

from relmodel.arrays import Floats, by_column
from relmodel.errors import InputError, UsageError
from relmodel.geometry.curves import box_columns
from relmodel.geometry.transforms import MATRIX_COLUMNS, boxes_carried, matrices
from relmodel.names import read_bytes
from relmodel.progress import Progress, silent
from relmodel.store import Run, Store, digest_inputs, sql
from relmodel.world.kinematics import Robots
from relmodel.world.world_file import PlacedObject, WorldFile, read_world_file

_BODY = f"object_no body_no object_variant_id role tolerance_mm {' '.join(MATRIX_COLUMNS)}"
_MOUNT = f"mount_no name object_no link object_path rig_id mounted_no {' '.join(MATRIX_COLUMNS)}"
_PINNED = ("name", "variant", "revision", "content_key")  # what names a loaded variant, and its content
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
    an object contains itself; the store's worlds are then as they were."""
    with Run.begin(
        store, "world", {"file": Path(path).name}, inputs=digest_inputs({"world": path}), packages=("numpy",)
    ) as run:
        return _place(store, run, read_world_file(path), write_rig, progress)


def _place(store: Store, run: Run, file: WorldFile, write_rig: RigWriter | None, progress: Progress) -> WorldReport:
    progress(f"{file.path.name}: finding its objects", 0, 1)
    if write_rig is None and any(mount.kind == "rig" for mount in file.mounts):
        raise UsageError(f"{file.path} mounts rigs: place it with a writer of rigs")
    with store.read() as connection:
        loaded = [dict(row._mapping) for row in store.rows(connection, "object/newest", run=None)]
        objects = _standing(store, connection, file, loaded)
    link_paths, poses = _link_paths(file, objects), _poses(file, objects)
    rig_digests = {name: hashlib.sha256(read_bytes(rig, "rig file")).hexdigest() for name, rig in file.rigs.items()}
    content_key = _content_key(file, objects, poses, rig_digests)
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
            numbers = _write_objects(run, connection, file.world, objects, poses, revision)
            _write_mounts(run, connection, file, link_paths, numbers, write_rig, revision)
        size = store.rows(connection, "world/size", world_id=world_id)[0]
        run.finish(f"world {file.world} revision {revision} {status}", connection)
        return WorldReport(run.id, file.world, world_id, revision, status, int(size.objects), int(size.parts))

    return run.transact(write)


def place_in_own_worlds(store: Store, run: Run, objects: Sequence[Mapping[str, Any]]) -> list[tuple[int, str]]:
    """Identity and name of worlds in which loaded objects, rows of `object/newest`, stand alone, each at its origin,
    its joints at rest.  Such a world has revision 0, is never a current one, and is placed once."""
    return run.transact(lambda connection: [_place_in_own_world(store, run, connection, row) for row in objects])


def _place_in_own_world(store: Store, run: Run, connection: Connection, row: Mapping[str, Any]) -> tuple[int, str]:
    name = f"{row['name']} (variant {row['variant']}, revision {row['revision']}) alone"
    known = store.select(connection, "world", "id", name=name, revision=0)["id"]
    if len(known):
        return int(known[0]), name
    placed = PlacedObject(row["name"], row["variant"], row["name"], "inspected", np.eye(4), {}, 0.0)
    file, poses = WorldFile(Path(name), name, (placed,), {}, ()), [np.eye(4)]
    objects = _standing(store, connection, file, [row])
    world_id = _write_world(run, connection, name, 0, _content_key(file, objects, poses, {}), None)
    _write_objects(run, connection, name, objects, poses, 0)
    return world_id, name


@dataclass(frozen=True)
class _WorldObject:
    """An object of a world: what the file says, the row of its variant, its robots, and where their joints stand."""

    placed: PlacedObject
    row: Mapping[str, Any]
    robots: Robots
    joints: dict[str, dict[str, float]]


def _standing(
    store: Store, connection: Connection, file: WorldFile, loaded: Sequence[Mapping[str, Any]]
) -> list[_WorldObject]:
    """The objects of the file, each pinned to one of the loaded variants, rows of `object/newest`."""
    pinned = _pin(file, loaded)
    _refuse_cycles(store, connection, file, pinned)
    robots = {number: Robots(store, connection, number) for number in {row["object_id"] for row in pinned}}
    objects = []
    for number, (placed, row) in enumerate(zip(file.objects, pinned, strict=True)):
        own = robots[row["object_id"]]
        if placed.joints and not own.trees:
            raise InputError(
                f"{file.path}: objects[{number}] gives joints of {placed.object}, which has none: leave them out"
            )
        values = own.values(placed.joints, f"{file.path}: joints of objects[{number}]")
        objects.append(_WorldObject(placed, row, own, values))
    return objects


def _pin(file: WorldFile, loaded: Sequence[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
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


def _refuse_cycles(store: Store, connection: Connection, file: WorldFile, pinned: Sequence[Mapping[str, Any]]) -> None:
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


def _link_paths(file: WorldFile, objects: Sequence[_WorldObject]) -> list[str | None]:
    """Path of the link of each mount in the object that carries it, as in occurrence; None where it names no link.
    Raises InputError where the object has no such link, or several."""
    paths: list[str | None] = []
    robots_of = {o.placed.name: o.robots for o in objects}
    for i, mount in enumerate(file.mounts):
        if mount.link is None:
            paths.append(None)
            continue
        robot, links = robots_of[mount.on].links_named(mount.link)
        if len(links) != 1:
            known = ", ".join(dict.fromkeys(robots_of[mount.on].link_names))
            raise InputError(
                f"{file.path}: mounts[{i}] names the link {mount.link!r}, which {mount.on!r} has "
                f"{len(links)} times: name one of {known or 'none'}"
            )
        paths.append(f"{robot}/{links[0].segment}" if robot else links[0].segment)
    return paths


def _poses(file: WorldFile, objects: Sequence[_WorldObject]) -> list[Floats]:
    """`world_from_object` (4, 4) of each object of the file: as it says, or by its carrier at the joint values."""
    poses = {o.name: o.world_from_object for o in file.objects if o.world_from_object is not None}
    of = {o.placed.name: o for o in objects}
    waiting = {mount.name: mount for mount in file.mounts if mount.kind == "object"}
    while waiting:  # mounts go in no circle, so each turn places one at least
        for name, mount in [(name, mount) for name, mount in waiting.items() if mount.on in poses]:
            link = of[mount.on].robots.frame(mount.link, of[mount.on].joints)
            carrier_from_link = link.object_from_robot @ link.robot_from_link
            poses[name] = poses[mount.on] @ carrier_from_link @ mount.carrier_from_mounted
            del waiting[name]
    return [poses[o.name] for o in file.objects]


def _content_key(
    file: WorldFile, objects: Sequence[_WorldObject], poses: list[Floats], rig_digests: Mapping[str, str]
) -> str:
    """Hash of what the file says, of the content of the objects it names and of the rig files."""
    content = {
        "objects": [
            [p.name, p.role, dict(p.joints), p.tolerance_mm, *(row[c] for c in _PINNED)]
            for p, row in ((o.placed, o.row) for o in objects)
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
        run.store.insert(connection, "world_attribute", "world/keep_attributes", world_id=world_id, previous=previous)
    return world_id


def _write_objects(
    run: Run,
    connection: Connection,
    world: str,
    objects: Sequence[_WorldObject],
    poses: Sequence[Floats],
    revision: int,
) -> dict[str, int]:
    """Write where objects, links and joints stand, of those objects of which something stands otherwise than before.
    Returns the `object_no` of each by its name: the one that it ever had in this world, or a new one."""
    store = run.store
    held = store.select(connection, "placed_object", "name", "object_id", "object_no", world=world)
    rows = zip(*(column.tolist() for column in held.values()), strict=True)
    known = {(name, object_id): number for name, object_id, number in rows}
    named = [(o.placed.name, int(o.row["object_id"])) for o in objects]
    new = [one for one in named if one not in known]
    ids = store.new_ids(connection, "placed_object", len(new)).tolist()
    numbered = by_column("object_no name object_id", [(number, *one) for number, one in zip(ids, new, strict=True)])
    run.append(connection, "placed_object", {"world": world, **numbered})
    known |= dict(zip(new, ids, strict=True))

    within: dict[int, list[Any]] = {}
    object_ids = store.array(sorted({object_id for _, object_id in named}))
    for row in store.rows(connection, "world/bodies", object_ids=object_ids):
        within.setdefault(int(row.object_id), []).append(row)
    bodies: list[tuple[Any, ...]] = []
    boxes: list[tuple[float, ...]] = []  # in the bodies' frames
    joints: list[tuple[Any, ...]] = []
    for o, one, pose in zip(objects, named, poses, strict=True):
        links, number = o.robots.links(o.joints), known[one]
        for _, body_no, path, *box in within.get(one[1], ()):
            world_from_body = pose @ links[path] if path else pose
            said = (number, int(body_no), int(o.row["object_variant_id"]), o.placed.role, o.placed.tolerance_mm)
            bodies.append((*said, *world_from_body[:3].ravel().tolist()))
            boxes.append(tuple(box))
        joints += [(number, robot, name, state[name]) for robot, state in o.joints.items() for name in sorted(state)]

    before = {tuple(row) for row in store.rows(connection, "world/current_bodies", world=world)}
    joints_before = {tuple(row) for row in store.rows(connection, "world/current_joints", world=world)}
    changed = {row[0] for row in before.symmetric_difference(bodies) | joints_before.symmetric_difference(joints)}
    ended = {"object_nos": store.array(sorted(changed)), "revision": revision}
    connection.execute(sql.query("world/end_bodies"), ended)
    connection.execute(sql.query("world/end_joints"), ended)

    kept: dict[str, Any] = {"first_revision": revision}
    written = [i for i, row in enumerate(bodies) if row[0] in changed]
    columns = by_column(_BODY, [bodies[i] for i in written])
    carried = boxes_carried(matrices(columns), np.array([boxes[i] for i in written], float).reshape(-1, 6))
    carried += np.repeat([-_ROUND_OFF_MM, _ROUND_OFF_MM], 3)
    run.append(connection, "placed_body", kept | columns | box_columns(carried))
    moved = [row for row in joints if row[0] in changed]
    run.append(connection, "joint_state", kept | by_column("object_no robot joint value", moved))
    return {name: known[name, object_id] for name, object_id in named}


def _write_mounts(
    run: Run,
    connection: Connection,
    file: WorldFile,
    link_paths: list[str | None],
    number: Mapping[str, int],
    write_rig: RigWriter | None,
    revision: int,
) -> None:
    rig_ids = {name: write_rig(run, connection, name, path) for name, path in file.rigs.items() if write_rig}
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
    mount_nos = run.store.array(sorted({row[0] for row in kept.difference(mounts)}))
    gone = {"world": file.world, "mount_nos": mount_nos, "revision": revision}
    connection.execute(sql.query("world/end_mounts"), gone)
    new = by_column(_MOUNT, [row for row in mounts if row not in kept])
    run.append(connection, "world_mount", {"world": file.world, "first_revision": revision, **new})
