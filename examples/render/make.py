"""Render the demonstration's stereo pairs and write their rig, prior and truth files.

    python -m examples.render.make [--out examples/demo] [--data-only] [NN ...]

Run from the root of the checkout, with the extra `render` and DRJIT_LIBLLVM_PATH=/path/to/libLLVM.so.19.1.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import yaml
from numpy.typing import NDArray

from examples.render.model import Component, read_components
from examples.render.picture import expose, render
from examples.render.truth import Caster, project
from examples.render.views import (
    HEIGHT,
    VIEWS,
    WIDTH,
    WORLD_FROM_OBJECT,
    Camera,
    View,
    drawn_error,
    object_from_cameras,
    target_in_object,
)

Array = NDArray[np.float64]
PERCENTILE = 95.5


def matrix_rows(matrix: Array) -> list[list[float]]:
    return [[float(v) + 0.0 for v in row] for row in matrix]


class _Flow(yaml.SafeDumper):
    """YAML with short lists on one line."""

    def ignore_aliases(self, data: Any) -> bool:
        return True


def _represent_list(dumper: yaml.SafeDumper, data: list[Any]) -> yaml.Node:
    return dumper.represent_sequence(
        "tag:yaml.org,2002:seq", data, flow_style=not any(isinstance(v, list | dict) for v in data)
    )


_Flow.add_representer(list, _represent_list)


def write_yaml(path: Path, data: dict[str, Any], comment: str) -> None:
    path.write_text(f"# {comment}\n" + yaml.dump(data, Dumper=_Flow, sort_keys=False, width=200))


def write_worlds(out: Path) -> None:
    """The world files: where the part of each variant stands in its cell."""
    for variant, pose in WORLD_FROM_OBJECT.items():
        row = {"object": "bulkhead", "variant": variant, "name": "bulkhead", "role": "inspected"}
        data = {
            "world": "demo_cell" if variant == "A" else f"demo_cell_{variant}",
            "objects": [{**row, "world_from_object": matrix_rows(pose)}],
        }
        name = "world.yaml" if variant == "A" else f"world_{variant}.yaml"
        write_yaml(out / name, data, f"Where the demonstration bulkhead, variant {variant}, stands in the cell (mm).")


def rig_data(view: View, left_from_right: Array) -> dict[str, Any]:
    def camera(c: Camera, pose: Array) -> dict[str, Any]:
        return {
            "width": WIDTH,
            "height": HEIGHT,
            "matrix": matrix_rows(c.matrix),
            "distortion": {"model": "opencv", "coefficients": list(c.distortion)},
            "rig_from_camera": matrix_rows(pose),
        }

    return {"cameras": {"left": camera(view.left, np.eye(4)), "right": camera(view.right, left_from_right)}}


def truth_data(number: str, view: View, components: list[Component], caster: Caster) -> dict[str, Any]:
    """Poses, target and parts in view; pixel counts are exact at pixel centres, without blur."""
    world_from_object = WORLD_FROM_OBJECT[view.variant]
    poses = object_from_cameras(view)
    target = target_in_object(view)
    cameras: dict[str, Any] = {}
    parts: dict[int, dict[str, Any]] = {}
    for side, camera, pose in zip(("left", "right"), (view.left, view.right), poses, strict=True):
        seen, shares = caster.shares(camera, pose, len(components))
        cameras[side] = {
            "image": f"pair_{number}_{side}.png",
            "matrix": matrix_rows(camera.matrix),
            "distortion": list(camera.distortion),
            "world_from_camera": matrix_rows(world_from_object @ pose),
            "target_pixel": [round(float(v), 4) for v in project(camera, pose, target[None])[0]],
            "background_share": round(float((seen < 0).mean()), 5),
        }
        for i, visible, whole in shares:
            row = parts.setdefault(i, {"path": components[i].path, "product": components[i].part.name})
            row[side] = {"visible_px": visible, "unoccluded_px": whole, "visible_share": round(visible / whole, 5)}
    return {
        "pair": number,
        "object": "bulkhead",
        "variant": view.variant,
        "image_size": [WIDTH, HEIGHT],
        "world_from_object": matrix_rows(world_from_object),
        "world_from_rig": matrix_rows(world_from_object @ poses[0]),
        "left_from_right": matrix_rows(np.linalg.inv(poses[0]) @ poses[1]),
        "target_in_object": [float(v) for v in target],
        "cameras": cameras,
        "parts_in_view": [parts[i] for i in sorted(parts)],
    }


def truth_text(truth: dict[str, Any]) -> str:
    lines = [f' "{k}": {json.dumps(v)}' for k, v in truth.items() if k not in ("cameras", "parts_in_view")]
    cameras = ",\n".join(f'  "{k}": {json.dumps(v)}' for k, v in truth["cameras"].items())
    lines.append(f' "cameras": {{\n{cameras}\n }}')
    parts = ",\n".join(f"  {json.dumps(row)}" for row in truth["parts_in_view"])
    lines.append(f' "parts_in_view": [\n{parts}\n ]')
    return "{\n" + ",\n".join(lines) + "\n}\n"


def write_pictures(number: str, out: Path, components: list[Component]) -> None:
    """Render, expose and write both pictures; the right camera shares the left one's exposure, but for its gain."""
    view = VIEWS[number]
    linear = render(view, components, object_from_cameras(view))
    left, white = expose(linear[0], view.seed * 10, PERCENTILE)
    right, _ = expose(linear[1], view.seed * 10 + 1, PERCENTILE, gain=1.03, white=white)
    for side, image in (("left", left), ("right", right)):
        cv2.imwrite(str(out / f"pair_{number}_{side}.png"), image, [cv2.IMWRITE_PNG_COMPRESSION, 9])


def write_data(number: str, out: Path, components: list[Component]) -> None:
    """Write a pair's truth, rig and prior."""
    view = VIEWS[number]
    poses = object_from_cameras(view)
    stem = f"pair_{number}"
    (out / f"{stem}_truth.json").write_text(truth_text(truth_data(number, view, components, Caster(components))))
    rig = rig_data(view, np.linalg.inv(poses[0]) @ poses[1])
    write_yaml(out / f"{stem}_rig.yaml", rig, "A stereo rig: mm, OpenCV cameras; the rig's frame is the left camera's.")
    error, sigma_mm, sigma_deg = drawn_error(view)
    prior = {
        "world_from_rig": matrix_rows(WORLD_FROM_OBJECT[view.variant] @ poses[0] @ error),
        "sigma": {"translation_mm": sigma_mm, "rotation_deg": sigma_deg},
    }
    write_yaml(
        out / f"{stem}_prior.yaml", prior, "Where the rig is thought to be: the truth, off by a draw from sigma."
    )


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
