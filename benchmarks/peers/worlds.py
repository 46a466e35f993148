"""Worlds of boxes that volumes are asked of, and the volumes."""

from __future__ import annotations

import numpy as np

from benchmarks.peers.boxes import Floats
from relmodel.find.volumes import Frustum
from relmodel.geometry.transforms import rotation_matrix


def clustered(count: int, seed: int) -> Floats:
    """Boxes of some mm in clusters of a few hundred in a hall of 40 m."""
    rng = np.random.default_rng(seed)
    clusters = rng.uniform(-20000, 20000, (max(1, count // 300), 3))
    centre = rng.choice(clusters, count) + rng.normal(0, 400, (count, 3))
    half = rng.lognormal(2, 1, (count, 3))
    return np.concatenate([centre - half, centre + half], axis=1)


def uniform(count: int, seed: int) -> Floats:
    """Boxes of some mm, one in each cube of 100 mm."""
    rng = np.random.default_rng(seed)
    side = 50 * count ** (1 / 3)
    centre = rng.uniform(-side, side, (count, 3))
    half = rng.lognormal(2, 1, (count, 3))
    return np.concatenate([centre - half, centre + half], axis=1)


def slab(count: int, seed: int) -> Floats:
    """Boxes in a slab of the size of the demonstration bulkhead, small as they are many: one in each of equal cubes."""
    rng = np.random.default_rng(seed)
    size = np.array([3048.0, 1016, 60])
    centre = rng.uniform(-0.5, 0.5, (count, 3)) * size
    half = rng.lognormal(2, 1, (count, 3)) * (np.prod(size) / count) ** (1 / 3) / 100
    return np.concatenate([centre - half, centre + half], axis=1)


def nested(count: int, seed: int) -> Floats:
    """A box of 20 m with eight boxes in it, each with eight in it, and so on; each .3 to .6 of its parent's size."""
    rng = np.random.default_rng(seed)
    low, size = np.full((count, 3), -10000.0), np.full((count, 3), 20000.0)
    first = 1
    while first < count:
        own = np.arange(first, min(count, 8 * first + 1))
        parent = (own - 1) // 8
        size[own] = size[parent] * rng.uniform(0.3, 0.6, (len(own), 3))
        low[own] = low[parent] + rng.uniform(0, 1, (len(own), 3)) * (size[parent] - size[own])
        first = own[-1] + 1
    return np.concatenate([low, low + size], axis=1)


def rods(count: int, seed: int) -> Floats:
    """Boxes a hundred times as long as thick, along any axis, one in each cube of 100 mm."""
    rng = np.random.default_rng(seed)
    side = 50 * count ** (1 / 3)
    centre = rng.uniform(-side, side, (count, 3))
    half = rng.lognormal(1, 0.5, (count, 3))
    half[np.arange(count), rng.integers(3, size=count)] *= 100
    return np.concatenate([centre - half, centre + half], axis=1)


SPREADS = {"clustered": clustered, "slab": slab, "nested": nested, "uniform": uniform, "rods": rods}


def about(boxes: Floats, hits: int, count: int, seed: int) -> Floats:
    """Cubes around boxes, as large as needed to hold about `hits` boxes each; off all boxes where that is none."""
    rng = np.random.default_rng(seed)
    centre = (boxes[:, :3] + boxes[:, 3:]) / 2
    chosen = rng.choice(centre, count)
    if hits == 0:
        beyond = chosen + boxes[:, 3:].max(axis=0) - boxes[:, :3].min(axis=0) + 100
        return np.concatenate([beyond, beyond + 50], axis=1)
    place = min(hits, len(centre)) - 1
    half = float(np.median([np.partition(np.abs(centre - p).max(axis=1), place)[place] for p in chosen[:20]]))
    return np.concatenate([chosen - half, chosen + half], axis=1)


def views(boxes: Floats, count: int, seed: int) -> list[Frustum]:
    """Cameras that look at boxes from 2 m away, between 1 and 3 m."""
    rng = np.random.default_rng(seed)
    matrix = np.array([[1500.0, 0, 639.5], [0, 1500, 479.5], [0, 0, 1]])
    out = []
    for box in rng.choice(boxes, count):
        pose = np.eye(4)
        pose[:3, :3] = rotation_matrix(rng.uniform(-2, 2, 3))
        pose[:3, 3] = (box[:3] + box[3:]) / 2 - 2000 * pose[:3, 2]
        out.append(Frustum(1280, 960, matrix, pose, 1000.0, 3000.0))
    return out
