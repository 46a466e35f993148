"""Log odds of found shares, against sums over the binomial distribution and what they must do."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from scipy.special import betaln, gammaln
from scipy.stats import beta, betabinom

from relmodel.arrays import Floats, Ints
from tests.vision.account.test_samples import samples_at, unit
from vision.account.account_parameters import RunParameters
from vision.account.runs import (
    EdgeRuns,
    compute_log_odds,
    part_at_turns,
    sum_in_one_light,
    weigh_absence,
    weigh_lookalike,
    weigh_runs,
)
from vision.account.samples import Samples, SampleSupport, Sides
from vision.scene import StoredScene

P = RunParameters()


@pytest.mark.parametrize(("found", "n", "chance", "share"), [(9, 10, 0.1, 0.8), (1, 10, 0.1, 0.8), (3, 4, 0.3, 0.5)])
def test_log_odds_are_those_of_mixtures_of_beta_binomials(found: int, n: int, chance: float, share: float) -> None:
    shown = betabinom.pmf(found, n, *P.shown)
    partly = betabinom.pmf(found, n, 1, 1)
    nothing = betabinom.pmf(found, n, P.chance_count * chance, P.chance_count * (1 - chance))
    there = share * shown + (1 - share) * (P.partly * partly + (1 - P.partly) * nothing)
    odds = np.log(there / ((1 - P.stray) * nothing + P.stray * partly))
    one = np.ones(1)
    got = compute_log_odds(found / n * one, n * one, chance * one, share * one, P)
    assert got == pytest.approx([odds])


def test_no_length_says_nothing() -> None:
    one = np.ones(1)
    assert compute_log_odds(0.5 * one, 1e-9 * one, 0.1 * one, 0.8 * one, P) == pytest.approx([0.0], abs=1e-6)


def edge(direction: Floats) -> Samples:
    """One run of samples, a pixel each."""
    none = np.zeros(len(direction), np.int64)
    return samples_at(np.zeros((len(direction), 2)), direction, np.stack([none, none - 1], axis=1), none)


@pytest.mark.parametrize(("px", "pieces"), [(600, 6), (90, 4), (15, 1)])
def test_a_rim_has_a_piece_for_each_of_its_directions_that_is_long_enough(px: int, pieces: int) -> None:
    rim = part_at_turns(edge(unit(np.linspace(0, 2 * np.pi, px, endpoint=False))), P)
    lengths = np.bincount(rim.run)
    assert len(lengths) == pieces or (len(lengths) == pieces + 1 and lengths[-1] < P.stretch_px)
    assert (np.diff(rim.run) >= 0).all()
    if pieces > 1:
        assert lengths[:-1].min() >= min(px / 6, P.stretch_px) - 1


def test_an_edge_that_wavers_stays_whole_and_runs_stay_apart() -> None:
    rng = np.random.default_rng(2)
    straight = edge(unit(rng.normal(0.0, 0.1, 300)))
    assert part_at_turns(straight, P).run.max() == 0
    turns = unit(np.linspace(0, 2 * np.pi, 90, endpoint=False)), unit(np.linspace(0, 2, 37))
    alone = [part_at_turns(edge(it), P).run for it in turns]
    both, px = np.concatenate(turns), 90 + 37
    two = samples_at(np.zeros((px, 2)), both, np.zeros((px, 2), np.int64), np.arange(px) // 90)
    assert part_at_turns(two, P).run.tolist() == [*alone[0], *(alone[0].max() + 1 + alone[1])]


def runs_of(camera: Ints, arc: Ints, surface: Ints, in_light: Floats, px: Floats) -> EdgeRuns:
    return EdgeRuns(camera, arc, arc, arc, surface, px, px, px, px, px, in_light[:, 0], px, in_light)


def test_a_missing_edge_is_not_paid_for_by_others() -> None:
    """By loops over the shares of edges that may be missing and over lights; pieces between two surfaces are there, or
    gone, together; an edge that one picture shows is not gone from another."""
    rng = np.random.default_rng(5)
    camera, arc = np.array([0, 0, 0, 1, 1, 1, 1]), np.array([0, 1, 2, 3, 4, 5, 4])
    surface = np.array([[1, 2], [2, 1], [1, 3], [1, 2], [4, -1], [4, -1], [-1, 4]])
    in_light = rng.normal(1.0, 2.0, (7, 3))
    in_light[3] += 6.0
    left = {"a": in_light[0] + in_light[1], "b": in_light[2]}
    right = {"a": in_light[3], "c": in_light[4] + in_light[6], "d": in_light[5]}

    def odds_of(share: float) -> float:
        total = 0.0
        for edges, others in ((left, right), (right, left)):
            by_light = 0.0
            for name, edge in edges.items():
                shown = max(np.mean(np.exp(others[name])), 1.0) if name in others else 1.0
                by_light += np.log((1 - share) * np.exp(edge) + share / shown)
            total += np.log(np.mean(np.exp(by_light)))
        return float(total)

    wanted = np.log(np.mean([np.exp(odds_of(share) - odds_of(0.0)) for share in P.missing]))
    sure = np.full((7, 3), 20.0)
    gone = np.where(np.arange(7)[:, None] == 2, -3.0, sure)
    rows = runs_of(camera, arc, surface, in_light, np.ones(7)).take(np.tile(np.arange(7), 3))
    rows = replace(rows, in_light=np.concatenate([in_light, sure, gone]))
    it, whole, lacking = weigh_absence(np.repeat(np.arange(3), 7), rows, 3, 2, P)
    assert (it, whole < 0 < lacking) == (pytest.approx(wanted), True)


def test_an_edge_that_lacks_is_named_where_it_was_asked_for() -> None:
    surface = np.array([[1, 2], [3, -1], [1, 3]])
    in_light, px = np.array([[20.0] * 3, [-9.0] * 3, [4.0] * 3]), np.array([50.0, 60.4, 70.0])
    it = runs_of(np.array([0, 1, 0]), np.arange(3), surface, in_light, px)
    stored = cast(StoredScene, SimpleNamespace(name_surface="face {}".format))
    odds, words = weigh_lookalike(stored, it, np.array([True, True, True]), ["left", "right"], P)
    assert odds == weigh_absence(np.zeros(3, np.int64), it, 1, 2, P)[0] > 0
    assert words.startswith(f"edges of the model that should show do not, log odds {odds:.1f}, most of all ")
    assert words.endswith(" 60 px of face 3 in the picture of right")
    assert weigh_lookalike(stored, it, np.array([True, False, True]), ["left", "right"], P)[0] < 0
    assert weigh_lookalike(stored, it, np.zeros(3, bool), ["left", "right"], P) == (0.0, "")


def test_edges_in_one_light_are_averaged_over_lights() -> None:
    """Two edges of a thing, neither found, in two lights: the mean likelihood ratio of both."""
    in_light = np.log([[0.5, 0.1], [0.5, 0.1], [0.3, 0.3]])
    together = sum_in_one_light(np.array([0, 0, 1]), in_light, 3)
    assert together == pytest.approx([np.log((0.25 + 0.01) / 2), np.log(0.3), 0.0])


def of_share(found: float, n: float, chance: float) -> Floats:
    """Densities of a found share of n stretches: of an edge that shows, of one that shows in part, by chance."""
    k, ways = found * n, gammaln(n + 1) - gammaln(found * n + 1) - gammaln(n - found * n + 1)
    each = (P.shown, (1, 1), (P.chance_count * chance, P.chance_count * (1 - chance)))
    return np.exp([ways + betaln(a + k, b + n - k) - betaln(a, b) for a, b in each])


def is_there(densities: Floats, share: float) -> float:
    return float(share * densities[0] + (1 - share) * (P.partly * densities[1] + (1 - P.partly) * densities[2]))


def odds_of(densities: Floats, share: float) -> float:
    return float(np.log(is_there(densities, share) / (P.stray * densities[1] + (1 - P.stray) * densities[2])))


@pytest.mark.parametrize("seed", range(2))
def test_runs_are_weighed_as_loops_over_runs_that_are_alike_do(seed: int) -> None:
    rng, runs = np.random.default_rng(seed), 14
    run = np.repeat(np.arange(runs), rng.integers(20, 70, runs))
    n, camera = len(run), (np.arange(runs) > 7).astype(int)[run]
    pair = np.array([[1, 2], [2, 3], [1, -1], [4, 5], [5, 4], [3, -1], [2, 1], [6, 1]] * 2)[:runs]
    it = replace(
        samples_at(rng.normal(size=(n, 2)), unit(rng.normal(size=n)), pair[run], run), camera=camera,
        front=(1 + (np.arange(runs) % 3 > 0))[run], length_px=rng.uniform(0.5, 1.5, n),
    )  # fmt: skip
    showing = np.where(np.arange(runs) % 4 == 1, 0.2, 0.9)[run]
    px = rng.uniform(0.2, 1.4, n) * (run != 5)
    support = SampleSupport(rng.random(n) < showing, px, rng.uniform(0, 0.3, n), 0 * px, np.zeros(0, int))
    some = np.flatnonzero(rng.random(n) < 0.3)
    normal = rng.normal([0.8, 0.2, 0.1], 0.25, (len(some), 2, 3))
    normal /= np.linalg.norm(normal, axis=2, keepdims=True)
    behind, rise = rng.random((len(some), 2)) < 0.15, rng.normal(0, 0.1, (len(some), 2))
    normal[behind] = 0.0
    sides = Sides(some, np.where(behind, -1, 7), normal, rise)
    found = weigh_runs(it, support, sides, P)

    own = [np.flatnonzero(run == k) for k in range(runs)]
    weight = np.array([px[rows].sum() for rows in own])
    share_found = [float(px[rows] @ support.found[rows]) / max(w, 1e-9) for rows, w in zip(own, weight, strict=True)]
    usual = float(px @ support.found / px.sum())
    every = float(px @ support.chance / px.sum())
    looks = np.zeros((runs, 2, 5))
    for k, rows in enumerate(own):
        for i in (seen := np.flatnonzero(np.isin(some, rows))):
            for side in (0, 1):
                bend = 0.0 if abs(rise[i, side]) <= P.flat else P.bend * np.sign(rise[i, side])
                looks[k, side] += [*normal[i, side], P.background * behind[i, side], bend]
        looks[k] /= max(len(seen), 1)
    for k, rows in enumerate(own):
        near, shown = P.usual_runs, P.usual_runs * usual
        for j, others in enumerate(own):
            same = set(pair[k][pair[k] >= 0]) <= set(pair[j])
            if camera[rows[0]] != camera[others[0]] or same:
                continue
            apart = min(((looks[k] - looks[j]) ** 2).sum(), ((looks[k] - looks[j][::-1]) ** 2).sum())
            alike = np.exp(-apart / (2 * P.alike**2) - (it.front[rows[0]] != it.front[others[0]]))
            alike *= min(weight[j] / P.most_px, 1.0)
            near, shown = near + alike, shown + alike * share_found[j]
        assert found.shows[k] == pytest.approx(shown / near)
        chance = (float(px[rows] @ support.chance[rows]) + every * P.chance_px) / (weight[k] + P.chance_px)
        chance = min(max(chance, P.least_chance), P.most_chance)
        assert (found.chance[k], found.found[k]) == pytest.approx((chance, share_found[k]))
        assert found.visible_px[k] == pytest.approx(it.length_px[rows].sum())
        faint, full = P.partly / 2 + (1 - P.partly) * chance, P.shown[0] / sum(P.shown)
        share = min(max((found.shows[k] - faint) / (full - faint), P.least_shows), P.most_shows)
        stretches = weight[k] / P.stretch_px
        levels = [of_share((i + 0.5) / P.levels, stretches, chance) for i in range(P.levels)]
        there = [is_there(level, share) for level in levels]
        odds = odds_of(of_share(share_found[k], stretches, chance), share)
        lights = beta.ppf((np.arange(P.lights) + 0.5) / P.lights, P.alike_light * share, P.alike_light * (1 - share))
        by_light = [odds_of(of_share(share_found[k], stretches, chance), light) for light in lights]
        expected = np.average([odds_of(level, share) for level in levels], weights=there)
        seen_at_all = float(weight[k] > 0)
        assert found.log_odds[k] == pytest.approx(odds * seen_at_all)
        assert found.expected[k] == pytest.approx(expected * seen_at_all)
        np.testing.assert_allclose(found.in_light[k], np.array(by_light) * seen_at_all, rtol=1e-5, atol=1e-6)
    heads = [rows[0] for rows in own]
    for name in ("camera", "view_run", "kind", "arc", "surface"):
        assert getattr(found, name).tolist() == getattr(it, name)[heads].tolist()
    assert len(set(found.shows.round(3))) == runs
