"""Runs: every execution that writes leaves a row of what it was given, what happened, how it ended, and digests."""

from __future__ import annotations

import hashlib
import json
import logging
import math
import os
import platform
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Set
from contextlib import AbstractContextManager, ExitStack, contextmanager, suppress
from datetime import UTC, datetime
from functools import cache, partial
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, NamedTuple, Protocol, TypeVar

import numpy as np
import numpy.typing as npt
import sqlalchemy as sa
from sqlalchemy import Connection, Table

import relmodel
from relmodel.arrays import Columns, Ints, by_column
from relmodel.blas import one_blas_thread
from relmodel.errors import InputError, InUseError, StoreError, UsageError
from relmodel.names import check_readable
from relmodel.resources import code_commit, code_sha256
from relmodel.store import bulk, side_files, sql
from relmodel.store.database import Database
from relmodel.store.side_files import LivenessLock, keep, kept_file, kept_files, read_kept

T = TypeVar("T")
Writer = Callable[..., int]
"""appends columns of rows to a table: `write("presence", path=paths)`"""
_LOG = logging.getLogger("relmodel")
# What a run still writes when its digests are made; and bytes, which another run may add to a picture or a prune take.
_OPEN = frozenset({"run_event", "ledger", "pruned_run", "row_digest", "image_blob"})
_BEGUN = frozenset({"run", "run_input"})


def record_digests(run: Run, connection: Connection) -> None:
    """Append digests of what an inspection wrote and of the extractions it read: the last but its end."""
    ledger = run.store.table("ledger")
    before = connection.scalars(sa.select(ledger.c.relation).where(ledger.c.run_id == run.id))
    digests = digest_rows(run.store, connection, run.id, bulk.counted(connection).union(before))
    columns = {"relation": list(digests), "digest": list(digests.values())}
    run.append(connection, "row_digest", {"run_id": run.id, **columns})


def digest_rows(store: Database, connection: Connection, run: int, written: Set[str] | None = None) -> dict[str, str]:
    """By relation the digest of the rows that an inspection rests on, as they are now; written: the only relations with
    rows of the run itself, but for those that its beginning wrote, where that is known."""
    held = {
        name: list(connection.scalars(sa.select(it.c.key).where(it.c.run_id == run).order_by(it.c.key)))
        for name, it in _keys(store).items()
    }
    asked = []
    for row in store.rows(connection, "store/relations"):
        if row.standing == "view" or row.relation in _OPEN:
            continue
        relation, table = row.relation, store.table(row.relation)
        if (found := _key_of(table)) is not None:
            name, column = found
            if name == "run_id" and written is not None and relation not in written | _BEGUN:
                continue
            asked.append(sa.select(sa.literal(relation), _digest(store, table)).where(column.in_(held[name])))
    found_all = connection.execute(sa.union_all(*asked)).all()  # in one statement: each takes longer to ask than to run
    return {relation: digest for relation, digest in found_all if digest is not None}


def read_rows(
    store: Database, connection: Connection, run: int, relation: str, columns: Iterable[str]
) -> dict[str, npt.NDArray[Any]]:
    """Columns of the rows of a relation that an inspection rests on, as `Database.columns` gives them."""
    table = store.table(relation)
    found = _key_of(table)
    assert found is not None
    keys = _keys(store)[found[0]]
    asked = sa.select(*(table.c[name] for name in columns)).where(
        found[1].in_(sa.select(keys.c.key).where(keys.c.run_id == run))
    )
    return bulk.fetch_columns(connection, asked, {})


def seal(store: Database, connection: Connection, runs: Iterable[int]) -> str:
    """SHA-256, hexadecimal, over digests of the rows that inspections rest on now: what a signed report carries."""
    said = [[run, sorted(digest_rows(store, connection, run).items())] for run in runs]
    (identity,) = store.rows(connection, "store/identity")
    return hashlib.sha256(json.dumps([identity.store_id, said]).encode()).hexdigest()


def find_altered_rows(store: Database, connection: Connection) -> list[dict[str, Any]]:
    """Relations of runs whose rows are not those whose digests were recorded; what was pruned may be gone."""
    kept, pruned = store.table("row_digest"), store.table("pruned_run")
    recorded = {(row.run_id, row.relation): row.digest for row in connection.execute(sa.select(kept))}
    gone = set(connection.scalars(sa.select(pruned.c.run_id).where(pruned.c.what == "runs")))
    asked = [_digests(store, relation) for relation in sorted({relation for _, relation in recorded})]
    rows = connection.execute(sa.union_all(*asked)).all() if asked else []
    found = {(run, relation): digest for relation, run, digest in rows}
    return [
        {"run_id": run, "relation": relation}
        for (run, relation), digest in sorted(recorded.items())
        if found.get((run, relation), digest if run in gone else None) != digest
    ]


def _digests(store: Database, relation: str) -> sa.Select[Any]:
    """The relation, and by run that rests on rows of it their digest."""
    table = store.table(relation)
    found = _key_of(table)
    assert found is not None
    name, column = found
    keys = _keys(store)[name]
    return (
        sa.select(sa.literal(relation), keys.c.run_id, _digest(store, table))
        .select_from(table.join(keys, column == keys.c.key))
        .group_by(keys.c.run_id)
    )


def _digest(store: Database, table: Table) -> sa.ColumnElement[str]:
    """The digest of rows of a table, independent of their order; null where there is none."""
    # Times are left out: how they are written depends on the reader's time zone.
    words = sa.cast(sa.func.row(*(c for c in table.columns if not isinstance(c.type, sa.TIMESTAMP))), sa.Text)
    number = sa.func.md5_number_lower(words) if store.dialect == "duckdb" else sa.func.hashtextextended(words, 0)
    return sa.cast(sa.func.bit_xor(number), sa.Text)


def _keys(store: Database) -> dict[str, sa.Subquery]:
    """By the column that holds a key: runs, and the keys of the rows that they rest on."""
    seen, sets, run = (store.table(name) for name in ("inspection_image", "unit_set", "run"))
    of_sets = sa.select(seen.c.run_id, sets.c.id.label("key")).join_from(
        seen, sets, seen.c.extraction_id == sets.c.extraction_id
    )
    own_sets = sa.select(sets.c.run_id, sets.c.id.label("key")).where(sets.c.run_id.is_not(None))
    return {
        "run_id": sa.select(run.c.id.label("run_id"), run.c.id.label("key")).subquery(),
        "unit_set_id": of_sets.union(own_sets).subquery(),
        "extraction_id": sa.select(seen.c.run_id, seen.c.extraction_id.label("key")).distinct().subquery(),
        "image_id": sa.select(seen.c.run_id, seen.c.image_id.label("key")).distinct().subquery(),
    }


def _key_of(table: Table) -> tuple[str, sa.Column[Any]] | None:
    """Which kind of key says what run rests on a row of a table, and the column that holds it."""
    if table.name in ("run", "unit_set", "extraction", "image"):
        return f"{table.name}_id", table.c.id
    for name in ("run_id", "unit_set_id", "extraction_id"):
        if name in table.c:
            return name, table.c[name]
    return None


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
    """What a run has recorded: events, inputs, its end, when its step began, the steps before, and those written."""

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


class _RunState(NamedTuple):
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
                due = [(row.run_id, row.event_no) for row in store.rows(connection, "run/unfinished")]
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
    again, and nothing written."""

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

        def begun() -> Run:
            with ExitStack() as failed, store.write() as connection:
                run = cls(store, int(store.new_ids(connection, "run", 1)[0]), kind)
                failed.callback(run._liveness.release)
                run._liveness.hold()
                row = {
                    "id": [run.id],
                    "kind": kind,
                    "parameters": json.dumps(_plain(parameters), sort_keys=True),
                    "versions": json.dumps(package_versions(*packages), sort_keys=True),
                    "code_commit": code_commit(),
                    "code_sha256": code_sha256(),
                    "schema_revision": sql.revisions()[-1],
                    "host": platform.node(),
                    "process": os.getpid(),
                    "began_at": [datetime.now(UTC)],
                }
                store.append(connection, "run", row)
                run.inputs(connection, dict(sorted((inputs or {}).items())))
                run._append_events(connection, ["begun"])
                failed.pop_all()
            return run

        run = store.patiently(begun)
        try:
            try:
                side_files.record(store, "run_event", run.id, 0)
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

    def inputs(self, connection: Connection, inputs: Mapping[str, tuple[str, str]]) -> None:
        """Append inputs that become known during the run: role -> (file name, SHA-256)."""
        first = self._count.inputs
        self._count = self._count._replace(inputs=first + len(inputs))
        rows = [(no, role, Path(name).name, digest) for no, (role, (name, digest)) in enumerate(inputs.items(), first)]
        columns = by_column("input_no role name sha256", rows)
        self.store.append(connection, "run_input", {"run_id": self.id, **columns})

    @contextmanager
    def write(self) -> Iterator[Connection]:
        """A transaction of this run; the ledger of what the store appends in it is committed with it.

        Transactions of several processes are serialised: what one finds missing and appends, no other appends
        meanwhile."""
        with self._transaction() as connection:
            if self.store.dialect == "postgresql":  # on DuckDB one process writes
                self.store.rows(connection, "run/turn.postgresql")
            with bulk.counting(connection) as written:
                yield connection
                self._write_steps(connection)
            written = {name: count for name, count in sorted(written.items()) if count}
            columns: dict[str, Any] = {"relation": list(written), "row_count": list(written.values())}
            self.store.append(connection, "ledger", {"run_id": self.id, "write_no": self._writes, **columns})
        if written:
            side_files.record(self.store, "ledger", self.id, self._writes)
            self._writes += 1

    def conclude(self, found: Recordable) -> None:
        """Record what the run found, the last that it does.

        Where the file of a store is not to be had for that, what was found is kept beside it and recorded when the
        store is opened next; raises InUseError that says so."""
        try:
            self.transact(partial(found.record, self))
        except InUseError as error:
            assert self.store.file is not None
            file, now = kept_file(self.store.file, self.id), time.perf_counter()
            count = self._count._replace(step_began=now - self._count.step_began)
            keep(file, _RunState(self.id, self.kind, self._writes, now - self._began, count, found))
            raise InUseError(
                f"{error}; what run {self.id} found is kept in {file}, and recorded when the store is next opened to "
                "be written"
            ) from error

    def transact(self, work: Callable[[Connection], T]) -> T:
        """Run `work` in a transaction; return its result.

        Where a server cannot serialise it, or restarts, it is retried for some seconds; side effects outside of the
        transaction may then happen twice."""
        return self._again(self.write, work)

    def _again(self, begin: Callable[[], AbstractContextManager[Connection]], work: Callable[[Connection], T]) -> T:
        done: list[tuple[T, _Count]] = []

        def once() -> T:
            if done and self._is_committed():  # only the server's answer was lost
                result, self._count = done[0]
                self._writes += 1
                return result
            with begin() as connection:
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
            events = self.store.select(connection, "run_event", "kind", run_id=self.id, event_no=self._count.events)
            written = self.store.select(connection, "ledger", "write_no", run_id=self.id, write_no=self._writes)
            return len(written["write_no"]) > 0 or bool(set(events["kind"]) - {"found_dead"})

    def new_ids(self, connection: Connection, table: str, count: int) -> Ints:
        """New identities, as `Database.new_ids`."""
        return self.store.new_ids(connection, table, count)

    def append(self, connection: Connection, table: str, columns: Columns) -> int:
        """Append rows by columns, as `Database.append`."""
        return self.store.append(connection, table, columns)

    def writer(self, connection: Connection) -> Writer:
        """What appends rows of this run within the transaction of `connection`."""
        return lambda table, /, **columns: self.append(connection, table, {"run_id": self.id, **columns})

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
        """End the run as finished, within `connection`'s transaction if given; `last` names the step that ends so."""
        self._end("finished", message, connection, last)

    def fail(self, message: str, connection: Connection | None = None, *, cause: str = "error") -> None:
        """End the run as failed, with the reason, and whether it is the input's; its last step is called unfinished."""
        self._end("failed", message, connection, "unfinished", cause)

    def _end(
        self, state: str, message: str | None, connection: Connection | None, last: str, cause: str | None = None
    ) -> None:
        if connection is None:
            self._again(self._transaction, lambda own: self._end(state, message, own, last, cause))
            side_files.record(self.store, "run_event", self.id, self._count.events - 1)
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
        common: dict[str, Any] = {"run_id": self.id, "name": "", "happened_at": [datetime.now(UTC)] * count}
        own = {"event_no": list(range(first, first + count)), "kind": kinds, **columns}
        self.store.append(connection, "run_event", common | own)
        self._count = self._count._replace(events=first + count)
