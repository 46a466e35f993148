"""How much larger a picture shows what a prior predicts: whether it was cut out of a larger one."""

from __future__ import annotations

import numpy as np

from relmodel.arrays import Floats
from vision.cameras.cameras import Prior
from vision.localisation.hypotheses import (
    EdgePoints,
    Prediction,
    collect_edge_points,
    predict,
    project_directions,
    project_with_jacobians,
)
from vision.localisation.views import Observation
from vision.scene import Scene

CELL_PX = 4.0  # pixels across a cell of the grids on which predicted and found edges are laid
BLUR_CELLS = 0.8  # sigma that bridges one scale and the next
DIRECTIONS = 4  # grids, one for each range of directions of edges
SCALES = np.exp(np.arange(-0.03, np.log(1.5), 0.015))  # that are tried: a cut enlarges
MARGIN_PX = 200.0  # beyond the picture that is predicted too: of a picture cut out of a larger one more may show
SAMPLES = 2000
LEAST_LOG_SCALE = 0.03  # less is no sign of another scale: the solved calibration follows it
LEAST_GAIN = 1.3  # times what is found at about the stated scale: other objects give 1.12 at most, cuts 1.39 or more
SIGMAS = 4.0  # of the scale that the prior leaves open


def doubt_scale(scene: Scene, seen: Observation, prior: Prior) -> str | None:
    """A sentence on the camera whose picture is so much larger than predicted that its calibration is not its own."""
    for name, camera in seen.rig.cameras.items():
        prediction = predict(scene, seen.rig.only(name), prior.world_from_rig, SAMPLES, MARGIN_PX)
        if not len(prediction.point):
            continue
        scale, gain = measure_magnification(prediction, collect_edge_points(seen.pictures[name], camera))
        open_scale = prior.sigma_translation_mm / float(np.median(np.linalg.norm(prediction.point, axis=1)))
        if np.log(scale) > max(LEAST_LOG_SCALE, SIGMAS * open_scale) and gain > LEAST_GAIN:
            return (
                f"the picture of camera {name} shows the model {scale:.2f} times as large as the rig's file and "
                "the prior have it: is it scaled or cropped?"
            )
    return None


def measure_magnification(prediction: Prediction, points: EdgePoints) -> tuple[float, float]:
    """The scale at which one camera's predicted edges lie on its picture's best, and how many times as much of them
    does as at about the stated scale: grids of edges, one a range of directions, are correlated at each scale and all
    shifts (by Fourier's transform)."""
    from scipy.ndimage import gaussian_filter

    pixel, _ = project_with_jacobians(prediction)
    along = project_directions(prediction)
    size = np.ceil((points.high - points.low) / CELL_PX).astype(int) + 1
    shape = tuple((2 * size[::-1]).tolist())
    normal = points.normal
    seen = np.minimum(_lay(points.position - points.low, -normal[:, ::-1] * [1, -1], np.ones(len(normal)), shape), 1.0)
    seen = gaussian_filter(seen, (0, BLUR_CELLS, BLUR_CELLS))
    seen[:, : size[1], : size[0]] -= seen[:, : size[1], : size[0]].mean(axis=(1, 2), keepdims=True)
    transformed = np.fft.rfft2(seen)
    middle = (points.high - points.low) / 2
    scores = []
    for scale in SCALES:
        # Twice as large as the picture, around its middle, so that nothing comes round.
        laid = _lay((pixel - points.low - middle) * scale + 2 * middle, along, prediction.weight, shape)
        shifted = np.fft.irfft2((transformed * np.conj(np.fft.rfft2(laid))).sum(axis=0), shape)
        scores.append(float(shifted.max()) / max(float(np.sqrt((laid**2).sum())), 1e-9))
    best = int(np.argmax(scores))
    stated = max(score for score, scale in zip(scores, SCALES, strict=True) if abs(np.log(scale)) <= LEAST_LOG_SCALE)
    return float(SCALES[best]), scores[best] / max(stated, 1e-9)


def _lay(pixels: Floats, direction: Floats, weight: Floats, shape: tuple[int, ...]) -> Floats:
    """Weights on grids (directions, rows, columns) by where they are and which way they go; those beside left out."""
    turn = np.arctan2(direction[:, 1], direction[:, 0]) / np.pi * DIRECTIONS
    layer = np.rint(turn).astype(int) % DIRECTIONS
    column, row = np.floor(pixels / CELL_PX).astype(int).T
    on = (row >= 0) & (column >= 0) & (row < shape[0]) & (column < shape[1])
    flat = (layer * shape[0] + row) * shape[1] + column
    laid = np.bincount(flat[on], weight[on], DIRECTIONS * shape[0] * shape[1])
    return np.asarray(laid.reshape(DIRECTIONS, *shape), float)
