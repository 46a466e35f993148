"""Chains of links, and grey between pixels."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import map_coordinates

from vision.extraction.chains import interpolate_grey


def test_grey_between_pixels_is_bilinear() -> None:
    rng = np.random.default_rng(0)
    grey, place = rng.uniform(0, 255, (20, 30)), rng.uniform(-5, 35, (7, 50, 2))
    true = map_coordinates(grey, [place[..., 1], place[..., 0]], order=1, mode="nearest")
    assert interpolate_grey(grey, place) == pytest.approx(true, abs=1e-9)
