"""Numbers of false alarms: of noise alone, of a step among streaks, and against a count by hand."""

import numpy as np
from scipy.ndimage import gaussian_filter
from scipy.stats import chi2

from relmodel.arrays import Floats
from tests.vision.extraction.synthetic import step
from vision.extraction.chains import compute_significance, link
from vision.extraction.edges import detect_edges
from vision.extraction.extract import extract


def streaks(shape: tuple[int, int], strength: float, seed: int = 3) -> Floats:
    """Brushed metal: noise smoothed along x far more than along y, of standard deviation `strength`."""
    lay = gaussian_filter(np.random.default_rng(seed).normal(size=shape), (1.2, 25.0))
    return np.asarray(120.0 + strength * lay / lay.std())


def test_an_edge_stands_out_of_streaks_of_its_own_contrast() -> None:
    image = streaks((256, 256), 10.0)
    image += np.where(np.arange(256)[:, None] > 128, 15.0, -15.0)  # along the lay, as high as the streaks
    found = extract(image).arcs
    long = found.length > 60
    on_step = np.abs((found.start_y + found.end_y) / 2 - 128.5) < 2
    assert found.significance[on_step & long].max() > found.significance[~on_step].max()


def test_noise_alone_gives_no_more_arcs_than_its_number_of_false_alarms() -> None:
    image = 128 + np.random.default_rng(0).normal(0, 12, (512, 512))
    found = extract(image).arcs
    expected = 10.0**1.5 * image.size / 1e6
    assert len(found) <= expected


def test_significance_joins_tails_as_fisher_does() -> None:
    image = step(0.3, 0.0, (96, 96))
    edges = detect_edges(image)
    chains = link(edges, image.shape)
    terms = np.linspace(0.5, 3.0, len(edges))
    observations = 1 + chains.counts / 20
    by_hand = chi2.sf(2 * observations * chains.mean(terms), 2 * observations)
    assert np.allclose(compute_significance(terms, chains), -np.log10(1000 * by_hand))
