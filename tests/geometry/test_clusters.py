"""Groups of nearly equal rows, against trying every pair."""

from __future__ import annotations

import warnings

import networkx as nx
import numpy as np
import pytest

from relmodel.geometry.congruence import clusters, joined


@pytest.mark.parametrize("far", [0.0, 1e6, 1e20])
def test_groups_are_those_of_all_pairs_however_far_off(far: float) -> None:
    """Rows of a sheet that is nearly plane are, as a cylinder's axis, very far off."""
    rng = np.random.default_rng(4)
    values = rng.integers(0, 6, (80, 3)) + rng.uniform(-1e-4, 1e-4, (80, 3))
    values[:20, 0] *= -1
    values[40:, 1] += far * rng.integers(0, 3, 40)
    apart = np.linalg.norm(values[:, None] - values[None], axis=-1)
    pairs = np.argwhere(apart <= 1e-3)
    graph: nx.Graph[int] = nx.Graph([(int(a), int(b)) for a, b in pairs])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        label = clusters(values, 1e-3)
    found = {frozenset(np.flatnonzero(label == k).tolist()) for k in set(label.tolist())}
    assert found == {frozenset(group) for group in nx.connected_components(graph)}


def test_zeros_of_both_signs_are_one() -> None:
    assert len(set(clusters(np.array([[0.0, 1.0], [-0.0, 1.0], [-1e-9, 1.0]]), 1e-6).tolist())) == 1


def test_joined_nodes_are_the_components_of_their_graph() -> None:
    rng = np.random.default_rng(5)
    nodes = rng.permutation(100)[:40].tolist()
    edges = [(int(a), int(b)) for a, b in rng.choice(nodes, (25, 2))]
    graph: nx.Graph[int] = nx.Graph(edges)
    graph.add_nodes_from(nodes)
    assert joined(nodes, edges) == sorted(sorted(group) for group in nx.connected_components(graph))
    assert joined([], []) == []
