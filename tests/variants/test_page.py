"""The commands of docs/variants.md print what the page shows."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest

from relmodel.app.cli.main import main
from tests.variants.conftest import Bulkheads

PAGE = (Path(__file__).parents[2] / "docs/variants.md").read_text()


def test_the_page_shows_what_is_printed(
    bulkheads: Bulkheads, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("RELMODEL_STORE", str(bulkheads.copy))
    first, second = (shlex.split(c) for c in re.findall(r"^```sh\nrelmodel (.*)\n```", PAGE, re.MULTILINE))
    (shown,) = re.findall(r"^```\n\n```\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)

    def printed(command: list[str]) -> list[str]:
        assert main(command) == 0
        return [line.rstrip() for line in capsys.readouterr().out.splitlines()]

    assert printed(first) == shown.splitlines()
    assert main(["diff", "B", "E", "--object", "bulkhead"]) == 0
    capsys.readouterr()
    answer = "\n".join(printed(second))
    assert re.search(r"through_hole +through_hole \d+ +diameter 12 -> 14 mm +6\b", answer)  # TH02 of the design
    assert re.search(r"diameter 184 -> 192 mm", answer)  # DUCT_B
