"""The report of a physical part by all inspections of it: the one that is signed."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from sqlalchemy import Connection

from relmodel.app.report.findings import Card, group_rest, read_cards, size_words
from relmodel.app.report.items import Entry, render_linked
from relmodel.app.report.page import PageTable, read_table
from relmodel.app.report.pictures import pose_matrix
from relmodel.app.report.run import read_sheet
from relmodel.app.report.run_scene import finding_views
from relmodel.drawing.model_edges import read_seen
from relmodel.drawing.scene import place_parts, scene
from relmodel.errors import UsageError
from relmodel.geometry.transforms import matrices
from relmodel.store import Store
from relmodel.store.digests import seal

# What each state is drawn as, what must be seen last: a surface may be of several features.
_COLOURS = {
    "not_seen": "open",
    "undecidable": "seen",
    "not_confirmed": "seen",
    "confirmed": "added",
    "changed": "changed",
    "contradicted": "removed",
}
_LEGEND = (
    ("as modelled", "added"),
    ("changed", "changed"),
    ("contradicted", "removed"),
    ("seen, not checked", "seen"),
    ("not yet seen", "open"),
)
_TABLES = {
    "serial_findings": "Findings",
    "serial_states": "Parts and features",
    "serial_stops": "Stops",
    "serial_zones": "By zone",
    "serial_kinds": "By kind of feature",
}


def serial_tables(connection: Connection, serial: str) -> dict[str, PageTable]:
    """The tables of a physical part's page by name."""
    return {name: read_table(connection, title, f"report/{name}", serial=serial) for name, title in _TABLES.items()}


def serial_page(store: Store, connection: Connection, serial: str, around: Mapping[str, Any] | None = None) -> str:
    """The page of a physical part; around: as of a run's page.  Raises UsageError where no inspection was of it."""
    found = store.rows(connection, "report/serial_outcome", serial=serial)
    if not found:
        raise UsageError(f"no inspection was of the part {serial}: relmodel inspect --serial names it")
    tables = serial_tables(connection, serial)
    stops = [(int(row[0]), str(row[2])) for row in tables["serial_stops"].rows]
    rows = store.rows(connection, "report/serial_states", serial=serial)
    cards = _cards(store, connection, serial)
    drawn, part_of = _scene(store, connection, serial, rows, stops, sorted({card.run for card in cards}))
    entries = _entries(rows, cards, part_of)
    rest, passed = group_rest(rows)
    word = found[0].outcome[0].upper() + found[0].outcome[1:]
    newest = next((row[0] for row in reversed(tables["serial_stops"].rows) if row[3] is not None), stops[-1][0])
    sheet = dict(read_sheet(store, connection, newest)) | {"run": None, "stops": len(stops)}
    folded = [replace(tables[name], folded=True) for name in ("serial_findings", "serial_states")]
    by_place: list[Any] = [tables[name] for name in ("serial_zones", "serial_kinds", "serial_stops")]
    return render_linked(
        store,
        entries,
        drawn,
        around,
        title=f"{serial}: {word}",
        over="Inspection of a part, all stops",
        word=word,
        mood=found[0].mood,
        reason=found[0].unusable or "",
        sheet=list(sheet.items()),
        cards=cards,
        chosen={e.key: n for n, e in enumerate(entries)},
        rest=rest,
        passed=passed,
        seal=(f"serial {serial}", seal(store, connection, [run for run, _ in stops])),
        summary=by_place,
        items_title="Parts and features",
        legend=_LEGEND,
        sections=[("All rows", folded)],
    )


def _cards(store: Store, connection: Connection, serial: str) -> list[Card]:
    """Findings of all stops, numbered on this page."""
    by_run: dict[int, dict[int, int]] = defaultdict(dict)
    for no, row in enumerate(store.rows(connection, "report/serial_findings", serial=serial), 1):
        by_run[int(row.run_id)][row.finding_no] = no
    cards: list[Card] = []
    for run, numbers in by_run.items():
        cards += read_cards(store, connection, run, read_seen(store, connection, run), numbers)
    return sorted(cards, key=lambda card: card.no)


def _scene(
    store: Store,
    connection: Connection,
    serial: str,
    states: Sequence[Any],
    stops: list[tuple[int, str]],
    runs: Sequence[int],
) -> tuple[dict[str, Any] | None, dict[int, int]]:
    """The whole part, its features coloured by state, seen as at the newest stop that is usable, and as the cameras of
    some runs see it; which part of the scene each placed part is."""
    rows = store.columns(connection, "report/serial_parts", serial=serial)
    shape_id = np.asarray(rows["shape_id"], np.int64)
    shapes, parts, kept = place_parts(store, connection, shape_id, rows["path"], matrices(rows))
    own: dict[int, str] = {}
    paint: dict[int, dict[str, list[int]]] = defaultdict(lambda: defaultdict(list))
    for s in states:
        if s.level == "part":
            own[int(s.occurrence_id)] = s.state
        else:
            paint[int(s.occurrence_id)][s.state] += map(int, s.surfaces or ())
    part_of = {int(rows["id"][row]): i for i, row in enumerate(kept)}
    for occurrence, i in part_of.items():
        features, state = paint[occurrence], own[occurrence]
        # Of a part that has features only these are painted: seen in one place is not seen everywhere.
        parts[i]["colour"] = _COLOURS[state] if state in ("changed", "contradicted") or not features else "open"
        parts[i]["paint"] = [[_COLOURS[k], features[k]] for k in _COLOURS if k in features]
    usable = [run for run, ended in stops if ended == "usable"]
    poses = store.rows(connection, "report/pose_matrix", run_id=usable[-1]) if usable else []
    back = -pose_matrix(poses[0])[:3, 2] if poses else None
    views = [view for run in runs for view in finding_views(store, connection, run)]
    return scene(shapes, parts, views=views, back=back), part_of


def _entries(states: Sequence[Any], cards: list[Card], part_of: dict[int, int]) -> list[Entry]:
    """Parts and features, what is not as modelled first."""
    sizes = {(c.row.occurrence_id, c.row.feature_no): size_words(c.row) for c in cards}
    return [
        Entry(
            "finding" if s.state in ("changed", "contradicted") else s.level,
            s.path,
            sizes.get((s.occurrence_id, s.feature_no)) or f"zone {s.zone}",
            part_of.get(int(s.occurrence_id)),
            None if s.feature_no is None else list(map(int, s.surfaces or ())),
            s.state,
            f"{s.reason or 'in no accepted inspection'}; {s.stops} stops, {s.otherwise} of them otherwise",
            (int(s.occurrence_id), s.feature_no),
        )
        for s in states
    ]
