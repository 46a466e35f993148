"""Stopped holes: the brightness seen through them differs from that of the background elsewhere.

The rim of a hole that a plug fills is found as the model has it.  But where the model shows nothing behind the hole,
the picture must show the background as it is seen next to the object and through other holes nearby.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from relmodel.arrays import Bools, Floats, Ints
from vision.extraction.primitives import Primitives
from vision.extraction.region_lookup import find_regions_at
from vision.localisation.coverage import SurfaceMap
from vision.presence.items import Items
from vision.presence.presence_parameters import OpeningParameters
from vision.presence.samples import Samples

KINDS = ("through_hole", "duct")
_NONE = -1


@dataclass(frozen=True)
class Openings:
    """Holes with one region of a picture where nothing should be seen but what lies behind, as columns: item; camera:
    number in the rig; region: in its picture; pixels; grey: its mean, 0..255; behind, sigma: grey that what lies behind
    has elsewhere, and how far one such region is from that; stopped: whether all cameras together tell the two
    apart."""

    item: Ints
    camera: Ints
    region: Ints
    pixels: Floats
    grey: Floats
    behind: Floats
    sigma: Floats
    stopped: Bools


def look_through(
    items: Items, samples: Samples, pictures: Sequence[Primitives], seen: Sequence[SurfaceMap], p: OpeningParameters
) -> Openings:
    """The holes of `items` that the pictures look through; samples: their rims among others; pictures, seen: by
    camera."""
    pieces = []
    for camera, (picture, shown) in enumerate(zip(pictures, seen, strict=True)):
        empty = ((shown.surface < 0) & (shown.rays.weight > 0)).astype(np.uint8)
        count, labels = cv2.connectedComponents(empty, connectivity=4, ltype=cv2.CV_32S)
        place = np.asarray(labels, np.int64)
        opening, region, filled = _find_regions(picture, shown, place, count, p)
        item = _find_holes(items, samples.take(samples.camera == camera), shown, place, count, p)[opening]
        grey, behind, sigma = _compare(picture, region, opening, p)
        kept = (item != _NONE) & (filled >= p.least_filled) & np.isfinite(sigma)
        pieces.append(
            (item[kept], np.full(int(kept.sum()), camera), region[kept], picture.regions.area[region[kept]],
             grey[kept], behind[kept], sigma[kept])
        )  # fmt: skip
    item, camera_no, region, pixels, grey, behind, sigma = (np.concatenate(c) for c in zip(*pieces, strict=True))
    off, number = (grey - behind) / sigma, np.bincount(item, minlength=len(items))
    together = np.abs(np.bincount(item, off, len(items))) / np.sqrt(np.maximum(number, 1))
    least = np.full(len(items), np.inf)
    np.minimum.at(least, item, np.abs(off))
    stopped = (together >= p.stopped_sigma) & (least >= p.camera_sigma)
    order = np.lexsort((camera_no, item))
    columns = (item, camera_no, region, pixels, grey, behind, sigma, stopped[item])
    return Openings(*(np.asarray(column)[order] for column in columns))


def _find_regions(
    picture: Primitives, shown: SurfaceMap, place: Ints, count: int, p: OpeningParameters
) -> tuple[Ints, Ints, Floats]:
    """Regions that lie where the model shows nothing: the connected `place` that each lies in, its number, and the
    share of the place that it fills."""
    area = shown.rays.weight.ravel()
    region = find_regions_at(picture, shown.rays.pixel.reshape(-1, 2))
    total = np.bincount(region[region >= 0], area[region >= 0], len(picture.regions))
    both = np.flatnonzero((region >= 0) & (place.ravel() > 0))
    key, which = np.unique(region[both] * count + place.ravel()[both], return_inverse=True)
    pixels = np.bincount(which.ravel(), area[both], len(key)).astype(float)
    region, opening = np.divmod(key, count)
    behind = (pixels >= p.least_share * total[region]) & (pixels >= p.least_px)
    whole = np.bincount(place.ravel(), area, count)
    return opening[behind], region[behind], (pixels / np.maximum(whole[opening], 1e-9))[behind]


def _find_holes(
    items: Items, samples: Samples, shown: SurfaceMap, place: Ints, count: int, p: OpeningParameters
) -> Ints:
    """The item (places,) that each place is seen through, by the edges around it; -1 for none, as outside of the
    object."""
    bore = np.isin(np.array(items.kind), KINDS)[items.member]
    order = np.argsort(items.surface[bore], kind="stable")
    surface, member = items.surface[bore][order], items.member[bore][order]
    near = cv2.dilate(place.astype(np.float32), np.ones((3, 3))).astype(np.int64)  # a rim lies around it
    out = np.full(count, _NONE)
    if not len(surface) or not len(samples.run):
        return out
    ideal = shown.camera.normalise(samples.pixel)
    x, y = np.rint(ideal @ shown.rays.matrix[:2, :2].T + shown.rays.matrix[:2, 2]).astype(np.int64).T
    rows, columns = place.shape
    inside = (x >= 0) & (x < columns) & (y >= 0) & (y < rows)
    nearby = np.where(inside, near[np.where(inside, y, 0), np.where(inside, x, 0)], 0)
    votes = np.zeros((len(items), count))
    for side in (0, 1):
        at = np.minimum(np.searchsorted(surface, samples.surface[:, side]), len(surface) - 1)
        own = (surface[at] == samples.surface[:, side]) & (nearby > 0)
        np.add.at(votes, (member[at[own]], nearby[own]), samples.length_px[own])
    best = votes.argmax(axis=0)
    around = np.bincount(nearby, samples.length_px, count)
    clear = votes[best, np.arange(count)] >= p.least_rimmed * np.maximum(around, 1e-9)
    out[clear] = best[clear]
    return out


def _compare(picture: Primitives, region: Ints, opening: Ints, p: OpeningParameters) -> tuple[Floats, Floats, Floats]:
    """Mean grey of regions (n,), the mean of the others, which lie elsewhere, weighted by nearness, and the standard
    deviation of one region from it, nan where there are too few others."""
    regions = picture.regions
    grey, pixels = regions.mean[region].astype(float), regions.area[region]
    at = np.stack([regions.centroid_x[region], regions.centroid_y[region]], axis=1)
    far = np.linalg.norm(at[:, None] - at[None], axis=2)
    elsewhere = opening[:, None] != opening[None]
    weight = elsewhere * (0.2 + np.minimum(pixels, p.most_px) / p.most_px) / (1 + (far / p.near_px) ** 2)
    total = np.maximum(weight.sum(axis=1), 1e-9)
    behind = weight @ grey / total
    variance = (weight * (grey[None] - behind[:, None]) ** 2).sum(axis=1) / total
    # The fewer others there are, the more the usual spread counts.
    others = elsewhere.sum(axis=1)
    variance = (others * variance + p.usual_others * p.usual_grey**2) / (others + p.usual_others)
    sigma = np.hypot(np.sqrt(variance * (1 + 1 / np.maximum(others, 1))), p.floor_grey)
    return grey, behind, np.where(others >= p.least_others, sigma, np.nan)
