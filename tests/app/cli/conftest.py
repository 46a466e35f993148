"""The demonstration bulkhead in a store, and its first pair at half size: a third of the time."""

from __future__ import annotations

import io
import json
import shutil
from collections.abc import Callable
from contextlib import redirect_stdout
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pytest
import yaml
from PIL import Image

from relmodel.app.cli.main import main
from relmodel.resources import resource_dir
from relmodel.store import Store
from tests.app.cli.slider import write_world
from tests.reading import load

DEMO = resource_dir("demo")


@dataclass(frozen=True)
class Pair:
    """What an inspection of the pair is given: files, and what its YAML files say."""

    left: Path
    right: Path
    rig_file: Path
    prior_file: Path
    rig: dict[str, Any]
    prior: dict[str, Any]

    def options(self, **other: object) -> list[str]:
        """Pictures and options of `relmodel inspect`, with others in their place; None leaves one out."""
        given = {"left": self.left, "right": self.right, "rig": self.rig_file, "prior": self.prior_file} | other
        stated = {name: value for name, value in given.items() if value is not None}
        pictures = [f"{name}={value}" for name, value in stated.items() if name in self.rig["cameras"]]
        return pictures + [w for n, v in stated.items() if n not in self.rig["cameras"] for w in (f"--{n}", str(v))]


@pytest.fixture(scope="session")
def pair(tmp_path_factory: pytest.TempPathFactory) -> Pair:
    """Pair 00 at half size."""
    return halve("pair_00", tmp_path_factory.mktemp("pair"))


@pytest.fixture(scope="session")
def other_pair(tmp_path_factory: pytest.TempPathFactory) -> Pair:
    """Pair 04, of variant B, at half size."""
    return halve("pair_04", tmp_path_factory.mktemp("pair"))


def halve(stem: str, folder: Path) -> Pair:
    """A pair of the demonstration, two by two pixels in one: centres (0, 0) and (1, 1) meet at (0, 0)."""
    rig = yaml.safe_load((DEMO / f"{stem}_rig.yaml").read_text())
    for name, camera in rig["cameras"].items():
        with Image.open(DEMO / f"{stem}_{name}.png") as picture:
            half = picture.reduce(2)
        half.save(folder / f"{name}.png")
        camera["width"], camera["height"] = half.size
        for row in (0, 1):
            camera["matrix"][row][row] /= 2
            camera["matrix"][row][2] = (camera["matrix"][row][2] - 0.5) / 2
    (folder / "rig.yaml").write_text(yaml.safe_dump(rig))
    prior_file = DEMO / f"{stem}_prior.yaml"
    prior = yaml.safe_load(prior_file.read_text())
    return Pair(folder / "left.png", folder / "right.png", folder / "rig.yaml", prior_file, rig, prior)


def fill(target: str, pair: Pair, folder: Path) -> None:
    """Load and place the bulkhead, and a slider that carries the rig, in a store that is there."""
    slider, world = write_world(folder, pair.rig_file, pair.prior["world_from_rig"], "slider")
    with Store.open(target) as store:
        load(store, DEMO / "bulkhead_A.step.gz", name="bulkhead", variant="A")
        load(store, slider, name="slider")
    assert main(["world", str(world), "--store", target]) == 0


@pytest.fixture(scope="session")
def bulkhead_template(duckdb_template: Path, pair: Pair, make_once: Callable[..., Path]) -> Path:
    """A DuckDB store with the bulkhead placed, to be copied: reading its STEP file takes seconds."""

    def place(folder: Path) -> None:
        fill(str(shutil.copy(duckdb_template, folder / "cell.duckdb")), pair, folder)

    return make_once("bulkhead", place) / "cell.duckdb"


def inspected(store: str, *options: str) -> dict[str, Any]:
    """What `relmodel inspect` answers as JSON."""
    said = io.StringIO()
    with redirect_stdout(said):
        status = main(["inspect", *options, "--store", store, "--format", "json"])
    answer: dict[str, Any] = json.loads(said.getvalue())
    assert status == (0 if answer["verdict"] == "accepted" else 1)
    return answer


@dataclass(frozen=True)
class Inspection:
    """A store in which the pair was inspected, the answer, and the overlay that was drawn.

    Tests that write to the store do so to a copy (`copy_store`).
    """

    store: str
    answer: dict[str, Any]
    overlay: Path


@pytest.fixture(scope="session")
def inspection(bulkhead_template: Path, pair: Pair, make_once: Callable[..., Path]) -> Inspection:
    """One inspection for all tests that ask what it left."""

    def inspect(folder: Path) -> None:
        store = shutil.copy(bulkhead_template, folder / "cell.duckdb")
        answer = inspected(str(store), *pair.options(overlay=folder / "overlay.png"))
        (folder / "answer.json").write_text(json.dumps(answer))

    return _made(make_once("inspected", inspect))


def _made(folder: Path) -> Inspection:
    answer = json.loads((folder / "answer.json").read_text())
    return Inspection(str(folder / "cell.duckdb"), answer, folder / "overlay.png")


@pytest.fixture(scope="session")
def minimal(inspection: Inspection, pair: Pair, make_once: Callable[..., Path]) -> Inspection:
    """A copy of that store, in which the pair was inspected once more with its decisions alone kept."""

    return _again(inspection, make_once, "minimal", *pair.options(), "--audit", "minimal")


@pytest.fixture(scope="session")
def left_alone(inspection: Inspection, pair: Pair, make_once: Callable[..., Path]) -> Inspection:
    """A copy of that store, in which the left picture was inspected by itself."""
    return _again(inspection, make_once, "left_alone", *pair.options(right=None), "--needs", "5mm,1deg")


def _again(inspection: Inspection, make_once: Callable[..., Path], name: str, *options: str) -> Inspection:
    def inspect(folder: Path) -> None:
        store = shutil.copy(inspection.store, folder / "cell.duckdb")
        (folder / "answer.json").write_text(json.dumps(inspected(str(store), *options)))

    return _made(make_once(name, inspect))


@pytest.fixture(scope="session")
def postgresql_inspection(
    new_store: Callable[[str], str], copy_store: Callable[[str], str], pair: Pair, make_once: Callable[..., Path]
) -> Inspection:
    """The same on PostgreSQL: a copy for each worker, as nobody may have open what is copied."""

    def inspect(folder: Path) -> None:
        target = new_store("postgresql")
        fill(target, pair, folder)
        answer = inspected(target, *pair.options(overlay=folder / "overlay.png"))
        (folder / "answer.json").write_text(json.dumps(answer))
        (folder / "target").write_text(target)

    folder = make_once("postgresql_inspected", inspect)
    return replace(_made(folder), store=copy_store((folder / "target").read_text()))
