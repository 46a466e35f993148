"""Areas, centroids and boxes of faces and volumes of solids by the CAD kernel; runs in the child process of the reader.

The kernel's adaptive integrals are wrong by up to some percent on swept surfaces, whose knots they do not heed, and
right once these are b-splines.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from OCP.Bnd import Bnd_Box
from OCP.BRep import BRep_Tool
from OCP.BRepBndLib import BRepBndLib
from OCP.BRepGProp import BRepGProp_Domain, BRepGProp_Face, BRepGProp_Sinert, BRepGProp_Vinert
from OCP.Geom import Geom_BSplineSurface
from OCP.gp import gp_Pnt
from OCP.ShapeCustom import ShapeCustom
from OCP.TopoDS import TopoDS

from relmodel.arrays import Floats
from relmodel.model.model import Mesh
from relmodel.readers.step.step_parameters import DEFAULTS

_P = DEFAULTS
_SWEPT = ("extrusion", "revolution", "offset")
_RULED = ("plane", "cylinder", "cone", "extrusion")  # straight lines end at the boundary, and so do extremes


def integrals(faces: list[Any], kinds: list[str], normals: Floats, about: Floats) -> Floats:
    """Area, its moments and the flux of the vector from a point, `about` (3,), through faces (n, 5).

    normals: (n, 3) outward, of planes.  NaN where the kernel gives up.
    """
    out = np.full((len(faces), 5), np.nan)
    for row, face, kind, normal in zip(out, faces, kinds, normals, strict=True):
        try:
            swept = kind in _SWEPT
            given = TopoDS.Face(ShapeCustom.ConvertToBSpline_s(face, True, True, True, False)) if swept else face
            accuracy = _accuracy(given, swept)
            props = BRepGProp_Sinert()
            props.Perform(BRepGProp_Face(given), BRepGProp_Domain(given), accuracy)
            area, centroid = abs(props.Mass()), np.array(props.CentreOfMass().Coord())
            if kind == "plane":
                flux = area * (centroid - about) @ normal
            else:
                solid = BRepGProp_Vinert()
                solid.SetLocation(gp_Pnt(*about.tolist()))
                solid.Perform(BRepGProp_Face(given), BRepGProp_Domain(given), accuracy)
                flux = 3 * solid.Mass()
            row[:] = area, *(area * centroid), flux
        except Exception:  # those of the kernel have no base class of their own
            continue
    return out


def _accuracy(face: Any, swept: bool) -> float:
    surface = BRep_Tool.Surface_s(face)
    if not isinstance(surface, Geom_BSplineSurface):
        return _P.analytic_error
    many = max(surface.NbUKnots(), surface.NbVKnots()) > _P.many_knots
    polynomial = not (surface.IsURational() or surface.IsVRational())
    return _P.once_error if swept and many and polynomial else _P.spline_error


def widen_boxes(boxes: Floats, faces: list[Any], kinds: list[str], mesh: Mesh) -> None:
    """Widen boxes (n, 6: x0 y0 z0 x1 y1 z1) of the arcs of faces to those of the faces, in place.

    The kernel's own are at times too small on free-form faces and too large on cut spheres and tori: the box of the
    triangles, widened, stands where they are less than it, and where they are beyond it by more than the deviation.
    """
    for i, (row, face, kind) in enumerate(zip(boxes, faces, kinds, strict=True)):
        if kind in _RULED:
            continue
        box = _optimal_box(face)
        vertices = mesh.vertices[mesh.triangles[mesh.triangle_surfaces == i]].reshape(-1, 3)
        if len(vertices):
            inner = np.concatenate([-vertices.min(axis=0), vertices.max(axis=0)])
            outer = inner + mesh.deviation_mm
            # Between the chords of a hollow boundary vertices lie beyond the face.
            slack = mesh.deviation_mm if kind in ("sphere", "torus") else _P.tight_mm
            box = np.where(box < inner - slack, inner + min(mesh.deviation_mm, mesh.chord_mm / 2), np.fmin(box, outer))
        box[:3] *= -1
        row[:3], row[3:] = np.fmin(row[:3], box[:3]), np.fmax(row[3:], box[3:])


def _optimal_box(face: Any) -> Floats:
    """Greatest coordinates of a face along -x, -y, -z, x, y, z by the kernel; NaN where it gives up."""
    box = Bnd_Box()
    try:
        BRepBndLib.AddOptimal_s(face, box, False, False)
        if not box.IsVoid():
            return np.concatenate([np.negative(box.CornerMin().Coord()), box.CornerMax().Coord()])
    except Exception:  # those of the kernel have no base class of their own
        pass
    return np.full(6, np.nan)
