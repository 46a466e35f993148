"""Pages of an object, of what differs between two of its variants, and of one physical part by all its inspections."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from sqlalchemy import Connection

from relmodel.app.report.characteristics import make_lines
from relmodel.app.report.page import ListEntry, PageTable, read_table, render
from relmodel.app.report.run import Card, group_rest, list_entries, read_cards, read_sheet
from relmodel.app.tree import Tree, read_tree, tree_rows
from relmodel.drawing.draw import Rgb, colours_of, hexadecimal, read_seen
from relmodel.drawing.solid import Faces, Part, place_parts, scene
from relmodel.errors import UsageError
from relmodel.geometry.transforms import matrices
from relmodel.store import Store
from relmodel.store.runs import seal

MOST_ITEMS = 3000  # of the list next to the model
_COLOURED = ("changed", "added", "removed")  # the later is seen where a surface is of several features
_UP = (0, 1, 0)  # of an object: as its drawings show it


def object_page(
    store: Store, connection: Connection, name: str, variant: str = "", around: Mapping[str, Any] | None = None
) -> str:
    """The page of an object: its tree, its features by kind, the model; around: as of a run's page.  Raises UsageError
    where it is not loaded."""
    tree = read_tree(store, connection, name, variant)
    rows = tree_rows(store, connection, tree)
    shapes, parts = _parts(store, connection, tree)
    shape_ids = [s["id"] for s in shapes]
    kinds = _paint(store, connection, shapes)
    tables = _tables(connection, rows, shape_ids)
    features = tables["object_features"].rows
    whole = rows[0]
    facts = [
        ("parts", str(whole["parts"]), f"of {len(shape_ids)} shapes"),
        ("features", str(len(features)), f"of {len(kinds)} kinds"),
    ]
    if whole["mass"]:
        facts.append(("mass", f"{whole['mass']:.4g} kg", ""))
    title = f"{name} {variant}".strip()
    many = Counter(f.kind for f in features)
    return render(
        **(around or {}),
        store=store.name,
        title=title,
        word=title,
        over=f"Object, revision {tree.revision}",
        facts=facts,
        items=_entries(parts, {r["path"]: r for r in rows}, features),
        items_title="Parts and features",
        scene=scene(shapes, parts, up=_UP),
        legend=[(f"{kind.replace('_', ' ')} {many[kind]}", hexadecimal(rgb)) for kind, rgb in kinds.items()],
        sections=[("Tree", [tables["tree"]]), ("Features", [tables["object_features"]])],
    )


def object_tables(store: Store, connection: Connection, name: str, variant: str = "") -> dict[str, PageTable]:
    """The tables of an object's page by name.  Raises UsageError where the object is not loaded."""
    tree = read_tree(store, connection, name, variant)
    shapes, _ = _parts(store, connection, tree)
    return _tables(connection, tree_rows(store, connection, tree), [s["id"] for s in shapes])


def _tables(connection: Connection, rows: Sequence[Mapping[str, Any]], shape_ids: list[int]) -> dict[str, PageTable]:
    columns = ("path", "level", "number", "material", "mass", "size", "surfaces", "features", "attributes", "findings")
    return {
        "tree": PageTable("What stands in it", columns, [[r.get(c) for c in columns] for r in rows], name="tree"),
        "object_features": read_table(connection, "Features", "report/object_features", shape_ids=shape_ids),
    }


def diff_page(
    store: Store, connection: Connection, comparison: int, before: tuple[str, str], after: tuple[str, str]
) -> str:
    """The page of a comparison of two variants, given as (name, variant): what differs, on the later model."""
    trees = [read_tree(store, connection, *named) for named in (before, after)]
    changed = read_table(connection, "What differs", "compare/changes", comparison_id=comparison)
    changes = [r for r in changed.rows if r.level != "surface" and r.status != "identical"]
    colours = {"added": "added", "moved": "changed"}
    moved = {r.path: colours[r.status] for r in changes if r.level == "part" and r.status in colours}
    old_shapes, old_parts = _parts(store, connection, trees[0])
    shapes, parts = _parts(store, connection, trees[1], moved)
    ordinal = {p["path"]: i for i, p in enumerate(parts)}
    # What is no longer there is drawn where it was, and nothing else of its part.
    removed = {r.path: r.level == "part" for r in changes if r.status == "removed"}
    gone = [p for p in old_parts if p["path"] in removed]
    lost = {p["path"]: i for i, p in enumerate(gone, len(parts))}
    parts += [p | {"colour": "removed", "only": int(not removed[p["path"]])} for p in gone]
    known, used = {s["id"] for s in shapes}, {p["shape"] for p in gone}
    shapes += [s for s in old_shapes if s["id"] in used - known]
    rows = store.rows(connection, "report/object_features", shape_ids=[s["id"] for s in shapes])
    surfaces = {(int(r.shape_id), int(r.feature_no)): list(map(int, r.surfaces or ())) for r in rows}
    painted: dict[tuple[int, str], set[int]] = defaultdict(set)
    entries = []
    for r in changes:
        part = (lost if r.status == "removed" else ordinal).get(r.path)
        own = None
        if r.level == "feature":
            own = [] if part is None else surfaces.get((parts[part]["shape"], int(r.element_no)), [])
            if part is not None:
                painted[parts[part]["shape"], "changed" if r.status == "moved" else r.status].update(own)
        name = r.path if r.level == "part" else f"{r.after or r.before or r.kind or r.level} of {r.path}"
        entries.append(ListEntry(r.level, name, _motion(r), part, own, r.status, r.differs or ""))
    for s in shapes:
        s["paint"] = [[state, sorted(painted[s["id"], state])] for state in _COLOURED if (s["id"], state) in painted]
    counts = read_table(connection, "How much differs", "report/change_counts", comparison_id=comparison)
    facts = [
        (f"{r.level}s {r.status}", str(r.how_many), "")
        for r in counts.rows
        if r.level != "surface" and r.status in (*_COLOURED, "moved")
    ]
    title = " → ".join(" ".join(filter(None, named)) for named in (before, after))
    return render(
        store=store.name,
        title=title,
        word=title,
        over=f"Variants compared, revisions {trees[0].revision} and {trees[1].revision}",
        facts=facts,
        items=entries[:MOST_ITEMS],
        items_title="What differs",
        scene=scene(shapes, parts, up=_UP),
        legend=[(status, status) for status in _COLOURED],
        sections=[("Differences", [counts, changed])],
    )


def _motion(change: Any) -> str:
    """How far a thing moved, or by how much it turned where it did not."""
    if change.distance is None:
        return ""
    turned = change.distance < 1e-3 < change.angle
    return f"{np.degrees(change.angle):.3g}°" if turned else f"{change.distance:.3g} mm"


def _parts(
    store: Store, connection: Connection, tree: Tree, colours: dict[str, str] | None = None
) -> tuple[list[dict[str, Any]], list[Part]]:
    """The shapes of a tree and its parts that are material, in the colours given by path."""
    at = np.flatnonzero(tree.shape_id >= 0)
    paths = [tree.path[i] for i in at]
    given = [(colours or {}).get(path, "plain") for path in paths]
    return place_parts(store, connection, tree.shape_id[at], paths, tree.pose[at], given)[:2]


def _paint(store: Store, connection: Connection, shapes: list[dict[str, Any]]) -> dict[str, Rgb]:
    """Colour the surfaces of shapes by the kind of their feature; the kinds that there are, with their colours."""
    surfaces: dict[int, dict[str, list[int]]] = defaultdict(lambda: defaultdict(list))
    for r in store.rows(connection, "object/surface_features", shape_ids=[s["id"] for s in shapes]):
        surfaces[int(r.shape_id)][str(r.kind)].append(int(r.surface_no))
    kinds = sorted({kind for by_kind in surfaces.values() for kind in by_kind})
    colours = dict(zip(kinds, colours_of(kinds), strict=True))
    for s in shapes:
        by_kind = surfaces[s["id"]]
        s["paint"] = [[[round(c / 255, 3) for c in colours[kind]], by_kind[kind]] for kind in sorted(by_kind)]
    return colours


def _entries(parts: Sequence[Part], rows: dict[str, dict[str, Any]], features: Sequence[Any]) -> list[ListEntry]:
    """Parts, the first of each shape followed by its features.  rows: of the tree, by path."""
    by_shape: dict[int, list[Any]] = defaultdict(list)
    for f in features:
        by_shape[int(f.shape_id)].append(f)
    out: list[ListEntry] = []
    for number, p in enumerate(parts):
        mass = rows.get(p["path"], {}).get("mass")
        out.append(ListEntry("part", p["path"], f"{mass:.3g} kg" if mass else "", number))
        for f in by_shape.pop(p["shape"], ()):
            words = f.name or f"{f.kind} {f.feature_no}", f.kind.replace("_", " ")
            out.append(ListEntry("feature", *words, number, list(map(int, f.surfaces or ()))))
    return out[:MOST_ITEMS]


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
    "serial_characteristics": "Characteristics",
    "serial_states": "Parts and features",
    "serial_stops": "Stops",
    "serial_counts": "By kind of feature and by zone",
}


def serial_tables(connection: Connection, serial: str) -> dict[str, PageTable]:
    """The tables of a physical part's page by name."""
    return {name: read_table(connection, title, f"report/{name}", serial=serial) for name, title in _TABLES.items()}


def serial_page(store: Store, connection: Connection, serial: str, around: Mapping[str, Any] | None = None) -> str:
    """The page of a physical part, to be signed; around: as of a run's page.  Raises UsageError for an unknown one."""
    found = store.rows(connection, "report/serial_outcome", serial=serial)
    if not found:
        raise UsageError(f"no inspection was of the part {serial}: relmodel inspect --serial names it")
    tables = serial_tables(connection, serial)
    stops = [(int(row[0]), str(row[2])) for row in tables["serial_stops"].rows]
    rows = tables["serial_states"].rows
    drawn, part_of = _scene(store, connection, serial, rows, stops)
    cards = _cards(store, connection, tables["serial_findings"].rows, Faces(drawn, part_of) if drawn else None)
    entries = list_entries(rows, part_of)
    rest, passed = group_rest(rows)
    word = found[0].outcome[0].upper() + found[0].outcome[1:]
    newest = next((row[0] for row in reversed(tables["serial_stops"].rows) if row[3] is not None), stops[-1][0])
    sheet = dict(read_sheet(store, connection, newest)) | {"run": None, "stops": len(stops)}
    every = ("serial_findings", "serial_characteristics", "serial_states")
    folded = [replace(tables[name], folded=True) for name in every]
    return render(
        **(around or {}),
        store=store.name,
        title=f"{serial}: {word}",
        over="Inspection of a part, all stops",
        word=word,
        mood=found[0].mood,
        reason=found[0].unusable or "",
        sheet=list(sheet.items()),
        cards=cards,
        lines=make_lines(tables["serial_characteristics"].rows),
        rest=rest,
        passed=passed,
        seal=(f"serial {serial}", seal(store, connection, [run for run, _ in stops])),
        summary=[tables["serial_counts"], tables["serial_stops"]],
        items=entries,
        scene=drawn,
        legend=_LEGEND,
        sections=[("All rows", folded)],
    )


def _cards(store: Store, connection: Connection, rows: Sequence[Any], faces: Faces | None) -> list[Card]:
    """Findings of all stops, numbered on this page."""
    by_run: dict[int, dict[int, int]] = defaultdict(dict)
    for no, row in enumerate(rows, 1):
        by_run[int(row.run_id)][row.finding_no] = no
    cards: list[Card] = []
    for run, numbers in by_run.items():
        items = store.rows(connection, "report/items", run_id=run)
        seen = read_seen(store, connection, run, items)
        cards += read_cards(store, connection, run, seen, items, faces, numbers)
    return sorted(cards, key=lambda card: card.no)


def _scene(
    store: Store, connection: Connection, serial: str, states: Sequence[Any], stops: list[tuple[int, str]]
) -> tuple[dict[str, Any] | None, dict[int, int]]:
    """The whole part, features coloured by state, as at the newest usable stop; each placed part's in the scene."""
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
    back = -matrices(poses[0]._mapping)[:3, 2] if poses else None
    return scene(shapes, parts, back=back), part_of
