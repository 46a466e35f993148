"""What only the text of a STEP file says of its parts: PMI with the faces it is of, and properties with raw units."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import Any

from relmodel.model.model import Attribute, Model, Part, Pmi
from relmodel.readers.step.contained import Findings
from relmodel.readers.step.part21_instances import Instances, Record, Reference, references, two
from relmodel.readers.step.part21_units import Measure, measure
from relmodel.readers.step.pmi import FACES, face_finder, product_of, read_pmi

_DENSITY = {"mass": 1.0, "length": -3.0}
_MISWRITTEN = {"g3.cm2": 1000.0}  # the kernel's own writer (8.0) states g/cm3 so; in kg/m3
_MATERIAL_PROPERTY = "material property"
_REPRESENTED = "PROPERTY_DEFINITION_REPRESENTATION"
_TEXTURE, _FINISH = "SURFACE_TEXTURE_REPRESENTATION", ("finish", "surface finish")

Places = Callable[[Any], list[tuple[int, int]]]  # a face of the kernel -> part and surface_no of each that has it


def with_face_names(model: Model, instances: Instances, faces: FacesOfText, findings: Findings) -> Model:
    """The model whose surfaces have the names that the text gives faces."""
    return _with_labels(model, "name", [([face], name) for face, name in _face_names(instances)], faces, findings)


def with_finish(model: Model, instances: Instances, faces: FacesOfText, findings: Findings) -> Model:
    """The model whose surfaces have the finish that the text states of aspects of a product's shape."""
    faces_of, defined = face_finder(instances), _user_defined(instances)
    represented = instances.of(_REPRESENTED)
    stated = findings.each("a finish", represented, lambda n: _finish(instances, n, defined, faces_of))
    return _with_labels(model, "finish", [one for one in stated if one is not None], faces, findings)


def _with_labels(
    model: Model, column: str, stated: Iterable[tuple[list[int], str]], faces: FacesOfText, findings: Findings
) -> Model:
    """The model whose surfaces have labels that the text states of faces; of several of one face all."""
    found: dict[int, dict[int, list[str]]] = {}
    for numbers, label in stated:
        with findings.contained(f"which faces have the {column} {label!r}"):
            for part, surface_no in dict.fromkeys(place for face in numbers for place in faces.places(face)):
                of_shape = found.setdefault(model.parts[part].shape, {}).setdefault(surface_no, [])
                if label not in of_shape:
                    of_shape.append(label)
    shapes = list(model.shapes)
    for i, given in found.items():
        surfaces = shapes[i].surfaces
        old = surfaces.get(column, [None] * len(surfaces["kind"]))
        labels = [", ".join(given[no]) if no in given else label for no, label in enumerate(old)]
        shapes[i] = replace(shapes[i], surfaces=surfaces | {column: labels})
    return replace(model, shapes=tuple(shapes))


def with_pmi(model: Model, instances: Instances, faces: FacesOfText, findings: Findings) -> Model:
    """The model whose parts have the dimensions, tolerances and datums of the text, with their surfaces."""
    found: dict[int, list[Pmi]] = {}
    for stated in read_pmi(instances, findings):
        surfaces: dict[int, list[tuple[int, str]]] = {}
        with findings.contained(f"which faces {stated.pmi.type or 'a datum'} {stated.pmi.name!r} is of"):
            for face, role in stated.faces:
                for part, surface_no in faces.places(face):
                    surfaces.setdefault(part, []).append((surface_no, role))
        whole = faces.parts_of(stated.product) if stated.product is not None and not surfaces else []
        for part in [*surfaces, *whole]:
            found.setdefault(part, []).append(replace(stated.pmi, surfaces=tuple(surfaces.get(part, ()))))
    parts = [replace(part, pmi=(*part.pmi, *found.get(i, ()))) for i, part in enumerate(model.parts)]
    return replace(model, parts=tuple(parts))


def with_properties(model: Model, instances: Instances, faces: FacesOfText, findings: Findings) -> Model:
    """The model whose parts, and assemblies, have the properties that the text states of products."""
    of_part: dict[int, list[Attribute]] = {}
    of_assembly: dict[str, list[Attribute]] = {}
    defined, names = _user_defined(instances), _product_names(instances)
    represented = instances.of(_REPRESENTED)
    for product, attributes in findings.each("a property", represented, lambda n: _property(instances, n, defined)):
        if product is None or not attributes:
            continue
        parts: list[int] = []
        with findings.contained(f"which part has the property {attributes[0][0]!r}"):
            parts = faces.parts_of(product)
        for part in parts:
            of_part.setdefault(part, []).extend(attributes)
        if not parts and product in names:
            of_assembly.setdefault(names[product], []).extend(attributes)
    parts_with = [replace(p, attributes=(*p.attributes, *of_part.get(i, ()))) for i, p in enumerate(model.parts)]
    assemblies = [replace(a, attributes=(*a.attributes, *of_assembly.get(a.name, ()))) for a in model.assemblies]
    return replace(model, parts=tuple(parts_with), assemblies=tuple(assemblies))


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
        """Part and surface_no of a face by its number; empty where the kernel dropped the face."""
        before = self._reader.NbShapes()
        # Asked again, the kernel returns what it transferred before.
        ordinal = self._instances.ordinal(face) if self._same else None
        if ordinal is None or not self._reader.TransferOne(ordinal + 1):
            return []
        return [
            place
            for i in range(before + 1, self._reader.NbShapes() + 1)
            for place in self._places(self._reader.Shape(i))
        ]

    def parts_of(self, product: int) -> list[int]:
        """Parts that have a face of a product, those of its components left out."""
        waiting = list(self._representations.get(product, ()))
        seen = set(waiting)
        while waiting:
            number = waiting.pop()
            record = self._instances[number]
            if any(name in record for name in FACES):
                parts = [part for part, _ in self.places(number)]
                if parts:
                    return parts
            if "MAPPED_ITEM" in record:
                continue
            fresh = [n for n in (*references(list(record.values())), *self._related.get(number, ())) if n not in seen]
            seen.update(fresh)
            waiting += fresh
        return []


def _face_names(instances: Instances) -> list[tuple[int, str]]:
    """Names of faces; a name that most faces share, such as NONE or the body's name, is dropped."""
    faces = [(face, next(iter(instances[face].values()))) for face in instances.of(*FACES)]
    named = [
        (face, parameters[0].strip()) for face, parameters in faces if parameters and isinstance(parameters[0], str)
    ]
    often = Counter(name for _, name in named)
    return [(face, name) for face, name in named if name and often[name] <= max(1, len(named) // 2)]


def _represented(instances: Instances, number: int) -> tuple[Reference | None, list[Any], list[int], Record]:
    """Of a PROPERTY_DEFINITION_REPRESENTATION: the definition, its parameters, the items and the representation."""
    stated, shown = two(instances.parameters(number, _REPRESENTED))
    definition = instances.parameters(stated, "PROPERTY_DEFINITION") if stated is not None else []
    record = instances[shown] if shown is not None else {}
    items = [int(item) for parameters in record.values() for item in references(parameters[1:2])]
    return stated, [*definition, None, None, None][:3], items, record


def _property(instances: Instances, number: int, defined: dict[int, str]) -> tuple[int | None, list[Attribute]]:
    """A property and the product that it is of: of a material, as stated, with the unit of the file, and densities in
    kg/m3 too; finish; what users defined (general properties, such as a revision).  None where it belongs to something
    else."""
    stated, (name, _, thing), items, record = _represented(instances, number)
    attributes: list[Attribute] = []
    if str(name).lower() == _MATERIAL_PROPERTY:
        measures = [one for item in items if (one := measure(instances, item)) is not None]
        attributes = [attribute for one in measures for attribute in _stated(one)]
    elif not _of_whole_product(instances, thing):
        return None, []
    elif _TEXTURE in record:
        attributes = [("finish", text, None)] if (text := _texture(instances, items)) else []
    elif stated in defined:
        values = [value for item in items if (value := _value(instances, item)) is not None]
        attributes = [(defined[stated], *value) for value in values[:1]]
    return product_of(instances, thing), attributes


def _finish(
    instances: Instances, number: int, defined: dict[int, str], faces_of: Callable[[Any], list[int]]
) -> tuple[list[int], str] | None:
    """Faces and their finish: a surface texture (ISO 10303-1110), or what users call finish; None for anything else."""
    stated, (_, _, thing), items, record = _represented(instances, number)
    if _TEXTURE in record or (stated is not None and defined.get(stated, "").lower() in _FINISH):
        faces, text = faces_of(thing), _texture(instances, items)
        return (faces, text) if faces and text else None
    return None


def _texture(instances: Instances, items: list[int]) -> str:
    """Texts and measures in the order of the file, as one writes them: Ra 3.2 um."""
    values = [value for item in items if (value := _value(instances, item)) is not None]
    return " ".join(" ".join(one if isinstance(one, str) else f"{one:.12g}" for one in v if one) for v in values)


def _product_names(instances: Instances) -> dict[int, str]:
    """Name of the product of each PRODUCT_DEFINITION, where only one product has that name."""
    out: dict[int, str] = {}
    for number in instances.of("PRODUCT_DEFINITION"):
        formation = next(iter(references(instances.parameters(number, "PRODUCT_DEFINITION")[2:3])), None)
        record = instances[formation] if formation is not None else {}
        product = next((one for parameters in record.values() for one in references(parameters[2:3])), None)
        named = instances.parameters(product, "PRODUCT") if product is not None else []
        if len(named) > 1 and isinstance(named[1], str):
            out[number] = named[1].strip()
    often = Counter(out.values())
    return {number: name for number, name in out.items() if often[name] == 1}


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
