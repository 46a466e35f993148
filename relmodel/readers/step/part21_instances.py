"""Instances of a STEP file's text (ISO 10303-21), parsed when they are asked for.

For what the CAD kernel does not hand on: tolerances, materials and units as the file states them, tessellations.
"""

from __future__ import annotations

import re
from array import array
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from relmodel.readers.step.part21_strings import decoded

# Strings may hold semicolons, hashes and what looks like comments.
_INSTANCE = re.compile(rb"#(\d+)\s*=\s*(\(|[A-Za-z_][A-Za-z0-9_]*)((?:[^;']++|'[^']*+')*+);")
_REFERENCE = re.compile(rb"#(\d+)")
_COMMENT = re.compile(rb"('[^']*+')|/\*.*?\*/", re.DOTALL)
_TOKEN = re.compile(
    rb"\s*(?:'((?:[^']|'')*)'|#(\d+)|([-+]?\d+\.\d*(?:[eE][-+]?\d+)?)|([-+]?\d+)"
    rb"|(\.[A-Za-z0-9_]+\.)|([A-Za-z_][A-Za-z0-9_]*)|\"[0-9A-Fa-f]*\"|([(),$*]))"
)


class Reference(int):
    """Number of the instance that a parameter points to."""


@dataclass(frozen=True)
class Typed:
    """A value with its type, such as LENGTH_MEASURE(3.)."""

    name: str
    value: Any


Record = dict[str, list[Any]]  # entity name -> parameters; of a complex instance one entry a partial entity


class Instances:
    """Instances of the data section by number.

    Parameters are str (an enumeration with its dots), float, int, Reference, Typed, list, or None for $ and *.
    """

    def __init__(self, text: bytes) -> None:
        if b"/*" in text:
            text = _COMMENT.sub(lambda one: one[1] or b" ", text)
        # Most instances are points and directions that are never asked for, so only their places in the text are kept.
        self.text = text  # without comments
        self._parsed: dict[int, Record] = {}
        self._named: dict[str, array[int]] = {}
        numbers, starts, ends = array("q"), array("q"), array("q")
        named: dict[bytes, array[int]] = {}
        for one in _INSTANCE.finditer(text, max(text.find(b"DATA;"), 0)):
            number, name = int(one[1]), one[2]
            numbers.append(number)
            starts.append(one.start(2))
            ends.append(one.end(3))
            if name == b"(":
                for partial in _record(one[2] + one[3]):
                    self._named.setdefault(partial, array("q")).append(number)
            elif name in named:
                named[name].append(number)
            else:
                named[name] = self._named.setdefault(name.decode().upper(), array("q"))
                named[name].append(number)
        self.numbers = found = np.array(numbers, np.int64)  # as they come; one may stand twice
        self._order = np.argsort(found, kind="stable")
        self._numbers = found[self._order]
        self._starts, self._ends = np.array(starts, np.int64), np.array(ends, np.int64)

    def __len__(self) -> int:
        return len(self._numbers)

    @property
    def names(self) -> list[str]:
        """Entities that the file has instances of."""
        return sorted(self._named)

    def of(self, *names: str) -> list[int]:
        """Numbers of the instances that are, or of a complex instance have, one of the entities; in rising order."""
        return sorted({number for name in names for number in self._named.get(name, ())})

    def ordinal(self, number: int) -> int | None:
        """Place of an instance in the file, from 0; of several with one number that of the last."""
        at = int(np.searchsorted(self._numbers, number, side="right")) - 1
        return int(self._order[at]) if at >= 0 and self._numbers[at] == number else None

    def __contains__(self, number: int) -> bool:
        return self.ordinal(number) is not None

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

    def parameters(self, number: int, name: str) -> list[Any]:
        """Parameters of one of an instance's entities; empty where it has none of that name."""
        return self[number].get(name, [])


def references(value: Any) -> Iterator[Reference]:
    """All references in a parameter, lists and typed values gone through."""
    if isinstance(value, Reference):
        yield value
    elif isinstance(value, list):
        for one in value:
            yield from references(one)
    elif isinstance(value, Typed):
        yield from references(value.value)


def two(parameters: list[Any]) -> tuple[Reference | None, Reference | None]:
    """The first two parameters, None where they are no references."""
    a, b = (p if isinstance(p, Reference) else None for p in (*parameters, None, None)[:2])
    return a, b


def _record(raw: bytes) -> Record:
    values = _values(raw)
    if len(values) == 1 and isinstance(values[0], list):  # complex: (A(...)B(...))
        values = values[0]
    return {one.name: one.value for one in values if isinstance(one, Typed) and isinstance(one.value, list)} | {
        one.name: [one.value] for one in values if isinstance(one, Typed) and not isinstance(one.value, list)
    }


def _values(raw: bytes) -> list[Any]:
    """Values of a text in the syntax of parameters; what is broken ends it."""
    stack: list[list[Any]] = [[]]
    names: list[str | None] = []
    pending: str | None = None
    place = 0
    while found := _TOKEN.match(raw, place):
        place = found.end()
        text, number, real, whole, enumeration, name, mark = found.groups()
        if mark == b"(":
            names.append(pending)
            pending = None
            stack.append([])
        elif mark == b")":
            if not names:
                break
            inner, keyword = stack.pop(), names.pop()
            stack[-1].append(inner if keyword is None else Typed(keyword, inner))
        elif name is not None:
            pending = name.decode().upper()
        elif mark != b",":
            stack[-1].append(_scalar(text, number, real, whole, enumeration))
    return stack[0]


def _scalar(
    text: bytes | None, number: bytes | None, real: bytes | None, whole: bytes | None, enumeration: bytes | None
) -> Any:
    if text is not None:
        return decoded(text)
    if number is not None:
        return Reference(number)
    if real is not None:
        return float(real)
    if whole is not None:
        return int(whole)
    return enumeration.decode() if enumeration is not None else None
