"""Areas and volumes against closed forms, on analytic surfaces, and on the same as b-splines far off."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from OCP.BRepAlgoAPI import BRepAlgoAPI_Common
from OCP.BRepBuilderAPI import BRepBuilderAPI_NurbsConvert
from OCP.BRepPrimAPI import (
    BRepPrimAPI_MakeCone,
    BRepPrimAPI_MakeCylinder,
    BRepPrimAPI_MakeSphere,
    BRepPrimAPI_MakeTorus,
)
from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt

from relmodel.readers.step import shape as step_shape
from tests.features.test_features import box, cut, cylinder
from tests.parts.solids import carried
from tests.poses import pose_of

PI = np.pi
FRAME = gp_Ax2(gp_Pnt(30, -20, 50), gp_Dir(1, 2, 2))
LYING = BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(-20, 0, 0), gp_Dir(1, 0, 0)), 5.0, 40.0).Shape()
# Of each solid its volume, and its whole area by kind of surface; what a bore leaves of a ball is as high as the bore,
# and has the volume of a ball of this height; what two bars have in common is Archimedes'.
SOLIDS: dict[str, tuple[Any, float, dict[str, float]]] = {
    "cylinder": (
        BRepPrimAPI_MakeCylinder(FRAME, 5.0, 12.0).Shape(),
        300 * PI,
        {"cylinder": 120 * PI, "plane": 50 * PI},
    ),
    "cone": (BRepPrimAPI_MakeCone(FRAME, 6.0, 0.0, 8.0).Shape(), 96 * PI, {"cone": 60 * PI, "plane": 36 * PI}),
    "ball": (BRepPrimAPI_MakeSphere(FRAME, 7.0).Shape(), 4 / 3 * 343 * PI, {"sphere": 196 * PI}),
    "ring": (BRepPrimAPI_MakeTorus(FRAME, 9.0, 2.0).Shape(), 72 * PI**2, {"torus": 72 * PI**2}),
    "bored ball": (
        cut(BRepPrimAPI_MakeSphere(10.0).Shape(), cylinder(0, 0, -20, 6, 40)),
        4 / 3 * PI * 8**3,
        {"sphere": 320 * PI, "cylinder": 192 * PI},
    ),
    "crossing bars": (
        BRepAlgoAPI_Common(cylinder(0, 0, -20, 5, 40), LYING).Shape(),
        16 / 3 * 125,
        {"cylinder": 16 * 25},
    ),
    "half a ring": (
        cut(BRepPrimAPI_MakeTorus(9.0, 2.0).Shape(), box(-20, -20, -5, (40.0, 40.0, 5.0))),
        36 * PI**2,
        {"plane": PI * (121 - 49), "torus": 36 * PI**2},
    ),
}


def far_off(shape: Any) -> Any:
    """The shape as b-splines, turned and shifted."""
    return BRepBuilderAPI_NurbsConvert(carried(shape, pose_of((2000, -1500, 700), (0.2, 0.4, 0.6)))).Shape()


@pytest.mark.parametrize(("name", "far"), [*((name, False) for name in SOLIDS), ("cone", True), ("bored ball", True)])
def test_areas_and_volumes(name: str, far: bool) -> None:
    body, volume, areas = SOLIDS[name]
    shape = step_shape.extract(far_off(body) if far else body)
    close = 1e-10 if shape.surfaces["kind"] == shape.surfaces["recognised_kind"] and name in list(SOLIDS)[:4] else 1e-6
    assert shape.volume == pytest.approx(volume, rel=close)
    kinds = np.array(shape.surfaces["recognised_kind"])
    found = {str(kind): float(shape.surfaces["area"][kinds == kind].sum()) for kind in np.unique(kinds)}
    assert found == pytest.approx(areas, rel=close)


def test_the_centroid_of_half_a_ball() -> None:
    """Its round face has it half-way up."""
    half = step_shape.extract(BRepPrimAPI_MakeSphere(4.0, 0.0, PI / 2, 2 * PI).Shape())
    ball = list(half.surfaces["kind"]).index("sphere")
    assert [half.surfaces[f"centroid_{a}"][ball] for a in "xyz"] == pytest.approx([0, 0, 2], abs=1e-9)
    assert half.volume == pytest.approx(2 / 3 * PI * 64, rel=1e-10)
