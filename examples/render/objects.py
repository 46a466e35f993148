"""Small objects that stand on a table (z = 0 of their frame), drawn from a seed, and their STEP files."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from OCP.IFSelect import IFSelect_RetDone
from OCP.Interface import Interface_Static
from OCP.Message import Message
from OCP.STEPCAFControl import STEPCAFControl_Writer
from OCP.TCollection import TCollection_ExtendedString
from OCP.TDataStd import TDataStd_Name
from OCP.XCAFDoc import XCAFDoc_DocumentTool
from scipy.spatial.transform import Rotation

from examples.bulkhead.solids import bolt, bushing, clip, new_document, polygon_prism
from examples.render.families import FAMILIES, Array, Made, Placed, Shape, draw, location, make
from examples.render.views import rigid


def make_object(what: str, rng: np.random.Generator) -> Made:
    """Parts of an object of the kind `what` (a key of `OBJECTS` or of `FAMILIES`), its dimensions drawn."""
    made: Made = make(draw(what, int(rng.integers(1 << 31)))) if what in FAMILIES else OBJECTS[what](rng)
    return made


def block(size: Array | tuple[float, float, float]) -> Shape:
    """A cuboid about the z axis that stands on z = 0."""
    x, y = size[0] / 2, size[1] / 2
    return polygon_prism([(-x, -y), (x, -y), (x, y), (-x, y)], (0.0, float(size[2])))


def _alone(product: str, shape: Shape, place: Array | None = None) -> Made:
    return {product: shape}, [(product, product, np.eye(4) if place is None else place)]


def _round(values: Any) -> Array:
    """Dimensions as a drawing has them, in halves of a millimetre."""
    return np.asarray(np.round(2 * np.asarray(values, float)) / 2)


def _cube(rng: np.random.Generator) -> Made:
    return _alone("CUBE", block(_round([rng.uniform(40, 90)] * 3)))


def _clip(rng: np.random.Generator) -> Made:
    return _alone("CLIP", clip())


def _bushing(rng: np.random.Generator) -> Made:
    """The bulkhead's bushing, on its flange."""
    return _alone("BUSHING_25", bushing(), rigid(Rotation.from_euler("x", 180, degrees=True), (0.0, 0.0, 3.0)))


def _bolts(rng: np.random.Generator) -> Made:
    """Bolts of the bulkhead on their heads, in a row."""
    count, pitch = int(rng.integers(3, 6)), float(_round(rng.uniform(22, 32)))
    upside = Rotation.from_euler("x", 180, degrees=True)
    along = [(i - (count - 1) / 2) * pitch for i in range(count)]
    placed = [(f"BOLT_{i + 1}", "BOLT_M8", rigid(upside, (x, 0.0, 7.1))) for i, x in enumerate(along)]
    return {"BOLT_M8": bolt()}, placed


def _like_blocks(rng: np.random.Generator) -> Made:
    """Some like blocks on the table, clear of each other, some with another on top."""
    size = _round(rng.uniform([25, 20, 15], [50, 40, 35]))
    reach = float(np.hypot(size[0], size[1])) + 4
    centres: list[Array] = []
    while len(centres) < int(3 + rng.integers(3)):
        at = rng.uniform(-90, 90, 2)
        if all(np.linalg.norm(at - c) > reach for c in centres):
            centres.append(at)
    placed: list[Placed] = []
    for i, at in enumerate(centres):
        turn = Rotation.from_euler("z", rng.uniform(0, 180), degrees=True)
        placed.append((f"BLOCK_{i + 1}", "BLOCK", rigid(turn, (at[0], at[1], 0.0))))
        if i < 2 and rng.random() < 0.6:
            lean = Rotation.from_euler("z", rng.uniform(-25, 25), degrees=True) * turn
            placed.append((f"UPPER_{i + 1}", "BLOCK", rigid(lean, (at[0], at[1], float(size[2])))))
    return {"BLOCK": block(size)}, placed


def _stairs(rng: np.random.Generator) -> Made:
    """Like bars piled into stairs."""
    x, y, z = _round(rng.uniform([20, 60, 12], [32, 100, 22]))
    placed = []
    for i in range(3):
        for level in range(3 - i):
            shift = rigid(Rotation.identity(), (i * x, 0.0, level * z))
            placed.append((f"BAR_{i + 1}_{level + 1}", "BAR", shift))
    return {"BAR": block((x, y, z))}, placed


def _box(low: tuple[float, float, float], high: tuple[float, float, float]) -> Any:
    return lambda rng: _alone("BOX", block(_round(rng.uniform(low, high))))


def _lidded(rng: np.random.Generator) -> Made:
    """A box with a lid that overhangs it."""
    x, y, z = _round(rng.uniform([80, 60, 50], [150, 110, 100]))
    over, high = float(_round(rng.uniform(2, 4))), float(_round(0.25 * z))
    lid = rigid(Rotation.identity(), (0.0, 0.0, float(z)))
    shapes = {"BOX": block((x, y, z)), "LID": block((x + 2 * over, y + 2 * over, high))}
    return shapes, [("BOX", "BOX", np.eye(4)), ("LID", "LID", lid)]


def _wedge(rng: np.random.Generator) -> Made:
    """A carton whose front slopes."""
    x, y, z = _round(rng.uniform([80, 50, 60], [140, 100, 120]))
    section = [(0.0, 0.0), (float(x), 0.0), (float(0.6 * x), float(z)), (0.0, float(z))]
    upright = rigid(Rotation.from_euler("x", 90, degrees=True), (0.0, y / 2, 0.0))
    return _alone("WEDGE", polygon_prism(section, (0.0, float(y))), upright)


def _hexagonal(rng: np.random.Generator) -> Made:
    radius, z = _round(rng.uniform([40, 50], [70, 120]))
    corners = [(float(radius * math.cos(a)), float(radius * math.sin(a))) for a in np.arange(6) * math.pi / 3]
    return _alone("CARTON", polygon_prism(corners, (0.0, float(z))))


def _pile(rng: np.random.Generator) -> Made:
    """Two unlike boxes, one upon the other."""
    lower, upper = _round(rng.uniform([100, 80, 40], [150, 110, 80])), _round(rng.uniform([60, 40, 30], [90, 70, 60]))
    turn = Rotation.from_euler("z", rng.uniform(-40, 40), degrees=True)
    place = rigid(turn, (*rng.uniform(-10, 10, 2), float(lower[2])))
    return {"LOWER": block(lower), "UPPER": block(upper)}, [("LOWER", "LOWER", np.eye(4)), ("UPPER", "UPPER", place)]


OBJECTS = {
    "cube": _cube,
    "clip": _clip,
    "bushing": _bushing,
    "bolts": _bolts,
    "like_blocks": _like_blocks,
    "stairs": _stairs,
    "box": _box((90, 60, 40), (180, 120, 100)),
    "flat_box": _box((120, 90, 15), (200, 150, 35)),
    "tall_box": _box((50, 40, 120), (80, 70, 180)),
    "lidded": _lidded,
    "wedge": _wedge,
    "hexagonal": _hexagonal,
    "pile": _pile,
}


def write_step(made: Made, path: Path) -> None:
    """Write the object as AP242 (mm): a part alone, or an assembly named OBJECT."""
    Message.DefaultMessenger_s().ChangePrinters().Clear()
    shapes, placed = made
    document = new_document()
    tool = XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
    # Auto naming, like the schema below, is a setting of the whole process.
    names_itself = tool.AutoNaming_s()
    tool.SetAutoNaming_s(False)
    try:
        _describe(tool, shapes, placed)
    finally:
        tool.SetAutoNaming_s(names_itself)
    writer = STEPCAFControl_Writer()  # the setting below exists only once a writer does
    before = Interface_Static.IVal_s("write.step.schema")
    try:
        if not Interface_Static.SetIVal_s("write.step.schema", 5) or not writer.Transfer(document):
            raise RuntimeError("the kernel could not transfer the object")
        if writer.Write(str(path)) != IFSelect_RetDone:
            raise RuntimeError(f"the kernel could not write {path}")
    finally:
        Interface_Static.SetIVal_s("write.step.schema", before)


def _describe(tool: Any, shapes: Any, placed: Any) -> None:
    """The products of an object, and where each is placed, in a document."""
    labels = {product: tool.AddShape(shape, False) for product, shape in shapes.items()}
    for product, label in labels.items():
        TDataStd_Name.Set_s(label, TCollection_ExtendedString(product))
    if len(placed) > 1 or not np.array_equal(placed[0][2], np.eye(4)):
        root = tool.NewShape()
        TDataStd_Name.Set_s(root, TCollection_ExtendedString("OBJECT"))
        for name, product, place in placed:
            component = tool.AddComponent(root, labels[product], location(place))
            TDataStd_Name.Set_s(component, TCollection_ExtendedString(name))
        tool.UpdateAssemblies()
