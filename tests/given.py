"""Types of what fixtures give to tests."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

Capsys = pytest.CaptureFixture[str]
CopyStore = Callable[[str], str]
NewStore = Callable[[str], str]
MakeOnce = Callable[..., Path]
