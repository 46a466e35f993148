"""Duals, prices and better labellings: against the linear relaxation by another solver, and by their definitions."""

from __future__ import annotations

from collections.abc import Iterator
from copy import deepcopy
from dataclasses import replace

import numpy as np
import pytest

from relmodel.arrays import Ints
from relmodel.labelling.branch_and_bound import SCALE, Bounds, Duals, LocalSearch
from relmodel.labelling.problem import NONE, MatchingProblem, labelling_cost, matching_problem, search_tables
from tests.labelling.oracle import random_problem, relaxed_cost
from tests.labelling.scenes import scene


def problems(count: int, seed: int) -> Iterator[MatchingProblem]:
    """Crowded ones, whose labels are wanted by several and whose units have many relations, and others."""
    rng = np.random.default_rng(seed)
    for number in range(count):
        units, labels = (int(n) for n in rng.integers(4, 8, 2))
        unit, label = np.nonzero(rng.random((units, labels)) < 0.7)
        a, b = np.nonzero((rng.random((units, units)) < 0.7) & ~np.eye(units, dtype=bool))
        i, j = np.nonzero((unit[:, None] < unit[None]) & (rng.random((len(unit), len(unit))) < 0.4))
        yield matching_problem(
            rng.integers(5, 14, units),
            labels,
            np.stack([unit, label, rng.integers(0, 6, len(unit))], axis=1),
            np.stack([a, b, rng.integers(1, 4, len(a))], axis=1),
            np.stack([unit[i], label[i], unit[j], label[j], rng.integers(1, 5, len(i))], axis=1),
            injective=number % 4 > 0,
        )
        yield random_problem(rng, 5)
    yield scene("hard", 24, 4).problem
    yield scene("pockets", 24, 1).problem


def assert_feasible(bounds: Bounds, duals: Duals) -> None:
    """Promises of both ends of a pair hold its gain, prices are at most 0, and what is left bounds from below."""
    t, p = bounds.tables, bounds.problem
    slot = np.repeat(np.arange(len(t.slot_candidate)), np.diff(t.pair_first))
    alive = duals.live[t.slot_candidate[slot]] & duals.live[t.slot_candidate[t.pair_slot]]
    promised = duals.message[slot] + duals.message[t.pair_slot]
    assert (promised >= t.pair_gain * SCALE)[alive].all()
    own = duals.live[t.slot_candidate]
    assert (duals.message[own] >= 0).all()
    assert (duals.label_dual <= 0).all()
    assert p.injective or not duals.label_dual.any()
    given = np.bincount(t.slot_candidate[own], duals.message[own], minlength=p.candidates)
    reduced = t.base * SCALE - given - duals.label_dual[p.candidate_label]
    live, none = duals.live[: p.candidates], duals.live[p.candidates :]
    assert (reduced == duals.reduced)[live].all()
    least = np.where(none, p.null_cost * SCALE, 2**60)
    np.minimum.at(least, p.candidate_unit[live], duals.reduced[live])
    assert duals.bound == least.sum() + duals.label_dual.sum()
    assert (duals.unit_dual == least).all()
    slack = bounds.slack(duals)
    assert (slack[: p.candidates] == duals.reduced - least[p.candidate_unit]).all()
    assert (slack[p.candidates :] == p.null_cost * SCALE - least).all()


def test_sweeps_raise_a_bound_that_stays_below_the_relaxation() -> None:
    rose = []
    for problem in problems(25, 3):
        bounds, best = Bounds(search_tables(problem)), relaxed_cost(problem) * SCALE
        duals = bounds.start()
        start = duals.bound
        for sweeps in (1, 1, 6):
            before = duals.bound
            assert_feasible(bounds, duals)
            bounds.ascend(duals, sweeps)
            assert before <= duals.bound <= best + 1e-3
        rose += [(duals.bound - start) / (best - start)] if best > start + 1 else []
        bounds.anneal(duals, 20)
        bounds.ascend(duals, 1)
        assert_feasible(bounds, duals)
        assert duals.bound <= best + 1e-3
    assert min(rose) > 0.5
    assert np.mean(rose) > 0.8


@pytest.mark.parametrize(("kind", "seed", "steps"), [*(("open", seed, 20) for seed in (0, 2)), ("pockets", 2, 200)])
def test_cooling_gets_to_the_relaxation_where_sweeps_do_not(kind: str, seed: int, steps: int) -> None:
    problem = scene(kind, 32, seed).problem
    bounds, best = Bounds(search_tables(problem)), relaxed_cost(problem) * SCALE
    duals = bounds.start()
    bounds.ascend(duals, 8)
    assert duals.bound < best - SCALE
    bounds.anneal(duals, steps)
    bounds.ascend(duals, 1)
    assert_feasible(bounds, duals)
    assert best - 0.15 * SCALE < duals.bound <= best + 1e-3
    bounds.ascend(duals, 3)
    assert_feasible(bounds, duals)


def test_a_state_that_is_taken_or_forbidden_leaves_what_the_relaxation_has_with_it() -> None:
    """The bound of a child holds for its labellings, and is near what it costs to fix the state there."""
    rng = np.random.default_rng(4)
    for problem in problems(15, 5):
        bounds = Bounds(search_tables(problem))
        duals = bounds.start()
        bounds.ascend(duals, 4)
        state = int(rng.integers(problem.candidates + problem.units))
        for taken in (True, False):
            child = deepcopy(duals)
            if taken:
                bounds.restrict(child, state)
            else:
                bounds.forbid(child, np.array([state]))
            null = state >= problem.candidates
            unit = state - problem.candidates if null else int(problem.candidate_unit[state])
            states = np.append(problem.candidate_unit, np.arange(problem.units)) == unit
            gone = states & (np.arange(len(states)) != state)
            if taken and not null and problem.injective:
                gone[: problem.candidates] |= problem.candidate_label == problem.candidate_label[state]
                gone[state] = False
            wanted = ~gone if taken else np.arange(len(states)) != state
            assert child.live.tolist() == wanted.tolist()
            bounds.assign(child)
            before = child.bound
            bounds.ascend(child, 3)
            assert child.bound >= before
            assert child.bound >= duals.bound
            if np.bincount(
                np.append(problem.candidate_unit, np.arange(problem.units))[wanted], minlength=problem.units
            ).all():
                assert_feasible(bounds, child)


def test_better_labellings_cost_what_is_said_and_no_move_betters_them() -> None:
    rng = np.random.default_rng(6)
    for problem in problems(20, 7):
        tables = search_tables(problem)
        found, start = LocalSearch(tables), np.full(problem.units, NONE)
        for unit in rng.permutation(problem.units):
            own = np.arange(problem.first_candidate[unit], problem.first_candidate[unit + 1])
            used = problem.candidate_label[start[start >= 0]] if problem.injective else []
            own = own[~np.isin(problem.candidate_label[own], used)]
            if len(own) and rng.random() < 0.8:
                start[unit] = rng.choice(own)
        begun = labels_of(problem, start)
        found.offer(start)
        cost = labelling_cost(problem, found.label).sum()
        assert found.cost == cost <= min(problem.null_cost.sum(), labelling_cost(problem, begun).sum())
        if cost == problem.null_cost.sum():
            continue
        for label, own in neighbours_of(problem, found.chosen):
            free = replace(problem, injective=False)
            wanted = labelling_cost(free, own).sum() < cost  # by the unit that moves
            assert not wanted or labelling_cost(problem, label).sum() >= cost


def labels_of(problem: MatchingProblem, chosen: Ints) -> Ints:
    return np.append(problem.candidate_label, NONE)[chosen]


def neighbours_of(problem: MatchingProblem, chosen: Ints) -> Iterator[tuple[Ints, Ints]]:
    """Labellings with one unit in another state, with and without any free one for the unit that had its label."""
    states = [[NONE, *range(*problem.first_candidate[u : u + 2])] for u in range(problem.units)]
    for unit in range(problem.units):
        for state in states[unit]:
            moved = chosen.copy()
            moved[unit] = state
            own = labels_of(problem, moved)
            rivals = np.flatnonzero((own == own[unit]) & (np.arange(problem.units) != unit))
            if state == NONE or not problem.injective or not len(rivals):
                yield own, own
                continue
            for refuge in states[rivals[0]]:
                moved[rivals[0]] = refuge
                labels = labels_of(problem, moved)
                if refuge == NONE or (labels[rivals[0]] != labels_of(problem, chosen)).all():
                    yield labels, own
