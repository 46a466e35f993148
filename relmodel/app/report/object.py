"""Pages of an object and of what differs between two of its variants."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from sqlalchemy import Connection

from relmodel.app.report.items import Entry, render_linked
from relmodel.app.report.page import PageTable, read_table
from relmodel.app.show.tree import Tree, read_tree, tree_rows
from relmodel.drawing.colours import Rgb, colours_of, hexadecimal
from relmodel.drawing.scene import Part, place_parts, scene
from relmodel.store import Store

MOST_ITEMS = 3000  # of the list next to the model
_COLOURED = ("added", "removed", "changed", "moved")
_UP = (0, 1, 0)  # of an object: as its drawings show it


def object_page(
    store: Store, connection: Connection, name: str, variant: str = "", around: Mapping[str, Any] | None = None
) -> str:
    """The page of an object: its tree, its features by kind, the model; around: as of a run's page.

    Raises UsageError where it is not loaded.
    """
    tree = read_tree(store, connection, name, variant)
    rows = tree_rows(store, connection, tree)
    shapes, parts = _parts(store, connection, tree)
    shape_ids = [s["id"] for s in shapes]
    kinds = _paint(store, connection, shapes)
    tables = _tables(connection, rows, shape_ids)
    rows_by_path = {r["path"]: r for r in rows}
    entries = _entries(store, connection, tree, parts, rows_by_path, shape_ids)
    whole = rows[0]
    facts = [
        ("parts", str(whole["parts"]), f"of {len(shape_ids)} shapes"),
        ("features", str(len(tables["object_features"].rows)), f"of {len(kinds)} kinds"),
    ]
    if whole["mass"]:
        facts.append(("mass", f"{whole['mass']:.4g} kg", ""))
    title = f"{name} {variant}".strip()
    return render_linked(
        store,
        entries,
        scene(shapes, parts, up=_UP),
        around,
        title=title,
        word=title,
        over=f"Object, revision {tree.revision}",
        facts=facts,
        items_title="Parts and features",
        legend=[(kind.replace("_", " "), hexadecimal(rgb)) for kind, rgb in kinds.items()],
        sections=[
            ("Tree", [tables["tree"]]),
            ("Features", [tables["object_features"], tables["object_kinds"]]),
        ],
    )


def object_tables(store: Store, connection: Connection, name: str, variant: str = "") -> dict[str, PageTable]:
    """The tables of an object's page by name.  Raises UsageError where the object is not loaded."""
    tree = read_tree(store, connection, name, variant)
    shapes, _ = _parts(store, connection, tree)
    return _tables(connection, tree_rows(store, connection, tree), [s["id"] for s in shapes])


def _tables(connection: Connection, rows: Sequence[Mapping[str, Any]], shape_ids: list[int]) -> dict[str, PageTable]:
    columns = ("path", "level", "number", "material", "mass", "size", "surfaces", "features", "attributes", "findings")
    tables = [
        PageTable("What stands in it", columns, [[r.get(c) for c in columns] for r in rows], name="tree"),
        read_table(connection, "Features", "report/object_features", shape_ids=shape_ids),
        read_table(connection, "Kinds", "report/object_kinds", shape_ids=shape_ids),
    ]
    return {t.name: t for t in tables}


def diff_page(
    store: Store, connection: Connection, comparison: int, before: tuple[str, str], after: tuple[str, str]
) -> str:
    """The page of a comparison of two variants, given as (name, variant): what differs, on the later model."""
    trees = [read_tree(store, connection, *named) for named in (before, after)]
    changes = store.rows(connection, "report/changed_items", comparison_id=comparison)
    moved = {r.path: r.status for r in changes if r.level == "part" and r.status in ("added", "moved")}
    shapes, parts = _parts(store, connection, trees[1], moved)
    gone = [_parts(store, connection, trees[0])] if any(r.status == "removed" for r in changes) else []
    ordinal = {p["path"]: i for i, p in enumerate(parts)}
    lost: dict[str, int] = {}
    for old_shapes, old_parts in gone:  # what is no longer there is drawn where it was, and nothing else of its part
        known = {s["id"] for s in shapes}
        shapes += [s for s in old_shapes if s["id"] not in known]
        removed = {r.path: r.level == "part" for r in changes if r.status == "removed"}
        for p in old_parts:
            if p["path"] in removed:
                lost[p["path"]] = len(parts)
                parts.append(p | {"colour": "removed", "only": int(not removed[p["path"]])})
    painted: dict[tuple[int, str], set[int]] = {}
    for r in changes:
        if r.level == "feature" and r.status in _COLOURED:
            painted.setdefault((int(r.shape_id), r.status), set()).update(map(int, r.surfaces))
    for s in shapes:
        s["paint"] = [[status, sorted(on)] for (shape, status), on in sorted(painted.items()) if shape == s["id"]]
    entries = [
        Entry(
            r.level,
            r.path if r.level == "part" else f"{r.name or r.kind or r.level} of {r.path}",
            _motion(r),
            (ordinal if r.after else lost).get(r.path),
            None if r.level == "part" else sorted({int(s) for s in r.surfaces}),
            r.status,
            r.differs or "",
        )
        for r in changes
        if r.level != "surface"
    ]
    counts = store.rows(connection, "report/change_counts", comparison_id=comparison)
    facts = [
        (f"{r.level}s {r.status}", str(r.how_many), "")
        for r in counts
        if r.level != "surface" and r.status in _COLOURED
    ]
    tables = [
        read_table(connection, "How much differs", "report/change_counts", comparison_id=comparison),
        read_table(connection, "What differs", "compare/changes", comparison_id=comparison),
    ]
    title = " → ".join(" ".join(filter(None, named)) for named in (before, after))
    return render_linked(
        store,
        entries[:MOST_ITEMS],
        scene(shapes, parts, up=_UP),
        title=title,
        word=title,
        over=f"Variants compared, revisions {trees[0].revision} and {trees[1].revision}",
        facts=facts,
        items_title="What differs",
        legend=[(status, status) for status in _COLOURED],
        sections=[("Differences", tables)],
    )


def _motion(change: Any) -> str:
    """How far a thing moved, or by how much it turned where it did not."""
    if change.distance is None:
        return ""
    if change.distance < 1e-3 < change.angle:
        return f"{np.degrees(change.angle):.3g}°"
    return f"{change.distance:.3g} mm"


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
    surfaces: dict[int, dict[str, list[int]]] = {}
    for r in store.rows(connection, "object/surface_features", shape_ids=[s["id"] for s in shapes]):
        surfaces.setdefault(int(r.shape_id), {}).setdefault(str(r.kind), []).append(int(r.surface_no))
    kinds = sorted({kind for by_kind in surfaces.values() for kind in by_kind})
    colours = dict(zip(kinds, colours_of(kinds), strict=True))
    for s in shapes:
        by_kind = surfaces.get(s["id"], {})
        s["paint"] = [[[round(c / 255, 3) for c in colours[kind]], by_kind[kind]] for kind in sorted(by_kind)]
    return colours


def _entries(
    store: Store,
    connection: Connection,
    tree: Tree,
    parts: Sequence[Part],
    rows_by_path: dict[str, dict[str, Any]],
    shape_ids: list[int],
) -> list[Entry]:
    """Parts, the first of each shape followed by its features."""
    features: dict[int, list[Any]] = {}
    for r in store.rows(connection, "report/feature_surfaces", shape_ids=shape_ids):
        features.setdefault(int(r.shape_id), []).append(r)
    out: list[Entry] = []
    for number, p in enumerate(parts):
        row = rows_by_path.get(p["path"], {})
        mass = row.get("mass")
        out.append(Entry("part", p["path"], f"{mass:.3g} kg" if mass else "", number))
        out += [
            Entry(
                "feature",
                f.name or f"{f.kind} {f.feature_no}",
                f.kind.replace("_", " "),
                number,
                list(map(int, f.surfaces)),
            )
            for f in features.pop(p["shape"], ())
        ]
    return out[:MOST_ITEMS]
