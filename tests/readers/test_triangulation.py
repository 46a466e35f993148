"""Triangles of shapes against exact geometry and each other, and what is measured on them against the kernel."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from OCP.BRep import BRep_Tool
from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut, BRepAlgoAPI_Fuse
from OCP.BRepBuilderAPI import BRepBuilderAPI_GTransform
from OCP.BRepPrimAPI import (
    BRepPrimAPI_MakeBox,
    BRepPrimAPI_MakeCone,
    BRepPrimAPI_MakeCylinder,
    BRepPrimAPI_MakeSphere,
    BRepPrimAPI_MakeTorus,
)
from OCP.GeomAPI import GeomAPI_ProjectPointOnSurf
from OCP.gp import gp_Ax2, gp_Dir, gp_GTrsf, gp_Mat, gp_Pnt, gp_XYZ
from OCP.TopoDS import TopoDS
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from relmodel.model.measures import surfaces_of
from relmodel.model.model import Mesh
from relmodel.readers.step import shape as step_shape
from relmodel.readers.step import triangulation
from relmodel.readers.step.faces import face_map
from tests.features.known_parts import Work, bracket, drum


def is_closed(mesh: Mesh) -> bool:
    """Whether each side of a triangle is one of another triangle, run the other way."""
    # Vertices of faces are apart: those at one place are one.
    pairs = cKDTree(mesh.vertices).query_pairs(1e-4, output_type="ndarray")
    count = len(mesh.vertices)
    joined = coo_array((np.ones(len(pairs)), pairs.T), shape=(count, count))
    corner = connected_components(joined, directed=False)[1][mesh.triangles].astype(np.int64)
    corner = corner[(corner != np.roll(corner, 1, axis=1)).all(axis=1)]
    sides = np.stack([corner, np.roll(corner, -1, axis=1)], axis=2).reshape(-1, 2)
    there, back = sides[:, 0] * count + sides[:, 1], sides[:, 1] * count + sides[:, 0]
    return np.array_equal(np.sort(there), np.sort(back))


@pytest.mark.parametrize("make", [bracket, drum])
def test_triangles_of_a_composed_part_meet_and_keep_to_its_surfaces(make: Callable[[], Work]) -> None:
    shape = step_shape.extract(make().body)
    mesh, surfaces = shape.mesh, surfaces_of(shape)
    assert is_closed(mesh)
    corner, row = mesh.vertices[mesh.triangles], mesh.triangle_surfaces.astype(np.int64)
    twice = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    assert shape.volume is not None
    assert np.einsum("nd,nd->n", corner[:, 0], twice).sum() / 6 == pytest.approx(shape.volume, rel=0.01)
    area = np.bincount(row, np.linalg.norm(twice, axis=1) / 2, len(surfaces))
    assert area == pytest.approx(shape.surfaces["area"], rel=0.02)
    # The middle of each side is the farthest from a surface that is round one way.
    ruled = np.isin(surfaces.kind.astype(str), ("plane", "cylinder", "cone"))[row]
    middle = (corner + np.roll(corner, -1, axis=1))[ruled].reshape(-1, 3) / 2
    which = np.repeat(row[ruled], 3)
    feet = surfaces.evaluate(which, *surfaces.parameters(which, middle)).points
    away = np.linalg.norm(feet - middle, axis=1) * np.cos(np.nan_to_num(surfaces.semi_angle[which]))  # at one height
    assert away.max() <= mesh.deviation_mm + 1e-9
    assert mesh.deviation_mm <= 2 * mesh.chord_mm


def facing(mesh: Mesh) -> npt.NDArray[np.float64]:
    """Cosine between triangles (m,) and the surface's normals at their corners, the best of the three.

    Of triangles at least half of the chord's error high: what is less does not show."""
    corner = mesh.vertices[mesh.triangles]
    across = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    twice, longest = np.linalg.norm(across, axis=1), np.linalg.norm(corner - np.roll(corner, 1, axis=1), axis=2).max(1)
    high = twice > mesh.chord_mm / 2 * longest
    normal = mesh.normals[mesh.triangles[high]].astype(float)
    return np.asarray(np.einsum("nd,nkd->nk", across[high] / twice[high, None], normal).max(axis=1))


@cache
def cut_solids() -> dict[str, Any]:
    """Solids whose curved faces are trimmed by others, and have holes."""

    def drilled(body: Any, x: float, y: float, z: float, along: tuple[float, float, float], radius: float) -> Any:
        axis = gp_Ax2(gp_Pnt(x, y, z), gp_Dir(*along))
        return BRepAlgoAPI_Cut(body, BRepPrimAPI_MakeCylinder(axis, radius, 100.0).Shape()).Shape()

    ball, ring = BRepPrimAPI_MakeSphere(20.0).Shape(), BRepPrimAPI_MakeTorus(30.0, 9.0).Shape()
    pin = BRepPrimAPI_MakeCylinder(15.0, 50.0).Shape()
    squeeze = gp_GTrsf(gp_Mat(1.0, 0.0, 0.0, 0.0, 0.6, 0.0, 0.0, 0.0, 0.8), gp_XYZ(0.0, 0.0, 0.0))
    egg = BRepBuilderAPI_GTransform(ball, squeeze, True).Shape()  # of spline faces
    corner = BRepPrimAPI_MakeBox(gp_Pnt(5.0, -40.0, 2.0), gp_Pnt(50.0, 40.0, 60.0)).Shape()
    taper, tip = BRepPrimAPI_MakeCone(20.0, 8.0, 40.0).Shape(), BRepPrimAPI_MakeCone(20.0, 0.0, 40.0).Shape()
    return {
        "ball": drilled(drilled(ball, -50, 3, 4, (1, 0, 0), 6.0), 2, -50, 1, (0, 1, 0.2), 4.0),
        "ring": BRepAlgoAPI_Cut(drilled(ring, 30, 0, -50, (0.1, 0, 1), 4.0), corner).Shape(),
        "pin": drilled(
            drilled(drilled(pin, -50, 2, 10, (1, 0, 0), 5.0), 3, -50, 20, (0, 1, 0), 4.0), -50, 0, 40, (1, 0.3, 0), 6.0
        ),
        "egg": drilled(
            BRepAlgoAPI_Fuse(egg, BRepPrimAPI_MakeCylinder(5.0, 40.0).Shape()).Shape(), -50, 1, 2, (1, 0, 0), 3.0
        ),
        "taper": drilled(BRepAlgoAPI_Cut(taper, corner).Shape(), -50, 3, 14, (1, 0, 0), 4.0),
        "tip": drilled(tip, -50, 3, 14, (1, 0, 0), 4.0),
    }


@pytest.mark.parametrize("name", ["ball", "ring", "pin", "egg", "taper", "tip"])
def test_triangles_of_trimmed_round_faces_meet_and_keep_to_the_solid(name: str) -> None:
    solid = cut_solids()[name]
    keys = face_map(solid)
    shape = step_shape.extract(solid)
    mesh = shape.mesh
    assert is_closed(mesh)
    assert facing(mesh).min() > -0.1  # beside a pole some stand upright
    area = np.linalg.norm(np.cross(*np.diff(mesh.vertices[mesh.triangles], axis=1).swapaxes(0, 1)), axis=1) / 2
    whole = np.bincount(mesh.triangle_surfaces, area, len(shape.surfaces["area"]))
    assert whole == pytest.approx(shape.surfaces["area"], rel=0.02)
    assert not shape.findings
    rng = np.random.default_rng(0)
    for i in rng.permutation(len(mesh.triangles))[:150].tolist():
        share = rng.dirichlet(np.ones(3))
        point = gp_Pnt(*(share @ mesh.vertices[mesh.triangles[i]]).tolist())
        face = TopoDS.Face(keys.FindKey(int(mesh.triangle_surfaces[i]) + 1))
        assert GeomAPI_ProjectPointOnSurf(point, BRep_Tool.Surface_s(face)).LowerDistance() <= 1.1 * mesh.deviation_mm


def test_a_mesh_that_is_open_or_far_off_is_a_finding_and_costs_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing_one(faces: list[Any], chord: float) -> list[tuple[Any, Any]]:
        return [(None, place) if i == 0 else (one, place) for i, (one, place) in enumerate(made(faces, chord))]

    pin = BRepPrimAPI_MakeCylinder(20.0, 30.0).Shape()
    made = triangulation._triangulations
    with monkeypatch.context() as patch:
        patch.setattr(triangulation, "_triangulations", missing_one)
        shape = step_shape.extract(pin)
    steps = 2 * np.pi / np.diff(np.unique(np.round(np.arctan2(*shape.mesh.vertices.T[:2]), 9))).max()
    kinds = {one.kind: one for one in shape.findings}
    assert set(kinds) == {"unmeshed_face", "open_mesh"}
    assert kinds["unmeshed_face"].surface_no == 0
    assert kinds["open_mesh"].value == pytest.approx(2 * steps, abs=1)  # both circles
    assert shape.volume == pytest.approx(np.pi * 400 * 30)
    with monkeypatch.context() as patch:
        patch.setattr(triangulation, "_P", replace(triangulation._P, most_chords=0.01))
        far = step_shape.extract(pin)
    (found,) = far.findings
    assert found.kind == "mesh_deviation"
    assert found.value == far.mesh.deviation_mm
    assert found.value == pytest.approx(20 * (1 - np.cos(np.pi / steps)), rel=1e-6)
