"""Areas and volumes against closed forms, on analytic surfaces, on the same as b-splines, and on swept ones."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from relmodel.model.model import Shape
from relmodel.readers.step import shape as step_shape
from tests.features.test_features import box, cut, cylinder

Floats = npt.NDArray[np.float64]
pytest.importorskip("OCP")


def as_built(shape: Any) -> Any:
    return shape


def as_splines(shape: Any) -> Any:
    from OCP.BRepBuilderAPI import BRepBuilderAPI_NurbsConvert

    return BRepBuilderAPI_NurbsConvert(shape).Shape()


def far_off(shape: Any) -> Any:
    """The shape as b-splines, turned and shifted."""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_Transform
    from OCP.gp import gp_Ax1, gp_Dir, gp_Pnt, gp_Trsf, gp_Vec

    turn, shift = gp_Trsf(), gp_Trsf()
    turn.SetRotation(gp_Ax1(gp_Pnt(0, 0, 0), gp_Dir(1, 2, 3)), 0.7)
    shift.SetTranslation(gp_Vec(2000, -1500, 700))
    return as_splines(BRepBuilderAPI_Transform(shape, shift.Multiplied(turn), True).Shape())


WAYS = pytest.mark.parametrize("way", [as_built, as_splines, far_off])


def extracted(shape: Any) -> Shape:
    return step_shape.extract(shape)


def areas(shape: Shape, kind: str) -> list[float]:
    """Areas of the faces of a recognised kind, in order."""
    given = zip(shape.surfaces["area"].tolist(), shape.surfaces["recognised_kind"], strict=True)
    return sorted(area for area, k in given if k == kind)


def ball(radius: float) -> Any:
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeSphere

    return BRepPrimAPI_MakeSphere(radius).Shape()


@WAYS
def test_a_bored_ball(way: Callable[[Any], Any]) -> None:
    """What is left of a ball with a bore is as high as the bore, and its volume is that of a ball of this height."""
    radius, bore = 10.0, 6.0
    shape = extracted(way(cut(ball(radius), cylinder(0, 0, -20, bore, 40))))
    half = np.sqrt(radius**2 - bore**2)
    assert shape.volume == pytest.approx(4 / 3 * np.pi * half**3, rel=1e-6)
    assert areas(shape, "sphere") == pytest.approx([4 * np.pi * radius * half], rel=1e-6)
    assert areas(shape, "cylinder") == pytest.approx([2 * np.pi * bore * 2 * half], rel=1e-6)


@WAYS
def test_two_bars_crossing_at_right_angles(way: Callable[[Any], Any]) -> None:
    """What two cylinders of radius r have in common has the volume 16/3 r^3 and the surface 16 r^2 (Archimedes)."""
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Common
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeCylinder
    from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt

    lying = BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(-20, 0, 0), gp_Dir(1, 0, 0)), 5.0, 40.0).Shape()
    shape = extracted(way(BRepAlgoAPI_Common(cylinder(0, 0, -20, 5, 40), lying).Shape()))
    assert shape.volume == pytest.approx(16 / 3 * 125, rel=1e-6)
    assert sum(shape.surfaces["area"]) == pytest.approx(16 * 25, rel=1e-6)


@WAYS
def test_a_ring_cut_by_its_plane(way: Callable[[Any], Any]) -> None:
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeTorus

    shape = extracted(way(cut(BRepPrimAPI_MakeTorus(9.0, 2.0).Shape(), box(-20, -20, -5, (40.0, 40.0, 5.0)))))
    assert shape.volume == pytest.approx(np.pi**2 * 9 * 4, rel=1e-6)
    assert areas(shape, "plane") == pytest.approx([np.pi * (121 - 49)], rel=1e-6)


def spline() -> Any:
    """An arch over the x axis through some points, in the plane y = 0."""
    from OCP.collections import HArray1_gp_Pnt
    from OCP.GeomAPI import GeomAPI_Interpolate
    from OCP.gp import gp_Pnt

    places = [(0.0, 3.0), (4.0, 6.0), (9.0, 5.0), (15.0, 7.0), (20.0, 2.0)]
    points = HArray1_gp_Pnt(1, len(places))
    for i, (x, z) in enumerate(places):
        points.SetValue(i + 1, gp_Pnt(x, 0, z))
    maker = GeomAPI_Interpolate(points, False, 1e-9)
    maker.Perform()
    return maker.Curve()


def profile() -> tuple[Any, Floats, Floats]:
    """The face between the arch and the x axis, and a fine polyline x, z of the arch."""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge, BRepBuilderAPI_MakeFace, BRepBuilderAPI_MakeWire
    from OCP.gp import gp_Pnt

    arch = spline()
    corners = [gp_Pnt(20, 0, 2), gp_Pnt(20, 0, 0), gp_Pnt(0, 0, 0), gp_Pnt(0, 0, 3)]
    wire = BRepBuilderAPI_MakeWire(BRepBuilderAPI_MakeEdge(arch).Edge())
    for a, b in pairwise(corners):
        wire.Add(BRepBuilderAPI_MakeEdge(a, b).Edge())
    t = np.linspace(arch.FirstParameter(), arch.LastParameter(), 400_001)
    knots = np.array([arch.Knot(i) for i in range(1, arch.NbKnots() + 1)])
    t = np.sort(np.concatenate([t, knots]))
    basis = points_of(arch, t)
    return BRepBuilderAPI_MakeFace(wire.Wire(), True).Face(), basis[:, 0], basis[:, 2]


def points_of(curve: Any, t: Floats) -> Floats:
    """Points of a cubic by its local polynomials, from the kernel's derivatives at the knots."""
    from OCP.gp import gp_Pnt, gp_Vec

    out = np.empty((len(t), 3))
    p, d1, d2, d3 = gp_Pnt(), gp_Vec(), gp_Vec(), gp_Vec()
    for i in range(1, curve.NbKnots()):
        low, high = curve.Knot(i), curve.Knot(i + 1)
        middle = (low + high) / 2
        curve.D3(middle, p, d1, d2, d3)
        at = (t >= low) & (t <= high)
        h = (t[at] - middle)[:, None]
        terms = (np.array(x.Coord()) for x in (p, d1, d2, d3))
        out[at] = sum(x * h**k / f for k, (x, f) in enumerate(zip(terms, (1, 1, 2, 6), strict=True)))
    return out


@WAYS
def test_an_extruded_and_a_turned_spline(way: Callable[[Any], Any]) -> None:
    from OCP.BRepPrimAPI import BRepPrimAPI_MakePrism, BRepPrimAPI_MakeRevol
    from OCP.gp import gp_Ax1, gp_Dir, gp_Pnt, gp_Vec

    face, x, z = profile()
    dx, dz, middle = np.diff(x), np.diff(z), (z[1:] + z[:-1]) / 2
    length, under = np.hypot(dx, dz), float(np.sum(dx * middle))
    bar = extracted(way(BRepPrimAPI_MakePrism(face, gp_Vec(0, 8, 0)).Shape()))
    assert bar.volume == pytest.approx(8 * under, rel=1e-6)
    curved = [i for i, k in enumerate(bar.surfaces["recognised_kind"]) if k in ("extrusion", "spline")]
    assert bar.surfaces["area"][curved] == pytest.approx([8 * length.sum()], rel=1e-6)

    # Pappus and Guldin, for a turn of 2 rad about the x axis.
    axis = gp_Ax1(gp_Pnt(0, 0, 0), gp_Dir(1, 0, 0))
    turned = extracted(way(BRepPrimAPI_MakeRevol(face, axis, 2.0).Shape()))
    assert turned.volume == pytest.approx(np.sum(dx * (middle**2 + dz**2 / 12)), rel=1e-6)
    curved = [i for i, k in enumerate(turned.surfaces["recognised_kind"]) if k in ("revolution", "spline")]
    assert turned.surfaces["area"][curved] == pytest.approx([2 * np.sum(length * middle)], rel=1e-6)
