"""Pairs and single pictures held against all objects of one store, with no world and no prior: what is that, and where.

    python -m benchmarks.without_prior [--pairs N] [--cameras both left right] [--hide crop glare]
        [--foreign FOLDER] [--only-foreign]

The store holds the shared bulkheads A and B as variants of one object and C as `lattice`, the demonstration's A and B
as variants of `demo`, and two small objects.  Pictures are those of the first N pairs of each bulkhead (default: all),
and the small objects that `examples/render/trials.py` wrote below FOLDER, which are nothing that the store holds.
`right`: the answer names what is there, alone or among look-alike variants, or names nothing where nothing is.
`score`, `next`: what the best poses of the joins of two objects explain, of a pair the share of what stereo put in
space, of one picture the log odds of its ellipses; `rank`: of the truth among the join's poses of what is answered,
within 10 mm and 2 degrees; the error: at a point 700 mm before the rig.  --hide leaves .48 or lights .4 to .6."""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import replace
from itertools import islice, product
from pathlib import Path
from time import process_time
from typing import Any

import cv2
import numpy as np
from tabulate import tabulate

from benchmarks.trials import (
    CALIBRATED,
    JOINED_POSES,
    Models,
    Trial,
    compute_error,
    demonstration,
    find_data,
    find_rank,
    inspect_trial,
    rendered,
    shared_bulkheads,
)
from relmodel.geometry.transforms import inverse, matrices
from relmodel.loading.load import load
from relmodel.resources import resource_dir
from relmodel.store import Store
from relmodel.store.bulk import fetch_columns
from vision.cameras.cameras import Rig

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
THERE = {  # what a model of the trials is called here
    "shared_A": ("bulkhead", "A"),
    "shared_B": ("bulkhead", "B"),
    "shared_C": ("lattice", ""),
    "demo_A": ("demo", "A"),
    "demo_B": ("demo", "B"),
}


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pairs", type=int, metavar="N")
    parser.add_argument("--cameras", nargs="+", default=["both"], choices=CAMERAS)
    parser.add_argument("--hide", nargs="+", default=[], choices=("crop", "glare"))
    parser.add_argument("--foreign", type=Path, metavar="FOLDER")
    parser.add_argument("--only-foreign", action="store_true")
    args = parser.parse_args(arguments)
    data, rows = find_data(), []
    with tempfile.TemporaryDirectory() as place, Store.create(Path(place) / "objects.duckdb") as store:
        for (name, variant), step in LOADED.items():
            load(store, data / step, name=name, variant=variant)
        for variant in "AB":
            load(store, DEMO / f"bulkhead_{variant}.step.gz", name="demo", variant=variant)
        models, trials = Models(Path(place)), list[Trial]()
        if not args.only_foreign:
            for part in "ABC":
                trials += islice(shared_bulkheads(data, models, ("large",), part), args.pairs)
            trials += islice(demonstration(models), args.pairs)
        if args.foreign:
            trials += (trial for trial in rendered(args.foreign, models) if trial.name.startswith("small_"))
        if args.hide:
            trials = [_hide(trial, how, n, models.folder) for how in args.hide for n, trial in enumerate(trials)]
        for trial, cameras in product(trials, args.cameras):
            rows.append((trial.name, cameras, *_inspect(store, models, trial, CAMERAS[cameras])))
            print(*rows[-1], flush=True)
    print(tabulate(rows, headers=HEADERS, floatfmt=".3f"))
    print(f"right: {sum(row[3] for row in rows)} of {len(rows)}")
    return 0


def _hide(trial: Trial, how: str, number: int, folder: Path) -> Trial:
    """The trial with half of its pictures hidden: what a smaller picture leaves, or about a place drawn in each."""
    cameras, files, rng = {}, {}, np.random.default_rng(number)
    for side, grey in trial.pictures.items():
        camera, (rows, columns) = trial.rig.cameras[side], grey.shape
        if how == "crop":
            x, y = (number % 2) * round(0.4 * columns), round(0.1 * rows)
            shown = grey[y : y + round(0.8 * rows), x : x + round(0.6 * columns)]
            matrix = camera.matrix - [[0, 0, x], [0, 0, y], [0, 0, 0]]
            camera = replace(camera, width=shown.shape[1], height=shown.shape[0], matrix=matrix)
        else:
            down, across = np.mgrid[:rows, :columns]
            at = (0.2 + 0.6 * rng.random(2)) * (columns, rows)
            light = 600 * np.clip(1.6 - 4 * np.hypot(across - at[0], down - at[1]) / columns, 0, 1)
            shown = np.clip(grey + light, 0, 255)
        cameras[side], files[side] = camera, folder / f"{how}_{number}_{side}.png"
        cv2.imwrite(str(files[side]), np.asarray(shown, np.uint8))
    return replace(trial, name=f"{trial.name} {how}", rig=replace(trial.rig, cameras=cameras), files=files)


def _inspect(store: Store, models: Models, trial: Trial, seen: tuple[str, ...]) -> tuple[Any, ...]:
    """What HEADERS name, from `verdict` on.  The first camera is the rig; one alone is called `left`."""
    assert trial.world_from_rig is not None
    poses, placed = trial.rig.rig_from_camera, models.sources[trial.model][1]
    sides = dict(zip(("left", "right"), seen, strict=False))
    rig = Rig(
        {name: trial.rig.cameras[side] for name, side in sides.items()},
        {name: inverse(poses[seen[0]]) @ poses[side] for name, side in sides.items()},
        dict.fromkeys(sides, CALIBRATED),
    )
    files = {name: trial.files[side] for name, side in sides.items()}
    true = inverse(placed) @ trial.world_from_rig @ poses[seen[0]]
    there = THERE.get(trial.model)
    started = process_time()
    asked = replace(trial, rig=rig, files=files, prior=None)
    answer = inspect_trial(store, asked, models.folder, against=(), keep_images=False)
    took = process_time() - started
    named = {state: [] for state in ("shown", "alike")}  # type: dict[str, list[tuple[str, str]]]
    for it in answer.considered:
        named.get(it["state"], []).append((it["object"], it["variant"]))
    right = named["shown"] == [] if there is None else there in named["shown"] + named["alike"]
    right &= len({name for name, _ in named["shown"]}) <= 1
    by_object = {it["object"]: it["score"] or 0.0 for it in reversed(answer.considered)}
    scores = [*sorted(by_object.values(), reverse=True), np.nan][:2]
    words = [" ".join("".join(one) for one in named[state]) for state in ("shown", "alike")]
    errors: tuple[float | None, ...] = None, None, None
    if there is not None and answer.world_from_rig is not None:
        with store.read() as connection:
            joined = fetch_columns(connection, JOINED_POSES, {"run": answer.run})
        errors = find_rank(matrices(joined), true), *compute_error(answer, true)
    return answer.verdict, right, *words, *scores, *errors, took


if __name__ == "__main__":
    sys.exit(main())
