"""The product structure of a STEP file: assemblies, parts, names, colours, layers, materials, and what is shared.

Runs in the child process of `step_kernel.py` alone.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import OCP
from OCP.BRepBuilderAPI import BRepBuilderAPI_Transform
from OCP.collections import (
    IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher as ShapeMap,
)
from OCP.collections import Sequence_TCollection_AsciiString, Sequence_TDF_Label
from OCP.gp import gp_Pnt, gp_Trsf
from OCP.IFSelect import IFSelect_ReturnStatus
from OCP.Quantity import Quantity_Color, Quantity_TypeOfColor
from OCP.STEPCAFControl import STEPCAFControl_Reader
from OCP.TCollection import TCollection_ExtendedString
from OCP.TDataStd import TDataStd_Name, TDataStd_TreeNode
from OCP.TDF import TDF_Label
from OCP.TDocStd import TDocStd_Document
from OCP.TopAbs import TopAbs_ShapeEnum as Type
from OCP.TopExp import TopExp
from OCP.TopLoc import TopLoc_Location
from OCP.XCAFDoc import (
    XCAFDoc,
    XCAFDoc_Area,
    XCAFDoc_ColorTool,
    XCAFDoc_ColorType,
    XCAFDoc_DocumentTool,
    XCAFDoc_Material,
    XCAFDoc_ShapeTool,
    XCAFDoc_Volume,
)

from relmodel.loading import step_geometry, step_shape
from relmodel.loading.neutral import Assembly, Attribute, Instance, LoadedModel, Part, Shape

LOADER_VERSION = f"step-1 ocp-{OCP.__version__}"

# Names of length units as the kernel gives them (of SI units in full, of conversion-based ones as in the file).
UNITS_MM = {
    "millimetre": 1.0,
    "metre": 1000.0,
    "centimetre": 10.0,
    "decimetre": 100.0,
    "kilometre": 1e6,
    "micrometre": 1e-3,
    "nanometre": 1e-6,
    "inch": 25.4,
    "foot": 304.8,
    "yard": 914.4,
    "mil": 0.0254,
    "microinch": 2.54e-5,
}
_ABBREVIATIONS = {
    "mm": "millimetre",
    "millimeter": "millimetre",
    "m": "metre",
    "meter": "metre",
    "cm": "centimetre",
    "centimeter": "centimetre",
    "in": "inch",
    "inches": "inch",
    "ft": "foot",
    "feet": "foot",
}


class UnreadableError(Exception):
    """The kernel will not have the file."""


def read(source: str) -> LoadedModel:
    """Read a STEP file; lengths become mm.  `faces_in_file` and `schema_name` are left to who reads the text."""
    document = TDocStd_Document(TCollection_ExtendedString("step"))
    reader = STEPCAFControl_Reader()
    for mode in (reader.SetColorMode, reader.SetNameMode, reader.SetLayerMode, reader.SetMatMode, reader.SetPropsMode):
        mode(True)
    if reader.ReadFile(source) != IFSelect_ReturnStatus.IFSelect_RetDone:
        raise UnreadableError("the CAD kernel finds errors in it")
    unit, unit_mm = _unit(reader)
    if not reader.Transfer(document):
        raise UnreadableError("the CAD kernel finds no shape in it")
    walk = _Walk(document)
    root = walk.root()
    return LoadedModel(
        format="STEP",
        schema_name=None,
        unit=unit,
        unit_mm=unit_mm,
        shapes=walk.shapes,
        parts=walk.parts,
        assemblies=walk.assemblies,
        root=root,
        faces_in_file=None,
        faces_loaded=walk.faces.Extent(),
        loader_version=LOADER_VERSION,
    )


def _unit(reader: Any) -> tuple[str, float]:
    lengths, angles, solid_angles = (Sequence_TCollection_AsciiString() for _ in range(3))
    reader.ChangeReader().FileUnits(lengths, angles, solid_angles)
    names = [name.ToCString().strip().lower() for name in lengths]
    unit = _ABBREVIATIONS.get(names[0], names[0]) if names else "millimetre"
    return unit, UNITS_MM.get(unit, 1.0)


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
    shapes: list[Shape] = field(default_factory=list)
    parts: list[Part] = field(default_factory=list)
    assemblies: list[Assembly] = field(default_factory=list)

    def __post_init__(self) -> None:
        main = self.document.Main()
        self._tool = XCAFDoc_DocumentTool.ShapeTool_s(main)
        self._layers = XCAFDoc_DocumentTool.LayerTool_s(main)
        self.faces = ShapeMap()  # every distinct face that came through, wherever it is placed
        self._solids = ShapeMap()  # distinct shapes in a place of their own
        self._shape_of: dict[tuple[int, float], int] = {}
        self._done: dict[tuple[str, float], _Child | None] = {}

    def root(self) -> int:
        """Walk from the free shapes; the index of the assembly that holds them all."""
        free = Sequence_TDF_Label()
        self._tool.GetFreeShapes(free)
        children = [(label, self._product(label, 1.0)) for label in free]
        there = [(label, child) for label, child in children if child is not None]
        if not there:
            raise UnreadableError("the CAD kernel finds no face in it")
        if len(there) == 1 and there[0][1].kind == "assembly" and np.array_equal(there[0][1].located, np.eye(4)):
            return there[0][1].index
        instances = [_instance(_name(label) or "", child, np.eye(4), _colour(label)) for label, child in there]
        instances = [_named(one, self) for one in instances]
        name = instances[0].name if len(instances) == 1 else "root"
        self.assemblies.append(Assembly(name, instances))
        return len(self.assemblies) - 1

    def _product(self, label: Any, scale: float) -> _Child | None:
        """The product of a label, scaled by a factor (negative: mirrored); None where nothing of it has a face."""
        key = (_entry(label), scale)
        if key not in self._done:
            assembly = XCAFDoc_ShapeTool.IsAssembly_s(label)
            self._done[key] = self._assembly(label, scale) if assembly else self._part(label, scale)
        return self._done[key]

    def _assembly(self, label: Any, scale: float) -> _Child | None:
        instances: list[Instance] = []
        wrapper, loose = True, 0
        for component, referred, trsf, split in _components(label):
            placed, factor = _rigid(trsf)
            child = self._product(referred, scale * factor)
            if child is None:
                loose += _loose_edges(XCAFDoc_ShapeTool.GetShape_s(referred))
                continue
            placed[:3, 3] *= scale
            wrapper &= split
            instances.append(_instance("" if split else _name(component) or "", child, placed, _colour(component)))
        if not instances:
            return None
        attributes = _attributes(label)
        if loose:
            attributes.append(("supplemental edges", float(loose), None))
        if wrapper and all(one.kind == "part" for one in instances):
            solid = [one for one in instances if self.shapes[self.parts[one.child].shape].kind == "solid"]
            if len(instances) == 1:
                return self._collapsed(label, instances[0], attributes)
            if len(solid) == 1 and _name(label):
                self._mark_supplemental(label, solid[0], instances)
        named = [_named(one, self) for one in instances]
        self.assemblies.append(Assembly(_name(label) or "assembly", named, attributes))
        return _Child("assembly", len(self.assemblies) - 1, np.eye(4))

    def _mark_supplemental(self, label: Any, body: Instance, instances: list[Instance]) -> None:
        """Name what the kernel split a product into: its one solid body after it, the sheets beside it after both."""
        self._collapsed(label, body, [])
        name = self.parts[body.child].name
        for i, one in enumerate(other for other in instances if other is not body):
            sheet = self.parts[one.child]
            sheet.number = sheet.name = one.name = f"{name} supplemental {i + 1}"
            sheet.attributes.append(("supplemental", "sheet", None))
        body.name = name

    def _collapsed(self, label: Any, inner: Instance, attributes: list[Attribute]) -> _Child:
        """The one part of a product that the kernel wrapped: it takes the product's name and attributes."""
        part = self.parts[inner.child]
        part.number = part.name = _name(label) or part.name
        part.material = part.material or _material(label)
        part.colour = _colour(label) or inner.colour or part.colour
        part.attributes = attributes + part.attributes
        return _Child("part", inner.child, inner.parent_from_child)

    def _part(self, label: Any, scale: float) -> _Child | None:
        shape = XCAFDoc_ShapeTool.GetShape_s(label)
        if shape.IsNull():
            return None
        located, factor = _rigid(shape.Location().Transformation())
        located[:3, 3] *= scale
        shape = shape.Located(TopLoc_Location())
        faces = step_shape.face_map(shape)
        if not faces.Extent():
            return None
        for i in range(1, faces.Extent() + 1):
            self.faces.Add(faces.FindKey(i).Located(TopLoc_Location()))
        name = _name(label) or f"part {len(self.parts) + 1}"
        attributes = _attributes(label)
        solids = step_shape.solids(shape)
        if len(solids) > 1:
            return self._solids_of(label, solids, faces, scale * factor, Assembly(name, [], attributes), located)
        key = (self._solids.Add(shape), scale * factor)
        if key not in self._shape_of:
            marks = self._marks(label, faces)
            self.shapes.append(step_shape.extract(_scaled(shape, scale * factor), *marks))
            self._shape_of[key] = len(self.shapes) - 1
        loose = _loose_edges(shape)
        if loose:
            attributes.append(("supplemental edges", float(loose), None))
        self.parts.append(Part(name, name, self._shape_of[key], _material(label), _colour(label), attributes))
        return _Child("part", len(self.parts) - 1, located)

    def _solids_of(
        self, label: Any, solids: list[Any], faces: Any, scale: float, assembly: Assembly, located: Any
    ) -> _Child:
        """The solids of one product as parts of an assembly, as the kernel makes them of products with several."""
        marks = self._marks(label, faces)
        for i, solid in enumerate(solids):
            own = step_shape.face_map(solid)
            ordinal = {faces.FindIndex(own.FindKey(k)): k for k in range(1, own.Extent() + 1)}
            of_own = [{ordinal[k]: v for k, v in mark.items() if k in ordinal} for mark in marks]
            self.shapes.append(step_shape.extract(_scaled(solid, scale), *of_own))
            name = f"{assembly.name} {i + 1}"
            self.parts.append(Part(name, name, len(self.shapes) - 1, _material(label), _colour(label)))
            assembly.instances.append(Instance(name, "part", len(self.parts) - 1, np.eye(4)))
        self.assemblies.append(assembly)
        return _Child("assembly", len(self.assemblies) - 1, located)

    def _marks(self, label: Any, faces: Any) -> tuple[dict[int, str], dict[int, str], dict[int, str]]:
        """Names, colours and layers of faces, by ordinal; what a body or shell bears, its faces inherit."""
        names: dict[int, str] = {}
        colours: dict[int, str] = {}
        layers: dict[int, str] = {}
        marked = Sequence_TDF_Label()
        XCAFDoc_ShapeTool.GetSubShapes_s(label, marked)
        subs = [(XCAFDoc_ShapeTool.GetShape_s(one), one) for one in marked]
        whole = self._layer(label)
        if whole:
            layers = dict.fromkeys(range(1, faces.Extent() + 1), whole)
        # From the whole to its pieces, so that a face's own mark is written last.
        for shape, one in sorted(subs, key=lambda pair: int(pair[0].ShapeType().value)):
            if shape.ShapeType().value > Type.TopAbs_FACE.value:
                continue
            own = step_shape.face_map(shape)
            ordinals = [faces.FindIndex(own.FindKey(i)) for i in range(1, own.Extent() + 1)]
            if shape.ShapeType() == Type.TopAbs_FACE and (name := _name(one)):
                names.update(dict.fromkeys(ordinals, name))
            if colour := _colour(one):
                colours.update(dict.fromkeys(ordinals, colour))
            if layer := self._layer(one):
                layers.update(dict.fromkeys(ordinals, layer))
        return names, colours, layers

    def _layer(self, label: Any) -> str | None:
        names = self._layers.GetLayers(label)
        return ", ".join(name.ToExtString() for name in names) if names and names.Length() else None


def _components(label: Any) -> Iterator[tuple[Any, Any, Any, bool]]:
    """Components of an assembly: label, label referred to, transform, and whether the kernel made it.

    The kernel splits a product with several bodies into nameless components at identity (usages of a product have
    names of their own), and groups of such components are gone through.
    """
    components = Sequence_TDF_Label()
    XCAFDoc_ShapeTool.GetComponents_s(label, components, False)
    for component in components:
        referred = TDF_Label()
        if not XCAFDoc_ShapeTool.GetReferredShape_s(component, referred):
            continue
        trsf = XCAFDoc_ShapeTool.GetLocation_s(component).Transformation()
        identity = np.allclose(step_geometry.matrix(trsf), np.eye(4), rtol=0, atol=1e-12)
        split = identity and (_name(component) or "=>[").startswith("=>[")
        if split and XCAFDoc_ShapeTool.IsAssembly_s(referred) and not _name(referred):
            yield from _components(referred)
        else:
            yield component, referred, trsf, split


def _instance(name: str, child: _Child, placed: Any, colour: str | None) -> Instance:
    return Instance(name, child.kind, child.index, placed @ child.located, colour)


def _named(one: Instance, walk: _Walk) -> Instance:
    if not one.name:
        one.name = walk.parts[one.child].name if one.kind == "part" else walk.assemblies[one.child].name
    return one


def _rigid(trsf: Any) -> tuple[np.ndarray[Any, Any], float]:
    """A transform of the kernel as a rigid 4x4 after a scaling about the origin (negative: mirrored)."""
    out = step_geometry.matrix(trsf)
    factor = float(np.cbrt(np.linalg.det(out[:3, :3])))
    if abs(factor - 1) < 1e-9:
        return out, 1.0
    out[:3, :3] /= factor
    return out, round(factor, 12)


def _scaled(shape: Any, factor: float) -> Any:
    if factor == 1.0:
        return shape
    trsf = gp_Trsf()
    if factor < 0:
        trsf.SetMirror(gp_Pnt(0, 0, 0))
    scaling = gp_Trsf()
    scaling.SetScale(gp_Pnt(0, 0, 0), abs(factor))
    return BRepBuilderAPI_Transform(shape, scaling.Multiplied(trsf), True).Shape()


def _loose_edges(shape: Any) -> int:
    """Edges that bound no face: drawn annotations and construction lines, which are left out."""
    every = ShapeMap()
    TopExp.MapShapes_s(shape, Type.TopAbs_EDGE, every)
    return int(every.Extent() - step_shape.edge_map(shape).Extent())


def _entry(label: Any) -> str:
    """Path of a label's tags, its identity in the document."""
    tags = []
    while not label.IsRoot():
        tags.append(str(label.Tag()))
        label = label.Father()
    return ":".join(reversed(tags))


def _name(label: Any) -> str | None:
    if not label.IsAttribute(TDataStd_Name.GetID_s()):
        return None
    name = TDataStd_Name()
    label.FindAttribute(TDataStd_Name.GetID_s(), name)
    return str(name.Get().ToExtString()).strip() or None


def _colour(label: Any) -> str | None:
    """Colour of a label as #rrggbb (sRGB); of a surface before that of the whole."""
    for kind in (XCAFDoc_ColorType.XCAFDoc_ColorSurf, XCAFDoc_ColorType.XCAFDoc_ColorGen):
        colour = Quantity_Color()
        if XCAFDoc_ColorTool.GetColor_s(label, kind, colour):
            parts = colour.Values(Quantity_TypeOfColor.Quantity_TOC_sRGB)
            return "#" + "".join(f"{round(255 * min(max(p, 0.0), 1.0)):02x}" for p in parts)
    return None


def _material(label: Any) -> str | None:
    guid = XCAFDoc.MaterialRefGUID_s()
    if not label.IsAttribute(guid):
        return None
    node = TDataStd_TreeNode()
    label.FindAttribute(guid, node)
    if not node.HasFather():
        return None
    at = node.Father().Label()
    if not at.IsAttribute(XCAFDoc_Material.GetID_s()):
        return None
    material = XCAFDoc_Material()
    at.FindAttribute(XCAFDoc_Material.GetID_s(), material)
    name = material.GetName()
    return str(name.ToCString()) if name is not None else None


def _attributes(label: Any) -> list[Attribute]:
    """Validation properties of the file."""
    out: list[Attribute] = []
    for kind, name, unit in ((XCAFDoc_Volume, "validation volume", "mm3"), (XCAFDoc_Area, "validation area", "mm2")):
        if label.IsAttribute(kind.GetID_s()):
            value = kind()
            label.FindAttribute(kind.GetID_s(), value)
            out.append((name, float(value.Get()), unit))
    return out
