"""Each camera's picture matched against what the best pose lets it see."""

from __future__ import annotations

from collections.abc import Sequence

from vision.cameras.cameras import Rig
from vision.extraction.primitives import Primitives
from vision.localisation.calibration import correct_rig
from vision.localisation.coverage import SurfaceMap, map_views
from vision.localisation.localisation_parameters import LocalisationParameters
from vision.localisation.localise import Localisation
from vision.localisation.refine import Refined
from vision.localisation.views import ViewArcs, find_view_arcs, propagate_pose
from vision.matching.matching_parameters import MatchingParameters
from vision.matching.pose_problem import MatchedView, match_view
from vision.matching.view_units import describe_view
from vision.relations.workspace import open_workspace
from vision.scene.scene import Scene


def match_views(
    rig: Rig,
    found: Localisation,
    maps: dict[str, SurfaceMap],
    pictures: dict[str, Primitives],
    p: MatchingParameters,
) -> dict[str, MatchedView]:
    """By camera, at the best pose, from which the cameras see `maps`; nothing where none was found."""
    if found.best is None:
        return {}
    arcs = {name: view.arcs for name, view in found.views.items()}
    return _match(rig, found.best, arcs, maps, pictures, p)


def relate_views(
    scene: Scene,
    rig: Rig,
    poses: Sequence[Refined],
    pictures: dict[str, Primitives],
    localisation: LocalisationParameters,
    p: MatchingParameters,
) -> list[int]:
    """What the best labelling of the pictures by the views from each pose costs, over all cameras.

    All are labellings of the same primitives, so what one costs less is its margin over the other.
    """
    costs = []
    for pose in poses:
        solved = correct_rig(rig, pose.own)
        arcs = {
            name: find_view_arcs(scene, camera, pose.world_from_rig @ solved.rig_from_camera[name], localisation)
            for name, camera in solved.cameras.items()
        }
        maps = map_views(scene, solved, pose.world_from_rig, localisation)
        matched = _match(solved, pose, arcs, maps, pictures, p)
        costs.append(sum(view.match.solved.result.cost for view in matched.values()))
    return costs


def _match(
    rig: Rig,
    pose: Refined,
    arcs: dict[str, ViewArcs],
    maps: dict[str, SurfaceMap],
    pictures: dict[str, Primitives],
    p: MatchingParameters,
) -> dict[str, MatchedView]:
    """The pictures against their views at a pose, a problem of one workspace for each camera."""
    matched = {}
    with open_workspace() as workspace:
        for number, (name, camera) in enumerate(rig.cameras.items()):
            shift = propagate_pose(pose, number, arcs[name].samples)
            units = describe_view(arcs[name], shift, camera, maps[name], p.view)
            matched[name] = MatchedView(units, match_view(workspace, number, pictures[name], units, maps[name], p.pose))
    return matched
