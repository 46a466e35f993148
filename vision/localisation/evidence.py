"""How much an edge predicted at a place and orientation is supported by a picture, against what chance would find.

For each of a few orientations (modulo pi) the picture is a grid of cells with the strongest edge element within
reach.  A cell's evidence is the log likelihood ratio

    log( (d_k + (1 - d) q_k) / q_k )

of its strength class k: `d_k` is how often a visible model edge shows in that class, `d` its sum, and `q_k` how often
the cells *around* have the class at that orientation.  So a lone contour weighs much, a stroke among the thousands of
parallel strokes of brushed metal next to nothing, and a predicted edge where there is none counts against the pose:
log(1 - d).  The a-contrario idea is Desolneux, Moisan and Morel's; here the background is local.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from relmodel.arrays import Bools, Floats, Floats32, Ints
from vision.cameras.cameras import Camera
from vision.extraction.primitives import Primitives
from vision.localisation.localisation_parameters import DEFAULTS, EvidenceParameters


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


def collect_edge_points(picture: Primitives, camera: Camera, p: EvidenceParameters = DEFAULTS.evidence) -> EdgePoints:
    """The edge elements of a picture without the camera's distortion."""
    elements = picture.elements
    position = np.stack([elements.x, elements.y], axis=1)
    normal = np.stack([elements.nx, elements.ny], axis=1)
    sigma = elements.sigma
    if not camera.is_pinhole:
        # Normals turn as gradients do; the scale across is one over how the gradient grows.
        position, jacobian = camera.undistort_with_jacobians(position)
        normal = np.einsum("nij,ni->nj", jacobian, normal)
        growth = np.linalg.norm(normal, axis=1)
        normal, sigma = normal / growth[:, None], sigma / growth
    contrast, grey_range = np.asarray(elements.contrast), max(picture.grey_range, p.min_grey_range)
    return EdgePoints(position, normal, contrast, sigma, *bound_elements(camera, p), grey_range)


def bound_elements(camera: Camera, p: EvidenceParameters = DEFAULTS.evidence) -> tuple[Floats, Floats]:
    """The box (2,), (2,) of pixels of the camera without distortion in which its picture can have edge elements."""
    low, high = np.array([p.border_px, p.border_px]), np.array([camera.width, camera.height]) - 1.0 - p.border_px
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
    parameters: EvidenceParameters

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
        b, detection = bin_orientations(direction, self.parameters.orientations), self.parameters.detection
        q = self.chance[:, b, index[:, 1], index[:, 0]].astype(float)
        likely = np.diff(np.append(detection, 0.0)) * -1
        share = likely[:, None] + (1 - detection[0]) * q
        ratio = np.log(share / q)
        nothing = (1 - detection[0]) * np.clip(1 - q.sum(axis=0), 0, 1)
        miss = np.log(1 - detection[0])
        return np.asarray((share * ratio).sum(axis=0) + nothing * miss)


class Fields(list[Evidence]):
    """The evidence of the pictures of a rig's cameras, in its order; `joined`: their fields one behind the other, as
    kernels take them."""

    def __init__(self, of_cameras: Iterable[Evidence]) -> None:
        each = list(of_cameras)
        self.joined = np.concatenate([e.field.ravel() for e in each])
        fields = np.split(self.joined, np.cumsum([e.field.size for e in each])[:-1])
        super().__init__(replace(e, field=own.reshape(e.field.shape)) for e, own in zip(each, fields, strict=True))


def bin_orientations(direction: Floats, count: int) -> Ints:
    """The orientation (n,), one of `count`, of image directions (n, 2), modulo pi."""
    angle = np.arctan2(direction[:, 1], direction[:, 0])
    return np.rint(angle * (count / np.pi)).astype(np.int64) % count


def build_evidence(
    edges: EdgePoints, cell: float, reach: float, pad: int, p: EvidenceParameters = DEFAULTS.evidence
) -> Evidence:
    """The evidence of a picture for predictions that may be `reach` px off."""
    import cv2

    block = max(round(p.block_px / cell), 1)
    # Whole blocks: the last ones may reach beyond the picture, where there is nothing to see.
    columns, rows = (np.ceil((np.ceil((edges.high - edges.low) / cell) + 1) / block) * block).astype(int).tolist()
    index = np.rint((edges.position - edges.low) / cell).astype(np.int64)
    inside = ((index >= 0) & (index < [columns, rows])).all(axis=1)
    strength = np.searchsorted(p.strengths, np.abs(edges.contrast) / edges.grey_range, side="right").astype(np.uint8)
    orientation = bin_orientations(np.stack([-edges.normal[:, 1], edges.normal[:, 0]], axis=1), p.orientations)
    use = inside & (strength > 0)
    strongest = np.zeros((p.orientations, rows, columns), np.uint8)
    np.maximum.at(strongest, (orientation[use], index[use, 1], index[use, 0]), strength[use])
    # An element speaks for the orientations beside its own too: noise and the pose's error turn edges.
    strongest = np.maximum(strongest, np.maximum(np.roll(strongest, 1, axis=0), np.roll(strongest, -1, axis=0)))
    size = 2 * max(round(reach / cell), 0) + 1
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))
    near = np.stack([cv2.dilate(layer, disc) for layer in strongest])
    covered = _covered(edges, cell, rows, columns)
    cells = float(covered.sum())

    blocks = (rows // block, columns // block)
    window = 2 * max(round(p.surroundings_px / p.block_px), 1) + 1
    share = covered.reshape(blocks[0], block, blocks[1], block).mean(axis=(1, 3), dtype=np.float32)
    seen = _gather(np.asarray(share), window)
    chance = np.empty((len(p.strengths), p.orientations, *blocks), np.float32)
    # The evidence of a cell depends on the class of its strength, its orientation and its block alone.
    evidence = np.full((p.orientations, *blocks, 1 + len(p.strengths)), np.log(1 - p.detection[0]), np.float32)
    likely = np.diff(np.append(p.detection, 0.0)) * -1
    weight = p.background_cells / (block * block)
    row, column = np.arange(rows) // block, np.arange(columns) // block
    number = (row[:, None] * blocks[1] + column) * (1 + len(p.strengths))
    out = np.zeros((p.orientations, rows + 2 * pad, columns + 2 * pad), np.float32)
    for b in range(p.orientations):
        class_of_block = number + near[b]
        counts = np.bincount(class_of_block.ravel(), minlength=evidence[b].size).reshape(evidence[b].shape)
        for k in range(len(p.strengths)):
            around = _gather(counts[..., k + 1].astype(np.float32) / np.float32(block**2), window)
            common = float(counts[..., k + 1].sum()) / max(cells, 1.0)
            chance[k, b] = (around + weight * common + 0.5 / block**2) / (seen + weight + 1 / block**2)
            q = chance[k, b]
            evidence[b, ..., k + 1] = np.log((likely[k] + (1 - p.detection[0]) * q) / q)
        out[b, pad : pad + rows, pad : pad + columns] = evidence[b].ravel()[class_of_block]
    out[:, pad : pad + rows, pad : pad + columns] *= covered
    return Evidence(out, cell, edges.low - cell * pad, pad, chance, block, p)


def _covered(edges: EdgePoints, cell: float, rows: int, columns: int) -> Bools:
    """Cells (rows, columns) within the box of the picture."""
    width, height = (edges.high - edges.low) / cell
    return np.asarray((np.arange(rows) <= height + 0.5)[:, None] & (np.arange(columns) <= width + 0.5))


def _gather(share: Floats32, window: int) -> Floats32:
    """Sums of the shares of blocks in a window about each."""
    import cv2

    return np.asarray(cv2.boxFilter(share, -1, (window, window), normalize=False, borderType=cv2.BORDER_CONSTANT))
