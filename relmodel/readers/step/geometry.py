"""Curves and surfaces of the CAD kernel as rows, in analytic form where they have one."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from OCP.GeomConvert import GeomConvert
from OCP.gp import gp_Ax2, gp_Circ, gp_Cone, gp_Cylinder, gp_Elips, gp_Lin, gp_Pln, gp_Sphere
from OCP.ShapeAnalysis import ShapeAnalysis_CanonicalRecognition

from relmodel.arrays import Bools, Floats, Ints
from relmodel.geometry.curves import Curves, vectors
from relmodel.geometry.surfaces import Surfaces
from relmodel.geometry.transforms import unit
from relmodel.model.measures import grid
from relmodel.model.model import Table
from relmodel.readers.splines import spline_columns, spline_of, surface_spline_columns
from relmodel.readers.step.step_parameters import DEFAULTS

_P = DEFAULTS


@dataclass(frozen=True)
class Tori:
    """Tori found: rows of their surfaces (n,), centres, axes and directions across them (n, 3), radii (n,), mm."""

    row: Ints
    centre: Floats
    axis: Floats
    across: Floats
    major: Floats
    minor: Floats

    def __getitem__(self, which: Bools) -> Tori:
        return Tori(*(values[which] for values in vars(self).values()))


def tori(surfaces: Surfaces, row: Ints, tolerance: float) -> Tori:
    """Those of the surfaces `row` (n,) that are, within their domains, tori as near as `tolerance` (mm).

    The normals of a surface of revolution meet its axis: their Pluecker coordinates are linear in those of the axis
    (Pottmann and Wallner, Computational Line Geometry, 2001).  A torus is one whose meridian is a circle."""
    points, across = grid(surfaces, row, np.linspace(0, 1, _P.torus_side))
    normals = unit(across.reshape(-1, 3).T).T.reshape(across.shape)
    good = np.isfinite(points).all(axis=(1, 2)) & np.isfinite(normals).all(axis=(1, 2))
    found, near = _fitted(row[good], points[good], normals[good], tolerance)
    found, near = found[near > 0], near[near > 0]
    if not len(found.row):
        return found
    points = grid(surfaces, found.row, np.linspace(0, 1, _P.torus_close_side))[0]
    return found[_away(found, points) <= near]


def _fitted(row: Ints, points: Floats, normals: Floats, tolerance: float) -> tuple[Tori, Floats]:
    """The torus through points (n, m, 3) with unit normals, and how near it is to be (n,); 0 where it is not."""
    middle = points.mean(axis=1, keepdims=True)
    scale = np.maximum(np.abs(points - middle).max(axis=(1, 2), keepdims=True, initial=0), 1e-300)
    local = (points - middle) / scale
    lines = np.concatenate([normals, np.cross(local, normals)], axis=2)
    moment, axis = np.split(np.linalg.svd(lines, full_matrices=False)[2][:, -1], 2, axis=1)
    length = np.maximum(np.linalg.norm(axis, axis=1, keepdims=True), 1e-300)
    axis = axis / length
    foot = np.cross(axis, moment / length)
    height, off = _meridian(local, foot, axis)
    system = np.stack([2 * off, 2 * height, np.ones_like(off)], axis=2)
    major, level, rest = (np.linalg.pinv(system) @ (off**2 + height**2)[:, :, None])[:, :, 0].T
    minor = np.sqrt(np.maximum(rest + major**2 + level**2, 0))
    centre = foot + level[:, None] * axis
    arm = local[:, 0] - centre
    across = unit((arm - np.sum(arm * axis, axis=1, keepdims=True) * axis).T).T
    size = scale[:, 0, 0]
    found = Tori(row, centre * size[:, None] + middle[:, 0], axis, across, major * size, minor * size)
    depth = np.linalg.svd(points - middle, compute_uv=False)[:, 2] / _P.torus_side  # root of the mean square
    near = np.minimum(tolerance, _P.torus_share * depth)
    whole = (_away(found, points) <= near) & (found.major > near) & (found.minor > near)
    return found, np.where(whole, near, 0.0)


def _away(found: Tori, points: Floats) -> Floats:
    """Greatest distance (n,) of points (n, m, 3) from tori."""
    height, off = _meridian(points, found.centre, found.axis)
    return np.asarray(
        np.abs(np.hypot(off - found.major[:, None], height) - found.minor[:, None]).max(axis=1, initial=0)
    )


def _meridian(points: Floats, foot: Floats, axis: Floats) -> tuple[Floats, Floats]:
    """Height (n, m) of points (n, m, 3) along axes (n, 3) over `foot` (n, 3) on them, and distance from them."""
    arm = points - foot[:, None]
    height = np.einsum("nmi,ni->nm", arm, axis)
    return height, np.linalg.norm(arm - height[:, :, None] * axis[:, None], axis=2)


# The kernel's recognition throws on some curves and surfaces: these are not recognised, which is no error.

_FRAME = tuple(f"{name}_{axis}" for name in ("origin", "axis_x", "axis_z") for axis in "xyz")
_NAN = float("nan")
_NO_FRAME: tuple[float, ...] = (_NAN,) * 9
# What gives the radius, radius2 and semi-angle of an analytic curve or surface.
SIZES = {
    "line": (),
    "circle": ("Radius",),
    "ellipse": ("MajorRadius", "MinorRadius"),
    "parabola": ("Focal",),
    "hyperbola": ("MajorRadius", "MinorRadius"),
    "plane": (),
    "cylinder": ("Radius",),
    "cone": ("RefRadius", "", "SemiAngle"),
    "sphere": ("Radius",),
    "torus": ("MajorRadius", "MinorRadius"),
}
# The kernel sets one radius of an ellipse after the other: neither must be less than what is there.
_FORMS: dict[str, Callable[[], Any]] = {
    "line": gp_Lin,
    "circle": lambda: gp_Circ(gp_Ax2(), 1.0),
    "ellipse": lambda: gp_Elips(gp_Ax2(), 1e100, 0.0),
    "plane": gp_Pln,
    "cylinder": gp_Cylinder,
    "sphere": gp_Sphere,
    "cone": gp_Cone,
}


def sizes_of(form: Any, kind: str) -> tuple[float, ...]:
    """Radius, radius2 and semi-angle of a form of the kernel; NaN where its kind has none."""
    return tuple(getattr(form, name)() if name else _NAN for name in (*SIZES[kind], "", "", "")[:3])


def _frame_of(position: Any) -> tuple[float, ...]:
    """Origin, X and Z axis of a coordinate system of the kernel; of an axis alone, as lines have, it is X."""
    origin, z = position.Location().Coord(), position.Direction().Coord()
    if not hasattr(position, "XDirection"):
        return (*origin, *z, _NAN, _NAN, _NAN)
    return (*origin, *position.XDirection().Coord(), *z)


def _recognised(shape: Any, *kinds: str) -> tuple[str | None, tuple[float, ...], tuple[float, ...]]:
    """Kind, frame and sizes of the first of these forms that a free-form edge or face has, if any."""
    with suppress(Exception):  # the kernel's exceptions share no base class
        look = ShapeAnalysis_CanonicalRecognition(shape)
        for kind in kinds:
            form = _FORMS[kind]()
            with suppress(Exception):
                if getattr(look, f"Is{kind.title()}")(_P.recognition_mm, form):
                    return kind, _frame_of(form.Position()), sizes_of(form, kind)
    return None, _NO_FRAME, _NO_FRAME[:3]


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


_AXIS = ("axis_x", "axis_y", "axis_z")
# Kinds by the kernel's names of classes; all others are splines.
_KINDS = {
    **{kind.title(): kind for kind in ("line", "circle", "ellipse", "parabola", "hyperbola", "plane")},
    "CylindricalSurface": "cylinder",
    "ConicalSurface": "cone",
    "SphericalSurface": "sphere",
    "ToroidalSurface": "torus",
    "SurfaceOfLinearExtrusion": "extrusion",
    "SurfaceOfRevolution": "revolution",
    "OffsetCurve": "offset",
    "OffsetSurface": "offset",
}


def untrimmed(thing: Any) -> tuple[Any, str, str]:
    """What a curve or surface of the kernel is a piece of, the name of its class, without its package, and its kind."""
    while (name := type(thing).__name__.partition("_")[2]) in ("TrimmedCurve", "RectangularTrimmedSurface"):
        thing = thing.BasisCurve() if name == "TrimmedCurve" else thing.BasisSurface()
    return thing, name, _KINDS.get(name, "spline")


def number_columns(names: tuple[str, ...], rows: list[tuple[float, ...]]) -> Table:
    """Columns by name of rows of numbers; numbers of rows as integers, what is yes or no as such."""
    types = {"direct": np.bool_, "reversed": np.bool_, "basis_arc": np.int64, "basis_surface": np.int64}
    return {
        name: column.astype(np.int64 if name.endswith("_no") else types.get(name, np.float64))
        for name, column in zip(names, np.array(rows, float).reshape(-1, len(names)).T, strict=True)
    }


def matrix(trsf: Any) -> Floats:
    """A transform of the kernel as 4x4 (scale included)."""
    out = np.eye(4)
    out[:3] = [[trsf.Value(row, column) for column in range(1, 5)] for row in range(1, 4)]
    return out


class _GeometryRows:
    """Collects the columns that curves and surfaces have in common; its properties are to be asked for at the end."""

    names: tuple[str, ...]  # of the numbers

    def __init__(self) -> None:
        self._kinds: list[str] = []
        self._recognised: list[str] = []
        self._numbers: list[tuple[float, ...]] = []
        self._splines: list[tuple[int, Any]] = []
        self._made_from: list[tuple[float, ...]] = []

    def __len__(self) -> int:
        return len(self._kinds)

    def _append(self, kind: str, recognised: str, *numbers: float) -> int:
        self._kinds.append(kind)
        self._recognised.append(recognised)
        self._numbers.append(numbers)
        return len(self) - 1

    def columns(self) -> Table:
        return {
            "kind": list(self._kinds),
            "recognised_kind": list(self._recognised),
            **number_columns(self.names, self._numbers),
            "provenance": ["exact"] * len(self),
            "residual": np.full(len(self), np.nan),
        }


class CurveRows(_GeometryRows):
    """Collects columns of `arc`, `arc_spline` and `arc_offset`; what offset ones are made from goes to `basis`."""

    names = (*_FRAME, "radius", "radius2", "t0", "t1")

    def __init__(self, basis: CurveRows | None = None) -> None:
        super().__init__()
        self.basis = self if basis is None else basis

    def add_degenerate(self, point: tuple[float, float, float], t0: float, t1: float) -> int:
        return self._append("degenerate", "degenerate", *point, *_NO_FRAME[3:], _NAN, _NAN, t0, t1)

    def add(self, curve: Any, t0: float, t1: float, shape: Any = None) -> int:
        """Append a curve over an interval and return its row; `shape` is the edge to recognise a spline on."""
        curve, name, kind = untrimmed(curve)
        recognised: str | None = None
        frame, sizes = _NO_FRAME, _NO_FRAME[:3]
        if kind == "offset":
            basis = self.basis.add(curve.BasisCurve(), t0, t1)
            self._made_from.append((len(self), basis, *curve.Direction().Coord(), curve.Offset()))
        if kind in SIZES:
            frame, sizes = _frame_of(curve.Position()), sizes_of(curve, kind)
        elif shape is not None:
            recognised, frame, sizes = _recognised(shape, "line", "circle", "ellipse")
        if kind == "spline":
            if name == "BezierCurve":
                curve = GeomConvert.CurveToBSplineCurve_s(curve)
            self._splines.append((len(self), spline_of(curve)))
        return self._append(kind, recognised or kind, *frame, *sizes[:2], t0, t1)

    @cached_property
    def splines(self) -> Table:
        curves = [curve for _, curve in self._splines]
        return {"arc_no": np.array([row for row, _ in self._splines], np.int64), **spline_columns(curves)}

    @cached_property
    def offsets(self) -> Table:
        return number_columns(("arc_no", "basis_arc", *_AXIS, "distance"), self._made_from)

    @cached_property
    def curves(self) -> Curves:
        """The curves to be evaluated."""
        basis = None if self.basis is self or not self.basis else self.basis.curves
        return Curves(self.columns(), self.splines, offsets=self.offsets, basis=basis)


class SurfaceRows(_GeometryRows):
    """Collects columns of `surface`, `surface_spline` and `surface_swept`.  What swept ones are made from goes to
    `basis_curves` and `basis`."""

    names = (*_FRAME, "radius", "radius2", "semi_angle", "u0", "u1", "v0", "v1", "direct", "reversed")

    def __init__(self, basis_curves: CurveRows, basis: SurfaceRows | None = None) -> None:
        super().__init__()
        self.basis_curves = basis_curves
        self.basis = self if basis is None else basis

    def add(self, surface: Any, domain: tuple[float, ...], reversed_: bool = False, shape: Any = None) -> int:
        """Append a surface over a domain u0 u1 v0 v1, return its row; `shape` is the face to recognise a spline on."""
        surface, name, kind = untrimmed(surface)
        recognised, direct, frame, sizes = None, True, _NO_FRAME, _NO_FRAME[:3]
        swept: tuple[float, ...] | None = None
        if kind in SIZES:
            frame, sizes, direct = _frame_of(surface.Position()), sizes_of(surface, kind), surface.Position().Direct()
        elif kind == "extrusion":
            basis = self.basis_curves.add(surface.BasisCurve(), domain[0], domain[1])
            swept = (basis, -1, *surface.Direction().Coord(), _NAN)
        elif kind == "revolution":
            basis = self.basis_curves.add(surface.BasisCurve(), domain[2], domain[3])
            axis = surface.Axis()
            frame = (*axis.Location().Coord(), *_NO_FRAME[3:6], *axis.Direction().Coord())
            swept = (basis, -1, *axis.Direction().Coord(), _NAN)
        elif kind == "offset":
            swept = (-1, self.basis.add(surface.BasisSurface(), domain), _NAN, _NAN, _NAN, surface.Offset())
        else:
            if name == "BezierSurface":
                surface = GeomConvert.SurfaceToBSplineSurface_s(surface)
            self._splines.append((len(self), surface))
        if kind not in SIZES and shape is not None:
            recognised, found, sizes_found = _recognised(shape, "plane", "cylinder", "sphere", "cone")
            if recognised is not None:
                if kind == "revolution":  # what is revolved stays on its own axis
                    foot, along = np.array(frame[:3]), np.array(frame[6:])
                    found = *(foot + along * (along @ (found[:3] - foot))).tolist(), *found[3:]
                frame, sizes = found, sizes_found
        if swept is not None:  # after those of the basis, which may be in the same table
            self._made_from.append((len(self), *swept))
        return self._append(kind, recognised or kind, *frame, *sizes, *domain, direct, reversed_)

    @cached_property
    def splines(self) -> Table:
        return surface_spline_columns(self._splines)

    @cached_property
    def swept(self) -> Table:
        return number_columns(("surface_no", "basis_arc", "basis_surface", *_AXIS, "distance"), self._made_from)

    @cached_property
    def surfaces(self) -> Surfaces:
        """The surfaces to be evaluated."""
        basis = None if self.basis is self or not self.basis else self.basis.surfaces
        basis_curves = None if not self.basis_curves else self.basis_curves.curves
        return Surfaces(self.columns(), self.splines, self.swept, basis_curves, basis)
