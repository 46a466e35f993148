"""Poses of rigs whose files are wrong, and of right ones: `python -m benchmarks.calibration --seed N [--count 200]`.

A trial is a pair or one picture of the demonstration, of the test data (RELMODEL_TEST_DATA) or of what
`python -m examples.render.trials FOLDER` wrote (--renders), with its prior, and a rig file that is right or wrong in
one way drawn by the seed: pictures scaled (.95 to 1.05), cut and enlarged to full size, a principal point 25 px off,
cameras turned .2 degrees; the file states a sigma of .1 % or nothing.  Before that, pairs whose rigs lie so far that
they show no pose, which only points of both pictures tell.  Limits are in `judge`; it fails beyond them."""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from scipy.special import chdtri
from tabulate import tabulate

from benchmarks.trials import Models, Trial, alone, demonstration, rendered, shared_bulkheads, single_pictures
from benchmarks.verdict import locate, look_at
from relmodel.arrays import Floats
from relmodel.geometry.transforms import inverse
from vision.cameras.cameras import CalibrationSigma, Needs, Rig, perturb, perturbation
from vision.inspection.demonstration import Truth, measure_pose_error
from vision.inspection.locate import doubt_calibration
from vision.localisation.localisation_parameters import DEFAULTS
from vision.localisation.views import Observation
from vision.stereo.agreement import doubt_rig, doubt_unit, find_shared_points, scale_focal

# A file's own word, as of a chessboard seen from twenty sides: .1 % of the focal length.
STATED = CalibrationSigma(focal=0.001, centre_px=0.5, translation_mm=0.1, rotation=2e-4, radial=0.002)
WRONG = ("scaled", "cropped", "centre", "turned")
NEEDS = Needs()


def enlarge(picture: Any, scale: float, middle: Floats) -> Any:
    """The picture of the same size whose content is `scale` times as large about a pixel."""
    by = np.array([[scale, 0, (1 - scale) * middle[0]], [0, scale, (1 - scale) * middle[1]]])
    way = cv2.INTER_AREA if scale < 1 else cv2.INTER_CUBIC
    return cv2.warpAffine(picture, by, picture.shape[::-1], flags=way, borderMode=cv2.BORDER_REPLICATE)


def spoil(trial: Trial, kind: str, rng: np.random.Generator) -> tuple[Trial, str]:
    """The trial whose pictures or rig differ in one way from what its file says, and by how much."""
    rig, pictures = trial.rig, dict(trial.pictures)
    names = list(rig.cameras)
    if kind in ("scaled", "cropped"):
        # A picture saved anew at another size, or a part of it at full size, with a rig file of before.
        scale = rng.uniform(0.95, 1.05) if kind == "scaled" else rng.uniform(1.08, 1.3)
        scale = scale if abs(scale - 1) > 0.01 else 1 + np.copysign(0.01, scale - 1)
        for name in names:
            rows, columns = pictures[name].shape
            inside = np.array([columns, rows]) * rng.uniform(0.3, 0.7, 2)
            pictures[name] = enlarge(pictures[name], scale, inside if kind == "cropped" else np.zeros(2))
        return replace(trial, pictures=pictures, kind=kind), f"{scale:.3f} times"
    cameras, poses, name = dict(rig.cameras), dict(rig.rig_from_camera), names[-1]
    way = rng.normal(size=3)
    if kind == "centre":
        matrix = cameras[name].matrix.copy()
        matrix[:2, 2] += 25 * way[:2] / np.linalg.norm(way[:2])
        cameras[name] = replace(cameras[name], matrix=matrix)
    else:
        turn = np.radians(0.2) * way / np.linalg.norm(way)
        poses[name] = perturb(poses[name], np.concatenate([np.zeros(3), turn]))
    return replace(trial, rig=Rig(cameras, poses), kind=kind), "25 px" if kind == "centre" else ".2 degrees"


def state(trial: Trial, sigma: CalibrationSigma | None) -> Trial:
    """The trial with what its rig's file says of its sigma."""
    if sigma is None:
        return replace(trial, rig=replace(trial.rig, sigma={}))
    there = {name: sigma.at(pose) for name, pose in trial.rig.rig_from_camera.items()}
    return replace(trial, rig=replace(trial.rig, sigma=there))


def draw_error(trial: Trial, sigma: CalibrationSigma, rng: np.random.Generator) -> Trial:
    """The trial with a file that errs as its sigma says."""
    cameras, poses = {}, {}
    for name, camera in trial.rig.cameras.items():
        known = sigma.at(trial.rig.rig_from_camera[name])
        matrix, distortion = camera.matrix.copy(), np.concatenate([camera.distortion, np.zeros(5)])[:5]
        matrix[[0, 1], [0, 1]] *= 1 + known.focal * rng.normal()
        matrix[:2, 2] += known.centre_px * rng.normal(size=2)
        distortion[0] += known.radial * rng.normal()
        cameras[name] = replace(camera, matrix=matrix, distortion=distortion)
        move = rng.normal(size=6) * np.repeat([known.translation_mm, known.rotation], 3)
        poses[name] = perturb(trial.rig.rig_from_camera[name], move)
    return replace(trial, rig=replace(trial.rig, cameras=cameras, rig_from_camera=poses))


def list_sources(models: Models, renders: Path | None) -> list[Trial]:
    data = os.environ.get("RELMODEL_TEST_DATA")
    pairs = list(demonstration(models))
    singles: list[Trial] = []
    if data:
        pairs += shared_bulkheads(Path(data), models, ("small",))
        singles += single_pictures(Path(data), "render_box", models)
    if renders:
        for trial in rendered(renders, models):
            (pairs if len(trial.pictures) > 1 else singles).append(trial)
    return [*pairs, *(alone(trial) for trial in pairs), *singles]


def draw(sources: list[Trial], seed: int, count: int) -> Iterator[tuple[Trial, dict[str, Any]]]:
    """Trials in rounds: each source right and stated, right and not stated, and wrong."""
    rng = np.random.default_rng(seed)
    order = np.concatenate([rng.permutation(len(sources)) for _ in range(1 + count // len(sources))])
    for number in range(count):
        source, stated = sources[order[number // 4]], number % 2 == 0
        sigma = STATED if stated else None
        kinds = WRONG[: 4 if len(source.rig.cameras) > 1 else 3]  # one camera turned is the same rig
        wrong = kinds[(number // 4 + number) % len(kinds)] if number % 4 >= 2 else None
        by = "as the sigma says"
        if wrong:
            source, by = spoil(source, wrong, rng)
            trial = state(source, sigma)
        else:
            trial = draw_error(state(source, sigma), STATED, rng)
        yield trial, {"name": trial.name, "wrong": wrong or "", "by": by, "stated": stated}


def measure(trial: Trial, models: Models) -> dict[str, Any]:
    found = look_at(trial)
    answer = locate(trial, models, found, NEEDS)
    line: dict[str, Any] = {"cameras": len(found), "verdict": "refused", "reason": "", "off_mm": np.nan, "chi": np.nan}
    line |= {"but_needs": False, "cause": False}
    if answer is None or answer.best is None or trial.world_from_rig is None:
        return line
    verdict = answer.verdict
    line |= {"verdict": verdict.verdict, "reason": verdict.reason, "two_sigma": 2 * verdict.sigma_mm}
    line["but_needs"] = all(words.startswith("the pose is known to ") for words in verdict.missing)
    line["calibration"] = verdict.weighed.get("calibration", 0.0)
    line["cause"] = verdict.rig is not None or "check the rig's calibration" in verdict.reason
    if verdict.weighed["likely"] < DEFAULTS.verdict.min_posterior:
        seen = Observation(trial.rig, found, trial.pictures)
        line["doubt"] = doubt_calibration(seen, models.scene(trial.model), trial.prior)
        line["cause"] |= line["doubt"] is not None
    d = perturbation(answer.best.world_from_rig, trial.world_from_rig)
    line["chi"] = float(d @ np.linalg.solve(answer.best.covariance, d))
    truth = Truth("", trial.world_from_rig, trial.target)
    line["off_mm"] = measure_pose_error(answer.best.world_from_rig, truth).target_mm
    return line


def lie(rig: Rig, rng: np.random.Generator) -> dict[str, tuple[Rig, str]]:
    """Rigs of the same pictures that are wrong in one way each, and words that name it."""
    one, other = rig.cameras
    poses, share = rig.rig_from_camera, 1 + rng.choice([-1, 1]) * rng.uniform(0.02, 0.08)
    angle = rng.choice([-1, 1]) * np.radians(rng.uniform(0.25, 1.0))
    longer = {name: scale_focal(camera, share) for name, camera in rig.cameras.items()}
    turned = perturb(poses[other], np.array([0, 0, 0, angle, 0, 0]))
    exchanged = Rig({one: rig.cameras[other], other: rig.cameras[one]}, {one: poses[other], other: poses[one]})
    return {
        "exchanged": (exchanged, "each other's"),
        "inverted": (replace(rig, rig_from_camera={name: inverse(it) for name, it in poses.items()}), "invert them"),
        "one scaled": (replace(rig, cameras=rig.cameras | {other: longer[other]}), "is its picture scaled"),
        "both scaled": (replace(rig, cameras=longer), "are the pictures scaled"),
        "turned": (replace(rig, rig_from_camera=poses | {other: turned}), f"{other} turned"),
        "in cm": (resize(rig, 0.1), "in another unit"),
        "in inches": (resize(rig, 1 / 25.4), "in another unit"),
    }


def resize(rig: Rig, by: float) -> Rig:
    """The rig with its lengths that many times as long."""
    poses = {name: pose.copy() for name, pose in rig.rig_from_camera.items()}
    for pose in poses.values():
        pose[:3, 3] *= by
    return replace(rig, rig_from_camera=poses)


def measure_doubts(sources: list[Trial], models: Models, seed: int) -> list[dict[str, Any]]:
    """Whether points that both pictures of a pair show tell that its rig lies, and what they name."""
    rng, lines = np.random.default_rng(seed), []
    for trial in (it for it in sources if len(it.rig.cameras) == 2):
        points = find_shared_points(trial.pictures, trial.rig)
        size = float(np.ptp(models.scene(trial.model).vertices, axis=0).max())
        for kind, (rig, words) in ({"": (trial.rig, "")} | lie(trial.rig, rng)).items():
            said = doubt_rig(rig, points) or doubt_unit(rig, points, size)
            lines.append({"kind": kind, "points": len(points.one), "said": said, "named": bool(said and words in said)})
    return lines


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--renders", type=Path)
    given = parser.parse_args()
    lines = []
    with tempfile.TemporaryDirectory() as folder:
        models = Models(Path(folder))
        sources = list_sources(models, given.renders)
        doubts = measure_doubts(sources, models, given.seed)
        for trial, line in draw(sources, given.seed, given.count):
            line |= measure(trial, models)
            lines.append(line)
            print(
                f"{line['name']:28} {line['wrong']:8} {line['by']:18} {'stated' if line['stated'] else '':6} "
                f"{line['verdict']:9} off {line['off_mm']:8.3f} chi2 {line['chi']:9.1f} "
                f"cal {line.get('calibration', 0):5.1f} {line['reason'][:90] if line['verdict'] != 'accepted' else ''}",
                flush=True,
            )
    return judge(lines, doubts)


def judge(lines: list[dict[str, Any]], doubts: list[dict[str, Any]]) -> int:
    """Print the figures of trials; 1 where one lies beyond its limits."""
    rows = []
    for cameras, stated in product((1, 2), (True, False)):
        some = [it for it in lines if (it["cameras"], it["stated"], it["wrong"]) == (cameras, stated, "")]
        if some:
            shares = np.mean([[it["verdict"] == "accepted", it["but_needs"]] for it in some], axis=0)
            rows.append([cameras, "stated" if stated else "not", len(some), *(f"{share:.0%}" for share in shares)])
    print(tabulate(rows, ["cameras", "sigma", "right files", "accepted", "at some needs"]))
    chi = np.array([it["chi"] for it in lines if it["verdict"] == "accepted"])
    refused = [it["cause"] for it in lines if it["wrong"] and it["verdict"] != "accepted"]
    of_kind = {kind: [it for it in doubts if it["kind"] == kind] for kind in dict.fromkeys(it["kind"] for it in doubts)}
    told = [[kind or "right", len(it), sum(d["said"] is not None for d in it), sum(d["named"] for d in it)]
            for kind, it in of_kind.items()]  # fmt: skip
    print(tabulate(told, ["rig of a pair", "pairs", "doubted", "named"]))
    # Cameras scaled alike keep their epipolar lines nearly where they are: the pose has to show that.
    wrong_named = [it["named"] for it in doubts if it["kind"] not in ("", "both scaled")]
    figures = {
        "right rigs doubted by points": (float(sum(it["said"] is not None for it in of_kind[""])), 0.0, 0.0),
        "wrong rigs named by points": (float(np.mean(wrong_named)), 0.9, 1.0),
        "accepted poses beyond five sigma": (float((chi > 25).sum()), 0.0, 0.0),
        "mean chi-square of accepted poses": (float(chi.mean()), 3.0, 9.0),
        "share that 95 % hold": (float(np.mean(chi <= chdtri(6, 0.05))), 0.9, 0.99),
        "calibration named of wrong files refused": (float(np.mean(refused)), 0.8, 1.0),
    }
    failed = [name for name, (value, least, most) in figures.items() if not least <= value <= most]
    for name, (value, least, most) in figures.items():
        print(f"{name}: {value:.3g} ({least:g} to {most:g}){'  FAILS' * (name in failed)}")
    return len(failed) > 0


if __name__ == "__main__":
    sys.exit(main())
