"""Sort-Tile-Recursive packing of boxes into pages: the leaf level of the R-tree that the store's tables hold.

Leutenegger, Lopez and Edgington, "STR: a simple and efficient algorithm for R-tree packing", ICDE 1997, in three
dimensions.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

PAGE_SIZE = 64


def pack(boxes: npt.ArrayLike, page_size: int = PAGE_SIZE) -> npt.NDArray[np.int64]:
    """Page number (n,) of each box (n, 6: x0 y0 z0 x1 y1 z1).

    Boxes are sorted by the x of their centres and cut into slabs, each slab by y into columns, each column by z into
    pages; pages are numbered from 0 in that order and all but the last hold `page_size` boxes.  Equal centres keep
    the order they are given in, so that equal input gives equal pages.
    """
    boxes = np.asarray(boxes, float).reshape(-1, 6)
    n = len(boxes)
    if n == 0:
        return np.empty(0, np.int64)
    centre = boxes[:, :3] + boxes[:, 3:]
    page_count = -(-n // page_size)
    slab_pages = -(-page_count // _ceil_root(page_count, 3))
    column_pages = -(-slab_pages // _ceil_root(slab_pages, 2))

    position = np.empty(n, np.int64)
    position[np.argsort(centre[:, 0], kind="stable")] = np.arange(n)
    slab = position // (slab_pages * page_size)
    order = np.lexsort((centre[:, 1], slab))
    # Slabs are full but for the last, so the place within a slab is the rest of the place in the whole.
    position[order] = np.arange(n)
    column = position % (slab_pages * page_size) // (column_pages * page_size)
    order = np.lexsort((centre[:, 2], column, slab))
    page = np.empty(n, np.int64)
    page[order] = np.arange(n) // page_size
    return page


def page_boxes(
    boxes: npt.ArrayLike, page: npt.NDArray[np.int64]
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.float64]]:
    """How many boxes each page 0 .. max(page) holds (m,), and the boxes that bound them (m, 6).

    `page` (n,) are the pages of `boxes` (n, 6), as `pack` gives them: none is empty.
    """
    boxes = np.asarray(boxes, float).reshape(-1, 6)
    if len(boxes) == 0:
        return np.empty(0, np.int64), np.empty((0, 6))
    counts = np.bincount(page)
    starts = np.concatenate([[0], np.cumsum(counts[:-1])])
    ordered = boxes[np.argsort(page, kind="stable")]
    bounds = np.concatenate(
        [np.minimum.reduceat(ordered[:, :3], starts), np.maximum.reduceat(ordered[:, 3:], starts)], axis=1
    )
    return counts, bounds


def _ceil_root(n: int, degree: int) -> int:
    """Least integer whose power `degree` is at least n."""
    root = max(1, int(n ** (1 / degree)))
    while pow(root, degree) < n:
        root += 1
    return root
