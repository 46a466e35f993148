"""What only the text of a STEP file says of its parts: PMI with the faces it is of, and properties with raw units."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Any

from relmodel.model.model import Attribute, Model, Part, Pmi
from relmodel.readers.step.part21_instances import Instances, Reference, references, two
from relmodel.readers.step.part21_units import Measure, measure
from relmodel.readers.step.pmi import FACES, product_of, read_pmi

_DENSITY = {"mass": 1.0, "length": -3.0}
_MISWRITTEN = {"g3.cm2": 1000.0}  # the kernel's own writer (8.0) states g/cm3 so; in kg/m3
_MATERIAL_PROPERTY = "material property"

Places = Callable[[Any], list[tuple[int, int]]]  # a face of the kernel -> part and surface_no of each that has it


def with_face_names(model: Model, instances: Instances, faces: FacesOfText) -> Model:
    """The model whose surfaces have the names that the text gives faces."""
    names: dict[int, dict[int, str]] = {}
    for face, name in _face_names(instances):
        for part, surface_no in faces.places(face):
            names.setdefault(model.parts[part].shape, {})[surface_no] = name
    shapes = list(model.shapes)
    for i, given in names.items():
        column = [given.get(no, name) for no, name in enumerate(shapes[i].surfaces["name"])]
        shapes[i] = replace(shapes[i], surfaces=shapes[i].surfaces | {"name": column})
    return replace(model, shapes=tuple(shapes))


def with_pmi(model: Model, instances: Instances, faces: FacesOfText) -> Model:
    """The model whose parts have the dimensions, tolerances and datums of the text, with their surfaces."""
    found: dict[int, list[Pmi]] = {}
    for stated in read_pmi(instances):
        surfaces: dict[int, list[tuple[int, str]]] = {}
        for face, role in stated.faces:
            for part, surface_no in faces.places(face):
                surfaces.setdefault(part, []).append((surface_no, role))
        whole = faces.parts_of(stated.product) if stated.product is not None and not surfaces else []
        for part in [*surfaces, *whole]:
            found.setdefault(part, []).append(replace(stated.pmi, surfaces=tuple(surfaces.get(part, ()))))
    parts = [replace(part, pmi=(*part.pmi, *found.get(i, ()))) for i, part in enumerate(model.parts)]
    return replace(model, parts=tuple(parts))


def with_properties(model: Model, instances: Instances, faces: FacesOfText) -> Model:
    """The model whose parts have the material properties of the text among their attributes."""
    found: dict[int, list[Attribute]] = {}
    for product, attributes in _properties(instances):
        for part in faces.parts_of(product):
            found.setdefault(part, []).extend(attributes)
    parts = [replace(part, attributes=(*part.attributes, *found.get(i, ()))) for i, part in enumerate(model.parts)]
    return replace(model, parts=tuple(parts))


class FacesOfText:
    """Faces of the text among the parts: the kernel numbers what it reads in the order of the file."""

    def __init__(self, parts: Sequence[Part], instances: Instances, reader: Any, places: Places) -> None:
        self._parts, self._instances = parts, instances
        self._reader = reader.Reader()
        self._places = places
        self._same = self._reader.Model().NbEntities() == len(instances)
        self._representations: dict[int, list[int]] = {}
        self._related: dict[int, list[int]] = {}
        for number in instances.of("SHAPE_DEFINITION_REPRESENTATION"):
            shape, shown = two(instances.parameters(number, "SHAPE_DEFINITION_REPRESENTATION"))
            product = product_of(instances, shape)
            if product is not None and shown is not None:
                self._representations.setdefault(product, []).append(shown)
        for number in instances.of("SHAPE_REPRESENTATION_RELATIONSHIP"):
            record = instances[number]
            if "REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION" not in record:
                ends = list(references(list(record.values())))
                for one, other in (ends, ends[::-1]) if len(ends) == 2 else ():
                    self._related.setdefault(one, []).append(other)

    def places(self, face: int) -> list[tuple[int, int]]:
        """Part and surface_no of a face by its number; none where the kernel did not bring it through."""
        before = self._reader.NbShapes()
        # What was transferred already is handed out, not made again.
        ordinal = self._instances.ordinal(face) if self._same else None
        if ordinal is None or not self._reader.TransferOne(ordinal + 1):
            return []
        return [
            place
            for i in range(before + 1, self._reader.NbShapes() + 1)
            for place in self._places(self._reader.Shape(i))
        ]

    def parts_of(self, product: int) -> list[int]:
        """Parts that have a face of a product, those of its components and supplemental ones left out."""
        waiting = list(self._representations.get(product, ()))
        seen = set(waiting)
        while waiting:
            number = waiting.pop()
            record = self._instances[number]
            if any(name in record for name in FACES):
                parts = [part for part, _ in self.places(number) if not self._parts[part].supplemental]
                if parts:
                    return parts
            if "MAPPED_ITEM" in record:
                continue
            fresh = [n for n in (*references(list(record.values())), *self._related.get(number, ())) if n not in seen]
            seen.update(fresh)
            waiting += fresh
        return []


def _face_names(instances: Instances) -> list[tuple[int, str]]:
    """Names of faces; what most of them are called, such as NONE or the body's name, is none."""
    faces = [(face, next(iter(instances[face].values()))) for face in instances.of(*FACES)]
    named = [
        (face, parameters[0].strip()) for face, parameters in faces if parameters and isinstance(parameters[0], str)
    ]
    often = Counter(name for _, name in named)
    return [(face, name) for face, name in named if name and often[name] <= max(1, len(named) // 2)]


def _properties(instances: Instances) -> Iterator[tuple[int, list[Attribute]]]:
    """Material properties by product, as stated, with the unit of the file, and densities in kg/m3 too; and what users
    defined (general properties, such as finish or revision)."""
    defined = _user_defined(instances)
    for number in instances.of("PROPERTY_DEFINITION_REPRESENTATION"):
        stated, shown = two(instances.parameters(number, "PROPERTY_DEFINITION_REPRESENTATION"))
        definition = instances.parameters(stated, "PROPERTY_DEFINITION") if stated is not None else []
        if stated is None or shown is None or len(definition) < 3:
            continue
        items = [item for parameters in instances[shown].values() for item in references(parameters[1:2])]
        if str(definition[0]).lower() == _MATERIAL_PROPERTY:
            measures = [one for item in items if (one := measure(instances, item)) is not None]
            attributes = [attribute for one in measures for attribute in _stated(one)]
        elif stated in defined and _of_whole_product(instances, definition[2]):
            values = [value for item in items if (value := _value(instances, item)) is not None]
            attributes = [(defined[stated], *value) for value in values[:1]]
        else:
            continue
        product = product_of(instances, definition[2])
        if product is not None and attributes:
            yield product, attributes


def _user_defined(instances: Instances) -> dict[int, str]:
    """Names of the property definitions that general properties stand behind."""
    out: dict[int, str] = {}
    for number in instances.of("GENERAL_PROPERTY_ASSOCIATION"):
        general, stated = two(instances.parameters(number, "GENERAL_PROPERTY_ASSOCIATION")[2:])
        named = instances.parameters(general, "GENERAL_PROPERTY") if general is not None else []
        name = str(named[1] or "").strip() if len(named) > 1 else ""
        if stated is not None and name:
            out[stated] = name
    return out


def _of_whole_product(instances: Instances, thing: Any) -> bool:
    """Whether a property is of a product, not of an aspect of its shape."""
    return isinstance(thing, Reference) and not {"PRODUCT_DEFINITION", "PRODUCT_DEFINITION_SHAPE"}.isdisjoint(
        instances[thing]
    )


def _value(instances: Instances, item: int) -> tuple[str | float, str | None] | None:
    """Value and unit of an item of a representation: a text or a measure."""
    described = instances[item].get("DESCRIPTIVE_REPRESENTATION_ITEM", [])
    if len(described) > 1:
        return (text, None) if (text := str(described[1] or "").strip()) else None
    one = measure(instances, item)
    return None if one is None else (one.value, one.unit.symbol if one.unit is not None else None)


def _stated(one: Measure) -> list[Attribute]:
    name = one.name.removesuffix(" measure") or "material property"
    density = one.within(_DENSITY, 1.0)
    if one.unit is not None and one.unit.symbol in _MISWRITTEN:
        density = one.value * _MISWRITTEN[one.unit.symbol]
    # Twelve digits: conversion of units leaves round-off (2809.9999999999995).
    out: list[Attribute] = [] if density is None else [(name, float(f"{density:.12g}"), "kg/m3")]
    return [*out, (f"{name} as stated", one.value, one.unit.symbol if one.unit is not None else None)]
