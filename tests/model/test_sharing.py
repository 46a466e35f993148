"""Copies of parts in a flattened file, turned and shifted, against the motions that made them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from OCP.BRep import BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Curve
from OCP.BRepBuilderAPI import (
    BRepBuilderAPI_MakeEdge,
    BRepBuilderAPI_MakeFace,
    BRepBuilderAPI_MakeWire,
    BRepBuilderAPI_Transform,
)
from OCP.BRepBuilderAPI import BRepBuilderAPI_NurbsConvert as Convert
from OCP.BRepPrimAPI import BRepPrimAPI_MakePrism
from OCP.collections import Array1_gp_Pnt
from OCP.GeomAPI import GeomAPI_PointsToBSpline
from OCP.gp import gp_Pnt, gp_Trsf, gp_Vec
from OCP.TopoDS import TopoDS

from relmodel.model.content_keys import share
from relmodel.model.model import Assembly, Instance, Model, Part, Shape
from relmodel.readers.step import faces
from relmodel.readers.step import shape as step_shape
from tests.features.test_features import box, cut, cylinder
from tests.parts.step_parts import compound, write_product, write_solids
from tests.placed_parts import PlacedParts
from tests.poses import pose_of
from tests.reading import shared

Floats = npt.NDArray[np.float64]


def handed(shift: float = 0.0, radius: float = 2.0) -> Any:
    """A block with a slot and three unlike holes: it has no symmetry and so differs from its mirror image."""
    part = cut(box(0, 0, 0, (30.0, 20.0, 10.0)), box(22, -1, 6, (4.0, 30.0, 10.0)))
    part = cut(part, cylinder(5, 5, -1, radius, 20), cylinder(14 + shift, 15, 4, 3, 20))
    lying = moved(cylinder(0, 0, -1, 1.5, 12), pose_of((0, 8, 3), (0, np.pi / 2, 0)))
    return cut(part, lying)


def bolt() -> Any:
    return cut(cylinder(0, 0, 0, 6, 4), cylinder(0, 0, 2, 2, 5))


def bent() -> Any:
    """A block under a curve, as b-splines throughout."""
    points = Array1_gp_Pnt(1, 5)
    for i, (x, z) in enumerate([(0.0, 3.0), (4.0, 6.0), (9.0, 5.0), (15.0, 7.0), (20.0, 2.0)]):
        points.SetValue(i + 1, gp_Pnt(x, 0, z))
    wire = BRepBuilderAPI_MakeWire(BRepBuilderAPI_MakeEdge(GeomAPI_PointsToBSpline(points).Curve()).Edge())
    for x0, z0, x1, z1 in ((20, 2, 20, 0), (20, 0, 0, 0), (0, 0, 0, 3)):
        wire.Add(BRepBuilderAPI_MakeEdge(gp_Pnt(x0, 0, z0), gp_Pnt(x1, 0, z1)).Edge())
    return Convert(
        BRepPrimAPI_MakePrism(BRepBuilderAPI_MakeFace(wire.Wire(), True).Face(), gp_Vec(1, 8, 0)).Shape()
    ).Shape()


def ring() -> Any:
    """Six holes in a disc, which fits in many ways; but one hole is deeper."""
    out = cylinder(0, 0, 0, 40, 10)
    for i in range(6):
        out = cut(out, moved(cylinder(30, 0, 5 if i else 4.5, 3, 20), pose_of(turn=(0, 0, i * np.pi / 3))))
    return out


def moved(shape: Any, matrix: Floats, mirror: bool = False) -> Any:
    """A copy with geometry of its own."""
    trsf, turn = gp_Trsf(), gp_Trsf()
    turn.SetValues(*matrix[:3].ravel().tolist())
    if mirror:
        trsf.SetMirror(gp_Pnt(0, 0, 0))
    return BRepBuilderAPI_Transform(shape, turn.Multiplied(trsf), True).Shape()


def random_motions(count: int, seed: int) -> list[Floats]:
    rng = np.random.default_rng(seed)
    return [pose_of(rng.uniform(-300, 300, 3), rng.normal(size=3)) for _ in range(count)]


def write_flat(path: Path, *shapes: Any) -> Path:
    """One product whose one shape is a compound of plain solids."""
    return write_product(path, compound(*shapes), "flat")


@pytest.mark.parametrize(("write", "every"), [(write_flat, 1), (write_solids, 4)])
def test_copies_are_one_shape_and_mirror_images_and_near_twins_are_not(write: Any, every: int, tmp_path: Path) -> None:
    parts = [handed(), bolt(), bent()]
    motions = random_motions(7, 7)
    made = [moved(parts[i % 3], m) for i, m in enumerate(motions[:6])]
    label = [i % 3 for i in range(6)]
    # Mirrored, a block without symmetry is another shape; a bolt that is symmetric is the same.
    made += [moved(parts[0], m, mirror=True) for m in motions[:2]] + [moved(parts[1], motions[3], mirror=True)]
    label += [3, 3, 1]
    made += [moved(handed(shift=1e-3), motions[4]), moved(handed(radius=2.001), motions[5])]
    label += [4, 5]
    made += [ring(), moved(ring(), motions[6])]
    label += [6, 6]
    made, label = made[::every], label[::every]
    model = shared(write(tmp_path / "flat.step", *made))
    assert len(model.shapes) == len(set(label))
    placed = PlacedParts(model).of(model.root)
    of = placed.shape.tolist()
    assert len(of) == len(made)
    for i, own in enumerate(label):
        assert [shape == of[i] for shape in of] == [other == own for other in label]
    for shape, pose, solid in zip(of, placed.pose, made, strict=True):
        assert np.linalg.det(pose[:3, :3]) == pytest.approx(1.0)
        assert corners(model.shapes[shape], pose) == pytest.approx(kernel_corners(solid), abs=1e-6)


def corners(shape: Shape, pose: Floats) -> Floats:
    """Starts of the edges in the world, in order of a skew direction."""
    points = np.stack([shape.arcs[f"start_{c}"] for c in "xyz"], axis=1) @ pose[:3, :3].T + pose[:3, 3]
    return in_order(points)


def kernel_corners(solid: Any) -> Floats:
    edges = faces.edge_map(faces.face_map(solid))
    each = [TopoDS.Edge(edges.FindKey(i)) for i in range(1, edges.Extent() + 1)]
    assert not any(BRep_Tool.Degenerated_s(edge) for edge in each)
    curves = [BRepAdaptor_Curve(edge) for edge in each]
    return in_order(np.array([curve.Value(curve.FirstParameter()).Coord() for curve in curves]))


def in_order(points: Floats) -> Floats:
    return points[np.argsort(np.round(points @ [0.123, 0.456, 0.789], 4), kind="stable")]


def test_named_faces_keep_shapes_apart() -> None:
    for name, count in (("datum A", 2), ("", 1)):
        plain, named = (step_shape.extract(handed(), {"name": names}) for names in ({}, {1: name} if name else {}))
        placed = tuple(Instance(str(i), "part", i, np.eye(4)) for i in range(2))
        parts = (Part("a", "a", 0), Part("b", "b", 1))
        model = Model("STEP", "mm", 1.0, (plain, named), parts, (Assembly("", placed),), 0, 0, "test")
        assert len(share(model).shapes) == count
