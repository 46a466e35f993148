"""Runs: every execution that writes leaves a row that says what it was given, what happened and how it ended."""

from __future__ import annotations

import hashlib
import json
import logging
import math
import os
import platform
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, ExitStack, contextmanager, suppress
from datetime import UTC, datetime
from functools import cache, partial
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, TypeVar

import numpy as np

import relmodel
from relmodel.arrays import Ints
from relmodel.blas import one_blas_thread
from relmodel.columns import Columns
from relmodel.errors import InputError, InUseError, StoreError, UsageError
from relmodel.identity import code_commit, code_sha256
from relmodel.paths import check_readable
from relmodel.store import bulk, journal, sql
from relmodel.store.alive import LivenessLock
from relmodel.store.kept import keep, kept_file, kept_files, read_kept

if TYPE_CHECKING:
    from sqlalchemy import Connection

    from relmodel.store.database import Database

T = TypeVar("T")
_LOG = logging.getLogger("relmodel")


def package_versions(*names: str) -> dict[str, str]:
    """Versions of relmodel and of the installed packages among `names`."""
    found = {"relmodel": relmodel.__version__, "python": platform.python_version()}
    installed = {name: _installed_version(name) for name in names}
    return found | {name: version for name, version in installed.items() if version is not None}


@cache
def _installed_version(name: str) -> str | None:
    """Version of an installed package; asked once, for it reads files."""
    try:
        return version(name)
    except PackageNotFoundError:
        return None


def digest_inputs(paths: Mapping[str, str | Path]) -> dict[str, tuple[str, str]]:
    """Inputs of a run, role -> (file name, SHA-256), of the files by role that can be read."""
    found = {}
    for role, path in ((role, Path(path)) for role, path in paths.items()):
        with suppress(InputError, OSError):
            check_readable(path)
            with path.open("rb") as file:
                found[role] = (path.name, hashlib.file_digest(file, "sha256").hexdigest())
    return found


def _plain(value: object) -> object:
    """A parameter in what JSON has: numbers that are not finite as text."""
    if isinstance(value, Mapping):
        return {str(name): _plain(inner) for name, inner in value.items()}
    if isinstance(value, np.ndarray):
        return _plain(value.tolist())
    if isinstance(value, list | tuple):
        return [_plain(inner) for inner in value]
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    return value if value is None or isinstance(value, str | int | float | bool) else str(value)


class _Step(NamedTuple):
    name: str
    seconds: float
    ended_at: datetime


class _Count(NamedTuple):
    """What a run has recorded so far: how many events and inputs, whether it ended, when its step began, the steps
    before it, and how many of these are written."""

    events: int
    inputs: int
    ended: bool
    step_began: float
    steps: tuple[_Step, ...]
    written: int


def cause_of(error: BaseException) -> str:
    """What made a run fail: its input, where that was refused, else an error."""
    return "input" if isinstance(error, InputError | UsageError) else "error"


class Recordable(Protocol):
    """What a run found, a dataclass of data."""

    def record(self, run: Run, connection: Connection, /) -> None:
        """Append it and end the run."""


class _Kept(NamedTuple):
    """What a run found, and how far it was: how long it and its step, `so_far.step_began`, had taken."""

    run_id: int
    kind: str
    writes: int
    seconds: float
    so_far: _Count
    found: Recordable


def record_kept(store: Database) -> None:
    """Record what runs found while the store was not to be had; what another version of relmodel kept is left alone."""
    for file in [] if store.file is None else kept_files(store.file):
        kept = read_kept(file)
        if kept is None:
            _LOG.warning("%s is not recorded: open the store with the version of relmodel that kept it", file)
            continue
        run, now = Run(store, kept.run_id, kept.kind), time.perf_counter()
        run._writes, run._began = kept.writes, now - kept.seconds
        run._count = kept.so_far._replace(step_began=now - kept.so_far.step_began)
        try:
            with run.write() as connection:
                due = [(row.run_id, row.event_no) for row in store.rows(connection, "run/unfinished.duckdb")]
                if (run.id, kept.so_far.events) not in due:
                    raise _NotDueError
                kept.found.record(run, connection)
        except _NotDueError:  # another process has just recorded it, or an older copy of the store was put back
            pass
        except Exception as error:
            if isinstance(error, StoreError):
                raise
            run.fail(f"what was kept of it cannot be recorded: {error}")
        finally:
            run._liveness.release()
        file.unlink(missing_ok=True)


class _NotDueError(Exception):
    """A run that is to be recorded is not there unfinished."""


class Run:
    """A run that is under way.  Its row and its begun event are committed at once; what it finds is appended in
    transactions of its own, together with the ledger of the rows; `finish` says that it did what it was asked.

        with Run.begin(store, "load", parameters, packages=("duckdb",)) as run:
            found = read(file)
            run.step("read")
            run.transact(lambda connection: run.append(connection, "surface", columns))

    An error that leaves the block ends the run as failed.  is_rehearsal: whether what the store has of it is made
    again, and nothing written.
    """

    is_rehearsal = False

    def __init__(self, store: Database, run_id: int, kind: str) -> None:
        self.store = store
        self.id = run_id
        self.kind = kind
        self._liveness = LivenessLock(store, run_id)
        self._writes = 0
        self._began = time.perf_counter()
        self._count = _Count(0, 0, False, self._began, (), 0)

    @classmethod
    @contextmanager
    def begin(
        cls,
        store: Database,
        kind: str,
        parameters: Mapping[str, Any],
        *,
        inputs: Mapping[str, tuple[str, str]] | None = None,
        packages: tuple[str, ...] = (),
    ) -> Iterator[Run]:
        """Begin a run of `kind`; `inputs` maps a role to (file name, SHA-256) of what it reads."""
        record_kept(store)
        run = store.patiently(lambda: cls._begun(store, kind, parameters, inputs or {}, packages))
        try:
            try:
                journal.record(store, "run_event", run.id, 0)
                run._tell("")
                with one_blas_thread():
                    yield run
            except BaseException as error:
                # what the store could not be had for is waited for once more
                if not run._count.ended and not isinstance(error, InUseError):
                    said = "interrupted" if isinstance(error, KeyboardInterrupt) else str(error)
                    run.fail(said or type(error).__name__, cause=cause_of(error))
                raise
            if not run._count.ended:
                run.finish()
        finally:
            run._liveness.release()

    @classmethod
    def _begun(
        cls,
        store: Database,
        kind: str,
        parameters: Mapping[str, Any],
        inputs: Mapping[str, tuple[str, str]],
        packages: tuple[str, ...],
    ) -> Run:
        with ExitStack() as failed, store.write() as connection:
            run = cls(store, int(store.new_ids(connection, "run", 1)[0]), kind)
            failed.callback(run._liveness.release)
            run._liveness.hold()
            store.append(
                connection,
                "run",
                {
                    "id": [run.id],
                    "kind": [kind],
                    "parameters": [json.dumps(_plain(parameters), sort_keys=True)],
                    "versions": [json.dumps(package_versions(*packages), sort_keys=True)],
                    "code_commit": [code_commit()],
                    "code_sha256": [code_sha256()],
                    "schema_revision": [sql.revisions()[-1]],
                    "host": [platform.node()],
                    "process": [os.getpid()],
                    "began_at": [datetime.now(UTC)],
                },
            )
            run.inputs(connection, dict(sorted(inputs.items())))
            run._append_events(connection, ["begun"])
            failed.pop_all()
        return run

    def inputs(self, connection: Connection, inputs: Mapping[str, tuple[str, str]]) -> None:
        """Append inputs that become known during the run: role -> (file name, SHA-256)."""
        first = self._count.inputs
        self._count = self._count._replace(inputs=first + len(inputs))
        self.store.append(
            connection,
            "run_input",
            {
                "run_id": [self.id] * len(inputs),
                "input_no": list(range(first, first + len(inputs))),
                "role": list(inputs),
                "name": [Path(name).name for name, _ in inputs.values()],
                "sha256": [digest for _, digest in inputs.values()],
            },
        )

    @contextmanager
    def write(self) -> Iterator[Connection]:
        """A transaction of this run; the ledger of what the store appends in it is committed with it.

        Transactions of several processes are serialised: what one finds missing and appends, no other appends
        meanwhile.
        """
        with self._transaction() as connection:
            if self.store.dialect == "postgresql":  # on DuckDB one process writes
                self.store.rows(connection, "run/turn.postgresql")
            with bulk.counting(connection) as written:
                yield connection
                self._write_steps(connection)
            written = {name: count for name, count in written.items() if count}
            if written:
                names = sorted(written)
                self.store.append(
                    connection,
                    "ledger",
                    {
                        "run_id": self.id,
                        "write_no": self._writes,
                        "relation": names,
                        "row_count": [written[n] for n in names],
                    },
                )
        if written:
            journal.record(self.store, "ledger", self.id, self._writes)
            self._writes += 1

    def conclude(self, found: Recordable) -> None:
        """Record what the run found, the last that it does.

        Where the file of a store is not to be had for that, what was found is kept beside it and recorded when the
        store is opened next; raises InUseError that says so.
        """
        try:
            self.transact(partial(found.record, self))
        except InUseError as error:
            assert self.store.file is not None
            file, now = kept_file(self.store.file, self.id), time.perf_counter()
            count = self._count._replace(step_began=now - self._count.step_began)
            keep(file, _Kept(self.id, self.kind, self._writes, now - self._began, count, found))
            raise InUseError(
                f"{error}; what run {self.id} found is kept in {file}, and recorded when the store is next opened to "
                "be written"
            ) from error

    def transact(self, work: Callable[[Connection], T]) -> T:
        """Run `work` in a transaction; return its result.

        Where a server cannot serialise it, or restarts, it is retried for some seconds; side effects outside of the
        transaction may then happen twice.
        """
        return self._again(self.write, work)

    def _again(
        self, transaction: Callable[[], AbstractContextManager[Connection]], work: Callable[[Connection], T]
    ) -> T:
        done: list[tuple[T, _Count]] = []

        def once() -> T:
            if done and self._is_committed():  # only the server's answer was lost
                result, self._count = done[0]
                self._writes += 1
                return result
            with transaction() as connection:
                result = work(connection)
                done[:] = [(result, self._count)]
            return result

        return self.store.patiently(once)

    @contextmanager
    def _transaction(self) -> Iterator[Connection]:
        """A transaction; where it fails, the run's counts are restored."""
        self._liveness.hold()
        before = self._count
        try:
            with self.store.write() as connection:
                yield connection
        except BaseException:
            self._count = before
            raise

    def _is_committed(self) -> bool:
        with self.store.read() as connection:
            asked = {"run": self.id, "write_no": self._writes, "event_no": self._count.events}
            return bool(self.store.rows(connection, "run/committed", **asked))

    def new_ids(self, connection: Connection, table: str, count: int) -> Ints:
        """New identities, as `Database.new_ids`."""
        return self.store.new_ids(connection, table, count)

    def append(self, connection: Connection, table: str, columns: Columns) -> int:
        """Append rows by columns, as `Database.append`."""
        return self.store.append(connection, table, columns)

    def insert(self, connection: Connection, table: str, name: str, /, **parameters: Any) -> int:
        """Insert rows from others by a named query, as `Database.insert`."""
        return self.store.insert(connection, table, name, **parameters)

    @property
    def seconds(self) -> dict[str, float]:
        """Seconds that the finished steps took, by name, in their order."""
        seconds: dict[str, float] = {}
        for step in self._count.steps:
            seconds[step.name] = seconds.get(step.name, 0.0) + step.seconds
        return seconds

    def step(self, name: str) -> None:
        """End a step, which began where the one before it ended; it is written with what the run writes next."""
        now = time.perf_counter()
        step = _Step(name, now - self._count.step_began, datetime.now(UTC))
        self._count = self._count._replace(step_began=now, steps=(*self._count.steps, step))
        self._tell(name)

    def _tell(self, step: str) -> None:
        if self.store.watch is not None:
            self.store.watch(self.kind, step)

    def finish(self, message: str | None = None, connection: Connection | None = None, *, last: str = "rest") -> None:
        """End the run as finished, within `connection`'s transaction if given; `last` names the step that ends with it,
        where there were steps."""
        self._end("finished", message, connection, last)

    def fail(self, message: str, connection: Connection | None = None, *, cause: str = "error") -> None:
        """End the run as failed, with the reason, and whether that is its input or an error; its last step is called
        unfinished."""
        self._end("failed", message, connection, "unfinished", cause)

    def _end(
        self, state: str, message: str | None, connection: Connection | None, last: str, cause: str | None = None
    ) -> None:
        if connection is None:
            self._again(self._transaction, lambda own: self._end(state, message, own, last, cause))
            journal.record(self.store, "run_event", self.id, self._count.events - 1)
            return
        if self._count.steps:
            self.step(last)
        self._write_steps(connection)
        now = self._count.step_began if self._count.steps else time.perf_counter()
        took, said = [now - self._began], [message]
        self._append_events(connection, ["ended"], seconds=took, state=[state], cause=[cause], message=said)
        self._count = self._count._replace(ended=True)

    def _write_steps(self, connection: Connection) -> None:
        steps = self._count.steps[self._count.written :]
        self._append_events(
            connection,
            ["step"] * len(steps),
            name=[step.name for step in steps],
            seconds=[step.seconds for step in steps],
            happened_at=[step.ended_at for step in steps],
        )
        self._count = self._count._replace(written=len(self._count.steps))

    def _append_events(self, connection: Connection, kinds: list[str], **columns: list[Any]) -> None:
        first, count = self._count.events, len(kinds)
        common: dict[str, Any] = {"name": [""] * count, "happened_at": [datetime.now(UTC)] * count}
        numbered: dict[str, Any] = {
            "run_id": [self.id] * count,
            "event_no": list(range(first, first + count)),
            "kind": kinds,
        }
        self.store.append(connection, "run_event", numbered | common | columns)
        self._count = self._count._replace(events=first + count)
