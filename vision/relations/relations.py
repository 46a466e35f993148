"""Relations among units of one picture or view, how those of true partners differ, and problems joined from them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from math import radians

import numpy as np
import numpy.typing as npt
from sqlalchemy import URL

from relmodel.arrays import Bools, Columns, Floats, Ints, Ints32, Rows
from relmodel.labelling.problem import MatchingProblem, MatchingResult, matching_problem, result_rows
from relmodel.labelling.solve import MODES, PAPER, solve
from relmodel.store import sql
from relmodel.store.database import Database
from relmodel.store.engine import connect

# Chosen on left and right pictures of seven rendered pairs, on seven others (benchmarks/results/extraction.md).


@dataclass(frozen=True)
class RelationParameters:
    """Which pairs of units are related."""

    radius: float = 140.0  # px: arcs whose gap is greater are not related
    region_radius: float = 30.0  # px: the same where one is a region, which chooses only what is nearest
    neighbours: int = 16  # arcs, at most, that an arc of full salience chooses to be `near` to
    least_neighbours: int = 1  # the same of an arc of no salience
    full_salience: float = 15.0  # px: from there on an arc chooses as many as it may
    region_neighbours: int = 1  # arcs, and regions, that a region is `near` to: borders relate those that touch
    region_salience: float = 0.6  # salience of a region over the root of its area
    touch: float = 15.0  # px added to gaps when neighbours are ranked, so that curves that touch do not all come first
    min_salience: float = 1.0  # px: what is less is parallel to nothing and meets nothing: streaks are by the hundred
    min_line: float = 15.0  # px: shorter lines have no direction to speak of
    max_bow: float = 0.04  # share of its chord by which a line may leave it: elsewhere it is seen as a flat arc
    max_angle: float = radians(15.0)  # rad by which lines may miss being parallel
    junction_reach: float = 10.0  # px: what comes nearer with an end meets
    max_centre_sigma: float = 2.0  # px: a centre less certain says nothing of concentricity
    max_centre_distance: float = 8.0  # px between the centres of concentric arcs
    max_radius_change: float = 0.25  # share of the greater of two equal radii by which they may differ


# How relations of true partners differ, and how much evidence their agreement is.


@dataclass(frozen=True)
class Tolerance:
    """Of relations of one kind.

    The distances of units a and b and of labels k and l differ with a standard deviation of `distance` px plus
    `distance_share` of the unit side's, their angles with one of `angle` rad (bearings around the circle), besides
    those that both relations have of their own: so much is due to where arcs are cut and to light.  Of a unit only
    relations of at most `reach` px count, while its labels may have longer ones, so that none at the rim is missed by a
    pixel. `nats` is the evidence of full agreement: the log ratio of the odds of agreement within two standard
    deviations, for true partners and for a wrong label of a.  A difference that is less likely by so much confirms
    nothing.

    Measured on left against right pictures of seven rendered pairs with partners
    by the truth of rendering; wrong labels: others within 60 px, arcs within 30 degrees of the direction."""

    distance: float
    distance_share: float
    angle: float
    reach: float
    nats: float


FAR = 1e6  # px: no limit
TOLERANCES = {
    "near": Tolerance(3.0, 0.15, 0.3, 80.0, 3.5),
    "parallel": Tolerance(3.0, 0.225, 0.1125, 60.0, 4.0),
    "junction": Tolerance(2.25, 0.375, 0.45, 3.0, 5.5),
    "concentric": Tolerance(6.0, 0.225, 0.075, FAR, 3.0),
    "equal_radius": Tolerance(6.0, 0.225, 0.075, FAR, 3.0),
    "bounds": Tolerance(18.0, 0.375, 0.45, FAR, 4.0),
    "adjacent": Tolerance(30.0, 0.375, 0.45, FAR, 3.5),
    "surrounds": Tolerance(30.0, 0.375, 0.45, FAR, 3.5),
}
"""Concentric and surrounds are too rare to be measured (10 and 13 of partners): as equal_radius and adjacent."""


# Relations among the units of one picture or one predicted view: each a distance and an angle with their standard
# deviations, after Shapiro and Haralick (1981).
#
# It knows neither pictures nor models, only curves in px of an image and areas with outlines. Whether two relations
# agree is decided where they are compared (`relations.py`); here all that might agree are admitted.

KINDS = ("near", "parallel", "junction", "concentric", "equal_radius", "bounds", "adjacent", "surrounds")
NEAR, PARALLEL, JUNCTION, CONCENTRIC, EQUAL_RADIUS, BOUNDS, ADJACENT, SURROUNDS = range(len(KINDS))
_DEFAULTS = RelationParameters()


@dataclass(frozen=True)
class ImageCurves:
    """Arcs: columns of length n and packed polylines, px.

    Curve i runs through the points `x`, `y` from `offsets[i]` to `offsets[i + 1]`, two at least, from its start to its
    end.  `sigma` is the standard deviation of its place across, `end_sigma` that of its
    ends along it (px), `angle_sigma` that of its direction (rad).  `salience` (px) is how much of it other pictures
    will probably show: its length, less where it is doubtful.  `centre_x`, `centre_y`, `radius` and their standard
    deviations are NaN for what has none; of an ellipse `radius` is NaN."""

    offsets: Ints
    x: Floats
    y: Floats
    sigma: Floats
    end_sigma: Floats
    angle_sigma: Floats
    salience: Floats
    centre_x: Floats
    centre_y: Floats
    centre_sigma: Floats
    radius: Floats
    radius_sigma: Floats

    def __len__(self) -> int:
        return len(self.sigma)


@dataclass(frozen=True)
class Areas:
    """Regions: columns of length n and packed closed rings, px.

    Ring j, of region `ring_region[j]` (ascending, one at least each), has the vertices from `ring_offsets[j]` to
    `ring_offsets[j + 1]` of `x`, `y`.  `sigma` (px) is the standard deviation of the outline's place."""

    area: Floats
    centroid_x: Floats
    centroid_y: Floats
    sigma: Floats
    ring_region: Ints32
    ring_offsets: Ints32
    x: Floats
    y: Floats

    def __len__(self) -> int:
        return len(self.area)


@dataclass(frozen=True)
class Relations(Rows):
    """Columns of one length: `kind` indexes `KINDS`; units a and b, curves by number first, then areas; every row has
    its inverse, but for surrounds, where a is the outer one.  Distances in px, angles in rad.

    | kind | distance | angle |
    | --- | --- | --- |
    | near | least gap | bearing of the middle of b from that of a, from x towards y |
    | parallel (straight) | of the middle of b from the line of a, to its left | between the lines |
    | junction (an end of one at the other) | least gap | between the tangents there |
    | concentric | between the centres | 0 |
    | equal_radius | radius of b less that of a | 0 |
    | bounds, adjacent, surrounds | length of the common border | bearing, as of near |

    A bearing is above -pi and at most pi, any other angle between 0 and pi / 2; what is 0 by its kind has sigma 0."""

    kind: npt.NDArray[np.int8]
    a: Ints32
    b: Ints32
    distance: Floats
    distance_sigma: Floats
    angle: Floats
    angle_sigma: Floats

    def rows(self) -> Columns:
        """Columns of unit_relation, `unit_set_id` left out."""
        own = self.columns()
        named = {"kind": np.array(KINDS, object)[own.pop("kind")], "unit_a": own.pop("a"), "unit_b": own.pop("b")}
        return named | own


@dataclass(frozen=True)
class Middles:
    """Where the units (n,) are as wholes, px, and how sure that is."""

    x: Floats
    y: Floats
    sigma: Floats

    def bearing(self, a: npt.NDArray[np.integer], b: npt.NDArray[np.integer]) -> tuple[Floats, Floats]:
        """Directions (rad) from units a to units b (m,), and their standard deviations; pi where they are one."""
        dx, dy = self.x[b] - self.x[a], self.y[b] - self.y[a]
        spread = np.hypot(self.sigma[a], self.sigma[b])
        apart = np.hypot(dx, dy)
        return np.arctan2(dy, dx), np.where(apart * np.pi > spread, spread / np.maximum(apart, 1e-9), np.pi)


@dataclass(frozen=True)
class _Segments:
    """The courses of all units as segments (m, 4: x and y of both ends), packed by unit, and their boxes (n, 4)."""

    ends: Floats
    offsets: Ints
    boxes: Floats


def relate(curves: ImageCurves, areas: Areas, parameters: RelationParameters = _DEFAULTS) -> Relations:
    """Relations of all kinds that follow from places only, up to the gaps that `parameters` allow."""
    p = parameters
    pairs = _find_gaps(_join(curves, areas), len(curves), p)
    middles = find_middles(curves, areas)
    return Relations.stack(
        [
            _near(curves, areas, pairs, middles, p),
            _parallels(curves, pairs, p),
            _junctions(curves, pairs, p),
            *_circles(curves, pairs, p),
        ]
    )


def relate_both_ways(
    kind: int, a: npt.NDArray[np.integer], b: npt.NDArray[np.integer], *values: npt.ArrayLike
) -> Relations:
    """Relations of one kind and their inverses; `values`: distance, its sigma, angle, its sigma, each (m,), or (2 m,)
    where those of the inverses differ, or a number."""
    count = len(a)
    columns = [np.resize(np.atleast_1d(np.asarray(value, np.float64)), 2 * count) for value in values]
    return Relations(
        np.full(2 * count, kind, np.int8),
        np.concatenate([a, b]).astype(np.int32),
        np.concatenate([b, a]).astype(np.int32),
        *columns,
    )


def find_middles(curves: ImageCurves, areas: Areas) -> Middles:
    """The middles of the curves, by length, and the centroids of the areas."""
    segments, offsets = _segments_of_curves(curves)
    length = np.maximum(np.hypot(segments[:, 2] - segments[:, 0], segments[:, 3] - segments[:, 1]), 1e-9)
    place = 0.5 * (segments[:, :2] + segments[:, 2:]) * length[:, None]
    weighed = np.column_stack([place, length])
    sums = np.add.reduceat(weighed, offsets[:-1]) if len(curves) else weighed
    middle = sums[:, :2] / sums[:, 2:]
    spread = np.hypot(curves.sigma, curves.end_sigma / np.sqrt(2.0))
    return Middles(
        np.concatenate([middle[:, 0], areas.centroid_x]),
        np.concatenate([middle[:, 1], areas.centroid_y]),
        np.concatenate([spread, areas.sigma]),
    )


def _segments_of_curves(curves: ImageCurves) -> tuple[Floats, Ints]:
    last = np.zeros(len(curves.x), np.bool_)
    last[curves.offsets[1:] - 1] = True
    start = np.flatnonzero(~last)
    ends = np.column_stack([curves.x[start], curves.y[start], curves.x[start + 1], curves.y[start + 1]])
    return ends, curves.offsets - np.arange(len(curves.offsets))


def _join(curves: ImageCurves, areas: Areas) -> _Segments:
    ends, offsets = _segments_of_curves(curves)
    following = np.arange(1, len(areas.x) + 1)
    following[areas.ring_offsets[1:] - 1] = areas.ring_offsets[:-1]
    outline = np.column_stack([areas.x, areas.y, areas.x[following], areas.y[following]])
    first_ring = np.searchsorted(areas.ring_region, np.arange(1, len(areas) + 1))
    ends = np.concatenate([ends, outline])
    offsets = np.concatenate([offsets, offsets[-1] + areas.ring_offsets[first_ring]]).astype(np.int64)
    if len(offsets) == 1:
        return _Segments(ends, offsets, np.zeros((0, 4)))
    low = np.minimum.reduceat(np.minimum(ends[:, :2], ends[:, 2:]), offsets[:-1])
    high = np.maximum.reduceat(np.maximum(ends[:, :2], ends[:, 2:]), offsets[:-1])
    return _Segments(ends, offsets, np.hstack([low, high]))


@dataclass(frozen=True)
class _Gaps(Rows):
    """Pairs of units a < b, the least gap (px) between their courses, and of curves the angle (rad) between their
    tangents where they come nearest, and whether that is an end of each."""

    a: Ints
    b: Ints
    gap: Floats
    angle: Floats
    end_of_a: Bools
    end_of_b: Bools


def _find_gaps(segments: _Segments, curves: int, p: RelationParameters) -> _Gaps:
    from vision.relations import gap_kernels

    order, none = np.argsort(segments.boxes[:, 0], kind="stable"), np.empty((0, 2), np.int64)
    found = (segments.boxes, order, curves, p.radius, p.region_radius)
    near = np.empty((gap_kernels.near_boxes(*found, none), 2), np.int64)
    gap_kernels.near_boxes(*found, near)
    a, b = np.ascontiguousarray(near[np.lexsort((near[:, 1], near[:, 0]))].T)
    place, which = np.zeros((len(a), 3)), np.full((len(a), 2), -1, np.int64)
    place[:, 0] = np.where(b < curves, p.radius, p.region_radius) ** 2
    gap_kernels.least_gaps(segments.ends, segments.offsets, segments.boxes, a, b, place, which)
    close = which[:, 0] >= 0
    a, b, place, which = a[close], b[close], place[close], which[close]
    tangents, at_end = [], []
    for side, unit in enumerate((a, b)):
        first, last, nearest = segments.offsets[unit], segments.offsets[unit + 1] - 1, which[:, side]
        # from the one before to the one after, as what is bent is made of short ones
        before, after = np.maximum(nearest - 1, first), np.minimum(nearest + 1, last)
        tangents.append(segments.ends[after, 2:] - segments.ends[before, :2])
        along = place[:, 1 + side]
        at_end.append(((nearest == first) & (along == 0.0)) | ((nearest == last) & (along == 1.0)))
    cross = tangents[0][:, 0] * tangents[1][:, 1] - tangents[0][:, 1] * tangents[1][:, 0]
    angle = np.arctan2(np.abs(cross), np.abs(np.sum(tangents[0] * tangents[1], axis=1)))
    return _Gaps(a, b, np.sqrt(place[:, 0]), angle, at_end[0] & (a < curves), at_end[1] & (b < curves))


def _gap_sigma(curves: ImageCurves, pairs: _Gaps, sigma: Floats) -> Floats:
    """Standard deviation of a gap: across each of the two, or, at its end, along it."""
    spread = np.concatenate([curves.end_sigma, np.zeros(len(sigma) - len(curves))])
    one = np.where(pairs.end_of_a, np.maximum(spread[pairs.a], sigma[pairs.a]), sigma[pairs.a])
    other = np.where(pairs.end_of_b, np.maximum(spread[pairs.b], sigma[pairs.b]), sigma[pairs.b])
    return np.asarray(np.hypot(one, other))


def _near(curves: ImageCurves, areas: Areas, pairs: _Gaps, middles: Middles, p: RelationParameters) -> Relations:
    """Each unit and those nearest to it, the more salient the earlier.  Ranked by the gap only, streaks and specks
    would fill most places, and differ in every picture."""
    first_area, count = len(curves), len(curves) + len(areas)
    salience = np.concatenate([curves.salience, p.region_salience * np.sqrt(areas.area)])
    share = np.minimum(curves.salience / p.full_salience, 1.0)
    most = np.full((count, 2), p.region_neighbours)  # of arcs and of regions
    most[:first_area, 1] = 0
    most[:first_area, 0] = np.rint(p.least_neighbours + (p.neighbours - p.least_neighbours) * share)
    pair = np.tile(np.arange(len(pairs.a)), 2)
    a, b = np.concatenate([pairs.a, pairs.b]), np.concatenate([pairs.b, pairs.a])
    group = 2 * a + (b >= first_area)
    order = np.lexsort((b, (pairs.gap[pair] + p.touch) / np.maximum(salience[b], 1e-9), group))
    rank = np.arange(len(order)) - np.searchsorted(group[order], group[order])
    kept = np.zeros(len(pairs.a), np.bool_)
    kept[pair[order[rank < most.reshape(-1)[group[order]]]]] = True
    near = pairs.take(kept)
    sigma = _gap_sigma(curves, near, np.concatenate([curves.sigma, areas.sigma]))
    bearing, spread = middles.bearing(np.concatenate([near.a, near.b]), np.concatenate([near.b, near.a]))
    return relate_both_ways(NEAR, near.a, near.b, near.gap, sigma, bearing, spread)


def _parallels(curves: ImageCurves, pairs: _Gaps, p: RelationParameters) -> Relations:
    """Pairs of much the same direction among the curves that hardly leave their chords."""
    first, last = curves.offsets[:-1], curves.offsets[1:] - 1
    start = np.column_stack([curves.x[first], curves.y[first]])
    chord = np.column_stack([curves.x[last], curves.y[last]]) - start
    length = np.maximum(np.linalg.norm(chord, axis=1), 1e-9)
    direction, middle = chord / length[:, None], start + 0.5 * chord
    known = np.flatnonzero(pairs.b < len(curves))
    of_point = np.repeat(np.arange(len(curves)), np.diff(curves.offsets))
    from_start = np.column_stack([curves.x, curves.y]) - start[of_point]
    bow = np.abs(direction[of_point, 0] * from_start[:, 1] - direction[of_point, 1] * from_start[:, 0])
    lines = (length >= p.min_line) & (curves.salience >= p.min_salience)
    lines[of_point[bow > p.max_bow * length[of_point]]] = False
    known = known[lines[pairs.a[known]] & lines[pairs.b[known]]]
    a, b = pairs.a[known], pairs.b[known]
    cross = direction[a, 0] * direction[b, 1] - direction[a, 1] * direction[b, 0]
    angle = np.arctan2(np.abs(cross), np.abs(np.sum(direction[a] * direction[b], axis=1)))
    angle_sigma = np.hypot(curves.angle_sigma[a], curves.angle_sigma[b])

    even = angle <= p.max_angle
    a, b = np.concatenate([a[even], b[even]]), np.concatenate([b[even], a[even]])
    left = np.column_stack([direction[:, 1], -direction[:, 0]])
    offset = np.sum((middle[b] - middle[a]) * left[a], axis=1)
    lever = np.sum((middle[b] - middle[a]) * direction[a], axis=1)
    spread = np.sqrt(curves.sigma[a] ** 2 + curves.sigma[b] ** 2 + (curves.angle_sigma[a] * lever) ** 2)
    half = len(a) // 2
    return relate_both_ways(PARALLEL, a[:half], b[:half], offset, spread, angle[even], angle_sigma[even])


def _junctions(curves: ImageCurves, pairs: _Gaps, p: RelationParameters) -> Relations:
    """Curves of which one comes to the other with an end."""
    met = pairs.take((pairs.b < len(curves)) & (pairs.gap <= p.junction_reach) & (pairs.end_of_a | pairs.end_of_b))
    met = met.take(np.minimum(curves.salience[met.a], curves.salience[met.b]) >= p.min_salience)
    spread = np.hypot(curves.angle_sigma[met.a], curves.angle_sigma[met.b])
    return relate_both_ways(JUNCTION, met.a, met.b, met.gap, _gap_sigma(curves, met, curves.sigma), met.angle, spread)


def _circles(curves: ImageCurves, pairs: _Gaps, p: RelationParameters) -> list[Relations]:
    """Curves about one centre, and circular ones that are much the same."""
    of_curves = pairs.take(pairs.b < len(curves))
    a, b = of_curves.a, of_curves.b
    apart = np.hypot(curves.centre_x[a] - curves.centre_x[b], curves.centre_y[a] - curves.centre_y[b])
    spread = np.hypot(curves.centre_sigma[a], curves.centre_sigma[b])
    one = (apart <= p.max_centre_distance) & (spread <= np.sqrt(2.0) * p.max_centre_sigma)  # NaN is neither
    concentric = relate_both_ways(CONCENTRIC, a[one], b[one], apart[one], spread[one], 0.0, 0.0)
    more = curves.radius[b] - curves.radius[a]
    same = np.abs(more) <= p.max_radius_change * np.maximum(curves.radius[a], curves.radius[b])
    sigma = np.hypot(curves.radius_sigma[a], curves.radius_sigma[b])[same]
    equal = relate_both_ways(EQUAL_RADIUS, a[same], b[same], np.concatenate([more[same], -more[same]]), sigma, 0.0, 0.0)
    return [concentric, equal]


# A database in memory with the tables that matching joins, fed with the rows of the store: a run matches in it while it
# holds no file, by the same SQL that would run on the store.

TABLES = (
    "edge_element",
    "view_point",
    "unit_relation",
    "problem",
    "problem_tolerance",
    "candidate",
    "problem_relation",
    "compatibility",
)
VIEWS = ("due_relation", "due_compatibility")


def open_workspace() -> Database:
    """An empty database in memory with `TABLES` and `VIEWS`, as schema/ makes them."""
    workspace = Database(connect(URL.create("duckdb", database=":memory:"), read_only=False), "memory")
    with workspace.write() as connection:
        for table in TABLES + VIEWS:
            connection.exec_driver_sql(sql.table_script(table))
    for table in TABLES:  # asked for now: in memory there is one connection, and it will be busy
        workspace.table(table)
    return workspace


# From rows of units, relations and candidates to a solved problem: the joins are queries/matching, the search is
# relmodel.labelling.

# What a problem takes of the relations that were joined: tables, columns and their order.
_RELATIONS = (
    ("problem_relation", ("unit_no", "neighbour_no", "weight"), "unit_no neighbour_no"),
    ("compatibility", ("unit_a", "label_a", "unit_b", "label_b", "saves"), "unit_a label_a unit_b label_b"),
)


@dataclass(frozen=True)
class ProblemRows:
    """A problem before its joins.

    unit, label, cost (c,): candidates; places: columns of `candidate` that say how far each is off, where that is
    known; null_cost (units,): what no label costs a unit, besides `null_share` of the weight of its relations;
    nat_cost: cost of a nat of a relation; relation_weight: of all relations of a unit, None where each weighs what its
    kinds do; units, labels: how many there are; units_id, labels_id: their sets in the workspace; injective: no label
    twice (the mode `paper` knows no such limit); nodes: after how many the search ends; mode: of
    `relmodel.labelling.solve`."""

    units: int
    labels: int
    units_id: int
    labels_id: int
    unit: Ints
    label: Ints
    cost: Ints
    null_cost: Ints
    null_share: float
    nat_cost: float
    tolerances: Mapping[str, Tolerance]
    injective: bool
    nodes: int
    mode: str = MODES[0]
    relation_weight: int | None = None
    places: Columns | None = None


@dataclass(frozen=True)
class SolvedProblem:
    """A problem, its solution, and what its rows hold besides (`solved_rows`)."""

    problem: MatchingProblem
    result: MatchingResult
    rows: ProblemRows
    tolerances: Columns


def solve_rows(
    workspace: Database, number: int, rows: ProblemRows, of_units: Columns, of_labels: Columns
) -> SolvedProblem:
    """Join the relations of both sides over the candidates, and search.

    The joins follow once all that they join is committed: only then does DuckDB know how many rows there are, and in
    which order to join them."""
    problem_key = {"run_id": 0, "problem_no": number}
    injective = rows.injective and rows.mode != PAPER
    tolerances: Columns = {
        "kind": list(rows.tolerances),
        **{f.name: [getattr(t, f.name) for t in rows.tolerances.values()] for f in fields(Tolerance)},
    }
    with workspace.write() as connection:
        for unit_set_id, relations in ((rows.units_id, of_units), (rows.labels_id, of_labels)):
            workspace.append(connection, "unit_relation", {"unit_set_id": unit_set_id, **relations})
        workspace.append(
            connection,
            "problem",
            {
                "run_id": [0],
                "problem_no": number,
                "kind": "localisation",
                "method": "",
                "units_id": rows.units_id,
                "labels_id": rows.labels_id,
                "parameters": "{}",
                "injective": injective,
                "nat_cost": rows.nat_cost,
                "relation_weight": rows.relation_weight,
                "status": "stopped",
                "cost": 0.0,
                "bound": 0.0,
            },
        )
        workspace.append(connection, "problem_tolerance", {**problem_key, **tolerances})
        workspace.append(
            connection,
            "candidate",
            {
                **problem_key,
                "unit_no": rows.unit,
                "label_no": rows.label,
                "cost": rows.cost.astype(float),
                **(rows.places or {}),
            },
        )
    with workspace.write() as connection:
        workspace.insert(connection, "problem_relation", "matching/relations", **problem_key)
        workspace.insert(connection, "compatibility", "matching/compatibilities", **problem_key)
        relation, pair = (
            np.stack(
                [*workspace.select(connection, table, *names, order=order, **problem_key).values()], axis=1
            ).astype(np.int64)
            for table, names, order in _RELATIONS
        )
    weight = np.bincount(relation[:, 0], relation[:, 2], rows.units)
    null_cost = rows.null_cost + np.ceil(rows.null_share * weight - 1e-9).astype(np.int64)
    problem = matching_problem(
        null_cost,
        rows.labels,
        np.stack([rows.unit, rows.label, rows.cost], axis=1),
        relation,
        pair,
        injective=injective,
    )
    return SolvedProblem(problem, solve(problem, rows.mode, nodes=rows.nodes), rows, tolerances)


def solved_rows(solved: SolvedProblem) -> dict[str, Columns]:
    """As `relmodel.labelling.problem.result_rows`, with what the joins went by."""
    tables, rows = result_rows(solved.problem, solved.result), solved.rows
    tables["problem"] |= {"nat_cost": [rows.nat_cost], "relation_weight": [rows.relation_weight]}
    if rows.places is not None:
        order = np.lexsort((rows.label, rows.unit))
        tables["candidate"] |= {name: np.ma.asarray(values)[order] for name, values in rows.places.items()}
    return {**tables, "problem_tolerance": solved.tolerances}
