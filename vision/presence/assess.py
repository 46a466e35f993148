"""What is there and what is not, at the pose that a localisation found."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from vision.localisation.localise import Localisation
from vision.localisation.observation import ModelView, Observation
from vision.localisation.parts_in_view import PartsInView
from vision.localisation.views import SMOOTH, ViewArcs
from vision.localisation.visibility import VisibleArcs
from vision.matching.pose_problem import MatchedView
from vision.presence.appearance import find_normals, look_at_features
from vision.presence.displaced_parts import measure_displacements
from vision.presence.displaced_surfaces import Edges, find_usable
from vision.presence.displacement import Beside
from vision.presence.distances import measure_distances
from vision.presence.items import list_items
from vision.presence.moving_surfaces import find_moving_surfaces, find_tangent
from vision.presence.presence_parameters import DEFAULTS, PresenceParameters
from vision.presence.regions import gather_regions
from vision.presence.samples import collect_samples, find_nearby
from vision.presence.sides import look_at_sides
from vision.presence.states import Presence, Signs, decide
from vision.presence.stretches import part_at_turns, weigh_runs
from vision.presence.support import measure_support
from vision.presence.surfaces import assess_surfaces
from vision.presence.unexplained import find_unexplained, lie_on
from vision.scene.stored_scene import StoredScene


def assess(
    stored: StoredScene,
    seen: Observation,
    found: Localisation,
    view: ModelView,
    parts: PartsInView,
    matched: Mapping[str, MatchedView],
    p: PresenceParameters = DEFAULTS,
) -> Presence:
    """Evidence and state of every part, feature and surface in view at the best pose found.

    view: what the cameras should see of the stored scene there, and parts: which share of each part and feature;
    matched: by camera, what relational matching made of it, or nothing: then regions say nothing.
    """
    assert found.best is not None
    rig, pose, views = found.rig, found.best, view.arcs
    indexes = [found.edge_indexes[name] for name in rig.cameras]
    bounds = [(index.edges.low, index.edges.high) for index in indexes]
    samples = collect_samples(stored, rig, bounds, pose.world_from_rig, views, p.samples)
    nearby = find_nearby(samples.camera, samples.pixel, samples.direction, indexes, pose.own[:, 0], p.samples)
    support = measure_support(samples, nearby, p.support)
    sides = look_at_sides(stored.scene, rig, pose.world_from_rig, samples, p.sides)
    runs = weigh_runs(samples, support, sides, p.runs)
    pieces = weigh_runs(part_at_turns(samples, p.runs), support, sides, p.runs)
    maps = [view.maps[name] for name in rig.cameras]
    items = list_items(stored, parts, maps)
    blends = np.concatenate(
        [
            lie_on(index, _blends(views[name]), p.unexplained.reach_px, p.unexplained.min_cosine)
            for name, index in zip(rig.cameras, indexes, strict=True)
        ]
    )
    moving = find_moving_surfaces(samples, find_tangent(stored, p.moved.tangent_cosine))
    usable = find_usable(samples, nearby, support, blends, p.moved)
    edges = Edges(samples, moving, Beside(nearby.first, nearby.offset, usable, support.weight), runs)
    surfaces = assess_surfaces(edges, stored, items, len(rig.cameras), p)
    unexplained = find_unexplained(stored.scene, rig, seen.pictures, indexes, pose.world_from_rig, views, p.unexplained)
    regions = gather_regions([matched.get(name) for name in rig.cameras], len(stored.surface_no))
    appearance = look_at_features(
        items, samples, find_normals(stored.scene), [seen.greys[name] for name in rig.cameras], maps, p.appearance
    )
    displacements = measure_displacements(
        stored, rig, pose.world_from_rig, indexes, pose.own[:, 0], samples, nearby, support, runs, p
    )
    distances = measure_distances(items, stored.scene, stored.radius, surfaces, p.distances)
    signs = Signs(
        runs=pieces,
        surfaces=surfaces,
        regions=regions,
        appearance=appearance,
        displacements=displacements,
        distances=distances,
        unexplained=unexplained,
    )
    return decide(items, stored.radius, signs, list(rig.cameras), p.states)


def _blends(view: ViewArcs) -> VisibleArcs:
    return view.samples.take(view.kind[view.run] == SMOOTH)
