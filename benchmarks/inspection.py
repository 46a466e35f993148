"""Inspections against known poses: the demonstration's stereo pairs, and photographs and renderings by one camera.

    python benchmarks/inspection.py [--overlays FOLDER]

The pairs have exact truth and the priors that lie beside them.  Where RELMODEL_TEST_DATA names the test data, every
fourth photograph of `photo_cube` (reference poses fitted to the cube's edges, not exact) and every fourth picture of
`render_box` are inspected too, each from a prior 10 mm and 3 degrees off in a direction drawn with a fixed seed.
The error is that of the best hypothesis, refused or not, at the target point, or on the axis as far off as
the model, seen from the camera.
"""

from __future__ import annotations

import argparse
import json
import os
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from tabulate import tabulate

from relmodel.geometry.transforms import apply, inverse, rotation_matrix
from relmodel.loading.load import load
from relmodel.resources import resource_dir
from relmodel.store import Store
from relmodel.world.placement import place_world
from vision.cameras.images import read_picture
from vision.inspection import Inspection, inspect
from vision.inspection.demonstration import Truth, measure_pose_error, read_truth

OFF_MM, OFF_DEG = 10.0, 3.0


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--overlays", type=Path, help="write the model drawn over each picture into this folder")
    overlays = parser.parse_args().overlays
    if overlays:
        overlays.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        rows = stereo_pairs(Path(folder), overlays)
        data = os.environ.get("RELMODEL_TEST_DATA")
        for name in ("photo_cube", "render_box") if data else ():
            rows += single_pictures(Path(str(data)) / name, Path(folder), overlays)
    print(
        tabulate(rows, headers=("picture", "verdict", "target mm", "rotation deg", "seconds", "reason"), floatfmt=".4f")
    )


def stereo_pairs(folder: Path, overlays: Path | None) -> list[tuple[Any, ...]]:
    """The demonstration's pairs, each against its variant."""
    demo, rows = resource_dir("demo"), []
    with Store.create(folder / "pairs.duckdb") as store:
        worlds = {}
        for variant, file in (("A", "world.yaml"), ("B", "world_B.yaml")):
            load(store, demo / f"bulkhead_{variant}.step.gz", name="bulkhead", variant=variant)
            worlds[variant] = place_world(store, demo / file).world
        for truth_file in sorted(demo.glob("pair_*_truth.json")):
            stem, truth = truth_file.name.removesuffix("_truth.json"), read_truth(truth_file)
            answer = inspect(
                store,
                rig=demo / f"{stem}_rig.yaml",
                left=demo / f"{stem}_left.png",
                right=demo / f"{stem}_right.png",
                prior=demo / f"{stem}_prior.yaml",
                world=worlds[truth.variant],
                overlay=overlays / f"{stem}.png" if overlays else None,
            )
            rows.append(_row(stem, answer, truth))
    return rows


def single_pictures(data: Path, folder: Path, overlays: Path | None) -> list[tuple[Any, ...]]:
    """Every fourth picture of a folder with `frames.json` and `model.obj`, in millimetres."""
    rows = []
    random = np.random.default_rng(1)
    described = json.loads((data / "frames.json").read_text())
    with Store.create(folder / f"{data.name}.duckdb") as store:
        load(store, data / "model.obj", name="model", unit=described.get("unit", "mm"))
        (folder / "world.yaml").write_text("world: cell\nobjects: [{object: model}]\n")
        place_world(store, folder / "world.yaml")
        for frame in described["frames"][::4]:
            picture = read_picture(data / frame["image"])
            world_from_camera = inverse(np.array(frame["camera_from_object"], float))
            off = np.eye(4)
            turn, shift = random.normal(size=(2, 3))
            off[:3, :3] = rotation_matrix(np.radians(OFF_DEG) * turn / np.linalg.norm(turn))
            off[:3, 3] = OFF_MM * shift / np.linalg.norm(shift)
            camera = {
                "width": picture.width,
                "height": picture.height,
                "matrix": frame["K"],
                "rig_from_camera": np.eye(4).tolist(),
            }
            sigma = {"translation_mm": OFF_MM / np.sqrt(3), "rotation_deg": OFF_DEG / np.sqrt(3)}
            sigma = {name: float(value) for name, value in sigma.items()}
            prior = {"world_from_rig": (world_from_camera @ off).tolist(), "sigma": sigma}
            (folder / "rig.yaml").write_text(yaml.safe_dump({"cameras": {"left": camera}}))
            (folder / "prior.yaml").write_text(yaml.safe_dump(prior))
            stem = f"{data.name} {Path(frame['image']).stem}"
            answer = inspect(
                store,
                rig=folder / "rig.yaml",
                left=data / frame["image"],
                prior=folder / "prior.yaml",
                overlay=overlays / f"{stem.replace(' ', '_')}.png" if overlays else None,
            )
            # On the axis, as far off as the model's origin.
            target = apply(world_from_camera, np.array([[0.0, 0.0, float(np.linalg.norm(world_from_camera[:3, 3]))]]))[
                0
            ]
            rows.append(_row(stem, answer, Truth("", world_from_camera, target)))
    return rows


def _row(name: str, answer: Inspection, truth: Truth) -> tuple[Any, ...]:
    took = sum(answer.timings_s.values())
    if not answer.hypotheses:
        return name, answer.verdict, None, None, took, answer.reason
    off = measure_pose_error(answer.hypotheses[0][0], truth)
    return name, answer.verdict, off.target_mm, off.rotation_deg, took, answer.reason


if __name__ == "__main__":
    main()
