"""How far long work is, on stderr: a bar where that is a terminal, else a line now and then.

What is being done comes from the library; how far a run is, and how long the rest will take, from how long the steps of
the newest run of its kind took in this store."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from threading import Event, Thread

from relmodel.app.cli import output
from relmodel.names import visible
from relmodel.progress import Progress, silent
from relmodel.store import Store

_TICK_S = 0.5
_LINE_S = 10.0  # between lines where stderr is no terminal
_A_RUN_EACH = ("inspect", "load")  # kinds of which each piece of the work is a run of its own


class Watch:
    """What is being done, and how far it is; usual: steps by the kind of a run, each with seconds."""

    def __init__(self, usual: Mapping[str, Sequence[tuple[str, float]]]) -> None:
        self._usual = usual
        self._what, self._done, self._of = "working", 0, 1
        self._kind, self._passed, self._name = "", list[str](), ""
        self._began = self._step_began = self._told = time.monotonic()

    def tell(self, what: str, done: int, of: int) -> None:
        """As `Progress`."""
        if done != self._done:
            self._told = time.monotonic()
        self._what, self._done, self._of = what, done, of

    def step(self, kind: str, name: str) -> None:
        """A run of a kind began (without a name), or a step of it ended."""
        if not name:
            self._kind, self._passed = kind, []
        else:
            self._passed.append(name)
        self._step_began = time.monotonic()
        left = self._left()
        self._name = left[0][0] if left else ""

    def _left(self) -> list[tuple[str, float]]:
        """The steps that the run has before it, as far as the one before it is a guide."""
        steps = list(self._usual.get(self._kind, ()))
        for name in self._passed:
            at = next((i for i, (other, _) in enumerate(steps) if other == name), None)
            steps = steps if at is None else steps[at + 1 :]
        return steps

    def _known(self) -> tuple[float, float | None]:
        """The share done, and the seconds left where known: nothing is once it takes longer than the last."""
        now = time.monotonic()
        total = sum(seconds for _, seconds in self._usual.get(self._kind, ()))
        share, took = self._done / max(self._of, 1), now - self._began
        if total > 0 and (self._kind in _A_RUN_EACH or self._of <= 1):
            left, in_step = self._left(), now - self._step_began
            rest = sum(seconds for _, seconds in left) - (min(in_step, left[0][1]) if left else 0.0)
            seconds = (self._of - self._done - 1) * total + rest
            if seconds < 1 and left and in_step > left[0][1]:
                return 1.0, None
            return 1 - seconds / (self._of * total), seconds
        if total > 0:  # the pieces of one run, of which each may take another time
            return share, None if took > total else total - took
        # The rest takes as long for its share as what is done took, until that time is over.
        seconds = (self._told - self._began) * (1 - share) / share - (now - self._told) if share > 0 else -1.0
        return share, None if seconds < 0 else seconds

    def words(self) -> str:
        """What is being done, the step, the share done and the seconds left; where not known how long it has taken."""
        share, seconds = self._known()
        # Others tell their steps themselves.
        said = f"{self._what} ({self._name})" if self._name and self._kind == "inspect" else self._what
        said += f", {share:.0%}" if 0 < share < 1 else ""
        if seconds is None:
            return f"{said}, {time.monotonic() - self._began:.0f} s so far"
        return f"{said}, about {max(seconds, 1):.0f} s left"

    def share(self) -> float:
        """What is done of the whole, from 0 to 1."""
        return min(max(self._known()[0], 0.0), 1.0)


@contextmanager
def shown(store: Store | None = None) -> Iterator[Progress]:
    """Show the progress reported while the block lasts, and the steps of the store's runs; a bar is then gone."""
    if output.quiet:
        yield silent
        return
    watch = Watch({} if store is None else _usual_steps(store))
    if store is not None:
        store.watch = watch.step
    try:
        if not sys.stderr.isatty():
            with _ticking(lambda: output.complain(watch.words()), _LINE_S):
                yield watch.tell
            return
        from tqdm import tqdm

        with tqdm(total=1, file=sys.stderr, leave=False, bar_format="{desc} |{bar:20}| {elapsed}") as bar:

            def refresh() -> None:
                bar.n = watch.share()
                bar.set_description_str(visible(watch.words()))

            def advance(what: str, done: int, of: int) -> None:
                watch.tell(what, done, of)
                refresh()

            with _ticking(refresh, _TICK_S):
                yield advance
    finally:
        if store is not None:
            store.watch = None


def _usual_steps(store: Store) -> dict[str, list[tuple[str, float]]]:
    out: dict[str, list[tuple[str, float]]] = {}
    with store.read() as connection:
        for row in store.rows(connection, "run/usual_steps"):
            out.setdefault(row.kind, []).append((row.name, float(row.seconds or 0.0)))
    return out


@contextmanager
def _ticking(tell: Callable[[], None], every_s: float) -> Iterator[None]:
    """Tell again and again while the block lasts."""
    done = Event()

    def tick() -> None:
        while not done.wait(every_s):
            tell()

    thread = Thread(target=tick, daemon=True)
    thread.start()
    try:
        yield
    finally:
        done.set()
        thread.join()
