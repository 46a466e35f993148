"""Blocks into which eight operations are cut at random places of random faces, whatever they cut into.

A feature is known where so much of every face of its tool is left that an engineer still sees it: samples of the faces
that no other tool has cut away.  What of it is stated is what survives: diameter and axis, width and depth.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from OCP.BRepAdaptor import BRepAdaptor_Surface
from OCP.BRepClass import BRepClass_FaceClassifier
from OCP.BRepClass3d import BRepClass3d_SolidClassifier
from OCP.gp import gp_Pnt, gp_Pnt2d
from OCP.TopAbs import TopAbs_FACE, TopAbs_IN
from OCP.TopExp import TopExp_Explorer
from OCP.TopoDS import TopoDS

from tests.parts.brackets_and_drums import chance, moved, u
from tests.parts.flanges_and_housings import Made, Work
from tests.parts.solids import Point, Rng, box, cylinder, fillet, obround, upright

SIZE = np.array([120.0, 100.0, 80.0])
OPERATIONS = 8
LEFT = 0.6  # share of each face of a tool that is left of what can be seen
SAMPLES = 7


@dataclass
class Cut:
    """A tool that stands on the plane z = 0 of its own frame, cuts below it, and what it makes there."""

    tool: Any
    kind: str
    dimensions: dict[str, float] = field(default_factory=dict)
    either_way: bool = False


def crowd(seed: int) -> Work:
    """The part of a seed."""
    rng = np.random.default_rng(70_000 + seed)
    work = Work(box((0, 0, 0), tuple(SIZE.tolist())))
    made = [_placed(rng) for _ in range(OPERATIONS)]
    for tool, _ in made:
        work.cut(tool)
    inside = [BRepClass3d_SolidClassifier(tool) for tool, _ in made]
    for k, (tool, known) in enumerate(made):
        if _is_left(tool, [c for n, c in enumerate(inside) if n != k]):
            work.features.append(known)
        else:
            work.perhaps.append(replace(known, dimensions={}))
    return work


def _placed(rng: Rng) -> tuple[Any, Made]:
    """A cut in a random face; the axes of its frame are those of the block in turn."""
    up = int(rng.integers(0, 3))
    length, width, height = SIZE[(up + 1) % 3], SIZE[(up + 2) % 3], SIZE[up]
    cut = CUTS[rng.integers(len(CUTS))](rng, length, width, height)
    x, y = float(rng.uniform(0.25, 0.75)) * length, float(rng.uniform(0.25, 0.75)) * width
    tool, place, out = moved(cut.tool, by=(x, y, height)), np.array([x, y, height]), np.array([0.0, 0.0, 1.0])
    if chance(rng):  # from below
        tool = moved(tool, np.pi, (1, 0, 0), (0, width, height))
        place, out = np.array([x, width - y, 0]), -out
    if up < 2:
        tool = moved(tool, (up + 1) * 2 * np.pi / 3, (1, 1, 1))
        place, out = np.roll(place, up + 1), np.roll(out, up + 1)
    at: Point = tuple(place.tolist())
    if cut.kind in ("through_hole", "blind_hole"):
        axis: Point = tuple(np.abs(out).tolist())
        return tool, Made(cut.kind, (at,), cut.dimensions, axis=axis)
    return tool, Made(cut.kind, (), cut.dimensions, out=None if cut.either_way else tuple(out.tolist()))


def _is_left(tool: Any, others: list[Any]) -> bool:
    """Whether of each face of a tool that lies within the stock enough lies in no other tool."""
    faces = TopExp_Explorer(tool, TopAbs_FACE)
    while faces.More():
        face = TopoDS.Face(faces.Current())
        surface = BRepAdaptor_Surface(face)
        steps = (np.arange(SAMPLES) + 0.5) / SAMPLES
        seen = left = 0
        u0, u1 = surface.FirstUParameter(), surface.LastUParameter()
        v0, v1 = surface.FirstVParameter(), surface.LastVParameter()
        for s in (u0 + steps * (u1 - u0)).tolist():
            for t in (v0 + steps * (v1 - v0)).tolist():
                p = surface.Value(s, t)
                within = np.all(
                    (np.array([p.X(), p.Y(), p.Z()]) > 0.01) & (np.array([p.X(), p.Y(), p.Z()]) < SIZE - 0.01)
                )
                if within and BRepClass_FaceClassifier(face, gp_Pnt2d(s, t), 1e-6).State() == TopAbs_IN:
                    seen += 1
                    left += not any(_has(other, p) for other in others)
        if seen and left < LEFT * seen:
            return False
        faces.Next()
    return True


def _has(classifier: Any, point: gp_Pnt) -> bool:
    classifier.Perform(point, 1e-6)
    return bool(classifier.State() == TopAbs_IN)


def _through(rng: Rng, length: float, width: float, height: float) -> Cut:
    r = u(rng, 3, 10)
    return Cut(cylinder((0, 0, -height - 5), r, height + 10), "through_hole", {"diameter": 2 * r})


def _blind(rng: Rng, length: float, width: float, height: float) -> Cut:
    r, d = u(rng, 3, 10), u(rng, 10, 30)
    return Cut(cylinder((0, 0, -d), r, d + 5), "blind_hole", {"diameter": 2 * r})


def _pocket(rng: Rng, length: float, width: float, height: float) -> Cut:
    a, b, d, c = u(rng, 8, 22), u(rng, 8, 22), u(rng, 5, 25), u(rng, 2, 6)
    tool = box((-a, -b, -d), (a, b, 5))
    sizes = {"length": 2 * max(a, b), "width": 2 * min(a, b), "depth": d}
    if chance(rng):
        return Cut(fillet(tool, c, upright), "pocket", sizes | {"corner_radius": c})
    return Cut(tool, "pocket", sizes)


def _passage(rng: Rng, length: float, width: float, height: float) -> Cut:
    a, b, c = u(rng, 8, 20), u(rng, 8, 20), u(rng, 2, 6)
    sizes = {"length": 2 * max(a, b), "width": 2 * min(a, b), "corner_radius": c}
    return Cut(fillet(box((-a, -b, -height - 5), (a, b, 5)), c, upright), "duct", sizes, either_way=True)


def _slot(rng: Rng, length: float, width: float, height: float) -> Cut:
    s, w, d = u(rng, 25, 45), u(rng, 6, 18), u(rng, 5, 20)
    return Cut(obround((0, 0, -d), s, w, d + 5), "slot", {"length": s, "width": w, "depth": d})


def _across(rng: Rng, length: float, width: float, height: float) -> Cut:
    w, d = u(rng, 6, 25), u(rng, 5, 20)
    return Cut(box((-w / 2, -200, -d), (w / 2, 200, 5)), "open_slot", {"width": w, "depth": d})


CUTS = (_through, _blind, _pocket, _passage, _slot, _across)
