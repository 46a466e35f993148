r"""Strings of a STEP file: the control directives of ISO 10303-21, clause 6.4.3, and text in other encodings, decoded.

\S\c is c with its eighth bit set, in the page of ISO 8859 that \PA\ .. \PI\ names (the first if none does); \X\hh one
byte of ISO 8859-1; \X2\hhhh...\X0\ and \X4\hhhhhhhh...\X0\ code points; \\ a backslash; '' an apostrophe; line breaks
count for nothing.  What is written plainly above ASCII is no Part 21 but common: UTF-8, GB18030 or Windows-1252 (of
which ISO 8859-1 is a part), told apart by what the texts of a file look like.  Other codes of two bytes cannot be told
from Chinese where they use its frequent characters.
"""

from __future__ import annotations

import re
from collections.abc import Iterable

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

    Two bytes between Latin letters, or nothing but umlauts, count for none: they are as well Western (GRÖßE).
    """
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
