"""Kernels that are compiled before any test reads what a command says, and a browser for all tests of pages."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from relmodel.app.session import compile_behind
from relmodel.compiled import compile_ahead
from tests.browser import Browser, browser
from vision.inspection import KERNELS


@pytest.fixture(scope="session", autouse=True)
def compiled() -> None:
    """What is said of that once on a machine is said here."""
    compile_ahead(KERNELS, lambda words: None)
    compile_behind(lambda words: None)


@pytest.fixture(scope="session")
def started_browser() -> Iterator[Browser]:
    """The browser of a worker."""
    with browser() as opened:
        yield opened


@pytest.fixture
def chromium(started_browser: Browser) -> Iterator[Browser]:
    """The browser, in a window of its first size that shows nothing."""
    started_browser.call("Emulation.clearDeviceMetricsOverride")
    started_browser.call("Emulation.setEmulatedMedia", media="", features=[])
    yield started_browser
    started_browser.call("Page.navigate", url="about:blank")
