"""The width of a pocket by its walls, against where they were put."""

from __future__ import annotations

import numpy as np
import pytest

from vision.presence.items import Items
from vision.presence.measures import measure_items
from vision.presence.presence_parameters import StateParameters
from vision.presence.surfaces import Surfaces


def test_a_pocket_is_as_wide_as_its_walls_stand_apart() -> None:
    """A pocket of 40 by 30 mm: walls 0 and 1 face each other along x, 2 and 3 along y; the floor, 4, faces none, and
    wall 3 was not measured.  Wall 0 has moved into the pocket by .5 mm, wall 1 out of it by 2."""
    middle = np.array([[0.0, 15, 5], [40, 10, 5], [20, 0, 5], [20, 30, 5], [20, 15, 0]])
    normal = np.array([[1.0, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1]])
    mm = np.array([0.5, -2.0, 0.1, np.nan, 0.2])
    sigma = np.where(np.isnan(mm), np.nan, [0.3, 0.4, 0.1, 0.1, 0.1])
    none, nan = np.zeros(5, bool), np.full(5, np.nan)
    surfaces = Surfaces(none, np.zeros(5), mm, sigma, np.full((5, 3), np.nan), nan, none, middle, normal, np.ones(5))
    items = Items(
        ["feature"], np.zeros(1, np.int64), np.zeros(1, np.int64), np.full(1, -1), ["part/pocket 1"], ["pocket"],
        np.ones(1), np.full(1, np.nan), np.zeros(5, np.int64), np.arange(5), none,
    )  # fmt: skip
    found = measure_items(items, nan, surfaces, StateParameters())
    (row,) = [k for k, what in enumerate(found.what) if what == "width"]
    assert found.nominal[row] == pytest.approx(40.0)
    assert found.value[row] == pytest.approx(41.5)
    assert found.sigma[row] == pytest.approx(0.5)
    assert not found.changed[row]
