"""Candidate poses of the rig: a scan of the prior's volume on coarse edge evidence, then a climb on finer evidence."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from relmodel.arrays import Bools, Bytes, Floats, Floats32, Ints
from relmodel.geometry.transforms import rotation_matrix, skew
from vision.cameras.cameras import Camera, Prior, Rig, perturb, perturbations
from vision.extraction.rows import Primitives
from vision.localisation.visibility import SAMPLE_SPACING_PX, VisibleArcs, are_in_picture, find_visible_arcs
from vision.scene import Scene

# For each of a few orientations (modulo pi) the picture is a grid of cells with the strongest edge element within
# reach. A cell's evidence is the log likelihood ratio
#     log( (d_k + (1 - d) q_k) / q_k )
# of its strength class k: `d_k` is how often a visible model edge shows in that class, `d` its sum, and `q_k` how often
# the cells *around* have the class at that orientation. So a lone contour weighs much, a stroke among the thousands of
# parallel strokes of brushed metal next to nothing, and a predicted edge where there is none counts against the pose:
# log(1 - d). The a-contrario idea is Desolneux, Moisan and Morel's; here the background is local.

ORIENTATIONS = 16  # classes of orientation modulo pi
STRENGTHS = (0.03, 0.12, 0.3)  # classes of contrast, as shares of the picture's range of grey
DETECTION = (0.75, 0.5, 0.2)  # shares of the visible sharp edges of machined parts that show at least that contrast
SURROUNDINGS_PX = 96.0  # half side of the window in which chance is counted
BACKGROUND_CELLS = 40.0  # weight of the whole picture's share in it
BLOCK_PX = 16.0  # side of the blocks in which it is counted
BORDER_PX = 6.0  # along the picture's border in which no edge can be found
MIN_GREY_RANGE = 16.0  # least range that contrasts are related to
BLOOM_PX = 0.3  # by which light beyond white draws an arc's edges aside, one standard deviation
BRIGHTEST, GLARE_PX = 250.0, 9  # grey from which nothing is brighter; side of a square of it that shows no edge


@dataclass(frozen=True)
class EdgePoints:
    """Edge elements of one picture in the pixels of its camera without distortion.

    position (n, 2), normal (n, 2) toward bright, contrast (n,) grey, sigma (n,) px along the normal.
    `low`, `high` (2,): the box of those pixels that the picture covers.  `grey_range`: of the picture.  `glare` (rows,
    columns): which pixels of the box show no edge, all about them being as bright as can be; None where none is."""

    position: Floats
    normal: Floats
    contrast: Floats
    sigma: Floats
    low: Floats
    high: Floats
    grey_range: float
    glare: Bools | None = None

    def can_show(self, pixel: Floats) -> Bools:
        """Which pixels (n, 2) can show an edge: those in the picture that no glare hides."""
        inside = lie_within(self.low, self.high, pixel)
        if self.glare is None:
            return inside
        x, y = np.clip(np.rint(pixel - self.low), 0, np.array(self.glare.shape[::-1]) - 1).astype(np.int64).T
        return np.asarray(inside & ~self.glare[y, x])


def lie_within(low: Floats, high: Floats, pixel: Floats) -> Bools:
    """Which pixels (n, 2) lie at least one inside a box."""
    return np.asarray(((pixel > low + 1) & (pixel < high - 1)).all(axis=1))


def collect_edge_points(picture: Primitives, camera: Camera, grey: Bytes | Floats | None = None) -> EdgePoints:
    """The edge elements of a picture without distortion; its grey (rows, columns) says where light hides them."""
    elements = picture.elements
    position = np.stack([elements.x, elements.y], axis=1)
    normal = np.stack([elements.nx, elements.ny], axis=1)
    sigma = np.hypot(elements.sigma, BLOOM_PX * np.append(picture.arcs.highlight, 0.0)[elements.arc])  # -1: of none
    if not camera.is_pinhole:
        # Normals turn as gradients do; the scale across is one over how the gradient grows.
        position, jacobian = camera.undistort_with_jacobians(position)
        normal = np.einsum("nij,ni->nj", jacobian, normal)
        growth = np.linalg.norm(normal, axis=1)
        normal, sigma = normal / growth[:, None], sigma / growth
    contrast, grey_range = np.asarray(elements.contrast), max(picture.grey_range, MIN_GREY_RANGE)
    low, high = bound_elements(camera)
    glare = None if grey is None else _find_glare(grey, camera, low, high)
    return EdgePoints(position, normal, contrast, sigma, low, high, grey_range, glare)


def _find_glare(grey: Bytes | Floats, camera: Camera, low: Floats, high: Floats) -> Bools | None:
    import cv2

    lit = cv2.erode(np.asarray(grey, np.float32), np.ones((GLARE_PX, GLARE_PX), np.uint8)) >= BRIGHTEST
    if not lit.any():
        return None
    columns, rows = (np.ceil(high - low) + 1).astype(int).tolist()
    x, y = np.rint(camera.undistort(np.argwhere(lit)[:, ::-1].astype(float)) - low).astype(np.int64).T
    inside = (x >= 0) & (y >= 0) & (x < columns) & (y < rows)
    out = np.zeros((rows, columns), np.uint8)
    out[y[inside], x[inside]] = 1
    # Where the lens spreads pixels some between them are hit by none.
    return np.asarray(cv2.morphologyEx(out, cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8)) > 0)


def bound_elements(camera: Camera) -> tuple[Floats, Floats]:
    """The box (2,), (2,) of pixels of the camera without distortion in which its picture can have edge elements."""
    low, high = np.array([BORDER_PX, BORDER_PX]), np.array([camera.width, camera.height]) - 1.0 - BORDER_PX
    if camera.is_pinhole:
        return low, high
    x, y = (np.linspace(low[i], high[i], 65) for i in (0, 1))
    border = [np.stack(np.meshgrid(x, border_y), axis=-1).reshape(-1, 2) for border_y in (low[1], high[1])]
    border += [np.stack(np.meshgrid(border_x, y), axis=-1).reshape(-1, 2) for border_x in (low[0], high[0])]
    ideal = camera.undistort(np.concatenate(border))
    return ideal.min(axis=0), ideal.max(axis=0)


@dataclass(frozen=True)
class Evidence:
    """One picture's log likelihood ratios on cells of `cell` px: field (orientations, rows, columns), float32.

    The cell [r, c] is centred at pixel `origin + cell * (c, r)`.  A border of `pad` cells without evidence surrounds
    the picture, so that kernels can look beyond it.  chance (classes, orientations, blocks, blocks): how often cells
    have each strength there, on blocks of `block` cells without the border."""

    field: Floats32
    cell: float
    origin: Floats
    pad: int
    chance: Floats32
    block: int

    def beyond_chance(self) -> Evidence:
        """The evidence less what is found in the mean anywhere: a pose that shows less of the model, for which no place
        speaks against it, then gains nothing by that."""
        seen = self.field != 0
        mean = self.field.mean(where=seen) if seen.any() else 0.0
        return replace(self, field=np.where(seen, self.field - np.float32(mean), np.float32(0)))

    def expectation(self, pixel: Floats, direction: Floats) -> Floats:
        """Mean (n,) of the evidence that a right prediction gathers at these pixels (n, 2)."""
        index = np.floor(((pixel - self.origin) / self.cell - self.pad + 0.5) / self.block).astype(np.int64)
        index = np.clip(index, 0, np.array(self.chance.shape[:1:-1]) - 1)
        b = bin_orientations(direction)
        q = self.chance[:, b, index[:, 1], index[:, 0]].astype(float)
        likely = np.diff(np.append(DETECTION, 0.0)) * -1
        share = likely[:, None] + (1 - DETECTION[0]) * q
        ratio = np.log(share / q)
        nothing = (1 - DETECTION[0]) * np.clip(1 - q.sum(axis=0), 0, 1)
        miss = np.log(1 - DETECTION[0])
        return np.asarray((share * ratio).sum(axis=0) + nothing * miss)


class Fields(list[Evidence]):
    """The evidence of the pictures of a rig's cameras, in its order; `joined`: their fields as kernels take them."""

    def __init__(self, of_cameras: Iterable[Evidence]) -> None:
        each = list(of_cameras)
        self.joined = np.concatenate([e.field.ravel() for e in each])
        fields = np.split(self.joined, np.cumsum([e.field.size for e in each])[:-1])
        super().__init__(replace(e, field=own.reshape(e.field.shape)) for e, own in zip(each, fields, strict=True))


def bin_orientations(direction: Floats) -> Ints:
    """The class of orientation (n,) of image directions (n, 2)."""
    angle = np.arctan2(direction[:, 1], direction[:, 0])
    return np.rint(angle * (ORIENTATIONS / np.pi)).astype(np.int64) % ORIENTATIONS


def build_evidence(edges: EdgePoints, cell: float, reach: float, pad: int) -> Evidence:
    """The evidence of a picture for predictions that may be `reach` px off."""
    import cv2

    block = max(round(BLOCK_PX / cell), 1)
    # Whole blocks: the last ones may reach beyond the picture, where there is nothing to see.
    columns, rows = (np.ceil((np.ceil((edges.high - edges.low) / cell) + 1) / block) * block).astype(int).tolist()
    index = np.rint((edges.position - edges.low) / cell).astype(np.int64)
    inside = ((index >= 0) & (index < [columns, rows])).all(axis=1)
    strength = np.searchsorted(STRENGTHS, np.abs(edges.contrast) / edges.grey_range, side="right").astype(np.uint8)
    orientation = bin_orientations(np.stack([-edges.normal[:, 1], edges.normal[:, 0]], axis=1))
    use = inside & (strength > 0)
    strongest = np.zeros((ORIENTATIONS, rows, columns), np.uint8)
    np.maximum.at(strongest, (orientation[use], index[use, 1], index[use, 0]), strength[use])
    # An element speaks for the orientations beside its own too: noise and the pose's error turn edges.
    strongest = np.maximum(strongest, np.maximum(np.roll(strongest, 1, axis=0), np.roll(strongest, -1, axis=0)))
    size = 2 * max(round(reach / cell), 0) + 1
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))
    near = np.stack([cv2.dilate(layer, disc) for layer in strongest])
    width, height = (edges.high - edges.low) / cell
    covered = (np.arange(rows) <= height + 0.5)[:, None] & (np.arange(columns) <= width + 0.5)
    if edges.glare is not None:  # what light hides speaks neither for a pose nor against it
        sides = zip(covered.shape, edges.glare.shape, strict=True)
        at = [np.minimum(np.rint(np.arange(cells) * cell).astype(int), last - 1) for cells, last in sides]
        covered &= ~edges.glare[np.ix_(*at)]
    cells = float(covered.sum())

    blocks = (rows // block, columns // block)
    window = 2 * max(round(SURROUNDINGS_PX / BLOCK_PX), 1) + 1
    share = covered.reshape(blocks[0], block, blocks[1], block).mean(axis=(1, 3), dtype=np.float32)
    seen = _gather(np.asarray(share), window)
    chance = np.empty((len(STRENGTHS), ORIENTATIONS, *blocks), np.float32)
    # The evidence of a cell depends on the class of its strength, its orientation and its block alone.
    evidence = np.full((ORIENTATIONS, *blocks, 1 + len(STRENGTHS)), np.log(1 - DETECTION[0]), np.float32)
    likely = np.diff(np.append(DETECTION, 0.0)) * -1
    weight = BACKGROUND_CELLS / (block * block)
    row, column = np.arange(rows) // block, np.arange(columns) // block
    number = (row[:, None] * blocks[1] + column) * (1 + len(STRENGTHS))
    out = np.zeros((ORIENTATIONS, rows + 2 * pad, columns + 2 * pad), np.float32)
    for b in range(ORIENTATIONS):
        class_of_block = number + near[b]
        counts = np.bincount(class_of_block.ravel(), minlength=evidence[b].size).reshape(evidence[b].shape)
        for k in range(len(STRENGTHS)):
            around = _gather(counts[..., k + 1].astype(np.float32) / np.float32(block**2), window)
            common = float(counts[..., k + 1].sum()) / max(cells, 1.0)
            chance[k, b] = (around + weight * common + 0.5 / block**2) / (seen + weight + 1 / block**2)
            q = chance[k, b]
            evidence[b, ..., k + 1] = np.log((likely[k] + (1 - DETECTION[0]) * q) / q)
        out[b, pad : pad + rows, pad : pad + columns] = evidence[b].ravel()[class_of_block]
    out[:, pad : pad + rows, pad : pad + columns] *= covered
    return Evidence(out, cell, edges.low - cell * pad, pad, chance, block)


def _gather(share: Floats32, window: int) -> Floats32:
    """Sums of the shares of blocks in a window about each."""
    import cv2

    return np.asarray(cv2.boxFilter(share, -1, (window, window), normalize=False, borderType=cv2.BORDER_CONSTANT))


# The prior is sampled by a scrambled Sobol sequence of fixed seed; at each sample a whole window of image shifts (small
# turns of the rig) is scored at once, so that the sequence has to cover only what turns cannot do.

CORRELATION_PX = 40.0  # along an arc that count as one observation: closer samples see the same picture
SELECT_SIGMA = 6.0  # sigmas of image shift beyond the pictures within which arcs are kept
SCAN_SIGMA = 2.5  # sigmas of image shift beyond the pictures within which they are predicted for the scan
SCAN_SAMPLES = 800  # samples that face a camera
SCAN_CELL_PX, SCAN_REACH_PX = 4.0, 6.0  # cells of the coarse evidence, and how far off a prediction may be there
SCAN_WINDOW, SCAN_STEP = 10, 2  # cells: greatest common shift of a picture either way, and from one to the next
SCAN_POSES, MAX_SCAN_POSES = 1024, 16384  # for a prior that leaves SCAN_SPREAD_PX, as its square for others; at most
SCAN_SPREAD_PX = 15.0  # rms beside common shifts
SCAN_DISTINCT_PX, SCAN_KEPT = 6.0, 100  # rms over the samples by which poses differ that climb, and how many do
CLIMB_CELL_PX, CLIMB_REACH_PX = 2.0, 3.0  # the same of the fine evidence
CLIMB_FIRST_PX, CLIMB_LAST_PX = 4.0, 1.0  # first and last step of the climb
CLIMB_DISTINCT_PX, CLIMB_KEPT = 3.0, 24  # rms by which the candidates differ, and how many there are at most
CLIMB_SAMPLES = 1200  # of a climb from a single pose
WITHIN_POSES, WITHIN_KEPT = 256, 8  # poses within a covariance, and how many of them climb


@dataclass(frozen=True)
class Prediction:
    """Samples of visible arcs for all cameras of a rig, in the rig's frame at the pose they were predicted for.

    point, tangent (n, 3); weight (n,); tolerance_px (n,): standard deviation of where the model has the arc; view,
    arc (n,); and of the cameras: rotation (c, 3, 3) and offset (c, 3) of camera_from_rig, matrix (c, 2, 3)."""

    point: Floats
    tangent: Floats
    weight: Floats
    tolerance_px: Floats
    view: Ints
    arc: Ints
    rotation: Floats
    offset: Floats
    matrix: Floats

    @cached_property
    def image_of_arc(self) -> Ints:
        """A number for the image of each arc in each camera (n,)."""
        unit = self.view * (int(self.arc.max(initial=0)) + 1) + self.arc
        return np.asarray(np.unique(unit, return_inverse=True)[1].ravel())

    @cached_property
    def view_of_image(self) -> Ints:
        """The camera (a,) of each image of an arc."""
        out = np.zeros(int(self.image_of_arc.max(initial=-1)) + 1, np.int64)
        out[self.image_of_arc] = self.view
        return out

    def take(self, rows: Ints) -> Prediction:
        """Some of the samples, of the same cameras."""
        of_samples = ("point", "tangent", "weight", "tolerance_px", "view", "arc")
        return replace(self, **{name: getattr(self, name)[rows] for name in of_samples})


def predict(scene: Scene, rig: Rig, world_from_rig: Floats, count: int, margin_px: float = 0.0) -> Prediction:
    """Visible samples of sharp arcs and outlines, evenly along the arcs' images, of `count` that face each camera;
    weight = length / CORRELATION_PX."""
    seen: list[VisibleArcs] = []
    for name, camera in rig.cameras.items():
        arcs = find_visible_arcs(scene, camera, world_from_rig @ rig.rig_from_camera[name], margin_px, count)
        seen.append(arcs.take(~arcs.smooth))
    rig_from_world = np.linalg.inv(world_from_rig)
    rotation, translation = rig_from_world[:3, :3], rig_from_world[:3, 3]
    camera_from_rig = [np.linalg.inv(rig.rig_from_camera[name]) for name in rig.cameras]
    return Prediction(
        point=np.concatenate([s.point for s in seen]) @ rotation.T + translation,
        tangent=np.concatenate([s.tangent for s in seen]) @ rotation.T,
        weight=np.concatenate([s.length_px for s in seen]) / CORRELATION_PX,
        tolerance_px=np.concatenate([s.scale * scene.tolerance_of_arc[s.arc] for s in seen]),
        view=np.repeat(np.arange(len(seen)), [len(s.arc) for s in seen]),
        arc=np.concatenate([s.arc for s in seen]),
        rotation=np.array([m[:3, :3] for m in camera_from_rig]),
        offset=np.array([m[:3, 3] for m in camera_from_rig]),
        matrix=np.array([c.matrix[:2] for c in rig.cameras.values()]),
    )


def project_with_jacobians(prediction: Prediction, delta: Floats | None = None) -> tuple[Floats, Floats]:
    """Pixels (n, 2) of the samples and their derivatives (n, 2, 6) by a right perturbation (t, r) of the rig's pose."""
    point = _perturbed(prediction, delta)
    in_camera, flow = flow_in_camera(prediction, delta)
    k = prediction.matrix[prediction.view]
    pixel = np.einsum("nij,nj->ni", k[:, :, :2], in_camera[:, :2] / in_camera[:, 2:]) + k[:, :, 2]
    by_point = flow @ prediction.rotation[prediction.view]
    return pixel, np.concatenate([-by_point, by_point @ skew(point)], axis=2)


def flow_in_camera(
    prediction: Prediction, delta: Floats | None = None, rows: Ints | slice = slice(None)
) -> tuple[Floats, Floats]:
    """The samples (n, 3) in their cameras' frames, and the derivatives (n, 2, 3) of their pixels by them."""
    view = prediction.view[rows]
    point = np.einsum("nij,nj->ni", prediction.rotation[view], _perturbed(prediction, delta)[rows])
    point += prediction.offset[view]
    z = point[:, 2]
    flow = np.zeros((len(point), 2, 3))
    flow[:, 0, 0] = flow[:, 1, 1] = 1 / z
    flow[:, :, 2] = -point[:, :2] / z[:, None] ** 2
    return point, prediction.matrix[view][:, :, :2] @ flow


def _perturbed(prediction: Prediction, delta: Floats | None) -> Floats:
    """The samples (n, 3) in the rig's frame after a right perturbation (6,) of its pose."""
    if delta is None:
        return prediction.point
    return np.asarray((prediction.point - delta[:3]) @ rotation_matrix(delta[3:]))


def project_directions(prediction: Prediction, delta: Floats | None = None) -> Floats:
    """Unit image directions (n, 2) of the samples' tangents under a perturbation (6,)."""
    turn = rotation_matrix(np.zeros(3) if delta is None else delta[3:])
    along = np.einsum("nij,nj->ni", prediction.rotation[prediction.view], prediction.tangent @ turn)
    flow = np.einsum("nij,nj->ni", flow_in_camera(prediction, delta)[1], along)
    return np.asarray(flow / np.maximum(np.linalg.norm(flow, axis=1), 1e-12)[:, None])


@dataclass(frozen=True)
class Stage:
    """What a stage of the search kept: poses as perturbations (k, 6) of the prior, best first, with their scores (k,),
    NaN where none was worked out, and what became of each; and how many it looked at."""

    name: str
    delta: Floats
    score: Floats
    rule: list[str]
    looked_at: int


@dataclass(frozen=True)
class Perturbations:
    """Distinct poses as perturbations (k, 6) of the prior, best first, and their scores (k,): evidence less half the
    squared Mahalanobis distance from the prior; and the stages that led to them.  enough: the score from which poses of
    a join take the place of a scan."""

    delta: Floats
    score: Floats
    stages: list[Stage] = field(default_factory=list)
    enough: float = 0.0

    def take(self, rows: Bools) -> Perturbations:
        """Some of them, with the stages of all."""
        return replace(self, delta=self.delta[rows], score=self.score[rows])


def select_under_prior(scene: Scene, rig: Rig, prior: Prior) -> Scene:
    """The scene with only what may come into a picture under the prior, far rivals included: `select_samples`."""
    width = max(max(c.width, c.height) for c in rig.cameras.values())
    margin_px = min(SELECT_SIGMA * predict_shift_sigma(scene, rig, prior), 2.0 * width)
    return select_samples(scene, rig, prior.world_from_rig[None], margin_px)


def select_samples(scene: Scene, rig: Rig, poses: Floats, margin_px: float) -> Scene:
    """The scene with only those samples of arcs and silhouettes that come into a picture, or within `margin_px` of one,
    from one of the poses (k, 4, 4) of the rig, thinned to about SAMPLE_SPACING_PX."""
    scale = np.zeros(len(scene.sample_length))
    keep = np.zeros(len(scene.curved_triangles), bool)
    middle = scene.vertices[scene.triangles[scene.curved_triangles]].mean(axis=1)
    for camera, pose in [
        (camera, world_from_rig @ rig.rig_from_camera[name])
        for world_from_rig in poses
        for name, camera in rig.cameras.items()
    ]:
        rows = np.flatnonzero(are_in_picture(scene.sample_point, camera, pose, margin_px))
        depth = np.einsum("ij,j->i", scene.sample_point[rows] - pose[:3, 3], pose[:3, 2])
        scale[rows] = np.maximum(scale[rows], camera.matrix[0, 0] / depth)
        keep |= are_in_picture(middle, camera, pose, margin_px)
    # Walk along each arc and keep a sample whenever the next multiple of the spacing is passed.
    along = np.cumsum(scene.sample_length * scale) / SAMPLE_SPACING_PX
    first = np.diff(scene.sample_arc, prepend=-1) != 0
    passed = np.diff(np.floor(along), prepend=-1) > 0
    rows = np.flatnonzero((first | passed) & (scale > 0))
    run = np.cumsum(first | passed) - 1
    length = np.bincount(run, scene.sample_length * (scale > 0))[run[rows]] if len(rows) else np.zeros(0)
    return scene.select(rows, length, scene.curved_triangles[keep])


def search_poses(
    scene: Scene, rig: Rig, edges: dict[str, EdgePoints], fine: Fields, prior: Prior, seed: int
) -> Perturbations:
    """The best distinct poses within the prior's volume; scene as `select_samples`, fine as `build_fine_evidence` gives
    them; seed of the sequence of poses."""
    width = max(max(c.width, c.height) for c in rig.cameras.values())
    margin_px = min(SCAN_SIGMA * predict_shift_sigma(scene, rig, prior), 0.5 * width)
    prediction = predict(scene, rig, prior.world_from_rig, SCAN_SAMPLES, margin_px)
    if not len(prediction.point):
        return Perturbations(np.zeros((0, 6)), np.zeros(0))
    coarse = Fields(build_evidence(edges[name], SCAN_CELL_PX, SCAN_REACH_PX, SCAN_WINDOW) for name in rig.cameras)
    # Far from the right pose most places speak against the model: it must not pay to look past it.
    coarse, fine = (Fields(e.beyond_chance() for e in fields) for fields in (coarse, fine))
    scanned, scores = scan_prior(prediction, coarse, prior, seed)
    first = keep_distinct(prediction, scanned, scores, SCAN_DISTINCT_PX, SCAN_KEPT)
    delta, score = climb(prediction, fine, scanned[first], prior.information, CLIMB_FIRST_PX, CLIMB_LAST_PX)
    kept = keep_distinct(prediction, delta, score, CLIMB_DISTINCT_PX, CLIMB_KEPT)
    # Poses are taken best first: once there are enough, those that score less were not looked at.
    least = score[kept].min() if len(kept) == CLIMB_KEPT else -np.inf
    rule = ["beyond" if value < least else "like_a_better_one" for value in score]
    for number in kept:
        rule[number] = "goes_on"
    scan = Stage("scan", scanned[first], scores[first], rule, len(scores))
    return Perturbations(delta[kept], score[kept], [scan, Stage("climb", delta[kept], score[kept], [], len(score))])


def build_fine_evidence(rig: Rig, edges: dict[str, EdgePoints]) -> Fields:
    """The evidence that poses climb on and are assessed by."""
    return Fields(build_evidence(edges[name], CLIMB_CELL_PX, CLIMB_REACH_PX, 1) for name in rig.cameras)


def predict_shift_sigma(scene: Scene, rig: Rig, prior: Prior) -> float:
    """How far (px) one sigma of the prior may shift a picture, by turning and by moving sideways together."""
    focal = max(float(c.matrix[0, 0]) for c in rig.cameras.values())
    pose = prior.world_from_rig @ next(iter(rig.rig_from_camera.values()))
    depth = (scene.sample_point - pose[:3, 3]) @ pose[:3, 2]
    ahead = depth[are_in_picture(scene.sample_point, next(iter(rig.cameras.values())), pose, 0.5 * focal)]
    distance = float(np.median(ahead)) if len(ahead) else float(np.median(np.abs(depth))) if len(depth) else 1.0
    return focal * float(np.hypot(prior.sigma_rotation, prior.sigma_translation_mm / max(distance, 1.0)))


def _tables(p: Prediction, fields: Fields) -> tuple[Floats, Ints, Floats, Ints, Floats32, float, int]:
    """The evidence for a prediction's samples, as kernels take it."""
    cameras = len(fields)
    start = np.cumsum([0] + [e.field.size for e in fields[:-1]])
    of_cameras = (p.rotation.reshape(cameras, 9), p.offset, p.matrix.reshape(cameras, 6), [e.origin for e in fields])
    return (
        np.hstack([p.point, p.tangent, p.weight[:, None]]),
        p.view,
        np.hstack([np.asarray(values, float) for values in of_cameras]),
        np.array([(at, *e.field.shape[1:]) for at, e in zip(start.tolist(), fields, strict=True)]),
        fields.joined,
        float(fields[0].cell),
        ORIENTATIONS,
    )


def _in_threads(count: int, work: Callable[[slice], None]) -> None:
    """Do the work on rows 0..count-1, stretch by stretch, in as many threads as there are processors."""
    threads = os.cpu_count() or 1
    length = max(-(-count // (8 * threads)), 1)
    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(work, [slice(at, at + length) for at in range(0, count, length)]))


def scan_prior(prediction: Prediction, fields: Fields, prior: Prior, seed: int) -> tuple[Floats, Floats]:
    """Perturbations (k, 6) all over the prior's volume, each with the best of some turns, and their scores (k,)."""
    from vision.localisation import kernels

    factor = np.asarray(np.linalg.cholesky(prior.covariance), float)
    _, jacobian = project_with_jacobians(prediction)
    views = [jacobian[prediction.view == c] for c in range(len(fields))]
    # What the prior leaves besides shifts of whole pictures has to be covered by the sequence.
    inner = np.concatenate([j - j.mean(axis=0) for j in views if len(j)])
    spread = float(np.sqrt(np.mean(((inner @ factor) ** 2).sum(axis=(1, 2)))))
    wanted = np.clip(SCAN_POSES * (spread / SCAN_SPREAD_PX) ** 2, SCAN_POSES, MAX_SCAN_POSES)
    count = 2 ** int(np.ceil(np.log2(wanted)))
    delta = _draw(factor, count, seed)
    # A turn of the rig moves each picture nearly as a whole: by A (2, 3) px per radian at the samples' middle.
    turn = np.array([np.median(j[:, :, 3:], axis=0) if len(j) else np.zeros((2, 3)) for j in views])
    steps = np.arange(-SCAN_WINDOW, SCAN_WINDOW + 1, SCAN_STEP)
    grid = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    turns = grid * SCAN_CELL_PX @ np.linalg.pinv(turn[0]).T
    shifts = np.rint(np.einsum("cij,sj->csi", turn, turns) / SCAN_CELL_PX).astype(np.int64)
    shifts = np.clip(shifts, -SCAN_WINDOW, SCAN_WINDOW)
    # Half the squared distance from the prior of each pose with each turn added.
    away = delta @ prior.information
    stretch = 0.5 * np.einsum("si,ij,sj->s", turns, prior.information[3:, 3:], turns)
    penalty = 0.5 * np.einsum("ki,ki->k", away, delta)[:, None] + away[:, 3:] @ turns.T + stretch
    score, best = np.empty(len(delta)), np.empty(len(delta), np.int64)
    tables = _tables(prediction, fields)
    jump = shifts[..., 1] * tables[3][:, 2:] + shifts[..., 0]
    poses = np.hstack([rotation_matrix(delta[:, 3:]).reshape(-1, 9), delta[:, :3]])

    def scan(rows: slice) -> None:
        kernels.scan(
            tables, SCAN_WINDOW, poses[rows], jump, penalty[rows], np.empty(len(turns)), score[rows], best[rows]
        )

    _in_threads(count, scan)
    delta[:, 3:] += turns[best]
    return delta, score


def _draw(factor: Floats, count: int, seed: int) -> Floats:
    """Perturbations (count, 6) that cover a normal distribution of covariance factor @ factor.T, the first one 0."""
    from scipy.stats import norm, qmc

    sequence = qmc.Sobol(6, scramble=True, seed=seed).random(count)
    delta = norm.ppf(np.clip(sequence, 1e-4, 1 - 1e-4)) @ factor.T
    delta[0] = 0
    return np.asarray(delta)


def climb_each(scene: Scene, rig: Rig, fine: Fields, prior: Prior, starts: Perturbations) -> Perturbations:
    """Candidates (perturbations of the prior), each led uphill on the fine evidence from a prediction of its own."""
    steps = CLIMB_FIRST_PX, CLIMB_LAST_PX
    poses = perturb(prior.world_from_rig, starts.delta)
    reached = [climb_from(scene, rig, fine, pose, prior.information, steps) for pose in poses]
    found = sorted((it for it in reached if it is not None), key=lambda it: -it[1])
    delta = perturbations(prior.world_from_rig, np.reshape([pose for pose, _ in found], (-1, 4, 4)))
    score = np.array([score for _, score in found])
    return Perturbations(delta, score, [*starts.stages, Stage("climb", delta, score, [], len(score))])


def climb_from(
    scene: Scene, rig: Rig, fine: Fields, pose: Floats, information: Floats, steps: tuple[float, float]
) -> tuple[Floats, float] | None:
    """A pose (4, 4) of the rig led uphill by steps (px) from the first to the last, away from itself at the cost of the
    information (6, 6), and its score; None where nothing is in view."""
    prediction = predict(scene, rig, pose, CLIMB_SAMPLES)
    if not len(prediction.point):
        return None
    delta, score = climb(prediction, fine, np.zeros((1, 6)), information, *steps)
    return perturb(pose, delta[0]), float(score[0])


def climb_within(scene: Scene, rig: Rig, fine: Fields, pose: Floats, covariance: Floats, seed: int) -> Floats | None:
    """The best of poses (4, 4) of the rig led uphill from several within a covariance (6, 6), for where a single climb
    would end on a neighbouring edge; None where nothing is in view."""
    prediction, information = predict(scene, rig, pose, CLIMB_SAMPLES), np.asarray(np.linalg.inv(covariance), float)
    if not len(prediction.point):
        return None
    delta = _draw(np.asarray(np.linalg.cholesky(covariance), float), WITHIN_POSES, seed)
    far = 0.5 * np.einsum("ki,ij,kj->k", delta, information, delta)
    score = gather_evidence(prediction, fine, delta).sum(axis=1) - far
    first = keep_distinct(prediction, delta, score, CLIMB_DISTINCT_PX, WITHIN_KEPT)
    delta, score = climb(prediction, fine, delta[first], information, CLIMB_FIRST_PX, CLIMB_LAST_PX)
    return perturb(pose, delta[np.argmax(score)])


def climb(
    prediction: Prediction, fields: Fields, delta: Floats, information: Floats, first: float, last: float
) -> tuple[Floats, Floats]:
    """Perturbations (k, 6) led uphill by steps of `first` to `last` px, and their scores (k,)."""
    from vision.localisation import kernels

    _, jacobian = project_with_jacobians(prediction)
    hessian = np.einsum("nij,nik->jk", jacobian, jacobian) / max(len(jacobian), 1) + information
    value, vector = np.linalg.eigh(hessian)
    delta, score = delta.copy(), np.empty(len(delta))
    tables, basis = _tables(prediction, fields), np.ascontiguousarray(vector / np.sqrt(value))

    def climb_some(rows: slice) -> None:
        kernels.climb(tables, information, basis, first, last, np.empty(18), delta[rows], score[rows])

    _in_threads(len(delta), climb_some)
    return delta, score


def gather_evidence(prediction: Prediction, fields: Fields, delta: Floats) -> Floats:
    """The evidence (k, a) of each arc's image at perturbations (k, 6) of a prediction's pose: its samples' sum."""
    from vision.localisation import kernels

    out = np.zeros((len(delta), len(prediction.view_of_image)))
    poses = np.hstack([rotation_matrix(delta[:, 3:]).reshape(-1, 9), delta[:, :3]])
    tables, group = _tables(prediction, fields), prediction.image_of_arc

    def gather(rows: slice) -> None:
        kernels.gather(tables, poses[rows], group, out[rows])

    _in_threads(len(delta), gather)
    return out


def look_up_evidence(prediction: Prediction, fields: list[Evidence], pixel: Floats, direction: Floats) -> Floats:
    """The evidence (n,) of a prediction's samples at their pixels (n, 2) and image directions (n, 2), unweighted."""
    out = np.zeros(len(pixel))
    b = bin_orientations(direction)
    for number, e in enumerate(fields):
        at = np.rint((pixel - e.origin) / e.cell).astype(np.int64)
        inside = (at >= 0) & (at < np.array(e.field.shape[:0:-1]))
        rows = np.flatnonzero((prediction.view == number) & inside.all(axis=1))
        out[rows] = e.field[b[rows], at[rows, 1], at[rows, 0]]
    return out


def keep_distinct(prediction: Prediction, delta: Floats, score: Floats, apart_px: float, count: int) -> Ints:
    """The best rows, at most `count`, no two of which show the samples less than `apart_px` (rms) apart."""
    _, jacobian = project_with_jacobians(prediction)
    some = jacobian[:: max(len(jacobian) // 60, 1)]
    flow = np.einsum("nij,kj->kni", some, delta).reshape(len(delta), 2 * len(some)) / np.sqrt(len(some))
    kept: list[int] = []
    for row in np.argsort(-score, kind="stable"):
        if all(np.linalg.norm(flow[row] - flow[other]) >= apart_px for other in kept):
            kept.append(int(row))
            if len(kept) == count:
                break
    return np.array(kept, np.int64)
