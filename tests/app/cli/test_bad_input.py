"""Bad input: one sentence on stderr, exit status 3, and the store's model and results as they were."""

from __future__ import annotations

import copy
import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, ClassVar

import duckdb
import numpy as np
import pytest
import sqlalchemy as sa
import yaml
from PIL import Image

from relmodel.app.cli.main import main
from relmodel.errors import InputError, StoreError
from relmodel.names import visible
from relmodel.readers.formats import stem_of
from relmodel.store import Store, engine
from relmodel.world.world_file import read_world_file
from tests.app.cli.conftest import Inspection, Pair
from tests.given import Capsys, CopyStore
from tests.holding import held
from vision.cameras.files import read_prior, read_rig
from vision.cameras.images import read_picture
from vision.cameras.rig_file import read_yaml

Given = dict[str, Any]

# What a load or a world that fails once its run has begun leaves: the run, and why.
OF_RUNS = {"run", "run_input", "run_event", "load_report", "ledger"}


@pytest.fixture(scope="module")
def store(blocks_template: Path, copy_store: CopyStore) -> str:
    """One store for all: each test shows that it is as it was."""
    return copy_store(str(blocks_template))


def counts(store: str) -> dict[str, int]:
    """Rows of every table."""
    with duckdb.connect(store, read_only=True) as connection:
        names = [row[0] for row in connection.execute("SELECT table_name FROM duckdb_tables()").fetchall()]
        each = " UNION ALL ".join(f"SELECT '{name}', count(*) FROM \"{name}\"" for name in names)  # noqa: S608
        return dict(connection.execute(each).fetchall())


class Refuse:
    """The one sentence with which the command line refuses a call; the store is as it was, but for a failed run."""

    KNOWN: ClassVar[dict[str, dict[str, int]]] = {}  # of the store: nobody else writes to it

    def __init__(self, store: str, capsys: Capsys) -> None:
        self.store, self._capsys = store, capsys

    def __call__(self, *words: str | Path, status: int = 3, run: bool = True, store: str | None = None) -> str:
        of, given = store or self.store, list(map(str, words))
        before = (self.KNOWN.get(of) or counts(of)) if run else {}
        self._capsys.readouterr()
        named = [] if "--store" in given or given[0] == "rig" else ["--store", of]
        assert main([*given, *named]) == status
        out, said = self._capsys.readouterr()
        assert (out, said.count("\n")) == ("", 1), said
        assert said.startswith(f"relmodel {given[0]}: ")
        assert not said.rstrip().endswith(".")
        if run:
            self._check(of, before, said)
        return said

    def _check(self, store: str, before: dict[str, int], said: str) -> None:
        after = self.KNOWN[store] = counts(store)
        changed = {table for table in after if after[table] != before[table]}
        assert changed <= OF_RUNS
        if changed:
            with duckdb.connect(store, read_only=True) as connection:
                ended = "SELECT state, message FROM run_event WHERE kind = 'ended' ORDER BY run_id DESC LIMIT 1"
                ((state, message),) = connection.execute(ended).fetchall()
            assert (state, visible(message)) == ("failed", said.partition(": ")[2].rstrip("\n"))


@pytest.fixture
def refuse(store: str, capsys: Capsys) -> Refuse:
    return Refuse(store, capsys)


def changed(given: Given, place: str, value: object) -> Given:
    """A copy of what a YAML file says with one value changed: None takes it away, a function makes another of it."""
    out = copy.deepcopy(given)
    *path, last = place.split(".")
    inner: Any = out
    for key in path:
        inner = inner[int(key) if isinstance(inner, list) else key]
    if value is None:
        del inner[last]
    else:
        at: Any = int(last) if isinstance(inner, list) else last
        inner[at] = value(inner[at]) if callable(value) else value
    return out


# What these files may say otherwise, the tests of who reads them hold.
# The file, the place in it, what stands there instead (None: nothing; or what is made of it), and what is said.
BAD_VALUES: list[tuple[str, str, Any, str]] = [
    ("rig", "cameras.right", None, "no camera 'right'"),
    ("rig", "cameras.right.rig_from_camera", np.eye(4).tolist(), "at one place"),
    ("prior", "world_from_rig.0.3", float("nan"), "not finite"),
    ("prior", "world_from_rig.0", lambda row: [-x for x in row], "mirrors"),
    ("prior", "world_from_rig.0.3", 50_000.0, "nothing of the world"),
    ("prior", "sigma.rotation_deg", None, "'sigma.rotation_deg' is missing"),
    ("world", "objects.0.object", "blokcs", "is not loaded"),
    ("world", "world", None, "lacks world"),
]
WORLD = {"world": "table", "objects": [{"object": "blocks"}]}


@pytest.mark.parametrize(("kind", "place", "value", "says"), BAD_VALUES)
def test_a_bad_value(
    kind: str, place: str, value: Any, says: str, refuse: Refuse, blocks_pair: Pair, tmp_path: Path
) -> None:
    file = tmp_path / f"{kind}.yaml"
    given = {"rig": blocks_pair.rig, "prior": blocks_pair.prior, "world": WORLD}[kind]
    file.write_text(yaml.safe_dump(changed(given, place, value)))
    said = refuse("world", file) if kind == "world" else refuse("inspect", *blocks_pair.options(**{kind: file}))
    assert says in said


LONG, TRIANGLE = "x" * 300, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"


def test_names_that_no_store_holds(refuse: Refuse, tmp_path: Path) -> None:
    part, world = tmp_path / "part.obj", tmp_path / "world.yaml"
    part.write_text(TRIANGLE)
    world.write_text(yaml.safe_dump({**WORLD, "world": LONG}))
    assert "over 255 bytes: shorten it" in refuse("load", part, "--unit", "mm", "--object", "轴" * 86)
    assert "over 255 bytes: shorten it" in refuse("world", world)
    assert "is not in UTF-8" in refuse("load", os.fsdecode(b"tr\xe4ger.step") + "🔩.step", status=2)


def test_an_object_has_the_whole_stem_of_its_file_for_a_name() -> None:
    names = ("a.1.step.gz", "a.1.STP.GZ", "a.1.step", "a.1.OBJ")
    assert [stem_of(Path(f"in.d/{name}")) for name in names] == ["a.1"] * 4


@pytest.mark.parametrize("form", ["yaml", "json"])
def test_a_world_with_a_byte_order_mark(form: str, tmp_path: Path) -> None:
    file = tmp_path / f"world.{form}"
    file.write_text("\ufeff" + (json.dumps(WORLD) if form == "json" else yaml.safe_dump(WORLD)))
    assert read_world_file(file).world == "table"
    assert read_yaml(file, "prior") == WORLD


NO_YAML = [b"cameras:\n\tleft: 1\n", b"a: \xff\xfe", b"a: 2020-99-99\n", b"[" * 1000]
NO_YAML += [b"", b"- 1\n", b"\0", b"a: 1\n---\nb: 2\n"]


@pytest.mark.parametrize("content", NO_YAML, ids=[repr(c[:12]) for c in NO_YAML])
def test_files_that_are_no_yaml(content: bytes, tmp_path: Path) -> None:
    file = tmp_path / "bad.yaml"
    file.write_bytes(content)
    readers: list[Callable[[Path], object]] = [read_rig, read_prior, read_world_file]
    for read in readers:
        with pytest.raises(InputError) as refused:
            read(file)
        assert str(file) in str(refused.value)
        assert "\n" not in str(refused.value)


def beyond_all_bounds() -> bytes:
    """The header of a BMP file of 40,000 by 40,000 pixels."""
    side = (40_000).to_bytes(4, "little")
    header = (40).to_bytes(4, "little") + side + side + b"\1\0\10\0" + bytes(24)
    return b"BM" + bytes(8) + (54).to_bytes(4, "little") + header


# What is made of a good picture, and what is said of it.
BAD_PICTURES: list[tuple[Callable[[Path, Path], object], str]] = [
    (lambda good, to: None, "there is no image"),
    (lambda good, to: to.mkdir(), "is not a regular file"),
    (lambda good, to: to.write_text("hello"), "not a picture"),
    (lambda good, to: to.write_bytes(b""), "not a picture"),
    (lambda good, to: to.write_bytes(good.read_bytes()[:9999]), "cannot be read"),
    (lambda good, to: Image.open(good).convert("RGB").convert("LAB").save(to, "TIFF"), "coded as LAB"),
    (lambda good, to: Image.open(good).convert("F").save(to, "TIFF"), "neither grey nor colour of 8 or 16 bits"),
    (lambda good, to: to.write_bytes(beyond_all_bounds()), "cannot be read"),
]


@pytest.mark.parametrize(("make", "says"), BAD_PICTURES, ids=[says for _, says in BAD_PICTURES])
def test_bad_picture(make: Callable[[Path, Path], object], says: str, blocks_pair: Pair, tmp_path: Path) -> None:
    file = tmp_path / "bad.png"
    make(blocks_pair.right, file)
    with pytest.raises(InputError, match=says) as refused:
        read_picture(file)
    assert str(file) in str(refused.value)
    assert "\n" not in str(refused.value)


def test_picture_of_another_size(refuse: Refuse, blocks_pair: Pair, tmp_path: Path) -> None:
    with Image.open(blocks_pair.right) as good:
        good.crop((0, 0, 160, 120)).save(tmp_path / "cropped.png")
    given = blocks_pair.options(right=tmp_path / "cropped.png")
    assert "is 160x120 but its camera 320x240" in refuse("inspect", *given)


def test_empty_picture_is_refused_by_verdict(dark: Inspection, blocks_pair: Pair) -> None:
    """A lens cap is no damaged file: the run is there, and leaves the prior as it was."""
    answer, prior = dark.answer, blocks_pair.prior
    assert (answer["verdict"], answer["outcome"]["cause"]) == ("refused", "picture")
    assert answer["missing"]
    assert answer["posterior"] < 0.01
    np.testing.assert_allclose(answer["world_from_rig"], prior["world_from_rig"], atol=1e-9)
    sigma = [prior["sigma"]["translation_mm"], np.radians(prior["sigma"]["rotation_deg"])]
    np.testing.assert_allclose(np.sqrt(np.diag(answer["covariance"])), np.repeat(sigma, 3), rtol=1e-6)
    assert answer["parts_in_view"] == []


def a_device(to: Path) -> None:
    to.symlink_to("/dev/zero")


def a_huge_file(to: Path) -> None:
    with to.open("wb") as file:
        file.truncate(3 << 30)


NO_FILES: list[tuple[str, Callable[[Path], None], str]] = [
    ("load given.step", a_device, "is not a regular file"),
    ("load given.glb", a_huge_file, "is larger than 2048 MB"),
    ("world given.yaml", a_device, "is not a regular file"),
    ("inspect left given.png", a_huge_file, "is larger than 512 MB"),
    ("inspect --rig given.yaml", a_device, "is not a regular file"),
    ("inspect --prior given.yaml", a_huge_file, "is larger than 64 MB"),
    ("extract given.png", os.mkfifo, "is not a regular file"),
]


@pytest.mark.parametrize(("words", "make", "says"), NO_FILES, ids=[f"{w}-{m.__name__}" for w, m, _ in NO_FILES])
def test_what_is_no_file_or_may_never_end_is_not_read(
    words: str, make: Callable[[Path], None], says: str, refuse: Refuse, blocks_pair: Pair, tmp_path: Path
) -> None:
    """Least of all for its digest, which a run keeps of what it was given."""
    verb, *given = words.replace("given", str(tmp_path / "given")).split()
    file = next(Path(word) for word in given if word.startswith(str(tmp_path)))
    make(file)
    said = refuse(verb, *(blocks_pair.options(**{given[0].removeprefix("--"): file}) if verb == "inspect" else given))
    assert str(file) in said
    assert says in said


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ("load a.step --time-limit nan", "--time-limit is nan: give seconds, above 0"),
        ("load a.step --time-limit -1", "--time-limit is -1: give seconds, above 0"),
        ("diff A A --object blocks --reach nan", "the reach is nan: give mm, 0 or more"),
        ("diff A A --object blocks --reach -5", "the reach is -5: give mm, 0 or more"),
        ("inspect left=a.png --rig none.yaml", "there is no rig file none.yaml"),
        ("inspect PAIR --overlay none/a.png", "there is no folder"),
        ("inspect PAIR --overlay a.xyz", "has no picture suffix"),
        ("inspect PAIR --overlay .", "has no picture suffix"),
        ("inspect PAIR --overlay a.png --audit minimal", "a minimal audit leaves out"),
        ("inspect PAIR --crops crops --audit minimal", "a minimal audit leaves out"),
        ("inspect PAIR --world attic", "table"),
        ("init --store NAME.duckdb", "File name too long"),
        ("sql --store NAME/cell.duckdb SELECT", "File name too long"),
        ("export blocks -o NAME.glb", "File name too long"),
        ("report --object blocks -o NAME.html", "File name too long"),
        ("find --camera NAME.yaml --at NAME.yaml", "File name too long"),
    ],
)
def test_what_cannot_be_is_told_first(words: str, says: str, refuse: Refuse, blocks_pair: Pair, tmp_path: Path) -> None:
    status = 3 if "none" in words + says or says.startswith(("there", "has", "File")) else 2
    given = words.replace("PAIR", " ".join(blocks_pair.options())).replace("NAME", str(tmp_path / LONG))
    assert says in refuse(*given.split(), status=status)


def test_stores_that_are_none(duckdb_file: Path, refuse: Refuse, blocks_pair: Pair, tmp_path: Path) -> None:
    file = tmp_path / "cell.duckdb"

    def said(store: str | Path) -> str:
        return refuse("inspect", "--store", store, *blocks_pair.options(), run=False)

    assert "in memory only" in said(":memory:")
    assert "there is no store" in said(file)
    assert not file.exists()
    for content in (b"not a database", b"", bytes(100_000)):
        file.write_bytes(content)
        assert "is not a relmodel store" in said(file)
        assert file.read_bytes() == content
    file.unlink()
    duckdb.connect(str(file)).close()
    assert "is not a relmodel store" in said(file)
    assert "holds no world" in refuse("inspect", *blocks_pair.options(), status=2, store=str(duckdb_file))


def test_store_held_by_another_process(refuse: Refuse, blocks_pair: Pair, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(engine, "PATIENCE_S", 0.1)
    with held(refuse.store, read_only=False) as holder:
        assert f"in use by process {holder.pid}" in refuse("inspect", *blocks_pair.options(), run=False)


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
def test_journal_that_cannot_be_written_is_one_sentence(duckdb_file: Path, refuse: Refuse) -> None:
    Path(f"{duckdb_file}.journal").mkdir()
    part = duckdb_file.with_name("part.obj")
    part.write_text(TRIANGLE)
    assert "journal" in refuse("load", part, "--unit", "mm", "--store", duckdb_file, run=False)
