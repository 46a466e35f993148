"""Each camera's picture matched against what the best pose lets it see."""

from __future__ import annotations

from relmodel.store.database import Database
from vision.cameras.cameras import Rig
from vision.extraction.primitives import Primitives
from vision.localisation.coverage import map_surfaces
from vision.localisation.localisation_parameters import LocalisationParameters
from vision.localisation.localise import Localisation
from vision.localisation.refine import Refined
from vision.localisation.views import ViewArcs, find_view_arcs, propagate_pose
from vision.matching.matching_parameters import MatchingParameters
from vision.matching.pose_problem import MatchedView, match_view
from vision.matching.view_units import describe_view
from vision.scene.scene import Scene


def match_views(
    workspace: Database,
    scene: Scene,
    rig: Rig,
    found: Localisation,
    pictures: dict[str, Primitives],
    localisation: LocalisationParameters,
    p: MatchingParameters,
) -> dict[str, MatchedView]:
    """By camera, at the best pose; nothing where none was found."""
    if found.best is None:
        return {}
    arcs = {name: view.arcs for name, view in found.views.items()}
    return _match(workspace, 0, scene, rig, found.best, arcs, pictures, localisation, p)


def measure_relational_distances(
    workspace: Database,
    scene: Scene,
    rig: Rig,
    found: Localisation,
    best: dict[str, MatchedView],
    pictures: dict[str, Primitives],
    localisation: LocalisationParameters,
    p: MatchingParameters,
) -> list[int | None]:
    """What the best labelling of the pictures by the view of each hypothesis costs, over all cameras; None where it was
    not asked: of those that are no rivals, and of rivals beyond the first `p.rivals`.

    All are labellings of the same primitives, so what one costs less is its margin over the other.
    """
    distances: list[int | None] = [None] * len(found.hypotheses)
    if not found.rivals:
        return distances
    distances[0] = _cost(best)
    for number, rival in enumerate(found.rivals[: p.rivals], start=1):
        arcs = {
            name: find_view_arcs(scene, camera, rival.world_from_rig @ rig.rig_from_camera[name], localisation)
            for name, camera in rig.cameras.items()
        }
        first = number * len(rig.cameras)
        matched = _match(workspace, first, scene, rig, rival, arcs, pictures, localisation, p)
        distances[found.hypotheses.index(rival)] = _cost(matched)
    return distances


def _cost(matched: dict[str, MatchedView]) -> int:
    return sum(view.match.solved.result.cost for view in matched.values())


def _match(
    workspace: Database,
    first: int,
    scene: Scene,
    rig: Rig,
    pose: Refined,
    arcs: dict[str, ViewArcs],
    pictures: dict[str, Primitives],
    localisation: LocalisationParameters,
    p: MatchingParameters,
) -> dict[str, MatchedView]:
    """The pictures against their views at a pose, as problems from number `first` on."""
    matched = {}
    for number, (name, camera) in enumerate(rig.cameras.items()):
        seen = map_surfaces(scene, camera, pose.world_from_rig @ rig.rig_from_camera[name], localisation)
        shift = propagate_pose(pose, number, arcs[name].samples)
        units = describe_view(arcs[name], shift, camera, seen, p.view)
        matched[name] = MatchedView(units, match_view(workspace, first + number, pictures[name], units, seen, p.pose))
    return matched
