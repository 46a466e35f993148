"""The report of a run: how it ended first, then what was seen, then the rows that it rests on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from markupsafe import Markup
from sqlalchemy import Connection

from relmodel.app.audit.newest import find_run
from relmodel.app.report.findings import group_rest, read_cards
from relmodel.app.report.items import STATES, Entry, checked, read_entries, render_linked
from relmodel.app.report.page import PageTable, cell, read_table
from relmodel.app.report.pictures import RunPicture, read_pictures
from relmodel.app.report.plots import evidence_plots, pose_plots, times
from relmodel.app.report.run_scene import LEGEND, run_scene
from relmodel.drawing.model_edges import read_seen
from relmodel.store import Store
from relmodel.store.digests import seal

# How a run ended, in a word, and what that is for the one who reads: good, warn or bad.
_ENDS = {
    "failed": ("Failed", "bad"),
    "killed": ("Killed", "bad"),
    "finished": ("Done", "good"),
    "running": ("Under way", "warn"),
}


@dataclass(frozen=True)
class Layer:
    """A layer of drawings over the pictures: the class of its elements, and a label."""

    name: str
    words: str
    on: bool = False


_LAYERS = (
    Layer("states", "states", True),
    Layer("unexplained-arcs", "not in the model"),
    Layer("met-arcs", "model edges found", True),
    Layer("unmet-arcs", "model edges not found", True),
    Layer("smooth-arcs", "blends not found"),
    Layer("taken", "image arcs matched"),
    Layer("rejected-arcs", "image arcs rejected"),
    Layer("lines", "lines"),
    Layer("circular", "circular arcs"),
    Layer("elliptic", "elliptic arcs"),
    Layer("free", "free arcs"),
    Layer("regions", "regions"),
    Layer("ellipses", "error ellipses"),
)


def run_page(store: Store, connection: Connection, run: int, around: Mapping[str, Any] | None = None) -> str:
    """The page of a run, of whatever kind and end; around: what stands about it where it is one of several.

    Raises UsageError where there is no such run.
    """
    row = find_run(store, connection, run)
    pose = next(iter(store.rows(connection, "report/pose", run_id=run)), None)
    prior = next(iter(store.rows(connection, "report/prior", run_id=run)), None)
    seen = read_seen(store, connection, run)
    pictures = read_pictures(store, connection, run, seen)
    scene, part_of = run_scene(store, connection, run)
    items = read_entries(store, connection, run, pictures, part_of)
    word, mood = _ENDS.get(row.state, (row.state, "warn"))
    reason = (pose.reason if pose is not None else row.message) or _NO_MORE.get(row.state, "")
    if pruned := store.rows(connection, "audit/pruned", run=run):
        word, mood = "Pruned", "warn"
        reason = f"run {pruned[0].by_run_id} removed what it found; it had ended: {reason}"
    if pose is not None:
        word, mood = pose.outcome[0].upper() + pose.outcome[1:], pose.mood
        shown = store.rows(connection, "why/verdict/12_against", run=run)[:1]
        variants = store.rows(connection, "why/verdict/15_variants", run=run)
        reason = "; ".join([reason, *(r.sentence for r in (*shown, *variants))])
    drawn = Markup("").join(p.drawing for p in pictures)
    rest, passed = group_rest(store.rows(connection, "report/states", run_id=run))
    return render_linked(
        store,
        items,
        scene,
        around,
        title=f"run {run}: {word}",
        over=f"{_KINDS.get(row.kind, row.kind)}, run {run}"
        + (f", world {prior.world} revision {prior.revision}" if prior is not None else "")
        + f", {cell(row.began_at)}",
        word=word,
        mood=mood,
        reason=reason,
        facts=_facts(store, connection, run, row, pose, prior, items),
        sheet=read_sheet(store, connection, run),
        cards=read_cards(store, connection, run, seen),
        chosen={e.key: n for n, e in enumerate(items)},
        rest=rest,
        passed=passed,
        seal=None if pose is None else (f"run {run}", seal(store, connection, [run])),
        pictures=pictures,
        pictures_title="Pictures" if len(pictures) > 1 else "Picture",
        layers=_layers(drawn),
        states=[s for s in STATES if f" state-{s}" in drawn],
        items_title="In view",
        legend=LEGEND,
        sections=_sections(store, connection, run, pictures),
    )


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
    store: Store, connection: Connection, run: int, row: Any, pose: Any, prior: Any, items: list[Entry]
) -> list[tuple[str, str, str]]:
    """Name, value and note of what the head of the page says."""
    facts = checked(store, connection, run, items)
    if pose is not None and prior is not None:
        for r in store.rows(connection, "report/rules", run_id=run):
            if r.rule in _PRECISION:
                words, unit = _PRECISION[r.rule]
                facts.append((words, f"{r.value:.2g}{unit}", f"{r.gate:g}{unit} needed"))
        if prior.x is not None:
            away = np.linalg.norm([pose.x - prior.x, pose.y - prior.y, pose.z - prior.z])
            facts.append(("from the prior", f"{away:.3g} mm", ""))
        facts.append(
            ("edge evidence found", f"{min(pose.evidence_ratio, 1.0):.0%}".replace("%", " %"), "of what is expected")
        )
        facts.append(("probability", _probability(pose.posterior), "that the best pose is the right one"))
    if row.seconds is not None:
        facts.append(("time", f"{row.seconds:.3g} s", ""))
    return facts


# Rules of the verdict that say how exactly the pose is known (two standard deviations): words and unit.
_PRECISION = {"translation": ("place known to", " mm"), "rotation": ("rotation known to", "°")}


def _probability(p: float) -> str:
    return f"{100 * p:.3g} %" if p < 0.999 else "> 99.9 %"


def _layers(drawn: str) -> list[Layer]:
    """The layers that have something; of pictures that were not matched, the arcs by kind are shown at first."""
    classes = {
        "states": " state-",
        "unexplained-arcs": ' unexplained"',
        "met-arcs": ' met"',
        "unmet-arcs": ' unmet"',
        "smooth-arcs": "model smooth unmet",
        "taken": ' matched"',
        "rejected-arcs": ' rejected"',
        "lines": "arc line",
        "regions": "region ",
        "ellipses": '"ellipse"',
    }
    there = [layer for layer in _LAYERS if classes.get(layer.name, f"arc {layer.name}") in drawn]
    if "states" in [layer.name for layer in there]:  # these colour the same edges
        return [replace(layer, on=layer.name == "states") for layer in there]
    kinds = ("lines", "circular", "elliptic", "free")
    return there if 'class="model' in drawn else [replace(layer, on=layer.name in kinds) for layer in there]


# The tables of the page by the named query that gives each, queries/report/NAME.sql.
_TITLES = {
    "run_findings": "Findings",
    "checked": "How much was checked",
    "sizes": "Sizes measured",
    "distances": "Distances measured",
    "states": "Parts and features",
    "unexplained": "Not in the model",
    "rules": "Why this verdict",
    "pose": "Pose and verdict",
    "prior": "Prior",
    "corrections": "Base correction",
    "joints": "Joints",
    "hypotheses": "Poses considered",
    "residuals": "Residuals of edge points",
    "rejected_reasons": "Why image arcs were rejected",
    "matched": "Matched arcs",
    "rejected": "Rejected arcs",
    "load": "Load",
    "findings": "Findings of the load",
    "steps": "Steps",
    "inputs": "Files read",
    "written": "Rows written",
    "run": "Parameters, versions and machine",
}
_UPRIGHT = ("pose", "prior", "corrections", "load", "run")
_FOLDED = ("states", "distances", "unexplained", "matched", "rejected", "written", "run")


def run_tables(store: Store, connection: Connection, run: int) -> dict[str, PageTable]:
    """The tables of a run's page by name, those without rows too.  Raises UsageError where there is no such run."""
    find_run(store, connection, run)
    return {
        name: replace(
            read_table(connection, title, f"report/{name}", run_id=run),
            upright=name in _UPRIGHT,
            folded=name in _FOLDED,
        )
        for name, title in _TITLES.items()
    }


def _sections(
    store: Store, connection: Connection, run: int, pictures: list[RunPicture]
) -> list[tuple[str, list[Any]]]:
    tables = run_tables(store, connection, run)
    number = {p.camera: i for i, p in enumerate(pictures)}
    for name in ("unexplained", "matched", "rejected"):
        tables[name] = replace(tables[name], marks=_marks(tables[name], number))
    tables["steps"] = times(tables["steps"])

    def those(*names: str) -> list[PageTable]:
        return [tables[name] for name in names if tables[name].rows]

    return [
        ("What is there", those("run_findings", "checked", "sizes", "distances", "states", "unexplained")),
        (
            "Pose",
            [*those("rules", "pose", "prior"), *pose_plots(store, connection, run), *those("corrections", "joints")],
        ),
        ("Hypotheses", those("hypotheses")),
        (
            "Evidence",
            [
                *evidence_plots(store, connection, run),
                *those("residuals", "rejected_reasons", "matched", "rejected"),
            ],
        ),
        ("What was loaded", those("load", "findings")),
        ("Time", those("steps")),
        ("What the run was given and wrote", those("inputs", "written", "run")),
    ]


def _marks(table: PageTable, number: dict[str, int]) -> list[str]:
    """Ids of the arcs and regions of each row in the pictures."""
    columns = list(table.columns)
    camera = columns.index("camera")
    arcs = [
        (kind, columns.index(c))
        for kind, c in (("i", "image_arc_no"), ("m", "view_arc_no"), ("r", "region_no"))
        if c in columns
    ]
    return [
        " ".join(f"c{number[r[camera]]}-{kind}{r[i]}" for kind, i in arcs if r[i] is not None)
        if r[camera] in number
        else ""
        for r in table.rows
    ]
