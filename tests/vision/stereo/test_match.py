"""The matcher on arcs with known partners, and its prices against loops."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.vision.stereo.scenes import packed, parallel_rig, picture_of, random_pair
from vision.extraction.arcs import LINE
from vision.extraction.rows import RegionColumns
from vision.stereo.epipolar import DisparityRange, RowArcs, StereoArcs, Votes, estimate_range, lay_out, rectify, vote
from vision.stereo.match import StereoMatches, match_pictures
from vision.stereo.stereo_parameters import DEFAULTS


def match_arcs(left: StereoArcs, right: StereoArcs) -> StereoMatches:
    return match_pictures(parallel_rig(), picture_of(left), picture_of(right))


@pytest.mark.parametrize("seed", range(2))
def test_partners_are_found_and_the_labelling_is_proved(seed: int) -> None:
    """One in five lies beyond the disparities that the others have: of them nearly all are found, and no others."""
    left, right, partner = random_pair(seed)
    found = match_arcs(left, right)
    made = found.arc_label >= 0
    good = made & (found.arc_label == partner)
    assert good.sum() >= 0.93 * np.sum(np.arange(len(left)) % 5 > 0)
    assert good.sum() >= 0.95 * made.sum()
    result = found.solved.result
    assert (result.status, result.cost) == ("optimal", result.bound)


def test_pictures_without_arcs_are_matched_to_nothing() -> None:
    nothing = np.zeros(0)
    empty = StereoArcs(np.zeros(1, np.int64), np.zeros((0, 2)), nothing, nothing.astype(np.int64), nothing, nothing)
    left, right, _ = random_pair(1, 5, 0)
    for one, other in ((left, empty), (empty, right)):
        found = match_arcs(one, other)
        assert np.all(found.arc_label == -1)
        assert len(found.triangulated.first) == 0


def test_equal_input_gives_equal_rows() -> None:
    a, b = (match_arcs(*random_pair(5)[:2]) for _ in range(2))
    np.testing.assert_array_equal(a.solved.result.label, b.solved.result.label)
    np.testing.assert_array_equal(a.triangulated.covariance, b.triangulated.covariance)


def ends_apart(first: RowArcs, i: int, second: RowArcs, j: int) -> float:
    apart = np.abs(first.box[i] - second.box[j])
    return float(np.log(1 + min(apart[1], apart[3])))


def prices_across(first: RowArcs, second: RowArcs, seen: DisparityRange, votes: Votes) -> dict[tuple[int, int], float]:
    """Arcs of three rows and more: by the rows on which they are alike, their votes, widths and ends."""
    a, b = first.crossings, second.crossings
    voted = {(i, j): n for i, j, n in zip(votes.first, votes.second, votes.votes, strict=True)}
    out = {}
    for i, j in np.ndindex(len(first.arcs), len(second.arcs)):
        mine, theirs = np.flatnonzero(a.arc == i)[:, None], np.flatnonzero(b.arc == j)[None]
        d, bounds = a.x[mine] - b.x[theirs], seen.of_crossings[mine]
        steps = np.arcsinh(a.contrast[mine] / 8) - np.arcsinh(b.contrast[theirs] / 8)
        unlike = ((a.angle[mine] - b.angle[theirs]) / 0.25) ** 2 + (steps / 0.7) ** 2
        inside = (d >= bounds[..., 0]) & (d <= bounds[..., 1]) & (a.row[mine] == b.row[theirs])
        alike, rows = np.sum(inside & (unlike <= 8.0)), sorted((mine.size, theirs.size))
        if alike >= max(3, 0.3 * rows[0]):
            share = [min(voted.get((i, j), 0) / n, 1) for n in rows]
            width = abs(first.arcs.width[i] - second.arcs.width[j])
            out[i, j] = 3.3 * (1 - share[0]) + 1.7 * (1 - share[1]) + 1.3 * width
            out[i, j] += 0.4 * ends_apart(first, i, second, j)
    return out


def prices_level(first: RowArcs, second: RowArcs, seen: DisparityRange) -> dict[tuple[int, int], float]:
    """Arcs of fewer rows: those on much the same rows and moved by what may be, by contrast, length, width and ends."""
    out = {}
    for i, j in np.ndindex(len(first.arcs), len(second.arcs)):
        if max(first.extent[i], second.extent[j]) >= 3:
            continue
        a, b = first.box[i], second.box[j]
        moved, slack = (a[0] + a[2]) / 2 - (b[0] + b[2]) / 2, abs((a[2] - a[0]) - (b[2] - b[0])) / 2
        rows = abs((a[1] + a[3]) / 2 - (b[1] + b[3]) / 2) - ((a[3] - a[1]) + (b[3] - b[1])) / 2
        low, high = seen.of_arcs[i]
        steps, length = [], []
        for side, k in ((first, i), (second, j)):
            line = slice(*side.arcs.offsets[k : k + 2])
            way = np.sign(side.points[line][-1, 0] - side.points[line][0, 0])
            steps.append(np.arcsinh(way * side.arcs.contrast[line].mean() / 8))
            length.append(line.stop - line.start)
        unlike = ((steps[0] - steps[1]) / 0.7) ** 2
        if rows <= 3 and moved + slack >= low and moved - slack <= high and unlike <= 8:
            width = abs(first.arcs.width[i] - second.arcs.width[j])
            out[i, j] = 0.5 * unlike + 0.65 * abs(np.log(length[0] / length[1])) + 1.7 * width
            out[i, j] += 2.3 * ends_apart(first, i, second, j) - 0.3
    return out


def boxes_of(arcs: StereoArcs, rng: np.random.Generator, move: float) -> RegionColumns:
    """Rectangles, every other with a hole, moved to the left, with some of the arcs about each."""
    count = 12
    low = np.random.default_rng(0).uniform([350, 100], [1000, 800], (count, 2)) - [move, 0]
    low, size = np.rint(low + rng.normal(0, 9, low.shape)), np.rint(rng.uniform(20, 60, (count, 2)))
    corner = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    owner = np.repeat(np.arange(count), 1 + np.arange(count) % 2)
    hole = np.diff(owner, prepend=-1) == 0
    inner = 0.25 + 0.5 * corner
    rings = [low[k] + size[k] * (inner if within else corner) for k, within in zip(owner, hole, strict=True)]
    border = rng.integers(0, (count, len(arcs)), (90, 2)) if len(arcs) else np.zeros((0, 2), np.int64)
    none = dict.fromkeys(("x0", "y0", "x1", "y1", "variance", "saturated_share"), np.zeros(count))
    return RegionColumns(
        area=size.prod(axis=1), centroid_x=low[:, 0] + size[:, 0] / 2, centroid_y=low[:, 1] + size[:, 1] / 2,
        mean=rng.uniform(40, 200, count), ring_region=owner, ring_offsets=4 * np.arange(len(rings) + 1),
        outline=np.rint(np.concatenate(rings)).astype(np.int64), border_region=border[:, 0], border_arc=border[:, 1],
        border_length=np.ones(len(border)), **none,
    )  # fmt: skip


def prices_of_regions(
    one: RegionColumns, other: RegionColumns, seen: DisparityRange, votes: Votes
) -> dict[tuple[int, int], float]:
    """Regions that share half of their rows and are moved as the arcs about the first may be."""
    out = {}
    rows = [[r.outline[np.repeat(r.ring_region, 4) == k, 1] for k in range(len(r))] for r in (one, other)]
    about = [[set(r.border_arc[r.border_region == k].tolist()) for k in range(len(r))] for r in (one, other)]
    cast = list(zip(votes.first.tolist(), votes.second.tolist(), votes.votes.tolist(), strict=True))
    for i, j in np.ndindex(len(one), len(other)):
        a, b = rows[0][i], rows[1][j]
        share = (min(a.max(), b.max()) - max(a.min(), b.min())) / (max(a.max(), b.max()) - min(a.min(), b.min()))
        moved, bounds = one.centroid_x[i] - other.centroid_x[j], seen.of_arcs[sorted(about[0][i])]
        if share < 0.5 or not bounds[:, 0].min() <= moved <= bounds[:, 1].max():
            continue
        voted = sum(n for p, q, n in cast if p in about[0][i] and q in about[1][j])
        fewer, more = sorted(
            (sum(n for p, _, n in cast if p in about[0][i]), sum(n for _, q, n in cast if q in about[1][j]))
        )
        out[i, j] = 4.6 * (1 - share) + 2.3 * abs(np.log(one.area[i] / other.area[j]))
        out[i, j] += 0.03 * abs(one.mean[i] - other.mean[j])
        out[i, j] += 2.5 * (1 - voted / max(fewer, 1)) + 1.5 * (1 - voted / max(more, 1))
    return out


@pytest.mark.parametrize(("seed", "method"), [(0, "pong"), (1, "relational")])
def test_candidates_are_priced_as_loops_over_all_pairs_price_them(seed: int, method: str) -> None:
    rng = np.random.default_rng(seed)
    left, right, _ = random_pair(seed)
    regions = boxes_of(left, rng, 0.0), boxes_of(right, rng, 250.0)
    pictures = [replace(picture_of(arcs), regions=own) for arcs, own in zip((left, right), regions, strict=True)]
    rectification = rectify(parallel_rig())
    sides = lay_out(rectification, left, right, DEFAULTS.epipolar)
    wide = replace(
        DEFAULTS,
        method=method,
        range=replace(DEFAULTS.range, margin=400.0),
        assignment=replace(DEFAULTS.assignment, most_candidates=2),
    )
    seen = estimate_range(rectification, *sides, wide.range, DEFAULTS.epipolar)
    votes = vote(*sides, seen.of_crossings, DEFAULTS.epipolar)
    level = prices_level(*sides, seen)
    prices = prices_across(*sides, seen, votes) | level
    assert len(prices) > 35
    assert len(level) > 4
    moved = prices_of_regions(*regions, seen, votes)
    assert len(moved) > 4
    prices |= {(len(left) + i, len(right) + j): price for (i, j), price in moved.items()}
    found = match_pictures(parallel_rig(), pictures[0], pictures[1], wide)
    rows, priced = found.solved.rows, method == "pong"
    expected: dict[tuple[int, int], int] = {}
    for unit in range(len(left) + len(regions[0])):
        mine = sorted((price, label) for (i, label), price in prices.items() if i == unit)
        expected |= {(unit, label): round(8 * price) if priced else 0 for price, label in mine[: 2 if priced else None]}
    assert dict(zip(zip(rows.unit.tolist(), rows.label.tolist(), strict=True), rows.cost, strict=True)) == expected
    assert rows.null_cost.tolist() == ([17] * len(left) + [20] * 12 if priced else [0] * (len(left) + 12))
    assert rows.nat_cost == pytest.approx(0.8 if priced else 2.0)
    assert (rows.null_share, rows.nodes) == (0.7, 20)
    assert (rows.units, rows.labels, rows.injective) == (len(left) + 12, len(right) + 12, True)
    # What is said of arcs and regions is what the labels say.
    label = found.solved.result.label
    assert found.arc_label.tolist() == label[: len(left)].tolist()
    assert found.region_label.tolist() == [k - len(right) if k >= 0 else -1 for k in label[len(left) :]]
    paired = [(i, k) for i, k in enumerate(found.arc_label.tolist()) if k >= 0]
    assert [np.flatnonzero(side).tolist() for side in found.partnered] == [sorted(p[k] for p in paired) for k in (0, 1)]
    assert list(zip(found.triangulated.first, found.triangulated.second, strict=True)) == paired
    assert (found.arcs, found.regions) == ((len(left), len(right)), (12, 12))


def test_level_pairs_are_looked_for_up_to_their_limits() -> None:
    """One level arc in each picture: the rows between them, the shift and the contrast up to which they may be one."""

    def priced(down: float, moved: float, contrast: float = 40.0) -> bool:
        x = np.arange(80.0)
        line = np.column_stack([x, 10.0 + 0.05 * x])
        one = np.ones(1)
        left = packed([line], 40 * one, one, np.full(1, LINE), 0.1 * one)
        right = packed([line[20:50] - [moved, -down]], contrast * one, one, np.full(1, LINE), 0.1 * one)
        return len(match_pictures(parallel_rig(), picture_of(left), picture_of(right)).solved.rows.unit) == 1

    # Heights 3.95 and 1.45, lengths 79 and 29: the middles are 39.5 and 34.5 along.
    assert priced(3 + 2.7 + 0.24, 250)
    assert not priced(3 + 2.7 + 0.26, 250)
    assert priced(0, 5.0 - 34.9)
    assert not priced(0, -5.0 - 25.1)
    assert priced(0, 1319.9)
    assert not priced(0, 1320.1)
    like = 8 * np.sinh(np.arcsinh(40 / 8) - np.sqrt(8.0) * 0.7)
    assert priced(0, 250, like + 0.01)
    assert not priced(0, 250, like - 0.01)
