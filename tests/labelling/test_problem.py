"""Problems, results and trees as rows, by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from relmodel.labelling.problem import (
    BRANCHED,
    OPTIMAL,
    PRUNED,
    REST,
    ROOT,
    TAKE,
    MatchingResult,
    SearchNode,
    matching_problem,
    result_rows,
    search_tables,
)

# Unit 0 takes label 2; 1 has only that; 2 has none; 3 could have label 0, which is free; 4 takes 1.
CANDIDATES = [(4, 1, 7), (0, 2, 1), (1, 2, 2), (3, 2, 3), (3, 0, 4), (0, 0, 5)]
NEAR = [(0, 4, 10), (4, 0, 3), (1, 0, 6), (0, 3, 2)]
PAIRS = [
    (4, 1, 0, 2, 8),
    (0, 2, 4, 1, 5),
    (1, 2, 0, 0, 4),
    (3, 0, 0, 2, 9),
    (1, 2, 3, 0, 9),
    (0, 2, 1, 2, 6),
    (2, 1, 0, 0, 3),
]
PROBLEM = matching_problem([20, 21, 22, 23, 24], 3, CANDIDATES, NEAR, PAIRS)
TREE = (
    SearchNode(0, -1, 0, ROOT, -1, -1, 50, BRANCHED),
    SearchNode(1, 0, 1, TAKE, 4, 1, 60, PRUNED),
    SearchNode(2, 0, 1, TAKE, 3, -1, 61, PRUNED),
    SearchNode(3, 0, 1, REST, -1, -1, 62, PRUNED),
)
RESULT = MatchingResult("dual_ascent", np.array([2, -1, -1, -1, 1]), 94, 94, OPTIMAL, 4, 2, TREE)


def test_rows_of_a_result() -> None:
    """No candidate, no neighbour, or one label of two units confirms nothing; of a pair twice given the greater."""
    rows = {name: {c: np.ma.filled(v, -9).tolist() if isinstance(v, np.ndarray) else v for c, v in table.items()}
            for name, table in result_rows(PROBLEM, RESULT).items()}  # fmt: skip
    assert rows["problem"] == {"injective": [True], "status": ["optimal"], "cost": [94.0], "bound": [94.0]}
    in_order = sorted(CANDIDATES)
    assert list(zip(*rows["candidate"].values(), strict=True)) == [(u, x, float(c)) for u, x, c in in_order]
    assert list(zip(*rows["problem_relation"].values(), strict=True)) == sorted(NEAR)
    pairs = list(zip(*rows["compatibility"].values(), strict=True))
    assert sorted(pairs) == [(0, 0, 1, 2, 4), (0, 2, 3, 0, 2), (0, 2, 4, 1, 8)]
    # 0 pays 1 and of 12 what is not confirmed: of 10 to unit 4 all but 8, all of 2 to unit 3; 4 pays 7 alone.
    paid = rows["assignment"]
    assert paid["unit_no"] == [0, 1, 2, 3, 4]
    assert paid["label_no"] == [2, -9, -9, -9, 1]
    assert paid["cost"] == [1.0 + 2 + 2, 21.0, 22.0, 23.0, 7.0]
    assert paid["null_cost"] == [20.0, 21.0, 22.0, 23.0, 24.0]
    assert paid["reason"] == ["matched", "taken", "no_candidate", "null_cheaper", "matched"]
    again = replace(matching_problem([20, 21, 22, 23, 24], 3, CANDIDATES, NEAR, PAIRS, injective=False))
    assert result_rows(again, RESULT)["assignment"]["reason"][1] == "null_cheaper"
    assert rows["search_node"] == {
        "node_no": [0, 1, 2, 3], "parent_no": [-9, 0, 0, 0], "depth": [0, 1, 1, 1],
        "branch": ["root", "take", "take", "rest"], "unit_no": [-9, 4, 3, -9], "label_no": [-9, 1, -9, -9],
        "bound": [50.0, 60.0, 61.0, 62.0], "status": ["branched", "pruned", "pruned", "pruned"],
    }  # fmt: skip


def test_a_problem_laid_out_for_the_kernels() -> None:
    """Each saving from either end; candidates 0 to 5 are (0, 0), (0, 2), (1, 2), (3, 0), (3, 2), (4, 1)."""
    t = search_tables(PROBLEM)
    assert t.base.tolist() == [5 + 12, 1 + 12, 2 + 6, 4, 3, 7 + 3]
    gains = {(0, 1): 4, (1, 3): 2, (1, 4): 8 + 3, (2, 0): 4, (3, 0): 2, (5, 0): 8 + 3}  # of a candidate and a neighbour
    slots = list(zip(t.slot_candidate.tolist(), t.slot_other.tolist(), strict=True))
    assert slots == sorted(gains)
    assert t.slot_gain.tolist() == [gains[slot] for slot in slots]
    assert t.slot_first.tolist() == [0, 1, 3, 4, 5, 5, 6]
    assert t.pair_first.tolist() == list(range(7))
    assert [slots[s] for s in t.pair_slot] == [(2, 0), (3, 0), (5, 0), (0, 1), (1, 3), (1, 4)]
    assert t.pair_gain.tolist() == [4, 2, 11, 4, 2, 11]
    halves = [(0, 1), (0, 3), (0, 4), (1, 0), (3, 0), (4, 0)]
    units = PROBLEM.candidate_unit
    assert [halves[h] for h in t.slot_half] == [(int(units[c]), v) for c, v in slots]
    assert [halves[h] for h in t.half_twin] == [(v, u) for u, v in halves]
    assert t.half_first.tolist() == [0, 3, 4, 4, 5, 6]
    assert [t.label_candidate[a:b].tolist() for a, b in zip(t.label_first, t.label_first[1:], strict=False)] == [
        [0, 3], [5], [1, 2, 4],
    ]  # fmt: skip
    assert (t.before.tolist(), t.after.tolist()) == ([0, 0, 1, 1, 0, 1], [1, 2, 0, 0, 0, 0])
