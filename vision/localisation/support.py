"""What a pose gathers of the pictures' edges and outlines, against chance and against what the right pose would."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from relmodel.arrays import Bools, Bytes, Floats, Floats32, Ints
from vision.cameras.cameras import Rig
from vision.localisation.hypotheses import (
    CORRELATION_PX,
    Evidence,
    Prediction,
    look_up_evidence,
    project_directions,
    project_with_jacobians,
)
from vision.localisation.measurements import OFFSET_PX, EdgeIndex, Measurements, shift_pixels
from vision.localisation.visibility import lay_rays
from vision.scene import Scene

# The evidence of a pose is the log of how much likelier the pictures' edges are with the model there than without it.
# An arc of the model whose edges are looked for at n places gathers at each the log odds of what is found there
# (`evidence`), and, where an edge is found, of how far off it lies. But light and finish hide whole arcs, so an arc
# either shows, with probability pi, or leaves only what chance puts there:
#
#     E = log of the mean over pi of  product over arcs of  (pi exp(sum over its places) + 1 - pi)
#
# A right pose has arcs that show from end to end and others that do not show at all; a wrong one finds a little of
# everything. How many arcs show in this light is not known, so pi is averaged over, camera by camera.
# A placed part that is not where the model says is looked for near its place: its image may be shifted, turned and
# scaled, camera by camera, at the cost of the log of how many such images the picture tells apart (MacKay, 1992).


# Reach along the normal and scale of the robust loss (Geman and McClure), px, of each round of a refinement.
ROUNDS = ((9.0, 4.0), (6.0, 2.0), (4.0, 1.0), (3.0, 0.7))
STRAY_SHARE = 0.3  # of the edges found beside an arc that shows that are not its own
SHOWN_SHARES = (0.2, 0.35, 0.5, 0.65, 0.8, 0.95)  # of the arcs that show, as likely one as another beforehand
DISPLACED_PX = 12.0  # by which the image of a part may be shifted that is not where the model says
DISPLACED_TURN = 0.02  # rad, and share: standard deviation by which such an image is turned and scaled


@dataclass(frozen=True)
class Support:
    """What a pose gathers, by camera (c,).

    evidence: log odds that the model is there; found, expected: sum of the places' log odds without regard to
    arcs, and its expectation at the right pose; length_px: length of the predicted arcs in view."""

    by_camera: Floats
    found: Floats
    expected: Floats
    length_px: Floats

    @property
    def evidence(self) -> float:
        """Log odds by all cameras together."""
        return float(self.by_camera.sum())


def measure_support(
    prediction: Prediction, m: Measurements, own: Floats, fields: list[Evidence], indexes: list[EdgeIndex], moved: Ints
) -> Support:
    """What a prediction gathers at its own pose, where `m` was measured with the cameras' `own` unknowns (c, 11).

    moved (n,): the occurrence of each sample that may lie elsewhere, -1 for those that are where the model says."""
    pixel, _ = project_with_jacobians(prediction)
    direction = project_directions(prediction)
    w = prediction.weight
    # Each arc is looked for where the cameras' unknowns put it, and where it lies within its tolerance.
    pixel = pixel + shift_pixels(prediction, np.zeros(6), pixel, own)
    pixel += np.stack([-direction[:, 1], direction[:, 0]], axis=1) * m.shift[:, None]
    found = look_up_evidence(prediction, fields, pixel, direction)
    mean = np.zeros(len(w))
    for number, e in enumerate(fields):
        rows = prediction.view == number
        mean[rows] = e.expectation(pixel[rows], direction[rows])

    def total(values: Floats) -> Floats:
        return np.bincount(prediction.view, values, minlength=len(fields)).astype(float)

    odds = score_offsets(m.offset - m.shift, m.edge_sigma, m.found)
    odds -= _share_cost_of_shifts(prediction, m.shift)
    by_camera = sum_over_arcs(prediction, w * (found + odds), len(fields))
    for occurrence in np.unique(moved[moved >= 0]):
        for number, index in enumerate(indexes):
            rows = np.flatnonzero((moved == occurrence) & (prediction.view == number))
            if len(rows):
                there = prediction.take(rows)
                here = sum_over_arcs(there, w[rows] * (found + odds)[rows], len(fields)).sum()
                displaced = _score_displaced(there, pixel[rows], direction[rows], fields, index)
                by_camera[number] += max(displaced - float(here), 0.0)
    return Support(by_camera, total(w * found), total(w * mean), total(w) * CORRELATION_PX)


def _share_cost_of_shifts(prediction: Prediction, shift: Floats) -> Floats:
    """Of each sample (n,) its share of what its arc's shift (px) costs under the arc's tolerance."""
    if not shift.any():
        return shift
    cost = 0.5 * (shift / np.maximum(prediction.tolerance_px, 1e-9)) ** 2
    group = prediction.image_of_arc
    return np.asarray(cost / np.maximum(np.bincount(group, prediction.weight)[group], 1e-9))


def _score_displaced(
    prediction: Prediction, pixel: Floats, direction: Floats, fields: list[Evidence], index: EdgeIndex
) -> float:
    """The log odds of samples of one camera whose image may be shifted by up to `DISPLACED_PX`, and then turned and
    scaled a little, less what it costs to have sought it."""
    steps = np.arange(-DISPLACED_PX, DISPLACED_PX + 1e-9, 2.0)
    shifts = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    gathered = [prediction.weight @ look_up_evidence(prediction, fields, pixel + s, direction) for s in shifts]
    pixel = pixel + shifts[int(np.argmax(gathered))]
    # A displaced part is also turned, nearer or farther: a similarity of its image, about its middle.
    usual = np.array([DISPLACED_PX, DISPLACED_PX, DISPLACED_TURN, DISPLACED_TURN])
    for reach, scale in np.repeat(ROUNDS, 2, axis=0).tolist():
        offset, found = index.measure(np.ascontiguousarray(pixel), direction, reach, scale)
        near = np.where(found >= 0, prediction.weight / (1 + (offset / scale) ** 2) ** 2, 0.0)
        arm = pixel - np.average(pixel, axis=0, weights=prediction.weight)
        moves = np.stack([*np.broadcast_to(np.eye(2)[:, None], (2, *arm.shape)), arm, arm @ [[0, 1], [-1, 0]]])
        across = np.einsum("kni,in->nk", moves, np.stack([-direction[:, 1], direction[:, 0]]))
        normal = (across * near[:, None]).T @ across + np.diag(usual**-2.0)
        step = np.linalg.solve(normal, across.T @ (near * offset))
        pixel = pixel + np.einsum("k,kni->ni", step, moves)
    offset, found = index.measure(np.ascontiguousarray(pixel), direction, reach, scale)
    places = look_up_evidence(prediction, fields, pixel, direction)
    places += score_offsets(offset, np.zeros(len(offset)), found)
    told_apart = np.eye(4) + usual[:, None] * (across * near[:, None]).T @ across / OFFSET_PX**2 * usual
    odds = sum_over_arcs(prediction, prediction.weight * places, len(fields)).sum()
    return float(odds - 0.5 * np.linalg.slogdet(told_apart)[1])


def score_offsets(offset: Floats, sigma: Floats, found: Ints) -> Floats:
    """Log odds (n,) of how far off (px) edges of that sigma were found, against anywhere in reach; 0: none (-1)."""
    own, stray = np.hypot(OFFSET_PX, sigma), STRAY_SHARE
    near = np.exp(-0.5 * (offset / own) ** 2) / (own * np.sqrt(2 * np.pi))
    odds = np.log(stray + (1 - stray) * near * 2 * ROUNDS[-1][0])
    return np.asarray(np.where(found >= 0, odds, 0.0))


def sum_over_arcs(prediction: Prediction, places: Floats, cameras: int) -> Floats:
    """The log odds (c,) by camera of the sums of the places (n,) over arcs that may not show."""
    group = prediction.image_of_arc
    count = int(group.max(initial=-1)) + 1
    arc = np.bincount(group, places, minlength=count).astype(float)
    return mix_over_arcs(arc, prediction.view_of_image, cameras)


def mix_over_arcs(arc: Floats, view: Ints, cameras: int) -> Floats:
    """The log odds (..., c) by camera that arcs with sums (..., a), each in the picture of the camera view (a,), give
    where any may not show."""
    shown = np.array(SHOWN_SHARES).reshape(-1, *np.ones(arc.ndim, int))
    one = np.logaddexp(np.log(shown) + arc, np.log1p(-shown))
    by_camera = one @ (view[:, None] == np.arange(cameras)).astype(float)
    return np.asarray(np.logaddexp.reduce(by_camera, axis=0) - np.log(len(shown)))


# Whether a picture changes where a pose has the outline of the model against what lies behind it.
# A printed edge parts an object from itself; its outline parts it from the background. So pixels just inside the
# outline should be likelier of what lies deeper inside than of what lies farther outside, and those just outside the
# reverse. What lies about a place on either side is a Gaussian of grey within a window (Lankton and Tannenbaum,
# "Localizing region-based active contours", 2008). An outline laid along a stripe has background beyond the rest of the
# object, one beside the object has background on both sides: both find neither.


# Chosen on printed boxes and small objects rendered, of which right poses reach 1.2 to 3, and poses 4 mm and a degree
# off seldom 1.
STEP_PX = 3  # side of the squares that are looked at
NEAR_PX = 3.0  # from the outline: nearer pixels mix both sides
FAR_PX = 6.0  # from the outline: pixels up to there are classified inside or outside, by those beyond
WINDOW_PX = 24.0  # half side of the window whose pixels are inside or outside for sure
MIN_CELLS = 8.0  # squares of each that must be there
NOISE_GREY = 4.0  # least standard deviation of either: noise, and what the model leaves out of it
MOST_ODDS = 3.0  # log likelihood ratio at most that a pixel counts
OBSERVED_PX = 120.0  # of outline are one observation: a side that has the grey of what lies behind errs as a whole


@dataclass(frozen=True)
class Outlines:
    """The model's outlines against the background, by camera (c,).

    length_px; contrast: mean log likelihood ratio of the pixels beside them, zero where there is none; evidence: log
    odds that they are outlines, of all cameras together."""

    length_px: Floats
    contrast: Floats
    evidence: float

    @property
    def total_px(self) -> float:
        return float(self.length_px.sum())

    @property
    def mean(self) -> float:
        """The contrast of all outlines together."""
        return float(self.length_px @ self.contrast / max(self.total_px, 1e-9))


@dataclass(frozen=True)
class GreyGrid:
    """The greys of a picture on a grid of rays: directions (rows, columns, 3) in the camera's frame; grey, seen (rows,
    columns): which of them the picture shows."""

    directions: Floats
    grey: Floats32
    seen: Bools


def lay_grey_grids(rig: Rig, greys: Mapping[str, Bytes | Floats]) -> list[GreyGrid]:
    """The grids of the rig's cameras, in its order, from their pictures (rows, columns)."""
    import cv2

    grids = []
    for name, camera in rig.cameras.items():
        rays = lay_rays(camera, STEP_PX)
        pixel, _ = camera.project(rays.directions.reshape(-1, 3))
        at = pixel.reshape(*rays.weight.shape, 2).astype(np.float32)
        smooth = cv2.blur(np.asarray(greys[name], np.float32), (STEP_PX, STEP_PX))
        grey = cv2.remap(smooth, at[..., 0], at[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        grids.append(GreyGrid(rays.directions, np.asarray(grey), rays.weight > 0))
    return grids


def measure_outlines(scene: Scene, rig: Rig, grids: list[GreyGrid], world_from_rig: Floats) -> Outlines:
    """The outlines at a pose, in the pictures of the rig's cameras."""
    found = [
        _compare(_find_model(scene, grid, world_from_rig @ rig.rig_from_camera[name]), grid.seen, grid)
        for name, grid in zip(rig.cameras, grids, strict=True)
    ]
    length, contrast = (np.array(column) for column in zip(*found, strict=True))
    return Outlines(length, contrast, float(length @ contrast / OBSERVED_PX))


def measure_shifted_outlines(
    scene: Scene, rig: Rig, grids: Sequence[GreyGrid], world_from_rig: Floats, shifts: Floats
) -> Floats:
    """The log odds (n,) that the outlines seen from a pose are outlines where they are laid elsewhere in the pictures,
    shifted by so many px (n, c, 2) in each camera's."""
    import cv2

    total = np.zeros(len(shifts))
    for camera, (name, grid) in enumerate(zip(rig.cameras, grids, strict=True)):
        model = _find_model(scene, grid, world_from_rig @ rig.rig_from_camera[name])
        rows, columns = model.shape
        for number, (x, y) in enumerate(np.rint(shifts[:, camera] / STEP_PX)):
            there, known = (
                cv2.warpAffine(
                    mask.astype(np.uint8), np.array([[1, 0, x], [0, 1, y]]), (columns, rows), flags=cv2.INTER_NEAREST
                )
                for mask in (model, grid.seen)
            )
            # What lies beyond the picture is not known: its border is no outline.
            clear = cv2.distanceTransform(known, cv2.DIST_L2, 5) > FAR_PX / STEP_PX + 1
            length, contrast = _compare(there > 0, grid.seen & clear, grid)
            total[number] += length * contrast / OBSERVED_PX
    return total


def _find_model(scene: Scene, grid: GreyGrid, world_from_camera: Floats) -> Bools:
    """Which rays of a grid meet the model."""
    model = np.zeros(grid.seen.shape, bool)
    directions = grid.directions[grid.seen] @ world_from_camera[:3, :3].T
    model[grid.seen] = scene.rays.meet(world_from_camera[:3, 3], directions)
    return model


def _compare(model: Bools, known: Bools, grid: GreyGrid) -> tuple[float, float]:
    """Length (px) and contrast of the outlines of the model in one picture, where they are known."""
    away = _distance_from_outline(model, STEP_PX)
    near = known & (np.abs(away) > NEAR_PX) & (np.abs(away) <= FAR_PX)
    if not near.any():
        return 0.0, 0.0
    inside, counted = _log_likelihood(grid.grey, known & (away > FAR_PX))
    outside, also = _log_likelihood(grid.grey, known & (away < -FAR_PX))
    near &= (counted >= MIN_CELLS) & (also >= MIN_CELLS)
    if not near.any():
        return 0.0, 0.0
    odds = np.clip(inside - outside, -MOST_ODDS, MOST_ODDS) * np.sign(away)
    length = float(near.sum()) * STEP_PX**2 / (2 * (FAR_PX - NEAR_PX))
    return length, float(odds[near].mean(dtype=float))


def _distance_from_outline(model: Bools, step: int) -> Floats32:
    """How far (px) cells lie from the model's outline, negative outside it."""
    import cv2

    mask = model.astype(np.uint8)
    if mask.all() or not mask.any():
        return np.full(mask.shape, np.inf if mask.all() else -np.inf, np.float32)
    inside, outside = (cv2.distanceTransform(m, cv2.DIST_L2, 5) for m in (mask, 1 - mask))
    return np.asarray(step * np.where(model, inside - 0.5, 0.5 - outside), np.float32)


def _log_likelihood(grey: Floats32, some: Bools) -> tuple[Floats32, Floats32]:
    """Log likelihood of each cell by the Gaussian of some cells within the window about it, and how many those are."""
    import cv2

    side = 2 * round(WINDOW_PX / STEP_PX) + 1

    def gather(values: Floats32) -> Floats32:
        return np.asarray(
            cv2.boxFilter(values, cv2.CV_32F, (side, side), normalize=False, borderType=cv2.BORDER_CONSTANT)
        )

    weight = some.astype(np.float32)
    level = grey - 128.0  # sums of squares of small numbers lose less
    count = gather(weight)
    mean = gather(weight * level) / np.maximum(count, 1)
    variance = np.maximum(gather(weight * level**2) / np.maximum(count, 1) - mean**2, 0) + NOISE_GREY**2
    return np.asarray(-0.5 * ((level - mean) ** 2 / variance + np.log(variance))), count
