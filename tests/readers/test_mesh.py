"""Meshes: surfaces and arcs of bodies with known faces and edges, scene graphs, units, bad files."""

from __future__ import annotations

import codecs
import json
import zipfile
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
import pytest
import trimesh

from relmodel.errors import InputError
from relmodel.features import recognise
from relmodel.model.model import Shape
from relmodel.readers.mesh import read
from relmodel.readers.mesh.read import read_mesh
from relmodel.readers.mesh.shape import shape_from_triangles
from relmodel.readers.step import shape as step_shape
from relmodel.readers.step import triangulation
from tests.parts.curved_parts import rounded
from tests.placed_parts import PlacedParts
from tests.reading import shared


def shape_of(mesh: trimesh.Trimesh) -> Shape:
    shape = shape_from_triangles(np.asarray(mesh.vertices, float), np.asarray(mesh.faces, np.int64))
    assert shape is not None
    return shape


L_OUTLINE = [(0.0, 0.0), (30.0, 0.0), (30.0, 10.0), (10.0, 10.0), (10.0, 30.0), (0.0, 30.0)]


def l_bracket() -> trimesh.Trimesh:
    """An L of 12 corners, its caps cut into triangles by hand."""
    n = len(L_OUTLINE)
    vertices = np.array([(x, y, z) for z in (0.0, 5.0) for x, y in L_OUTLINE])
    cap = [(0, 1, 2), (0, 2, 3), (0, 3, 4), (0, 4, 5)]
    faces = [t[::-1] for t in cap] + [tuple(i + n for i in t) for t in cap]
    for i in range(n):
        j = (i + 1) % n
        faces += [(i, j, j + n), (i, j + n, i + n)]
    return trimesh.Trimesh(vertices, faces, process=False)


def test_a_bracket_has_planes_lines_and_one_concave_edge() -> None:
    shape = shape_of(l_bracket())
    assert Counter(shape.surfaces["kind"]) == {"plane": 8}
    assert Counter(shape.arcs["kind"]) == {"line": 18}
    assert Counter(shape.arcs["convexity"]) == {"convex": 17, "concave": 1}
    assert np.allclose(np.abs(shape.arcs["angle"]), np.pi / 2)
    assert shape.volume == pytest.approx(500 * 5)
    assert shape.surfaces["area"].sum() == pytest.approx(2 * 500 + 120 * 5)
    # Each plane has one loop, and its coedges run head to tail with the material to the left.
    assert Counter(shape.loops["surface_no"]) == dict.fromkeys(range(8), 1)
    for surface in range(8):
        rows = np.flatnonzero(shape.coedges["surface_no"] == surface)
        ends = []
        for row in rows:
            arc, backward = shape.coedges["arc_no"][row], shape.coedges["reversed"][row]
            pair = [np.array([shape.arcs[f"{e}_{c}"][arc] for c in "xyz"]) for e in ("start", "end")]
            ends.append(pair[::-1] if backward else pair)
        heads, tails = np.array([e[1] for e in ends]), np.array([e[0] for e in ends])
        assert np.array_equal(heads, np.roll(tails, -1, axis=0))
        normal = np.array([shape.surfaces[f"axis_z_{c}"][surface] for c in "xyz"])
        swept = np.cross(tails, heads).sum(axis=0) @ normal / 2
        assert swept == pytest.approx(shape.surfaces["area"][surface])


@pytest.mark.parametrize("fit", [True, False])
def test_triangles_that_run_against_their_neighbours_are_turned(fit: bool) -> None:
    """A third of an L's, most of a ball's, and some of a cubic void's, whose other triangles face inwards."""
    cube, void = (trimesh.creation.box([size] * 3) for size in (9, 5))
    ball, bracket = trimesh.creation.icosphere(subdivisions=2), l_bracket()
    size, most = float(ball.volume), np.arange(len(ball.faces)) % 3 < 2
    void.faces[3:] = void.faces[3:, ::-1]
    ball.faces[most] = ball.faces[most][:, ::-1]
    bracket.faces[::3] = bracket.faces[::3, ::-1]
    ball.apply_translation([100, 0, 0])
    bracket.apply_translation([0, 100, 0])
    cases = [(cube + void, 9.0**3 - 5**3, 3), (ball, size, int(most.sum())), (bracket, 2500.0, 7)]
    turned = l_bracket()
    turned.faces = turned.faces[:, ::-1]
    assert shape_of(turned).volume == pytest.approx(2500)  # inside out
    meshes, volumes, counts = zip(*cases, strict=True)
    for mesh, volume, count in [*cases, (trimesh.util.concatenate(meshes), sum(volumes), sum(counts))]:
        shape = shape_from_triangles(np.asarray(mesh.vertices, float), np.asarray(mesh.faces, np.int64), fit=fit)
        assert shape is not None
        assert shape.volume == pytest.approx(volume, rel=1e-9)
        assert [(f.kind, f.value) for f in shape.findings] == [("mended_winding", count)]


def test_a_tessellated_cylinder_is_a_cylinder_between_two_planes() -> None:
    shape = shape_of(trimesh.creation.cylinder(radius=50, height=200, sections=64))
    assert Counter(shape.surfaces["kind"]) == {"plane": 2, "cylinder": 1}
    row = int(np.flatnonzero(shape.surfaces["kind"] == "cylinder")[0])
    surface = {name: column[row] for name, column in shape.surfaces.items()}
    assert surface["radius"] == pytest.approx(50)
    assert [surface[f"axis_z_{c}"] for c in "xyz"] == pytest.approx([0, 0, 1])
    assert [surface[f"origin_{c}"] for c in "xyz"] == pytest.approx([0, 0, 0], abs=1e-9)
    assert (surface["v0"], surface["v1"]) == pytest.approx((-100, 100))
    assert surface["u1"] - surface["u0"] == pytest.approx(2 * np.pi)
    assert surface["residual"] < 1e-9
    assert not surface["reversed"]
    assert Counter(shape.arcs["kind"]) == {"circle": 2}
    assert shape.arcs["radius"] == pytest.approx([50, 50])
    assert shape.arcs["length"] == pytest.approx([100 * np.pi] * 2)
    assert Counter(shape.arcs["convexity"]) == {"convex": 2}
    assert np.abs(shape.arcs["angle"]) == pytest.approx([np.pi / 2] * 2)
    # The vertices' normals are those of the cylinder, the samples lie on the circles.
    mesh = shape.mesh
    on = np.unique(mesh.triangles[mesh.triangle_surfaces == row])
    radial = mesh.vertices[on] * [1, 1, 0] / 50
    assert np.allclose(mesh.normals[on], radial, atol=1e-6)
    points = shape.samples.points.values.reshape(-1, 3)
    assert np.allclose(np.linalg.norm(points[:, :2], axis=1), 50)
    assert np.allclose(np.abs(points[:, 2]), 100)
    assert len(points) == pytest.approx(200 * np.pi, rel=0.05)
    normals = [n.values.reshape(-1, 3)[:, 2] for n in (shape.samples.normals_a, shape.samples.normals_b)]
    assert np.allclose(np.sort(np.abs(np.array(normals)), axis=0).T, [0, 1], atol=1e-6)


MAKERS = {
    "cone": lambda: trimesh.creation.cone(radius=8, height=20, sections=40),
    "sphere": lambda: trimesh.creation.icosphere(subdivisions=2, radius=7),
    "torus": lambda: trimesh.creation.torus(major_radius=12, minor_radius=4, major_sections=32, minor_sections=16),
}


@pytest.mark.parametrize(("kind", "single"), [(kind, kind != "sphere") for kind in MAKERS] + [("cone", False)])
def test_curved_bodies_are_found_wherever_they_lie(kind: str, single: bool) -> None:
    mesh = MAKERS[kind]()
    middle_from_mesh = trimesh.transformations.random_rotation_matrix(np.array([0.1, 0.5, 0.3]))
    middle_from_mesh[:3, 3] = [40, -30, 20]
    mesh.apply_transform(middle_from_mesh)
    if single:
        mesh.vertices = mesh.vertices.astype(np.float32).astype(float)
    shape = shape_of(mesh)
    kinds = list(shape.surfaces["kind"])
    assert Counter(kinds) == ({"cone": 1, "plane": 1} if kind == "cone" else {kind: 1})
    surface = {name: column[kinds.index(kind)] for name, column in shape.surfaces.items()}
    near = 1e-4 if single else 1e-8
    axis = np.array([surface[f"axis_z_{c}"] for c in "xyz"])
    origin = np.array([surface[f"origin_{c}"] for c in "xyz"])
    if kind == "cone":
        apex = origin - surface["radius"] / np.tan(surface["semi_angle"]) * axis
        assert apex == pytest.approx((middle_from_mesh @ [0, 0, 20, 1])[:3], abs=near)
        assert surface["semi_angle"] == pytest.approx(np.arctan(8 / 20), abs=near)
    else:
        assert origin == pytest.approx(middle_from_mesh[:3, 3], abs=near)
        assert surface["radius"] == pytest.approx(7 if kind == "sphere" else 12, abs=near)
    if kind == "torus":
        assert surface["radius2"] == pytest.approx(4, abs=near)
        assert abs(axis @ middle_from_mesh[:3, 2]) == pytest.approx(1)
        assert surface["v1"] - surface["v0"] == pytest.approx(2 * np.pi)
    assert surface["residual"] < (1e-5 if single else 1e-9)
    assert not surface["reversed"]


def test_an_open_mesh_says_so_and_its_free_edges_have_two_sides() -> None:
    box = trimesh.creation.box(extents=[20, 10, 5])
    lid = np.flatnonzero(box.face_normals[:, 2] > 0.9)
    box.update_faces(np.setdiff1d(np.arange(len(box.faces)), lid))
    shape = shape_of(box)
    assert shape.volume is None
    (finding,) = shape.findings
    assert (finding.kind, finding.value, finding.bound) == ("open_mesh", 4.0, 0.0)
    assert not shape_of(l_bracket()).findings
    free = np.flatnonzero(np.asarray(shape.arcs["convexity"]) == "free")
    assert sorted(shape.arcs["length"][free]) == pytest.approx([10, 10, 20, 20])
    samples = shape.samples
    for arc in range(len(shape.arcs["kind"])):
        normals = [n[arc].reshape(-1, 3) for n in (samples.normals_a, samples.normals_b)]
        cosine = np.sum(normals[0] * normals[1], axis=1)
        assert np.allclose(cosine, -1 if arc in free else 0, atol=1e-6)
        assert np.allclose(np.linalg.norm(normals[0], axis=1), 1, atol=1e-6)


@pytest.mark.parametrize("fit", [True, False])
def test_the_diagonal_of_a_twisted_quad_is_no_edge(fit: bool) -> None:
    """A box whose top is lifted by 1 mm in 20 at one corner: the halves of the top and of two sides turn."""
    box = trimesh.creation.box(extents=[20, 20, 20])
    vertices = np.asarray(box.vertices, float)
    vertices[np.all(vertices == 10, axis=1), 2] += 1.0
    shape = shape_from_triangles(vertices, np.asarray(box.faces, np.int64), fit=fit)
    assert shape is not None
    assert len(shape.arcs["kind"]) == 12
    assert set(shape.arcs["kind"]) == {"line"}
    assert set(shape.arcs["convexity"]) == {"convex"}
    assert len(shape.surfaces["kind"]) == 6


def test_a_scene_becomes_assemblies_and_shared_geometry_stays_shared(tmp_path: Path) -> None:
    scene, bracket = trimesh.Scene(), l_bracket()
    bracket.metadata["units"] = "m"
    move = trimesh.transformations.translation_matrix
    turn = trimesh.transformations.rotation_matrix(0.3, [0, 0, 1])
    scene.add_geometry(bracket, geom_name="bracket", node_name="one", transform=move([1, 2, 3]))
    for name, transform in (("two", turn), ("mirrored", np.diag([-1.0, 1, 1, 1])), ("large", np.diag([2.0, 2, 2, 1]))):
        scene.graph.update(frame_to=name, frame_from="one", geometry="bracket", matrix=transform)
    scene.export(tmp_path / "scene.glb")
    model = read_mesh(tmp_path / "scene.glb")
    assert (model.unit, model.unit_mm) == ("m", 1000.0)
    assert len(model.shapes) == 3  # as given, mirrored, twice as large
    truth = trimesh.load_scene(tmp_path / "scene.glb")
    expected = sorted(abs(g.volume) * 1e9 for g in truth.dump())
    every = PlacedParts(model).of(model.root)
    turns = every.pose[:, :3, :3]
    assert np.allclose(turns @ turns.transpose(0, 2, 1), np.eye(3))
    assert np.linalg.det(turns) == pytest.approx(np.ones(4))
    shapes = [model.shapes[i] for i in every.shape]
    assert sorted(shape.volume or 0.0 for shape in shapes) == pytest.approx(expected)
    points = [s.mesh.vertices @ p[:3, :3].T + p[:3, 3] for s, p in zip(shapes, every.pose, strict=True)]
    low, high = np.min([p.min(axis=0) for p in points], axis=0), np.max([p.max(axis=0) for p in points], axis=0)
    assert np.allclose([low, high], truth.bounds * 1000, atol=1e-2)


@pytest.mark.parametrize("suffix", ["stl", "ply", "obj", "glb", "3mf"])
def test_every_format_gives_fitted_rows_of_the_same_part(suffix: str, tmp_path: Path) -> None:
    """A mesh without a name has that of its file, where none is given."""
    bracket, file = l_bracket(), tmp_path / f"clip.{suffix}"
    bracket.units = "m" if suffix == "glb" else "mm"
    bracket.export(file)
    unit = None if suffix in ("glb", "3mf") else "mm"
    model = read_mesh(file, unit)
    (shape,) = model.shapes
    assert shape.volume == pytest.approx(2500 * (1e9 if suffix == "glb" else 1), rel=1e-6)  # GLB is in metres
    for rows in (shape.surfaces, shape.arcs):
        assert set(rows["provenance"]) == {"fitted"}
        assert np.all(np.asarray(rows["residual"]) < 1e-3)
    if unit:
        assert [p.name for p in model.parts] == [i.name for i in model.assemblies[model.root].instances] == ["clip"]
        assert [p.name for p in read_mesh(file, unit, name="clamp").parts] == ["clamp"]


@pytest.mark.parametrize("form", ["obj", "ply", "stl", "gltf"])
def test_a_byte_order_mark_is_skipped(form: str, tmp_path: Path) -> None:
    box = trimesh.creation.box((10.0, 20.0, 30.0))
    file = tmp_path / f"box.{form}"
    if form == "gltf":
        for name, content in trimesh.exchange.gltf.export_gltf(box.scene()).items():
            (tmp_path / name.replace("model.gltf", file.name)).write_bytes(content)
    else:
        text = {"ply": {"encoding": "ascii"}, "stl": {"file_type": "stl_ascii"}}
        content = box.export(**{"file_type": form, **text.get(form, {})})
        file.write_bytes(content if isinstance(content, bytes) else content.encode())
    file.write_bytes(codecs.BOM_UTF8 + file.read_bytes())
    (shape,) = read_mesh(file, None if form == "gltf" else "mm").shapes
    assert shape.volume == pytest.approx(6000 * (1e9 if form == "gltf" else 1))


@pytest.mark.parametrize(("suffix", "unit", "cure"), [("stl", None, "give one"), ("glb", "mm", "leave --unit out")])
def test_a_unit_is_asked_for_where_a_format_has_none(suffix: str, unit: str | None, cure: str, tmp_path: Path) -> None:
    l_bracket().export(tmp_path / f"part.{suffix}")
    with pytest.raises(InputError, match=cure):
        read_mesh(tmp_path / f"part.{suffix}", unit)


@pytest.mark.parametrize("faces", ["", "f 1 1 2\n", "f 1 2 3\n"])
def test_a_mesh_without_area_is_refused(faces: str, tmp_path: Path) -> None:
    (tmp_path / "part.obj").write_text("v 0 0 0\nv 1 0 0\nv 2 0 0\n" + faces)
    with pytest.raises(InputError, match="part"):
        read_mesh(tmp_path / "part.obj", "mm")


def test_round_parts_have_the_areas_by_kind_of_their_exact_model() -> None:
    meshed: dict[str, Any] = {"_P": replace(triangulation._P, chord_mm=0.1, chord_rad=0.4), "_ALGORITHMS": ("Watson",)}
    with mock.patch.multiple(triangulation, **meshed):  # as the CAD kernel's mesher makes them by default
        exact = step_shape.extract(rounded())
    shape = shape_from_triangles(
        exact.mesh.vertices.astype(np.float32).astype(float), exact.mesh.triangles.astype(np.int64)
    )
    assert shape is not None
    kinds = np.asarray(exact.surfaces["recognised_kind"])
    for kind in ("plane", "cylinder", "cone", "sphere", "torus"):
        true = np.asarray(exact.surfaces["area"])[kinds == kind].sum()
        found = np.asarray(shape.surfaces["area"])[np.asarray(shape.surfaces["kind"]) == kind].sum()
        assert found == pytest.approx(true, rel=0.03, abs=1e-6)


@pytest.mark.parametrize(("old", "new"), [("3 2 1 0", "3 2 1 99"), (" 5.00000000", " nan"), ("30.0", "3e30")])
def test_damaged_numbers_are_refused(old: str, new: str, tmp_path: Path) -> None:
    path = tmp_path / "part.ply"
    text = l_bracket().export(file_type="ply", encoding="ascii").decode()
    path.write_text(text)
    assert read_mesh(path, "mm").shapes[0].volume == pytest.approx(2500)
    assert old in text
    path.write_text(text.replace(old, new))
    with pytest.raises(InputError, match="export it again"):
        read_mesh(path, "mm")


def gltf_of_a_bracket(path: Path, **changed: object) -> Path:
    """A glTF file with the bracket's triangles, the first 9 in one accessor, the others in another; sizes are mm."""
    bracket = l_bracket()
    raw = np.asarray(bracket.faces, "<u4").tobytes() + np.asarray(bracket.vertices * 1e-3, "<f4").tobytes()
    count = bracket.faces.size
    (path.parent / "bracket.bin").write_bytes(raw)
    tree = {
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": len(raw), "uri": "bracket.bin"}],
        "bufferViews": [
            {"buffer": 0, "byteLength": 4 * count},
            {"buffer": 0, "byteOffset": 4 * count, "byteLength": len(raw) - 4 * count},
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5125, "count": 27, "type": "SCALAR"},
            {"bufferView": 0, "byteOffset": 108, "componentType": 5125, "count": count - 27, "type": "SCALAR"},
            {"bufferView": 1, "componentType": 5126, "count": len(bracket.vertices), "type": "VEC3"},
        ],
        "materials": [{"pbrMetallicRoughness": {"baseColorFactor": [*rgb, 1]}} for rgb in ((1, 0, 0), (0, 0, 1))],
        "meshes": [
            {"primitives": [{"attributes": {"POSITION": 2}, "indices": i, "material": i} for i in (0, 1)], "name": "L"}
        ],
        "nodes": [{"mesh": 0, "name": "here"}],
        "scenes": [{"nodes": [0]}],
    }
    path.write_text(json.dumps(tree | changed))
    return path


@pytest.mark.parametrize(
    "changed",
    [{"accessors": []}, {"accessors": None}, {"bufferViews": [{}]}, {"meshes": 5}, {"nodes": [{"mesh": "L"}]}],
    ids=str,
)
def test_a_gltf_file_that_contradicts_itself_is_told_so(changed: dict[str, object], tmp_path: Path) -> None:
    """In words about the file, not in those of the parser about itself."""
    path = gltf_of_a_bracket(tmp_path / "part.gltf", **changed)
    with pytest.raises(InputError) as refused:
        read_mesh(path)
    fault = "what it says of its meshes is incomplete or does not fit together"
    assert str(refused.value) == f"part.gltf cannot be read as GLTF ({fault}): export it again"


def test_the_head_of_a_file_says_what_is_wrong_with_it(tmp_path: Path) -> None:
    path = gltf_of_a_bracket(tmp_path / "part.gltf")
    text = path.read_bytes()
    glb = l_bracket().export(file_type="glb")
    cases = [
        ("a.glb", glb[: len(glb) // 2], "it is cut off"),
        ("a.glb", glb[:4] + b"\1" + glb[5:], "it is of version 1 of glTF, not 2"),
        ("a.glb", text, "it does not begin as GLB does"),
        ("a.3mf", glb, "it does not begin as 3MF does"),
        ("a.stl", l_bracket().export(file_type="stl")[:-30] + b"\xff", "it is neither text nor as long as it says"),
        ("a.ply", glb, "it does not begin as PLY does"),
        ("a.gltf", text[:80], "its JSON ends or goes wrong at line 1, column"),
        ("b.gltf", text.replace(b"bracket.bin", b"gone.bin"), "it refers to gone.bin, which is not in its folder"),
        ("b.gltf", text.replace(b"bracket.bin", b"../gone.bin"), "it refers to a file outside its folder"),
    ]
    for name, content, fault in cases:
        (tmp_path / name).write_bytes(content)
        with pytest.raises(InputError, match=rf"^{name} cannot be read as [A-Z3]+ \({fault}[^()]*\): export it again$"):
            read_mesh(tmp_path / name, "mm" if name in ("a.ply", "a.stl") else None)


def obj_of_brackets(path: Path) -> Path:
    """Two brackets as objects, the first of them in two materials."""
    (path.parent / "paint.mtl").write_text("newmtl red\nKd 1 0 0\nnewmtl blue\nKd 0 0 1\n")
    bracket = l_bracket()
    n = len(bracket.vertices)
    lines = ["mtllib paint.mtl"]
    lines += [f"v {x + 50 * i} {y} {z}" for i in range(2) for x, y, z in bracket.vertices.tolist()]
    first, other = ([f"f {a} {b} {c}" for a, b, c in (bracket.faces + 1 + i * n).tolist()] for i in range(2))
    lines += ["o two", "usemtl red", *first[:9], "usemtl blue", *first[9:], "o one", "usemtl blue", *other]
    path.write_text("\n".join(lines) + "\n")
    return path


def test_a_body_in_two_colours_is_one_body(tmp_path: Path) -> None:
    model = read_mesh(gltf_of_a_bracket(tmp_path / "part.gltf"))
    assert [(p.name, p.colour) for p in model.parts] == [("L", None)]
    assert model.shapes[0].volume == pytest.approx(2500)
    model = read_mesh(obj_of_brackets(tmp_path / "part.obj"), "mm")
    assert {(p.name, p.colour) for p in model.parts} == {("two", None), ("one", "#0000ff")}
    assert [s.volume for s in model.shapes] == pytest.approx([2500, 2500])


def test_nodes_nest_as_deep_as_they_like(tmp_path: Path) -> None:
    deep = 1100
    turn = [0.0, 0.0, float(np.sin(0.005)), float(np.cos(0.005))]  # 0.01 rad about z
    nodes = [{"children": [i + 1], "rotation": turn} for i in range(deep)] + [{"mesh": 0}]
    model = read_mesh(gltf_of_a_bracket(tmp_path / "part.gltf", nodes=nodes))
    assert len(model.assemblies) == deep + 1
    pose, (instance,) = np.eye(4), model.assemblies[model.root].instances
    while instance.kind == "assembly":
        pose = pose @ instance.parent_from_child
        (instance,) = model.assemblies[instance.child].instances
    assert np.arctan2(pose[1, 0], pose[0, 0]) % (2 * np.pi) == pytest.approx(0.01 * deep % (2 * np.pi), abs=1e-3)


@pytest.mark.parametrize(
    ("nodes", "roots"),
    [
        ([{"children": [1]}, {"children": [0], "mesh": 0}], [0]),
        ([{"children": [2]}, {"children": [2]}, {"mesh": 0}], [0, 1]),
    ],
)
def test_nodes_that_form_no_tree_are_refused(nodes: list[object], roots: list[int], tmp_path: Path) -> None:
    path = gltf_of_a_bracket(tmp_path / "part.gltf", nodes=nodes, scenes=[{"nodes": roots}])
    with pytest.raises(InputError, match="stands in itself or in two nodes"):
        read_mesh(path)


@pytest.mark.parametrize(
    ("middles", "sizes", "count"),
    [
        ([(0, 0, 0), (30, 0, 0)], [20, 5], 2),  # apart
        ([(0, 0, 0), (0, 0, 0)], [20, 5], 1),  # one in the other: a hollow, if it is turned inside out
        ([(0, 0, 0), (12.5, 0, 0)], [20, 5], 1),  # on each other
        ([(0, 0, 0), (30, 0, 0)], [20, -5], 1),  # apart, and one is open
    ],
)
def test_solids_that_lie_apart_are_parts(
    middles: list[tuple[float, float, float]], sizes: list[float], count: int, tmp_path: Path
) -> None:
    boxes = [trimesh.creation.box([abs(size)] * 3) for size in sizes]
    for box, middle in zip(boxes, middles, strict=True):
        box.apply_translation(middle)
    if min(sizes) < 0:
        boxes[1].update_faces(np.arange(12) > 1)
    path = tmp_path / "blocks.obj"
    trimesh.util.concatenate(boxes).export(path)
    model = read_mesh(path, "mm")
    volumes = [shape.volume for shape in model.shapes]
    assert len(model.parts) == count
    if count == 2:
        assert [part.name for part in model.parts] == ["blocks 1", "blocks 2"]
        assert sorted(v for v in volumes if v is not None) == pytest.approx([125, 8000])


@pytest.mark.parametrize("behind", [b"\0", b"\n", b"\xff" * 50, b"COLOR=\x80" * 1000], ids=len)
def test_bytes_behind_the_last_triangle_are_left_out(behind: bytes, tmp_path: Path) -> None:
    (tmp_path / "part.stl").write_bytes(l_bracket().export(file_type="stl") + behind)
    model = read_mesh(tmp_path / "part.stl", "mm")
    assert model.shapes[0].volume == pytest.approx(2500)
    assert [(f.kind, f.value) for f in model.findings] == [("left_out", len(behind))]


def test_an_archive_that_unpacks_to_too_much_is_not_unpacked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with zipfile.ZipFile(tmp_path / "part.3mf", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("3D/3dmodel.model", " " * (1 << 22))
    monkeypatch.setattr(read, "_MOST_BYTES", 1 << 20)
    assert (tmp_path / "part.3mf").stat().st_size < 1 << 20
    with pytest.raises(InputError, match="larger than 1 MB"):
        read_mesh(tmp_path / "part.3mf")


@pytest.mark.data
def test_the_mesh_of_a_part_has_the_surfaces_and_features_of_its_model(data_dir: Path) -> None:
    (shape,) = read_mesh(data_dir / "mesh" / "featuretype.STL", "in").shapes
    (model,) = shared(data_dir / "step" / "featuretype.STEP").shapes
    assert Counter(f.kind for f in recognise(shape)) == Counter(f.kind for f in recognise(model))
    exact = model.surfaces
    for kind, share in (("cylinder", 0.95), ("plane", 0.95)):
        found = np.flatnonzero(np.asarray(shape.surfaces["kind"]) == kind)
        true = np.flatnonzero(np.asarray(exact["recognised_kind"]) == kind)
        area = [np.asarray(t["area"])[rows].sum() for t, rows in ((shape.surfaces, found), (exact, true))]
        assert area[0] == pytest.approx(area[1], rel=0.02)
        if kind == "cylinder":
            radii = np.unique(np.round(np.asarray(exact["radius"], float)[true], 2))
            right = np.abs(np.asarray(shape.surfaces["radius"])[found][:, None] - radii).min(axis=1) < 0.01
            assert right.mean() >= share
