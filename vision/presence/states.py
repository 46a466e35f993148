"""The state of each part, feature and surface, in our words and QIF's, and what it rests on."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from relmodel.arrays import Bools, Floats, Ints
from vision.presence.appearance import Appearance
from vision.presence.displaced_parts import Displacements, report_displacements
from vision.presence.distances import Distances
from vision.presence.items import Items
from vision.presence.measures import DISPLACED, Measures, find_moved, join, measure_items
from vision.presence.presence_parameters import StateParameters
from vision.presence.regions import RegionSupport
from vision.presence.stretches import Runs, sum_in_one_light
from vision.presence.surfaces import Surfaces
from vision.presence.unexplained import Unexplained

STATES = ("confirmed", "contradicted", "changed", "not_confirmed", "undecidable")
CONFIRMED, CONTRADICTED, CHANGED, NOT_CONFIRMED, UNDECIDABLE = range(5)
QIF = ("PASS", "FAIL", "FAIL", "INDETERMINATE", "NOT_ANALYZED")
REASONS = (
    "its edges are found",
    "its edges are not found, where they would show",
    "its edges are found displaced",
    "its size differs from the model's",
    "no sharp edge of it is in view",
    "its edges are too short in the picture",
    "its edges lie too near to others or to the picture's border",
    "little contrast is expected of its edges",
    "some of its edges are found, some are not",
    "a region of the picture is it",
    "something else shows through it than lies behind",
    "none of its edges is found, which so few may hide",
    "its edges are found, which may be chance",
    "a feature of it is not as modelled",
)
(
    FOUND, MISSING, SHIFTED, RESIZED, NO_EDGE, SHORT, CROWDED, FAINT, DIVIDED, REGION, STOPPED, NONE, BY_CHANCE,
    OF_FEATURE,
) = range(len(REASONS))  # fmt: skip


@dataclass(frozen=True)
class Evidence:
    """Evidence for items, by camera (n, c): px of edges in view, of them px that can be distinguished from others, of
    those px supported; log_odds: of there against not there; expected: what they would be in the mean, were it there;
    region_px: what regions of the picture cover of its surfaces, px."""

    edge_px: Floats
    distinct_px: Floats
    supported_px: Floats
    log_odds: Floats
    expected: Floats
    region_px: Floats


@dataclass(frozen=True)
class Presence:
    """What is there and what is not, a row an item.

    state, reason: index of STATES and of REASONS.  moved_mm, moved_sigma_mm: how far the surface of it that has moved
    most surely lies from its place, nan where none has; moved_log_odds: of that.  cameras: names, as the evidence
    counts them.  runs: the predicted edges that all rests on.
    """

    items: Items
    runs: Runs
    cameras: list[str]
    evidence: Evidence
    state: NDArray[np.int8]
    reason: NDArray[np.int8]
    moved_mm: Floats
    moved_sigma_mm: Floats
    moved_log_odds: Floats
    measures: Measures
    distances: Distances
    appearance: Appearance
    unexplained: Unexplained


@dataclass(frozen=True, kw_only=True)
class Signs:
    """What speaks for and against items: the predicted edges, what their surfaces and the regions on them show, how
    they look, how far parts and features stand from their places and from each other, and what nothing predicts."""

    runs: Runs
    surfaces: Surfaces
    regions: RegionSupport
    appearance: Appearance
    displacements: Displacements
    distances: Distances
    unexplained: Unexplained


def decide(items: Items, radius: Floats, signs: Signs, cameras: list[str], p: StateParameters) -> Presence:
    """States of items by the signs of them; radius (s,): of the scene's cylinders, nan for others."""
    runs, surfaces, appearance = signs.runs, signs.surfaces, signs.appearance
    evidence = gather_evidence(items, runs, len(cameras))
    evidence, by_region = _add_regions(evidence, items, signs.regions, p)
    np.add.at(evidence.log_odds, (appearance.item, appearance.camera), appearance.log_odds)
    displaced = report_displacements(items, signs.displacements, p)
    moved = find_moved(items, surfaces, evidence.distinct_px.sum(axis=1), p.least_moved_share)
    measures = join(measure_items(items, radius, surfaces, moved, p), displaced)
    most_moved = _most_moved(items, surfaces, moved)
    total, expected = evidence.log_odds.sum(axis=1), evidence.expected.sum(axis=1)
    edge, distinct = evidence.edge_px.sum(axis=1), evidence.distinct_px.sum(axis=1)
    share = evidence.supported_px.sum(axis=1) / np.maximum(distinct, 1e-9)
    changed, resized = np.zeros((2, len(items)), bool)
    changed[measures.item[measures.changed]] = True
    resized[measures.item[measures.changed & ~np.isin(measures.what, ("offset", *DISPLACED))]] = True

    state = np.full(len(items), UNDECIDABLE, np.int8)
    reason = np.where(share <= 0, NONE, np.where(share >= 1 - 1e-9, BY_CHANCE, DIVIDED)).astype(np.int8)
    reason[expected < p.least_expected] = FAINT

    def settle(where: Bools, new_state: int, new_reason: int) -> None:
        state[where], reason[where] = new_state, new_reason

    unlikely = total <= -p.least_log_odds
    settle(unlikely & (expected >= p.least_expected), NOT_CONFIRMED, MISSING)
    gone = (total <= -p.contradicted_log_odds) & (expected >= p.contradicted_expected) & (share <= p.contradicted_share)
    settle(gone, CONTRADICTED, MISSING)
    settle(total >= p.least_log_odds, CONFIRMED, FOUND)
    settle(changed, CHANGED, SHIFTED)
    settle(resized, CHANGED, RESIZED)
    few = (distinct < p.least_px) & ~by_region
    settle(by_region & (state == CONFIRMED) & (share < p.mostly), CONFIRMED, REGION)
    settle(few, UNDECIDABLE, SHORT)
    settle(few & (edge >= p.least_px), UNDECIDABLE, CROWDED)
    settle(edge <= 0, UNDECIDABLE, NO_EDGE)
    stopped = np.zeros(len(items), bool)
    stopped[appearance.item[appearance.stopped]] = True
    settle(stopped & (state != CONTRADICTED), CONTRADICTED, STOPPED)
    # No part passes with a feature that fails.
    failing = (np.array(items.level) == "feature") & np.isin(state, (CHANGED, CONTRADICTED))
    with_failing = (np.array(items.level) == "part") & np.isin(items.occurrence, items.occurrence[failing])
    settle(with_failing & ~np.isin(state, (CHANGED, CONTRADICTED)), CHANGED, OF_FEATURE)
    # No size of an undecidable item counts as changed.
    measures = replace(measures, changed=measures.changed & (state[measures.item] != UNDECIDABLE))
    moved_mm, moved_sigma_mm, moved_log_odds = most_moved
    return Presence(
        items=items,
        runs=runs,
        cameras=cameras,
        evidence=evidence,
        state=state,
        reason=reason,
        moved_mm=moved_mm,
        moved_sigma_mm=moved_sigma_mm,
        moved_log_odds=moved_log_odds,
        measures=measures,
        distances=signs.distances,
        appearance=appearance,
        unexplained=signs.unexplained,
    )


def gather_evidence(items: Items, runs: Runs, cameras: int) -> Evidence:
    """Sums over the edges of all surfaces of each item, each edge once.

    The edges of a hole, a boss or a duct in a face speak for the face where they are found.  Where they are not found
    they say nothing of the face, which may be there without them.  Where edges of an item do not show, others of it
    hide with them: the log odds of all are those in one light, averaged over lights.
    """
    item, run, lent = pair_with_runs(items, runs.surface)
    distinct = ~lent | (runs.log_odds[run] > 0)
    item, run, lent = item[distinct], run[distinct], lent[distinct]
    at, size = item * cameras + runs.camera[run], len(items) * cameras

    def total(values: Floats) -> Floats:
        return np.bincount(at, values, size).reshape(len(items), cameras).astype(float)

    return Evidence(
        total(runs.visible_px[run]),
        total(runs.weight_px[run]),
        total(runs.weight_px[run] * runs.found[run]),
        sum_in_one_light(at, runs.in_light[run], size).reshape(len(items), cameras),
        total(np.where(lent, 0.0, runs.expected[run])),
        np.zeros((len(items), cameras)),
    )


def _add_regions(
    evidence: Evidence, items: Items, regions: RegionSupport, p: StateParameters
) -> tuple[Evidence, Bools]:
    """The evidence with that of regions, and which items have such: surfaces most of whose visible area some camera
    shows as regions that lie only on them.  Only the camera that shows most of a surface counts."""
    count = len(items)
    covered, shown = (
        np.stack([np.bincount(items.member, column[items.surface], count).astype(float) for column in values.T], axis=1)
        for values in (regions.covered, regions.shown)
    )
    share = np.minimum(covered / np.maximum(shown, 1e-9), 1.0)
    best = np.argmax(share, axis=1)
    surface = np.array([level == "surface" for level in items.level], bool)
    distinct = surface & (share.max(axis=1, initial=0.0) >= p.region_share)
    log_odds = evidence.log_odds.copy()
    log_odds[distinct, best[distinct]] += p.region_log_odds
    return replace(evidence, log_odds=log_odds, region_px=covered), distinct


def pair_with_runs(items: Items, sides: Ints) -> tuple[Ints, Ints, Bools]:
    """Each item with the runs that are edges of its surfaces, by the surfaces (r, 2) on their sides, sorted, each pair
    once; and whether the edge is lent: of a hole, a boss or a duct in the item that does not belong to it.  All edges
    are a part's own."""
    order = np.argsort(items.surface, kind="stable")
    surface, item = items.surface[order], items.member[order]
    pairs = []
    for side in (0, 1):
        rows = np.flatnonzero(sides[:, side] >= 0)
        low, high = (np.searchsorted(surface, sides[rows, side], side=s) for s in ("left", "right"))
        length = high - low
        of = np.repeat(rows, length)
        at = np.arange(len(of)) - np.repeat(np.cumsum(length) - length, length) + np.repeat(low, length)
        pairs.append(item[at] * len(sides) + of)
    item, run = np.divmod(np.unique(np.concatenate(pairs)), max(len(sides), 1))
    part = np.array([level == "part" for level in items.level], bool)
    count = len(items.inset)
    own = np.unique(items.member * count + items.surface)
    lent = np.zeros(len(item), bool)
    for side in (0, 1):
        surface = sides[run, side]
        inset = (surface >= 0) & items.inset[surface]
        lent |= inset & ~part[item] & ~np.isin(item * count + surface, own)
    return item, run, lent


def _most_moved(items: Items, surfaces: Surfaces, moved: Bools) -> tuple[Floats, Floats, Floats]:
    """Of each item that of its faces which has moved most surely: mm, sigma and log odds (n,), nan where none has."""
    rows = np.flatnonzero(moved)
    order = rows[np.lexsort((surfaces.log_odds[items.surface[rows]], items.member[rows]))]
    out = np.full((3, len(items)), np.nan)
    # The last of each item is the surest.
    out[:, items.member[order]] = np.stack([surfaces.mm, surfaces.sigma, surfaces.log_odds])[:, items.surface[order]]
    return out[0], out[1], out[2]
