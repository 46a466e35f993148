"""Robots from URDF: what is read against chains composed by hand, and what is refused."""

from __future__ import annotations

import hashlib
from pathlib import Path

import numpy as np
import pytest
import sqlalchemy as sa
import trimesh
from scipy.spatial.transform import Rotation

from relmodel.errors import InputError
from relmodel.readers.urdf import read_urdf
from relmodel.store import Store
from tests.reading import load

TWO = """<link name="a"/><link name="b"/>
<joint name="j" type="continuous"><parent link="a"/><child link="b"/></joint>"""


def written(folder: Path, body: str, name: str = "bot") -> Path:
    path = folder / "bot.urdf"
    path.write_text(f'<?xml version="1.0"?><robot name="{name}">{body}</robot>')
    return path


def visual(geometry: str, extra: str = "") -> str:
    return f'<link name="a"><visual>{extra}<geometry>{geometry}</geometry></visual></link>'


def test_links_joints_and_primitives(tmp_path: Path) -> None:
    model = read_urdf(
        written(
            tmp_path,
            """
<material name="red"><color rgba="1 0 0.5 1"/></material>
<link name="base"><visual name="foot"><origin xyz="0 0 0.1"/><geometry><box size="0.2 0.3 0.1"/></geometry>
  <material name="red"/></visual></link>
<link name="arm">
  <visual><origin xyz="0.1 0.2 0.3" rpy="0.4 -0.5 0.6"/>
    <geometry><cylinder radius="0.03" length="0.4"/></geometry></visual>
  <visual><geometry><sphere radius="0.05"/></geometry></visual>
  <collision><geometry><box size="9 9 9"/></geometry></collision></link>
<link name="tool"><collision><geometry><box size="0.2 0.3 0.1"/></geometry></collision></link>
<joint name="wrist" type="fixed"><parent link="arm"/><child link="tool"/><origin xyz="0 0 0.4"/></joint>
<joint name="lift" type="prismatic"><parent link="base"/><child link="arm"/><origin xyz="1 0 0" rpy="0.1 0.2 0.3"/>
  <axis xyz="0 0 2"/><limit lower="0.1" upper="0.7" effort="1" velocity="1"/></joint>
""",
        )
    )
    root = model.assemblies[model.root]
    assert (root.kind, model.unit, model.unit_mm) == ("robot", "m", 1000.0)
    assert [i.name for i in root.instances] == ["base", "arm", "tool"]
    lift, wrist = root.joints
    assert (lift.name, lift.kind, lift.lower, lift.upper) == ("lift", "prismatic", 100.0, 700.0)
    assert lift.axis == pytest.approx([0, 0, 1])
    assert (wrist.name, wrist.kind, wrist.lower) == ("wrist", "fixed", None)
    # At rest the lift stands at its lower limit, 100 mm.
    turn = Rotation.from_euler("xyz", [0.1, 0.2, 0.3]).as_matrix()
    placed = {i.name: i.parent_from_child for i in root.instances}
    assert np.abs(placed["arm"][:3, :3] - turn).max() < 1e-12
    assert placed["arm"][:3, 3] == pytest.approx([1000, 0, 0] + turn @ [0, 0, 100])
    assert placed["tool"][:3, 3] == pytest.approx([1000, 0, 0] + turn @ [0, 0, 500])
    base, arm, tool = (model.assemblies[i.child] for i in root.instances)
    assert (base.instances[0].name, model.parts[base.instances[0].child].colour) == ("foot", "#ff0080")
    tube = arm.instances[0].parent_from_child
    assert np.abs(tube[:3, :3] - Rotation.from_euler("xyz", [0.4, -0.5, 0.6]).as_matrix()).max() < 1e-12
    assert tube[:3, 3] == pytest.approx([100, 200, 300])
    shapes = [model.shapes[model.parts[e.child].shape] for link in (base, arm, tool) for e in link.instances]
    assert shapes[0] is shapes[3]  # the same box, made once
    assert [s.volume for s in shapes[:3]] == pytest.approx(
        [200 * 300 * 100, np.pi * 30**2 * 400, 4 / 3 * np.pi * 50**3], rel=1e-12
    )


def test_meshes_are_scaled_shared_and_stay_in_the_folder(tmp_path: Path) -> None:
    (tmp_path / "meshes").mkdir()
    trimesh.creation.box((100, 200, 300)).export(tmp_path / "meshes" / "block.stl")  # in mm
    trimesh.creation.box((0.1, 0.2, 0.3)).export(tmp_path / "meshes" / "block.glb")
    mm = '<mesh filename="package://robot/meshes/block.stl" scale="0.001 0.001 0.001"/>'
    model = read_urdf(
        written(
            tmp_path,
            f"""<link name="a">
<visual><geometry>{mm}</geometry></visual><visual><origin xyz="1 0 0"/><geometry>{mm}</geometry></visual>
<visual><geometry><mesh filename="meshes/block.glb"/></geometry></visual>
<visual><geometry><mesh filename="meshes/block.stl" scale="-0.001 0.002 0.001"/></geometry></visual></link>""",
        )
    )
    instances = model.assemblies[model.root - 1].instances
    assert instances[0].child == instances[1].child
    assert instances[1].parent_from_child[:3, 3] == pytest.approx([1000, 0, 0])
    volumes = [model.shapes[model.parts[i.child].shape].volume for i in instances]
    assert volumes == pytest.approx([6e6, 6e6, 6e6, 12e6], rel=1e-6)
    assert model.assemblies[model.root].kind == "assembly"  # no joint


@pytest.mark.parametrize("folder", ["", "urdf", "description/urdf"])
@pytest.mark.parametrize("package", ["arm", "tools"])
def test_meshes_of_packages_are_found_from_any_folder(folder: str, package: str, tmp_path: Path) -> None:
    """Of the package that the file lies in, whatever its folder is called, and of one beside it."""
    for root, name in (("arm_description", "arm"), ("tools", "tools")):
        (tmp_path / root / "meshes").mkdir(parents=True)
        (tmp_path / root / "package.xml").write_text(f"<package format='3'><name>{name}</name></package>")
    trimesh.creation.box((0.1, 0.2, 0.3)).export(tmp_path / "arm_description/meshes/arm.stl")
    trimesh.creation.box((0.1, 0.1, 0.1)).export(tmp_path / "tools/meshes/tools.stl")
    (tmp_path / "arm_description" / folder).mkdir(parents=True, exist_ok=True)
    mesh = f'<mesh filename="package://{package}/meshes/{package}.stl"/>'
    model = read_urdf(written(tmp_path / "arm_description" / folder, visual(mesh)))
    assert model.shapes[0].volume == pytest.approx({"arm": 6e6, "tools": 1e6}[package], rel=1e-6)


@pytest.mark.parametrize(
    ("body", "said"),
    [
        ("", "has no link"),
        ("<link/>", "a link has no name"),
        ('<link name="a"/><link name="a"/>', "is defined twice"),
        ('<link name="a"/><link name="b"/>', "have no parent joint"),
        (TWO.replace("continuous", "floating"), "kind 'floating', which moves in several ways"),
        (TWO.replace("continuous", "hinge"), "kind 'hinge', which is not known"),
        (TWO.replace("continuous", "revolute"), "has no <limit>"),
        (TWO.replace('<parent link="a"/>', ""), "no <parent>"),
        (TWO.replace('<parent link="a"/>', '<parent link="c"/>'), "link 'c'"),
        (TWO.replace("</joint>", '<axis xyz="0 0 0"/></joint>'), "axis of length zero"),
        (TWO.replace("</joint>", '<origin xyz="1 2"/></joint>'), "3 numbers"),
        (TWO.replace("</joint>", '<origin rpy="1 2 nan"/></joint>'), "3 numbers"),
        (TWO.replace("</joint>", '<origin xyz="0 -1e300 0"/></joint>'), "farther off than 100 km"),
        (TWO.replace("continuous", "prismatic").replace("</joint>", '<limit lower="2" upper="1"/></joint>'), "above"),
        (visual('<sphere radius="x"/>'), "give a number"),
        (visual('<sphere radius="1"/>', '<material name="m"><color rgba="1 0"/></material>'), "4 numbers"),
        (visual('<mesh filename="../secret.stl"/>'), "outside the file's folder"),
        (visual('<mesh filename="/etc/passwd.stl"/>'), "outside the file's folder"),
        (visual('<mesh filename="package://p/../../x.stl"/>'), "outside the file's folder"),
        (visual('<mesh filename="file:///etc/passwd"/>'), "into the URDF's folder"),
        (visual('<mesh filename="package://p/none.stl"/>'), "not in the file's folder"),
        (visual('<mesh filename="package:///etc/x.stl"/>'), "outside the file's folder"),
        (visual('<mesh filename="package://../x.stl"/>'), "outside the file's folder"),
        ('<xacro:macro xmlns:xacro="x" name="m"/>', "expand it first"),
    ],
)
def test_bad_robots_are_refused(body: str, said: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=said):
        read_urdf(written(tmp_path, body))


@pytest.mark.parametrize(
    ("geometry", "said"),
    [
        ('<box size="0 0 0"/>', "no extent"),
        ('<box size="1 0 1"/>', "no extent"),
        ('<box size="1 -1 1"/>', "no extent"),
        ('<box size="1e-12 1e-12 1e-12"/>', "no extent"),
        ('<cylinder radius="0" length="1"/>', "no extent"),
        ('<cylinder radius="1e-12" length="1"/>', "no extent"),
        ('<sphere radius="0"/>', "no extent"),
        ('<mesh filename="part.stl" scale="0 1 1"/>', "scaled to nothing"),
        ('<mesh filename="part.dae"/>', "convert it"),
        ('<mesh filename="gone.DAE"/>', "convert it"),
        ('<mesh filename="/etc/passwd"/>', "convert it"),
        ('<capsule radius="1" length="2"/>', "<capsule>"),
        ('<drake:ellipsoid a="1"/>', "<drake:ellipsoid>"),
        ("", "no box, cylinder, sphere or mesh"),
    ],
)
def test_odd_geometry_is_left_out_and_that_for_collisions_stands_in(geometry: str, said: str, tmp_path: Path) -> None:
    """Of the collisions, too, what is odd is left out; where nothing is left the link is empty."""
    trimesh.creation.box((0.1, 0.2, 0.3)).export(tmp_path / "part.stl")
    odd = f"<geometry>{geometry}</geometry>"
    good = '<geometry><mesh filename="part.stl"/></geometry>'
    other = '<geometry><box size="1 1 1"/></geometry>'
    cases = [  # what the link holds, its volumes, and its findings
        (f"<visual>{odd}</visual><collision>{good}</collision><collision>{odd}</collision>", [6e6], 2),
        (f"<visual>{odd}</visual><visual>{other}</visual><collision>{good}</collision>", [1e9], 1),
        (f"<visual>{odd}</visual>", [], 1),
        (f"<collision>{odd}</collision>", [], 1),
    ]
    for body, volumes, count in cases:
        model = read_urdf(written(tmp_path, f'<link name="a">{body}</link>'))
        assert [shape.volume for shape in model.shapes] == pytest.approx(volumes)
        assert [finding.kind for finding in model.findings] == ["left_out"] * count
        assert all(said in finding.message and "'a'" in finding.message for finding in model.findings)
        assert [i.name for i in model.assemblies[model.root].instances] == ["a"]


def test_slashes_in_names_become_underscores(tmp_path: Path) -> None:
    """In links, joints and all that refers to them; the leader of the mimic moves along, the follower turns."""
    body = f"""{visual('<box size="1 1 1"/>').replace('"a"', '"/a"')}<link name="arm/b"/><link name="/c"/>
<joint name="/j" type="prismatic"><parent link="/a"/><child link="arm/b"/><limit lower="0" upper="2"/></joint>
<joint name="k" type="revolute"><parent link="arm/b"/><child link="/c"/><limit lower="0" upper="1"/>
<mimic joint="/j" multiplier="0.5"/></joint>"""
    path = written(tmp_path, body)
    model = read_urdf(path)
    root = model.assemblies[model.root]
    assert [i.name for i in root.instances] == ["_a", "arm_b", "_c"]
    assert [(j.name, j.parent, j.child) for j in root.joints] == [("_j", "_a", "arm_b"), ("k", "arm_b", "_c")]
    mimic = root.joints[1].mimic
    assert mimic is not None
    assert (mimic.joint, mimic.factor) == ("_j", 0.5 / 1000)  # rad a mm
    assert [(f.kind, f.value) for f in model.findings] == [("renamed", 4.0)]


@pytest.mark.parametrize("prefix", ["", "u:"])
def test_names_of_other_namespaces_are_passed_over(prefix: str, tmp_path: Path) -> None:
    """Attributes and elements anywhere, and a prefix of all that is URDF's own."""
    tags = ("robot", "link", "visual", "geometry", "box")
    text = """<robot name="r" xmlns="http://www.ros.org" xmlns:drake="http://drake.mit.edu" foo:bar="1"><drake:x/>
<gazebo><plugin/></gazebo><link name="a" foo:bar="2"><sensor/><visual><drake:y/><geometry><drake:declare_convex/>
<box size="1 1 1" foo:bar="3"><z/></box></geometry></visual></link></robot>"""
    for tag in tags:
        text = text.replace(f"<{tag}", f"<{prefix}{tag}").replace(f"</{tag}", f"</{prefix}{tag}")
    (tmp_path / "bot.urdf").write_text(text)
    model = read_urdf(tmp_path / "bot.urdf")
    assert [shape.volume for shape in model.shapes] == pytest.approx([1e9])
    assert not model.findings


def test_findings_of_a_mesh_are_those_of_the_robot(tmp_path: Path) -> None:
    (tmp_path / "part.stl").write_bytes(trimesh.creation.box((1, 1, 1)).export(file_type="stl") + b"\0\0")
    model = read_urdf(written(tmp_path, visual('<mesh filename="part.stl"/>')))
    assert [(f.kind, f.value) for f in model.findings] == [("left_out", 2.0)]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('<!DOCTYPE robot [<!ENTITY a "aaaa">]><robot name="&a;"/>', "document type"),
        ('<!DOCTYPE robot SYSTEM "file:///etc/passwd"><robot name="r"/>', "document type"),
        ('<robot name="&a;"/>', "not well-formed XML"),
        ('<robot name="a"><link', "not well-formed XML"),
        ("", "not well-formed XML"),
        ('<?xml version="1.0" encoding="nonsense"?><robot/>', "not well-formed XML"),
        ("<sdf/>", "begins with <sdf>"),
    ],
)
def test_bad_xml_is_refused(text: str, said: str, tmp_path: Path) -> None:
    path = tmp_path / "bot.urdf"
    path.write_text(text)
    with pytest.raises(InputError, match=said):
        read_urdf(path)


def test_a_mesh_behind_a_link_is_refused(tmp_path: Path) -> None:
    (tmp_path / "inside").mkdir()
    (tmp_path / "secret.stl").write_text("solid x\nendsolid x\n")
    (tmp_path / "inside" / "part.stl").symlink_to(tmp_path / "secret.stl")
    with pytest.raises(InputError, match="outside the file's folder"):
        read_urdf(written(tmp_path / "inside", visual('<mesh filename="part.stl"/>')))


def test_a_load_notes_the_meshes_it_read(tmp_path: Path, duckdb_file: Path) -> None:
    trimesh.creation.box((1, 2, 3)).export(tmp_path / "block.stl")
    path = written(tmp_path, visual('<mesh filename="block.stl"/>'))
    with Store.open(duckdb_file) as store:
        load(store, path, name="bot")
        with pytest.raises(InputError, match="into the URDF's folder"):
            load(store, written(tmp_path, visual('<mesh filename="http://x/y.stl"/>')), name="bot")
        given = store.table("run_input")
        with store.read() as connection:
            rows = connection.execute(sa.select(given).order_by("run_id", "input_no")).mappings().all()
            refused = connection.execute(sa.text("SELECT count(*) FROM load_report WHERE status = 'refused'")).scalar()
    assert [(r["role"], r["name"]) for r in rows] == [
        ("mesh 0", "block.stl"), ("model", "bot.urdf"), ("model", "bot.urdf"),
    ]  # fmt: skip
    assert rows[0]["sha256"] == hashlib.sha256((tmp_path / "block.stl").read_bytes()).hexdigest()
    assert refused == 1
