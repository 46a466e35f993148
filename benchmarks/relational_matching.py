"""Relational matching: time to proof, gap, recall and precision, beside peers, on generated and stored problems.

    python -m benchmarks.relational_matching [--kinds gated open hard pockets] [--units 20 50 100 200 300] [--seeds 10]
        [--seconds 20] [--peers CP-SAT HiGHS ...] [--data FOLDER] [--modes]

Peers: CP-SAT, where it is installed, with 8 workers and linearization 2, HiGHS as SciPy has it, and the assignment
without relations.  A time is one run, building the peer's model included; kernels are loaded before.  Recall and
precision are those of the labels against the truth that the problem was made from.

`--data`: problems stored as Parquet (see `read_problem`), benchmarks/data by default, where there are any.
`--modes`: selections and nodes of whole functions and of forward checking."""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pyarrow as pa
from pyarrow import parquet
from tabulate import tabulate

from benchmarks.peers.matchers import Answer, matchers
from relmodel.arrays import Ints
from relmodel.labelling.problem import NONE, OPTIMAL, MatchingProblem, labelling_cost, matching_problem
from relmodel.labelling.solve import MODES, solve
from tests.labelling.scenes import KINDS, scene

COLUMNS = ("unit", "label", "other", "other_label", "cost")


class Case(NamedTuple):
    """A problem and its truth (units,), -1 for none; None where nobody knows it."""

    family: str
    problem: MatchingProblem
    truth: Ints | None


def read_problem(path: Path) -> Case:
    """A problem and its family, matching_KIND_NUMBER.parquet: rows by `kind`, unit (null cost, true label), candidate,
    relation (weight), compatibility (what it saves); the first row's other_label says whether labels may repeat."""
    table = parquet.read_table(path)
    kind = np.array(table["kind"].to_pylist())
    values = np.stack([table[name].fill_null(NONE).to_numpy() for name in COLUMNS], axis=1).astype(np.int64)
    units, candidates = values[kind == "unit"], values[kind == "candidate"]
    problem = matching_problem(
        units[:, 4],
        int(max(candidates[:, 1].max(initial=-1), units[:, 1].max(initial=-1))) + 1,
        candidates[:, [0, 1, 4]],
        values[kind == "relation"][:, [0, 2, 4]],
        values[kind == "compatibility"][:, : 5 if (values[kind == "compatibility"][:, 4] >= 0).all() else 4],
        injective=bool(units[:1, 3].any()),
    )
    known = table.filter(pa.compute.equal(table["kind"], "unit"))["label"].null_count == 0
    return Case(path.stem.split("_")[1], problem, units[:, 1] if known else None)


def generated(kinds: list[str], sizes: list[int], seeds: int) -> Iterator[Case]:
    for kind in kinds:
        for units in sizes:
            for seed in range(seeds):
                s = scene(kind, units, seed)
                yield Case(f"{kind} {units}", s.problem, s.truth)


def compare(cases: list[Case], peers: list[str], seconds: float) -> str:
    """A table: one row a family and matcher."""
    rows = []
    solvers = {name: run for name, run in matchers().items() if name == "relmodel" or not peers or name in peers}
    solvers["relmodel"](cases[0].problem, seconds)  # loads the kernels
    for family in dict.fromkeys(case.family for case in cases):
        of_family = [case for case in cases if case.family == family]
        answers = {name: [run(c.problem, seconds) for c in of_family] for name, run in solvers.items()}
        best = [min(_cost(c, a[i]) for a in answers.values()) for i, c in enumerate(of_family)]
        for name, given in answers.items():
            if all(a.label is None for a in given):
                continue
            rows.append([family, name, *_summary(of_family, given, best)])
    header = ("problems", "matcher", "ms median", "ms worst", "proved", "gap", "above best", "recall", "precision")
    return tabulate(rows, header, floatfmt=("", "", ".1f", ".0f", ".2f", ".4f", ".4f", ".3f", ".3f"))


def _cost(case: Case, answer: Answer) -> float:
    return float("inf") if answer.label is None else labelling_cost(case.problem, answer.label).sum()


def _summary(cases: list[Case], answers: list[Answer], best: list[float]) -> list[float | None]:
    costs = [_cost(c, a) for c, a in zip(cases, answers, strict=True)]
    done = [a.bound is not None and a.bound > cost - 1 + 1e-6 for a, cost in zip(answers, costs, strict=True)]
    gaps = [(cost - a.bound) / max(cost, 1) for a, cost in zip(answers, costs, strict=True) if a.bound is not None]
    above = [(cost - b) / max(b, 1) for cost, b in zip(costs, best, strict=True)]
    told = [(c.truth, a.label) for c, a in zip(cases, answers, strict=True)]
    known = [(truth, label) for truth, label in told if truth is not None and label is not None]
    right = sum(int(np.count_nonzero((truth == label) & (label != NONE))) for truth, label in known)
    matched = sum(int(np.count_nonzero(label != NONE)) for _, label in known)
    true = sum(int(np.count_nonzero(truth != NONE)) for truth, _ in known)
    milliseconds = [1000 * a.seconds for a in answers]
    return [
        float(np.median(milliseconds)),
        max(milliseconds),
        float(np.mean(done)) if gaps else None,
        float(np.mean(gaps)) if gaps else None,
        float(np.mean(above)),
        right / true if true else None,
        right / matched if matched else None,
    ]


def modes(cases: list[Case], nodes: int = 20_000) -> str:
    """What whole functions save against one unit at a time."""
    rows = []
    for family in dict.fromkeys(case.family for case in cases):
        for mode in MODES:
            done, counts = 0, []
            for case in (c for c in cases if c.family == family):
                try:
                    found = solve(case.problem, mode, nodes=nodes, seconds=20)
                except ValueError:  # too many whole functions
                    continue
                done += found.status == OPTIMAL
                counts.append((found.nodes, found.selections))
            if counts:
                rows.append([family, mode, len(counts), done, *np.median(counts, axis=0)])
    return tabulate(rows, ("problems", "mode", "solved", "proved", "nodes median", "selections median"))


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--kinds", nargs="*", default=list(KINDS), choices=list(KINDS))
    parser.add_argument("--units", nargs="*", type=int, default=[20, 50, 100, 200, 300])
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--peers", nargs="*", default=[])
    parser.add_argument("--data", type=Path, default=Path(__file__).parent / "data")
    parser.add_argument("--modes", action="store_true")
    args = parser.parse_args()
    began = time.perf_counter()
    cases = [read_problem(path) for path in sorted(args.data.glob("matching_*.parquet"))]
    cases += generated(args.kinds, args.units, args.seeds)
    if args.modes:
        print(modes(cases), end="\n\n")
    elif cases:
        print(compare(cases, args.peers, args.seconds), end="\n\n")
    print(f"{time.perf_counter() - began:.0f} s")


if __name__ == "__main__":
    main()
