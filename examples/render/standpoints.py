"""Pictures of parts that do not move, by one camera from eight standpoints, with exact truth.

    python -m examples.render.standpoints FOLDER --seed N [--models 1]

Of each family's models, and of a region of the demonstration's bulkhead, FOLDER gets `NAME_model.step` (not of the
bulkhead), `NAME_world.yaml`, eight pictures and their truth; a model whose truth lies there is left alone.  Needs the
extra `render` and DRJIT_LIBLLVM_PATH, as `examples.render.trials` does."""

from __future__ import annotations

import argparse
import time
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from examples.bulkhead.design import DEPTH
from examples.render.draws import Array, draw_camera, draw_finish
from examples.render.families import FAMILIES, draw, make
from examples.render.lights import table
from examples.render.objects import write_step
from examples.render.strangers import FILLS, Stranger, components_of
from examples.render.surfaces import finished_meshes
from examples.render.trials import Trial, bulkhead_scene, model_file, variant, variant_features, write_trial
from examples.render.truth import Caster
from examples.render.views import Shot, rigid

SIZE = (1280, 960)
SAMPLES = 8  # rays a pixel, before the noise is taken out
NAMES = ("left", *"bcdefgh")  # of the standpoints; exposure is by the first, and by all so that none is too bright
APART_DEG = 20.0  # between two of them, seen from the object, at least
ABOVE_DEG, BEFORE_DEG = (25.0, 70.0), (45.0, 90.0)  # above a part's table, and before the plate of the bulkhead
REGION = np.array([420.0, 300.0])  # mm of the bulkhead


def draw_standpoints(seed: int, points: Array, above_deg: tuple[float, float] = ABOVE_DEG) -> Shot:
    """One camera at eight places about these points (n, 3), far enough apart and so many degrees above their plane."""
    rng = np.random.default_rng([seed, 51])
    camera, reach = draw_camera(rng, SIZE), float(np.linalg.norm(np.ptp(points, axis=0)))
    middle = (points.min(0) + points.max(0)) / 2
    poses: dict[str, Array] = {}
    while len(poses) < len(NAMES):
        azimuth, elevation = float(rng.uniform(0, 360)), float(rng.uniform(*above_deg))
        turn = Rotation.from_euler("ZXZ", (azimuth, -90 - elevation, float(rng.normal(0, 7))), degrees=True)
        far = max(250.0, camera.focal * reach / (SIZE[0] * float(rng.uniform(*FILLS))))
        pose = rigid(turn, middle + rng.uniform(-0.05, 0.05, 3) * reach - far * turn.as_matrix()[:, 2])
        axes = [np.array(it)[:3, 2] for it in (*poses.values(), pose)]
        if all(a @ b < np.cos(np.radians(APART_DEG)) for a, b in combinations(axes, 2)):
            poses[NAMES[len(poses)]] = pose
    stand_off = float(np.linalg.norm(poses[NAMES[0]][:3, 3] - middle))
    return Shot(dict.fromkeys(NAMES, camera), poses, middle, np.array([0, 0, 1.0]), stand_off)


def show(family: str, number: int, seed: int, folder: Path) -> None:
    """Write model, pictures and truth of one part."""
    name = f"{family}_{number}"
    own = Stranger(family, number, "standpoints", 0, seed).seed_of(name)
    design, rng = draw(family, own), np.random.default_rng([own, 52])
    write_step(make(design), folder / f"{name}_model.step")
    shown = components_of(design)
    caster = Caster(shown)
    view = draw_standpoints(own, np.concatenate(caster.vertices))
    finishes = [draw_finish(rng) for _ in range(2)]
    each = [finishes[int(c.path.startswith("BOLT"))][1] for c in shown]

    def scene(mi: Any) -> dict[str, Any]:
        meshes = finished_meshes(mi, shown, each, np.random.default_rng([own, 16]))
        return {**meshes, "table": table(mi, np.random.default_rng([own, 17]))}

    head = {"model": f"{name}_model.step", "model_variant": "", "object": name, "finish": finishes[0][0]}
    trial = Trial(name, "standpoints", family, own, SIZE, len(NAMES))
    write_trial(trial, folder, head, view, shown, caster, scene, True, view, SAMPLES)


def show_bulkhead(seed: int, folder: Path) -> None:
    """Write pictures and truth of a region of the demonstration's bulkhead, about one of its features."""
    rng, shown = np.random.default_rng([seed, 53]), variant("A")
    boxes = np.array([it["box"] for it in variant_features("A")]).reshape(-1, 2, 3)
    middles = boxes.mean(1)[:, :2]
    middle = rng.choice(middles[(abs(middles[:, 0]) < 1300) & (abs(middles[:, 1] - 500) < 300)])
    corners = [[*(middle + side * REGION / 2), z] for side in (-1, 1) for z in (0.0, DEPTH)]
    view, caster = draw_standpoints(seed, np.array(corners), BEFORE_DEG), Caster(shown)
    trial = Trial("bulkhead", "finish", "A", seed, SIZE, len(NAMES))
    head = {"model": model_file("A").as_posix(), "model_variant": "A"}
    write_trial(trial, folder, head, view, shown, caster, bulkhead_scene(trial, shown), True, view, SAMPLES)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--models", type=int, default=1, help="of each family")
    args = parser.parse_args()
    args.folder.mkdir(parents=True, exist_ok=True)
    if not (args.folder / "bulkhead_truth.json").exists():
        show_bulkhead(args.seed, args.folder)
    for number in range(args.models):
        for family in FAMILIES:
            if not (args.folder / f"{family}_{number}_truth.json").exists():
                began = time.monotonic()
                show(family, number, args.seed, args.folder)
                print(f"{family}_{number}: {time.monotonic() - began:.0f} s", flush=True)


if __name__ == "__main__":
    main()
