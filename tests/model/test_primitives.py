"""Boxes, cylinders and spheres against closed forms and the CAD kernel's primitives."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from relmodel.model import primitives
from relmodel.model.model import Shape

CASES = {
    "box": (primitives.box((30, 50, 110)), 30 * 50 * 110, 2 * (30 * 50 + 50 * 110 + 30 * 110)),
    "cylinder": (primitives.cylinder(40, 25), np.pi * 1600 * 25, 2 * np.pi * 1600 + 80 * np.pi * 25),
    "sphere": (primitives.sphere(75), 4 / 3 * np.pi * 75**3, 4 * np.pi * 75**2),
}


@pytest.mark.parametrize("name", CASES)
def test_areas_and_volume(name: str) -> None:
    shape, volume, area = CASES[name]
    assert shape.volume == pytest.approx(volume, rel=1e-12)
    assert shape.surfaces["area"].sum() == pytest.approx(area, rel=1e-12)
    assert set(shape.surfaces["provenance"]) == set(shape.arcs["provenance"]) == {"exact"}


@pytest.mark.parametrize("name", CASES)
def test_mesh_lies_on_the_shape_and_faces_outwards(name: str) -> None:
    shape, volume, _ = CASES[name]
    mesh = shape.mesh
    corner = mesh.vertices[mesh.triangles]
    inside = np.einsum("nd,nd->n", corner[:, 0], np.cross(corner[:, 1], corner[:, 2])).sum() / 6
    assert 0.985 * volume < inside <= volume * (1 + 1e-12)
    flat = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    assert np.all(np.einsum("nd,nkd->nk", flat, mesh.normals[mesh.triangles]) > 0)
    if name == "sphere":
        assert np.linalg.norm(mesh.vertices, axis=1) == pytest.approx(75)
        assert 75 - np.linalg.norm(corner.mean(axis=1), axis=1).min() < 4 * mesh.chord_mm
    assert sorted(set(mesh.triangle_surfaces.tolist())) == list(range(len(shape.surfaces["kind"])))


def _kernel(name: str) -> Shape:
    prim = pytest.importorskip("OCP.BRepPrimAPI")
    gp = pytest.importorskip("OCP.gp")
    from relmodel.readers.step.shape import extract

    made: Any
    if name == "box":
        made = prim.BRepPrimAPI_MakeBox(gp.gp_Pnt(-15, -25, -55), gp.gp_Pnt(15, 25, 55)).Shape()
    elif name == "cylinder":
        axes = gp.gp_Ax2(gp.gp_Pnt(0, 0, -12.5), gp.gp_Dir(0, 0, 1))
        made = prim.BRepPrimAPI_MakeCylinder(axes, 40, 25).Shape()
    else:
        made = prim.BRepPrimAPI_MakeSphere(75).Shape()
    return extract(made, {}, {}, {})


@pytest.mark.parametrize("name", CASES)
def test_rows_are_those_of_the_kernels_primitive(name: str) -> None:
    ours, theirs = CASES[name][0], _kernel(name)
    surface = ("kind", "radius", "area", "centroid_x", "centroid_y", "centroid_z", "x0", "y0", "z0", "x1", "y1", "z1")
    arc = ("kind", "radius", "length", "convexity", "angle", "x0", "y0", "z0", "x1", "y1", "z1")
    for table, names in (("surfaces", surface), ("arcs", arc)):
        rows = []
        for shape in (ours, theirs):
            columns = getattr(shape, table)
            rows.append(
                sorted(
                    tuple(v if isinstance(v, str) else round(float(np.nan_to_num(v, nan=-1)), 6) + 0.0 for v in row)
                    for row in zip(*(list(columns[n]) for n in names), strict=True)
                )
            )
        assert rows[0] == rows[1]
    assert len(ours.coedges["arc_no"]) == len(theirs.coedges["arc_no"])
    assert len(ours.pcurves["kind"]) == len(theirs.pcurves["kind"])
