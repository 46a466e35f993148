"""Names that people and files give: text made fit to show, and paths checked before work begins."""

from __future__ import annotations

import csv
import json
import os
import re
import stat
from collections.abc import Iterable, Iterator
from difflib import SequenceMatcher
from pathlib import Path
from typing import Any

from relmodel.errors import InputError

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
    Of those alike the ones in the same place count before others, then the nearest number."""
    place, word, number = _parts_of(name)
    alike: dict[str, float] = {}
    found = []
    for other in names:
        its_place, its_word, its_number = _parts_of(other)
        if its_word not in alike:  # one that is a word of the other is very like it
            within = any(len(a) > 2 and a in b.split("_") for a, b in ((word, its_word), (its_word, word)))
            alike[its_word] = 0.9 if within else SequenceMatcher(None, word, its_word).ratio()
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


# Files that people name: checked for reading and writing beforehand.

MOST_BYTES = 2 << 30  # more than any reader takes
MOST_TEXT_BYTES = 64 << 20
MOST_NAME_BYTES = 255  # of a file, and of an object or world, which databases index


def check_readable(path: Path, what: str = "file", most_bytes: int = MOST_BYTES) -> None:
    """Raise InputError unless a regular file `what` of at most `most_bytes` is at `path`: a pipe may never end."""
    try:
        found = path.stat()
    except (FileNotFoundError, NotADirectoryError, ValueError):
        raise InputError(f"there is no {what} {path}: check its name") from None
    except OSError as error:
        raise _unreadable(path, what, error) from error
    if not stat.S_ISREG(found.st_mode):
        raise InputError(f"the {what} {path} is not a regular file: name one that is")
    if found.st_size > most_bytes:
        raise InputError(f"the {what} {path} is larger than {most_bytes >> 20} MB: split it, or name another")


def read_bytes(path: Path, what: str, most_bytes: int = MOST_TEXT_BYTES) -> bytes:
    """What stands in the `what` at `path`.  Raises InputError as `check_readable`, and where it cannot be read."""
    check_readable(path, what, most_bytes)
    try:
        return path.read_bytes()
    except OSError as error:
        raise _unreadable(path, what, error) from error


def read_text(path: Path, what: str, most_bytes: int = MOST_TEXT_BYTES) -> str:
    """The text in the `what` at `path`, without a byte order mark.  InputError as `read_bytes`, and where not text."""
    try:
        return read_bytes(path, what, most_bytes).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(f"the {what} {path} is not text in UTF-8: save it as UTF-8") from error


def json_mapping(text: str) -> dict[str, Any] | None:
    """What a file says that is JSON, a subset of YAML that is read a hundred times faster; None for anything else."""

    def unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        if len(dict(pairs)) < len(pairs):
            raise ValueError("a key stands twice: left to YAML's reader")
        return dict(pairs)

    try:
        data = json.loads(text, object_pairs_hook=unique) if text.startswith("{") else None
    except ValueError:
        return None
    return data if isinstance(data, dict) else None


def read_csv(path: Path, what: str) -> Iterator[tuple[str, list[str]]]:
    """Rows of a spreadsheet's table, the names of its columns first, each with `FILE, line N`; but empty ones and those
    that begin with #.  Raises InputError as `read_text`, and where a row is no CSV or longer than the first."""
    lines, width = read_text(path, what).splitlines(keepends=True), 0
    rows = csv.reader(lines, delimiter=max(",;\t", key="".join(lines[:1]).count), strict=True)
    try:
        for row in rows:
            cells, place = [cell.strip() for cell in row], f"{path}, line {rows.line_num}"
            if width and (not any(cells) or cells[0].startswith("#")):
                continue
            if width and len(cells) > width:
                raise InputError(f"{place}: {len(cells)} cells under {width} columns: quote cells that hold commas")
            width = width or len(cells)
            yield place, cells
    except csv.Error as error:
        raise InputError(f"{path}, line {rows.line_num}: this is no CSV ({error}): see to its quotes") from error


def _unreadable(path: Path, what: str, error: OSError) -> InputError:
    return InputError(f"the {what} {path} cannot be read ({error.strerror}): check its name and permissions")


def check_writable(path: Path, what: str) -> None:
    """Raise InputError where no file can be written at `path`, before `what` it will hold is computed."""
    if not path.parent.is_dir():
        raise InputError(f"there is no folder {path.parent} for the {what} {path.name}: make it, or name another place")
    if path.is_dir() or not os.access(path if path.exists() else path.parent, os.W_OK):
        raise InputError(f"the {what} {path} cannot be written: check the permissions, or name another place")


def make_folder(folder: str | Path) -> None:
    """Make a folder that is not there yet.  Raises InputError where it cannot be made."""
    try:
        Path(folder).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"the folder {folder} cannot be made ({error.strerror}): name another place") from error
