"""Free-form surfaces of meshes are no chains of cylinders, and cylinders of inexact borders no free-form surfaces."""

import numpy as np
import numpy.typing as npt
import pytest

from relmodel.model.model import Shape
from relmodel.readers.mesh.chains import chain_edges, without_lines
from relmodel.readers.mesh.shape import shape_from_triangles
from tests.parts import splined_parts
from tests.parts.tessellations import extracted

Floats = npt.NDArray[np.float64]


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


@pytest.mark.parametrize("strips", [30, 60, 120])
def test_a_tube_along_a_curve_of_steadily_changing_bend_is_free_form(strips: int) -> None:
    s = np.linspace(0, 150, strips + 1)
    heading = 0.004 * s + 0.00004 * s * s  # a clothoid: radii from 250 to 62 mm
    step = np.diff(s, prepend=0.0)
    path = np.stack([np.cumsum(step * np.cos(heading)), np.cumsum(step * np.sin(heading)), 0 * s], axis=1)
    side = np.stack([-np.sin(heading), np.cos(heading), 0 * s], axis=1)
    turn = np.linspace(0, np.pi / 2, strips // 3 + 1)
    tube = path[:, None] + 10 * (np.cos(turn)[:, None] * side[:, None] + np.sin(turn)[:, None] * np.array([0.0, 0, 1]))
    edge, top = tube[:, :1] + 20 * side[:, None], tube[:, -1:] - 20 * side[:, None]
    by_kind = shares(found(np.concatenate([edge, tube, top], axis=1)))
    assert by_kind["facets"] > 0.99
    assert by_kind.get("cylinder", 0.0) == 0.0


@pytest.mark.parametrize("strips", [60, 120, 300])
def test_a_wall_along_an_ellipse_is_free_form(strips: int) -> None:
    turn = np.linspace(0, np.pi, strips + 1)
    rim = np.stack([228 * np.cos(turn), 188 * np.sin(turn), 0 * turn], axis=1)
    up = np.array([0, 0, 40])
    assert shares(found(np.stack([1.2 * rim, rim, rim + up, 1.2 * rim + up], axis=1))) == {"facets": pytest.approx(1)}


@pytest.mark.parametrize("seed", [6, 102])
def test_parts_of_splines_have_no_cylinders_but_their_own(seed: int) -> None:
    exact = extracted(splined_parts.generate(seed))
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


def test_a_strip_of_drifting_radius_between_sharp_sides_is_free_form() -> None:
    """As the crest of a thread that runs out: a spiral, each few degrees of which lie on a cylinder within the
    tolerance."""
    turn = np.linspace(0, 2.5, 61)
    radius = 3 + 0.3 * (turn / 2.5) ** 2
    rim = np.stack([radius * np.cos(turn), radius * np.sin(turn), 0 * turn], axis=1)
    up, out = np.array([0, 0, 0.2]), np.array([0.7, 0.7, 1.0])
    by_kind = shares(found(np.stack([0.8 * rim - up, rim, rim + up, 0.8 * (rim + up) + up * out], axis=1)))
    assert by_kind.get("cylinder", 0.0) == 0.0


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
