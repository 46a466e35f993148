"""Edges over several scales against steps of known place and blur, in noise."""

import numpy as np
import pytest

from relmodel.arrays import Floats
from relmodel.errors import UsageError
from tests.vision.extraction.synthetic import step
from vision.extraction.edges import EdgeElements
from vision.extraction.extraction_parameters import EdgeParameters
from vision.extraction.noise import estimate_noise
from vision.extraction.scales import detect_edges_over_scales

_ANGLE = 0.4


def _elements(image: Floats, *scales: float) -> EdgeElements:
    return detect_edges_over_scales(
        image, EdgeParameters(scales=scales, min_contrast=5.0, max_sigma=1.0), noise=estimate_noise(image)
    )


def _distance(found: EdgeElements) -> Floats:
    return np.asarray((found.x - 63.5) * np.cos(_ANGLE) + (found.y - 63.5) * np.sin(_ANGLE))


def test_noise_has_fewer_partners_than_edges() -> None:
    false, true = np.zeros(2), np.zeros(2)
    for seed in range(12):
        image = step(_ANGLE, 0.0, (128, 128)) + np.random.default_rng(seed).normal(0, 15, (128, 128))
        for at, scales in enumerate(((1.0,), (1.0, 1.4))):
            distance = np.abs(_distance(_elements(image, *scales)))
            false[at] += np.sum(distance > 4)
            true[at] += np.sum(distance < 1)
    assert false[1] < 0.9 * false[0]
    assert true[1] > 0.95 * true[0]


def test_a_sharp_edge_is_placed_by_the_finest_scale_and_shown_once() -> None:
    image = step(_ANGLE, 0.0, (128, 128)) + np.random.default_rng(1).normal(0, 1, (128, 128))
    fine, all_scales = _elements(image, 1.0), _elements(image, 1.0, 1.4, 2.0, 2.8)
    near = np.abs(_distance(all_scales)) < 2
    assert near.sum() == pytest.approx(np.sum(np.abs(_distance(fine)) < 2), rel=0.05)
    assert np.isin(np.round(all_scales.x[near], 6), np.round(fine.x, 6)).mean() > 0.9
    assert np.all(np.diff(all_scales.pixel) > 0)


def test_a_wide_shade_shows_at_the_scale_that_sees_it() -> None:
    image = step(_ANGLE, 0.0, (128, 128), blur=4.0, bright=85) + np.random.default_rng(2).normal(0, 8, (128, 128))
    near = [np.sum(np.abs(_distance(_elements(image, *scales))) < 2) for scales in ((1.0,), (1.0, 1.4, 2.0, 2.8))]
    assert near[1] > 5 * near[0]


def test_scales_that_do_not_ascend_are_refused() -> None:
    with pytest.raises(UsageError, match="ascend"):
        _elements(step(0.0, 0.0), 2.0, 1.4)
