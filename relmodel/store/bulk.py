"""Reading and writing by columns: Arrow on DuckDB, COPY on PostgreSQL, inside the SQLAlchemy transaction."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np
import numpy.typing as npt
import sqlalchemy as sa
from sqlalchemy import Connection, Table, TextClause
from sqlalchemy.types import TypeEngine

from relmodel.arrays import Columns, ColumnValues, Ints, Ragged, is_scalar, row_count

_COUNTS = "relmodel_counts"


def append(connection: Connection, table: Table, columns: Columns) -> int:
    """Append rows by columns and return how many; columns left out are null."""
    unknown = set(columns) - set(table.columns.keys())
    if unknown:
        raise ValueError(f"table {table.name} has no column {sorted(unknown)}")
    count = row_count(columns)
    if count == 0:
        return 0
    if connection.dialect.name == "duckdb":
        _append_arrow(connection, table, columns, count)
    else:
        _copy(connection.connection.driver_connection, table.name, columns, count)
    _count(connection, table, count)
    return count


def insert(connection: Connection, table: Table, query: TextClause, parameters: Mapping[str, Any]) -> int:
    """Run a query that inserts rows into `table` from others, and return how many."""
    count = connection.execute(query, parameters).rowcount
    _count(connection, table, count)
    return count


def delete(connection: Connection, table: Table, column: str, keys: str) -> int:
    """Delete the rows of `table` whose `column` is among those of the relation `keys`, and return how many."""
    asked = sa.table(keys, sa.column(column))
    own = table.c[column if column in table.c else "id"]
    count = connection.execute(sa.delete(table).where(own.in_(sa.select(asked.c[column])))).rowcount
    _count(connection, table, -count)
    return count


def _count(connection: Connection, table: Table, count: int) -> None:
    counts = connection.info.get(_COUNTS)
    if counts is not None and count:
        counts[table.name] = counts.get(table.name, 0) + count


@contextmanager
def counting(connection: Connection) -> Iterator[dict[str, int]]:
    """Count what is appended on `connection` while the block lasts: rows by name of the table."""
    counts: dict[str, int] = {}
    connection.info[_COUNTS] = counts
    try:
        yield counts
    finally:
        del connection.info[_COUNTS]


def counted(connection: Connection) -> set[str]:
    """Tables to which rows were appended on `connection` since `counting` began."""
    return {name for name, count in connection.info[_COUNTS].items() if count}


def _append_arrow(connection: Connection, table: Table, columns: Columns, count: int) -> None:
    import pyarrow as pa

    incoming = pa.table(
        {
            name: _arrow(columns[name], count, column.type) if name in columns else pa.nulls(count)
            for name, column in table.columns.items()
        }
    )
    driver: Any = connection.connection.driver_connection
    # By position, from a reader: registered as a table and selected from by name they take twice as long to begin with.
    driver.from_arrow(incoming.to_reader()).insert_into(table.name)


def _arrow(values: ColumnValues, count: int, kind: TypeEngine[Any]) -> Any:
    import pyarrow as pa

    if isinstance(values, Ragged):
        mask = None if values.null is None else pa.array(values.null)
        return pa.LargeListArray.from_arrays(pa.array(values.offsets), pa.array(values.values), mask=mask)
    if is_scalar(values):
        return pa.repeat(pa.scalar(values), count)
    if isinstance(values, np.ndarray) and values.dtype.kind == "f":
        if isinstance(kind, sa.Numeric) and kind.precision and kind.scale:
            return _decimals(values, kind.precision, kind.scale)
        return pa.array(values, from_pandas=True)  # NaN is null: no column of the schema holds a NaN
    if isinstance(values, np.ma.MaskedArray):
        return pa.array(values.data, mask=np.ma.getmaskarray(values))
    return pa.array(values)


def _decimals(values: npt.NDArray[np.floating], precision: int, scale: int) -> Any:
    """Numbers rounded to DECIMAL(precision, scale), at most nine digits: DuckDB is slower at it."""
    import pyarrow as pa

    units = np.rint(values * 10.0**scale)
    if (np.abs(units) >= 10.0**precision).any():
        raise ValueError(f"a number beyond the {precision} digits of its column: {np.nanmax(np.abs(values))}")
    null = np.isnan(units)
    whole = pa.array(np.where(null, 0, units).astype(np.int32), mask=null)
    return pa.Array.from_buffers(pa.decimal32(precision, scale), len(whole), whole.buffers())


def _copy(driver: Any, table: str, columns: Columns, count: int) -> None:
    from psycopg import sql

    statement = sql.SQL("COPY {} ({}) FROM STDIN").format(
        sql.Identifier(table), sql.SQL(", ").join(map(sql.Identifier, columns))
    )
    with driver.cursor() as cursor, cursor.copy(statement) as copy:
        for row in zip(*(objects(values, count) for values in columns.values()), strict=True):
            copy.write_row(row)


def objects(values: ColumnValues, count: int) -> Iterator[Any]:
    """The values of a column of so many rows, one by one; None is null."""
    if isinstance(values, Ragged):
        null = np.zeros(count, bool) if values.null is None else values.null
        return (None if null[i] else values[i].tolist() for i in range(count))
    if is_scalar(values):
        return (values for _ in range(count))
    if isinstance(values, np.ndarray):
        if values.dtype.kind == "f" and np.isnan(values).any():
            return (None if v != v else v for v in values.tolist())
        return iter(values.tolist())
    assert isinstance(values, list | tuple)
    return iter(values)


@contextmanager
def relation(connection: Connection, name: str, columns: Columns) -> Iterator[None]:
    """Columns as a relation that queries on `connection` may join by its name while the block lasts.

    A temporary table that Arrow or COPY fills: to bind an element of a list takes DuckDB's client 60 us.
    """
    spelled = ", ".join(f'"{column}" {_spelled(values)}' for column, values in columns.items())
    connection.exec_driver_sql(f'CREATE TEMPORARY TABLE "{name}" ({spelled})')
    count = row_count(columns)
    driver: Any = connection.connection.driver_connection
    if not count:
        pass
    elif connection.dialect.name == "duckdb":
        import pyarrow as pa

        unknown = sa.types.NullType()
        incoming = pa.table({column: _arrow(values, count, unknown) for column, values in columns.items()})
        driver.from_arrow(incoming.to_reader()).insert_into(name)
    else:
        _copy(driver, name, columns, count)
    yield  # where an error leaves the block the transaction is rolled back, and the table with it
    connection.exec_driver_sql(f'DROP TABLE "{name}"')


def _spelled(values: ColumnValues) -> str:
    """Type of a column of integers, floats or texts; an empty list is one of texts."""
    if isinstance(values, list) and not values:
        return "TEXT"
    return {"i": "BIGINT", "f": "DOUBLE PRECISION"}.get(np.asarray(values).dtype.kind, "TEXT")


def array_text(dialect: str, numbers: npt.NDArray[Any]) -> str:
    """Numbers (n,) as the text of an array, to be cast in a query: DuckDB's client takes 0.2 ms to bind each number of
    a list where pandas is not installed."""
    opening, closing = "[]" if dialect == "duckdb" else "{}"
    return opening + ",".join(map(repr, numbers.tolist())) + closing


def fetch_columns(
    connection: Connection, query: sa.Executable, parameters: Mapping[str, Any]
) -> dict[str, npt.NDArray[Any]]:
    """Run a query and return its result by columns; see `Store.columns`."""
    result = connection.execute(query, parameters)
    if connection.dialect.name == "duckdb":
        cursor: Any = result.cursor
        return {name: _unmask(values) for name, values in cursor.fetchnumpy().items()}
    # Of a column that holds no value only its type says what it is of.
    described: Any = result.cursor.description if result.cursor else ()
    types = [_EMPTY.get(column[1], np.dtype(object)) for column in described]
    names = list(result.keys())
    rows = result.all()
    return {name: _array([row[i] for row in rows], types[i]) for i, name in enumerate(names)}


def select(
    connection: Connection, table: Table, names: Sequence[str], order: Sequence[str], key: Mapping[str, Any]
) -> dict[str, npt.NDArray[Any]]:
    """Rows of a table by its key; see `Store.select`."""
    wanted = [table.c[name] for name in names] or [
        column for column in table.columns if isinstance(key.get(column.name, []), list)
    ]
    # As double precision, whatever the digits of the store: PostgreSQL's client would make objects of decimals.
    spelled = [sa.cast(c, sa.Double).label(c.name) if isinstance(c.type, sa.Numeric | sa.REAL) else c for c in wanted]
    asked = [
        table.c[name] == (sa.func.any(sa.bindparam(name)) if isinstance(value, list) else sa.bindparam(name))
        for name, value in key.items()
    ]
    return fetch_columns(connection, sa.select(*spelled).where(*asked).order_by(*(table.c[n] for n in order)), key)


def fetch_arrow(connection: Connection, query: TextClause, parameters: Mapping[str, Any]) -> Any:
    """Run a query and return its result as an Arrow table; see `Store.arrow`."""
    result = connection.execute(query, parameters)
    if connection.dialect.name == "duckdb":
        cursor: Any = result.cursor
        return cursor.to_arrow_table()
    import pyarrow as pa

    names = list(result.keys())
    rows = result.all()
    return pa.table({name: pa.array([row[i] for row in rows]) for i, name in enumerate(names)})


def _unmask(values: npt.NDArray[Any]) -> npt.NDArray[Any]:
    if not isinstance(values, np.ma.MaskedArray):
        return values
    if values.dtype.kind == "f":
        return values.filled(np.nan)
    if values.dtype.kind == "O":
        out = values.data.copy()
        out[np.ma.getmaskarray(values)] = None
        return out
    if np.ma.is_masked(values):
        return np.where(values.mask, np.nan, values.data.astype(float))
    return np.asarray(values.data)


# PostgreSQL's numbers of types, in pg_type: int8, int2, int4, float4, float8.
_INTS, _FLOATS = (20, 21, 23), (700, 701)
_EMPTY: dict[int, np.dtype[Any]] = dict.fromkeys(_INTS, np.dtype(int)) | dict.fromkeys(_FLOATS, np.dtype(float))


def _array(values: list[Any], empty: np.dtype[Any]) -> npt.NDArray[Any]:
    kinds = {type(v) for v in values}
    if empty.kind != "O" and kinds <= {type(None)}:
        return np.full(len(values), np.nan) if kinds else np.empty(0, empty)
    if kinds and kinds <= {int, float, bool, type(None)} and kinds != {type(None)}:
        return np.array([np.nan if v is None else v for v in values] if type(None) in kinds else values)
    out = np.empty(len(values), dtype=object)
    out[:] = [np.asarray(v) if isinstance(v, list) else v for v in values]
    return out


_NEXT_IDS = sa.text("SELECT nextval(:sequence) AS id FROM generate_series(1, :count) ORDER BY id")


def new_ids(connection: Connection, table: str, count: int) -> Ints:
    """`count` values of the sequence of `table`, increasing."""
    if count == 0:
        return np.empty(0, np.int64)
    ids = fetch_columns(connection, _NEXT_IDS, {"sequence": f"{table}_id_seq", "count": count})["id"]
    return np.asarray(ids, np.int64)
