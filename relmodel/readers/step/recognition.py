"""The analytic form of splines and swept surfaces, where they have one; runs in the child process of the reader.

The kernel's recognition throws on some curves and surfaces: these are not recognised, which is no error.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from OCP.gp import gp_Ax2, gp_Circ, gp_Cone, gp_Cylinder, gp_Elips, gp_Lin, gp_Pln, gp_Sphere
from OCP.ShapeAnalysis import ShapeAnalysis_CanonicalRecognition

from relmodel.geometry.curves import vectors
from relmodel.geometry.surfaces import Surfaces
from relmodel.model.model import Table
from relmodel.readers.step.step_parameters import DEFAULTS
from relmodel.readers.step.tori import tori

_P = DEFAULTS

FRAME = tuple(f"{name}_{axis}" for name in ("origin", "axis_x", "axis_z") for axis in "xyz")
NAN = float("nan")
NO_FRAME: tuple[float, ...] = (NAN,) * 9
_HUGE = 1e100


# Names of what gives the radius, radius2 and semi-angle of analytic surfaces.
SIZES = {
    "plane": ("", "", ""),
    "cylinder": ("Radius", "", ""),
    "cone": ("RefRadius", "", "SemiAngle"),
    "sphere": ("Radius", "", ""),
    "torus": ("MajorRadius", "MinorRadius", ""),
}


def sizes_of(form: Any, names: tuple[str, ...]) -> tuple[float, ...]:
    """Sizes of a form of the kernel by the names of its methods; NaN where there is none."""
    return tuple(getattr(form, name)() if name else NAN for name in names)


def frame_of(position: Any) -> tuple[float, ...]:
    """Origin, X and Z axis of a coordinate system of the kernel."""
    return (*position.Location().Coord(), *position.XDirection().Coord(), *position.Direction().Coord())


def recognised_curve(edge: Any) -> tuple[str | None, tuple[float, ...], float, float]:
    """Kind, frame and radii of the line or conic that the free-form curve of an edge is, if it is one."""
    # The kernel sets one radius of an ellipse after the other: neither must be less than what is there.
    line, circle, ellipse = gp_Lin(), gp_Circ(gp_Ax2(), 1.0), gp_Elips(gp_Ax2(), _HUGE, 0.0)
    look = _recogniser(edge)
    if look is None:
        return None, NO_FRAME, NAN, NAN
    if _is(look.IsLine, line):
        return "line", (*line.Location().Coord(), *line.Direction().Coord(), NAN, NAN, NAN), NAN, NAN
    if _is(look.IsCircle, circle):
        return "circle", frame_of(circle.Position()), circle.Radius(), NAN
    if _is(look.IsEllipse, ellipse):
        return "ellipse", frame_of(ellipse.Position()), ellipse.MajorRadius(), ellipse.MinorRadius()
    return None, NO_FRAME, NAN, NAN


def recognised_surface(face: Any) -> tuple[str | None, tuple[float, ...], tuple[float, ...]]:
    """Kind, frame and sizes of the analytic surface that a free-form face lies on, if there is one."""
    look = _recogniser(face)
    for kind, form in (("plane", gp_Pln()), ("cylinder", gp_Cylinder()), ("sphere", gp_Sphere()), ("cone", gp_Cone())):
        if look is not None and _is(getattr(look, f"Is{kind.title()}"), form):
            return kind, frame_of(form.Position()), sizes_of(form, SIZES[kind])
    return None, NO_FRAME, (NAN, NAN, NAN)


def _recogniser(shape: Any) -> Any:
    try:
        return ShapeAnalysis_CanonicalRecognition(shape)
    except Exception:  # the kernel's exceptions share no base class
        return None


def _is(test: Callable[[float, Any], bool], form: Any) -> bool:
    try:
        return bool(test(_P.recognition_mm, form))
    except Exception:
        return False


def on_axis(kind: str | None, found: tuple[float, ...], frame: tuple[float, ...]) -> tuple[float, ...]:
    """The frame of a recognised surface with its origin on the axis that it is revolved about, as `frame` has it."""
    if kind is None:
        return frame
    foot, axis = np.array(frame[:3]), np.array(frame[6:])
    return *(foot + axis * (axis @ (found[:3] - foot))).tolist(), *found[3:]


def recognise_tori(columns: Table, surfaces: Surfaces) -> None:
    """Enter the tori that splines and surfaces of revolution are; the kernel recognises none."""
    kinds = columns["recognised_kind"]
    free = [row for row, kind in enumerate(kinds) if kind in ("spline", "revolution")]
    if not free:
        return
    try:
        found = tori(surfaces, np.array(free), _P.recognition_mm)
    except np.linalg.LinAlgError:  # a decomposition that does not converge
        return
    for row in found.row.tolist():
        kinds[row] = "torus"
    columns["radius"][found.row], columns["radius2"][found.row] = found.major, found.minor
    foot, axis = vectors(columns, "origin")[found.row], vectors(columns, "axis_z")[found.row]
    on_axis = foot + axis * np.sum(axis * (found.centre - foot), axis=1, keepdims=True)
    centre = np.where(np.isnan(foot), found.centre, on_axis)  # what is revolved stays on its own axis
    for name, values in (("origin", centre), ("axis_x", found.across), ("axis_z", found.axis)):
        for i, letter in enumerate("xyz"):
            columns[f"{name}_{letter}"][found.row] = values[:, i]
