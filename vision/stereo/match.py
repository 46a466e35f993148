"""Stereo by arcs and regions, without a model: candidates by the epipolar geometry, relations on both sides, the
labelling that keeps them, and the matched arcs in space."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from relmodel.arrays import Bools, Ints
from relmodel.columns import Columns
from relmodel.errors import UsageError
from relmodel.labelling.problem import NONE
from relmodel.labelling.solve import check_mode
from vision.cameras.cameras import Rig
from vision.extraction.primitives import Primitives
from vision.relations.joins import ProblemRows, Solved, solve_rows
from vision.relations.workspace import open_workspace
from vision.stereo.crossings import StereoArcs, lay_out, pack_arcs
from vision.stereo.disparity_range import estimate_range
from vision.stereo.epipolar import vote
from vision.stereo.evidence import Candidates, compare_arcs
from vision.stereo.rectification import Rectification, rectify
from vision.stereo.regions import StereoRegions, compare_regions, pack_regions
from vision.stereo.stereo_parameters import DEFAULTS, StereoParameters
from vision.stereo.triangulate import Triangulated, triangulate_pairs

METHODS = ("pong", "relational")
PONG, RELATIONAL = METHODS


@dataclass(frozen=True)
class StereoPicture:
    """What stereo takes of one picture: arcs, regions, and the relations among them, as columns of unit_relation."""

    arcs: StereoArcs
    regions: StereoRegions
    relations: Columns


@dataclass(frozen=True)
class StereoMatches:
    """What stereo found.  Units: the arcs of the first picture by number, then its regions; labels: of the second.

    solved: the problem with its proof; arcs, regions: how many there are in the first and the second picture.
    """

    parameters: StereoParameters
    rectification: Rectification
    solved: Solved
    arcs: tuple[int, int]
    regions: tuple[int, int]
    triangulated: Triangulated

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


def pack_picture(picture: Primitives) -> StereoPicture:
    """A picture as stereo takes it."""
    return StereoPicture(pack_arcs(picture), pack_regions(picture), picture.relations)


def match_stereo(
    rig: Rig, first: Primitives, second: Primitives, parameters: StereoParameters = DEFAULTS
) -> StereoMatches:
    """Match the primitives of two pictures, taken together by the two cameras of a rig, in its order.

    Raises InputError where the cameras make no stereo pair, UsageError for an unknown method.
    """
    return match_pictures(rig, pack_picture(first), pack_picture(second), parameters)


def match_pictures(
    rig: Rig, first: StereoPicture, second: StereoPicture, parameters: StereoParameters = DEFAULTS
) -> StereoMatches:
    """As `match_stereo`."""
    check_method(parameters)
    rectification = rectify(rig)
    sides = lay_out(rectification, first.arcs, second.arcs, parameters.epipolar)
    seen = estimate_range(rectification, *sides, parameters.range, parameters.epipolar)
    votes = vote(*sides, seen.of_crossings, parameters.epipolar)
    arcs = compare_arcs(*sides, seen, votes, parameters.epipolar, parameters.evidence)
    regions = compare_regions(rectification, first.regions, second.regions, seen, votes, parameters.regions)
    solved = _solve(first, second, arcs, regions, parameters)
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
    first: StereoPicture, second: StereoPicture, arcs: Candidates, regions: Candidates, parameters: StereoParameters
) -> Solved:
    """Step 3: the relational distance over arcs and regions together, by the method."""
    p, bare = parameters.assignment, parameters.method != PONG
    if bare:
        arcs, regions = (replace(found, price=np.zeros(len(found.price))) for found in (arcs, regions))
    else:
        arcs = arcs.take_best(p.most_candidates, np.inf)
        regions = regions.take_best(p.most_candidates, np.inf)
    null = np.repeat([0.0, 0.0] if bare else [p.arc_null, p.region_null], [len(first.arcs), len(first.regions)])
    moved = Candidates(regions.unit + len(first.arcs), regions.label + len(second.arcs), regions.price)
    both = Candidates.stack([arcs, moved])
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
