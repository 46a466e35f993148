"""Rails: slots and steps of every section across a bar."""

from __future__ import annotations

import numpy as np

from tests.parts.seat_parts.seats import FAR, Rng, uniform
from tests.parts.solids import Part, box, cylinder, fillet, prism


def rail(rng: Rng) -> Part:
    """A bar with slots of many sections across it."""
    wide, t = uniform(rng, 50, 80), uniform(rng, 35, 50)
    count = 4
    pitch = 60.0
    long = count * pitch + 20
    part = Part(box((0, 0, 0), (long, wide, t)))
    for k in rng.permutation(count).tolist():
        SECTIONS[rng.integers(len(SECTIONS))](part, rng, 40.0 + pitch * k, wide, t)
    return part


def _across(part: Part, section: list[tuple[float, float]], x: float, wide: float) -> None:
    part.cut(prism([(x + a, -1, z) for a, z in section], (0, wide + 2, 0)))


def square_slot(part: Part, rng: Rng, x: float, wide: float, t: float) -> None:
    w, d = uniform(rng, 6, 25), uniform(rng, 5, 0.6 * t)
    _across(part, [(-w / 2, t + 1), (w / 2, t + 1), (w / 2, t - d), (-w / 2, t - d)], x, wide)
    part.know("open_slot", (x, wide / 2, t - d), length=wide, width=w, depth=d)


def v_slot(part: Part, rng: Rng, x: float, wide: float, t: float) -> None:
    half, d = float(np.radians(uniform(rng, 25, 50))), uniform(rng, 6, 16)
    w, k = 2 * d * float(np.tan(half)), (d + 1) / d
    _across(part, [(-w * k / 2, t + 1), (w * k / 2, t + 1), (0, t - d)], x, wide)
    part.know("open_slot", (x, wide / 2, t - d), length=wide, width=w, depth=d, angle=2 * half)


def t_slot(part: Part, rng: Rng, x: float, wide: float, t: float) -> None:
    w, neck = uniform(rng, 7, 14), uniform(rng, 5, 10)
    broad, tall = w * uniform(rng, 1.5, 2.2), uniform(rng, 5, 10)
    d = neck + tall
    section = [(-w / 2, t + 1), (w / 2, t + 1), (w / 2, t - neck), (broad / 2, t - neck), (broad / 2, t - d)]
    section += [(-broad / 2, t - d), (-broad / 2, t - neck), (-w / 2, t - neck)]
    _across(part, section, x, wide)
    more = {"undercut_width": broad, "undercut_depth": tall}
    part.know("open_slot", (x, wide / 2, t - d), length=wide, width=w, depth=d, **more)


def dovetail(part: Part, rng: Rng, x: float, wide: float, t: float) -> None:
    lean, d = float(np.radians(rng.choice([45, 55, 60]))), uniform(rng, 5, 14)
    w = uniform(rng, 12, 22)
    more = d / float(np.tan(lean))
    k = 1 / float(np.tan(lean))
    section = [(-w / 2 + k, t + 1), (w / 2 - k, t + 1), (w / 2 + more, t - d), (-w / 2 - more, t - d)]
    _across(part, section, x, wide)
    part.know("open_slot", (x, wide / 2, t - d), length=wide, width=w, depth=d, undercut_width=w + 2 * more, angle=lean)


def ball_slot(part: Part, rng: Rng, x: float, wide: float, t: float) -> None:
    """With a round bottom: walls and a half cylinder, or an arc alone."""
    r = uniform(rng, 4, 12)
    if rng.random() < 0.5:
        d = r + uniform(rng, 2, 10)
        _across(part, [(-r, t + 1), (r, t + 1), (r, t - d + r), (-r, t - d + r)], x, wide)
        part.cut(cylinder((x, -1, t - d + r), r, wide + 2, (0, 1, 0)))
        w = 2 * r
    else:
        d = r * uniform(rng, 0.3, 0.7)
        part.cut(cylinder((x, -1, t - d + r), r, wide + 2, (0, 1, 0)))
        w = 2 * (r**2 - (r - d) ** 2) ** 0.5
    part.know("open_slot", (x, wide / 2, t - d), length=wide, width=w, depth=d, fillet_radius=r)


def round_end(part: Part, rng: Rng, x: float, wide: float, t: float) -> None:
    """From one side, with a half round end; blind or through."""
    w, reach = uniform(rng, 8, 20), wide * uniform(rng, 0.4, 0.7)
    through_ = rng.random() < 0.5
    d = t if through_ else uniform(rng, 5, 0.6 * t)
    low = t - d - (1 if through_ else 0)
    part.cut(box((x - w / 2, -1, low), (x + w / 2, reach - w / 2, t + 1)))
    part.cut(cylinder((x, reach - w / 2, low), w / 2, FAR))
    if through_:
        at = (x, reach, t / 2)
        part.know("open_slot", at, length=t, width=w, depth=reach, fillet_radius=w / 2)
    else:
        part.know("open_slot", (x, reach / 2, t - d), length=reach, width=w, depth=d)


def notch(part: Part, rng: Rng, x: float, wide: float, t: float) -> None:
    """From one side, square, with rounded inner corners or not."""
    w, reach = uniform(rng, 8, 30), wide * uniform(rng, 0.3, 0.7)
    d = uniform(rng, 5, min(0.6 * t, 0.9 * reach))
    corner = float(rng.choice([0.0, 0.2])) * w
    tool = box((x - w / 2, -1, t - d), (x + w / 2, reach, t + 1))
    if corner:
        tool = fillet(tool, corner, lambda a, b: bool(abs(a[2] - b[2]) > 1e-6 and abs(a[1] - reach) < 1e-6))
    part.cut(tool)
    more = {"corner_radius": corner} if corner else {}
    part.know("open_slot", (x, reach / 2, t - d), length=reach, width=w, depth=d, **more)


def blind_step(part: Part, rng: Rng, x: float, wide: float, t: float) -> None:
    """A wide ledge from one side, closed at both ends; its depth is the lesser of its two."""
    w, reach, d = uniform(rng, 30, 45), wide * uniform(rng, 0.2, 0.3), uniform(rng, 5, 0.6 * t)
    part.cut(box((x - w / 2, -1, t - d), (x + w / 2, reach, t + 1)))
    if d < reach:
        part.know("open_slot", (x, reach / 2, t - d), length=reach, width=w, depth=d)
    else:
        part.know("open_slot", (x, reach, t - d / 2), length=d, width=w, depth=reach)


SECTIONS = (square_slot, v_slot, t_slot, dovetail, ball_slot, round_end, notch, blind_step)
