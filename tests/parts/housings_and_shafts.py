"""Parts of a third hand, written before it was looked at how features are recognised: housings and cam
discs.

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
    return housing(rng) if seed % 2 else cam_disc(rng)


def housing(rng: Rng) -> Work:
    """A block on feet: a stepped bearing seat with a snap-ring groove, tapped feet, a window in one wall."""
    a, b, h = uniform(rng, 60, 75), uniform(rng, 60, 75), uniform(rng, 40, 55)
    foot, t = uniform(rng, 22, 30), uniform(rng, 9, 14)
    work = Work(box((-a, -b, 0), (a, b, h)))
    work.fuse(box((-a - foot, -b, 0), (a + foot, b, t)))
    for side in (-1.0, 1.0):
        work.note("step", (side * a, 0, (h + t) / 2), (side * (a + foot / 2), 0, t), length=2 * b)
        for y in (-b / 2, b / 2):
            work.drill(side * (a + foot / 2), y, 4.5, t, 0.0)
    seat, through = uniform(rng, 25, 35), uniform(rng, 15, 22)
    deep = uniform(rng, 0.5, 0.7) * h
    work.cut(cylinder((0, 0, h - deep), seat, 100), cylinder((0, 0, -1), through, 200))
    ring, width, down = uniform(rng, 1.2, 2.5), uniform(rng, 1.5, 3), uniform(rng, 4, 8)
    work.cut(revolved([(0, h - down - width), (seat + ring, h - down - width), (seat + ring, h - down), (0, h - down)]))
    more: dict[str, Any] = {"counterbore_diameter": 2 * seat, "counterbore_depth": deep}
    more |= {"groove_diameter": 2 * (seat + ring), "groove_width": width}
    work.note("through_hole", (0, 0, h), out=UP, diameter=2 * through, depth=h, **more)
    # A lubrication hole from the side into the seat.
    q, z = uniform(rng, 2, 3.5), h - deep / 2 - 6
    work.cut(cylinder((0, -b - 1, z), q, b - seat / 2, (0, 1, 0)))
    end = float(np.sqrt(seat**2 - q**2))
    work.note("through_hole", (0, -b, z), (0, -end, z), diameter=2 * q, depth=b - end)
    return work


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
