"""What extraction costs: time by stage beside OpenCV, storing, the first call, memory.

    RELMODEL_TEST_DATA=... python benchmarks/extraction_cost.py

Times are milliseconds of one picture of 1.2 megapixels, best of several, wall and of the processor; several threads
work, where there are processors for them, so on a busy machine only the processor's time tells.  A stage's time is how
long it kept the next waiting.  Storing: rows of one picture in a DuckDB store, without the bytes of the picture.  First
call: importing and extracting in a new process, with an empty cache of compiled kernels, and again with a full one."""

import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from time import perf_counter, process_time

import cv2
import numpy as np
from tabulate import tabulate

from relmodel.store.runs import Run
from relmodel.store.store import Store
from vision.cameras.images import read_picture
from vision.cameras.record import record_picture
from vision.extraction.extract import Extraction, extract
from vision.extraction.rows import make_rows, record_extraction

PICTURES = ("A/pairs/pair_00", "B/pairs/pair_00", "C/pairs/pair_00")
_FIRST_CALL = """
import sys
from time import perf_counter, process_time
import numpy as np
grey = np.load(sys.argv[1])
wall, cpu = perf_counter(), process_time()
from vision.extraction.extract import extract
extract(grey)
print(perf_counter() - wall, process_time() - cpu)
"""


def _best(work: Callable[[], object], times: int = 7) -> tuple[float, float]:
    """Least milliseconds, wall and of the processor."""
    laps = []
    for _ in range(times):
        wall, cpu = perf_counter(), process_time()
        work()
        laps.append((perf_counter() - wall, process_time() - cpu))
    return min(lap[0] for lap in laps) * 1e3, min(lap[1] for lap in laps) * 1e3


def stages(data: Path) -> None:
    """Wall time by stage; all of it and its peers, wall and of the processor."""
    by_stage, totals = [], []
    for name in PICTURES:
        grey = read_picture(data / "bulkhead" / f"{name}_left.png").grey
        eight_bit = grey.astype(np.uint8)
        laps: list[Extraction] = []
        one = _best(lambda grey=grey, laps=laps: laps.append(extract(grey)))  # type: ignore[misc]
        lsd = _best(lambda picture=eight_bit: cv2.createLineSegmentDetector().detect(picture))  # type: ignore[misc]
        canny = _best(lambda picture=eight_bit: cv2.Canny(cv2.GaussianBlur(picture, (0, 0), 2.0), 20, 50))  # type: ignore[misc]
        by_stage.append(
            {"ms": name, **{stage: min(lap.timings_s[stage] for lap in laps) * 1e3 for stage in laps[0].timings_s}}
        )
        for kind, at in (("wall", 0), ("processor", 1)):
            row = {"ms": f"{name} {kind}", "relmodel": one[at], "LSD": lsd[at], "Canny": canny[at]}
            totals.append({**row, "relmodel / LSD": one[at] / lsd[at]})
    print(tabulate(by_stage, headers="keys", floatfmt=".1f"), "\n")
    print(tabulate(totals, headers="keys", floatfmt=".1f"), "\n")


def storing(data: Path) -> None:
    """Milliseconds and megabytes of storing each picture in a run of its own."""
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "store.duckdb"
        Store.create(path).close()
        for name in PICTURES:
            picture = read_picture(data / "bulkhead" / f"{name}_left.png")
            found = extract(picture.grey)
            before = _used(path)
            with Store.open(path) as store, Run.begin(store, "extract", {}) as run:
                wall, cpu = perf_counter(), process_time()
                with run.write() as connection:
                    image = record_picture(run, connection, picture, keep_bytes=False)
                    record_extraction(run, connection, image, picture, found.parameters, make_rows(found))
                took = (perf_counter() - wall) * 1e3, (process_time() - cpu) * 1e3
            in_use, of_file = (after - earlier for after, earlier in zip(_used(path), before, strict=True))
            rows.append([name, *took, in_use, of_file])
    headers = ["storing", "ms wall", "ms processor", "MB in use", "MB of the file"]
    print(tabulate(rows, headers=headers, floatfmt=".1f"), "\n")


def _used(path: Path) -> tuple[float, float]:
    """Megabytes of a closed store that are in use, and of its file: what a checkpoint wrote anew lies free behind."""
    import duckdb

    with duckdb.connect(str(path), read_only=True) as connection:
        size = connection.execute("SELECT block_size * used_blocks FROM pragma_database_size()").fetchone()
    assert size is not None
    return size[0] / 1e6, path.stat().st_size / 1e6


def first_calls(data: Path) -> None:
    """Seconds of the first extraction of a process, without and with compiled kernels on disk."""
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        np.save(Path(folder) / "grey.npy", read_picture(data / "bulkhead" / f"{PICTURES[0]}_left.png").grey)
        for what in ("first call, nothing compiled", "second process"):
            out = subprocess.run(
                [sys.executable, "-c", _FIRST_CALL, str(Path(folder) / "grey.npy")],
                env={**os.environ, "NUMBA_CACHE_DIR": folder},
                check=True,
                capture_output=True,
                text=True,
            )
            rows.append([what, *map(float, out.stdout.split())])
    print(tabulate(rows, headers=["s", "wall", "processor"], floatfmt=".2f"), "\n")


def memory(data: Path) -> None:
    """Greatest memory of a process that extracts, by size of the picture."""
    rows = []
    for megapixels in (1.2, 24.0):
        out = subprocess.run(
            [sys.executable, __file__, str(data), str(megapixels)], check=True, capture_output=True, text=True
        )
        rows.append([megapixels, *map(float, out.stdout.split())])
    print(tabulate(rows, headers=["megapixels", "MB", "s"], floatfmt=".1f"), "\n")


def _of_size(data: Path, megapixels: float) -> None:
    grey = read_picture(data / "bulkhead" / f"{PICTURES[0]}_left.png").grey
    factor = np.sqrt(megapixels * 1e6 / grey.size)
    if factor > 1.01:
        noise = np.random.default_rng(0).normal(0.0, 1.5, np.round(np.array(grey.shape) * factor).astype(int))
        grey = np.round(cv2.resize(grey, noise.shape[::-1], interpolation=cv2.INTER_CUBIC) + noise).clip(0, 255)
    wall = perf_counter()
    extract(np.asarray(grey, dtype=np.float64))
    wall = perf_counter() - wall
    # not getrusage: a child's begins at what its parent held
    status = dict(line.split(":", 1) for line in Path("/proc/self/status").read_text().splitlines())
    print(int(status["VmHWM"].split()[0]) / 1024, wall)


def main() -> None:
    if len(sys.argv) == 3:
        _of_size(Path(sys.argv[1]), float(sys.argv[2]))
        return
    folder = os.environ.get("RELMODEL_TEST_DATA")
    if folder is None:
        print("RELMODEL_TEST_DATA names no folder: nothing to measure")
        return
    for measure in (stages, storing, first_calls, memory):
        measure(Path(folder))


if __name__ == "__main__":
    main()
