"""Pairs and single pictures held against all objects of one store, with no world and no prior: what is that, and where.

    python -m benchmarks.without_prior [--pairs N] [--cameras both left right] [--foreign FOLDER] [--only-foreign]

The store holds the shared bulkheads A and B as variants of one object and C as `lattice`, the demonstration's A and B
as variants of `demo`, and two small objects.  Pictures are those of the first N pairs of each bulkhead (default: all),
and those in FOLDER, `small_NNN_left.png` with rig and truth as `examples/render/trials.py` writes them, which show
nothing that the store holds.  `right`: the answer names what is there, alone or among look-alike variants, or names
nothing where nothing is.  `score`, `next`: what the best poses of the joins of two objects explain, of a pair the share
of what stereo put in space, of one picture the log odds of its ellipses; `rank`: place of the truth among the poses of
the join of what is answered, within 10 mm and 2 degrees; the error is that of the pose, at a point 700 mm before the
rig.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from time import process_time
from typing import Any, NamedTuple

import numpy as np
import yaml
from tabulate import tabulate

from benchmarks.constellation import JOINED_POSES
from relmodel.arrays import Floats
from relmodel.geometry.transforms import matrices
from relmodel.loading.load import load
from relmodel.resources import resource_dir
from relmodel.store import Store
from relmodel.store.bulk import fetch_columns
from relmodel.world.placement import place_world
from vision.inspection import Task, inspect

NEAR_MM, NEAR_DEG = 10.0, 2.0
HEADERS = (
    "pictures", "cameras", "verdict", "right", "shown", "alike", "score", "next", "rank", "mm", "degrees", "cpu s",
)  # fmt: skip
CAMERAS = {"both": ("left", "right"), "left": ("left",), "right": ("right",)}
DEMO = resource_dir("demo")
LOADED = {
    ("bulkhead", "A"): "bulkhead/A/bulkhead_parts.step",
    ("bulkhead", "B"): "bulkhead/B/bulkhead_parts.step",
    ("lattice", ""): "bulkhead/C/bulkhead_parts.step",
    ("assembly", ""): "step/as1-tu-203.stp",
    ("screw", ""): "step/screw.step",
}


class Truth(NamedTuple):
    """What pictures show: the object and variant, None where none is loaded; cameras as a rig file has them, but for
    their poses, and object_from_camera (4, 4), by name."""

    there: tuple[str, str] | None
    cameras: dict[str, dict[str, Any]]
    poses: dict[str, Floats]


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pairs", type=int, metavar="N")
    parser.add_argument("--cameras", nargs="+", default=["both"], choices=CAMERAS)
    parser.add_argument("--foreign", type=Path, metavar="FOLDER")
    parser.add_argument("--only-foreign", action="store_true")
    args = parser.parse_args(arguments)
    data = os.environ.get("RELMODEL_TEST_DATA")
    if not data:
        sys.exit("set RELMODEL_TEST_DATA to the folder of the test data")
    folders = [] if args.only_foreign else [*(Path(data) / f"bulkhead/{part}/pairs" for part in "ABC"), DEMO]
    files = [file for folder in folders for file in sorted(folder.glob("pair_*_truth.json"))[: args.pairs]]
    files += sorted(args.foreign.glob("small_*_truth.json")) if args.foreign else []
    rows = []
    with tempfile.TemporaryDirectory() as place, Store.create(Path(place) / "objects.duckdb") as store:
        for (name, variant), step in LOADED.items():
            load(store, Path(data) / step, name=name, variant=variant)
        for variant in "AB":
            load(store, DEMO / f"bulkhead_{variant}.step.gz", name="demo", variant=variant)
        for file in files:
            for cameras in args.cameras:
                found = _inspect(store, Path(place) / "rig.yaml", file, CAMERAS[cameras])
                rows.append(("/".join(file.parts[-3:]).removesuffix("_truth.json"), cameras, *found))
                print(*rows[-1], flush=True)
    print(tabulate(rows, headers=HEADERS, floatfmt=".3f"))
    print(f"right: {sum(row[3] for row in rows)} of {len(rows)}")
    return 0


def read_truth(file: Path) -> Truth:
    """The truth of a shared pair, of one of the demonstration or of a rendered trial."""
    it = json.loads(file.read_text())
    (width, height), shared = it["image_size"], "part_set" in it
    there: tuple[str, str] | None
    if shared:
        there = ("lattice", "") if it["part_set"] == "C" else ("bulkhead", it["part_set"])
    else:
        there = ("demo", it["variant"]) if "kind" not in it else None
    object_from_world = np.linalg.inv(np.array(it["T_world_part" if shared else "world_from_object"]))
    cameras, poses = {}, {}
    for name, one in it["cameras"].items():
        distortion = {"model": "opencv", "coefficients": it["distortion"] if shared else one["distortion"]}
        matrix = one["K" if shared else "matrix"]
        cameras[name] = {"width": width, "height": height, "matrix": matrix, "distortion": distortion}
        poses[name] = object_from_world @ np.array(one["T_world_cam" if shared else "world_from_camera"])
    return Truth(there, cameras, poses)


def _inspect(store: Store, rig: Path, file: Path, seen: tuple[str, ...]) -> tuple[Any, ...]:
    """What HEADERS name, from `verdict` on.  One picture alone is that of a camera `left` that is the rig."""
    truth = read_truth(file)
    first = np.linalg.inv(truth.poses[seen[0]])
    cameras = {
        name: truth.cameras[side] | {"rig_from_camera": (first @ truth.poses[side]).tolist()}
        for name, side in zip(("left", "right"), seen, strict=False)
    }
    rig.write_text(yaml.safe_dump({"cameras": cameras}))
    pictures = {
        name: str(file).replace("_truth.json", f"_{side}.png") for name, side in zip(cameras, seen, strict=True)
    }
    started = process_time()
    answer = inspect(store, Task(rig=rig, pictures=pictures, against=(), keep_images=False))
    took = process_time() - started
    named = {state: [] for state in ("shown", "alike")}  # type: dict[str, list[tuple[str, str]]]
    for it in answer.considered:
        named.get(it["state"], []).append((it["object"], it["variant"]))
    right = named["shown"] == [] if truth.there is None else truth.there in named["shown"] + named["alike"]
    right &= len({name for name, _ in named["shown"]}) <= 1
    by_object = {it["object"]: it["score"] or 0.0 for it in reversed(answer.considered)}
    scores = [*sorted(by_object.values(), reverse=True), np.nan][:2]
    words = [" ".join("".join(one) for one in named[state]) for state in ("shown", "alike")]
    errors: tuple[float | None, ...] = None, None, None
    if truth.there is not None and answer.world_from_rig is not None:
        with store.read() as connection:
            joined = fetch_columns(connection, JOINED_POSES, {"run": answer.run})
        mm, degrees = compute_errors(matrices(joined), truth.poses[seen[0]])
        near = np.flatnonzero((mm < NEAR_MM) & (degrees < NEAR_DEG))
        mm, degrees = compute_errors(answer.world_from_rig[None], truth.poses[seen[0]])
        errors = int(near[0]) + 1 if len(near) else None, float(mm[0]), float(degrees[0])
    return answer.verdict, right, *words, *scores, *errors, took


def read_truths(part: Path) -> list[dict[str, Any]]:
    """What the pairs of a bulkhead truly show, with the place of their files."""
    files = sorted((part / "pairs").glob("pair_*_truth.json"))
    return [json.loads(file.read_text()) | {"stem": str(file).removesuffix("_truth.json")} for file in files]


def place_part(store_file: Path, part: Path) -> None:
    """A store with a bulkhead placed as its pairs have it."""
    placed = {"object": "bulkhead", "world_from_object": read_truths(part)[0]["T_world_part"]}
    world = store_file.with_suffix(".yaml")
    world.write_text(yaml.safe_dump({"world": "cell", "objects": [placed]}))
    with Store.create(store_file) as store:
        load(store, part / "bulkhead_parts.step", name="bulkhead")
        place_world(store, world)


def write_rig(path: Path, truth: dict[str, Any], seen: Sequence[str] = ("left", "right")) -> Path:
    """The rig of a pair, or of one of its cameras, which it calls `left`."""
    (width, height), cameras = truth["image_size"], {}
    for name, side, pose in zip(("left", "right"), seen, (np.eye(4).tolist(), truth["T_left_right"]), strict=False):
        matrix = truth["cameras"][side]["K"]
        cameras[name] = {"width": width, "height": height, "matrix": matrix, "rig_from_camera": pose}
    path.write_text(yaml.safe_dump({"cameras": cameras}))
    return path


def compute_errors(poses: Floats, true: Floats) -> tuple[Floats, Floats]:
    """How far (mm) poses (k, 4, 4) put a point 700 mm before the rig from where the true one puts it, and by how much
    (degrees) they are turned."""
    ahead = np.array([0.0, 0.0, 700.0, 1.0])
    cosine = (np.einsum("kij,ij->k", poses[:, :3, :3], true[:3, :3]) - 1) / 2
    off = np.linalg.norm((poses - true) @ ahead, axis=1)
    return np.asarray(off), np.asarray(np.degrees(np.arccos(np.clip(cosine, -1, 1))))


if __name__ == "__main__":
    sys.exit(main())
