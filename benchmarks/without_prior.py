"""Pairs and single pictures located with no prior, by the right model and by others: where the join of circles puts the
truth.

    python -m benchmarks.without_prior [--pairs N] [--cameras both left right]

Of each bulkhead in the folder that RELMODEL_TEST_DATA names the first N pairs (default: all), each inspected without a
prior against every bulkhead, and each of its pictures alone.  `rank`: place of the truth among the poses of the join,
within 10 mm and 2 degrees; `score`, `next`: what the best and the next pose explain, of a pair the share of what stereo
put in space, of one picture the log odds of its ellipses; the error is that of the best hypothesis, whatever the
verdict, at the point that the pair was rendered about.  Times are of the wall, but `all`: of the processor.
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
from typing import Any

import numpy as np
import yaml
from tabulate import tabulate

from relmodel.arrays import Floats
from relmodel.geometry.transforms import matrices
from relmodel.loading.load import load
from relmodel.store import Store
from relmodel.world.placement import place_world
from vision.inspection import inspect

NEAR_MM, NEAR_DEG = 10.0, 2.0
HEADERS = (
    "model", "pair", "cameras", "verdict", "rank", "score", "next", "mm", "degrees", "join s", "localise s", "all s",
)  # fmt: skip
CAMERAS = {"both": ("left", "right"), "left": ("left",), "right": ("right",)}


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pairs", type=int, metavar="N")
    parser.add_argument("--parts", nargs="+", default=["A", "B", "C"], metavar="PART")
    parser.add_argument("--cameras", nargs="+", default=list(CAMERAS), choices=CAMERAS)
    args = parser.parse_args(arguments)
    data = os.environ.get("RELMODEL_TEST_DATA")
    if not data:
        sys.exit("set RELMODEL_TEST_DATA to the folder of the test data")
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for model in args.parts:
            store_file = Path(folder) / f"{model}.duckdb"
            place_part(store_file, Path(data) / "bulkhead" / model)
            for part in args.parts:
                for truth in read_truths(Path(data) / "bulkhead" / part)[: args.pairs]:
                    for cameras in args.cameras:
                        found = _inspect(store_file, truth, CAMERAS[cameras], part == model)
                        rows.append((model, f"{part}{truth['pair']}", cameras, *found))
                        print(*rows[-1], flush=True)
    print(tabulate(rows, headers=HEADERS, floatfmt=".3f"))
    return 0


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


def _inspect(store_file: Path, truth: dict[str, Any], seen: tuple[str, ...], is_there: bool) -> tuple[Any, ...]:
    """Verdict, rank, scores, error and times; rank and error where the pictures show the model.  One picture alone is
    that of a camera `left` that is the rig."""
    rig = write_rig(store_file.with_name("rig.yaml"), truth, seen)
    left, *right = (f"{truth['stem']}_{side}.png" for side in seen)
    with Store.open(store_file) as store:
        started = process_time()
        answer = inspect(store, rig=rig, left=left, right=right[0] if right else None, variants=False)
        took = process_time() - started
        with store.read() as connection:
            joined = store.columns(connection, "replay/joined_poses", run=answer.run)
    score = [*joined["score"].tolist(), np.nan, np.nan]
    times = [*(answer.timings_s.get(step, np.nan) for step in ("join", "localise")), took]
    if not is_there or answer.world_from_rig is None:
        return answer.verdict, None, *score[:2], None, None, *times
    true = np.array(truth["cameras"][seen[0]]["T_world_cam"])
    mm, degrees = compute_errors(matrices(joined), true)
    near = np.flatnonzero((mm < NEAR_MM) & (degrees < NEAR_DEG))
    rank = int(near[0]) + 1 if len(near) else None
    best = compute_errors(answer.world_from_rig[None], true)
    return answer.verdict, rank, *score[:2], float(best[0][0]), float(best[1][0]), *times


def compute_errors(poses: Floats, true: Floats) -> tuple[Floats, Floats]:
    """How far (mm) poses (k, 4, 4) put a point 700 mm before the rig from where the true one puts it, and by how much
    (degrees) they are turned."""
    ahead = np.array([0.0, 0.0, 700.0, 1.0])
    cosine = (np.einsum("kij,ij->k", poses[:, :3, :3], true[:3, :3]) - 1) / 2
    off = np.linalg.norm((poses - true) @ ahead, axis=1)
    return np.asarray(off), np.asarray(np.degrees(np.arccos(np.clip(cosine, -1, 1))))


if __name__ == "__main__":
    sys.exit(main())
