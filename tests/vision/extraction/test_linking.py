"""What lies near to what and what belongs together, against SciPy's trees, graphs and images."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import map_coordinates
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from vision.extraction.chains import find_pairs_within, interpolate_grey, label_components


@pytest.mark.parametrize("size", [(0, 40, 10), (1, 40, 10), (400, 300, 20), (400, 20, 300), (300, 0, 50)])
def test_pairs_are_those_of_a_tree(size: tuple[int, int, int]) -> None:
    count, width, height = size
    rng = np.random.default_rng(3)
    place = rng.uniform(0, 1, (count, 2)) * (width, height)
    place[: count // 4] = place[count // 4 : 2 * (count // 4)]  # some coincide
    looked = rng.random(count) < 0.3
    true = {(i, j) for i, j in cKDTree(place).query_pairs(6.0)} if count else set()
    assert {(i, j) for i, j in find_pairs_within(place, 6.0).tolist()} == true
    some = find_pairs_within(place, 6.0, looked).tolist()
    assert len({(i, j) for i, j in some}) == len(some)
    assert {(i, j) for i, j in some} == {(i, j) for i, j in true if looked[i] or looked[j]}


@pytest.mark.parametrize(("count", "links"), [(1, 0), (50, 0), (200, 150), (200, 400)])
def test_components_are_those_of_a_graph(count: int, links: int) -> None:
    pairs = np.random.default_rng(links).integers(0, count, (links, 2))
    graph = coo_array((np.ones(links), pairs.T), shape=(count, count))
    of = connected_components(graph, directed=False)[1]
    first = np.unique(of, return_index=True)[1]
    in_order = np.argsort(np.argsort(first))  # numbered as they first come
    assert label_components(pairs, count).tolist() == in_order[of].tolist()


def test_grey_between_pixels_is_bilinear() -> None:
    rng = np.random.default_rng(0)
    grey, place = rng.uniform(0, 255, (20, 30)), rng.uniform(-5, 35, (7, 50, 2))
    true = map_coordinates(grey, [place[..., 1], place[..., 0]], order=1, mode="nearest")
    assert interpolate_grey(grey, place) == pytest.approx(true, abs=1e-9)
