"""Mesh files (OBJ, STL, PLY, GLB, glTF by trimesh, 3MF by the build of its file) as models."""

from __future__ import annotations

import codecs
import hashlib
import json
import logging
import re
import zipfile
from array import array
from collections import Counter
from contextlib import suppress
from dataclasses import dataclass, field, replace
from graphlib import CycleError, TopologicalSorter
from io import BytesIO
from pathlib import Path
from typing import Any
from urllib.parse import unquote
from xml.etree import ElementTree
from xml.parsers import expat

import numpy as np

from relmodel.arrays import Floats, Ints
from relmodel.errors import InputError, missing_library
from relmodel.geometry.transforms import nearest_rotation, rigid
from relmodel.model.model import Assembly, Finding, Instance, Model, Part, Shape, SourceFile
from relmodel.readers.formats import UNITS_MM, check_unit, known_unit
from relmodel.readers.mesh.shape import shape_from_triangles
from relmodel.readers.mesh.triangles import split_solids

# After the 3MF Core Specification 1.3 (3.4, 4) and the Production Extension 1.1: objects may lie in several model
# files, each of which has its own identifiers and unit. Support and auxiliary objects (modifiers) are no parts.

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
    """The build of a file.  Raises InputError for cycles, too many objects, an unknown unit, and what parsers raise."""
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
        # The package's relationships name the root, or it has the usual name.
        relations = ElementTree.fromstring(archive.read(entries["_rels/.rels"])) if "_rels/.rels" in entries else ()
        roots = [_part_name(one.get("Target", "")) for one in relations if one.get("Type", "").endswith("/3dmodel")]
        roots = [name for name in roots if name in entries]
        waiting = roots[:1] or [next(name for name in entries if _ROOT in name)]
        for file in waiting:  # which grows
            if file in entries and file not in found:
                found[file] = one = _parse(archive.read(entries[file]), file)
                waiting += one.refers
    return list(found.values())


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


# Meshes (OBJ, STL, PLY, GLB, glTF through trimesh, 3MF by `build.py`): the scene graph becomes assemblies, shared
# geometry stays shared, solids that lie apart in a mesh without a name are parts, triangles become surfaces and arcs
# (`shape.py`).

LOADER_VERSION = "mesh 11"
_MOST_BYTES = 1 << 30
# Unless the program that calls has a place for them, Python prints trimesh's warnings, with tracebacks: of a texture
# that is missing, which the model has no use for.
logging.getLogger("trimesh").addHandler(logging.NullHandler())
# What is one mesh in the file is one here, whatever its colours: a body in two colours is not two open ones.
_OPTIONS = {"glb": {"merge_primitives": True}, "gltf": {"merge_primitives": True}}
_OPTIONS["obj"] = {"split_objects": True, "group_material": False}
_UNNAMED = re.compile(r"geometry(_\d+)?")  # what trimesh calls a mesh without a name
_BEGINS = {"glb": b"glTF", "ply": b"ply", "3mf": b"PK"}
_MOST_TRIANGLES = 5_000_000
_MOST_MM = 1e8


def read_mesh(
    path: Path,
    unit: str | None = None,
    *,
    scale: tuple[float, float, float] = (1.0, 1.0, 1.0),
    name: str | None = None,
    fit: bool = True,
) -> Model:
    """Read a mesh file.  `unit` (a key of UNITS_MM) is that of the lengths in a format that states none; `scale`
    multiplies the file's x, y and z; `name` (default: the file's) is that of a mesh that has none in the file.  Without
    `fit` no surfaces are fitted: what only occludes stays triangles between crease edges.

    What the file refers to is read from its own folder and nowhere else.  Raises InputError where the file is no
    such mesh, has no triangle, or is too large, where its unit is unknown, or a unit is given that it states itself."""
    form = path.suffix[1:].lower()
    check_unit(path, unit)
    if path.stat().st_size > _MOST_BYTES or (form == "3mf" and _unpacked_bytes(path) > _MOST_BYTES):
        raise InputError(f"{path.name} is larger than {_MOST_BYTES >> 20} MB: split it or reduce its triangles")
    content = raw = path.read_bytes()
    if form != "stl" or raw[3:].lstrip()[:5] == b"solid":  # binary STL may begin with any bytes
        content = raw.removeprefix(codecs.BOM_UTF8)
    try:
        _check_head(path.name, form, content)
        build = read_build(path) if form == "3mf" else _read_scene(path, form, content)
    except (InputError, MemoryError):
        raise
    except Exception as error:  # a parser of foreign bytes raises anything
        raise InputError(f"{path.name} cannot be read as {form.upper()} ({_fault(error)}): export it again") from error
    triangles = sum(len(mesh.triangles) for mesh in build.meshes.values())
    if triangles > _MOST_TRIANGLES:
        raise InputError(f"{path.name} has {triangles} triangles, more than {_MOST_TRIANGLES}: reduce them")
    short = known_unit(path.name, build.unit if unit is None else unit)
    reader = _GraphWalk(build, UNITS_MM[short], path.name, name or path.stem, fit)
    model = reader.model(path.stem, np.diag(scale), form, short)
    if not model.parts:
        raise InputError(f"{path.name} holds no triangle of a part: export a mesh of surfaces")
    return replace(model, files=(SourceFile(path.name, hashlib.sha256(raw).hexdigest()),))


def _read_scene(path: Path, form: str, content: bytes) -> Build:
    """What trimesh reads of a file."""
    import trimesh

    findings = []
    end = _end_of_binary_stl(content)
    if form == "stl" and end < len(content):
        more, content = len(content) - end, content[:end]
        findings.append(Finding("left_out", f"{more} bytes behind the last triangle are left out", float(more), 0.0))
    resolver = trimesh.resolvers.FilePathResolver(str(path))
    with BytesIO(content) as file:
        scene = trimesh.load_scene(file, file_type=form, resolver=resolver, process=False, **_OPTIONS.get(form, {}))
    several = _of_several_materials(path.name, content) if form == "obj" else set()
    meshes = {}
    for name, mesh in scene.geometry.items():
        vertices = np.asarray(getattr(mesh, "vertices", np.empty((0, 3))), float)
        triangles = np.asarray(getattr(mesh, "faces", np.empty((0, 3))), np.int64)
        colour = _colour(mesh) if len(triangles) and name not in several else None
        meshes[name] = NodeMesh(vertices, triangles, colour)
    nodes = [
        Node(child, parent, None, a.get("geometry"), np.array(a.get("matrix", np.eye(4)), float))
        for parent, child, a in scene.graph.to_edgelist()
    ]
    unit = str(scene.units or ("m" if form in ("glb", "gltf") else "mm"))
    return Build(unit, nodes, meshes, tuple(findings), scene.graph.base_frame)


def _end_of_binary_stl(content: bytes) -> int:
    """Where the last triangle ends by the number of them that a binary STL file states; text states far too many."""
    return 84 + 50 * int.from_bytes(content[80:84], "little")


def _check_head(name: str, form: str, content: bytes) -> None:
    """Refuse what does not begin as files of its format do, or is shorter than it says.

    trimesh would read STL that is no text as text in an encoding that a package, if installed, guesses."""
    fault = None
    if not content.startswith(_BEGINS.get(form, b"")):
        fault = f"it does not begin as {form.upper()} does"
    elif form == "glb":
        version, length = (int.from_bytes(content[i : i + 4], "little") for i in (4, 8))
        if version != 2:
            fault = f"it is of version {version} of glTF, not 2"
        elif len(content) < length:
            fault = "it is cut off"
    elif form == "gltf":
        json.loads(content)  # where this fails, trimesh would look for another file
    elif form == "stl" and len(content) < _end_of_binary_stl(content):
        try:
            content.decode()
        except UnicodeDecodeError:
            fault = "it is neither text nor as long as it says"
    if fault:
        raise InputError(f"{name} cannot be read as {form.upper()} ({fault}): export it again")


def _fault(error: Exception) -> str:
    """What is wrong with a file, by the error that its parser raised.

    Messages of parsers other than those of XML and JSON describe the parser and not the file.  Raises MemoryError where
    the parser ran out of memory, and the error where it lacks a library."""
    match error:
        case ImportError() if missing_library(error):
            raise error
        case expat.ExpatError(code=1):  # XML_ERROR_NO_MEMORY
            raise MemoryError from error
        case expat.ExpatError() | SyntaxError():
            return f"its XML is not well-formed: {error}"
        case json.JSONDecodeError():
            return f"its JSON ends or goes wrong at line {error.lineno}, column {error.colno}"
        case ImportError() | UnicodeDecodeError():  # trimesh would guess the encoding
            return "it is not text in UTF-8"
        case FileNotFoundError():
            return f"it refers to {error}, which is not in its folder"
        case ValueError() if "escapes resolver" in str(error):
            return "it refers to a file outside its folder"
        case zipfile.BadZipFile():
            return "it is not a complete archive"
    return "what it says of its meshes is incomplete or does not fit together"


def _unpacked_bytes(path: Path) -> int:
    """Size of all files of an archive after unpacking, bytes; 0 where it is not an archive."""
    with suppress(OSError, zipfile.BadZipFile), zipfile.ZipFile(path) as archive:
        return sum(entry.file_size for entry in archive.infolist())
    return 0


def _of_several_materials(name: str, content: bytes) -> set[str]:
    """Names of the objects of an OBJ file that are of several materials, of which trimesh knows one only."""
    materials = dict[str, set[bytes]]()
    for word, rest in re.findall(rb"^(o|usemtl)[ \t]+(.*?)\s*$", content, re.MULTILINE):
        if word == b"o":
            name = rest.decode(errors="replace")
        else:
            materials.setdefault(name, set()).add(rest)
    return {name for name, used in materials.items() if len(used) > 1}


@dataclass
class _GraphWalk:
    """Walks a scene graph from its base; nodes that scale or mirror are baked into shapes of their own."""

    build: Build
    unit_mm: float
    file: str
    name: str
    fit: bool
    shapes: list[Shape] = field(default_factory=list)
    parts: list[Part] = field(default_factory=list)
    assemblies: list[Assembly] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._parts_of: dict[tuple[str, tuple[float, ...]], list[int]] = {}
        self._nodes = {node.key: node for node in self.build.nodes}
        self._children: dict[str, list[str]] = {}
        for node in self.build.nodes:
            self._children.setdefault(node.parent, []).append(node.key)

    def model(self, name: str, stretch: Floats, form: str, unit: str) -> Model:
        self.assemblies.append(Assembly(name, tuple(self._placed(stretch))))
        return Model(
            format=form,
            unit=unit,
            unit_mm=self.unit_mm,
            shapes=tuple(self.shapes),
            parts=tuple(self.parts),
            assemblies=tuple(self.assemblies),
            root=len(self.assemblies) - 1,
            faces_loaded=sum(len(s.surfaces["kind"]) for s in self.shapes),
            loader_version=LOADER_VERSION,
            findings=self.build.findings,
        )

    def _placed(self, stretch: Floats) -> list[Instance]:
        """Instances that stand for the nodes below the base, whose coordinates are to be stretched by a 3x3 matrix.

        Without recursion, since files nest as deeply as they like: nodes are placed on the way down, and become
        assemblies on the way up."""
        base = self.build.base
        placed: list[tuple[str, str, list[int], Floats]] = []  # node, its parent, its parts, parent_from_node
        waiting = [(node, base, stretch) for node in reversed(self._children.get(base, []))]
        reached = {base}
        while waiting:
            node, parent, above = waiting.pop()
            if node in reached:
                raise InputError(f"node {node!r} of the file stands in itself or in two nodes: mend the file")
            reached.add(node)
            matrix, mesh = self._nodes[node].parent_from_node, self._nodes[node].mesh
            if not np.all(np.isfinite(matrix)):
                raise InputError(f"node {node!r} of the file is placed by numbers that are not finite: mend the file")
            linear = above @ matrix[:3, :3]
            rotation = nearest_rotation(np.sign(np.linalg.det(linear) or 1.0) * linear)
            inner = rotation.T @ linear  # the identity for a rigid motion
            inner = np.eye(3) if np.allclose(inner, np.eye(3), atol=1e-6) else inner
            parent_from_node = rigid(rotation, above @ matrix[:3, 3] * self.unit_mm)
            parts = [] if mesh is None else self._parts(mesh, inner)
            placed.append((node, parent, parts, parent_from_node))
            waiting += [(child, node, inner) for child in reversed(self._children.get(node, []))]
        inside: dict[str, list[Instance]] = {}  # what stands in a node, last first
        for node, parent, parts, parent_from_node in reversed(placed):
            own = [Instance(self.parts[part].name, "part", part, np.eye(4)) for part in parts]
            instances = [*own, *reversed(inside.pop(node, []))]
            if not instances:
                continue
            if node in self._children or len(own) > 1:
                name = self._nodes[node].name or node if node in self._children else self._name(node)
                self.assemblies.append(Assembly(name, tuple(instances)))
                one = Instance(name, "assembly", len(self.assemblies) - 1, parent_from_node)
            else:
                one = Instance(self._name(node), "part", instances[0].child, parent_from_node)
            inside.setdefault(parent, []).append(one)
        return inside.get(base, [])[::-1]

    def _name(self, node: str) -> str:
        """Name of a node; the geometry's where trimesh made a node up, with a random end, for one of several meshes."""
        one = self._nodes[node]
        if one.name is not None:
            return one.name
        made_up = re.fullmatch(r"(.+)_[0-9a-f]{6}", node)
        return self._named(str(one.mesh) if made_up and made_up[1] in self._nodes else node)

    def _named(self, name: str) -> str:
        """A name in the file; that of the whole for a mesh without one."""
        return self.name if self._is_unnamed(name) else name

    def _is_unnamed(self, name: str) -> bool:
        """Whether trimesh took the file's name, or made one up for its only mesh."""
        return name == self.file or (len(self.build.meshes) == 1 and bool(_UNNAMED.fullmatch(name)))

    def _parts(self, geometry: str, stretch: Floats) -> list[int]:
        """Parts of a geometry stretched by a 3x3 matrix; none where it holds no area."""
        key = (geometry, tuple(np.round(stretch, 9).ravel().tolist()))
        if key in self._parts_of:
            return self._parts_of[key]
        mesh = self.build.meshes[geometry]
        vertices, triangles = mesh.vertices, mesh.triangles
        if triangles.size and not 0 <= triangles.min() <= triangles.max() < len(vertices):
            raise InputError(f"mesh {geometry!r} of the file has triangles without vertices: export it again")
        vertices = vertices @ stretch.T * self.unit_mm
        if not np.all(np.abs(vertices[triangles]) < _MOST_MM):  # NaN too
            raise InputError(
                f"mesh {self._named(geometry)!r} of the file has vertices that are not numbers or beyond "
                f"{_MOST_MM / 1e6:g} km: check its unit, or export it again"
            )
        if np.linalg.det(stretch) < 0:
            triangles = triangles[:, ::-1]
        # A name says what is one part; a mesh without one is whatever lies in the file.
        solids = split_solids(vertices, triangles) if self._is_unnamed(geometry) else [triangles]
        made = self._parts_of[key] = []
        for number, some in enumerate(solids, 1):
            shape = shape_from_triangles(vertices, some, fit=self.fit)
            if shape is not None:
                name = self._named(geometry) + (f" {number}" if len(solids) > 1 else "")
                made.append(len(self.parts))
                self.parts.append(Part(number=name, name=name, shape=len(self.shapes), colour=mesh.colour))
                self.shapes.append(shape)
        return made


def _colour(mesh: Any) -> str | None:
    visual = mesh.visual
    if visual is None or not visual.defined:
        return None
    main = getattr(getattr(visual, "material", visual), "main_color", None)
    return None if main is None else "#" + "".join(f"{int(c):02x}" for c in np.asarray(main)[:3])
