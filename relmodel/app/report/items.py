"""The parts and features in view as a list that is linked to the pictures and to the model."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from sqlalchemy import Connection

from relmodel.app.report.findings import size_words
from relmodel.app.report.pictures import RunPicture
from relmodel.store import Store

_FAILING = ("contradicted", "changed", "not_confirmed")  # the worst first
STATES = (*_FAILING, "undecidable", "confirmed")


@dataclass(frozen=True)
class Item:
    """An entry of the list: its number in view, the part placed, and how it is shown.

    level: finding (not as modelled), part or feature; share: its size where that is another, else how much of it is
    visible; state empty where the run did not look what is there.
    """

    no: int
    occurrence: int
    feature: int | None
    level: str
    name: str
    share: str
    state: str = ""
    note: str = ""


def read_items(store: Store, connection: Connection, run: int) -> list[Item]:
    """What is not as modelled, the worst first; then the parts in view, each followed by its features in view."""
    rows = store.rows(connection, "report/items", run_id=run)
    sizes = {r.item_no: size_words(r) for r in store.rows(connection, "report/run_findings", run_id=run)}
    part = {int(r.occurrence_id): r for r in rows if r.level == "part"}
    place = {occurrence: i for i, occurrence in enumerate(part)}
    rows = sorted(rows, key=lambda r: (place.get(int(r.occurrence_id), len(place)), r.level == "feature", r.in_view_no))
    failing = sorted((r for r in rows if r.state in _FAILING), key=lambda r: _FAILING.index(r.state))
    return [_item(r, "finding", r.path, sizes.get(r.item_no)) for r in failing] + [
        _item(r, r.level, r.path if r.level == "part" else r.path.removeprefix(part[int(r.occurrence_id)].path + "/"))
        for r in rows
        if r.state not in _FAILING and (r.level == "part" or int(r.occurrence_id) in part)
    ]


def _item(row: Any, level: str, name: str, size: str | None = None) -> Item:
    return Item(
        int(row.in_view_no),
        int(row.occurrence_id),
        None if row.feature_no is None else int(row.feature_no),
        level,
        name,
        size or f"{100 * row.visible:.0f} % visible",
        row.state or "",
        (f"{row.reason}; " if row.reason else "")
        + f"{row.matched} of {row.arcs} edges matched, {row.pixels:.0f} px in view",
    )


def checked(store: Store, connection: Connection, run: int, items: Sequence[Item]) -> list[tuple[str, str, str]]:
    """Name, value and note: how much is in view, and how much of it was checked."""
    checked_rows = store.rows(connection, "report/checked", run_id=run)
    if checked_rows:
        return [
            (f"{r.level}s checked", f"{r.checked} of {r.in_view}", f"{r.confirmed} as modelled") for r in checked_rows
        ]
    features = sum(i.feature is not None for i in items)
    return [("in view", f"{len(items) - features} parts", f"and {features} features")] if items else []


def item_data(
    store: Store,
    connection: Connection,
    run: int,
    items: Sequence[Item],
    pictures: Sequence[RunPicture],
    part_of: dict[int, int],
) -> list[dict[str, Any]]:
    """What the script links each item to: ids of arcs in the pictures, a part of the model, surfaces of it."""
    number = {p.camera: i for i, p in enumerate(pictures)}
    arcs: dict[int, list[str]] = defaultdict(list)
    for r in store.rows(connection, "report/item_arcs", run_id=run):
        if r.camera in number:
            arcs[int(r.in_view_no)].append(f"c{number[r.camera]}-m{r.view_arc_no}")
    surfaces: dict[int, list[int]] = defaultdict(list)
    for r in store.rows(connection, "report/item_surfaces", run_id=run):
        surfaces[int(r.in_view_no)].append(int(r.surface_no))
    return [
        {
            "arcs": arcs[i.no],
            "part": part_of.get(i.occurrence),
            "surfaces": surfaces[i.no] if i.feature is not None else None,
        }
        for i in items
    ]
