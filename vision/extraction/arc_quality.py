"""What speaks against an arc being an edge of the object: brush texture, shading, highlights.

The closed form of an edge element foretells two plateaus, one on each side of the step.  At the edge of a face they are
there; a streak of brushed metal has fallen back a few pixels on, and a shade has not got there yet.  Streaks besides
come in bundles, parallel to each other, where an edge has its surroundings to itself.  Contrast and length, which
thresholds go by, say much less: streaks are long and bright.

The ridges of fillets and chamfers differ from those of streaks by their height and, again, by having none parallel.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from vision.extraction.arcs import Arcs
from vision.extraction.edges import EdgeElements

FloatArray = npt.NDArray[np.float64]

# Log odds of an arc being an edge, by logistic regression on pictures A1, A4, B1, C1, C2, C3 of the rendered bulkheads;
# of the mean step 2 and 4 px beside the arc over its contrast, the log of parallels around, the width in px.
_ODDS_STEP_NEAR, _ODDS_STEP_FAR, _ODDS_PARALLEL, _ODDS_WIDTH, _ODDS = 3.1, 9.2, -2.7, -2.2, -7.7
# Log odds of a ridge or ravine running along an edge, sharp or smooth, by regression on pictures A1-A4, A6, B1, C1-C3;
# of the log of its height in grey and of parallel ridges around.
_ODDS_HEIGHT, _ODDS_PARALLEL_CREST, _ODDS_CREST = 3.3, -1.6, -6.9
_NEAR, _FAR = 2.0, 4.0  # px
_CELL = 8  # px: parallels are counted in 3 x 3 such cells
_ORIENTATIONS = 12  # modulo pi; neighbours count as parallel
_GRADES, _FAINTER = 12, 3  # of contrast, two an octave; elements up to three grades fainter count
_SATURATED = 250.0
_BESIDE = 3.0  # px from an edge element to where the bright side is read


@dataclass(frozen=True)
class ArcQuality:
    """What speaks against each arc, 0..1.

    `texture`: the probability that it is brush texture or shading and no edge.  `highlight`: the share of its elements
    whose bright side, or whose ridge, is saturated.
    """

    texture: FloatArray
    highlight: FloatArray

    def take(self, kept: npt.NDArray[np.bool_]) -> "ArcQuality":
        """The quality of the arcs that the mask selects."""
        return ArcQuality(self.texture[kept], self.highlight[kept])


def assess_arcs(grey: FloatArray, edges: EdgeElements, arcs: Arcs) -> ArcQuality:
    """Quality of the arcs found in `grey` (rows, columns; 0..255) among all its edge elements, linked or not."""
    from vision.extraction import _mark_kernels

    if len(arcs) == 0:
        return ArcQuality(np.zeros(0), np.zeros(0))
    chains, distances = arcs.chains, np.array([_NEAR, -_NEAR, _FAR, -_FAR, _BESIDE])
    x, y, nx, ny = chains.beside(edges.x, edges.y, edges.nx, edges.ny)
    beside = _mark_kernels.grey_beside(grey, x, y, nx, ny, distances)
    per_arc = np.add.reduceat(
        np.column_stack([beside[:, 0] - beside[:, 1], beside[:, 2] - beside[:, 3], beside[:, 4] >= _SATURATED]),
        arcs.offsets[:-1],
    )
    near, far, saturated = (per_arc / chains.counts[:, None]).T
    parallel = np.add.reduceat(_count_parallels(edges, grey.shape, arcs.elements), arcs.offsets[:-1]) / chains.counts
    odds = (
        _ODDS_STEP_NEAR * near / arcs.contrast
        + _ODDS_STEP_FAR * far / arcs.contrast
        + _ODDS_PARALLEL * np.log(parallel / (3 * _CELL))
        + _ODDS_WIDTH * arcs.width
        + _ODDS
    )
    return ArcQuality(_against(odds), saturated)


def assess_ridge_arcs(grey: FloatArray, ridges: EdgeElements, arcs: Arcs) -> ArcQuality:
    """Quality of the arcs along ridges and ravines found in `grey` (rows, columns; 0..255) among all their elements."""
    if len(arcs) == 0:
        return ArcQuality(np.zeros(0), np.zeros(0))
    first, counts = arcs.offsets[:-1], arcs.chains.counts
    parallel = np.add.reduceat(_count_parallels(ridges, grey.shape, arcs.elements), first) / counts
    saturated = grey.reshape(-1)[ridges.pixel[arcs.elements]] >= _SATURATED
    odds = _ODDS_HEIGHT * np.log(arcs.contrast) + _ODDS_PARALLEL_CREST * np.log(parallel / (3 * _CELL)) + _ODDS_CREST
    return ArcQuality(_against(odds), np.add.reduceat(saturated.astype(np.float64), first) / counts)


def _against(odds: FloatArray) -> FloatArray:
    """The probability of the contrary, from log odds."""
    return np.asarray(1.0 / (1.0 + np.exp(np.clip(odds, -30.0, 30.0))))


def _count_parallels(edges: EdgeElements, shape: tuple[int, ...], which: npt.NDArray[np.int32]) -> FloatArray:
    """How many elements of like orientation and no less than a third of its contrast, itself among them, lie in the
    3 x 3 cells around each element of `which`."""
    from vision.extraction import _mark_kernels

    angle = np.arctan2(edges.ny, edges.nx)
    turn = np.rint(angle * (_ORIENTATIONS / np.pi)).astype(np.int32) % _ORIENTATIONS
    grade = np.clip(2.0 * np.log2(edges.contrast / 4.0), 0, _GRADES - 1).astype(np.int32)
    kinds = _ORIENTATIONS * _GRADES
    columns = -(-shape[1] // _CELL) + 2  # with a frame of empty cells around
    cell = ((edges.pixel // shape[1] // _CELL + 1) * columns + edges.pixel % shape[1] // _CELL + 1) * kinds
    around = np.array([-1, 0, 1])
    near = np.add.outer(around * columns, around).ravel() * kinds
    alike = np.add.outer(np.arange(_ORIENTATIONS), around).ravel() % _ORIENTATIONS * _GRADES
    # a cell of 8 x 8 px holds at most 64 elements
    grid = np.zeros((-(-shape[0] // _CELL) + 2) * columns * kinds, np.uint8)
    out = np.empty(len(which))
    _mark_kernels.parallels(cell, turn * _GRADES + grade, near, alike, _GRADES, which, _FAINTER, grid, out)
    return out
