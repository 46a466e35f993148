"""When variants are weighed."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from vision.inspection.against import is_to_be_weighed
from vision.presence.states import CHANGED, CONFIRMED, UNDECIDABLE, Presence


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
