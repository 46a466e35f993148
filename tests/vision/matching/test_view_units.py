"""What a predicted view says of its own circles and surfaces, against what was drawn."""

from __future__ import annotations

import numpy as np

from relmodel.arrays import Floats, Ints
from vision.cameras.cameras import Camera
from vision.localisation.views import ViewArcs, place_points
from vision.localisation.visibility import RayGrid, SurfaceMap, VisibleArcs
from vision.matching import ViewUnits, describe_view

CAMERA = Camera(400, 300, np.array([[500.0, 0, 200], [0, 500, 150], [0, 0, 1]]))


def circle(x: float, y: float, radius: float) -> Floats:
    """Points (n, 2) a px or so apart around a circle."""
    turn = np.linspace(0, 2 * np.pi, int(2 * np.pi * radius), endpoint=False)
    return np.column_stack([x + radius * np.cos(turn), y + radius * np.sin(turn)])


def view(*courses: Floats) -> ViewArcs:
    run: Ints = np.repeat(np.arange(len(courses)), [len(course) for course in courses])
    pixel = np.concatenate(courses)
    ways = [np.roll(course, -1, axis=0) - course for course in courses]
    way = np.concatenate([way / np.linalg.norm(way, axis=1, keepdims=True) for way in ways])
    step = np.concatenate([np.linalg.norm(way, axis=1) for way in ways])
    none, count = np.zeros((len(run), 3)), len(courses)
    numbers = np.arange(count)
    samples = VisibleArcs(
        none, none, run, np.arange(len(run)), np.zeros(len(run), bool), pixel, way, np.ones(len(run)), step, none, none
    )
    return ViewArcs(np.zeros(count, np.int8), numbers, numbers, np.ones(count), samples, run)


def surfaces() -> SurfaceMap:
    """Surface 0 fills the picture but for a square of surface 1; surface 2 lies within that."""
    rows, columns = np.mgrid[0:300:4, 0:400:4].astype(float)
    shown = np.zeros(rows.shape, np.int64)
    shown[20:50, 30:70], shown[30:40, 45:55] = 1, 2
    pixel = np.stack([columns, rows], axis=2)
    directions = np.zeros((*rows.shape, 3))
    return SurfaceMap(CAMERA, RayGrid(directions, pixel, np.full(rows.shape, 16.0), CAMERA.matrix, 4), shown)


def described() -> ViewUnits:
    straight = np.column_stack([np.arange(20.0, 380.0), np.full(360, 290.0)])
    arcs = view(circle(200, 150, 40), circle(203, 154, 60), circle(330, 150, 41), straight)
    return describe_view(arcs, place_points(arcs, np.full((len(arcs.run), 6), 0.01), CAMERA), surfaces())


def rows_of(units: ViewUnits) -> dict[tuple[str, int, int], float]:
    """Distance of each relation by kind and units."""
    kind, a, b, distance = (
        np.asarray(units.relations[name]).tolist() for name in ("kind", "unit_a", "unit_b", "distance")
    )
    return dict(zip(zip(kind, a, b, strict=True), map(float, distance), strict=True))


def test_circles_of_a_view_have_centres_and_radii() -> None:
    rows = rows_of(described())
    concentric = {key[1:]: value for key, value in rows.items() if key[0] == "concentric"}
    assert set(concentric) == {(0, 1), (1, 0)}
    np.testing.assert_allclose(concentric[0, 1], 5.0, atol=0.02)
    equal = {key[1:]: value for key, value in rows.items() if key[0] == "equal_radius"}
    assert set(equal) == {(0, 2), (2, 0)}
    np.testing.assert_allclose(equal[0, 2], 1.0, atol=0.02)


def test_surfaces_of_a_view_border_on_and_surround_each_other() -> None:
    units = described()
    rows = {(kind, a - units.arcs, b - units.arcs): value for (kind, a, b), value in rows_of(units).items()}
    assert {key[1:] for key in rows if key[0] == "adjacent"} == {(0, 1), (1, 0), (1, 2), (2, 1)}
    assert {key[1:] for key in rows if key[0] == "surrounds"} == {(0, 1), (1, 2)}
    np.testing.assert_allclose(rows["adjacent", 1, 2], 160.0, rtol=0.1)  # ten cells of 4 px on each side
