"""Boxes of curved faces against the kernel's, and against triangles whose vertices lie on the faces."""

from __future__ import annotations

import numpy as np
import pytest


def test_boxes_of_spheres_and_tori_whole_and_cut() -> None:
    from OCP.Bnd import Bnd_Box
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut
    from OCP.BRepBndLib import BRepBndLib
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeSphere, BRepPrimAPI_MakeTorus
    from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt

    from relmodel.loading.step import shape as step_shape

    rng = np.random.default_rng(4)
    faces = 0
    for _ in range(12):
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
                got = step_shape.extract(shape, {}, {}, {})
                vertices = got.mesh.vertices[got.mesh.triangles].reshape(-1, 3)
                owner = np.repeat(got.mesh.triangle_surfaces, 3)
                for i in np.flatnonzero(np.isin(got.surfaces["kind"], ("sphere", "torus"))).tolist():
                    box = [got.surfaces[c][i] for c in ("x0", "y0", "z0", "x1", "y1", "z1")]
                    mine = vertices[owner == i]
                    # Within the chords of a hollow boundary a vertex may lie beyond the boundary itself.
                    assert (mine.min(0) > np.array(box[:3]) - got.mesh.chord_mm).all()
                    assert (mine.max(0) < np.array(box[3:]) + got.mesh.chord_mm).all()
                    bound = Bnd_Box()
                    BRepBndLib.AddOptimal_s(step_shape.face_map(shape).FindKey(i + 1), bound, False, False)
                    assert box == pytest.approx([*bound.CornerMin().Coord(), *bound.CornerMax().Coord()], abs=1e-4)
                    faces += 1
    assert faces > 90
