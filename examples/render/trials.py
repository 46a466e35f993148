"""Render trials with exact truth: finishes, printed boxes and small objects, from the list of seeds.

    python -m examples.render.trials [FOLDER] [--only KIND_OR_NAME ...] [--count N] [--data-only]

Trials are those of `trials.csv`, in its order; one whose truth lies in FOLDER (`examples/trials`, which git ignores) is
left alone, so a run can be broken off and taken up again.  `--count` takes the first N of each kind.  Run from the root
of a checkout, with the extra `render` and DRJIT_LIBLLVM_PATH=/path/to/libLLVM.so.19.1; `--data-only`: no pictures."""

from __future__ import annotations

import argparse
import csv
import json
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from functools import lru_cache, partial
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

from examples.render.draws import (
    draw_bulkhead_view,
    draw_exposure,
    draw_finish,
    draw_lighting,
    draw_table_view,
    first_credible,
)
from examples.render.files import EXACT, STATED, truth_data, write_prior, write_rig, write_truth, write_world
from examples.render.lights import backdrop, lamps, table
from examples.render.model import Component, read_components
from examples.render.objects import make_object, write_step
from examples.render.picture import expose, render, renderer
from examples.render.prints import PRINTS, draw_print
from examples.render.surfaces import bulkhead_meshes, finished_meshes, plane_faces, printed_meshes
from examples.render.truth import Caster, pixel_rays, project
from examples.render.views import WORLD_FROM_OBJECT, Shot, rigid

Meshes = Callable[[Any], dict[str, Any]]  # of the renderer's module
LIST = Path(__file__).with_name("trials.csv")
MODELS = Path("examples")
SAMPLES = 16
MOST_WHITE, MOST_WHITE_OF_STRANGER = 0.4, 0.25  # of the left picture, of strangers each, however overexposed
PERCENTILE = 95.5
WORLD_FROM_TABLE = rigid(Rotation.from_euler("z", 23.0, degrees=True), (850.0, -320.0, 740.0))


@dataclass(frozen=True)
class Trial:
    """A line of the list: `what` is the variant of the bulkhead, or the kind of object."""

    name: str
    kind: str
    what: str
    seed: int
    size: tuple[int, int]
    cameras: int


def read_list(path: Path = LIST) -> list[Trial]:
    """All trials, in the order in which they are rendered."""
    with path.open() as file:
        rows = list(csv.DictReader(file))
    return [
        Trial(r["name"], r["kind"], r["what"], int(r["seed"]), (int(r["width"]), int(r["height"])), int(r["cameras"]))
        for r in rows
    ]


def select(trials: list[Trial], only: list[str], count: int | None) -> list[Trial]:
    """Those of the wanted kinds or names, the first `count` of each kind."""
    seen: Counter[str] = Counter()
    out = []
    for trial in trials:
        if only and trial.kind not in only and trial.name not in only:
            continue
        seen[trial.kind] += 1
        if count is None or seen[trial.kind] <= count:
            out.append(trial)
    return out


@lru_cache(maxsize=2)
def variant(name: str) -> list[Component]:
    """Components of a committed variant of the bulkhead."""
    return read_components(model_file(name))


def model_file(name: str) -> Path:
    folder = MODELS / "demo" if name in "AB" else MODELS / "bulkhead/variants"
    return folder / f"bulkhead_{name}.step.gz"


def variant_features(name: str) -> list[dict[str, Any]]:
    rows: list[dict[str, Any]] = json.loads((MODELS / f"bulkhead/golden/bulkhead_{name}.json").read_text())["features"]
    return rows


def finish_trial(trial: Trial, folder: Path, pictures: bool) -> None:
    """A committed variant with a drawn finish."""
    components = variant(trial.what)
    caster, rows = Caster(components), variant_features(trial.what)
    drawn = partial(draw_bulkhead_view, trial.seed, trial.size, rows)
    view = first_credible(drawn, lambda view: part_share(caster, view) > 0.45)
    head = {"model": model_file(trial.what).as_posix(), "model_variant": trial.what}
    write_trial(trial, folder, head, view, components, caster, bulkhead_scene(trial, components), pictures)


def table_trial(trial: Trial, folder: Path, pictures: bool) -> None:
    """A small object or a printed box on a table that is in no model."""
    step = folder / f"{trial.name}_model.step"
    write_step(make_object(trial.what, np.random.default_rng([trial.seed, 14])), step)
    components = read_components(step)
    caster = Caster(components)
    view = draw_table_view(trial.seed, trial.size, np.concatenate(caster.vertices), trial.cameras)
    rng = np.random.default_rng([trial.seed, 15])
    head: dict[str, Any] = {"model": step.name, "model_variant": ""}
    if trial.kind == "boxes":
        head["prints"] = theme = str(rng.choice([*PRINTS, "mixed", "mixed"]))
        prints = {}
        for number, component in enumerate(components):
            for face, (_, _, flat) in plane_faces(component.part).items():
                width, height = (float(v) for v in flat.max(0))
                prints[number, face] = draw_print(theme, width, height, rng)[::-1]
        gloss = float(rng.uniform(0.12, 0.45))

        def meshes(mi: Any) -> dict[str, Any]:
            return printed_meshes(mi, components, prints, gloss)
    else:
        one_finish = trial.what not in ("like_blocks", "stairs", "bolts") or rng.random() < 0.6
        finishes = [draw_finish(rng) for _ in components]
        finishes = [finishes[0]] * len(finishes) if one_finish else finishes
        head["finish"] = sorted({name for name, _ in finishes})

        def meshes(mi: Any) -> dict[str, Any]:
            return finished_meshes(mi, components, [f for _, f in finishes], np.random.default_rng([trial.seed, 16]))

    def scene(mi: Any) -> dict[str, Any]:
        return {**meshes(mi), "table": table(mi, np.random.default_rng([trial.seed, 17]))}

    write_trial(trial, folder, head, view, components, caster, scene, pictures)


TRIALS = {"finish": finish_trial, "boxes": table_trial, "small": table_trial}


def bulkhead_scene(trial: Trial, components: list[Component]) -> Meshes:
    """The bulkhead with the trial's finish."""
    finish = bulkhead_finish(trial)[1]
    return lambda mi: bulkhead_meshes(mi, components, finish, np.random.default_rng([trial.seed, 16]))


def bulkhead_finish(trial: Trial) -> tuple[str, Any]:
    return draw_finish(np.random.default_rng([trial.seed, 15]))


def part_share(caster: Caster, view: Shot, step: int = 8) -> float:
    """Share of the left picture that shows the part, by a ray for every `step` pixels across and down."""
    camera, pose = view.cameras["left"], view.poses["left"]
    rays = pixel_rays(camera, step) @ pose[:3, :3].T
    seen, _ = caster.cast(pose[:3, 3], rays)
    return float((seen >= 0).mean())


def on_object(image: Any, caster: Caster, view: Shot) -> Any:
    """The part of the left picture about the object, which the exposure is measured on."""
    camera, points = view.cameras["left"], np.concatenate(caster.vertices)
    at = project(camera, view.poses["left"], points)
    (x0, y0), (x1, y1) = (np.clip(np.round(v), 0, np.array(camera.size)).astype(int) for v in (at.min(0), at.max(0)))
    return image[y0:y1, x0:x1]


def write_trial(
    trial: Trial,
    folder: Path,
    more: dict[str, Any],
    view: Shot,
    components: list[Component],
    caster: Caster,
    meshes: Meshes,
    pictures: bool,
    stated: Shot | None = None,
    samples: int = SAMPLES,
) -> None:
    """Pictures, rig, prior, world and, last, truth; stated: the cameras as the rig file has them, where not exact."""
    on_table = trial.kind != "finish"
    place = WORLD_FROM_TABLE if on_table else WORLD_FROM_OBJECT["A"]
    rng = np.random.default_rng([trial.seed, 18])
    light_name, lighting = draw_lighting(rng)
    exposure = draw_exposure(rng)
    if stated:  # a camera of its own, and one that is known as well as its file says
        exposure = replace(exposure, blur=round(rng.uniform(0.6, 1.3), 2), gamma=round(rng.uniform(0.4, 0.8), 2))
    if on_table:  # no dark room: the sides of a small metal part show nothing else than what is about it
        lighting = replace(lighting, surround=max(lighting.surround, 0.5))
        if exposure.ev > 0:  # table and object would be white alike
            exposure = replace(exposure, ev=exposure.ev / 2 - 0.25)
    finish = {} if on_table else {"finish": bulkhead_finish(trial)[0]}
    if finish.get("finish") == "painted":  # as bright all over: white at the usual percentile would leave no greys
        exposure = replace(exposure, ev=exposure.ev - 0.75)
    head = {
        "pair": trial.name,
        "object": trial.name if on_table else "bulkhead",
        "variant": "" if on_table else trial.what,
        "kind": trial.kind,
        "what": trial.what,
        "seed": trial.seed,
        "stand_off": round(view.stand_off, 2),
        **finish,
        "lighting": light_name,
        "exposure": asdict(exposure),
        **more,
    }
    truth = truth_data(trial.name, head, view, components, caster, place)
    write_rig(folder / f"{trial.name}_rig.yaml", stated or view, STATED if stated else EXACT)
    error = (10.0, 3.0) if on_table else (15.0, 1.5)
    write_prior(folder / f"{trial.name}_prior.yaml", view, place, trial.seed, *error)
    placed = {"object": head["object"], "name": head["object"]}
    if head["model_variant"]:
        placed["variant"] = head["model_variant"]
    write_world(folder / f"{trial.name}_world.yaml", trial.name, placed, place, "Where the object stands (mm).")
    if pictures:
        mi = renderer()
        scene = meshes(mi) | lamps(mi, view, lighting, rng)
        if not on_table:
            scene["backdrop"] = backdrop(mi, view, rng)
        linear = render(mi, scene, view, samples, trial.seed, 0.6 if on_table else 1.3)
        shown = on_object(linear["left"], caster, view) if on_table else linear["left"]
        _, white = expose(shown, 0, PERCENTILE, ev=exposure.ev)
        if stated:
            most = 100 * (1 - MOST_WHITE_OF_STRANGER)
            white = max(white, *(float(np.percentile(it, most)) for it in linear.values()))
        elif not on_table:
            white = max(white, float(np.percentile(shown, 100 * (1 - MOST_WHITE))))
        for k, (side, image) in enumerate(linear.items()):
            noise = trial.seed * 10 + k
            sensor = exposure.full, exposure.read, 0.0, exposure.blur, exposure.gamma
            seen, _ = expose(image, noise, PERCENTILE, 1.0 + 0.03 * k, white, *sensor)
            cv2.imwrite(str(folder / f"{trial.name}_{side}.png"), seen)
    write_truth(folder / f"{trial.name}_truth.json", truth)


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("folder", type=Path, nargs="?", default=MODELS / "trials")
    arguments.add_argument("--only", nargs="*", default=[], help="kinds or names")
    arguments.add_argument("--count", type=int, help="the first N of each kind")
    arguments.add_argument("--data-only", action="store_true", help="all but the pictures (no renderer needed)")
    options = arguments.parse_args()
    for trial in select(read_list(), options.only, options.count):
        folder = options.folder / trial.kind
        folder.mkdir(parents=True, exist_ok=True)
        if (folder / f"{trial.name}_truth.json").exists():
            continue
        start, before = time.monotonic(), time.process_time()
        TRIALS[trial.kind](trial, folder, not options.data_only)
        took, of_processors = time.monotonic() - start, time.process_time() - before
        print(f"{trial.name} {trial.what}: {took:.0f} s, {of_processors:.0f} s of processor time", flush=True)


if __name__ == "__main__":
    main()
