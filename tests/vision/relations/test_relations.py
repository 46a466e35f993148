"""Relations of curves and areas whose places are known, against closed forms, dense sampling and simulation."""

from dataclasses import replace
from itertools import permutations

import numpy as np
import pytest
from shapely import LineString, distance

from relmodel.arrays import Bools, Floats
from vision.relations.relations import (
    CONCENTRIC,
    EQUAL_RADIUS,
    JUNCTION,
    KINDS,
    NEAR,
    PARALLEL,
    TOLERANCES,
    Areas,
    ImageCurves,
    RelationParameters,
    Relations,
    relate,
)

EMPTY = np.zeros(0)
NO_AREAS = Areas(EMPTY, EMPTY, EMPTY, EMPTY, np.zeros(0, np.int32), np.zeros(1, np.int32), EMPTY, EMPTY)


def curves(*lines: list[tuple[float, float]] | Floats, sigma: float = 0.1) -> ImageCurves:
    """Polylines of these points, each as salient as it is long, without centres."""
    points = [np.asarray(line, np.float64) for line in lines]
    count = len(points)
    packed = np.concatenate(points) if points else np.zeros((0, 2))
    length = np.array([np.sum(np.hypot(*np.diff(line, axis=0).T)) for line in points])
    return ImageCurves(
        offsets=np.concatenate([[0], np.cumsum([len(line) for line in points])]).astype(np.int64),
        x=packed[:, 0],
        y=packed[:, 1],
        sigma=np.full(count, sigma),
        end_sigma=np.full(count, 2.0),
        angle_sigma=np.full(count, 0.01),
        salience=length,
        **{name: np.full(count, np.nan) for name in ("centre_x", "centre_y", "centre_sigma", "radius", "radius_sigma")},
    )


def circles(*rings: tuple[float, float, float]) -> ImageCurves:
    """Circles (x, y, radius), with what their fits would say."""
    turn = np.linspace(0, 2 * np.pi, 65)
    drawn = curves(*(np.column_stack([x + r * np.cos(turn), y + r * np.sin(turn)]) for x, y, r in rings))
    x, y, radius = np.array(rings).T
    spread = np.full(len(rings), 0.2)
    return replace(drawn, centre_x=x, centre_y=y, radius=radius, centre_sigma=spread, radius_sigma=spread)


def square(x: float, y: float, half: float) -> Areas:
    """One square region about (x, y)."""
    return Areas(
        area=np.array([4 * half**2]),
        centroid_x=np.array([x]),
        centroid_y=np.array([y]),
        sigma=np.array([1.0]),
        ring_region=np.zeros(1, np.int32),
        ring_offsets=np.array([0, 4], np.int32),
        x=x + half * np.array([-1.0, 1.0, 1.0, -1.0]),
        y=y + half * np.array([-1.0, -1.0, 1.0, 1.0]),
    )


def only(found: Relations, kind: int, a: int, b: int) -> tuple[float, ...]:
    """Distance, its sigma, angle, its sigma of the one such row."""
    rows = np.flatnonzero((found.kind == kind) & (found.a == a) & (found.b == b))
    assert len(rows) == 1
    row = rows[0]
    return tuple(map(float, (found.distance[row], found.distance_sigma[row], found.angle[row], found.angle_sigma[row])))


def scene(seed: int) -> ImageCurves:
    """Wandering polylines, some of which cross, and two straight ones beside each other."""
    rng = np.random.default_rng(seed)
    lines = [np.array([[20.0, 20.0], [120.0, 25.0]]), np.array([[30.0, 40.0], [130.0, 46.0]])]
    for points in rng.integers(2, 30, 24):
        heading = np.cumsum(np.append(rng.uniform(0, 2 * np.pi), rng.normal(0, 0.2, points - 2)))
        steps = 6.0 * np.column_stack([np.cos(heading), np.sin(heading)])
        lines.append(rng.uniform(0, 250, 2) + np.vstack([np.zeros(2), np.cumsum(steps, axis=0)]))
    return curves(*lines)


@pytest.mark.parametrize("seed", range(4))
def test_gaps_are_those_of_another_library(seed: int) -> None:
    drawn = scene(seed)
    shapes = [LineString(line) for line in np.split(np.column_stack([drawn.x, drawn.y]), drawn.offsets[1:-1])]
    found = relate(drawn, NO_AREAS, RelationParameters(neighbours=99, least_neighbours=99, radius=40.0))
    near = found.kind == NEAR
    gaps = {(a, b): gap for a, b, gap in zip(found.a[near], found.b[near], found.distance[near], strict=True)}
    true = {(a, b): distance(shapes[a], shapes[b]) for a, b in permutations(range(len(drawn)), 2)}
    assert gaps.keys() == {pair for pair, gap in true.items() if gap <= 40.0}
    assert min(gaps.values()) == 0.0
    for pair, gap in gaps.items():
        assert gap == pytest.approx(true[pair], abs=1e-9)


def test_turning_and_moving_the_picture_turns_the_bearings_and_nothing_else() -> None:
    drawn, turn = scene(2), 0.7
    cosine, sine = np.cos(turn), np.sin(turn)
    moved = replace(drawn, x=cosine * drawn.x - sine * drawn.y + 31.0, y=sine * drawn.x + cosine * drawn.y - 8.0)
    one, other = relate(drawn, NO_AREAS), relate(moved, NO_AREAS)
    for name in ("kind", "a", "b"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
    for name in ("distance", "distance_sigma", "angle_sigma"):
        np.testing.assert_allclose(getattr(one, name), getattr(other, name), atol=1e-9)
    turned = other.angle - one.angle - np.where(one.kind == NEAR, turn, 0.0)
    np.testing.assert_allclose(np.sin(turned / 2), 0, atol=1e-9)


def test_every_relation_has_its_inverse_and_bearings_point_back() -> None:
    found = relate(scene(3), square(120.0, 120.0, 40.0))
    rows = {(k, a, b): i for i, (k, a, b) in enumerate(zip(found.kind, found.a, found.b, strict=True))}
    assert len(rows) == len(found)
    inverse = np.array([rows[k, b, a] for k, a, b in rows])
    near = found.kind == NEAR
    np.testing.assert_array_equal(found.distance[near], found.distance[inverse][near])
    np.testing.assert_allclose(np.cos(found.angle - found.angle[inverse])[near], -1, atol=1e-12)
    np.testing.assert_array_equal(found.angle[~near], found.angle[inverse][~near])
    assert np.all(np.abs(found.angle) <= np.pi)
    assert {NEAR, PARALLEL, JUNCTION} <= set(found.kind)


def test_parallel_lines_know_on_which_side_they_are() -> None:
    # y down: walking to the right, the left is above
    found = relate(curves([(0, 50), (80, 50)], [(10, 30), (90, 32)], [(200, 50.5), (150, 50.5)]), NO_AREAS)
    assert only(found, PARALLEL, 0, 1)[0] == pytest.approx(19.0)
    assert only(found, PARALLEL, 0, 1)[2] == pytest.approx(np.arctan2(2, 80))
    assert only(found, PARALLEL, 1, 0)[0] == pytest.approx(-19.0, abs=0.3)
    # in line with it, across a gap, walked the other way
    assert only(found, PARALLEL, 0, 2)[0] == pytest.approx(-0.5)
    assert only(found, NEAR, 0, 2)[0] == pytest.approx(np.hypot(70, 0.5))
    assert only(found, NEAR, 0, 1)[2] == pytest.approx(np.arctan2(-19, 10))


def test_flat_arcs_count_as_lines_and_bent_ones_do_not() -> None:
    turn = np.linspace(-0.1, 0.1, 9)
    flat = np.column_stack([200 * np.sin(turn), 20 - 200 * (1 - np.cos(turn))])
    bent = np.column_stack([40 * np.sin(5 * turn), 40 - 40 * (1 - np.cos(5 * turn))])
    found = relate(curves([(-30, 0), (30, 0)], flat, bent), NO_AREAS)
    parallel = found.kind == PARALLEL
    assert set(zip(found.a[parallel], found.b[parallel], strict=True)) == {(0, 1), (1, 0)}


def test_what_meets() -> None:
    crossing = [(0.0, 0.0), (60.0, 0.0)], [(30.0, -30.0), (30.0, 30.0)]
    ending = [(0.0, 3.0), (-40.0, 43.0)]
    found = relate(curves(*crossing, ending), NO_AREAS)
    joined = found.kind == JUNCTION
    assert set(zip(found.a[joined], found.b[joined], strict=True)) == {(0, 2), (2, 0)}
    gap, spread, angle, turn_spread = only(found, JUNCTION, 0, 2)
    assert (gap, angle) == pytest.approx((3.0, np.pi / 4))
    assert spread == pytest.approx(2 * np.sqrt(2))  # both with an end
    assert turn_spread == pytest.approx(0.01 * np.sqrt(2))


def test_circles_about_one_centre_and_of_one_size() -> None:
    found = relate(circles((50, 50, 30), (50.6, 50.8, 15), (150, 50, 33), (150, 150, 60)), NO_AREAS)
    assert only(found, CONCENTRIC, 0, 1)[0] == pytest.approx(1.0)
    assert only(found, EQUAL_RADIUS, 0, 2)[0] == pytest.approx(3.0)
    assert only(found, EQUAL_RADIUS, 2, 0)[0] == pytest.approx(-3.0)
    assert np.count_nonzero(np.isin(found.kind, (CONCENTRIC, EQUAL_RADIUS))) == 4


def test_a_region_is_as_far_as_its_outline() -> None:
    found = relate(curves([(0, 100), (60, 100)], [(90, 100), (110, 100)]), square(100.0, 100.0, 30.0))
    assert only(found, NEAR, 0, 2)[0] == pytest.approx(10.0)
    assert only(found, NEAR, 0, 2)[2] == pytest.approx(0.0)
    # a region chooses one arc, and arcs none
    assert set(found.b[(found.kind == NEAR) & (found.a == 2)]) == {0}


def test_streaks_do_not_crowd_out_what_matters() -> None:
    edges = [[(0.0, 90.0 * i), (200.0, 90.0 * i)] for i in range(3)]
    streaks = [[(9.0 * i, 20.0), (9.0 * i + 6, 20.0)] for i in range(24)]
    drawn = curves(*edges, *streaks)
    doubtful = replace(drawn, salience=np.where(np.arange(27) < 3, 200.0, 0.1))
    parameters = RelationParameters(neighbours=4, least_neighbours=0)

    def has(found: Relations) -> Bools:
        return np.asarray((found.kind == NEAR) & (found.a == 0) & (found.b == 1))

    assert np.count_nonzero(has(relate(doubtful, NO_AREAS, parameters))) == 1
    assert not has(relate(replace(drawn, salience=np.full(27, 10.0)), NO_AREAS, parameters)).any()


def test_stated_deviations_are_those_of_lines_drawn_again_and_again() -> None:
    """Lines off by `sigma` across and by `angle_sigma` in direction about their middles."""
    rng, sigma, lean = np.random.default_rng(0), 0.4, 0.01
    middle = np.array([[0.0, 0.0], [30.0, 25.0]])
    half = np.array([60.0, 40.0])
    values = []
    for _ in range(400):
        angle = rng.normal(0, lean, 2)
        along = half[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
        centre = middle + np.column_stack([np.zeros(2), rng.normal(0, sigma, 2)])
        lines = [[tuple(c - d), tuple(c + d)] for c, d in zip(centre, along, strict=True)]
        values.append(only(relate(curves(*lines), NO_AREAS), PARALLEL, 0, 1)[0])
    true = replace(curves([(-60, 0), (60, 0)], [(-10, 25), (70, 25)], sigma=sigma), angle_sigma=np.full(2, lean))
    offset, stated, _, _ = only(relate(true, NO_AREAS), PARALLEL, 0, 1)
    assert np.mean(values) == pytest.approx(offset, abs=3 * stated / 20)
    assert np.std(values) == pytest.approx(stated, rel=0.15)


def test_nothing_is_related_to_nothing() -> None:
    assert len(relate(curves(), NO_AREAS)) == 0
    assert len(relate(curves([(0, 0), (9, 0)]), NO_AREAS)) == 0
    assert len(relate(curves(), square(0.0, 0.0, 5.0))) == 0


def test_every_kind_has_a_tolerance() -> None:
    assert set(TOLERANCES) == set(KINDS)
    assert all(tolerance.nats > 0 for tolerance in TOLERANCES.values())
