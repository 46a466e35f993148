"""What displaced surfaces say and where they lie, against loops with the numbers written out and drawn edges."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from scipy.optimize import minimize

from relmodel.arrays import Bools, Floats, Ints
from tests.vision.account.test_samples import edge_points, log_odds_of, samples_at, unit
from vision.account.runs import EdgeRuns
from vision.account.samples import Nearby, Samples, SampleSupport, find_nearby, measure_support
from vision.localisation.measurements import EdgeIndex
from vision.presence.items import Items
from vision.presence.presence_parameters import DEFAULTS, DisplacementParameters
from vision.presence.surfaces import (
    BodyElements,
    Displacement,
    EdgePredictions,
    FacePairs,
    Look,
    MovingSurfaces,
    SceneSurfaces,
    assess_surfaces,
    find_moving_surfaces,
    find_rival_face,
    find_shaded,
    find_tangent,
    find_usable,
    fit,
    measure_misfit,
    measure_moved,
    seek_moved,
    take_off_common,
)
from vision.scene import StoredScene

P = DEFAULTS
NO_FACE, NO_MM = np.zeros(0, np.int64), np.zeros(0)
NOT_OPPOSED = FacePairs(NO_FACE, NO_FACE, NO_FACE, NO_MM, NO_FACE, NO_MM)
NO_TANGENT = NO_FACE, NO_FACE, np.zeros((0, 3))
NONE_INWARD = WHOLE = np.zeros(2, bool)


def weighed(
    beside: BodyElements, carried: tuple[Ints, Ints, Ints], rate: Floats, other: Floats, chance: Floats, shows: Floats,
    place: float, reach: float,
) -> tuple[Floats, Bools]:  # fmt: skip
    """Log odds of edges, and whether they are in sight, where their body lies at one place."""
    sample, side, edge = carried
    odds, in_sight = np.zeros(len(chance)), np.zeros(len(chance), bool)
    for e in range(len(chance)):
        seen, found, whole = 0.0, [0.0, 0.0], 0.0
        for row in np.flatnonzero(edge == e):
            i = sample[row]
            whole += beside.weight[i]
            mine = range(beside.first[i], beside.first[i + 1])
            ahead = other[row] + rate[row] * place
            away = {True: math.inf, False: math.inf}
            for k in mine:
                usable = bool(beside.usable[k, side[row]])
                away[usable] = min(away[usable], abs(beside.offset[k] - ahead))
            hides = 3.5 if abs(ahead) > 3.5 else min(away[True], 2.0)  # far off, where edges are not told apart
            if abs(ahead) > reach or away[False] < hides:
                continue
            seen += beside.weight[i]
            for wide, tolerance in enumerate((0.4, 1.2)):
                beyond = 2 * max(away[True] / tolerance - 1, 0.0)
                if beyond < 4:
                    found[wide] += beside.weight[i] * math.exp(-0.5 * beyond**2)
        in_sight[e] = seen >= 0.5 * whole
        if not in_sight[e]:
            continue
        each = []
        for px, tolerance, likely in zip(found, (0.4, 1.2), (0.75, 0.25), strict=True):
            by_chance, n = max(chance[e] * tolerance / 1.2, 0.02), seen / 20
            placed = min(n, 1.0) * math.log(likely * 1.2 / tolerance)
            each.append(placed + log_odds_of(px / max(seen, 1e-9), n, by_chance, shows[e]))
        odds[e] = math.log(sum(map(math.exp, each)))
    return odds, in_sight


def drawn(seed: int, count: int = 60) -> tuple[BodyElements, tuple[Ints, Ints, Ints], Floats, Floats]:
    rng = np.random.default_rng(seed)
    many = rng.integers(0, 4, count)
    first = np.append(0, np.cumsum(many))
    usable = rng.random((first[-1], 2)) < 0.8
    beside = BodyElements(first, rng.uniform(-6, 6, first[-1]), usable, rng.uniform(1, 5, count))
    rows = 90
    carried = rng.integers(0, count, rows), rng.integers(0, 2, rows), np.sort(rng.integers(0, 6, rows))
    return beside, carried, rng.uniform(-2, 2, rows), rng.uniform(-1, 1, rows)


@pytest.mark.parametrize("reach", [5.0, 2.0])
def test_edges_are_weighed_where_their_body_may_lie(reach: float) -> None:
    beside, carried, rate, other = drawn(1)
    chance, shows, grid = np.linspace(0.01, 0.3, 6), np.linspace(0.2, 0.9, 6), np.array([-2.5, -0.5, 0.0, 1.0, 3.0])
    odds, in_sight = beside.weigh(carried, rate, other, chance, shows, grid, reach, P)
    for cell, place in enumerate(grid):
        expected, seen = weighed(beside, carried, rate, other, chance, shows, place, reach)
        np.testing.assert_array_equal(in_sight[:, cell], seen)
        np.testing.assert_allclose(odds[:, cell], expected, rtol=1e-9, atol=1e-12)
    if reach == 2.0:
        assert not in_sight.all()


def test_elements_of_other_surfaces_are_no_edge_that_has_moved() -> None:
    rng = np.random.default_rng(2)
    n = 40
    surface = rng.integers(-1, 5, (n, 2))
    samples = samples_at(np.zeros((n, 2)), unit(np.zeros(n)), surface, np.arange(n))
    sample = np.sort(rng.integers(0, n, 150))
    nearby = Nearby(np.searchsorted(sample, np.arange(n + 1)), sample, np.arange(150), np.zeros(150), np.ones(150))
    owner = np.where(rng.random(150) < 0.5, -1, rng.integers(0, n, 150))
    found = find_usable(samples, nearby, owner)
    for row in range(150):
        for side in (0, 1):
            mine = surface[sample[row], side]
            theirs = owner[row] < 0 or mine in surface[owner[row]]
            assert found[row, side] == (mine >= 0 and theirs)


def test_a_corner_moves_with_the_walls_that_run_into_it() -> None:
    """Surface 2 is a corner between the planes 0 and 1: its edges move with these by the cosine of their normals."""
    angle = np.radians([10.0, 40, 80])
    normal = np.stack([np.pad(unit(angle), [(0, 0), (0, 1)]), np.tile([0.0, 0, 1], (3, 1))], axis=1)
    samples = samples_at(np.zeros((3, 2)), unit(angle), np.tile([2, 3], (3, 1)), np.array([0, 0, 1]))
    samples = replace(samples, normal=normal, px_per_mm=np.array([[2.0, 0.5], [3, -0.5], [-4, 1]]))
    tangent = np.array([1, 0]), np.array([2, 2]), np.array([[0.0, 1, 0], [1.0, 0, 0]])
    moving = find_moving_surfaces(samples, tangent)
    assert moving.surface.tolist() == [0] * 3 + [1] * 3 + [2] * 3 + [3] * 3
    assert moving.sample.tolist() == [0, 1, 2] * 4
    assert moving.side.tolist() == [0] * 9 + [1] * 3
    own = np.array([2.0, 3, -4])
    expected = np.stack([own * np.cos(angle), own * np.sin(angle), own, np.array([0.5, -0.5, 1])])
    np.testing.assert_allclose(moving.rate, expected.ravel())
    moved = moving.displace(np.array([0.1, 0.2, -0.3, 1.0]), 3)
    np.testing.assert_allclose(moved, np.array([0.1, 0.2, -0.3, 1.0]) @ expected)


def test_planes_run_into_the_cylinders_that_they_meet_smoothly() -> None:
    """Arc 0 joins plane 0 to cylinder 1 smoothly, arc 1 plane 2 to it sharply, arc 2 is free."""
    up, aside = np.array([0.0, 0, 1]), np.array([1.0, 0, 0])
    scene = SimpleNamespace(
        sample_arc=np.array([0, 0, 1, 1, 2]),
        sample_cosine=np.array([0.999, 0.995, 0.1, 0.2, 1.0]),
        sample_normal_a=np.stack([up, up, aside, aside, up]),
        sample_normal_b=np.stack([up, aside, up, up, up]),
    )
    surfaces, radius = np.array([[0, 1], [2, 1], [0, -1]]), np.array([np.nan, 5, np.nan])
    known = SimpleNamespace(scene=scene, surface_no=np.arange(3), arc_surfaces=surfaces, radius=radius)
    plane, cylinder, normal = find_tangent(cast(StoredScene, known), 0.99)
    assert (plane.tolist(), cylinder.tolist(), normal.tolist()) == ([0], [1], [[0, 0, 1]])


def rim(shift: Floats, wider: float, noise: float = 0.0) -> tuple[EdgePredictions, SampleSupport]:
    """The upper rim of a bore of 10 mm radius, surface 1, in a plate, surface 0, seen from above by 3 px a mm."""
    n = 190
    angle = 2 * np.pi * np.arange(n) / n
    radial = unit(angle)
    direction = np.stack([radial[:, 1], -radial[:, 0]], axis=1)  # so that the image normal is radial
    across = np.stack([-direction[:, 1], direction[:, 0]], axis=1)
    np.testing.assert_allclose(across, radial)
    samples = samples_at(100 + 30 * radial, direction, np.tile([0, 1], (n, 1)), np.arange(n) // 38)
    flat = np.pad(radial, [(0, 0), (0, 1)])
    normal = np.stack([np.tile([0.0, 0, 1], (n, 1)), -flat], axis=1)
    rate = np.stack([np.zeros(n), np.full(n, -3.0)], axis=1)
    samples = replace(samples, point=10 * flat, normal=normal, px_per_mm=rate, length_px=np.ones(n))
    offset = 3 * (radial @ shift + wider) + np.random.default_rng(0).normal(0, noise, n)
    beside = BodyElements(np.arange(n + 1), np.asarray(offset, float), np.ones((n, 2), bool), np.ones(n))
    found = np.abs(offset) <= 2.0
    each = [np.bincount(samples.run, found).astype(float) / 38]
    runs = EdgeRuns(
        camera=np.zeros(5, np.int64), view_run=np.arange(5), kind=np.zeros(5, np.int64), arc=np.arange(5),
        surface=np.tile([0, 1], (5, 1)), visible_px=np.full(5, 38.0), weight_px=np.full(5, 38.0), found=each[0],
        chance=np.full(5, 0.05), shows=np.full(5, 0.9), log_odds=np.zeros(5), expected=np.zeros(5),
        in_light=np.where(each[0] > 0.5, 1.0, -1.0)[:, None],
    )  # fmt: skip
    support = SampleSupport(found, np.ones(n), np.full(n, 0.05), np.ones(n), np.full(n, -1))
    moving = find_moving_surfaces(samples, NO_TANGENT)
    return EdgePredictions(samples, moving, beside, runs, runs, samples.run, np.zeros(n, bool), np.zeros(n)), support


def assessed(edges: EdgePredictions) -> SceneSurfaces:
    scene = SimpleNamespace(
        vertices=np.zeros((3, 3)), triangles=np.array([[0, 1, 2]] * 2), triangle_surface=np.arange(2),
        surface_occurrence=np.zeros(2, np.int64),
    )  # fmt: skip
    stored = cast(StoredScene, SimpleNamespace(scene=scene, surface_no=np.arange(2), radius=np.array([np.nan, 10.0])))
    one = np.zeros(1, np.int64)
    items = Items(
        ["feature"], one, one, one - 1, ["bore"], ["through_hole"], np.ones(1), np.full(1, np.nan), one, one + 1,
        np.array([False, True]),
    )  # fmt: skip
    return assess_surfaces(edges, stored, items, 1, P)


@pytest.mark.parametrize(
    ("shift", "wider"),
    [((0.0, 0.0), 0.0), ((0.3, -0.2), 0.1), ((-0.4, 0.1), -0.25), ((0.0, 0.0), 0.7), ((0.0, 0.0), 2.0)],
)
def test_a_bore_lies_where_its_rim_is_found(shift: tuple[float, float], wider: float) -> None:
    edges, _ = rim(np.array(shift), wider)
    found = assessed(edges)
    # Outward of a bore is toward its axis.
    assert found.inward.tolist() == [False, True]
    assert found.mm[1] == pytest.approx(-wider, abs=1e-3)
    np.testing.assert_allclose(found.shift[1], [*shift, 0.0], atol=1e-3)
    assert np.isnan(found.mm[0])  # the plate moves no edge of the rim
    np.testing.assert_allclose(found.middle, 0, atol=1e-9)
    np.testing.assert_allclose(found.normal, [[0, 0, 1], [0, 0, 0]], atol=1e-9)
    assert found.distinct_px.tolist() == [190.0, 190.0]
    assert found.moved.tolist() == [False, wider > 0.5]  # by .8 mm of diameter at least, a boss by .75 mm of radius
    samples = replace(edges.samples, normal=-edges.samples.normal, px_per_mm=-edges.samples.px_per_mm)
    boss = replace(edges, samples=samples, moving=find_moving_surfaces(samples, NO_TANGENT))
    assert assessed(boss).moved.tolist() == [False, wider == 2.0]
    # All of the rim may be drawn .27 px off, at 3 px a mm; its middle is known by the rest, to .27 px a side.
    assert found.sigma[1] == pytest.approx(0.27 / 3, rel=0.05)
    if wider < 0.5:
        assert found.shift_sigma[1] == pytest.approx(0.27 / 3, rel=0.05)
        assert found.log_odds[1] <= 0


def test_a_piece_of_a_rim_that_may_be_in_place_is_measured_all_the_same() -> None:
    """By its 40 px it lies elsewhere, at less than 20 to 1: nothing else tells of a bore of another diameter."""
    edges, _ = rim(np.zeros(2), 0.6)
    piece = (np.arange(190) >= 150).astype(float)
    runs = replace(edges.runs, weight_px=np.bincount(edges.samples.run, piece).astype(float))
    found = assessed(replace(edges, beside=replace(edges.beside, weight=piece), runs=runs))
    assert 0 < found.log_odds[1] < 3
    assert (found.mm[1], found.moved[1]) == (pytest.approx(-0.6, abs=0.02), False)
    assert np.isnan(found.shift_sigma[1])


@pytest.mark.parametrize(
    ("in_place", "gone", "shows", "has_moved"),
    [(90, 80, 0.9, True), (0, 100, 0.9, False), (0, 100, 0.6, True), (100, 0, 0.9, True), (100, 60, 0.6, False)],
)
def test_what_is_in_place_or_hardly_found_elsewhere_has_not_moved(
    in_place: int, gone: int, shows: float, has_moved: bool
) -> None:
    """A rim 2 mm wider, of whose 190 px some are in place, more than half by 8 nats, or nowhere, .4 of those shown."""
    edges, _ = rim(np.zeros(2), 2.0)
    usable = edges.beside.usable & ~(np.arange(190) >= 190 - gone)[:, None]
    found = np.bincount(edges.samples.run, np.arange(190) < in_place) / 38
    runs = replace(edges.runs, found=found, shows=np.full(5, shows))
    edges = replace(edges, beside=replace(edges.beside, usable=usable), runs=runs)
    assert bool(assessed(edges).moved[1]) == has_moved


@pytest.mark.parametrize("px", [190, 95])
def test_what_is_dark_between_two_places_may_be_a_shadow_unless_it_runs_all_around(px: int) -> None:
    """A rim 2 mm wider, of which all is in sight or a half."""
    edges, _ = rim(np.zeros(2), 2.0)
    edges = replace(edges, beside=replace(edges.beside, weight=(np.arange(190) < px).astype(float)))
    for dark in (1.0, 0.92, 0.88, 0.4):
        found = assessed(replace(edges, shaded=np.arange(190) < dark * px))
        assert np.isfinite(found.mm[1]) == (dark < 0.9 or px == 190)  # else in doubt


@pytest.mark.parametrize(("hidden", "in_place", "told"), [(76, 0, 2), (114, 0, 2), (133, 0, 0), (76, 114, 1)])
def test_a_rim_of_which_light_hides_a_side_counts_piece_by_piece(hidden: int, in_place: int, told: int) -> None:
    """A rim 1 mm wider, one edge in five pieces, of which some do not show, and some are found in place as well."""
    edges, _ = rim(np.zeros(2), 1.0)
    usable = edges.beside.usable & ~(np.arange(190) >= 190 - hidden)[:, None]
    shows = np.where(np.arange(5) < (190 - hidden) // 38, 0.9, 0.1)
    pieces = replace(edges.runs, shows=shows, found=np.bincount(edges.piece, np.arange(190) < in_place) / 38)
    means = {"found": pieces.found.mean(keepdims=True), "shows": shows.mean(keepdims=True)}
    runs = replace(pieces.take(np.array([0])), weight_px=np.array([190.0]), **means)
    samples, beside = replace(edges.samples, run=np.zeros(190, np.int64)), replace(edges.beside, usable=usable)
    moving = find_moving_surfaces(samples, NO_TANGENT)
    found = assessed(replace(edges, samples=samples, moving=moving, beside=beside, runs=runs, pieces=pieces))
    assert int(found.log_odds[1] > 0) + int(found.moved[1]) == told


def test_a_displacement_is_weighed_against_in_place_and_what_is_tried() -> None:
    """A rim 2 mm wider: the log odds of all five edges there against none in place, less log(2 15 / 1)."""
    edges, _ = rim(np.zeros(2), 2.0)
    mm, log_odds = seek_moved(edges, WHOLE, 1, NOT_OPPOSED, P)
    assert mm.tolist() == [0.0, -2.0]
    n = 190
    carried = np.arange(n), np.ones(n, np.int64), edges.samples.run
    chance, shows = np.full(5, 0.05), np.full(5, 0.9)
    rate = np.full(n, -3.0)
    there, here = (
        weighed(edges.beside, carried, rate, np.zeros(n), chance, shows, place, 28 - 1.2)[0].sum()
        for place in (-2.0, 0.0)
    )
    assert log_odds[1] == pytest.approx(there - here - math.log(30), rel=1e-6)
    # Bounds: a face opposite lies 1.5 mm and a bit behind.
    wall = FacePairs(*(np.array([it]) for it in (0, 1, 0, 2.5, 1, 99.0)))
    assert seek_moved(edges, WHOLE, 1, wall, P)[0].tolist() == [0.0, -1.5]


def test_smaller_displacements_than_edges_are_blunt_are_none() -> None:
    """Of .7 mm; and of 1 mm where that is .6 px."""
    edges, _ = rim(np.zeros(2), 0.7)
    assert abs(seek_moved(edges, WHOLE, 1, NOT_OPPOSED, P)[0][1]) in (0.0, 0.75)
    far = replace(edges.samples, px_per_mm=edges.samples.px_per_mm * 0.2)
    moving = MovingSurfaces(edges.moving.sample, edges.moving.side, edges.moving.surface, edges.moving.rate * 0.2)
    blunt = replace(edges, samples=far, moving=moving, beside=replace(edges.beside, offset=np.full(190, 0.6)))
    mm = abs(seek_moved(blunt, WHOLE, 1, NOT_OPPOSED, P)[0][1])
    assert mm >= 1.33 or not mm


def test_what_has_another_edge_beside_it_is_known_half_as_well() -> None:
    """A rim of two arcs of which one lies 1.5 px outside the other."""
    edges, _ = rim(np.zeros(2), 0.5)
    two = np.arange(190) % 2
    pixel = edges.samples.pixel + 1.5 * two[:, None] * edges.samples.normal[:, 1, :2]
    beside = replace(edges, samples=replace(edges.samples, arc=two, pixel=pixel))
    lit = replace(edges, drawn=np.full(190, 9.0))  # px^2, at 3 px a mm
    each = [measure_moved(it, np.array([1]), np.zeros(2), NONE_INWARD, P)[0].covariance for it in (edges, beside, lit)]
    np.testing.assert_allclose(each[1], 4 * each[0])
    np.testing.assert_allclose(each[2] - each[0], np.diag([0, 0, 0, 1])[None], atol=1e-9)


def test_bores_are_measured_against_what_draws_all_others_aside() -> None:
    """Twelve bores by three px a mm, one of them wider: the change stays, and one alone keeps what it has."""
    rng, z, wider, every = np.random.default_rng(0), [], np.append(0.7, np.zeros(11)), np.ones(12, bool)
    covariance = np.tile(np.eye(4) * (0.1**2 + D.systematic_px**2) / 9, (12, 1, 1))
    for _ in range(200):
        px = rng.normal(0, D.systematic_px) + rng.normal(0, np.hypot(0.1, D.rim_px), 12)
        given = Displacement(np.pad((wider + px / 3)[:, None], [(0, 0), (3, 0)]), covariance, np.ones(12))
        found = take_off_common(given, np.full(12, 3.0), every, np.zeros(12), D)
        z.append((found.x[:, 3] - wider) / np.sqrt(found.covariance[:, 3, 3]))
    assert np.sqrt(found.covariance[:, 3, 3]).max() < 0.06  # .1 by itself
    assert np.abs(np.std(z, axis=0) - 1).max() < 0.2
    one = take_off_common(given, np.full(12, 3.0), np.arange(12) == 3, np.zeros(12), D)
    np.testing.assert_allclose(one.x, given.x, atol=1e-9)
    np.testing.assert_allclose(one.covariance[3, 3, 3], covariance[3, 3, 3] + D.rim_px**2 / 9, rtol=1e-3)
    lit = take_off_common(given, np.full(12, 3.0), every, 0.09 * (np.arange(12) == 3), D)  # light draws it by itself
    white = covariance[3, 3, 3] + (D.rim_px**2 + 0.09) / 9
    np.testing.assert_allclose((lit.x[3, 3], lit.covariance[3, 3, 3]), (given.x[3, 3], white), rtol=5e-3)


@pytest.mark.parametrize("half", [False, True])
def test_only_what_bends_around_is_shifted_aside(half: bool) -> None:
    """Of half a rim a shift and a width are not told apart: all is taken for a displacement outward."""
    edges, _ = rim(np.array([0.3, 0.0]), 0.0)
    weight = np.where(half & (np.arange(190) >= 95), 0.0, 1.0)
    weighted = replace(edges, beside=replace(edges.beside, weight=weight))
    found, closed = measure_moved(weighted, np.array([1]), np.zeros(2), NONE_INWARD, P)
    assert closed.tolist() == [not half]
    if half:
        assert np.abs(found.x[0, :3]).max() < 0.01
    else:
        np.testing.assert_allclose(found.x[0], [0.3, 0, 0, 0], atol=1e-3)
    assert found.agree[0] == pytest.approx(weight.sum() / 20, rel=0.2)


@pytest.mark.parametrize(
    ("moved", "mm", "least", "face"),
    [
        ([1, 0, 0, 0], [6, 0, 0, 0], 3.0, 0),  # one face across holds the pose, one has moved
        ([1, 0, 0, 0], [2, 0, 0, 0], 3.0, None),  # not so far that it matters
        ([1, 0, 0, 1], [6, 0, 0, -7], 3.0, 3),  # the farthest of two
        ([0, 0, 1, 0], [0, 0, 6, 0], 3.0, 2),  # none is along the third's normal
        ([1, 0, 0, 0], [6, 0, 0, 0.5], 3.0, None),  # two hold it
        ([1, 0, 0, 0], [6, 0, 0, 0.7], 3.0, 0),  # one of them surely lies off
    ],
)
def test_a_face_may_hold_the_pose_unless_more_others_do(
    moved: list[int], mm: list[float], least: float, face: int | None
) -> None:
    """Two pairs of opposite faces; the last is measured where it is not zero."""
    normal = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [1, 0, 0]], float)
    known = np.array([*mm[:3], mm[3] or np.nan], float)
    it = SimpleNamespace(moved=np.array(moved, bool), mm=known, normal=normal, sigma=np.full(4, 0.1))
    assert find_rival_face(cast(SceneSurfaces, it), np.ones(4, bool), least) == face
    assert find_rival_face(cast(SceneSurfaces, it), np.zeros(4, bool), least) is None
    bent = SimpleNamespace(**vars(it) | {"normal": np.full((4, 3), 0.1)})  # such faces have no normal
    assert find_rival_face(cast(SceneSurfaces, bent), np.ones(4, bool), least) is None
    if sum(moved) == 1 and face is None:  # a face of another part does not hold it
        assert find_rival_face(cast(SceneSurfaces, it), np.arange(4) != 3, 1.0) == 0


@pytest.mark.parametrize(
    ("off", "moved", "shifts", "said"),
    [
        ([1, -1, 1, -1, 1, 5], [], [], (1.0, 5)),  # without the farthest
        ([3, -4, 0, 0, 0, 0], [], [], (1.8**0.5, 1)),
        ([-2, -9, 0, 0, 0, 0, 8], [], [], ((4 + 36) ** 0.5 / 6**0.5, 1)),  # none counts more than six
        ([1, 1, 1, 1, 1, 1, 9], [6], [], (1.0, 0)),  # what has moved is told of by itself
        ([1, 1, 1, 1, 1, 9], [5], [], None),  # too few
        ([1, 0, 0, 0], [], [(0, 3), (4, 0)], ((1 + 9) ** 0.5 / 5**0.5, 1)),  # a bore counts by its radius and its place
        ([1, 0, 0, 0], [], [(0, 3), (0, 7), (4, 0)], ((1 + 16) ** 0.5 / 5**0.5, 1)),  # one is shifted with the farthest
    ],
)
def test_faces_in_place_lie_off_together(
    off: list[float], moved: list[int], shifts: list[tuple[float, float]], said: tuple[float, int] | None
) -> None:
    """In millimetres of sigmas of 2 mm; a face that is not measured or does not hold the pose says nothing."""
    count = len(off) + 2
    mm, sigma = np.array([*off, np.nan, 50.0]) * 2, np.full(count, 2.0)
    shift, bent = np.zeros((count, 3)), np.arange(count) < len(shifts)
    shift[bent, :2] = 2.0 * np.array(shifts).reshape(-1, 2)
    around = {"shift": shift, "shift_sigma": np.where(bent, sigma, np.nan)}
    it = cast(SceneSurfaces, SimpleNamespace(mm=mm, sigma=sigma, moved=np.isin(np.arange(count), moved), **around))
    assert measure_misfit(it, np.arange(count) < count - 1) == (pytest.approx(said) if said else None)


def look(samples: Samples, index: EdgeIndex) -> EdgePredictions:
    """What elements show along samples, of edges that mostly show where chance finds little."""
    nearby = find_nearby(samples.camera, samples.pixel, samples.direction, [index], np.zeros(1), P.account.samples)
    support = measure_support(samples, nearby, P.account.support)
    count = samples.run_count
    head = np.unique(samples.run, return_index=True)[1]
    weight = np.bincount(samples.run, support.weight, count).astype(float)
    zero, whole = np.zeros(count), np.zeros(count, np.int64)
    runs = EdgeRuns(
        whole, whole, whole, samples.arc[head], samples.surface[head], weight, weight, zero, zero + 0.05, zero + 0.8,
        zero, zero, np.zeros((count, 1)),
    )  # fmt: skip
    moving = find_moving_surfaces(samples, NO_TANGENT)
    usable = find_usable(samples, nearby, support.owner)
    beside = BodyElements(nearby.first, nearby.offset, usable, support.weight)
    shaded = nearby.contrast * nearby.offset > 0
    return EdgePredictions(samples, moving, beside, runs, runs, samples.run, shaded, 0.0 * support.weight)


@pytest.mark.parametrize(("out", "lit", "dark"), [(4, 1, 1.0), (4, -1, 0.0), (-4, 1, 0.0), (-4, -1, 1.0), (4, 0, 0.5)])
def test_what_lies_between_is_dark_where_the_edge_is_bright_beyond(out: int, lit: int, dark: float) -> None:
    """An edge 4 px from its place, bright above, below, or either on half of it; elements elsewhere do not count."""
    line = np.arange(30.0, 170.0)
    pixel, along = np.stack([line, 0 * line + 100], axis=1), np.tile([1.0, 0.0], (len(line), 1))
    samples = samples_at(pixel, along, np.tile([0, 1], (len(line), 1)), np.zeros(len(line), np.int64))
    samples.px_per_mm[:] = [2.0, 1.0]
    up = np.where(lit == 0, np.sign(line - 99.5), lit)[:, None] * [0.0, 1.0]
    there, elsewhere = pixel + np.array([0, out]), pixel - np.array([0, 9])
    index = EdgeIndex(edge_points(np.concatenate([there, elsewhere]), np.concatenate([up, -up])))
    assert find_shaded(look(samples, index), np.array([out / 2, 0.0])).tolist() == [dark, 0.0]


@pytest.mark.parametrize("deeper", [0.0, -3.0, 4.5])
def test_a_floor_moves_and_not_the_walls_that_it_meets(deeper: float) -> None:
    """A floor, 0, between four walls, 1 to 4, seen obliquely: each wall has an edge on the floor and one on the top, 5.
    A floor that moves takes its edges along by .5 px a mm; each of them alone would as well be a wall that has moved
    by half as much, but the walls' upper edges stay."""
    line, rows = np.arange(30.0, 171.0), []
    for wall, y in enumerate((30.0, 70.0, 110.0, 150.0), start=1):
        for floor, place in ((0, y), (5, y + 20)):
            rows.append((np.stack([line, np.full_like(line, place)], axis=1), floor, wall))
    pixel = np.concatenate([row[0] for row in rows])
    count, run = len(line), np.repeat(np.arange(8), len(line))
    surface = np.repeat([row[1:] for row in rows], count, axis=0)
    direction = np.tile([1.0, 0.0], (len(pixel), 1))
    samples = samples_at(pixel, direction, surface, run)
    samples.px_per_mm[:] = [0.5, 1.0]
    offset = np.where(surface[:, 0] == 0, 0.5 * deeper, 0.0)[:, None] * [0.0, 1.0]
    rng = np.random.default_rng(2)
    there = pixel + offset + rng.normal(size=(len(pixel), 1)) * [0.0, 0.1]
    index = EdgeIndex(edge_points(there, np.tile([0.0, 1.0], (len(pixel), 1))))
    moved, _ = seek_moved(look(samples, index), np.zeros(6, bool), 1, NOT_OPPOSED, P)
    assert moved == pytest.approx([deeper, 0, 0, 0, 0, 0], abs=2 * P.moved.step_mm)


D = DisplacementParameters()


def sees(slope: Floats, element: Floats, body: Ints) -> Look:
    """Samples whose one element lies `element` px from where they are in place."""

    def look(x: Floats, reach: float) -> tuple[Floats, Floats]:
        away = element - np.einsum("ni,ni->n", slope, x[body])
        return slope, np.where(np.abs(away) <= reach, away, np.nan)

    return look


def test_two_bodies_lie_where_their_robust_losses_are_least() -> None:
    rng = np.random.default_rng(4)
    p = replace(D, reach_px=(50.0,) * 80, scale=0.02)
    body, slope = np.repeat([0, 1], [80, 60]), rng.normal(size=(140, 4))
    truth = np.array([[1.0, -2.0, 0.5, 0.2], [0.0, 0.3, -1.0, 0.1]])
    element = np.einsum("ni,ni->n", slope, truth[body]) + rng.normal(0, 0.3, 140)
    element[::7] += rng.uniform(-6, 6, 20)  # what is no edge of the body
    counts, sigma = rng.uniform(0.2, 1, 140), np.array([[5.0, 5, 0.3, 0.1], [1e3, 1e3, 1e3, 1e3]])
    found = fit(sees(slope, element, body), body, counts, truth + 0.2, sigma, p)
    scale = p.scale * 50.0
    for one in (0, 1):
        mine = body == one

        def loss(x: Floats, mine: Floats = mine, one: int = one) -> float:
            z = ((element - slope @ x)[mine] / scale) ** 2
            seen = counts[mine] / p.edge_px**2 @ (scale**2 * z / (1 + z))
            return float(seen + ((x / sigma[one]) ** 2).sum())

        at = minimize(loss, truth[one], method="Nelder-Mead", options={"xatol": 1e-8, "fatol": 1e-12, "maxiter": 9999})
        assert found.x[one] == pytest.approx(at.x, abs=1e-4)


def test_the_covariance_is_the_scatter_of_the_places_found() -> None:
    rng = np.random.default_rng(5)
    p, count = replace(D, systematic_px=0.0, edge_px=0.1, scale=10.0), 600
    body = np.repeat(np.arange(count), 100)
    slope = np.tile(rng.normal(size=(100, 4)), (count, 1))
    look = sees(slope, rng.normal(0, 0.1, len(body)), body)
    found = fit(look, body, np.ones(len(body)), np.zeros((count, 4)), np.full((count, 4), 1e3), p)
    assert np.cov(found.x.T) == pytest.approx(found.covariance.mean(axis=0), rel=0.25, abs=2e-5)


def test_edges_that_are_all_drawn_alike_move_a_body_by_so_much() -> None:
    """A shift by 2 px a mm, and no noise: .27 px are .135 mm."""
    slope = np.tile([2.0, 0.0, 0.0, 0.0], (50, 1))
    found = fit(sees(slope, np.full(50, 1.0), FIRST_BODY[:50]), FIRST_BODY[:50], np.ones(50), np.zeros((1, 4)), WIDE, D)
    assert found.x[0] == pytest.approx([0.5, 0, 0, 0], abs=1e-6)
    assert found.covariance[0, 0, 0] ** 0.5 == pytest.approx(0.135, rel=0.01)
    assert found.agree[0] == pytest.approx(50.0)


def test_a_body_of_which_nothing_is_seen_stays() -> None:
    body = FIRST_BODY[:9]
    found = fit(sees(np.ones((9, 4)), np.full(9, 99.0), body), body, np.ones(9), np.zeros((1, 4)), WIDE, D)
    assert isinstance(found, Displacement)
    assert not found.x.any()
    assert found.agree.tolist() == [0.0]


def test_the_nearest_usable_element_is_found() -> None:
    rng = np.random.default_rng(6)
    many = rng.integers(0, 9, 200)
    first = np.append(0, np.cumsum(many))
    offset, usable = rng.uniform(-9, 9, first[-1]), rng.random((first[-1], 2)) < 0.6
    beside = BodyElements(first, offset, usable, np.ones(200))
    sample, side, ahead = rng.integers(0, 200, 500), rng.integers(0, 2, 500), rng.uniform(-5, 5, 500)
    got = beside.find_nearest(sample, side, ahead, 3.0)
    for k in range(500):
        mine = slice(first[sample[k]], first[sample[k] + 1])
        away = offset[mine][usable[mine, side[k]]] - ahead[k]
        away = away[np.abs(away) <= 3.0]
        want = away[np.abs(away).argmin()] if len(away) else np.nan
        assert got[k] == pytest.approx(want, nan_ok=True)


FIRST_BODY = np.zeros(99, np.int64)
WIDE = np.full((1, 4), 1e3)
