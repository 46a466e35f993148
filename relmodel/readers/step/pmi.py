"""Dimensions, geometric tolerances and datums of a STEP AP242 or AP203e2 file, from its text, with their faces.

The way from one to a face (ISO 10303-47, -242): what is toleranced is a SHAPE_ASPECT, made of others by
SHAPE_ASPECT_RELATIONSHIP, and a representation usage points from an aspect to the ADVANCED_FACEs.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

from relmodel.model.model import Pmi
from relmodel.readers.step.contained import Findings
from relmodel.readers.step.part21 import EXACT_FACES, TRIANGULATED_FACES
from relmodel.readers.step.part21_instances import Instances, Reference, Typed, references, two
from relmodel.readers.step.part21_units import Measure, measure

_SIZES = ("DIMENSIONAL_SIZE", "ANGULAR_SIZE")
_LOCATIONS = ("DIMENSIONAL_LOCATION", "ANGULAR_LOCATION", "DIRECTED_DIMENSIONAL_LOCATION")
_TOLERANCES = (
    "ANGULARITY_TOLERANCE",
    "CIRCULAR_RUNOUT_TOLERANCE",
    "COAXIALITY_TOLERANCE",
    "CONCENTRICITY_TOLERANCE",
    "CYLINDRICITY_TOLERANCE",
    "FLATNESS_TOLERANCE",
    "LINE_PROFILE_TOLERANCE",
    "PARALLELISM_TOLERANCE",
    "PERPENDICULARITY_TOLERANCE",
    "POSITION_TOLERANCE",
    "ROUNDNESS_TOLERANCE",
    "STRAIGHTNESS_TOLERANCE",
    "SURFACE_PROFILE_TOLERANCE",
    "SYMMETRY_TOLERANCE",
    "TOTAL_RUNOUT_TOLERANCE",
)
_DATUM_FEATURES = ("DATUM_FEATURE", "PLACED_DATUM_TARGET_FEATURE", "DATUM_TARGET")
_MADE_OF = ("SHAPE_ASPECT_RELATIONSHIP", "SHAPE_ASPECT_DERIVING_RELATIONSHIP", "SHAPE_ASPECT_ASSOCIATIVITY")
_USAGES = ("GEOMETRIC_ITEM_SPECIFIC_USAGE", "ITEM_IDENTIFIED_REPRESENTATION_USAGE")
FACES = (*EXACT_FACES, *TRIANGULATED_FACES)
_SHELLS = ("CLOSED_SHELL", "OPEN_SHELL", "CONNECTED_FACE_SET", "CONNECTED_FACE_SUB_SET", "MANIFOLD_SOLID_BREP")


@dataclass(frozen=True)
class Stated:
    """A dimension, tolerance or datum of the text, without its surfaces.

    faces: number of the instance, and role.  product: number of the PRODUCT_DEFINITION that it is of.
    """

    pmi: Pmi
    faces: tuple[tuple[int, str], ...]
    product: int | None


def read_pmi(instances: Instances, findings: Findings) -> list[Stated]:
    """All dimensions, then tolerances, then datums of a file, in the order of their numbers."""
    return _Reader(instances).all(findings)


def face_finder(instances: Instances) -> Callable[[Any], list[int]]:
    """Gives the numbers of the faces that a shape aspect, or what it is made of, is represented by."""
    return _Reader(instances).faces


class _Reader:
    def __init__(self, instances: Instances) -> None:
        self.of = instances
        self._parts: dict[int, list[int]] = {}
        self._used: dict[int, list[int]] = {}
        self._datum_of: dict[int, int] = {}
        datums = set(instances.of("DATUM"))
        for name in _MADE_OF:
            for number in instances.of(name):
                whole, part = two(instances.parameters(number, name)[2:])
                if part in datums and whole is not None:
                    self._datum_of[whole] = part
                elif whole is not None and part is not None:
                    self._parts.setdefault(whole, []).append(part)
        for number in instances.of("FEATURE_FOR_DATUM_TARGET_RELATIONSHIP"):
            feature, target = two(instances.parameters(number, "FEATURE_FOR_DATUM_TARGET_RELATIONSHIP")[2:])
            if feature is not None and target is not None:
                self._parts.setdefault(target, []).append(feature)
        for name in _USAGES:
            for number in instances.of(name):
                parameters = instances.parameters(number, name)
                if len(parameters) > 4 and isinstance(parameters[2], Reference):
                    self._used.setdefault(parameters[2], []).extend(references(parameters[4]))

    def all(self, findings: Findings) -> list[Stated]:
        values, bounds, zones = self._values(), self._bounds(), self._zones()
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

    def _values(self) -> dict[int, list[int]]:
        """Items that represent each dimension."""
        values: dict[int, list[int]] = {}
        for number in self.of.of("DIMENSIONAL_CHARACTERISTIC_REPRESENTATION"):
            dimension, shown = two(self.of.parameters(number, "DIMENSIONAL_CHARACTERISTIC_REPRESENTATION"))
            if dimension is not None and shown is not None:
                for parameters in self.of[shown].values():
                    values.setdefault(dimension, []).extend(references(parameters[1:2]))
        return values

    def _bounds(self) -> dict[int, int]:
        """The plus-minus tolerance of each dimension that has one."""
        bounds: dict[int, int] = {}
        for number in self.of.of("PLUS_MINUS_TOLERANCE"):
            bound, dimension = two(self.of.parameters(number, "PLUS_MINUS_TOLERANCE"))
            if bound is not None and dimension is not None:
                bounds[dimension] = bound
        return bounds

    def _zones(self) -> dict[int, str]:
        """Form of the zone of each tolerance that has one."""
        return {
            tolerance: str(form[0] or "")
            for number in self.of.of("TOLERANCE_ZONE")
            if len(zone := self.of.parameters(number, "TOLERANCE_ZONE")) > 5
            and (form := self.of.parameters(zone[5], "TOLERANCE_ZONE_FORM") if _pointed(zone[5]) else None)
            for tolerance in references(zone[4])
        }

    def _dimension(self, number: int, values: list[int], bound: int | None) -> Stated:
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
        measures = [m for m in (measure(self.of, v) for v in values) if m is not None]
        value = lower = upper = None
        unit = stated = None
        for one in measures:
            converted, unit, stated = _converted(one)
            if "upper" in one.name.lower():
                upper = converted
            elif "lower" in one.name.lower():
                lower = converted
            else:
                value = converted
        said = [note for v in values if (note := self._note(v))]
        if bound is not None:
            record = self.of[bound]
            if "TOLERANCE_VALUE" in record and value is not None:
                ends = [
                    m for m in (measure(self.of, n) for n in references(record["TOLERANCE_VALUE"])) if m is not None
                ]
                if len(ends) == 2:
                    lower, upper = (value + _converted(end)[0] for end in ends)
            elif "LIMITS_AND_FITS" in record:
                said.append("".join(str(p) for p in record["LIMITS_AND_FITS"] if p is not None))
        faces = [(face, role) for aspect, role in aspects for face in self.faces(aspect)]
        pmi = Pmi("dimension", kind, "", value, lower, upper, unit, stated, ", ".join(said) or None)
        return Stated(pmi, _once(faces), product_of(self.of, aspects[0][0] if aspects else None))

    def _note(self, number: int) -> str:
        parameters = self.of.parameters(number, "DESCRIPTIVE_REPRESENTATION_ITEM")
        return str(parameters[1] or "") if len(parameters) > 1 else ""

    def _tolerance(self, number: int, zone: str | None) -> Stated:
        record = self.of[number]
        kind = next(n for n in _TOLERANCES if n in record)
        plain = record.get("GEOMETRIC_TOLERANCE") or record[kind]
        width = measure(self.of, plain[2]) if len(plain) > 3 and _pointed(plain[2]) else None
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
        return Stated(pmi, _once((face, "feature") for face in self.faces(aspect)), product_of(self.of, aspect))

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
                if len(old) > 1 and isinstance(old[0], int) and _pointed(old[1]):
                    yield old[0], self._letter(old[1]), _modifiers(old[2:3])

    def _letter(self, number: int) -> str:
        """Letter of a datum, or of an element of several that act as one."""
        datum = self.of.parameters(number, "DATUM")
        if datum:
            return str(datum[-1] or "")
        element = self.of.parameters(number, "DATUM_REFERENCE_ELEMENT")
        return "-".join(self._letter(n) for n in references(element[4:5]))

    def _datum(self, number: int) -> Stated:
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
        return Stated(pmi, _once((face, "feature") for face in self.faces(aspect)), product_of(self.of, aspect))

    def faces(self, aspect: Any) -> list[int]:
        """Numbers of the faces that an aspect, or what it is made of, is represented by; in the order found."""
        found: list[int] = []
        waiting, seen = [aspect], set()
        while waiting:
            one = waiting.pop(0)
            if not _pointed(one) or one in seen:
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
        if not _pointed(thing):
            return None
        record = instances[thing]
        if "PRODUCT_DEFINITION" in record:
            return int(thing)
        if "PRODUCT_DEFINITION_SHAPE" in record:
            thing = (*record["PRODUCT_DEFINITION_SHAPE"], None, None, None)[2]
            continue
        parameters = record.get("SHAPE_ASPECT") or next(iter(record.values()), [])
        thing = next((p for p in parameters if _pointed(p)), None)
    return None


def _pointed(value: Any) -> bool:
    return isinstance(value, Reference)


def _converted(one: Measure) -> tuple[float, str | None, str | None]:
    """The value in mm or rad, that unit, and the one of the file; of any other kind as it stands."""
    stated = one.unit.symbol if one.unit is not None else None
    for unit, dimension, factor in (("mm", "length", 1e-3), ("rad", "angle", 1.0)):
        value = one.within({dimension: 1.0}, factor)
        if value is not None:
            return value, unit, stated
    return one.value, stated, stated


def _modifiers(parameters: list[Any]) -> str | None:
    """Modifiers in words: of an enumeration, or of one typed, with its value."""
    words = []
    for one in parameters:
        for inner in one if isinstance(one, list) else [one]:
            values = inner.value if isinstance(inner, Typed) else [inner]
            words += [v.strip(".").lower().replace("_", " ") for v in values if isinstance(v, str)]
    return ", ".join(words) or None


def _once(faces: Iterable[tuple[int, str]]) -> tuple[tuple[int, str], ...]:
    return tuple({face: (face, role) for face, role in reversed(list(faces))}.values())[::-1]
