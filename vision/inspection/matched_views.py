"""Each camera's picture matched against what the best pose lets it see."""

from __future__ import annotations

from dataclasses import dataclass

from relmodel.store.database import Database
from vision.cameras.cameras import Rig
from vision.extraction.primitives import Primitives
from vision.localisation.coverage import map_surfaces
from vision.localisation.localise import Localisation
from vision.localisation.parameters import LocalisationParameters
from vision.localisation.scene import Scene
from vision.localisation.views import propagate_pose_sigma
from vision.matching.parameters import MatchingParameters
from vision.matching.pose_problem import PoseMatch, match_view
from vision.matching.view_units import ViewUnits, describe_view


@dataclass(frozen=True)
class MatchedView:
    """The units of a camera's view, and which primitives of its picture they are."""

    units: ViewUnits
    match: PoseMatch


def match_views(
    workspace: Database,
    scene: Scene,
    rig: Rig,
    found: Localisation,
    pictures: dict[str, Primitives],
    localisation: LocalisationParameters,
    p: MatchingParameters,
) -> dict[str, MatchedView]:
    """By camera; nothing where no pose was found."""
    matched = {}
    for number, (name, view) in enumerate(found.views.items()):
        assert found.best is not None
        camera, pose = rig.cameras[name], found.best.world_from_rig @ rig.rig_from_camera[name]
        seen = map_surfaces(scene, camera, pose, localisation)
        sigma = propagate_pose_sigma(found.best, list(rig.cameras).index(name), view.arcs.samples)
        units = describe_view(view.arcs, sigma, camera, seen, p.view)
        matched[name] = MatchedView(units, match_view(workspace, number, pictures[name], units, seen, p.pose))
    return matched
