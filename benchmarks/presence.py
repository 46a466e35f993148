"""How true the states of parts, features and surfaces are, on pictures whose truth is known.

    python -m benchmarks.presence run FOLDER [--renders TRIALS] [--only NAME ...]   # a line of JSON a trial, resumable
    python -m benchmarks.presence table FOLDER [--misses]                           # figures, and what was missed

Trials are pictures with the right model (whatever is said against it is false) and pictures with the model of another
variant, or of the part before it was changed.  Poses are found from the priors at hand, and trials whose pose is not
found are counted apart.  Poses and extractions are kept in FOLDER/poses: with presence.jsonl removed, only presence is
computed again.  RELMODEL_TEST_DATA names the test data; without it there is the demonstration.  TRIALS is what
`python -m examples.render.trials` wrote.
"""

from __future__ import annotations

import argparse
import json
import os
import pickle
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from tabulate import tabulate

from benchmarks.trials import (
    SAMPLED_PX,
    Models,
    Trial,
    add_line,
    demonstration,
    find_differing,
    read_lines,
    rendered,
    shared_bulkheads,
)
from examples.bulkhead.design import variant_a
from examples.bulkhead.variation import boxes
from relmodel.arrays import Floats, Ints
from relmodel.geometry.transforms import apply, inverse
from vision.cameras.cameras import Rig
from vision.extraction.extract import extract
from vision.extraction.rows import Primitives, make_primitives
from vision.inspection.demonstration import Truth, measure_pose_error
from vision.localisation.localise import Localisation, localise
from vision.localisation.views import ModelView, Observation, view_model
from vision.localisation.visibility import find_parts_in_view
from vision.presence.report import describe, tabulate_presence
from vision.presence.states import Presence, assess
from vision.scene import Scene, StoredScene

FOUND_MM = 2.0  # error of the pose at the target up to which what is said at it counts
LEAST_PX = 200  # pixels from which an item, or a change in one camera, counts as seen
LEAST_MM = 1.5  # of a change of size or place, to count
MARGIN_MM = 3.0  # around the box of a change, for what belongs to it
MARGIN_PX = 15.0  # likewise in the picture, for what nothing explains
AGAINST = ("contradicted", "changed", "not_confirmed")


@dataclass(frozen=True)
class Case:
    """A trial, the place of the part, and what is truly otherwise than its model says: rows with name, kind, change,
    amount, boxes before and after in the part's frame, and `seen_px`, the most pixels that differ in one camera."""

    trial: Trial
    world_from_object: Floats
    changes: list[dict[str, Any]]

    @property
    def truth(self) -> Truth:
        assert self.trial.world_from_rig is not None
        return Truth("", self.trial.world_from_rig, self.trial.target)


def cases(models: Models, renders: Path | None, is_wanted: Callable[[str], bool]) -> Iterator[Case]:
    """Pictures with their right model, then with another; those whose name is wanted."""
    data = os.environ.get("RELMODEL_TEST_DATA")
    golden = Path("examples/bulkhead/golden/changes_A_to_B.json")
    places = boxes(variant_a())
    components = [
        {"name": name, "kind": name.split("_")[0].lower(), "change": change, "box": places[name]}
        for name, change in (("CLIP_2", "turned"), ("BOLT_F13", "removed"))
    ]
    demo = [(trial, _boxes(json.loads(golden.read_text()) + components)) for trial in demonstration(models)]
    shared: list[tuple[Trial, list[dict[str, Any]]]] = []
    if data:
        differences = json.loads((Path(data) / "bulkhead/diff_truth.json").read_text())["features"]
        shared = [(t, _boxes(differences)) for t in shared_bulkheads(Path(data), models, ("small",))]
    for trial, _ in demo + shared:
        if is_wanted(trial.name):
            yield Case(trial, models.sources[trial.model][1], [])
    for trial, changes in demo + shared:
        own, other = trial.model, {"A": "B", "B": "A"}.get(trial.model[-1])
        name = f"{trial.name} as {other}"
        if other is None or not is_wanted(name):
            continue
        placed = models.sources[own][1]
        model = models.add(f"{own[:-1]}{other}_for_{own[-1]}", models.sources[f"{own[:-1]}{other}"][0], placed)
        if other == "B":  # told as from A to B
            changes = [{**c, "box_before": c["box_after"], "box_after": c["box_before"]} for c in changes]
        seen = _count_differing(models.scene(own), models.scene(model), trial, placed, changes)
        yield Case(
            replace(trial, name=name, kind="another", model=model),
            placed,
            [{**c, "seen_px": int(n)} for c, n in zip(changes, seen, strict=True)],
        )
    for trial in rendered(renders, models) if renders else ():
        if trial.group not in ("finish", "changed") or len(trial.pictures) < 2:
            continue
        (file,) = Path(str(renders)).glob(f"*/{trial.name}_truth.json")
        if not is_wanted(trial.name):
            continue
        rows = [row for row in json.loads(file.read_text()).get("changes", []) if row["name"]]
        seen_px = [max(row[side]["differing_px"] for side in trial.pictures) for row in rows]
        rows = [{**row, "seen_px": n} for row, n in zip(rows, seen_px, strict=True)]
        yield Case(trial, models.sources[trial.model][1], rows)


def _boxes(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Changes from A to B as rows with flat boxes."""
    out = []
    for row in rows:
        box = np.ravel(row["box"]).tolist()
        values = row.get("values", {}).get(
            "box", {"before": np.ravel(row.get("box_before", box)).tolist(), "after": box}
        )
        gone, new = "removed" in row["change"], "added" in row["change"]
        out.append(
            {
                "name": row.get("name", row.get("feature")),
                "kind": row.get("kind", row.get("feature", "").rpartition("_")[0]),
                "change": row["change"],
                "amount": {"diameter_after": 2 * row["values"]["radius"]["after"]}
                if "radius" in row.get("values", {})
                else {},
                "box_before": None if new else values["before"],
                "box_after": None if gone else values["after"],
            }
        )
    return out


def _count_differing(shown: Scene, model: Scene, trial: Trial, placed: Floats, changes: list[dict[str, Any]]) -> Ints:
    """The most pixels of a camera in which two models differ by 0.1 mm and more along the ray within each change."""
    most = np.zeros(len(changes), np.int64)
    for points in find_differing(shown, model, trial):
        local = [apply(inverse(placed), p) for p in points]
        for k, change in enumerate(changes):
            own = np.zeros(len(points[0]), bool)
            for box in (change["box_before"], change["box_after"]):
                if box is not None:
                    for p in local:
                        own |= ((p > np.array(box[:3]) - MARGIN_MM) & (p < np.array(box[3:]) + MARGIN_MM)).all(axis=1)
            most[k] = max(most[k], int(own.sum()) * SAMPLED_PX**2)
    return most


def run(folder: Path, renders: Path | None, only: list[str]) -> None:
    """Assess every trial that has no line yet."""
    poses = folder / "poses"
    poses.mkdir(parents=True, exist_ok=True)
    file, models = folder / "presence.jsonl", Models(folder)
    done = {line["name"] for line in read_lines(file)}

    def is_wanted(name: str) -> bool:
        return name not in done and (not only or any(word in name for word in only))

    for case in cases(models, renders, is_wanted):
        line = measure(case, models.stored(case.trial.model), poses / f"{case.trial.name.replace(' ', '_')}.pickle")
        add_line(file, line)
        print(f"{case.trial.name}: {line['verdict']}, off {line['off_mm']} mm, {line['processor_s']} s", flush=True)


def measure(case: Case, stored: StoredScene, kept: Path) -> dict[str, Any]:
    """What is said of a trial's items, each with its box in the part's frame, and of its changes; kept: where the
    extractions and the pose are, or are put."""
    trial = case.trial
    pictures, found = locate(trial, stored, kept)
    assert found.best is not None
    pose = found.best.world_from_rig
    view = view_at_best(stored, found)
    parts = find_parts_in_view(stored, found.rig, view.maps, pose)
    began = time.process_time()
    presence = assess(stored, Observation(trial.rig, pictures, trial.pictures), found, view, parts)
    seconds = time.process_time() - began
    said = describe(tabulate_presence(presence))
    box = _measure_boxes(stored.scene, presence, case.world_from_object)
    for item, own, kind in zip(said["items"], box.tolist(), presence.items.kind, strict=True):
        item.update(box=[round(v, 2) for v in own], kind=kind)
    return {
        "name": trial.name,
        "group": trial.group,
        "kind": "right" if not case.changes else "another",
        "verdict": found.verdict.verdict,
        "off_mm": round(measure_pose_error(pose, case.truth).target_mm, 4),
        "processor_s": round(seconds, 2),
        "changes": [
            {**c, "pictured": _project(c["box_after"], trial.rig, case.truth.world_from_rig, case.world_from_object)}
            for c in case.changes
        ],
        "items": said["items"],
        "unexplained": said["unexplained"],
    }


def view_at_best(stored: StoredScene, found: Localisation) -> ModelView:
    """What the cameras should see at the best pose."""
    assert found.best is not None
    arcs = {name: view.arcs for name, view in found.views.items()}
    return view_model(stored.scene, found.rig, found.best.world_from_rig, arcs)


def locate(trial: Trial, stored: StoredScene, kept: Path) -> tuple[dict[str, Primitives], Localisation]:
    """Extractions and pose of a trial, from the file `kept` or put there."""
    if not kept.exists():
        extracted = {name: make_primitives(extract(picture)) for name, picture in trial.pictures.items()}
        assert trial.prior is not None
        seen = Observation(trial.rig, extracted, trial.pictures)
        located = localise(stored.scene, seen, trial.prior)
        kept.write_bytes(pickle.dumps((extracted, located)))
    pictures, found = pickle.loads(kept.read_bytes())
    return pictures, found


def _measure_boxes(scene: Scene, presence: Presence, placed: Floats) -> Floats:
    """Boxes (n, 6) of items in the part's frame."""
    items, there = presence.items, apply(inverse(placed), scene.vertices)
    corner = there[scene.triangles].reshape(-1, 3)
    surface = np.repeat(scene.triangle_surface, 3)
    low, high = np.full((2, len(scene.surface_occurrence), 3), np.inf)
    np.minimum.at(low, surface, corner)
    np.minimum.at(high, surface, -corner)
    out = np.full((len(items), 6), np.inf)
    np.minimum.at(out, items.member, np.concatenate([low, high], axis=1)[items.surface])
    return np.concatenate([out[:, :3], -out[:, 3:]], axis=1)


def _project(box: list[float] | None, rig: Rig, world_from_rig: Floats, placed: Floats) -> dict[str, list[float]]:
    """Bounds x0 y0 x1 y1 (px) of a box by camera."""
    if box is None:
        return {}
    corners = np.stack(np.meshgrid(*zip(box[:3], box[3:], strict=True)), axis=-1).reshape(-1, 3)
    out = {}
    for name, camera in rig.cameras.items():
        pose = world_from_rig @ rig.rig_from_camera[name]
        pixel, front = camera.project(apply(inverse(pose) @ placed, corners))
        if front.all():
            out[name] = [*pixel.min(axis=0).round(1).tolist(), *pixel.max(axis=0).round(1).tolist()]
    return out


# Figures


def is_told(change: dict[str, Any], line: dict[str, Any]) -> str:
    """How a change is told: the state of the worst item that it concerns, 'unexplained', 'surface', or ''."""
    boxes = [np.array(b, float) for b in (change["box_before"], change["box_after"]) if b is not None]
    for level in ("part feature", "surface"):
        for item in line["items"]:
            if item["level"] not in level or item["state"] not in AGAINST:
                continue
            if change["box_before"] is not None and any(concerns(np.array(item["box"]), box) for box in boxes):
                return str(item["state"]) if level != "surface" else "surface"
    for seen in line["unexplained"]:
        frame = change["pictured"].get(seen["camera"])
        x, y = (seen["box"][0] + seen["box"][2]) / 2, (seen["box"][1] + seen["box"][3]) / 2
        if (
            frame
            and frame[0] - MARGIN_PX < x < frame[2] + MARGIN_PX
            and frame[1] - MARGIN_PX < y < frame[3] + MARGIN_PX
        ):
            return "unexplained"
    return ""


def concerns(item: Floats, change: Floats) -> bool:
    """Whether an item lies within a change's box, or is about as large and about there."""
    inside = (item[:3] > change[:3] - MARGIN_MM).all() and (item[3:] < change[3:] + MARGIN_MM).all()
    middle = (change[:3] + change[3:]) / 2
    around = ((item[:3] <= middle) & (middle <= item[3:])).all()
    alike = (item[3:] - item[:3] < 3 * (change[3:] - change[:3]) + 2 * MARGIN_MM).all()
    return bool(inside or (around and alike))


def _touches(item: dict[str, Any], line: dict[str, Any]) -> bool:
    """Whether an item may rightly be told to differ: its box meets that of a change."""
    own = np.array(item["box"])
    for change in line["changes"]:
        for box in (change["box_before"], change["box_after"]):
            if box is not None:
                b = np.array(box, float)
                if (own[:3] < b[3:] + MARGIN_MM).all() and (own[3:] > b[:3] - MARGIN_MM).all():
                    return True
    return False


def table(folder: Path, misses: bool) -> None:
    """Rates of false states by set and level, changes told by kind, sizes of holes, cost."""
    lines = read_lines(folder / "presence.jsonl")
    good = [line for line in lines if line["off_mm"] <= FOUND_MM]
    print(f"{len(good)} of {len(lines)} trials have their pose within {FOUND_MM} mm; the others are left out")
    _print_false(good, misses)
    _print_told([line for line in good if line["changes"]], misses)
    _print_holes(good, misses)
    seconds = [line["processor_s"] for line in good]
    print(f"processor time: median {np.median(seconds):.2f} s, most {max(seconds):.2f} s")


def _print_false(lines: list[dict[str, Any]], misses: bool) -> None:
    rows = []
    groups = sorted({(line["kind"], line["group"]) for line in lines})
    for kind, group in [*groups, ("right", ""), ("another", "")]:
        for level in ("part", "feature", "surface"):
            own = [
                (line, item)
                for line in lines
                if line["kind"] == kind and group in ("", line["group"])
                for item in line["items"]
                if item["level"] == level and item["visible_pixels"] >= LEAST_PX and not _touches(item, line)
            ]
            states = [item["state"] for _, item in own]
            if not states:
                continue
            share = {s: states.count(s) / len(states) for s in (*AGAINST, "undecidable")}
            rows.append(
                (kind, group or "all", level, len(states), share["contradicted"] + share["changed"],
                 share["not_confirmed"], share["undecidable"])
            )  # fmt: skip
            if misses and group:
                for line, item in own:
                    if item["state"] in AGAINST and level != "surface":
                        print("false:", line["name"], _words(item))
    heads = ("model", "set", "level", f"of {LEAST_PX} px", "contradicted or changed", "not confirmed", "undecidable")
    print(tabulate(rows, headers=heads, floatfmt=".3f"))


def _words(item: dict[str, Any]) -> str:
    sizes = ", ".join(f"{m['what']} {m['nominal']} -> {m['value']} +- {m['sigma']}" for m in item["measured"])
    return (
        f"{item['path']} ({item['kind']}): {item['state']}, {item['reason']}; log odds {item['log_odds']:.1f} of "
        f"{item['expected_log_odds']:.1f}, {item['supported_px']:.0f} of {item['distinct_px']:.0f} px of edges; {sizes}"
    )


def _print_told(lines: list[dict[str, Any]], misses: bool) -> None:
    told: dict[tuple[str, str], list[str]] = {}
    for line in lines:
        for change in line["changes"]:
            if change["seen_px"] < LEAST_PX or _is_slight(change):
                continue
            how = is_told(change, line)
            for key in ((change["kind"], change["change"]), ("all", line["group"]), ("all", "")):
                told.setdefault(key, []).append(how)
            if misses and not how:
                print("missed:", line["name"], change["name"], change["kind"], change["change"], change["amount"],
                      f"{change['seen_px']} px")  # fmt: skip
    rows = [
        (*key, len(how), sum(map(bool, how)) / len(how), sum(h in AGAINST for h in how) / len(how),
         *(how.count(s) for s in (*AGAINST, "surface", "unexplained", "")))
        for key, how in sorted(told.items())
    ]  # fmt: skip
    heads = ("kind", "change", f"of {LEAST_PX} px", "told", "by state", *AGAINST, "surface", "unexplained", "missed")
    print(tabulate(rows, headers=heads, floatfmt=".2f"))


def _is_slight(change: dict[str, Any]) -> bool:
    """Whether the box changes by less than LEAST_MM: a wall beside a thicker one, a floor a millimetre deeper."""
    before, after = change["box_before"], change["box_after"]
    if before is None or after is None or change["change"] not in ("changed", "deepened"):
        return False
    return bool(np.abs(np.subtract(before, after)).max() < LEAST_MM)


def _print_holes(lines: list[dict[str, Any]], misses: bool) -> None:
    """Diameters of holes that are as the model says, and of those that were resized."""
    off, sigmas, resized = [], [], []
    for line in lines:
        for item in line["items"]:
            sizes = [m for m in item["measured"] if m["what"] == "diameter"]
            if item["level"] == "feature" and item["state"] == "confirmed" and not _touches(item, line):
                off += [m["value"] - m["nominal"] for m in sizes]
                sigmas += [m["sigma"] for m in sizes]
        for change in line["changes"]:
            after = change["amount"].get("diameter_after")
            if change["kind"] not in ("hole", "lightening_hole") or after is None or change["seen_px"] < LEAST_PX:
                continue
            box = np.array(change["box_before"], float)
            across = max((f[2] - f[0] for f in change["pictured"].values()), default=0.0)
            own = [i for i in line["items"] if i["level"] == "feature" and "hole" in i["kind"]
                   and np.abs(np.array(i["box"])[[0, 1, 3, 4]] - box[[0, 1, 3, 4]]).max() < 1]  # fmt: skip
            values = [m["value"] for i in own for m in i["measured"] if m["what"] == "diameter" and m["changed"]]
            resized.append((line["name"], change["name"], across, after, values, [i["state"] for i in own]))
    if off:
        z = np.abs(np.array(off)) / np.array(sigmas)
        print(
            f"{len(off)} diameters of what is as the model says: off by {np.median(off):.3f} mm in the median, "
            f"{np.percentile(np.abs(off), 95):.3f} mm for 19 of 20; within 2 sigma {np.mean(z < 2):.3f}, "
            f"3 sigma {np.mean(z < 3):.3f}"
        )
    large = [r for r in resized if r[2] >= 40]
    told = [r for r in large if any(abs(v - r[3]) < 1.0 for v in r[4])]
    if large:
        print(f"{len(told)} of {len(large)} resized holes of 40 px and more have their new diameter told to 1 mm")
    if misses:
        for r in large:
            print("hole:" if r in told else "hole missed:", *r)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("run", "table"))
    parser.add_argument("folder", type=Path)
    parser.add_argument("--renders", type=Path, help="trials that examples.render.trials wrote")
    parser.add_argument("--only", nargs="*", default=[], help="trials whose name holds one of these")
    parser.add_argument("--misses", action="store_true", help="list false states and changes missed")
    args = parser.parse_args()
    if args.what == "run":
        run(args.folder, args.renders, args.only)
    else:
        table(args.folder, args.misses)


if __name__ == "__main__":
    main()
