"""Marks: streaks of a brushed surface and saturated blobs against steps whose place is known."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from relmodel.arrays import Floats
from tests.vision.extraction.synthetic import disc, step
from vision.extraction.extract import extract


def brushed(shape: tuple[int, int], seed: int = 3) -> Floats:
    """Streaks along the columns, about 50 px long and 1.2 px wide, standard deviation 10 grey."""
    noise = gaussian_filter(np.random.default_rng(seed).normal(size=shape), (20.0, 1.2))
    return np.asarray(10.0 * noise / noise.std())


def test_streaks_are_marked_as_texture_and_the_step_among_them_is_not() -> None:
    tilt = 0.3
    picture = step(tilt, 0.0, (200, 200), dark=80, bright=150) + brushed((200, 200))
    found = extract(picture + np.random.default_rng(4).normal(0.0, 1.0, picture.shape))
    x, y = found.edges.x[found.arcs.elements] - 99.5, found.edges.y[found.arcs.elements] - 99.5
    on_step = np.add.reduceat(np.abs(x * np.cos(tilt) + y * np.sin(tilt)) < 2.0, found.arcs.offsets[:-1])
    true = on_step > 0.5 * found.arcs.chains.counts
    length = found.arcs.length
    assert length[~true].sum() > 500.0
    assert length[~true & (found.quality.texture > 0.5)].sum() > 0.8 * length[~true].sum()
    assert length[true & (found.quality.texture < 0.5)].sum() > 0.9 * length[true].sum() > 100.0


@pytest.mark.parametrize(("bright", "share"), [(180.0, 0.0), (255.0, 1.0)])
def test_the_border_of_a_saturated_blob_is_marked_as_highlight(bright: float, share: float) -> None:
    found = extract(disc(60.0, 60.0, 30.0, (120, 120), bright=bright))
    assert len(found.arcs) == 1
    assert found.quality.highlight == pytest.approx([share])
    assert found.quality.texture[0] < 0.05


@pytest.mark.parametrize(("bright", "saturated"), [(60.0, False), (250.0, True)])
def test_the_crest_of_a_fillet_is_told_from_those_of_streaks(bright: float, saturated: bool) -> None:
    y, x = np.mgrid[:200, :200] - 99.5
    across = x * np.cos(0.4) + y * np.sin(0.4)
    picture = np.clip(100.0 + brushed((200, 200)) + bright * np.exp(-0.5 * (across / 2.5) ** 2), 0, 255)
    found = extract(picture + np.random.default_rng(4).normal(0.0, 1.0, picture.shape))
    px, py = found.ridge_arcs.x - 99.5, found.ridge_arcs.y - 99.5
    hits = np.add.reduceat(np.abs(px * np.cos(0.4) + py * np.sin(0.4)) < 2.0, found.ridge_arcs.offsets[:-1])
    fillet = (hits > 0.5 * found.ridge_arcs.chains.counts) & ~found.ridges.ravine[
        found.ridge_arcs.elements[found.ridge_arcs.offsets[:-1]]
    ]
    length, texture = found.ridge_arcs.length, found.ridge_quality.texture
    assert length[fillet & (texture < 0.5)].sum() > 100.0
    assert np.average(texture[~fillet] > 0.5, weights=length[~fillet]) > 0.8
    assert (np.average(found.ridge_quality.highlight[fillet], weights=length[fillet]) > 0.9) == saturated
