"""Topographic labels of closed-form surfaces, and marks of arcs: streaks and saturated blobs against true steps."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter, map_coordinates

from relmodel.arrays import Floats
from tests.vision.extraction.synthetic import arcs_with, disc, step
from vision.extraction.edges import MOMENTS, EdgeElements, detect_edges, gaussian_kernels
from vision.extraction.extract import extract
from vision.extraction.extraction_parameters import (
    EdgeParameters,
    ExtractionParameters,
    QualityParameters,
    TopographyParameters,
)
from vision.extraction.topography import (
    LABELS,
    assess_arcs,
    assess_ridge_arcs,
    fit_ridge_arcs,
    label_topography,
    mark_inflections,
)

Q = QualityParameters()
Y, X = np.mgrid[:41, :41] - 20.0
U = np.cos(0.5) * X + np.sin(0.5) * Y


@pytest.mark.parametrize("noise", [0.01, 9.0])
def test_slopes_and_bends_count_from_their_limits_on(noise: float) -> None:
    """Of their own, or three standard deviations of the noise."""
    sigma = np.sqrt(np.diag(gaussian_kernels(TopographyParameters().scale).moment_covariance))
    slope = max(0.5, 3 * noise * sigma[MOMENTS.index((1, 0))])
    bend = max(1.0, 6 * noise * sigma[MOMENTS.index((2, 0))])
    for share, expected in ((0.95, ["flat", "slope"]), (1.05, ["slope", "concave"])):
        surfaces = 100 + share * slope * U, 100 - 0.5 * share * bend * (U - 6) ** 2
        found = [label_topography(surface, np.full(256, noise))[0][20, 20] for surface in surfaces]
        assert [LABELS[label] for label in found] == expected


def test_edges_are_inflections_and_noise_stays_flat() -> None:
    image = step(0.4, 0.0) + np.random.default_rng(0).normal(0, 2.0, (64, 64))
    edges = detect_edges(image, p=EdgeParameters(min_contrast=30))
    labels, _ = label_topography(image, np.full(256, 2.0))
    mark_inflections(labels, edges.pixel)
    assert np.mean(labels.reshape(-1)[edges.pixel] == LABELS.index("inflection")) > 0.9
    noise = 100 + np.random.default_rng(1).normal(0, 2.0, (100, 100))
    assert np.mean(label_topography(noise, np.full(256, 2.0))[0] == LABELS.index("flat")) > 0.95


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("angle", [0.0, 0.3, np.pi / 2, 2.5])
def test_a_ridge_is_one_straight_arc_at_its_place(sign: float, angle: float) -> None:
    y, x = np.mgrid[:80, :80] - 39.5
    across = x * np.cos(angle) + y * np.sin(angle) - 3.3
    image = 100 + sign * 60 * np.exp(-(across**2) / (2 * 2.5**2))
    image += np.random.default_rng(2).normal(0.0, 1.0, image.shape)
    _, ridges = label_topography(image, np.full(256, 1.0))
    arcs = fit_ridge_arcs(ridges, (80, 80), ExtractionParameters(topography=TopographyParameters(min_height=10.0)))
    assert len(arcs) == 1
    assert ridges.ravine[arcs.elements].all() == (sign < 0)
    found = ridges.elements.take(arcs.elements)
    inner = (np.abs(found.x - 39.5) < 30) & (np.abs(found.y - 39.5) < 30)  # the picture's mirror image bends the rest
    off = ((found.x - 39.5) * np.cos(angle) + (found.y - 39.5) * np.sin(angle) - 3.3)[inner]
    assert abs(off.mean()) < 0.02
    assert 0.5 < off.std() / np.sqrt(np.mean(found.sigma[inner] ** 2)) < 1.5
    ends = np.array([[arcs.start_x[0], arcs.start_y[0]], [arcs.end_x[0], arcs.end_y[0]]]) - 39.5
    assert np.abs(ends @ [np.cos(angle), np.sin(angle)] - 3.3).max() < 0.2


def test_a_fillet_gives_a_ridge_and_a_sharp_step_none() -> None:
    x = np.arange(120) - 60.0
    fillet = np.tile(100 + 50 / (1 + (x / 6) ** 2), (100, 1))
    noise = np.random.default_rng(3).normal(0.0, 1.0, fillet.shape)
    ridge = extract(fillet + noise).ridge_arcs
    assert len(ridge) == 1
    assert np.allclose([ridge.start_x[0], ridge.end_x[0]], 60.0, atol=0.1)
    assert len(extract(step(0.3, 0.0, fillet.shape) + noise).ridge_arcs) == 0


def _scattered(seed: int, count: int = 400) -> EdgeElements:
    rng = np.random.default_rng(seed)
    pixel = np.sort(rng.choice(50 * 61, count, replace=False)).astype(np.int32)
    turn, contrast = rng.uniform(-np.pi, np.pi, count), 4 * 2 ** rng.uniform(-0.5, 6.5, count)
    one = np.ones(count)
    return EdgeElements(pixel % 61 * one, pixel // 61 * one, np.cos(turn), np.sin(turn), contrast, one, one, pixel)


def parallels(e: EdgeElements, i: int) -> int:
    """Elements in the nine cells around, of the same or a neighbouring class of turn, no fainter than some classes."""
    count = 0
    turns = np.rint(np.arctan2(e.ny, e.nx) * Q.orientations / np.pi).astype(int) % Q.orientations
    grades = np.clip(2 * np.log2(e.contrast / 4), 0, Q.grades - 1).astype(int)
    for j in range(len(e)):
        apart = [abs(int(e.pixel[i]) % 61 // Q.cell - int(e.pixel[j]) % 61 // Q.cell),
                 abs(int(e.pixel[i]) // 61 // Q.cell - int(e.pixel[j]) // 61 // Q.cell)]  # fmt: skip
        alike = (turns[i] - turns[j]) % Q.orientations in (0, 1, Q.orientations - 1)
        count += max(apart) <= 1 and alike and bool(grades[j] >= grades[i] - Q.fainter)
    return count


def probability(odds: float) -> float:
    return float(1 / (1 + np.exp(odds)))


def test_what_speaks_against_arcs_is_the_logistic_of_steps_parallels_and_width() -> None:
    rng, e = np.random.default_rng(4), _scattered(3)
    grey = rng.uniform(150, 256, (50, 61)).cumsum(axis=1) % 130 + 160
    counts = [20, 7, 33]
    members = rng.permutation(400)[:60].astype(np.int32)
    offsets = np.concatenate([[0], np.cumsum(counts)])
    arcs = arcs_with(
        3, elements=members, offsets=offsets, closed=np.zeros(3, bool), contrast=np.array([20.0, 60.0, 35.0]),
        width=np.array([0.7, 1.2, 0.0]),
    )  # fmt: skip
    # far enough from certainty for each term to tell
    p = replace(Q, step_far=5.0, offset=3.0)
    found, ridges = assess_arcs(grey, e, arcs, p), assess_ridge_arcs(grey, e, arcs, replace(Q, ridge_offset=-10.0))

    def at(i: int, d: float) -> float:
        place = [[e.y[i] + d * e.ny[i]], [e.x[i] + d * e.nx[i]]]
        return float(map_coordinates(grey, place, order=1, mode="nearest")[0])

    for k, own in enumerate(np.split(members, offsets[1:-1])):
        near, far = (np.mean([at(i, d) - at(i, -d) for i in own]) for d in (2.0, 4.0))
        crowd = np.log(np.mean([parallels(e, i) for i in own]) / (3 * Q.cell))
        odds = (3.1 * near + 5.0 * far) / arcs.contrast[k] - 2.7 * crowd - 2.2 * arcs.width[k] + 3.0
        assert found.texture[k] == pytest.approx(probability(odds))
        assert found.highlight[k] == pytest.approx(np.mean([at(i, 3.0) >= 250 for i in own]))
        odds = 3.3 * np.log(arcs.contrast[k]) - 1.6 * crowd - 10.0
        assert ridges.texture[k] == pytest.approx(probability(odds))
        assert ridges.highlight[k] == pytest.approx(np.mean([grey.reshape(-1)[e.pixel[i]] >= 250 for i in own]))
    assert min(found.highlight.min(), ridges.highlight.min()) > 0.01
    none = arcs_with(0)
    assert len(assess_arcs(grey, e, none, p)) == len(assess_ridge_arcs(grey, e, none, p)) == 0


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_ridges_are_as_high_and_as_sure_as_the_facet_says(sign: float) -> None:
    """A Gaussian ridge seen by a Gaussian: bend, place and height in closed form, with noise that grows with grey."""
    p, width, turn = TopographyParameters(), 3.0, 2.9
    across = np.cos(turn) * X + np.sin(turn) * Y - 1.3
    noise = 0.01 + 0.001 * np.arange(256.0)
    grey = 100 + sign * 60 * np.exp(-(across**2) / (2 * width**2))
    _, ridges = label_topography(grey, noise, p)
    e = ridges.elements
    inner = (np.abs(e.x - 20) < 8) & (np.abs(e.y - 20) < 8) & (ridges.ravine == (sign < 0))
    off = np.cos(turn) * (e.x - 20) + np.sin(turn) * (e.y - 20) - 1.3
    assert inner.sum() > 10
    assert np.abs(off[inner]).max() < 0.03
    bend = 60 * width / np.hypot(width, p.scale) ** 3
    np.testing.assert_allclose(e.contrast[inner], bend * p.scale**2, rtol=0.04)
    slope = np.sqrt(gaussian_kernels(p.scale).moment_covariance[MOMENTS.index((1, 0)), MOMENTS.index((1, 0))])
    level = grey.reshape(-1)[e.pixel[inner]].astype(int)
    np.testing.assert_allclose(e.sigma[inner], noise[level] * slope / bend, rtol=0.04)
    half = np.sign(np.cos(turn) * np.cos(p.half_plane) + np.sin(turn) * np.sin(p.half_plane))
    np.testing.assert_allclose(e.nx[inner], half * np.cos(turn), atol=0.02)
    np.testing.assert_allclose(e.ny[inner], half * np.sin(turn), atol=0.02)
    assert set(e.width.tolist()) == {p.scale}


def test_inflections_take_the_place_of_weaker_labels_only() -> None:
    labels = np.arange(len(LABELS), dtype=np.uint8).repeat(2).reshape(2, -1)
    pixels = np.arange(0, labels.size, 2, dtype=np.int32)
    expected = labels.reshape(-1).copy()
    for i in pixels:
        if LABELS[expected[i]] not in ("peak", "pit", "saddle", "ridge", "ravine"):
            expected[i] = LABELS.index("inflection")
    mark_inflections(labels, pixels)
    assert labels.reshape(-1).tolist() == expected.tolist()


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
