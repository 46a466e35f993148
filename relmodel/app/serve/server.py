"""A web server for one person at this machine: it answers GET, and opens the store for each request, read-only."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import partial
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any
from urllib.parse import parse_qsl, unquote, urlsplit

from sqlalchemy import Connection, event
from sqlalchemy.exc import DBAPIError

import relmodel
from relmodel.app.report.page import policy, render
from relmodel.app.serve.pages import AROUND, Page, answer
from relmodel.errors import InputError, RelmodelError, StoreError, UsageError
from relmodel.store import Store
from relmodel.store.ask import TIME_LIMIT_S, after, ask, lock_down

LOOPBACK = "127.0.0.1"
_PATIENCE_S = 10.0  # for a request to arrive
_MOST_PARAMETERS = 40
_MOST_PICTURES = 1000  # some kB each


class Server(ThreadingHTTPServer):
    """A server of one store.  Its `url` is where a browser finds it.

    Requests are answered one after the other: the store is open only meanwhile, so that others can write in between."""

    daemon_threads = True

    def __init__(
        self,
        target: str | Path,
        port: int = 0,
        time_limit_s: float = TIME_LIMIT_S,
        overdue: Callable[[], object] | None = None,
    ) -> None:
        """overdue: called where a statement of a page does not end with the page's time."""
        Store.open(target, read_only=True).close()  # says at once what is wrong with it
        try:
            super().__init__((LOOPBACK, port), Handler)
        except OSError as error:
            raise UsageError(f"port {port} cannot be used ({error.strerror}): give another with --port") from error
        self.target, self.time_limit_s, self.overdue, self.turn = target, time_limit_s, overdue, threading.Lock()
        self.pictures: dict[str, Page] = {}  # that were made: they take longest, and stay as they are
        self.hosts = {f"{name}:{self.server_port}" for name in (LOOPBACK, "localhost")}

    @property
    def url(self) -> str:
        return f"http://{LOOPBACK}:{self.server_port}/"

    def page(self, path: str, asked: dict[str, str]) -> Page | None:
        if path in self.pictures:
            return self.pictures[path]
        page = self._make(path, asked)
        if page is not None and isinstance(page.content, bytes):
            self.pictures = dict([*self.pictures.items()][1 - _MOST_PICTURES :]) | {path: page}
        return page

    def _make(self, path: str, asked: dict[str, str]) -> Page | None:
        with (
            self.turn,
            Store.open(self.target, read_only=True) as store,
            only_reading(store, self.time_limit_s, self.overdue),
            store.read() as connection,
        ):
            own = partial(ask, store, time_limit_s=self.time_limit_s, overdue=self.overdue)
            return answer(store, connection, path, asked, own)


class Handler(BaseHTTPRequestHandler):
    """One request."""

    server: Server
    timeout = _PATIENCE_S
    protocol_version = "HTTP/1.0"
    server_version, sys_version = f"relmodel/{relmodel.__version__}", ""

    def do_GET(self) -> None:
        if self.headers.get("Host", "").lower() not in self.server.hosts:  # another name was bound to this address
            self._fail(HTTPStatus.MISDIRECTED_REQUEST, "This server answers to 127.0.0.1 and localhost only.")
            return
        try:
            address = urlsplit(self.path)
            asked = dict(
                parse_qsl(address.query, keep_blank_values=True, max_num_fields=_MOST_PARAMETERS, errors="strict")
            )
            page = self.server.page(unquote(address.path, errors="strict"), asked)
        except (UsageError, InputError, ValueError) as error:
            self._fail(HTTPStatus.BAD_REQUEST, str(error))
        except StoppedError as error:
            self._fail(HTTPStatus.GATEWAY_TIMEOUT, str(error))
        except StoreError as error:
            self._fail(HTTPStatus.SERVICE_UNAVAILABLE, str(error))
        except (RelmodelError, DBAPIError) as error:
            self._fail(HTTPStatus.INTERNAL_SERVER_ERROR, str(error).splitlines()[0])
        else:
            if page is None:
                self._fail(HTTPStatus.NOT_FOUND, "There is no such page.")
            else:
                self._send(HTTPStatus.OK, page)

    def send_error(self, code: int, message: str | None = None, explain: str | None = None) -> None:
        """What the library refuses by itself: other methods than GET, and requests that are none."""
        method = code == HTTPStatus.NOT_IMPLEMENTED
        self._fail(HTTPStatus.METHOD_NOT_ALLOWED if method else HTTPStatus(code), message or "")

    def _fail(self, status: HTTPStatus, words: str) -> None:
        text = render(**AROUND, title=status.phrase, words=words)
        self._send(status, Page(text))

    def _send(self, status: HTTPStatus, page: Page) -> None:
        body = page.content if isinstance(page.content, bytes) else page.content.encode()
        self.close_connection = True
        self.send_response(status)
        for name, value in {
            "Content-Type": page.media if isinstance(page.content, bytes) else f"{page.media}; charset=utf-8",
            "Content-Length": str(len(body)),
            "Content-Security-Policy": f"{policy(served=True)}; frame-ancestors 'none'",
            "X-Content-Type-Options": "nosniff",
            "X-Frame-Options": "DENY",
            "Referrer-Policy": "no-referrer",
            "Cross-Origin-Resource-Policy": "same-origin",
            "Cache-Control": "no-store",
        }.items():
            self.send_header(name, value)
        if status == HTTPStatus.METHOD_NOT_ALLOWED:
            self.send_header("Allow", "GET")
        self.end_headers()
        if self.command != "HEAD":
            self.wfile.write(body)

    def log_message(self, format: str, *args: object) -> None:
        """Requests are not logged: what a person looks at is private."""


# Limits of the queries of a page: they write nothing, reach nothing beyond the store, and have bounded time.

GRACE_S = 10.0
"""s beyond the limit for a statement to heed it"""


class StoppedError(RelmodelError):
    """A page took longer than it may."""


@contextmanager
def only_reading(store: Store, time_limit_s: float, overdue: Callable[[], object] | None = None) -> Iterator[None]:
    """Limit all queries of the block on a store that is open read-only: on DuckDB external access is off and the
    configuration locked; what is not done after `time_limit_s` is interrupted.  Raises StoppedError then.  Where a
    statement does not heed that, `overdue` is called, from another thread."""
    running: list[Any] = []  # the connection of the driver whose statement does
    ends = time.monotonic() + time_limit_s

    def begin(connection: Connection, *_: object) -> None:
        if time.monotonic() > ends:
            raise StoppedError("it is over")
        running.append(connection.connection.driver_connection)

    def interrupt() -> None:
        for driver in running:
            with suppress(Exception):  # it has just come to its end
                driver.interrupt() if store.dialect == "duckdb" else driver.cancel()

    def give_up() -> None:
        if running and overdue is not None:
            overdue()

    listened: dict[str, Callable[..., Any]] = {
        "before_cursor_execute": begin,
        "after_cursor_execute": lambda *_: running.clear(),
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
