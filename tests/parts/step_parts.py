"""STEP files for tests: loaded once for all of them, and composed with the CAD kernel."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

from OCP.BRep import BRep_Builder
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge, BRepBuilderAPI_MakeFace
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox
from OCP.gp import gp_Dir, gp_Pln, gp_Pnt
from OCP.Interface import Interface_Static
from OCP.STEPCAFControl import STEPCAFControl_Writer
from OCP.STEPControl import STEPControl_StepModelType, STEPControl_Writer
from OCP.TCollection import TCollection_ExtendedString
from OCP.TDataStd import TDataStd_Name
from OCP.TDocStd import TDocStd_Document
from OCP.TopoDS import TopoDS_Compound
from OCP.XCAFDoc import XCAFDoc_DocumentTool

from relmodel.model.model import Model
from tests.reading import shared


@cache
def loaded(path: Path) -> Model:
    """A file, read once for all tests of this process."""
    return shared(path)


def compound(*shapes: Any) -> Any:
    builder, whole = BRep_Builder(), TopoDS_Compound()
    builder.MakeCompound(whole)
    for shape in shapes:
        builder.Add(whole, shape)
    return whole


def write_product(
    path: Path, shape: Any, name: str, *, as_assembly: bool = False, names: dict[str, Any] | None = None
) -> Path:
    """Write one product; `names` are those of sub-shapes, each by its name."""
    document = TDocStd_Document(TCollection_ExtendedString("test"))
    tool = XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
    label = tool.AddShape(shape, as_assembly)
    TDataStd_Name.Set_s(label, TCollection_ExtendedString(name))
    for of, sub in (names or {}).items():
        TDataStd_Name.Set_s(tool.AddSubShape(label, sub), TCollection_ExtendedString(of))
    writer = STEPCAFControl_Writer()
    Interface_Static.SetIVal_s("write.stepcaf.subshapes.name", 1)
    writer.Transfer(document)
    writer.Write(str(path))
    return path


def write_solids(path: Path, *shapes: Any) -> Path:
    """Write every shape as a product of its own."""
    writer = STEPControl_Writer()
    for shape in shapes:
        writer.Transfer(shape, STEPControl_StepModelType.STEPControl_AsIs)
    writer.Write(str(path))
    return path


def bracket_with_sheet_and_line() -> Any:
    """A box of 30 x 20 x 10 mm, beside it a rectangle of 40 x 25 mm at z = 50 and a line of 30 mm above that."""
    sheet = BRepBuilderAPI_MakeFace(gp_Pln(gp_Pnt(0, 0, 50), gp_Dir(0, 0, 1)), 0.0, 40.0, 0.0, 25.0).Face()
    line = BRepBuilderAPI_MakeEdge(gp_Pnt(0, 0, 60), gp_Pnt(0, 0, 90)).Edge()
    return compound(BRepPrimAPI_MakeBox(30.0, 20.0, 10.0).Shape(), sheet, line)
