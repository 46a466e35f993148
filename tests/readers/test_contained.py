"""One face, edge, label or tolerance that cannot be read costs itself, and not the load."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

from relmodel.errors import InputError
from relmodel.store import Store
from tests.loading.test_findings import findings, write_box
from tests.parts.step_parts import loaded
from tests.reading import load

pytest.importorskip("OCP")

from OCP.BRep import BRep_Builder
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox
from OCP.BRepTools import BRepTools, BRepTools_ReShape
from OCP.collections import Array2_gp_Pnt
from OCP.Geom import Geom_BezierSurface, Geom_OffsetSurface
from OCP.gp import gp_Pnt
from OCP.TCollection import TCollection_ExtendedString
from OCP.TDocStd import TDocStd_Document
from OCP.TopoDS import TopoDS, TopoDS_Edge, TopoDS_Face, TopoDS_Wire
from OCP.XCAFDoc import XCAFDoc_DocumentTool

from relmodel.readers.step import faces
from relmodel.readers.step.document import UnreadableError, _Walk
from relmodel.readers.step.shape import extract
from relmodel.readers.step.step_parameters import Findings


def faces_of(shape: Any) -> list[Any]:
    keys = faces.face_map(shape)
    return [TopoDS.Face(keys.FindKey(i)) for i in range(1, keys.Extent() + 1)]


def replaced(shape: Any, old: Any, new: Any) -> Any:
    reshape = BRepTools_ReShape()
    reshape.Replace(old, new)
    return reshape.Apply(shape)


def without_normal(face: Any) -> Any:
    """A face of the same boundary on the offset of a surface that is a line: it has no normal to be offset along."""
    poles = Array2_gp_Pnt(1, 2, 1, 2)
    for i in (1, 2):
        for j in (1, 2):
            poles.SetValue(i, j, gp_Pnt(float(i), 0.0, 0.0))
    out = TopoDS_Face()
    BRep_Builder().MakeFace(out, Geom_OffsetSurface(Geom_BezierSurface(poles), 1.0), 1e-6)
    BRep_Builder().Add(out, BRepTools.OuterWire_s(face))
    return out


def walked(*shapes: Any) -> tuple[_Walk, Findings]:
    """The walk over a document of some products."""
    document, found = TDocStd_Document(TCollection_ExtendedString("test")), Findings()
    tool = XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
    for shape in shapes:
        tool.AddShape(shape, False)
    walk = _Walk(document, {}, found)
    walk.root()
    return walk, found


def test_a_face_that_cannot_be_evaluated_is_a_lost_one() -> None:
    box, other = BRepPrimAPI_MakeBox(1.0, 2.0, 3.0).Shape(), BRepPrimAPI_MakeBox(4.0, 5.0, 6.0).Shape()
    walk, _ = walked(replaced(box, faces_of(box)[0], without_normal(faces_of(box)[0])), other)
    assert walk.faces.Extent() == 5 + 6
    first, second = walk.shapes
    assert sorted(first.surfaces["area"]) == pytest.approx([2, 2, 3, 3, 6])  # one of 2 x 3 mm is lost
    assert (first.kind, first.arcs["convexity"].count("free")) == ("solid", 4)
    assert second.volume == pytest.approx(120)
    with pytest.raises(UnreadableError, match="no face"):
        walked(without_normal(faces_of(box)[0]))


def test_an_edge_that_has_neither_curve_nor_vertex_is_left_out() -> None:
    box = BRepPrimAPI_MakeBox(1.0, 2.0, 3.0).Shape()
    face, edge, wire = faces_of(box)[0], TopoDS_Edge(), TopoDS_Wire()
    builder = BRep_Builder()
    builder.MakeEdge(edge)
    builder.MakeWire(wire)
    keys = faces.edge_map(faces.face_map(face))
    for i in range(1, keys.Extent() + 1):
        builder.Add(wire, keys.FindKey(i))
    builder.Add(wire, edge)
    damaged = replaced(box, BRepTools.OuterWire_s(face), wire)
    shape = extract(damaged)
    assert (len(shape.surfaces["kind"]), len(shape.arcs["kind"])) == (6, 12)


def test_a_limit_of_memory_is_of_the_file_and_not_of_an_item() -> None:
    with pytest.raises(MemoryError), Findings().contained("a name"):
        raise MemoryError


def with_text(path: Path, instances: str) -> Path:
    """A box with more instances, in which @shape, @face and @context stand for those of the box."""
    text = write_box(path).read_text()
    for name, pattern in (
        ("shape", r"(#\d+) = PRODUCT_DEFINITION_SHAPE\("),
        ("product", r"(#\d+) = PRODUCT_DEFINITION\("),
        ("face", r"(#\d+) = ADVANCED_FACE\("),
        ("context", r"ADVANCED_BREP_SHAPE_REPRESENTATION\('',\(.*?\),\s*(#\d+)\)"),
    ):
        (number, *_) = re.findall(pattern, text, re.DOTALL)
        instances = instances.replace(f"@{name}", number)
    at = text.rindex("ENDSEC;")
    path.write_text(text[:at] + instances + text[at:])
    return path


def test_a_tolerance_that_refers_to_itself_leaves_the_others(tmp_path: Path, duckdb_file: Path) -> None:
    path = with_text(
        tmp_path / "box.step",
        """#9101=SHAPE_ASPECT('','',@shape,.T.);
#9102=GEOMETRIC_ITEM_SPECIFIC_USAGE('','',#9101,@context,@face);
#9103=(LENGTH_MEASURE_WITH_UNIT()MEASURE_WITH_UNIT(LENGTH_MEASURE(0.05),#9104));
#9104=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.));
#9105=FLATNESS_TOLERANCE('flat','',#9103,#9101);
#9110=(GEOMETRIC_TOLERANCE('endless','',#9103,#9101)GEOMETRIC_TOLERANCE_WITH_DATUM_REFERENCE((#9111))POSITION_TOLERANCE());
#9111=DATUM_SYSTEM('','',@shape,.F.,(#9112));
#9112=DATUM_REFERENCE_COMPARTMENT('','',@shape,.F.,#9113,$);
#9113=DATUM_REFERENCE_ELEMENT('','',@shape,.F.,#9113,$);
""",
    )
    with Store.open(duckdb_file) as store:
        with pytest.raises(InputError, match=r"a tolerance could not be read .*without --strict"):
            load(store, path, name="box", strict=True)
        report = load(store, path, name="box")
        assert report.findings == (("unread_text", 1),)
        assert "RecursionError" in findings(store)[-1].message
        with store.read() as connection:
            (pmi,) = connection.execute(store.table("part_pmi").select())
            (of,) = connection.execute(store.table("part_pmi_surface").select())
    assert (pmi.type, pmi.name, pmi.value, pmi.unit) == ("flatness", "flat", 0.05, "mm")
    assert of.role == "feature"
    assert len(loaded(path).parts[0].pmi) == 1
