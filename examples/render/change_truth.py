"""What the pictures of a changed part show of each change: pixels counted by ray casting against both models."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from examples.bulkhead.design import Design
from examples.bulkhead.variation import Box, Change
from examples.render.model import Component
from examples.render.truth import Caster, pixel_rays
from examples.render.views import Shot

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Built:
    """A design as built: its components and the caster of their meshes."""

    design: Design
    components: list[Component]
    caster: Caster


@dataclass(frozen=True)
class _Seen:
    """What each pixel of a camera shows of a part: component (-1 none), range in mm (infinite), point met."""

    component: NDArray[np.int32]
    range: Array
    point: Array


def change_rows(changes: tuple[Change, ...], model: Built, rendered: Built, view: Shot) -> list[dict[str, Any]]:
    """A row for each change, then one named "" for differences beside all of them.

    By camera: `model_px` shows the feature as the model has it, `rendered_px` as the picture has it (openings of
    holes, components, else surface in the feature's box), `differing_px` where the two models' surfaces differ by
    0.1 mm and more along the ray.
    """
    rows: list[dict[str, Any]] = [
        {
            "name": c.name,
            "kind": c.kind,
            "change": c.change,
            "amount": c.amount,
            "box_before": c.before,
            "box_after": c.after,
        }
        for c in changes
    ]
    beside: dict[str, Any] = {"name": "", "kind": "beside", "change": ""}
    for side, camera in view.cameras.items():
        pose = view.poses[side]
        rays = pixel_rays(camera) @ pose[:3, :3].T
        rays /= np.linalg.norm(rays, axis=1, keepdims=True)
        before, after = (_see(built, pose[:3, 3], rays) for built in (model, rendered))
        with np.errstate(invalid="ignore"):
            left = ~(np.abs(before.range - after.range) < 0.1) & (np.isfinite(before.range) | np.isfinite(after.range))
        for change, row in zip(changes, rows, strict=True):
            places = [(p.point, box) for p in (before, after) for box in (change.before, change.after)]
            own = left & np.logical_or.reduce([_within(point, box) for point, box in places])
            left[own] = False
            row[side] = {
                "model_px": int(_shown(model, change, change.before, before, pose[:3, 3], rays).sum()),
                "rendered_px": int(_shown(rendered, change, change.after, after, pose[:3, 3], rays).sum()),
                "differing_px": int(own.sum()),
            }
        beside[side] = {"differing_px": int(left.sum())}
    return [*rows, beside]


def _see(built: Built, centre: Array, rays: Array) -> _Seen:
    component, distance = built.caster.cast(centre, rays)
    distance = np.where(component < 0, np.inf, distance)
    point = centre + np.where(component < 0, 0.0, distance)[:, None] * rays
    point[component < 0] = np.inf
    return _Seen(component, distance, point)


def _within(points: Array, box: Box | None, margin: float = 5.0) -> Mask:
    if box is None:
        return np.zeros(len(points), bool)
    return np.asarray(((points > np.array(box[:3]) - margin) & (points < np.array(box[3:]) + margin)).all(1))


def _shown(built: Built, change: Change, box: Box | None, seen: _Seen, centre: Array, rays: Array) -> Mask:
    if box is None:
        return np.zeros(len(rays), bool)
    names = {change.name, f"PLUG_{change.name}"}
    own = [i for i, c in enumerate(built.components) if c.path in names or c.path.startswith(f"{change.name}/")]
    if own:
        return np.isin(seen.component, own)
    if change.kind == "hole":
        return opening(box, seen.range, centre, rays)
    return _within(seen.point, box, 0.5)


def opening(box: Box, ranges: Array, centre: Array, rays: Array) -> Mask:
    """Rays that go through the near mouth of a round hole along z, given by its box, with nothing before it."""
    x0, y0, z0, x1, y1, z1 = box
    level = z1 if centre[2] > z1 else z0
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = (level - centre[2]) / rays[:, 2]
    at = centre[:2] + distance[:, None] * rays[:, :2]
    inside = np.hypot(at[:, 0] - (x0 + x1) / 2, at[:, 1] - (y0 + y1) / 2) < (x1 - x0) / 2
    return np.asarray((distance > 0) & inside & (ranges > distance - 0.05))
