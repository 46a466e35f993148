"""The text of a STEP file (ISO 10303-21), read without a CAD kernel: its header, instances, strings, units."""

from __future__ import annotations

import re
import sys
from array import array
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from relmodel.arrays import Ints
from relmodel.errors import InputError
from relmodel.model.model import Finding

# \S\c is c with its eighth bit set, in the page of ISO 8859 that \PA\ .. \PI\ names (the first if none does); \X\hh one
# byte of ISO 8859-1; \X2\hhhh...\X0\ and \X4\hhhhhhhh...\X0\ code points; \\ a backslash; '' an apostrophe; line breaks
# count for nothing. What is written plainly above ASCII is no Part 21 but common: UTF-8, GB18030 or Windows-1252 (of
# which ISO 8859-1 is a part), told apart by what the texts of a file look like. Other codes of two bytes cannot be told
# from Chinese where they use its frequent characters.

_DIRECTIVE = re.compile(
    r"''|\\\\|\\P([A-I])\\|\\S\\(.)|\\X\\([0-9A-Fa-f]{2})"
    r"|\\X2\\((?:[0-9A-Fa-f]{4})+)\\X0\\|\\X4\\((?:[0-9A-Fa-f]{8})+)\\X0\\",
    re.DOTALL,
)
_STRING = re.compile(rb"/\*.*?\*/|'((?:[^']|'')*)'", re.DOTALL)
_NOT_ASCII = re.compile(rb"[\x80-\xff]+")
_UMLAUTS = re.compile(rb"[\xc4\xd6\xdc\xdf\xe4\xf6\xfc]+")
# What stands in a row of Western text: up to two letters behind up to two signs; or one of the signs of Windows.
_WESTERN = re.compile(rb"[\xa0-\xbf]{0,2}[\xc0-\xff]{0,2}|[\x80\x82-\x8c\x8e\x91-\x9c\x9e\x9f]|" + _UMLAUTS.pattern)
_PAIR = re.compile(rb"([\xa1-\xa9\xb0-\xd7][\xa1-\xfe])|..", re.DOTALL)  # a sign or character of GB2312's first level


def decoded(written: bytes) -> str:
    """Text of a string that is given without its quotes; what is no directive stays as it is."""
    return _decoded(written, _is_chinese([written]))


def in_utf8(content: bytes) -> tuple[bytes, list[str]]:
    """A file whose strings above ASCII are all plain UTF-8 (no directives but doubled backslashes and apostrophes), and
    those of them that are in no known encoding, with their bytes as `\\xhh` or U+FFFD where these do not decode."""
    if content.isascii() and b"\\" not in content:
        return content, []
    chinese = _is_chinese(one[1] for one in _STRING.finditer(content) if one[1])
    unread: dict[str, None] = {}

    def plain(one: re.Match[bytes]) -> bytes:
        written = one[1]
        if not written or (written.isascii() and b"\\" not in written):
            return one[0]
        text = _decoded(written, chinese)
        if "\ufffd" in text or _characters(written, chinese) is None:
            unread[text] = None
        return b"'" + text.replace("\\", "\\\\").replace("'", "''").encode() + b"'"

    return _STRING.sub(plain, content), list(unread)


def _decoded(written: bytes, chinese: bool) -> str:
    text = _characters(written, chinese)
    if text is None:
        return written.decode("utf-8", "backslashreplace")
    text = text.replace("\r", "").replace("\n", "")
    if "'" not in text and "\\" not in text:
        return text
    page = "A"

    def meaning(one: re.Match[str]) -> str:
        nonlocal page
        named, shifted, byte, pairs, quads = one.groups()
        if named:
            page = named
            return ""
        if shifted is not None:
            return bytes([(ord(shifted) & 0x7F) | 0x80]).decode(f"iso8859-{ord(page) - ord('A') + 1}", "replace")
        if byte:
            return chr(int(byte, 16))
        if pairs:
            return bytes.fromhex(pairs).decode("utf-16-be", "replace")
        if quads:
            return bytes.fromhex(quads).decode("utf-32-be", "replace")
        return one[0][0]

    return _DIRECTIVE.sub(meaning, text)


def _characters(written: bytes, chinese: bool) -> str | None:
    """Characters of a string, its directives as they are; None where its bytes are in no known encoding."""
    text = _by("utf-8", written)
    if text is not None and (not chinese or text.isascii() or max(text) > "\u07ff"):  # two bytes are as well Chinese
        return text
    if chinese and (in_gb := _by("gb18030", written)) is not None:
        return in_gb
    if text is not None:
        return text
    western = all(_WESTERN.fullmatch(row) for row in _NOT_ASCII.findall(written))
    return _by("cp1252", written) if western else None


def _by(encoding: str, written: bytes) -> str | None:
    try:
        return written.decode(encoding)
    except UnicodeDecodeError:
        return None


def _is_chinese(strings: Iterable[bytes]) -> bool:
    """Whether strings that are not UTF-8 are in GB18030: half of their bytes above ASCII are frequent characters of it.

    Two bytes between Latin letters, or nothing but umlauts, count for none: they are as well Western (GRÖßE)."""
    frequent = above = 0
    for written in strings:
        if written.isascii() or _by("utf-8", written) is not None:
            continue
        for row in _NOT_ASCII.finditer(written):
            above += len(row[0])
            inside = written[row.start() - 1 : row.start()].isalpha() and written[row.end() : row.end() + 1].isalpha()
            if len(row[0]) % 2 == 0 and not (len(row[0]) == 2 and inside) and not _UMLAUTS.fullmatch(row[0]):
                frequent += sum(map(len, _PAIR.findall(row[0])))
    return 2 * frequent >= above > 0


# Instances of a STEP file's text (ISO 10303-21), parsed when they are asked for.
#
# For what the CAD kernel does not hand on: tolerances, materials and units as the file states them, tessellations.

# Strings may hold semicolons, hashes and what looks like comments.
_INSTANCE = re.compile(rb"#(\d+)\s*=\s*(\(|[A-Za-z_][A-Za-z0-9_]*)((?:[^;']++|'[^']*+')*+);")
_REFERENCE = re.compile(rb"#(\d+)")
_COMMENT = re.compile(rb"('[^']*+')|/\*.*?\*/", re.DOTALL)
_TOKEN = re.compile(
    rb"\s*(?:'((?:[^']|'')*)'|#(\d+)|([-+]?\d+\.\d*(?:[eE][-+]?\d+)?)|([-+]?\d+)"
    rb"|(\.[A-Za-z0-9_]+\.)|(?P<name>[A-Za-z_][A-Za-z0-9_]*)|\"[0-9A-Fa-f]*\"|(?P<mark>[(),$*]))"
)


class Reference(int):
    """Number of the instance that a parameter points to."""


@dataclass(frozen=True)
class TypedValue:
    """A value with its type, such as LENGTH_MEASURE(3.)."""

    name: str
    value: Any


Record = dict[str, list[Any]]  # entity name -> parameters; of a complex instance one entry a partial entity


class Instances:
    """Instances of the data section by number.  Parameters are str (an enumeration with its dots), float, int,
    Reference, Typed, list, or None for $ and *."""

    def __init__(self, text: bytes) -> None:
        if b"/*" in text:
            text = _COMMENT.sub(lambda one: one[1] or b" ", text)
        # Most instances are points and directions that are never asked for, so only their places in the text are kept.
        self.text = text  # without comments
        self._parsed: dict[int, Record] = {}
        self.named: dict[str, array[int]] = {}  # by the names of entities
        numbers, starts, ends = array("q"), array("q"), array("q")
        named: dict[bytes, array[int]] = {}
        for one in _INSTANCE.finditer(text, max(text.find(b"DATA;"), 0)):
            number, name = int(one[1]), one[2]
            numbers.append(number)
            starts.append(one.start(2))
            ends.append(one.end(3))
            if name == b"(":
                for partial in _record(one[2] + one[3]):
                    self.named.setdefault(partial, array("q")).append(number)
            elif name in named:
                named[name].append(number)
            else:
                named[name] = self.named.setdefault(name.decode().upper(), array("q"))
                named[name].append(number)
        self.numbers = found = np.array(numbers, np.int64)  # as they come; one may stand twice
        self._order = np.argsort(found, kind="stable")
        self._numbers = found[self._order]
        self._starts, self._ends = np.array(starts, np.int64), np.array(ends, np.int64)

    def __len__(self) -> int:
        return len(self._numbers)

    def of(self, *names: str) -> list[int]:
        """Numbers of the instances that are, or of a complex instance have, one of the entities; in rising order."""
        return sorted({number for name in names for number in self.named.get(name, ())})

    def ordinal(self, number: int) -> int | None:
        """Place of an instance in the file, from 0; of several with one number that of the last."""
        at = int(np.searchsorted(self._numbers, number, side="right")) - 1
        return int(self._order[at]) if at >= 0 and self._numbers[at] == number else None

    def __getitem__(self, number: int) -> Record:
        """The instance; empty where there is none of that number."""
        if number not in self._parsed:
            at = self.ordinal(number)
            self._parsed[number] = {} if at is None else _record(self.text[self._starts[at] : self._ends[at]])
        return self._parsed[number]

    def references(self, number: int) -> list[int]:
        """Numbers of the instances that one points to, those in its strings too; it is not parsed for them."""
        at = self.ordinal(number)
        return [] if at is None else [int(n) for n in _REFERENCE.findall(self.text, self._starts[at], self._ends[at])]

    def parameters(self, number: Any, name: str) -> list[Any]:
        """Parameters of one of an instance's entities; empty where it has none of that name, or is no reference."""
        return self[number].get(name, []) if isinstance(number, int) else []

    def pairs(self, *names: str, first: int = 0) -> list[tuple[int, Reference, Reference]]:
        """Number of each instance of some entities and two parameters, from the `first` on, if both are references."""
        found = ((n, *self.parameters(n, name)[first : first + 2]) for name in names for n in self.of(name))
        return [one for one in found if len(one) == 3 and all(isinstance(end, Reference) for end in one[1:])]


def references(value: Any) -> Iterator[Reference]:
    """All references in a parameter, lists and typed values gone through."""
    if isinstance(value, Reference):
        yield value
    elif isinstance(value, list):
        for one in value:
            yield from references(one)
    elif isinstance(value, TypedValue):
        yield from references(value.value)


# How the groups of a token are read: text, reference, real, whole number and enumeration.
_SCALARS: dict[int, Callable[[bytes], Any]] = {1: decoded, 2: Reference, 3: float, 4: int, 5: bytes.decode}


def _record(raw: bytes) -> Record:
    values = _values(raw)
    if len(values) == 1 and isinstance(values[0], list):  # complex: (A(...)B(...))
        values = values[0]
    return {one.name: one.value for one in values if isinstance(one, TypedValue) and isinstance(one.value, list)} | {
        one.name: [one.value] for one in values if isinstance(one, TypedValue) and not isinstance(one.value, list)
    }


def _values(raw: bytes) -> list[Any]:
    """Values of a text in the syntax of parameters; what is broken ends it."""
    stack: list[list[Any]] = [[]]
    names: list[str | None] = []
    pending: str | None = None
    place = 0
    while found := _TOKEN.match(raw, place):
        place = found.end()
        name, mark = found["name"], found["mark"]
        if mark == b"(":
            names.append(pending)
            pending = None
            stack.append([])
        elif mark == b")":
            if not names:
                break
            inner, keyword = stack.pop(), names.pop()
            stack[-1].append(inner if keyword is None else TypedValue(keyword, inner))
        elif name is not None:
            pending = name.decode().upper()
        elif mark != b",":
            read = _SCALARS.get(found.lastindex or 0)
            stack[-1].append(read(found[found.lastindex or 0]) if read else None)
    return stack[0]


# What the text of a STEP file (ISO 10303-21) says of itself, without a CAD kernel.

EXACT_FACES = ("ADVANCED_FACE", "FACE_SURFACE")
TRIANGULATED_FACES = ("TRIANGULATED_FACE", "COMPLEX_TRIANGULATED_FACE")
FACES = (*EXACT_FACES, *TRIANGULATED_FACES)
_QUOTED = re.compile(rb"'(?:[^']|'')*'")  # ends at a quote that is not doubled
# A word in the place of a parameter: keywords are followed by a bracket, enumerations stand between dots.
_WORD = re.compile(rb"[(,]\s*[-+]?([A-Za-z]\w*)\s*[,)]")
_NOT_A_NUMBER = re.compile(rb"[(,]\s*([-+]?(?:nan|inf|infinity))\s*[,)]", re.IGNORECASE)
_EXPONENT = re.compile(rb"[\d.][eE]\+?0*(\d{3,})")
_SCHEMA = re.compile(rb"FILE_SCHEMA\s*\(\s*\(\s*'((?:[^']|'')*)'", re.DOTALL)
_USAGE = "NEXT_ASSEMBLY_USAGE_OCCURRENCE"
_COUNTED = re.compile(r"(?:NAUO)?\d+")


def check_part21(text: bytes, name: str) -> None:
    """Raise InputError where a file is not Part 21 at all, or was cut off before its end."""
    if b"ISO-10303-21;" not in text[:4096]:
        raise InputError(f"{name} is not a STEP file, as it does not begin with ISO-10303-21: give a Part 21 file")
    if b"END-ISO-10303-21" not in text[-4096:]:
        raise InputError(f"{name} is cut off, as END-ISO-10303-21 is missing at its end: export or copy it again")


def schema_name(instances: Instances) -> str | None:
    """Schema that the header names, as written, with the numbers behind it left off."""
    found = _SCHEMA.search(instances.text, 0, 1 << 20)
    return decoded(found[1]).split("{")[0].strip() if found else None


def face_count(instances: Instances) -> int:
    """Faces that the text lists: exact ones; where it has none, those that it gives as triangles.  Faces in an instance
    too broken to parse count too."""
    return _listed(instances, EXACT_FACES) or _listed(instances, TRIANGULATED_FACES)


def _listed(instances: Instances, names: tuple[str, ...]) -> int:
    parsed = len(instances.of(*names))
    # A name that ends like another is found with it.
    found = sum(instances.text.count(n.encode()) for n in names if not any(n != o and n.endswith(o) for o in names))
    if found == parsed:
        return parsed
    pattern = re.compile(rb"\b(?:" + "|".join(names).encode() + rb")\s*\(")
    return len(pattern.findall(_QUOTED.sub(b"''", instances.text)))


def faces_in_use(instances: Instances) -> int:
    """How many faces some shape representation reaches; the others are left-overs that belong to no product."""
    waiting = [n for name, of in instances.named.items() if name.endswith("SHAPE_REPRESENTATION") for n in of]
    reached = set(waiting)
    while waiting:
        fresh = set(instances.references(waiting.pop())) - reached
        reached |= fresh
        waiting.extend(fresh)
    exact, triangulated = (len(reached & set(instances.of(*names))) for names in (EXACT_FACES, TRIANGULATED_FACES))
    return exact or triangulated


def product_numbers(instances: Instances) -> dict[str, str]:
    """Identifier of each product by its name, where only one product has that name."""
    named: dict[str, list[str]] = {}
    for product in instances.of("PRODUCT"):
        number, name = ([*instances.parameters(product, "PRODUCT"), "", ""])[:2]
        if isinstance(number, str) and isinstance(name, str):
            named.setdefault(name.strip(), []).append(number.strip())
    return {name: numbers[0] for name, numbers in named.items() if len(numbers) == 1 and numbers[0]}


def numbered_usages(instances: Instances) -> set[str]:
    """Identifiers of the uses of products that have no name and that a program has counted, such as 1 and NAUO1."""
    usages = (([*instances.parameters(n, _USAGE), "", ""])[:2] for n in instances.of(_USAGE))
    return {str(number) for number, name in usages if _COUNTED.fullmatch(str(number)) and not str(name or "").strip()}


def check_finite(instances: Instances, name: str) -> None:
    """Raise InputError where a number of the text is not finite: the CAD kernel would go on without it."""
    text = instances.text
    if _not_finite(text) and (found := _not_finite(_QUOTED.sub(b"''", text))):
        raise InputError(f"{name} has {found.decode()}, which is not a finite number: export it again")


def _not_finite(text: bytes) -> bytes | None:
    if found := _NOT_A_NUMBER.search(text):
        return found[1]
    large = (one for one in _EXPONENT.finditer(text) if int(one[1]) > sys.float_info.max_10_exp)
    return next((b"a number with the exponent " + one[1] for one in large), None)


def damage(instances: Instances) -> tuple[Finding, ...]:
    """Signs that the text has lost or altered instances; none in an intact file."""
    clauses = []
    text, numbers = instances.text, instances.numbers
    defined = np.unique(numbers)
    if _absent(text, defined).size:
        absent = _absent(_QUOTED.sub(b"''", text), defined)  # a string may hold what looks like a reference
        if absent.size:
            clauses.append(f"refers to #{absent[0]}, which it does not hold")
    if len(defined) < len(numbers):
        values, counts = np.unique(numbers, return_counts=True)
        clauses.append(f"defines #{values[counts > 1][0]} more than once")
    if _WORD.search(text) and (word := _WORD.search(_QUOTED.sub(b"''", text))):
        clauses.append(f"has {decoded(word[1])} where a number or another parameter belongs")
    # Writers that place one use of a product by this entity place all of them by it.
    usages = len(instances.of(_USAGE))
    placed = len(instances.of("CONTEXT_DEPENDENT_SHAPE_REPRESENTATION"))
    if 0 < placed < usages:
        clauses.append(f"does not place {usages - placed} of {usages} components")
    return tuple(Finding("damaged_text", f"the file {clause}") for clause in clauses)


def _absent(text: bytes, defined: Ints) -> Ints:
    """Numbers that the text refers to and does not define, increasing."""
    pointed = np.array([int(n) for n in set(_REFERENCE.findall(text)) if len(n) < 19], np.int64)
    return np.setdiff1d(pointed, defined)


# Units and measures as a STEP file's text states them.

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
    """symbol: as one writes it, as g/cm3.  dimension: exponent of each base quantity.  factor: in kg, m, rad ..."""

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

    @property
    def symbol(self) -> str | None:
        """Of its unit."""
        return None if self.unit is None else self.unit.symbol

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
                of_type = one.name if isinstance(one, TypedValue) else ""
                found = Measure("", of_type, value, unit(instances, following) if pointed else None)
    return None if found is None else replace(found, name=name)


def measures(instances: Instances, numbers: Iterable[int]) -> list[Measure]:
    """Those instances that are measures."""
    return [one for number in numbers if (one := measure(instances, number)) is not None]


def unit(instances: Instances, number: int) -> Unit | None:
    """The unit that an instance is; None where it is no known unit."""
    record = instances[number]
    if "SI_UNIT" in record:
        prefix, name = (str(p or "").strip(".").upper() for p in record["SI_UNIT"][-2:])
        if name not in _SI:
            return None
        symbol, dimension, factor = _SI[name]
        before, times = _PREFIX.get(prefix, ("", 1.0))
        return Unit(before + symbol, {dimension: 1.0}, times * factor)
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
    none, of length in the context of its representation (ISO 10303-41, -43)."""
    out: dict[tuple[str, str], float] = {}
    powers = {"VOLUME_MEASURE": 3, "AREA_MEASURE": 2}
    for _, _, shown in instances.pairs("PROPERTY_DEFINITION_REPRESENTATION"):
        for parameters in (given for given in instances[shown].values() if len(given) > 2):
            for one in measures(instances, references(parameters[1])):
                power = powers.get(one.type, 0)
                length = length_unit(instances, parameters[2])
                if power and one.unit is not None and one.unit.dimension == {"length": float(power)}:
                    factor = one.unit.factor
                elif power and length is not None:
                    factor = length.factor**power
                else:
                    continue
                out[one.type.removesuffix("_MEASURE").lower(), number_key(one.value)] = factor * 1e3**power
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
    if isinstance(one, TypedValue):
        one, before_a_unit = one.value[0] if isinstance(one.value, list) and one.value else None, True
    plain = isinstance(one, int | float) and not isinstance(one, Reference)
    return float(one) if plain and before_a_unit else None
