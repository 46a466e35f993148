"""An index whose boxes may be added, removed and moved after it was built."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from relmodel.arrays import Floats, Ints
from relmodel.errors import UsageError
from relmodel.find.kinds import BoxIndex, build
from relmodel.find.packing import outgrown
from relmodel.find.pairs import among, as_boxes
from relmodel.find.volumes import VolumeTable


class ChangingIndex:
    """Boxes by identity: those of a built index, an overflow that is looked through, and what was removed.

    Added boxes are found, and removed ones are not, from the next query on.
    """

    def __init__(self, ids: npt.ArrayLike, boxes: npt.ArrayLike, kind: str = "rtree") -> None:
        self._kind = kind
        self._set(np.asarray(ids, np.int64).reshape(-1), as_boxes(boxes))

    def _set(self, ids: Ints, boxes: Floats) -> None:
        """Build over boxes; the overflow is then empty."""
        if len(ids) != len(boxes) or len(np.unique(ids)) != len(ids):
            raise UsageError("boxes of an index need identities, one each, no two alike")
        order = np.argsort(ids)
        self._ids, self._boxes = ids[order], boxes[order]
        self._index: BoxIndex = build(self._kind, self._boxes)
        self._there, self._gone = np.ones(len(ids), bool), 0
        self._more_ids, self._more = np.empty(0, np.int64), np.empty((0, 6))

    def __len__(self) -> int:
        return len(self._ids) - self._gone + len(self._more_ids)

    @property
    def overflow(self) -> int:
        """How many boxes were added or removed since the index was built."""
        return len(self._more_ids) + self._gone

    def add(self, ids: npt.ArrayLike, boxes: npt.ArrayLike) -> None:
        """Add boxes (k, 6) under identities (k,); a box that has one of them is replaced by the new one."""
        new, given = np.asarray(ids, np.int64).reshape(-1), as_boxes(boxes)
        if len(new) != len(given) or len(np.unique(new)) != len(new):
            raise UsageError("boxes of an index need identities, one each, no two alike")
        self._drop(new)
        self._more_ids = np.concatenate([self._more_ids, new])
        self._more = np.concatenate([self._more, given])
        self._fold()

    def remove(self, ids: npt.ArrayLike) -> None:
        """Remove the boxes of identities (k,); those that are not there are passed over."""
        self._drop(np.asarray(ids, np.int64).reshape(-1))
        self._fold()

    def in_boxes(self, asked: Floats) -> tuple[Ints, Ints]:
        """Pairs of (number of the box asked, identity of a box that meets it) for boxes (k, 6), sorted."""
        asked = as_boxes(asked)
        return self._with_overflow(asked, *self._index.in_boxes(asked), None)

    def in_volumes(self, volumes: VolumeTable) -> tuple[Ints, Ints]:
        """Pairs of (number of the volume, identity of a box that is not wholly outside it), sorted."""
        return self._with_overflow(volumes.bounds, *self._index.in_volumes(volumes), volumes)

    def _with_overflow(
        self, asked: Floats, number: Ints, found: Ints, volumes: VolumeTable | None
    ) -> tuple[Ints, Ints]:
        there = self._there[found]
        number, ids = number[there], self._ids[found[there]]
        if len(self._more):
            met = (asked[:, None, :3] <= self._more[:, 3:]).all(axis=2) & (asked[:, None, 3:] >= self._more[:, :3]).all(
                axis=2
            )
            asked_no, more_no = np.nonzero(met)
            pairs = asked_no.astype(np.int64), more_no.astype(np.int64)
            if volumes is not None:
                pairs = among(self._more, volumes, pairs)
            number = np.concatenate([number, pairs[0]])
            ids = np.concatenate([ids, self._more_ids[pairs[1]]])
        order = np.lexsort((ids, number))
        return number[order], ids[order]

    def _drop(self, ids: Ints) -> None:
        """Mark boxes of the built index as gone, and take others out of the overflow."""
        place = np.searchsorted(self._ids, ids)
        inside = place < len(self._ids)
        place = np.unique(place[inside][self._ids[place[inside]] == ids[inside]])
        place = place[self._there[place]]
        self._there[place] = False
        self._gone += len(place)
        there = np.isin(self._more_ids, ids)
        if there.any():
            self._more_ids, self._more = self._more_ids[~there], self._more[~there]

    def _fold(self) -> None:
        if outgrown(self.overflow, len(self._ids)):
            self._set(
                np.concatenate([self._ids[self._there], self._more_ids]),
                np.concatenate([self._boxes[self._there], self._more]),
            )
