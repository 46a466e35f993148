"""Step 2 of Pong's matcher: from votes to pairs of arcs, by the assignment of least cost."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from relmodel.arrays import Floats, Ints
from relmodel.matching.assignment import Assignment, solve_assignment
from vision.stereo.epipolar import Votes
from vision.stereo.parameters import SegmentParameters

# Why an arc has the partner it has, or none; the words of the table `assignment`.
MATCHED, NO_CANDIDATE, NULL_CHEAPER, TAKEN = "matched", "no_candidate", "null_cheaper", "taken"


@dataclass(frozen=True)
class Candidates:
    """Pairs of arcs that may be one, with S in 0..1 and the cost 1 - S; `pair` is their place among the votes."""

    pair: Ints
    left: Ints
    right: Ints
    similarity: Floats
    cost: Floats


def compute_similarity(votes: Votes) -> Floats:
    """S = votes/overlap * overlap/longer extent of each pair, 0..1: the share of the longer arc's rows that agree."""
    longer = np.maximum(votes.left_extent[votes.left], votes.right_extent[votes.right])
    return np.asarray(votes.votes / votes.overlap * (votes.overlap / longer))


def select_candidates(votes: Votes, parameters: SegmentParameters) -> Candidates:
    """The pairs with votes enough."""
    pair = np.flatnonzero(votes.votes >= parameters.least_votes)
    s = compute_similarity(votes)[pair]
    return Candidates(pair, votes.left[pair], votes.right[pair], s, 1 - s)


def assign(
    found: Candidates, left_count: int, right_count: int, parameters: SegmentParameters
) -> tuple[Assignment, npt.NDArray[np.str_]]:
    """The best one-to-one assignment of right arcs to left ones, and for each left arc the reason of its decision."""
    null = np.full(left_count, parameters.null_cost)
    assignment = solve_assignment(found.left, found.right, found.cost, null, right_count)
    cheapest = np.full(left_count, np.inf)
    np.minimum.at(cheapest, found.left, found.cost)
    reason = np.select(
        [assignment.label >= 0, np.isinf(cheapest), cheapest >= null], [MATCHED, NO_CANDIDATE, NULL_CHEAPER], TAKEN
    )
    return assignment, reason
