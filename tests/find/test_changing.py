"""An index that changes, against a dict of boxes that changes with it."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest

from relmodel.errors import UsageError
from relmodel.find.changing import ChangingIndex
from relmodel.find.volumes import Sphere, VolumeTable


@pytest.mark.parametrize("first_count", [0, 1, 400, 5000])
def test_changes_are_found_at_once(first_count: int) -> None:
    rng = np.random.default_rng(4)

    def boxes(count: int) -> np.ndarray:
        low = np.round(rng.uniform(-50, 50, (count, 3)))
        return np.concatenate([low, low + np.round(rng.exponential(4, (count, 3)))], axis=1)

    first = boxes(first_count)
    index, truth = ChangingIndex(np.arange(first_count), first), dict(enumerate(first))
    for turn in range(60):
        if turn % 3 == 2:
            gone = rng.choice(list(truth), len(truth) * 3 // 4 if turn == 50 else min(len(truth), 20), replace=False)
            index.remove(gone)
            for key in gone.tolist():
                del truth[key]
            index.remove([10**6])  # is not there
        else:  # new ones, at times many, and some that were there elsewhere
            many = 700 if turn % 10 == 9 else 40
            known = rng.choice(list(truth), min(len(truth), 30), replace=False) if truth else np.empty(0, np.int64)
            keys = np.concatenate([10_000 + 1000 * turn + np.arange(many), known])
            given = boxes(len(keys))
            index.add(keys, given)
            truth.update(zip(keys.tolist(), given, strict=True))
        assert len(index) == len(truth)
        keys, held = np.array(sorted(truth)), np.array([truth[k] for k in sorted(truth)])
        asked = boxes(30)
        number, ids = index.in_boxes(asked)
        spheres = [Sphere(*row) for row in np.column_stack([asked[:, :3], np.full(30, 7.0)]).tolist()]
        in_sphere, near = index.in_volumes(VolumeTable.of(spheres))
        for i, box in enumerate(asked):
            met = ((held[:, :3] <= box[3:]) & (held[:, 3:] >= box[:3])).all(axis=1)
            assert np.array_equal(np.sort(ids[number == i]), keys[met])
            away = np.maximum(np.maximum(held[:, :3] - box[:3], box[:3] - held[:, 3:]), 0)
            assert np.array_equal(np.sort(near[in_sphere == i]), keys[(away**2).sum(axis=1) <= 49])


def test_identities_are_single() -> None:
    with pytest.raises(UsageError, match="no two alike"):
        ChangingIndex([1, 1], np.zeros((2, 6)))
    with pytest.raises(UsageError, match="one each"):
        ChangingIndex([], np.empty((0, 6))).add([1, 2], np.zeros((1, 6)))


def test_a_change_of_one_box_takes_no_room_for_all() -> None:
    """What one box that comes, moves or goes takes beside the index does not grow with the boxes that are there."""
    count = 200_000
    boxes = np.zeros((count, 6))
    index = ChangingIndex(np.arange(count) * 2, boxes)
    index.remove([2 * count - 2])  # where each box lies is found by the first change
    tracemalloc.start()
    try:
        index.add([77], boxes[:1])
        index.add([77], boxes[:1] + 1)
        index.add([40_000], boxes[:1] + 1)
        index.remove([123, 124, 124, 10**9, -1])
        assert len(index) == count - 1 + 1 - 1
        most = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert most < count / 10, "less than a mask of all"
