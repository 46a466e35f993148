"""Files that people name: checked for reading and writing beforehand."""

from __future__ import annotations

import os
import stat
from pathlib import Path

from relmodel.errors import InputError

MOST_BYTES = 2 << 30  # more than any reader takes
MOST_TEXT_BYTES = 64 << 20
MOST_NAME_BYTES = 255  # of a file, and of an object or world, which databases index


def check_readable(path: Path, what: str = "file", most_bytes: int = MOST_BYTES) -> None:
    """Raise InputError where there is no `what` at `path`, or a folder, or a device or pipe, which may never end, or
    where it is larger than `most_bytes`."""
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
    """The text in the `what` at `path`, without a byte order mark.  Raises InputError as `read_bytes`, and where it is
    not text."""
    try:
        return read_bytes(path, what, most_bytes).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(f"the {what} {path} is not text in UTF-8: save it as UTF-8") from error


def _unreadable(path: Path, what: str, error: OSError) -> InputError:
    return InputError(f"the {what} {path} cannot be read ({error.strerror}): check its name and permissions")


def check_writable(path: Path, what: str) -> None:
    """Raise InputError where no file can be written at `path`, before `what` it will hold is computed."""
    if not path.parent.is_dir():
        raise InputError(f"there is no folder {path.parent} for the {what} {path.name}: make it, or name another place")
    if path.is_dir() or not os.access(path if path.exists() else path.parent, os.W_OK):
        raise InputError(f"the {what} {path} cannot be written: check the permissions, or name another place")
