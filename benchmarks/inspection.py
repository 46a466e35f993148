"""Inspections against known poses: what they cost in a warm process, and how far off they are.

    python benchmarks/inspection.py [--pairs 00 01] [--overlays FOLDER] [--session] [--repeat N] [--against CHECKOUT]

The demonstration's pairs have exact truth and the priors that lie beside them.  Each is inspected with its prior and
without, with its decisions alone kept, with the pictures of the next pair in the place of its own (refused, after all
was tried), and through a lens that distorts: always new pictures, every row written, after one inspection that warmed
the process.  Seconds are those of the processor, over all threads; linear algebra has one.  `--repeat` inspects the
first pair N times more, for what a long series costs in time and memory; `--session` keeps the scene between pairs.
`--against` runs the same with the code of another checkout by turns, and prints both and their ratio, row by row, and
how far their poses are apart.

Where RELMODEL_TEST_DATA names the test data, every fourth photograph of `photo_cube` (reference poses fitted to the
cube's edges, not exact) and every fourth picture of `render_box` are inspected too (not with `--pairs`), each from a
prior 10 mm and 3 degrees off in a direction drawn with a fixed seed.  The error is that of the best hypothesis, refused
or not, at the target point, or on the axis as far off as the model, seen from the camera.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import yaml

from relmodel.arrays import Floats
from relmodel.geometry.transforms import apply, inverse, rotation_matrix
from relmodel.loading.load import load
from relmodel.resources import resource_dir
from relmodel.store import Store
from relmodel.world.placement import place_world
from vision.cameras.images import read_picture
from vision.inspection import Task, inspect
from vision.inspection.demonstration import Truth, measure_pose_error, read_truth

OFF_MM, OFF_DEG = 10.0, 3.0
DISTORTION = [-0.12, 0.03, 0.0004, -0.0003, 0.0]
HERE = Path(__file__).parents[1]
DEMO = resource_dir("demo")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pairs", nargs="+", metavar="NUMBER", help="of the demonstration alone (default: all)")
    parser.add_argument("--overlays", type=Path, help="write the model drawn over each picture into this folder")
    parser.add_argument("--session", action="store_true", help="keep the scene between the pairs")
    parser.add_argument("--repeat", type=int, default=0, metavar="N", help="inspect the first pair N times more")
    parser.add_argument("--against", type=Path, metavar="CHECKOUT", help="compare with the code of another checkout")
    parser.add_argument("--measure", action="store_true", help=argparse.SUPPRESS)  # the child: a row for each line
    args = parser.parse_args()
    if args.measure:
        rows = measured(args)
        for _ in sys.stdin:
            print(json.dumps(next(rows, None)), flush=True)
        return
    if args.overlays:
        args.overlays.mkdir(parents=True, exist_ok=True)
    ours = _measure(HERE, sys.argv[1:])
    if args.against:
        _print_ratios(_measure(args.against.resolve(), sys.argv[1:]), ours)
        return
    peak = 0.0
    _say("picture", "kind", "verdict", "target mm", "deg", "cpu s", "passed", "MB", "reason")
    for row in ours:
        _say(
            *(
                row[n]
                for n in ("name", "kind", "verdict", "target", "rotation", "seconds", "passed", "memory", "reason")
            )
        )
        peak = max(peak, row["peak"])
    print(f"memory in MB after each; at most {peak:.0f} MB")


def _measure(checkout: Path, words: Sequence[str]) -> Iterator[dict[str, Any]]:
    """Rows of a process of its own that runs the code of a checkout, each measured when it is asked for."""
    environment = os.environ | {"PYTHONPATH": str(checkout), "OPENBLAS_NUM_THREADS": "1"}
    child = [sys.executable, __file__, *words, "--measure"]
    with subprocess.Popen(child, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=environment) as process:
        assert process.stdin
        assert process.stdout
        while True:
            process.stdin.write("\n")
            process.stdin.flush()
            answer = process.stdout.readline()
            if not answer:
                raise SystemExit(f"the inspections of {checkout} ended with an error")
            row: dict[str, Any] | None = json.loads(answer)
            if row is None:
                return
            yield row


def _print_ratios(old: Iterator[dict[str, Any]], new: Iterator[dict[str, Any]]) -> None:
    """Rows of both, measured by turns, as they come."""
    sums = np.zeros(2)
    _say("picture", "kind", "verdict", "mm apart", "deg apart", "old s", "new s", "new/old", "old, new MB")
    for a, b in zip(old, new, strict=True):
        apart: tuple[float | None, float | None] = (None, None)
        if a["pose"] and b["pose"]:
            off = measure_pose_error(np.array(b["pose"]), Truth("", np.array(a["pose"]), np.array(a["at"])))
            apart = off.target_mm, off.rotation_deg
        verdict = a["verdict"] if a["verdict"] == b["verdict"] else f"{a['verdict']} -> {b['verdict']}"
        seconds, memory = (a["seconds"], b["seconds"]), f"{a['memory']:.0f}, {b['memory']:.0f}"
        _say(a["name"], a["kind"], verdict, *apart, *seconds, b["seconds"] / a["seconds"], memory)
        sums += seconds
    print(f"all: {sums[0]:.1f} s, now {sums[1]:.1f} s")


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
            yield from single_pictures(Path(str(data)) / name, Path(folder), args.overlays)


def stereo_pairs(folder: Path, args: argparse.Namespace) -> Iterator[dict[str, Any]]:
    """The demonstration's pairs, each against its variant, in every kind."""
    stems = sorted(file.name.removesuffix("_truth.json") for file in DEMO.glob("pair_*_truth.json"))
    chosen = [stem for stem in stems if not args.pairs or stem.removeprefix("pair_") in args.pairs]
    with Store.create(folder / "pairs.duckdb") as store:
        worlds = {}
        for variant, file in (("A", "world.yaml"), ("B", "world_B.yaml")):
            load(store, DEMO / f"bulkhead_{variant}.step.gz", name="bulkhead", variant=variant)
            worlds[variant] = place_world(store, DEMO / file).world
        kept: dict[str, Any] = {}
        if args.session:
            from vision.scene import Scenes

            kept["scenes"] = Scenes(store)
        shown = _Pictures(folder)

        def one(stem: str, kind: str, name: str = "") -> dict[str, Any]:
            truth, rig = read_truth(DEMO / f"{stem}_truth.json"), DEMO / f"{stem}_rig.yaml"
            source = stems[(stems.index(stem) + 1) % len(stems)] if kind == "another" else stem
            if kind == "distorted":
                rig = shown.distort_rig(rig)
            given: dict[str, Any] = {
                "rig": rig,
                "pictures": {
                    name: shown.new(DEMO / f"{source}_{name}.png", rig if kind == "distorted" else None)
                    for name in ("left", "right")
                },
                "prior": None if kind == "no prior" else DEMO / f"{stem}_prior.yaml",
                "world": worlds[truth.variant],
                "full_audit": kind != "minimal",
            }
            overlay = args.overlays / f"{stem}.png" if args.overlays and kind == "prior" else None
            return _row(name or stem, kind, store, truth, **given, overlay=overlay, **kept)

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


def single_pictures(data: Path, folder: Path, overlays: Path | None) -> Iterator[dict[str, Any]]:
    """Every fourth picture of a folder with `frames.json` and `model.obj`, in millimetres."""
    random = np.random.default_rng(1)
    described = json.loads((data / "frames.json").read_text())
    with Store.create(folder / f"{data.name}.duckdb") as store:
        load(store, data / "model.obj", name="model", unit=described.get("unit", "mm"))
        (folder / "world.yaml").write_text("world: cell\nobjects: [{object: model}]\n")
        place_world(store, folder / "world.yaml")
        for frame in described["frames"][::4]:
            picture = read_picture(data / frame["image"])
            world_from_camera = inverse(np.array(frame["camera_from_object"], float))
            off = np.eye(4)
            turn, shift = random.normal(size=(2, 3))
            off[:3, :3] = rotation_matrix(np.radians(OFF_DEG) * turn / np.linalg.norm(turn))
            off[:3, 3] = OFF_MM * shift / np.linalg.norm(shift)
            camera = {
                "width": picture.width,
                "height": picture.height,
                "matrix": frame["K"],
                "rig_from_camera": np.eye(4).tolist(),
            }
            sigma = {"translation_mm": OFF_MM / np.sqrt(3), "rotation_deg": OFF_DEG / np.sqrt(3)}
            sigma = {name: float(value) for name, value in sigma.items()}
            prior = {"world_from_rig": (world_from_camera @ off).tolist(), "sigma": sigma}
            (folder / "rig.yaml").write_text(yaml.safe_dump({"cameras": {"left": camera}}))
            (folder / "prior.yaml").write_text(yaml.safe_dump(prior))
            stem = f"{data.name} {Path(frame['image']).stem}"
            # On the axis, as far off as the model's origin.
            away = np.array([[0.0, 0.0, float(np.linalg.norm(world_from_camera[:3, 3]))]])
            yield _row(
                stem,
                "one camera",
                store,
                Truth("", world_from_camera, apply(world_from_camera, away)[0]),
                rig=folder / "rig.yaml",
                pictures={"left": data / frame["image"]},
                prior=folder / "prior.yaml",
                overlay=overlays / f"{stem.replace(' ', '_')}.png" if overlays else None,
            )


def _row(name: str, kind: str, store: Store, truth: Truth, **given: Any) -> dict[str, Any]:
    """What an inspection answered, how far off it is, and what it took: s of the processor and by the clock, MB."""
    processor, clock = time.process_time(), time.perf_counter()
    answer = inspect(store, Task(**given))
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
        "peak": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3,
        "reason": answer.reason[:60],
        "pose": None if pose is None else pose.tolist(),
        "at": truth.target.tolist(),
    }


if __name__ == "__main__":
    main()
