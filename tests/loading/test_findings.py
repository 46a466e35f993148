"""Every valid file loads: what is not as it should be are rows, and check and load go by one rule."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from relmodel.app.cli.main import main
from relmodel.errors import InputError
from relmodel.loading import load as deriving
from relmodel.model.model import Model
from relmodel.model.validation import validated
from relmodel.store import Store
from tests.readers.test_step_tessellated import CUBE
from tests.reading import load, read_here
from tests.store.amiss import MODEL, flaws


def write_box(path: Path, unit: str = "MM", *, volume: float | None = None, area: float | None = None) -> Path:
    """A box of 25.4 x 50.8 x 76.2 mm as STEP, with the volume and area that it is said to have, in mm3 and mm2."""
    pytest.importorskip("OCP")
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox
    from OCP.Interface import Interface_Static
    from OCP.STEPCAFControl import STEPCAFControl_Writer
    from OCP.TCollection import TCollection_ExtendedString
    from OCP.TDocStd import TDocStd_Document
    from OCP.XCAFDoc import XCAFDoc_Area, XCAFDoc_DocumentTool, XCAFDoc_Volume

    document = TDocStd_Document(TCollection_ExtendedString("test"))
    tool = XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
    label = tool.AddShape(BRepPrimAPI_MakeBox(25.4, 50.8, 76.2).Shape(), False)
    if volume is not None:
        XCAFDoc_Volume.Set_s(label, volume)
    if area is not None:
        XCAFDoc_Area.Set_s(label, area)
    writer = STEPCAFControl_Writer()
    writer.SetPropsMode(True)
    Interface_Static.SetCVal_s("write.step.unit", unit)
    try:
        writer.Transfer(document)
        writer.Write(str(path))
    finally:
        Interface_Static.SetCVal_s("write.step.unit", "MM")
    return path


def findings(store: Store) -> list[Any]:
    with store.read() as connection:
        return list(connection.execute(store.table("load_finding").select()).all())


@pytest.mark.parametrize("unit", ["derived", "named", "of the context"])
def test_volume_and_area_stated_in_inches(unit: str, tmp_path: Path) -> None:
    """1 x 2 x 3 inches: 6 cubic inches are 98322.384 mm3, 22 square inches 14193.52 mm2.

    The unit is derived from the inch, as ISO 10303-41 has it, has a name and dimension besides, or is the context's."""
    path = write_box(tmp_path / "box.step", "INCH", volume=6.0, area=22.0)
    text = path.read_text()
    inch = re.findall(r"(#\d+) = \( CONVERSION_BASED_UNIT\('INCH'", text)[0]
    text, count = re.subn(r"(DERIVED_UNIT_ELEMENT\()#\d+", rf"\g<1>{inch}", text)
    assert count == 2
    if unit == "named":
        text = re.sub(r"DERIVED_UNIT\(\((#\d+)\)\);", r"( DERIVED_UNIT((\g<1>)) NAMED_UNIT(*) );", text)
    elif unit == "of the context":
        text = re.sub(r"((?:AREA|VOLUME)_MEASURE\(\s*[\d.]+\),\s*)#\d+", r"\g<1>$", text)
    path.write_text(text)
    model = validated(read_here(path))
    (part,), (shape,) = model.parts, model.shapes
    assert not (*model.findings, *shape.findings)
    stated: dict[str, Any] = {name: (value, unit) for name, value, unit in part.attributes}
    assert stated["validation volume"] == (pytest.approx(98322.384), "mm3")
    assert stated["validation area"] == (pytest.approx(14193.52), "mm2")
    assert [shape.volume, shape.surfaces["area"].sum()] == pytest.approx([98322.384, 14193.52])


def test_a_stated_volume_that_is_not_its_own_is_a_finding(duckdb_file: Path, tmp_path: Path) -> None:
    path = write_box(tmp_path / "box.step", volume=98322.384 * 1.02)
    with Store.open(duckdb_file) as store:
        with pytest.raises(InputError, match=r"box\.step has 1 finding, the first: .*volume.*without --strict"):
            load(store, path, name="box", strict=True)
        (refused,) = findings(store)
        assert (refused.kind, refused.part_id, refused.shape_id) == ("stated_volume", None, None)
        report = load(store, path, name="box")
        assert (report.status, report.findings) == ("added", (("stated_volume", 1),))
        _, row = findings(store)
        assert (row.run_id, row.value, row.bound, row.unit) == (
            report.run,
            pytest.approx(0.02 * 98322.384),
            pytest.approx(0.005 * 98322.384),
            "mm3",
        )
        assert row.part_id is not None
        assert (row.surface_id, row.arc_id) == (None, None)


@pytest.mark.parametrize(("off", "kinds"), [(0.05, ()), (0.15, ("open_loop",))])
def test_a_vertex_beside_its_edges(off: float, kinds: tuple[str, ...], duckdb_file: Path, tmp_path: Path) -> None:
    """One end of the edges is moved: valid within the tolerance that the kernel states, else a finding."""
    path = write_box(tmp_path / "box.step")
    text = path.read_text()
    point = re.findall(r"VERTEX_POINT\('',(#\d+)", text)[0]
    corner = re.search(rf"{point} = CARTESIAN_POINT\('',\(0\.,0\.,0\.\)\)", text)
    assert corner is not None
    path.write_text(text.replace(corner[0], corner[0].replace("(0.,0.,0.)", f"({off},0.,0.)")))
    with Store.open(duckdb_file) as store:
        report = load(store, path, name="box")
        assert report.status == "added"
        # The triangles go to the vertex.
        assert {kind for kind, _ in report.findings} - {"edge_off_face", "mesh_deviation"} == set(kinds)
        assert not flaws(store, *MODEL)
        with store.read() as connection:
            coedges = connection.execute(store.table("coedge").select()).all()
        assert max(c.tolerance for c in coedges) >= min(off, 0.1)
        assert min(c.tolerance for c in coedges) == pytest.approx(0.01)
        for row in findings(store):
            assert row.value > row.bound > 0
            assert row.bound <= 0.1


def test_what_was_fitted_to_a_mesh_passes_the_check(duckdb_file: Path, tmp_path: Path) -> None:
    """A turned post with noise of 0.03 mm: edges lie further off the fitted faces than 0.01 mm."""
    post = trimesh.creation.cylinder(10.0, 30.0, sections=32)
    rng = np.random.default_rng(1)
    post.vertices += rng.normal(scale=0.03, size=post.vertices.shape)
    post.export(tmp_path / "post.ply")
    with Store.open(duckdb_file) as store:
        load(store, tmp_path / "post.ply", name="post", unit="mm")
        assert not flaws(store, *MODEL)


def test_lost_faces_are_refused_unless_what_is_left_is_asked_for(duckdb_file: Path, tmp_path: Path) -> None:
    """A block of six faces of triangles, one of which has none."""
    pytest.importorskip("OCP")
    path = tmp_path / "block.stp"
    path.write_text(CUBE.replace("((5,6,7),(5,7,8))", "()"))
    with Store.open(duckdb_file) as store:
        with pytest.raises(InputError, match=r"1 of 6 faces of .*block\.stp were lost .*--allow-partial"):
            load(store, path, name="block")
        report = load(store, path, name="block", allow_partial=True)
        assert (report.status, report.message) == ("partial", "the file lists 6 faces and 5 were read")
        assert ("lost_faces", 1) in report.findings
        (row,) = (r for r in findings(store) if r.kind == "lost_faces" and r.run_id == report.run)
        assert (row.value, row.bound, row.unit, row.part_id) == (1, 0, None, None)


def test_a_recogniser_never_costs_a_load(duckdb_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object) -> None:
        raise ZeroDivisionError("no direction")

    monkeypatch.setattr(deriving, "recognise", fail)
    with Store.open(duckdb_file) as store:
        report = load(store, write_box(tmp_path / "box.step"), name="box")
        (row,) = findings(store)
        assert row.kind == "features_failed"
        assert "ZeroDivisionError: no direction" in row.message
        assert (report.surfaces_added, report.status) == (6, "added")
        assert row.shape_id is not None


@pytest.mark.usefixtures("reads_here")
def test_one_line_says_what_was_found_and_show_lists_it(
    duckdb_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = write_box(tmp_path / "box.step", volume=1e5, area=2e4)
    assert main(["load", str(path), "--store", str(duckdb_file)]) == 0
    said = capsys.readouterr().err.splitlines()
    assert said[-1] == (
        "box.step: loaded with 2 findings: stated_area 1, stated_volume 1; "
        "ask: SELECT * FROM load_finding WHERE run_id = 1"
    )
    assert main(["show", "box", "--store", str(duckdb_file)]) == 0
    assert "stated_area 1, stated_volume 1" in capsys.readouterr().out
    assert main(["load", str(path), "--strict", "--object", "other", "--store", str(duckdb_file)]) == 3
    assert "load it without --strict" in capsys.readouterr().err


def test_a_model_without_kernel_tolerances_is_held_to_a_hundredth(tmp_path: Path) -> None:
    """An arc that was moved by 0.02 mm, in a shape that no kernel made a statement about."""
    model = read_here(write_box(tmp_path / "box.step"))
    shape = model.shapes[0]
    arcs = {name: column for name, column in shape.arcs.items() if name != "tolerance"}
    moved = arcs | {"start_x": np.asarray(arcs["start_x"]) + 0.02 * (np.arange(12) == 3)}
    bare = replace(shape, arcs=moved, findings=())
    (found,) = validated(Model(**{**vars(model), "shapes": (bare,)})).shapes
    assert {f.kind for f in found.findings} == {"open_loop"}
    assert {f.bound for f in found.findings} == {0.01}
    assert all(f.value == pytest.approx(0.02) for f in found.findings)
