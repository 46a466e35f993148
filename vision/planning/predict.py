"""What an inspection from a pose would have to decide by: no picture is needed to say how much of each thing shows."""

from __future__ import annotations

import numpy as np

from relmodel.arrays import Floats
from vision.cameras.cameras import Rig
from vision.localisation.evidence import bound_elements
from vision.localisation.views import find_view_arcs
from vision.presence.items import Items
from vision.presence.presence_parameters import DEFAULTS, PresenceParameters
from vision.presence.samples import collect_samples
from vision.presence.states import pair_with_runs
from vision.presence.support import weigh_samples
from vision.scene.stored_scene import StoredScene


def predict_distinct_px(
    stored: StoredScene, rig: Rig, items: Items, world_from_rig: Floats, p: PresenceParameters = DEFAULTS
) -> Floats:
    """Px (i,) of sharp edges of each item that all cameras of a rig would see at a pose and that could be distinguished
    from others: by the rays, the samples and the crowding that an inspection decides with.

    A face seen at a grazing angle, a far one and one behind another have few such px or none."""
    views = {
        name: find_view_arcs(stored.scene, camera, world_from_rig @ rig.rig_from_camera[name])
        for name, camera in rig.cameras.items()
    }
    if not any(len(view.run) for view in views.values()):
        return np.zeros(len(items))
    bounds = [bound_elements(camera) for camera in rig.cameras.values()]
    samples = collect_samples(stored, rig, bounds, world_from_rig, views, p.samples)
    if not len(samples.run):
        return np.zeros(len(items))
    weight = np.bincount(samples.run, weigh_samples(samples, p.support), samples.run_count)
    head = np.flatnonzero(np.diff(samples.run, prepend=-1) != 0)
    item, run, _ = pair_with_runs(items, samples.surface[head])
    return np.bincount(item, weight[run], len(items)).astype(float)
