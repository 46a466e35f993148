"""Render the demonstration's stereo pairs and write their rig, prior and truth files.

    python -m examples.render.make [--out examples/demo] [--data-only] [NN ...]

Run from the root of the checkout, with the extra `render` and DRJIT_LIBLLVM_PATH=/path/to/libLLVM.so.19.1."""

from __future__ import annotations

import argparse
from pathlib import Path

import cv2
import numpy as np

from examples.render.files import STATED, truth_data, write_prior, write_rig, write_truth, write_world
from examples.render.lights import Lighting, backdrop, lamps
from examples.render.model import Component, read_components
from examples.render.picture import expose, render, renderer
from examples.render.surfaces import Finish, bulkhead_meshes
from examples.render.truth import Caster
from examples.render.views import VIEWS, WORLD_FROM_OBJECT, shot

SAMPLES = 36
PERCENTILE = 95.5


def write_worlds(out: Path) -> None:
    """The world files: where the part of each variant stands in its cell."""
    for variant, pose in WORLD_FROM_OBJECT.items():
        placed = {"object": "bulkhead", "variant": variant, "name": "bulkhead"}
        suffix = "" if variant == "A" else f"_{variant}"
        comment = f"Where the demonstration bulkhead, variant {variant}, stands in the cell (mm)."
        write_world(out / f"world{suffix}.yaml", f"demo_cell{suffix}", placed, pose, comment)


def write_pictures(number: str, out: Path, components: list[Component]) -> None:
    """Render, expose and write both pictures; the right camera shares the left one's exposure, but for its gain."""
    seed, view = VIEWS[number].seed, shot(VIEWS[number])
    mi, rng = renderer(), np.random.default_rng([seed, 3])
    scene = bulkhead_meshes(mi, components, Finish(), np.random.default_rng(5))
    scene |= lamps(mi, view, Lighting(), rng)
    scene["backdrop"] = backdrop(mi, view, rng)
    linear = render(mi, scene, view, SAMPLES, seed)
    left, white = expose(linear["left"], seed * 10, PERCENTILE)
    right, _ = expose(linear["right"], seed * 10 + 1, PERCENTILE, gain=1.03, white=white)
    for side, image in (("left", left), ("right", right)):
        cv2.imwrite(str(out / f"pair_{number}_{side}.png"), image, [cv2.IMWRITE_PNG_COMPRESSION, 9])


def write_data(number: str, out: Path, components: list[Component]) -> None:
    """Write a pair's truth, rig and prior."""
    variant, seed, view = VIEWS[number].variant, VIEWS[number].seed, shot(VIEWS[number])
    stem, place = f"pair_{number}", WORLD_FROM_OBJECT[variant]
    head = {"pair": number, "object": "bulkhead", "variant": variant}
    truth = truth_data(stem, head, view, components, Caster(components), place)
    write_truth(out / f"{stem}_truth.json", truth)
    write_rig(out / f"{stem}_rig.yaml", view, STATED)
    write_prior(out / f"{stem}_prior.yaml", view, place, seed)


def main() -> None:
    arguments = argparse.ArgumentParser(description="Render the demonstration's stereo pairs.")
    arguments.add_argument("pairs", nargs="*", default=list(VIEWS))
    arguments.add_argument("--out", type=Path, default=Path("examples/demo"))
    arguments.add_argument("--data-only", action="store_true", help="write all but the pictures (no renderer needed)")
    options = arguments.parse_args()
    write_worlds(options.out)
    models: dict[str, list[Component]] = {}
    for number in options.pairs:
        variant = VIEWS[number].variant
        if variant not in models:
            models[variant] = read_components(Path(f"examples/demo/bulkhead_{variant}.step.gz"))
        write_data(number, options.out, models[variant])
        if not options.data_only:
            write_pictures(number, options.out, models[variant])


if __name__ == "__main__":
    main()
