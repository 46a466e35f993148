"""Drawn annotations: lines in the text against the arcs of the supplemental part that holds them."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from relmodel.model.measures import curves_of
from tests.parts.step_parts import loaded
from tests.readers.test_step_tessellated import CUBE

pytest.importorskip("OCP")

# A set that stays, and one that is turned by 90 degrees about Z and moved; in centimetres.
NOTES = """#50=COORDINATES_LIST('',5,((0.,0.,2.),(1.,0.,2.),(1.,1.,2.),(1.,1.,2.),(4.,4.,4.)));
#51=TESSELLATED_CURVE_SET('leader',#50,((1,2,3,4),(4,5),(3,4),(1,9)));
#52=TESSELLATED_GEOMETRIC_SET('',(#51));
#53=CARTESIAN_POINT('',(10.,0.,0.));#54=DIRECTION('',(0.,0.,1.));#55=DIRECTION('',(0.,1.,0.));
#56=AXIS2_PLACEMENT_3D('',#53,#54,#55);
#57=TESSELLATED_CURVE_SET('letter',#50,((1,2)));
#58=(GEOMETRIC_REPRESENTATION_ITEM()REPOSITIONED_TESSELLATED_ITEM(#56)REPRESENTATION_ITEM('')
TESSELLATED_GEOMETRIC_SET((#57))TESSELLATED_ITEM());
"""


def test_lines_are_kept_where_they_are_drawn(tmp_path: Path) -> None:
    path = tmp_path / "noted.stp"
    path.write_text(CUBE.replace("ENDSEC;\nEND-ISO", NOTES + "ENDSEC;\nEND-ISO"))
    model = loaded(path)
    block, notes = model.parts
    assert (block.supplemental, notes.supplemental) == (False, True)
    assert sum(i.child == 1 for i in model.assemblies[model.root].instances) == 1
    shape = model.shapes[notes.shape]
    assert (shape.kind, set(shape.arcs["kind"])) == ("wire", {"polyline"})
    assert shape.arcs["length"] == pytest.approx([20, 10 * np.sqrt(9 + 9 + 4), 10])
    curves = curves_of(shape)
    points = curves.evaluate([0, 0, 1, 2, 2], [0.0, 15.0, 0.0, 0.0, 10.0])[0]
    assert curves.lengths() == pytest.approx(shape.arcs["length"])
    assert points == pytest.approx(
        np.array([[0, 0, 20], [10, 5, 20], [10, 10, 20], [100, 0, 20], [100, 10, 20]]), abs=1e-9
    )


@pytest.mark.data
def test_the_annotations_of_a_file_are_all_there(data_dir: Path) -> None:
    path = data_dir / "step/nist_ctc_01_asme1_ap242.stp"
    text = re.sub(r"\s", "", path.read_text("latin-1"))
    lists = dict(re.findall(r"#(\d+)=COORDINATES_LIST\('[^']*',\d+,\((.*?)\)\);", text))
    lengths = []
    for of, strips in re.findall(r"=TESSELLATED_CURVE_SET\('[^']*',#(\d+),\(\((.*?)\)\)\);", text):
        points = np.array([[float(x) for x in p.split(",")] for p in lists[of].strip("()").split("),(")])
        for strip in strips.split("),("):
            rows = [int(i) - 1 for i in strip.split(",")]
            lengths.append(np.linalg.norm(np.diff(points[rows], axis=0), axis=1).sum())
    model = loaded(path)
    (notes,) = (p for p in model.parts if p.supplemental)
    found = model.shapes[notes.shape].arcs["length"]
    assert sorted(found) == pytest.approx(sorted(length for length in lengths if length > 0), abs=1e-9)
