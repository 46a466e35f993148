"""Findings as cards: what each camera shows there, raw beside drawn, the size with its limit, the evidence in words."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from markupsafe import Markup
from sqlalchemy import Connection

from relmodel.app.report.run_scene import view_name
from relmodel.drawing.images import data_uri
from relmodel.drawing.model_edges import Edge, Seen, box_about, item_edges
from relmodel.drawing.plots import course
from relmodel.store import Store

_MOST_ODDS = 1_000_000


@dataclass(frozen=True)
class Crop:
    """A piece of a camera's picture: its bounds u v width height, px, the model drawn over it, and the view of the
    page's model that it is."""

    camera: str
    uri: str
    box: tuple[int, int, int, int]
    drawing: Markup
    view: str


@dataclass(frozen=True)
class Card:
    """A finding: its number on the page, the run that it is of, and what is said of it."""

    no: int
    run: int
    row: Any
    crops: list[Crop]

    @property
    def size(self) -> str:
        return size_words(self.row)

    @property
    def limit(self) -> str:
        if self.row.what is None:
            return ""
        least = self.row.least_difference
        return "decided by the odds" if least is None else f"counts from {least:.2g} mm on"

    @property
    def odds(self) -> str:
        most = self.row.evidence > math.log(_MOST_ODDS)
        words = f"over {_MOST_ODDS:,}" if most else f"{float(f'{math.exp(self.row.evidence):.2g}'):,.0f}"
        return f"{words} to 1 against it being as modelled"

    @property
    def together(self) -> list[str]:
        return [] if self.row.together is None else self.row.together.split(", ")


def size_words(row: Any) -> str:
    """Nominal and measured size, each to two digits of the standard deviation: `thickness 8 → 13.86 ± 0.43 mm`."""
    if row.what is None:
        return ""
    digits = min(max(0, 1 - math.floor(math.log10(row.sigma))), 4)
    unit = "°" if row.unit == "deg" else f" {row.unit}"
    if row.what == "offset":
        way = "outward" if row.value > 0 else "inward"
        return f"a face moved {abs(row.value):.{digits}f} ± {row.sigma:.{digits}f}{unit} {way}"
    known = f"{row.value:{'' if row.nominal else '+'}.{digits}f} ± {row.sigma:.{digits}f}{unit}"
    return f"{row.what} {row.nominal:.6g} → {known}" if row.nominal else f"{row.what} {known}"


def read_cards(
    store: Store, connection: Connection, run: int, seen: Sequence[Seen], numbers: dict[int, int] | None = None
) -> list[Card]:
    """The findings of a run, whose pictures are `seen`; of those that `numbers` names by their number in the run, with
    their number on the page."""
    rows = store.rows(connection, "report/run_findings", run_id=run)
    edges = item_edges(store, connection, run) if rows else {}
    in_view = {r.item_no: int(r.in_view_no) for r in store.rows(connection, "report/failures", run_id=run)}
    out = []
    for row in rows:
        if numbers is None or row.finding_no in numbers:
            mine = edges.get(in_view.get(row.item_no, -1), set())
            own = [(s, [e for e in s.edges if (s.row.camera, e.number) in mine]) for s in seen if s.image is not None]
            crops = [_crop(s, shown, None if numbers is None else run) for s, shown in own if shown]
            out.append(Card(row.finding_no if numbers is None else numbers[row.finding_no], run, row, crops))
    return out


def _crop(seen: Seen, own: Sequence[Edge], run: int | None) -> Crop:
    """What a camera shows of edges, and all edges of the model there; run: where the page is of several."""
    assert seen.image is not None
    u0, v0, u1, v1 = box_about(own, seen.image.size)
    numbers = {e.number for e in own}
    paths = [
        Markup('<path class="drawn state-{}{}" d="{}"/>').format(
            e.state, " own" if e.number in numbers else "", course(e.points)
        )
        for e in seen.edges
        if np.all(e.points.max(axis=0) > (u0, v0)) and np.all(e.points.min(axis=0) < (u1, v1))
    ]
    camera = seen.row.camera
    view = camera if run is None else view_name(run, camera)
    uri = data_uri(seen.image.crop((u0, v0, u1, v1)))
    return Crop(camera, uri, (u0, v0, u1 - u0, v1 - v0), Markup("").join(paths), view)


@dataclass(frozen=True)
class Group:
    """Parts and features that are in one state for one reason."""

    state: str
    reason: str
    names: list[str]


def group_rest(rows: Iterable[Any]) -> tuple[list[Group], list[str]]:
    """What is not checked, by state and reason, what should be seen and is not first; and what is as modelled."""
    groups: dict[tuple[str, str], list[str]] = defaultdict(list)
    for row in rows:
        groups[row.state, row.reason or "in view of no stop whose pose is usable"].append(row.path)
    order = ("not_confirmed", "undecidable", "not_seen")
    open_ = [Group(*key, names) for key, names in groups.items() if key[0] in order]
    passed = [path for key, names in groups.items() if key[0] == "confirmed" for path in names]
    return sorted(open_, key=lambda g: (order.index(g.state), -len(g.names), g.reason)), passed
