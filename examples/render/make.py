"""Render the demonstration's stereo pairs and write their rig, prior and truth files.

    python -m examples.render.make [--out examples/demo] [--look FOLDER] [NN ...]

`--look` also writes overlays of the visible model edges and prints how far the picture's edges lie from them.
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
from examples.render.truth import Caster, project, visible_edges
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


def edge_offsets(image: NDArray[np.uint8], edges: list[tuple[Array, Array]], reach: int = 3) -> tuple[int, Array]:
    """Signed x, y offsets (median over samples) from projected edges to the steepest gradient across them.

    Samples count where the picture changes by more than 40 grey values within `reach` pixels, off its border.
    """
    points, normals = (np.concatenate(a) for a in zip(*edges, strict=True))
    clear = ((points > 12) & (points < [WIDTH - 13, HEIGHT - 13])).all(1)
    points, normals = points[clear], normals[clear]
    steps = np.arange(-reach, reach + 0.01, 0.25)
    at = points[:, None] + steps[None, :, None] * normals[:, None]
    x, y = np.moveaxis(at, 2, 0).astype(np.float32)
    profile = cv2.remap(image.astype(np.float32), x, y, cv2.INTER_CUBIC)
    slope = np.abs(np.gradient(profile, axis=1))
    peak = slope.argmax(1)
    good = (np.ptp(profile, axis=1) > 40) & (peak > 0) & (peak < len(steps) - 1)
    row, peak = np.flatnonzero(good), peak[good]
    before, at_peak, after = slope[row, peak - 1], slope[row, peak], slope[row, peak + 1]
    finer = (before - after) / (2 * np.minimum(before - 2 * at_peak + after, -1e-9))
    offset = (steps[peak] + 0.25 * np.clip(finer, -0.5, 0.5))[:, None] * normals[good]
    return int(good.sum()), np.median(offset, axis=0)


def look(folder: Path, number: str, images: list[Any], view: View, components: list[Component], caster: Caster) -> None:
    """Overlays, and a line of edge offsets for each picture."""
    folder.mkdir(parents=True, exist_ok=True)
    for side, image, camera, pose in zip(
        ("left", "right"), images, (view.left, view.right), object_from_cameras(view), strict=True
    ):
        edges = visible_edges(caster, components, camera, pose)
        count, (dx, dy) = edge_offsets(image, edges)
        share = float((image == 255).mean())
        print(f"{number} {side}: {len(edges)} edges, {count} samples, {dx:+.3f} {dy:+.3f} px, {share:.1%} white")
        drawn = cv2.cvtColor(image, cv2.COLOR_GRAY2BGR)
        for points, _ in edges:
            for x, y in points:
                cv2.circle(drawn, (round(x * 16), round(y * 16)), 12, (0, 0, 255), -1, cv2.LINE_AA, 4)
        cv2.imwrite(str(folder / f"overlay_{number}_{side}.png"), drawn)


def make(number: str, out: Path, components: list[Component], look_at: Path | None) -> None:
    view = VIEWS[number]
    poses = object_from_cameras(view)
    caster = Caster(components)
    linear = render(view, components, poses)
    left, white = expose(linear[0], view.seed * 10, PERCENTILE)
    right, _ = expose(linear[1], view.seed * 10 + 1, PERCENTILE, gain=1.03, white=white)
    for side, image in (("left", left), ("right", right)):
        cv2.imwrite(str(out / f"pair_{number}_{side}.png"), image, [cv2.IMWRITE_PNG_COMPRESSION, 9])
    (out / f"pair_{number}_truth.json").write_text(truth_text(truth_data(number, view, components, caster)))
    rig = rig_data(view, np.linalg.inv(poses[0]) @ poses[1])
    write_yaml(
        out / f"pair_{number}_rig.yaml",
        rig,
        "The stereo rig: mm, OpenCV cameras; the rig's frame is the left camera's.",
    )
    error, sigma_mm, sigma_deg = drawn_error(view)
    world_from_rig = WORLD_FROM_OBJECT[view.variant] @ poses[0] @ error
    prior = {
        "world_from_rig": matrix_rows(world_from_rig),
        "sigma": {"translation_mm": sigma_mm, "rotation_deg": sigma_deg},
    }
    write_yaml(
        out / f"pair_{number}_prior.yaml",
        prior,
        "Where the rig is thought to be; the truth is off by a draw from sigma.",
    )
    if look_at is not None:
        look(look_at, number, [left, right], view, components, caster)


def main() -> None:
    arguments = argparse.ArgumentParser(description="Render the demonstration's stereo pairs.")
    arguments.add_argument("pairs", nargs="*", default=list(VIEWS))
    arguments.add_argument("--out", type=Path, default=Path("examples/demo"))
    arguments.add_argument("--look", type=Path)
    options = arguments.parse_args()
    write_worlds(options.out)
    models: dict[str, list[Component]] = {}
    for number in options.pairs:
        variant = VIEWS[number].variant
        if variant not in models:
            models[variant] = read_components(Path(f"examples/demo/bulkhead_{variant}.step.gz"))
        make(number, options.out, models[variant], options.look)


if __name__ == "__main__":
    main()
