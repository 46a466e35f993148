"""Lamps, the surrounding and what stands behind or below the object."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from examples.bulkhead.design import DEPTH
from examples.render.surfaces import bitmap, periodic_noise, two_sided
from examples.render.views import Shot

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Lighting:
    """Radiance of each lamp (0: not there) and of the surrounding; the default is the demonstration's."""

    disk: float = 9.0
    tube: float = 14.0
    box: float = 3.0
    rake: float = 45.0
    surround: float = 0.4
    more: int = 0  # further soft boxes, anywhere before the object


def _facing(mi: Any, origin: Array, target: Array) -> Any:
    up = [0.0, 1.0, 0.0] if abs((target - origin)[1]) < 0.9 * np.linalg.norm(target - origin) else [1.0, 0.0, 0.0]
    return mi.ScalarTransform4f().look_at(origin=origin.tolist(), target=target.tolist(), up=up)


def lamps(mi: Any, view: Shot, lighting: Lighting, rng: np.random.Generator) -> dict[str, Any]:
    """A disk near the mirror direction, a tube, a soft box and a small raking box, and a blotchy surrounding."""
    target, normal = view.target, view.normal
    sight = (view.middle - target) / np.linalg.norm(view.middle - target)
    mirror = 2 * (sight @ normal) * normal - sight

    def place(direction: Array, distance: float) -> Array:
        return np.asarray(target + distance * direction / np.linalg.norm(direction))

    side = np.cross(normal, mirror + np.array([0.3, 0.2, 0]))
    side /= np.linalg.norm(side)
    disk = place(mirror + 0.16 * rng.normal(size=3), rng.uniform(1500, 2000))
    tube = place(normal + 0.9 * side + 0.2 * rng.normal(size=3), 1700)
    box = place(normal - 0.8 * side + 0.5 * mirror, 2100)
    rake = place(0.35 * normal + side * rng.choice([-1, 1]) + 0.4 * rng.normal(size=3) * [1, 1, 0], 1500)
    scale = mi.ScalarTransform4f().scale

    def light(shape: str, at: Array, size: tuple[float, float], radiance: float) -> dict[str, Any]:
        to_world = _facing(mi, at, target) @ scale([size[0], size[1], 1])
        return {
            "type": shape,
            "to_world": to_world,
            "emitter": {"type": "area", "radiance": {"type": "uniform", "value": radiance}},
        }

    surround = np.clip(0.28 + 0.22 * periodic_noise(rng, (128, 256), 9, 7), 0.02, 1.2)
    surround += np.linspace(0.35, 0.0, 128)[:, None]
    sky = mi.Bitmap(np.repeat(surround[..., None], 3, 2).astype(np.float32))
    radius = rng.uniform(170, 280)
    out = {
        "disk": ("disk", disk, (radius, radius), lighting.disk),
        "tube": ("rectangle", tube, (34, 850), lighting.tube),
        "box": ("rectangle", box, (420, 380), lighting.box),
        "rake": ("rectangle", rake, (55, 70), lighting.rake),
    }
    for i in range(lighting.more):
        at = place(normal + 0.8 * rng.normal(size=3) * (1 - 0.6 * np.abs(normal)), rng.uniform(1400, 2300))
        out[f"more_{i}"] = ("rectangle", at, tuple(rng.uniform(120, 420, 2)), rng.uniform(2, 8))
    scene = {name: light(*lamp) for name, lamp in out.items() if lamp[3] > 0}
    scene["surround"] = {"type": "envmap", "bitmap": sky, "scale": lighting.surround}
    return scene


def backdrop(mi: Any, view: Shot, rng: np.random.Generator) -> dict[str, Any]:
    """A dark uneven wall behind the bulkhead, seen through its openings."""
    at = view.target.copy()
    at[2] = -420.0 if view.normal[2] > 0 else DEPTH + 420.0
    values = np.clip(0.05 + 0.02 * periodic_noise(rng, (512, 512), 6, 6), 0.01, 0.12)
    return {
        "type": "rectangle",
        "to_world": _facing(mi, at, view.target) @ mi.ScalarTransform4f().scale([2400, 2400, 1]),
        "bsdf": two_sided(mi, {"type": "diffuse", "reflectance": bitmap(mi, values)}),
    }


def table(mi: Any, rng: np.random.Generator) -> dict[str, Any]:
    """A table top just below z = 0: plain, speckled or grained."""
    tone, contrast = rng.uniform(0.12, 0.5), rng.choice([0.01, 0.04, 0.1])
    along, across = ((60.0, 2.0), (5.0, 5.0), (1.2, 1.2))[rng.integers(3)]
    values = np.clip(tone * (1 + contrast * periodic_noise(rng, (1024, 1024), along, across)), 0.01, 0.9)
    texture = {**bitmap(mi, values), "to_uv": mi.ScalarTransform4f().scale([8, 8, 1])}
    scale = mi.ScalarTransform4f().translate([0, 0, -0.05]) @ mi.ScalarTransform4f().scale([2500, 2500, 1])
    return {"type": "rectangle", "to_world": scale, "bsdf": two_sided(mi, {"type": "diffuse", "reflectance": texture})}
