"""Whether a change of the house changed an answer, and what answers cost: `make answers BASE=COMMIT`.

    python -m benchmarks.answers COMMIT [--mm MM] [--deg DEGREES] [--only inspections|loads|cost]

The code of a commit and the code of now inspect the same pairs (`inspection_snapshot`), load the same files
(`load_snapshot`), and run warm inspections and a load by turns.  It fails where a verdict or a state is another, a pose
moved too far, a row of the model is another, or the ratio of a cost passes its limit.  What is gone is only named."""

from __future__ import annotations

import argparse
import json
import math
import os
import resource
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from benchmarks import inspection_snapshot, load_snapshot

HERE = Path(__file__).parents[1]
DEMO = HERE / "examples/demo"
LIMITS = {"processor time of a warm inspection": 0.75, "memory": 1.0, "processor time of a load": 1.0}
NOISE = 0.03  # what two runs of the same code differ by
TURNS = 5


@contextmanager
def checked_out(commit: str) -> Iterator[Path]:
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder) / "base"
        git = ["git", "-C", str(HERE), "worktree"]
        subprocess.run([*git, "add", "--quiet", "--detach", place, commit], check=True)
        try:
            yield place
        finally:
            subprocess.run([*git, "remove", "--force", place], check=True)


def compare_inspections(base: Path, folder: Path, mm: float, rad: float) -> bool:
    files = folder / "old.json", folder / "new.json"
    for file, code in zip(files, (base, HERE), strict=True):
        make = [sys.executable, inspection_snapshot.__file__, "make", str(file), "--checkout", str(code)]
        subprocess.run(make, check=True)
    return bool(inspection_snapshot.compare(*files, mm, rad))


def compare_loads(base: Path, folder: Path) -> bool:
    old, new = folder / "old", folder / "new"
    load_snapshot.make(old, base)
    load_snapshot.make(new)
    found = [
        f"{file.name}: {said}"
        for file in sorted(path for path in old.iterdir() if path.is_dir())
        for said in load_snapshot.differences(file, new / file.name)
    ]
    gone = {said.partition(": ")[2] for said in found if f": {load_snapshot.GONE}: " in said}
    others = [said for said in found if f": {load_snapshot.GONE}: " not in said]
    print(*sorted(gone), *(others or ["the rows of the model are equal"]), sep="\n")
    return bool(others)


def compare_costs(base: Path) -> bool:
    """Warm inspections of a pair, and loads, each in a process of its own, by turns."""
    measured = {code: [measure(code) for _ in range(TURNS)] for code in (base, HERE)}
    old, new = (np.array(measured[code]) for code in (base, HERE))
    ratios = np.median(new / old, axis=0)
    for (name, limit), a, b, ratio in zip(LIMITS.items(), np.median(old, 0), np.median(new, 0), ratios, strict=True):
        print(f"{name}: {a:.3g} -> {b:.3g}, {ratio:.2f} times (at most {limit:.2f})")
    return bool(np.any(ratios > np.array(list(LIMITS.values())) + np.array([0.0, NOISE, NOISE])))


def measure(code: Path) -> list[float]:
    """Seconds of a warm inspection, its peak of memory in MB, and seconds of a load of the demonstration."""
    out = subprocess.run(
        [sys.executable, __file__, "--measure", str(DEMO)],
        env=os.environ | {"PYTHONPATH": str(code)},
        cwd=code,
        capture_output=True,
        text=True,
        check=True,
    )
    return [float(word) for word in out.stdout.split()[-3:]]


def measure_here(demo: Path) -> None:
    """What `measure` reads, by whatever code is imported first."""
    import inspect
    import time

    import yaml

    import relmodel

    stem = demo / "pair_00"
    pictures = {side: f"{stem}_{side}.png" for side in ("left", "right")}
    with tempfile.TemporaryDirectory() as folder:
        given = {"rig": f"{folder}/rig.yaml", "prior": f"{stem}_prior.yaml"}
        rig = yaml.safe_load(Path(f"{stem}_rig.yaml").read_text())
        Path(given["rig"]).write_text(yaml.safe_dump({"sigma": {"centre_px": 0}, "cameras": rig["cameras"]}))
        relmodel.create(f"{folder}/cell.duckdb").close()
        with relmodel.open(f"{folder}/cell.duckdb", read_only=False) as store:
            started = time.process_time(), resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
            store.load(demo / "bulkhead_A.step.gz", name="bulkhead", variant="A")
            loaded = time.process_time() - started[0]
            loaded += resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - started[1]
            store.place(demo / "world.yaml")
            by_side = "left" in inspect.signature(store.inspect).parameters
            asked = given | pictures if by_side else given | {"pictures": pictures}
            store.inspect(**asked)
            began = time.process_time()
            for _ in range(2):
                store.inspect(**asked)
            seconds = (time.process_time() - began) / 2
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3
    print(json.dumps(seconds), json.dumps(peak), json.dumps(loaded))


def main() -> int:
    if sys.argv[1:2] == ["--measure"]:
        measure_here(Path(sys.argv[2]))
        return 0
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("commit", help="whose answers are right")
    parser.add_argument("--mm", type=float, default=0.02, help="how far poses may move (default 0.02)")
    parser.add_argument("--deg", type=float, default=0.002, help="how far they may turn (default 0.002)")
    parser.add_argument("--only", choices=("inspections", "loads", "cost"))
    given = parser.parse_args()
    failed = []
    with checked_out(given.commit) as base, tempfile.TemporaryDirectory() as folder:
        if given.only in (None, "inspections"):
            far = given.mm, math.radians(given.deg)
            failed += ["inspections"] * compare_inspections(base, Path(folder), *far)
        if given.only in (None, "loads"):
            failed += ["loads"] * compare_loads(base, Path(folder))
        if given.only in (None, "cost"):
            failed += ["cost"] * compare_costs(base)
    print(f"failed: {', '.join(failed)}" if failed else "answers are as they were")
    return bool(failed)


if __name__ == "__main__":
    sys.exit(main())
