"""Exact precision: the kernel against linear programs and trimesh, the store against a plate known in closed form."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import pytest
import trimesh
from scipy.optimize import linprog

from relmodel.find.exact_kernels import meet_volumes
from relmodel.find.find import LEVELS, in_volumes, nearest_parts
from relmodel.find.volumes import Box, Frustum, OrientedBox, Sphere, Volume, VolumeTable
from relmodel.store import Store
from relmodel.world import place_world
from tests.parts.solids import Part, box, cylinder
from tests.parts.step_parts import write_solids
from tests.poses import pose_of
from tests.reading import load
from tests.synthetic_model import write_world


def random_volumes(rng: np.random.Generator, count: int) -> list[Volume]:
    volumes: list[Volume] = []
    for number in range(count):
        pose = pose_of(turn=rng.uniform(-2, 2, 3), shift=rng.uniform(-10, 10, 3))
        half = 10 ** rng.uniform(-0.5, 1, 3)
        if number % 3 == 0:
            volumes.append(Box(*(pose[:3, 3] - half), *(pose[:3, 3] + half)))
        elif number % 3 == 1:
            volumes.append(OrientedBox(pose, half * (rng.random(3) > 0.1)))
        else:
            matrix = np.array([[100.0, 0, 50], [0, 100, 40], [0, 0, 1]])
            volumes.append(Frustum(100, 80, matrix, pose, 1.0, 15.0))
    return volumes


def met_by_kernel(volumes: list[Volume], triangles: np.ndarray, poses: np.ndarray, wholly: bool = False) -> np.ndarray:
    """Triangle i, placed by transform i, against volume i."""
    table, number = VolumeTable.of(volumes), np.arange(len(volumes))
    inner = np.array([v.inner_point for v in volumes])
    first, solid = np.arange(len(triangles) + 1), np.zeros(len(triangles), bool)
    placed = table.half_spaces, table.start, table.balls, inner, number, poses, number, triangles
    found = meet_volumes(*placed, first, solid, np.zeros(len(triangles)), wholly)
    return np.asarray(found)


def random_triangles(rng: np.random.Generator, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Triangles (n, 3, 3), some of them segments or points, their transforms, and the corners in the world."""
    triangles = rng.uniform(-12, 12, (count, 1, 3)) + rng.normal(0, 6, (count, 3, 3))
    triangles[::7, 2] = triangles[::7, 1]
    triangles[::21, 1] = triangles[::21, 2] = triangles[::21, 0]
    transforms = np.array([pose_of(turn=rng.uniform(-2, 2, 3), shift=rng.uniform(-5, 5, 3)) for _ in range(count)])
    corners = np.einsum("nij,nkj->nki", transforms[:, :3, :3], triangles) + transforms[:, None, :3, 3]
    return triangles, transforms, corners


def test_triangles_against_linear_programs() -> None:
    """A triangle meets a polyhedron if weights of its corners exist that lie in all half-spaces."""
    rng = np.random.default_rng(0)
    volumes = random_volumes(rng, 150)
    triangles, transforms, corners = random_triangles(rng, len(volumes))
    found = met_by_kernel(volumes, triangles, transforms)
    for volume, corner, met in zip(volumes, corners, found.tolist(), strict=True):
        n, d = volume.half_spaces[:, :3], volume.half_spaces[:, 3]
        # The least slack that all half-spaces need: at or below zero where the triangle meets the volume.
        bounds, apart = [(0, 1)] * 3 + [(None, None)], np.column_stack([n @ corner.T, -np.ones(len(n))])
        solved = linprog([0, 0, 0, 1], apart, d, [[1, 1, 1, 0]], [1], bounds)
        slack = float(np.asarray(solved.x)[3])
        assert abs(slack) < 1e-5 or met == (slack < 0)
    assert 10 < found.sum() < 120


def test_triangles_against_balls() -> None:
    rng = np.random.default_rng(1)
    triangles, transforms, corners = random_triangles(rng, 700)
    placed = np.column_stack([rng.uniform(-10, 10, (700, 3)), 10 ** rng.uniform(0, 1.2, 700)])
    spheres = [Sphere(*row) for row in placed.tolist()]
    found = met_by_kernel(list(spheres), triangles, transforms)
    centre = placed[:, :3]
    proper = np.ones(len(triangles), bool)
    proper[::7] = False
    nearest = np.empty_like(centre)
    nearest[proper] = trimesh.triangles.closest_point(corners[proper], centre[proper])
    share = np.linspace(0, 1, 2001)[:, None]  # along segments, densely
    for i in np.flatnonzero(~proper):
        along = corners[i, 0] * (1 - share) + corners[i, 1] * share
        nearest[i] = along[np.argmin(np.linalg.norm(along - centre[i], axis=1))]
    beyond = np.linalg.norm(nearest - centre, axis=1) - placed[:, 3]
    clear = np.abs(beyond) > 1e-2
    assert np.array_equal(found[clear], beyond[clear] < 0)
    assert 70 < found.sum() < 630


@pytest.fixture(scope="module", params=["duckdb", "postgresql"])
def plate(
    request: pytest.FixtureRequest, new_store: Callable[[str], str], tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Store]:
    """A plate [0, 100] x [0, 60] x [0, 20] with a hole of radius 10 through (50, 30), turned by 90 degrees about z and
    moved by (1000, 0, 0): (x, y, z) of the plate is (1000 - y, x, z) of the world."""
    folder = tmp_path_factory.mktemp("exact")
    body = Part(box((0, 0, 0), (100, 60, 20)))
    body.cut(cylinder((50, 30, -1), 10, 22))
    write_solids(folder / "plate.step", body.body)
    turned = [[0, -1, 0, 1000], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
    with Store.open(new_store(request.param)) as store:
        load(store, folder / "plate.step", name="plate")
        placed: list[dict[str, object]] = [{"object": "plate", "world_from_object": turned}]
        place_world(store, write_world(folder / "world.yaml", "cell", placed))
        yield store


def counts(store: Store, volumes: list[Volume], precision: str) -> list[list[int]]:
    """How many parts, features, surfaces and arcs are in each volume."""
    found = [in_volumes(store, volumes, level=level, precision=precision)["volume_no"] for level in LEVELS]
    return [[int((numbers == i).sum()) for numbers in found] for i in range(len(volumes))]


def at(x: float, y: float, z: float) -> tuple[float, float, float]:
    return 1000 - y, x, z


def test_in_the_hole_in_the_material_and_at_faces(plate: Store) -> None:
    """A ball that floats in the hole meets nothing, though it is in the boxes of the part, the hole and the rest; what
    is wholly inside the material meets the part, but no surface and no arc."""
    thin = OrientedBox(np.array([[1.0, 0, 0, 970], [0, 1, 0, 50], [0, 0, 1, 10], [0, 0, 0, 1]]), np.array([5, 5, 50]))
    cases: list[tuple[Volume, list[int]]] = [
        (Sphere(*at(50, 30, 10), 9), [0, 0, 0, 0]),
        (Sphere(*at(50, 34, 10), 7), [1, 1, 1, 0]),
        (thin, [0, 0, 0, 0]),
        (Box(*at(19, 11, 9), *at(21, 9, 11)), [1, 0, 0, 0]),
        (Sphere(*at(20, 10, 10), 2), [1, 0, 0, 0]),
        (Box(*at(-1, 1, -1), *at(1, -1, 1)), [1, 1, 3, 3]),  # a corner, of the body
        (Box(*at(10, 20, 20), *at(20, 10, 20)), [1, 1, 1, 0]),  # lies in the top face
        (Box(*at(10, 20, 20.05), *at(20, 10, 30)), [0, 0, 0, 0]),  # above, by more than triangles deviate
        (Sphere(*at(60, 30, 20), 0.5), [1, 2, 2, 2]),  # on the rim, where the seam of the wall begins
    ]
    assert counts(plate, [volume for volume, _ in cases], "exact") == [wanted for _, wanted in cases]
    assert counts(plate, [cases[0][0]], "box")[0][:2] == [1, 2]


one_engine = pytest.mark.parametrize("plate", ["duckdb"], indirect=True)  # for what the rows read do not decide


@one_engine
def test_never_more_than_by_box_and_never_less_than_samples(plate: Store) -> None:
    """Points sampled on the plate: whatever holds one meets the part; what is 0.1 mm and more off it does not."""
    rng = np.random.default_rng(5)
    points = rng.uniform([-10, -10, -10], [110, 70, 30], (300, 3))
    radius = rng.uniform(0.5, 12, 300)
    spheres = [Sphere(*at(*point), float(r)) for point, r in zip(points.tolist(), radius, strict=True)]
    outside = np.linalg.norm(np.maximum(np.maximum(-points, points - [100, 60, 20]), 0), axis=1)
    to_axis = np.linalg.norm(points[:, :2] - [50, 30], axis=1)
    # Distance from the plate: from the box, but over and in the hole from its wall or its rim.
    over = np.maximum(np.maximum(-points[:, 2], points[:, 2] - 20), 0)
    distance = np.where(to_axis < 10, np.hypot(10 - to_axis, over), outside)
    clear = np.abs(distance - radius) > 0.1
    for level in ("part", "arc"):
        by_box = in_volumes(plate, list(spheres), level=level)
        exact = in_volumes(plate, list(spheres), level=level, precision="exact")
        keys = [set(zip(a["volume_no"].tolist(), a["element_no"].tolist(), strict=True)) for a in (exact, by_box)]
        assert keys[0] < keys[1]
        if level == "part":
            met = np.isin(np.arange(300), exact["volume_no"])
            assert np.array_equal(met[clear], distance[clear] <= radius[clear])


@one_engine
def test_nothing_that_touches_the_exact_geometry_is_missed(plate: Store) -> None:
    """Balls of a thousandth about points of the hole's wall, most of them between the vertices of its triangles."""
    angle = np.linspace(0, 2 * np.pi, 100, endpoint=False)
    wall = np.column_stack([50 + 10 * np.cos(angle), 30 + 10 * np.sin(angle)])
    balls = [Sphere(*at(x, y, z), 1e-3) for z in (20.0, 7.3) for x, y in wall.tolist()]
    for level in LEVELS:
        found = in_volumes(plate, list(balls), level=level, precision="exact")
        assert set(found["volume_no"].tolist()) == set(range(101 if level == "arc" else 200)), level  # rim, and seam


@one_engine
def test_the_nearest_is_a_wall(plate: Store) -> None:
    """Of a hole not the box about it, in which the point is; of features, which are not solid, also from within."""
    for place, level in (((50, 30, 10), "part"), ((50, 30, 10), "feature"), ((20, 10, 10), "feature")):
        assert abs(nearest_parts(plate, at(*place), level=level)["distance_mm"][0] - 10) < 0.1
