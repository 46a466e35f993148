"""When variants are weighed, and what is said of them."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from vision.inspection.variants import is_to_be_weighed
from vision.presence.states import CHANGED, CONFIRMED, UNDECIDABLE, Presence
from vision.presence.variants import VariantEvidence, rank, tell_variants


def presence(*state: int) -> Presence:
    """A part, a feature and a surface in these states."""
    evidence = SimpleNamespace(log_odds=np.zeros((3, 1)))
    items = SimpleNamespace(level=["part", "feature", "surface"])
    known = SimpleNamespace(items=items, state=np.array(state), evidence=evidence, moved_log_odds=np.zeros(3))
    return cast(Presence, known)


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


def variant(name: str, log_odds: float, against: int, placed: bool = False) -> VariantEvidence:
    return VariantEvidence(0, "bulkhead", name, 1, placed, log_odds, against, 90)


def test_the_variant_that_explains_the_pictures_is_named() -> None:
    (words,) = tell_variants(rank([variant("A", 10.0, 12, placed=True), variant("B", 60.0, 1), variant("C", 40.0, 5)]))
    assert "variant B of bulkhead, not A" in words
    assert all(said in words for said in ("50 nats", "1 of 90", "12 of 90"))


def test_variants_that_the_pictures_do_not_tell_apart_are_said_to_be_such() -> None:
    (words,) = tell_variants(rank([variant("A", 58.0, 1, placed=True), variant("B", 60.0, 1), variant("C", 40.0, 5)]))
    assert "do not tell from A" in words
