"""Stereo by arcs and regions, without a model: evidence for pairs, relations on both sides, the labelling."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from relmodel.arrays import Bools, Columns, Floats, Ints, Ragged, Rows
from relmodel.errors import UsageError
from relmodel.labelling.problem import NONE
from relmodel.labelling.solve import check_mode
from relmodel.store.runs import Run
from relmodel.store.sql import column_types
from vision.cameras.cameras import Rig
from vision.extraction.rows import Primitives, RegionColumns
from vision.relations.relations import ProblemRows, SolvedProblem, open_workspace, solve_rows, solved_rows
from vision.stereo.epipolar import (
    DisparityRange,
    Rectification,
    RectifiedCamera,
    RowArcs,
    StereoArcs,
    Votes,
    compress_contrast,
    describe,
    estimate_range,
    index_rows,
    lay_out,
    pack_arcs,
    rectify,
    vote,
)
from vision.stereo.stereo_parameters import (
    DEFAULTS,
    EpipolarParameters,
    EvidenceParameters,
    RegionEvidenceParameters,
    StereoParameters,
)
from vision.stereo.triangulate import CURVES, SpaceArcs, triangulate_pairs

if TYPE_CHECKING:
    from sqlalchemy import Connection

# Of arcs that cross rows: how many rows vote for the pair, of the shorter one's and of the longer one's; how much the
# widths differ; how far apart in y the ends are that agree best, as corners are seen in both pictures. Of arcs along
# the rows, for which nothing votes: contrast, width, length and ends.


@dataclass(frozen=True)
class StereoCandidates(Rows):
    """Pairs of a unit of the first picture and a label, a unit of the second, with the price of each in nats: the
    evidence against it."""

    unit: Ints
    label: Ints
    price: Floats

    def take_best(self, most: int, dearest: float) -> StereoCandidates:
        """The `most` cheapest of each unit, none dearer than `dearest`, ordered by unit and label."""
        order = np.lexsort((self.label, self.price, self.unit))
        rank = np.arange(len(order)) - np.searchsorted(self.unit[order], self.unit[order])
        kept = order[(rank < most) & (self.price[order] <= dearest)]
        kept = kept[np.lexsort((self.label[kept], self.unit[kept]))]
        return self.take(kept)


def _compare_across(
    first: RowArcs,
    second: RowArcs,
    seen: DisparityRange,
    votes: Votes,
    epipolar: EpipolarParameters,
    p: EvidenceParameters,
) -> StereoCandidates:
    """Arcs that cross rows: pairs of which a share of the shorter one's crossings find one alike in the other."""
    from vision.stereo import epipolar_kernels

    size = (len(first.arcs), len(second.arcs))
    alike = np.zeros(size, np.int64)
    start = index_rows(first.crossings, second.crossings)
    epipolar_kernels.count_alike(
        start[0], first.crossings.arc, describe(first.crossings, epipolar), seen.of_crossings,
        start[1], second.crossings.arc, describe(second.crossings, epipolar),
        epipolar.angle_sigma, epipolar.contrast_sigma, p.most_unlike, alike,
    )  # fmt: skip
    i, j = np.nonzero(alike >= epipolar.least_rows)
    shorter = np.minimum(first.extent[i], second.extent[j])
    kept = alike[i, j] >= p.least_alike * shorter
    i, j, shorter = i[kept], j[kept], shorter[kept]
    voted = np.zeros(size)
    voted[votes.first, votes.second] = votes.votes
    price = p.unvoted_of_shorter * (1 - np.minimum(voted[i, j] / shorter, 1))
    price += p.unvoted_of_longer * (1 - np.minimum(voted[i, j] / np.maximum(first.extent[i], second.extent[j]), 1))
    price += p.width * np.abs(first.arcs.width[i] - second.arcs.width[j]) + p.end * _compare_ends(first, second, i, j)
    return StereoCandidates(i, j, np.asarray(price))


def _compare_level(
    first: RowArcs, second: RowArcs, seen: DisparityRange, epipolar: EpipolarParameters, p: EvidenceParameters
) -> StereoCandidates:
    """Arcs along the rows: pairs on much the same rows, moved within the range."""
    level = [np.flatnonzero(side.extent < epipolar.least_rows) for side in (first, second)]
    a, b = first.box[level[0]][:, None], second.box[level[1]][None]
    rows = np.abs(a[..., 1] + a[..., 3] - b[..., 1] - b[..., 3]) / 2
    height = (a[..., 3] - a[..., 1] + b[..., 3] - b[..., 1]) / 2
    moved = (a[..., 0] + a[..., 2] - b[..., 0] - b[..., 2]) / 2
    slack = np.abs(a[..., 2] - a[..., 0] - b[..., 2] + b[..., 0]) / 2
    low, high = seen.of_arcs[level[0]].T
    i, j = np.nonzero(
        (rows <= p.level_rows + height) & (moved + slack >= low[:, None]) & (moved - slack <= high[:, None])
    )
    i, j = level[0][i], level[1][j]
    steps = [_step_down(side, epipolar) for side in (first, second)]
    unlike = ((steps[0][i] - steps[1][j]) / epipolar.contrast_sigma) ** 2
    kept = unlike <= p.most_unlike
    i, j, unlike = i[kept], j[kept], unlike[kept]
    length = [side.arcs.offsets[1:] - side.arcs.offsets[:-1] for side in (first, second)]
    price = p.level_contrast * unlike + p.level_length * np.abs(np.log(length[0][i] / length[1][j]))
    price += p.level_width * np.abs(first.arcs.width[i] - second.arcs.width[j])
    price += p.level_end * _compare_ends(first, second, i, j) + p.level_more
    return StereoCandidates(i, j, np.asarray(price))


def _compare_ends(first: RowArcs, second: RowArcs, i: Ints, j: Ints) -> Floats:
    """log(1 + px) by which the upper ends, or the lower ones, whichever agree better, lie on other rows."""
    upper = np.abs(first.box[i, 1] - second.box[j, 1])
    lower = np.abs(first.box[i, 3] - second.box[j, 3])
    return np.asarray(np.log1p(np.minimum(upper, lower)))


def _step_down(side: RowArcs, p: EpipolarParameters) -> Floats:
    """Compressed contrast of each arc (n,), positive where the bright side lies above."""
    start, end = side.arcs.offsets[:-1], side.arcs.offsets[1:]
    if len(start) == 0:
        return np.zeros(0)
    mean = np.add.reduceat(side.arcs.contrast, start) / (end - start)
    return compress_contrast(mean * np.sign(side.points[end - 1, 0] - side.points[start, 0]), p.contrast_scale)


# Regions of both pictures: which may be one, and what speaks against it.
#
# Pong's second step for regions: what their bounding arcs vote for, area and mean intensity; and, as rows are shared,
# from which row to which they reach.


def compare_regions(
    rectification: Rectification,
    first: RegionColumns,
    second: RegionColumns,
    seen: DisparityRange,
    votes: Votes,
    p: RegionEvidenceParameters,
) -> StereoCandidates:
    """The pairs of regions that share most of their rows and are moved as arcs about them may be, priced."""
    top, bottom = _rows(rectification, rectification.first, first)
    other_top, other_bottom = _rows(rectification, rectification.second, second)
    shared = np.minimum(bottom[:, None], other_bottom) - np.maximum(top[:, None], other_top)
    share = shared / np.maximum(np.maximum(bottom[:, None], other_bottom) - np.minimum(top[:, None], other_top), 1.0)
    x, other_x = (
        rectification.points(view, np.column_stack([regions.centroid_x, regions.centroid_y]))[:, 0]
        for view, regions in ((rectification.first, first), (rectification.second, second))
    )
    moved = x[:, None] - other_x
    low, high = np.full(len(first), np.inf), np.full(len(first), -np.inf)
    np.minimum.at(low, first.border_region, seen.of_arcs[first.border_arc, 0])
    np.maximum.at(high, first.border_region, seen.of_arcs[first.border_arc, 1])
    i, j = np.nonzero((share >= p.least_rows) & (moved >= low[:, None]) & (moved <= high[:, None]))
    price = p.rows * (1 - share[i, j]) + p.area * np.abs(np.log(first.area[i] / second.area[j]))
    price += p.mean * np.abs(first.mean[i] - second.mean[j])
    voted, of_first, of_second = _border_votes(first, second, votes)
    fewer = np.maximum(np.minimum(of_first[i], of_second[j]), 1)
    more = np.maximum(np.maximum(of_first[i], of_second[j]), 1)
    price += p.unvoted_of_fewer * (1 - voted[i, j] / fewer) + p.unvoted_of_more * (1 - voted[i, j] / more)
    return StereoCandidates(i, j, np.asarray(price))


def _rows(rectification: Rectification, view: RectifiedCamera, regions: RegionColumns) -> tuple[Floats, Floats]:
    """First and last rectified row of each region."""
    y = rectification.points(view, regions.outline.astype(float))[:, 1]
    owner = np.repeat(regions.ring_region, np.diff(regions.ring_offsets))
    top, bottom = np.full(len(regions), np.inf), np.full(len(regions), -np.inf)
    np.minimum.at(top, owner, y)
    np.maximum.at(bottom, owner, y)
    return top, bottom


def _border_votes(first: RegionColumns, second: RegionColumns, votes: Votes) -> tuple[Floats, Floats, Floats]:
    """Votes (first, second) of the arcs bounding a region of the first picture for those of one of the second, and all
    votes of the arcs that bound each region."""
    from scipy.sparse import coo_array

    arcs = [int(max(column.max(initial=-1), of.max(initial=-1))) + 1 for column, of in (
        (votes.first, first.border_arc), (votes.second, second.border_arc))]  # fmt: skip
    borders = []
    for side, count in ((first, arcs[0]), (second, arcs[1])):
        key = np.unique(side.border_region * max(count, 1) + side.border_arc)
        of = (key // max(count, 1), key % max(count, 1))
        borders.append(coo_array((np.ones(len(key)), of), shape=(len(side), count)).tocsr())
    cast = coo_array((votes.votes.astype(float), (votes.first, votes.second)), shape=(arcs[0], arcs[1])).tocsr()
    voted = (borders[0] @ cast @ borders[1].T).toarray()
    return voted, borders[0] @ np.asarray(cast.sum(axis=1)), borders[1] @ np.asarray(cast.sum(axis=0))


METHODS = ("pong", "relational")
PONG, RELATIONAL = METHODS


@dataclass(frozen=True)
class StereoPicture:
    """What stereo takes of one picture: arcs, regions, and the relations among them, as columns of unit_relation."""

    arcs: StereoArcs
    regions: RegionColumns
    relations: Columns


@dataclass(frozen=True)
class StereoMatches:
    """What stereo found.  Units: the arcs of the first picture by number, then its regions; labels: of the second.
    solved: the problem with its proof; arcs, regions: how many there are in the first and the second picture."""

    parameters: StereoParameters
    rectification: Rectification
    solved: SolvedProblem
    arcs: tuple[int, int]
    regions: tuple[int, int]
    triangulated: SpaceArcs

    @property
    def arc_label(self) -> Ints:
        """For each arc of the first picture that of the second, -1 for none."""
        return self.solved.result.label[: self.arcs[0]]

    @property
    def partnered(self) -> tuple[Bools, Bools]:
        """Which arcs of the first and of the second picture have a partner."""
        label = self.arc_label
        with_partner = np.zeros(self.arcs[1], bool)
        with_partner[label[label != NONE]] = True
        return label != NONE, with_partner

    @property
    def region_label(self) -> Ints:
        """For each region of the first picture that of the second, -1 for none."""
        label = self.solved.result.label[self.arcs[0] :]
        return np.where(label == NONE, NONE, label - self.arcs[1])


def check_method(parameters: StereoParameters) -> None:
    """Raises UsageError for an unknown method or search."""
    if parameters.method not in METHODS:
        raise UsageError(f"invalid method of stereo {parameters.method!r}: use one of {', '.join(METHODS)}")
    check_mode(parameters.search)


def match_stereo(
    rig: Rig, first: Primitives, second: Primitives, parameters: StereoParameters = DEFAULTS
) -> StereoMatches:
    """Match the primitives of two pictures, taken together by the two cameras of a rig, in its order.

    Raises InputError where the cameras make no stereo pair, UsageError for an unknown method."""
    one, other = (StereoPicture(pack_arcs(it), it.regions, it.relations) for it in (first, second))
    return match_pictures(rig, one, other, parameters)


def match_pictures(
    rig: Rig, first: StereoPicture, second: StereoPicture, parameters: StereoParameters = DEFAULTS
) -> StereoMatches:
    """As `match_stereo`."""
    check_method(parameters)
    rectification = rectify(rig)
    sides = lay_out(rectification, first.arcs, second.arcs, parameters.epipolar)
    seen = estimate_range(rectification, *sides, parameters.range, parameters.epipolar)
    votes = vote(*sides, seen.of_crossings, parameters.epipolar)
    p, evidence = parameters.epipolar, parameters.evidence
    arcs = [_compare_across(*sides, seen, votes, p, evidence), _compare_level(*sides, seen, p, evidence)]
    regions = compare_regions(rectification, first.regions, second.regions, seen, votes, parameters.regions)
    solved = _solve(first, second, StereoCandidates.stack(arcs), regions, parameters)
    label = solved.result.label[: len(first.arcs)]
    matched = np.flatnonzero(label != NONE)
    return StereoMatches(
        parameters=parameters,
        rectification=rectification,
        solved=solved,
        arcs=(len(first.arcs), len(second.arcs)),
        regions=(len(first.regions), len(second.regions)),
        triangulated=triangulate_pairs(rectification, first.arcs, second.arcs, (matched, label[matched]), parameters),
    )


def _solve(
    first: StereoPicture,
    second: StereoPicture,
    arcs: StereoCandidates,
    regions: StereoCandidates,
    parameters: StereoParameters,
) -> SolvedProblem:
    """Step 3: the relational distance over arcs and regions together, by the method."""
    p, bare = parameters.assignment, parameters.method != PONG
    if bare:
        arcs, regions = (replace(found, price=np.zeros(len(found.price))) for found in (arcs, regions))
    else:
        arcs = arcs.take_best(p.most_candidates, np.inf)
        regions = regions.take_best(p.most_candidates, np.inf)
    null = np.repeat([0.0, 0.0] if bare else [p.arc_null, p.region_null], [len(first.arcs), len(first.regions)])
    moved = StereoCandidates(regions.unit + len(first.arcs), regions.label + len(second.arcs), regions.price)
    both = StereoCandidates.stack([arcs, moved])
    share = p.bare_relation_share if bare else p.relation_share
    with open_workspace() as workspace:
        return solve_rows(
            workspace,
            0,
            ProblemRows(
                units=len(null),
                labels=len(second.arcs) + len(second.regions),
                units_id=0,
                labels_id=1,
                unit=both.unit,
                label=both.label,
                cost=np.rint(p.scale * both.price).astype(np.int64),
                null_cost=np.rint(p.scale * null).astype(np.int64),
                null_share=p.bare_null_share if bare else p.null_share,
                nat_cost=share * p.scale,
                tolerances=parameters.tolerances,
                injective=True,
                nodes=p.nodes,
                mode=parameters.search,
            ),
            first.relations,
            second.relations,
        )


# A stereo match as rows of the store.


def record_stereo(
    run: Run, connection: Connection, problem_no: int, units_id: int, labels_id: int, matches: StereoMatches
) -> None:
    """Append the problem with its candidates, relations, decisions and the tree of the search, and the arcs in space.

    `units_id` and `labels_id` are the unit sets of the first and the second extraction: arcs by number, then regions.
    """
    key = {"run_id": run.id, "problem_no": problem_no}
    for table, columns in solved_rows(matches.solved).items():
        if table == "problem":
            columns = {
                **columns,
                "kind": "stereo",
                "method": matches.parameters.method,
                "units_id": units_id,
                "labels_id": labels_id,
                "parameters": json.dumps(asdict(matches.parameters), sort_keys=True),
            }
        run.append(connection, table, {**key, **columns})
    run.append(connection, "triangulated_unit", {**key, **_curves(matches.triangulated)})


def _curves(space: SpaceArcs) -> Columns:
    conic_covariance = [c if np.isfinite(c[0, 0]) else None for c in space.conics.covariance]
    columns = {
        **space.conics.columns(),
        **space.columns(),
        "unit_no": space.first,
        "curve": [CURVES[curve] for curve in space.curve],
        "covariance": Ragged.pack(list(space.covariance)),
        "conic_covariance": Ragged.pack(conic_covariance),
    }
    return {name: columns[name] for name in column_types("triangulated_unit") if name in columns}
