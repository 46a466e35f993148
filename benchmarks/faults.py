"""Whether the tests beside the code catch faults in it: `python -m benchmarks.faults --seed N --count 200`.

Plants faults by rule, one at a time, each in a copy of the checkout: another operator, comparison, sign, number, axis,
function or order of arguments, a term or a statement less, in SQL also another column or a condition less.  They are
drawn in equal numbers over the folders, from the lines that a small set of calls runs.  Of those planted a fault counts
where the calls still run and one of them answers otherwise.  Then the tests beside the code are run, those first that
are named like its module, the quickest next, up to 20 seconds of them.  Prints how many faults were caught by folder
and those that were not; fails where fewer are caught than asked for."""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import random
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from collections import defaultdict
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from itertools import zip_longest
from pathlib import Path
from queue import Queue
from types import FrameType
from typing import Any
from xml.etree import ElementTree

from benchmarks.fault_calls import CALLS, make_stores, plain
from benchmarks.fault_rules import Fault, label_of, python_faults, sql_faults
from relmodel.compiled import cache_folder

HERE = Path(__file__).parents[1]
BESIDE = {  # folder or file of code: folders of tests
    "relmodel/find": ["tests/find"],
    "relmodel/loading": ["tests/loading"],
    "relmodel/features": ["tests/features"],
    "relmodel/labelling": ["tests/labelling"],
    "vision/account": ["tests/vision/account"],
    "vision/cameras": ["tests/vision/cameras"],
    "vision/constellations": ["tests/vision/constellations"],
    "vision/extraction": ["tests/vision/extraction"],
    "vision/inspection": ["tests/vision/inspection"],
    "vision/localisation": ["tests/vision/localisation"],
    "vision/matching.py": ["tests/vision/matching"],
    "vision/planning.py": ["tests/vision/planning"],
    "vision/presence": ["tests/vision/presence"],
    "vision/relations": ["tests/vision/relations"],
    "vision/scene.py": ["tests/vision/localisation", "tests/vision/presence"],
    "vision/stereo": ["tests/vision/stereo"],
    "schema/100_volume_macros.duckdb.sql": ["tests/find"],
    "schema/102_many_volumes.duckdb.sql": ["tests/find"],
    "schema/105_view_macros.duckdb.sql": ["tests/find", "tests/vision/cameras"],
    "schema/106_volume_functions.duckdb.sql": ["tests/find"],
    "queries/constellations": ["tests/vision/constellations"],
    "queries/find": ["tests/find"],
    "queries/matching": ["tests/vision/matching", "tests/vision/relations"],
}
NAMED = {"schema/105": "view_volume", "schema": "long_parts", "queries/find": "long_parts"}  # not named like the files
TEST_SECONDS, CALL_SECONDS, MOST_SECONDS = 20.0, 120.0, 90.0
MOST_CALLS = 2  # of those that run the line of a fault, the quickest
LEAST, LEAST_OF_FOLDER = 0.85, 0.70

CALLS_OF_SQL = {"schema": ["find"], "queries": ["find", "inspect", "no_prior", "one_picture"]}
PRODUCT = ("relmodel", "vision", "schema", "queries", "examples/demo", "benchmarks/fault_calls.py")
COUNTED = ("caught", "survived")


def all_faults(root: Path) -> Iterator[Fault]:
    """Those of all files but `*_parameters.py`, whose numbers trials have set: benchmarks tell what they are worth."""
    for name in BESIDE:
        place = root / name
        for path in [place] if place.is_file() else sorted((*place.rglob("*.py"), *place.rglob("*.sql"))):
            if path.stem.endswith("_parameters"):
                continue
            file, text = path.relative_to(root).as_posix(), path.read_text()
            yield from python_faults(file, text) if path.suffix == ".py" else sql_faults(file, text)


class Tracer:
    """The lines of the checkout that run, by file."""

    def __init__(self) -> None:
        self.lines: dict[str, set[int]] = defaultdict(set)

    def __call__(self, frame: FrameType, event: str, _: Any) -> Callable[..., Any] | None:
        if not frame.f_code.co_filename.startswith(f"{HERE}{os.sep}"):
            return None
        lines = self.lines[frame.f_code.co_filename[len(str(HERE)) + 1 :]]

        def each(frame: FrameType, event: str, _: Any) -> Any:
            lines.add(frame.f_lineno)
            return each

        lines.add(frame.f_lineno)
        return each

    def run(self, call: Callable[[Path], Any], folder: Path) -> Any:
        sys.settrace(self)
        threading.settrace(self)
        try:
            return call(folder)
        finally:
            sys.settrace(None)


def answer(names: list[str], stores: Path, expected: dict[str, Answer]) -> None:
    """Call some, a line of JSON each, until one answers otherwise: the child; nothing expected, which lines ran."""
    from relmodel.errors import RelmodelError

    for name in names:
        tracer = Tracer()
        with tempfile.TemporaryDirectory() as folder:
            if not stores.exists():
                make_stores(stores)
            shutil.copytree(stores, folder, dirs_exist_ok=True)
            began = time.process_time()
            try:
                said = CALLS[name](Path(folder)) if expected else tracer.run(CALLS[name], Path(folder))
            except RelmodelError as error:
                said = str(error)
        digest = hashlib.sha256(json.dumps(plain(said), sort_keys=True).encode()).hexdigest()
        lines = {file: sorted(found) for file, found in tracer.lines.items()}
        seconds = time.process_time() - began
        print(json.dumps({"call": name, "digest": digest, "lines": lines, "seconds": seconds}), flush=True)
        if expected and expected[name].digest != digest:
            return


@dataclass(frozen=True)
class Answer:
    """What a call answers without a fault, which lines of which files it runs, and how long while these are noted."""

    digest: str
    lines: dict[str, list[int]]
    seconds: float


# Faults are planted in copies of the checkout, one after another.


class Copy:
    """A copy of the checkout with a cache of kernels of its own."""

    def __init__(self, place: Path) -> None:
        self.place, self.cache, made = place, place.with_name(f"{place.name}-kernels"), cache_folder()
        if made is not None:
            shutil.copytree(made, self.cache / made.name)
        listed = subprocess.run(["git", "ls-files", "-z"], cwd=HERE, capture_output=True, check=True).stdout
        for name in (HERE / word for word in listed.decode().split("\0") if word):
            if name.is_file():
                (place / name.relative_to(HERE)).parent.mkdir(parents=True, exist_ok=True)
                shutil.copy(name, place / name.relative_to(HERE))
        own = {"PYTHONPATH": str(place), "NUMBA_CACHE_DIR": str(self.cache), "OPENBLAS_NUM_THREADS": "1"}
        self.env, self.stamp = os.environ | own, 1_000_000_000
        server = subprocess.Popen(
            [sys.executable, "-m", "benchmarks.fault_server"], cwd=place, env=self.env, text=True,
            stdin=subprocess.PIPE, stdout=subprocess.PIPE,
        )  # fmt: skip
        assert server.stdin is not None
        assert server.stdout is not None
        self.asked, self.said = server.stdin, server.stdout

    def run(self, module: str, *arguments: str | Path, seconds: float) -> tuple[int | None, str]:
        """Exit status, None where it took too long, and what was printed."""
        out = self.place.with_name(f"{self.place.name}.out")
        print(json.dumps([module, list(map(str, arguments)), str(out)]), file=self.asked, flush=True)
        process = int(self.said.readline())
        too_long = threading.Event()

        def stop() -> None:
            too_long.set()
            os.killpg(process, 9)

        watch = threading.Timer(seconds, stop)
        watch.start()
        status = int(self.said.readline())
        watch.cancel()
        return (None if too_long.is_set() else status), out.read_text(errors="replace")

    def ask(self, names: list[str], stores: Path, expected: Path | None, seconds: float) -> dict[str, Answer] | None:
        """What calls answer; None where one does not run."""
        options: list[str | Path] = ["--expected", expected] if expected else []
        status, said = self.run("benchmarks.faults", "--answer", *names, "--stores", stores, *options, seconds=seconds)
        found = [json.loads(line) for line in said.splitlines() if line.startswith('{"call"')]
        if status != 0 and expected is None:
            sys.exit(f"the calls do not run:\n{said}")
        if status != 0:
            return None
        return {one["call"]: Answer(one["digest"], one["lines"], one["seconds"]) for one in found}

    @contextmanager
    def planted(self, fault: Fault) -> Iterator[None]:
        """While the block lasts the copy has the fault, and the kernels of other modules need no compiling."""
        file = self.place / fault.file
        text, times = file.read_bytes(), file.stat()
        file.write_bytes(text[: fault.start] + fault.text.encode() + text[fault.end :])
        self.stamp += 1  # Python takes a file of the same second and size for the one it has compiled
        os.utime(file, (self.stamp, self.stamp))
        made = self._cache_without(file) if file.name.endswith("kernels.py") else None
        try:
            yield
        finally:
            file.write_bytes(text)
            os.utime(file, ns=(times.st_atime_ns, times.st_mtime_ns))
            if made:
                shutil.rmtree(made, ignore_errors=True)

    def _cache_without(self, file: Path) -> Path:
        """Lay the cache of the faulted kernels: all but what the file holds and those that call it."""
        (whole,) = self.cache.glob("kernels-*")
        asked = [sys.executable, "-c", "from relmodel.compiled import cache_folder; print(cache_folder())"]
        said = subprocess.run(asked, cwd=self.place, env=self.env, capture_output=True, text=True, check=True).stdout
        made = Path(said.strip())
        shutil.copytree(whole, made, dirs_exist_ok=True)
        others = [other.stem for other in self.place.rglob("*kernels.py") if file.stem in other.read_text()]
        for kept in made.iterdir():
            if any(name in kept.name for name in (file.stem, *others)):
                kept.unlink()
        return made


def digest_of(*folders: str) -> str:
    """Hash of the files of some folders that git tracks."""
    listed = subprocess.run(["git", "ls-files", "-z", *folders], cwd=HERE, capture_output=True, check=True).stdout
    digest = hashlib.sha256()
    for name in sorted(listed.decode().split("\0")):
        digest.update(name.encode() + ((HERE / name).read_bytes() if (HERE / name).is_file() else b""))
    return digest.hexdigest()[:16]


def answers_kept(copy: Copy) -> Path:
    """The folder of what calls answer without a fault, and of the stores that they begin with, made once a product."""
    kept = HERE / "build/faults" / digest_of(*PRODUCT)
    if (kept / "answers.json").exists():
        return kept
    kept.mkdir(parents=True, exist_ok=True)
    answers: dict[str, Answer] = {}
    for name in CALLS:
        answers |= copy.ask([name], kept / "stores", None, 600) or {}
    (kept / "expected.json").write_text(json.dumps({name: it.digest for name, it in answers.items()}))
    for name in CALLS:
        again = copy.ask([name], kept / "stores", kept / "expected.json", 600)
        if again is None or answers[name].digest != again[name].digest:
            sys.exit(f"{name} answers otherwise each time")
    (kept / "answers.json").write_text(json.dumps({name: asdict(it) for name, it in answers.items()}))
    return kept


def time_tests(copy: Copy, kept: Path, folders: set[str]) -> dict[str, dict[str, float]]:
    """Seconds of each test of some folders that pass, by folder; measured once a product and folder, and kept."""
    found: dict[str, dict[str, float]] = {}
    for folder in sorted(folder for folder in folders if (copy.place / folder).is_dir()):
        file = kept / f"times-{digest_of(folder)}.json"
        if file.exists():
            found[folder] = json.loads(file.read_text())
            continue
        report = copy.place.parent / "junit.xml"
        copy.run("pytest", "-q", "-p", "no:cacheprovider", f"--junitxml={report}", folder, seconds=1200)
        cases = ElementTree.parse(report).iter("testcase")
        found[folder] = {
            f"{case.get('classname', '').replace('.', '/')}.py::{case.get('name')}": float(case.get("time", 0))
            for case in cases
            if case.find("failure") is None and case.find("error") is None
        }
        file.write_text(json.dumps(found[folder]))
    return found


def tests_beside(file: str, seconds: dict[str, dict[str, float]]) -> list[str]:
    """The tests beside a file that take no longer than TEST_SECONDS together, those named like it first."""
    stem = Path(file).stem.removesuffix("_kernels").removesuffix("_parameters")
    stem = next((name for folder, name in NAMED.items() if file.startswith(folder)), stem)
    folders = next(tests for name, tests in BESIDE.items() if file == name or file.startswith(f"{name}/"))
    all_of = {test: time for folder in folders for test, time in seconds.get(folder, {}).items()}
    chosen, total = [], 0.0
    for test in sorted(all_of, key=lambda test: (f"/test_{stem}.py" not in test, all_of[test])):
        if total + all_of[test] <= TEST_SECONDS:
            chosen.append(test)
            total += all_of[test]
    return chosen


def evaluate(fault: Fault, copy: Copy, kept: Path, answers: dict[str, Answer], tests: list[str]) -> str:
    """caught, survived, or why the fault does not count."""
    python = fault.file.endswith(".py")
    compiled = fault.file.endswith("kernels.py")
    names = [
        name
        for name in sorted(CALLS, key=lambda name: answers[name].seconds)
        if (fault.line in answers[name].lines.get(fault.file, []) or (compiled and fault.file in answers[name].lines))
        or (not python and name in CALLS_OF_SQL[fault.label])
    ]
    own = copy.place.with_name(f"{copy.place.name}-stores") if fault.label == "schema" else kept / "stores"
    with copy.planted(fault):
        found = copy.ask(names[:MOST_CALLS], own, kept / "expected.json", CALL_SECONDS)
        if fault.label == "schema":
            shutil.rmtree(own, ignore_errors=True)
        if found is None:
            return "does not run"
        if all(answers[name].digest == it.digest for name, it in found.items()):
            return "changes nothing"
        if not tests:
            return "survived"
        status, _ = copy.run("pytest", "-x", "-q", "-p", "no:cacheprovider", *tests, seconds=MOST_SECONDS)
    # It may break a file of tests, so that its tests are not found (4), or make one run on and on (None).
    return "survived" if status == 0 else "caught"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, nargs="+", default=[0], help="one or several, told together")
    parser.add_argument("--count", type=int, default=200, help="how many faults are planted a seed (default 200)")
    parser.add_argument("--only", nargs="*", default=[], help="of these folders only")
    parser.add_argument("--jobs", type=int, default=2, help="how many at once (default 2)")
    parser.add_argument("--json", type=Path, help="where each fault and what became of it is written")
    parser.add_argument("--answer", nargs="*", help=argparse.SUPPRESS)
    parser.add_argument("--stores", type=Path, help=argparse.SUPPRESS)
    parser.add_argument("--expected", type=Path, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.answer is not None:
        read = json.loads(given.expected.read_text()) if given.expected else {}
        answer(given.answer, given.stores, {name: Answer(digest, {}, 0.0) for name, digest in read.items()})
        return 0
    with tempfile.TemporaryDirectory() as scratch:
        outcomes = measure(Path(scratch), given)
    return report(outcomes, given)


def measure(folder: Path, given: argparse.Namespace) -> list[tuple[Fault, str]]:
    """What became of each fault that was planted."""
    copies: Queue[Copy] = Queue()
    first = Copy(folder / "copy0")
    kept = answers_kept(first)
    answers = {name: Answer(**it) for name, it in json.loads((kept / "answers.json").read_text()).items()}
    ran = {(file, line) for it in answers.values() for file, lines in it.lines.items() for line in lines}
    files = {file for file, _ in ran}
    living: dict[str, list[Fault]] = defaultdict(list)
    for fault in all_faults(HERE):
        lives = (fault.file, fault.line) in ran or not fault.file.endswith(".py")
        lives |= fault.file.endswith("kernels.py") and fault.file in files
        if lives and (not given.only or fault.label in given.only):
            living[fault.label].append(fault)
    planted = list(dict.fromkeys(fault for seed in given.seed for fault in draw(living, seed, given.count)))
    seconds = time_tests(first, kept, {test for label in living for test in tests_of(label)})
    copies.put(first)
    for number in range(1, given.jobs):
        copies.put(Copy(folder / f"copy{number}"))

    def work(fault: Fault) -> tuple[Fault, str]:
        copy = copies.get()
        try:
            became = evaluate(fault, copy, kept, answers, tests_beside(fault.file, seconds))
        finally:
            copies.put(copy)
        print(f"{became}: {fault}", file=sys.stderr, flush=True)
        return fault, became

    with ThreadPoolExecutor(given.jobs) as pool:
        return list(pool.map(work, planted))


def draw(living: dict[str, list[Fault]], seed: int, count: int) -> list[Fault]:
    """About so many faults, as many of each folder; the folders take turns."""
    drawn, each = random.Random(seed), -(-count // len(living))
    chosen = [drawn.sample(faults, min(each, len(faults))) for faults in living.values()]
    return [fault for turn in zip_longest(*chosen) for fault in turn if fault is not None]


def tests_of(label: str) -> list[str]:
    return [test for name, tests in BESIDE.items() if label_of(name) == label for test in tests]


def report(outcomes: list[tuple[Fault, str]], given: argparse.Namespace) -> int:
    """Print how many were caught by folder, and those that were not."""
    counted = sorted(((f, became) for f, became in outcomes if became in COUNTED), key=lambda it: str(it[0]))
    shares = {}
    for label in sorted({fault.label for fault, _ in counted}):
        caught = [became == "caught" for fault, became in counted if fault.label == label]
        shares[label] = sum(caught) / len(caught)
        print(f"{label}: {sum(caught)} of {len(caught)} caught, {shares[label]:.0%}")
    print(*(f"survived: {fault}" for fault, became in counted if became == "survived"), sep="\n")
    total = sum(became == "caught" for _, became in counted) / max(len(counted), 1)
    print(f"{total:.0%} of {len(counted)} caught (at least {LEAST:.0%}, of a folder {LEAST_OF_FOLDER:.0%})")
    if given.json:
        rows = [{**asdict(fault), "label": fault.label, "became": became} for fault, became in outcomes]
        given.json.write_text(json.dumps(rows, indent=1))
    return int(total < LEAST or min(shares.values(), default=0.0) < LEAST_OF_FOLDER)


if __name__ == "__main__":
    sys.exit(main())
