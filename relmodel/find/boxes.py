"""Boxes as arrays, pairs of volumes and boxes, and Sort-Tile-Recursive packing of boxes into pages."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from relmodel.arrays import Floats, Ints
from relmodel.find.volumes import VolumeTable


def as_boxes(boxes: npt.ArrayLike) -> Floats:
    """Boxes as a contiguous array (n, 6)."""
    return np.ascontiguousarray(np.asarray(boxes, np.float64).reshape(-1, 6))


def among(boxes: Floats, volumes: VolumeTable, pairs: tuple[Ints, Ints]) -> tuple[Ints, Ints]:
    """Those pairs (number of a volume, number of a box that meets its bounds) whose box meets the volume itself."""
    from relmodel.find.rtree_kernels import pairs_met

    met = pairs_met(boxes, volumes.half_spaces, volumes.start, volumes.balls, *pairs)
    return pairs[0][met], pairs[1][met]


# The pages are the leaf level of the R-tree that the store's tables hold: Leutenegger, Lopez and Edgington, "STR: a
# simple and efficient algorithm for R-tree packing", ICDE 1997, in three dimensions.

PAGE_SIZE = 64
_SAMPLE = 8192  # points from which the extent is taken at least, where there are so many


def pack(boxes: npt.ArrayLike, page_size: int = PAGE_SIZE) -> Ints:
    """Page number (n,) of each box (n, 6: x0 y0 z0 x1 y1 z1): its place in `page_order` by `page_size`."""
    order = page_order(boxes, page_size)
    page = np.empty(len(order), np.int64)
    page[order] = np.arange(len(order)) // page_size
    return page


def page_order(boxes: npt.ArrayLike, page_size: int = PAGE_SIZE) -> Ints:
    """Numbers (n,) of boxes (n, 6: x0 y0 z0 x1 y1 z1) in the order of their pages, `page_size` of them to a page.

    Boxes are cut into slabs along the axis along which their centres spread least, each slab along the next one into
    columns, each column along the third into pages, as often along each axis as makes pages near cubes.  Equal centres
    keep the order they are given in, so that equal input gives equal pages."""
    boxes = np.asarray(boxes, float).reshape(-1, 6)
    n = len(boxes)
    if n == 0:
        return np.empty(0, np.int64)
    centre = boxes[:, :3] + boxes[:, 3:]  # twice
    extent = _extent(centre)
    axes = np.argsort(extent, kind="stable")
    thin, middle, long = extent[axes]
    page_count = -(-n // page_size)
    slab_pages = -(-page_count // max(1, round((page_count * thin / middle * thin / long) ** (1 / 3))))
    column_pages = -(-slab_pages // max(1, round((slab_pages * middle / long) ** (1 / 2))))
    slab, column = slab_pages * page_size, column_pages * page_size

    keys = [_whole(centre[:, axis]) for axis in axes]
    order = np.arange(n)
    if slab < n or column < n:
        order = _sorted(keys[0], order, np.zeros(1, np.int64), n)
        order = _sorted(keys[1], order, np.arange(0, n, slab), n)
    # A column ends with its slab.
    starts = np.concatenate([np.arange(first, min(first + slab, n), column) for first in range(0, n, slab)])
    return _sorted(keys[2], order, starts, n)


def _whole(values: Floats) -> Ints:
    """Values (n,) as whole numbers of 32 bits in their order."""
    least = values.min()
    scale = (2.0**32 - 1) / max(float(values.max() - least), 1e-300)
    return np.asarray(((values - least) * min(scale, 1e300)).astype(np.int64))


def _sorted(values: Ints, order: Ints, starts: Ints, n: int) -> Ints:
    """An order (n,) of values with each run of it, from its start to that of the next, sorted by value, and then by
    number.  Keys of value and number are sorted several times faster than places."""
    bits = n.bit_length()
    group_bits = len(starts).bit_length()
    drop = max(0, 32 + bits + group_bits - 63)
    keys = values[order]
    keys >>= drop
    keys <<= bits
    keys |= order
    if len(starts) > 1:
        keys |= np.repeat(np.arange(len(starts)) << (63 - group_bits), np.diff(starts, append=n))
    keys.sort()
    keys &= (1 << bits) - 1
    return keys


def bounds_of_runs(boxes: Floats, starts: Ints) -> Floats:
    """The boxes (m, 6) that bound runs of boxes (n, 6), each from its start to that of the next, none empty."""
    if len(starts) == 0:
        return np.empty((0, 6))
    return np.column_stack(
        [(np.minimum if i < 3 else np.maximum).reduceat(np.ascontiguousarray(boxes[:, i]), starts) for i in range(6)]
    )


def _extent(points: Floats) -> Floats:
    """Extents (3,) of points (n, 3), or a sample, without the outermost twentieths, which lie anywhere; above 0."""
    points = points[:: 1 + len(points) // _SAMPLE]
    beyond = len(points) // 20
    ends = np.partition(points, (beyond, len(points) - 1 - beyond), axis=0)
    extent = ends[len(points) - 1 - beyond] - ends[beyond]
    return np.asarray(np.maximum(extent, 1e-9 * extent.max()) if extent.any() else np.ones(3))
