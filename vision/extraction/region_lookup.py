"""The region of a picture at given places."""

from __future__ import annotations

import itertools

import cv2
import numpy as np

from relmodel.arrays import Floats, Ints
from vision.extraction.primitives import Primitives


def find_regions_at(picture: Primitives, pixel: Floats) -> Ints:
    """The region (n,) at pixels (n, 2), -1 for none: outlines are filled, holes left out, the innermost wins."""
    regions, (rows, columns) = picture.regions, picture.shape
    drawn = np.full((rows, columns), -1, np.int32)
    rings = [regions.outline[a:b].astype(np.int32) for a, b in itertools.pairwise(regions.ring_offsets.tolist())]
    outer = np.flatnonzero(np.diff(regions.ring_region, prepend=-1) != 0)
    # What lies in a hole is a region of its own, smaller than the one around it.
    for ring in outer[np.argsort(-regions.area[regions.ring_region[outer]], kind="stable")].tolist():
        cv2.fillPoly(drawn, [rings[ring]], int(regions.ring_region[ring]))
    x, y = np.rint(pixel).astype(np.int64).T
    inside = (x >= 0) & (x < columns) & (y >= 0) & (y < rows)
    return np.where(inside, drawn[np.where(inside, y, 0), np.where(inside, x, 0)], -1)
