"""The SQL files: the only place where the project's SQL is spelled."""

from __future__ import annotations

from functools import cache

from sqlalchemy import TextClause, text

from relmodel.errors import UsageError
from relmodel.resources import resource_dir

DIALECTS = ("duckdb", "postgresql")


def schema_scripts(dialect: str) -> list[str]:
    """Texts of the files of `schema/` in their order, those that bear another dialect's name left out."""
    others = {f".{d}" for d in DIALECTS if d != dialect}
    files = sorted(resource_dir("schema").glob("*.sql"))
    return [f.read_text() for f in files if not others.intersection(f.suffixes)]


@cache
def query(name: str) -> TextClause:
    """Named query `queries/NAME.sql`; `name` may hold a folder, as in `check/occurrence_boxes`."""
    path = resource_dir("queries") / f"{name}.sql"
    if not path.is_file():
        raise UsageError(f"there is no query {name!r}: queries/ holds no file {name}.sql")
    return text(path.read_text())


def query_names(folder: str) -> list[str]:
    """Names of the queries of a folder of `queries/`, sorted."""
    return sorted(f"{folder}/{p.stem}" for p in (resource_dir("queries") / folder).glob("*.sql"))
