"""What there is of the object doubts its pose: hand-made edges, each group of them taken away in turn."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import cast
from unittest import mock

import numpy as np
import pytest

from tests.vision.presence.test_states import Edge, decided, moved, signs
from vision.cameras.cameras import Needs
from vision.inspection.against import shows_another
from vision.inspection.inspection import doubt_presence
from vision.inspection.inspection_parameters import DEFAULTS
from vision.localisation.verdict import Verdict
from vision.presence.report import VariantEvidence
from vision.presence.states import Presence
from vision.scene import StoredScene

STORED = cast(
    StoredScene,
    SimpleNamespace(
        scene=SimpleNamespace(surface_occurrence=np.array([0, 0, 0, 1, 1])),
        name_surface=lambda surface: f"face {surface}",
    ),
)
SHOWN: list[Edge] = [((0, 1), 200, 200, 0.9, 6.0, 6), ((1, 1), 200, 200, 0.9, 6.0, 6), ((0, 0), 200, 200, 0.9, 6.0, 6)]
ACCEPTED = Verdict("accepted", "it fits", 0.99, [], 0.1, 0.001, "x")


def doubted(it: Presence, needs_mm: float = 3.0) -> Verdict:
    return doubt_presence(ACCEPTED, STORED, it, Needs(needs_mm, 0.01), DEFAULTS)


@pytest.mark.parametrize(
    ("missing", "verdict"),
    [
        (((1, 0), 90, 90, 0.0, 6.0, 6), "accepted"),  # it shows
        (((1, -1), 90, 90, 0.0, -5.0, 6), "refused"),  # an edge of the body
        (((0, 2), 90, 90, 0.0, -9.0, 9), "accepted"),  # the rim of a hole, which is told missing
        (((3, 4), 90, 90, 0.0, -9.0, 9), "accepted"),  # a part that is told missing
    ],
)
def test_edges_of_what_holds_the_pose_refuse_it(missing: Edge, verdict: str) -> None:
    """However much else is found; with the three others alone the pose is accepted."""
    assert doubted(decided(signs(*SHOWN))).verdict == "accepted"
    it = doubted(decided(signs(*SHOWN, missing)))
    assert it.verdict == verdict
    if verdict == "refused":
        assert it.reason.endswith("most of all 90 px of face 1 in the picture of 0")


@pytest.mark.parametrize(("needs_mm", "verdict"), [(1.4, "ambiguous"), (1.6, "accepted")])
def test_a_face_that_moved_farther_than_is_needed_may_hold_the_pose(needs_mm: float, verdict: str) -> None:
    """It lies 1.5 mm from its place, and nothing else is measured along its normal; its own edges say no more."""
    it = signs(*SHOWN, ((0, -1), 90, 90, 0.0, -9.0, 9))
    faces = replace(it.surfaces, normal=np.tile([0.0, 0, 1], (5, 1)))
    found = doubted(decided(moved(replace(it, surfaces=faces))), needs_mm)
    assert found.verdict == verdict
    assert found.weighed.get("rival_face_mm", 0.0) == (1.5 if verdict == "ambiguous" else 0.0)


@pytest.mark.parametrize(("mm", "verdict"), [(0.17, "accepted"), (0.2, "refused")])
@mock.patch("vision.presence.surfaces.LEAST_FACES", 3)
def test_faces_that_lie_off_together_are_of_another_object(mm: float, verdict: str) -> None:
    """As if three were enough, two of them that far."""
    it, mm_of = signs(*SHOWN), np.array([mm, -mm, 0.3, np.nan, np.nan])
    found = doubted(decided(replace(it, surfaces=replace(it.surfaces, mm=mm_of, sigma=np.full(5, 0.1)))))
    assert found.verdict == verdict
    assert found.weighed["faces_off"] == pytest.approx(10 * mm)


@pytest.mark.parametrize(
    ("web", "hole", "kind", "odds"),
    [
        (0, 0, "web", -0.8), (2, 0, "web", 1.6), (0, 1, "web", 1.6), (2, 4, "web", 2.0), (3, 3, "web", 3.0),
        (3, 2, "web", 3.5), (1, 2, "web", 4.0), (1, 2, "grid_pattern", 2.0),
    ],
)  # fmt: skip
def test_features_told_otherwise_are_of_another_object(web: int, hole: int, kind: str, odds: float) -> None:
    """Of parts that hold the pose, one confirmed (0), contradicted, changed, in doubt or undecidable each."""
    it = decided(signs(*SHOWN))
    it = replace(it, state=np.array([0, web, hole, 0, 0]), items=replace(it.items, kind=["", kind, "", "", ""]))
    assert it.weigh_features(np.array([0]))[0] == pytest.approx(odds)
    assert it.weigh_features(np.array([1]))[0] == 0.0
    assert (doubted(it).verdict == "refused") == (odds > 3.0)


@pytest.mark.parametrize(("odds", "another"), [((2.0, 4.9), False), ((2.0, 5.0), True), ((5.0, 2.0), False)])
def test_another_variant_is_shown_from_three_nats_on(odds: tuple[float, float], another: bool) -> None:
    given = [VariantEvidence(0, "it", "AB"[k], k, k == 0, odds[k], 0, 3, []) for k in range(2)]
    assert shows_another(given) == another
