"""Surfaces of meshes against closed forms: free-form, inexact boundaries, uneven triangles, rounded coordinates."""

import numpy as np
import numpy.typing as npt
import pytest
from scipy.spatial import Delaunay

from relmodel.geometry.transforms import rotation_matrix
from relmodel.model.model import Shape
from relmodel.readers.mesh.fit import CONE, CYLINDER, SPHERE, TORUS, fit_surfaces
from relmodel.readers.mesh.shape import shape_from_triangles
from relmodel.readers.mesh.triangles import chain_edges, without_lines

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]


def grid(rows: int, columns: int) -> Ints:
    """Triangles of a grid of vertices."""
    at = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:]
    return np.stack([np.stack([a, b, c], axis=-1), np.stack([a, c, d], axis=-1)], axis=2).reshape(-1, 3)


def found(points: Floats) -> Shape:
    """The shape of a grid of points (n, m, 3), as single precision holds them, on a part some three metres long."""
    triangles, n = grid(*points.shape[:2]), points[..., 0].size
    far = np.array([[3000.0, 0, 0], [3000, 1, 0], [3000, 0, 1]])
    vertices = np.concatenate([points.reshape(-1, 3), far]).astype(np.float32).astype(float)
    shape = shape_from_triangles(vertices, np.concatenate([triangles, [n + np.arange(3)]]))
    assert shape is not None
    return shape


def shares(shape: Shape) -> dict[str, float]:
    """Share of the area by kind, but for planes."""
    kinds = np.asarray(shape.surfaces["kind"])
    area = np.where(kinds == "plane", 0.0, np.asarray(shape.surfaces["area"]))
    assert area.any()
    return {str(k): float(area[kinds == k].sum() / area.sum()) for k in np.unique(kinds[area > 0])}


def test_a_wall_along_an_ellipse_is_free_form() -> None:
    turn = np.linspace(0, np.pi, 61)
    rim = np.stack([228 * np.cos(turn), 188 * np.sin(turn), 0 * turn], axis=1)
    up = np.array([0, 0, 40])
    assert shares(found(np.stack([1.2 * rim, rim, rim + up, 1.2 * rim + up], axis=1))) == {"facets": pytest.approx(1)}


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


def torus(major: float, minor: float, u: Floats, v: Floats) -> Floats:
    rho = major + minor * np.cos(v)
    return np.stack([rho * np.cos(u), rho * np.sin(u), minor * np.sin(v)], axis=-1)


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
    vertices = torus(major, minor, place[:, 0] / major, place[:, 1] / minor)
    shape = shape_from_triangles(vertices.astype(np.float32).astype(float), triangles)
    assert shape is not None
    at = list(shape.surfaces["kind"]).index("torus")
    assert np.mean(shape.mesh.triangle_surfaces == at) > 0.99
    assert shape.surfaces["radius"][at] == pytest.approx(major, abs=1e-5)
    assert shape.surfaces["radius2"][at] == pytest.approx(minor, abs=1e-5)
    assert "cylinder" not in shape.surfaces["kind"]


def test_a_torus_of_rounded_coordinates_is_a_torus() -> None:
    u, v = np.meshgrid(np.linspace(0, 2 * np.pi, 31), np.linspace(0, 2 * np.pi, 17), indexing="ij")
    shape = shape_from_triangles(np.round(torus(20.0, 6.0, u, v).reshape(-1, 3), 4), grid(31, 17))
    assert shape is not None
    assert list(shape.surfaces["kind"]) == ["torus"]
    assert shape.surfaces["radius2"][0] == pytest.approx(6.0, abs=1e-3)


@pytest.mark.parametrize(("kind", "second"), [(CYLINDER, 0.0), (CONE, 0.4), (SPHERE, 0.0), (TORUS, 3.0)])
def test_surfaces_are_fitted_from_a_start_that_is_off_in_every_number(kind: int, second: float) -> None:
    turn = rotation_matrix(np.array([0.4, -0.7, 0.5]))
    rng, middle = np.random.default_rng(1), np.array([40.0, -30, 20])
    u, v = rng.uniform(0, 2, 80), rng.uniform(-1, 1, 80)
    rho, z = {
        CYLINDER: (np.full(80, 10.0), 8 * v),
        CONE: (10 + 8 * v * np.tan(0.4), 8 * v),
        SPHERE: (10 * np.cos(v), 10 * np.sin(v)),
        TORUS: (10 + 3 * np.cos(3 * v), 3 * np.sin(3 * v)),
    }[kind]
    points = np.stack([rho * np.cos(u), rho * np.sin(u), z], axis=1) @ turn.T + middle
    axis = rotation_matrix(np.array([0.02, 0.03, 0])) @ turn[:, 2]
    begin = np.array([[*(middle + 0.2), *axis, 10.3, second * 1.1]])
    start, none = np.array([0, 80]), np.zeros((0, 3))
    row, away = fit_surfaces(kind, points, start, none, none, np.zeros(2, np.int64), none, begin)
    assert away[0] < 1e-9
    along = (middle - row[0, :3]) @ turn[:, 2]
    assert row[0, 6] + along * np.tan(second * (kind == CONE)) == pytest.approx(10)
    assert row[0, 7] == pytest.approx(second)
    if kind != SPHERE:
        assert row[0, 3:6] == pytest.approx(turn[:, 2])
