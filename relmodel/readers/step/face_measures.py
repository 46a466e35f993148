"""Areas, centroids and boxes of faces and volumes of solids by the CAD kernel; runs in the child of `kernel.py` alone.

The kernel's adaptive integrals are wrong by up to some percent on swept surfaces, whose knots they do not heed, and
right once these are b-splines.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from OCP.Bnd import Bnd_Box
from OCP.BRepBndLib import BRepBndLib
from OCP.BRepGProp import BRepGProp
from OCP.GProp import GProp_GProps
from OCP.ShapeCustom import ShapeCustom
from OCP.TopoDS import TopoDS

from relmodel.readers.step.maps import compound

Array = npt.NDArray[np.float64]

# Relative error that the kernel's integrals are asked for.  From 0.001 on it integrates once between knots, which is
# good to 1e-9 on planes and b-splines; below it halves intervals, which takes up to a hundred times as long.
ONCE, HALVED = 1e-3, 1e-6
_SWEPT = ("extrusion", "revolution", "offset")
_EXACT_AT_ONCE = ("plane", *_SWEPT)
_RULED = ("plane", "cylinder", "cone", "extrusion")  # straight lines end at the boundary, and so do extremes


def integrable(faces: list[Any], kinds: list[str]) -> list[Any]:
    """Faces as the kernel integrates over them with the accuracy asked for: swept ones as b-splines."""
    return [_as_spline(face) if kind in _SWEPT else face for face, kind in zip(faces, kinds, strict=True)]


def _as_spline(face: Any) -> Any:
    try:
        return TopoDS.Face(ShapeCustom.ConvertToBSpline_s(face, True, True, True, False))
    except Exception:  # those of the kernel have no base class of their own
        return face


def areas(faces: list[Any], kinds: list[str]) -> Array:
    """Area and centroid (n, 4) of faces; NaN where the kernel gives up."""
    out = np.full((len(faces), 4), np.nan)
    for row, face, kind in zip(out, faces, kinds, strict=True):
        props = GProp_GProps()
        try:
            BRepGProp.SurfaceProperties_s(face, props, ONCE if kind in _EXACT_AT_ONCE else HALVED, False)
        except Exception:
            continue
        row[:] = abs(props.Mass()), *props.CentreOfMass().Coord()
    return out


def volume(faces: list[Any]) -> float:
    """Volume that faces enclose, mm3; NaN where the kernel gives up."""
    props = GProp_GProps()
    try:
        BRepGProp.VolumeProperties_s(compound(faces), props, ONCE, False, False)
    except Exception:
        return float("nan")
    return abs(float(props.Mass()))


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
