"""Names of files to be written."""

from __future__ import annotations

import os
from pathlib import Path

from relmodel.errors import InputError


def check_writable(path: Path, what: str) -> None:
    """Raise InputError where no file can be written at `path`, to be told before it is made; `what` it will be."""
    if not path.parent.is_dir():
        raise InputError(f"there is no folder {path.parent} for the {what} {path.name}: make it, or name another place")
    if path.is_dir() or not os.access(path if path.exists() else path.parent, os.W_OK):
        raise InputError(f"the {what} {path} cannot be written: check the permissions, or name another place")
