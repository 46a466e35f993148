"""Bad input: one sentence on stderr, exit status 3, and the store's model and results as they were."""

from __future__ import annotations

import copy
import gzip
import json
import os
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import duckdb
import numpy as np
import pytest
import sqlalchemy as sa
import yaml
from PIL import Image

from relmodel.app.cli.main import main
from relmodel.errors import StoreError
from relmodel.names import visible
from relmodel.readers.formats import stem_of
from relmodel.store import Store, engine
from relmodel.world.world_file import read_world_file
from tests.app.cli.conftest import DEMO, Pair
from tests.holding import held
from vision.cameras.rig_file import read_yaml

Given = dict[str, Any]

# What a load or a world that fails once its run has begun leaves: the run, and why.
OF_RUNS = {"run", "run_input", "run_event", "load_report", "ledger"}


@pytest.fixture(scope="module")
def store(bulkhead_template: Path, tmp_path_factory: pytest.TempPathFactory) -> str:
    """One store for all: each test shows that it is as it was."""
    file = tmp_path_factory.mktemp("bad") / "cell.duckdb"
    shutil.copy(bulkhead_template, file)
    return str(file)


def counts(store: str) -> dict[str, int]:
    """Rows of every table."""
    with duckdb.connect(store, read_only=True) as connection:
        names = [row[0] for row in connection.execute("SELECT table_name FROM duckdb_tables()").fetchall()]
        each = " UNION ALL ".join(f"SELECT '{name}', count(*) FROM \"{name}\"" for name in names)  # noqa: S608
        return dict(connection.execute(each).fetchall())


def assert_only_failed(store: str, before: dict[str, int], said: str) -> None:
    """The store is as it was, but for a run that failed with the sentence that was printed."""
    after = counts(store)
    assert {table for table in after if after[table] != before[table]} <= OF_RUNS
    with duckdb.connect(store, read_only=True) as connection:
        ended = "SELECT e.state, e.message FROM run_event AS e WHERE e.kind = 'ended' ORDER BY e.run_id DESC LIMIT 1"
        state, message = connection.execute(ended).fetchall()[0]
    assert state == "failed"
    assert said.partition(": ")[2].rstrip("\n") == visible(message)


def refused(capsys: pytest.CaptureFixture[str], *arguments: str, status: int = 3) -> str:
    """The sentence with which the command line refuses a call."""
    capsys.readouterr()
    assert main(arguments) == status
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.count("\n") == 1, said.err
    assert said.err.startswith(f"relmodel {arguments[0]}: ")
    assert not said.err.rstrip().endswith(".")
    return said.err


def changed(given: Given, place: str, value: object) -> Given:
    """A copy of what a YAML file says with one value changed; None takes it away."""
    out = copy.deepcopy(given)
    *path, last = place.split(".")
    inner: Any = out
    for key in path:
        inner = inner[int(key) if isinstance(inner, list) else key]
    if value is None:
        del inner[last]
    else:
        inner[int(last) if isinstance(inner, list) else last] = value
    return out


BAD_RIGS = [
    ("cameras.right", None, "no camera 'right'"),
    ("cameras.left.matrix", None, "'cameras.left.matrix' is missing"),
    ("cameras.left.matrix.0.0", float("nan"), "not finite"),
    ("cameras.right.rig_from_camera.2.3", float("inf"), "not finite"),
    ("cameras.right.rig_from_camera", np.eye(4).tolist(), "at one place"),
    ("cameras.left.matrix.0.0", 1e-9, "no lens"),
    ("cameras.left.matrix.0.2", 1e9, "no lens"),
    ("cameras.left.distortion.coefficients", [-3.0, 0, 0, 0], "folds"),
    ("cameras.left.distortion.coefficients", [0, 0, 1e6, 0], "folds"),
    ("cameras.left.width", 640.5, "whole pixels"),
]


@pytest.mark.parametrize(("place", "value", "says"), BAD_RIGS)
def test_bad_rig(
    place: str, value: object, says: str, store: str, pair: Pair, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before, file = counts(store), tmp_path / "rig.yaml"
    file.write_text(yaml.safe_dump(changed(pair.rig, place, value)))
    said = refused(capsys, "inspect", "--store", store, *pair.options(rig=file))
    assert says in said
    assert_only_failed(store, before, said)


LONG = "x" * 300


@pytest.mark.parametrize(
    "words",
    [
        "init --store NAME.duckdb",
        "check --store NAME.duckdb",
        "sql --store NAME/cell.duckdb SELECT",
        "load NAME.step",
        "world NAME.yaml",
        "extract NAME.png",
        "show bulkhead --variant A --picture NAME.png",
        "export bulkhead --variant A -o NAME.glb",
        "export --parquet NAME",
        "report --object bulkhead --variant A -o NAME.html",
        "check --report NAME.html",
        "rig show NAME.yaml",
        "find --camera NAME.yaml --at NAME.yaml",
        "sql --file NAME.sql",
    ],
)
def test_a_name_too_long_for_a_file(words: str, store: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = counts(store)
    of_store = [] if "--store" in words or words.startswith("rig") else ["--store", store]
    said = refused(capsys, *words.replace("NAME", str(tmp_path / LONG)).split(), *of_store)
    assert "File name too long" in said
    after = counts(store)
    assert {table for table in after if after[table] != before[table]} <= OF_RUNS


def test_a_name_too_long_for_a_store(store: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    part, world = tmp_path / "part.obj", tmp_path / "world.yaml"
    part.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    world.write_text(f"world: {LONG}\nobjects: [{{object: bulkhead, variant: A}}]\n")
    before = counts(store)
    for words in (["load", part, "--unit", "mm", "--object", "轴" * 86], ["world", world]):
        said = refused(capsys, *map(str, words), "--store", store)
        assert "over 255 bytes: shorten it" in said
        assert_only_failed(store, before, said)


def test_a_name_that_is_not_utf_8(store: str, capsys: pytest.CaptureFixture[str]) -> None:
    before = counts(store)
    said = refused(capsys, "load", os.fsdecode(b"tr\xe4ger.step") + "🔩.step", "--store", store, status=2)
    assert "is not in UTF-8" in said
    assert counts(store) == before


@pytest.mark.parametrize(
    ("files", "names"),
    [
        (["pump.10.201.obj", "pump.10.202.obj"], ["pump.10.201", "pump.10.202"]),
        (["a.b.OBJ"], ["a.b"]),
    ],
)
def test_an_object_has_the_whole_stem_of_its_file_for_a_name(
    files: list[str], names: list[str], duckdb_file: Path, tmp_path: Path
) -> None:
    for number, file in enumerate(files, 1):
        (tmp_path / file).write_text(f"v 0 0 0\nv {number} 0 0\nv 0 1 0\nf 1 2 3\n")
    given = [str(tmp_path / file) for file in files]
    assert main(["load", *given, "--unit", "mm", "--store", str(duckdb_file)]) == 0
    with duckdb.connect(str(duckdb_file), read_only=True) as connection:
        query = "SELECT name, revision FROM object_variant ORDER BY name"
        assert connection.execute(query).fetchall() == [(name, 1) for name in names]


def test_the_stem_of_a_packed_file() -> None:
    assert [stem_of(Path(f"in.d/{name}")) for name in ("a.1.step.gz", "a.1.STP.GZ", "a.1.step")] == ["a.1"] * 3


@pytest.mark.parametrize("form", ["yaml", "json"])
def test_a_world_with_a_byte_order_mark(form: str, tmp_path: Path) -> None:
    said = {"world": f"marked in {form}", "objects": [{"object": "bulkhead", "variant": "A"}]}
    file = tmp_path / f"world.{form}"
    file.write_text("\ufeff" + (json.dumps(said) if form == "json" else yaml.safe_dump(said)))
    assert read_world_file(file).world == said["world"]
    assert read_yaml(file, "prior") == said


BAD_PRIORS = [
    ("world_from_rig.0.3", float("nan"), "not finite"),
    ("world_from_rig.0.0", 9.0, "not a rigid transform"),
    ("world_from_rig.2", [0.0, 0, 0, 0], "not a rigid transform"),
    ("world_from_rig.0.3", 50_000.0, "nothing of the world"),
    ("world_from_rig.0.3", 1e300, "nothing of the world"),
    ("world_from_rig", None, "'world_from_rig' is missing"),
    ("sigma", None, "'sigma' is missing"),
    ("sigma.rotation_deg", None, "'sigma.rotation_deg' is missing"),
    ("sigma.translation_mm", float("nan"), "not finite"),
    ("sigma.translation_mm", 1e9, "too wide to be searched"),
    ("sigma.rotation_deg", -1.0, "above zero"),
]


@pytest.mark.parametrize(("place", "value", "says"), BAD_PRIORS)
def test_bad_prior(
    place: str, value: object, says: str, store: str, pair: Pair, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before, file = counts(store), tmp_path / "prior.yaml"
    file.write_text(yaml.safe_dump(changed(pair.prior, place, value)))
    said = refused(capsys, "inspect", "--store", store, *pair.options(prior=file))
    assert says in said
    assert_only_failed(store, before, said)


def test_mirrored_prior(store: str, pair: Pair, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    mirrored = [-x for x in pair.prior["world_from_rig"][0]]
    file = tmp_path / "prior.yaml"
    file.write_text(yaml.safe_dump(changed(pair.prior, "world_from_rig.0", mirrored)))
    assert "mirrors" in refused(capsys, "inspect", "--store", store, *pair.options(prior=file))


NO_YAML = [b"cameras:\n\tleft: 1\n", b"a: [1, 2\nb: }", b"a: \xff\xfe", b"a: 2020-99-99\n", b"[" * 1000, b"", b"- 1\n"]


@pytest.mark.parametrize("content", NO_YAML, ids=[repr(c[:12]) for c in NO_YAML])
def test_files_that_are_no_yaml(
    content: bytes, store: str, pair: Pair, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before, file = counts(store), tmp_path / "bad.yaml"
    file.write_bytes(content)
    option = ("rig", "prior")[NO_YAML.index(content) % 2]
    said = refused(capsys, "inspect", "--store", store, *pair.options(**{option: file}))
    assert f"the {option} file" in said
    assert_only_failed(store, before, said)
    said = refused(capsys, "world", str(file), "--store", store)
    assert str(file) in said
    assert_only_failed(store, before, said)


def test_a_rig_file_that_is_not_there(
    store: str, pair: Pair, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "none.yaml"
    assert f"there is no rig file {file}" in refused(capsys, "inspect", "--store", store, *pair.options(rig=file))


def no_picture(good: Path, to: Path) -> None:
    to.write_text("hello")


def nothing(good: Path, to: Path) -> None:
    pass


def empty(good: Path, to: Path) -> None:
    to.write_bytes(b"")


def truncated(good: Path, to: Path) -> None:
    data = good.read_bytes()
    to.write_bytes(data[: len(data) // 2])


def of_another_size(good: Path, to: Path) -> None:
    Image.open(good).crop((0, 0, 320, 240)).save(to)


def of_floats(good: Path, to: Path) -> None:
    Image.open(good).convert("F").save(to, "TIFF")


def beyond_all_bounds(good: Path, to: Path) -> None:
    """The header of a BMP file of 40,000 by 40,000 pixels."""
    side = (40_000).to_bytes(4, "little")
    header = (40).to_bytes(4, "little") + side + side + b"\1\0\10\0" + bytes(24)
    to.write_bytes(b"BM" + bytes(8) + (54).to_bytes(4, "little") + header)


def a_folder(good: Path, to: Path) -> None:
    to.mkdir()


BAD_PICTURES: list[tuple[Callable[[Path, Path], None], str]] = [
    (nothing, "there is no image"),
    (a_folder, "is not a regular file"),
    (no_picture, "not a picture"),
    (empty, "not a picture"),
    (truncated, "cannot be read"),
    (of_another_size, "is 320x240 but its camera 640x480"),
    (of_floats, "neither grey nor colour of 8 or 16 bits"),
    (beyond_all_bounds, "cannot be read"),
]


@pytest.mark.parametrize(
    ("make", "says", "camera"), [(*bad, ("left", "right")[number % 2]) for number, bad in enumerate(BAD_PICTURES)]
)
def test_bad_picture(
    make: Callable[[Path, Path], None],
    says: str,
    camera: str,
    store: str,
    pair: Pair,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    before, file = counts(store), tmp_path / "bad.png"
    make(getattr(pair, camera), file)
    said = refused(capsys, "inspect", "--store", store, *pair.options(**{camera: file}))
    assert says in said
    assert str(file) in said
    assert_only_failed(store, before, said)


def test_empty_picture_is_refused_by_verdict(
    bulkhead_template: Path, pair: Pair, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A lens cap is no damaged file: the run is there, and says that it found nothing."""
    store = tmp_path / "cell.duckdb"
    shutil.copy(bulkhead_template, store)
    Image.new("L", (640, 480), 7).save(tmp_path / "dark.png")
    dark = pair.options(left=tmp_path / "dark.png", right=None)
    assert main(["inspect", "--store", str(store), *dark, "--format", "json"]) == 1
    answer = json.loads(capsys.readouterr().out)
    assert answer["verdict"] == "refused"
    # A picture that says nothing leaves the prior as it was.
    assert answer["missing"]
    assert answer["posterior"] < 0.01
    np.testing.assert_allclose(answer["world_from_rig"], pair.prior["world_from_rig"], atol=1e-9)
    sigma = [pair.prior["sigma"]["translation_mm"], np.radians(pair.prior["sigma"]["rotation_deg"])]
    np.testing.assert_allclose(np.sqrt(np.diag(answer["covariance"])), np.repeat(sigma, 3), rtol=1e-6)
    assert answer["parts_in_view"] == []


def text(good: bytes) -> bytes:
    return b"Dear colleague, please find the drawing attached.\n"


def half(good: bytes) -> bytes:
    return good[: len(good) // 2]


def whole(good: bytes) -> bytes:
    return good


def none(good: bytes) -> bytes:
    return b""


BAD_STEP: list[tuple[str, Callable[[bytes], bytes], str]] = [
    ("a.step", text, "is not a STEP file"),
    ("a.step", half, "is cut off"),
    ("a.step.gz", half, "cannot be unpacked"),
    ("a.step", none, "is empty"),
    ("a.doc", whole, "is of an unknown format"),
]


@pytest.mark.parametrize(("name", "damage", "says"), BAD_STEP)
def test_bad_step(
    name: str,
    damage: Callable[[bytes], bytes],
    says: str,
    store: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    before, file = counts(store), tmp_path / name
    packed = (DEMO / "bulkhead_A.step.gz").read_bytes()
    file.write_bytes(damage(packed if name.endswith(".gz") else gzip.decompress(packed)))
    said = refused(capsys, "load", str(file), "--object", "bulkhead", "--variant", "A", "--store", store)
    assert says in said
    assert name in said
    assert_only_failed(store, before, said)


def test_missing_step(store: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = counts(store)
    said = refused(capsys, "load", str(tmp_path / "none.step"), "--object", "bulkhead", "--store", store)
    assert "there is no file" in said
    assert_only_failed(store, before, said)


def a_device(to: Path) -> None:
    to.symlink_to("/dev/zero")


def a_huge_file(to: Path) -> None:
    with to.open("wb") as file:
        file.truncate(3 << 30)


NO_FILES: list[tuple[str, Callable[[Path], None], str]] = [
    ("load given.step", a_device, "is not a regular file"),
    ("load given.stl --unit mm", os.mkfifo, "is not a regular file"),
    ("load given.step", Path.mkdir, "is not a regular file"),
    ("load given.glb", a_huge_file, "is larger than 2048 MB"),
    ("world given.yaml", a_device, "is not a regular file"),
    ("inspect left given.png", a_huge_file, "is larger than 512 MB"),
    ("inspect --rig given.yaml", a_device, "is not a regular file"),
    ("inspect --prior given.yaml", a_huge_file, "is larger than 64 MB"),
    ("extract given.png", os.mkfifo, "is not a regular file"),
    ("rig show given.yaml", a_device, "is not a regular file"),
    ("find --polyhedron given.yaml", a_device, "is not a regular file"),
    ("sql --file given.sql", a_device, "is not a regular file"),
]


@pytest.mark.parametrize(("words", "make", "says"), NO_FILES, ids=[f"{w}-{m.__name__}" for w, m, _ in NO_FILES])
def test_what_is_no_file_or_may_never_end_is_not_read(
    words: str,
    make: Callable[[Path], None],
    says: str,
    store: str,
    pair: Pair,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Least of all for its digest, which a run keeps of what it was given."""
    before = counts(store)
    verb, *given = words.replace("given", str(tmp_path / "given")).split()
    file = next(Path(word) for word in given if word.startswith(str(tmp_path)))
    make(file)
    options = pair.options(**{given[0].removeprefix("--"): file}) if verb == "inspect" else given
    said = refused(capsys, verb, *options, "--store", store)
    assert str(file) in said
    assert says in said
    if verb in ("load", "world", "inspect", "extract"):
        assert_only_failed(store, before, said)
    else:
        assert counts(store) == before


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["load", "none.step", "--time-limit", "nan"], "--time-limit is nan: give seconds, above 0"),
        (["load", "none.step", "--time-limit", "-1"], "--time-limit is -1: give seconds, above 0"),
        (["diff", "A", "A", "--object", "bulkhead", "--reach", "nan"], "the reach is nan: give mm, 0 or more"),
        (["diff", "A", "A", "--object", "bulkhead", "--reach", "-5"], "the reach is -5: give mm, 0 or more"),
    ],
)
def test_numbers_out_of_range_are_wrong_use(
    words: list[str], says: str, store: str, capsys: pytest.CaptureFixture[str]
) -> None:
    before = counts(store)
    assert main([*words, "--store", store]) == 2
    assert says in capsys.readouterr().err
    assert counts(store) == before


BAD_WORLDS = [
    ("objects.0.object", "blukhead", "is not loaded"),
    ("objects.0.variant", "Z", "is not loaded"),
    ("objects.0.world_from_object.0.3", float("nan"), "not finite"),
    ("objects.0.world_from_object.0.3", 1e300, "farther off than 100 km"),
    ("objects.0.world_from_object.0.0", 2.0, "not a rotation"),
    ("objects.0.role", "spectator", "unknown role"),
    ("world", None, "lacks world"),
]


@pytest.mark.parametrize(("place", "value", "says"), BAD_WORLDS)
def test_bad_world(
    place: str, value: object, says: str, store: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before, file = counts(store), tmp_path / "world.yaml"
    file.write_text(yaml.safe_dump(changed(yaml.safe_load((DEMO / "world.yaml").read_text()), place, value)))
    said = refused(capsys, "world", str(file), "--store", store)
    assert says in said
    assert_only_failed(store, before, said)


def test_stores_without_a_world(
    duckdb_template: Path, store: str, pair: Pair, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = str(tmp_path / "empty.duckdb")
    shutil.copy(duckdb_template, file)
    before = counts(file)
    assert "holds no world" in refused(capsys, "inspect", "--store", file, *pair.options(), status=2)
    assert counts(file) == before
    other = refused(capsys, "inspect", "--store", store, "--world", "attic", *pair.options(), status=2)
    assert "demo_cell" in other


def test_stores_that_are_none(pair: Pair, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert "in memory only" in refused(capsys, "inspect", "--store", ":memory:", *pair.options())
    file = tmp_path / "cell.duckdb"
    assert "there is no store" in refused(capsys, "inspect", "--store", str(file), *pair.options())
    assert not file.exists()
    for content in (b"not a database", b"", bytes(100_000)):
        file.write_bytes(content)
        assert "is not a relmodel store" in refused(capsys, "inspect", "--store", str(file), *pair.options())
        assert file.read_bytes() == content
    file.unlink()
    duckdb.connect(str(file)).close()
    assert "is not a relmodel store" in refused(capsys, "inspect", "--store", str(file), *pair.options())


def test_store_held_by_another_process(
    store: str, pair: Pair, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(engine, "PATIENCE_S", 0.1)
    with held(store, read_only=False) as holder:
        said = refused(capsys, "inspect", "--store", store, *pair.options())
    assert f"in use by process {holder.pid}" in said


def test_overlay_that_cannot_be_written_is_told_first(
    store: str, pair: Pair, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = counts(store)
    (tmp_path / "folder.png").mkdir()
    for name, says in (
        ("none/a.png", "there is no folder"),
        ("a.xyz", "has no picture suffix"),
        ("folder.png", "cannot be written"),
    ):
        said = refused(capsys, "inspect", "--store", store, *pair.options(overlay=tmp_path / name))
        assert says in said
    for option in ({"overlay": tmp_path / "a.png"}, {"crops": tmp_path / "crops"}):  # there would be no rows to draw
        given = pair.options(**option)
        said = refused(capsys, "inspect", "--store", store, *given, "--audit", "minimal", status=2)
        assert "a minimal audit leaves out" in said
    assert counts(store) == before


def out_of_memory(store: Store) -> None:
    with store.write() as connection:
        connection.execute(sa.text("SET memory_limit = '20MB'"))
        connection.execute(sa.text("SELECT list(range) FROM range(10000000)"))


def connection_lost(store: Store) -> None:
    with store.write() as connection, store.read() as other:
        own = connection.execute(sa.text("SELECT pg_backend_pid()")).scalar()
        other.execute(sa.text("SELECT pg_terminate_backend(:own, 10000)"), {"own": own})
        store.append(connection, "sds_relation", {"relation": ["mine"]})


def test_database_that_fails_in_use_is_one_sentence(fresh_store: str) -> None:
    with Store.open(fresh_store) as store:
        with pytest.raises(StoreError, match=r"^the store .* failed \(.*try again$") as failed:
            (out_of_memory if store.dialect == "duckdb" else connection_lost)(store)
        assert "\n" not in str(failed.value)
        # A mistake of the program stays the error that it is.
        with pytest.raises(Exception, match=r"(?i)duplicate key") as mistake, store.write() as connection:
            store.append(connection, "feature_class", {"id": [1, 1], "content_key": ["k", "l"], "kind": "pocket"})
        assert not isinstance(mistake.value, StoreError)


@pytest.mark.usefixtures("reads_here")
def test_journal_that_cannot_be_written_is_one_sentence(
    duckdb_template: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "cell.duckdb"
    shutil.copy(duckdb_template, file)
    Path(f"{file}.journal").mkdir()
    said = refused(capsys, "load", str(DEMO / "bulkhead_A.step.gz"), "--object", "bulkhead", "--store", str(file))
    assert "journal" in said
