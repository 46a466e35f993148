"""How many of the known features are found, and how many of the found ones are known, by kind."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from relmodel.features import Feature
from tests.parts.housings_and_shafts import Made, Work
from tests.parts.solids import Floats, Known, Part

NEAR = 0.05  # mm, and rad and share of a dimension
STRAIGHT = 1e-6
WITHOUT_TRUTH = ("body",)  # all that is left: right if all else is


@dataclass
class Scores:
    known: Counter[str] = field(default_factory=Counter)
    found: Counter[str] = field(default_factory=Counter)
    matched: Counter[str] = field(default_factory=Counter)
    missed: list[tuple[int | str, Known | Made]] = field(default_factory=list)
    false: list[tuple[int | str, Feature]] = field(default_factory=list)

    @property
    def total_recall(self) -> float:
        return self.matched.total() / max(self.known.total(), 1)

    @property
    def total_precision(self) -> float:
        return self.matched.total() / max(self.found.total(), 1)


def score(seed: int, part: Part, features: Iterable[Feature]) -> Scores:
    """Scores of what was recognised of the part that a generator makes of a seed."""
    out = Scores()
    left = [f for f in features if f.kind not in WITHOUT_TRUTH]
    if isinstance(part, Work):
        stated = {known.kind for known in part.features}
        left = [f for f in left if f.kind in stated or f.kind not in part.silent]
    found = Counter(kind_of(f.kind, f.dimensions) for f in left)
    for known in part.features:
        kind = kind_of(known.kind, known.dimensions)
        out.known[kind] += 1
        hit = next((f for f in left if agree(known, f)), None)
        if hit is None:
            out.missed.append((seed, known))
        else:
            out.matched[kind] += 1
            left = [f for f in left if f is not hit]
    out.found.update(found)
    out.false = [(seed, f) for f in left]
    return out


def kind_of(kind: str, dimensions: Iterable[str]) -> str:
    """The kind, a hole's with its widening."""
    more = [name for name in ("counterbore", "countersink") if f"{name}_diameter" in dimensions]
    return " ".join([kind, *more])


def agree(known: Known | Made, found: Feature) -> bool:
    """Whether kind, place and every dimension are the same, and of what is `Made` so much as is stated."""
    if known.kind != found.kind:
        return False
    if isinstance(known, Made):
        if not known.dimensions.keys() <= found.dimensions.keys() or not _stands_as_stated(known, found):
            return False
    elif known.dimensions.keys() != found.dimensions.keys():
        return False
    away = [np.linalg.norm(_beyond(known, np.array(p) - found.shape_from_feature[:3, 3])) for p in known.at]
    if away and min(away) > NEAR:
        return False
    return all(abs(found.dimensions[k][0] - v) < NEAR * max(1.0, min(abs(v), 2)) for k, v in known.dimensions.items())


def _stands_as_stated(known: Made, found: Feature) -> bool:
    """Whether the axes of the frame and the box are those stated; the frame is always a rotation."""
    pose = found.shape_from_feature[:3, :3]
    out = known.out is None or np.abs(pose[:, 2] - known.out).max() < STRAIGHT
    upright = known.axis is None or abs(pose[:, 2] @ np.array(known.axis)) > 1 - STRAIGHT
    along = known.along is None or abs(pose[:, 0] @ np.array(known.along)) > 1 - STRAIGHT
    box = known.box is None or np.abs(np.ravel(known.box) - found.box).max() < NEAR
    turned = np.abs(pose.T @ pose - np.eye(3)).max() < STRAIGHT and np.linalg.det(pose) > 0
    return bool(out and upright and along and box and turned)


def _beyond(known: Known | Made, away: Floats) -> Floats:
    """What of an offset counts: where an axis is stated, the part across it."""
    axis = known.axis if isinstance(known, Made) else None
    return away if axis is None else away - (away @ np.array(axis)) * np.array(axis)
