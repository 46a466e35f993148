"""Tessellated STEP against the text: the exact surface that each face is linked to, and its validation properties."""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from tests.parts.step_parts import loaded
from tests.reading import shared

CUBE = """ISO-10303-21;
HEADER;FILE_DESCRIPTION((''),'2;1');FILE_NAME('','',(''),(''),'','','');
FILE_SCHEMA(('AP242_MANAGED_MODEL_BASED_3D_ENGINEERING_MIM_LF'));ENDSEC;
DATA;
#1=APPLICATION_CONTEXT('managed model based 3d engineering');
#2=PRODUCT_CONTEXT('',#1,'mechanical');#3=PRODUCT('block','block','',(#2));
#4=PRODUCT_DEFINITION_FORMATION('','',#3);#5=PRODUCT_DEFINITION_CONTEXT('part definition',#1,'design');
#6=PRODUCT_DEFINITION('design','',#4,#5);#7=PRODUCT_DEFINITION_SHAPE('','',#6);
#8=SHAPE_DEFINITION_REPRESENTATION(#7,#20);
#10=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.CENTI.,.METRE.));
#11=(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.));
#12=(NAMED_UNIT(*)SI_UNIT($,.STERADIAN.)SOLID_ANGLE_UNIT());
#13=UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE(1.E-5),#10,'distance_accuracy_value','');
#14=(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT((#13))
GLOBAL_UNIT_ASSIGNED_CONTEXT((#10,#11,#12))REPRESENTATION_CONTEXT('',''));
#20=TESSELLATED_SHAPE_REPRESENTATION('',(#21),#14);
#21=TESSELLATED_SOLID('',(#31,#32,#33,#34,#35,#36),$);
#22=COORDINATES_LIST('',8,((0.,0.,0.),(2.,0.,0.),(2.,3.,0.),(0.,3.,0.),(0.,0.,1.),(2.,0.,1.),(2.,3.,1.),(0.,3.,1.)));
#31=TRIANGULATED_FACE('',#22,8,(),$,(),((1,3,2),(1,4,3)));
#32=TRIANGULATED_FACE('lid',#22,8,(),$,(),((5,6,7),(5,7,8)));
#33=TRIANGULATED_FACE('',#22,8,(),$,(),((1,2,6),(1,6,5)));
#34=TRIANGULATED_FACE('',#22,8,(),$,(),((3,4,8),(3,8,7)));
#35=TRIANGULATED_FACE('',#22,8,(),$,(),((2,3,7),(2,7,6)));
#36=TRIANGULATED_FACE('',#22,8,(),$,(),((4,1,5),(4,5,8)));
ENDSEC;
END-ISO-10303-21;
"""


def test_a_block_of_triangles(tmp_path: Path) -> None:
    path = tmp_path / "block.stp"
    path.write_text(CUBE)
    model = shared(path)
    (part,), (shape,) = model.parts, model.shapes
    assert (part.name, shape.kind, model.unit, model.faces_in_file) == ("block", "mesh", "centimetre", 6)
    assert shape.volume == pytest.approx(6000)
    assert sorted(shape.surfaces["area"]) == pytest.approx([200, 200, 300, 300, 600, 600])
    assert set(shape.surfaces["kind"]) == {"plane"}
    assert set(shape.surfaces["provenance"]) == {"fitted"}
    (lid,) = (i for i, name in enumerate(shape.surfaces["name"]) if name == "lid")
    assert shape.surfaces["centroid_z"][lid] == pytest.approx(10)
    assert len(shape.arcs["kind"]) == 12
    assert set(shape.arcs["kind"]) == {"line"}
    assert set(shape.arcs["convexity"]) == {"convex"}
    # A face that the kernel does not bring through is missed.
    path.write_text(CUBE.replace("((5,6,7),(5,7,8))", "()"))
    robbed = shared(path)
    assert (robbed.faces_in_file, robbed.faces_loaded) == (6, 5)


@pytest.mark.data
def test_faces_of_triangles_are_the_surfaces_that_the_file_links_them_to(data_dir: Path) -> None:
    path = data_dir / "step/nist_ftc_08_asme1_ap242-e1-tg.stp"
    model = loaded(path)
    text = re.sub(r"\s", "", path.read_text("latin-1"))
    instances = dict(re.findall(r"#(\d+)=([^;]*);", text))
    faces = re.findall(r"=COMPLEX_TRIANGULATED_FACE\('[^']*',#\d+,\d+,.*?,(?:#(\d+)|\$),\([\d,]*\),\(.*?\)\);", text)
    assert model.faces_in_file == model.faces_loaded == len(faces) == 273
    (part,) = model.parts
    shape = model.shapes[part.shape]
    surfaces = shape.surfaces
    assert (shape.kind, len(surfaces["kind"])) == ("mesh", 272)  # a sheet beside the solid is no material
    stated = [float(v) for v in re.findall(r"'tessellatedsurfacearea',AREA_MEASURE\(([-+.\dE]+)\)", text)]
    assert np.min(np.abs(np.sum(surfaces["area"]) - stated)) < 1e-5 * np.sum(surfaces["area"])
    assert shape.volume is not None
    kinds = Counter(map(str, surfaces["kind"]))
    names = Counter(instances[linked].partition("(")[0] for linked in faces if linked)
    for name, kind in (("PLANE", "plane"), ("CYLINDRICAL_SURFACE", "cylinder")):
        assert 0.95 * names[name] <= kinds[kind] <= 1.05 * names[name]
    # Of a fillet's corner, which the file has as a spline, a sphere or a torus is the true kind.
    assert kinds["facets"] + kinds["sphere"] + kinds["torus"] >= 0.9 * names["B_SPLINE_SURFACE_WITH_KNOTS"]
    linked = [instances[linked] for linked in faces if linked and instances[linked].startswith("CYLINDRICAL")]
    radii = np.array([float(text.split(",")[-1].strip(")")) for text in linked])
    found = np.asarray(surfaces["radius"], float)[np.asarray(surfaces["kind"]) == "cylinder"]
    assert np.mean(np.abs(found[:, None] - radii).min(axis=1) < 5e-3) > 0.95
    assert np.asarray(surfaces["residual"], float).max() < 5e-3


@pytest.mark.data
def test_colours_of_faces_of_triangles(data_dir: Path) -> None:
    path = data_dir / "step/nist_ftc_08_asme1_ap242-e1-tg.stp"
    text = re.sub(r"\s", "", path.read_text("latin-1"))
    styled = set(re.findall(r"=STYLED_ITEM\('[^']*',\(#\d+\),#(\d+)\)", text))
    faces = set(re.findall(r"#(\d+)=COMPLEX_TRIANGULATED_FACE", text))
    coloured = [c for shape in loaded(path).shapes for c in shape.surfaces["colour"]]
    assert sum(c is not None for c in coloured) == len(styled & faces)
