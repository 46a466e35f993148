"""Features of parts that the CAD kernel composes from known operations, and of a real one."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut, BRepAlgoAPI_Fuse
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeCone, BRepPrimAPI_MakeCylinder
from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt

from relmodel.features import Feature, feature_class_key, recognise, thin
from relmodel.readers.step import shape as step_shape
from tests.features.known_parts import PARTS, Work
from tests.parts.solids import carried, prism, round_box
from tests.parts.step_parts import loaded
from tests.poses import pose_of

Z = gp_Dir(0, 0, 1)


def box(x: float, y: float, z: float, size: tuple[float, float, float]) -> Any:
    return BRepPrimAPI_MakeBox(gp_Pnt(x, y, z), *size).Shape()


def cylinder(x: float, y: float, z: float, radius: float, height: float) -> Any:
    return BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(x, y, z), Z), radius, height).Shape()


def cone(x: float, y: float, z: float, low: float, high: float, height: float) -> Any:
    return BRepPrimAPI_MakeCone(gp_Ax2(gp_Pnt(x, y, z), Z), low, high, height).Shape()


def cut(body: Any, *tools: Any) -> Any:
    for tool in tools:
        body = BRepAlgoAPI_Cut(body, tool).Shape()
    return body


def measures(feature: Feature) -> dict[str, float]:
    return {name: value for name, (value, _) in feature.dimensions.items()}


def features_of(shape: Any) -> list[Feature]:
    """Features but for what is under the floors and what is left."""
    return [f for f in recognise(step_shape.extract(shape)) if f.kind not in ("web", "body")]


def plate() -> Any:
    return box(0, 0, 0, (100.0, 80.0, 20.0))


def test_the_frame_of_a_hole_is_at_its_mouth_and_its_box_holds_it() -> None:
    (hole,) = features_of(cut(plate(), cylinder(40, 15, 8, 5, 20)))
    assert hole.shape_from_feature[:3, 3] == pytest.approx([40, 15, 20])
    assert hole.shape_from_feature[:3, 2] == pytest.approx([0, 0, 1])
    assert np.linalg.det(hole.shape_from_feature[:3, :3]) == pytest.approx(1)
    assert hole.box == pytest.approx([35, 10, 8, 45, 20, 20], abs=1e-6)
    assert sorted(role for _, role in hole.surfaces) == ["bottom", "wall"]


def test_a_pocket_with_corners_fillet_island_and_hole() -> None:
    tool = round_box((10, 10, 8), (70, 50, 38), 6.0, 2.0)
    tool = BRepAlgoAPI_Cut(tool, cylinder(30, 30, 0, 5, 14)).Shape()  # leaves a boss in the pocket
    part = cut(plate(), tool, cylinder(50, 30, -1, 4, 20))
    found = features_of(part)
    assert Counter(f.kind for f in found) == {"pocket": 1, "through_hole": 1, "boss": 1}
    (pocket,) = (f for f in found if f.kind == "pocket")
    expected = {"length": 60.0, "width": 40.0, "depth": 12.0, "corner_radius": 6.0, "fillet_radius": 2.0}
    assert measures(pocket) == pytest.approx(expected, abs=1e-6)
    roles = Counter(role for _, role in pocket.surfaces)
    assert (roles["floor"], roles["blend"]) == (1, 8)
    assert roles["wall"] >= 8
    assert pocket.box == pytest.approx([10, 10, 8, 70, 50, 20], abs=1e-6)
    assert pocket.shape_from_feature[:3, 3] == pytest.approx([40, 30, 8])
    assert pocket.shape_from_feature[:3, 0] == pytest.approx([1, 0, 0])


def test_what_is_open_at_a_side_or_closed_all_around_is_no_pocket() -> None:
    def kinds(shape: Any) -> list[str]:
        return [f.kind for f in features_of(shape)]

    assert kinds(cut(plate(), box(40, -1, 10, (20.0, 90.0, 20.0)))) == ["open_slot"]
    assert kinds(cut(plate(), box(-1, -1, 10, (40.0, 30.0, 20.0)))) == ["step"]
    assert kinds(cut(plate(), box(20, 20, 5, (20.0, 20.0, 10.0)))) == []
    assert kinds(BRepAlgoAPI_Fuse(plate(), cylinder(50, 40, 10, 9, 30)).Shape()) == ["boss"]


def test_a_pocket_within_a_pocket_is_two() -> None:
    part = cut(plate(), box(10, 10, 14, (60.0, 40.0, 20.0)), box(20, 20, 6, (30.0, 20.0, 20.0)))
    found = features_of(part)
    assert sorted((round(m["length"]), round(m["width"]), round(m["depth"])) for m in map(measures, found)) == [
        (30, 20, 8),
        (60, 40, 6),
    ]


def test_mirror_images_and_near_twins_are_of_other_classes() -> None:
    """Skew pockets and ducts, turned, mirrored, and with a corner 0.02 mm elsewhere within the same rectangle."""
    outline = [(0.0, 0.0), (16.0, 0.0), (13.0, 9.0), (2.0, 9.0)]
    near = [(0.0, 0.0), (16.0, 0.0), (13.02, 9.0), (2.0, 9.0)]
    parallelogram = [(0.0, 0.0), (12.0, 0.0), (16.0, 9.0), (4.0, 9.0)]

    def classes(low: float) -> list[str]:
        part = BRepPrimAPI_MakeBox(gp_Pnt(0, 0, 0), 150.0, 60.0, 20.0).Shape()
        made = [(outline, 0.0, 1), (outline, 1.1, 1), (outline, 0.4, -1), (near, 0.0, 1)]
        made += [(parallelogram, 0.2, 1), (parallelogram, -0.5, -1)]
        for k, (corners, turn, hand) in enumerate(made):
            c, s = np.cos(turn), np.sin(turn)
            at = (22.0 + 50 * (k % 3), 15.0 + 30 * (k // 3))
            points = [((p[0] - 8) * hand, p[1] - 4.5) for p in corners]
            bent = [(at[0] + c * x - s * y, at[1] + s * x + c * y, low) for x, y in points]
            part = cut(part, prism(bent, (0, 0, 40)))
        found = [f for f in features_of(part) if f.kind in ("pocket", "duct")]
        found.sort(key=lambda f: (f.shape_from_feature[1, 3] // 30, f.shape_from_feature[0, 3]))
        return [feature_class_key(f) for f in found]

    first, turned_, mirrored, twin, skew, other = classes(8.0)
    assert first == turned_
    assert len({first, mirrored, twin, skew, other}) == 5
    first, turned_, mirrored, twin, skew, other = classes(-5.0)  # turned over, a duct is its mirror image
    assert first == turned_ == mirrored
    assert skew == other
    assert len({first, twin, skew}) == 3


def test_a_surface_that_the_kernel_could_not_mesh_is_left_out() -> None:
    tool = round_box((10, 10, 8), (50, 50, 38), 6.0, 2.0)
    part = cut(plate(), tool, cylinder(75, 20, 10, 3, 20), cone(75, 20, 8, 0, 3, 2), cylinder(75, 20, 15, 6, 20))
    shape = step_shape.extract(part)
    mesh = shape.mesh
    triangles, owners = mesh.triangles, mesh.triangle_surfaces
    assert {f.kind for f in recognise(shape)} == {"pocket", "blind_hole", "web", "body"}
    for surface in range(0, len(shape.surfaces["kind"]), 2):
        left = owners != surface
        bare = replace(shape, mesh=replace(mesh, triangles=triangles[left], triangle_surfaces=owners[left]))
        for feature in recognise(bare):
            assert np.all(np.isfinite(feature.shape_from_feature))
            assert np.all(np.isfinite(list(measures(feature).values())))


ROLLED = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])  # x to y, y to z, z to x
SHIFT = np.array([100.0, -50, 20])


@pytest.mark.parametrize("make", PARTS)
def test_features_of_parts_of_known_operations(make: Callable[[], Work]) -> None:
    """All of them and no others, also where they cut one another; and the same, with frames, of it rolled over."""
    part = make()
    shapes = part.body, carried(part.body, pose_of(SHIFT, ROLLED))
    found, again = (recognise(step_shape.extract(shape)) for shape in shapes)
    left = [f for f in found if f.kind != "body"]
    for known in part.known:
        hits = [f for f in left if known.is_that(f)]
        assert len(hits) == 1, known
        left.remove(hits[0])
    assert left == []
    assert len(found) == len(again)
    for one, two in zip(found, again, strict=True):
        assert (one.kind, one.name, one.surfaces) == (two.kind, two.name, two.surfaces)
        if one.kind == "body":
            assert list(measures(one).values()) == pytest.approx(one.box[3:] - one.box[:3])
            continue
        assert measures(one) == pytest.approx(measures(two), abs=1e-5)
        turn, other = one.shape_from_feature, two.shape_from_feature
        if one.kind != "fillet":  # whose Z is the mean of the normals of its facets
            out = ROLLED @ turn[:3, 2]
            same = float(out @ other[:3, 2])
            assert abs(same) > 1 - 1e-9
            # What is open at both ends is looked at from either.
            assert same < 0 or np.abs(ROLLED @ turn[:3, 3] + SHIFT - other[:3, 3]).max() < 1e-4
            assert same > 0 or one.kind in ("through_hole", "duct", "lug", "web") or one.kind.endswith("_pattern")
        assert np.abs(other[:3, :3].T @ other[:3, :3] - np.eye(3)).max() < 1e-9
        assert np.linalg.det(other[:3, :3]) > 0
        box = np.concatenate([ROLLED @ half + SHIFT for half in one.box.reshape(2, 3)])
        assert np.abs(box - two.box).max() < 1e-3


@pytest.mark.data
def test_holes_of_a_real_part_are_those_that_its_diameters_are_noted_on(data_dir: Path) -> None:
    """As many holes as the faces of a note are whole cylinders, and each has the diameter; "4X" is 4 notes there."""
    model = loaded(data_dir / "step" / "nist_ctc_01_asme1_ap242.stp")
    (part,) = (p for p in model.parts if p.pmi)
    surfaces = model.shapes[part.shape].surfaces
    holes = [f for f in recognise(model.shapes[part.shape]) if f.kind.endswith("_hole")]
    notes = [p for p in part.pmi if p.type == "diameter" and p.value is not None]
    count: Counter[float] = Counter()
    for note in notes:
        faces = {surface for surface, _ in note.surfaces}
        noted = [f for f in holes if faces & {i for i, _ in f.surfaces}]
        turns = sum(float(surfaces["u1"][i] - surfaces["u0"][i]) for i in faces) / (2 * np.pi)
        assert turns == pytest.approx(len(noted), abs=1e-6)
        for f in noted:
            radii = {round(2 * float(surfaces["radius"][i]), 6) for i, role in f.surfaces if role != "countersink"}
            assert note.value in radii
            count[note.value] += 1
    assert len(notes) >= 7
    assert count == {35.0: 4, 20.0: 2, 25.0: 1}  # 4X 35, 2X 20, 1X 25
    (grid,) = (f for f in recognise(model.shapes[part.shape]) if measures(f).get("hole_diameter") == 35.0)
    assert measures(grid)["count"] == 4


def test_triangles_of_a_damaged_face_cover_what_they_cover() -> None:
    """Two triangles that cross, as a face with a wrong digit gives them: no partition, still an area."""
    one = np.array([[0.0, 0.0], [4.0, 0.0], [0.0, 4.0]])
    corners = np.concatenate([one, one + np.array([1.0, 0.0]), one])
    whole = thin.outline_of(corners)
    assert whole.is_valid
    assert whole.area == pytest.approx(8.0 + 8.0 - 4.5)  # the shared corner is a right triangle with legs of 3
