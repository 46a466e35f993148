"""The list next to pictures and model, which it is linked to; of a run the parts and features in view."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from sqlalchemy import Connection

from relmodel.app.report.findings import size_words
from relmodel.app.report.page import render
from relmodel.app.report.pictures import RunPicture
from relmodel.store import Store

_FAILING = ("contradicted", "changed", "not_confirmed")  # the worst first
STATES = (*_FAILING, "undecidable", "confirmed")


@dataclass(frozen=True)
class Entry:
    """An entry of the list: what it is and is called, its part in the scene, surfaces of that (None: all), ids of arcs
    in the pictures; key: the placed part and its feature.

    level: finding (not as modelled), part or feature; share: its size where that is another, or how much of it there
    is; state empty where nothing was said of it.
    """

    level: str
    name: str
    share: str
    part: int | None
    surfaces: list[int] | None = None
    state: str = ""
    note: str = ""
    key: tuple[int, int | None] | None = None
    arcs: Sequence[str] = ()


def render_linked(
    store: Store,
    entries: Sequence[Entry],
    scene: dict[str, Any] | None,
    around: Mapping[str, Any] | None = None,
    **values: Any,
) -> str:
    """A page with the list beside pictures and model; around: what stands about it where it is one of several."""
    return render(
        "run.html",
        **(around or {}),
        **values,
        items=entries,
        scene=scene,
        data={"items": [{"arcs": e.arcs, "part": e.part, "surfaces": e.surfaces} for e in entries], "scene": scene},
        store=store.name,
    )


def read_entries(
    store: Store, connection: Connection, run: int, pictures: Sequence[RunPicture], part_of: dict[int, int]
) -> list[Entry]:
    """What is not as modelled, the worst first; then the parts in view, each followed by its features in view."""
    number = {p.camera: i for i, p in enumerate(pictures)}
    arcs: dict[int, list[str]] = defaultdict(list)
    for r in store.rows(connection, "report/item_arcs", run_id=run):
        if r.camera in number:
            arcs[int(r.in_view_no)].append(f"c{number[r.camera]}-m{r.view_arc_no}")
    surfaces: dict[int, list[int]] = defaultdict(list)
    for r in store.rows(connection, "report/item_surfaces", run_id=run):
        surfaces[int(r.in_view_no)].append(int(r.surface_no))
    sizes = {r.item_no: size_words(r) for r in store.rows(connection, "report/run_findings", run_id=run)}

    def entry(row: Any, level: str, name: str, size: str | None = None) -> Entry:
        occurrence, no = int(row.occurrence_id), int(row.in_view_no)
        return Entry(
            level,
            name,
            size or ("under 1 % visible" if 0 < row.visible < 0.01 else f"{100 * row.visible:.0f} % visible"),
            part_of.get(occurrence),
            None if row.feature_no is None else surfaces[no],
            row.state or "",
            (f"{row.reason}; " if row.reason else "")
            + f"{row.matched} of {row.arcs} edges matched, {row.pixels:.0f} px in view",
            (occurrence, None if row.feature_no is None else int(row.feature_no)),
            arcs[no],
        )

    rows = store.rows(connection, "report/items", run_id=run)
    part = {int(r.occurrence_id): r for r in rows if r.level == "part"}
    place = {occurrence: i for i, occurrence in enumerate(part)}
    rows = sorted(rows, key=lambda r: (place.get(int(r.occurrence_id), len(place)), r.level == "feature", r.in_view_no))
    failing = sorted((r for r in rows if r.state in _FAILING), key=lambda r: _FAILING.index(r.state))
    return [entry(r, "finding", r.path, sizes.get(r.item_no)) for r in failing] + [
        entry(r, r.level, r.path if r.level == "part" else r.path.removeprefix(part[int(r.occurrence_id)].path + "/"))
        for r in rows
        if r.state not in _FAILING and (r.level == "part" or int(r.occurrence_id) in part)
    ]


def checked(store: Store, connection: Connection, run: int, entries: Sequence[Entry]) -> list[tuple[str, str, str]]:
    """Name, value and note: how much is in view, and how much of it was checked."""
    checked_rows = store.rows(connection, "report/checked", run_id=run)
    if checked_rows:
        return [
            (f"{r.level}s checked", f"{r.checked} of {r.in_view}", f"{r.confirmed} as modelled") for r in checked_rows
        ]
    features = sum(e.surfaces is not None for e in entries)
    return [("in view", f"{len(entries) - features} parts", f"and {features} features")] if entries else []
