"""Standpoints from which rigs took pictures of an unmoving object, as a file or a call lists them."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from relmodel.arrays import Floats
from relmodel.errors import InputError
from relmodel.names import read_csv
from vision.cameras.cameras import BETWEEN
from vision.cameras.files import parse_covariance, read_world_from_rig
from vision.cameras.images import OnePicture
from vision.cameras.rig_file import member, numbers, read_yaml

Standpoints = str | Path | Sequence[Mapping[str, Any]]
"""A CSV or YAML file, or what its entries hold."""

COLUMNS = ("name", "on", "pose", "joints", "sigma_mm", "sigma_deg")  # all others are cameras


@dataclass(frozen=True)
class GivenStandpoint:
    """An entry: pictures by camera; world_from_rig (4, 4), None where joints say where the world has the rig; on: the
    object that carried it, empty where that is as the call says."""

    name: str
    pictures: dict[str, OnePicture]
    world_from_rig: Floats | None
    covariance: Floats
    joints: dict[str, float]
    ignored: bool
    on: str = ""


def read_standpoints(given: Standpoints, ignored: Collection[str] = ()) -> list[GivenStandpoint]:
    """The entries of a list of standpoints; ignored: names of those to be left out.

    Raises InputError, which names the standpoint, where one lacks something, and where fewer than two are left."""
    place, folder, entries = Path("standpoints"), Path(), given
    if isinstance(given, str | Path):
        place = Path(given)
        folder, is_csv = place.parent, place.suffix.lower() not in (".yaml", ".yml", ".json")
        entries = _read_csv(place) if is_csv else member(read_yaml(place, "standpoints"), "standpoints", place, "")
    if not isinstance(entries, list | tuple) or not all(isinstance(it, Mapping) for it in entries):
        raise InputError(f"{place}: 'standpoints' is no list of mappings: give each name, pictures, pose and sigma")
    found = [_parse(dict(it), place, folder, number, ignored) for number, it in enumerate(entries, 1)]
    names = [it.name for it in found]
    if twice := [name for name in names if names.count(name) > 1]:
        raise InputError(f"{place}: two standpoints are named {twice[0]}: give each its own name")
    if unknown := [name for name in ignored if name not in names]:
        raise InputError(f"{place} has no standpoint {unknown[0]} to be left out (it has {', '.join(names)})")
    if len([it for it in found if not it.ignored]) < 2:
        raise InputError(f"{place}: fewer than two standpoints are left: give pictures from two or more")
    return found


def pictures_of(standpoints: Sequence[GivenStandpoint]) -> dict[str, OnePicture]:
    """The pictures of all that are not ignored, by STANDPOINT/CAMERA."""
    used = [it for it in standpoints if not it.ignored]
    return {f"{it.name}{BETWEEN}{camera}": picture for it in used for camera, picture in it.pictures.items()}


def _parse(entry: dict[str, Any], place: Path, folder: Path, number: int, ignored: Collection[str]) -> GivenStandpoint:
    name = str(entry.get("name") or number)
    where = Path(f"{place}: standpoint {name}")
    if BETWEEN in name:
        raise InputError(f"{where}: a name holds {BETWEEN}: leave that out")
    listed = dict(member(entry, "pictures", where, ""))
    pictures = {str(camera): folder / it if isinstance(it, str) else it for camera, it in listed.items()}
    if not pictures:
        raise InputError(f"{where} has no picture: name one under its camera")
    if entry.get("pose"):
        entry = read_yaml(folder / entry["pose"], "pose") | entry
    given = dict(entry.get("joints") or {})
    joints = {str(joint): float(numbers(given, joint, where, "joints.", ())) for joint in given}
    if ("world_from_rig" in entry) == bool(joints):
        raise InputError(f"{where}: say where the rig stood by world_from_rig, or by the joints of what carries it")
    if "sigma" not in entry and "covariance" not in entry:
        raise InputError(f"{where} does not say how well it is known: give its sigma, as the repeatability of the arm")
    pose = None if joints else read_world_from_rig(entry, where)
    covariance, on = parse_covariance(entry, where), str(entry.get("on") or "")
    return GivenStandpoint(name, pictures, pose, covariance, joints, name in ignored, on)


def _read_csv(file: Path) -> list[dict[str, Any]]:
    """The lines of a table of standpoints as entries of a list of them."""
    rows, entries = read_csv(file, "standpoints file"), []
    names = next(rows, ("", []))[1]
    for _, row in rows:
        cells = {name: cell for name, cell in zip(names, row, strict=False) if cell}
        entry: dict[str, Any] = {"pictures": {key: cell for key, cell in cells.items() if key not in COLUMNS}}
        entry |= {name: cells.get(name) for name in ("name", "on", "pose")}
        entry["joints"] = dict(word.partition("=")[::2] for word in cells.get("joints", "").split())
        if "sigma_mm" in cells or "sigma_deg" in cells:
            entry["sigma"] = {"translation_mm": cells.get("sigma_mm"), "rotation_deg": cells.get("sigma_deg")}
        entries.append(entry)
    return entries
