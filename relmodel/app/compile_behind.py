"""The kernels of inspections, compiled by a process of its own while a model loads: the first inspection finds them."""

from __future__ import annotations

import hashlib
import os
import sys
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from subprocess import DEVNULL, Popen

import relmodel

_WORK = (
    "import os; os.nice(5); from relmodel.compiled import compile_ahead; from vision.inspection import KERNELS; "
    "compile_ahead(KERNELS, lambda words: None)"
)


def compile_behind(say: Callable[[str], None]) -> None:
    """Start compiling, once for each installation, and say so; it goes on when this process ends.

    To know whether it was started before costs no import of numba.  `compile_ahead` waits for it.
    """
    with suppress(OSError, RuntimeError):  # where nothing can be kept there is no use in it
        base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "relmodel"
        asked = Path(os.environ.get("NUMBA_CACHE_DIR") or base) / f"asked-{_installation()}"
        if asked.exists():
            return
        asked.parent.mkdir(parents=True, exist_ok=True)
        asked.touch()
        say("compiling the kernels of inspections in the background, once for this version ...")
        command = [sys.executable, "-c", _WORK]
        Popen(command, stdin=DEVNULL, stdout=DEVNULL, stderr=DEVNULL, start_new_session=True)


def _installation() -> str:
    """What changes whenever other kernels are installed: names, sizes and times of their files."""
    top = Path(relmodel.__file__).parent.parent
    files = sorted(file for package in ("relmodel", "vision") for file in (top / package).rglob("*kernels.py"))
    stats = [(os.fspath(file), os.stat(file)) for file in files]
    stated = repr((sys.executable, [(name, it.st_size, it.st_mtime_ns) for name, it in stats]))
    return hashlib.sha256(stated.encode()).hexdigest()[:16]
