"""What lies wholly in a volume, and what is nearest to a way, against trimesh and closed forms."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from scipy.optimize import nnls

from relmodel.app.cli.main import main
from relmodel.errors import UsageError
from relmodel.find.exact_kernels import distances
from relmodel.find.find import in_volumes, nearest_parts
from relmodel.find.volumes import Box, OrientedBox, Sphere, Volume
from relmodel.geometry.transforms import hull_triangles
from relmodel.store import Store
from tests.find.volume_cases import CORNER, FAR, HALF
from tests.poses import pose_of


def test_distances_of_bodies() -> None:
    """Convex bodies, some flat, against the least difference of weighted means of their points, by least squares
    with weights of at least 0 that are drawn to the sum 1: divided by their sum they give the nearest."""
    rng, met = np.random.default_rng(5), 0
    for flat in [False] * 40 + [True] * 10:
        one, other = rng.normal(0, 8, (9, 3)), rng.normal(0, 8, (7, 3)) + rng.uniform(-25, 25, 3)
        one[:, 2] *= not flat
        between = (one[:, None] - other).reshape(-1, 3).T
        weights = nnls(np.vstack([between, np.ones(63)]), [0, 0, 0, 1])[0]
        truth = float(np.linalg.norm(between @ weights) / weights.sum())
        for a, b in ((one, other), (other, one)):
            body, triangles = hull_triangles(a), hull_triangles(b)
            first, element = np.array([0, len(triangles)]), np.zeros(1, np.int64)
            (got,) = distances(body, True, np.eye(4)[None], element, triangles, first, np.array([True]))
            assert abs(got - truth) < 1e-6
        met += truth < 1e-6
    assert 5 < met < 45


def test_distances_of_meshes() -> None:
    """A ring and balls, one far away, in closed form: no hull is taken for the ring, no ball inside it is missed."""
    ring = np.array(trimesh.creation.torus(20, 5, major_sections=64, minor_sections=32).triangles)
    ball = np.array(trimesh.creation.icosphere(subdivisions=3, radius=4).triangles)
    cases = [((0, 0, 0), True, 11.0), ((0, 0, 12), True, np.hypot(20, 12) - 9), ((40, 0, 0), True, 11.0)]
    cases += [((20, 0, 0), True, 0.0), ((20, 0, 0), False, 1.0), ((27, 0, 0), False, 0.0)]  # solid, or a tube
    for at, solid, truth in cases:
        body, first = np.concatenate([ball + 500.0, ball + at]), np.array([0, len(ring)])
        (got,) = distances(body, True, np.eye(4)[None], np.zeros(1, np.int64), ring, first, np.array([solid]))
        assert abs(got - truth) < 0.15  # what flat triangles miss


def by_letter(found: dict[str, Any]) -> dict[str, float]:
    """Distances of parts, in their order."""
    return {str(p).split("/")[0]: float(d) for p, d in zip(found["path"], found["distance_mm"], strict=True)}


def test_nearest_parts(cubes: str, capsys: pytest.CaptureFixture[str]) -> None:
    with Store.open(cubes, read_only=True) as store:
        cases: list[tuple[Any, float, dict[str, float]]] = [
            ([20.0, 0, 0], 0.0, {"a": 20 - HALF, "b": FAR - CORNER - 20}),
            ([20.0, 0, 0], 12.0, {"a": 3.0, "b": FAR - CORNER - 32}),
            ([[50.0, 50, 0], [50, -50, 0]], 0.0, {"b": 50 - CORNER, "a": 50 - HALF}),  # sideways past both
            ([[0.0, 0, 300], [0, 0, -300]], 1.0, {"a": 0.0, "b": FAR - CORNER - 1}),  # right through one
            ([0.0, 0, 5e5], 0.0, {"a": 5e5 - HALF, "b": float(np.hypot(FAR - 0, 5e5 - HALF))}),
        ]
        for path, radius, truth in cases:
            got = by_letter(nearest_parts(store, path, 2, radius=radius))
            assert list(got) == sorted(truth, key=lambda name: truth[name])
            assert all(abs(got[name] - truth[name]) < (1e-6 if max(truth.values()) < 1e4 else 0.02) for name in truth)
        assert list(by_letter(nearest_parts(store, [20.0, 0, 0]))) == ["a"]
        assert list(by_letter(nearest_parts(store, [20.0, 0, 0], 5))) == ["a", "b"]  # no more there are
        bad: list[tuple[Any, int]] = [([0.0, 0, 0], 0), ([], 1), ([np.nan, 0, 0], 1)]
        for path, count in bad:
            with pytest.raises(UsageError, match="nearest needs"):
                nearest_parts(store, path, count)
    command = ["find", "--store", cubes, "--format", "json", "--count", "1", "--near-to", "20", "0", "0"]
    assert main(command) == 0
    (row,) = json.loads(capsys.readouterr().out)
    assert abs(row["distance_mm"] - 15) < 1e-6
    assert main(command[:-1]) == 2


one_engine = pytest.mark.parametrize("cubes", ["duckdb"], indirect=True)  # of what is read in one way


@one_engine
def test_nearest_to_a_part(cubes: str, capsys: pytest.CaptureFixture[str]) -> None:
    with Store.open(cubes, read_only=True) as store:
        paths = sorted(in_volumes(store, [Box(-50, -50, -50, 150, 50, 50)])["path"].astype(str).tolist())
        for path, other in (paths, paths[::-1]):
            found = nearest_parts(store, path, 1)
            assert found["path"].tolist() == [other]  # not itself
            assert abs(found["distance_mm"][0] - (FAR - HALF - CORNER)) < 1e-6
        with pytest.raises(UsageError, match="there is no part 'a/none'"):
            nearest_parts(store, "a/none")
    command = ["find", "--store", cubes, "--format", "json", "--near-to-part", paths[0]]
    assert main(command) == 0
    (row,) = json.loads(capsys.readouterr().out)
    assert row["path"] == paths[1]
    assert abs(row["distance_mm"] - (FAR - HALF - CORNER)) < 1e-6
    assert main([*command, "--radius", "3"]) == 2


@one_engine
def test_clearance_of_a_tool(cubes: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A box tool of 4 x 6 x 8 mm that goes past the cubes, through one, round one, and stands."""
    tool = np.array([[x, y, z] for x in (-2, 2) for y in (-3, 3) for z in (-4, 4)], float)
    slanted = (60 - 2 - 3) / 2**0.5 - HALF * 2**0.5  # from a's edge to the side of the sweep along x = 60 - y
    cases: list[tuple[Any, Any, float, dict[str, float]]] = [
        ([20.0, 0, 0], tool, 0.0, {"a": 20 - 2 - HALF, "b": FAR - CORNER - 22}),
        ([[20.0, -90, 0], [20, 90, 0]], tool, 1.5, {"a": 20 - 2 - HALF - 1.5, "b": FAR - CORNER - 23.5}),
        ([[-40.0, 0, 30], [140, 0, 30]], tool, 0.0, {"a": 30 - 4 - HALF, "b": 30 - 4 - HALF}),
        ([[-40.0, 0, 0], [40, 0, 0]], tool, 0.0, {"a": 0.0, "b": FAR - CORNER - 42}),
        ([0.0, 0, 0], tool / 10, 0.0, {"a": 0.0, "b": FAR - CORNER - 0.2}),  # stands inside
        ([0.0, 0, 0], tool * 5, 0.0, {"a": 0.0, "b": FAR - CORNER - 10}),  # holds all of it
        ([[-60.0, 120, 0], [120, -60, 0]], tool, 0.0, {"a": slanted, "b": (FAR - 65) / 2**0.5 - HALF}),
        ([[30.0, 0, 0], [30, 40, 0], [-30, 40, 0]], tool, 0.0, {"a": 30 - 2 - HALF, "b": FAR - CORNER - 32}),
        (
            [[0.0, 0, 20], [0, 0, 15]],
            tool * [1, 1, 0],
            0.0,
            {"a": 15 - HALF, "b": float(np.hypot(FAR - CORNER - 2, 10))},
        ),
        ([[0.0, 0, 20], [9, 0, 20]], tool * [1, 1, 0], 0.0, {"a": 15.0}),  # a flat tool along itself: flat
    ]
    with Store.open(cubes, read_only=True) as store:
        for path, points, radius, truth in cases:
            got = by_letter(nearest_parts(store, path, 2, radius=radius, tool=points))
            assert set(got) == {"a", "b"}
            for name, away in truth.items():
                assert abs(got[name] - away) < 1e-6, (path, name, got)
        with pytest.raises(UsageError, match="a tool's points"):
            nearest_parts(store, [0, 0, 0], tool=[])
    file = tmp_path / "tool.yaml"
    file.write_text(f"points: {tool.tolist()}")
    command = ["find", "--store", cubes, "--format", "json", "--near-to", "20", "0", "0", "--tool", str(file)]
    assert main(command) == 0
    assert abs(json.loads(capsys.readouterr().out)[0]["distance_mm"] - 13) < 1e-6
    file.write_text("points: [[1, 2], [3, 4]]")
    assert main(command) == 3


@one_engine
def test_wholly_inside(cubes: str) -> None:
    pose = pose_of((FAR, 0, 0), [0, 0, np.pi / 4])
    cases: list[tuple[Volume, str, str]] = [  # by box, and by triangles
        (Box(-6, -6, -6, 6, 6, 6), "a", "a"),
        (Box(-5, -5, -5, 5, 5, 5), "a", "a"),
        (Box(-5, -5, -5, 5, 5, 4.99), "", ""),
        (Box(-10, -10, -10, 200, 10, 10), "ab", "ab"),
        (Sphere(0, 0, 0, HALF * 3**0.5 + 1e-6), "a", "a"),
        (Sphere(0, 0, 0, HALF * 3**0.5 - 1e-3), "", ""),
        (OrientedBox(pose, np.full(3, HALF + 1e-6)), "b", "b"),  # turned as the cube is, and just as large
        (OrientedBox(pose, np.full(3, HALF - 1e-3)), "", ""),
    ]
    with Store.open(cubes, read_only=True) as store:
        for precision, place in (("box", 1), ("exact", 2)):
            found = in_volumes(store, [case[0] for case in cases], precision=precision, wholly=True)
            for number, case in enumerate(cases):
                names = [str(path).split("/")[0] for path in found["path"][found["volume_no"] == number]]
                assert "".join(sorted(names)) == case[place], case
