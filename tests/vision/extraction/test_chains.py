"""Chains, gaps and false alarms against loops over all elements."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import map_coordinates
from scipy.stats import chi2

from relmodel.arrays import Floats
from tests.vision.extraction.synthetic import step
from vision.extraction.chains import (
    Chains,
    compute_false_alarm_terms,
    compute_significance,
    fill_gaps,
    interpolate_grey,
    link,
    select_significant,
)
from vision.extraction.edges import EdgeElements, detect_edges
from vision.extraction.extract import extract
from vision.extraction.extraction_parameters import LinkingParameters, SignificanceParameters

P, S = LinkingParameters(), SignificanceParameters()


def elements(place: Floats, turn: Floats, contrast: Floats, columns: int) -> EdgeElements:
    """Edge elements whose tangents point so, the bright side on the left."""
    none = np.ones(len(place))
    pixel = np.rint(place).astype(np.int32)
    return EdgeElements(
        x=place[:, 0], y=place[:, 1], nx=np.sin(turn), ny=-np.cos(turn), contrast=contrast, width=none,
        sigma=0.1 * none, pixel=pixel[:, 1] * columns + pixel[:, 0],
    )  # fmt: skip


def bilinear(grey: Floats, x: float, y: float) -> float:
    x, y = min(max(x, 0), grey.shape[1] - 1), min(max(y, 0), grey.shape[0] - 1)
    c, r = min(int(x), grey.shape[1] - 2), min(int(y), grey.shape[0] - 2)
    u, v = x - c, y - r
    corner = grey[r : r + 2, c : c + 2]
    return float([1 - v, v] @ corner @ [1 - u, u])


@pytest.mark.parametrize("seed", range(2))
def test_gaps_are_filled_cheapest_first_as_loops_over_all_ends_do(seed: int) -> None:
    rng = np.random.default_rng(seed)
    grey = rng.uniform(90, 130, (60, 80))
    grey[:30] += 60
    place, turn = [], []
    offsets = [0]
    for _ in range(26):
        count, way = int(rng.integers(3, 13)), rng.normal(0, 0.25) + np.pi * (rng.random() < 0.7)
        begin, bend = rng.uniform([4, 24], [74, 36]), rng.normal(0, 0.02)
        heading = way + bend * np.arange(count)
        place.append(begin + np.cumsum(np.column_stack([np.cos(heading), np.sin(heading)]), axis=0))
        turn.append(heading)
        offsets.append(offsets[-1] + count)
    ring = 0.5 * np.arange(12)
    place.append(np.array([10.0, 50]) + 3 * np.column_stack([np.cos(ring), np.sin(ring)]))
    turn.append(ring + np.pi / 2)
    place.append(np.array([40.0, 50]) + 2 * np.column_stack([np.cos(ring), np.sin(ring)]))
    turn.append(ring + np.pi / 2)
    offsets += [offsets[-1] + 12, offsets[-1] + 24]
    whole = np.concatenate(place)
    edges = elements(whole.clip(0, [79, 59]), np.concatenate(turn), rng.uniform(10, 80, len(whole)), 80)
    closed = np.arange(28) == 26
    chains = Chains(np.arange(len(whole), dtype=np.int32), np.array(offsets, np.int32), closed)
    found = fill_gaps(edges, chains, grey, P)
    offers = []
    for a in np.flatnonzero(~closed).tolist():
        for b in np.flatnonzero(~closed).tolist():
            last, first = offsets[a + 1] - 1, offsets[b]
            gap = np.array([edges.x[first] - edges.x[last], edges.y[first] - edges.y[last]])
            d = np.linalg.norm(gap)
            if d > P.fill_reach or (a == b and offsets[a + 1] - offsets[a] < P.min_loop_elements):
                continue
            chord, angles = gap / max(d, 1e-9), []
            ends = (range(max(last - P.tangent_elements + 1, offsets[a]), last + 1),
                    range(first, min(first + P.tangent_elements, offsets[b + 1])))  # fmt: skip
            for own in ends:
                mean = np.array([[-edges.ny[i], edges.nx[i]] for i in own]).sum(axis=0)
                angles.append(float(np.arccos(np.clip(chord @ mean / np.linalg.norm(mean), -1, 1))))
            near = d <= P.near_reach
            if max(angles) >= (max(P.near_angle, P.fill_angle) if near else P.fill_angle):
                continue
            left = P.support_distance * np.array([chord[1], -chord[0]])
            heights = []
            for share in np.linspace(0.1, 0.9, P.support_samples):
                at = np.array([edges.x[last], edges.y[last]]) + share * gap
                heights.append(bilinear(grey, *(at + left)) - bilinear(grey, *(at - left)))
            lesser = min(edges.contrast[last], edges.contrast[first])
            if near or np.mean(heights) >= P.min_support * lesser:
                offers.append((d * (1 + P.bend_price * sum(angles)), a, b))
    follows: dict[int, int] = {}
    for _, a, b in sorted(offers):
        if a not in follows and b not in follows.values():
            follows[a] = b
    heads = [c for c in range(28) if not closed[c] and c not in follows.values()]
    strung = []
    for head in heads:
        strung.append([head])
        while strung[-1][-1] in follows:
            strung[-1].append(follows[strung[-1][-1]])
    rest = sorted(set(range(28)) - {c for line in strung for c in line} - {26})
    loops = []
    while rest:
        loops.append([rest[0]])
        while follows[loops[-1][-1]] != rest[0]:
            loops[-1].append(follows[loops[-1][-1]])
        rest = [c for c in rest if c not in loops[-1]]
    expected = [[i for c in line for i in range(offsets[c], offsets[c + 1])] for line in [*strung, *loops, [26]]]
    assert [line.tolist() for line in np.split(found.elements, found.offsets[1:-1])] == expected
    assert found.closed.tolist() == [False] * len(strung) + [True] * (len(loops) + 1)
    assert len(follows) > 2


def test_elements_follow_where_each_is_the_best_of_the_other() -> None:
    """A line, two of which are too faint, and a ring."""
    t = np.arange(40) * 2 * np.pi / 40
    place = np.vstack([np.column_stack([np.arange(5, 30), np.full(25, 8.0)]),
                       40 + 6.4 * np.column_stack([np.cos(t), np.sin(t)])])  # fmt: skip
    turn = np.concatenate([np.zeros(25), t + np.pi / 2])
    order = np.argsort(np.rint(place[:, 1]) * 60 + np.rint(place[:, 0]), kind="stable")
    contrast = np.where(np.isin(place[order, 0], (17, 18)), 4.0, 20.0)
    found = link(elements(place[order], turn[order], contrast, 60), (60, 60), P, min_contrast=5.0)
    assert found.closed.tolist() == [False, False, True]
    assert found.counts.tolist()[:2] == [12, 11]
    assert (np.diff(place[order][found.elements[:12], 0]) == 1).all()


def test_false_alarms_are_the_share_of_steps_as_high_around() -> None:
    rng = np.random.default_rng(5)
    grey = rng.uniform(60, 160, (70, 90)).cumsum(axis=1) % 180
    place = rng.uniform([2, 2], [87, 67], (30, 2))
    edges = elements(place, rng.uniform(-np.pi, np.pi, 30), np.full(30, 9.0), 90)
    which = np.arange(0, 30, 2)
    found = compute_false_alarm_terms(grey, edges, which, S)
    assert not found[1::2].any()

    def grade_of(height: float) -> int:
        return 0 if height < 1 else int(1 + S.grades_per_octave * np.log2(height))

    for i in which:
        steps = [
            bilinear(grey, place[i, 0] + d * edges.nx[i], place[i, 1] + d * edges.ny[i])
            for d in (S.step_px, -S.step_px)
        ]
        level = grade_of(int(np.clip(steps[0] - steps[1], 0, 255)))
        angle = np.arctan2(edges.ny[i], edges.nx[i]) * S.orientations / np.pi
        turn = int(np.floor(angle + S.orientations + 0.5)) % S.orientations
        way = turn * np.pi / S.orientations
        dr, dc = int(np.rint(S.step_px * np.sin(way))), int(np.rint(S.step_px * np.cos(way)))
        row, column = (int(v) // S.cell for v in divmod(int(edges.pixel[i]), 90))
        half, counts = S.cells_around // 2, []
        for r in range(0, 70):
            for c in range(0, 90):
                inside = min(r - abs(dr), c - abs(dc), 69 - r - abs(dr), 89 - c - abs(dc)) >= 0
                if inside and max(abs(r // S.cell - row), abs(c // S.cell - column)) <= half:
                    counts.append((r, c, grade_of(int(abs(grey[r + dr, c + dc] - grey[r - dr, c - dc])))))
        share = np.mean([g >= level for _, _, g in counts])
        heights = [h for h in range(256) if grade_of(h) >= level]
        bound = np.exp(-heights[0] / S.mean_step)
        assert found[i] == pytest.approx(-np.log(0.5 * min(max(share, 1 / len(counts)), bound)), abs=0.25)


def test_arcs_stay_that_are_significant_or_of_a_chain_that_is() -> None:
    terms = np.concatenate([np.full(60, 4.0), np.full(30, 0.7), np.full(40, 0.7)])
    lines = Chains(np.arange(130, dtype=np.int32), np.array([0, 60, 90, 130], np.int32), np.zeros(3, bool))
    significance = compute_significance(terms, lines, S)
    assert (significance >= S.min_significance).tolist() == [True, False, False]
    arcs = Chains(np.array([58, 59, 61, 62, 91, 92], np.int32), np.array([0, 2, 4, 6], np.int32), np.zeros(3, bool))
    kept, of = select_significant(terms, arcs, lines, S)
    assert kept.tolist() == [True, False, False]
    assert of.tolist() == [True, False, False]


def test_grey_between_pixels_is_bilinear() -> None:
    rng = np.random.default_rng(0)
    grey, place = rng.uniform(0, 255, (20, 30)), rng.uniform(-5, 35, (7, 50, 2))
    true = map_coordinates(grey, [place[..., 1], place[..., 0]], order=1, mode="nearest")
    assert interpolate_grey(grey, place) == pytest.approx(true, abs=1e-9)


def test_noise_alone_gives_no_more_arcs_than_its_number_of_false_alarms() -> None:
    image = 128 + np.random.default_rng(0).normal(0, 12, (512, 512))
    found = extract(image).arcs
    expected = 10.0**1.5 * image.size / 1e6
    assert len(found) <= expected


def test_significance_joins_tails_as_fisher_does() -> None:
    image = step(0.3, 0.0, (96, 96))
    edges = detect_edges(image)
    chains = link(edges, image.shape)
    terms = np.linspace(0.5, 3.0, len(edges))
    observations = 1 + chains.counts / 20
    by_hand = chi2.sf(2 * observations * chains.mean(terms), 2 * observations)
    assert np.allclose(compute_significance(terms, chains), -np.log10(1000 * by_hand))
