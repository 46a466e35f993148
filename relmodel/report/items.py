"""The parts and features in view as a list that is linked to the pictures and to the model."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from sqlalchemy import Connection

from relmodel.report.pictures import RunPicture
from relmodel.store import Store


@dataclass(frozen=True)
class Item:
    """An entry of the list: its number in view, the part placed, and how it is shown; state and note empty where there
    is none."""

    no: int
    occurrence: int
    feature: int | None
    level: str
    name: str
    share: str
    state: str = ""
    note: str = ""


def read_items(store: Store, connection: Connection, run: int) -> list[Item]:
    """Parts in view, each followed by its features in view."""
    rows = store.rows(connection, "report/items", run_id=run)
    part = {int(r.occurrence_id): r for r in rows if r.level == "part"}
    place = {occurrence: i for i, occurrence in enumerate(part)}
    rows = sorted(rows, key=lambda r: (place.get(int(r.occurrence_id), len(place)), r.level == "feature", r.in_view_no))
    return [
        Item(
            int(r.in_view_no),
            int(r.occurrence_id),
            None if r.feature_no is None else int(r.feature_no),
            r.level,
            r.path if r.level == "part" else r.path.removeprefix(part[int(r.occurrence_id)].path + "/"),
            f"{100 * r.visible:.0f} %" + (f", {r.matched}/{r.arcs}" if r.arcs else ""),
            note=f"{r.pixels:.0f} px in view; {r.matched} of {r.arcs} edges found",
        )
        for r in rows
        if r.level == "part" or int(r.occurrence_id) in part
    ]


def checked(store: Store, connection: Connection, run: int, items: Sequence[Item]) -> list[tuple[str, str, str]]:
    """Name, value and note: how much is in view."""
    if not items:
        return []
    features = sum(i.level == "feature" for i in items)
    return [("in view", f"{len(items) - features} parts", f"and {features} features")]


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
            "surfaces": surfaces[i.no] if i.level == "feature" else None,
        }
        for i in items
    ]
