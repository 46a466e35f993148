"""Limits of the queries of a page: they write nothing, reach nothing beyond the store, and have bounded time."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any

from sqlalchemy import event

from relmodel.errors import RelmodelError
from relmodel.store import Store
from relmodel.store.ask import after, lock_down

GRACE_S = 10.0
"""s beyond the limit for a statement to heed it"""


class StoppedError(RelmodelError):
    """A page took longer than it may."""


@contextmanager
def only_reading(store: Store, time_limit_s: float, overdue: Callable[[], object] | None = None) -> Iterator[None]:
    """Limit all queries of the block on a store that is open read-only: on DuckDB external access is off and the
    configuration locked; what is not done after `time_limit_s` is interrupted.  Raises StoppedError then.  Where a
    statement does not heed that, `overdue` is called, from another thread.
    """
    drivers: list[Any] = []
    running: list[Any] = []  # the statement that does
    ends = time.monotonic() + time_limit_s

    def interrupt() -> None:
        for driver in drivers:
            with suppress(Exception):  # it has just come to its end
                driver.interrupt() if store.dialect == "duckdb" else driver.cancel()

    def check(driver: Any, *_: object) -> None:
        drivers.append(driver)
        refuse()

    def refuse(*_: object) -> None:
        if time.monotonic() > ends:
            raise StoppedError("it is over")

    def begin(_: object, cursor: Any, *__: object) -> None:
        refuse()
        running.append(cursor)

    def end(*_: object) -> None:
        running.clear()

    def give_up() -> None:
        if running and overdue is not None:
            overdue()

    def done(driver: Any, *_: object) -> None:
        if driver in drivers:
            drivers.remove(driver)

    listened: dict[str, Callable[..., Any]] = {
        "checkout": check,
        "checkin": done,
        "before_cursor_execute": begin,
        "after_cursor_execute": end,
    }
    with store.read() as connection:
        if store.dialect == "duckdb":
            lock_down(store, connection)
    for name, heard in listened.items():
        event.listen(store.engine, name, heard)
    try:
        with after(time_limit_s, interrupt), after(time_limit_s + GRACE_S, give_up):
            yield
    except Exception as error:
        if time.monotonic() > ends:
            raise StoppedError(f"the page was stopped after {time_limit_s:g} s: ask for less") from error
        raise
    finally:
        for name, heard in listened.items():
            event.remove(store.engine, name, heard)
