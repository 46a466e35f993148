"""Pairing things of two sets by nearness, each at most once."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from relmodel.arrays import Floats, Ints


def near_pairs(a: Floats, b: Floats, within: float) -> tuple[Ints, Ints, Floats]:
    """Pairs of rows of `a` (n, d) and `b` (m, d) that are at most `within` apart: rows, rows and distances."""
    from scipy.spatial import KDTree

    if not len(a) or not len(b):
        return np.empty(0, np.int64), np.empty(0, np.int64), np.empty(0)
    found = KDTree(a).sparse_distance_matrix(KDTree(b), within, output_type="ndarray")
    return found["i"].astype(np.int64), found["j"].astype(np.int64), found["v"].astype(float)


def one_to_one(i: Ints, j: Ints, *costs: npt.NDArray[Any]) -> Ints:
    """Rows of the pairs (i, j) that give every i and j at most one partner: greedily, least first costs first."""
    rows = np.lexsort((j, i, *reversed(costs)))
    taken = [np.empty(0, np.int64)]
    while len(rows):
        # A pair that comes first for both of its ends is one that a greedy walk takes.
        first = np.zeros((2, len(rows)), bool)
        first[0, np.unique(i[rows], return_index=True)[1]] = True
        first[1, np.unique(j[rows], return_index=True)[1]] = True
        chosen = rows[first.all(axis=0)]
        taken.append(chosen)
        rows = rows[~np.isin(i[rows], i[chosen]) & ~np.isin(j[rows], j[chosen])]
    return np.concatenate(taken)
