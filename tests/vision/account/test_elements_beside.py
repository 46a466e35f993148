"""Elements listed beside predicted edges, against a search through all of them."""

from __future__ import annotations

import numpy as np

from relmodel.arrays import Floats, Ints
from vision.account.account_parameters import SampleParameters, SupportParameters
from vision.account.samples import Nearby, Samples, find_nearby, measure_support
from vision.localisation.hypotheses import EdgePoints
from vision.localisation.measurements import EdgeIndex

P = SampleParameters()


def unit(angle: Floats) -> Floats:
    return np.stack([np.cos(angle), np.sin(angle)], axis=1)


def edge_points(position: Floats, normal: Floats, contrast: float = 40.0) -> EdgePoints:
    n = len(position)
    bounds = np.zeros(2), np.full(2, 200.0)
    return EdgePoints(position, normal, np.full(n, contrast), np.full(n, 0.1), *bounds, 200.0)


def samples_at(pixel: Floats, direction: Floats, surface: Ints, arc: Ints) -> Samples:
    n = len(pixel)
    return Samples(
        camera=np.zeros(n, np.int64),
        run=arc,
        view_run=arc,
        kind=np.zeros(n, np.int8),
        arc=arc,
        surface=surface,
        kin=surface,
        point=np.zeros((n, 3)),
        pixel=pixel,
        direction=direction,
        normal=np.tile([1.0, 0.0, 0.0], (n, 2, 1)),
        px_per_mm=np.ones((n, 2)),
        length_px=np.ones(n),
        front=np.full(n, 2),
        inside=np.ones(n, bool),
    )


def test_all_elements_along_the_normals_are_listed_and_no_others() -> None:
    rng = np.random.default_rng(3)
    index = EdgeIndex(edge_points(rng.uniform(0, 200, (4000, 2)), unit(rng.uniform(0, 2 * np.pi, 4000))))
    pixel = np.concatenate([rng.uniform(-5, 205, (150, 2)), np.full((4, 2), 100.0)])
    angle = np.concatenate([rng.uniform(0, 2 * np.pi, 150), np.pi / 2 * np.arange(4)])
    direction = unit(angle)
    found = find_nearby(np.zeros(len(pixel), np.int64), pixel, direction, [index], np.zeros(1), P)
    edges = index.edges
    for k in range(len(pixel)):
        normal = np.array([-direction[k, 1], direction[k, 0]])
        way = edges.position - pixel[k]
        near = (np.abs(way @ direction[k]) <= P.max_along_px) & (np.abs(way @ normal) <= P.reach_px)
        near &= np.abs(edges.normal @ normal) >= P.min_cosine
        mine = slice(found.first[k], found.first[k + 1])
        assert sorted(found.element[mine]) == np.flatnonzero(near).tolist()
        assert np.allclose(np.sort(found.offset[mine]), np.sort((way @ normal)[near]))


def test_the_camera_s_response_is_taken_off() -> None:
    """An edge that is brighter below is seen too high, toward its dark side."""
    at = np.array([[50.0, 49.9]])
    index = EdgeIndex(edge_points(at, np.array([[0.0, 1.0]]), contrast=100.0))
    there, along = np.array([[50.0, 50.0]]), np.array([[1.0, 0.0]])
    found = find_nearby(np.zeros(1, np.int64), there, along, [index], np.array([0.2]), P)
    assert np.allclose(found.offset, 0.0)


def two_lines(apart: float, surfaces: tuple[tuple[int, int], tuple[int, int]]) -> tuple[Samples, Nearby]:
    """Two parallel predicted lines, `apart` px, with elements along the first alone."""
    x = np.arange(20.0, 180.0)
    first, second = (np.stack([x, np.full(len(x), y)], axis=1) for y in (100.0, 100.0 + apart))
    arc = np.repeat([0, 1], len(x))
    surface = np.repeat(np.array(surfaces), len(x), axis=0)
    samples = samples_at(np.concatenate([first, second]), np.tile([1.0, 0.0], (2 * len(x), 1)), surface, arc)
    index = EdgeIndex(edge_points(first + np.array([0.0, 0.1]), np.tile([0.0, 1.0], (len(x), 1))))
    return samples, find_nearby(samples.camera, samples.pixel, samples.direction, [index], np.zeros(1), P)


def test_an_element_supports_the_nearer_of_two_edges_alone() -> None:
    p = SupportParameters(crowded_px=1.0)
    samples, nearby = two_lines(1.8, ((0, 1), (2, 3)))
    assert measure_support(samples, nearby, p).found.tolist() == [True] * 160 + [False] * 160
    assert measure_support(*two_lines(1.8, ((0, 1), (1, 2))), p).found.all(), "edges of one surface share"
    assert measure_support(*two_lines(0.3, ((0, 1), (2, 3))), p).found.all(), "edges that coincide share"


def test_edges_that_cannot_be_told_apart_do_not_count() -> None:
    p = SupportParameters()
    assert not measure_support(*two_lines(2.5, ((0, 1), (2, 3))), p).weight.any()
    assert measure_support(*two_lines(6.0, ((0, 1), (2, 3))), p).weight.all()


def test_chance_is_what_lies_beside_off_the_predicted_edges() -> None:
    samples, nearby = two_lines(10.0, ((0, 1), (2, 3)))
    support = measure_support(samples, nearby, SupportParameters())
    assert not support.chance.any(), "what the first line accounts for is no chance beside the second"
