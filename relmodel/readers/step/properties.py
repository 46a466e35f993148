"""What only the text of a STEP file says of its parts: PMI with its faces, and properties with raw units."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import Any

from relmodel.model.model import Attribute, Model, Pmi
from relmodel.readers.step.part21 import FACES, Instances, Measure, Reference, TypedValue, measure, measures, references
from relmodel.readers.step.step_parameters import Findings

# The way from one to a face (ISO 10303-47, -242): what is toleranced is a SHAPE_ASPECT, made of others by
# SHAPE_ASPECT_RELATIONSHIP, and a representation usage points from an aspect to the ADVANCED_FACEs.

_SIZES = ("DIMENSIONAL_SIZE", "ANGULAR_SIZE")
_LOCATIONS = ("DIMENSIONAL_LOCATION", "ANGULAR_LOCATION", "DIRECTED_DIMENSIONAL_LOCATION")
_TOLERANCES = tuple(
    f"{of}_TOLERANCE"
    for of in (
        *("ANGULARITY", "CIRCULAR_RUNOUT", "COAXIALITY", "CONCENTRICITY", "CYLINDRICITY", "FLATNESS", "LINE_PROFILE"),
        *("PARALLELISM", "PERPENDICULARITY", "POSITION", "ROUNDNESS", "STRAIGHTNESS", "SURFACE_PROFILE", "SYMMETRY"),
        "TOTAL_RUNOUT",
    )
)
_DATUM_FEATURES = ("DATUM_FEATURE", "PLACED_DATUM_TARGET_FEATURE", "DATUM_TARGET")
_MADE_OF = ("SHAPE_ASPECT_RELATIONSHIP", "SHAPE_ASPECT_DERIVING_RELATIONSHIP", "SHAPE_ASPECT_ASSOCIATIVITY")
_USAGES = ("GEOMETRIC_ITEM_SPECIFIC_USAGE", "ITEM_IDENTIFIED_REPRESENTATION_USAGE")
_SHELLS = ("CLOSED_SHELL", "OPEN_SHELL", "CONNECTED_FACE_SET", "CONNECTED_FACE_SUB_SET", "MANIFOLD_SOLID_BREP")


@dataclass(frozen=True)
class PmiStatement:
    """A dimension, tolerance or datum of the text, without its surfaces.  faces: number of the instance, and role.
    product: number of the PRODUCT_DEFINITION that it is of."""

    pmi: Pmi
    faces: tuple[tuple[int, str], ...]
    product: int | None


class _PmiReader:
    """Reads dimensions, tolerances and datums, and which faces they are of."""

    def __init__(self, instances: Instances) -> None:
        self.of = instances
        self._parts: dict[int, list[int]] = {}
        self._used: dict[int, list[int]] = {}
        self._datum_of: dict[int, int] = {}
        datums = set(instances.of("DATUM"))
        for _, whole, part in instances.pairs(*_MADE_OF, first=2):
            if part in datums:
                self._datum_of[whole] = part
            else:
                self._parts.setdefault(whole, []).append(part)
        for _, feature, target in instances.pairs("FEATURE_FOR_DATUM_TARGET_RELATIONSHIP", first=2):
            self._parts.setdefault(target, []).append(feature)
        for name in _USAGES:
            for number in instances.of(name):
                parameters = instances.parameters(number, name)
                if len(parameters) > 4 and isinstance(parameters[2], Reference):
                    self._used.setdefault(parameters[2], []).extend(references(parameters[4]))

    def all(self, findings: Findings) -> list[PmiStatement]:
        """All dimensions, then tolerances, then datums of a file, in the order of their numbers."""
        zones: dict[int, str] = {}  # form of the zone of each tolerance that has one
        for number in self.of.of("TOLERANCE_ZONE"):
            zone = [*self.of.parameters(number, "TOLERANCE_ZONE"), *[None] * 6]
            for form in self.of.parameters(zone[5], "TOLERANCE_ZONE_FORM")[:1]:
                zones |= dict.fromkeys(references(zone[4]), str(form or ""))
        values: dict[int, list[int]] = {}  # items that represent each dimension
        for _, dimension, held in self.of.pairs("DIMENSIONAL_CHARACTERISTIC_REPRESENTATION"):
            for parameters in self.of[held].values():
                values.setdefault(dimension, []).extend(references(parameters[1:2]))
        bounds: dict[int, int] = {dimension: bound for _, bound, dimension in self.of.pairs("PLUS_MINUS_TOLERANCE")}
        shown = [n for n in self.of.of(*_DATUM_FEATURES) if n in self._datum_of]
        bare = sorted(set(self.of.of("DATUM")) - {self._datum_of[n] for n in shown})
        return [
            *findings.each(
                "a dimension",
                self.of.of(*_SIZES, *_LOCATIONS),
                lambda n: self._dimension(n, values.get(n, []), bounds.get(n)),
            ),
            *findings.each("a tolerance", self.of.of(*_TOLERANCES), lambda n: self._tolerance(n, zones.get(n))),
            *findings.each("a datum", [*shown, *bare], self._datum),
        ]

    def _dimension(self, number: int, values: list[int], bound: int | None) -> PmiStatement:
        record = self.of[number]
        size = next((n for n in _SIZES if n in record), None)
        if size is not None:
            parameters = record[size] or record.get("DIMENSIONAL_SIZE", [])
            aspects = [(parameters[0], "feature")] if parameters else []
            named = parameters[1] if len(parameters) > 1 else None
        else:
            location = next(n for n in _LOCATIONS if n in record)
            parameters = record[location] if len(record[location]) > 3 else record.get("SHAPE_ASPECT_RELATIONSHIP", [])
            aspects = list(zip(parameters[2:4], ("origin", "target"), strict=False))
            named = parameters[0] if parameters else None
        angular = any(n.startswith("ANGULAR") for n in record)
        kind = str(named or ("angle" if angular else "linear distance")).lower()
        value = lower = upper = None
        unit = stated = None
        for one in measures(self.of, values):
            converted, unit, stated = _converted(one)
            if "upper" in one.name.lower():
                upper = converted
            elif "lower" in one.name.lower():
                lower = converted
            else:
                value = converted
        notes = (self.of.parameters(v, "DESCRIPTIVE_REPRESENTATION_ITEM") for v in values)
        said = [str(note[1]) for note in notes if len(note) > 1 and note[1]]
        if bound is not None:
            record = self.of[bound]
            if "TOLERANCE_VALUE" in record and value is not None:
                ends = measures(self.of, references(record["TOLERANCE_VALUE"]))
                if len(ends) == 2:
                    lower, upper = (value + _converted(end)[0] for end in ends)
            elif "LIMITS_AND_FITS" in record:
                said.append("".join(str(p) for p in record["LIMITS_AND_FITS"] if p is not None))
        faces = [(face, role) for aspect, role in aspects for face in self.faces(aspect)]
        pmi = Pmi("dimension", kind, "", value, lower, upper, unit, stated, ", ".join(said) or None)
        return PmiStatement(pmi, _once(faces), product_of(self.of, aspects[0][0] if aspects else None))

    def _tolerance(self, number: int, zone: str | None) -> PmiStatement:
        record = self.of[number]
        kind = next(n for n in _TOLERANCES if n in record)
        plain = record.get("GEOMETRIC_TOLERANCE") or record[kind]
        width = measure(self.of, plain[2]) if len(plain) > 3 and isinstance(plain[2], Reference) else None
        value, unit, stated = (None, None, None) if width is None else _converted(width)
        referred = [*record.get("GEOMETRIC_TOLERANCE_WITH_DATUM_REFERENCE", []), *plain[4:]]
        modified = record.get("GEOMETRIC_TOLERANCE_WITH_MODIFIERS", [[]])
        aspect = plain[3] if len(plain) > 3 else None
        pmi = Pmi(
            kind="tolerance",
            type=kind.removesuffix("_TOLERANCE").lower().replace("_", " "),
            name=str(plain[0] or "") if plain else "",
            value=value,
            unit=unit,
            stated_unit=stated,
            modifier=_modifiers(modified),
            zone=zone,
            datums=tuple(self._references(referred)),
        )
        return PmiStatement(pmi, _once((face, "feature") for face in self.faces(aspect)), product_of(self.of, aspect))

    def _references(self, referred: list[Any]) -> Iterable[tuple[int, str, str | None]]:
        """Precedence, letter and modifier of the datums of a tolerance."""
        for number in references(referred):
            record = self.of[number]
            if "DATUM_SYSTEM" in record:
                compartments = list(references(record["DATUM_SYSTEM"][4:5]))
                for precedence, one in enumerate(compartments, 1):
                    base = self.of.parameters(one, "DATUM_REFERENCE_COMPARTMENT")
                    letters = [self._letter(n) for n in references(base[4:5])]
                    if letters:
                        yield precedence, "-".join(letters), _modifiers(base[5:6])
            for name in ("DATUM_REFERENCE", "REFERENCED_MODIFIED_DATUM"):
                old = record.get(name, [])
                if len(old) > 1 and isinstance(old[0], int) and isinstance(old[1], Reference):
                    yield old[0], self._letter(old[1]), _modifiers(old[2:3])

    def _letter(self, number: int) -> str:
        """Letter of a datum, or of an element of several that act as one."""
        datum = self.of.parameters(number, "DATUM")
        if datum:
            return str(datum[-1] or "")
        element = self.of.parameters(number, "DATUM_REFERENCE_ELEMENT")
        return "-".join(self._letter(n) for n in references(element[4:5]))

    def _datum(self, number: int) -> PmiStatement:
        record = self.of[number]
        named = [*(record.get("SHAPE_ASPECT") or next(iter(record.values()))), None, None]
        target = record.get("PLACED_DATUM_TARGET_FEATURE") or record.get("DATUM_TARGET")
        pmi = Pmi(
            kind="datum",
            type="target" if target else "feature" if "DATUM_FEATURE" in record else "datum",
            name=str(named[0] or ""),
            modifier=f"{named[1] or ''} {target[-1] or ''}".strip() if target else None,
            datums=((1, self._letter(self._datum_of.get(number, number)), None),),
        )
        aspect = Reference(number)
        return PmiStatement(pmi, _once((face, "feature") for face in self.faces(aspect)), product_of(self.of, aspect))

    def faces(self, aspect: Any) -> list[int]:
        """Numbers of the faces that an aspect, or what it is made of, is represented by; in the order found."""
        found: list[int] = []
        waiting, seen = [aspect], set()
        while waiting:
            one = waiting.pop(0)
            if not isinstance(one, Reference) or one in seen:
                continue
            seen.add(one)
            waiting += self._parts.get(one, [])
            for name in _SIZES:  # a tolerance may be of a dimension
                waiting += self.of.parameters(one, name)[:1]
            items = list(self._used.get(one, ()))
            while items:
                item = items.pop(0)
                record = self.of[item]
                if any(name in record for name in FACES):
                    found.append(item)
                elif any(name in record for name in _SHELLS):
                    items += list(references(list(record.values())))
        return found


def product_of(instances: Instances, thing: Any) -> int | None:
    """The PRODUCT_DEFINITION that a shape aspect, dimension or shape definition is of."""
    for _ in range(8):
        if not isinstance(thing, Reference):
            return None
        record = instances[thing]
        if "PRODUCT_DEFINITION" in record:
            return int(thing)
        if "PRODUCT_DEFINITION_SHAPE" in record:
            thing = (*record["PRODUCT_DEFINITION_SHAPE"], None, None, None)[2]
            continue
        parameters = record.get("SHAPE_ASPECT") or next(iter(record.values()), [])
        thing = next((p for p in parameters if isinstance(p, Reference)), None)
    return None


def _converted(one: Measure) -> tuple[float, str | None, str | None]:
    """The value in mm or rad, that unit, and the one of the file; of any other kind as it stands."""
    for unit, dimension, factor in (("mm", "length", 1e-3), ("rad", "angle", 1.0)):
        value = one.within({dimension: 1.0}, factor)
        if value is not None:
            return value, unit, one.symbol
    return one.value, one.symbol, one.symbol


def _modifiers(parameters: list[Any]) -> str | None:
    """Modifiers in words: of an enumeration, or of one typed, with its value."""
    words = []
    for one in parameters:
        for inner in one if isinstance(one, list) else [one]:
            values = inner.value if isinstance(inner, TypedValue) else [inner]
            words += [v.strip(".").lower().replace("_", " ") for v in values if isinstance(v, str)]
    return ", ".join(words) or None


def _once(faces: Iterable[tuple[int, str]]) -> tuple[tuple[int, str], ...]:
    return tuple({face: (face, role) for face, role in reversed(list(faces))}.values())[::-1]


# What only the text of a STEP file says of its parts: PMI with the faces it is of, and properties with raw units.

_WHOLE = {"PRODUCT_DEFINITION", "PRODUCT_DEFINITION_SHAPE"}  # of a product, not of an aspect of its shape
_MISWRITTEN = {"g3.cm2": 1000.0}  # the kernel's own writer (8.0) states g/cm3 so; in kg/m3
_REPRESENTED = "PROPERTY_DEFINITION_REPRESENTATION"
_TEXTURE, _FINISH = "SURFACE_TEXTURE_REPRESENTATION", ("finish", "surface finish")
Places = Callable[[Any], list[tuple[int, int]]]  # a face of the kernel -> part and surface_no of each that has it


def with_face_names(model: Model, instances: Instances, faces: FacesOfText, findings: Findings) -> Model:
    """The model whose surfaces have the names that the text gives faces."""
    return _with_labels(model, "name", [([face], name) for face, name in _face_names(instances)], faces, findings)


def with_finish(model: Model, instances: Instances, faces: FacesOfText, findings: Findings) -> Model:
    """The model whose surfaces have the finish that the text states of aspects of a product's shape."""
    faces_of, defined = _PmiReader(instances).faces, _user_defined(instances)
    represented = instances.pairs(_REPRESENTED)
    stated = findings.each("a finish", represented, lambda r: _finish(instances, r, defined, faces_of))
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
    for stated in _PmiReader(instances).all(findings):
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
    represented = instances.pairs(_REPRESENTED)
    for product, attributes in findings.each("a property", represented, lambda r: _property(instances, r, defined)):
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

    def __init__(self, instances: Instances, reader: Any, places: Places) -> None:
        self._instances = instances
        self._reader = reader.Reader()
        self._places = places
        self._same = self._reader.Model().NbEntities() == len(instances)
        self._representations: dict[int, list[int]] = {}
        self._related: dict[int, list[int]] = {}
        for _, shape, shown in instances.pairs("SHAPE_DEFINITION_REPRESENTATION"):
            product = product_of(instances, shape)
            if product is not None:
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


Represented = tuple[int, Reference, Reference]  # a PROPERTY_DEFINITION_REPRESENTATION, its definition, and by what


def _represented(instances: Instances, one: Represented) -> tuple[list[Any], list[int], dict[str, list[Any]]]:
    """Name, description and owner of a property, the items of its representation, and this."""
    definition, record = instances.parameters(one[1], "PROPERTY_DEFINITION"), instances[one[2]]
    items = [int(item) for parameters in record.values() for item in references(parameters[1:2])]
    return [*definition, None, None, None][:3], items, record


def _property(instances: Instances, one: Represented, defined: dict[int, str]) -> tuple[int | None, list[Attribute]]:
    """A property and the product that it is of: of a material, as stated, with the unit of the file, and densities in
    kg/m3 too; finish; what users defined (general properties, such as a revision).  None where of another thing."""
    (name, _, thing), items, record = _represented(instances, one)
    attributes: list[Attribute] = []
    if str(name).lower() == "material property":
        attributes = [attribute for found in measures(instances, items) for attribute in _stated(found)]
    elif not isinstance(thing, Reference) or _WHOLE.isdisjoint(instances[thing]):
        return None, []
    elif _TEXTURE in record:
        attributes = [("finish", text, None)] if (text := _texture(instances, items)) else []
    elif one[1] in defined:
        values = [value for item in items if (value := _value(instances, item)) is not None]
        attributes = [(defined[one[1]], *value) for value in values[:1]]
    return product_of(instances, thing), attributes


def _finish(
    instances: Instances, one: Represented, defined: dict[int, str], faces_of: Callable[[Any], list[int]]
) -> tuple[list[int], str] | None:
    """Faces and their finish: a surface texture (ISO 10303-1110), or what users call finish; None for anything else."""
    (_, _, thing), items, record = _represented(instances, one)
    if _TEXTURE in record or defined.get(one[1], "").lower() in _FINISH:
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
        formations = references(instances.parameters(number, "PRODUCT_DEFINITION")[2:3])
        records = [record for formation in formations for record in instances[formation].values()]
        product = next((one for record in records for one in references(record[2:3])), None)
        named = instances.parameters(product, "PRODUCT")
        if len(named) > 1 and isinstance(named[1], str):
            out[number] = named[1].strip()
    often = Counter(out.values())
    return {number: name for number, name in out.items() if often[name] == 1}


def _user_defined(instances: Instances) -> dict[int, str]:
    """Names of the property definitions that general properties stand behind."""
    out: dict[int, str] = {}
    for _, general, stated in instances.pairs("GENERAL_PROPERTY_ASSOCIATION", first=2):
        named = instances.parameters(general, "GENERAL_PROPERTY")
        if len(named) > 1 and (name := str(named[1] or "").strip()):
            out[stated] = name
    return out


def _value(instances: Instances, item: int) -> tuple[str | float, str | None] | None:
    """Value and unit of an item of a representation: a text or a measure."""
    described = instances[item].get("DESCRIPTIVE_REPRESENTATION_ITEM", [])
    if len(described) > 1:
        return (text, None) if (text := str(described[1] or "").strip()) else None
    one = measure(instances, item)
    return None if one is None else (one.value, one.symbol)


def _stated(one: Measure) -> list[Attribute]:
    name = one.name.removesuffix(" measure") or "material property"
    density = one.within({"mass": 1.0, "length": -3.0}, 1.0)
    if one.symbol in _MISWRITTEN:
        density = one.value * _MISWRITTEN[one.symbol]
    # Twelve digits: conversion of units leaves round-off (2809.9999999999995).
    out: list[Attribute] = [] if density is None else [(name, float(f"{density:.12g}"), "kg/m3")]
    return [*out, (f"{name} as stated", one.value, one.symbol)]
