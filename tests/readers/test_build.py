"""3MF packages of several model files: boxes of known sizes, placed by transforms composed by hand."""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np
import pytest
import trimesh

from relmodel.errors import InputError
from relmodel.readers.mesh.read import read_mesh
from tests.placed_parts import PlacedParts

CORE = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"
PRODUCTION = "http://schemas.microsoft.com/3dmanufacturing/production/2015/06"
MODEL = "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"


def box(identifier: int, size: tuple[float, float, float], attributes: str = "") -> str:
    """An object: a box from the origin to its size."""
    mesh = trimesh.creation.box(bounds=[(0, 0, 0), size])
    vertices = "".join(f'<vertex x="{x}" y="{y}" z="{z}"/>' for x, y, z in mesh.vertices.tolist())
    faces = "".join(f'<triangle v1="{a}" v2="{b}" v3="{c}"/>' for a, b, c in mesh.faces.tolist())
    content = f"<mesh><vertices>{vertices}</vertices><triangles>{faces}</triangles></mesh>"
    return f'<object id="{identifier}" {attributes}>{content}</object>'


def made_of(identifier: int, *components: str, attributes: str = "") -> str:
    parts = "".join(f"<component {component}/>" for component in components)
    return f'<object id="{identifier}" {attributes}><components>{parts}</components></object>'


def moved(x: float, y: float, z: float) -> str:
    return f'transform="1 0 0 0 1 0 0 0 1 {x} {y} {z}"'


def model_file(objects: str, items: str = "", unit: str = "millimeter") -> str:
    body = f"<resources>{objects}</resources><build>{items}</build>"
    return f'<model unit="{unit}" xmlns="{CORE}" xmlns:p="{PRODUCTION}">{body}</model>'


def package(folder: Path, root: str, root_name: str = "3D/3dmodel.model", **files: str) -> Path:
    """files: other model files by their stems."""
    path = folder / "plate.3mf"
    with zipfile.ZipFile(path, "w") as archive:
        relation = f'<Relationship Id="r" Target="/{root_name}" Type="{MODEL}"/>'
        archive.writestr("_rels/.rels", f"<Relationships>{relation}</Relationships>")
        for stem, text in files.items():
            archive.writestr(f"3D/Objects/{stem}.model", text)
        archive.writestr(root_name, root)
    return path


def boxes_of(path: Path) -> dict[str, tuple[float | None, list[float]]]:
    """Of each placed part, by its path: its volume, and its box in the file's frame, mm."""
    model = read_mesh(path)
    assert not model.findings
    placed = PlacedParts(model)
    every = placed.of(model.root)
    out = {}
    for row, (shape, pose) in enumerate(zip(every.shape, every.pose, strict=True)):
        points = model.shapes[shape].mesh.vertices @ pose[:3, :3].T + pose[:3, 3]
        ends = np.concatenate([points.min(axis=0), points.max(axis=0)])
        out[placed.path(model.root, row)] = model.shapes[shape].volume, ends.tolist()
    return out


def test_objects_are_known_by_file_and_identifier(tmp_path: Path) -> None:
    """Identifier 1 is another box in each of three files; items and components name files, whatever their case."""
    root = model_file(
        box(1, (1, 1, 1), 'name="own"')
        + made_of(
            2, 'objectid="1"', f'objectid="1" p:path="/3D/Objects/b.model" {moved(10, 0, 0)}', attributes='name="pair"'
        ),
        f'<item objectid="2" {moved(0, 0, 100)}/><item objectid="1" p:path="/3d/objects/A.model" {moved(5, 0, 0)}/>',
    )
    a = model_file(box(1, (2, 2, 2), 'name="a"'), '<item objectid="1"/>')  # only the root's build counts
    b = model_file(box(1, (3, 3, 3), 'name="b"'))
    found = boxes_of(package(tmp_path, root, a=a, b=b))
    assert {path: volume for path, (volume, _) in found.items()} == pytest.approx(
        {"pair/own": 1, "pair/b": 27, "a": 8}, rel=1e-9
    )
    assert found["pair/b"][1] == pytest.approx([10, 0, 100, 13, 3, 103])
    assert found["a"][1] == pytest.approx([5, 0, 0, 7, 2, 2])


def test_each_file_is_in_its_own_unit_and_components_nest(tmp_path: Path) -> None:
    """A root in inches with a component in centimetres, which has components of its own there, turned about z."""
    inner = made_of(7, f'objectid="1" {moved(0, 0, 4)}', attributes='name="inner"')
    outer = made_of(8, 'objectid="7" transform="0 1 0 -1 0 0 0 0 1 3 0 0"', attributes='name="outer"')
    centimetres = model_file(box(1, (1, 2, 3), 'name="box"') + inner + outer, unit="centimeter")
    root = model_file(
        made_of(1, f'objectid="8" p:path="/3D/Objects/cm.model" {moved(2, 0, 0)}', attributes='name="top"'),
        f'<item objectid="1" {moved(0, 1, 0)}/>',
        unit="inch",
    )
    ((path, (volume, ends)),) = boxes_of(package(tmp_path, root, cm=centimetres)).items()
    assert path == "top/outer/inner/box"
    assert volume == pytest.approx(6000)
    # Turned, x runs along y and y along -x; 2 in and 3 cm along x, 1 in along y, 4 cm along z.
    assert ends == pytest.approx([50.8 + 30 - 20, 25.4, 40, 50.8 + 30, 25.4 + 10, 70])


def test_the_package_names_its_root_model(tmp_path: Path) -> None:
    root = model_file(box(1, (1, 2, 3)), '<item objectid="1"/>')
    decoy = model_file(box(1, (9, 9, 9)), '<item objectid="1"/>')
    path = package(tmp_path, root, "3D/build.model", decoy=decoy)
    assert [volume for volume, _ in boxes_of(path).values()] == pytest.approx([6])


@pytest.mark.parametrize("kind", ["support", "solidsupport", "other"])
def test_support_and_modifiers_are_no_parts(kind: str, tmp_path: Path) -> None:
    """Neither as components nor as items; the type of an object with components is that of what it is made of."""
    objects = box(1, (1, 1, 1)) + box(2, (5, 5, 5), f'type="{kind}"') + box(3, (2, 2, 2), 'type="surface"')
    objects += made_of(4, 'objectid="1"', 'objectid="2"', 'objectid="3"', attributes=f'type="{kind}"')
    model = read_mesh(package(tmp_path, model_file(objects, '<item objectid="4"/><item objectid="2"/>')))
    assert sorted(shape.volume or 0.0 for shape in model.shapes) == pytest.approx([1, 8])
    ((finding),) = model.findings
    assert (finding.kind, finding.value) == ("left_out", 2.0)
    assert kind in finding.message
    with pytest.raises(InputError, match="holds no triangle of a part"):
        read_mesh(package(tmp_path, model_file(objects, '<item objectid="2"/>')))


def test_what_is_placed_and_not_there_is_a_finding(tmp_path: Path) -> None:
    items = '<item objectid="1"/><item objectid="2"/><item objectid="1" p:path="/3D/Objects/gone.model"/>'
    model = read_mesh(package(tmp_path, model_file(box(1, (1, 1, 1)), items)))
    assert [f.kind for f in model.findings] == ["left_out", "left_out"]
    assert "gone.model" in model.findings[1].message


def test_parts_by_number_and_mirror_images(tmp_path: Path) -> None:
    """Two items of one part number, and one of the same mirrored, which is a shape of its own."""
    objects = box(1, (1, 2, 3), 'name="L"') + made_of(
        2, 'objectid="1"', f'objectid="1" {moved(50, 0, 0)}', attributes='name="pair"'
    )
    objects += made_of(3, 'objectid="2" transform="1 0 0 0 1 0 0 0 -1 0 0 -9"', attributes='name="mirrored"')
    items = f'<item objectid="2" partnumber="P"/><item objectid="2" partnumber="P" {moved(0, 0, 90)}/>'
    path = package(tmp_path, model_file(objects, items + '<item objectid="3"/>', unit="inch"))
    found = boxes_of(path)
    assert list(found) == ["P#0/L#0", "P#0/L#1", "P#1/L#0", "P#1/L#1", "mirrored/pair/L#0", "mirrored/pair/L#1"]
    assert found["P#1/L#1"][1] == pytest.approx(25.4 * np.array([50, 0, 90, 51, 2, 93]))
    assert found["mirrored/pair/L#1"][1] == pytest.approx(25.4 * np.array([50, 0, -12, 51, 2, -9]))
    assert len(read_mesh(path).shapes) == 2


def test_an_archive_that_places_too_much_is_refused(tmp_path: Path) -> None:
    doubled = "".join(made_of(i, *[f'objectid="{i - 1}"'] * 2) for i in range(2, 30))
    with pytest.raises(InputError, match="places more than 100000 objects"):
        read_mesh(package(tmp_path, model_file(box(1, (1, 1, 1)) + doubled, '<item objectid="29"/>')))


def test_files_that_contain_each_other_are_refused(tmp_path: Path) -> None:
    root = model_file(made_of(1, 'objectid="1" p:path="/3D/Objects/a.model"'), '<item objectid="1"/>')
    a = model_file(made_of(1, 'objectid="1" p:path="/3D/3dmodel.model"'))
    with pytest.raises(InputError, match="contains itself"):
        read_mesh(package(tmp_path, root, a=a))
