"""A database opened: transactions, named queries, and reading and writing by columns."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, nullcontext
from functools import cache, cached_property
from graphlib import TopologicalSorter
from pathlib import Path
from typing import Any, Self, TypeVar

import numpy as np
import numpy.typing as npt
import sqlalchemy as sa
from sqlalchemy import Connection, Engine, Row, Table
from sqlalchemy.exc import ProgrammingError
from sqlalchemy.types import TypeEngine

from relmodel.arrays import Columns, ColumnValues, Ints, row_count
from relmodel.blas import one_blas_thread
from relmodel.errors import StoreError, TransientError
from relmodel.store import bulk, sql
from relmodel.store.engine import Access
from relmodel.store.sql import column_types
from relmodel.table import table_of


def stored_fields(table: str, rows: object) -> dict[str, Any]:
    """The columns of a table that `rows` has as fields or properties of their names."""
    return {name: getattr(rows, name) for name in column_types(table) if hasattr(rows, name)}


def round_columns(table: str, columns: Columns) -> dict[str, ColumnValues]:
    """Columns of a table with floating-point numbers rounded to the store's types."""
    types = column_types(table)

    def rounded(name: str, values: ColumnValues) -> ColumnValues:
        if not isinstance(values, np.ndarray) or values.dtype.kind != "f":
            return values
        kind, _, size = types[name].partition("(")
        if kind == "DECIMAL":
            unit = 10.0 ** int(size.rstrip(")").split(",")[1])
            return np.asarray(np.rint(values * unit) / unit)
        if kind == "REAL":
            return values.astype(np.float32).astype(np.float64)
        return values

    return {name: rounded(name, values) for name, values in columns.items()}


# Types as DuckDB spells them that the reflection of its dialect does not know.
_TYPES: dict[str, type[TypeEngine[Any]]] = {"blob": sa.LargeBinary, "decimal": sa.Numeric}
_NEXT_IDS = sa.text("SELECT nextval(:sequence) AS id FROM generate_series(1, :count) ORDER BY id")
WAITS_S = (0.1, 0.5, 1.0, 2.0, 4.0)
"""s before each further try of what a server refused or lost: a restart takes it a few seconds"""
_FAILURES = {"OperationalError", "InterfaceError", "InternalException", "FatalException"}  # the last two are DuckDB's
# Serialisation failure, deadlock, shutdown by whom or by what, starting up; and connections lost, which have no code.
_TRANSIENT = {"40001", "40P01", "57P01", "57P02", "57P03", None}
T = TypeVar("T")


@cache  # for all stores of a process: making all hundred takes longer than opening one
def _table(dialect: Any, name: str, columns: tuple[str, ...], types: tuple[str, ...]) -> Table:
    own = (sa.Column(column, _type(dialect, spelled)) for column, spelled in zip(columns, types, strict=True))
    return Table(name, sa.MetaData(), *own)


def _type(dialect: Any, spelled: str) -> TypeEngine[Any]:
    """The type that a database spells so, as `DECIMAL(9,2)` or `double precision[]`; one that is not known, of tables
    that somebody else keeps in the database, is left open."""
    name, _, size = spelled.lower().removesuffix("[]").rstrip(")").partition("(")
    kind = (_TYPES | dialect.ischema_names).get(name, sa.types.NullType)
    one = kind(*map(int, size.split(","))) if size else kind()
    return sa.ARRAY(one) if spelled.endswith("[]") else one


class Database:
    """What a store is made in.  All reading and writing goes through connections that `read` and `write` return.

    access: how it is reached, and shared with others.  dead_runs: runs whose processes are
    gone, for the views of a DuckDB file that is open for reading.  watch: called with a run's kind when it begins, and
    with that and a step's name when the step ends."""

    def __init__(self, engine: Engine, name: str, *, read_only: bool = False) -> None:
        self.access = Access(engine)
        self.name = name
        self._read_only = read_only
        self.is_closed = False
        self.dead_runs: list[int] = []
        self.watch: Callable[[str, str], None] | None = None

    @property
    def engine(self) -> Engine:
        """What connects to the database."""
        return self.access.engine

    @property
    def file(self) -> Path | None:
        """The file of a DuckDB store."""
        return self.access.file

    @property
    def revision(self) -> str | None:
        """Revision of the schema that the store has; None where it is not a relmodel store, or not there."""
        self._refuse_closed()
        if self.file is not None and not self.file.exists():
            return None
        found = self.rows_if_there("store/revision")
        return str(found[0].version_num) if found else None

    def release(self) -> None:
        """Close a DuckDB file for other processes until the next read or write, which waits where another writes it."""
        if self.dialect == "duckdb" and not self.is_closed:
            self.engine.dispose()

    def connect(self) -> Connection:
        """A connection that the caller closes; waits while another process writes the file or the server restarts."""

        def once() -> Connection:
            with self.failures():
                connection = self.access.connect()
                if self.dead_runs:
                    connection.execute(sql.query("run/name_dead.duckdb"), {"dead": self.array(self.dead_runs)})
                    connection.commit()
                return connection

        return self.patiently(once)

    def close(self) -> None:
        """Close the database; any later use raises StoreError."""
        self.is_closed = True
        self.engine.dispose()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def dialect(self) -> str:
        """`duckdb` or `postgresql`."""
        return self.engine.dialect.name

    @cached_property
    def _columns(self) -> dict[str, tuple[tuple[str, ...], tuple[str, ...]]]:
        """Names and types of the columns of each table, in one query: SQLAlchemy reflects them in ten times as long."""
        with self.read() as connection:
            rows = self.rows(connection, f"store/columns.{self.dialect}")
        return {row.relation: (tuple(row.names), tuple(row.types)) for row in rows}

    def table(self, name: str) -> Table:
        """Table of the store, with the columns that are there: they are spelled in `schema/` only."""
        if name not in self._columns:
            raise ValueError(f"the store has no table {name!r}")
        dialect: Any = type(self.engine.dialect)
        return _table(dialect, name, *self._columns[name])

    @cached_property
    def _place(self) -> dict[str, int]:
        """Place of each table that refers to others or is referred to, behind all that it refers to."""
        parents: dict[str, list[str]] = {}
        with self.read() as connection:
            refers = self.select(connection, "sds_reference", "relation", "parent", order="relation parent")
        for relation, parent in dict.fromkeys(zip(*refers.values(), strict=True)):
            if parent != relation:
                parents.setdefault(relation, []).append(parent)
        return {name: place for place, name in enumerate(TopologicalSorter(parents).static_order())}

    def parents_first(self, names: Iterable[str]) -> list[str]:
        """Names of tables in the order in which foreign keys allow appending: referred tables first."""
        return sorted(names, key=lambda name: (self._place.get(name, -1), name))

    @contextmanager
    def read(self, *, scratch: bool = False) -> Iterator[Connection]:
        """A connection that sees one snapshot; it writes nothing.  scratch: it may make relations of its own
        (`relation`) in a store that is open for reading only, which PostgreSQL forbids otherwise.

        Raises StoreError where the database fails, refuses it to the role, or is closed."""
        self._refuse_closed()
        with self.failures(), self.connect() as connection, self._interrupts(connection):
            if self.dialect == "postgresql":  # whose default gives each statement a snapshot of its own
                connection = connection.execution_options(isolation_level="REPEATABLE READ")
                if scratch:
                    connection.exec_driver_sql("SET TRANSACTION READ WRITE")
            yield connection
            connection.rollback()

    @contextmanager
    def write(self) -> Iterator[Connection]:
        """A transaction: all of it is committed at the end, or none where an error leaves the block.

        Raises StoreError where the database fails, refuses it to the role, is closed, or is open for reading only."""
        self._refuse_closed()
        if self._read_only:
            raise StoreError(f"the store {self.name} is open for reading only: open it without read_only to write")
        with (
            self.failures(),
            self.access.writable(),
            self.connect() as connection,
            connection.begin(),
            self._interrupts(connection),
        ):
            yield connection

    @contextmanager
    def _interrupts(self, connection: Connection) -> Iterator[None]:
        """Raise Ctrl-C during a DuckDB statement as KeyboardInterrupt: its client raises another error.

        DuckDB has to be interrupted, or closing the connection would wait for it."""
        try:
            yield
        except RuntimeError as error:
            if not isinstance(error.__cause__, KeyboardInterrupt):
                raise
            driver: Any = connection.connection.driver_connection
            driver.interrupt()
            raise KeyboardInterrupt from error

    def patiently(self, work: Callable[[], T]) -> T:
        """The result of `work`, retried for some seconds where a server cannot serialise it or restarts."""
        for wait in WAITS_S:
            try:
                return work()
            except TransientError:
                time.sleep(wait)
        return work()

    @contextmanager
    def one_thread(self) -> Iterator[None]:
        """Run DuckDB and linear algebra in one thread while the block lasts: with more DuckDB copies appended rows
        twice, and small queries and products take longer.  Heavy queries need the threads."""
        self._refuse_closed()
        with one_blas_thread(), self.access.one_thread() if self.dialect == "duckdb" else nullcontext():
            yield

    def _refuse_closed(self) -> None:
        if self.is_closed:  # the engine would reconnect
            raise StoreError(f"the store {self.name} is closed: open it again")

    @contextmanager
    def failures(self) -> Iterator[None]:
        """Turn failures of the database (connection lost, disk full, out of memory, no privilege) into a sentence.

        Errors of statements stay as they are: they are mistakes of the program."""
        try:
            yield
        except Exception as error:
            said = getattr(error, "orig", None) or error
            words = str(said).strip().partition("\n")[0]
            if type(said).__name__ in ("InsufficientPrivilege", "ReadOnlySqlTransaction"):
                raise StoreError(f"the store {self.name} denies this ({words}): use a role with the right") from error
            ours = type(said).__module__.startswith(("duckdb", "_duckdb", "psycopg"))
            if not ours or not _FAILURES & {kind.__name__ for kind in type(said).__mro__}:
                raise
            # A code 08... is a connection's.
            code = getattr(said, "sqlstate", "") if self.dialect == "postgresql" else ""
            kind = TransientError if code in _TRANSIENT or str(code).startswith("08") else StoreError
            raise kind(
                f"the store {self.name} failed ({words}): check its disk, memory or server, and try again"
            ) from error

    def rows(self, connection: Connection, name: str, /, **parameters: Any) -> Sequence[Row[Any]]:
        """Rows of the named query `queries/NAME.sql`."""
        return connection.execute(sql.query(name), parameters).all()

    def rows_if_there(self, name: str) -> Sequence[Row[Any]] | None:
        """Rows of the named query; None where a table that it asks is not there."""
        try:
            with self.read() as connection:
                return self.rows(connection, name)
        except ProgrammingError as error:  # sooner said than by a look through the catalogue
            if type(error.orig).__name__ not in ("CatalogException", "UndefinedTable"):
                raise
            return None

    def columns(self, connection: Connection, name: str, /, **parameters: Any) -> dict[str, npt.NDArray[Any]]:
        """Result of the named query by columns: arrays of one length, list columns as object arrays of arrays.

        Nulls are NaN in columns of floats and None in columns of text; integer columns must have none."""
        return bulk.fetch_columns(connection, sql.query(name), parameters)

    def select(
        self, connection: Connection, table: str, /, *names: str, order: str = "", **key: Any
    ) -> dict[str, npt.NDArray[Any]]:
        """Rows of a table whose columns have the values of `key`, or one of a list, in `order` (names of columns,
        spaces between), by columns as `columns` gives them: those of some names, else all but those of one value."""
        own = self.table(table).c
        wanted = [own[name] for name in names] or [c for c in own if isinstance(key.get(c.name, []), list)]
        # As double precision, whatever the digits of the store: PostgreSQL's client would make objects of decimals.
        spelled = [
            sa.cast(c, sa.Double).label(c.name) if isinstance(c.type, sa.Numeric | sa.REAL) else c for c in wanted
        ]
        asked = [
            own[name] == (sa.func.any(sa.bindparam(name)) if isinstance(value, list) else sa.bindparam(name))
            for name, value in key.items()
        ]
        query = sa.select(*spelled).where(*asked).order_by(*(own[name] for name in order.split()))
        return bulk.fetch_columns(connection, query, key)

    def arrow(self, connection: Connection, name: str, /, **parameters: Any) -> Any:
        """Result of the named query as an Arrow table: integers stay such where some are null."""
        result = connection.execute(sql.query(name), parameters)
        if self.dialect == "duckdb":
            cursor: Any = result.cursor
            return cursor.to_arrow_table()
        return table_of(list(result.keys()), result.all()).arrow

    def new_ids(self, connection: Connection, table: str, count: int) -> Ints:
        """`count` new identities for rows of `table`, increasing."""
        if count == 0:
            return np.empty(0, np.int64)
        asked = {"sequence": f"{table}_id_seq", "count": count}
        return np.asarray(bulk.fetch_columns(connection, _NEXT_IDS, asked)["id"], np.int64)

    def append(self, connection: Connection, table: str, columns: Columns) -> int:
        """Append rows to `table` by columns; returns how many.  Columns left out are null."""
        types = {name: column.type for name, column in self.table(table).columns.items()}
        unknown = set(columns) - set(types)
        if unknown:
            raise ValueError(f"table {table} has no column {sorted(unknown)}")
        count = row_count(columns)
        if count:
            bulk.fill(connection, table, columns, types)
            bulk.count_rows(connection, table, count)
        return count

    def insert(self, connection: Connection, table: str, name: str, /, **parameters: Any) -> int:
        """Run the named query, which inserts rows into `table` from others; returns how many."""
        count = connection.execute(sql.query(name), parameters).rowcount
        bulk.count_rows(connection, table, count)
        return count

    def delete(self, connection: Connection, table: str, column: str, keys: str) -> int:
        """Delete the rows of `table` whose `column` (else `id`) is among those of the relation `keys`; how many."""
        own, asked = self.table(table), sa.table(keys, sa.column(column))
        key = own.c[column if column in own.c else "id"]
        count = connection.execute(sa.delete(own).where(key.in_(sa.select(asked.c[column])))).rowcount
        bulk.count_rows(connection, table, -count)
        return count

    # Columns as a relation that named queries on a connection join by its name: how they are handed sets of keys.
    relation = staticmethod(bulk.relation)

    def array(self, numbers: npt.ArrayLike) -> str:
        """Numbers (n,) as a parameter that a named query casts to an array: DuckDB's client takes .2 ms to bind each
        number of a list where pandas is not installed."""
        opening, closing = "[]" if self.dialect == "duckdb" else "{}"
        return opening + ",".join(map(repr, np.asarray(numbers).tolist())) + closing


def newer_store(database: Database) -> StoreError:
    """The error for a store of a revision that this program does not know."""
    return StoreError(
        f"the store {database.name} is of a newer version ({database.revision}) than this program: upgrade relmodel"
    )
