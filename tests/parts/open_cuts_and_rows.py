"""Plates with what runs out at their edges or repeats with gaps: steps with an angled wall, round cut-outs, slots in
line with each other, bolt circles of which some holes are left out.

The steps are those of published vocabularies (W. Cao et al., "Graph representation of 3D CAD models for machining
feature recognition with deep learning", DETC2020): floors along a whole edge whose wall is slanted to it, or which two
walls bound that meet in a hollow edge.
"""

from __future__ import annotations

from math import cos, pi, sin

import numpy as np

from tests.parts.brackets_and_drums import UP, chance, placed, rod, u
from tests.parts.housings_and_shafts import Work
from tests.parts.solids import Point, Rng, box, obround, prism

LENGTH, WIDTH, HEIGHT = 260.0, 160.0, 30.0
REAR: Point = (0.0, 1.0, 0.0)


def plate_with_open_cuts(seed: int) -> Work:
    """The part of a seed."""
    rng = np.random.default_rng(80_000 + seed)
    work = Work(box((0, 0, 0), (LENGTH, WIDTH, HEIGHT)), silent=frozenset())
    _step_along_an_edge(work, rng)
    _step_along_a_corner(work, rng)
    _round_cut_out(work, rng)
    _open_slots_in_line(work, rng)
    _closed_slots_in_line(work, rng)
    _bolt_circle(work, rng)
    return placed(work, rng) if chance(rng) else work


def _outline(rng: Rng, length: float, reach: float) -> list[tuple[float, float]]:
    """Of the floor of a step along an edge: slanted, or with two walls; (along the edge, into the material)."""
    low = reach * u(rng, 0.3, 0.7)
    if chance(rng):
        ends = [low, reach] if chance(rng) else [reach, low]
        return [(0, 0), (length, 0), (length, ends[1]), (0, ends[0])]
    return [(0, 0), (length, 0), (length, low), (length * u(rng, 0.3, 0.7), reach), (0, low)]


def _step_along_an_edge(work: Work, rng: Rng) -> None:
    d = u(rng, 4, 10)
    work.cut(prism([(x, y, HEIGHT - d) for x, y in _outline(rng, LENGTH, u(rng, 12, 26))], (0, 0, 99)))
    work.note("step", out=UP, depth=d)


def _step_along_a_corner(work: Work, rng: Rng) -> None:
    """Its floor is no longer than the plate is thick, its wall may slant by up to half a right angle."""
    d = u(rng, 4, 10)
    outline = _outline(rng, HEIGHT, u(rng, 15, 40))
    work.cut(prism([(LENGTH - q, WIDTH - d, p) for p, q in outline], (0, 99, 0)))
    work.note("step", out=REAR, depth=d)


def _round_cut_out(work: Work, rng: Rng) -> None:
    """Of little more than half a turn: the axis lies within the plate."""
    r, y = u(rng, 8, 20), 80.0
    within = r * u(rng, 0.1, 0.3)
    work.cut(rod((within, y, -1), UP, r, HEIGHT + 2))
    mouth = 2 * (r * r - within * within) ** 0.5
    work.note("open_slot", out=(-1, 0, 0), depth=within + r, width=mouth, undercut_width=2 * r, length=HEIGHT)


def _open_slots_in_line(work: Work, rng: Rng) -> None:
    """Of one section, from either side of the bottom, that do not meet."""
    w, d = u(rng, 8, 20), u(rng, 4, 9)
    for low, high in ((-1.0, u(rng, 20, 60)), (WIDTH - u(rng, 20, 60), WIDTH + 1)):
        work.cut(box((200 - w / 2, low, -1), (200 + w / 2, high, d)))
        ends = max(low, 0.0), min(high, WIDTH)
        middle = (200, sum(ends) / 2, d)
        length = ends[1] - ends[0]
        work.note("open_slot", middle, out=(0, 0, -1), along=REAR, length=length, width=w, depth=d)


def _closed_slots_in_line(work: Work, rng: Rng) -> None:
    """Through, end to end between the same two planes."""
    w = u(rng, 6, 12)
    for x in (60.0, 110.0):
        length = u(rng, 20, 40)
        work.cut(obround((x, 140, -1), length, w, HEIGHT + 2))
        work.note("slot", axis=UP, along=(1, 0, 0), length=length, width=w, depth=HEIGHT)


def _bolt_circle(work: Work, rng: Rng) -> None:
    """Some of its holes are left out."""
    places, r, ring = int(rng.integers(6, 13)), u(rng, 2, 4), u(rng, 25, 32)
    most = (places - 1) // 3
    left_out = set(rng.choice(places, int(rng.integers(0, most + 1)), replace=False).tolist())
    start = u(rng, 0, 6)
    for k in sorted(set(range(places)) - left_out):
        a = 2 * pi * k / places + start
        work.drill(100 + ring * cos(a), 80 + ring * sin(a), r, HEIGHT, 0.0)
    holes = places - len(left_out)
    work.note(
        "circular_pattern", (100, 80, HEIGHT), (100, 80, 0), count=holes, pattern_diameter=2 * ring, hole_diameter=2 * r
    )
