"""A progress bar on stderr where that is a terminal; nothing where it is a file or a pipe."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Event, Thread

from relmodel.app.cli import output
from relmodel.progress import Progress, silent
from relmodel.text import visible

_TICK_S = 0.5


@contextmanager
def shown() -> Iterator[Progress]:
    """Show the progress that is reported while the block lasts; the bar is gone when it ends."""
    if output.quiet or not sys.stderr.isatty():
        yield silent
        return
    from tqdm import tqdm

    form = "{desc} |{bar:20}| {n_fmt}/{total_fmt} {elapsed}"
    with tqdm(total=1, file=sys.stderr, leave=False, bar_format=form) as bar:

        def advance(what: str, done: int, of: int) -> None:
            bar.n, bar.total = done, of
            bar.set_description_str(visible(what))

        with _ticking(bar):
            yield advance


@contextmanager
def _ticking(bar: object) -> Iterator[None]:
    """Advance the clock of a bar while no progress is reported."""
    done = Event()

    def tick() -> None:
        while not done.wait(_TICK_S):
            bar.refresh()  # type: ignore[attr-defined]

    thread = Thread(target=tick, daemon=True)
    thread.start()
    try:
        yield
    finally:
        done.set()
        thread.join()
