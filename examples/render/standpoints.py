"""Pictures of parts that do not move, by one camera from eight standpoints, with exact truth.

    python -m examples.render.standpoints FOLDER --seed N [--models 1]

Of each family's models FOLDER gets `NAME_model.step`, `NAME_world.yaml`, eight pictures and their truth; a model whose
truth lies there is left alone.  Needs the extra `render` and DRJIT_LIBLLVM_PATH, as `examples.render.trials` does.
"""

from __future__ import annotations

import argparse
import time
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from examples.render.draws import draw_camera, draw_finish
from examples.render.families import FAMILIES, draw, make
from examples.render.lights import table
from examples.render.objects import write_step
from examples.render.strangers import FILLS, Stranger, components_of
from examples.render.surfaces import finished_meshes
from examples.render.trials import Trial, write_trial
from examples.render.truth import Caster
from examples.render.views import Shot, rigid

SIZE = (640, 480)
SAMPLES = 8  # rays a pixel, before the noise is taken out
NAMES = ("left", *"bcdefgh")  # of the standpoints; exposure is by the first
APART_DEG = 20.0  # between two of them, seen from the object, at least


def draw_standpoints(seed: int, points: NDArray[np.float64]) -> Shot:
    """One camera at eight places about an object of these points (n, 3), each far enough from all others."""
    rng = np.random.default_rng([seed, 51])
    camera, reach = draw_camera(rng, SIZE), float(np.linalg.norm(np.ptp(points, axis=0)))
    middle = (points.min(0) + points.max(0)) / 2
    poses: dict[str, NDArray[np.float64]] = {}
    while len(poses) < len(NAMES):
        azimuth, elevation = float(rng.uniform(0, 360)), float(rng.uniform(25, 70))
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


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--models", type=int, default=1, help="of each family")
    args = parser.parse_args()
    args.folder.mkdir(parents=True, exist_ok=True)
    for number in range(args.models):
        for family in FAMILIES:
            if not (args.folder / f"{family}_{number}_truth.json").exists():
                began = time.monotonic()
                show(family, number, args.seed, args.folder)
                print(f"{family}_{number}: {time.monotonic() - began:.0f} s", flush=True)


if __name__ == "__main__":
    main()
