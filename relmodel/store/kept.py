"""What runs found, kept beside a DuckDB file while another process would not let go of it: STORE.kept-RUN.

It is pickled: arrays, times, and objects of this program by their class and what is in them, of a dataclass its fields
alone.  Nothing of the program is called when they are made again, nor anything that a file from elsewhere names.
"""

from __future__ import annotations

import glob
import os
import pickle
from contextlib import suppress
from dataclasses import fields, is_dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

from relmodel.identity import code_sha256

_OURS = ("relmodel", "vision")
_CALLED = {
    ("builtins", "set"),
    ("builtins", "frozenset"),
    ("builtins", "complex"),
    ("datetime", "datetime"),
    ("datetime", "timezone"),
    ("datetime", "timedelta"),
    ("numpy", "dtype"),
    ("numpy", "ndarray"),
    ("numpy._core.multiarray", "_reconstruct"),
    ("numpy._core.multiarray", "scalar"),
    ("numpy._core.numeric", "_frombuffer"),
    ("numpy.ma", "MaskedArray"),
    ("numpy.ma.core", "MaskedArray"),
    ("numpy.ma.core", "_mareconstruct"),
    (__name__, "_object"),
    (__name__, "_tuple"),
}


def kept_file(store: Path, run_id: int) -> Path:
    """Where what a run found is kept."""
    return Path(f"{store}.kept-{run_id}")


def kept_files(store: Path) -> list[Path]:
    """What is kept beside a store."""
    return sorted(store.parent.glob(f"{glob.escape(store.name)}.kept-*"))


def keep(file: Path, content: object) -> None:
    """Write data to a file; it is there as a whole or not at all."""
    new = file.with_name(f".{file.name}")
    with new.open("wb") as out:
        pickle.dump(code_sha256(), out)
        _Pickler(out, 5).dump(content)
        out.flush()
        os.fsync(out.fileno())
    new.replace(file)


def read_kept(file: Path) -> Any:
    """The data that `keep` wrote; None where that was another version of this program, whose data may mean something
    else, or the file holds anything else."""
    with file.open("rb") as source, suppress(Exception):  # pickle raises whatever it meets
        if _Unpickler(source).load() == code_sha256():
            return _Unpickler(source).load()
    return None


class _Pickler(pickle.Pickler):
    def reducer_override(self, it: object) -> Any:
        kind = type(it)
        if kind.__module__.partition(".")[0] not in _OURS:
            return NotImplemented
        if isinstance(it, tuple):
            return _tuple, (kind.__module__, kind.__name__, tuple(it))
        state = {field.name: getattr(it, field.name) for field in fields(it)} if is_dataclass(it) else vars(it)
        return _object, (kind.__module__, kind.__name__), state


class _Unpickler(pickle.Unpickler):
    def find_class(self, module: str, name: str) -> Any:
        if (module, name) not in _CALLED:
            raise pickle.UnpicklingError(f"{module}.{name} is no data")
        return super().find_class(module, name)


def _object(module: str, name: str) -> object:
    return object.__new__(_class(module, name))


def _tuple(module: str, name: str, values: tuple[Any, ...]) -> object:
    return tuple.__new__(_class(module, name), values)


def _class(module: str, name: str) -> Any:
    found = getattr(import_module(module), name) if module.partition(".")[0] in _OURS else None
    if not isinstance(found, type):
        raise pickle.UnpicklingError(f"{module}.{name} is no class of this program")
    return found
