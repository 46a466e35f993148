"""The model as the cameras see it at the pose found, drawn over the pictures in the colours of what is there."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from relmodel.arrays import Bytes, Floats, Ints
from vision.cameras.cameras import Camera, Rig
from vision.cameras.drawing import Rgb, Stroke, draw, save_side_by_side
from vision.cameras.images import Picture
from vision.localisation.localise import Localisation, View
from vision.localisation.views import SMOOTH
from vision.presence.report import SEVERITY, rank_failures
from vision.presence.states import (
    CHANGED,
    CONFIRMED,
    CONTRADICTED,
    NOT_CONFIRMED,
    UNDECIDABLE,
    Presence,
    pair_with_runs,
)
from vision.presence.unexplained import REGION, Unexplained

COLOURS: dict[int, Rgb] = {
    CONFIRMED: (60, 220, 60),
    UNDECIDABLE: (250, 220, 60),
    NOT_CONFIRMED: (235, 70, 235),
    CHANGED: (255, 140, 0),
    CONTRADICTED: (240, 40, 40),
}
BLEND: Rgb = (70, 130, 250)
UNEXPLAINED: Rgb = (0, 230, 230)
MOSTLY = 0.5  # share of an edge that is found from which it is drawn as found


def draw_overlay(
    path: str | Path,
    pictures: dict[str, Picture],
    rig: Rig,
    found: Localisation,
    presence: Presence | None,
) -> None:
    """Write the pictures side by side with the visible arcs of the model: as `draw_model` draws them, without presence
    all as undecided."""
    save_side_by_side(path, [draw_model(name, pictures[name], rig, found, presence) for name in pictures])


def draw_model(
    name: str,
    picture: Picture,
    rig: Rig,
    found: Localisation,
    presence: Presence | None,
) -> Bytes:
    """A camera's picture (rows, columns, 3: RGB) with the visible arcs: found ones in green; others in the colour of
    the worst state of a feature or part that they belong to, red contradicted, orange changed, magenta not confirmed,
    else yellow; edges of blends, which show as shading and not as edges, in blue.  Boxes in cyan: unexplained regions,
    and unexplained arcs where the model shows something."""
    if name not in found.views or found.best is None:
        return draw(picture.grey, [])
    view = found.views[name]
    segments = _segments(view, rig.cameras[name], found.best.world_from_rig @ rig.rig_from_camera[name])
    camera = list(rig.cameras).index(name)
    state = np.full(len(view.arcs.kind), UNDECIDABLE)
    if presence is not None:
        state = _states_of_runs(view, camera, presence)
    run, blend = view.arcs.run, view.arcs.kind == SMOOTH
    by_state = [Stroke(segments[(state == s)[run] & ~blend[run]], COLOURS[s]) for s in reversed(SEVERITY)]
    boxes = [] if presence is None else [Stroke(_boxes(presence.unexplained, camera), UNEXPLAINED)]
    return draw(picture.grey, [Stroke(segments[blend[run]], BLEND), *by_state, *boxes])


def _boxes(unexplained: Unexplained, camera: int) -> Floats:
    """Sides (n, 2, 2) px of the boxes of what a camera shows that the model does not account for."""
    labels = (unexplained.camera == camera) & (~unexplained.beyond | (unexplained.kind == REGION))
    u0, v0, u1, v1 = unexplained.box[labels].T
    corner = np.stack([u0, v0, u1, v0, u1, v1, u0, v1], axis=1).reshape(-1, 4, 2)
    return np.stack([corner, np.roll(corner, -1, axis=1)], axis=2).reshape(-1, 2, 2)


def _states_of_runs(view: View, camera: int, presence: Presence) -> Ints:
    """For each run of a view the state it is drawn with."""
    items, runs = presence.items, presence.runs
    place = np.argsort(SEVERITY)
    worst = np.full(len(runs.camera), place[UNDECIDABLE])
    item, run, lent = pair_with_runs(items, runs.surface)
    bad = np.zeros(len(items), bool)
    bad[rank_failures(presence)] = True
    rows = bad[item] & ~lent
    np.minimum.at(worst, run[rows], place[presence.state[item[rows]]])
    state = np.array(SEVERITY)[worst]
    state[(runs.weight_px > 0) & (runs.found >= MOSTLY)] = CONFIRMED
    out = np.full(len(view.arcs.kind), UNDECIDABLE)
    mine = runs.camera == camera
    out[runs.view_run[mine]] = state[mine]
    return out


def _segments(view: View, camera: Camera, world_from_camera: Floats) -> Floats:
    """Segments (n, 2, 2) px of the picture, one a sample."""
    samples = view.arcs.samples
    # Half of what each sample stands for on either side, in space: the camera's distortion bends the rest.
    depth = (samples.point - world_from_camera[:3, 3]) @ world_from_camera[:3, 2]
    half = 0.5 * samples.length_px * depth / camera.matrix[0, 0]
    ends = [samples.point + sign * half[:, None] * samples.tangent for sign in (-1.0, 1.0)]
    return np.stack(
        [camera.project((end - world_from_camera[:3, 3]) @ world_from_camera[:3, :3])[0] for end in ends], axis=1
    )
