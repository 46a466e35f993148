"""The benchmarks in one go, and one page of what they print: build/benchmarks.html.

    python -m benchmarks.run [--full] [--only NAME ...] [--out FILE.html]

The quick preset asks the same questions of fewer and smaller cases, and takes less than 20 minutes on two cores; --full
has no limit.  A benchmark that needs data that RELMODEL_TEST_DATA does not name, or that fails, says so in its place.
The page is written anew after each, so that what was measured is not lost."""

from __future__ import annotations

import argparse
import html
import importlib
import os
import platform
import resource
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path

_PEERS = ("duckdb", "numba", "numpy", "opencv-python-headless", "ortools", "rtree", "scipy")


@dataclass(frozen=True)
class Benchmark:
    """A module of this package with its arguments, quick and full; without need of the data, in full alone."""

    name: str
    quick: tuple[str, ...] = ()
    full: tuple[str, ...] = ()
    needs_data: bool = False


@dataclass
class Outcome:
    """What a benchmark printed and drew, and what it took (s)."""

    benchmark: Benchmark
    arguments: list[str]
    text: str = ""
    seconds: float = 0.0
    processor_s: float = 0.0
    status: str = "ok"


BENCHMARKS = (
    Benchmark("volume_queries", ("--spread", "clustered", "--boxes", "1000", "10000")),
    Benchmark(
        "relational_matching", ("--units", "20", "50", "--seeds", "2", "--seconds", "3", "--peers", "CP-SAT", "HiGHS")
    ),
    Benchmark("inspection", ("--pairs", "00", "05"), ("--repeat", "100")),
    Benchmark("extraction_cost", needs_data=True),
    Benchmark("stereo_methods", ("--pairs", "A0", "C1"), needs_data=True),
    Benchmark("without_prior", ("--pairs", "1"), needs_data=True),
    Benchmark("distances", ("--pairs", "1", "--sets", "A", "--crowds", "0"), needs_data=True),
    Benchmark("ablations", ("--pairs", "1", "--sets", "A", "render_box"), needs_data=True),
    Benchmark("alterations", ("--count", "10")),
    Benchmark("scale_out", ("--parts", "10000", "--engines", "duckdb", "postgresql")),
)
# What takes hours whatever it is given, or needs renders of its own: with --full alone.
FULL_ONLY = (
    Benchmark("extraction", needs_data=True),
    Benchmark("strangers", full=("--quick", "--seed", "1"), needs_data=True),
    Benchmark("standpoints", full=("--seed", "1"), needs_data=True),
)


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--full", action="store_true")
    parser.add_argument("--only", nargs="+", metavar="NAME", choices=[b.name for b in (*BENCHMARKS, *FULL_ONLY)])
    parser.add_argument("--out", type=Path, default=Path("build/benchmarks.html"))
    args = parser.parse_args(arguments)
    args.out.parent.mkdir(parents=True, exist_ok=True)
    chosen = [b for b in (*BENCHMARKS, *(FULL_ONLY if args.full else ())) if not args.only or b.name in args.only]
    outcomes: list[Outcome] = []
    for outcome in measured(chosen, full=args.full):
        outcomes.append(outcome)
        args.out.write_text(page(outcomes, full=args.full), encoding="utf-8")
        print(f"{outcome.benchmark.name:22} {outcome.status:10} {outcome.seconds:7.1f} s", flush=True)
    print(f"{args.out} is written")
    return int(any(outcome.status == "failed" for outcome in outcomes))


def measured(benchmarks: Sequence[Benchmark], *, full: bool) -> Iterator[Outcome]:
    """Run one after the other, each in a process of its own."""
    for benchmark in benchmarks:
        outcome = Outcome(benchmark, list(benchmark.full if full else benchmark.quick))
        if benchmark.needs_data and not os.environ.get("RELMODEL_TEST_DATA"):
            outcome.status = "left out"
            outcome.text = "needs the test data: set RELMODEL_TEST_DATA to its folder"
        else:
            _run(outcome, with_data=full or benchmark.needs_data)
        yield outcome


def _run(outcome: Outcome, *, with_data: bool) -> None:
    environment = {k: v for k, v in os.environ.items() if with_data or k != "RELMODEL_TEST_DATA"}
    began, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_CHILDREN)
    command = [sys.executable, "-m", f"benchmarks.{outcome.benchmark.name}", *outcome.arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=environment)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    outcome.seconds = time.perf_counter() - began
    outcome.processor_s = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    outcome.text = done.stdout.strip()
    if done.returncode:
        outcome.status = "failed"
        outcome.text += "\n" + "\n".join(done.stderr.strip().splitlines()[-5:])


def page(outcomes: Sequence[Outcome], *, full: bool) -> str:
    """One page without network: what was asked, and the tables as they were printed."""
    preset = "everything" if full else "the quick preset"
    rows = "".join(
        f'<tr><td><a href="#{o.benchmark.name}">{o.benchmark.name}</a></td><td>{o.status}</td>'
        f"<td>{o.seconds:.1f}</td><td>{o.processor_s:.1f}</td></tr>"
        for o in outcomes
    )
    return (
        f"<!DOCTYPE html><html lang=en><meta charset=utf-8><title>relmodel benchmarks</title><style>{_STYLE}</style>"
        f"<h1>Benchmarks: {preset}</h1><p>{html.escape(_machine())}</p>"
        "<table><tr><th>benchmark<th>status<th>seconds<th>of the processors</tr>"
        f"{rows}</table>{''.join(map(_section, outcomes))}</html>\n"
    )


def _section(outcome: Outcome) -> str:
    title, _, rest = (importlib.import_module(f"benchmarks.{outcome.benchmark.name}").__doc__ or "").partition("\n")
    command = " ".join(["python -m", f"benchmarks.{outcome.benchmark.name}", *outcome.arguments])
    return (
        f'<section id="{outcome.benchmark.name}"><h2>{html.escape(title)}</h2><p><code>{html.escape(command)}</code>'
        f"<details><summary>what is measured, and how</summary><pre>{html.escape(rest.strip())}</pre></details>"
        f"<pre>{html.escape(outcome.text)}</pre></section>"
    )


def _machine() -> str:
    """The processor, its cores, Python and the packages that are compared."""
    model = platform.machine()
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.is_file():
        names = [line.partition(":")[2].strip() for line in cpuinfo.read_text().splitlines() if "model name" in line]
        model = names[0] if names else model
    versions = []
    for name in _PEERS:
        try:
            versions.append(f"{name} {metadata.version(name)}")
        except metadata.PackageNotFoundError:
            versions.append(f"{name} not installed")
    return f"{os.cpu_count()} cores of {model}; Python {platform.python_version()}; {', '.join(versions)}"


_STYLE = """
:root { color-scheme: light dark; font: 16px/1.45 system-ui, sans-serif }
body { max-width: 70rem; margin: 2rem auto; padding: 0 1rem }
pre { overflow-x: auto; font-size: 13px; line-height: 1.35 }
td, th { padding: .15rem .9rem .15rem 0; text-align: left }
td:nth-child(n+3) { text-align: right; font-variant-numeric: tabular-nums }
section { border-top: 1px solid #8886; margin-top: 2rem }
"""

if __name__ == "__main__":
    sys.exit(main())
