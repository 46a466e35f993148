"""How many of the known features are found, and how many of the found ones are known, by kind."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

import numpy as np

from relmodel.loading import step_shape
from relmodel.loading.features import Feature, recognise

from .parts_generator import Known, Part

NEAR = 0.05  # mm, and rad and share of a dimension
WITHOUT_TRUTH = ("body",)  # all that is left: right if all else is


@dataclass
class Scores:
    known: Counter[str] = field(default_factory=Counter)
    found: Counter[str] = field(default_factory=Counter)
    matched: Counter[str] = field(default_factory=Counter)
    missed: list[tuple[int | str, Known]] = field(default_factory=list)
    false: list[tuple[int | str, Feature]] = field(default_factory=list)

    def recall(self, kind: str) -> float:
        return self.matched[kind] / max(self.known[kind], 1)

    def precision(self, kind: str) -> float:
        return self.matched[kind] / max(self.found[kind], 1)

    def __add__(self, other: Scores) -> Scores:
        return Scores(
            self.known + other.known,
            self.found + other.found,
            self.matched + other.matched,
            self.missed + other.missed,
            self.false + other.false,
        )

    @property
    def total_recall(self) -> float:
        return self.matched.total() / max(self.known.total(), 1)

    @property
    def total_precision(self) -> float:
        return self.matched.total() / max(self.found.total(), 1)


def score(generate: Callable[[int], Part], seeds: Iterable[int]) -> Scores:
    """Scores over the parts that a generator makes of the seeds."""
    out = Scores()
    for seed in seeds:
        part = generate(seed)
        left = [f for f in recognise(step_shape.extract(part.body, {}, {}, {})) if f.kind not in WITHOUT_TRUTH]
        out.found.update(kind_of(f.kind, f.dimensions) for f in left)
        for known in part.features:
            kind = kind_of(known.kind, known.dimensions)
            out.known[kind] += 1
            hit = next((f for f in left if agree(known, f)), None)
            if hit is None:
                out.missed.append((seed, known))
            else:
                out.matched[kind] += 1
                left = [f for f in left if f is not hit]
        out.false += [(seed, f) for f in left]
    return out


def kind_of(kind: str, dimensions: Iterable[str]) -> str:
    """The kind, a hole's with its widening."""
    more = [name for name in ("counterbore", "countersink") if f"{name}_diameter" in dimensions]
    return " ".join([kind, *more])


def agree(known: Known, found: Feature) -> bool:
    """Whether kind, place and every dimension are the same."""
    if known.kind != found.kind or known.dimensions.keys() != found.dimensions.keys():
        return False
    away = min(np.linalg.norm(np.array(p) - found.shape_from_feature[:3, 3]) for p in known.at)
    if away > NEAR:
        return False
    return all(abs(found.dimensions[k][0] - v) < NEAR * max(1.0, min(abs(v), 2)) for k, v in known.dimensions.items())
