"""The committed bulkhead against its golden table, counted by the CAD kernel."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

EXAMPLES = Path(__file__).parents[2] / "examples"
pytest.importorskip("OCP")


def golden(variant: str) -> dict[str, Any]:
    table: dict[str, Any] = json.loads((EXAMPLES / f"bulkhead/golden/bulkhead_{variant}.json").read_text())
    return table


def count(shape: Any, kind: Any) -> int:
    from OCP.collections import IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher
    from OCP.TopExp import TopExp

    found = IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher()
    TopExp.MapShapes_s(shape, kind, found)
    return int(found.Extent())


def test_the_generator_makes_the_committed_body() -> None:
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps
    from OCP.TopAbs import TopAbs_FACE

    from examples.bulkhead import solids
    from examples.bulkhead.design import variant_a

    row = golden("A")["parts"]["BULKHEAD_BODY"]
    body = solids.body(variant_a())
    volume = GProp_GProps()
    BRepGProp.VolumeProperties_s(body, volume)
    assert count(body, TopAbs_FACE) == row["faces"]
    assert volume.Mass() == pytest.approx(row["volume_mm3"], rel=1e-6)
