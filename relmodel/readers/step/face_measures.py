"""Areas, centroids and boxes of faces and volumes of solids by the CAD kernel; runs in the child of `kernel.py` alone.

The kernel's adaptive integrals are wrong by up to some percent on swept surfaces, whose knots they do not heed, and
right once these are b-splines.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from OCP.Bnd import Bnd_Box
from OCP.BRep import BRep_Tool
from OCP.BRepBndLib import BRepBndLib
from OCP.BRepGProp import BRepGProp_Domain, BRepGProp_Face, BRepGProp_Sinert, BRepGProp_Vinert
from OCP.gp import gp_Pnt
from OCP.ShapeCustom import ShapeCustom
from OCP.TopoDS import TopoDS

Array = npt.NDArray[np.float64]

# Relative errors that the kernel's integrals are asked for.  For the first it integrates once between knots, which is
# good to 1e-9 on b-splines without weights; for less it halves intervals, which takes long where knots are many.
ONCE, HALVED = 1e-3, 1e-5
_SWEPT = ("extrusion", "revolution", "offset")
_RULED = ("plane", "cylinder", "cone", "extrusion")  # straight lines end at the boundary, and so do extremes


def integrals(faces: list[Any], kinds: list[str], about: Array) -> Array:
    """Area, its moments and the flux of the vector from a point, `about` (3,), through faces (n, 5).

    NaN where the kernel gives up.
    """
    out = np.full((len(faces), 5), np.nan)
    for row, face, kind in zip(out, faces, kinds, strict=True):
        try:
            row[:] = _integrals(face, kind, gp_Pnt(*about.tolist()))
        except Exception:  # those of the kernel have no base class of their own
            continue
    return out


def _integrals(face: Any, kind: str, about: Any) -> tuple[float, ...]:
    accuracy = HALVED
    if kind in _SWEPT:
        face = TopoDS.Face(ShapeCustom.ConvertToBSpline_s(face, True, True, True, False))
        surface = BRep_Tool.Surface_s(face)
        accuracy = HALVED if surface.IsURational() or surface.IsVRational() else ONCE
    props, flux = BRepGProp_Sinert(), BRepGProp_Vinert()
    flux.SetLocation(about)
    for one in (props, flux):
        one.Perform(BRepGProp_Face(face), BRepGProp_Domain(face), accuracy)
    area = abs(props.Mass())
    return area, *(area * np.array(props.CentreOfMass().Coord())), 3 * flux.Mass()


def widen_boxes(boxes: Array, faces: list[Any], kinds: list[str]) -> None:
    """Widen boxes (n, 6: x0 y0 z0 x1 y1 z1) of the arcs of faces to those of the faces, in place."""
    for row, face, kind in zip(boxes, faces, kinds, strict=True):
        if kind in _RULED:
            continue
        box = Bnd_Box()
        try:
            BRepBndLib.AddOptimal_s(face, box, False, False)
        except Exception:
            continue
        if not box.IsVoid():
            low, high = box.CornerMin().Coord(), box.CornerMax().Coord()
            row[:3], row[3:] = np.minimum(row[:3], low), np.maximum(row[3:], high)
