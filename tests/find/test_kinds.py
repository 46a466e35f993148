"""All kinds of index against brute force: equal answers, boxes nested, sliced and through one point included."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest

from relmodel.errors import UsageError
from relmodel.find.indexes import KINDS, build
from relmodel.find.volumes import Box, VolumeTable

Floats = npt.NDArray[np.float64]


def boxes_of(case: str, count: int) -> Floats:
    rng = np.random.default_rng(count + len(case))
    if case == "whole":  # numbers: many touch
        low = np.round(rng.uniform(-50, 50, (count, 3)))
        return np.concatenate([low, low + np.round(rng.exponential(3, (count, 3)))], axis=1)
    if case == "clustered":
        low = rng.choice(rng.uniform(-5000, 5000, (8, 3)), count) + rng.normal(0, 40, (count, 3))
        return np.concatenate([low, low + rng.lognormal(1, 1.5, (count, 3))], axis=1)
    if case == "nested":
        half = np.linspace(1, 100, count)[:, None] * np.ones(3)
        return np.concatenate([-half, half], axis=1)
    if case == "sliced":  # plates as wide as all, one behind the other
        low = np.tile([-100.0, -100, 0], (count, 1))
        low[:, 2] = np.arange(count)
        return np.concatenate([low, low + np.array([200, 200, 0.5])], axis=1)
    if case == "through a point":
        half = rng.uniform(0, 100, (count, 6))
        return np.concatenate([-half[:, :3], half[:, 3:]], axis=1)
    assert case == "equal"
    return np.tile([1.0, 2, 3, 4, 5, 6], (count, 1))


CASES = ("whole", "clustered", "nested", "sliced", "through a point", "equal")


def asked_of(boxes: Floats, count: int) -> Floats:
    rng = np.random.default_rng(1)
    size = 10 ** rng.uniform(-1, 2, (count, 3)) * (rng.random((count, 3)) > 0.1)
    corner = np.round(rng.uniform(-60, 60, (count, 3)))
    if len(boxes):
        corner[::2] = rng.choice(boxes[:, :3], len(corner[::2]))
        corner[1::4] = rng.choice(boxes[:, 3:], len(corner[1::4]))
        corner[1::4] -= size[1::4] * (rng.random((len(corner[1::4]), 3)) < 0.5)
    return np.concatenate([corner, corner + size], axis=1)


def met(boxes: Floats, box: Floats) -> list[int]:
    return np.flatnonzero(((boxes[:, :3] <= box[3:]) & (boxes[:, 3:] >= box[:3])).all(axis=1)).tolist()


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("count", [0, 1, 17, 600])
def test_equal_to_brute_force(kind: str, case: str, count: int) -> None:
    boxes = boxes_of(case, count)
    index = build(kind, boxes)
    asked = asked_of(boxes, 120)
    asked[-1] = [-1e5, -1e5, -1e5, 1e5, 1e5, 1e5]
    expected = [met(boxes, box) for box in asked]
    volumes = VolumeTable.of([Box(*box) for box in asked])
    for numbers, found in (index.in_boxes(asked), index.in_volumes(volumes)):
        assert np.all(np.diff(numbers) >= 0)
        assert [sorted(found[numbers == i].tolist()) for i in range(len(asked))] == expected
    assert len(index) == count
    assert index.nbytes >= boxes.nbytes


def test_unknown_kind() -> None:
    with pytest.raises(UsageError, match="no index of the kind 'tree'"):
        build("tree", np.empty((0, 6)))
