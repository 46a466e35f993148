"""Regions of the pictures that lie on surfaces: a surface whose area one picture shows as regions of its own is seen.

Which regions are which surfaces is decided by relational matching (`vision/matching`): a region counts for a surface
where nearly all of it lies on it and the relations to its neighbours are those of the surface.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from relmodel.arrays import Floats
from vision.matching.pose_problem import MatchedView


@dataclass(frozen=True)
class RegionSupport:
    """Of the scene's surfaces by camera (s, c): shown: px that it shows; covered: px of it that its regions cover."""

    shown: Floats
    covered: Floats


def gather_regions(views: Sequence[MatchedView | None], count: int) -> RegionSupport:
    """What the pictures' regions cover of a scene's `count` surfaces, by the matched views in the rig's order, None for
    what was not matched."""
    shown, covered = np.zeros((2, count, len(views)))
    for camera, view in enumerate(views):
        if view is None:
            continue
        units, match = view.units, view.match
        shown[units.surface, camera] = units.visible_px
        taken = match.surfaces.accepted
        np.add.at(covered[:, camera], units.surface[match.surfaces.view_surface[taken]], match.surfaces.pixels[taken])
    return RegionSupport(shown, covered)
