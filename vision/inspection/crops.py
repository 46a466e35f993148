"""Pieces of the pictures that show what is not as the model says, the worst first."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from relmodel.arrays import Bytes, Ints
from relmodel.errors import InputError
from vision.cameras.cameras import Rig
from vision.cameras.drawing import draw, save_side_by_side
from vision.cameras.images import Picture
from vision.inspection.overlay import draw_model
from vision.localisation.localise import Localisation
from vision.presence.report import rank_failures
from vision.presence.states import STATES, Presence

MARGIN_PX = 40
MOST = 50


def check_crops(folder: str | Path) -> None:
    """Raise InputError where the folder cannot be made, before anything is computed."""
    try:
        Path(folder).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"the folder {folder} cannot be made ({error.strerror}): name another place") from error


def write_crops(
    folder: str | Path,
    pictures: dict[str, Picture],
    rig: Rig,
    found: Localisation,
    presence: Presence,
) -> list[Path]:
    """Write a picture of each failure: what every camera shows there, without and with the model; at most 50."""
    plain = {name: draw(picture.grey, []) for name, picture in pictures.items()}
    drawn = {name: draw_model(name, picture, rig, found, presence) for name, picture in pictures.items()}
    written = []
    for place, row in enumerate(rank_failures(presence)[:MOST].tolist()):
        pieces: list[Bytes] = []
        for name in pictures:
            box = _find_box(presence, row, list(rig.cameras).index(name), rig, name, found)
            if box is not None:
                x0, y0, x1, y1 = box
                pieces += [plain[name][y0:y1, x0:x1], drawn[name][y0:y1, x0:x1]]
        if pieces:
            words = re.sub(r"[^A-Za-z0-9.-]+", "_", presence.items.path[row])
            path = Path(folder) / f"{place + 1:02d}_{STATES[presence.state[row]]}_{words}.png"
            save_side_by_side(path, pieces)
            written.append(path)
    return written


def _find_box(
    presence: Presence, row: int, camera: int, rig: Rig, name: str, found: Localisation
) -> tuple[int, int, int, int] | None:
    """Bounds x0 y0 x1 y1 (px, half-open) of an item's edges in a camera, widened; None where it shows none."""
    items, runs, view = presence.items, presence.runs, found.views[name].arcs
    surfaces: Ints = items.surface[items.member == row]
    mine = runs.view_run[(runs.camera == camera) & np.isin(runs.surface, surfaces).any(axis=1)]
    at = np.isin(view.run, mine)
    if not at.any():
        return None
    it = rig.cameras[name]
    pixel = it.distort(it.normalise(view.samples.pixel[at]))
    low = np.floor(pixel.min(axis=0) - MARGIN_PX).clip(0).astype(int)
    high = np.ceil(pixel.max(axis=0) + MARGIN_PX).astype(int)
    return int(low[0]), int(low[1]), int(min(high[0], it.width)), int(min(high[1], it.height))
