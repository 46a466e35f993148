"""Models with what the part in the pictures does not have: another variation of the design, holes, bosses, ribs and
recesses added to its solid where a trial sees a web.  Needs the extra `step`."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut, BRepAlgoAPI_Fuse
from OCP.collections import Sequence_TDF_Label
from OCP.IFSelect import IFSelect_RetDone
from OCP.Interface import Interface_Static
from OCP.Message import Message
from OCP.STEPCAFControl import STEPCAFControl_Writer
from OCP.TopAbs import TopAbs_FACE
from OCP.XCAFDoc import XCAFDoc_DocumentTool, XCAFDoc_ShapeTool

from benchmarks.trials import Trial, meet
from examples.bulkhead import solids
from examples.bulkhead.build import write_step
from examples.bulkhead.design import Design
from examples.bulkhead.variation import Candidate, Variation, draw_variation
from examples.render.model import read_document
from examples.render.trials import plug
from relmodel.arrays import Floats
from relmodel.geometry.transforms import apply, inverse
from vision.scene import Scene

Change = dict[str, Any]
KINDS = ("hole", "boss", "rib", "recess")
BORDER_PX = 30
CLEAR_MM = 8.0  # of web around what is added
TRIES = 400


def write_variation(variation: Variation, file: Path) -> None:
    """The STEP file of a variation of a design."""
    Message.DefaultMessenger_s().ChangePrinters().Clear()
    design = variation.design
    body = solids.body(design)
    if variation.plugs:
        body = solids.boolean(BRepAlgoAPI_Fuse(), body, [plug(design, hole) for hole in variation.plugs])
    shapes = {"BULKHEAD_BODY": body, "BUSHING_25": solids.bushing(), "BOLT_M8": solids.bolt(), "CLIP": solids.clip()}
    missing = frozenset(path.partition("/")[0] for path in variation.missing)
    write_step(design, shapes, file, missing)


def alter_design(design: Design, trial: Trial, placed: Floats, file: Path, seed: int) -> list[Change]:
    """Write a model that differs in up to three features that a trial has in view, and give the changes from it to the
    part in the pictures."""
    rng = np.random.default_rng([seed, 21])
    variation = draw_variation(design, 3, rng, lambda candidate: _is_seen(candidate, trial, placed))
    write_variation(variation, file)
    swapped = {"removed": "added", "missing": "added", "added": "removed"}
    return [
        {
            "name": c.name,
            "kind": c.kind,
            "change": swapped.get(c.change, c.change),
            "amount": {"diameter_after": c.amount["diameter_before"]} if "diameter_before" in c.amount else {},
            "box_before": c.after and list(c.after),
            "box_after": c.before and list(c.before),
        }
        for c in variation.changes
    ]


def _is_seen(candidate: Candidate, trial: Trial, placed: Floats) -> bool:
    """Whether the middle of what may change lies in the first camera's picture, on the side that it sees."""
    if candidate.change == "plugged" or "/BOLT" in candidate.name:  # a plug is a body of its own; clips are assemblies
        return False
    assert trial.world_from_rig is not None
    name, camera = next(iter(trial.rig.cameras.items()))
    pose = inverse(placed) @ trial.world_from_rig @ trial.rig.rig_from_camera[name]
    x0, y0, z0, x1, y1, z1 = candidate.box
    front = bool(pose[2, 3] > z1)
    at, ahead = camera.project(apply(inverse(pose), np.array([[(x0 + x1) / 2, (y0 + y1) / 2, z1 if front else z0]])))
    inside = (at > BORDER_PX).all() and (at[0] < np.array([camera.width, camera.height]) - BORDER_PX).all()
    return bool(inside and ahead.all()) and ("front" if front else "back") in candidate.sides


def add_to_model(source: Path, file: Path, scene: Scene, trial: Trial, placed: Floats, seed: int) -> list[Change]:
    """Write the model of `source` with one each of KINDS on webs that a trial has in view, and give the changes from it
    to the part in the pictures, which lacks them."""
    rng = np.random.default_rng([seed, 22])
    cuts: list[Any] = []
    fused: list[Any] = []
    out: list[Change] = []
    for kind in KINDS:
        found = _draw_place(kind, scene, trial, placed, rng, [np.array(c["box_before"]) for c in out])
        if found is None:
            continue
        place, up, size = found
        solid, box = _make(kind, place, up, size, rng)
        (cuts if kind in ("hole", "recess") else fused).append(solid)
        out.append(
            {
                "name": kind.upper(),
                "kind": kind,
                "change": "removed",
                "amount": {},
                "box_before": box,
                "box_after": None,
            }
        )
    _change_solid(source, file, cuts, fused)
    return out


def _make(kind: str, place: Floats, up: float, size: float, rng: np.random.Generator) -> tuple[Any, list[float]]:
    """The solid that is cut out or joined at a place on a web, and the box of what it makes.  It reaches a little
    beyond the web's face, so that the kernel meets no faces that coincide."""
    x, y, z = (float(v) for v in place)
    tall = {"hole": -9.0, "recess": -2.0}.get(kind) or float(np.round(rng.uniform(8, 20)))
    level = sorted((z + up * tall, z + up * (1.0 if tall < 0 else -0.5)))
    if kind in ("hole", "boss"):
        solid = solids.cylinder((x, y), size, (level[0], level[1]))
        if kind == "boss":
            bore = solids.cylinder((x, y), 0.45 * size, (min(z, z + 30 * up), max(z, z + 30 * up)))
            solid = solids.boolean(BRepAlgoAPI_Cut(), solid, [bore])
        corners = np.array([[x - size, y - size], [x + size, y + size]])
    else:
        angle = rng.uniform(0, math.pi)
        along = np.array([math.cos(angle), math.sin(angle)])
        side = np.array([-along[1], along[0]]) * (3.0 if kind == "rib" else 0.6 * size)
        ends = np.array([x, y]) - 0.8 * size * along, np.array([x, y]) + 0.8 * size * along
        corners = np.array([ends[0] - side, ends[1] - side, ends[1] + side, ends[0] + side])
        solid = solids.polygon_prism([(float(u), float(v)) for u, v in corners], (level[0], level[1]))
    depth = sorted((z, z + up * (-4.0 if kind == "hole" else tall)))
    return solid, np.round([*corners.min(axis=0), depth[0], *corners.max(axis=0), depth[1]], 2).tolist()


def _draw_place(
    kind: str, scene: Scene, trial: Trial, placed: Floats, rng: np.random.Generator, taken: list[Floats]
) -> tuple[Floats, float, float] | None:
    """A place (x, y, z in the part's frame) on a web that the first camera sees, with the side that faces it (1, -1)
    and a size, mm: as large as fits."""
    assert trial.world_from_rig is not None
    name, camera = next(iter(trial.rig.cameras.items()))
    pose = trial.world_from_rig @ trial.rig.rig_from_camera[name]
    turn = np.linspace(0, 2 * math.pi, 24, endpoint=False)
    ring = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    for _ in range(TRIES):
        pixel = rng.uniform([BORDER_PX, BORDER_PX], [camera.width - BORDER_PX, camera.height - BORDER_PX])
        xy = camera.normalise(camera.undistort(pixel[None]))
        at, normal = _meet(scene, pose[:3, 3], np.concatenate([xy, np.ones((1, 1))], axis=1) @ pose[:3, :3].T, placed)
        size = float(np.round(rng.uniform(*((8, 20) if kind in ("hole", "boss") else (18, 32)))))
        if abs(normal[0, 2]) < 0.999:
            continue
        if any((at[0, :2] > t[:2] - size - 15).all() and (at[0, :2] < t[3:5] + size + 15).all() for t in taken):
            continue
        discs = np.concatenate([at + r * ring for r in (0.4 * size, 0.8 * size, size, size + CLEAR_MM)])
        world = apply(placed, discs)
        seen, _ = _meet(scene, pose[:3, 3], world - pose[:3, 3], placed)
        if (np.abs(seen - discs).max(axis=1) < 0.1).all():
            return at[0], float(np.sign(normal[0, 2])), size
    return None


def _meet(scene: Scene, centre: Floats, rays: Floats, placed: Floats) -> tuple[Floats, Floats]:
    """What rays (n, 3) meet first and the normal there, in the part's frame."""
    point, normal = meet(scene, centre, rays)
    return apply(inverse(placed), point), normal @ placed[:3, :3]


def _change_solid(source: Path, file: Path, cuts: list[Any], fused: list[Any]) -> None:
    """Write the assembly of a STEP file with its largest solid cut and joined."""
    Message.DefaultMessenger_s().ChangePrinters().Clear()
    document = read_document(source)
    tool = XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
    labels = Sequence_TDF_Label()
    tool.GetShapes(labels)
    simple = [labels.Value(i) for i in range(1, labels.Length() + 1)]
    simple = [label for label in simple if XCAFDoc_ShapeTool.IsSimpleShape_s(label)]
    label = max(simple, key=lambda one: len(solids.explore(tool.GetShape_s(one), TopAbs_FACE)))
    body = solids.one_solid(tool.GetShape_s(label))
    if fused:
        body = solids.boolean(BRepAlgoAPI_Fuse(), body, fused)
    if cuts:
        body = solids.boolean(BRepAlgoAPI_Cut(), body, cuts)
    tool.SetShape(label, body)
    tool.UpdateAssemblies()
    writer = STEPCAFControl_Writer()
    Interface_Static.SetIVal_s("write.step.schema", 5)
    if not writer.Transfer(document) or writer.Write(str(file)) != IFSelect_RetDone:
        raise RuntimeError(f"the kernel could not write {file}")
