"""A headless Chromium, driven over a pipe in its own protocol (DevTools), for tests of pages."""

from __future__ import annotations

import fcntl
import json
import os
import select
import shutil
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
_PATIENCE_S = 60.0
COVERED = """(c => {
  const g = c.getContext('webgl2'), p = new Uint8Array(4 * c.width * c.height);
  g.readPixels(0, 0, c.width, c.height, g.RGBA, g.UNSIGNED_BYTE, p);
  let n = 0;
  for (let i = 3; i < p.length; i += 4) if (p[i]) n += 1;
  return n / (c.width * c.height);
})(document.getElementById('canvas'))"""
_OPTIONS = (
    "--headless=new", "--no-sandbox", "--disable-gpu", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
    "--disable-background-networking", "--disable-component-update", "--disable-sync", "--disable-extensions",
    "--disable-dev-shm-usage", "--no-first-run", "--no-default-browser-check", "--hide-scrollbars",
    "--window-size=1400,500", "--remote-debugging-pipe",
)  # fmt: skip


class Browser:
    """One page of a browser: what it was asked to fetch, and what it complained about since it was opened."""

    def __init__(self, read: int, write: int) -> None:
        self._read, self._write, self._buffer, self._count = read, write, b"", 0
        self.requests: list[str] = []
        self.complaints: list[str] = []
        self._session: str | None = None
        self._loaded: set[str] = set()  # documents, by the id of what loaded them
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        self._session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Network", "Log"):
            self.call(f"{domain}.enable")
        self.call("Page.setLifecycleEventsEnabled", enabled=True)

    def open(self, url: str) -> None:
        """Open a page and wait until it has loaded and drawn."""
        self.call("Page.navigate", url="about:blank")
        self.requests, self.complaints = [], []
        loader = self.call("Page.navigate", url=url)["loaderId"]
        self._until(lambda: loader in self._loaded)
        self.run("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(() => done(0))))")

    def run(self, script: str) -> Any:
        """What an expression gives, once its promise is kept."""
        said = self.call("Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True, userGesture=True)
        if "exceptionDetails" in said:
            raise AssertionError(said["exceptionDetails"])
        return said["result"].get("value")

    def until(self, holds: Callable[[], bool]) -> None:
        """Wait until something holds of the page, as software draws at its leisure.  Raises AssertionError if never."""
        given_up = time.monotonic() + _PATIENCE_S
        while not holds():
            assert time.monotonic() < given_up, "the page does not come to it"
            time.sleep(0.05)

    def covered(self) -> float:
        """The share of the canvas of the model in 3-D that is drawn on.  (Colours differ from one drawing to the next:
        software hides lines in surfaces that they lie in now here, now there.)"""
        return float(self.run(COVERED))

    def press(self, key: str) -> None:
        """Press the key of a character on what has the focus."""
        for way, typed in (("keyDown", key), ("keyUp", "")):
            self.call("Input.dispatchKeyEvent", type=way, key=key, text=typed, windowsVirtualKeyCode=ord(key))

    def wide(self, pixels: int, media: str = "screen") -> None:
        """Show pages in a window so wide, or as on paper so wide (media `print`)."""
        self.call("Emulation.setEmulatedMedia", media=media)
        self.call("Emulation.setDeviceMetricsOverride", width=pixels, height=500, deviceScaleFactor=1, mobile=False)

    def call(self, method: str, **parameters: Any) -> Any:
        self._count += 1
        message: dict[str, Any] = {"id": self._count, "method": method, "params": parameters}
        if self._session:
            message["sessionId"] = self._session
        os.write(self._write, json.dumps(message).encode() + b"\0")
        answer: dict[str, Any] = {}

        def answered() -> bool:
            return bool(answer)

        self._until(answered, lambda said: answer.update(said) if said.get("id") == self._count else None)
        if "error" in answer:
            raise AssertionError(f"{method}: {answer['error']}")
        return answer["result"]

    def _until(self, done: Callable[[], bool], take: Callable[[dict[str, Any]], None] | None = None) -> None:
        given_up = time.monotonic() + _PATIENCE_S
        while not done():
            if not select.select([self._read], [], [], max(0.0, given_up - time.monotonic()))[0]:
                raise AssertionError("the browser does not answer")
            chunk = os.read(self._read, 1 << 20)
            if not chunk:
                raise AssertionError("the browser ended")
            *messages, self._buffer = (self._buffer + chunk).split(b"\0")
            for message in messages:
                said = json.loads(message)
                self._note(said.get("method", ""), said.get("params", {}))
                if take is not None:
                    take(said)

    def _note(self, method: str, said: dict[str, Any]) -> None:
        if method == "Page.lifecycleEvent" and said["name"] == "load":
            self._loaded.add(said["loaderId"])
        elif method == "Network.requestWillBeSent":
            self.requests.append(said["request"]["url"])
        elif method == "Runtime.exceptionThrown":
            self.complaints.append(str(said["exceptionDetails"]))
        elif method == "Runtime.consoleAPICalled" and said["type"] in ("error", "warning", "assert"):
            self.complaints.append(str(said["args"]))
        elif method == "Log.entryAdded" and said["entry"]["level"] == "error":
            self.complaints.append(said["entry"]["text"])
        elif method == "Page.javascriptDialogOpening":
            self.complaints.append(f"a dialog: {said['message']}")


@contextmanager
def browser() -> Iterator[Browser]:
    """A browser with a profile of its own, ended with the block."""
    assert CHROMIUM is not None
    profile = tempfile.mkdtemp(prefix="relmodel-browser-")
    # The browser reads from descriptor 3 and writes to 4; these are moved there in the child, from well above them.
    read_commands, write_commands, read_answers, write_answers = (_moved_up(fd) for fd in (*os.pipe(), *os.pipe()))

    def arrange() -> None:
        os.dup2(read_commands, 3)
        os.dup2(write_answers, 4)

    with open(Path(profile) / "stderr", "wb") as said:
        process = subprocess.Popen(
            [CHROMIUM, *_OPTIONS, f"--user-data-dir={profile}", "about:blank"],
            pass_fds=(3, 4),
            preexec_fn=arrange,
            stdout=said,
            stderr=said,
            stdin=subprocess.DEVNULL,
        )
    os.close(read_commands)
    os.close(write_answers)
    try:
        yield Browser(read_answers, write_commands)
    finally:
        os.close(write_commands)
        process.terminate()
        try:
            process.wait(20)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        os.close(read_answers)
        shutil.rmtree(profile, ignore_errors=True)


def _moved_up(descriptor: int) -> int:
    above = fcntl.fcntl(descriptor, fcntl.F_DUPFD_CLOEXEC, 20)
    os.close(descriptor)
    return above
