"""The report of a run: how it ended first, then what was seen, then the rows that it rests on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from markupsafe import Markup
from sqlalchemy import Connection

import relmodel
from relmodel.errors import UsageError
from relmodel.report.items import STATES, Item, checked, item_data, read_items
from relmodel.report.page import Table, cell, read_table, render
from relmodel.report.pictures import RunPicture, read_pictures
from relmodel.report.plots import evidence_plots, pose_plots, times
from relmodel.report.run_scene import LEGEND, run_scene
from relmodel.store import Store

# How a run ended, in a word, and what that is for the one who reads: good, warn or bad.
_ENDS = {
    "accepted": ("Accepted", "good"),
    "ambiguous": ("Ambiguous", "warn"),
    "refused": ("Refused", "bad"),
    "failed": ("Failed", "bad"),
    "killed": ("Killed", "bad"),
    "finished": ("Done", "good"),
    "running": ("Under way", "warn"),
}


@dataclass(frozen=True)
class Layer:
    """What can be drawn over the pictures: the class that its elements are told apart by, and words."""

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
    found = store.rows(connection, "report/run", run_id=run)
    if not found:
        raise UsageError(f"there is no run {run}: relmodel runs lists those that there are")
    told = found[0]
    pose = next(iter(store.rows(connection, "report/pose", run_id=run)), None)
    prior = next(iter(store.rows(connection, "report/prior", run_id=run)), None)
    items = read_items(store, connection, run)
    pictures = read_pictures(store, connection, run)
    scene, part_of = run_scene(store, connection, run)
    word, mood = _ENDS.get(told.state if pose is None else pose.verdict, (told.state, "warn"))
    reason = (pose.reason if pose is not None else told.message) or _NO_MORE.get(told.state, "")
    drawn = Markup("").join(p.drawing for p in pictures)
    return render(
        "run.html",
        **(around or {}),
        title=f"run {run}: {word}",
        over=f"{_kind(told.kind)}, run {run}"
        + (f", world {prior.world} revision {prior.revision}" if prior is not None else "")
        + f", {cell(told.began_at)}",
        word=word,
        mood=mood,
        reason=reason,
        facts=_facts(store, connection, run, told, pose, prior, items),
        pictures=pictures,
        pictures_title="Pictures" if len(pictures) > 1 else "Picture",
        layers=_layers(drawn),
        states=[s for s in STATES if f" state-{s}" in drawn],
        items=items,
        items_title="In view",
        scene=scene,
        legend=LEGEND,
        data={"items": item_data(store, connection, run, items, pictures, part_of), "scene": scene},
        sections=_sections(store, connection, run, pictures),
        footer=f"Made by relmodel {relmodel.__version__} from rows of the store {store.name}.",
    )


_NO_MORE = {"running": "This is what it has committed so far.", "finished": "The run ended well."}
_KINDS = {
    "load": "Load of a model",
    "world": "World placed",
    "index": "Index made",
    "diff": "Variants compared",
    "extract": "Extraction from a picture",
    "inspect": "Inspection",
    "set": "Attribute set",
    "stereo": "Pictures of a pair matched",
    "prune": "Room made in the store",
}


def _kind(kind: str) -> str:
    return _KINDS.get(kind, kind)


def _facts(
    store: Store, connection: Connection, run: int, told: Any, pose: Any, prior: Any, items: list[Item]
) -> list[tuple[str, str, str]]:
    """Name, value and note of what the head of the page says."""
    facts = []
    if pose is not None and prior is not None:
        for r in store.rows(connection, "report/rules", run_id=run):
            if r.rule in _PRECISION:
                words, unit = _PRECISION[r.rule]
                facts.append((words, f"{r.value:.2g}{unit}", f"{r.gate:g}{unit} needed"))
        away = np.linalg.norm([pose.x - prior.x, pose.y - prior.y, pose.z - prior.z])
        facts.append(("from the prior", f"{away:.3g} mm", ""))
        facts.append(("edge evidence found", f"{100 * pose.evidence_ratio:.0f} %", "of what is expected"))
        facts.append(("probability", _probability(pose.posterior), "that the best pose is the right one"))
    facts += checked(store, connection, run, items)
    if told.seconds is not None:
        facts.append(("time", f"{told.seconds:.3g} s", ""))
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


def _sections(
    store: Store, connection: Connection, run: int, pictures: list[RunPicture]
) -> list[tuple[str, list[Any]]]:
    def table(title: str, name: str, **shape: Any) -> Table:
        return replace(read_table(connection, title, f"report/{name}", run_id=run), **shape)

    number = {p.camera: i for i, p in enumerate(pictures)}
    alien = table("Not in the model", "unexplained", folded=True)
    matched, rejected = table("Matched arcs", "matched", folded=True), table("Rejected arcs", "rejected", folded=True)
    inspected: list[tuple[str, list[Any]]] = [
        (
            "What is there",
            [
                table("How much was checked", "checked"),
                table("Sizes measured", "sizes"),
                table("Parts and features", "states", folded=True),
                replace(alien, marks=_marks(alien, number)),
            ],
        ),
        (
            "Pose",
            [
                table("Why this verdict", "rules"),
                table("Pose and verdict", "pose", upright=True),
                table("Prior", "prior", upright=True),
                *pose_plots(store, connection, run),
                table("Base correction", "corrections", upright=True),
                table("Joints", "joints"),
            ],
        ),
        ("Hypotheses", [table("Poses considered", "hypotheses")]),
        (
            "Evidence",
            [
                *evidence_plots(store, connection, run),
                table("Residuals of edge points", "residuals"),
                table("Why image arcs were rejected", "rejected_reasons"),
                replace(matched, marks=_marks(matched, number)),
                replace(rejected, marks=_marks(rejected, number)),
            ],
        ),
    ]
    others: list[tuple[str, list[Any]]] = [
        ("What was loaded", [table("Load", "load", upright=True), table("Findings", "findings")]),
        ("Time", [times(table("Steps", "steps"))]),
        (
            "What the run was given and wrote",
            [
                table("Files read", "inputs"),
                table("Rows written", "written", folded=True),
                table("Parameters, versions and machine", "run", upright=True, folded=True),
            ],
        ),
    ]
    return [
        (title, [b for b in blocks if not isinstance(b, Table) or b.rows or b.empty])
        for title, blocks in [*inspected, *others]
    ]


def _marks(table: Table, number: dict[str, int]) -> list[str]:
    """Ids of the arcs of each row in the pictures."""
    columns = list(table.columns)
    camera = columns.index("camera")
    arcs = [(kind, columns.index(c)) for kind, c in (("i", "image_arc_no"), ("m", "view_arc_no")) if c in columns]
    return [
        " ".join(f"c{number[r[camera]]}-{kind}{r[i]}" for kind, i in arcs if r[i] is not None)
        if r[camera] in number
        else ""
        for r in table.rows
    ]
