"""Which of some objects pictures show, by hand-made scores, costs and edges."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from vision.inspection.against import (
    Candidate,
    Chosen,
    Start,
    doubt,
    find_worthy,
    is_to_be_weighed,
    judge,
    judge_variants,
    share_edges,
)
from vision.inspection.inspection_parameters import DEFAULTS
from vision.inspection.locate import Location
from vision.localisation.localise import Localisation
from vision.localisation.verdict import Verdict
from vision.presence.report import VariantEvidence
from vision.presence.states import CHANGED, CONFIRMED, UNDECIDABLE, Presence


def candidate(number: int, name: str, variant: str = "") -> Candidate:
    return Candidate(number, name, variant, number, name)


def start(name: str, variant: str, *score: float) -> Start:
    found = SimpleNamespace(candidates=SimpleNamespace(score=np.array(score)))
    return Start(candidate(0, name, variant), cast(Any, None), cast(Any, None), cast(Any, found))


def test_the_best_variant_of_the_objects_that_explain_most_is_located() -> None:
    starts = [start("it", "B", 0.8, 0.1), start("it", "A", 0.7)]
    starts += [start("other", "", 0.4), start("far", "", 0.39), start("no", "")]
    assert [s.score for s in starts] == [0.8, 0.7, 0.4, 0.39, None]
    chosen = [(s.candidate.name, s.candidate.variant) for s in find_worthy(starts, 5)]
    assert chosen == [("it", "B"), ("other", "")]
    assert find_worthy(starts, 1) == starts[:1]
    assert find_worthy([start("no", "")], 3)[0].candidate.name == "no"


def localised(edges: list[tuple[float, float]], cost: float | None, verdict: str = "accepted") -> Localisation:
    measured = SimpleNamespace(position=np.reshape(edges, (-1, 2)))
    best = None if cost is None else SimpleNamespace(
        cost=cost, evidence=-cost, prior_sigma=np.nan, is_symmetric=False, told=np.nan, strain=0.0, outlines=None,
        support=SimpleNamespace(evidence=-cost, found=np.array([-cost]), expected=np.array([50.0])),
    )  # fmt: skip
    views = {"left": SimpleNamespace(measurements=measured)}
    return cast(Localisation, SimpleNamespace(views=views, best=best, verdict=SimpleNamespace(verdict=verdict)))


def location(*given: Any) -> Location:
    return cast(Location, SimpleNamespace(found=localised(*given)))


SEEN = [(float(k), 0.0) for k in range(10)]


def test_edges_are_shared_that_lie_at_one_place() -> None:
    one, other = localised(SEEN, -9.0), localised([*SEEN[:4], (50.0, 1)], -9.0)
    assert share_edges(one, other) == pytest.approx(0.4)
    assert share_edges(other, one) == pytest.approx(0.8)
    assert share_edges(localised([], -9.0), one) == 0.0


@pytest.mark.parametrize(
    ("edges", "cost", "verdict", "state"),
    [
        (SEEN, -100.0, "refused", "refused"),
        (SEEN, None, "accepted", "refused"),
        ([(90.0, 90.0)], -100.0, "accepted", "shown"),  # other edges: another object beside it
        (SEEN, -99.9, "accepted", "alike"),
        (SEEN, -40.0, "accepted", "outdone"),
    ],
)
def test_objects_beside_what_is_shown_are_judged_by_their_edges_and_evidence(
    edges: list[tuple[float, float]], cost: float | None, verdict: str, state: str
) -> None:
    shown = location(SEEN, -100.0)
    assert judge(location(edges, cost, verdict), shown, DEFAULTS) == state
    assert judge(shown, shown, DEFAULTS) == "shown"


@pytest.mark.parametrize("state", ["shown", "alike", "outdone", "refused"])
def test_variants_are_alike_within_three_nats_of_the_best(state: str) -> None:
    among = [candidate(k, "it", name) for k, name in enumerate("ABCD")]
    odds = [9.0, 10.0, 6.9]
    variants = [VariantEvidence(0, "it", "ABC"[k], k, False, odds[k], 0, 3, []) for k in range(3)]
    found = judge_variants(Chosen(among[1], cast(Any, None), variants), state, among)
    if state == "refused":
        assert found == {among[1]: "refused"}
    else:
        like = "outdone" if state == "outdone" else "alike"
        assert found == {among[1]: state, among[0]: like, among[2]: "outdone"}


def test_other_objects_that_explain_the_same_make_a_pose_ambiguous() -> None:
    verdict = Verdict("accepted", "enough", 0.99, [], 1.0, 0.1, "x")
    assert doubt(verdict, []) is verdict
    one, two = doubt(verdict, ["a"]), doubt(verdict, ["a", "b"])
    assert (one.verdict, one.reason) == ("ambiguous", "a explains the same edges about as well")
    assert two.missing == ["a and b explain the same edges about as well"]


def presence(*state: int) -> Presence:
    """A part, a feature and a surface in these states."""
    evidence = SimpleNamespace(log_odds=np.zeros((3, 1)))
    none = np.zeros(3)
    items = SimpleNamespace(
        level=["part", "feature", "surface"], path=["a", "b", "c"], feature_no=none, surface_no=none, visible_px=none
    )
    known = {"items": items, "state": np.array(state), "reason": np.zeros(3, int), "evidence": evidence}
    moved = dict.fromkeys(("moved_mm", "moved_sigma_mm", "moved_log_odds", "uncovered_log_odds"), none)
    return cast(Presence, SimpleNamespace(signs=SimpleNamespace(absent=none), **known, **moved))


@pytest.mark.parametrize(
    ("states", "asked", "weighed"),
    [
        ((CONFIRMED, CONFIRMED, CONFIRMED), None, False),
        ((CONFIRMED, UNDECIDABLE, CHANGED), None, False),
        ((CONFIRMED, CHANGED, CONFIRMED), None, True),
        ((CONFIRMED, CHANGED, CONFIRMED), False, False),
        ((CONFIRMED, CONFIRMED, CONFIRMED), True, True),
    ],
)
def test_variants_are_weighed_where_something_is_not_as_modelled(
    states: tuple[int, int, int], asked: bool | None, weighed: bool
) -> None:
    assert is_to_be_weighed(presence(*states), asked) == weighed
