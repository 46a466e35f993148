"""Prices of labels, one kernel at a time, against their definitions."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import linear_sum_assignment

from relmodel.arrays import Bools, Ints
from relmodel.labelling import kernels


def states(rng: np.random.Generator, units: int, labels: int) -> tuple[Ints, Ints, Ints, Ints, Ints, Bools]:
    """Candidates of each unit, their units and labels, candidates by label, and which states are allowed."""
    unit, label = (rows.copy() for rows in np.nonzero(rng.random((units, labels)) < 0.7))
    live = rng.random(len(unit) + units) < 0.8
    first, by_label = np.searchsorted(unit, np.arange(units + 1)), np.argsort(label, kind="stable")
    return first, unit, label, np.searchsorted(label[by_label], np.arange(labels + 1)), by_label, live


@pytest.mark.parametrize("seed", range(6))
def test_the_price_of_a_label_lies_midway_between_its_first_and_second_bidder(seed: int) -> None:
    """A unit bids what it would lose without, how far its best other state lies above; the last price stands."""
    rng = np.random.default_rng(seed)
    units, labels = 7, int(rng.integers(1, 5))
    first, unit, label, label_first, by_label, live = states(rng, units, labels)
    live[len(unit) :] = True
    null, cost = rng.integers(5000, 9000, units), rng.integers(0, 8000, len(unit))
    dual = -rng.integers(0, 900, labels)
    reduced = cost - dual[label]
    work = [np.zeros(units, np.int64) for _ in range(3)]
    kernels.price(first, unit, label_first, by_label, live, null, dual, reduced, *work)
    assert (reduced == cost - dual[label]).all()
    bids = [0, 0]
    for c in np.flatnonzero((label == labels - 1) & live[: len(unit)]):
        others = [reduced[d] for d in range(first[unit[c]], first[unit[c] + 1]) if d != c and live[d]]
        bids.append(int(min([null[unit[c]], *others]) - cost[c]))
    second, highest = sorted(max(bid, 0) for bid in bids)[-2:]
    assert -dual[-1] == second + (highest - second) // 2


@pytest.mark.parametrize("seed", range(6))
def test_at_its_softened_price_a_label_is_wanted_once_or_less_at_none(seed: int) -> None:
    rng = np.random.default_rng(seed)
    units, labels, temperature = 7, int(rng.integers(1, 5)), float(rng.uniform(0.5, 20))
    first, unit, label, label_first, by_label, live = states(rng, units, labels)
    live[0] = True
    null, cost, dual = rng.uniform(0, 60, units), rng.uniform(-30, 60, len(unit)), -rng.uniform(0, 9, labels)
    reduced = cost - dual[label]
    room = np.zeros(units), np.zeros(len(unit)), np.zeros(len(unit), np.int64)
    kernels.soft_price(first, unit, label_first, by_label, live, null, dual, reduced, *room, temperature)
    np.testing.assert_allclose(reduced, cost - dual[label], atol=1e-9)

    def wanted(values: np.ndarray) -> float:
        """How often the units together want the last label."""
        weight = np.exp(-np.append(values, null) / temperature) * live
        whole = np.bincount(np.append(unit, np.arange(units)), weight)
        mine = weight[: len(unit)] * (label == labels - 1)
        return float((mine / np.maximum(whole[unit], 1e-300)).sum())

    at_none = np.where(label == labels - 1, cost, reduced)
    if wanted(at_none) <= 1:
        assert dual[-1] == 0
    else:
        assert dual[-1] < 0
        assert wanted(reduced) == pytest.approx(1, abs=2e-3)


@pytest.mark.parametrize("seed", range(8))
def test_assignments_and_their_duals(seed: int) -> None:
    rng = np.random.default_rng(seed)
    units, labels = int(rng.integers(1, 12)), int(rng.integers(1, 9))
    first, unit, label, _, _, live = states(rng, units, labels)
    live[len(unit) :] = np.append(not live[: first[1]].any(), np.ones(units - 1, bool))  # the first unit must have one
    null, cost = rng.integers(0, 90, units), rng.integers(-40, 90, len(unit))
    dense = np.full((units, labels + units), kernels.FAR)
    dense[unit[live[: len(unit)]], label[live[: len(unit)]]] = cost[live[: len(unit)]]
    dense[np.arange(units), labels + np.arange(units)] = np.where(live[len(unit) :], null, kernels.FAR)
    unit_dual, label_dual, chosen = np.zeros(units, np.int64), np.zeros(labels, np.int64), np.zeros(units, np.int64)
    room = [np.zeros(labels, np.int64) for _ in range(4)]
    found = kernels.assign(first, unit, label, live, null, cost, unit_dual, label_dual, chosen, *room)
    assert found == dense[linear_sum_assignment(dense.astype(float))].sum() == unit_dual.sum() + label_dual.sum()
    assert (label_dual <= 0).all()
    assert (dense - unit_dual[:, None] >= np.append(label_dual, np.zeros(units, np.int64))).all()
    column = np.where(chosen >= 0, np.append(label, 0)[chosen], labels + np.arange(units))
    assert dense[np.arange(units), column].sum() == found
    owned = chosen >= 0
    assert room[0][label[chosen[owned]]].tolist() == np.flatnonzero(owned).tolist()
    total = kernels.cheapest(first, live, null, cost, unit_dual, chosen)
    assert unit_dual.tolist() == dense.min(axis=1).tolist()
    assert total == unit_dual.sum()
    assert [cost[c] if c >= 0 else null[u] for u, c in enumerate(chosen)] == unit_dual.tolist()
