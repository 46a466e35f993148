"""Units and measures as a STEP file's text states them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from relmodel.readers.step.part21_instances import Instances, Reference, Typed, references

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
    """A number with its name and unit; None where the file gives no unit that is known."""

    name: str
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
                found = Measure("", value, unit(instances, following) if pointed else None)
    return None if found is None else Measure(name, found.value, found.unit)


def unit(instances: Instances, number: int) -> Unit | None:
    """The unit that an instance is; None where it is not one that can be told."""
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
