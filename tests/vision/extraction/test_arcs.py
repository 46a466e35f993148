"""Linking and arcs against pictures drawn from closed forms."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter
from scipy.special import ndtr

from relmodel.arrays import Floats
from tests.vision.extraction.synthetic import disc, linked, step
from vision.extraction.arcs import CIRCULAR, ELLIPTIC, LINE, Arcs, measure_arcs
from vision.extraction.chains import Chains, fill_gaps
from vision.extraction.edges import detect_edges
from vision.extraction.extract import extract
from vision.extraction.segmentation import fit_arcs

ANGLES = np.deg2rad([0, 70, 213])


def arcs_of(image: Floats) -> Arcs:
    edges = detect_edges(image)
    chains = linked(edges, image.shape)
    return fit_arcs(edges, fill_gaps(edges, chains, image), scale=1.4)


def noisy(image: Floats, sigma: float, seed: int = 7) -> Floats:
    return image + np.random.default_rng(seed).normal(0, sigma, image.shape)


@pytest.mark.parametrize("angle", ANGLES)
def test_a_step_is_one_line_with_the_bright_side_on_its_left(angle: float) -> None:
    arcs = arcs_of(noisy(step(angle, 0.3, (120, 120)), 5.0))
    arcs = arcs.take(arcs.length > 30)
    assert arcs.kind.tolist() == [LINE]
    middle = np.array([(arcs.start_x + arcs.end_x) / 2, (arcs.start_y + arcs.end_y) / 2]).ravel()
    bright = np.array([np.cos(angle), np.sin(angle)])
    assert abs((middle - 59.5) @ bright - 0.3) < 0.06
    left = np.array([arcs.direction[0, 1], -arcs.direction[0, 0]])
    assert left @ bright > 0.9999
    assert arcs.contrast[0] == pytest.approx(100, rel=0.05)


@pytest.mark.parametrize(("angle", "change"), [(0.0, 30.0), (0.7, -25.0), (2.4, 10.0)])
def test_an_edge_whose_bright_side_changes_is_one_line(angle: float, change: float) -> None:
    y, x = np.mgrid[:160, :160] - 79.5
    across, along = x * np.cos(angle) + y * np.sin(angle), y * np.cos(angle) - x * np.sin(angle)
    height = np.clip((change - along) * 1.5, -70.0, 70.0)
    arcs = arcs_of(noisy(120 + height * ndtr((across - 0.3) / 0.8), 3.0))
    arcs = arcs.take((arcs.length > 30) & (np.abs(arcs.direction @ [np.cos(angle), np.sin(angle)]) < 0.1))
    assert arcs.kind.tolist() == [LINE]
    dx, dy = arcs.x - 79.5, arcs.y - 79.5
    assert np.max(np.abs(dx * np.cos(angle) + dy * np.sin(angle) - 0.3)) < 0.3
    # the step is up along the normal until it changes; of most elements the bright side is on the left of the walk
    towards = arcs.direction[0] @ [-np.sin(angle), np.cos(angle)]
    place = dy * np.cos(angle) - dx * np.sin(angle)
    clear = np.abs(place - change) > 6.0
    np.testing.assert_array_equal(arcs.bright_left[clear], ((place < change) == (towards > 0.0))[clear])
    assert arcs.bright_left.mean() > 0.5


def test_a_line_that_light_draws_aside_halfway_is_one_line_and_a_kink_two() -> None:
    y, x = np.mgrid[:100, :240] - 49.5
    for step_aside, count in ((0.3, 1), (1.5, 2)):
        across = y - 0.05 * x - np.clip((x - 70.0) * 0.1, 0.0, step_aside)
        arcs = arcs_of(noisy(60 + 100 * ndtr(across / 0.8), 2.0))
        assert arcs.take(arcs.length > 30).kind.tolist() == [LINE] * count


@pytest.mark.parametrize(("waver", "kind"), [(0.0, CIRCULAR), (0.35, LINE)])
def test_an_edge_that_wavers_as_much_as_it_bows_is_no_curve(waver: float, kind: int) -> None:
    y, x = np.mgrid[:100, :200] - np.array([49.5, 99.5])[:, None, None]
    polyline = 1.1 * (1 - (x / 100.0) ** 2) + waver * np.sin(x / 6.0)
    arcs = arcs_of(noisy(60 + 100 * ndtr((y - polyline) / 0.8), 2.0))
    assert set(arcs.kind.tolist()) == {kind}
    assert arcs.length.sum() > 150


@pytest.mark.parametrize(("angle", "minor"), [(0.4, 33), (2.4, 10)])
def test_a_tilted_hole_is_one_closed_ellipse(angle: float, minor: float) -> None:
    """However slender: its sharp ends are drawn inwards most, and turn most where they are shortest."""
    image = 220 - _ellipse((74.2, 71.8), (48, minor), angle, 150)
    arcs = arcs_of(noisy(image, 3.0))
    arcs = arcs.take(arcs.length > 20)
    assert arcs.kind.tolist() == [ELLIPTIC]
    assert arcs.closed.all()
    assert (arcs.centre_x[0], arcs.centre_y[0]) == pytest.approx((74.2, 71.8), abs=0.05)
    assert (arcs.radius[0], arcs.radius2[0]) == pytest.approx((48, minor), abs=0.1)
    assert abs(np.sin(arcs.axis_angle[0] - angle)) < 0.005
    # its ends lie on it
    u, v = arcs.start_x[0] - 74.2, arcs.start_y[0] - 71.8
    along, across = u * np.cos(angle) + v * np.sin(angle), v * np.cos(angle) - u * np.sin(angle)
    assert (along / 48) ** 2 + (across / minor) ** 2 == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize("radius", [3.0, 6.0])
def test_small_discs_are_as_large_as_they_are(radius: float) -> None:
    found = []
    for seed in range(8):
        cx, cy = 32.0 + np.random.default_rng(seed).uniform(-0.5, 0.5, 2)
        arcs = extract(noisy(disc(cx, cy, radius, (64, 64)), 4.0, seed)).arcs
        assert arcs.kind.tolist() == [CIRCULAR]
        error = np.array([arcs.centre_x[0] - cx, arcs.centre_y[0] - cy, arcs.radius[0] - radius])
        found.append((*error, error @ np.linalg.solve(arcs.covariance[0, :3, :3], error) / 3))
    assert abs(np.mean(found, axis=0)[2]) < 0.02
    assert np.mean(found, axis=0)[3] < 2.0


def test_a_circular_arc_that_lost_its_bow_is_a_line() -> None:
    """Eight elements on a vertical line, as trimming may leave them, determine no circle; nor do they spoil others."""
    edges = detect_edges(step(0.0, 0.25, (40, 40)))
    rows = np.flatnonzero(np.abs(edges.x - 19.75) < 0.1).astype(np.int32)[10:18]
    arcs = measure_arcs(
        edges,
        Chains(rows, np.array([0, 8], np.int32), np.zeros(1, bool)),
        np.array([CIRCULAR], np.int32),
        np.zeros(len(edges), bool),
        scale=1.4,
    )
    assert arcs.kind.tolist() == [LINE]
    assert np.isfinite([arcs.start_x, arcs.end_y, arcs.length, arcs.sigma]).all()
    assert np.isfinite(arcs.x).all()


@pytest.mark.parametrize("shape", ["line", "circle", "ellipse"])
def test_parameters_scatter_as_their_covariance_says(shape: str) -> None:
    """Over 24 draws of noise the deviation from the truth, measured by the covariance, is chi-square distributed."""
    clean, truth = _known(shape)
    squares = []
    for seed in range(24):
        arcs = arcs_of(noisy(clean, 6.0, seed))
        at = int(np.argmax(arcs.length))
        if shape == "line":
            middle = np.array([arcs.start_x[at] + arcs.end_x[at], arcs.start_y[at] + arcs.end_y[at]]) / 2
            normal = np.array([-arcs.direction[at, 1], arcs.direction[at, 0]])
            # the middle of a line is fixed along it, so only offset and angle are open
            found = np.array([(middle - truth[:2]) @ normal, np.arctan2(*arcs.direction[at, ::-1]) - truth[2]])
            found[1] = np.arctan(np.tan(found[1]))
        else:
            names = ("centre_x", "centre_y", "radius", "radius2", "axis_angle")[: len(truth)]
            found = np.array([getattr(arcs, name)[at] for name in names]) - truth
        covariance = arcs.covariance[at, : len(found), : len(found)]
        squares.append(found @ np.linalg.solve(covariance, found) / len(found))
    assert 0.5 < np.median(squares) / 0.8 < 2.0


def _known(shape: str) -> tuple[Floats, Floats]:
    if shape == "line":
        return step(0.4, 0.0, (91, 91)), np.array([45.0, 45.0, 0.4 + np.pi / 2])
    if shape == "circle":
        return disc(60.3, 58.8, 30.0, (120, 120)), np.array([60.3, 58.8, 30.0])
    return 220 - _ellipse((64.2, 61.8), (48, 33), 0.4, 130), np.array([64.2, 61.8, 48.0, 33.0, 0.4])


def _ellipse(centre: tuple[float, float], axes: tuple[float, float], angle: float, size: int) -> Floats:
    """A bright ellipse (160 on 60), drawn six times as large, blurred there, and averaged over the pixels."""
    times = 6
    y, x = (np.mgrid[: times * size, : times * size] - (times - 1) / 2) / times
    u = (x - centre[0]) * np.cos(angle) + (y - centre[1]) * np.sin(angle)
    v = (y - centre[1]) * np.cos(angle) - (x - centre[0]) * np.sin(angle)
    inside = gaussian_filter(((u / axes[0]) ** 2 + (v / axes[1]) ** 2 < 1).astype(float), 0.7 * times)
    return np.asarray(60 + 100 * inside.reshape(size, times, size, times).mean(axis=(1, 3)))
