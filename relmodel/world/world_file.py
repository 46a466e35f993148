"""The world file: YAML that says which objects stand in a cell, in which role and where, and what is mounted on them.

Where a program writes one of a thousand objects, as JSON it is read much faster.

world: cell
objects:
  - object: bulkhead            # name it was loaded under
    variant: b                  # default: the object's plain variant
    name: workpiece             # default: the object's name
    role: inspected             # inspected (default), fixture, robot or tool
    tolerance_mm: 0.1           # standard deviation of where its edges are from where the model has them; default 0
    world_from_object: [[1, 0, 0, 250], [0, 1, 0, 0], [0, 0, 1, 80], [0, 0, 0, 1]]    # mm; default identity
  - object: arm
    role: robot
    joints: {travel: 400, shoulder_deg: 35, elbow: 1.2}    # mm, degrees where the name ends in _deg, rad; default rest
    # of a robot nested in the object: ROBOT/JOINT, with the path of the robot in it; so with the link of a mount
rigs:
  - {name: head, file: head.yaml}
mounts:
  - {rig: head, on: arm, link: flange, carrier_from_rig: [...]}    # link and transform may be left out
  - {object: gripper, on: arm, link: flange, carrier_from_object: [...]}    # an object by its name in this file, which
    # then has no world_from_object: it goes where the link goes"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any, Literal

import numpy as np

from relmodel.arrays import Floats
from relmodel.errors import InputError
from relmodel.geometry.transforms import nearest_rotation
from relmodel.names import MOST_NAME_BYTES, json_mapping, read_bytes

ROLES = ("inspected", "fixture", "robot", "tool")

# Numbers typed with six digits are off by some 1e-6 and are taken for the nearest rotation; more is a mistake.
_ROTATION_TOLERANCE = 1e-4
_ROUND_OFF = 1e-9
_MOST_TOLERANCE_MM = 50.0  # a model less sure than this places nothing
_MOST_MM = 1e8  # farther off, millimetres are lost to rounding


@dataclass(frozen=True)
class PlacedObject:
    """An object as the world file places it."""

    object: str
    variant: str
    name: str
    role: str
    world_from_object: Floats | None  # (4, 4), mm; None: it is mounted
    joints: Mapping[str, float]  # as typed: mm, rad, or degrees where the name ends in _deg
    tolerance_mm: float  # one standard deviation, across an edge


@dataclass(frozen=True)
class Mount:
    """A rig or a placed object fixed to a placed object or to a link of it."""

    kind: Literal["rig", "object"]
    name: str  # of the rig or object
    on: str
    link: str | None
    carrier_from_mounted: Floats  # (4, 4), mm


@dataclass(frozen=True)
class WorldFile:
    """What a world file says; all names in it are known to each other, all transforms are rigid."""

    path: Path
    world: str
    objects: tuple[PlacedObject, ...]
    rigs: Mapping[str, Path]
    mounts: tuple[Mount, ...]


def read_world_file(path: str | Path) -> WorldFile:
    """Read and check a world file.  Raises InputError that says what is wrong, where, and the cure."""
    path = Path(path)
    data = _read_yaml(path)
    _known_keys(data, ("world", "objects", "rigs", "mounts"), path, "the file")
    world = _text(data, "world", path, "the file")
    if len(world.encode(errors="replace")) > MOST_NAME_BYTES:
        raise InputError(f"{path}: the name of the world is over {MOST_NAME_BYTES} bytes: shorten it")
    entries = _list(data, "objects", path)
    if not entries:
        raise InputError(f"{path}: objects is missing or empty: list the objects that stand in the world")
    mount_entries = _list(data, "mounts", path)
    mounted = {str(entry["object"]) for entry in mount_entries if isinstance(entry, dict) and "object" in entry}
    objects = tuple(_placed_object(entry, path, f"objects[{i}]", mounted) for i, entry in enumerate(entries))
    _unique([o.name for o in objects], path, "objects", "give one of them another name")

    rigs: dict[str, Path] = {}
    rig_entries = _list(data, "rigs", path)
    for i, entry in enumerate(rig_entries):
        where = f"rigs[{i}]"
        _known_keys(entry, ("name", "file"), path, where)
        rigs[_text(entry, "name", path, where)] = _inside(path, _text(entry, "file", path, where), where)
    _unique([str(entry["name"]) for entry in rig_entries], path, "rigs", "give one of them another name")
    mounts = tuple(
        _mount(entry, path, f"mounts[{i}]", rigs, [o.name for o in objects]) for i, entry in enumerate(mount_entries)
    )
    _unique([m.name for m in mounts if m.kind == "object"], path, "mounts", "mount an object once")
    _refuse_circles(mounts, path)
    return WorldFile(path, world, objects, rigs, mounts)


def _read_yaml(path: Path) -> dict[str, Any]:
    import yaml

    class Loader(yaml.SafeLoader):
        """YAML without booleans: the file has none, and YAML 1.1 would read the key `on` as one."""

        yaml_implicit_resolvers = {  # noqa: RUF012
            first: [(tag, pattern) for tag, pattern in resolvers if tag != "tag:yaml.org,2002:bool"]
            for first, resolvers in yaml.SafeLoader.yaml_implicit_resolvers.items()
        }

        def construct_mapping(self, node: Any, deep: bool = False) -> dict[Any, Any]:
            keys = [key.value for key, _ in node.value]
            for i, key in enumerate(keys):
                if key in keys[:i]:  # yaml would keep the last
                    line = node.value[i][0].start_mark.line + 1
                    raise InputError(f"the world file {path} has the key {key!r} twice, at line {line}: remove one")
            return super().construct_mapping(node, deep)

    try:
        text = read_bytes(path, "world file").decode("utf-8-sig")
        data = json_mapping(text) or yaml.load(text, Loader)
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        mark = getattr(error, "problem_mark", None)
        at = f" at line {mark.line + 1}" if mark else ""
        raise InputError(f"the world file {path} is not valid YAML{at}: correct it there") from error
    if not isinstance(data, dict):
        raise InputError(f"the world file {path} is not a mapping: it needs the keys world and objects")
    return data


def _placed_object(entry: Any, path: Path, where: str, mounted: set[str]) -> PlacedObject:
    _known_keys(
        entry, ("object", "variant", "name", "role", "world_from_object", "joints", "tolerance_mm"), path, where
    )
    name = _text(entry, "object", path, where)
    instance = _text(entry, "name", path, where, name)
    if "/" in instance:
        raise InputError(
            f"{path}: {where} has the name {instance!r} with a slash, which separates names in paths: rename it"
        )
    role = _text(entry, "role", path, where, "inspected")
    if role not in ROLES:
        raise InputError(f"{path}: {where} has the unknown role {role!r}: use one of {', '.join(ROLES)}")
    pose = None if instance in mounted else _rigid(entry, "world_from_object", path, where)
    if pose is None and entry.get("world_from_object") is not None:
        raise InputError(
            f"{path}: {where} has a world_from_object, and {instance!r} is among the mounts too: leave one of them out"
        )
    variant, joints = _text(entry, "variant", path, where, ""), _joint_values(entry, path, where)
    return PlacedObject(name, variant, instance, role, pose, joints, _tolerance(entry, path, where))


def _tolerance(entry: dict[str, Any], path: Path, where: str) -> float:
    value = entry.get("tolerance_mm", 0.0)
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 <= value <= _MOST_TOLERANCE_MM:
        raise InputError(
            f"{path}: tolerance_mm of {where} is {value!r}: give one standard deviation, 0 to {_MOST_TOLERANCE_MM:g} mm"
        )
    return float(value)


def _joint_values(entry: dict[str, Any], path: Path, where: str) -> dict[str, float]:
    given = entry.get("joints")
    if given is None:
        return {}
    if not isinstance(given, dict):
        raise InputError(f"{path}: joints of {where} is not a mapping: give name: value for each joint")
    out = {}
    for name, value in given.items():
        if isinstance(value, bool) or not isinstance(value, int | float) or not np.isfinite(value):
            raise InputError(f"{path}: joint {name} of {where} is {value!r}: give a number")
        out[str(name)] = float(value)
    return out


def _mount(entry: Any, path: Path, where: str, rigs: Mapping[str, Path], objects: list[str]) -> Mount:
    kind: Literal["rig", "object"] = "object" if isinstance(entry, dict) and "object" in entry else "rig"
    _known_keys(entry, (kind, "on", "link", f"carrier_from_{kind}"), path, where)
    name, on = _text(entry, kind, path, where), _text(entry, "on", path, where)
    known = rigs if kind == "rig" else objects
    if name not in known:
        raise InputError(
            f"{path}: {where} names the {kind} {name!r}, which is not among the file's {kind}s: {_listed(known)}"
        )
    if on not in objects:
        raise InputError(f"{path}: {where} is on {on!r}, which is not among the file's objects: {_listed(objects)}")
    link = _text(entry, "link", path, where) if entry.get("link") is not None else None
    return Mount(kind, name, on, link, _rigid(entry, f"carrier_from_{kind}", path, where))


def _refuse_circles(mounts: tuple[Mount, ...], path: Path) -> None:
    """Raise InputError where an object would stand on itself, directly or through others."""
    on = {mount.name: mount.on for mount in mounts if mount.kind == "object"}
    for name in on:
        way = [name]
        while way[-1] in on and way.count(way[-1]) == 1:
            way.append(on[way[-1]])
        if way[-1] == name:
            raise InputError(f"{path}: mounts form a cycle, {' on '.join(way)}: place one of them in the world")


def _known_keys(entry: Any, known: tuple[str, ...], path: Path, where: str) -> None:
    if not isinstance(entry, dict):
        raise InputError(f"{path}: {where} is not a mapping: it takes the keys {', '.join(known)}")
    unknown = [str(key) for key in entry if key not in known]
    if unknown:
        raise InputError(f"{path}: {where} has the unknown key {unknown[0]!r}: it takes {', '.join(known)}")


def _list(data: dict[str, Any], key: str, path: Path) -> list[Any]:
    value = data.get(key)
    if value is None:
        return []
    if not isinstance(value, list):
        raise InputError(f"{path}: {key} is not a list: begin each entry with a dash")
    return value


def _text(entry: dict[str, Any], key: str, path: Path, where: str, default: str | None = None) -> str:
    value = entry.get(key)
    if value is None:
        if default is None:
            raise InputError(f"{path}: {where} lacks {key}: add it")
        return default
    if isinstance(value, bool | list | dict) or not str(value).strip():
        raise InputError(f"{path}: {key} of {where} is {value!r}: give a name")
    return str(value)


def _rigid(entry: dict[str, Any], key: str, path: Path, where: str) -> Floats:
    value = entry.get(key)
    if value is None:
        return np.eye(4)
    what = f"{path}: {key} of {where}"
    try:
        matrix = np.array(value, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(f"{what} is not made of numbers: give four rows of four") from error
    if matrix.shape != (4, 4):
        raise InputError(f"{what} has the shape {matrix.shape}: give four rows of four numbers")
    if not np.isfinite(matrix).all():
        raise InputError(f"{what} holds a number that is not finite: correct it")
    if np.abs(matrix[:3, 3]).max() > _MOST_MM:
        raise InputError(f"{what} lies farther off than {_MOST_MM / 1e6:g} km: give its translation in mm")
    rotation = matrix[:3, :3]
    last, squared = np.abs(matrix[3] - [0, 0, 0, 1]).max(), np.abs(rotation.T @ rotation - np.eye(3)).max()
    off = float(max(squared, abs(np.linalg.det(rotation) - 1), last))
    if off > _ROTATION_TOLERANCE:
        raise InputError(
            f"{what} is not a rotation and a translation (off by {off:.3g}): its rows 0 to 2 must hold an orthonormal, "
            "right-handed 3x3 and a translation in mm, its last row 0 0 0 1"
        )
    if off > _ROUND_OFF:
        matrix[:3, :3] = nearest_rotation(matrix[:3, :3])
        matrix[3] = [0, 0, 0, 1]
    return matrix


def _inside(path: Path, name: str, where: str) -> Path:
    """The file that a world file refers to, which must lie in its folder or below."""
    folder = path.resolve().parent
    file = (folder / name).resolve()
    if not file.is_relative_to(folder):
        raise InputError(f"{path}: {where} refers to {name!r} outside the world file's folder: put the file there")
    if not file.is_file():
        raise InputError(f"{path}: {where} refers to {name!r}, which is not there: correct the name")
    return file


def _unique(names: list[str], path: Path, key: str, cure: str) -> None:
    ordered = sorted(names)
    twice = [name for name, following in pairwise(ordered) if name == following]
    if twice:
        raise InputError(f"{path}: {key} has the name {twice[0]!r} twice: {cure}")


def _listed(names: Any) -> str:
    return ", ".join(names) or "there are none"
