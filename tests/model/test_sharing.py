"""Copies of parts in a flattened file, turned and shifted, against the motions that made them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from relmodel.model import content_keys
from relmodel.model.model import Model, Shape
from relmodel.readers.step import faces
from relmodel.readers.step import shape as step_shape
from tests.features.test_features import box, cut, cylinder
from tests.readers.test_exact import compound
from tests.reading import shared

Floats = npt.NDArray[np.float64]
pytest.importorskip("OCP")


def handed(shift: float = 0.0, radius: float = 2.0) -> Any:
    """A block with a slot and three unlike holes: it has no symmetry and so differs from its mirror image."""
    part = cut(box(0, 0, 0, (30.0, 20.0, 10.0)), box(22, -1, 6, (4.0, 30.0, 10.0)))
    part = cut(part, cylinder(5, 5, -1, radius, 20), cylinder(14 + shift, 15, 4, 3, 20))
    lying = moved(cylinder(0, 0, -1, 1.5, 12), motion((0, 1, 0), np.pi / 2, (0, 8, 3)))
    return cut(part, lying)


def bolt() -> Any:
    return cut(cylinder(0, 0, 0, 6, 4), cylinder(0, 0, 2, 2, 5))


def bent() -> Any:
    """A block under a spline, as b-splines throughout."""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_NurbsConvert
    from OCP.BRepPrimAPI import BRepPrimAPI_MakePrism
    from OCP.gp import gp_Vec

    from tests.readers.test_mass_properties import profile

    return BRepBuilderAPI_NurbsConvert(BRepPrimAPI_MakePrism(profile()[0], gp_Vec(1, 8, 0)).Shape()).Shape()


def motion(axis: tuple[float, float, float], angle: float, shift: tuple[float, float, float]) -> Floats:
    """Rodrigues' rotation about an axis through the origin, and a shift."""
    k = np.array(axis) / np.linalg.norm(axis)
    cross = np.cross(np.eye(3), k) * -1
    out = np.eye(4)
    out[:3, :3] += np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    out[:3, 3] = shift
    return out


def moved(shape: Any, matrix: Floats, mirror: bool = False) -> Any:
    """A copy with geometry of its own."""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_Transform
    from OCP.gp import gp_Pnt, gp_Trsf

    trsf, turn = gp_Trsf(), gp_Trsf()
    turn.SetValues(*matrix[:3].ravel().tolist())
    if mirror:
        trsf.SetMirror(gp_Pnt(0, 0, 0))
    return BRepBuilderAPI_Transform(shape, turn.Multiplied(trsf), True).Shape()


def random_motions(count: int, seed: int) -> list[Floats]:
    rng = np.random.default_rng(seed)
    return [
        motion(tuple(rng.normal(size=3)), rng.uniform(0, 6), tuple(rng.uniform(-300, 300, 3))) for _ in range(count)
    ]


def write_flat(shapes: list[Any], path: Path) -> None:
    """One product whose one shape is a compound of plain solids."""
    from OCP.STEPCAFControl import STEPCAFControl_Writer
    from OCP.STEPControl import STEPControl_StepModelType
    from OCP.TCollection import TCollection_ExtendedString
    from OCP.TDocStd import TDocStd_Document
    from OCP.XCAFDoc import XCAFDoc_DocumentTool

    document = TDocStd_Document(TCollection_ExtendedString("flat"))
    XCAFDoc_DocumentTool.ShapeTool_s(document.Main()).AddShape(compound(shapes), False)
    writer = STEPCAFControl_Writer()
    writer.Transfer(document, STEPControl_StepModelType.STEPControl_AsIs)
    writer.Write(str(path))


def write_products(shapes: list[Any], path: Path) -> None:
    """Every solid as a product of its own."""
    from OCP.STEPControl import STEPControl_StepModelType, STEPControl_Writer

    writer = STEPControl_Writer()
    for shape in shapes:
        writer.Transfer(shape, STEPControl_StepModelType.STEPControl_AsIs)
    writer.Write(str(path))


@pytest.mark.parametrize("write", [write_flat, write_products])
def test_copies_are_one_shape_and_mirror_images_and_near_twins_are_not(write: Any, tmp_path: Path) -> None:
    parts = [handed(), bolt(), bent()]
    motions = random_motions(15, 7)
    made = [moved(parts[i % 3], m) for i, m in enumerate(motions)]
    label = [i % 3 for i in range(15)]
    # Mirrored, a block without symmetry is another shape; a bolt that is symmetric is the same.
    made += [moved(parts[0], m, mirror=True) for m in motions[:2]] + [moved(parts[1], motions[3], mirror=True)]
    label += [3, 3, 1]
    made += [moved(handed(shift=1e-3), motions[4]), moved(handed(radius=2.001), motions[5])]
    label += [4, 5]
    write(made, tmp_path / "flat.step")
    model = shared(tmp_path / "flat.step")
    assert len(model.shapes) == 6
    placed = leaves(model)
    assert len(placed) == len(made)
    of = [shape for shape, _ in placed]
    for i, own in enumerate(label):
        assert [shape == of[i] for shape in of] == [other == own for other in label]
    for (shape, pose), solid in zip(placed, made, strict=True):
        assert np.linalg.det(pose[:3, :3]) == pytest.approx(1.0)
        assert corners(model.shapes[shape], pose) == pytest.approx(kernel_corners(solid), abs=1e-6)


def leaves(model: Model) -> list[tuple[int, Floats]]:
    """Shape and pose of every placed part, in the order of the file."""

    def walk(assembly: int, pose: Floats) -> list[tuple[int, Floats]]:
        out = []
        for one in model.assemblies[assembly].instances:
            at = pose @ one.parent_from_child
            out += [(model.parts[one.child].shape, at)] if one.kind == "part" else walk(one.child, at)
        return out

    return walk(model.root, np.eye(4))


def corners(shape: Shape, pose: Floats) -> Floats:
    """Starts of the edges in the world, in order of a skew direction."""
    points = np.stack([shape.arcs[f"start_{c}"] for c in "xyz"], axis=1) @ pose[:3, :3].T + pose[:3, 3]
    return in_order(points)


def kernel_corners(solid: Any) -> Floats:
    from OCP.TopoDS import TopoDS

    from tests.readers.test_step import start_of

    edges = faces.edge_map(faces.face_map(solid))
    return in_order(np.array([start_of(TopoDS.Edge(edges.FindKey(i))) for i in range(1, edges.Extent() + 1)]))


def in_order(points: Floats) -> Floats:
    return points[np.argsort(np.round(points @ [0.123, 0.456, 0.789], 4), kind="stable")]


def test_a_part_of_many_symmetries_is_found_and_the_faces_are_told(tmp_path: Path) -> None:
    """A ring of twelve holes, whose landmarks fit in many ways; but one hole is deeper."""
    turn = [motion((0, 0, 1), i * np.pi / 6, (0, 0, 0)) for i in range(12)]
    ring = cylinder(0, 0, 0, 40, 10)
    for i, m in enumerate(turn):
        ring = cut(ring, moved(cylinder(30, 0, 5 if i else 4.5, 3, 20), m))
    pose = random_motions(1, 3)[0]
    first, other = (step_shape.extract(s) for s in (ring, moved(ring, pose)))
    found = content_keys._fit(content_keys._elements(first), content_keys._elements(other))
    assert found is not None
    assert found[0] == pytest.approx(pose, abs=1e-8)
    faces, edges = len(first.surfaces["kind"]), len(first.arcs["kind"])
    assert found[1][:faces].tolist() == list(range(faces))
    assert sorted(found[1].tolist()) == list(range(faces + edges))


def test_named_and_coloured_faces_keep_shapes_apart() -> None:
    plain, named = (step_shape.extract(handed(), {"name": names}) for names in ({}, {1: "datum A"}))
    assert content_keys._counts(plain) != content_keys._counts(named)
