"""The report of a run: how it ended first, then what was seen, then the rows that it rests on."""

from __future__ import annotations

import math
import shlex
from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from markupsafe import Markup
from sqlalchemy import Connection

from relmodel.app.audit import find_run
from relmodel.app.report.characteristics import Line, label_picture, make_lines
from relmodel.app.report.page import ListEntry, PageTable, cell, clauses, read_table, render
from relmodel.app.report.pictures import RunPicture, read_pictures
from relmodel.arrays import Floats
from relmodel.drawing.draw import STATES, Seen, box_about, course, data_uri, edges_of, path_data, read_seen
from relmodel.drawing.solid import MOST_PARTS, Faces, Lines, camera_lines, ellipsoid_lines, place_parts, scene
from relmodel.geometry.transforms import matrices
from relmodel.store import Store
from relmodel.store.runs import seal

# How a run ended, in a word, and what that is for the one who reads: good, warn or bad.
_ENDS = {
    "failed": ("Failed", "bad"),
    "killed": ("Killed", "bad"),
    "finished": ("Done", "good"),
    "running": ("Under way", "warn"),
}


@dataclass(frozen=True)
class Layer:
    """A layer of drawings over the pictures: the class of its elements, a label, what a drawing with it contains."""

    name: str
    words: str
    mark: str
    on: bool = False


_LAYERS = (
    Layer("states", "states", " state-", True),
    Layer("unexplained-arcs", "not in the model", ' unexplained"'),
    Layer("met-arcs", "model edges found", ' met"', True),
    Layer("unmet-arcs", "model edges not found", ' unmet"'),
    Layer("smooth-arcs", "blends not found", "model smooth unmet"),
    Layer("taken", "image arcs matched", ' matched"'),
    Layer("rejected-arcs", "image arcs rejected", ' rejected"'),
    Layer("arcs", "all arcs", 'class="arc '),
    Layer("regions", "regions", "region "),
)


def run_page(store: Store, connection: Connection, run: int, around: Mapping[str, Any] | None = None) -> str:
    """The page of a run, of whatever kind and end; around: what stands about it where it is one of several.

    Raises UsageError where there is no such run."""
    tables = run_tables(store, connection, run)
    row = tables["run"].rows[0]
    pose, prior = (next(iter(tables[name].rows), None) for name in ("pose", "prior"))
    rows = store.rows(connection, "report/items", run_id=run)
    seen = read_seen(store, connection, run, rows)
    pictures = read_pictures(store, connection, run, seen, tables)
    scene, part_of = run_scene(store, connection, run)
    items = list_entries(rows, part_of, pictures)
    cards = []
    if tables["finding"].rows:
        cards = read_cards(store, connection, run, seen, rows, Faces(scene, part_of) if scene else None)
    lines = make_lines(tables["characteristic"].rows)
    sheet = read_sheet(store, connection, run)
    word, mood = _ENDS.get(row.state, (row.state, "warn"))
    reason = (pose.reason if pose is not None else row.message) or _NO_MORE.get(row.state, "")
    pruned = store.select(connection, "pruned_run", "by_run_id", run_id=run, what="runs")["by_run_id"]
    if len(pruned):
        word, mood = "Pruned", "warn"
        reason = f"run {pruned[0]} removed what it found; it had ended: {reason}"
    if pose is not None:
        word, mood = _headline(pose, tables["finding"].rows, lines)
        shown = store.rows(connection, "why/verdict/12_against", run=run)[:1]
        variants = store.rows(connection, "why/verdict/15_variants", run=run)
        reason = "; ".join([reason, *(r.sentence for r in (*shown, *variants))])
    drawn = Markup("").join(p.drawing for p in pictures)
    rest, passed = group_rest(r for r in tables["presence"].rows if r.level != "surface")
    number = {p.row.camera: i for i, p in enumerate(pictures)}
    for name in ("unexplained", "matched_arc", "rejected_arc"):
        tables[name] = replace(tables[name], marks=_marks(tables[name], number))
    named = {title: [query.rpartition("/")[2] for query in queries] for title, queries in _SECTIONS.items()}
    sections = [
        (title, [tables[name] for name in names])
        for title, names in named.items()
        if any(tables[name].rows for name in names)
    ]
    return render(
        **(around or {}),
        store=store.name,
        title=f"run {run}: {word}",
        over=f"{_KINDS.get(row.kind, row.kind)}, run {run}"
        + (f", world {prior.world} revision {prior.revision}" if prior is not None else "")
        + f", {cell(row.began_at)}",
        word=word,
        mood=mood,
        reason=reason,
        facts=_facts(tables, pose, prior, items),
        sheet=sheet,
        labelled=label_picture(seen, rows, cards, lines),
        cards=cards,
        lines=lines,
        rest=rest,
        passed=passed,
        unseen=_unseen(tables["characteristic"].rows, dict(sheet)),
        summary=[tables["standpoints"]] if tables["standpoints"].rows else (),
        seal=None if pose is None else (f"run {run}", seal(store, connection, [run])),
        pictures=pictures,
        layers=_layers(drawn),
        states=[s for s in STATES if f" state-{s}" in drawn],
        items=items,
        scene=scene,
        legend=LEGEND,
        sections=sections,
    )


def _headline(pose: Any, findings: Sequence[Any], lines: Sequence[Line]) -> tuple[str, str]:
    """The outcome in words, the part first where it can be told, with what has limits; its mood."""
    first, part, *others = clauses(pose.outcome)
    if findings and "finding" not in part:  # of another variant
        who = [r.decided_by for r in findings if r.decision == "accepted"]
        by = f", {len(who)} accepted by {', '.join(sorted(set(who)))}" if who else ""
        part += f" ({len(findings)} finding{'s' * (len(findings) > 1)}{by})"
    words = [part, first, *others] if pose.pose_verdict == "usable" else [first, part, *others]
    results, mood = Counter(line.result for line in lines if line.row.source), pose.mood
    if results:
        rest = [f"{results[it]} {it}" for it in ("does not conform", "not decidable", "not seen") if results[it]]
        words.append(", ".join([f"{results['conforms']} of {results.total()} characteristics conform", *rest]))
        mood = "bad" if results["does not conform"] else "warn" if rest and mood == "good" else mood
    return words[0][0].upper() + "; ".join(words)[1:], mood


def _unseen(rows: Sequence[Any], sheet: Mapping[str, Any]) -> tuple[str, str] | None:
    """How many sizes of the model were not seen, and the command that proposes views which show most of them."""
    left = sum(r.decision == "not seen" for r in rows)
    if not left:
        return None
    of = ["--object", rows[0].path.partition("/")[0], "--world", sheet["world"]]
    of = ["--serial", sheet["serial"]] if sheet["serial"] else of
    rig = (sheet["rig"] or "rig.yaml").partition(", SHA-256")[0]
    return f"{left} of {len(rows)} sizes of the model", shlex.join(["relmodel", "plan", *of, "--rig", rig])


def read_sheet(store: Store, connection: Connection, run: int) -> list[tuple[str, Any]]:
    """Name and value of what the head of a report that is signed says; of what is no inspection nothing."""
    return [item for r in store.rows(connection, "report/header", run_id=run) for item in r._mapping.items()]


_NO_MORE = {"running": "This is what it has committed so far.", "finished": "The run ended well."}
_KINDS = {
    "load": "Load of a model",
    "world": "World placed",
    "index": "Index made",
    "diff": "Variants compared",
    "extract": "Extraction from a picture",
    "inspect": "Inspection",
    "set": "Attribute set",
    "decide": "Finding decided",
    "stereo": "Pictures of a pair matched",
    "prune": "Room made in the store",
}


def _facts(
    tables: Mapping[str, PageTable], pose: Any, prior: Any, items: list[ListEntry]
) -> list[tuple[str, str, str]]:
    """Name, value and note of what the head of the page says."""
    facts = checked(tables["presence"].rows, items)
    if pose is not None and prior is not None:
        for r in tables["rules"].rows:
            if r.rule in _PRECISION:
                words, unit = _PRECISION[r.rule]
                facts.append((words, f"{r.value:.2g}{unit}", f"{r.gate:g}{unit} needed"))
    return facts


# Rules of the verdict that say how exactly the pose is known (two standard deviations): words and unit.
_PRECISION = {"translation": ("place known to", " mm"), "rotation": ("rotation known to", "°")}


def _layers(drawn: str) -> list[Layer]:
    """The layers that have something; of pictures that were not matched, all arcs are shown at first."""
    there = [layer for layer in _LAYERS if layer.mark in drawn]
    if "states" in [layer.name for layer in there]:  # these colour the same edges
        return [replace(layer, on=layer.name == "states") for layer in there]
    return there if 'class="model' in drawn else [replace(layer, on=layer.name == "arcs") for layer in there]


# The sections of the page: the named queries that give their tables, and the tables' titles.
_SECTIONS = {
    "What is there": {
        "result/finding": "Findings",
        "result/measured_size": "Sizes measured",
        "result/characteristic": "Characteristics",
        "result/measured_distance": "Distances measured",
        "result/presence": "Parts, features and faces",
        "result/unexplained": "Not in the model",
    },
    "Pose": {
        "report/rules": "Why this verdict",
        "report/pose": "Pose and verdict",
        "report/prior": "Prior",
        "report/corrections": "Base correction",
        "report/joints": "Joints",
        "report/standpoints": "Standpoints",
    },
    "Hypotheses": {"report/hypotheses": "Poses considered"},
    "Evidence": {
        "report/residuals": "Residuals of edge points",
        "result/matched_arc": "Matched arcs",
        "result/rejected_arc": "Rejected arcs",
    },
    "What was loaded": {"report/load": "Load", "report/findings": "Findings of the load"},
    "Time": {"report/steps": "Steps"},
    "What the run was given and wrote": {
        "report/inputs": "Files read",
        "report/written": "Rows written",
        "audit/run": "Parameters, versions and machine",
    },
}
_UPRIGHT = ("pose", "prior", "corrections", "load", "run")
_FOLDED = (
    *("characteristic", "presence", "measured_distance", "unexplained"),
    *("matched_arc", "rejected_arc", "run", "written"),
)


def run_tables(store: Store, connection: Connection, run: int) -> dict[str, PageTable]:
    """The tables of a run's page by name, those without rows too.  Raises UsageError where there is no such run."""
    find_run(store, connection, run)
    tables = [
        read_table(connection, title, query, run_id=run)
        for titles in _SECTIONS.values()
        for query, title in titles.items()
    ]
    return {t.name: replace(t, upright=t.name in _UPRIGHT, folded=t.name in _FOLDED) for t in tables}


def _marks(table: PageTable, number: dict[str, int]) -> list[str]:
    """Ids of the arcs and regions of each row in the pictures."""
    kinds = {"i": "image_arc_no", "m": "view_arc_no", "r": "region_no"}
    return [
        " ".join(f"c{number[r['camera']]}-{kind}{r[c]}" for kind, c in kinds.items() if r.get(c) is not None)
        if r["camera"] in number
        else ""
        for r in table.records
    ]


# Findings as cards: what each camera shows there, raw beside drawn, the size with its limit, the evidence in words.

_MOST_ODDS = 1_000_000
MOST_CROPS = 4  # of a finding: pictures that tell most of it


@dataclass(frozen=True)
class Crop:
    """A piece of a camera's picture: place and size u v width height, px, and the model drawn over it."""

    camera: str
    uri: str
    box: tuple[int, int, int, int]
    drawing: Markup


@dataclass(frozen=True)
class Card:
    """A finding: its number on the page, the run that it is of, and what is said of it; rings (n, 2), px, about the
    faces that it is of, by camera."""

    no: int
    run: int
    row: Any
    crops: list[Crop]
    rings: dict[str, list[Floats]]

    def face(self, camera: str) -> Markup:
        """Those, drawn."""
        course = "".join(path_data(ring, closed=True) for ring in self.rings.get(camera, ()))
        return Markup('<path class="face state-{}" d="{}"/>').format(self.row.state, course)

    @property
    def size(self) -> str:
        return size_words(self.row)

    @property
    def odds(self) -> str:
        most = self.row.evidence > math.log(_MOST_ODDS)
        words = f"over {_MOST_ODDS:,}" if most else f"{float(f'{math.exp(self.row.evidence):.2g}'):,.0f}"
        return f"{words} to 1 against it being as modelled"


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
    store: Store,
    connection: Connection,
    run: int,
    seen: Sequence[Seen],
    items: Sequence[Any],
    faces: Faces | None,
    numbers: dict[int, int] | None = None,
) -> list[Card]:
    """The findings of a run, whose pictures are `seen` and whose rows of `report/items` are `items`; faces: of the
    page's scene; numbers: of those wanted, on the page."""
    rows = store.rows(connection, "result/finding", run_id=run)
    of = {it.item_no: it for it in items}
    poses, cameras = (store.rows(connection, name, run_id=run) for name in ("report/pose_matrix", "result/camera"))
    views = {c.camera: (c, matrices(p._mapping) @ matrices(c._mapping)) for p in poses for c in cameras}
    off = {
        r.path
        for r in store.rows(connection, "result/presence", run_id=run)
        if r.level == "surface" and r.qif == "FAIL"
    }
    shown = {row.finding_no: row.finding_no for row in rows} if numbers is None else numbers
    telling: dict[int, list[str]] = defaultdict(list)
    for it in store.rows(connection, "report/item_cameras", run_id=run):
        telling[it.item_no].append(it.camera)
    out = []
    for row in (row for row in rows if row.finding_no in shown):
        item, part = of.get(row.item_no), row.path.rpartition("/")[0]
        drawn, surfaces = (edges_of(item), list(map(int, item.surfaces or ()))) if item else ([], [])
        # Of a feature the faces that are not as modelled, where that is told of single ones.
        surfaces = [no for no in surfaces if f"{part}/face {no}" in off] or surfaces
        card = Card(shown[row.finding_no], run, row, [], {})
        own = {
            it.row.camera: (it, it.image.size, mine)
            for it in seen
            if it.image is not None and (mine := [e for e in it.edges if (it.row.camera, e.number) in drawn])
        }
        most = [camera for camera in telling[row.item_no] or own if camera in own][:MOST_CROPS]
        for camera in sorted(most, key=list(own).index):
            one, size, mine = own[camera]
            box = box_about([e.points for e in mine], size)
            if faces and surfaces and camera in views:
                rings = faces.outline(*views[camera], int(row.occurrence_id), surfaces, box)
                card.rings[camera] = rings
                box = box_about(rings, size) if rings else box
            card.crops.append(_crop(one, {e.number for e in mine}, box))
        out.append(card)
    return out


def _crop(seen: Seen, own: set[int], box: tuple[int, int, int, int]) -> Crop:
    """What a camera shows within bounds, and the edges of the model there, its own among them."""
    assert seen.image is not None
    u0, v0, u1, v1 = box
    paths = [
        Markup('<path class="drawn state-{}{}" d="{}"/>').format(
            e.state, " own" if e.number in own else "", course(e.points)
        )
        for e in seen.edges
        if np.all(e.points.max(axis=0) > (u0, v0)) and np.all(e.points.min(axis=0) < (u1, v1))
    ]
    uri = data_uri(seen.image.crop(box))
    return Crop(seen.row.camera, uri, (u0, v0, u1 - u0, v1 - v0), Markup("").join(paths))


def group_rest(rows: Iterable[Any]) -> tuple[list[tuple[str, str, list[str]]], list[str]]:
    """State, reason and names of what is not checked, first what should be seen; names of what is as modelled."""
    groups: dict[tuple[str, str], list[str]] = defaultdict(list)
    for row in rows:
        groups[row.state, row.reason or "in view of no stop whose pose is usable"].append(row.path)
    order = ("not_confirmed", "undecidable", "not_seen")
    left = [(*key, names) for key, names in groups.items() if key[0] in order]
    passed = [path for key, names in groups.items() if key[0] == "confirmed" for path in names]
    return sorted(left, key=lambda g: (order.index(g[0]), -len(g[2]), g[1])), passed


def list_entries(rows: Sequence[Any], part_of: dict[int, int], pictures: Sequence[RunPicture] = ()) -> list[ListEntry]:
    """What a click on a name chooses: rows of `report/items`, or of `report/serial_states` where there are no pictures.
    part_of: which part of the scene a placed part is."""
    number = {p.row.camera: i for i, p in enumerate(pictures)}
    return [
        ListEntry(
            row.level,
            row.path,
            "",
            part_of.get(int(row.occurrence_id)),
            None if row.feature_no is None else list(map(int, row.surfaces or ())),
            arcs=[f"c{number[camera]}-m{no}" for camera, no in edges_of(row)] if pictures else (),
        )
        for row in rows
    ]


def checked(rows: Sequence[Any], entries: Sequence[ListEntry]) -> list[tuple[str, str, str]]:
    """Name, value and note: how much is in view, and how much of it was checked, by rows of `result/presence`."""
    facts = []
    for level in ("part", "feature"):
        states = [r.state for r in rows if r.level == level]
        done = sum(state in ("confirmed", "changed", "contradicted") for state in states)
        facts.append((f"{level}s checked", f"{done} of {len(states)}", f"{states.count('confirmed')} as modelled"))
    if rows or not entries:
        return facts if rows else []
    features = sum(e.surfaces is not None for e in entries)
    return [("in view", f"{len(entries) - features} parts", f"and {features} features")]


# The scene of an inspection in three dimensions: the placed parts, the cameras where they were thought and found.

LEGEND = (("in view", "seen"), ("cameras found", "pose"), ("prior, two sigma", "prior"), ("chosen", "chosen"))
_DEPTH = 0.3  # of the way to what the cameras look at, for the pyramids that stand for them
_NO_DEPTH_MM = 1000.0  # where nothing was measured


def run_scene(store: Store, connection: Connection, run: int) -> tuple[dict[str, Any] | None, dict[int, int]]:
    """The scene, None where the run was no inspection, and which of its parts each occurrence is."""
    worlds = store.select(connection, "inspection", "world_id", run_id=run)["world_id"].tolist()
    if not worlds:
        return None, {}
    rows = store.columns(connection, "report/scene_parts", world_id=worlds[0], run_id=run, most=MOST_PARTS)
    colours = ["seen" if it else "plain" for it in rows["in_view"]]
    shape_id = np.asarray(rows["shape_id"], np.int64)
    shapes, parts, kept = place_parts(store, connection, shape_id, rows["path"], matrices(rows), colours)
    rigs = [
        (colour, row)
        for colour, query in (("prior", "result/prior"), ("pose", "report/pose_matrix"))
        for row in store.rows(connection, query, run_id=run)
    ]
    lines, views = _cameras(store, connection, run, rigs)
    part_of = {int(rows["id"][row]): i for i, row in enumerate(kept)}
    back = -matrices(rigs[0][1]._mapping)[:3, 2] if rigs else np.array([0.0, 0.0, 1.0])
    return scene(shapes, parts, lines, views, back=back), part_of


def _cameras(
    store: Store, connection: Connection, run: int, rigs: Sequence[tuple[str, Any]]
) -> tuple[list[Lines], list[dict[str, Any]]]:
    """Pyramids of the cameras at the prior and at the pose found, ellipsoids about the rig; what cameras see, from the
    pose where there is one.  rigs: colours, and rows of transforms with covariances."""
    cameras = store.rows(connection, "result/camera", run_id=run)
    (looked_at,) = store.rows(connection, "report/looked_at", run_id=run)
    lines: list[Lines] = []
    views: list[dict[str, Any]] = []
    for colour, row in rigs:
        world_from_rig = matrices(row._mapping)
        away = _NO_DEPTH_MM if looked_at.x is None else np.linalg.norm(np.array(looked_at) - world_from_rig[:3, 3])
        depth = round(float(away), 3)  # a page is the same wherever it is made again
        at: list[float] = []
        views = []
        for camera in cameras:
            world_from_camera = world_from_rig @ matrices(camera._mapping)
            matrix = np.array([[camera.fx, camera.skew, camera.cx], [0, camera.fy, camera.cy], [0, 0, 1.0]])
            at += camera_lines(world_from_camera, matrix, camera.width, camera.height, _DEPTH * depth)
            views.append(_view(camera, world_from_camera, depth))
        rotation = world_from_rig[:3, :3]
        covariance = rotation @ np.reshape(row.covariance, (6, 6))[:3, :3] @ rotation.T
        at += ellipsoid_lines(world_from_rig[:3, 3], covariance, 2.0)
        lines.append({"colour": colour, "at": at})
    return lines, views


def _view(camera: Any, world_from_camera: Floats, depth: float) -> dict[str, Any]:
    """What a camera sees, for the script: slopes of half the picture across and down."""
    return {
        "name": camera.camera,
        "m": world_from_camera[:3].ravel().tolist(),
        "slope": [camera.width / camera.fx / 2, camera.height / camera.fy / 2],
        "depth": depth,
    }
