"""Samples of predicted edges, what supports them and what runs of them say, against loops."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from scipy.stats import beta

from relmodel.arrays import Floats, Ints
from tests.vision.localisation.scenes import above, box_scene, stereo_rig
from vision.account.account_parameters import SupportParameters
from vision.account.runs import weigh_runs
from vision.account.samples import (
    Nearby,
    Samples,
    SampleSupport,
    Sides,
    are_crowded,
    collect_samples,
    find_nearby,
    look_at_sides,
    measure_support,
)
from vision.localisation.hypotheses import EdgePoints, bound_elements, lie_within
from vision.localisation.measurements import EdgeIndex
from vision.localisation.views import find_view_arcs
from vision.presence.presence_parameters import DEFAULTS
from vision.scene import Scene, StoredScene

P = DEFAULTS
S = P.account.samples


def unit(angle: Floats) -> Floats:
    return np.stack([np.cos(angle), np.sin(angle)], axis=1)


def edge_points(position: Floats, normal: Floats, contrast: float = 40.0) -> EdgePoints:
    n = len(position)
    bounds = np.zeros(2), np.full(2, 200.0)
    return EdgePoints(position, normal, np.full(n, contrast), np.full(n, 0.1), *bounds, 200.0)


def samples_at(pixel: Floats, direction: Floats, surface: Ints, arc: Ints) -> Samples:
    n = len(pixel)
    return Samples(
        camera=np.zeros(n, np.int64), run=arc, view_run=arc, kind=np.zeros(n, np.int8), arc=arc, surface=surface,
        kin=surface, point=np.zeros((n, 3)), pixel=pixel, direction=direction,
        normal=np.tile([1.0, 0.0, 0.0], (n, 2, 1)), px_per_mm=np.ones((n, 2)), length_px=np.ones(n),
        front=np.full(n, 2), inside=np.ones(n, bool),
    )  # fmt: skip


def stored(scene: Scene) -> StoredScene:
    """A scene of boxes with the names of a store."""
    boxes = len(scene.inspected)
    # Edge 4 a + 2 u + v of a box runs along axis a, on the sides u and v of the other two.
    sides = [
        [6 * box + 2 * other + side for other, side in zip([o for o in range(3) if o != axis], uv, strict=True)]
        for box in range(boxes)
        for axis in range(3)
        for uv in ((0, 0), (0, 1), (1, 0), (1, 1))
    ]
    known = SimpleNamespace(scene=scene, occurrence_id=np.arange(boxes), arc_surfaces=np.array(sides))
    return cast(StoredScene, known)


def box_samples(grown: float = 0.0, small: float = 500.0) -> tuple[Scene, Samples, Floats]:
    """A block on a plate, its upper face `grown` mm outward."""
    plate = (np.array([-150.0, -110, -20]), np.array([300.0, 220, 20]))
    scene = box_scene([plate, (np.array([-50.0, -40, 0]), np.array([100.0, 80, 40 + grown]))])
    rig, pose = stereo_rig(), above(10, -20, 560)
    views = {n: find_view_arcs(scene, camera, pose @ rig.rig_from_camera[n]) for n, camera in rig.cameras.items()}
    can_show = [partial(lie_within, *bound_elements(camera)) for camera in rig.cameras.values()]
    p = replace(P.account.samples, small_part_px=small)
    return scene, collect_samples(stored(scene), rig, can_show, pose, views, p), pose


def test_samples_move_with_the_faces_they_lie_on() -> None:
    scene, samples, pose = box_samples()
    rig = stereo_rig()
    assert samples.camera.tolist() == sorted(samples.camera.tolist())
    assert (np.diff(samples.run) >= 0).all()
    assert np.unique(samples.run).tolist() == list(range(samples.run_count))
    for i in range(0, len(samples.run), 37):
        camera = list(rig.cameras)[samples.camera[i]]
        at = np.linalg.inv(pose @ rig.rig_from_camera[camera])
        across = np.array([-samples.direction[i, 1], samples.direction[i, 0]])
        for side in (0, 1):
            surface = samples.surface[i, side]
            outward = np.zeros(3)
            outward[surface % 6 // 2] = 2 * (surface % 2) - 1
            np.testing.assert_allclose(samples.normal[i, side], outward, atol=1e-9)
            # Both faces of an edge of a box are at right angles: the edge moves along the other's plane.
            places = np.stack([samples.point[i], samples.point[i] + 1e-4 * outward]) @ at[:3, :3].T + at[:3, 3]
            pixel, _ = rig.cameras[camera].project(places)
            np.testing.assert_allclose(pixel[0], samples.pixel[i], atol=1e-9)
            assert (pixel[1] - pixel[0]) @ across / 1e-4 == pytest.approx(samples.px_per_mm[i, side], abs=1e-3)
        eye = (pose @ rig.rig_from_camera[camera])[:3, 3]
        assert samples.front[i] == sum((n @ (eye - samples.point[i])) > 0 for n in samples.normal[i])
    assert scene.surface_occurrence[samples.surface].min(axis=1).tolist() == [
        *scene.surface_occurrence[samples.surface].max(axis=1)
    ]
    low, high = (6 + 1, 6 + 1), (633 - 1, 473 - 1)
    inside = ((samples.pixel > low) & (samples.pixel < high)).all(axis=1)
    assert (samples.inside == inside).all()


def test_edges_of_a_part_that_shows_little_are_of_one_kin() -> None:
    scene, samples, _ = box_samples(small=500.0)
    part = scene.surface_occurrence[samples.surface[:, 0]]
    shown = [max(samples.length_px[(part == k) & (samples.camera == c)].sum() for c in (0, 1)) for k in (0, 1)]
    assert min(shown) > 100
    _, samples, _ = box_samples(small=(shown[0] + shown[1]) / 2)
    lesser = int(np.argmin(shown))
    assert (samples.kin[part == 1 - lesser] == samples.surface[part == 1 - lesser]).all()
    assert (samples.kin[part == lesser] == [12 + lesser, -1]).all()


def test_what_lies_on_either_side_of_an_edge() -> None:
    """From above the rim of the block hides the plate, its foot is a corner, the plate's rim hides nothing."""
    scene, samples, pose = box_samples()
    sides = look_at_sides(scene, stereo_rig(), pose, samples, P.account.sides)
    along = np.cumsum(samples.length_px) // 6
    looked = [0] + [i for i in range(1, len(along)) if along[i] > along[i - 1] or samples.run[i] != samples.run[i - 1]]
    assert sides.sample.tolist() == looked
    seen = 0
    for row, i in enumerate(sides.sample):
        if np.abs(samples.point[i, :2]).max() > 200 or not samples.inside[i]:
            continue
        surface = sides.surface[row]
        for side in (0, 1):
            expected = np.zeros(3)
            if surface[side] >= 0:
                expected[surface[side] % 6 // 2] = 2 * (surface[side] % 2) - 1
            np.testing.assert_allclose(sides.normal[row, side], expected, atol=1e-9)
        own, rise = set(samples.surface[i].tolist()), sides.rise[row]
        if (surface < 0).any():
            assert not rise.any()
        elif own == set(surface.tolist()):
            seen += 1
            ridge = samples.point[i, 2] > 1 or 5 not in own
            assert (np.sign(rise) == (-1 if ridge else 1)).all()
        elif len(own & set(surface.tolist())) == 1 and abs(samples.point[i, 2] - 40) < 1e-6:
            # The upper face rises over the plate beyond it, which lies below that face's plane.
            upper = int(surface[0] != 11)
            assert (rise[upper] > 0, rise[1 - upper] < 0) == (True, True)
            seen += 1
    assert seen > 40


def test_all_elements_along_the_normals_are_listed_and_no_others() -> None:
    rng = np.random.default_rng(3)
    index = EdgeIndex(edge_points(rng.uniform(0, 200, (4000, 2)), unit(rng.uniform(0, 2 * np.pi, 4000))))
    pixel = np.concatenate([rng.uniform(-5, 205, (150, 2)), np.full((4, 2), 100.0)])
    angle = np.concatenate([rng.uniform(0, 2 * np.pi, 150), np.pi / 2 * np.arange(4)])
    direction = unit(angle)
    found = find_nearby(np.zeros(len(pixel), np.int64), pixel, direction, [index], np.zeros(1), S)
    edges = index.edges
    for k in range(len(pixel)):
        normal = np.array([-direction[k, 1], direction[k, 0]])
        way = edges.position - pixel[k]
        near = (np.abs(way @ direction[k]) <= S.max_along_px) & (np.abs(way @ normal) <= S.reach_px)
        near &= np.abs(edges.normal @ normal) >= S.min_cosine
        mine = slice(found.first[k], found.first[k + 1])
        assert sorted(found.element[mine]) == np.flatnonzero(near).tolist()
        assert np.allclose(np.sort(found.offset[mine]), np.sort((way @ normal)[near]))


def test_the_camera_s_response_is_taken_off() -> None:
    """An edge that is brighter below is seen too high, toward its dark side."""
    at = np.array([[50.0, 49.9]])
    index = EdgeIndex(edge_points(at, np.array([[0.0, 1.0]]), contrast=100.0))
    there, along = np.array([[50.0, 50.0]]), np.array([[1.0, 0.0]])
    found = find_nearby(np.zeros(1, np.int64), there, along, [index], np.array([0.2]), S)
    assert np.allclose(found.offset, 0.0)


def test_support_is_by_the_nearest_element_of_its_own() -> None:
    rng = np.random.default_rng(5)
    n = 220
    surface = rng.integers(0, 4, (n, 2))
    samples = samples_at(rng.uniform(20, 180, (n, 2)), unit(rng.uniform(0, np.pi, n)), surface, rng.integers(0, 30, n))
    samples = replace(samples, length_px=rng.uniform(1, 6, n), inside=rng.random(n) > 0.1)
    edges = edge_points(rng.uniform(0, 200, (4500, 2)), unit(rng.uniform(0, np.pi, 4500)))
    edges.contrast[:] = rng.uniform(5, 90, 4500)
    nearby = find_nearby(
        samples.camera, samples.pixel, samples.direction, [EdgeIndex(edges)], np.zeros(1), P.account.samples
    )
    found = measure_support(samples, nearby, P.account.support)
    rows = list(zip(nearby.sample.tolist(), nearby.element.tolist(), nearby.offset.tolist(), strict=True))
    across = samples.direction[:, ::-1] * [-1, 1]
    nearest = dict.fromkeys(nearby.element.tolist(), (np.inf, 0))
    for sample, element, offset in rows:
        apart = samples.pixel[sample] + offset * across[sample] - samples.pixel
        along, off = (np.abs((apart * way).sum(axis=1)) for way in (samples.direction, across))
        alike = np.abs(samples.direction @ samples.direction[sample]) > math.cos(math.radians(30))
        for j in np.flatnonzero((off <= 2.0) & (along <= samples.length_px / 2) & alike).tolist():
            nearest[element] = min(nearest[element], (off[j], j))
    for i in range(n):
        mine = [(e, o) for s, e, o in rows if s == i]
        own = [
            e
            for e, o in mine
            if abs(o) <= 2.0
            and (set(surface[i]) & set(surface[nearest[e][1]]) or not nearest[e][0] < min(abs(o) - 0.5, 2.0))
        ]
        assert found.found[i] == bool(own)
        assert found.contrast[i] == max([edges.contrast[e] for e in own], default=0.0)
        free = [o for e, o in mine if nearest[e][0] > 2.0]
        chance = [any(abs(o - place) <= 2.0 for o in free) for place in (-13, -10, -7, 7, 10, 13)]
        assert found.chance[i] == pytest.approx(np.mean(chance))
        crowded = any(
            np.linalg.norm(samples.pixel[i] - samples.pixel[j]) <= 3.5
            and samples.arc[i] != samples.arc[j]
            and abs(samples.direction[i] @ samples.direction[j]) > math.cos(math.radians(30))
            and not set(surface[i]) & set(surface[j])
            for j in range(n)
        )
        assert found.weight[i] == (0.0 if crowded or not samples.inside[i] else samples.length_px[i])
    assert 20 < found.found.sum() < n
    taken = [nearest[e][1] if nearest[e][0] <= 2.0 else -1 for e in nearby.element]
    assert found.owner.tolist() == taken


def two_lines(apart: float, surfaces: tuple[tuple[int, int], tuple[int, int]]) -> tuple[Samples, Nearby]:
    """Two parallel predicted lines, `apart` px, with elements along the first alone."""
    x = np.arange(20.0, 180.0)
    first, second = (np.stack([x, np.full(len(x), y)], axis=1) for y in (100.0, 100.0 + apart))
    surface = np.repeat(np.array(surfaces), len(x), axis=0)
    along = np.tile([1.0, 0.0], (2 * len(x), 1))
    samples = samples_at(np.concatenate([first, second]), along, surface, np.repeat([0, 1], len(x)))
    index = EdgeIndex(edge_points(first + np.array([0.0, 0.1]), np.tile([0.0, 1.0], (len(x), 1))))
    return samples, find_nearby(samples.camera, samples.pixel, samples.direction, [index], np.zeros(1), S)


def test_an_element_supports_the_nearer_of_two_edges_alone_unless_they_cannot_be_told_apart() -> None:
    p = SupportParameters(crowded_px=1.0)
    samples, nearby = two_lines(1.8, ((0, 1), (2, 3)))
    assert measure_support(samples, nearby, p).found.tolist() == [True] * 160 + [False] * 160
    assert measure_support(*two_lines(1.8, ((0, 1), (1, 2))), p).found.all(), "edges of one surface share"
    assert measure_support(*two_lines(0.3, ((0, 1), (2, 3))), p).found.all(), "edges that coincide share"
    assert not measure_support(*two_lines(2.5, ((0, 1), (2, 3))), SupportParameters()).weight.any()
    assert measure_support(*two_lines(6.0, ((0, 1), (2, 3))), SupportParameters()).weight.all()
    crowded = [are_crowded(two_lines(it, ((0, 1), (1, 2)))[0], p, by_own=True).all() for it in (0.4, 0.8, 1.2)]
    assert crowded == [False, True, False], "what lies in one place, beside, and farther off"


def some_runs(seed: int) -> tuple[Samples, SampleSupport, Sides]:
    rng = np.random.default_rng(seed)
    runs = 14
    run = np.repeat(np.arange(runs), rng.integers(3, 60, runs))
    n = len(run)
    surface = np.stack([rng.integers(0, 6, runs), rng.integers(-1, 6, runs)], axis=1)[run]
    samples = samples_at(rng.uniform(0, 200, (n, 2)), unit(rng.uniform(0, np.pi, n)), surface, run)
    camera, front = (run >= 8).astype(np.int64), rng.integers(1, 3, runs)[run]
    samples = replace(samples, camera=camera, front=front, length_px=rng.uniform(1, 4, n), view_run=run % 8)
    weight = np.where(run == 3, 0.0, samples.length_px * (rng.random(n) > 0.2))
    share = rng.random(runs)[run]
    support = SampleSupport(rng.random(n) < share, weight, 0.2 * rng.random(n), np.zeros(n), np.zeros(n, np.int64))
    some = np.flatnonzero(np.arange(n) % 3 == 0)
    some = np.union1d(some, np.flatnonzero(np.diff(run, prepend=-1) != 0))
    side_surface = rng.integers(-1, 6, (len(some), 2))
    normal = rng.normal(size=(6, 3))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    of_side = np.where(side_surface[..., None] >= 0, normal[side_surface], 0.0)
    return samples, support, Sides(some, side_surface, of_side, rng.uniform(-0.2, 0.2, (len(some), 2)))


def log_odds_of(found: float, n: float, chance: float, share: float) -> float:
    """By beta-binomials whose number of ways, the same for all, is left out."""
    from scipy.special import betaln

    def likelihood(a: float, b: float) -> float:
        return math.exp(betaln(a + found * n, b + (1 - found) * n) - betaln(a, b))

    shown, partly, nothing = likelihood(6.0, 0.7), likelihood(1, 1), likelihood(6 * chance, 6 * (1 - chance))
    there = share * shown + (1 - share) * (0.4 * partly + 0.6 * nothing)
    return math.log(there / (0.9 * nothing + 0.1 * partly))


@pytest.mark.parametrize("seed", [0, 1])
def test_runs_are_weighed_by_how_alike_ones_show(seed: int) -> None:
    samples, support, sides = some_runs(seed)
    found = weigh_runs(samples, support, sides, P.account.runs)
    runs = samples.run_count
    head = [int(np.flatnonzero(samples.run == r)[0]) for r in range(runs)]
    weight = np.array([support.weight[samples.run == r].sum() for r in range(runs)])
    np.testing.assert_allclose(found.weight_px, weight)
    share = np.array([support.weight[samples.run == r] @ support.found[samples.run == r] for r in range(runs)])
    share /= np.maximum(weight, 1e-9)
    np.testing.assert_allclose(found.found, share)
    every = support.weight @ support.chance / support.weight.sum()
    usual = weight @ share / weight.sum()
    # What is seen on either side of each run: the mean normal, nothing 1.5 away, corners and ridges .5 either way.
    looks = []
    for r in range(runs):
        rows = np.flatnonzero(samples.run[sides.sample] == r)
        two = []
        for side in (0, 1):
            bend = [0.5 * np.sign(x) if abs(x) > 0.05 else 0.0 for x in sides.rise[rows, side]]
            nothing = 1.5 * (sides.surface[rows, side] < 0)
            two.append(np.array([*sides.normal[rows, side].mean(axis=0), nothing.mean(), np.mean(bend)]))
        looks.append(two)
    for r in range(runs):
        total, sum_found = 1.0, usual
        for o in range(runs):
            if samples.camera[head[r]] != samples.camera[head[o]]:
                continue
            (a, b), (c, d) = looks[r], looks[o]
            apart = min(((a - c) ** 2).sum() + ((b - d) ** 2).sum(), ((a - d) ** 2).sum() + ((b - c) ** 2).sum())
            apart = apart / (2 * 0.35**2) + (samples.front[head[r]] != samples.front[head[o]])
            mine = {int(s) for s in samples.surface[head[r]] if s >= 0}
            if not mine <= {int(s) for s in samples.surface[head[o]]}:
                like = math.exp(-apart) * min(weight[o], 60.0) / 60.0
                total, sum_found = total + like, sum_found + like * share[o]
        shows = sum_found / total
        assert found.shows[r] == pytest.approx(shows, rel=1e-6)
        chance = support.weight[samples.run == r] @ support.chance[samples.run == r]
        chance = np.clip((chance + every * 60) / (weight[r] + 60), 0.02, 0.6)
        assert found.chance[r] == pytest.approx(chance)
        full, faint = 6.0 / 6.7, 0.5 * 0.4 + 0.6 * chance
        likely, n = float(np.clip((shows - faint) / (full - faint), 0.05, 0.98)), weight[r] / 20
        if weight[r] == 0:
            assert (found.log_odds[r], found.expected[r]) == (0, 0)
            assert not found.in_light[r].any()
            continue
        assert found.log_odds[r] == pytest.approx(log_odds_of(share[r], n, chance, likely))
        lights = beta.ppf((np.arange(9) + 0.5) / 9, 6 * likely, 6 * (1 - likely)).clip(1e-6, 1 - 1e-6)
        np.testing.assert_allclose(found.in_light[r], [log_odds_of(share[r], n, chance, s) for s in lights])
    np.testing.assert_array_equal(found.surface, samples.surface[head])
    np.testing.assert_array_equal(found.camera, samples.camera[head])
    np.testing.assert_array_equal(found.view_run, samples.view_run[head])


def test_what_is_expected_of_an_edge_that_is_there_is_the_mean_over_what_may_be_found() -> None:
    """Of a run of 200 px: a sum over the shares .025, .075 .. .975 of ten stretches."""
    samples = samples_at(np.zeros((200, 2)), unit(np.zeros(200)), np.tile([0, 1], (200, 1)), np.zeros(200, np.int64))
    found = np.arange(200) % 4 != 0
    support = SampleSupport(found, np.ones(200), np.full(200, 0.1), np.zeros(200), np.zeros(200, np.int64))
    sides = Sides(np.arange(200), np.zeros((200, 2), np.int64), np.zeros((200, 2, 3)), np.zeros((200, 2)))
    runs = weigh_runs(samples, support, sides, P.account.runs)
    shows = runs.shows[0]
    likely = (shows - 0.26) / (6 / 6.7 - 0.26)
    shares, weights = (np.arange(20) + 0.5) / 20, []
    for level in shares:
        k = level * 10
        ways = math.exp(math.lgamma(11) - math.lgamma(k + 1) - math.lgamma(11 - k))

        def likelihood(a: float, b: float, k: float = k) -> float:
            from scipy.special import betaln

            return math.exp(betaln(a + k, b + 10 - k) - betaln(a, b))

        there = likely * likelihood(6, 0.7) + (1 - likely) * (0.4 * likelihood(1, 1) + 0.6 * likelihood(0.6, 5.4))
        weights.append(ways * there)
    odds = [log_odds_of(level, 10, 0.1, likely) for level in shares]
    assert runs.expected[0] == pytest.approx(np.average(odds, weights=weights))
