"""Surfaces of meshes against closed forms: free-form, inexact boundaries, uneven triangles, rounded coordinates."""

from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge, BRepBuilderAPI_MakeFace, BRepBuilderAPI_MakeWire
from OCP.BRepPrimAPI import BRepPrimAPI_MakePrism
from OCP.collections import HArray1_gp_Pnt
from OCP.GeomAPI import GeomAPI_Interpolate
from OCP.gp import gp_Pnt, gp_Vec
from scipy.spatial import Delaunay

from relmodel.model.model import Shape
from relmodel.readers.mesh.shape import shape_from_triangles
from relmodel.readers.mesh.triangles import chain_edges, without_lines
from tests.parts.solids import Part, cylinder, fillet, turned
from tests.parts.tessellations import extracted

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]


def found(points: Floats) -> Shape:
    """The shape of a grid of points (n, m, 3), as single precision holds them, on a part some three metres long."""
    n, m = points.shape[:2]
    at = np.arange(n * m).reshape(n, m)
    a, b, c, d = at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:]
    triangles = np.stack([np.stack([a, b, c], axis=-1), np.stack([a, c, d], axis=-1)], axis=2).reshape(-1, 3)
    far = np.array([[3000.0, 0, 0], [3000, 1, 0], [3000, 0, 1]])
    vertices = np.concatenate([points.reshape(-1, 3), far]).astype(np.float32).astype(float)
    shape = shape_from_triangles(vertices, np.concatenate([triangles, [n * m + np.arange(3)]]))
    assert shape is not None
    return shape


def shares(shape: Shape) -> dict[str, float]:
    """Share of the area by kind, but for planes."""
    kinds = np.asarray(shape.surfaces["kind"])
    area = np.where(kinds == "plane", 0.0, np.asarray(shape.surfaces["area"]))
    assert area.any()
    return {str(k): float(area[kinds == k].sum() / area.sum()) for k in np.unique(kinds[area > 0])}


@pytest.mark.parametrize("strips", [60, 300])
def test_a_wall_along_an_ellipse_is_free_form(strips: int) -> None:
    turn = np.linspace(0, np.pi, strips + 1)
    rim = np.stack([228 * np.cos(turn), 188 * np.sin(turn), 0 * turn], axis=1)
    up = np.array([0, 0, 40])
    assert shares(found(np.stack([1.2 * rim, rim, rim + up, 1.2 * rim + up], axis=1))) == {"facets": pytest.approx(1)}


def crown(seed: int) -> Any:
    """A plate along a spline, with holes, some at its edge, and a rounded rim, of random sizes."""
    rng = np.random.default_rng(seed)
    x = np.linspace(0, float(rng.uniform(150, 500)), int(rng.integers(4, 8)))
    y = 60 + 0.15 * x[-1] * np.sin(np.pi * x / x[-1]) + rng.uniform(-8, 8, len(x))
    points = HArray1_gp_Pnt(1, len(x))
    for i, (a, b) in enumerate(zip(x.tolist(), y.tolist(), strict=True)):
        points.SetValue(i + 1, gp_Pnt(a, b, 0))
    top = GeomAPI_Interpolate(points, False, 1e-9)
    top.Perform()
    outline = BRepBuilderAPI_MakeWire(BRepBuilderAPI_MakeEdge(top.Curve()).Edge())
    far = float(x[-1])
    for (a, b), (c, d) in pairwise([(far, float(y[-1])), (far, 0.0), (0.0, 0.0), (0.0, float(y[0]))]):
        outline.Add(BRepBuilderAPI_MakeEdge(gp_Pnt(a, b, 0), gp_Pnt(c, d, 0)).Edge())
    t = float(rng.uniform(8, 30))
    part = Part(BRepPrimAPI_MakePrism(BRepBuilderAPI_MakeFace(outline.Wire()).Face(), gp_Vec(0, 0, t)).Shape())
    rim = float(rng.uniform(5, 15))
    part.body = fillet(part.body, rim, lambda a, b: bool(max(a[1], b[1]) < 1e-6 < abs(a[2] - b[2])))
    for share in (0.2, 0.5, 0.8):
        part.cut(cylinder((share * far, 25.0, -1), float(rng.uniform(2, 5)), t + 2))
    k = len(x) // 2
    part.cut(cylinder((float(x[k]), float(y[k]), -1), float(rng.uniform(4, 9)), t + 2))
    return turned(part, rng).body


def test_parts_of_splines_have_no_cylinders_but_their_own() -> None:
    exact = extracted(crown(102))
    vertices = exact.mesh.vertices.astype(np.float32).astype(float)
    mesh = shape_from_triangles(vertices, exact.mesh.triangles.astype(np.int64))
    assert mesh is not None
    sizes = []
    for shape in (exact, mesh):
        rows = np.asarray(shape.surfaces["recognised_kind"]) == "cylinder"
        sizes.append({column: np.asarray(shape.surfaces[column], float)[rows] for column in ("radius", "area")})
    true, fitted = sizes
    # Kernels cut a hole into halves, and holes of a mesh are whole.
    for size in (true, fitted):
        order = np.argsort(size["radius"])
        cuts = np.flatnonzero(np.diff(size["radius"][order]) > 1e-3) + 1
        size["area"] = np.array([part.sum() for part in np.split(size["area"][order], cuts)])
        size["radius"] = np.array([part[0] for part in np.split(size["radius"][order], cuts)])
    np.testing.assert_allclose(fitted["radius"], true["radius"], atol=2e-3)
    np.testing.assert_allclose(fitted["area"], true["area"], rtol=0.02)


def test_a_cylinder_of_a_rim_less_exact_than_its_mesh_is_fine_is_a_cylinder() -> None:
    turn = np.linspace(0, 1.57, 40)
    radius = 10 - 1.5e-3 * np.sin(9 * turn) ** 2  # the chords stand off by 2e-3 mm
    rims = [np.stack([r * np.cos(turn), r * np.sin(turn), h + 0 * turn], axis=1) for r, h in ((radius, 0), (10, 300))]
    shape = found(np.stack(rims, axis=1))
    assert shares(shape) == {"cylinder": pytest.approx(1)}
    assert np.nanmax(np.asarray(shape.surfaces["radius"])) == pytest.approx(10, abs=5e-3)


def test_a_line_that_goes_on_as_a_curve_is_an_arc_of_its_own() -> None:
    x = np.linspace(0, 10, 11)
    curve = np.stack([100 + x, 0.005 * x**3, 0 * x], axis=1)
    points = np.concatenate([[[0.0, 0, 0], [60.0, 0, 0]], curve])
    ends = np.stack([np.arange(len(points) - 1), np.arange(1, len(points))], axis=1)
    side = np.zeros(len(ends), np.int64)
    whole = chain_edges(points, ends, side, side + 1)
    assert whole.count == 1
    cut = without_lines(points, whole, np.ones(1, bool), 1e-6)
    assert np.diff(cut.offsets).tolist() == [2, 10]
    assert cut.vertices.tolist() == [0, 1, 2, 2, *range(3, 13)]


def grid(rows: int, columns: int) -> Ints:
    """Triangles of a grid of vertices."""
    at = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:]
    return np.stack([np.stack([a, b, c], axis=-1), np.stack([a, c, d], axis=-1)], axis=2).reshape(-1, 3)


def torus(major: float, minor: float, u: Floats, v: Floats) -> Floats:
    u, v = np.meshgrid(u, v, indexing="ij")
    rho = major + minor * np.cos(v)
    return np.stack([rho * np.cos(u), rho * np.sin(u), minor * np.sin(v)], axis=-1).reshape(-1, 3)


def test_a_narrow_sector_of_a_cone_is_one_cone() -> None:
    """A mesh as kernels make it, with two fans: each of them lies on a cylinder within rounding."""
    turned, rows = np.radians(18.7), 3
    wall = [(5.0, 9.0, i / 5) for i in range(6)]  # radius, height, share of the turn
    top = [(5.0, 5.0, i / 5) for i in range(6)]
    bottom = [(10.0, 0.0, i / 5) for i in range(6)]
    far = [(40.0, 0.0, i / 5) for i in range(6)]
    middle = [(5 + 1.25 * k, 5 - 1.25 * k, i / 3) for k in range(1, rows + 1) for i in (1, 2)]
    place = np.array(wall + top + bottom + far + middle)
    at = turned * place[:, 2]
    vertices = np.stack([place[:, 0] * np.cos(at), place[:, 0] * np.sin(at), place[:, 1]], axis=1)
    w, t, b, f = (range(6 * k, 6 * k + 6) for k in range(4))
    (p, q), (r, s), (x, y) = ((24 + 2 * k, 25 + 2 * k) for k in range(rows))
    cone = [(t[3], t[2], p), (t[3], p, q), (t[2], t[1], p), (t[1], t[0], p), (t[5], t[4], q), (t[4], t[3], q)]
    cone += [(t[0], b[0], r), (p, t[0], r), (r, b[0], x), (b[5], t[5], s), (t[5], q, s), (b[5], s, y)]
    cone += [(b[0], b[1], x), (b[1], b[2], x), (b[2], b[3], x), (x, b[3], y), (b[3], b[4], y), (b[4], b[5], y)]
    cone += [(q, p, s), (p, r, s), (r, x, y), (s, r, y)]
    strips = [(o[i], u[i], u[i + 1]) for o, u in ((w, t), (b, f)) for i in range(5)]
    strips += [(o[i], u[i + 1], o[i + 1]) for o, u in ((w, t), (b, f)) for i in range(5)]
    shape = shape_from_triangles(vertices.astype(np.float32).astype(float), np.array(cone + strips))
    assert shape is not None
    assert sorted(shape.surfaces["kind"]) == ["cone", "cylinder", "plane"]
    rows_of = {str(kind): i for i, kind in enumerate(shape.surfaces["kind"])}
    assert shape.surfaces["semi_angle"][rows_of["cone"]] == pytest.approx(np.pi / 4, abs=1e-4)
    assert np.sum(shape.mesh.triangle_surfaces == rows_of["cone"]) == len(cone)


def test_a_torus_in_uneven_triangles_is_a_torus() -> None:
    """No few facets tell of its axis, but all do."""
    rng = np.random.default_rng(0)
    major, minor = 5.0, 0.2
    reach = np.array([major, 2.3 * minor])  # around, and around the tube, mm
    around, tube = (np.linspace(0, length, int(length / 0.04)) for length in reach)
    rim = [np.stack([x, np.full_like(x, y)], axis=1) for x, y in ((around, 0.0), (around, reach[1]))]
    rim += [np.stack([np.full_like(y, x), y], axis=1) for x, y in ((0.0, tube), (reach[0], tube))]
    place = np.unique(np.concatenate([*rim, rng.uniform(0, reach, (540, 2))]), axis=0)
    triangles = Delaunay(place).simplices.astype(np.int64)
    u, v = place[:, 0] / major, place[:, 1] / minor
    rho = major + minor * np.cos(v)
    vertices = np.stack([rho * np.cos(u), rho * np.sin(u), minor * np.sin(v)], axis=1)
    shape = shape_from_triangles(vertices.astype(np.float32).astype(float), triangles)
    assert shape is not None
    at = list(shape.surfaces["kind"]).index("torus")
    assert np.mean(shape.mesh.triangle_surfaces == at) > 0.99
    assert shape.surfaces["radius"][at] == pytest.approx(major, abs=1e-5)
    assert shape.surfaces["radius2"][at] == pytest.approx(minor, abs=1e-5)
    assert "cylinder" not in shape.surfaces["kind"]


def test_a_torus_of_rounded_coordinates_is_a_torus() -> None:
    u, v = np.linspace(0, 2 * np.pi, 31), np.linspace(0, 2 * np.pi, 17)
    shape = shape_from_triangles(np.round(torus(20.0, 6.0, u, v), 4), grid(len(u), len(v)))
    assert shape is not None
    assert list(shape.surfaces["kind"]) == ["torus"]
    assert shape.surfaces["radius2"][0] == pytest.approx(6.0, abs=1e-3)
