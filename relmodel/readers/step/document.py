"""The product structure of a STEP file: assemblies, parts, names, colours, layers, materials, and what is shared.

Imports the CAD kernel; `read.py` reports where it is missing."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass, field, replace
from functools import cache
from io import BytesIO
from typing import Any

import numpy as np
import OCP
from OCP.BRepBuilderAPI import BRepBuilderAPI_Transform
from OCP.collections import IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher as ShapeMap
from OCP.collections import Sequence_TCollection_AsciiString, Sequence_TDF_Label
from OCP.gp import gp_Pnt, gp_Trsf
from OCP.IFSelect import IFSelect_ReturnStatus
from OCP.STEPCAFControl import STEPCAFControl_Reader
from OCP.TCollection import TCollection_ExtendedString
from OCP.TDF import TDF_Label
from OCP.TDocStd import TDocStd_Document
from OCP.TopAbs import TopAbs_ShapeEnum as Type
from OCP.TopLoc import TopLoc_Location
from OCP.XCAFDoc import XCAFDoc_DocumentTool, XCAFDoc_ShapeTool

from relmodel.model.model import Assembly, Finding, Instance, Model, Part, Shape
from relmodel.readers.formats import FULL_UNITS, UNITS_MM, short_unit
from relmodel.readers.step import faces as maps
from relmodel.readers.step import geometry as step_geometry
from relmodel.readers.step import part21
from relmodel.readers.step import shape as step_shape
from relmodel.readers.step import triangulation as step_tessellated
from relmodel.readers.step.part21 import Instances, Reference, length_unit, validation_units
from relmodel.readers.step.properties import FacesOfText, with_face_names, with_finish, with_pmi, with_properties
from relmodel.readers.step.shape import Labels, entry
from relmodel.readers.step.step_parameters import Findings

LOADER_VERSION = f"step-7 ocp-{OCP.__version__}"
_MADE_UP = "=>["  # the kernel names a component after the label that it refers to: =>[0:1:1:3]


class UnreadableError(Exception):
    """The CAD kernel rejects the file."""


class UnknownUnitError(Exception):
    """The file's unit of length is unknown; the message is its name."""


def read_document(content: bytes, instances: Instances) -> Model:
    """Read the content of a STEP file, whose text is parsed already; lengths become mm."""
    document = TDocStd_Document(TCollection_ExtendedString("step"))
    reader = STEPCAFControl_Reader()
    for mode in (reader.SetColorMode, reader.SetNameMode, reader.SetLayerMode, reader.SetMatMode, reader.SetPropsMode):
        mode(True)
    if reader.ReadStream("step", BytesIO(content)) != IFSelect_ReturnStatus.IFSelect_RetDone:
        raise UnreadableError("the CAD kernel finds errors in it")
    if not reader.Transfer(document):
        raise UnreadableError("the CAD kernel finds no shape in it")
    unit, unit_mm = _unit(reader, instances)
    found = Findings(part21.damage(instances))
    units: dict[tuple[str, str], float] = {}
    with found.contained("the units of validation properties"):
        units = validation_units(instances)
    walk = _Walk(document, units, found, part21.numbered_usages(instances))
    root = walk.root()
    model = Model(
        format="STEP",
        schema_name=part21.schema_name(instances),
        unit=unit,
        unit_mm=unit_mm,
        shapes=tuple(walk.shapes),
        parts=tuple(walk.parts),
        assemblies=tuple(walk.assemblies),
        root=root,
        faces_loaded=walk.faces.Extent(),
        loader_version=LOADER_VERSION,
    )
    # An addition that cannot be read never costs the geometry.
    with found.contained("the identifiers of products"):
        numbers = part21.product_numbers(instances)
        model = replace(model, parts=tuple(replace(p, number=numbers.get(p.name, p.number)) for p in model.parts))
    faces = cache(lambda: FacesOfText(instances, reader, walk.places))
    for what, add in (
        ("the names of faces", with_face_names),
        ("dimensions, tolerances and datums", with_pmi),
        ("properties", with_properties),
        ("finishes", with_finish),
    ):
        with found.contained(what):
            model = add(model, instances, faces(), found)
    return replace(_without_unplaced(model), findings=tuple(found))


def _without_unplaced(model: Model) -> Model:
    """The model without parts that stand in no assembly, and their shapes."""
    parts = sorted({one.child for it in model.assemblies for one in it.instances if one.kind == "part"})
    shapes = sorted({model.parts[i].shape for i in parts})
    part, shape = ({old: new for new, old in enumerate(kept)} for kept in (parts, shapes))

    def renumbered(one: Instance) -> Instance:
        return replace(one, child=part[one.child]) if one.kind == "part" else one

    return replace(
        model,
        shapes=tuple(model.shapes[i] for i in shapes),
        parts=tuple(replace(model.parts[i], shape=shape[model.parts[i].shape]) for i in parts),
        assemblies=tuple(replace(it, instances=tuple(map(renumbered, it.instances))) for it in model.assemblies),
    )


def _unit(reader: Any, instances: Instances) -> tuple[str, float]:
    """Name of the file's unit of length and what it is in mm, by its name or by what the text says it is."""
    lengths, angles, solid_angles = (Sequence_TCollection_AsciiString() for _ in range(3))
    reader.ChangeReader().FileUnits(lengths, angles, solid_angles)
    name = next((str(one.ToCString()).strip().lower() for one in lengths), "")
    short = short_unit(name)
    if short in UNITS_MM:
        return FULL_UNITS[short], UNITS_MM[short]
    for context in instances.of("GLOBAL_UNIT_ASSIGNED_CONTEXT"):
        stated = length_unit(instances, Reference(context))
        if stated is not None:
            return name or stated.symbol, stated.factor * 1e3
    raise UnknownUnitError(name)


@dataclass
class _Child:
    """A part or assembly, and the transform that its own location adds."""

    kind: Any
    index: int
    located: np.ndarray[Any, Any]


@dataclass
class _Walk:
    """Walks the labels of a document; every product becomes one part or assembly, however often it is used."""

    document: Any
    units: dict[tuple[str, str], float]
    findings: Findings
    numbered: Collection[str] = ()  # names of components that are only numbers of uses
    shapes: list[Shape] = field(default_factory=list)
    parts: list[Part] = field(default_factory=list)
    assemblies: list[Assembly] = field(default_factory=list)

    def __post_init__(self) -> None:
        main = self.document.Main()
        self._tool = XCAFDoc_DocumentTool.ShapeTool_s(main)
        self.labels = Labels(self.findings, self.units, XCAFDoc_DocumentTool.LayerTool_s(main))
        self.faces = ShapeMap()  # every distinct face that came through, wherever it is placed
        self._places: dict[int, list[tuple[int, int]]] = {}  # by ordinal in it: part and surface_no
        self._solids = ShapeMap()  # distinct shapes in a place of their own
        self._shape_of: dict[tuple[int, float], tuple[int, list[int]]] = {}  # shape; face of each surface
        self._done: dict[tuple[str, float], _Child | None] = {}

    def root(self) -> int:
        """Walk from the free shapes; the index of the assembly that holds them all."""
        free = Sequence_TDF_Label()
        self._tool.GetFreeShapes(free)
        children = [(label, self._product(label, 1.0)) for label in free]
        there = [(label, child) for label, child in children if child is not None]
        if not self.faces.Extent():
            raise UnreadableError("the CAD kernel finds no face in it")
        if len(there) == 1 and there[0][1].kind == "assembly" and np.array_equal(there[0][1].located, np.eye(4)):
            return there[0][1].index
        instances = [
            self._instance(self.labels.name(label) or "", child, np.eye(4), self.labels.colour(label))
            for label, child in there
        ]
        name = instances[0].name if len(there) == 1 else "root"
        self.assemblies.append(Assembly(name, tuple(instances)))
        return len(self.assemblies) - 1

    def _product(self, label: Any, scale: float) -> _Child | None:
        """The product of a label, scaled by a factor (negative: mirrored); None where nothing of it has a face."""
        key = (entry(label), scale)
        if key not in self._done:
            assembly = XCAFDoc_ShapeTool.IsAssembly_s(label)
            self._done[key] = self._assembly(label, scale) if assembly else self._part(label, scale)
        return self._done[key]

    def _assembly(self, label: Any, scale: float) -> _Child | None:
        instances: list[Instance] = []
        wrapper = True
        for component, referred, trsf, split in _components(label, self.labels):
            placed, factor = _rigid(trsf)
            child = self._product(referred, scale * factor)
            if child is None:
                continue
            placed[:3, 3] *= scale
            wrapper &= split
            name = self.labels.name(component) or ""
            name = "" if split or name.startswith(_MADE_UP) or name in self.numbered else name
            instances.append(self._instance(name, child, placed, self.labels.colour(component)))
        if not instances:
            return None
        name = self.labels.name(label) or "assembly"
        if wrapper and all(one.kind == "part" for one in instances):
            instances = self._bodies(name, instances)
            if len(instances) == 1:
                return self._collapsed(label, instances[0])
        self.assemblies.append(Assembly(name, tuple(instances), self.labels.attributes(label)))
        return _Child("assembly", len(self.assemblies) - 1, np.eye(4))

    def _bodies(self, name: str, instances: list[Instance]) -> list[Instance]:
        """What a product is made of: its solids, where it has any, without its sheets."""
        solids = [self.shapes[self.parts[one.child].shape].volume is not None for one in instances]
        if all(solids) or not any(solids):
            return instances
        left = {one.child for one, is_solid in zip(instances, solids, strict=True) if not is_solid}
        self._leave_out(name, sum(len(self.shapes[self.parts[i].shape].surfaces["kind"]) for i in left))
        self._places = {at: [it for it in places if it[0] not in left] for at, places in self._places.items()}
        return [one for one in instances if one.child not in left]

    def _collapsed(self, label: Any, body: Instance) -> _Child:
        """The one body of a product that the kernel wrapped: it takes the product's name and attributes."""
        part = self.parts[body.child]
        name = self.labels.name(label) or part.name
        own = {name for name, *_ in part.attributes}
        self.parts[body.child] = replace(
            part,
            number=name,
            name=name,
            material=part.material or self.labels.material(label),
            colour=self.labels.colour(label) or body.colour or part.colour,
            attributes=(*part.attributes, *(one for one in self.labels.attributes(label) if one[0] not in own)),
        )
        return _Child("part", body.child, body.parent_from_child)

    def _instance(self, name: str, child: _Child, placed: Any, colour: str | None) -> Instance:
        """Instance of a child, named after it where `name` is empty."""
        named: Any = self.parts[child.index] if child.kind == "part" else self.assemblies[child.index]
        return Instance(name or named.name, child.kind, child.index, placed @ child.located, colour)

    def _part(self, label: Any, scale: float) -> _Child | None:
        shape = XCAFDoc_ShapeTool.GetShape_s(label)
        if shape.IsNull():
            return None
        located, factor = _rigid(shape.Location().Transformation())
        located[:3, 3] *= scale
        shape = maps.without_lost_faces(shape.Located(TopLoc_Location()))
        scale *= factor
        name = self.labels.name(label) or f"part {len(self.parts) + 1}"
        body, loose = maps.without_loose_faces(shape)
        for face in loose:
            self.faces.Add(face.Located(TopLoc_Location()))
        self._leave_out(name, len(loose))
        return self._body(label, body, scale, name, located)

    def _leave_out(self, name: str, faces: int) -> None:
        if faces:
            said = f"{name} has {faces} faces beside its solids, which are no material: they are left out"
            self.findings.append(Finding("left_out", said, float(faces)))

    def _body(self, label: Any, shape: Any, scale: float, name: str, located: Any) -> _Child | None:
        """The part of a product; where it has several solids an assembly of them, as the kernel makes of others."""
        if not maps.face_map(shape).Extent():
            return None
        solids = maps.solids(shape)
        attributes = self.labels.attributes(label)
        if len(solids) < 2:
            child = self._faced(label, shape, scale, name, located)
            self.parts[child.index] = replace(self.parts[child.index], attributes=attributes)
            return child
        instances = []
        for i, solid in enumerate(solids):
            one = self._faced(label, solid, scale, f"{name} {i + 1}", np.eye(4))
            instances.append(Instance(f"{name} {i + 1}", "part", one.index, np.eye(4)))
        self.assemblies.append(Assembly(name, tuple(instances), attributes))
        return _Child("assembly", len(self.assemblies) - 1, located)

    def _faced(self, label: Any, shape: Any, scale: float, name: str, located: Any) -> _Child:
        """The part of a label's shape, or of a piece of it, that has faces; without attributes."""
        faces = maps.face_map(shape)
        key = (self._solids.Add(shape), scale)
        if key not in self._shape_of:
            labels = self._face_labels(label, faces)
            if step_tessellated.is_tessellated(faces):
                made, face_of = step_tessellated.extract(scale_shape(shape, scale), labels)
            else:
                made, face_of = step_shape.extract(scale_shape(shape, scale), labels), list(range(len(faces)))
            self.shapes.append(made)
            self._shape_of[key] = len(self.shapes) - 1, face_of
        shape_no, face_of = self._shape_of[key]
        self.parts.append(Part(name, name, shape_no, self.labels.material(label), self.labels.colour(label)))
        for surface_no, face in enumerate(face_of):
            at = self.faces.Add(faces.FindKey(face + 1).Located(TopLoc_Location()))
            self._places.setdefault(at, []).append((len(self.parts) - 1, surface_no))
        return _Child("part", len(self.parts) - 1, located)

    def places(self, face: Any) -> list[tuple[int, int]]:
        """Part and surface_no of a face of the kernel, of each product that has it."""
        return self._places.get(self.faces.FindIndex(face.Located(TopLoc_Location())), [])

    def _face_labels(self, label: Any, faces: Any) -> dict[str, dict[int, str]]:
        """Names, colours and layers of faces, by ordinal; faces inherit what a body bears, but not its name."""
        found: dict[str, dict[int, str]] = {"name": {}, "colour": {}, "layer": {}}
        labelled = Sequence_TDF_Label()
        XCAFDoc_ShapeTool.GetSubShapes_s(label, labelled)
        subs = [(XCAFDoc_ShapeTool.GetShape_s(one), one) for one in labelled]
        whole = self.labels.layer(label)
        if whole:
            found["layer"] = dict.fromkeys(range(1, faces.Extent() + 1), whole)
        # From the whole to its pieces, so that a face's own label is written last.
        for shape, one in sorted(subs, key=lambda pair: int(pair[0].ShapeType().value)):
            if shape.ShapeType().value > Type.TopAbs_FACE.value:
                continue
            ordinals = [o for face in maps.face_map(shape) if (o := faces.FindIndex(face))]
            for column, given in found.items():
                bears = column != "name" or shape.ShapeType() == Type.TopAbs_FACE
                if bears and (word := getattr(self.labels, column)(one)):
                    given.update(dict.fromkeys(ordinals, word))
        return found


def _components(label: Any, labels: Labels) -> Iterator[tuple[Any, Any, Any, bool]]:
    """Components of an assembly: label, label referred to, transform, and whether the kernel made it.

    The kernel splits a product with several bodies into nameless components at identity (usages of a product have
    names of their own), and groups of such components are gone through."""
    components = Sequence_TDF_Label()
    XCAFDoc_ShapeTool.GetComponents_s(label, components, False)
    for component in components:
        referred = TDF_Label()
        if not XCAFDoc_ShapeTool.GetReferredShape_s(component, referred):
            continue
        trsf = XCAFDoc_ShapeTool.GetLocation_s(component).Transformation()
        identity = np.allclose(step_geometry.matrix(trsf), np.eye(4), rtol=0, atol=1e-12)
        split = identity and (labels.name(component) or _MADE_UP).startswith(_MADE_UP)
        if split and XCAFDoc_ShapeTool.IsAssembly_s(referred) and not labels.name(referred):
            yield from _components(referred, labels)
        else:
            yield component, referred, trsf, split


def _rigid(trsf: Any) -> tuple[np.ndarray[Any, Any], float]:
    """A transform of the kernel as a rigid 4x4 after a scaling about the origin (negative: mirrored)."""
    out = step_geometry.matrix(trsf)
    factor = float(np.cbrt(np.linalg.det(out[:3, :3])))
    if abs(factor - 1) < 1e-9:
        return out, 1.0
    out[:3, :3] /= factor
    return out, round(factor, 12)


def scale_shape(shape: Any, factor: float) -> Any:
    """A shape of the CAD kernel that many times as large."""
    if factor == 1.0:
        return shape
    scaling = gp_Trsf()
    scaling.SetScale(gp_Pnt(0, 0, 0), factor)
    return BRepBuilderAPI_Transform(shape, scaling, True).Shape()
