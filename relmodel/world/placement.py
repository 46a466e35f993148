"""Placing a world: from a world file to a revision of the world, its occurrences and their boxes in the store."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from sqlalchemy import Connection

from relmodel.arrays import Floats
from relmodel.errors import InputError, UsageError
from relmodel.geometry.transforms import matrix_columns
from relmodel.paths import read_bytes
from relmodel.progress import Progress, silent
from relmodel.store import Run, Store, digest_inputs, sql
from relmodel.world.kinematics import Robots
from relmodel.world.occurrences import write_occurrences
from relmodel.world.world_file import WorldFile, read_world_file

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
    progress(f"{file.path.name}: finding its objects", 0, 3)
    if write_rig is None and any(mount.kind == "rig" for mount in file.mounts):
        raise UsageError(f"{file.path} mounts rigs: place it with a writer of rigs")
    with store.read() as connection:
        pinned = _pin(file, [dict(row._mapping) for row in store.rows(connection, "newest_objects")])
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
        newest = [row for row in store.rows(connection, "current_worlds") if row.name == file.world]
        if newest and newest[0].content_key == content_key:
            world_id, revision, status = int(newest[0].id), int(newest[0].revision), "unchanged"
        else:
            revision, status = (int(newest[0].revision) + 1 if newest else 1), "added"
            progress(f"{file.path.name}: placing its objects", 1, 3)
            previous = int(newest[0].id) if newest else None
            world_id = _write_world(run, connection, file, pinned, poses, revision, content_key, previous)
            _write_joints(run, connection, world_id, robots, values)
            _write_mounts(run, connection, file, link_paths, world_id, write_rig)
            progress(f"{file.path.name}: expanding its objects to parts", 2, 3)
            write_occurrences(run, connection, world_id, previous)
        counts = {row.kind: int(row.occurrences) for row in store.rows(connection, "world_size", world_id=world_id)}
        run.finish(f"world {file.world} revision {revision} {status}", connection)
        objects, parts = counts.get("object", 0), counts.get("part", 0)
        return WorldReport(run.id, file.world, world_id, revision, status, objects=objects, parts=parts)

    return run.transact(write)


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
    cycles = [row.name for row in store.rows(connection, "object_cycles", object_ids=object_ids)]
    if cycles:
        raise InputError(f"{file.path}: the object {cycles[0]} contains itself: load it without the cycle")


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
            links = [row.name for row in store.rows(connection, "object_links", object_id=object_id)]
            raise InputError(
                f"{file.path}: mounts[{i}] names the link {mount.link!r}, which {mount.on!r} has "
                f"{times} times: name one of {', '.join(dict.fromkeys(links)) or 'none'}"
            )
        links_of = store.rows(connection, "object_links", object_id=found.object_id.get(robot, object_id))
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


def _write_joints(
    run: Run,
    connection: Connection,
    world_id: int,
    robots: list[Robots],
    values: list[dict[str, dict[str, float]]],
) -> None:
    """Write where joints stand, and the links that they place."""
    for number, found in enumerate(robots):
        for path, tree in found.trees.items():
            stand = values[number][path]
            owner = {"world_id": world_id, "object_no": number, "robot": path}
            if stand:
                names = sorted(stand)
                state = np.array([stand[name] for name in names])
                run.append(connection, "joint_state", {**owner, "joint": names, "value": state})
            poses = tree.poses(stand)
            links = run.store.rows(connection, "object_links", object_id=found.object_id[path])
            run.append(
                connection,
                "world_link",
                {
                    **owner,
                    "object_id": found.object_id[path],
                    "child_no": np.array([link.child_no for link in links]),
                    **matrix_columns(np.array([poses[link.name] for link in links])),
                },
            )


def _content_key(
    file: WorldFile, pinned: list[dict[str, Any]], poses: list[Floats], rig_digests: Mapping[str, str]
) -> str:
    """Hash of what the file says, of the content of the objects it names and of the rig files."""
    content = {
        "objects": [
            [
                o.name,
                o.role,
                pose.tolist(),
                dict(o.joints),
                o.tolerance_mm,
                row["name"],
                row["variant"],
                row["revision"],
                row["content_key"],
            ]
            for o, row, pose in zip(file.objects, pinned, poses, strict=True)
        ],
        "rigs": dict(sorted(rig_digests.items())),
        "mounts": [[m.kind, m.name, m.on, m.link, m.carrier_from_mounted.tolist()] for m in file.mounts],
    }
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def _write_world(
    run: Run,
    connection: Connection,
    file: WorldFile,
    pinned: list[dict[str, Any]],
    poses: list[Floats],
    revision: int,
    content_key: str,
    previous: int | None,
) -> int:
    world_id = int(run.store.new_ids(connection, "world", 1)[0])
    run.append(
        connection,
        "world",
        {"id": [world_id], "name": [file.world], "revision": [revision], "content_key": [content_key]},
    )
    newest: dict[str, Any] = {"name": file.world, "revision": revision, "content_key": content_key}
    if previous is None:
        run.append(connection, "current_world", {"id": [world_id], **newest})
    else:
        connection.execute(sql.query("current_world_change"), {"world_id": world_id, **newest})
        run.insert(connection, "world_attribute", "world_kept_attributes", world_id=world_id, previous=previous)
    run.append(
        connection,
        "world_object",
        {
            "world_id": world_id,
            "object_no": np.arange(len(file.objects)),
            "name": [o.name for o in file.objects],
            "object_variant_id": np.array([row["object_variant_id"] for row in pinned]),
            "role": [o.role for o in file.objects],
            "tolerance_mm": np.array([o.tolerance_mm for o in file.objects]),
            **matrix_columns(poses),
        },
    )
    return world_id


def _write_mounts(
    run: Run,
    connection: Connection,
    file: WorldFile,
    link_paths: list[str | None],
    world_id: int,
    write_rig: RigWriter | None,
) -> None:
    if not file.mounts:
        return
    rig_ids = {name: write_rig(run, connection, name, path) for name, path in file.rigs.items() if write_rig}
    object_no = {o.name: number for number, o in enumerate(file.objects)}
    run.append(
        connection,
        "world_mount",
        {
            "world_id": world_id,
            "mount_no": np.arange(len(file.mounts)),
            "name": [m.name for m in file.mounts],
            "object_no": np.array([object_no[m.on] for m in file.mounts]),
            "link": [m.link for m in file.mounts],
            "object_path": link_paths,
            "rig_id": [rig_ids[m.name] if m.kind == "rig" else None for m in file.mounts],
            "mounted_no": [object_no[m.name] if m.kind == "object" else None for m in file.mounts],
            **matrix_columns([m.carrier_from_mounted for m in file.mounts]),
        },
    )
