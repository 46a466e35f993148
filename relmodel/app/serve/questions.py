"""The example questions as forms: a literal of theirs that a comment names is a parameter, the literal its default.

    WHERE abs(s.radius - 21 /* radius */) < 1e-3

stays SQL that any client runs; here it asks for `radius`.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

from sqlalchemy import TextClause, text

from relmodel.errors import UsageError
from relmodel.store import sql

_FOLDER = "examples"
_NAMED = re.compile(r"('(?:[^']|'')*'|(?<![\w.])-?\d+(?:\.\d+)?) /\* (\w+) \*/")

Value = str | int | float


@dataclass(frozen=True)
class Question:
    """A question: its name, what it asks, its SQL with parameters bound, and their defaults."""

    name: str
    words: str
    query: TextClause
    defaults: Mapping[str, Value]

    def values(self, given: Mapping[str, str]) -> dict[str, Value]:
        """The parameters, as given where they are.  Raises UsageError for an unknown name, or a number that is none."""
        unknown = sorted(set(given) - set(self.defaults))
        if unknown:
            raise UsageError(
                f"the question {self.name} takes no {unknown[0]}: it takes {', '.join(self.defaults) or 'nothing'}"
            )
        return dict(self.defaults) | {name: _as(self.defaults[name], name, said) for name, said in given.items()}


def question_names() -> list[str]:
    return [name.partition("/")[2] for name in sql.query_names(_FOLDER)]


def read_question(name: str) -> Question:
    """The question of a name.  Raises UsageError where there is none."""
    if name not in question_names():
        raise UsageError(f"there is no question {name!r}")
    written = sql.query(f"{_FOLDER}/{name}").text
    defaults: dict[str, Value] = {}
    for literal, parameter in _NAMED.findall(written):
        value = _value(literal)
        if defaults.setdefault(parameter, value) != value:
            raise ValueError(f"queries/{_FOLDER}/{name}.sql gives {parameter} two values")
    bound = _NAMED.sub(lambda hit: f":{hit[2]}", written)
    return Question(name, first_line(written), text(bound), defaults)


def first_line(written: str) -> str:
    """The question that a file begins with, in words."""
    return written.partition("\n")[0].removeprefix("--").strip()


def _value(literal: str) -> Value:
    if literal.startswith("'"):
        return literal[1:-1].replace("''", "'")
    return float(literal) if "." in literal else int(literal)


def _as(default: Value, name: str, said: str) -> Value:
    """What was said, of the default's type; whole numbers may become others."""
    if isinstance(default, str):
        return said
    number = finite(name, said)
    return int(number) if isinstance(default, int) and number == int(number) else number


def finite(name: str, said: str) -> float:
    """The number that a text spells.  Raises UsageError where it is not finite."""
    try:
        number = float(said)
    except ValueError:
        number = float("nan")
    if not abs(number) < 1e300:
        raise UsageError(f"{name} is {said!r}: give a number")
    return number
