"""Robots in URDF; boxes, cylinders and spheres as surfaces and arcs fitted to triangles, exact but for round-off."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import NoReturn
from xml.etree.ElementTree import Element, TreeBuilder
from xml.parsers import expat

import numpy as np

from relmodel.arrays import Floats
from relmodel.errors import InputError
from relmodel.geometry.transforms import KINDS, Joint, JointTree, Mimic, rotation_matrix
from relmodel.model.model import Assembly, Attribute, Finding, Instance, Model, Part, Shape, SourceFile
from relmodel.readers.formats import UNITLESS_FORMATS
from relmodel.readers.mesh.shape import shape_from_triangles

_CHORD_MM = 0.05
_LEAST_SEGMENTS, _MOST_SEGMENTS = 42, 360  # of a full turn


def primitive(kind: str, *sizes: float) -> Shape:
    """A box of three sides, a cylinder of a radius and a length about z, or a sphere; mm, about the origin."""
    import trimesh

    radius, count = sizes[0], _segments(sizes[0])
    if kind == "box":
        mesh, volume, off = trimesh.creation.box(np.array(sizes, float)), float(np.prod(sizes)), 0.0
    elif kind == "cylinder":
        mesh = trimesh.creation.cylinder(radius, sizes[1], sections=count)
        volume, off = np.pi * radius**2 * sizes[1], radius * (1 - np.cos(np.pi / count))
    else:
        mesh = trimesh.creation.uv_sphere(radius, [count // 2 + 1, count])
        volume, off = 4 / 3 * np.pi * radius**3, radius * (1 - np.cos(np.pi / count) ** 2)
    # Which face a triangle is of is known: to find it by what triangles agree on would take seconds.
    told_by = {"box": [1, 1, 1], "cylinder": [0, 0, 1], "sphere": [0, 0, 0]}[kind]
    face = np.unique(np.rint(mesh.face_normals) * told_by, axis=0, return_inverse=True)[1].ravel()
    order = np.argsort(face, kind="stable")
    shape = shape_from_triangles(np.asarray(mesh.vertices, float), np.asarray(mesh.faces, np.int64)[order], face[order])
    assert shape is not None  # its sides are above zero
    # The triangles leave the surface by so much at most.
    mesh_of_shape = replace(shape.mesh, chord_mm=_CHORD_MM, deviation_mm=off)
    return replace(shape, kind="solid", volume=volume, mesh=mesh_of_shape)


def _segments(radius: float) -> int:
    """Even number of segments of a full turn that leave its circle by no more than the chord's tolerance."""
    chord = float(np.arccos(max(1 - _CHORD_MM / radius, 0.0)))
    return 2 * int(np.ceil(min(max(_LEAST_SEGMENTS, np.pi / chord), _MOST_SEGMENTS) / 2))


# Robots and tools in URDF: links become objects in the robot's, visuals parts in the links', joints rows.
#
# Boxes, cylinders and spheres are solids; meshes (STL, OBJ, PLY, GLB) are read as everywhere
# (`mesh/read.py`), from the file's own folder or the ROS package they name; no surfaces are fitted to them. URDF states
# metres and radians. What has no extent or cannot be read as geometry is left out, which is a finding.
# (http://wiki.ros.org/urdf/XML)

LOADER_VERSION = "urdf 6"
MESH_FORMATS = ("stl", "obj", "ply", "glb", "gltf")
_M = 1000.0  # mm in a metre
_PRIMITIVES = {"box": ("size",), "cylinder": ("radius", "length"), "sphere": ("radius",)}
_MOST_M = 1e5  # as far as a world file may place an object
_MOST_BYTES = 64 << 20
_LEAST_MM, _THINNEST = 0.01, 2e-7  # a primitive that is smaller, or thinner for its length, has vertices that coincide


class _LeftOutError(Exception):
    """Why a visual is no part of the robot."""


def read_urdf(path: Path) -> Model:
    """Read a URDF file: an assembly of links, placed as they are with all joints at rest (zero, or the limit next to
    it), with the joints that move them.  A link without visuals that can be read shows what it has for collisions.  A
    slash in a name becomes _, as in paths.

    Raises InputError where the file is no URDF, declares a document type or entities, where links and joints form no
    tree with unique names, or a mesh is missing or outside the file's folder."""
    content = path.read_bytes()
    root = _parse(content, path)
    space, _, local = root.tag.rpartition(":")
    if local != "robot":
        raise InputError(f"{path.name} begins with <{root.tag}>, not <robot>: give a URDF file")
    for element in root.iter() if space else ():
        element.tag = element.tag.removeprefix(f"{space}:")
    model = _RobotReader(path, root).model()
    return replace(model, files=(SourceFile(path.name, hashlib.sha256(content).hexdigest()), *model.files))


def _parse(content: bytes, path: Path) -> Element:
    """The document's root.  A document type is refused: with it come entities, which may expand without end."""
    if len(content) > _MOST_BYTES:
        raise InputError(f"{path.name} is larger than {_MOST_BYTES >> 20} MB: split the robot")
    builder = TreeBuilder()
    parser = expat.ParserCreate()
    parser.StartElementHandler = builder.start
    parser.EndElementHandler = builder.end
    parser.CharacterDataHandler = builder.data

    def refuse(*_: object) -> NoReturn:
        raise InputError(f"{path.name} declares a document type, which URDF has not: remove <!DOCTYPE ...>")

    parser.StartDoctypeDeclHandler = refuse
    try:
        parser.Parse(content, True)
        return builder.close()
    except (expat.ExpatError, ValueError, LookupError, AssertionError) as error:
        raise InputError(f"{path.name} is not well-formed XML ({error}): correct it there") from error


class _RobotReader:
    def __init__(self, path: Path, root: Element) -> None:
        self.path = path
        self.folder = path.resolve().parent
        self.root = root
        self.colours = {m.get("name"): self._colour(m) for m in root.findall("material")}
        self.shapes: list[Shape] = []
        self.parts: list[Part] = []
        self.assemblies: list[Assembly] = []
        self._shape_of: dict[tuple[str, tuple[float, ...]], int] = {}
        self._mesh_of: dict[tuple[Path, tuple[float, ...]], Instance] = {}
        self._files: dict[Path, SourceFile] = {}
        self._findings = self._without_slashes()

    def model(self) -> Model:
        xacro = next((e.tag for e in self.root.iter() if str(e.tag).startswith("xacro:")), None)
        if xacro:
            self._refuse(f"holds the macro <{xacro}>: expand it first, with xacro {self.path.stem}.xacro")
        links = self.root.findall("link")
        if not links:
            self._refuse("has no link: add one")
        names = [self._attribute(link, "name", "a link") for link in links]
        joints = [self._joint(e) for e in self.root.findall("joint")]
        try:
            tree = JointTree(names, joints)
            poses = tree.poses(tree.values({}, "at rest"))
        except InputError as error:
            raise InputError(f"{self.path.name}: {error}") from error
        indices = [self._link(link, name) for link, name in zip(links, names, strict=True)]
        instances = [Instance(name, "assembly", i, poses[name]) for i, name in zip(indices, names, strict=True)]
        name = self.root.get("name") or self.path.stem
        self.assemblies.append(Assembly(name, tuple(instances), joints=tree.joints))
        return Model(
            format="urdf",
            unit="m",
            unit_mm=_M,
            shapes=tuple(self.shapes),
            parts=tuple(self.parts),
            assemblies=tuple(self.assemblies),
            root=len(self.assemblies) - 1,
            faces_loaded=sum(len(s.surfaces["kind"]) for s in self.shapes),
            loader_version=LOADER_VERSION,
            findings=tuple(self._findings),
            files=tuple(self._files[file] for file in sorted(self._files)),
        )

    def _without_slashes(self) -> list[Finding]:
        """Write _ for the slashes in names, which separate names in paths."""
        names = [e.get("name", "") for tag in ("link", "joint") for e in self.root.findall(tag)]
        slashed = [name for name in names if "/" in name]
        if not slashed:
            return []
        for element in self.root.iter():
            for key in {"name", "link", "joint"} & element.attrib.keys():
                element.set(key, element.attrib[key].replace("/", "_"))
        said = f"the slash in {len(slashed)} names of links and joints, such as {slashed[0]!r}, became _"
        return [Finding("renamed", said, float(len(slashed)), 0.0)]

    def _joint(self, element: Element) -> Joint:
        name = self._attribute(element, "name", "a joint")
        where = f"joint {name!r}"
        kind = self._attribute(element, "type", where)
        if kind not in KINDS:
            why = "moves in several ways at once" if kind in ("planar", "floating") else "is not known"
            self._refuse(f"{where} is of the kind {kind!r}, which {why}: use one of {', '.join(KINDS)}")
        ends = []
        for tag in ("parent", "child"):
            if (end := element.find(tag)) is None:
                self._refuse(f"{where} has no <{tag}>: add it")
            ends.append(self._attribute(end, "link", f"<{tag}> of {where}"))
        axis, given = np.array([1.0, 0, 0]), element.find("axis")
        if given is not None:
            stated = self._numbers(given, "xyz", where, 3)
            axis = axis if kind == "fixed" else stated
        length = float(np.linalg.norm(axis))
        if length < 1e-9:
            self._refuse(f"{where} has an axis of length zero: give a direction")
        unit = _M if kind == "prismatic" else 1.0
        lower, upper = self._limits(element, kind, where, unit)
        mimic_element = element.find("mimic")
        mimic = None
        if mimic_element is not None and kind != "fixed":
            factor = self._number(mimic_element, "multiplier", where, 1.0)
            offset = self._number(mimic_element, "offset", where, 0.0)
            leader = self._attribute(mimic_element, "joint", f"<mimic> of {where}")
            # The factor takes the leader's metres or radians to this joint's.
            leading = next((j for j in self.root.findall("joint") if j.get("name") == leader), None)
            leader_unit = _M if leading is not None and leading.get("type") == "prismatic" else 1.0
            mimic = Mimic(leader, factor * unit / leader_unit, offset * unit)
        return Joint(name, kind, ends[0], ends[1], axis / length, lower, upper, self._origin(element, where), mimic)

    def _limits(self, element: Element, kind: str, where: str, unit: float) -> tuple[float | None, float | None]:
        if kind not in ("revolute", "prismatic"):
            return None, None
        limit = element.find("limit")
        if limit is None:
            self._refuse(f"{where} is {kind} and has no <limit>: add one, or make it continuous")
        lower, upper = (self._number(limit, key, where, 0.0) * unit for key in ("lower", "upper"))
        if lower > upper:
            self._refuse(f"{where} has a lower limit above the upper one: swap them")
        return lower, upper

    def _link(self, link: Element, name: str) -> int:
        """Index of the assembly that a link becomes."""
        instances: list[Instance] = []
        for tag in ("visual", "collision"):
            for visual in link.findall(tag) if not instances else ():
                try:
                    instances.append(self._visual(visual, name))
                except _LeftOutError as error:
                    self._findings.append(Finding("left_out", f"a {tag} of link {name!r} is left out: {error}"))
        self.assemblies.append(Assembly(name, tuple(instances), self._mass(link, name)))
        return len(self.assemblies) - 1

    def _visual(self, visual: Element, name: str) -> Instance:
        where = f"link {name!r}"
        label = visual.get("name") or name
        known = [e for e in visual.findall("geometry/*") if e.tag == "mesh" or e.tag in _PRIMITIVES]
        if not known:
            there = "".join(f" but a <{e.tag}>" for e in visual.findall("geometry/*"))
            raise _LeftOutError(f"it has no box, cylinder, sphere or mesh{there}")
        link_from_visual = self._origin(visual, where)
        colour = self._material(visual)
        if known[0].tag == "mesh":
            return self._mesh(known[0], where, label, colour, link_from_visual)
        self.parts.append(Part(label, label, self._primitive(known[0], where), colour=colour))
        return Instance(label, "part", len(self.parts) - 1, link_from_visual)

    def _mass(self, link: Element, name: str) -> tuple[Attribute, ...]:
        mass = link.find("inertial/mass")
        return () if mass is None else (("mass", self._number(mass, "value", f"<mass> of link {name!r}"), "kg"),)

    def _primitive(self, element: Element, where: str) -> int:
        """Index of the shape of a primitive, the same for the same dimensions."""
        tag = str(element.tag)
        stated = [self._numbers(element, key, where, 3 if key == "size" else 1) for key in _PRIMITIVES[tag]]
        sizes = np.concatenate(stated) * _M
        if sizes.max() < _LEAST_MM or sizes.min() < _THINNEST * sizes.max():
            raise _LeftOutError(f"the {tag} has no extent")
        key = (tag, tuple(sizes.tolist()))
        if key not in self._shape_of:
            self.shapes.append(primitive(*key[:1], *key[1]))
            self._shape_of[key] = len(self.shapes) - 1
        return self._shape_of[key]

    def _mesh(self, element: Element, where: str, label: str, colour: str | None, link_from_visual: Floats) -> Instance:
        """A mesh file placed in a link: its one part, or all that it holds as an assembly."""
        from relmodel.readers.mesh.read import read_mesh

        file = self.file(self._attribute(element, "filename", f"<mesh> of {where}"), where)
        scale = self._numbers(element, "scale", where, 3, [1.0, 1.0, 1.0])
        if not np.all(np.abs(scale) > 1e-12):
            raise _LeftOutError("its mesh is scaled to nothing")
        key = (file, tuple(scale.tolist()))
        if key not in self._mesh_of:
            unit = "m" if file.suffix[1:].lower() in UNITLESS_FORMATS else None
            found = read_mesh(file, unit, scale=(float(scale[0]), float(scale[1]), float(scale[2])), fit=False)
            shapes, parts, assemblies = len(self.shapes), len(self.parts), len(self.assemblies)
            first = {"part": parts, "assembly": assemblies}
            moved = [
                replace(it, instances=tuple(replace(one, child=one.child + first[one.kind]) for one in it.instances))
                for it in found.assemblies
            ]
            self.shapes += found.shapes
            self.parts += [replace(part, shape=part.shape + shapes) for part in found.parts]
            self._files[file] = found.files[0]
            self._findings += found.findings
            whole = moved[found.root]
            if len(whole.instances) == 1 and whole.instances[0].kind == "part":
                self._mesh_of[key] = whole.instances[0]
            else:
                self.assemblies += moved
                self._mesh_of[key] = Instance(whole.name, "assembly", assemblies + found.root, np.eye(4))
        one = self._mesh_of[key]
        if one.kind == "part" and colour == self.parts[one.child].colour:
            colour = None
        placed = link_from_visual @ one.parent_from_child
        return Instance(label, one.kind, one.child, placed, colour if one.kind == "part" else None)

    def file(self, name: str, where: str) -> Path:
        """The file that a URDF names, which must lie in its own folder or below, or in the ROS package it names."""
        root, inside = self.folder, name
        if name.startswith("package://"):
            package, _, rest = name.removeprefix("package://").partition("/")
            root, inside = self._package(package), rest
            if not (root / rest).is_file() and (root / package).is_dir():
                inside = f"{package}/{rest}"
        elif "://" in name:
            self._refuse(f"{where} names {name!r}: put the mesh into the URDF's folder and give a path relative to it")
        file = (root / inside).resolve()
        if file.suffix[1:].lower() not in MESH_FORMATS:
            raise _LeftOutError(f"the mesh {name!r} is in none of the formats {', '.join(MESH_FORMATS)}: convert it")
        kind = "file's folder" if root == self.folder else "package"
        if not file.is_relative_to(root):
            self._refuse(f"{where} names {name!r} outside the {kind}: put the mesh in that folder")
        if not file.is_file():
            self._refuse(f"{where} names {name!r}, not in the {kind}: correct the name, or put the URDF into it")
        return file

    def _package(self, name: str) -> Path:
        """Root of a ROS package: the one that holds the URDF, a sibling of that, or the URDF's own folder.

        A package is a folder with a package.xml that states its name (https://ros.org/reps/rep-0149.html)."""
        above = [] if name in ("", ".", "..") else [self.folder, *self.folder.parents]
        for folder in above:
            manifest = folder / "package.xml"
            if manifest.is_file():
                sibling = folder.parent / name
                if _parse(manifest.read_bytes(), manifest).findtext("name", "").strip() == name:
                    return folder
                if (sibling / "package.xml").is_file():
                    return sibling.resolve()
                break
        return next((folder for folder in above if folder.name == name), self.folder)

    def _material(self, visual: Element) -> str | None:
        material = visual.find("material")
        return None if material is None else self._colour(material) or self.colours.get(material.get("name"))

    def _colour(self, material: Element) -> str | None:
        """#rrggbb of the <color> of a material; None where it has none."""
        if (colour := material.find("color")) is None:
            return None
        rgba = self._numbers(colour, "rgba", f"material {material.get('name')!r}", 4)
        return "#" + "".join(f"{round(255 * float(c)):02x}" for c in np.clip(rgba[:3], 0, 1))

    def _origin(self, element: Element, where: str) -> Floats:
        """Transform of <origin>: fixed-axis roll, pitch, yaw, then the translation, mm."""
        out = np.eye(4)
        origin = element.find("origin")
        if origin is not None:
            roll, pitch, yaw = self._numbers(origin, "rpy", where, 3, [0.0, 0.0, 0.0])
            x, y, z = np.eye(3)
            out[:3, :3] = rotation_matrix(yaw * z) @ rotation_matrix(pitch * y) @ rotation_matrix(roll * x)
            xyz = self._numbers(origin, "xyz", where, 3, [0.0, 0.0, 0.0])
            if np.abs(xyz).max() > _MOST_M:
                self._refuse(f"{where} lies farther off than {_MOST_M / 1e3:g} km: give its origin in metres")
            out[:3, 3] = xyz * _M
        return out

    def _attribute(self, element: Element, key: str, where: str) -> str:
        value = (element.get(key) or "").strip()
        if not value:
            self._refuse(f"{where} has no {key}: add it")
        return value

    def _numbers(
        self, element: Element, key: str, where: str, count: int, default: Sequence[float] | None = None
    ) -> Floats:
        text = element.get(key)
        if text is None and default is not None:
            return np.array(default)
        try:
            values = np.array([float(word) for word in (text or "").split()])
        except ValueError:
            values = np.array([np.nan])
        if len(values) != count or not np.isfinite(values).all():
            wanted = "a number" if count == 1 else f"{count} numbers"
            self._refuse(f"{where} has {key}={text!r}: give {wanted}")
        return values

    def _number(self, element: Element, key: str, where: str, default: float | None = None) -> float:
        return float(self._numbers(element, key, where, 1, None if default is None else [default])[0])

    def _refuse(self, said: str) -> NoReturn:
        raise InputError(f"{self.path.name}{':' if not said.startswith(('has ', 'holds ')) else ''} {said}")
