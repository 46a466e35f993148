"""What a picture shows of a view, against loops over the same arcs, regions and places."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import permutations
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from shapely import LineString, distance

from relmodel.arrays import Floats, Ints
from vision.cameras.cameras import Camera
from vision.extraction.rows import Primitives, find_regions_at
from vision.localisation.views import ViewArcs, place_points
from vision.localisation.visibility import RayGrid, SurfaceMap, VisibleArcs
from vision.matching import (
    ASSIGNED,
    COVERED,
    DISTANCE,
    ORIENTATION,
    OVERLAP,
    REASONS,
    ViewUnits,
    describe_view,
    match_view,
)
from vision.relations.relations import open_workspace

BENT = Camera(400, 300, np.array([[500.0, 0, 200], [0, 500, 150], [0, 0, 1]]), np.array([-0.3, 0.1, 0.002, -0.001, 0]))
STRAIGHT = replace(BENT, distortion=np.zeros(0))
SHIFT = np.random.default_rng(1).normal(0, 0.6, (2000, 6))


def circle(x: float, y: float, radius: float) -> Floats:
    """Points (n, 2) a px or so apart around a circle."""
    turn = np.linspace(0, 2 * np.pi, int(2 * np.pi * radius), endpoint=False)
    return np.column_stack([x + radius * np.cos(turn), y + radius * np.sin(turn)])


def view(*courses: Floats) -> ViewArcs:
    run: Ints = np.repeat(np.arange(len(courses)), [len(course) for course in courses])
    pixel = np.concatenate(courses)
    ways = [np.roll(course, -1, axis=0) - course for course in courses]
    way = np.concatenate([way / np.linalg.norm(way, axis=1, keepdims=True) for way in ways])
    step = np.concatenate([np.linalg.norm(way, axis=1) for way in ways])
    none, count = np.zeros((len(run), 3)), len(courses)
    numbers = np.arange(count)
    samples = VisibleArcs(
        none, none, run, np.arange(len(run)), np.zeros(len(run), bool), pixel, way, np.ones(len(run)), step, none, none
    )
    return ViewArcs(np.zeros(count, np.int8), numbers, numbers, np.ones(count), samples, run)


def surfaces() -> SurfaceMap:
    """Surface 0 fills the picture but for a square of surface 1; surface 2 lies within that."""
    rows, columns = np.mgrid[0:300:4, 0:400:4].astype(float)
    shown = np.zeros(rows.shape, np.int64)
    shown[20:50, 30:70], shown[30:40, 45:55] = 1, 2
    pixel = np.stack([columns, rows], axis=2)
    directions = np.zeros((*rows.shape, 3))
    rays = RayGrid(directions, pixel, np.full(rows.shape, 16.0), STRAIGHT.matrix, 4)
    return SurfaceMap(STRAIGHT, rays, shown, np.eye(4))


def seen(camera: Camera) -> SurfaceMap:
    return replace(surfaces(), camera=camera)


def described(camera: Camera) -> tuple[ViewUnits, Any]:
    slanted = np.column_stack([np.linspace(60, 140, 161), np.linspace(40, 100, 161)])
    lone = np.array([[250.0, 40.0]])
    level = np.column_stack([np.arange(20.0, 380), np.full(360, 280.0)])
    with np.errstate(invalid="ignore"):
        whole = view(circle(200, 150, 40), slanted, level, lone, np.array([[0.0, 0], [1, 1]]))
    way = np.where(np.isfinite(whole.samples.direction), whole.samples.direction, [0.6, 0.8])
    length = np.nan_to_num(whole.samples.length_px)
    whole = replace(whole, samples=replace(whole.samples, direction=way, length_px=length))
    return describe_view(whole, place_points(whole, SHIFT[: len(whole.run)], camera), seen(camera)), whole


@pytest.mark.parametrize("camera", [BENT, STRAIGHT], ids=["bent", "straight"])
def test_units_of_a_view_are_points_every_4_px_and_surfaces_by_what_they_show(camera: Camera) -> None:
    units, arcs = described(camera)
    step = np.floor(np.cumsum(arcs.samples.length_px) / 4)
    run = arcs.run.tolist()
    some = [i for i in range(len(run)) if i in (0, len(run) - 1) or step[i] > step[i - 1]
            or run[i] != run[i - 1] or run[i] != run[i + 1]]  # fmt: skip
    points = {name: np.asarray(values) for name, values in units.points.rows.items()}
    assert points["view_arc_no"].tolist() == [run[i] for i in some]
    assert points["point_no"].tolist() == list(range(len(some)))
    pixel, way = arcs.samples.pixel[some], arcs.samples.direction[some]
    ideal = np.linalg.inv(camera.matrix) @ np.column_stack([pixel, np.ones(len(pixel))]).T
    np.testing.assert_allclose(np.column_stack([points["x"], points["y"]]), camera.project(ideal.T)[0], atol=6e-3)
    ends = [camera.project((np.linalg.inv(camera.matrix) @ np.column_stack([p, np.ones(len(p))]).T).T)[0]
            for p in (pixel + 1e-3 * way, pixel - 1e-3 * way)]  # fmt: skip
    along = (ends[0] - ends[1]) / np.linalg.norm(ends[0] - ends[1], axis=1, keepdims=True)
    np.testing.assert_allclose(np.column_stack([points["direction_x"], points["direction_y"]]), along, atol=6e-3)
    np.testing.assert_allclose(points["sigma"], np.linalg.norm(SHIFT[some], axis=1), atol=6e-3)
    np.testing.assert_array_equal(units.points.shift, SHIFT[some])
    shown = seen(camera).surface
    assert units.surface.tolist() == [0, 1, 2]
    small = seen(camera)
    small.rays.weight[shown == 2] = 0.59
    assert describe_view(arcs, place_points(arcs, SHIFT[: len(run)], camera), small).surface.tolist() == [0, 1]
    small.rays.weight[shown == 2] = 0.6
    assert describe_view(arcs, place_points(arcs, SHIFT[: len(run)], camera), small).surface.tolist() == [0, 1, 2]


def test_arcs_bound_the_surfaces_4_px_beside_them() -> None:
    camera = STRAIGHT
    units, _ = described(camera)
    p = {name: np.asarray(values) for name, values in units.points.rows.items()}
    shown, pixel = seen(camera).surface, seen(camera).rays.pixel
    times: dict[tuple[int, int], int] = {}
    sums: dict[int, Any] = {}
    for arc, x, y, dx, dy in zip(*(p[n] for n in ("view_arc_no", "x", "y", "direction_x", "direction_y")), strict=True):
        for side in (4, -4):
            column, row = (int(np.rint(v)) for v in (x - side * dy, y + side * dx))  # cells by the camera's matrix
            if 0 <= row < shown.shape[0] and 0 <= column < shown.shape[1]:
                key = (int(arc), int(shown[row, column]))
                times[key] = times.get(key, 0) + 1
        sums.setdefault(int(arc), []).append((x, y))
    r = units.relations
    got = {}
    for kind, a, b, *values in zip(*(np.asarray(r[n]).tolist() for n in (
        "kind", "unit_a", "unit_b", "distance", "distance_sigma", "angle", "angle_sigma")), strict=True):  # fmt: skip
        if kind == "bounds":
            got[a, b] = values
    assert set(got) == {(a, 5 + s) for a, s in times} | {(5 + s, a) for a, s in times}
    for (arc, s), count in times.items():
        line = np.array(sums[arc])
        if len(line) > 3:
            step = np.linalg.norm(np.diff(line, axis=0), axis=1)
            middle = (0.5 * (line[1:] + line[:-1]) * step[:, None]).sum(axis=0) / step.sum()
            x, y = pixel[shown == s].mean(axis=0) - middle
            if np.hypot(x, y) > 8:
                assert np.cos(got[arc, 5 + s][2] - np.arctan2(y, x)) > 0.999
                assert np.cos(got[5 + s, arc][2] - np.arctan2(-y, -x)) > 0.999
        assert got[arc, 5 + s][:2] == pytest.approx([4 * count, 4])


class Sized(SimpleNamespace):
    """Columns of so many rows."""

    def __len__(self) -> int:
        return int(self.count)


@dataclass
class Drawn:
    """An image arc: beside which view arc, shifted by, turned by, first and last point of it, sigma and radius."""

    of: int
    off: float
    turn: float
    first: int
    last: int
    sigma: float = 0.1
    radius: float = np.nan


ARCS = [
    Drawn(0, 0.5, 0.02, 0, 30), Drawn(0, 1.1, 0.0, 4, 20), Drawn(0, 3.0, 0.0, 28, 60, 1.5), Drawn(1, 9.0, 0.0, 0, 40),
    Drawn(1, 0.3, 0.27, 5, 25), Drawn(1, -0.4, 0.25, 26, 50), Drawn(1, 0.2, 0.27, 55, 78, 0.1, 30.0),
    Drawn(2, -1.2, 0.01, 0, 12), Drawn(2, 0.9, 0.0, 12, 78),
]  # fmt: skip


def test_pairs_are_judged_priced_and_struck_as_loops_do() -> None:
    """Arcs of a picture beside three level arcs of a view, and rectangles on its surfaces."""
    lines = [np.column_stack([np.arange(20.0, 340), np.full(320, y)]) for y in (40.0, 140.0, 240.0)]
    arcs = view(*lines)
    seen = surfaces()
    units = describe_view(arcs, place_points(arcs, 0.3 * SHIFT[: len(arcs.run)], Camera(400, 300, BENT.matrix)), seen)
    x, y, normal, number = [], [], [], []
    point_x, first_of = np.asarray(units.points.rows["x"]), [0, 81, 162]
    for k, d in enumerate(ARCS):
        at = np.arange(point_x[first_of[d.of] + d.first], point_x[first_of[d.of] + d.last] + 0.5)
        x += at.tolist()
        y += [lines[d.of][0, 1] + d.off] * len(at)
        normal += [[np.sin(d.turn), np.cos(d.turn)]] * len(at)
        number += [k] * len(at)
    # One that leaves its model arc for most of its way.
    x, y = x + list(np.arange(100.0, 200)), [*y, *[240.2] * 28, *[200.0] * 72]
    normal, number = normal + [[0.0, 1.0]] * 100, number + [len(ARCS)] * 100
    wide = [*ARCS, Drawn(2, 0.2, 0, 0, 0)]
    boxes = [(110, 70, 290, 210), (10, 10, 110, 60), (160, 60, 250, 110), (186, 126, 210, 150)]
    corner = np.array([[(a, b), (c, b), (c, d), (a, d)] for a, b, c, d in boxes])
    regions = Sized(
        count=4,
        outline=corner.reshape(-1, 2), ring_offsets=np.arange(0, 17, 4), ring_region=np.arange(4),
        area=np.array([float((c - a) * (d - b)) for a, b, c, d in boxes]),
    )  # fmt: skip
    columns: dict[str, Any] = {"sigma": np.array([d.sigma for d in wide]), "radius": np.array([d.radius for d in wide])}
    own = Sized(count=len(wide), **columns)
    elements = {
        "edge_element_no": np.arange(len(x)), "x": np.array(x), "y": np.array(y), "contrast": 9.0, "width": 1.0,
        "normal_x": np.array(normal)[:, 0], "normal_y": np.array(normal)[:, 1], "sigma": 0.1,
        "image_arc_no": np.array(number),
    }  # fmt: skip
    none = np.zeros(0)
    relations = {"kind": np.zeros(0, object), "unit_a": none.astype(int), "unit_b": none.astype(int)}
    relations |= dict.fromkeys(("distance", "distance_sigma", "angle", "angle_sigma"), none)
    picture = cast(Primitives, SimpleNamespace(
        arcs=own, regions=regions, arc_elements=elements, relations=relations, shape=(300, 400)))  # fmt: skip
    workspace = open_workspace()
    found = match_view(workspace, 1, picture, units, seen)
    with workspace.write() as connection:
        rows = workspace.columns(
            connection, "matching/arc_pairs", extraction_id=1, run_id=0, view_no=1, reach=10.0, max_along=4.0
        )
    table = zip(*(np.asarray(rows[n]).tolist() for n in (
        "image_arc_no", "view_arc_no", "residual", "angle", "sigma", "across", "elements", "of_elements", "first_point",
        "last_point")), strict=True)  # fmt: skip
    reasons, costs, places, stands = [], {}, {}, []
    for i, v, residual, angle, sigma, across, some, of, first, last in table:
        gate = 3 * np.sqrt(sigma**2 + wide[i].sigma ** 2 + 0.5**2)
        turn = np.radians(15) + (3 * sigma / wide[i].radius if np.isfinite(wide[i].radius) else 0)
        reason = OVERLAP if some / of < 0.3 else ASSIGNED
        reason = DISTANCE if residual > gate else reason
        reason = ORIENTATION if angle > turn else reason
        reasons.append(reason)
        if reason == ASSIGNED:
            nats = 0.5 * ((3 * residual / gate) ** 2 + (3 * angle / turn) ** 2) + 2 * (1 - some / of)
            costs[i, v] = round(32 * nats)
            places[i, v] = [across, np.hypot(wide[i].sigma, 0.5), *units.points.shift[first : last + 1].mean(axis=0)]
            stands.append((residual / gate, i, v, first, last))
    assert {ASSIGNED, ORIENTATION, DISTANCE, OVERLAP} <= set(reasons)
    struck: set[int] = set()
    kept: list[tuple[int, int, int]] = []
    for _, i, v, first, last in sorted(stands):
        common = [min(last, b) - max(first, a) + 1 for w, a, b in kept if w == v]
        if max(common, default=0) > 0.5 * (last - first + 1):
            struck.add(i)
        else:
            kept.append((v, first, last))
    assert struck == {1}
    pixel, shown = seen.rays.pixel.reshape(-1, 2), seen.surface.ravel()
    on = find_regions_at(picture, pixel)
    shares = {}
    for r, s in np.ndindex(4, 3):
        if count := np.sum((on == r) & (shown == s)):
            shares[r, s] = (16 * count, count / np.sum(on == r), count / np.sum(shown == s))
            if shares[r, s][1] >= 0.88:
                costs[len(wide) + r, 3 + s] = round(32 * 6 * (1 - shares[r, s][1]))
    pairs = zip(found.surfaces.region.tolist(), found.surfaces.view_surface.tolist(), strict=True)
    got = zip(found.surfaces.pixels, found.surfaces.region_share, found.surfaces.surface_share, strict=True)
    assert {key: pytest.approx(value) for key, value in zip(pairs, got, strict=True)} == shares
    solved = found.solved.rows
    assert dict(zip(zip(solved.unit.tolist(), solved.label.tolist(), strict=True), solved.cost, strict=True)) == costs
    assert (solved.null_cost == 112).all()
    assert (solved.units, solved.labels, solved.relation_weight, solved.nat_cost) == (14, 6, 112, 32.0)
    assert (solved.null_share, solved.injective, solved.nodes) == (0.0, False, 200)
    assert (solved.units_id, solved.labels_id) == (2, 3)  # sets of no other view's problem
    assert solved.places is not None
    got_places: Any = np.ma.stack([np.ma.asarray(v) for v in solved.places.values()], axis=1)
    np.testing.assert_allclose(got_places[: len(places)], list(places.values()), atol=1e-6)
    assert got_places[len(places) :].mask.all()
    # After the search: what is taken, covered, or has no label that its relations confirm.
    label = found.solved.result.label
    for k, reason in enumerate(reasons):
        i, v = int(found.arcs.image_arc[k]), int(found.arcs.view_arc[k])
        if reason == ASSIGNED:
            chosen = "unrelated" if label[i] < 0 else "assigned" if label[i] == v else "better_elsewhere"
            chosen = "covered" if chosen == "assigned" and i in struck else chosen
            assert REASONS[found.arcs.reason[k]] == chosen
        else:
            assert found.arcs.reason[k] == reason
    assert (found.arcs.reason == COVERED).sum() <= 1


@pytest.mark.parametrize(
    ("share", "ratio", "rough", "centred", "rounded"),
    [
        (1.0, 1.0, 0.0, True, True),
        (0.27, 1.0, 0.0, True, True),
        (0.23, 1.0, 0.0, False, False),  # too little of the way round
        (1.0, 0.92, 0.0, True, True),
        (1.0, 0.88, 0.0, True, False),
        (1.0, 1.0, 0.4, True, True),
        (1.0, 1.0, 0.7, False, False),
    ],
)
def test_arcs_of_a_view_have_centres_and_radii_where_they_show_enough(
    share: float, ratio: float, rough: float, centred: bool, rounded: bool
) -> None:
    """Beside a circle about the same point, and one of the same size; with the standard deviations that they say."""
    t = np.linspace(0, 2 * np.pi * share, 2 * int(200 * share), endpoint=share < 1)
    radial = 50 + rough * np.where(np.arange(len(t)) // 8 % 2, 1, -1)
    drawn = np.column_stack([200 + radial * np.cos(t), 150 + ratio * radial * np.sin(t)])
    arcs = view(circle(200, 150, 70), drawn, circle(330, 150, 50 * np.sqrt(ratio)))
    units = describe_view(arcs, place_points(arcs, np.full((len(arcs.run), 6), 0.1), STRAIGHT), surfaces())
    r = {name: np.asarray(values) for name, values in units.relations.items()}
    spread = np.hypot(0.1 * np.sqrt(6), 0.5)
    for kind, a, b, there in (("concentric", 0, 1, centred), ("equal_radius", 1, 2, rounded)):
        at = np.flatnonzero((r["kind"] == kind) & (r["unit_a"] == a) & (r["unit_b"] == b))
        assert len(at) == there
        if there:
            own, other = (1.0, 1 / share) if kind == "concentric" else (1 / share, 1.0)
            assert r["distance"][at[0]] == pytest.approx(0, abs=0.15)
            assert r["distance_sigma"][at[0]] == pytest.approx(spread * np.hypot(own, other), rel=0.06)


def test_gaps_between_arcs_of_a_view_are_those_of_their_courses() -> None:
    """Also of a point, which is as long as a pixel."""
    units, _ = described(STRAIGHT)
    p = {name: np.asarray(values) for name, values in units.points.rows.items()}
    lines = [np.column_stack([p["x"], p["y"]])[p["view_arc_no"] == k] for k in range(5)]
    lines[3] = lines[3] + 0.5 * np.array([[-0.6, -0.8], [0.6, 0.8]])
    r = {name: np.asarray(values).tolist() for name, values in units.relations.items()}
    gaps = {(a, b): d for kind, a, b, d in zip(r["kind"], r["unit_a"], r["unit_b"], r["distance"], strict=True)
            if kind == "near" and max(a, b) < 5}  # fmt: skip
    expected = {(a, b): distance(LineString(lines[a]), LineString(lines[b])) for a, b in permutations(range(5), 2)}
    assert gaps == {pair: pytest.approx(gap, abs=0.01) for pair, gap in expected.items() if gap < 140}


def test_surfaces_of_a_view_border_on_and_surround_each_other() -> None:
    units, _ = described(STRAIGHT)
    r = {name: np.asarray(values).tolist() for name, values in units.relations.items()}
    pairs = [(a - 5, b - 5) for a, b in zip(r["unit_a"], r["unit_b"], strict=True)]
    rows = dict(zip(zip(r["kind"], pairs, strict=True), r["distance"], strict=True))
    assert {pair for kind, pair in rows if kind == "adjacent"} == {(0, 1), (1, 0), (1, 2), (2, 1)}
    assert {pair for kind, pair in rows if kind == "surrounds"} == {(0, 1), (1, 2)}
    np.testing.assert_allclose(rows["adjacent", (1, 2)], 160.0, rtol=0.1)  # ten cells of 4 px on each side
