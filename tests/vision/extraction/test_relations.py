"""Relations and the fused pass on a picture of known layout: a bright ring of two squares, and a disc."""

from collections import Counter, defaultdict
from itertools import product
from typing import cast

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from relmodel.arrays import Floats, Ints32
from relmodel.errors import InputError, UsageError
from tests.vision.extraction.synthetic import arcs_with, render
from vision.extraction.arcs import CIRCULAR, ELLIPTIC, LINE, Arcs
from vision.extraction.edges import EdgeElements
from vision.extraction.extract import Extraction, extract
from vision.extraction.extraction_parameters import (
    EdgeParameters,
    ExtractionParameters,
    RegionParameters,
    UnitParameters,
)
from vision.extraction.junctions import Junctions
from vision.extraction.regions import Regions
from vision.extraction.relations import find_region_arcs, pack_curves, relate_neighbours
from vision.extraction.topography import ArcQuality
from vision.relations.relations import ADJACENT, BOUNDS, NEAR, SURROUNDS, Middles


def square(half: float) -> Floats:
    """Bright inside an axis-parallel square about (100, 100) of half side `half`."""
    return render(lambda x, y: half - np.maximum(np.abs(x - 100), np.abs(y - 100)), (200, 200), 0.7, 0, 1)


@pytest.fixture(scope="module")
def ring() -> Extraction:
    """Grey 60 outside, 180 between squares of half sides 70 and 30, 100 inside."""
    image = 60 + 120 * square(70.2) - 80 * square(30.1) + np.random.default_rng(10).normal(0, 2, (200, 200))
    return extract(np.clip(np.round(image), 0, 255).astype(np.uint8))


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


def _arcs_on(labels: Ints32, seed: int) -> tuple[EdgeElements, Arcs]:
    """Elements about a label image in arcs of any length, on either side of which the bright side is."""
    rng = np.random.default_rng(seed)
    counts = np.array([30, 4, 60, 12, 7, 100])
    n, (rows, columns) = int(counts.sum()), labels.shape
    place, turn = rng.uniform(-0.5, [columns - 0.5, rows - 0.5], (n + 5, 2)), rng.uniform(-np.pi, np.pi, n + 5)
    place[:30] = np.array([12.2, 9.1]) + rng.uniform(-1, 1, (30, 2))
    one = np.ones(n + 5)
    edges = EdgeElements(
        place[:, 0], place[:, 1], np.cos(turn), np.sin(turn), one, one, one, np.arange(n + 5, dtype=np.int32)
    )
    elements = rng.permutation(n + 5)[:n].astype(np.int32)
    elements[:30] = np.arange(30)
    offsets = np.concatenate([[0], np.cumsum(counts)])
    return edges, arcs_with(
        6, elements=elements, bright_left=rng.random(n) < 0.6, offsets=offsets, closed=np.zeros(6, bool),
        length=rng.uniform(5, 90, 6),
    )  # fmt: skip


def test_arcs_bound_what_enough_of_their_elements_see() -> None:
    labels = np.kron(np.random.default_rng(1).integers(-1, 6, (5, 6)), np.ones((6, 7), int)).astype(np.int32)
    edges, arcs = _arcs_on(labels, 2)
    p, expected = UnitParameters(), []
    for k in range(6):
        own, seen = slice(arcs.offsets[k], arcs.offsets[k + 1]), Counter[tuple[int, int]]()
        for e, bright_left in zip(arcs.elements[own], arcs.bright_left[own], strict=True):
            for side in (0, 1):
                sign = 1 if bright_left == (side == 0) else -1
                x = np.rint(edges.x[e] + sign * p.region_distance * edges.nx[e])
                y = np.rint(edges.y[e] + sign * p.region_distance * edges.ny[e])
                label = labels[int(np.clip(y, 0, 29)), int(np.clip(x, 0, 41))]
                seen[side, int(label)] += label >= 0
        members = int(arcs.offsets[k + 1] - arcs.offsets[k])
        for (side, label), number in sorted(seen.items()):
            if number > 0 and (number >= p.min_border_elements or number >= p.min_border_share * members):
                expected.append((k, label, side, pytest.approx(number * arcs.length[k] / members)))
    found = find_region_arcs(edges, arcs, cast(Regions, _Labels(labels)), p)
    assert sorted(zip(found.arc, found.region, found.side, found.length, strict=True)) == sorted(expected)
    assert len(expected) > 20


class _Labels:
    def __init__(self, labels: Ints32) -> None:
        self.labels = labels

    def __len__(self) -> int:
        return int(self.labels.max()) + 1


def test_neighbours_and_what_lies_within_what() -> None:
    """Rings and a disc in the middle of a frame, two parts in a hole, another that touches the rim."""
    labels = np.zeros((40, 60), np.int32)
    labels[5:30, 5:30], labels[10:25, 10:25], labels[12:16, 12:16] = 1, 2, 3
    labels[8:20, 38:44], labels[8:20, 44:52] = 4, 5  # two beside each other: neither lies within the other
    labels[34:, 50:] = 6
    labels[20:23, 12:20] = 7
    inside = np.array([False, True, True, True, True, True, False, True])
    middles = Middles(np.arange(18.0) ** 2, np.arange(18.0)[::-1] * 3, np.ones(18))
    p, step = UnitParameters(), 1.5
    adjacent, surrounds = relate_neighbours(labels, inside, 10, middles, p, step)
    rows = {(a - 10, b - 10): d for a, b, d in zip(adjacent.a, adjacent.b, adjacent.distance, strict=True)}
    crossed: defaultdict[tuple[int, int], float] = defaultdict(float)
    weigh = {(0, 1): 1.0, (1, 0): 1.0, (1, 1): 0.5**0.5, (1, -1): 0.5**0.5}
    for (r, c), ((dr, dc), weight) in product(np.ndindex(40, 60), weigh.items()):
        if r + dr < 40 and 0 <= c + dc < 60 and labels[r, c] != labels[r + dr, c + dc]:
            for one, other in ((labels[r, c], labels[r + dr, c + dc]), (labels[r + dr, c + dc], labels[r, c])):
                crossed[int(one), int(other)] += weight
    sides = {(0, 1), (1, 2), (2, 3), (2, 7), (0, 4), (0, 5), (4, 5), (0, 6)}
    expected = {key: step * np.pi / 8 * crossed[key] for key in sides | {(b, a) for a, b in sides}}
    assert rows == pytest.approx(expected)
    np.testing.assert_allclose(adjacent.distance_sigma, np.hypot(p.border_sigma, p.slant_sigma * adjacent.distance))
    held = {(a - 10, b - 10): d for a, b, d in zip(surrounds.a, surrounds.b, surrounds.distance, strict=True)}
    assert held == pytest.approx({key: expected[key] for key in ((0, 1), (1, 2), (2, 3), (2, 7))})
    np.testing.assert_allclose(surrounds.distance_sigma, np.hypot(p.border_sigma, p.slant_sigma * surrounds.distance))
    assert set(surrounds.kind) == {SURROUNDS}
    for found in (adjacent, surrounds):
        towards = np.arctan2(middles.y[found.b] - middles.y[found.a], middles.x[found.b] - middles.x[found.a])
        np.testing.assert_allclose(np.cos(found.angle - towards), 1.0)


def test_arcs_as_relations_see_them() -> None:
    """Lines by their ends, others by every fourth point and the last; salience by length and doubt."""
    counts, kinds = [9, 9, 10, 2], np.array([LINE, CIRCULAR, ELLIPTIC, CIRCULAR])
    x = np.arange(30.0) ** 1.5
    covariance = np.arange(4 * 64.0).reshape(4, 8, 8) + 1
    own = {"kind": kinds, "x": x, "y": -x, "point_sigma": 0 * x, "covariance": covariance, "closed": kinds == ELLIPTIC}
    own |= {name: np.arange(4) + 10.0 * i for i, name in enumerate(
        ("start_x", "start_y", "end_x", "end_y", "centre_x", "centre_y", "radius", "length", "sigma", "angle_sigma")
    )}  # fmt: skip
    offsets = np.concatenate([[0], np.cumsum(counts)])
    arcs = arcs_with(4, **own, offsets=offsets)
    f, i, what = np.zeros(0), np.zeros(0, np.int32), np.zeros(0, np.int8)
    none = Junctions(f, f, np.zeros((0, 2, 2)), what, i, i, what, f, f)
    texture, p = np.array([0.0, 0.5, 1.0, 0.2]), UnitParameters()
    found = pack_curves(arcs, none, ArcQuality(texture, texture), ExtractionParameters())
    kept = [[0, 8], [9, 13, 17], [18, 22, 26, 27], [28, 29]]
    assert found.offsets.tolist() == [0, 2, 5, 9, 11]
    for column, sign, first, last in ((found.x, 1, 0.0, 20.0), (found.y, -1, 10.0, 30.0)):
        np.testing.assert_allclose(column[:2], [first, last])
        np.testing.assert_allclose(column[2:], sign * x[np.concatenate(kept[1:])])
    np.testing.assert_allclose(found.salience, (70 + np.arange(4)) * (1 - 0.95 * texture) ** 3)
    np.testing.assert_allclose(found.end_sigma, [p.end_sigma, p.end_sigma, 0, p.end_sigma])
    np.testing.assert_allclose(found.centre_sigma**2, (covariance[:, 0, 0] + covariance[:, 1, 1]) / 2)
    np.testing.assert_allclose(found.radius, [np.nan, 61, np.nan, 63])
    np.testing.assert_allclose(found.radius_sigma**2, covariance[:, 2, 2])
    np.testing.assert_allclose([found.sigma, found.angle_sigma, found.centre_y], own["sigma"] + [[0], [10], [-30]])
