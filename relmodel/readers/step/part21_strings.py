r"""Strings of a STEP file: the control directives of ISO 10303-21, clause 6.4.3, decoded.

\S\c is c with its eighth bit set, in the page of ISO 8859 that \PA\ .. \PI\ names (the first if none does); \X\hh one
byte of ISO 8859-1; \X2\hhhh...\X0\ and \X4\hhhhhhhh...\X0\ code points; \\ a backslash; '' an apostrophe.  What is
written plainly above ASCII is no Part 21 but common: taken as UTF-8 where it is that, else as ISO 8859-1.
"""

from __future__ import annotations

import re

_DIRECTIVE = re.compile(
    r"''|\\\\|\\P([A-I])\\|\\S\\(.)|\\X\\([0-9A-Fa-f]{2})"
    r"|\\X2\\((?:[0-9A-Fa-f]{4})+)\\X0\\|\\X4\\((?:[0-9A-Fa-f]{8})+)\\X0\\",
    re.DOTALL,
)


def decoded(written: bytes) -> str:
    """Text of a string that is given without its quotes; what is no directive stays as it is."""
    try:
        text = written.decode("utf-8")
    except UnicodeDecodeError:
        text = written.decode("latin-1")
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
