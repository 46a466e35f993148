"""One table of volumes with the parts that meet each, by hand: every form of the volume predicate must give it.

The parts are two cubes of 10 mm: `a` about the origin, and `b` about (100, 0, 0), turned by 45 degrees about z, so that
its world box reaches 7.07 mm from its middle in x and y and its corners lie on the axes.  A box asked meets the world
boxes; every other volume is compared with the placed cubes themselves."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from relmodel.find.volumes import Box, Frustum, OrientedBox, Polyhedron, Sphere, Volume
from relmodel.store import Store
from tests.poses import pose_of
from tests.reading import load
from tests.synthetic_model import place_things

HALF, FAR = 5.0, 100.0
CORNER = HALF * 2**0.5  # how far the turned cube reaches in x and y

URDF = """<robot name="cube"><link name="cube"><visual><geometry><box size="0.01 0.01 0.01"/></geometry></visual></link>
</robot>"""


def _view(near: float, far: float, *, below: float = 50) -> Frustum:
    """A camera below the origin that looks up; it sees as wide as far: 50 mm about the origin from 50 mm below."""
    matrix = np.array([[101, 0, 50], [0, 101, 50], [0, 0, 1]], float)
    return Frustum(101, 101, matrix, pose_of((0, 0, -below)), near, far)


def _half_spaces(*rows: tuple[float, float, float, float]) -> Polyhedron:
    """Half-spaces within a large cube about everything."""
    cube = [(s * (i == 0), s * (i == 1), s * (i == 2), 1000.0) for i in range(3) for s in (-1.0, 1.0)]
    return Polyhedron([*cube, *rows])


# What the case shows, the volume, and which parts meet it.
CASES: list[tuple[str, Volume, str]] = [
    ("a box about both", Box(-50, -50, -50, 150, 50, 50), "ab"),
    ("a box inside one", Box(-1, -1, -1, 1, 1, 1), "a"),
    ("a box that touches a face", Box(HALF, -1, -1, 9, 1, 1), "a"),
    ("a box that touches a corner", Box(HALF, HALF, HALF, 9, 9, 9), "a"),
    ("a box just beyond a face", Box(HALF + 1e-9, -1, -1, 9, 1, 1), ""),
    ("a point on a face", Box(0, 0, HALF, 0, 0, HALF), "a"),
    ("a box between both", Box(20, -50, -50, 80, 50, 50), ""),
    ("a box that meets the world box and not the turned cube", Box(FAR + 6, 6, -1, FAR + 9, 9, 1), "b"),
    ("a ball inside one", Sphere(0, 0, 0, 1), "a"),
    ("a ball about one", Sphere(FAR, 0, 0, 50), "b"),
    ("a ball that touches a face", Sphere(HALF + 3, 0, 0, 3), "a"),
    ("a ball just beyond a face", Sphere(HALF + 3, 0, 0, 3 - 1e-9), ""),
    ("a ball beyond an edge, within its bounds", Sphere(HALF + 3, HALF + 3, 0, 4.2), ""),
    ("a ball that reaches an edge", Sphere(HALF + 3, HALF + 3, 0, 4.3), "a"),
    ("a ball in the world box, beside the turned cube", Sphere(FAR + 6.5, 6.5, 0, 3), ""),
    ("a ball of no radius, inside", Sphere(FAR, 1, 1, 0), "b"),
    ("a turned box that its face separates", OrientedBox(pose_of((9, 9, 0), (0, 0, np.pi / 4)), np.full(3, 5.0)), ""),
    ("a turned box that cuts an edge", OrientedBox(pose_of((8, 8, 0), (0, 0, np.pi / 4)), np.full(3, 5.0)), "a"),
    (
        "a box turned as the cube, beside it",
        OrientedBox(pose_of((FAR + 9, 9, 0), (0, 0, np.pi / 4)), np.full(3, 5.0)),
        "",
    ),
    ("a half-space beyond the turned face", _half_spaces((-1.0, -1.0, 0.0, -(FAR + CORNER + 1e-6))), ""),
    ("a half-space that takes in the turned face", _half_spaces((-1.0, -1.0, 0.0, -(FAR + CORNER - 1e-6))), "b"),
    ("a slab through both", _half_spaces((0, 0, 1, 0.5), (0, 0, -1, 0.5)), "ab"),
    ("a camera that sees one", _view(10, 100), "a"),
    ("a camera whose far plane is before it", _view(10, 44.9), ""),
    ("a camera whose far plane cuts it", _view(10, 45.1), "a"),
    ("a camera whose near plane is behind it", _view(55.1, 100), ""),
    ("a camera whose near plane cuts it", _view(54.9, 100), "a"),
    ("a camera far enough for both", _view(10, 1000, below=400), "ab"),
    ("a camera too near for the other", _view(10, 1000, below=150), "a"),
]


def fill(store: Store, folder: Path) -> None:
    """The world of the two cubes."""
    file = folder / "cube.urdf"
    file.write_text(URDF)
    load(store, file, name="cube")
    places = {"a": pose_of((0, 0, 0)), "b": pose_of((FAR, 0, 0), (0, 0, np.pi / 4))}
    place_things(store, folder, places, "cube")


def letters(paths: list[str]) -> str:
    """Which of the parts those paths are."""
    return "".join(sorted(path.split("/")[0] for path in paths))
