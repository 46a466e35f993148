"""Relations of curves and areas whose places are known, against closed forms, dense sampling and simulation."""

from dataclasses import replace
from itertools import permutations

import numpy as np
import pytest
from shapely import LinearRing, LineString, distance
from shapely.ops import nearest_points

from relmodel.arrays import Floats
from vision.relations.relations import (
    CONCENTRIC,
    EQUAL_RADIUS,
    JUNCTION,
    KINDS,
    NEAR,
    PARALLEL,
    Areas,
    ImageCurves,
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


def test_nothing_is_related_to_nothing() -> None:
    assert len(relate(curves(), NO_AREAS)) == 0
    assert len(relate(curves([(0, 0), (9, 0)]), NO_AREAS)) == 0
    assert len(relate(curves(), square(0.0, 0.0, 5.0))) == 0


def rough(seed: int) -> tuple[ImageCurves, Areas]:
    """Curves of all sizes, saliences and uncertainties, circles, and squares."""
    rng = np.random.default_rng(seed)
    lines = [np.array([[x, y], [x + 60 * np.cos(t), y + 60 * np.sin(t)]]) for x, y, t in zip(
        rng.uniform(0, 200, 10), rng.uniform(0, 200, 10), rng.normal(0, 0.2, 10) + rng.integers(0, 2, 10) * np.pi / 2,
        strict=True)]  # fmt: skip
    lines += [line + np.array([[0.2, 7.0], [0.3, 7.7]]) for line in lines[:3]] + [
        np.array([line[1] + [2, 2], line[1] + [16, 19]]) for line in lines[:4]
    ]
    lines += [np.array([[x, 20.0], [x + d, 20]]) for x, d in ((30, 14.9), (30, 15.1))]
    lines += [np.array([[20.0, 90], [70, 90 + h], [120, 90]]) for h in (3.9, 4.1)]
    turn = np.linspace(0, 2 * np.pi, 33)[:, None]
    rings = [(60, 60, 20), (62, 66, 9), (150, 60, 26), (150, 150, 30), (60, 68.5, 15), (50, 160, 40)]
    lines += [np.array([[x, y]]) + r * np.hstack([np.cos(turn), np.sin(turn)]) for x, y, r in rings]
    drawn, n, k = curves(*lines), len(lines), len(rings)
    centre = np.full((4, n), np.nan)
    centre[:3, n - k :] = np.array(rings).T
    centre[3, n - k :] = [0.3, 2.1, 1.9, 2.0, 0.2, 0.4]
    drawn = replace(
        drawn, sigma=rng.uniform(0.05, 0.9, n), end_sigma=rng.uniform(0.02, 3, n),
        angle_sigma=rng.uniform(0.001, 0.05, n), salience=drawn.salience * rng.choice([0.01, 0.1, 0.2, 1], n),
        centre_x=centre[0], centre_y=centre[1],
        radius=centre[2], centre_sigma=centre[3], radius_sigma=0.5 * centre[3],
    )  # fmt: skip
    squares = [
        square(x, y, half) for x, y, half in ((40, 40, 12), (130, 100, 25), (190, 190, 4), (165, 160, 14), (60, 200, 6))
    ]
    names = ("area", "centroid_x", "centroid_y", "sigma", "x", "y")
    return drawn, Areas(
        **{name: np.concatenate([getattr(s, name) for s in squares]) for name in names},
        ring_region=np.arange(5, dtype=np.int32), ring_offsets=np.arange(0, 21, 4, dtype=np.int32),
    )  # fmt: skip


def by_loops(drawn: ImageCurves, areas: Areas) -> dict[tuple[int, int, int], list[float]]:
    """All relations by their definitions, pair by pair, with the gaps of another library."""
    count = len(drawn)
    points = np.split(np.column_stack([drawn.x, drawn.y]), drawn.offsets[1:-1])
    rings = np.column_stack([areas.x, areas.y]).reshape(-1, 4, 2)
    shapes = [LineString(p) for p in points] + [LinearRing(ring) for ring in rings]
    middles, spread = [], []
    for p, sigma, end in zip(points, drawn.sigma, drawn.end_sigma, strict=True):
        step = np.linalg.norm(np.diff(p, axis=0), axis=1)
        middles.append((0.5 * (p[1:] + p[:-1]) * step[:, None]).sum(axis=0) / step.sum())
        spread.append(np.sqrt(sigma**2 + end**2 / 2))
    middles += list(np.column_stack([areas.centroid_x, areas.centroid_y]))
    spread += areas.sigma.tolist()
    salience: list[float] = [*drawn.salience.tolist(), *(0.6 * np.sqrt(areas.area)).tolist()]
    gaps = {(a, b): distance(shapes[a], shapes[b]) for a, b in permutations(range(len(shapes)), 2)}
    gaps = {(a, b): gap for (a, b), gap in gaps.items() if gap < (140 if max(a, b) < count else 30)}
    chosen: set[tuple[int, int]] = set()
    for a in range(len(shapes)):
        for arcs, most in (
            (True, round(1 + 15 * min(salience[a] / 15, 1)) if a < count else 1),
            (False, int(a >= count)),
        ):
            mine = [b for c, b in gaps if c == a and (b < count) == arcs]
            mine = [b for _, b in sorted(((gaps[a, b] + 15) / salience[b], b) for b in mine)]
            chosen |= {(a, b) for b in mine[:most]} | {(b, a) for b in mine[:most]}
    at_end = {}
    for a, b in gaps:
        if a < count:
            near = nearest_points(shapes[a], shapes[b])[0]
            ends = points[a][[0, -1]] - [near.x, near.y]
            at_end[a, b] = bool(np.linalg.norm(ends, axis=1).min() < 1e-9)

    def gap_sigma(a: int, b: int) -> float:
        own = [drawn.sigma[u] if u < count else areas.sigma[u - count] for u in (a, b)]
        ends = [at_end.get((a, b), False), at_end.get((b, a), False)]
        return float(
            np.hypot(*(max(s, drawn.end_sigma[u]) if e else s for s, e, u in zip(own, ends, (a, b), strict=True)))
        )

    out: dict[tuple[int, int, int], list[float]] = {}
    for a, b in chosen:
        way = middles[b] - middles[a]
        apart, sigma = np.hypot(*way), np.hypot(spread[a], spread[b])
        turn = sigma / apart if apart * np.pi > sigma else np.pi
        out[NEAR, a, b] = [gaps[a, b], gap_sigma(a, b), np.arctan2(way[1], way[0]), turn]
    chords = [p[-1] - p[0] for p in points]
    straight = []
    for p, chord, own in zip(points, chords, salience, strict=False):
        length = max(float(np.hypot(chord[0], chord[1])), 1e-9)
        bow = np.abs(chord[0] * (p - p[0])[:, 1] - chord[1] * (p - p[0])[:, 0]).max() / length
        straight.append(bool(length >= 15 and own >= 1) and bow <= 0.04 * length)
    for a, b in gaps:
        if max(a, b) >= count:
            continue
        if straight[a] and straight[b]:
            d, e = (chords[u] / np.linalg.norm(chords[u]) for u in (a, b))
            angle = np.arccos(min(abs(d @ e), 1.0))
            if angle <= np.radians(15):
                way = points[b][[0, -1]].mean(axis=0) - points[a][[0, -1]].mean(axis=0)
                lever = np.sqrt(drawn.sigma[a] ** 2 + drawn.sigma[b] ** 2 + (drawn.angle_sigma[a] * (way @ d)) ** 2)
                turned = np.hypot(drawn.angle_sigma[a], drawn.angle_sigma[b])
                out[PARALLEL, a, b] = [way[0] * d[1] - way[1] * d[0], lever, angle, turned]
        if gaps[a, b] <= 10 and (at_end[a, b] or at_end[b, a]) and min(salience[a], salience[b]) >= 1:
            turned = np.hypot(drawn.angle_sigma[a], drawn.angle_sigma[b])
            d, e = (chords[u] / max(np.linalg.norm(chords[u]), 1e-9) for u in (a, b))
            meets = np.arccos(min(abs(d @ e), 1.0)) if len(points[a]) == len(points[b]) == 2 else np.nan
            out[JUNCTION, a, b] = [gaps[a, b], gap_sigma(a, b), meets, turned]
        apart = np.hypot(drawn.centre_x[a] - drawn.centre_x[b], drawn.centre_y[a] - drawn.centre_y[b])
        unsure = np.hypot(drawn.centre_sigma[a], drawn.centre_sigma[b])
        if apart <= 8 and unsure <= np.sqrt(8.0):
            out[CONCENTRIC, a, b] = [apart, unsure, 0, 0]
        if abs(drawn.radius[a] - drawn.radius[b]) <= 0.25 * max(drawn.radius[a], drawn.radius[b]):
            unsure = np.hypot(drawn.radius_sigma[a], drawn.radius_sigma[b])
            out[EQUAL_RADIUS, a, b] = [drawn.radius[b] - drawn.radius[a], unsure, 0, 0]
    return out


@pytest.mark.parametrize("seed", range(3))
def test_relations_are_those_that_loops_find_by_their_definitions(seed: int) -> None:
    drawn, areas = rough(seed)
    found, expected = relate(drawn, areas), by_loops(drawn, areas)
    rows = dict(zip(zip(found.kind.tolist(), found.a.tolist(), found.b.tolist(), strict=True), zip(
        found.distance, found.distance_sigma, found.angle, found.angle_sigma, strict=True), strict=True))  # fmt: skip
    assert set(rows) == set(expected)
    assert {kind for kind, _, _ in expected} == {NEAR, PARALLEL, JUNCTION, CONCENTRIC, EQUAL_RADIUS}
    assert np.isfinite([values[2] for (kind, _, _), values in expected.items() if kind == JUNCTION]).any()
    for key, values in expected.items():
        known = np.isfinite(values)
        np.testing.assert_allclose(
            np.array(rows[key])[known], np.array(values)[known], rtol=1e-6, atol=1e-6, err_msg=str(key)
        )
    columns = {name: np.asarray(values).tolist() for name, values in found.rows().items()}
    assert (columns["unit_a"], columns["unit_b"]) == (found.a.tolist(), found.b.tolist())
    assert columns["kind"] == [KINDS[kind] for kind in found.kind]
