"""Text from files that others made, before it is shown: names may hold any character."""

from __future__ import annotations

import re
from collections.abc import Iterable
from difflib import SequenceMatcher

# What steers a terminal, ends a line or turns the direction of text, and halves of characters, which cannot be printed.
_CONTROLS = re.compile(r"[\x00-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff]")
_NUMBERED = re.compile(r"(.*?)[ _]*(\d{0,9})", re.DOTALL)
_LIKE = 0.6  # how like two words are, from 0 to 1, of which one may be a slip of the other
_FORMULA = ("=", "+", "-", "@", "\t", "\r", "\n")


def visible(text: str, keep: str = "") -> str:
    """Text whose control characters are written as escapes (`\\x1b`), but for those to `keep`."""
    return _CONTROLS.sub(lambda hit: hit[0] if hit[0] in keep else hit[0].encode("unicode_escape").decode(), text)


def spreadsheet_text(text: str) -> str:
    """Visible text of a CSV cell, with an apostrophe before what a spreadsheet would take for a formula."""
    return ("'" if text.startswith(_FORMULA) else "") + visible(text, keep="\t\n")


def nearest_name(name: str, names: Iterable[str]) -> str | None:
    """Which of some names or paths may have been meant; None where no word is like it.

    The word after the last slash decides, without its number: hole 1 is rather through_hole 1 or hole 2 than web 1.
    Of those alike the ones in the same place count before others, then the nearest number.
    """
    place, word, number = _parts_of(name)
    alike: dict[str, float] = {}
    found = []
    for other in names:
        its_place, its_word, its_number = _parts_of(other)
        if its_word not in alike:
            alike[its_word] = _likeness(word, its_word)
        if alike[its_word] >= _LIKE:
            there = 1.0 if place == its_place else SequenceMatcher(None, place, its_place).ratio()
            found.append((-alike[its_word] - there, abs(number - its_number), other))
    return min(found)[-1] if found else None


def _parts_of(path: str) -> tuple[str, str, int]:
    """What stands before the last slash, the word after it, and the number at the end of that, -1 without."""
    place, _, name = path.rpartition("/")
    hit = _NUMBERED.fullmatch(name.lower())
    assert hit
    return place.lower(), hit[1], int(hit[2] or -1)


def _likeness(a: str, b: str) -> float:
    """How like two words are, from 0 to 1; one that is a word of the other is very like it."""
    if (len(a) > 2 and a in b.split("_")) or (len(b) > 2 and b in a.split("_")):
        return 0.9
    return SequenceMatcher(None, a, b).ratio()
