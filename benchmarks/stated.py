"""What a user states helps: rendered pairs with a rig, or a model, that is off by what is stated of it.

    python -m benchmarks.stated [--draws 2] [--pairs N] [--renders TRIALS] [--seed 0]

Each pair is localised from its stored prior with a calibration drawn from RIG, and with a model of which each arc is
displaced by a draw of TOLERANCE_MM; each time without a word, and with what is off stated.  A pose is right as
`benchmarks.verdict` has it.  RELMODEL_TEST_DATA names the test data; without it there is the demonstration.
"""

from __future__ import annotations

import argparse
import os
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from tabulate import tabulate

from benchmarks.trials import Models, Trial, demonstration, rendered, shared_bulkheads
from benchmarks.verdict import RIGHT_CHI_SQUARE, RIGHT_MM
from tests.vision.localisation.simulation import draw_rig
from vision.cameras.cameras import CalibrationSigma, Rig, perturbation
from vision.extraction.extract import extract
from vision.extraction.rows import make_primitives
from vision.inspection.demonstration import Truth, measure_pose_error
from vision.localisation.localise import localise
from vision.localisation.views import Observation
from vision.scene import Scene

RIG = CalibrationSigma(focal=0.002, centre_px=2.0, translation_mm=1.0, rotation=float(np.radians(0.1)))
TOLERANCE_MM = 0.7


class Outcome(NamedTuple):
    """Of one localisation: whether it was accepted, how far (mm) it is off, and that squared in its own sigmas."""

    is_accepted: bool
    off_mm: float
    chi_square: float


def draw_model(scene: Scene, rng: np.random.Generator) -> Scene:
    """The scene with each of its arcs displaced, along all axes alike."""
    shift = rng.normal(0, TOLERANCE_MM, (len(scene.occurrence_of_arc), 3))
    return replace(scene, sample_point=scene.sample_point + shift[scene.sample_arc])


def state_tolerance(scene: Scene) -> Scene:
    return replace(scene, tolerance_mm=np.full(len(scene.tolerance_mm), TOLERANCE_MM))


def state_rig(rig: Rig) -> Rig:
    """The rig with RIG stated of it; the first camera is where the rig is."""
    first = replace(RIG, translation_mm=0.0, rotation=0.0)
    return replace(rig, sigma={name: RIG if number else first for number, name in enumerate(rig.cameras)})


def vary(trial: Trial, scene: Scene, seed: tuple[int, ...]) -> Iterator[tuple[str, Scene, Rig]]:
    """What is localised of a trial: a name, the model and the rig."""
    silent = replace(trial.rig, sigma={})
    drawn = draw_rig(silent, RIG, np.random.default_rng((1, *seed)))
    displaced = draw_model(scene, np.random.default_rng((2, *seed)))
    yield "nothing off, nothing stated", scene, silent
    yield "nothing off, rig stated", scene, state_rig(silent)
    yield "nothing off, tolerance stated", state_tolerance(scene), silent
    yield "rig off, nothing stated", scene, drawn
    yield "rig off, stated", scene, state_rig(drawn)
    yield "model off, nothing stated", displaced, silent
    yield "model off, stated", state_tolerance(displaced), silent


def measure(trial: Trial, scene: Scene, draws: int, seed: int) -> dict[str, list[Outcome]]:
    """Outcomes by the names of `vary`, as many as draws; of what is not drawn, one."""
    found = {name: make_primitives(extract(picture)) for name, picture in trial.pictures.items()}
    out: dict[str, list[Outcome]] = {}
    assert trial.prior is not None
    assert trial.world_from_rig is not None
    truth = Truth("", trial.world_from_rig, trial.target)
    for draw in range(draws):
        for name, model, rig in vary(trial, scene, (seed, draw)):
            if draw and name.startswith("nothing off"):
                continue
            answer = localise(model, Observation(rig, found, trial.pictures), trial.prior)
            if answer.best is None:
                out.setdefault(name, []).append(Outcome(False, float("inf"), float("inf")))
                continue
            d = perturbation(answer.best.world_from_rig, trial.world_from_rig)
            out.setdefault(name, []).append(
                Outcome(
                    answer.verdict.verdict == "accepted",
                    measure_pose_error(answer.best.world_from_rig, truth).target_mm,
                    float(d @ np.linalg.solve(answer.best.covariance, d)),
                )
            )
    return out


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--draws", type=int, default=2)
    parser.add_argument("--pairs", type=int, help="the first of them, and no others")
    parser.add_argument("--renders", type=Path, help="what python -m examples.render.trials wrote")
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args()
    out: dict[str, list[Outcome]] = {}
    with tempfile.TemporaryDirectory() as folder:
        models = Models(Path(folder))
        trials = list(demonstration(models))
        if data := os.environ.get("RELMODEL_TEST_DATA"):
            trials += list(shared_bulkheads(Path(data), models, ("small",)))
        if args.renders:
            trials += [t for t in rendered(args.renders, models) if len(t.pictures) > 1]
        for number, trial in enumerate(trials[: args.pairs]):
            for name, outcomes in measure(trial, models.scene(trial.model), args.draws, args.seed + number).items():
                out.setdefault(name, []).extend(outcomes)
                print(
                    trial.name,
                    name,
                    [(o.is_accepted, round(o.off_mm, 3), round(o.chi_square, 1)) for o in outcomes],
                    flush=True,
                )
    rows = []
    for name, outcomes in out.items():
        accepted = [o for o in outcomes if o.is_accepted]
        wrong = [o for o in accepted if o.off_mm > RIGHT_MM or o.chi_square > RIGHT_CHI_SQUARE]
        off = [o.off_mm for o in outcomes]
        rows.append((name, len(outcomes), len(accepted), len(wrong), np.median(off), np.quantile(off, 0.9),
                     np.mean([o.chi_square for o in accepted]) if accepted else None))  # fmt: skip
    heads = ("what", "localised", "accepted", "wrong", "off mm, median", "nine in ten", "chi-square")
    print(tabulate(rows, headers=heads, floatfmt=".2f"))


if __name__ == "__main__":
    main()
