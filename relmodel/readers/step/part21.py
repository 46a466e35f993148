"""What the text of a STEP file (ISO 10303-21) says of itself, without a CAD kernel."""

from __future__ import annotations

import re
import sys
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

from relmodel.errors import InputError
from relmodel.readers.step.part21_strings import decoded

# A string ends at a quote that is not doubled; a comment at the first */.
_BLANKED = re.compile(rb"'(?:[^']|'')*'|/\*.*?\*/", re.DOTALL)
_EXACT = (b"ADVANCED_FACE", b"FACE_SURFACE")
_TESSELLATED = (b"TRIANGULATED_FACE", b"COMPLEX_TRIANGULATED_FACE")
_COUNTED = (
    *_EXACT,
    *_TESSELLATED,
    b"NEXT_ASSEMBLY_USAGE_OCCURRENCE",
    b"CONTEXT_DEPENDENT_SHAPE_REPRESENTATION",
    b"PRODUCT",
    b"EDGE_CURVE",
)
_ENTITY = re.compile(rb"\b(" + b"|".join(_COUNTED) + rb")\s*\(")
_INSTANCE = re.compile(rb"#(\d+)\s*=\s*([^;]*);")
_DEFINED = re.compile(rb"#(\d+)\s*=")
_REFERENCE = re.compile(rb"#(\d+)")
# What stands for a parameter and is none: keywords are followed by a bracket, enumerations stand between dots.
_WORD = re.compile(rb"[(,]\s*[-+]?([A-Za-z]\w*)\s*[,)]")
_EXPONENT = re.compile(rb"[\d.][eE]\+?0*(\d{3,})")
_FACE = re.compile(rb"\b(?:" + b"|".join(_EXACT) + rb")\s*\(")
_TESSELLATED_FACE = re.compile(rb"\b(?:" + b"|".join(_TESSELLATED) + rb")\s*\(")
_SHAPE = re.compile(rb"SHAPE_REPRESENTATION\s*\(")
_PRODUCT = re.compile(rb"=\s*PRODUCT\s*\(\s*'((?:[^']|'')*)'\s*,\s*'((?:[^']|'')*)'")
_SCHEMA = re.compile(rb"FILE_SCHEMA\s*\(\s*\(\s*'((?:[^']|'')*)'", re.DOTALL)


@dataclass(frozen=True)
class Summary:
    """schema_name: as written, with the numbers behind it left off.  Counts are of instances in the data section.

    damage: what shows that the text has lost or altered instances, as a clause ("it ..."); None in a whole file.
    faces: exact ones; where a file has none, those that it gives as triangles.
    numbers: identifier of each product by its name, where one product alone has that name.
    """

    schema_name: str | None
    faces: int
    edges: int
    products: int
    usages: int
    damage: str | None
    numbers: dict[str, str]


def summarise(path: Path, name: str | None = None) -> Summary:
    """Schema and counts of a STEP file.  `name` is what to call it in an error.

    Raises InputError where it is not Part 21 at all, or was cut off before its end.
    """
    name = name or str(path)
    try:
        text = path.read_bytes()
    except OSError as error:
        raise InputError(f"cannot read {name} ({error.strerror}): give the path of a STEP file") from error
    if b"ISO-10303-21;" not in text[:4096]:
        raise InputError(f"{name} is not a STEP file, as it does not begin with ISO-10303-21: give a Part 21 file")
    if b"END-ISO-10303-21" not in text[-4096:]:
        raise InputError(f"{name} is cut off, for END-ISO-10303-21 is missing at its end: export or copy it again")
    schema = _SCHEMA.search(text)
    counts = dict.fromkeys(_COUNTED, 0)
    blanked = _BLANKED.sub(b"''", text)
    for entity in _ENTITY.findall(blanked):
        counts[entity] += 1
    products = [(_text(one[2]), _text(one[1])) for one in _PRODUCT.finditer(text)]
    named, names = dict(products), [name for name, _ in products]
    return Summary(
        schema_name=schema[1].decode("latin-1").split("{")[0].strip() if schema else None,
        faces=sum(counts[name] for name in _EXACT) or sum(counts[name] for name in _TESSELLATED),
        edges=counts[b"EDGE_CURVE"],
        products=counts[b"PRODUCT"],
        usages=counts[b"NEXT_ASSEMBLY_USAGE_OCCURRENCE"],
        damage=_damage(blanked, counts),
        numbers={name: number for name, number in named.items() if number and names.count(name) == 1},
    )


def _damage(blanked: bytes, counts: dict[bytes, int]) -> str | None:
    defined = _DEFINED.findall(blanked)
    there = set(defined)
    absent = set(_REFERENCE.findall(blanked)) - there
    if absent:
        return f"it refers to #{min(map(int, absent))}, which it does not hold"
    if len(there) < len(defined):
        twice = min(int(number) for number, count in Counter(defined).items() if count > 1)
        return f"it defines #{twice} more than once"
    if word := _WORD.search(blanked):
        return f"it has {word[1].decode()} where a number or another parameter belongs"
    if any(int(exponent) > sys.float_info.max_10_exp for exponent in _EXPONENT.findall(blanked)):
        return "it has a number that is too large for any computer"
    # Writers that place one use of a product by this entity place all of them by it.
    usages, placed = counts[b"NEXT_ASSEMBLY_USAGE_OCCURRENCE"], counts[b"CONTEXT_DEPENDENT_SHAPE_REPRESENTATION"]
    if 0 < placed < usages:
        return f"it does not say where {usages - placed} of {usages} components stand"
    return None


def _text(written: bytes) -> str:
    return decoded(written).strip()


def faces_in_use(path: Path) -> int:
    """How many faces some shape representation reaches; the others are left-overs that belong to no product.

    Slower than `summarise`, for it follows every reference of the file.
    """
    instances = {int(one[1]): one[2] for one in _INSTANCE.finditer(_BLANKED.sub(b"''", path.read_bytes()))}
    waiting = [number for number, text in instances.items() if _SHAPE.search(text)]
    reached = set(waiting)
    exact = tessellated = 0
    while waiting:
        text = instances.get(waiting.pop(), b"")
        exact += bool(_FACE.search(text))
        tessellated += bool(_TESSELLATED_FACE.search(text))
        fresh = {int(number) for number in _REFERENCE.findall(text)} - reached
        reached |= fresh
        waiting.extend(fresh)
    return exact or tessellated
