"""Circles in space of one picture's ellipses against circles that were projected, and their join against loops."""

from __future__ import annotations

from itertools import permutations
from math import acos, hypot
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from relmodel.arrays import Columns, Floats
from relmodel.features.holes import CIRCLE_DEFAULTS as CIRCLES
from relmodel.features.holes import classify
from relmodel.geometry.transforms import rotation_matrix
from relmodel.store import Store
from tests.vision.constellations.test_join import OBJECT, circles, keep, moved
from vision.cameras.cameras import Camera
from vision.constellations.constellation_parameters import EllipseParameters, OnePictureParameters
from vision.constellations.elements import Circles, PictureEllipses, find_circles, find_ellipses
from vision.constellations.find_poses import join_ellipses
from vision.extraction.arcs import ELLIPTIC
from vision.extraction.rows import Primitives

MATRIX = np.array([[1500.0, 0, 640], [0, 1510.0, 480], [0, 0, 1]])
CAMERA = Camera(1280, 960, MATRIX)
BENT = Camera(1280, 960, MATRIX, np.array([-0.2, 0.08, 0.001, -0.0005, 0.0]))


def before_the_camera(count: int, seed: int) -> Circles:
    """Circles that face a camera at its place, at all angles up to 75 degrees."""
    rng = np.random.default_rng(seed)
    columns = [rng.uniform(*bounds, count) for bounds in ((-200, 200), (-150, 150), (600, 900))]
    centre = np.column_stack(columns)
    normal = rng.normal(size=(count, 3))
    ray = centre / np.linalg.norm(centre, axis=1, keepdims=True)
    normal -= np.einsum("ij,ij->i", normal, ray)[:, None] * ray
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    lean = rng.uniform(0.1, 1.3, count)[:, None]
    return Circles.exact(centre, np.sin(lean) * normal - np.cos(lean) * ray, rng.uniform(8, 40, count))


def draw(c: Circles, camera: Camera, count: int = 120) -> Floats:
    """Pixels (n, count, 2) around circles."""
    across = np.cross(c.normal, [0.3, -0.5, 0.8])
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    t = np.linspace(0, 2 * np.pi, count, endpoint=False)[:, None, None]
    points = c.centre + c.radius[:, None] * (np.cos(t) * across + np.sin(t) * np.cross(c.normal, across))
    pixels, front = camera.project(points.reshape(-1, 3))
    assert front.all()
    return pixels.reshape(count, len(c), 2).transpose(1, 0, 2)


def picture_of(c: Circles, camera: Camera) -> Primitives:
    """What an extraction of these circles would say that `find_ellipses` asks."""
    pixels = draw(c, camera)
    step = np.linalg.norm(np.diff(pixels, axis=1, append=pixels[:, :1]), axis=2)
    place, count = pixels.reshape(-1, 2), pixels.shape[1]
    offsets = np.arange(len(c) + 1) * count
    arcs = SimpleNamespace(kind=np.full(len(c), ELLIPTIC), length=step.sum(axis=1), offsets=offsets)
    return cast(Primitives, SimpleNamespace(arcs=arcs, elements=SimpleNamespace(x=place[:, 0], y=place[:, 1])))


def ellipses_of(c: Circles, camera: Camera = CAMERA) -> tuple[PictureEllipses, list[int]]:
    """The ellipses of circles, and the circle of each: the one whose centre's image is nearest."""
    found = find_ellipses(picture_of(c, camera), camera, EllipseParameters(same_px=0.0, same_share=0.0))
    middle = c.centre @ MATRIX.T
    apart = np.linalg.norm(found.centre[:, None] - middle[:, :2] / middle[:, 2:], axis=2)
    return found, apart.argmin(axis=1).tolist()


@pytest.mark.parametrize("camera", [CAMERA, BENT], ids=["pinhole", "distorted"])
def test_one_of_two_circles_is_the_one_that_was_seen(camera: Camera) -> None:
    true = before_the_camera(25, 1)
    found, of = ellipses_of(true, camera)
    assert sorted(of) == list(range(25))
    centre, normal = find_circles(found, camera)
    radius = true.radius[of]
    off = np.linalg.norm(centre * radius[:, None, None] - true.centre[of][:, None], axis=2)
    turned = np.linalg.norm(normal - true.normal[of][:, None], axis=2)
    way = off.argmin(axis=1)
    rows = np.arange(len(of))
    assert off[rows, way].max() < 1e-3
    assert turned[rows, way].max() < 1e-4
    # The other is seen as the same ellipse: so are points around it.
    other = Circles.exact(centre[rows, 1 - way], normal[rows, 1 - way], np.ones(len(of)))
    seen = np.concatenate([draw(other, CAMERA), np.ones((len(of), 120, 1))], axis=2)
    level = np.einsum("nki,nij,nkj->nk", seen, found.conics, seen)
    assert np.abs(level).max() < 1e-6


def seen_circles(model: Circles) -> Columns:
    """Columns of `seen_circle`: each circle of a scene at its radius and, wrongly, with another normal."""
    rng = np.random.default_rng(7)
    wrong = model.normal + rng.normal(0, 0.5, model.normal.shape)
    normal = np.stack([model.normal, wrong / np.linalg.norm(wrong, axis=1, keepdims=True)], axis=1).reshape(-1, 3)
    normal *= -np.sign(np.einsum("ij,ij->i", normal, np.repeat(model.centre, 2, axis=0)))[:, None]
    centre = np.repeat(model.centre / model.radius[:, None], 2, axis=0)
    number = np.arange(len(normal))
    return {
        "unit": number, "ellipse_no": number // 2, **dict(zip("xyz", centre.T, strict=True)),
        **dict(zip(("nx", "ny", "nz"), normal.T, strict=True)),
        "size_share": rng.uniform(0.002, 0.02, len(number)), "tilt": rng.uniform(0.02, 0.2, len(number)),
    }  # fmt: skip


def join_by_loops(model: Circles, seen: Columns, p: OnePictureParameters) -> set[tuple[int, int, int, int]]:
    """What the query gives, where nothing is thinned: every pair of units with every class of the object."""
    relations, circles = classify(model.centre, model.normal, model.radius)
    columns = {name: np.asarray(values, np.float32).astype(float) for name, values in relations.items()}
    sizes = np.rint(columns["radius_a"] / p.radius_step), np.rint(columns["radius_b"] / p.radius_step)
    radii = {
        size: tuple(np.mean(columns[f"radius_{n}"][(sizes[0] == size[0]) & (sizes[1] == size[1])]) for n in "ab")
        for size in set(zip(*(s.tolist() for s in sizes), strict=True))
    }
    unit = np.stack([np.asarray(seen[n]) for n in "xyz"], axis=1)
    normal = np.stack([np.asarray(seen[n]) for n in ("nx", "ny", "nz")], axis=1)
    share, tilt, of = (np.asarray(seen[n]).tolist() for n in ("size_share", "tilt", "ellipse_no"))

    def angle(u: Floats, v: Floats) -> float:
        return acos(min(abs(float(u @ v)), 1.0))

    found = set()
    for a, b in permutations(range(len(unit)), 2):
        for size, (r_a, r_b) in radii.items():
            here, there = r_a * unit[a], r_b * unit[b]
            line = there - here
            distance = float(np.linalg.norm(line))
            if of[a] == of[b] or not CIRCLES.least_distance <= distance <= CIRCLES.greatest_distance:
                continue
            line /= distance
            rises = angle(normal[a], line), angle(normal[b], line)
            if abs(normal[a] @ line) > p.along:
                continue
            off = hypot(here @ line * share[a], there @ line * share[b])
            off = min(p.most_mm, p.distance_mm + p.distance_share * distance + off)
            turn = p.turn + hypot(np.linalg.norm(here) * share[a], np.linalg.norm(there) * share[b]) / distance
            rows = (sizes[0] == size[0]) & (sizes[1] == size[1]) & (np.abs(columns["distance"] - distance) <= off)
            for k in np.flatnonzero(rows & (columns["rise_a"] <= p.along)).tolist():
                lean, rise_a, rise_b = (acos(min(columns[n][k], 1.0)) for n in ("normals", "rise_a", "rise_b"))
                if (
                    abs(lean - angle(normal[a], normal[b])) <= hypot(tilt[a], tilt[b])
                    and abs(rise_a - rises[0]) <= turn + tilt[a]
                    and abs(rise_b - rises[1]) <= turn + tilt[b]
                ):
                    which = zip(*np.split(circles[k], 2), strict=True)
                    found |= {(a, b, int(c), int(d)) for c, d in which}
    return found


def test_the_join_finds_what_loops_find(fresh_store: str) -> None:
    model = circles(14, 1)
    scene = moved(model, rotation_matrix(np.array([0.3, -0.2, 0.5])), np.array([10.0, 20.0, 700.0]))
    seen, p = seen_circles(scene), OnePictureParameters(most=10**6, most_of_relation=10**6)
    with Store.open(fresh_store) as store:
        keep(store, model)
        with store.read() as connection:
            joined = join_ellipses(store, connection, OBJECT, seen, p)
            few = join_ellipses(store, connection, OBJECT, seen, OnePictureParameters(most=40, most_of_relation=1))
    rows = set(map(tuple, np.hstack([joined.scene, joined.model]).tolist()))
    assert len(rows) == len(joined.alike)
    assert rows == join_by_loops(model, seen, p)
    assert {(2 * i, 2 * j, i, j) for i, j in permutations(range(14), 2)} & rows
    assert 0 < len(few.alike) <= 40
    assert (np.diff(few.alike) >= 0).all()
    assert few.alike.max() <= np.median(joined.alike), "the rarest"
