"""Triangles of faces from rows, and where these do not do by the kernel: against exact geometry and each other."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from relmodel.loading.facets import polygons
from relmodel.loading.facets.rims import Rims
from relmodel.loading.facets.sweeps import Sweep
from relmodel.model.measures import surfaces_of
from relmodel.model.model import Mesh, Shape
from relmodel.readers.step import maps
from relmodel.readers.step import shape as step_shape
from tests.parts.seat_parts import workshop
from tests.parts.step_parts import loaded


def composed(seed: int) -> Shape:
    return step_shape.extract(workshop(seed).body, {}, {}, {})


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


@pytest.mark.parametrize("seed", range(12))
def test_triangles_of_a_composed_part_meet_and_keep_to_its_surfaces(seed: int) -> None:
    shape = composed(seed)
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
    assert np.linalg.norm(feet - middle, axis=1).max() <= mesh.chord_mm


def facing(mesh: Mesh) -> npt.NDArray[np.float64]:
    """Cosine between triangles (m,) and the surface's normals at their corners, the best of the three.

    Of triangles at least half of the chord's error high: what is less does not show.
    """
    corner = mesh.vertices[mesh.triangles]
    across = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    twice, longest = np.linalg.norm(across, axis=1), np.linalg.norm(corner - np.roll(corner, 1, axis=1), axis=2).max(1)
    high = twice > mesh.chord_mm / 2 * longest
    normal = mesh.normals[mesh.triangles[high]].astype(float)
    return np.asarray(np.einsum("nd,nkd->nk", across[high] / twice[high, None], normal).max(axis=1))


def cut_solids() -> dict[str, Any]:
    """Solids whose curved faces are trimmed by others, and have holes."""
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut, BRepAlgoAPI_Fuse
    from OCP.BRepBuilderAPI import BRepBuilderAPI_GTransform
    from OCP.BRepPrimAPI import (
        BRepPrimAPI_MakeBox,
        BRepPrimAPI_MakeCone,
        BRepPrimAPI_MakeCylinder,
        BRepPrimAPI_MakeSphere,
        BRepPrimAPI_MakeTorus,
    )
    from OCP.gp import gp_Ax2, gp_Dir, gp_GTrsf, gp_Mat, gp_Pnt, gp_XYZ

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
    from OCP.BRep import BRep_Tool
    from OCP.BRepMesh import BRepMesh_IncrementalMesh
    from OCP.GeomAPI import GeomAPI_ProjectPointOnSurf
    from OCP.gp import gp_Pnt
    from OCP.TopLoc import TopLoc_Location
    from OCP.TopoDS import TopoDS

    solid = cut_solids()[name]
    keys = maps.face_map(solid)
    shape = step_shape.extract(solid, {}, {}, {})
    mesh = shape.mesh
    assert is_closed(mesh)
    assert facing(mesh).min() > -0.1  # beside a pole some stand upright
    area = np.linalg.norm(np.cross(*np.diff(mesh.vertices[mesh.triangles], axis=1).swapaxes(0, 1)), axis=1) / 2
    whole = np.bincount(mesh.triangle_surfaces, area, len(shape.surfaces["area"]))
    assert whole == pytest.approx(shape.surfaces["area"], rel=0.02)
    rng = np.random.default_rng(0)
    for i in rng.permutation(len(mesh.triangles))[:150].tolist():
        share = rng.dirichlet(np.ones(3))
        point = gp_Pnt(*(share @ mesh.vertices[mesh.triangles[i]]).tolist())
        face = TopoDS.Face(keys.FindKey(int(mesh.triangle_surfaces[i]) + 1))
        assert GeomAPI_ProjectPointOnSurf(point, BRep_Tool.Surface_s(face)).LowerDistance() <= mesh.chord_mm
    BRepMesh_IncrementalMesh(solid, mesh.chord_mm, False, mesh.chord_rad, False)
    faces = [TopoDS.Face(keys.FindKey(i + 1)) for i in range(keys.Extent())]
    kernels = sum(BRep_Tool.Triangulation_s(face, TopLoc_Location()).NbTriangles() for face in faces)
    assert len(mesh.triangles) < 1.5 * kernels


def test_holes_in_rows_leave_no_flat_triangle() -> None:
    x, y = (place.ravel() for place in np.meshgrid(np.arange(5.0), np.arange(4.0)))
    holes = np.stack([x, y], axis=1)[:, None] + np.array([(0.2, 0.2), (0.2, 0.7), (0.7, 0.7), (0.7, 0.2)])
    outer = np.array([(0.0, 0.0), (2.0, 0.0), (5.0, 0.0), (5.0, 4.0), (0.0, 4.0), (0.0, 2.0), (0.0, 1.0)])
    uv = np.concatenate([outer, holes.reshape(-1, 2)])
    face = np.zeros(len(uv), np.int64)
    ends = len(outer) + 4 * np.arange(len(holes) + 1)
    corners, failed = polygons.triangles(Rims(np.zeros((len(uv), 3)), uv, face, ends), 1)
    assert not failed.any()
    a, b, c = (uv[corners[:, k]] for k in range(3))
    area = ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]) / 2
    assert area.min() > 1e-3
    assert area.sum() == pytest.approx(20.0 - 20 * 0.25)
    sides = np.sort(np.stack([corners, np.roll(corners, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    assert np.bincount(np.unique(sides, axis=0, return_counts=True)[1])[1] == len(uv)  # met by none: those of the rings


def wave(seed: int) -> tuple[Rims, float]:
    """A band with wavy rims, a notch that turns back, and holes in it, and its area."""
    rng = np.random.default_rng(seed)
    x = np.linspace(0.0, 20.0, 81)
    below, above = (np.stack([x, height + 0.3 * np.sin(x)], axis=1) for height in (0.0, 5.0))
    turns = np.array([(6.0, 4.9), (7.2, 4.5), (6.6, 4.2), (7.6, 4.0), (8.0, 5.2)])
    notch = np.stack([np.interp(np.linspace(0, 4, 33), np.arange(5), values) for values in turns.T], axis=1)
    above = np.concatenate([above[x < 6.0], notch, above[x > 8.0]])
    rings, angle = [np.concatenate([below, above[::-1]])], -np.linspace(0, 2 * np.pi, 16, endpoint=False)
    for k in range(8):
        middle = 2.0 + 2.0 * k + rng.uniform(-0.2, 0.2), rng.uniform(1.3, 3.0)
        rings.append(middle + rng.uniform(0.2, 0.6, 2) * np.stack([np.cos(angle), np.sin(angle)], axis=1))
    uv = np.concatenate(rings)
    ends = np.cumsum([len(ring) for ring in rings])
    area = [np.sum(r[:, 0] * np.roll(r[:, 1], -1) - np.roll(r[:, 0], -1) * r[:, 1]) / 2 for r in rings]
    return Rims(np.zeros((len(uv), 3)), uv, np.zeros(len(uv), np.int64), ends), float(sum(area))


@pytest.mark.parametrize("seed", range(6))
def test_a_sweep_fills_a_band_with_holes_by_triangles_as_narrow_as_its_chords(seed: int) -> None:
    rims, area = wave(seed)
    corners, _ = Sweep(rims).triangles()
    a, b, c = (rims.uv[corners[:, k]] for k in range(3))
    twice = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    assert twice.min() > -1e-9
    assert twice.sum() / 2 == pytest.approx(area)
    sides = np.sort(np.stack([corners, np.roll(corners, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    number, count = np.unique(sides, axis=0, return_counts=True)
    rim = np.sort(np.stack([np.arange(len(rims.uv)), rims.following], axis=1), axis=1)
    assert set(map(tuple, number[count == 1].tolist())) == set(map(tuple, rim.tolist()))
    assert count.max() == 2
    longest = np.abs(rims.uv[:, 0] - rims.uv[rims.following, 0]).max()
    assert np.ptp(rims.uv[corners, 0], axis=1).max() < 2 * longest


@pytest.mark.data
@pytest.mark.parametrize(
    "name",
    [
        "step/nist_ctc_01_asme1_ap242.stp",
        "step/nist_ctc_02_asme1_ap242.stp",
        "step/M6-1x12-countersunk-screw.step",
        "step/featuretype.STEP",
        "bulkhead/A/bulkhead_parts.step",
    ],
)
def test_triangles_of_a_file_meet(data_dir: Path, name: str) -> None:
    mesh = loaded(data_dir / name).shapes[0].mesh
    assert is_closed(mesh)
    assert facing(mesh).min() > 0.3
