"""Boxes of curved faces against the kernel's, and against triangles whose vertices lie on the faces."""

from __future__ import annotations

import numpy as np
from OCP.Bnd import Bnd_Box
from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut
from OCP.BRepBndLib import BRepBndLib
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge, BRepBuilderAPI_MakeFace, BRepBuilderAPI_MakeWire
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeSphere, BRepPrimAPI_MakeTorus
from OCP.collections import Array2_gp_Pnt
from OCP.Geom import Geom_OffsetSurface
from OCP.Geom2d import Geom2d_Circle
from OCP.GeomAPI import GeomAPI_PointsToBSplineSurface
from OCP.gp import gp_Ax1, gp_Ax2, gp_Ax2d, gp_Dir, gp_Dir2d, gp_Pnt, gp_Pnt2d, gp_Trsf

from relmodel.readers.step import shape as step_shape
from relmodel.readers.step.faces import face_map


def test_boxes_of_spheres_and_tori_whole_and_cut() -> None:
    rng = np.random.default_rng(4)
    faces = same = 0
    axes = gp_Ax2(gp_Pnt(*rng.uniform(-50, 50, 3)), gp_Dir(*rng.normal(size=3)))
    turn = float(rng.uniform(0.5, 6.0))
    for maker in (
        BRepPrimAPI_MakeSphere(axes, 20.0),
        BRepPrimAPI_MakeSphere(axes, 20.0, float(rng.uniform(-1.5, -0.2)), float(rng.uniform(0.2, 1.5)), turn),
        BRepPrimAPI_MakeTorus(axes, 30.0, 8.0),
        BRepPrimAPI_MakeTorus(axes, 30.0, 8.0, float(rng.uniform(0, 2)), float(rng.uniform(2.5, 5)), turn),
    ):
        cutter = BRepPrimAPI_MakeBox(axes.Location(), 60.0, 60.0, 60.0).Shape()
        for shape in (maker.Shape(), BRepAlgoAPI_Cut(maker.Shape(), cutter).Shape()):
            got = step_shape.extract(shape)
            vertices = got.mesh.vertices[got.mesh.triangles].reshape(-1, 3)
            owner = np.repeat(got.mesh.triangle_surfaces, 3)
            for i in np.flatnonzero(np.isin(got.surfaces["kind"], ("sphere", "torus"))).tolist():
                box = [got.surfaces[c][i] for c in ("x0", "y0", "z0", "x1", "y1", "z1")]
                mine = vertices[owner == i]
                # Within the chords of a hollow boundary a vertex may lie beyond the boundary itself.
                assert (mine.min(0) > np.array(box[:3]) - got.mesh.chord_mm).all()
                assert (mine.max(0) < np.array(box[3:]) + got.mesh.chord_mm).all()
                bound = Bnd_Box()
                BRepBndLib.AddOptimal_s(face_map(shape).FindKey(i + 1), bound, False, False)
                kernel = np.array([*bound.CornerMin().Coord(), *bound.CornerMax().Coord()])
                same += np.abs(kernel - box).max() < 1e-4
                # The kernel's own may be too large, where the range of a face's parameters is.
                assert (np.array(box[:3]) > kernel[:3] - 1e-4).all()
                assert (np.array(box[3:]) < kernel[3:] + 1e-4).all()
                assert np.abs(box - np.concatenate([mine.min(0), mine.max(0)])).max() < 2 * got.mesh.chord_mm
                faces += 1
    assert faces > 7
    assert same >= faces - 1


def test_boxes_of_free_faces_that_bulge_within_their_trims() -> None:
    """A hilly spline, and the same offset and turned, cut by a circle: held by what is found on a fine grid within."""
    rng = np.random.default_rng(8)
    for case in range(2):
        # Over the offset of many steep hills the kernel takes ten seconds to integrate.
        (rows, columns), height = ((5, 6), 0.2) if case % 2 else ((7, 8), 0.4)
        points = Array2_gp_Pnt(1, rows, 1, columns)
        for i in range(rows):
            for j in range(columns):
                points.SetValue(i + 1, j + 1, gp_Pnt(i, j, float(rng.uniform(-height, height))))
        surface = GeomAPI_PointsToBSplineSurface(points).Surface()
        turn = gp_Trsf()
        turn.SetRotation(gp_Ax1(gp_Pnt(0, 0, 0), gp_Dir(*rng.normal(size=3))), 2.0 * case)
        surface = surface.Transformed(turn)
        if case % 2:
            surface = Geom_OffsetSurface(surface, 0.05)
        u0, u1, v0, v1 = surface.Bounds()
        middle, radius = np.array([(u0 + u1) / 2, (v0 + v1) / 2]), 0.35 * min(u1 - u0, v1 - v0)
        circle = Geom2d_Circle(gp_Ax2d(gp_Pnt2d(*middle.tolist()), gp_Dir2d(1, 0)), radius)
        wire = BRepBuilderAPI_MakeWire(BRepBuilderAPI_MakeEdge(circle, surface).Edge()).Wire()
        got = step_shape.extract(BRepBuilderAPI_MakeFace(surface, wire).Face())
        distance, angle = np.meshgrid(np.linspace(0, radius, 60), np.linspace(0, 2 * np.pi, 150))
        places = middle + np.stack([distance * np.cos(angle), distance * np.sin(angle)], axis=-1).reshape(-1, 2)
        grid = np.array([surface.Value(u, v).Coord() for u, v in places.tolist()])
        box = np.array([got.surfaces[c][0] for c in ("x0", "y0", "z0", "x1", "y1", "z1")])
        assert (grid.min(0) > box[:3] - 1e-5).all()
        assert (grid.max(0) < box[3:] + 1e-5).all()
        assert np.abs(box - np.concatenate([grid.min(0), grid.max(0)])).max() < 0.02 + got.mesh.deviation_mm
