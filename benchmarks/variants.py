"""Which of six variants pictures show: how often the right one ranks first, with views whose truth is known.

    python -m benchmarks.variants run FOLDER --renders TRIALS   # a line of JSON a view, resumable
    python -m benchmarks.variants table FOLDER [--misses]

TRIALS is what `python -m examples.render.trials` wrote.  Each changed trial is a variant of its own, whose model is
built again from its seed; five at a time, with variant A that they were drawn from, they are six variants that differ
in three to six features each, and every view of the five is asked which of the six it shows, at the pose found with the
model of A.  Needs the extra `step`.  Poses are kept in FOLDER/poses, as benchmarks.presence keeps them.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.altered_models import write_variation
from benchmarks.presence import FOUND_MM, Case, locate
from benchmarks.trials import SAMPLED_PX, Models, Trial, add_line, find_differing, read_lines, rendered
from examples.render.trials import draw_again, read_list
from vision.inspection.demonstration import measure_pose_error
from vision.localisation.views import Observation
from vision.presence.presence_parameters import DEFAULTS as PRESENCE
from vision.presence.report import assess_variant
from vision.scene import Scene

GROUP = 5  # changed trials that are variants of one another, with the one that they were drawn from
SEEN_PX = 200  # pixels in which two variants must differ in a camera to differ visibly
BASE = "A"


def make_model(name: str, truth: dict[str, Any], file: Path) -> None:
    """Write the STEP file of the part that a changed trial shows."""
    (listed,) = (trial for trial in read_list() if trial.name == name)
    write_variation(draw_again(listed, truth["changes"]), file)


def groups(renders: Path, models: Models) -> Iterator[list[tuple[Trial, Path]]]:
    """Changed trials with the files of their truth, five by five; bolts of clips, which are one assembly, stay out."""
    trials = [
        (trial, file)
        for trial in rendered(renders, models)
        if trial.group == "changed"
        for file in renders.glob(f"*/{trial.name}_truth.json")
        if not any("/BOLT" in row["name"] for row in json.loads(file.read_text())["changes"])
    ]
    for first in range(0, len(trials) - GROUP + 1, GROUP):
        yield trials[first : first + GROUP]


def run(folder: Path, renders: Path) -> None:
    """Rank the six variants of each group in each of its views that has no line yet."""
    made, poses, file = folder / "models", folder / "poses", folder / "variants.jsonl"
    for path in (made, poses):
        path.mkdir(parents=True, exist_ok=True)
    done = {line["name"] for line in read_lines(file)}
    for group in groups(renders, Models(folder)):
        if done.issuperset(trial.name for trial, _ in group):
            continue
        models = Models(folder)  # of this group alone
        list(rendered(renders, models))
        base = group[0][0].model
        names = {BASE: base}
        for trial, truth in group:
            step = made / f"{trial.name}.step.gz"
            if not step.exists():
                make_model(trial.name, json.loads(truth.read_text()), step)
            names[trial.name] = models.add(trial.name, step, models.sources[base][1])
        for trial, _ in group:
            if trial.name in done:
                continue
            line = rank(trial, names, models, poses / f"{trial.name}.pickle")
            add_line(file, line)
            print(f"{trial.name}: {line['ranked'][0]['variant']} first", flush=True)


def rank(trial: Trial, names: dict[str, str], models: Models, kept: Path) -> dict[str, Any]:
    """The evidence for each variant in a view, the likeliest first, and in how many px each differs from the right."""
    assert trial.world_from_rig is not None
    pictures, found, _ = locate(trial, models.stored(trial.model), kept)
    assert found.best is not None
    case = Case(trial, models.sources[trial.model][1], [])
    rows: list[dict[str, Any]] = []
    began = time.process_time()
    for number, (variant, model) in enumerate(names.items()):
        asked = {"object_no": 0, "name": "object", "variant": variant, "object_variant_id": number, "placed": False}
        told = assess_variant(
            asked, models.stored(model), Observation(trial.rig, pictures, trial.pictures), found, PRESENCE
        )
        rows.append(
            {"variant": variant, "log_odds": round(told.log_odds, 2), "against": told.against, "of": told.decided}
        )
    seconds = time.process_time() - began
    for row in rows:
        shown, other = models.scene(names[trial.name]), models.scene(names[row["variant"]])
        row["differing_px"] = count_differing(shown, other, trial)
    return {
        "name": trial.name,
        "verdict": found.verdict.verdict,
        "off_mm": round(measure_pose_error(found.best.world_from_rig, case.truth).target_mm, 4),
        "processor_s": round(seconds, 2),
        "ranked": sorted(rows, key=lambda row: -row["log_odds"]),
    }


def count_differing(shown: Scene, other: Scene, trial: Trial) -> int:
    """The most pixels of a camera in which two models differ."""
    return max(len(points) for points, _ in find_differing(shown, other, trial)) * SAMPLED_PX**2


def table(folder: Path, misses: bool) -> None:
    """How often the right one ranks first, and before each other that differs visibly."""
    lines = read_lines(folder / "variants.jsonl")
    good = [line for line in lines if line["off_mm"] <= FOUND_MM]
    print(f"{len(good)} of {len(lines)} views have their pose within {FOUND_MM} mm; the others are left out")
    first, pairs, before, leads = 0, 0, 0, []
    for line in good:
        (own,) = (row for row in line["ranked"] if row["variant"] == line["name"])
        others = [r for r in line["ranked"] if r is not own and r["differing_px"] >= SEEN_PX]
        ahead = [r for r in others if r["log_odds"] >= own["log_odds"]]
        leads += [own["log_odds"] - max((r["log_odds"] for r in others), default=-np.inf)]
        first, pairs, before = first + (not ahead), pairs + len(others), before + len(others) - len(ahead)
        if misses:
            for r in ahead:
                print(
                    f"{line['name']}: {r['variant']} ahead by {r['log_odds'] - own['log_odds']:.1f} nats, differs in "
                    f"{r['differing_px']} px, {r['against']} of {r['of']} against, {own['against']} of {own['of']}"
                )
    print(f"the right one of six ranks first in {first} of {len(good)} views")
    print(f"it ranks before {before} of {pairs} others that differ in {SEEN_PX} px and more")
    print(f"by {min(leads):.1f} nats at least, {np.median(leads):.1f} in the median, before the next")
    print(f"processor time for six: median {np.median([line['processor_s'] for line in good]):.1f} s")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("run", "table"))
    parser.add_argument("folder", type=Path)
    parser.add_argument("--renders", type=Path, help="trials that examples.render.trials wrote")
    parser.add_argument("--misses", action="store_true", help="list what ranked before the right one")
    args = parser.parse_args()
    if args.what == "run":
        if args.renders is None:
            parser.error("run needs --renders")
        run(args.folder, args.renders)
    else:
        table(args.folder, args.misses)


if __name__ == "__main__":
    main()
