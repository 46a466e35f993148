"""The program itself: where its SQL and demonstration lie, which code runs, and who runs it."""

from __future__ import annotations

import getpass
from functools import cache
from hashlib import sha256
from pathlib import Path

_PACKAGE = Path(__file__).parent
_WHEEL_DATA = _PACKAGE / "data"


def resource_dir(name: str) -> Path:
    """Folder `schema`, `queries`, `migrations` or `demo` of this installation."""
    if _WHEEL_DATA.is_dir():
        return _WHEEL_DATA / name
    checkout = _PACKAGE.parent
    return checkout / "examples" / "demo" if name == "demo" else checkout / name


_PACKAGES = Path(__file__).parents[1]
_ROOTS = (("relmodel", "*.py"), ("vision", "*.py"), ("schema", "*.*"), ("queries", "*.sql"))


@cache
def code_sha256() -> str:
    """SHA-256 (hexadecimal) of the program: its Python files and the SQL of `schema` and `queries`, by name and content
    in the order of names; equal for equal code, in a checkout or installed."""
    digest = sha256()
    for name, kind in _ROOTS:
        root = _PACKAGES / name if kind == "*.py" else resource_dir(name)
        files = {file.relative_to(root).as_posix(): file for file in root.rglob(kind)}
        for inside in sorted(file for file in files if not file.startswith("data/")):  # of an installation
            content = files[inside].read_bytes()
            digest.update(f"{name}/{inside} {len(content)}\n".encode() + content)
    return digest.hexdigest()


@cache
def code_commit() -> str | None:
    """The git commit that the checkout of this code stands at; None where it is installed, or the checkout is not to be
    read.  Files may differ from it: `code_sha256` tells."""
    place = _PACKAGES / ".git"
    try:
        if place.is_file():  # of a linked worktree
            place = _PACKAGES / place.read_text().removeprefix("gitdir:").strip()
        head = (place / "HEAD").read_text().strip()
        if not head.startswith("ref:"):
            return head
        common = place / "commondir"
        shared = place / common.read_text().strip() if common.is_file() else place
        reference = head.removeprefix("ref:").strip()
        if (shared / reference).is_file():
            return (shared / reference).read_text().strip()
        packed = (line.split() for line in (shared / "packed-refs").read_text().splitlines() if line[:1] not in "#^")
        return next((commit for commit, name in packed if name == reference), None)
    except OSError:
        return None


def user_name() -> str | None:
    """The name of the user of this process; None where it has none, as in some containers."""
    try:
        return getpass.getuser()
    except (KeyError, OSError):
        return None
