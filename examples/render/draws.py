"""What a trial draws from its seed: views, cameras, finishes, lights and exposures."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from examples.bulkhead.plan import crown
from examples.render.lights import Lighting
from examples.render.surfaces import Finish
from examples.render.views import Camera, Shot, View, rigid, shot

Array = NDArray[np.float64]
Draw = np.random.Generator


@dataclass(frozen=True)
class Exposure:
    """Doublings above the percentile of white, electrons at white, readout noise in electrons, blur in px, exponent."""

    ev: float
    full: float
    read: float
    blur: float = 0.7
    gamma: float = 0.5


def draw_exposure(rng: Draw) -> Exposure:
    ev = float(rng.choice([-1.0, -0.5, 0.0, 0.0, 0.5, 1.0]))
    return Exposure(ev, float(round(rng.uniform(1500, 9000))), float(round(rng.uniform(4, 12), 1)))


def draw_lighting(rng: Draw) -> tuple[str, Lighting]:
    """A name and radiances within a quarter of it."""
    names = {
        "standard": Lighting(),
        "few": Lighting(disk=12, tube=0, box=0, rake=0, surround=0.12),
        "many": Lighting(more=5),
        "raking": Lighting(disk=2.5, tube=0, box=0.6, rake=110, surround=0.15),
        "diffuse": Lighting(disk=2.5, tube=0, box=6, rake=0, surround=1.4),
    }
    name = str(rng.choice(list(names)))
    chosen = names[name]
    disk, tube, box, rake, surround = (
        round(float(v * rng.uniform(0.75, 1.25)), 3)
        for v in (chosen.disk, chosen.tube, chosen.box, chosen.rake, chosen.surround)
    )
    return name, Lighting(disk, tube, box, rake, surround, chosen.more)


def draw_finish(rng: Draw) -> tuple[str, Finish]:
    """A name and its numbers."""
    name = str(rng.choice(["brushed", "milled", "ground", "blasted", "painted", "anodised"]))
    lays = tuple(float(round(v)) for v in rng.uniform(-90, 90, 4))

    def between(low: float, high: float) -> float:
        return round(float(rng.uniform(low, high)), 4)

    if name == "brushed":
        finish = Finish(between(0.09, 0.14), between(0.22, 0.34), 0.84, between(0.02, 0.07), between(0.05, 0.2))
    elif name == "milled":
        pitch, slope = between(2, 7), between(0.008, 0.03)
        bump = round(slope * pitch / (2 * math.pi), 5)
        finish = Finish(0.11, between(0.18, 0.28), 0.84, 0.03, between(0.05, 0.15), pitch=pitch, bump_pitch=bump)
    elif name == "ground":
        finish = Finish(between(0.07, 0.09), between(0.14, 0.2), 0.88, 0.02, between(0.03, 0.1), wall=0.12)
    elif name == "blasted":
        rough = between(0.35, 0.5)
        finish = Finish(rough, rough, between(0.5, 0.75), 0.0, between(0.02, 0.08), 0.0, 0.006, wall=rough)
    elif name == "painted":
        rough = between(0.25, 0.5)
        finish = Finish(rough, rough, between(0.2, 0.75), 0.02, 0.03, 0.0, 0.004, wall=rough, painted=True)
    else:
        rough = between(0.18, 0.3)
        finish = Finish(rough, rough, between(0.12, 0.3), 0.01, between(0.03, 0.1), 0.001, 0.008, wall=rough)
    return name, Finish(**{**vars(finish), "lays_deg": lays})


def draw_camera(rng: Draw, size: tuple[int, int], distorted: bool = False) -> Camera:
    """A camera of 46 degrees across, its centre within 1 % of the middle."""
    width, height = size
    focal = round(float(width * rng.uniform(1.13, 1.19)), 2)
    offset = rng.uniform(-0.01, 0.01, 2) * width
    centre = tuple(round(2 * float(v)) / 2 for v in (width / 2 - 0.5 + offset[0], height / 2 - 0.5 + offset[1]))
    bent = (round(float(rng.uniform(-0.16, -0.05)), 4), round(float(rng.uniform(0.0, 0.09)), 4))
    more = tuple(round(float(v), 5) for v in rng.normal(0, 5e-4, 2))
    distortion = (*bent, *more, 0.0) if distorted else (0.0,) * 5
    return Camera(focal, (centre[0], centre[1]), distortion, size)  # type: ignore[arg-type]


def draw_bulkhead_view(
    seed: int, size: tuple[int, int], features: list[dict[str, Any]], stream: int, structured: bool = False
) -> Shot:
    """A pair of the bulkhead from 600 to 1300 mm: three of four look at a feature, the others anywhere (poor parts)."""
    rng = np.random.default_rng([seed, 11, stream])
    back = bool(rng.random() < 0.35)
    kinds = ["duct", "boss", "lug", "lightening_hole", "lowered_rib", "pocket"]
    if structured or rng.random() < 0.75:
        kind = kinds[rng.integers(len(kinds))]
        boxes = [f["box"] for f in features if f["kind"] == kind]
        box = boxes[rng.integers(len(boxes))] if boxes else features[rng.integers(len(features))]["box"]
        x, y = np.array([(box[0] + box[3]) / 2, (box[1] + box[4]) / 2]) + rng.uniform(-50, 50, 2)
    else:
        x = rng.uniform(-1480, 1480)
        y = rng.uniform(20, float(crown()(x)) - 20)
    stand_off = float(rng.uniform(600, 1300))
    baseline = stand_off * float(rng.uniform(0.2, 0.28))
    yaw, pitch = (float(v) for v in rng.uniform(-25, 25, 2))
    roll = float(rng.normal(0, 8)) + (180.0 if rng.random() < 0.15 else 0.0)
    toe_in = math.degrees(math.atan(baseline / 2 / stand_off)) + float(rng.uniform(-0.4, 0.4))
    distorted = bool(rng.random() < 0.25)
    left, right = (draw_camera(rng, size, distorted) for _ in range(2))
    target = (round(float(x), 1), round(float(y), 1))
    return shot(View("", target, stand_off, yaw, pitch, roll, baseline, toe_in, left, right, seed=seed, back=back))


def draw_table_view(
    seed: int, size: tuple[int, int], points: Array, cameras: int, fills: tuple[float, float] = (0.45, 0.72)
) -> Shot:
    """One camera or a pair that looks down on these points (n, 3), whose length is a share of the width between two."""
    rng = np.random.default_rng([seed, 12])
    middle, reach = (points.min(0) + points.max(0)) / 2, float(np.linalg.norm(np.ptp(points, axis=0)))
    views = {side: draw_camera(rng, size) for side in ("left", "right")[:cameras]}
    stand_off = max(250.0, views["left"].focal * reach / (size[0] * float(rng.uniform(*fills))))
    target = middle + rng.uniform(-0.06, 0.06, 3) * reach
    azimuth, elevation = float(rng.uniform(0, 360)), float(rng.uniform(25, 65))
    # Camera axes: z towards the object, x level, y down; then a roll.
    facing = Rotation.from_euler("ZX", (azimuth, -90 - elevation), degrees=True)
    turn = facing * Rotation.from_euler("z", float(rng.normal(0, 7)), degrees=True)
    centre = rigid(turn, target - stand_off * turn.as_matrix()[:, 2])
    if cameras == 1:
        return Shot(views, {"left": centre}, target, np.array([0, 0, 1.0]), stand_off)
    baseline = stand_off * float(rng.uniform(0.18, 0.26))
    toe_in = math.degrees(math.atan(baseline / 2 / stand_off)) + float(rng.uniform(-0.4, 0.4))
    poses = {}
    for side, sign in (("left", -1.0), ("right", 1.0)):
        wobble = Rotation.from_rotvec(rng.normal(0, 0.004, 3))
        inwards = Rotation.from_euler("y", -sign * toe_in, degrees=True) * wobble
        poses[side] = centre @ rigid(inwards, np.array([sign * baseline / 2, *rng.normal(0, 2.0, 2)]))
    return Shot(views, poses, target, np.array([0, 0, 1.0]), stand_off)


def first_credible(draw: Callable[[int], Shot], good: Callable[[Shot], bool], first: int = 0, most: int = 100) -> Shot:
    """The first of a stream of drawn views, numbered from `first`, that will do."""
    for stream in range(first, first + most):
        view = draw(stream)
        if good(view):
            return view
    raise RuntimeError(f"none of {most} drawn views will do")
