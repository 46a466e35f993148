"""Each camera's picture matched against what a pose lets it see."""

from __future__ import annotations

from collections.abc import Sequence

from vision.cameras.cameras import Rig
from vision.inspection.inspection_parameters import InspectionParameters
from vision.localisation.calibration import correct_rig
from vision.localisation.observation import ModelView, Observation, view_model
from vision.localisation.refine import Refined
from vision.localisation.views import propagate_pose
from vision.matching.matching_parameters import MatchingParameters
from vision.matching.pose_problem import MatchedView, match_view
from vision.matching.view_units import describe_view
from vision.relations.workspace import open_workspace
from vision.scene.scene import Scene


def match_views(
    rig: Rig, pose: Refined, view: ModelView, seen: Observation, p: MatchingParameters
) -> dict[str, MatchedView]:
    """Match the pictures with their views at a pose, by camera: a problem of one workspace for each."""
    matched = {}
    with open_workspace() as workspace:
        for number, (name, camera) in enumerate(rig.cameras.items()):
            arcs, seen_surfaces = view.arcs[name], view.maps[name]
            units = describe_view(arcs, propagate_pose(pose, number, arcs.samples), camera, seen_surfaces, p.view)
            match = match_view(workspace, number, seen.pictures[name], units, seen_surfaces, p.pose)
            matched[name] = MatchedView(units, match)
    return matched


def relate_views(scene: Scene, seen: Observation, poses: Sequence[Refined], p: InspectionParameters) -> list[int]:
    """What the best labelling of the pictures by the views from each pose costs, over all cameras.

    All are labellings of the same primitives, so what one costs less is its margin over the other.
    """
    costs = []
    for pose in poses:
        rig = correct_rig(seen.rig, pose.own)
        view = view_model(scene, rig, pose.world_from_rig, p.localisation)
        matched = match_views(rig, pose, view, seen, p.matching)
        costs.append(sum(one.match.solved.result.cost for one in matched.values()))
    return costs
