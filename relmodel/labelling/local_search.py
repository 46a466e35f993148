"""Better labellings near one that is known: an upper bound of the cost."""

from __future__ import annotations

import numpy as np

from relmodel.arrays import Ints
from relmodel.labelling.problem import NONE
from relmodel.labelling.tables import SearchTables


class LocalSearch:
    """Keeps the best labelling seen: chosen (units,), candidate or -1, and its cost.  At first nothing is matched."""

    def __init__(self, tables: SearchTables) -> None:
        from relmodel.labelling import search_kernels

        self._kernels = search_kernels
        self._tables = tables
        self.chosen: Ints = np.full(tables.problem.units, NONE, np.int64)
        self.cost = int(tables.problem.null_cost.sum())

    @property
    def label(self) -> Ints:
        """(units,): label of each unit in the best labelling, -1 for none."""
        labels = np.append(self._tables.problem.candidate_label, NONE)
        return labels[self.chosen]

    def offer(self, start: Ints) -> None:
        """Descend from a labelling (units,), candidates or -1, and keep what is cheaper than the best so far."""
        p, t = self._tables.problem, self._tables
        chosen = np.full(p.units, NONE, np.int64)
        saved = np.zeros(p.candidates, np.int64)
        self._kernels.improve(
            p.first_candidate, p.candidate_label, t.base, t.slot_first, t.slot_candidate,
            t.pair_first, t.pair_slot, t.pair_gain, p.null_cost, start, chosen, np.full(p.labels, NONE, np.int64),
            saved, p.injective,
        )  # fmt: skip
        # Every confirmed pair is saved by both of its ends, and its gain counts once.
        has = chosen != NONE
        at = chosen[has]
        saving, odd = divmod(int(saved[at].sum()), 2)
        assert odd == 0
        cost = int(t.base[at].sum() + p.null_cost[~has].sum()) - saving
        if cost < self.cost:
            self.cost, self.chosen = cost, chosen
