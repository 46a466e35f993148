"""Faults that people met, a folder each: what `EXPECTED.txt` says is right comes out.

Those that a test of a reader holds by itself have no check here.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
import yaml
from PIL import Image

from relmodel.app.cli.main import main
from relmodel.resources import resource_dir
from tests.app.cli.conftest import halve, halve_cameras, loaded
from vision.cameras.images import read_picture
from vision.extraction.extract import Extraction, extract

__all__ = ["loaded"]  # a fixture
pytestmark = pytest.mark.data


class Said(NamedTuple):
    """How a command ended, and what it printed."""

    status: int
    out: str
    err: str


class Case:
    """The folder of a case, a store of its own, one that has the bulkhead, and the commands as a user gives them."""

    def __init__(self, folder: Path, store: Path, bulkhead: Path, capsys: pytest.CaptureFixture[str]) -> None:
        self.folder, self.store, self.bulkhead, self._capsys = folder, store, bulkhead, capsys

    def run(self, verb: str, *arguments: object) -> Said:
        self._capsys.readouterr()
        status = main([verb, "--store", str(self.store), *map(str, arguments)])
        return Said(status, *self._capsys.readouterr())

    def load(self, *names: str) -> Said:
        unit = ("--unit", "mm") if names[0].endswith(".obj") else ()
        said = self.run("load", *(self.folder / name for name in names), *unit)
        assert said.status == 0, said.err
        return said

    def ask(self, statement: str) -> list[dict[str, Any]]:
        said = self.run("sql", "--format", "json", statement)
        assert said.status == 0, said.err
        rows: list[dict[str, Any]] = json.loads(said.out)
        return rows

    def column(self, statement: str) -> list[Any]:
        return [next(iter(row.values())) for row in self.ask(statement)]

    def parts(self) -> list[float]:
        """Volumes of the placed parts, mm3."""
        return self.column("SELECT volume FROM placed_part JOIN shape ON shape.id = shape_id ORDER BY volume")

    def refusal(self, name: str) -> str:
        """The one sentence with which the rig file is refused."""
        said = self.run("rig", "show", self.folder / name)
        assert (said.status, said.err.count("\n")) == (3, 1), said
        return said.err


def byte_order_mark(case: Case) -> None:
    case.load("m_bom.step")
    assert len(case.parts()) == 6
    assert sum(case.parts()) == pytest.approx(177687.611, abs=1e-3)


def chinese_names(case: Case) -> None:
    case.load("n_gbk.step")
    names = {*case.column("SELECT name FROM part"), *case.column("SELECT name FROM object")}
    assert {"支架零件", "装配体"} <= names or "unread_text" in case.column("SELECT kind FROM load_finding")


def latin_names(case: Case) -> None:
    case.load("n_latin1.step")
    assert case.column("SELECT name FROM part") == ["Größe-Träger"]
    assert "Motorträger" in case.column("SELECT name FROM object")


def names_of_usages(case: Case) -> None:
    case.load("names.step")
    paths = case.column("SELECT object_path FROM placed_part")
    assert "Größe Ø12" in paths
    assert not [path for path in paths if path.startswith("=>")]


def robots(case: Case) -> None:
    case.load("slash.urdf")
    case.load("dae_visual.urdf")
    assert len(case.parts()) == 3
    sizeless = case.folder.parent / "sizeless.urdf"
    link = '<link name="{}"><visual><geometry><box size=".1 .1 .2"/></geometry></visual>{}</link>'
    none = '<collision><geometry><box size="0 0 0"/></geometry></collision>'
    sizeless.write_text(f'<robot name="a">{link.format("base", none)}</robot>')
    assert case.run("load", sizeless).status == 0


def turned_picture(case: Case) -> None:
    """The turn is made, and said."""
    said = case.run("extract", case.folder / "exif180.jpg")
    assert (said.status, "turned by 180 degrees" in said.err) == (0, True)
    with Image.open(case.folder / "exif180.jpg") as stored:
        grey = np.asarray(stored.convert("L"), float)
    np.testing.assert_allclose(read_picture(case.folder / "exif180.jpg").values, grey[::-1, ::-1], atol=1)


DEMO = resource_dir("demo")


def stand_in_cell(case: Case) -> list[str]:
    """The store has the demonstration's bulkhead where it stands; gives the options of an inspection there."""
    shutil.copy(case.bulkhead, case.store)
    assert case.run("world", DEMO / "world.yaml").status == 0
    return ["--format", "json", "--quiet"]


def rigs_that_lie(case: Case) -> None:
    """What is wrong is said, with its cure, instead of asking for a prior; `rig check` says the same: but for
    a focal length, of pictures and rigs of half the size."""
    options = stand_in_cell(case)
    whole = [f"{name}={DEMO / f'pair_00_{name}.png'}" for name in ("left", "right")]
    halved = halve("pair_00", case.folder).options(rig=None, prior=None)
    for name in ("inverse", "swapnames"):
        file = case.folder / f"rig_{name}.yaml"
        rig = yaml.safe_load(file.read_text())
        halve_cameras(rig)
        file.write_text(yaml.safe_dump(rig))
    cures = {
        "rig_f2pc": "with a focal length of right 2.0% greater: is its picture scaled or cropped?",
        "rig_inverse": "if its poses are camera_from_rig: invert them",
        "rig_swapnames": "if left and right are each other's: exchange their pictures, or their names in the file",
    }
    for name, cure in cures.items():
        said = case.run("rig", "check", case.folder / f"{name}.yaml", *(whole if name == "rig_f2pc" else halved))
        assert (said.status, cure in said.out) == (1, True), said
    said = case.run("inspect", *halved, "--rig", case.folder / "rig_inverse.yaml", *options)
    answer = json.loads(said.out)
    assert (said.status, answer["verdict"], answer["outcome"]["cause"]) == (1, "refused", "calibration")
    assert cures["rig_inverse"] in answer["reason"]
    assert answer["world_from_rig"] is None
    assert "in another unit, as metres" in case.refusal("rig_metres.yaml")


def rig_in_metres(case: Case) -> None:
    assert "in another unit, as metres" in case.refusal("own_metres.json")


def raw_mosaic(case: Case) -> None:
    options = stand_in_cell(case)
    picture = f"left={case.folder / 'bayer_left.png'}"
    said = case.run("inspect", picture, "--rig", DEMO / "pair_00_rig.yaml", *options)
    assert "raw Bayer mosaic" in said.out


CHECKS: dict[str, Callable[[Case], None]] = {
    "bayer_mosaic": raw_mosaic,
    "exif_turned": turned_picture,
    "own_rig_in_metres": rig_in_metres,
    "rig_wrong_no_prior": rigs_that_lie,
    "step_bom": byte_order_mark,
    "step_gbk_names": chinese_names,
    "step_latin1_assembly_name": latin_names,
    "step_placed_auto_names": names_of_usages,
    "urdf_in_the_wild": robots,
}


@pytest.mark.parametrize("name", CHECKS)
def test_case(
    name: str,
    data_dir: Path,
    duckdb_file: Path,
    loaded: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    reads_here: None,
) -> None:
    seen: dict[bytes, Extraction] = {}

    def extract_once(grey: Any, parameters: Any) -> Extraction:
        return seen.get(grey.tobytes()) or seen.setdefault(grey.tobytes(), extract(grey, parameters))

    monkeypatch.setattr("vision.inspection.pictures.extract", extract_once)
    folder = shutil.copytree(data_dir / "cases" / name, tmp_path / "case")
    CHECKS[name](Case(folder, duckdb_file, loaded, capsys))
