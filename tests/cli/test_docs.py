"""What the documentation tells a person to type is taken by the program, and the README's commands run."""

from __future__ import annotations

import io
import re
import shlex
import shutil
from pathlib import Path
from typing import Any

import pytest
from PIL import Image

from relmodel.cli.main import VERBS, main, parser
from relmodel.find.find import in_volumes
from relmodel.store import Store
from tests.cli.conftest import Inspection
from tests.reading import load

CHECKOUT = Path(__file__).parents[2]
PAGES = sorted([CHECKOUT / "README.md", CHECKOUT / "examples/README.md", *(CHECKOUT / "docs").rglob("*.md")])
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
    """Every command of a page that begins with relmodel or make: in blocks, in indented lines, and in the text where it
    has options or arguments."""
    rest = _BLOCK.sub("", page)
    found = [words for block in shell_blocks(page) for words in commands(block)]
    for block in _INDENTED.findall(rest):
        if re.search(r"^ {4}(relmodel|make) ", block, re.MULTILINE):
            found += commands(block)
    inline = [shlex.split(text) for text in _INLINE.findall(rest) if re.match(r"(relmodel \w+ \S|make \w)", text)]
    return [words for words in found + inline if words[0] in ("relmodel", "make")]


def check(words: list[str]) -> None:
    """Fails where the program, or the Makefile, would not take the command."""
    if words[0] == "make":
        assert set(words[1:]) <= set(TARGETS), words
    elif "--help" not in words:
        try:
            parser().parse_args(words[1:])
        except SystemExit:
            pytest.fail(f"the program does not take: {shlex.join(words)}")


def test_commands_are_found_as_they_are_written() -> None:
    page = (
        "Say `make demo`, `relmodel find --level part`, or `relmodel`.\n\n```sh\n# not run: yours\n"
        'relmodel load a.step \\\n  --object "a b"  # twice\nls\n```\n\n    make test\n    python x.py\n\n'
        "```\nrelmodel printed\n```\n"
    )
    assert sorted(typed(page)) == [
        ["make", "demo"],
        ["make", "test"],
        ["relmodel", "find", "--level", "part"],
        ["relmodel", "load", "a.step", "--object", "a b"],
    ]
    with pytest.raises(AssertionError):
        check(["make", "coffee"])
    with pytest.raises(pytest.fail.Exception):
        check(["relmodel", "find", "--bocks", "1"])


@pytest.mark.parametrize("page", PAGES, ids=[str(page.relative_to(CHECKOUT)) for page in PAGES])
def test_commands_are_taken(page: Path) -> None:
    for words in typed(page.read_text()):
        check(words)


def test_readme_names_verbs_that_there_are() -> None:
    named = set(re.findall(r"\brelmodel ([a-z]+) -", "\n".join(page.read_text() for page in PAGES)))
    assert named <= set(VERBS)


@pytest.fixture
def demonstrated(inspection: Inspection, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The folder at hand is one where the demonstration has left its store, with the examples."""
    (tmp_path / "demo").mkdir()
    (tmp_path / "examples").symlink_to(CHECKOUT / "examples")
    for suffix in ("", ".journal"):
        shutil.copy(inspection.store + suffix, tmp_path / f"demo/cell.duckdb{suffix}")
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("RELMODEL_STORE", raising=False)


def run_shell_blocks(page: str, capsys: pytest.CaptureFixture[str]) -> None:
    """Every block in order; `# not run` keeps a block out."""
    blocks = shell_blocks(page)
    run = [words for block in blocks if not block.startswith("# not run") for words in commands(block)]
    assert run
    for words in run:
        check(words)
        if words[0] == "relmodel":
            assert main(words[1:]) == 0, words
            said = capsys.readouterr()
            assert (said.out + said.err).strip(), f"{shlex.join(words)} prints nothing"


@pytest.mark.usefixtures("demonstrated")
def test_readme_runs(capsys: pytest.CaptureFixture[str]) -> None:
    page = (CHECKOUT / "README.md").read_text()
    run_shell_blocks(page, capsys)
    shown = _ANSWERED.findall(page)
    assert shown
    for command, answer in shown:
        main(shlex.split(command)[1:])
        assert [line.rstrip() for line in capsys.readouterr().out.splitlines()] == answer.splitlines()


@pytest.mark.usefixtures("demonstrated")
@pytest.mark.parametrize("page", ["audit", "calibration", "loading", "report", "tutorial"])
def test_pages_run(page: str, capsys: pytest.CaptureFixture[str]) -> None:
    run_shell_blocks((CHECKOUT / f"docs/{page}.md").read_text(), capsys)


@pytest.mark.usefixtures("demonstrated")
def test_page_on_reports_runs(capsys: pytest.CaptureFixture[str]) -> None:
    run_shell_blocks((CHECKOUT / "docs/report.md").read_text(), capsys)
    assert "Accepted" in Path("run.html").read_text()
    assert "bulkhead A" in Path("bulkhead.html").read_text()


@pytest.mark.usefixtures("demonstrated")
def test_python_of_volume_queries_runs(capsys: pytest.CaptureFixture[str]) -> None:
    page = (CHECKOUT / "docs/volume-queries.md").read_text()
    said: dict[str, Any] = {}
    exec(next(block for language, block in _BLOCK.findall(page) if language == "python"), said)
    shown = capsys.readouterr().out.splitlines()
    assert shown
    assert len(shown) == len(said["found"]["name"])


@pytest.mark.usefixtures("demonstrated")
def test_python_page_runs(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    """Its blocks in order, as one program."""
    monkeypatch.setattr("relmodel.loading.load.load", load)
    said: dict[str, Any] = {}
    for language, block in _BLOCK.findall((CHECKOUT / "docs/python.md").read_text()):
        if language == "python":
            exec(block, said)
            assert capsys.readouterr().out or "print" not in block
    assert said["answer"].verdict == "accepted"
    picture = Image.open(io.BytesIO(said["answer"]._repr_png_()))
    assert (picture.format, picture.width) == ("PNG", 1600)
    assert "accepted" in said["answer"]._repr_html_()


@pytest.mark.usefixtures("demonstrated")
def test_scale_out_runs(capsys: pytest.CaptureFixture[str]) -> None:
    """Its commands and its Python for DuckDB; that for Spark runs in tests/find/test_parquet.py."""
    page = (CHECKOUT / "docs/scale-out.md").read_text()
    run_shell_blocks(page, capsys)
    for_duckdb = next(block for language, block in _BLOCK.findall(page) if language == "python")
    said: dict[str, Any] = {}
    exec(for_duckdb, said)
    with Store.open("demo/cell.duckdb", read_only=True) as store:
        found = in_volumes(store, said["volumes"], level="feature")
    assert [row[1:6] for row in said["rows"]] == list(
        zip(*(found[n].tolist() for n in ("volume_no", "occurrence_id", "element_no", "path", "name")), strict=True)
    )
    assert {row[1] for row in said["rows"]} == {0, 1}
