"""Operations on a seat: holes, pockets, slots, bosses and a pattern, each with what it makes known."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from tests.parts.solids import (
    Floats,
    Part,
    Point,
    Rng,
    box,
    carried,
    cone,
    cylinder,
    fillet,
    obround,
    prism,
    round_box,
    uniform,
)

FAR = 300.0


@dataclass(frozen=True, eq=False)
class Seat:
    """A flat place on a body: part_from_seat with z out of the material, the half widths that are free around it.

    below is the thickness of the material down to a parallel face.
    """

    pose: Floats
    half: tuple[float, float]
    below: float
    safe: float  # depth that may be cut

    def put(self, shape: Any) -> Any:
        return carried(shape, self.pose)

    def p(self, x: float, y: float, z: float) -> Point:
        q = self.pose[:3] @ [x, y, z, 1.0]
        return (float(q[0]), float(q[1]), float(q[2]))

    def spun(self, angle: float) -> Seat:
        c, s = np.cos(angle), np.sin(angle)
        spin = np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]])
        # What fits into the circle fits however it is turned.
        least = min(self.half)
        return Seat(self.pose @ spin, (least, least), self.below, self.safe)


def seat(origin: Point, z: Point, x: Point, half: tuple[float, float], below: float, safe: float) -> Seat:
    pose = np.eye(4)
    up, along = np.array(z, float) / np.linalg.norm(z), np.array(x, float) / np.linalg.norm(x)
    pose[:3, 0], pose[:3, 1], pose[:3, 2], pose[:3, 3] = along, np.cross(up, along), up, origin
    return Seat(pose, half, below, safe)


def countersunk(part: Part, rng: Rng, s: Seat) -> None:
    half = float(np.radians(rng.choice([30, 41, 45, 60])))
    wide = uniform(rng, 0.4, 0.8) * min(s.half)
    r = wide * uniform(rng, 0.4, 0.7)
    deep = (wide - r) / float(np.tan(half))
    if deep > 0.6 * s.safe:
        return
    part.cut(s.put(cone((0, 0, -deep), r, wide, deep)))
    more = {"countersink_diameter": 2 * wide, "countersink_angle": 2 * half}
    part.cut(s.put(cylinder((0, 0, -s.below - 1), r, FAR)))
    part.know("through_hole", s.p(0, 0, 0), diameter=2 * r, depth=s.below, **more)


def _plan(rng: Rng, s: Seat) -> tuple[Seat, float, float]:
    """A rectangle turned about the middle of the seat: its seat, length and width."""
    s = s.spun(uniform(rng, 0, np.pi)) if rng.random() < 0.6 else s
    reach = min(s.half)
    length = 2 * reach * uniform(rng, 0.65, 0.8)
    width = length * uniform(rng, 0.4, 0.7)
    return s, length, width


def polygon_pocket(part: Part, rng: Rng, s: Seat) -> None:
    """Of three or six sides, blind or through."""
    count, reach, turn = int(rng.choice([3, 6])), uniform(rng, 0.5, 0.8) * min(s.half), uniform(rng, 0, 2)
    t = turn + 2 * np.pi * np.arange(count) / count
    corners = [(reach * float(np.cos(a)), reach * float(np.sin(a))) for a in t]
    # The least rectangle lies on a side.
    tall = reach * (1.5 if count == 3 else 3**0.5)
    broad = reach * (3**0.5 if count == 3 else 2.0)
    length, width = max(tall, broad), min(tall, broad)
    # Centre of the rectangle: of a triangle half its height above the side.
    mids = []
    for k in range(count):
        m = (np.array(corners[k]) + corners[(k + 1) % count]) / 2
        mids.append(m - m / np.linalg.norm(m) * tall / 2)
    if rng.random() < 0.4:
        part.cut(s.put(prism([(*c, -s.below - 1) for c in corners], (0, 0, FAR))))
        ends = tuple(s.p(m[0], m[1], z) for m in mids for z in (0.0, -s.below))
        part.know("duct", ends, length=length, width=width, depth=s.below)
        return
    depth = uniform(rng, 0.3, 0.7) * s.safe
    part.cut(s.put(prism([(*c, -depth) for c in corners], (0, 0, FAR))))
    part.know("pocket", tuple(s.p(m[0], m[1], -depth) for m in mids), length=length, width=width, depth=depth)


def nested(part: Part, rng: Rng, s: Seat) -> None:
    """A pocket in a pocket, and a hole in the floor."""
    s, length, width = _plan(rng, s)
    one, two = uniform(rng, 0.15, 0.35) * s.safe, uniform(rng, 0.5, 0.8) * s.safe
    corner = 0.15 * width
    part.cut(s.put(round_box((-length / 2, -width / 2, -one), (length / 2, width / 2, FAR), corner)))
    part.know("pocket", s.p(0, 0, -one), length=length, width=width, depth=one, corner_radius=corner)
    x, inner, narrow = 0.1 * length, 0.6 * length, 0.6 * width
    low, high = (x - inner / 2, -narrow / 2, -two), (x + inner / 2, narrow / 2, FAR)
    part.cut(s.put(box(low, high)))
    part.know("pocket", s.p(x, 0, -two), length=inner, width=narrow, depth=two - one)
    r = 0.25 * narrow
    part.cut(s.put(cylinder((x, 0, -s.below - 1), r, FAR)))
    ends = (s.p(x, 0, -two), s.p(x, 0, -s.below))
    part.know("through_hole", ends, diameter=2 * r, depth=s.below - two)


def islands(part: Part, rng: Rng, s: Seat) -> None:
    """A pocket around a round and a square island, as high as the rim or lower."""
    s, length, width = _plan(rng, s)
    depth = uniform(rng, 0.4, 0.7) * s.safe
    corner = 0.2 * width
    tool = Part(round_box((-length / 2, -width / 2, -depth), (length / 2, width / 2, FAR), corner))
    r, a = 0.12 * length, 0.1 * length
    tall = (depth, depth * uniform(rng, 0.4, 0.9))
    tall = tall if rng.random() < 0.5 else tall[::-1]
    x = 0.22 * length
    tool.cut(cylinder((-x, 0, -depth), r, tall[0] if tall[0] < depth else FAR * 2))
    high = tall[1] - depth if tall[1] < depth else FAR * 2
    tool.cut(box((x - a, -0.8 * a, -depth), (x + a, 0.8 * a, high)))
    part.cut(s.put(tool.body))
    part.know("pocket", s.p(0, 0, -depth), length=length, width=width, depth=depth, corner_radius=corner)
    part.know("boss", s.p(-x, 0, -depth), diameter=2 * r, height=tall[0])
    part.know("boss", s.p(x, 0, -depth), length=2 * a, width=1.6 * a, height=tall[1])


def closed_slot(part: Part, rng: Rng, s: Seat) -> None:
    s = s.spun(uniform(rng, 0, 3))
    length = 2 * min(s.half) * uniform(rng, 0.6, 0.85)
    width = length * uniform(rng, 0.2, 0.5)
    if rng.random() < 0.5:
        part.cut(s.put(obround((0, 0, -s.below - 1), length, width, FAR)))
        part.know("slot", (s.p(0, 0, 0), s.p(0, 0, -s.below)), length=length, width=width, depth=s.below)
        return
    depth = uniform(rng, 0.3, 0.8) * s.safe
    part.cut(s.put(obround((0, 0, -depth), length, width, FAR)))
    part.know("slot", s.p(0, 0, -depth), length=length, width=width, depth=depth)


def round_boss(part: Part, rng: Rng, s: Seat) -> None:
    """Straight or with draft, with a rounded foot, or drilled from above."""
    r, height = uniform(rng, 0.4, 0.75) * min(s.half), uniform(rng, 4, 20)
    finish, more = int(rng.integers(4)), {}
    if finish == 0:
        lean = float(np.radians(uniform(rng, 1, 8)))
        top = r - height * float(np.tan(lean))
        if top < 0.2 * r:
            return
        part.fuse(s.put(cone((0, 0, 0), r, top, height)))
        more = {"draft_angle": lean}
    else:
        part.fuse(s.put(cylinder((0, 0, 0), r, height)))
    if finish == 1:
        c, middle = min(0.2 * r, 0.5 * height), np.array(s.p(0, 0, 0))

        def ring(a: Floats, b: Floats) -> bool:
            away = max(abs(np.linalg.norm(a - middle) - r), abs(np.linalg.norm(b - middle) - r))
            return bool(away < 1e-5 and abs((a - middle) @ s.pose[:3, 2]) < 1e-5)

        part.body = fillet(part.body, c, ring)
        more = {"fillet_radius": c}
    part.know("boss", s.p(0, 0, 0), diameter=2 * r, height=height, **more)
    if finish == 2:
        bore, deep = 0.4 * r, 0.7 * height
        part.cut(s.put(cylinder((0, 0, height - deep), bore, FAR)))
        part.know("blind_hole", s.p(0, 0, height), diameter=2 * bore, depth=deep)
    elif finish == 3:
        bore = 0.45 * r
        part.cut(s.put(cylinder((0, 0, -s.below - 1), bore, FAR)))
        depth = s.below + height
        ends = (s.p(0, 0, height), s.p(0, 0, -s.below))
        part.know("through_hole", ends, diameter=2 * bore, depth=depth)


def long_boss(part: Part, rng: Rng, s: Seat) -> None:
    """Square or obround, turned."""
    s, length, width = _plan(rng, s)
    height = uniform(rng, 4, 20)
    if rng.random() < 0.5:
        part.fuse(s.put(obround((0, 0, -0.5), length, width, height + 0.5)))
    else:
        low, high = (-length / 2, -width / 2, -0.5), (length / 2, width / 2, height)
        part.fuse(s.put(round_box(low, high, float(rng.choice([0.0, 0.2])) * width)))
    part.know("boss", s.p(0, 0, 0), length=length, width=width, height=height)


def grid(part: Part, rng: Rng, s: Seat) -> None:
    """Two or three rows of holes."""
    rows, columns = int(rng.integers(2, 4)), int(rng.integers(3, 5))
    pitch = 2 * min(s.half) * 0.85 / columns
    narrow = pitch * uniform(rng, 0.75, 0.97)
    r = pitch * 0.2
    for i in range(columns):
        for j in range(rows):
            x, y = (i - (columns - 1) / 2) * pitch, (j - (rows - 1) / 2) * narrow
            drilled(part, s, x, y, r)
    ends = (s.p(0, 0, 0), s.p(0, 0, -s.below))
    part.know(
        "grid_pattern",
        ends,
        count=rows * columns,
        rows=rows,
        columns=columns,
        pitch=pitch,
        row_pitch=narrow,
        hole_diameter=2 * r,
    )


def drilled(part: Part, s: Seat, x: float, y: float, r: float) -> None:
    x, y = float(x), float(y)
    part.cut(s.put(cylinder((x, y, -s.below - 1), r, s.below + 2)))
    part.know("through_hole", (s.p(x, y, 0), s.p(x, y, -s.below)), diameter=2 * r, depth=s.below)


ON_A_SEAT = {  # by the numbers that seeds draw
    1: countersunk,
    3: polygon_pocket,
    4: nested,
    5: islands,
    6: closed_slot,
    7: round_boss,
    8: long_boss,
    9: grid,
}


def work(part: Part, rng: Rng, seats: list[Seat]) -> None:
    for k in rng.permutation(len(seats)).tolist():
        ON_A_SEAT[int(rng.integers(11))](part, rng, seats[k])
