"""The demonstration bulkhead in a store, its first pair at half size, a third of the time, and a store for each kind of
answer, made once for all tests that read it."""

from __future__ import annotations

import io
import json
import pickle
import shutil
from collections.abc import Callable
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import psycopg
import pytest
import sqlalchemy as sa
import yaml
from PIL import Image

import vision.inspection
from relmodel.app.cli.main import main
from relmodel.app.cli.verbs.inspect import print_answer
from relmodel.model.model import Assembly, Instance, Model, Part
from relmodel.readers.urdf import primitive
from relmodel.resources import resource_dir
from relmodel.store import Store
from relmodel.variants.compare import compare
from relmodel.world import place_world
from tests.app.cli.slider import TRAVEL, write_world
from tests.conftest import run_as_owner
from tests.given import CopyStore, MakeOnce, NewStore
from tests.reading import load, store_model
from tests.synthetic_model import write_world as world_file
from tests.vision.localisation.scenes import above, block_boxes, blocks, picture, stereo_rig
from vision.cameras.cameras import Camera, perturb
from vision.inspection import Inspection as Answer
from vision.inspection.demonstration import PoseError, measure_pose_error, read_truth

DEMO = resource_dir("demo")
# Of the poses that a scan of the prior's volume gives: priors here are near the truth.
FEW_CLIMB = "vision.localisation.hypotheses.SCAN_KEPT", 20


@pytest.fixture(autouse=True)
def few_climb(monkeypatch: pytest.MonkeyPatch) -> None:
    """As in the fixtures' inspections, which tests make again."""
    monkeypatch.setattr(*FEW_CLIMB)


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


# What pictures of pair 04 at half size are cut to: the lower half has all that its variant differs in.
CUT = {"left": (150, 230), "right": (110, 230)}


@pytest.fixture(scope="session")
def other_pair(tmp_path_factory: pytest.TempPathFactory) -> Pair:
    """Pair 04, of variant B, at half size and cut."""
    return halve("pair_04", tmp_path_factory.mktemp("pair"), cut=CUT, size=(490, 250))


def halve_cameras(rig: dict[str, Any]) -> None:
    for camera in rig["cameras"].values():
        camera["width"], camera["height"] = camera["width"] // 2, camera["height"] // 2
        for row in (0, 1):
            camera["matrix"][row][row] /= 2
            camera["matrix"][row][2] = (camera["matrix"][row][2] - 0.5) / 2


def halve(
    stem: str, folder: Path, times: int = 1, cut: dict[str, Any] | None = None, size: tuple[int, int] = (0, 0)
) -> Pair:
    """A pair of the demonstration, two by two pixels in one: centres (0, 0) and (1, 1) meet at (0, 0).  Its rig is
    said to be exact, as what is rendered is.  Cut to a size where corners are given."""
    rig = yaml.safe_load((DEMO / f"{stem}_rig.yaml").read_text())
    del rig["sigma"]
    for _ in range(times):
        halve_cameras(rig)
    for name, camera in rig["cameras"].items():
        camera["sigma"] = {"centre_px": 0}
        with Image.open(DEMO / f"{stem}_{name}.png") as picture:
            reduced = picture.reduce(2**times)
        if cut:
            (u, v), (camera["width"], camera["height"]) = cut[name], size
            camera["matrix"][0][2], camera["matrix"][1][2] = camera["matrix"][0][2] - u, camera["matrix"][1][2] - v
            reduced = reduced.crop((u, v, u + size[0], v + size[1]))
        reduced.save(folder / f"{name}.png")
    (folder / "rig.yaml").write_text(yaml.safe_dump(rig))
    prior_file = DEMO / f"{stem}_prior.yaml"
    prior = yaml.safe_load(prior_file.read_text())
    return Pair(folder / "left.png", folder / "right.png", folder / "rig.yaml", prior_file, rig, prior)


@pytest.fixture(scope="session")
def blocks_pair(tmp_path_factory: pytest.TempPathFactory) -> Pair:
    """Blocks on a plate by two cameras of 320 x 240, in less than half the bulkhead's time, whatever is seen."""
    folder, stereo = tmp_path_factory.mktemp("blocks"), stereo_rig()
    rig: dict[str, Any] = {"cameras": {}}
    for name, camera in stereo.cameras.items():
        half = np.diag([0.5, 0.5, 1]) @ (camera.matrix - [[0, 0, 0.5], [0, 0, 0.5], [0, 0, 0]])
        placed = stereo.rig_from_camera[name]
        rig["cameras"][name] = {"width": 320, "height": 240, "matrix": half.tolist(), "sigma": {"centre_px": 0}}
        rig["cameras"][name]["rig_from_camera"] = placed.tolist()
        seen = picture(blocks(), Camera(320, 240, half), above(0, 0, 520) @ placed, 1)
        Image.fromarray(seen).save(folder / f"{name}.png")
    stated = perturb(above(0, 0, 520), np.random.default_rng(1).normal(size=6) * np.repeat([2, np.radians(0.2)], 3))
    prior = {"world_from_rig": stated.tolist(), "sigma": {"translation_mm": 2.0, "rotation_deg": 0.2}}
    (folder / "rig.yaml").write_text(yaml.safe_dump(rig))
    (folder / "prior.yaml").write_text(yaml.safe_dump(prior))
    return Pair(folder / "left.png", folder / "right.png", folder / "rig.yaml", folder / "prior.yaml", rig, prior)


def place_blocks(target: str, folder: Path) -> str:
    """Load these blocks, and place them where they were drawn."""
    boxes = block_boxes()
    placed = [perturb(np.eye(4), np.array([*(low + size / 2), 0, 0, 0])) for low, size in boxes]
    root = Assembly("blocks", tuple(Instance(f"block {k}", "part", k, pose) for k, pose in enumerate(placed)))
    shapes = tuple(primitive("box", *size) for _, size in boxes)
    parts = tuple(Part(f"B-{k}", f"block {k}", k) for k in range(len(boxes)))
    with Store.open(target) as store:
        store_model(store, Model("STEP", "mm", 1.0, shapes, parts, (root,), 0, len(parts), "test", "AP242"), "blocks")
        place_world(store, world_file(folder / "world.yaml", "table", [{"object": "blocks"}]))
    return target


@pytest.fixture(scope="session")
def blocks_template(duckdb_template: Path, make_once: MakeOnce) -> Path:
    """A DuckDB store in which the blocks are placed, to be copied."""
    return make_once("blocks", lambda it: place_blocks(copied(duckdb_template)(it), it)) / "cell.duckdb"


@pytest.fixture(scope="session")
def blocks_seen(blocks_template: Path, blocks_pair: Pair, make_once: MakeOnce) -> Inspection:
    """The blocks inspected, and their arcs matched."""
    return inspect_once(make_once, "seen", copied(blocks_template), *blocks_pair.options(), "--match")


@pytest.fixture(scope="session")
def minimal(
    blocks_seen: Inspection, blocks_pair: Pair, make_once: MakeOnce, tmp_path_factory: pytest.TempPathFactory
) -> Inspection:
    """A copy of that store, in which the blocks were inspected once more by cameras of other names, which come in
    another order, beside one that sees nothing, with decisions alone kept."""
    folder, pair, of = tmp_path_factory.mktemp("named"), blocks_pair, blocks_pair.rig["cameras"]
    capped = np.random.default_rng(1).normal(8, 1, (240, 320)).clip(0, 255)
    Image.fromarray(capped.astype(np.uint8)).save(folder / "capped.png")
    cameras = {"capped": of["right"], "prior": of["left"], "below": of["right"]}
    (folder / "named.yaml").write_text(yaml.safe_dump({"cameras": cameras}, sort_keys=False))
    pictures = [f"below={pair.right}", f"capped={folder / 'capped.png'}", f"prior={pair.left}"]
    given = [pictures[0], "--rig", str(folder / "named.yaml"), "--prior", str(pair.prior_file), *pictures[1:]]
    kept = ["--audit", "minimal", "--ignore-blind-camera"]
    return inspect_once(make_once, "minimal", copied(blocks_seen.store), *given, *kept)


@pytest.fixture(scope="session")
def dark(blocks_template: Path, blocks_pair: Pair, make_once: MakeOnce) -> Inspection:
    """A picture of a lens cap."""

    def begin(folder: Path) -> str:
        Image.new("L", (320, 240), 7).save(folder / "dark.png")
        return copied(blocks_template)(folder)

    return inspect_once(make_once, "dark", begin, *blocks_pair.options(left="FOLDER/dark.png", right=None))


@pytest.fixture(scope="session")
def blocks_on_postgresql(
    new_store: NewStore, copy_store: CopyStore, blocks_pair: Pair, make_once: MakeOnce
) -> Inspection:
    """The first on PostgreSQL."""
    given = (*blocks_pair.options(), "--match")
    made = inspect_once(make_once, "postgresql_seen", lambda it: place_blocks(new_store("postgresql"), it), *given)
    return replace(made, store=copy_store(made.store))


def load_bulkhead(target: str | Path, variant: str = "A") -> None:
    with Store.open(target) as store:
        load(store, DEMO / f"bulkhead_{variant}.step.gz", name="bulkhead", variant=variant)


@pytest.fixture(scope="session")
def loaded(duckdb_template: Path, make_once: MakeOnce) -> Path:
    """A DuckDB store with variant A of the bulkhead, to be copied: loading it takes seconds."""
    return make_once("loaded", lambda folder: load_bulkhead(copied(duckdb_template)(folder))) / "cell.duckdb"


@pytest.fixture(scope="session")
def both_loaded(loaded: Path, make_once: MakeOnce) -> Path:
    """The same with variant B as well."""
    return make_once("both_loaded", lambda folder: load_bulkhead(copied(loaded)(folder), "B")) / "cell.duckdb"


def place(target: str, pair: Pair, folder: Path) -> None:
    """Place the bulkhead that a store has, and a slider that carries the rig."""
    slider, world = write_world(folder, pair.rig_file, pair.prior["world_from_rig"], "slider")
    with Store.open(target) as store:
        load(store, slider, name="slider")
    assert main(["world", str(world), "--store", target]) == 0


@pytest.fixture(scope="session")
def bulkhead_template(loaded: Path, pair: Pair, make_once: MakeOnce) -> Path:
    """A DuckDB store with the bulkhead placed, to be copied."""
    return make_once("bulkhead", lambda folder: place(copied(loaded)(folder), pair, folder)) / "cell.duckdb"


def asked(of: Store | str | Path, question: str, **given: Any) -> list[Any]:
    """Rows that a question in SQL gives, of a store or of that which a target names."""
    if not isinstance(of, Store):
        with Store.open(of, read_only=True) as store:
            return asked(store, question, **given)
    with of.read() as connection:
        return list(connection.execute(sa.text(question), given).all())


def answered(of: Store | str | Path, name: str) -> list[dict[str, Any]]:
    """Rows that a question of `queries/examples` gives."""
    return [dict(row._mapping) for row in asked(of, (resource_dir("queries") / f"examples/{name}.sql").read_text())]


def off_truth(answer: dict[str, Any], stem: str = "pair_00") -> PoseError:
    """How far off the pose of an answer is by the truth of a pair."""
    return measure_pose_error(np.array(answer["world_from_rig"]), read_truth(DEMO / f"{stem}_truth.json"))


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
    """A folder with the store in which pictures were inspected and what was drawn, the answer as JSON, and how the
    command ended.

    Tests that write to the store do so to a copy (`copy_store`)."""

    folder: Path
    store: str
    answer: dict[str, Any]
    status: int

    @property
    def said(self) -> list[dict[str, Any]]:
        """What was printed as JSON, by line."""
        return [json.loads(line) for line in (self.folder / "said").read_text().splitlines()]

    @property
    def told(self) -> str:
        """What was said beside that."""
        return (self.folder / "told").read_text()

    @property
    def kept(self) -> Answer:
        """The answer as Python has it."""
        answer: Answer = pickle.loads((self.folder / "answer").read_bytes())
        return answer

    @property
    def words(self) -> str:
        """What is printed of it where nothing else is asked for."""
        with redirect_stdout(io.StringIO()) as said, redirect_stderr(said):
            print_answer(self.kept, "table")
        return said.getvalue()


def inspect_once(make_once: MakeOnce, name: str, begin: Callable[[Path], str], *options: str) -> Inspection:
    """One inspection for all tests that ask what it left, in the store that `begin` puts into the folder."""

    def fill_folder(folder: Path) -> None:
        store, kept, inspect = begin(folder), list[Answer](), vision.inspection.inspect
        own = [word.replace("FOLDER", str(folder)) for word in options]

        def keep(*given: Any, **named: Any) -> Answer:
            kept.append(inspect(*given, **named))
            return kept[-1]

        said, told = io.StringIO(), io.StringIO()
        with pytest.MonkeyPatch.context() as patch, redirect_stdout(said), redirect_stderr(told):
            patch.setattr("vision.inspection.inspect", keep)
            patch.setattr(*FEW_CLIMB)
            status = main(["inspect", *own, "--store", store, "--format", "json"])
        (folder / "answer").write_bytes(pickle.dumps(kept[-1]))
        texts = {"said": said.getvalue(), "told": told.getvalue(), "target": store, "status": str(status)}
        for file, text in texts.items():
            (folder / file).write_text(text)

    folder = make_once(name, fill_folder)
    answer = json.loads((folder / "said").read_text().splitlines()[-1])
    target, status = ((folder / file).read_text() for file in ("target", "status"))
    store = target if "://" in target else str(folder / "cell.duckdb")
    return Inspection(folder, store, answer.get("answer", answer), int(status))


def copied(store: str | Path) -> Callable[[Path], str]:
    """What begins with a copy of a store."""
    return lambda folder: str(shutil.copy(store, folder / "cell.duckdb"))


@pytest.fixture(scope="session")
def inspection(bulkhead_template: Path, pair: Pair, make_once: MakeOnce) -> Inspection:
    """Accepted, with a prior, by a rig that a carriage carries, and its arcs matched."""
    given = [*pair.options(overlay="FOLDER/overlay.png"), "--match"]
    return inspect_once(make_once, "inspected", copied(bulkhead_template), *given)


@pytest.fixture(scope="session")
def left_alone(inspection: Inspection, pair: Pair, make_once: MakeOnce) -> Inspection:
    """A copy of that store, in which the left picture was inspected by itself, the joint of the carriage said to stand
    elsewhere: the second line of a list, whose first names a picture that is not there.  The store has its arcs."""

    def begin(folder: Path) -> str:
        lines = "left,prior,serial", "nothing.png,,one", f"{pair.left},{pair.prior_file},SN-0042", ""
        (folder / "pairs.csv").write_text("\n".join(lines))
        return copied(inspection.store)(folder)

    def extract_again(*_: object) -> None:
        raise AssertionError("extracted again")

    joint = ["--set", f"travel={TRAVEL + 6}", "--joint-sigma", "travel=4"]
    base = ["--base-sigma-mm", "2", "--base-sigma-deg", "0.3"]
    given = ["--list", "FOLDER/pairs.csv", "--rig", str(pair.rig_file), "--needs", "5mm,1deg", *joint, *base]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("vision.inspection.pictures.extract", extract_again)
        return inspect_once(make_once, "left_alone", begin, *given)


@pytest.fixture(scope="session")
def other_variant(both_loaded: Path, other_pair: Pair, make_once: MakeOnce) -> Inspection:
    """Variant B in the pictures, variant A in the model, with crops and an overlay."""

    def begin(folder: Path) -> str:
        store, world = copied(both_loaded)(folder), folder / "world.yaml"
        world.write_text((DEMO / "world_B.yaml").read_text().replace("variant: B", "variant: A"))
        assert main(["world", str(world), "--store", store]) == 0
        return store

    drawn = {"crops": "FOLDER/crops", "overlay": "FOLDER/overlay.png"}
    return inspect_once(make_once, "other_variant", begin, *other_pair.options(world="demo_cell_B", **drawn))


def load_other(target: str) -> str:
    """Load variant B beside A and compare them."""
    load_bulkhead(target, "B")
    with Store.open(target) as store:
        compare(store, ("bulkhead", "A"), ("bulkhead", "B"))
    return target


@pytest.fixture(scope="session")
def both_variants(inspection: Inspection, make_once: MakeOnce) -> str:
    """A copy of the first store, with variant B loaded and compared with A."""
    return str(make_once("both", lambda folder: load_other(copied(inspection.store)(folder))) / "cell.duckdb")


def copy_rows(store: str, target: str) -> None:
    """All rows of a DuckDB store to one of PostgreSQL, but what says which store it is: to be read.  As CSV, in which
    each spells lists and bytes in its own way."""
    url = sa.make_url(target).set(drivername="postgresql").render_as_string(hide_password=False)
    file = Path(store).with_suffix(".csv")

    def spelled(column: str, kind: str) -> str:
        if kind.endswith("[]"):
            return f"translate(to_json({column})::TEXT, '[]', '{{}}')"
        return rf"'\x' || hex({column})" if kind == "BLOB" else column

    with Store.open(store, read_only=True) as read, read.read() as rows, psycopg.connect(url) as written:
        written.execute("SET session_replication_role = replica")  # foreign keys hold where rows come from
        tables = read.rows(rows, "store/columns.duckdb")
        given = [row for row in tables if row.relation not in ("store", "alembic_version")]
        written.execute(f"TRUNCATE {', '.join(row.relation for row in given)}")
        for row in given:
            selected = ", ".join(map(spelled, row.names, row.types))
            rows.exec_driver_sql(f"COPY (SELECT {selected} FROM {row.relation}) TO '{file}' (HEADER false)")  # noqa: S608
            with written.cursor().copy(f"COPY {row.relation} ({', '.join(row.names)}) FROM STDIN (FORMAT csv)") as copy:
                copy.write(file.read_bytes())


@pytest.fixture(scope="session")
def postgresql_inspection(
    inspection: Inspection, both_variants: str, new_store: NewStore, copy_store: CopyStore, make_once: MakeOnce
) -> Inspection:
    """The rows of the first on PostgreSQL, with variant B beside: a copy for each worker, which it has to itself."""

    def fill(folder: Path) -> None:
        target = new_store("postgresql")
        copy_rows(both_variants, target)
        run_as_owner(target, ["ANALYZE"])  # as the server does in time: questions take a tenth of theirs
        (folder / "target").write_text(target)

    made = make_once("postgresql_inspected", fill) / "target"
    return replace(inspection, store=copy_store(made.read_text()))
