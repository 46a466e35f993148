"""Numbers of false alarms: of noise alone, of a step among streaks, and against a count by hand."""

import numpy as np
from scipy.ndimage import gaussian_filter
from scipy.stats import chi2

from relmodel.arrays import Floats
from tests.vision.extraction.synthetic import step
from vision.extraction.chains import compute_false_alarm_terms, compute_significance, link
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


def test_surprise_is_the_share_of_higher_steps_around() -> None:
    image = streaks((200, 200), 12.0)
    edges = detect_edges(image)
    which = np.flatnonzero((edges.contrast > 20) & (np.abs(edges.ny) > 0.99))[::7]
    got = compute_false_alarm_terms(image, edges, which)[which]
    row, column = np.round(edges.y[which]).astype(int), np.round(edges.x[which]).astype(int)
    ahead, behind = np.minimum(row + 4, 199), np.maximum(row - 4, 0)
    height = np.where(edges.ny[which] > 0, 1, -1) * (image[ahead, column] - image[behind, column])
    everywhere = np.abs(image[8:] - image[:-8])
    share = np.array([np.mean(everywhere >= h) for h in height])
    telling = (height > 10) & (share > 0.01) & (row > 5) & (row < 194) & (height < 30)
    assert telling.sum() > 20
    assert np.median(np.abs(got[telling] + np.log(0.5 * share[telling]))) < 0.4


def test_significance_joins_tails_as_fisher_does() -> None:
    image = step(0.3, 0.0, (96, 96))
    edges = detect_edges(image)
    chains = link(edges, image.shape)
    terms = np.linspace(0.5, 3.0, len(edges))
    observations = 1 + chains.counts / 20
    by_hand = chi2.sf(2 * observations * chains.mean(terms), 2 * observations)
    assert np.allclose(compute_significance(terms, chains), -np.log10(1000 * by_hand))
