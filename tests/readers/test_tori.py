"""Tori that splines and surfaces of revolution hide, against the tori that they were made from."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace, BRepBuilderAPI_NurbsConvert
from OCP.Geom import Geom_Circle, Geom_Line, Geom_SurfaceOfRevolution, Geom_ToroidalSurface
from OCP.gp import gp_Ax1, gp_Ax2, gp_Ax3, gp_Dir, gp_Pnt

from relmodel.geometry.curves import vectors
from relmodel.model.measures import surfaces_of
from relmodel.readers.step.shape import extract

CENTRE, AXIS = np.array([1.0, 2.0, 3.0]), np.array([1.0, 2.0, 2.0]) / 3
NEAR_MM = 1e-3  # what recognition allows


def revolved(curve: Any, first: float, last: float) -> Any:
    """The face that a curve sweeps about the axis, .2 to 2 rad."""
    axis = gp_Ax1(gp_Pnt(*CENTRE), gp_Dir(*AXIS))
    return BRepBuilderAPI_MakeFace(Geom_SurfaceOfRevolution(curve, axis), 0.2, 2.0, first, last, 1e-7).Face()


def circle(along: float, across: float, aside: float, radius: float) -> Any:
    """A circle in a plane along the axis; `aside` is how far from it that plane lies."""
    x = np.array([0.0, 1.0, -1.0]) / np.sqrt(2)
    y = np.cross(AXIS, x)
    middle = CENTRE + along * AXIS + across * x + aside * y
    return Geom_Circle(gp_Ax2(gp_Pnt(*middle), gp_Dir(*y)), radius)


@pytest.mark.parametrize(
    ("major", "minor", "around", "tube"),
    [(10, 3, (0, 2 * np.pi), (0, 2 * np.pi)), (10, 3, (0.4, 1.7), (-0.5, 0.7)), (2, 3, (1, 2.3), (0.3, 1.2))],
    ids=["whole", "part", "spindle"],
)
def test_a_spline_that_is_a_torus_is_recognised(
    major: float, minor: float, around: tuple[float, float], tube: tuple[float, float]
) -> None:
    surface = Geom_ToroidalSurface(gp_Ax3(gp_Pnt(*CENTRE), gp_Dir(*AXIS)), major, minor)
    face = BRepBuilderAPI_MakeFace(surface, *around, *tube, 1e-7).Face()
    rows = extract(BRepBuilderAPI_NurbsConvert(face).Shape()).surfaces
    assert list(rows["kind"]) == ["spline"]
    assert list(rows["recognised_kind"]) == ["torus"]
    assert (rows["radius"][0], rows["radius2"][0]) == pytest.approx((major, minor), abs=1e-9)
    assert vectors(rows, "origin")[0] == pytest.approx(CENTRE, abs=1e-9)
    assert abs(vectors(rows, "axis_z")[0] @ AXIS) == pytest.approx(1, abs=1e-12)
    assert vectors(rows, "axis_x")[0] @ AXIS == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize("aside", [0.0, 0.01, 0.3, 2.0])
def test_a_circle_revolved_is_a_torus_as_far_as_it_is_one(aside: float) -> None:
    shape = extract(revolved(circle(4.0, 5.0, aside, 1.5), 0.1, 1.7))
    rows = shape.surfaces
    # Heights of its points and their distances from the axis lie on the meridian; the best circle through them:
    around, along = (x.ravel() for x in np.meshgrid(np.linspace(0.2, 2, 40), np.linspace(0.1, 1.7, 400)))
    arm = surfaces_of(shape).evaluate(0, around, along).points - CENTRE
    height = arm @ AXIS
    off = np.linalg.norm(arm - height[:, None] * AXIS, axis=1)
    system = np.stack([2 * off, 2 * height, np.ones(len(off))], axis=1)
    major, level, rest = np.linalg.lstsq(system, off**2 + height**2, rcond=None)[0]
    minor = np.sqrt(rest + major**2 + level**2)
    away = np.abs(np.hypot(off - major, height - level) - minor).max()
    assert list(rows["recognised_kind"]) == ["torus" if away < NEAR_MM else "revolution"]
    if away < NEAR_MM:
        assert (rows["radius"][0], rows["radius2"][0]) == pytest.approx((major, minor), abs=1e-3)
        assert vectors(rows, "origin")[0] == pytest.approx(CENTRE + level * AXIS, abs=1e-3)


def test_a_line_revolved_has_the_sizes_of_what_it_is() -> None:
    x = np.array([0.0, 1.0, -1.0]) / np.sqrt(2)
    start = gp_Pnt(*(CENTRE + 5 * x + 2 * AXIS))
    for along, kind in ((AXIS, "cylinder"), (AXIS + x, "cone"), (x, "plane")):
        rows = extract(revolved(Geom_Line(start, gp_Dir(*along)), 0.0, 4.0)).surfaces
        origin, axis = vectors(rows, "origin")[0], vectors(rows, "axis_z")[0]
        assert list(rows["recognised_kind"]) == [kind]
        assert abs(axis @ AXIS) == pytest.approx(1, abs=1e-9)
        assert np.cross(origin - CENTRE, AXIS) == pytest.approx(np.zeros(3), abs=1e-9)
        if kind == "cylinder":
            assert rows["radius"][0] == pytest.approx(5)
        elif kind == "cone":  # its radius is that at its origin
            slope = np.tan(rows["semi_angle"][0]) * (axis @ AXIS)
            assert slope == pytest.approx(1)
            assert rows["radius"][0] == pytest.approx(5 + (origin - CENTRE) @ AXIS - 2)
        else:
            assert (origin - CENTRE) @ AXIS == pytest.approx(2)
