"""A world in memory, for planners that ask what lies in a volume hundreds of times a minute."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt
from sqlalchemy import Connection

from relmodel.arrays import Floats, Ints
from relmodel.errors import UsageError
from relmodel.find.find import BOX_COLUMNS, LEVELS, Level, world_named
from relmodel.find.kinds import build
from relmodel.find.packing import PAGE_SIZE, bounds_of_runs, page_order
from relmodel.find.volumes import Box, Volume, VolumeTable, volumes_met
from relmodel.geometry.hulls import Hulls, boxes_placed
from relmodel.geometry.transforms import matrices
from relmodel.store import Store


def placed_parts(store: Store, connection: Connection, world_id: int) -> tuple[dict[str, npt.NDArray[Any]], Hulls]:
    """The placed parts of a world by columns, as the query index/parts gives them, and the hulls of their shapes."""
    parts = store.columns(connection, "index/parts", world_id=world_id, path=None)
    shape_ids = store.array(np.unique(parts["shape_id"].astype(np.int64)))
    return parts, Hulls.of(store.columns(connection, "find/hulls", shape_ids=shape_ids))


def world_boxes(parts: dict[str, npt.NDArray[Any]], hulls: Hulls) -> Floats:
    """World boxes (n, 6) of placed parts (n,), mm."""
    boxes = np.stack([parts[f"shape_{name}"] for name in BOX_COLUMNS], axis=1).astype(np.float64)
    return boxes_placed(matrices(parts), boxes, parts["shape_id"].astype(np.int64), hulls)


class WorldIndex:
    """The boxes of a world's parts, features, surfaces and arcs: the answers of `in_volume` without the store.

    Placed parts lie in an index of the kind asked for.  Elements are kept once a shape, in its frame and in pages: a
    query carries the volume into the frame of each part that it meets.
    """

    def __init__(
        self,
        parts: dict[str, npt.NDArray[Any]],
        elements: Mapping[Level, dict[str, npt.NDArray[Any]]],
        hulls: Hulls,
        kind: str = "rtree",
    ) -> None:
        self.kind = kind
        self._occurrence_id = parts["occurrence_id"].astype(np.int64)
        self._no_element = np.full(len(self._occurrence_id), -1, np.int64)
        self._no_element.flags.writeable = False
        self._world_from_part = matrices(parts)
        self._shape_box = np.stack([parts[f"shape_{name}"] for name in BOX_COLUMNS], axis=1).astype(np.float64)
        self._tree = build(kind, world_boxes(parts, hulls))
        shapes, self._part_shape = np.unique(parts["shape_id"].astype(np.int64), return_inverse=True)
        self._elements = {str(level): _ShapePages(shapes, columns) for level, columns in elements.items()}

    @classmethod
    def load(cls, store: Store, world: str | None = None, kind: str = "rtree") -> WorldIndex:
        """The newest revision of a world of a store; the only one needs no name.  kind: one of `kinds.KINDS`."""
        with store.read() as connection:
            world_id = world_named(store, connection, world)[0]
            parts, hulls = placed_parts(store, connection, world_id)
            elements: dict[Level, dict[str, npt.NDArray[Any]]] = {
                level: store.columns(connection, "index/elements", world_id=world_id, level=level)
                for level in LEVELS
                if level != "part"
            }
        return cls(parts, elements, hulls, kind)

    def in_volume(self, volume: Volume, level: str = "part") -> tuple[Ints, Ints]:
        """occurrence_id and element_no (-1 of parts) of what lies in a volume, sorted; defined as in `find`."""
        if level == "part" and isinstance(volume, Box):  # what a planner asks most often
            part = self._tree.in_box(volume.bounds)
            part.sort()
            return self._occurrence_id[part], self._no_element[: len(part)]
        return self.in_volumes([volume], level)[1:]

    def in_volumes(self, volumes: Sequence[Volume], level: str = "part") -> tuple[Ints, Ints, Ints]:
        """Ordinal of the volume, occurrence_id and element_no (-1 of parts) of what lies in volumes, sorted."""
        if level not in LEVELS:
            raise UsageError(f"there is no level {level!r}: use one of {', '.join(LEVELS)}")
        boxes_only = {*map(type, volumes)} <= {Box}
        each: list[Any] = [volume.bounds for volume in volumes]
        bounds = np.frombuffer(bytearray().join(each)).reshape(-1, 6)  # a fourth of np.array's time
        table = None if boxes_only and level == "part" else VolumeTable.of(volumes)
        pairs = self._tree.in_boxes(bounds) if boxes_only or table is None else self._tree.in_volumes(table)
        key = pairs[0] << 32 | pairs[1]
        key.sort()
        asked, part = key >> 32, key & 0xFFFFFFFF
        if table is None:
            return asked, self._occurrence_id[part], self._no_element[part]
        if level != "part":
            return self._elements_in(table, self._elements[level], asked, part)
        met = volumes_met(volumes, asked, self._world_from_part[part], self._shape_box[part])
        return asked[met], self._occurrence_id[part[met]], self._no_element[part[met]]

    def _elements_in(self, table: VolumeTable, pages: _ShapePages, asked: Ints, part: Ints) -> tuple[Ints, Ints, Ints]:
        from relmodel.find import volume_kernels

        pair, row = volume_kernels.elements_in_volumes(
            table.half_spaces,
            table.start,
            table.balls,
            asked,
            part,
            self._world_from_part,
            self._part_shape,
            pages.shape_pages,
            pages.page_boxes,
            pages.page_start,
            pages.boxes,
        )
        element = pages.element_no[row]
        order = np.lexsort((element, pair))
        pair = pair[order]
        return asked[pair], self._occurrence_id[part[pair]], element[order]


class _ShapePages:
    """Boxes of the elements of a level, by shape and packed into pages; `columns` come sorted by shape."""

    def __init__(self, shapes: Ints, columns: dict[str, npt.NDArray[Any]]) -> None:
        boxes = np.stack([columns[name] for name in BOX_COLUMNS], axis=1).astype(np.float64)
        shape = np.searchsorted(shapes, columns["shape_id"].astype(np.int64))
        ends = np.append(np.flatnonzero(np.diff(shape, prepend=-1)), len(shape))
        none = np.empty(0, np.int64)
        order = np.concatenate([none, *(a + page_order(boxes[a:b]) for a, b in pairwise(ends.tolist()))])
        first = np.concatenate([none, *(np.arange(a, b, PAGE_SIZE) for a, b in pairwise(ends.tolist()))])
        self.element_no = columns["element_no"].astype(np.int64)[order]
        self.boxes = boxes[order]
        self.page_start = np.append(first, len(shape)).astype(np.int64)
        self.shape_pages = np.searchsorted(shape[first], np.arange(len(shapes) + 1)).astype(np.int64)
        self.page_boxes = bounds_of_runs(self.boxes, first)
