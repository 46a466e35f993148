"""Relations and the fused pass on a picture of known layout: a bright ring of two squares, and a disc."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from relmodel.arrays import Floats
from relmodel.errors import InputError, UsageError
from tests.vision.extraction.synthetic import render
from vision.extraction.arcs import LINE
from vision.extraction.extract import Extraction, extract
from vision.extraction.extraction_parameters import EdgeParameters, ExtractionParameters, RegionParameters
from vision.relations.relations import ADJACENT, BOUNDS, NEAR, SURROUNDS


def square(half: float) -> Floats:
    """Bright inside an axis-parallel square about (100, 100) of half side `half`."""
    return render(lambda x, y: half - np.maximum(np.abs(x - 100), np.abs(y - 100)), (200, 200), 0.7, 0, 1)


@pytest.fixture(scope="module")
def ring() -> Extraction:
    """Grey 60 outside, 180 between squares of half sides 70 and 30, 100 inside."""
    image = 60 + 120 * square(70.2) - 80 * square(30.1) + np.random.default_rng(10).normal(0, 2, (200, 200))
    return extract(np.clip(np.round(image), 0, 255).astype(np.uint8))


def test_bounds_say_which_side(ring: Extraction) -> None:
    labels = ring.regions.labels
    outside, between, inside = labels[10, 10], labels[100, 50], labels[100, 100]
    borders, long = ring.region_arcs, np.flatnonzero(ring.arcs.length > 40)
    assert (len(ring.regions), len(long)) == (3, 8)
    for arc in long:
        rows = borders.arc == arc
        beyond = inside if ring.arcs.length[arc] < 100 else outside
        assert dict(zip(borders.side[rows], borders.region[rows], strict=True)) == {0: between, 1: beyond}
        np.testing.assert_allclose(borders.length[rows], ring.arcs.length[arc], rtol=0.1)


def test_adjacent_regions_share_the_perimeter(ring: Extraction) -> None:
    labels, found, first = ring.regions.labels, ring.relations, len(ring.arcs)
    rows = found.kind == ADJACENT
    pairs = {
        (a - first, b - first): v for a, b, v in zip(found.a[rows], found.b[rows], found.distance[rows], strict=True)
    }
    outside, between, inside = labels[10, 10], labels[100, 50], labels[100, 100]
    assert set(pairs) == {(outside, between), (between, outside), (between, inside), (inside, between)}
    # squares along the pixels are what four directions misjudge most
    assert pairs[inside, between] == pytest.approx(4 * 60.2, rel=0.07)
    assert pairs[outside, between] == pytest.approx(4 * 140.4, rel=0.07)


@pytest.mark.parametrize("turn", [0.0, 0.4])
def test_borders_are_as_long_as_they_are_however_they_run(turn: float) -> None:
    def inside(x: Floats, y: Floats) -> Floats:
        u, v = (x - 80) * np.cos(turn) + (y - 80) * np.sin(turn), (y - 80) * np.cos(turn) - (x - 80) * np.sin(turn)
        return np.asarray(np.minimum(40 - np.abs(u), 25 - np.abs(v)))

    found = extract(render(inside, (160, 160), 0.7, 60, 160) + np.random.default_rng(1).normal(0, 3, (160, 160)))
    first, related = len(found.arcs), found.relations
    adjacent = related.kind == ADJACENT
    assert len(found.regions) == 2
    assert np.abs(related.distance[adjacent] - 260).max() < 3 * related.distance_sigma[adjacent].min()
    assert related.distance[adjacent] == pytest.approx(260, rel=0.08)
    bounds = (related.kind == BOUNDS) & (related.a < first)
    lengths = found.arcs.length[related.a[bounds]]
    assert np.abs(related.distance[bounds] - lengths).max() < 2 * related.distance_sigma[bounds].min()


def test_the_sides_of_a_line_whose_bright_side_changes() -> None:
    left = np.arange(200) < 120
    image = np.where(np.arange(80)[:, None] < 40, 110.0, np.where(left, 40.0, 180.0))
    found = extract(gaussian_filter(image, 0.8))
    lines = np.flatnonzero((found.arcs.kind == LINE) & (np.abs(found.arcs.direction[:, 0]) > 0.99))
    assert len(lines) == 1
    # most of it is bright above, so that it is walked to the right
    assert found.arcs.direction[lines[0], 0] > 0.99
    borders = found.region_arcs
    mine = borders.arc == lines[0]
    above = found.regions.labels[20, 20]
    for region, side in zip(borders.region[mine], borders.side[mine], strict=True):
        assert side == (0 if region == above else 1)
    assert set(borders.region[mine]) == {above, found.regions.labels[60, 20], found.regions.labels[60, 180]}


def test_equal_input_gives_equal_columns(ring: Extraction) -> None:
    image = np.random.default_rng(3).normal(100, 4, (80, 90)) + 80 * (np.arange(90) > 40)
    first, second = extract(image), extract(image)
    for table in ("edges", "arcs", "regions", "relations", "region_arcs"):
        for name, column in vars(getattr(first, table)).items():
            np.testing.assert_array_equal(column, getattr(getattr(second, table), name))


def test_plain_regions_by_name_and_unknown_names_refused(ring: Extraction) -> None:
    image = 60 + 120 * square(70.2)
    assert len(extract(image, ExtractionParameters(regions=RegionParameters(kind="plain"))).regions) == 2
    with pytest.raises(UsageError, match="leak-proof or plain"):
        RegionParameters(kind="round")


def test_bearings_point_from_one_to_the_other(ring: Extraction) -> None:
    found, first = ring.relations, len(ring.arcs)
    x = np.concatenate([(ring.arcs.start_x + ring.arcs.end_x) / 2, ring.regions.centroid_x])
    y = np.concatenate([(ring.arcs.start_y + ring.arcs.end_y) / 2, ring.regions.centroid_y])
    whole = np.append(ring.arcs.length > 40, np.ones(len(ring.regions), bool))
    for kind in (NEAR, BOUNDS):
        rows = (found.kind == kind) & whole[found.a] & whole[found.b]
        a, b = found.a[rows], found.b[rows]
        apart = np.hypot(x[b] - x[a], y[b] - y[a])
        far = apart > 10  # the centres of the ring and of the square in it are one
        error = found.angle[rows] - np.arctan2(y[b] - y[a], x[b] - x[a])
        assert far.any()
        assert np.abs(np.sin(error / 2))[far].max() < 0.01
        assert np.any(b >= first)


def test_what_lies_in_a_hole_is_surrounded(ring: Extraction) -> None:
    labels, found, first = ring.regions.labels, ring.relations, len(ring.arcs)
    outside, between, inside = labels[10, 10], labels[100, 50], labels[100, 100]
    rows = found.kind == SURROUNDS
    held = zip(found.a[rows] - first, found.b[rows] - first, strict=True)
    assert set(held) == {(outside, between), (between, inside)}


@pytest.mark.parametrize("kind", [np.float64, list])
def test_masks_of_any_numbers_look_where_they_are_not_zero(kind: type) -> None:
    picture = np.clip(np.round(60 + 120 * square(70.2)), 0, 255)
    mask = np.zeros((200, 200), np.bool_)
    mask[10:120] = True
    whole = extract(picture, mask=mask)
    given = (255 * mask).tolist() if kind is list else (255 * mask).astype(kind)
    found = extract(picture, mask=given)
    assert len(found.arcs) == 3
    assert found.parameters == whole.parameters
    np.testing.assert_array_equal(found.arcs.x, whole.arcs.x)
    np.testing.assert_array_equal(found.regions.labels, whole.regions.labels)


def test_masks_of_another_shape_and_parameters_that_are_none_are_refused() -> None:
    for mask in (np.ones((20, 30), np.bool_), np.ones((20, 20, 3), np.bool_), np.ones(20, np.bool_)):
        with pytest.raises(InputError, match="same size"):
            extract(np.zeros((20, 20)), mask=mask)
    with pytest.raises(UsageError, match=r"edges\.min_contrast is nan"):
        ExtractionParameters(edges=EdgeParameters(min_contrast=float("nan")))
    for significance in (0.0, -1.0, 2.0):
        with pytest.raises(UsageError, match="not a probability"):
            EdgeParameters(significance=significance)
    with pytest.raises(UsageError, match="outside"):
        extract(np.zeros((20, 20)), ExtractionParameters(edges=EdgeParameters(scale=0.5)))
