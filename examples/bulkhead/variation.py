"""Variants drawn from a seed: a few features of a design removed, moved, resized, plugged, added or turned."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from examples.bulkhead.design import Design
from examples.bulkhead.features import CLIP_THICKNESS, all_features, lug_centre

Box = tuple[float, float, float, float, float, float]
Amount = dict[str, Any]


@dataclass(frozen=True)
class Change:
    """What was done to one feature or component, and the boxes (part frame) that it takes up before and after."""

    name: str
    kind: str
    change: str
    amount: Amount
    before: Box | None
    after: Box | None


@dataclass(frozen=True)
class Variation:
    """A design, what of it is changed against its base, components left out and holes that a plug fills."""

    design: Design
    changes: tuple[Change, ...] = ()
    missing: frozenset[str] = frozenset()
    plugs: tuple[str, ...] = ()


@dataclass(frozen=True)
class Candidate:
    """A change that may be made: of this name, seen from these sides."""

    name: str
    kind: str
    change: str
    box: Box
    sides: tuple[str, ...] = field(default=("front", "back"))


def boxes(design: Design) -> dict[str, Box]:
    """Box of every feature and component that can be changed, by name."""
    out: dict[str, Box] = {}
    for feature in all_features(design):
        x0, y0, z0, x1, y1, z1 = feature.row()["box"]
        if feature.kind == "bolt_hole":
            name = feature.name.removeprefix("HOLE_")
            if not name.startswith("BOLT_"):  # CLIP_1_2 is the hole of CLIP_1/BOLT_2
                owner, _, number = name.rpartition("_")
                name, z1 = f"{owner}/BOLT_{number}", z1 + CLIP_THICKNESS
            out[name] = (x0 - 4.5, y0 - 4.5, z1 - 24, x1 + 4.5, y1 + 4.5, z1 + 8)
        else:
            out[feature.name] = (x0, y0, z0, x1, y1, z1)
    for name, clip in design.clips.items():
        (x, y), z = clip.centre, design.pockets[clip.pocket].web[1]
        out[name] = (x - 33, y - 33, z, x + 33, y + 33, z + 36)
    for name, lug in design.lugs.items():
        x, y = lug_centre(design, name)
        out[f"BUSHING_{name}"] = (x - 27, y - 27, lug.z[0], x + 27, y + 27, lug.z[1] + 3)
    return out


def candidates(design: Design) -> list[Candidate]:
    """Every change that could be made to a design."""
    out: list[Candidate] = []
    places = boxes(design)
    front, back = ("front",), ("back",)

    def add(name: str, kind: str, words: str, sides: tuple[str, ...] = ("front", "back")) -> None:
        out.extend(Candidate(name, kind, word, places[name], sides) for word in words.split())

    for name in design.holes:
        add(name, "hole", "removed moved resized plugged")
    for name in places:
        if "BOLT_" in name:
            add(name, "bolt", "missing", front)
    for name in design.flange_bolts:
        add(f"BOLT_{name}", "bolt", "added", front)
    for name in design.clips:
        add(name, "clip", "missing turned moved", front)
    for name in design.lugs:
        add(f"BUSHING_{name}", "bushing", "missing")
        add(name, "lug", "removed moved")
    for name in design.bosses:
        add(name, "boss", "removed moved resized", front)
    for name, cut in design.lowered.items():
        add(name, "lowered_rib", "removed moved resized", front if cut.front else back)
    for name, wall in design.walls.items():
        if not wall.edge and not name.startswith(("H", "S")):
            add(name, "rib", "moved resized")
    for name in design.ducts:
        add(name, "duct", "moved resized", front)
    for name in places:
        cell, _, side = name.partition(".")
        if side in ("front", "back"):
            add(name, "pocket", "resized deepened", front if side == "front" else back)
            assert cell in design.pockets
    return out


def draw_variation(base: Design, wanted: int, rng: np.random.Generator, seen: Callable[[Candidate], bool]) -> Variation:
    """Up to `wanted` changes of what is `seen`, clear of each other, each kind and word of change as likely.

    Raises ValueError or RuntimeError (the kernel's too, once the solid is made) where a change does not fit.
    """
    open_ = [c for c in candidates(base) if seen(c)]
    out = Variation(replace(base, name=f"{base.name}_changed"))
    while open_ and len(out.changes) < wanted:
        groups = sorted({(c.kind, c.change) for c in open_})
        group = groups[rng.integers(len(groups))]
        same = [c for c in open_ if (c.kind, c.change) == group]
        chosen = same[rng.integers(len(same))]
        out = apply_change(out, chosen, rng)
        open_ = [c for c in open_ if not _touch(c.box, chosen.box)]
    return out


def _touch(a: Box, b: Box, gap: float = 12.0) -> bool:
    """Whether two boxes come within a gap of each other in the plan."""
    return all(a[i] - gap < b[i + 3] and b[i] - gap < a[i + 3] for i in (0, 1))


def _step(rng: np.random.Generator) -> tuple[float, float]:
    """A move of 2 to 5 mm, in tenths."""
    length, angle = rng.uniform(2.1, 4.9), rng.uniform(0, 2 * math.pi)
    return round(length * math.cos(angle), 1), round(length * math.sin(angle), 1)


def _millimetres(rng: np.random.Generator, low: float = 2.0, high: float = 5.0) -> float:
    return round(float(rng.uniform(low, high) * rng.choice([-1, 1])), 1)


def _factor(rng: np.random.Generator) -> float:
    """5 to 10 % up or down."""
    return round(float(1 + rng.choice([-1, 1]) * rng.uniform(0.05, 0.1)), 3)


def _shifted(point: tuple[float, float], by: tuple[float, float]) -> tuple[float, float]:
    return point[0] + by[0], point[1] + by[1]


def apply_change(variation: Variation, candidate: Candidate, rng: np.random.Generator) -> Variation:
    """The variation with one more change, its amount drawn."""
    design, name, word = variation.design, candidate.name, candidate.change
    amount: Amount = {}
    changed: dict[str, Any] = {}
    missing, plugs, after_name = set(variation.missing), list(variation.plugs), name
    table = {"hole": "holes", "clip": "clips", "lug": "lugs", "boss": "bosses", "lowered_rib": "lowered"}
    table |= {"rib": "walls", "duct": "ducts"}
    rows = dict(getattr(design, table[candidate.kind])) if candidate.kind in table else {}
    if word == "removed":
        del rows[name]
    elif word == "plugged":
        plugs.append(name)
    elif word == "missing" and candidate.kind == "clip":
        missing |= {f"{name}/CLIP", f"{name}/BOLT_1", f"{name}/BOLT_2"}
    elif word == "missing":
        missing.add(name)
    elif candidate.kind == "bolt":
        x, y = design.flange_bolts[name.removeprefix("BOLT_")]
        after_name, at = f"BOLT_X{name[-2:]}", (x + _millimetres(rng, 35, 60), y)
        changed["flange_bolts"] = {**design.flange_bolts, after_name.removeprefix("BOLT_"): at}
        amount = {"centre": list(at)}
    elif candidate.kind == "pocket":
        cell = name.partition(".")[0]
        pocket = design.pockets[cell]
        if word == "resized":
            straight = [w for w in pocket.walls if w != "CROWN" and not design.walls[w].edge]
            wall, by = straight[rng.integers(len(straight))], round(float(rng.uniform(2.0, 3.5)), 1)
            new, amount = replace(pocket, grow=((wall, by),)), {"wall": wall, "mm": by}
        else:  # the floor goes towards the web's middle or away from it; 2 mm of web stay
            by = _millimetres(rng)
            low, high = pocket.web
            web = (low, high + by) if name.endswith("front") else (low - by, high)
            if web[1] - web[0] < 2:
                by, web = -by, ((low, high - by) if name.endswith("front") else (low + by, high))
            new, amount = replace(pocket, web=web), {"web_thicker_mm": by}
        changed["pockets"] = {**design.pockets, cell: new}
    else:
        rows[name], amount = _altered(candidate, rows[name], rng)
    if candidate.kind in table:
        changed[table[candidate.kind]] = rows
    new_design = replace(design, **changed)
    gone = word in ("removed", "missing")
    before = None if word == "added" else candidate.box
    after = None if gone else boxes(new_design)[after_name]
    done = Change(after_name, candidate.kind, word, amount, before, after)
    return Variation(new_design, (*variation.changes, done), frozenset(missing), tuple(plugs))


def _altered(candidate: Candidate, row: Any, rng: np.random.Generator) -> tuple[Any, Amount]:
    """A row of the design moved, resized or turned."""
    kind, word = candidate.kind, candidate.change
    if word == "turned":
        by = round(float(rng.choice([-1, 1]) * rng.uniform(12, 170)), 1)
        return replace(row, angle_deg=row.angle_deg + by), {"deg": by}
    if kind == "rib":
        if word == "resized":
            by = round(float(rng.uniform(2, 5)), 1)
            return replace(row, thickness=row.thickness + by), {"thickness_mm": by}
        along = np.subtract(row.end, row.start)
        by = _millimetres(rng)
        x, y = (float(v) for v in np.round(by * np.array([-along[1], along[0]]) / np.linalg.norm(along), 2))
        return replace(row, start=_shifted(row.start, (x, y)), end=_shifted(row.end, (x, y))), {"mm": [x, y]}
    if kind == "lowered_rib":
        by = _millimetres(rng)
        if word == "moved":
            return replace(row, span=(row.span[0] + by, row.span[1] + by)), {"along_mm": by}
        return replace(row, z=row.z + by), {"level_mm": by}
    if kind == "lug":
        t, by = math.radians(row.angle_deg), _millimetres(rng)
        x, y = round(-by * math.sin(t), 2), round(by * math.cos(t), 2)
        return replace(row, root=_shifted(row.root, (x, y))), {"mm": [x, y]}
    if word == "moved":
        x, y = _step(rng)
        return replace(row, centre=_shifted(row.centre, (x, y))), {"mm": [x, y]}
    factor = _factor(rng)
    if kind == "duct":
        factor = round(1 + (factor - 1) / 2, 3)  # half as much: the ring has to stay within its pocket
        return replace(row, semi_axes=(row.semi_axes[0] * factor, row.semi_axes[1] * factor)), {"factor": factor}
    radius = round(row.radius * factor, 2)
    return replace(row, radius=radius), {
        "factor": factor,
        "diameter_before": 2 * row.radius,
        "diameter_after": 2 * radius,
    }
