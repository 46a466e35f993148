"""Tessellated STEP against the text: the exact surface that each face of triangles is linked to, and its validation
properties."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

from tests.parts.step_parts import loaded
from tests.reading import shared

Array = npt.NDArray[np.float64]

LINKED = {"PLANE": "plane", "CYLINDRICAL_SURFACE": "cylinder", "B_SPLINE_SURFACE_WITH_KNOTS": "free"}

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
    faces = re.findall(
        r"=COMPLEX_TRIANGULATED_FACE\('[^']*',#(\d+),\d+,.*?,(?:#(\d+)|\$),\(([\d,]*)\),\(.*?\)\);", text
    )
    assert model.faces_in_file == model.faces_loaded == len(faces) == 273
    shapes = [model.shapes[part.shape] for part in model.parts]
    assert [(shape.kind, len(shape.surfaces["kind"])) for shape in shapes] == [("mesh", 272)]
    stated = [float(v) for v in re.findall(r"'tessellatedsurfacearea',AREA_MEASURE\(([-+.\dE]+)\)", text)]
    for shape in shapes:
        area = float(np.sum(shape.surfaces["area"]))
        assert min(abs(area - value) for value in stated) < 1e-5 * area
    assert shapes[0].volume is not None

    # Of each face the box of its points, by the text, tells which surface it is.
    kinds = np.concatenate([np.asarray(shape.surfaces["kind"]).astype(str) for shape in shapes])
    ours = np.concatenate(
        [np.stack([shape.surfaces[c] for c in ("x0", "y0", "z0", "x1", "y1", "z1")], axis=1) for shape in shapes]
    )
    radius = np.concatenate([np.asarray(shape.surfaces["radius"], float) for shape in shapes])
    coordinates: dict[str, Array] = {}
    right = dict.fromkeys(LINKED.values(), 0)
    count = dict.fromkeys(LINKED.values(), 0)
    beside = 0  # faces of the sheet beside the solid, which is no material
    for points, linked, indices in faces:
        if points not in coordinates:
            numbers = re.findall(r"\(([-+.\dE]+),([-+.\dE]+),([-+.\dE]+)\)", instances[points])
            coordinates[points] = np.array(numbers, float)
        mine = coordinates[points][np.array(indices.split(","), int) - 1]
        box = np.concatenate([mine.min(axis=0), mine.max(axis=0)])
        near = np.flatnonzero(np.abs(ours - box).max(axis=1) < 1e-4)
        if not len(near):
            beside += 1
        elif linked:
            name, _, parameters = instances[linked].partition("(")
            kind = LINKED[name]
            found = kinds[near[0]]
            count[kind] += 1
            # Of a fillet's corner, which the file has as a spline, a sphere is the true kind.
            right[kind] += found == kind or (kind == "free" and found in ("facets", "sphere", "torus"))
            if kind == found == "cylinder":
                assert radius[near[0]] == pytest.approx(float(parameters.split(",")[-1].strip(")")), abs=5e-3)
    assert beside == 1
    assert right["plane"] >= 0.95 * count["plane"]
    assert right["cylinder"] >= 0.95 * count["cylinder"]
    assert right["free"] >= 0.9 * count["free"]
    residual = np.concatenate([np.asarray(shape.surfaces["residual"], float) for shape in shapes])
    assert residual.max() < 5e-3


@pytest.mark.data
def test_colours_of_faces_of_triangles(data_dir: Path) -> None:
    path = data_dir / "step/nist_ftc_08_asme1_ap242-e1-tg.stp"
    text = re.sub(r"\s", "", path.read_text("latin-1"))
    styled = set(re.findall(r"=STYLED_ITEM\('[^']*',\(#\d+\),#(\d+)\)", text))
    faces = set(re.findall(r"#(\d+)=COMPLEX_TRIANGULATED_FACE", text))
    coloured = [c for shape in loaded(path).shapes for c in shape.surfaces["colour"]]
    assert sum(c is not None for c in coloured) == len(styled & faces)
