"""Boxes, cylinders and spheres against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from relmodel.readers import urdf

CASES = {
    "box": (urdf.box((30, 50, 110)), 30 * 50 * 110, 2 * (30 * 50 + 50 * 110 + 30 * 110)),
    "cylinder": (urdf.cylinder(40, 25), np.pi * 1600 * 25, 2 * np.pi * 1600 + 80 * np.pi * 25),
    "sphere": (urdf.sphere(75), 4 / 3 * np.pi * 75**3, 4 * np.pi * 75**2),
}


@pytest.mark.parametrize("name", CASES)
def test_areas_and_volume(name: str) -> None:
    shape, volume, area = CASES[name]
    assert shape.volume == pytest.approx(volume, rel=1e-12)
    assert shape.surfaces["area"].sum() == pytest.approx(area, rel=3e-3)
    assert shape.findings == ()


@pytest.mark.parametrize("name", CASES)
def test_surfaces_and_arcs_are_those_of_the_primitive(name: str) -> None:
    shape = CASES[name][0]
    kinds = {"box": ["plane"] * 6, "cylinder": ["cylinder", "plane", "plane"], "sphere": ["sphere"]}[name]
    assert sorted(shape.surfaces["kind"]) == kinds
    assert max(shape.surfaces["residual"]) < 1e-9
    radius = {"box": [], "cylinder": [40], "sphere": [75]}[name]
    assert shape.surfaces["radius"][np.isfinite(shape.surfaces["radius"])] == pytest.approx(radius, abs=1e-9)
    arcs = {"box": ["line"] * 12, "cylinder": ["circle"] * 2, "sphere": []}[name]
    assert list(shape.arcs.get("kind", [])) == arcs
    assert set(shape.arcs.get("convexity", [])) <= {"convex"}
    radii = np.asarray(shape.arcs.get("radius", []), float)
    assert radii[np.isfinite(radii)] == pytest.approx({"cylinder": [40, 40]}.get(name, []))


@pytest.mark.parametrize("name", CASES)
def test_mesh_lies_on_the_shape_and_faces_outwards(name: str) -> None:
    shape, volume, _ = CASES[name]
    mesh = shape.mesh
    corner = mesh.vertices[mesh.triangles]
    inside = np.einsum("nd,nd->n", corner[:, 0], np.cross(corner[:, 1], corner[:, 2])).sum() / 6
    assert 0.985 * volume < inside <= volume * (1 + 1e-12)
    flat = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    assert np.all(np.einsum("nd,nkd->nk", flat, mesh.normals[mesh.triangles]) > 0)
    middles = np.concatenate([corner.mean(axis=1), *(corner[:, [i, i - 1]].mean(axis=1) for i in range(3))])
    if name == "sphere":
        assert np.linalg.norm(mesh.vertices, axis=1) == pytest.approx(75)
        assert 75 - np.linalg.norm(middles, axis=1).min() <= mesh.deviation_mm + 1e-9 < 4 * mesh.chord_mm
    if name == "cylinder":
        rim = np.abs(mesh.normals[mesh.triangles][:, :, 2]).max(axis=1) < 0.5
        middles = np.concatenate([corner[rim][:, [i, i - 1]].mean(axis=1) for i in range(3)])
        assert 40 - np.linalg.norm(middles[:, :2], axis=1).min() == pytest.approx(mesh.deviation_mm)
    assert sorted(set(mesh.triangle_surfaces.tolist())) == list(range(len(shape.surfaces["kind"])))
