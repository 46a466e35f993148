"""What the labels of the CAD kernel's document bear: name, colour, material, validation properties."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from OCP.Quantity import Quantity_Color, Quantity_TypeOfColor
from OCP.TDataStd import TDataStd_Name, TDataStd_TreeNode
from OCP.XCAFDoc import (
    XCAFDoc,
    XCAFDoc_Area,
    XCAFDoc_Centroid,
    XCAFDoc_ColorTool,
    XCAFDoc_ColorType,
    XCAFDoc_Material,
    XCAFDoc_Volume,
)

from relmodel.model.model import Attribute
from relmodel.readers.step.part21_units import number_key


def entry(label: Any) -> str:
    """Path of a label's tags, its identity in the document."""
    tags = []
    while not label.IsRoot():
        tags.append(str(label.Tag()))
        label = label.Father()
    return ":".join(reversed(tags))


def name_of(label: Any) -> str | None:
    if not label.IsAttribute(TDataStd_Name.GetID_s()):
        return None
    name = TDataStd_Name()
    label.FindAttribute(TDataStd_Name.GetID_s(), name)
    return str(name.Get().ToExtString()).strip() or None


def colour_of(label: Any) -> str | None:
    """Colour of a label as #rrggbb (sRGB); of a surface before that of the whole."""
    for kind in (XCAFDoc_ColorType.XCAFDoc_ColorSurf, XCAFDoc_ColorType.XCAFDoc_ColorGen):
        colour = Quantity_Color()
        if XCAFDoc_ColorTool.GetColor_s(label, kind, colour):
            parts = colour.Values(Quantity_TypeOfColor.Quantity_TOC_sRGB)
            return "#" + "".join(f"{round(255 * min(max(p, 0.0), 1.0)):02x}" for p in parts)
    return None


def material_of(label: Any) -> str | None:
    guid = XCAFDoc.MaterialRefGUID_s()
    if not label.IsAttribute(guid):
        return None
    node = TDataStd_TreeNode()
    label.FindAttribute(guid, node)
    if not node.HasFather():
        return None
    at = node.Father().Label()
    if not at.IsAttribute(XCAFDoc_Material.GetID_s()):
        return None
    material = XCAFDoc_Material()
    at.FindAttribute(XCAFDoc_Material.GetID_s(), material)
    name = material.GetName()
    return str(name.ToCString()) if name is not None else None


def attributes_of(label: Any, units: Mapping[tuple[str, str], float]) -> tuple[Attribute, ...]:
    """Validation properties of the file, in mm.

    The kernel converts volumes and areas where their unit is one it knows, and else hands the file's number on.  units:
    what such a number is to be multiplied by, as the text says of it (`validation_units`).
    """
    out: list[Attribute] = []
    for kind, what, power in ((XCAFDoc_Volume, "volume", 3), (XCAFDoc_Area, "area", 2)):
        if label.IsAttribute(kind.GetID_s()):
            stated = kind()
            label.FindAttribute(kind.GetID_s(), stated)
            value = float(stated.Get())
            factor = units.get((what, number_key(value)), 1.0)
            out.append((f"validation {what}", value * factor, f"mm{power}"))
    if label.IsAttribute(XCAFDoc_Centroid.GetID_s()):
        centroid = XCAFDoc_Centroid()
        label.FindAttribute(XCAFDoc_Centroid.GetID_s(), centroid)
        out += [(f"validation centroid {c}", x, "mm") for c, x in zip("xyz", centroid.Get().Coord(), strict=True)]
    return tuple(out)
