"""Parts of the vocabulary of published benchmarks of machining features: passages, pockets, blind and through slots and
steps of several sections, rings, chamfers, rounds, in a block of stock.

After A. R. Colligan et al., "Hierarchical CADNet: learning from B-reps for machining feature recognition",
Computer-Aided Design 147, 2022, which names 24 classes; here each is called what `feature_class.kind` calls it.
"""

from __future__ import annotations

from math import cos, pi, sin
from typing import Any

import numpy as np
from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut

from tests.parts.brackets_and_drums import UP, bore, chance, fused, moved, placed, rod, twist_drill, u
from tests.parts.housings_and_shafts import Work
from tests.parts.solids import Floats, Rng, between, box, chamfer, cylinder, fillet, obround, prism

LENGTH, WIDTH, HEIGHT = 260.0, 100.0, 50.0


def vocabulary(seed: int) -> Work:
    """The part of a seed."""
    rng = np.random.default_rng(60_000 + seed)
    work = Work(box((0, 0, 0), (LENGTH, WIDTH, HEIGHT)), silent=Work.silent - {"fillet", "chamfer"})
    for x, which in zip((70.0, 130.0, 190.0), rng.permutation(len(IN_A_FACE)).tolist(), strict=False):
        IN_A_FACE[which](work, rng, x)
    for side, which in zip((0, 1), rng.permutation(len(ON_AN_EDGE)).tolist(), strict=False):
        ON_AN_EDGE[which](work, rng, side)
    corners = [(x, y) for x in (0.0, LENGTH) for y in (0.0, WIDTH)]
    for (x, y), which in zip(corners, rng.integers(0, len(AT_A_CORNER) + 1, 4).tolist(), strict=True):
        if which < len(AT_A_CORNER):
            AT_A_CORNER[which](work, rng, x, y)
    return placed(work, rng) if chance(rng) else work


def polygon(n: int, r: float, x: float, y: float, low: float, turn: float) -> Any:
    ring = [2 * pi * k / n + turn for k in range(n)]
    return prism([(x + r * cos(a), y + r * sin(a), low) for a in ring], (0, 0, 100))


def _through_hole(work: Work, rng: Rng, x: float) -> None:
    bore(work, (x, 50, 0), UP, u(rng, 3, 15), HEIGHT)


def _blind_hole(work: Work, rng: Rng, x: float) -> None:
    r, d = u(rng, 3, 15), u(rng, 10, 30)
    if chance(rng):
        twist_drill(work, (x, 50, HEIGHT), (0, 0, -1), min(r, 8), d)
    else:
        work.cut(rod((x, 50, HEIGHT - d), UP, r, 100))
        work.note("blind_hole", (x, 50, HEIGHT), out=UP, diameter=2 * r, depth=d)


def _ring(work: Work, rng: Rng, x: float) -> None:
    r, w, d = u(rng, 12, 22), u(rng, 2, 5), u(rng, 3, 10)
    tool = BRepAlgoAPI_Cut(cylinder((x, 50, HEIGHT - d), r, d + 1), cylinder((x, 50, 0), r - w, 100)).Shape()
    work.cut(tool)
    work.note("groove", (x, 50, HEIGHT - d), out=UP, width=w, depth=d)


def _passage(n: int) -> Any:
    def cut(work: Work, rng: Rng, x: float) -> None:
        r = u(rng, 10, 22)
        work.cut(polygon(n, r, x, 50, -10, u(rng, 0, 6)))
        work.note("duct", axis=UP, depth=HEIGHT)

    return cut


def _sunk(n: int) -> Any:
    def cut(work: Work, rng: Rng, x: float) -> None:
        r, d = u(rng, 10, 22), u(rng, 5, 30)
        work.cut(polygon(n, r, x, 50, HEIGHT - d, u(rng, 0, 6)))
        work.note("pocket", out=UP, depth=d)

    return cut


def _round_ended(work: Work, rng: Rng, x: float) -> None:
    s, w, d = u(rng, 25, 70), u(rng, 8, 20), u(rng, 5, 25)
    work.cut(moved(obround((0, 0, 0), s, w, 100), pi / 2, by=(x, 50, HEIGHT - d)))
    work.note("slot", (x, 50, HEIGHT - d), out=UP, along=(0, 1, 0), length=s, width=w, depth=d)


def _v_slot(work: Work, rng: Rng, x: float) -> None:
    w, d, skew = u(rng, 10, 30), u(rng, 5, 25), u(rng, -4, 4)
    work.cut(prism([(x - w / 2, -1, HEIGHT), (x + w / 2, -1, HEIGHT), (x + skew, -1, HEIGHT - d)], (0, 102, 0)))
    work.note("open_slot", out=UP, along=(0, 1, 0), length=WIDTH, width=w, depth=d)


def _square_slot(work: Work, rng: Rng, x: float) -> None:
    w, d = u(rng, 8, 40), u(rng, 5, 25)
    work.cut(box((x - w / 2, -1, HEIGHT - d), (x + w / 2, 101, HEIGHT + 1)))
    work.note("open_slot", (x, 50, HEIGHT - d), out=UP, along=(0, 1, 0), length=WIDTH, width=w, depth=d)


def _round_slot(work: Work, rng: Rng, x: float) -> None:
    r, above = u(rng, 8, 18), u(rng, 0, 5)
    work.cut(rod((x, -1, HEIGHT + above), (0, 1, 0), r, 102))
    w = 2 * (r * r - above * above) ** 0.5
    work.note("open_slot", (x, 50, HEIGHT + above - r), out=UP, along=(0, 1, 0), length=WIDTH, width=w, depth=r - above)


def _blind_slot(work: Work, rng: Rng, x: float) -> None:
    w, reach, d = u(rng, 8, 40), u(rng, 20, 80), u(rng, 5, 25)
    work.cut(box((x - w / 2, -1, HEIGHT - d), (x + w / 2, reach, HEIGHT + 1)))
    work.note("open_slot", (x, reach / 2, HEIGHT - d), out=UP, along=(0, 1, 0), length=reach, width=w, depth=d)


def _blind_slot_round_across(work: Work, rng: Rng, x: float) -> None:
    """Its end is a half cylinder, upright."""
    w, reach, d = u(rng, 8, 30), u(rng, 30, 80), u(rng, 5, 25)
    tool = box((x - w / 2, -1, HEIGHT - d), (x + w / 2, reach - w / 2, HEIGHT + 1))
    work.cut(fused(tool, cylinder((x, reach - w / 2, HEIGHT - d), w / 2, d + 1)))
    work.note("open_slot", out=UP, along=(0, 1, 0), length=reach, width=w, depth=d)


def _blind_slot_round_down(work: Work, rng: Rng, x: float) -> None:
    """Its floor rises in a quarter of a cylinder, as a disc cutter leaves it."""
    w, reach, d = u(rng, 8, 40), u(rng, 30, 70), u(rng, 8, 25)
    tool = box((x - w / 2, -1, HEIGHT - d), (x + w / 2, reach, HEIGHT + 1))
    work.cut(fused(tool, cylinder((x - w / 2, reach, HEIGHT), d, w, (1, 0, 0))))
    work.note("open_slot", out=UP, along=(0, 1, 0), width=w, depth=d)


IN_A_FACE = (
    _through_hole,
    _blind_hole,
    _ring,
    _passage(3),
    _passage(4),
    _passage(6),
    _sunk(3),
    _sunk(4),
    _sunk(6),
    _round_ended,
    _v_slot,
    _square_slot,
    _round_slot,
    _blind_slot,
    _blind_slot_round_across,
    _blind_slot_round_down,
)


def _along_edge(work: Work, side: int, outline: list[tuple[float, float]]) -> None:
    """Cuts off a lower edge what has an outline of (into the width, up), from the edge on."""
    at = [(-1.0, WIDTH - p if side else p, q) for p, q in [(-1.0, -1.0), *outline]]
    work.cut(prism(at, (LENGTH + 2, 0, 0)))


def _square_step(work: Work, rng: Rng, side: int) -> None:
    p, q = u(rng, 5, 12), u(rng, 4, 12)
    _along_edge(work, side, [(p, -1), (p, q), (-1, q)])
    work.note("step", along=(1, 0, 0), length=LENGTH)


def _slanted_step(work: Work, rng: Rng, side: int) -> None:
    """One of its two planes is square to the stock, the other leans back."""
    p, q, lean = u(rng, 8, 12), u(rng, 4, 10), u(rng, 1, 5)
    _along_edge(work, side, [(p + lean, -lean / 5), (p, q), (-1, q)])
    work.note("step", along=(1, 0, 0), length=LENGTH)


def _two_sided_step(work: Work, rng: Rng, side: int) -> None:
    """Both planes lean back."""
    p, q = u(rng, 8, 12), u(rng, 7, 10)  # flatter, it is a bent face
    _along_edge(work, side, [(p + 1, -1), (p, 0), (p - 4, q - 2), (0, q), (-1, q)])
    work.note("step", along=(1, 0, 0), length=LENGTH)


def _lower_edge(side: int) -> Any:
    y = WIDTH if side else 0.0
    whole = between((0, y, 0), (LENGTH, y, 0))

    def wanted(a: Floats, b: Floats) -> bool:
        return bool(whole(a, b) or (abs(a[1] - y) + abs(b[1] - y) + abs(a[2]) + abs(b[2]) < 1e-6))

    return wanted


def _chamfer(work: Work, rng: Rng, side: int) -> None:
    k = u(rng, 2, 4)
    work.body = chamfer(work.body, k, _lower_edge(side))
    work.note("chamfer", along=(1, 0, 0), length=LENGTH, width=k * 2**0.5)


def _round(work: Work, rng: Rng, side: int) -> None:
    r = u(rng, 2, 4)
    work.body = fillet(work.body, r, _lower_edge(side))
    work.note("fillet", radius=r, length=LENGTH)


ON_AN_EDGE = (_square_step, _slanted_step, _two_sided_step, _chamfer, _round)


def _corner(work: Work, tool: Any, x: float, y: float, d: float) -> None:
    work.cut(moved(tool, by=(x, y, HEIGHT - d)))
    work.note("step", out=UP, depth=d)


def _square_corner(work: Work, rng: Rng, x: float, y: float) -> None:
    p, q, d = u(rng, 10, 25), u(rng, 10, 25), u(rng, 5, 9)
    _corner(work, box((-p, -q, 0), (p, q, 99)), x, y, d)


def _three_sided_corner(work: Work, rng: Rng, x: float, y: float) -> None:
    p, q, d = u(rng, 15, 25), u(rng, 15, 25), u(rng, 5, 9)
    tool = prism([(-p, 0, 0), (0, -q, 0), (p, 0, 0), (0, q, 0)], (0, 0, 99))
    _corner(work, tool, x, y, d)


def _round_corner(work: Work, rng: Rng, x: float, y: float) -> None:
    r, d = u(rng, 12, 25), u(rng, 5, 9)
    _corner(work, cylinder((0, 0, 0), r, 99), x, y, d)


AT_A_CORNER = (_square_corner, _three_sided_corner, _round_corner)
