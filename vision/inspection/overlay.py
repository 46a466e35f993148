"""The model as the cameras see it at the pose found, drawn over the pictures."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from vision.cameras.cameras import Rig
from vision.cameras.drawing import Stroke, draw, save_side_by_side
from vision.cameras.images import Picture
from vision.inspection.matched_views import MatchedView
from vision.localisation.localise import Localisation
from vision.localisation.views import SMOOTH

MATCHED, UNMATCHED, BLEND = (60, 220, 60), (240, 70, 60), (70, 130, 250)


def draw_overlay(
    path: str | Path, pictures: dict[str, Picture], rig: Rig, found: Localisation, matched_views: dict[str, MatchedView]
) -> None:
    """Write the pictures side by side with the visible arcs of the model: matched to an image arc in green, not matched
    in red, edges of blends (which show as shading, not as edges) in blue."""
    drawn = []
    for name, picture in pictures.items():
        strokes = []
        if name in found.views and found.best is not None:
            view = found.views[name]
            arcs, samples = view.arcs, view.arcs.samples
            camera = rig.cameras[name]
            pose = found.best.world_from_rig @ rig.rig_from_camera[name]
            # Half of what each sample stands for on either side, in space: the camera's distortion bends the rest.
            depth = (samples.point - pose[:3, 3]) @ pose[:3, 2]
            half = 0.5 * samples.length_px * depth / camera.matrix[0, 0]
            ends = [samples.point + sign * half[:, None] * samples.tangent for sign in (-1.0, 1.0)]
            pixels = [camera.project((end - pose[:3, 3]) @ pose[:3, :3])[0] for end in ends]
            segments = np.stack(pixels, axis=1)
            pairs = matched_views[name].match.arcs
            matched = np.isin(arcs.run, pairs.view_arc[pairs.accepted])
            blend = arcs.kind[arcs.run] == SMOOTH
            strokes = [
                Stroke(segments[blend & ~matched], BLEND),
                Stroke(segments[~blend & ~matched], UNMATCHED),
                Stroke(segments[matched], MATCHED),
            ]
        drawn.append(draw(picture.grey, strokes))
    save_side_by_side(path, drawn)
