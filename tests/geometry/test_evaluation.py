"""Lengths, boxes, parameters and normals of curves and surfaces; points are held against the kernel by STEP's tests."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from OCP.collections import Array1_double, Array1_gp_Pnt, Array1_int
from OCP.Geom import (
    Geom_BezierCurve,
    Geom_BSplineCurve,
    Geom_Circle,
    Geom_ConicalSurface,
    Geom_CylindricalSurface,
    Geom_Ellipse,
    Geom_Hyperbola,
    Geom_Line,
    Geom_Parabola,
    Geom_Plane,
    Geom_SphericalSurface,
    Geom_ToroidalSurface,
    Geom_TrimmedCurve,
)
from OCP.GeomConvert import GeomConvert
from OCP.gp import gp_Ax3, gp_Dir, gp_Pnt

from relmodel.geometry.splines import Basis
from relmodel.geometry.surfaces import Surfaces
from relmodel.readers.step.geometry import CurveRows, SurfaceRows


def kernel_frame(seed: int) -> Any:
    r = np.random.default_rng(seed)
    return gp_Ax3(gp_Pnt(*r.uniform(-50, 50, 3).tolist()), gp_Dir(*r.normal(size=3)), gp_Dir(*r.normal(size=3)))


def kernel_curves() -> list[tuple[Any, float, float]]:
    """Every kind of curve with an interval, b-splines clamped, unclamped, rational and periodic."""
    frame = kernel_frame(1).Ax2()
    ellipse = Geom_Ellipse(frame, 7.0, 3.0)
    periodic = GeomConvert.CurveToBSplineCurve_s(ellipse)
    polynomial = GeomConvert.CurveToBSplineCurve_s(Geom_BezierCurve(points_array(6, 2)))
    polynomial.InsertKnot(0.3)
    polynomial.InsertKnot(0.7, 2)
    return [
        (Geom_Line(kernel_frame(2).Axis()), -3.0, 11.0),
        (Geom_Circle(frame, 5.0), 0.4, 6.0),
        (Geom_TrimmedCurve(ellipse, 1.0, 4.0), 1.0, 4.0),
        (Geom_Parabola(frame, 2.5), -3.0, 4.0),
        (Geom_Hyperbola(frame, 4.0, 2.0), -1.0, 1.5),
        (polynomial, 0.0, 1.0),
        (periodic, 0.0, 2 * np.pi),
        (periodic, 4.0, 9.0),
        (free_periodic_curve(3, 7), 0.2, 6.9),
        (free_periodic_curve(2, 5, rational=True), 0.0, 5.0),
    ]


def points_array(count: int, seed: int) -> Any:
    poles = Array1_gp_Pnt(1, count)
    for i, p in enumerate(np.random.default_rng(seed).uniform(-20, 20, (count, 3)).tolist()):
        poles.SetValue(i + 1, gp_Pnt(*p))
    return poles


def free_periodic_curve(degree: int, count: int, rational: bool = False) -> Any:
    knots, multiplicities, weights = Array1_double(1, count + 1), Array1_int(1, count + 1), Array1_double(1, count)
    for i in range(count + 1):
        knots.SetValue(i + 1, float(i))
        multiplicities.SetValue(i + 1, 1)
    for i in range(count):
        weights.SetValue(i + 1, 1.0 + 0.3 * i if rational else 1.0)
    return Geom_BSplineCurve(points_array(count, degree), weights, knots, multiplicities, degree, True)


def test_lengths_and_boxes_hold_a_fine_polyline() -> None:
    rows = CurveRows()
    for one in kernel_curves():
        rows.add(*one)
    curves = rows.curves
    lengths, boxes = curves.lengths(), curves.boxes()
    for i in range(len(curves)):
        t = np.linspace(curves.t0[i], curves.t1[i], 20_001)
        points = curves.evaluate(np.full(len(t), i), t)[0]
        assert lengths[i] == pytest.approx(np.linalg.norm(np.diff(points, axis=0), axis=1).sum(), rel=1e-6)
        assert boxes[i] == pytest.approx(np.concatenate([points.min(0), points.max(0)]), abs=1e-5)
        assert np.all(boxes[i, :3] <= points.min(0) + 1e-11)
        assert np.all(boxes[i, 3:] >= points.max(0) - 1e-11)


def kernel_surfaces() -> list[tuple[Any, tuple[float, float, float, float]]]:
    left_handed = kernel_frame(3)
    left_handed.YReverse()
    turn = (0.3, 5.0, -0.7, 1.1)
    return [
        (Geom_Plane(left_handed), (-3.0, 4.0, 1.0, 2.0)),
        (Geom_CylindricalSurface(kernel_frame(5), 6.0), turn),
        (Geom_ConicalSurface(left_handed, 0.4, 6.0), turn),
        (Geom_SphericalSurface(kernel_frame(6), 8.0), turn),
        (Geom_ToroidalSurface(kernel_frame(4), 9.0, 2.0), turn),
    ]


def rows_of(made: list[tuple[Any, tuple[float, float, float, float]]]) -> Surfaces:
    rows = SurfaceRows(CurveRows(), SurfaceRows(CurveRows()))
    for surface, domain in made:
        rows.add(surface, domain)
    return rows.surfaces


def test_parameters_are_the_inverse() -> None:
    surfaces = rows_of(kernel_surfaces())
    r = np.random.default_rng(8)
    row = np.repeat(np.arange(5), 50)
    u = r.uniform(-3, 3, len(row))
    v = r.uniform(-1.5, 1.5, len(row))
    found = surfaces.parameters(row, surfaces.evaluate(row, u, v).points)
    assert found[0] == pytest.approx(u, abs=1e-12)
    assert found[1] == pytest.approx(v, abs=1e-12)
    # Behind the apex of the cone too.
    back = surfaces.evaluate(np.full(9, 2), np.linspace(-3, 3, 9), np.full(9, -40.0))
    found = surfaces.parameters(np.full(9, 2), back.points)
    assert found[0] == pytest.approx(np.linspace(-3, 3, 9), abs=1e-12)
    assert found[1] == pytest.approx(np.full(9, -40.0), abs=1e-12)


def test_normals_at_a_pole_and_an_apex_are_those_beside_them() -> None:
    surfaces = rows_of(kernel_surfaces())
    surfaces.domain[3] = (-np.pi, np.pi, 0.0, np.pi / 2)
    pole = surfaces.normals([3], [0.4], [np.pi / 2])[0]
    assert pole == pytest.approx(surfaces.z[3], abs=1e-4)
    apex_v = -surfaces.radius[2] / np.sin(surfaces.semi_angle[2])
    surfaces.domain[2] = (-np.pi, np.pi, apex_v, apex_v + 10.0)
    at_apex = surfaces.normals([2], [0.0], [apex_v])[0]
    assert at_apex == pytest.approx(surfaces.normals([2], [0.0], [apex_v + 1.0])[0], abs=1e-4)


def test_functions_sum_to_one_and_their_derivatives_to_nothing() -> None:
    r = np.random.default_rng(9)
    for degree in range(1, 9):
        for periodic in (False, True):
            knots = np.cumsum(r.uniform(0.1, 2.0, 7))
            inner = r.integers(1, degree + 1, 5)
            ends = [degree, degree] if periodic else [degree + 1, degree + 1]
            basis = Basis([degree], [periodic], [knots], [[ends[0], *inner, ends[1]]])
            t = np.concatenate([np.linspace(knots[0], knots[-1], 50), knots])
            _, value, derivative = basis.at(np.zeros(len(t), np.int64), t)
            assert value.sum(0) == pytest.approx(np.ones(len(t)))
            assert derivative.sum(0) == pytest.approx(np.zeros(len(t)), abs=1e-9)
            assert value.min() > -1e-12
