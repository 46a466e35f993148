"""What the labels of the CAD kernel's document bear: name, colour, material, validation properties."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, TypeVar

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
from relmodel.readers.step.contained import Findings
from relmodel.readers.step.part21_units import number_key

Made = TypeVar("Made")


class Labels:
    """Reads the attributes of labels; one that cannot be read becomes a finding and counts as absent.

    units: what volumes and areas are to be multiplied by, as the text says of them (`validation_units`).
    """

    def __init__(self, findings: Findings, units: Mapping[tuple[str, str], float], layers: Any) -> None:
        self._findings, self._units, self._layers = findings, units, layers

    def name(self, label: Any) -> str | None:
        return self._read("a name", _name, label)

    def colour(self, label: Any) -> str | None:
        """Colour of a label as #rrggbb (sRGB); of a surface before that of the whole."""
        return self._read("a colour", _colour, label)

    def material(self, label: Any) -> str | None:
        return self._read("a material", _material, label)

    def layer(self, label: Any) -> str | None:
        """Names of the layers that a label is on."""
        return self._read("a layer", self._layer, label)

    def attributes(self, label: Any) -> tuple[Attribute, ...]:
        """Validation properties of the file, in mm."""
        return self._read("validation properties", self._attributes, label) or ()

    def _read(self, what: str, read: Callable[[Any], Made], label: Any) -> Made | None:
        with self._findings.contained(what):
            return read(label)
        return None

    def _layer(self, label: Any) -> str | None:
        names = self._layers.GetLayers(label)  # false in itself, whatever it holds
        if names is None:
            return None
        return ", ".join(names.Value(i).ToExtString() for i in range(1, names.Length() + 1)) or None

    def _attributes(self, label: Any) -> tuple[Attribute, ...]:
        # The kernel converts volumes and areas where their unit is one it knows, and else hands the file's number on.
        out: list[Attribute] = []
        for kind, what, power in ((XCAFDoc_Volume, "volume", 3), (XCAFDoc_Area, "area", 2)):
            if (stated := _attribute(label, kind)) is not None:
                value = float(stated.Get())
                factor = self._units.get((what, number_key(value)), 1.0)
                out.append((f"validation {what}", value * factor, f"mm{power}"))
        if (centroid := _attribute(label, XCAFDoc_Centroid)) is not None:
            out += [(f"validation centroid {c}", x, "mm") for c, x in zip("xyz", centroid.Get().Coord(), strict=True)]
        return tuple(out)


def entry(label: Any) -> str:
    """Path of a label's tags, its identity in the document."""
    tags = []
    while not label.IsRoot():
        tags.append(str(label.Tag()))
        label = label.Father()
    return ":".join(reversed(tags))


def _attribute(label: Any, kind: Any, guid: Any = None) -> Any | None:
    """The attribute of a kind (and of a GUID of its own, where it has several) of a label; None where it has none."""
    guid = guid or kind.GetID_s()
    if not label.IsAttribute(guid):  # FindAttribute would crash
        return None
    out = kind()
    label.FindAttribute(guid, out)
    return out


def _name(label: Any) -> str | None:
    name = _attribute(label, TDataStd_Name)
    return None if name is None else str(name.Get().ToExtString()).strip() or None


def _colour(label: Any) -> str | None:
    for kind in (XCAFDoc_ColorType.XCAFDoc_ColorSurf, XCAFDoc_ColorType.XCAFDoc_ColorGen):
        colour = Quantity_Color()
        if XCAFDoc_ColorTool.GetColor_s(label, kind, colour):
            parts = colour.Values(Quantity_TypeOfColor.Quantity_TOC_sRGB)
            return "#" + "".join(f"{round(255 * min(max(p, 0.0), 1.0)):02x}" for p in parts)
    return None


def _material(label: Any) -> str | None:
    node = _attribute(label, TDataStd_TreeNode, XCAFDoc.MaterialRefGUID_s())
    if node is None or not node.HasFather():
        return None
    material = _attribute(node.Father().Label(), XCAFDoc_Material)
    name = None if material is None else material.GetName()
    return None if name is None else str(name.ToCString())
