"""Boxes, cylinders and spheres against closed forms."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pytest

from relmodel.readers.urdf import primitive


@dataclass(frozen=True)
class Case:
    sizes: list[float]
    volume: float
    area: float
    surfaces: list[str]
    arcs: list[str]
    radii: list[float] = field(default_factory=list)  # of its surface, and of its arcs


CASES = {
    "box": Case([30, 50, 110], 165_000, 20_600, ["plane"] * 6, ["line"] * 12),
    "cylinder": Case([40, 25], 4e4 * np.pi, 5200 * np.pi, ["cylinder", *["plane"] * 2], ["circle"] * 2, [40] * 3),
    "sphere": Case([30], 36_000 * np.pi, 3_600 * np.pi, ["sphere"], [], [30]),
}


@pytest.mark.parametrize("name", CASES)
def test_rows_and_triangles_are_those_of_the_primitive(name: str) -> None:
    case = CASES[name]
    shape = primitive(name, *case.sizes)
    mesh = shape.mesh
    assert shape.volume == pytest.approx(case.volume, rel=1e-12)
    assert shape.surfaces["area"].sum() == pytest.approx(case.area, rel=3e-3)
    assert not shape.findings
    assert (sorted(shape.surfaces["kind"]), list(shape.arcs.get("kind", []))) == (case.surfaces, case.arcs)
    assert max(shape.surfaces["residual"]) < 1e-9
    assert set(shape.arcs.get("convexity", [])) <= {"convex"}
    radii = np.concatenate([np.asarray(rows.get("radius", []), float) for rows in (shape.surfaces, shape.arcs)])
    assert radii[np.isfinite(radii)] == pytest.approx(case.radii, abs=1e-9)

    # Triangles lie on the shape and face outwards.
    corner = mesh.vertices[mesh.triangles]
    inside = np.einsum("nd,nd->n", corner[:, 0], np.cross(corner[:, 1], corner[:, 2])).sum() / 6
    assert 0.985 * case.volume < inside <= case.volume * (1 + 1e-12)
    flat = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    assert np.all(np.einsum("nd,nkd->nk", flat, mesh.normals[mesh.triangles]) > 0)
    if name == "sphere":
        middles = np.concatenate([corner.mean(axis=1), *(corner[:, [i, i - 1]].mean(axis=1) for i in range(3))])
        assert np.linalg.norm(mesh.vertices, axis=1) == pytest.approx(30)
        assert 30 - np.linalg.norm(middles, axis=1).min() <= mesh.deviation_mm + 1e-9 < 4 * mesh.chord_mm
    if name == "cylinder":
        rim = np.abs(mesh.normals[mesh.triangles][:, :, 2]).max(axis=1) < 0.5
        middles = np.concatenate([corner[rim][:, [i, i - 1]].mean(axis=1) for i in range(3)])
        assert 40 - np.linalg.norm(middles[:, :2], axis=1).min() == pytest.approx(mesh.deviation_mm)
    assert sorted(set(mesh.triangle_surfaces.tolist())) == list(range(len(shape.surfaces["kind"])))
