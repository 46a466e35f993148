"""Meshes whose bodies are closed though their triangles say so only in a roundabout way; volumes by closed forms."""

from __future__ import annotations

from collections import Counter
from itertools import pairwise

import numpy as np
import pytest
import trimesh

from relmodel.arrays import Floats, Ints
from relmodel.model.model import Shape
from relmodel.readers.mesh.shape import shape_from_triangles


def shape_of(vertices: Floats, triangles: Ints, *, fit: bool = True) -> Shape:
    shape = shape_from_triangles(np.asarray(vertices, float), np.asarray(triangles, np.int64), fit=fit)
    assert shape is not None
    return shape


def with_slivers(mesh: trimesh.Trimesh, most: int, seed: int) -> tuple[Floats, Ints]:
    """The triangle on one side of some edges is cut at up to `most` points of the edge, the one on the other is not;
    triangles without area, cut at random and facing either way, fill the gap."""
    rng = np.random.default_rng(seed)
    vertices = np.asarray(mesh.vertices, float).tolist()
    triangles = [tuple(t) for t in np.asarray(mesh.faces).tolist()]
    for n in rng.permutation(len(triangles)).tolist()[::2]:
        a, b, apex = np.roll(triangles[n], rng.integers(3)).tolist()
        at = np.sort(rng.uniform(0.05, 0.95, rng.integers(1, most + 1)))
        chain = [a, *range(len(vertices), len(vertices) + len(at)), b]
        vertices += [(np.array(vertices[a]) * (1 - t) + np.array(vertices[b]) * t).tolist() for t in at]
        triangles[n] = (chain[0], chain[1], apex)
        triangles += [(p, q, apex) for p, q in pairwise(chain[1:])]
        while len(chain) > 2:
            i = int(rng.integers(1, len(chain) - 1))
            sliver = tuple(chain[i - 1 : i + 2])
            triangles.append(sliver if rng.random() < 0.3 else sliver[::-1])
            del chain[i]
    return np.array(vertices), rng.permutation(np.array(triangles))


@pytest.mark.parametrize("fit", [True, False])
@pytest.mark.parametrize(("most", "turned"), [(1, False), (5, False), (5, True)])
def test_slivers_keep_a_body_closed(most: int, turned: bool, fit: bool) -> None:
    """A box has its volume, six planes and twelve edges wherever slivers lie on them, and lies as it likes."""
    box = trimesh.creation.box((10, 20, 30))
    if turned:
        box.apply_transform(trimesh.transformations.random_rotation_matrix(np.array([0.3, 0.6, 0.1])))
        box.apply_translation([40, -70, 20])
    for seed in range(2):
        shape = shape_of(*with_slivers(box, most, seed), fit=fit)
        assert shape.volume == pytest.approx(6000, rel=1e-6)
        assert not shape.findings
        assert len(shape.surfaces["kind"]) == 6
        assert Counter(shape.arcs["convexity"]) == {"convex": 12}
        a, b, c = (shape.mesh.vertices[shape.mesh.triangles[:, i]] for i in range(3))
        assert np.linalg.norm(np.cross(b - a, c - a), axis=1).min() > 1e-3


def test_a_hole_is_not_closed_by_slivers_elsewhere() -> None:
    vertices, triangles = with_slivers(trimesh.creation.box((10, 20, 30)), 2, 1)
    a, b, c = (vertices[triangles[:, i]] for i in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    shape = shape_of(vertices, np.delete(triangles, np.argmax(area), axis=0))
    assert shape.volume is None
    assert [f.kind for f in shape.findings] == ["open_mesh"]


def cube(x: float, y: float, z: float, mirror: bool = False) -> trimesh.Trimesh:
    """Of 10 mm; a mirrored one's diagonals run the other way, as those of a neighbour along x do."""
    mesh = trimesh.creation.box((10, 10, 10))
    mesh.apply_transform(np.diag([-1.0 if mirror else 1.0, 1, 1, 1]))
    mesh.apply_translation([x, y, z])
    return mesh


TOUCHING = {
    "at a vertex": [cube(0, 0, 0), cube(10, 10, 10)],
    "along an edge": [cube(0, 0, 0), cube(10, 10, 0)],
    "along three edges": [cube(0, 0, 0), cube(10, 10, 0), cube(0, 10, 10), cube(10, 0, 10)],
    "at a face, cut alike": [cube(0, 0, 0), cube(10, 0, 0, mirror=True)],
    "at a face, cut otherwise": [cube(0, 0, 0), cube(10, 0, 0)],
    "four in a ring": [cube(0, 0, 0), cube(10, 0, 0, True), cube(0, 10, 0), cube(10, 10, 0)],
    "within a face": [cube(0, 0, 0), trimesh.creation.box(bounds=[(-1, -1, 5), (1, 1, 255)])],
}


@pytest.mark.parametrize("fit", [True, False])
@pytest.mark.parametrize("name", list(TOUCHING))
def test_bodies_that_touch_have_a_volume(name: str, fit: bool) -> None:
    mesh = trimesh.util.concatenate(TOUCHING[name])
    shape = shape_of(mesh.vertices, mesh.faces, fit=fit)
    assert shape.volume == pytest.approx(1000 * len(mesh.faces) / 12)
    assert not shape.findings


def test_the_wall_between_bodies_that_touch_is_no_surface() -> None:
    mesh = trimesh.util.concatenate(TOUCHING["at a face, cut alike"])
    shape = shape_of(mesh.vertices, mesh.faces)
    assert sorted(shape.surfaces["area"]) == pytest.approx([100, 100, 200, 200, 200, 200])
    assert Counter(shape.arcs["convexity"]) == {"convex": 12}


def test_a_sheet_given_from_both_sides_stays_an_open_sheet() -> None:
    """Alone, or as a fin on a body, of which nothing is lost."""
    sheet = trimesh.Trimesh([[5, 5, -5], [5, 5, 5], [20, 20, 5], [20, 20, -5]], [[0, 1, 2], [0, 2, 3]], process=False)
    both = trimesh.util.concatenate([sheet, trimesh.Trimesh(sheet.vertices, sheet.faces[:, ::-1], process=False)])
    for others, area in (([], 0.0), ([cube(0, 0, 0)], 600.0)):
        mesh = trimesh.util.concatenate([both, *others])
        shape = shape_of(mesh.vertices, mesh.faces)
        assert shape.volume is None
        assert shape.surfaces["area"].sum() == pytest.approx(area + sheet.area)


def test_a_body_given_from_both_sides_or_twice_is_one_body() -> None:
    inner = cube(0, 0, 0)
    inner.faces = inner.faces[:, ::-1]
    for again in (inner, cube(0, 0, 0)):
        mesh = trimesh.util.concatenate([cube(0, 0, 0), again, cube(50, 0, 0)])
        assert shape_of(mesh.vertices, mesh.faces).volume == pytest.approx(2000)
