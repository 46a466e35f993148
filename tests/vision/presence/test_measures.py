"""Widths of pockets and thicknesses of ribs by their faces, against where these were put, and which are others."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from relmodel.arrays import Bools, Floats
from vision.presence.displaced import Measures, find_moved, measure_items
from vision.presence.items import Items
from vision.presence.presence_parameters import StateParameters
from vision.presence.surfaces import FacePairs, SceneSurfaces, find_opposed
from vision.scene import Scene

P = StateParameters()
ENDS = ([-5.0, -5, 0], [45.0, 45, 0])  # of the part, 50 mm long and wide


def feature_of(kind: str, count: int, thickness: float = np.nan) -> Items:
    """A feature of as many faces, and each face by itself."""
    faces = np.arange(count)
    each = np.append(0, 1 + faces)
    return Items(
        ["feature"] + ["surface"] * count, 0 * each, np.append(0, -1 - 0 * faces), each - 1,
        ["part/feature"] + [f"part/face {n}" for n in faces], [kind] + [""] * count, np.ones(1 + count),
        np.append(thickness, np.full(count, np.nan)), np.append(0 * faces, 1 + faces), np.append(faces, faces),
        np.zeros(count, bool),
    )  # fmt: skip


def scene_of(middle: Floats, *more: list[float]) -> Scene:
    """A part of surfaces of one small triangle each, at these places and at more."""
    middle = np.concatenate([middle, np.reshape(more, (-1, 3))])
    count = len(middle)
    triangles = np.arange(3 * count).reshape(-1, 3)
    part = np.zeros(count, np.int64)
    known = SimpleNamespace(
        vertices=np.repeat(middle, 3, axis=0), triangles=triangles, triangle_surface=np.arange(count),
        surface_occurrence=part,
    )  # fmt: skip
    return cast(Scene, known)


def measure(
    items: Items, middle: Floats, normal: Floats, mm: Floats, sigma: Floats, moved: Bools
) -> tuple[Measures, FacePairs]:
    """The sizes of items where faces lie so far outward."""
    count, nan = len(middle), np.full(len(middle), np.nan)
    opposed = find_opposed(items, scene_of(middle, *ENDS), middle, normal)
    surfaces = SceneSurfaces(
        moved, np.ones(count), mm, sigma, np.full((count, 3), np.nan), nan, np.zeros(count, bool), middle, normal,
        np.ones(count), opposed,
    )  # fmt: skip
    told = np.append(count, np.ones(count))
    return measure_items(items, nan, surfaces, find_moved(items, surfaces, told, P.least_moved_share), P), opposed


def rows(found: Measures, what: str) -> list[list[float]]:
    """Item, value, sigma and whether it is another, of the sizes of a kind."""
    columns = (found.item, found.value, found.sigma, found.changed)
    return [[float(column[k]) for column in columns] for k, name in enumerate(found.what) if name == what]


# A pocket of 40 by 30 mm: walls 0 and 1 face each other along x, 2 and 3 along y; the floor, 4, faces none.
POCKET = np.array([[0.0, 15, 5], [40, 10, 5], [20, 0, 5], [20, 30, 5], [20, 15, 0]])
WALLS = np.array([[1.0, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1]])


@pytest.mark.parametrize("moved", [False, True])
def test_a_pocket_is_as_wide_as_its_walls_stand_apart(moved: bool) -> None:
    """Wall 3 was not measured; wall 0 has moved into the pocket by .5 mm, wall 1 out of it by 3: the width is another
    where that wall is."""
    mm = np.array([0.5, -3.0, 0.1, np.nan, 0.2])
    sigma = np.where(np.isnan(mm), np.nan, [0.3, 0.4, 0.1, 0.1, 0.1])
    found, _ = measure(feature_of("pocket", 5), POCKET, WALLS, mm, sigma, np.arange(5) == (1 if moved else -1))
    (width,) = rows(found, "width")
    assert width == pytest.approx([0, 42.5, 0.5, float(moved)])
    changed = {(int(found.item[k]), found.what[k]) for k in np.flatnonzero(found.changed)}
    assert changed == ({(0, "width"), (0, "offset"), (2, "offset")} if moved else set())


# The sides of a rib of 6 mm.
RIB = np.array([[22.0, 0, 0], [28, 0, 0]])
SIDES = np.array([[-1.0, 0, 0], [1, 0, 0]])


@pytest.mark.parametrize(
    ("kind", "moved", "changed"), [("rib", False, True), ("web", False, False), ("web", True, True)]
)
def test_a_thickness_is_that_between_both_sides(kind: str, moved: bool, changed: bool) -> None:
    """A web's other side is hardly ever seen: it is judged where one of its faces has moved."""
    mm = np.array([3.0, 0.2])
    found, opposed = measure(feature_of(kind, 2, 6.0), RIB, SIDES, mm, np.full(2, 0.1), np.array([moved, False]))
    (thickness,) = rows(found, "thickness")
    assert thickness == pytest.approx([0, 9.2, 0.1 * 2**0.5, float(changed)])
    assert opposed.sizes(mm).tolist() == pytest.approx([9.2])


@pytest.mark.parametrize("mm", [(-10.0, 0.0), (-3.0, -4.0), (40.0, 10.0)])
def test_what_no_rib_can_be_is_no_thickness(mm: tuple[float, float]) -> None:
    """Neither less than nothing, nor more than the part is long."""
    found, opposed = measure(feature_of("rib", 2, 6.0), RIB, SIDES, np.array(mm), np.full(2, 0.1), np.ones(2, bool))
    assert opposed.most.tolist() == [50.0]
    assert rows(found, "thickness") == []


def test_faces_move_until_they_meet() -> None:
    """Sides of a rib of 6 mm, one of which lies 2 mm in: of the other at most 3 more can go, so that 1 mm is left.
    Walls of a pocket of 40 mm, both in place: either can go 39 mm out."""
    rib = find_opposed(feature_of("rib", 2, 6.0), scene_of(RIB, *ENDS), RIB, SIDES)
    low, high = rib.limit(np.array([-2.0, 0.0]), 1.0)
    assert low.tolist() == [-5.0, -3.0]
    assert high.tolist() == [44.0, 46.0]
    pocket = find_opposed(feature_of("pocket", 5), scene_of(POCKET, *ENDS), POCKET, WALLS)
    assert pocket.limit(np.zeros(5), 1.0)[1].tolist() == [39.0, 39.0, 29.0, 29.0, np.inf]
    assert rib.meet(np.array([-2.0, -3.0]), 1.0).tolist() == [[], []]
    assert rib.meet(np.array([-3.0, -3.0]), 1.0).tolist() == [[0, 1], [1, 0]]
