"""World files: what is read and what is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from relmodel.errors import InputError
from relmodel.world import read_world_file

TURNED = "[[0, -1, 0, 250], [1, 0, 0, 0], [0, 0, 1, 80], [0, 0, 0, 1]]"


def written(folder: Path, text: str) -> Path:
    path = folder / "world.yaml"
    path.write_text(text)
    return path


def test_all_that_a_file_says(tmp_path: Path) -> None:
    (tmp_path / "head.yaml").write_text("cameras: {}")
    file = read_world_file(
        written(
            tmp_path,
            f"""
world: cell 5
objects:
  - object: bulkhead
  - {{object: bulkhead, variant: b, name: second, role: fixture, world_from_object: {TURNED}}}
rigs:
  - {{name: head, file: head.yaml}}
mounts:
  - {{rig: head, on: second, link: flange, carrier_from_rig: {TURNED}}}
  - {{rig: head, on: bulkhead}}
""",
        )
    )
    first, second = file.objects
    assert (file.world, first.name, first.variant, first.role) == ("cell 5", "bulkhead", "", "inspected")
    assert first.world_from_object is not None
    assert second.world_from_object is not None
    assert np.array_equal(first.world_from_object, np.eye(4))
    assert (second.name, second.variant, second.role) == ("second", "b", "fixture")
    assert np.array_equal(second.world_from_object, [[0, -1, 0, 250], [1, 0, 0, 0], [0, 0, 1, 80], [0, 0, 0, 1]])
    assert file.rigs == {"head": (tmp_path / "head.yaml").resolve()}
    assert [(m.on, m.link) for m in file.mounts] == [("second", "flange"), ("bulkhead", None)]


def test_a_rounded_rotation_is_taken_for_the_nearest(tmp_path: Path) -> None:
    rounded = "[[0.8660254, -0.5, 0, 1], [0.5, 0.86603, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]]"
    file = read_world_file(written(tmp_path, f"world: w\nobjects: [{{object: a, world_from_object: {rounded}}}]"))
    pose = file.objects[0].world_from_object
    assert pose is not None
    rotation = pose[:3, :3]
    assert np.abs(rotation @ rotation.T - np.eye(3)).max() < 1e-12
    assert np.abs(rotation - [[0.8660254, -0.5, 0], [0.5, 0.86603, 0], [0, 0, 1]]).max() < 1e-5


def placed(matrix: str) -> str:
    return f"world: w\nobjects: [{{object: a, world_from_object: {matrix}}}]"


MOUNTED = "\nmounts: [{object: a, on: b}]"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "not a mapping"),
        ("world: [", "not valid YAML at line 1"),
        ("world: w", "objects is missing or empty"),
        ("objects: [{object: a}]", "lacks world"),
        ("world: w\nobjects: [{object: a}]\nworld: v", "key 'world' twice, at line 3"),
        ("world: w\nobjects: [{object: a, role: tool, role: robot}]", "key 'role' twice, at line 2"),
        ("world: w\nobjects: {object: a}", "objects is not a list"),
        ("world: w\nobjects: [a]", r"objects\[0\] is not a mapping"),
        ("world: w\nobjects: [{name: a}]", r"objects\[0\] lacks object"),
        ("world: w\nobjects: [{object: a, rol: tool}]", "unknown key 'rol'"),
        ("world: w\nobjects: [{object: a, role: hero}]", "unknown role 'hero'"),
        ("world: w\nobjects: [{object: a, name: b/c}]", "slash"),
        ("world: w\nobjects: [{object: a}, {object: a}]", "name 'a' twice"),
        (placed("[[1, 0, 0], [0, 1, 0], [0, 0, 1]]"), "shape"),
        (placed("[[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, x], [0, 0, 0, 1]]"), "not made of numbers"),
        (placed("[[1, 0, 0, .nan], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]"), "not finite"),
        (placed("[[1, 0, 0, 0], [0, 1, 0, 1.0e+300], [0, 0, 1, 0], [0, 0, 0, 1]]"), "farther off than 100 km"),
        (placed("[[1, 0, 0, 0], [0, 1, 0, -1.1e+8], [0, 0, 1, 0], [0, 0, 0, 1]]"), "farther off than 100 km"),
        (placed("[[2, 0, 0, 0], [0, 2, 0, 0], [0, 0, 2, 0], [0, 0, 0, 1]]"), "not a rotation"),
        (placed("[[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, -1, 0], [0, 0, 0, 1]]"), "not a rotation"),
        (placed("[[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [5, 0, 0, 1]]"), "not a rotation"),
        ("world: w\nobjects: [{object: a}]\nrigs: [{name: r, file: ../r.yaml}]", "outside"),
        ("world: w\nobjects: [{object: a}]\nrigs: [{name: r, file: r.yaml}]", "not there"),
        ("world: w\nobjects: [{object: a}]\nmounts: [{rig: r, on: a}]", "not among the file's rigs"),
        (
            "world: w\nobjects: [{object: a}]\nrigs: [{name: r, file: world.yaml}]\nmounts: [{rig: r, on: b}]",
            "not among the file's objects: a",
        ),
        ("world: w\nobjects: [{object: a}]\nmounts: [{object: b, on: a}]", "not among the file's objects: a"),
        ("world: w\nobjects: [{object: a}]\nmounts: [{object: a, on: a}]", "form a cycle, a on a"),
        (
            "world: w\nobjects: [{object: a}, {object: b}]\nmounts: [{object: a, on: b}, {object: a, on: b}]",
            "mounts has the name 'a' twice",
        ),
        (placed("[[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]") + MOUNTED, "leave one of them out"),
    ],
)
def test_what_is_refused(tmp_path: Path, text: str, said: str) -> None:
    with pytest.raises(InputError, match=said):
        read_world_file(written(tmp_path, text))


def test_a_file_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"^there is no world file .*none\.yaml: check its name$"):
        read_world_file(tmp_path / "none.yaml")
