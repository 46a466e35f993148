"""Pairs of pictures of two parallel cameras without distortion: rectified coordinates are pixels less the centre."""

from __future__ import annotations

import numpy as np

from relmodel.arrays import Floats, Ints
from tests.poses import pose_of
from vision.cameras.cameras import Camera, Rig
from vision.extraction.arcs import ELLIPTIC, FREE, LINE
from vision.stereo.epipolar import StereoArcs

CENTRE, FOCAL, BASELINE = np.array([640.0, 480.0]), 1300.0, 100.0


def parallel_rig() -> Rig:
    camera = Camera(1280, 960, np.array([[FOCAL, 0, CENTRE[0]], [0, FOCAL, CENTRE[1]], [0, 0, 1]]))
    return Rig({"left": camera, "right": camera}, {"left": np.eye(4), "right": pose_of([BASELINE, 0, 0])})


def place(x: Floats, y: Floats, disparity: Floats) -> Floats:
    """Where rectified points of the first picture are in space, mm."""
    return np.asarray(BASELINE / disparity * np.array([x, y, np.full_like(x, FOCAL)]))


def packed(lines: list[Floats], contrast: Floats, width: Floats, kind: Ints, sigma: Floats) -> StereoArcs:
    """Arcs through rectified points, of one contrast each."""
    size = [len(line) for line in lines]
    offsets = np.concatenate([[0], np.cumsum(size)]).astype(np.int64)
    return StereoArcs(offsets, np.concatenate(lines) + CENTRE, np.repeat(contrast, size), kind, sigma, width)


def random_pair(seed: int, crossing: int = 30, level: int = 12) -> tuple[StereoArcs, StereoArcs, Ints]:
    """Arcs that cross rows and level ones, most about one disparity, cut otherwise in each picture; and the partner of
    each of the first."""
    rng = np.random.default_rng(seed)
    count = crossing + level
    left, right = [], []
    for k in range(count):
        angle = rng.uniform(0.3, np.pi - 0.3) if k < crossing else rng.uniform(-0.03, 0.03)
        t = np.arange(rng.integers(30, 90))[:, None]
        bent = 0.002 * rng.uniform(-1, 1) * (t - t.mean()) ** 2 if k % 3 == 0 and k < crossing else 0 * t
        start = rng.uniform([-250, -350], [450, 300])
        line = start + t * [np.cos(angle), np.sin(angle)] + bent * [-np.sin(angle), np.cos(angle)]
        disparity = (250.0 if k % 5 else 110.0) + rng.uniform(-20, 20) + 0.03 * (line - start) @ rng.normal(size=2)
        seen = line - np.column_stack([disparity, np.zeros(len(line))])
        left.append(line[rng.integers(0, 6) :] + rng.normal(0, 0.1, (1, 2)))
        right.append(seen[: len(seen) - rng.integers(0, 9)] + rng.normal(0, 0.1, (1, 2)))
        right[-1] += rng.normal(0, 0.15, right[-1].shape)
    contrast = rng.uniform(10, 90, count) * rng.choice([-1, 1], count)
    turned = rng.random(count) < 0.3
    right = [line[::-1] if back else line for line, back in zip(right, turned, strict=True)]
    kind = np.where(np.arange(count) % 3 == 0, FREE, np.where(np.arange(count) % 7 == 1, ELLIPTIC, LINE))
    order = rng.permutation(count)
    other = np.where(turned, -1, 1) * contrast * rng.uniform(0.6, 1.6, count)
    width, sigma = rng.uniform(0.6, 1.6, (2, count)), rng.uniform(0.02, 0.2, (2, count))
    return (
        packed(left, contrast, width[0], kind, sigma[0]),
        packed([right[k] for k in order], other[order], width[1][order], kind[order], sigma[1][order]),
        np.argsort(order),
    )
