"""Findings as cards: what each camera shows there, raw beside drawn, the size with its limit, the evidence in words."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from markupsafe import Markup
from PIL import Image
from sqlalchemy import Connection

from relmodel.app.report.drawing import courses
from relmodel.app.report.pictures import course_columns, data_uri, read_image
from relmodel.app.report.run_scene import view_name
from relmodel.store import Store

_MARGIN_PX, _LEAST_PX = 40, 160  # about a finding, and of the side of a crop: what lies around it says where that is
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
        return "decided by the odds" if least is None else f"differs from {least:.2g} mm on"

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
        return f"a face {abs(row.value):.{digits}f} ± {row.sigma:.{digits}f}{unit} {'out' if row.value > 0 else 'in'}"
    known = f"{row.value:{'' if row.nominal else '+'}.{digits}f} ± {row.sigma:.{digits}f}{unit}"
    return f"{row.what} {row.nominal:.6g} → {known}" if row.nominal else f"{row.what} {known}"


def read_cards(store: Store, connection: Connection, run: int, numbers: dict[int, int] | None = None) -> list[Card]:
    """The findings of a run; of those that `numbers` names by their number in the run, with their number on the
    page."""
    rows = store.rows(connection, "report/run_findings", run_id=run)
    rows = [row for row in rows if numbers is None or row.finding_no in numbers]
    arcs: dict[int, dict[str, set[int]]] = defaultdict(lambda: defaultdict(set))
    for r in store.rows(connection, "report/finding_arcs", run_id=run) if rows else []:
        arcs[r.finding_no][r.camera].add(int(r.view_arc_no))
    pictures = _Pictures(store, connection, run) if rows else None
    return [
        Card(
            row.finding_no if numbers is None else numbers[row.finding_no],
            run,
            row,
            [] if pictures is None else list(pictures.crop(arcs[row.finding_no], None if numbers is None else run)),
        )
        for row in rows
    ]


class _Pictures:
    """The pictures of a run and the model's arcs in them."""

    def __init__(self, store: Store, connection: Connection, run: int) -> None:
        self._images: dict[str, Image.Image] = {}
        for row in store.rows(connection, "report/pictures", run_id=run):
            image = None if row.bytes is None else read_image(row.bytes)
            if image is not None:
                self._images[row.camera] = image
        points = store.columns(connection, "report/model_arc_courses", run_id=run)
        camera = np.asarray(points["camera"])
        states = {
            (r.camera, int(r.view_arc_no)): r.state for r in store.rows(connection, "report/state_arcs", run_id=run)
        }
        self._arcs: dict[str, list[tuple[int, str, str, Any]]] = {}
        for name in self._images:
            own = camera == name
            owner, x, y = course_columns(*(np.asarray(points[c])[own] for c in ("view_arc_no", "x", "y")))
            starts = np.flatnonzero(np.r_[True, owner[1:] != owner[:-1]]) if len(owner) else np.zeros(0, np.int64)
            bounds = [f.reduceat(of, starts) for f in (np.minimum, np.maximum) for of in (x, y)] if len(owner) else []
            drawn = courses(owner, x, y)
            self._arcs[name] = [
                (no, drawn[no], states.get((name, no), ""), box)
                for no, box in zip(owner[starts].tolist(), np.transpose(bounds).tolist(), strict=True)
            ]

    def crop(self, arcs: dict[str, set[int]], run: int | None) -> Iterable[Crop]:
        """What each camera shows of those arcs, and all arcs of the model there; run: where the page is of several."""
        for camera, image in self._images.items():
            mine = np.array([box for no, _, _, box in self._arcs[camera] if no in arcs[camera]])
            if not len(mine):
                continue
            low, high = mine[:, :2].min(axis=0), mine[:, 2:].max(axis=0)
            margin = np.maximum(_MARGIN_PX, (_LEAST_PX - (high - low)) / 2)
            u0, v0 = np.floor(low - margin).clip(0).astype(int).tolist()
            u1, v1 = np.ceil(high + margin).clip((u0 + 1, v0 + 1), image.size).astype(int).tolist()
            paths = [
                Markup('<path class="drawn state-{}{}" d="{}"/>').format(state, " own" if no in arcs[camera] else "", d)
                for no, d, state, (left, top, right, bottom) in self._arcs[camera]
                if left < u1 and right > u0 and top < v1 and bottom > v0
            ]
            piece = image.crop((u0, v0, u1, v1))
            view = camera if run is None else view_name(run, camera)
            yield Crop(camera, data_uri(piece), (u0, v0, u1 - u0, v1 - v0), Markup("").join(paths), view)


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
