"""What a valid picture can be: edges of any radius, length, lens and noise are found where they were drawn."""

from __future__ import annotations

import numpy as np
import pytest

from vision.extraction import arcs as module
from vision.extraction.arcs import CIRCULAR, LINE, Arcs
from vision.extraction.chains import Chains
from vision.extraction.edges import EdgeElements
from vision.extraction.extract import extract
from vision.extraction.fits import compute_curvature_bias
from vision.extraction.junctions import snap_polylines
from vision.extraction.rows import make_rows
from vision.extraction.segmentation import fit_arcs

pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")

RADII = (3.0, 1e3, 1e7, np.inf)


def are_whole(arcs: Arcs) -> bool:
    return bool(arcs.is_finite.all() and np.isfinite(arcs.significance).all())


@pytest.mark.parametrize("half_spread", [1.0, 40.0])
def test_the_bias_of_a_curve_goes_to_its_limit(half_spread: float) -> None:
    """Large circles are drawn inwards by half the variance over the radius; how few px small ones are is unknown."""
    radius = np.geomspace(1e-3, 1e15, 400)
    bias = compute_curvature_bias(radius, np.full(400, half_spread))
    assert np.isfinite(bias).all()
    assert (bias >= 0).all()
    large = radius > 100 * np.sqrt(half_spread)
    off = np.abs(bias - half_spread / radius)[large]
    assert (off <= 2e-3 * half_spread / radius[large] + 4 * np.spacing(radius[large])).all()


@pytest.mark.parametrize("radius", RADII)
def test_edge_elements_of_any_radius_length_and_noise_give_arcs_that_lie_on_them(radius: float) -> None:
    rng = np.random.default_rng(7)
    for length in (12, 700, 3000):
        for noise in (0.0, 0.5):
            turn = np.arange(min(length, int(min(2 * np.pi * radius, 1e9)))) / radius
            along = np.arange(len(turn), dtype=float) if np.isinf(radius) else radius * np.sin(turn)
            away = 0 * along if np.isinf(radius) else 2 * radius * np.sin(0.5 * turn) ** 2
            if len(along) < 12:
                continue
            off = rng.normal(0, noise, len(along))
            nx, ny = -np.sin(turn), np.cos(turn)
            each = np.ones(len(along))
            edges = EdgeElements(
                along + off * nx, away + off * ny, nx, ny, 100 * each, 0.8 * each, max(noise, 0.02) * each,
                np.arange(len(along), dtype=np.int32),
            )  # fmt: skip
            chains = Chains(edges.pixel, np.array([0, len(along)], np.int32), np.zeros(1, bool))
            arcs = fit_arcs(edges, chains, scale=1.4)
            assert arcs.is_finite.all()
            assert len(arcs) > 0
            if noise < 0.5 and length >= 60:
                on = np.isin(arcs.kind, (LINE, CIRCULAR))
                assert np.max(arcs.residual[on], initial=0.0) < 3 * noise + 0.3


@pytest.mark.parametrize("shape", [(1, 1), (1, 300), (300, 1), (11, 200), (12, 12), (13, 40)])
def test_pictures_of_any_shape_and_what_they_may_show(shape: tuple[int, int]) -> None:
    row, column = np.indices(shape)
    shown = [
        np.zeros(shape), np.full(shape, 255.0), 255.0 * ((row + column) % 2), 255.0 * (column > shape[1] // 2),
        255.0 * (row > shape[0] // 2), np.random.default_rng(0).uniform(0, 255, shape), row * 1e-3,
    ]  # fmt: skip
    for number, picture in enumerate(shown):
        found = extract(picture)
        make_rows(found)
        assert are_whole(found.arcs)
        if number < 2:  # nothing: one region, and no arc, junction or mark
            assert found.regions.area.tolist() == [picture.size]
            quality = found.quality
            assert len(found.arcs) + len(quality.texture) + len(quality.highlight) + len(found.junctions) == 0
            assert snap_polylines(found.arcs, found.junctions)[1].tolist() == [0]


def test_an_arc_without_numbers_is_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever fit fails: the others stay as they are."""
    y, x = np.mgrid[:160, :320].astype(float)
    disc = np.clip(30.5 - np.hypot(x - 60, y - 80), 0, 1) + np.clip(x - 200.3, 0, 1)
    whole = extract(60 + 100 * disc).arcs
    monkeypatch.setattr(module, "compute_curvature_bias", lambda radius, spread: np.full(len(radius), np.nan))
    found = extract(60 + 100 * disc)
    make_rows(found)
    assert (whole.kind == CIRCULAR).any()
    assert not (found.arcs.kind == CIRCULAR).any()
    assert are_whole(found.arcs)
    straight = whole.kind == LINE
    assert straight.any()
    np.testing.assert_array_equal(found.arcs.start_x, whole.start_x[straight])
