"""Greedy pairing against a plain walk over the sorted pairs."""

import numpy as np

from relmodel.variants.surfaces import near_pairs, one_to_one


def test_one_to_one_is_the_greedy_walk() -> None:
    random = np.random.default_rng(3)
    for _ in range(20):
        i, j = random.integers(0, 12, 60), random.integers(0, 9, 60)
        coarse, fine = random.integers(0, 3, 60), random.uniform(size=60)
        walk, used_i, used_j = [], set(), set()
        for row in sorted(range(60), key=lambda r: (coarse[r], fine[r])):
            if i[row] not in used_i and j[row] not in used_j:
                walk.append(row)
                used_i.add(i[row])
                used_j.add(j[row])
        assert sorted(one_to_one(i, j, coarse, fine).tolist()) == sorted(walk)


def test_near_pairs_are_those_within_the_distance() -> None:
    random = np.random.default_rng(4)
    a, b = random.uniform(0, 10, (40, 4)), random.uniform(0, 10, (30, 4))
    i, j, distance = near_pairs(a, b, 3.0)
    apart = np.linalg.norm(a[:, None] - b[None], axis=2)
    assert set(zip(i.tolist(), j.tolist(), strict=True)) == set(zip(*np.nonzero(apart <= 3), strict=True))
    np.testing.assert_allclose(distance, apart[i, j])
    assert len(near_pairs(a, np.empty((0, 4)), 3.0)[0]) == 0
