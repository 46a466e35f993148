"""Distances between bores that lie where they were put, tilted in the world."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from relmodel.arrays import Floats
from relmodel.geometry.transforms import rotation_matrix
from vision.presence.displaced import Measures
from vision.presence.items import Items
from vision.presence.presence_parameters import DistanceParameters
from vision.presence.states import measure_distances
from vision.presence.surfaces import SceneSurfaces
from vision.scene import Scene

CENTRES = np.array([[0.0, 0, 0], [100.0, 0, 0], [100.0, 60, 4], [400.0, 0, 0], [50.0, 20, 80]])
RADIUS = 12.0
TILT = rotation_matrix(np.array([[0.4, -0.3, 1.1]]))[0]


def measured(shift: Floats, sigma: Floats) -> Measures:
    """Bores of which two thirds are there, of each others, 10 deep and the fourth 70, all with middles equally deep but
    the last, each aside by a shift (n, 3) of the part's frame."""
    depth = np.array([10.0, 10, 10, 70, 10])
    angle = np.linspace(0, 4 * np.pi / 3, 24) + 1.3 * np.arange(len(CENTRES))[:, None]
    around = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=2)
    ends = depth[:, None, None] * np.array([-0.5, 0.5])[:, None] * [0, 0, 1.0]
    ring = CENTRES[:, None, None] + RADIUS * around[:, None] + ends[:, :, None]
    strip = np.array([[k, k + 1, k + 24] for k in range(23)] + [[k + 1, k + 25, k + 24] for k in range(23)])
    count = len(CENTRES)
    scene = SimpleNamespace(
        vertices=ring.reshape(-1, 3) @ TILT.T,
        vertex_normals=-np.repeat(around[:, None], 2, axis=1).reshape(-1, 3) @ TILT.T,
        triangles=np.concatenate([strip + 48 * k for k in range(count)]),
        triangle_surface=np.repeat(np.arange(count), len(strip)),
    )
    items = SimpleNamespace(
        level=["part", *["feature"] * count],
        occurrence=np.zeros(count + 1, np.int64),
        member=np.arange(1, count + 1),
        surface=np.arange(count),
        inset=np.ones(count, bool),
    )
    surfaces = SimpleNamespace(shift=shift @ TILT.T, shift_sigma=sigma, mm=np.where(np.isnan(sigma), np.nan, 0.0))
    parts = (cast(Items, items), cast(Scene, scene), np.full(count, RADIUS), cast(SceneSurfaces, surfaces))
    return measure_distances(*parts, DistanceParameters())


def between(found: Measures, a: int, b: int) -> int:
    (row,) = np.flatnonzero((found.item == a + 1) & (found.other == b + 1))
    return int(row)


def test_distances_are_those_of_the_axes_where_they_were_found() -> None:
    shift = np.array([[0.3, 0, 0], [-2.0, 0, 0], [0.0, 3, 0], [0.0, 0, 0], [0.0, 0, 0]])
    found = measured(shift, np.array([0.1, 0.2, 0.3, 0.1, 0.1]))
    for a, b in ((0, 1), (1, 2), (0, 2)):
        row = between(found, a, b)
        assert found.nominal[row] == pytest.approx(np.linalg.norm((CENTRES[b] - CENTRES[a])[:2]), abs=1e-6)
        away = (CENTRES + shift)[b] - (CENTRES + shift)[a]
        assert found.value[row] == pytest.approx(np.linalg.norm(away[:2]), abs=1e-6)
    assert found.sigma[between(found, 0, 1)] == pytest.approx(np.hypot(0.1, 0.2))
    assert found.changed[between(found, 0, 1)]
    assert not found.changed[between(found, 0, 3)]


def test_what_shifts_all_alike_is_the_pose_and_changes_nothing() -> None:
    found = measured(np.tile([3.0, -1.0, 0.0], (5, 1)), np.full(5, 0.1))
    np.testing.assert_allclose(found.value, found.nominal, atol=1e-6)
    assert not found.changed.any()


def test_other_levels_and_what_was_not_measured_are_left_out() -> None:
    found = measured(np.zeros((5, 3)), np.array([0.1, np.nan, 0.1, 0.1, 0.1]))
    assert set(found.item.tolist()) | set(found.other.tolist()) == {1, 3, 4}
