"""Outer loops: those that hold the others, and those around a face without a seam."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from OCP.BRep import BRep_Builder
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge, BRepBuilderAPI_MakeWire
from OCP.BRepLib import BRepLib
from OCP.Geom import Geom_ConicalSurface, Geom_CylindricalSurface, Geom_SphericalSurface, Geom_ToroidalSurface
from OCP.Geom2d import Geom2d_Line
from OCP.gp import gp_Ax3, gp_Dir2d, gp_Pnt2d
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS_Face

from relmodel.readers.step import shape as step_shape
from tests.features.known_parts import drum


def test_the_outer_loop_is_the_one_around_the_others() -> None:
    shape = step_shape.extract(drum().body)
    co, loops, points = shape.coedges, shape.loops, shape.samples.points
    several = np.flatnonzero(np.bincount(loops["surface_no"]) > 1).tolist()
    assert len(several) > 3
    for i in several:
        numbers = loops["loop_no"][loops["surface_no"] == i].tolist()
        assert loops["outer_loop"][loops["surface_no"] == i].tolist() == [no == 0 for no in numbers]
        boxes = []
        for no in numbers:
            arcs = co["arc_no"][(co["surface_no"] == i) & (co["loop_no"] == no)].tolist()
            along = np.concatenate([points[arc].reshape(-1, 3) for arc in arcs])
            boxes.append([*along.min(axis=0), *-along.max(axis=0)])
        assert (np.array(boxes)[numbers.index(0)] < np.array(boxes) + 0.01).all()  # samples miss where an arc turns


def band(surface: Any) -> Any:
    """The part of a surface between the circles v = 0.2 and v = 1, without a seam, with a hole that is a rectangle."""
    face, builder = TopoDS_Face(), BRep_Builder()
    builder.MakeFace(face, surface, TopLoc_Location(), 1e-7)
    corners = [(1.0, 0.4), (1.0, 0.8), (2.0, 0.8), (2.0, 0.4), (1.0, 0.4)]
    for loop in ([(0.0, 0.2), (2 * np.pi, 0.2)], corners, [(2 * np.pi, 1.0), (0.0, 1.0)]):
        wire = BRepBuilderAPI_MakeWire()
        for (u0, v0), (u1, v1) in pairwise(loop):
            line = Geom2d_Line(gp_Pnt2d(u0, v0), gp_Dir2d(u1 - u0, v1 - v0))
            wire.Add(BRepBuilderAPI_MakeEdge(line, surface, 0.0, float(np.hypot(u1 - u0, v1 - v0))).Edge())
        builder.Add(face, wire.Wire())
    BRepLib.BuildCurves3d_s(face)
    return face


@pytest.mark.parametrize("kind", ["cylinder", "cone", "sphere", "torus"])
def test_loops_around_a_face_without_a_seam_are_all_outer(kind: str) -> None:
    surface = {
        "cylinder": lambda: Geom_CylindricalSurface(gp_Ax3(), 9.0),
        "cone": lambda: Geom_ConicalSurface(gp_Ax3(), 0.3, 9.0),
        "sphere": lambda: Geom_SphericalSurface(gp_Ax3(), 9.0),
        "torus": lambda: Geom_ToroidalSurface(gp_Ax3(), 9.0, 2.0),
    }[kind]()
    shape = step_shape.extract(band(surface))
    count = np.bincount(shape.coedges["loop_no"])  # the hole has four edges
    assert sorted(zip(count.tolist(), shape.loops["outer_loop"].tolist(), strict=True)) == [
        (1, True),
        (1, True),
        (4, False),
    ]
