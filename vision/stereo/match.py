"""Stereo by arcs: steps 1 and 2 of Pong's matcher, and the matched arcs in space.

Step 3, the relational distance over arcs and regions together, starts from what step 2 leaves: `select_candidates` with
their similarity S, whose unary cost there is round(2 (1 - S))."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from relmodel.arrays import Bools, Ints
from relmodel.matching.assignment import Assignment
from vision.cameras.cameras import Rig
from vision.extraction.primitives import Primitives
from vision.stereo.crossings import StereoArcs, cross_rows, on_common_rows, pack_arcs
from vision.stereo.epipolar import DepthRange, Votes, vote
from vision.stereo.parameters import DEFAULTS, StereoParameters
from vision.stereo.rectification import Rectification, rectify
from vision.stereo.segments import Candidates, assign, select_candidates
from vision.stereo.triangulate import Triangulated, triangulate_pairs


@dataclass(frozen=True)
class StereoMatches:
    """What stereo found; arcs bear the numbers of their extractions.

    `assignment.label` (left arcs,) is the right arc of each left one, -1 for none, `reason` says why: matched,
    no_candidate, null_cheaper or taken.  `left_votable`, `right_votable`: arcs that cross epipolar rows; the others lie
    along them or outside what both pictures show, and stereo says nothing about them.
    """

    parameters: StereoParameters
    rectification: Rectification
    votes: Votes
    candidates: Candidates
    assignment: Assignment
    reason: npt.NDArray[np.str_]
    left_votable: Bools
    right_votable: Bools
    triangulated: Triangulated

    @property
    def left_unmatched(self) -> Bools:
        """Left arcs that should have found a counterpart and did not: highlights, texture, what one camera alone sees.

        A fragment whose rows vote for an arc that goes to another fragment has a counterpart, though no partner.
        """
        return self._unmatched(self.votes.left, self.votes.left_extent, self.assignment.label >= 0, self.left_votable)

    @property
    def right_unmatched(self) -> Bools:
        """Right arcs that should have found a counterpart and did not."""
        taken = np.zeros(len(self.right_votable), bool)
        taken[self.assignment.label[self.assignment.label >= 0]] = True
        return self._unmatched(self.votes.right, self.votes.right_extent, taken, self.right_votable)

    def _unmatched(self, arc: Ints, extent: Ints, matched: Bools, votable: Bools) -> Bools:
        most = np.zeros(len(extent), np.int64)
        np.maximum.at(most, arc, self.votes.votes)
        return votable & ~matched & (2 * most < extent)


def match_stereo(
    rig: Rig,
    left: Primitives,
    right: Primitives,
    depth_range: DepthRange,
    parameters: StereoParameters = DEFAULTS,
) -> StereoMatches:
    """Match the arcs of two extractions: pictures of the cameras `left` and `right` of the rig, taken together.

    `depth_range` bounds how far off the things seen may be; maps from a predicted view match more, and more rightly,
    than two numbers.  Raises InputError where the cameras make no stereo pair.
    """
    return match_arcs(rig, pack_arcs(left), pack_arcs(right), depth_range, parameters)


def match_arcs(
    rig: Rig,
    left: StereoArcs,
    right: StereoArcs,
    depth_range: DepthRange,
    parameters: StereoParameters = DEFAULTS,
) -> StereoMatches:
    """Match the arcs of the cameras `left` and `right` of the rig, for things seen within `depth_range`."""
    rectification = rectify(rig)
    p = parameters.epipolar
    views = ((rectification.left, left), (rectification.right, right))
    crossed = [cross_rows(rectification, view, arcs, p.tangent_reach, p.least_rise) for view, arcs in views]
    left_crossings, right_crossings = on_common_rows(*crossed)
    pixels = left.points[left_crossings.position.astype(np.int64)]
    camera = rectification.left.camera
    near, far = depth_range.at(pixels, camera.width, camera.height)
    votes = vote(
        left_crossings,
        right_crossings,
        rectification.disparity(pixels, far),
        rectification.disparity(pixels, near),
        len(left),
        len(right),
        parameters.epipolar,
    )
    found = select_candidates(votes, parameters.segments)
    assignment, reason = assign(found, len(left), len(right), parameters.segments)
    made = assignment.label[found.left] == found.right
    least = parameters.segments.least_votes
    return StereoMatches(
        parameters=parameters,
        rectification=rectification,
        votes=votes,
        candidates=found,
        assignment=assignment,
        reason=reason,
        left_votable=votes.left_extent >= least,
        right_votable=votes.right_extent >= least,
        triangulated=triangulate_pairs(rectification, left, right, (found.left[made], found.right[made]), parameters),
    )
