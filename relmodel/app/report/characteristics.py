"""The characteristics of an inspection as its report has them: the table, and balloons with their numbers on a picture."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from markupsafe import Markup

from relmodel.arrays import Floats
from relmodel.drawing.draw import Balloon, Seen, draw_balloons, edges_of, tolerance_bar

_MOST_BALLOONS = 20
# What each result is coloured as, and which are labelled first.
_STATES = {
    "does not conform": "contradicted",
    "not decidable": "not_confirmed",
    "conforms": "confirmed",
    "measured": "undecidable",
    "not seen": "undecidable",
}


@dataclass(frozen=True)
class Line:
    """A line of the table: its row, of `result/characteristic`, what is asked for and found in words, and the bar."""

    row: Any
    asked: str
    measured: str
    uncertainty: str
    deviation: str
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
    """The bar of what has limits shows these and the value, of what has none the value about the nominal by its U."""
    limits = tuple(None if end is None else end - row.nominal for end in (row.lower_limit, row.upper_limit))
    known, spread = row.measured is not None, row.expanded_uncertainty or 0.0
    ends = [abs(end) for end in limits if end is not None] + [abs(row.deviation) + spread if known else 0.0]
    words = [f"{v:.{_digits(spread)}f}" for v in (row.measured, spread)] if known else ["", ""]
    off = f"{row.deviation:+.{_digits(spread)}f}" if known else ""
    reach = 1.2 * max(ends) if row.source else 3.0 * spread
    bar = tolerance_bar(limits, row.deviation, spread, reach or 1.0)
    return Line(row, _ask(row.nominal, *limits), *words, off, bar)


def _digits(spread: float) -> int:
    """After the point, so that two of U are given."""
    return min(max(0, 1 - math.floor(math.log10(spread))), 4) if spread else 0


def _ask(nominal: float, low: float | None, high: float | None) -> str:
    """Nominal and tolerance: `48 ± 0.4`, `48 +0.2 -0.4`, `0, at most 1.5`."""
    words = f"{nominal:.6g}"
    if low is not None and high is not None:
        even = math.isclose(-low, high)
        return words if low == high == 0 else f"{words} ± {high:.4g}" if even else f"{words} {high:+.4g} {low:+.4g}"
    least = "" if low is None else f", at least {nominal + low:.6g}"
    return words + (least if high is None else f", at most {nominal + high:.6g}")


def count_results(lines: Sequence[Line]) -> Counter[str]:
    """How many of those with limits came to each result."""
    return Counter(line.result for line in lines if line.row.source)


def say_results(lines: Sequence[Line]) -> list[str]:
    """That in a clause, where some have limits."""
    results = count_results(lines)
    rest = [f"{results[it]} {it}" for it in _STATES if results[it] and it != "conforms"]
    said = ", ".join([f"{results['conforms']} of {results.total()} characteristics conform", *rest])
    return [said] if results else []


@dataclass(frozen=True)
class Labelled:
    """The picture that shows most of what has a number, with balloons and the faces of findings."""

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
    wanted = [(f"F{c.no}", f"finding={c.no}", c.row.path, c.row.state) for c in findings]
    order = list(_STATES)
    for line in sorted(lines, key=lambda line: order.index(line.result)):
        wanted.append((f"{line.row.number}", f"characteristic-{line.row.number}", line.row.path, line.state))
    edges = {item.path: set(edges_of(item)) for item in items}
    placed = [[(w, at) for w in wanted if (at := _middle(s, edges.get(w[2], ()))) is not None] for s in seen]
    rings = {(crop.camera, f"F{c.no}"): crop.rings for c in findings for crop in c.crops if crop.rings}
    number = max(range(len(seen)), key=lambda n: (sum(w[0][0] == "F" for w, _ in placed[n]), len(placed[n]), -n))
    one = seen[number].row
    balloons = [
        Balloon(label, link, _centre(max(found, key=len)) if (found := rings.get((one.camera, label))) else at, state)
        for (label, link, _, state), at in placed[number][:_MOST_BALLOONS]
    ]
    faces = [
        Markup('<path class="face state-{}" d="{}"/>').format(c.row.state, crop.face)
        for c in findings
        for crop in c.crops
        if crop.camera == one.camera and crop.rings
    ]
    drawn = Markup("").join(faces) + draw_balloons(balloons, (one.width, one.height))
    return Labelled(number, one, drawn, len(wanted) - len(balloons))


def _middle(seen: Seen, edges: Collection[tuple[str, int]]) -> Floats | None:
    """The middle (2,) of what a camera shows of edges, px; None where it shows none."""
    own = [e.points for e in seen.edges if (seen.row.camera, e.number) in edges]
    if not own:
        return None
    return _centre(np.concatenate(own))


def _centre(points: Floats) -> Floats:
    return np.asarray((points.min(axis=0) + points.max(axis=0)) / 2)
