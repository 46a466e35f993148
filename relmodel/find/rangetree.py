"""Nested segment and range trees: "does any box meet this volume?" in O(log^3 n) steps, whatever the boxes."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from relmodel.arrays import Floats, Ints
from relmodel.find.pairs import among, as_boxes
from relmodel.find.volumes import VolumeTable


class RangeTree:
    """Trees over x, whose nodes hold trees over y, whose nodes hold lists in order of the least z.

    An interval meets [q0, q1] if it holds q0 or if it begins in (q0, q1].  The first are on one path of a segment tree
    (de Berg et al., "Computational Geometry", chapter 10), the second under O(log n) nodes of a range tree over the
    beginnings (chapter 5); no box is found twice.  A list stores for each box the greatest z of the boxes up to it, so
    that a binary search finds whether one of them meets [q0, q1] in z.  Groups of a few boxes are lists without trees.

    It takes O(n log^2 n) memory, some hundred times that of the boxes: use it for questions of existence whose cost
    must not depend on the arrangement of the boxes.
    """

    def __init__(self, boxes: npt.ArrayLike) -> None:
        from relmodel.find.rangetree_kernels import greatest_so_far, trees_over

        given = as_boxes(boxes)
        self._number = np.argsort(given[:, 2], kind="stable").astype(np.int64)
        self._boxes = np.ascontiguousarray(given[self._number])  # in order of z, and so is every list below
        self._given = given
        everything = np.array([0, len(given)], np.int64), np.arange(len(given), dtype=np.int32)
        self._x: tuple[Any, ...] = trees_over(self._boxes[:, 0].copy(), self._boxes[:, 3].copy(), *everything)
        self._y: tuple[Any, ...] = trees_over(self._boxes[:, 1].copy(), self._boxes[:, 4].copy(), *self._x[-2:])
        self._greatest = greatest_so_far(self._boxes[:, 5].copy(), *self._y[-2:])

    def __len__(self) -> int:
        return len(self._number)

    @property
    def nbytes(self) -> int:
        return sum(array.nbytes for array in (self._boxes, self._number, *self._x, *self._y, self._greatest))

    def in_box(self, box: Floats) -> Ints:
        return self.in_boxes(box[None])[1]

    def in_boxes(self, asked: Floats) -> tuple[Ints, Ints]:
        numbers, found, _ = self._ask(asked, first_only=False)
        return numbers, self._number[found]

    def in_volumes(self, volumes: VolumeTable) -> tuple[Ints, Ints]:
        return among(self._given, volumes, self.in_boxes(volumes.bounds))

    def any_in_box(self, box: Floats) -> bool:
        return self.existence(box)[0]

    def existence(self, box: Floats) -> tuple[bool, int]:
        """Whether any box meets a box (6,), and the steps taken: nodes visited, probes of searches, boxes tested."""
        numbers, _, steps = self._ask(np.asarray(box, float).reshape(1, 6), first_only=True)
        return len(numbers) > 0, int(steps)

    def _ask(self, asked: Floats, *, first_only: bool) -> tuple[Ints, Ints, int]:
        from relmodel.find.rangetree_kernels import entries_in_boxes

        found: tuple[Ints, Ints, int] = entries_in_boxes(
            self._boxes, self._x, self._y, self._greatest, as_boxes(asked), first_only
        )
        return found
