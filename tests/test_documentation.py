"""The documentation's site: its drawings are those of the schema.  `make docs`, a step of CI, builds it."""

from __future__ import annotations

import re
from pathlib import Path

from docs import generate

DOCS = Path(__file__).parents[1] / "docs"


def test_the_drawn_levels_are_those_of_the_schema() -> None:
    page = (DOCS / "views.md").read_text()
    drawn = [(DOCS / file).read_text().rstrip() for file in re.findall(r"\((figures/\w+\.mermaid)\)", page)]
    assert drawn == list(generate.level_diagrams().values())
    for relations, diagram in zip(generate.LEVELS.values(), drawn, strict=True):
        assert relations == set(re.findall(r"\b[a-z_]+\b(?= \|\||(?= : ))", diagram))
