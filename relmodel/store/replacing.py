"""Replacing a DuckDB file atomically by one made under another name.

Stores are made and migrated in this way, and so is a transaction written while others read the file: readers keep the
file that they opened.  Next to STORE stand STORE.new, the file in the making; STORE.lock, locked by the process that
makes it; and briefly STORE.whole, where STORE has a log to go with it.  What a killed process left there is completed
or removed by the next one.
"""

from __future__ import annotations

import fcntl
import os
import shutil
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from relmodel.errors import InUseError, StoreError
from relmodel.store.engine import Patience, no_folder


@contextmanager
def turn(file: Path) -> Iterator[None]:
    """Have the sole right to replace a file while the block lasts; others wait.  Leftovers of killed processes are
    cleared."""
    lock = Path(f"{file}.lock")
    with _as_store_errors(file):
        descriptor = _locked(lock)
    try:
        with _as_store_errors(file):
            _remove(_new(file))
            _put(file)
        yield
    finally:
        lock.unlink(missing_ok=True)
        os.close(descriptor)


def _locked(lock: Path) -> int:
    while True:
        descriptor = os.open(lock, os.O_RDWR | os.O_CREAT, 0o666)
        fcntl.flock(descriptor, fcntl.LOCK_EX)
        with suppress(FileNotFoundError):
            if os.path.samestat(lock.stat(), os.fstat(descriptor)):
                return descriptor
        os.close(descriptor)  # the process that had locked it has removed it


def recover(file: Path) -> None:
    """Move a file into place that a process completed before it was killed."""
    if _whole(file).exists():
        with turn(file):
            pass


@contextmanager
def replacing(file: Path) -> Iterator[Path]:
    """Path of the file that replaces `file` when the block ends, in a `turn`: a copy where it exists.

    Meanwhile nobody writes the file, and readers keep what they opened.  Raises StoreError where another process writes
    the file, or its folder cannot be written.
    """
    new, log = _new(file), Path(f"{file}.wal")
    with ExitStack() as stack:
        with _as_store_errors(file):
            if file.exists():
                source = stack.enter_context(locked_for_reading(file))
                _copy(source, file, new)
                if log.exists():
                    shutil.copyfile(log, f"{new}.wal")
            else:
                log.unlink(missing_ok=True)  # of a file that was there before
        try:
            yield new
            with _as_store_errors(file):
                if Path(f"{new}.wal").exists():
                    raise StoreError(f"the store {file} could not be written whole: free space on its disk")
                _sync(new)
                if log.exists():  # its content is in the new file: the two must never exist together
                    new.replace(_whole(file))
                    _sync(file.parent)
                    _put(file)
                else:
                    new.replace(file)
                _sync(file.parent)
        except BaseException:
            with suppress(OSError):
                _remove(new)
            raise


def _new(file: Path) -> Path:
    return Path(f"{file}.new")


def _whole(file: Path) -> Path:
    return Path(f"{file}.whole")


def _put(file: Path) -> None:
    whole = _whole(file)
    if whole.exists():
        Path(f"{file}.wal").unlink(missing_ok=True)
        whole.replace(file)


@contextmanager
def locked_for_reading(file: Path) -> Iterator[BinaryIO]:
    """The bytes of a file that DuckDB lets nobody write, as if one of its readers had it open."""
    patience = Patience()
    with file.open("rb") as source:
        while True:
            try:
                fcntl.lockf(source, fcntl.LOCK_SH | fcntl.LOCK_NB)
                break
            except (BlockingIOError, PermissionError) as error:
                if not patience.wait(file):
                    raise InUseError(f"the store {file} is in use by another process: wait until it ends") from error
        yield source


def _copy(source: BinaryIO, file: Path, new: Path) -> None:
    """Copy through the open descriptor: closing another one would release the lock."""
    with new.open("wb") as copy:
        shutil.copymode(file, new)
        with suppress(PermissionError):
            os.chown(new, file.stat().st_uid, file.stat().st_gid)
        shutil.copyfileobj(source, copy, 1 << 24)


def _remove(new: Path) -> None:
    new.unlink(missing_ok=True)
    Path(f"{new}.wal").unlink(missing_ok=True)


def _sync(path: Path) -> None:
    """Sync a file, or the names in a folder, to disk."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


@contextmanager
def _as_store_errors(file: Path) -> Iterator[None]:
    """What the system refuses, as a sentence."""
    try:
        yield
    except OSError as error:
        raise StoreError(
            no_folder(file)
            or f"the folder of the store {file} cannot be written ({error.strerror}): check the permissions of its "
            "folder and the free space on its disk"
        ) from error
