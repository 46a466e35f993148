"""Which primitives of a picture are which parts of a view: units, candidates, relations, and the labelling."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import radians

import numpy as np
import numpy.typing as npt

from relmodel.arrays import Bools, Columns, Floats, Ints
from relmodel.labelling.problem import NONE
from relmodel.store.database import Database, round_columns
from vision.extraction.fits import fit_ellipses
from vision.extraction.relations import relate_neighbours
from vision.extraction.rows import Primitives, find_regions_at
from vision.localisation.views import SPACING_PX, ViewArcs, ViewPoints
from vision.localisation.visibility import SurfaceMap
from vision.relations.relations import (
    BOUNDS,
    FAR,
    TOLERANCES,
    Areas,
    ImageCurves,
    ProblemRows,
    RelationParameters,
    Relations,
    SolvedProblem,
    Tolerance,
    find_middles,
    relate,
    relate_both_ways,
    solve_rows,
)


@dataclass(frozen=True)
class PoseProblemParameters:
    """Which primitives of a picture may be which parts of a view, at what price in nats, logarithms of odds."""

    search: str = "dual_ascent"  # how the best labelling is sought: `relmodel.labelling.solve.MODES`
    reach_px: float = 10.0  # px within which an arc of the picture and one of the view are compared
    along_px: float = 4.0  # px along the arc between an edge element and the point it belongs to
    gate_sigma: float = 3.0  # standard deviations of pose, arc and `floor_px` that a pair may be off
    floor_px: float = 0.5  # px: standard deviation of edges of real metal beyond their own sigma
    max_angle: float = radians(15.0)
    """rad: greatest mean angle between the two, three standard deviations, plus what the pose may turn circles by"""
    min_overlap: float = 0.3  # share of the image arc that must lie beside the model arc
    scale: int = 32  # integer cost of a nat
    loose_price: float = 2.0
    """price of an image arc that does not lie beside its model arc at all, in proportion to what does not"""
    min_region_share: float = 0.88
    """share of a region that must lie on a surface: others run over edges that the picture does not show"""
    spill_price: float = 6.0
    """price of a region that does not lie on its surface at all, in proportion to what does not"""
    null_price: float = 3.5  # price of a primitive that is no part of the model
    relation_price: float = 3.5
    """what all relations of a primitive weigh together, as they repeat much the same information: with `null_price`,
    one that nothing confirms is no part of the model; 0 matches without relations"""
    tolerances: dict[str, Tolerance] = field(
        default_factory=lambda: {kind: replace(t, reach=FAR) for kind, t in TOLERANCES.items()}
    )
    """by kind of relation; places of arcs, unlike gaps, are as well known from afar"""
    covered_share: float = 0.5
    """share of its stretch of a model arc that another image arc may cover better before one is a second line beside"""
    nodes: int = 200  # of the search: what it has not proved by then it bounds


@dataclass(frozen=True)
class MatchingParameters:
    """Everything numeric that decides which primitives are which parts of a view."""

    pose: PoseProblemParameters = field(default_factory=PoseProblemParameters)


# A predicted view as matchers see it: the visible arcs and surfaces of the model as units, drawn where the picture
# should show them, with the relations among them.

LEAST_SURFACE_PX = 60.0  # surfaces that show less are no units
SIDE_PX = 4.0  # from an arc at which the surface beside it is looked for
LEAST_TURN = 0.25  # share of an ellipse that an arc must run around to have a centre
CONIC_PX = 0.5  # rms distance from an ellipse up to which an arc is one
ROUNDEST = 0.9  # ratio of the axes from which an ellipse has a radius
# Wider than those of pictures, so that what lies at their rim is not missed.
RELATIONS = RelationParameters(radius=140.0, neighbours=40, region_neighbours=6, least_neighbours=40)


@dataclass(frozen=True)
class ViewUnits:
    """Units of a view: its arcs by number, then its surfaces.

    surface (n,): the scene's surface of each; relations: columns of unit_relation but the set; arcs: how many are."""

    points: ViewPoints
    surface: Ints
    relations: Columns
    arcs: int


def describe_view(view: ViewArcs, points: ViewPoints, seen: SurfaceMap) -> ViewUnits:
    """Units of what a camera sees."""
    surface, areas = _surfaces(seen)
    curves = _curves(points.rows, len(view.kind))
    relations = Relations.stack(
        [
            relate(curves, areas, RELATIONS),
            _bounds(points.rows, curves, areas, surface, seen),
            *_neighbours(curves, areas, surface, seen),
        ]
    )
    rows = round_columns("unit_relation", relations.rows())
    return ViewUnits(points, surface, rows, len(view.kind))


def _curves(points: Columns, arcs: int) -> ImageCurves:
    run, x, y, sigma = (np.asarray(points[name]) for name in ("view_arc_no", "x", "y", "sigma"))
    offsets = np.searchsorted(run, np.arange(arcs + 1))
    # A run of one sample is a point: half a px either way makes it a curve.
    lone = np.flatnonzero(np.diff(offsets) == 1)
    at = offsets[lone]
    half = 0.5 * np.stack([np.asarray(points["direction_x"]), np.asarray(points["direction_y"])], axis=1)[at]
    x, y, sigma, run = (np.insert(c, at, c[at]) for c in (x, y, sigma, run))
    offsets = np.searchsorted(run, np.arange(arcs + 1))
    first = offsets[lone]
    x[first], y[first] = x[first] - half[:, 0], y[first] - half[:, 1]
    x[first + 1], y[first + 1] = x[first + 1] + half[:, 0], y[first + 1] + half[:, 1]
    step = np.hypot(np.diff(x), np.diff(y)) * (np.diff(run) == 0)
    length = np.bincount(run[1:], step, arcs).astype(float)
    across = np.bincount(run, sigma, arcs) / np.maximum(np.bincount(run, minlength=arcs), 1)
    counts = np.diff(offsets)
    long = np.flatnonzero(counts >= 6)
    of_long = np.isin(np.repeat(np.arange(arcs), counts), long)
    fitted = fit_ellipses(x[of_long], y[of_long], np.ones(int(of_long.sum())), counts[long])
    girth = 2 * np.pi * np.sqrt(0.5 * (fitted.major**2 + fitted.minor**2))
    bent = (length[long] >= LEAST_TURN * girth) & (np.sqrt(fitted.square) <= CONIC_PX)  # NaN is neither
    centre_x, centre_y, centre_sigma, radius = (np.full(arcs, np.nan) for _ in range(4))
    round_ = long[bent]
    centre_x[round_], centre_y[round_] = fitted.centre_x[bent], fitted.centre_y[bent]
    centre_sigma[round_] = np.hypot(across[round_], CONIC_PX) * girth[bent] / length[round_]
    circular = bent & (fitted.minor >= ROUNDEST * fitted.major)
    radius[long[circular]] = np.sqrt(fitted.major * fitted.minor)[circular]
    return ImageCurves(
        offsets=offsets.astype(np.int64),
        x=x,
        y=y,
        sigma=across,
        end_sigma=np.full(arcs, SPACING_PX),
        angle_sigma=across / np.maximum(length, 1.0),
        salience=length,
        centre_x=centre_x,
        centre_y=centre_y,
        centre_sigma=centre_sigma,
        radius=radius,
        radius_sigma=centre_sigma,
    )


def _surfaces(seen: SurfaceMap) -> tuple[Ints, Areas]:
    """Surfaces that show at least `LEAST_SURFACE_PX`, and the outlines of what they show."""
    import cv2

    shown = seen.surface.ravel()
    used = shown >= 0
    area = np.bincount(shown[used], seen.rays.weight.ravel()[used])
    surface = np.flatnonzero(area >= LEAST_SURFACE_PX)
    weight = seen.rays.weight.ravel()[used]
    pixel = seen.rays.pixel.reshape(-1, 2)[used]
    moments = np.stack([np.bincount(shown[used], weight * pixel[:, i]) for i in (0, 1)], axis=1)[surface]
    centre = np.asarray(moments / area[surface][:, None], float)
    rings: list[npt.NDArray[np.integer]] = []
    owner: list[int] = []
    row, column = np.nonzero(seen.surface >= 0)
    order = np.argsort(seen.surface[row, column], kind="stable")
    row, column = row[order], column[order]
    bounds = np.searchsorted(seen.surface[row, column], np.stack([surface, surface + 1]))
    for number, (start, end) in enumerate(bounds.T.tolist()):
        rows, columns = row[start:end], column[start:end]
        top, left = int(rows.min()), int(columns.min())
        mask = np.zeros((int(rows.max()) - top + 1, int(columns.max()) - left + 1), np.uint8)
        mask[rows - top, columns - left] = 1
        found, _ = cv2.findContours(mask, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_SIMPLE)
        rings += [ring[:, 0, ::-1] + np.array([top, left]) for ring in found]
        owner += [number] * len(found)
    offsets = np.concatenate([[0], np.cumsum([len(ring) for ring in rings])]).astype(np.int32)
    cells = np.concatenate(rings) if rings else np.zeros((0, 2), np.int64)
    outline = seen.rays.pixel[cells[:, 0], cells[:, 1]]
    areas = Areas(
        area=area[surface].astype(float),
        centroid_x=centre[:, 0],
        centroid_y=centre[:, 1],
        sigma=np.full(len(surface), float(seen.rays.step)),
        ring_region=np.array(owner, np.int32),
        ring_offsets=offsets,
        x=outline[:, 0],
        y=outline[:, 1],
    )
    return surface, areas


def _number(surface: Ints, seen: SurfaceMap) -> Ints:
    """Which unit each of the scene's surfaces is, -1 for none; the last, which is at -1, stands for no surface."""
    number = np.full(int(seen.surface.max(initial=0)) + 2, -1)
    number[surface] = np.arange(len(surface))
    return number


def _neighbours(curves: ImageCurves, areas: Areas, surface: Ints, seen: SurfaceMap) -> list[Relations]:
    """Surfaces that border on each other in the picture, and those that others surround."""
    number = _number(surface, seen)
    labels = number[seen.surface].astype(np.int32)
    inside = np.ones(len(surface), bool)
    for rim in (labels[0], labels[-1], labels[:, 0], labels[:, -1]):
        inside[rim[rim >= 0]] = False
    return relate_neighbours(labels, inside, len(curves), find_middles(curves, areas), step=float(seen.rays.step))


def _bounds(points: Columns, curves: ImageCurves, areas: Areas, surface: Ints, seen: SurfaceMap) -> Relations:
    """Arcs and the surfaces beside them, with the length of arc that borders each."""
    run = np.asarray(points["view_arc_no"])
    place = np.stack([np.asarray(points["x"]), np.asarray(points["y"])], axis=1)
    normal = np.stack([-np.asarray(points["direction_y"]), np.asarray(points["direction_x"])], axis=1)
    number = _number(surface, seen)
    count = max(len(surface), 1)
    keys = []
    for away in (SIDE_PX, -SIDE_PX):
        bordering = number[seen.surface_at(place + away * normal)]
        keys.append((run * count + bordering)[bordering >= 0])
    key, times = np.unique(np.concatenate(keys), return_counts=True)
    arc, area = key // count, key % count
    bearing, spread = find_middles(curves, areas).bearing(
        np.concatenate([arc, len(curves) + area]), np.concatenate([len(curves) + area, arc])
    )
    return relate_both_ways(BOUNDS, arc, len(curves) + area, SPACING_PX * times, SPACING_PX, bearing, spread)


# Units are the arcs and regions of the picture, labels the arcs and surfaces of the view: several pieces of the picture
# may show one arc or surface, so a label may be taken more than once.

REASONS = ("assigned", "orientation", "distance", "overlap", "unrelated", "better_elsewhere", "covered")
ASSIGNED, ORIENTATION, DISTANCE, OVERLAP, UNRELATED, BETTER_ELSEWHERE, COVERED = range(len(REASONS))
PLACES = ("across", "across_sigma", *(f"shift_{axis}" for axis in range(1, 7)))
_POSE_PROBLEM = PoseProblemParameters()


@dataclass(frozen=True)
class ArcPairs:
    """Arcs of a picture with arcs of the view that they come near, as columns: reason (index of REASONS; 0 is taken),
    rms distance (px) and mean angle (rad) with their gates, share of the image arc beside the model arc, and the
    points of the view that this covers, first to last; how far the image arc lies across in the mean
    (px, to the left of the model arc), the standard deviation of that where the pose is known, and how a standard
    deviation of the pose along each axis of its covariance moves the model arc there, `shift` (n, 6) px."""

    image_arc: Ints
    view_arc: Ints
    reason: npt.NDArray[np.int8]
    residual: Floats
    gate: Floats
    angle: Floats
    angle_gate: Floats
    overlap: Floats
    first_point: Ints
    last_point: Ints
    across: Floats
    across_sigma: Floats
    shift: Floats

    @property
    def accepted(self) -> Bools:
        return np.asarray(self.reason == ASSIGNED)


@dataclass(frozen=True)
class SurfacePairs:
    """Regions of a picture with surfaces of the view that they lie on: reason (assigned, overlap, unrelated or
    better_elsewhere), px that they share, and that share of each."""

    region: Ints
    view_surface: Ints
    reason: npt.NDArray[np.int8]
    pixels: Floats
    region_share: Floats
    surface_share: Floats

    @property
    def accepted(self) -> Bools:
        return np.asarray(self.reason == ASSIGNED)


@dataclass(frozen=True)
class PoseMatch:
    """What a camera's picture shows of its predicted view."""

    arcs: ArcPairs
    surfaces: SurfacePairs
    solved: SolvedProblem


@dataclass(frozen=True)
class MatchedView:
    """The units of a camera's view, and which primitives of its picture they are."""

    units: ViewUnits
    match: PoseMatch


def match_view(
    workspace: Database,
    number: int,
    picture: Primitives,
    view: ViewUnits,
    seen: SurfaceMap,
    p: PoseProblemParameters = _POSE_PROBLEM,
) -> PoseMatch:
    """Match the primitives of a picture against a view, as problem `number` of a workspace."""
    with workspace.write() as connection:
        workspace.append(connection, "edge_element", {"extraction_id": number, **picture.arc_elements})
        workspace.append(connection, "view_point", {"run_id": 0, "view_no": number, **view.points.rows})
        found = workspace.columns(
            connection, "matching/arc_pairs", extraction_id=number, run_id=0, view_no=number, reach=p.reach_px,
            max_along=p.along_px,
        )  # fmt: skip
    pairs = _judge_arcs(found, picture, view, p)
    surfaces = _judge_regions(picture, view, seen, p)
    units, image_arcs = len(picture.arcs) + len(picture.regions), len(picture.arcs)
    arc, region = pairs.accepted, surfaces.accepted
    spill = np.rint(p.scale * p.spill_price * (1.0 - surfaces.region_share)).astype(np.int64)
    relation_weight = round(p.scale * p.relation_price)
    solved = solve_rows(
        workspace,
        number,
        ProblemRows(
            units=units,
            labels=view.arcs + len(view.surface),
            units_id=2 * number,
            labels_id=2 * number + 1,
            unit=np.concatenate([pairs.image_arc[arc], image_arcs + surfaces.region[region]]),
            label=np.concatenate([pairs.view_arc[arc], view.arcs + surfaces.view_surface[region]]),
            cost=np.concatenate([_price_arcs(pairs, p)[arc], spill[region]]),
            null_cost=np.full(units, round(p.scale * p.null_price)),
            null_share=0.0,
            nat_cost=float(p.scale),
            tolerances=p.tolerances if relation_weight else {},
            injective=False,
            nodes=p.nodes,
            mode=p.search,
            relation_weight=relation_weight,
            places=_places(pairs, arc, int(region.sum())),
        ),
        picture.relations,
        view.relations,
    )
    label = solved.result.label
    _decide(pairs.reason, label[pairs.image_arc], pairs.view_arc)
    _decide(surfaces.reason, label[image_arcs + surfaces.region], view.arcs + surfaces.view_surface)
    _strike_covered(pairs, p)
    return PoseMatch(pairs, surfaces, solved)


def _decide(reason: npt.NDArray[np.int8], chosen: Ints, label: Ints) -> None:
    """The reasons of candidates after the search, given the label chosen for the unit of each."""
    candidate = reason == ASSIGNED
    reason[candidate & (chosen == NONE)] = UNRELATED
    reason[candidate & (chosen != NONE) & (chosen != label)] = BETTER_ELSEWHERE


def _places(pairs: ArcPairs, taken: Bools, regions: int) -> Columns:
    """How far candidates are off, as columns of `candidate`: arcs, then regions, of which nothing is known."""
    known = np.column_stack([pairs.across[taken], pairs.across_sigma[taken], pairs.shift[taken]])
    values = np.ma.masked_invalid(np.concatenate([known, np.full((regions, known.shape[1]), np.nan)]))
    return {name: values[:, i] for i, name in enumerate(PLACES)}


def _judge_arcs(
    found: dict[str, npt.NDArray[np.generic]], picture: Primitives, view: ViewUnits, p: PoseProblemParameters
) -> ArcPairs:
    """Those that pass the gates are marked as assigned until the search decides."""
    image_arc = np.asarray(found["image_arc_no"], np.int64)
    residual, angle, sigma, across = (np.asarray(found[it], float) for it in ("residual", "angle", "sigma", "across"))
    overlap = np.asarray(found["elements"], float) / np.maximum(np.asarray(found["of_elements"], float), 1)
    own = np.nan_to_num(picture.arcs.sigma[image_arc])
    known = np.hypot(own, p.floor_px)
    gate = p.gate_sigma * np.hypot(sigma, known)
    radius = np.nan_to_num(picture.arcs.radius[image_arc], nan=np.inf, posinf=np.inf)
    angle_gate = p.max_angle + p.gate_sigma * sigma / np.maximum(radius, 1.0)
    reason = np.full(len(image_arc), ASSIGNED, np.int8)
    reason[overlap < p.min_overlap] = OVERLAP
    reason[residual > gate] = DISTANCE
    reason[angle > angle_gate] = ORIENTATION
    first, last = (np.asarray(found[name], np.int64) for name in ("first_point", "last_point"))
    view_arc = np.asarray(found["view_arc_no"], np.int64)
    sums = np.concatenate([np.zeros((1, view.points.shift.shape[1])), np.cumsum(view.points.shift, axis=0)])
    shift = (sums[last + 1] - sums[first]) / (last + 1 - first)[:, None]
    return ArcPairs(
        image_arc, view_arc, reason, residual, gate, angle, angle_gate, overlap, first, last, across, known, shift
    )


def _price_arcs(pairs: ArcPairs, p: PoseProblemParameters) -> Ints:
    """Minus the logarithm of the likelihood of what a pair is off."""
    off = (p.gate_sigma * pairs.residual / pairs.gate) ** 2 + (3.0 * pairs.angle / pairs.angle_gate) ** 2
    return np.rint(p.scale * (0.5 * off + p.loose_price * (1.0 - pairs.overlap))).astype(np.int64)


def _judge_regions(picture: Primitives, view: ViewUnits, seen: SurfaceMap, p: PoseProblemParameters) -> SurfacePairs:
    """Regions and the surfaces that they lie on, counted on the places of the surface map."""
    count = max(len(view.surface), 1)
    region = find_regions_at(picture, seen.rays.pixel.reshape(-1, 2))
    number = _number(view.surface, seen)
    surface, area = number[seen.surface.ravel()], seen.rays.weight.ravel()
    used = (region >= 0) & (area > 0)
    region_area = np.bincount(region[used], area[used], len(picture.regions))
    both = used & (surface >= 0)
    key, which = np.unique(region[both] * count + surface[both], return_inverse=True)
    pixels = np.bincount(which.ravel(), area[both], len(key)).astype(float)
    region_no, surface_no = key // count, key % count
    surface_area = np.bincount(surface[surface >= 0], area[surface >= 0], count)
    region_share = pixels / np.maximum(region_area[region_no], 1e-9)
    reason = np.where(region_share < p.min_region_share, OVERLAP, ASSIGNED).astype(np.int8)
    return SurfacePairs(
        region_no, surface_no, reason, pixels, region_share, pixels / np.maximum(surface_area[surface_no], 1e-9)
    )


def _strike_covered(pairs: ArcPairs, p: PoseProblemParameters) -> None:
    """Of two image arcs beside one stretch of a model arc the one nearer to it stays: the other is a second line."""
    taken = np.flatnonzero(pairs.accepted)
    taken = taken[np.lexsort((pairs.image_arc[taken], pairs.residual[taken] / pairs.gate[taken]))]
    first, last, arc = pairs.first_point[taken], pairs.last_point[taken], pairs.view_arc[taken]
    common = np.minimum(last[:, None], last) - np.maximum(first[:, None], first) + 1
    rival = (arc[:, None] == arc) & (common > p.covered_share * (last - first + 1)[:, None])
    kept = np.ones(len(taken), bool)
    for place in np.flatnonzero(np.tril(rival, -1).any(axis=1)).tolist():  # few: most stretches have one arc
        kept[place] = not (rival[place, :place] & kept[:place]).any()
    pairs.reason[taken[~kept]] = COVERED
