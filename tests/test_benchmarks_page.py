"""The page of the benchmarks: every benchmark has its place, and what one prints cannot break the page."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks import run
from benchmarks.run import BENCHMARKS, FULL_ONLY, Benchmark, Outcome
from tests.pages import Page

# What draws a picture of the docs, makes or keeps data that other scripts read, or works over a folder of trials in
# several steps.
TOOLS = {
    "answers",
    "house",
    "calibration",
    "fault_calls",
    "fault_rules",
    "fault_server",
    "faults",
    "inspection_snapshot",
    "load_snapshot",
}
TOOLS |= {"rendered_pairs", "run", "trials", "verdict"}


def test_every_benchmark_is_run() -> None:
    scripts = {file.stem for file in (Path(__file__).parents[1] / "benchmarks").glob("*.py")} - {"__init__"}
    assert {b.name for b in (*BENCHMARKS, *FULL_ONLY)} == scripts - TOOLS


def test_the_page_holds_what_was_printed() -> None:
    done = Outcome(Benchmark("scale_out"), ["--trials", "5"], "a  <script>alert(1)</script>  9.5", 1.25, 2.5)
    left = Outcome(Benchmark("extraction_cost"), [], "needs the test data", status="left out")
    read = Page(run.page([done, left], full=False))
    tags = [tag for tag, _ in read.elements]
    assert "script" not in tags
    assert "a  <script>alert(1)</script>  9.5" in read.text
    assert "python -m benchmarks.scale_out --trials 5" in read.text
    assert "left out" in read.text
    sources = [a[name] for _, a in read.elements for name in ("src", "href") if name in a]
    assert all(source.startswith(("#", "data:")) for source in sources)  # nothing from elsewhere


def test_a_benchmark_that_fails_or_lacks_data_says_so(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.delenv("RELMODEL_TEST_DATA", raising=False)
    cases = (Benchmark("scale_out", ("--nonsense",)), Benchmark("extraction_cost", needs_data=True))
    monkeypatch.setattr(run, "BENCHMARKS", cases)
    assert run.main(["--out", str(tmp_path / "pages/page.html")]) == 1
    said = capsys.readouterr().out
    first, second, *_ = (line.split()[:2] for line in said.splitlines())
    assert (first, second) == (["scale_out", "failed"], ["extraction_cost", "left"])
    page = (tmp_path / "pages/page.html").read_text()
    assert "unrecognized arguments: --nonsense" in page
    assert "set RELMODEL_TEST_DATA" in page
