"""Parts whose features are known: every kind that is recognised, in the sections that tools leave."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import atan2, cos, pi, sin, sqrt, tan
from typing import Any

import numpy as np
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge, BRepBuilderAPI_MakeFace, BRepBuilderAPI_MakeWire
from OCP.BRepPrimAPI import BRepPrimAPI_MakeCone, BRepPrimAPI_MakeCylinder, BRepPrimAPI_MakePrism
from OCP.gp import gp_Ax2, gp_Dir, gp_Elips, gp_Pnt, gp_Vec

from relmodel.features import Feature
from tests.parts.curved_parts import revolved
from tests.parts.solids import (
    Part,
    Point,
    between,
    box,
    carried,
    chamfer,
    cone,
    cylinder,
    fillet,
    obround,
    prism,
    round_box,
)
from tests.poses import pose_of

X, Y, UP, DOWN = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.0, -1.0)
QUARTER = np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]])  # z to x
NEAR = 0.01  # mm, and rad; a chord of a round face is off by as much


@dataclass(frozen=True)
class Known:
    """A feature as its operation states it: origin and Z of its frame, X either way where it has a direction."""

    kind: str
    at: Point
    out: Point
    along: Point | None
    dimensions: dict[str, float]

    def is_that(self, found: Feature) -> bool:
        pose = found.shape_from_feature
        away = np.abs(pose[:3, 3] - self.at).max(), np.abs(pose[:3, 2] - self.out).max()
        along = 1.0 if self.along is None else abs(float(pose[:3, 0] @ self.along))
        measures = {name: value for name, (value, _) in found.dimensions.items()}
        sizes = measures.keys() == self.dimensions.keys() and all(
            abs(measures[name] - value) < NEAR for name, value in self.dimensions.items()
        )
        return bool(self.kind == found.kind and max(away) < NEAR and along > 1 - NEAR and sizes)


@dataclass
class Work(Part):
    known: list[Known] = field(default_factory=list)

    def say(self, kind: str, at: Point, out: Point = UP, along: Point | None = None, **dimensions: float) -> None:
        self.known.append(Known(kind, at, out, along, dimensions))

    def bore(self, mouth: Point, radius: float, depth: float, out: Point = UP) -> None:
        """A plain through hole."""
        start = np.array(mouth) - (depth + 1) * np.array(out)
        self.cut(cylinder(tuple(start.tolist()), radius, depth + 2, out))
        self.say("through_hole", mouth, out, diameter=2 * radius, depth=depth)


def sunk_block() -> Work:
    """Countersunk hole, pockets of three sides and with islands, a hexagonal duct, bosses, a rib, a ring, a slot."""
    t = 30.0
    part = Work(box((0, 0, 0), (260, 160, t)))
    part.cut(cone((15, 15, t - 4 * sqrt(3)), 4, 8, 4 * sqrt(3)), cylinder((15, 15, -1), 4, 99))
    part.say("through_hole", (15, 15, t), diameter=8, depth=t, countersink_diameter=16, countersink_angle=pi / 3)
    part.cut(prism([(30, 22, 22), (66, 22, 22), (44, 32, 22)], (0, 0, 99)))
    part.say("pocket", (48, 27, 22), UP, X, length=36, width=10, depth=8)
    part.cut(prism([(90 + 12 * cos(a), 30 + 12 * sin(a), -1) for a in 2 * pi * np.arange(6) / 6], (0, 0, 99)))
    part.say("duct", (90, 30, t), UP, length=24, width=12 * sqrt(3), depth=t)
    tool = Part(round_box((130, 15, 18), (210, 65, 99), 6))
    tool.cut(cylinder((150, 40, 0), 7, 99), box((175, 35, 0), (190, 45, 26)))
    part.cut(tool.body)
    part.say("pocket", (170, 40, 18), UP, X, length=80, width=50, depth=12, corner_radius=6)
    part.say("boss", (150, 40, 18), diameter=14, height=12)
    part.say("boss", (182.5, 40, 18), UP, X, length=15, width=10, height=8)
    part.bore((200, 25, 18), 3, 18)
    for turn in (0.0, pi):  # a hole in two halves, one after the other
        part.cut(carried(BRepPrimAPI_MakeCylinder(5.0, 40.0, pi).Shape(), pose_of((230, 40, -1), (0, 0, turn))))
    part.say("through_hole", (230, 40, t), diameter=10, depth=t)
    part.fuse(cylinder((40, 110, t), 12, 15), round_box((80, 95, t - 1), (120, 119, t + 10), 5))
    foot = lambda a, b: all(abs(np.hypot(p[0] - 40, p[1] - 110) - 12) + abs(p[2] - t) < 1e-6 for p in (a, b))  # noqa: E731
    part.body = fillet(part.body, 2.0, foot)
    part.say("boss", (40, 110, t), diameter=24, height=15, fillet_radius=2)
    part.say("boss", (100, 107, t), UP, X, length=40, width=24, height=10)
    part.fuse(box((20, 140, t), (100, 144, t + 12)))
    part.say("rib", (60, 142, t), UP, X, thickness=4, length=80, height=12)
    part.fuse(box((205, 145, t), (255, 151, t + 3)))
    part.say("rib", (230, 148, t), UP, X, thickness=6, length=50, height=3)
    for x in (160.0, 174.0, 188.0):
        for y in (100.0, 111.0):
            part.bore((x, y, t), 2, t)
    part.say(
        "grid_pattern", (174, 105.5, t), UP, X, count=6, rows=2, columns=3, pitch=14, row_pitch=11, hole_diameter=4
    )
    ring = Part(cylinder((230, 120, 24), 15, 99))
    ring.cut(cylinder((230, 120, 0), 11, 99))
    part.cut(ring.body, obround((150, 140, 20), 40, 10, 99))
    part.say("groove", (230, 120, 24), diameter=30, width=4, depth=6)
    part.say("slot", (150, 140, 20), UP, X, length=40, width=10, depth=10)
    return part


def slotted_block() -> Work:
    """Slots open at one side or two with flat, round and pointed sections, steps along edges and at corners."""
    h, w = 50.0, 100.0
    part = Work(box((0, 0, 0), (300, w, h)))
    part.cut(prism([(28, -1, h), (52, -1, h), (43, -1, h - 16)], (0, w + 2, 0)))
    part.say("open_slot", (40, 50, h - 16), UP, Y, length=w, width=24, depth=16, angle=atan2(15, 16) + atan2(9, 16))
    part.cut(box((70, -1, h - 15), (90, w + 1, h + 1)))
    part.say("open_slot", (80, 50, h - 15), UP, Y, length=w, width=20, depth=15)
    part.cut(cylinder((125, -1, h + 4), 12, w + 2, Y))
    part.say("open_slot", (125, 50, h - 8), UP, Y, length=w, width=2 * sqrt(128), depth=8, fillet_radius=12)
    part.cut(box((155, -1, h - 12), (175, 40, h + 1)))
    part.say("open_slot", (165, 20, h - 12), UP, Y, length=40, width=20, depth=12)
    part.cut(box((197, -1, h - 10), (213, 42, h + 1)), cylinder((205, 42, h - 10), 8, 11))
    part.say("open_slot", (205, 25, h - 10), UP, Y, length=50, width=16, depth=10)
    part.cut(box((238, -1, h - 15), (252, 45, h + 1)), cylinder((238, 45, h), 15, 14, X))  # as a disc cutter leaves it
    part.say("open_slot", (245, 22.5, h - 15), UP, Y, length=45, width=14, depth=15, fillet_radius=15)
    part.cut(box((276, 60, 20), (301, 70, 60)))
    part.say("open_slot", (276, 65, 35), X, UP, length=30, width=10, depth=24)
    part.cut(prism([(-1, y, z) for y, z in ((-1, -1), (13, -0.5), (10, 7), (-1, 7))], (302, 0, 0)))
    part.say("step", (150, 5, 7), DOWN, X, length=300, width=10, depth=7)
    # Two planes that lean back: the greater is the floor, from (91, 0) to (95, 6), and the other rises to (100, 8).
    part.cut(prism([(-1, y, z) for y, z in ((101, -1), (91, -1), (91, 0), (95, 6), (100, 8), (101, 8))], (302, 0, 0)))
    lean = sqrt(52)
    part.say("step", (150, 93, 3), (0, 6 / lean, -4 / lean), X, length=300, width=lean, depth=22 / lean)
    part.cut(box((-1, -1, h - 7), (15, 12, h + 1)), cylinder((0, w, h - 6), 14, 9))
    part.say("step", (7.5, 6, h - 7), UP, X, length=15, width=12, depth=7)
    part.cut(box((285, -1, h - 8), (301, 20, h + 1)))
    part.say("step", (292.5, 10, h - 8), UP, Y, length=20, width=15, depth=8)
    part.say("step", (7, 93, h - 6), length=14, width=14, depth=6, corner_radius=14)
    return part


def bevelled_block() -> Work:
    """A chamfer, a round, and slots that are wider or narrower below: of a T, a dovetail and with a draft."""
    part = Work(box((0, 0, 0), (120, 60, 20)))
    part.body = chamfer(part.body, 3, between((0, 0, 20), (120, 0, 20)))
    part.say("chamfer", (60, 1.5, 18.5), (0, -sqrt(0.5), sqrt(0.5)), X, width=3 * sqrt(2), length=120, angle=pi / 4)
    part.body = fillet(part.body, 4, between((0, 60, 20), (120, 60, 20)))
    part.say("fillet", (60, 56, 16), (0, sqrt(0.5), sqrt(0.5)), X, radius=4, length=120)
    part.cut(box((-1, 20, 10), (121, 40, 21)), box((-1, 15, 10), (121, 45, 14)))
    part.say("open_slot", (60, 30, 10), UP, X, length=120, width=20, depth=10, undercut_width=30, undercut_depth=4)
    for x, low, high in ((40.0, 10, 5), (80.0, 3.5, 7.5)):
        part.cut(
            prism(
                [(x + s * half, -1, z) for s, half, z in ((-1, low, -1), (1, low, -1), (1, high, 7), (-1, high, 7))],
                (0, 62, 0),
            )
        )
    part.say("open_slot", (40, 30, 7), DOWN, Y, length=60, width=10, depth=7, draft_angle=atan2(5, 8))
    part.say("open_slot", (80, 30, 7), DOWN, Y, length=60, width=8, depth=7, undercut_width=15, angle=atan2(8, 4))
    return part


def shaft() -> Work:
    """Journals beside a collar with a bolt circle; groove, keyseat, open keyway, hole across, drilled end."""
    part = Work(
        revolved([(0, 0), (12, 0), (12, 30), (20, 30), (20, 70), (45, 70), (45, 80), (22, 80), (22, 130), (0, 130)])
    )
    part.say("flange", (0, 0, 70), diameter=90, thickness=10)
    part.body = chamfer(
        part.body, 1.5, lambda a, b: all(abs(p[2]) < 1e-6 and abs(np.hypot(p[0], p[1]) - 12) < 1e-6 for p in (a, b))
    )
    part.say("chamfer", (0, 0, 0.75), DOWN, width=1.5 * sqrt(2), diameter=24, angle=pi / 4)
    ring = Part(cylinder((0, 0, 10), 15, 2))
    ring.cut(cylinder((0, 0, 0), 11, 99))
    part.cut(ring.body)
    part.say("groove", (0, 0, 11), diameter=22, width=2, depth=1)
    part.say("boss", (0, 0, 30), DOWN, diameter=24, height=30)
    part.say("boss", (0, 0, 70), DOWN, diameter=40, height=40)
    part.say("boss", (0, 0, 80), diameter=44, height=50)
    part.cut(carried(obround((0, 0, 0), 28, 6, 99), pose_of((17, 0, 50), QUARTER)), box((18, -3, 110), (40, 3, 131)))
    part.say("slot", (17, 0, 50), X, UP, length=28, width=6, depth=3)
    part.say("open_slot", (18, 0, 120), X, UP, length=20, width=6, depth=sqrt(22**2 - 3**2) - 18)
    part.bore((0, 20, 40), 2.5, 40, Y)
    tip = BRepPrimAPI_MakeCone(gp_Ax2(gp_Pnt(0, 0, 105), gp_Dir(0, 0, -1)), 6, 0, 6 / tan(pi / 3)).Shape()
    part.cut(cylinder((0, 0, 105), 6, 99), tip)
    part.say("blind_hole", (0, 0, 130), diameter=12, depth=25, tip_angle=2 * pi / 3)
    for a in 2 * pi * np.arange(5) / 5 + 0.3:
        part.bore((34 * cos(a), 34 * sin(a), 80), 3.5, 10)
    part.say("circular_pattern", (0, 0, 80), count=5, pattern_diameter=68, hole_diameter=7)
    return part


def bracket() -> Work:
    """A foot and an upright with gussets between them, and a rounded corner."""
    part = Work(box((0, 0, 0), (100, 120, 10)))
    part.fuse(box((0, 0, 0), (10, 120, 90)))
    for y in (20.0, 95.0):
        part.fuse(prism([(10, y, 10), (40, y, 10), (10, y, 35)], (0, 5, 0)))
        part.say("rib", (25, y + 2.5, 10), UP, X, thickness=5, length=30, height=25)
    part.bore((80, 30, 10), 5, 10)
    part.cut(cylinder((80, 60, -1), 5, 99), cone((80, 60, 7.5), 5, 7.5, 2.5))
    part.say("through_hole", (80, 60, 10), diameter=10, depth=10, countersink_diameter=15, countersink_angle=pi / 2)
    part.bore((80, 90, 10), 5, 10)
    part.say("flange", (5, 60, 10), UP, Y, thickness=10, length=120, height=80)
    part.body = fillet(part.body, 3, between((100, 0, 0), (100, 0, 10)))
    part.say("fillet", (97, 3, 5), (sqrt(0.5), -sqrt(0.5), 0), UP, radius=3, length=10)
    return part


def lever() -> Work:
    """A block with a lug at either end, a row of holes, and a pad around a bore."""
    part = Work(box((0, 0, 0), (100, 80, 24)))
    for root, x, r, thick in ((0.0, -30.0, 16.0, 10.0), (100.0, 125.0, 20.0, 14.0)):
        low = (24 - thick) / 2
        a, b = sorted((root - (x > 0) * 5 + (x < 0) * 5, x))
        arm = Part(box((a, 40 - r, low), (b, 40 + r, low + thick)))
        arm.fuse(cylinder((x, 40, low), r, thick))
        part.fuse(arm.body)
        part.bore((x, 40, low + thick), r / 2, thick)
        part.say("lug", (x, 40, low + thick), UP, X, bore_diameter=r, width=2 * r, thickness=thick)
    for x in (20.0, 35.0, 50.0, 65.0):
        part.bore((x, 20, 24), 3, 24)
    part.say("linear_pattern", (42.5, 20, 24), UP, X, count=4, pitch=15, hole_diameter=6)
    part.fuse(cylinder((84, 5, 12), 9, 10, (0, -1, 0)))
    part.say("boss", (84, 0, 12), (0, -1, 0), diameter=18, height=5)
    part.bore((84, 80, 12), 4, 85, Y)
    return part


def drum() -> Work:
    """A thick cup: radial holes, one counterbored from outside, a slot through its wall, one across its foot."""
    part = Work(cylinder((0, 0, 0), 45, 80))
    part.cut(cylinder((0, 0, 12), 25, 99))
    part.say("blind_hole", (0, 0, 80), diameter=50, depth=68)
    part.cut(box((-60, -5, -1), (60, 5, 5)))
    part.say("open_slot", (0, 0, 5), DOWN, X, length=90, width=10, depth=5)
    wall = 45 - sqrt(25**2 - 4**2)
    part.cut(cylinder((0, 0, 65), 4, 60, X), cylinder((0, 0, 40), 4, 60, Y), cylinder((0, 38, 40), 7, 20, Y))
    part.say("through_hole", (45, 0, 65), X, diameter=8, depth=wall)
    part.say("through_hole", (0, 45, 40), Y, diameter=8, depth=wall, counterbore_diameter=14, counterbore_depth=7)
    part.cut(carried(obround((0, 0, 0), 26, 8, 60), pose_of((0, 0, 45), QUARTER.T)))
    part.say("slot", (-45, 0, 45), (-1, 0, 0), UP, length=26, width=8, depth=wall)
    return part


def cam() -> Work:
    """A disc with kidney slots, one of them sunk, and a hub bore with a keyway."""
    part = Work(cylinder((0, 0, 0), 70, 14))
    for start, sweep, depth in ((0.2, 0.8, 14.0), (2.4, 1.0, 6.0)):
        low = 14 - depth - (depth == 14)
        tool = Part(carried(revolved([(35, low), (45, low), (45, 15), (35, 15)], sweep), pose_of(turn=(0, 0, start))))
        tool.fuse(*(cylinder((40 * cos(a), 40 * sin(a), low), 5, 15 - low) for a in (start, start + sweep)))
        part.cut(tool.body)
        a = start + sweep / 2
        z = 14 - depth if depth < 14 else 14
        part.say(
            "slot",
            (40 * cos(a), 40 * sin(a), z),
            UP,
            (-sin(a), cos(a), 0),
            bend_radius=40,
            length=40 * sweep + 10,
            width=10,
            depth=depth,
        )
    part.bore((0, 0, 14), 13, 14)
    part.cut(box((0, -2.5, -1), (15.5, 2.5, 15)))
    part.say("open_slot", (15.5, 0, 7), (-1, 0, 0), UP, length=14, width=5, depth=15.5 - sqrt(13**2 - 2.5**2))
    return part


def housing() -> Work:
    """A block on feet: a stepped bearing seat with a groove for a ring, and a lubrication hole into it."""
    part = Work(box((-70, -65, 0), (70, 65, 50)))
    part.fuse(box((-95, -65, 0), (95, 65, 12)))
    for side in (-1.0, 1.0):
        part.bore((side * 82.5, 30, 12), 4.5, 12)
        part.say("step", (side * 70, 0, 31), (side, 0, 0), Y, length=130, width=38, depth=25)
    part.cut(cylinder((0, 0, 20), 30, 99), cylinder((0, 0, -1), 18, 99))
    part.cut(revolved([(0, 42), (32, 42), (32, 44), (0, 44)]))
    sizes: dict[str, Any] = {
        "counterbore_diameter": 60.0,
        "counterbore_depth": 30.0,
        "groove_diameter": 64.0,
        "groove_width": 2.0,
    }
    part.say("through_hole", (0, 0, 50), diameter=36, depth=50, **sizes)
    part.cut(cylinder((0, -66, 28), 3, 50, Y))
    inside = sqrt(30**2 - 3**2)
    part.say("through_hole", (0, -inside, 28), Y, diameter=6, depth=65 - inside)
    return part


def pocketed_plate() -> Work:
    """Four pockets about two ribs that cross, the web under them, and an elliptic duct through it."""
    part = Work(box((0, 0, 0), (200, 120, 40)))
    for x in (10.0, 103.0):
        for y in (10.0, 63.0):
            part.cut(round_box((x, y, 6), (x + 87, y + 47, 99), 8))
            middle = x + 43.5, y + 23.5
            part.say("pocket", (*middle, 6), UP, X, length=87, width=47, depth=34, corner_radius=8)
            part.say("web", (*middle, 3), UP, X, thickness=6, length=87, width=47)
    for x, y, along, length in ((100, 5, X, 164), (100, 115, X, 164), (5, 60, Y, 84), (195, 60, Y, 84)):
        part.say("flange", (x, y, 6), UP, along, thickness=10, length=length, height=34)
    part.say("rib", (100, 60, 6), UP, X, thickness=6, length=164, height=34)  # between the rounds of the corners
    part.say("rib", (100, 60, 6), UP, Y, thickness=6, length=84, height=34)
    oval = gp_Elips(gp_Ax2(gp_Pnt(50, 33, -1), gp_Dir(0, 0, 1)), 20, 12)
    wire = BRepBuilderAPI_MakeWire(BRepBuilderAPI_MakeEdge(oval).Edge()).Wire()
    part.cut(BRepPrimAPI_MakePrism(BRepBuilderAPI_MakeFace(wire).Face(), gp_Vec(0, 0, 99)).Shape())
    part.say("duct", (50, 33, 0), DOWN, X, major_diameter=40, minor_diameter=24, depth=6)
    return part


PARTS = (sunk_block, slotted_block, bevelled_block, pocketed_plate, shaft, bracket, lever, drum, cam, housing)
