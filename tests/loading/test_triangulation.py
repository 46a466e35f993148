"""Triangles of faces, by closed forms and by the kernel's mesher: against exact geometry and against each other."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from relmodel.loading.brep.measures import surfaces_of
from relmodel.loading.neutral import Mesh, Shape
from relmodel.loading.step import shape as step_shape

from .step_parts import loaded
from .workshop import workshop


def composed(seed: int) -> Shape:
    return step_shape.extract(workshop(seed).body, {}, {}, {})


def is_closed(mesh: Mesh) -> bool:
    """Whether each side of a triangle is one of another triangle, run the other way."""
    # Vertices of faces are apart: those at one place are one.
    pairs = cKDTree(mesh.vertices).query_pairs(1e-4, output_type="ndarray")
    count = len(mesh.vertices)
    joined = coo_array((np.ones(len(pairs)), pairs.T), shape=(count, count))
    corner = connected_components(joined, directed=False)[1][mesh.triangles].astype(np.int64)
    corner = corner[(corner != np.roll(corner, 1, axis=1)).all(axis=1)]
    sides = np.stack([corner, np.roll(corner, -1, axis=1)], axis=2).reshape(-1, 2)
    there, back = sides[:, 0] * count + sides[:, 1], sides[:, 1] * count + sides[:, 0]
    return np.array_equal(np.sort(there), np.sort(back))


@pytest.mark.parametrize("seed", range(12))
def test_triangles_of_a_composed_part_meet_and_keep_to_its_surfaces(seed: int) -> None:
    shape = composed(seed)
    mesh, surfaces = shape.mesh, surfaces_of(shape)
    assert is_closed(mesh)
    corner, row = mesh.vertices[mesh.triangles], mesh.triangle_surfaces.astype(np.int64)
    twice = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    assert shape.volume is not None
    assert np.einsum("nd,nd->n", corner[:, 0], twice).sum() / 6 == pytest.approx(shape.volume, rel=0.01)
    area = np.bincount(row, np.linalg.norm(twice, axis=1) / 2, len(surfaces))
    assert area == pytest.approx(shape.surfaces["area"], rel=0.02)
    # The middle of each side is the farthest from a surface that is round one way.
    ruled = np.isin(surfaces.kind.astype(str), ("plane", "cylinder", "cone"))[row]
    middle = (corner + np.roll(corner, -1, axis=1))[ruled].reshape(-1, 3) / 2
    which = np.repeat(row[ruled], 3)
    feet = surfaces.evaluate(which, *surfaces.parameters(which, middle)).points
    assert np.linalg.norm(feet - middle, axis=1).max() <= mesh.chord_mm


@pytest.mark.data
@pytest.mark.parametrize(
    "name", ["step/nist_ctc_01_asme1_ap242.stp", "step/featuretype.STEP", "bulkhead/A/bulkhead_parts.step"]
)
def test_triangles_of_a_file_meet(data_dir: Path, name: str) -> None:
    assert is_closed(loaded(data_dir / name).shapes[0].mesh)
