"""Parts that are missing: whether the edges that a part covers show where its own should."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from relmodel.arrays import Floats, Ints
from vision.cameras.cameras import Rig
from vision.localisation.measurements import EdgeIndex
from vision.localisation.views import find_view_arcs
from vision.localisation.visibility import SurfaceMap
from vision.presence.displaced import find_loose_pieces
from vision.presence.presence_parameters import PresenceParameters
from vision.presence.samples import (
    EdgeRuns,
    Samples,
    Sides,
    collect_samples,
    find_nearby,
    look_at_sides,
    measure_support,
    part_at_turns,
    sum_in_one_light,
    weigh_runs,
)
from vision.scene import StoredScene

# A bolt that is missing leaves its hole, and the rim of that hole is found where a smaller bolt would be. So what would
# show without a piece is predicted as well, and its own edges and those that it covers, told from each other, are
# weighed in one light: one of both should be there, and not the other.


@dataclass(frozen=True)
class Uncovered:
    """Of the scene's occurrences (o,): log odds of the edges that their piece covers, each there against not there, and
    of the piece's own; nan where it covers none."""

    beneath: Floats
    own: Floats

    @property
    def log_odds(self) -> Floats:
        """Of the piece not being there against its being there."""
        return np.asarray(self.beneath - self.own)


def look_beneath(
    stored: StoredScene,
    rig: Rig,
    world_from_rig: Floats,
    indexes: list[EdgeIndex],
    response_px: Floats,
    samples: Samples,
    sides: Sides,
    runs: EdgeRuns,
    maps: Sequence[SurfaceMap],
    p: PresenceParameters,
) -> Uncovered:
    """What shows where those loose pieces of a scene should be whose edges are not surely found; samples, sides, runs,
    maps: of what is seen with them."""
    piece_of, loose = find_loose_pieces(stored, samples, p)
    occurrence_at, pieces, cameras = np.append(stored.scene.surface_occurrence, -1), len(piece_of), len(rig.cameras)

    def weigh(piece: Ints, it: EdgeRuns) -> Floats:
        in_light = sum_in_one_light(piece * cameras + it.camera, it.in_light, pieces * cameras)
        return np.asarray(in_light.reshape(pieces, cameras).sum(axis=1))

    loose = loose[weigh(piece_of[occurrence_at[runs.surface[:, 0]]], runs)[loose] < p.parts.sure_log_odds]
    bare = replace(stored, scene=stored.scene.without(np.isin(piece_of, loose)))
    bounds = [(index.edges.low, index.edges.high) for index in indexes]
    arcs = {
        name: find_view_arcs(bare.scene, camera, world_from_rig @ rig.rig_from_camera[name])
        for name, camera in rig.cameras.items()
    }
    beneath = collect_samples(bare, rig, bounds, world_from_rig, arcs, p.samples)
    covering = np.full(len(beneath.run), -1)
    for number, shown in enumerate(maps):
        rows = np.flatnonzero(beneath.camera == number)
        surface = shown.value_along(shown.surface, shown.camera.normalise(beneath.pixel[rows]), -1)
        covering[rows] = np.append(piece_of, -1)[occurrence_at[surface]]
    rows = np.flatnonzero(np.isin(covering, loose))
    beneath, covering = beneath.take(rows), covering[rows]
    if not len(rows):
        return Uncovered(*np.full((2, len(piece_of)), np.nan))

    # One after the other, camera by camera; a run beneath two pieces is one of each.
    n = len(samples.run)
    both = Samples.stack([samples, replace(beneath, run=samples.run_count + beneath.run * pieces + covering)])
    order = np.lexsort((both.run, both.camera))
    both = both.take(order)
    both = replace(both, run=np.cumsum(np.diff(both.run, prepend=-1) != 0) - 1)
    at = np.argsort(order)
    of_bare = look_at_sides(bare.scene, rig, world_from_rig, beneath, p.sides)
    around = Sides.stack([sides, replace(of_bare, sample=n + of_bare.sample)])
    around = replace(around, sample=at[around.sample])
    nearby = find_nearby(both.camera, both.pixel, both.direction, indexes, response_px, p.samples)
    parted = part_at_turns(both, p.runs)
    found = weigh_runs(parted, measure_support(both, nearby, p.support), around, p.runs)

    head = order[np.flatnonzero(np.diff(parted.run, prepend=-1) != 0)]
    own = piece_of[stored.scene.surface_occurrence[samples.surface[:, 0]]]
    piece, covers = np.append(own, covering)[head], np.isin(piece_of, covering)
    odds = (weigh(piece[rows], found.take(rows))[piece_of] for rows in (head >= n, head < n))
    return Uncovered(*(np.where(covers, values, np.nan) for values in odds))
