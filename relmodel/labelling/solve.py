"""Solve a matching problem, by a mode chosen by name."""

from __future__ import annotations

from relmodel.errors import UsageError
from relmodel.labelling import branch_and_bound, paper, star
from relmodel.labelling.problem import MatchingProblem
from relmodel.labelling.result import MatchingResult

MODES = (branch_and_bound.MODE, paper.MODE, star.MODE)

NODES = 10_000
PAPER_NODES = 100
"""nodes of `paper` that cost about as much as one of `dual_ascent`, which has bounds of its own"""


def solve(
    problem: MatchingProblem,
    mode: str = branch_and_bound.MODE,
    *,
    limit: int | None = None,
    nodes: int = NODES,
    seconds: float | None = None,
) -> MatchingResult:
    """The labelling of least cost, or the best that was found, with a bound.

    mode: `dual_ascent`, the default, proves what it finds; `paper` is the printed search with whole functions, a
    heuristic whose mapping is total and not injective; `star` is Cheng and Huang's star matching, a heuristic, with the
    bound of the default.
    limit: only labellings that cost this or less matter, and 0 asks for a consistent one: a bound above it says that
    there is none.  nodes (PAPER_NODES times as many of `paper`) and seconds end the search, the latter at the price of
    runs that differ.

    Equal problems give equal results unless `seconds` ends the search.  Raises UsageError for a mode that is none.
    """
    if mode == branch_and_bound.MODE:
        return branch_and_bound.search(problem, limit, nodes, seconds)
    if mode == star.MODE:
        return star.search(problem, limit, nodes, seconds)
    if mode == paper.MODE:
        return paper.search(problem, limit, nodes * PAPER_NODES, seconds)
    raise _no_mode(mode)


def check_mode(mode: str) -> None:
    """Raises UsageError for a mode that is none."""
    if mode not in MODES:
        raise _no_mode(mode)


def _no_mode(mode: str) -> UsageError:
    return UsageError(f"invalid search {mode!r}: use one of {', '.join(MODES)}")
