"""Parts of a third hand, written before it was looked at how features are recognised: cam discs.

What is known of a feature is what its operation states; the recogniser may say more.  Frames are stated too: the
direction out of the material, and that of the length where there is one.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from tests.parts.curved_parts import revolved
from tests.parts.solids import Known, Part, Point, Rng, box, carried, cylinder, uniform
from tests.poses import pose_of

UP: Point = (0.0, 0.0, 1.0)


@dataclass(frozen=True)
class Made(Known):
    """A feature as its operation states it: either point is its origin; low and high are the corners of its box.

    axis: Z of the frame lies along it either way, and the origin on a line along it through a point.
    """

    out: Point | None = None
    along: Point | None = None
    box: tuple[Point, Point] | None = None
    axis: Point | None = None


@dataclass
class Work(Part):
    """silent: kinds that the truth is silent about where it states none of them."""

    features: list[Made] = field(default_factory=list)  # type: ignore[assignment]
    silent: frozenset[str] = frozenset(
        ("fillet", "chamfer", "web", "linear_pattern", "circular_pattern", "grid_pattern")
    )

    def note(
        self,
        kind: str,
        *at: Point,
        out: Point | None = None,
        along: Point | None = None,
        box: tuple[Point, Point] | None = None,
        axis: Point | None = None,
        **dimensions: float,
    ) -> None:
        self.features.append(Made(kind, at, dimensions, out, along, box, axis))

    def drill(self, x: float, y: float, r: float, top: float, bottom: float) -> None:
        """A plain hole along z through all of the material between two heights."""
        self.cut(cylinder((x, y, bottom - 1), r, top - bottom + 2))
        ends = ((x, y, top), (x, y, bottom))
        limits = ((x - r, y - r, bottom), (x + r, y + r, top))
        self.note("through_hole", *ends, box=limits, diameter=2 * r, depth=top - bottom)


def toolroom(seed: int) -> Work:
    """The part of a seed."""
    rng = np.random.default_rng(7000 + seed)
    return cam_disc(rng)


def cam_disc(rng: Rng) -> Work:
    """A disc with kidney slots on a circle, some through, and a hub bore with a keyway."""
    rim, t = uniform(rng, 60, 80), uniform(rng, 10, 16)
    work = Work(cylinder((0, 0, 0), rim, t))
    ring, half = uniform(rng, 38, 45), uniform(rng, 4, 7)
    for start in (0.2, 2.4, 4.4):
        sweep, through = uniform(rng, 0.5, 1.1), rng.random() < 0.5
        depth = t if through else uniform(rng, 0.4, 0.7) * t
        z = t - depth - (1 if through else 0)
        outline = [(ring - half, z), (ring + half, z), (ring + half, t + 1), (ring - half, t + 1)]
        tool = Work(_spun(revolved(outline, sweep), start))
        ends = [(ring * float(np.cos(s)), ring * float(np.sin(s)), z) for s in (start, start + sweep)]
        tool.fuse(*(cylinder(e, half, t + 1 - z) for e in ends))
        work.cut(tool.body)
        x, y = (ring * float(f(start + sweep / 2)) for f in (np.cos, np.sin))
        work.note(
            "slot",
            (x, y, t - depth),
            (x, y, t),
            bend_radius=ring,
            length=ring * sweep + 2 * half,
            width=2 * half,
            depth=depth,
        )
    bore, key, deep = uniform(rng, 10, 16), uniform(rng, 4, 6), uniform(rng, 2, 3)
    work.cut(cylinder((0, 0, -1), bore, t + 2))
    work.note("through_hole", (0, 0, t), (0, 0, 0), diameter=2 * bore, depth=t)
    work.cut(box((0, -key / 2, -1), (bore + deep, key / 2, t + 1)))
    work.note("open_slot", (bore + deep, 0, t / 2), out=(-1, 0, 0), width=key, length=t)
    return work


def _spun(body: Any, angle: float) -> Any:
    return carried(body, pose_of(turn=(0, 0, angle)))
