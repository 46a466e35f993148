"""What lies wholly in a volume, and what is nearest to a way, against trimesh and closed forms."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from relmodel.app.cli.main import main
from relmodel.arrays import Floats
from relmodel.errors import UsageError
from relmodel.find.exact_kernels import distances
from relmodel.find.find import in_volumes, nearest_parts
from relmodel.find.volumes import Box, OrientedBox, Sphere, Volume
from relmodel.geometry.transforms import rotation_matrix
from relmodel.store import Store
from tests.find.volume_cases import CORNER, FAR, HALF, fill


def poses_of(rng: np.random.Generator, count: int) -> Floats:
    poses = np.tile(np.eye(4), (count, 1, 1))
    poses[:, :3, :3] = [rotation_matrix(turn) for turn in rng.uniform(-2, 2, (count, 3))]
    poses[:, :3, 3] = rng.uniform(-30, 30, (count, 3))
    return poses


def test_distances_of_placed_boxes() -> None:
    """Points along a way against the closed form of a box: never less, and as near as they are dense."""
    rng = np.random.default_rng(3)
    within = 0
    for pose in poses_of(rng, 60):
        half = rng.uniform(1, 12, 3)
        triangles = np.array(trimesh.creation.box(2 * half).triangles)
        first, solid = np.array([0, len(triangles)]), np.array([True])
        path = rng.uniform(-25, 25, (int(rng.integers(1, 4)), 3)) + pose[:3, 3]
        (got,) = distances(path, pose[None], np.zeros(1, np.int64), triangles, first, solid)
        along = np.linspace(0, len(path) - 1, 2000 * (len(path) - 1) + 1)
        points = np.stack([np.interp(along, np.arange(len(path)), path[:, i]) for i in range(3)], axis=1)
        local = (points - pose[:3, 3]) @ pose[:3, :3]
        least = float(np.linalg.norm(np.maximum(np.abs(local) - half, 0), axis=1).min())
        apart = float(np.linalg.norm(np.diff(points, axis=0), axis=1).max(initial=0.0))
        assert least - apart / 2 - 1e-6 <= got <= least + 1e-6
        within += got == 0
    assert 5 < within < 55


@pytest.fixture
def cubes(fresh_store: str, tmp_path: Path) -> str:
    with Store.open(fresh_store) as store:
        fill(store, tmp_path)
    return fresh_store


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
            found = nearest_parts(store, path, 5, radius=radius)
            got = {str(p).split("/")[0]: float(d) for p, d in zip(found["path"], found["distance_mm"], strict=True)}
            assert list(got) == sorted(truth, key=lambda name: truth[name])
            assert all(abs(got[name] - truth[name]) < (1e-6 if max(truth.values()) < 1e4 else 0.02) for name in truth)
            assert len(nearest_parts(store, path, radius=radius)["path"]) == 1
        bad: list[tuple[Any, int]] = [([0.0, 0, 0], 0), ([], 1), ([np.nan, 0, 0], 1)]
        for path, count in bad:
            with pytest.raises(UsageError, match="nearest needs"):
                nearest_parts(store, path, count)
    command = ["find", "--store", cubes, "--format", "json", "--count", "1", "--near-to", "20", "0", "0"]
    assert main(command) == 0
    (row,) = json.loads(capsys.readouterr().out)
    assert abs(row["distance_mm"] - 15) < 1e-6
    assert main(command[:-1]) == 2


def test_wholly_inside(cubes: str) -> None:
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = rotation_matrix(np.array([0, 0, np.pi / 4])), (FAR, 0, 0)
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
