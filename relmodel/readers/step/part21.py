"""What the text of a STEP file (ISO 10303-21) says of itself, without a CAD kernel."""

from __future__ import annotations

import re
import sys

import numpy as np

from relmodel.errors import InputError
from relmodel.model.model import Finding
from relmodel.readers.step.part21_instances import Instances
from relmodel.readers.step.part21_strings import decoded

EXACT_FACES = ("ADVANCED_FACE", "FACE_SURFACE")
TRIANGULATED_FACES = ("TRIANGULATED_FACE", "COMPLEX_TRIANGULATED_FACE")

_STRING = re.compile(rb"'(?:[^']|'')*'")  # ends at a quote that is not doubled
_REFERENCE = re.compile(rb"#(\d+)")
# A word in the place of a parameter: keywords are followed by a bracket, enumerations stand between dots.
_WORD = re.compile(rb"[(,]\s*[-+]?([A-Za-z]\w*)\s*[,)]")
_NOT_A_NUMBER = re.compile(rb"[(,]\s*([-+]?(?:nan|inf|infinity))\s*[,)]", re.IGNORECASE)
_EXPONENT = re.compile(rb"[\d.][eE]\+?0*(\d{3,})")
_SCHEMA = re.compile(rb"FILE_SCHEMA\s*\(\s*\(\s*'((?:[^']|'')*)'", re.DOTALL)
_MOST_HEADER = 1 << 20
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
    found = _SCHEMA.search(instances.text, 0, _MOST_HEADER)
    return decoded(found[1]).split("{")[0].strip() if found else None


def face_count(instances: Instances) -> int:
    """Faces that the text lists: exact ones; where it has none, those that it gives as triangles.

    Faces in an instance too broken to parse count too.
    """
    return _listed(instances, EXACT_FACES) or _listed(instances, TRIANGULATED_FACES)


def _listed(instances: Instances, names: tuple[str, ...]) -> int:
    parsed = len(instances.of(*names))
    # A name that ends like another is found with it.
    found = sum(instances.text.count(n.encode()) for n in names if not any(n != o and n.endswith(o) for o in names))
    if found == parsed:
        return parsed
    pattern = re.compile(rb"\b(?:" + "|".join(names).encode() + rb")\s*\(")
    return len(pattern.findall(_STRING.sub(b"''", instances.text)))


def faces_in_use(instances: Instances) -> int:
    """How many faces some shape representation reaches; the others are left-overs that belong to no product."""
    waiting = [n for name in instances.names if name.endswith("SHAPE_REPRESENTATION") for n in instances.of(name)]
    reached = set(waiting)
    while waiting:
        fresh = set(instances.references(waiting.pop())) - reached
        reached |= fresh
        waiting.extend(fresh)
    exact, triangulated = (
        sum(number in reached for number in instances.of(*names)) for names in (EXACT_FACES, TRIANGULATED_FACES)
    )
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
    if _not_finite(text) and (found := _not_finite(_STRING.sub(b"''", text))):
        raise InputError(f"{name} has {found.decode()}, which is not a finite number: export it again")


def _not_finite(text: bytes) -> bytes | None:
    if found := _NOT_A_NUMBER.search(text):
        return found[1]
    large = (one for one in _EXPONENT.finditer(text) if int(one[1]) > sys.float_info.max_10_exp)
    return next((b"a number with the exponent " + one[1] for one in large), None)


def damage(instances: Instances) -> tuple[Finding, ...]:
    """Signs that the text has lost or altered instances; none in an intact file."""
    return tuple(Finding("damaged_text", f"the file {clause}") for clause in _damage(instances))


def _damage(instances: Instances) -> list[str]:
    clauses = []
    text, numbers = instances.text, instances.numbers
    defined = np.unique(numbers)
    if _absent(text, defined).size:
        absent = _absent(_STRING.sub(b"''", text), defined)  # a string may hold what looks like a reference
        if absent.size:
            clauses.append(f"refers to #{absent[0]}, which it does not hold")
    if len(defined) < len(numbers):
        values, counts = np.unique(numbers, return_counts=True)
        clauses.append(f"defines #{values[counts > 1][0]} more than once")
    if _WORD.search(text) and (word := _WORD.search(_STRING.sub(b"''", text))):
        clauses.append(f"has {decoded(word[1])} where a number or another parameter belongs")
    # Writers that place one use of a product by this entity place all of them by it.
    usages = len(instances.of(_USAGE))
    placed = len(instances.of("CONTEXT_DEPENDENT_SHAPE_REPRESENTATION"))
    if 0 < placed < usages:
        clauses.append(f"does not place {usages - placed} of {usages} components")
    return clauses


def _absent(
    text: bytes, defined: np.ndarray[tuple[int], np.dtype[np.int64]]
) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    """Numbers that the text refers to and does not define, increasing."""
    pointed = np.array([int(n) for n in set(_REFERENCE.findall(text)) if len(n) < 19], np.int64)
    return np.setdiff1d(pointed, defined)
