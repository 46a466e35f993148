"""Which primitives of a picture are which parts of a predicted view: candidates by place, relations on both sides, and
the labelling that keeps them (queries/matching).

Units are the arcs and regions of the picture, labels the arcs and surfaces of the view: several pieces of the picture
may show one arc or surface, so a label may be taken more than once.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from relmodel.arrays import Bools, Floats, Ints
from relmodel.columns import Columns
from relmodel.labelling.problem import NONE
from relmodel.store.database import Database
from vision.extraction.primitives import Primitives
from vision.extraction.region_lookup import find_regions_at
from vision.localisation.coverage import SurfaceMap
from vision.matching.matching_parameters import PoseProblemParameters
from vision.matching.view_units import ViewUnits
from vision.relations.joins import ProblemRows, Solved, solve_rows

REASONS = ("assigned", "orientation", "distance", "overlap", "unrelated", "better_elsewhere", "covered")
ASSIGNED, ORIENTATION, DISTANCE, OVERLAP, UNRELATED, BETTER_ELSEWHERE, COVERED = range(len(REASONS))

PLACES = ("across", "across_sigma", *(f"shift_{axis}" for axis in range(1, 7)))

_DEFAULTS = PoseProblemParameters()


@dataclass(frozen=True)
class Pairs:
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

    arcs: Pairs
    surfaces: SurfacePairs
    solved: Solved


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
    p: PoseProblemParameters = _DEFAULTS,
) -> PoseMatch:
    """Match the primitives of a picture against a view, as problem `number` of a workspace."""
    with workspace.write() as connection:
        workspace.append(connection, "edge_element", {"extraction_id": number, **picture.arc_elements})
        workspace.append(connection, "view_point", {"run_id": 0, "view_no": number, **view.points})
        found = workspace.columns(
            connection, "matching/arc_pairs", extraction_id=number, run_id=0, view_no=number, reach=p.reach_px,
            max_along=p.along_px,
        )  # fmt: skip
    pairs = _judge_arcs(found, picture, view, p)
    surfaces = _judge_regions(picture, view, seen, p)
    units, image_arcs = len(picture.arcs) + len(picture.regions), len(picture.arcs)
    arc, region = pairs.accepted, surfaces.accepted
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
            cost=np.concatenate([_price_arcs(pairs, p)[arc], _price_regions(surfaces, p)[region]]),
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


def _places(pairs: Pairs, taken: Bools, regions: int) -> Columns:
    """How far candidates are off, as columns of `candidate`: arcs, then regions, of which nothing is known."""
    known = np.column_stack([pairs.across[taken], pairs.across_sigma[taken], pairs.shift[taken]])
    values = np.ma.masked_invalid(np.concatenate([known, np.full((regions, known.shape[1]), np.nan)]))
    return {name: values[:, i] for i, name in enumerate(PLACES)}


def _judge_arcs(
    found: dict[str, npt.NDArray[np.generic]], picture: Primitives, view: ViewUnits, p: PoseProblemParameters
) -> Pairs:
    """Those that pass the gates are marked as assigned until the search decides."""
    image_arc = np.asarray(found["image_arc_no"], np.int64)
    residual, angle, sigma, across = (
        np.asarray(found[name], float) for name in ("residual", "angle", "sigma", "across")
    )
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
    sums = np.concatenate([np.zeros((1, view.shift.shape[1])), np.cumsum(view.shift, axis=0)])
    shift = (sums[last + 1] - sums[first]) / (last + 1 - first)[:, None]
    return Pairs(
        image_arc, view_arc, reason, residual, gate, angle, angle_gate, overlap, first, last, across, known, shift
    )


def _price_arcs(pairs: Pairs, p: PoseProblemParameters) -> Ints:
    """Minus the logarithm of the likelihood of what a pair is off."""
    off = (p.gate_sigma * pairs.residual / pairs.gate) ** 2 + (3.0 * pairs.angle / pairs.angle_gate) ** 2
    return np.rint(p.scale * (0.5 * off + p.loose_price * (1.0 - pairs.overlap))).astype(np.int64)


def _judge_regions(picture: Primitives, view: ViewUnits, seen: SurfaceMap, p: PoseProblemParameters) -> SurfacePairs:
    """Regions and the surfaces that they lie on, counted on the places of the surface map."""
    count = max(len(view.surface), 1)
    region = find_regions_at(picture, seen.rays.pixel.reshape(-1, 2))
    number = np.full(int(seen.surface.max(initial=0)) + 2, -1)
    number[view.surface] = np.arange(len(view.surface))
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


def _price_regions(pairs: SurfacePairs, p: PoseProblemParameters) -> Ints:
    return np.rint(p.scale * p.spill_price * (1.0 - pairs.region_share)).astype(np.int64)


def _strike_covered(pairs: Pairs, p: PoseProblemParameters) -> None:
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
