"""STEP files: names and units, what loading them reports, and what is refused or counted from the text."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from OCP.BRepPrimAPI import BRepPrimAPI_MakeCylinder

from relmodel.errors import InputError
from relmodel.readers.step import part21
from relmodel.readers.step.part21 import Instances
from tests.parts.step_parts import loaded, write_product
from tests.placed_parts import PlacedParts
from tests.reading import shared


@pytest.mark.data
def test_names_and_units(data_dir: Path) -> None:
    model = loaded(data_dir / "step" / "as1-tu-203.stp")
    assert {part.name for part in model.parts} == {"nut", "bolt", "rod", "plate", "l-bracket"}
    assert {a.name for a in model.assemblies} == {"as1", "rod-assembly", "nut-bolt-assembly", "l-bracket-assembly"}
    root = model.assemblies[model.root]
    assert [i.name for i in root.instances] == [
        "ROD-ASSEMBLY",
        "L-BRACKET-ASSEMBLY::1",
        "PLATE",
        "L-BRACKET-ASSEMBLY::2",
    ]
    for name, unit, unit_mm in (("cube-m.step", "metre", 1000.0), ("cube-in.step", "inch", 25.4)):
        model = loaded(data_dir / "step" / name)
        assert (model.unit, model.unit_mm) == (unit, unit_mm)
        shape = model.shapes[0]
        assert shape.surfaces["area"] == pytest.approx(np.full(6, 1e6))
        assert shape.volume == pytest.approx(1e9)


# Faces that a product of the file has, distinct parts, placed parts.
EXPECTED = {"abstract_pca.step": (9, 2, 2), "as1-tu-203.stp": (53, 5, 18)}


@pytest.mark.data
@pytest.mark.parametrize("name", EXPECTED)
def test_files_are_read_whole(data_dir: Path, name: str) -> None:
    model = loaded(data_dir / "step" / name)
    placed = len(PlacedParts(model).of(model.root).shape)
    assert (model.faces_loaded, len(model.parts), placed) == EXPECTED[name]
    text = (data_dir / "step" / name).read_text("latin-1")
    assert model.faces_in_file == len(re.findall(r"=\s*ADVANCED_FACE\s*\(", text)) == model.faces_loaded


@pytest.mark.data
def test_a_face_that_another_refers_to_is_missed(data_dir: Path, tmp_path: Path) -> None:
    text = (data_dir / "step" / "cube-in.step").read_text()
    robbed = tmp_path / "robbed.step"
    at = text.rindex("#", 0, text.index("ADVANCED_FACE"))
    robbed.write_text(text[:at] + text[text.index(";", at) + 1 :])
    model = shared(robbed)
    assert (model.faces_in_file, model.faces_loaded) == (5, 5)
    (finding,) = [one for one in model.findings if one.kind == "damaged_text"]
    assert re.fullmatch(r"the file refers to #\d+, which it does not hold", finding.message)


def test_what_is_not_step_is_refused_in_one_sentence(tmp_path: Path) -> None:
    letter = tmp_path / "letter.step"
    letter.write_text("Dear Sir or Madam")
    with pytest.raises(InputError, match="not a STEP file"):
        shared(letter)
    with pytest.raises(InputError, match="no file"):
        shared(tmp_path / "absent.step")
    bad = tmp_path / "bad.step.gz"
    bad.write_bytes(b"nothing packed")
    with pytest.raises(InputError, match="unpacked"):
        shared(bad)


def test_counting_is_not_fooled_by_strings_and_comments(tmp_path: Path) -> None:
    path = tmp_path / "few.step"
    path.write_text(
        "ISO-10303-21;\nHEADER;\nFILE_SCHEMA(('CONFIG_CONTROL_DESIGN'));\nENDSEC;\nDATA;\n"
        "#1=ADVANCED_FACE('it''s ADVANCED_FACE(',(#2),#3,.T.);\n/* #9=ADVANCED_FACE('',(#2),#3,.T.); */\n"
        "#4 = FACE_SURFACE ('', (#2), #3, .T.);\n#5=CLOSED_SHELL('',(#1));\n"
        "#6=ADVANCED_BREP_SHAPE_REPRESENTATION('',(#5),#7);\nENDSEC;\nEND-ISO-10303-21;\n"
    )
    text = Instances(path.read_bytes())
    assert (part21.schema_name(text), part21.face_count(text)) == ("CONFIG_CONTROL_DESIGN", 2)
    assert part21.faces_in_use(text) == 1


@pytest.mark.parametrize(
    ("radius", "said"), [("NaN", "NaN"), ("-inf", "-inf"), ("1.E+400", "a number with the exponent 400")]
)
def test_numbers_that_are_not_finite_are_refused(radius: str, said: str, tmp_path: Path) -> None:
    """The kernel takes a circle without a radius for an edge without a length, and would go on without it."""
    path = write_product(tmp_path / "post.step", BRepPrimAPI_MakeCylinder(4.0, 20.0).Shape(), "post, NaN, 1.E400")
    text = path.read_text()
    assert not shared(path).findings
    path.write_text(re.sub(r"(= CIRCLE\('',#\d+,)4\.", rf"\g<1>{radius}", text, count=1))
    with pytest.raises(InputError, match=f"has {said}, which is not a finite number"):
        shared(path)
