"""What is there and what is not, at the pose that a localisation found."""

from __future__ import annotations

from collections.abc import Mapping

from relmodel.arrays import Floats
from vision.cameras.cameras import Rig
from vision.extraction.primitives import Primitives
from vision.localisation.evidence import collect_edge_points
from vision.localisation.localise import Localisation
from vision.localisation.measurements import EdgeIndex
from vision.localisation.parameters import LocalisationParameters
from vision.localisation.parts_in_view import PartsInView
from vision.localisation.stored_scene import StoredScene
from vision.presence.items import list_items
from vision.presence.moved import collect_pulls
from vision.presence.parameters import DEFAULTS, PresenceParameters
from vision.presence.runs import weigh_runs
from vision.presence.samples import collect_samples, find_beside
from vision.presence.sides import look_at_sides
from vision.presence.states import Presence, decide
from vision.presence.support import measure_support
from vision.presence.surfaces import assess_surfaces
from vision.presence.unexplained import find_unexplained


def assess(
    stored: StoredScene,
    rig: Rig,
    pictures: Mapping[str, Primitives],
    found: Localisation,
    parts: PartsInView,
    localisation: LocalisationParameters,
    p: PresenceParameters = DEFAULTS,
) -> Presence:
    """Evidence and state of every part, feature and surface in view; `found` has a pose, `pictures` are by camera."""
    assert found.best is not None
    pose: Floats = found.best.world_from_rig
    indexes = [
        EdgeIndex(collect_edge_points(pictures[name], camera, localisation.evidence))
        for name, camera in rig.cameras.items()
    ]
    samples = collect_samples(stored, rig, indexes, found, p.samples)
    beside = find_beside(samples, indexes, found.best.own[:, 0], p.samples)
    support = measure_support(samples, beside, p.support)
    sides = look_at_sides(stored.scene, rig, pose, samples, p.sides)
    runs = weigh_runs(samples, support, sides, p.runs)
    items = list_items(stored, rig, pose, parts, localisation)
    pulls = collect_pulls(samples, beside, support, p.moved)
    surfaces = assess_surfaces(samples, support, runs, pulls, len(rig.cameras), len(stored.surface_no), p)
    unexplained = find_unexplained(stored.scene, rig, pictures, indexes, found, p.unexplained)
    return decide(items, stored.radius, runs, surfaces, unexplained, list(rig.cameras), p.states)
