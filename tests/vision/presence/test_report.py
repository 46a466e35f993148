"""What is said first of what is there and what is not, by hand-made assessments."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np

from vision.presence.report import (
    VariantEvidence,
    describe,
    rank,
    rank_failures,
    summarise,
    tabulate_items,
    weigh_variant,
)
from vision.presence.states import CHANGED, CONFIRMED, CONTRADICTED, NOT_CONFIRMED, OF_FEATURE, UNDECIDABLE, Presence

STATES = [CONFIRMED, CHANGED, CHANGED, NOT_CONFIRMED, CONTRADICTED, UNDECIDABLE, CONTRADICTED, CHANGED, NOT_CONFIRMED]
LEVELS = ["part", "feature", "feature", "feature", "feature", "feature", "surface", "part", "feature"]

MEASURED = ("expected_log_odds", "edge_px", "distinct_px", "supported_px")


def presence() -> Presence:
    count = len(STATES)
    log_odds = np.stack([[9.0, -2, -1, -1, -9, 0, -9, 3, -3.0], np.full(count, -0.5)], axis=1)
    known: dict[str, Any] = {
        "items": SimpleNamespace(
            level=LEVELS,
            path=[f"it/{k}" for k in range(count)],
            feature_no=np.zeros(count),
            surface_no=np.zeros(count),
            visible_px=np.ones(count),
        ),
        "state": np.array(STATES),
        "reason": np.where(np.arange(count) == 7, OF_FEATURE, 0),
        "evidence": SimpleNamespace(log_odds=log_odds, **dict.fromkeys(MEASURED, np.ones((count, 2)))),
        "moved_log_odds": np.array([np.nan, 1, 7, np.nan, np.nan, np.nan, np.nan, np.nan, np.nan]),
        "moved_mm": np.array([np.nan, np.nan, -1.25, *[np.nan] * 6]),
        "moved_sigma_mm": np.full(count, 0.125),
        "uncovered_log_odds": np.full(count, np.nan),
        "signs": SimpleNamespace(runs=SimpleNamespace(log_odds=[1.5, 2]), absent=np.zeros(count)),
    }
    return cast(Presence, SimpleNamespace(**known))


def test_failures_are_ranked_by_state_and_then_by_evidence() -> None:
    """Faces are left out, and the part that fails by its features: they stand for it."""
    assert rank_failures(tabulate_items(presence())).tolist() == [4, 2, 1, 8, 3]


def test_each_failure_is_said_in_a_sentence() -> None:
    sizes = [
        (1, "diameter", 8.0, 9.5, 0.1, True),
        (4, "displacement", 0.0, 5.0, 0.5, True),
        (4, "dx", 0.0, 3.0, 0.4, True),
        (4, "dy", 0.0, -4.0, 0.3, True),
        (4, "dz", 0.0, 0.0, 0.3, False),
        (4, "turn", 0.0, 20.0, 2.0, True),
        (3, "thickness", 2.0, 9.0, 9.0, False),
    ]
    names = ["item_no", "what", "nominal", "value", "sigma", "changed"]
    measured = dict(zip(names, map(list, zip(*sizes, strict=True)), strict=True)) | {"unit": ["mm"] * 7}
    more: dict[str, Any] = dict.fromkeys(
        ["u0", "v0", "u1", "v1", "length", "contrast", "image_arc_no", "region_no", "beyond"], [0.0] * 3
    )
    more |= {"kind": ["region", "closed", "region"], "camera": ["left"] * 3}
    tables = {"presence": tabulate_items(presence()), "measured_size": measured, "unexplained": more}
    said = describe({**tables, "presence_camera": {"item_no": []}})
    assert said["look_at"] == ["it/4", "it/2", "it/1", "it/8", "it/3"]
    words = summarise(said)
    assert words[0] == "checked 2 of 2 parts in view: 1 changed, 1 confirmed"
    assert words[1] == "checked 3 of 6 features in view: 1 contradicted, 2 changed, 2 not confirmed, 1 undecidable"
    turned = "turned by 20.0 degrees, sigma 2; its middle lies 5.0 mm from its place, sigma 0.5: 3.0, -4.0, 0.0"
    assert words[2] == f"  it/4: contradicted, {turned} along x, y, z"
    assert words[3] == "  it/2: changed, a face of it lies 1.25 mm in, sigma 0.12"
    assert words[4] == "  it/1: changed, diameter 9.50 mm, not 8, sigma 0.1"
    assert words[5].startswith("  it/8: not confirmed, ")
    assert words[-1] == "2 regions and 1 edge in the pictures that the model does not account for"


def variant(name: str, log_odds: float, differs: list[str], object_no: int = 0) -> VariantEvidence:
    return VariantEvidence(object_no, "it", name, 1, False, log_odds, len(differs), 9, differs)


def test_the_likeliest_variant_comes_first_and_others_by_what_they_alone_have_wrong() -> None:
    given = [
        variant("A", 3.0, ["p", "q"]),
        variant("B", 9.0, ["q", "r"]),
        variant("C", 9.5, ["x"], 1),
        variant("D", 3.0, []),
    ]
    found = rank(given)
    assert [(v.object_no, v.variant) for v in found] == [(0, "B"), (0, "A"), (0, "D"), (1, "C")]
    assert [v.distinguished_by for v in found] == [[], ["p"], [], []]
    assert [v.against for v in found] == [2, 2, 0, 1]


def test_a_variant_is_weighed_by_all_its_edges() -> None:
    row = {"object_no": 2, "name": "it", "variant": "B", "object_variant_id": 7, "placed": True}
    found = weigh_variant(row, presence())
    assert (found.log_odds, found.against, found.decided, found.placed) == (3.5, 5, 7, True)
    assert found.distinguished_by == ["it/4", "it/2", "it/1", "it/8", "it/3"]
