"""An index whose boxes may be added, removed and moved after it was built."""

from __future__ import annotations

from collections.abc import Callable
from itertools import repeat

import numpy as np
import numpy.typing as npt

from relmodel.arrays import Floats, Ints
from relmodel.errors import UsageError
from relmodel.find.pairs import as_boxes
from relmodel.find.rtree import FANOUT, PackedRTree
from relmodel.find.volumes import VolumeTable

_OPEN = 8 * FANOUT  # changes that are written into an open tree of two levels
_GROWTH = 16


class ChangingIndex:
    """Boxes by identity in packed R-trees, each many times as large as the next.

    A box that comes goes into a small open tree; a full one is packed with those that are not much larger (Bentley and
    Saxe, "Decomposable searching problems", Journal of Algorithms 1, 1980).  A box that goes is emptied in its place.
    So a change costs the logarithm of the number of boxes, most of it when trees are packed together, and is found by
    the next question.
    """

    def __init__(self, ids: npt.ArrayLike, boxes: npt.ArrayLike) -> None:
        self._trees: list[_Tree] = []  # the largest first
        self._open = _Open()
        self._where: dict[int, tuple[_Tree, int]] = {}  # but for the boxes of the largest tree
        first = _checked(ids, boxes)
        self._count = len(first[0])
        self._pack([first])

    def __len__(self) -> int:
        return self._count

    def add(self, ids: npt.ArrayLike, boxes: npt.ArrayLike) -> None:
        """Add boxes (k, 6) under identities (k,); a box that has one of them is replaced by the new one."""
        new, given = _checked(ids, boxes)
        self.remove(new)
        self._count += len(new)
        if len(new) > _OPEN:
            self._flush((new, given))
            return
        for number, box in zip(new.tolist(), given, strict=True):
            if self._open.full:
                self._flush()
            self._where[number] = self._open, self._open.put(number, box)

    def remove(self, ids: npt.ArrayLike) -> None:
        """Remove the boxes of identities (k,); those that are not there are passed over."""
        for number in np.asarray(ids, np.int64).reshape(-1).tolist():
            there = self._where.pop(number, None) or self._trees[0].find(number)
            self._count -= there is not None and there[0].tree.drop(there[1])
        if len(self._trees[0].ids) > max(_OPEN, 2 * self._count):
            self._flush(all_of_them=True)

    def in_boxes(self, asked: Floats) -> tuple[Ints, Ints]:
        """Pairs of (number of the box asked, identity of a box that meets it) for boxes (k, 6), in no order."""
        asked = as_boxes(asked)
        order = self._trees[0].tree.turns(asked)
        return self._ask(lambda tree: tree.in_boxes(asked, order))

    def in_volumes(self, volumes: VolumeTable) -> tuple[Ints, Ints]:
        """Pairs of (number of the volume, identity of a box that is not wholly outside it), in no order."""
        return self._ask(lambda tree: tree.in_volumes(volumes))

    def _ask(self, ask: Callable[[PackedRTree], tuple[Ints, Ints]]) -> tuple[Ints, Ints]:
        numbers, ids = [np.empty(0, np.int64)], [np.empty(0, np.int64)]
        for one in (*self._trees, self._open):
            number, found = ask(one.tree)
            numbers.append(number)
            ids.append(one.ids[found])
        return np.concatenate(numbers), np.concatenate(ids)

    def _flush(self, *given: tuple[Ints, Floats], all_of_them: bool = False) -> None:
        """Pack what is open, and boxes given, with the trees that are not much larger, or with all."""
        parts = [self._open.kept(), *given]
        while self._trees and (all_of_them or len(self._trees[-1].ids) <= _GROWTH * sum(len(ids) for ids, _ in parts)):
            parts.append(self._trees.pop().kept())
        self._open.clear()
        self._pack(parts)

    def _pack(self, parts: list[tuple[Ints, Floats]]) -> None:
        tree = _Tree(np.concatenate([ids for ids, _ in parts]), np.concatenate([boxes for _, boxes in parts]))
        if not self._trees:
            self._where = {}
        else:
            places = zip(repeat(tree), range(len(tree.ids)), strict=False)
            self._where.update(zip(tree.ids.tolist(), places, strict=True))
        self._trees.append(tree)


class _Tree:
    """A packed tree of boxes (n, 6), and their identities by number (n,)."""

    def __init__(self, ids: Ints, boxes: Floats) -> None:
        self.ids, self.tree = ids, PackedRTree(boxes)
        self._sorted: tuple[Ints, Ints] | None = None

    def find(self, number: int) -> tuple[_Tree, int] | None:
        """The box of an identity: this tree and its number, dropped or not."""
        if self._sorted is None:
            order = np.argsort(self.ids, kind="stable")
            self._sorted = self.ids[order], order
        ids, order = self._sorted
        place = int(ids.searchsorted(number))
        return (self, int(order[place])) if place < len(ids) and ids[place] == number else None

    def kept(self) -> tuple[Ints, Floats]:
        numbers, boxes = self.tree.kept()
        return self.ids[numbers], boxes


class _Open(_Tree):
    """A tree of two levels into whose places boxes are written one after the other."""

    def __init__(self) -> None:
        super().__init__(np.zeros(_OPEN, np.int64), np.zeros((_OPEN, 6)))
        self.clear()

    def clear(self) -> None:
        self._written = 0
        self.tree.clear()

    @property
    def full(self) -> bool:
        return self._written == _OPEN

    def put(self, number: int, box: Floats) -> int:
        self._written += 1
        self.ids[self._written - 1] = number
        self.tree.put(self._written - 1, box)
        return self._written - 1


def _checked(ids: npt.ArrayLike, boxes: npt.ArrayLike) -> tuple[Ints, Floats]:
    new, given = np.asarray(ids, np.int64).reshape(-1), as_boxes(boxes)
    if len(new) != len(given) or (len(new) > 1 and len(np.unique(new)) != len(new)):
        raise UsageError("boxes of an index need identities, one each, no two alike")
    return new, given
