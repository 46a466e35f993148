"""A plain fit to the nearest edges beside the localisation, from the same priors: time, accuracy, wrong poses.

    python -m benchmarks.nearest_edge [--sets demo A B C photo_cube render_box] [--count N]

The plain fit is what trackers of edges do (Harris, RAPiD; Drummond and Cipolla, PAMI 24, 2002): 1,000 visible samples
of the model's edges are projected at the pose, the grey picture is searched along each one's normal for the nearest
step, and robust least squares (Tukey) moves the pose; the search narrows from what the prior leaves open to 3 px.  It
begins at the prior's pose and always answers.  Localisation is given the same prior; what it accepts is an answer.
Neither has a join or stereo.  Right is what is within 3 mm and .5 degrees of the truth, by one camera 5 mm and 2
degrees.  Seconds are those of the processor a trial, the pictures' extraction among those of localisation.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from tabulate import tabulate

from benchmarks.trials import Models, Trial, demonstration, draw_prior, find_data, shared_bulkheads, single_pictures
from relmodel.arrays import Floats
from relmodel.geometry.transforms import apply, inverse
from vision.cameras.cameras import Needs, Prior, Rig, perturb
from vision.extraction.extract import extract
from vision.extraction.rows import make_primitives
from vision.inspection.demonstration import Truth, measure_pose_error
from vision.localisation.localise import localise
from vision.localisation.views import Observation
from vision.localisation.visibility import find_visible_arcs
from vision.scene import Scene

SAMPLES = 1000
MOST_PX, LEAST_PX = 60.0, 3.0
ROUNDS, STEP_PX = 20, 0.5
LEAST_STEP = 2.0  # grey levels a pixel, of the smoothed picture, from which a step is an edge
FAR = ("demo", "A", "B", "C")
HEADS = ("set", "prior", "trials", "right", "wrong", "median mm", "worst right mm", "s", "accepted", "right", "wrong",
         "median mm", "s")  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sets", nargs="+", default=["demo", "A", "B", "C", "photo_cube", "render_box"])
    parser.add_argument("--count", type=int, help="of each set, evenly (default: all)")
    args = parser.parse_args()
    data = Path() if args.sets == ["demo"] else find_data()
    rows: dict[tuple[str, str], list[dict[str, Any]]] = {}
    is_warm = False
    with tempfile.TemporaryDirectory() as folder:
        models = Models(Path(folder))
        for name in args.sets:
            for prior, trials in _priors(list(_trials(name, data, models))):
                for trial in trials[:: -(-len(trials) // args.count)] if args.count else trials:
                    if not is_warm:  # kernels and imports
                        compare(trial, models.scene(trial.model))
                        is_warm = True
                    rows.setdefault((name, prior), []).append(compare(trial, models.scene(trial.model)))
                print(_summarise(name, prior, rows[name, prior]), flush=True)
    print(tabulate([_summarise(*key, them) for key, them in rows.items()], HEADS, floatfmt=".3g"))


def _trials(name: str, data: Path, models: Models) -> Iterator[Trial]:
    if name == "demo":
        yield from demonstration(models)
    elif name in FAR:
        every = shared_bulkheads(data, models, ("small", "large"))
        yield from (trial for trial in every if trial.group == f"shared_{name}")
    else:
        yield from single_pictures(data, name, models)


def _priors(trials: Sequence[Trial]) -> Iterator[tuple[str, list[Trial]]]:
    """Trials by what their priors are; the pairs from priors drawn farther off too."""
    kinds = dict.fromkeys(trial.name.rpartition(" ")[2] if "shared" in trial.group else "stated" for trial in trials)
    for kind in kinds:
        yield kind, [trial for trial in trials if kind == "stated" or trial.name.endswith(kind)]
    if len(trials[0].pictures) < 2:
        return
    far = {trial.name.split()[-2] + trial.model: trial for trial in trials}.values()  # each pair once
    drawn = []
    for number, trial in enumerate(far):
        assert trial.world_from_rig is not None
        drawn.append(replace(trial, prior=draw_prior(trial.world_from_rig, 30.0, 3.0, (5, number))))
    yield "30 mm, 3 deg", drawn


def compare(trial: Trial, scene: Scene) -> dict[str, Any]:
    """What either makes of a trial: errors in mm and degrees, and seconds of the processor."""
    assert trial.world_from_rig is not None
    assert trial.prior is not None
    truth = Truth("", trial.world_from_rig, trial.target)
    one = len(trial.pictures) == 1
    needs = Needs(5.0, np.radians(2.0)) if one else Needs(3.0, np.radians(0.5))
    began = time.process_time()
    fitted = fit(scene, trial.rig, trial.pictures, trial.prior.world_from_rig, _reach(trial, trial.prior))
    plain = measure_pose_error(fitted, truth)
    plain_s, began = time.process_time() - began, time.process_time()
    pictures = {name: make_primitives(extract(picture)) for name, picture in trial.pictures.items()}
    found = localise(scene, Observation(trial.rig, pictures, trial.pictures), trial.prior, needs)
    full_s = time.process_time() - began
    off = None if found.best is None else measure_pose_error(found.best.world_from_rig, truth)
    accepted = off is not None and found.verdict.verdict == "accepted"

    def is_right(error: Any) -> bool:
        return bool(error.target_mm <= needs.translation_mm and error.rotation_deg <= np.degrees(needs.rotation))

    return {
        "plain_mm": plain.target_mm,
        "plain_right": is_right(plain),
        "plain_s": plain_s,
        "accepted": accepted,
        "right": accepted and is_right(off),
        "mm": off.target_mm if accepted and off else np.nan,
        "s": full_s,
    }


def _reach(trial: Trial, prior: Prior) -> float:
    """Two sigma of the prior at the target, px."""
    camera = next(iter(trial.rig.cameras.values()))
    depth = float(np.linalg.norm(trial.target - prior.world_from_rig[:3, 3]))
    off = np.hypot(prior.sigma_translation_mm, prior.sigma_rotation * depth)
    return float(np.clip(2 * off * camera.matrix[0, 0] / depth, 2 * LEAST_PX, MOST_PX))


def fit(scene: Scene, rig: Rig, pictures: dict[str, Any], pose: Floats, reach: float) -> Floats:
    """world_from_rig (4, 4) after ROUNDS of nearest edges and least squares, from the pose given; reach in px."""
    smooth = {name: cv2.GaussianBlur(np.asarray(grey, np.float32), (0, 0), 1.0) for name, grey in pictures.items()}
    for width in np.geomspace(reach, LEAST_PX, ROUNDS):
        offsets, derivatives = [np.zeros(0)], [np.zeros((0, 6))]
        for name, camera in rig.cameras.items():
            rig_from_camera = rig.rig_from_camera[name]
            seen = find_visible_arcs(scene, camera, pose @ rig_from_camera, count=SAMPLES)
            if not len(seen.arc):
                continue
            normal = np.stack([-seen.direction[:, 1], seen.direction[:, 0]], axis=1)
            places = np.arange(-width, width + STEP_PX / 2, STEP_PX)
            looked = seen.pixel[:, None] + places[:, None] * normal[:, None]
            pixels = camera.distort(camera.normalise(looked.reshape(-1, 2))).reshape(looked.shape).astype(np.float32)
            grey = cv2.remap(smooth[name], pixels, None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)  # type: ignore[call-overload]
            offset = _nearest_step(np.asarray(grey, float), places)
            hit = np.flatnonzero(np.isfinite(offset))
            moved = []
            for axis in np.eye(6) * 1e-5:
                camera_from_world = inverse(perturb(pose, axis) @ rig_from_camera)
                at = apply(camera_from_world, seen.point[hit])
                pixel = at[:, :2] / at[:, 2:] @ camera.matrix[:2, :2].T + camera.matrix[:2, 2]
                moved.append(np.einsum("ij,ij->i", pixel - seen.pixel[hit], normal[hit]) / 1e-5)
            offsets.append(offset[hit])
            derivatives.append(np.stack(moved, axis=1))
        residual, jacobian = np.concatenate(offsets), np.concatenate(derivatives)
        if len(residual) < 12:
            return pose
        delta = np.asarray(np.zeros(6))
        for _ in range(5):
            left = residual - jacobian @ delta
            cut = max(4.685 * 1.4826 * float(np.median(np.abs(left))), 1.0)
            weight = np.maximum(1 - (left / cut) ** 2, 0.0) ** 2
            normal_matrix = jacobian.T @ (weight[:, None] * jacobian)
            normal_matrix += 1e-9 * np.diag(np.diag(normal_matrix) + 1.0)
            delta = np.asarray(np.linalg.solve(normal_matrix, jacobian.T @ (weight * residual)), float)
        pose = perturb(pose, delta)
    return pose


def _nearest_step(grey: Floats, places: Floats) -> Floats:
    """Of profiles (n, k) at places (k,) px: where the nearest step is (n,), to a fraction of a sample; nan for none."""
    slope = np.abs(grey[:, 2:] - grey[:, :-2]) / (2 * STEP_PX)
    middle = slope[:, 1:-1]
    is_top = (middle >= slope[:, :-2]) & (middle > slope[:, 2:]) & (middle >= LEAST_STEP)
    at = np.where(is_top, np.abs(places[2:-2]), np.inf).argmin(axis=1)
    row = np.arange(len(grey))
    before, top, after = slope[row, at], slope[row, at + 1], slope[row, at + 2]
    bend = before - 2 * top + after
    shift = np.where(bend < 0, 0.5 * (before - after) / np.where(bend < 0, bend, 1.0), 0.0)
    return np.where(is_top[row, at], places[2:-2][at] + STEP_PX * shift, np.nan)


def _summarise(name: str, prior: str, them: list[dict[str, Any]]) -> tuple[Any, ...]:
    plain = [it["plain_mm"] for it in them]
    right = [it["plain_mm"] for it in them if it["plain_right"]]
    accepted = [it for it in them if it["accepted"]]
    return (
        name, prior, len(them), len(right), len(them) - len(right), np.median(plain), max(right, default=np.nan),
        np.mean([it["plain_s"] for it in them]), len(accepted), sum(it["right"] for it in accepted),
        sum(not it["right"] for it in accepted), np.nanmedian([it["mm"] for it in accepted] or [np.nan]),
        np.mean([it["s"] for it in them]),
    )  # fmt: skip


if __name__ == "__main__":
    main()
