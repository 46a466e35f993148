"""Limits of the queries of a page: they write nothing, reach nothing beyond the store, and have bounded time."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from threading import Timer
from typing import Any

from sqlalchemy import event

from relmodel.errors import RelmodelError
from relmodel.store import Store
from relmodel.store.ask import lock_down


class StoppedError(RelmodelError):
    """A page took longer than it may."""


@contextmanager
def only_reading(store: Store, time_limit_s: float) -> Iterator[None]:
    """Limit all queries of the block on a store that is open read-only: on DuckDB external access is off and the
    configuration locked; what is not done after `time_limit_s` is interrupted.  Raises StoppedError then.
    """
    drivers: list[Any] = []
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

    def done(driver: Any, *_: object) -> None:
        if driver in drivers:
            drivers.remove(driver)

    listened: dict[str, Callable[..., Any]] = {"checkout": check, "checkin": done, "before_cursor_execute": refuse}
    with store.read() as connection:
        if store.dialect == "duckdb":
            lock_down(store, connection)
    for name, heard in listened.items():
        event.listen(store.engine, name, heard)
    timer = Timer(time_limit_s, interrupt)
    timer.start()
    try:
        yield
    except Exception as error:
        if time.monotonic() > ends:
            raise StoppedError(f"the page was stopped after {time_limit_s:g} s: ask for less") from error
        raise
    finally:
        timer.cancel()
        for name, heard in listened.items():
            event.remove(store.engine, name, heard)
