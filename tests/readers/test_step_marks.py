"""What a STEP file says beside its geometry, against its own text (by plain regular expressions) and its geometry."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut
from OCP.BRepBuilderAPI import BRepBuilderAPI_NurbsConvert, BRepBuilderAPI_Transform
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeCone, BRepPrimAPI_MakeCylinder, BRepPrimAPI_MakeSphere
from OCP.gp import gp_Ax1, gp_Ax2, gp_Dir, gp_Pnt, gp_Trsf

from relmodel.arrays import take
from relmodel.errors import InputError
from relmodel.features import recognise
from relmodel.find.find import world_named
from relmodel.model.content_keys import model_keys, share
from relmodel.model.model import Pmi, Shape
from relmodel.readers.step.part21 import Instances, TypedValue, measure
from relmodel.readers.step.properties import _PmiReader
from relmodel.readers.step.step_parameters import Findings
from relmodel.store import Store
from relmodel.world.placement import place_world
from tests.parts.step_parts import bracket_with_sheet_and_line, compound, loaded, write_product
from tests.reading import load, read_here, shared, store_model
from tests.store.amiss import MODEL, flaws
from vision.scene import read_scene


@cache
def instances(path: Path) -> dict[str, str]:
    """Text of each instance by its number, blanks taken out; of files whose strings hold no semicolon."""
    text = re.sub(r"\s", "", path.read_text("latin-1"))
    return dict(re.findall(r"(#\d+)=([^;]*);", text[text.index("DATA;") :]))


def found(path: Path, pattern: str) -> list[Any]:
    """What a pattern matches in the text of a file."""
    return re.findall(pattern, ";".join(f"{n}={text}" for n, text in instances(path).items()))


def pmi(path: Path, kind: str) -> list[tuple[Pmi, Shape]]:
    model = loaded(path)
    return [(one, model.shapes[part.shape]) for part in model.parts for one in part.pmi if one.kind == kind]


# Of two files how often each dimension is there: type, value and limits (mm or rad); and each tolerance: type, width
# and modifier.
DIMENSIONS = {
    "nist_ctc_01_asme1_ap242.stp": {
        ("linear distance", None, None, None): 2, ("diameter", None, None, None): 2,
        ("angle", 1.047198, 1.038471, 1.055924): 1, ("diameter", 35.0, 34.8, 35.0): 1,
        ("diameter", 35.0, 35.0, 35.2): 1, ("diameter", 35.0, 34.8, 35.2): 2, ("diameter", 20.0, 19.9, 20.05): 1,
        ("diameter", 20.0, 19.95, 20.1): 1, ("diameter", 25.0, 24.85, 25.15): 1,
    },
    "nist_ctc_02_asme1_ap242.stp": {
        ("diameter", 100.0, 99.85, 100.15): 1, ("diameter", 52.0, 51.85, 52.15): 1,
        ("diameter", 12.0, 11.95, 12.05): 2, ("diameter", 22.0, 21.9, 22.1): 2, ("diameter", 40.0, 39.85, 40.15): 1,
    },
}  # fmt: skip
LEAST, MOST = "least material requirement", "maximum material requirement"
TOLERANCES = {
    "nist_ctc_01_asme1_ap242.stp": {
        ("position", 0.75, None): 2, ("surface profile", 1.25, None): 1, ("surface profile", 0.5, None): 1,
        ("perpendicularity", 1.5, None): 1, ("flatness", 0.2, None): 1,
    },
    "nist_ctc_02_asme1_ap242.stp": {
        ("surface profile", 0.1, None): 1, ("surface profile", 2.5, None): 3, ("surface profile", 0.8, None): 4,
        ("surface profile", 0.5, None): 4, ("surface profile", 0.75, None): 1, ("line profile", 0.25, None): 1,
        ("flatness", 0.05, None): 1, ("perpendicularity", 0.1, LEAST): 1, ("perpendicularity", 0.05, None): 1,
        ("perpendicularity", 0.254, None): 1, ("position", 0.05, None): 1, ("position", 1.5, MOST): 1,
        ("position", 1.0, LEAST): 1, ("position", 0.15, LEAST): 1,
    },
}  # fmt: skip


@pytest.mark.data
@pytest.mark.parametrize("name", DIMENSIONS)
def test_dimensions_tolerances_and_datums_are_those_of_the_text(data_dir: Path, name: str) -> None:
    """By the reader of the text alone: geometry takes most of the time."""
    path = data_dir / "step" / name
    stated = [one.pmi for one in _PmiReader(Instances(path.read_bytes())).all(Findings())]
    said = {kind: [one for one in stated if one.kind == kind] for kind in ("dimension", "tolerance", "datum")}

    def rounded(*numbers: float | None) -> list[float | None]:
        return [None if x is None else round(x, 6) for x in numbers]

    limits = (rounded(one.value, one.lower_limit, one.upper_limit) for one in said["dimension"])
    assert Counter((one.type, *ends) for one, ends in zip(said["dimension"], limits, strict=True)) == DIMENSIONS[name]
    widths = Counter((one.type, *rounded(one.value), one.modifier) for one in said["tolerance"])
    assert widths == TOLERANCES[name]
    datums = Counter(one.type for one in said["datum"])
    assert datums["feature"] == len(found(path, r"=DATUM_FEATURE\("))
    targets = found(path, r"=PLACED_DATUM_TARGET_FEATURE\('[^']*','(\w*)',#\d+,\.T\.,'(\w*)'\)")
    assert Counter(one.modifier for one in said["datum"] if one.type == "target") == Counter(map(" ".join, targets))
    letters = set(found(path, r"=DATUM\('',\$,#\d+,\.F\.,'(\w)'\)"))
    assert {one.datums[0][1] for one in said["datum"]} == letters
    assert {letter for one in said["tolerance"] for _, letter, _ in one.datums} <= letters


@pytest.mark.data
def test_pmi_is_of_surfaces_that_have_what_it_says(data_dir: Path) -> None:
    path = data_dir / "step/nist_ctc_01_asme1_ap242.stp"
    for one, shape in pmi(path, "dimension"):
        surfaces = [s for s, _ in one.surfaces]
        kinds = {str(shape.surfaces["recognised_kind"][s]) for s in surfaces}
        assert surfaces
        if one.type == "diameter":
            assert kinds == {"cylinder"}
        if one.type == "diameter" and one.value is not None:
            assert one.lower_limit is not None
            assert one.upper_limit is not None
            for s in surfaces:
                assert one.lower_limit - 1e-6 <= 2 * shape.surfaces["radius"][s] <= one.upper_limit + 1e-6
        if one.type == "angle":
            assert (kinds, [role for _, role in one.surfaces]) == ({"plane"}, ["origin", "target"])
            a, b = (np.array([shape.surfaces[f"axis_z_{c}"][s] for c in "xyz"]) for s in surfaces)
            assert one.value == pytest.approx(np.arccos(np.abs(a @ b)), abs=1e-6)
    for one, shape in pmi(path, "tolerance"):
        assert one.surfaces
        if one.type in ("flatness", "perpendicularity"):
            assert {shape.surfaces["kind"][s] for s, _ in one.surfaces} <= {"plane", "cylinder"}
        if one.type == "flatness":
            assert not one.datums


def test_pmi_of_a_shape_that_lists_its_surfaces_in_another_order(tmp_path: Path, duckdb_file: Path) -> None:
    """The same box, once written from a turned copy of itself, is one shape: PMI stays with its face."""
    # The order in the store is that of the first file; `write_pmi` looks it up by content.
    path = write_product(tmp_path / "box.step", bracket_with_sheet_and_line(), "bracket")
    model = shared(path)
    top = int(np.argmax(np.asarray(model.shapes[0].surfaces["centroid_z"])))
    with Store.open(duckdb_file) as store:
        load(store, path, name="plain")
        shape, before = model.shapes[0], model_keys(model).shapes[0].shape
        order = np.arange(6)[::-1]
        turned = replace(
            shape,
            surfaces=take(shape.surfaces, order),
            coedges=shape.coedges | {"surface_no": 5 - np.asarray(shape.coedges["surface_no"])},
            loops=shape.loops | {"surface_no": 5 - np.asarray(shape.loops["surface_no"])},
        )
        datum = Pmi("datum", "feature", "", datums=((1, "A", None),), surfaces=((5 - top, "feature"),))
        parts = (replace(model.parts[0], pmi=(datum,)), *model.parts[1:])
        model = replace(model, shapes=(turned, *model.shapes[1:]), parts=parts)
        assert model_keys(model).shapes[0].shape == before
        store_model(store, model, "labelled")
        with store.read() as connection:
            (row,) = connection.execute(store.table("part_pmi_surface").select())
            assert row.surface_no == top


@pytest.mark.data
def test_materials_with_the_unit_of_the_file(data_dir: Path) -> None:
    (part,) = loaded(data_dir / "step/conical-surface.step").parts
    assert part.material == "Steel"
    assert part.attributes == (("density", 7850.0, "kg/m3"), ("density as stated", 7850.0, "kg/m3"))
    # In this file the unit is g3 cm2, as the kernel writes g/cm3; of the bolt the text leads nowhere.
    path = data_dir / "step/dm1-oc-214.stp"
    parts = {part.name: part for part in loaded(path).parts}
    assert parts["nut"].attributes == (("density", 8210.195, "kg/m3"), ("density as stated", 8.210195, "g3.cm2"))
    assert parts["l-bracket"].attributes == (("density", 4423.001, "kg/m3"), ("density as stated", 4.423001, "g3.cm2"))
    assert parts["bolt"].attributes == ()
    names = re.findall(r"DESCRIPTIVE_REPRESENTATION_ITEM\('(AMS[^']*)'", path.read_text("latin-1"))
    assert sorted(str(part.material) for part in parts.values()) == sorted(names)


def test_units_are_told_and_converted() -> None:
    text = b"""DATA;
        #1=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.));
        #2=LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(25.4),#1);
        #3=(CONVERSION_BASED_UNIT('INCH',#2)LENGTH_UNIT()NAMED_UNIT(#9));
        #4=(MASS_UNIT()NAMED_UNIT(*)SI_UNIT(.KILO.,.GRAM.));
        #5=MASS_MEASURE_WITH_UNIT(MASS_MEASURE(0.45359237),#4);
        #6=(CONVERSION_BASED_UNIT('POUND',#5)MASS_UNIT()NAMED_UNIT(#9));
        #7=DERIVED_UNIT_ELEMENT(#6,1.); #8=DERIVED_UNIT_ELEMENT(#3,-3.); #10=DERIVED_UNIT((#7,#8));
        /* #11=NONE('of this'); */
        #12=MEASURE_REPRESENTATION_ITEM('density measure; it''s',POSITIVE_RATIO_MEASURE(0.1),#10);
        ENDSEC;"""
    of = Instances(text)
    assert [of.ordinal(n) for n in (1, 8, 10, 12, 9, 11)] == [0, 7, 8, 9, None, None]
    assert len(of) == 10
    assert of[2] == {"LENGTH_MEASURE_WITH_UNIT": [TypedValue("LENGTH_MEASURE", [25.4]), 1]}
    assert of.of("CONVERSION_BASED_UNIT") == [3, 6]
    one = measure(of, 12)
    assert one is not None
    assert one.unit is not None
    assert (one.name, one.value, one.unit.symbol) == ("density measure; it's", 0.1, "lb/in3")
    assert one.within({"mass": 1.0, "length": -3.0}, 1.0) == pytest.approx(2767.990471)  # an aluminium
    assert one.within({"mass": 1.0}, 1.0) is None


@pytest.mark.data
@pytest.mark.parametrize("name", ["as1-tu-203.stp", "nist_ctc_01_asme1_ap242.stp"])
def test_validation_properties_are_those_of_the_text_and_of_the_geometry(data_dir: Path, name: str) -> None:
    path = data_dir / "step" / name
    model = loaded(path)
    volumes = {round(float(v), 6) for v in found(path, r"VOLUME_MEASURE\(([-+.\dE]+)\)")}
    areas = {round(float(v), 6) for v in found(path, r"AREA_MEASURE\(([-+.\dE]+)\)")}
    for part in model.parts:
        shape = model.shapes[part.shape]
        if shape.kind == "solid":
            stated = {name: value for name, value, _ in part.attributes}
            assert round(float(stated["validation volume"]), 6) in volumes
            assert round(float(stated["validation area"]), 6) in areas
            assert shape.volume == pytest.approx(stated["validation volume"], rel=1e-3)
            assert np.sum(shape.surfaces["area"]) == pytest.approx(stated["validation area"], rel=1e-3)
            assert {f"validation centroid {c}" for c in "xyz"} <= set(stated)
    if name.startswith("as1"):
        assert all(len(assembly.attributes) >= 5 for assembly in model.assemblies)


@pytest.mark.data
def test_layers_and_colours_are_those_of_the_text(data_dir: Path) -> None:
    as1 = loaded(data_dir / "step/as1-tu-203.stp")
    assert {layer for shape in as1.shapes for layer in shape.surfaces["layer"]} == {"256"}

    cube = data_dir / "step/red_cube_blue_cylinder.step"
    written = {tuple(float(x) for x in rgb) for rgb in found(cube, r"COLOUR_RGB\('',([\d.]+),([\d.]+),([\d.]+)\)")}
    red, blue = sorted(("#" + "".join(f"{round(255 * x):02x}" for x in rgb) for rgb in written), reverse=True)
    model = loaded(cube)
    for part in model.parts:
        expected = red if part.name.startswith("red") else blue
        assert set(model.shapes[part.shape].surfaces["colour"]) == {expected}
    (sg1,) = loaded(data_dir / "step/sg1-c5-214.stp").parts
    (rgb,) = found(data_dir / "step/sg1-c5-214.stp", r"COLOUR_RGB\('Colour',([\d.]+),([\d.]+),([\d.]+)\)")
    assert sg1.colour == "#" + "".join(f"{round(255 * float(x)):02x}" for x in rgb)


def test_what_is_no_material_is_left_out(tmp_path: Path, duckdb_file: Path) -> None:
    path = write_product(tmp_path / "bracket.step", bracket_with_sheet_and_line(), "bracket")
    (tmp_path / "world.yaml").write_text("world: w\nobjects:\n  - {object: bracket, name: b}\n")
    with Store.open(duckdb_file) as store:
        report = load(store, path, name="bracket", variant="")
        assert (report.status, report.parts, report.occurrences) == ("added", 1, 1)
        assert report.findings == (("left_out", 1),)
        place_world(store, tmp_path / "world.yaml")
        assert not flaws(store, *MODEL)
        with store.read() as connection:
            assert [p.name for p in connection.execute(store.table("part").select())] == ["bracket"]
            assert [s.kind for s in connection.execute(store.table("shape").select())] == ["solid"]
            world, _ = world_named(store, connection, None)
            assert read_scene(store, connection, world).scene.vertices[:, 2].max() == 10.0


def test_wrappers_of_one_body_are_collapsed(tmp_path: Path) -> None:
    box = BRepPrimAPI_MakeBox(30.0, 20.0, 10.0).Shape()
    wrapped = compound(compound(compound(box)))
    path = write_product(tmp_path / "wrapped.step", wrapped, "bracket", as_assembly=True)
    assert len(re.findall(r"= PRODUCT\(", path.read_text())) == 4  # three around the box
    model = shared(path)
    assert [part.name for part in model.parts] == ["bracket"]
    (assembly,) = model.assemblies
    assert [(one.name, one.kind) for one in assembly.instances] == [("bracket", "part")]


def test_names_of_faces_in_the_file(tmp_path: Path) -> None:
    maker = BRepPrimAPI_MakeBox(30.0, 20.0, 10.0)
    named = {"seat": maker.TopFace(), "datum A": maker.BottomFace()}
    path = write_product(tmp_path / "box.step", maker.Shape(), "box", names=named)
    (shape,) = shared(path).shapes
    heights = {n: z for n, z in zip(shape.surfaces["name"], shape.surfaces["centroid_z"], strict=True) if n}
    assert heights == pytest.approx({"seat": 10.0, "datum A": 0.0})


def test_units_of_length(tmp_path: Path) -> None:
    """A unit with a name of its own is as long as the file says; one that nothing tells of is refused."""
    path = write_product(tmp_path / "box.step", BRepPrimAPI_MakeBox(30.0, 20.0, 10.0).Shape(), "box")
    text = path.read_text()
    millimetre = "( LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT(.MILLI.,.METRE.) )"
    assert millimetre in text
    last = f"#90001=LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(457.2),#90002);#90002={millimetre};ENDSEC;\nEND-ISO"
    cubit = text.replace(millimetre, "( CONVERSION_BASED_UNIT('CUBIT',#90001) LENGTH_UNIT() NAMED_UNIT(#90003) )")
    cubit = cubit.replace("ENDSEC;\nEND-ISO", "#90003=DIMENSIONAL_EXPONENTS(1.,0.,0.,0.,0.,0.,0.);" + last)
    path.write_text(cubit)
    model = shared(path)
    assert (model.unit, model.unit_mm) == ("cubit", 457.2)
    assert model.shapes[0].volume == pytest.approx(6000 * 457.2**3)
    path.write_text(text.replace(millimetre, "( LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT(.DECA.,.METRE.) )"))
    model = shared(path)
    assert model.unit_mm == 1e4
    assert model.shapes[0].volume == pytest.approx(6e15)
    path.write_text(text.replace(millimetre, "( CONTEXT_DEPENDENT_UNIT('CUBIT') LENGTH_UNIT() NAMED_UNIT(*) )"))
    with pytest.raises(InputError, match=r"no known unit of length: export it in one such as the millimetre"):
        shared(path)


def test_what_is_stored_as_splines_is_recognised(tmp_path: Path) -> None:
    """A block with a bore, a cone and a part of a sphere cut out, all turned into b-splines."""
    up = gp_Dir(0, 0, 1)
    part = BRepPrimAPI_MakeBox(60.0, 40.0, 20.0).Shape()
    for tool in (
        BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(15, 20, -5), up), 6.0, 40.0),
        BRepPrimAPI_MakeCone(gp_Ax2(gp_Pnt(35, 20, 10), up), 4.0, 9.0, 15.0),
        BRepPrimAPI_MakeSphere(gp_Pnt(52, 20, 20), 5.0),
    ):
        part = BRepAlgoAPI_Cut(part, tool.Shape()).Shape()
    path = write_product(tmp_path / "block.step", BRepBuilderAPI_NurbsConvert(part, True).Shape(), "block")
    assert len(re.findall(r"B_SPLINE_SURFACE\(|B_SPLINE_SURFACE_WITH_KNOTS\(", path.read_text())) >= 10
    (shape,) = shared(path).shapes
    assert set(shape.surfaces["kind"]) == {"spline"}
    recognised = Counter(map(str, shape.surfaces["recognised_kind"]))
    assert recognised == {"plane": 7, "cylinder": 1, "cone": 1, "sphere": 1}  # the seventh at the end of the cone
    for kind, name, size in (
        ("cylinder", "radius", 6),
        ("sphere", "radius", 5),
        ("cone", "semi_angle", np.arctan(1 / 3)),
    ):
        row = list(shape.surfaces["recognised_kind"]).index(kind)
        assert abs(shape.surfaces[name][row]) == pytest.approx(size)
        assert kind == "sphere" or abs(shape.surfaces["axis_z_z"][row]) == pytest.approx(1)
    assert {"line", "circle"} <= set(shape.arcs["recognised_kind"])
    assert "through_hole" in {feature.kind for feature in recognise(shape)}


def test_pmi_goes_along_where_congruent_shapes_become_one(tmp_path: Path) -> None:
    turn = gp_Trsf()
    turn.SetRotation(gp_Ax1(gp_Pnt(70, 0, 0), gp_Dir(1, 2, 3)), 1.0)
    box = BRepPrimAPI_MakeBox(30.0, 20.0, 10.0).Shape()
    two = compound(box, BRepBuilderAPI_Transform(box, turn, True).Shape())
    model = read_here(write_product(tmp_path / "two.step", two, "two"))
    first, second = model.parts
    before = model.shapes[second.shape].surfaces
    centre = [np.array([before[f"centroid_{c}"][i] for c in "xyz"]) for i in range(6)]
    named = enumerate("ABCDEF")
    pmi = [Pmi("datum", "feature", "", datums=((1, c, None),), surfaces=((i, "feature"),)) for i, c in named]
    model = share(replace(model, parts=(first, replace(second, pmi=tuple(pmi)))))
    first, second = model.parts
    assert first.shape == second.shape == 0
    (instance,) = (one for a in model.assemblies for one in a.instances if one.kind == "part" and one.child == 1)
    after = model.shapes[0].surfaces
    for i, one in enumerate(second.pmi):
        ((surface, _),) = one.surfaces
        moved = instance.parent_from_child @ [*(after[f"centroid_{c}"][surface] for c in "xyz"), 1.0]
        assert moved[:3] == pytest.approx(centre[i], abs=1e-6)
