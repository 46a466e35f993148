"""Inspections against known poses: what they cost in a warm process, and how far off they are.

    python -m benchmarks.inspection [--pairs 00 01] [--overlays FOLDER] [--session] [--repeat N]

The demonstration's pairs have exact truth and the priors that lie beside them.  Each is inspected with its prior and
without, with its decisions alone kept, with the pictures of the next pair in the place of its own (refused, after all
was tried), and through a lens that distorts: always new pictures, every row written, after one inspection that warmed
the process.  Seconds are those of the processor, over all threads; linear algebra has one.  `--repeat` inspects the
first pair N times more, for what a long series costs in time and memory; `--session` keeps the scene between pairs.

Where RELMODEL_TEST_DATA names the test data, every fourth photograph of `photo_cube` (reference poses fitted to the
cube's edges, not exact) and every fourth picture of `render_box` are inspected too (not with `--pairs`), each from a
prior drawn some 10 mm and 3 degrees off.  The error is that of the best hypothesis, refused or not, at the target
point, or on the axis as far off as the model, seen from the camera."""

from __future__ import annotations

import argparse
import os
import resource
import tempfile
import time
from collections.abc import Callable, Iterator
from functools import partial
from itertools import islice
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import yaml

from benchmarks.trials import Models, inspect_trial, single_pictures
from relmodel.arrays import Floats
from relmodel.loading.load import load
from relmodel.resources import resource_dir
from relmodel.store import Store
from relmodel.world.placement import place_world
from vision.inspection import Inspection, Task, inspect
from vision.inspection.demonstration import Truth, measure_pose_error, read_truth
from vision.scene import Scenes

DISTORTION = [-0.12, 0.03, 0.0004, -0.0003, 0.0]
DEMO = resource_dir("demo")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pairs", nargs="+", metavar="NUMBER", help="of the demonstration alone (default: all)")
    parser.add_argument("--overlays", type=Path, help="write the model drawn over each picture into this folder")
    parser.add_argument("--session", action="store_true", help="keep the scene between the pairs")
    parser.add_argument("--repeat", type=int, default=0, metavar="N", help="inspect the first pair N times more")
    args = parser.parse_args()
    if args.overlays:
        args.overlays.mkdir(parents=True, exist_ok=True)
    peak = 0.0
    _say("picture", "kind", "verdict", "target mm", "deg", "cpu s", "passed", "MB", "reason")
    for row in measured(args):
        _say(*list(row.values())[:-1])
        peak = max(peak, row["peak"])
    print(f"memory in MB after each; at most {peak:.0f} MB")


def _say(*cells: object) -> None:
    words = ["-" if it is None else f"{it:.4g}" if isinstance(it, float) else str(it) for it in cells]
    widths = (16, 10, 10, 9, 9, 7, 7, 7, 0)
    print("  ".join(word.ljust(width) for word, width in zip(words, widths, strict=True)).rstrip(), flush=True)


def measured(args: argparse.Namespace) -> Iterator[dict[str, Any]]:
    """Rows of all that the call asks for."""
    with tempfile.TemporaryDirectory() as folder:
        yield from stereo_pairs(Path(folder), args)
        data = None if args.pairs else os.environ.get("RELMODEL_TEST_DATA")
        for name in ("photo_cube", "render_box") if data else ():
            yield from one_camera(Path(str(data)), name, Path(folder), args.overlays)


def stereo_pairs(folder: Path, args: argparse.Namespace) -> Iterator[dict[str, Any]]:
    """The demonstration's pairs, each against its variant, in every kind."""
    stems = sorted(file.name.removesuffix("_truth.json") for file in DEMO.glob("pair_*_truth.json"))
    chosen = [stem for stem in stems if not args.pairs or stem.removeprefix("pair_") in args.pairs]
    with Store.create(folder / "pairs.duckdb") as store:
        worlds = {}
        for variant, file in (("A", "world.yaml"), ("B", "world_B.yaml")):
            load(store, DEMO / f"bulkhead_{variant}.step.gz", name="bulkhead", variant=variant)
            worlds[variant] = place_world(store, DEMO / file).world
        scenes = Scenes(store) if args.session else None
        shown = _Pictures(folder)

        def one(stem: str, kind: str, name: str = "") -> dict[str, Any]:
            truth, rig = read_truth(DEMO / f"{stem}_truth.json"), DEMO / f"{stem}_rig.yaml"
            source = stems[(stems.index(stem) + 1) % len(stems)] if kind == "another" else stem
            if kind == "distorted":
                rig = shown.distort_rig(rig)
            task = Task(
                rig=rig,
                pictures={
                    name: shown.new(DEMO / f"{source}_{name}.png", rig if kind == "distorted" else None)
                    for name in ("left", "right")
                },
                prior=None if kind == "no prior" else DEMO / f"{stem}_prior.yaml",
                world=worlds[truth.variant],
                full_audit=kind != "minimal",
                overlay=args.overlays / f"{stem}.png" if args.overlays and kind == "prior" else None,
            )
            return _row(name or stem, kind, truth, partial(inspect, store, task, scenes=scenes))

        one(chosen[0], "prior")
        for stem in chosen:
            for kind in ("prior", "no prior", "minimal", "another", "distorted"):
                yield one(stem, kind)
        for number in range(args.repeat):
            yield one(chosen[0], "prior", str(number)) | {"kind": "repeated"}


class _Pictures:
    """Pictures of a folder that no store has seen: each differs from its source in one pixel's last bit."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.count = folder, 0

    def new(self, source: Path, distorting: Path | None = None) -> Path:
        """A copy, as the distorting camera of a rig file shows it."""
        grey = np.asarray(cv2.imread(str(source), cv2.IMREAD_UNCHANGED))
        if distorting is not None:
            camera = yaml.safe_load(distorting.read_text())["cameras"][source.stem.rpartition("_")[2]]
            matrix, (rows, columns) = np.array(camera["matrix"], float), grey.shape[:2]
            pixels = np.stack(np.meshgrid(np.arange(columns), np.arange(rows)), axis=-1).reshape(-1, 1, 2)
            ideal = cv2.undistortPoints(pixels.astype(float), matrix, np.array(DISTORTION), P=matrix)
            places = ideal.reshape(rows, columns, 2).astype(np.float32)
            grey = cv2.remap(grey, places, None, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)  # type: ignore[call-overload]
        grey[divmod(self.count, grey.shape[1])] ^= 1
        self.count += 1
        out = self.folder / f"{self.count}.png"
        cv2.imwrite(str(out), grey)
        return out

    def distort_rig(self, source: Path) -> Path:
        """The rig with DISTORTION in both cameras."""
        rig = yaml.safe_load(source.read_text())
        for camera in rig["cameras"].values():
            camera["distortion"] = {"model": "opencv", "coefficients": DISTORTION}
        out = self.folder / f"distorted_{source.name}"
        out.write_text(yaml.safe_dump(rig))
        return out


def one_camera(data: Path, name: str, folder: Path, overlays: Path | None) -> Iterator[dict[str, Any]]:
    """Every fourth picture of a body."""
    models = Models(folder)
    for trial in islice(single_pictures(data, name, models), 0, None, 4):
        assert trial.world_from_rig is not None
        overlay = overlays / f"{trial.name.replace(' ', '_')}.png" if overlays else None
        truth = Truth("", trial.world_from_rig, trial.target)
        with models.open(name) as store:
            yield _row(trial.name, "one camera", truth, partial(inspect_trial, store, trial, folder, overlay=overlay))


def _row(name: str, kind: str, truth: Truth, ask: Callable[[], Inspection]) -> dict[str, Any]:
    """What an inspection answered, how far off it is, and what it took: s of the processor and by the clock, MB."""
    processor, clock = time.process_time(), time.perf_counter()
    answer = ask()
    took = time.process_time() - processor, time.perf_counter() - clock
    pose: Floats | None = answer.hypotheses[0]["world_from_rig"] if answer.hypotheses else None
    off = None if pose is None else measure_pose_error(pose, truth)
    status = Path("/proc/self/statm")
    pages = int(status.read_text().split()[1]) if status.exists() else 0
    return {
        "name": name,
        "kind": kind,
        "verdict": answer.verdict,
        "target": off and off.target_mm,
        "rotation": off and off.rotation_deg,
        "seconds": took[0],
        "passed": took[1],
        "memory": pages * resource.getpagesize() / 1e6,
        "reason": answer.reason[:60],
        "peak": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3,
    }


if __name__ == "__main__":
    main()
