"""What the text of a STEP file says of products and of aspects of their shapes: finish, general properties."""

from __future__ import annotations

import re
from pathlib import Path

from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox
from OCP.gp import gp_Trsf, gp_Vec
from OCP.STEPCAFControl import STEPCAFControl_Writer
from OCP.TCollection import TCollection_ExtendedString
from OCP.TDataStd import TDataStd_Name
from OCP.TDocStd import TDocStd_Document
from OCP.TopLoc import TopLoc_Location
from OCP.XCAFDoc import XCAFDoc_DocumentTool

from relmodel.store import Store
from tests.readers.test_contained import with_text
from tests.reading import load, read_here

TEXTURE = """#9101=SHAPE_ASPECT('','',@shape,.T.);
#9102=GEOMETRIC_ITEM_SPECIFIC_USAGE('','',#9101,@context,@face);
#9104=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MICRO.,.METRE.));
#9120=PROPERTY_DEFINITION('surface_condition','',#9101);
#9121=SURFACE_TEXTURE_REPRESENTATION('surface texture parameter',(#9122,#9123),@context);
#9122=DESCRIPTIVE_REPRESENTATION_ITEM('measuring method','Ra');
#9123=MEASURE_REPRESENTATION_ITEM('characteristic value',LENGTH_MEASURE(3.2),#9104);
#9124=PROPERTY_DEFINITION_REPRESENTATION(#9120,#9121);
#9130=GENERAL_PROPERTY('','finish','');
#9131=GENERAL_PROPERTY_ASSOCIATION('','',#9130,#9132);
#9132=PROPERTY_DEFINITION('finish','',#9101);
#9133=REPRESENTATION('',(#9134),@context);
#9134=DESCRIPTIVE_REPRESENTATION_ITEM('finish','anodised');
#9135=PROPERTY_DEFINITION_REPRESENTATION(#9132,#9133);
"""


def test_the_finish_of_a_face(tmp_path: Path, duckdb_file: Path) -> None:
    """As ISO 10303-1110 has it, and as users define it: of the one face, and of no part."""
    path = with_text(tmp_path / "box.step", TEXTURE)
    (shape,) = read_here(path).shapes
    assert sorted(filter(None, shape.surfaces["finish"])) == ["Ra 3.2 um, anodised"]
    with Store.open(duckdb_file) as store:
        load(store, with_text(tmp_path / "plain.step", ""), name="plain")
        load(store, path, name="box", strict=True)
        with store.read() as connection:
            (row,) = connection.execute(store.table("surface_attribute").select())
            assert len(connection.execute(store.table("shape").select()).all()) == 2
            assert not [r for r in connection.execute(store.table("part_attribute").select()) if r.name == "finish"]
    assert (row.name, row.value_text, row.source) == ("finish", "Ra 3.2 um, anodised", "file")
    assert row.surface_no == shape.surfaces["finish"].index("Ra 3.2 um, anodised")


def test_the_finish_of_a_whole_product(tmp_path: Path) -> None:
    path = with_text(
        tmp_path / "box.step", TEXTURE.replace("'surface_condition','',#9101", "'surface_condition','',@shape")
    )
    (part,) = read_here(path).parts
    assert ("finish", "Ra 3.2 um", None) in part.attributes


PROPERTIES = """#9204=(MASS_UNIT()NAMED_UNIT(*)SI_UNIT(.KILO.,.GRAM.));
#9230=GENERAL_PROPERTY('','revision','');
#9231=GENERAL_PROPERTY_ASSOCIATION('','',#9230,#9232);
#9232=PROPERTY_DEFINITION('revision','',@product);
#9233=REPRESENTATION('',(#9234),@context);
#9234=DESCRIPTIVE_REPRESENTATION_ITEM('revision','C2');
#9235=PROPERTY_DEFINITION_REPRESENTATION(#9232,#9233);
#9240=GENERAL_PROPERTY('','mass as weighed','');
#9241=GENERAL_PROPERTY_ASSOCIATION('','',#9240,#9242);
#9242=PROPERTY_DEFINITION('mass as weighed','',@product);
#9243=REPRESENTATION('',(#9244),@context);
#9244=MEASURE_REPRESENTATION_ITEM('mass',MASS_MEASURE(1.25),#9204);
#9245=PROPERTY_DEFINITION_REPRESENTATION(#9242,#9243);
"""


def write_pair(path: Path) -> Path:
    """An assembly of two boxes, "pair", whose product has a revision and a mass."""
    document = TDocStd_Document(TCollection_ExtendedString("test"))
    tool = XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
    pair = tool.NewShape()
    TDataStd_Name.Set_s(pair, TCollection_ExtendedString("pair"))
    box = tool.AddShape(BRepPrimAPI_MakeBox(1.0, 2.0, 3.0).Shape(), False)
    TDataStd_Name.Set_s(box, TCollection_ExtendedString("block"))
    for x in (0.0, 5.0):
        moved = gp_Trsf()
        moved.SetTranslation(gp_Vec(x, 0, 0))
        tool.AddComponent(pair, box, TopLoc_Location(moved))
    tool.UpdateAssemblies()
    writer = STEPCAFControl_Writer()
    writer.Transfer(document)
    writer.Write(str(path))
    text = path.read_text()
    product = re.search(r"(#\d+) = PRODUCT\('pair'", text)
    assert product is not None
    formation = re.search(rf"(#\d+) = PRODUCT_DEFINITION_FORMATION\w*\([^;]*{product[1]}\b[^;]*;", text)
    assert formation is not None
    definition = re.search(rf"(#\d+) = PRODUCT_DEFINITION\([^;]*{formation[1]}\b[^;]*;", text)
    context = re.search(r"(#\d+) = \( GEOMETRIC_REPRESENTATION_CONTEXT", text)
    assert definition is not None
    assert context is not None
    more = PROPERTIES.replace("@product", definition[1]).replace("@context", context[1])
    at = text.rindex("ENDSEC;")
    path.write_text(text[:at] + more + text[at:])
    return path


def test_general_properties_of_an_assembly(tmp_path: Path, duckdb_file: Path) -> None:
    path = write_pair(tmp_path / "pair.step")
    model = read_here(path)
    stated = (("revision", "C2", None), ("mass as weighed", 1.25, "kg"))
    assert [(a.name, a.attributes) for a in model.assemblies] == [("pair", stated)]
    assert [p.attributes for p in model.parts] == [()]
    with Store.open(duckdb_file) as store:
        load(store, path, name="pair", strict=True)
        with store.read() as connection:
            rows = connection.execute(store.table("object_attribute").select()).all()
    assert {(r.name, r.value_text, r.value_number, r.unit, r.source) for r in rows} == {
        ("revision", "C2", None, None, "file"),
        ("mass as weighed", None, 1.25, "kg", "file"),
    }
