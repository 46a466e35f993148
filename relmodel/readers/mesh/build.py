"""The build of a 3MF file as a tree: its items, the components that these are made of, and the meshes of those.

After the 3MF Core Specification 1.3 (3.4, 4) and the Production Extension 1.1: objects may lie in several model files,
each of which has its own identifiers and unit.  Support and auxiliary objects (modifiers) are no parts.
"""

from __future__ import annotations

import zipfile
from array import array
from collections import Counter
from dataclasses import dataclass, field
from graphlib import CycleError, TopologicalSorter
from pathlib import Path
from urllib.parse import unquote
from xml.etree import ElementTree
from xml.parsers import expat

import numpy as np

from relmodel.arrays import Floats, Ints
from relmodel.errors import InputError
from relmodel.model.model import Finding
from relmodel.readers.formats import UNITS_MM, known_unit

_MOST_NODES = 100_000
_ROOT = "3d/3dmodel.model"  # unless the package names another
_NO_PARTS = ("support", "solidsupport", "other")

_Key = tuple[str, str]  # model file and identifier


@dataclass(frozen=True)
class Node:
    """A placed object: its key, that of its parent, its name (None: the key), that of its mesh, and where it stands."""

    key: str
    parent: str
    name: str | None
    mesh: str | None
    parent_from_node: Floats  # (4, 4), in the file's unit


@dataclass(frozen=True)
class NodeMesh:
    """A mesh that nodes share: vertices (n, 3) in the file's unit, triangles (m, 3), and #rrggbb where it has one."""

    vertices: Floats
    triangles: Ints
    colour: str | None = None


@dataclass(frozen=True)
class Build:
    """What a file places: nodes below the base, parents before children, and their meshes by unique names."""

    unit: str
    nodes: list[Node]
    meshes: dict[str, NodeMesh]
    findings: tuple[Finding, ...]
    base: str = ""


@dataclass
class _Object:
    name: str
    type: str
    mesh: str | None = None
    vertices: array[float] = field(default_factory=lambda: array("d"))
    triangles: array[int] = field(default_factory=lambda: array("q"))
    components: list[tuple[_Key, Floats]] = field(default_factory=list)


@dataclass
class _ModelFile:
    unit: str = "millimeter"
    objects: dict[_Key, _Object] = field(default_factory=dict)
    items: list[tuple[_Key, Floats, str | None]] = field(default_factory=list)
    refers: list[str] = field(default_factory=list)  # to model files


def read_build(path: Path) -> Build:
    """The build of a file.  Raises InputError where an object contains itself, the build places too many or a unit is
    unknown, and whatever its parsers raise."""
    from trimesh.util import unique_name

    root, *others = _model_files(path)
    objects: dict[_Key, _Object] = {}
    meshes: dict[str, NodeMesh] = {}
    counts: dict[str | None, int] = {}
    for file in (root, *others):
        scale = UNITS_MM[known_unit(path.name, file.unit)] / UNITS_MM[known_unit(path.name, root.unit)]
        objects |= file.objects
        for one in file.objects.values():
            for _, matrix in one.components:
                matrix[:3, 3] *= scale
            if one.mesh is not None:
                one.mesh = unique_name(one.mesh, meshes, counts)
                vertices = scale * np.array(one.vertices).reshape(-1, 3)
                meshes[one.mesh] = NodeMesh(vertices, np.array(one.triangles, np.int64).reshape(-1, 3))
    try:
        tuple(TopologicalSorter({i: [c for c, _ in o.components] for i, o in objects.items()}).static_order())
    except CycleError as error:
        raise InputError(f"object {error.args[1][0][1]} of {path.name} contains itself: mend the file") from error
    nodes: list[Node] = []
    left_out: Counter[str] = Counter()
    waiting = [("", key, matrix, name) for key, matrix, name in reversed(root.items)]
    while waiting:
        parent, key, matrix, name = waiting.pop()
        placed = objects.get(key)
        if placed is None:
            left_out[f"{key[0]} holds no object {key[1]}, which is placed"] += 1
        elif placed.mesh is not None and placed.type in _NO_PARTS:  # the type of one with components does not count
            left_out[f"an object of type {placed.type} is no part"] += 1
        else:
            nodes.append(Node(str(len(nodes)), parent, name or placed.name, placed.mesh, matrix))
            if len(nodes) > _MOST_NODES:
                raise InputError(f"{path.name} places more than {_MOST_NODES} objects: split it")
            waiting += [(nodes[-1].key, c, m, None) for c, m in reversed(placed.components)]
    findings = [Finding("left_out", f"{why}: left out, {n} in all", float(n), 0.0) for why, n in left_out.items()]
    return Build(root.unit, nodes, meshes, tuple(findings))


def _model_files(path: Path) -> list[_ModelFile]:
    """The root model of a package, and the models that hold objects which it places."""
    found: dict[str, _ModelFile] = {}
    with zipfile.ZipFile(path) as archive:
        entries = {_part_name(entry): entry for entry in archive.namelist()}
        waiting = [_root(archive, entries)]
        for file in waiting:  # which grows
            if file in entries and file not in found:
                found[file] = one = _parse(archive.read(entries[file]), file)
                waiting += one.refers
    return list(found.values())


def _root(archive: zipfile.ZipFile, entries: dict[str, str]) -> str:
    """The model that the package's relationships name, or the one of the usual name."""
    if "_rels/.rels" in entries:
        for relation in ElementTree.fromstring(archive.read(entries["_rels/.rels"])):
            if relation.get("Type", "").endswith("/3dmodel") and _part_name(relation.get("Target", "")) in entries:
                return _part_name(relation.get("Target", ""))
    return next(name for name in entries if _ROOT in name)


def _part_name(name: str) -> str:
    """Name of a part of a package; case does not count (ECMA-376-2, 6.2.2)."""
    return unquote(name).lstrip("/").lower()


def _parse(text: bytes, file: str) -> _ModelFile:
    """Objects and items of a model file."""
    found = _ModelFile()
    now = _Object("", "")
    core: str | None = None  # the namespace of the root, in which all lies that counts here

    def begin(tag: str, given: dict[str, str]) -> None:
        nonlocal now, core
        space, _, local = tag.rpartition(" ")
        if core is None:
            core = space
            found.unit = given.get("unit", found.unit)
        if space != core:
            return
        match local:
            case "vertex":
                now.vertices.extend((float(given["x"]), float(given["y"]), float(given["z"])))
            case "triangle":
                now.triangles.extend((int(given["v1"]), int(given["v2"]), int(given["v3"])))
            case "object":
                name = given.get("name") or given["id"]
                now = found.objects[file, given["id"]] = _Object(name, given.get("type", "model"))
            case "mesh":
                now.mesh = now.name
            case "component" | "item":
                path = next((value for key, value in given.items() if key.rpartition(" ")[2] == "path"), None)
                target = file if path is None else _part_name(path)
                found.refers.append(target)
                if local == "item":
                    found.items.append(((target, given["objectid"]), _matrix(given), given.get("partnumber")))
                else:
                    now.components.append(((target, given["objectid"]), _matrix(given)))

    parser = expat.ParserCreate(namespace_separator=" ")
    parser.StartElementHandler = begin
    parser.Parse(text, True)
    return found


def _matrix(given: dict[str, str]) -> Floats:
    """Transform of an element: twelve numbers, of rows that are multiplied from the left."""
    out = np.eye(4)
    if "transform" in given:
        out[:3] = np.array(given["transform"].split(), float).reshape(4, 3).T
    return out
