"""The demonstration bulkhead in a store, and its first pair at half size: a third of the time."""

from __future__ import annotations

import io
import json
import shutil
from collections.abc import Callable
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pytest
import yaml
from PIL import Image

import vision.inspection
from relmodel.app.cli.main import main
from relmodel.app.cli.verbs.inspect import print_answer
from relmodel.resources import resource_dir
from relmodel.store import Store
from tests.app.cli.slider import TRAVEL, write_world
from tests.given import CopyStore, MakeOnce, NewStore
from tests.reading import load
from vision.inspection import Inspection as Answer

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
def bulkhead_template(duckdb_template: Path, pair: Pair, make_once: MakeOnce) -> Path:
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


def inspected_and_kept(store: str, *options: str) -> tuple[dict[str, Any], Answer]:
    """The same, and the answer itself."""
    kept: list[Answer] = []
    inspect = vision.inspection.inspect

    def keep(*given: Any, **named: Any) -> Answer:
        kept.append(inspect(*given, **named))
        return kept[0]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("vision.inspection.inspect", keep)
        return inspected(store, *options), kept[0]


@dataclass(frozen=True)
class Inspection:
    """A store in which the pair was inspected, the answer as JSON and in words, and the overlay that was drawn.

    Tests that write to the store do so to a copy (`copy_store`).
    """

    store: str
    answer: dict[str, Any]
    words: str
    overlay: Path


def inspect_once(make_once: MakeOnce, name: str, begin: Callable[[Path], str], *options: str) -> Inspection:
    """One inspection for all tests that ask what it left, in the store that `begin` puts into the folder."""

    def inspect(folder: Path) -> None:
        store, said = begin(folder), io.StringIO()
        own = [word.replace("FOLDER", str(folder)) for word in options]
        answer, kept = inspected_and_kept(store, *own)
        with redirect_stdout(said), redirect_stderr(said):
            print_answer(kept, "table")
        for file, text in {"answer.json": json.dumps(answer), "words": said.getvalue(), "target": store}.items():
            (folder / file).write_text(text)

    folder = make_once(name, inspect)
    answer = json.loads((folder / "answer.json").read_text())
    return Inspection(str(folder / "cell.duckdb"), answer, (folder / "words").read_text(), folder / "overlay.png")


def copied(store: str | Path) -> Callable[[Path], str]:
    """What begins with a copy of a store."""
    return lambda folder: str(shutil.copy(store, folder / "cell.duckdb"))


@pytest.fixture(scope="session")
def inspection(bulkhead_template: Path, pair: Pair, make_once: MakeOnce) -> Inspection:
    """Accepted, with a prior, by a rig that a carriage carries."""
    return inspect_once(make_once, "inspected", copied(bulkhead_template), *pair.options(overlay="FOLDER/overlay.png"))


@pytest.fixture(scope="session")
def minimal(
    inspection: Inspection, pair: Pair, make_once: MakeOnce, tmp_path_factory: pytest.TempPathFactory
) -> Inspection:
    """A copy of that store, in which the pair was inspected once more by cameras of other names, which come in another
    order, with its decisions alone kept."""
    rig = tmp_path_factory.mktemp("named") / "named.yaml"
    cameras = {"prior": pair.rig["cameras"]["left"], "below": pair.rig["cameras"]["right"]}
    rig.write_text(yaml.safe_dump({"cameras": cameras}, sort_keys=False))
    given = [f"below={pair.right}", "--rig", str(rig), "--prior", str(pair.prior_file), f"prior={pair.left}"]
    return inspect_once(make_once, "minimal", copied(inspection.store), *given, "--audit", "minimal")


@pytest.fixture(scope="session")
def left_alone(inspection: Inspection, pair: Pair, make_once: MakeOnce) -> Inspection:
    """A copy of that store, in which the left picture was inspected by itself, the joint of the carriage said to stand
    elsewhere."""
    joint = ["--set", f"travel={TRAVEL + 6}", "--joint-sigma", "travel=4"]
    base = ["--base-sigma-mm", "2", "--base-sigma-deg", "0.3"]
    given = [*pair.options(right=None), "--needs", "5mm,1deg", *joint, *base]
    return inspect_once(make_once, "left_alone", copied(inspection.store), *given)


@pytest.fixture(scope="session")
def dark(inspection: Inspection, pair: Pair, make_once: MakeOnce) -> Inspection:
    """A copy of that store, in which a lens cap was inspected: refused."""

    def begin(folder: Path) -> str:
        Image.new("L", (640, 480), 7).save(folder / "dark.png")
        return copied(inspection.store)(folder)

    return inspect_once(make_once, "dark", begin, *pair.options(left="FOLDER/dark.png", right=None))


@pytest.fixture(scope="session")
def postgresql_inspection(new_store: NewStore, copy_store: CopyStore, pair: Pair, make_once: MakeOnce) -> Inspection:
    """The first on PostgreSQL: a copy for each worker, as nobody may have open what is copied."""

    def begin(folder: Path) -> str:
        target = new_store("postgresql")
        fill(target, pair, folder)
        return target

    made = inspect_once(make_once, "postgresql_inspected", begin, *pair.options(overlay="FOLDER/overlay.png"))
    return replace(made, store=copy_store((made.overlay.parent / "target").read_text()))
