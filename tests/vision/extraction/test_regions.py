"""Regions against known layouts."""

from collections import Counter
from collections.abc import Callable
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
import scipy.ndimage
from scipy.ndimage import gaussian_filter

from relmodel.arrays import Bools, Floats, Floats32, Ints, Ints32
from tests.vision.extraction.synthetic import linked, render
from vision.extraction import region_kernels
from vision.extraction.arcs import LINE, Arcs
from vision.extraction.chains import label_components
from vision.extraction.edges import EdgeElements, detect_edges
from vision.extraction.extract import extract
from vision.extraction.extraction_parameters import RegionParameters
from vision.extraction.junctions import find_junctions
from vision.extraction.regions import (
    ASLANT,
    STRIPS,
    contract,
    draw_edge_mask,
    find_components,
    find_leak_proof_regions,
    find_lonely,
    find_meetings,
    find_near_loose_ends,
    find_plain_regions,
    renumber_regions,
    share_out,
    sum_borders,
    sum_regions,
    trap,
)
from vision.extraction.segmentation import fit_arcs
from vision.extraction.topography import LABELS


def frame(gap: int) -> tuple[Floats, Bools]:
    """120 x 160, parted at column 80 by a wall of edge pixels with a hole of `gap` px; the right is brighter."""
    mask = np.zeros((120, 160), np.bool_)
    mask[:, 80] = True
    mask[60 : 60 + gap, 80] = False
    grey = np.where(np.arange(160) < 80, 60.0, 120.0) * np.ones((120, 1))
    return grey, mask


def test_the_plain_step_leaks_and_the_default_does_not() -> None:
    grey, mask = frame(6)
    assert len(find_plain_regions(grey, mask)) == 1
    regions = find_leak_proof_regions(grey, mask)
    assert len(regions) == 2
    left = regions.labels[10, 10]
    assert (regions.labels == left)[:, :78].mean() > 0.999
    assert not (regions.labels == left)[:, 83:].any()


def test_one_surface_crossed_by_a_stray_edge_stays_one() -> None:
    mask = np.zeros((120, 160), np.bool_)
    mask[30:70, 80] = True
    assert len(find_leak_proof_regions(np.full((120, 160), 90.0), mask)) == 1


def test_attributes_of_a_rectangle_on_a_grey_plane() -> None:
    mask = np.zeros((100, 140), np.bool_)
    mask[20, 30:91] = mask[70, 30:91] = mask[20:71, 30] = mask[20:71, 90] = True
    y, x = np.mgrid[:100, :140].astype(float)
    grey = 50 + 0.5 * x - 0.25 * y
    grey[30:35, 40:50] = 255.0
    regions = find_plain_regions(grey, mask)
    inner = regions.labels[40, 60]
    assert len(regions) == 2
    assert regions.area[inner] == 59 * 49
    assert (regions.centroid_x[inner], regions.centroid_y[inner]) == (60, 45)
    assert (regions.x0[inner], regions.y0[inner], regions.x1[inner], regions.y1[inner]) == (31, 21, 89, 69)
    assert regions.mean[inner] == pytest.approx(grey[21:70, 31:90].mean())
    assert regions.saturated_share[inner] == pytest.approx(50 / (59 * 49))
    window = grey[21:70, 31:90].ravel()
    design = np.column_stack([np.ones(window.size), x[21:70, 31:90].ravel(), y[21:70, 31:90].ravel()])
    plane, residue, *_ = np.linalg.lstsq(design, window, rcond=None)
    np.testing.assert_allclose([regions.slope_x[inner], regions.slope_y[inner]], plane[1:], atol=1e-9)
    assert regions.variance[inner] == pytest.approx(residue[0] / window.size)
    assert np.bincount(regions.ring_region)[1 - inner] == 2
    ring = np.flatnonzero(regions.ring_region == inner)[0]
    vertices = slice(regions.ring_offsets[ring], regions.ring_offsets[ring + 1])
    outline = set(zip(regions.outline_x[vertices], regions.outline_y[vertices], strict=True))
    assert outline == {(31, 21), (89, 21), (89, 69), (31, 69)}


def _overlap(labels: Ints32, truth: Ints) -> Floats:
    """(true regions,): the intersection of each with the region that fits it best over their union."""
    shared = np.zeros((truth.max() + 1, labels.max() + 1))
    np.add.at(shared, (truth, labels), 1.0)
    union = shared.sum(axis=1, keepdims=True) + shared.sum(axis=0) - shared
    return np.asarray((shared / union).max(axis=1))


def _drawn(truth: Callable[[Floats, Floats], Ints], greys: list[float], seed: int) -> tuple[Floats, Ints]:
    """160 x 160 of regions `truth(x, y)`, drawn five times as large, blurred there, noise 3; and where they are."""
    times, n = 5, 160
    x, y = np.meshgrid(*2 * [(np.arange(times * n) - (times - 1) / 2) / times])
    fine = gaussian_filter(np.asarray(greys)[truth(x, y)], 0.7 * times)
    grey = fine.reshape(n, times, n, times).mean(axis=(1, 3))
    x, y = np.meshgrid(np.arange(float(n)), np.arange(float(n)))
    return grey + np.random.default_rng(seed).normal(0, 3, grey.shape), truth(x, y)


@pytest.mark.parametrize("turn", [0.0, 0.5, 2.1])
def test_a_plate_with_holes_is_one_region_whatever_its_necks(turn: float) -> None:
    def truth(x: Floats, y: Floats) -> Ints:
        u, v = (x - 80) * np.cos(turn) + (y - 80) * np.sin(turn), (y - 80) * np.cos(turn) - (x - 80) * np.sin(turn)
        parts = [np.hypot(u + 25, v + 3) < 18, np.hypot(u - 25, v) < 9, np.hypot(u - 25, v) < 18]
        parts.append((np.abs(u) < 55) & (np.abs(v) < 35))
        return np.asarray(np.select(parts, [1, 2, 3, 4], 0))

    grey, where = _drawn(truth, [60.0, 40.0, 200.0, 100.0, 150.0], int(100 * turn))
    regions = extract(grey).regions
    assert len(regions) == 5
    assert _overlap(regions.labels, where).min() > 0.93  # of a ring 9 px wide; a pixel in its rims is 0.01
    assert (_overlap(regions.labels, where) > 0.98).sum() >= 2


def test_holes_part_nothing_though_they_leave_but_necks() -> None:
    """Two holes above each other: the halves of what is around them meet in three necks of 9 to 19 px."""
    y, x = np.mgrid[:120, :160]
    mask = np.zeros((120, 160), np.bool_)
    for middle in (30, 90):
        away = np.hypot(x - 80, y - middle)
        mask |= (away < 20.5) & (away > 19.0)
    regions = find_leak_proof_regions(np.full((120, 160), 90.0), mask)
    assert len(regions) == 3
    assert regions.labels[60, 5] == regions.labels[60, 155]
    # an edge that ends is another matter: what it leaves open may be a gap in it
    mask[:11, 80] = mask[50:55, 80] = mask[66:71, 80] = mask[109:, 80] = True
    assert len(find_leak_proof_regions(np.full((120, 160), 90.0), mask)) == 4


def test_edge_pixels_go_to_the_side_that_they_lie_on() -> None:
    grey, where = _drawn(
        lambda x, y: (np.hypot(x - 80.3, y - 79.8)[..., None] < [60.3, 40.4, 20.2]).sum(axis=-1),
        [60.0, 160.0, 70.0, 150.0],
        1,
    )
    regions = extract(grey).regions
    assert len(regions) == 4
    assert _overlap(regions.labels, where).min() > 0.99


@pytest.mark.parametrize("width", [2.0, 4.0])
def test_a_thin_line_parts_what_lies_on_its_sides(width: float) -> None:
    def distance(x: Floats, y: Floats) -> Floats:
        return np.asarray(0.5 * width - np.abs((x - 80) * np.sin(0.5) - (y - 80) * np.cos(0.5)))

    grey = render(distance, (160, 160), 0.7, 60, 160) + np.random.default_rng(2).normal(0, 3, (160, 160))
    regions = extract(grey).regions
    assert len(regions) == 3
    assert len(np.unique(regions.labels[[20, 80, 140], [20, 80, 140]])) > 1
    assert np.sort(regions.area)[1] > 11_000


def test_a_line_runs_on_to_the_next_edge_where_it_has_no_contrast() -> None:
    y, x = np.mgrid[:120, :120].astype(float)
    fading = 60.0 * np.clip((75.0 - y) / 20.0, 0.0, 1.0)
    image = np.where(y < 100, 90.0 + np.where(x > 60, fading, 0.0), 40.0)
    edges = detect_edges(gaussian_filter(image, 0.8))
    chains = linked(edges, image.shape)
    arcs = fit_arcs(edges, chains, scale=1.4)
    upright = (np.abs(arcs.direction[:, 0]) < 0.1) & (arcs.kind == LINE)
    ahead = slice(78, 96), slice(58, 63)
    for some, reached in ((arcs, True), (arcs.take(~upright), False)):
        mask = draw_edge_mask(edges, chains, some, find_junctions(image, some), image.shape)
        assert (mask[ahead].any(axis=1) == reached).all()


def _corners_shared(labels: Ints32, edge: Bools) -> Counter[tuple[int, int]]:
    """Of pairs of labels: corners at which two of their sides off the edges meet."""
    shared: Counter[tuple[int, int]] = Counter()
    for r, c in np.ndindex(labels.shape[0] - 1, labels.shape[1] - 1):
        four = (r, c), (r, c + 1), (r + 1, c + 1), (r + 1, c)
        sides = zip(four, four[1:] + four[:1], strict=True)
        pairs = Counter(tuple(sorted((labels[p], labels[q]))) for p, q in sides if not (edge[p] or edge[q]))
        shared.update(pair for pair, number in pairs.items() if number > 1)
    return shared


@pytest.mark.parametrize("kinds", [3, 2000])
def test_borders_are_those_of_all_neighbours(kinds: int) -> None:
    rng = np.random.default_rng(4)
    shape = (12, 17) if kinds == 3 else (60, 50)
    labels = rng.integers(-1, kinds, shape).astype(np.int32)
    edge, loose = rng.random(shape) < 0.3, rng.random(shape) < 0.2
    expected: dict[tuple[int, int], Ints] = {}
    for r, c in np.ndindex(shape):
        for down, right in ((0, 1), (1, 0), (1, 1), (1, -1)):
            other = r + down, c + right
            if other[0] == shape[0] or not 0 <= other[1] < shape[1]:
                continue
            pair = min(labels[r, c], labels[other]), max(labels[r, c], labels[other])
            if pair[0] == pair[1] or pair[0] < 0:
                continue
            sums = expected.setdefault(pair, np.zeros(7, np.int64))
            on_edge = edge[r, c] or edge[other]
            sums += [0, 0, 0, 0, 0, 0, 1] if down and right else [
                1, on_edge, c, r, not on_edge, loose[r, c] or loose[other], 0
            ]  # fmt: skip
    for pair, number in _corners_shared(labels, edge).items():
        if pair in expected:
            expected[pair][4] -= number
    a, b, found = sum_borders(labels, edge, loose)
    pairs = list(zip(a.tolist(), b.tolist(), strict=True))
    assert pairs == sorted(pair for pair, sums in expected.items() if sums[0])
    assert all(np.array_equal(sums, expected[pair]) for pair, sums in zip(pairs, found, strict=True))


@pytest.mark.parametrize("share", [0.6, 0.3])
def test_trapped_balls_are_the_connected_parts_that_hold_no_label(share: float) -> None:
    rng = np.random.default_rng(5)
    deep = rng.random((40, 33)) < share
    found = np.where(rng.random((40, 33)) < 0.02, 1, 0).astype(np.int32)
    marked = found > 0
    count = trap(deep, found, 7)
    parts, number = scipy.ndimage.label(deep)
    new = [part for part in range(1, number + 1) if not marked[parts == part].any()]
    assert count == 7 + len(new)
    for part in range(1, number + 1):
        values = set(found[(parts == part) & ~marked].tolist())
        assert len(values) <= 1
        assert values <= ({0} if part not in new else set(range(8, count + 1)))
    assert len({int(found[parts == part][0]) for part in new}) == len(new)
    assert np.all(found[~marked & (parts == 0)] == 0)


def test_an_edge_ends_where_it_runs_on_to_one_place_at_most() -> None:
    ring = np.pad(np.zeros((3, 3), bool), 1, constant_values=True)
    mask = np.random.default_rng(6).random((40, 33)) < 0.12
    framed = np.pad(mask, 2, constant_values=True)
    found = find_near_loose_ends(mask, RegionParameters(loose_end_reach=0))
    for r, c in np.argwhere(mask):
        _, places = scipy.ndimage.label(framed[r : r + 5, c : c + 5] & ring)
        assert found[r, c] == (places < 2)
    assert not found[~mask].any()
    assert 20 < found.sum() < mask.sum() - 20


def test_sums_of_regions_are_those_of_their_pixels() -> None:
    rng = np.random.default_rng(0)
    labels = np.repeat(rng.integers(-1, 5, (11, 6)), 3, axis=1).astype(np.int32)
    grey, depth = rng.uniform(0, 255, labels.shape), rng.uniform(0, 9, labels.shape).astype(np.float32)
    grey[3, 4] = 250.0
    out = np.zeros((5, 16))
    out[:, 11:13] = 1e9
    region_kernels.sums(labels, grey, depth, 250.0, out)
    for label in range(5):
        y, x = np.nonzero(labels == label)
        g = grey[y, x]
        sums = [np.ones(len(x)), x, y, x * x, x * y, y * y, g, g * g, x * g, y * g, g >= 250]
        ends = [x.min(), y.min(), x.max(), y.max(), depth[y, x].max()]
        np.testing.assert_allclose(out[label], [*(np.sum(v) for v in sums), *ends])


def test_elements_beside_are_those_of_like_turn_and_no_fainter() -> None:
    """Cells in a row, four turns, five grades; those up to two grades fainter count."""
    rng = np.random.default_rng(1)
    cell, turn, grade = rng.integers(1, 7, 80), rng.integers(0, 4, 80), rng.integers(0, 5, 80)
    alike = (np.add.outer(np.arange(4), [-1, 0, 1]).ravel() % 4 * 5).astype(np.int64)
    which, out = np.arange(0, 80, 3).astype(np.int32), np.zeros(27)
    region_kernels.parallels(
        (cell * 20).astype(np.int32), (turn * 5 + grade).astype(np.int32), np.array([-20, 0, 20]), alike, 5, which, 2,
        np.zeros(8 * 20, np.uint8), out,
    )  # fmt: skip
    for at, i in enumerate(which):
        near = (np.abs(cell - cell[i]) <= 1) & np.isin((turn - turn[i]) % 4, [0, 1, 3]) & (grade >= grade[i] - 2)
        assert out[at] == near.sum()


@pytest.mark.parametrize("noise", [0.0, 2.0])
def test_labels_are_those_of_the_extrema_along_the_axes_of_bending(noise: float) -> None:
    rng = np.random.default_rng(2)
    n = 1500
    a: Floats32 = (rng.normal(size=(10, n)) * np.array([100, 1.2, 1, 0.1, 1.2, 1, 0.1, 1, 0.1, 0.1])[:, None]).astype(
        np.float32
    )
    a[[2, 5, 7], : n // 3] *= 0.05
    a[[1, 4], : n // 6] *= 0.1
    labels, ridges = np.zeros(n, np.uint8), np.zeros((5, n), np.float32)
    region_kernels.classify(a, np.full(n, noise, np.float32), 0.6, 0.4, 0.5, 0.35, labels, ridges)
    steep, bend = max(0.6, 0.4 * noise), max(0.5, 0.35 * noise)
    checked: dict[str, int] = dict.fromkeys(LABELS, 0)
    for i in range(n):
        _, a01, a02, a03, a10, a11, a12, a20, a21, a30 = a[:, i].astype(float)
        values, axes = np.linalg.eigh(np.array([[2 * a20, a11], [a11, 2 * a02]]))
        signs, near, rows = [], [abs(np.hypot(a10, a01) - steep)], []
        for second, (r, c) in zip(values, axes.T, strict=True):
            first = a10 * r + a01 * c
            third = 3 * (a30 * r**3 + a21 * r * r * c + a12 * r * c * c + a03 * c**3)
            roots = np.roots([third, second, first])
            reach = 0.5 / max(abs(r), abs(c))
            near.append(abs(abs(second) - bend))
            if np.iscomplex(roots).any():
                continue
            step = float(np.real(roots[np.argmin(np.abs(roots))]))
            there = second + 2 * third * step
            near += [abs(abs(step) - reach), abs(abs(there) - bend)]
            if abs(step) <= reach and abs(there) > bend:
                signs.append(np.sign(there))
                rows.append((step, r, c, there))
        if min(near) < 1e-3 or abs(values[1] - values[0]) < 1e-2:
            continue
        if len(signs) == 2:
            label = "saddle" if signs[0] != signs[1] else "pit" if signs[0] > 0 else "peak"
        elif signs:
            label = "ravine" if signs[0] > 0 else "ridge"
        elif values[1] > bend and values[0] < -bend:
            label = "saddle_hill"
        elif np.abs(values).max() > bend:
            label = "concave" if values[0] < -bend else "convex"
        else:
            label = "slope" if np.hypot(a10, a01) > steep else "flat"
        assert LABELS[labels[i]] == label
        checked[label] += 1
        if label in ("ridge", "ravine"):
            step, r, c, there = rows[0]
            np.testing.assert_allclose(ridges[:2, i], [step * c, step * r], atol=2e-3)
            assert abs(ridges[2, i] * c + ridges[3, i] * r) == pytest.approx(1, abs=1e-4)
            assert ridges[4, i] == pytest.approx(there, abs=5e-3)
    assert min(checked[name] for name in checked if name not in ("inflection",)) > 3


def _mosaic(seed: int) -> tuple[Ints32, Floats, Floats32, Bools, Bools]:
    """Labels in blocks, greys of a plane each, depths about the inradius of a large region, edges and loose ends."""
    rng = np.random.default_rng(seed)
    labels = np.kron(rng.integers(0, 14, (9, 11)), np.ones((5, 5), int)).astype(np.int32)
    labels[::7, ::9] = 14 + np.arange(49).reshape(7, 7)[: len(labels[::7]), : len(labels[0, ::9])]
    y, x = np.indices(labels.shape)
    planes = rng.normal(0, [4.0, 0.1, 0.1], (63, 3))[labels]
    grey = 90 + planes[..., 0] + planes[..., 1] * (x - 27) + planes[..., 2] * (y - 22) + rng.normal(0, 0.5, x.shape)
    depth = rng.uniform(3.0, 9.0, 63).astype(np.float32)[labels]
    return labels, grey, depth, rng.random(x.shape) < rng.uniform(0, 0.7, 63)[labels], rng.random(x.shape) < 0.02


@pytest.mark.parametrize("seed", range(4))
def test_neighbours_merge_as_a_loop_over_all_borders_says(seed: int) -> None:
    labels, grey, depth, edge, loose = _mosaic(seed)
    p = RegionParameters(
        max_edge_share=0.45, min_neck=3.0, min_open_share=0.5, border_ends=(0.5, 4.0)[seed % 2], min_area=20
    )
    count, (rows, columns) = int(labels.max()) + 1, np.mgrid[:45, :55]
    planes = []
    for i in range(count):
        own = labels == i
        design = np.column_stack([np.ones(own.sum()), columns[own], rows[own]])
        planes.append(np.linalg.lstsq(design, grey[own], rcond=None)[0] if own.sum() > 3 else [grey[own].mean(), 0, 0])
    borders = sum_borders(labels, edge, loose)
    totals = sum_regions(grey, labels, depth, p)
    inradius = np.array([depth[labels == i].max() for i in range(count)])
    joined: list[tuple[int, int]] = []
    opens: dict[int, list[tuple[float, int]]] = {i: [] for i in range(count)}
    for a, b, (length, on_edge, x, y, strips, ends, _) in zip(*borders, strict=True):
        here = np.array([1, x / length, y / length])
        step, free = abs(float(here @ planes[a] - here @ planes[b])), length - on_edge
        if min(inradius[a], inradius[b]) >= p.large:
            few = on_edge <= max(p.max_edge_share * length, p.border_ends * strips)
            if few and (free >= p.min_neck * min(inradius[a], inradius[b]) or ends == 0) and step <= p.max_step / 2:
                joined.append((a, b))
        for one, other in ((a, b), (b, a)):
            affinity = free if free >= p.min_open_share * length and step <= p.max_step else 0.0
            affinity += 1e-3 * length * ((labels == one).sum() < p.min_area)
            if inradius[one] < p.large and affinity > 0:
                opens[one].append((-affinity, other))
    chosen = [(one, min(others)[1]) for one, others in opens.items() if others]
    expected = label_components(np.array(joined + chosen), count)
    found = find_components(borders, totals, p)
    assert found is not None
    assert found.tolist() == expected.tolist()
    assert (len(joined) > 0, 1 < found.max() < count - 10) == (True, True)

    merged = found[labels]
    (a, b, sums), regions = contract(borders, totals, found)
    np.testing.assert_allclose(regions, sum_regions(grey, merged, depth, p))
    again = sum_borders(merged, edge, loose)
    assert (a.tolist(), b.tolist()) == (again[0].tolist(), again[1].tolist())
    others = np.isin(np.arange(7), (STRIPS, ASLANT), invert=True)
    np.testing.assert_allclose(sums[:, others], again[2][:, others])
    left = found[borders[0]] != found[borders[1]]
    np.testing.assert_allclose(sums[:, ~others].sum(axis=0), borders[2][left][:, ~others].sum(axis=0))


def test_nothing_merges_that_has_no_border_or_opens_to_nothing() -> None:
    one, p = np.zeros((9, 18), np.int32), RegionParameters()
    two = (one + np.arange(18) // 9).astype(np.int32)
    for labels in (one, two):
        depth, free = np.full(labels.shape, 9.0, np.float32), np.zeros(labels.shape, bool)
        assert (
            find_components(
                sum_borders(labels, free, free), sum_regions(90.0 * np.asarray(labels, float), labels, depth, p), p
            )
            is None
        )


@pytest.mark.parametrize("area", [1, 6, 12])
def test_regions_that_are_large_enough_are_numbered_in_order(area: int) -> None:
    labels = np.random.default_rng(3).integers(-1, 9, (8, 11)).astype(np.int32)
    large = [i for i in range(9) if (labels == i).sum() >= area]
    expected = [[large.index(i) if i in large else -1 for i in row] for row in labels.tolist()]
    assert renumber_regions(labels, area).tolist() == expected


def test_pixels_of_edges_are_shared_out_by_the_side_of_their_centre() -> None:
    rng = np.random.default_rng(7)
    labels = np.kron(rng.integers(0, 5, (9, 8)), np.ones((3, 3), int)).astype(np.int32)
    pixel = np.sort(rng.choice(labels.size, 200, replace=False)).astype(np.int32)
    turn, off = rng.uniform(-np.pi, np.pi, 200), rng.uniform(-0.5, 0.5, (2, 200))
    one = np.ones(200)
    edges = EdgeElements(pixel % 24 + off[0], pixel // 24 + off[1], np.cos(turn), np.sin(turn), one, one, one, pixel)
    p, expected, moved = RegionParameters(), labels.copy(), 0
    for i, (r, c) in enumerate(zip(*np.divmod(pixel, 24), strict=True)):
        normal, place = np.array([np.cos(turn[i]), np.sin(turn[i])]), np.array([edges.x[i], edges.y[i]])
        side = p.edge_distance * np.sign(([c, r] - place) @ normal)
        x, y = np.clip(np.rint(place + side * normal), 0, [23, 26]).astype(int)
        beside = [labels[min(max(r + d, 0), 26), min(max(c + e, 0), 23)] for d, e in ((0, 1), (0, -1), (1, 0), (-1, 0))]
        if labels[y, x] in beside:
            moved += labels[r, c] != labels[y, x]
            expected[r, c] = labels[y, x]
    share_out(labels, edges, p)
    assert labels.tolist() == expected.tolist()
    assert moved > 5


def test_ends_run_on_to_the_first_pixel_of_the_mask_or_the_border() -> None:
    rng = np.random.default_rng(8)
    mask = rng.random((30, 40)) < 0.06
    place, turn = rng.uniform([1, 1], [38, 28], (60, 2)), rng.uniform(-np.pi, np.pi, 60)
    outward, reach = np.column_stack([np.cos(turn), np.sin(turn)]), rng.uniform(1.0, 12.0, 60)
    expected = []
    for at, way, most in zip(place, outward, reach, strict=True):
        for step in range(2, int(most) + 1):
            x, y = np.rint(at + step * way).astype(int)
            if not (0 <= x < 40 and 0 <= y < 30) or mask[y, x]:
                expected.append([at, at + step * way])
                break
    found = find_meetings(mask, place, outward, reach)
    np.testing.assert_allclose(found, expected)
    assert 10 < len(found) < 50
    assert len(find_meetings(mask, place[:0], outward[:0], reach[:0])) == 0


def test_ends_are_lonely_that_have_no_point_of_another_arc_within_reach() -> None:
    rng, p = np.random.default_rng(9), RegionParameters()
    of, pixel = np.repeat(np.arange(12), 5), rng.choice(40 * 50, 60, replace=False)
    place = np.column_stack([pixel % 50, pixel // 50]) + rng.uniform(-0.4, 0.4, (60, 2))
    arcs = cast(Arcs, SimpleNamespace(x=place[:, 0], y=place[:, 1], chains=SimpleNamespace(chain_of_member=of)))
    ends, arc = rng.uniform(-1, [51, 41], (400, 2)), rng.integers(0, 12, 400)
    centre, at = np.rint(ends), np.rint(place)
    inside = np.clip(at, 0, [49, 39])
    expected = [
        not any(o != a and np.hypot(*(q - e)) <= p.meeting for o, q in zip(of, inside, strict=True))
        for a, e in zip(arc, centre, strict=True)
    ]
    assert find_lonely(arcs, ends, arc, (40, 50), p).tolist() == expected
    assert 5 < sum(expected) < 395
