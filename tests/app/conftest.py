"""A browser for all tests of pages: to start one takes a second and more."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.browser import Browser, browser


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
