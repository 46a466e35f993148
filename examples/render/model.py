"""The bulkhead as the STEP file has it: components with their names and places, meshes with exact normals."""

from __future__ import annotations

import gzip
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from OCP.BRep import BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Surface
from OCP.BRepMesh import BRepMesh_IncrementalMesh
from OCP.collections import Sequence_TDF_Label
from OCP.gp import gp_Pnt, gp_Vec
from OCP.IFSelect import IFSelect_RetDone
from OCP.STEPCAFControl import STEPCAFControl_Reader
from OCP.TDataStd import TDataStd_Name
from OCP.TDF import TDF_Label
from OCP.TopAbs import TopAbs_FACE, TopAbs_REVERSED
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS
from OCP.XCAFDoc import XCAFDoc_DocumentTool, XCAFDoc_ShapeTool

from examples.bulkhead.solids import explore, new_document

Array = NDArray[np.float64]
CHORD_MM = 0.03
TURN_RAD = 0.08


@dataclass
class Part:
    """A product's mesh in its own frame: vertices, normals (n, 3), triangles (m, 3), face number of every vertex."""

    name: str
    vertices: Array
    normals: Array
    triangles: NDArray[np.int64]
    face: NDArray[np.int64]


@dataclass
class Component:
    """An occurrence of a product: path of component names below the root, and where it stands."""

    path: str
    part: Part
    object_from_part: Array


def read_document(path: Path) -> Any:
    """The document of a STEP file (gzipped or not)."""
    document = new_document()
    reader = STEPCAFControl_Reader()
    reader.SetNameMode(True)
    with tempfile.TemporaryDirectory() as folder:
        plain = path
        if path.suffix == ".gz":
            plain = Path(folder) / "part.step"
            plain.write_bytes(gzip.decompress(path.read_bytes()))
        if reader.ReadFile(str(plain)) != IFSelect_RetDone or not reader.Transfer(document):
            raise RuntimeError(f"the kernel cannot read {path}")
    return document


def read_components(path: Path) -> list[Component]:
    """The components of a STEP file (gzipped or not), in the file's order; a part alone is called by its product."""
    document = read_document(path)
    roots = Sequence_TDF_Label()
    XCAFDoc_DocumentTool.ShapeTool_s(document.Main()).GetFreeShapes(roots)
    parts: dict[str, Part] = {}
    out: list[Component] = []

    def walk(label: Any, place: Array, names: list[str]) -> None:
        if not XCAFDoc_ShapeTool.IsAssembly_s(label):
            product = _name(label)
            if product not in parts:
                parts[product] = tessellate(product, XCAFDoc_ShapeTool.GetShape_s(label))
            out.append(Component("/".join(names or [product]), parts[product], place))
            return
        components = Sequence_TDF_Label()
        XCAFDoc_ShapeTool.GetComponents_s(label, components)
        for i in range(1, components.Length() + 1):
            component, referred = components.Value(i), TDF_Label()
            XCAFDoc_ShapeTool.GetReferredShape_s(component, referred)
            walk(referred, place @ _matrix(XCAFDoc_ShapeTool.GetLocation_s(component)), [*names, _name(component)])

    walk(roots.Value(1), np.eye(4), [])
    return out


def _name(label: Any) -> str:
    attribute = TDataStd_Name()
    if not label.FindAttribute(TDataStd_Name.GetID_s(), attribute):
        raise RuntimeError("a label of the assembly has no name")
    return str(attribute.Get().ToExtString())


def _matrix(location: Any) -> Array:
    move = location.Transformation()
    out = np.eye(4)
    out[:3] = [[move.Value(r, c) for c in range(1, 5)] for r in range(1, 4)]
    return out


def _normals(surface: Any, uv: list[tuple[float, float]], flip: bool) -> Array:
    point, du, dv = gp_Pnt(), gp_Vec(), gp_Vec()
    out = np.empty((len(uv), 3))
    for i, (u, v) in enumerate(uv):
        surface.D1(u, v, point, du, dv)
        n = du.Crossed(dv)
        out[i] = n.X(), n.Y(), n.Z()
    out /= np.linalg.norm(out, axis=1, keepdims=True)
    return -out if flip else out


def tessellate(name: str, shape: Any) -> Part:
    """The mesh of one product's shape."""
    BRepMesh_IncrementalMesh(shape, CHORD_MM, False, TURN_RAD, False)
    vertices, normals, triangles, numbers = [], [], [], []
    count = 0
    for number, item in enumerate(explore(shape, TopAbs_FACE)):
        face = TopoDS.Face(item)
        mesh = BRep_Tool.Triangulation_s(face, TopLoc_Location())
        flip = face.Orientation() == TopAbs_REVERSED
        uv = [(p.X(), p.Y()) for p in (mesh.UVNode(i) for i in range(1, mesh.NbNodes() + 1))]
        points = [mesh.Node(i) for i in range(1, mesh.NbNodes() + 1)]
        vertices.append(np.array([[p.X(), p.Y(), p.Z()] for p in points]))
        normals.append(_normals(BRepAdaptor_Surface(face), uv, flip))
        corner = np.array([mesh.Triangle(i).Get() for i in range(1, mesh.NbTriangles() + 1)]) - 1 + count
        triangles.append(corner[:, ::-1] if flip else corner)
        numbers.append(np.full(len(points), number))
        count += len(points)
    mesh = np.concatenate(vertices), np.concatenate(normals), np.concatenate(triangles), np.concatenate(numbers)
    return Part(name, *mesh)
