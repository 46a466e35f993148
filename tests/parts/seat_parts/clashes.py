"""Blocks whose operations clash."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from OCP.BRepAlgoAPI import BRepAlgoAPI_Common

from tests.parts.seat_parts.seats import FAR, Floats, Rng, Seat, seat, uniform
from tests.parts.solids import Part, box, cylinder, fillet, prism, round_box


def clash(rng: Rng) -> Part:
    """A block whose operations cut one another; four of them, each in a quarter of its own."""
    t = uniform(rng, 32, 44)
    part = Part(box((0, 0, 0), (280, 180, t)))
    chosen = rng.permutation(len(CLASHES))[:4].tolist()
    for k, (x, y) in zip(chosen, ((70, 45), (210, 45), (70, 135), (210, 135)), strict=True):
        # From above the middle of a quarter, with the nearest side at -y.
        turn = (1, 0, 0) if y < 90 else (-1, 0, 0)
        CLASHES[k](part, rng, seat((x, y, t), (0, 0, 1), turn, (60, 40), t, 0.9 * t))
    return part


def hole_in_a_wall(part: Part, rng: Rng, s: Seat) -> None:
    """A hole of which half lies in a pocket."""
    assert s.below is not None
    a, c, depth, r = uniform(rng, 25, 35), uniform(rng, 15, 22), uniform(rng, 8, 16), uniform(rng, 4, 8)
    part.cut(s.put(box((-a, -c, -depth), (a, c, 1))))
    x = a + uniform(rng, -0.3, 0.3) * r
    part.cut(s.put(cylinder((x, 0, -s.below - 1), r, FAR)))
    part.know("pocket", s.p(0, 0, -depth), length=2 * a, width=2 * c, depth=depth)
    part.know("through_hole", (s.p(x, 0, 0), s.p(x, 0, -s.below)), diameter=2 * r, depth=s.below)


def crossing_pockets(part: Part, rng: Rng, s: Seat) -> None:
    """A long shallow pocket and a deep one across it."""
    a, c, shallow, deep = uniform(rng, 45, 55), uniform(rng, 10, 14), uniform(rng, 5, 9), uniform(rng, 14, 22)
    b, d = uniform(rng, 10, 14), uniform(rng, 20, 30)
    part.cut(s.put(box((-a, -c, -shallow), (a, c, 1))), s.put(box((-b, -d, -deep), (b, d, 1))))
    part.know("pocket", s.p(0, 0, -shallow), length=2 * a, width=2 * c, depth=shallow)
    part.know("pocket", s.p(0, 0, -deep), length=2 * d, width=2 * b, depth=deep)


def joined_pockets(part: Part, rng: Rng, s: Seat) -> None:
    """Two pockets of one depth that run together."""
    a, depth = uniform(rng, 20, 30), uniform(rng, 6, 18)
    part.cut(s.put(box((-a, -30, -depth), (0, 0, 1))), s.put(box((-10, -20, -depth), (a, 25, 1))))
    at = [s.p(0, -2.5, -depth)]
    part.know("pocket", tuple(at), length=max(2 * a, 55.0), width=min(2 * a, 55.0), depth=depth)


def slotted_boss(part: Part, rng: Rng, s: Seat) -> None:
    r, height = uniform(rng, 14, 25), uniform(rng, 10, 20)
    part.fuse(s.put(cylinder((0, 0, 0), r, height)))
    w, d = uniform(rng, 4, 8), uniform(rng, 3, 8)
    part.cut(s.put(box((-r - 1, -w / 2, height - d), (r + 1, w / 2, height + 1))))
    part.know("boss", s.p(0, 0, 0), diameter=2 * r, height=height)
    part.know("open_slot", s.p(0, 0, height - d), length=2 * r, width=w, depth=d)


def holed_fillet(part: Part, rng: Rng, s: Seat) -> None:
    """The rounded edge of a step with a hole through the round."""
    assert s.below is not None
    a, c = uniform(rng, 20, 30), uniform(rng, 14, 20)
    height, r = uniform(rng, 10, 14), uniform(rng, 3, 6)
    block = fillet(s.put(box((-a, -c, -1), (a, c, height))), r, _at_seat(s, lambda p: abs(p[1] + c) < 1e-5, height))
    part.fuse(block)
    q = uniform(rng, 2, 4)
    part.cut(s.put(cylinder((5, -c + r, -s.below - 1), q, FAR)))
    depth = s.below + height
    part.know("through_hole", (s.p(5, -c + r, height), s.p(5, -c + r, -s.below)), diameter=2 * q, depth=depth)
    part.know("boss", s.p(0, 0, 0), length=2 * a, width=2 * c, height=height)
    part.know("fillet", s.p(0, -c + r, height - r), radius=r, length=2 * a)


def _at_seat(s: Seat, wanted: Callable[[Floats], bool], height: float) -> Callable[[Floats, Floats], bool]:
    inverse = np.linalg.inv(s.pose)

    def both(a: Floats, b: Floats) -> bool:
        p, q = (inverse[:3, :3] @ x + inverse[:3, 3] for x in (a, b))
        level = abs(p[2] - height) < 1e-5 and abs(q[2] - height) < 1e-5
        return bool(level and wanted(p) and wanted(q))

    return both


def counterbore_at_the_edge(part: Part, rng: Rng, s: Seat) -> None:
    """A counterbore that breaks out of the side."""
    assert s.below is not None
    r = uniform(rng, 3, 5)
    wide, deep = r + uniform(rng, 3, 5), uniform(rng, 6, 12)
    y = -45 + wide * uniform(rng, 0.75, 0.95)
    y = max(y, -45 + r + 0.5)
    part.cut(s.put(cylinder((0, y, -s.below - 1), r, FAR)), s.put(cylinder((0, y, -deep), wide, FAR)))
    more = {"counterbore_diameter": 2 * wide, "counterbore_depth": deep}
    part.know("through_hole", s.p(0, y, 0), diameter=2 * r, depth=s.below, **more)


def cross_drilled(part: Part, rng: Rng, s: Seat) -> None:
    """A hole from above, and one from the side that ends in it or crosses it."""
    assert s.below is not None
    r, q = uniform(rng, 6, 10), uniform(rng, 2, 5)
    part.cut(s.put(cylinder((0, 0, -s.below - 1), r, FAR)))
    part.know("through_hole", (s.p(0, 0, 0), s.p(0, 0, -s.below)), diameter=2 * r, depth=s.below)
    z = -s.below / 2
    if rng.random() < 0.5:
        part.cut(s.put(cylinder((0, -50, z), q, 50, (0, 1, 0))))
        low = (r**2 - q**2) ** 0.5
        part.know("through_hole", (s.p(0, -45, z), s.p(0, -low, z)), diameter=2 * q, depth=45 - low)
    else:
        part.cut(s.put(cylinder((0, -50, z), q, 80, (0, 1, 0))))
        part.know("blind_hole", s.p(0, -45, z), diameter=2 * q, depth=75.0)


def interrupted(part: Part, rng: Rng, s: Seat) -> None:
    """A hole from the side through both walls of a pocket; it ends blind."""
    a, c, depth, q = uniform(rng, 15, 25), uniform(rng, 8, 14), uniform(rng, 18, 22), uniform(rng, 2, 4)
    part.cut(s.put(box((-a, -c, -depth), (a, c, 1))))
    part.know("pocket", s.p(0, 0, -depth), length=2 * a, width=2 * c, depth=depth)
    part.cut(s.put(cylinder((0, -50, -8), q, 50 + c + 12, (0, 1, 0))))
    part.know("blind_hole", s.p(0, -45, -8), diameter=2 * q, depth=45 + c + 12)


def chamfer_over_a_hole(part: Part, rng: Rng, s: Seat) -> None:
    """A raised block; a hole at its edge, then the edge is cut off."""
    assert s.below is not None
    a, c, height, k = uniform(rng, 25, 35), uniform(rng, 16, 22), uniform(rng, 10, 14), uniform(rng, 2, 4)
    block = s.put(box((-a, -c, -1), (a, c, height)))
    part.fuse(block)
    q = uniform(rng, 3, 6)
    y = -c + k + q * 0.5
    y = max(y, -c + q + 0.5)
    part.cut(s.put(cylinder((0, y, -s.below - 1), q, FAR)))
    section = [(-FAR, -c - 1, height - k - 1), (-FAR, -c - 1, height + 1), (-FAR, -c + k + 1, height + 1)]
    tool = prism(section, (2 * FAR, 0, 0))
    part.cut(s.put(BRepAlgoAPI_Common(tool, box((-a - 1, -c - 1, 0), (a + 1, c, height + 1))).Shape()))
    depth = s.below + height
    part.know("through_hole", (s.p(0, y, height), s.p(0, y, -s.below)), diameter=2 * q, depth=depth)
    part.know("boss", s.p(0, 0, 0), length=2 * a, width=2 * c, height=height)
    at = s.p(0, -c + k / 2, height - k / 2)
    part.know("chamfer", at, width=k * 2**0.5, length=2 * a, angle=np.pi / 4)


def bored_rib(part: Part, rng: Rng, s: Seat) -> None:
    """A hole through a rib, and a rib across it."""
    a, rib, high, q = uniform(rng, 40, 50), uniform(rng, 3, 6), uniform(rng, 16, 24), uniform(rng, 2, 5)
    part.fuse(s.put(box((-a, -rib / 2, -1), (a, rib / 2, high))))
    part.fuse(s.put(box((-rib / 2, -30, -1), (rib / 2, 30, high))))
    part.know("rib", s.p(0, 0, 0), thickness=rib, length=2 * a, height=high)
    part.know("rib", s.p(0, 0, 0), thickness=rib, length=60.0, height=high)
    part.cut(s.put(cylinder((25, -20, high / 2), q, 40, (0, 1, 0))))
    ends = (s.p(25, -rib / 2, high / 2), s.p(25, rib / 2, high / 2))
    part.know("through_hole", ends, diameter=2 * q, depth=rib)


def slot_into_pocket(part: Part, rng: Rng, s: Seat) -> None:
    """A slot from the side that runs into a deeper pocket."""
    a, c, depth = uniform(rng, 20, 30), uniform(rng, 12, 20), uniform(rng, 14, 22)
    part.cut(s.put(round_box((-a, -c, -depth), (a, c, 1), 5.0)))
    part.know("pocket", s.p(0, 0, -depth), length=2 * a, width=2 * c, depth=depth, corner_radius=5.0)
    w, d = uniform(rng, 6, 12), uniform(rng, 4, 10)
    part.cut(s.put(box((-w / 2, -50, -d), (w / 2, 0, 1))))
    part.know("open_slot", s.p(0, (-45 - c) / 2, -d), length=45 - c, width=w, depth=d)


CLASHES = (
    hole_in_a_wall,
    crossing_pockets,
    joined_pockets,
    slotted_boss,
    holed_fillet,
    counterbore_at_the_edge,
    cross_drilled,
    interrupted,
    chamfer_over_a_hole,
    bored_rib,
    slot_into_pocket,
)
