"""Named queries as pages: what is asked in words, with a form of the parameters.

A literal of an example question that a comment names is a parameter, the literal its default.

    WHERE value > 40 /* depth */

stays SQL that any client runs; here it asks for `depth`."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from sqlalchemy import Connection, TextClause, text

from relmodel.errors import UsageError
from relmodel.store import sql

Row = Mapping[str, Any]
_FOLDER = "examples"
_NAMED = re.compile(r"('(?:[^']|'')*'|(?<![\w.])-?\d+(?:\.\d+)?) /\* (\w+) \*/")
Value = str | int | float


@dataclass(frozen=True)
class Question:
    """A named query as a page: its name, what it asks, its SQL with parameters bound, their defaults and choices, and
    of each row where it leads and where its picture is."""

    name: str
    words: str
    query: TextClause
    defaults: Mapping[str, Value] = field(default_factory=dict)
    choices: Mapping[str, Sequence[str]] = field(default_factory=dict)
    link: Callable[[Row], str] | None = None
    picture: Callable[[Row], str] | None = None
    written: str = ""

    def said(self, values: Mapping[str, Value]) -> str:
        """What it asks in words, with these values in the place of those that are written there."""
        literals = {str(value): str(values[n]) for n, value in written_defaults(self.written).items()}
        found = "|".join(map(re.escape, sorted(literals, key=len, reverse=True)))
        return re.sub(rf"(?<!\w)({found})(?!\w)", lambda hit: literals[hit[0]], self.words) if found else self.words

    def stated(self, values: Mapping[str, Value]) -> str:
        """Its SQL with these values in the place of those that are written there."""

        def literal(value: Value) -> str:
            return "'" + value.replace("'", "''") + "'" if isinstance(value, str) else str(value)

        return _NAMED.sub(lambda hit: f"{literal(values[hit[2]])} /* {hit[2]} */", self.written)

    def values(self, given: Mapping[str, str]) -> dict[str, Value]:
        """The parameters, as given where they are.  Raises UsageError for a number that is none."""
        values = dict(self.defaults)
        for name in values.keys() & given.keys():
            said, default = given[name], self.defaults[name]
            values[name] = said if isinstance(default, str) else finite(name, said)
            if isinstance(default, int) and values[name] == int(values[name]):
                values[name] = int(values[name])  # other whole numbers, or what is none
        return values


def question_names() -> list[str]:
    """The example questions that there are."""
    return [name.partition("/")[2] for name in sql.query_names(_FOLDER)]


def at_hand(connection: Connection, asked: Mapping[str, str]) -> dict[str, Value]:
    """Of the object that is asked about, or is at hand, the parameters of questions that its rows give."""
    about = {name: asked.get(name, "") for name in ("object", "variant")}
    found = connection.execute(sql.query("serve/at_hand"), about).first()
    return {name: value for name, value in found._mapping.items() if value is not None} if found else {}


def about(question: Question, hand: Mapping[str, Value]) -> Question:
    """A question with the parameters of what is at hand as defaults."""
    return replace(question, defaults={name: hand.get(name, value) for name, value in question.defaults.items()})


def group_of(question: Question) -> str:
    """What a question is about."""
    if not {"object", "world", "material"}.isdisjoint(question.defaults):
        return "About what is modelled"
    return "About the newest inspection" if "newest inspection" in question.words else "About the cell"


def read_question(name: str) -> Question:
    """The question of a name.  Raises UsageError where there is none."""
    if name not in question_names():
        raise UsageError(f"there is no question {name!r}")
    written = sql.query(f"{_FOLDER}/{name}").text
    bound = _NAMED.sub(lambda hit: f":{hit[2]}", written)
    return Question(name, first_line(written), text(bound), written_defaults(written), written=written)


def written_defaults(written: str) -> dict[str, Value]:
    """The literals of a question that comments name.  Raises ValueError where a name has two."""
    defaults: dict[str, Value] = {}
    for literal, parameter in _NAMED.findall(written):
        value = _value(literal)
        if defaults.setdefault(parameter, value) != value:
            raise ValueError(f"{first_line(written)} gives {parameter} two values")
    return defaults


def first_line(written: str) -> str:
    """The question that a file begins with, in words."""
    return written.partition("\n")[0].removeprefix("--").strip()


def _value(literal: str) -> Value:
    if literal.startswith("'"):
        return literal[1:-1].replace("''", "'")
    return float(literal) if "." in literal else int(literal)


def finite(name: str, said: str) -> float:
    """The number that a text spells.  Raises UsageError where it is not finite."""
    try:
        number = float(said)
    except ValueError:
        number = float("nan")
    if not abs(number) < 1e300:
        raise UsageError(f"{name} is {said!r}: give a number")
    return number
