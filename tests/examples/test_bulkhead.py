"""The committed bulkhead against its golden table, counted by the CAD kernel."""

from __future__ import annotations

import gzip
import json
import math
from collections import Counter
from pathlib import Path
from typing import Any

import pytest

EXAMPLES = Path(__file__).parents[2] / "examples"
pytest.importorskip("OCP")


def golden(variant: str) -> dict[str, Any]:
    table: dict[str, Any] = json.loads((EXAMPLES / f"bulkhead/golden/bulkhead_{variant}.json").read_text())
    return table


def text(variant: str) -> str:
    return gzip.decompress((EXAMPLES / f"demo/bulkhead_{variant}.step.gz").read_bytes()).decode()


def count(shape: Any, kind: Any) -> int:
    from OCP.collections import IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher
    from OCP.TopExp import TopExp

    found = IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher()
    TopExp.MapShapes_s(shape, kind, found)
    return int(found.Extent())


@pytest.fixture(scope="module", params=["A", "B"])
def loaded(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[str, dict[str, Any], Any]:
    """Variant, its parts by product name, and the whole shape, as the kernel reads the committed file."""
    from OCP.collections import Sequence_TDF_Label
    from OCP.STEPCAFControl import STEPCAFControl_Reader
    from OCP.TCollection import TCollection_ExtendedString
    from OCP.TDataStd import TDataStd_Name
    from OCP.TDocStd import TDocStd_Document
    from OCP.XCAFApp import XCAFApp_Application
    from OCP.XCAFDoc import XCAFDoc_DocumentTool, XCAFDoc_ShapeTool

    path = tmp_path_factory.mktemp("step") / "part.step"
    path.write_text(text(request.param))
    document = TDocStd_Document(TCollection_ExtendedString("XmlXCAF"))
    XCAFApp_Application.GetApplication_s().InitDocument(document)
    reader = STEPCAFControl_Reader()
    reader.SetNameMode(True)
    reader.ReadFile(str(path))
    assert reader.Transfer(document)
    tool = XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
    labels, free = Sequence_TDF_Label(), Sequence_TDF_Label()
    tool.GetShapes(labels)
    tool.GetFreeShapes(free)
    assert free.Length() == 1
    parts = {}
    for i in range(1, labels.Length() + 1):
        name = TDataStd_Name()
        assert labels.Value(i).FindAttribute(TDataStd_Name.GetID_s(), name)
        parts[str(name.Get().ToExtString())] = XCAFDoc_ShapeTool.GetShape_s(labels.Value(i))
    return request.param, parts, XCAFDoc_ShapeTool.GetShape_s(free.Value(1))


def test_the_file_holds_what_the_golden_table_says(loaded: tuple[str, dict[str, Any], Any]) -> None:
    from OCP.BRepCheck import BRepCheck_Analyzer
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps
    from OCP.TopAbs import TopAbs_EDGE, TopAbs_FACE, TopAbs_SOLID

    variant, parts, whole = loaded
    table = golden(variant)
    assert "AP242_MANAGED_MODEL_BASED_3D_ENGINEERING" in text(variant)[:1000]
    assert sorted(parts) == table["products"]
    assert count(whole, TopAbs_SOLID) == table["solids"]
    for product, row in table["parts"].items():
        shape = parts[product]
        assert BRepCheck_Analyzer(shape).IsValid()
        assert count(shape, TopAbs_SOLID) == 1
        assert count(shape, TopAbs_FACE) == row["faces"] == sum(row["surface_kinds"].values())
        assert count(shape, TopAbs_EDGE) == row["edges"]
        volume = GProp_GProps()
        BRepGProp.VolumeProperties_s(shape, volume)
        assert volume.Mass() == pytest.approx(row["volume_mm3"], rel=1e-6)


def test_holes_are_open_and_their_rims_are_metal(loaded: tuple[str, dict[str, Any], Any]) -> None:
    """The kernel's point classifier: air on every hole's axis and just inside its radius, metal just outside."""
    from OCP.BRepClass3d import BRepClass3d_SolidClassifier
    from OCP.gp import gp_Pnt
    from OCP.TopAbs import TopAbs_IN, TopAbs_OUT

    variant, parts, _ = loaded
    classifier = BRepClass3d_SolidClassifier(parts["BULKHEAD_BODY"])

    def state(x: float, y: float, z: float) -> Any:
        classifier.Perform(gp_Pnt(x, y, z), 1e-7)
        return classifier.State()

    holes = [f for f in golden(variant)["features"] if f["kind"].endswith("_hole")]
    assert Counter(f["kind"] for f in holes)["lightening_hole"] >= 30
    for hole in holes:
        x, y = hole["centre"]
        z = (hole["box"][2] + hole["box"][5]) / 2
        assert state(x, y, z) == TopAbs_OUT, hole["name"]
        for k in range(4):
            c, s = math.cos(0.4 + k * math.pi / 2), math.sin(0.4 + k * math.pi / 2)
            for radius, expected in ((hole["radius"] - 0.01, TopAbs_OUT), (hole["radius"] + 0.01, TopAbs_IN)):
                assert state(x + radius * c, y + radius * s, z) == expected, hole["name"]


def test_the_change_list_is_the_difference_of_the_tables() -> None:
    before, after = ({f["name"]: f for f in golden(v)["features"]} for v in "AB")
    listed = {
        c["name"]: c["change"] for c in json.loads((EXAMPLES / "bulkhead/golden/changes_A_to_B.json").read_text())
    }
    assert {n for n, c in listed.items() if c == "added"} == after.keys() - before.keys() == {"LUG_7"}
    assert {n for n, c in listed.items() if c == "removed"} == before.keys() - after.keys()
    assert {"LH11", "LH20"} <= before.keys() - after.keys()
    changed = {n for n in before.keys() & after.keys() if before[n] != after[n]}
    assert {n for n, c in listed.items() if c == "changed"} == changed


def test_the_generator_makes_the_committed_body() -> None:
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps
    from OCP.TopAbs import TopAbs_FACE

    from examples.bulkhead import solids
    from examples.bulkhead.design import variant_a

    row = golden("A")["parts"]["BULKHEAD_BODY"]
    body = solids.body(variant_a())
    volume = GProp_GProps()
    BRepGProp.VolumeProperties_s(body, volume)
    assert count(body, TopAbs_FACE) == row["faces"]
    assert volume.Mass() == pytest.approx(row["volume_mm3"], rel=1e-6)
