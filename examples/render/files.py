"""The files beside a picture or a pair: rig, prior, truth and world."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

from examples.render.model import Component
from examples.render.truth import Caster, project
from examples.render.views import Camera, Shot, drawn_error

Array = NDArray[np.float64]


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


# What the rig file of the demonstration says of its calibration, as a good one with a chessboard would: of pictures
# that are rendered, all of it is exact.
STATED = {"focal_px": 0.7, "centre_px": 0.3, "translation_mm": 0.05, "rotation_deg": 0.005, "radial": 0.0005}
EXACT = dict.fromkeys(STATED, 0.0)


def write_rig(path: Path, view: Shot, sigma: dict[str, float]) -> None:
    """The cameras, and how well they are known; the rig's frame is the left camera's."""

    def camera(c: Camera, pose: Array) -> dict[str, Any]:
        return {
            "width": c.size[0],
            "height": c.size[1],
            "matrix": matrix_rows(c.matrix),
            "distortion": {"model": "opencv", "coefficients": list(c.distortion)},
            "rig_from_camera": matrix_rows(pose),
        }

    left = view.poses["left"]
    places = {side: np.eye(4) if side == "left" else np.linalg.inv(left) @ pose for side, pose in view.poses.items()}
    cameras = {side: camera(c, places[side]) for side, c in view.cameras.items()}
    what, frame = "One camera", "camera; the rig's frame is its own"
    if len(cameras) == 2:
        what, frame = "A stereo rig", "cameras; the rig's frame is the left camera's"
    write_yaml(path, {"sigma": sigma, "cameras": cameras}, f"{what}: mm, OpenCV {frame}.")


def write_prior(
    path: Path, view: Shot, world_from_object: Array, seed: int, translation_mm: float = 15.0, rotation_deg: float = 1.5
) -> None:
    """Where the rig is thought to be: off by a draw, the standard deviations being those given over sqrt 3 per axis."""
    error, sigma_mm, sigma_deg = drawn_error(seed, translation_mm, rotation_deg)
    prior = {
        "world_from_rig": matrix_rows(world_from_object @ view.poses["left"] @ error),
        "sigma": {"translation_mm": sigma_mm, "rotation_deg": sigma_deg},
    }
    write_yaml(path, prior, "Where the rig is thought to be: the truth, off by a draw from sigma.")


def truth_data(
    stem: str, head: dict[str, Any], view: Shot, components: list[Component], caster: Caster, world_from_object: Array
) -> dict[str, Any]:
    """Poses, target and parts in view; pixel counts are exact at pixel centres, without blur."""
    cameras: dict[str, Any] = {}
    parts: dict[int, dict[str, Any]] = {}
    for side, camera in view.cameras.items():
        pose = view.poses[side]
        seen, shares = caster.shares(camera, pose, len(components))
        cameras[side] = {
            "image": f"{stem}_{side}.png",
            "matrix": matrix_rows(camera.matrix),
            "distortion": list(camera.distortion),
            "world_from_camera": matrix_rows(world_from_object @ pose),
            "target_pixel": [round(float(v), 4) for v in project(camera, pose, view.target[None])[0]],
            "background_share": round(float((seen < 0).mean()), 5),
        }
        for i, visible, whole in shares:
            row = parts.setdefault(i, {"path": components[i].path, "product": components[i].part.name})
            row[side] = {"visible_px": visible, "unoccluded_px": whole, "visible_share": round(visible / whole, 5)}
    left = view.poses["left"]
    pair = {"left_from_right": matrix_rows(np.linalg.inv(left) @ view.poses["right"])} if "right" in view.poses else {}
    return {
        **head,
        "image_size": list(view.cameras["left"].size),
        "world_from_object": matrix_rows(world_from_object),
        "world_from_rig": matrix_rows(world_from_object @ left),
        **pair,
        "target_in_object": [float(v) for v in view.target],
        "cameras": cameras,
        "parts_in_view": [parts[i] for i in sorted(parts)],
    }


def write_truth(path: Path, truth: dict[str, Any]) -> None:
    """JSON with a line for each camera, part and change."""
    entries = []
    for key, value in truth.items():
        if isinstance(value, dict) and key == "cameras":
            body = ",\n".join(f'  "{k}": {json.dumps(v)}' for k, v in value.items())
            entries.append(f' "{key}": {{\n{body}\n }}')
        elif isinstance(value, list) and value and isinstance(value[0], dict):
            body = ",\n".join(f"  {json.dumps(row)}" for row in value)
            entries.append(f' "{key}": [\n{body}\n ]')
        else:
            entries.append(f' "{key}": {json.dumps(value)}')
    path.write_text("{\n" + ",\n".join(entries) + "\n}\n")


def write_world(path: Path, world: str, placed: dict[str, str], world_from_object: Array, comment: str) -> None:
    """A world file with one inspected object."""
    row = {**placed, "role": "inspected", "world_from_object": matrix_rows(world_from_object)}
    write_yaml(path, {"world": world, "objects": [row]}, comment)
