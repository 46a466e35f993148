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
    assert main(first) == 0
    assert [line.rstrip() for line in capsys.readouterr().out.splitlines()] == shown.splitlines()
    asked = second[1].replace("'B'", "'A'").replace("'E'", "'B'")  # of the variants that are loaded here
    assert main([second[0], asked]) == 0
    assert re.search(r"^pocket +pocket \d+ .* -> ", capsys.readouterr().out, re.MULTILINE)
