"""The build of a 3MF file as a tree: its items, the components that these are made of, and the meshes of those.

After the 3MF Core Specification 1.3, 3.4 and 4.2.  trimesh, which reads the meshes, flattens the components, and of
build items with one part number it keeps one.
"""

from __future__ import annotations

import zipfile
from dataclasses import dataclass, field
from graphlib import CycleError, TopologicalSorter
from pathlib import Path
from xml.parsers import expat

import numpy as np

from relmodel.arrays import Floats
from relmodel.errors import InputError

_MOST_NODES = 100_000


@dataclass(frozen=True)
class Node:
    """A placed object: parent (a node's number, -1 is the build), its name, that of its mesh, and where it stands."""

    parent: int
    name: str
    mesh: str | None
    parent_from_node: Floats  # (4, 4), in the file's unit


@dataclass
class _Object:
    name: str
    mesh: str | None = None
    components: list[tuple[str, Floats]] = field(default_factory=list)


def build_nodes(path: Path) -> list[Node] | None:
    """Nodes of the build of a file, parents before children; None where the objects lie in several models, for which
    the names of the meshes are trimesh's own.

    Raises InputError where an object contains itself or the build places too many, and whatever its parsers raise.
    """
    objects, items, elsewhere = _parse(path)
    if elsewhere:
        return None
    try:
        tuple(TopologicalSorter({i: [c for c, _ in o.components] for i, o in objects.items()}).static_order())
    except CycleError as error:
        raise InputError(f"object {error.args[1][0]} of {path.name} contains itself: mend the file") from error
    nodes: list[Node] = []
    waiting = [(-1, number, matrix, name) for number, matrix, name in reversed(items)]
    while waiting:
        parent, number, matrix, name = waiting.pop()
        if number not in objects:
            continue  # trimesh passes over it, too
        one = objects[number]
        nodes.append(Node(parent, name or one.name, one.mesh, matrix))
        if len(nodes) > _MOST_NODES:
            raise InputError(f"{path.name} places more than {_MOST_NODES} objects: split it")
        waiting += [(len(nodes) - 1, c, m, None) for c, m in reversed(one.components)]
    return nodes


def _parse(path: Path) -> tuple[dict[str, _Object], list[tuple[str, Floats, str | None]], bool]:
    """Objects by their identifiers, items of the build, and whether components lie in other models."""
    from trimesh.util import unique_name

    objects: dict[str, _Object] = {}
    items: list[tuple[str, Floats, str | None]] = []
    names: set[str] = set()
    counts: dict[str | None, int] = {}
    elsewhere = False
    now = _Object("")

    def begin(tag: str, given: dict[str, str]) -> None:
        nonlocal now, elsewhere
        match tag.rpartition(":")[2]:
            case "object":
                now = objects[given["id"]] = _Object(given.get("name") or given["id"])
                now.mesh = unique_name(given.get("name", given["id"]), names, counts)  # as trimesh names it
                names.add(now.mesh)
                meshless.add(given["id"])
            case "mesh":
                meshless.discard(next(reversed(objects)))
            case "component":
                elsewhere |= any(key.endswith("path") for key in given)
                now.components.append((given["objectid"], _matrix(given)))
            case "item":
                items.append((given["objectid"], _matrix(given), given.get("partnumber")))

    meshless: set[str] = set()
    with zipfile.ZipFile(path) as archive:
        model = next(n for n in archive.namelist() if "3d/3dmodel.model" in n.lower())
        parser = expat.ParserCreate()
        parser.StartElementHandler = begin
        parser.Parse(archive.read(model), True)
    for number in meshless:
        objects[number].mesh = None
    return objects, items, elsewhere


def _matrix(given: dict[str, str]) -> Floats:
    """Transform of an element: twelve numbers, of rows that are multiplied from the left."""
    out = np.eye(4)
    if "transform" in given:
        out[:3] = np.array(given["transform"].split(), float).reshape(4, 3).T
    return out
