"""The documentation's site: what is generated says all there is, drawings are well-formed.

`make docs`, a step of CI, builds it and takes a warning, as of a link that leads nowhere or a page in no list, for an
error.
"""

from __future__ import annotations

import re
from pathlib import Path

from docs import generate
from relmodel.store import Store

DOCS = Path(__file__).parents[1] / "docs"


def test_the_dictionary_has_every_relation(duckdb_template: Path) -> None:
    with Store.open(duckdb_template, read_only=True) as store, store.read() as connection:
        relations = [row.relation for row in store.rows(connection, "store/relations")]
    page = generate.tables()
    assert set(relations) <= set(re.findall(r"^### (\w+)$", page, re.MULTILINE))
    assert "| `run_id` (key) | BIGINT | the run; see `run (id)` |" in page


def test_the_drawn_levels_are_those_of_the_schema() -> None:
    page = (DOCS / "views.md").read_text()
    drawn = [(DOCS / file).read_text().rstrip() for file in re.findall(r"\((figures/\w+\.mermaid)\)", page)]
    assert drawn == list(generate.level_diagrams().values())
    for relations, diagram in zip(generate.LEVELS.values(), drawn, strict=True):
        assert relations == set(re.findall(r"\b[a-z_]+\b(?= \|\||(?= : ))", diagram))


def test_every_flat_view_is_described(duckdb_template: Path) -> None:
    made = re.findall(r"^CREATE VIEW (\w+)", (DOCS.parent / "schema/115_flat_views.sql").read_text(), re.MULTILINE)
    described = re.findall(r"^- `(\w+)`: ", (DOCS / "views.md").read_text(), re.MULTILINE)
    with Store.open(duckdb_template, read_only=True) as store, store.read() as connection:
        views = {row.relation for row in store.rows(connection, "store/relations") if row.standing == "view"}
    assert set(made) <= set(described) <= views
