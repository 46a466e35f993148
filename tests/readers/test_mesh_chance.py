"""Surfaces that few vertices of a mesh seem to tell: arcs with a point or two beside them, few rulings, narrow ones."""

from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from scipy.spatial import Delaunay

from relmodel.model.model import Shape
from relmodel.readers.mesh.doubts import turn
from relmodel.readers.mesh.patches import cut_patches
from relmodel.readers.mesh.pieces import united
from relmodel.readers.mesh.shape import shape_from_triangles
from relmodel.readers.mesh.triangles import find_edges
from relmodel.readers.step import shape as step_shape
from relmodel.readers.step.read import read_step
from tests.parts import splined_parts
from tests.parts.tessellations import meshed_by_kernel

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]


def grid(rows: int, columns: int) -> Ints:
    """Triangles of a grid of vertices."""
    at = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:]
    return np.stack([np.stack([a, b, c], axis=-1), np.stack([a, c, d], axis=-1)], axis=2).reshape(-1, 3)


def torus(major: float, minor: float, u: Floats, v: Floats) -> Floats:
    u, v = np.meshgrid(u, v, indexing="ij")
    rho = major + minor * np.cos(v)
    return np.stack([rho * np.cos(u), rho * np.sin(u), minor * np.sin(v)], axis=-1).reshape(-1, 3)


def assert_no_other_cylinders(exact: Shape, decimals: int) -> None:
    """The mesh of a shape, as STL has it, gives cylinders of the shape's radii."""
    mesh = shape_from_triangles(
        exact.mesh.vertices.astype(np.float32).astype(float), exact.mesh.triangles.astype(np.int64)
    )
    assert mesh is not None
    true, fitted = (
        np.asarray(s.surfaces["radius"], float)[np.asarray(s.surfaces["recognised_kind"]) == "cylinder"]
        for s in (exact, mesh)
    )
    assert set(np.round(fitted, decimals)) == set(np.round(true, decimals))


# Of splined parts: fans about a point beside the rim of a blend, an extrusion of few and uneven strips, a folded tube.
@pytest.mark.parametrize(
    ("seed", "chord", "angle"),
    [(305, 0.5, 0.2), (1211, 1.0, 0.5), (1133, 0.08, 0.3), (1008, 0.4, 0.6), (2037, 1.0, 0.5)],
)
def test_no_cylinder_is_found_that_the_part_has_not(seed: int, chord: float, angle: float) -> None:
    with meshed_by_kernel(chord, angle):
        exact = step_shape.extract(splined_parts.generate(seed), {}, {}, {})
    assert_no_other_cylinders(exact, 1)


@pytest.mark.data
@pytest.mark.parametrize(("chord", "angle"), [(0.02, 0.1), (0.01, 0.12), (0.012, 0.2)])
def test_a_thread_runs_out_in_no_cylinders(data_dir: Path, chord: float, angle: float) -> None:
    """Strips of a flank's corner and of the crest are narrower than long, and lie on cylinders by chance; so do those
    at the ends of the head's rim, a torus that the kernel cuts into uneven triangles."""
    with meshed_by_kernel(chord, angle):
        (exact,) = read_step(data_dir / "step" / "M6-1x12-countersunk-screw.step").shapes
    assert_no_other_cylinders(exact, 2)


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


def test_a_torus_takes_its_strip_that_stands_off_more_than_most() -> None:
    s = np.linspace(0, 1, 41)
    u, v = np.linspace(0, 0.5, 11), np.radians(90 * s**3 - 90)  # from the bottom, where it is straight around, out
    vertices, triangles = torus(35.0, 5.0, u, v), grid(len(u), len(v))
    edges, _ = find_edges(vertices, triangles)
    patches = cut_patches(vertices, triangles, edges, 1e-3)
    outer = np.zeros(len(patches.area), np.int64)
    end = (np.hypot(*vertices[:, :2].T) > 39.9) & (np.arctan2(vertices[:, 1], vertices[:, 0]) > 0.29)
    outer[patches.of_triangle[np.all(end[triangles], axis=1)]] = 1
    assert 0 < outer.sum() < len(outer) / 10
    middle = vertices[triangles].mean(axis=1)
    away = np.abs(np.hypot(np.hypot(*middle[:, :2].T) - 35.0, middle[:, 2]) - 5.0)
    row = np.array([[0, 0, 0, 0, 0, 1, 35, 5, np.cos(5), np.sin(5)], [0, 0, 0, 0, 0, 1, 40, 0, 1, 0]], float)
    gap = np.array([away[outer[patches.of_triangle] == k].mean() for k in (0, 1)])
    assert gap[1] > 2 * gap[0]
    assert not united(vertices, triangles, patches, outer, np.array([4, 1]), row, gap, 3e-3).any()


def test_a_torus_in_uneven_triangles_is_a_torus() -> None:
    """No few facets tell of its axis, but all do."""
    rng = np.random.default_rng(0)
    major, minor = 5.0, 0.2
    reach = np.array([2.8 * major, 2.3 * minor])  # around, and around the tube, mm
    around, tube = (np.linspace(0, length, int(length / 0.04)) for length in reach)
    rim = [np.stack([x, np.full_like(x, y)], axis=1) for x, y in ((around, 0.0), (around, reach[1]))]
    rim += [np.stack([np.full_like(y, x), y], axis=1) for x, y in ((0.0, tube), (reach[0], tube))]
    place = np.unique(np.concatenate([*rim, rng.uniform(0, reach, (1500, 2))]), axis=0)
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


@pytest.mark.parametrize("decimals", [4, 5])
def test_a_torus_of_rounded_coordinates_is_a_torus(decimals: int) -> None:
    u, v = np.linspace(0, 2 * np.pi, 61), np.linspace(0, 2 * np.pi, 31)
    shape = shape_from_triangles(np.round(torus(20.0, 6.0, u, v), decimals), grid(len(u), len(v)))
    assert shape is not None
    assert list(shape.surfaces["kind"]) == ["torus"]
    assert shape.surfaces["radius2"][0] == pytest.approx(6.0, abs=1e-3)


def test_nothing_turns_where_no_triangle_has_an_owner() -> None:
    triangle = np.arange(3)[None]
    found = turn(np.eye(3), triangle, np.array([-1]), np.array([1]), np.ones((1, 10)))
    assert found.tolist() == [0.0]
