"""How much an edge predicted at a place and orientation is supported by a picture, against what chance would find.

For each of a few orientations (modulo pi) the picture is a grid of cells that hold the strongest edge element within
reach.  A cell's evidence is the log likelihood ratio

    log( (d_k + (1 - d) q_k) / q_k )

of its strength class k: `d_k` is how often a visible model edge shows in that class, `d` its sum, and `q_k` how often
the cells *around* have the class at that orientation.  So a lone contour weighs much, a stroke among the thousands of
parallel strokes of brushed metal next to nothing, and a predicted edge where there is none counts against the pose:
log(1 - d).  The a-contrario idea is Desolneux, Moisan and Morel's; here the background is local.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vision.localisation.scene import Floats

ORIENTATIONS = 16
# Strength classes as shares of the picture's range of grey, and how often a visible sharp edge of a machined part under
# workshop light shows at least that contrast: three quarters show at all, half clearly, a fifth strongly.
STRENGTHS = (0.03, 0.12, 0.3)
DETECTION = (0.75, 0.5, 0.2)
# The neighbourhood in which chance is counted, and the weight of the whole picture's share there, in cells.
SURROUNDINGS_PX = 96.0
BACKGROUND_CELLS = 40.0


@dataclass(frozen=True)
class EdgePoints:
    """Edge elements of one picture in the pixels of its camera without distortion.

    position (n, 2), normal (n, 2) toward bright, contrast (n,) grey, sigma (n,) px along the normal.
    `low`, `high` (2,): the box of those pixels that the picture covers.  `grey_range`: of the picture.
    """

    position: Floats
    normal: Floats
    contrast: Floats
    sigma: Floats
    low: Floats
    high: Floats
    grey_range: float


@dataclass(frozen=True)
class Evidence:
    """One picture's log likelihood ratios on cells of `cell` px: (ORIENTATIONS, rows, columns), float32.

    The cell [r, c] is centred at pixel `origin + cell * (c, r)`.  A rim of `pad` cells without evidence surrounds the
    picture, so that kernels can look beyond it.
    """

    field: NDArray[np.float32]
    cell: float
    origin: Floats
    pad: int


def evidence(edges: EdgePoints, cell: float, reach: float, pad: int) -> Evidence:
    """The evidence of a picture for predictions that may be `reach` px off."""
    import cv2

    columns, rows = (np.ceil((edges.high - edges.low) / cell).astype(int) + 1).tolist()
    index = np.rint((edges.position - edges.low) / cell).astype(np.int64)
    inside = ((index >= 0) & (index < [columns, rows])).all(axis=1)
    contrast = np.abs(edges.contrast) / edges.grey_range
    strength = np.searchsorted(STRENGTHS, contrast, side="right")
    tangent = np.arctan2(edges.normal[:, 0], -edges.normal[:, 1])
    orientation = np.rint(tangent * (ORIENTATIONS / np.pi)).astype(np.int64) % ORIENTATIONS
    use = inside & (strength > 0)
    strongest = np.zeros((ORIENTATIONS, rows, columns), np.uint8)
    np.maximum.at(
        strongest, (orientation[use], index[use, 1], index[use, 0]), strength[use].astype(np.uint8)
    )
    # An element speaks for the orientations beside its own too: noise and the pose's error turn edges.
    strongest = np.maximum(strongest, np.maximum(np.roll(strongest, 1, axis=0), np.roll(strongest, -1, axis=0)))
    size = 2 * max(round(reach / cell), 0) + 1
    window = 2 * max(round(SURROUNDINGS_PX / cell), 1) + 1
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))
    detect = np.append(np.array(DETECTION), 0.0)
    out = np.zeros((ORIENTATIONS, rows + 2 * pad, columns + 2 * pad), np.float32)
    area = cv2.boxFilter(np.ones((rows, columns), np.float32), -1, (window, window), normalize=False, borderType=0)
    for b in range(ORIENTATIONS):
        near = cv2.dilate(strongest[b], disc) if size > 1 else strongest[b]
        value = np.full(near.shape, np.float32(np.log(1 - DETECTION[0])))
        for k in range(len(STRENGTHS)):
            of_class = (near == k + 1).astype(np.float32)
            around = cv2.boxFilter(of_class, -1, (window, window), normalize=False, borderType=0)
            q = (around + BACKGROUND_CELLS * of_class.mean() + 0.5) / (area + BACKGROUND_CELLS + 1)
            ratio = np.log((detect[k] - detect[k + 1] + (1 - DETECTION[0]) * q) / q)
            value = np.where(near == k + 1, ratio, value)
        out[b, pad : pad + rows, pad : pad + columns] = value
    return Evidence(out, cell, edges.low - cell * pad, pad)
