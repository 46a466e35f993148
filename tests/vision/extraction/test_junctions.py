"""Junctions against sectors that meet at known places, and the ends of arcs that close there."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from relmodel.arrays import Floats
from tests.vision.extraction.synthetic import JUNCTIONS, linked, render, sectors
from vision.extraction.arcs import CIRCULAR, LINE, Arcs
from vision.extraction.chains import fill_gaps
from vision.extraction.edges import detect_edges
from vision.extraction.extract import extract
from vision.extraction.junction_candidates import END, INTERIOR, START
from vision.extraction.junctions import KINDS, Junctions, find_junctions, snap_end_points, snap_polylines
from vision.extraction.segmentation import fit_arcs

_SEEDS = 6


def _found(name: str, seed: int, noise: float) -> tuple[Arcs, Junctions, Floats]:
    rng = np.random.default_rng(seed)
    place, turn = 33.5 + rng.uniform(-2, 2, 2), rng.uniform(0, 2 * np.pi)
    turns, greys = JUNCTIONS[name]
    image = sectors((place[0], place[1]), np.deg2rad(turns) + turn, greys, (68, 68)) + rng.normal(0, noise, (68, 68))
    edges = detect_edges(image)
    arcs = fit_arcs(edges, fill_gaps(edges, linked(edges, image.shape), image), scale=1.4)
    junctions = find_junctions(image, arcs)
    return snap_end_points(arcs, junctions), junctions, place


@pytest.mark.parametrize("name", JUNCTIONS)
def test_a_junction_is_found_where_it_is_as_surely_as_it_says(name: str) -> None:
    errors, variances = [], []
    for seed in range(_SEEDS):
        arcs, junctions, place = _found(name, seed, 10.0)
        assert [KINDS[kind] for kind in junctions.kind] == [name.removeprefix("sharp ")[0]]
        errors.append(np.array([junctions.x[0], junctions.y[0]]) - place)
        variances.append(np.trace(junctions.covariance[0]) / 2.0)
        for at, x, y in ((START, arcs.start_x, arcs.start_y), (END, arcs.end_x, arcs.end_y)):
            of = junctions.arc[junctions.at == at]
            np.testing.assert_allclose(x[of], junctions.x[0])
            np.testing.assert_allclose(y[of], junctions.y[0])
    predicted = np.sqrt(np.mean(variances))
    assert predicted < 0.12
    # of 12 deviates: two standard errors are two fifths of the scatter
    assert np.sqrt(np.mean(np.square(errors))) == pytest.approx(predicted, rel=0.5)
    assert np.abs(np.mean(errors, axis=0)).max() < 3.5 * predicted / np.sqrt(_SEEDS)


def test_courses_run_from_junction_to_junction() -> None:
    arcs, junctions, place = _found("T", 3, 3.0)
    polyline, offsets = snap_polylines(arcs, junctions)
    which = int(np.flatnonzero(junctions.at != INTERIOR)[0])
    arc, at = junctions.arc[which], junctions.at[which]
    own = np.column_stack([polyline.x, polyline.y])[offsets[arc] : offsets[arc + 1]]
    own = own if at == START else own[::-1]
    np.testing.assert_allclose(own[0], [junctions.x[0], junctions.y[0]])
    assert np.all(np.diff(np.hypot(*(own - place).T))[1:] > 0.0)
    assert offsets[-1] == len(polyline.x) == len(polyline.sigma)
    assert np.all((polyline.sigma > 0) & (polyline.sigma < 0.5))


def test_a_circle_closes_on_its_chord() -> None:
    times, n, centre, radius, chord = 8, 100, (50.3, 49.8), 30.0, 38.4
    y, x = (np.mgrid[: times * n, : times * n] - (times - 1) / 2) / times
    inside = np.clip(0.5 + times * np.minimum(radius - np.hypot(x - centre[0], y - centre[1]), x - chord), 0, 1)
    image = gaussian_filter(inside, 0.7 * times).reshape(n, times, n, times).mean(axis=(1, 3))
    found = extract(60 + 100 * image + np.random.default_rng(1).normal(0, 3, (n, n)))
    arcs, junctions = found.arcs, found.junctions
    assert sorted(arcs.kind) == [LINE, CIRCULAR]
    half = np.sqrt(radius**2 - (chord - centre[0]) ** 2)
    order = np.argsort(junctions.y)
    places = np.column_stack([junctions.x, junctions.y])[order]
    np.testing.assert_allclose(places, [[chord, centre[1] - half], [chord, centre[1] + half]], atol=0.12)
    circle = int(np.flatnonzero(arcs.kind == CIRCULAR)[0])
    ends = np.array([[arcs.start_x[circle], arcs.start_y[circle]], [arcs.end_x[circle], arcs.end_y[circle]]])
    np.testing.assert_allclose(ends[np.argsort(ends[:, 1])], places)


@pytest.mark.parametrize(("gap", "closed"), [(0.0, True), (9.0, False)])
def test_an_end_is_not_prolonged_where_the_picture_shows_nothing(gap: float, closed: bool) -> None:
    image = render(lambda x, y: 60.3 - x, (100, 120), 0.7, 60, 160)
    image += render(lambda x, y: np.minimum(60.3 - gap - x, y - 45.2), (100, 120), 0.7, 0, 60)
    found = extract(image + np.random.default_rng(2).normal(0, 2, image.shape))
    met = (found.junctions.at == INTERIOR).any()
    assert met == closed


def test_no_arcs_make_no_junctions() -> None:
    found = extract(np.full((40, 40), 90.0))
    assert len(found.junctions) == len(found.junctions.arc) == 0
    polyline, offsets = snap_polylines(found.arcs, found.junctions)
    assert len(polyline.x) == 0
    assert offsets.tolist() == [0]
