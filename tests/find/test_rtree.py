"""The packed R-tree against brute force, at sizes that fill its levels and that do not."""

from __future__ import annotations

import numpy as np
import pytest

from relmodel.find.indexes import PackedRTree
from relmodel.find.volumes import Box, VolumeTable


@pytest.mark.parametrize("count", [0, 1, 3, 4, 5, 16, 17, 63, 64, 65, 300, 1000, 5003])
def test_equal_to_brute_force(count: int) -> None:
    rng = np.random.default_rng(count)
    low = np.round(rng.uniform(-50, 50, (count, 3)))  # whole numbers: many touch
    boxes = np.concatenate([low, low + np.round(rng.exponential(3, (count, 3)))], axis=1)
    tree = PackedRTree(boxes)
    corner = np.round(rng.uniform(-60, 50, (200, 3)))
    asked = np.concatenate([corner, corner + np.round(rng.exponential(15, (200, 3)))], axis=1)
    expected = [
        np.flatnonzero(((boxes[:, :3] <= box[3:]) & (boxes[:, 3:] >= box[:3])).all(axis=1)).tolist() for box in asked
    ]
    assert len(tree) == count
    for numbers, found in (tree.in_boxes(asked), tree.in_volumes(VolumeTable.of([Box(*box) for box in asked]))):
        assert [sorted(found[numbers == i].tolist()) for i in range(len(asked))] == expected
    assert tree.any_in_boxes(asked).tolist() == [bool(e) for e in expected]
    everything = np.array([-1e3, -1e3, -1e3, 1e3, 1e3, 1e3])
    assert sorted(tree.in_boxes(everything[None])[1].tolist()) == list(range(count))
