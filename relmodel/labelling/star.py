"""Star matching, after Cheng and Huang (Pattern Recognition 17, 1984): a peer, quick and without proof of its own.

The candidates of a problem, joined where they confirm each other, are a graph.  A candidate and those joined to it are
its star; a star is as strong as the weight of the relations in it that can hold at once, one for every unit and every
label.  The strongest star is accepted first.  Then, repeatedly, the candidate is accepted that the most accepted
candidates confirm; ties go to the stronger star.  Candidates that share a unit or a label with it are struck off.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from relmodel.arrays import Bools, Ints
from relmodel.labelling import branch_and_bound
from relmodel.labelling.cost import labelling_cost
from relmodel.labelling.problem import NONE, MatchingProblem
from relmodel.labelling.result import BOUNDED, OPTIMAL, MatchingResult
from relmodel.labelling.tables import search_tables

MODE = "star"


def search(problem: MatchingProblem, limit: int | None, nodes: int, seconds: float | None) -> MatchingResult:
    """See `relmodel.labelling.solve`.  The bound is that of the default mode: it says how far off the best labelling
    the stars are."""
    proved = branch_and_bound.search(problem, limit, nodes, seconds)
    label, selections = lay_stars(problem)
    cost = labelling_cost(problem, label).total
    return replace(
        proved,
        mode=MODE,
        label=label,
        cost=cost,
        status=OPTIMAL if cost == proved.bound else BOUNDED,
        selections=selections,
    )


def lay_stars(problem: MatchingProblem) -> tuple[Ints, int]:
    """Label of each unit (units,), -1 for none, and how many candidates were accepted.

    A candidate is accepted while what confirms it, among the accepted and those still open, makes it cheaper than no
    label.
    """
    tables = search_tables(problem)
    pair, unit, label = problem.compatibility, problem.candidate_unit, problem.candidate_label
    gain = problem.savings.sum(axis=1)
    saves = problem.null_cost[unit] - tables.base  # what a label that nothing confirms saves: mostly less than nothing
    open_, laid = np.ones(problem.candidates, bool), np.zeros(problem.candidates, bool)
    while open_.any():
        strength = _strengths(pair, gain, unit, label, open_ | laid, problem.candidates)
        is_laid = laid[pair]
        confirmed = np.zeros(problem.candidates, np.int64)
        np.add.at(confirmed, pair[is_laid[:, 1], 0], gain[is_laid[:, 1]])
        np.add.at(confirmed, pair[is_laid[:, 0], 1], gain[is_laid[:, 0]])
        open_ &= saves + strength > 0
        choice = np.flatnonzero(open_)
        if len(choice) == 0:
            break
        order = np.lexsort((choice, -saves[choice], -strength[choice], -confirmed[choice]))
        best = choice[order[0]]
        laid[best] = True
        open_ &= (unit != unit[best]) & ((label != label[best]) | (not problem.injective))
    found = np.full(problem.units, NONE, np.int64)
    found[unit[laid]] = label[laid]
    return found, int(laid.sum())


def _strengths(pair: Ints, gain: Ints, unit: Ints, label: Ints, there: Bools, candidates: int) -> Ints:
    """Strength of each candidate's star: its relations to units, the best of each, or to labels, whichever is less."""
    alive = there[pair].all(axis=1)
    centre = np.concatenate([pair[alive, 0], pair[alive, 1]])
    leaf = np.concatenate([pair[alive, 1], pair[alive, 0]])
    weight = np.tile(gain[alive], 2)
    sums = []
    for column in (unit, label):
        order = np.lexsort((-weight, column[leaf], centre))
        first = np.ones(len(order), bool)
        first[1:] = (np.diff(centre[order]) != 0) | (np.diff(column[leaf][order]) != 0)
        kept = order[first]
        total = np.zeros(candidates, np.int64)
        np.add.at(total, centre[kept], weight[kept])
        sums.append(total)
    return np.minimum(*sums)
