"""The characteristics of an inspection as its report has them: the table, and their numbers in a picture."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from markupsafe import Markup

from relmodel.drawing.draw import Balloon, Seen, draw_balloons, edges_of, tolerance_bar

_MOST_BALLOONS = 20
# What each result is coloured as; those first that are labelled first.
_STATES = {
    "does not conform": "contradicted",
    "not decidable": "not_confirmed",
    "conforms": "confirmed",
    "measured": "undecidable",
    "not seen": "undecidable",
}


@dataclass(frozen=True)
class Line:
    """A line of the table, of a row of `result/characteristic`: what is asked for, measured value, U and deviation in
    words, and a bar: of what has limits these with the value, of what has none the value about the nominal by its U."""

    row: Any
    asked: str
    words: Sequence[str]
    bar: Markup

    @property
    def result(self) -> str:
        return self.row.decision or "measured"

    @property
    def state(self) -> str:
        return _STATES[self.result]


def make_lines(rows: Sequence[Any]) -> list[Line]:
    """The lines of what has limits or was measured, by rows of `result/characteristic`."""
    return [_line(row) for row in rows if row.source or row.measured is not None]


def _line(row: Any) -> Line:
    limits = [None if end is None else end - row.nominal for end in (row.lower_limit, row.upper_limit)]
    words, spread = ["", "", ""], row.expanded_uncertainty or 0.0
    if row.measured is not None:
        digits = min(max(0, 1 - math.floor(math.log10(spread))), 4) if spread else 0  # two of U
        words = [f"{row.measured:.{digits}f}", f"{spread:.{digits}f}", f"{row.deviation:+.{digits}f}"]
    far = 1.2 * max(abs(row.deviation or 0.0) + spread, *(abs(end or 0.0) for end in limits))
    bar = tolerance_bar(limits, row.deviation, spread, (far if row.source else 3 * spread) or 1.0)
    return Line(row, _ask(row.nominal, *limits), words, bar)


def _ask(nominal: float, low: float | None, high: float | None) -> str:
    """Nominal and tolerance: `48 ± 0.4`, `48 +0.2 -0.4`, `0, at most 1.5`."""
    words = f"{nominal:.6g}"
    if low is None or high is None:
        least = "" if low is None else f", at least {nominal + low:.6g}"
        return words + (least if high is None else f", at most {nominal + high:.6g}")
    even = f" ± {high:.4g}" if high else ""
    return words + (even if math.isclose(-low, high) else f" {high:+.4g} {low:+.4g}")


@dataclass(frozen=True)
class Labelled:
    """The picture that shows most of what has a number: which of the run's it is, its row, balloons and the faces of
    findings drawn over it, and how many numbers are not in it."""

    number: int
    row: Any
    drawing: Markup
    left_out: int


def label_picture(
    seen: Sequence[Seen], items: Sequence[Any], findings: Sequence[Any], lines: Sequence[Line]
) -> Labelled | None:
    """Balloons at findings, then at characteristics, those first that do not conform; items: rows of `report/items`,
    findings: cards of the page.  None where the run has no picture."""
    if not seen:
        return None
    wanted = [(f"F{c.no}", f"finding={c.no}", c.row.path, c.row.state, c.rings) for c in findings]
    ordered = sorted(lines, key=lambda line: [*_STATES].index(line.result))
    wanted += [(str(it.row.number), f"characteristic-{it.row.number}", it.row.path, it.state, {}) for it in ordered]
    edges = {item.path: set(edges_of(item)) for item in items}
    found: list[list[Balloon]] = []
    for one in seen:
        name, by_number = one.row.camera, {e.number: e for e in one.edges}
        found.append([])
        for label, link, path, state, rings in wanted:
            own = [by_number[no].points for camera, no in edges.get(path, ()) if camera == name and no in by_number]
            if own:
                points = max(rings[name], key=len) if rings.get(name) else np.concatenate(own)
                middle = (points.min(axis=0) + points.max(axis=0)) / 2
                found[-1].append(Balloon(label, link, middle, state))
    count = [(sum(b.label[0] == "F" for b in own), len(own), bool(s.edges)) for own, s in zip(found, seen, strict=True)]
    best = max(range(len(seen)), key=lambda n: (count[n], -n))
    row, shown = seen[best].row, found[best][:_MOST_BALLOONS]
    faces = Markup("").join(c.face(row.camera) for c in findings)
    return Labelled(best, row, faces + draw_balloons(shown, (row.width, row.height)), len(wanted) - len(shown))
