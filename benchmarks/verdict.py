"""The verdict's calibration: what localisation says of trials with known truth, the weights, and how true they are.

    python benchmarks/verdict.py run FOLDER [--renders TRIALS] [--prior KIND] [--others N]    # a line of JSON a trial
    python benchmarks/verdict.py fit FOLDER       # weights for VerdictParameters, fitted on half of the trials
    python benchmarks/verdict.py draw FOLDER      # reliability and acceptance against error, on the other half

A trial is stereo, the join, localisation and verdict, as an inspection has them; `run` goes on where it was broken off.
Its prior is that of the set, `--prior none`, or `--prior wide`: drawn with 150 mm and 15 degrees about the truth.
A trial's best hypothesis is there when the target point lies within 10 mm and the rotation within 4 degrees of the
truth; the posterior is fitted on that.  It is right when its covariance holds the truth at four sigma: a pose surer
than it should be is wrong.  It is accepted at some needs when nothing but its precision stands against it.
RELMODEL_TEST_DATA names the test data; without it there is the demonstration."""

from __future__ import annotations

import argparse
import os
import time
import zlib
from collections.abc import Iterator
from dataclasses import fields, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import minimize
from scipy.special import chdtri, erfc
from tabulate import tabulate

from benchmarks.trials import (
    ALTERATIONS,
    BLIND,
    Models,
    Trial,
    add_line,
    alone,
    alter,
    blind,
    demonstration,
    draw_prior,
    miscalibrate,
    read_lines,
    rendered,
    shared_bulkheads,
    show,
    single_pictures,
)
from relmodel.arrays import Floats
from relmodel.errors import InputError
from relmodel.store import Run
from vision.cameras.cameras import Needs, perturbation
from vision.extraction.extract import extract
from vision.extraction.rows import Primitives, make_primitives
from vision.inspection import inspection_parameters
from vision.inspection.demonstration import Truth, measure_pose_error
from vision.inspection.locate import Locator, select_parts
from vision.inspection.pictures import describe, doubt_pictures, find_faults
from vision.localisation.localisation_parameters import DEFAULTS
from vision.localisation.localise import Localisation
from vision.localisation.verdict import Verdict, VerdictStatistics
from vision.localisation.views import Observation
from vision.scene import Scenes

# One camera does not see the object, or the cameras disagree.
REFUSED_OTHERWISE = ("swapped", "mirrored", "turned", "focal", "baseline")
# What single cameras and their pictures say, and that a pose is known less exactly than needed.
BY_CAMERA = ("camera ", "the picture of camera ")
BY_NEEDS = ("the pose is known to ",)
NEEDS = {1: Needs(5.0, float(np.radians(2))), 2: Needs()}
RIGHT_MM, RIGHT_DEG = 10.0, 4.0
RIGHT_CHI_SQUARE = float(chdtri(6, erfc(4 / np.sqrt(2))))
PRIORS = ("stored", "wide", "none")


def trials(models: Models, renders: Path | None, others: int) -> Iterator[Trial]:
    """All trials: as they are, by one camera, and made wrong; each model is shown that many pictures of others."""
    data = os.environ.get("RELMODEL_TEST_DATA")
    pairs: list[Trial] = list(demonstration(models))
    singles: list[Trial] = []
    if data:
        pairs += shared_bulkheads(Path(data), models, ("small", "large", "half_pitch", "one_pitch"))
        for name in ("photo_cube", "render_box"):
            singles += single_pictures(Path(data), name, models)
    if renders:
        for trial in rendered(renders, models):
            (pairs if len(trial.pictures) > 1 else singles).append(trial)
    yield from pairs
    yield from singles
    once = [t for t in pairs if t.name.split()[-1] not in ("large", "half_pitch", "one_pitch")]
    for number, trial in enumerate(once):
        yield alone(trial)
        for kind in ALTERATIONS:
            if kind not in ("blurred", "blank") or number % 4 == 0:
                yield alter(trial, kind)
        for kind in ("focal", "baseline"):
            yield miscalibrate(trial, kind)
    # A box mirrored or turned is a box still: pictures of other objects are wrong of it, others of itself are not.
    for step in range(others):
        for number, trial in enumerate(once):
            if (other := once[(number + 1 + 4 * step) % len(once)]).model != trial.model:
                yield show(trial, other)
        for number, trial in enumerate(singles):
            if (other := singles[(number + 7 + 5 * step) % len(singles)]).model != trial.model:
                yield show(trial, other)
            yield show(trial, once[(number + step) % len(once)])


def blind_trials(models: Models) -> Iterator[Trial]:
    """The demonstration's and the rendered pairs as they are, and with a camera that says nothing."""
    data = os.environ.get("RELMODEL_TEST_DATA")
    pairs = list(demonstration(models)) + (list(shared_bulkheads(Path(data), models, ("small",))) if data else [])
    for number, trial in enumerate(pairs):
        yield trial
        for kind in BLIND:
            yield blind(trial, kind, pairs[(number + 1) % len(pairs)])


def run(folder: Path, renders: Path | None, prior: str, part: int, parts: int, others: int, *, is_blind: bool) -> None:
    """Localise every trial that has no line yet."""
    folder.mkdir(parents=True, exist_ok=True)
    file = folder / f"trials_{part}_{parts}.jsonl"
    done = {line["name"] for line in read_lines(*folder.glob("trials_*.jsonl"))}
    models = Models(folder)
    extractions: dict[bytes, Primitives] = {}
    for number, trial in enumerate(blind_trials(models) if is_blind else trials(models, renders, others)):
        if number % parts == part and trial.name not in done:
            line = measure(give_prior(trial, prior, number), models, extractions)
            add_line(file, line)
            print(f"{trial.name}: {line['verdict']}, off {line['off_mm']}", flush=True)


def give_prior(trial: Trial, kind: str, seed: int) -> Trial:
    """The trial with a prior of that kind, one of PRIORS; for a wide one, pictures of no true pose keep theirs."""
    if kind == "none":
        return replace(trial, prior=None)
    if kind == "wide" and trial.world_from_rig is not None:
        return replace(trial, prior=draw_prior(trial.world_from_rig, 150.0, 15.0, (2, seed)))
    return trial


def look_at(trial: Trial) -> dict[str, Primitives]:
    """What the pictures of a trial show."""
    return {name: make_primitives(extract(picture)) for name, picture in trial.pictures.items()}


def locate(
    trial: Trial, models: Models, found: dict[str, Primitives], needs: Needs | None = None
) -> Localisation | None:
    """What an inspection says of a trial's pose; None where nothing lies where its prior looks."""
    p = inspection_parameters.DEFAULTS
    with models.open(trial.model) as store, Run.begin(store, "inspect", {}) as run:
        scenes = Scenes(store)
        seen = Observation(trial.rig, found, trial.pictures)
        locator = Locator(run, scenes, 1, "cell", seen, needs or NEEDS[len(found)], p)
        try:
            target = select_parts(scenes, 1, "cell", trial.rig, trial.prior, p.selection)
        except InputError:
            return None
        located = locator.locate(target, trial.prior).found
        stale = 0 if len({picture.tobytes() for picture in trial.pictures.values()}) < len(trial.pictures) else None
        quality = {name: describe(np.asarray(grey, float), found[name], stale) for name, grey in trial.pictures.items()}
        return replace(located, verdict=doubt_pictures(located.verdict, find_faults(quality, 0, p.pictures)))


def measure(trial: Trial, models: Models, extractions: dict[bytes, Primitives]) -> dict[str, Any]:
    """What localisation says of a trial, its signs, and how far off it is."""
    found = {}
    for name, picture in trial.pictures.items():
        key = picture.tobytes()
        if key not in extractions:
            if len(extractions) > 200:
                extractions.clear()
            extractions[key] = make_primitives(extract(picture))
        found[name] = extractions[key]
    began = time.process_time()
    answer = locate(trial, models, found)
    line: dict[str, Any] = {
        "name": trial.name,
        "group": trial.group,
        "kind": trial.kind,
        "cameras": len(trial.pictures),
        "verdict": answer.verdict.verdict if answer else "refused",
        "reason": answer.verdict.reason if answer else "nothing lies where the prior looks",
        "posterior": answer.verdict.posterior if answer else 0.0,
        "sees": [v for n, v in answer.verdict.weighed.items() if n.startswith("sees ")] if answer else [],
        "is_blind_alone": answer is not None and answer.best is not None and _is_refused_for(answer.verdict, BY_CAMERA),
        "at_some_needs": answer is not None
        and (answer.verdict.verdict == "accepted" or _is_refused_for(answer.verdict, BY_NEEDS)),
        "processor_s": round(time.process_time() - began, 2),
        "off_mm": None,
        "off_deg": None,
        "chi_square": None,
        "truth_among": False,
        "signs": None,
    }
    if answer is None or answer.best is None:
        return line
    names = [field.name for field in fields(VerdictStatistics)]
    line["statistics"] = {name: answer.verdict.weighed.get(name, np.nan) for name in names}
    if trial.world_from_rig is not None:
        truth = Truth("", trial.world_from_rig, trial.target)
        off = [measure_pose_error(h.world_from_rig, truth) for h in answer.hypotheses]
        line["off_mm"], line["off_deg"] = off[0].target_mm, off[0].rotation_deg
        d = perturbation(answer.best.world_from_rig, trial.world_from_rig)
        line["chi_square"] = float(d @ np.linalg.solve(answer.best.covariance, d))
        line["truth_among"] = any(o.target_mm <= RIGHT_MM and o.rotation_deg <= RIGHT_DEG for o in off)
    return line


def _is_refused_for(verdict: Verdict, words: tuple[str, ...]) -> bool:
    """Whether nothing stands against a pose but what begins with one of these words."""
    return bool(verdict.missing) and all(it.startswith(words) for it in verdict.missing)


def read(folder: Path) -> list[dict[str, Any]]:
    """All lines that have signs, each with whether its pose is there, and right."""
    lines = [line for line in read_lines(*sorted(folder.glob("trials_*.jsonl"))) if line.get("statistics")]
    for line in lines:
        near = line["off_mm"] is not None and line["off_mm"] <= RIGHT_MM and line["off_deg"] <= RIGHT_DEG
        line["there"] = near
        line["right"] = line["chi_square"] is not None and line["chi_square"] <= RIGHT_CHI_SQUARE
    return lines


def is_fitted(line: dict[str, Any]) -> bool:
    """Whether a trial is of the half fitted on, drawn by what it looks for; rules refuse those of REFUSED_OTHERWISE."""
    own = line["name"].split(" <- ")[0]
    return line["kind"] not in REFUSED_OTHERWISE and zlib.crc32(own.encode()) % 2 == 0


def fit(lines: list[dict[str, Any]]) -> tuple[float, Floats]:
    """Offset and weights of the posterior: logistic regression, poses there and not weighing the same, with a
    Gaussian prior of 3 in units of each sign's scatter; signs weigh in their own direction only."""
    p = DEFAULTS.verdict
    x = np.array([VerdictStatistics(**line["statistics"]).columns(p) for line in lines])
    y = np.array([line["there"] for line in lines], float)
    scale = x.std(axis=0) + 1e-9
    z = (x - x.mean(axis=0)) / scale
    w = np.where(y > 0, 0.5 / max(y.sum(), 1), 0.5 / max((1 - y).sum(), 1)) * len(y)

    def loss(b: Floats) -> float:
        odds = b[0] + z @ b[1:]
        return float((w * (np.logaddexp(0, odds) - y * odds)).sum() + 0.5 * (b[1:] ** 2).sum() / 9)

    bounds = [(None, None)] + [(0, None)] * x.shape[1]
    b = minimize(loss, np.zeros(1 + x.shape[1]), method="L-BFGS-B", bounds=bounds).x
    weights = b[1:] / scale
    return float(b[0] - weights @ x.mean(axis=0)), weights


def report(lines: list[dict[str, Any]]) -> None:
    """A table by set: right, accepted of the right, wrong accepted, chi-square."""
    rows = []
    for key in sorted({(line["group"], line["kind"], line["cameras"]) for line in lines}):
        own = [line for line in lines if (line["group"], line["kind"], line["cameras"]) == key]
        right = [line for line in own if line["right"]]
        accepted = [line for line in right if line["verdict"] == "accepted"]
        wrong = [line for line in own if not line["right"]]
        chi = [line["chi_square"] for line in accepted]
        rows.append(
            (*key, len(own), len(right), len(accepted), sum(line["verdict"] == "ambiguous" for line in own),
             sum(line["is_blind_alone"] for line in own), sum(line["verdict"] == "accepted" for line in wrong),
             sum(line["at_some_needs"] for line in wrong), np.mean(chi) if chi else None,
             max(chi, default=None))
        )  # fmt: skip
    heads = ("set", "kind", "cameras", "trials", "right", "accepted", "ambiguous", "by camera alone", "wrong accepted",
             "at any needs", "chi2", "most")  # fmt: skip
    print(tabulate(rows, headers=heads, floatfmt=".1f"))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("action", choices=("run", "fit", "draw", "report"))
    parser.add_argument("folder", type=Path)
    parser.add_argument("--renders", type=Path, help="what python -m examples.render.trials wrote")
    parser.add_argument("--prior", default="stored", choices=PRIORS)
    parser.add_argument("--part", default="0/1", metavar="I/N", help="the I-th of N runs side by side")
    parser.add_argument("--others", type=int, default=2, help="pictures of others that each model is shown")
    parser.add_argument("--blind", action="store_true", help="pairs of which a camera says nothing, and no others")
    args = parser.parse_args()
    if args.action == "run":
        part, parts = map(int, args.part.split("/"))
        run(args.folder, args.renders, args.prior, part, parts, args.others, is_blind=args.blind)
        return
    lines = read(args.folder)
    if args.action == "fit":
        offset, weights = fit([line for line in lines if is_fitted(line)])
        print(f"offset {offset:.2f}, weights ({', '.join(f'{w:.3f}' for w in weights)})")
    elif args.action == "report":
        report(lines)
    else:
        draw(lines, args.folder)


def draw(lines: list[dict[str, Any]], folder: Path) -> None:
    """Reliability of the posterior and the operating curve, on trials that no weight was fitted on, as a picture."""
    import matplotlib

    matplotlib.use("agg")
    from matplotlib import pyplot

    held = [line for line in lines if not is_fitted(line) and line["kind"] not in REFUSED_OTHERWISE]
    p = DEFAULTS.verdict
    posterior = np.array([1 / (1 + np.exp(-VerdictStatistics(**line["statistics"]).log_odds(p))) for line in held])
    right = np.array([line["there"] for line in held])
    figure, (left, middle) = pyplot.subplots(1, 2, figsize=(10, 4.5))
    edges = np.array([0, 0.1, 0.3, 0.5, 0.7, 0.9, 1.0])
    for low, high in pairwise(edges.tolist()):
        own = (posterior >= low) & (posterior <= high)
        if own.any():
            left.plot(posterior[own].mean(), right[own].mean(), "o", color="tab:blue")
            left.annotate(str(int(own.sum())), (posterior[own].mean(), right[own].mean()), xytext=(4, 4),
                          textcoords="offset points")  # fmt: skip
    left.plot([0, 1], [0, 1], ":", color="grey")
    left.set(xlabel="posterior", ylabel="share that is there", title=f"reliability, {len(held)} trials held out")
    limits = np.sort(np.unique(posterior))
    accepted = [(posterior[right] >= limit).mean() for limit in limits]
    wrong = [(posterior[~right] >= limit).mean() for limit in limits]
    middle.plot(wrong, accepted, "-")
    at = posterior >= p.min_posterior
    middle.plot(at[~right].mean(), at[right].mean(), "o", label=f"accepted from {p.min_posterior:g}")
    middle.set(xlabel="share of wrong ones accepted", ylabel="share of right ones accepted", title="operating curve")
    middle.legend()
    figure.tight_layout()
    figure.savefig(folder / "verdict.png", dpi=110)
    print(f"wrote {folder / 'verdict.png'}")


if __name__ == "__main__":
    main()
