"""Pictures with closed-form edges at known sub-pixel places."""

import numpy as np
import numpy.typing as npt
from scipy.ndimage import gaussian_filter
from scipy.special import ndtr

from vision.extraction.edges import EdgeElements
from vision.extraction.linking import Chains, link

FloatArray = npt.NDArray[np.float64]

_SUB = (np.arange(5) - 2) / 5.0


def render(signed_distance: object, shape: tuple[int, int], blur: float, dark: float, bright: float) -> FloatArray:
    """Grey picture of an edge: dark where `signed_distance(x, y)` is negative, Gaussian blur, then the pixel's box."""
    rows, columns = shape
    y, x = np.mgrid[:rows, :columns].astype(np.float64)
    share = np.zeros(shape)
    for dy in _SUB:
        for dx in _SUB:
            share += ndtr(signed_distance(x + dx, y + dy) / blur)  # type: ignore[operator]
    return np.asarray(dark + (bright - dark) * share / len(_SUB) ** 2)


def step(
    angle: float,
    offset: float,
    shape: tuple[int, int] = (64, 64),
    blur: float = 0.7,
    dark: float = 60,
    bright: float = 160,
) -> FloatArray:
    """Straight step, bright towards (cos, sin) of `angle`, at `offset` px from the middle of the picture."""
    cy, cx = (shape[0] - 1) / 2, (shape[1] - 1) / 2
    return render(lambda x, y: (x - cx) * np.cos(angle) + (y - cy) * np.sin(angle) - offset, shape, blur, dark, bright)


def disc(
    cx: float,
    cy: float,
    radius: float,
    shape: tuple[int, int],
    blur: float = 0.7,
    dark: float = 60,
    bright: float = 160,
) -> FloatArray:
    """Bright disc, drawn eight times as large, blurred there in two dimensions, and averaged over the pixels."""
    times = 8
    y, x = ((np.arange(times * n) - (times - 1) / 2) / times for n in shape)
    distance = radius - np.hypot(x[None, :] - cx, y[:, None] - cy)
    share = gaussian_filter(np.clip(0.5 + times * distance, 0.0, 1.0), times * blur)
    share = share.reshape(shape[0], times, shape[1], times).mean(axis=(1, 3))
    return np.asarray(dark + (bright - dark) * share)


def linked(edges: EdgeElements, shape: tuple[int, int]) -> Chains:
    """Chains that are no work of the noise of these pictures: 8 elements of mean contrast 10."""
    chains = link(edges, shape)
    return chains.take((chains.counts >= 8) & (chains.mean(edges.contrast) >= 10))
