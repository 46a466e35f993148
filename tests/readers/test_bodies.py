"""Bodies extracted together have the rows of each alone."""

from __future__ import annotations

from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np
import pytest

from relmodel.columns import Ragged
from relmodel.loading.facets.facets import Facets, facets
from relmodel.model.model import Mesh
from relmodel.readers.step import shape as step_shape
from relmodel.readers.step import triangulation
from tests.features.test_features import box, cut, cylinder
from tests.readers.test_exact import compound, faces_of_rare_kinds

pytest.importorskip("OCP")
ROUND_OFF = 1e-12  # of the extent
VERTEX_MM = 1e-9  # vertices of triangles move along offset surfaces, whose derivatives are differences


def bodies() -> list[step_shape.Body]:
    """Solids of analytic and of spline surfaces, one of 20 m, and sheets of swept and offset ones."""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_NurbsConvert
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeSphere, BRepPrimAPI_MakeTorus

    bored = cut(box(0, 0, 0, (30.0, 20.0, 10.0)), cylinder(15, 10, -1, 4, 12))
    shapes = [
        bored,
        compound(faces_of_rare_kinds()),
        BRepPrimAPI_MakeBox(20000.0, 3000.0, 10.0).Shape(),
        BRepBuilderAPI_NurbsConvert(cut(bored, BRepPrimAPI_MakeTorus(9.0, 2.0).Shape()), True).Shape(),
        BRepPrimAPI_MakeSphere(7.0).Shape(),
        compound(faces_of_rare_kinds()[::-1]),
    ]
    return [step_shape.Body(one, {1: f"face of {i}"}, {2: "red"}, {}) for i, one in enumerate(shapes)]


def assert_same(a: Any, b: Any, least: float = 0.0) -> None:
    """Numbers to round-off or the least that counts, all else equal."""
    if isinstance(a, Ragged):
        assert_same(a.offsets, b.offsets)
        assert_same(a.values, b.values, least)
        assert_same(a.null, b.null)
    elif is_dataclass(a):
        for one in fields(a):
            assert_same(getattr(a, one.name), getattr(b, one.name), VERTEX_MM if isinstance(a, Mesh) else 0.0)
    elif isinstance(a, dict):
        assert a.keys() == b.keys()
        for name, values in a.items():
            assert_same(values, b[name])
    elif isinstance(a, np.ndarray) and a.dtype.kind == "f":
        size = max(1.0, float(np.nanmax(np.abs(a), initial=0)))
        off = max(ROUND_OFF * size, least) if a.dtype == np.float64 else 1e-7
        assert np.allclose(a, b, rtol=0, atol=off, equal_nan=True)
    else:
        assert np.array_equal(a, b)


def test_together_as_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(step_shape, "_FACES_BESIDE", 24)  # all but the last
    together = step_shape.extract_all(bodies())
    alone = [step_shape.extract(one.shape, one.names, one.colours, one.layers) for one in bodies()]
    for a, b in zip(together, alone, strict=True):
        assert_same(a, b)
    assert len({one.mesh.chord_mm for one in together}) == 2
    assert [one.kind for one in together].count("sheet") == 2


def test_faces_that_the_kernel_triangulates(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where ours fail on some faces of some bodies, their neighbours are cut as the kernel cut the arcs between."""
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeSphere

    def some(trims: Any, *rest: Any) -> list[Facets]:
        failing = np.asarray(trims.surfaces.radius == 5.0)
        return [one.without(failing) for one in facets(trims, *rest)]

    monkeypatch.setattr(triangulation, "facets", some)

    def drilled() -> list[Any]:
        balls = [BRepPrimAPI_MakeSphere(radius).Shape() for radius in (6.0, 5.0, 5.0)]
        return [cut(ball, cylinder(0, 2, -20, 2, 40)) for ball in balls]

    together = step_shape.extract_all([step_shape.Body(one) for one in drilled()])
    alone = [step_shape.extract(one, {}, {}, {}) for one in drilled()]
    for a, b in zip(together, alone, strict=True):
        assert_same(a.mesh, b.mesh)
