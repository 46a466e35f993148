"""Units and measures as a STEP file's text states them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from relmodel.readers.step.part21_instances import Instances, Reference, Typed, references, two

_PREFIX = {
    "EXA": ("E", 1e18), "PETA": ("P", 1e15), "TERA": ("T", 1e12), "GIGA": ("G", 1e9), "MEGA": ("M", 1e6),
    "KILO": ("k", 1e3), "HECTO": ("h", 1e2), "DECA": ("da", 1e1), "DECI": ("d", 1e-1), "CENTI": ("c", 1e-2),
    "MILLI": ("m", 1e-3), "MICRO": ("u", 1e-6), "NANO": ("n", 1e-9), "PICO": ("p", 1e-12),
}  # fmt: skip
# Symbol, dimension, and how much of kg, m, s, rad ... it is.
_SI = {
    "METRE": ("m", "length", 1.0), "GRAM": ("g", "mass", 1e-3), "SECOND": ("s", "time", 1.0),
    "RADIAN": ("rad", "angle", 1.0), "STERADIAN": ("sr", "solid angle", 1.0), "KELVIN": ("K", "temperature", 1.0),
    "AMPERE": ("A", "current", 1.0), "MOLE": ("mol", "amount", 1.0), "CANDELA": ("cd", "luminosity", 1.0),
}  # fmt: skip
_CONVERTED = {"INCH": "in", "FOOT": "ft", "DEGREE": "deg", "POUND": "lb"}


@dataclass(frozen=True)
class Unit:
    """symbol: as one would write it, such as g/cm3.  dimension: exponent of each base quantity.  factor: how many of
    kg, m, rad ... it is."""

    symbol: str
    dimension: dict[str, float]
    factor: float


@dataclass(frozen=True)
class Measure:
    """A number with its name, its type in the file (`VOLUME_MEASURE`; empty: none) and its unit (None: not known)."""

    name: str
    type: str
    value: float
    unit: Unit | None

    def within(self, dimension: dict[str, float], factor: float) -> float | None:
        """The value in a unit of `factor` kg, m, rad ...; None where it is not of that dimension."""
        if self.unit is None or self.unit.dimension != dimension:
            return None
        return self.value * (self.unit.factor / factor)


def measure(instances: Instances, number: int) -> Measure | None:
    """The measure that an instance is; None where it is not one."""
    name = ""
    found: Measure | None = None
    for entity, parameters in instances[number].items():
        if entity == "REPRESENTATION_ITEM" or (entity == "MEASURE_REPRESENTATION_ITEM" and len(parameters) == 3):
            name = str(parameters[0] or "")
        for one, following in zip(parameters, [*parameters[1:], None], strict=False):
            pointed = isinstance(following, Reference)
            value = _number(one, pointed)
            if value is not None:
                of_type = one.name if isinstance(one, Typed) else ""
                found = Measure("", of_type, value, unit(instances, following) if pointed else None)
    return None if found is None else replace(found, name=name)


def unit(instances: Instances, number: int) -> Unit | None:
    """The unit that an instance is; None where it is no known unit."""
    record = instances[number]
    if "SI_UNIT" in record:
        return _si(record["SI_UNIT"])
    if "CONVERSION_BASED_UNIT" in record:
        named, pointed = (*record["CONVERSION_BASED_UNIT"], None, None)[:2]
        base = measure(instances, pointed) if isinstance(pointed, Reference) else None
        if base is None or base.unit is None:
            return None
        stated = str(named or "").strip()
        symbol = _CONVERTED.get(stated.upper(), stated.lower())
        return Unit(symbol, base.unit.dimension, base.value * base.unit.factor)
    if "DERIVED_UNIT" in record:
        return _derived(instances, record["DERIVED_UNIT"])
    return None


def validation_units(instances: Instances) -> dict[tuple[str, str], float]:
    """What the volumes and areas among the validation properties are to be multiplied by to be mm3 and mm2.

    Keys: `volume` or `area`, and the number as `number_key` has it.  The unit is that of the measure or, where it has
    none, of length in the context of its representation (ISO 10303-41, -43).
    """
    out: dict[tuple[str, str], float] = {}
    for number in instances.of("PROPERTY_DEFINITION_REPRESENTATION"):
        _, shown = two(instances.parameters(number, "PROPERTY_DEFINITION_REPRESENTATION"))
        for parameters in instances[shown].values() if shown is not None else ():
            if len(parameters) < 3:
                continue
            for item in references(parameters[1]):
                one = measure(instances, item)
                if one is None or one.type not in ("VOLUME_MEASURE", "AREA_MEASURE"):
                    continue
                what = one.type.removesuffix("_MEASURE").lower()
                power = 3 if what == "volume" else 2
                if one.unit is not None and one.unit.dimension == {"length": float(power)}:
                    factor = one.unit.factor
                else:
                    length = length_unit(instances, parameters[2])
                    if length is None:
                        continue
                    factor = length.factor**power
                out[what, number_key(one.value)] = factor * 1e3**power
    return out


def number_key(value: float) -> str:
    """A number as two readers of its text agree on it."""
    return f"{value:.12g}"


def length_unit(instances: Instances, context: Any) -> Unit | None:
    """The unit of length of a representation's context; None where it has none that is known."""
    if not isinstance(context, Reference):
        return None
    for pointed in references(instances.parameters(context, "GLOBAL_UNIT_ASSIGNED_CONTEXT")):
        stated = unit(instances, pointed) if "LENGTH_UNIT" in instances[pointed] else None
        if stated is not None and stated.dimension == {"length": 1.0}:
            return stated
    return None


def _si(parameters: list[Any]) -> Unit | None:
    prefix, name = (str(p or "").strip(".").upper() for p in parameters[-2:])
    if name not in _SI:
        return None
    symbol, dimension, factor = _SI[name]
    before, times = _PREFIX.get(prefix, ("", 1.0))
    return Unit(before + symbol, {dimension: 1.0}, times * factor)


def _derived(instances: Instances, parameters: list[Any]) -> Unit | None:
    dimension: dict[str, float] = {}
    factor = 1.0
    above: list[str] = []
    below: list[str] = []
    for element in references(parameters):
        pointed, power = (*instances.parameters(element, "DERIVED_UNIT_ELEMENT"), None, None)[:2]
        one = unit(instances, pointed) if isinstance(pointed, Reference) else None
        if one is None or not isinstance(power, int | float):
            return None
        for base, exponent in one.dimension.items():
            dimension[base] = dimension.get(base, 0.0) + exponent * power
        factor *= one.factor**power
        size = abs(power)
        (above if power > 0 else below).append(one.symbol + ("" if size == 1 else f"{size:g}"))
    return Unit("/".join([".".join(above) or "1", *below]), {b: e for b, e in dimension.items() if e}, factor)


def _number(one: Any, before_a_unit: bool) -> float | None:
    """The number of a typed value; of one without a type, as some write it, where a unit follows."""
    if isinstance(one, Typed):
        one, before_a_unit = one.value[0] if isinstance(one.value, list) and one.value else None, True
    plain = isinstance(one, int | float) and not isinstance(one, Reference)
    return float(one) if plain and before_a_unit else None
