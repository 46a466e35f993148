"""Reading and writing by columns: Arrow on DuckDB, COPY on PostgreSQL, inside the SQLAlchemy transaction."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import numpy as np
import numpy.typing as npt
import sqlalchemy as sa
from sqlalchemy import Connection
from sqlalchemy.types import TypeEngine

from relmodel.arrays import Columns, ColumnValues, Ragged, column_array, is_scalar, row_count

_COUNTS = "relmodel_counts"


def count_rows(connection: Connection, table: str, count: int) -> None:
    """Count rows that were appended to a table on `connection`, or deleted where `count` is below 0."""
    counts = connection.info.get(_COUNTS)
    if counts is not None and count:
        counts[table] = counts.get(table, 0) + count


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


def fill(connection: Connection, table: str, columns: Columns, types: Mapping[str, TypeEngine[Any]]) -> None:
    """Append rows by columns to a table whose columns have these types, in their order; those left out are null."""
    count = row_count(columns)
    driver: Any = connection.connection.driver_connection
    if connection.dialect.name != "duckdb":
        _copy(driver, table, columns, count)
        return
    import pyarrow as pa

    incoming = pa.table(
        {n: _arrow(columns[n], count, kind) if n in columns else pa.nulls(count) for n, kind in types.items()}
    )
    # By position, from a reader: registered as a table and selected from by name they take twice as long to begin with.
    driver.from_arrow(incoming.to_reader()).insert_into(table)


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

    A temporary table that Arrow or COPY fills: to bind an element of a list takes DuckDB's client 60 us."""
    spelled = ", ".join(f'"{column}" {_spelled(values)}' for column, values in columns.items())
    connection.exec_driver_sql(f'CREATE TEMPORARY TABLE "{name}" ({spelled})')
    if row_count(columns):
        fill(connection, name, columns, dict.fromkeys(columns, sa.types.NullType()))
    yield  # where an error leaves the block the transaction is rolled back, and the table with it
    connection.exec_driver_sql(f'DROP TABLE "{name}"')


def _spelled(values: ColumnValues) -> str:
    """Type of a column of integers, floats or texts; an empty list is one of texts."""
    if isinstance(values, list) and not values:
        return "TEXT"
    return {"i": "BIGINT", "f": "DOUBLE PRECISION"}.get(np.asarray(values).dtype.kind, "TEXT")


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
    return column_array(values)
