"""Pictures with closed-form edges at known sub-pixel places."""

from dataclasses import fields
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.ndimage import gaussian_filter
from scipy.special import ndtr, owens_t

from relmodel.arrays import Floats
from vision.extraction.arcs import Arcs
from vision.extraction.chains import Chains, link
from vision.extraction.edges import EdgeElements

# Layouts of `sectors`: rays (degrees), greys from each on to the next; the steps are 50 to 150 high.
JUNCTIONS = {
    "L": ([0, 90], [160, 60]),
    "sharp L": ([0, 60], [60, 160]),
    "T": ([0, 75, 180], [180, 110, 40]),
    "Y": ([0, 110, 240], [60, 130, 200]),
    "X": ([0, 80, 180, 260], [40, 90, 190, 140]),
    "X of a checkerboard": ([0, 90, 180, 270], [60, 160, 60, 160]),
}

_SUB = (np.arange(5) - 2) / 5.0


def render(signed_distance: object, shape: tuple[int, int], blur: float, dark: float, bright: float) -> Floats:
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
) -> Floats:
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
) -> Floats:
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


def sectors(
    place: tuple[float, float],
    turns: npt.ArrayLike,
    greys: npt.ArrayLike,
    shape: tuple[int, int] = (96, 96),
    blur: float = 0.7,
) -> Floats:
    """Sectors about `place` (x, y): grey `greys[i]` from the ray at `turns[i]` (rad, from x towards y, ascending within
    one turn) on to the next, none wider than pi unless there are two; blurred by a Gaussian, averaged over the pixels.

    In closed form: what a Gaussian sees of a sector is a bivariate normal probability (Owen, 1956); its mean over a
    pixel by Gauss-Legendre quadrature, exact to 1e-5 of the step for this blur."""
    turns, greys = np.asarray(turns, dtype=np.float64), np.asarray(greys, dtype=np.float64)
    nodes, weights = np.polynomial.legendre.leggauss(3)
    y, x = np.mgrid[: shape[0], : shape[1]].astype(np.float64)
    out = np.zeros(shape)
    for dx, wx in zip(nodes / 2, weights / 2, strict=True):
        for dy, wy in zip(nodes / 2, weights / 2, strict=True):
            u, v = x + dx - place[0], y + dy - place[1]
            shares = []
            for i, turn in enumerate(turns):
                following = turns[(i + 1) % len(turns)]
                width = (following - turn) % (2 * np.pi)
                ends = (turn, following) if width <= np.pi + 1e-12 else (following, turn)
                share = _sector(u / blur, v / blur, *ends)
                shares.append(share if width <= np.pi + 1e-12 else 1.0 - share)
            out += wx * wy * np.tensordot(greys, np.stack(shares), 1)
    return out


def _sector(u: Floats, v: Floats, turn: float, following: float) -> Floats:
    """What a unit Gaussian about (u, v) sees of the sector from one ray of the origin on to the other, at most pi."""
    h = v * np.cos(turn) - u * np.sin(turn)
    k = u * np.sin(following) - v * np.cos(following)
    rho = -np.cos(following - turn)
    if abs(rho) > 1.0 - 1e-12:
        return np.asarray(ndtr(h))
    root = np.sqrt(1.0 - rho**2)
    tails = owens_t(h, (k - rho * h) / (h * root)) + owens_t(k, (h - rho * k) / (k * root))
    return np.asarray(0.5 * (ndtr(h) + ndtr(k)) - tails - np.where(h * k < 0.0, 0.5, 0.0))


def arcs_with(count: int, **columns: Any) -> Arcs:
    """Arcs of these columns, zeros in the others."""
    of_all: dict[str, Any] = {f.name: np.zeros(count) for f in fields(Arcs)}
    return Arcs(**of_all | columns)
