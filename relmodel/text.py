"""Text from files that others made, before it is shown: names may hold any character."""

from __future__ import annotations

import re

# What steers a terminal, ends a line or turns the direction of text, and halves of characters, which cannot be printed.
_CONTROLS = re.compile(r"[\x00-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff]")
_FORMULA = ("=", "+", "-", "@", "\t", "\r", "\n")


def visible(text: str, keep: str = "") -> str:
    """Text whose control characters are written as escapes (`\\x1b`), but for those to `keep`."""
    return _CONTROLS.sub(lambda hit: hit[0] if hit[0] in keep else hit[0].encode("unicode_escape").decode(), text)


def spreadsheet_text(text: str) -> str:
    """Visible text of a CSV cell, with an apostrophe before what a spreadsheet would take for a formula."""
    return ("'" if text.startswith(_FORMULA) else "") + visible(text, keep="\t\n")
