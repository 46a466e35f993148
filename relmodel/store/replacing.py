"""A DuckDB file that is made beside its place and then put there, whole and at once.

So a store is made and migrated, and so a transaction is written while others have the file open for reading: they go on
with the file that they opened.  Beside STORE lie STORE.new, which is being made; STORE.lock, held by who makes it; and
STORE.whole for a moment, where STORE has a log, which goes with it.  What a process left there that was killed, the
next one takes up or away.
"""

from __future__ import annotations

import fcntl
import os
import shutil
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from relmodel.errors import StoreError
from relmodel.store.engine import PAUSE_S, no_folder

PATIENCE_S = 60.0  # how long a file is waited for that another process writes: most hold it while they record


@contextmanager
def turn(file: Path) -> Iterator[None]:
    """Be the one who replaces a file while the block lasts; who else wants to waits.  What others left is cleared."""
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
        os.close(descriptor)  # who held it has removed it


def recover(file: Path) -> None:
    """Put a file into its place that a process made whole before it was killed."""
    if _whole(file).exists():
        with turn(file):
            pass


@contextmanager
def replacing(file: Path) -> Iterator[Path]:
    """Where to write what takes the place of a file when the block ends, in a `turn`: a copy of it where it is there.

    Meanwhile nobody writes the file, and who reads it goes on with what he has.  Raises StoreError where another
    process writes the file, or nothing can be written beside it.
    """
    new, log = _new(file), Path(f"{file}.wal")
    with ExitStack() as stack:
        with _as_store_errors(file):
            if file.exists():
                source = stack.enter_context(_locked_for_reading(file))
                _copy(source, file, new)
                if log.exists():
                    shutil.copyfile(log, f"{new}.wal")
            else:
                log.unlink(missing_ok=True)  # of a file that was there before
        try:
            yield new
            with _as_store_errors(file):
                if Path(f"{new}.wal").exists():
                    raise StoreError(f"the store {file} could not be written whole: see to the room on its disk")
                _sync(new)
                if log.exists():  # what it has is in the new file: neither may be there with the other for a moment
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
def _locked_for_reading(file: Path) -> Iterator[BinaryIO]:
    """The bytes of a file that DuckDB lets nobody write, as if one of its readers had it open."""
    given_up = time.monotonic() + PATIENCE_S
    with file.open("rb") as source:
        while True:
            try:
                fcntl.lockf(source, fcntl.LOCK_SH | fcntl.LOCK_NB)
                break
            except (BlockingIOError, PermissionError) as error:
                if time.monotonic() > given_up:
                    raise StoreError(f"the store {file} is held by another process: wait until it ends") from error
            time.sleep(PAUSE_S)
        yield source


def _copy(source: BinaryIO, file: Path, new: Path) -> None:
    """Copy by what is open of the file: to close it once more would give up the lock."""
    with new.open("wb") as copy:
        shutil.copymode(file, new)
        with suppress(PermissionError):
            os.chown(new, file.stat().st_uid, file.stat().st_gid)
        shutil.copyfileobj(source, copy, 1 << 24)


def _remove(new: Path) -> None:
    new.unlink(missing_ok=True)
    Path(f"{new}.wal").unlink(missing_ok=True)


def _sync(path: Path) -> None:
    """Bring a file or the names in a folder to disk."""
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
            or f"nothing can be written beside the store {file} ({error.strerror}): see to the permissions of its "
            "folder and the room on its disk"
        ) from error
